//! Models on grid cells and packings: the promised tensor, rigid motions, plane waves by the network's own forces, and
//! defects.

use crate::common;

use std::f64::consts::PI;

use anisobond::calibration::{
    Calibrator, HybridCalibrator, LowerBound, MicropolarCalibrator, Model, ModelCalibrator, Promise,
};
use anisobond::experiment::element_test::{ElementTest, Rotations};
use anisobond::experiment::{Correction, GridStudy, LatticePlan, LatticeStudy};
use anisobond::lattice::{Influence, Neighbourhood, Shape};
use anisobond::operator::{BondList, GridCell, Network};
use anisobond::tensor::{Material, Metric, Stiffness};
use common::{Random, crystals, jittered};
use nalgebra::{Matrix3, SMatrix, Vector3, Vector6};

const MODELS: [Model; 3] = [Model::Central, Model::Micropolar, Model::Hybrid];
const MATERIALS: [&str; 8] = ["KIO3", "CoTeO4", "Te2W", "Ta2C", "Si", "MoN", "Spinel", "Pyroceram"];

fn exact() -> ElementTest {
    let mut test = ElementTest { threads: false, ..ElementTest::default() };
    test.stopping.tolerance = 1e-11;
    test
}

fn neighbourhoods() -> Vec<Neighbourhood> {
    let turn = Random(12).rotation();
    let ellipsoid = Shape::Ellipsoid { semi_axes: [2.0, 2.5, 3.0] };
    vec![
        Neighbourhood::sphere(3.0, 0.5, Influence::Inverse).unwrap(),
        Neighbourhood::sphere(2.0, 1e-3, Influence::Constant).unwrap().rotated(&turn).unwrap(),
        Neighbourhood::new(Shape::Cube { semi_edge: 2.0 }, 4.0, 1.0, Influence::Hat).unwrap(),
        Neighbourhood::new(ellipsoid, 3.5, 2.0, Influence::Power).unwrap(),
    ]
}

/// A model whose nodes rotate, on a cell.
fn study_of(
    neighbourhood: &Neighbourhood,
    cell: GridCell,
    target: &Stiffness,
    model: Model,
    correction: Option<&Correction>,
) -> GridStudy {
    let settings = GridStudy::settings(model, Rotations::Free);
    let calibrator = ModelCalibrator::new(neighbourhood, settings).unwrap();
    GridStudy::new(&calibrator, cell, target, correction).unwrap()
}

/// Crystals, shapes, horizons, influence functions and models: the element test measures what was promised, to 10⁻⁸.
#[test]
fn perfect_cells_measure_what_was_promised() {
    let mut targets: Vec<(String, Stiffness)> =
        MATERIALS.map(|name| (name.to_string(), Material::builtin(name).unwrap().stiffness)).into();
    targets.extend(crystals().into_iter().step_by(150));
    let mut worst: f64 = 0.0;
    for (i, neighbourhood) in neighbourhoods().iter().enumerate() {
        for (j, (name, target)) in targets.iter().enumerate() {
            let nodes = [[1, 1, 1], [2, 3, 2], [3, 1, 4]][(i + j) % 3];
            for model in MODELS {
                let cell = GridCell::perfect(nodes);
                let study = study_of(neighbourhood, cell, target, model, None);
                // A bond's floor of zero may leave mechanisms; the least energy is well defined all the same.
                let test =
                    ElementTest { mechanisms: anisobond::experiment::element_test::Mechanisms::Report, ..exact() };
                let r = study.test(&test).unwrap();
                let error = study.promised.relative_error(&r.measured);
                assert!(error < 1e-8, "{name} {model:?} {i}: {error:e} {:?}", r.solver);
                worst = worst.max(error);
                if model == Model::Hybrid {
                    assert!(target.relative_error(&r.measured) < 1e-8);
                }
            }
        }
    }
    println!("largest error {worst:e}");
}

