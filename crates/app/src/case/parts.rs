//! Which of a case's regions, grains and layers has which node or sphere.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::matter::{Filling, Matter, Orientations, RegionStatement, axis_name};
use super::{Result, Spot};
use anisobond::lattice::{Solid, solid};

/// A site on the border of two layers, within so many spacings, is in the lower one.
const ON_BORDER: f64 = 1e-9;

/// What regions are laid over: the nodes of a grid, or spheres.
pub(super) struct Sites<'a> {
    /// "nodes" or "spheres".
    pub called: &'a str,
    pub number: usize,
    /// Whether the body has it.
    pub has: &'a dyn Fn(usize) -> bool,
    /// Which are inside a solid.
    pub inside: &'a dyn Fn(&Solid) -> Vec<bool>,
    /// Where it is (m).
    pub position: &'a dyn Fn(usize) -> Vector3<f64>,
    /// Between nodes, or centres of spheres that touch (m).
    pub spacing: f64,
    /// Extent (m) along the axes that are periodic.
    pub period: [Option<f64>; 3],
    /// Where layers begin unless the file says (m); `None`: half a spacing below the lowest site.
    pub bottom: Option<Vector3<f64>>,
}

/// Per site, 1 + the number of the region of the file that has it; 0 outside the body.
fn owners(regions: &[RegionStatement], sites: &Sites) -> Result<Vec<u16>> {
    let mut owner = vec![0u16; sites.number];
    for (n, region) in regions.iter().enumerate() {
        let Some(shape) = &region.solid else { continue };
        let within = (sites.inside)(shape);
        let mine: Vec<usize> = (0..owner.len()).filter(|&i| within[i] && (sites.has)(i)).collect();
        if mine.is_empty() {
            return Err(empty_region(region, sites.called, "its solid holds none of the body's"));
        }
        let taken = mine.iter().filter(|&&i| owner[i] > 0).count();
        if let Some(&first) = mine.iter().find(|&&i| owner[i] > 0).filter(|_| !region.over) {
            let other = &regions[usize::from(owner[first]) - 1].name;
            return Err(region.spot.wrong(
                format!("region {:?} overlaps region {other:?} in {taken} {}", region.name, sites.called),
                "make them disjoint, or write over = true in the later one to let it take them",
            ));
        }
        mine.iter().for_each(|&i| owner[i] = n as u16 + 1);
    }
    let left = (0..owner.len()).filter(|&i| (sites.has)(i) && owner[i] == 0);
    match regions.iter().position(|r| r.solid.is_none()) {
        Some(rest) => {
            let left: Vec<usize> = left.collect();
            left.into_iter().for_each(|i| owner[i] = rest as u16 + 1);
        }
        None => {
            let (count, first) = (left.clone().count(), left.clone().next());
            if let (Some(first), Some(region)) = (first, regions.last()) {
                let (x, called) = ((sites.position)(first), sites.called);
                return Err(region.spot.wrong(
                    format!(
                        "{count} {called} of the body are in no region, the first at ({}, {}, {}) m",
                        x.x, x.y, x.z
                    ),
                    "add a region without solid: it takes all the rest",
                ));
            }
        }
    }
    let mut filled = vec![false; regions.len() + 1];
    owner.iter().for_each(|&o| filled[usize::from(o)] = true);
    match regions.iter().enumerate().find(|(n, _)| !filled[n + 1]) {
        Some((_, region)) => Err(empty_region(region, sites.called, "other regions have all of its")),
        None => Ok(owner),
    }
}

fn empty_region(region: &RegionStatement, called: &str, why: &str) -> anisobond::Error {
    let problem = format!("region {:?} has no {called}: {why}", region.name);
    region.spot.wrong(problem, "check its solid and its units, or use a smaller spacing")
}

/// What the regions of a file divide into: every grain and every layer of a layup is a part.
pub(super) struct Parts {
    /// Name and matter of each.
    pub parts: Vec<(String, Matter)>,
    /// Per region of the file, the numbers of its parts, from 0.
    pub ranges: Vec<Range<usize>>,
}

impl Parts {
    /// The parts of a file's regions.
    ///
    /// # Errors
    /// More than there are numbers for.
    pub fn new(regions: &[RegionStatement]) -> Result<Self> {
        let (mut parts, mut ranges) = (Vec::new(), Vec::new());
        for region in regions {
            let (first, matters) = (parts.len(), region.filling.matters());
            if first + matters.len() >= usize::from(u16::MAX) {
                let problem = format!("there are more than {} regions", u16::MAX - 1);
                return Err(region.spot.wrong(problem, "use fewer grains or layers"));
            }
            let many = matters.len() > 1;
            let name = |part: usize| if many { format!("{}-{}", region.name, part + 1) } else { region.name.clone() };
            parts.extend(matters.into_iter().enumerate().map(|(part, matter)| (name(part), matter)));
            ranges.push(first..parts.len());
        }
        Ok(Parts { parts, ranges })
    }

