//! Exact answers, each against something independent of the way it is computed.

use crate::common;

use std::f64::consts::PI;

use anisobond::experiment::closed_forms::{
    BarnettLothe, Cantilever, CentreCrack, PressurisedHole, Stroh, bar_wave, plate_waves, rayleigh_wave,
};
use anisobond::tensor::{Material, Stiffness};
use common::Random;
use nalgebra::{Complex, Matrix3, Matrix6, Vector3};

/// S's rock (Pa), axis of anisotropy along x₃.
fn rock() -> Stiffness {
    let mut c = Matrix6::zeros();
    let rows = [[130.0, 40.0, 28.0], [40.0, 130.0, 28.0], [28.0, 28.0, 55.0]];
    for i in 0..3 {
        for j in 0..3 {
            c[(i, j)] = rows[i][j] * 1e6;
        }
    }
    let c44 = 0.25 * 130.0 + 0.25 * 55.0 - 0.5 * 28.0;
    (c[(3, 3)], c[(4, 4)], c[(5, 5)]) = (c44 * 1e6, c44 * 1e6, 45e6);
    Stiffness::from_voigt(&c).unwrap()
}

/// The rock with its axis along x₂.
fn rock_in_section() -> Stiffness {
    rock().rotated(&Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0))
}

fn isotropic(e: f64, nu: f64) -> Stiffness {
    Stiffness::isotropic(e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu)))
}

/// The tensors that are tried: rock both ways and aslant, the document's eight, random ones, and degenerate ones.
fn tensors() -> Vec<(String, Stiffness)> {
    let mut random = Random(7);
    let mut all = vec![
        ("rock".into(), rock()),
        ("rock in section".into(), rock_in_section()),
        ("rock aslant".into(), rock().rotated(&random.rotation())),
        ("isotropic".into(), isotropic(70e9, 0.2)),
        ("Cauchy isotropic".into(), isotropic(1.0, 0.25)),
    ];
    all.extend(Material::builtin_names().into_iter().map(|n| (n.into(), Material::builtin(n).unwrap().stiffness)));
    all.extend((0..20).map(|k| (format!("random {k}"), random.stiffness())));
    all
}

/// THEORY section 9: Lekhnitskii's solution as recomputed elsewhere.
#[test]
fn hole_in_the_rock_has_the_published_numbers() {
    let (a, p) = (0.5, 1e6);
    let hole = PressurisedHole::new(&rock_in_section(), a, p).unwrap();
    let (ux, uz) = (hole.displacement([a, 0.0]), hole.displacement([0.0, a]));
    println!("u_x/a {:.8} u_z/a {:.8} ratio {:.6}", ux.x / a, uz.y / a, uz.y / ux.x);
    assert!((ux.x / a - 0.011644).abs() < 5e-7 && (uz.y / a - 0.022676).abs() < 5e-7);
    assert!((uz.y / ux.x - 1.9475).abs() < 5e-5);
    let printed = [0.895, 0.936, 1.038, 1.129, 1.096, 0.935, 0.839];
    for (k, wanted) in printed.into_iter().enumerate() {
        let hoop = hole.hoop_stress(15f64.to_radians() * k as f64) / p;
        assert!((hoop - wanted).abs() < 5.1e-4, "{k}: {hoop}");
    }
}

/// σ_rr = −p (a/r)², σ_θθ = p (a/r)², u_r = p a²/(2Gr) (Lamé), for the tensor whose three roots coincide.
#[test]
fn isotropic_hole_is_lame() {
    for nu in [0.0, 0.25, 0.45] {
        let (e, a, p) = (20e9, 2.0, 3e6);
        let g = e / (2.0 * (1.0 + nu));
        let hole = PressurisedHole::new(&isotropic(e, nu), a, p).unwrap();
        for (r, theta) in [(2.0, 0.0f64), (2.0, 1.1), (3.0, 2.5), (10.0, -0.7)] {
            let n = Vector3::new(theta.cos(), theta.sin(), 0.0);
            let x = [r * n.x, r * n.y];
            let u = hole.displacement(x);
            let exact = n * (p * a * a / (2.0 * g * r));
            assert!((u - exact).norm() < 1e-9 * exact.norm(), "{nu} {r}: {:e}", (u - exact).norm() / exact.norm());
            let t = Vector3::new(-n.y, n.x, 0.0);
            let exact = p * (a / r).powi(2) * (t * t.transpose() - n * n.transpose());
            let error = (hole.stress(x) - exact).norm() / exact.norm();
            assert!(error < 1e-8, "{nu} {r}: {error:e}");
        }
    }
}

