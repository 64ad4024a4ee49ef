//! `[packing]` of a case file, and what belongs to it: strength, contact, servo.

mod body;
mod plan;
mod resolve;
mod select;

use std::path::PathBuf;

use super::section::{AXES, Section, Spot, Value};
use super::shapes::Shapes;
use super::{CaseFile, Result};
use anisobond::calibration::Model;
use anisobond::experiment::element_test::Rotations;
use anisobond::experiment::{CellDrive, PackingProblem, ServoPlan};
use anisobond::lattice::generate::{Extent, Radii, RandomPacking, Target};
use anisobond::tensor::Stiffness;
use anisobond_formats::PackingOptions;
use anisobond_formats::units::Dimension;
pub use plan::PackingPlan;
pub(super) use plan::plan;

/// Porosity of a generated packing unless one is asked for, as `anisobond pack`.
const USUAL_POROSITY: f64 = 0.45;

/// Part of a missing stress that a step of the servo makes good, unless the case says otherwise.
const USUAL_GAIN: f64 = 0.01;

/// Where the spheres come from.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Source {
    /// A file, and what it leaves open.
    File(PathBuf, PackingOptions),
    Random(RandomPacking),
}

/// `[strength]` of bonds: stresses over π r² (Pa) and an angle (radians).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StrengthStatement {
    pub tension: f64,
    pub cohesion: f64,
    pub friction_angle: f64,
}

/// `[contact]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ContactStatement {
    /// Pa; `None`: that of the bonds on average.
    pub modulus: Option<f64>,
    pub tangential_ratio: Option<f64>,
    pub friction: f64,
}

/// `[packing]` and its companions.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PackingStatement {
    pub spot: Spot,
    /// Where the spheres are named.
    pub source_spot: Spot,
    pub source: Source,
    pub contact_radius: f64,
    pub repeat: Option<(Spot, [usize; 3])>,
    pub periodic: [bool; 3],
    pub bonds: Model,
    pub correct: bool,
    pub rotations: Rotations,
    pub strength: Option<StrengthStatement>,
    pub contact: Option<ContactStatement>,
    pub servo: Option<(Spot, ServoPlan)>,
}

/// Keys of what a file of spheres leaves open.
const OF_FILE: [&str; 3] = ["length_unit", "frame", "type_radii"];

const KEYS: [&str; 18] = [
    "file",
    "length_unit",
    "frame",
    "type_radii",
    "radius",
    "fuzz",
    "number",
    "cell",
    "porosity",
    "coordination",
    "seed",
    "contact_radius",
    "repeat",
    "periodic",
    "bonds",
    "correct",
    "rotations",
    "local_damping",
];

/// `[packing]`, `[strength]`, `[contact]` and `[servo]`.
pub(super) fn statement<'n>(root: &Section<'n>, shapes: &Shapes<'n>) -> Result<Option<PackingStatement>> {
    let Some(value) = root.get("packing") else { return Ok(None) };
    let table = value.section(&KEYS)?;
    let contact_radius = table.need("contact_radius", "contact_radius = 1.8")?.positive()?;
    let (source_spot, source) = source(&table, shapes, contact_radius)?;
    // Without a body the whole cell is the body.
    let mut periodic = [root.get("body").is_none(); 3];
    if let Some(v) = table.get("periodic") {
        let axes = v.items("periodic = [\"y\"]")?.iter().map(|item| item.choice(&AXES)).collect::<Result<Vec<_>>>()?;
        if periodic == [true; 3] && axes.len() < 3 {
            return Err(
                v.wrong("without a body the packing is periodic along all axes", "add [body], or drop periodic")
            );
        }
        axes.into_iter().for_each(|axis| periodic[axis] = true);
    }
    let rotations = [("free", Rotations::Free), ("blocked", Rotations::Blocked)];
    let models = [("micropolar", Model::Micropolar), ("central", Model::Central)];
    if let Some(v) = table.get("bonds").filter(|v| v.text().is_ok_and(|text| text == "hybrid")) {
        return Err(v.wrong(
            "hybrid bonds need a nodal term, which runs of packings do not have yet",
            "use micropolar bonds, with correct = true where they miss the material, or a grid",
        ));
    }
    Ok(Some(PackingStatement {
        spot: table.spot(),
        source_spot,
        source,
        contact_radius,
        repeat: table.get("repeat").map(|v| repeat(&v)).transpose()?,
        periodic,
        bonds: table.get("bonds").map(|v| v.choice(&models)).transpose()?.unwrap_or(Model::Micropolar),
        correct: table.get("correct").map(|v| v.truth()).transpose()?.unwrap_or(false),
        rotations: table.get("rotations").map(|v| v.choice(&rotations)).transpose()?.unwrap_or(Rotations::Free),
        strength: root.get("strength").map(strength).transpose()?,
        contact: root.get("contact").map(contact).transpose()?,
        servo: root.get("servo").map(|v| Ok((v.spot(), servo(v, root)?))).transpose()?,
    }))
}

