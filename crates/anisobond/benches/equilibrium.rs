//! Equilibrium of a block with a hole, from 48³ to 128³ nodes: iterations, applications of the operator and seconds with
//! coarse grids, against node blocks alone (Jacobi). Run with
//! `cargo bench -p anisobond --bench equilibrium -- [nodes per edge …] [built-in material …] [crack]`;
//! `crack` cuts the block through six tenths of its section instead of the hole, `disc`, `nodes` (through nodes at 45°), `almost`
//! (almost in two) and `several` cut it so and leave it free, pulled at both ends; `hybrid` adds the nodal term. Jacobi runs up to
//! 128³ nodes.

use std::time::Instant;

use anisobond::calibration::{ModelCalibrator, ModelSettings};
use anisobond::lattice::{Body, Grid, Influence, Neighbourhood};
use anisobond::operator::grid::{GridBonds, Stencil};
use anisobond::operator::{GridOperator, VectorField};
use anisobond::solver::Stopping;
use anisobond::solver::grid::{Equilibrium, Method, Scheme, Smoothing, Supports};
use anisobond::tensor::{Material, Stiffness};
use nalgebra::Vector3;

/// Nodes per edge up to which Jacobi runs.
const MOST_JACOBI: usize = 128;

/// Plane cracks of free bodies: centre, normal and radius, of an edge of one.
type Discs = &'static [([f64; 3], [f64; 3], f64)];

/// The free bodies by their words.
const FREE: [(&str, Discs); 4] = [
    ("disc", &[([0.5; 3], [1.0, 2.0, 3.0], 0.35)]),
    ("nodes", &[([0.5; 3], [0.0, 1.0, 1.0], 0.4)]),
    ("almost", &[([0.5; 3], [0.2, 0.1, 1.0], 0.62)]),
    (
        "several",
        &[
            ([0.3, 0.3, 0.3], [1.0, 0.0, 1.0], 0.3),
            ([0.7, 0.6, 0.6], [1.0, -1.0, 1.0], 0.35),
            ([0.5, 0.5, 0.75], [0.1, 0.0, 1.0], 0.3),
            ([0.2, 0.8, 0.5], [0.0, 1.0, 1.0], 0.25),
        ],
    ),
];

/// Whether the way from p to q passes a disc.
fn passes(p: &Vector3<f64>, q: &Vector3<f64>, (centre, normal, radius): &([f64; 3], [f64; 3], f64)) -> bool {
    let (centre, normal) = (Vector3::from(*centre), Vector3::from(*normal).normalize());
    let (a, b) = (normal.dot(&(p - centre)), normal.dot(&(q - centre)));
    (a < 0.0) != (b < 0.0) && (p + (q - p) * (a / (a - b)) - centre).norm() < *radius
}

