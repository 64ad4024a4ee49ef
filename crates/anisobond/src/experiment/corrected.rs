//! Calibration of a packing's bonds corrected by its own element test.
//!
//! Moduli put on the bonds under Voigt's hypothesis give a lattice that is too soft, for nodes move and turn against the
//! mean strain. The derivative of the measured tensor with respect to a bond's stiffness is the bond's own relaxed
//! energy ([`BondDeformation`]), so the tensor is brought onto its target by Gauss-Newton: measure, solve for the moduli
//! with the deformations as they are, measure again.

use nalgebra::{Rotation3, SMatrix, SVector, Vector3};
use serde::Serialize;

use super::element_test::{
    BondDeformation, ElementTest, ElementTestResult, Fields, Mechanisms, bond_deformations, sensitivity,
};
use crate::calibration::{
    DirectionModuli, EllipticFit, EllipticMicroplane, EllipticModuli, LatticeStiffness, TransverseConstants,
    normal_projection, tangential_projection, tensor_coordinates, tensor_of_coordinates,
};
use crate::lattice::Lattice;
use crate::operator::Network;
use crate::tensor::{Stiffness, SymmetryClass};
use crate::{Error, Result};

/// 21 coordinates of a tensor.
type Coordinates = SVector<f64, 21>;

/// Halvings of the way to the target when a correction brought nothing, before the search ends.
const MOST_HALVINGS: usize = 4;

/// A correction that takes less than this share off the error ends the search: what is left cannot be met.
const LEAST_GAIN: f64 = 0.01;

/// Semismooth Newton steps on the moduli while deformations are frozen.
const MOST_INNER: usize = 100;

/// Relative residual of the frozen problem at which it is solved.
const INNER_SOLVED: f64 = 1e-13;

/// Regularisation of the frozen problem, relative to the mean of its diagonal: small enough to change nothing where the
/// target can be met, there to lead out where no bond above the floor responds.
const REGULARISATION: f64 = 1e-5;

/// Error above which a start is compared with the other start.
const POOR_START: f64 = 0.25;

/// Halvings of a step of the frozen problem.
const MOST_INNER_HALVINGS: usize = 50;

/// How a packing's bonds are corrected.
#[derive(Clone, Copy, Debug)]
pub struct Correction {
    /// The test that measures. Fields are always taken.
    pub test: ElementTest,
    /// Relative error of the measured constants (or tensor) at which to stop (–).
    pub tolerance: f64,
    /// Most corrections, an element test each (and one before the first).
    pub most_corrections: usize,
    /// Least modulus of a bond, as a share of the largest modulus of the start (–); above zero keeps every bond.
    pub floor: f64,
}

impl Default for Correction {
    fn default() -> Self {
        Correction { test: ElementTest::default(), tolerance: 1e-4, most_corrections: 12, floor: 1e-4 }
    }
}

/// What is corrected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CorrectionForm {
    /// The four elliptic moduli, to meet C11, C33, C13 and C12 about the axis.
    Elliptic,
    /// E_N(n) and E_T(n) as even harmonics up to degree 4 above a floor, to meet all 21 components.
    General,
}

/// How a corrected calibration ended, and by which way.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CorrectionReport {
    /// What was corrected.
    pub form: CorrectionForm,
    /// Whether the error came down to the tolerance.
    pub converged: bool,
    /// Corrections that were made.
    pub corrections: usize,
    /// Element tests that were run.
    pub tests: usize,
    /// Error before the first correction and after each (–): of the worst of the four constants, relative to its own
    /// target (elliptic), or of the tensor in its norm (general).
    pub history: Vec<f64>,
    /// The last of them: the distance to the nearest that was found, when not converged.
    pub error: f64,
    /// ‖target − measured‖/‖target‖ of the whole tensor; for the elliptic form the target is what the moduli prescribe.
    pub tensor_error: f64,
    /// Whether no further correction took anything off the error: as far as the search can tell, the target is out of the
    /// form's reach on this lattice, and the measured tensor is the nearest that was found.
    pub out_of_reach: bool,
    /// Smallest k_n of a bond (N/m).
    pub smallest_normal: f64,
    /// Largest k_n of a bond (N/m).
    pub largest_normal: f64,
    /// Smallest k_t of a bond (N/m).
    pub smallest_tangential: f64,
    /// Largest k_t of a bond (N/m).
    pub largest_tangential: f64,
    /// Moduli that are held at the floor: of the four elliptic ones, or of the two of every bond.
    pub at_floor: usize,
}

