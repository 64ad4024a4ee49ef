//! The nodal term (THEORY 6): energy ΔV ½ ε̄:Z:ε̄ of every node, ε̄ the symmetric part of the gradient that fits its
//! unbroken bonds best, H = (Σ ω η⊗ξ) K⁻¹ with K = Σ ω ξ⊗ξ ([`crate::calibration::StrainAverage`]).
//!
//! With finite kinematics E takes the place of ε̄: F̄ = 1 + H, E = ½(F̄ᵀF̄ − 1) = sym(H + ½HᵀH), which no rigid turn changes
//! (THEORY 10; the correspondence form of Silling et al. 2007, section 4, with the first Piola-Kirchhoff stress F̄ (Z:E)).
//!
//! With the pull P = ΔV (Z:ε̄) K⁻¹ of each node, at finite stretch ΔV F̄ (Z:E) K⁻¹, the force on node i is Σ ω (P_i + P_j) ξ
//! over its unbroken bonds: two passes, and no matrix but K⁻¹ differs between bulk, surface and crack.
//!
//! A node with a failed bond has no nodal term any more: the average of fewer bonds may be a larger strain, and a failing bond
//! would set more energy free than there is. What is cut before (pre-cracks) is a surface, and keeps it.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::build::GridBonds;
use super::padded::Padded;
use super::real::Real;
use crate::operator::{Kinematics, VectorField};
use crate::tensor::{PAIRS, mandel_weight};

/// ‖K⁻¹‖ of the bulk relative to a node's, below which the node's bonds leave its strain undefined; it has no nodal term
/// then.
const FLAT: f64 = 1e-6;

/// The symmetric part of a matrix, Kelvin-Mandel.
pub(super) fn mandel_of(m: &Matrix3<f64>) -> Vector6<f64> {
    Vector6::from_fn(|a, _| {
        let (i, j) = PAIRS[a];
        0.5 * (m[(i, j)] + m[(j, i)]) * mandel_weight(a)
    })
}

fn matrix_of(v: &Vector6<f64>) -> Matrix3<f64> {
    let mut m = Matrix3::zeros();
    for a in 0..6 {
        let (i, j) = PAIRS[a];
        m[(i, j)] = v[a] / mandel_weight(a);
        m[(j, i)] = m[(i, j)];
    }
    m
}

/// ε̄ = sym H, or E = sym(H + ½HᵀH), of a gradient H.
fn strain_of(kinematics: Kinematics, h: &Matrix3<f64>) -> Vector6<f64> {
    match kinematics {
        Kinematics::Linear => mandel_of(h),
        Kinematics::Finite => mandel_of(&(h + 0.5 * h.transpose() * h)),
    }
}

impl<T: Real> GridBonds<T> {
    /// Whether any stencil has a nodal term.
    pub fn has_nodal_term(&self) -> bool {
        self.stencils.iter().any(|s| s.nodal.is_some())
    }

    /// Z of a node, Kelvin-Mandel (Pa).
    pub(super) fn nodal_of(&self, node: usize) -> Option<&Matrix6<f64>> {
        if self.torn.get(node).is_some_and(|&torn| torn) {
            return None;
        }
        let s = usize::from(self.stencil[node]).checked_sub(1)?;
        self.stencils[s].nodal.as_ref().map(|z| z.mandel())
    }

    /// K⁻¹ (1/m²) of a node's unbroken bonds; zero where they do not fill space.
    pub(super) fn inverse_shape(&self, node: usize) -> Matrix3<f64> {
        if self.has_all_bonds(node) {
            return self.shape_inverse;
        }
        let mut shape = Matrix3::zeros();
        self.for_ends(node, |p, _, _| shape += self.weight(p) * self.half.xi[p] * self.half.xi[p].transpose());
        self.invert_shape(&shape)
    }

    /// K⁻¹ (1/m²) of K; zero where it is flat.
    pub(super) fn invert_shape(&self, shape: &Matrix3<f64>) -> Matrix3<f64> {
        shape.try_inverse().filter(|i| FLAT * i.norm() < self.shape_inverse.norm()).unwrap_or_default()
    }

    /// Whether a node has all bonds of the neighbourhood, whatever their stencils.
    fn has_all_bonds(&self, node: usize) -> bool {
        let (row, e) = (node / self.row_nodes(), node % self.row_nodes());
        match self.special_place(node) {
            Some(place) => self.surroundings.is_whole(place),
            None => {
                self.whole[row * self.layout.length + e % self.layout.length] || self.degree(row, e) == self.half.bonds
            }
        }
    }

    /// ω of half bond p.
    pub(super) fn weight(&self, p: usize) -> f64 {
        self.neighbourhood.bonds()[self.half.full[p]].influence
    }

    /// H of a node.
    fn gradient(&self, u: &Padded<T>, node: usize) -> Matrix3<f64> {
        self.gradient_of(node, |node| Vector3::from(u.at(node).map(T::f64)))
    }

