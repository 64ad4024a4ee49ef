//! The largest eigenvalue, which the stable step of explicit motion comes from: Δt = 2/√λ of M⁻¹K.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::build::GridBonds;
use super::failing::FailingBonds;
use super::real::Real;
use super::stencil::outer;
use crate::calibration::StrainAverage;
use crate::operator::lanczos::{STEPS, gaussian, lanczos_bound};
use crate::operator::{GridOperator, Kinematics, VectorField};
use crate::{Error, Result};

/// Points along each axis of the sampled zone; even, so that its faces, edges and corners are met.
const SAMPLES: i32 = 12;

/// Samples from which the maximum is refined, and the last step of that, relative to the samples' distance.
const REFINED: usize = 8;
const LAST_STEP: f64 = 1e-5;

/// What a sampled maximum may miss after refinement, relative.
const MISSED: f64 = 1e-8;

/// Nodes of a window, by the reach of the bonds, and Lanczos steps of a body that is shortened to its windows.
const WINDOW: usize = 14;
const STEPS_OF_SHORT: usize = 120;

/// The largest displacement of the differences that stand for a tangent, relative to the grid's spacing.
const DIFFERENCE: f64 = 1e-6;

impl<T: Real> GridBonds<T> {
    /// An upper bound of the largest eigenvalue of M⁻¹K (1/s²), with masses ρΔV from densities (kg/m³) by region
    /// (that of region r is `density[r − 1]`). The step Δt = 2/√λ is stable for linear bonds; [`FailingBonds::tangent_bound`]
    /// is that of a state at finite stretch.
    ///
    /// The smallest of three bounds. Of plane waves: the largest eigenvalue of K(φ) = Σ k (2 − 2 cos φ·o) n⊗n over the Brillouin zone,
    /// k the largest of any stencil; exact for a periodic body of one stencil, and a bound for what is left when bonds of
    /// it are taken away. Of nodes: 2 Σ k n⊗n. Of Lanczos steps (for several stencils or a nodal term): from a random
    /// start, too low with probability 10⁻⁹ (Kuczyński and Woźniakowski 1992, theorem 4.2); in a large body, of its windows
    /// (`between_windows`).
    ///
    /// # Errors
    /// Densities that are missing or not positive.
    pub fn eigenvalue_bound(&self, density: &[f64]) -> Result<f64> {
        let mass = self.masses(density)?;
        let lightest = mass.iter().copied().fold(f64::INFINITY, f64::min);
        let negative = self.stencils.iter().any(|s| s.stiffness.iter().any(|&k| k < 0.0));
        let nodal = self.stencils.iter().any(|s| s.nodal.is_some());
        let whole = self.body.grid.periodic == [true; 3] && self.whole.iter().all(|&w| w);
        let one = self.stencils.len() == 1 && lightest == mass.iter().copied().fold(0.0, f64::max);
        let mut bound = f64::INFINITY;
        if one && whole || !(negative || nodal) {
            bound = self.zone_maximum()? / lightest;
        }
        if let Some(short) = self.shortened_by_windows(negative || nodal)? {
            let mass = short.masses(density)?;
            return Ok(bound.min(short.lanczos(&mass, STEPS_OF_SHORT) + short.between_windows(&mass)));
        }
        if !(one && whole || nodal || negative) {
            let of_node = |i: usize| 2.0 * self.diagonal_block(i).symmetric_eigenvalues().max() / mass[i];
            let nodes = (0..mass.len()).into_par_iter().filter(|&i| self.stencil[i] > 0).map(of_node);
            bound = bound.min(nodes.reduce(|| 0.0, f64::max));
        }
        if self.stencils.len() > 1 || !bound.is_finite() {
            bound = bound.min(self.lanczos(&mass, STEPS));
        }
        Ok(bound)
    }

    /// A bound of the largest eigenvalue of M⁻¹K (1/s²) from so many Lanczos steps.
    fn lanczos(&self, mass: &[f64], steps: usize) -> f64 {
        lanczos_of(mass, steps, |u, f| self.forces(u, f))
    }

    /// The body shortened to its windows, if it has several stencils of bonds alone.
    fn shortened_by_windows(&self, other_terms: bool) -> Result<Option<GridBonds<T>>> {
        match other_terms || self.stencils.len() == 1 {
            true => Ok(None),
            false => self.shortened(self.window()),
        }
    }

