//! Equilibrium of bodies on grids: against a dense twin and closed forms, over a table of bodies.

use crate::common::grid_body;

use anisobond::lattice::{Body, Grid, Influence, Neighbourhood};
use anisobond::operator::{GridOperator, VectorField};
use anisobond::solver::grid::{Equilibrium, FreeModes, FreePart, Method, Scheme, Smoothing, Supports};
use anisobond::solver::{Ending, SettlingEnd, Stopping, settle};
use anisobond::tensor::{Material, Stiffness};
use grid_body::GridBody;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

const SPACING: f64 = 0.01;

fn steel() -> Stiffness {
    Stiffness::isotropic(40e9, 40e9)
}

fn grid(nodes: [usize; 3], periodic: [bool; 3]) -> Grid {
    Grid::new(nodes, SPACING, Vector3::zeros(), periodic).unwrap()
}

fn with_materials(body: Body, materials: &[Stiffness]) -> GridBody {
    GridBody::new(body, &Neighbourhood::sphere(3.0, SPACING, Influence::Inverse).unwrap(), materials)
}

/// A block whose lowest two layers along the last axis that is not periodic are held.
fn held(body: &Body) -> Supports {
    let axis = (0..3).rev().find(|a| !body.grid.periodic[*a]).unwrap();
    let low = |n: &usize| body.has(*n) && body.grid.coordinates(*n)[axis] < 2;
    Supports::new(body, (0..body.grid.len()).filter(low).map(|n| (n as u32, [Some(0.0); 3]))).unwrap()
}

/// A deterministic field on the body.
fn wiggle(body: &Body, seed: f64) -> VectorField {
    let mut v = VectorField::zeros(body.grid.len());
    for n in (0..v.len()).filter(|n| body.has(*n)) {
        v.set(n, &Vector3::from_fn(|a, _| ((1.0 + seed) * (3.7 * n as f64 + 1.3 * a as f64)).sin()));
    }
    v
}

/// A block with a hole along y.
fn with_hole(nodes: [usize; 3], periodic: [bool; 3]) -> Body {
    let mut body = Body::full(grid(nodes, periodic));
    for n in 0..body.grid.len() {
        let [i, _, k] = body.grid.coordinates(n);
        let (x, z) = (i as f64 - 0.5 * (nodes[0] - 1) as f64, k as f64 - 0.5 * (nodes[2] - 1) as f64);
        if x.hypot(z) < 0.2 * nodes[0] as f64 {
            body.region[n] = 0;
        }
    }
    body
}

/// Bodies that are difficult in different ways.
fn table() -> Vec<(&'static str, GridBody)> {
    let hole = with_materials(with_hole([9, 6, 8], [false; 3]), &[steel()]);
    let plane_strain = with_materials(with_hole([13, 1, 12], [false, true, false]), &[steel()]);
    let thin = with_materials(with_hole([12, 3, 11], [false, true, false]), &[steel()]);
    let tube = with_materials(Body::full(grid([7, 5, 9], [true, true, false])), &[steel()]);
    let mut layers = Body::full(grid([8, 6, 9], [false; 3]));
    for n in 0..layers.grid.len() {
        layers.region[n] = 1 + (layers.grid.coordinates(n)[2] / 3 % 2) as u16;
    }
    let layers = with_materials(layers, &[steel(), steel().scaled(1e-3)]);
    let mut cracked = with_materials(Body::full(grid([10, 5, 9], [false; 3])), &[steel()]);
    cracked.cut(|p, q| (p.z < 0.0451) != (q.z < 0.0451) && p.x < 0.0451);
    let rock =
        with_materials(Body::full(grid([8, 7, 8], [false; 3])), &[Material::builtin("CoTeO4").unwrap().stiffness]);
    vec![
        ("hole", hole),
        ("plane strain", plane_strain),
        ("thin", thin),
        ("tube", tube),
        ("layers of contrast 1000", layers),
        ("cracked", cracked),
        ("anisotropic", rock),
    ]
}

