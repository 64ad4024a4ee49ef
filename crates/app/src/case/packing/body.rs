//! The spheres of a case: a periodic packing with its calibrated bonds, tiled and cut to the body.

use std::ops::Range;

use nalgebra::Vector3;

use super::{PackingStatement, Source};
use crate::case::matter::Matter;
use crate::case::parts::{Parts, Sites};
use crate::case::{CaseFile, Spot};
use anisobond::experiment::element_test::ElementTest;
use anisobond::experiment::{CorrectionChoice, LatticePlan, LatticeStudy, PackingEvidence, anisotropy_axis};
use anisobond::lattice::generate::{Outcome, random};
use anisobond::lattice::{Packing, Solid};
use anisobond::operator::StiffBond;
use anisobond::tensor::Stiffness;
use anisobond::{Error, Result};
use anisobond_formats::packing::read_packing_as;

/// A body's extent along a periodic axis may differ from the cell's by this part.
const FITS: f64 = 1e-6;

/// More spheres than this are refused before memory is taken.
const MOST_SPHERES: f64 = 2e8;

/// The spheres of a body and their bonds.
#[derive(Clone, Debug)]
pub(super) struct Spheres {
    pub packing: Packing,
    pub bonds: Vec<StiffBond>,
    /// Volume of rock that each stands for (m³).
    pub volumes: Vec<f64>,
    /// Number of the part that has each, from 0.
    pub region: Vec<u16>,
    /// Per region of the file, the numbers of its parts.
    pub ranges: Vec<Range<usize>>,
    /// Origin of the packing's coordinates in those of the case (m).
    pub origin: Vector3<f64>,
    pub periodic: [bool; 3],
    /// The solid that they fill; `None`: the whole cell.
    pub shape: Option<Solid>,
    /// The box around it, along periodic axes the cell (m).
    pub bounds: [Vector3<f64>; 2],
    /// Of every part.
    pub evidence: Vec<PackingEvidence>,
}

impl Spheres {
    /// Where a sphere is (m).
    pub fn position(&self, sphere: usize) -> Vector3<f64> {
        self.packing.centres()[sphere] + self.origin
    }

    pub fn mean_radius(&self) -> f64 {
        self.packing.radii().iter().sum::<f64>() / self.packing.len() as f64
    }
}

/// The packing of a case, which must be periodic.
pub(super) fn packing(p: &PackingStatement) -> Result<Packing> {
    let packing = match &p.source {
        Source::File(path, options) => {
            let read = read_packing_as(path, options).map_err(|e| p.source_spot.at(e))?;
            // Forces and times depend on what a length is.
            if read.unit_assumed {
                let problem = format!("{} names no unit of length", path.display());
                return Err(p
                    .source_spot
                    .wrong(problem, "add length_unit = \"m\", or that which is meant, to [packing]"));
            }
            read.packing
        }
        Source::Random(wanted) => {
            let generated = random(wanted).map_err(|e| p.source_spot.at(e))?;
            if generated.report.outcome != Outcome::Reached {
                return Err(p.source_spot.wrong(generated.report.message, "ask for a higher porosity"));
            }
            generated.packing
        }
    };
    if packing.cell().is_none() {
        return Err(p.source_spot.wrong(
            "the packing has no periodic cell, which its bonds are calibrated on",
            "say its edges in the packing's file (first line ##PERIODIC:: a b c)",
        ));
    }
    Ok(packing)
}

/// The spheres of a case, bonded for the stiffness of each of its parts.
pub(super) fn spheres(case: &CaseFile, p: &PackingStatement, parts: &Parts) -> Result<Spheres> {
    let packing = packing(p)?;
    let frame = Frame::new(case, p, &packing.cell().unwrap_or_else(Vector3::zeros))?;
    // The same contacts with the stiffnesses of one region and of another.
    let many = parts.parts.len() > 1;
    let named = |(name, matter): &(String, Matter)| {
        study(packing.clone(), p, &matter.turned_stiffness())
            .map_err(|e| if many { e.at(format!("region {name:?}")) } else { e })
    };
    let studies = parts.parts.iter().map(named).collect::<Result<Vec<_>>>()?;
    cut(case, (parts, &studies), &frame, p)
}

/// The lattice of the packing, calibrated.
pub(super) fn study(packing: Packing, p: &PackingStatement, stiffness: &Stiffness) -> Result<LatticeStudy> {
    let test = ElementTest { rotations: p.rotations, ..ElementTest::default() };
    let plan = LatticePlan::new(p.bonds, p.correct.then_some(CorrectionChoice::General), test);
    let axis = anisotropy_axis(stiffness);
    LatticeStudy::planned(packing, stiffness, &axis, p.contact_radius, &plan).map_err(|e| p.spot.at(e))
}

/// How a packing is tiled around a body.
struct Frame {
    repeat: [usize; 3],
    /// Where the tiling begins, in the coordinates of the case (m).
    origin: Vector3<f64>,
    bounds: [Vector3<f64>; 2],
    shape: Option<(Spot, Solid)>,
}

