//! Quantities with units, read at the edge: "130 MPa", "2 mm", "2650 kg/m3", "30 deg" become SI numbers.

use nalgebra::Vector3;

use crate::words::{nearest, quoted};
use anisobond::{Error, Result};

/// What a quantity measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// Stress and stiffness (Pa).
    Stress,
    /// Compliance (1/Pa): "1/" before a unit of stress.
    Compliance,
    /// Length (m).
    Length,
    /// Mass density (kg/m³).
    Density,
    /// Angle (rad).
    Angle,
    /// Time (s).
    Time,
    /// Velocity (m/s).
    Velocity,
    /// Acceleration (m/s²).
    Acceleration,
    /// Force (N).
    Force,
    /// Force per volume (N/m³).
    ForceDensity,
    /// Energy per area (J/m²).
    SurfaceEnergy,
    /// Per time (1/s).
    Rate,
}

/// Every unit: its dimension, its name (letter case counts) and its size in SI.
const UNITS: [(Dimension, &str, f64); 85] = [
    (Dimension::Stress, "Pa", 1.0),
    (Dimension::Stress, "kPa", 1e3),
    (Dimension::Stress, "MPa", 1e6),
    (Dimension::Stress, "GPa", 1e9),
    (Dimension::Stress, "TPa", 1e12),
    (Dimension::Stress, "N/m2", 1.0),
    (Dimension::Stress, "hPa", 1e2),
    (Dimension::Stress, "N/mm2", 1e6),
    (Dimension::Stress, "N/cm2", 1e4),
    (Dimension::Stress, "kN/m2", 1e3),
    (Dimension::Stress, "MN/m2", 1e6),
    (Dimension::Stress, "GN/m2", 1e9),
    (Dimension::Stress, "kN/cm2", 1e7),
    (Dimension::Stress, "kN/mm2", 1e9),
    (Dimension::Stress, "mbar", 1e2),
    (Dimension::Stress, "kgf/cm2", 98_066.5),
    (Dimension::Stress, "kgf/mm2", 9_806_650.0),
    (Dimension::Stress, "J/m3", 1.0),
    (Dimension::Stress, "psi", 6_894.757_293_168_361),
    (Dimension::Stress, "ksi", 6_894_757.293_168_361),
    (Dimension::Stress, "Mpsi", 6_894_757_293.168_361),
    (Dimension::Stress, "Mbar", 1e11),
    (Dimension::Stress, "bar", 1e5),
    (Dimension::Stress, "kbar", 1e8),
    (Dimension::Stress, "kBar", 1e8),
    (Dimension::Stress, "atm", 101_325.0),
    (Dimension::Stress, "dyn/cm2", 0.1),
    (Dimension::Stress, "dyne/cm2", 0.1),
    (Dimension::Stress, "eV/A3", 1.602_176_634e11),
    (Dimension::Length, "m", 1.0),
    (Dimension::Length, "mm", 1e-3),
    (Dimension::Length, "cm", 1e-2),
    (Dimension::Length, "um", 1e-6),
    (Dimension::Length, "nm", 1e-9),
    (Dimension::Length, "A", 1e-10),
    (Dimension::Length, "km", 1e3),
    (Dimension::Length, "in", 0.0254),
    (Dimension::Length, "ft", 0.3048),
    (Dimension::Density, "kg/m3", 1.0),
    (Dimension::Density, "g/cm3", 1e3),
    (Dimension::Density, "g/cc", 1e3),
    (Dimension::Density, "g/ml", 1e3),
    (Dimension::Density, "kg/l", 1e3),
    (Dimension::Density, "kg/dm3", 1e3),
    (Dimension::Density, "Mg/m3", 1e3),
    (Dimension::Density, "mg/cm3", 1.0),
    (Dimension::Density, "lb/ft3", 16.018_463_373_960_14),
    (Dimension::Density, "t/m3", 1e3),
    (Dimension::Angle, "deg", std::f64::consts::PI / 180.0),
    (Dimension::Angle, "degrees", std::f64::consts::PI / 180.0),
    (Dimension::Angle, "°", std::f64::consts::PI / 180.0),
    (Dimension::Angle, "rad", 1.0),
    (Dimension::Angle, "radians", 1.0),
    (Dimension::Time, "s", 1.0),
    (Dimension::Time, "ms", 1e-3),
    (Dimension::Time, "us", 1e-6),
    (Dimension::Time, "ns", 1e-9),
    (Dimension::Time, "min", 60.0),
    (Dimension::Time, "h", 3600.0),
    (Dimension::Velocity, "m/s", 1.0),
    (Dimension::Velocity, "mm/s", 1e-3),
    (Dimension::Velocity, "cm/s", 1e-2),
    (Dimension::Velocity, "um/s", 1e-6),
    (Dimension::Velocity, "km/s", 1e3),
    (Dimension::Velocity, "m/min", 1.0 / 60.0),
    (Dimension::Acceleration, "m/s2", 1.0),
    (Dimension::Acceleration, "mm/s2", 1e-3),
    (Dimension::Acceleration, "km/s2", 1e3),
    (Dimension::Force, "N", 1.0),
    (Dimension::Force, "mN", 1e-3),
    (Dimension::Force, "kN", 1e3),
    (Dimension::Force, "MN", 1e6),
    (Dimension::Force, "lbf", 4.448_221_615_260_5),
    (Dimension::ForceDensity, "N/m3", 1.0),
    (Dimension::ForceDensity, "kN/m3", 1e3),
    (Dimension::ForceDensity, "MN/m3", 1e6),
    (Dimension::ForceDensity, "N/mm3", 1e9),
    (Dimension::SurfaceEnergy, "J/m2", 1.0),
    (Dimension::SurfaceEnergy, "mJ/m2", 1e-3),
    (Dimension::SurfaceEnergy, "kJ/m2", 1e3),
    (Dimension::SurfaceEnergy, "N/m", 1.0),
    (Dimension::SurfaceEnergy, "N/mm", 1e3),
    (Dimension::Rate, "1/s", 1.0),
    (Dimension::Rate, "1/ms", 1e3),
    (Dimension::Rate, "1/us", 1e6),
];

