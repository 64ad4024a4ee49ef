//! Material files: a stiffness in any of the ways people write one, in TOML or JSON.
//!
//! ```toml
//! name = "my rock"
//! unit = "MPa"                # of every bare number of stress; "130 MPa" in quotes needs none
//! class = "transversely-isotropic"
//! axis = [0, 0, 1]            # where e3 points; or: orientation = { strike = 270, dip = 25 }
//! c11 = 130
//! c33 = 55
//! c13 = 28
//! c12 = 40
//! c44 = 32.25
//! density = "2650 kg/m3"
//! source = "laboratory report 12"
//! ```
//! Instead of the components: `stiffness` or `compliance` (a matrix, with `order`), or a table `[engineering]`. Exactly
//! one of these forms. See [`parse_material`].

mod bare;
pub(super) mod components;
mod digits;
pub(super) mod engineering;
mod form;
pub mod record;
pub(super) mod matrix;
mod text;
pub(super) mod foreign;
pub(super) mod keys;
pub(super) mod shapes;

use std::path::Path;

use nalgebra::{Matrix3, Vector3};

use self::bare::{Units, units_of};
use crate::orientation::{orientation_of, smallest_rotation};
use crate::tree::Kind;
use crate::tree::{Entry, Node, parse_json, parse_toml, place, read_text, without_mark};
use crate::units::Dimension;
use crate::words::{number, quoted, suggestion};
use anisobond::tensor::{Material, Stiffness, SymmetryClass};
use anisobond::{Error, Result};

pub(super) use form::Form;

pub use bare::{Habits, StressUnit};
pub use text::material_text;

/// Every key of a material file but c11…c66.
const KEYS: [&str; 11] = [
    "name",
    "unit",
    "stiffness",
    "compliance",
    "order",
    "class",
    "axis",
    "orientation",
    "engineering",
    "density",
    "source",
];

/// Longest text (bytes) that is taken for a material file before all else.
const MOST_BYTES: usize = 1 << 20;

/// Keys that others have, too.
const COMMON: [&str; 3] = ["name", "density", "source"];

/// A material, and what its text was taken for.
#[derive(Clone, Debug)]
pub struct Reading {
    /// The material.
    pub material: Material,
    /// Format, what was taken from it, unit and order, in words: "VASP OUTCAR, TOTAL ELASTIC MODULI, kbar, order XX YY ZZ XY YZ
    /// ZX".
    pub read_as: String,
    /// What was made of numbers that are not what they should be to the last digit: "made symmetric …"; empty where nothing was.
    pub notes: Vec<String>,
}

/// Reads a material file: TOML, JSON, or another program's text. See [`parse_reading`].
///
/// # Errors
/// A file that cannot be read or is not UTF-8, or what [`parse_reading`] refuses.
pub fn read_material(path: impl AsRef<Path>) -> Result<Material> {
    read_reading(path, None).map(|reading| reading.material)
}

/// As [`read_material`], with the unit of numbers for which the file names none, and what the file was taken for.
///
/// # Errors
/// As [`read_material`].
pub fn read_reading(path: impl AsRef<Path>, unit: Option<&str>) -> Result<Reading> {
    let path = path.as_ref();
    parse_reading(&read_text(path)?, &path.display().to_string(), unit)
}

/// As [`parse_reading`], the material alone.
///
/// # Errors
/// As [`parse_reading`].
pub fn parse_material(text: &str, place: &str) -> Result<Material> {
    parse_reading(text, place, None).map(|reading| reading.material)
}

