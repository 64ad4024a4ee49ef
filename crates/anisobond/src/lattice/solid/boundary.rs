//! The surface that a solid shares with a body, as small pieces of exact area, and the nodes that carry them.
//!
//! The surface of a solid is part of the surfaces of the boxes, cylinders, balls, planes and triangles that it is made of.
//! Each of these is cut into pieces by its own coordinates, whose areas are exact. A piece belongs to the shared surface
//! where a short step through it, along its normal, enters or leaves both the solid and the body; pieces that edges cut are
//! halved until what is left of them is small. So areas are those of the surface to about 10⁻³, whatever cuts it.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::{Patch, Solid};

/// A step through the surface, in sizes of pieces: solids that differ by less share their surface.
const STEP: f64 = 0.1;

/// Pieces that edges cut are halved so often.
const HALVINGS: usize = 5;

/// Most pieces along one coordinate at first; larger ones are halved where they are looked at.
const MOST_PIECES: f64 = 1024.0;

/// Normals of the pieces of one patch differ from that of its first by no more (cosine).
const SAME: f64 = 0.995;

/// The box in which a surface is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Its least coordinates (m), finite.
    pub low: Vector3<f64>,
    /// Its largest coordinates (m), finite.
    pub high: Vector3<f64>,
    /// Axes along which the body is periodic: nothing outside of the box is looked at there.
    pub periodic: [bool; 3],
}

/// The surface that a solid shares with a body, shared out to nodes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// What each node carries; a node may have several patches, of different normals.
    pub patches: Vec<Patch>,
    /// ∫ n dA (m²), n out of the body.
    pub normal: Vector3<f64>,
    /// ∫ x dA (m³).
    pub moment: Vector3<f64>,
    /// ∫ x × n dA (m³).
    pub turning: Vector3<f64>,
}

impl Surface {
    /// ∫ dA (m²).
    pub fn area(&self) -> f64 {
        self.patches.iter().map(|p| p.area).sum()
    }

    /// Pieces of a surface, each given to a node, in the order of nodes.
    pub(super) fn shared(pieces: &[Piece], owner: impl Fn(&Vector3<f64>) -> Option<u32> + Sync) -> Self {
        let owners: Vec<Option<u32>> = pieces.par_iter().map(|piece| owner(&piece.point)).collect();
        let mut of = std::collections::BTreeMap::<u32, Vec<(Vector3<f64>, Vector3<f64>, f64)>>::new();
        let mut surface = Surface::default();
        for (piece, owner) in pieces.iter().zip(owners) {
            let (Some(node), Piece { point, normal, area }) = (owner, piece) else { continue };
            surface.normal += normal * *area;
            surface.moment += point * *area;
            surface.turning += point.cross(normal) * *area;
            let groups = of.entry(node).or_default();
            match groups.iter_mut().find(|(first, _, _)| first.dot(normal) > SAME) {
                Some((_, sum, all)) => {
                    *sum += normal * *area;
                    *all += area;
                }
                None => groups.push((*normal, normal * *area, *area)),
            }
        }
        let patches = of.into_iter().flat_map(|(node, groups)| {
            groups.into_iter().map(move |(_, sum, area)| Patch { node, area, normal: sum.normalize() })
        });
        surface.patches = patches.collect();
        surface
    }
}

/// A small piece of surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub point: Vector3<f64>,
    /// Unit normal out of the body.
    pub normal: Vector3<f64>,
    /// m².
    pub area: f64,
}

/// The surface that a solid shares with a body, in pieces of about a size (m).
pub(super) fn shared_surface(solid: &Solid, body: &Solid, window: &Window, size: f64) -> Vec<Piece> {
    let mut parts = Vec::new();
    collect(solid, Matrix3::identity(), Vector3::zeros(), &mut parts);
    let look = Look { solid, body, window, size, parts: &parts };
    let sheets: Vec<Sheet> = parts.iter().flat_map(|part| part.sheets(window, size)).collect();
    sheets.par_iter().flat_map_iter(|sheet| look.pieces(sheet)).collect()
}

