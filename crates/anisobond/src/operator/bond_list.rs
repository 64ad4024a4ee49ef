//! The compressed bond list and its kernels.
//!
//! Relative displacement of a bond A→B with branch L = ℓn under a macroscopic strain E:
//!
//! Δ = u_B − u_A + E·L − ½(θ_A + θ_B)×L,  energy ½ k_n (Δ·n)² + ½ k_t |Δ_t|².
//!
//! Its force is f = k_t Δ + (k_n − k_t)(n·Δ) n; the gradient of the energy is f at u_B, −f at u_A and −½ ℓ k_t n×Δ at both
//! rotations.

use nalgebra::{Matrix6, Vector3, Vector6};

use super::morton::morton_order;
use super::nodal_term::{NodalKernel, NodalTerm};
use crate::calibration::{LatticeStiffness, strain_dot};
use crate::lattice::Lattice;
use crate::{Error, Result};

/// Nodes joined by stiff bonds in a periodic cell.
#[derive(Clone, Debug)]
pub struct Network {
    /// Positions of the nodes (m); they decide the order in memory, nothing else.
    pub nodes: Vec<Vector3<f64>>,
    /// The bonds, each once.
    pub bonds: Vec<StiffBond>,
    /// Volume that they fill (m³).
    pub volume: f64,
    /// What nodes carry beside the bonds (the hybrid model); its energy adds to the bonds'.
    pub nodal: Option<NodalTerm>,
}

impl Network {
    /// Whether the energy is a sum of squares: no bond is negative, and no Kelvin modulus of the nodal term by more than
    /// rounding.
    pub fn is_never_negative(&self) -> bool {
        let semidefinite = |z: &NodalTerm| z.stiffness.eigen().0[0] >= -1e-14 * z.stiffness.norm();
        self.bonds.iter().all(|b| b.normal >= 0.0 && b.tangential >= 0.0)
            && self.nodal.as_ref().is_none_or(semidefinite)
    }

    /// The nodes of a lattice joined by bonds of given stiffnesses.
    pub fn new(lattice: &Lattice, stiffness: &LatticeStiffness) -> Self {
        let stiffnesses = stiffness.normal.iter().zip(&stiffness.tangential);
        let bonds = lattice
            .contacts
            .iter()
            .zip(stiffnesses)
            .map(|(c, (&normal, &tangential))| StiffBond { a: c.a, b: c.b, branch: c.branch, normal, tangential })
            .collect();
        Network { nodes: lattice.packing.centres().to_vec(), bonds, volume: lattice.volume, nodal: None }
    }
}

/// A bond and its stiffnesses.
#[derive(Clone, Copy, Debug)]
pub struct StiffBond {
    /// Node A.
    pub a: u32,
    /// Node B; A itself where a node is bonded to its own image.
    pub b: u32,
    /// Branch from A to (that image of) B (m).
    pub branch: Vector3<f64>,
    /// k_n (N/m).
    pub normal: f64,
    /// k_t (N/m).
    pub tangential: f64,
}

/// Displacement (m) and rotation (radians) of a node in L load cases: `[u_x, u_y, u_z, θ_x, θ_y, θ_z][case]`.
pub type NodeField<const L: usize> = [[f64; L]; 6];

/// A field over all nodes, in the list's own order.
pub type Field<const L: usize> = Vec<NodeField<L>>;

/// One bond as the kernel reads it: 56 bytes.
#[derive(Clone, Copy, Debug)]
struct Packed {
    a: u32,
    b: u32,
    /// Direction.
    n: [f64; 3],
    /// ½ℓ (m).
    half: f64,
    /// k_t (N/m).
    kt: f64,
    /// k_n − k_t (N/m).
    dk: f64,
}

/// The bonds of a network, nodes renumbered along a space-filling curve and bonds sorted by node.
#[derive(Clone, Debug)]
pub struct BondList {
    bonds: Vec<Packed>,
    /// Place in the list of each node of the network.
    place: Vec<u32>,
    volume: f64,
    nodal: Option<NodalKernel>,
}

impl BondList {
    /// Bytes per bond that the kernel reads.
    pub const BYTES_PER_BOND: usize = size_of::<Packed>();

