//! Overlap removal: the harmonic energy of overlaps is brought to zero by the fast inertial relaxation engine.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::Result;
use crate::lattice::Packing;
use crate::lattice::search::search;

/// Spheres are larger by this share while overlaps are removed, so that in the end none overlap at all.
pub(super) const GAP: f64 = 1e-3;

/// Overlap of the enlarged spheres, relative to the sum of their radii, that leaves the spheres themselves apart.
const ALLOWED: f64 = 0.99 * GAP / (1.0 + GAP);

/// Spheres are larger by this share of their radius (or of the mean radius, if that is larger) while pairs are listed;
/// they are listed anew once a sphere has moved so far.
const MARGIN: f64 = 0.25;

/// The time step and its growth (Bitzek et al., Phys. Rev. Lett. 97, 170201, 2006), in units of √(mass / stiffness).
mod fire {
    pub const FIRST_STEP: f64 = 0.1;
    pub const LARGEST_STEP: f64 = 0.45;
    pub const LONGER: f64 = 1.1;
    pub const SHORTER: f64 = 0.5;
    pub const STEERING: f64 = 0.1;
    pub const LESS_STEERING: f64 = 0.99;
    pub const DOWNHILL: usize = 5;
}

/// The spheres are stuck when this many steps lower the energy by less than a tenth.
const PATIENCE: usize = 300;

/// Steps after which spheres that still move are given up.
const MOST_STEPS: usize = 20_000;

/// Spheres per piece of work; sums are taken piece by piece in their order, so that threads do not change them.
const CHUNK: usize = 512;

/// A sphere enlarged by [`GAP`].
#[derive(Clone, Copy)]
struct Site {
    centre: Vector3<f64>,
    radius: f64,
}

/// A sphere near another, and which of its images (cell numbers).
#[derive(Clone, Copy)]
struct Partner {
    sphere: u32,
    image: [i8; 3],
}

/// Partners of sphere i: `partners[start[i]..start[i + 1]]`, and where the spheres were when listed.
struct Near {
    start: Vec<u32>,
    partners: Vec<Partner>,
    listed_at: Vec<Vector3<f64>>,
}

/// Sums over the spheres that steer the relaxation.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// ½ Σ δ² over the overlaps δ (m²).
    energy: f64,
    force_velocity: f64,
    force_squared: f64,
    velocity_squared: f64,
    /// Overlaps relative to the sum of radii: largest, sum and number (each pair at both its spheres).
    largest: f64,
    sum: f64,
    number: f64,
}

/// What a relaxation came to.
pub(super) struct Relaxed {
    /// Centres (m).
    pub centres: Vec<Vector3<f64>>,
    /// Evaluations of the forces.
    pub steps: usize,
    /// Whether no overlap is left.
    pub free: bool,
    /// Mean overlap relative to the sum of radii, over the overlapping pairs.
    pub mean_overlap: f64,
}

/// Moves spheres in a periodic cell until none overlap, or until they are stuck.
///
/// Minimises E = ½ Σ δ², δ = (1 + gap)(rₐ + r_b) − ℓ > 0 (O'Hern et al., Phys. Rev. E 68, 011306, 2003).
///
/// The observer hears the number of steps and the largest overlap (relative to the sum of radii) and may stop the work.
///
/// # Errors
/// The observer's.
pub(super) fn remove_overlaps(
    edges: &Vector3<f64>,
    centres: Vec<Vector3<f64>>,
    radii: &[f64],
    mut observe: impl FnMut(usize, f64) -> Result<()>,
) -> Result<Relaxed> {
    let mean_radius = radii.iter().sum::<f64>() / radii.len() as f64;
    // A sphere far above the mean has contacts in the ratio of the surfaces.
    let mass: Vec<f64> = radii.iter().map(|r| (r / mean_radius).powi(2).max(1.0)).collect();
    let mut sites: Vec<Site> =
        centres.into_iter().zip(radii).map(|(centre, r)| Site { centre, radius: (1.0 + GAP) * r }).collect();
    let mut velocity = vec![Vector3::zeros(); sites.len()];
    let mut force = velocity.clone();
    let margins: Vec<f64> = radii.iter().map(|r| MARGIN * r.max(mean_radius)).collect();
    let mut near = Near::list(edges, &mut sites, &margins)?;
    let mut fire = Fire::new();
    let mut patience = Patience::new();
    loop {
        if near.is_outdated(&sites, &margins) {
            near = Near::list(edges, &mut sites, &margins)?;
        }
        let sums = forces(edges, &sites, &near, &velocity, &mut force);
        let free = sums.largest <= ALLOWED;
        if patience.is_lost(sums.energy) || free {
            let centres = sites.into_iter().map(|site| site.centre).collect();
            let mean_overlap = sums.sum / sums.number.max(1.0);
            return Ok(Relaxed { centres, steps: patience.steps, free, mean_overlap });
        }
        observe(patience.steps, sums.largest)?;
        let pace = fire.pace(&sums);
        advance(&mut sites, &mut velocity, &force, &mass, pace);
    }
}

