//! Velocity Verlet for displacements and rotations, in the form of a leapfrog.
//!
//! Velocities and spins live half a step ahead: v₊ = v₋ + h F/m, u ← u + h v₊; ω₊ = ω₋ + h M/I (a ball's inertia is the
//! same about every axis), R ← exp(h ω₊) R. Forces that come in opposite pairs and balance their moments keep momentum and
//! angular momentum Σ x×m v + I ω to rounding.
//!
//! Damping, viscous and local, is that of `solver::motion`, component by component of forces and moments.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::Result;
use crate::operator::Kinematics;
use crate::operator::particles::{Particles, Sums};
use crate::solver::Kick;

/// The scheme's numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verlet {
    /// Time step h (s).
    pub step: f64,
    /// Viscous damping α (1/s).
    pub viscous: f64,
    /// Local damping λ (–), 0 ≤ λ < 1.
    pub local: f64,
}

/// What acts on spheres beside bonds and contacts, at one moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Acting {
    /// Forces and moments; a sphere may have several.
    pub loads: Vec<PointLoad>,
    /// Components whose velocity is prescribed over the step ahead; later ones win.
    pub held: Vec<Held>,
}

/// A force and a moment on a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLoad {
    /// The sphere.
    pub sphere: u32,
    /// Force (N).
    pub force: Vector3<f64>,
    /// Moment (N·m).
    pub moment: Vector3<f64>,
}

impl PointLoad {
    /// A force (N) on a sphere.
    pub fn force(sphere: u32, force: Vector3<f64>) -> Self {
        PointLoad { sphere, force, moment: Vector3::zeros() }
    }

    /// A moment (N·m) on a sphere.
    pub fn moment(sphere: u32, moment: Vector3<f64>) -> Self {
        PointLoad { sphere, force: Vector3::zeros(), moment }
    }
}

/// A prescribed velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held {
    /// The sphere.
    pub sphere: u32,
    /// 0, 1, 2: velocity along x, y, z; 3, 4, 5: spin about x, y, z.
    pub component: usize,
    /// Velocity (m/s) or spin (rad/s) half a step ahead.
    pub velocity: f64,
}

/// Energies that one kick moves (J), by halves: those of the step that ends with it and of the one that begins.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Kinetic energy of translation ½ m v₋·v₊.
    pub kinetic: f64,
    /// Kinetic energy of rotation ½ I ω₋·ω₊.
    pub rotational: f64,
    /// Work of loads and held components: behind and ahead.
    pub external: [f64; 2],
    /// Lost to damping: behind and ahead.
    pub damping: [f64; 2],
}

/// A sphere whose speed is beyond the bound, or no number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Runaway {
    /// The sphere.
    pub sphere: usize,
    /// Its speed (m/s).
    pub speed: f64,
}

/// Spheres per piece of work; sums are taken piece by piece in their order, so that threads do not change them.
const CHUNK: usize = 512;

/// A sphere on which something acts: its number, its own load, its velocities before.
struct Special {
    place: usize,
    own: [[f64; 3]; 2],
    before: [Vector3<f64>; 2],
    load: [Vector3<f64>; 2],
    held: [Option<f64>; 6],
}

impl Verlet {
    /// Advance velocities by the forces last evaluated and by what acts, over `span` (s): h, or h/2 for the first kick.
    ///
    /// # Errors
    /// A sphere faster than `fastest` (m/s), or of no speed at all (not a number): the motion has exploded.
    pub fn kick(
        &self,
        particles: &mut Particles,
        acting: &Acting,
        span: f64,
        fastest: f64,
    ) -> std::result::Result<Work, Runaway> {
        let mut specials = specials(particles, acting);
        let state = particles.motion();
        for s in &mut specials {
            let load = &mut state.loads[s.place];
            s.own = [load.force, load.moment];
            s.before = [state.velocity[s.place], state.spin[s.place]];
            for i in 0..3 {
                load.force[i] += s.load[0][i];
                load.moment[i] += s.load[1][i];
            }
        }
        let kick = Kick { step: span, damping: self.viscous, local: self.local };
        let whole = if span == self.step { 1.0 } else { 0.0 };
        let pieces: Vec<(Work, Option<(usize, f64)>)> = state
            .velocity
            .par_chunks_mut(CHUNK)
            .zip(state.spin.par_chunks_mut(CHUNK))
            .enumerate()
            .map(|(chunk, (velocity, spin))| {
                let first = chunk * CHUNK;
                let (mut work, mut runaway) = (Work::default(), None);
                for (i, (v, w)) in velocity.iter_mut().zip(spin).enumerate() {
                    let load = &state.loads[first + i];
                    let (m, inertia) = (state.mass[first + i], state.inertia[first + i]);
                    work.kinetic += self.push(&kick, whole, v, &load.force, m, &mut work.damping);
                    work.rotational += self.push(&kick, whole, w, &load.moment, inertia, &mut work.damping);
                    let square = v.norm_squared();
                    let within = square <= fastest * fastest && w.norm_squared().is_finite();
                    if !within && runaway.is_none() {
                        runaway = Some((first + i, square.sqrt()));
                    }
                }
                (work, runaway)
            })
            .collect();
        let mut total = Work::default();
        for (work, _) in &pieces {
            total.kinetic += work.kinetic;
            total.rotational += work.rotational;
            (0..2).for_each(|i| total.damping[i] += work.damping[i]);
        }
        let runaway = pieces.iter().find_map(|p| p.1);
        for s in &specials {
            self.hold(s, &kick, whole, particles, &mut total);
        }
        match runaway {
            None => Ok(total),
            Some((place, speed)) => Err(Runaway { sphere: particles.sphere_at(place), speed }),
        }
    }

