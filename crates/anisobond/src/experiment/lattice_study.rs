//! A packing, a material, a contact radius and a model: the lattice they make, and its stiffness prescribed, summed and
//! measured.

use nalgebra::{Rotation3, Vector3};

use super::corrected::{CorrectedModuli, Correction, CorrectionReport, central_by_sum, hybrid_by_sum};
use super::element_test::ElementTest;
use crate::calibration::{
    EllipticFit, EllipticMicroplane, EllipticModuli, LatticeStiffness, Model, best_fit_stiffness, lattice_mu, unit_axis,
};
use crate::lattice::{Lattice, Packing};
use crate::operator::{Network, NodalTerm};
use crate::tensor::{Metric, SYMMETRY_TOLERANCE, Stiffness, SymmetryClass};
use crate::{Error, Result};

/// How a correction is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CorrectionChoice {
    /// Everything that the model's moduli control, for any positive definite tensor.
    #[default]
    General,
    /// The four elliptic moduli; of the micropolar model only.
    Elliptic,
}

/// Which bonds a lattice gets.
#[derive(Clone, Debug)]
pub struct LatticePlan {
    /// Central: k_t = 0. Micropolar: k_n and k_t. Hybrid: k_n and a nodal term.
    pub model: Model,
    /// Whether, and how, moduli are corrected by the lattice's own element test.
    pub correction: Option<(CorrectionChoice, Correction)>,
    /// In which sense central bonds come close to a tensor out of reach.
    pub metric: Metric,
}

impl LatticePlan {
    /// A model, and a correction of its bonds by an element test; closest by the norm.
    pub fn new(model: Model, correct: Option<CorrectionChoice>, test: ElementTest) -> Self {
        let correction = correct.map(|choice| (choice, Correction { test, ..Correction::default() }));
        LatticePlan { model, correction, metric: Metric::Norm }
    }
}

/// A lattice with the stiffnesses of its bonds.
#[derive(Clone, Debug)]
pub struct LatticeStudy {
    /// The packing's lattice.
    pub lattice: Lattice,
    /// The model.
    pub model: Model,
    /// The tensor asked of the lattice (Pa): the material's own. Elliptic moduli have something else in its place, which
    /// [`EllipticFit::prescribed`] says.
    pub prescribed: Stiffness,
    /// The material as elliptic microplane moduli about its axis, where the lattice is made of these.
    pub fit: Option<EllipticFit>,
    /// k_n and k_t of every contact.
    pub stiffness: LatticeStiffness,
    /// The nodal term of the hybrid model.
    pub nodal: Option<NodalTerm>,
    /// The moduli that a correction ended with, and how it went.
    pub correction: Option<(CorrectedModuli, CorrectionReport)>,
}

impl LatticeStudy {
    /// The lattice of a periodic packing at contact radius I_R with S's own bonds: elliptic moduli (E_N, E_T) for a
    /// stiffness transversely isotropic about an axis.
    ///
    /// # Errors
    /// A lattice that cannot be made ([`Lattice::new`]) or moduli that are not admissible
    /// ([`EllipticModuli::admissible`]).
    pub fn new(packing: Packing, target: &Stiffness, axis: &Vector3<f64>, contact_radius: f64) -> Result<Self> {
        let fit = EllipticFit::new(target, axis)?;
        LatticeStudy::elliptic(Lattice::new(packing, contact_radius)?, target, fit, None)
    }

