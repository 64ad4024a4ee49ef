//! A bond law of one's own: softening along a parabola. A bar is pulled apart with it.
//! `cargo run -p anisobond --example bond_law`.

use std::sync::Arc;

use anisobond::bond_law::{BondLaw, BondState};
use anisobond::nalgebra::Vector3;
use anisobond::prelude::*;

/// The force falls along ((r − λ)/(r − 1))², λ the largest elongation so far in units of that at the onset.
#[derive(Debug)]
struct Parabola {
    end: f64,
}

impl BondLaw for Parabola {
    fn energy_ratio(&self) -> f64 {
        // Twice ½ up to the onset and ∫₁^r ((r − λ)/(r − 1))² dλ.
        1.0 + 2.0 * (self.end - 1.0) / 3.0
    }

    fn secant(&self, state: &BondState) -> f64 {
        let rest = ((self.end - state.history) / (self.end - 1.0)).max(0.0);
        rest * rest / state.history
    }

    fn damage(&self, state: &BondState) -> f64 {
        let (l, rest) = (state.history, ((self.end - state.history) / (self.end - 1.0)).max(0.0));
        let area = (self.end - 1.0) / 3.0 * (1.0 - rest.powi(3));
        (1.0 + 2.0 * area - rest * rest * l) / self.energy_ratio()
    }
}

/// Prints what the head of this file says.
pub fn main() -> Result<()> {
    let grid = Grid::new([24, 8, 3], 1e-3, Vector3::zeros(), [false, false, true])?;
    let ends = |at: usize| -> Vec<u32> {
        (0..grid.len() as u32).filter(|n| grid.coordinates(*n as usize)[0].abs_diff(at) < 2).collect()
    };
    let region = RegionMaterial {
        name: "bar".into(),
        stiffness: Stiffness::isotropic(48e9, 28.8e9),
        density: 2440.0,
        fracture: Some(FractureEnergy::Isotropic(4.0)),
    };
    let bonds = Neighbourhood::sphere(2.0, 1e-3, Influence::Inverse)?;
    let mut problem = Problem::new("bar", Body::full(grid.clone()), bonds, vec![region], Schedule::motion(20e-6));
    problem.law = Arc::new(Parabola { end: 5.0 });
    for (nodes, velocity) in [(ends(0), -2.0), (ends(23), 2.0)] {
        let value = [Some(velocity), None, None];
        problem.conditions.push(Condition::Velocity { nodes, value, history: History::Constant });
    }
    let mut run = Simulation::new(problem)?;
    while !run.finished() {
        run.advance()?;
    }
    let ledger = run.ledger();
    println!("{} bonds broken, {} soften", ledger.broken_bonds, run.bond_state().departed());
    println!("{:.2e} J lost with them, energy drift {:.1e}", ledger.fracture, ledger.relative_drift());
    assert!(ledger.broken_bonds > 0 && ledger.relative_drift() < 1e-10);
    Ok(())
}
