//! What is said of a tensor without a lattice: closed forms, invariance under rotation, naive twins.

use anisobond::tensor::{
    DirectionalModuli, Extreme, Extremes, Material, SYMMETRY_TOLERANCE, Stiffness, SymmetryClass, WaveExtremes,
};
use nalgebra::{Matrix3, Matrix6, Rotation3, UnitQuaternion, Vector3};

/// Repeatable numbers in (−1, 1) (splitmix64).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// A rotation from a uniformly distributed quaternion.
    fn rotation(&mut self) -> Matrix3<f64> {
        loop {
            let q = nalgebra::Quaternion::new(self.next(), self.next(), self.next(), self.next());
            if q.norm() < 1.0 && q.norm() > 0.1 {
                return *UnitQuaternion::from_quaternion(q).to_rotation_matrix().matrix();
            }
        }
    }

    fn direction(&mut self) -> Vector3<f64> {
        self.rotation().column(2).into_owned()
    }

    /// A symmetric tensor of norm one without any symmetry.
    fn tensor(&mut self) -> Stiffness {
        let m = Matrix6::from_fn(|_, _| self.next());
        let c = Stiffness::from_mandel(m + m.transpose());
        c.scaled(1.0 / c.norm())
    }

    /// A tensor of a class in its own axes, far from all more symmetric ones and positive definite (Pa).
    fn of_class(&mut self, class: SymmetryClass) -> Stiffness {
        let rough = class.project(&self.tensor());
        let sum = Stiffness::isotropic(0.8, 1.0).mandel() + rough.mandel() * (2.5 / rough.norm());
        let (values, _) = Stiffness::from_mandel(sum).eigen();
        let lift = Stiffness::isotropic(0.0, 0.5 * (0.2 - values[0]).max(0.0));
        Stiffness::from_mandel((sum + lift.mandel()) * 1e10)
    }
}

fn built_in() -> Vec<Material> {
    Material::builtin_names().into_iter().map(|name| Material::builtin(name).unwrap()).collect()
}

/// The rows of the sample of computed crystals: identifier, system, tensor; empty (with a message) without the data.
fn crystals() -> Vec<(String, String, Stiffness)> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/mp-elastic-sample.csv");
    let Ok(text) = std::fs::read_to_string(path) else {
        eprintln!("skipped: no {path}");
        return vec![];
    };
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let mut upper = cells[3..24].iter().map(|x| x.parse::<f64>().unwrap() * 1e9);
        let mut voigt = Matrix6::zeros();
        for (a, b) in (0..6).flat_map(|a| (a..6).map(move |b| (a, b))) {
            voigt[(a, b)] = upper.next().unwrap();
            voigt[(b, a)] = voigt[(a, b)];
        }
        (cells[0].to_string(), cells[2].to_string(), Stiffness::from_voigt(&voigt).unwrap())
    };
    text.lines().skip(1).filter(|line| !line.is_empty()).map(row).collect()
}

fn close(found: f64, expected: f64, tolerance: f64) -> bool {
    (found - expected).abs() <= tolerance * expected.abs().max(1e-3)
}

fn vectors(e: &Extreme) -> (Vector3<f64>, Option<Vector3<f64>>) {
    (Vector3::from(e.direction), e.transverse.map(Vector3::from))
}

// ---------------------------------------------------------------------------------------------- directional moduli

/// Cubic: 1/E = s11 − 2(s11 − s12 − s44/2)(n₁²n₂² + n₂²n₃² + n₃²n₁²), extremes along [100] and [111];
/// G between C44 and (C11 − C12)/2; β the same in all directions.
#[test]
fn cubic_closed_forms() {
    let c = Material::builtin("Spinel").unwrap().stiffness;
    let (c11, c12, c44) = (252e9, 145e9, 142e9);
    let (g, k) = ((c11 - c12) / 2.0, (c11 + 2.0 * c12) / 3.0);
    let e = DirectionalModuli::new(&c).unwrap().extremes();
    assert!(close(e.young.min.value, 9.0 * k * g / (3.0 * k + g), 1e-13));
    assert!(close(e.young.max.value, 9.0 * k * c44 / (3.0 * k + c44), 1e-13));
    assert_eq!(e.young.min.direction.map(|x: f64| x.abs().round()).iter().sum::<f64>(), 1.0);
    assert!(e.young.max.direction.iter().all(|x| close(x.abs(), 3f64.sqrt().recip(), 1e-7)));
    assert!(close(e.shear.min.value, g, 1e-13) && close(e.shear.max.value, c44, 1e-13));
    for beta in [e.linear_compressibility.min, e.linear_compressibility.max] {
        assert!(close(beta.value, 1.0 / (3.0 * k), 1e-13));
    }
    // Both extremes of ν under tension along [110]: along [001] and [1 −1 0] (Baughman et al. 1998).
    let s = c.compliance_voigt().unwrap();
    let (s11, s12, s44) = (s[(0, 0)], s[(0, 1)], s[(3, 3)]);
    let s_110 = (2.0 * s11 + 2.0 * s12 + s44) / 4.0;
    assert!(close(e.poisson.max.value, -s12 / s_110, 1e-12));
    assert!(close(e.poisson.min.value, -(2.0 * s11 + 2.0 * s12 - s44) / 4.0 / s_110, 1e-12));
}

