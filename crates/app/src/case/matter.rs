//! What regions are made of: material, orientation, density, fracture; grains and layers.

use std::path::Path;

use nalgebra::{Matrix3, Vector3};

use super::section::{AXES, Section, Spot, Value};
use super::shapes::Shapes;
use anisobond::experiment::FractureEnergy;
use anisobond::lattice::Solid;
use anisobond::tensor::Stiffness;
use anisobond::{Error, Result};
use anisobond_formats::find::find_material;
use anisobond_formats::material::{Habits, material_of};
use anisobond_formats::orientation::{Orientation, orientation_of};
use anisobond_formats::table::csv_reader;
use anisobond_formats::tree::read_text;
use anisobond_formats::units::Dimension;
use anisobond_formats::words::quoted;

/// Most regions of one file.
const MOST_REGIONS: usize = 10_000;

/// Most layers of one laminate.
const MOST_LAYERS: usize = 65_000;

/// A substance in axes of its own, turned by Q.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Matter {
    pub stiffness: Stiffness,
    pub density: Option<f64>,
    pub fracture: Option<FractureEnergy>,
    pub turn: Matrix3<f64>,
}

impl Matter {
    /// Stiffness in the grid's axes (Pa).
    pub fn turned_stiffness(&self) -> Stiffness {
        if self.turn == Matrix3::identity() { self.stiffness } else { self.stiffness.rotated(&self.turn) }
    }

    /// Fracture with its normals in the grid's axes.
    pub fn turned_fracture(&self) -> Option<FractureEnergy> {
        match &self.fracture {
            Some(FractureEnergy::Directional(rows)) => {
                Some(FractureEnergy::Directional(rows.iter().map(|(n, g)| (self.turn * n, *g)).collect()))
            }
            other => other.clone(),
        }
    }
}

/// Orientations of grains.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Orientations {
    Random,
    Table(Vec<Matrix3<f64>>),
}

/// What is in a region.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Filling {
    One(Matter),
    Grains { spot: Spot, number: usize, seed: u64, orientations: Orientations, matter: Matter },
    Layers { spot: Spot, axis: usize, start: Option<f64>, layers: Vec<(f64, Matter)>, repeat: usize },
}

/// A region as the file states it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RegionStatement {
    pub spot: Spot,
    pub name: String,
    /// `None`: all that no other region has.
    pub solid: Option<Solid>,
    /// May take nodes of regions before.
    pub over: bool,
    pub filling: Filling,
}

/// Keys that say what something is made of.
pub(super) const MATTER_KEYS: [&str; 4] = ["material", "orientation", "density", "fracture"];

/// Substances of a case: what a table leaves out comes from the table around it.
pub(super) struct Matters<'s, 'n> {
    pub shapes: &'s Shapes<'n>,
    /// The case file's outermost table.
    pub root: &'s Section<'n>,
}

