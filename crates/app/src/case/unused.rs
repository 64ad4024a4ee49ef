//! Keys that do nothing on the lattice that a case runs on, or beside what else it says: refused, unless they are meant for
//! the other lattice that the file states.

use super::section::{Section, Value};
use super::{LatticeKind, Result};

/// Keys of grids, and why packings do not take them.
const OF_GRIDS: [(&str, &str); 4] = [
    ("model.metric", "bonds of a packing are calibrated by the norm"),
    ("model.bonds", "packing.bonds says which bonds a packing has"),
    ("model.surface_calibration", "surfaces of packings are not calibrated"),
    ("fracture", "bonds of a packing do not break by a fracture energy but by [strength]"),
];

/// Keys of packings, and why grids do not take them.
const OF_PACKINGS: [(&str, &str); 3] = [
    ("strength", "bonds of a grid break by a fracture energy"),
    ("contact", "nodes of a grid have no contacts"),
    ("servo", "a servo drives the periodic cell of a packing"),
];

/// The key of `case.json` under which stands what was not used.
pub const NOT_USED: &str = "not used";

/// A key that the case's lattice does not use.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Unused {
    /// Dotted, numbers of lists among it.
    pub path: String,
    pub why: &'static str,
}

/// The keys that are of the other lattice, `both` that the file states that one too.
///
/// # Errors
/// Such a key where it does not; and any other key that does nothing.
pub(super) fn unused(root: &Section, lattice: LatticeKind, both: bool) -> Result<Vec<Unused>> {
    let (keys, section): (&[_], _) = match lattice {
        LatticeKind::Packing => (&OF_GRIDS, "grid"),
        LatticeKind::Grid => (&OF_PACKINGS, "packing"),
    };
    let mut found: Vec<(Value, &'static str)> = Vec::new();
    for (path, why) in keys {
        found.extend(at(root, path)?.map(|value| (value, *why)));
    }
    if lattice == LatticeKind::Packing {
        for region in root.tables("region")? {
            found.extend(region.table(&["fracture"])?.get("fracture").map(|value| (value, OF_GRIDS[3].1)));
        }
    }
    found.extend(of_breaking(root, lattice, both)?);
    if let Some((value, why)) = found.iter().find(|_| !both) {
        let (own, other) = match lattice {
            LatticeKind::Packing => ("packing", "grid"),
            LatticeKind::Grid => ("grid", "packing"),
        };
        return Err(value.wrong(
            format!("{} does nothing on a {own}: {why}", value.path),
            format!("leave it out, or add [{other}] (and lattice = \"{own}\") if it is meant for that"),
        ));
    }
    idle(root, lattice)?;
    let mut all: Vec<Unused> = found.into_iter().map(|(value, why)| Unused { path: value.path, why }).collect();
    all.extend(root.get(section).map(|value| Unused { path: value.path, why: "" }));
    Ok(all)
}

/// Keys about bonds that fail where none can, for a file that states `both` lattices; the other may need them.
///
/// # Errors
/// Such a key where it does not; a stretch beside what says when bonds fail.
fn of_breaking<'n>(root: &Section<'n>, lattice: LatticeKind, both: bool) -> Result<Vec<(Value<'n>, &'static str)>> {
    const WHY: &str = "no bond can break";
    let needed = if lattice == LatticeKind::Grid { "fracture" } else { "[strength]" };
    if let Some(value) = at(root, "model.plastic.yield_stretch")? {
        return match lattice {
            LatticeKind::Packing => Err(value.wrong(
                "the tensile strength says when bonds of a packing yield",
                "add [strength] with a tension, and write plastic = { hardening = …, ductility = … }",
            )),
            LatticeKind::Grid if states_fracture(root, |_| true)? => {
                let remedy = "leave fracture out, or write plastic = { hardening = …, ductility = … }";
                Err(value.wrong("both yield_stretch and fracture say when bonds fail", remedy))
            }
            LatticeKind::Grid => Ok(Vec::new()),
        };
    }
    let no_tension =
        lattice == LatticeKind::Packing && breaks(root, lattice)? && at(root, "strength.tension")?.is_none();
    if let Some(value) = at(root, "model.plastic")?.filter(|_| no_tension) {
        return Err(value.wrong(
            "bonds yield at their tensile strength, and there is none",
            "add tension = \"5 MPa\" to [strength], or leave plastic out",
        ));
    }
    if breaks(root, lattice)? {
        return Ok(Vec::new());
    }
    let soft = at(root, "model.softening")?.filter(|v| !v.is_text());
    let (plastic, idle) = (at(root, "model.plastic")?, root.get("unbreakable"));
    if both {
        return Ok([soft, plastic, idle].into_iter().flatten().map(|value| (value, WHY)).collect());
    }
    if let Some(value) = soft {
        let remedy = format!("add {needed}, or leave it out");
        return Err(value.wrong("softening does nothing where no bond breaks", remedy));
    }
    if let Some(value) = plastic {
        let remedy = match lattice {
            LatticeKind::Grid => "add a fracture energy, or yield_stretch and breaking_stretch instead of ductility",
            LatticeKind::Packing => "add [strength] with a tension, at which they yield",
        };
        return Err(value.wrong("it is not said at which stretch bonds yield", remedy));
    }
    if let Some(value) = idle {
        let remedy = format!("add {needed}, or leave unbreakable out");
        return Err(value.wrong(format!("unbreakable does nothing: {WHY}"), remedy));
    }
    Ok(Vec::new())
}

