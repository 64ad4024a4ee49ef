//! The element tests of the cross-anisotropy document (S), recomputed beside its printed values.
//!
//! They belong to one packing of 2556 spheres, which is not part of this program: the caller reads it. The references are
//! an independent computation on the same packing. Every printed value that is wrong carries a note that says why.

use nalgebra::Vector3;

use super::element_test::{DynamicTest, DynamicTestResult, ElementTest, ElementTestResult};
use super::verification::Finding;
use crate::calibration::{EllipticFit, LatticeStiffness, TransverseConstants};
use crate::lattice::{Lattice, Packing, PackingStatistics};
use crate::operator::Network;
use crate::tensor::{EngineeringConstants, Stiffness};
use crate::{Error, Result};

/// S's rock (Pa).
const ROCK: TransverseConstants = TransverseConstants { c11: 130e6, c33: 55e6, c13: 28e6, c12: 40e6 };
/// S's contact radius.
const CONTACT_RADIUS: f64 = 1.8;
/// Number of spheres of S's packing.
const SPHERES: usize = 2556;
/// Agreement asked of the dynamic test: S let the lateral stresses stand at 10⁻³ of the axial one.
const STRESS_TOLERANCE: f64 = 1e-3;

/// Agreement asked of components computed from those tests. Lateral stresses of up to t times the axial one make C into
/// (1 − T) C with |T_ij| ≤ t off the diagonal: C12 may be off by t (C22 + C23), 3.9·10⁻³ of itself, C13 by 3.0·10⁻³, the
/// others by less.
const COMPONENT_TOLERANCE: f64 = 3.0 * STRESS_TOLERANCE;

const TRUNCATED: &str = "the printed errors are truncated to whole percents, not rounded";

/// The five components that S tabulates, as rows and columns of the Voigt matrix.
const COMPONENTS: [(&str, usize, usize); 5] =
    [("C11", 0, 0), ("C33", 2, 2), ("C13", 0, 2), ("C12", 0, 1), ("C44", 3, 3)];

/// Misprints of the document that no printed number shows.
pub const ERRATA: [&str; 5] = [
    "the integral of C1111 before eq-c1111-gen: the first term of E_T is s²θ c²φ, not s²θ s²φ (the next line has it right)",
    "eq-c2323-gen, C2323: E_N's factor is s³θ c²θ, not s³θ s²θ, and E_T's first term c²θ sθ/2, not c²θ sθ/4π",
    "the third condition on w is w(π − θ) = w(θ); sin²θ does not satisfy the printed w(π/2 − θ) = w(θ)",
    "eq-CC-from-EGnu: every ν_xz is ν_zx, and C13 = E_x ν_zx/m; the constants are better had by inverting the compliance",
    "the figure of stiffness against contact radius belongs to another packing: below 1.8 it cannot be reproduced",
];

/// All findings, in the document's order. `packing` is the document's (2556 spheres in a periodic cell).
///
/// # Errors
/// Another packing; a lattice that cannot be tested.
pub fn findings(packing: &Packing) -> Result<Vec<Finding>> {
    if packing.len() != SPHERES {
        return Err(Error::input(
            format!("the packing has {} spheres, the document's has {SPHERES}", packing.len()),
            "give the packing that the document was computed with",
        ));
    }
    let lattice = Lattice::new(packing.clone(), CONTACT_RADIUS)?;
    let fit = EllipticFit::new(&ROCK.stiffness(&Vector3::z()), &Vector3::z())?;
    let stiffness = LatticeStiffness::new(&lattice, &fit.microplane)?;
    let network = Network::new(&lattice, &stiffness);
    let linear = ElementTest::default().run(&network)?;
    let moved = DynamicTest::default().run(&network)?;
    let mut all = geometry(&lattice.statistics()?);
    all.extend(derived(&fit, &stiffness));
    all.extend(element_tests(&moved));
    all.extend(dependent_values(&moved.engineering));
    all.extend(stiffness_rows(&fit, &stiffness.summed(&lattice), &moved.engineering));
    all.extend(linear_tests(&linear));
    Ok(all)
}

/// A value in S's table with the reference's own tolerance.
fn value(
    place: &'static str,
    quantity: impl Into<String>,
    published: &str,
    reference: f64,
    tolerance: f64,
    ours: f64,
) -> Finding {
    let (quantity, published) = (quantity.into(), published.into());
    Finding { place, quantity, published, reference, tolerance, stated_accuracy: 0.0, ours, note: "" }
}

/// A value that the document gives to its stress tolerance.
fn within_stress_tolerance(finding: Finding) -> Finding {
    Finding { stated_accuracy: STRESS_TOLERANCE, ..finding }
}

fn noted(finding: Finding, note: &'static str) -> Finding {
    Finding { note, ..finding }
}

