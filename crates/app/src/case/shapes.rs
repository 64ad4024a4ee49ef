//! Solids in a case file.

use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::section::{Section, Value};
use anisobond::Result;
use anisobond::lattice::Solid;
use anisobond_formats::orientation::orientation_of;
use anisobond_formats::stl::read_stl;
use anisobond_formats::units::Dimension;
use anisobond_formats::words::{quoted, suggestion};

/// The ways to write a solid.
const FORMS: [&str; 8] = ["box", "cylinder", "sphere", "halfspace", "union", "intersection", "difference", "stl"];

/// Solids in solids, at most so deep.
const DEEPEST: usize = 30;

/// Solids of one case; names that refer to names would otherwise multiply without end.
const MOST: usize = 100_000;

/// What solids refer to.
pub(super) struct Shapes<'n> {
    /// Where relative paths begin.
    pub folder: PathBuf,
    /// `[solids]`.
    pub named: Option<Section<'n>>,
    /// Solids read so far.
    pub count: Cell<usize>,
}

impl<'n> Shapes<'n> {
    /// Names of `[solids]`.
    pub fn names(&self) -> Vec<&'n str> {
        self.named.iter().flat_map(Section::keys).collect()
    }

    /// A path, from the folder of the case file where it is relative.
    pub fn path(&self, text: &str) -> PathBuf {
        self.folder.join(Path::new(text))
    }

    /// A solid: a name of `[solids]`, or a table with one form and maybe `rotate` and `move`.
    pub fn solid(&self, value: &Value<'n>) -> Result<Solid> {
        self.at_depth(value, 0)
    }

    fn at_depth(&self, value: &Value<'n>, depth: usize) -> Result<Solid> {
        self.count.set(self.count.get() + 1);
        if depth > DEEPEST || self.count.get() > MOST {
            return Err(
                value.wrong("solids are too many or nested too deep, or one refers to itself", "name simpler solids")
            );
        }
        if value.is_text() {
            let name = value.text()?;
            let found = self.named.as_ref().and_then(|s| s.get(name));
            let found = found.ok_or_else(|| {
                let names = self.names();
                let remedy = if names.is_empty() {
                    format!("define it: [solids.{name}], or write the solid here as {{ box = {{ … }} }}")
                } else {
                    suggestion(name, &names)
                };
                value.wrong(format!("there is no solid {}", quoted(name)), remedy)
            })?;
            return self.at_depth(&found, depth + 1);
        }
        let mut keys = FORMS.to_vec();
        keys.extend(["rotate", "move"]);
        let table = value.clone().section(&keys)?;
        let (form, shape) = table
            .only(&FORMS)?
            .ok_or_else(|| value.wrong("the solid has no shape", format!("write one of {}", FORMS.join(", "))))?;
        let parts = |least: usize| -> Result<Vec<Solid>> {
            let items = shape.items(&format!("{form} = [solid, solid]"))?;
            if items.len() < least {
                return Err(shape.wrong(format!("{form} needs at least {least} solids"), "add them to the list"));
            }
            items.iter().map(|item| self.at_depth(item, depth + 1)).collect()
        };
        let solid = match form {
            "box" => block(shape)?,
            "cylinder" => cylinder(shape)?,
            "sphere" => {
                let table = shape.section(&["centre", "radius"])?;
                Solid::Sphere { centre: centre(&table)?, radius: radius(&table)? }
            }
            "halfspace" => {
                let table = shape.section(&["point", "normal"])?;
                Solid::HalfSpace {
                    point: table.need("point", "point = [0, 0, 0]")?.vector(Dimension::Length)?,
                    normal: table.need("normal", "normal = [0, 0, 1], out of the solid")?.direction()?,
                }
            }
            "union" => Solid::Union(parts(1)?),
            "intersection" => Solid::Intersection(parts(1)?),
            "difference" => {
                let mut parts = parts(2)?;
                let from = parts.remove(0);
                Solid::Difference(Box::new(from), parts)
            }
            _ => self.surface(shape)?,
        };
        moved(solid, &table)
    }

    /// `stl = { file = "part.stl", unit = "mm" }`.
    fn surface(&self, value: Value<'n>) -> Result<Solid> {
        let table = value.clone().section(&["file", "unit"])?;
        let file = table.need("file", "file = \"part.stl\"")?;
        let unit = table.need("unit", "unit = \"mm\": an STL file does not say it")?;
        let size = Dimension::Length.unit(unit.text()?).map_err(|e| unit.spot().at(e))?;
        let mesh = read_stl(self.path(file.text()?), size).map_err(|e| file.spot().at(e))?;
        Ok(Solid::Mesh(Arc::new(mesh)))
    }
}

