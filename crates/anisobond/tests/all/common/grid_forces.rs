//! Forces of a body's bonds, as a field in double precision.

use anisobond::operator::grid::{GridBonds, Real};
use anisobond::operator::{Kinematics, VectorField};

pub fn forces<T: Real>(bonds: &GridBonds<T>, u: &VectorField, kinematics: Kinematics) -> VectorField {
    let mut padded = bonds.padded();
    padded.set(u);
    let mut f = VectorField::zeros(u.len());
    let [x, y, z] = &mut f.components;
    bonds
        .sweep(&padded, kinematics, [x, y, z], |_, from, to| {
            for (to, from) in to.into_iter().zip(from) {
                to.iter_mut().zip(from).for_each(|(to, from)| *to = from.f64());
            }
        })
        .unwrap();
    f
}
