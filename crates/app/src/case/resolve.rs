//! From a case file to nodes.

use std::collections::HashMap;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::CaseFile;
use super::loads::{ConditionStatement, Load, Place, Where};
use super::matter::{Matter, RegionStatement, axis_name};
use super::parts::{Parts, Sites};
use super::plan::memory;
use super::schedule::Target;
use super::select::select;
use super::surface_loads::{self, Traction};
use anisobond::Result;
use anisobond::experiment::{
    Condition, Crack, FractureEnergy, Probe, Problem, RegionMaterial, Schedule, refuse_beyond_memory,
};
use anisobond::lattice::solid::{self, Patch, Surface};
use anisobond::lattice::{Body, Neighbourhood};

/// A body, and what its regions came from.
pub(super) struct Filled {
    pub body: Body,
    pub materials: Vec<RegionMaterial>,
    /// Per region of the file, the numbers of its regions in the body.
    pub ranges: Vec<std::ops::Range<usize>>,
}

/// The problem of a case.
pub(super) fn problem(case: &CaseFile) -> Result<Problem> {
    let mut filled = filled(case)?;
    if let Some(critical) = case.model.critical {
        // The law says when bonds yield: nothing else may (`unused`).
        let stiff = filled.materials.iter_mut().filter(|m| m.stiffness.norm() > 0.0);
        stiff.for_each(|m| m.fracture = Some(FractureEnergy::Stretch(critical)));
    }
    let neighbourhood = &case.grid_statement()?.neighbourhood;
    let nodes: Vec<Vec<u32>> = case.conditions.iter().map(|c| select(case, &filled, &c.on)).collect::<Result<_>>()?;
    refuse_contradictions(case, &nodes)?;
    let conditions =
        case.conditions.iter().zip(&nodes).map(|(c, n)| condition(case, &filled, c, n)).collect::<Result<Vec<_>>>()?;
    let velocity = |(on, v): &(Where, Vector3<f64>)| Ok((select(case, &filled, on)?, *v));
    let probe_nodes = |target: &Target| match target {
        Target::Nodes(on) => select(case, &filled, on),
        Target::Condition(n) => Ok(nodes[*n].clone()),
    };
    let probes = case
        .probes
        .iter()
        .map(|p| Ok(Probe { name: p.name.clone(), quantity: p.quantity, nodes: probe_nodes(&p.target)? }));
    let probes = probes.collect::<Result<_>>()?;
    let mut unbreakable = Vec::new();
    for on in &case.unbreakable {
        unbreakable.extend(select(case, &filled, on)?);
    }
    unbreakable.sort_unstable();
    unbreakable.dedup();
    for (spot, crack) in &case.cracks {
        if !cuts_any(crack, &filled.body, neighbourhood) {
            return Err(
                spot.wrong("the crack cuts no bond", "check its place and size: lengths are of the grid's axes")
            );
        }
    }
    Ok(Problem {
        name: case.name.clone(),
        neighbourhood: neighbourhood.clone(),
        model: case.model.bonds,
        metric: case.model.metric,
        surface_calibration: case.model.surface_calibration,
        kinematics: case.model.kinematics,
        law: case.model.law.clone(),
        initial_velocity: case.velocities.iter().map(velocity).collect::<Result<_>>()?,
        cracks: case.cracks.iter().map(|c| c.1.clone()).collect(),
        schedule: case.schedule.clone(),
        output: case.output.clone(),
        body: filled.body,
        regions: filled.materials,
        conditions,
        unbreakable,
        probes,
    })
}

/// The body with its regions.
fn filled(case: &CaseFile) -> Result<Filled> {
    let grid = case.grid_around_body()?;
    let statement = case.grid_statement()?;
    let what = format!("a run on {} × {} × {} nodes", grid.nodes[0], grid.nodes[1], grid.nodes[2]);
    let needed = memory(&grid, &statement.neighbourhood) as f64;
    refuse_beyond_memory(&what, needed).map_err(|e| statement.spot.at(e))?;
    let (spot, shape) = case.body_statement()?;
    let inside = solid::inside(shape, &grid);
    if !inside.contains(&true) {
        return Err(spot.wrong("the body holds no node", "use a smaller spacing, or check its solids and units"));
    }
    let mut body = Body { region: inside.into_iter().map(u16::from).collect(), grid };
    let statements = &case.regions;
    let parts = Parts::new(statements)?;
    let region = {
        let period = |a: usize| body.grid.periodic[a].then(|| body.grid.nodes[a] as f64 * body.grid.spacing);
        let sites = Sites {
            called: "nodes",
            number: body.region.len(),
            has: &|i| body.has(i),
            inside: &|shape| solid::inside(shape, &body.grid),
            position: &|i| body.grid.position(i),
            spacing: body.grid.spacing,
            period: [0, 1, 2].map(period),
            bottom: None,
        };
        parts.assigned(statements, &sites)?
    };
    body.region = region;
    let Parts { parts, ranges } = parts;
    let material = |(part, (name, matter)): (usize, (String, Matter))| {
        let statement = ranges.iter().position(|range| range.contains(&part)).unwrap_or(0);
        region_material(case, &statements[statement], name, &matter)
    };
    let materials = parts.into_iter().enumerate().map(material).collect::<Result<Vec<_>>>()?;
    Ok(Filled { body, materials, ranges })
}

