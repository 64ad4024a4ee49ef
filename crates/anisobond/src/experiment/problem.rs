//! A body, how it is loaded, and what is measured: everything a run needs, resolved to nodes.

use std::sync::Arc;

use nalgebra::Vector3;

use super::field::{FieldName, Quantity};
use crate::bond_law::{BondLaw, Brittle};
use crate::calibration::Model;
use crate::lattice::{Body, Neighbourhood};
use crate::operator::Kinematics;
use crate::tensor::{Metric, Stiffness};

/// A number that changes in time (or with the load factor, in equilibrium).
#[derive(Clone, Debug, PartialEq)]
pub enum History {
    /// Always 1.
    Constant,
    /// From 0 at `start` to 1 at `end`, linear between, constant outside.
    Ramp {
        /// Begin (s).
        start: f64,
        /// End (s).
        end: f64,
    },
    /// sin²(π (t − start)/(end − start)) between, 0 outside.
    Pulse {
        /// Begin (s).
        start: f64,
        /// End (s).
        end: f64,
    },
    /// Linear between the points (t, value), t ascending; constant outside.
    Table(Vec<(f64, f64)>),
}

impl History {
    /// The value at time t (s).
    pub fn at(&self, t: f64) -> f64 {
        match self {
            History::Constant => 1.0,
            History::Ramp { start, end } => ((t - start) / (end - start)).clamp(0.0, 1.0),
            History::Pulse { start, end } if (*start..*end).contains(&t) => {
                (std::f64::consts::PI * (t - start) / (end - start)).sin().powi(2)
            }
            History::Pulse { .. } => 0.0,
            History::Table(points) => interpolated(points, t),
        }
    }

    /// The rate of change at time t (1/s).
    pub fn rate(&self, t: f64) -> f64 {
        match self {
            History::Constant => 0.0,
            History::Ramp { start, end } if (*start..*end).contains(&t) => 1.0 / (end - start),
            History::Ramp { .. } => 0.0,
            History::Pulse { start, end } if (*start..*end).contains(&t) => {
                let pi = std::f64::consts::PI;
                pi / (end - start) * (2.0 * pi * (t - start) / (end - start)).sin()
            }
            History::Pulse { .. } => 0.0,
            History::Table(points) => points
                .windows(2)
                .find(|w| (w[0].0..w[1].0).contains(&t))
                .map_or(0.0, |w| (w[1].1 - w[0].1) / (w[1].0 - w[0].0)),
        }
    }
}

/// Linear interpolation, constant outside.
fn interpolated(points: &[(f64, f64)], t: f64) -> f64 {
    let Some(&(first, value)) = points.first() else { return 0.0 };
    if t <= first {
        return value;
    }
    let segment = points.windows(2).find(|w| t <= w[1].0);
    segment
        .map_or_else(|| points[points.len() - 1].1, |w| w[0].1 + (w[1].1 - w[0].1) * (t - w[0].0) / (w[1].0 - w[0].0))
}

/// What holds or drives some nodes.
#[derive(Clone, Debug, PartialEq)]
pub enum Condition {
    /// Components of displacement (m) that are prescribed, times the history.
    Displacement {
        /// Nodes.
        nodes: Vec<u32>,
        /// Prescribed components; `None` is free.
        value: [Option<f64>; 3],
        /// In time.
        history: History,
    },
    /// Components of velocity (m/s) that are prescribed, times the history. In equilibrium an error.
    Velocity {
        /// Nodes.
        nodes: Vec<u32>,
        /// Prescribed components; `None` is free.
        value: [Option<f64>; 3],
        /// In time.
        history: History,
    },
    /// Forces on nodes (N), times the history: tractions, pressures and body forces come to this.
    Force {
        /// Nodes.
        nodes: Vec<u32>,
        /// Force on each (N).
        force: Vec<Vector3<f64>>,
        /// In time.
        history: History,
    },
}

/// A surface through which no bond passes at the start.
#[derive(Clone, Debug, PartialEq)]
pub enum Crack {
    /// A flat disc.
    Disc {
        /// Centre (m).
        centre: Vector3<f64>,
        /// Unit normal.
        normal: Vector3<f64>,
        /// Radius (m); infinite for a whole plane.
        radius: f64,
    },
    /// A flat parallelogram corner + s·a + t·b, 0 ≤ s, t ≤ 1.
    Parallelogram {
        /// Corner (m).
        corner: Vector3<f64>,
        /// First edge (m).
        a: Vector3<f64>,
        /// Second edge (m).
        b: Vector3<f64>,
    },
}

