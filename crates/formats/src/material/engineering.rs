//! Engineering constants: Young's moduli, Poisson's ratios and shear moduli.
//!
//! ν_ij = −ε_j/ε_i under stress along i, and ν_ij/E_i = ν_ji/E_j: the compliance is s_ii = 1/E_i, s_ij = −ν_ij/E_i,
//! s44 = 1/G_yz, s55 = 1/G_zx, s66 = 1/G_xy.

use nalgebra::Matrix6;

use super::Units;
use super::components::CONTRADICTION;
use super::digits::half_digit;
use crate::tree::{Node, place};
use crate::words::{enumeration, known_elsewhere, nearest_key, number, quoted};
use anisobond::tensor::{Stiffness, SymmetryClass};
use anisobond::{Error, Result};

/// An engineering constant by its canonical name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Name {
    /// `e`, `nu`, `g`, `k`, `lambda`: of every direction.
    E,
    Nu,
    G,
    K,
    Lambda,
    /// E_i.
    Young(usize),
    /// G about axis i: 0 for yz, 1 for zx, 2 for xy.
    Shear(usize),
    /// ν_ij.
    Poisson(usize, usize),
}

const KEYS: [&str; 17] = [
    "e", "nu", "g", "k", "lambda", "ex", "ey", "ez", "gyz", "gzx", "gxy", "nu_xy", "nu_yx", "nu_yz", "nu_zy", "nu_zx",
    "nu_xz",
];

impl Name {
    /// From a key: x y z or 1 2 3, with or without underscores.
    fn of(key: &str) -> Option<Self> {
        let plain: String = key.chars().filter(|&c| c != '_').collect();
        let axis = |b: u8| b"xyz".iter().position(|&x| x == b).or_else(|| b"123".iter().position(|&x| x == b));
        match *plain.as_bytes() {
            [b'e'] => Some(Name::E),
            [b'n', b'u'] => Some(Name::Nu),
            [b'g'] => Some(Name::G),
            [b'k'] => Some(Name::K),
            [b'e', i] => Some(Name::Young(axis(i)?)),
            [b'g', i, j] => {
                let (i, j) = (axis(i)?, axis(j)?);
                (i != j).then(|| Name::Shear(3 - i - j))
            }
            [b'n', b'u', i, j] => {
                let (i, j) = (axis(i)?, axis(j)?);
                (i != j).then_some(Name::Poisson(i, j))
            }
            _ => (plain == "lambda").then_some(Name::Lambda),
        }
    }

    /// As documented: `nu_xy`.
    fn key(self) -> String {
        match self {
            Name::E => "e".into(),
            Name::Nu => "nu".into(),
            Name::G => "g".into(),
            Name::K => "k".into(),
            Name::Lambda => "lambda".into(),
            Name::Young(i) => format!("e{}", axis(i)),
            Name::Shear(i) => ["gyz", "gzx", "gxy"][i].into(),
            Name::Poisson(i, j) => format!("nu_{}{}", axis(i), axis(j)),
        }
    }

    fn is_of_every_direction(self) -> bool {
        matches!(self, Name::E | Name::Nu | Name::G | Name::K | Name::Lambda)
    }

    fn is_ratio(self) -> bool {
        matches!(self, Name::Nu | Name::Poisson(..))
    }
}

/// Whether a key is an engineering constant, and a ratio among them.
pub fn ratio(key: &str) -> Option<bool> {
    Name::of(key).map(Name::is_ratio)
}

/// A constant that is known, and where from.
#[derive(Clone, Debug)]
struct Known {
    name: Name,
    /// Pa, or a ratio.
    value: f64,
    /// How much of it its digits, or those of what it follows from, leave open (of the same unit).
    half: f64,
    /// The key as written, or the formula it follows from.
    from: String,
    /// Whether it stands in the file.
    given: bool,
    line: usize,
}

impl Known {
    /// Relative uncertainty of its digits.
    fn open(&self) -> f64 {
        if self.value == 0.0 { 0.0 } else { self.half / self.value.abs() }
    }
}

/// The constants known so far.
struct Constants<'u> {
    known: Vec<Known>,
    units: &'u Units,
    class: SymmetryClass,
    /// Line of the table.
    line: usize,
    /// What differs within its digits from what follows from the others, in words.
    notes: Vec<String>,
}

