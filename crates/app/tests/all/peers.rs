//! Our numbers against those of Elasticipy, pymatgen and ELATE (verification/peers, docs/peers.md).

use anisobond::tensor::{DirectionalModuli, Extremes, Material, SYMMETRY_TOLERANCE, Stiffness, SymmetryClass};
use anisobond_app::TensorReport;
use nalgebra::{Matrix6, Vector3, Vector6};
use serde_json::Value;

/// Extremes that a peer's search misses (docs/peers.md says by how much, and how we know). Everything else must agree.
const MISSED: [(&str, &str, &str); 6] = [
    ("KIO3", "elate", "young_max"),
    ("CoTeO4", "elate", "poisson_max"),
    ("Ta2C", "elate", "poisson_min"),
    ("Ta2C", "elate", "poisson_max"),
    ("Ta2C", "elasticipy", "poisson_min"),
    ("Ta2C", "elasticipy", "wave_fast_min"),
];

/// Peers' searches stop at about seven digits.
const SEARCH: f64 = 1e-6;

#[test]
fn moduli_agree_with_the_peers() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../verification/peers/reference.json");
    let reference: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let density = reference["density_g_per_cm3"].as_f64().unwrap() * 1e3;
    let (mut compared, mut wrong) = (0, vec![]);
    for (name, peers) in reference["materials"].as_object().unwrap() {
        let c = Material::builtin(name).unwrap().stiffness;
        for (a, b) in (0..6).flat_map(|a| (0..6).map(move |b| (a, b))) {
            let theirs = peers["voigt"][a][b].as_f64().unwrap() * 1e9;
            assert!((c.voigt()[(a, b)] - theirs).abs() < 1.0, "{name}: the peers were given another tensor");
        }
        let material = Material { density: Some(density), ..Material::builtin(name).unwrap() };
        let ours = TensorReport::new(&material, Some(SYMMETRY_TOLERANCE)).unwrap();
        let (m, d, w) = (&ours.moduli, &ours.directional, &ours.waves.as_ref().unwrap().extremes);
        let k = &ours.engineering;
        let exact: [(&str, f64); 11] = [
            ("voigt_bulk", m.voigt.bulk / 1e9),
            ("voigt_shear", m.voigt.shear / 1e9),
            ("reuss_bulk", m.reuss.bulk / 1e9),
            ("reuss_shear", m.reuss.shear / 1e9),
            ("hill_bulk", m.hill.bulk / 1e9),
            ("hill_shear", m.hill.shear / 1e9),
            ("hill_young", m.hill_young / 1e9),
            ("hill_poisson", m.hill_poisson),
            ("universal_anisotropy", m.universal_anisotropy),
            ("nu12", k.nu12),
            ("nu31", k.nu31),
        ];
        let searched: [(&str, f64, &Extremes); 7] = [
            ("young", 1e-9, &d.young),
            ("shear", 1e-9, &d.shear),
            ("poisson", 1.0, &d.poisson),
            ("linear_compressibility", 1e9, &d.linear_compressibility),
            ("wave_slow", 1e-3, &w.slow),
            ("wave_intermediate", 1e-3, &w.intermediate),
            ("wave_fast", 1e-3, &w.fast),
        ];
        for peer in ["elasticipy", "pymatgen", "elate"] {
            for (key, value) in exact {
                if let Some(theirs) = peers[peer][key].as_f64() {
                    compared += 1;
                    if (value - theirs).abs() > 1e-9 * (1e-3 + value.abs()) {
                        wrong.push(format!("{name} {peer} {key}: {theirs}, ours {value}"));
                    }
                }
            }
            for (key, unit, extremes) in searched {
                let (min, max) = (extremes.min.value * unit, extremes.max.value * unit);
                let size = min.abs().max(max.abs());
                for (end, ours, outside) in [("min", min, -1.0), ("max", max, 1.0)] {
                    let Some(theirs) = peers[peer][format!("{key}_{end}")].as_f64() else { continue };
                    compared += 1;
                    // Beyond our extreme by more than their rounding: ours would be wrong.
                    assert!(
                        outside * (theirs - ours) < 1e-9 * size,
                        "{name} {peer} {key}_{end}: {theirs} beats {ours}"
                    );
                    let missed = MISSED.contains(&(name, peer, &format!("{key}_{end}")));
                    if ((theirs - ours).abs() > SEARCH * size) != missed {
                        wrong.push(format!("{name} {peer} {key}_{end}: {theirs}, ours {ours}"));
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert_eq!(compared, 384);
}

/// Multiplicities of Kelvin moduli, by which Elasticipy decides, do not make a symmetry: this tensor has those of
/// isotropy (1 and 5) and is twice as stiff along 2 as along 1. It is transversely isotropic about 1.
#[test]
fn kelvin_moduli_alone_do_not_make_a_symmetry() {
    let mut moduli = Vector6::repeat(100e9);
    moduli[0] = 50e9;
    let c = Stiffness::from_mandel(Matrix6::from_diagonal(&moduli));
    let d = DirectionalModuli::new(&c).unwrap();
    assert!((d.young(&Vector3::x()) - 50e9).abs() < 1.0 && (d.young(&Vector3::y()) - 100e9).abs() < 1.0);
    let found = c.symmetry(SYMMETRY_TOLERANCE);
    assert_eq!(found.class, SymmetryClass::TransverselyIsotropic);
    assert!(found.detected().distance < 1e-14 && found.detected().axes.column(2)[0].abs() > 1.0 - 1e-12);
    assert!(found.fit(SymmetryClass::Isotropic).distance > 0.1);
}