    /// The list of a network.
    ///
    /// # Errors
    /// A bond of length zero, to a node that does not exist, or with a stiffness that is negative or not finite; no
    /// nodes; a volume that is not positive; a nodal term whose lists do not fit.
    pub fn new(network: &Network) -> Result<Self> {
        if network.nodes.is_empty() {
            return Err(Error::input("the network has no nodes", "give at least one"));
        }
        if !(network.volume.is_finite() && network.volume > 0.0) {
            return Err(Error::input(format!("the volume is {} m³", network.volume), "give a positive volume"));
        }
        let mut place = vec![0u32; network.nodes.len()];
        for (new, old) in morton_order(&network.nodes).into_iter().enumerate() {
            place[old as usize] = new as u32;
        }
        let mut bonds = network.bonds.iter().map(|bond| packed(bond, &place)).collect::<Result<Vec<_>>>()?;
        bonds.sort_by_key(|p| (p.a, p.b));
        let nodal = network.nodal.as_ref().map(|term| NodalKernel::new(term, &network.bonds, &place)).transpose()?;
        Ok(BondList { bonds, place, volume: network.volume, nodal })
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.place.len()
    }

    /// Number of bonds.
    pub fn len(&self) -> usize {
        self.bonds.len()
    }

    /// Whether there is no bond.
    pub fn is_empty(&self) -> bool {
        self.bonds.is_empty()
    }

    /// Volume (m³).
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Place in the list's fields of a node of the network.
    pub fn place(&self, node: usize) -> usize {
        self.place[node] as usize
    }

    /// A field of zeros.
    pub fn zeros<const L: usize>(&self) -> Field<L> {
        vec![[[0.0; L]; 6]; self.nodes()]
    }

    /// y = K x: the gradient (N, N·m) of the energy at displacements and rotations x, without macroscopic strain.
    #[inline(always)]
    pub fn apply<const L: usize>(&self, x: &[NodeField<L>], y: &mut [NodeField<L>]) {
        y.fill([[0.0; L]; 6]);
        for bond in &self.bonds {
            let (a, b) = (bond.a as usize, bond.b as usize);
            let delta = relative_displacement(bond, &x[a], &x[b]);
            scatter(bond, &delta, a, b, y);
        }
        if let Some(nodal) = &self.nodal {
            nodal.apply(x, y);
        }
    }

    /// y = gradient of the energy under macroscopic strains alone (u = θ = 0), one strain per load case (Kelvin-Mandel).
    pub fn apply_strain<const L: usize>(&self, strains: &[Vector6<f64>; L], y: &mut [NodeField<L>]) {
        y.fill([[0.0; L]; 6]);
        for bond in &self.bonds {
            scatter(bond, &strained(bond, strains), bond.a as usize, bond.b as usize, y);
        }
        if let Some(nodal) = &self.nodal {
            nodal.apply_strain(strains, y);
        }
    }

    /// Diagonal 6×6 block of K at every node.
    pub fn diagonal_blocks(&self) -> Vec<Matrix6<f64>> {
        let mut blocks = vec![Matrix6::zeros(); self.nodes()];
        for bond in &self.bonds {
            let (nn, cross) = (outer(&bond.n), cross_matrix(&bond.n));
            let (h, own) = (bond.half, bond.a == bond.b);
            for (node, sign) in [(bond.a, -1.0), (bond.b, 1.0)] {
                let block = &mut blocks[node as usize];
                for i in 0..3 {
                    for j in 0..3 {
                        let identity = if i == j { 1.0 } else { 0.0 };
                        // Both ends of a bond to the own image move together: no force, and twice the rotation.
                        let u = if own { 0.0 } else { bond.kt * identity + bond.dk * nn[i][j] };
                        let c = if own { 0.0 } else { sign * h * bond.kt * cross[i][j] };
                        let t = h * h * bond.kt * (identity - nn[i][j]) * if own { 2.0 } else { 1.0 };
                        block[(i, j)] += u;
                        block[(3 + i, 3 + j)] += t;
                        block[(i, 3 + j)] += c;
                        block[(3 + j, i)] += c;
                    }
                }
            }
        }
        if let Some(nodal) = &self.nodal {
            nodal.add_diagonal_blocks(&mut blocks);
        }
        blocks
    }