/// The stiffness (Pa) of the table `[engineering]`, its class, the one named or that of the keys, and what differs within its
/// digits from what follows from the others.
pub(super) fn stiffness_of(
    node: &Node,
    units: &Units,
    claimed: Option<SymmetryClass>,
) -> Result<(Stiffness, SymmetryClass, Vec<String>)> {
    let known = read(node, units)?;
    let class = match claimed {
        Some(class) => class,
        None => inferred(node, &known)?,
    };
    let mut constants = Constants { known: Vec::new(), units, class, line: node.line, notes: Vec::new() };
    let stiffness = match class {
        SymmetryClass::Isotropic => isotropic(&mut constants, known)?,
        SymmetryClass::Cubic
        | SymmetryClass::TransverselyIsotropic
        | SymmetryClass::Tetragonal
        | SymmetryClass::Orthotropic => directional(&mut constants, known)?,
        _ => {
            return Err(node.wrong(
                "engineering",
                format!("class {} has no engineering constants here", class.name()),
                "use isotropic, cubic, transversely-isotropic, tetragonal or orthotropic, or give stiffness or compliance",
            ));
        }
    };
    Ok((stiffness, class, constants.notes))
}

/// All keys of the table.
fn read(node: &Node, units: &Units) -> Result<Vec<Known>> {
    if node.entries().is_empty() {
        return Err(node.wrong(
            "engineering",
            format!("a table of constants is needed, not {}", node.described()),
            "write [engineering] and below it, for example, e = \"70 GPa\" and nu = 0.3",
        ));
    }
    let mut known = Vec::new();
    for entry in node.entries() {
        let key = format!("engineering.{}", entry.key);
        let name = Name::of(&entry.key).ok_or_else(|| unknown(&entry.key, entry.line))?;
        let value = if name.is_ratio() { entry.value.number(&key)? } else { units.stress(&entry.value, &key)? };
        let modulus = matches!(name, Name::E | Name::G | Name::K | Name::Young(_) | Name::Shear(_));
        if modulus && value <= 0.0 {
            return Err(entry.value.wrong(&key, "the modulus is not positive", "give a positive one"));
        }
        let size = if name.is_ratio() { 1.0 } else { units.shown().size };
        let half = size * half_digit(value / size);
        known.push(Known { name, value, half, from: entry.key.clone(), given: true, line: entry.line });
    }
    Ok(known)
}

fn unknown(key: &str, line: usize) -> Error {
    let remedy = match nearest_key(key, KEYS) {
        _ if super::KEYS.contains(&key) => format!("put {key} above [engineering]"),
        Some(name) => format!("did you mean {name}?"),
        None => known_elsewhere(key).unwrap_or_else(|| format!("use {}", KEYS.join(", "))),
    };
    Error::input(format!("unknown key {}", quoted(key)), remedy).at(place(line, "engineering"))
}

/// Whether a key is an engineering constant, or what others call one.
pub(super) fn names(key: &str) -> bool {
    Name::of(&key.to_lowercase()).is_some() || known_elsewhere(key).is_some_and(|own| own.contains(','))
}

/// The class that the keys belong to.
fn inferred(node: &Node, known: &[Known]) -> Result<SymmetryClass> {
    let every = known.iter().filter(|k| k.name.is_of_every_direction()).count();
    if every == known.len() {
        return Ok(SymmetryClass::Isotropic);
    }
    if every > 0 {
        return Err(node.wrong(
            "engineering",
            "constants of every direction (e, nu, g, k, lambda) are mixed with those of one",
            "give one kind, or name the class",
        ));
    }
    let orthotropic = known.iter().any(|k| k.name == Name::Young(1));
    Ok(if orthotropic { SymmetryClass::Orthotropic } else { SymmetryClass::TransverselyIsotropic })
}

