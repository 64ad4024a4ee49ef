//! What several test files share.
#![allow(dead_code)] // each test file uses its own part

pub mod grid_body;
pub mod grid_forces;
pub mod qp;
pub mod spheres;

use anisobond::calibration::Calibration;
use anisobond::lattice::{Lattice, Neighbourhood, Packing};
use anisobond::tensor::{MONOMIALS, Stiffness};
use nalgebra::{Matrix6, Vector3};

/// Energies (J) in words, for the records of verification.
pub fn energies(ledger: &anisobond::experiment::Ledger) -> String {
    let [kinetic, strain, damping, fracture, external] =
        [ledger.kinetic, ledger.strain, ledger.damping, ledger.fracture, ledger.external].map(|e| format!("{e:.3e}"));
    let broken = ledger.broken_bonds;
    format!(
        "of {external} J brought in {kinetic} J kinetic, {strain} J strain, {damping} J damped, {fracture} J fracture; {broken} broken"
    )
}

/// A file of the data folder beside the checkout, or `None` with a message where it is absent.
pub fn shared_data(name: &str) -> Option<String> {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(name);
    match std::fs::read_to_string(&path) {
        Ok(text) => Some(text),
        Err(_) => {
            eprintln!("skipped: {} is not here", path.display());
            None
        }
    }
}

/// The document's packing, or `None` with a message where the data is absent.
pub fn reference_packing() -> Option<Packing> {
    let text = shared_data("woo-packing-2556.txt")?;
    let mut lines = text.lines();
    let numbers = |line: &str| line.split_whitespace().filter_map(|x| x.parse().ok()).collect::<Vec<f64>>();
    let cell = numbers(lines.next().unwrap());
    let rows: Vec<Vec<f64>> = lines.map(numbers).filter(|row| row.len() == 4).collect();
    let centres = rows.iter().map(|r| Vector3::new(r[0], r[1], r[2])).collect();
    let radii = rows.iter().map(|r| r[3]).collect();
    Some(Packing::new(Some(Vector3::new(cell[0], cell[1], cell[2])), centres, radii).unwrap())
}

/// n³ spheres of unit spacing, shaken by up to so much along each axis.
pub fn jittered(n: usize, seed: u64, shake: f64) -> Packing {
    let mut random = Random(seed);
    let centres: Vec<Vector3<f64>> = (0..n * n * n)
        .map(|k| Vector3::new((k % n) as f64, (k / n % n) as f64, (k / n / n) as f64))
        .map(|x| x + shake * Vector3::new(random.number(), random.number(), random.number()))
        .collect();
    let radii = (0..centres.len()).map(|_| 0.5 + 0.05 * random.number()).collect();
    Packing::new(Some(Vector3::new(n as f64, n as f64, 1.01 * n as f64)), centres, radii).unwrap()
}

/// The lattice of shaken spheres.
pub fn jittered_lattice(n: usize, seed: u64, contact_radius: f64) -> Lattice {
    Lattice::new(jittered(n, seed, 0.25), contact_radius).unwrap()
}

/// The positive definite crystals of the Materials Project sample: identifier and stiffness.
pub fn crystals() -> Vec<(String, Stiffness)> {
    let Some(text) = shared_data("mp-elastic-sample.csv") else { return Vec::new() };
    let rows = text.lines().skip(1).map(|line| {
        let fields: Vec<&str> = line.split(',').collect();
        let mut voigt = Matrix6::zeros();
        let mut next = fields[3..24].iter().map(|x| 1e9 * x.parse::<f64>().unwrap());
        for a in 0..6 {
            for b in a..6 {
                voigt[(a, b)] = next.next().unwrap();
                voigt[(b, a)] = voigt[(a, b)];
            }
        }
        (fields[0].to_string(), Stiffness::from_voigt(&voigt).unwrap())
    });
    rows.filter(|(_, c)| c.require_positive_definite().is_ok()).collect()
}

/// A deterministic stream of numbers in (−1, 1).
pub struct Random(pub u64);

