//! Calibration in the sense of energy: the numbers of docs/theory.md, and optimality from the bonds alone.

use anisobond::calibration::{Calibration, Calibrator, LowerBound};
use anisobond::lattice::{Influence, Neighbourhood};
use anisobond::tensor::{Material, Metric, PAIRS, Stiffness, mandel_weight};
use nalgebra::{Cholesky, Matrix6, Vector6};

use crate::common::{Random, form};

const ZERO: LowerBound = LowerBound::Value(0.0);

fn sphere(horizon: f64) -> Neighbourhood {
    Neighbourhood::sphere(horizon, 1.0, Influence::Inverse).unwrap()
}

/// Where bonds c ≥ 0 reach S*, errors (%) are those of S*, computed independently of this program.
#[test]
fn errors_of_the_built_in_crystals() {
    let neighbourhood = sphere(6.0);
    let calibrator = Calibrator::new(&neighbourhood);
    for (name, norm, least, largest) in [
        ("Te2W", 5.803, -7.89, 8.51),
        ("CoTeO4", 5.378, -9.21, 11.39),
        ("Si", 4.329, -4.56, 6.60),
        ("Spinel", 1.010, -1.36, 0.36),
    ] {
        let c = Material::builtin(name).unwrap().stiffness;
        let r = calibrator.calibrate_in(&c, ZERO, Metric::Energy).unwrap();
        assert!(r.feasible() && r.metric == Metric::Energy, "{name}");
        assert!(r.aim().relative_error(&r.reached) < 1e-11, "{name}");
        let [a, b] = c.energy_error(&r.reached).unwrap();
        assert!((100.0 * r.relative_error - norm).abs() < 6e-4, "{name} {}", r.relative_error);
        assert!((100.0 * a - least).abs() < 0.006 && (100.0 * b - largest).abs() < 0.006, "{name} {a} {b}");
        assert!(r.relative_error > r.cauchy_gap);
    }
}

/// A target within reach has the same bonds in both senses.
#[test]
fn within_reach_both_senses_agree() {
    let neighbourhood = sphere(4.0);
    let calibrator = Calibrator::new(&neighbourhood);
    let c = Material::builtin("Pyroceram").unwrap().stiffness;
    let norm = calibrator.calibrate_in(&c, ZERO, Metric::Norm).unwrap();
    let energy = calibrator.calibrate_in(&c, ZERO, Metric::Energy).unwrap();
    let most = norm.micromodulus.iter().copied().fold(0.0, f64::max);
    for (a, b) in norm.micromodulus.iter().zip(&energy.micromodulus) {
        assert!((a - b).abs() < 1e-10 * most);
    }
}

/// The conditions of Karush, Kuhn and Tucker for the closest tensor of bonds c ≥ 0 (the problem is convex, so they prove it),
/// the form of the dual vector, and the certificate.
fn check(neighbourhood: &Neighbourhood, r: &Calibration) {
    let lower = Cholesky::new(*r.target.mandel()).unwrap().l().try_inverse().unwrap();
    let residual = lower * (r.reached.mandel() - r.target.mandel()) * lower.transpose();
    let share: Vec<f64> = neighbourhood.bonds().iter().map(|b| neighbourhood.stiffness_share(b)).collect();
    let most = r.micromodulus.iter().copied().fold(0.0, f64::max);
    let mut sum = Matrix6::zeros();
    for ((bond, c), s) in neighbourhood.bonds().iter().zip(&r.micromodulus).zip(&share) {
        let n = bond.xi.normalize();
        let e = Vector6::from_fn(|a, _| n[PAIRS[a].0] * n[PAIRS[a].1] * mandel_weight(a));
        sum += *c * *s * e * e.transpose();
        // How the energy's distance grows with the bond, in units of its own length.
        let own = lower * e;
        let slope = own.dot(&(residual * own)) / own.norm_squared();
        assert!(slope > -1e-8 && (*c <= 1e-9 * most || slope < 1e-8), "{slope:e} {c:e}");
        let expected = (s * form(&r.dual, &n)).max(0.0);
        assert!((c - expected).abs() < 1e-6 * most, "{c:e} {expected:e}");
        if let Some(i) = &r.infeasibility {
            assert!(form(&i.certificate, &n) <= 0.0);
        }
    }
    assert!(Stiffness::from_mandel(sum).relative_error(&r.reached) < 1e-12);
    if let Some(i) = &r.infeasibility {
        assert!(i.target_product > 0.0 && i.largest_bond_product <= 0.0 && i.distance > 0.0);
    }
}

/// Where bonds c ≥ 0 do not reach S*, they reach what is closest in the sense of energy.
#[test]
fn out_of_reach_the_closest_in_energy_is_found() {
    let (mut out, mut closer) = (0, 0);
    let mut random = Random(77);
    for horizon in [1.5, 2.0, 3.0] {
        let neighbourhood = sphere(horizon);
        let calibrator = Calibrator::new(&neighbourhood);
        let built_in = Material::builtin_names().into_iter().map(|name| Material::builtin(name).unwrap().stiffness);
        let turned: Vec<Stiffness> = (0..6).map(|_| random.stiffness()).collect();
        for c in built_in.chain(turned) {
            let r = calibrator.calibrate_in(&c, ZERO, Metric::Energy).unwrap();
            assert!(r.converged, "{horizon} {}", r.residual);
            check(&neighbourhood, &r);
            let norm = calibrator.calibrate(&c, ZERO).unwrap();
            let (a, b) = (c.energy_distance(&r.reached).unwrap(), c.energy_distance(&norm.reached).unwrap());
            assert!(a <= b + 1e-9 && norm.relative_error <= r.relative_error + 1e-9, "{horizon}: {a} {b}");
            out += usize::from(r.infeasibility.is_some());
            closer += usize::from(a < 0.99 * b);
        }
    }
    assert!(out > 10 && closer > 10, "{out} {closer}");
}

/// The largest lower bound for S*: just above it there is no solution, at it there is one.
#[test]
fn the_largest_bound_in_the_sense_of_energy() {
    let neighbourhood = sphere(6.0);
    let calibrator = Calibrator::new(&neighbourhood);
    let c = Material::builtin("MoN").unwrap().stiffness;
    let top = calibrator.calibrate_in(&c, LowerBound::Largest, Metric::Energy).unwrap();
    assert!(top.feasible() && top.lower_bound > 0.0);
    for (factor, feasible) in [(0.999, true), (1.001, false)] {
        let bound = LowerBound::Value(factor * top.lower_bound);
        let r = calibrator.calibrate_in(&c, bound, Metric::Energy).unwrap();
        assert_eq!(r.feasible(), feasible, "{factor}");
        assert!(r.micromodulus.iter().all(|&c| c >= factor * top.lower_bound * (1.0 - 1e-12)));
    }
}
