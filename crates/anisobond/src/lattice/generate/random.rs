//! Random periodic packings of a wanted porosity or coordination.

use std::ops::ControlFlow;

use nalgebra::Vector3;
use serde::Serialize;

use super::radii::{Radii, Sampler};
use super::relax::{GAP, remove_overlaps};
use super::stream::Stream;
use crate::lattice::{Packing, PackingStatistics};
use crate::{Error, Result};

/// More spheres than this are refused before memory is taken.
const MOST_SPHERES: f64 = 1e8;

/// Packings tried before a target is given up.
const MOST_TRIALS: usize = 24;

/// Relative error within which a coordination is reached.
const COORDINATION_TOLERANCE: f64 = 0.005;

/// Densest solid share of equal spheres, π/√18 (Kepler, Hales).
const DENSEST: f64 = 0.740_480_489_693_061;

/// Solid share where a search for a coordination begins at most; random packings of equal spheres jam at 0.64.
const LOOSE: f64 = 0.6;

/// What a random packing shall be.
#[derive(Clone, Debug, PartialEq)]
pub struct RandomPacking {
    /// Its number of spheres or its cell.
    pub extent: Extent,
    /// Its radii (m).
    pub radii: Radii,
    /// Its porosity or its coordination.
    pub target: Target,
    /// Contact radius I_R at which contacts are counted.
    pub contact_radius: f64,
    /// Packings of equal seeds are equal.
    pub seed: u64,
}

/// How large a packing is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Extent {
    /// So many spheres, in a cubic cell that follows from the porosity.
    Number(usize),
    /// A cell of given edges (m), with as many spheres as the porosity asks for.
    Cell([f64; 3]),
}

/// How dense a packing is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// Share of the volume that is empty.
    Porosity(f64),
    /// Contacts per sphere at the contact radius.
    Coordination(f64),
}

/// A random packing and how it came about.
#[derive(Clone, Debug)]
pub struct Generated {
    /// The packing; no two of its spheres overlap. Spheres near in number are near in space.
    pub packing: Packing,
    /// How it came about.
    pub report: GenerationReport,
}

/// How a random packing came about.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GenerationReport {
    /// Whether the target was reached.
    pub outcome: Outcome,
    /// The outcome in a sentence.
    pub message: String,
    /// Packings tried.
    pub trials: usize,
    /// Evaluations of the forces, over all trials.
    pub iterations: usize,
    /// Porosity, coordination, fabric, largest overlap and more of the packing.
    pub statistics: PackingStatistics,
}

/// How the search for a target ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Outcome {
    /// As wanted: the porosity to within half a sphere, the coordination to within 0.5 %.
    Reached,
    /// Random spheres jam before they are so dense; the packing is the densest found.
    Jammed,
    /// The coordination is not met at any density tried; the packing is the nearest found.
    Missed,
}

/// A random periodic packing without overlaps, from random points by minimising the energy of overlaps.
///
/// The result depends on the wishes and the seed only, not on the number of threads. A target that cannot be reached
/// (equal random spheres jam at a porosity of about 0.36) is an outcome, named in the report.
///
/// # Errors
/// Numbers out of their range: sizes, radii, a porosity no packing can have, a contact radius without contacts.
pub fn random(wanted: &RandomPacking) -> Result<Generated> {
    random_observed(wanted, &mut |_| ControlFlow::Continue(()))
}

/// Where the generation of a packing is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Packing tried, from 1.
    pub trial: usize,
    /// Evaluations of the forces in this trial.
    pub iterations: usize,
    /// Porosity of this trial.
    pub porosity: f64,
    /// Largest overlap left, relative to the sum of radii.
    pub largest_overlap: f64,
}

