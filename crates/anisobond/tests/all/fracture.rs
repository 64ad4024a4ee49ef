//! Critical stretches: the energy of the bonds that cross a plane, against bonds counted and closed forms.

use crate::common;

use anisobond::calibration::{Calibrator, CrackPlanes, CriticalStretches, EnergyByNormal, LowerBound, fracture_energy};
use anisobond::lattice::{Grid, Influence, Neighbourhood};
use anisobond::tensor::{Material, Stiffness};
use common::Random;
use nalgebra::Vector3;

/// A neighbourhood and calibrated bonds.
fn calibrated(m: f64, influence: Influence, c: &Stiffness) -> (Neighbourhood, Vec<f64>) {
    let grid = Neighbourhood::sphere(m, 0.002, influence).unwrap();
    let c = Calibrator::new(&grid).calibrate(c, LowerBound::Value(0.0)).unwrap().micromodulus;
    (grid, c)
}

fn spinel() -> Stiffness {
    Material::builtin("Spinel").or_else(|| Material::builtin("spinel")).unwrap().stiffness
}

fn rock() -> Stiffness {
    // Stiffer along x than along z.
    let mut v = Stiffness::isotropic(30e9, 30e9).voigt();
    v[(0, 0)] *= 1.6;
    v[(1, 1)] *= 1.3;
    Stiffness::from_voigt(&v).unwrap()
}

/// Bonds counted one by one on a torus of nodes, cut by all planes h·x = t + n q.
#[test]
fn counted_bonds_across_lattice_planes_have_the_formulas_energy() {
    let mut random = Random(2);
    let (grid, c) = calibrated(3.0, Influence::Inverse, &rock());
    let stretch: Vec<f64> = grid.bonds().iter().map(|_| 0.01 + 0.005 * random.number().abs()).collect();
    let side = 7i64;
    let block = Grid::new([side as usize; 3], grid.spacing(), Vector3::zeros(), [true; 3]).unwrap();
    let half = grid.bonds().len() / 2;
    for h in [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [1, 1, 1], [1, -1, 0], [2, 1, 0], [2, -1, 1], [3, 2, 1]] {
        let level = |x: [i64; 3]| h[0] * x[0] + h[1] * x[1] + h[2] * x[2];
        // A plane just behind the nodes of level 2 and its images.
        let t = 2.5;
        let mut energy = 0.0;
        for node in 0..block.len() {
            let x = block.coordinates(node).map(|i| i as i64);
            for (b, bond) in grid.bonds().iter().enumerate().skip(half) {
                let from = level(x) as f64;
                let to = level([0, 1, 2].map(|a| x[a] + i64::from(bond.offset[a]))) as f64;
                let planes = |v: f64| ((v - t) / side as f64).floor();
                let crossings = (planes(to) - planes(from)).abs();
                let k = bond.influence * c[b] * grid.spacing().powi(6) / bond.xi.norm();
                // Both directions of a bond may have their own stretch: the formula takes the mean energy.
                let twin = grid.bonds().len() - 1 - b;
                let square = 0.5 * (stretch[b].powi(2) + stretch[twin].powi(2));
                energy += crossings * 0.5 * k * bond.xi.norm_squared() * square;
            }
        }
        let n = Vector3::from(h.map(|x| x as f64));
        let area = (side as f64 * grid.spacing()).powi(2) * n.norm();
        let formula = fracture_energy(&grid, &c, &stretch, &n.normalize()).unwrap();
        assert!((energy / area / formula - 1.0).abs() < 1e-12, "{h:?}: {} {formula}", energy / area);
    }
}

