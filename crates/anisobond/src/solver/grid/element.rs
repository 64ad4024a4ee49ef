//! The trilinear hexahedron of eight nodes: the elements of coarse grids.

use nalgebra::{SMatrix, Vector3};

use crate::tensor::Stiffness;

/// Stiffness matrix K (N/m) of a box-shaped element, split by the face whose forces it gives.
///
/// Local node l = x + 2y + 4z with x, y, z ∈ {0, 1}; degree of freedom 3l + a. Columns are displacements, rows forces.
pub struct ElementStiffness {
    /// Rows of the lower face (z = 0) and of the upper one (z = 1), column by column.
    pub faces: [[[f64; 12]; 24]; 2],
}

impl ElementStiffness {
    /// K = ∫ Bᵀ C B dV over a box of given edges (m), by 2 × 2 × 2 Gauss points, which is exact.
    pub fn new(c: &Stiffness, edges: [f64; 3]) -> Self {
        let mut k = SMatrix::<f64, 24, 24>::zeros();
        let volume: f64 = edges.iter().product();
        let g = 0.5 / 3f64.sqrt();
        for point in 0..8 {
            let at = Vector3::from_fn(|a, _| 0.5 + if point >> a & 1 == 1 { g } else { -g });
            let b = strain_matrix(&at, edges);
            k += b.transpose() * c.mandel() * b * (volume / 8.0);
        }
        let faces = std::array::from_fn(|face| {
            std::array::from_fn(|column| std::array::from_fn(|row| k[(12 * face + row, column)]))
        });
        ElementStiffness { faces }
    }

    /// The 3×3 block K_ll of a local node.
    pub fn diagonal(&self, l: usize) -> [[f64; 3]; 3] {
        std::array::from_fn(|a| std::array::from_fn(|b| self.faces[l / 4][3 * l + b][3 * (l % 4) + a]))
    }

    /// One entry K_rc of the 24 × 24 matrix.
    pub fn entry(&self, row: usize, column: usize) -> f64 {
        self.faces[row / 12][column][row % 12]
    }
}

/// B: Kelvin-Mandel strain of the 24 nodal displacements at a point of the unit box.
fn strain_matrix(at: &Vector3<f64>, edges: [f64; 3]) -> SMatrix<f64, 6, 24> {
    let mut b = SMatrix::zeros();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    for l in 0..8 {
        let upper: [bool; 3] = std::array::from_fn(|a| l >> a & 1 == 1);
        let value: [f64; 3] = std::array::from_fn(|a| if upper[a] { at[a] } else { 1.0 - at[a] });
        let slope: [f64; 3] = std::array::from_fn(|a| if upper[a] { 1.0 } else { -1.0 } / edges[a]);
        let d = [slope[0] * value[1] * value[2], value[0] * slope[1] * value[2], value[0] * value[1] * slope[2]];
        for a in 0..3 {
            b[(a, 3 * l + a)] = d[a];
        }
        for (row, i, j) in [(3, 1, 2), (4, 0, 2), (5, 0, 1)] {
            b[(row, 3 * l + i)] = half * d[j];
            b[(row, 3 * l + j)] = half * d[i];
        }
    }
    b
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A linear displacement costs ½ V ε:C:ε, and a rotation nothing.
    #[test]
    fn energy_of_linear_fields_is_exact() {
        let c = crate::tensor::Material::builtin("KIO3").unwrap().stiffness;
        let edges = [2.0, 3.0, 0.5];
        let k = ElementStiffness::new(&c, edges);
        let gradient = nalgebra::Matrix3::new(1.0, 0.4, -0.2, 0.1, -0.7, 0.3, 0.9, 0.5, 0.2);
        let energy = |h: &nalgebra::Matrix3<f64>| {
            let u: Vec<f64> = (0..8)
                .flat_map(|l| {
                    let x = Vector3::from_fn(|a, _| if l >> a & 1 == 1 { edges[a] } else { 0.0 });
                    (h * x).iter().copied().collect::<Vec<_>>()
                })
                .collect();
            (0..576).map(|n| 0.5 * u[n / 24] * k.entry(n / 24, n % 24) * u[n % 24]).sum::<f64>()
        };
        let strain: nalgebra::Matrix3<f64> = (gradient + gradient.transpose()) * 0.5;
        let mandel = nalgebra::Vector6::from_fn(|a, _| {
            let (i, j) = crate::tensor::PAIRS[a];
            strain[(i, j)] * crate::tensor::mandel_weight(a)
        });
        let exact = 0.5 * 3.0 * mandel.dot(&(c.mandel() * mandel));
        assert!((energy(&gradient) - exact).abs() < 1e-12 * exact);
        assert!(energy(&(gradient - gradient.transpose())).abs() < 1e-12 * exact);
    }
}
