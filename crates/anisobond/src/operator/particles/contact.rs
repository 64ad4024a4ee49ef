//! Contact of spheres that no bond joins: linear normal repulsion and incremental shear with Coulomb friction.
//!
//! With ℓ the distance of the centres and d₀ the distance at which they touch, the normal force is k_n (d₀ − ℓ) while they
//! touch; nothing pulls. The shear force turns with the pair, grows by −k_t times the slip and is cut back to μ times the
//! normal force. Slip is measured with finite rotations: the direction n₋ of the step before is carried along by both
//! spheres, p = w_a ΔR_a n₋ + w_b ΔR_b n₋ (w the distances of the contact point from the centres, w_a + w_b = 1), and
//! slips by −ℓ (p − (n·p) n) against the pair's own n. A rigid rotation of both slips by nothing at any angle.
//!
//! Pairs are found from a list of all pairs within a skin, made anew once some sphere has moved by half of it.

mod saved;

use std::collections::HashMap;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::pose::increment;
use crate::lattice::{Packing, contacts};
use crate::{Error, Result};

/// How spheres touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactLaw {
    /// Modulus E (Pa): k_n = E π r²/(r_a + r_b), r the smaller radius, as for bonds (THEORY section 2).
    pub modulus: f64,
    /// k_t/k_n (–).
    pub tangential_ratio: f64,
    /// Coefficient of friction μ (–).
    pub friction: f64,
}

impl ContactLaw {
    /// k_n (N/m) of spheres of two radii (m).
    pub fn normal_stiffness(&self, ra: f64, rb: f64) -> f64 {
        self.modulus * std::f64::consts::PI * ra.min(rb).powi(2) / (ra + rb)
    }

    pub(super) fn check(&self) -> Result<()> {
        let positive = self.modulus.is_finite() && self.modulus > 0.0;
        if positive && [self.tangential_ratio, self.friction].iter().all(|x| x.is_finite() && *x >= 0.0) {
            return Ok(());
        }
        Err(Error::input(
            format!(
                "contact of modulus {} Pa, k_t/k_n = {}, friction {}",
                self.modulus, self.tangential_ratio, self.friction
            ),
            "give a positive modulus, and ratio and friction that are not negative",
        ))
    }
}

/// Two spheres that touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchingPair {
    /// One sphere.
    pub a: u32,
    /// The other.
    pub b: u32,
    /// Which periodic image of b.
    pub image: [i32; 3],
    /// Distance at which they touch, d₀ (m).
    pub touch: f64,
    /// Direction from a to b when last looked at.
    pub normal: Vector3<f64>,
    /// Shear force on a (N).
    pub shear: Vector3<f64>,
    /// Force on a (N), normal and shear.
    pub force: Vector3<f64>,
}

/// What contacts read of the state: lists in the order of the particles, positions where they are now.
pub(super) struct Scene<'a> {
    pub positions: &'a [Vector3<f64>],
    pub radii: &'a [f64],
    /// Rotation since the forces were last computed (radians).
    pub turned: &'a [Vector3<f64>],
    /// Deformation gradient F of the cell, and its edges at the start (m).
    pub cell: Option<(Matrix3<f64>, Vector3<f64>)>,
}

/// Key of a pair.
type Pair = (u32, u32, [i32; 3]);

/// A pair in reach.
#[derive(Clone, Copy, Debug)]
struct Near {
    a: u32,
    b: u32,
    image: [i32; 3],
}

/// Contacts and the list they are found from.
#[derive(Clone, Debug)]
pub(super) struct Contacts {
    law: ContactLaw,
    /// Pairs in reach that no bond joins, in the order of (a, b, image).
    near: Vec<Near>,
    /// Pairs that touch now, in the same order.
    touching: Vec<TouchingPair>,
    /// Where the spheres were when listed, and the cell.
    listed_at: Vec<Vector3<f64>>,
    listed_cell: Option<Matrix3<f64>>,
    /// Touching distances below r_a + r_b.
    nearer: HashMap<Pair, f64>,
    /// Times the list was made.
    pub lists: usize,
    /// Lost to friction so far (J).
    pub friction: f64,
}

/// The skin relative to the sum of radii.
const SKIN: f64 = 0.2;

/// Sums over contacts.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ContactSums {
    pub energy: f64,
    pub virial: Matrix3<f64>,
}

impl Contacts {
    pub(super) fn new(law: ContactLaw) -> Self {
        Contacts {
            law,
            near: Vec::new(),
            touching: Vec::new(),
            listed_at: Vec::new(),
            listed_cell: None,
            nearer: HashMap::new(),
            lists: 0,
            friction: 0.0,
        }
    }