/// K of the free components, column by column, with their (node, component).
fn dense(body: &GridBody, supports: &Supports) -> (DMatrix<f64>, Vec<(usize, usize)>) {
    let n = body.body.grid.len();
    let free: Vec<(usize, usize)> = (0..n)
        .filter(|n| body.body.has(*n))
        .flat_map(|n| (0..3).map(move |a| (n, a)))
        .filter(|(n, a)| !supports.fixed(*n)[*a])
        .collect();
    let mut k = DMatrix::zeros(free.len(), free.len());
    let mut place = vec![[usize::MAX; 3]; n];
    for (i, (n, a)) in free.iter().enumerate() {
        place[*n][*a] = i;
    }
    let mut u = VectorField::zeros(n);
    let mut f = VectorField::zeros(n);
    for (column, (node, a)) in free.iter().enumerate() {
        u.components[*a][*node] = 1.0;
        body.forces(&u, &mut f);
        u.components[*a][*node] = 0.0;
        for (row, (n, b)) in free.iter().enumerate() {
            k[(row, column)] = -f.components[*b][*n];
        }
    }
    (k, free)
}

fn difference(a: &VectorField, b: &VectorField) -> f64 {
    let norm = |f: &dyn Fn(usize) -> Vector3<f64>| (0..a.len()).map(|n| f(n).norm_squared()).sum::<f64>().sqrt();
    norm(&|n| a.at(n) - b.at(n)) / norm(&|n| b.at(n))
}

fn methods() -> [Method; 3] {
    [
        Method::default(),
        Method::CoarseGrids(Scheme::Multiplicative { weight: 0.9 }, Smoothing::default()),
        Method::NodeBlocks,
    ]
}

fn tight() -> Stopping {
    Stopping { tolerance: 1e-11, most_iterations: 3000 }
}

#[test]
fn every_body_agrees_with_its_dense_twin() {
    for (name, body) in table() {
        let mut supports = held(&body.body);
        let top = (body.body.grid.len() - 1) as u32;
        let prescribed: Vec<_> = (0..body.body.grid.len())
            .filter(|n| supports.fixed(*n)[0])
            .map(|n| (n as u32, [Some(1e-5), Some(0.0), Some(-2e-5)]))
            .chain([(top, [None, Some(3e-5), None])])
            .collect();
        supports = Supports::new(&body.body, prescribed).unwrap();
        let mut load = wiggle(&body.body, 0.1);
        for n in 0..load.len() {
            let f = load.at(n) * 1e4;
            load.set(n, &f);
        }
        let (k, free) = dense(&body, &supports);
        let mut lifted = VectorField::zeros(load.len());
        supports.impose(&mut lifted);
        let mut f = VectorField::zeros(load.len());
        body.forces(&lifted, &mut f);
        let b = DVector::from_iterator(
            free.len(),
            free.iter().map(|(n, a)| f.components[*a][*n] + load.components[*a][*n]),
        );
        let x = k.cholesky().expect("a supported body").solve(&b);
        let mut exact = lifted;
        for (x, (n, a)) in x.iter().zip(&free) {
            exact.components[*a][*n] = *x;
        }
        for method in methods() {
            let equilibrium = Equilibrium::new(&body, &supports, method);
            assert!(equilibrium.free_modes().none(), "{name}");
            let (u, report) = equilibrium.solve(&load, VectorField::zeros(load.len()), &tight()).unwrap();
            assert!(report.converged() && report.residual <= 1e-11, "{name} {method:?}: {report:?}");
            let error = difference(&u, &exact);
            assert!(error < 1e-7, "{name} {method:?}: {error:e}");
        }
    }
}