/// What defines the solution: equilibrium, the gradient of the displacement, the traction, decay.
#[test]
fn hole_in_any_medium_solves_its_problem() {
    let a = 0.3;
    for (name, c) in tensors() {
        let p = 1e-3 * c.norm();
        let hole = PressurisedHole::new(&c, a, p).unwrap();
        for k in 0..12 {
            let theta = 0.1 + PI / 6.0 * k as f64;
            let n = Vector3::new(theta.cos(), theta.sin(), 0.0);
            let traction = hole.stress([a * n.x, a * n.y]) * n;
            assert!((traction + p * n).norm() < 1e-8 * p, "{name}: {traction} {:e}", (traction / p + n).norm());
            let around = Vector3::new(-n.y, n.x, 0.0);
            let hoop = around.dot(&(hole.stress([a * n.x, a * n.y]) * around));
            assert!((hole.hoop_stress(theta) - hoop).abs() < 1e-9 * p);
            // Central differences away from the edge.
            let (x, h) = ([1.5 * a * n.x, 1.5 * a * n.y], 1e-4 * a);
            let at = |i: usize, s: f64| if i == 0 { [x[0] + s * h, x[1]] } else { [x[0], x[1] + s * h] };
            let gradient = hole.gradient(x);
            let mut divergence = Vector3::zeros();
            for i in 0..2 {
                let du = (hole.displacement(at(i, 1.0)) - hole.displacement(at(i, -1.0))) / (2.0 * h);
                assert!((du - gradient.column(i)).norm() < 1e-6 * gradient.norm(), "{name}");
                let ds = (hole.stress(at(i, 1.0)) - hole.stress(at(i, -1.0))) / (2.0 * h);
                divergence += ds.column(i);
            }
            let size = hole.stress(x).norm() / a;
            assert!(divergence.norm() < 1e-5 * size, "{name}: {:e}", divergence.norm() / size);
            // Displacement falls as 1/r, stress as 1/r².
            let far = |r: f64| (hole.displacement([r * n.x, r * n.y]), hole.stress([r * n.x, r * n.y]));
            let ((u1, s1), (u2, s2)) = (far(1e3 * a), far(2e3 * a));
            assert!((2.0 * u2 - u1).norm() < 1e-3 * u1.norm() && (4.0 * s2 - s1).norm() < 1e-3 * s1.norm(), "{name}");
        }
    }
}

/// Energy: the work of the pressure on the edge is twice the strain energy of the medium, integrated.
#[test]
fn work_on_the_edge_is_the_energy_of_the_medium() {
    let (a, p) = (1.0, 1.0);
    let c = rock().rotated(&Random(5).rotation()).scaled(1e-6);
    let hole = PressurisedHole::new(&c, a, p).unwrap();
    let steps = 200;
    let work: f64 = (0..steps)
        .map(|k| {
            let theta = 2.0 * PI * k as f64 / steps as f64;
            let n = Vector3::new(theta.cos(), theta.sin(), 0.0);
            p * n.dot(&hole.displacement([n.x, n.y])) * 2.0 * PI / steps as f64
        })
        .sum();
    // In s = 1/r², dA = ½ ds dθ/s²; the energy density falls as s², so the midpoint rule sees a smooth integrand.
    let mut energy = 0.0;
    for i in 0..60 {
        let s = (i as f64 + 0.5) / 60.0;
        for k in 0..steps {
            let theta = 2.0 * PI * k as f64 / steps as f64;
            let x = [theta.cos() / s.sqrt(), theta.sin() / s.sqrt()];
            let density = 0.5 * hole.stress(x).dot(&hole.gradient(x));
            energy += density * 0.5 / (s * s) / 60.0 * 2.0 * PI / steps as f64;
        }
    }
    assert!((2.0 * energy / work - 1.0).abs() < 2e-3, "{energy} {work}");
}

/// The displacement leaves the section only where the axis does.
#[test]
fn antiplane_displacement_follows_the_axis() {
    let hole = PressurisedHole::new(&rock_in_section(), 1.0, 1e6).unwrap();
    let turned = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.8, 0.6, 0.0, -0.6, 0.8);
    let aslant = PressurisedHole::new(&rock_in_section().rotated(&turned), 1.0, 1e6).unwrap();
    let (u, v) = (hole.displacement([0.6, 0.8]), aslant.displacement([0.6, 0.8]));
    assert!(u.z.abs() < 1e-9 * u.norm(), "{u}");
    assert!(v.z.abs() > 0.01 * v.norm(), "{v}");
}

