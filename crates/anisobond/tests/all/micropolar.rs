//! Normal and tangential bonds on grids: the errors of the built-in materials, certificates, and the promised tensor
//! measured by the element test of a periodic cell.

use crate::common;

use anisobond::calibration::{
    Calibrator, LowerBound, MicropolarCalibration, MicropolarCalibrator, Promise, normal_projection,
    sum_for_free_rotations, tangential_projection, with_free_rotations,
};
use anisobond::experiment::element_test::{ElementTest, Mechanisms, Rotations};
use anisobond::lattice::{Influence, Neighbourhood};
use anisobond::operator::{GridCell, Network, naive};
use anisobond::tensor::{Material, PAIRS, Stiffness, mandel_weight};
use common::{Random, crystals};
use nalgebra::{Matrix3, Matrix3x6, Matrix6, Vector3};

/// Error (%) of central bonds, and of normal and tangential bonds where the source prints it.
const ERRORS: [(&str, f64, Option<f64>); 8] = [
    ("KIO3", 3.187, Some(1.874)),
    ("CoTeO4", 4.988, Some(3.709)),
    ("Te2W", 5.096, Some(3.383)),
    ("Ta2C", 2.632, None),
    ("Si", 3.863, Some(2.231)),
    ("MoN", 1.534, Some(1.355)),
    ("Spinel", 0.803, None),
    ("Pyroceram", 0.0, None),
];

fn neighbourhood(horizon: f64) -> Neighbourhood {
    Neighbourhood::sphere(horizon, 0.5, Influence::Inverse).unwrap()
}

fn test() -> ElementTest {
    let mut test = ElementTest { mechanisms: Mechanisms::Report, threads: false, ..ElementTest::default() };
    test.stopping.tolerance = 1e-12;
    test
}

/// An isotropic tensor of Poisson's ratio below ¼ with an anisotropic remainder: tangential bonds all around.
fn auxetic_like(random: &mut Random) -> Stiffness {
    let mut sum = *Stiffness::isotropic(1e9, 4e9).mandel();
    for _ in 0..4 {
        let n = Vector3::new(random.number(), random.number(), random.number()).normalize();
        sum += 2e9 * tangential_projection(&n) + 1e9 * normal_projection(&n);
    }
    Stiffness::from_mandel(sum)
}

/// The 3×6 matrix (Kelvin-Mandel) of the nodes' rotation under unit strains, from the balance of moments alone:
/// Σ s c_t n×(ε n − θ×n) = 0.
fn rotation(neighbourhood: &Neighbourhood, tangential: &[f64]) -> Matrix3x6<f64> {
    let mut resistance = Matrix3::zeros();
    let mut moments = Matrix3x6::zeros();
    for (bond, ct) in neighbourhood.bonds().iter().zip(tangential) {
        let (s, n) = (neighbourhood.stiffness_share(bond), bond.xi.normalize());
        resistance += s * ct * (Matrix3::identity() - n * n.transpose());
        for a in 0..6 {
            moments.set_column(a, &(moments.column(a) + s * ct * n.cross(&(unit_strain(a) * n))));
        }
    }
    resistance.try_inverse().map_or_else(Matrix3x6::zeros, |inverse| inverse * moments)
}

/// T of a bond when the nodes turn: |(1 − n⊗n) ε n − θ×n|².
fn turned_projection(n: &Vector3<f64>, rotation: &Matrix3x6<f64>) -> Matrix6<f64> {
    let slip = Matrix3x6::from_fn(|i, a| {
        let traction = unit_strain(a) * n;
        (traction - n.dot(&traction) * n - rotation.column(a).cross(n))[i]
    });
    slip.tr_mul(&slip)
}

/// The strain of one Kelvin-Mandel coordinate.
fn unit_strain(a: usize) -> Matrix3<f64> {
    let (i, j) = PAIRS[a];
    let mut strain = Matrix3::zeros();
    strain[(i, j)] = mandel_weight(a) / if i == j { 1.0 } else { 2.0 };
    strain[(j, i)] = strain[(i, j)];
    strain
}