/// A block of n³ nodes with a hole through it (radius a fifth of the edge) or a crack, held at the bottom, pulled at the
/// top; or free with discs, pulled at both ends.
fn block(n: usize, c: &Stiffness, crack: bool, hybrid: bool, discs: Discs) -> (GridBonds<f64>, Supports, VectorField) {
    let spacing = 1.0 / n as f64;
    let grid = Grid::new([n; 3], spacing, Vector3::repeat(0.5 * spacing), [false; 3]).expect("a valid grid");
    let mut body = Body::full(grid);
    for node in 0..body.grid.len() {
        let p = body.grid.position(node) - Vector3::repeat(0.5);
        if !crack && discs.is_empty() && p.x.hypot(p.z) < 0.2 {
            body.region[node] = 0;
        }
    }
    let neighbourhood = Neighbourhood::sphere(3.0, spacing, Influence::Inverse).expect("a valid neighbourhood");
    let top = |node: usize| body.grid.coordinates(node)[2] + 1 == n;
    let held = if discs.is_empty() { n * n } else { 0 };
    let bottom = (0..held).map(|node| (node as u32, [Some(0.0); 3]));
    let supports = Supports::new(&body, bottom).expect("nodes of the body");
    let mut load = VectorField::zeros(body.grid.len());
    for node in (0..load.len()).filter(|node| top(*node)) {
        load.components[2][node] = 1e6 * spacing * spacing;
    }
    if !discs.is_empty() {
        load.components[2][..n * n].fill(-1e6 * spacing * spacing);
    }
    let settings = if hybrid { ModelSettings::Hybrid(None) } else { ModelSettings::central() };
    let calibrator = ModelCalibrator::new(&neighbourhood, settings).expect("a calibrator");
    let material = calibrator.calibrate(c).expect("a calibrated material");
    let mut stencil = Stencil::new(&neighbourhood, material.normal());
    stencil.nodal = material.nodal().copied().filter(|z| z.norm() > 0.0);
    let of_node = body.region.clone();
    let mut bonds = GridBonds::new(body, &neighbourhood, of_node, vec![stencil]).expect("valid bonds");
    if crack {
        let plane = 0.5 + 1e-6 * spacing;
        bonds.cut(|p, q| (p.z < plane) != (q.z < plane) && p.x < 0.6);
    }
    for disc in discs {
        bonds.cut(|p, q| passes(p, q, disc));
    }
    (bonds, supports, load)
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let sizes: Vec<usize> = arguments.iter().filter_map(|a| a.parse().ok()).collect();
    let sizes = if sizes.is_empty() { vec![48, 64, 96, 128] } else { sizes };
    let [crack, hybrid] = ["crack", "hybrid"].map(|word| arguments.iter().any(|a| a == word));
    let discs = FREE.iter().find(|f| arguments.iter().any(|a| a == f.0)).map_or(&[][..], |f| f.1);
    let word = |a: &&String| {
        !["crack", "hybrid"].contains(&a.as_str()) && FREE.iter().all(|f| f.0 != *a) && a.parse::<usize>().is_err()
    };
    let names: Vec<&str> = arguments.iter().filter(word).map(String::as_str).collect();
    let materials: Vec<(String, Stiffness)> = if names.is_empty() {
        vec![("isotropic".into(), Stiffness::isotropic(40e9, 40e9))]
    } else {
        names.iter().filter_map(|n| Some((n.to_string(), Material::builtin(n)?.stiffness))).collect()
    };
    let stopping = Stopping { tolerance: 1e-8, most_iterations: 5000 };
    let methods = methods();
    println!(
        "material   nodes  method                          prepare s  iterations  applications    solve s  residual"
    );
    for (name, c) in &materials {
        for n in &sizes {
            let (body, supports, load) = block(*n, c, crack, hybrid, discs);
            let once = Instant::now();
            let mut f = VectorField::zeros(load.len());
            body.forces(&load, &mut f);
            println!("{name:10} {n:3}³  one application {:.3} s", once.elapsed().as_secs_f64());
            for (label, method) in methods.iter().filter(|m| m.1 != Method::NodeBlocks || *n <= MOST_JACOBI) {
                let start = Instant::now();
                let equilibrium = Equilibrium::new(&body, &supports, *method);
                let prepared = start.elapsed().as_secs_f64();
                let start = Instant::now();
                let zeros = VectorField::zeros(load.len());
                let (_, report) = equilibrium.solve(&load, zeros, &stopping).expect("a supported body");
                println!(
                    "{name:10} {n:3}³  {label:30} {prepared:10.2} {:11} {:13} {:10.2}  {:.1e} {:?}",
                    report.iterations,
                    report.applications,
                    start.elapsed().as_secs_f64(),
                    report.residual,
                    report.ending
                );
            }
        }
    }
}

/// What is compared.
fn methods() -> [(&'static str, Method); 3] {
    [
        ("coarse grids, additive", Method::default()),
        (
            "coarse grids, multiplicative",
            Method::CoarseGrids(Scheme::Multiplicative { weight: 0.9 }, Smoothing::default()),
        ),
        ("node blocks (Jacobi)", Method::NodeBlocks),
    ]
}