    /// Per site, 1 + the number of its part; 0 outside the body.
    ///
    /// # Errors
    /// As [`owners`]; a grain or a layer without a site.
    pub fn assigned(&self, regions: &[RegionStatement], sites: &Sites) -> Result<Vec<u16>> {
        let owners = owners(regions, sites)?;
        let mut assigned = vec![0; owners.len()];
        for (n, (region, range)) in regions.iter().zip(&self.ranges).enumerate() {
            let own: Vec<usize> = (0..owners.len()).filter(|&i| owners[i] == n as u16 + 1).collect();
            let part_of = region.part_of(sites, &own)?;
            own.iter().zip(part_of).for_each(|(&site, part)| assigned[site] = 1 + range.start as u16 + part);
        }
        Ok(assigned)
    }
}

impl Filling {
    /// The matters of its parts.
    fn matters(&self) -> Vec<Matter> {
        match self {
            Filling::One(matter) => vec![matter.clone()],
            Filling::Grains { number, seed, orientations, matter, .. } => {
                let rotations = match orientations {
                    // Another stream than that of the places.
                    Orientations::Random => solid::random_rotations(*number, !seed),
                    Orientations::Table(rows) => rows[..*number].to_vec(),
                };
                let turned = |r: &Matrix3<f64>| Matter { turn: r * matter.turn, ..matter.clone() };
                rotations.iter().map(turned).collect()
            }
            Filling::Layers { layers, .. } => layers.iter().map(|l| l.1.clone()).collect(),
        }
    }
}

impl RegionStatement {
    /// The part of each of its sites, among its own.
    fn part_of(&self, sites: &Sites, own: &[usize]) -> Result<Vec<u16>> {
        match &self.filling {
            Filling::One(_) => Ok(vec![0; own.len()]),
            Filling::Grains { spot, number, seed, .. } => {
                let places: Vec<Vector3<f64>> = own.iter().map(|&i| (sites.position)(i)).collect();
                let grains = solid::grains(&places, sites.spacing, sites.period, *number, *seed);
                Ok(grains.map_err(|e| spot.at(e))?.grain)
            }
            Filling::Layers { spot, axis, start, layers, repeat } => {
                let heights: Vec<f64> = own.iter().map(|&i| (sites.position)(i)[*axis]).collect();
                let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
                let shape = self.solid.as_ref().map_or(f64::NEG_INFINITY, |s| s.bounds()[0][*axis]);
                let bottom = sites.bottom.map_or(lowest - 0.5 * sites.spacing, |bottom| bottom[*axis].max(shape));
                let thicknesses: Vec<f64> = layers.iter().map(|l| l.0).collect();
                layered(spot, sites, &heights, *axis, start.unwrap_or(bottom), &thicknesses, *repeat)
            }
        }
    }
}

/// Per site, its place in the layup.
fn layered(
    spot: &Spot,
    sites: &Sites,
    heights: &[f64],
    axis: usize,
    start: f64,
    layup: &[f64],
    repeat: usize,
) -> Result<Vec<u16>> {
    let (spacing, site) = (sites.spacing, sites.called.trim_end_matches('s'));
    let mut tops = Vec::with_capacity(layup.len() * repeat);
    let mut top = start;
    for thickness in std::iter::repeat_n(layup, repeat).flatten() {
        top += thickness;
        tops.push(top);
    }
    let mut counts = vec![0usize; tops.len()];
    let mut part_of = Vec::with_capacity(heights.len());
    for &z in heights {
        let layer = tops.partition_point(|&t| t < z - ON_BORDER * spacing);
        if z < start - ON_BORDER * spacing || layer == tops.len() {
            let name = axis_name(axis);
            return Err(spot.wrong(
                format!("the layers reach from {name} = {start} m to {top} m, but the region has a {site} at {z} m"),
                "add layers, repeat them, or set start",
            ));
        }
        counts[layer] += 1;
        part_of.push((layer % layup.len()) as u16);
    }
    if let Some(empty) = counts.iter().position(|&c| c == 0) {
        return Err(spot.wrong(
            format!("layer {} of {} holds no {site}", empty + 1, tops.len()),
            "use a smaller spacing or fewer layers: a layer needs at least one spacing",
        ));
    }
    Ok(part_of)
}