/// A material from the text of a file, known by what stands in it; `place` names the file in messages, `unit` is the unit of
/// numbers for which the text names none. JSON if the name ends in `.json` or the text begins as JSON does; TOML; else the text
/// of another program (`foreign`). Without `name`, the material is called after the file.
///
/// Keys: `name`, `unit`, `density` ("2650 kg/m3"), `source`, and exactly one of
/// - `stiffness`: six rows of six numbers; or rows of 6, 5, 4, 3, 2, 1 (upper triangle); or a full matrix whose lower
///   triangle is zero; or one list of 21 or 36; or all 3×3×3×3 components. `order` = "voigt" (11 22 33 23 13 12, default),
///   "abaqus" (11 22 33 12 13 23; a list of 21 is then the ANISOTROPIC card, column by column), "lammps" (xx yy zz xy xz yz),
///   "vasp" (xx yy zz xy yz zx), "mandel", or the six rows spelled out.
/// - `compliance`: the same shapes; a bare number is in 1/`unit`, engineering shear strains (s44 = 1/G23).
/// - `c11` … `c66`: with `class`, the constants that determine it, the others implied and checked; without, at least the
///   nine of orthotropy, the others zero.
/// - `[engineering]`: `e nu g k lambda` (two of them), or `ex ey ez gyz gzx gxy nu_xy nu_yz nu_zx` as far as `class` needs
///   them; ν_ij = −ε_j/ε_i under stress along i.
///
/// `class` with a matrix is a claim that is checked. `axis` (direction of e₃; for transversely isotropic, tetragonal and
/// trigonal materials) or `orientation` ([`crate::orientation`]) turns the material. A JSON object of the Materials
/// Project (`elastic_tensor`, in GPa) is read as a row of a table.
///
/// # Errors
/// A syntax error (file:line:column), an unknown or repeated key, two forms or none, a number without unit, a wrong unit or
/// shape, a contradiction or a missing constant, what may be read in two ways, or a stiffness that is not positive definite.
/// All name file, line and key.
pub fn parse_reading(text: &str, place: &str, unit: Option<&str>) -> Result<Reading> {
    let text = without_mark(text);
    let path = Path::new(place);
    let unit = unit.map(StressUnit::named).transpose().map_err(|e| e.at("unit"))?;
    let json = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) || shapes::begins_as_json(text);
    let read = if json { of_json(text, place, unit.as_ref()) } else { of_text(text, place, unit.as_ref()) };
    read.map(|mut reading| {
        let name = &mut reading.material.name;
        if name.is_empty() {
            *name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        }
        reading
    })
}

/// The material of a JSON document: a record, the keys of a material file, or a bare list of components.
fn of_json(text: &str, place: &str, unit: Option<&StressUnit>) -> Result<Reading> {
    let root = match parse_json(text, place) {
        // Python's and MATLAB's lists are not quite JSON's.
        Err(e) if !text.trim_start().starts_with('{') => {
            return foreign::read(&foreign::Source { text, place, unit }).unwrap_or(Err(e));
        }
        root => root?,
    };
    if shapes::is_tensor(&root) {
        let Some(unit) = unit else {
            return Err(foreign::missing_unit(shapes::largest(&root)).at(place));
        };
        let table = shapes::with_key("stiffness", &root);
        let habits = Habits { unit: Some(unit.clone()), scatter: record::SCATTER, ..Habits::default() };
        return reading_of(&table, &habits, "JSON list").map_err(|e| e.at(place));
    }
    if let Some(mut rows) = shapes::rows(&root) {
        if rows.len() != 1 {
            let problem = format!("the file holds {} materials, not one material", rows.len());
            return Err(Error::input(problem, "it is a table").at(place));
        }
        return record::reading_of_record(&rows.remove(0).1, unit).map_err(|e| e.at(place));
    }
    if !matches!(root.kind, Kind::Table(_)) {
        return Err(Error::input(
            format!("the file holds {}, not one material", root.described()),
            "write one object { … }; a list of materials is a table",
        )
        .at(place));
    }
    if record::is_record(&root) {
        return record::reading_of_record(&root, unit).map_err(|e| e.at(place));
    }
    let habits = Habits { asked: unit.cloned(), scatter: record::SCATTER, ..Habits::default() };
    reading_of(&root, &habits, "material file").map_err(|e| e.at(place))
}

/// The material of a TOML document, or of another program's text.
fn of_text(text: &str, place: &str, unit: Option<&StressUnit>) -> Result<Reading> {
    // The reader of TOML needs dozens of times the memory of its text.
    if text.len() > MOST_BYTES && !names_own_keys(text) {
        let none = || {
            let problem = "the text is none of the formats that are known, and too long for a material file";
            Error::input(problem, format!("give a material file, a table, or {}", foreign::names())).at(place)
        };
        return foreign::read(&foreign::Source { text, place, unit }).unwrap_or_else(|| Err(none()));
    }
    let parsed = parse_toml(text, place);
    let known = |root: &Node| root.entries().iter().any(|e| !COMMON.contains(&e.key.as_str()) && known_key(e).is_ok());
    let own = parsed.as_ref().is_ok_and(known) || names_own_keys(text);
    if !own && let Some(found) = foreign::read(&foreign::Source { text, place, unit }) {
        return found;
    }
    let root = parsed.map_err(|e| {
        if own {
            return e;
        }
        Error::input(
            format!("{e}; and it is none of the other formats that are known"),
            format!("give a material file, a table, or {}", foreign::names()),
        )
    })?;
    let habits = Habits { asked: unit.cloned(), scatter: record::SCATTER, ..Habits::default() };
    reading_of(&root, &habits, "material file").map_err(|e| e.at(place))
}

