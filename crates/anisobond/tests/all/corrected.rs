//! Calibrations corrected by the element test: derivatives, and targets met by the measured tensor.

use crate::common;

use anisobond::calibration::{EllipticFit, LatticeStiffness, TransverseConstants};
use anisobond::experiment::element_test::{ElementTest, bond_deformations, nodal_strains};
use anisobond::experiment::{
    CorrectedModuli, CorrectedNetwork, Correction, CorrectionForm, LatticeStudy, central_by_sum, hybrid_by_sum,
};
use anisobond::lattice::Lattice;
use anisobond::operator::Network;
use anisobond::tensor::{Material, Stiffness};
use common::{Random, jittered, jittered_lattice, reference_packing};
use nalgebra::{Matrix6, Vector3};

const ROCK: TransverseConstants = TransverseConstants { c11: 130e6, c33: 55e6, c13: 28e6, c12: 40e6 };

fn lattice() -> Lattice {
    jittered_lattice(5, 4, 1.6)
}

fn quick() -> Correction {
    Correction { test: ElementTest { threads: false, ..ElementTest::default() }, ..Correction::default() }
}

/// What is reported is what the bonds really give.
fn check(r: &CorrectedNetwork) {
    let measured = ElementTest::default().run(&r.network).unwrap().measured;
    assert!(measured.relative_error(&r.test.measured) < 1e-9);
    assert!((r.target.relative_error(&measured) - r.report.tensor_error).abs() < 1e-9);
    assert_eq!(r.report.history.len(), r.report.corrections + 1);
    assert_eq!(r.report.history.last(), Some(&r.report.error));
    assert!(r.report.smallest_normal > 0.0);
    let tangential = matches!(r.report.form, CorrectionForm::Elliptic | CorrectionForm::General);
    assert_eq!(r.report.smallest_tangential > 0.0, tangential);
    assert_eq!(r.report.shortfall.is_none(), r.report.tensor_error <= 1e-4, "{:?}", r.report.shortfall);
    assert!(serde_json::to_string(&r.report).unwrap().contains("\"converged\""));
}

/// ∂C/∂k of single bonds against central differences of whole element tests, and C as the sum of the bonds' energies.
#[test]
fn derivatives_are_the_bonds_relaxed_energies() {
    let lattice = jittered_lattice(3, 2, 1.5);
    let study = EllipticFit::new(&ROCK.stiffness(&Vector3::z()), &Vector3::new(0.3, 0.2, 1.0)).unwrap();
    let mut network = Network::new(&lattice, &LatticeStiffness::new(&lattice, &study.microplane).unwrap());
    let mut test = ElementTest { fields: true, ..ElementTest::default() };
    test.stopping.tolerance = 1e-12;
    let r = test.run(&network).unwrap();
    let fields = r.fields.unwrap();
    let deformations: Vec<_> = bond_deformations(&network, &fields).collect();
    let sum: Matrix6<f64> = network.bonds.iter().zip(&deformations).fold(Matrix6::zeros(), |sum, (bond, d)| {
        sum + bond.normal * d.of_normal() + bond.tangential * d.of_tangential()
    });
    assert!((sum / network.volume - r.measured.mandel()).norm() < 1e-10 * r.measured.norm());
    for bond in [0, 7, 40] {
        for tangential in [false, true] {
            let kept = network.bonds[bond];
            let k = if tangential { kept.tangential } else { kept.normal };
            let mut measured = |factor: f64| {
                let bond = &mut network.bonds[bond];
                *(if tangential { &mut bond.tangential } else { &mut bond.normal }) = factor * k;
                test.run(&network).unwrap().measured
            };
            let (up, down) = (measured(1.001), measured(0.999));
            network.bonds[bond] = kept;
            let slope = (up.mandel() - down.mandel()) / (0.002 * k);
            let d = &deformations[bond];
            let expected = if tangential { d.of_tangential() } else { d.of_normal() } / network.volume;
            let error = (slope - expected).norm() / expected.norm();
            assert!(error < 1e-5, "{error:e}");
        }
    }
}

#[test]
fn elliptic_moduli_meet_the_measured_constants() {
    let axis = Vector3::new(0.3, -0.4, 1.0);
    let constants = TransverseConstants { c13: 26e6, c12: 39e6, ..ROCK };
    let target = constants.stiffness(&axis.normalize());
    let study = LatticeStudy::new(jittered(5, 4, 0.25), &target, &axis, 1.6).unwrap();
    let r = quick().elliptic(&study.lattice, &study.fit.unwrap()).unwrap();
    check(&r);
    println!("{:?}", r.report);
    assert!(r.report.converged && r.report.corrections <= 6 && r.report.history[0] > 0.02);
    let CorrectedModuli::Elliptic(moduli) = &r.moduli else { panic!() };
    // The moduli are those of the bonds.
    let again = LatticeStiffness::new(&study.lattice, moduli).unwrap();
    assert!(again.normal.iter().zip(&r.stiffness(1.0).normal).all(|(a, b)| (a - b).abs() < 1e-12 * b));
}

