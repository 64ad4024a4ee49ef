//! Shortest waves that cost little: bonds of some materials hardly join neighbouring layers of nodes.
//!
//! A ply's fibres need bonds that are almost all along them, and calibrated bonds across may all span an even number of layers: then
//! motions that turn their sign from layer to layer cost nothing. Coarse grids do not see them, and node blocks do not damp them.
//! Of a field s v with s = ±1 by layer and v smooth, bonds that span an even number see v like any smooth field, and bonds that span an
//! odd number resist v itself. So v lives on coarse grids of its own, with the tensor of the even bonds and springs of the odd ones.

use nalgebra::Matrix3;

use crate::operator::GridOperator;
use crate::tensor::{PAIRS, Stiffness, mandel_weight};

/// Waves that cost less than this share of a node's block are cheap; those of isotropic bodies cost 0.7 and more.
const CHEAP: f64 = 0.1;

/// Eigenvalues above minus this share of the largest are not negative.
const ROUNDING: f64 = 1e-9;

/// What a wave of alternating signs meets in a region's bulk.
pub(super) struct BulkWave {
    /// Tensor of the bonds whose ends have the same sign (Pa).
    pub stiffness: Stiffness,
    /// Springs to ground of a node: 2 Σ k n⊗n over bonds whose ends differ (N/m).
    pub springs: Matrix3<f64>,
    /// The least eigenvalue of the springs over the node's block.
    share: f64,
}

impl BulkWave {
    /// Of a node's bonds (offset, N/m); `None` without bonds, or where some stretch of them has negative energy.
    fn new(bonds: &[([i32; 3], f64)], spacing: f64, signs: [bool; 3]) -> Option<Self> {
        let (mut block, mut springs) = (Matrix3::zeros(), Matrix3::zeros());
        let mut c = nalgebra::Matrix6::zeros();
        for (offset, k) in bonds {
            let xi = nalgebra::Vector3::from(offset.map(f64::from)) * spacing;
            let n = xi.normalize();
            let projector = n * n.transpose() * *k;
            block += projector;
            if (0..3).filter(|a| signs[*a] && offset[*a] % 2 != 0).count() % 2 == 1 {
                springs += 2.0 * projector;
            } else {
                let e = nalgebra::Vector6::from_fn(|a, _| n[PAIRS[a].0] * n[PAIRS[a].1] * mandel_weight(a));
                c += e * e.transpose() * (0.5 * k * xi.norm_squared() / spacing.powi(3));
            }
        }
        let positive = |least: f64, most: f64| least >= -ROUNDING * most;
        let inverse = block.cholesky()?.l().try_inverse()?;
        let shares = (inverse * springs * inverse.transpose()).symmetric_eigenvalues();
        let eigen = c.symmetric_eigenvalues();
        (positive(shares.min(), shares.amax()) && positive(eigen.min(), eigen.amax())).then(|| BulkWave {
            stiffness: Stiffness::from_mandel(c),
            springs,
            share: shares.min(),
        })
    }
}

/// Signs along axes that are coarsened whose waves are cheap in some region, with what they meet in every region.
pub(super) fn cheap_waves(
    operator: &dyn GridOperator,
    regions: u16,
    axes: [bool; 3],
) -> Vec<([bool; 3], Vec<BulkWave>)> {
    let grid = &operator.body().grid;
    let bonds: Vec<_> = (0..regions).map(|region| operator.bulk_bonds(region)).collect();
    let can_turn = |a: usize| axes[a] && !(grid.periodic[a] && grid.nodes[a] % 2 == 1);
    (1..8u8)
        .map(|bits| [0, 1, 2].map(|a| bits >> a & 1 == 1))
        .filter(|signs| (0..3).all(|a| !signs[a] || can_turn(a)))
        .filter_map(|signs| {
            let bulk: Vec<BulkWave> =
                bonds.iter().map(|bonds| BulkWave::new(bonds, grid.spacing, signs)).collect::<Option<_>>()?;
            bulk.iter().any(|b| b.share < CHEAP).then_some((signs, bulk))
        })
        .collect()
}
