//! Equilibrium of linear bonds: conjugate gradients with node blocks, some components held.

use nalgebra::Vector3;

use super::verlet::PointLoad;
use crate::operator::particles::ParticleModel;
use crate::operator::{BondList, Network, NodeField, StiffBond};
use crate::solver::{BlockJacobi, Ending, Look, SolverReport, Stopping, solve_bonds};
use crate::{Error, Result};

/// A load that is left over by more than this share of the largest is not balanced.
const UNBALANCED: f64 = 1e-4;

/// How many spheres a message lists.
const LISTED: usize = 8;

/// Components of a sphere that are held at given values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Support {
    /// The sphere.
    pub sphere: u32,
    /// Displacement (m), then rotation vector (radians); `None` is free.
    pub value: [Option<f64>; 6],
}

/// Bonds between spheres, and what acts on them.
#[derive(Clone, Debug)]
pub struct Resting<'a> {
    /// Centres of the spheres at the start (m).
    pub centres: &'a [Vector3<f64>],
    /// Their bonds.
    pub bonds: Vec<StiffBond>,
    /// What is held.
    pub supports: &'a [Support],
    /// What pulls.
    pub loads: &'a [PointLoad],
    /// Where the spheres are before; what is not joined to anything held stays there. `None`: at the start.
    pub from: Option<&'a SpheresAtRest>,
}

/// Spheres at rest.
#[derive(Clone, Debug)]
pub struct SpheresAtRest {
    /// Displacements (m), by sphere.
    pub displacement: Vec<Vector3<f64>>,
    /// Rotation vectors (radians), by sphere.
    pub rotation: Vec<Vector3<f64>>,
    /// Force (N) and moment (N·m) that supports add, by sphere; zero where nothing is held.
    pub reaction: Vec<[Vector3<f64>; 2]>,
    /// Energy of the bonds (J).
    pub energy: f64,
    /// How the solve ended.
    pub report: SolverReport,
}

/// Displacements and rotations of a model's bonds at small displacements under loads and supports; rotations are free
/// where nothing holds them. The model's kinematics and strengths are not looked at.
///
/// # Errors
/// Spheres that do not exist; parts without enough support to rest (named); what [`BondList::new`] refuses.
pub fn equilibrium(
    model: &ParticleModel,
    supports: &[Support],
    loads: &[PointLoad],
    stopping: &Stopping,
) -> Result<SpheresAtRest> {
    let (centres, bonds) = (model.packing.centres(), model.bonds.clone());
    Resting { centres, bonds, supports, loads, from: None }.equilibrium(stopping, &|_, _| true)
}

impl SpheresAtRest {
    /// Spheres that are somewhere: displacements (m) and rotation vectors (radians), nothing solved for.
    pub fn placed(displacement: Vec<Vector3<f64>>, rotation: Vec<Vector3<f64>>) -> Self {
        let reaction = vec![[Vector3::zeros(); 2]; displacement.len()];
        SpheresAtRest { displacement, rotation, reaction, energy: 0.0, report: SolverReport::begun(0) }
    }
}

