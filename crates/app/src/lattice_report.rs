//! What the program says of a lattice and of its element test, as one JSON document each.

use serde::Serialize;

use crate::report::{SolveOutcome, Voigt};
use anisobond::calibration::{EllipticModuli, Model};
use anisobond::experiment::element_test::{Certificate, DynamicTestResult, ElementTestResult, Mechanism, Rotations};
use anisobond::experiment::{CorrectionReport, LatticeStudy};
use anisobond::lattice::PackingStatistics;
use anisobond::tensor::{EngineeringConstants, Material, Stiffness};
use anisobond::{Error, Result};

/// A lattice made of a packing and a material. Stresses in Pa.
#[derive(Clone, Debug, Serialize)]
pub struct LatticeReport {
    /// Name of the material.
    pub material: String,
    /// Where its numbers come from.
    pub source: String,
    /// Density (kg/m³), if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// central, micropolar or hybrid.
    pub model: Model,
    /// Contact radius I_R.
    pub contact_radius: f64,
    /// Number of contacts, each once.
    pub contacts: usize,
    /// Mean number of contacts per sphere.
    pub coordination: f64,
    /// The packing and its contacts in numbers.
    pub packing: PackingStatistics,
    /// Lattice density scaling μ = E/E′.
    pub mu: f64,
    /// What of it is elliptic; nothing for other moduli.
    #[serde(flatten)]
    pub elliptic: Option<EllipticReport>,
    /// The tensor asked of the lattice: the material's (Voigt, Pa).
    pub prescribed: Voigt,
    /// Summed over the lattice at uniform strain, an upper bound (Voigt, Pa).
    pub lattice: Voigt,
    /// Least and largest relative error of the energy of a strain, over all strains: of what an element test has measured,
    /// where one was made, else of the sum over bonds.
    pub energy_error: Option<[f64; 2]>,
    /// What to look at.
    pub warnings: Vec<String>,
    /// Best-fit estimate, the lower companion (Voigt, Pa); `None` where it has no meaning, as for bonds without
    /// tangential stiffness.
    pub best_fit: Option<Voigt>,
    /// The nodal term Z (Voigt, Pa) of the hybrid model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nodal_term: Option<Voigt>,
    /// How the correction went, if one was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correction: Option<CorrectionReport>,
}

/// Elliptic moduli of a lattice and what they cannot follow.
#[derive(Clone, Debug, Serialize)]
pub struct EllipticReport {
    /// Microplane moduli E (Pa), corrected ones after a correction.
    pub microplane_moduli: EllipticModuli,
    /// Lattice moduli E′ = E/μ (Pa).
    pub lattice_moduli: EllipticModuli,
    /// Anisotropy axis, a unit vector.
    pub axis: [f64; 3],
    /// ‖C − C_TI‖/‖C‖ of the material from transverse isotropy about the axis.
    pub distance_from_transverse_isotropy: f64,
    /// What the moduli stand for, where it is not the material: the four constants and the dependent C44 (Voigt, Pa).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub elliptic: Option<Voigt>,
    /// C44 of the material, and the one the elliptic interpolation has instead (Pa).
    pub c44: DependentComponent,
}

/// C44 as given and as the elliptic interpolation has it (Pa).
#[derive(Clone, Copy, Debug, Serialize)]
pub struct DependentComponent {
    /// Of the material.
    pub given: f64,
    /// ¼C11 + ¼C33 − ½C13.
    pub dependent: f64,
}