/// A solid that is made of no others, turned by R and then shifted by t.
struct Part<'s> {
    solid: &'s Solid,
    rotation: Matrix3<f64>,
    shift: Vector3<f64>,
}

fn collect<'s>(solid: &'s Solid, rotation: Matrix3<f64>, shift: Vector3<f64>, parts: &mut Vec<Part<'s>>) {
    match solid {
        Solid::Union(all) | Solid::Intersection(all) => {
            all.iter().for_each(|s| collect(s, rotation, shift, parts));
        }
        Solid::Difference(from, minus) => {
            collect(from, rotation, shift, parts);
            minus.iter().for_each(|s| collect(s, rotation, shift, parts));
        }
        Solid::Moved { solid, rotation: inner, shift: by } => {
            collect(solid, rotation * inner, rotation * by + shift, parts);
        }
        Solid::Box { .. }
        | Solid::Cylinder { .. }
        | Solid::Sphere { .. }
        | Solid::HalfSpace { .. }
        | Solid::Mesh(_) => {
            parts.push(Part { solid, rotation, shift });
        }
    }
}

/// A smooth sheet over a rectangle of two coordinates.
struct Sheet {
    form: Form,
    rotation: Matrix3<f64>,
    shift: Vector3<f64>,
    ranges: [[f64; 2]; 2],
    pieces: [usize; 2],
}

/// Sheets in the axes of their part; e, f, n is a right-handed frame.
enum Form {
    /// origin + u e + v f.
    Plane { origin: Vector3<f64>, e: Vector3<f64>, f: Vector3<f64> },
    /// u the distance from the middle, v the angle.
    Disc { centre: Vector3<f64>, frame: [Vector3<f64>; 3] },
    /// u the angle, v along the axis.
    Tube { centre: Vector3<f64>, frame: [Vector3<f64>; 3], radius: f64 },
    /// u the angle from z, v the one around it.
    Ball { centre: Vector3<f64>, radius: f64 },
    /// a + u (b − a) + u v (c − b).
    Triangle { a: Vector3<f64>, ab: Vector3<f64>, bc: Vector3<f64> },
}

impl Form {
    /// Point and unit normal.
    fn at(&self, u: f64, v: f64) -> (Vector3<f64>, Vector3<f64>) {
        match self {
            Form::Plane { origin, e, f } => (origin + e * u + f * v, e.cross(f)),
            Form::Disc { centre, frame: [e, f, n] } => (centre + (e * v.cos() + f * v.sin()) * u, *n),
            Form::Tube { centre, frame: [e, f, n], radius } => {
                let out = e * u.cos() + f * u.sin();
                (centre + out * *radius + n * v, out)
            }
            Form::Ball { centre, radius } => {
                let out = Vector3::new(u.sin() * v.cos(), u.sin() * v.sin(), u.cos());
                (centre + out * *radius, out)
            }
            Form::Triangle { a, ab, bc } => (a + ab * u + bc * (u * v), ab.cross(bc).normalize()),
        }
    }

    /// Area (m²) of a rectangle of coordinates.
    fn area(&self, [u, v]: &[[f64; 2]; 2]) -> f64 {
        let spans = (u[1] - u[0]) * (v[1] - v[0]);
        match self {
            Form::Plane { .. } => spans,
            Form::Disc { .. } => 0.5 * (u[0] + u[1]) * spans,
            Form::Tube { radius, .. } => radius * spans,
            Form::Ball { radius, .. } => radius * radius * (u[0].cos() - u[1].cos()) * (v[1] - v[0]),
            Form::Triangle { ab, bc, .. } => 0.5 * ab.cross(bc).norm() * (u[0] + u[1]) * spans,
        }
    }
}

/// An even number of pieces of about a size in a length, so that the middle is between two.
fn pieces(length: f64, size: f64) -> usize {
    2 * (0.5 * (length / size).min(MOST_PIECES) - 1e-6).ceil().max(1.0) as usize
}