/// [`random`] with an observer that hears of every evaluation of the forces and may stop the work.
///
/// # Errors
/// As [`random`]; [`Error::Interrupted`] when the observer breaks off.
pub fn random_observed(
    wanted: &RandomPacking,
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Generated> {
    let sampler = wanted.checked()?;
    let mut trials = Trials { wanted, sampler, observe, count: 0, iterations: 0 };
    match wanted.target {
        Target::Porosity(porosity) => trials.of_porosity(porosity),
        Target::Coordination(coordination) => trials.of_coordination(coordination),
    }
}

impl RandomPacking {
    /// Porosity of a random packing unless one is asked for: loose enough to be reached at once.
    pub const USUAL_POROSITY: f64 = 0.45;

    /// The sampler of the radii, if all wishes make sense.
    fn checked(&self) -> Result<Sampler<'_>> {
        let sampler = self.radii.sampler()?;
        match self.extent {
            Extent::Number(n) if n == 0 || n as f64 > MOST_SPHERES => {
                return Err(Error::input(format!("{n} spheres are asked for"), "give a number from 1 to 1e8"));
            }
            Extent::Cell(edges) if !edges.iter().all(|e| e.is_finite() && *e > 0.0) => {
                let [x, y, z] = edges;
                return Err(Error::input(format!("the cell's edges are {x} {y} {z} m"), "give three positive lengths"));
            }
            _ => {}
        }
        if !(self.contact_radius.is_finite() && self.contact_radius > 0.0) {
            let problem = format!("the contact radius I_R is {}", self.contact_radius);
            return Err(Error::input(problem, "give a positive number, such as 1.8"));
        }
        match self.target {
            Target::Porosity(porosity) => self.check_porosity(porosity)?,
            Target::Coordination(coordination) => self.check_coordination(coordination)?,
        }
        Ok(sampler)
    }

    fn check_porosity(&self, porosity: f64) -> Result<()> {
        if !(porosity > 0.0 && porosity < 1.0) {
            return Err(Error::input(
                format!("the porosity is {porosity}"),
                "give a number between 0 and 1, such as 0.45",
            ));
        }
        if matches!(self.radii, Radii::Uniform { .. }) && 1.0 - porosity > DENSEST {
            return Err(Error::input(
                format!("no packing of equal spheres has a porosity of {porosity}"),
                "give at least 0.26 (crystals) or 0.37 (random packings)",
            ));
        }
        Ok(())
    }

    fn check_coordination(&self, coordination: f64) -> Result<()> {
        if !(coordination.is_finite() && coordination > 0.0) {
            let problem = format!("the coordination is {coordination}");
            return Err(Error::input(problem, "give a positive number of contacts per sphere"));
        }
        if self.contact_radius < 1.0 + 10.0 * GAP {
            return Err(Error::input(
                format!("spheres without overlap hardly touch at the contact radius {}", self.contact_radius),
                "count contacts at I_R ≥ 1.01",
            ));
        }
        Ok(())
    }
}

/// The packings tried on the way to a target.
struct Trials<'w> {
    wanted: &'w RandomPacking,
    sampler: Sampler<'w>,
    observe: &'w mut dyn FnMut(&Progress) -> ControlFlow<()>,
    count: usize,
    iterations: usize,
}

/// One packing tried.
struct Trial {
    packing: Packing,
    free: bool,
    mean_overlap: f64,
}

