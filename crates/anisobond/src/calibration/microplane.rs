//! Direction-dependent moduli E_N(n), E_T(n) (microplane model) and the stiffness they add up to.
//!
//! C = (3/2π) ∫ (E_N N + E_T T) dΩ = 6 ⟨E_N N + E_T T⟩, ⟨·⟩ the mean over all directions (S eq-stiff-integral). With the
//! elliptic interpolation E(n) = w Eᵃ + (1 − w) Eᵇ, w = |a×n|², the integral is the closed matrix form of S
//! eq-Celliptic, and its inverse is exact.

use nalgebra::{Matrix3, Matrix3x6, Matrix4, Matrix6, Vector3, Vector4, Vector6};
use serde::Serialize;

use super::elliptic_range::refusal;
use super::sphere_rule::SphereRule;
use crate::tensor::{PAIRS, Stiffness, SymmetryClass, mandel_weight, row_of};
use crate::{Error, Result};

/// N = n⊗n⊗n⊗n as a Kelvin-Mandel matrix; n a unit vector.
pub fn normal_projection(n: &Vector3<f64>) -> Matrix6<f64> {
    let nn = Vector6::from_fn(|a, _| n[PAIRS[a].0] * n[PAIRS[a].1] * mandel_weight(a));
    nn * nn.transpose()
}

/// T = Tᵀ·T of S: T_ijkl = ¼(n_j n_k δ_il + n_j n_l δ_ik + n_i n_k δ_jl + n_i n_l δ_jk) − n_i n_j n_k n_l, as a
/// Kelvin-Mandel matrix; n a unit vector. ε:T:ε is the square of the part of ε·n that is tangential to n.
pub fn tangential_projection(n: &Vector3<f64>) -> Matrix6<f64> {
    let traction = strain_times(n);
    traction.transpose() * traction - normal_projection(n)
}

/// The 3×6 matrix of ε → ε·n for ε in Kelvin-Mandel coordinates.
fn strain_times(n: &Vector3<f64>) -> Matrix3x6<f64> {
    Matrix3x6::from_fn(|i, a| {
        let (p, q) = PAIRS[a];
        let scale = mandel_weight(a) / if p == q { 1.0 } else { 2.0 };
        let mut sum = if i == p { n[q] } else { 0.0 };
        if p != q && i == q {
            sum += n[p];
        }
        scale * sum
    })
}

/// Moduli of a microplane of normal n: anything that knows E_N and E_T for a direction.
///
/// Implemented by [`EllipticMicroplane`] and by every closure `Fn(&Vector3<f64>) -> (f64, f64)`.
pub trait DirectionModuli {
    /// (E_N, E_T) (Pa) of the direction n (unit vector); the same for n and −n.
    fn moduli(&self, n: &Vector3<f64>) -> (f64, f64);
}

impl<F: Fn(&Vector3<f64>) -> (f64, f64)> DirectionModuli for F {
    fn moduli(&self, n: &Vector3<f64>) -> (f64, f64) {
        self(n)
    }
}

/// C = 6 ⟨E_N N + E_T T⟩ (Pa) by a quadrature rule on the sphere (S eq-stiff-integral). Exact when E_N and E_T are
/// polynomials of degree p in n and the rule integrates degree p + 4.
pub fn microplane_stiffness(moduli: &impl DirectionModuli, rule: SphereRule) -> Stiffness {
    let mut sum = Matrix6::zeros();
    for (n, weight) in rule.points() {
        let (en, et) = moduli.moduli(&n);
        sum += weight * (en * normal_projection(&n) + et * tangential_projection(&n));
    }
    Stiffness::from_mandel(6.0 * sum)
}

/// The four independent constants of the elliptic interpolation (Pa), axis e₃; C44 follows from them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[allow(missing_docs)] // The usual names.
pub struct TransverseConstants {
    pub c11: f64,
    pub c33: f64,
    pub c13: f64,
    pub c12: f64,
}

/// Names of the constants, in the order of [`TransverseConstants`].
const CONSTANTS: [&str; 4] = ["C11", "C33", "C13", "C12"];
/// Names of the moduli, in the order of [`EllipticModuli`].
const MODULI: [&str; 4] = ["E_N^a", "E_N^b", "E_T^a", "E_T^b"];

