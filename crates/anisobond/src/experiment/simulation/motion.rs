//! Motion: one step of velocity Verlet, with the energies that it moves.

use nalgebra::Vector3;

use super::loading::{Factors, Loading};
use super::reactions::Reactions;
use crate::Result;
use crate::experiment::problem::Problem;
use crate::operator::grid::{FailingBonds, Failure, Padded};
use crate::operator::{Kinematics, VectorField};
use crate::solver::Kick;

/// Velocities and what they need.
pub(super) struct Motion {
    /// Velocities half a step ahead of the displacements (m/s).
    pub(super) velocity: VectorField,
    /// Velocities half a step behind, of the last pass (m/s).
    behind: VectorField,
    /// 1/m (1/kg) by region, that of empty nodes 0.
    per_mass: Vec<f64>,
    /// Time step (s).
    pub(super) step: f64,
    /// Viscous α (1/s) and local damping λ (–).
    damping: [f64; 2],
}

/// What one pass over the body moves.
///
/// With v₋ and v₊ half a step before and after displacements u, ½ m v₋·v₊ + ½ u·Ku changes over a step Δu = h v₊ by
/// exactly ½ Δu·(F + F') of the forces F, F' at its ends that are not the bonds': the mean of both on the way. So energies
/// of linear bonds balance to rounding at any step, also while bonds break (`operator::grid::failing`).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pass {
    /// Kinetic energy ½ Σ m v₋·v₊ at the moment of the displacements (J).
    pub(super) kinetic: f64,
    /// Work ½ h F·v₋ of forces and held nodes (J): the end of the step before.
    pub(super) external: f64,
    /// Work ½ h F·v₊ of the same (J): the begin of the step that follows.
    pub(super) external_ahead: f64,
    /// Lost to damping (J), at the end of the step before.
    pub(super) damping: f64,
    /// Lost to damping (J), at the begin of the step that follows.
    pub(super) damping_ahead: f64,
    /// −½ Σ u·f: the strain energy (J) of linear bonds; only where it was asked for.
    pub(super) strain: f64,
    /// Bonds that failed.
    pub(super) failure: Failure,
    /// The largest ‖E‖ of a nodal term (–) at finite stretch.
    pub(super) nodal_strain: f64,
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
}

/// Sums of a row: external work behind and ahead, damping loss behind and ahead, kinetic energy, −½ Σ u·f.
type RowSums = [f64; 6];

impl Motion {
    pub(super) fn new(problem: &Problem, velocity: VectorField, step: f64, damping: [f64; 2]) -> Self {
        let volume = problem.body.grid.spacing.powi(3);
        let per_mass = std::iter::once(0.0).chain(problem.regions.iter().map(|r| 1.0 / (r.density * volume))).collect();
        Motion { behind: velocity.clone(), velocity, per_mass, step, damping }
    }

    /// Advance displacements: u += Δt v.
    pub(super) fn drift(&self, u: &mut Padded<f64>) {
        let [x, y, z] = &self.velocity.components;
        u.drift([x, y, z], self.step);
    }

