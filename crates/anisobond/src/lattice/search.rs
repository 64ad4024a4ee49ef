//! Contact search with one grid of boxes per class of radii.
//!
//! Spheres are sorted into classes whose radii differ by less than a factor of two. A sphere looks for partners in its own
//! class and in those of larger spheres, so that a pair is met from its smaller sphere only and a box never holds many
//! spheres. Boxes are counted beyond the cell, so that every periodic image in reach is met, also where the cell is
//! smaller than the search radius.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::contacts::{Contact, touching_distance};
use super::packing::Packing;

/// Spheres per piece of work; the result does not depend on it.
const SPHERES_PER_TASK: usize = 256;

/// Distances are enlarged by this share before boxes are chosen, so that rounding never hides a box.
const ROUNDING: f64 = 1e-6;

/// Spheres of similar radius, sorted into boxes.
struct Grid {
    /// Class of radii: log₂ of the radius, rounded down.
    class: i32,
    largest_radius: f64,
    /// Corner of box (0, 0, 0) (m).
    origin: Vector3<f64>,
    /// Edges of a box (m).
    edges: Vector3<f64>,
    /// Boxes along each axis.
    count: [i64; 3],
    periodic: bool,
    /// Spheres of box b: `spheres[start[b]..start[b + 1]]`.
    start: Vec<u32>,
    spheres: Vec<Boxed>,
}

/// A sphere in its box.
#[derive(Clone, Copy)]
struct Boxed {
    centre: Vector3<f64>,
    radius: f64,
    number: u32,
}

/// Where the spheres are: the cell, or the box that bounds a free packing.
#[derive(Clone, Copy)]
pub(super) struct Extent {
    origin: Vector3<f64>,
    pub edges: Vector3<f64>,
}

/// Every contact once, sorted by (a, b, image).
pub(super) fn search(packing: &Packing, contact_radius: f64) -> Vec<Contact> {
    let grids = grids(packing, contact_radius);
    let tasks = packing.len().div_ceil(SPHERES_PER_TASK);
    let found: Vec<Vec<Contact>> = (0..tasks)
        .into_par_iter()
        .map(|task| {
            let first = task * SPHERES_PER_TASK;
            let last = packing.len().min(first + SPHERES_PER_TASK);
            let mut contacts = Vec::new();
            for a in first..last {
                let begin = contacts.len();
                contacts_of(a, packing, contact_radius, &grids, &mut contacts);
                contacts[begin..].sort_unstable_by(order);
            }
            contacts
        })
        .collect();
    let mut contacts = found.concat();
    // A contact met from its second sphere stands in the wrong place.
    if grids.len() > 1 {
        contacts.par_sort_unstable_by(order);
    }
    contacts
}

/// (a, b, image). The image in the order of its numbers along z, y, x is that of the branch, of which no two are equal.
fn order(c: &Contact, d: &Contact) -> std::cmp::Ordering {
    let images = || (2..=2).chain(1..=1).chain(0..=0).map(|axis| c.branch[axis].total_cmp(&d.branch[axis]));
    (c.a, c.b).cmp(&(d.a, d.b)).then_with(|| images().find(|o| o.is_ne()).unwrap_or(std::cmp::Ordering::Equal))
}

/// Appends the contacts of a sphere with later spheres of its class and with all larger ones.
fn contacts_of(a: usize, packing: &Packing, contact_radius: f64, grids: &[Grid], contacts: &mut Vec<Contact>) {
    let (centre, radius) = (packing.centres()[a], packing.radii()[a]);
    let cell = packing.cell().unwrap_or_else(Vector3::zeros);
    let class = class_of(radius);
    for grid in grids.iter().filter(|grid| grid.class >= class) {
        let reach = touching_distance(contact_radius, radius + grid.largest_radius) * (1.0 + ROUNDING);
        grid.visit(&centre, reach, |other, image| {
            let b = other.number as usize;
            let forwards = (image[2], image[1], image[0]) > (0, 0, 0);
            if grid.class == class && (b < a || (b == a && !forwards)) {
                return;
            }
            // From the sphere of the smaller number, whichever of the two is the smaller sphere.
            let limit = touching_distance(contact_radius, radius + other.radius);
            let (from, to, sign) = if a <= b { (centre, other.centre, 1.0) } else { (other.centre, centre, -1.0) };
            let shift = cell.component_mul(&Vector3::from(image.map(|n| sign * n as f64)));
            let branch = to - from + shift;
            if branch.norm_squared() <= limit * limit {
                contacts.push(Contact { a: a.min(b) as u32, b: a.max(b) as u32, branch });
            }
        });
    }
}

fn class_of(radius: f64) -> i32 {
    radius.log2().floor() as i32
}

/// One grid per class of radii that occurs, ascending.
fn grids(packing: &Packing, contact_radius: f64) -> Vec<Grid> {
    let extent = extent(packing);
    let mut classes: Vec<i32> = packing.radii().iter().map(|&r| class_of(r)).collect();
    let of_sphere = classes.clone();
    classes.sort_unstable();
    classes.dedup();
    let members = |class: i32| (0..packing.len()).filter(|&i| of_sphere[i] == class).collect::<Vec<_>>();
    classes.iter().map(|&class| Grid::new(class, packing, &members(class), extent, contact_radius)).collect()
}

pub(super) fn extent(packing: &Packing) -> Extent {
    if let Some(edges) = packing.cell() {
        return Extent { origin: Vector3::zeros(), edges };
    }
    let first = packing.centres()[0];
    let low = packing.centres().iter().fold(first, |low, x| low.inf(x));
    let high = packing.centres().iter().fold(first, |high, x| high.sup(x));
    // A flat packing has boxes too.
    let least = packing.radii().iter().copied().fold(0.0, f64::max);
    Extent { origin: low, edges: (high - low).map(|edge| edge.max(least)) }
}