#[test]
fn preconditioners_are_symmetric_and_positive() {
    let dot = |a: &VectorField, b: &VectorField| (0..a.len()).map(|n| a.at(n).dot(&b.at(n))).sum::<f64>();
    for (name, body) in table() {
        let supports = held(&body.body);
        for method in methods() {
            let equilibrium = Equilibrium::new(&body, &supports, method);
            let m = equilibrium.preconditioner();
            let apply = |mut r: VectorField| {
                supports.clear(&mut r);
                let mut z = VectorField::zeros(r.len());
                m.apply(&FreePart { operator: &body, supports: &supports }, &r, &mut z);
                (r, z)
            };
            for seed in [0.2, 0.5, 0.8] {
                let (a, ma) = apply(wiggle(&body.body, seed));
                let (b, mb) = apply(wiggle(&body.body, seed + 0.05));
                let (aa, bb) = (dot(&a, &ma), dot(&b, &mb));
                assert!(aa > 0.0 && bb > 0.0, "{name} {method:?}");
                let asymmetry = (dot(&a, &mb) - dot(&b, &ma)).abs() / (aa * bb).sqrt();
                assert!(asymmetry < 1e-11, "{name} {method:?}: {asymmetry:e}");
                let fixed = (0..a.len()).filter(|n| supports.fixed(*n)[0] || !body.body.has(*n));
                assert!(fixed.into_iter().all(|n| ma.at(n) == Vector3::zeros()), "{name} {method:?}");
            }
        }
    }
}

/// Iterations to 1e-8 of a block with a hole, pulled at the top.
fn iterations(n: usize, c: &Stiffness, method: Method) -> usize {
    let body = with_materials(with_hole([n; 3], [false; 3]), &[*c]);
    let supports = held(&body.body);
    let mut load = VectorField::zeros(body.body.grid.len());
    let plane = n * n;
    load.components[2][plane * (n - 1)..].fill(1.0);
    let equilibrium = Equilibrium::new(&body, &supports, method);
    let (_, report) = equilibrium.solve(&load, VectorField::zeros(load.len()), &Stopping::default()).unwrap();
    assert!(report.converged(), "{report:?}");
    report.iterations
}

#[test]
fn iterations_hardly_grow_with_the_grid() {
    let (small, large) = (iterations(14, &steel(), Method::default()), iterations(28, &steel(), Method::default()));
    assert!(large <= 30 && large as f64 <= 1.3 * small as f64, "{small} → {large}");
    let (small, large) = (iterations(8, &steel(), Method::NodeBlocks), iterations(16, &steel(), Method::NodeBlocks));
    assert!(large as f64 > 1.5 * small as f64, "{small} → {large}");
}

/// Displacements jump across a crack on every coarse grid, too: a crack costs iterations, but not with the number of nodes.
#[test]
fn cracks_cost_iterations_but_not_with_the_grid() {
    let iterations = |n: usize| {
        let mut body = with_materials(Body::full(grid([n; 3], [false; 3])), &[steel()]);
        let (plane, tip) = ((0.5 * n as f64 - 0.49) * SPACING, 0.6 * n as f64 * SPACING);
        body.cut(|p, q| (p.z < plane) != (q.z < plane) && p.x < tip);
        let supports = held(&body.body);
        let mut load = VectorField::zeros(body.body.grid.len());
        load.components[2][n * n * (n - 1)..].fill(1.0);
        let equilibrium = Equilibrium::new(&body, &supports, Method::default());
        let (_, report) = equilibrium.solve(&load, VectorField::zeros(load.len()), &Stopping::default()).unwrap();
        assert!(report.converged(), "{report:?}");
        report.iterations
    };
    let (small, large) = (iterations(12), iterations(24));
    assert!(large <= 45 && large as f64 <= 1.3 * small as f64, "{small} → {large}");
}

/// A plane crack: centre, normal and radius, of an edge of one.
type Disc = ([f64; 3], [f64; 3], f64);

/// Whether the way from p to q passes a disc; nodes on its plane are below it.
fn passes(p: &Vector3<f64>, q: &Vector3<f64>, centre: &Vector3<f64>, normal: &Vector3<f64>, radius: &f64) -> bool {
    let (a, b) = (normal.dot(&(p - centre)), normal.dot(&(q - centre)));
    let below = |side: f64| side < 1e-9 * normal.norm();
    below(a) != below(b) && (p + (q - p) * (a / (a - b)) - centre).norm() < *radius
}

