//! Forces of bonded spheres: laws, rigid motions, images, strength.

use crate::common;

use anisobond::operator::particles::{Particles, Strength, naive};
use anisobond::operator::{Kinematics, StiffBond};
use common::Random;
use common::spheres::{free_model, naive_energy, pair, periodic, shake, vector};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

#[test]
fn the_kernel_is_its_formula_and_force_the_derivative_of_energy() {
    for kinematics in [Kinematics::Linear, Kinematics::Finite] {
        let mut particles = Particles::new(free_model(4, 3, kinematics)).unwrap();
        shake(&mut particles, &mut Random(5), 0.1);
        let sums = particles.evaluate(0.0).unwrap();
        let expected = naive_energy(&particles);
        assert!((sums.bonds / expected - 1.0).abs() < 1e-13, "{} {expected}", sums.bonds);
        let (force, moment) = (particles.forces(), particles.moments());
        let h = 1e-6;
        for sphere in [0, 7, 31, 63] {
            for axis in 0..3 {
                let slope = |act: &dyn Fn(&mut Particles, f64)| {
                    let at = |x: f64| {
                        let mut moved = particles.clone();
                        act(&mut moved, x);
                        naive_energy(&moved)
                    };
                    -(at(h) - at(-h)) / (2.0 * h)
                };
                let e = Vector3::ith(axis, 1.0);
                let f = slope(&|p, x| p.move_by(sphere, &(e * x)));
                let m = slope(&|p, x| p.turn_by(sphere, &(e * x)));
                assert!((f - force[sphere][axis]).abs() < 1e-6 * force[sphere].norm(), "{f} {}", force[sphere]);
                assert!((m - moment[sphere][axis]).abs() < 1e-6 * moment[sphere].norm(), "{m} {}", moment[sphere]);
            }
        }
    }
}

#[test]
fn a_rigid_rotation_costs_nothing_at_any_angle() {
    let mut random = Random(11);
    for angle in [1e-3, 0.5, 2.0, 3.1] {
        let mut particles = Particles::new(free_model(4, 13, Kinematics::Finite)).unwrap();
        // What an ordinary strain of one per mille would cost.
        let scale = {
            let mut strained = particles.clone();
            let x = particles.positions();
            (0..x.len()).for_each(|i| strained.move_by(i, &(1e-3 * x[i])));
            strained.evaluate(0.0).unwrap().bonds
        };
        let axis = vector(&mut random, 1.0).normalize() * angle;
        // Twenty turns one after the other, positions and spheres alike.
        for turn in 1..=20 {
            let whole = UnitQuaternion::from_scaled_axis(axis * f64::from(turn));
            let (x0, x) = (particles.model().packing.centres().to_vec(), particles.positions());
            for i in 0..x.len() {
                particles.move_by(i, &(whole * x0[i] - x[i]));
                particles.turn_by(i, &axis);
            }
        }
        let energy = particles.evaluate(0.0).unwrap().bonds;
        assert!(energy < 1e-22 * scale, "{angle}: {energy:e} of {scale:e}");
    }
}

#[test]
fn two_spheres_by_hand() {
    let (kn, kt, length) = (3e5, 1e5, 1.1);
    for kinematics in [Kinematics::Linear, Kinematics::Finite] {
        let new = || Particles::new(pair(Vector3::x() * length, kn, kt, kinematics)).unwrap();
        let small = 1e-6;
        let close = |a: f64, b: f64| assert!((a - b).abs() <= 1e-5 * b.abs() + 1e-9, "{a} {b}");
        // Normal: f = k_n Δ.
        let mut p = new();
        p.move_by(1, &(Vector3::x() * small));
        p.evaluate(0.0).unwrap();
        close(p.forces()[0].x, kn * small);
        assert_eq!(p.forces()[0], -p.forces()[1]);
        // Shear: f = k_t Δ, moments ½ ℓ n×f on both.
        let mut p = new();
        p.move_by(1, &(Vector3::y() * small));
        p.evaluate(0.0).unwrap();
        close(p.forces()[0].y, kt * small);
        close(p.moments()[0].z, 0.5 * length * kt * small);
        close(p.moments()[1].z, 0.5 * length * kt * small);
        // One end turned: slip −½ ℓ θ.
        let mut p = new();
        p.turn_by(0, &(Vector3::z() * small));
        p.evaluate(0.0).unwrap();
        close(p.forces()[0].y, -0.5 * length * kt * small);
        close(p.moments()[0].z, -0.25 * length * length * kt * small);
        close(p.moments()[1].z, -0.25 * length * length * kt * small);
        // Rolling (opposite rotations) and twisting cost nothing.
        for (a, b) in [(Vector3::z(), -Vector3::z()), (Vector3::x(), -Vector3::x()), (Vector3::x(), Vector3::zeros())] {
            let mut p = new();
            p.turn_by(0, &(a * small));
            p.turn_by(1, &(b * small));
            assert!(p.evaluate(0.0).unwrap().bonds < 1e-12 * kt * small * small);
        }
    }
}

