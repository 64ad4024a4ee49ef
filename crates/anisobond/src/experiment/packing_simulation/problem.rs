//! A body of bonded spheres, how it is loaded, and what is measured.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::fields::stress_warnings;
use super::loose::Joined;
use crate::experiment::element_test::Rotations;
use crate::experiment::problem::{Condition, OutputPlan, Probe, Schedule};
use crate::operator::particles::ParticleModel;
use crate::tensor::{Stiffness, doubtful_length};

/// A body of fewer mean diameters across is named.
const FEW: f64 = 12.0;

/// Everything that a run on a packing needs; nodes of conditions and probes are numbers of spheres.
#[derive(Clone, Debug)]
pub struct PackingProblem {
    /// Name of the case.
    pub name: String,
    /// Spheres, bonds, masses, strength and contact.
    pub model: ParticleModel,
    /// Volume of rock (m³), pores included, that each sphere stands for.
    pub volumes: Vec<f64>,
    /// Number of the region of each, from 0.
    pub region: Vec<u16>,
    /// Where the origin of the packing's coordinates lies in those of the case (m).
    pub origin: Vector3<f64>,
    /// Axes along which the body is periodic. Along the others the packing's cell, if there is one, is so large that no
    /// bond passes its faces.
    pub periodic: [bool; 3],
    /// Whether spheres rotate.
    pub rotations: Rotations,
    /// What holds and drives.
    pub conditions: Vec<Condition>,
    /// Initial velocities (m/s) of spheres; later entries win.
    pub initial_velocity: Vec<(Vec<u32>, Vector3<f64>)>,
    /// Motion or equilibrium.
    pub schedule: Schedule,
    /// What drives the cell of a body periodic along all axes; `None`: it keeps its shape.
    pub servo: Option<ServoPlan>,
    /// Series in time.
    pub probes: Vec<Probe>,
    /// Files.
    pub output: OutputPlan,
    /// What the lattice of every region is, for the summary.
    pub evidence: Vec<PackingEvidence>,
}

impl PackingProblem {
    /// Where a sphere is at the start (m), in the coordinates of the case.
    pub fn position(&self, sphere: usize) -> Vector3<f64> {
        self.model.packing.centres()[sphere] + self.origin
    }

    /// Mean radius of the spheres (m).
    pub fn mean_radius(&self) -> f64 {
        let radii = self.model.packing.radii();
        radii.iter().sum::<f64>() / radii.len() as f64
    }

    /// What a user should know before a run: spheres without bonds, parts that no bond joins, materials that the lattice
    /// misses, a body of few spheres across, spheres smaller than atoms.
    pub fn warnings(&self) -> Vec<String> {
        self.warnings_of(&Joined::new(self))
    }

    pub(super) fn warnings_of(&self, joined: &Joined) -> Vec<String> {
        let many = self.evidence.len() > 1;
        let named = |e: &PackingEvidence| {
            e.miss.as_ref().map(|miss| if many { format!("region {}: {miss}", e.region) } else { miss.clone() })
        };
        let missed = self.evidence.iter().filter_map(named);
        let size = doubtful_length("the spheres' mean radius", self.mean_radius());
        let own = joined.warnings(self).into_iter().chain(missed).chain(stress_warnings(self));
        own.chain(self.coarse()).chain(size).collect()
    }

    /// A warning of a body that is few diameters across: its outer spheres lack bonds, and nothing makes up for them.
    pub(super) fn coarse(&self) -> Option<String> {
        let spheres = 0..self.model.packing.len();
        let across = |a: usize| {
            let places = spheres.clone().map(|s| self.position(s)[a]);
            let (low, high) =
                places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
            (high - low) / (2.0 * self.mean_radius()) + 1.0
        };
        let free = (0..3).filter(|&a| !self.periodic[a]).map(|a| (across(a), a));
        let (diameters, axis) = free.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(n, _)| *n < FEW)?;
        Some(format!(
            "the body is {diameters:.1} mean diameters across along {}: a bar six diameters thick stretched by a third too much, and the \
             error falls with their number (docs/packings-in-motion.md); use smaller spheres",
            ["x", "y", "z"][axis]
        ))
    }

    /// Whether the body is periodic along all axes.
    pub fn is_periodic(&self) -> bool {
        self.periodic == [true; 3]
    }
}

