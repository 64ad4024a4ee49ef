//! Why elliptic moduli refuse a rock, in the constants that a rock is given by.

use nalgebra::Vector3;

use super::microplane::{EllipticModuli, TransverseConstants};
use crate::{Error, Wording};

/// Young's moduli (Pa) and Poisson's ratios of a transversely isotropic solid: E, ν of its plane, E′, ν′ of its axis (ν′ the
/// contraction of the plane under tension along the axis).
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rock([f64; 4]);

/// E, E′, ν, ν′.
const NAMES: [&str; 4] = ["E", "E′", "ν", "ν′"];

impl Rock {
    /// From the stiffness: E′ = C33 − 2 C13²/(C11 + C12), ν′ = C13/(C11 + C12), and the same of the plane by its compliance.
    fn of(c: &TransverseConstants) -> Option<Self> {
        let sum = c.c11 + c.c12;
        let along = c.c33 - 2.0 * c.c13 * c.c13 / sum;
        let nu_along = c.c13 / sum;
        // s11 + s12 = C33/((C11 + C12) E′), s11 − s12 = 1/(C11 − C12).
        let (plus, minus) = (c.c33 / (sum * along), 1.0 / (c.c11 - c.c12));
        let (s11, s12) = (0.5 * (plus + minus), 0.5 * (plus - minus));
        let rock = [1.0 / s11, along, -s12 / s11, nu_along];
        rock.iter().all(|x| x.is_finite()).then_some(Rock(rock))
    }

    /// Its stiffness, where it is a solid's.
    fn constants(&self) -> Option<TransverseConstants> {
        let [e, along, nu, nu_along] = self.0;
        let ratio = nu_along * nu_along * e / along;
        let m = 1.0 - nu - 2.0 * ratio;
        (e > 0.0 && along > 0.0 && nu.abs() < 1.0 && m > 0.0).then(|| TransverseConstants {
            c11: e * (1.0 - ratio) / ((1.0 + nu) * m),
            c12: e * (nu + ratio) / ((1.0 + nu) * m),
            c13: e * nu_along / m,
            c33: along * (1.0 - nu) / m,
        })
    }

    fn admissible(&self) -> bool {
        self.constants().is_some_and(|c| EllipticModuli::admissible(&c).is_ok())
    }

    /// The values of one constant, next to its own, with which elliptic moduli exist, the others kept.
    fn range(&self, which: usize) -> Option<[f64; 2]> {
        const STEPS: i32 = 2000;
        let own = self.0[which];
        let value = |n: i32| match which {
            0 | 1 => own * (3.0 * f64::from(n) / f64::from(STEPS)).exp(),
            _ => own + 1.5 * f64::from(n) / f64::from(STEPS),
        };
        let with = |x: f64| {
            let mut rock = *self;
            rock.0[which] = x;
            rock
        };
        let good = |n: i32| with(value(n)).admissible();
        let found = (1..=STEPS).flat_map(|n| [n, -n]).find(|&n| good(n))?;
        let end = |way: i32| {
            let mut n = found;
            while n.abs() < STEPS && good(n + way) {
                n += way;
            }
            let (mut inside, mut outside) = (value(n), value(n + way));
            for _ in 0..40 {
                let middle = 0.5 * (inside + outside);
                if with(middle).admissible() { inside = middle } else { outside = middle }
            }
            inside
        };
        Some([end(-1), end(1)])
    }
}

/// Keys of material files for E, E′, ν, ν′ and G′ where the axis is one of the coordinate axes.
fn keys(axis: &Vector3<f64>) -> Option<[&'static str; 5]> {
    let along = (0..3).find(|&a| axis[a].abs() > 1.0 - 1e-9)?;
    Some(match along {
        0 => ["ey", "ex", "nu_yz", "nu_xy", "gxy"],
        1 => ["ez", "ey", "nu_zx", "nu_yz", "gyz"],
        _ => ["ex", "ez", "nu_xy", "nu_zx", "gyz"],
    })
}

