//! One load step: to its equilibrium, or to where the body breaks.

use super::statics::Step;
use super::{Simulation, Stage};
use crate::Result;
use crate::experiment::outcome::{Break, Collapse, Outcome, StepLook};
use crate::operator::VectorField;
use crate::operator::grid::KeptBonds;

/// The last state of a body that broke, which is no equilibrium.
pub(super) struct BrokenState {
    bonds: KeptBonds,
    displacement: VectorField,
}

impl Simulation {
    pub(super) fn advance_equilibrium(&mut self, look: StepLook) -> Result<()> {
        let reached = self.load_factor();
        let factor = (self.step + 1) as f64 / self.steps as f64;
        let whole = self.bonds.kept();
        let Stage::Equilibrium { statics, last } = &mut self.stage else { return Ok(()) };
        let before = (self.step > 0).then_some(reached);
        let (lost, start) = (self.ledger.fracture > 0.0, self.u.get());
        let settled =
            statics.settle(&self.problem, &self.loading, &mut self.bonds, start, (before, factor, lost), look);
        let settled = match settled {
            Ok(settled) => settled,
            Err(e) => {
                self.bonds.put_back(&whole);
                return Err(e.at(format!("load step {} of {}", self.step + 1, self.steps)));
            }
        };
        if settled.broke.is_some() {
            self.break_apart(settled, [reached, factor], &whole);
            return Ok(());
        }
        *last = settled.evidence;
        self.u.set(&settled.displacement);
        self.step += 1;
        self.ledger.strain = self.bonds.energy(&self.u, self.problem.kinematics)?;
        self.ledger.fracture += settled.failure.energy;
        self.ledger.broken_bonds += settled.failure.broken as u64;
        self.ledger.external += settled.account.external;
        self.ledger.damping += settled.account.released;
        self.crack.look(&self.bonds, self.time(), self.ledger.fracture);
        self.look_for_overlap();
        Ok(())
    }

    /// Keep the last state of a body that broke between two load factors, and go back to its last equilibrium.
    fn break_apart(&mut self, step: Step, [load_factor, not_reached]: [f64; 2], whole: &KeptBonds) {
        let Some((how, what, equilibria)) = step.broke else { return };
        self.crack.look(&self.bonds, not_reached, self.ledger.fracture + step.failure.energy);
        self.broken = Some(BrokenState { bonds: self.bonds.kept(), displacement: step.displacement });
        let broken_bonds = step.failure.broken as u64;
        let end = Break { load_factor, not_reached, how, what, equilibria, broken_bonds };
        self.outcome = match how {
            Collapse::Unsolved => Outcome::NotConverged(end),
            _ => Outcome::Broke(end),
        };
        self.bonds.put_back(whole);
    }

    /// How the run ended, or that nothing has ended it yet.
    pub fn outcome(&self) -> &Outcome {
        &self.outcome
    }

    /// Go from the last equilibrium of a body that broke to its last state, for its fields: bonds as they broke, displacements of
    /// the last solve. Energies stay those of the equilibrium.
    pub fn show_broken(&mut self) {
        let Some(BrokenState { bonds, displacement }) = self.broken.take() else { return };
        self.u.set(&displacement);
        self.bonds.put_back(&bonds);
    }

    /// Load factor of the last equilibrium.
    pub(super) fn load_factor(&self) -> f64 {
        self.step as f64 / self.steps as f64
    }
}
