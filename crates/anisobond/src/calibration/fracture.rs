//! When bonds break: critical stretches from the energy of the bonds that cross a plane.
//!
//! On a grid, |n·ξ|/ΔV bonds of a vector ξ cross a unit area of a plane of unit normal n: on average over the planes of
//! any normal, and exactly for a plane between two layers of nodes of any lattice plane. A bond of stiffness
//! k = ω c ΔV²/|ξ| (N/m) that breaks at the stretch s takes ½ k |ξ|² s², so the fracture energy is
//!
//! G(n) = (1/ΔV) Σ_half |n·ξ| ½ k |ξ|² s²: linear in s².
//!
//! As a function of n this is a sum of |n·ξ| with weights ≥ 0, so it is convex when continued to all vectors as a
//! function of degree 1. A wanted G(n) that is not can be had by no critical stretches; a crack would not keep to such a
//! plane, for a zigzag of others costs less.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Vector3};
use serde::{Deserialize, Serialize};

use super::SphereRule;
use super::bounded_squares::bounded_least_squares;
use super::calibrator::primitive_direction;
use crate::lattice::Neighbourhood;
use crate::{Error, Result};

/// Degree of the rule over directions; its normals of one half-sphere are the planes fitted.
const DEGREE: usize = 17;

/// Normals of a fit around an axis, over half a turn.
const AROUND: usize = 90;

/// Planes with Miller indices up to this are fitted too.
const LARGEST_INDEX: i32 = 2;

/// Weight of closeness to one common stretch against closeness to the wanted energy (both relative).
const UNIFORMITY: f64 = 3e-4;

/// No bond gets less than this part of the s² that it would have if every plane had the energy of the weakest: bonds that break
/// much before others do so all over a body, before any crack runs.
const LEAST_SQUARE: f64 = 0.5;

/// Which planes a crack may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CrackPlanes {
    /// Planes of every normal.
    All,
    /// Planes that contain this axis (of any length): cracks in a plate or in plane strain.
    Around(Vector3<f64>),
}

impl CrackPlanes {
    /// Unit normals, one of ±, with weights that add to 1.
    fn normals(&self) -> Result<Vec<(Vector3<f64>, f64)>> {
        match self {
            CrackPlanes::All => {
                let half = |n: &Vector3<f64>| (n.z, n.y, n.x) > (0.0, 0.0, 0.0);
                let rule = SphereRule::GaussProduct { degree: DEGREE }.points();
                let mut normals: Vec<_> = rule.into_iter().filter(|(n, _)| half(n)).collect();
                let sum: f64 = normals.iter().map(|(_, w)| w).sum();
                normals.iter_mut().for_each(|(_, w)| *w /= sum);
                Ok(normals)
            }
            CrackPlanes::Around(axis) => {
                let axis = axis.try_normalize(0.0).filter(|a| a.iter().all(|x| x.is_finite())).ok_or_else(|| {
                    Error::input("the axis of the crack planes is zero", "give a vector of any length but zero")
                })?;
                let first = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
                let second = axis.cross(&first);
                let at = |k: usize| std::f64::consts::PI * (k as f64 + 0.5) / AROUND as f64;
                let normal = |k: usize| first * at(k).cos() + second * at(k).sin();
                Ok((0..AROUND).map(|k| (normal(k), 1.0 / AROUND as f64)).collect())
            }
        }
    }

    /// Unit normals of the lattice planes of low index of the neighbourhood's grid among these planes.
    fn lattice_normals(&self, neighbourhood: &Neighbourhood) -> Vec<Vector3<f64>> {
        let range = -LARGEST_INDEX..=LARGEST_INDEX;
        let mut normals = BTreeMap::new();
        for i in range.clone() {
            for j in range.clone() {
                for k in range.clone().filter(|&k| [i, j, k] != [0, 0, 0]) {
                    let miller = primitive_direction([i, j, k]);
                    let n = (neighbourhood.orientation() * Vector3::from(miller.map(f64::from))).normalize();
                    if self.holds(&n) {
                        normals.insert(miller, n);
                    }
                }
            }
        }
        normals.into_values().collect()
    }

