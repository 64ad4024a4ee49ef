//! Ansys' commands: `TB,ANEL` with `TBDATA` (21 constants, rows x y z xy yz xz), or `MP,EX` … `MP,GXZ`. No unit is part of
//! the format.

use super::super::square::Square;
use super::super::unit::{settled, units_of};
use super::super::{Found, Source};
use super::{Orthotropic, number_of};
use crate::material::StressUnit;
use crate::material::matrix::Order;
use crate::words::enumeration;
use anisobond::tensor::Stiffness;
use anisobond::{Error, Result};

/// What the commands say.
#[derive(Default)]
struct Said {
    /// Constants of TBDATA by their number from 1.
    data: Vec<(usize, f64, super::Figure)>,
    flexibility: bool,
    anel: usize,
    properties: Vec<(String, f64)>,
    materials: Vec<String>,
}

pub(in super::super) fn read(source: &Source) -> Option<Result<Found>> {
    let starts = |line: &str| {
        let line = line.trim_start().to_uppercase().replace(' ', "");
        line.starts_with("TB,ANEL") || line.starts_with("MP,EX,")
    };
    source.text.lines().any(starts).then(|| commands(source).map_err(|e| e.at(source.place)))
}

fn commands(source: &Source) -> Result<Found> {
    let mut said = Said::default();
    let own = units_of(source.text.lines().filter_map(|line| Some(line.split_once('!')?.1)));
    for (n, line) in source.text.lines().enumerate() {
        let commands = line.split('!').next().unwrap_or("");
        for command in commands.split('$') {
            let words: Vec<String> = command.split(',').map(|word| word.trim().to_uppercase()).collect();
            said.hear(&words).map_err(|e| e.at(format!("line {}", n + 1)))?;
        }
    }
    said.materials.dedup();
    if said.materials.len() > 1 || said.anel > 1 {
        let problem = format!("there are several materials: {}", enumeration(&said.materials));
        return Err(Error::input(problem, "give the commands of one, at one temperature, by themselves"));
    }
    let mut found = if said.anel == 1 { matrix(source, &said, &own) } else { constants(source, &said, &own) }?;
    if said.property("DENS").is_some() {
        found.read_as += "; MP,DENS is not taken, for the file names no unit of it";
    }
    Ok(found)
}

impl Said {
    fn hear(&mut self, words: &[String]) -> Result<()> {
        let word = |n: usize| words.get(n).map_or("", String::as_str);
        match (word(0), word(1)) {
            ("TB", "ANEL") => {
                self.anel += 1;
                self.materials.push(word(2).into());
                self.flexibility = word(5) == "1";
            }
            ("TBDATA", start) if self.anel > 0 => {
                let start: usize = if start.is_empty() { 1 } else { start.parse().unwrap_or(0) };
                for (n, field) in words.iter().enumerate().skip(2).filter(|(_, field)| !field.is_empty()) {
                    let at = start.saturating_add(n).saturating_sub(2);
                    if !(1..=21).contains(&at) {
                        return Err(Error::input(
                            "TBDATA names a constant beyond the 21 of ANEL",
                            "number them from 1",
                        ));
                    }
                    let figure = number_of(field)?;
                    self.data.push((at - 1, figure.value, figure));
                }
            }
            ("MP", property) => {
                self.properties.push((property.into(), number_of(word(3))?.value));
                self.materials.push(word(2).into());
            }
            _ => {}
        }
        Ok(())
    }

    fn property(&self, name: &str) -> Option<f64> {
        self.properties.iter().rev().find(|(known, _)| known == name).map(|(_, value)| *value)
    }
}

fn matrix(source: &Source, said: &Said, own: &[StressUnit]) -> Result<Found> {
    let mut square = Square::empty();
    let places: Vec<(usize, usize)> = (0..6).flat_map(|a| (a..6).map(move |b| (a, b))).collect();
    let given: Vec<bool> = (0..21).map(|n| said.data.iter().any(|(at, ..)| *at == n)).collect();
    // Constants that are not given are zero, but none of the diagonal can be.
    if (0..21).any(|n| places[n].0 == places[n].1 && !given[n]) {
        let problem = format!("TBDATA gives {} of ANEL's 21 constants", given.iter().filter(|g| **g).count());
        return Err(Error::input(problem, "are the commands cut off?"));
    }
    said.data.iter().for_each(|&(at, _, figure)| square.set(places[at].0, places[at].1, figure));
    let unit = settled(source, own, said.data.iter().fold(0.0, |m: f64, d| m.max(d.1.abs())))?;
    let what = if said.flexibility { "flexibility" } else { "stiffness" };
    let (stiffness, done) = if said.flexibility {
        let row = |a: usize| Order::VASP.row(a);
        let s = nalgebra::Matrix6::from_fn(|a, b| square.0[row(a)][row(b)].value / unit.size);
        let stiffness = Stiffness::from_compliance_voigt(&s)?;
        stiffness.require_positive_definite()?;
        (stiffness, String::new())
    } else {
        square.stiffness(unit.size, Order::VASP)?
    };
    Ok(Found::new(stiffness, format!("Ansys TB,ANEL ({what}), {}, order x y z xy yz xz{done}", unit.name)))
}

fn constants(source: &Source, said: &Said, own: &[StressUnit]) -> Result<Found> {
    let get = |name: &str| said.property(name);
    let moduli = ["EX", "EY", "EZ", "GXY", "GYZ", "GXZ"].map(get);
    let largest = moduli.iter().flatten().fold(0.0, |m: f64, x| m.max(*x));
    let missing = |names: &[&str]| {
        let missing: Vec<&str> = names.iter().copied().filter(|name| get(name).is_none()).collect();
        Error::input(
            format!("MP,{} missing", enumeration(&missing)),
            "give all nine, or EX and PRXY of an isotropic material",
        )
    };
    let unit = settled(source, own, largest)?;
    let one = moduli[1..].iter().all(Option::is_none);
    if let (true, Some(e), Some(nu)) = (one, moduli[0], get("PRXY").or(get("NUXY"))) {
        let stiffness = Orthotropic::isotropic(e, nu).stiffness(&unit)?;
        return Ok(Found::new(stiffness, format!("Ansys MP,EX and PRXY (isotropic), {}", unit.name)));
    }
    if ["NUXY", "NUYZ", "NUXZ"].iter().any(|name| get(name).is_some()) {
        return Err(Error::input(
            "NUXY, NUYZ and NUXZ are the minor ratios",
            "give PRXY, PRYZ and PRXZ (PRXY = NUXY EX/EY)",
        ));
    }
    let all = ["EX", "EY", "EZ", "PRXY", "PRXZ", "PRYZ", "GXY", "GXZ", "GYZ"];
    let values: Vec<f64> = all.iter().filter_map(|name| get(name)).collect();
    if values.len() < 9 {
        return Err(missing(&all));
    }
    let three = |from: usize| [values[from], values[from + 1], values[from + 2]];
    let stiffness = Orthotropic { e: three(0), nu: three(3), g: three(6) }.stiffness(&unit)?;
    Ok(Found::new(stiffness, format!("Ansys MP,EX … GXZ (engineering constants), {}, PRXY = −εy/εx", unit.name)))
}
