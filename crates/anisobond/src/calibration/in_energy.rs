//! Central bonds closest to a tensor in the sense of energy, where they do not reach S*.

use nalgebra::{Cholesky, SMatrix};

use super::calibrator::{Calibrator, Solution};
use crate::tensor::{Quartic, Stiffness, energy_gram};
use crate::{Error, Result};

impl Calibrator<'_> {
    /// The problem for an aim out of reach, in units of ‖aim‖ = 1 and largest share = 1. With G = RᵀR the metric of energy on fully
    /// symmetric tensors ([`energy_gram`]), distances of coordinates R v are those of energy, and the cone of the bonds is that of
    /// their R v: the same problem in other coordinates.
    ///
    /// # Errors
    /// A target too soft in some direction for G in floating point.
    pub(super) fn solve_in_energy(&self, target: &Stiffness, aim: &Quartic, bound: f64) -> Result<Solution> {
        let too_soft = || {
            Error::input(
                "the target is too soft in some direction for distances of energy in floating point",
                "calibrate by the norm (the metric `norm`)",
            )
        };
        let gram = energy_gram(&target.scaled(1.0 / target.norm())).and_then(Cholesky::new).ok_or_else(too_soft)?;
        let to_energy: SMatrix<f64, 15, 15> = gram.l().transpose();
        let to_energy = to_energy / (to_energy * aim).norm();
        // A form y on coordinates R v is Rᵀ y on v.
        let of_forms = to_energy.transpose();
        let one = of_forms.try_inverse().ok_or_else(too_soft)? * self.one;
        let seen = Calibrator::seen(
            self.neighbourhood,
            self.quartics.iter().map(|v| to_energy * v).collect(),
            self.direction_of_bond.clone(),
            (self.share.clone(), self.share_unit),
            one,
        );
        let found = seen.solve(&(to_energy * aim), bound);
        Ok(Solution {
            dual: of_forms * found.dual,
            certificate: found.certificate.map(|(cause, y)| (cause, (of_forms * y).normalize())),
            ..found
        })
    }
}
