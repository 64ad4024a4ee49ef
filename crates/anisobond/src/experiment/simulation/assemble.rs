//! From materials to stencils: calibration, surfaces, critical stretches.

use serde::Serialize;

use crate::calibration::{
    Calibrator, CrackPlanes, CriticalStretches, EnergyByNormal, FractureReport, HybridCalibrator, LowerBound, Model,
};
use crate::experiment::problem::{FractureEnergy, Problem, RegionMaterial, Softening};
use crate::operator::grid::{GridBonds, Stencil};
use crate::{Error, Result};

/// What the bonds of a region reach of what was asked.
#[derive(Clone, Debug, Serialize)]
pub struct RegionEvidence {
    /// Name of the region.
    pub name: String,
    /// Material nodes.
    pub nodes: usize,
    /// ‖wanted − reached‖/‖wanted‖ of the stiffness tensor.
    pub relative_error: f64,
    /// Whether central bonds reach the Cauchy part of the tensor.
    pub feasible: bool,
    /// Fracture energy, wanted and reached; `None` where bonds do not break, or break at a given stretch.
    pub fracture: Option<FractureReport>,
}

/// Stencils of a problem, one per region, and the evidence of each.
pub(super) fn stencils(problem: &Problem) -> Result<(Vec<Stencil>, Vec<RegionEvidence>)> {
    let neighbourhood = &problem.neighbourhood;
    let central = Calibrator::new(neighbourhood);
    let hybrid = if problem.model == Model::Hybrid { Some(HybridCalibrator::new(neighbourhood)?) } else { None };
    let mut stencils = Vec::with_capacity(problem.regions.len());
    let mut evidence = Vec::with_capacity(problem.regions.len());
    for (number, region) in problem.regions.iter().enumerate() {
        let place = |error: Error| error.at(format!("region {}", region.name));
        let (calibration, nodal, relative_error) = match &hybrid {
            None => {
                let c = central.calibrate(&region.stiffness, LowerBound::Value(0.0)).map_err(place)?;
                let error = c.relative_error;
                (c, None, error)
            }
            Some(hybrid) => {
                let h = hybrid.calibrate(&region.stiffness).map_err(place)?;
                (h.bonds, (h.nodal.norm() > 0.0).then_some(h.nodal), h.relative_error)
            }
        };
        let mut stencil = Stencil::new(neighbourhood, &calibration.micromodulus);
        stencil.nodal = nodal;
        let fracture = match &region.fracture {
            None => None,
            Some(wanted) => {
                let (critical, report) = critical(problem, region, wanted, &calibration.micromodulus).map_err(place)?;
                stencil.critical = critical;
                report
            }
        };
        evidence.push(RegionEvidence {
            name: region.name.clone(),
            nodes: problem.body.region.iter().filter(|&&r| usize::from(r) == number + 1).count(),
            relative_error,
            feasible: calibration.feasible(),
            fracture,
        });
        stencils.push(stencil);
    }
    Ok((stencils, evidence))
}

/// Critical stretches of a region's bonds (the onset of softening where they soften).
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
    let critical = match problem.softening {
        Softening::Brittle => stretches.stretch,
        Softening::Linear { ratio } => stretches.onset(ratio)?,
    };
    Ok((critical, Some(stretches.report)))
}

/// Cracks in a body of one periodic layer contain the normal of the layer.
fn crack_planes(problem: &Problem) -> CrackPlanes {
    let grid = &problem.body.grid;
    let layer = (0..3).find(|&a| grid.periodic[a] && grid.nodes[a] == 1);
    layer.map_or(CrackPlanes::All, |a| CrackPlanes::Around(nalgebra::Vector3::ith(a, 1.0)))
}

/// Whether a material is isotropic to rounding.
fn is_isotropic(region: &RegionMaterial) -> bool {
    region.stiffness.average_moduli().is_some_and(|m| m.universal_anisotropy.abs() < 1e-9)
}

/// The bonds of a problem's body, pre-cracks cut.
pub(super) fn bonds(problem: &Problem) -> Result<(GridBonds<f64>, Vec<RegionEvidence>)> {
    let (stencils, evidence) = stencils(problem)?;
    let of_node = problem.body.region.clone();
    let mut bonds = GridBonds::new(problem.body.clone(), &problem.neighbourhood, of_node, stencils)?;
    for crack in &problem.cracks {
        bonds.cut(|p, q| crack.cuts(p, q));
    }
    Ok((bonds, evidence))
}
