//! Along which axes a grid is coarsened, by the strength of the material along each.

use nalgebra::Matrix3;

use crate::tensor::Stiffness;

/// Share of a node's stiffness that neighbours along an axis have in an isotropic body of Poisson's ratio 1/4.
const ISOTROPIC: f64 = 0.2;

/// The axes along which a grid is coarsened, and how well its nodes' blocks damp what the coarser grid does not see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Coarsening {
    /// The axes.
    pub axes: [bool; 3],
    /// Least share of a node's stiffness in any direction of motion that its neighbours along a coarsened axis have, beside
    /// that of an isotropic body; 1 at most.
    pub share: f64,
}

impl Coarsening {
    /// Of materials (Pa) on a grid with these edges (m), among the axes that can be coarsened. To leave an axis as it is must
    /// gain a factor `price`.
    ///
    /// A wave that only an axis coarsened resolves costs, per unit of a node's block D = Σ A_a with A_a = n_a·C·n_a/h_a², at least the
    /// smallest eigenvalue of D⁻¹A_a. Where that is small, node blocks damp it badly, and the axis is better left as it is
    /// (semi-coarsening: Mulder 1989, J. Comput. Phys. 83, 303).
    pub fn new(tensors: &[Stiffness], edges: [f64; 3], possible: [bool; 3], price: f64) -> Self {
        let worst = |axes: [bool; 3]| -> f64 {
            tensors.iter().map(|c| least_share(c, edges, possible, axes)).fold(ISOTROPIC, f64::min) / ISOTROPIC
        };
        let mut best = Coarsening { axes: possible, share: worst(possible) };
        let mut most = best.share;
        for subset in 1..7u8 {
            let axes = [0, 1, 2].map(|a| subset >> a & 1 == 1 && possible[a]);
            let left = (0..3).filter(|a| possible[*a] && !axes[*a]).count() as i32;
            if left == 0 || axes == [false; 3] {
                continue;
            }
            let share = worst(axes);
            if share / price.powi(left) > most {
                most = share / price.powi(left);
                best = Coarsening { axes, share };
            }
        }
        best
    }
}

/// The smallest eigenvalue of D⁻¹A_a over the axes a.
fn least_share(c: &Stiffness, edges: [f64; 3], possible: [bool; 3], axes: [bool; 3]) -> f64 {
    let along = [0, 1, 2].map(|a| Matrix3::from_fn(|i, k| c.component(i, a, k, a) / (edges[a] * edges[a])));
    let whole: Matrix3<f64> = (0..3).filter(|a| possible[*a]).map(|a| along[a]).sum();
    let Some(cholesky) = whole.cholesky() else { return 0.0 };
    let inverse = cholesky.l().try_inverse().unwrap_or_else(Matrix3::zeros);
    let share = |a: usize| (inverse * along[a] * inverse.transpose()).symmetric_eigenvalues().min().max(0.0);
    (0..3).filter(|a| axes[*a]).map(share).fold(1.0, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tensor::Material;

    /// Isotropic bodies are coarsened along all axes, layers of Te2W (normal y) within them first, and then, where edges are four
    /// times as long, across them.
    #[test]
    fn stiff_axes_first() {
        let all = [true; 3];
        let steel = Coarsening::new(&[Stiffness::isotropic(40e9, 40e9)], [1.0; 3], all, 3.0);
        assert_eq!((steel.axes, steel.share), (all, 1.0));
        let layers = [Material::builtin("Te2W").unwrap().stiffness];
        let first = Coarsening::new(&layers, [1.0; 3], all, 3.0);
        assert_eq!(first.axes, [true, false, true]);
        assert!((first.share - 1.0 / 6.0 / ISOTROPIC).abs() < 1e-12);
        let later = Coarsening::new(&layers, [4.0, 1.0, 4.0], all, 1.5);
        assert_eq!(later.axes, [false, true, false]);
        assert_eq!(Coarsening::new(&layers, [1.0; 3], [true, true, false], 3.0).axes, [true, false, false]);
    }
}
