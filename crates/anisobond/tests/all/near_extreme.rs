//! Targets next to the border of what bonds reach: a few directions and next to nothing of all others. The solver converges
//! or says that it did not; what it calls reached is reached.

use crate::common;

use anisobond::calibration::{Calibrator, LowerBound, MicropolarCalibrator, Outcome, Promise};
use anisobond::lattice::{Influence, Neighbourhood, Shape};
use anisobond::tensor::{MONOMIALS, Stiffness, quartic_of, tensor_of};
use common::Random;
use nalgebra::Vector3;

/// Σ n⊗n⊗n⊗n of some directions and ε of an isotropic Cauchy tensor (units of stress).
fn target(directions: &[Vector3<f64>], epsilon: f64) -> Stiffness {
    let sum = directions.iter().fold(Stiffness::isotropic(epsilon / 15.0, epsilon / 15.0).mandel() * 1.0, |sum, n| {
        sum + tensor_of(&quartic_of(&n.normalize())).mandel()
    });
    Stiffness::from_mandel(sum)
}

/// Directions: of bonds, or any.
fn directions(grid: &Neighbourhood, random: &mut Random, count: usize, of_bonds: bool) -> Vec<Vector3<f64>> {
    let bonds = grid.bonds();
    (0..count)
        .map(|_| match of_bonds {
            true => bonds[(random.number().abs() * bonds.len() as f64) as usize % bonds.len()].xi,
            false => Vector3::from_fn(|_, _| random.number()),
        })
        .collect()
}

/// What is said must be so: the tensor, the signs, and c = max(0, s p) or that it did not converge.
fn check(grid: &Neighbourhood, c: &Stiffness, name: &str) -> Outcome {
    let calibrator = Calibrator::new(grid);
    let r = calibrator.calibrate(c, LowerBound::Value(0.0)).unwrap();
    let sum = grid.bonds().iter().zip(&r.micromodulus).fold(c.mandel() * 0.0, |sum, (bond, m)| {
        let s = grid.stiffness_share(bond);
        sum + s * *m * tensor_of(&quartic_of(&bond.xi.normalize())).mandel()
    });
    let cauchy = c.cauchy_part();
    let error = (cauchy.mandel() - sum).norm() / cauchy.norm();
    assert!(r.micromodulus.iter().all(|m| *m >= 0.0 && m.is_finite()), "{name}");
    match r.outcome() {
        Outcome::Feasible => {
            assert!(error <= 2e-12 && r.residual <= 1e-12, "{name}: {error:e} {:e}", r.residual);
            // Optimal: p is below zero where c is zero, and c = s p elsewhere, to the rounding of a large p.
            let largest = r.micromodulus.iter().copied().fold(0.0, f64::max);
            let size = r.dual.iter().map(|y| y.abs()).fold(0.0, f64::max);
            for (bond, m) in grid.bonds().iter().zip(&r.micromodulus) {
                let n = bond.xi.normalize();
                let p: f64 = MONOMIALS
                    .iter()
                    .zip(&r.dual)
                    .map(|([a, b, c], y)| y * n[0].powi(*a as i32) * n[1].powi(*b as i32) * n[2].powi(*c as i32))
                    .sum();
                let s = grid.stiffness_share(bond);
                let off = (m - (s * p).max(0.0)).abs();
                assert!(off <= 1e-6 * largest + 1e-13 * s * size, "{name}: {m:e} {:e} of {largest:e}", s * p);
            }
        }
        Outcome::Infeasible => {
            let i = r.infeasibility.as_ref().unwrap();
            assert!(i.largest_bond_product <= 0.0 && i.target_product > 0.0 && i.distance > 1e-13, "{name}: {i:?}");
            assert!((error - i.distance).abs() <= 1e-9, "{name}: {error:e} {:e}", i.distance);
        }
        // The tensor may be reached without a proof that the norm is the least.
        Outcome::NotConverged => {
            assert!(!r.converged && !r.feasible() && r.residual <= 1e-12, "{name}: {:e}", r.residual);
        }
    }
    r.outcome()
}

