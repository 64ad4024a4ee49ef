//! The symmetry class of a tensor in the sense of energy: distance ‖C^(−½)(P − C)C^(−½)‖/√6 to each class, with the axes and the
//! tensor P of the class that are closest in that sense. Soft directions count as much as stiff ones.

use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Matrix6, Rotation3, Vector3};
use serde::Serialize;

use super::class::SymmetryClass;
use super::closeness::Whitened;
use super::noise::{Noise, named};
use super::stiffness::Stiffness;
use super::symmetry::{Invariants, Symmetry, axes_as_rows, inherited_axes, voigt_as_rows};
use super::turning::{array_of, orthonormal, seen_from};

/// How close a tensor is to one symmetry class, in the sense of energy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct EnergyFit {
    /// The class.
    pub class: SymmetryClass,
    /// ‖C^(−½)(P − C)C^(−½)‖/√6 (–), P the closest tensor of the class: a root mean square of relative errors of energy.
    pub distance: f64,
    /// Rotation whose columns are the class's axes e₁ e₂ e₃ in the given frame (in JSON: three rows, one axis each).
    #[serde(serialize_with = "axes_as_rows")]
    pub axes: Matrix3<f64>,
    /// P, in the given frame (in JSON: Voigt rows, Pa).
    #[serde(serialize_with = "voigt_as_rows")]
    pub closest: Stiffness,
}

/// The symmetry of a tensor in the sense of energy.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EnergySymmetry {
    /// The class that is named.
    pub class: SymmetryClass,
    /// Largest distance accepted for that class.
    pub tolerance: f64,
    /// The noise that the misfits show; `None` where the tolerance was given.
    pub noise: Option<f64>,
    /// All eight classes, from most to least symmetric.
    pub fits: [EnergyFit; 8],
}

impl EnergySymmetry {
    /// The fit of one class.
    pub fn fit(&self, class: SymmetryClass) -> &EnergyFit {
        // ALL, and so `fits`, is in the order of the enum.
        &self.fits[class as usize]
    }
}

impl Stiffness {
    /// The closest tensors of all classes in the sense of energy, found from the axes that are best in the norm; the class by
    /// the tolerance, or without one by the noise that the misfits show ([`Stiffness::symmetry_by_noise`]). `None` unless C is
    /// positive definite.
    pub fn symmetry_in_energy(&self, in_norm: &Symmetry, tolerance: Option<f64>) -> Option<EnergySymmetry> {
        let whitened = Whitened::by(self)?;
        let mut found: Vec<EnergyFit> = Vec::with_capacity(8);
        for norm in in_norm.fits {
            // Also from the axes in which what a smaller class reaches is of this one: distances never grow.
            let inherited = found.iter().flat_map(|smaller| inherited_axes(smaller.class, norm.class, &smaller.axes));
            let starts = inherited.chain([norm.axes]).filter_map(|axes| fit(self, norm.class, &axes));
            let start = starts.min_by(|a, b| a.distance.total_cmp(&b.distance))?;
            found.push(refined(self, &whitened, start)?);
        }
        let fits: [EnergyFit; 8] = found.try_into().ok()?;
        let named = named(&Noise::ENERGY, &fits.map(|fit| fit.distance), tolerance);
        Some(EnergySymmetry { class: named.class, tolerance: named.tolerance, noise: named.noise, fits })
    }
}

/// The closest tensor of a class with given axes.
fn fit(c: &Stiffness, class: SymmetryClass, axes: &Matrix3<f64>) -> Option<EnergyFit> {
    if class == SymmetryClass::Triclinic {
        return Some(EnergyFit { class, distance: 0.0, axes: *axes, closest: *c });
    }
    let seen = seen_from(&array_of(c.mandel()), axes);
    let own = Matrix6::from_fn(|a, b| seen[a][b]);
    let whitened = Whitened::by(&Stiffness::from_mandel(own))?;
    let basis = Invariants::of(class).tensors();
    let units: Vec<Matrix6<f64>> = basis.iter().map(|e| whitened.of(e)).collect();
    let gram = DMatrix::from_fn(basis.len(), basis.len(), |k, l| units[k].dot(&units[l]));
    let right = DVector::from_fn(basis.len(), |k, _| units[k].trace());
    let x = Cholesky::new(gram)?.solve(&right);
    let closest = basis.iter().zip(x.iter()).map(|(e, x)| e * *x).sum::<Matrix6<f64>>();
    let distance = whitened.of(&(closest - own)).norm() / 6.0_f64.sqrt();
    let closest = Stiffness::from_mandel(closest).rotated(axes);
    distance.is_finite().then_some(EnergyFit { class, distance, axes: *axes, closest })
}

/// Most steps of the axes; a handful are used.
const MOST_STEPS: usize = 20;

/// Turn (rad) of the differences that stand for derivatives.
const DIFFERENCE: f64 = 1e-5;

/// The best axes near those of a fit, by Gauss-Newton steps with a damping that grows until the distance falls.
fn refined(c: &Stiffness, whitened: &Whitened, start: EnergyFit) -> Option<EnergyFit> {
    let class = start.class;
    let mut best = start;
    if matches!(class, SymmetryClass::Isotropic | SymmetryClass::Triclinic) {
        return Some(best);
    }
    let residual = |fit: &EnergyFit| {
        let r = whitened.of(&(fit.closest.mandel() - c.mandel()));
        DVector::from_column_slice(r.as_slice())
    };
    let mut damping = 1e-6;
    for _ in 0..MOST_STEPS {
        let here = residual(&best);
        if best.distance < 1e-14 {
            break;
        }
        let turned = |omega: Vector3<f64>| orthonormal(&(Rotation3::new(omega).matrix() * best.axes));
        let mut columns = Vec::with_capacity(3);
        for k in 0..3 {
            let step = Vector3::ith(k, DIFFERENCE);
            let ahead = fit(c, class, &turned(step))?;
            let behind = fit(c, class, &turned(-step))?;
            columns.push((residual(&ahead) - residual(&behind)) / (2.0 * DIFFERENCE));
        }
        let normal = Matrix3::from_fn(|k, l| columns[k].dot(&columns[l]));
        let slope = Vector3::from_fn(|k, _| columns[k].dot(&here));
        let mut better = None;
        for _ in 0..12 {
            let damped = normal + Matrix3::identity() * (damping * normal.trace().max(f64::MIN_POSITIVE));
            let step = -damped.try_inverse()? * slope;
            let trial = fit(c, class, &turned(step)).filter(|t| t.distance < best.distance);
            if trial.is_some() {
                better = trial;
                damping = (damping * 0.1).max(1e-12);
                break;
            }
            damping *= 10.0;
        }
        let Some(next) = better else { break };
        let gained = best.distance - next.distance;
        best = next;
        if gained <= 1e-9 * best.distance {
            break;
        }
    }
    Some(best)
}
