//! Measure, correct, measure again: Gauss-Newton on the measured tensor.

use nalgebra::{SVector, Vector3};

use super::Correction;
use super::report::{CorrectedModuli, CorrectedNetwork, CorrectionForm, CorrectionReport, NodalReport};
use crate::Result;
use crate::experiment::element_test::{ElementTest, ElementTestResult, Fields, Mechanisms};
use crate::operator::Network;
use crate::tensor::Stiffness;

/// Halvings of the way to the target when a correction brought nothing, before the search ends.
const MOST_HALVINGS: usize = 4;

/// A correction that takes less than this share off the error ends the search: what is left cannot be met.
const LEAST_GAIN: f64 = 0.01;

/// Error above which a start is compared with the other start.
const POOR_START: f64 = 0.25;

/// A family of moduli and what it is to meet.
pub(super) trait Form<const P: usize> {
    /// Put the stiffnesses of given parameters on the bonds (and nodes); those of `unit` are of unit moduli.
    fn put(&self, unit: &Network, parameters: &SVector<f64, P>, network: &mut Network);
    /// The tensor to be measured.
    fn target(&self) -> &Stiffness;
    /// Error of a measured tensor (–).
    fn error(&self, measured: &Stiffness) -> f64;
    /// Parameters that meet an aim if the bonds deform as they did.
    fn corrected(
        &self,
        unit: &Network,
        fields: &Fields,
        parameters: &SVector<f64, P>,
        aim: &Stiffness,
    ) -> SVector<f64, P>;
    /// Moduli at the floor.
    fn at_floor(&self, parameters: &SVector<f64, P>) -> usize;
}

/// Where the corrections stand.
pub(super) struct Search<const P: usize> {
    pub(super) parameters: SVector<f64, P>,
    pub(super) network: Network,
    pub(super) test: ElementTestResult,
    history: Vec<f64>,
    tests: usize,
    out_of_reach: bool,
    at_floor: usize,
}

impl<const P: usize> Search<P> {
    /// Correct until the tolerance, the most corrections, or until nothing more is gained. An infinite error at the end
    /// means that no start was a sound lattice.
    pub(super) fn run(
        settings: &Correction,
        unit: &Network,
        form: &impl Form<P>,
        starts: &[SVector<f64, P>],
    ) -> Result<Self> {
        settings.test.watch.enter("before the first correction");
        let mut network = unit.clone();
        let test = measure(settings, unit, form, &starts[0], &mut network)?;
        let history = vec![error(settings, form, &test)];
        let parameters = starts[0];
        let mut state = Search { parameters, network, test, history, tests: 1, out_of_reach: false, at_floor: 0 };
        let others = if state.error() > POOR_START { &starts[1..] } else { &[] };
        for start in others {
            let other = measure(settings, unit, form, start, &mut state.network)?;
            let error = error(settings, form, &other);
            state.tests += 1;
            if error < state.error() {
                (state.parameters, state.history, state.test) = (*start, vec![error], other);
            }
        }
        while state.error().is_finite()
            && state.error() > settings.tolerance
            && state.history.len() <= settings.most_corrections
            && !state.out_of_reach
        {
            state.correct(settings, unit, form)?;
        }
        form.put(unit, &state.parameters, &mut state.network);
        state.at_floor = form.at_floor(&state.parameters);
        state.test.fields = None;
        settings.test.watch.enter("");
        Ok(state)
    }

    /// One correction; shorter ones where it brings nothing.
    fn correct(&mut self, settings: &Correction, unit: &Network, form: &impl Form<P>) -> Result<()> {
        settings.test.watch.enter(format!("correction {}, error {}", self.history.len(), percent(self.error())));
        let fields = self.test.fields.take().unwrap_or_else(|| no_fields(unit.nodes.len()));
        let measured = *self.test.measured.mandel();
        let missing = form.target().mandel() - measured;
        let mut share = 1.0;
        for _ in 0..=MOST_HALVINGS {
            let aim = Stiffness::from_mandel(measured + share * missing);
            let parameters = form.corrected(unit, &fields, &self.parameters, &aim);
            let next = measure(settings, unit, form, &parameters, &mut self.network)?;
            self.tests += 1;
            let error = error(settings, form, &next);
            if error < (1.0 - LEAST_GAIN) * self.error() {
                self.parameters = parameters;
                self.history.push(error);
                self.test = next;
                return Ok(());
            }
            share *= 0.5;
        }
        self.out_of_reach = true;
        Ok(())
    }