impl Constants<'_> {
    fn get(&self, name: Name) -> Option<&Known> {
        self.known.iter().find(|k| k.name == name)
    }

    fn value(&self, name: Name) -> Option<f64> {
        self.get(name).map(|k| k.value)
    }

    /// Adds a constant; one that is known already must agree with it.
    fn add(&mut self, new: Known) -> Result<()> {
        let Some(old) = self.get(new.name) else {
            self.known.push(new);
            return Ok(());
        };
        let scale = if new.name.is_ratio() { 1.0 } else { new.value.abs().max(old.value.abs()) };
        let off = (old.value - new.value).abs();
        if off <= CONTRADICTION * scale {
            return Ok(());
        }
        // What stands in the file, and later in it, is named first.
        let (wrong, right) = if (new.given, new.line) > (old.given, old.line) { (&new, old) } else { (old, &new) };
        let show = |k: &Known| match k.name.is_ratio() {
            true => format!("{} = {}", k.from, number(k.value)),
            false => format!("{} = {}", k.from, self.units.shown().show(k.value)),
        };
        if off < (old.half + new.half) * (1.0 - 1e-9) {
            let note = format!("{} stands for {} within their digits", show(old), show(&new));
            if old.from != new.from && !self.notes.contains(&note) {
                self.notes.push(note);
            }
            return Ok(());
        }
        Err(Error::input(
            format!("{} contradicts {} of class {}", show(wrong), show(right), self.class.name()),
            "correct one of them, leave one out, or name a class with less symmetry",
        )
        .at(place(wrong.line.max(right.line), "engineering")))
    }

    /// Adds a constant that follows from others by a formula; `open` is the relative uncertainty of these.
    fn imply(&mut self, name: Name, value: f64, open: f64, formula: String) -> Result<()> {
        let line = self.line;
        self.add(Known { name, value, half: open * value.abs(), from: formula, given: false, line })
    }

    fn missing(&self, names: &[String]) -> Error {
        Error::input(
            format!("class {} needs {}", self.class.name(), enumeration(names)),
            "add that below [engineering], or name another class at the top of the file",
        )
        .at(place(self.line, "engineering"))
    }
}

/// Two of E, ν, G, K, λ; any others must agree.
fn isotropic(constants: &mut Constants, known: Vec<Known>) -> Result<Stiffness> {
    if let Some(other) = known.iter().find(|k| !k.name.is_of_every_direction()) {
        return Err(Error::input(
            format!("{} is of one direction, but class isotropic has none", other.from),
            "use two of e, nu, g, k, lambda",
        )
        .at(place(other.line, "engineering")));
    }
    known.into_iter().try_for_each(|k| constants.add(k))?;
    let [first, second, extra @ ..] = &constants.known[..] else {
        return Err(constants.missing(&["two of e, nu, g, k, lambda".to_string()]));
    };
    let extra = extra.to_vec();
    let from = format!("that of {} and {}", first.from, second.from);
    let open = first.open() + second.open();
    let lame = lame((first.name, first.value), (second.name, second.value));
    let (lambda, g) = lame.filter(|(lambda, g)| lambda.is_finite() && g.is_finite()).ok_or_else(|| {
        Error::input(
            format!("no isotropic material has {} and {} of these values", first.from, second.from),
            "keep nu between −1 and ½ and the moduli positive, or give another pair",
        )
        .at(place(second.line, "engineering"))
    })?;
    for extra in extra {
        constants.known.retain(|k| k.name != extra.name);
        constants.imply(extra.name, of_lame(extra.name, lambda, g), open, from.clone())?;
        constants.add(extra)?;
    }
    Ok(Stiffness::isotropic(lambda, g))
}

/// Lamé's λ and G from two constants; `None` if they do not determine them.
fn lame(first: (Name, f64), second: (Name, f64)) -> Option<(f64, f64)> {
    use Name::{E, G, K, Lambda, Nu};
    let of = |name: Name| [first, second].into_iter().find(|c| c.0 == name).map(|c| c.1);
    Some(match (of(E), of(Nu), of(G), of(K), of(Lambda)) {
        (Some(e), Some(nu), ..) => (e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu))),
        (Some(e), _, Some(g), ..) => (g * (e - 2.0 * g) / (3.0 * g - e), g),
        (Some(e), _, _, Some(k), _) => (3.0 * k * (3.0 * k - e) / (9.0 * k - e), 3.0 * k * e / (9.0 * k - e)),
        (Some(e), _, _, _, Some(l)) => (l, 0.25 * (e - 3.0 * l + (e * e + 9.0 * l * l + 2.0 * e * l).sqrt())),
        (_, Some(nu), Some(g), ..) => (2.0 * g * nu / (1.0 - 2.0 * nu), g),
        (_, Some(nu), _, Some(k), _) => (3.0 * k * nu / (1.0 + nu), 1.5 * k * (1.0 - 2.0 * nu) / (1.0 + nu)),
        (_, Some(nu), _, _, Some(l)) => (l, l * (1.0 - 2.0 * nu) / (2.0 * nu)),
        (_, _, Some(g), Some(k), _) => (k - 2.0 * g / 3.0, g),
        (_, _, Some(g), _, Some(l)) => (l, g),
        (_, _, _, Some(k), Some(l)) => (l, 1.5 * (k - l)),
        _ => return None,
    })
}