/// The moduli that a correction ended with.
#[derive(Clone, Debug, PartialEq)]
pub enum CorrectedModuli {
    /// Elliptic moduli (Pa) about their axis.
    Elliptic(EllipticMicroplane),
    /// E_N(n) = max(f, E_N⁰(n) + N:Y), E_T(n) = max(f, E_T⁰(n) + T:Y): N:Y and T:Y are even harmonics up to degree 4.
    General {
        /// The tensor Y (Pa), as a stiffness.
        change: Box<Stiffness>,
        /// The floor f (Pa).
        floor: f64,
    },
}

/// A packing's bonds whose measured tensor was brought towards a target.
#[derive(Clone, Debug)]
pub struct CorrectedLattice {
    /// k_n and k_t of every contact.
    pub stiffness: LatticeStiffness,
    /// The moduli they come from.
    pub moduli: CorrectedModuli,
    /// The wanted tensor (Pa).
    pub target: Stiffness,
    /// The last element test.
    pub test: ElementTestResult,
    /// How it went.
    pub report: CorrectionReport,
}

impl Correction {
    /// Correct the four elliptic moduli until the measured C11, C33, C13 and C12 (of the transversely isotropic
    /// projection about the axis) are those of the fit; C44 follows from them.
    ///
    /// # Errors
    /// Settings out of range, constants that are zero or belong to no positive definite tensor, what
    /// [`LatticeStiffness::new`] and [`ElementTest::run`] refuse.
    pub fn elliptic(&self, lattice: &Lattice, fit: &EllipticFit) -> Result<CorrectedLattice> {
        self.check()?;
        fit.prescribed.require_positive_definite()?;
        let axis = fit.microplane.axis;
        let target = constants_about(&fit.prescribed, &axis);
        if let Some(c) = target.iter().find(|c| c.abs() <= 1e-9 * target.amax()) {
            return Err(Error::input(
                format!("one of the constants C11, C33, C13, C12 is {c} Pa: its relative error means nothing"),
                "use the general form",
            ));
        }
        let start = fit.microplane.moduli.as_array();
        let floor = self.floor * start.iter().copied().fold(0.0, f64::max);
        let form = Elliptic { axis, prescribed: fit.prescribed, target, floor, directions: directions(lattice) };
        let corrected = self.iterate(lattice, &form, &[SVector::from(start).map(|e: f64| e.max(floor))])?;
        let [en_a, en_b, et_a, et_b] = corrected.parameters.into();
        let moduli = EllipticMicroplane { moduli: EllipticModuli { en_a, en_b, et_a, et_b }, axis };
        Ok(corrected.finished(CorrectionForm::Elliptic, CorrectedModuli::Elliptic(moduli), fit.prescribed, self))
    }

    /// Correct E_N(n) and E_T(n) until the measured tensor is the target, with the least change from the moduli of the
    /// closest isotropic tensor; see [`Correction::general_from`].
    ///
    /// # Errors
    /// As [`Correction::general_from`].
    pub fn general(&self, lattice: &Lattice, target: &Stiffness) -> Result<CorrectedLattice> {
        self.general_from(lattice, target, &isotropic_moduli(target))
    }

    /// Correct E_N(n) and E_T(n) until the measured tensor is the target.
    ///
    /// Of all moduli ≥ f whose sum over the bonds is a given tensor, those with the least Σ w ((E_N − E_N⁰)² +
    /// (E_T − E_T⁰)²), w a bond's weight in the sum, are E_N = max(f, E_N⁰ + N:Y), E_T = max(f, E_T⁰ + T:Y) with one
    /// tensor Y (the dual vector): even harmonics of degree up to 4, of which 21 combinations matter. The corrections
    /// keep that form and choose Y so that the measured tensor is met instead of the sum.
    ///
    /// # Errors
    /// A target that is not positive definite, settings out of range, start moduli that are not finite, what
    /// [`ElementTest::run`] refuses.
    pub fn general_from(
        &self,
        lattice: &Lattice,
        target: &Stiffness,
        start: &impl DirectionModuli,
    ) -> Result<CorrectedLattice> {
        self.check()?;
        target.require_positive_definite()?;
        let directions = directions(lattice);
        let start: Vec<(f64, f64)> = directions.iter().map(|n| start.moduli(n)).collect();
        let largest = start.iter().map(|(en, et)| en.max(*et)).fold(0.0, f64::max);
        if !(largest.is_finite() && largest > 0.0 && start.iter().all(|(en, et)| en.is_finite() && et.is_finite())) {
            return Err(Error::input(
                "the start moduli are not finite or nowhere positive",
                "give finite moduli, positive in some direction",
            ));
        }
        let responses = directions.iter().map(responses_of).collect();
        let form = General { start, responses, target: *target, floor: self.floor * largest };
        // Before the first test: the moduli that Voigt's hypothesis gives.
        let (network, unit) = unit_network(lattice)?;
        let still = no_fields(network.nodes.len());
        let voigt = form.corrected(&unit, &network, &still, &SVector::zeros(), target);
        let corrected = self.iterate(lattice, &form, &[voigt, SVector::zeros()])?;
        let change = Box::new(Stiffness::from_mandel(tensor_of_coordinates(&corrected.parameters)));
        let moduli = CorrectedModuli::General { change, floor: form.floor };
        Ok(corrected.finished(CorrectionForm::General, moduli, *target, self))
    }

