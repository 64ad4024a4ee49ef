//! What the nodes of a problem do not resolve: said, with the errors that docs/bodies.md measures.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::experiment::problem::{Crack, Problem};
use crate::lattice::solid::{Labelled, Thin, filled};
use crate::operator::GridOperator;
use crate::solver::grid::separate_parts;

/// A dimension of fewer nodes than this many horizons is named.
const HORIZONS: f64 = 2.0;

/// A hole or gap of fewer nodes across is named.
const HOLE: usize = 10;

/// Errors of strips of 1, 2, … 6 nodes (–), of their stiffness in tension and in bending, with calibrated truncated neighbourhoods and
/// without: isotropic, ν = ¼, horizon 3 spacings (verification/coarse.py). One node resists no bending.
const TENSION: [[f64; 6]; 2] =
    [[0.125, -0.100, -0.007, -0.003, -0.003, -0.003], [-0.446, -0.284, -0.188, -0.141, -0.114, -0.094]];
const BENDING: [[f64; 6]; 2] =
    [[-1.0, -0.804, -0.329, -0.229, -0.17, -0.129], [-1.0, -0.578, -0.427, -0.339, -0.28, -0.240]];

/// Errors of layers of 1, 2, … 6 nodes in a stack of moduli 4 : 1 (–), of the stiffness along them.
const LAYERS: [[f64; 6]; 2] =
    [[-0.002, -0.004, -0.002, -0.001, -0.001, -0.001], [-0.071, -0.038, -0.025, -0.018, -0.015, -0.012]];

/// Parts that a message lists.
const LISTED: usize = 4;

impl Problem {
    /// Dimensions that too few nodes resolve: thicknesses of the body, its regions, its holes and gaps, and what cracks leave of it.
    pub fn coarse(&self) -> Vec<String> {
        let most = (HORIZONS * self.neighbourhood.horizon() + 1e-9).floor() as usize;
        let (grid, cut) = (&self.body.grid, self.cut_axes());
        let body = filled(&self.body);
        let of_body = |label| if label == 0 { HOLE } else { most };
        let mut said: Vec<String> = Labelled { grid, label: &body, cut: &cut }
            .thin(of_body)
            .iter()
            .map(|thin| if thin.label == 0 { self.hole(thin) } else { self.strip(thin) })
            .collect();
        if self.regions.len() > 1 {
            let regions = Labelled { grid, label: &self.body.region, cut: &cut };
            let thin = regions.thin(|label| if label == 0 { 0 } else { most });
            said.extend(self.layers(&thin));
        }
        said.extend(self.ligaments(most));
        said
    }

    /// Thin regions in one message; `None` if there are none.
    fn layers(&self, thin: &[Thin]) -> Option<String> {
        let thinnest = thin.iter().map(|t| t.across).min()?;
        let calibrated = usize::from(!self.surface_calibration);
        let one = |t: &Thin| {
            let region = &self.regions[usize::from(t.label) - 1].name;
            let axis = ["x", "y", "z"][t.axis];
            format!("{region} ({} along {axis} at {})", nodes(t.across), place(&self.body.grid.position(t.node)))
        };
        let mut listed: Vec<String> = thin.iter().take(LISTED).map(one).collect();
        if thin.len() > LISTED {
            listed.push(format!("{} more", thin.len() - LISTED));
        }
        Some(format!(
            "regions are few nodes across: {}; stacked layers as thin had {:+.1} % of stiffness along them (docs/bodies.md), and across \
             them every interface is as wide as the bonds are long, {:.1} spacings; use a smaller spacing",
            listed.join(", "),
            100.0 * LAYERS[calibrated][thinnest.clamp(1, 6) - 1],
            self.neighbourhood.horizon()
        ))
    }

    fn strip(&self, thin: &Thin) -> String {
        let calibrated = usize::from(!self.surface_calibration);
        let number = |table: &[[f64; 6]; 2]| 100.0 * table[calibrated][thin.across.clamp(1, 6) - 1];
        let bending = match thin.across {
            1 => "it has no stiffness in bending".to_string(),
            _ => format!("{:+.0} % in bending", number(&BENDING)),
        };
        let plane_stress = match thin.across <= 2 && self.regions.len() == 1 {
            true => {
                "; for plane stress take plane_strain with hybrid bonds, E (1 + 2ν)/(1 + ν)² and ν/(1 + ν) instead of E and ν, or 3 \
                 nodes and more across"
            }
            false => "",
        };
        format!(
            "the body is {} across along {} at {} ({} nodes found): a strip as thin had {:+.1} % of stiffness in tension and {bending} \
             (docs/bodies.md); use a smaller spacing{plane_stress}",
            nodes(thin.across),
            ["x", "y", "z"][thin.axis],
            place(&self.body.grid.position(thin.node)),
            thin.nodes,
            number(&TENSION)
        )
    }

