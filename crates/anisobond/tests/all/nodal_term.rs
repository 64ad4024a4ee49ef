//! The nodal term on general networks: against the dense matrix, its own energy, affine fields and the periodic block
//! of a perfect grid.

use crate::common;

use anisobond::calibration::{HybridCalibrator, HybridForm};
use anisobond::experiment::element_test::{ElementTest, Mechanisms};
use anisobond::lattice::{Influence, Neighbourhood};
use anisobond::operator::{BondList, GridCell, Network, NodalTerm, PeriodicHybrid, naive};
use anisobond::tensor::Stiffness;
use common::{Random, jittered_lattice};
use nalgebra::{Matrix3, Vector3, Vector6};

/// Central bonds of random stiffness on a shaken lattice with a nodal term.
fn network(z: &Stiffness) -> Network {
    let lattice = jittered_lattice(3, 5, 1.45);
    let mut random = Random(17);
    let count = lattice.contacts.len();
    let stiffness = anisobond::calibration::LatticeStiffness {
        mu: 1.0,
        normal: (0..count).map(|_| 1e6 * (1.5 + random.number())).collect(),
        tangential: vec![0.0; count],
    };
    let mut network = Network::new(&lattice, &stiffness);
    let shares: Vec<f64> = network.nodes.iter().map(|_| 1.2 + random.number()).collect();
    let weights: Vec<f64> = network.bonds.iter().map(|_| 1.2 + random.number()).collect();
    network.nodal = Some(NodalTerm::filling(z, &network.bonds, network.volume, &shares, weights).unwrap());
    network
}

fn positive() -> Stiffness {
    Random(4).stiffness().scaled(1e-4)
}

fn exact() -> ElementTest {
    let mut test = ElementTest { mechanisms: Mechanisms::Report, threads: false, ..ElementTest::default() };
    test.stopping.tolerance = 1e-12;
    test
}

#[test]
fn the_dense_matrix_agrees() {
    let mut random = Random(3);
    for z in [positive(), Stiffness::from_mandel(positive().mandel() * -1e-3)] {
        let network = network(&z);
        let r = exact().run(&network).unwrap();
        assert!(r.solver.converged() && !r.solver.negative_curvature(), "{:?}", r.solver);
        let oracle = naive::dense_element_test(&network, true);
        assert!(oracle.relative_error(&r.measured) < 1e-9, "{:e}", oracle.relative_error(&r.measured));
        let c = &r.certificate;
        assert!(c.energy_consistency < 1e-9 && c.asymmetry < 1e-9 && c.stress_asymmetry < 1e-9, "{c:?}");
        assert!(c.force_balance < 1e-8 && c.below_sum > -1e-12, "{c:?}");
        // The matrix itself, and its blocks.
        let dense = naive::dense_matrix(&network);
        let list = BondList::new(&network).unwrap();
        let n = network.nodes.len();
        let q = nalgebra::DVector::from_fn(6 * n + 6, |row, _| if row < 6 * n { random.number() } else { 0.0 });
        let (mut x, mut y) = (list.zeros::<1>(), list.zeros::<1>());
        (0..n).for_each(|node| (0..6).for_each(|i| x[list.place(node)][i][0] = q[6 * node + i]));
        list.apply(&x, &mut y);
        let expected = &dense * q;
        for node in 0..n {
            let place = list.place(node);
            for i in 0..6 {
                assert!((y[place][i][0] - expected[6 * node + i]).abs() < 1e-12 * expected.norm());
            }
            let block = dense.fixed_view::<6, 6>(6 * node, 6 * node).into_owned();
            assert!((list.diagonal_blocks()[place] - block).norm() < 1e-12 * block.norm());
        }
    }
}

