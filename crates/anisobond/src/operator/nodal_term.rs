//! The nodal term of a network: what bonds cannot reach, carried by the average strain of every node.
//!
//! Energy Σ_i ½ V_i ε̄_i:Z:ε̄_i with ε̄_i = sym Σ ω η⊗K_i⁻¹ξ over the bonds ξ of node i, η = u_B − u_A + E ξ their relative
//! displacement and K_i = Σ ω ξ⊗ξ: the least-squares strain (Silling et al. 2007, eqs 12-14 and 36). A bond seen from its
//! other end changes the sign of ξ and of η, so that both ends add the same.

use nalgebra::{Matrix3, Matrix6, Matrix6x3, Vector3, Vector6};

use super::bond_list::{NodeField, StiffBond};
use crate::tensor::{PAIRS, Stiffness, mandel_weight};
use crate::{Error, Result};

/// Smallest eigenvalue of K_i, relative to the largest, from which the bonds of a node count as filling space. Below,
/// the average strain across their plane is the bonds' scatter magnified.
const FLAT: f64 = 1e-3;

const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// A nodal term: Z, where it acts and how strains are averaged.
#[derive(Clone, Debug)]
pub struct NodalTerm {
    /// Z (Pa).
    pub stiffness: Stiffness,
    /// V_i (m³) of every node. A node whose bonds lie in a plane has no average strain: it counts for nothing.
    pub volumes: Vec<f64>,
    /// ω (any unit) of every bond.
    pub weights: Vec<f64>,
}

impl NodalTerm {
    /// The term whose volumes fill V (m³): given shares (any unit) of every node, zero for a node whose bonds lie in a
    /// plane, scaled to Σ V_i = V.
    ///
    /// # Errors
    /// Lists of the wrong length, negative or not finite; no node with an average strain.
    pub fn filling(
        stiffness: &Stiffness,
        bonds: &[StiffBond],
        volume: f64,
        shares: &[f64],
        weights: Vec<f64>,
    ) -> Result<Self> {
        let mut term = NodalTerm { stiffness: *stiffness, volumes: shares.to_vec(), weights };
        term.check(shares.len(), bonds)?;
        for (share, inverse) in term.volumes.iter_mut().zip(shape_inverses(shares.len(), bonds, &term.weights)) {
            if inverse.is_none() {
                *share = 0.0;
            }
        }
        let sum: f64 = term.volumes.iter().sum();
        if sum.is_nan() || sum <= 0.0 {
            return Err(Error::mechanism(
                "no node has bonds in three directions: there is no average strain",
                "give a larger contact radius",
            ));
        }
        term.volumes.iter_mut().for_each(|v| *v *= volume / sum);
        Ok(term)
    }

    /// ε̄_i of every node (Kelvin-Mandel) under displacements u (m) and a macroscopic strain E (Kelvin-Mandel); zero for a
    /// node whose bonds lie in a plane.
    pub fn average_strains(
        &self,
        bonds: &[StiffBond],
        displacements: &[Vector3<f64>],
        strain: &Vector6<f64>,
    ) -> Vec<Vector6<f64>> {
        let inverses = shape_inverses(displacements.len(), bonds, &self.weights);
        let mut average: Vec<Vector6<f64>> =
            inverses.iter().map(|k| if k.is_some() { *strain } else { Vector6::zeros() }).collect();
        for (bond, weight) in bonds.iter().zip(&self.weights) {
            let eta = displacements[bond.b as usize] - displacements[bond.a as usize];
            for node in [bond.a, bond.b] {
                if let Some(inverse) = &inverses[node as usize] {
                    average[node as usize] += symmetric_part(&(*weight * (inverse * bond.branch))) * eta;
                }
            }
        }
        average
    }

    /// g = ω K⁻¹ξ (1/m) of every bond at its ends a and b, by which ε̄ += sym η⊗g; zero at a node whose bonds lie in a plane.
    ///
    /// # Errors
    /// Lists of the wrong length, negative or not finite numbers.
    pub fn gradients(&self, nodes: usize, bonds: &[StiffBond]) -> Result<Vec<[Vector3<f64>; 2]>> {
        self.check(nodes, bonds)?;
        Ok(self.gradients_by(&shape_inverses(nodes, bonds, &self.weights), bonds).collect())
    }

