//! The stiffness of a bond that passes through several materials.
//!
//! Materials that lie as layers of normal ν share the traction σ·ν and the strain in their plane, whatever the layers'
//! thicknesses: three numbers each, from which the strain of every material follows (Backus 1962). A bond of direction n,
//! of which the parts f_r lie in the materials r, is stretched by e = Σ f_r n·ε_r·n and should pull as the materials do on the
//! mean over its parts, t = Σ f_r k_r n·ε_r·n, and hold what they hold, w = Σ f_r k_r (n·ε_r·n)², with k_r its stiffness wholly
//! in r. Over the six states, each taken at the same energy, the stiffness closest to the first is Σ e t / Σ e², that which gives
//! the second Σ w / Σ e². It has three quarters of the one and a quarter of the other:
//!
//! k = Σ (¾ e t + ¼ w) / Σ e².
//!
//! Across the layers, where k_r n·ε_r·n is the same in all, the parts are springs in series, 1/k = Σ f_r/k_r; along
//! them, where the strain is the same, they lie side by side, k = Σ f_r k_r. Bonds between follow the state that stretches
//! them most.

use nalgebra::{Cholesky, Matrix3, Matrix6, Vector3, Vector6};

use crate::tensor::{PAIRS, Stiffness, mandel_weight};

/// Weight of states of strain in the plane beside those of traction, at equal energy. Less of it makes stacks of soft and
/// stiff layers more exact across, and their stiff layers thinner along: measured in docs/bodies.md.
const IN_PLANE: f64 = 0.5;

/// Part of the stiffness that is by energy, the rest is by force: measured there too, between materials whose stiff directions
/// differ.
const BY_ENERGY: f64 = 0.25;

/// Places of the strains that a traction on the layers works on (11, 13, 12), and of those in their plane (22, 33, 23).
const ACROSS: [usize; 3] = [0, 4, 5];
const ALONG: [usize; 3] = [1, 2, 3];

/// Least eigenvalue of a stiffness over its largest, below which it counts as none: bonds of few directions leave shears without
/// any, to rounding.
const FLAT: f64 = 1e-9;

/// The strains of some materials that lie as layers.
#[derive(Clone, Debug)]
pub struct Layers {
    /// Rows ν and two directions in the plane.
    frame: Matrix3<f64>,
    /// By material: its strains (Kelvin-Mandel, in the frame) in the six states, as columns.
    states: Vec<Matrix6<f64>>,
}

impl Layers {
    /// Layers of a unit normal; `None` where a stiffness is not positive definite.
    pub fn new(materials: &[Stiffness], normal: &Vector3<f64>) -> Option<Self> {
        let first = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
        let second = normal.cross(&first);
        let frame = Matrix3::from_rows(&[normal.transpose(), first.transpose(), second.transpose()]);
        let mut parts = Vec::with_capacity(materials.len());
        let (mut compliance, mut in_plane) = (Matrix3::zeros(), Matrix3::zeros());
        for material in materials {
            let values = material.mandel().symmetric_eigenvalues();
            if values.min() <= FLAT * values.max() {
                return None;
            }
            let turned = material.rotated(&frame);
            let block =
                |rows: [usize; 3], columns: [usize; 3]| Matrix3::from_fn(|i, j| turned.mandel()[(rows[i], columns[j])]);
            let across = Cholesky::new(block(ACROSS, ACROSS))?.inverse();
            let coupling = block(ACROSS, ALONG);
            compliance += across;
            in_plane += block(ALONG, ALONG) - coupling.transpose() * across * coupling;
            parts.push((across, -across * coupling));
        }
        // Twice the energy of a traction s is s·Σ C_NN⁻¹ s, that of a strain t in the plane t·Σ (C_TT − C_TN C_NN⁻¹ C_NT) t:
        // with W Wᵀ the inverse, the columns of W are states of one energy.
        let tractions = Cholesky::new(compliance)?.l().try_inverse()?.transpose();
        let strains = Cholesky::new(in_plane)?.l().try_inverse()?.transpose() * IN_PLANE.sqrt();
        let states = parts.into_iter().map(|(across, coupled)| {
            let mut states = Matrix6::zeros();
            let (by_traction, by_strain) = (across * tractions, coupled * strains);
            for i in 0..3 {
                for j in 0..3 {
                    states[(ACROSS[i], j)] = by_traction[(i, j)];
                    states[(ACROSS[i], 3 + j)] = by_strain[(i, j)];
                    states[(ALONG[i], 3 + j)] = strains[(i, j)];
                }
            }
            states
        });
        Some(Layers { frame, states: states.collect() })
    }

    /// k (N/m) of a bond of unit direction n, from the part of it that lies in each material (–) and its stiffness there (N/m),
    /// in the order of the materials; between the least and the largest of these.
    pub fn stiffness(&self, direction: &Vector3<f64>, parts: &[(f64, f64)]) -> f64 {
        let n = self.frame * direction;
        let along = Vector6::from_fn(|a, _| n[PAIRS[a].0] * n[PAIRS[a].1] * mandel_weight(a));
        let (mut stretch, mut pull, mut energy) = (Vector6::zeros(), Vector6::zeros(), 0.0);
        let [mut least, mut largest] = [f64::INFINITY, f64::NEG_INFINITY];
        for (states, &(part, k)) in self.states.iter().zip(parts) {
            let elongation = states.tr_mul(&along);
            stretch += part * elongation;
            pull += part * k * elongation;
            energy += part * k * elongation.norm_squared();
            (least, largest) = (least.min(k), largest.max(k));
        }
        if least == largest {
            return least;
        }
        let by_force = stretch.dot(&pull);
        ((by_force + BY_ENERGY * (energy - by_force)) / stretch.norm_squared()).clamp(least, largest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Along the normal springs in series, in the plane side by side, whatever the normal; equal stiffness stays.
    #[test]
    fn across_in_series_along_side_by_side() {
        for normal in [Vector3::x(), Vector3::z(), Vector3::new(2.0, -1.0, 3.0).normalize()] {
            let materials = [Stiffness::isotropic(2.0, 2.0), Stiffness::isotropic(0.1, 0.1)];
            let layers = Layers::new(&materials, &normal).unwrap();
            for f in [0.1, 0.5, 0.8] {
                let parts = [(f, 20.0), (1.0 - f, 1.0)];
                let series = 1.0 / (f / 20.0 + (1.0 - f));
                let beside = f * 20.0 + (1.0 - f);
                assert!((layers.stiffness(&normal, &parts) / series - 1.0).abs() < 0.02 * 19.0 * f);
                let in_plane = normal.cross(&Vector3::y()).normalize();
                assert!((layers.stiffness(&in_plane, &parts) / beside - 1.0).abs() < 1e-12);
                let turned = |angle: f64| layers.stiffness(&(angle.cos() * normal + angle.sin() * in_plane), &parts);
                assert!((0..10).map(|i| turned(0.17 * f64::from(i))).all(|k| (1.0..=20.0).contains(&k)));
                assert_eq!(layers.stiffness(&Vector3::y(), &[(f, 3.7), (1.0 - f, 3.7)]), 3.7);
            }
        }
        assert!(Layers::new(&[Stiffness::isotropic(-1.0, 0.1)], &Vector3::x()).is_none());
    }
}