/// x³ − 8x² + (24 − 16κ)x − 16(1 − κ) = 0, x = (c/c_t)², κ = (c_t/c_l)²: the classical equation, by bisection.
#[test]
fn rayleigh_speed_of_isotropic_media_is_the_classical_root() {
    for nu in [0.0, 0.1, 0.22, 0.25, 0.4, 0.49] {
        let (c, rho) = (isotropic(72e9, nu), 2440.0);
        let ct = (72e9 / (2.0 * (1.0 + nu)) / rho).sqrt();
        let k = (1.0 - 2.0 * nu) / (2.0 - 2.0 * nu);
        let f = |x: f64| x.powi(3) - 8.0 * x * x + (24.0 - 16.0 * k) * x - 16.0 * (1.0 - k);
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let x = 0.5 * (low + high);
            if f(x) < 0.0 { low = x } else { high = x }
        }
        let mut random = Random(3);
        let q = random.rotation();
        let (m, n) = (q.column(0).into_owned(), q.column(1).into_owned());
        let wave = rayleigh_wave(&c, rho, &m, &n).unwrap();
        let speed = wave.speed.unwrap();
        assert!((speed / (ct * low.sqrt()) - 1.0).abs() < 1e-9, "{nu}: {speed} {}", ct * low.sqrt());
        assert!((wave.limiting / ct - 1.0).abs() < 1e-9);
    }
}

/// Cubic crystals on (001) along [100], Stoneley's equation
/// (1 − y C11/C44)·((C11² − C12²)/C11² − y)² = y² (1 − y), y = ρv²/C11.
#[test]
fn rayleigh_speed_of_cubic_crystals_is_stoneleys() {
    for (c11, c12, c44) in [(165.7, 63.9, 79.6), (107.0, 61.0, 28.0), (246.0, 147.0, 124.0)] {
        let mut v = Matrix6::zeros();
        for i in 0..3 {
            for j in 0..3 {
                v[(i, j)] = if i == j { c11 } else { c12 };
            }
            v[(i + 3, i + 3)] = c44;
        }
        let c = Stiffness::from_voigt(&v).unwrap();
        let wave = rayleigh_wave(&c, 1.0, &Vector3::x(), &Vector3::z()).unwrap();
        let y = wave.speed.unwrap().powi(2) / c11;
        let left = (1.0 - y * c11 / c44) * ((c11 * c11 - c12 * c12) / (c11 * c11) - y).powi(2);
        let right = y * y * (1.0 - y);
        assert!((left - right).abs() < 1e-8, "{left} {right}");
    }
}

/// H L − S² = 1 and the symmetries of the products (Ting 1996, section 6.6): properties that hold for every medium.
#[test]
fn barnett_lothe_tensors_have_their_identities() {
    for (name, c) in tensors() {
        let unit = c.norm();
        let b = BarnettLothe::new(&c, 0.0).unwrap();
        assert!((b.s * b.s - b.h * b.l + Matrix3::identity()).norm() < 1e-10, "{name}");
        assert!((b.h - b.h.transpose()).norm() < 1e-10 * b.h.norm(), "{name}");
        assert!((b.l - b.l.transpose()).norm() < 1e-10 * unit, "{name}");
        let sh = b.s * b.h;
        assert!((sh + sh.transpose()).norm() < 1e-10 * sh.norm().max(1e-3 * b.h.norm()), "{name}");
        assert!(b.h.symmetric_eigenvalues().min() > 0.0 && b.l.symmetric_eigenvalues().min() > 0.0);
        let wave = rayleigh_wave(&c, 1.0, &Vector3::x(), &Vector3::y()).unwrap();
        assert!(wave.speed.is_none_or(|v| v < wave.limiting), "{name}: {wave:?}");
        // No faster than the slowest wave along the surface.
        let slowest = c.waves(&Vector3::x(), 1.0).unwrap()[0].speed;
        assert!(wave.limiting <= slowest * (1.0 + 1e-12), "{name}");
    }
}