/// A triclinic target within reach is met in all 21 components, and so are its turned copies.
#[test]
fn general_moduli_meet_all_components() {
    let lattice = lattice();
    let mut random = Random(9);
    for _ in 0..2 {
        let mut target = *Stiffness::isotropic(3e7, 6e7).mandel();
        let n = Vector3::new(random.number(), random.number(), random.number()).normalize();
        let m = Vector3::new(random.number(), random.number(), random.number()).normalize();
        target += 4e7 * anisobond::calibration::normal_projection(&n);
        target += 2e7 * anisobond::calibration::normal_projection(&m);
        target += 1e7 * anisobond::calibration::tangential_projection(&m);
        let target = Stiffness::from_mandel(target);
        let r = quick().general(&lattice, &target).unwrap();
        check(&r);
        println!("{:?}", r.report);
        assert!(r.report.converged && r.report.error <= 1e-4 && r.report.corrections <= 6);
        assert!(r.report.history[0] > 0.02);
    }
}

/// Kelvin moduli over three decades: no uniform nodal term holds the stiff strains on a disordered lattice, told.
#[test]
#[ignore = "ten seconds in the dev profile"]
fn the_nodal_term_has_its_limits() {
    let r = quick().hybrid(&lattice(), &Random(5).stiffness()).unwrap();
    check(&r);
    let nodal = r.report.nodal.unwrap();
    assert!(r.report.out_of_reach && nodal.positive, "{nodal:?}");
}

/// Told, with the nearest that was found: no lattice of this kind has Poisson's ratio 0.4.
#[test]
fn targets_out_of_reach_are_told() {
    out_of_reach(&Stiffness::isotropic(4e9, 1e9), 0.4);
}

/// A crystal whose bonds' moduli would span three decades; slow, for every bond at the floor costs iterations.
#[test]
#[ignore = "ten seconds in the dev profile"]
fn crystals_out_of_reach_are_told() {
    out_of_reach(&Material::builtin("Te2W").unwrap().stiffness, 0.2);
}

fn out_of_reach(target: &Stiffness, nearest: f64) {
    let lattice = lattice();
    let r = quick().general(&lattice, target).unwrap();
    check(&r);
    println!("{:?}", r.report);
    assert!(!r.report.converged && r.report.out_of_reach && r.report.error > 0.02 && r.report.error < nearest);
    assert!(r.report.history.windows(2).all(|w| w[1] < w[0]));
    assert!(r.report.at_floor > 0);
    assert!(r.report.shortfall.unwrap().contains("out of reach"));
}

/// Normal bonds meet the Cauchy part of what they are asked for; the rest is said to be left.
#[test]
fn central_bonds_meet_the_cauchy_part() {
    let lattice = jittered_lattice(5, 4, 1.8);
    let n = Vector3::new(0.3, -0.5, 0.7).normalize();
    let target = *Stiffness::isotropic(5e7, 6e7).mandel() + 4e7 * anisobond::calibration::normal_projection(&n);
    let target = Stiffness::from_mandel(target);
    let before = quick().test.run(&central_by_sum(&lattice, &target, 1e-4).unwrap()).unwrap();
    assert!(target.cauchy_part().relative_error(&before.summed.cauchy_part()) < 1e-9);
    let r = quick().central(&lattice, &target).unwrap();
    check(&r);
    println!("{:?}", r.report);
    assert!(r.report.converged && r.report.corrections <= 6 && r.report.history[0] > 0.02);
    assert!(target.cauchy_part().relative_error(&r.test.measured.cauchy_part()) < 2e-4);
    assert!(r.network.bonds.iter().all(|b| b.tangential == 0.0 && b.normal > 0.0));
    assert!(r.report.shortfall.unwrap().contains("normal bonds do not control"));
}

/// ∂C/∂Z by the relaxed average strains, against whole element tests.
#[test]
fn the_derivative_over_the_nodal_term() {
    let lattice = jittered_lattice(3, 2, 1.5);
    let mut network = hybrid_by_sum(&lattice, &Stiffness::isotropic(2e8, 6e7), 1e-4).unwrap();
    let mut test = ElementTest { fields: true, ..ElementTest::default() };
    test.stopping.tolerance = 1e-12;
    let r = test.run(&network).unwrap();
    let strains = nodal_strains(&network, r.fields.as_ref().unwrap());
    let z = network.nodal.as_ref().unwrap().stiffness;
    let change = Random(9).stiffness().scaled(1e-6 * z.norm() / 1e10);
    let volumes = network.nodal.as_ref().unwrap().volumes.clone();
    assert!((volumes.iter().sum::<f64>() / network.volume - 1.0).abs() < 1e-12);
    let expected = strains
        .iter()
        .zip(&volumes)
        .fold(Matrix6::zeros(), |sum, (e, v)| sum + *v / network.volume * (e.transpose() * change.mandel() * e));
    let mut measured = |sign: f64| {
        network.nodal.as_mut().unwrap().stiffness = Stiffness::from_mandel(z.mandel() + sign * change.mandel());
        *test.run(&network).unwrap().measured.mandel()
    };
    let slope = (measured(1.0) - measured(-1.0)) / 2.0;
    assert!((slope - expected).norm() < 1e-4 * expected.norm(), "{:e}", (slope - expected).norm() / expected.norm());
}

