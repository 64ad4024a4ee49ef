//! From a case file to spheres.

use nalgebra::Vector3;

use super::body::{Spheres, packing, spheres, study};
use super::select::{select, surface};
use super::{ContactStatement, PackingStatement};
use crate::case::CaseFile;
use crate::case::loads::{ConditionStatement, Load, Where};
use crate::case::matter::Matter;
use crate::case::parts::Parts;
use crate::case::resolve::refuse_contradictions;
use crate::case::schedule::Target;
use crate::case::surface_loads::{self, Traction};
use anisobond::Result;
use anisobond::calibration::Model;
use anisobond::experiment::element_test::ElementTest;
use anisobond::experiment::{Condition, Crack, PackingProblem, Probe, Schedule};
use anisobond::operator::particles::{ContactLaw, ParticleModel, Strength};
use anisobond::tensor::Stiffness;

/// k_t/k_n of contacts unless the case says otherwise.
const USUAL_RATIO: f64 = 0.5;

/// The problem on the packing of a case.
pub(super) fn problem(case: &CaseFile) -> Result<PackingProblem> {
    let p = statement(case)?;
    let parts = Parts::new(&case.regions)?;
    let density = parts.parts.iter().map(|(_, matter)| density(case, matter)).collect::<Result<Vec<f64>>>()?;
    let body = spheres(case, p, &parts)?;
    let nodes: Vec<Vec<u32>> = case.conditions.iter().map(|c| select(case, &body, &c.on)).collect::<Result<_>>()?;
    refuse_contradictions(case, &nodes)?;
    let mass: Vec<f64> = body.volumes.iter().zip(&body.region).map(|(v, &r)| v * density[usize::from(r)]).collect();
    let conditions = case.conditions.iter().zip(&nodes).map(|(c, n)| condition(&body, &mass, c, n));
    let conditions = conditions.collect::<Result<Vec<_>>>()?;
    let velocity = |(on, v): &(Where, Vector3<f64>)| Ok((select(case, &body, on)?, *v));
    let probe_nodes = |target: &Target| match target {
        Target::Nodes(on) => select(case, &body, on),
        Target::Condition(n) => Ok(nodes[*n].clone()),
    };
    let probe = |p: &crate::case::schedule::ProbeStatement| {
        Ok(Probe { name: p.name.clone(), quantity: p.quantity, nodes: probe_nodes(&p.target)? })
    };
    let probes = case.probes.iter().map(probe).collect::<Result<_>>()?;
    let initial_velocity = case.velocities.iter().map(velocity).collect::<Result<_>>()?;
    if let (Some((spot, _)), false) = (&p.servo, p.periodic == [true; 3]) {
        return Err(spot.wrong("a servo drives a packing that is periodic along all axes", "leave [body] out"));
    }
    let body = cracked(case, body)?;
    let model = model(case, p, &body, mass)?;
    Ok(PackingProblem {
        name: case.name.clone(),
        model,
        volumes: body.volumes,
        region: body.region,
        origin: body.origin,
        periodic: body.periodic,
        rotations: p.rotations,
        conditions,
        initial_velocity,
        schedule: case.schedule.clone(),
        servo: p.servo.as_ref().map(|s| s.1.clone()),
        probes,
        output: case.output.clone(),
        evidence: body.evidence,
    })
}

/// What an element test measures on the case's periodic packing.
pub(super) fn measured(case: &CaseFile) -> Result<Stiffness> {
    let p = statement(case)?;
    let parts = Parts::new(&case.regions)?;
    let [(_, matter)] = &parts.parts[..] else {
        let spot = &case.regions[case.regions.len() - 1].spot;
        return Err(spot.wrong(
            "several materials have no one stiffness that could be measured",
            "leave one region of one material",
        ));
    };
    let study = study(packing(p)?, p, &matter.turned_stiffness())?;
    let test = ElementTest { rotations: p.rotations, ..ElementTest::default() };
    Ok(test.run(&study.network())?.measured)
}

fn statement(case: &CaseFile) -> Result<&PackingStatement> {
    let example = "add [packing] with file and contact_radius";
    case.packing.as_ref().ok_or_else(|| case.top.wrong("the case has no packing", example))
}

fn density(case: &CaseFile, matter: &Matter) -> Result<f64> {
    let weighs = |c: &ConditionStatement| matches!(c.load, Load::Acceleration(_));
    let needs = match case.schedule {
        Schedule::Motion { .. } => Some("motion"),
        Schedule::Equilibrium { .. } if case.conditions.iter().any(weighs) => Some("an acceleration"),
        Schedule::Equilibrium { .. } => None,
    };
    match (matter.density, needs) {
        (Some(density), _) => Ok(density),
        // Nothing weighs: any mass will do.
        (None, None) => Ok(1.0),
        (None, Some(what)) => Err(case.top.wrong(
            format!("the material has no density, which {what} needs"),
            "add density = \"2650 kg/m3\": that of the rock, pores included",
        )),
    }
}