/// Transversely isotropic: E depends on the angle to e₃ only, 1/E = s11 sin⁴ + s33 cos⁴ + (2s13 + s44) sin² cos², whose
/// extremes are at the poles, the equator or where its derivative in sin² vanishes; β is s11 + s12 + s13 and 2s13 + s33.
#[test]
fn transversely_isotropic_closed_forms() {
    let c = Material::builtin("MoN").unwrap().stiffness;
    // 2C66 = C11 − C12 in MoN.
    let s = c.compliance_voigt().unwrap();
    let (s11, s12, s33, s13, s44) = (s[(0, 0)], s[(0, 1)], s[(2, 2)], s[(0, 2)], s[(3, 3)]);
    let inverse = |w: f64| s11 * w * w + s33 * (1.0 - w).powi(2) + (2.0 * s13 + s44) * w * (1.0 - w);
    let cross = 2.0 * s13 + s44;
    let inner = (2.0 * s33 - cross) / (2.0 * (s11 + s33 - cross));
    let mut candidates = vec![inverse(0.0), inverse(1.0)];
    if (0.0..=1.0).contains(&inner) {
        candidates.push(inverse(inner));
    }
    let e = DirectionalModuli::new(&c).unwrap().extremes();
    assert!(close(e.young.max.value, candidates.iter().map(|x| 1.0 / x).fold(0.0, f64::max), 1e-13));
    assert!(close(e.young.min.value, candidates.iter().map(|x| 1.0 / x).fold(f64::MAX, f64::min), 1e-13));
    let mut beta = [s11 + s12 + s13, 2.0 * s13 + s33];
    beta.sort_by(f64::total_cmp);
    assert!(close(e.linear_compressibility.min.value, beta[0], 1e-12));
    assert!(close(e.linear_compressibility.max.value, beta[1], 1e-12));
}

#[test]
fn isotropic_moduli_are_the_same_in_all_directions() {
    let c = Stiffness::isotropic(40e9, 30e9);
    let e = DirectionalModuli::new(&c).unwrap().extremes();
    let (young, nu) = (30e9 * (3.0 * 40e9 + 2.0 * 30e9) / 70e9, 40.0 / 140.0);
    for (extremes, expected) in [(e.young, young), (e.shear, 30e9), (e.poisson, nu)] {
        assert!(close(extremes.min.value, expected, 1e-13) && close(extremes.max.value, expected, 1e-13));
    }
    assert!(DirectionalModuli::new(&Stiffness::isotropic(-10.0, 1.0)).is_err());
}

/// Along the axes the directional moduli are the engineering constants.
#[test]
fn directional_moduli_along_the_axes_are_engineering_constants() {
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    for m in built_in() {
        let d = DirectionalModuli::new(&m.stiffness).unwrap();
        let k = m.stiffness.engineering_constants().unwrap();
        for (n, e) in [(x, k.e1), (y, k.e2), (z, k.e3)] {
            assert!(close(d.young(&(3.0 * n)), e, 1e-12));
        }
        for (n, t, nu) in
            [(x, y, k.nu12), (y, x, k.nu21), (x, z, k.nu13), (z, x, k.nu31), (y, z, k.nu23), (z, y, k.nu32)]
        {
            assert!(close(d.poisson(&n, &(t + 5.0 * n)), nu, 1e-10), "{}", m.name);
        }
        for (n, t, g) in [(y, z, k.g23), (x, z, k.g13), (x, y, k.g12)] {
            assert!(close(d.shear(&n, &t), g, 1e-12));
        }
        let beta = d.linear_compressibility(&x) + d.linear_compressibility(&y) + d.linear_compressibility(&z);
        assert!(close(beta * m.stiffness.reuss_average().unwrap().bulk, 1.0, 1e-11));
    }
}