impl TransverseConstants {
    /// C44 = ¼C11 + ¼C33 − ½C13 (S eq-C44-dep) (Pa).
    pub fn dependent_c44(&self) -> f64 {
        0.25 * self.c11 + 0.25 * self.c33 - 0.5 * self.c13
    }

    /// The tensor with the dependent C44 and axis a (unit vector) (Pa).
    pub fn stiffness(&self, axis: &Vector3<f64>) -> Stiffness {
        let mut voigt = Matrix6::zeros();
        let c44 = self.dependent_c44();
        let diagonal = [self.c11, self.c11, self.c33, c44, c44, 0.5 * (self.c11 - self.c12)];
        for (a, c) in diagonal.into_iter().enumerate() {
            voigt[(a, a)] = c;
        }
        for (i, j, c) in [(0, 1, self.c12), (0, 2, self.c13), (1, 2, self.c13)] {
            voigt[(i, j)] = c;
            voigt[(j, i)] = c;
        }
        let weights = Matrix6::from_fn(|a, b| voigt[(a, b)] * mandel_weight(a) * mandel_weight(b));
        Stiffness::from_mandel(weights).rotated(&frame(axis))
    }

    fn vector(&self) -> Vector4<f64> {
        Vector4::new(self.c11, self.c33, self.c13, self.c12)
    }

    /// For each of C11, C33, C13, C12: the admissible value of that constant alone which is nearest to the given one
    /// (Pa), the other three kept; `None` where no value of it makes all four moduli non-negative.
    pub fn nearest_admissible(&self) -> [Option<f64>; 4] {
        let inverse = inverse_of_a();
        let c = self.vector();
        let scale = c.amax();
        std::array::from_fn(|k| {
            // Row i: Σ A⁻¹_ij c_j ≥ 0 bounds c_k from one side.
            let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
            for i in 0..4 {
                let slope = inverse[(i, k)];
                let bound = c[k] - (inverse.row(i) * c)[0] / slope;
                if slope > 0.0 { low = low.max(bound) } else { high = high.min(bound) }
            }
            (low <= high + ROUNDING * scale).then(|| c[k].min(high).max(low))
        })
    }
}

/// A negative modulus of this share of the largest constant is rounding and counts as zero.
const ROUNDING: f64 = 1e-12;

/// A of S eq-Celliptic-compact: (C11, C33, C13, C12)ᵀ = A (E_N^a, E_N^b, E_T^a, E_T^b)ᵀ.
#[rustfmt::skip]
fn a() -> Matrix4<f64> {
    Matrix4::new(
        36.0,  6.0,  20.0,  8.0,
        12.0, 30.0,  16.0, 12.0,
         8.0,  6.0,  -8.0, -6.0,
        12.0,  2.0, -12.0, -2.0,
    ) / 35.0
}

/// A⁻¹ of S eq-Eelliptic-compact, exactly.
#[rustfmt::skip]
fn inverse_of_a() -> Matrix4<f64> {
    Matrix4::new(
         0.75, -0.25,  0.25,  0.75,
        -0.5,   1.0,   1.5,  -0.5,
         0.75, -0.25,  1.5,  -3.0,
        -0.5,   1.0,  -6.0,   4.5,
    )
}

/// Elliptic moduli (Pa): in the plane normal to the axis (a) and along the axis (b).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct EllipticModuli {
    /// E_N^a (Pa): normal modulus of directions in the plane.
    pub en_a: f64,
    /// E_N^b (Pa): normal modulus of the axis.
    pub en_b: f64,
    /// E_T^a (Pa): tangential modulus of directions in the plane.
    pub et_a: f64,
    /// E_T^b (Pa): tangential modulus of the axis.
    pub et_b: f64,
}

impl EllipticModuli {
    /// ℰ = A⁻¹ 𝒞 (S eq-Eelliptic-compact); see [`EllipticModuli::admissible`] for the check of signs.
    pub fn from_constants(c: &TransverseConstants) -> Self {
        let e = inverse_of_a() * c.vector();
        EllipticModuli { en_a: e[0], en_b: e[1], et_a: e[2], et_b: e[3] }
    }