    /// [`NodalTerm::gradients`] by K_i⁻¹.
    fn gradients_by<'a>(
        &'a self,
        inverses: &'a [Option<Matrix3<f64>>],
        bonds: &'a [StiffBond],
    ) -> impl Iterator<Item = [Vector3<f64>; 2]> + 'a {
        let at = |node: u32, bond: &StiffBond, weight: f64| {
            inverses[node as usize].map_or(Vector3::zeros(), |k| weight * (k * bond.branch))
        };
        bonds.iter().zip(&self.weights).map(move |(bond, &w)| [at(bond.a, bond, w), at(bond.b, bond, w)])
    }

    fn check(&self, nodes: usize, bonds: &[StiffBond]) -> Result<()> {
        if self.volumes.len() != nodes || self.weights.len() != bonds.len() {
            return Err(Error::input(
                format!(
                    "the nodal term has {} volumes for {nodes} nodes and {} weights for {} bonds",
                    self.volumes.len(),
                    self.weights.len(),
                    bonds.len()
                ),
                "give one volume per node and one weight per bond",
            ));
        }
        for (name, list) in [("volume", &self.volumes), ("weight", &self.weights)] {
            if let Some(x) = list.iter().find(|x| !(x.is_finite() && **x >= 0.0)) {
                return Err(Error::input(format!("the nodal term has a {name} of {x}"), "give numbers ≥ 0"));
            }
        }
        if !self.stiffness.mandel().iter().all(|z| z.is_finite()) {
            return Err(Error::input("the nodal term has a component that is not finite", "give finite numbers"));
        }
        Ok(())
    }
}

/// K_i⁻¹ of every node; `None` where its bonds lie in a plane.
pub(super) fn shape_inverses(nodes: usize, bonds: &[StiffBond], weights: &[f64]) -> Vec<Option<Matrix3<f64>>> {
    let mut shape = vec![Matrix3::zeros(); nodes];
    for (bond, weight) in bonds.iter().zip(weights) {
        let outer = *weight * bond.branch * bond.branch.transpose();
        shape[bond.a as usize] += outer;
        shape[bond.b as usize] += outer;
    }
    let inverse = |k: Matrix3<f64>| {
        let moduli = k.symmetric_eigenvalues();
        k.try_inverse().filter(|_| moduli.min() > FLAT * moduli.max())
    };
    shape.into_iter().map(inverse).collect()
}

/// The 6×3 matrix of η → sym(η⊗g) in Kelvin-Mandel coordinates.
pub fn symmetric_part(g: &Vector3<f64>) -> Matrix6x3<f64> {
    Matrix6x3::from_fn(|a, i| {
        let (p, q) = PAIRS[a];
        let along = if i == p { g[q] } else { 0.0 } + if i == q { g[p] } else { 0.0 };
        0.5 * along * mandel_weight(a)
    })
}

/// What a bond gives to the average strains of its ends: ω K⁻¹ξ (1/m) of both.
#[derive(Clone, Copy, Debug)]
struct NodalBond {
    a: u32,
    b: u32,
    at_a: [f64; 3],
    at_b: [f64; 3],
}

/// The nodal term as the kernels read it, nodes in the bond list's order.
#[derive(Clone, Debug)]
pub(super) struct NodalKernel {
    bonds: Vec<NodalBond>,
    /// Z (Pa), Kelvin-Mandel.
    z: [[f64; 6]; 6],
    /// V_i (m³).
    volumes: Vec<f64>,
}

/// Six components of a strain or stress per node, in L load cases.
type NodeTensor<const L: usize> = [[f64; L]; 6];

impl NodalKernel {
    /// From a term on bonds between nodes that `place` renumbers.
    ///
    /// # Errors
    /// Lists of the wrong length, negative or not finite numbers.
    pub(super) fn new(term: &NodalTerm, bonds: &[StiffBond], place: &[u32]) -> Result<Self> {
        term.check(place.len(), bonds)?;
        let inverses = shape_inverses(place.len(), bonds, &term.weights);
        let mut list: Vec<NodalBond> = bonds
            .iter()
            .zip(term.gradients_by(&inverses, bonds))
            .map(|(bond, ends)| {
                let (a, b) = (place[bond.a as usize], place[bond.b as usize]);
                let [at_a, at_b] = ends.map(<[f64; 3]>::from);
                // As in the list of bonds, from the lower number to the higher.
                if a <= b {
                    NodalBond { a, b, at_a, at_b }
                } else {
                    NodalBond { a: b, b: a, at_a: at_b.map(|g| -g), at_b: at_a.map(|g| -g) }
                }
            })
            .collect();
        list.sort_by_key(|bond| (bond.a, bond.b));
        let mut volumes = vec![0.0; place.len()];
        for (node, _) in inverses.iter().enumerate().filter(|(_, k)| k.is_some()) {
            volumes[place[node] as usize] = term.volumes[node];
        }
        let z = std::array::from_fn(|a| std::array::from_fn(|b| term.stiffness.mandel()[(a, b)]));
        Ok(NodalKernel { bonds: list, z, volumes })
    }

