//! Where the energy of moving spheres is.

use serde::{Deserialize, Serialize};

/// Energies (J) of spheres in motion, and what broke.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ParticleLedger {
    /// Kinetic energy of translation, ½ m v₋·v₊ of the velocities half a step before and after.
    pub kinetic: f64,
    /// Kinetic energy of rotation, ½ I ω₋·ω₊.
    pub rotational: f64,
    /// Energy of bonds.
    pub bonds: f64,
    /// Energy of contacts.
    pub contacts: f64,
    /// Lost to damping so far.
    pub damping: f64,
    /// Lost with broken bonds so far.
    pub fracture: f64,
    /// Lost to friction of contacts so far.
    pub friction: f64,
    /// Work of loads, of held spheres and of the cell so far.
    pub external: f64,
    /// Kinetic and stored energy at the start.
    pub initial: f64,
    /// Bonds broken so far.
    pub broken_bonds: u64,
}

impl ParticleLedger {
    /// Names of the numbers of a row.
    pub const COLUMNS: [&'static str; 10] = [
        "kinetic_J",
        "rotational_J",
        "bonds_J",
        "contacts_J",
        "damping_J",
        "fracture_J",
        "friction_J",
        "external_J",
        "drift_J",
        "broken_bonds",
    ];

    /// The numbers, in the order of [`ParticleLedger::COLUMNS`].
    pub fn row(&self) -> [f64; 10] {
        let stored = [self.kinetic, self.rotational, self.bonds, self.contacts];
        let [a, b, c, d] = stored;
        let broken = self.broken_bonds as f64;
        [a, b, c, d, self.damping, self.fracture, self.friction, self.external, self.drift(), broken]
    }

    /// Energy that is there now (J).
    pub fn stored(&self) -> f64 {
        self.kinetic + self.rotational + self.bonds + self.contacts
    }

    /// What is there and lost, less what came in (J). Of the order Δt² where bonds stay whole, Δt where they break.
    pub fn drift(&self) -> f64 {
        self.stored() + self.damping + self.fracture + self.friction - self.external - self.initial
    }

    /// The drift relative to the largest of the energies (–).
    pub fn relative_drift(&self) -> f64 {
        let lost = [self.damping, self.fracture, self.friction, self.external.abs(), self.initial];
        let stored = [self.kinetic, self.rotational, self.bonds, self.contacts];
        let largest = lost.into_iter().chain(stored).fold(0.0, f64::max);
        if largest > 0.0 { self.drift().abs() / largest } else { 0.0 }
    }
}