    /// The lattice of a periodic packing at contact radius I_R by a plan: S's own bonds ([`LatticeStudy::new`]) for the
    /// micropolar model without correction or with the elliptic one; otherwise what the plan's model does for any
    /// positive definite tensor, by the sum over bonds ([`central_by_sum`], [`hybrid_by_sum`]) or corrected
    /// ([`Correction`]).
    ///
    /// # Errors
    /// As [`LatticeStudy::new`]; an elliptic correction of another model than the micropolar one; the metric of energy for other
    /// bonds than central ones without correction; a tensor that is not
    /// positive definite; what the correction refuses.
    pub fn planned(
        packing: Packing,
        target: &Stiffness,
        axis: &Vector3<f64>,
        contact_radius: f64,
        plan: &LatticePlan,
    ) -> Result<Self> {
        target.require_positive_definite()?;
        let lattice = Lattice::new(packing, contact_radius)?;
        if plan.metric == Metric::Energy && (plan.model != Model::Central || plan.correction.is_some()) {
            return Err(Error::input(
                "the metric of energy is for central bonds without correction",
                "use the model central without correction, or the metric norm",
            ));
        }
        match (plan.model, &plan.correction) {
            (Model::Micropolar, None) => LatticeStudy::elliptic(lattice, target, EllipticFit::new(target, axis)?, None),
            (Model::Micropolar, Some((choice, correction))) => match elliptic_fit(target, axis, *choice)? {
                Some(fit) => LatticeStudy::elliptic(lattice, target, fit, Some(correction)),
                None => LatticeStudy::general(lattice, target, correction),
            },
            (Model::Central | Model::Hybrid, Some((CorrectionChoice::Elliptic, _))) => Err(Error::input(
                "the elliptic correction needs tangential bonds",
                "use the general correction, or the micropolar model",
            )),
            (Model::Central, correction) => {
                LatticeStudy::central(lattice, target, plan.metric, correction.as_ref().map(|c| &c.1))
            }
            (Model::Hybrid, correction) => LatticeStudy::hybrid(lattice, target, correction.as_ref().map(|c| &c.1)),
        }
    }

    fn elliptic(
        lattice: Lattice,
        target: &Stiffness,
        fit: EllipticFit,
        correction: Option<&Correction>,
    ) -> Result<Self> {
        let mut stiffness = LatticeStiffness::new(&lattice, &fit.microplane)?;
        let mut corrected = None;
        if let Some(correction) = correction {
            let r = correction.elliptic(&lattice, &fit)?;
            stiffness = r.stiffness(stiffness.mu);
            corrected = Some((r.moduli, r.report));
        }
        let prescribed = *target;
        let (model, nodal) = (Model::Micropolar, None);
        Ok(LatticeStudy { lattice, model, prescribed, fit: Some(fit), stiffness, nodal, correction: corrected })
    }

    fn general(lattice: Lattice, target: &Stiffness, correction: &Correction) -> Result<Self> {
        let r = correction.general(&lattice, target)?;
        let network = r.network;
        LatticeStudy::of_network(lattice, Model::Micropolar, target, network, Some((r.moduli, r.report)))
    }

    fn central(lattice: Lattice, target: &Stiffness, metric: Metric, correction: Option<&Correction>) -> Result<Self> {
        let (network, corrected) = match correction {
            None => {
                let aim = target.cauchy_part_in(metric).unwrap_or_else(|| target.cauchy_part());
                (central_by_sum(&lattice, &aim, Correction::default().floor)?, None)
            }
            Some(correction) => {
                let r = correction.central(&lattice, target)?;
                (r.network, Some((r.moduli, r.report)))
            }
        };
        LatticeStudy::of_network(lattice, Model::Central, target, network, corrected)
    }

    fn hybrid(lattice: Lattice, target: &Stiffness, correction: Option<&Correction>) -> Result<Self> {
        let (network, corrected) = match correction {
            None => (hybrid_by_sum(&lattice, target, Correction::default().floor)?, None),
            Some(correction) => {
                let r = correction.hybrid(&lattice, target)?;
                (r.network, Some((r.moduli, r.report)))
            }
        };
        LatticeStudy::of_network(lattice, Model::Hybrid, target, network, corrected)
    }

    fn of_network(
        lattice: Lattice,
        model: Model,
        target: &Stiffness,
        network: Network,
        correction: Option<(CorrectedModuli, CorrectionReport)>,
    ) -> Result<Self> {
        let stiffness = LatticeStiffness {
            mu: lattice_mu(&lattice),
            normal: network.bonds.iter().map(|b| b.normal).collect(),
            tangential: network.bonds.iter().map(|b| b.tangential).collect(),
        };
        let nodal = network.nodal;
        Ok(LatticeStudy { lattice, model, prescribed: *target, fit: None, stiffness, nodal, correction })
    }

    /// The microplane moduli that the bonds have, where they are elliptic: the fit's, or the corrected ones.
    pub fn microplane(&self) -> Option<EllipticMicroplane> {
        match (&self.correction, &self.fit) {
            (Some((CorrectedModuli::Elliptic(microplane), _)), _) => Some(*microplane),
            (_, fit) => fit.map(|fit| fit.microplane),
        }
    }