/// Irwin: G = K²(1 − ν²)/E; the energy of the whole crack is the work of closing it; G is its derivative.
#[test]
fn energy_release_of_a_crack() {
    let (e, nu, a, s) = (72e9, 0.22, 0.01, 2e6);
    let crack = CentreCrack::new(&isotropic(e, nu), a, &Vector3::new(0.0, s, 0.0)).unwrap();
    let k = s * (PI * a).sqrt();
    assert!((crack.energy_release_rate() / (k * k * (1.0 - nu * nu) / e) - 1.0).abs() < 1e-12);
    let exact = 4.0 * (1.0 - nu * nu) * s / e * (a * a - 0.25 * a * a).sqrt();
    assert!((crack.opening(0.5 * a).y / exact - 1.0).abs() < 1e-12);
    for (name, c) in tensors() {
        let t = c.norm() * 1e-3 * Vector3::new(0.3, 1.0, -0.4);
        let energy = |a: f64| {
            let crack = CentreCrack::new(&c, a, &t).unwrap();
            let steps = 4000;
            let width = 2.0 * a / steps as f64;
            (0..steps).map(|k| 0.5 * t.dot(&crack.opening(-a + (k as f64 + 0.5) * width)) * width).sum::<f64>()
        };
        let rate = (energy(1.01) - energy(0.99)) / 0.02;
        let g = CentreCrack::new(&c, 1.0, &t).unwrap().energy_release_rate();
        // Both tips advance.
        assert!((rate / (2.0 * g) - 1.0).abs() < 1e-3, "{name}: {rate} {g}");
    }
}

#[test]
fn bars_and_plates_of_isotropic_media() {
    let (e, nu, rho) = (70e9, 0.3, 2700.0);
    let c = isotropic(e, nu);
    let q = Random(9).rotation();
    let (m, n) = (q.column(0).into_owned(), q.column(1).into_owned());
    assert!((bar_wave(&c, rho, &m).unwrap() / (e / rho).sqrt() - 1.0).abs() < 1e-12);
    let [slow, fast] = plate_waves(&c, rho, &m, &n).unwrap();
    assert!((slow / (e / (2.0 * (1.0 + nu)) / rho).sqrt() - 1.0).abs() < 1e-12);
    assert!((fast / (e / (1.0 - nu * nu) / rho).sqrt() - 1.0).abs() < 1e-12);
    // A bar is softer than a plate, a plate than the bulk, in any medium.
    for (name, c) in tensors() {
        let bar = bar_wave(&c, 1.0, &m).unwrap();
        let plate = plate_waves(&c, 1.0, &m, &n).unwrap();
        let bulk = c.waves(&m, 1.0).unwrap();
        assert!(bar <= plate[1] * (1.0 + 1e-9) && plate[1] <= bulk[2].speed * (1.0 + 1e-9), "{name}");
        assert!(plate[0] > 0.0, "{name}");
    }
}

/// The stress of the displacement, by differences and Hooke's law, is the stress given; the end carries P.
#[test]
fn cantilever_satisfies_hookes_law() {
    let (l, c, p) = (2.0, 0.25, 3e3);
    for plane_strain in [true, false] {
        for tensor in [rock_in_section(), isotropic(1e9, 0.25)] {
            let beam = Cantilever::new(&tensor, l, c, p, plane_strain).unwrap();
            let [a11, a12, a66] = beam.compliance;
            for x in [[0.3, 0.1], [1.2, -0.2], [1.9, 0.0]] {
                let h = 1e-5;
                let (e, w) = (beam.displacement([x[0] + h, x[1]]), beam.displacement([x[0] - h, x[1]]));
                let (n, s) = (beam.displacement([x[0], x[1] + h]), beam.displacement([x[0], x[1] - h]));
                let strain = [e[0] - w[0], n[1] - s[1], n[0] - s[0] + e[1] - w[1]].map(|d| d / (2.0 * h));
                let [s11, s12] = beam.stress(x);
                let wanted = [a11 * s11, a12 * s11, a66 * s12];
                let size = wanted.iter().map(|x| x.abs()).fold(0.0, f64::max);
                assert!(strain.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-6 * size), "{strain:?} {wanted:?}");
            }
            let steps = 1000;
            let width = 2.0 * c / steps as f64;
            let end: f64 = (0..steps).map(|k| beam.stress([l, -c + (k as f64 + 0.5) * width])[1] * width).sum();
            assert!((end / p - 1.0).abs() < 1e-5);
            let inertia = 2.0 * c.powi(3) / 3.0;
            let slender = p * l.powi(3) * a11 / (3.0 * inertia);
            assert!(beam.tip_deflection() > slender && beam.tip_deflection() < 1.2 * slender);
            assert_eq!(beam.displacement([0.0, 0.0]), [0.0, 0.0]);
        }
    }
    // Plane strain of isotropic media: E/(1 − ν²).
    let beam = Cantilever::new(&isotropic(1e9, 0.25), l, c, p, true).unwrap();
    assert!((beam.compliance[0] * 1e9 / (1.0 - 0.0625) - 1.0).abs() < 1e-12);
}

