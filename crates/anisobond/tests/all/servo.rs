//! The servo of a periodic cell: its stiffness, its gradient, and where they lead.

use crate::common;

use anisobond::operator::Kinematics;
use anisobond::operator::particles::Particles;
use anisobond::solver::particles::{Control, Servo, affine_stiffness, mean_stress};
use anisobond::tensor::{PAIRS, mandel_rotation, mandel_weight};
use common::Random;
use common::spheres::{network_of, periodic};
use nalgebra::{Matrix3, Matrix6, Vector6};

/// The Kelvin-Mandel vector of the symmetric part of a matrix: spheres that only follow a strain are not in balance of moments, so
/// that the stress is not symmetric.
fn mandel(m: &Matrix3<f64>) -> Vector6<f64> {
    Vector6::from_fn(|a, _| 0.5 * mandel_weight(a) * (m + m.transpose())[PAIRS[a]])
}

/// And back.
fn matrix(v: &Vector6<f64>) -> Matrix3<f64> {
    let mut m = Matrix3::zeros();
    for (a, &(i, j)) in PAIRS.iter().enumerate() {
        (m[(i, j)], m[(j, i)]) = (v[a] / mandel_weight(a), v[a] / mandel_weight(a));
    }
    m
}

/// The stress of a cell whose spheres follow its strain.
fn stress(particles: &mut Particles) -> Matrix3<f64> {
    let sums = particles.evaluate(0.0).unwrap();
    mean_stress(particles, &sums.virial).unwrap()
}

fn random_matrix(random: &mut Random, size: f64) -> Matrix3<f64> {
    let m = Matrix3::from_fn(|_, _| size * random.number());
    0.5 * (m + m.transpose())
}

/// C = ∂σ/∂ε at uniform strain, by central differences of the stress of the cell; symmetric, positive definite, and the sum
/// (1/V) Σ ℓ² (k_n n⊗n⊗n⊗n + k_t (sym n⊗1⊗n − n⊗n⊗n⊗n)) over the bonds.
#[test]
fn the_affine_stiffness_is_the_slope_of_the_cells_stress() {
    for (seed, kinematics) in [(11, Kinematics::Linear), (12, Kinematics::Finite), (13, Kinematics::Linear)] {
        let body = periodic(3, seed, kinematics);
        let network = network_of(body.model());
        let c = affine_stiffness(&network).unwrap();
        assert!((c - c.transpose()).norm() < 1e-13 * c.norm());
        assert!(c.symmetric_eigenvalues().min() > 0.0);
        let h = 1e-6;
        for a in 0..6 {
            let strain = matrix(&Vector6::from_fn(|b, _| if a == b { h } else { 0.0 }));
            let [plus, minus] = [1.0, -1.0].map(|sign| {
                let mut moved = body.clone();
                moved.deform(&(sign * strain));
                mandel(&stress(&mut moved))
            });
            let slope = (plus - minus) / (2.0 * h);
            assert!((slope - c.column(a)).norm() < 1e-6 * c.norm(), "{kinematics:?} {a}: {slope} {}", c.column(a));
        }
        let mut sum = Matrix6::zeros();
        for bond in &network.bonds {
            let n = bond.branch.normalize();
            let normal = mandel(&(n * n.transpose()));
            sum += (bond.normal - bond.tangential) * bond.branch.norm_squared() * normal * normal.transpose();
            // ε:(sym n⊗1⊗n):ε = |ε n|².
            let pulled: [_; 6] = std::array::from_fn(|a| matrix(&Vector6::ith(a, 1.0)) * n);
            let tangential = Matrix6::from_fn(|a, b| pulled[a].dot(&pulled[b]));
            sum += bond.tangential * bond.branch.norm_squared() * tangential;
        }
        sum /= network.volume;
        assert!((c - sum).norm() < 1e-12 * c.norm(), "{kinematics:?}: {:e}", (c - sum).norm() / c.norm());
    }
}

/// In a linear cell one step of gain g makes good the share g of the stress that is missing, on the components that are
/// driven by stress and with the others at rest, whichever they are; what moves the others changes it by their block C D.
#[test]
fn a_step_makes_good_its_share_of_the_missing_stress() {
    let mut random = Random(3);
    let body = periodic(3, 21, Kinematics::Linear);
    let c = affine_stiffness(&network_of(body.model())).unwrap();
    let step = 2e-4;
    for mask in 0..64u32 {
        let by_stress = |a: usize| mask >> a & 1 == 1;
        for (gain, moving) in [(1.0, false), (0.25, false), (1.0, true)] {
            let mut cell = body.clone();
            cell.deform(&random_matrix(&mut random, 1e-3));
            let before = stress(&mut cell);
            let wanted = random_matrix(&mut random, 1e5);
            let rates = random_matrix(&mut random, if moving { 2.0 } else { 0.0 });
            let controls = std::array::from_fn(|a| match by_stress(a) {
                true => Control::Stress(wanted[PAIRS[a]]),
                false => Control::Rate(rates[PAIRS[a]]),
            });
            let servo = Servo { controls, gain, fastest: f64::INFINITY, stiffness: c };
            let gradient = servo.gradient(&before, step).unwrap();
            assert_eq!(gradient, gradient.transpose());
            cell.deform(&gradient);
            let after = mandel(&stress(&mut cell));
            let driven_by_rate =
                Vector6::from_fn(|a, _| if by_stress(a) { 0.0 } else { mandel_weight(a) * rates[PAIRS[a]] * step });
            let (start, end, by_others) = (mandel(&before), mandel(&wanted), c * driven_by_rate);
            for a in 0..6 {
                if by_stress(a) {
                    let expected = start[a] + gain * (end[a] - start[a]) + by_others[a];
                    assert!((after[a] - expected).abs() < 1e-8 * start.norm(), "{mask} {a}: {} {expected}", after[a]);
                } else {
                    assert_eq!(gradient[PAIRS[a]], rates[PAIRS[a]] * step);
                }
            }
        }
    }
}

