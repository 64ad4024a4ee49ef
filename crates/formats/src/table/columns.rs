//! Where a CSV table has what, and the materials of its rows.

use std::collections::HashSet;

use nalgebra::Matrix6;

use super::Row;
use super::heading::{
    Heading, constant, names_constants, refuse_both_forms, refuse_half_named, refuse_missing, refuse_near,
    refuse_second_form, stress_unit,
};
use crate::csv_text::unguarded;
use crate::material::components::{Component, component_of, name};
use crate::material::foreign::figure::{Figure, plain_number};
use crate::material::foreign::thomsen::{NAMES as THOMSEN, dimension, parameter, stiffness as thomsen};
use crate::material::matrix::refuse_reordered;
use crate::material::{Habits, Reading, StressUnit, of_claim, parse_class, positive_density, reading_of};
use crate::orientation::parse_orientation;
use crate::tree::{Entry, Kind, Node};
use crate::units::{Dimension, split};
use crate::words::quoted;
use anisobond::tensor::{Material, Stiffness, SymmetryClass};
use anisobond::{Error, Result};

/// Where a CSV table has what.
pub(super) struct Columns {
    width: usize,
    id: Option<usize>,
    name: Option<usize>,
    unit: Option<usize>,
    /// The unit asked for beside the file.
    asked: Option<StressUnit>,
    order: Option<usize>,
    class: Option<usize>,
    orientation: Option<usize>,
    source: Option<usize>,
    /// (column, unit in Pa) of c11 … c66, and the heading for messages.
    components: Vec<(Component, Column)>,
    density: Option<Column>,
    /// Thomsen's parameters in the order of their names, if these are given instead of components.
    thomsen: Option<Vec<Column>>,
    /// Engineering constants (key, whether it is a ratio), if these are given instead of components.
    engineering: Vec<(String, bool, Column)>,
    /// Whether a comma is a decimal mark.
    comma: bool,
}

pub(super) struct Column {
    pub(super) at: usize,
    /// Size of a bare number in SI, where the heading names it.
    pub(super) unit: Option<f64>,
    pub(super) heading: String,
}

impl Columns {
    /// The columns of a header.
    pub(super) fn of(header: &csv::StringRecord, unit: Option<&StressUnit>, comma: bool) -> Result<Self> {
        let headings: Vec<Heading> = header.iter().map(Heading::of).collect();
        let mut seen = HashSet::new();
        if let Some(twice) = headings.iter().find(|h| !h.name.is_empty() && !seen.insert(h.name.as_str())) {
            let heading = quoted(twice.text);
            return Err(Error::input(format!("column {heading} is there twice"), "keep one of them"));
        }
        let thomsen = thomsen_columns(&headings)?;
        let engineering = if thomsen.is_none() { engineering_columns(&headings, unit)? } else { Vec::new() };
        if thomsen.is_none() && engineering.is_empty() {
            refuse_missing(&headings)?;
        }
        refuse_both_forms(&headings)?;
        refuse_second_form(&headings)?;
        refuse_near(&headings)?;
        let find = |name: &str| headings.iter().position(|h| h.name == name);
        let first = |names: &[&str]| names.iter().find_map(|name| find(name));
        let component = |(at, h): (usize, &Heading)| {
            Some(component_of(&h.name)?)
                .map(|c| Ok((c, Column { at, unit: stress_unit(h, unit)?, heading: h.text.into() })))
        };
        let components: Vec<_> = headings.iter().enumerate().filter_map(component).collect::<Result<_>>()?;
        let stresses = components.iter().map(|(_, column)| column);
        let stresses = stresses.chain(engineering.iter().filter(|(_, ratio, _)| !ratio).map(|(.., column)| column));
        refuse_half_named(stresses, unit, first(&["unit", "units"]))?;
        Ok(Columns {
            width: headings.len(),
            id: first(&["material_id", "id", "name", "formula", "formula_pretty"]),
            name: first(&["name", "formula_pretty", "formula", "material_id", "id"]),
            unit: first(&["unit", "units"]),
            asked: unit.cloned(),
            order: find("order"),
            class: find("class"),
            orientation: find("orientation"),
            source: find("source"),
            components,
            density: match thomsen {
                Some(_) => None,
                None => find("density").map(|at| density_column(at, &headings[at])).transpose()?,
            },
            thomsen,
            engineering,
            comma,
        })
    }

