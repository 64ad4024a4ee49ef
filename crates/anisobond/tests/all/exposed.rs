//! Exposed spheres: which carry how much of a surface.

use crate::common;

use anisobond::lattice::solid::{Surface, Window, exposed_spheres};
use anisobond::lattice::{Packing, Solid};
use common::{Random, jittered};
use nalgebra::{Matrix3, Vector3};

/// A window that holds everything.
fn window() -> Window {
    Window { low: Vector3::repeat(-60.0), high: Vector3::repeat(60.0), periodic: [false; 3] }
}

/// Spheres of diameter d on a simple cubic lattice, at (i, j, k) d.
fn cubic(nodes: [usize; 3], d: f64) -> Packing {
    let [l, m, n] = nodes;
    let all = (0..n).flat_map(|k| (0..m).flat_map(move |j| (0..l).map(move |i| [i, j, k])));
    let centres: Vec<Vector3<f64>> = all.map(|at| Vector3::from(at.map(|x| d * x as f64))).collect();
    let radii = vec![0.5 * d; centres.len()];
    Packing::new(None, centres, radii).unwrap()
}

fn moved(packing: &Packing, q: &Matrix3<f64>, t: &Vector3<f64>) -> Packing {
    let centres = packing.centres().iter().map(|x| q * x + t).collect();
    Packing::new(None, centres, packing.radii().to_vec()).unwrap()
}

fn put(solid: &Solid, q: &Matrix3<f64>, t: &Vector3<f64>) -> Solid {
    Solid::Moved { solid: Box::new(solid.clone()), rotation: *q, shift: *t }
}

/// What sphere i carries with a normal near n.
fn carried(surface: &Surface, i: u32, n: &Vector3<f64>) -> f64 {
    surface.patches.iter().filter(|p| p.node == i && p.normal.dot(n) > 0.99).map(|p| p.area).sum()
}

/// On a simple cubic block the cells of the centres at a face are squares d²: a sphere carries d² of every face that it is at,
/// and inner ones carry nothing; so too where the block is turned, mirrored and moved.
#[test]
fn a_sphere_of_a_cubic_block_carries_its_square_of_every_face_it_is_at() {
    let mut random = Random(5);
    for (nodes, d) in [([4, 5, 6], 1.0), ([3, 3, 3], 0.02), ([7, 2, 1], 0.5)] {
        let packing = cubic(nodes, d);
        let edges = Vector3::from(nodes.map(|n| d * n as f64));
        let block = Solid::Box { min: Vector3::repeat(-0.5 * d), max: edges - Vector3::repeat(0.5 * d) };
        let mirror = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0));
        let turns = [Matrix3::identity(), random.rotation(), mirror, random.rotation() * mirror];
        for (q, t) in
            turns.into_iter().zip([Vector3::zeros(), Vector3::new(3.0, -2.0, 1.0) * d, Vector3::x(), Vector3::z()])
        {
            let (there, solid) = (moved(&packing, &q, &t), put(&block, &q, &t));
            let surface = exposed_spheres(&there, &solid, &solid, 1.1 * d, &window()).unwrap();
            for i in 0..packing.len() {
                let at = [i % nodes[0], i / nodes[0] % nodes[1], i / (nodes[0] * nodes[1])];
                let mut whole = 0.0;
                for a in 0..3 {
                    for (sign, end) in [(-1.0, 0), (1.0, nodes[a] - 1)] {
                        let n = q * Vector3::ith(a, sign);
                        let (found, exact) = (carried(&surface, i as u32, &n), if at[a] == end { d * d } else { 0.0 });
                        assert!((found - exact).abs() < 1e-6 * d * d, "{nodes:?} {at:?} {a} {sign}: {found} {exact}");
                        whole += exact;
                    }
                }
                let all: f64 = surface.patches.iter().filter(|p| p.node == i as u32).map(|p| p.area).sum();
                assert!((all - whole).abs() < 1e-6 * d * d, "{nodes:?} {at:?}: {all} {whole}");
            }
            let area = 2.0 * (edges.x * edges.y + edges.y * edges.z + edges.z * edges.x);
            assert!((surface.area() / area - 1.0).abs() < 1e-6, "{}", surface.area());
            // Closed: ∮ n dA = 0, ∮ x × n dA = 0, and ∮ x dA is the area at the middle.
            let middle = q * (0.5 * edges - Vector3::repeat(0.5 * d)) + t;
            assert!(surface.normal.norm() < 1e-6 * area && surface.turning.norm() < 1e-6 * area * (edges + t).norm());
            assert!((surface.moment / area - middle).norm() < 1e-6 * edges.norm(), "{}", surface.moment);
        }
    }
}

