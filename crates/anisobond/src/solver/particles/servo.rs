//! The servo: each component of a periodic cell's strain is driven by a strain rate or by a stress.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix6};

use crate::operator::particles::Particles;
use crate::operator::{BondList, Network};
use crate::tensor::{PAIRS, mandel_weight};
use crate::{Error, Result};

/// What drives a component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Control {
    /// Strain rate (1/s); of the logarithmic strain where it is a normal one; ε_ij, not γ, where it is shear.
    Rate(f64),
    /// Stress to be reached and kept (Pa), tension positive.
    Stress(f64),
}

/// Control of the six components 11 22 33 23 13 12.
#[derive(Clone, Debug, PartialEq)]
pub struct Servo {
    /// What drives each component.
    pub controls: [Control; 6],
    /// Share of a stress that is missing which one step makes good, by the stiffness below (–).
    pub gain: f64,
    /// Largest strain rate of a component driven by stress (1/s); may be infinite.
    pub fastest: f64,
    /// Stiffness by which stress is turned into strain (Pa), Kelvin-Mandel: [`affine_stiffness`] or a measured one.
    pub stiffness: Matrix6<f64>,
}

impl Servo {
    /// Displacement gradient (symmetric, –) of the cell over one step (s), given the mean stress (Pa) now:
    /// prescribed rates, and D = −g C⁻¹ (σ − σ*) on the components driven by stress, C their block of the stiffness.
    ///
    /// # Errors
    /// A stiffness whose block is singular.
    pub fn gradient(&self, stress: &Matrix3<f64>, step: f64) -> Result<Matrix3<f64>> {
        let mut gradient = Matrix3::zeros();
        let mut set = |a: usize, strain: f64| {
            let (i, j) = PAIRS[a];
            gradient[(i, j)] = strain;
            gradient[(j, i)] = strain;
        };
        let (mut driven, mut missing) = (Vec::new(), Vec::new());
        for (a, control) in self.controls.iter().enumerate() {
            let (i, j) = PAIRS[a];
            match control {
                Control::Rate(rate) => set(a, rate * step),
                Control::Stress(wanted) => {
                    driven.push(a);
                    missing.push((wanted - 0.5 * (stress[(i, j)] + stress[(j, i)])) * mandel_weight(a));
                }
            }
        }
        if driven.is_empty() {
            return Ok(gradient);
        }
        let n = driven.len();
        let block = DMatrix::from_fn(n, n, |p, q| self.stiffness[(driven[p], driven[q])]);
        let answer = block.lu().solve(&DVector::from_vec(missing)).ok_or_else(|| {
            Error::input("the servo's stiffness is singular", "give the stiffness of the body, positive definite")
        })?;
        for (a, x) in driven.iter().zip(answer.iter()) {
            let limit = self.fastest * step;
            set(*a, (self.gain * x / mandel_weight(*a)).clamp(-limit, limit));
        }
        Ok(gradient)
    }
}

/// The stiffness of the bonds at uniform strain (Pa), Kelvin-Mandel: the servo's guess.
///
/// # Errors
/// What [`BondList::new`] refuses.
pub fn affine_stiffness(network: &Network) -> Result<Matrix6<f64>> {
    let list = BondList::new(network)?;
    let strains = std::array::from_fn(|case| nalgebra::Vector6::from_fn(|a, _| if a == case { 1.0 } else { 0.0 }));
    let energy = list.measure(&strains, &list.zeros::<6>()).energy;
    Ok(Matrix6::from_fn(|a, b| energy[a][b]))
}

/// Mean stress (Pa) of a periodic body from the virial (J): (1/V) Σ F⊗l.
pub fn mean_stress(particles: &Particles, virial: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    particles.volume().map(|volume| virial / volume)
}