    /// The row of a record.
    pub(super) fn row(&self, record: &csv::StringRecord, number: usize, line: usize, place: &str) -> Row {
        let text = |at: Option<usize>| at.and_then(|at| record.get(at)).filter(|text| !text.is_empty()).map(unguarded);
        let id = text(self.id).map_or_else(|| number.to_string(), str::to_string);
        let name = text(self.name).unwrap_or(&id).to_string();
        let reading = self.reading(record, name).map_err(|e| e.at(format!("{place}, line {line}")));
        Row::new(id, line, reading)
    }

    fn reading(&self, record: &csv::StringRecord, name: String) -> Result<Reading> {
        if record.len() != self.width {
            return Err(Error::input(
                format!("the row has {} fields, the header {}", record.len(), self.width),
                "give every column one field; put quotes around a text with a comma",
            ));
        }
        let text = |at: Option<usize>| at.and_then(|at| record.get(at)).filter(|text| !text.is_empty());
        let bare = self.unit_of(text(self.unit))?;
        if let Some(order) = text(self.order) {
            refuse_reordered(order).map_err(|e| e.at("column order"))?;
        }
        let claimed = text(self.class).map(parse_class).transpose().map_err(|e| e.at("column class"))?;
        let (own, what, mut notes) = match &self.thomsen {
            Some(columns) => (self.of_thomsen(record, columns)?, "Thomsen's parameters".to_string(), Vec::new()),
            None => self.own(record, &bare, claimed)?,
        };
        let (own, off) = of_claim(own, claimed).map_err(|e| e.at("column class"))?;
        notes.extend(off);
        let turned = text(self.orientation).map(|text| parse_orientation(text).map(|q| own.rotated(&q)));
        let stiffness = turned.transpose().map_err(|e| e.at("column orientation"))?.unwrap_or(own);
        stiffness.require_positive_definite()?;
        let density = match &self.density {
            Some(column) if record.get(column.at).is_some_and(|text| !text.is_empty()) => {
                let value = column.value(record, Dimension::Density, 1.0, self.comma)?;
                Some(positive_density(value).map_err(|e| e.at(&column.heading))?)
            }
            _ => match &self.thomsen {
                Some(columns) => Some(columns[2].value(record, Dimension::Density, 1.0, self.comma)?),
                None => None,
            },
        };
        let source = text(self.source).or(text(self.id)).unwrap_or("").to_string();
        Ok(Reading {
            material: Material { name, stiffness, density, source },
            read_as: format!("row of a table, {what}{}", notes.iter().map(|n| format!(", {n}")).collect::<String>()),
            notes,
        })
    }

    /// The stiffness of the components of a row: all 21, or as many as its class or orthotropy needs.
    fn own(
        &self,
        record: &csv::StringRecord,
        bare: &StressUnit,
        class: Option<SymmetryClass>,
    ) -> Result<(Stiffness, String, Vec<String>)> {
        let filled = |column: &Column| record.get(column.at).is_some_and(|text| !text.is_empty());
        let all = self.components.len() == 21 && (class.is_none() || self.components.iter().all(|(_, c)| filled(c)));
        let value = |column: &Column| column.value(record, Dimension::Stress, bare.size, self.comma);
        let headed = self.stresses().any(|c| c.unit.is_some());
        let unit = if headed { "units as the header has them".to_string() } else { bare.name.clone() };
        if all {
            let mut voigt = Matrix6::zeros();
            for ((a, b), column) in &self.components {
                let value = value(column)?;
                voigt[(*a, *b)] = value;
                voigt[(*b, *a)] = value;
            }
            let what = format!("c11 … c66, {unit}, order 11 22 33 23 13 12");
            return Ok((Stiffness::from_voigt(&voigt)?, what, Vec::new()));
        }
        if !self.engineering.is_empty() {
            return self.of_engineering(record, bare, class, &unit);
        }
        let mut entries = Vec::new();
        for (component, column) in self.components.iter().filter(|(_, column)| filled(column)) {
            let kind = Kind::Number(value(column)? / bare.size);
            entries.push(Entry { key: name(*component), line: 0, value: Node { kind, line: 0 } });
        }
        entries.extend(class.map(class_entry));
        let habits = Habits { unit: Some(bare.clone()), ..Habits::default() };
        let count = entries.len() - usize::from(class.is_some());
        let table = Node { kind: Kind::Table(entries), line: 0 };
        let Reading { material, notes, .. } = reading_of(&table, &habits, "").map_err(of_row)?;
        let of_class = class.map_or(", others zero".into(), |class| format!(", class {}", class.name()));
        let what = format!("{count} constants by name{of_class}, {unit}, order 11 22 33 23 13 12");
        Ok((material.stiffness, what, notes))
    }