    fn check(&self) -> Result<()> {
        for (name, value) in [("tolerance", self.tolerance), ("floor", self.floor)] {
            if !(0.0..1.0).contains(&value) {
                return Err(Error::input(
                    format!("the correction's {name} is {value}"),
                    "give a number from 0 to below 1",
                ));
            }
        }
        Ok(())
    }

    /// Measure, correct, measure again.
    fn iterate<const P: usize>(
        &self,
        lattice: &Lattice,
        form: &impl Form<P>,
        starts: &[SVector<f64, P>],
    ) -> Result<Corrected<P>> {
        let (mut network, unit) = unit_network(lattice)?;
        let mut test = self.measure(&mut network, &unit, form, &starts[0])?;
        let mut state = Corrected::new(starts[0], self.error(form, &test), &test, &unit);
        let others = if state.error() > POOR_START { &starts[1..] } else { &[] };
        for start in others {
            let other = self.measure(&mut network, &unit, form, start)?;
            let error = self.error(form, &other);
            state.tests += 1;
            if error < state.error() {
                (state.parameters, state.history, test) = (*start, vec![error], other);
            }
        }
        if state.error().is_infinite() {
            test.mechanism.refuse()?;
        }
        while state.error() > self.tolerance && state.history.len() <= self.most_corrections && !state.out_of_reach {
            let fields = test.fields.take().unwrap_or_else(|| no_fields(network.nodes.len()));
            let missing = form.target().mandel() - test.measured.mandel();
            let measured = *test.measured.mandel();
            let mut share = 1.0;
            state.out_of_reach = true;
            for _ in 0..=MOST_HALVINGS {
                let aim = Stiffness::from_mandel(measured + share * missing);
                let parameters = form.corrected(&unit, &network, &fields, &state.parameters, &aim);
                let next = self.measure(&mut network, &unit, form, &parameters)?;
                state.tests += 1;
                let error = self.error(form, &next);
                if error < (1.0 - LEAST_GAIN) * state.error() {
                    state.parameters = parameters;
                    state.history.push(error);
                    state.out_of_reach = false;
                    test = next;
                    break;
                }
                share *= 0.5;
            }
        }
        form.put(&unit, &state.parameters, &mut network);
        state.stiffness.normal = network.bonds.iter().map(|b| b.normal).collect();
        state.stiffness.tangential = network.bonds.iter().map(|b| b.tangential).collect();
        state.at_floor = form.at_floor(&state.parameters);
        test.fields = None;
        state.test = test;
        Ok(state)
    }

    fn measure<const P: usize>(
        &self,
        network: &mut Network,
        unit: &LatticeStiffness,
        form: &impl Form<P>,
        parameters: &SVector<f64, P>,
    ) -> Result<ElementTestResult> {
        form.put(unit, parameters, network);
        ElementTest { fields: true, mechanisms: Mechanisms::Report, ..self.test }.run(network)
    }

    /// The error of a test; one of a mechanism does not count, unless mechanisms are only to be reported.
    fn error<const P: usize>(&self, form: &impl Form<P>, test: &ElementTestResult) -> f64 {
        let stands = self.test.mechanisms == Mechanisms::Report || test.mechanism.refuse().is_ok();
        let error = form.error(&test.measured);
        if stands && error.is_finite() { error } else { f64::INFINITY }
    }
}