impl Trials<'_> {
    fn of_porosity(&mut self, porosity: f64) -> Result<Generated> {
        let first = self.at(1.0 - porosity)?;
        if first.free {
            let message = format!("porosity {porosity} reached");
            return self.finished(first.packing, Outcome::Reached, message);
        }
        let densest = self.loosened(first, 1.0 - porosity)?;
        let reached = densest.porosity().unwrap_or(1.0);
        let message = format!(
            "porosity {porosity} not reached: random spheres of these radii jam before; the packing has {reached:.4}"
        );
        self.finished(densest, Outcome::Jammed, message)
    }

    /// Looser packings, from a jammed one, until one is free: overlaps vanish about where the cell has grown by them.
    fn loosened(&mut self, jammed: Trial, solid: f64) -> Result<Packing> {
        let (mut trial, mut solid) = (jammed, solid);
        while self.count < MOST_TRIALS {
            solid *= (1.0 - trial.mean_overlap).powi(3).min(0.997);
            trial = self.at(solid)?;
            if trial.free {
                return Ok(trial.packing);
            }
        }
        Err(Error::not_converged(
            format!(
                "no packing free of overlaps was found in {MOST_TRIALS} trials, the last at porosity {:.3}",
                1.0 - solid
            ),
            "ask for a larger porosity, or for more spheres",
        ))
    }

    /// The solid share at which the coordination is met. Coordination grows with the solid share, about in proportion.
    fn of_coordination(&mut self, coordination: f64) -> Result<Generated> {
        let contact_radius = self.wanted.contact_radius;
        let (mut low, mut high) = (0.0, 1.0f64);
        let mut solid = (coordination / (8.0 * contact_radius.powi(3))).min(LOOSE);
        let mut nearest: Option<(f64, Packing)> = None;
        let mut jammed = false;
        while self.count < MOST_TRIALS && high - low > 1e-4 * high {
            let trial = self.at(solid)?;
            if !trial.free {
                (high, jammed) = (solid, true);
                solid = (0.5 * (low + high)).max(solid * (1.0 - trial.mean_overlap).powi(3).min(0.997));
                continue;
            }
            let reached = trial.packing.statistics(contact_radius)?.coordination.mean;
            let error = (reached - coordination).abs();
            let smallest_change = 2.0 / trial.packing.len() as f64;
            if nearest.as_ref().is_none_or(|(before, _)| error < *before) {
                nearest = Some((error, trial.packing));
            }
            if error <= (COORDINATION_TOLERANCE * coordination).max(smallest_change) {
                break;
            }
            if reached < coordination {
                low = solid;
            } else {
                (high, jammed) = (solid, false);
            }
            let proportional = solid * coordination / reached.max(0.1 * coordination);
            let inside = low < proportional && proportional < high;
            solid = if inside { proportional } else { 0.5 * (low + high) };
        }
        let Some((error, packing)) = nearest else {
            return Err(Error::not_converged(
                "no packing free of overlaps was found",
                "ask for a smaller coordination",
            ));
        };
        let smallest_change = 2.0 / packing.len() as f64;
        let reached = error <= (COORDINATION_TOLERANCE * coordination).max(smallest_change);
        let (outcome, word) = match (reached, jammed) {
            (true, _) => (Outcome::Reached, "reached"),
            (false, true) => (Outcome::Jammed, "not reached: random spheres of these radii jam before"),
            (false, false) => (Outcome::Missed, "not met at any density tried"),
        };
        let message = format!("coordination {coordination} at contact radius {contact_radius} {word}");
        self.finished(packing, outcome, message)
    }

    fn finished(&self, packing: Packing, outcome: Outcome, message: String) -> Result<Generated> {
        let statistics = packing.statistics(self.wanted.contact_radius)?;
        let report = GenerationReport { outcome, message, trials: self.count, iterations: self.iterations, statistics };
        Ok(Generated { packing, report })
    }

    /// A packing of a solid share, from the seed.
    fn at(&mut self, solid: f64) -> Result<Trial> {
        let mut stream = Stream::new(self.wanted.seed);
        let (edges, radii) = self.cell_and_radii(solid, &mut stream)?;
        let centres = scattered(radii.len(), &edges, &mut stream);
        self.count += 1;
        let (trial, observe) = (self.count, &mut self.observe);
        let relaxed = remove_overlaps(&edges, centres, &radii, |iterations, largest_overlap| {
            match observe(&Progress { trial, iterations, porosity: 1.0 - solid, largest_overlap }) {
                ControlFlow::Continue(()) => Ok(()),
                ControlFlow::Break(()) => {
                    Err(Error::Interrupted { message: format!("packing {trial} was not finished").into() })
                }
            }
        })?;
        self.iterations += relaxed.steps;
        let packing = Packing::new(Some(edges), relaxed.centres, radii)?;
        Ok(Trial { packing, free: relaxed.free, mean_overlap: relaxed.mean_overlap })
    }

    fn cell_and_radii(&self, solid: f64, stream: &mut Stream) -> Result<(Vector3<f64>, Vec<f64>)> {
        match self.wanted.extent {
            Extent::Number(number) => {
                let radii = (0..number).map(|_| self.sampler.draw(stream)).collect::<Result<Vec<f64>>>()?;
                let volume = radii.iter().map(|&r| ball(r)).sum::<f64>() / solid;
                Ok((Vector3::repeat(volume.cbrt()), radii))
            }
            Extent::Cell(edges) => {
                let edges = Vector3::from(edges);
                let radii = self.radii_filling(solid * edges.product(), stream)?;
                let largest = radii.iter().copied().fold(0.0, f64::max);
                if radii.is_empty() || edges.min() < 2.0 * largest {
                    return Err(Error::input(
                        format!("the cell {} × {} × {} m holds no packing of these spheres", edges.x, edges.y, edges.z),
                        "give edges of at least the largest diameter, better of ten",
                    ));
                }
                Ok((edges, radii))
            }
        }
    }

    /// Radii whose balls fill a volume (m³) to within half a ball.
    fn radii_filling(&self, volume: f64, stream: &mut Stream) -> Result<Vec<f64>> {
        let (mut radii, mut filled) = (Vec::new(), 0.0);
        loop {
            let radius = self.sampler.draw(stream)?;
            if volume / ball(radius) > 100.0 * MOST_SPHERES || radii.len() as f64 > MOST_SPHERES {
                return Err(Error::input(
                    "the cell holds more than 1e8 spheres",
                    "check the units of the cell and the radii, or give a smaller cell",
                ));
            }
            if filled + 0.5 * ball(radius) > volume {
                return Ok(radii);
            }
            filled += ball(radius);
            radii.push(radius);
        }
    }
}

/// (4/3) π r³.
fn ball(radius: f64) -> f64 {
    4.0 / 3.0 * std::f64::consts::PI * radius.powi(3)
}

/// Random points in the cell, sorted along a space-filling (Morton) curve.
fn scattered(number: usize, edges: &Vector3<f64>, stream: &mut Stream) -> Vec<Vector3<f64>> {
    let mut points: Vec<Vector3<f64>> = (0..number).map(|_| Vector3::from_fn(|_, _| stream.unit())).collect();
    points.sort_by_cached_key(morton);
    points.iter().map(|x| x.component_mul(edges)).collect()
}

/// The bits of the three coordinates in turn, ten of each.
fn morton(point: &Vector3<f64>) -> u32 {
    let bits = point.map(|x| (1024.0 * x) as u32);
    (0..10)
        .flat_map(|bit| (0..3).map(move |axis| (bit, axis)))
        .fold(0, |code, (bit, axis)| code | ((bits[axis] >> bit) & 1) << (3 * bit + axis as u32))
}