/// A right-handed frame whose third axis is n (unit).
fn frame(n: &Vector3<f64>) -> [Vector3<f64>; 3] {
    let e = (Vector3::ith(n.iamin(), 1.0) - n * n[n.iamin()]).normalize();
    [e, n.cross(&e), *n]
}

impl Part<'_> {
    fn contains(&self, x: &Vector3<f64>) -> bool {
        self.solid.contains(&self.rotation.tr_mul(&(x - self.shift)), 0.0)
    }

    /// The sheets of its surface, as far as the window may show them.
    fn sheets(&self, window: &Window, size: f64) -> Vec<Sheet> {
        let centre = self.rotation.tr_mul(&(0.5 * (window.low + window.high) - self.shift));
        let edges = window.high - window.low;
        // How far the window reaches along a direction of the part's axes: exactly along a periodic axis, else a little further.
        let reach = |d: &Vector3<f64>| {
            let d = (self.rotation * d).abs();
            let exact = (0..3).any(|a| window.periodic[a] && d[a] > 1.0 - 1e-12);
            0.5 * d.dot(&edges) + if exact { 0.0 } else { size }
        };
        let sheet = |form: Form, ranges: [[f64; 2]; 2], scale: [f64; 2]| {
            let pieces = [0, 1].map(|i| pieces((ranges[i][1] - ranges[i][0]) * scale[i], size));
            Sheet { form, rotation: self.rotation, shift: self.shift, ranges, pieces }
        };
        let near = |d: &Vector3<f64>, from: &Vector3<f64>, low: f64, high: f64| {
            let (middle, reach) = (d.dot(&(centre - from)), reach(d));
            [low.max(middle - reach), high.min(middle + reach)]
        };
        match self.solid {
            Solid::Box { min, max } => {
                let side = |n: usize| {
                    let (a, at) = (n / 2, if n.is_multiple_of(2) { min } else { max }[n / 2]);
                    let (b, c) = ((a + 1) % 3, (a + 2) % 3);
                    let ranges = [b, c].map(|i| near(&Vector3::ith(i, 1.0), &Vector3::zeros(), min[i], max[i]));
                    let shown = (at - centre[a]).abs() <= reach(&Vector3::ith(a, 1.0)) + size
                        && ranges.iter().all(|r| r[0] < r[1]);
                    let form =
                        Form::Plane { origin: Vector3::ith(a, at), e: Vector3::ith(b, 1.0), f: Vector3::ith(c, 1.0) };
                    shown.then(|| sheet(form, ranges, [1.0; 2]))
                };
                (0..6).filter_map(side).collect()
            }
            Solid::Cylinder { centre: middle, axis, radius, half_length } => {
                let frame = frame(axis);
                let along = near(axis, middle, -half_length, *half_length);
                let mut all = Vec::new();
                if along[0] < along[1] {
                    let form = Form::Tube { centre: *middle, frame, radius: *radius };
                    all.push(sheet(form, [[0.0, TAU], along], [*radius, 1.0]));
                }
                for end in [-half_length, *half_length].into_iter().filter(|end| end.is_finite()) {
                    let form = Form::Disc { centre: middle + axis * end, frame };
                    all.push(sheet(form, [[0.0, *radius], [0.0, TAU]], [1.0, *radius]));
                }
                all
            }
            Solid::Sphere { centre: middle, radius } => {
                let form = Form::Ball { centre: *middle, radius: *radius };
                vec![sheet(form, [[0.0, PI], [0.0, TAU]], [*radius; 2])]
            }
            Solid::HalfSpace { point, normal } => {
                let [e, f, n] = frame(normal);
                let origin = centre - n * n.dot(&(centre - point));
                let ranges = [e, f].map(|d| [-reach(&d), reach(&d)]);
                vec![sheet(Form::Plane { origin, e, f }, ranges, [1.0; 2])]
            }
            Solid::Mesh(mesh) => {
                let triangle = |[a, b, c]: &[Vector3<f64>; 3]| {
                    let (ab, bc) = (b - a, c - b);
                    let flat = ab.cross(&bc).norm() <= 1e-12 * ab.norm() * bc.norm();
                    let form = Form::Triangle { a: *a, ab, bc };
                    (!flat).then(|| sheet(form, [[0.0, 1.0]; 2], [ab.norm().max((ab + bc).norm()), bc.norm()]))
                };
                mesh.triangles().iter().filter_map(triangle).collect()
            }
            // Made of others, which are parts of their own.
            Solid::Union(_) | Solid::Intersection(_) | Solid::Difference(..) | Solid::Moved { .. } => Vec::new(),
        }
    }
}