impl Dimension {
    /// The dimension in words, with its article.
    fn words(self) -> &'static str {
        match self {
            Dimension::Stress => "a stress",
            Dimension::Compliance => "a compliance (1/stress)",
            Dimension::Length => "a length",
            Dimension::Density => "a density",
            Dimension::Angle => "an angle",
            Dimension::Time => "a time",
            Dimension::Velocity => "a velocity",
            Dimension::Acceleration => "an acceleration",
            Dimension::Force => "a force",
            Dimension::ForceDensity => "a force per volume",
            Dimension::SurfaceEnergy => "an energy per area",
            Dimension::Rate => "a rate (1/time)",
        }
    }

    /// Name of the SI unit.
    fn si(self) -> &'static str {
        match self {
            Dimension::Stress => "Pa",
            Dimension::Compliance => "1/Pa",
            Dimension::Length => "m",
            Dimension::Density => "kg/m3",
            Dimension::Angle => "rad",
            Dimension::Time => "s",
            Dimension::Velocity => "m/s",
            Dimension::Acceleration => "m/s2",
            Dimension::Force => "N",
            Dimension::ForceDensity => "N/m3",
            Dimension::SurfaceEnergy => "J/m2",
            Dimension::Rate => "1/s",
        }
    }

    /// A unit that is usual, for messages.
    pub(crate) fn usual(self) -> &'static str {
        match self {
            Dimension::Density => "g/cm3",
            other => other.si(),
        }
    }

    /// A quantity as an example for messages.
    pub fn example(self) -> &'static str {
        match self {
            Dimension::Stress => "\"130 GPa\"",
            Dimension::Compliance => "\"7.7 1/TPa\"",
            Dimension::Length => "\"2 mm\"",
            Dimension::Density => "\"2650 kg/m3\"",
            Dimension::Angle => "\"30 deg\"",
            Dimension::Time => "\"50 us\"",
            Dimension::Velocity => "\"20 m/s\"",
            Dimension::Acceleration => "\"9.81 m/s2\"",
            Dimension::Force => "\"2 kN\"",
            Dimension::ForceDensity => "\"25 kN/m3\"",
            Dimension::SurfaceEnergy => "\"3.8 J/m2\"",
            Dimension::Rate => "\"100 1/s\"",
        }
    }

    /// Magnitudes (SI) that are computed with; beyond them powers of lengths and products of stiffnesses are no numbers any
    /// more.
    fn bounds(self) -> [f64; 2] {
        match self {
            Dimension::Length => [1e-18, 1e18],
            Dimension::Stress => [1e-30, 1e25],
            Dimension::Compliance => [1e-25, 1e30],
            _ => [1e-30, 1e30],
        }
    }

    /// A value (SI) that can be computed with; `text` is how it was written.
    ///
    /// # Errors
    /// One that is not finite, too large, or too small but not zero.
    pub fn bounded(self, value: f64, text: &str) -> Result<f64> {
        let [least, most] = self.bounds();
        let value = finite(value, text)?;
        let beyond = |word: &str, limit: f64| {
            let problem = format!("{} is too {word} for {}", quoted(text.trim()), self.words());
            Err(Error::input(
                problem,
                format!(
                    "give at {} {limit:e} {}, or check the unit",
                    if word == "large" { "most" } else { "least" },
                    self.si()
                ),
            ))
        };
        match value.abs() {
            x if x > most => beyond("large", most),
            x if x > 0.0 && x < least => beyond("small", least),
            _ => Ok(value),
        }
    }

    /// Size of a unit in SI: `Dimension::Stress.unit("GPa")` is 10⁹ Pa.
    ///
    /// Accepted: Pa hPa kPa MPa GPa TPa N/m2 N/cm2 N/mm2 kN/m2 MN/m2 GN/m2 kN/cm2 kN/mm2 psi ksi Mpsi Mbar kbar bar mbar atm
    /// dyn/cm2 kgf/cm2 kgf/mm2 J/m3 eV/A3; 1/ before any of them for a compliance; m mm cm um nm A km in ft; kg/m3 g/cm3 g/cc g/ml
    /// kg/l kg/dm3 Mg/m3 mg/cm3 t/m3 lb/ft3; deg ° rad;
    /// s ms us ns min h; m/s mm/s cm/s um/s km/s m/min; m/s2 mm/s2 km/s2; N mN kN MN lbf; N/m3 kN/m3 MN/m3 N/mm3; J/m2
    /// mJ/m2 kJ/m2 N/m N/mm; 1/s 1/ms 1/us. Also µ for u, Å for A, ² or ^2 for 2.
    ///
    /// # Errors
    /// An unknown unit (with a valid name that is nearly written so, if that may be the same unit; letter case counts, mPa is not
    /// MPa) or one of another dimension.
    pub fn unit(self, name: &str) -> Result<f64> {
        let plain = plain(name);
        if self == Dimension::Compliance {
            let stress = reciprocal(&plain).ok_or_else(|| self.not_a_unit(name, &plain))?;
            return Dimension::Stress.unit(stress).map(|size| 1.0 / size);
        }
        let known = UNITS.iter().find(|&&(dimension, unit, _)| dimension == self && unit == plain);
        known.map(|&(_, _, size)| size).ok_or_else(|| self.not_a_unit(name, &plain))
    }

    /// A quantity "number unit" in SI. The space may be left out.
    ///
    /// # Errors
    /// No number, a number that is not finite, no unit, or a unit that [`Dimension::unit`] refuses.
    pub fn parse(self, text: &str) -> Result<f64> {
        let (number, unit) = split(text)?;
        if unit.is_empty() {
            return Err(Error::input(
                format!("{} has no unit", quoted(text.trim())),
                format!("write {} with its unit, as {}", self.words(), self.example()),
            ));
        }
        let size = self.unit(unit)?;
        // A number that is lost in its unit is not zero.
        if number != 0.0 && number * size == 0.0 {
            return self.bounded(f64::MIN_POSITIVE, text);
        }
        self.bounded(number * size, text)
    }

    /// The size of a unit that is a known one with other SI prefixes: "mPa", "uN/cm2"; `None` for what cannot be read so.
    fn size_by_prefixes(self, plain: &str) -> Option<f64> {
        let bases = UNITS.iter().filter(|u| u.0 == self);
        let prefixed = |part: &str, base: &str| -> Option<f64> {
            if part == base {
                return Some(1.0);
            }
            let mut letters = part.chars();
            let (_, size) = PREFIXES.iter().find(|(prefix, _)| Some(*prefix) == letters.clone().next())?;
            letters.next();
            (letters.as_str() == base).then_some(*size)
        };
        // A base is a unit of which no part has a prefix.
        const PLAIN: [&str; 8] = ["Pa", "N/m2", "bar", "psi", "m", "g/m3", "N", "J/m2"];
        bases
            .filter_map(|&(_, name, size)| {
                let own = match name {
                    "kg/m3" => ("g/m3", 1e-3),
                    other => (PLAIN.into_iter().find(|p| *p == other)?, size),
                };
                let (name, size) = own;
                match (plain.split_once('/'), name.split_once('/')) {
                    (Some((top, below)), Some((base, under))) => {
                        let power = under.chars().next_back()?.to_digit(10)? as i32;
                        let digit = below.chars().next_back()?.to_digit(10)? as i32;
                        let length = prefixed(&below[..below.len() - 1], &under[..under.len() - 1])?;
                        (power == digit).then_some(size * prefixed(top, base)? / length.powi(power))
                    }
                    (None, None) => Some(size * prefixed(plain, name)?),
                    _ => None,
                }
            })
            .next()
    }

    /// Why `name` is no unit of this dimension.
    fn not_a_unit(self, name: &str, plain: &str) -> Error {
        let elsewhere = match UNITS.iter().find(|&&(_, unit, _)| unit == plain) {
            Some(&(dimension, _, _)) => Some(dimension),
            None => reciprocal(plain).and_then(|stress| {
                UNITS.iter().any(|u| u.0 == Dimension::Stress && u.1 == stress).then_some(Dimension::Compliance)
            }),
        };
        let all: Vec<&str> = UNITS.iter().filter(|u| u.0 == self).map(|u| u.1).collect();
        let all = if self == Dimension::Compliance { "1/Pa, 1/GPa or 1/TPa".into() } else { all.join(", ") };
        match elsewhere {
            Some(other) => Error::input(
                format!("{} is a unit of {}, but {} is needed", quoted(name), other.words(), self.words()),
                format!("use one of {all}"),
            ),
            None => {
                Error::input(format!("unknown unit {} of {}", quoted(name), self.words()), self.remedy(plain, &all))
            }
        }
    }

    /// The nearest unit of this dimension, if it may be the one that is meant, or all of them: one of another size is never
    /// suggested for one whose size can be read.
    fn remedy(self, plain: &str, all: &str) -> String {
        let own = || UNITS.iter().filter(|u| u.0 == self);
        if let Some(size) = self.size_by_prefixes(plain) {
            let size = format!("{size:.11e}").parse().unwrap_or(size);
            let same = own().find(|u| (u.2 / size - 1.0).abs() < 1e-12).map(|u| u.1);
            return match same {
                Some(name) => format!("write {name} = {size:e} {}", self.si()),
                None => format!("it reads as {size:e} {}; use one of {all} (upper and lower case differ)", self.si()),
            };
        }
        let Some(name) = nearest(plain, own().map(|u| u.1)).filter(|name| same_size(plain, name)) else {
            return format!("use one of {all}");
        };
        let size = own().find(|u| u.1 == name).map_or(1.0, |u| u.2);
        let case = if name.eq_ignore_ascii_case(plain) { " (upper and lower case differ)" } else { "" };
        format!("did you mean {name} = {size:e} {}?{case}", self.si())
    }
}