/// Forces of a perfect grid balance but for rounding, that of its moduli too: tests of it end, whatever the crystal, however
/// little it is held.
#[test]
fn tests_of_perfect_grids_converge() {
    for horizon in [2.0, 3.0] {
        let neighbourhood = Neighbourhood::sphere(horizon, 1e-3, Influence::Inverse).unwrap();
        for name in MATERIALS {
            let target = Material::builtin(name).unwrap().stiffness;
            for model in MODELS {
                let study = study_of(&neighbourhood, GridCell::perfect([5, 6, 4]), &target, model, None);
                let mechanisms = anisobond::experiment::element_test::Mechanisms::Report;
                let r = study.test(&ElementTest { mechanisms, ..GridStudy::usual_test(Rotations::Free) }).unwrap();
                assert!(
                    r.solver.converged() && r.solver.iterations < 500,
                    "{name} {model:?} {horizon}: {:?}",
                    r.solver
                );
                assert!(study.promised.relative_error(&r.measured) < 1e-8, "{name} {model:?} {horizon}");
            }
        }
    }
}

/// Packings and cells of all models, with their nodes' positions.
fn bodies() -> Vec<(String, Network)> {
    let mut bodies = Vec::new();
    let target = Material::builtin("KIO3").unwrap().stiffness;
    let soft = Stiffness::isotropic(2e9, 3e9);
    for model in MODELS {
        let plan = LatticePlan { model, correction: None, metric: Metric::Norm };
        let packing = jittered(4, 9, 0.2);
        let study = LatticeStudy::planned(packing, &soft, &Vector3::z(), 1.6, &plan).unwrap();
        bodies.push((format!("packing {model:?}"), study.network()));
        for (i, neighbourhood) in neighbourhoods().iter().take(3).enumerate() {
            let cell = GridCell { nodes: [6, 6, 6], missing: vec![7, 60], displacement: 0.2, seed: 3 };
            let study = study_of(neighbourhood, cell, &target, model, None);
            bodies.push((format!("grid {i} {model:?}"), study.network));
        }
    }
    bodies
}

/// Translations cost nothing, nor do rotations of a body cut from the cell; other motions do.
#[test]
fn rigid_motions_cost_nothing() {
    for (name, mut network) in bodies() {
        let nodes = network.nodes.clone();
        let whole = BondList::new(&network).unwrap();
        let (shift, omega) = (Vector3::new(0.3, -2.0, 1.0), Vector3::new(0.7, 0.1, -0.4));
        // Bonds that cross the border are longer or shorter than their branch between the nodes as they lie.
        let reach = network.bonds.iter().map(|b| b.branch.norm()).fold(0.0, f64::max);
        let inner: Vec<bool> = network
            .bonds
            .iter()
            .map(|b| (nodes[b.b as usize] - nodes[b.a as usize] - b.branch).norm() < 1e-9 * reach)
            .collect();
        let mut kept = inner.iter();
        network.bonds.retain(|_| *kept.next().unwrap());
        if let Some(term) = &mut network.nodal {
            let mut kept = inner.iter();
            term.weights.retain(|_| *kept.next().unwrap());
        }
        assert!(network.bonds.len() > 50, "{name}");
        let body = BondList::new(&network).unwrap();
        let motion = |list: &BondList, turned: bool| {
            let mut x = list.zeros::<1>();
            for (node, position) in nodes.iter().enumerate() {
                let u = if turned { shift * reach + omega.cross(position) } else { shift * reach };
                for i in 0..3 {
                    x[list.place(node)][i][0] = u[i];
                    x[list.place(node)][3 + i][0] = if turned { omega[i] } else { 0.0 };
                }
            }
            x
        };
        let none = [Vector6::zeros()];
        let stretch = Vector6::new(1.0, 0.3, -0.2, 0.4, 0.1, 0.0);
        let unit = body.measure(&[stretch], &body.zeros()).energy[0][0];
        let carried = body.carried().iter().map(|c| c[0]).fold(0.0, f64::max);
        for (list, turned) in [(&whole, false), (&body, false), (&body, true)] {
            let x = motion(list, turned);
            let energy = list.measure(&none, &x).energy[0][0];
            assert!(energy.abs() < 1e-20 * unit, "{name} {turned}: {energy:e} of {unit:e}");
            let mut force = list.zeros::<1>();
            list.apply(&x, &mut force);
            let largest = force.iter().flat_map(|f| [f[0][0], f[1][0], f[2][0]]).fold(0.0f64, |a, f| a.max(f.abs()));
            assert!(largest < 1e-11 * carried, "{name}: {largest:e} of {carried:e}");
        }
        assert!(unit > 0.0);
    }
}