/// What a calibration with free rotations claims that no bonds reach exactly: its relaxed tensor from the published bonds
/// alone, not farther than that of central bonds or of the sum closest to the target, and no better one for nodes that
/// turn so.
fn check_nearest(neighbourhood: &Neighbourhood, r: &MicropolarCalibration) {
    let turn = rotation(neighbourhood, &r.tangential);
    let mut relaxed = Matrix6::zeros();
    let (mut dual_misfit, mut largest) = (0.0f64, 0.0f64);
    for ((bond, cn), ct) in neighbourhood.bonds().iter().zip(&r.normal).zip(&r.tangential) {
        let (s, n) = (neighbourhood.stiffness_share(bond), bond.xi.normalize());
        let (normal, tangential) = (normal_projection(&n), turned_projection(&n, &turn));
        relaxed += s * (*cn * normal + *ct * tangential);
        assert!(*cn >= 0.0 && *ct >= 0.0);
        dual_misfit = dual_misfit.max((cn - (s * r.dual.dot(&normal)).max(0.0)).abs());
        largest = largest.max(*cn);
        if let Some(i) = &r.infeasibility {
            let y = Matrix6::from_fn(|a, b| i.certificate[a][b]);
            assert!(y.dot(&normal) <= 1e-13 && y.dot(&tangential) <= 1e-13);
        }
    }
    let relaxed = Stiffness::from_mandel(relaxed);
    assert!(relaxed.relative_error(&r.relaxed) < 1e-9, "{:e}", relaxed.relative_error(&r.relaxed));
    assert!((r.relaxed_error - r.target.relative_error(&r.relaxed)).abs() < 1e-12);
    assert!(dual_misfit < 1e-2 * largest, "{:e}", dual_misfit / largest);
    let Some(i) = &r.infeasibility else { panic!("nothing says why {} is left", r.relaxed_error) };
    // Bonds that change while the nodes turn so come nearer at the most.
    assert!(i.distance <= r.relaxed_error * (1.0 + 1e-6));
    if r.relaxed_error > 1e-3 {
        assert!(i.target_product > 0.0 && i.distance > 0.5 * r.relaxed_error, "{} {}", i.distance, r.relaxed_error);
    }
    let central = Calibrator::new(neighbourhood).calibrate(&r.target, LowerBound::Value(0.0)).unwrap();
    assert!(r.relaxed_error <= central.relative_error * (1.0 + 1e-9));
    let sum = MicropolarCalibrator::new(neighbourhood).calibrate(&r.target, Promise::Sum).unwrap();
    assert!(r.relaxed_error <= sum.relaxed_error * (1.0 + 1e-9));
}

/// Everything that a calibration claims, bond by bond and from its published numbers alone.
fn check(neighbourhood: &Neighbourhood, r: &MicropolarCalibration) {
    let mut reached = Matrix6::zeros();
    let largest = r.normal.iter().chain(&r.tangential).copied().fold(0.0, f64::max);
    for ((bond, cn), ct) in neighbourhood.bonds().iter().zip(&r.normal).zip(&r.tangential) {
        let s = neighbourhood.stiffness_share(bond);
        let n = bond.xi.normalize();
        let (normal, tangential) = (normal_projection(&n), tangential_projection(&n));
        reached += s * (*cn * normal + *ct * tangential);
        assert!(*cn >= 0.0 && *ct >= 0.0);
        // c = max(0, s N:Y) is the condition of least norm.
        let scale = largest.max(s * 1e-3 * r.dual.norm());
        assert!((cn - (s * r.dual.dot(&normal)).max(0.0)).abs() < 1e-7 * scale);
        assert!((ct - (s * r.dual.dot(&tangential)).max(0.0)).abs() < 1e-7 * scale);
        if let Some(i) = &r.infeasibility {
            let y = Matrix6::from_fn(|a, b| i.certificate[a][b]);
            assert!(y.dot(&normal) <= 0.0 && y.dot(&tangential) <= 0.0);
        }
    }
    let reached = Stiffness::from_mandel(reached);
    assert!(reached.relative_error(&r.reached) < 1e-12);
    assert!((r.relative_error - r.target.relative_error(&reached)).abs() < 1e-12);
    match &r.infeasibility {
        None => assert!(r.aim.relative_error(&reached) < 1e-11, "{:e}", r.aim.relative_error(&reached)),
        Some(i) => {
            assert!((i.distance - r.aim.relative_error(&reached)).abs() < 1e-9);
            assert!(i.target_product > 0.0);
        }
    }
}

