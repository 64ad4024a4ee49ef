//! Tables and values of a case file, with the way to each for messages: "line 12, condition.0.traction".

use nalgebra::Vector3;

use anisobond::{Error, Result, Wording};
use anisobond_formats::tree::{Kind, Node, place};
use anisobond_formats::units::{Dimension, split};
use anisobond_formats::words::{quoted, suggestion};

/// Where a value stands.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Spot {
    line: usize,
    path: String,
}

impl Spot {
    /// Wrong input here.
    pub fn wrong(&self, problem: impl Into<String>, remedy: impl Into<Wording>) -> Error {
        self.at(Error::input(problem, remedy))
    }

    /// An error, placed here.
    pub fn at(&self, error: Error) -> Error {
        error.at(place(self.line, &self.path))
    }
}

/// A value and the dotted way to it.
#[derive(Clone, Debug)]
pub(super) struct Value<'n> {
    pub node: &'n Node,
    pub path: String,
}

/// A table whose keys are all known.
#[derive(Clone, Debug)]
pub(super) struct Section<'n>(Value<'n>);

impl<'n> Section<'n> {
    /// The value of a key.
    pub fn get(&self, key: &str) -> Option<Value<'n>> {
        let entry = self.0.node.get(key)?;
        let path = if self.0.path.is_empty() { key.into() } else { format!("{}.{key}", self.0.path) };
        Some(Value { node: &entry.value, path })
    }

    /// The value of a key that must be there.
    pub fn need(&self, key: &str, example: &str) -> Result<Value<'n>> {
        self.get(key).ok_or_else(|| {
            let name = if self.0.path.is_empty() { "the case".into() } else { self.0.path.clone() };
            self.spot().wrong(format!("{name} has no {key}"), format!("add {example}"))
        })
    }

    /// The one key of several that is there.
    pub fn only<'k>(&self, keys: &[&'k str]) -> Result<Option<(&'k str, Value<'n>)>> {
        let mut found = keys.iter().filter_map(|&key| Some((key, self.get(key)?)));
        let first = found.next();
        if let (Some((first, _)), Some((second, value))) = (&first, found.next()) {
            return Err(value.wrong(format!("{first} and {second} are both given"), "keep one of them"));
        }
        Ok(first)
    }

    /// The values of a list of tables, `[[key]]`; none if absent.
    pub fn tables(&self, key: &str) -> Result<Vec<Value<'n>>> {
        self.get(key).map_or_else(|| Ok(Vec::new()), |value| value.items(&format!("[[{key}]]")))
    }

    /// Keys in the order of the file.
    pub fn keys(&self) -> impl Iterator<Item = &'n str> {
        self.0.node.entries().iter().map(|e| e.key.as_str())
    }

    pub fn spot(&self) -> Spot {
        self.0.spot()
    }
}

impl<'n> Value<'n> {
    pub fn spot(&self) -> Spot {
        Spot { line: self.node.line, path: if self.path.is_empty() { "top".into() } else { self.path.clone() } }
    }

    pub fn wrong(&self, problem: impl Into<String>, remedy: impl Into<Wording>) -> Error {
        self.spot().wrong(problem, remedy)
    }

    pub fn is_table(&self) -> bool {
        matches!(self.node.kind, Kind::Table(_))
    }

    pub fn is_text(&self) -> bool {
        matches!(self.node.kind, Kind::Text(_))
    }

