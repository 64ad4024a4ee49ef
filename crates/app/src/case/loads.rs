//! Where nodes are held and driven, and how that changes in time.

use nalgebra::Vector3;

use super::matter::name_of;
use super::section::{AXES, Section, Spot, Value};
use super::shapes::Shapes;
use anisobond::Result;
use anisobond::experiment::{Crack, History};
use anisobond::lattice::Solid;
use anisobond::lattice::solid::Face;
use anisobond_formats::pairs::read_pairs;
use anisobond_formats::tree::Kind;
use anisobond_formats::units::Dimension;
use anisobond_formats::words::{quoted, suggestion};

/// Names of the outer faces.
const FACES: [&str; 6] = ["x-min", "x-max", "y-min", "y-max", "z-min", "z-max"];

/// A choice of nodes.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Place {
    All,
    /// Of an outer face, to a depth.
    Face(Face, Depth),
    Solid(Solid),
    /// Of the region of a name, with all its grains or layers.
    Region(String),
    /// The nearest to each point.
    Points(Vec<Vector3<f64>>),
}

/// How deep a layer of nodes is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Depth {
    /// In grid spacings, or in mean diameters of spheres.
    Spacings(f64),
    /// In m.
    Length(f64),
}

impl Depth {
    /// In m, for a spacing (m).
    pub fn metres(self, spacing: f64) -> f64 {
        match self {
            Depth::Spacings(number) => number * spacing,
            Depth::Length(length) => length,
        }
    }
}

/// A choice of nodes, and where the file makes it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Where {
    pub spot: Spot,
    pub place: Place,
}

/// What a condition does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Load {
    Displacement([Option<f64>; 3]),
    Velocity([Option<f64>; 3]),
    /// Force per area (Pa).
    Traction(Vector3<f64>),
    /// Pressure (Pa), positive into the body.
    Pressure(f64),
    /// Force per volume (N/m³).
    BodyForce(Vector3<f64>),
    /// Force per mass (m/s²).
    Acceleration(Vector3<f64>),
    /// Total force (N), shared equally.
    Force(Vector3<f64>),
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct ConditionStatement {
    pub spot: Spot,
    pub name: String,
    pub on: Where,
    pub load: Load,
    pub history: History,
}

/// What names stand for in conditions.
pub(super) struct Names<'s, 'n> {
    pub shapes: &'s Shapes<'n>,
    pub regions: Vec<String>,
    /// Whether histories run over load factors instead of time.
    pub equilibrium: bool,
}

const LOADS: [&str; 7] = ["displacement", "velocity", "traction", "pressure", "body_force", "acceleration", "force"];