/// What is looked for, and where.
struct Look<'a> {
    solid: &'a Solid,
    body: &'a Solid,
    window: &'a Window,
    size: f64,
    parts: &'a [Part<'a>],
}

impl Look<'_> {
    fn pieces(&self, sheet: &Sheet) -> Vec<Piece> {
        let [m, n] = sheet.pieces;
        let part = |range: [f64; 2], i: usize, of: usize| {
            let at = |i: usize| range[0] + (range[1] - range[0]) * (i as f64 / of as f64);
            [at(i), at(i + 1)]
        };
        let rows = (0..m).into_par_iter().flat_map_iter(|i| {
            let mut found = Vec::new();
            for j in 0..n {
                self.divide(sheet, [part(sheet.ranges[0], i, m), part(sheet.ranges[1], j, n)], HALVINGS, &mut found);
            }
            found
        });
        rows.collect()
    }

    /// A rectangle of a sheet, halved both ways while it is large, or cut by an edge.
    fn divide(&self, sheet: &Sheet, rectangle: [[f64; 2]; 2], halvings: usize, found: &mut Vec<Piece>) {
        let [u, v] = rectangle;
        let at = |s: f64, t: f64| {
            let (x, n) = sheet.form.at(u[0] + (u[1] - u[0]) * s, v[0] + (v[1] - v[0]) * t);
            (sheet.rotation * x + sheet.shift, sheet.rotation * n)
        };
        const INSET: f64 = 1e-3;
        let (near, far) = (INSET, 1.0 - INSET);
        let (point, normal) = at(0.5, 0.5);
        let corners = [(near, near), (far, near), (near, far), (far, far)].map(|(s, t)| at(s, t));
        let radius = corners.iter().map(|c| (c.0 - point).norm()).fold(0.0, f64::max);
        let beyond = (self.window.low - point).sup(&(point - self.window.high)).max();
        if beyond > 2.0 * radius + self.size {
            return;
        }
        let large = radius > 1.5 * self.size;
        let here = self.outward(&point, &normal);
        let small = radius < 0.2 * self.size;
        let cut = !small && corners.iter().any(|(x, n)| self.outward(x, n).is_some() != here.is_some());
        if large || (cut && halvings > 0) {
            let middle = [0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1])];
            let left = if large { halvings } else { halvings - 1 };
            for u in [[u[0], middle[0]], [middle[0], u[1]]] {
                for v in [[v[0], middle[1]], [middle[1], v[1]]] {
                    self.divide(sheet, [u, v], left, found);
                }
            }
        } else if let Some((normal, times)) = here {
            found.push(Piece { point, normal, area: sheet.form.area(&rectangle) / times });
        }
    }

    /// The normal out of the body where the surface of both passes, and how many parts of the solid have theirs there.
    fn outward(&self, x: &Vector3<f64>, normal: &Vector3<f64>) -> Option<(Vector3<f64>, f64)> {
        let outside = |a: usize| self.window.periodic[a] && !(self.window.low[a]..self.window.high[a]).contains(&x[a]);
        if (0..3).any(outside) {
            return None;
        }
        let step = normal * (STEP * self.size);
        let (below, above) = (x - step, x + step);
        let sides = [&below, &above].map(|x| self.body.contains(x, 0.0));
        if sides[0] == sides[1] || self.solid.contains(&below, 0.0) == self.solid.contains(&above, 0.0) {
            return None;
        }
        let times = self.parts.iter().filter(|p| p.contains(&below) != p.contains(&above)).count().max(1);
        Some((if sides[0] { *normal } else { -normal }, times as f64))
    }
}
