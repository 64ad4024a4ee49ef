//! LAMMPS dumps (`dump custom`, `dump atom`): one time step of them, its box and its atoms.

use nalgebra::Vector3;

use super::columns::{Role, column, said};
use super::found::{Found, Lengths};
use super::numbers::number;
use super::{PackingOptions, Source};
use crate::words::{enumeration, quoted};
use anisobond::{Error, Result, Wording};

/// Sizes of the lengths of LAMMPS' styles of units (m).
pub(super) const STYLES: [(&str, f64); 7] = [
    ("si", 1.0),
    ("cgs", 1e-2),
    ("micro", 1e-6),
    ("nano", 1e-9),
    ("metal", 1e-10),
    ("real", 1e-10),
    ("electron", 5.291_772_109e-11),
];

/// The unit of lengths of a style: "si" has m.
pub(super) fn lengths_of_style(style: &str) -> Lengths {
    match STYLES.iter().find(|(name, _)| *name == style) {
        Some((name, size)) => Lengths::Named(format!("{size:e} m (units {name})").replace("1e0 m", "m"), *size),
        None if style == "lj" => Lengths::Reduced,
        None => Lengths::Open,
    }
}

pub(super) fn read(source: &Source) -> Option<Result<Found>> {
    let is_dump = source.text().trim_start().starts_with("ITEM:");
    is_dump.then(|| frames(source.text()).and_then(|frames| chosen(&frames, source.options)))
}

/// The lines of a time step, with the number of the first.
struct Frame<'t> {
    step: u64,
    line: usize,
    lines: Vec<&'t str>,
    /// `ITEM: UNITS`, which stands in the first time step.
    units: Option<&'t str>,
}

fn frames(text: &str) -> Result<Vec<Frame<'_>>> {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let mut all: Vec<Frame> = Vec::new();
    let mut units = None;
    for (n, line) in lines.iter().enumerate() {
        if let Some(item) = line.strip_prefix("ITEM:") {
            match item.trim() {
                "UNITS" => units = lines.get(n + 1).copied(),
                "TIMESTEP" => {
                    let step = lines.get(n + 1).and_then(|step| step.parse().ok()).ok_or_else(|| {
                        Error::input("ITEM: TIMESTEP without a number", "is the file cut off?")
                            .at(format!("line {}", n + 1))
                    })?;
                    all.push(Frame { step, line: n + 1, lines: Vec::new(), units });
                }
                _ => {}
            }
        }
        if let Some(frame) = all.last_mut() {
            frame.lines.push(line);
        }
    }
    Ok(all)
}

fn chosen(frames: &[Frame], options: &PackingOptions) -> Result<Found> {
    let steps: Vec<String> = frames.iter().map(|frame| frame.step.to_string()).collect();
    let known = match steps.len() {
        0..=8 => enumeration(&steps),
        n => format!("{} … {} ({n} of them)", steps[..4].join(", "), steps[n - 1]),
    };
    let frame = match options.frame {
        None => frames.last(),
        Some(step) => frames.iter().rev().find(|frame| frame.step == step),
    };
    let Some(frame) = frame else {
        let step = options.frame.map_or(String::new(), |step| format!(" {step}"));
        return Err(Error::input(format!("there is no time step{step} in the dump"), format!("it has {known}")));
    };
    let which = match (frames.len(), options.frame) {
        (1, _) => "the only one".to_string(),
        (n, Some(_)) => format!("asked for among {n}"),
        (n, None) => format!("the last of {n}"),
    };
    let mut found = frame.found(options).map_err(|e| match frames.len() {
        1 => e,
        _ if options.frame.is_some() => e,
        n => with_remedy(e, frames[n - 2].step),
    })?;
    found.format = format!("LAMMPS dump, time step {}, {which}; {}", frame.step, found.format);
    Ok(found)
}

/// The time step before may be whole.
fn with_remedy(e: Error, before: u64) -> Error {
    match e {
        Error::Failure { kind, place, problem, remedy } if problem.contains("announced") => Error::Failure {
            kind,
            place,
            problem,
            remedy: remedy.words(", or take the time step before with ").choice("frame", before.to_string()),
        },
        other => other,
    }
}

/// A box of a dump.
struct Bounds {
    low: Vector3<f64>,
    edges: Vector3<f64>,
    periodic: bool,
}