fn region_material(
    case: &CaseFile,
    statement: &RegionStatement,
    name: String,
    matter: &Matter,
) -> Result<RegionMaterial> {
    let weighs = |c: &ConditionStatement| matches!(c.load, Load::Acceleration(_));
    let needs = match case.schedule {
        Schedule::Motion { .. } => Some("motion"),
        Schedule::Equilibrium { .. } if case.conditions.iter().any(weighs) => Some("an acceleration"),
        Schedule::Equilibrium { .. } => None,
    };
    if let (Some(what), None) = (needs, matter.density) {
        let problem = format!("region {:?} has no density, which {what} needs", statement.name);
        return Err(statement.spot.wrong(problem, "add density = \"2440 kg/m3\" to it or to its material"));
    }
    Ok(RegionMaterial {
        name,
        stiffness: matter.turned_stiffness(),
        density: matter.density.unwrap_or(0.0),
        fracture: matter.turned_fracture(),
    })
}

/// Refuses two conditions that prescribe the same component of a node, unless they say the same.
pub(super) fn refuse_contradictions(case: &CaseFile, nodes: &[Vec<u32>]) -> Result<()> {
    let mut owner: HashMap<(u32, usize), usize> = HashMap::new();
    for (n, condition) in case.conditions.iter().enumerate() {
        let Some(value) = prescribed(condition) else { continue };
        for &node in &nodes[n] {
            for a in (0..3).filter(|&a| value[a].is_some()) {
                let first = *owner.entry((node, a)).or_insert(n);
                if first != n && !agree(&case.conditions[first], condition, a) {
                    let (first, axis) = (&case.conditions[first].name, axis_name(a));
                    return Err(condition.spot.wrong(
                        format!(
                            "conditions {first:?} and {:?} both prescribe {axis} of the same nodes",
                            condition.name
                        ),
                        "let one of them be \"free\" there, or choose other nodes",
                    ));
                }
            }
        }
    }
    Ok(())
}

fn prescribed(condition: &ConditionStatement) -> Option<[Option<f64>; 3]> {
    match condition.load {
        Load::Displacement(value) | Load::Velocity(value) => Some(value),
        _ => None,
    }
}

/// Whether two conditions prescribe the same for a component.
fn agree(a: &ConditionStatement, b: &ConditionStatement, axis: usize) -> bool {
    let same_kind = std::mem::discriminant(&a.load) == std::mem::discriminant(&b.load);
    let (x, y) = (prescribed(a).and_then(|v| v[axis]), prescribed(b).and_then(|v| v[axis]));
    same_kind && x == y && (x == Some(0.0) || a.history == b.history)
}

fn condition(case: &CaseFile, filled: &Filled, c: &ConditionStatement, nodes: &[u32]) -> Result<Condition> {
    let body = &filled.body;
    let volume = body.grid.spacing.powi(3);
    let (nodes, history) = (nodes.to_vec(), c.history.clone());
    let density = |node: u32| filled.materials[usize::from(body.region[node as usize]) - 1].density;
    let force: Vec<Vector3<f64>> = match c.load {
        Load::Displacement(value) => return Ok(Condition::Displacement { nodes, value, history }),
        Load::Velocity(value) => return Ok(Condition::Velocity { nodes, value, history }),
        Load::BodyForce(f) => vec![f * volume; nodes.len()],
        Load::Acceleration(a) => nodes.iter().map(|&n| a * (density(n) * volume)).collect(),
        Load::Force(total) => vec![total / nodes.len() as f64; nodes.len()],
        Load::Traction(t) => return surface_force(case, body, c, Traction::Vector(t)),
        Load::Pressure(p) => return surface_force(case, body, c, Traction::Pressure(p)),
    };
    Ok(Condition::Force { nodes, force, history })
}

/// Forces of a traction: on a face, exactly traction × area of the columns of nodes; on a solid, of its true surface.
fn surface_force(case: &CaseFile, body: &Body, c: &ConditionStatement, traction: Traction) -> Result<Condition> {
    let surface = match &c.on.place {
        Place::Solid(shape) => solid::surface_patches(body, &case.body_statement()?.1, shape),
        Place::Face(face, thickness) => {
            let patches = solid::face_layer(body, *face, thickness.metres(body.grid.spacing));
            let area: f64 = patches.iter().map(|p| p.area).sum();
            let place = |p: &Patch| body.grid.position(p.node as usize) * p.area;
            let moment: Vector3<f64> = patches.iter().map(place).sum();
            let normal = face.normal();
            Surface { normal: normal * area, moment, turning: moment.cross(&normal), patches }
        }
        Place::All | Place::Region(_) | Place::Points(_) => Surface::default(),
    };
    if surface.patches.is_empty() {
        return Err(c.on.spot.wrong(
            "no node of the body is at that surface",
            "name the solid whose surface is a surface of the body, as a hole that was cut out",
        ));
    }
    let place = |n: u32| body.grid.position(n as usize);
    Ok(surface_loads::condition(&surface, place, body.grid.periodic, traction, c.history.clone()))
}

/// Whether a crack passes through any bond.
fn cuts_any(crack: &Crack, body: &Body, neighbourhood: &Neighbourhood) -> bool {
    let bonds = neighbourhood.bonds();
    let reach = bonds.iter().map(|b| b.xi.norm()).fold(0.0, f64::max);
    let tolerance = Crack::TIE * body.grid.spacing;
    let (origin, normal) = crack.plane();
    let cut = |n: usize| {
        let x = body.grid.position(n);
        let near = body.has(n) && normal.dot(&(x - origin)).abs() <= reach + tolerance;
        let exists = |o: [i32; 3]| body.grid.neighbour(n, o).is_some_and(|m| body.has(m));
        near && bonds.iter().any(|b| crack.cuts(&x, &(x + b.xi), tolerance) && exists(b.offset))
    };
    (0..body.region.len()).into_par_iter().any(cut)
}
