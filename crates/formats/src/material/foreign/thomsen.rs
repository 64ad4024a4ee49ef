//! Thomsen's parameters of a transversely isotropic rock, with its two speeds along e₃ and its density.
//!
//! L. Thomsen, Weak elastic anisotropy, Geophysics 51 (1986), eqs 8a to 8c and 17; the exact forms, not the weak ones.

use super::figure::Figure;
use super::{Found, Source};
use crate::units::Dimension;
use crate::words::{enumeration, number};
use anisobond::tensor::Stiffness;
use anisobond::{Error, Result};
use nalgebra::Matrix6;

/// What must be given, each under any of these names.
pub const NAMES: [&[&str]; 6] = [
    &["vp", "vp0", "alpha0", "α0"],
    &["vs", "vs0", "beta0", "β0"],
    &["density", "rho", "ρ"],
    &["epsilon", "eps", "ε"],
    &["delta", "δ"],
    &["gamma", "γ"],
];

/// The parameter that a key names, by its place in [`NAMES`].
pub fn parameter(key: &str) -> Option<usize> {
    let key = key.trim().to_lowercase();
    NAMES.iter().position(|names| names.contains(&key.as_str()))
}

/// C of Vp, Vs (m/s), density (kg/m³), ε, δ, γ.
///
/// # Errors
/// Parameters that no stiffness has.
pub fn stiffness([vp, vs, density, epsilon, delta, gamma]: [f64; 6]) -> Result<Stiffness> {
    let (c33, c44) = (density * vp * vp, density * vs * vs);
    let (c11, c66) = (c33 * (1.0 + 2.0 * epsilon), c44 * (1.0 + 2.0 * gamma));
    let squared = 2.0 * delta * c33 * (c33 - c44) + (c33 - c44).powi(2);
    if !(squared >= 0.0 && squared.is_finite()) {
        let problem = format!("no stiffness has Vp {vp} m/s, Vs {vs} m/s and delta {delta}");
        return Err(Error::input(problem, "correct them; delta is Thomsen's, not that of another definition"));
    }
    let (c13, c12) = (squared.sqrt() - c44, c11 - 2.0 * c66);
    let mut c = Matrix6::from_diagonal(&[c11, c11, c33, c44, c44, c66].into());
    for (a, b, value) in [(0, 1, c12), (0, 2, c13), (1, 2, c13)] {
        c[(a, b)] = value;
        c[(b, a)] = value;
    }
    let stiffness = Stiffness::from_voigt(&c)?;
    stiffness.require_positive_definite()?;
    Ok(stiffness)
}

/// The dimension of a parameter; `None` for plain numbers.
pub fn dimension(parameter: usize) -> Option<Dimension> {
    [Some(Dimension::Velocity), Some(Dimension::Velocity), Some(Dimension::Density)].get(parameter).copied().flatten()
}

pub(super) fn read(source: &Source) -> Option<Result<Found>> {
    if source.text.len() > 1 << 16 {
        return None;
    }
    let mut given: [Option<(usize, String)>; 6] = Default::default();
    let mut twice = None;
    for (n, line) in source.text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or("").trim();
        let Some((key, value)) = line.split_once(['=', ':']).or_else(|| line.split_once(char::is_whitespace)) else {
            continue;
        };
        let Some(at) = parameter(key) else { continue };
        if given[at].replace((n + 1, value.trim().trim_matches('"').to_string())).is_some() {
            twice = twice.or(Some((n + 1, key.trim().to_string())));
        }
    }
    // Epsilon, delta or gamma beside a speed is nobody else's.
    let recognised = given[0].is_some() && given[1].is_some() && given[3..].iter().any(Option::is_some);
    recognised.then(|| match twice {
        Some((line, key)) => Err(source.at(line)(Error::input(format!("{key} is given twice"), "keep one of them"))),
        None => of_values(source, &given),
    })
}

fn of_values(source: &Source, given: &[Option<(usize, String)>; 6]) -> Result<Found> {
    let missing: Vec<&str> = NAMES.iter().zip(given).filter(|(_, g)| g.is_none()).map(|(names, _)| names[0]).collect();
    if !missing.is_empty() {
        let problem = format!("{} missing of Thomsen's parameters", enumeration(&missing));
        return Err(Error::input(problem, "give Vp, Vs, density, epsilon, delta and gamma").at(source.place));
    }
    if source.unit.is_some() {
        return Err(
            Error::input("a unit of stress says nothing of Thomsen's parameters", "leave it out").at(source.place)
        );
    }
    let mut values = [0.0; 6];
    for (at, (value, given)) in values.iter_mut().zip(given).enumerate() {
        let Some((line, text)) = given else { continue };
        *value = value_of(at, text).map_err(|e| source.at(*line)(e.at(NAMES[at][0])))?;
    }
    let stiffness = stiffness(values).map_err(|e| e.at(source.place))?;
    let [vp, vs, density, ..] = values.map(number);
    let read_as = format!("Thomsen's parameters (exact, axis e3), Vp {vp} m/s, Vs {vs} m/s, density {density} kg/m3");
    Ok(Found { density: Some(values[2]), ..Found::new(stiffness, read_as) })
}

/// A parameter in SI; a speed and a density need their units.
fn value_of(at: usize, text: &str) -> Result<f64> {
    let bare = Figure::of(text).map(|f| f.value);
    match (dimension(at), bare) {
        (None, Some(value)) => Ok(value),
        (None, None) => {
            Err(Error::input(format!("{} is not a finite number", crate::words::quoted(text)), "write a plain number"))
        }
        (Some(Dimension::Velocity), Some(v)) => Err(Error::input(
            format!("no unit is named: {v} may be {v} m/s or {v} km/s"),
            "write it with its unit, as 3300 m/s",
        )),
        (Some(_), Some(v)) => Err(Error::input(
            format!("no unit is named: {v} may be {v} kg/m3 or {v} g/cm3"),
            "write it with its unit, as 2650 kg/m3",
        )),
        (Some(dimension), None) => dimension.parse(text),
    }
}
