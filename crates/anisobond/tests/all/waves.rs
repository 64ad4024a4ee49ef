//! Waves of central and micropolar grids: against the dense matrix of a periodic cell, and against Christoffel's speeds.

use crate::common;

use std::f64::consts::PI;

use anisobond::calibration::{
    Calibrator, Dispersion, LowerBound, MicropolarCalibration, MicropolarCalibrator, ModelCalibrator, ModelSettings,
    Promise,
};
use anisobond::lattice::{Influence, Neighbourhood, Shape};
use anisobond::operator::{GridCell, naive};
use anisobond::tensor::{Material, Stiffness};
use common::{Random, crystals};
use nalgebra::{DMatrix, Matrix3, Vector3};

fn turned_grid() -> Neighbourhood {
    Neighbourhood::sphere(2.0, 0.02, Influence::Constant).unwrap().rotated(&Random(3).rotation()).unwrap()
}

/// Low Poisson's ratio and some anisotropy: tangential bonds in many directions.
fn with_tangential_bonds(grid: &Neighbourhood) -> (Stiffness, MicropolarCalibration) {
    let mut random = Random(4);
    let some = random.stiffness();
    let c = Stiffness::from_mandel(Stiffness::isotropic(0.0, 2e10).mandel() + 0.2 * some.mandel());
    let r = MicropolarCalibrator::new(grid).calibrate(&c, Promise::Sum).unwrap();
    assert!(r.tangential.iter().filter(|&&t| t > 0.0).count() > r.tangential.len() / 2);
    (c, r)
}

/// K_qq of a periodic cell with the rotations of all nodes eliminated, per node: its quadratic form on plane waves of
/// displacements.
fn condensed(cell: &GridCell, grid: &Neighbourhood, r: &MicropolarCalibration) -> DMatrix<f64> {
    let network = cell.network(grid, &r.normal, Some(&r.tangential)).unwrap();
    let k = naive::dense_matrix(&network);
    let nodes = cell.len();
    let pick = |a: usize, b: usize| {
        DMatrix::from_fn(3 * nodes, 3 * nodes, |i, j| k[(6 * (i / 3) + 3 * a + i % 3, 6 * (j / 3) + 3 * b + j % 3)])
    };
    let (uu, ut, tt) = (pick(0, 0), pick(0, 1), pick(1, 1));
    let relaxed = tt.clone().pseudo_inverse(1e-10 * tt.norm()).unwrap();
    &uu - &ut * relaxed * ut.transpose()
}

/// Every wave of a small cell has the energy that D(k) says, the rotations' part eliminated node by node.
#[test]
fn micropolar_waves_are_those_of_a_periodic_cell() {
    for grid in [Neighbourhood::sphere(2.0, 0.5, Influence::Inverse).unwrap(), turned_grid()] {
        let (_, r) = with_tangential_bonds(&grid);
        let dispersion = Dispersion::micropolar(&grid, &r.normal, &r.tangential).unwrap();
        let cell = GridCell::perfect([4, 3, 3]);
        let k = condensed(&cell, &grid, &r);
        let volume = grid.spacing().powi(3);
        let place = |node: usize| Vector3::new((node % 4) as f64, (node / 4 % 3) as f64, (node / 12) as f64);
        for wave in [[1, 0, 0], [2, 0, 0], [2, 1, 0], [1, 2, 1], [3, 1, 2]] {
            let phases = Vector3::from_fn(|a, _| 2.0 * PI * f64::from(wave[a]) / cell.nodes[a] as f64);
            let d = dispersion.matrix(&(grid.orientation() * phases / grid.spacing()));
            assert_eq!(d, d.transpose());
            for quarter in [0.0, 0.9] {
                let amplitude = Vector3::new(0.3, -0.5, 0.9);
                let phase = |node: usize| (phases.dot(&place(node)) + quarter).cos();
                let u = nalgebra::DVector::from_fn(3 * cell.len(), |i, _| amplitude[i % 3] * phase(i / 3));
                let force = &k * &u;
                for node in 0..cell.len() {
                    let expected = volume * (d * amplitude) * phase(node);
                    let found = Vector3::from_fn(|a, _| force[3 * node + a]);
                    assert!((found - expected).norm() < 1e-11 * volume * d.norm(), "{wave:?} {found} {expected}");
                }
            }
        }
    }
}