/// SI's prefixes.
const PREFIXES: [(char, f64); 10] = [
    ('p', 1e-12),
    ('n', 1e-9),
    ('u', 1e-6),
    ('m', 1e-3),
    ('c', 1e-2),
    ('d', 1e-1),
    ('h', 1e2),
    ('k', 1e3),
    ('M', 1e6),
    ('G', 1e9),
];

/// Whether a unit that is suggested for a text is surely not one of another size: but for letter case, separators and letters
/// that no prefix is among, both are written alike.
fn same_size(plain: &str, name: &str) -> bool {
    let letters = |text: &str| text.chars().filter(|c| c.is_alphanumeric() || *c == '/').collect::<String>();
    let (a, b) = (letters(plain), letters(name));
    if a.eq_ignore_ascii_case(&b) {
        return true;
    }
    // The parts of a quotient begin alike, and powers are alike.
    let (a, b): (Vec<&str>, Vec<&str>) = (a.split('/').collect(), b.split('/').collect());
    let digits = |text: &str| text.chars().filter(char::is_ascii_digit).collect::<String>();
    let begins = |text: &str| text.chars().next().map(|c| c.to_ascii_lowercase());
    a.len() == b.len()
        && a.iter().zip(&b).all(|(a, b)| {
            let (long, short) = if a.len() >= b.len() { (a, b) } else { (b, a) };
            begins(a) == begins(b) && digits(a) == digits(b) && (long.len() == short.len() || short.len() > 2)
        })
}