    /// Kick one vector; its kinetic energy, and its losses added.
    #[inline(always)]
    fn push(
        &self,
        kick: &Kick,
        whole: f64,
        v: &mut Vector3<f64>,
        force: &[f64; 3],
        mass: f64,
        damping: &mut [f64; 2],
    ) -> f64 {
        let (keep, push) = kick.factors();
        let gain = push * (1.0 / mass);
        let mut kinetic = 0.0;
        for i in 0..3 {
            let before = v[i];
            let drag = if self.local > 0.0 { kick.drag(whole == 0.0, before, force[i], mass) } else { 0.0 };
            let after = keep * before + gain * (force[i] - drag);
            v[i] = after;
            let behind = behind(whole, before, after);
            kinetic += 0.5 * mass * behind * after;
            if self.local > 0.0 || self.viscous > 0.0 {
                let [back, ahead] = self.lost(whole, mass, drag, before, after);
                damping[0] += back;
                damping[1] += ahead;
            }
        }
        kinetic
    }

    /// Energy (J) that the drag and the viscous damping of a kick take in the halves of the steps behind and ahead.
    #[inline(always)]
    fn lost(&self, whole: f64, mass: f64, drag: f64, before: f64, after: f64) -> [f64; 2] {
        let half = 0.5 * self.step * (drag + self.viscous * mass * 0.5 * (before + after));
        [half * behind(whole, before, after), half * after]
    }

    /// Put held components to their velocities, count the work of loads and holds, and restore the sphere's own load.
    fn hold(&self, s: &Special, kick: &Kick, whole: f64, particles: &mut Particles, work: &mut Work) {
        let state = particles.motion();
        let inertia = [state.mass[s.place], state.inertia[s.place]];
        let acting = [state.loads[s.place].force, state.loads[s.place].moment];
        for (kind, velocities) in [&mut *state.velocity, &mut *state.spin].into_iter().enumerate() {
            let v = &mut velocities[s.place];
            for i in 0..3 {
                let before = s.before[kind][i];
                let behind = |after: f64| behind(whole, before, after);
                let mut force = s.load[kind][i];
                if let Some(prescribed) = s.held[3 * kind + i] {
                    let (mass, damped) = (inertia[kind], v[i]);
                    let share = |after: f64| 0.5 * mass * behind(after) * after;
                    let drag = kick.drag(whole == 0.0, before, acting[kind][i], mass);
                    let (_, per_force) = kick.factors();
                    let free = damped + drag * per_force / mass;
                    let kinetic = share(prescribed) - share(damped);
                    if kind == 0 {
                        work.kinetic += kinetic
                    } else {
                        work.rotational += kinetic
                    }
                    // Force that makes the difference, on top of everything else that acts but local drag.
                    force += (prescribed - free) * mass / per_force;
                    let now = self.lost(whole, mass, 0.0, before, prescribed);
                    let then = self.lost(whole, mass, drag, before, damped);
                    (0..2).for_each(|i| work.damping[i] += now[i] - then[i]);
                    v[i] = prescribed;
                }
                work.external[0] += 0.5 * self.step * force * behind(v[i]);
                work.external[1] += 0.5 * self.step * force * v[i];
            }
        }
        state.loads[s.place].force = s.own[0];
        state.loads[s.place].moment = s.own[1];
    }

    /// One step of the places: [`Verlet::drift`], a periodic cell moved by a gradient D (–), and the forces there.
    ///
    /// # Errors
    /// As [`Particles::evaluate`].
    pub fn move_on(&self, particles: &mut Particles, gradient: Option<&Matrix3<f64>>) -> Result<Sums> {
        self.drift(particles);
        if let Some(gradient) = gradient {
            particles.deform(gradient);
        }
        particles.evaluate(self.step)
    }

    /// Advance displacements and rotations by the velocities: u += h v, R ← exp(h ω) R.
    pub fn drift(&self, particles: &mut Particles) {
        let kinematics = particles.kinematics();
        let state = particles.motion();
        let step = self.step;
        state
            .poses
            .par_chunks_mut(CHUNK)
            .zip(state.velocity.par_chunks(CHUNK).zip(state.spin.par_chunks(CHUNK)))
            .for_each(|(poses, (velocity, spin))| {
                for (pose, (v, w)) in poses.iter_mut().zip(velocity.iter().zip(spin)) {
                    pose.shift(&(v * step));
                    match kinematics {
                        Kinematics::Linear => pose.add_theta(&(w * step)),
                        Kinematics::Finite => pose.rotate(&(w * step)),
                    }
                }
            });
    }
}

/// v₋; of the first kick, which is from the start, what leads to v₊ through the start's velocity.
#[inline(always)]
fn behind(whole: f64, before: f64, after: f64) -> f64 {
    whole * before + (1.0 - whole) * (2.0 * before - after)
}

/// Spheres on which something acts, each once, in the order of their places.
fn specials(particles: &Particles, acting: &Acting) -> Vec<Special> {
    let mut of = std::collections::BTreeMap::new();
    for load in &acting.loads {
        let place = particles.place_of(load.sphere as usize);
        let s = of.entry(place).or_insert_with(|| Special::at(place));
        s.load[0] += load.force;
        s.load[1] += load.moment;
    }
    for held in &acting.held {
        let place = particles.place_of(held.sphere as usize);
        of.entry(place).or_insert_with(|| Special::at(place)).held[held.component] = Some(held.velocity);
    }
    of.into_values().collect()
}

impl Special {
    fn at(place: usize) -> Self {
        Special {
            place,
            own: [[0.0; 3]; 2],
            before: [Vector3::zeros(); 2],
            load: [Vector3::zeros(); 2],
            held: [None; 6],
        }
    }
}