impl Frame {
    fn new(case: &CaseFile, p: &PackingStatement, edges: &Vector3<f64>) -> Result<Self> {
        let given = p.repeat.as_ref().map(|r| r.1);
        let Some((spot, shape)) = &case.body else {
            let repeat = given.unwrap_or([1; 3]);
            let high = Vector3::from_fn(|a, _| repeat[a] as f64 * edges[a]);
            return Ok(Frame { repeat, origin: Vector3::zeros(), bounds: [Vector3::zeros(), high], shape: None });
        };
        let [mut low, mut high] = shape.bounds();
        let (mut repeat, mut origin) = ([1; 3], Vector3::zeros());
        for a in 0..3 {
            let axis = ["x", "y", "z"][a];
            let extent = high[a] - low[a];
            repeat[a] = match given {
                Some(given) => given[a],
                None if extent.is_finite() && p.periodic[a] => (extent / edges[a]).round().max(1.0) as usize,
                None if extent.is_finite() => (extent / edges[a] * (1.0 - FITS)).ceil().max(1.0) as usize,
                None => 1,
            };
            let tiled = repeat[a] as f64 * edges[a];
            if !extent.is_finite() {
                if !p.periodic[a] {
                    return Err(spot.wrong(
                        format!("the body is endless along {axis}, but the packing is not periodic there"),
                        format!("cut the body along {axis}, or write packing.periodic = [\"{axis}\"]"),
                    ));
                }
                (low[a], high[a]) = (-0.5 * tiled, 0.5 * tiled);
            } else if p.periodic[a] && (extent / tiled - 1.0).abs() > FITS {
                return Err(spot.wrong(
                    format!("the body is {extent} m long along {axis}, the periodic packing {tiled} m"),
                    format!(
                        "leave the body endless along {axis}, or make it a whole number of cells of {} m",
                        edges[a]
                    ),
                ));
            } else if extent > tiled * (1.0 + FITS) {
                let place = p.repeat.as_ref().map_or(&p.spot, |r| &r.0);
                return Err(place.wrong(
                    format!("the body is {extent} m long along {axis}, the tiled packing only {tiled} m"),
                    format!("repeat the cell of {} m more often, or leave repeat out", edges[a]),
                ));
            }
            origin[a] = 0.5 * (low[a] + high[a]) - 0.5 * tiled;
        }
        Ok(Frame { repeat, origin, bounds: [low, high], shape: Some((spot.clone(), shape.clone())) })
    }
}

/// Which part each sphere at a place (m) belongs to, from 0.
fn regions(
    case: &CaseFile,
    parts: &Parts,
    places: &[Vector3<f64>],
    frame: &Frame,
    (spacing, periodic): (f64, [bool; 3]),
) -> Result<Vec<u16>> {
    let [low, high] = frame.bounds;
    let sites = Sites {
        called: "spheres",
        number: places.len(),
        has: &|_| true,
        inside: &|shape| places.iter().map(|x| shape.contains(x, 0.0)).collect(),
        position: &|i| places[i],
        spacing,
        period: [0, 1, 2].map(|a| periodic[a].then(|| high[a] - low[a])),
        bottom: Some(low),
    };
    Ok(parts.assigned(&case.regions, &sites)?.into_iter().map(|part| part - 1).collect())
}