    /// A table; a key that is not one of `keys` is an error.
    pub fn section(self, keys: &[&str]) -> Result<Section<'n>> {
        let section = self.table(keys)?;
        for entry in section.0.node.entries() {
            if !keys.contains(&entry.key.as_str()) {
                let place = Spot { line: entry.line, path: section.path_of(&entry.key) };
                return Err(place.wrong(format!("unknown key {}", quoted(&entry.key)), suggestion(&entry.key, keys)));
            }
        }
        Ok(section)
    }

    /// A table of any keys; `keys` for the message only.
    pub fn table(self, keys: &[&str]) -> Result<Section<'n>> {
        if !self.is_table() {
            let problem = format!("a table is needed, not {}", self.node.described());
            return Err(self.wrong(problem, format!("write {{ … }} with keys of {}", keys.join(", "))));
        }
        Ok(Section(self))
    }

    pub fn text(&self) -> Result<&'n str> {
        self.node.text(&self.path)
    }

    pub fn number(&self) -> Result<f64> {
        self.node.number(&self.path)
    }

    /// A number above zero.
    pub fn positive(&self) -> Result<f64> {
        let value = self.number()?;
        if value > 0.0 {
            Ok(value)
        } else {
            Err(self.wrong(format!("{value} is not positive"), "give a number above 0"))
        }
    }

    /// A whole number of at least `least`.
    pub fn whole(&self, least: usize) -> Result<usize> {
        let value = self.number()?;
        if value.fract() == 0.0 && value >= least as f64 && value <= 2f64.powi(53) {
            return Ok(value as usize);
        }
        Err(self.wrong(format!("{value} is not a whole number of at least {least}"), "give such a number"))
    }

    /// A whole number of at least `least` and at most `most` of something.
    pub fn count(&self, least: usize, most: usize, what: &str) -> Result<usize> {
        match self.whole(least)? {
            n if n <= most => Ok(n),
            n => Err(self.wrong(format!("{n} {what} are too many"), format!("give at most {most}"))),
        }
    }

    pub fn truth(&self) -> Result<bool> {
        match self.node.kind {
            Kind::Truth(value) => Ok(value),
            _ => {
                Err(self.wrong(format!("true or false is needed, not {}", self.node.described()), "write it unquoted"))
            }
        }
    }

    /// One of a set of names.
    pub fn choice<T: Copy>(&self, names: &[(&str, T)]) -> Result<T> {
        let text = self.text()?;
        names.iter().find(|(name, _)| *name == text).map(|(_, value)| *value).ok_or_else(|| {
            let all: Vec<&str> = names.iter().map(|n| n.0).collect();
            self.wrong(format!("{} is not known here", quoted(text)), suggestion(text, &all))
        })
    }

    /// A quantity with unit (SI); zero needs none.
    pub fn quantity(&self, what: Dimension) -> Result<f64> {
        match &self.node.kind {
            Kind::Text(text) => what.parse(text).map_err(|e| self.spot().at(e)),
            _ if self.number()? == 0.0 => Ok(0.0),
            _ => {
                let given = self.node.described();
                Err(self.wrong(format!("{given} has no unit"), format!("write it as {}", what.example())))
            }
        }
    }

    /// A quantity above zero.
    pub fn positive_quantity(&self, what: Dimension) -> Result<f64> {
        let value = self.quantity(what)?;
        if value > 0.0 {
            return Ok(value);
        }
        Err(self.wrong(format!("{} is not positive", self.node.described()), format!("write it as {}", what.example())))
    }

    /// The values of a list.
    pub fn items(&self, example: &str) -> Result<Vec<Value<'n>>> {
        let list = self.node.list().ok_or_else(|| {
            self.wrong(format!("a list is needed, not {}", self.node.described()), format!("write {example}"))
        })?;
        Ok(list.iter().enumerate().map(|(n, node)| Value { node, path: format!("{}.{n}", self.path) }).collect())
    }

    /// As many quantities as the list is long: `["1 mm", 0, "3 mm"]`, or a text with one unit, `"1, 0, 3 mm"`.
    pub fn quantities(&self, what: Dimension) -> Result<Vec<f64>> {
        let Kind::Text(text) = &self.node.kind else {
            let example = what.example();
            return self.items(&format!("[{example}, 0, 0]"))?.iter().map(|v| v.quantity(what)).collect();
        };
        let at = |e| self.spot().at(e);
        let parts: Vec<(f64, &str)> = text.split(',').map(split).collect::<Result<_>>().map_err(at)?;
        let unit = parts.last().map_or("", |p| p.1);
        let size =
            if unit.is_empty() && parts.iter().all(|p| p.0 == 0.0) { 1.0 } else { what.unit(unit).map_err(at)? };
        let one = |&(x, own): &(f64, &str)| {
            let value = if own.is_empty() { x * size } else { x * what.unit(own).map_err(at)? };
            what.bounded(value, text).map_err(at)
        };
        parts.iter().map(one).collect()
    }

    /// Three quantities.
    pub fn vector(&self, what: Dimension) -> Result<Vector3<f64>> {
        let values = self.quantities(what)?;
        self.three(&values)
    }

    /// A unit vector: three numbers, or "x", "y", "z", "-x", "-y", "-z".
    pub fn direction(&self) -> Result<Vector3<f64>> {
        if self.is_text() {
            let (text, sign) = self.text().map(|t| t.strip_prefix('-').map_or((t, 1.0), |rest| (rest, -1.0)))?;
            let mut v = Vector3::zeros();
            let axis = ["x", "y", "z"].iter().position(|a| *a == text).ok_or_else(|| {
                self.wrong(
                    format!("{} is no direction", quoted(text)),
                    "write [0, 0, 1], or \"x\", \"y\", \"z\", \"-x\" …",
                )
            })?;
            v[axis] = sign;
            return Ok(v);
        }
        let numbers: Vec<f64> = self.items("[0, 0, 1]")?.iter().map(Value::number).collect::<Result<_>>()?;
        let v = self.three(&numbers)?;
        let largest = v.amax();
        if largest == 0.0 {
            return Err(self.wrong("the direction has length zero", "give three numbers that are not all zero"));
        }
        Ok((v / largest).normalize())
    }

    /// An axis of the grid.
    pub fn axis(&self) -> Result<usize> {
        self.choice(&AXES)
    }

    fn three(&self, values: &[f64]) -> Result<Vector3<f64>> {
        match values {
            [x, y, z] => Ok(Vector3::new(*x, *y, *z)),
            _ => Err(self.wrong(format!("three components are needed, not {}", values.len()), "give x, y and z")),
        }
    }
}

impl Section<'_> {
    fn path_of(&self, key: &str) -> String {
        if self.0.path.is_empty() { key.into() } else { format!("{}.{key}", self.0.path) }
    }
}

/// Axes by name.
pub(super) const AXES: [(&str, usize); 3] = [("x", 0), ("y", 1), ("z", 2)];