/// What a refusal of elliptic moduli says to who gave a rock: its constants by their usual names and by the keys of material
/// files, what each would have to be alone, and which bonds do without elliptic moduli.
pub(super) fn refusal(mut error: Error, c: &TransverseConstants, c44: f64, axis: &Vector3<f64>) -> Error {
    let Error::Failure { problem, remedy, .. } = &mut error else { return error };
    let Some(rock) = Rock::of(c) else { return error };
    let isotropic = (c.c33 / c.c11 - 1.0).abs().max((c.c13 - c.c12).abs() / c.c11) < 1e-9;
    let keys = keys(axis);
    let key = |n: usize| match (isotropic, keys) {
        (true, _) => ["e", "e", "nu", "nu", "g"][n].to_string(),
        (false, Some(keys)) => keys[n].to_string(),
        (false, None) => String::new(),
    };
    let named =
        |n: usize, name: &str| if key(n).is_empty() { name.to_string() } else { format!("{name} ({})", key(n)) };
    let value = |n: usize, x: f64| if n < 2 { format!("{:.4} GPa", 1e-9 * x) } else { format!("{x:.4}") };
    let [given, ways] = if isotropic {
        // 4ν ≤ 1: E_T ≥ 0.
        let given = [0, 2].map(|n| format!("{} = {}", named(n, NAMES[n]), value(n, rock.0[n]))).join(", ");
        [given, format!("{} at most 0.25", named(2, "ν"))]
    } else {
        let mut given: Vec<String> =
            (0..4).map(|n| format!("{} = {}", named(n, NAMES[n]), value(n, rock.0[n]))).collect();
        given.push(format!("{} = {:.4} GPa", named(4, "G′"), 1e-9 * c44));
        let way = |n: usize| {
            let [low, high] = rock.range(n)?;
            Some(format!("{} between {} and {}", named(n, NAMES[n]), value(n, low), value(n, high)))
        };
        let ways: Vec<String> = (0..4).filter_map(way).collect();
        [given.join(", "), if ways.is_empty() { "no one constant alone".into() } else { ways.join(", or ") }]
    };
    // In stiffnesses too, where one of them alone helps.
    let stiffnesses =
        if remedy.to_string().starts_with("change") { format!("; in stiffnesses, {remedy}") } else { String::new() };
    *problem = format!("elliptic moduli of bonds cannot be those of a rock with {given}: {problem}");
    *remedy = Wording::from("correct the bonds instead (packing.correct = true; ")
        .choice("correct", "")
        .words(
            "), which takes any positive definite stiffness and says how near it comes; or the hybrid model, which reaches every \
             one (",
        )
        .choice("model", "hybrid")
        .words(format!(
            ", or a grid with model.bonds = \"hybrid\"); or change one constant alone: {ways}{stiffnesses}"
        ));
    error
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROCK: Rock = Rock([60e9, 30e9, 0.2, 0.25]);

    #[test]
    fn constants_there_and_back() {
        let c = ROCK.constants().unwrap();
        let back = Rock::of(&c).unwrap();
        assert!(back.0.iter().zip(ROCK.0).all(|(a, b)| (a / b - 1.0).abs() < 1e-12), "{back:?}");
        // E/(1 − 2ν) … of an isotropic one.
        let iso = Rock([10e9, 10e9, 0.25, 0.25]).constants().unwrap();
        assert!((iso.c11 - 12e9).abs() < 1.0 && (iso.c12 - 4e9).abs() < 1.0 && (iso.c13 - 4e9).abs() < 1.0);
    }

    /// Whoever follows the advice is not refused.
    #[test]
    fn what_is_advised_is_admissible_and_what_lies_beyond_is_not() {
        assert!(!ROCK.admissible());
        let mut ways = 0;
        for which in 0..4 {
            let Some([low, high]) = ROCK.range(which) else { continue };
            ways += 1;
            let with = |x: f64| {
                let mut rock = ROCK;
                rock.0[which] = x;
                rock.admissible()
            };
            let width = high - low;
            assert!(with(low) && with(high) && with(0.5 * (low + high)), "{which}");
            assert!(!with(low - 1e-3 * width) || !with(high + 1e-3 * width), "{which}");
        }
        assert!(ways >= 1);
    }

    #[test]
    fn the_words_are_those_of_the_user() {
        let fit = |rock: Rock, axis: Vector3<f64>| {
            let c = rock.constants().unwrap().stiffness(&axis);
            crate::calibration::EllipticFit::new(&c, &axis).unwrap_err().to_string()
        };
        let message = fit(ROCK, Vector3::z());
        for part in [
            "E (ex) = 60.0000 GPa",
            "E′ (ez) = 30",
            "ν′ (nu_zx) = 0.2500",
            "correct = true",
            "hybrid",
            "ν′ (nu_zx) between",
        ] {
            assert!(message.contains(part), "{part}: {message}");
        }
        assert!(fit(ROCK, Vector3::x()).contains("ν′ (nu_xy) = 0.2500"));
        assert!(fit(Rock([20e9, 20e9, 0.3, 0.3]), Vector3::z()).contains("ν (nu) at most 0.25"));
    }
}
