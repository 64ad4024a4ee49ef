//! From materials to stencils: calibration, surfaces, critical stretches.

use std::collections::HashMap;

use nalgebra::Vector3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::calibration::{
    CrackPlanes, CriticalStretches, EnergyByNormal, Evidence, FractureReport, HybridForm, LowerBound, Model,
    ModelCalibrator, ModelSettings, Outcome, StabilityEvidence, SurfaceStencil, surface_stencils,
};
use crate::experiment::problem::{Crack, FractureEnergy, Problem, RegionMaterial};
use crate::lattice::Neighbourhood;
use crate::operator::grid::{FailingBonds, GridBonds, InterfaceBonds, Stencil};
use crate::tensor::Stiffness;
use crate::{Error, Result};

/// What the bonds of a region reach of what was asked.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RegionEvidence {
    /// Name of the region.
    pub name: String,
    /// Material nodes.
    pub nodes: usize,
    /// ‖wanted − reached‖/‖wanted‖ of the stiffness tensor.
    pub relative_error: f64,
    /// Least and largest relative error of the energy of a strain (–), over all strains; `None` where the wanted is singular.
    #[serde(default)]
    pub energy_error: Option<[f64; 2]>,
    /// What to say of it, where it is noticeable.
    #[serde(skip)]
    miss: Option<String>,
    /// Whether every wave of the grid has positive energy; how that is known, `stability` says.
    pub stable: bool,
    /// How it is known, and by what margin.
    pub stability: StabilityEvidence,
    /// What came of the calibration: infeasible where the bonds are the nearest to what was wanted.
    pub outcome: Outcome,
    /// Fracture energy, wanted and reached; `None` where bonds do not break, or break at a given stretch.
    pub fracture: Option<FractureReport>,
}

/// What the bonds between two regions are.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct InterfaceEvidence {
    /// Names of the regions.
    pub regions: [String; 2],
    /// Bonds with one end in each, pre-cracks cut.
    pub bonds: usize,
    /// Area (m²).
    pub area: f64,
    /// Where the stiffness of these bonds comes from: "layers", the regions' own as those of layers.
    pub stiffness: String,
    /// Of the bonds, those that never break.
    pub unbreakable: usize,
    /// Fracture energy of the interface (J/m²); `None` where its bonds do not break.
    pub fracture: Option<InterfaceFracture>,
}

/// Fracture energy of an interface (J/m²).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct InterfaceFracture {
    /// The smaller of what the two regions' materials want there; `None` where a critical stretch is given instead.
    pub wanted: Option<f64>,
    /// The energy of all bonds between the two regions at their critical stretches, by area.
    pub reached: f64,
}

/// What the bonds between regions are, pair by pair.
pub(super) fn interfaces(problem: &Problem, bonds: &FailingBonds) -> Vec<InterfaceEvidence> {
    let wanted = |region: u16, n: &Vector3<f64>| match problem.regions[usize::from(region) - 1].fracture.as_ref()? {
        FractureEnergy::Isotropic(energy) => Some(*energy),
        FractureEnergy::Directional(values) => EnergyByNormal::through(values).ok().map(|energy| energy.at(n)),
        FractureEnergy::Stretch(_) => None,
    };
    let stretch =
        |region: u16| matches!(problem.regions[usize::from(region) - 1].fracture, Some(FractureEnergy::Stretch(_)));
    // A bond takes so many times the energy at the onset of its law.
    let ratio = problem.law.energy_ratio();
    let evidence = |found: InterfaceBonds| {
        let area: f64 = found.pieces.iter().map(|(_, area)| area).sum();
        let weaker = |(n, area): &(Vector3<f64>, f64)| {
            found.regions.iter().filter_map(|&r| wanted(r, n)).reduce(f64::min).map(|energy| energy * area)
        };
        let whole: Option<f64> = found.pieces.iter().map(weaker).sum();
        let breaks = found.bonds > found.unbreakable && area > 0.0;
        InterfaceEvidence {
            regions: found.regions.map(|r| problem.regions[usize::from(r) - 1].name.clone()),
            bonds: found.bonds,
            area,
            stiffness: "layers".into(),
            unbreakable: found.unbreakable,
            fracture: breaks.then(|| InterfaceFracture {
                wanted: whole.filter(|_| !found.regions.iter().any(|&r| stretch(r))).map(|whole| whole / area),
                reached: ratio * found.energy / area,
            }),
        }
    };
    bonds.grid().interfaces().into_iter().map(evidence).collect()
}

