//! Closed surfaces of triangles: distance to them, and what they enclose.

use nalgebra::Vector3;

use super::closed::closed;
use crate::{Error, Result};

pub(super) type Triangle = [Vector3<f64>; 3];

/// Triangles of one leaf of the tree.
const LEAF: usize = 4;

/// Directions of rays that no drawing uses; the next is taken where one grazes an edge.
const RAYS: [[f64; 3]; 5] = [
    [0.577_215_664_9, 0.261_497_212_8, 0.771_342_311_1],
    [-0.414_682_509_8, 0.847_110_392_7, 0.332_514_680_3],
    [0.182_817_331_4, -0.692_147_180_6, 0.697_215_442_9],
    [-0.739_085_133_2, -0.302_775_637_7, 0.601_907_230_2],
    [0.236_067_977_5, 0.521_598_775_6, -0.818_588_223_4],
];

/// A closed surface of triangles, in a tree of boxes.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    triangles: Vec<Triangle>,
    tree: Vec<Branch>,
}

/// A box, and what it holds: two branches, or a few triangles.
#[derive(Clone, Debug, PartialEq)]
struct Branch {
    low: Vector3<f64>,
    high: Vector3<f64>,
    /// First triangle, and one past the last.
    range: (usize, usize),
    /// The two halves, unless a leaf.
    halves: Option<(usize, usize)>,
}

impl Mesh {
    /// A surface (m). Triangles without area are left out; corners that differ by a rounding, up to 10⁻⁵ of the surface's size, are
    /// made one where it is not closed without.
    ///
    /// # Errors
    /// No triangle, coordinates that are not finite, or a surface with a gap: an edge of an odd number of triangles.
    pub fn new(mut triangles: Vec<Triangle>) -> Result<Self> {
        if let Some(n) = triangles.iter().position(|t| t.iter().any(|p| p.iter().any(|x| !x.is_finite()))) {
            return Err(Error::input(format!("triangle {} of the surface is not finite", n + 1), "export it again"));
        }
        triangles.retain(|[a, b, c]| a != b && b != c && c != a);
        if triangles.is_empty() {
            return Err(Error::input("the surface has no triangles", "export it as a closed surface"));
        }
        let mut mesh = Mesh { triangles: closed(triangles)?, tree: Vec::new() };
        mesh.grow(0, mesh.triangles.len());
        Ok(mesh)
    }