impl Frame<'_> {
    /// The line of an item and its lines below, by the item's first words.
    fn item(&self, name: &str) -> Option<(usize, &str, &[&str])> {
        let at = self
            .lines
            .iter()
            .position(|line| line.strip_prefix("ITEM:").is_some_and(|item| item.trim().starts_with(name)))?;
        let below = &self.lines[at + 1..];
        let end = below.iter().position(|line| line.starts_with("ITEM:")).unwrap_or(below.len());
        Some((self.line + at, self.lines[at].strip_prefix("ITEM:")?.trim().strip_prefix(name)?.trim(), &below[..end]))
    }

    fn bounds(&self) -> Result<Bounds> {
        let Some((line, words, rows)) = self.item("BOX BOUNDS") else {
            return Err(Error::input(format!("time step {} has no BOX BOUNDS", self.step), "is the file cut off?"));
        };
        let at = |e: Error| e.at(format!("line {line}"));
        let rows: Vec<Vec<f64>> = rows
            .iter()
            .take(3)
            .enumerate()
            .map(|(n, row)| {
                let numbers = row.split_whitespace().map(number).collect::<Result<Vec<f64>>>();
                numbers.map_err(|e| e.at(format!("line {}", line + n + 1)))
            })
            .collect::<Result<_>>()?;
        if words.contains("abc origin") || rows.iter().any(|row| row.get(2).is_some_and(|tilt| *tilt != 0.0)) {
            return Err(at(Error::input(
                "the box is tilted (triclinic), and the cell of a packing is rectangular",
                "use an orthogonal box (change_box all ortho, where the tilt is zero)",
            )));
        }
        if rows.len() != 3 || rows.iter().any(|row| row.len() < 2) {
            return Err(at(Error::input(
                "the bounds of the box are not three lines of low and high",
                "is the file cut off?",
            )));
        }
        let low = Vector3::new(rows[0][0], rows[1][0], rows[2][0]);
        let edges = Vector3::new(rows[0][1], rows[1][1], rows[2][1]) - low;
        if edges.min() <= 0.0 {
            let problem = format!("the box is {} × {} × {}", edges.x, edges.y, edges.z);
            return Err(at(Error::input(problem, "give bounds of which the second is the larger")));
        }
        let flags: Vec<&str> =
            words.split_whitespace().filter(|w| w.len() == 2 && w.bytes().all(|b| b"pfsm".contains(&b))).collect();
        let periodic = flags.iter().filter(|flag| **flag == "pp").count();
        if flags.len() == 3 && !matches!(periodic, 0 | 3) {
            return Err(at(Error::input(
                format!("the box is periodic along some axes only ({words})"),
                "a packing is periodic along all axes (pp pp pp) or along none (ff ff ff): write those that are meant",
            )));
        }
        Ok(Bounds { low, edges, periodic: flags.len() != 3 || periodic == 3 })
    }

    fn found(&self, options: &PackingOptions) -> Result<Found> {
        let bounds = self.bounds()?;
        let Some((line, headings, rows)) = self.item("ATOMS") else {
            return Err(Error::input(format!("time step {} has no ATOMS", self.step), "is the file cut off?"));
        };
        let at = |e: Error| e.at(format!("line {line}"));
        let headings: Vec<String> = headings.split_whitespace().map(String::from).collect();
        let announced = self.item("NUMBER OF ATOMS").and_then(|(_, _, below)| below.first()?.parse::<usize>().ok());
        let rows: Vec<(usize, &str)> =
            rows.iter().enumerate().filter(|(_, row)| !row.is_empty()).map(|(n, row)| (line + n + 1, *row)).collect();
        if announced.is_some_and(|announced| announced != rows.len()) {
            let problem = format!("{} atoms are announced, {} listed", announced.unwrap_or(0), rows.len());
            return Err(at(Error::input(problem, "check whether the file is complete")));
        }
        let way = Way::of(&headings).map_err(at)?;
        let size = Size::of(&headings, options).map_err(at)?;
        let lengths = match self.units {
            Some(style) => lengths_of_style(style),
            None => Lengths::Open,
        };
        let boundary = if bounds.periodic { "periodic box" } else { "box that is not periodic" };
        let mut found = Found::new(format!("{boundary}; {}, {}", way.words(&headings), size.words()), lengths);
        found.frames = true;
        (found.types, found.own_radii) = (matches!(size, Size::OfType(_)), matches!(size, Size::OfType(_)));
        found.columns = said(&headings, |at| way.taken(at).or_else(|| size.taken(at)));
        found.corner = bounds.low;
        found.cell = bounds.periodic.then_some(bounds.edges);
        let id = headings.iter().position(|h| h == "id");
        let mut atoms: Vec<(u64, usize, [f64; 4])> = Vec::with_capacity(rows.len());
        for (line, row) in rows {
            let words: Vec<&str> = row.split_whitespace().collect();
            let wrong = |e: Error| e.at(format!("line {line}"));
            if words.len() != headings.len() {
                let problem = format!("{} entries for {} columns", words.len(), headings.len());
                return Err(wrong(Error::input(problem, "give one entry per column; is the file cut off?")));
            }
            let x = way.centre(&words, &bounds).map_err(wrong)?;
            let r = size.radius(&words, options).map_err(wrong)?;
            let id = id.and_then(|id| words[id].parse().ok()).unwrap_or(line as u64);
            atoms.push((id, line, [x[0], x[1], x[2], r]));
        }
        atoms.sort_by_key(|atom| atom.0);
        atoms.into_iter().for_each(|(_, line, sphere)| found.push(line, sphere));
        Ok(found)
    }
}