    /// The same, refused unless every modulus is non-negative.
    ///
    /// # Errors
    /// A constant that is not finite, or a negative modulus: the message names it and, for each constant, the nearest
    /// value of that constant alone that is admissible.
    pub fn admissible(c: &TransverseConstants) -> Result<Self> {
        let constants = c.vector();
        for (name, value) in CONSTANTS.iter().zip(constants.iter()) {
            if !value.is_finite() {
                return Err(Error::input(format!("{name} is {value}"), "give a finite number"));
            }
        }
        let moduli = Self::from_constants(c);
        let floor = -ROUNDING * constants.amax();
        let negative: Vec<String> = MODULI
            .iter()
            .zip(moduli.as_array())
            .filter(|(_, e)| *e < floor)
            .map(|(name, e)| format!("{name} = {:.6} MPa", 1e-6 * e))
            .collect();
        if negative.is_empty() {
            let [en_a, en_b, et_a, et_b] = moduli.as_array().map(|e| e.max(0.0));
            return Ok(EllipticModuli { en_a, en_b, et_a, et_b });
        }
        let megapascals = |name: &str, value: f64| format!("{name} = {} MPa", value.round() / 1e6);
        let given: Vec<String> = CONSTANTS.iter().zip(constants.iter()).map(|(n, v)| megapascals(n, *v)).collect();
        let ways: Vec<String> = CONSTANTS
            .iter()
            .zip(c.nearest_admissible())
            .filter_map(|(name, value)| Some(megapascals(name, value?)))
            .collect();
        let remedy = if ways.is_empty() {
            "no change of one constant alone makes it admissible; the material is too far from what normal and \
             tangential bonds can do"
                .to_string()
        } else {
            format!("change one constant alone to the nearest that is admissible: {}", ways.join(", or "))
        };
        Err(Error::input(
            format!(
                "the elliptic interpolation needs a negative modulus for these constants: {} ({})",
                negative.join(", "),
                given.join(", ")
            ),
            remedy,
        ))
    }

    /// 𝒞 = A ℰ (S eq-Celliptic-compact).
    pub fn constants(&self) -> TransverseConstants {
        let c = a() * Vector4::from(self.as_array());
        TransverseConstants { c11: c[0], c33: c[1], c13: c[2], c12: c[3] }
    }

    /// The moduli times a number: E′ = E/μ is `scaled(1/μ)`.
    pub fn scaled(&self, factor: f64) -> Self {
        let [en_a, en_b, et_a, et_b] = self.as_array().map(|e| factor * e);
        EllipticModuli { en_a, en_b, et_a, et_b }
    }

    /// (E_N^a, E_N^b, E_T^a, E_T^b).
    pub fn as_array(&self) -> [f64; 4] {
        [self.en_a, self.en_b, self.et_a, self.et_b]
    }
}

/// Elliptic moduli about an axis: E(n) = w Eᵃ + (1 − w) Eᵇ, w = |a×n|² = sin²θ (S eqs eq-Ent-w, eq-w-elliptic).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EllipticMicroplane {
    /// The four moduli.
    pub moduli: EllipticModuli,
    /// The anisotropy axis a, a unit vector.
    pub axis: Vector3<f64>,
}

impl EllipticMicroplane {
    /// The closed form of its integral (Pa), S eq-Celliptic.
    pub fn stiffness(&self) -> Stiffness {
        self.moduli.constants().stiffness(&self.axis)
    }

    /// The same with all moduli times a number.
    pub fn scaled(&self, factor: f64) -> Self {
        EllipticMicroplane { moduli: self.moduli.scaled(factor), axis: self.axis }
    }
}

impl DirectionModuli for EllipticMicroplane {
    fn moduli(&self, n: &Vector3<f64>) -> (f64, f64) {
        let w = self.axis.cross(n).norm_squared();
        let e = &self.moduli;
        (w * e.en_a + (1.0 - w) * e.en_b, w * e.et_a + (1.0 - w) * e.et_b)
    }
}

/// A stiffness seen as elliptic moduli about an axis, and what is lost by it.
#[derive(Clone, Copy, Debug)]
pub struct EllipticFit {
    /// The moduli and their axis.
    pub microplane: EllipticMicroplane,
    /// C11, C33, C13, C12 (Pa) of the closest transversely isotropic tensor, in axes whose third is the axis.
    pub constants: TransverseConstants,
    /// C44 (Pa) of that tensor; the interpolation cannot follow it.
    pub given_c44: f64,
    /// C44 (Pa) that the interpolation has instead: ¼C11 + ¼C33 − ½C13.
    pub dependent_c44: f64,
    /// ‖C − C_TI‖/‖C‖: what is left of the tensor beside its closest transversely isotropic one about this axis.
    pub distance: f64,
    /// What is prescribed to the lattice: the four constants with the dependent C44, in the given frame.
    pub prescribed: Stiffness,
}