    /// y += the gradient of the energy at displacements x, without macroscopic strain.
    #[inline(always)]
    pub(super) fn apply<const L: usize>(&self, x: &[NodeField<L>], y: &mut [NodeField<L>]) {
        let mut tensors = self.averages(x);
        self.to_stress(&mut tensors);
        self.scatter(&tensors, y);
    }

    /// y += the gradient of the energy under macroscopic strains alone: an affine field is averaged exactly.
    pub(super) fn apply_strain<const L: usize>(&self, strains: &[Vector6<f64>; L], y: &mut [NodeField<L>]) {
        let strain: NodeTensor<L> = std::array::from_fn(|a| std::array::from_fn(|l| strains[l][a]));
        let mut tensors = vec![strain; self.volumes.len()];
        self.to_stress(&mut tensors);
        self.scatter(&tensors, y);
    }

    /// Add to (1/V) Σ f_k·Δ_l, to the mean stress (rows 11 12 13 21 … 33) and to Σ |f|: what
    /// [`super::bond_list::Measured`] holds, before the division by V.
    pub(super) fn measure<const L: usize>(
        &self,
        strains: &[Vector6<f64>; L],
        x: &[NodeField<L>],
        energy: &mut [[f64; L]; L],
        stress: &mut [[f64; L]; 9],
        force: &mut [f64; L],
    ) {
        let mut average = self.averages(x);
        for (a, l) in (0..6).flat_map(|a| (0..L).map(move |l| (a, l))) {
            average.iter_mut().for_each(|e| e[a][l] += strains[l][a]);
        }
        let mut sigma = average.clone();
        self.to_stress(&mut sigma);
        for (e, s) in average.iter().zip(&sigma) {
            for a in 0..6 {
                for k in 0..L {
                    for l in 0..L {
                        energy[k][l] += s[a][k] * e[a][l];
                    }
                }
            }
            // Σ f⊗ξ over the bonds of a node is its stress times its volume, for Σ ω K⁻¹ξ⊗ξ = 1.
            for (a, &(i, j)) in PAIRS.iter().enumerate() {
                for l in 0..L {
                    stress[3 * i + j][l] += s[a][l] / mandel_weight(a);
                    if i != j {
                        stress[3 * j + i][l] += s[a][l] / mandel_weight(a);
                    }
                }
            }
        }
        for bond in &self.bonds {
            let pull = pull(bond, &sigma[bond.a as usize], &sigma[bond.b as usize]);
            for l in 0..L {
                force[l] += (pull[0][l].powi(2) + pull[1][l].powi(2) + pull[2][l].powi(2)).sqrt();
            }
        }
    }

    /// ε̄ of every node under displacements x alone.
    #[inline(always)]
    pub(super) fn averages<const L: usize>(&self, x: &[NodeField<L>]) -> Vec<NodeTensor<L>> {
        let mut tensors = vec![[[0.0; L]; 6]; self.volumes.len()];
        for bond in &self.bonds {
            let (xa, xb) = (&x[bond.a as usize], &x[bond.b as usize]);
            let mut eta = [[0.0; L]; 3];
            for i in 0..3 {
                for l in 0..L {
                    eta[i][l] = xb[i][l] - xa[i][l];
                }
            }
            add_strain(&bond.at_a, &eta, &mut tensors[bond.a as usize]);
            add_strain(&bond.at_b, &eta, &mut tensors[bond.b as usize]);
        }
        tensors
    }

