//! c11 … c66 by name: what a symmetry class implies of the components that are not given, and refuses of those that are.
//!
//! A class is a linear subspace of the 21 components, the range of its projector. Every question about given components is
//! one about rows of that projector: a component follows from others if its row is a combination of theirs.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Rotation3, SMatrix, Vector3};

use super::digits::half_digit;
use super::{StressUnit, Units};
use crate::tree::{Entry, Node, place};
use crate::words::{enumeration, number};
use anisobond::tensor::{Stiffness, SymmetryClass, closure, mandel_weight, project};
use anisobond::{Error, Result};

/// Largest deviation from a class's relations accepted as rounding, relative to the largest component.
pub(super) const CONTRADICTION: f64 = 1e-6;

/// Below this a row of a projector counts as zero.
const ZERO: f64 = 1e-9;

/// One of the 21 components, as (row, column) from 0 with row ≤ column.
pub type Component = (usize, usize);

/// The component a key names: "c13" and "c31" are the same; `None` if it names none.
pub fn component_of(key: &str) -> Option<Component> {
    let digit = |b: u8| (b'1'..=b'6').contains(&b).then(|| (b - b'1') as usize);
    match *key.as_bytes() {
        [b'c', a, b] => {
            let (a, b) = (digit(a)?, digit(b)?);
            Some((a.min(b), a.max(b)))
        }
        _ => None,
    }
}

/// The 21 components, row by row of the upper triangle.
fn all() -> impl Iterator<Item = Component> {
    (0..6).flat_map(|a| (a..6).map(move |b| (a, b)))
}

/// c11 c12 … c66.
pub fn names() -> Vec<String> {
    all().map(name).collect()
}

/// "c12".
pub fn name((a, b): Component) -> String {
    format!("c{}{}", a + 1, b + 1)
}

/// Position of a component in [`all`].
fn index((a, b): Component) -> usize {
    6 * a + b - a * (a + 1) / 2
}

/// A component of a file.
struct Given<'n> {
    component: Component,
    /// Pa.
    value: f64,
    /// Half a unit of its last digit (Pa).
    half: f64,
    entry: &'n Entry,
}

/// The stiffness (Pa) of the components of a table, and what of them is not the class's to the last digit; `first` is the entry
/// of one of them. Where digits allow it, components that contradict the class are made the class's: the closest tensor of it.
pub(super) fn stiffness_of(
    table: &Node,
    first: &Entry,
    units: &Units,
    class: Option<SymmetryClass>,
) -> Result<(Stiffness, Option<String>)> {
    let given = given(table, units)?;
    let unit = units.shown();
    let (voigt, off) = match class {
        Some(class) => complete(&Setting::of_components(class, &given), &given, &unit, first)?,
        None => (at_least_orthotropic(&given, first)?, None),
    };
    let stiffness = Stiffness::from_voigt(&voigt).map_err(|e| e.at(place(first.line, &first.key)))?;
    Ok((stiffness, off))
}

/// Every component of a table, each once: c12 and c21 must agree.
fn given<'n>(table: &'n Node, units: &Units) -> Result<Vec<Given<'n>>> {
    let mut given: Vec<Given> = Vec::new();
    for entry in table.entries() {
        let Some(component) = component_of(&entry.key) else { continue };
        let value = units.stress(&entry.value, &entry.key)?;
        match given.iter().find(|g| g.component == component) {
            None => {
                let size = units.shown().size;
                given.push(Given { component, value, half: size * half_digit(value / size), entry });
            }
            Some(twin) if (twin.value - value).abs() <= CONTRADICTION * value.abs().max(twin.value.abs()) => {}
            Some(twin) => {
                let (unit, key) = (units.shown(), &twin.entry.key);
                return Err(Error::input(
                    format!("{} = {} contradicts {key} = {}", entry.key, unit.show(value), unit.show(twin.value)),
                    "the matrix is symmetric: keep one of them",
                )
                .at(place(entry.line, &entry.key)));
            }
        }
    }
    Ok(given)
}