/// A stress (Pa): "130 MPa". Errors as [`Dimension::parse`].
pub fn parse_stress(text: &str) -> Result<f64> {
    Dimension::Stress.parse(text)
}

/// A length (m): "2 mm". Errors as [`Dimension::parse`].
pub fn parse_length(text: &str) -> Result<f64> {
    Dimension::Length.parse(text)
}

/// A mass density (kg/m³): "2650 kg/m3". Errors as [`Dimension::parse`].
pub fn parse_density(text: &str) -> Result<f64> {
    Dimension::Density.parse(text)
}

/// An angle (rad): "30 deg". Errors as [`Dimension::parse`].
pub fn parse_angle(text: &str) -> Result<f64> {
    Dimension::Angle.parse(text)
}

/// One spelling of a unit: no spaces nor ^, powers as digits, u for µ, A for Å.
pub(crate) fn plain(name: &str) -> String {
    let letter = |c: char| match c {
        '²' => Some('2'),
        '³' => Some('3'),
        '¹' => Some('1'),
        '⁻' | '−' => Some('-'),
        'µ' | 'μ' => Some('u'),
        'Å' | '\u{212b}' => Some('A'),
        '^' | '\u{30a}' => None,
        c if c.is_whitespace() => None,
        c => Some(c),
    };
    name.chars().filter_map(letter).collect()
}