impl<'n> Matters<'_, 'n> {
    /// The matter of the innermost of nested tables: each key from the innermost that has it.
    pub fn of(&self, nested: &[&Section<'n>]) -> Result<Matter> {
        let all = || nested.iter().copied().chain([self.root]);
        let find = |key: &str| all().find_map(|s| s.get(key));
        let material = find("material").ok_or_else(|| {
            let inner = nested.first().map_or_else(|| self.root.spot(), |s| s.spot());
            inner.wrong("there is no material", "add material = \"Pyroceram\", a file, or { unit = \"GPa\", … }")
        })?;
        let material_spot = material.spot();
        let (stiffness, own_density) = self.material(material)?;
        let density = find("density").map(|v| v.positive_quantity(Dimension::Density)).transpose()?.or(own_density);
        let turn = find("orientation").map(|v| orientation_of(v.node, &v.path)).transpose()?;
        let fracture = find("fracture").map(|v| fracture(v, self.shapes)).transpose()?.flatten();
        if fracture.is_some() && stiffness.norm() == 0.0 {
            return Err(material_spot.wrong("the material has no stiffness", "give one, or fracture = \"none\""));
        }
        Ok(Matter { stiffness, density, fracture, turn: turn.unwrap_or_else(Matrix3::identity) })
    }

    /// A name, a path, `{ file, row, unit }`, or the keys of a material file.
    fn material(&self, value: Value<'n>) -> Result<(Stiffness, Option<f64>)> {
        let at = |e: Error| value.spot().at(e);
        let found = |name: &str, row: Option<&str>, unit: Option<&str>| {
            let path = self.shapes.path(name);
            let named = if path.exists() { path.to_string_lossy().into_owned() } else { name.to_string() };
            find_material(&named, row, unit).map_err(at)
        };
        let material = if value.is_text() {
            found(value.text()?, None, None)?
        } else if value.is_table() && value.node.get("file").is_some() {
            let table = value.clone().section(&["file", "row", "unit"])?;
            let text = |key: &str| table.get(key).map(|v| v.text()).transpose();
            found(text("file")?.unwrap_or(""), text("row")?, text("unit")?)?
        } else if value.is_table() {
            material_of(value.node, &Habits::default()).map_err(|e| e.at(&value.path))?
        } else {
            let problem = format!("a material is needed, not {}", value.node.described());
            return Err(value.wrong(problem, "write a built-in name, a path, or the keys of a material file in { … }"));
        };
        Ok((material.stiffness, material.density))
    }

    /// `[[region]]`s; without any, the whole body is one, named "body".
    pub fn regions(&self) -> Result<Vec<RegionStatement>> {
        let tables = self.root.tables("region")?;
        if tables.is_empty() {
            let matter = self.of(&[])?;
            let (spot, filling) = (self.root.spot(), Filling::One(matter));
            return Ok(vec![RegionStatement { spot, name: "body".into(), solid: None, over: false, filling }]);
        }
        if let Some(value) = tables.get(MOST_REGIONS) {
            let problem = format!("there are more than {MOST_REGIONS} regions");
            return Err(value.wrong(problem, "use grains or layers for many parts"));
        }
        let mut regions: Vec<RegionStatement> = Vec::new();
        for (n, value) in tables.into_iter().enumerate() {
            let region = self.region(value, n)?;
            if regions.iter().any(|r| r.name == region.name) {
                let problem = format!("two regions are called {}", quoted(&region.name));
                return Err(region.spot.wrong(problem, "give each a name of its own"));
            }
            if region.solid.is_none() && regions.iter().any(|r| r.solid.is_none()) {
                return Err(region.spot.wrong("two regions have no solid", "only one can be all the rest"));
            }
            regions.push(region);
        }
        Ok(regions)
    }

    fn region(&self, value: Value<'n>, number: usize) -> Result<RegionStatement> {
        let mut keys = vec!["name", "solid", "over", "grains", "layers"];
        keys.extend(MATTER_KEYS);
        let table = value.section(&keys)?;
        let filling = match table.only(&["grains", "layers"])? {
            None => Filling::One(self.of(&[&table])?),
            Some(("grains", grains)) => self.grains(grains, &table)?,
            Some((_, layers)) => self.layers(layers, &table)?,
        };
        Ok(RegionStatement {
            spot: table.spot(),
            name: name_of(&table, "region", number)?,
            solid: table.get("solid").map(|v| self.shapes.solid(&v)).transpose()?,
            over: table.get("over").map(|v| v.truth()).transpose()?.unwrap_or(false),
            filling,
        })
    }

    fn grains(&self, value: Value<'n>, region: &Section<'n>) -> Result<Filling> {
        let spot = value.spot();
        let table = value.section(&["number", "seed", "orientations"])?;
        let number = table.need("number", "number = 20")?.whole(1)?;
        let seed = table.get("seed").map(|v| v.whole(0)).transpose()?.unwrap_or(0) as u64;
        let orientations = match table.get("orientations") {
            None => Orientations::Random,
            Some(v) if v.is_text() && v.text()? == "random" => Orientations::Random,
            Some(v) => {
                let rows = self.orientations(&v)?;
                if rows.len() < number {
                    let problem = format!("there are {} orientations for {number} grains", rows.len());
                    return Err(v.wrong(problem, "give one for each grain"));
                }
                Orientations::Table(rows)
            }
        };
        Ok(Filling::Grains { spot, number, seed, orientations, matter: self.of(&[region])? })
    }

    /// A list of orientations, or a CSV file of Bunge angles.
    fn orientations(&self, value: &Value<'n>) -> Result<Vec<Matrix3<f64>>> {
        if value.is_text() {
            let path = self.shapes.path(value.text()?);
            return bunge_rows(&path).map_err(|e| value.spot().at(e));
        }
        let items = value.items("\"random\", a CSV file, or [{ bunge = [10, 20, 30] }, …]")?;
        items.iter().map(|v| orientation_of(v.node, &v.path)).collect()
    }

    fn layers(&self, value: Value<'n>, region: &Section<'n>) -> Result<Filling> {
        let spot = value.spot();
        let table = value.section(&["axis", "start", "layup", "repeat"])?;
        let axis = table.need("axis", "axis = \"z\"")?.axis()?;
        let start = table.get("start").map(|v| v.quantity(Dimension::Length)).transpose()?;
        let repeat = table.get("repeat").map(|v| v.whole(1)).transpose()?.unwrap_or(1);
        let layup = table.need("layup", "layup = [{ thickness = \"1 mm\", angle = 0 }, …]")?;
        let mut layers = Vec::new();
        for item in layup.items("layup = [{ thickness = \"1 mm\", angle = 0 }, …]")? {
            let mut keys = vec!["thickness", "angle"];
            keys.extend(MATTER_KEYS);
            let layer = item.section(&keys)?;
            let thickness = layer.need("thickness", "thickness = \"1 mm\"")?.positive_quantity(Dimension::Length)?;
            let mut matter = self.of(&[&layer, region])?;
            if let Some((_, angle)) = layer.only(&["angle", "orientation"])?.filter(|(key, _)| *key == "angle") {
                let value =
                    if angle.is_text() { angle.quantity(Dimension::Angle)? } else { angle.number()?.to_radians() };
                let mut normal = Vector3::zeros();
                normal[axis] = value;
                matter.turn = *nalgebra::Rotation3::new(normal).matrix() * matter.turn;
            }
            layers.push((thickness, matter));
        }
        if layers.is_empty() || layers.len().saturating_mul(repeat) > MOST_LAYERS {
            let problem = format!("there are {} layers, {repeat} times", layers.len());
            return Err(layup.wrong(problem, format!("give at least one, and at most {MOST_LAYERS} in all")));
        }
        Ok(Filling::Layers { spot, axis, start, layers, repeat })
    }
}

