//! One bond between two spheres by its formulas, for fields, for bonds that left the linear law and for what is lost where one
//! breaks. The kernel does the same eight bonds at a time; its head says where the formulas come from.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::model::Strength;
use super::pose::Pose;
use crate::operator::{Kinematics, StiffBond};

/// Where the ends of a bond have brought it: what its force is made of, without its stiffness.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretched {
    /// ℓ − ℓ₀, or n₀·Δ (m).
    pub(super) elongation: f64,
    /// s (m): the energy of shear is ½ k_t |s|².
    pub(super) slip: Vector3<f64>,
    /// Unit normal n.
    normal: Vector3<f64>,
    /// Branch l, of the virial (m).
    branch: Vector3<f64>,
    /// Force on the first end per k_t (m).
    shear: Vector3<f64>,
    /// Moments on both ends per k_t (m²).
    arms: [Vector3<f64>; 2],
}

/// What a bond carries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carried {
    /// Force on its first end (N); that on the second is opposite.
    pub force: Vector3<f64>,
    /// Moments on both ends (N·m).
    pub moments: [Vector3<f64>; 2],
    /// Energy (J).
    pub energy: f64,
    /// F⊗l (J).
    pub virial: Matrix3<f64>,
}

impl Stretched {
    /// Of a bond whose second end is displaced by `moved` (m) against its first, with the turns of both ends.
    pub(super) fn new(
        kinematics: Kinematics,
        bond: &StiffBond,
        moved: &Vector3<f64>,
        [first, second]: [&Pose; 2],
    ) -> Self {
        match kinematics {
            Kinematics::Linear => Stretched::linear(bond, moved, &(first.theta() + second.theta())),
            Kinematics::Finite => Stretched::finite(bond, moved, [first.rotation(), second.rotation()]),
        }
    }

    /// Δ = moved − ½ (θ_a + θ_b)×L₀ (THEORY section 5).
    fn linear(bond: &StiffBond, moved: &Vector3<f64>, turn: &Vector3<f64>) -> Self {
        let length = bond.branch.norm();
        let normal = bond.branch / length;
        let delta = moved - 0.5 * turn.cross(&bond.branch);
        let elongation = normal.dot(&delta);
        let slip = delta - elongation * normal;
        let arm = 0.5 * length * normal.cross(&slip);
        Stretched { elongation, slip, normal, branch: bond.branch, shear: slip, arms: [arm; 2] }
    }

    /// m = ½ (R_a + R_b) n₀, τ = m − (n·m) n, s = √(ℓ ℓ₀) τ.
    fn finite(bond: &StiffBond, moved: &Vector3<f64>, turns: [UnitQuaternion<f64>; 2]) -> Self {
        let rest = bond.branch.norm();
        let branch = bond.branch + moved;
        let length = branch.norm();
        let normal = branch / length;
        let carried = turns.map(|turn| turn * bond.branch / rest);
        let m = 0.5 * (carried[0] + carried[1]);
        let along = normal.dot(&m);
        let t = m - along * normal;
        Stretched {
            // As the kernel: keeps the digits of small strains.
            elongation: moved.dot(&(branch + bond.branch)) / (length + rest),
            slip: (length * rest).sqrt() * t,
            normal,
            branch,
            shear: rest * (0.5 * t.norm_squared() * normal - along * t),
            arms: carried.map(|p| 0.5 * length * rest * t.cross(&p)),
        }
    }

    /// Of stiffnesses k_n, k_t (N/m), without normal force at the elongation `permanent` (m).
    pub(super) fn carried(&self, [kn, kt]: [f64; 2], permanent: f64) -> Carried {
        let beyond = self.elongation - permanent;
        let force = kn * beyond * self.normal + kt * self.shear;
        Carried {
            force,
            moments: self.arms.map(|arm| kt * arm),
            energy: 0.5 * (kn * beyond * beyond + kt * self.slip.norm_squared()),
            virial: force * self.branch.transpose(),
        }
    }

    /// Normal force, tension positive, and shear force (N), of the same.
    pub(super) fn forces(&self, [kn, kt]: [f64; 2], permanent: f64) -> [f64; 2] {
        let along = self.normal.dot(&self.shear);
        [kn * (self.elongation - permanent) + kt * along, kt * (self.shear - along * self.normal).norm()]
    }

    /// The share of a strength (–) that a linear bond's forces use: 1 where it stops to hold.
    pub(super) fn share(&self, strength: &Strength, stiffness: [f64; 2]) -> f64 {
        let [normal, shear] = self.forces(stiffness, 0.0);
        strength.share(normal, shear)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operator::particles::naive::{finite_energy, linear_energy};

    /// Energy by the formula; force, moments and virial its slopes.
    #[test]
    fn a_bond_carries_the_slopes_of_its_energy() {
        let bond = StiffBond { a: 0, b: 1, branch: Vector3::new(0.7, -0.4, 1.1), normal: 3e5, tangential: 1e5 };
        let turns = [[0.1, 0.2, -0.1], [-0.15, 0.1, 0.2]].map(Vector3::from);
        let moved = Vector3::new(0.05, 0.12, -0.08);
        for kinematics in [Kinematics::Linear, Kinematics::Finite] {
            let poses = |turns: [Vector3<f64>; 2]| {
                turns.map(|by| {
                    let mut pose = Pose::START;
                    super::super::system::turn(&mut pose, kinematics, &by);
                    pose
                })
            };
            let naive = |moved: &Vector3<f64>, [a, b]: [Pose; 2]| match kinematics {
                Kinematics::Finite => finite_energy(&bond, [Vector3::zeros(), *moved], [a.rotation(), b.rotation()]),
                Kinematics::Linear => linear_energy(&bond, [Vector3::zeros(), *moved], [a.theta(), b.theta()]),
            };
            let start = poses(turns);
            let at = Stretched::new(kinematics, &bond, &moved, [&start[0], &start[1]]);
            let ours = at.carried([bond.normal, bond.tangential], 0.0);
            assert!((ours.energy / naive(&moved, start) - 1.0).abs() < 1e-12, "{kinematics:?}");
            let (branch, h) = (bond.branch + moved, 1e-6);
            let l = if kinematics == Kinematics::Linear { bond.branch } else { branch };
            for axis in 0..3 {
                let e = Vector3::ith(axis, h);
                let slope = (naive(&(moved + e), start) - naive(&(moved - e), start)) / (2.0 * h);
                assert!((ours.force[axis] - slope).abs() < 1e-6 * ours.force.norm(), "{kinematics:?} {axis}");
                assert!((ours.virial[(axis, 2)] - slope * l.z).abs() < 1e-6 * ours.virial.norm());
                for end in 0..2 {
                    let turned = |by: &Vector3<f64>| {
                        let mut poses = start;
                        super::super::system::turn(&mut poses[end], kinematics, by);
                        naive(&moved, poses)
                    };
                    let slope = (turned(&e) - turned(&-e)) / (2.0 * h);
                    assert!(
                        (ours.moments[end][axis] + slope).abs() < 1e-6 * ours.moments[end].norm(),
                        "{kinematics:?}"
                    );
                }
            }
        }
    }
}