    /// The columns of stresses.
    fn stresses(&self) -> impl Iterator<Item = &Column> {
        let moduli = self.engineering.iter().filter(|(_, ratio, _)| !ratio).map(|(.., column)| column);
        self.components.iter().map(|(_, column)| column).chain(moduli)
    }

    /// The stiffness of the engineering constants of a row; empty cells are not given.
    fn of_engineering(
        &self,
        record: &csv::StringRecord,
        bare: &StressUnit,
        class: Option<SymmetryClass>,
        unit: &str,
    ) -> Result<(Stiffness, String, Vec<String>)> {
        let mut entries = Vec::new();
        for (key, ratio, column) in &self.engineering {
            if record.get(column.at).is_none_or(str::is_empty) {
                continue;
            }
            let value = match ratio {
                true => column.plain(record, self.comma)?,
                false => column.value(record, Dimension::Stress, bare.size, self.comma)? / bare.size,
            };
            entries.push(Entry { key: key.clone(), line: 0, value: Node { kind: Kind::Number(value), line: 0 } });
        }
        let keys: Vec<&str> = entries.iter().map(|entry| entry.key.as_str()).collect();
        let read_as = format!("engineering constants {}, {unit}, ν_ij = −ε_j/ε_i", keys.join(" "));
        let constants = Node { kind: Kind::Table(entries), line: 0 };
        let mut all = vec![Entry { key: "engineering".into(), line: 0, value: constants }];
        all.extend(class.map(class_entry));
        let habits = Habits { unit: Some(bare.clone()), ..Habits::default() };
        let table = Node { kind: Kind::Table(all), line: 0 };
        let Reading { material, notes, .. } = reading_of(&table, &habits, "").map_err(of_row)?;
        Ok((material.stiffness, read_as, notes))
    }

    fn of_thomsen(&self, record: &csv::StringRecord, columns: &[Column]) -> Result<Stiffness> {
        let mut values = [0.0; 6];
        for (n, (value, column)) in values.iter_mut().zip(columns).enumerate() {
            *value = match dimension(n) {
                Some(dimension) => column.value(record, dimension, 1.0, self.comma)?,
                None => column.plain(record, self.comma)?,
            };
        }
        thomsen(values)
    }

    /// The unit of a row's bare stresses: its own, else the one asked for, else GPa.
    fn unit_of(&self, own: Option<&str>) -> Result<StressUnit> {
        let Some(name) = own else {
            return Ok(self.asked.clone().unwrap_or_else(StressUnit::giga_pascal));
        };
        let size = Dimension::Stress.unit(name).map_err(|e| e.at("column unit"))?;
        let headed = self.stresses().find_map(|c| c.unit.filter(|u| *u != size).map(|_| c.heading.as_str()));
        let asked = self.asked.as_ref().filter(|unit| unit.size != size).map(|unit| unit.name.as_str());
        match headed.or(asked) {
            None => Ok(StressUnit { name: name.trim().into(), size }),
            Some(other) => {
                let problem = format!("the row's unit {} contradicts {}", quoted(name), quoted(other));
                Err(Error::input(problem, "name the unit once, in one place").at("column unit"))
            }
        }
    }
}