/// The name of the n-th of a list of tables.
pub(super) fn name_of(table: &Section, what: &str, number: usize) -> Result<String> {
    let Some(value) = table.get("name") else { return Ok(format!("{what} {}", number + 1)) };
    let name = value.text()?.trim();
    if name.is_empty() || name.chars().any(char::is_control) {
        return Err(value.wrong(format!("{} is no name", quoted(name)), "write letters and digits"));
    }
    Ok(name.to_string())
}

/// `fracture = { energy = … }`, `{ directional = … }`, `{ stretch = … }`, or "none".
fn fracture(value: Value, shapes: &Shapes) -> Result<Option<FractureEnergy>> {
    if value.is_text() && value.text()? == "none" {
        return Ok(None);
    }
    let spot = value.spot();
    let forms = ["energy", "directional", "stretch"];
    let table = value.section(&forms)?;
    Ok(Some(match table.only(&forms)? {
        Some(("energy", v)) => FractureEnergy::Isotropic(v.positive_quantity(Dimension::SurfaceEnergy)?),
        Some(("stretch", v)) => FractureEnergy::Stretch(v.positive()?),
        Some((_, v)) if v.is_text() => {
            let path = shapes.path(v.text()?);
            let rows = number_rows::<4>(&path, "n1, n2, n3, G (J/m2)").map_err(|e| v.spot().at(e))?;
            let row =
                |[x, y, z, g]: [f64; 4]| Some((Vector3::new(x, y, z).try_normalize(0.0)?, g)).filter(|r| r.1 > 0.0);
            let rows: Option<Vec<_>> = rows.into_iter().map(row).collect();
            let remedy = "give a normal that is not zero and an energy above 0 on every line";
            FractureEnergy::Directional(rows.ok_or_else(|| v.wrong("a line has no normal or no energy", remedy))?)
        }
        Some((_, v)) => {
            let row = |item: Value| -> Result<(Vector3<f64>, f64)> {
                let table = item.section(&["normal", "energy"])?;
                let normal = table.need("normal", "normal = [0, 0, 1]")?.direction()?;
                let energy = table.need("energy", "energy = \"3.8 J/m2\"")?;
                Ok((normal, energy.positive_quantity(Dimension::SurfaceEnergy)?))
            };
            let items = v.items("[{ normal = [0, 0, 1], energy = \"3.8 J/m2\" }, …]")?;
            if items.is_empty() {
                return Err(v.wrong("the table of energies is empty", "give at least one normal and its energy"));
            }
            FractureEnergy::Directional(items.into_iter().map(row).collect::<Result<_>>()?)
        }
        None => return Err(spot.wrong("there is no energy", "add energy = \"3.8 J/m2\", directional or stretch")),
    }))
}

/// Lines of φ1, Φ, φ2 (degrees, Bunge) as rotations.
fn bunge_rows(path: &Path) -> Result<Vec<Matrix3<f64>>> {
    let rows = number_rows::<3>(path, "phi1, Phi, phi2 in degrees")?;
    rows.into_iter().map(|angles| Orientation::Bunge(angles.map(f64::to_radians)).matrix()).collect()
}

/// Rows of N finite numbers of a CSV file, after at most one heading.
pub(super) fn number_rows<const N: usize>(path: &Path, what: &str) -> Result<Vec<[f64; N]>> {
    let text = read_text(path)?;
    let mut rows = Vec::new();
    for (n, record) in csv_reader(&text).records().enumerate() {
        let remedy = format!("write {what} on every line");
        let at = |e: Error| e.at(path.display());
        let record = record.map_err(|e| at(Error::input(format!("the table cannot be read: {e}"), remedy.as_str())))?;
        let line = record.position().map_or(0, csv::Position::line);
        let numbers: Vec<f64> = record.iter().filter_map(|f| f.parse().ok()).filter(|x: &f64| x.is_finite()).collect();
        match <[f64; N]>::try_from(numbers) {
            Ok(row) if record.len() == N => rows.push(row),
            Err(none) if none.is_empty() && n == 0 => {}
            _ => {
                let fields: Vec<&str> = record.iter().collect();
                let problem = format!("{} are not {N} numbers", quoted(&fields.join(", ")));
                return Err(at(Error::input(problem, remedy).at(format!("line {line}"))));
            }
        }
    }
    if rows.is_empty() {
        return Err(Error::input("the table is empty", format!("write {what} on every line")).at(path.display()));
    }
    Ok(rows)
}

/// Name of an axis.
pub(super) fn axis_name(axis: usize) -> &'static str {
    AXES[axis].0
}