/// Iterations to 1e-8 of a free block with cracks, pulled apart along z.
fn iterations_of_cracked(n: usize, cracks: &[Disc]) -> usize {
    let mut body = with_materials(Body::full(grid([n; 3], [false; 3])), &[steel()]);
    let edge = n as f64 * SPACING;
    for (centre, normal, radius) in cracks {
        let (centre, normal) = (Vector3::from(*centre) * edge - Vector3::repeat(0.5 * SPACING), Vector3::from(*normal));
        body.cut(|p, q| passes(p, q, &centre, &normal, &(radius * edge)));
    }
    let supports = Supports::none();
    let mut load = VectorField::zeros(body.body.grid.len());
    load.components[2][n * n * (n - 1)..].fill(1.0);
    load.components[2][..n * n].fill(-1.0);
    let equilibrium = Equilibrium::new(&body, &supports, Method::default());
    let (_, report) = equilibrium.solve(&load, VectorField::zeros(load.len()), &Stopping::default()).unwrap();
    assert!(report.converged(), "{report:?}");
    report.iterations
}

/// Free bodies with cracks of any place and direction: through nodes, off them, several, and almost all the way through. Every
/// side of a crack moves as it likes on every coarse grid, and nothing on them is a mechanism.
#[test]
fn free_cracked_bodies() {
    let cracks: [(&str, Vec<Disc>); 5] = [
        ("oblique disc", vec![([0.5; 3], [1.0, 2.0, 3.0], 0.35)]),
        ("through nodes", vec![([0.5; 3], [0.0, 1.0, 1.0], 0.4)]),
        ("just off nodes", vec![([0.5, 0.5 + 1e-7, 0.5], [0.0, 1.0, 1.0], 0.4)]),
        ("almost in two", vec![([0.5; 3], [0.2, 0.1, 1.0], 0.62)]),
        (
            "several",
            vec![
                ([0.3, 0.3, 0.3], [1.0, 0.0, 1.0], 0.3),
                ([0.7, 0.6, 0.6], [1.0, -1.0, 1.0], 0.35),
                ([0.5, 0.5, 0.75], [0.1, 0.0, 1.0], 0.3),
            ],
        ),
    ];
    for (name, cracks) in cracks {
        let found = iterations_of_cracked(14, &cracks);
        assert!(found <= 60, "{name}: {found}");
    }
}

/// A long strip of two layers, free, bent by couples at its ends: its softest motions are 10⁷ times softer than its nodes.
#[test]
fn a_free_laminate_is_bent() {
    let (long, thick) = (192, 16);
    let mut body = Body::full(grid([long, 1, thick], [false, true, false]));
    for n in 0..body.grid.len() {
        body.region[n] = if body.grid.coordinates(n)[2] < thick / 2 { 1 } else { 2 };
    }
    let stiff = Stiffness::isotropic(56e9, 56e9);
    let body = with_materials(body, &[stiff, stiff.scaled(1.0 / 14.0)]);
    let supports = Supports::none();
    let mut load = VectorField::zeros(body.body.grid.len());
    for k in 0..thick {
        let couple = k as f64 - 0.5 * (thick - 1) as f64;
        load.components[0][long * k] = -couple;
        load.components[0][long * k + long - 1] = couple;
    }
    let stopping = Stopping { tolerance: 1e-9, most_iterations: 1000 };
    let equilibrium = Equilibrium::new(&body, &supports, Method::default());
    let (_, report) = equilibrium.solve(&load, VectorField::zeros(load.len()), &stopping).unwrap();
    assert!(report.converged() && report.iterations <= 40, "{report:?}");
}

#[test]
fn every_material_of_the_document_converges() {
    for name in Material::builtin_names() {
        let c = Material::builtin(name).unwrap().stiffness;
        let (coarse, plain) = (iterations(16, &c, Method::default()), iterations(16, &c, Method::NodeBlocks));
        assert!(coarse < plain, "{name}: {coarse} against {plain}");
        assert!(coarse <= 60, "{name}: {coarse}");
    }
}