fn table(shapes: &[Shape], influences: &[Influence], epsilons: &[f64], each: usize, seed: u64) -> [usize; 3] {
    let mut random = Random(seed);
    let mut counts = [0; 3];
    for shape in shapes {
        let horizon = shape.semi_axes()[0];
        for influence in influences {
            let grid = Neighbourhood::new(*shape, horizon, 1.0, influence.clone()).unwrap();
            for (i, &epsilon) in epsilons.iter().enumerate() {
                for count in 1..=4 {
                    for j in 0..each {
                        let chosen = directions(&grid, &mut random, count, j % 2 == 0);
                        let c = target(&chosen, epsilon);
                        if c.require_positive_definite().is_err() {
                            continue;
                        }
                        let name = format!("{shape:?} {influence:?} {epsilon:e} {i} {count} {j}");
                        counts[check(&grid, &c, &name) as usize] += 1;
                    }
                }
            }
        }
    }
    counts
}

#[test]
fn near_extreme_targets_converge() {
    let shapes = [Shape::Cube { semi_edge: 4.0 }, Shape::Sphere { radius: 5.0 }];
    let [feasible, infeasible, not] = table(&shapes, &[Influence::Inverse], &[1e-10, 1e-6, 1e-3], 2, 3);
    println!("{feasible} feasible, {infeasible} infeasible, {not} not converged");
    assert!(feasible > 20 && not == 0, "{feasible} {infeasible} {not}");
}

/// `cargo test --release -p anisobond --test near_extreme -- --ignored --nocapture`.
#[test]
#[ignore = "minutes: run in release"]
fn near_extreme_targets_converge_over_a_table() {
    let shapes: Vec<Shape> =
        [4.0, 5.0, 6.0].into_iter().flat_map(|r| [Shape::Cube { semi_edge: r }, Shape::Sphere { radius: r }]).collect();
    let influences = [Influence::Constant, Influence::Inverse, Influence::Hat, Influence::Power];
    let epsilons: Vec<f64> = (3..=12).map(|k| 10f64.powi(-k)).collect();
    let [feasible, infeasible, not] = table(&shapes, &influences, &epsilons, 2, 7);
    println!("{feasible} feasible, {infeasible} infeasible, {not} not converged");
    assert_eq!(not, 0);
}

/// The row that ended after 200 Newton steps with a residual of 5·10⁻⁴, as feasible: n⊗n⊗n⊗n of (0.6, 4, 0.01), about.
#[test]
fn a_single_direction_on_a_cube_of_five() {
    let grid = Neighbourhood::new(Shape::Cube { semi_edge: 5.0 }, 5.0, 1.0, Influence::Inverse).unwrap();
    for n in [Vector3::new(-2.0, 4.0, 0.01), Vector3::new(1.0, 2.0, 0.0), Vector3::new(5.0, -4.0, 0.2)] {
        for epsilon in [1e-9, 1e-4] {
            check(&grid, &target(&[n], epsilon), &format!("{n} {epsilon:e}"));
        }
    }
}

/// The same next to the border of normal and tangential bonds.
#[test]
fn micropolar_targets_next_to_the_border_converge() {
    let grid = Neighbourhood::sphere(4.0, 1.0, Influence::Inverse).unwrap();
    let calibrator = MicropolarCalibrator::new(&grid);
    let mut random = Random(21);
    for epsilon in [1e-10, 1e-6, 1e-3] {
        for count in 1..=3 {
            let c = target(&directions(&grid, &mut random, count, true), epsilon);
            if c.require_positive_definite().is_err() {
                continue;
            }
            let r = calibrator.calibrate(&c, Promise::Sum).unwrap();
            assert!(r.infeasibility.is_none() && r.residual <= 1e-12, "{epsilon:e} {count}: {:e}", r.residual);
            assert!(r.feasible() && r.outcome() == Outcome::Feasible, "{epsilon:e} {count}: {:e}", r.residual);
        }
    }
}
