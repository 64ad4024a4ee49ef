//! Bonds as their particles read them: every particle has a row of all its bonds, eight to a block.
//!
//! A bond stands in the rows of both its ends, so that a row gathers the force on its particle without writing to any
//! other: no two threads write to the same place, and sums have one order. The two halves are computed from opposite
//! numbers, which makes action and reaction equal to the last bit (periodic images: to rounding).

use nalgebra::Vector3;

use super::ghosts::{Ghosts, Image};
use super::model::{ParticleModel, Strength};
use crate::{Error, Result};

/// Half bonds of a block.
pub(super) const LANES: usize = 8;

/// Eight half bonds; those beyond a row's end are of stiffness zero. 448 bytes, 56 per half bond.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Block {
    /// Direction at rest, to the other end.
    pub n: [[f64; LANES]; 3],
    /// Length at rest ℓ₀ (m).
    pub length: [f64; LANES],
    /// k_n (N/m); zero where there is no bond (any more).
    pub kn: [f64; LANES],
    /// k_t (N/m).
    pub kt: [f64; LANES],
    /// Pose of the other end.
    pub to: [u32; LANES],
    /// Number of the bond in the model; [`NO_BOND`] beyond a row's end.
    pub bond: [u32; LANES],
}

/// Beyond the end of a row.
pub(super) const NO_BOND: u32 = u32::MAX;

/// Strengths of the eight.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct BlockStrength {
    pub tension: [f64; LANES],
    pub cohesion: [f64; LANES],
    /// tan φ.
    pub slope: [f64; LANES],
}

/// All rows.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    /// Blocks of particle i: `start[i]..start[i + 1]`.
    pub start: Vec<u32>,
    pub blocks: Vec<Block>,
    /// As the blocks; empty where bonds do not break.
    pub strength: Vec<BlockStrength>,
    /// Places of the two halves of each bond: block and lane.
    pub halves: Vec<[(u32, u8); 2]>,
}

impl Block {
    fn empty(particle: u32) -> Self {
        Block {
            n: [[1.0; LANES], [0.0; LANES], [0.0; LANES]],
            length: [1.0; LANES],
            kn: [0.0; LANES],
            kt: [0.0; LANES],
            to: [particle; LANES],
            bond: [NO_BOND; LANES],
        }
    }
}

/// A half bond before it has its place.
struct Half {
    bond: u32,
    to: u32,
    branch: Vector3<f64>,
}

impl Rows {
    /// Rows of a model's bonds between renumbered particles, each bond with the image that it leads to.
    pub(super) fn new(model: &ParticleModel, place: &[u32], images: &[Image], ghosts: &mut Ghosts) -> Self {
        let particles = place.len();
        let mut rows: Vec<Vec<Half>> = (0..particles).map(|_| Vec::new()).collect();
        for (number, (bond, image)) in model.bonds.iter().zip(images).enumerate() {
            let (a, b) = (place[bond.a as usize], place[bond.b as usize]);
            let (number, back) = (number as u32, image.back());
            rows[a as usize].push(Half { bond: number, to: ghosts.index(b, image, particles), branch: bond.branch });
            rows[b as usize].push(Half { bond: number, to: ghosts.index(a, &back, particles), branch: -bond.branch });
        }
        let mut all = Rows {
            start: vec![0],
            blocks: Vec::new(),
            strength: Vec::new(),
            halves: vec![[(u32::MAX, 0); 2]; model.bonds.len()],
        };
        for (particle, mut row) in rows.into_iter().enumerate() {
            row.sort_by_key(|half| (half.to, half.bond));
            for eight in row.chunks(LANES) {
                all.push(eight, particle as u32, model);
            }
            all.start.push(all.blocks.len() as u32);
        }
        all
    }