/// A finite block pulled apart: the bonds from one half to the other, inside a window far from its sides.
#[test]
fn a_split_block_loses_the_formulas_energy() {
    let (grid, c) = calibrated(2.0, Influence::Constant, &spinel());
    let critical = CriticalStretches::uniform(&grid, &c, 10.0, CrackPlanes::All).unwrap();
    let nodes = [4, 13, 15];
    let block = Grid::new(nodes, grid.spacing(), Vector3::zeros(), [false; 3]).unwrap();
    let mut energy = 0.0;
    for node in 0..block.len() {
        let x = block.coordinates(node);
        for ((bond, c), s) in grid.bonds().iter().zip(&c).zip(&critical.stretch) {
            let Some(other) = block.neighbour(node, bond.offset) else { continue };
            let to = block.coordinates(other);
            // Bonds that start in the window 4 ≤ j < 9, 4 ≤ k < 11.
            if x[0] < 2 && to[0] >= 2 && (4..9).contains(&x[1]) && (4..11).contains(&x[2]) && *c > 0.0 {
                let k = bond.influence * c * grid.spacing().powi(6) / bond.xi.norm();
                energy += 0.5 * k * bond.xi.norm_squared() * s * s;
            }
        }
    }
    let area = 5.0 * 7.0 * grid.spacing().powi(2);
    let formula = fracture_energy(&grid, &c, &critical.stretch, &Vector3::x()).unwrap();
    assert!((energy / area / formula - 1.0).abs() < 1e-12);
}

/// Silling & Askari's s₀ = √(5 G/9 K δ) in the limit of fine grids, for constant micromoduli and ω = 1.
#[test]
fn uniform_stretch_tends_to_the_continuums() {
    let (energy, k) = (3.8, 48e9);
    let mut errors = Vec::new();
    for m in [3.0, 6.0, 9.0] {
        let grid = Neighbourhood::sphere(m, 0.001, Influence::Constant).unwrap();
        let delta = m * 0.001;
        let c = vec![18.0 * k / (std::f64::consts::PI * delta.powi(4)); grid.bonds().len()];
        let found = CriticalStretches::uniform(&grid, &c, energy, CrackPlanes::All).unwrap();
        let s = found.stretch[0];
        assert!(found.stretch.iter().all(|x| *x == s));
        assert!((found.report.reached_mean / energy - 1.0).abs() < 1e-12);
        errors.push((s / (5.0 * energy / (9.0 * k * delta)).sqrt() - 1.0).abs());
    }
    println!("{errors:?}");
    assert!(errors[2] < 0.02 && errors[2] < errors[0], "{errors:?}");
}

/// The mean over the planes of an energy: ⟨|n·ξ|⟩ = |ξ|/2, and around an axis 2/π of the part across it.
#[test]
fn means_over_planes_are_the_closed_ones() {
    let (grid, c) = calibrated(3.0, Influence::Inverse, &rock());
    let weight = |part: &dyn Fn(&Vector3<f64>) -> f64| -> f64 {
        let bonds = grid.bonds().iter().zip(&c);
        bonds.map(|(b, c)| 0.25 * part(&b.xi) * b.influence * c * grid.spacing().powi(3) * b.xi.norm()).sum()
    };
    let all = CriticalStretches::uniform(&grid, &c, 5.0, CrackPlanes::All).unwrap();
    let finite = |x: &CriticalStretches| x.stretch.iter().copied().find(|s| s.is_finite()).unwrap();
    let exact = (5.0 / weight(&|xi| 0.5 * xi.norm())).sqrt();
    assert!((finite(&all) / exact - 1.0).abs() < 3e-3, "{} {exact}", finite(&all));
    let plate = CriticalStretches::uniform(&grid, &c, 5.0, CrackPlanes::Around(2.0 * Vector3::z())).unwrap();
    let exact = (5.0 / weight(&|xi| 2.0 / std::f64::consts::PI * xi.xy().norm())).sqrt();
    assert!((finite(&plate) / exact - 1.0).abs() < 1e-3, "{} {exact}", finite(&plate));
    assert!(all.stretch.iter().zip(&c).all(|(s, c)| s.is_finite() == (*c > 0.0)));
}