/// Where the corrections stand.
struct Corrected<const P: usize> {
    parameters: SVector<f64, P>,
    history: Vec<f64>,
    tests: usize,
    out_of_reach: bool,
    at_floor: usize,
    stiffness: LatticeStiffness,
    test: ElementTestResult,
}

impl<const P: usize> Corrected<P> {
    fn new(parameters: SVector<f64, P>, error: f64, test: &ElementTestResult, unit: &LatticeStiffness) -> Self {
        let test = ElementTestResult { fields: None, ..test.clone() };
        Corrected {
            parameters,
            history: vec![error],
            tests: 1,
            out_of_reach: false,
            at_floor: 0,
            stiffness: unit.clone(),
            test,
        }
    }

    fn error(&self) -> f64 {
        self.history.last().copied().unwrap_or(f64::INFINITY)
    }

    fn finished(
        self,
        form: CorrectionForm,
        moduli: CorrectedModuli,
        target: Stiffness,
        settings: &Correction,
    ) -> CorrectedLattice {
        let converged = self.error() <= settings.tolerance;
        let ends = |k: &[f64]| (k.iter().copied().fold(f64::INFINITY, f64::min), k.iter().copied().fold(0.0, f64::max));
        let (smallest_normal, largest_normal) = ends(&self.stiffness.normal);
        let (smallest_tangential, largest_tangential) = ends(&self.stiffness.tangential);
        let report = CorrectionReport {
            form,
            converged,
            corrections: self.history.len() - 1,
            tests: self.tests,
            error: self.error(),
            history: self.history,
            tensor_error: target.relative_error(&self.test.measured),
            out_of_reach: self.out_of_reach && !converged,
            smallest_normal,
            largest_normal,
            smallest_tangential,
            largest_tangential,
            at_floor: self.at_floor,
        };
        CorrectedLattice { stiffness: self.stiffness, moduli, target, test: self.test, report }
    }
}

/// A family of moduli and what it is to meet.
trait Form<const P: usize> {
    /// Put the stiffnesses of given parameters on the bonds; `unit` are those of unit moduli.
    fn put(&self, unit: &LatticeStiffness, parameters: &SVector<f64, P>, network: &mut Network);
    /// The tensor to be measured.
    fn target(&self) -> &Stiffness;
    /// Error of a measured tensor (–).
    fn error(&self, measured: &Stiffness) -> f64;
    /// Parameters that meet an aim if the bonds deform as they did.
    fn corrected(
        &self,
        unit: &LatticeStiffness,
        network: &Network,
        fields: &Fields,
        parameters: &SVector<f64, P>,
        aim: &Stiffness,
    ) -> SVector<f64, P>;
    /// Moduli of bonds at the floor.
    fn at_floor(&self, parameters: &SVector<f64, P>) -> usize;
}

/// Four elliptic moduli.
struct Elliptic {
    axis: Vector3<f64>,
    prescribed: Stiffness,
    /// Its C11, C33, C13, C12 (Pa).
    target: SVector<f64, 4>,
    /// Least modulus (Pa).
    floor: f64,
    directions: Vec<Vector3<f64>>,
}

impl Elliptic {
    /// w = |a×n|² of a bond.
    fn weight(&self, bond: usize) -> f64 {
        self.axis.cross(&self.directions[bond]).norm_squared()
    }
}

impl Form<4> for Elliptic {
    fn put(&self, unit: &LatticeStiffness, e: &SVector<f64, 4>, network: &mut Network) {
        for (i, bond) in network.bonds.iter_mut().enumerate() {
            let w = self.weight(i);
            bond.normal = unit.normal[i] * (w * e[0] + (1.0 - w) * e[1]);
            bond.tangential = unit.tangential[i] * (w * e[2] + (1.0 - w) * e[3]);
        }
    }

    fn target(&self) -> &Stiffness {
        &self.prescribed
    }

    fn error(&self, measured: &Stiffness) -> f64 {
        let constants = constants_about(measured, &self.axis);
        (0..4).map(|k| ((constants[k] - self.target[k]) / self.target[k]).abs()).fold(0.0, f64::max)
    }