/// The (001) face of a face-centred block, edge a = √2 d: every sphere of the first layer carries a²/2, those on a side half
/// of that, those in a corner a quarter; of the next layer none carries anything.
#[test]
fn a_face_centred_face_is_shared_by_its_first_layer() {
    let (a, n) = (2f64.sqrt(), 4usize);
    let half = 0.5 * a;
    let places = (0..=2 * n).flat_map(|i| (0..=2 * n).flat_map(move |j| (0..4).map(move |k| [i, j, k])));
    let centres: Vec<Vector3<f64>> =
        places.filter(|[i, j, k]| (i + j + k) % 2 == 0).map(|at| half * Vector3::from(at.map(|x| x as f64))).collect();
    let packing = Packing::new(None, centres.clone(), vec![0.5; centres.len()]).unwrap();
    let edge = a * n as f64;
    let block = Solid::Box { min: Vector3::new(0.0, 0.0, -0.5), max: Vector3::new(edge, edge, 10.0) };
    let below = Solid::HalfSpace { point: Vector3::new(0.0, 0.0, -0.5), normal: Vector3::z() };
    let surface = exposed_spheres(&packing, &below, &block, 2.0, &window()).unwrap();
    // Pieces that the block's sides cut are halved until what is left is about a thousandth.
    assert!((surface.area() / (edge * edge) - 1.0).abs() < 1e-3, "{}", surface.area() / (edge * edge));
    assert!((surface.normal + Vector3::z() * surface.area()).norm() < 1e-9);
    for (i, x) in centres.iter().enumerate() {
        let found = carried(&surface, i as u32, &-Vector3::z());
        let sides = [x.x, x.y].into_iter().filter(|s| *s < 1e-9 || *s > edge - 1e-9).count() as i32;
        let exact = if x.z < 1e-9 { 0.5 * a * a * 0.5f64.powi(sides) } else { 0.0 };
        // Pieces of 1/8 lie across the slanting sides (of length 1, four of a whole cell): half a diagonal of them at most.
        assert!((found - exact).abs() <= 0.36 * exact, "{x}: {found} {exact}");
    }
}

/// Spheres that are shaken and thinned: areas are those of the cells of their centres on the face, counted at many points
/// with every distance looked at; whatever the reach, all of the face is carried.
#[test]
fn areas_are_those_of_nearest_centres() {
    let mut random = Random(9);
    for keep in [1.0, 0.5, 0.08] {
        let all = jittered(6, 17, 0.3);
        let centres: Vec<Vector3<f64>> =
            all.centres().iter().filter(|_| 0.5 * (random.number() + 1.0) < keep).copied().collect();
        let packing = Packing::new(None, centres.clone(), vec![0.5; centres.len()]).unwrap();
        let block = Solid::Box { min: Vector3::zeros(), max: Vector3::new(6.0, 6.0, 9.0) };
        let below = Solid::HalfSpace { point: Vector3::zeros(), normal: Vector3::z() };
        for reach in [0.9, 2.0, 20.0] {
            let near: Vec<usize> = (0..centres.len()).filter(|&i| centres[i].z.abs() <= reach).collect();
            if near.is_empty() {
                assert!(exposed_spheres(&packing, &below, &block, reach, &window()).is_err());
                continue;
            }
            let surface = exposed_spheres(&packing, &below, &block, reach, &window()).unwrap();
            assert!((surface.area() / 36.0 - 1.0).abs() < 1e-3, "{keep} {reach}: {}", surface.area());
            let points = 150;
            let mut counted = vec![0.0; centres.len()];
            for k in 0..points * points {
                let x = Vector3::new((k % points) as f64 + 0.5, (k / points) as f64 + 0.5, 0.0) * (6.0 / points as f64);
                let distance = |i: &usize| (centres[*i] - x).norm_squared();
                let nearest = near.iter().min_by(|i, j| distance(i).total_cmp(&distance(j))).unwrap();
                counted[*nearest] += 36.0 / (points * points) as f64;
            }
            for (i, exact) in counted.iter().enumerate() {
                let found = carried(&surface, i as u32, &-Vector3::z());
                // A border of a cell is found to a piece, r/4 = 1/8.
                assert!((found - exact).abs() < 0.03 + 0.05 * exact, "{keep} {reach} {i}: {found} {exact}");
            }
        }
    }
}