#[test]
fn periodic_images_carry_the_cell() {
    // A uniform strain of the whole cell: energy of all bonds by their branches, by the formula.
    for kinematics in [Kinematics::Linear, Kinematics::Finite] {
        let mut particles = periodic(4, 37, kinematics);
        let gradient = Matrix3::new(0.01, 0.002, 0.0, 0.002, -0.004, 0.003, 0.0, 0.003, 0.005);
        particles.deform(&gradient);
        let sums = particles.evaluate(0.0).unwrap();
        let energy = |b: &StiffBond| {
            let d = [Vector3::zeros(), gradient * b.branch];
            match kinematics {
                Kinematics::Finite => naive::finite_energy(b, d, [UnitQuaternion::identity(); 2]),
                Kinematics::Linear => naive::linear_energy(b, d, [Vector3::zeros(); 2]),
            }
        };
        let expected: f64 = particles.model().bonds.iter().map(energy).sum();
        assert!((sums.bonds / expected - 1.0).abs() < 1e-12, "{} {expected}", sums.bonds);
        // The virial is the derivative of the energy: dU = Σ F⊗l : D.
        let rate = |h: f64| {
            let mut moved = particles.clone();
            moved.deform(&(h * gradient));
            moved.evaluate(0.0).unwrap().bonds
        };
        let slope = (rate(1e-5) - rate(-1e-5)) / 2e-5;
        // Linear: positions stay, so the branches of the virial are those at rest.
        assert!((slope / sums.virial.dot(&gradient) - 1.0).abs() < 1e-6, "{slope} {}", sums.virial.dot(&gradient));
    }
}

/// Breaks exactly where the envelope says, over a table of normal and shear forces.
#[test]
fn a_bond_breaks_on_its_mohr_coulomb_envelope() {
    let (kn, kt) = (1e5, 5e4);
    let strength = Strength { tension: 40.0, cohesion: 60.0, friction_angle: 0.6 };
    for kinematics in [Kinematics::Linear, Kinematics::Finite] {
        let (mut held, mut broken) = (0, 0);
        for i in -30..=10 {
            for j in 0..=40 {
                let (normal, shear) = (f64::from(5 * i) + 0.3, f64::from(4 * j) + 0.1);
                let mut model = pair(Vector3::x(), kn, kt, kinematics);
                model.strength = Some(vec![strength]);
                let mut p = Particles::new(model).unwrap();
                p.move_by(1, &Vector3::new(normal / kn, shear / kt, 0.0));
                let before = naive_energy(&p);
                let sums = p.evaluate(0.0).unwrap();
                let should = normal > 40.0 || shear > 60.0 - normal * 0.6f64.tan();
                // Finite kinematics shifts both by some 10⁻³ relative.
                let margin = (normal - 40.0).abs().min((shear - 60.0 + normal * 0.6f64.tan()).abs());
                if margin > 1.0 {
                    assert_eq!(sums.broken.bonds == 1, should, "{kinematics:?} {normal} {shear}");
                }
                if sums.broken.bonds == 1 {
                    assert!((sums.broken.energy / before - 1.0).abs() < 1e-9 && sums.bonds == 0.0);
                    assert!(p.forces() == vec![Vector3::zeros(); 2] && !p.whole()[0] && p.damage() == [1.0, 1.0]);
                    broken += 1;
                } else {
                    held += 1;
                }
            }
        }
        assert!(held > 300 && broken > 300);
    }
}

/// What the kernel reads of bonds, counted: 56 bytes per half bond, 24 more with a strength, rows filled up to eight.
#[test]
fn bonds_take_the_memory_that_they_should() {
    let whole = periodic(8, 79, Kinematics::Finite);
    let mut model = whole.model().clone();
    let mut rows = vec![0usize; whole.len()];
    model.bonds.iter().for_each(|b| [b.a, b.b].iter().for_each(|&end| rows[end as usize] += 1));
    let places: usize = rows.iter().map(|row| row.next_multiple_of(8)).sum();
    assert_eq!(Particles::BYTES_PER_BOND, 112);
    assert_eq!(whole.bond_bytes(), 56 * places);
    // Not more than a third is filling.
    assert!(whole.bond_bytes() < 3 * Particles::BYTES_PER_BOND * model.bonds.len() / 2);
    model.strength = Some(vec![Strength::UNBREAKABLE; model.bonds.len()]);
    assert_eq!(Particles::new(model).unwrap().bond_bytes(), 80 * places);
}
