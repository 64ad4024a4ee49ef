//! Motion: one step of velocity Verlet, with the energies that it moves.

use nalgebra::Vector3;

use super::loading::{Factors, Loading};
use crate::experiment::problem::Problem;
use crate::operator::grid::{Broken, GridBonds, Padded};
use crate::operator::{Kinematics, VectorField};
use crate::solver::Kick;

/// Velocities and what they need.
pub(super) struct Motion {
    /// Velocities half a step ahead of the displacements (m/s).
    pub(super) velocity: VectorField,
    /// 1/m (1/kg) by region, that of empty nodes 0.
    per_mass: Vec<f64>,
    /// Time step (s).
    pub(super) step: f64,
    /// Damping α (1/s).
    damping: f64,
    /// Kinetic energy of `velocity` (J).
    pub(super) kinetic_ahead: f64,
}

/// What one pass over the body moves.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pass {
    /// Kinetic energy at the moment of the displacements (J), mean of before and after.
    pub(super) kinetic: f64,
    /// Work of forces and held nodes (J) in the pass.
    pub(super) external: f64,
    /// Lost to damping in the pass (J).
    pub(super) damping: f64,
    /// −½ Σ u·f: the strain energy (J) of linear bonds; only where it was asked for.
    pub(super) strain: f64,
    /// Bonds that broke.
    pub(super) broken: Broken,
}

/// A prescribed component of a row's node during a pass.
struct Held {
    element: usize,
    axis: usize,
    before: f64,
    after: f64,
}

/// A loaded node of a row during a pass.
struct Loaded {
    element: usize,
    force: Vector3<f64>,
    before: Vector3<f64>,
}

/// Sums of a row: external work, damping loss, kinetic energy after, −½ Σ u·f.
type RowSums = [f64; 4];

impl Motion {
    pub(super) fn new(problem: &Problem, velocity: VectorField, step: f64, damping: f64) -> Self {
        let volume = problem.body.grid.spacing.powi(3);
        let per_mass = std::iter::once(0.0).chain(problem.regions.iter().map(|r| 1.0 / (r.density * volume))).collect();
        let mut motion = Motion { velocity, per_mass, step, damping, kinetic_ahead: 0.0 };
        motion.kinetic_ahead = motion.kinetic(problem);
        motion
    }

    /// Kinetic energy of the velocities (J), summed node by node.
    fn kinetic(&self, problem: &Problem) -> f64 {
        let square = |node: usize| self.velocity.at(node).norm_squared();
        let regions = problem.body.region.iter().enumerate().filter(|(_, r)| **r > 0);
        regions.map(|(node, &r)| 0.5 * square(node) / self.per_mass[usize::from(r)]).sum()
    }

    /// Advance displacements: u += Δt v.
    pub(super) fn drift(&self, u: &mut Padded<f64>) {
        let [x, y, z] = &self.velocity.components;
        u.drift([x, y, z], self.step);
    }

    /// Advance velocities by the forces at time t over `span` (s): Δt, or Δt/2 for the first kick.
    pub(super) fn kick(
        &mut self,
        problem: &Problem,
        loading: &Loading,
        bonds: &mut GridBonds<f64>,
        u: &Padded<f64>,
        (t, span): (f64, f64),
        measured: bool,
    ) -> Pass {
        let n = problem.body.grid.nodes[0];
        let kick = Kick { step: span, damping: self.damping };
        let row = RowKick {
            loading,
            kick,
            per_mass: &self.per_mass,
            step: self.step,
            u,
            now: loading.at(t),
            velocities: loading.at(t + 0.5 * self.step),
            displacements: loading.at(t + self.step),
            strain: measured && problem.kinematics == Kinematics::Linear,
        };
        let region = &problem.body.region;
        let visit = |number: usize, force: [&[f64]; 3], velocity: [&mut [f64]; 3]| {
            row.advance(number, &region[number * n..(number + 1) * n], force, velocity)
        };
        let [x, y, z] = &mut self.velocity.components;
        let (broken, sums) = bonds.sweep_breaking(u, problem.kinematics, [x, y, z], visit);
        let [external, damping, kinetic, strain] =
            sums.iter().fold([0.0; 4], |sum, row| std::array::from_fn(|i| sum[i] + row[i]));
        let before = std::mem::replace(&mut self.kinetic_ahead, kinetic);
        Pass { kinetic: 0.5 * (before + kinetic), external, damping, strain, broken }
    }
}