    /// Lattice moduli E′ = E/μ (Pa) (S eq-Eelliptic-micro), where the bonds are made of elliptic ones.
    pub fn lattice_moduli(&self) -> Option<EllipticModuli> {
        self.microplane().map(|m| m.moduli.scaled(1.0 / self.stiffness.mu))
    }

    /// The sum over bonds (and nodes) at uniform strain (Pa) (S eq-tE-knkt); an upper bound.
    pub fn summed(&self) -> Stiffness {
        let bonds = self.stiffness.summed(&self.lattice);
        match &self.nodal {
            Some(term) => Stiffness::from_mandel(bonds.mandel() + term.stiffness.mandel()),
            None => bonds,
        }
    }

    /// The best-fit estimate (Pa), a lower companion.
    ///
    /// # Errors
    /// As [`best_fit_stiffness`].
    pub fn best_fit(&self) -> Result<Stiffness> {
        best_fit_stiffness(&self.lattice, &self.stiffness)
    }

    /// What elliptic moduli stand for (Pa), where that is not the material.
    pub fn replaced(&self) -> Option<&Stiffness> {
        let elliptic = &self.fit.as_ref()?.prescribed;
        (self.prescribed.relative_error(elliptic) > 1e-6).then_some(elliptic)
    }

    /// What to say of what the lattice has, measured or summed (Pa), where that is noticeably not what was asked.
    pub fn miss(&self, has: &Stiffness) -> Option<String> {
        let miss = self.prescribed.miss(has)?;
        let replaced = self.fit.as_ref().filter(|fit| (fit.dependent_c44 / fit.given_c44 - 1.0).abs() > 1e-6);
        let replaced = replaced.map_or(String::new(), |fit| {
            format!(
                "; elliptic moduli have four constants, and C44 = {:.4} GPa follows from them, for {:.4} GPa of the material",
                1e-9 * fit.dependent_c44,
                1e-9 * fit.given_c44
            )
        });
        let way = match (self.model, &self.correction) {
            (Model::Hybrid, Some(_)) => "A larger contact radius has more bonds",
            (Model::Hybrid, None) => "Correct the bonds by their own element test (correct)",
            (_, None) => {
                "Correct the bonds by their own element test (correct), or use the hybrid model, which reaches every \
                 stiffness when it is corrected, as on a grid with model.bonds = \"hybrid\""
            }
            (_, Some(_)) => {
                "The hybrid model reaches every stiffness when it is corrected, as on a grid with model.bonds = \"hybrid\""
            }
        };
        Some(format!("the lattice is not the material: {miss}{replaced}. {way}"))
    }

    /// Nodes, stiff bonds and nodal term.
    pub fn network(&self) -> Network {
        Network { nodal: self.nodal.clone(), ..Network::new(&self.lattice, &self.stiffness) }
    }
}

/// The fit to correct, or `None` for the general form.
fn elliptic_fit(target: &Stiffness, axis: &Vector3<f64>, choice: CorrectionChoice) -> Result<Option<EllipticFit>> {
    match choice {
        CorrectionChoice::General => Ok(None),
        CorrectionChoice::Elliptic => EllipticFit::new(target, axis).map(Some),
    }
}

/// The tensor turned by the smallest rotation that takes its own anisotropy axis to a given one (any length but zero).
///
/// # Errors
/// An axis without direction.
pub fn turned_to_axis(c: &Stiffness, axis: &Vector3<f64>) -> Result<Stiffness> {
    let axis = unit_axis(axis)?;
    let own = anisotropy_axis(c);
    // An axis has no sign.
    let own = if own.dot(&axis) < 0.0 { -own } else { own };
    Ok(match Rotation3::rotation_between(&own, &axis) {
        Some(q) => c.rotated(q.matrix()),
        None => *c,
    })
}

/// The axis of a material: that of its closest transversely isotropic tensor; e₃ for an isotropic one.
pub fn anisotropy_axis(c: &Stiffness) -> Vector3<f64> {
    let symmetry = c.symmetry(SYMMETRY_TOLERANCE);
    if symmetry.fit(SymmetryClass::Isotropic).distance < 1e-12 {
        return Vector3::z();
    }
    symmetry.fit(SymmetryClass::TransverselyIsotropic).axes.column(2).into()
}
