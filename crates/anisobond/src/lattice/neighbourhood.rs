//! The neighbourhood of a node of a regular grid: which bonds it has, and how much each counts.

use nalgebra::{Matrix3, Vector3};

use super::influence::Influence;
use crate::{Error, Result};

/// Relative tolerance within which a grid point on the border of a shape belongs to it. Offsets are integers in units
/// of the spacing, so only the user's own radius carries rounding; the decision is made here and nowhere else.
const ON_BORDER: f64 = 1e-9;

/// More bonds than this are refused before memory is taken (horizon ratio about 240).
const MOST_BONDS: f64 = 64e6;

/// Spacings (m) whose sixth powers, as bonds have them, and the squares of these are numbers.
const SPACINGS: std::ops::RangeInclusive<f64> = 1e-18..=1e18;

/// The region around a node whose grid points are its neighbours; lengths in grid spacings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// |ξ| ≤ m.
    Sphere {
        /// Radius in spacings: the horizon ratio m = δ/Δ.
        radius: f64,
    },
    /// |ξ₁|, |ξ₂|, |ξ₃| ≤ a.
    Cube {
        /// Half the edge, in spacings.
        semi_edge: f64,
    },
    /// |ξᵢ| ≤ aᵢ.
    Cuboid {
        /// Half the edges, in spacings.
        semi_axes: [f64; 3],
    },
    /// Σ (ξᵢ/aᵢ)² ≤ 1.
    Ellipsoid {
        /// Semi-axes, in spacings.
        semi_axes: [f64; 3],
    },
}

impl Shape {
    /// A shape by its name, and the horizon ratio m; what of the two sizes is not given follows from the other: the
    /// semi-axes of a cuboid or an ellipsoid are 4m/6, 5m/6 and m (P section 4.3), m is the longest semi-axis, or 6.
    ///
    /// # Errors
    /// An unknown name; semi-axes of a sphere or a cube.
    pub fn named(name: &str, horizon: Option<f64>, semi_axes: Option<[f64; 3]>) -> Result<(Shape, f64)> {
        let horizon = horizon.unwrap_or_else(|| semi_axes.map_or(6.0, |a| a.into_iter().fold(0.0, f64::max)));
        let of_horizon = [4.0 / 6.0 * horizon, 5.0 / 6.0 * horizon, horizon];
        let shape = match (name, semi_axes) {
            ("cuboid", axes) => Shape::Cuboid { semi_axes: axes.unwrap_or(of_horizon) },
            ("ellipsoid", axes) => Shape::Ellipsoid { semi_axes: axes.unwrap_or(of_horizon) },
            ("sphere", None) => Shape::Sphere { radius: horizon },
            ("cube", None) => Shape::Cube { semi_edge: horizon },
            ("sphere" | "cube", Some(_)) => {
                return Err(Error::input(
                    format!("semi-axes are given for a {name}"),
                    "choose the shape cuboid or ellipsoid, or give the horizon alone",
                ));
            }
            _ => {
                let problem = format!("{name:?} is no shape of a neighbourhood");
                return Err(Error::input(problem, "use sphere, cube, cuboid or ellipsoid"));
            }
        };
        Ok((shape, horizon))
    }

    /// Half the extent along each axis, in spacings.
    pub fn semi_axes(&self) -> [f64; 3] {
        match *self {
            Shape::Sphere { radius } => [radius; 3],
            Shape::Cube { semi_edge } => [semi_edge; 3],
            Shape::Cuboid { semi_axes } | Shape::Ellipsoid { semi_axes } => semi_axes,
        }
    }

    /// The name used on the command line.
    pub fn name(&self) -> &'static str {
        match self {
            Shape::Sphere { .. } => "sphere",
            Shape::Cube { .. } => "cube",
            Shape::Cuboid { .. } => "cuboid",
            Shape::Ellipsoid { .. } => "ellipsoid",
        }
    }

    /// Whether a grid offset belongs to the shape; points on the border do.
    fn contains(&self, offset: [i32; 3]) -> bool {
        let [x, y, z] = offset.map(f64::from);
        match *self {
            Shape::Sphere { radius } => x * x + y * y + z * z <= radius * radius * (1.0 + ON_BORDER),
            Shape::Cube { .. } | Shape::Cuboid { .. } => {
                let axes = self.semi_axes();
                [x, y, z].iter().zip(axes).all(|(x, a)| x.abs() <= a * (1.0 + ON_BORDER))
            }
            Shape::Ellipsoid { semi_axes: [a, b, c] } => {
                (x / a).powi(2) + (y / b).powi(2) + (z / c).powi(2) <= 1.0 + ON_BORDER
            }
        }
    }
}