/// The value of every extreme is the modulus in its direction.
#[test]
fn extremes_are_values_at_their_directions() {
    for m in built_in() {
        let d = DirectionalModuli::new(&m.stiffness).unwrap();
        let e = d.extremes();
        for extreme in [e.young.min, e.young.max] {
            assert!(close(d.young(&vectors(&extreme).0), extreme.value, 1e-12), "{}", m.name);
        }
        for extreme in [e.linear_compressibility.min, e.linear_compressibility.max] {
            let scale = e.linear_compressibility.max.value.abs();
            assert!((d.linear_compressibility(&vectors(&extreme).0) - extreme.value).abs() < 1e-13 * scale);
        }
        for extreme in [e.shear.min, e.shear.max] {
            let (n, t) = vectors(&extreme);
            assert!(close(d.shear(&n, &t.unwrap()), extreme.value, 1e-12), "{}", m.name);
        }
        for extreme in [e.poisson.min, e.poisson.max] {
            let (n, t) = vectors(&extreme);
            assert!(close(d.poisson(&n, &t.unwrap()), extreme.value, 1e-11), "{}", m.name);
        }
    }
}

/// Naive twin: every pair of 3000 directions and 24 turns. It never beats the search, and comes near it.
#[test]
fn brute_force_does_not_beat_the_extremes() {
    let mut numbers = Numbers(1);
    let mut soft: Vec<(String, Stiffness)> = built_in().into_iter().map(|m| (m.name, m.stiffness)).collect();
    soft.push(("random triclinic".into(), numbers.of_class(SymmetryClass::Triclinic)));
    for (name, c) in soft {
        let d = DirectionalModuli::new(&c).unwrap();
        let e = d.extremes();
        let mut seen = [(f64::INFINITY, f64::NEG_INFINITY); 4];
        let mut see = |which: usize, value: f64| {
            seen[which] = (seen[which].0.min(value), seen[which].1.max(value));
        };
        for _ in 0..3000 {
            let frame = numbers.rotation();
            let n = frame.column(2).into_owned();
            see(0, d.young(&n));
            see(1, d.linear_compressibility(&n));
            for k in 0..24 {
                let (s, t) = (k as f64 * std::f64::consts::PI / 24.0).sin_cos();
                let m = frame.column(0) * t + frame.column(1) * s;
                see(2, d.shear(&n, &m));
                see(3, d.poisson(&n, &m));
            }
        }
        for (which, extremes) in [e.young, e.linear_compressibility, e.shear, e.poisson].into_iter().enumerate() {
            let (low, high) = seen[which];
            let (min, max) = (extremes.min.value, extremes.max.value);
            let size = max.abs().max(min.abs());
            assert!(
                low >= min - 1e-12 * size && high <= max + 1e-12 * size,
                "{name} {which}: {low} {high} {extremes:?}"
            );
            assert!(low - min <= 0.1 * size && max - high <= 0.2 * size, "{name} {which}: {low} {high} {extremes:?}");
        }
    }
}

/// A table of scalars that no rotation may change.
fn invariants(c: &Stiffness) -> Vec<f64> {
    let both = |e: Extremes| [e.min.value, e.max.value];
    let a = c.average_moduli().unwrap();
    let d = DirectionalModuli::new(c).unwrap().extremes();
    let w: WaveExtremes = c.wave_extremes(3000.0).unwrap();
    let mut out = vec![a.voigt.bulk, a.voigt.shear, a.reuss.bulk, a.reuss.shear, a.hill_young, a.hill_poisson];
    // A^U of an isotropic tensor is zero, and rounding is all that is left of it.
    out.push(1.0 + a.universal_anisotropy);
    out.extend(
        [d.young, d.linear_compressibility, d.shear, d.poisson, w.slow, w.intermediate, w.fast].map(both).concat(),
    );
    out.extend(c.symmetry(SYMMETRY_TOLERANCE).fits.map(|fit| fit.distance));
    out
}

#[test]
fn nothing_depends_on_the_orientation() {
    let mut numbers = Numbers(2);
    for m in built_in() {
        let expected = invariants(&m.stiffness);
        for _ in 0..2 {
            let found = invariants(&m.stiffness.rotated(&numbers.rotation()));
            for (k, (a, b)) in found.iter().zip(&expected).enumerate() {
                let size = if k >= 21 { 1.0 } else { b.abs() };
                assert!((a - b).abs() <= 1e-10 * size, "{} {k}: {a} {b}", m.name);
            }
        }
    }
}