/// A uniform strain prescribed where neighbourhoods are truncated is the equilibrium of the rest.
#[test]
fn patch_test() {
    for name in ["KIO3", "CoTeO4"] {
        let body =
            with_materials(Body::full(grid([11, 10, 12], [false; 3])), &[Material::builtin(name).unwrap().stiffness]);
        let gradient = Matrix3::new(1.0, 0.3, -0.2, 0.5, -0.7, 0.1, 0.2, 0.4, 0.6) * 1e-4;
        let g = &body.body.grid;
        let outer = |n: &usize| {
            let at = g.coordinates(*n);
            (0..3).any(|a| at[a] < 3 || at[a] + 3 >= g.nodes[a])
        };
        let exact = |n: usize| gradient * g.position(n);
        let prescribed = (0..g.len()).filter(outer).map(|n| {
            let u = exact(n);
            (n as u32, [Some(u.x), Some(u.y), Some(u.z)])
        });
        let supports = Supports::new(&body.body, prescribed).unwrap();
        let load = VectorField::zeros(g.len());
        let equilibrium = Equilibrium::new(&body, &supports, Method::default());
        let (u, report) = equilibrium.solve(&load, load.clone(), &tight()).unwrap();
        assert!(report.converged(), "{report:?}");
        let worst = (0..g.len()).map(|n| (u.at(n) - exact(n)).norm()).fold(0.0, f64::max);
        assert!(worst < 1e-13, "{name}: {worst:e}");
    }
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let body = with_materials(with_hole([12, 6, 11], [false, true, false]), &[steel()]);
    let supports = held(&body.body);
    let load = wiggle(&body.body, 0.3);
    let solve = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let equilibrium = Equilibrium::new(&body, &supports, Method::default());
            equilibrium.solve(&load, VectorField::zeros(load.len()), &Stopping::default()).unwrap()
        })
    };
    assert!(solve(1) == solve(3));
}

/// A pull along x on one half of the nodes, balanced on the other half where asked.
fn pull(body: &Body, balanced: bool) -> VectorField {
    let mut load = VectorField::zeros(body.grid.len());
    let middle = body.grid.nodes[0] / 2;
    for n in (0..load.len()).filter(|n| body.has(*n)) {
        let right = body.grid.coordinates(n)[0] >= middle;
        load.components[0][n] = if right {
            1.0
        } else if balanced {
            -1.0
        } else {
            0.0
        };
    }
    load
}