    /// Nodes of a window along an axis.
    fn window(&self) -> usize {
        WINDOW * self.half.reach.into_iter().max().unwrap_or(1)
    }

    /// What the largest eigenvalue of M⁻¹K (1/s²) of a body may have above that of its windows, of W nodes along every axis.
    ///
    /// With χ over all places of a window, products of sin πm/(W + 1) for m = 1 … W along each axis, Σ χ² = 1, bonds between nodes
    /// d apart have ψᵀKψ = Σ (χψ)ᵀK(χψ) + ½ Σ ψᵢᵀ kᵢⱼ n⊗n ψⱼ Σ (χᵢ − χⱼ)², and Σ (χᵢ − χⱼ)² ≤ |d|² (2 − 2 cos π/(W + 1)),
    /// d in spacings (Cycon et al. 1987, theorem 3.2: the localization formula of Ismagilov, Morgan, Simon and Sigal).
    fn between_windows(&self, mass: &[f64]) -> f64 {
        let theta = std::f64::consts::PI / (self.window() + 1) as f64;
        let spacing = self.body.grid.spacing;
        let of_node = |i: usize| {
            let mut sum = 0.0;
            self.for_bonds(i, |xi, k, _| sum += k * xi.norm_squared() / spacing.powi(2));
            0.5 * sum * (2.0 - 2.0 * theta.cos()) / mass[i]
        };
        let nodes = (0..mass.len()).into_par_iter().filter(|&i| self.stencil[i] > 0);
        nodes.map(of_node).reduce(|| 0.0, f64::max)
    }

    /// Masses of nodes (kg), infinite where there is none.
    fn masses(&self, density: &[f64]) -> Result<Vec<f64>> {
        let volume = self.body.grid.spacing.powi(3);
        let mut mass = vec![f64::INFINITY; self.stencil.len()];
        for (i, m) in mass.iter_mut().enumerate().filter(|(i, _)| self.stencil[*i] > 0) {
            let region = usize::from(self.body.region[i]);
            let rho = density.get(region - 1).copied().filter(|rho| rho.is_finite() && *rho > 0.0);
            *m = volume
                * rho.ok_or_else(|| {
                    Error::input(
                        format!("region {region} has no positive density"),
                        "motion needs a density everywhere",
                    )
                })?;
        }
        Ok(mass)
    }