/// The sample: porosity and contacts.
fn geometry(s: &PackingStatistics) -> Vec<Finding> {
    vec![
        noted(
            value("Element test", "porosity", "0.5", 0.478, 5e-4, s.porosity.unwrap_or(f64::NAN)),
            "0.5 is the target of the sample's preparation; the sample itself has 0.478",
        ),
        value("Element test", "number of spheres", "2556", 2556.0, 0.0, s.number as f64),
        value("Derived values", "contacts", "", 28678.0, 0.0, s.contacts as f64),
        noted(
            value("Derived values", "average number of contacts", "22", 22.44, 5e-3, s.coordination.mean),
            "22.44, printed without its decimals",
        ),
    ]
}

/// μ and the lattice moduli E′.
fn derived(fit: &EllipticFit, stiffness: &LatticeStiffness) -> Vec<Finding> {
    let place = "Derived values";
    let mut all = vec![value(place, "μ", "2.02", 2.021385, 5e-7, stiffness.mu)];
    let moduli = fit.microplane.moduli.scaled(1e-6 / stiffness.mu).as_array();
    let rows = [
        ("E_N^a′ (MPa)", "59.7", 59.7363, 5e-5),
        ("E_N^b′ (MPa)", "5.94", 5.93652, 5e-6),
        ("E_T^a′ (MPa)", "2.84", 2.84458, 5e-6),
        ("E_T^b′ (MPa)", "0.989", 0.98942, 5e-6),
    ];
    for ((name, published, reference, tolerance), ours) in rows.into_iter().zip(moduli) {
        all.push(value(place, name, published, reference, tolerance, ours));
    }
    all
}

/// The document's six tests: dynamic, at −1 % logarithmic strain.
fn element_tests(moved: &DynamicTestResult) -> Vec<Finding> {
    let e = &moved.engineering;
    let rows = [
        ("E_x (MPa)", "103.8", 1e-6 * e.e1),
        ("ν_xy", "0.2244", e.nu12),
        ("ν_xz", "0.3962", e.nu13),
        ("E_y (MPa)", "103.1", 1e-6 * e.e2),
        ("ν_yz", "0.3916", e.nu23),
        ("ν_yx", "0.223", e.nu21),
        ("E_z (MPa)", "43.93", 1e-6 * e.e3),
        ("ν_zx", "0.1669", e.nu31),
        ("ν_zy", "0.1664", e.nu32),
        ("G_yz (MPa)", "30.67", 1e-6 * e.g23),
        ("G_zx (MPa)", "30.88", 1e-6 * e.g13),
        ("G_xy (MPa)", "42.91", 1e-6 * e.g12),
    ];
    let finding = |(name, published, ours): (&str, &str, f64)| {
        let reference = published.parse().unwrap_or(f64::NAN);
        let tolerance = STRESS_TOLERANCE * reference;
        within_stress_tolerance(value("Element tests, −1 %", name, published, reference, tolerance, ours))
    };
    rows.into_iter().map(finding).collect()
}

/// Means over the symmetric couples, as S calls them: E_x, ν_xy, ν_zx, E_z.
fn couples(e: &EngineeringConstants) -> [f64; 4] {
    [0.5 * (e.e1 + e.e2), 0.5 * (e.nu12 + e.nu21), 0.5 * (e.nu31 + e.nu32), e.e3]
}

/// ν_xz = (E_x/E_z) ν_zx and G_xy = E_x/2(1 + ν_xy).
fn dependent_values(e: &EngineeringConstants) -> Vec<Finding> {
    let place = "Dependent values";
    let [ex, nu_xy, nu_zx, ez] = couples(e);
    let (nu_xz, g_xy) = (ex / ez * nu_zx, 1e-6 * ex / (2.0 * (1.0 + nu_xy)));
    vec![
        within_stress_tolerance(value(place, "ν_xz = ν_yz = ν_zx E_x/E_z", "0.392", 0.3925, 1e-3 * 0.3925, nu_xz)),
        within_stress_tolerance(value(place, "G_xy = E_x/2(1 + ν_xy) (MPa)", "42.3", 42.27, 1e-3 * 42.27, g_xy)),
    ]
}

/// Components from E and ν, S eq-CC-from-EGnu with ν_zx where it prints ν_xz: e = E_x/E_z, m = 1 − ν_xy − 2e ν_zx².
fn components(e: &EngineeringConstants) -> [f64; 5] {
    let [ex, nu_xy, nu_zx, ez] = couples(e);
    let ratio = ex / ez;
    let square = ratio * nu_zx * nu_zx;
    let m = 1.0 - nu_xy - 2.0 * square;
    let g = 0.5 * (e.g23 + e.g13);
    [
        ex * (1.0 - square) / ((1.0 + nu_xy) * m),
        ez * (1.0 - nu_xy) / m,
        ex * nu_zx / m,
        ex * (nu_xy + square) / ((1.0 + nu_xy) * m),
        g,
    ]
}

