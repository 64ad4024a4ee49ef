//! Which model suits a material: what each reaches, said before any lattice exists.

use nalgebra::Vector3;
use serde::Serialize;

use super::microplane::tangential_projection;
use crate::tensor::Stiffness;
use crate::{Error, Result};

/// Relative size up to which a gap or an eigenvalue is zero.
const EXACT: f64 = 1e-10;

/// Model of the bonds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// Normal bonds.
    Central,
    /// Normal and tangential bonds, nodes that rotate.
    Micropolar,
    /// Normal bonds and a nodal term.
    Hybrid,
}

impl Model {
    /// central, micropolar or hybrid.
    pub fn name(self) -> &'static str {
        match self {
            Model::Central => "central",
            Model::Micropolar => "micropolar",
            Model::Hybrid => "hybrid",
        }
    }
}

/// What one model does for a tensor.
#[derive(Clone, Debug, Serialize)]
pub struct ModelAdvice {
    /// The model.
    pub model: Model,
    /// Whether it can reach the tensor; where the neighbourhood is fine enough.
    pub exact: bool,
    /// The relative error that no sum over bonds undercuts on any neighbourhood (–); `hybrid` has none. With free node
    /// rotations micropolar bonds can come nearer.
    pub least_error: f64,
    /// Numbers of state per node: displacement, and rotation where nodes rotate.
    pub unknowns_per_node: usize,
    /// Floating-point operations per bond and force evaluation, counted from the formulas; a guide, not a measurement.
    pub flops_per_bond: usize,
    /// What it reaches, and what it costs, in words.
    pub explanation: String,
    /// What is known of its stability before a neighbourhood is chosen.
    pub stability: String,
}

/// What the models reach of a tensor, and which one to take.
#[derive(Clone, Debug, Serialize)]
pub struct Advice {
    /// ‖C − S‖/‖C‖, S the Cauchy part (–).
    pub cauchy_gap: f64,
    /// Eigenvalues of the defect D (Pa), ascending: zero if central bonds see all of C.
    pub defect_eigenvalues: [f64; 3],
    /// Whether tangential bonds of stiffness ≥ 0 can carry D: eigenvalues ≥ 0, none above the sum of the others.
    pub triangle_test: bool,
    /// Smallest Kelvin modulus of the Cauchy part (Pa); below zero no central bonds reach it.
    pub cauchy_part_smallest: f64,
    /// Whether it is not below zero.
    pub cauchy_part_positive: bool,
    /// Poisson's ratio of Hill's average (–): ¼ where an isotropic tensor is central, at most ¼ with tangential bonds.
    pub poisson: f64,
    /// Central, micropolar and hybrid.
    pub models: [ModelAdvice; 3],
    /// The simplest model that is exact.
    pub recommended: Model,
    /// Why.
    pub reason: String,
}

/// Advise on a positive definite tensor.
///
/// # Errors
/// A tensor that is not positive definite.
pub fn advise(c: &Stiffness) -> Result<Advice> {
    c.require_positive_definite()?;
    let gap = c.cauchy_gap();
    let defect = ascending(c.cauchy_defect().symmetric_eigenvalues());
    let part = c.cauchy_part().eigen().0[0];
    let zero = EXACT * c.norm();
    let [least, middle, most] = [defect[0], defect[1], defect[2]];
    let triangle = least >= -zero && most <= least + middle + zero;
    let positive = part >= -zero;
    let moduli = c.average_moduli();
    let moduli =
        moduli.ok_or_else(|| Error::input("the stiffness cannot be inverted", "check its components and units"))?;

    let central = central(gap, positive);
    let micropolar = micropolar(c, &defect, triangle, central.exact);
    let models = [central, micropolar, hybrid()];
    let recommended = models.iter().find(|m| m.exact).map_or(Model::Hybrid, |m| m.model);
    Ok(Advice {
        cauchy_gap: gap,
        defect_eigenvalues: defect.into(),
        triangle_test: triangle,
        cauchy_part_smallest: part,
        cauchy_part_positive: positive,
        poisson: moduli.hill_poisson,
        reason: reason(recommended, gap, triangle, positive, &models),
        models,
        recommended,
    })
}

/// Normal bonds: the Cauchy part, if it is positive (Hilbert 1888).
fn central(gap: f64, positive: bool) -> ModelAdvice {
    let exact = gap <= EXACT && positive;
    let reach = match (exact, positive) {
        (true, _) => "reaches the tensor exactly".to_string(),
        (false, true) => format!("reaches the Cauchy part; the error stays at {:.3} % or more", 100.0 * gap),
        (false, false) => format!(
            "not even the Cauchy part is within reach (it has a negative Kelvin modulus); the error stays above {:.3} %",
            100.0 * gap
        ),
    };
    ModelAdvice {
        model: Model::Central,
        exact,
        least_error: gap,
        unknowns_per_node: 3,
        flops_per_bond: 20,
        explanation: format!("{reach}. Three displacements per node, one sweep over the bonds."),
        stability: "bonds ≥ 0: no wave has negative energy, but one may have none where many bonds are zero"
            .to_string(),
    }
}