/// Steps of a cell at finite strain lead to the stress that is wanted: what is missing falls at least as (1 − g)ⁿ with a little left
/// to what the stiffness at rest does not know.
#[test]
fn a_cell_at_finite_strain_is_led_to_its_stress() {
    let mut cell = periodic(3, 31, Kinematics::Finite);
    let c = affine_stiffness(&network_of(cell.model())).unwrap();
    let wanted = Vector6::new(-2e5, -1e5, 3e5, 5e4, 0.0, -8e4);
    let controls = std::array::from_fn(|a| Control::Stress(wanted[a]));
    let servo = Servo { controls, gain: 0.5, fastest: f64::INFINITY, stiffness: c };
    let target = Matrix3::from_fn(|i, j| wanted[PAIRS.iter().position(|p| *p == (i, j) || *p == (j, i)).unwrap()]);
    let missing = |cell: &mut Particles| (mandel(&stress(cell)) - mandel(&target)).norm();
    let first = missing(&mut cell);
    for n in 1..=20 {
        let now = stress(&mut cell);
        cell.deform(&servo.gradient(&now, 1e-4).unwrap());
        let missing = missing(&mut cell);
        assert!(missing < 0.55f64.powi(n) * first, "{n}: {missing:e} of {first:e}");
    }
}

/// D of a turned body under a turned stress is the turned D; it is linear in what is missing; of a stress that is not
/// symmetric only the symmetric part counts.
#[test]
fn the_gradient_turns_with_the_body_and_is_linear() {
    let mut random = Random(8);
    let c = affine_stiffness(&network_of(periodic(3, 41, Kinematics::Linear).model())).unwrap();
    let of = |stiffness: Matrix6<f64>, stress: &Matrix3<f64>, wanted: &Matrix3<f64>| {
        let controls = PAIRS.map(|p| Control::Stress(wanted[p]));
        Servo { controls, gain: 0.3, fastest: f64::INFINITY, stiffness }.gradient(stress, 1e-3).unwrap()
    };
    for _ in 0..20 {
        let (now, wanted, q) = (random_matrix(&mut random, 1e6), random_matrix(&mut random, 1e6), random.rotation());
        let d = of(c, &now, &wanted);
        let r = mandel_rotation(&q);
        let turned = |m: &Matrix3<f64>| {
            let m = q * m * q.transpose();
            0.5 * (m + m.transpose())
        };
        let there = of(r * c * r.transpose(), &turned(&now), &turned(&wanted));
        assert!((there - turned(&d)).norm() < 1e-12 * d.norm(), "{there} {}", turned(&d));
        let twice = of(c, &now, &(now + 2.0 * (wanted - now)));
        assert!((twice - 2.0 * d).norm() < 1e-12 * d.norm());
        let odd = Matrix3::new(0.0, 1.0, 2.0, -1.0, 0.0, 3.0, -2.0, -3.0, 0.0) * 1e5;
        assert!((of(c, &(now + odd), &wanted) - d).norm() < 1e-10 * d.norm());
    }
}

/// Components driven by stress go no faster than they may, each by itself; and a stiffness that says nothing is named.
#[test]
fn the_gradient_is_limited_and_its_faults_are_named() {
    let c = affine_stiffness(&network_of(periodic(3, 51, Kinematics::Linear).model())).unwrap();
    let (step, fastest) = (1e-3, 2e-2);
    let mut servo = Servo { controls: [Control::Stress(0.0); 6], gain: 1.0, fastest: f64::INFINITY, stiffness: c };
    servo.controls[2] = Control::Rate(7.0);
    let now = Matrix3::new(5e6, 1e4, -2e6, 1e4, -10.0, 3e5, -2e6, 3e5, 9e5);
    let free = servo.gradient(&now, step).unwrap();
    servo.fastest = fastest;
    let limited = servo.gradient(&now, step).unwrap();
    let mut met = [false; 2];
    for (a, &p) in PAIRS.iter().enumerate() {
        let most = if a == 2 { f64::INFINITY } else { fastest * step };
        assert_eq!(limited[p], free[p].clamp(-most, most), "{a}");
        met[usize::from(limited[p] == free[p])] = true;
    }
    assert_eq!(met, [true; 2]);
    servo.stiffness = Matrix6::zeros();
    assert!(servo.gradient(&now, step).unwrap_err().to_string().contains("singular"));
    // Rates alone need no stiffness.
    servo.controls = [Control::Rate(2.0); 6];
    assert_eq!(servo.gradient(&now, step).unwrap(), Matrix3::repeat(2.0 * step));
}