/// A constant of the isotropic material of λ and G.
fn of_lame(name: Name, lambda: f64, g: f64) -> f64 {
    match name {
        Name::E | Name::Young(_) => g * (3.0 * lambda + 2.0 * g) / (lambda + g),
        Name::Nu | Name::Poisson(..) => lambda / (2.0 * (lambda + g)),
        Name::G | Name::Shear(_) => g,
        Name::K => lambda + 2.0 * g / 3.0,
        Name::Lambda => lambda,
    }
}

/// Constants of directions, as many as the class needs; the others follow and must agree where given.
fn directional(constants: &mut Constants, known: Vec<Known>) -> Result<Stiffness> {
    for k in known {
        for name in meant(constants.class, &k)? {
            constants.add(Known { name, ..k.clone() })?;
        }
    }
    for group in equal(constants.class) {
        spread(constants, group)?;
    }
    reciprocity(constants)?;
    if constants.class == SymmetryClass::TransverselyIsotropic {
        plane_of_isotropy(constants)?;
        reciprocity(constants)?;
    }
    compliance(constants)
}

/// The directional constants that a key stands for: `e` of a cubic material is all of ex, ey, ez.
fn meant(class: SymmetryClass, k: &Known) -> Result<Vec<Name>> {
    let all = equal(SymmetryClass::Cubic);
    let of = |one: Name| all.iter().find(|group| group.contains(&one)).map_or(vec![], |group| group.to_vec());
    match (k.name, class) {
        (Name::E, SymmetryClass::Cubic) => Ok(of(Name::Young(0))),
        (Name::G, SymmetryClass::Cubic) => Ok(of(Name::Shear(0))),
        (Name::Nu, SymmetryClass::Cubic) => Ok(of(Name::Poisson(0, 1))),
        (name, _) if name.is_of_every_direction() => Err(Error::input(
            format!("{} says no direction, as class {} needs", k.from, class.name()),
            "use ex, ey, ez, gyz, gzx, gxy, nu_xy, nu_yz and nu_zx as far as the class needs them",
        )
        .at(place(k.line, "engineering"))),
        (name, _) => Ok(vec![name]),
    }
}

/// Constants that are equal in a class.
fn equal(class: SymmetryClass) -> &'static [&'static [Name]] {
    use Name::{Poisson, Shear, Young};
    match class {
        SymmetryClass::Cubic => &[
            &[Young(0), Young(1), Young(2)],
            &[Shear(0), Shear(1), Shear(2)],
            &[Poisson(0, 1), Poisson(1, 0), Poisson(1, 2), Poisson(2, 1), Poisson(2, 0), Poisson(0, 2)],
        ],
        SymmetryClass::TransverselyIsotropic | SymmetryClass::Tetragonal => &[
            &[Young(0), Young(1)],
            &[Shear(0), Shear(1)],
            &[Poisson(0, 1), Poisson(1, 0)],
            &[Poisson(2, 0), Poisson(2, 1)],
            &[Poisson(0, 2), Poisson(1, 2)],
        ],
        _ => &[],
    }
}

/// One known constant of a group gives the others.
fn spread(constants: &mut Constants, group: &[Name]) -> Result<()> {
    let known: Vec<Known> = group.iter().filter_map(|&name| constants.get(name).cloned()).collect();
    for k in &known {
        for &name in group {
            constants.add(Known { name, ..k.clone() })?;
        }
    }
    Ok(())
}

/// ν_ij/E_i = ν_ji/E_j for the three pairs.
fn reciprocity(constants: &mut Constants) -> Result<()> {
    for (i, j) in [(0, 1), (1, 0), (1, 2), (2, 1), (2, 0), (0, 2)] {
        let known = |name| constants.get(name);
        let all = (known(Name::Poisson(i, j)), known(Name::Young(i)), known(Name::Young(j)));
        if let (Some(nu), Some(ei), Some(ej)) = all {
            let formula = format!("{} {}/{}", nu.from, ej.from, ei.from);
            let value = nu.value * ej.value / ei.value;
            let open = nu.open() + ej.open() + ei.open();
            constants.imply(Name::Poisson(j, i), value, open, formula)?;
        }
    }
    Ok(())
}