#[test]
fn bodies_that_nothing_holds_are_named() {
    let message = |body: &GridBody, supports: &Supports, load: &VectorField| {
        Equilibrium::new(body, supports, Method::default())
            .solve(load, VectorField::zeros(load.len()), &Stopping::default())
            .unwrap_err()
            .to_string()
    };
    let block = with_materials(Body::full(grid([6, 6, 6], [false; 3])), &[steel()]);
    let g = block.body.grid.clone();
    let all: Vec<u32> = (0..g.len() as u32).collect();
    let free = FreeModes::new(&block, &Supports::none());
    let names = free.describe().join("; ");
    for mode in ["translation along x", "translation along y", "translation along z"] {
        assert!(names.contains(mode), "{names}");
    }
    for mode in ["rotation about x", "rotation about y", "rotation about z"] {
        assert!(names.contains(mode), "{names}");
    }
    assert_eq!(free.describe().len(), 6);

    // Held along y and z on a face: free along x only.
    let sliding = Supports::new(&block.body, all.iter().map(|n| (*n, [None, Some(0.0), Some(0.0)]))).unwrap();
    let text = message(&block, &sliding, &pull(&block.body, false));
    assert!(text.contains("translation along x of 216 nodes") && !text.contains("rotation"), "{text}");

    // An edge along z held: turns about it, and the message says where the axis is.
    let edge = all.iter().filter(|n| g.coordinates(**n as usize)[..2] == [0, 0]);
    let hinge = Supports::new(&block.body, edge.map(|n| (*n, [Some(0.0); 3]))).unwrap();
    let mut load = VectorField::zeros(g.len());
    load.components[1][g.index([5, 0, 0])] = 1.0;
    let text = message(&block, &hinge, &load);
    assert!(text.contains("rotation about z through (0 0 ") && !text.contains("translation"), "{text}");

    // Periodic axes leave translations only.
    let tube = with_materials(Body::full(grid([6, 6, 6], [true, true, false])), &[steel()]);
    let names = FreeModes::new(&tube, &Supports::none()).describe();
    assert!(names.len() == 3 && names.iter().all(|n| n.contains("translation")), "{names:?}");
    let rod = with_materials(Body::full(grid([6, 6, 6], [false, false, true])), &[steel()]);
    assert_eq!(FreeModes::new(&rod, &Supports::none()).describe().len(), 4);

    // A part cut off by a crack.
    let mut split = with_materials(Body::full(grid([8, 4, 4], [false; 3])), &[steel()]);
    split.cut(|p, q| (p.x < 0.0351) != (q.x < 0.0351));
    let left = (0..128u32).filter(|n| split.body.grid.coordinates(*n as usize)[0] == 0);
    let clamp = Supports::new(&split.body, left.map(|n| (n, [Some(0.0); 3]))).unwrap();
    assert_eq!(FreeModes::new(&split, &clamp).describe().len(), 6);
    let text = message(&split, &clamp, &pull(&split.body, false));
    assert!(text.contains("translation along x of 64 nodes around (0.055 0.015 0.015) m"), "{text}");

    // A node without bonds.
    let mut dust = with_materials(Body::full(grid([5, 5, 5], [false; 3])), &[steel()]);
    dust.cut(|p, q| p.norm() < 1e-9 || q.norm() < 1e-9);
    let top = (100..125u32).map(|n| (n, [Some(0.0); 3]));
    let clamp = Supports::new(&dust.body, top).unwrap();
    assert_eq!(FreeModes::new(&dust, &clamp).loose_nodes(), 1);
    let mut load = VectorField::zeros(125);
    load.components[2][0] = 1.0;
    let text = message(&dust, &clamp, &load);
    assert!(text.contains("the node at (0 0 0) m is pulled along (0 0 1)"), "{text}");
}

/// A free body under loads that balance: solved, without rigid motion, as the same body held at three points.
#[test]
fn balanced_loads_need_no_supports() {
    let body = with_materials(with_hole([9, 6, 8], [false; 3]), &[steel()]);
    let g = body.body.grid.clone();
    let mut load = VectorField::zeros(g.len());
    for n in (0..g.len()).filter(|n| body.body.has(*n)) {
        let at = g.coordinates(n);
        load.components[0][n] = if at[0] == 0 {
            -1e3
        } else if at[0] == 8 {
            1e3
        } else {
            0.0
        };
    }
    for method in [Method::default(), Method::NodeBlocks] {
        let none = Supports::none();
        let equilibrium = Equilibrium::new(&body, &none, method);
        let (u, report) = equilibrium.solve(&load, VectorField::zeros(g.len()), &tight()).unwrap();
        assert!(report.converged(), "{report:?}");
        let mean: Vector3<f64> = (0..g.len()).map(|n| u.at(n)).sum();
        let largest = (0..g.len()).map(|n| u.at(n).norm()).fold(0.0, f64::max);
        assert!(mean.norm() < 1e-10 * largest * g.len() as f64, "{mean}");
        let fixed = [
            ([0, 0, 0], [Some(0.0); 3]),
            ([0, 0, 7], [Some(0.0), Some(0.0), None]),
            ([0, 5, 0], [Some(0.0), None, None]),
        ];
        let three = Supports::new(&body.body, fixed.map(|(at, f)| (g.index(at) as u32, f))).unwrap();
        let equilibrium = Equilibrium::new(&body, &three, method);
        assert!(equilibrium.free_modes().none());
        let (v, report) = equilibrium.solve(&load, VectorField::zeros(g.len()), &tight()).unwrap();
        assert!(report.converged(), "{report:?}");
        // Distances between nodes change alike.
        for (p, q) in [([0, 0, 0], [8, 5, 7]), ([0, 5, 0], [8, 0, 0]), ([4, 0, 0], [4, 5, 7])] {
            let (p, q) = (g.index(p), g.index(q));
            let d = (g.position(q) - g.position(p)).normalize();
            let stretch = |u: &VectorField| d.dot(&(u.at(q) - u.at(p)));
            assert!((stretch(&u) - stretch(&v)).abs() < 1e-7 * largest, "{} {}", stretch(&u), stretch(&v));
        }
    }
}