// ------------------------------------------------------------------------------------------------------------ waves

/// Naive twin: speeds of random directions never leave the extremes, and come near them.
#[test]
fn brute_force_does_not_beat_the_wave_extremes() {
    let mut numbers = Numbers(3);
    for m in built_in() {
        let e = m.stiffness.wave_extremes(4000.0).unwrap();
        let branches = [e.slow, e.intermediate, e.fast];
        let mut seen = [(f64::INFINITY, f64::NEG_INFINITY); 3];
        for _ in 0..3000 {
            let waves = m.stiffness.waves(&numbers.direction(), 4000.0).unwrap();
            for k in 0..3 {
                seen[k] = (seen[k].0.min(waves[k].speed), seen[k].1.max(waves[k].speed));
            }
        }
        for k in 0..3 {
            let (min, max) = (branches[k].min.value, branches[k].max.value);
            assert!(seen[k].0 >= min * (1.0 - 1e-10) && seen[k].1 <= max * (1.0 + 1e-10), "{} {k}", m.name);
            assert!(seen[k].0 <= min + 0.05 * max && seen[k].1 >= 0.95 * max, "{} {k}", m.name);
        }
    }
}

/// Polarisations are orthogonal eigenvectors of Γ, and ρ Σc² = tr Γ.
#[test]
fn waves_solve_christoffels_equation() {
    let mut numbers = Numbers(4);
    for m in built_in() {
        let n = numbers.direction();
        let gamma = m.stiffness.christoffel(&n);
        let waves = m.stiffness.waves(&n, 2500.0).unwrap();
        for w in waves {
            let u = Vector3::from(w.polarisation);
            assert!((gamma * u - u * 2500.0 * w.speed * w.speed).norm() < 1e-12 * gamma.norm());
        }
        let sum: f64 = waves.iter().map(|w| 2500.0 * w.speed * w.speed).sum();
        assert!(close(sum, gamma.trace(), 1e-13));
    }
}

// --------------------------------------------------------------------------------------------------------- symmetry

#[test]
fn every_class_is_found_in_any_orientation() {
    let mut numbers = Numbers(5);
    for class in SymmetryClass::ALL {
        for turn in 0..4 {
            let own = numbers.of_class(class);
            let q = if turn == 0 { Matrix3::identity() } else { numbers.rotation() };
            let found = own.rotated(&q).symmetry(SYMMETRY_TOLERANCE);
            assert_eq!(found.class, class, "{found:?}");
            assert!(found.detected().distance <= 1e-12, "{class:?}: {}", found.detected().distance);
            if turn == 0 {
                assert!((found.detected().axes - Matrix3::identity()).norm() < 1e-9, "{:?}", found.detected());
            }
        }
    }
}

/// The axes found are those of the turned tensor: seen from them it has the class's pattern.
#[test]
fn axes_bring_a_tensor_back_to_its_pattern() {
    let mut numbers = Numbers(6);
    for class in SymmetryClass::ALL {
        let c = numbers.of_class(class).rotated(&numbers.rotation());
        for fit in c.symmetry(SYMMETRY_TOLERANCE).fits {
            assert!((fit.axes.determinant() - 1.0).abs() < 1e-14);
            let back = fit.closest.rotated(&fit.axes.transpose());
            assert!(back.relative_error(&fit.class.project(&back)) < 1e-13, "{class:?} {:?}", fit.class);
            assert!(close(c.relative_error(&fit.closest), fit.distance, 1e-12));
        }
    }
}

/// A perturbation of size δ moves a tensor by at most δ from its class, and by about δ·√(1 − dimension/21).
#[test]
fn a_perturbed_tensor_keeps_its_class() {
    let mut numbers = Numbers(7);
    for class in SymmetryClass::ALL {
        for delta in [1e-9, 1e-6, 2e-3] {
            let c = numbers.of_class(class).rotated(&numbers.rotation());
            let noise = numbers.tensor().mandel() * (delta * c.norm());
            let noisy = Stiffness::from_mandel(c.mandel() + noise);
            let found = noisy.symmetry(SYMMETRY_TOLERANCE);
            assert_eq!(found.class, class);
            let distance = found.detected().distance;
            assert!(distance <= delta * (1.0 + 2.0 * delta), "{class:?} {delta}: {distance}");
            assert!(class == SymmetryClass::Triclinic || distance > 0.1 * delta, "{class:?} {delta}: {distance}");
        }
    }
}

