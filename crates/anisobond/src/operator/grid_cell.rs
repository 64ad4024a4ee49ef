//! A periodic cell of a grid as a network: the bonds that a calibration gives to a node, at every node of the cell.

use nalgebra::Vector3;

use super::bond_list::{Network, StiffBond};
use super::nodal_term::NodalTerm;
use crate::lattice::Neighbourhood;
use crate::tensor::Stiffness;
use crate::{Error, Result};

/// More bonds than this are refused before memory is taken (about 4 GB).
const MOST_BONDS: f64 = 64e6;

/// Micromoduli of ξ and −ξ may differ by this share of the largest; what counts is their mean.
const ASYMMETRY: f64 = 1e-9;

/// Relative tolerance (of the square) within which a node on the border of a void belongs to it.
const ON_VOID: f64 = 1e-9;

/// Sets the choice of missing nodes apart from the displacements of the same seed.
const MISSING_STREAM: u64 = 0x6d69_7373;

/// A periodic cell of a grid, perfect or with defects.
///
/// Nodes are numbered i + n₁(j + n₂k) for 0 ≤ i < n₁, 0 ≤ j < n₂, 0 ≤ k < n₃ along the grid's own axes. A cell may be
/// smaller than the neighbourhood: a node is then bonded to images, its own among them.
#[derive(Clone, Debug, PartialEq)]
pub struct GridCell {
    /// Number of nodes along each axis of the grid, n₁ n₂ n₃.
    pub nodes: [usize; 3],
    /// Numbers of the nodes that are missing, with all their bonds. The volume stays that of the full cell.
    pub missing: Vec<usize>,
    /// Largest displacement of a node from its place along each axis, in spacings (–); 0 for a perfect grid.
    pub displacement: f64,
    /// Seed of the displacements.
    pub seed: u64,
}

impl GridCell {
    /// A cell without defects.
    pub fn perfect(nodes: [usize; 3]) -> Self {
        GridCell { nodes, missing: Vec::new(), displacement: 0.0, seed: 0 }
    }

    /// The network of the cell with micromoduli c_n and c_t (N/m⁶) of every bond in the neighbourhood's order; central
    /// bonds have `tangential` = `None`.
    ///
    /// k_n = ω c_n ΔV²/ℓ, k_t = ω c_t ΔV²/ℓ (N/m) with ℓ the length of the bond between the nodes where they are, so that
    /// on a perfect grid (1/V) Σ ℓ² (k_n N + k_t T) = ½ Σ_neighbours ω |ξ| ΔV (c_n N + c_t T) (P eq 29).
    ///
    /// # Errors
    /// A cell without nodes or with too many bonds; a missing node that does not exist; a displacement of half a spacing
    /// or more; lists of micromoduli of the wrong length, negative, not finite, or different for ξ and −ξ.
    pub fn network(
        &self,
        neighbourhood: &Neighbourhood,
        normal: &[f64],
        tangential: Option<&[f64]>,
    ) -> Result<Network> {
        self.assembled(neighbourhood, normal, tangential).map(|(network, _)| network)
    }

    /// The network of the hybrid model: central bonds of micromodulus c (N/m⁶) and the nodal term Z (Pa) of every node
    /// that is there, averaged with the influence ω over the bonds that are left to it. Each node stands for ΔV.
    ///
    /// # Errors
    /// As [`GridCell::network`].
    pub fn hybrid_network(
        &self,
        neighbourhood: &Neighbourhood,
        micromodulus: &[f64],
        nodal: &Stiffness,
    ) -> Result<Network> {
        let (mut network, weights) = self.assembled(neighbourhood, micromodulus, None)?;
        let volumes = vec![neighbourhood.spacing().powi(3); network.nodes.len()];
        network.nodal = Some(NodalTerm { stiffness: *nodal, volumes, weights });
        Ok(network)
    }

    /// The cell with a share (0 to below 1) of all its places missing, chosen at random by the seed, beside those that
    /// are missing already.
    ///
    /// # Errors
    /// A share out of range.
    pub fn with_missing(mut self, share: f64) -> Result<Self> {
        if !(0.0..1.0).contains(&share) {
            return Err(Error::input(format!("a share of {share} of the nodes is missing"), "give 0 to below 1"));
        }
        let mut order: Vec<usize> = (0..self.len()).collect();
        let rank = |node: usize| noise(self.seed ^ MISSING_STREAM, node as u64);
        order.sort_by(|&a, &b| rank(a).total_cmp(&rank(b)));
        order.truncate((share * self.len() as f64).round() as usize);
        self.missing.extend(order);
        self.missing.sort_unstable();
        self.missing.dedup();
        Ok(self)
    }