/// Relative error of a stiffness above which a run is warned of.
const NOTICEABLE: f64 = 1e-3;

/// Deviations of the reached fracture energy from the wanted one, root mean square and largest, above which a run is warned of.
const DEVIATIONS: [f64; 2] = [0.05, 0.1];

impl RegionEvidence {
    /// What a user should know of the region's bonds.
    fn warnings(&self) -> Vec<String> {
        let far = (self.relative_error > NOTICEABLE || self.miss.is_some()).then(|| {
            let miss = self.miss.as_ref().map_or(String::new(), |miss| format!(": {miss}"));
            format!(
                "region {}: the bonds reach its stiffness to {:.2} % only (model hybrid reaches every tensor){miss}",
                self.name,
                100.0 * self.relative_error
            )
        });
        let stability = match (self.stable, self.stability.evidence) {
            (false, _) => Some(format!("region {}: some wave of its grid has no positive energy", self.name)),
            (true, Evidence::Sampled) => Some(format!(
                "region {}: that all waves of its grid have positive energy is not proved, only sampled (margin {:.1e} of ‖C‖)",
                self.name, self.stability.margin
            )),
            (true, Evidence::Proved) => None,
        };
        let ended = (self.outcome == Outcome::NotConverged)
            .then(|| format!("region {}: the calibration of its bonds did not converge", self.name));
        far.into_iter().chain(stability).chain(ended).chain(self.fracture_warning()).collect()
    }

    /// A warning where the bonds do not reach the wanted fracture energy.
    fn fracture_warning(&self) -> Option<String> {
        let report = self.fracture.as_ref()?;
        let far = report.rms_deviation > DEVIATIONS[0] || report.largest_deviation > DEVIATIONS[1];
        far.then(|| {
            let [x, y, z] = report.largest_at;
            format!(
                "region {}: the bonds reach the wanted fracture energy to {:.1} % only in the mean, and for the normal \
                 ({x:.2} {y:.2} {z:.2}) to {:.1} %; a larger horizon ratio has more directions of bonds",
                self.name,
                100.0 * report.rms_deviation,
                100.0 * report.largest_deviation
            )
        })
    }
}

/// The calibrated bonds of a region.
struct RegionBonds {
    reached: Stiffness,
    micromodulus: Vec<f64>,
    critical: Option<Vec<f64>>,
    nodal: Option<Stiffness>,
}

impl RegionBonds {
    /// The stencil of the region's bulk, or with other micromoduli (N/m⁶) that of nodes near a surface.
    fn stencil(&self, neighbourhood: &Neighbourhood, micromodulus: &[f64]) -> Stencil {
        let mut stencil = Stencil::new(neighbourhood, micromodulus);
        stencil.nodal = self.nodal;
        if let Some(critical) = &self.critical {
            stencil.critical.clone_from(critical);
        }
        stencil
    }
}

/// What a user should know of the bonds of regions.
pub(super) fn warnings(regions: &[RegionEvidence]) -> Vec<String> {
    regions.iter().flat_map(RegionEvidence::warnings).collect()
}