impl<'n> Names<'_, 'n> {
    /// `on`, with `thickness`.
    pub fn on(&self, table: &Section<'n>) -> Result<Where> {
        let on = table.need("on", "on = \"x-min\", a solid, a region or \"all\"")?;
        let thickness = table.get("thickness");
        let depth = match &thickness {
            None => Depth::Spacings(1.0),
            Some(v) if v.is_text() => Depth::Length(v.positive_quantity(Dimension::Length)?),
            Some(v) => Depth::Spacings(v.positive()?),
        };
        let place = self.place(&on, depth)?;
        if let (Some(v), false) = (thickness, matches!(place, Place::Face(..))) {
            return Err(v.wrong("thickness is for faces (x-min … z-max)", "leave it out"));
        }
        Ok(Where { spot: on.spot(), place })
    }

    fn place(&self, on: &Value<'n>, depth: Depth) -> Result<Place> {
        if !on.is_text() {
            return self.shapes.solid(on).map(Place::Solid);
        }
        let text = on.text()?;
        if let Some(n) = FACES.iter().position(|f| *f == text) {
            return Ok(Place::Face(Face { axis: n / 2, upper: n % 2 == 1 }, depth));
        }
        if text == "all" {
            return Ok(Place::All);
        }
        if self.regions.iter().any(|r| r == text) {
            return Ok(Place::Region(text.to_string()));
        }
        if self.shapes.names().contains(&text) {
            return self.shapes.solid(on).map(Place::Solid);
        }
        let mut names = FACES.to_vec();
        names.push("all");
        names.extend(self.regions.iter().map(String::as_str));
        names.extend(self.shapes.names());
        Err(on.wrong(format!("{} is no face, region or solid", quoted(text)), suggestion(text, &names)))
    }

    /// `[[condition]]`s.
    pub fn conditions(&self, root: &Section<'n>) -> Result<Vec<ConditionStatement>> {
        let mut all: Vec<ConditionStatement> = Vec::new();
        for (n, value) in root.tables("condition")?.into_iter().enumerate() {
            let mut keys = vec!["name", "on", "thickness", "history"];
            keys.extend(LOADS);
            let condition = self.condition(&value.section(&keys)?, n)?;
            if all.iter().any(|c| c.name == condition.name) {
                let problem = format!("two conditions are called {}", quoted(&condition.name));
                return Err(condition.spot.wrong(problem, "give each a name of its own"));
            }
            all.push(condition);
        }
        Ok(all)
    }

    fn condition(&self, table: &Section<'n>, number: usize) -> Result<ConditionStatement> {
        let (key, value) = table.only(&LOADS)?.ok_or_else(|| {
            table.spot().wrong("the condition says nothing", format!("add one of {}", LOADS.join(", ")))
        })?;
        let load = match key {
            "displacement" => Load::Displacement(prescribed(&value, Dimension::Length)?),
            "velocity" if self.equilibrium => {
                return Err(value.wrong("a velocity has no meaning in equilibrium", "prescribe a displacement"));
            }
            "velocity" => Load::Velocity(prescribed(&value, Dimension::Velocity)?),
            "traction" => Load::Traction(value.vector(Dimension::Stress)?),
            "pressure" => Load::Pressure(value.quantity(Dimension::Stress)?),
            "body_force" => Load::BodyForce(value.vector(Dimension::ForceDensity)?),
            "acceleration" => Load::Acceleration(value.vector(Dimension::Acceleration)?),
            _ => Load::Force(value.vector(Dimension::Force)?),
        };
        let on = self.on(table)?;
        let surface = matches!(load, Load::Traction(_) | Load::Pressure(_));
        if surface && !matches!(on.place, Place::Face(..) | Place::Solid(_)) {
            return Err(on.spot.wrong(format!("a {key} acts on a surface"), "name a face (x-min … z-max) or a solid"));
        }
        let history = self.history(table)?;
        Ok(ConditionStatement { spot: table.spot(), name: name_of(table, "condition", number)?, on, load, history })
    }

    /// `history`: constant in motion, growing with the load factor in equilibrium, where nothing is said.
    fn history(&self, table: &Section<'n>) -> Result<History> {
        let growing = History::Ramp { start: 0.0, end: 1.0 };
        let Some(value) = table.get("history") else {
            return Ok(if self.equilibrium { growing } else { History::Constant });
        };
        if value.is_text() {
            value.choice(&[("constant", ())])?;
            return Ok(History::Constant);
        }
        let spot = value.spot();
        let forms = ["ramp", "pulse", "table"];
        let table = value.section(&forms)?;
        let (form, value) =
            table.only(&forms)?.ok_or_else(|| spot.wrong("the history is empty", "write { ramp = [0, \"1 ms\"] }"))?;
        if form == "table" {
            return self.history_table(&value).map(History::Table);
        }
        let times: Vec<f64> = value.items("[start, end]")?.iter().map(|v| self.time(v)).collect::<Result<_>>()?;
        match times[..] {
            [start, end] if start < end && form == "ramp" => Ok(History::Ramp { start, end }),
            [start, end] if start < end => Ok(History::Pulse { start, end }),
            _ => Err(value.wrong("a start and a later end are needed", format!("write {form} = [0, \"1 ms\"]"))),
        }
    }

    fn history_table(&self, value: &Value<'n>) -> Result<Vec<(f64, f64)>> {
        let points = if value.is_text() {
            let path = self.shapes.path(value.text()?);
            read_pairs(path, "time in s and value, as 0.001, 1").map_err(|e| value.spot().at(e))?
        } else {
            let row = |item: &Value<'n>| match item.items("[time, value]")?.as_slice() {
                [time, factor] => Ok((self.time(time)?, factor.number()?)),
                other => Err(item.wrong(format!("two numbers are needed, not {}", other.len()), "write [time, value]")),
            };
            value.items("[[0, 0], [\"1 ms\", 1]]")?.iter().map(row).collect::<Result<Vec<_>>>()?
        };
        if points.is_empty() || points.iter().any(|p| !p.0.is_finite() || !p.1.is_finite()) {
            return Err(value.wrong("the table is empty or not finite", "give rows of time and value"));
        }
        if let Some(n) = points.windows(2).position(|w| w[0].0 >= w[1].0) {
            let problem = format!("the times do not ascend at row {}", n + 2);
            return Err(value.wrong(problem, "sort the rows by time, each time once"));
        }
        Ok(points)
    }

    /// A time (s), or a load factor in equilibrium.
    fn time(&self, value: &Value<'n>) -> Result<f64> {
        if self.equilibrium {
            let plain = value.number();
            return plain.map_err(|_| {
                let problem = format!("{} is no load factor", value.node.described());
                value.wrong(problem, "in equilibrium histories run over the load factor: write numbers from 0 to 1")
            });
        }
        value.quantity(Dimension::Time)
    }

    /// `[[initial_velocity]]`s.
    pub fn velocities(&self, root: &Section<'n>) -> Result<Vec<(Where, Vector3<f64>)>> {
        let one = |value: Value<'n>| {
            if self.equilibrium {
                return Err(value.wrong("an initial velocity has no meaning in equilibrium", "leave it out"));
            }
            let table = value.section(&["on", "thickness", "velocity"])?;
            let velocity = table.need("velocity", "velocity = [\"1 m/s\", 0, 0]")?.vector(Dimension::Velocity)?;
            Ok((self.on(&table)?, velocity))
        };
        root.tables("initial_velocity")?.into_iter().map(one).collect()
    }

    /// `[[unbreakable]]`s.
    pub fn unbreakable(&self, root: &Section<'n>) -> Result<Vec<Where>> {
        let one = |value: Value<'n>| self.on(&value.section(&["on", "thickness"])?);
        root.tables("unbreakable")?.into_iter().map(one).collect()
    }
}

