//! Calibration of a lattice's bonds corrected by its own element test.
//!
//! Moduli put on the bonds under Voigt's hypothesis give a lattice that is too soft, for nodes move and turn against the
//! mean strain. The derivative of the measured tensor with respect to a bond's stiffness is the bond's own relaxed
//! energy ([`BondDeformation`](super::element_test::BondDeformation)), so the tensor is brought onto its target by
//! Gauss-Newton: measure, solve for the moduli with the deformations as they are, measure again (`search`). What is
//! corrected is a form: four elliptic moduli (`elliptic`), a modulus for every direction (`general`) or the nodal term
//! (`nodal`). Packings and grid cells with defects are networks alike.

mod elliptic;
mod general;
mod nodal;
mod report;
mod search;

use std::sync::Arc;

use nalgebra::Vector3;

use self::elliptic::Elliptic;
use self::general::{General, isotropic_moduli};
use self::nodal::Nodal;
pub use self::report::{CorrectedModuli, CorrectedNetwork, CorrectionForm, CorrectionReport, NodalReport};
use self::search::{Form, Search};
use super::element_test::ElementTest;
use crate::calibration::{DirectionModuli, EllipticFit, LatticeStiffness, PI_HAT, tensor_of_coordinates};
use crate::lattice::Lattice;
use crate::operator::{Network, NodalTerm, StiffBond};
use crate::tensor::Stiffness;
use crate::{Error, Result};

/// Shares of the central bonds that the hybrid model keeps, tried in turn until the lattice is stable. The last leaves
/// nearly all to Z, which is then as positive as the target.
const BOND_SHARES: [f64; 6] = [1.0, 0.5, 0.25, 0.1, 0.03, 0.01];

/// A Kelvin modulus of Z above minus this share of ‖C‖ is not negative.
const NOT_NEGATIVE: f64 = 1e-12;

/// How a lattice's bonds are corrected.
#[derive(Clone, Debug)]
pub struct Correction {
    /// The test that measures. Fields are always taken; its watch is told which correction is under way, and can stop it.
    pub test: ElementTest,
    /// Relative error of the measured constants (or tensor) at which to stop (–).
    pub tolerance: f64,
    /// Most corrections, an element test each (and one before the first).
    pub most_corrections: usize,
    /// Least modulus of a bond, as a share of the largest modulus of the start (–); above zero keeps every bond.
    pub floor: f64,
}

impl Default for Correction {
    fn default() -> Self {
        Correction { test: ElementTest::default(), tolerance: 1e-4, most_corrections: 12, floor: 1e-4 }
    }
}

impl Correction {
    /// Correct the four elliptic moduli until the measured C11, C33, C13 and C12 (of the transversely isotropic
    /// projection about the axis) are those of the fit; C44 follows from them.
    ///
    /// # Errors
    /// Settings out of range, constants that are zero or belong to no positive definite tensor, what
    /// [`LatticeStiffness::new`] and [`ElementTest::run`] refuse.
    pub fn elliptic(&self, lattice: &Lattice, fit: &EllipticFit) -> Result<CorrectedNetwork> {
        self.check()?;
        let unit = unit_network(lattice)?;
        let form = Elliptic::new(fit, directions(lattice), self.floor)?;
        let search = Search::run(self, &unit, &form, &[form.start(fit)])?.sound()?;
        let moduli = form.moduli(&search.parameters);
        Ok(search.finished(self, CorrectionForm::Elliptic, moduli, &fit.prescribed, None))
    }

    /// Correct E_N(n) and E_T(n) until the measured tensor is the target, with the least change from the moduli of the
    /// closest isotropic tensor; see [`Correction::general_from`].
    ///
    /// # Errors
    /// As [`Correction::general_from`].
    pub fn general(&self, lattice: &Lattice, target: &Stiffness) -> Result<CorrectedNetwork> {
        let moduli = isotropic_moduli(target);
        self.general_from(lattice, target, &|_: &Vector3<f64>| moduli)
    }