#[test]
fn errors_of_the_built_in_materials() {
    let neighbourhood = neighbourhood(6.0);
    let central = Calibrator::new(&neighbourhood);
    let micropolar = MicropolarCalibrator::new(&neighbourhood);
    assert_eq!(micropolar.rank(), 21);
    for (name, expected, with_tangential) in &ERRORS {
        let material = Material::builtin(name).unwrap();
        let c = &material.stiffness;
        let percent = 100.0 * central.calibrate(c, LowerBound::Value(0.0)).unwrap().relative_error;
        assert!((percent - expected).abs() < 6e-4, "{name} {percent}");
        let r = micropolar.calibrate(c, Promise::Sum).unwrap();
        check(&neighbourhood, &r);
        let percent = 100.0 * r.relative_error;
        println!("{name:10} sum {percent:.4} relaxed {:.4} % iterations {}", 100.0 * r.relaxed_error, r.iterations);
        assert!((percent - with_tangential.unwrap_or(*expected)).abs() < 6e-4, "{name} {percent}");
    }
}

/// Error (%) of the nearest relaxed tensor at horizon 6 is at most this: central bonds where these are the nearest, else
/// what the search was first seen to find.
const NEAREST: [(&str, f64); 7] = [
    ("KIO3", 1.2704),
    ("CoTeO4", 1.3470),
    ("Te2W", 0.5632),
    ("Ta2C", 2.6320),
    ("Si", 0.0071),
    ("MoN", 1.5178),
    ("Spinel", 0.8028),
];

#[test]
fn nearest_with_free_rotations_of_the_built_in_materials() {
    for (horizon, factor) in [(6.0, 1.0), (3.0, 2.1)] {
        let neighbourhood = neighbourhood(horizon);
        let micropolar = MicropolarCalibrator::new(&neighbourhood);
        for (name, most) in NEAREST {
            let c = Material::builtin(name).unwrap().stiffness;
            let start = std::time::Instant::now();
            let r = micropolar.calibrate(&c, Promise::FreeRotations).unwrap();
            let (percent, time) = (100.0 * r.relaxed_error, 1e3 * start.elapsed().as_secs_f64());
            println!("horizon {horizon} {name:10} nearest {percent:.4} %, {} steps, {time:.1} ms", r.iterations);
            check_nearest(&neighbourhood, &r);
            assert!(percent <= factor * most + 1e-4, "{name} {percent}");
            // The element test of the perfect grid returns the promised tensor.
            let network = GridCell::perfect([1, 1, 1]).network(&neighbourhood, &r.normal, Some(&r.tangential)).unwrap();
            let error = r.relaxed.relative_error(&test().run(&network).unwrap().measured);
            assert!(error < 1e-8, "{name} {error:e}");
        }
    }
}

/// Real crystals and random tensors on a turned grid: never farther than central bonds, and never than the closest sum.
#[test]
fn free_rotations_are_never_worse_than_central_bonds() {
    let mut random = Random(19);
    let turned = neighbourhood(3.0).rotated(&random.rotation()).unwrap();
    let calibrator = MicropolarCalibrator::new(&turned);
    let some = crystals().into_iter().map(|(_, c)| c).step_by(12).take(16);
    let targets: Vec<Stiffness> = some.chain((0..10).map(|_| random.stiffness())).collect();
    for target in &targets {
        let r = calibrator.calibrate(target, Promise::FreeRotations).unwrap();
        match r.feasible() {
            true => assert!(r.promised_error() < 1e-11, "{:e}", r.promised_error()),
            false => check_nearest(&turned, &r),
        }
    }
}

