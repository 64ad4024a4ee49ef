//! The state of a run on a grid, kept and gone on with.

use serde::{Deserialize, Serialize};

use super::{Ledger, Overlap, SavedState, Simulation, Stage};
use crate::Result;
use crate::operator::VectorField;

/// What a saved state says beside its arrays.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GridFacts {
    step: u64,
    ledger: Ledger,
    external_ahead: f64,
    damping_ahead: f64,
    fracture_ahead: f64,
    departed: usize,
    #[serde(default)]
    overlap: Option<Overlap>,
    #[serde(default)]
    looked_at: f64,
    #[serde(default)]
    stable: Option<f64>,
}

impl Simulation {
    /// Everything that is needed to go on.
    pub fn save(&self) -> SavedState<GridFacts> {
        let mut state = SavedState::<GridFacts>::default();
        let (departed, [history, permanent]) = self.bonds.departed_state();
        let mut facts = GridFacts {
            step: self.step,
            ledger: self.ledger,
            external_ahead: 0.0,
            damping_ahead: 0.0,
            fracture_ahead: 0.0,
            departed: departed.len(),
            overlap: self.overlap.clone(),
            looked_at: self.looked_at,
            stable: self.step_evidence().map(|e| e.stable),
        };
        let names = ["x", "y", "z"];
        let mut keep = |prefix: &str, field: VectorField| {
            let arrays = names.iter().zip(field.components).map(|(axis, values)| (format!("{prefix}_{axis}"), values));
            state.numbers.extend(arrays);
        };
        keep("displacement", self.u.get());
        if let Stage::Motion { motion, last, .. } = &self.stage {
            keep("velocity", motion.velocity.clone());
            facts.external_ahead = last.external_ahead;
            facts.damping_ahead = last.damping_ahead;
            facts.fracture_ahead = last.failure.ahead;
        }
        state.numbers.push(("damaged_at".into(), self.crack.times().to_vec()));
        state.numbers.push(("bond_history".into(), history));
        state.numbers.push(("bond_permanent".into(), permanent));
        state.words.push(("bonds".into(), self.bonds.grid().unbroken_bits()));
        state.words.push(("departed".into(), departed));
        state.facts = facts;
        state
    }

    /// Go on from a saved state of the same problem.
    ///
    /// # Errors
    /// A state of another problem.
    pub fn restore(&mut self, mut state: SavedState<GridFacts>) -> Result<()> {
        let facts = std::mem::take(&mut state.facts);
        let n = self.problem.body.grid.len();
        let mut field = |prefix: &str| -> Result<VectorField> {
            let [x, y, z] = ["x", "y", "z"].map(|axis| state.take_numbers(&format!("{prefix}_{axis}"), n));
            Ok(VectorField { components: [x?, y?, z?] })
        };
        self.u.set(&field("displacement")?);
        if let Stage::Motion { motion, evidence, last } = &mut self.stage {
            evidence.stable = facts.stable.unwrap_or(evidence.stable);
            motion.velocity = field("velocity")?;
            last.external_ahead = facts.external_ahead;
            last.damping_ahead = facts.damping_ahead;
            last.failure.ahead = facts.fracture_ahead;
        }
        let damaged = self.crack.times().len();
        self.crack.restore(state.take_numbers("damaged_at", damaged)?);
        let words = self.bonds.grid().unbroken_bits().len();
        let bits = state.take_words("bonds", words)?;
        let departed = state.take_words("departed", facts.departed)?;
        let [history, permanent] =
            ["bond_history", "bond_permanent"].map(|name| state.take_numbers(name, facts.departed));
        self.bonds.restore(&bits, &departed, [&history?, &permanent?])?;
        self.reactions.forget();
        self.looked_at = facts.looked_at;
        self.step = facts.step;
        self.overlap = facts.overlap;
        self.ledger = facts.ledger;
        Ok(())
    }
}