/// What all rows of a pass share.
struct RowKick<'a> {
    loading: &'a Loading,
    kick: Kick,
    per_mass: &'a [f64],
    step: f64,
    u: &'a Padded<f64>,
    now: Factors,
    velocities: Factors,
    displacements: Factors,
    strain: bool,
}

impl RowKick<'_> {
    fn advance(&self, row: usize, region: &[u16], force: [&[f64]; 3], mut velocity: [&mut [f64]; 3]) -> RowSums {
        let first = row * region.len();
        let at = |element: usize, v: &[&mut [f64]; 3]| Vector3::new(v[0][element], v[1][element], v[2][element]);
        let loaded: Vec<Loaded> = self
            .loading
            .forces(row, &self.now)
            .map(|(node, force)| Loaded { element: node - first, force, before: at(node - first, &velocity) })
            .collect();
        let held = self.held(row, first, &velocity);
        let damped = self.kick.damping > 0.0;
        let before: Option<[Vec<f64>; 3]> = damped.then(|| std::array::from_fn(|a| velocity[a].to_vec()));

        for (velocity, force) in velocity.iter_mut().zip(force) {
            self.kick.apply(velocity, force, region.iter().map(|&r| self.per_mass[usize::from(r)]));
        }
        for load in &loaded {
            let per_mass = self.per_mass[usize::from(region[load.element])];
            for (velocity, force) in velocity.iter_mut().zip(load.force.iter()) {
                velocity[load.element] += self.kick.push(*force, per_mass);
            }
        }
        held.iter().for_each(|h| velocity[h.axis][h.element] = h.after);

        let mut sums = [0.0; 4];
        for load in &loaded {
            sums[0] += 0.5 * load.force.dot(&(load.before + at(load.element, &velocity))) * self.kick.step;
        }
        for h in &held {
            sums[0] += self.reaction_work(h, region, force, &loaded);
        }
        self.add_energies(&mut sums, first, region, force, &velocity, before.as_ref());
        sums
    }

    /// Prescribed components of a row: the velocity that brings a displacement to where it is to be after the step, or
    /// the one prescribed half a step ahead.
    fn held(&self, row: usize, first: usize, velocity: &[&mut [f64]; 3]) -> Vec<Held> {
        let rows =
            self.loading.prescribed(row, &self.velocities).zip(self.loading.prescribed(row, &self.displacements));
        rows.map(|((entry, speed), (_, place))| {
            let (node, axis) = (entry.node as usize, usize::from(entry.axis));
            let to_place = || (place - self.u.at(node)[axis]) / self.step;
            let after = if entry.velocity { speed } else { to_place() };
            Held { element: node - first, axis, before: velocity[axis][node - first], after }
        })
        .collect()
    }

    /// Work (J) of what holds a component: force m (v₊ − v₋)/h + α m v̄ − f on the path v̄ h, the loads' part not counted.
    fn reaction_work(&self, h: &Held, region: &[u16], force: [&[f64]; 3], loaded: &[Loaded]) -> f64 {
        let mass = 1.0 / self.per_mass[usize::from(region[h.element])];
        let mean = 0.5 * (h.before + h.after);
        let load: f64 = loaded.iter().filter(|l| l.element == h.element).map(|l| l.force[h.axis]).sum();
        let inertia = mass * (h.after - h.before) / self.kick.step + self.kick.damping * mass * mean;
        (inertia - force[h.axis][h.element] - load) * mean * self.kick.step
    }

    /// Kinetic energy after the kick, loss to damping, and strain energy where it is asked for.
    fn add_energies(
        &self,
        sums: &mut RowSums,
        first: usize,
        region: &[u16],
        force: [&[f64]; 3],
        velocity: &[&mut [f64]; 3],
        before: Option<&[Vec<f64>; 3]>,
    ) {
        for (e, &r) in region.iter().enumerate().filter(|(_, r)| **r > 0) {
            let mass = 1.0 / self.per_mass[usize::from(r)];
            for a in 0..3 {
                let after = velocity[a][e];
                sums[2] += 0.5 * mass * after * after;
                if let Some(before) = before {
                    let mean = 0.5 * (before[a][e] + after);
                    sums[1] += self.kick.damping * mass * mean * mean * self.kick.step;
                }
            }
            if self.strain {
                let u = self.u.at(first + e);
                sums[3] -= 0.5 * (0..3).map(|a| u[a] * force[a][e]).sum::<f64>();
            }
        }
    }
}