/// A sum of normal and tangential bonds is reached; its central part alone would not be.
#[test]
fn sums_of_bonds_are_reached_exactly() {
    let neighbourhood = neighbourhood(3.0).rotated(&Random(5).rotation()).unwrap();
    let calibrator = MicropolarCalibrator::new(&neighbourhood);
    let mut random = Random(11);
    for _ in 0..10 {
        let target = auxetic_like(&mut random);
        let r = calibrator.calibrate(&target, Promise::Sum).unwrap();
        check(&neighbourhood, &r);
        assert!(r.feasible() && r.relative_error < 1e-12 && r.cauchy_gap > 0.01);
    }
    for _ in 0..10 {
        let r = calibrator.calibrate(&random.stiffness(), Promise::Sum).unwrap();
        check(&neighbourhood, &r);
        assert!(!r.feasible());
    }
}

/// Isotropic: reached exactly for ν ≤ ¼, and the tangential part vanishes at ¼.
#[test]
fn poisson_s_ratio_decides_for_isotropic_targets() {
    let neighbourhood = neighbourhood(3.0);
    let calibrator = MicropolarCalibrator::new(&neighbourhood);
    for (lambda, feasible) in [(-0.3, true), (0.0, true), (0.5, true), (1.0, true), (1.001, false), (3.0, false)] {
        let target = Stiffness::isotropic(lambda, 1.0);
        let r = calibrator.calibrate(&target, Promise::Sum).unwrap();
        check(&neighbourhood, &r);
        assert_eq!(r.relative_error < 1e-12, feasible, "{lambda} {}", r.relative_error);
        if let Some(i) = &r.infeasibility {
            assert!(i.in_every_neighbourhood);
        }
        if lambda == 1.0 {
            assert!(r.tangential.iter().all(|c| *c == 0.0));
        }
        // Nodes of an isotropic grid do not turn.
        if feasible {
            assert!(r.reached.relative_error(&r.relaxed) < 1e-12);
        }
    }
    let message = calibrator.calibrate(&Stiffness::isotropic(-10.0, 1.0), Promise::Sum).unwrap_err().to_string();
    assert!(message.contains("not positive definite"), "{message}");
}

/// The free rotation on the perfect grid, in closed form and measured, cell by cell.
#[test]
fn perfect_grids_measure_what_was_promised() {
    let mut random = Random(3);
    let turned = neighbourhood(2.0).rotated(&random.rotation()).unwrap();
    for neighbourhood in [neighbourhood(2.0), turned, neighbourhood(3.0)] {
        let calibrator = MicropolarCalibrator::new(&neighbourhood);
        let target = auxetic_like(&mut random);
        for promise in [Promise::Sum, Promise::FreeRotations] {
            let r = calibrator.calibrate(&target, promise).unwrap();
            if r.feasible() || promise == Promise::Sum {
                check(&neighbourhood, &r);
            } else {
                check_nearest(&neighbourhood, &r);
            }
            for nodes in [[1, 1, 1], [2, 3, 2]] {
                let network = GridCell::perfect(nodes).network(&neighbourhood, &r.normal, Some(&r.tangential)).unwrap();
                let free = test().run(&network).unwrap();
                assert!(free.summed.relative_error(&r.reached) < 1e-12);
                let error = r.relaxed.relative_error(&free.measured);
                assert!(error < 1e-8, "{error:e} {nodes:?}");
                let blocked = ElementTest { rotations: Rotations::Blocked, ..test() }.run(&network).unwrap();
                assert!(r.reached.relative_error(&blocked.measured) < 1e-8);
            }
            if r.feasible() {
                assert!(r.promised_error() < 1e-11, "{promise:?} {:e}", r.promised_error());
                let closed = with_free_rotations(&r.reached).unwrap();
                assert!(closed.relative_error(&r.relaxed) < 1e-12);
            }
        }
        let sum = sum_for_free_rotations(&target).unwrap();
        assert!(target.relative_error(&with_free_rotations(&sum).unwrap()) < 1e-12);
        assert!(target.relative_error(&sum) > 1e-4);
    }
}