/// Isotropic and directional energies for several materials and neighbourhoods: what is reached.
#[test]
fn directional_energy_is_reached() {
    let weak = |ratio: f64| vec![(Vector3::z(), 1.0), (Vector3::x(), ratio), (Vector3::y(), ratio)];
    let aslant = |ratio: f64| {
        let q = Random(4).rotation();
        weak(ratio).into_iter().map(|(n, g)| (q * n, g)).collect::<Vec<_>>()
    };
    let cases = [
        ("isotropic", vec![(Vector3::x(), 3.8)], 0.03),
        ("2:1", weak(2.0), 0.05),
        ("4:1", weak(4.0), 0.08),
        ("2:1 aslant", aslant(2.0), 0.05),
    ];
    for (material, c) in [("spinel", spinel()), ("rock", rock()), ("glass", Stiffness::isotropic(28.8e9, 28.8e9))] {
        for m in [3.0, 4.0] {
            let (grid, c) = calibrated(m, Influence::Inverse, &c);
            for (name, values, most) in &cases {
                let wanted = EnergyByNormal::through(values).unwrap();
                for (planes, place) in [(CrackPlanes::All, "all"), (CrackPlanes::Around(Vector3::y()), "around y")] {
                    let start = std::time::Instant::now();
                    let r = CriticalStretches::directional(&grid, &c, planes, |n| wanted.at(n)).unwrap();
                    let mean = wanted.at(&Vector3::x());
                    let u = CriticalStretches::uniform(&grid, &c, mean, planes).unwrap();
                    println!(
                        "{material} m={m} {name} {place}: rms {:.4} largest {:.4} at {:.2?}, s {:.2?} of uniform (uniform G/wanted {:.3?}) {:?}",
                        r.report.rms_deviation,
                        r.report.largest_deviation,
                        r.report.largest_at,
                        r.report.stretch_range.map(|s| s / u.report.stretch_range[0]),
                        u.report.ratio_range,
                        start.elapsed(),
                    );
                    assert!(r.report.rms_deviation < *most, "{material} {m} {name}");
                    assert!(r.report.stretch_range[0] > 0.0);
                    // The report is what the stretches give.
                    for (n, wanted_there, reached) in &r.report.lattice_planes {
                        let n = Vector3::from(*n);
                        let again = fracture_energy(&grid, &c, &r.stretch, &n).unwrap();
                        assert!((again / reached - 1.0).abs() < 1e-12);
                        assert!((wanted_there / wanted.at(&n) - 1.0).abs() < 1e-12);
                    }
                }
            }
        }
    }
}

/// The form passes through its values, is even, turns with them, and is an ellipsoid's support function beyond the least value at
/// first.
#[test]
fn energies_by_normal_pass_through_their_values() {
    let one = EnergyByNormal::through(&[(Vector3::new(0.0, 3.0, 4.0), 7.0)]).unwrap();
    let mut random = Random(8);
    for _ in 0..20 {
        let n = random.rotation().column(0).into_owned();
        assert!((one.at(&n) - 7.0).abs() < 1e-9);
    }
    let values = [(Vector3::x(), 9.0), (Vector3::y(), 4.0), (Vector3::z(), 1.0)];
    let cross = [Vector3::new(0.0, 1.0, 1.0), Vector3::new(1.0, 0.0, 1.0), Vector3::new(1.0, 1.0, 0.0)];
    let mixed = |n: &Vector3<f64>| 1.0 + (64.0 * n.x * n.x + 9.0 * n.y * n.y).sqrt();
    let form = EnergyByNormal::through(&values).unwrap();
    for n in cross.map(|n| n.normalize()) {
        assert!((form.at(&n) - mixed(&n)).abs() < 1e-9 && (form.at(&-n) - form.at(&n)).abs() < 1e-12);
    }
    assert_eq!(form.degree(), 2);
    // Seven normals need degree 4.
    let mut seven: Vec<_> = values.to_vec();
    seven.extend(cross.map(|n| (n, 5.0)));
    seven.push((Vector3::new(1.0, 1.0, 1.0), 5.5));
    let form = EnergyByNormal::through(&seven).unwrap();
    assert_eq!(form.degree(), 4);
    assert!(seven.iter().all(|(n, g)| (form.at(&n.normalize()) - g).abs() < 1e-7), "{:?}", form.at(&Vector3::x()));
    let q = random.rotation();
    let turned: Vec<_> = seven.iter().map(|(n, g)| (q * n, *g)).collect();
    let turned = EnergyByNormal::through(&turned).unwrap();
    for _ in 0..20 {
        let n = random.rotation().column(0).into_owned();
        assert!((turned.at(&(q * n)) - form.at(&n)).abs() < 1e-6);
    }
}