impl EllipticFit {
    /// The elliptic moduli of the transversely isotropic tensor closest to C about an axis (any length but zero).
    ///
    /// # Errors
    /// An axis without direction; moduli that are not admissible ([`EllipticModuli::admissible`]).
    pub fn new(c: &Stiffness, axis: &Vector3<f64>) -> Result<Self> {
        let axis = unit_axis(axis)?;
        let q = frame(&axis);
        let seen = c.rotated(&q.transpose());
        let closest = SymmetryClass::TransverselyIsotropic.project(&seen);
        let v = closest.voigt();
        let constants = TransverseConstants { c11: v[(0, 0)], c33: v[(2, 2)], c13: v[(0, 2)], c12: v[(0, 1)] };
        let moduli = EllipticModuli::admissible(&constants).map_err(|e| refusal(e, &constants, v[(3, 3)], &axis))?;
        Ok(EllipticFit {
            microplane: EllipticMicroplane { moduli, axis },
            constants,
            given_c44: v[(3, 3)],
            dependent_c44: constants.dependent_c44(),
            distance: seen.relative_error(&closest),
            prescribed: constants.stiffness(&axis),
        })
    }
}

/// A vector of length one along an axis.
///
/// # Errors
/// An axis of length zero or with a number that is not finite.
pub fn unit_axis(axis: &Vector3<f64>) -> Result<Vector3<f64>> {
    let largest = axis.amax();
    if !(axis.iter().all(|x| x.is_finite()) && largest > 0.0) {
        return Err(Error::input(
            format!("the axis ({}, {}, {}) has no direction", axis.x, axis.y, axis.z),
            "give three finite numbers, not all zero",
        ));
    }
    // Divided by its largest component first, so that no square over- or underflows.
    Ok((axis / largest).normalize())
}

/// The anisotropy axis of strike α and dip β (radians): a = (cos α sin β, −sin α sin β, cos β).
///
/// # Errors
/// An angle that is not finite.
pub fn axis_of_strike_and_dip(strike: f64, dip: f64) -> Result<Vector3<f64>> {
    if !(strike.is_finite() && dip.is_finite()) {
        return Err(Error::input(format!("strike {strike} and dip {dip} rad"), "give two finite angles"));
    }
    Ok(Vector3::new(strike.cos() * dip.sin(), -strike.sin() * dip.sin(), dip.cos()))
}

/// A right-handed frame whose third axis is n (unit).
fn frame(n: &Vector3<f64>) -> Matrix3<f64> {
    let least = n.iamin();
    let e = Vector3::from_fn(|i, _| if i == least { 1.0 } else { 0.0 });
    let x = (e - n * n.dot(&e)).normalize();
    Matrix3::from_columns(&[x, n.cross(&x), *n])
}