    /// The last error; infinite where the lattice is a mechanism or not stable.
    pub(super) fn error(&self) -> f64 {
        self.history.last().copied().unwrap_or(f64::INFINITY)
    }

    /// `self`, unless there is no sound lattice to speak of.
    ///
    /// # Errors
    /// The mechanism, named.
    pub(super) fn sound(self) -> Result<Self> {
        if self.error().is_infinite() {
            self.test.mechanism.refuse()?;
        }
        Ok(self)
    }

    /// The result with its report.
    pub(super) fn finished(
        self,
        settings: &Correction,
        form: CorrectionForm,
        moduli: CorrectedModuli,
        target: &Stiffness,
        nodal: Option<NodalReport>,
    ) -> CorrectedNetwork {
        let converged = self.error() <= settings.tolerance;
        let ends = |k: &dyn Fn(usize) -> f64| {
            let all = || (0..self.network.bonds.len()).map(k);
            (all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max))
        };
        let (smallest_normal, largest_normal) = ends(&|i| self.network.bonds[i].normal);
        let (smallest_tangential, largest_tangential) = ends(&|i| self.network.bonds[i].tangential);
        let measured = &self.test.measured;
        let (wanted, found) = (target.voigt_rows(), measured.voigt_rows());
        let mut report = CorrectionReport {
            form,
            converged,
            corrections: self.history.len() - 1,
            tests: self.tests,
            error: self.error(),
            target: wanted,
            measured: found,
            remaining: std::array::from_fn(|a| std::array::from_fn(|b| found[a][b] - wanted[a][b])),
            tensor_error: target.relative_error(measured),
            out_of_reach: self.out_of_reach && !converged,
            shortfall: None,
            smallest_normal,
            largest_normal,
            smallest_tangential,
            largest_tangential,
            at_floor: self.at_floor,
            nodal,
            history: self.history,
        };
        let moduli_per_bond = if form == CorrectionForm::General { 2 } else { 1 };
        let count = if form == CorrectionForm::Elliptic { 4 } else { moduli_per_bond * self.network.bonds.len() };
        report.shortfall = report.explained(settings.tolerance, count);
        CorrectedNetwork { network: self.network, moduli, target: *target, test: self.test, report }
    }
}

fn measure<const P: usize>(
    settings: &Correction,
    unit: &Network,
    form: &impl Form<P>,
    parameters: &SVector<f64, P>,
    network: &mut Network,
) -> Result<ElementTestResult> {
    form.put(unit, parameters, network);
    ElementTest { fields: true, mechanisms: Mechanisms::Report, ..settings.test.clone() }.run(network)
}

/// The error of a test; one of a mechanism does not count, unless mechanisms are only to be reported, and one of a
/// lattice that is not stable never.
fn error<const P: usize>(settings: &Correction, form: &impl Form<P>, test: &ElementTestResult) -> f64 {
    let stands = settings.test.mechanisms == Mechanisms::Report || test.mechanism.refuse().is_ok();
    let error = form.error(&test.measured);
    if stands && error.is_finite() && !test.solver.negative_curvature() { error } else { f64::INFINITY }
}

/// A share as a percentage of two digits.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    let decimals = (1.0 - percent.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{percent:.decimals$} %")
}

/// Fields of nodes that neither move nor turn against the mean strain.
pub(super) fn no_fields(nodes: usize) -> Fields {
    let zeros = || vec![Vector3::zeros(); nodes];
    Fields { displacement: std::array::from_fn(|_| zeros()), rotation: std::array::from_fn(|_| zeros()) }
}