/// Whether a text that may be broken was meant as a material file.
fn names_own_keys(text: &str) -> bool {
    text.lines().take(1000).any(|line| {
        let key = line.split_once('=').map_or("", |(key, _)| key.trim());
        (KEYS.contains(&key) && !COMMON.contains(&key)) || line.trim() == "[engineering]"
    })
}

/// A symmetry class by its name, as in files and on the command line. Also "hexagonal" and "transverse-isotropic"
/// (transversely isotropic), "orthorhombic" (orthotropic); spaces or underscores for dashes, any letter case.
///
/// # Errors
/// An unknown name, with the nearest valid one.
pub fn parse_class(name: &str) -> Result<SymmetryClass> {
    let plain = name.trim().to_lowercase().replace([' ', '_'], "-");
    let plain = match plain.as_str() {
        "hexagonal" | "transverse-isotropic" => "transversely-isotropic",
        "orthorhombic" => "orthotropic",
        other => other,
    };
    SymmetryClass::ALL.into_iter().find(|class| class.name() == plain).ok_or_else(|| {
        let names: Vec<&str> = SymmetryClass::ALL.iter().map(|class| class.name()).collect();
        Error::input(format!("unknown symmetry class {}", quoted(name)), suggestion(plain, &names))
    })
}

/// The material of a table.
pub fn material_of(table: &Node, habits: &Habits) -> Result<Material> {
    reading_of(table, habits, "").map(|reading| reading.material)
}

/// The material of a table, and what it was taken for; `what` is what the table is.
pub(super) fn reading_of(table: &Node, habits: &Habits, what: &str) -> Result<Reading> {
    if !habits.unknown_keys {
        table.entries().iter().try_for_each(known_key)?;
    }
    let form = Form::only(table, None)?;
    reading_in_form(table, &form, habits, what)
}

/// The material of a table whose stiffness is given in a form.
pub(super) fn reading_in_form(table: &Node, form: &Form, habits: &Habits, what: &str) -> Result<Reading> {
    let units = units_of(table, form, habits)?;
    let claimed = claimed_class(table)?;
    refuse_useless_order(table, form)?;
    let Own { stiffness: own, class, words, notes } = own_stiffness(table, form, &units, claimed, habits.scatter)?;
    let stiffness = orientation(table, class)?.map_or(own, |q| own.rotated(&q));
    let at = form.entry();
    stiffness.require_positive_definite().map_err(|e| e.at(place(at.line, &at.key)))?;
    let material = Material {
        name: text_of(table, "name")?,
        stiffness,
        density: density_of(table, habits.density)?,
        source: text_of(table, "source")?,
    };
    let turned = ["axis", "orientation"].iter().find_map(|key| table.get(key));
    let turned = turned.map_or(String::new(), |entry| format!(", turned by {}", entry.key));
    let adjusted: String = notes.iter().map(|note| format!(", {note}")).collect();
    Ok(Reading { material, read_as: format!("{what}, {words}{adjusted}{turned}"), notes })
}

fn known_key(entry: &Entry) -> Result<()> {
    if KEYS.contains(&entry.key.as_str()) || components::component_of(&entry.key).is_some() {
        return Ok(());
    }
    let mut all = KEYS.to_vec();
    let names = components::names();
    all.extend(names.iter().map(String::as_str));
    let remedy = match crate::words::nearest_key(&entry.key, all.iter().copied()) {
        Some(name) => format!("did you mean {name}?"),
        None if component_like(&entry.key, 's') => "give compliances as a matrix under compliance".into(),
        None if component_like(&entry.key, 'c') => "components are c11 … c66, in Voigt's indices".into(),
        None => crate::words::known_elsewhere(&entry.key)
            .map(|own| if engineering::names(&entry.key) { format!("{own}, below [engineering]") } else { own })
            .unwrap_or_else(|| match engineering::names(&entry.key) {
                true => format!("put {} below [engineering]", entry.key),
                false => format!("use one of {}, c11 … c66", KEYS.join(", ")),
            }),
    };
    Err(Error::input(format!("unknown key {}", quoted(&entry.key)), remedy).at(format!("line {}", entry.line)))
}

