//! Cracks made by hand: straight, kinked, branched, and each of them once more across periodic faces.

use nalgebra::Vector3;

use super::crack::WHOLE;
use super::crack_path::{CrackPath, crack_paths};
use super::crack_tips::CrackTip;
use crate::lattice::Grid;

const NODES: usize = 60;
const SPACING: f64 = 1e-3;
const SPEED: f64 = 1200.0;

/// Legs of a crack: each from a place, at an angle (degrees), of a length, in spacings, beginning after a way.
type Leg = ([f64; 2], f64, f64, f64);

/// A sheet that is periodic along both of its axes, its cracks moved by whole nodes, through the faces.
fn cracked(legs: &[Leg], moved: [usize; 2]) -> (Grid, Vec<f64>) {
    let grid = Grid::new([NODES, NODES, 1], SPACING, Vector3::new(0.1, -0.2, 0.3), [true; 3]).unwrap();
    let mut times = vec![WHOLE; grid.len()];
    for node in 0..grid.len() {
        let [i, j, _] = grid.coordinates(node);
        for &([x, y], angle, length, before) in legs {
            let (sin, cos) = angle.to_radians().sin_cos();
            let (x, y) = (i as f64 - x, j as f64 - y);
            let (along, across) = (x * cos + y * sin, y * cos - x * sin);
            if (0.0..=length).contains(&along) && across.abs() < 0.6 {
                let there = grid.index([(i + moved[0]) % NODES, (j + moved[1]) % NODES, 0]);
                times[there] = times[there].min((before + along) * SPACING / SPEED);
            }
        }
    }
    (grid, times)
}

fn one(legs: &[Leg], moved: [usize; 2]) -> CrackPath {
    let (grid, times) = cracked(legs, moved);
    let mut paths = crack_paths(&grid, &times, true);
    assert_eq!(paths.len(), 1, "{legs:?}");
    paths.remove(0)
}

/// Degrees from the first axis.
fn angle(direction: [f64; 3]) -> f64 {
    direction[1].atan2(direction[0]).to_degrees()
}

/// Where a place is once the sheet is moved, within its period.
fn through(place: [f64; 3], moved: [usize; 2]) -> [usize; 2] {
    let node = |a: usize| ((place[a] - [0.1, -0.2][a]) / SPACING).round() as usize;
    [0, 1].map(|a| (node(a) + moved[a]) % NODES)
}

/// Moves of the sheet: none, and so that cracks in its middle lie across the first face, the second, and both.
const MOVES: [[usize; 2]; 4] = [[0, 0], [30, 0], [0, 30], [30, 30]];

fn near(a: Option<f64>, b: Option<f64>) -> bool {
    a.zip(b).map_or(a.is_none() && b.is_none(), |(a, b)| (a - b).abs() <= 1e-2 * b.abs())
}

/// What is told of a crack does not depend on where the period begins, but for ways of equal length, between which the number of a
/// node decides.
fn same_wherever(legs: &[Leg]) -> CrackPath {
    let here = one(legs, MOVES[0]);
    let turned = |a: [f64; 3], b: [f64; 3]| (Vector3::from(a) - Vector3::from(b)).norm();
    let alike = |a: &CrackTip, b: &CrackTip| {
        let between = |t: &CrackTip| t.branch.map(|(_, angle)| angle);
        turned(a.direction, b.direction) < 2e-2
            && (a.length - b.length).abs() < 1e-12
            && near(a.speed, b.speed)
            && between(a).zip(between(b)).is_none_or(|(a, b)| (a - b).abs() < 1.5)
    };
    for moved in MOVES {
        let there = one(legs, moved);
        assert!(
            turned(here.direction, there.direction) < 1e-9,
            "{moved:?}: {} {}",
            angle(here.direction),
            angle(there.direction)
        );
        assert!((here.length - there.length).abs() < 1e-12 && near(here.speed, there.speed), "{moved:?}");
        for (own, moved_there) in [(here.start, there.start), (here.tip, there.tip)] {
            assert_eq!(through(own, moved), through(moved_there, [0, 0]), "{moved:?}");
        }
        assert_eq!(here.tips.len(), there.tips.len(), "{moved:?}");
        assert!(
            here.tips.iter().zip(&there.tips).all(|(a, b)| alike(a, b)),
            "{moved:?}: {:?} {:?}",
            here.tips,
            there.tips
        );
    }
    here
}

#[test]
fn a_straight_crack_across_a_face_goes_straight_on() {
    for degrees in [0.0, 30.0, 45.0, 90.0, 120.0, -160.0f64] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let crack = same_wherever(&[([30.0 - 12.0 * cos, 30.0 - 12.0 * sin], degrees, 24.0, 0.0)]);
        let off = (angle(crack.direction) - degrees + 540.0).rem_euclid(360.0) - 180.0;
        assert!(off.abs() < 1.5, "{off}° from {degrees}°");
        assert!((crack.length / 24e-3 - 1.0).abs() < 0.08, "{} at {degrees}°", crack.length);
        assert!((crack.speed.unwrap() / SPEED - 1.0).abs() < 0.08, "{:?} at {degrees}°", crack.speed);
        let [tip] = &crack.tips[..] else { panic!("{} tips at {degrees}°", crack.tips.len()) };
        assert_eq!((tip.start, tip.tip, tip.length), (crack.start, crack.tip, crack.length));
        let off = (angle(tip.direction) - degrees + 540.0).rem_euclid(360.0) - 180.0;
        assert!(off.abs() < 2.0, "the tip's way is {off}° from {degrees}°");
    }
}

/// A kinked crack is one way of two legs: its line lies between them, its length is that of both.
#[test]
fn a_kinked_crack_is_one_way() {
    let crack = same_wherever(&[([20.0, 25.0], 0.0, 14.0, 0.0), ([34.0, 25.0], 60.0, 14.0, 14.0)]);
    let [tip] = &crack.tips[..] else { panic!("{:?}", crack.tips) };
    assert!((crack.length / 28e-3 - 1.0).abs() < 0.05, "{}", crack.length);
    for direction in [crack.direction, tip.direction] {
        assert!((20.0..40.0).contains(&angle(direction)), "{}°", angle(direction));
    }
    let [middle, end] = [0.5, 1.0].map(|part| {
        let at = |p: &&super::crack_tips::TipPoint| p.length >= part * tip.length - 1e-9;
        tip.history.iter().find(at).unwrap().place - Vector3::new(0.1, -0.2, 0.3)
    });
    assert!((middle - Vector3::new(34e-3, 25e-3, 0.0)).norm() < 2e-3, "{middle}");
    assert!((end - Vector3::new(41e-3, 37e-3, 0.0)).norm() < 2e-3, "{end}");
}

/// A branch leaves the longer tip at the angle between both.
#[test]
fn a_branch_leaves_at_its_angle() {
    let crack = same_wherever(&[([15.0, 30.0], 0.0, 30.0, 0.0), ([25.0, 30.0], 50.0, 18.0, 10.0)]);
    let [first, second] = &crack.tips[..] else { panic!("{:?}", crack.tips) };
    assert!(angle(first.direction).abs() < 1.5 && (angle(second.direction) - 50.0).abs() < 4.0);
    let (parent, between) = second.branch.unwrap();
    assert!(parent == 1 && (between - 50.0).abs() < 4.0, "{between}°");
    assert!((second.start[0] - 0.1 - 25e-3).abs() < 5e-3, "{:?}", second.start);
}
