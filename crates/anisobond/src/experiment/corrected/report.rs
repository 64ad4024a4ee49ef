//! How a corrected calibration ended.

use serde::Serialize;

use crate::calibration::{EllipticMicroplane, LatticeStiffness};
use crate::experiment::element_test::ElementTestResult;
use crate::operator::Network;
use crate::tensor::Stiffness;

/// What is corrected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CorrectionForm {
    /// The four elliptic moduli, to meet C11, C33, C13 and C12 about the axis.
    Elliptic,
    /// E_N(n) and E_T(n) as even harmonics up to degree 4 above a floor, to meet all 21 components.
    General,
    /// E_N(n) alone, to meet the 15 components of the Cauchy part.
    Central,
    /// The nodal term Z beside central bonds, to meet all 21 components.
    Nodal,
}

/// How a corrected calibration ended, and by which way.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CorrectionReport {
    /// What was corrected.
    pub form: CorrectionForm,
    /// Whether the error came down to the tolerance.
    pub converged: bool,
    /// Corrections that were made.
    pub corrections: usize,
    /// Element tests that were run.
    pub tests: usize,
    /// Error before the first correction and after each (–): of the worst of the four constants, relative to its own
    /// target (elliptic), of the Cauchy part relative to the target's norm (central), or of the tensor in its norm.
    pub history: Vec<f64>,
    /// The last of them: the distance to the nearest that was found, when not converged.
    pub error: f64,
    /// The wanted tensor (Voigt, Pa); for the elliptic form what the moduli prescribe.
    pub target: [[f64; 6]; 6],
    /// The measured tensor (Voigt, Pa): the nearest that was found, when not converged.
    pub measured: [[f64; 6]; 6],
    /// measured − target, component by component (Voigt, Pa).
    pub remaining: [[f64; 6]; 6],
    /// ‖target − measured‖/‖target‖ of the whole tensor.
    pub tensor_error: f64,
    /// Whether no further correction took anything off the error: as far as the search can tell, the target is out of the
    /// form's reach on this lattice, and the measured tensor is the nearest that was found.
    pub out_of_reach: bool,
    /// What is left and why, in words; `None` where the whole tensor is met.
    pub shortfall: Option<String>,
    /// Smallest k_n of a bond (N/m).
    pub smallest_normal: f64,
    /// Largest k_n of a bond (N/m).
    pub largest_normal: f64,
    /// Smallest k_t of a bond (N/m).
    pub smallest_tangential: f64,
    /// Largest k_t of a bond (N/m).
    pub largest_tangential: f64,
    /// Moduli that are held at the floor: of the four elliptic ones, or of those of every bond.
    pub at_floor: usize,
    /// The nodal term, where that was corrected.
    pub nodal: Option<NodalReport>,
}

/// A corrected nodal term.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NodalReport {
    /// Z (Voigt, Pa).
    pub stiffness: [[f64; 6]; 6],
    /// Its Kelvin moduli, ascending (Pa).
    pub moduli: [f64; 6],
    /// Whether none of them is negative: then nothing can have negative energy.
    pub positive: bool,
    /// Share of the central bonds' stiffness that was kept (–): less than 1 where Z would have made the lattice unstable.
    pub bond_share: f64,
    /// Larger shares that were tried and met displacements of negative energy, or no such target.
    pub refused_shares: Vec<f64>,
    /// Nodes without an average strain, for their bonds lie in a plane.
    pub flat_nodes: usize,
}

/// The moduli that a correction ended with.
#[derive(Clone, Debug, PartialEq)]
pub enum CorrectedModuli {
    /// Elliptic moduli (Pa) about their axis.
    Elliptic(EllipticMicroplane),
    /// E_N(n) = max(f, E_N⁰(n) + N:Y), E_T(n) = max(f, E_T⁰(n) + T:Y), or E_N alone: N:Y and T:Y are even harmonics up to
    /// degree 4.
    General {
        /// The tensor Y (Pa), as a stiffness.
        change: Box<Stiffness>,
        /// The floor f (Pa).
        floor: f64,
    },
    /// The nodal term Z (Pa).
    Nodal(Box<Stiffness>),
}

/// A lattice or grid cell whose measured tensor was brought towards a target.
#[derive(Clone, Debug)]
pub struct CorrectedNetwork {
    /// Nodes, bonds with their k_n and k_t, and nodal term.
    pub network: Network,
    /// The moduli they come from.
    pub moduli: CorrectedModuli,
    /// The wanted tensor (Pa).
    pub target: Stiffness,
    /// The last element test.
    pub test: ElementTestResult,
    /// How it went.
    pub report: CorrectionReport,
}

impl CorrectedNetwork {
    /// The bonds' stiffnesses, in the lattice's order, with its μ.
    pub fn stiffness(&self, mu: f64) -> LatticeStiffness {
        LatticeStiffness {
            mu,
            normal: self.network.bonds.iter().map(|b| b.normal).collect(),
            tangential: self.network.bonds.iter().map(|b| b.tangential).collect(),
        }
    }
}

impl CorrectionReport {
    /// The component that is furthest from its target, as "C33 −12.3 %" of the largest component.
    fn worst_component(&self) -> String {
        let size = self.target.iter().flatten().fold(0.0f64, |a, c| a.max(c.abs()));
        let mut worst = (0, 0);
        for a in 0..6 {
            for b in a..6 {
                if self.remaining[a][b].abs() > self.remaining[worst.0][worst.1].abs() {
                    worst = (a, b);
                }
            }
        }
        let share = 100.0 * self.remaining[worst.0][worst.1] / size;
        format!("C{}{} by {share:+.3} % of the largest component", worst.0 + 1, worst.1 + 1)
    }

    /// What is left to say when the whole tensor is not met to the tolerance.
    pub(super) fn explained(&self, tolerance: f64, moduli: usize) -> Option<String> {
        let percent = 100.0 * self.tensor_error;
        let worst = self.worst_component();
        if self.converged && self.tensor_error <= tolerance {
            return None;
        }
        Some(match (self.converged, self.form) {
            (true, CorrectionForm::Elliptic) => format!(
                "C11, C33, C13 and C12 are met; what four moduli do not control leaves {percent:.3} %, most in {worst}"
            ),
            (true, _) => format!(
                "the Cauchy part is met; normal bonds do not control the rest, which leaves {percent:.3} %, most in {worst}"
            ),
            (false, _) if self.out_of_reach => format!(
                "out of reach of these bonds on this lattice: the nearest that was found is {percent:.3} % away, most in \
                 {worst}; {} of {moduli} moduli are at their floor",
                self.at_floor
            ),
            (false, _) => {
                format!("{} corrections were not enough; {percent:.3} % is left, most in {worst}", self.corrections)
            }
        })
    }
}