/// What counts as rounding among given components (Pa).
fn rounding(given: &[Given]) -> f64 {
    CONTRADICTION * given.iter().fold(0.0, |largest: f64, g| largest.max(g.value.abs()))
}

/// Components as they are: the nine of orthotropy are needed, others are zero where not given.
fn at_least_orthotropic(given: &[Given], first: &Entry) -> Result<Matrix6<f64>> {
    let mut voigt = Matrix6::zeros();
    for g in given {
        let (a, b) = g.component;
        voigt[(a, b)] = g.value;
        voigt[(b, a)] = g.value;
    }
    let has = |c: &Component| given.iter().any(|g| g.component == *c);
    let missing: Vec<String> = ORTHOTROPIC.iter().filter(|c| !has(c)).map(|&c| name(c)).collect();
    if missing.is_empty() {
        return Ok(voigt);
    }
    Err(Error::input(
        format!("{} missing", enumeration(&missing)),
        "add at least the nine constants of orthotropy, or name the class that implies them, as class = \"cubic\"",
    )
    .at(place(first.line, &first.key)))
}

const ORTHOTROPIC: [Component; 9] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2), (3, 3), (4, 4), (5, 5)];

/// A class in one of its usual axes: its group, and the constants that determine a tensor, as textbooks name them.
pub(super) struct Setting {
    class: SymmetryClass,
    group: Vec<Matrix3<f64>>,
    constants: Vec<Component>,
    /// " (mirror normal to e2)" where axes are chosen.
    remark: &'static str,
}

impl Setting {
    /// The setting that the components named with a value larger than rounding (or else just named) point to.
    fn of_components(class: SymmetryClass, given: &[Given]) -> Self {
        let rounding = rounding(given);
        let count = |c: &[Component]| {
            let named = given.iter().filter(|g| c.contains(&g.component));
            named.fold((0, 0), |(value, name), g| (value + usize::from(g.value.abs() > rounding), name + 1))
        };
        Setting::chosen(class, count)
    }

    /// The setting that a matrix's entries point to: of those larger than rounding, or where that is not the class's, the one that is
    /// closest.
    pub fn of_matrix(class: SymmetryClass, stiffness: &Stiffness) -> Self {
        let voigt = stiffness.voigt();
        let above = |share: f64| {
            let least = share * voigt.amax();
            Setting::chosen(class, |c| (c.iter().filter(|&&c| voigt[c].abs() > least).count(), 0))
        };
        let own = |setting: &Setting| stiffness.relative_error(&setting.project(stiffness));
        let settings = [CONTRADICTION, 3e-3, 1e-2, 3e-2].map(above);
        let closest = settings.into_iter().reduce(|best, next| if own(&next) < own(&best) { next } else { best });
        closest.unwrap_or_else(|| above(CONTRADICTION))
    }

    /// `count`: how many components of a set have a value, and how many are named.
    fn chosen(class: SymmetryClass, count: impl Fn(&[Component]) -> (usize, usize)) -> Self {
        const E3: [Component; 4] = [(0, 5), (1, 5), (2, 5), (3, 4)];
        const E2: [Component; 4] = [(0, 4), (1, 4), (2, 4), (3, 5)];
        const E1: [Component; 4] = [(0, 3), (1, 3), (2, 3), (4, 5)];
        let turn = |axis: Vector3<f64>, fold: u32| {
            let angle = std::f64::consts::TAU / fold as f64;
            closure(&[*Rotation3::from_scaled_axis(axis * angle).matrix()])
        };
        let nine = || ORTHOTROPIC.to_vec();
        let five = [(0, 0), (2, 2), (0, 1), (0, 2), (3, 3)];
        let (constants, own_group, remark): (Vec<Component>, _, _) = match class {
            SymmetryClass::Isotropic => (vec![(0, 0), (0, 1)], None, ""),
            SymmetryClass::Cubic => (vec![(0, 0), (0, 1), (3, 3)], None, ""),
            SymmetryClass::TransverselyIsotropic => (five.to_vec(), None, ""),
            SymmetryClass::Tetragonal if count(&E3).0 > 0 => {
                ([&five[..], &[(5, 5), (0, 5)]].concat(), Some(turn(Vector3::z(), 4)), " (with c16)")
            }
            SymmetryClass::Tetragonal => ([&five[..], &[(5, 5)]].concat(), None, ""),
            SymmetryClass::Trigonal if count(&E2).0 > 0 => {
                ([&five[..], &[(0, 3), (0, 4)]].concat(), Some(turn(Vector3::z(), 3)), " (with c15)")
            }
            SymmetryClass::Trigonal => ([&five[..], &[(0, 3)]].concat(), None, ""),
            SymmetryClass::Orthotropic => (nine(), None, ""),
            SymmetryClass::Monoclinic => {
                let settings = [
                    (E1, Vector3::x(), " (mirror normal to e1)"),
                    (E2, Vector3::y(), " (mirror normal to e2)"),
                    (E3, Vector3::z(), " (mirror normal to e3)"),
                ];
                // The last of equals: e3.
                let best = settings.into_iter().max_by_key(|(own, ..)| count(own));
                let (own, normal, remark) = best.unwrap_or((E3, Vector3::z(), ""));
                ([nine(), own.to_vec()].concat(), Some(turn(normal, 2)), remark)
            }
            SymmetryClass::Triclinic => (all().collect(), None, ""),
        };
        Setting { class, group: own_group.unwrap_or_else(|| class.group()), constants, remark }
    }