    /// V Z ε̄ in place of ε̄.
    #[inline(always)]
    fn to_stress<const L: usize>(&self, tensors: &mut [NodeTensor<L>]) {
        for (tensor, volume) in tensors.iter_mut().zip(&self.volumes) {
            let mut stress = [[0.0; L]; 6];
            for a in 0..6 {
                for b in 0..6 {
                    let z = volume * self.z[a][b];
                    for l in 0..L {
                        stress[a][l] += z * tensor[b][l];
                    }
                }
            }
            *tensor = stress;
        }
    }

    /// y += the force of every bond from its ends' stresses at B, its opposite at A.
    #[inline(always)]
    fn scatter<const L: usize>(&self, stress: &[NodeTensor<L>], y: &mut [NodeField<L>]) {
        for bond in &self.bonds {
            let pull = pull(bond, &stress[bond.a as usize], &stress[bond.b as usize]);
            for i in 0..3 {
                for l in 0..L {
                    y[bond.a as usize][i][l] -= pull[i][l];
                    y[bond.b as usize][i][l] += pull[i][l];
                }
            }
        }
    }

    /// Add the diagonal 3×3 block of every node: Σ_j V_j wᵀ Z w, w = ∂ε̄_j/∂u_i.
    pub(super) fn add_diagonal_blocks(&self, blocks: &mut [Matrix6<f64>]) {
        let z = Matrix6::from_fn(|a, b| self.z[a][b]);
        // A node's displacement reaches a node's average through several bonds where the cell is small.
        let mut parts: Vec<(u32, u32, Vector3<f64>)> = self
            .bonds
            .iter()
            .flat_map(|bond| {
                let (at_a, at_b) = (Vector3::from(bond.at_a), Vector3::from(bond.at_b));
                [(bond.a, bond.a, -at_a), (bond.b, bond.a, at_a), (bond.a, bond.b, -at_b), (bond.b, bond.b, at_b)]
            })
            .collect();
        parts.sort_by_key(|&(node, at, _)| (node, at));
        for part in parts.chunk_by(|p, q| (p.0, p.1) == (q.0, q.1)) {
            let (node, at, _) = part[0];
            let w = symmetric_part(&part.iter().map(|p| p.2).sum());
            let block = self.volumes[at as usize] * (w.transpose() * z * w);
            let mut here = blocks[node as usize].fixed_view_mut::<3, 3>(0, 0);
            here += block;
        }
    }

    /// Add to every node what the forces of a unit strain at it sum up to in magnitude (N).
    pub(super) fn add_carried(&self, carried: &mut [[f64; 2]]) {
        let size = self.z.iter().flatten().map(|z| z * z).sum::<f64>().sqrt();
        for bond in &self.bonds {
            let part = |node: u32, g: &[f64; 3]| self.volumes[node as usize] * Vector3::from(*g).norm();
            let force = size * (part(bond.a, &bond.at_a) + part(bond.b, &bond.at_b));
            carried[bond.a as usize][0] += force;
            carried[bond.b as usize][0] += force;
        }
    }
}

/// ε̄ += sym(η⊗g), Kelvin-Mandel.
#[inline(always)]
fn add_strain<const L: usize>(g: &[f64; 3], eta: &[[f64; L]; 3], tensor: &mut NodeTensor<L>) {
    for l in 0..L {
        tensor[0][l] += g[0] * eta[0][l];
        tensor[1][l] += g[1] * eta[1][l];
        tensor[2][l] += g[2] * eta[2][l];
        tensor[3][l] += HALF * (g[2] * eta[1][l] + g[1] * eta[2][l]);
        tensor[4][l] += HALF * (g[2] * eta[0][l] + g[0] * eta[2][l]);
        tensor[5][l] += HALF * (g[1] * eta[0][l] + g[0] * eta[1][l]);
    }
}

/// σ_A g_A + σ_B g_B (N).
#[inline(always)]
fn pull<const L: usize>(bond: &NodalBond, at_a: &NodeTensor<L>, at_b: &NodeTensor<L>) -> [[f64; L]; 3] {
    let mut force = [[0.0; L]; 3];
    for (g, s) in [(&bond.at_a, at_a), (&bond.at_b, at_b)] {
        let h = g.map(|g| HALF * g);
        for l in 0..L {
            force[0][l] += g[0] * s[0][l] + h[1] * s[5][l] + h[2] * s[4][l];
            force[1][l] += h[0] * s[5][l] + g[1] * s[1][l] + h[2] * s[3][l];
            force[2][l] += h[0] * s[4][l] + h[1] * s[3][l] + g[2] * s[2][l];
        }
    }
    force
}
