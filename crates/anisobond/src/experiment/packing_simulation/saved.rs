//! The state of a run on a packing, kept and gone on with.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::{PackingSimulation, Peak, Stage, Work};
use crate::experiment::simulation::{Ledger, SavedState};
use crate::operator::particles::Snapshot;
use crate::{Error, Result};

/// What a saved state says beside its arrays.
#[derive(Serialize, Deserialize)]
struct About {
    step: u64,
    ledger: Ledger,
    lost: f64,
    external_ahead: f64,
    damping_ahead: f64,
    peak: Option<Peak>,
    gone: Option<(usize, f64)>,
}

impl PackingSimulation {
    /// Everything that is needed to go on.
    pub fn save(&self) -> SavedState {
        let Snapshot { mut numbers, words } = self.particles.snapshot();
        numbers.push(("virial".into(), self.sums.virial.iter().copied().collect()));
        let mut about = About {
            step: self.step,
            ledger: self.ledger,
            lost: self.lost,
            external_ahead: 0.0,
            damping_ahead: 0.0,
            peak: self.peak,
            gone: self.gone,
        };
        match &self.stage {
            Stage::Motion { last, .. } => {
                (about.external_ahead, about.damping_ahead) = (last.external[1], last.damping[1]);
            }
            Stage::Equilibrium { external, .. } => {
                let flat = |field: &[Vector3<f64>]| field.iter().flat_map(|v| [v.x, v.y, v.z]).collect();
                let [forces, moments] =
                    [0, 1].map(|k| external.force.iter().flat_map(move |f| [f[k].x, f[k].y, f[k].z]));
                numbers.push(("external_force".into(), forces.collect()));
                numbers.push(("external_moment".into(), moments.collect()));
                numbers.push(("settled_displacement".into(), flat(&external.displacement)));
                numbers.push(("settled_rotation".into(), flat(&external.rotation)));
            }
        }
        SavedState { about: serde_json::to_string(&about).unwrap_or_default(), numbers, words }
    }

    /// Go on from a saved state of the same problem.
    ///
    /// # Errors
    /// A state of another problem.
    pub fn restore(&mut self, mut state: SavedState) -> Result<()> {
        let about: About = serde_json::from_str(&state.about)
            .map_err(|e| Error::input(format!("the saved state cannot be read: {e}"), "start anew"))?;
        let n = self.particles.len();
        self.sums.virial = Matrix3::from_column_slice(&state.take_numbers("virial", 9)?);
        match &mut self.stage {
            Stage::Motion { last, .. } => {
                *last = Work {
                    external: [0.0, about.external_ahead],
                    damping: [0.0, about.damping_ahead],
                    ..Work::default()
                };
            }
            Stage::Equilibrium { external, .. } => {
                let mut field = |name: &str| -> Result<Vec<Vector3<f64>>> {
                    Ok(state.take_numbers(name, 3 * n)?.as_chunks::<3>().0.iter().map(|v| Vector3::from(*v)).collect())
                };
                let (forces, moments) = (field("external_force")?, field("external_moment")?);
                external.force = forces.into_iter().zip(moments).map(|(f, m)| [f, m]).collect();
                external.displacement = field("settled_displacement")?;
                external.rotation = field("settled_rotation")?;
            }
        }
        self.particles.restore(Snapshot { numbers: state.numbers, words: state.words })?;
        self.step = about.step;
        self.ledger = about.ledger;
        self.lost = about.lost;
        self.peak = about.peak;
        self.gone = about.gone;
        Ok(())
    }
}