/// Spheres, bonds, strength and contact.
fn model(case: &CaseFile, p: &PackingStatement, body: &Spheres, mass: Vec<f64>) -> Result<ParticleModel> {
    let radii = body.packing.radii();
    let mut strength = p.strength.map(|s| {
        let of = |bond: &anisobond::operator::StiffBond| {
            let smaller = radii[bond.a as usize].min(radii[bond.b as usize]);
            Strength::of_stresses(s.tension, s.cohesion, s.friction_angle, smaller)
        };
        body.bonds.iter().map(of).collect::<Vec<_>>()
    });
    if let Some(strength) = &mut strength {
        let mut whole = vec![false; radii.len()];
        for on in &case.unbreakable {
            select(case, body, on)?.iter().for_each(|&s| whole[s as usize] = true);
        }
        for (bond, strength) in body.bonds.iter().zip(strength.iter_mut()) {
            if whole[bond.a as usize] || whole[bond.b as usize] {
                *strength = Strength::UNBREAKABLE;
            }
        }
    }
    let contact = p.contact.map(|c| contact_law(&c, p, body));
    Ok(ParticleModel {
        packing: body.packing.clone(),
        bonds: body.bonds.clone(),
        mass,
        kinematics: case.model.kinematics,
        strength,
        law: case.model.law.clone(),
        contact,
    })
}

/// Contacts as stiff as bonds are on average, E = k_n ℓ/π r², unless the case says otherwise.
fn contact_law(c: &ContactStatement, p: &PackingStatement, body: &Spheres) -> ContactLaw {
    let radii = body.packing.radii();
    let modulus = |bond: &anisobond::operator::StiffBond| {
        let smaller = radii[bond.a as usize].min(radii[bond.b as usize]);
        bond.normal * bond.branch.norm() / (std::f64::consts::PI * smaller * smaller)
    };
    let mean = body.bonds.iter().map(modulus).sum::<f64>() / body.bonds.len().max(1) as f64;
    let usual = if p.bonds == Model::Central { 0.0 } else { USUAL_RATIO };
    ContactLaw {
        modulus: c.modulus.unwrap_or(mean),
        tangential_ratio: c.tangential_ratio.unwrap_or(usual),
        friction: c.friction,
    }
}

/// The body without the bonds that pass through cracks.
fn cracked(case: &CaseFile, mut body: Spheres) -> Result<Spheres> {
    let tolerance = Crack::TIE * body.packing.radii().iter().copied().fold(f64::INFINITY, f64::min);
    for (spot, crack) in &case.cracks {
        let before = body.bonds.len();
        let position = |s: u32| body.packing.centres()[s as usize] + body.origin;
        let whole = |bond: &anisobond::operator::StiffBond| {
            let from = position(bond.a);
            !crack.cuts(&from, &(from + bond.branch), tolerance)
        };
        let kept: Vec<_> = body.bonds.iter().filter(|bond| whole(bond)).copied().collect();
        if kept.len() == before {
            return Err(spot.wrong("the crack cuts no bond", "check its place and size"));
        }
        body.bonds = kept;
    }
    Ok(body)
}

fn condition(body: &Spheres, mass: &[f64], c: &ConditionStatement, nodes: &[u32]) -> Result<Condition> {
    let (nodes, history) = (nodes.to_vec(), c.history.clone());
    let force: Vec<Vector3<f64>> = match c.load {
        Load::Displacement(value) => return Ok(Condition::Displacement { nodes, value, history }),
        Load::Velocity(value) => return Ok(Condition::Velocity { nodes, value, history }),
        Load::BodyForce(f) => nodes.iter().map(|&s| f * body.volumes[s as usize]).collect(),
        Load::Acceleration(a) => nodes.iter().map(|&s| a * mass[s as usize]).collect(),
        Load::Force(total) => vec![total / nodes.len() as f64; nodes.len()],
        Load::Traction(t) => return on_surface(body, c, Traction::Vector(t)),
        Load::Pressure(p) => return on_surface(body, c, Traction::Pressure(p)),
    };
    Ok(Condition::Force { nodes, force, history })
}

/// Forces of a traction.
fn on_surface(body: &Spheres, c: &ConditionStatement, traction: Traction) -> Result<Condition> {
    let place = |s: u32| body.packing.centres()[s as usize];
    Ok(surface_loads::condition(&surface(body, &c.on)?, place, body.periodic, traction, c.history.clone()))
}