/// The 3×3 dynamical matrix (N/m per node) of the wave of N nodes per length along the cell's first axis, by the
/// network's forces on cosine and sine fields; node rotations are left to relax.
fn dynamical_matrix(network: &Network, count: usize) -> Matrix3<f64> {
    let list = BondList::new(network).unwrap();
    let phase = |node: usize| 2.0 * PI * node as f64 / count as f64;
    // Twelve fields: displacement and rotation along three axes, cosine and sine.
    let shape = |field: usize, node: usize| if field.is_multiple_of(2) { phase(node).cos() } else { phase(node).sin() };
    let mut x = list.zeros::<12>();
    let mut y = list.zeros::<12>();
    for node in 0..count {
        for field in 0..12 {
            x[list.place(node)][field / 2][field] = shape(field, node);
        }
    }
    list.apply(&x, &mut y);
    let all = SMatrix::<f64, 12, 12>::from_fn(|row, column| {
        let along = |node: usize| shape(row, node) * y[list.place(node)][row / 2][column];
        2.0 / count as f64 * (0..count).map(along).sum::<f64>()
    });
    // Rotations without inertia follow: D = D_uu − D_uθ D_θθ⁺ D_θu, displacements' cosine part.
    let (uu, ut, tt) =
        (all.fixed_view::<6, 6>(0, 0), all.fixed_view::<6, 6>(0, 6), all.fixed_view::<6, 6>(6, 6).into_owned());
    let inverse = tt.pseudo_inverse(1e-12 * tt.norm().max(f64::MIN_POSITIVE)).unwrap();
    let relaxed = uu - ut * inverse * ut.transpose();
    // A wave is as fast from wherever it starts: the cosine's block is the sine's, and they do not couple.
    let part = |sine: usize, other: usize| Matrix3::from_fn(|i, j| relaxed[(2 * i + sine, 2 * j + other)]);
    assert!((part(0, 0) - part(1, 1)).norm() < 1e-12 * part(0, 0).norm());
    assert!(part(0, 1).norm() < 1e-11 * part(0, 0).norm());
    part(0, 0)
}

/// Bonds of a model for a material, and the tensor they have.
fn calibrated(grid: &Neighbourhood, c: &Stiffness, model: Model, nodes: [usize; 3]) -> (Network, Stiffness) {
    let cell = GridCell::perfect(nodes);
    match model {
        Model::Central => {
            let r = Calibrator::new(grid).calibrate(c, LowerBound::Value(0.0)).unwrap();
            (cell.network(grid, &r.micromodulus, None).unwrap(), r.reached)
        }
        Model::Micropolar => {
            let r = MicropolarCalibrator::new(grid).calibrate(c, Promise::FreeRotations).unwrap();
            (cell.network(grid, &r.normal, Some(&r.tangential)).unwrap(), r.relaxed)
        }
        Model::Hybrid => {
            let r = HybridCalibrator::new(grid).unwrap().calibrate(c).unwrap();
            (cell.hybrid_network(grid, &r.bonds.micromodulus, &r.nodal).unwrap(), r.reached)
        }
    }
}