/// A file, or what `anisobond pack` is told.
fn source(table: &Section, shapes: &Shapes, contact_radius: f64) -> Result<(Spot, Source)> {
    let generated = ["radius", "fuzz", "number", "cell", "porosity", "coordination", "seed"];
    if let Some(file) = table.get("file") {
        if let Some(extra) = generated.iter().find_map(|key| table.get(key)) {
            return Err(extra.wrong("the packing is read from a file", "drop the file to make one, or drop this key"));
        }
        let options = PackingOptions {
            length_unit: table.get("length_unit").map(|v| v.text().map(String::from)).transpose()?,
            frame: table.get("frame").map(|v| v.whole(0)).transpose()?.map(|frame| frame as u64),
            type_radii: table
                .get("type_radii")
                .map(|v| v.quantities(Dimension::Length))
                .transpose()?
                .unwrap_or_default(),
        };
        return Ok((file.spot(), Source::File(shapes.path(file.text()?), options)));
    }
    if let Some(extra) = OF_FILE.iter().find_map(|key| table.get(key)) {
        return Err(extra.wrong("the packing is not read from a file", "drop this key, or name the file"));
    }
    let radius = table.need("radius", "file = \"spheres.txt\", or radius = \"3 mm\" and number = 1000")?;
    let mean = radius.positive_quantity(Dimension::Length)?;
    let radii = match table.get("fuzz").map(|v| (v.number(), v)) {
        None => Radii::Uniform { radius: mean },
        Some((fuzz, v)) => match fuzz? {
            fuzz if (0.0..1.0).contains(&fuzz) => Radii::Fuzzy { mean, fuzz },
            fuzz => return Err(v.wrong(format!("fuzz {fuzz} is out of range"), "give at least 0 and below 1")),
        },
    };
    let extent = match table.only(&["number", "cell"])? {
        Some(("number", v)) => Extent::Number(v.whole(1)?),
        Some((_, v)) => Extent::Cell(v.vector(Dimension::Length)?.into()),
        None => {
            return Err(table.spot().wrong("the packing has no size", "add number = 1000, or cell = \"1, 1, 1 m\""));
        }
    };
    let target = match table.only(&["porosity", "coordination"])? {
        Some(("coordination", v)) => Target::Coordination(v.positive()?),
        Some((_, v)) => Target::Porosity(v.positive()?),
        None => Target::Porosity(USUAL_POROSITY),
    };
    let seed = table.get("seed").map(|v| v.whole(0)).transpose()?.unwrap_or(0) as u64;
    Ok((radius.spot(), Source::Random(RandomPacking { extent, radii, target, contact_radius, seed })))
}

fn repeat(value: &Value) -> Result<(Spot, [usize; 3])> {
    let numbers = value.items("repeat = [2, 2, 2]")?.iter().map(|v| v.whole(1)).collect::<Result<Vec<_>>>()?;
    let three = <[usize; 3]>::try_from(numbers).ok().filter(|n| n.iter().all(|n| *n <= 10_000));
    let three = three.ok_or_else(|| value.wrong("three numbers of cells are needed", "write repeat = [2, 2, 2]"))?;
    Ok((value.spot(), three))
}

fn strength(value: Value) -> Result<StrengthStatement> {
    let table = value.section(&["tension", "cohesion", "friction_angle"])?;
    let stress = |key: &str| table.get(key).map(|v| v.positive_quantity(Dimension::Stress)).transpose();
    let (tension, cohesion) = (stress("tension")?, stress("cohesion")?);
    if tension.is_none() && cohesion.is_none() {
        return Err(table.spot().wrong("the strength is empty", "add tension = \"5 MPa\" and cohesion = \"10 MPa\""));
    }
    let friction_angle = match table.get("friction_angle") {
        None => 0.0,
        Some(v) => {
            let angle = if v.is_text() { v.quantity(Dimension::Angle)? } else { v.number()?.to_radians() };
            if !(0.0..std::f64::consts::FRAC_PI_2).contains(&angle) {
                return Err(v.wrong("the friction angle is out of range", "give at least 0 and below 90 degrees"));
            }
            angle
        }
    };
    let endless = f64::INFINITY;
    Ok(StrengthStatement { tension: tension.unwrap_or(endless), cohesion: cohesion.unwrap_or(endless), friction_angle })
}

