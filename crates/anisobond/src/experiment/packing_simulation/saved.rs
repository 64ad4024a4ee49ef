//! The state of a run on a packing, kept and gone on with.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::{Leavers, PackingSimulation, Peak, Stage};
use crate::Result;
use crate::experiment::particles::Progress;
use crate::experiment::simulation::SavedState;
use crate::operator::particles::Snapshot;

/// What a saved state says beside its arrays.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PackingFacts {
    progress: Progress,
    peak: Option<Peak>,
    left: Option<Leavers>,
}

impl PackingSimulation {
    /// Everything that is needed to go on.
    pub fn save(&self) -> SavedState<PackingFacts> {
        let Snapshot { mut numbers, words } = self.particles().snapshot();
        numbers.push(("virial".into(), self.sums().virial.iter().copied().collect()));
        let progress = match &self.stage {
            Stage::Motion { motion, .. } => motion.progress,
            Stage::Equilibrium(rest) => {
                let external = &rest.external;
                let flat = |field: &[Vector3<f64>]| field.iter().flat_map(|v| [v.x, v.y, v.z]).collect();
                let [forces, moments] =
                    [0, 1].map(|k| external.force.iter().flat_map(move |f| [f[k].x, f[k].y, f[k].z]));
                numbers.push(("external_force".into(), forces.collect()));
                numbers.push(("external_moment".into(), moments.collect()));
                numbers.push(("settled_displacement".into(), flat(&external.displacement)));
                numbers.push(("settled_rotation".into(), flat(&external.rotation)));
                Progress { steps: rest.step, ledger: rest.ledger, ..Progress::default() }
            }
        };
        let facts = PackingFacts { progress, peak: self.peak, left: self.left };
        SavedState { facts, numbers, words }
    }

    /// Go on from a saved state of the same problem.
    ///
    /// # Errors
    /// A state of another problem.
    pub fn restore(&mut self, mut state: SavedState<PackingFacts>) -> Result<()> {
        let facts = std::mem::take(&mut state.facts);
        let n = self.particles().len();
        let virial = Matrix3::from_column_slice(&state.take_numbers("virial", 9)?);
        match &mut self.stage {
            Stage::Motion { motion, .. } => {
                let spheres = Snapshot { numbers: state.numbers, words: state.words };
                motion.go_on(facts.progress, virial, spheres)?;
            }
            Stage::Equilibrium(rest) => {
                let mut field = |name: &str| -> Result<Vec<Vector3<f64>>> {
                    Ok(state.take_numbers(name, 3 * n)?.as_chunks::<3>().0.iter().map(|v| Vector3::from(*v)).collect())
                };
                let (forces, moments) = (field("external_force")?, field("external_moment")?);
                rest.external.force = forces.into_iter().zip(moments).map(|(f, m)| [f, m]).collect();
                rest.external.displacement = field("settled_displacement")?;
                rest.external.rotation = field("settled_rotation")?;
                rest.particles.restore(Snapshot { numbers: state.numbers, words: state.words })?;
                rest.sums.virial = virial;
                (rest.step, rest.ledger) = (facts.progress.steps, facts.progress.ledger);
            }
        }
        self.peak = facts.peak;
        self.left = facts.left;
        Ok(())
    }
}