impl Grid {
    fn new(class: i32, packing: &Packing, members: &[usize], extent: Extent, contact_radius: f64) -> Grid {
        let largest_radius = members.iter().map(|&i| packing.radii()[i]).fold(0.0, f64::max);
        let count = box_count(&extent.edges, contact_radius * largest_radius, members.len());
        let mut grid = Grid {
            class,
            largest_radius,
            origin: extent.origin,
            edges: extent.edges.component_div(&Vector3::from(count.map(|n| n as f64))),
            count,
            periodic: packing.cell().is_some(),
            start: Vec::new(),
            spheres: Vec::new(),
        };
        grid.fill(packing, members);
        grid
    }

    /// Counting sort: spheres of a box keep their order.
    fn fill(&mut self, packing: &Packing, members: &[usize]) {
        let boxes: Vec<usize> = members.iter().map(|&i| self.box_of(&packing.centres()[i])).collect();
        let mut start = vec![0u32; (self.count.iter().product::<i64>() + 1) as usize];
        for &b in &boxes {
            start[b + 1] += 1;
        }
        for b in 1..start.len() {
            start[b] += start[b - 1];
        }
        let mut next = start.clone();
        let empty = Boxed { centre: Vector3::zeros(), radius: 0.0, number: 0 };
        self.spheres = vec![empty; members.len()];
        for (&i, &b) in members.iter().zip(&boxes) {
            let sphere = Boxed { centre: packing.centres()[i], radius: packing.radii()[i], number: i as u32 };
            self.spheres[next[b] as usize] = sphere;
            next[b] += 1;
        }
        self.start = start;
    }

    fn box_of(&self, centre: &Vector3<f64>) -> usize {
        let [i, j, k]: [i64; 3] = std::array::from_fn(|axis| {
            let box_number = ((centre[axis] - self.origin[axis]) / self.edges[axis]).floor() as i64;
            box_number.clamp(0, self.count[axis] - 1)
        });
        ((k * self.count[1] + j) * self.count[0] + i) as usize
    }

    /// Calls with every sphere within reach of a point (and some beyond), and the numbers of its periodic image.
    fn visit(&self, point: &Vector3<f64>, reach: f64, mut call: impl FnMut(&Boxed, [i64; 3])) {
        for k in self.range(point, reach, 2) {
            let rest = reach * reach - self.squared_distance(point, k, 2);
            let (image_z, z) = self.split(k, 2);
            for j in self.range(point, reach, 1) {
                let rest = rest - self.squared_distance(point, j, 1);
                if rest < 0.0 {
                    continue;
                }
                let (image_y, y) = self.split(j, 1);
                let row = (z * self.count[1] + y) * self.count[0];
                // Boxes of a row lie one after the other: one slice per image.
                let range = self.range(point, rest.sqrt(), 0);
                let mut i = *range.start();
                while i <= *range.end() {
                    let (image_x, x) = self.split(i, 0);
                    let boxes = (range.end() - i + 1).min(self.count[0] - x);
                    let from = self.start[(row + x) as usize] as usize;
                    let to = self.start[(row + x + boxes) as usize] as usize;
                    for sphere in &self.spheres[from..to] {
                        call(sphere, [image_x, image_y, image_z]);
                    }
                    i += boxes;
                }
            }
        }
    }

    /// Boxes along an axis within reach of a point; beyond the cell where it is periodic.
    fn range(&self, point: &Vector3<f64>, reach: f64, axis: usize) -> std::ops::RangeInclusive<i64> {
        let x = point[axis] - self.origin[axis];
        // The border of a box is uncertain by the rounding of the division that sorted the spheres.
        let reach = reach + ROUNDING * self.edges[axis];
        let low = ((x - reach) / self.edges[axis]).floor() as i64;
        let high = ((x + reach) / self.edges[axis]).floor() as i64;
        if self.periodic { low..=high } else { low.max(0)..=high.min(self.count[axis] - 1) }
    }

    /// A box beyond the cell is the image of one inside: (image, box).
    fn split(&self, box_number: i64, axis: usize) -> (i64, i64) {
        let count = self.count[axis];
        if (0..count).contains(&box_number) {
            return (0, box_number);
        }
        (box_number.div_euclid(count), box_number.rem_euclid(count))
    }

    /// Squared distance (m²) along an axis from a point to a box, less what rounding may hide.
    fn squared_distance(&self, point: &Vector3<f64>, box_number: i64, axis: usize) -> f64 {
        let (x, edge) = (point[axis] - self.origin[axis], self.edges[axis]);
        let low = box_number as f64 * edge;
        let distance = (low - x).max(x - low - edge) - ROUNDING * edge;
        distance.max(0.0).powi(2)
    }
}

/// Boxes along each axis: at least as wide as asked, and with two spheres each or more.
fn box_count(extent: &Vector3<f64>, width: f64, spheres: usize) -> [i64; 3] {
    let most = (0.5 * spheres as f64).max(1.0);
    let width = width.max((extent.product() / most).cbrt());
    let mut count: [i64; 3] = std::array::from_fn(|axis| ((extent[axis] / width).min(most) as i64).max(1));
    while count.iter().map(|&n| n as f64).product::<f64>() > 2.0 * most {
        let longest = (0..3).max_by_key(|&axis| count[axis]).unwrap_or(0);
        count[longest] = (count[longest] + 1) / 2;
    }
    count
}