    /// The measured constants are linear in the moduli while deformations are frozen: 𝒞 = J ℰ, J = ∂𝒞/∂ℰ.
    fn corrected(
        &self,
        unit: &LatticeStiffness,
        network: &Network,
        fields: &Fields,
        _parameters: &SVector<f64, 4>,
        aim: &Stiffness,
    ) -> SVector<f64, 4> {
        let tensors = sensitivity::<4>(network, fields, |i| {
            let w = self.weight(i);
            let (kn, kt) = (unit.normal[i], unit.tangential[i]);
            (SVector::from([w * kn, (1.0 - w) * kn, 0.0, 0.0]), SVector::from([0.0, 0.0, w * kt, (1.0 - w) * kt]))
        });
        let mut jacobian = SMatrix::<f64, 4, 4>::zeros();
        for k in 0..4 {
            let tensor = Stiffness::from_mandel(tensor_of_coordinates(&tensors.column(k).into()));
            jacobian.set_column(k, &constants_about(&tensor, &self.axis).component_div(&self.target));
        }
        least_squares_above(&jacobian, &constants_about(aim, &self.axis).component_div(&self.target), self.floor)
    }

    fn at_floor(&self, e: &SVector<f64, 4>) -> usize {
        e.iter().filter(|e| **e <= self.floor).count()
    }
}

/// Least squares J x = b with x ≥ floor: the best of the sixteen choices of what is held at the floor.
fn least_squares_above(j: &SMatrix<f64, 4, 4>, b: &SVector<f64, 4>, floor: f64) -> SVector<f64, 4> {
    let mut best = (f64::INFINITY, SVector::repeat(floor));
    for held in 0..16u32 {
        let mut system = *j;
        let mut right = *b;
        for k in (0..4).filter(|k| held >> k & 1 == 1) {
            right -= floor * j.column(k);
            system.column_mut(k).fill(0.0);
        }
        // Columns held are zero; the singular values' tolerance leaves their unknowns at zero.
        let svd = system.svd(true, true);
        let Ok(free) = svd.solve(&right, 1e-12 * svd.singular_values.max()) else { continue };
        let x = SVector::<f64, 4>::from_fn(|k, _| if held >> k & 1 == 1 { floor } else { free[k] });
        let residual = (j * x - b).norm();
        if x.iter().all(|x| *x >= floor) && residual < best.0 {
            best = (residual, x);
        }
    }
    best.1
}

/// E = max(f, E⁰ + response·Y) for both moduli of every bond.
struct General {
    /// E_N⁰, E_T⁰ (Pa) of every bond.
    start: Vec<(f64, f64)>,
    /// N and T of every bond as coordinates.
    responses: Vec<(Coordinates, Coordinates)>,
    target: Stiffness,
    floor: f64,
}

/// Energy of a bond's unit modulus (∂C/∂E, coordinates) with its start and response.
struct Column {
    energy: Coordinates,
    response: Coordinates,
    start: f64,
}

impl General {
    fn moduli(&self, bond: usize, y: &Coordinates) -> (f64, f64) {
        let ((en, et), (n, t)) = (self.start[bond], &self.responses[bond]);
        (self.floor.max(en + n.dot(y)), self.floor.max(et + t.dot(y)))
    }

    /// What is missing to the target, and its derivative over the moduli above the floor.
    fn frozen(&self, columns: &[Column], target: &Coordinates, y: &Coordinates) -> (Coordinates, SMatrix<f64, 21, 21>) {
        let mut missing = *target;
        let mut jacobian = SMatrix::zeros();
        for column in columns {
            let modulus = column.start + column.response.dot(y);
            missing -= column.energy * modulus.max(self.floor);
            if modulus > self.floor {
                jacobian += column.energy * column.response.transpose();
            }
        }
        (missing, jacobian)
    }

    fn columns(&self, unit: &LatticeStiffness, network: &Network, fields: &Fields) -> Vec<Column> {
        let per_bond = |(i, d): (usize, BondDeformation)| {
            let ((en, et), (n, t)) = (self.start[i], self.responses[i]);
            let normal = tensor_coordinates(&d.of_normal()) * (unit.normal[i] / network.volume);
            let tangential = tensor_coordinates(&d.of_tangential()) * (unit.tangential[i] / network.volume);
            [Column { energy: normal, response: n, start: en }, Column { energy: tangential, response: t, start: et }]
        };
        bond_deformations(network, fields).enumerate().flat_map(per_bond).collect()
    }
}

impl Form<21> for General {
    fn put(&self, unit: &LatticeStiffness, y: &Coordinates, network: &mut Network) {
        for (i, bond) in network.bonds.iter_mut().enumerate() {
            let (en, et) = self.moduli(i, y);
            bond.normal = unit.normal[i] * en;
            bond.tangential = unit.tangential[i] * et;
        }
    }