    /// Correct E_N(n) and E_T(n) until the measured tensor is the target.
    ///
    /// Of all moduli ≥ f whose sum over the bonds is a given tensor, those with the least Σ w ((E_N − E_N⁰)² +
    /// (E_T − E_T⁰)²), w a bond's weight in the sum, are E_N = max(f, E_N⁰ + N:Y), E_T = max(f, E_T⁰ + T:Y) with one
    /// tensor Y (the dual vector): even harmonics of degree up to 4, of which 21 combinations matter. The corrections
    /// keep that form and choose Y so that the measured tensor is met instead of the sum.
    ///
    /// # Errors
    /// A target that is not positive definite, settings out of range, start moduli that are not finite, what
    /// [`ElementTest::run`] refuses.
    pub fn general_from(
        &self,
        lattice: &Lattice,
        target: &Stiffness,
        start: &impl DirectionModuli,
    ) -> Result<CorrectedNetwork> {
        let start = directions(lattice).iter().map(|n| start.moduli(n)).collect();
        self.general_on(&unit_network(lattice)?, start, target, true)
    }

    /// Correct E_N(n) of normal bonds (k_t = 0) until the Cauchy part of the measured tensor is that of the target: the
    /// closest that central bonds can be asked for.
    ///
    /// # Errors
    /// As [`Correction::general_from`].
    pub fn central(&self, lattice: &Lattice, target: &Stiffness) -> Result<CorrectedNetwork> {
        let (en, _) = isotropic_moduli(&target.cauchy_part());
        self.general_on(&unit_network(lattice)?, vec![(en, 0.0); lattice.contacts.len()], target, false)
    }

    /// As [`Correction::general_from`] and [`Correction::central`] on any network whose stiffnesses are those of unit
    /// moduli, with start moduli (E_N⁰, E_T⁰) of every bond; `tangential` says whether bonds have tangential stiffness.
    ///
    /// # Errors
    /// As [`Correction::general_from`]; a number of start moduli other than that of the bonds.
    pub fn general_on(
        &self,
        unit: &Network,
        start: Vec<(f64, f64)>,
        target: &Stiffness,
        tangential: bool,
    ) -> Result<CorrectedNetwork> {
        self.check()?;
        target.require_positive_definite()?;
        if start.len() != unit.bonds.len() {
            return Err(Error::input(
                format!("{} start moduli for {} bonds", start.len(), unit.bonds.len()),
                "give one pair per bond",
            ));
        }
        let form = General::new(unit, start, target, self.floor, tangential, &self.test.watch)?;
        // Before the first test: the moduli that Voigt's hypothesis gives; where that is poor, the start itself.
        let search = Search::run(self, unit, &form, &[form.of_sum(unit), nalgebra::SVector::zeros()])?.sound()?;
        let moduli = form.described(&search.parameters);
        let kind = if tangential { CorrectionForm::General } else { CorrectionForm::Central };
        Ok(search.finished(self, kind, moduli, target, None))
    }

    /// Correct the nodal term of [`hybrid_by_sum`] until the measured tensor is the target.
    ///
    /// # Errors
    /// As [`Correction::hybrid_on`].
    pub fn hybrid(&self, lattice: &Lattice, target: &Stiffness) -> Result<CorrectedNetwork> {
        self.hybrid_on(&hybrid_by_sum(lattice, target, self.floor)?, target)
    }

    /// Correct the nodal term Z of a network until the measured tensor is the target, its bonds as they are. Where that
    /// takes a Z so negative that the lattice has displacements of negative energy, the bonds are weakened and Z takes
    /// over more, until it is stable.
    ///
    /// # Errors
    /// A target that is not positive definite; a network without a nodal term; settings out of range; what
    /// [`ElementTest::run`] refuses; no share of the bonds with a stable lattice.
    pub fn hybrid_on(&self, start: &Network, target: &Stiffness) -> Result<CorrectedNetwork> {
        self.check()?;
        target.require_positive_definite()?;
        let Some(term) = &start.nodal else {
            return Err(Error::input(
                "the network has no nodal term to correct",
                "give one, of zero stiffness if need be",
            ));
        };
        let flat_nodes = term.volumes.iter().filter(|v| **v == 0.0).count();
        let mut refused_shares = Vec::new();
        let mut best: Option<(f64, Search<21>)> = None;
        for share in BOND_SHARES {
            let form = Nodal { share, target: *target };
            let search = Search::run(self, start, &form, &[form.of_sum(start)])?;
            // Weaker bonds help where Z was too negative, not where a positive Z falls short.
            let z = Stiffness::from_mandel(tensor_of_coordinates(&search.parameters));
            let positive = z.eigen().0[0] >= -NOT_NEGATIVE * target.norm();
            let ended = search.error() <= self.tolerance || (positive && search.error().is_finite());
            if best.as_ref().is_none_or(|(_, old)| search.error() < old.error()) {
                best = Some((share, search));
            }
            if ended {
                break;
            }
            refused_shares.push(share);
        }
        let unstable = || {
            Error::mechanism(
                "no share of the bonds with a nodal term is a stable lattice",
                "give a larger contact radius or horizon, or use the micropolar model",
            )
        };
        let (bond_share, search) = best.ok_or_else(unstable)?;
        let search = search.sound()?;
        if search.error().is_infinite() {
            return Err(unstable());
        }
        refused_shares.retain(|share| *share > bond_share);
        let z = Stiffness::from_mandel(tensor_of_coordinates(&search.parameters));
        let moduli: [f64; 6] = z.eigen().0.into();
        let nodal = NodalReport {
            stiffness: z.voigt_rows(),
            moduli,
            positive: moduli[0] >= -NOT_NEGATIVE * target.norm(),
            bond_share,
            refused_shares,
            flat_nodes,
        };
        Ok(search.finished(self, CorrectionForm::Nodal, CorrectedModuli::Nodal(Box::new(z)), target, Some(nodal)))
    }