/// `box = { min = …, max = … }` or `{ size = …, centre = … }`; of two components, infinite along z.
fn block(value: Value) -> Result<Solid> {
    let table = value.clone().section(&["min", "max", "size", "centre"])?;
    let corner = |key: &str, rest: f64| -> Result<Vector3<f64>> {
        let entry = table.need(key, &format!("{key} = \"0, 0, 0 mm\""))?;
        match entry.quantities(Dimension::Length)?[..] {
            [x, y] => Ok(Vector3::new(x, y, rest)),
            [x, y, z] => Ok(Vector3::new(x, y, z)),
            ref other => {
                Err(entry.wrong(format!("two or three lengths are needed, not {}", other.len()), "give x, y (and z)"))
            }
        }
    };
    let (min, max) = if table.get("size").is_some() {
        if let Some(extra) = table.get("min").or(table.get("max")) {
            return Err(extra.wrong("size and corners are both given", "keep size and centre, or min and max"));
        }
        let half = corner("size", f64::INFINITY)? * 0.5;
        let middle = if table.get("centre").is_some() { corner("centre", 0.0)? } else { Vector3::zeros() };
        (middle - half, middle + half)
    } else {
        (corner("min", f64::NEG_INFINITY)?, corner("max", f64::INFINITY)?)
    };
    match (0..3).find(|&a| min[a] >= max[a]) {
        Some(a) => Err(value.wrong(
            format!("the box is empty along {}: from {} m to {} m", ["x", "y", "z"][a], min[a], max[a]),
            "give min below max, and a size above zero",
        )),
        None => Ok(Solid::Box { min, max }),
    }
}

/// `cylinder = { axis = "z", radius = …, centre = …, length = … }`; without length, infinite.
fn cylinder(value: Value) -> Result<Solid> {
    let table = value.section(&["centre", "axis", "radius", "length"])?;
    let length = table.get("length").map(|v| v.positive_quantity(Dimension::Length)).transpose()?;
    Ok(Solid::Cylinder {
        centre: centre(&table)?,
        axis: table.need("axis", "axis = \"z\"")?.direction()?,
        radius: radius(&table)?,
        half_length: length.map_or(f64::INFINITY, |l| 0.5 * l),
    })
}

fn centre(table: &Section) -> Result<Vector3<f64>> {
    table.get("centre").map_or_else(|| Ok(Vector3::zeros()), |v| v.vector(Dimension::Length))
}

fn radius(table: &Section) -> Result<f64> {
    table.need("radius", "radius = \"10 mm\"")?.positive_quantity(Dimension::Length)
}

/// The solid turned about the origin, then shifted.
fn moved(solid: Solid, table: &Section) -> Result<Solid> {
    let rotation = table.get("rotate").map(|v| orientation_of(v.node, &v.path)).transpose()?;
    let shift = table.get("move").map(|v| v.vector(Dimension::Length)).transpose()?;
    if rotation.is_none() && shift.is_none() {
        return Ok(solid);
    }
    Ok(Solid::Moved {
        solid: Box::new(solid),
        rotation: rotation.unwrap_or_else(Matrix3::identity),
        shift: shift.unwrap_or_else(Vector3::zeros),
    })
}