impl Crack {
    /// A point of its plane (m) and the unit normal.
    pub fn plane(&self) -> (Vector3<f64>, Vector3<f64>) {
        match self {
            Crack::Disc { centre, normal, .. } => (*centre, *normal),
            Crack::Parallelogram { corner, a, b } => (*corner, a.cross(b).normalize()),
        }
    }

    /// Whether the bond from p to q (m) passes through the surface, to a tolerance (m) far above the rounding of places and far
    /// below their distances: [`Crack::TIE`] spacings, or radii of the smallest sphere.
    ///
    /// What is as near to the surface's plane as the tolerance is on the side of the normal, so that a plane through nodes cuts
    /// each bond once and bonds in it not at all; what passes as near to its rim is cut. So a crack along lines of the lattice
    /// cuts whole families of bonds, whatever its direction, as one does that is a little off the nodes.
    pub fn cuts(&self, p: &Vector3<f64>, q: &Vector3<f64>, tolerance: f64) -> bool {
        let (origin, normal) = self.plane();
        let (dp, dq) = (normal.dot(&(p - origin)), normal.dot(&(q - origin)));
        if (dp < -tolerance) == (dq < -tolerance) {
            return false;
        }
        let hit = p + (q - p) * (dp / (dp - dq)).clamp(0.0, 1.0) - origin;
        match self {
            Crack::Disc { radius, .. } => hit.norm() <= radius + tolerance,
            Crack::Parallelogram { a, b, .. } => {
                // Distances from the edges that begin at the corner, and the extents across them.
                let (across_b, across_a) = (b.cross(&normal).normalize(), normal.cross(a).normalize());
                let within = |x: f64, extent: f64| (-tolerance..=extent + tolerance).contains(&x);
                within(across_b.dot(&hit), across_b.dot(a)) && within(across_a.dot(&hit), across_a.dot(b))
            }
        }
    }

    /// The tolerance of [`Crack::cuts`] in spacings: that by which bodies decide about nodes on their faces.
    pub const TIE: f64 = 1e-9;
}

/// How a bond fails.
#[derive(Clone, Debug, PartialEq)]
pub enum FractureEnergy {
    /// The same for every plane (J/m²).
    Isotropic(f64),
    /// By normal of the plane: pairs of unit normal and energy (J/m²); `anisobond` fits critical stretches to them.
    Directional(Vec<(Vector3<f64>, f64)>),
    /// One critical stretch for all bonds (–) instead of an energy.
    Stretch(f64),
}

/// What a region is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct RegionMaterial {
    /// Name of the region.
    pub name: String,
    /// Stiffness in the grid's axes (Pa).
    pub stiffness: Stiffness,
    /// Density ρ (kg/m³); 0 where equilibrium needs none.
    pub density: f64,
    /// Fracture; `None`: bonds do not break.
    pub fracture: Option<FractureEnergy>,
}

/// A series in time of one quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// Name, of its columns in the CSV file.
    pub name: String,
    /// What.
    pub quantity: Quantity,
    /// Where.
    pub nodes: Vec<u32>,
}

/// Whether the body moves or rests.
#[derive(Clone, Debug, PartialEq)]
pub enum Schedule {
    /// Motion in time.
    Motion {
        /// Duration (s).
        duration: f64,
        /// Time step (s); `None`: the stable one times the safety factor.
        step: Option<f64>,
        /// Part of the stable step that is used.
        safety: f64,
        /// Damping α (1/s): force −α m v.
        damping: f64,
        /// Local damping λ (–), 0 ≤ λ < 1: λ times the force on a site, component by component, against its velocity.
        local_damping: f64,
        /// Run although the step is above the stable one.
        force_step: bool,
        /// Start from equilibrium under the conditions at t = 0.
        from_equilibrium: bool,
    },
    /// Equilibrium under loads that grow: histories are read at load factors 1/n, 2/n … 1.
    Equilibrium {
        /// Number n of load steps.
        steps: usize,
        /// Relative residual accepted.
        tolerance: f64,
        /// Dynamic relaxation instead of conjugate gradients.
        relaxation: bool,
    },
}

impl Schedule {
    /// Motion over a duration (s), undamped, at nine tenths of the stable step.
    pub fn motion(duration: f64) -> Self {
        Schedule::Motion {
            duration,
            step: None,
            safety: 0.9,
            damping: 0.0,
            local_damping: 0.0,
            force_step: false,
            from_equilibrium: false,
        }
    }

    /// Equilibrium in so many load steps, to a relative residual of 10⁻⁸.
    pub fn equilibrium(steps: usize) -> Self {
        Schedule::Equilibrium { steps, tolerance: 1e-8, relaxation: false }
    }
}

