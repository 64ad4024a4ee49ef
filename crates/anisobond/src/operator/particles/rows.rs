//! Bonds as their particles read them: every particle has a row of all its bonds, eight to a block.
//!
//! A bond stands in the rows of both its ends, so that a row gathers the force on its particle without writing to any
//! other: no two threads write to the same place, and sums have one order. The two halves are computed from opposite
//! numbers, which makes action and reaction equal to the last bit (periodic images: to rounding).

use nalgebra::Vector3;

use super::ghosts::Ghosts;
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
    /// Rows of a model's bonds between renumbered particles.
    ///
    /// # Errors
    /// A bond of length zero, to a sphere that does not exist, with a negative stiffness, or whose branch does not lead
    /// from one sphere to (an image of) the other.
    pub(super) fn new(model: &ParticleModel, place: &[u32], ghosts: &mut Ghosts) -> Result<Self> {
        let particles = place.len();
        let mut rows: Vec<Vec<Half>> = (0..particles).map(|_| Vec::new()).collect();
        for (number, bond) in model.bonds.iter().enumerate() {
            let image = checked_image(model, number)?;
            let (a, b) = (place[bond.a as usize], place[bond.b as usize]);
            let back = image.map(|s| -s);
            let number = number as u32;
            rows[a as usize].push(Half { bond: number, to: ghosts.index(b, image, particles), branch: bond.branch });
            rows[b as usize].push(Half { bond: number, to: ghosts.index(a, back, particles), branch: -bond.branch });
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
        Ok(all)
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

/// Image s of sphere b that a bond leads to: branch = x_b − x_a + H₀ s.
fn checked_image(model: &ParticleModel, number: usize) -> Result<[i32; 3]> {
    let bond = &model.bonds[number];
    let centres = model.packing.centres();
    let named = || format!("bond {} between spheres {} and {}", number + 1, bond.a + 1, bond.b + 1);
    let [Some(from), Some(to)] = [bond.a, bond.b].map(|i| centres.get(i as usize)) else {
        return Err(Error::input(
            format!("{}, but there are {} spheres", named(), centres.len()),
            "use the spheres that exist",
        ));
    };
    let length = bond.branch.norm();
    if !(length.is_finite() && length > 0.0) {
        return Err(Error::input(format!("{} has length {length} m", named()), "move one of the spheres"));
    }
    for (name, k) in [("k_n", bond.normal), ("k_t", bond.tangential)] {
        if !(k.is_finite() && k >= 0.0) {
            return Err(Error::input(
                format!("{} has {name} = {k} N/m", named()),
                "give stiffnesses that are not negative",
            ));
        }
    }
    let rest = bond.branch - (to - from);
    let (image, left) = match model.packing.cell() {
        None => ([0; 3], rest.norm()),
        Some(edges) => {
            let s = rest.component_div(&edges).map(f64::round);
            ([s.x as i32, s.y as i32, s.z as i32], (rest - s.component_mul(&edges)).norm())
        }
    };
    if left > 1e-6 * length {
        return Err(Error::input(
            format!("the branch of {} leads {left} m past its sphere", named()),
            "use the packing from which the bonds were made",
        ));
    }
    Ok(image)
}