/// What drives one component of a periodic cell; tension is positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CellDrive {
    /// Strain rate ε̇_ij (1/s), not γ̇; of the logarithmic strain where it is a normal one.
    Rate(f64),
    /// Stress (Pa).
    Stress(f64),
    /// Stress (Pa) until a moment (s), then a strain rate (1/s).
    StressThenRate {
        /// Stress (Pa).
        stress: f64,
        /// Moment (s).
        until: f64,
        /// Strain rate (1/s).
        rate: f64,
    },
}

/// The servo of a periodic cell.
#[derive(Clone, Debug, PartialEq)]
pub struct ServoPlan {
    /// Components 11 22 33 23 13 12.
    pub drives: [CellDrive; 6],
    /// Share of a missing stress that one step makes good (–).
    pub gain: f64,
    /// Largest strain rate (1/s) of a component driven by stress; may be infinite.
    pub fastest: f64,
}

/// What a packing's lattice is, and what was asked of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PackingEvidence {
    /// Name of the region.
    pub region: String,
    /// Contact radius I_R.
    pub contact_radius: f64,
    /// Bonds per sphere of the periodic packing that the body is made from.
    pub coordination: f64,
    /// Stiffness asked of the lattice: the material's (Pa, Voigt).
    #[serde(serialize_with = "voigt", deserialize_with = "of_voigt")]
    pub prescribed: Stiffness,
    /// The sum over bonds at uniform strain (Pa, Voigt), an upper bound of what an element test measures.
    #[serde(serialize_with = "voigt", deserialize_with = "of_voigt")]
    pub summed: Stiffness,
    /// What elliptic moduli stand for in its place, with a C44 that follows from four constants (Pa, Voigt); `None` where that
    /// is the material.
    #[serde(serialize_with = "maybe_voigt", deserialize_with = "maybe_of_voigt", default)]
    pub elliptic: Option<Stiffness>,
    /// What an element test measures on the periodic packing (Pa, Voigt); `None` where it measures nothing.
    #[serde(serialize_with = "maybe_voigt", deserialize_with = "maybe_of_voigt")]
    pub measured: Option<Stiffness>,
    /// Least and largest relative error of the energy of a strain (–), over all strains, of what is measured.
    #[serde(default)]
    pub energy_error: Option<[f64; 2]>,
    /// What to say of it, where it is noticeable.
    #[serde(skip)]
    pub miss: Option<String>,
}

impl PackingEvidence {
    /// The stiffness (Pa) that the lattice has, as far as it is known: measured, or the sum over its bonds.
    pub fn stiffness(&self) -> &Stiffness {
        self.measured.as_ref().unwrap_or(&self.summed)
    }
}

fn voigt<S: serde::Serializer>(c: &Stiffness, serializer: S) -> Result<S::Ok, S::Error> {
    c.voigt_rows().serialize(serializer)
}

fn maybe_voigt<S: serde::Serializer>(c: &Option<Stiffness>, serializer: S) -> Result<S::Ok, S::Error> {
    c.map(|c| c.voigt_rows()).serialize(serializer)
}

fn of_voigt<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Stiffness, D::Error> {
    let rows = <[[f64; 6]; 6]>::deserialize(deserializer)?;
    Stiffness::from_voigt_rows(&rows).map_err(serde::de::Error::custom)
}

fn maybe_of_voigt<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<Stiffness>, D::Error> {
    #[derive(Deserialize)]
    struct Rows(#[serde(deserialize_with = "of_voigt")] Stiffness);
    Ok(Option::<Rows>::deserialize(deserializer)?.map(|Rows(c)| c))
}

/// Mean stress (Pa) and strain (–) of a periodic cell, components 11 22 33 23 13 12; tension is positive. Normal strains
/// are logarithmic, ln F_ii; shears are ½ (F_ij + F_ji).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CellState {
    /// Stress (Pa).
    pub stress: [f64; 6],
    /// Strain (–).
    pub strain: [f64; 6],
}

/// The largest differential stress so far of the component that a servo strains fastest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    /// Index of the component in 11 22 33.
    pub axis: usize,
    /// Largest |σ_axial − mean of the lateral stresses| (Pa).
    pub differential: f64,
    /// Axial stress there (Pa).
    pub stress: f64,
    /// Axial strain there (–).
    pub strain: f64,
    /// Moment (s).
    pub time: f64,
}

/// Spheres that are outside the box around a free body: its bounds at the start, enlarged on every side by half their diagonal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Leavers {
    /// Number of them when last looked at.
    pub number: usize,
    /// The first that was seen, counted from 1.
    pub first: usize,
    /// Where it was then (m).
    pub place: [f64; 3],
    /// When (s).
    pub time: f64,
}
