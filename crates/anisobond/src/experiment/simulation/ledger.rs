//! Where the energy of a run is.

use serde::{Deserialize, Serialize};

/// Energies of a run (J), and what it has broken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    /// Kinetic energy ½ m v₋·v₊ of the velocities half a step before and after, for which the scheme's balance is exact; it
    /// differs from ½ m v² by (Δt a)² m/8.
    pub kinetic: f64,
    /// Energy of bonds and nodal terms.
    pub strain: f64,
    /// Lost to damping so far; in equilibrium what was set free where bonds failed, which in motion goes into waves.
    pub damping: f64,
    /// Lost with bonds that broke or softened so far.
    pub fracture: f64,
    /// Work of forces and of prescribed motion so far.
    pub external: f64,
    /// Kinetic and strain energy at the start.
    pub initial: f64,
    /// Bonds broken so far, pre-cracks not counted.
    pub broken_bonds: u64,
}

impl Ledger {
    /// Names of the numbers of a row.
    pub const COLUMNS: [&'static str; 7] =
        ["kinetic_J", "strain_J", "damping_J", "fracture_J", "external_J", "drift_J", "broken_bonds"];

    /// The numbers, in the order of [`Ledger::COLUMNS`].
    pub fn row(&self) -> [f64; 7] {
        let broken = self.broken_bonds as f64;
        [self.kinetic, self.strain, self.damping, self.fracture, self.external, self.drift(), broken]
    }

    /// What is there and lost, less what came in (J). Zero to rounding in motion of linear bonds, also while they fail, and to
    /// the solver's tolerance in their equilibrium; at finite stretch of second order in the step.
    pub fn drift(&self) -> f64 {
        self.kinetic + self.strain + self.damping + self.fracture - self.external - self.initial
    }

    /// The drift relative to the largest of the energies (–).
    pub fn relative_drift(&self) -> f64 {
        let energies = [self.kinetic, self.strain, self.damping, self.fracture, self.external.abs(), self.initial];
        let largest = energies.into_iter().fold(0.0, f64::max);
        if largest > 0.0 { self.drift().abs() / largest } else { 0.0 }
    }
}