/// G_xy = E_x/(2(1 + ν_xy)): two of the three give the third.
fn plane_of_isotropy(constants: &mut Constants) -> Result<()> {
    let (e, g, nu) = (Name::Young(0), Name::Shear(2), Name::Poisson(0, 1));
    let open: f64 = [e, g, nu].into_iter().filter_map(|name| Some(constants.get(name)?.open())).sum();
    match (constants.value(e), constants.value(g), constants.value(nu)) {
        (Some(e), _, Some(nu)) => constants.imply(g, e / (2.0 * (1.0 + nu)), open, "ex/(2(1 + nu_xy))".into())?,
        (Some(e), Some(g), None) => {
            constants.imply(nu, e / (2.0 * g) - 1.0, open, "ex/(2 gxy) − 1".into())?;
            spread(constants, &[nu, Name::Poisson(1, 0)])?;
        }
        (None, Some(g), Some(nu)) => {
            constants.imply(e, 2.0 * g * (1.0 + nu), open, "2 gxy (1 + nu_xy)".into())?;
            spread(constants, &[e, Name::Young(1)])?;
        }
        _ => {}
    }
    Ok(())
}

/// The stiffness of the nine constants of orthotropy.
fn compliance(constants: &Constants) -> Result<Stiffness> {
    let pairs = [(1, 2), (2, 0), (0, 1)];
    let mut missing: Vec<String> = Vec::new();
    let groups = equal(constants.class);
    let mut need = |name: Name, words: String| {
        let value = constants.value(name);
        // Of equal constants, the first stands for all; g_xy follows in a plane of isotropy.
        let follows = groups.iter().any(|group| group[1..].contains(&name))
            || (name == Name::Shear(2) && constants.class == SymmetryClass::TransverselyIsotropic);
        if value.is_none() && !follows {
            missing.push(words);
        }
        value.unwrap_or(f64::NAN)
    };
    let mut s = Matrix6::zeros();
    let e: Vec<f64> = (0..3).map(|i| need(Name::Young(i), Name::Young(i).key())).collect();
    for (axis, (i, j)) in pairs.into_iter().enumerate() {
        let words = format!("{} or {}", Name::Poisson(i, j).key(), Name::Poisson(j, i).key());
        let nu = need(Name::Poisson(i, j), words);
        s[(i, j)] = -nu / e[i];
        s[(j, i)] = s[(i, j)];
        s[(axis, axis)] = 1.0 / e[axis];
        s[(3 + axis, 3 + axis)] = 1.0 / need(Name::Shear(axis), Name::Shear(axis).key());
    }
    if !missing.is_empty() {
        if constants.class == SymmetryClass::Cubic {
            missing = vec!["e, nu and g".to_string()];
        }
        return Err(constants.missing(&missing));
    }
    within_bounds(constants)?;
    Stiffness::from_compliance_voigt(&s).map_err(|e| e.at(place(constants.line, "engineering")))
}

/// Refuses a ratio beyond its bound, |ν_ij| < √(E_i/E_j), with the key that is likely meant: that of the other pair.
fn within_bounds(constants: &Constants) -> Result<()> {
    let given = constants.known.iter().filter(|k| k.given);
    for k in given {
        let Name::Poisson(i, j) = k.name else { continue };
        let (Some(ei), Some(ej)) = (constants.value(Name::Young(i)), constants.value(Name::Young(j))) else { continue };
        let bound = (ei / ej).sqrt();
        if k.value.abs() < bound {
            continue;
        }
        let [ex, ey] = [i, j].map(|axis| Name::Young(axis).key());
        let (own, other) = (Name::Poisson(i, j).key(), Name::Poisson(j, i).key());
        let remedy = match k.value.abs() < 1.0 / bound {
            true => {
                format!("if it is the strain along {} under tension along {}, its key is {other}", axis(i), axis(j))
            }
            false => format!("check {own}, {ex} and {ey}"),
        };
        let problem = format!("{} = {} must be below √({ex}/{ey}) = {}", k.from, number(k.value), number(bound));
        return Err(Error::input(problem, remedy).at(place(k.line, "engineering")));
    }
    Ok(())
}

/// x, y or z.
fn axis(i: usize) -> &'static str {
    ["x", "y", "z"][i]
}