/// Three components: quantities, or "free".
fn prescribed(value: &Value, what: Dimension) -> Result<[Option<f64>; 3]> {
    let mut components = [None; 3];
    if value.is_text() {
        components = value.vector(what)?.map(Some).into();
    } else {
        let items = value.items(&format!("[{}, \"free\", 0]", what.example()))?;
        if items.len() != 3 {
            let problem = format!("three components are needed, not {}", items.len());
            return Err(value.wrong(problem, "give x, y and z; \"free\" where nothing is prescribed"));
        }
        for (a, item) in items.iter().enumerate() {
            if !matches!(&item.node.kind, Kind::Text(text) if text.trim() == "free") {
                components[a] = Some(item.quantity(what)?);
            }
        }
    }
    if components.iter().all(Option::is_none) {
        return Err(value.wrong("all components are free", "prescribe at least one"));
    }
    Ok(components)
}

/// `[[crack]]`s.
pub(super) fn cracks(root: &Section) -> Result<Vec<(Spot, Crack)>> {
    root.tables("crack")?.into_iter().map(|v| Ok((v.spot(), crack(v)?))).collect()
}

fn crack(value: Value) -> Result<Crack> {
    let spot = value.spot();
    let forms = ["plane", "disc", "rectangle", "line"];
    let table = value.section(&forms)?;
    let (form, value) = table
        .only(&forms)?
        .ok_or_else(|| spot.wrong("the crack has no form", "write plane, disc, rectangle or line = { … }"))?;
    let length = Dimension::Length;
    if form == "line" {
        return line(value);
    }
    if form != "rectangle" {
        let keys: &[&str] = if form == "disc" { &["centre", "normal", "radius"] } else { &["point", "normal"] };
        let table = value.section(keys)?;
        let radius = match form {
            "disc" => table.need("radius", "radius = \"10 mm\"")?.positive_quantity(length)?,
            _ => f64::INFINITY,
        };
        let normal = table.need("normal", "normal = \"y\"")?.direction()?;
        return Ok(Crack::Disc { centre: table.need(keys[0], "it as [0, 0, 0]")?.vector(length)?, normal, radius });
    }
    let table = value.section(&["corner", "a", "b"])?;
    let vector = |key: &str| table.need(key, &format!("{key} = \"50, 0, 0 mm\""))?.vector(length);
    let (corner, a, b) = (vector("corner")?, vector("a")?, vector("b")?);
    if a.cross(&b).norm() <= 1e-12 * a.norm() * b.norm() {
        return Err(table.spot().wrong("the edges a and b are parallel or zero", "give two edges of a rectangle"));
    }
    Ok(Crack::Parallelogram { corner, a, b })
}

/// `line = { from = "0, 0 mm", to = "50, 0 mm" }`: in the plane of x and y, through the whole thickness.
fn line(value: Value) -> Result<Crack> {
    let table = value.clone().section(&["from", "to"])?;
    let end = |key: &str| {
        let entry = table.need(key, &format!("{key} = \"0, 0 mm\""))?;
        match entry.quantities(Dimension::Length)?[..] {
            [x, y] => Ok(Vector3::new(x, y, 0.0)),
            ref other => Err(entry.wrong(format!("two lengths are needed, not {}", other.len()), "give x and y")),
        }
    };
    let (from, to) = (end("from")?, end("to")?);
    let reach = Vector3::z() * (1e3 * (to - from).norm().max(from.norm()));
    if from == to {
        return Err(value.wrong("the crack has no length", "give two different ends"));
    }
    Ok(Crack::Parallelogram { corner: from - reach, a: to - from, b: 2.0 * reach })
}

/// An axis and a face's name, for messages.
pub(super) fn face_name(face: Face) -> String {
    format!("{}-{}", AXES[face.axis].0, if face.upper { "max" } else { "min" })
}
