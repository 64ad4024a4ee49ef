//! One vector per node of a grid.

use nalgebra::Vector3;

/// One vector per node, component by component, in the grid's numbering. Entries of empty nodes are zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VectorField {
    /// First, second and third components.
    pub components: [Vec<f64>; 3],
}

impl VectorField {
    /// A field of zeros for n nodes.
    pub fn zeros(n: usize) -> Self {
        VectorField { components: [vec![0.0; n], vec![0.0; n], vec![0.0; n]] }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.components[0].len()
    }

    /// Whether there are no nodes.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The vector of a node.
    pub fn at(&self, node: usize) -> Vector3<f64> {
        Vector3::new(self.components[0][node], self.components[1][node], self.components[2][node])
    }

    /// Set the vector of a node.
    pub fn set(&mut self, node: usize, value: &Vector3<f64>) {
        for (component, x) in self.components.iter_mut().zip(value.iter()) {
            component[node] = *x;
        }
    }
}