#[test]
fn force_is_the_slope_of_the_energy() {
    let network = network(&positive());
    let list = BondList::new(&network).unwrap();
    let mut random = Random(8);
    let strain = Vector6::from_fn(|_, _| random.number());
    let mut x = list.zeros::<1>();
    x.iter_mut().flatten().flatten().for_each(|x| *x = random.number());
    let energy = |x: &[[[f64; 1]; 6]], e: &Vector6<f64>| 0.5 * list.volume() * list.measure(&[*e], x).energy[0][0];
    let (mut k, mut f) = (list.zeros::<1>(), list.zeros::<1>());
    list.apply(&x, &mut k);
    list.apply_strain(&[strain], &mut f);
    let scale = k.iter().flatten().flatten().map(|g| g.abs()).fold(0.0, f64::max);
    let h = 1e-3;
    for (node, i) in [(0, 0), (5, 1), (13, 2), (20, 4)] {
        let mut at = |step: f64| {
            let kept = x[node][i][0];
            x[node][i][0] = kept + step;
            let e = energy(&x, &strain);
            x[node][i][0] = kept;
            e
        };
        let slope = (at(h) - at(-h)) / (2.0 * h);
        let gradient = k[node][i][0] + f[node][i][0];
        assert!((slope - gradient).abs() < 1e-8 * scale, "{slope} {gradient}");
    }
    // The stress is the slope over the macroscopic strain.
    let stress = list.measure(&[strain], &x).stress;
    for (a, row) in [(0, 0), (1, 4), (2, 8)] {
        let along = |step: f64| energy(&x, &(strain + step * Vector6::from_fn(|b, _| f64::from(a == b))));
        let slope = (along(h) - along(-h)) / (2.0 * h * list.volume());
        assert!((slope - stress[row][0]).abs() < 1e-8 * stress[row][0].abs().max(1e-3 * scale), "{slope}");
    }
}

/// Of an affine field every node sees its strain, whatever the bonds; a rotation it does not see.
#[test]
fn affine_fields_are_averaged_exactly() {
    let mut network = network(&positive());
    let nodes = network.nodes.clone();
    // A free body: an affine field on periodic nodes is the macroscopic strain itself.
    let term = network.nodal.clone().unwrap();
    let strain = Vector6::new(0.3, -0.2, 0.1, 0.5, -0.4, 0.2);
    let rest = vec![Vector3::zeros(); nodes.len()];
    for e in term.average_strains(&network.bonds, &rest, &strain) {
        assert!((e - strain).norm() < 1e-13);
    }
    let inner: Vec<bool> =
        network.bonds.iter().map(|b| (nodes[b.b as usize] - nodes[b.a as usize] - b.branch).norm() < 1e-9).collect();
    let mut kept = inner.iter();
    network.bonds.retain(|_| *kept.next().unwrap());
    let weights: Vec<f64> = term.weights.iter().zip(&inner).filter(|(_, k)| **k).map(|(w, _)| *w).collect();
    let term = NodalTerm { weights, ..term };
    let gradient = Matrix3::new(0.3, 0.7, -0.2, -0.1, 0.2, 0.4, 0.5, 0.0, -0.6);
    let moved: Vec<Vector3<f64>> = nodes.iter().map(|x| gradient * x + Vector3::new(1.0, 2.0, 3.0)).collect();
    let root = 2f64.sqrt();
    let sym = 0.5 * (gradient + gradient.transpose());
    let expected =
        Vector6::new(sym[(0, 0)], sym[(1, 1)], sym[(2, 2)], root * sym[(1, 2)], root * sym[(0, 2)], root * sym[(0, 1)]);
    let mut seen = 0;
    for e in term.average_strains(&network.bonds, &moved, &Vector6::zeros()) {
        if e.norm() > 0.0 {
            assert!((e - expected).norm() < 1e-12, "{e}");
            seen += 1;
        }
    }
    assert!(seen > 20, "{seen}");
}

