//! `stable` means proved, or says that it is sampled: no wave that a finer search finds contradicts either word.

use crate::common;

use std::f64::consts::PI;

use anisobond::calibration::{
    Calibrator, Dispersion, Evidence, HybridCalibration, HybridCalibrator, HybridForm, LowerBound,
    MicropolarCalibrator, Promise,
};
use anisobond::lattice::{Influence, Neighbourhood, Shape};
use anisobond::tensor::{Material, Stiffness};
use common::Random;
use nalgebra::{Matrix6, Vector3};

/// D(k)/κ²(k) by its definition: the smallest eigenvalue (Pa) at phases.
fn modulus(grid: &Neighbourhood, dispersion: &Dispersion, phases: &Vector3<f64>) -> f64 {
    let laplacian = phases.map(|p| 2.0 - 2.0 * p.cos()).sum() / grid.spacing().powi(2);
    dispersion.matrix(&(grid.orientation() * phases / grid.spacing())).symmetric_eigenvalues().min() / laplacian
}

/// A search of its own: random waves, as many of them long as short, and from the weakest ones random steps that shrink.
fn finer_search(
    grid: &Neighbourhood,
    dispersion: &Dispersion,
    random: &mut Random,
    waves: usize,
    descents: usize,
) -> f64 {
    let mut tried: Vec<(f64, Vector3<f64>)> = (0..waves)
        .map(|i| {
            let size = if i % 2 == 0 { PI } else { PI * 100f64.powf(-random.number().abs()) };
            let phases = size * Vector3::from_fn(|_, _| random.number());
            (modulus(grid, dispersion, &phases), phases)
        })
        .collect();
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut least = tried[0].0;
    for &(mut value, mut phases) in tried.iter().take(descents) {
        let mut step = 0.3;
        while step > 1e-3 {
            let mut better = false;
            for _ in 0..12 {
                let moved = phases + step * phases.norm().min(1.0) * Vector3::from_fn(|_, _| random.number());
                let there = modulus(grid, dispersion, &moved);
                if moved.norm() > 1e-3 && there < value {
                    (value, phases, better) = (there, moved, true);
                }
            }
            if !better {
                step *= 0.6;
            }
        }
        least = least.min(value);
    }
    least
}

/// A grid as strangers choose it.
fn odd_grid(random: &mut Random) -> Neighbourhood {
    let horizon = 2.2 + 0.8 * random.number();
    let influence = match (random.number().abs() * 4.0) as usize {
        0 => Influence::Constant,
        1 => Influence::Inverse,
        2 => Influence::Hat,
        _ => Influence::Power,
    };
    Neighbourhood::sphere(horizon, 1.0, influence).unwrap()
}

/// What was found of some tensors under each word.
#[derive(Default)]
struct Words {
    proved: usize,
    sampled: usize,
    unstable: usize,
}

/// A random hybrid tensor at an odd horizon and influence: no finer search contradicts the word.
fn judge_random_hybrid(seed: u64, waves: usize, descents: usize, words: &mut Words) {
    let mut random = Random(seed.wrapping_mul(0x9e3779b97f4a7c15));
    let grid = odd_grid(&mut random);
    let c = random.stiffness();
    let calibrator = HybridCalibrator::new(&grid).unwrap();
    let r: HybridCalibration = calibrator.calibrate_as(&c, HybridForm::Remainder).unwrap();
    let dispersion = Dispersion::new(&grid, &r.bonds.micromodulus, &r.nodal).unwrap();
    let s = r.stability;
    let shown = modulus(&grid, &dispersion, &Vector3::from(s.phases));
    assert!((shown - s.smallest_eigenvalue).abs() <= 1e-9 * c.norm(), "{seed}: {shown:e} {s:?}");
    if !s.stable {
        assert!(s.evidence == Evidence::Proved && s.bound.is_none(), "{seed}: {s:?}");
        words.unstable += 1;
        return;
    }
    match s.evidence {
        Evidence::Proved => words.proved += 1,
        Evidence::Sampled => words.sampled += 1,
    }
    assert!(s.bound.is_some() == (s.evidence == Evidence::Proved), "{seed}: {s:?}");
    let found = finer_search(&grid, &dispersion, &mut random, waves, descents);
    assert!(found > s.bound.unwrap_or(0.0), "{seed}: {found:e} of {:e}, {s:?}", c.norm());
}