/// Normal and tangential bonds of stiffness ≥ 0: the triangle test of the defect, here judged without relaxation of
/// the rotations and with the Cauchy part left to the normal bonds.
fn micropolar(c: &Stiffness, defect: &Vector3<f64>, triangle: bool, central_exact: bool) -> ModelAdvice {
    // ‖C − S‖² = 4/3 ‖D‖², so the part of D out of reach costs at least √(4/3) of its norm.
    let least_error = (4.0f64 / 3.0).sqrt() * distance_to_triangle_cone(defect) / c.norm();
    let exact = central_exact || (triangle && tangential_leaves_a_positive_rest(c));
    let reach = match (exact, triangle) {
        (true, _) => "reaches the tensor exactly on a fine enough neighbourhood".to_string(),
        (false, true) => {
            "the defect passes the triangle test, but the normal bonds beside the tangential ones may have to \
                          be negative: the calibration decides"
                .to_string()
        }
        (false, false) => format!(
            "the defect fails the triangle test: the sum of bonds ≥ 0 stays {:.3} % away or more",
            100.0 * least_error
        ),
    };
    ModelAdvice {
        model: Model::Micropolar,
        exact,
        least_error: if triangle { 0.0 } else { least_error },
        unknowns_per_node: 6,
        flops_per_bond: 70,
        explanation: format!(
            "{reach}. This is the sum over bonds; free node rotations relax it, unless the tangential bonds are alike in \
             all directions (promise `free-rotations` aims at the relaxed tensor). Three displacements and three \
             rotations per node, one sweep over the bonds, rotary inertia in dynamics."
        ),
        stability: "bonds ≥ 0: no wave has negative energy, but one may have none where many bonds are zero"
            .to_string(),
    }
}

/// Bonds and nodal term: everything.
fn hybrid() -> ModelAdvice {
    ModelAdvice {
        model: Model::Hybrid,
        exact: true,
        least_error: 0.0,
        unknowns_per_node: 3,
        flops_per_bond: 56,
        explanation: "reaches every positive definite tensor exactly, with positive waves in the form `stable`. Three \
                      displacements per node; a second sweep over the bonds for the averaged strain, and six numbers of \
                      nodal stress per node in between."
            .to_string(),
        stability: "`stable` has Z ⪰ 0 and no bond below a positive floor: every wave has positive energy; `remainder` \
                    keeps the central bonds, and the calibration takes it only where its waves are positive"
            .to_string(),
    }
}

/// Why a model is recommended.
fn reason(model: Model, gap: f64, triangle: bool, positive: bool, models: &[ModelAdvice; 3]) -> String {
    match model {
        Model::Central => {
            "the tensor satisfies Cauchy's relations and its Kelvin moduli are positive: normal bonds are \
                           enough, and cheapest"
                .to_string()
        }
        Model::Micropolar => format!(
            "the Cauchy gap of {:.3} % is a defect that tangential bonds of positive stiffness carry; damage stays in \
             the bonds, at the price of three rotations per node",
            100.0 * gap
        ),
        Model::Hybrid => {
            let cause = match (triangle, positive) {
                (false, true) => "the defect fails the triangle test",
                (true, _) => "the defect passes the triangle test, but the rest is not certain to be a sum of bonds",
                (false, false) => {
                    "the Cauchy part has a negative Kelvin modulus and the defect fails the triangle test"
                }
            };
            format!(
                "{cause}: bonds alone leave {:.3} % (normal) or {:.3} % (with tangential, as a sum) at the least, the nodal term \
                 closes it",
                100.0 * models[0].least_error,
                100.0 * models[1].least_error
            )
        }
    }
}

/// A case in which tangential bonds carry D for certain and leave a tensor that normal bonds reach: tangential bonds
/// along the eigenvectors of D, of weights A = 2 tr(D) 1 − 4 D ⪰ 0 (Σ A (1 − n⊗n)/4 = D), or isotropically spread where
/// D is nearly spherical; the rest must be a positive Cauchy tensor.
fn tangential_leaves_a_positive_rest(c: &Stiffness) -> bool {
    let defect = c.cauchy_defect();
    let eigen = defect.symmetric_eigen();
    let weights = eigen.eigenvalues.map(|d| (2.0 * defect.trace() - 4.0 * d).max(0.0));
    let least = weights.min();
    // T averaged over all directions: (the identity on traceless strains) /5; trace of its defect's A is 1.
    let spread = |part: f64| {
        let mut rest = *c.mandel() - 3.0 * part * least * isotropic_tangential();
        for k in 0..3 {
            let n = eigen.eigenvectors.column(k).into_owned();
            rest -= (weights[k] - part * least) * tangential_projection(&n);
        }
        Stiffness::from_mandel(rest).eigen().0[0] >= -EXACT * c.norm()
    };
    [1.0, 0.5, 0.0].into_iter().any(spread)
}