    /// (Σ ω η⊗ξ) K⁻¹ of a node, η the differences of a field.
    fn gradient_of(&self, node: usize, at: impl Fn(usize) -> Vector3<f64>) -> Matrix3<f64> {
        let here = at(node);
        let mut sum = Matrix3::zeros();
        self.for_ends(node, |p, ahead, other| {
            // ω η⊗ξ is the same whether the bond is seen from here or from its other end.
            let eta = at(other) - here;
            let sign = if ahead { 1.0 } else { -1.0 };
            sum += (sign * self.weight(p)) * eta * self.half.xi[p].transpose();
        });
        sum * self.inverse_shape(node)
    }

    /// P = ΔV (Z:ε̄) K⁻¹ or ΔV F̄ (Z:E) K⁻¹ (N/m) of Σ ω η⊗ξ, and ‖ε̄‖² or ‖E‖² (–).
    pub(super) fn pull_of(
        &self,
        kinematics: Kinematics,
        z: &Matrix6<f64>,
        sum: &Matrix3<f64>,
        inverse: &Matrix3<f64>,
    ) -> (Matrix3<f64>, f64) {
        let h = sum * inverse;
        let strain = strain_of(kinematics, &h);
        let stress = matrix_of(&(z * strain));
        let nominal = match kinematics {
            Kinematics::Linear => stress,
            Kinematics::Finite => stress + h * stress,
        };
        (self.body.grid.spacing.powi(3) * nominal * inverse, strain.norm_squared())
    }

    /// Energy (J) and stress (Pa) of a node's nodal term: Z:ε̄, at finite stretch F̄ (Z:E) F̄ᵀ, the Kirchhoff stress.
    pub(super) fn nodal_state(&self, u: &Padded<T>, kinematics: Kinematics, node: usize) -> (f64, Matrix3<f64>) {
        self.nodal_of(node).map_or((0.0, Matrix3::zeros()), |z| {
            let h = self.gradient(u, node);
            let strain = strain_of(kinematics, &h);
            let stress = z * strain;
            let turned = match kinematics {
                Kinematics::Linear => matrix_of(&stress),
                Kinematics::Finite => {
                    let f = Matrix3::identity() + h;
                    f * matrix_of(&stress) * f.transpose()
                }
            };
            (0.5 * self.body.grid.spacing.powi(3) * stress.dot(&strain), turned)
        })
    }

    /// Change of a node's nodal energy (J) along displacements w (m) of all nodes, at u: ΔV F̄ (Z:E) : H(w).
    pub(super) fn nodal_work(&self, u: &Padded<T>, node: usize, w: (&VectorField, f64)) -> f64 {
        self.nodal_of(node).map_or(0.0, |z| {
            let h = self.gradient(u, node);
            let stress = matrix_of(&(z * strain_of(Kinematics::Finite, &h)));
            let along = w.1 * self.gradient_of(node, |node| w.0.at(node));
            self.body.grid.spacing.powi(3) * (stress + h * stress).dot(&along)
        })
    }

    /// The nodal terms' part of a node's diagonal block of K (N/m): its own and its neighbours'.
    pub(super) fn nodal_block(&self, node: usize) -> Matrix3<f64> {
        let mut block = Matrix3::zeros();
        if !self.has_nodal_term() {
            return block;
        }
        let volume = self.body.grid.spacing.powi(3);
        // Gradients of a node's strain by its displacement and, through the neighbours' K, of theirs by it; several bonds
        // may lead to the same neighbour through periodic faces.
        let mut gradients = vec![(node, Vector3::zeros())];
        self.for_ends(node, |p, ahead, other| {
            let sign = if ahead { 1.0 } else { -1.0 };
            let weighted = (sign * self.weight(p)) * self.half.xi[p];
            gradients[0].1 -= weighted;
            match gradients.iter_mut().find(|(to, _)| *to == other) {
                // From the other end the bond is −ξ.
                Some((_, sum)) => *sum += if other == node { weighted } else { -weighted },
                None => gradients.push((other, -weighted)),
            }
        });
        for (at, gradient) in gradients {
            if let Some(z) = self.nodal_of(at) {
                let g = self.inverse_shape(at) * gradient;
                let strain = |d: usize| mandel_of(&(Vector3::ith(d, 1.0) * g.transpose()));
                block += volume * Matrix3::from_fn(|i, j| strain(i).dot(&(z * strain(j))));
            }
        }
        block
    }

    /// Visit the unbroken bonds of a node: half bond, whether the other end is at +ξ, the other end.
    pub(super) fn for_ends(&self, node: usize, mut visit: impl FnMut(usize, bool, usize)) {
        let (layout, n) = (&*self.layout, self.row_nodes());
        let (row, slot) = (node / n, layout.slot(node % n));
        for (p, &[dx, dy, dz]) in self.half.offset.iter().enumerate() {
            let along = i64::from(dx) * layout.lanes as i64;
            // A bit is set only where both ends exist.
            if self.own_bit(row, node % n, p) {
                let other = layout.element[(slot as i64 + along) as usize] as usize;
                visit(p, true, layout.row_at(row, [dy, dz]) * n + other);
            }
            let (behind, from) = ((slot as i64 - along) as usize, layout.row_at(row, [-dy, -dz]));
            if self.bit_at(from, behind, p) {
                visit(p, false, from * n + layout.element[behind] as usize);
            }
        }
    }
}