    /// The triangles (m).
    pub(super) fn triangles(&self) -> &[Triangle] {
        &self.triangles
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Whether there are no triangles; [`Mesh::new`] refuses such.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Least and largest coordinates (m).
    pub fn bounds(&self) -> [Vector3<f64>; 2] {
        [self.tree[0].low, self.tree[0].high]
    }

    /// Signed distance (m), negative inside.
    pub fn distance(&self, x: &Vector3<f64>) -> f64 {
        let distance = self.squared_distance(x).sqrt();
        if self.encloses(x) { -distance } else { distance }
    }

    /// Whether a ray from the point leaves the surface once more than it enters; by the winding number where every ray
    /// grazes an edge.
    pub fn encloses(&self, x: &Vector3<f64>) -> bool {
        let [low, high] = self.bounds();
        if (0..3).any(|a| x[a] < low[a] || x[a] > high[a]) {
            return false;
        }
        let parity = RAYS.iter().find_map(|d| self.crossings(x, &Vector3::from(*d)));
        parity.map_or_else(|| self.winding(x).abs() > 0.5, |n| n % 2 == 1)
    }

    /// How often the surface winds around a point: the sum of its triangles' solid angles over 4π (Van Oosterom and
    /// Strackee 1983). Needs triangles that face one way.
    pub fn winding(&self, x: &Vector3<f64>) -> f64 {
        let angle = |t: &Triangle| {
            let [a, b, c] = t.map(|p| p - x);
            let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
            let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
            2.0 * a.dot(&b.cross(&c)).atan2(below)
        };
        self.triangles.iter().map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
    }

    /// A branch of the triangles of a range, which it sorts, split in the middle of their longest extent.
    fn grow(&mut self, from: usize, to: usize) -> usize {
        let part = &mut self.triangles[from..to];
        let corners = || part.iter().flatten();
        let low = corners().fold(Vector3::repeat(f64::INFINITY), |low, p| low.inf(p));
        let high = corners().fold(Vector3::repeat(f64::NEG_INFINITY), |high, p| high.sup(p));
        let at = self.tree.len();
        self.tree.push(Branch { low, high, range: (from, to), halves: None });
        if to - from > LEAF {
            let axis = (high - low).imax();
            let middle = (to - from) / 2;
            let centre = |t: &Triangle| t[0][axis] + t[1][axis] + t[2][axis];
            part.select_nth_unstable_by(middle, |a, b| centre(a).total_cmp(&centre(b)));
            let halves = (self.grow(from, from + middle), self.grow(from + middle, to));
            self.tree[at].halves = Some(halves);
        }
        at
    }

    fn squared_distance(&self, x: &Vector3<f64>) -> f64 {
        let to_box = |b: &Branch| (b.low - x).sup(&(x - b.high)).map(|d| d.max(0.0)).norm_squared();
        let mut best = f64::INFINITY;
        let mut todo = vec![(to_box(&self.tree[0]), 0)];
        while let Some((distance, at)) = todo.pop() {
            if distance >= best {
                continue;
            }
            let branch = &self.tree[at];
            match branch.halves {
                None => {
                    let leaf = &self.triangles[branch.range.0..branch.range.1];
                    best = leaf.iter().map(|t| (nearest_point(x, t) - x).norm_squared()).fold(best, f64::min);
                }
                Some((a, b)) => {
                    let (a, b) = ((to_box(&self.tree[a]), a), (to_box(&self.tree[b]), b));
                    // The nearer half last, so that it is looked at first.
                    todo.extend(if a.0 < b.0 { [b, a] } else { [a, b] });
                }
            }
        }
        best
    }

    /// Triangles that a ray passes through; `None` if it grazes an edge or lies in a triangle's plane.
    fn crossings(&self, x: &Vector3<f64>, direction: &Vector3<f64>) -> Option<usize> {
        let mut count = 0;
        let mut todo = vec![0];
        while let Some(at) = todo.pop() {
            let branch = &self.tree[at];
            if !meets(branch, x, direction) {
                continue;
            }
            match branch.halves {
                Some((a, b)) => todo.extend([a, b]),
                None => {
                    for triangle in &self.triangles[branch.range.0..branch.range.1] {
                        count += usize::from(passes(triangle, x, direction)?);
                    }
                }
            }
        }
        Some(count)
    }
}

/// Whether a ray meets a box (slabs).
fn meets(branch: &Branch, x: &Vector3<f64>, direction: &Vector3<f64>) -> bool {
    let (mut near, mut far) = (0.0_f64, f64::INFINITY);
    for a in 0..3 {
        let (s, t) = ((branch.low[a] - x[a]) / direction[a], (branch.high[a] - x[a]) / direction[a]);
        near = near.max(s.min(t));
        far = far.min(s.max(t));
    }
    // Wider by rounding: flat boxes must not be missed.
    near <= far + 1e-12 * (1.0 + far.abs())
}

/// Whether a ray passes through a triangle (Möller and Trumbore 1997); `None` where rounding would decide.
fn passes(t: &Triangle, x: &Vector3<f64>, direction: &Vector3<f64>) -> Option<bool> {
    const CLOSE: f64 = 1e-10;
    let (a, b) = (t[1] - t[0], t[2] - t[0]);
    let p = direction.cross(&b);
    let determinant = a.dot(&p);
    let s = x - t[0];
    let q = s.cross(&a);
    if determinant.abs() < CLOSE * a.norm() * b.norm() {
        // Parallel: harmless unless the ray lies in the plane of the triangle.
        let height = s.dot(&a.cross(&b)).abs();
        return (height > CLOSE * a.norm() * b.norm() * (a.norm() + b.norm() + s.norm())).then_some(false);
    }
    let (u, v, way) = (s.dot(&p) / determinant, direction.dot(&q) / determinant, b.dot(&q) / determinant);
    let w = 1.0 - u - v;
    let least = u.min(v).min(w);
    let size = a.norm().max(b.norm());
    if least < -CLOSE || way < -CLOSE * size {
        return Some(false);
    }
    (least > CLOSE && way > CLOSE * size).then_some(true)
}

/// The point of a triangle nearest to another (Ericson, Real-Time Collision Detection, 5.1.5).
fn nearest_point(x: &Vector3<f64>, &[a, b, c]: &Triangle) -> Vector3<f64> {
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (ab.dot(&(x - a)), ac.dot(&(x - a)));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let (d3, d4) = (ab.dot(&(x - b)), ac.dot(&(x - b)));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let (d5, d6) = (ab.dot(&(x - c)), ac.dot(&(x - c)));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let scale = 1.0 / (va + vb + vc);
    a + ab * (vb * scale) + ac * (vc * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box of twelve triangles whose edges lie along the grid.
    fn block() -> Vec<Triangle> {
        let corner = |n: usize| Vector3::new((n & 1) as f64, (n >> 1 & 1) as f64 * 2.0, (n >> 2 & 1) as f64 * 3.0);
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).map(|t| t.map(corner)).collect()
    }

    #[test]
    fn a_box_of_triangles_is_the_box() {
        let mesh = Mesh::new(block()).unwrap();
        let exact = super::super::Solid::Box { min: Vector3::zeros(), max: Vector3::new(1.0, 2.0, 3.0) };
        for n in 0..3000 {
            let t = f64::from(n);
            let mut x = Vector3::new((0.7 * t).sin(), 1.0 + 1.5 * (1.3 * t).sin(), 1.5 + 2.0 * (2.9 * t).sin());
            if n % 3 == 0 {
                // Points level with corners and edges.
                x = x.map(|c| (c * 4.0).round() / 4.0);
            }
            assert!((mesh.distance(&x).abs() - exact.distance(&x).abs()).abs() < 1e-12, "{x:?}");
            if exact.distance(&x).abs() > 1e-9 {
                assert_eq!(mesh.encloses(&x), exact.distance(&x) < 0.0, "{x:?}");
                assert!((mesh.winding(&x).abs() - f64::from(u8::from(mesh.encloses(&x)))).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn gaps_are_refused() {
        let mut open = block();
        open.pop();
        let message = Mesh::new(open).unwrap_err().to_string();
        assert!(message.contains("not closed") && message.contains("belongs to 1 triangle, and 2 more"), "{message}");
        assert!(Mesh::new(Vec::new()).is_err());
        let mut wild = block();
        wild[3][1].x = f64::NAN;
        assert!(Mesh::new(wild).unwrap_err().to_string().contains("triangle 4"));
    }
}