/// One bond of a neighbourhood, from the node to a neighbour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bond {
    /// Grid offset of the neighbour before any rotation of the neighbourhood.
    pub offset: [i32; 3],
    /// Bond vector ξ (m), after rotation.
    pub xi: Vector3<f64>,
    /// Influence ω > 0 (–).
    pub influence: f64,
}

/// The bonds of a bulk node of a regular grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Neighbourhood {
    shape: Shape,
    horizon: f64,
    spacing: f64,
    influence: Influence,
    orientation: Matrix3<f64>,
    bonds: Vec<Bond>,
}

impl Neighbourhood {
    /// The neighbourhood of a shape on a grid of a given spacing Δ (m), with horizon ratio m = δ/Δ for the influence
    /// function. Bonds of zero influence are not bonds and are left out.
    ///
    /// Order: by the third offset, then the second, then the first. If ξ is a bond, so is −ξ.
    ///
    /// # Errors
    /// Lengths that are not positive and finite, a shape that holds no neighbour, a length outside a user's influence
    /// table, or more than 64 million bonds.
    pub fn new(shape: Shape, horizon: f64, spacing: f64, influence: Influence) -> Result<Self> {
        let axes = shape.semi_axes();
        for (name, value) in
            [("spacing", spacing), ("horizon", horizon)].into_iter().chain(axes.map(|a| ("semi-axis", a)))
        {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::input(format!("{name} = {value}"), "give a positive, finite length"));
            }
        }
        if !SPACINGS.contains(&spacing) {
            let (least, most) = (SPACINGS.start(), SPACINGS.end());
            return Err(Error::input(
                format!("a grid spacing of {spacing:e} m is beyond what can be computed with"),
                format!("give one between {least:e} and {most:e} m, or check the unit"),
            ));
        }
        if axes.iter().all(|&a| a * (1.0 + ON_BORDER) < 1.0) {
            return Err(Error::input(
                format!("the horizon ({} spacings) is below the grid spacing: a node has no neighbour", axes[0]),
                "use a horizon of at least 1 spacing (3 is common)",
            ));
        }
        if axes.iter().map(|a| 2.0 * a + 1.0).product::<f64>() > MOST_BONDS {
            return Err(Error::input(
                format!("semi-axes {axes:?} hold more than {MOST_BONDS:e} grid points"),
                "use a smaller horizon",
            ));
        }
        let reach = axes.map(|a| (a * (1.0 + ON_BORDER)).floor() as i32);
        let mut bonds = Vec::new();
        for k in -reach[2]..=reach[2] {
            for j in -reach[1]..=reach[1] {
                for i in -reach[0]..=reach[0] {
                    let offset = [i, j, k];
                    if offset == [0, 0, 0] || !shape.contains(offset) {
                        continue;
                    }
                    let relative = offset_length(offset) / horizon;
                    // A point on the border is at the horizon itself: ω(1), whatever the rounding.
                    let relative = if (relative - 1.0).abs() <= ON_BORDER { 1.0 } else { relative };
                    let influence = influence.weight(relative)?;
                    if influence > 0.0 {
                        bonds.push(Bond { offset, xi: spacing * Vector3::from(offset.map(f64::from)), influence });
                    }
                }
            }
        }
        if bonds.is_empty() {
            return Err(Error::input(
                "every bond of the neighbourhood has zero influence",
                "use a larger horizon or another influence function",
            ));
        }
        Ok(Neighbourhood { shape, horizon, spacing, influence, orientation: Matrix3::identity(), bonds })
    }

    /// A spherical neighbourhood of horizon ratio m.
    ///
    /// # Errors
    /// As [`Neighbourhood::new`].
    pub fn sphere(horizon: f64, spacing: f64, influence: Influence) -> Result<Self> {
        Neighbourhood::new(Shape::Sphere { radius: horizon }, horizon, spacing, influence)
    }

    /// The neighbourhood turned or reflected: every bond ξ becomes Qξ (P section 4.3.2); the material stays.
    ///
    /// # Errors
    /// A matrix that is not orthogonal to 10⁻⁹.
    pub fn rotated(&self, q: &Matrix3<f64>) -> Result<Self> {
        let error = (q * q.transpose() - Matrix3::identity()).norm();
        if error.is_nan() || error > 1e-9 {
            return Err(Error::input("the rotation matrix is not orthogonal", "give Q with Q·Qᵀ = 1"));
        }
        let mut turned = self.clone();
        turned.orientation = q * self.orientation;
        for bond in &mut turned.bonds {
            bond.xi = self.spacing * (turned.orientation * Vector3::from(bond.offset.map(f64::from)));
        }
        Ok(turned)
    }

    /// The bonds.
    pub fn bonds(&self) -> &[Bond] {
        &self.bonds
    }

    /// The shape, in spacings.
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// Horizon ratio m = δ/Δ.
    pub fn horizon(&self) -> f64 {
        self.horizon
    }

    /// Grid spacing Δ (m).
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// The influence function.
    pub fn influence(&self) -> &Influence {
        &self.influence
    }

    /// The rotation or reflection Q applied to the grid (identity unless [`Neighbourhood::rotated`]).
    pub fn orientation(&self) -> &Matrix3<f64> {
        &self.orientation
    }

    /// s = ½ ω |ξ| ΔV (m⁴) of a bond: its share of the stiffness per unit micromodulus, C = Σ c s n⊗n⊗n⊗n (P eq 29).
    pub fn stiffness_share(&self, bond: &Bond) -> f64 {
        0.5 * bond.influence * offset_length(bond.offset) * self.spacing.powi(4)
    }
}