    /// The unit normal among these planes where a function is least: the least of many, then better ones nearby.
    fn least(&self, of: impl Fn(&Vector3<f64>) -> f64) -> Result<Vector3<f64>> {
        let normals = self.normals()?;
        let mut best = normals[0].0;
        for (n, _) in &normals {
            if of(n) < of(&best) {
                best = *n;
            }
        }
        let mut step = 0.1;
        while step > 1e-4 {
            let trials = (0..6).filter_map(|k| {
                let side = if k % 2 == 0 { step } else { -step };
                let mut n: Vector3<f64> = best + side * Vector3::ith(k / 2, 1.0);
                if let CrackPlanes::Around(axis) = self {
                    n -= axis * (axis.dot(&n) / axis.norm_squared());
                }
                n.try_normalize(1e-9)
            });
            match trials.min_by(|a, b| of(a).total_cmp(&of(b))).filter(|n| of(n) < of(&best)) {
                Some(better) => best = better,
                None => step *= 0.5,
            }
        }
        Ok(best)
    }

    /// Whether a unit normal is among these planes.
    fn holds(&self, n: &Vector3<f64>) -> bool {
        match self {
            CrackPlanes::All => true,
            CrackPlanes::Around(axis) => axis.dot(n).abs() <= 1e-9 * axis.norm(),
        }
    }
}

/// How well the reached fracture energy follows the wanted one.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FractureReport {
    /// Wanted fracture energy, mean over the planes (J/m²).
    pub wanted_mean: f64,
    /// Reached fracture energy, mean over the planes (J/m²).
    pub reached_mean: f64,
    /// Root mean square of (G − wanted)/wanted over the planes.
    pub rms_deviation: f64,
    /// Largest |G − wanted|/wanted, lattice planes included.
    pub largest_deviation: f64,
    /// Unit normal where it occurs.
    pub largest_at: [f64; 3],
    /// Reached over wanted energy, smallest and largest.
    pub ratio_range: [f64; 2],
    /// Smallest and largest critical stretch of the bonds that have stiffness (–).
    pub stretch_range: [f64; 2],
    /// Planes of low index of the grid: unit normal, wanted and reached energy (J/m²).
    pub lattice_planes: Vec<([f64; 3], f64, f64)>,
}

/// Critical stretches of the bonds of a bulk node.
#[derive(Clone, Debug)]
pub struct CriticalStretches {
    /// Critical stretch of every bond (–), in the neighbourhood's order; infinite for bonds without stiffness.
    pub stretch: Vec<f64>,
    /// What they give against what was wanted.
    pub report: FractureReport,
}

impl CriticalStretches {
    /// One stretch for all bonds whose fracture energy, on average over the planes, is `energy` (J/m²). For uniform c and
    /// ω = 1 it tends to √(5 G/9Kδ) (Silling & Askari 2005, eq 28) as the grid is refined.
    ///
    /// # Errors
    /// An energy that is not positive; bonds without any stiffness; a zero axis.
    pub fn uniform(
        neighbourhood: &Neighbourhood,
        micromodulus: &[f64],
        energy: f64,
        planes: CrackPlanes,
    ) -> Result<Self> {
        require_energy(energy)?;
        let bonds = CrossingBonds::new(neighbourhood, micromodulus)?;
        let normals = planes.normals()?;
        let square = bonds.uniform_square(&normals, |_| energy);
        bonds.with_squares(neighbourhood, &vec![square; bonds.groups.len()], planes, |_| energy)
    }

