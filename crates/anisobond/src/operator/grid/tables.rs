//! Constants of bonds as the kernels read them, made once per pass.

use super::build::GridBonds;
use super::law::{mean, stiffness, threshold};
use super::real::Real;
use super::sweep::Law;
use crate::operator::Kinematics;

/// What a pass is after.
#[derive(Clone, Copy, PartialEq)]
pub enum Wanted {
    /// Forces.
    Forces,
    /// Energies of the half bonds from each node on, as the first component.
    Energy,
}

/// Constants of all stencils.
pub struct Tables<T: Real> {
    /// Shared by all stencils.
    pub shared: Vec<T>,
    /// By stencil: `per_bond` numbers per half bond.
    pub own: Vec<T>,
    /// Numbers per half bond.
    pub per_bond: usize,
    /// By stencil: whether any stiffness is negative.
    pub signed: Vec<bool>,
}

/// Whether bonds are taken in pairs ±ξ.
pub fn paired(law: Law, wanted: Wanted) -> bool {
    wanted == Wanted::Forces && law == Law { kinematics: Kinematics::Linear, breaking: false }
}

impl<T: Real> GridBonds<T> {
    /// The tables of a pass.
    pub(super) fn tables(&self, law: Law, wanted: Wanted) -> Tables<T> {
        let (half, bonds) = (&self.half, self.half.bonds);
        let paired = paired(law, wanted);
        let finite = law.kinematics == Kinematics::Finite;
        let mut shared = Vec::new();
        for p in (0..half.len()).filter(|_| !paired) {
            let branch = if finite { &half.branch } else { &half.direction };
            shared.extend(branch.iter().map(|b| b.slice()[p]));
            shared.push(half.per_square.slice()[p]);
        }
        let mut own = Vec::new();
        let mut signed = vec![false; self.stencils.len()];
        for s in 0..self.stencils.len() {
            for (p, &b) in half.full.iter().enumerate() {
                let of = |values: &[T]| mean(values[s * bonds + b], values[s * bonds + half.opposite(b)]);
                let k = of(&self.stiffness);
                if paired {
                    let root = k.f64().abs().sqrt();
                    own.extend(half.xi[p].normalize().iter().map(|n| T::of(root * n)));
                    own.push(T::of(k.f64().signum()));
                    signed[s] |= k < T::default();
                } else if wanted == Wanted::Energy {
                    let square = if finite { half.xi[p].norm_squared() } else { 1.0 };
                    own.extend([T::of(0.5 * k.f64() / square), T::default()]);
                } else {
                    let limit = threshold(finite, of(&self.critical), half.length.slice()[p]);
                    let limit = if law.breaking { limit } else { T::of(f64::INFINITY) };
                    own.extend([stiffness(finite, k, half.per_square.slice()[p]), limit]);
                }
            }
        }
        Tables { shared, own, signed, per_bond: if paired { 4 } else { 2 } }
    }
}