/// Whether a key is a letter and a component's two or four digits.
fn component_like(key: &str, letter: char) -> bool {
    let mut rest = key.trim().chars().filter(|c| *c != '_');
    let first = rest.next().is_some_and(|c| c.eq_ignore_ascii_case(&letter));
    let digits: String = rest.collect();
    first && matches!(digits.len(), 2 | 4) && digits.chars().all(|c| c.is_ascii_digit())
}

/// Whether a key is one of a material file, in any letter case, but those that databases have for other things.
fn is_known(key: &str) -> bool {
    let key = key.to_lowercase();
    let form = ["stiffness", "compliance", "engineering", "unit", "class"].contains(&key.as_str());
    form || components::component_of(&key).is_some()
}

/// The text under a key, empty if absent.
pub(super) fn text_of(table: &Node, key: &str) -> Result<String> {
    table.get(key).map_or_else(|| Ok(String::new()), |entry| entry.value.text(key).map(str::to_string))
}

fn claimed_class(table: &Node) -> Result<Option<SymmetryClass>> {
    let Some(entry) = table.get("class") else { return Ok(None) };
    parse_class(entry.value.text("class")?).map(Some).map_err(|e| e.at(place(entry.line, "class")))
}

fn refuse_useless_order(table: &Node, form: &Form) -> Result<()> {
    match (table.get("order"), form) {
        (None, _) | (_, Form::Stiffness(_) | Form::Compliance(_)) => Ok(()),
        (Some(entry), _) => {
            Err(Error::input("order says nothing here", "remove it: it is for stiffness and compliance")
                .at(place(entry.line, "order")))
        }
    }
}

/// What a form says.
struct Own {
    /// In the material's own axes (Pa).
    stiffness: Stiffness,
    /// Named or implied.
    class: Option<SymmetryClass>,
    /// Form, unit and order in words.
    words: String,
    /// What was adjusted, and by how much.
    notes: Vec<String>,
}

fn own_stiffness(
    table: &Node,
    form: &Form,
    units: &Units,
    claimed: Option<SymmetryClass>,
    scatter: f64,
) -> Result<Own> {
    let unit = match (&units.stress, units.compliance) {
        (Some(unit), _) => unit.name.clone(),
        (None, Some(_)) => table.get("unit").map_or(String::new(), |e| e.value.text("unit").unwrap_or("").into()),
        (None, None) => "each number with its unit".into(),
    };
    let of_class = claimed.map_or(String::new(), |class| format!(", class {}", class.name()));
    match form {
        Form::Engineering(entry) => {
            let (stiffness, class, notes) = engineering::stiffness_of(&entry.value, units, claimed)?;
            let words = format!("engineering constants, {unit}, class {}", class.name());
            Ok(Own { stiffness, class: Some(class), words, notes })
        }
        Form::Components(entry) => {
            let (stiffness, off) = components::stiffness_of(table, entry, units, claimed)?;
            let words = format!("c11 … c66 by name, {unit}, order 11 22 33 23 13 12{of_class}");
            Ok(Own { stiffness, class: claimed, words, notes: off.into_iter().collect() })
        }
        Form::Stiffness(entry) | Form::Compliance(entry) => {
            let order = matrix::Order::of(table)?;
            let matrix = matrix::Given { node: &entry.value, key: &entry.key, order, scatter };
            let (stiffness, off) = match form {
                Form::Compliance(_) => matrix.compliance(|node, key| units.compliance(node, key))?,
                _ => matrix.stiffness(|node, key| units.stress(node, key))?,
            };
            let (stiffness, of_the_class) =
                of_claim(stiffness, claimed).map_err(|e| e.at(place(entry.line, &entry.key)))?;
            let symmetric = (off > matrix::ROUNDING)
                .then(|| format!("made symmetric (entries differ by up to {} % of the largest)", number(100.0 * off)));
            let indices = if shapes::is_full(&entry.value) {
                "3×3×3×3 components".into()
            } else {
                format!("order {}", order.words())
            };
            let words = format!("{}, {unit}, {indices}{of_class}", entry.key);
            Ok(Own { stiffness, class: claimed, words, notes: symmetric.into_iter().chain(of_the_class).collect() })
        }
    }
}

