//! Which components of which nodes are prescribed, and to what.

use nalgebra::Vector3;

use crate::lattice::Body;
use crate::operator::VectorField;
use crate::{Error, Result};

/// Prescribed components of displacement.
#[derive(Clone, Debug, PartialEq)]
pub struct Supports {
    /// Per component, the nodes (ascending) whose displacement is prescribed.
    nodes: [Vec<u32>; 3],
    /// Per component, the prescribed displacement (m) of those nodes.
    values: [Vec<f64>; 3],
}

impl Supports {
    /// Nothing prescribed.
    pub fn none() -> Self {
        Supports { nodes: Default::default(), values: Default::default() }
    }

    /// From (node, displacement in m by component; `None` is free); later entries win.
    ///
    /// # Errors
    /// A node that is outside the grid or empty, or a displacement that is not finite.
    pub fn new(body: &Body, prescribed: impl IntoIterator<Item = (u32, [Option<f64>; 3])>) -> Result<Self> {
        let mut lists: [Vec<(u32, f64)>; 3] = Default::default();
        for (node, value) in prescribed {
            if body.region.get(node as usize).is_none_or(|r| *r == 0) {
                return Err(Error::input(
                    format!("node {node} is prescribed but is no part of the body"),
                    "prescribe nodes of the body only",
                ));
            }
            for a in 0..3 {
                match value[a] {
                    Some(x) if !x.is_finite() => {
                        return Err(Error::input(
                            format!("node {node} is prescribed to a displacement of {x}"),
                            "give a finite displacement",
                        ));
                    }
                    Some(x) => lists[a].push((node, x)),
                    None => {}
                }
            }
        }
        let mut supports = Supports::none();
        for (a, mut list) in lists.into_iter().enumerate() {
            list.sort_by_key(|entry| entry.0);
            for (node, x) in list {
                if supports.nodes[a].last() == Some(&node) {
                    supports.values[a].pop();
                } else {
                    supports.nodes[a].push(node);
                }
                supports.values[a].push(x);
            }
        }
        Ok(supports)
    }

    /// The same nodes and components with all displacements times a factor.
    pub fn scaled(&self, factor: f64) -> Self {
        let mut scaled = self.clone();
        scaled.values.iter_mut().flatten().for_each(|x| *x *= factor);
        scaled
    }

    /// The same nodes and components with what is still missing from a displacement (m).
    pub fn relative_to(&self, u: &VectorField) -> Self {
        let mut rest = self.clone();
        for a in 0..3 {
            for (x, node) in rest.values[a].iter_mut().zip(&self.nodes[a]) {
                *x -= u.components[a][*node as usize];
            }
        }
        rest
    }

    /// Nodes (ascending) of which a component (0, 1, 2) is prescribed.
    pub fn nodes(&self, component: usize) -> &[u32] {
        &self.nodes[component]
    }

    /// Set prescribed entries to their values.
    pub fn impose(&self, u: &mut VectorField) {
        for a in 0..3 {
            for (node, x) in self.nodes[a].iter().zip(&self.values[a]) {
                u.components[a][*node as usize] = *x;
            }
        }
    }

    /// Set prescribed entries to zero.
    pub fn clear(&self, f: &mut VectorField) {
        for a in 0..3 {
            for node in &self.nodes[a] {
                f.components[a][*node as usize] = 0.0;
            }
        }
    }

    /// Whether every prescribed displacement is zero.
    pub fn at_rest(&self) -> bool {
        self.values.iter().flatten().all(|x| *x == 0.0)
    }

    /// Which components of a node are prescribed.
    pub fn fixed(&self, node: usize) -> [bool; 3] {
        std::array::from_fn(|a| self.nodes[a].binary_search(&(node as u32)).is_ok())
    }
}

/// Refuses a load (N) with an entry that is not finite or on an empty node.
pub(super) fn check_load(body: &Body, load: &VectorField) -> Result<()> {
    if load.len() != body.grid.len() {
        return Err(Error::input(
            format!("a load on {} nodes for a grid of {}", load.len(), body.grid.len()),
            "give one force per node of the grid",
        ));
    }
    for node in 0..load.len() {
        let f = load.at(node);
        let bad = !f.iter().all(|x| x.is_finite());
        if bad || (f != Vector3::zeros() && !body.has(node)) {
            let at = body.grid.position(node);
            return Err(Error::input(
                format!(
                    "the force ({:e} {:e} {:e}) N at ({:.6} {:.6} {:.6}) m is {}",
                    f.x,
                    f.y,
                    f.z,
                    at.x,
                    at.y,
                    at.z,
                    if bad { "not finite" } else { "outside the body" }
                ),
                "load nodes of the body with finite forces",
            ));
        }
    }
    Ok(())
}