/// Eigenvalues of the cell: those of D(k) at its wave vectors, all of them.
#[test]
fn the_spectrum_of_a_cell_is_that_of_its_waves() {
    let grid = turned_grid();
    let (_, r) = with_tangential_bonds(&grid);
    let dispersion = Dispersion::micropolar(&grid, &r.normal, &r.tangential).unwrap();
    let cell = GridCell::perfect([3, 2, 4]);
    let volume = grid.spacing().powi(3);
    let mut expected: Vec<f64> = Vec::new();
    for node in 0..cell.len() {
        let wave = [node % 3, node / 3 % 2, node / 6];
        let phases = Vector3::from_fn(|a, _| 2.0 * PI * wave[a] as f64 / cell.nodes[a] as f64);
        let d = dispersion.matrix(&(grid.orientation() * phases / grid.spacing()));
        expected.extend(d.symmetric_eigenvalues().iter().map(|value| value * volume));
    }
    let mut found: Vec<f64> = condensed(&cell, &grid, &r).symmetric_eigenvalues().iter().copied().collect();
    expected.sort_by(f64::total_cmp);
    found.sort_by(f64::total_cmp);
    let scale = found.last().unwrap();
    for (a, b) in found.iter().zip(&expected) {
        assert!((a - b).abs() < 1e-11 * scale, "{a:e} {b:e}");
    }
}

/// Fitted slope of the logarithm of an error over that of the wave number.
fn slope(points: &[(f64, f64)]) -> f64 {
    let mean = |f: fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}

/// Long waves go with the Christoffel speeds of the tensor that the grid has, to second order: central bonds their
/// sum's, micropolar ones the relaxed tensor's and not the sum's.
#[test]
fn long_waves_are_those_of_the_grids_own_tensor() {
    let density = 2700.0;
    let grid = turned_grid();
    let (_, r) = with_tangential_bonds(&grid);
    assert!(r.relaxed.relative_error(&r.reached) > 1e-3);
    let kio3 = Material::builtin("KIO3").unwrap().stiffness;
    let central = Calibrator::new(&grid).calibrate(&kio3, LowerBound::Value(0.0)).unwrap();
    for (dispersion, own) in [
        (Dispersion::micropolar(&grid, &r.normal, &r.tangential).unwrap(), r.relaxed),
        (Dispersion::central(&grid, &central.micromodulus).unwrap(), central.reached),
    ] {
        for n in [Vector3::new(0.3, -0.5, 0.7).normalize(), Vector3::x()] {
            let exact = own.waves(&n, density).unwrap();
            let error = |size: f64| {
                let speeds = dispersion.speeds(&(n * (size / grid.spacing())), density).unwrap();
                (0..3).map(|i| (speeds[i] / exact[i].speed - 1.0).abs()).fold(0.0, f64::max)
            };
            let points: Vec<(f64, f64)> =
                [0.4, 0.2, 0.1, 0.05].iter().map(|size| (f64::ln(*size), error(*size).ln())).collect();
            assert!((slope(&points) - 2.0).abs() < 0.05, "{points:?}");
        }
    }
    let dispersion = Dispersion::micropolar(&grid, &r.normal, &r.tangential).unwrap();
    let (own, sum) = (dispersion.long_waves(&r.relaxed), dispersion.long_waves(&r.reached));
    assert!((own.order - 2.0).abs() < 0.1 && sum.order < 0.5 && sum.error > 10.0 * own.error, "{own:?} {sum:?}");
}

/// Without tangential bonds the micropolar grid is the central one; with them and rotations blocked it would be stiffer.
#[test]
fn free_rotations_only_soften() {
    let grid = turned_grid();
    let (_, r) = with_tangential_bonds(&grid);
    let none = vec![0.0; r.normal.len()];
    let central = Dispersion::central(&grid, &r.normal).unwrap();
    let bare = Dispersion::micropolar(&grid, &r.normal, &none).unwrap();
    let micropolar = Dispersion::micropolar(&grid, &r.normal, &r.tangential).unwrap();
    let mut random = Random(6);
    for _ in 0..50 {
        let k = PI / grid.spacing() * Vector3::from_fn(|_, _| random.number());
        let d = central.matrix(&k);
        assert!((bare.matrix(&k) - d).norm() < 1e-14 * d.norm());
        // Tangential bonds add a positive part to the central one, whatever the rotations.
        let more: Matrix3<f64> = micropolar.matrix(&k) - d;
        assert!(more.symmetric_eigenvalues().min() > -1e-13 * d.norm());
    }
}