/// Calibrate the bonds of every region.
fn calibrate(problem: &Problem) -> Result<(Vec<RegionBonds>, Vec<RegionEvidence>)> {
    let settings = match problem.model {
        Model::Central => ModelSettings::Central(LowerBound::Value(0.0), problem.metric),
        // Nodes near surfaces and cracks have part of their bonds: with Z ⪰ 0 no part of them has negative energy.
        Model::Hybrid => ModelSettings::Hybrid(Some(HybridForm::Stable)),
        Model::Micropolar => return Err(Error::input("micropolar bonds do not run on grids", "use central or hybrid")),
    };
    let calibrator = ModelCalibrator::new(&problem.neighbourhood, settings)?;
    let mut bonds = Vec::with_capacity(problem.regions.len());
    let mut evidence = Vec::with_capacity(problem.regions.len());
    for (number, region) in problem.regions.iter().enumerate() {
        let place = |error: Error| error.at(format!("region {}", region.name));
        let bulk = calibrator.calibrate(&region.stiffness).map_err(place)?;
        let micromodulus = bulk.normal().to_vec();
        let fracture = region.fracture.as_ref().map(|wanted| critical(problem, region, wanted, &micromodulus));
        let (critical, report) = fracture.transpose().map_err(place)?.unzip();
        evidence.push(RegionEvidence {
            name: region.name.clone(),
            nodes: problem.body.region.iter().filter(|&&r| usize::from(r) == number + 1).count(),
            relative_error: bulk.promised_error(),
            energy_error: region.stiffness.energy_error(bulk.promised()),
            miss: region.stiffness.miss(bulk.promised()),
            stable: bulk.stability().stable,
            stability: bulk.stability().brief(),
            outcome: bulk.outcome(),
            fracture: report.flatten(),
        });
        let nodal = bulk.nodal().copied().filter(|z| z.norm() > 0.0);
        bonds.push(RegionBonds { reached: *bulk.promised(), micromodulus, critical, nodal });
    }
    Ok((bonds, evidence))
}

/// Critical stretches of a region's bonds.
fn critical(
    problem: &Problem,
    region: &RegionMaterial,
    wanted: &FractureEnergy,
    micromodulus: &[f64],
) -> Result<(Vec<f64>, Option<FractureReport>)> {
    let neighbourhood = &problem.neighbourhood;
    let planes = crack_planes(problem);
    let stretches = match wanted {
        FractureEnergy::Stretch(s) => {
            let all = micromodulus.iter().map(|c| if *c > 0.0 { *s } else { f64::INFINITY });
            return Ok((all.collect(), None));
        }
        FractureEnergy::Isotropic(energy) if is_isotropic(region) => {
            CriticalStretches::uniform(neighbourhood, micromodulus, *energy, planes)?
        }
        FractureEnergy::Isotropic(energy) => {
            CriticalStretches::directional(neighbourhood, micromodulus, planes, |_| *energy)?
        }
        FractureEnergy::Directional(values) => {
            let energy = EnergyByNormal::through(values)?;
            CriticalStretches::directional(neighbourhood, micromodulus, planes, |n| energy.at(n))?
        }
    };
    Ok((stretches.stretch, Some(stretches.report)))
}

/// Cracks in a body of one periodic layer contain the normal of the layer.
fn crack_planes(problem: &Problem) -> CrackPlanes {
    let grid = &problem.body.grid;
    let layer = (0..3).find(|&a| grid.periodic[a] && grid.nodes[a] == 1);
    layer.map_or(CrackPlanes::All, |a| CrackPlanes::Around(Vector3::ith(a, 1.0)))
}

/// Whether a material is isotropic to rounding.
fn is_isotropic(region: &RegionMaterial) -> bool {
    region.stiffness.average_moduli().is_some_and(|m| m.universal_anisotropy.abs() < 1e-9)
}

