//! How a run ended, and what is seen of a load step that is under way.

use serde::{Deserialize, Serialize};

/// How a run ended.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Outcome {
    /// All of its steps were done.
    #[default]
    Completed,
    /// The body carries no more: it broke in a load step, and what is left of it has no equilibrium under the loads.
    Broke(Break),
    /// Bonds broke in a load step, and then the solver found no equilibrium of what is left, nor that it has none.
    NotConverged(Break),
}

/// A load step in which a body broke.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Break {
    /// Load factor of the last equilibrium (–); 0 if there was none.
    pub load_factor: f64,
    /// Load factor at which none was found (–): the body broke between the two.
    pub not_reached: f64,
    /// What shows it.
    pub how: Collapse,
    /// What moves, in words; empty where nothing says.
    pub what: String,
    /// Equilibria that were solved on the way.
    pub equilibria: usize,
    /// Bonds that broke in the load step, until then.
    pub broken_bonds: u64,
}

/// What shows that a body carries no more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Collapse {
    /// The loads move a part that nothing joins to what holds it.
    Apart,
    /// The loads do far more work on what is left than they did on the body before, without an end: it hangs together, but as a
    /// mechanism.
    Yields,
    /// Bonds go on breaking.
    KeepsBreaking,
    /// Nothing: the solver did not converge.
    Unsolved,
}

impl Outcome {
    /// In words: "broke between load factors 0.12 and 0.19: …"; of a completed run `None`.
    pub fn words(&self) -> Option<String> {
        let (b, verb) = match self {
            Outcome::Completed => return None,
            Outcome::Broke(b) => (b, "broke"),
            Outcome::NotConverged(b) => (b, "broke, or was not solved,"),
        };
        let how = match b.how {
            Collapse::Apart => "the loads move a part that nothing holds any more",
            Collapse::Yields => "what is left hangs together, but gives way without end",
            Collapse::KeepsBreaking => "bonds go on breaking",
            Collapse::Unsolved => "then the solver did not converge; it may hang by a thread",
        };
        let what = if b.what.is_empty() { String::new() } else { format!(" ({})", b.what) };
        Some(format!(
            "{verb} between load factors {:.4} (the last equilibrium) and {:.4}, where {} bonds broke in {} equilibria: {how}{what}",
            b.load_factor, b.not_reached, b.broken_bonds, b.equilibria
        ))
    }
}

/// How far a load step is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WithinStep {
    /// Equilibria that are done.
    pub equilibria: usize,
    /// Iterations of the solve under way.
    pub iterations: usize,
    /// Its relative residual.
    pub residual: f64,
    /// Bonds that broke in the step so far.
    pub broken: u64,
}

/// Sees a load step after each iteration of its solves, and says whether to go on. Nothing of this changes a result.
pub type StepLook<'a> = &'a dyn Fn(&WithinStep) -> bool;