/// The search misses nothing that random waves find, and says of a mechanism that it is one.
#[test]
fn the_weakest_wave_is_found() {
    let grid = Neighbourhood::sphere(3.0, 0.01, Influence::Inverse).unwrap();
    let micropolar = MicropolarCalibrator::new(&grid);
    let central = Calibrator::new(&grid);
    let mut random = Random(9);
    let mut materials: Vec<(String, Stiffness)> = crystals().into_iter().step_by(60).collect();
    materials.extend((0..5).map(|i| (format!("random {i}"), random.stiffness())));
    for (name, c) in &materials {
        let m = micropolar.calibrate(c, Promise::Sum).unwrap();
        let r = central.calibrate(c, LowerBound::Value(0.0)).unwrap();
        for dispersion in [
            Dispersion::micropolar(&grid, &m.normal, &m.tangential).unwrap(),
            Dispersion::central(&grid, &r.micromodulus).unwrap(),
        ] {
            let found = dispersion.stability();
            for _ in 0..100 {
                let phases = PI * Vector3::from_fn(|_, _| random.number());
                let laplacian = phases.map(|p| 2.0 - 2.0 * p.cos()).sum() / grid.spacing().powi(2);
                let d = dispersion.matrix(&(grid.orientation() * phases / grid.spacing()));
                let weakest = d.symmetric_eigenvalues().min() / laplacian;
                assert!(
                    weakest > 0.8 * found.smallest_eigenvalue - 1e-12 * c.norm(),
                    "{name}: {weakest:e} at {phases}, found {found:?}"
                );
            }
        }
    }
    // Nearest neighbours, normal bonds: shear costs nothing. With tangential bonds too it does, but free rotations take
    // it away again in part; nothing of what is left is negative.
    let nearest = Neighbourhood::sphere(1.0, 1.0, Influence::Constant).unwrap();
    let c = vec![1e9; 6];
    let bare = Dispersion::central(&nearest, &c).unwrap().stability();
    assert!(!bare.stable && bare.smallest_eigenvalue.abs() < 1.0, "{bare:?}");
    let resisted = Dispersion::micropolar(&nearest, &c, &c).unwrap().stability();
    assert!(resisted.stable, "{resisted:?}");
    // Bonds in a plane resist nothing across it.
    let flat = Shape::Cuboid { semi_axes: [2.0, 2.0, 0.5] };
    let flat = Neighbourhood::new(flat, 2.0, 1.0, Influence::Constant).unwrap();
    let flat = Dispersion::central(&flat, &vec![1e9; flat.bonds().len()]).unwrap().stability();
    assert!(!flat.stable);
}

/// The evidence that comes with each model, for every promise and form.
#[test]
fn evidence_comes_with_every_model() {
    let grid = Neighbourhood::sphere(3.0, 0.01, Influence::Inverse).unwrap();
    let c = Material::builtin("KIO3").unwrap().stiffness;
    for settings in [
        ModelSettings::central(),
        ModelSettings::Micropolar(Promise::Sum),
        ModelSettings::Micropolar(Promise::FreeRotations),
        ModelSettings::Hybrid(None),
    ] {
        let calibrator = ModelCalibrator::new(&grid, settings).unwrap();
        assert_eq!(calibrator.settings(), settings);
        let r = calibrator.calibrate(&c).unwrap();
        let stability = r.stability();
        assert!(stability.stable && stability.smallest_eigenvalue > 0.0 && stability.samples > 400);
        assert_eq!(r.normal().len(), 122);
        assert!(r.promised_error() < 0.08, "{settings:?}: {}", r.promised_error());
        assert!(calibrator.calibrate(&Stiffness::isotropic(-10.0, 1.0)).is_err());
    }
    let flat = Shape::Cuboid { semi_axes: [2.0, 2.0, 0.5] };
    let flat = Neighbourhood::new(flat, 2.0, 1.0, Influence::Constant).unwrap();
    let central = ModelCalibrator::new(&flat, ModelSettings::central()).unwrap();
    assert!(!central.calibrate(&c).unwrap().stability().stable);
    assert!(ModelCalibrator::new(&flat, ModelSettings::Hybrid(None)).is_err());
}