/// Central bonds through the same cell: every node is a centre of symmetry and nothing relaxes.
#[test]
fn central_bonds_measure_what_was_promised() {
    let neighbourhood = neighbourhood(3.0);
    let r = Calibrator::new(&neighbourhood);
    let r = r.calibrate(&Material::builtin("KIO3").unwrap().stiffness, LowerBound::Value(0.0)).unwrap();
    for nodes in [[1, 1, 1], [3, 2, 4], [4, 4, 4]] {
        let network = GridCell::perfect(nodes).network(&neighbourhood, &r.micromodulus, None).unwrap();
        assert_eq!(network.bonds.len(), 61 * nodes.iter().product::<usize>());
        let measured = test().run(&network).unwrap().measured;
        let error = r.reached.relative_error(&measured);
        assert!(error < 1e-8, "{error:e}");
    }
}

fn defective() -> Network {
    let neighbourhood = neighbourhood(2.0);
    let target = auxetic_like(&mut Random(8));
    let r = MicropolarCalibrator::new(&neighbourhood).calibrate(&target, Promise::Sum).unwrap();
    let cell = GridCell { nodes: [3, 3, 2], missing: vec![4, 11], displacement: 0.2, seed: 7 };
    cell.network(&neighbourhood, &r.normal, Some(&r.tangential)).unwrap()
}

/// Missing and displaced nodes: softer than the full cell, and the dense matrix agrees.
#[test]
fn defects_are_measured() {
    let network = defective();
    assert_eq!(network.nodes.len(), 16);
    let r = test().run(&network).unwrap();
    assert!(r.mechanism.is_none() && r.certificate.below_sum > -1e-12);
    let oracle = naive::dense_element_test(&network, true);
    assert!(oracle.relative_error(&r.measured) < 1e-9);
    let gap = r.summed.mandel() - r.measured.mandel();
    assert!(gap.norm() > 1e-2 * r.measured.norm());
}

/// Translations of a periodic cell, and every rigid motion of the bonds that do not cross its border, cost nothing.
#[test]
fn rigid_motions_cost_nothing() {
    let mut network = defective();
    let (shift, spin) = (Vector3::new(0.3, -1.0, 0.7), Vector3::new(0.3, -0.2, 0.5));
    let cost = |network: &Network, spin: Vector3<f64>| {
        let k = naive::dense_matrix(network);
        let motion = nalgebra::DVector::from_fn(k.nrows(), |row, _| match network.nodes.get(row / 6) {
            Some(x) if row % 6 < 3 => (shift + spin.cross(x))[row % 6],
            Some(_) => spin[row % 6 - 3],
            None => 0.0,
        });
        (&k * motion).norm() / k.norm()
    };
    assert!(cost(&network, Vector3::zeros()) < 1e-14);
    assert!(cost(&network, spin) > 1e-3);
    let nodes = network.nodes.clone();
    network.bonds.retain(|b| (nodes[b.b as usize] - nodes[b.a as usize] - b.branch).norm() < 1e-9);
    assert!(network.bonds.len() > 50);
    assert!(cost(&network, spin) < 1e-14);
}

#[test]
fn wrong_cells_are_refused() {
    let neighbourhood = neighbourhood(2.0);
    let c = vec![1.0; neighbourhood.bonds().len()];
    let refused = |cell: GridCell, c: &[f64]| cell.network(&neighbourhood, c, None).unwrap_err().to_string();
    assert!(refused(GridCell::perfect([0, 2, 2]), &c).contains("0 × 2 × 2"));
    assert!(refused(GridCell::perfect([9999, 9999, 9999]), &c).contains("bonds"));
    assert!(refused(GridCell { missing: vec![8], ..GridCell::perfect([2, 2, 2]) }, &c).contains("node 8"));
    assert!(refused(GridCell { displacement: 0.5, ..GridCell::perfect([2, 2, 2]) }, &c).contains("0.5"));
    assert!(refused(GridCell { displacement: f64::NAN, ..GridCell::perfect([2, 2, 2]) }, &c).contains("NaN"));
    assert!(refused(GridCell::perfect([2, 2, 2]), &c[1..]).contains("per bond"));
    let mut one = c.clone();
    one[0] = 2.0;
    assert!(refused(GridCell::perfect([2, 2, 2]), &one).contains("opposite"));
    one[0] = -1.0;
    assert!(refused(GridCell::perfect([2, 2, 2]), &one).contains("-1"));
}