#[test]
fn wrong_input_is_named() {
    let c = rock();
    let told = |e: anisobond::Error, word: &str| assert!(e.to_string().contains(word), "{e}");
    told(PressurisedHole::new(&c, 0.0, 1.0).unwrap_err(), "radius");
    told(PressurisedHole::new(&Stiffness::isotropic(-10.0, 1.0), 1.0, 1.0).unwrap_err(), "positive definite");
    told(rayleigh_wave(&c, 0.0, &Vector3::x(), &Vector3::y()).unwrap_err(), "density");
    told(rayleigh_wave(&c, 1.0, &Vector3::x(), &Vector3::x()).unwrap_err(), "right angles");
    told(CentreCrack::new(&c, -1.0, &Vector3::y()).unwrap_err(), "half length");
    told(bar_wave(&c, 1.0, &Vector3::zeros()).unwrap_err(), "axis");
    told(plate_waves(&c, -1.0, &Vector3::x(), &Vector3::y()).unwrap_err(), "density");
    let aslant = c.rotated(&Random(1).rotation());
    told(Cantilever::new(&aslant, 1.0, 0.1, 1.0, true).unwrap_err(), "couples");
    told(Cantilever::new(&c, 0.0, 0.1, 1.0, true).unwrap_err(), "length");
}

/// K = √(πa) t in any medium: mode I is across the crack, II along it, III along the axis (Irwin 1957).
#[test]
fn stress_intensities_are_those_of_a_crack_in_an_infinite_plate() {
    for (name, c) in tensors() {
        for (a, t) in [(1.0, [0.0, 1.0, 0.0]), (0.02, [0.0, -3e6, 0.0]), (7.0, [2e5, 1e5, -4e5])] {
            let t = Vector3::from(t);
            let crack = CentreCrack::new(&c, a, &t).unwrap();
            let k = crack.stress_intensity();
            assert!((k / (PI * a).sqrt() - t).norm() < 1e-14 * t.norm(), "{name}");
            // G is quadratic in the load and linear in the length.
            let longer = CentreCrack::new(&c, 4.0 * a, &(3.0 * t)).unwrap();
            assert!((longer.stress_intensity() - 6.0 * k).norm() < 1e-12 * k.norm(), "{name}");
            let ratio = longer.energy_release_rate() / crack.energy_release_rate();
            assert!((ratio / 36.0 - 1.0).abs() < 1e-12, "{name}: {ratio}");
        }
    }
}

/// The field u = Re Σ a_α f(z_α) q_α, φ = Re Σ b_α f(z_α) q_α with f = √(z² − a²) and q = B⁻¹ t has no traction on the faces, and
/// t far away (Ting 1996, section 11.1): ahead of a tip its traction is K/√(2πr), behind it is the opening. Its roots are not
/// those of the Barnett-Lothe tensors, which have none.
#[test]
fn stress_intensities_and_openings_are_those_of_strohs_field() {
    let mut tried = 0;
    for (name, c) in tensors() {
        let Some(stroh) = Stroh::new(&c) else { continue };
        tried += 1;
        let (a, t) = (0.3, 1e-3 * c.norm() * Vector3::new(0.4, 1.0, -0.7));
        let crack = CentreCrack::new(&c, a, &t).unwrap();
        let q = stroh.b.try_inverse().unwrap() * t.map(|x| Complex::new(x, 0.0));
        let root = |z: Complex<f64>| (z - a).sqrt() * (z + a).sqrt();
        let at = |x: f64, y: f64| stroh.roots.map(|p| Complex::new(x, 0.0) + p * y);
        let sum =
            |m: &Matrix3<Complex<f64>>, f: [Complex<f64>; 3]| (m * Vector3::from_fn(|k, _| f[k] * q[k])).map(|x| x.re);
        let y = 1e-13 * a;
        for x in [-0.9, -0.3, 0.0, 0.5, 0.99] {
            let faces = [y, -y].map(|y| sum(&stroh.a, at(x * a, y).map(root)));
            let (opening, exact) = (crack.opening(x * a), faces[0] - faces[1]);
            assert!((opening - exact).norm() < 1e-8 * exact.norm(), "{name} at {x}: {opening} {exact}");
            // σ·e₂ = φ,₁.
            let traction = sum(&stroh.b, at(x * a, y).map(|z| z / root(z)));
            assert!(traction.norm() < 1e-8 * t.norm(), "{name} at {x}: {traction}");
        }
        assert_eq!(crack.opening(1.01 * a), Vector3::zeros());
        let far = sum(&stroh.b, at(1e5 * a, 2e5 * a).map(|z| z / root(z)));
        assert!((far - t).norm() < 1e-8 * t.norm(), "{name}");
        let r = 1e-8 * a;
        let traction = sum(&stroh.b, at(a + r, 0.0).map(|z| z / root(z)));
        let k = (2.0 * PI * r).sqrt() * traction;
        assert!((k - crack.stress_intensity()).norm() < 1e-6 * k.norm(), "{name}: {k}");
        // Virtual closing of the last δ: G = lim 1/(2δ) ∫ σ(r)·Δu(δ − r) dr = π/4 √(2/π)² … = ½ K·Δu(δ)/√(8δ/π) (Irwin 1957).
        let behind = crack.opening(a - r);
        let g = 0.5 * k.dot(&behind) / (8.0 * r / PI).sqrt();
        assert!((g / crack.energy_release_rate() - 1.0).abs() < 1e-6, "{name}: {g}");
    }
    assert!(tried > 20, "{tried}");
}