#[test]
fn relaxation_is_of_the_same_opinion() {
    let body = with_materials(with_hole([10, 1, 10], [false, true, false]), &[steel()]);
    let supports = held(&body.body);
    let load = pull(&body.body, false);
    let solve = |method| {
        let stopping = Stopping { tolerance: 1e-9, most_iterations: 20_000 };
        Equilibrium::new(&body, &supports, method).solve(&load, VectorField::zeros(load.len()), &stopping).unwrap()
    };
    let ((u, _), (v, report)) = (solve(Method::default()), solve(Method::Relaxation));
    assert!(report.converged() && report.iterations < 3000, "{report:?}");
    assert!(difference(&v, &u) < 1e-6, "{:e}", difference(&v, &u));
}

/// Finite stretch: two methods agree, the forces balance, and the difference from linear kinematics is of second order.
#[test]
fn finite_stretch() {
    let body = with_materials(Body::full(grid([6, 5, 10], [false; 3])), &[steel()]);
    let supports = held(&body.body);
    let forces = |u: &VectorField, f: &mut VectorField| body.finite_forces(u, f);
    let stopping = Stopping { tolerance: 1e-9, most_iterations: 5000 };
    let solve = |size: f64, method| {
        let mut load = VectorField::zeros(body.body.grid.len());
        load.components[0][270..].fill(size);
        let zeros = VectorField::zeros(load.len());
        let equilibrium = Equilibrium::new(&body, &supports, method);
        let (linear, _) = equilibrium.solve(&load, zeros.clone(), &stopping).unwrap();
        let (u, report) = equilibrium.solve_nonlinear(&forces, &load, zeros, &stopping).unwrap();
        assert!(report.converged(), "{method:?} {report:?}");
        (linear, u, report)
    };
    let size = 2e4;
    let (linear, u, report) = solve(size, Method::default());
    let (_, relaxed, _) = solve(size, Method::Relaxation);
    assert!(difference(&relaxed, &u) < 1e-6, "{:e}", difference(&relaxed, &u));
    assert!(report.applications < 150, "{report:?}");
    let large = difference(&u, &linear);
    let (linear, u, _) = solve(0.5 * size, Method::default());
    let small = difference(&u, &linear);
    assert!(large > 1e-4 && (large / small - 2.0).abs() < 0.5, "{large:e} {small:e}");
}