/// Tiles the lattice and keeps what is in the body: spheres whose centres are inside, bonds between them. A bond between
/// two regions has the mean of their stiffnesses.
fn cut(
    case: &CaseFile,
    (parts, studies): (&Parts, &[LatticeStudy]),
    frame: &Frame,
    p: &PackingStatement,
) -> Result<Spheres> {
    let study = &studies[0];
    let packing = &study.lattice.packing;
    let edges = packing.cell().unwrap_or_else(Vector3::zeros);
    let n = packing.len();
    let tiles = frame.repeat.iter().map(|&r| r as f64).product::<f64>();
    if tiles * n as f64 > MOST_SPHERES {
        let problem = format!("the body takes {tiles:.1e} cells of {n} spheres");
        return Err(p.spot.wrong(problem, "make the body smaller, or check its units and those of the packing"));
    }
    let [rx, ry, _] = frame.repeat;
    let tile_of = |t: usize| [t % rx, t / rx % ry, t / (rx * ry)];
    let number = |tile: [usize; 3]| tile[0] + rx * (tile[1] + ry * tile[2]);
    let corner = |tile: [usize; 3]| edges.component_mul(&Vector3::from(tile.map(|i| i as f64)));
    // Numbers of the spheres that are kept, tile by tile.
    let mut kept = vec![u32::MAX; tiles as usize * n];
    let (mut centres, mut radii, mut volumes) = (Vec::new(), Vec::new(), Vec::new());
    let share = study.lattice.volume / packing.radii().iter().map(|r| r.powi(3)).sum::<f64>();
    for tile in 0..tiles as usize {
        let shift = corner(tile_of(tile));
        for (sphere, (x, r)) in packing.centres().iter().zip(packing.radii()).enumerate() {
            let x = x + shift;
            if frame.shape.as_ref().is_none_or(|(_, s)| s.contains(&(x + frame.origin), 0.0)) {
                kept[tile * n + sphere] = centres.len() as u32;
                centres.push(x);
                radii.push(*r);
                volumes.push(share * r.powi(3));
            }
        }
    }
    if let (true, Some((spot, _))) = (centres.is_empty(), &frame.shape) {
        return Err(spot.wrong("the body holds no sphere", "use smaller spheres, or check its solids and units"));
    }
    let places: Vec<Vector3<f64>> = centres.iter().map(|x| x + frame.origin).collect();
    let mean = radii.iter().sum::<f64>() / radii.len() as f64;
    let region = regions(case, parts, &places, frame, (2.0 * mean, p.periodic))?;
    let stiffness = |end: u32, contact: usize| {
        let own = &studies[usize::from(region[end as usize])].stiffness;
        [own.normal[contact], own.tangential[contact]]
    };
    let mut bonds = Vec::new();
    for tile in 0..tiles as usize {
        let at = tile_of(tile);
        for (number_of, contact) in study.lattice.contacts.iter().enumerate() {
            let (a, b) = (contact.a as usize, contact.b as usize);
            let rest = contact.branch - (packing.centres()[b] - packing.centres()[a]);
            let image = rest.component_div(&edges).map(f64::round);
            let mut other = [0; 3];
            let mut inside = true;
            for axis in 0..3 {
                let to = at[axis] as i64 + image[axis] as i64;
                let count = frame.repeat[axis] as i64;
                inside &= p.periodic[axis] || (0..count).contains(&to);
                other[axis] = to.rem_euclid(count) as usize;
            }
            let ends = [kept[tile * n + a], kept[number(other) * n + b]];
            if inside && ends.iter().all(|e| *e != u32::MAX) {
                let [a, b] = ends.map(|end| stiffness(end, number_of));
                let [normal, tangential] = [0, 1].map(|k| 0.5 * (a[k] + b[k]));
                bonds.push(StiffBond { a: ends[0], b: ends[1], branch: contact.branch, normal, tangential });
            }
        }
    }
    // Along axes that are not periodic the cell reaches so far that nothing meets its image.
    let largest = radii.iter().copied().fold(0.0, f64::max);
    let size = |axis: usize| {
        let tiled = frame.repeat[axis] as f64 * edges[axis];
        if p.periodic[axis] { tiled } else { 3.0 * tiled + 10.0 * p.contact_radius.max(1.0) * largest }
    };
    let cell = p.periodic.contains(&true).then(|| Vector3::new(size(0), size(1), size(2)));
    // Room below, too, for a cell wraps what is under its corner.
    let lift = |axis: usize| {
        if cell.is_none() || p.periodic[axis] {
            0.0
        } else {
            0.5 * (size(axis) - frame.repeat[axis] as f64 * edges[axis])
        }
    };
    let lift = Vector3::new(lift(0), lift(1), lift(2));
    let evidence = parts.parts.iter().zip(studies).map(|((name, _), study)| evidence(name, study, p));
    Ok(Spheres {
        packing: Packing::new(cell, centres.into_iter().map(|x| x + lift).collect(), radii)?,
        bonds,
        volumes,
        region,
        ranges: parts.ranges.clone(),
        origin: frame.origin - lift,
        periodic: p.periodic,
        shape: frame.shape.as_ref().map(|s| s.1.clone()),
        bounds: frame.bounds,
        evidence: evidence.collect::<Result<_>>()?,
    })
}

/// What a region's lattice is, measured by an element test.
fn evidence(region: &str, study: &LatticeStudy, p: &PackingStatement) -> Result<PackingEvidence> {
    let measured = match &study.correction {
        Some((_, report)) => Ok(Stiffness::from_voigt_rows(&report.measured)?),
        None => {
            let test = ElementTest { rotations: p.rotations, ..ElementTest::default() };
            test.run(&study.network()).and_then(|r| match r.solver.converged() {
                true => Ok(r.measured),
                false => Err(Error::not_converged("its element test did not converge", "give a larger contact radius")),
            })
        }
    };
    let miss = match &measured {
        Ok(measured) => study.miss(measured),
        Err(e) => Some(format!("what stiffness the lattice has is not known: {e}")),
    };
    let measured = measured.ok();
    Ok(PackingEvidence {
        region: region.to_string(),
        contact_radius: p.contact_radius,
        coordination: 2.0 * study.lattice.contacts.len() as f64 / study.lattice.packing.len() as f64,
        prescribed: study.prescribed,
        elliptic: study.replaced().copied(),
        summed: study.summed(),
        energy_error: measured.and_then(|measured| study.prescribed.energy_error(&measured)),
        measured,
        miss,
    })
}