/// E·L for a strain in Kelvin-Mandel coordinates.
pub(crate) fn strain_dot(strain: &Vector6<f64>, branch: &Vector3<f64>) -> Vector3<f64> {
    Vector3::from_fn(|i, _| {
        (0..3)
            .map(|j| {
                let a = row_of(i, j);
                strain[a] / mandel_weight(a) * branch[j]
            })
            .sum()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROCK: TransverseConstants = TransverseConstants { c11: 130e6, c33: 55e6, c13: 28e6, c12: 40e6 };

    #[test]
    fn the_inverse_is_exact() {
        assert!((a() * inverse_of_a() - Matrix4::identity()).amax() < 1e-15);
        let back = EllipticModuli::from_constants(&ROCK).constants();
        assert!((back.vector() - ROCK.vector()).amax() < 1e-6);
    }

    #[test]
    fn the_document_s_rock() {
        let e = EllipticModuli::admissible(&ROCK).unwrap();
        for (ours, expected) in e.as_array().into_iter().zip([120.75e6, 12e6, 5.75e6, 2e6]) {
            assert!((ours - expected).abs() < 1e-3, "{ours} {expected}");
        }
        assert!((ROCK.dependent_c44() - 32.25e6).abs() < 1e-6);
    }

    #[test]
    fn inadmissible_constants_are_named_with_their_remedies() {
        let message = EllipticModuli::admissible(&TransverseConstants { c12: 39.5e6, ..ROCK }).unwrap_err().to_string();
        assert!(message.contains("E_T^b = -0.25"), "{message}");
        assert!(!message.contains("E_N^a ="), "{message}");
        assert!(message.contains("C12 = 39.555556"), "{message}");
        let nearest = TransverseConstants { c12: 39.5e6, ..ROCK }.nearest_admissible();
        for (k, value) in nearest.into_iter().enumerate() {
            let mut c = [130e6, 55e6, 28e6, 39.5e6];
            c[k] = value.unwrap();
            let [c11, c33, c13, c12] = c;
            let e = EllipticModuli::admissible(&TransverseConstants { c11, c33, c13, c12 }).unwrap();
            assert!(e.as_array().iter().copied().fold(f64::INFINITY, f64::min) < 1.0, "on the border");
        }
        assert!(EllipticModuli::admissible(&TransverseConstants { c12: f64::NAN, ..ROCK }).is_err());
        let hopeless = TransverseConstants { c11: 1e6, c33: 1e6, c13: -3e6, c12: 20e6 };
        assert!(hopeless.nearest_admissible().iter().any(Option::is_none));
    }

    #[test]
    fn quadrature_is_the_closed_form_about_any_axis() {
        for axis in [Vector3::z(), Vector3::new(1.0, -2.0, 0.3), Vector3::new(0.0, 1e-200, 0.0)] {
            let microplane = EllipticMicroplane {
                moduli: EllipticModuli::admissible(&ROCK).unwrap(),
                axis: unit_axis(&axis).unwrap(),
            };
            for rule in [SphereRule::Lebedev26, SphereRule::Lebedev50, SphereRule::GaussProduct { degree: 6 }] {
                let c = microplane_stiffness(&microplane, rule);
                assert!(microplane.stiffness().relative_error(&c) < 1e-14, "{rule:?}");
            }
            let coarse = microplane_stiffness(&microplane, SphereRule::Lebedev14);
            assert!(microplane.stiffness().relative_error(&coarse) > 1e-3, "degree 5 cannot be exact");
        }
    }

    #[test]
    fn constant_moduli_are_isotropic() {
        let c = microplane_stiffness(&|_: &Vector3<f64>| (7.0, 3.0), SphereRule::Lebedev14);
        let expected = Stiffness::isotropic((2.0 * 7.0 - 2.0 * 3.0) / 5.0, (2.0 * 7.0 + 3.0 * 3.0) / 5.0);
        assert!(expected.relative_error(&c) < 1e-14);
    }

    #[test]
    fn a_tilted_tensor_gives_its_constants_back() {
        let axis = axis_of_strike_and_dip(270f64.to_radians(), 25f64.to_radians()).unwrap();
        assert!((axis - Vector3::new(0.0, 25f64.to_radians().sin(), 25f64.to_radians().cos())).norm() < 1e-15);
        let c = ROCK.stiffness(&axis);
        let fit = EllipticFit::new(&c, &(-3.0 * axis)).unwrap();
        assert!(fit.distance < 1e-14 && (fit.constants.vector() - ROCK.vector()).amax() < 1e-6);
        assert!(c.relative_error(&fit.prescribed) < 1e-14);
        assert!((fit.given_c44 - fit.dependent_c44).abs() < 1e-6);
        let far = EllipticFit::new(&c, &Vector3::z()).unwrap();
        assert!(far.distance > 0.01);
        assert!(EllipticFit::new(&c, &Vector3::zeros()).is_err());
    }

    #[test]
    fn the_tangential_projection_is_its_index_formula() {
        let n = Vector3::new(0.3, -0.5, 0.7).normalize();
        let t = Stiffness::from_mandel(tangential_projection(&n));
        let delta = |i, j| if i == j { 1.0 } else { 0.0 };
        for (i, j, k, l) in (0..81).map(|m| (m / 27, m / 9 % 3, m / 3 % 3, m % 3)) {
            let expected = 0.25
                * (n[j] * n[k] * delta(i, l)
                    + n[j] * n[l] * delta(i, k)
                    + n[i] * n[k] * delta(j, l)
                    + n[i] * n[l] * delta(j, k))
                - n[i] * n[j] * n[k] * n[l];
            assert!((t.component(i, j, k, l) - expected).abs() < 1e-15);
        }
    }
}