    fn target(&self) -> &Stiffness {
        &self.target
    }

    fn error(&self, measured: &Stiffness) -> f64 {
        self.target.relative_error(measured)
    }

    /// Y with Σ ∂C/∂E max(f, E⁰ + response·Y) = C by a semismooth Newton method: deformations frozen, the floor not.
    fn corrected(
        &self,
        unit: &LatticeStiffness,
        network: &Network,
        fields: &Fields,
        y: &Coordinates,
        aim: &Stiffness,
    ) -> Coordinates {
        let columns = self.columns(unit, network, fields);
        let target = tensor_coordinates(aim.mandel());
        let whole: f64 = columns.iter().map(|c| c.energy.dot(&c.response)).sum();
        let mut y = *y;
        let (mut missing, mut jacobian) = self.frozen(&columns, &target, &y);
        for _ in 0..MOST_INNER {
            if missing.norm() <= INNER_SOLVED * target.norm() {
                break;
            }
            let system = jacobian + SMatrix::identity() * (REGULARISATION * whole / 21.0);
            let Some(step) = system.lu().solve(&missing) else { break };
            let mut share = 1.0;
            let mut accepted = None;
            for _ in 0..MOST_INNER_HALVINGS {
                let tried = y + share * step;
                let (left, slope) = self.frozen(&columns, &target, &tried);
                if left.norm() < (1.0 - 1e-4 * share) * missing.norm() {
                    accepted = Some((tried, left, slope));
                    break;
                }
                share *= 0.5;
            }
            let Some((tried, left, slope)) = accepted else { break };
            (y, missing, jacobian) = (tried, left, slope);
        }
        y
    }

    fn at_floor(&self, y: &Coordinates) -> usize {
        let held = |(en, et): (f64, f64)| usize::from(en <= self.floor) + usize::from(et <= self.floor);
        (0..self.start.len()).map(|i| held(self.moduli(i, y))).sum()
    }
}

/// C11, C33, C13, C12 (Pa) of the transversely isotropic projection about an axis (unit vector). Linear in C.
fn constants_about(c: &Stiffness, axis: &Vector3<f64>) -> SVector<f64, 4> {
    // An axis has no sign; the projection does not depend on the turn about it.
    let axis = if axis.z < 0.0 { -axis } else { *axis };
    let turn = Rotation3::rotation_between(&axis, &Vector3::z()).unwrap_or_else(Rotation3::identity);
    let v = SymmetryClass::TransverselyIsotropic.project(&c.rotated(turn.matrix())).voigt();
    SVector::from([v[(0, 0)], v[(2, 2)], v[(0, 2)], v[(0, 1)]])
}

/// E_N = 3K/2 and E_T = G − λ of the closest isotropic tensor (Pa), the same in every direction; a negative E_T (Poisson's
/// ratio above ¼) becomes zero.
fn isotropic_moduli(c: &Stiffness) -> impl DirectionModuli + use<> {
    let v = SymmetryClass::Isotropic.project(c).voigt();
    let constants = TransverseConstants { c11: v[(0, 0)], c33: v[(0, 0)], c13: v[(0, 1)], c12: v[(0, 1)] };
    let moduli = EllipticModuli::from_constants(&constants);
    move |_: &Vector3<f64>| (moduli.en_a.max(0.0), moduli.et_a.max(0.0))
}

/// Directions of a lattice's bonds.
fn directions(lattice: &Lattice) -> Vec<Vector3<f64>> {
    lattice.contacts.iter().map(|c| c.branch.normalize()).collect()
}

/// N and T of a direction as coordinates.
fn responses_of(n: &Vector3<f64>) -> (Coordinates, Coordinates) {
    (tensor_coordinates(&normal_projection(n)), tensor_coordinates(&tangential_projection(n)))
}

/// The lattice with unit moduli (1 Pa) on its bonds, and their stiffnesses.
fn unit_network(lattice: &Lattice) -> Result<(Network, LatticeStiffness)> {
    let unit = LatticeStiffness::new(lattice, &|_: &Vector3<f64>| (1.0, 1.0))?;
    Ok((Network::new(lattice, &unit), unit))
}

/// Fields of nodes that neither move nor turn against the mean strain.
fn no_fields(nodes: usize) -> Fields {
    let zeros = || vec![Vector3::zeros(); nodes];
    Fields { displacement: std::array::from_fn(|_| zeros()), rotation: std::array::from_fn(|_| zeros()) }
}
