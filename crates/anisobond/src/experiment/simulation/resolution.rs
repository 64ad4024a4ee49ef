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

/// Errors of dimensions of few nodes (–), with calibrated truncated neighbourhoods and without: isotropic, central bonds, ν = ¼
/// (verification/coarse.py).
struct Measured {
    /// In spacings.
    horizon: f64,
    /// Strips of 1, 2, … 8 nodes: stiffness in tension and in bending; one node resists none.
    tension: [[f64; 8]; 2],
    bending: [[f64; 8]; 2],
    /// Round holes of radius 2, 3, 4, 5 spacings under pressure: displacement.
    holes: [[f64; 4]; 2],
    /// Layers of 1, 2, … 8 nodes in a stack of moduli 4 : 1: stiffness along them.
    layers: [[f64; 8]; 2],
}

const MEASURED: [Measured; 3] = [
    Measured {
        horizon: 2.0,
        tension: [
            [0.125, 0.000, 0.000, -0.003, -0.002, -0.001, -0.001, -0.001],
            [-0.250, -0.146, -0.095, -0.071, -0.057, -0.048, -0.041, -0.036],
        ],
        bending: [
            [-1.0, -0.429, -0.247, -0.160, -0.110, -0.080, -0.061, -0.048],
            [-1.0, -0.429, -0.277, -0.206, -0.164, -0.136, -0.117, -0.102],
        ],
        holes: [[0.012, 0.171, 0.071, 0.063], [0.113, 0.300, 0.169, 0.163]],
        layers: [
            [-0.085, -0.040, -0.026, -0.020, -0.016, -0.013, -0.011, -0.010],
            [-0.107, -0.057, -0.038, -0.028, -0.023, -0.019, -0.016, -0.014],
        ],
    },
    Measured {
        horizon: 3.0,
        tension: [
            [0.125, -0.100, -0.007, -0.003, -0.004, -0.003, -0.003, -0.002],
            [-0.446, -0.284, -0.188, -0.141, -0.113, -0.094, -0.081, -0.070],
        ],
        bending: [
            [-1.0, -0.804, -0.329, -0.229, -0.170, -0.129, -0.101, -0.081],
            [-1.0, -0.578, -0.427, -0.339, -0.281, -0.240, -0.210, -0.186],
        ],
        holes: [[0.142, 0.223, 0.114, 0.074], [0.380, 0.469, 0.303, 0.240]],
        layers: [
            [-0.129, -0.066, -0.042, -0.031, -0.025, -0.021, -0.018, -0.016],
            [-0.174, -0.098, -0.065, -0.049, -0.039, -0.032, -0.028, -0.024],
        ],
    },
    Measured {
        horizon: 4.0,
        tension: [
            [0.125, -0.100, -0.042, -0.002, -0.005, -0.007, -0.006, -0.005],
            [-0.595, -0.405, -0.285, -0.208, -0.166, -0.139, -0.119, -0.104],
        ],
        bending: [
            [-1.0, -0.894, -0.263, -0.324, -0.231, -0.184, -0.149, -0.121],
            [-1.0, -0.692, -0.550, -0.455, -0.384, -0.333, -0.294, -0.263],
        ],
        holes: [[0.326, 0.319, 0.185, 0.146], [0.675, 0.691, 0.465, 0.392]],
        layers: [
            [-0.149, -0.086, -0.055, -0.040, -0.032, -0.027, -0.023, -0.020],
            [-0.215, -0.130, -0.088, -0.065, -0.052, -0.044, -0.037, -0.033],
        ],
    },
];

impl Measured {
    /// With the nearest horizon that is not smaller, for errors grow with the horizon; else with the largest.
    fn with(horizon: f64) -> &'static Measured {
        let [.., largest] = &MEASURED;
        MEASURED.iter().find(|m| m.horizon > horizon - 1e-9).unwrap_or(largest)
    }

    /// Where the errors are from.
    fn source(&self) -> String {
        format!("docs/bodies.md, isotropic with ν = 0.25, horizon of {} spacings", self.horizon)
    }
}

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
        let measured = Measured::with(self.neighbourhood.horizon());
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
            "regions are few nodes across: {}; stacked layers as thin had {:+.1} % of stiffness along them ({}), grains of as many \
             nodes in the mean less, and across layers every interface is as wide as the bonds are long, {:.1} spacings; use a \
             smaller spacing",
            listed.join(", "),
            100.0 * self.of_thickness(&measured.layers, thinnest),
            measured.source(),
            self.neighbourhood.horizon()
        ))
    }

    /// The error of so many nodes.
    fn of_thickness(&self, errors: &[[f64; 8]; 2], across: usize) -> f64 {
        errors[usize::from(!self.surface_calibration)][across.clamp(1, 8) - 1]
    }

    fn strip(&self, thin: &Thin) -> String {
        let measured = Measured::with(self.neighbourhood.horizon());
        let number = |errors: &[[f64; 8]; 2]| 100.0 * self.of_thickness(errors, thin.across);
        let bending = match thin.across {
            1 => "it has no stiffness in bending".to_string(),
            _ => format!("{:+.0} % in bending", number(&measured.bending)),
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
             ({}); use a smaller spacing{plane_stress}",
            nodes(thin.across),
            ["x", "y", "z"][thin.axis],
            place(&self.body.grid.position(thin.node)),
            thin.nodes,
            number(&measured.tension),
            measured.source()
        )
    }

    fn hole(&self, thin: &Thin) -> String {
        let measured = Measured::with(self.neighbourhood.horizon());
        // The staircase of a radius may be lucky; that of the next ones is not.
        let radii = &measured.holes[usize::from(!self.surface_calibration)][(thin.across / 2).clamp(2, 5) - 2..];
        let error = radii.iter().copied().fold(0.0, f64::max);
        format!(
            "a hole or gap is {} across along {} at {}: round holes as wide opened {:.0} % too far under pressure ({}), \
             and bonds of {:.1} spacings pass over gaps that are narrower; use a smaller spacing",
            nodes(thin.across),
            ["x", "y", "z"][thin.axis],
            place(&self.body.grid.position(thin.node)),
            100.0 * error,
            measured.source(),
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