/// A notched strip pulled apart: linear below the critical load, then the ligament breaks and the force falls.
#[test]
fn a_notched_strip_is_pulled_apart() {
    let mut strip = with_materials(Body::full(grid([16, 1, 11], [false, true, false])), &[steel()]);
    strip.cut(|p, q| (p.x < 0.0751) != (q.x < 0.0751) && p.z < 0.0451);
    let g = strip.body.grid.clone();
    let grips = (0..g.len()).filter_map(|n| match g.coordinates(n)[0] {
        0..3 => Some((n as u32, [Some(0.0); 3])),
        13..16 => Some((n as u32, [Some(1e-3), Some(0.0), Some(0.0)])),
        _ => None,
    });
    let supports = Supports::new(&strip.body, grips).unwrap();
    let load = VectorField::zeros(g.len());
    let stopping = Stopping { tolerance: 1e-8, most_iterations: 2000 };
    let (mut force, mut steps, mut u) = (Vec::new(), Vec::new(), VectorField::zeros(g.len()));
    for step in 1..=10 {
        let scaled = supports.scaled(f64::from(step) / 10.0);
        let solve = |body: &GridBody, start: &VectorField| {
            Equilibrium::new(body, &scaled, Method::default()).solve(&load, start.clone(), &stopping).map(Some)
        };
        let (next, settled) = settle(&mut strip, u, solve, |body, _, u| Ok(body.break_above(u, 6e-3))).unwrap();
        assert_eq!(settled.ended, SettlingEnd::AtRest, "{settled:?}");
        u = next;
        steps.push(settled);
        let mut f = VectorField::zeros(u.len());
        strip.forces(&u, &mut f);
        force.push((0..u.len()).filter(|n| g.coordinates(*n)[0] < 3).map(|n| f.components[0][n]).sum::<f64>());
    }
    let first = steps.iter().position(|s| s.broken > 0).expect("the ligament breaks");
    assert!(first > 0 && steps[first].equilibria > 2, "{steps:?}");
    let slope = force[0];
    assert!(first >= 2 && (0..first).all(|i| (force[i] / slope - (i + 1) as f64).abs() < 1e-6), "{force:?}");
    // What is left are bonds that linear kinematics only turns or compresses; nothing more breaks.
    let peak = force.iter().copied().fold(0.0, f64::max);
    assert!(force[9] < 0.5 * peak, "{force:?}");
    assert_eq!(strip.break_above(&u, 6e-3), 0);
}

/// K with its sign turned, or poisoned: outcomes that carry their evidence.
struct Wrong<'a>(&'a GridBody, f64);

impl GridOperator for Wrong<'_> {
    fn body(&self) -> &Body {
        self.0.body()
    }
    fn forces(&self, u: &VectorField, f: &mut VectorField) {
        self.0.forces(u, f);
        f.components.iter_mut().flatten().for_each(|f| *f *= self.1);
    }
    fn diagonal_block(&self, node: usize) -> Matrix3<f64> {
        self.0.diagonal_block(node)
    }
    fn half_bonds(&self, node: usize, visit: &mut dyn FnMut(usize)) {
        self.0.half_bonds(node, visit)
    }
    fn bulk_stiffness(&self, region: u16) -> Stiffness {
        self.0.bulk_stiffness(region)
    }
    fn wholeness(&self, node: usize) -> f64 {
        self.0.wholeness(node)
    }
}

#[test]
fn failures_are_outcomes_and_wrong_loads_errors() {
    let body = with_materials(Body::full(grid([5, 5, 5], [false; 3])), &[steel()]);
    let supports = held(&body.body);
    let load = pull(&body.body, false);
    let solve = |operator: &dyn GridOperator, load: &VectorField, stopping: &Stopping| {
        Equilibrium::new(operator, &supports, Method::default()).solve(load, VectorField::zeros(load.len()), stopping)
    };
    let ending = |factor: f64| solve(&Wrong(&body, factor), &load, &tight()).unwrap().1.ending;
    assert!(matches!(ending(-1.0), Ending::NegativeCurvature { curvature } if curvature < 0.0));
    assert!(matches!(ending(f64::NAN), Ending::NotFinite { .. }), "{:?}", ending(f64::NAN));
    let short = Stopping { tolerance: 1e-8, most_iterations: 3 };
    let (_, report) = solve(&body, &load, &short).unwrap();
    assert!(report.ending == Ending::MostIterations && report.residual > 1e-8 && report.iterations == 3);
    let (u, report) = solve(&body, &VectorField::zeros(125), &tight()).unwrap();
    assert!(report.converged() && u == VectorField::zeros(125));
    let mut bad = load.clone();
    bad.components[1][7] = f64::NAN;
    assert!(solve(&body, &bad, &tight()).unwrap_err().to_string().contains("not finite"));
    assert!(solve(&body, &VectorField::zeros(3), &tight()).is_err());
    assert!(Supports::new(&body.body, [(125, [Some(0.0); 3])]).is_err());
    assert!(Supports::new(&body.body, [(0, [Some(f64::NAN); 3])]).is_err());
    let mut holed = body.body.clone();
    holed.region[0] = 0;
    assert!(Supports::new(&holed, [(0, [Some(0.0); 3])]).is_err());
}