    /// Advance velocities by the forces at time t over `span` (s): Δt, or Δt/2 for the first kick, before which nothing moved.
    /// The forces on the nodes of reaction probes are noted.
    #[allow(clippy::too_many_arguments)] // all of them are parts of one simulation
    pub(super) fn kick(
        &mut self,
        problem: &Problem,
        loading: &Loading,
        bonds: &mut FailingBonds,
        u: &Padded<f64>,
        (t, span): (f64, f64),
        measured: bool,
        reactions: &mut Reactions,
    ) -> Result<Pass> {
        let n = problem.body.grid.nodes[0];
        let kinematics = problem.kinematics;
        std::mem::swap(&mut self.velocity, &mut self.behind);
        let behind = &self.behind;
        let way_behind = (span == self.step).then_some((behind, self.step));
        let mut failure = bonds.follow(u, kinematics, way_behind, 0.0)?;
        let row = RowKick {
            loading,
            kick: Kick { step: span, damping: self.damping[0], local: self.damping[1] },
            per_mass: &self.per_mass,
            step: self.step,
            u,
            now: loading.at(t),
            velocities: loading.at(t + 0.5 * self.step),
            displacements: loading.at(t + self.step),
            strain: measured && kinematics == Kinematics::Linear,
        };
        let region = &problem.body.region;
        let visit = |number: usize, force: [&[f64]; 3], velocity: [&mut [f64]; 3]| {
            let nodes = number * n..(number + 1) * n;
            let [x, y, z] = &behind.components;
            let behind = [x, y, z].map(|v| &v[nodes.clone()]);
            let of_node = |&node: &u32| Vector3::from(force.map(|f| f[node as usize - nodes.start]));
            let held: Vec<Vector3<f64>> = reactions.within(nodes.clone()).iter().map(of_node).collect();
            (row.advance(number, &region[nodes], force, behind, velocity), held)
        };
        let [x, y, z] = &mut self.velocity.components;
        let (found, rows) = bonds.sweep(u, kinematics, [x, y, z], visit)?;
        let nodal_strain = bonds.grid().largest_nodal_strain();
        failure += bonds.break_off(found, u, kinematics, way_behind, Some((&self.velocity, self.step)));
        let [external, external_ahead, damping, damping_ahead, kinetic, strain] =
            rows.iter().fold([0.0; 6], |sum, (row, _)| std::array::from_fn(|i| sum[i] + row[i]));
        let strain = if row.strain { strain - bonds.energy_of_rest(u) } else { strain };
        reactions.note(rows.into_iter().flat_map(|(_, held)| held));
        Ok(Pass { kinetic, external, external_ahead, damping, damping_ahead, strain, failure, nodal_strain })
    }
}