    fn check(&self) -> Result<()> {
        for (name, value) in [("tolerance", self.tolerance), ("floor", self.floor)] {
            if !(0.0..1.0).contains(&value) {
                return Err(Error::input(
                    format!("the correction's {name} is {value}"),
                    "give a number from 0 to below 1",
                ));
            }
        }
        Ok(())
    }
}

/// A lattice of normal bonds whose sum (Voigt's hypothesis) has the Cauchy part of a tensor, as near as moduli above the
/// floor (a share of the isotropic one) come.
///
/// # Errors
/// A tensor that is not positive definite; a lattice without contacts.
pub fn central_by_sum(lattice: &Lattice, target: &Stiffness, floor: f64) -> Result<Network> {
    target.require_positive_definite()?;
    let unit = unit_network(lattice)?;
    let (en, _) = isotropic_moduli(&target.cauchy_part());
    let form = General::new(&unit, vec![(en, 0.0); unit.bonds.len()], target, floor, false, &Arc::default())?;
    let mut network = unit.clone();
    form.put(&unit, &form.of_sum(&unit), &mut network);
    Ok(network)
}

/// The bonds of [`central_by_sum`] with the nodal term that is missing to the tensor, Z = C − sum over bonds. A node's
/// volume is its share of the contacts' volumes, π̂ r² ℓ/3 each and half to either end; its average strain weighs a
/// contact by π̂ r²/ℓ, the stiffness of unit modulus.
///
/// # Errors
/// As [`central_by_sum`]; no node with contacts in three directions.
pub fn hybrid_by_sum(lattice: &Lattice, target: &Stiffness, floor: f64) -> Result<Network> {
    let mut network = central_by_sum(lattice, target, floor)?;
    let z = Stiffness::from_mandel(tensor_of_coordinates(&Nodal { share: 1.0, target: *target }.of_sum(&network)));
    network.nodal = Some(nodal_on_contacts(&z, lattice.packing.radii(), &network.bonds, network.volume)?);
    Ok(network)
}

/// A nodal term Z (Pa) on the contacts of spheres with radii (m) that fill a volume (m³): ω = π̂ r′²/ℓ, V_i in proportion to
/// Σ π̂ r′² ℓ.
///
/// # Errors
/// As [`NodalTerm::filling`].
pub fn nodal_on_contacts(z: &Stiffness, radii: &[f64], bonds: &[StiffBond], volume: f64) -> Result<NodalTerm> {
    let mut shares = vec![0.0; radii.len()];
    let mut weights = Vec::with_capacity(bonds.len());
    for bond in bonds {
        let (a, b) = (bond.a as usize, bond.b as usize);
        let (area, length) = (PI_HAT * radii[a].min(radii[b]).powi(2), bond.branch.norm());
        weights.push(area / length);
        shares[a] += area * length / 6.0;
        shares[b] += area * length / 6.0;
    }
    NodalTerm::filling(z, bonds, volume, &shares, weights)
}

/// Directions of a lattice's bonds.
fn directions(lattice: &Lattice) -> Vec<Vector3<f64>> {
    lattice.contacts.iter().map(|c| c.branch.normalize()).collect()
}

/// The lattice with unit moduli (1 Pa) on its bonds.
fn unit_network(lattice: &Lattice) -> Result<Network> {
    let unit = LatticeStiffness::new(lattice, &|_: &Vector3<f64>| (1.0, 1.0))?;
    Ok(Network::new(lattice, &unit))
}