    /// The cell with a spherical void: no node within a radius (spacings) of a centre (places i, j, k along the grid's
    /// axes, fractions allowed); through the cell's borders.
    ///
    /// # Errors
    /// A radius that is not positive, or numbers that are not finite.
    pub fn with_void(mut self, centre: [f64; 3], radius: f64) -> Result<Self> {
        if !(radius.is_finite() && radius > 0.0 && centre.iter().all(|x| x.is_finite())) {
            return Err(Error::input(
                format!("a void of radius {radius} spacings at ({}, {}, {})", centre[0], centre[1], centre[2]),
                "give a positive radius and a finite centre",
            ));
        }
        let inside = |node: usize| {
            let at = self.at(node);
            let square = |d: usize| {
                let edge = self.nodes[d] as f64;
                let x = (f64::from(at[d]) - centre[d]).rem_euclid(edge);
                x.min(edge - x).powi(2)
            };
            (0..3).map(square).sum::<f64>() <= radius * radius * (1.0 + ON_VOID)
        };
        let void: Vec<usize> = (0..self.len()).filter(|&node| inside(node)).collect();
        self.missing.extend(void);
        self.missing.sort_unstable();
        self.missing.dedup();
        Ok(self)
    }

    /// The network and the influence of every bond.
    fn assembled(
        &self,
        neighbourhood: &Neighbourhood,
        normal: &[f64],
        tangential: Option<&[f64]>,
    ) -> Result<(Network, Vec<f64>)> {
        self.check(neighbourhood)?;
        let numbers = self.numbers()?;
        let offsets = self.displacements(neighbourhood);
        let places = numbers.iter().enumerate().filter(|(_, number)| number.is_some());
        let nodes = places.map(|(node, _)| place(neighbourhood, self.at(node)) + offsets[node]).collect();
        let half = half_bonds(neighbourhood, normal, tangential)?;
        let mut bonds = Vec::with_capacity(half.len() * numbers.len());
        let mut influences = Vec::with_capacity(half.len() * numbers.len());
        for (node, a) in numbers.iter().enumerate() {
            for bond in &half {
                let other = self.neighbour(node, bond.offset);
                if let (Some(a), Some(b)) = (*a, numbers[other]) {
                    let branch = bond.xi + offsets[other] - offsets[node];
                    let per_length = 1.0 / branch.norm();
                    let (normal, tangential) = (bond.normal * per_length, bond.tangential * per_length);
                    bonds.push(StiffBond { a, b, branch, normal, tangential });
                    influences.push(bond.influence);
                }
            }
        }
        let volume = self.len() as f64 * neighbourhood.spacing().powi(3);
        Ok((Network { nodes, bonds, volume, nodal: None }, influences))
    }

    /// Number of places for nodes, missing ones included.
    pub fn len(&self) -> usize {
        self.nodes.iter().product()
    }

    /// Whether the cell has no place for a node.
    pub fn is_empty(&self) -> bool {
        self.nodes.contains(&0)
    }

    fn check(&self, neighbourhood: &Neighbourhood) -> Result<()> {
        let [i, j, k] = self.nodes;
        if self.is_empty() {
            return Err(Error::input(format!("the cell has {i} × {j} × {k} nodes"), "give three numbers above zero"));
        }
        let bonds = self.nodes.map(|n| n as f64).iter().product::<f64>() * neighbourhood.bonds().len() as f64 / 2.0;
        if bonds > MOST_BONDS {
            return Err(Error::input(
                format!("the cell of {i} × {j} × {k} nodes has {bonds:.1e} bonds"),
                "use a smaller cell or horizon",
            ));
        }
        if !(0.0..0.5).contains(&self.displacement) {
            return Err(Error::input(
                format!("nodes are displaced by up to {} spacings", self.displacement),
                "give a number from 0 to below 0.5, so that nodes do not meet",
            ));
        }
        Ok(())
    }