impl Column {
    /// The field in SI: a bare number in the column's unit, else in one of size `bare`; or a number with its own.
    fn value(&self, record: &csv::StringRecord, what: Dimension, bare: f64, comma: bool) -> Result<f64> {
        let text = record.get(self.at).unwrap_or("");
        let pointed = if comma { text.replace(',', ".") } else { text.to_string() };
        let plain = plain_number(&pointed);
        let value = match Figure::of(&plain) {
            Some(figure) => what.bounded(figure.value * self.unit.unwrap_or(bare), text),
            None => split(&plain).and_then(|(number, unit)| match unit {
                "" => Ok(number * self.unit.unwrap_or(bare)),
                _ => what.parse(&plain),
            }),
        };
        value.map_err(|e| e.at(format!("column {}", self.heading)))
    }

    /// A number without unit.
    fn plain(&self, record: &csv::StringRecord, comma: bool) -> Result<f64> {
        let text = record.get(self.at).unwrap_or("");
        number(text, comma).ok_or_else(|| {
            Error::input(format!("{} is not a finite number", quoted(text)), "write a plain number")
                .at(format!("column {}", self.heading))
        })
    }
}

/// A bare number, its decimal mark a comma where that parts no columns.
fn number(text: &str, comma: bool) -> Option<f64> {
    let text = if comma { text.replace(',', ".") } else { text.to_string() };
    Figure::of(&text).map(|figure| figure.value)
}

/// `class` of a material.
fn class_entry(class: SymmetryClass) -> Entry {
    Entry { key: "class".into(), line: 0, value: Node { kind: Kind::Text(class.name().into()), line: 0 } }
}

/// An error of a row's components: a row has no lines of its own.
fn of_row(e: Error) -> Error {
    match e {
        Error::Failure { kind, problem, remedy, .. } => Error::Failure { kind, place: String::new(), problem, remedy },
        other => other,
    }
}

/// The columns of engineering constants, if there are any with a Young's modulus and no components.
fn engineering_columns(headings: &[Heading], asked: Option<&StressUnit>) -> Result<Vec<(String, bool, Column)>> {
    if !names_constants(headings) {
        return Ok(Vec::new());
    }
    let mut all: Vec<(String, bool, Column)> = Vec::new();
    for (at, heading) in headings.iter().enumerate() {
        let Some((key, ratio)) = constant(&heading.name) else { continue };
        let unit = match (ratio, heading.unit) {
            (true, Some(unit)) if !matches!(unit, "-" | "–" | "1") => {
                let problem = format!("column {} is a ratio and has no unit", quoted(heading.text));
                return Err(Error::input(problem, "remove the unit from its heading"));
            }
            (true, _) => None,
            (false, _) => stress_unit(heading, asked)?,
        };
        all.push((key, ratio, Column { at, unit, heading: heading.text.into() }));
    }
    Ok(all)
}

/// The columns of Thomsen's parameters, if there are any of speeds and no components.
fn thomsen_columns(headings: &[Heading]) -> Result<Option<Vec<Column>>> {
    let find = |n: usize| headings.iter().position(|h| parameter(&h.name) == Some(n));
    if headings.iter().any(|h| component_of(&h.name).is_some()) || find(0).is_none() || find(1).is_none() {
        return Ok(None);
    }
    let column = |n: usize| {
        let Some(at) = find(n) else {
            let problem = format!("column {} missing of Thomsen's parameters", THOMSEN[n][0]);
            return Err(Error::input(problem, "give Vp, Vs, density, epsilon, delta and gamma"));
        };
        let heading = &headings[at];
        let unit = match (dimension(n), heading.unit) {
            (Some(dimension), Some(unit)) => {
                Some(dimension.unit(unit).map_err(|e| e.at(format!("column {}", heading.text)))?)
            }
            (Some(dimension), None) => {
                let remedy = format!("name it in the header, as {} ({})", heading.text, dimension.usual());
                return Err(Error::input(format!("column {} has no unit", quoted(heading.text)), remedy));
            }
            (None, _) => None,
        };
        Ok(Column { at, unit, heading: heading.text.to_string() })
    };
    (0..6).map(column).collect::<Result<_>>().map(Some)
}

fn density_column(at: usize, heading: &Heading) -> Result<Column> {
    let Some(name) = heading.unit else {
        return Err(Error::input("column density has no unit", "name it in the header, as density (g/cm3)"));
    };
    let unit = Dimension::Density.unit(name).map_err(|e| e.at(format!("column {}", heading.text)))?;
    Ok(Column { at, unit: Some(unit), heading: heading.text.to_string() })
}