    /// A stretch per direction of bonds, so that G(n) follows the wanted fracture energy (J/m²) for every plane: least
    /// squares of the relative deviation with s² at least half of what a uniform stretch has whose energy is that of the weakest
    /// plane, and among nearly equal fits the one closest to a uniform stretch. Bonds of one direction share their stretch.
    ///
    /// # Errors
    /// Energies that are not positive; bonds without any stiffness; a zero axis.
    pub fn directional(
        neighbourhood: &Neighbourhood,
        micromodulus: &[f64],
        planes: CrackPlanes,
        wanted: impl Fn(&Vector3<f64>) -> f64,
    ) -> Result<Self> {
        let bonds = CrossingBonds::new(neighbourhood, micromodulus)?;
        let normals = planes.normals()?;
        for (n, _) in &normals {
            require_energy(wanted(n))?;
        }
        let square = bonds.uniform_square(&normals, &wanted);
        // The planes of low index are real cracks' planes: they count as much as the others together. The weakest counts
        // half as much: near it the energy may change fast.
        let lattice = planes.lattice_normals(neighbourhood);
        let weakest = planes.least(&wanted)?;
        let share = 0.4 / lattice.len().max(1) as f64;
        let rows: Vec<(Vector3<f64>, f64)> = normals
            .iter()
            .map(|(n, w)| (*n, 0.4 * w))
            .chain(lattice.iter().map(|n| (*n, share)))
            .chain([(weakest, 0.2)])
            .collect();
        let a = DMatrix::from_fn(rows.len(), bonds.groups.len(), |row, group| {
            let (n, w) = &rows[row];
            w.sqrt() * square * bonds.crossing(group, n) / wanted(n)
        });
        let g = DVector::from_iterator(rows.len(), rows.iter().map(|(_, w)| w.sqrt()));
        // In units of the uniform s²; every group's departure counts by its part of the energy.
        let total: f64 = bonds.groups.iter().map(|g| g.energy).sum();
        let weights = bonds.groups.iter().map(|g| UNIFORMITY * g.energy / total);
        let weights = DVector::from_iterator(bonds.groups.len(), weights);
        let matrix = a.transpose() * &a + DMatrix::from_diagonal(&weights);
        let least = LEAST_SQUARE * bonds.uniform_square(&normals, |_| wanted(&weakest)) / square;
        let x = bounded_least_squares(&matrix, &(a.transpose() * g + weights), least);
        let squares: Vec<f64> = x.iter().map(|x| x * square).collect();
        bonds.with_squares(neighbourhood, &squares, planes, wanted)
    }
}

/// G(n) = (1/ΔV) Σ_half |n·ξ| ½ k |ξ|² s² (J/m²) for the unit normal n: the energy per area of the bonds that cross a
/// plane, each at its critical stretch. Bonds without stiffness count nothing.
///
/// # Errors
/// Lists of another length than the bonds.
pub fn fracture_energy(
    neighbourhood: &Neighbourhood,
    micromodulus: &[f64],
    stretch: &[f64],
    n: &Vector3<f64>,
) -> Result<f64> {
    require_length(neighbourhood, "micromoduli", micromodulus.len())?;
    require_length(neighbourhood, "critical stretches", stretch.len())?;
    let bonds = neighbourhood.bonds().iter().zip(micromodulus).zip(stretch).filter(|((_, c), _)| **c > 0.0);
    // Both ends of every bond are in the list, so half of it counts.
    Ok(bonds.map(|((b, c), s)| 0.5 * b.xi.dot(n).abs() * energy_density(neighbourhood, b, *c) * s * s).sum())
}

/// ½ k |ξ|²/ΔV (J/m³) of a bond at stretch 1, k = ω c ΔV²/|ξ|.
fn energy_density(neighbourhood: &Neighbourhood, bond: &crate::lattice::Bond, c: f64) -> f64 {
    0.5 * bond.influence * c * neighbourhood.spacing().powi(3) * bond.xi.norm()
}

fn require_length(neighbourhood: &Neighbourhood, what: &str, found: usize) -> Result<()> {
    let wanted = neighbourhood.bonds().len();
    if found == wanted {
        return Ok(());
    }
    Err(Error::input(format!("{found} {what} for {wanted} bonds"), "give one number per bond of the neighbourhood"))
}

fn require_energy(energy: f64) -> Result<()> {
    if energy.is_finite() && energy > 0.0 {
        return Ok(());
    }
    Err(Error::input(format!("the fracture energy is {energy} J/m²"), "give a positive number"))
}

/// Bonds of one direction.
struct Group {
    /// Unit vector along them.
    direction: Vector3<f64>,
    /// Σ_half |ξ| ½ k |ξ|²/ΔV (J/m²): their G(n) per |n·direction| and s².
    energy: f64,
}

/// The bonds that have stiffness, by direction.
struct CrossingBonds {
    groups: Vec<Group>,
    /// Group of every bond of the neighbourhood; `None` without stiffness.
    group_of_bond: Vec<Option<usize>>,
}