    /// The closest tensor of the class in these axes.
    pub fn project(&self, c: &Stiffness) -> Stiffness {
        match self.class {
            SymmetryClass::Isotropic => self.class.project(c),
            _ => project(&self.group, c),
        }
    }

    /// The projector as a matrix on the 21 Voigt components: its row k is the k-th component of a projection.
    fn projector(&self) -> SMatrix<f64, 21, 21> {
        let mut projector = SMatrix::zeros();
        for (column, (a, b)) in all().enumerate() {
            let mut mandel = Matrix6::zeros();
            mandel[(a, b)] = mandel_weight(a) * mandel_weight(b);
            let image = self.project(&Stiffness::from_mandel(mandel)).voigt();
            for (row, component) in all().enumerate() {
                projector[(row, column)] = image[component];
            }
        }
        projector
    }

    /// "class trigonal (with c15)".
    fn words(&self) -> String {
        format!("class {}{}", self.class.name(), self.remark)
    }
}

/// The 21 components of the class from those given, and what was not the class's to the last digit.
fn complete(
    setting: &Setting,
    given: &[Given],
    unit: &StressUnit,
    first: &Entry,
) -> Result<(Matrix6<f64>, Option<String>)> {
    let rows = Rows(setting.projector());
    let (independent, off) = independent(setting, &rows, given, unit)?;
    let basis: Vec<Component> = independent.iter().map(|g| g.component).collect();
    let mut voigt = Matrix6::zeros();
    for component in all() {
        let Some(factors) = rows.express(component, &basis) else {
            return Err(too_few(setting, &rows, &basis, given).at(place(first.line, &first.key)));
        };
        let value = combine(&factors, &independent);
        voigt[component] = value;
        voigt[(component.1, component.0)] = value;
    }
    let Some((g, implied)) = off else { return Ok((voigt, None)) };
    // All that is given, then the closest tensor of the class: the mean of what should be equal.
    for Given { component: (a, b), value, .. } in given {
        voigt[(*a, *b)] = *value;
        voigt[(*b, *a)] = *value;
    }
    let voigt = setting.project(&Stiffness::from_voigt(&voigt)?).voigt();
    let words = format!(
        "made {} within the digits given ({} = {}, where the others say {})",
        setting.class.name(),
        g.entry.key,
        unit.show(g.value),
        unit.show(implied)
    );
    Ok((voigt, Some(words)))
}

/// A component, and what it should be by the others (Pa).
type Off<'g, 'n> = (&'g Given<'n>, f64);