impl Resting<'_> {
    /// Displacements and rotations at which the bonds bear the loads, seen at every iteration by whoever may end the solve.
    ///
    /// # Errors
    /// As [`equilibrium`], and [`Error::Interrupted`] where it was ended.
    pub fn equilibrium(self, stopping: &Stopping, look: Look) -> Result<SpheresAtRest> {
        let Resting { centres, bonds, supports, loads, from } = self;
        let n = centres.len();
        let spheres = supports.iter().map(|s| s.sphere).chain(loads.iter().map(|l| l.sphere));
        if let Some(missing) = spheres.into_iter().find(|&s| s as usize >= n) {
            return Err(Error::input(
                format!("sphere {} is held or loaded, but there are {n}", u64::from(missing) + 1),
                "use the spheres that exist",
            ));
        }
        let list = BondList::new(&Network { nodes: centres.to_vec(), bonds, volume: 1.0, nodal: None })?;
        let (mut held, mut given) = (vec![[false; 6]; n], list.zeros::<1>());
        for (sphere, (u, theta)) in
            from.iter().flat_map(|rest| rest.displacement.iter().zip(&rest.rotation)).enumerate()
        {
            given[list.place(sphere)] = std::array::from_fn(|i| [if i < 3 { u[i] } else { theta[i - 3] }]);
        }
        for support in supports {
            let place = list.place(support.sphere as usize);
            for (i, value) in support.value.iter().enumerate() {
                if let Some(value) = value {
                    held[place][i] = true;
                    given[place][i][0] = *value;
                }
            }
        }
        let mut b = list.zeros::<1>();
        list.apply(&given, &mut b);
        b.iter_mut().flatten().flatten().for_each(|b| *b = -*b);
        for load in loads {
            let b = &mut b[list.place(load.sphere as usize)];
            for i in 0..3 {
                b[i][0] += load.force[i];
                b[3 + i][0] += load.moment[i];
            }
        }
        let m = BlockJacobi::with_held(&list, &held);
        let (mut x, report) = solve_bonds(&list, &m, b.clone(), &[0.0], (stopping, look));
        if report.ending == Ending::Stopped {
            return Err(Error::Interrupted { message: "equilibrium was not found yet".into() });
        }
        if !report.converged() {
            // Given up before its time, the solve met a motion that costs no energy.
            let early = report.iterations < stopping.most_iterations;
            let said = if early { Error::mechanism } else { Error::not_converged };
            return Err(said(
                format!(
                    "equilibrium was not reached in {} iterations (relative residual {:.1e})",
                    report.iterations, report.residual
                ),
                "hold every part of the body so that it cannot move freely, or allow more iterations",
            ));
        }
        refuse_loose(&list, &x, &b, &held)?;
        for (x, g) in x.iter_mut().zip(&given) {
            (0..6).for_each(|i| x[i][0] += g[i][0]);
        }
        Ok(collected(&list, &x, &held, loads, report))
    }
}

/// A load along a free motion is not balanced, whatever conjugate gradients say of the rest: its spheres are named.
fn refuse_loose(list: &BondList, x: &[NodeField<1>], b: &[NodeField<1>], held: &[[bool; 6]]) -> Result<()> {
    let mut k = list.zeros::<1>();
    list.apply(x, &mut k);
    let largest = |first: usize| {
        let free = (0..b.len()).flat_map(|n| (first..first + 3).map(move |i| (n, i))).filter(|&(n, i)| !held[n][i]);
        free.map(|(n, i)| b[n][i][0].abs().max(k[n][i][0].abs())).fold(f64::MIN_POSITIVE, f64::max)
    };
    let scale = [largest(0), largest(3).max(largest(0) * 1e-3)];
    let off = |place: usize| {
        (0..6).any(|i| !held[place][i] && (b[place][i][0] - k[place][i][0]).abs() > UNBALANCED * scale[i / 3])
    };
    let loose: Vec<usize> = (0..list.nodes()).filter(|&sphere| off(list.place(sphere))).collect();
    if loose.is_empty() {
        return Ok(());
    }
    let names: Vec<String> = loose.iter().take(LISTED).map(|i| (i + 1).to_string()).collect();
    Err(Error::mechanism(
        format!(
            "nothing holds {} spheres against their loads: number {}{}",
            loose.len(),
            names.join(", "),
            if loose.len() > LISTED { ", …" } else { "" }
        ),
        "hold them, load other spheres, or give a larger contact radius",
    ))
}

/// Fields by sphere, reactions and energy of a solution.
fn collected(
    list: &BondList,
    x: &[NodeField<1>],
    held: &[[bool; 6]],
    loads: &[PointLoad],
    report: SolverReport,
) -> SpheresAtRest {
    let mut gradient = list.zeros::<1>();
    list.apply(x, &mut gradient);
    let energy = 0.5 * x.iter().flatten().zip(gradient.iter().flatten()).map(|(x, g)| x[0] * g[0]).sum::<f64>();
    let part = |f: &NodeField<1>, first: usize| Vector3::from_fn(|i, _| f[first + i][0]);
    let by_sphere = |first: usize| (0..list.nodes()).map(|s| part(&x[list.place(s)], first)).collect();
    let mut reaction: Vec<[Vector3<f64>; 2]> =
        (0..list.nodes()).map(|s| [part(&gradient[list.place(s)], 0), part(&gradient[list.place(s)], 3)]).collect();
    for load in loads {
        reaction[load.sphere as usize][0] -= load.force;
        reaction[load.sphere as usize][1] -= load.moment;
    }
    for (sphere, reaction) in reaction.iter_mut().enumerate() {
        let held = &held[list.place(sphere)];
        for i in (0..6).filter(|&i| !held[i]) {
            reaction[i / 3][i % 3] = 0.0;
        }
    }
    SpheresAtRest { displacement: by_sphere(0), rotation: by_sphere(3), reaction, energy, report }
}