/// Bonds and nodal term of a perfect grid: the network's energy, forces and stress are those of the periodic block.
#[test]
fn the_periodic_block_is_the_same() {
    let turn = Random(6).rotation();
    let grid = Neighbourhood::sphere(2.5, 0.5, Influence::Inverse).unwrap().rotated(&turn).unwrap();
    let c = Random(21).stiffness();
    let r = HybridCalibrator::new(&grid).unwrap().calibrate_as(&c, HybridForm::Stable).unwrap();
    let cells = [5, 4, 3];
    let block = PeriodicHybrid::new(&grid, &r.bonds.micromodulus, &r.nodal, cells).unwrap();
    let network = GridCell::perfect(cells).hybrid_network(&grid, &r.bonds.micromodulus, &r.nodal).unwrap();
    let list = BondList::new(&network).unwrap();
    let mut random = Random(2);
    let u: Vec<Vector3<f64>> = (0..60).map(|_| Vector3::from_fn(|_, _| random.number())).collect();
    let strain = Vector6::from_fn(|_, _| random.number());
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let (e23, e13, e12) = (half * strain[3], half * strain[4], half * strain[5]);
    let gradient = Matrix3::new(strain[0], e12, e13, e12, strain[1], e23, e13, e23, strain[2]);
    let expected = block.response(&u, &gradient).unwrap();
    let mut x = list.zeros::<1>();
    u.iter().enumerate().for_each(|(node, u)| (0..3).for_each(|i| x[list.place(node)][i][0] = u[i]));
    let (mut k, mut f) = (list.zeros::<1>(), list.zeros::<1>());
    list.apply(&x, &mut k);
    list.apply_strain(&[strain], &mut f);
    let scale = expected.forces.iter().map(|f| f.norm()).fold(0.0, f64::max);
    for (node, force) in expected.forces.iter().enumerate() {
        let place = list.place(node);
        let ours = Vector3::from_fn(|i, _| -k[place][i][0] - f[place][i][0]);
        assert!((ours - force).norm() < 1e-12 * scale, "{ours} {force}");
    }
    let measured = list.measure(&[strain], &x);
    let energy = 0.5 * network.volume * measured.energy[0][0];
    assert!((energy - expected.energy).abs() < 1e-12 * expected.energy);
    for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
        assert!((measured.stress[3 * i + j][0] - expected.stress[(i, j)]).abs() < 1e-11 * expected.stress.norm());
    }
}

/// A nodal term that is negative enough: said, and an error unless only to be reported.
#[test]
fn negative_energy_is_an_outcome() {
    let network = network(&Stiffness::isotropic(0.0, -2e7));
    let r = exact().run(&network).unwrap();
    assert!(r.solver.negative_curvature() && !r.solver.converged(), "{:?}", r.solver);
    let message = ElementTest::default().run(&network).unwrap_err().to_string();
    assert!(message.contains("not stable"), "{message}");
    // The dense matrix agrees about which term is too negative.
    let (mut stable, mut unstable) = (0, 0);
    for size in [1e3, 1e5, 3e5, 1e6, 2e6, 4e6, 8e6] {
        let network = self::network(&Stiffness::isotropic(0.0, -size));
        let n = network.nodes.len();
        let dense = naive::dense_matrix(&network).view((0, 0), (6 * n, 6 * n)).into_owned();
        let negative = dense.clone().symmetric_eigenvalues().min() < -1e-9 * dense.norm();
        let r = exact().run(&network).unwrap();
        assert_eq!(r.solver.negative_curvature(), negative, "{size}");
        *(if negative { &mut unstable } else { &mut stable }) += 1;
    }
    assert!(stable > 1 && unstable > 1, "{stable} {unstable}");
}

#[test]
fn wrong_terms_are_refused() {
    let sound = network(&positive());
    let refused = |change: &dyn Fn(&mut NodalTerm)| {
        let mut network = sound.clone();
        change(network.nodal.as_mut().unwrap());
        BondList::new(&network).unwrap_err().to_string()
    };
    assert!(refused(&|t| t.volumes.truncate(3)).contains("per node"));
    assert!(refused(&|t| t.weights.truncate(3)).contains("per bond"));
    assert!(refused(&|t| t.volumes[0] = -1.0).contains("volume"));
    assert!(refused(&|t| t.weights[0] = f64::NAN).contains("weight"));
    assert!(refused(&|t| t.stiffness = Stiffness::isotropic(f64::NAN, 1.0)).contains("finite"));
    let none = NodalTerm::filling(&positive(), &[], 1.0, &[1.0], vec![]).unwrap_err().to_string();
    assert!(none.contains("three directions"), "{none}");
}