/// A plane slice of the body drawn as a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// Axis normal to the slice (0, 1, 2).
    pub axis: usize,
    /// Position along it (m); `None`: the middle.
    pub position: Option<f64>,
    /// Field shown.
    pub field: FieldName,
    /// Number of the component shown; `None`: what [`FieldName::shown`] says.
    pub component: Option<usize>,
}

/// What is written, and how often.
#[derive(Clone, Debug, PartialEq)]
pub struct OutputPlan {
    /// Fields of the VTK files.
    pub fields: Vec<FieldName>,
    /// Number of frames over the run (load steps in equilibrium), besides the first; 0 writes none.
    pub frames: usize,
    /// Pictures of each frame, gathered into an animation.
    pub slices: Vec<Slice>,
    /// Time between rows of the probes in steps; ≥ 1.
    pub probe_every: usize,
    /// Seconds of wall time between checkpoints.
    pub checkpoint_every: f64,
}

impl Default for OutputPlan {
    /// No files; probes at every step.
    fn default() -> Self {
        OutputPlan { fields: vec![], frames: 0, slices: vec![], probe_every: 1, checkpoint_every: f64::INFINITY }
    }
}

/// Everything a run needs.
#[derive(Clone, Debug)]
pub struct Problem {
    /// Name of the case.
    pub name: String,
    /// The body.
    pub body: Body,
    /// The neighbourhood of its nodes.
    pub neighbourhood: Neighbourhood,
    /// Central or hybrid; micropolar bonds are for packings and grid cells.
    pub model: Model,
    /// In which sense central bonds come close to a tensor out of reach.
    pub metric: Metric,
    /// Whether truncated neighbourhoods are calibrated.
    pub surface_calibration: bool,
    /// Linear or finite stretch.
    pub kinematics: Kinematics,
    /// What bonds do beyond the linear law.
    pub law: Arc<dyn BondLaw>,
    /// Materials by region: that of nodes with `body.region` = 1 + index.
    pub regions: Vec<RegionMaterial>,
    /// What holds and drives.
    pub conditions: Vec<Condition>,
    /// Initial velocities (m/s) of nodes; later entries win.
    pub initial_velocity: Vec<(Vec<u32>, Vector3<f64>)>,
    /// Pre-cracks.
    pub cracks: Vec<Crack>,
    /// Nodes whose bonds never break.
    pub unbreakable: Vec<u32>,
    /// Motion or equilibrium.
    pub schedule: Schedule,
    /// Series in time.
    pub probes: Vec<Probe>,
    /// Files.
    pub output: OutputPlan,
}

impl Problem {
    /// A body of central bonds with calibrated surfaces that nothing holds or loads yet; its fields say the rest.
    ///
    /// ```
    /// use anisobond::prelude::*;
    /// use anisobond::nalgebra::Vector3;
    ///
    /// let grid = Grid::new([12, 4, 4], 1e-3, Vector3::zeros(), [false; 3])?;
    /// let bonds = Neighbourhood::sphere(3.0, 1e-3, Influence::Inverse)?;
    /// let silicon = Material::builtin("Si").unwrap();
    /// let region = RegionMaterial { name: "bar".into(), stiffness: silicon.stiffness, density: 2330.0, fracture: None };
    /// let mut problem = Problem::new("pull", Body::full(grid), bonds, vec![region], Schedule::motion(1e-6));
    /// let end: Vec<u32> = (0..192).filter(|node| node % 12 == 11).collect();
    /// let pulls = Vector3::new(0.1, 0.0, 0.0);
    /// problem.conditions.push(Condition::Force { force: vec![pulls; end.len()], nodes: end, history: History::Constant });
    /// let mut run = Simulation::new(problem)?;
    /// while !run.finished() {
    ///     run.advance()?;
    /// }
    /// assert!(run.ledger().external > 0.0 && run.ledger().relative_drift() < 1e-10);
    /// # Ok::<(), anisobond::Error>(())
    /// ```
    pub fn new(
        name: impl Into<String>,
        body: Body,
        neighbourhood: Neighbourhood,
        regions: Vec<RegionMaterial>,
        schedule: Schedule,
    ) -> Self {
        Problem {
            name: name.into(),
            body,
            neighbourhood,
            model: Model::Central,
            metric: Metric::Norm,
            surface_calibration: true,
            kinematics: Kinematics::Linear,
            law: Arc::new(Brittle),
            regions,
            conditions: vec![],
            initial_velocity: vec![],
            cracks: vec![],
            unbreakable: vec![],
            schedule,
            probes: vec![],
            output: OutputPlan::default(),
        }
    }
}
