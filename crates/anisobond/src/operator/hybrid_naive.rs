//! The hybrid model on a periodic block of a grid, bond by bond: slow, obvious, the oracle of its waves and of kernels
//! to come.

use nalgebra::{Matrix3, Vector3};

use super::grid_operator::Kinematics;
use crate::calibration::StrainAverage;
use crate::lattice::Neighbourhood;
use crate::tensor::Stiffness;
use crate::{Error, Result};

/// A periodic block of nodes with bonds and a nodal term.
pub struct PeriodicHybrid<'a> {
    neighbourhood: &'a Neighbourhood,
    average: StrainAverage,
    micromodulus: &'a [f64],
    nodal: Stiffness,
    cells: [usize; 3],
    kinematics: Kinematics,
}

/// What a displacement of a periodic block costs.
#[derive(Clone, Debug)]
pub struct BlockResponse {
    /// Energy (J).
    pub energy: f64,
    /// Force on every node, −∂energy/∂u (N).
    pub forces: Vec<Vector3<f64>>,
    /// Mean stress, ∂energy/∂(displacement gradient) per volume (Pa): at finite stretch the nominal one.
    pub stress: Matrix3<f64>,
}

impl<'a> PeriodicHybrid<'a> {
    /// A block of so many nodes along each grid axis; micromoduli (N/m⁶) in the neighbourhood's order, Z in Pa.
    ///
    /// # Errors
    /// A block without nodes, a number of micromoduli other than that of the bonds, or bonds that lie in a plane.
    pub fn new(
        neighbourhood: &'a Neighbourhood,
        micromodulus: &'a [f64],
        nodal: &Stiffness,
        cells: [usize; 3],
    ) -> Result<Self> {
        if cells.contains(&0) {
            return Err(Error::input("the block has no nodes", "give at least one node along each axis"));
        }
        if micromodulus.len() != neighbourhood.bonds().len() {
            return Err(Error::input(
                format!("{} micromoduli for {} bonds", micromodulus.len(), neighbourhood.bonds().len()),
                "give one micromodulus per bond, in the neighbourhood's order",
            ));
        }
        let average = StrainAverage::new(neighbourhood)?;
        Ok(PeriodicHybrid {
            neighbourhood,
            average,
            micromodulus,
            nodal: *nodal,
            cells,
            kinematics: Kinematics::Linear,
        })
    }

    /// The same block with other kinematics than linear ones.
    pub fn with_kinematics(self, kinematics: Kinematics) -> Self {
        PeriodicHybrid { kinematics, ..self }
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.cells.iter().product()
    }

    /// Grid coordinates of a node, the first axis fastest.
    pub fn coordinates(&self, node: usize) -> [usize; 3] {
        let [a, b, _] = self.cells;
        [node % a, node / a % b, node / (a * b)]
    }

    /// The node at the other end of a bond, through the block's faces.
    fn neighbour(&self, node: usize, offset: [i32; 3]) -> usize {
        let at = self.coordinates(node);
        let [i, j, k]: [usize; 3] =
            std::array::from_fn(|a| (at[a] as i64 + i64::from(offset[a])).rem_euclid(self.cells[a] as i64) as usize);
        i + self.cells[0] * (j + self.cells[1] * k)
    }

    /// Energy, forces and mean stress of periodic displacements u (m, one per node) on top of a uniform displacement
    /// gradient H (–): a bond's relative displacement is η = u_B − u_A + H ξ.
    ///
    /// # Errors
    /// A number of displacements other than that of the nodes.
    pub fn response(&self, u: &[Vector3<f64>], gradient: &Matrix3<f64>) -> Result<BlockResponse> {
        if u.len() != self.nodes() {
            return Err(Error::input(
                format!("{} displacements for {} nodes", u.len(), self.nodes()),
                "give one displacement per node",
            ));
        }
        let bonds = self.neighbourhood.bonds();
        let volume = self.neighbourhood.spacing().powi(3);
        let mut out = BlockResponse { energy: 0.0, forces: vec![Vector3::zeros(); u.len()], stress: Matrix3::zeros() };
        for a in 0..u.len() {
            let ends: Vec<usize> = bonds.iter().map(|bond| self.neighbour(a, bond.offset)).collect();
            let eta: Vec<Vector3<f64>> =
                bonds.iter().zip(&ends).map(|(bond, &b)| u[b] - u[a] + gradient * bond.xi).collect();
            let mean = self.average.gradient(eta.iter().copied());
            let (strain, energy_stress, nodal_stress) = nodal_response(&self.nodal, self.kinematics, &mean);
            out.energy += 0.5 * volume * energy_stress.dot(&strain);
            for (i, bond) in bonds.iter().enumerate() {
                let (elongation, n) = match self.kinematics {
                    Kinematics::Linear => (bond.xi.dot(&eta[i]) / bond.xi.norm(), bond.xi.normalize()),
                    Kinematics::Finite => {
                        let to = bond.xi + eta[i];
                        (eta[i].dot(&(to + bond.xi)) / (to.norm() + bond.xi.norm()), to.normalize())
                    }
                };
                let stiffness = self.micromodulus[i] * self.neighbourhood.stiffness_share(bond);
                let stretch = elongation / bond.xi.norm();
                out.energy += 0.5 * volume * stiffness * stretch * stretch;
                // ∂energy/∂η of this node's half of the bond and of its nodal term.
                let pull =
                    volume * (stiffness * stretch / bond.xi.norm() * n + nodal_stress * self.average.gradients()[i]);
                out.forces[a] += pull;
                out.forces[ends[i]] -= pull;
                out.stress += pull * bond.xi.transpose();
            }
        }
        out.stress /= volume * u.len() as f64;
        Ok(out)
    }
}

/// Strain, the stress that is conjugate to it, and the nominal stress ∂(energy density)/∂H of a nodal term at a gradient H:
/// ε̄ = sym H and Z:ε̄ twice, or with F̄ = 1 + H, E = ½(F̄ᵀF̄ − 1), Z:E and F̄ (Z:E) (THEORY 10).
pub(super) fn nodal_response(
    z: &Stiffness,
    kinematics: Kinematics,
    h: &Matrix3<f64>,
) -> (Matrix3<f64>, Matrix3<f64>, Matrix3<f64>) {
    let f = Matrix3::identity() + h;
    let linear = 0.5 * (h + h.transpose());
    match kinematics {
        Kinematics::Linear => {
            let stress = double_dot(z, &linear);
            (linear, stress, stress)
        }
        Kinematics::Finite => {
            let strain = linear + 0.5 * h.transpose() * h;
            let stress = double_dot(z, &strain);
            (strain, stress, f * stress)
        }
    }
}

/// σ_ij = Z_ijkl ε_kl.
pub(super) fn double_dot(z: &Stiffness, strain: &Matrix3<f64>) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| {
        let mut sum = 0.0;
        for k in 0..3 {
            for l in 0..3 {
                sum += z.component(i, j, k, l) * strain[(k, l)];
            }
        }
        sum
    })
}