/// "GPa" of "1/GPa" or "GPa-1".
fn reciprocal(plain: &str) -> Option<&str> {
    plain.strip_prefix("1/").or_else(|| plain.strip_suffix("-1"))
}

/// A finite number at the start of a text, and the rest without spaces around it.
pub fn split(text: &str) -> Result<(f64, &str)> {
    let text = text.trim();
    let (sign, digits) = match text.strip_prefix(['-', '−']) {
        Some(rest) => (-1.0, rest),
        None => (1.0, text.strip_prefix('+').unwrap_or(text)),
    };
    let end = number_length(digits);
    let (number, rest) = digits.split_at(end);
    let comma = rest.strip_prefix(',').is_some_and(|r| r.starts_with(|c: char| c.is_ascii_digit()));
    match number.parse::<f64>() {
        Ok(_) if comma => {
            Err(Error::input(format!("{} has a comma in its number", quoted(text)), "use a point as decimal mark"))
        }
        Ok(value) => Ok((finite(sign * value, text)?, rest.trim())),
        Err(_) => Err(Error::input(
            format!("{} is not a finite number", quoted(text)),
            "write a number such as 130, 0.25 or 1.3e2",
        )),
    }
}

/// Length of digits, point, digits, and an exponent if digits follow it (the e of "1 eV" does not count).
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |from: usize| bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let mut end = digits(0);
    if bytes.get(end) == Some(&b'.') {
        end += 1 + digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits((end + 1 + sign).min(bytes.len()));
        if exponent > 0 {
            end += 1 + sign + exponent;
        }
    }
    end
}

fn finite(value: f64, text: &str) -> Result<f64> {
    if value.is_finite() {
        return Ok(value);
    }
    Err(Error::input(format!("{} is too large", quoted(text)), "write a finite number"))
}

/// Three finite numbers "x,y,z".
///
/// # Errors
/// Anything else.
pub fn parse_vector(text: &str) -> Result<Vector3<f64>> {
    let numbers: Vec<Option<f64>> =
        text.split(',').map(|x| x.trim().parse().ok().filter(|c: &f64| c.is_finite())).collect();
    match numbers[..] {
        [Some(x), Some(y), Some(z)] => Ok(Vector3::new(x, y, z)),
        _ => Err(Error::input(format!("{} is not three numbers", quoted(text)), "give three numbers as 0,0,1")),
    }
}

#[cfg(test)]
mod tests;