/// The bonds of a problem's body, those of truncated neighbourhoods calibrated for themselves where that is asked for,
/// pre-cracks cut; what they reach, and the tensor (Pa) of each region's.
pub(super) fn bonds(problem: &Problem) -> Result<(FailingBonds, Vec<RegionEvidence>, Vec<Stiffness>)> {
    let (regions, evidence) = calibrate(problem)?;
    let neighbourhood = &problem.neighbourhood;
    let bulk = regions.iter().map(|r| r.stencil(neighbourhood, &r.micromodulus)).collect();
    let (of_node, stencils) = if problem.surface_calibration {
        let micromoduli: Vec<Vec<f64>> = regions.iter().map(|r| r.micromodulus.clone()).collect();
        let surfaces = surface_stencils(&problem.body, neighbourhood, &micromoduli, connected(problem))?;
        let stencil = |s: &SurfaceStencil| regions[usize::from(s.region) - 1].stencil(neighbourhood, &s.micromodulus);
        (surfaces.stencil_of_node, surfaces.stencils.iter().map(stencil).collect())
    } else {
        (problem.body.region.clone(), bulk)
    };
    let (of_node, stencils) = spare(problem, of_node, stencils)?;
    let mut bonds = GridBonds::new(problem.body.clone(), neighbourhood, of_node, stencils)?;
    let tolerance = Crack::TIE * neighbourhood.spacing();
    let near = near_planes(problem);
    for (crack, near) in problem.cracks.iter().zip(&near) {
        bonds.cut(|p, q| near(p) && crack.cuts(p, q, tolerance));
    }
    let bonds = FailingBonds::new(bonds, problem.law.clone());
    Ok((bonds, evidence, regions.iter().map(|r| r.reached).collect()))
}

/// Stencils of critical stretch ∞ for nodes whose bonds never break: the mean with whatever the other end says is ∞ too.
fn spare(problem: &Problem, mut of_node: Vec<u16>, mut stencils: Vec<Stencil>) -> Result<(Vec<u16>, Vec<Stencil>)> {
    let breaks = |s: &Stencil| s.critical.iter().any(|c| c.is_finite());
    let mut spared: HashMap<u16, u16> = HashMap::new();
    for &node in &problem.unbreakable {
        let own = of_node[node as usize];
        if own == 0 || !breaks(&stencils[usize::from(own) - 1]) {
            continue;
        }
        let next = u16::try_from(stencils.len() + 1)
            .map_err(|_| Error::input("more than 65 535 kinds of nodes", "set surface_calibration = false"))?;
        of_node[node as usize] = *spared.entry(own).or_insert(next);
        if of_node[node as usize] == next {
            let critical = vec![f64::INFINITY; problem.neighbourhood.bonds().len()];
            stencils.push(Stencil { critical, ..stencils[usize::from(own) - 1].clone() });
        }
    }
    Ok((of_node, stencils))
}

/// Whether no pre-crack cuts a bond of a node, which has another end.
fn connected(problem: &Problem) -> impl Fn(usize, usize) -> bool + Sync + '_ {
    let (grid, bonds) = (&problem.body.grid, problem.neighbourhood.bonds());
    let tolerance = Crack::TIE * problem.neighbourhood.spacing();
    // Most nodes are far from every crack.
    let planes = near_planes(problem);
    let near = |node: usize| planes.iter().any(|near| near(&grid.position(node)));
    let near: Vec<bool> = match problem.cracks.is_empty() {
        true => Vec::new(),
        false => (0..grid.len()).into_par_iter().with_min_len(4096).map(near).collect(),
    };
    move |node, bond| {
        if !near.get(node).is_some_and(|near| *near) {
            return true;
        }
        // A bond is cut as seen from its first end, from which its offset is positive.
        let (first, bond) = match bond >= bonds.len() / 2 {
            true => (Some(node), bond),
            false => (grid.neighbour(node, bonds[bond].offset), bonds.len() - 1 - bond),
        };
        first.is_some_and(|first| {
            let from = grid.position(first);
            let to = from + bonds[bond].xi;
            !problem.cracks.iter().any(|crack| crack.cuts(&from, &to, tolerance))
        })
    }
}

/// By crack, whether a bond from a point may reach its plane: asked before the rest, for most bonds are far from it.
fn near_planes(problem: &Problem) -> Vec<impl Fn(&Vector3<f64>) -> bool + Sync> {
    let longest = problem.neighbourhood.bonds().iter().map(|b| b.xi.norm()).fold(0.0, f64::max);
    let reach = 1.001 * longest;
    let of = |crack: &Crack| {
        let (origin, normal) = crack.plane();
        move |p: &Vector3<f64>| normal.dot(&(p - origin)).abs() <= reach
    };
    problem.cracks.iter().map(of).collect()
}