impl Random {
    pub fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 11) as f64 / (1u64 << 53) as f64) * 2.0 - 1.0
    }

    /// A positive definite tensor with Kelvin moduli spread over several decades.
    pub fn stiffness(&mut self) -> Stiffness {
        let m = Matrix6::from_fn(|_, _| self.number());
        let q = m.qr().q();
        let d = Matrix6::from_diagonal(&nalgebra::Vector6::from_fn(|_, _| 1e10 * 10f64.powf(1.5 * self.number())));
        Stiffness::from_mandel(q * d * q.transpose())
    }

    /// A sum of central bonds in random directions: a tensor with a feasible Cauchy part (and no gap).
    pub fn cauchy_stiffness(&mut self, bonds: usize) -> Stiffness {
        let mut sum = nalgebra::SVector::<f64, 15>::zeros();
        for _ in 0..bonds {
            let n = Vector3::new(self.number(), self.number(), self.number()).normalize();
            sum += 1e9 * (1.1 + self.number()) * anisobond::tensor::quartic_of(&n);
        }
        anisobond::tensor::tensor_of(&sum)
    }

    pub fn rotation(&mut self) -> nalgebra::Matrix3<f64> {
        *nalgebra::Rotation3::from_euler_angles(3.0 * self.number(), 1.5 * self.number(), 3.0 * self.number()).matrix()
    }
}

/// A quartic form of 15 coefficients at a direction.
pub fn form(coefficients: &[f64; 15], n: &Vector3<f64>) -> f64 {
    MONOMIALS
        .iter()
        .zip(coefficients)
        .map(|([a, b, c], d)| d * n[0].powi(*a as i32) * n[1].powi(*b as i32) * n[2].powi(*c as i32))
        .sum()
}

/// S_abc of a fully symmetric tensor for each monomial, so that y·S = Σ y_k S_k.
pub fn cauchy_components(c: &Stiffness) -> [f64; 15] {
    let s = c.cauchy_part();
    std::array::from_fn(|k| {
        let mut i = Vec::new();
        for (axis, &count) in MONOMIALS[k].iter().enumerate() {
            i.extend(std::iter::repeat_n(axis, count));
        }
        s.component(i[0], i[1], i[2], i[3])
    })
}

/// Check everything that a calibration claims, bond by bond and from its published numbers alone; returns ‖Xc − S‖/‖S‖.
pub fn check(neighbourhood: &Neighbourhood, r: &Calibration) -> f64 {
    let s: Vec<f64> = neighbourhood.bonds().iter().map(|b| neighbourhood.stiffness_share(b)).collect();
    let n: Vec<Vector3<f64>> = neighbourhood.bonds().iter().map(|b| b.xi.normalize()).collect();
    let largest = r.micromodulus.iter().copied().fold(0.0, f64::max);
    let cauchy = r.target.cauchy_part();
    // The sum of P eq (29), all components of every bond.
    let mut reached = Matrix6::zeros();
    for ((c, s), n) in r.micromodulus.iter().zip(&s).zip(&n) {
        let e = nalgebra::Vector6::from_fn(|a, _| {
            let (i, j) = anisobond::tensor::PAIRS[a];
            n[i] * n[j] * anisobond::tensor::mandel_weight(a)
        });
        reached += c * s * e * e.transpose();
    }
    let reached = Stiffness::from_mandel(reached);
    assert!(reached.relative_error(&r.reached) < 1e-13);
    assert!((r.relative_error - r.target.relative_error(&reached)).abs() < 1e-13);
    assert!(r.micromodulus.iter().all(|&c| c >= r.lower_bound));
    let error = cauchy.relative_error(&reached);
    // The dual vector proves optimality: c = max(l, s p(n)).
    let scale = largest.max(1e-3 * s.iter().zip(&n).map(|(s, n)| (s * form(&r.dual, n)).abs()).fold(0.0, f64::max));
    for ((c, s), n) in r.micromodulus.iter().zip(&s).zip(&n) {
        let expected = r.lower_bound.max(s * form(&r.dual, n));
        assert!((c - expected).abs() < 1e-7 * scale, "{c} {expected} of {largest}");
    }
    match &r.infeasibility {
        None => assert!(error <= 1e-12, "{error}"),
        Some(i) => {
            assert!((error - i.distance).abs() < 1e-10, "{error} {}", i.distance);
            for n in &n {
                assert!(form(&i.certificate, n) <= 0.0);
            }
            let at_bound = cauchy_components(&r.target);
            let at_bound: f64 = (0..15).map(|k| i.certificate[k] * at_bound[k]).sum::<f64>()
                - s.iter().zip(&n).map(|(s, n)| r.lower_bound * s * form(&i.certificate, n)).sum::<f64>();
            assert!(at_bound > 0.0);
            assert!((at_bound - i.target_product).abs() < 1e-9 * cauchy.norm());
        }
    }
    error
}