/// Whether bonds may break.
fn breaks(root: &Section, lattice: LatticeKind) -> Result<bool> {
    if lattice == LatticeKind::Packing {
        return Ok(root.get("strength").is_some());
    }
    states_fracture(root, |v| !v.is_text())
}

/// Whether fracture is given anywhere, so that it counts.
fn states_fracture(root: &Section, counts: impl Fn(&Value) -> bool) -> Result<bool> {
    let mut tables = vec![root.clone()];
    for region in root.tables("region")? {
        let region = region.table(&["fracture"])?;
        if let Some(layers) = region.get("layers") {
            let layup = layers.table(&["layup"])?.tables("layup")?;
            tables.extend(layup.into_iter().map(|layer| layer.table(&["fracture"])).collect::<Result<Vec<_>>>()?);
        }
        tables.push(region);
    }
    let states = |table: &Section| table.get("fracture").is_some_and(|v| counts(&v));
    Ok(tables.iter().any(states))
}

/// Refuses keys that another key, or its absence, makes idle.
fn idle(root: &Section, lattice: LatticeKind) -> Result<()> {
    let refuse = |value: Option<Value>, problem: &str, remedy: &str| match value {
        Some(value) => Err(value.wrong(problem, remedy)),
        None => Ok(()),
    };
    let has = |path: &str| Ok::<bool, anisobond::Error>(at(root, path)?.is_some());
    if has("motion.step")? {
        let safety = at(root, "motion.safety")?;
        refuse(safety, "the safety factor does nothing where the step is given", "keep one of step and safety")?;
    } else {
        let forced = at(root, "motion.force_step")?.filter(|v| v.truth().unwrap_or(false));
        refuse(forced, "no step is given that could be forced", "add step, or leave force_step out")?;
    }
    for region in root.tables("region")? {
        let region = region.table(&["over"])?;
        let over = region.get("over").filter(|_| region.get("solid").is_none());
        refuse(over, "a region without solid is all the rest, and takes no nodes of others", "leave over out")?;
    }
    if lattice == LatticeKind::Grid {
        return Ok(());
    }
    if root.get("equilibrium").is_some() {
        let damping = at(root, "packing.local_damping")?;
        refuse(damping, "local damping acts in motion, and the body is to be in equilibrium", "leave it out")?;
    }
    if !has("strength.cohesion")? {
        let angle = at(root, "strength.friction_angle")?;
        refuse(angle, "a friction angle does nothing without cohesion", "add cohesion = \"10 MPa\", or leave it out")?;
    }
    let Some(servo) = root.get("servo") else { return Ok(()) };
    let servo = servo.table(&["xx"])?;
    let stressed =
        servo.keys().any(|key| servo.get(key).is_some_and(|v| v.is_table() && v.node.get("stress").is_some()));
    for key in ["gain", "fastest"] {
        let idle = servo.get(key).filter(|_| !stressed);
        refuse(idle, "it is for components that a stress drives, and there are none", "leave it out")?;
    }
    Ok(())
}

/// The value of a dotted path of tables.
fn at<'n>(root: &Section<'n>, path: &str) -> Result<Option<Value<'n>>> {
    let Some((first, rest)) = path.split_once('.') else { return Ok(root.get(path)) };
    match root.get(first) {
        Some(value) => at(&value.table(&[rest])?, rest),
        None => Ok(None),
    }
}

/// What to say of keys that are not used; the other lattice's own section says so itself.
pub(super) fn note(unused: &[Unused], lattice: LatticeKind) -> Option<String> {
    let told: Vec<String> =
        unused.iter().filter(|u| !u.why.is_empty()).map(|u| format!("{} ({})", u.path, u.why)).collect();
    let lattice = if lattice == LatticeKind::Packing { "packing" } else { "grid" };
    (!told.is_empty()).then(|| format!("not used on the {lattice}: {}", told.join(", ")))
}

/// What was asked, with what is not used apart under the key "not used".
pub(super) fn apart(mut asked: serde_json::Value, unused: &[Unused]) -> serde_json::Value {
    let mut idle = serde_json::Map::new();
    for Unused { path, .. } in unused {
        let steps: Vec<&str> = path.split('.').collect();
        let Some((last, way)) = steps.split_last() else { continue };
        let parent = way.iter().try_fold(&mut asked, |here, step| match here {
            serde_json::Value::Array(items) => step.parse::<usize>().ok().and_then(|n| items.get_mut(n)),
            other => other.get_mut(*step),
        });
        let taken = parent.and_then(|parent| parent.as_object_mut()?.shift_remove(*last));
        idle.extend(taken.map(|value| (path.clone(), value)));
    }
    if let (Some(all), false) = (asked.as_object_mut(), idle.is_empty()) {
        all.retain(|_, value| value.as_object().is_none_or(|o| !o.is_empty()));
        all.insert(NOT_USED.into(), idle.into());
    }
    asked
}