    pub(super) fn touching(&self) -> &[TouchingPair] {
        &self.touching
    }

    /// A bond has broken whose length at rest was `rest` (m): its spheres touch at no more than that.
    pub(super) fn release(&mut self, (a, b, image): Pair, touch: f64) {
        let (a, b, image) = ordered(a, b, image);
        self.nearer.insert((a, b, image), touch);
        let key = |n: &Near| (n.a, n.b, n.image);
        if let Err(at) = self.near.binary_search_by_key(&(a, b, image), key) {
            self.near.insert(at, Near { a, b, image });
        }
    }

    /// Whether some pair may have come into reach that is not listed. Motion of the body as a whole does not count: by the
    /// mean displacement, and the cell's deformation A since the list was made, which brings spheres of distance d nearer
    /// by at most |A − I| d.
    fn outdated(&self, scene: &Scene) -> bool {
        if self.listed_at.len() != scene.positions.len() {
            return true;
        }
        let affine = match (self.listed_cell, scene.cell) {
            (Some(then), Some((now, _))) => then.try_inverse().map(|inverse| now * inverse),
            _ => Some(Matrix3::identity()),
        };
        let Some(affine) = affine else { return true };
        let strain = (affine - Matrix3::identity()).norm();
        let moved = |i: usize| scene.positions[i] - affine * self.listed_at[i];
        let spheres = scene.positions.len();
        let mean = (0..spheres).map(moved).sum::<Vector3<f64>>() / spheres as f64;
        // A pair touches within r_a + r_b ≥ 2r and was listed within (1 + skin) of it; half of what is left to each.
        let least = scene.radii.iter().copied().fold(f64::INFINITY, f64::min);
        let limit = least * (SKIN - strain * (1.0 + SKIN));
        let within = |i: usize| (moved(i) - mean).norm_squared() <= limit * limit;
        limit <= 0.0 || !(0..spheres).all(within)
    }

    /// Make the list anew if it is outdated; `bonded` says which pairs a bond joins.
    pub(super) fn update_list(&mut self, scene: &Scene, bonded: &dyn Fn(Pair) -> bool) -> Result<()> {
        if !self.outdated(scene) {
            return Ok(());
        }
        let first = self.lists == 0;
        self.near = near_pairs(scene, 1.0 + SKIN)?.into_iter().filter(|n| !bonded((n.a, n.b, n.image))).collect();
        if first {
            // Spheres that overlap at the start are at rest there.
            for n in &self.near {
                let distance = scene.branch(n.a, n.b, n.image).norm();
                if distance < scene.radii[n.a as usize] + scene.radii[n.b as usize] {
                    self.nearer.insert((n.a, n.b, n.image), distance);
                }
            }
        }
        self.listed_at = scene.positions.to_vec();
        self.listed_cell = scene.cell.map(|c| c.0);
        self.lists += 1;
        Ok(())
    }

    /// Forces of all contacts, added to the particles one pair after the other.
    pub(super) fn forces(
        &mut self,
        scene: &Scene,
        mut add: impl FnMut(usize, &Vector3<f64>, &Vector3<f64>),
    ) -> ContactSums {
        let mut sums = ContactSums::default();
        let mut before = std::mem::take(&mut self.touching).into_iter().peekable();
        for near in &self.near {
            let key = (near.a, near.b, near.image);
            while before.next_if(|t| (t.a, t.b, t.image) < key).is_some() {}
            let branch = scene.branch(near.a, near.b, near.image);
            let distance = branch.norm();
            let (ra, rb) = (scene.radii[near.a as usize], scene.radii[near.b as usize]);
            let touch = self.nearer.get(&key).copied().unwrap_or(ra + rb);
            if distance >= touch || distance == 0.0 {
                continue;
            }
            let normal = branch / distance;
            let mut pair = match before.next_if(|t| (t.a, t.b, t.image) == key) {
                Some(known) => known,
                None => TouchingPair {
                    a: near.a,
                    b: near.b,
                    image: near.image,
                    touch,
                    normal,
                    shear: Vector3::zeros(),
                    force: Vector3::zeros(),
                },
            };
            let kn = self.law.normal_stiffness(ra, rb);
            let (wa, wb) = (ra / (ra + rb), rb / (ra + rb));
            let turned = [scene.turned[near.a as usize], scene.turned[near.b as usize]];
            let push = kn * (touch - distance);
            self.friction += self.law.slide(&mut pair, &normal, distance, push, kn, [wa, wb], turned);
            pair.force = pair.shear - push * normal;
            add(near.a as usize, &pair.force, &(wa * branch).cross(&pair.force));
            add(near.b as usize, &-pair.force, &(wb * branch).cross(&pair.force));
            let kt = kn * self.law.tangential_ratio;
            let shear = if kt > 0.0 { 0.5 * pair.shear.norm_squared() / kt } else { 0.0 };
            sums.energy += 0.5 * push * (touch - distance) + shear;
            sums.virial += pair.force * branch.transpose();
            self.touching.push(pair);
        }
        sums
    }
}