/// Given components of which none follows from the others, and the one that is furthest from what follows, if that is not
/// rounding; refuses one that contradicts those before it by more than the digits of all of them. The class's own
/// constants come first, so that a contradiction reads as in a textbook: c66 against (c11 − c12)/2.
fn independent<'g, 'n>(
    setting: &Setting,
    rows: &Rows,
    given: &'g [Given<'n>],
    unit: &StressUnit,
) -> Result<(Vec<&'g Given<'n>>, Option<Off<'g, 'n>>)> {
    let rank = |g: &&Given| setting.constants.iter().position(|c| *c == g.component).unwrap_or(21);
    let mut ordered: Vec<&Given> = given.iter().collect();
    ordered.sort_by_key(|g| (rank(g), index(g.component)));
    let tolerance = rounding(given);
    let mut independent: Vec<&Given> = Vec::new();
    let mut off: Option<Off> = None;
    for g in ordered {
        let basis: Vec<Component> = independent.iter().map(|g| g.component).collect();
        let Some(factors) = rows.express(g.component, &basis) else {
            independent.push(g);
            continue;
        };
        let implied = combine(&factors, &independent);
        let difference = (g.value - implied).abs();
        let digits: f64 = factors.iter().zip(&independent).map(|(factor, i)| factor.abs() * i.half).sum();
        let digits = if factors.iter().all(|factor| *factor == 0.0) { 0.0 } else { digits + g.half };
        // Two numbers that differ by a whole digit are not one.
        if (difference > tolerance && difference >= digits * (1.0 - 1e-9)) || !difference.is_finite() {
            return Err(contradiction(setting, g, &formula(&factors, &basis), implied, unit));
        }
        let further = off.is_none_or(|(other, implied)| (other.value - implied).abs() < difference);
        if difference > tolerance && further {
            off = Some((g, implied));
        }
    }
    Ok((independent, off))
}

fn combine(factors: &[f64], given: &[&Given]) -> f64 {
    factors.iter().zip(given).map(|(factor, g)| if *factor == 0.0 { 0.0 } else { factor * g.value }).sum()
}

/// "c66 = 153 GPa contradicts (c11 − c12)/2 = 152.5 GPa of class trigonal".
fn contradiction(setting: &Setting, g: &Given, formula: &str, implied: f64, unit: &StressUnit) -> Error {
    let (key, value, words) = (&g.entry.key, unit.show(g.value), setting.words());
    let problem = match formula {
        "0" => format!("{key} = {value} contradicts {words}, where it is 0"),
        _ => format!("{key} = {value} contradicts {formula} = {} of {words}", unit.show(implied)),
    };
    Error::input(problem, format!("correct it, leave {key} out, or name a class with less symmetry"))
        .at(place(g.entry.line, key))
}

/// Which constants would complete the given ones, each with those that would do in its place.
fn too_few(setting: &Setting, rows: &Rows, basis: &[Component], given: &[Given]) -> Error {
    let free = |basis: &[Component]| all().filter(|&c| rows.express(c, basis).is_none()).collect::<Vec<_>>();
    let mut full = basis.to_vec();
    let mut missing = Vec::new();
    while let Some(next) = setting.constants.iter().copied().find(|&c| rows.express(c, &full).is_none()) {
        full.push(next);
        missing.push(next);
    }
    let alternatives = |one: &Component| {
        let others: Vec<Component> = full.iter().copied().filter(|c| c != one).collect();
        let others: Vec<String> = free(&others).into_iter().filter(|c| c != one).map(name).collect();
        if others.is_empty() { name(*one) } else { format!("{} (or {})", name(*one), others.join(", ")) }
    };
    let wanted: Vec<String> = missing.iter().map(alternatives).collect();
    let named: Vec<&str> = given.iter().map(|g| g.entry.key.as_str()).collect();
    Error::input(
        format!(
            "{} needs {} independent constants but has {} (from {})",
            setting.words(),
            setting.constants.len(),
            basis.len(),
            enumeration(&named)
        ),
        format!("add {}", enumeration(&wanted)),
    )
}

/// Rows of a class's projector.
struct Rows(SMatrix<f64, 21, 21>);