/// Orthotropic media with the crack along an axis (Sih, Paris & Irwin 1965), b_ij = s_ij − s_i3 s_j3/s₃₃ of plane strain:
/// G_I = K_I² √(b₁₁b₂₂/2) √(√(b₂₂/b₁₁) + (2b₁₂ + b₆₆)/2b₁₁), G_II = K_II² b₁₁/√2 √(the same), G_III = ½ K_III² √(s₄₄s₅₅); and
/// as the medium becomes isotropic, Irwin's (1 − ν²)/E (K_I² + K_II²) + (1 + ν)/E K_III².
#[test]
fn energy_release_of_orthotropic_media_is_that_of_sih_paris_and_irwin() {
    let (e, nu) = (10.0, 0.3);
    let mut of_isotropic = Matrix6::zeros();
    for i in 0..3 {
        for j in 0..3 {
            of_isotropic[(i, j)] = if i == j { 1.0 / e } else { -nu / e };
        }
        of_isotropic[(i + 3, i + 3)] = 2.0 * (1.0 + nu) / e;
    }
    let mut change = Matrix6::zeros();
    for (i, j, x) in [(0, 0, -0.05), (1, 1, 0.3), (2, 2, 0.04), (0, 1, 0.02), (0, 2, 0.01), (1, 2, -0.015)] {
        (change[(i, j)], change[(j, i)]) = (x, x);
    }
    (change[(3, 3)], change[(4, 4)], change[(5, 5)]) = (0.4, -0.1, 0.7);
    for part in [1.0, 0.3, 1e-2, 1e-5, 0.0] {
        let s: Matrix6<f64> = of_isotropic + part * change;
        let c = Stiffness::from_compliance_voigt(&s).unwrap();
        let b = |i: usize, j: usize| s[(i, j)] - s[(i, 2)] * s[(j, 2)] / s[(2, 2)];
        let shape = ((b(1, 1) / b(0, 0)).sqrt() + (2.0 * b(0, 1) + b(5, 5)) / (2.0 * b(0, 0))).sqrt();
        let rates = [
            b(0, 0) / 2f64.sqrt() * shape,
            (0.5 * b(0, 0) * b(1, 1)).sqrt() * shape,
            0.5 * (s[(3, 3)] * s[(4, 4)]).sqrt(),
        ];
        for t in [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::new(1.0, -2.0, 0.5)] {
            let crack = CentreCrack::new(&c, 0.7, &t).unwrap();
            let k = crack.stress_intensity();
            let exact: f64 = (0..3).map(|m| k[m] * k[m] * rates[m]).sum();
            assert!((crack.energy_release_rate() / exact - 1.0).abs() < 1e-11, "{part} {t}");
            let irwin = (1.0 - nu * nu) / e * (k.x * k.x + k.y * k.y) + (1.0 + nu) / e * k.z * k.z;
            // Linear in what is left of the anisotropy.
            assert!((exact / irwin - 1.0).abs() <= 6.0 * part + 1e-12, "{part} {t}: {exact} {irwin}");
        }
    }
}
