//! What no matter has: stiffnesses, densities, speeds of waves and Poisson ratios that are more likely a wrong unit or key than a
//! material, with the factor that would make them plausible.

use nalgebra::Matrix6;

use super::material::Material;
use super::stiffness::Stiffness;

/// Largest stiffness components (Pa): diamond and graphite have 1.1 TPa, under a megabar some metals twice that.
const STIFFEST: f64 = 2.5e12;
/// Components that a stiffness brought back by a factor is looked for in.
const USUAL: [f64; 2] = [1e9, 1.2e12];
/// Softest (Pa): gels have 100 Pa and more.
const SOFTEST: f64 = 100.0;
/// Densities (kg/m³) of solids, from light foams to osmium.
const DENSITIES: [f64; 2] = [10.0, 23_000.0];
/// Fastest waves (m/s): diamond 18 600.
const FASTEST: f64 = 25_000.0;
/// Slowest (m/s) that solids denser than [`DENSE`] have; loose soils, which are lighter, have 100 to 400.
const SLOWEST: f64 = 300.0;
/// (kg/m³)
const DENSE: f64 = 2200.0;

impl Material {
    /// What is not plausible of the material, in sentences without an end: a stiffness or a density that no matter has, waves
    /// faster or slower than in any, a Poisson ratio of the wrong pair. Empty for all that is known to be.
    ///
    /// ```
    /// use anisobond::tensor::{Material, Stiffness};
    /// let mut glass = Material::builtin("Pyroceram").unwrap();
    /// assert!(glass.doubts().is_empty());
    /// glass.density = Some(2.6);
    /// assert!(glass.doubts()[0].contains("1000 times"));
    /// ```
    pub fn doubts(&self) -> Vec<String> {
        let c = self.stiffness.voigt();
        let most = (0..6).map(|a| c[(a, a)]).fold(0.0, f64::max);
        let stiffness = stiffness(most);
        let density = self.density.and_then(density);
        let speed = match (self.density, &stiffness, &density) {
            (Some(density), None, None) => speed(most, density),
            _ => None,
        };
        let crystal = match (&stiffness, &speed) {
            (None, None) => too_soft_a_crystal(&self.name, most),
            _ => None,
        };
        let own = stiffness.into_iter().chain(density).chain(speed).chain(crystal);
        own.chain(wrong_pairs(&self.stiffness)).collect()
    }
}

/// A length that is not plausible where a continuum is computed, `what` it is of; `None` for what may be.
pub fn doubtful_length(what: &str, metres: f64) -> Option<String> {
    let (word, factor, units) = match metres {
        x if x <= 0.0 || !x.is_finite() => return None,
        x if x < 1e-10 => ("smaller than an atom", 1e3, "a unit a thousand or a million times larger"),
        x if x > 1e5 => ("as large as a country", 1e-3, "a unit a thousand times smaller, as mm for m"),
        _ => return None,
    };
    let times = if factor > 1.0 { "1000 times" } else { "0.001 times" };
    let (own, other) = (shown(metres), shown(metres * factor));
    Some(format!("{what} of {own} m is {word}; {times} that is {other} m: is it {units}?"))
}

fn stiffness(most: f64) -> Option<String> {
    let own = gpa(most);
    if most > STIFFEST {
        let [factor, unit] = [(0.1, "kbar"), (1e-3, "MPa"), (1e-6, "kPa"), (1e-9, "Pa"), (1e-12, "mPa")]
            .into_iter()
            .find(|(factor, _)| most * factor <= USUAL[1])
            .map(|(factor, unit)| [shown(factor), format!("{unit} read as GPa, or the like")])?;
        let other = gpa(most * factor.parse::<f64>().unwrap_or(1.0));
        return Some(format!(
            "the largest stiffness is {own}, and diamond has 1100 GPa; {factor} times that is {other}: is it {unit}?"
        ));
    }
    if most < SOFTEST {
        let factor = [1e9, 1e6, 1e12, 1e3].into_iter().find(|f| (USUAL[0]..=USUAL[1]).contains(&(most * f)))?;
        let other = gpa(most * factor);
        return Some(format!(
            "the largest stiffness is {own}, less than that of any gel; {} times that is {other}: is the unit GPa?",
            shown(factor)
        ));
    }
    None
}

/// Stiffest component (Pa) that the softest crystals have: those of rare gases have 1 to 5 GPa.
const SOFTEST_CRYSTAL: f64 = 5e8;

/// A material that is called by a chemical formula and is softer than any crystal.
fn too_soft_a_crystal(name: &str, most: f64) -> Option<String> {
    (most < SOFTEST_CRYSTAL && is_formula(name)).then(|| {
        let own = gpa(most);
        format!(
            "the largest stiffness of {name} is {own}, less than that of any crystal; 1000 times that is {}: is the unit GPa?",
            gpa(1e3 * most)
        )
    })
}