    /// What the force (N) and the moment (N·m) of unit strain at every node sum up to in magnitude, at the least: forces
    /// that balance leave rounding of these behind.
    pub fn carried(&self) -> Vec<[f64; 2]> {
        let mut carried = vec![[0.0; 2]; self.nodes()];
        for bond in &self.bonds {
            let length = 2.0 * bond.half;
            for node in [bond.a, bond.b] {
                let [force, moment] = &mut carried[node as usize];
                *force += (bond.dk + 3.0 * bond.kt) * length;
                *moment += 2.0 * bond.kt * length * length;
            }
        }
        if let Some(nodal) = &self.nodal {
            nodal.add_carried(&mut carried);
        }
        carried
    }

    /// Mean energies and stresses of L load cases, each with its strain and its field: what a test measures.
    pub fn measure<const L: usize>(&self, strains: &[Vector6<f64>; L], x: &[NodeField<L>]) -> Measured<L> {
        let mut energy = [[0.0; L]; L];
        let mut stress = [[0.0; L]; 9];
        let mut force = [0.0; L];
        let mut length = 0.0;
        for bond in &self.bonds {
            let mut delta = relative_displacement(bond, &x[bond.a as usize], &x[bond.b as usize]);
            for (d, s) in delta.iter_mut().zip(strained(bond, strains)) {
                for l in 0..L {
                    d[l] += s[l];
                }
            }
            let f = force_of(bond, &delta);
            for i in 0..3 {
                for k in 0..L {
                    for l in 0..L {
                        energy[k][l] += f[i][k] * delta[i][l];
                    }
                }
                for j in 0..3 {
                    for l in 0..L {
                        stress[3 * i + j][l] += f[i][l] * 2.0 * bond.half * bond.n[j];
                    }
                }
            }
            for l in 0..L {
                force[l] += (f[0][l].powi(2) + f[1][l].powi(2) + f[2][l].powi(2)).sqrt();
            }
            length += 2.0 * bond.half;
        }
        if let Some(nodal) = &self.nodal {
            nodal.measure(strains, x, &mut energy, &mut stress, &mut force);
        }
        let count = self.bonds.len().max(1) as f64;
        Measured {
            energy: energy.map(|row| row.map(|e| e / self.volume)),
            stress: stress.map(|row| row.map(|s| s / self.volume)),
            mean_force: force.map(|f| f / count),
            mean_length: length / count,
        }
    }
}

/// Sums over the bonds of a tested lattice.
pub struct Measured<const L: usize> {
    /// (1/V) Σ f_k·Δ_l (Pa): twice the energy density on the diagonal.
    pub energy: [[f64; L]; L],
    /// (1/V) Σ f⊗L (Pa), rows 11 12 13 21 … 33, per load case.
    pub stress: [[f64; L]; 9],
    /// Mean |f| of a bond (N); a nodal term's part counts apart.
    pub mean_force: [f64; L],
    /// Mean length of a bond (m).
    pub mean_length: f64,
}

/// A checked bond between renumbered nodes; the same for a bond given as B→A, but for rounding.
fn packed(bond: &StiffBond, place: &[u32]) -> Result<Packed> {
    let ends = [bond.a, bond.b].map(|node| place.get(node as usize).copied());
    let [Some(a), Some(b)] = ends else {
        return Err(Error::input(
            format!("a bond joins nodes {} and {}, but there are {} nodes", bond.a + 1, bond.b + 1, place.len()),
            "use the nodes that exist",
        ));
    };
    let length = bond.branch.norm();
    let place = || format!("the bond between nodes {} and {}", bond.a + 1, bond.b + 1);
    if !(length.is_finite() && length > 0.0) {
        return Err(Error::input(format!("{} has length {length} m", place()), "move one of the nodes"));
    }
    for (name, k) in [("k_n", bond.normal), ("k_t", bond.tangential)] {
        if !(k.is_finite() && k >= 0.0) {
            return Err(Error::input(
                format!("{} has {name} = {k} N/m", place()),
                "give stiffnesses that are not negative",
            ));
        }
    }
    let sign = if a <= b { 1.0 } else { -1.0 };
    let n = (bond.branch * (sign / length)).into();
    let (kt, dk) = (bond.tangential, bond.normal - bond.tangential);
    Ok(Packed { a: a.min(b), b: a.max(b), n, half: 0.5 * length, kt, dk })
}