/// The hybrid model meets tensors that bonds alone cannot reach.
#[test]
fn a_nodal_term_meets_what_bonds_cannot() {
    let lattice = lattice();
    let mut random = Random(5);
    let si = Material::builtin("Si").unwrap().stiffness;
    // Triclinic, Kelvin moduli within a factor of four.
    let q = Matrix6::from_fn(|_, _| random.number()).qr().q();
    let moduli = Matrix6::from_diagonal(&nalgebra::Vector6::from_fn(|_, _| 1e9 * 10f64.powf(0.3 * random.number())));
    let mild = Stiffness::from_mandel(q * moduli * q.transpose());
    for target in [Stiffness::isotropic(4e9, 1e9), si, Stiffness::isotropic(-3e8, 1e9), mild] {
        let r = quick().hybrid(&lattice, &target).unwrap();
        println!("{:?} {:?}", r.report.history, r.report.nodal);
        check(&r);
        assert!(r.report.converged && r.report.tensor_error <= 1e-4 && r.report.corrections <= 6);
        let nodal = r.report.nodal.as_ref().unwrap();
        assert_eq!(nodal.positive, nodal.moduli[0] >= -1e-12 * target.norm());
        assert!(!r.test.solver.negative_curvature() && nodal.flat_nodes == 0);
    }
}

#[test]
fn wrong_input_is_refused() {
    let lattice = lattice();
    let indefinite = Stiffness::isotropic(-10.0, 1.0);
    let message = quick().general(&lattice, &indefinite).unwrap_err().to_string();
    assert!(message.contains("not positive definite"), "{message}");
    let wrong = Correction { tolerance: f64::NAN, ..quick() };
    assert!(wrong.general(&lattice, &Stiffness::isotropic(1.0, 1.0)).is_err());
    let nowhere = |_: &Vector3<f64>| (0.0, 0.0);
    assert!(quick().general_from(&lattice, &Stiffness::isotropic(1.0, 1.0), &nowhere).is_err());
}

/// The document's rock on the reference packing, or `None` where the data is absent.
fn reference_study(contact_radius: f64) -> Option<LatticeStudy> {
    let packing = reference_packing()?;
    Some(LatticeStudy::new(packing, &ROCK.stiffness(&Vector3::z()), &Vector3::z(), contact_radius).unwrap())
}

/// Measured within 0.1 % of the target in a few corrections (three are used at 1.2), all stiffnesses positive.
fn rock_is_met(contact_radius: f64, corrections: usize) {
    let Some(study) = reference_study(contact_radius) else { return };
    let correction = Correction { tolerance: 1e-3, ..Correction::default() };
    let start = std::time::Instant::now();
    let r = correction.elliptic(&study.lattice, &study.fit.unwrap()).unwrap();
    println!("{contact_radius} {:?} {:?} {:?}", start.elapsed(), r.report, r.moduli);
    assert!(r.report.converged && r.report.error < 1e-3 && r.report.corrections <= corrections);
    assert!(r.report.smallest_normal > 0.0 && r.report.smallest_tangential > 0.0);
}

#[test]
fn reference_packing_at_1_2() {
    rock_is_met(1.2, 3);
}

#[test]
fn reference_packing_at_1_4() {
    rock_is_met(1.4, 2);
}

#[test]
fn reference_packing_at_1_8() {
    rock_is_met(1.8, 1);
}

/// All 21 components of the rock and of a triclinic tensor near it, measured on the reference packing.
fn reference_packing_in_all_components(contact_radius: f64) {
    let Some(study) = reference_study(contact_radius) else { return };
    let n = Vector3::new(0.6, -0.3, 0.5).normalize();
    let triclinic = study.prescribed.mandel() + 3e7 * anisobond::calibration::normal_projection(&n);
    for target in [study.prescribed, Stiffness::from_mandel(triclinic)] {
        let start = std::time::Instant::now();
        let r = Correction::default().general_from(&study.lattice, &target, &study.fit.unwrap().microplane).unwrap();
        println!("{contact_radius} {:?} {:?}", start.elapsed(), r.report);
        assert!(r.report.converged && r.report.tensor_error < 1e-3 && r.report.corrections <= 6);
        assert!(r.report.smallest_normal > 0.0 && r.report.smallest_tangential > 0.0);
    }
}

#[test]
fn reference_packing_in_all_components_at_1_4() {
    reference_packing_in_all_components(1.4);
}

#[test]
#[ignore = "ten seconds in the dev profile"]
fn reference_packing_in_all_components_at_1_2_and_1_8() {
    reference_packing_in_all_components(1.2);
    reference_packing_in_all_components(1.8);
}