/// Whether a name is made of symbols of elements and numbers: SiO2, Ca2AgGe.
fn is_formula(name: &str) -> bool {
    const ELEMENTS: &str = " H He Li Be B C N O F Ne Na Mg Al Si P S Cl Ar K Ca Sc Ti V Cr Mn Fe Co Ni Cu Zn Ga Ge As Se Br Kr Rb Sr Y Zr \
                            Nb Mo Tc Ru Rh Pd Ag Cd In Sn Sb Te I Xe Cs Ba La Ce Pr Nd Pm Sm Eu Gd Tb Dy Ho Er Tm Yb Lu Hf Ta W Re Os Ir \
                            Pt Au Hg Tl Pb Bi Po At Rn Fr Ra Ac Th Pa U Np Pu ";
    let mut rest = name.trim();
    let mut told = name.chars().any(|c| c.is_ascii_digit());
    while rest.starts_with(|c: char| c.is_ascii_uppercase()) {
        let small = usize::from(rest[1..].starts_with(|c: char| c.is_ascii_lowercase()));
        let symbol = &rest[..=small];
        if !ELEMENTS.contains(&format!(" {symbol} ")) {
            return false;
        }
        told |= small > 0;
        rest = rest[1 + small..].trim_start_matches(|c: char| c.is_ascii_digit());
    }
    // Capitals alone (PU, C) are as often something else.
    rest.is_empty() && told
}

fn density(density: f64) -> Option<String> {
    let [least, most] = DENSITIES;
    let (why, factor, hint) = match density {
        x if x < least => ("lighter than any solid but an aerogel", 1000.0, "is it in g/cm³?"),
        x if x > most => ("denser than osmium (22 600)", 0.001, "is it in kg/m³?"),
        _ => return None,
    };
    let (own, other) = (shown(density), shown(density * factor));
    Some(format!("a density of {own} kg/m³ is {why}; {factor} times that is {other} kg/m³: {hint}"))
}

/// The fastest wave along an axis by the largest component, √(C/ρ).
fn speed(most: f64, density: f64) -> Option<String> {
    let speed = (most / density).sqrt();
    let words = |why: &str, hint: String| {
        Some(format!(
            "with {} and {} kg/m³ waves run at {} m/s, {why}; {hint}",
            gpa(most),
            shown(density),
            shown(speed.round())
        ))
    };
    if speed > FASTEST {
        let dense = 1000.0 * density;
        let hint = if dense < DENSITIES[1] {
            format!("1000 times the density is {} kg/m³: is it in g/cm³?", shown(dense))
        } else {
            "check the units of stiffness and density".into()
        };
        return words("faster than in diamond", hint);
    }
    if speed < SLOWEST && density > DENSE {
        let hint = format!("1000 times the stiffness is {}: is its unit GPa?", gpa(1e3 * most));
        return words("slower than in any solid as dense", hint);
    }
    None
}

/// Poisson ratios above 1 in the axes of an orthotropic tensor whose Young's moduli differ fourfold and more, where the ratio of the
/// other pair is an ordinary one.
fn wrong_pairs(stiffness: &Stiffness) -> Option<String> {
    let c = stiffness.voigt();
    let coupled = |a: usize, b: usize| (a >= 3 || b >= 3) && a != b && c[(a, b)].abs() > 1e-9 * c.amax();
    if (0..36).any(|n| coupled(n / 6, n % 6)) {
        return None;
    }
    let s: Matrix6<f64> = stiffness.compliance_voigt()?;
    let axis = ["x", "y", "z"];
    let pairs = [(0, 1), (1, 0), (1, 2), (2, 1), (2, 0), (0, 2)];
    pairs.into_iter().find_map(|(i, j)| {
        let (nu, other) = (-s[(i, j)] / s[(i, i)], -s[(i, j)] / s[(j, j)]);
        let bound = (s[(j, j)] / s[(i, i)]).sqrt();
        (nu.abs() > 1.0 && (0.05..0.5).contains(&other.abs()) && bound > 2.0 && nu.abs() > 0.5 * bound).then(|| {
            let (x, y) = (axis[i], axis[j]);
            format!(
                "nu_{x}{y} is {} (below √(e{x}/e{y}) = {} it must be), for nu_{y}{x} = {}: if {2} was meant for tension along \
                 {x}, the key is nu_{x}{y}",
                shown(nu),
                shown(bound),
                shown(other)
            )
        })
    })
}