/// ⟨T⟩ over all directions.
fn isotropic_tangential() -> nalgebra::Matrix6<f64> {
    // ⟨n⊗n⟩ = 1/3 and ⟨N⟩ = (δδ + 2 I)/15, so ⟨T⟩ = I/3 − ⟨N⟩ = I/5 − δ⊗δ/15.
    *Stiffness::isotropic(-1.0 / 15.0, 0.1).mandel()
}

/// Distance of three eigenvalues d from those that tangential bonds carry, dᵢ = (Σ a − aᵢ)/4 with a ≥ 0: the least over
/// the eight faces of the cone.
fn distance_to_triangle_cone(d: &Vector3<f64>) -> f64 {
    let column = |i: usize| Vector3::from_fn(|j, _| if i == j { 0.0 } else { 0.25 });
    let mut best = d.norm();
    for face in 1..8usize {
        let columns: Vec<Vector3<f64>> = (0..3).filter(|i| face >> i & 1 == 1).map(column).collect();
        let matrix = nalgebra::DMatrix::from_fn(3, columns.len(), |i, j| columns[j][i]);
        let Ok(inverse) = matrix.clone().pseudo_inverse(1e-12) else { continue };
        let a = inverse * d;
        if a.iter().all(|&a| a >= 0.0) {
            best = best.min((d - matrix * a).norm());
        }
    }
    best
}

/// Three numbers, ascending.
fn ascending(mut values: Vector3<f64>) -> Vector3<f64> {
    values.as_mut_slice().sort_by(f64::total_cmp);
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tensor::Material;

    /// Isotropic: ν = ¼ is central, below ¼ micropolar, above ¼ hybrid.
    #[test]
    fn isotropic_materials_by_their_poisson_ratio() {
        for (nu, expected) in [
            (-0.5, Model::Micropolar),
            (0.0, Model::Micropolar),
            (0.2, Model::Micropolar),
            (0.25, Model::Central),
            (0.3, Model::Hybrid),
            (0.45, Model::Hybrid),
        ] {
            let g = 30e9;
            let advice = advise(&Stiffness::isotropic(2.0 * g * nu / (1.0 - 2.0 * nu), g)).unwrap();
            assert_eq!(advice.recommended, expected, "{nu}: {advice:?}");
            assert!((advice.poisson - nu).abs() < 1e-12);
        }
    }

    /// The least errors by the defect alone: normal bonds 3.187 … 0.803 %, with tangential ones 1.874 … where the
    /// Cauchy part is no obstacle (it costs CoTeO4 and Te2W a little more: 3.709 and 3.383 %).
    #[test]
    fn least_errors_of_the_built_in_materials() {
        for (name, central, micropolar) in [
            ("KIO3", 3.1873, 1.8736),
            ("CoTeO4", 4.9880, 3.7066),
            ("Te2W", 5.0958, 3.2490),
            ("Ta2C", 2.6320, 2.6320),
            ("Si", 3.8634, 2.2305),
            ("MoN", 1.5335, 1.3548),
            ("Spinel", 0.8028, 0.8028),
        ] {
            let advice = advise(&Material::builtin(name).unwrap().stiffness).unwrap();
            assert_eq!(advice.recommended, Model::Hybrid);
            assert!((100.0 * advice.models[0].least_error - central).abs() < 1e-4, "{name}");
            assert!((100.0 * advice.models[1].least_error - micropolar).abs() < 1e-4, "{name}");
        }
        let glass = advise(&Material::builtin("Pyroceram").unwrap().stiffness).unwrap();
        assert!(glass.recommended == Model::Central && glass.models[0].exact);
    }

    #[test]
    fn the_defect_measures_the_gap() {
        let c = Material::builtin("Te2W").unwrap().stiffness;
        let norm = (4.0f64 / 3.0).sqrt() * c.cauchy_defect().norm() / c.norm();
        assert!((norm - c.cauchy_gap()).abs() < 1e-14);
    }

    #[test]
    fn the_isotropic_mean_of_tangential_bonds() {
        let mean = tangential_projection(&Vector3::x()).trace();
        assert!((isotropic_tangential().trace() - mean).abs() < 1e-15);
    }

    #[test]
    fn indefinite_tensors_are_refused() {
        assert!(advise(&Stiffness::isotropic(-10.0, 1.0)).unwrap_err().to_string().contains("not positive definite"));
    }
}