/// Forces of bonds and loads (N) on a row's nodes along an axis.
fn acting(force: &[f64], loaded: &[Loaded], axis: usize) -> Vec<f64> {
    let mut all = force.to_vec();
    loaded.iter().for_each(|load| all[load.element] += load.force[axis]);
    all
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
    /// Velocities of a row, from those half a step behind.
    fn advance(
        &self,
        row: usize,
        region: &[u16],
        force: [&[f64]; 3],
        before: [&[f64]; 3],
        mut velocity: [&mut [f64]; 3],
    ) -> RowSums {
        let first = row * region.len();
        let loaded: Vec<Loaded> =
            self.loading.forces(row, &self.now).map(|(node, force)| Loaded { element: node - first, force }).collect();
        let held = self.held(row, first, &before);
        velocity.iter_mut().zip(before).for_each(|(velocity, before)| velocity.copy_from_slice(before));
        for (velocity, force) in velocity.iter_mut().zip(force) {
            self.kick.apply(velocity, force, region.iter().map(|&r| self.per_mass[usize::from(r)]));
        }
        for load in &loaded {
            let per_mass = self.per_mass[usize::from(region[load.element])];
            for (velocity, force) in velocity.iter_mut().zip(load.force.iter()) {
                velocity[load.element] += self.kick.push(*force, per_mass);
            }
        }
        let damped = (self.kick.local > 0.0).then(|| [0, 1, 2].map(|axis| acting(force[axis], &loaded, axis)));
        if let Some(acting) = &damped {
            self.drag(region, acting, before, &mut velocity);
        }
        held.iter().for_each(|h| velocity[h.axis][h.element] = h.after);

        let mut sums = [0.0; 6];
        let mut work = |element: usize, axis: usize, force: f64| {
            let (behind, ahead) = self.around(before[axis][element], velocity[axis][element]);
            sums[0] += 0.5 * self.step * force * behind;
            sums[1] += 0.5 * self.step * force * ahead;
        };
        for load in &loaded {
            (0..3).for_each(|a| work(load.element, a, load.force[a]));
        }
        for h in &held {
            work(h.element, h.axis, self.reaction(h, region, force, &loaded));
        }
        self.add_energies(&mut sums, first, region, force, before, &velocity);
        if let Some(acting) = &damped {
            self.add_drag(&mut sums, region, acting, &held, before, &velocity);
        }
        sums
    }

    /// Slow the velocities of a row by local damping.
    fn drag(&self, region: &[u16], acting: &[Vec<f64>; 3], before: [&[f64]; 3], velocity: &mut [&mut [f64]; 3]) {
        let first = self.kick.step != self.step;
        for axis in 0..3 {
            for (e, &r) in region.iter().enumerate().filter(|(_, r)| **r > 0) {
                let per_mass = self.per_mass[usize::from(r)];
                let drag = self.kick.drag(first, before[axis][e], acting[axis][e], 1.0 / per_mass);
                velocity[axis][e] -= self.kick.push(drag, per_mass);
            }
        }
    }

    /// Loss to local damping: the force that free components lack for their change of velocity.
    fn add_drag(
        &self,
        sums: &mut RowSums,
        region: &[u16],
        acting: &[Vec<f64>; 3],
        held: &[Held],
        before: [&[f64]; 3],
        velocity: &[&mut [f64]; 3],
    ) {
        let (keep, push) = self.kick.factors();
        for axis in 0..3 {
            for (e, &r) in region.iter().enumerate().filter(|(_, r)| **r > 0) {
                if held.iter().any(|h| h.axis == axis && h.element == e) {
                    continue;
                }
                let mass = 1.0 / self.per_mass[usize::from(r)];
                let drag = acting[axis][e] - mass * (velocity[axis][e] - keep * before[axis][e]) / push;
                let (behind, ahead) = self.around(before[axis][e], velocity[axis][e]);
                sums[2] += 0.5 * self.step * drag * behind;
                sums[3] += 0.5 * self.step * drag * ahead;
            }
        }
    }

    /// Velocities half a step before and after. The first kick is from the start: v₋ is what leads to v₊ through it.
    fn around(&self, before: f64, after: f64) -> (f64, f64) {
        let whole = self.kick.step == self.step;
        (if whole { before } else { 2.0 * before - after }, after)
    }

    /// Prescribed components of a row: the velocity that brings a displacement to where it is to be after the step, or
    /// the one prescribed half a step ahead.
    fn held(&self, row: usize, first: usize, before: &[&[f64]; 3]) -> Vec<Held> {
        let rows =
            self.loading.prescribed(row, &self.velocities).zip(self.loading.prescribed(row, &self.displacements));
        rows.map(|((entry, speed), (_, place))| {
            let (node, axis) = (entry.node as usize, usize::from(entry.axis));
            let to_place = || (place - self.u.at(node)[axis]) / self.step;
            let after = if entry.velocity { speed } else { to_place() };
            Held { element: node - first, axis, before: before[axis][node - first], after }
        })
        .collect()
    }

    /// Force (N) that holds a component: m (v₊ − v₋)/h + α m v̄ − f, the loads' part taken off.
    fn reaction(&self, h: &Held, region: &[u16], force: [&[f64]; 3], loaded: &[Loaded]) -> f64 {
        let mass = 1.0 / self.per_mass[usize::from(region[h.element])];
        let load: f64 = loaded.iter().filter(|l| l.element == h.element).map(|l| l.force[h.axis]).sum();
        let inertia = mass * (h.after - h.before) / self.kick.step;
        inertia + self.kick.damping * mass * 0.5 * (h.before + h.after) - force[h.axis][h.element] - load
    }

    /// Kinetic energy, loss to damping, and strain energy where it is asked for.
    fn add_energies(
        &self,
        sums: &mut RowSums,
        first: usize,
        region: &[u16],
        force: [&[f64]; 3],
        before: [&[f64]; 3],
        velocity: &[&mut [f64]; 3],
    ) {
        for (e, &r) in region.iter().enumerate().filter(|(_, r)| **r > 0) {
            let mass = 1.0 / self.per_mass[usize::from(r)];
            for a in 0..3 {
                let (behind, ahead) = self.around(before[a][e], velocity[a][e]);
                sums[4] += 0.5 * mass * behind * ahead;
                // −½ h F·v of the damping force F = −α m v̄.
                let drag = 0.25 * self.step * self.kick.damping * mass * (before[a][e] + velocity[a][e]);
                sums[2] += drag * behind;
                sums[3] += drag * ahead;
            }
            if self.strain {
                let u = self.u.at(first + e);
                sums[5] -= 0.5 * (0..3).map(|a| u[a] * force[a][e]).sum::<f64>();
            }
        }
    }
}