impl Rows {
    /// Factors f with component = Σ fₙ basisₙ for every tensor of the class; `None` if it does not follow from them.
    /// The relations of all classes have factors that are multiples of ½, and are rounded to them.
    fn express(&self, component: Component, basis: &[Component]) -> Option<Vec<f64>> {
        let target = DVector::from_iterator(21, self.0.row(index(component)).iter().copied());
        if target.amax() < ZERO {
            return Some(vec![0.0; basis.len()]);
        }
        if let Some(own) = basis.iter().position(|c| *c == component) {
            return Some((0..basis.len()).map(|n| if n == own { 1.0 } else { 0.0 }).collect());
        }
        if basis.is_empty() {
            return None;
        }
        let columns = DMatrix::from_fn(21, basis.len(), |row, n| self.0[(index(basis[n]), row)]);
        let factors = columns.clone().svd(true, true).solve(&target, ZERO).ok()?;
        if (columns * &factors - target).amax() > ZERO {
            return None;
        }
        let rounded = |f: f64| if (2.0 * f - (2.0 * f).round()).abs() < ZERO { (2.0 * f).round() / 2.0 } else { f };
        Some(factors.iter().map(|&f| rounded(f) + 0.0).collect())
    }
}

/// "(c11 − c12)/2", "−c14", "c12 + 2 c44", "0".
fn formula(factors: &[f64], basis: &[Component]) -> String {
    let halves = factors.iter().any(|f| f.abs() == 0.5) && factors.iter().filter(|f| **f != 0.0).count() > 1;
    let scale = if halves { 2.0 } else { 1.0 };
    let mut sum = String::new();
    for (factor, component) in factors.iter().zip(basis).filter(|(factor, _)| **factor != 0.0) {
        let factor = factor * scale;
        sum += match (sum.is_empty(), factor < 0.0) {
            (true, false) => "",
            (true, true) => "−",
            (false, false) => " + ",
            (false, true) => " − ",
        };
        if factor.abs() != 1.0 {
            sum += &format!("{} ", number(factor.abs()));
        }
        sum += &name(*component);
    }
    match (sum.is_empty(), halves) {
        (true, _) => "0".into(),
        (false, true) => format!("({sum})/2"),
        (false, false) => sum,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn formulas(class: SymmetryClass, names: &[&str]) -> Vec<String> {
        let setting = Setting::chosen(class, |_| (0, 0));
        let rows = Rows(setting.projector());
        let target = |key: &&str| component_of(key).unwrap();
        let formula = |c| formula(&rows.express(c, &setting.constants).unwrap(), &setting.constants);
        names.iter().map(target).map(formula).collect()
    }

    #[test]
    fn relations_read_as_in_textbooks() {
        assert_eq!(formulas(SymmetryClass::Isotropic, &["c33", "c44", "c15"]), ["c11", "(c11 − c12)/2", "0"]);
        assert_eq!(formulas(SymmetryClass::TransverselyIsotropic, &["c66", "c55"]), ["(c11 − c12)/2", "c44"]);
        assert_eq!(formulas(SymmetryClass::Trigonal, &["c24", "c56", "c66"]), ["−c14", "c14", "(c11 − c12)/2"]);
    }

    #[test]
    fn the_constants_of_every_class_determine_it() {
        for class in SymmetryClass::ALL {
            let setting = Setting::chosen(class, |_| (0, 0));
            let rows = Rows(setting.projector());
            assert_eq!(setting.constants.len(), class.constants());
            for component in all() {
                let factors = rows.express(component, &setting.constants).unwrap();
                assert!(factors.iter().all(|f| (2.0 * f).fract() == 0.0), "{class:?} {component:?} {factors:?}");
            }
            for n in 0..setting.constants.len() {
                let mut fewer = setting.constants.clone();
                let left_out = fewer.remove(n);
                assert!(rows.express(left_out, &fewer).is_none(), "{class:?} {left_out:?}");
            }
        }
    }

    #[test]
    fn component_names() {
        assert_eq!(component_of("c31"), Some((0, 2)));
        assert_eq!([component_of("c17"), component_of("c1"), component_of("C11"), component_of("c011")], [None; 4]);
        assert!(all().enumerate().all(|(n, c)| index(c) == n));
    }
}