/// A plate whose weak planes are turned against the grid: strong contrasts are reached, the weakest plane is where it is wanted,
/// and no bond is much weaker than those of an isotropic material of the least energy.
#[test]
fn strong_contrasts_need_no_weak_bonds() {
    let (grid, c) = calibrated(4.0, Influence::Inverse, &Stiffness::isotropic(48e9, 28.8e9));
    let planes = CrackPlanes::Around(Vector3::z());
    let isotropic = CriticalStretches::uniform(&grid, &c, 4.0, planes).unwrap().report.stretch_range[0];
    for (angle, strong, most) in
        [(20.0, 6.0, 0.03), (30.0, 6.0, 0.03), (30.0, 10.0, 0.05), (45.0, 10.0, 0.04), (45.0, 40.0, 0.06)]
    {
        let at = |degrees: f64| {
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            Vector3::new(-sin, cos, 0.0)
        };
        let values = [(at(angle), 4.0), (at(angle + 90.0), strong), (Vector3::z(), strong)];
        let wanted = EnergyByNormal::through(&values).unwrap();
        let found = CriticalStretches::directional(&grid, &c, planes, |n| wanted.at(n)).unwrap();
        let reached = |degrees: f64| fracture_energy(&grid, &c, &found.stretch, &at(degrees)).unwrap();
        let least = (0..180).map(f64::from).min_by(|a, b| reached(*a).total_cmp(&reached(*b))).unwrap();
        println!(
            "4:{strong} at {angle}°: reached {:.2} and {:.2}, least at {least}°, rms {:.3}, largest {:.3}, stretches {:.2?} of \
             isotropic ones",
            reached(angle),
            reached(angle + 90.0),
            found.report.rms_deviation,
            found.report.largest_deviation,
            found.report.stretch_range.map(|s| s / isotropic),
        );
        assert!((least - angle).abs() <= 5.0);
        assert!(found.report.rms_deviation < most && (reached(angle) / 4.0 - 1.0).abs() < 0.1);
        assert!((reached(angle + 90.0) / strong - 1.0).abs() < 0.1);
        assert!(found.report.stretch_range[0] >= 0.7 * isotropic);
    }
}

#[test]
fn wrong_input_is_named() {
    let (grid, c) = calibrated(3.0, Influence::Inverse, &spinel());
    let told = |e: anisobond::Error, word: &str| assert!(e.to_string().contains(word), "{e}");
    let all = CrackPlanes::All;
    told(CriticalStretches::uniform(&grid, &c, 0.0, all).unwrap_err(), "fracture energy");
    told(CriticalStretches::uniform(&grid, &c[1..], 1.0, all).unwrap_err(), "121 micromoduli");
    told(CriticalStretches::uniform(&grid, &vec![0.0; c.len()], 1.0, all).unwrap_err(), "stiffness");
    told(CriticalStretches::uniform(&grid, &c, 1.0, CrackPlanes::Around(Vector3::zeros())).unwrap_err(), "axis");
    told(CriticalStretches::directional(&grid, &c, all, |n| n.z).unwrap_err(), "fracture energy");
    told(fracture_energy(&grid, &c, &[], &Vector3::x()).unwrap_err(), "0 critical stretches");
    told(EnergyByNormal::through(&[]).unwrap_err(), "at least one");
    told(EnergyByNormal::through(&[(Vector3::zeros(), 1.0)]).unwrap_err(), "normals");
    told(EnergyByNormal::through(&[(Vector3::x(), 1.0), (-Vector3::x(), 2.0)]).unwrap_err(), "one energy per normal");
    let d = |a: f64, b: f64| Vector3::new(a, b, 0.0);
    let dip = [(d(1.0, 0.1), 1.0), (d(1.0, 0.0), 10.0), (d(1.0, -0.1), 1.0)];
    told(EnergyByNormal::through(&dip).unwrap_err(), "vanish");
}