impl ContactLaw {
    /// Advance the shear force of a pair to its new direction; what friction took (J).
    #[allow(clippy::too_many_arguments)] // one contact's geometry
    fn slide(
        &self,
        pair: &mut TouchingPair,
        normal: &Vector3<f64>,
        distance: f64,
        push: f64,
        kn: f64,
        [wa, wb]: [f64; 2],
        turned: [Vector3<f64>; 2],
    ) -> f64 {
        let [ra, rb] = turned.map(|by| UnitQuaternion::new_unchecked(increment(&by)));
        let across = |v: Vector3<f64>| v - normal * normal.dot(&v);
        // The old direction, carried by both spheres: where they would have it now if nothing slipped.
        let carried = wa * (ra * pair.normal) + wb * (rb * pair.normal);
        let slip = -distance * across(carried);
        let old = pair.shear.norm();
        let turned = across(wa * (ra * pair.shear) + wb * (rb * pair.shear));
        let size = turned.norm();
        let turned = if size > 0.0 { turned * (old / size) } else { turned };
        let kt = kn * self.tangential_ratio;
        let trial = turned + kt * slip;
        let (size, limit) = (trial.norm(), self.friction * push);
        pair.normal = *normal;
        if size <= limit {
            pair.shear = trial;
            return 0.0;
        }
        pair.shear = if size > 0.0 { trial * (limit / size) } else { trial };
        // Sliding distance (size − limit)/k_t under the force μN.
        if kt > 0.0 { limit * (size - limit) / kt } else { 0.0 }
    }
}

impl Scene<'_> {
    /// From a to image s of b (m).
    pub(super) fn branch(&self, a: u32, b: u32, image: [i32; 3]) -> Vector3<f64> {
        let shift = self
            .cell
            .map_or(Vector3::zeros(), |(f, edges)| f * edges.component_mul(&Vector3::from(image.map(f64::from))));
        self.positions[b as usize] - self.positions[a as usize] + shift
    }
}

/// A pair from its smaller number, or along the positive image of itself.
pub(super) fn ordered(a: u32, b: u32, image: [i32; 3]) -> Pair {
    let back = image.map(|s| -s);
    if a < b || (a == b && image >= back) { (a, b, image) } else { (b, a, back) }
}

/// All pairs within `reach` times the sum of radii, in order.
///
/// A deformed cell is searched in the rectangle it came from, y = F⁻¹ x, where distances grow by no more than 1/(the
/// smallest stretch of F).
fn near_pairs(scene: &Scene, reach: f64) -> Result<Vec<Near>> {
    let (edges, back, shrink) = match scene.cell {
        None => (None, Matrix3::identity(), 1.0),
        Some((stretch, edges)) => {
            let least = stretch.singular_values().min();
            let back = stretch
                .try_inverse()
                .filter(|_| least > 0.0)
                .ok_or_else(|| Error::diverged("the periodic cell has collapsed", "deform it less"))?;
            (Some(edges), back, least)
        }
    };
    let points: Vec<Vector3<f64>> = scene.positions.iter().map(|x| back * x).collect();
    let packing = Packing::new(edges, points.clone(), scene.radii.to_vec())?;
    let found = contacts(&packing, reach / shrink)?;
    let mut near: Vec<Near> = found
        .iter()
        .map(|c| {
            let image = edges.map_or([0; 3], |edges| {
                let rest = c.branch - (points[c.b as usize] - points[c.a as usize]);
                let s = rest.component_div(&edges).map(f64::round);
                [s.x as i32, s.y as i32, s.z as i32]
            });
            let (a, b, image) = ordered(c.a, c.b, image);
            Near { a, b, image }
        })
        .filter(|n| {
            let limit = reach * (scene.radii[n.a as usize] + scene.radii[n.b as usize]);
            scene.branch(n.a, n.b, n.image).norm() <= limit
        })
        .collect();
    near.sort_unstable_by_key(|n| (n.a, n.b, n.image));
    near.dedup_by_key(|n| (n.a, n.b, n.image));
    Ok(near)
}