    /// Append one block.
    fn push(&mut self, halves: &[Half], particle: u32, model: &ParticleModel) {
        let mut block = Block::empty(particle);
        let number = self.blocks.len() as u32;
        for (lane, half) in halves.iter().enumerate() {
            let bond = &model.bonds[half.bond as usize];
            let length = half.branch.norm();
            for i in 0..3 {
                block.n[i][lane] = half.branch[i] / length;
            }
            (block.length[lane], block.kn[lane], block.kt[lane]) = (length, bond.normal, bond.tangential);
            (block.to[lane], block.bond[lane]) = (half.to, half.bond);
            let known = &mut self.halves[half.bond as usize];
            let free = usize::from(known[0].0 != u32::MAX);
            known[free] = (number, lane as u8);
        }
        self.blocks.push(block);
        if let Some(strength) = &model.strength {
            let of = |lane: usize| halves.get(lane).map_or(Strength::UNBREAKABLE, |h| strength[h.bond as usize]);
            self.strength.push(BlockStrength {
                tension: std::array::from_fn(|lane| of(lane).tension),
                cohesion: std::array::from_fn(|lane| of(lane).cohesion),
                slope: std::array::from_fn(|lane| of(lane).friction_angle.tan()),
            });
        }
    }

    /// Whether a bond carries anything.
    pub(super) fn is_whole(&self, bond: usize) -> bool {
        let (block, lane) = self.halves[bond][0];
        let block = &self.blocks[block as usize];
        block.kn[lane as usize] > 0.0 || block.kt[lane as usize] > 0.0
    }

    /// Take a bond away, both halves.
    pub(super) fn break_bond(&mut self, bond: usize) {
        for (block, lane) in self.halves[bond] {
            let block = &mut self.blocks[block as usize];
            (block.kn[lane as usize], block.kt[lane as usize]) = (0.0, 0.0);
        }
    }
}

/// The image of sphere b that each bond leads to: branch = x_b − x_a + H₀ s.
///
/// # Errors
/// A bond of length zero, to a sphere that does not exist, with a negative stiffness, or whose branch does not lead from
/// one sphere to (an image of) the other.
pub(super) fn images(model: &ParticleModel) -> Result<Vec<Image>> {
    let cell = model.packing.cell();
    let of = |number: usize| {
        let bond = &model.bonds[number];
        let (named, rest) = checked(model, number)?;
        let (key, left) = match cell {
            None => ([0; 3], rest),
            Some(edges) => {
                let s = rest.component_div(&edges).map(f64::round);
                ([s.x as i64, s.y as i64, s.z as i64], rest - s.component_mul(&edges))
            }
        };
        if left.norm() > 1e-6 * bond.branch.norm() {
            return Err(Error::input(
                format!("the branch of {named} leads {} m past its sphere", left.norm()),
                "use the packing from which the bonds were made",
            ));
        }
        Ok(Image { key, shift: rest - left })
    };
    (0..model.bonds.len()).map(of).collect()
}

/// Images of a network whose cell is not known: by where the branches lead past the nodes.
///
/// # Errors
/// As [`images`], but for branches.
pub(super) fn unknown_images(model: &ParticleModel) -> Result<Vec<Image>> {
    let mean = model.bonds.iter().map(|b| b.branch.norm()).sum::<f64>() / model.bonds.len().max(1) as f64;
    let of = |number: usize| {
        let (_, shift) = checked(model, number)?;
        // Images that differ by less are the same but for rounding.
        Ok(Image { key: shift.map(|x| (x / (1e-9 * mean)).round() as i64).into(), shift })
    };
    (0..model.bonds.len()).map(of).collect()
}

/// The name of a bond that is sound, and the way from its sphere b to its branch's end.
fn checked(model: &ParticleModel, number: usize) -> Result<(String, Vector3<f64>)> {
    let bond = &model.bonds[number];
    let centres = model.packing.centres();
    let named = format!("bond {} between spheres {} and {}", number + 1, bond.a + 1, bond.b + 1);
    let [Some(from), Some(to)] = [bond.a, bond.b].map(|i| centres.get(i as usize)) else {
        return Err(Error::input(
            format!("{named}, but there are {} spheres", centres.len()),
            "use the spheres that exist",
        ));
    };
    let length = bond.branch.norm();
    if !(length.is_finite() && length > 0.0) {
        return Err(Error::input(format!("{named} has length {length} m"), "move one of the spheres"));
    }
    for (name, k) in [("k_n", bond.normal), ("k_t", bond.tangential)] {
        if !(k.is_finite() && k >= 0.0) {
            return Err(Error::input(
                format!("{named} has {name} = {k} N/m"),
                "give stiffnesses that are not negative",
            ));
        }
    }
    Ok((named, bond.branch - (to - from)))
}
