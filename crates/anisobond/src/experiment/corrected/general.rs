//! E_N(n) and E_T(n) as even harmonics up to degree 4 above a floor, to meet all components; or E_N(n) alone, to meet the
//! Cauchy part.

use std::sync::Arc;

use nalgebra::{Matrix6, SMatrix, SVector, Vector3};

use super::report::CorrectedModuli;
use super::search::{Form, no_fields};
use crate::calibration::{
    EllipticModuli, TransverseConstants, normal_projection, tangential_projection, tensor_coordinates,
    tensor_of_coordinates,
};
use crate::experiment::element_test::{BondDeformation, Fields, bond_deformations};
use crate::operator::Network;
use crate::solver::Watch;
use crate::tensor::{Stiffness, SymmetryClass};
use crate::{Error, Result};

/// Semismooth Newton steps on the moduli while deformations are frozen.
const MOST_INNER: usize = 100;

/// Relative residual of the frozen problem at which it is solved.
const INNER_SOLVED: f64 = 1e-13;

/// Regularisation of the frozen problem, relative to the mean of its diagonal: small enough to change nothing where the
/// target can be met, there to lead out where no bond above the floor responds.
const REGULARISATION: f64 = 1e-5;

/// Halvings of a step of the frozen problem.
const MOST_INNER_HALVINGS: usize = 50;

/// Relative residual below which only [`FEW_INNER_HALVINGS`] are tried: what is left is about to be rounding.
const INNER_NEARLY: f64 = 1e-9;

/// See [`INNER_NEARLY`].
const FEW_INNER_HALVINGS: usize = 4;

/// 21 coordinates of a tensor.
pub(super) type Coordinates = SVector<f64, 21>;

/// E = max(f, E⁰ + response·Y) for the moduli of every bond: both, or E_N alone.
pub(super) struct General {
    /// E_N⁰, E_T⁰ (Pa) of every bond.
    start: Vec<(f64, f64)>,
    /// N and T of every bond as coordinates.
    responses: Vec<(Coordinates, Coordinates)>,
    target: Stiffness,
    floor: f64,
    /// Whether bonds have tangential stiffness. Without, they are to meet the Cauchy part: fifteen components, all that
    /// E_N moves where nodes do not relax.
    tangential: bool,
    watch: Arc<Watch>,
}

/// Energy of a bond's unit modulus (∂C/∂E, coordinates) with its start and response.
struct Column {
    energy: Coordinates,
    response: Coordinates,
    start: f64,
}

impl General {
    /// The form for start moduli (E_N⁰, E_T⁰) (Pa) of every bond of a network; `floor` is a share of the largest.
    ///
    /// # Errors
    /// Start moduli that are not finite or nowhere positive.
    pub(super) fn new(
        unit: &Network,
        start: Vec<(f64, f64)>,
        target: &Stiffness,
        floor: f64,
        tangential: bool,
        watch: &Arc<Watch>,
    ) -> Result<Self> {
        let largest = start.iter().map(|(en, et)| en.max(*et)).fold(0.0, f64::max);
        if !(largest.is_finite() && largest > 0.0 && start.iter().all(|(en, et)| en.is_finite() && et.is_finite())) {
            return Err(Error::input(
                "the start moduli are not finite or nowhere positive",
                "give finite moduli, positive in some direction",
            ));
        }
        let responses = unit.bonds.iter().map(|bond| responses_of(&bond.branch.normalize())).collect();
        let floor = floor * largest;
        Ok(General { start, responses, target: *target, floor, tangential, watch: watch.clone() })
    }

    /// The parameters that the sum over bonds asks for: Voigt's hypothesis, before any test.
    pub(super) fn of_sum(&self, unit: &Network) -> Coordinates {
        self.corrected(unit, &no_fields(unit.nodes.len()), &Coordinates::zeros(), &self.target)
    }

    /// The moduli of given parameters.
    pub(super) fn described(&self, y: &Coordinates) -> CorrectedModuli {
        let change = Box::new(Stiffness::from_mandel(tensor_of_coordinates(y)));
        CorrectedModuli::General { change, floor: self.floor }
    }

    /// What of a tensor the moduli are to meet, as coordinates.
    fn seen(&self, c: &Stiffness) -> Coordinates {
        tensor_coordinates(if self.tangential { *c } else { c.cauchy_part() }.mandel())
    }

    fn moduli(&self, bond: usize, y: &Coordinates) -> (f64, f64) {
        let ((en, et), (n, t)) = (self.start[bond], &self.responses[bond]);
        (self.floor.max(en + n.dot(y)), self.floor.max(et + t.dot(y)))
    }