/// Many of them, on all cores.
fn random_hybrids(count: u64, waves: usize, descents: usize) -> Words {
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get() as u64);
    std::thread::scope(|scope| {
        let some = |first: u64| {
            let mut words = Words::default();
            (first..count)
                .step_by(threads as usize)
                .for_each(|i| judge_random_hybrid(i + 1, waves, descents, &mut words));
            words
        };
        let workers: Vec<_> = (0..threads).map(|first| scope.spawn(move || some(first))).collect();
        workers.into_iter().map(|worker| worker.join().unwrap()).fold(Words::default(), |sum, w| Words {
            proved: sum.proved + w.proved,
            sampled: sum.sampled + w.sampled,
            unstable: sum.unstable + w.unstable,
        })
    })
}

#[test]
fn no_finer_search_contradicts_the_word() {
    let Words { proved, sampled, unstable } = random_hybrids(16, 300, 4);
    println!("{proved} proved, {sampled} sampled, {unstable} not stable");
    assert!(sampled <= 1 && proved >= 6 && unstable > 0, "{proved} proved, {sampled} sampled, {unstable} not stable");
}

/// `cargo test --release -p anisobond --test stability -- --ignored --nocapture`: about five minutes on two cores.
#[test]
#[ignore = "minutes: run in release"]
fn no_finer_search_contradicts_the_word_for_five_thousand_tensors() {
    let Words { proved, sampled, unstable } = random_hybrids(5000, 1500, 12);
    println!("5000 random tensors: {proved} proved, {sampled} sampled, {unstable} not stable");
    assert!(sampled * 20 < proved, "{sampled} of {proved}");
}

/// The upper triangle of a Voigt matrix (Pa), row by row.
fn voigt(rows: [f64; 21]) -> Stiffness {
    let mut next = rows.into_iter();
    let mut m = Matrix6::zeros();
    for a in 0..6 {
        for b in a..6 {
            m[(a, b)] = next.next().unwrap();
            m[(b, a)] = m[(a, b)];
        }
    }
    Stiffness::from_voigt(&m).unwrap()
}

/// A tensor whose only weak waves lie between all samples: 676 of them were positive.
#[test]
fn a_weak_wave_between_the_samples_is_found() {
    let c = voigt([
        0.1993351797501976,
        -0.39053796520671313,
        0.7162270377097875,
        -0.5455552594588007,
        -0.02628652317996033,
        -0.21216579925328974,
        3.6390231760336866,
        -4.540540210272605,
        4.240976064041652,
        0.5989970836679934,
        1.6240757985492584,
        6.184341529938155,
        -5.540995335150288,
        -0.6837074394578323,
        -2.136190744386705,
        5.128370747464273,
        0.6903189040891728,
        1.963103144951247,
        0.15358432359459404,
        0.24201006713632678,
        0.7870778642113978,
    ]);
    let grid = Neighbourhood::sphere(2.3, 1.0, Influence::Hat).unwrap();
    let calibrator = HybridCalibrator::new(&grid).unwrap();
    let r = calibrator.calibrate_as(&c, HybridForm::Remainder).unwrap();
    assert!(!r.stability.stable && r.stability.evidence == Evidence::Proved, "{:?}", r.stability);
    assert!(r.stability.margin() < -7e-5, "{:?}", r.stability);
    let dispersion = Dispersion::new(&grid, &r.bonds.micromodulus, &r.nodal).unwrap();
    let at = modulus(&grid, &dispersion, &(PI * Vector3::new(0.4, 0.8, 0.4)));
    assert!((at / c.norm() + 7.5e-5).abs() < 2e-6, "{:e}", at / c.norm());
    // By default the form whose stability needs no search.
    let taken = calibrator.calibrate(&c).unwrap();
    assert!(taken.form == HybridForm::Stable && taken.stability.stable && taken.relative_error < 1e-12);
    assert_eq!(taken.stability.evidence, Evidence::Proved);
    let row = HybridCalibrator::new(&grid).unwrap().without_proof().calibrate(&c).unwrap();
    assert_eq!(row.bonds.micromodulus, taken.bonds.micromodulus);
}

/// Rows of tables, of which stability is not asked to be proved, take the bonds that a single material takes.
#[test]
fn the_form_does_not_depend_on_the_proof() {
    let mut random = Random(11);
    let mut forms = [0; 2];
    for _ in 0..12 {
        let grid = odd_grid(&mut random);
        let c = random.stiffness();
        let single = HybridCalibrator::new(&grid).unwrap().calibrate(&c).unwrap();
        let row = HybridCalibrator::new(&grid).unwrap().without_proof().calibrate(&c).unwrap();
        assert!(single.form == row.form && single.bonds.micromodulus == row.bonds.micromodulus);
        assert_eq!(single.nodal.mandel(), row.nodal.mandel());
        assert_eq!(single.stability, row.stability);
        forms[usize::from(single.form == HybridForm::Stable)] += 1;
    }
    assert!(forms[0] > 0 && forms[1] > 0, "{forms:?}");
}