/// Naive twin: no random frame is nearer to the class than the axes found.
#[test]
fn brute_force_does_not_beat_the_closest_axes() {
    let mut numbers = Numbers(8);
    let mut tensors: Vec<Stiffness> = built_in().into_iter().map(|m| m.stiffness).collect();
    tensors.extend((0..4).map(|_| numbers.of_class(SymmetryClass::Triclinic)));
    for c in tensors {
        let found = c.symmetry(SYMMETRY_TOLERANCE);
        for _ in 0..40 {
            let back = c.rotated(&numbers.rotation());
            for fit in &found.fits {
                assert!(back.relative_error(&fit.class.project(&back)) >= fit.distance - 1e-13, "{fit:?}");
            }
        }
    }
}

/// Distances of a tensor that is one class in closed form. Cubic to isotropic: the anisotropic part of a cubic tensor
/// is ½(C11 − C12 − 2C44) times a tensor whose Mandel matrix has the eigenvalues (0; ⅗·2, ⅗·2; −⅖·2 three times).
#[test]
fn cubic_to_isotropic_distance() {
    let c = Material::builtin("Spinel").unwrap().stiffness;
    let gap: f64 = 252.0 - 145.0 - 2.0 * 142.0;
    let expected = gap.abs() * (2.0 * 0.36 + 3.0 * 0.16f64).sqrt() * 1e9 / c.norm();
    let found = c.rotated(&Numbers(9).rotation()).symmetry(SYMMETRY_TOLERANCE);
    assert!(close(found.fit(SymmetryClass::Isotropic).distance, expected, 1e-13));
    assert_eq!(found.class, SymmetryClass::Cubic);
}

/// The document's materials belong to the class it prints them under.
#[test]
fn built_in_materials_are_detected() {
    for m in built_in() {
        let found = m.stiffness.symmetry(SYMMETRY_TOLERANCE);
        assert_eq!(Some(found.class), Material::builtin_class(&m.name), "{}: {found:#?}", m.name);
    }
}

/// Pairs (smaller, larger): every tensor of the smaller class belongs to the larger.
const INCLUSIONS: [(SymmetryClass, SymmetryClass); 11] = [
    (SymmetryClass::Isotropic, SymmetryClass::Cubic),
    (SymmetryClass::Isotropic, SymmetryClass::TransverselyIsotropic),
    (SymmetryClass::Cubic, SymmetryClass::Tetragonal),
    (SymmetryClass::Cubic, SymmetryClass::Trigonal),
    (SymmetryClass::TransverselyIsotropic, SymmetryClass::Tetragonal),
    (SymmetryClass::TransverselyIsotropic, SymmetryClass::Trigonal),
    (SymmetryClass::Tetragonal, SymmetryClass::Orthotropic),
    (SymmetryClass::Trigonal, SymmetryClass::Monoclinic),
    (SymmetryClass::Orthotropic, SymmetryClass::Monoclinic),
    (SymmetryClass::Monoclinic, SymmetryClass::Triclinic),
    (SymmetryClass::Isotropic, SymmetryClass::Triclinic),
];

/// The sample of computed crystals, as given and turned: distances grow with symmetry and are those of the turned
/// tensor, and the crystal system's class is near.
#[test]
fn distances_are_monotone_over_the_crystals() {
    let q = *Rotation3::from_euler_angles(0.5, 1.2, -2.0).matrix();
    let (mut rows, mut far) = (0, vec![]);
    for (name, system, c) in crystals() {
        rows += 1;
        let found = c.rotated(&q).symmetry(SYMMETRY_TOLERANCE);
        for (smaller, larger) in INCLUSIONS {
            let (small, large) = (found.fit(smaller).distance, found.fit(larger).distance);
            assert!(large <= small + 1e-13, "{name}: {larger:?} {large} > {smaller:?} {small}");
        }
        let class = match system.as_str() {
            "cubic" => SymmetryClass::Cubic,
            "hexagonal" => SymmetryClass::TransverselyIsotropic,
            "tetragonal" => SymmetryClass::Tetragonal,
            "trigonal" => SymmetryClass::Trigonal,
            "orthorhombic" => SymmetryClass::Orthotropic,
            "monoclinic" => SymmetryClass::Monoclinic,
            _ => SymmetryClass::Triclinic,
        };
        if found.fit(class).distance > 2e-2 {
            far.push((name, class, found.fit(class).distance));
        }
    }
    assert!(rows == 0 || (rows > 150 && far.len() <= rows / 50), "{rows} {far:?}");
}