    /// What is missing to the target while deformations are frozen.
    fn missing(&self, columns: &[Column], target: &Coordinates, y: &Coordinates) -> Coordinates {
        let mut missing = *target;
        for column in columns {
            let modulus = column.start + column.response.dot(y);
            missing -= column.energy * modulus.max(self.floor);
        }
        missing
    }

    /// Its derivative over the moduli above the floor, with the sign of the tensor: ten times the work.
    fn jacobian(&self, columns: &[Column], y: &Coordinates) -> SMatrix<f64, 21, 21> {
        let mut jacobian = SMatrix::zeros();
        for column in columns {
            let modulus = column.start + column.response.dot(y);
            if modulus > self.floor {
                jacobian += column.energy * column.response.transpose();
            }
        }
        jacobian
    }

    fn columns(&self, unit: &Network, fields: &Fields) -> Vec<Column> {
        let per_bond = |(i, d): (usize, BondDeformation)| {
            let ((en, et), (n, t)) = (self.start[i], self.responses[i]);
            let energy = |energy: Matrix6<f64>, k: f64| self.seen(&Stiffness::from_mandel(energy * (k / unit.volume)));
            let normal = Column { energy: energy(d.of_normal(), unit.bonds[i].normal), response: n, start: en };
            let tangential = self.tangential.then(|| Column {
                energy: energy(d.of_tangential(), unit.bonds[i].tangential),
                response: t,
                start: et,
            });
            [Some(normal), tangential].into_iter().flatten()
        };
        bond_deformations(unit, fields).enumerate().flat_map(per_bond).collect()
    }
}

impl Form<21> for General {
    fn put(&self, unit: &Network, y: &Coordinates, network: &mut Network) {
        for (i, bond) in network.bonds.iter_mut().enumerate() {
            let (en, et) = self.moduli(i, y);
            bond.normal = unit.bonds[i].normal * en;
            bond.tangential = if self.tangential { unit.bonds[i].tangential * et } else { 0.0 };
        }
    }

    fn target(&self) -> &Stiffness {
        &self.target
    }

    fn error(&self, measured: &Stiffness) -> f64 {
        (self.seen(&self.target) - self.seen(measured)).norm() / self.target.norm()
    }

    /// Y with Σ ∂C/∂E max(f, E⁰ + response·Y) = C by a semismooth Newton method: deformations frozen, the floor not.
    fn corrected(&self, unit: &Network, fields: &Fields, y: &Coordinates, aim: &Stiffness) -> Coordinates {
        let columns = self.columns(unit, fields);
        let target = self.seen(aim);
        let whole: f64 = columns.iter().map(|c| c.energy.dot(&c.response)).sum();
        let mut y = *y;
        let mut missing = self.missing(&columns, &target, &y);
        for _ in 0..MOST_INNER {
            if missing.norm() <= INNER_SOLVED * target.norm() {
                break;
            }
            let system = self.jacobian(&columns, &y) + SMatrix::identity() * (REGULARISATION * whole / 21.0);
            let Some(step) = system.lu().solve(&missing) else { break };
            let mut share = 1.0;
            let mut accepted = None;
            let nearly = missing.norm() <= INNER_NEARLY * target.norm();
            for _ in 0..if nearly { FEW_INNER_HALVINGS } else { MOST_INNER_HALVINGS } {
                // Told to stop, the problem is left as it is: the test that follows says so.
                if self.watch.stopped() {
                    break;
                }
                let tried = y + share * step;
                let left = self.missing(&columns, &target, &tried);
                if left.norm() < (1.0 - 1e-4 * share) * missing.norm() {
                    accepted = Some((tried, left));
                    break;
                }
                share *= 0.5;
            }
            let Some(next) = accepted else { break };
            (y, missing) = next;
        }
        y
    }

    fn at_floor(&self, y: &Coordinates) -> usize {
        let held =
            |(en, et): (f64, f64)| usize::from(en <= self.floor) + usize::from(self.tangential && et <= self.floor);
        (0..self.start.len()).map(|i| held(self.moduli(i, y))).sum()
    }
}

/// E_N = 3K/2 and E_T = G − λ of the closest isotropic tensor (Pa), the same in every direction; a negative E_T (Poisson's
/// ratio above ¼) becomes zero.
pub(super) fn isotropic_moduli(c: &Stiffness) -> (f64, f64) {
    let v = SymmetryClass::Isotropic.project(c).voigt();
    let constants = TransverseConstants { c11: v[(0, 0)], c33: v[(0, 0)], c13: v[(0, 1)], c12: v[(0, 1)] };
    let moduli = EllipticModuli::from_constants(&constants);
    (moduli.en_a.max(0.0), moduli.et_a.max(0.0))
}

/// N and T of a direction as coordinates.
fn responses_of(n: &Vector3<f64>) -> (Coordinates, Coordinates) {
    (tensor_coordinates(&normal_projection(n)), tensor_coordinates(&tangential_projection(n)))
}