/// Waves in a periodic block against Christoffel's speeds of the reached tensor: the error falls with the square of the
/// wave number, for all models and materials.
#[test]
fn waves_travel_at_christoffel_speeds() {
    let grid = Neighbourhood::sphere(3.0, 0.5, Influence::Inverse).unwrap();
    let grid = grid.rotated(&Random(31).rotation()).unwrap();
    let along: Vector3<f64> = grid.orientation().column(0).into();
    let volume = grid.spacing().powi(3);
    for name in MATERIALS {
        let c = Material::builtin(name).unwrap().stiffness;
        for model in MODELS {
            let mut points = Vec::new();
            for count in [32, 48, 64, 96] {
                let (network, reached) = calibrated(&grid, &c, model, [count, 1, 1]);
                let k = 2.0 * PI / (count as f64 * grid.spacing());
                let d = dynamical_matrix(&network, count) / (volume * k * k);
                let sorted = |m: Matrix3<f64>| {
                    let mut e: [f64; 3] = m.symmetric_eigenvalues().into();
                    e.sort_by(f64::total_cmp);
                    e
                };
                let (ours, exact) = (sorted(0.5 * (d + d.transpose())), sorted(reached.christoffel(&along)));
                // Speeds are the roots, whatever the density.
                let error = ours.iter().zip(exact).map(|(a, b)| ((a / b).sqrt() - 1.0).abs()).fold(0.0, f64::max);
                points.push((k.ln(), error.ln()));
            }
            let mean = |f: fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / points.len() as f64;
            let (x, y) = (mean(|p| p.0), mean(|p| p.1));
            let slope = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>()
                / points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>();
            println!("{name:10} {model:?} slope {slope:.4}, error at the longest {:.2e}", points[3].1.exp());
            assert!((slope - 2.0).abs() < 0.02, "{name} {model:?}: {slope} {points:?}");
        }
    }
}

/// Missing and displaced nodes and voids: softer than the perfect cell, never above the sum, the same for a seed.
#[test]
fn defects_soften() {
    let grid = Neighbourhood::sphere(2.0, 1.0, Influence::Inverse).unwrap();
    let target = Material::builtin("KIO3").unwrap().stiffness;
    for model in MODELS {
        let test = |cell: GridCell| {
            let study = study_of(&grid, cell, &target, model, None);
            (study.test(&exact()).unwrap(), study)
        };
        let seeded = GridCell { seed: 5, displacement: 0.0, ..GridCell::perfect([6, 6, 6]) };
        let (perfect, _) = test(seeded.clone());
        let missing = seeded.clone().with_missing(0.1).unwrap();
        assert_eq!(missing.missing.len(), 22);
        assert_eq!(missing, seeded.clone().with_missing(0.1).unwrap());
        let void = seeded.clone().with_void([2.5; 3], 1.0).unwrap();
        assert_eq!(void.missing.len(), 8);
        for cell in [missing, void, GridCell { displacement: 0.3, ..seeded.clone() }] {
            let displaced = cell.displacement > 0.0;
            let (r, _) = test(cell);
            assert!(r.solver.converged() && r.certificate.below_sum > -1e-10, "{:?}", r.certificate);
            assert!(r.certificate.energy_consistency < 1e-8);
            let softer = (perfect.measured.mandel() - r.measured.mandel()).symmetric_eigenvalues();
            if displaced {
                assert!(r.measured.relative_error(&perfect.measured) > 1e-3);
            } else {
                assert!(softer.min() > 0.0, "{model:?} {softer}");
            }
        }
    }
    for share in [-0.1, 1.0, f64::NAN] {
        assert!(GridCell::perfect([2, 2, 2]).with_missing(share).is_err());
    }
    assert!(GridCell::perfect([2, 2, 2]).with_void([0.0; 3], 0.0).is_err());
    assert!(GridCell::perfect([2, 2, 2]).with_void([0.0, f64::NAN, 0.0], 1.0).is_err());
}

/// A cell with missing and displaced nodes, corrected until it has the target all the same.
#[test]
fn corrected_cells_meet_the_target() {
    let grid = Neighbourhood::sphere(2.0, 0.1, Influence::Inverse).unwrap();
    let target = Stiffness::isotropic(2e9, 3e9);
    let correction = Correction { test: exact(), ..Correction::default() };
    for model in [Model::Micropolar, Model::Hybrid] {
        let cell = GridCell { displacement: 0.2, seed: 4, ..GridCell::perfect([5, 5, 5]) }.with_missing(0.05).unwrap();
        let study = study_of(&grid, cell, &target, model, Some(&correction));
        let report = study.correction.as_ref().unwrap();
        println!("{model:?} {:?}", report.history);
        assert!(report.converged && report.corrections <= 4 && report.history[0] > 0.03, "{:?}", report.history);
        assert!(target.relative_error(&study.test(&exact()).unwrap().measured) < 1e-4);
        assert!(study.network.bonds.iter().all(|b| b.normal > 0.0));
    }
}