/// The table of stiffnesses: microplane, lattice, simulations, and the errors of the last two.
fn stiffness_rows(fit: &EllipticFit, summed: &Stiffness, e: &EngineeringConstants) -> Vec<Finding> {
    type Row = ([&'static str; 5], [f64; 5], f64);
    let read = |c: &Stiffness| COMPONENTS.map(|(_, a, b)| 1e-6 * c.voigt()[(a, b)]);
    let prescribed = read(&fit.prescribed);
    let lattice = read(summed);
    let simulated = components(e).map(|c| 1e-6 * c);
    let errors = |c: [f64; 5]| std::array::from_fn::<f64, 5, _>(|k| 100.0 * (c[k] / prescribed[k] - 1.0));
    let exact: Row = (["130", "55", "28", "40", "32.2"], [130.0, 55.0, 28.0, 40.0, 32.25], 1e-6);
    let on_lattice: Row = (["130", "55.1", "28.1", "40", "32.1"], [130.2245, 55.1111, 28.0817, 40.0360, 32.1326], 5e-5);
    let lattice_error: Row = (["0.2", "0.2", "0.3", "0.09", "-0.4"], [0.1727, 0.2020, 0.2918, 0.0900, -0.3640], 2e-4);
    let tested: Row = (["122", "52.8", "26.7", "37.9", "30.8"], [122.4, 52.83, 26.71, 37.86, 30.78], 0.05);
    let tested_error: Row = (["-5", "-3", "-4", "-5", "-4"], [-5.8, -4.0, -4.6, -5.3, -4.6], 0.1);
    let rows = [
        ("microplane", " (MPa)", exact, prescribed, "32.25, rounded to the even digit"),
        ("lattice", " (MPa)", on_lattice, lattice, ""),
        ("lattice", ": error (%)", lattice_error, errors(lattice), ""),
        ("simulations", " (MPa)", tested, simulated, ""),
        ("simulations", ": error (%)", tested_error, errors(simulated), TRUNCATED),
    ];
    let mut all = Vec::new();
    for (row, unit, (published, reference, tolerance), ours, note) in rows {
        for k in 0..5 {
            let quantity = format!("{row}: {}{unit}", COMPONENTS[k].0);
            let found = value("Stiffness table", quantity, published[k], reference[k], tolerance, ours[k]);
            let accuracy = if (row, unit) == ("simulations", " (MPa)") { COMPONENT_TOLERANCE } else { 0.0 };
            all.push(Finding { stated_accuracy: accuracy, ..noted(found, note) });
        }
    }
    all
}

/// The static test, which S did not run: the limit of small strain.
fn linear_tests(linear: &ElementTestResult) -> Vec<Finding> {
    let c = linear.measured.voigt() * 1e-6;
    let rows = [
        ("C11", 0, 0, 124.435),
        ("C22", 1, 1, 123.459),
        ("C33", 2, 2, 53.392),
        ("C12", 0, 1, 38.445),
        ("C13", 0, 2, 27.212),
        ("C23", 1, 2, 26.994),
        ("C44", 3, 3, 30.666),
        ("C55", 4, 4, 30.882),
        ("C66", 5, 5, 42.897),
    ];
    let place = "Static test";
    let mut all: Vec<Finding> = rows
        .into_iter()
        .map(|(name, a, b, reference)| value(place, format!("{name} (MPa)"), "", reference, 5e-4, c[(a, b)]))
        .collect();
    let young = linear.engineering.map_or([f64::NAN; 3], |e| [e.e1, e.e2, e.e3]);
    for ((name, reference), ours) in [("E_x", 105.012), ("E_y", 104.297), ("E_z", 44.344)].into_iter().zip(young) {
        all.push(value(place, format!("{name} (MPa)"), "", reference, 5e-4, 1e-6 * ours));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// eq-CC-from-EGnu as printed and as corrected, on a tensor whose constants are known.
    #[test]
    fn the_closed_formulas_hold_as_corrected() {
        let c = ROCK.stiffness(&nalgebra::Vector3::z());
        let e = c.engineering_constants().unwrap();
        let ratio = e.e1 / e.e3;
        let c11_and_c13 = |nu: f64| {
            let m = 1.0 - e.nu12 - 2.0 * ratio * nu * nu;
            [e.e1 * (1.0 - ratio * nu * nu) / ((1.0 + e.nu12) * m), e.e1 * nu / m]
        };
        let corrected = c11_and_c13(e.nu31);
        assert!((corrected[0] / ROCK.c11 - 1.0).abs() < 1e-12 && (corrected[1] / ROCK.c13 - 1.0).abs() < 1e-12);
        assert!((c11_and_c13(e.nu13)[0] / ROCK.c11 - 1.0).abs() > 0.1);
    }
}