/// Δ − E·L = u_B − u_A − ½ℓ (θ_A + θ_B)×n.
#[inline(always)]
fn relative_displacement<const L: usize>(bond: &Packed, xa: &NodeField<L>, xb: &NodeField<L>) -> [[f64; L]; 3] {
    let [n0, n1, n2] = bond.n.map(|n| n * bond.half);
    let mut delta = [[0.0; L]; 3];
    for l in 0..L {
        let (t0, t1, t2) = (xa[3][l] + xb[3][l], xa[4][l] + xb[4][l], xa[5][l] + xb[5][l]);
        delta[0][l] = xb[0][l] - xa[0][l] - (t1 * n2 - t2 * n1);
        delta[1][l] = xb[1][l] - xa[1][l] - (t2 * n0 - t0 * n2);
        delta[2][l] = xb[2][l] - xa[2][l] - (t0 * n1 - t1 * n0);
    }
    delta
}

/// E·L.
fn strained<const L: usize>(bond: &Packed, strains: &[Vector6<f64>; L]) -> [[f64; L]; 3] {
    let branch = Vector3::from(bond.n) * (2.0 * bond.half);
    let mut delta = [[0.0; L]; 3];
    for (l, strain) in strains.iter().enumerate() {
        let d = strain_dot(strain, &branch);
        for i in 0..3 {
            delta[i][l] = d[i];
        }
    }
    delta
}

/// f = k_t Δ + (k_n − k_t)(n·Δ) n.
#[inline(always)]
fn force_of<const L: usize>(bond: &Packed, delta: &[[f64; L]; 3]) -> [[f64; L]; 3] {
    let [n0, n1, n2] = bond.n;
    let mut f = [[0.0; L]; 3];
    for l in 0..L {
        let normal = bond.dk * (n0 * delta[0][l] + n1 * delta[1][l] + n2 * delta[2][l]);
        f[0][l] = bond.kt * delta[0][l] + normal * n0;
        f[1][l] = bond.kt * delta[1][l] + normal * n1;
        f[2][l] = bond.kt * delta[2][l] + normal * n2;
    }
    f
}

/// Add the gradient of one bond's energy to its two nodes: ±f and the moment −½ℓ k_t n×Δ at both.
#[inline(always)]
fn scatter<const L: usize>(bond: &Packed, delta: &[[f64; L]; 3], a: usize, b: usize, y: &mut [NodeField<L>]) {
    let f = force_of(bond, delta);
    let [n0, n1, n2] = bond.n.map(|n| n * bond.half * bond.kt);
    let mut m = [[0.0; L]; 3];
    for l in 0..L {
        m[0][l] = n1 * delta[2][l] - n2 * delta[1][l];
        m[1][l] = n2 * delta[0][l] - n0 * delta[2][l];
        m[2][l] = n0 * delta[1][l] - n1 * delta[0][l];
    }
    let ya = &mut y[a];
    for i in 0..3 {
        for l in 0..L {
            ya[i][l] -= f[i][l];
            ya[3 + i][l] -= m[i][l];
        }
    }
    let yb = &mut y[b];
    for i in 0..3 {
        for l in 0..L {
            yb[i][l] += f[i][l];
            yb[3 + i][l] -= m[i][l];
        }
    }
}

/// n⊗n.
fn outer(n: &[f64; 3]) -> [[f64; 3]; 3] {
    n.map(|a| n.map(|b| a * b))
}

/// The matrix of x → n×x.
fn cross_matrix(n: &[f64; 3]) -> [[f64; 3]; 3] {
    [[0.0, -n[2], n[1]], [n[2], 0.0, -n[0]], [-n[1], n[0], 0.0]]
}