impl LatticeReport {
    /// Describe a lattice.
    ///
    /// # Errors
    /// A lattice whose statistics cannot be had.
    pub fn new(material: &Material, study: &LatticeStudy) -> Result<Self> {
        let statistics = study.lattice.statistics()?;
        let elliptic = study.fit.as_ref().zip(study.microplane()).map(|(fit, microplane)| EllipticReport {
            microplane_moduli: microplane.moduli,
            lattice_moduli: microplane.moduli.scaled(1.0 / study.stiffness.mu),
            axis: microplane.axis.into(),
            distance_from_transverse_isotropy: fit.distance,
            elliptic: study.replaced().map(|c| c.voigt_rows()),
            c44: DependentComponent { given: fit.given_c44, dependent: fit.dependent_c44 },
        });
        let measured = study.correction.as_ref().map(|(_, report)| Stiffness::from_voigt_rows(&report.measured));
        let has = measured.transpose()?.unwrap_or_else(|| study.summed());
        Ok(LatticeReport {
            energy_error: study.prescribed.energy_error(&has),
            warnings: study.miss(&has).into_iter().chain(material.doubts()).collect(),
            material: material.name.clone(),
            source: material.source.clone(),
            density: material.density,
            model: study.model,
            contact_radius: study.lattice.contact_radius,
            contacts: statistics.contacts,
            coordination: statistics.coordination.mean,
            packing: statistics,
            mu: study.stiffness.mu,
            elliptic,
            prescribed: study.prescribed.voigt_rows(),
            lattice: study.summed().voigt_rows(),
            best_fit: study.best_fit().ok().filter(|_| study.nodal.is_none()).map(|c| c.voigt_rows()),
            nodal_term: study.nodal.as_ref().map(|term| term.stiffness.voigt_rows()),
            correction: study.correction.as_ref().map(|(_, report)| report.clone()),
        })
    }
}

impl LatticeReport {
    /// The same of a lattice that an element test has measured.
    fn tested(self, material: &Material, study: &LatticeStudy, measured: &Stiffness) -> Self {
        LatticeReport {
            energy_error: study.prescribed.energy_error(measured),
            warnings: study.miss(measured).into_iter().chain(material.doubts()).collect(),
            ..self
        }
    }
}

/// Engineering constants of a measured stiffness; νij = −εj/εi under tension along i.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[allow(missing_docs)] // Young's moduli E, Poisson's ratios ν, shear moduli G (Pa) by axes.
pub struct Engineering {
    pub ex: f64,
    pub ey: f64,
    pub ez: f64,
    pub nu_xy: f64,
    pub nu_xz: f64,
    pub nu_yx: f64,
    pub nu_yz: f64,
    pub nu_zx: f64,
    pub nu_zy: f64,
    pub gyz: f64,
    pub gzx: f64,
    pub gxy: f64,
}

impl From<EngineeringConstants> for Engineering {
    fn from(e: EngineeringConstants) -> Self {
        Engineering {
            ex: e.e1,
            ey: e.e2,
            ez: e.e3,
            nu_xy: e.nu12,
            nu_xz: e.nu13,
            nu_yx: e.nu21,
            nu_yz: e.nu23,
            nu_zx: e.nu31,
            nu_zy: e.nu32,
            gyz: e.g23,
            gzx: e.g13,
            gxy: e.g12,
        }
    }
}

/// An element test, with the lattice it was made on.
#[derive(Clone, Debug, Serialize)]
pub struct ElementTestReport {
    /// The lattice.
    #[serde(flatten)]
    pub lattice: LatticeReport,
    /// The measured tensor (Voigt, Pa).
    pub measured: Voigt,
    /// ‖measured − prescribed‖/‖prescribed‖.
    pub relative_error: f64,
    /// Engineering constants of the measured tensor; `None` if it is singular.
    pub engineering: Option<Engineering>,
    /// The consistency of the constants with transverse isotropy about z; `None` where the axis is another.
    pub consistency: Option<Consistency>,
    /// Whether nodes rotated.
    pub rotations: Rotations,
    /// How it was measured.
    pub method: Method,
    /// Strain of the test: 0 for the limit of small strain, the logarithmic strain of a dynamic test.
    pub strain: f64,
    /// What of the answer was checked, independently.
    pub certificate: Checks,
    /// Nodes that move at no cost; `None` where it was not looked for.
    pub mechanism: Option<Mechanism>,
    /// How the solver ended.
    pub solver: SolveOutcome,
}

/// What transverse isotropy about z makes equal, as S tabulates it: five symmetric couples, and two dependent values
/// computed from the couples' means.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[allow(missing_docs)] // Pairs of the constants of `Engineering`.
pub struct Consistency {
    pub ex_ey: [f64; 2],
    pub gyz_gzx: [f64; 2],
    pub nu_xy_nu_yx: [f64; 2],
    pub nu_xz_nu_yz: [f64; 2],
    pub nu_zx_nu_zy: [f64; 2],
    /// ν_xz = ν_zx E_x/E_z.
    pub dependent_nu_xz: f64,
    /// G_xy = E_x/2(1 + ν_xy) (Pa).
    pub dependent_gxy: f64,
}