/// Where an atom's centre stands, and how: `x`, `xu` (unwrapped), `xs` (in shares of the box) or `xsu`.
struct Way {
    at: [usize; 3],
    suffix: &'static str,
}

impl Way {
    fn of(headings: &[String]) -> Result<Self> {
        let find = |suffix: &str, axis: usize| {
            headings.iter().position(|h| *h == format!("{}{suffix}", ["x", "y", "z"][axis]))
        };
        let way =
            |suffix: &'static str| Some(Way { at: [find(suffix, 0)?, find(suffix, 1)?, find(suffix, 2)?], suffix });
        ["", "u", "s", "su"].into_iter().find_map(way).ok_or_else(|| {
            Error::input(
                format!("the atoms have no x, y and z among {}", headings.join(" ")),
                "dump them: dump 1 all custom 1000 FILE id type x y z radius",
            )
        })
    }

    fn words(&self, headings: &[String]) -> String {
        let names: Vec<&str> = self.at.iter().map(|at| headings[*at].as_str()).collect();
        let how = match self.suffix {
            "u" => " (unwrapped)",
            "s" => " (in shares of the box)",
            "su" => " (in shares of the box, unwrapped)",
            _ => "",
        };
        format!("centres from {}{how}", names.join(" "))
    }

    fn taken(&self, at: usize) -> Option<String> {
        let axis = self.at.iter().position(|own| *own == at)?;
        let how = if self.suffix.starts_with('s') { " in shares of the box" } else { "" };
        Some(format!("{}{how}", ["x", "y", "z"][axis]))
    }

    fn centre(&self, words: &[&str], bounds: &Bounds) -> Result<[f64; 3]> {
        let mut x = [0.0; 3];
        for axis in 0..3 {
            let value = number(words[self.at[axis]])?;
            let scaled = self.suffix.starts_with('s');
            x[axis] = if scaled { bounds.low[axis] + value * bounds.edges[axis] } else { value };
        }
        Ok(x)
    }
}

/// Where an atom's radius stands.
enum Size {
    Radius(usize),
    Diameter(usize),
    /// By the type in a column.
    OfType(usize),
}

impl Size {
    fn of(headings: &[String], options: &PackingOptions) -> Result<Self> {
        let sizes: Vec<(usize, Role)> = headings
            .iter()
            .enumerate()
            .filter_map(|(at, text)| column(at, text).ok()??.role.size().map(|role| (at, role)))
            .collect();
        let find = |role: Role| sizes.iter().find(|size| size.1 == role).map(|size| size.0);
        if let Some((first, second)) = sizes.first().zip(sizes.get(1))
            && first.1 == second.1
        {
            let both = [quoted(&headings[first.0]), quoted(&headings[second.0])];
            return Err(Error::input(
                format!("columns {} may both be the size", enumeration(&both)),
                "dump one of them",
            ));
        }
        match (find(Role::Radius), find(Role::Diameter), headings.iter().position(|h| h == "type")) {
            (Some(at), ..) => Ok(Size::Radius(at)),
            (None, Some(at), _) => Ok(Size::Diameter(at)),
            (None, None, Some(at)) if !options.type_radii.is_empty() => Ok(Size::OfType(at)),
            _ => Err(Error::input(
                format!("the atoms have no radius or diameter among {}", headings.join(" ")),
                Wording::from("dump it (… id type x y z radius), or give the radii of the types with ")
                    .choice("type_radii", "1 mm,2 mm"),
            )),
        }
    }

    fn words(&self) -> &'static str {
        match self {
            Size::Radius(_) => "radii of their own",
            Size::Diameter(_) => "diameters of their own",
            Size::OfType(_) => "radii by type, as given",
        }
    }

    fn taken(&self, at: usize) -> Option<String> {
        match self {
            Size::Radius(own) if *own == at => Some("radius".into()),
            Size::Diameter(own) if *own == at => Some("diameter".into()),
            Size::OfType(own) if *own == at => Some("type, for its radius".into()),
            _ => None,
        }
    }

    fn radius(&self, words: &[&str], options: &PackingOptions) -> Result<f64> {
        match self {
            Size::Radius(at) => number(words[*at]),
            Size::Diameter(at) => number(words[*at]).map(|d| 0.5 * d),
            Size::OfType(at) => of_type(words[*at], options),
        }
    }
}

/// The radius (m) of a type.
pub(super) fn of_type(word: &str, options: &PackingOptions) -> Result<f64> {
    let known = &options.type_radii;
    let of = |n: usize| known.get(n.checked_sub(1)?).copied();
    word.parse().ok().and_then(of).ok_or_else(|| {
        let problem = format!("type {} has no radius among the {} that are given", quoted(word), known.len());
        Error::input(problem, Wording::from("give one for each type from 1 with ").choice("type_radii", "1 mm,2 mm"))
    })
}
