//! Conditions as what acts on spheres at a moment.

use std::collections::HashMap;

use nalgebra::Vector3;

use super::problem::PackingProblem;
use crate::experiment::element_test::Rotations;
use crate::experiment::problem::{Condition, History};
use crate::operator::particles::Particles;
use crate::solver::particles::{Acting, Held, PointLoad, SpheresAtRest, Support};
use crate::{Error, Result};

/// A prescribed component of a sphere: `value` (m or m/s) times a history.
#[derive(Clone, Copy, Debug)]
struct Prescribed {
    sphere: u32,
    axis: usize,
    velocity: bool,
    history: usize,
    value: f64,
}

/// What acts on the spheres of a body.
#[derive(Clone, Debug)]
pub(super) struct Loading {
    histories: Vec<History>,
    forces: Vec<(u32, usize, Vector3<f64>)>,
    prescribed: Vec<Prescribed>,
    /// Spheres whose rotation is held: all, or none.
    unturned: u32,
}

impl Loading {
    /// # Errors
    /// A component that two conditions prescribe differently.
    pub(super) fn new(problem: &PackingProblem) -> Result<Self> {
        let spheres = problem.model.packing.len();
        let unturned = if problem.rotations == Rotations::Blocked { spheres as u32 } else { 0 };
        let mut loading = Loading { histories: Vec::new(), forces: Vec::new(), prescribed: Vec::new(), unturned };
        let mut known: HashMap<(u32, usize), Prescribed> = HashMap::new();
        for condition in &problem.conditions {
            let history = loading.histories.len();
            let time = match condition {
                Condition::Force { history, .. }
                | Condition::Displacement { history, .. }
                | Condition::Velocity { history, .. } => history,
            };
            loading.histories.push(time.clone());
            match condition {
                Condition::Force { nodes, force, .. } => {
                    // A sphere may carry several surfaces.
                    for (&sphere, &f) in nodes.iter().zip(force) {
                        match loading.forces.last_mut().filter(|last| (last.0, last.1) == (sphere, history)) {
                            Some(last) => last.2 += f,
                            None => loading.forces.push((sphere, history, f)),
                        }
                    }
                }
                Condition::Displacement { nodes, value, .. } | Condition::Velocity { nodes, value, .. } => {
                    let velocity = matches!(condition, Condition::Velocity { .. });
                    for &sphere in nodes {
                        for axis in 0..3 {
                            let Some(value) = value[axis] else { continue };
                            let entry = Prescribed { sphere, axis, velocity, history, value };
                            match known.insert((sphere, axis), entry) {
                                None => loading.prescribed.push(entry),
                                Some(other) if loading.same(&other, &entry) => {}
                                Some(_) => return Err(contradiction(problem, sphere, axis)),
                            }
                        }
                    }
                }
            }
        }
        loading.prescribed.sort_by_key(|p| (p.sphere, p.axis));
        Ok(loading)
    }

    /// Whether both prescribe the same at all times.
    fn same(&self, a: &Prescribed, b: &Prescribed) -> bool {
        let history = |p: &Prescribed| &self.histories[p.history];
        a.velocity == b.velocity && a.value == b.value && (a.value == 0.0 || history(a) == history(b))
    }

    fn factors(&self, t: f64) -> Vec<f64> {
        self.histories.iter().map(|h| h.at(t)).collect()
    }

    /// Forces at time t (s) or a load factor.
    pub(super) fn loads(&self, t: f64) -> Vec<PointLoad> {
        let now = self.factors(t);
        let load = |&(sphere, history, force): &(u32, usize, Vector3<f64>)| PointLoad {
            sphere,
            force: force * now[history],
            moment: Vector3::zeros(),
        };
        self.forces.iter().map(load).collect()
    }

    /// What acts at time t (s) and prescribes the velocities half a step (s) ahead. A displacement is prescribed as the
    /// velocity that leads to where it is to be after the step.
    pub(super) fn acting(&self, particles: &Particles, t: f64, step: f64) -> Acting {
        let (half, whole) = (self.factors(t + 0.5 * step), self.factors(t + step));
        let held = |p: &Prescribed| {
            let velocity = if p.velocity {
                p.value * half[p.history]
            } else {
                (p.value * whole[p.history] - particles.displacement(p.sphere as usize)[p.axis]) / step
            };
            Held { sphere: p.sphere, component: p.axis, velocity }
        };
        let mut held: Vec<Held> = self.prescribed.iter().map(held).collect();
        let still = |sphere| (3..6).map(move |component| Held { sphere, component, velocity: 0.0 });
        held.extend((0..self.unturned).flat_map(still));
        Acting { loads: self.loads(t), held }
    }

    /// Prescribed displacements at a load factor (or time), spheres that nothing joins held where they came `from`, or at the start.
    pub(super) fn supports(&self, t: f64, loose: &[u32], from: Option<&SpheresAtRest>) -> Vec<Support> {
        let now = self.factors(t);
        let mut supports: HashMap<u32, [Option<f64>; 6]> = HashMap::new();
        for p in self.prescribed.iter().filter(|p| !p.velocity) {
            supports.entry(p.sphere).or_insert([None; 6])[p.axis] = Some(p.value * now[p.history]);
        }
        for sphere in 0..self.unturned {
            supports.entry(sphere).or_insert([None; 6])[3..].fill(Some(0.0));
        }
        for &sphere in loose {
            let value = supports.entry(sphere).or_insert([None; 6]);
            let place = |i: usize| match from {
                None => 0.0,
                Some(rest) if i < 3 => rest.displacement[sphere as usize][i],
                Some(rest) => rest.rotation[sphere as usize][i - 3],
            };
            value.iter_mut().enumerate().for_each(|(i, v)| *v = v.or(Some(place(i))));
        }
        let mut supports: Vec<Support> =
            supports.into_iter().map(|(sphere, value)| Support { sphere, value }).collect();
        supports.sort_by_key(|s| s.sphere);
        supports
    }
}

fn contradiction(problem: &PackingProblem, sphere: u32, axis: usize) -> Error {
    let x = problem.position(sphere as usize);
    Error::input(
        format!(
            "component {} of sphere {} at ({}, {}, {}) m is prescribed differently by two conditions",
            ["x", "y", "z"][axis],
            sphere + 1,
            x.x,
            x.y,
            x.z
        ),
        "let the regions of the two conditions not share spheres, or prescribe other components",
    )
}