/// The stable form: Z ⪰ 0 to a few units of rounding, the sum exact, stability proved by signs alone.
#[test]
fn the_stable_form_is_semidefinite_and_proved() {
    let mut random = Random(3);
    for horizon in [2f64.sqrt(), 2.0, 3.0] {
        let grid = Neighbourhood::sphere(horizon, 0.01, Influence::Inverse).unwrap();
        let calibrator = HybridCalibrator::new(&grid).unwrap();
        for _ in 0..6 {
            let c = random.stiffness();
            let r = calibrator.calibrate_as(&c, HybridForm::Stable).unwrap();
            assert!(r.nodal.eigen().0[0] >= -4.0 * f64::EPSILON * c.norm(), "{:e}", r.nodal.eigen().0[0] / c.norm());
            assert!(r.relative_error < 1e-12 && r.feasible(), "{:e}", r.relative_error);
            let s = r.stability;
            let bound = s.bound.expect("a bound by signs");
            assert!(s.stable && s.evidence == Evidence::Proved && bound > 0.0 && bound <= s.smallest_eigenvalue);
            let dispersion = Dispersion::new(&grid, &r.bonds.micromodulus, &r.nodal).unwrap();
            assert!(finer_search(&grid, &dispersion, &mut random, 100, 2) > bound);
        }
    }
}

/// Bonds of which many are zero, of all shapes: proved over the zone, the bound below what any wave shows.
#[test]
fn central_bonds_with_zeros_are_proved_over_the_zone() {
    let mut random = Random(9);
    let shapes = [
        (Shape::Sphere { radius: 3.0 }, 3.0),
        (Shape::Sphere { radius: 4.5 }, 4.5),
        (Shape::Cube { semi_edge: 2.0 }, 2.0),
        (Shape::Cuboid { semi_axes: [3.0, 2.0, 1.0] }, 3.0),
    ];
    for (shape, horizon) in shapes {
        let grid = Neighbourhood::new(shape, horizon, 0.5, Influence::Constant).unwrap();
        let grid = grid.rotated(&random.rotation()).unwrap();
        let calibrator = Calibrator::new(&grid);
        for name in ["KIO3", "CoTeO4", "Te2W"] {
            let c = Material::builtin(name).unwrap().stiffness;
            let r = calibrator.calibrate(&c, LowerBound::Value(0.0)).unwrap();
            let dispersion = Dispersion::central(&grid, &r.micromodulus).unwrap();
            let s = dispersion.stability();
            let found = finer_search(&grid, &dispersion, &mut random, 200, 3);
            assert!(found > s.bound.unwrap_or(0.0) - 1e-12 * c.norm(), "{name} {shape:?}: {found:e} {s:?}");
            assert!(!s.stable || s.evidence == Evidence::Proved, "{name} {shape:?}: {s:?}");
        }
    }
}

/// Without evaluations for a proof nothing is called proved.
#[test]
fn what_is_not_proved_says_so() {
    let grid = Neighbourhood::sphere(3.0, 1.0, Influence::Inverse).unwrap();
    let c = Material::builtin("KIO3").unwrap().stiffness;
    let r = HybridCalibrator::new(&grid).unwrap().calibrate_as(&c, HybridForm::Remainder).unwrap();
    let dispersion = Dispersion::new(&grid, &r.bonds.micromodulus, &r.nodal).unwrap();
    for (most, evidence) in [(0, Evidence::Sampled), (100, Evidence::Sampled), (100_000, Evidence::Proved)] {
        let s = dispersion.stability_within(most);
        assert!(s.stable && s.evidence == evidence && s.bound.is_some() == (evidence == Evidence::Proved), "{s:?}");
    }
}

/// Negative tangential bonds drive their nodes' rotations: not stable, whatever the displacements do.
#[test]
fn negative_tangential_bonds_are_not_stable() {
    let grid = Neighbourhood::sphere(2.0, 1.0, Influence::Constant).unwrap();
    let ones = vec![1e9; grid.bonds().len()];
    let stable = Dispersion::micropolar(&grid, &ones, &ones).unwrap().stability();
    assert!(stable.stable && stable.evidence == Evidence::Proved, "{stable:?}");
    for share in [-1.0, -0.1, -1e-3] {
        let negative: Vec<f64> = ones.iter().map(|c| share * c).collect();
        let s = Dispersion::micropolar(&grid, &ones, &negative).unwrap().stability();
        assert!(!s.stable && s.smallest_eigenvalue < 0.0, "{share}: {s:?}");
    }
    // A calibration never makes them: its bonds are ≥ 0.
    let r =
        MicropolarCalibrator::new(&grid).calibrate(&Material::builtin("Si").unwrap().stiffness, Promise::Sum).unwrap();
    assert!(r.tangential.iter().all(|c| *c >= 0.0));
}