    fn hole(&self, thin: &Thin) -> String {
        let errors = match (thin.across, self.surface_calibration) {
            (..=6, true) => "14 to 27 %",
            (_, true) => "8 %",
            (..=6, false) => "38 to 52 %",
            (_, false) => "25 %",
        };
        format!(
            "a hole or gap is {} across along {} at {}: round holes as wide opened {errors} too far under pressure (docs/bodies.md), \
             and bonds of {:.1} spacings pass over gaps that are narrower; use a smaller spacing",
            nodes(thin.across),
            ["x", "y", "z"][thin.axis],
            place(&self.body.grid.position(thin.node)),
            self.neighbourhood.horizon()
        )
    }

    /// By node, a bit per axis: whether a crack cuts its bond to the next node; empty without cracks.
    fn cut_axes(&self) -> Vec<u8> {
        let (body, spacing) = (&self.body, self.body.grid.spacing);
        if self.cracks.is_empty() {
            return Vec::new();
        }
        let bits = |node: usize| {
            let p = body.grid.position(node);
            let cut = |axis: usize| {
                let q = p + Vector3::ith(axis, spacing);
                self.cracks.iter().any(|crack| crack.cuts(&p, &q, Crack::TIE * spacing))
            };
            if body.has(node) { (0..3).map(|axis| u8::from(cut(axis)) << axis).sum() } else { 0 }
        };
        (0..body.grid.len()).into_par_iter().map(bits).collect()
    }

    /// What flat cracks leave between their tips and a face or another crack.
    fn ligaments(&self, most: usize) -> Vec<String> {
        let mut said = Vec::new();
        for (number, crack) in self.cracks.iter().enumerate() {
            for (tip, outward) in tips(crack) {
                let spacing = self.body.grid.spacing;
                let at = |steps: usize| tip + outward * (steps as f64 * spacing);
                let ends = |steps: &usize| {
                    let others = self.cracks.iter().enumerate().filter(|(n, _)| *n != number);
                    let crossed =
                        others.map(|(_, c)| c).any(|c| c.cuts(&at(steps - 1), &at(*steps), Crack::TIE * spacing));
                    crossed || !self.has_at(&at(*steps))
                };
                let inside = self.has_at(&(tip + outward * (0.25 * spacing)));
                if let Some(steps) = (1..=most).find(ends).filter(|_| inside) {
                    said.push(format!(
                        "the tip of crack {} at {} is {} from a face or another crack: what is left is a strip of so many nodes \
                         (docs/bodies.md); use a smaller spacing",
                        number + 1,
                        place(&tip),
                        nodes(steps)
                    ));
                }
            }
        }
        said
    }

    /// Whether a point is in the cell of a node of the body.
    fn has_at(&self, x: &Vector3<f64>) -> bool {
        let grid = &self.body.grid;
        let mut at = [0; 3];
        for a in 0..3 {
            let n = grid.nodes[a] as i64;
            let i = ((x[a] - grid.origin[a]) / grid.spacing).round() as i64;
            let i = if grid.periodic[a] { i.rem_euclid(n) } else { i };
            if !(0..n).contains(&i) {
                return false;
            }
            at[a] = i as usize;
        }
        self.body.has(grid.index(at))
    }
}

/// Middles of the edges of a flat crack, with the directions in which it would grow there.
fn tips(crack: &Crack) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    match crack {
        Crack::Disc { radius, .. } if !radius.is_finite() => Vec::new(),
        Crack::Disc { centre, normal, radius } => {
            let first = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
            let second = normal.cross(&first);
            let out = |i: usize| {
                let angle = std::f64::consts::FRAC_PI_8 * i as f64;
                first * angle.cos() + second * angle.sin()
            };
            (0..16).map(out).map(|out| (centre + out * *radius, out)).collect()
        }
        Crack::Parallelogram { corner, a, b } => {
            let edges = [(0.5 * b, -a), (a + 0.5 * b, *a), (0.5 * a, -b), (b + 0.5 * a, *b)];
            edges.map(|(from, out)| (corner + from, out.normalize())).to_vec()
        }
    }
}

/// Warnings of a body that bonds do not hold together as one.
pub(super) fn parts(operator: &dyn GridOperator) -> Vec<String> {
    let mut parts = separate_parts(operator);
    if parts.is_empty() {
        return Vec::new();
    }
    parts.sort_by_key(|part| std::cmp::Reverse(part.nodes.len()));
    let one = |i: usize| format!("{} around {}", nodes(parts[i].nodes.len()), place(&parts[i].centre()));
    let mut listed: Vec<String> = (0..parts.len().min(LISTED)).map(one).collect();
    if parts.len() > LISTED {
        listed.push(format!("{} smaller ones", parts.len() - LISTED));
    }
    vec![format!(
        "the bonds join the nodes into {} parts, not one: {}; bodies on grids have no contact, so each moves for itself",
        parts.len(),
        listed.join(", ")
    )]
}

fn nodes(n: usize) -> String {
    if n == 1 { "1 node".into() } else { format!("{n} nodes") }
}

fn place(x: &Vector3<f64>) -> String {
    format!("({:.4e}, {:.4e}, {:.4e}) m", x.x, x.y, x.z)
}
