//! Sentences of error messages: the nearest valid name, enumerations, and offending values kept short.

/// Longest piece of the user's text repeated in a message.
const SHOWN: usize = 40;

/// The valid name closest to a wrong one: letter case and separators aside, within a third of its letters.
pub(super) fn nearest<'a>(wrong: &str, valid: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let letters =
        |name: &str| name.chars().take(SHOWN).filter(|c| !"_- ".contains(*c)).collect::<String>().to_lowercase();
    let wrong = letters(wrong);
    let allowed = (wrong.chars().count() / 3).max(1);
    valid
        .into_iter()
        .map(|name| (strsim::damerau_levenshtein(&wrong, &letters(name)), name))
        .filter(|&(distance, _)| distance <= allowed)
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, name)| name)
}

/// The key closest to a wrong one that cannot mean something else: digits are the same, and names of up to three letters (ex, ez,
/// nu) differ by letter case and separators only.
pub(super) fn nearest_key<'a>(wrong: &str, valid: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let letters = |name: &str| name.chars().filter(|c| !"_- ".contains(*c)).collect::<String>().to_lowercase();
    let digits = |name: &str| name.chars().filter(char::is_ascii_digit).collect::<String>();
    let own = letters(wrong);
    let may = |name: &&str| {
        let other = letters(name);
        own == other || (own.len().min(other.len()) > 3 && digits(&own) == digits(&other))
    };
    nearest(wrong, valid.into_iter().filter(may))
}

/// Keys that others use, and what they are here.
const OTHERS: [(&str, &str); 12] = [
    ("mu", "g, the shear modulus"),
    ("shear", "g, the shear modulus"),
    ("young", "e, Young's modulus"),
    ("youngs_modulus", "e, Young's modulus"),
    ("poisson", "nu, Poisson's ratio"),
    ("poisson_ratio", "nu, Poisson's ratio"),
    ("v", "nu, Poisson's ratio"),
    ("bulk", "k, the bulk modulus"),
    ("bulk_modulus", "k, the bulk modulus"),
    ("shear_modulus", "g, the shear modulus"),
    ("rho", "density"),
    ("euler", "bunge, Euler angles by Bunge, or xyz, turns about x, y and z"),
];

/// What a key that others use is called here, as a remedy.
pub(super) fn known_elsewhere(key: &str) -> Option<String> {
    let plain = key.trim().to_lowercase().replace(['-', ' '], "_");
    OTHERS.iter().find(|(other, _)| *other == plain).map(|(_, own)| format!("here it is called {own}"))
}

/// "did you mean x?" where a name is close, otherwise "use one of x, y, z".
pub fn suggestion(wrong: &str, valid: &[&str]) -> String {
    match nearest(wrong, valid.iter().copied()) {
        Some(name) => format!("did you mean {name}?"),
        None => format!("use one of {}", valid.join(", ")),
    }
}

/// "a", "a and b", "a, b and c".
pub fn enumeration<T: AsRef<str>>(items: &[T]) -> String {
    match items {
        [] => String::new(),
        [one] => one.as_ref().to_string(),
        [head @ .., last] => {
            let head: Vec<&str> = head.iter().map(AsRef::as_ref).collect();
            format!("{} and {}", head.join(", "), last.as_ref())
        }
    }
}

/// The user's text in quotes, escaped and cut to a readable length.
pub fn quoted(text: &str) -> String {
    if text.chars().count() <= SHOWN {
        return format!("{text:?}");
    }
    let start: String = text.chars().take(SHOWN).collect();
    format!("{start:?}…")
}

/// A number with at most seven significant digits.
pub(super) fn number(value: f64) -> String {
    let rounded: f64 = format!("{value:.6e}").parse().unwrap_or(value);
    let magnitude = rounded.abs();
    if rounded == 0.0 || (1e-4..1e7).contains(&magnitude) { format!("{rounded}") } else { format!("{rounded:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_names() {
        let names = ["stiffness", "compliance", "c11"];
        assert_eq!(nearest("stifness", names), Some("stiffness"));
        assert_eq!(nearest("C11", names), Some("c11"));
        assert_eq!(nearest("c_11", names), Some("c11"));
        assert_eq!(nearest("viscosity", names), None);
    }

    #[test]
    fn a_key_of_another_meaning_is_not_the_nearest() {
        let names = ["stiffness", "c11", "c12", "ex", "ez", "nu", "nu_xy", "nu_zx", "density"];
        for (wrong, right) in [
            ("stifness", Some("stiffness")),
            ("C_11", Some("c11")),
            ("NUXY", Some("nu_xy")),
            ("densitty", Some("density")),
            ("c14", None),
            ("s11", None),
            ("ey", None),
            ("mu", None),
        ] {
            assert_eq!(nearest_key(wrong, names), right, "{wrong}");
        }
        assert_eq!(known_elsewhere("mu"), Some("here it is called g, the shear modulus".into()));
    }

    #[test]
    fn enumerations_quotes_and_numbers() {
        assert_eq!(enumeration(&["a"]), "a");
        assert_eq!(enumeration(&["a", "b", "c"]), "a, b and c");
        assert_eq!(quoted("a\nb"), r#""a\nb""#);
        assert_eq!(quoted(&"x".repeat(100)).chars().count(), SHOWN + 3);
        assert_eq!(
            (number(152.5), number(1e20 / 3.0), number(0.1 + 0.2)),
            ("152.5".into(), "3.333333e19".into(), "0.3".into())
        );
    }
}