impl Consistency {
    fn new(e: &Engineering) -> Self {
        let mean = |[a, b]: [f64; 2]| 0.5 * (a + b);
        let (ex_ey, nu_xy_nu_yx, nu_zx_nu_zy) = ([e.ex, e.ey], [e.nu_xy, e.nu_yx], [e.nu_zx, e.nu_zy]);
        Consistency {
            ex_ey,
            gyz_gzx: [e.gyz, e.gzx],
            nu_xy_nu_yx,
            nu_xz_nu_yz: [e.nu_xz, e.nu_yz],
            nu_zx_nu_zy,
            dependent_nu_xz: mean(nu_zx_nu_zy) * mean(ex_ey) / e.ez,
            dependent_gxy: mean(ex_ey) / (2.0 * (1.0 + mean(nu_xy_nu_yx))),
        }
    }

    /// For a lattice whose axis is z.
    fn of(lattice: &LatticeReport, e: Option<&Engineering>) -> Option<Self> {
        let axis = lattice.elliptic.as_ref()?.axis;
        (axis[2].abs() > 1.0 - 1e-9).then(|| e.map(Consistency::new)).flatten()
    }
}

/// How a stiffness is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Periodic homogenisation at small strain.
    Static,
    /// The document's procedure: servo-controlled compression and pure shear to a finite strain.
    Dynamic,
}

/// The checks of a test.
#[derive(Clone, Copy, Debug, Serialize)]
#[serde(untagged)]
pub enum Checks {
    /// Balance, symmetry and energy consistency of a static test.
    Static(Certificate),
    /// What a dynamic test left over.
    Dynamic {
        /// Largest unbalanced force or moment of a node, relative to the mean of a bond.
        force_balance: f64,
        /// Largest lateral stress, relative to the axial one.
        lateral_stress: f64,
        /// Largest relative difference of a symmetric couple ν_ij/E_i = ν_ji/E_j.
        asymmetry: f64,
    },
}

impl ElementTestReport {
    /// Describe a static element test.
    ///
    /// # Errors
    /// As [`LatticeReport::new`].
    pub fn of_static(material: &Material, study: &LatticeStudy, r: &ElementTestResult) -> Result<Self> {
        let lattice = LatticeReport::new(material, study)?.tested(material, study, &r.measured);
        let engineering = r.engineering.map(Engineering::from);
        Ok(ElementTestReport {
            measured: r.measured.voigt_rows(),
            relative_error: study.prescribed.relative_error(&r.measured),
            consistency: Consistency::of(&lattice, engineering.as_ref()),
            lattice,
            engineering,
            rotations: r.rotations,
            method: Method::Static,
            strain: 0.0,
            certificate: Checks::Static(r.certificate),
            mechanism: Some(r.mechanism.clone()),
            solver: r.solver.into(),
        })
    }

    /// Describe a dynamic element test.
    ///
    /// # Errors
    /// As [`LatticeReport::new`], or constants that make no stiffness.
    pub fn of_dynamic(material: &Material, study: &LatticeStudy, r: &DynamicTestResult) -> Result<Self> {
        let measured = r.measured.ok_or_else(|| {
            Error::input(
                "the measured constants make no stiffness",
                "test at a smaller strain or a larger contact radius",
            )
        })?;
        let e = r.engineering;
        let couples = [(e.nu12 / e.e1, e.nu21 / e.e2), (e.nu13 / e.e1, e.nu31 / e.e3), (e.nu23 / e.e2, e.nu32 / e.e3)];
        let asymmetry = couples.iter().map(|(a, b)| 2.0 * (a - b).abs() / (a.abs() + b.abs())).fold(0.0, f64::max);
        let lattice = LatticeReport::new(material, study)?.tested(material, study, &measured);
        let engineering = Engineering::from(e);
        Ok(ElementTestReport {
            measured: measured.voigt_rows(),
            relative_error: study.prescribed.relative_error(&measured),
            consistency: Consistency::of(&lattice, Some(&engineering)),
            lattice,
            engineering: Some(engineering),
            rotations: r.rotations,
            method: Method::Dynamic,
            strain: r.strain,
            certificate: Checks::Dynamic { force_balance: r.unbalanced, lateral_stress: r.lateral, asymmetry },
            mechanism: None,
            solver: SolveOutcome {
                iterations: r.steps.iter().sum(),
                residual: r.unbalanced,
                converged: r.converged,
                negative_curvature: false,
            },
        })
    }
}