    /// Largest eigenvalue of K(φ) (N/m) over the zone, of the largest stiffnesses of all stencils and the first's nodal
    /// term.
    fn zone_maximum(&self) -> Result<f64> {
        let largest = |b: usize| self.stencils.iter().map(|s| s.stiffness[b]).fold(f64::NEG_INFINITY, f64::max);
        let (full, volume) = (&self.half.full, self.body.grid.spacing.powi(3));
        let k: Vec<f64> = full.iter().map(|&b| 0.5 * (largest(b) + largest(self.half.opposite(b)))).collect();
        let nodal = match &self.stencils[0].nodal {
            Some(z) => Some((*z.mandel(), StrainAverage::new(&self.neighbourhood)?)),
            None => None,
        };
        let at = |phases: &Vector3<f64>| {
            let mut matrix = Matrix3::zeros();
            let mut g = Vector3::zeros();
            for (p, &k) in k.iter().enumerate() {
                let phase = phases.dot(&Vector3::from(self.half.offset[p].map(f64::from)));
                matrix += k * (2.0 - 2.0 * phase.cos()) * outer(&self.half.xi[p].normalize());
                if let Some((_, average)) = &nodal {
                    g += 2.0 * phase.sin() * average.gradients()[full[p]];
                }
            }
            if let Some((z, _)) = &nodal {
                let strain = |d: usize| super::hybrid::mandel_of(&(Vector3::ith(d, 1.0) * g.transpose()));
                matrix += volume * Matrix3::from_fn(|i, j| strain(i).dot(&(z * strain(j))));
            }
            matrix.symmetric_eigenvalues().max()
        };
        // Half the zone: K(φ) = K(−φ).
        let step = 2.0 * std::f64::consts::PI / f64::from(SAMPLES);
        let mut found: Vec<(f64, Vector3<f64>)> = Vec::new();
        for i in 0..SAMPLES {
            for j in 0..SAMPLES {
                for k in 0..=SAMPLES / 2 {
                    let phases = step * Vector3::new(f64::from(i), f64::from(j), f64::from(k));
                    found.push((at(&phases), phases));
                }
            }
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        let refined = found.iter().take(REFINED).map(|&(value, phases)| {
            let (mut value, mut phases, mut reach) = (value, phases, 0.5);
            while reach > LAST_STEP {
                let around = (0..27).map(|d| Vector3::new(f64::from(d % 3), f64::from(d / 3 % 3), f64::from(d / 9)));
                let tried = around.map(|d| phases + reach * step * (d - Vector3::repeat(1.0)));
                match tried.map(|phases| (at(&phases), phases)).max_by(|a, b| a.0.total_cmp(&b.0)) {
                    Some(best) if best.0 > value => (value, phases) = best,
                    _ => reach *= 0.5,
                }
            }
            value
        });
        Ok(refined.fold(0.0, f64::max) * (1.0 + MISSED))
    }
}

impl FailingBonds {
    /// An upper bound of the largest eigenvalue of M⁻¹K (1/s²), K the tangent at finite stretch of the bonds as they are at
    /// displacements u (m), with densities as [`GridBonds::eigenvalue_bound`]; by Lanczos steps, too low with probability 10⁻⁹.
    /// The tangent acts as the difference of the forces on both sides of u does.
    ///
    /// # Errors
    /// As [`GridBonds::eigenvalue_bound`].
    pub fn tangent_bound(&self, u: &VectorField, density: &[f64]) -> Result<f64> {
        let mass = self.grid().masses(density)?;
        let spacing = self.body().grid.spacing;
        let (mut moved, mut behind) = (u.clone(), VectorField::zeros(u.len()));
        Ok(lanczos_of(&mass, STEPS, |way, f| {
            let largest = way.components.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
            let h = DIFFERENCE * spacing / largest;
            let mut at = |h: f64, f: &mut VectorField| {
                for (to, (u, w)) in moved.components.iter_mut().zip(u.components.iter().zip(&way.components)) {
                    to.iter_mut().zip(u.iter().zip(w)).for_each(|(to, (u, w))| *to = u + h * w);
                }
                self.forces_of(&moved, Kinematics::Finite, f);
            };
            at(-h, &mut behind);
            at(h, f);
            for (f, b) in f.components.iter_mut().zip(&behind.components) {
                f.iter_mut().zip(b).for_each(|(f, b)| *f = (*f - b) / (2.0 * h));
            }
        }))
    }
}

/// Nodes that are taken together.
const TOGETHER: usize = 1 << 13;

/// A bound from so many Lanczos steps on M^(−1/2) K M^(−1/2), component by component; `forces(u, f)` gives f = −K u.
fn lanczos_of(mass: &[f64], steps: usize, mut forces: impl FnMut(&VectorField, &mut VectorField)) -> f64 {
    let n = mass.len();
    let scale: Vec<f64> = mass.iter().map(|m| if m.is_finite() { m.sqrt().recip() } else { 0.0 }).collect();
    let of = |k: usize| if scale[k % n] > 0.0 { gaussian(3 * (k % n) as u64 + (k / n) as u64) } else { 0.0 };
    let start = (0..3 * n).into_par_iter().map(of).collect();
    let scaled = |from: &[f64], to: &mut [f64], sign: f64| {
        let chunks = to.par_chunks_mut(TOGETHER).zip(from.par_chunks(TOGETHER)).zip(scale.par_chunks(TOGETHER));
        chunks.for_each(|((to, from), scale)| {
            to.iter_mut().zip(from.iter().zip(scale)).for_each(|(to, (x, s))| *to = sign * x * s);
        });
    };
    let (mut u, mut force) = (VectorField::zeros(n), VectorField::zeros(n));
    lanczos_bound(start, steps, |v, w| {
        u.components.iter_mut().zip(v.chunks_exact(n)).for_each(|(u, v)| scaled(v, u, 1.0));
        forces(&u, &mut force);
        force.components.iter().zip(w.chunks_exact_mut(n)).for_each(|(f, w)| scaled(f, w, -1.0));
    })
}