/// |ξ| in spacings; exact integers under the root, so that equal lengths are equal numbers.
fn offset_length(offset: [i32; 3]) -> f64 {
    let squared: i64 = offset.iter().map(|&x| i64::from(x) * i64::from(x)).sum();
    (squared as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(shape: Shape, horizon: f64) -> usize {
        Neighbourhood::new(shape, horizon, 1.0, Influence::Inverse).unwrap().bonds().len()
    }

    /// P section 4 and Figs 13, 16: 925 counts the centre.
    #[test]
    fn bond_counts_of_the_document() {
        assert_eq!(count(Shape::Sphere { radius: 6.0 }, 6.0), 924);
        assert_eq!(count(Shape::Cube { semi_edge: 6.0 }, 6.0), 2196);
        assert_eq!(count(Shape::Cuboid { semi_axes: [4.0, 5.0, 6.0] }, 6.0), 1286);
        assert_eq!(count(Shape::Ellipsoid { semi_axes: [4.0, 5.0, 6.0] }, 6.0), 490);
        assert_eq!(count(Shape::Cube { semi_edge: 3.0 }, 3.0), 342);
        assert_eq!(count(Shape::Sphere { radius: 3.0 }, 3.0), 122);
        assert_eq!(count(Shape::Sphere { radius: 1.0 }, 1.0), 6);
    }

    #[test]
    fn a_point_on_the_border_belongs_for_every_shape() {
        for (factor, count_1) in [(0.9999, 92), (1.0, 122), (1.0001, 122)] {
            assert_eq!(count(Shape::Sphere { radius: 3.0 * factor }, 3.0 * factor), count_1, "{factor}");
        }
        // √11 as a user would compute it.
        assert_eq!(count(Shape::Sphere { radius: 11f64.sqrt() }, 3.0), count(Shape::Sphere { radius: 3.317 }, 3.0));
        assert_eq!(count(Shape::Cube { semi_edge: 0.1 * 3.0 * 10.0 }, 3.0), 342);
        assert_eq!(count(Shape::Cube { semi_edge: 2.9999 }, 3.0), 124);
        for factor in [0.9999, 1.0, 1.0001] {
            let axes = [2.0 * factor, 3.0 * factor, 1.0 * factor];
            let inside = count(Shape::Ellipsoid { semi_axes: axes }, 3.0);
            assert_eq!(inside >= count(Shape::Ellipsoid { semi_axes: [2.0, 3.0, 1.0] }, 3.0), factor >= 1.0);
        }
    }

    #[test]
    fn zero_influence_is_no_bond() {
        let hat = Neighbourhood::sphere(3.0, 1.0, Influence::Hat).unwrap();
        assert!(hat.bonds().len() < 122 && hat.bonds().iter().all(|b| b.influence > 0.0));
        let corners = Neighbourhood::new(Shape::Cube { semi_edge: 2.0 }, 2.0, 1.0, Influence::Power).unwrap();
        assert!(corners.bonds().iter().all(|b| b.xi.norm() < 2.0));
        assert!(Neighbourhood::sphere(1.0, 1.0, Influence::Hat).is_err());
    }

    #[test]
    fn wrong_lengths_are_refused() {
        for (m, spacing) in [(0.5, 1.0), (-3.0, 1.0), (f64::NAN, 1.0), (3.0, 0.0), (3.0, f64::INFINITY), (1e9, 1.0)] {
            assert!(Neighbourhood::sphere(m, spacing, Influence::Constant).is_err(), "{m} {spacing}");
        }
    }
}