/// A matrix must be of the class it is said to be, to 1 % of its norm, as tables and computations are; the closest of the class is
/// taken, and if that is more than rounding, said.
pub(super) fn of_claim(stiffness: Stiffness, claimed: Option<SymmetryClass>) -> Result<(Stiffness, Option<String>)> {
    let Some(class) = claimed else { return Ok((stiffness, None)) };
    let nearest = components::Setting::of_matrix(class, &stiffness).project(&stiffness);
    let error = stiffness.relative_error(&nearest);
    if error <= components::CONTRADICTION || stiffness.norm() == 0.0 {
        return Ok((stiffness, None));
    }
    if error <= record::SCATTER {
        let note = format!("made {} (it was {} % of its norm away)", class.name(), number(100.0 * error));
        return Ok((nearest, Some(note)));
    }
    Err(Error::input(
        format!(
            "the matrix is not {}: it is {}% of its norm away from that class in its own axes",
            class.name(),
            number(100.0 * error)
        ),
        "correct the matrix, or remove class (a matrix needs none)",
    ))
}

/// Q of `axis` or `orientation`; `None` without either.
fn orientation(table: &Node, class: Option<SymmetryClass>) -> Result<Option<Matrix3<f64>>> {
    match (table.get("axis"), table.get("orientation")) {
        (None, None) => Ok(None),
        (Some(axis), Some(_)) => Err(Error::input("axis and orientation both turn the material", "keep one of them")
            .at(place(axis.line, "axis"))),
        (None, Some(entry)) => orientation_of(&entry.value, "orientation").map(Some),
        (Some(entry), None) => {
            use SymmetryClass::{Tetragonal, TransverselyIsotropic, Trigonal};
            match class {
                Some(TransverselyIsotropic | Tetragonal | Trigonal) => axis_rotation(&entry.value).map(Some),
                _ => Err(Error::input(
                    "axis is for class transversely-isotropic, tetragonal or trigonal",
                    "name that class, or turn the material with orientation = { x = […], z = […] }",
                )
                .at(place(entry.line, "axis"))),
            }
        }
    }
}

/// The smallest rotation that takes e₃ to `axis`.
fn axis_rotation(node: &Node) -> Result<Matrix3<f64>> {
    let numbers = node.list().filter(|items| items.len() == 3).ok_or_else(|| {
        node.wrong("axis", format!("three numbers are needed, not {}", node.described()), "write axis = [0, 0, 1]")
    })?;
    let v: Vec<f64> = numbers.iter().map(|n| n.number("axis")).collect::<Result<_>>()?;
    smallest_rotation(&Vector3::new(v[0], v[1], v[2])).map_err(|e| e.at(place(node.line, "axis")))
}

/// The density (kg/m³); `bare` is the unit of a number without one.
pub(super) fn density_of(table: &Node, bare: Option<f64>) -> Result<Option<f64>> {
    let Some(entry) = table.get("density") else { return Ok(None) };
    let node = &entry.value;
    let value = match (&node.kind, bare) {
        (Kind::Text(text), _) => Dimension::Density.parse(text).map_err(|e| e.at(place(node.line, "density")))?,
        (_, Some(unit)) => node.number("density")? * unit,
        (_, None) => {
            let value = node.number("density")?;
            return Err(node.wrong("density", format!("{value} has no unit"), "write density = \"2650 kg/m3\""));
        }
    };
    positive_density(value).map(Some).map_err(|e| e.at(place(node.line, "density")))
}

/// Refuses a density (kg/m³) that is not positive and finite.
pub(super) fn positive_density(value: f64) -> Result<f64> {
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(Error::input(format!("a density of {value} kg/m3 is not possible"), "give a positive one, or leave it out"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_example_of_this_page_is_read() {
        let page = include_str!("mod.rs").lines().filter_map(|line| line.strip_prefix("//! "));
        let example: Vec<&str> = page.skip_while(|l| *l != "```toml").skip(1).take_while(|l| *l != "```").collect();
        let rock = parse_material(&example.join("\n"), "example.toml").unwrap();
        assert_eq!((rock.name.as_str(), rock.density), ("my rock", Some(2650.0)));
        assert!((rock.stiffness.voigt()[(2, 2)] / 55e6 - 1.0).abs() < 1e-15);
    }
}