fn contact(value: Value) -> Result<ContactStatement> {
    let table = value.section(&["modulus", "tangential_ratio", "friction"])?;
    let not_negative = |key: &str| -> Result<Option<f64>> {
        let Some(v) = table.get(key) else { return Ok(None) };
        match v.number()? {
            x if x >= 0.0 => Ok(Some(x)),
            x => Err(v.wrong(format!("{x} is negative"), "give 0 or more")),
        }
    };
    Ok(ContactStatement {
        modulus: table.get("modulus").map(|v| v.positive_quantity(Dimension::Stress)).transpose()?,
        tangential_ratio: not_negative("tangential_ratio")?,
        friction: not_negative("friction")?
            .ok_or_else(|| table.spot().wrong("the contact has no friction", "add friction = 0.5"))?,
    })
}

/// Names of the components, in Voigt's order.
const COMPONENTS: [&str; 6] = ["xx", "yy", "zz", "yz", "xz", "xy"];

fn servo(value: Value, root: &Section) -> Result<ServoPlan> {
    let mut keys = COMPONENTS.to_vec();
    keys.extend(["fastest", "gain"]);
    let table = value.section(&keys)?;
    let duration = root.get("motion").map(|v| v.table(&["duration"])).transpose()?;
    let duration =
        duration.and_then(|m| m.get("duration")).map(|v| v.positive_quantity(Dimension::Time)).transpose()?;
    let mut drives = [CellDrive::Rate(0.0); 6];
    for (drive, key) in drives.iter_mut().zip(COMPONENTS) {
        if let Some(v) = table.get(key) {
            *drive = cell_drive(v, duration)?;
        }
    }
    let gain = match table.get("gain") {
        None => USUAL_GAIN,
        Some(v) => match v.positive()? {
            x if x <= 1.0 => x,
            x => return Err(v.wrong(format!("gain {x} is above 1"), "give a number above 0, at most 1")),
        },
    };
    let fastest = table.get("fastest").map(|v| v.positive_quantity(Dimension::Rate)).transpose()?;
    Ok(ServoPlan { drives, gain, fastest: fastest.unwrap_or(f64::INFINITY) })
}

/// `{ stress = … }`, `{ strain_rate = … }`, `{ strain = … }`, or a stress and, `after` a time, a rate or strain.
fn cell_drive(value: Value, duration: Option<f64>) -> Result<CellDrive> {
    let table = value.section(&["stress", "strain_rate", "strain", "after"])?;
    let stress = table.get("stress").map(|v| v.quantity(Dimension::Stress)).transpose()?;
    let after = table.get("after").map(|v| v.positive_quantity(Dimension::Time)).transpose()?;
    let rate = match table.only(&["strain_rate", "strain"])? {
        None => None,
        Some(("strain_rate", v)) => Some(v.quantity(Dimension::Rate)?),
        Some((_, v)) => {
            let span = duration.map(|d| d - after.unwrap_or(0.0)).filter(|d| *d > 0.0);
            let span =
                span.ok_or_else(|| v.wrong("a strain needs time to be reached", "give motion.duration after it"))?;
            Some(v.number()? / span)
        }
    };
    let wrong = |problem: &str, remedy: &str| Err(table.spot().wrong(problem, remedy));
    match (stress, rate, after) {
        (Some(stress), None, None) => Ok(CellDrive::Stress(stress)),
        (None, Some(rate), None) => Ok(CellDrive::Rate(rate)),
        (Some(stress), Some(rate), Some(until)) => Ok(CellDrive::StressThenRate { stress, until, rate }),
        (None, None, _) => wrong("nothing drives the component", "add stress, strain_rate or strain"),
        (_, _, Some(_)) => wrong("after needs a stress before and a strain rate after", "give both, or drop after"),
        (Some(_), Some(_), None) => {
            wrong("a stress and a strain rate are both given", "keep one, or say after = \"1 ms\" when the rate begins")
        }
    }
}

/// The problem on the case's packing.
pub(super) fn problem(case: &CaseFile) -> Result<PackingProblem> {
    resolve::problem(case)
}

/// What an element test measures on the periodic packing.
pub(super) fn measured(case: &CaseFile) -> Result<Stiffness> {
    resolve::measured(case)
}