impl CrossingBonds {
    fn new(neighbourhood: &Neighbourhood, micromodulus: &[f64]) -> Result<Self> {
        require_length(neighbourhood, "micromoduli", micromodulus.len())?;
        let mut index: BTreeMap<[i32; 3], usize> = BTreeMap::new();
        let mut groups: Vec<Group> = Vec::new();
        let mut group_of_bond = Vec::new();
        for (bond, &c) in neighbourhood.bonds().iter().zip(micromodulus) {
            if !(c.is_finite() && c >= 0.0) {
                return Err(Error::input(format!("a bond has the micromodulus {c}"), "give numbers ≥ 0"));
            }
            if c == 0.0 {
                group_of_bond.push(None);
                continue;
            }
            let group = *index.entry(primitive_direction(bond.offset)).or_insert_with(|| {
                groups.push(Group { direction: bond.xi.normalize(), energy: 0.0 });
                groups.len() - 1
            });
            groups[group].energy += 0.5 * bond.xi.norm() * energy_density(neighbourhood, bond, c);
            group_of_bond.push(Some(group));
        }
        if groups.is_empty() {
            return Err(Error::input("no bond has any stiffness", "calibrate the bonds first"));
        }
        Ok(CrossingBonds { groups, group_of_bond })
    }

    /// G(n) of a group per s² (J/m²).
    fn crossing(&self, group: usize, n: &Vector3<f64>) -> f64 {
        self.groups[group].energy * self.groups[group].direction.dot(n).abs()
    }

    /// The s² common to all bonds whose mean G is the mean wanted one.
    fn uniform_square(&self, normals: &[(Vector3<f64>, f64)], wanted: impl Fn(&Vector3<f64>) -> f64) -> f64 {
        let all = |n: &Vector3<f64>| (0..self.groups.len()).map(|k| self.crossing(k, n)).sum::<f64>();
        let mean = |f: &dyn Fn(&Vector3<f64>) -> f64| normals.iter().map(|(n, w)| w * f(n)).sum::<f64>();
        mean(&wanted) / mean(&all)
    }

    /// The stretches of given squares per group, with their report.
    fn with_squares(
        &self,
        neighbourhood: &Neighbourhood,
        squares: &[f64],
        planes: CrackPlanes,
        wanted: impl Fn(&Vector3<f64>) -> f64,
    ) -> Result<CriticalStretches> {
        let stretch = self.group_of_bond.iter().map(|g| g.map_or(f64::INFINITY, |g| squares[g].sqrt())).collect();
        let reached = |n: &Vector3<f64>| (0..squares.len()).map(|k| squares[k] * self.crossing(k, n)).sum::<f64>();
        let normals = planes.normals()?;
        let lattice = planes.lattice_normals(neighbourhood);
        let mean = |f: &dyn Fn(&Vector3<f64>) -> f64| normals.iter().map(|(n, w)| w * f(n)).sum::<f64>();
        let ratio = |n: &Vector3<f64>| reached(n) / wanted(n);
        let all: Vec<(Vector3<f64>, f64)> =
            normals.iter().map(|(n, _)| n).chain(&lattice).map(|n| (*n, ratio(n))).collect();
        let worst = all.iter().max_by(|x, y| (x.1 - 1.0).abs().total_cmp(&(y.1 - 1.0).abs()));
        let (largest_at, largest) = worst.map_or((Vector3::zeros(), 1.0), |w| *w);
        let range = |values: &mut dyn Iterator<Item = f64>| {
            values.fold([f64::INFINITY, 0.0], |[low, high], x| [low.min(x), f64::max(high, x)])
        };
        let report = FractureReport {
            wanted_mean: mean(&wanted),
            reached_mean: mean(&reached),
            rms_deviation: mean(&|n| (ratio(n) - 1.0).powi(2)).sqrt(),
            largest_deviation: (largest - 1.0).abs(),
            largest_at: largest_at.into(),
            ratio_range: range(&mut all.iter().map(|x| x.1)),
            stretch_range: range(&mut squares.iter().map(|x| x.sqrt())),
            lattice_planes: lattice.iter().map(|n| ((*n).into(), wanted(n), reached(n))).collect(),
        };
        Ok(CriticalStretches { stretch, report })
    }
}