    /// Number of every place's node in the network; `None` where it is missing.
    fn numbers(&self) -> Result<Vec<Option<u32>>> {
        let mut here = vec![true; self.len()];
        for &node in &self.missing {
            let count = self.len();
            *here.get_mut(node).ok_or_else(|| {
                Error::input(format!("node {node} is missing, but the cell has {count}"), "nodes count from 0")
            })? = false;
        }
        let mut next = 0;
        let numbers = here.into_iter().map(|here| {
            here.then(|| {
                next += 1;
                next - 1
            })
        });
        Ok(numbers.collect())
    }

    /// Place of a node along the grid's axes.
    fn at(&self, node: usize) -> [i32; 3] {
        let [i, j, _] = self.nodes;
        [node % i, node / i % j, node / i / j].map(|x| x as i32)
    }

    /// The node at an offset from another, through the cell's borders.
    fn neighbour(&self, node: usize, offset: [i32; 3]) -> usize {
        let at = self.at(node);
        let [i, j, k]: [usize; 3] = std::array::from_fn(|d| {
            (i64::from(at[d]) + i64::from(offset[d])).rem_euclid(self.nodes[d] as i64) as usize
        });
        i + self.nodes[0] * (j + self.nodes[1] * k)
    }

    /// Displacement of every node (m).
    fn displacements(&self, neighbourhood: &Neighbourhood) -> Vec<Vector3<f64>> {
        let reach = self.displacement * neighbourhood.spacing();
        let of_node = |node: usize| Vector3::from_fn(|d, _| reach * noise(self.seed, 3 * node as u64 + d as u64));
        (0..self.len()).map(of_node).collect()
    }
}

/// Position (m) of a place of the grid, turned with the neighbourhood.
fn place(neighbourhood: &Neighbourhood, at: [i32; 3]) -> Vector3<f64> {
    neighbourhood.spacing() * (neighbourhood.orientation() * Vector3::from(at.map(f64::from)))
}

/// One of ±ξ, with ω c ΔV² (N) of its normal and tangential stiffness.
struct HalfBond {
    offset: [i32; 3],
    xi: Vector3<f64>,
    influence: f64,
    normal: f64,
    tangential: f64,
}

/// One of ± of every bond: in the neighbourhood's order bond k is opposite to the k-th from the end.
fn half_bonds(neighbourhood: &Neighbourhood, normal: &[f64], tangential: Option<&[f64]>) -> Result<Vec<HalfBond>> {
    let bonds = neighbourhood.bonds();
    for (name, list) in [("normal", Some(normal)), ("tangential", tangential)] {
        check_micromoduli(name, list.unwrap_or(normal), bonds.len())?;
    }
    let square = neighbourhood.spacing().powi(6);
    let half = (bonds.len() / 2..bonds.len()).map(|k| {
        let bond = &bonds[k];
        let mean = |c: &[f64]| 0.5 * bond.influence * (c[k] + c[bonds.len() - 1 - k]) * square;
        HalfBond {
            offset: bond.offset,
            xi: bond.xi,
            influence: bond.influence,
            normal: mean(normal),
            tangential: tangential.map_or(0.0, mean),
        }
    });
    Ok(half.collect())
}

/// One micromodulus per bond, not negative, the same for ξ and −ξ.
fn check_micromoduli(name: &str, c: &[f64], bonds: usize) -> Result<()> {
    if c.len() != bonds {
        return Err(Error::input(
            format!("{} {name} micromoduli for {bonds} bonds", c.len()),
            "give one per bond, in the neighbourhood's order",
        ));
    }
    let largest = c.iter().copied().fold(0.0, f64::max);
    for (k, (&here, &opposite)) in c.iter().zip(c.iter().rev()).enumerate() {
        if !(here.is_finite() && here >= 0.0) {
            return Err(Error::input(
                format!("the {name} micromodulus of bond {} is {here} N/m⁶", k + 1),
                "give numbers that are not negative",
            ));
        }
        if (here - opposite).abs() > ASYMMETRY * largest {
            return Err(Error::input(
                format!("the {name} micromodulus of bond {} is {here} N/m⁶, that of its opposite {opposite}", k + 1),
                "a bond has one stiffness, whichever end it is seen from",
            ));
        }
    }
    Ok(())
}

/// A repeatable number in (−1, 1) (splitmix64).
fn noise(seed: u64, index: u64) -> f64 {
    let mut z = seed.wrapping_mul(0xd1b5_4a32_d192_ed03).wrapping_add((index + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}