/// Whether the energy still falls.
struct Patience {
    steps: usize,
    energy: f64,
}

impl Patience {
    fn new() -> Self {
        Patience { steps: 0, energy: f64::INFINITY }
    }

    /// Counts a step; true once the spheres are stuck or have moved too long.
    fn is_lost(&mut self, energy: f64) -> bool {
        self.steps += 1;
        if !self.steps.is_multiple_of(PATIENCE) {
            return false;
        }
        let stuck = energy > 0.9 * self.energy;
        self.energy = energy;
        stuck || self.steps >= MOST_STEPS
    }
}

/// The fast inertial relaxation engine: downhill it gathers speed, uphill it stops.
struct Fire {
    step: f64,
    steering: f64,
    downhill: usize,
}

/// v ← keep v + turn f + Δt f/m.
#[derive(Clone, Copy)]
struct Pace {
    step: f64,
    keep: f64,
    turn: f64,
}

impl Fire {
    fn new() -> Self {
        Fire { step: fire::FIRST_STEP, steering: fire::STEERING, downhill: 0 }
    }

    /// v ← (1 − α) v + α |v| f/|f| while f·v > 0, else v ← 0 (Bitzek et al., steps F1 to F4).
    fn pace(&mut self, sums: &Sums) -> Pace {
        if sums.force_velocity <= 0.0 {
            (self.downhill, self.steering) = (0, fire::STEERING);
            self.step *= fire::SHORTER;
            return Pace { step: self.step, keep: 0.0, turn: 0.0 };
        }
        self.downhill += 1;
        if self.downhill > fire::DOWNHILL {
            self.step = (self.step * fire::LONGER).min(fire::LARGEST_STEP);
            self.steering *= fire::LESS_STEERING;
        }
        let turn = self.steering * (sums.velocity_squared / sums.force_squared).sqrt();
        Pace { step: self.step, keep: 1.0 - self.steering, turn }
    }
}

impl Near {
    /// Wraps the spheres into the cell and lists the pairs within reach.
    fn list(edges: &Vector3<f64>, sites: &mut [Site], margins: &[f64]) -> Result<Near> {
        let centres = sites.iter().map(|site| site.centre).collect();
        let radii = sites.iter().zip(margins).map(|(site, margin)| site.radius + margin).collect();
        let packing = Packing::new(Some(*edges), centres, radii)?;
        let contacts = search(&packing, 1.0);
        let mut start = vec![0u32; sites.len() + 1];
        for c in &contacts {
            start[c.a as usize + 1] += 1;
            start[c.b as usize + 1] += 1;
        }
        for i in 1..start.len() {
            start[i] += start[i - 1];
        }
        let mut next = start.clone();
        let mut partners = vec![Partner { sphere: 0, image: [0; 3] }; 2 * contacts.len()];
        let mut add = |from: u32, sphere: u32, image: [i8; 3]| {
            partners[next[from as usize] as usize] = Partner { sphere, image };
            next[from as usize] += 1;
        };
        let x = packing.centres();
        for c in &contacts {
            let shift = (c.branch - (x[c.b as usize] - x[c.a as usize])).component_div(edges);
            let image = shift.map(|n| n.round() as i8);
            add(c.a, c.b, image.into());
            add(c.b, c.a, (-image).into());
        }
        sites.iter_mut().zip(x).for_each(|(site, &centre)| site.centre = centre);
        Ok(Near { start, partners, listed_at: x.to_vec() })
    }

    /// Whether a pair that is not listed may overlap: a sphere has moved by more than its share of the margin.
    fn is_outdated(&self, sites: &[Site], margins: &[f64]) -> bool {
        let moved = sites.par_iter().zip(&self.listed_at).zip(margins).with_min_len(4 * CHUNK);
        moved.any(|((site, old), margin)| (site.centre - old).norm_squared() > margin * margin)
    }

    fn of(&self, sphere: usize) -> &[Partner] {
        &self.partners[self.start[sphere] as usize..self.start[sphere + 1] as usize]
    }
}