/// A stiffness in the unit that suits it.
fn gpa(x: f64) -> String {
    let (size, unit) = [(1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa")].into_iter().find(|u| x >= u.0).unwrap_or((1.0, "Pa"));
    format!("{} {unit}", shown(x / size))
}

/// Four significant digits at most.
fn shown(x: f64) -> String {
    let rounded: f64 = format!("{x:.3e}").parse().unwrap_or(x);
    if rounded == 0.0 || (1e-4..1e7).contains(&rounded.abs()) { format!("{rounded}") } else { format!("{rounded:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tensor::miss::ply;

    fn material(stiffness: Stiffness, density: Option<f64>) -> Material {
        Material { name: String::new(), stiffness, density, source: String::new() }
    }

    #[test]
    fn what_there_is_raises_no_doubt() {
        for name in Material::builtin_names() {
            assert_eq!(Material::builtin(name).unwrap().doubts(), Vec::<String>::new(), "{name}");
        }
        // Foam, gel, loose soil, rubber, osmium, diamond, cork, ply; bulk and shear modulus (Pa), density.
        for (k, g, density) in [
            (5e6, 3e6, 15.0),
            (1e4, 3e2, 1000.0),
            (1e8, 4e7, 1700.0),
            (2e9, 1e6, 1100.0),
            (411e9, 228e9, 22_590.0),
            (443e9, 535e9, 3515.0),
            (1e7, 6e6, 200.0),
        ] {
            let m = material(Stiffness::isotropic(k - 2.0 * g / 3.0, g), Some(density));
            assert_eq!(m.doubts(), Vec::<String>::new());
        }
        assert_eq!(material(ply(), Some(1600.0)).doubts(), Vec::<String>::new());
    }

    #[test]
    fn what_there_is_not_says_the_factor() {
        let quartz = Stiffness::isotropic(7e9, 40e9);
        for (scale, density, part) in [
            (1e3, None, "0.001 times that is 87 GPa"),
            (1e9, None, "1e-9 times that is 87 GPa"),
            (100.0, None, "0.1 times that is 870 GPa: is it kbar"),
            (1e-9, None, "1e9 times that is 87 GPa: is the unit GPa?"),
            (1.0, Some(2.65), "1000 times that is 2650 kg/m³: is it in g/cm³?"),
            (1.0, Some(2.65e6), "0.001 times that is 2650 kg/m³"),
            (1.0, Some(19.3), "1000 times the density is 19300 kg/m³"),
            (1e-3, Some(2650.0), "1000 times the stiffness is 87 GPa: is its unit GPa?"),
        ] {
            let doubts = material(quartz.scaled(scale), density).doubts();
            assert!(doubts.len() == 1 && doubts[0].contains(part), "{doubts:?}");
        }
    }

    #[test]
    fn a_ratio_of_the_wrong_pair_names_the_likely_key() {
        // E 140/10 GPa; 0.25 was meant for tension along x, and given for tension along y.
        let (e1, e2, g, nu21) = (140e9, 10e9, 5e9, 0.25);
        let mut s =
            Matrix6::from_diagonal(&nalgebra::Vector6::new(1.0 / e1, 1.0 / e2, 1.0 / e2, 1.0 / g, 1.0 / g, 1.0 / g));
        (s[(0, 1)], s[(1, 0)]) = (-nu21 / e2, -nu21 / e2);
        let c = Stiffness::from_compliance_voigt(&s).unwrap();
        let doubts = material(c, None).doubts();
        assert!(doubts.len() == 1 && doubts[0].contains("nu_xy is 3.5 (below √(ex/ey) = 3.742"), "{doubts:?}");
        assert!(doubts[0].ends_with("the key is nu_xy"), "{doubts:?}");
    }

    #[test]
    fn formulas_softer_than_any_crystal() {
        for (name, formula) in [
            ("SiO2", true),
            ("Ca2AgGe", true),
            ("Si", true),
            ("PU", false),
            ("rock", false),
            ("Balsa", false),
            ("C", false),
        ] {
            let soft = Material { name: name.into(), ..material(Stiffness::isotropic(40e6, 20e6), None) };
            assert_eq!(soft.doubts().len(), usize::from(formula), "{name}");
            let hard = Material { name: name.into(), ..material(Stiffness::isotropic(40e9, 20e9), None) };
            assert!(hard.doubts().is_empty());
        }
    }

    #[test]
    fn lengths_of_atoms_and_countries() {
        assert!(doubtful_length("a spacing", 1e-3).is_none() && doubtful_length("a spacing", 1e3).is_none());
        assert!(doubtful_length("a spacing", 2e-12).unwrap().contains("1000 times that is 2e-9 m"));
        assert!(doubtful_length("a spacing", 2e6).unwrap().contains("0.001 times that is 2000 m"));
    }
}
