//! Grains: the Voronoi cells of random points, and random orientations for them.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use rayon::prelude::*;

use crate::lattice::generate::Stream;
use crate::{Error, Result};

/// Nodes or spheres divided among grains.
#[derive(Clone, Debug, PartialEq)]
pub struct Grains {
    /// Points whose Voronoi cells the grains are (m).
    pub seeds: Vec<Vector3<f64>>,
    /// Per site, its grain.
    pub grain: Vec<u16>,
}

/// Divide sites among the Voronoi cells of as many random points, each within half of `spacing` (m) along every axis of a site taken
/// at random; distances go through faces where there is a `period` (m). Equal seeds give equal grains.
///
/// # Errors
/// No grain, or more than sites or than 65 534; a grain that no site is in.
pub fn grains(
    sites: &[Vector3<f64>],
    spacing: f64,
    period: [Option<f64>; 3],
    number: usize,
    seed: u64,
) -> Result<Grains> {
    if number == 0 || number > sites.len() || number > usize::from(u16::MAX) - 1 {
        return Err(Error::input(
            format!("{number} grains of {} nodes or spheres are not possible", sites.len()),
            "give at least one grain, at most as many as there are, and at most 65534",
        ));
    }
    let mut stream = Stream::new(seed);
    let seeds: Vec<Vector3<f64>> = (0..number)
        .map(|_| {
            let site = sites[((stream.unit() * sites.len() as f64) as usize).min(sites.len() - 1)];
            let within = Vector3::from_fn(|_, _| 0.5 * stream.signed());
            site + within * spacing
        })
        .collect();
    let squared = |x: &Vector3<f64>, seed: &Vector3<f64>| {
        let mut d = x - seed;
        for a in 0..3 {
            if let Some(period) = period[a] {
                d[a] -= period * (d[a] / period).round();
            }
        }
        d.norm_squared()
    };
    let nearest = |x: &Vector3<f64>| {
        let mut best = (f64::INFINITY, 0);
        for (n, seed) in seeds.iter().enumerate() {
            let d = squared(x, seed);
            if d < best.0 {
                best = (d, n as u16);
            }
        }
        best.1
    };
    let grain: Vec<u16> = sites.par_iter().map(nearest).collect();
    let mut filled = vec![false; number];
    grain.iter().for_each(|&g| filled[usize::from(g)] = true);
    if let Some(empty) = filled.iter().position(|f| !f) {
        return Err(Error::input(
            format!("grain {} of {number} holds no node or sphere", empty + 1),
            "use fewer grains, more nodes or spheres, or another seed",
        ));
    }
    Ok(Grains { seeds, grain })
}

/// Rotations spread evenly over all orientations (Shoemake 1992), repeatable by their seed.
pub fn random_rotations(number: usize, seed: u64) -> Vec<Matrix3<f64>> {
    let mut stream = Stream::new(seed);
    let mut rotation = || {
        let (u, v, w) = (stream.unit(), stream.unit(), stream.unit());
        let ((s1, c1), (s2, c2)) = ((std::f64::consts::TAU * v).sin_cos(), (std::f64::consts::TAU * w).sin_cos());
        let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
        let q = UnitQuaternion::new_normalize(Quaternion::new(b * c2, a * s1, a * c1, b * s2));
        *q.to_rotation_matrix().matrix()
    };
    (0..number).map(|_| rotation()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::Grid;

    #[test]
    fn grains_are_repeatable_and_nearest() {
        let grid = Grid::new([12, 10, 8], 0.5, Vector3::zeros(), [true, false, true]).unwrap();
        let nodes: Vec<usize> = (0..grid.len()).collect();
        let sites: Vec<Vector3<f64>> = nodes.iter().map(|&node| grid.position(node)).collect();
        let cells = |number: usize, seed: u64| grains(&sites, 0.5, [Some(6.0), None, Some(4.0)], number, seed);
        let a = cells(7, 3).unwrap();
        assert_eq!(a, cells(7, 3).unwrap());
        assert_ne!(a, cells(7, 4).unwrap());
        // Naive twin: images written out.
        for &n in nodes.iter().step_by(37) {
            let x = grid.position(n);
            let distance = |s: &Vector3<f64>| {
                let image = |i: i32, k: i32| s + Vector3::new(6.0 * f64::from(i), 0.0, 4.0 * f64::from(k));
                (-1..=1)
                    .flat_map(|i| (-1..=1).map(move |k| (i, k)))
                    .map(|(i, k)| (x - image(i, k)).norm())
                    .fold(9e9, f64::min)
            };
            let own = distance(&a.seeds[usize::from(a.grain[n])]);
            assert!(a.seeds.iter().all(|s| distance(s) >= own - 1e-12));
        }
        assert!(grains(&sites[..3], 0.5, [None; 3], 4, 0).is_err() && cells(0, 0).is_err());
    }

    /// The mean of R over all orientations is 0, that of each squared entry 1/3.
    #[test]
    fn rotations_are_even() {
        let n = 20_000;
        let all = random_rotations(n, 1);
        let mean = all.iter().sum::<Matrix3<f64>>() / n as f64;
        let square = all.iter().map(|r| r.map(|x| x * x)).sum::<Matrix3<f64>>() / n as f64;
        assert!(mean.amax() < 0.02 && (square - Matrix3::repeat(1.0 / 3.0)).amax() < 0.02);
        assert!(all.iter().all(|r| (r * r.transpose() - Matrix3::identity()).amax() < 1e-14 && r.determinant() > 0.0));
    }
}