/// f = −∂E/∂x of every sphere, and the sums.
fn forces(
    edges: &Vector3<f64>,
    sites: &[Site],
    near: &Near,
    velocity: &[Vector3<f64>],
    force: &mut [Vector3<f64>],
) -> Sums {
    let pieces = force.par_chunks_mut(CHUNK).enumerate().map(|(piece, force)| {
        let mut sums = Sums::default();
        for (k, f) in force.iter_mut().enumerate() {
            let i = piece * CHUNK + k;
            *f = force_on(edges, sites, i, near.of(i), &mut sums);
            sums.force_velocity += f.dot(&velocity[i]);
            sums.force_squared += f.norm_squared();
            sums.velocity_squared += velocity[i].norm_squared();
        }
        sums
    });
    pieces.collect::<Vec<_>>().into_iter().fold(Sums::default(), Sums::plus)
}

impl Sums {
    fn plus(self, other: Sums) -> Sums {
        Sums {
            energy: self.energy + other.energy,
            force_velocity: self.force_velocity + other.force_velocity,
            force_squared: self.force_squared + other.force_squared,
            velocity_squared: self.velocity_squared + other.velocity_squared,
            largest: self.largest.max(other.largest),
            sum: self.sum + other.sum,
            number: self.number + other.number,
        }
    }
}

/// f = −Σ δ n over the overlapping partners, n from the sphere to the partner.
fn force_on(edges: &Vector3<f64>, sites: &[Site], i: usize, partners: &[Partner], sums: &mut Sums) -> Vector3<f64> {
    let site = sites[i];
    let mut force = Vector3::zeros();
    for partner in partners {
        let other = sites[partner.sphere as usize];
        let shift = edges.component_mul(&Vector3::from(partner.image.map(f64::from)));
        let branch = other.centre - site.centre + shift;
        let reach = site.radius + other.radius;
        let squared = branch.norm_squared();
        if squared < reach * reach {
            let length = squared.sqrt();
            let overlap = reach - length;
            // Half of the pair's energy at each of its spheres.
            sums.energy += 0.25 * overlap * overlap;
            sums.largest = sums.largest.max(overlap / reach);
            sums.sum += overlap / reach;
            sums.number += 1.0;
            if length > 0.0 {
                force -= branch * (overlap / length);
            }
        }
    }
    force
}

/// v ← keep v + turn f + Δt f/m, x ← x + Δt v.
fn advance(sites: &mut [Site], velocity: &mut [Vector3<f64>], force: &[Vector3<f64>], mass: &[f64], pace: Pace) {
    let Pace { step, keep, turn } = pace;
    sites.par_iter_mut().zip(velocity).zip(force).zip(mass).with_min_len(4 * CHUNK).for_each(|(((site, v), f), m)| {
        *v = *v * keep + f * (turn + step / m);
        site.centre += *v * step;
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::generate::stream::Stream;

    fn energy(edges: &Vector3<f64>, sites: &[Site], near: &Near) -> (f64, Vec<Vector3<f64>>) {
        let mut force = vec![Vector3::zeros(); sites.len()];
        let sums = forces(edges, sites, near, &force.clone(), &mut force);
        (sums.energy, force)
    }

    /// Central differences of the energy; a cell smaller than a diameter counts every image.
    #[test]
    fn force_is_the_slope_of_the_energy() {
        for (edges, number) in [(Vector3::new(4.0, 5.0, 4.5), 40), (Vector3::new(1.7, 3.0, 1.2), 4)] {
            let mut stream = Stream::new(3);
            let mut sites: Vec<Site> = (0..number)
                .map(|_| Site {
                    centre: Vector3::from_fn(|i, _| edges[i] * stream.unit()),
                    radius: 0.6 + 0.3 * stream.unit(),
                })
                .collect();
            let near = Near::list(&edges, &mut sites, &vec![0.2; number]).unwrap();
            let (_, force) = energy(&edges, &sites, &near);
            for (i, axis) in [(0, 0), (1, 1), (3, 2)] {
                let h = 1e-6;
                let at = |x: f64| {
                    let mut moved = sites.clone();
                    moved[i].centre[axis] += x;
                    energy(&edges, &moved, &near).0
                };
                let slope = (at(h) - at(-h)) / (2.0 * h);
                assert!((force[i][axis] + slope).abs() < 1e-7, "{} {slope}", force[i][axis]);
            }
            let sum: Vector3<f64> = force.iter().sum();
            assert!(sum.norm() < 1e-12);
        }
    }
}
