//! The cross-anisotropy document's own element test: a finite strain, reached in motion, with servo-controlled lateral
//! stresses.
//!
//! Every step moves the cell by a small stretch and the nodes by their velocities, then asks the bonds for forces, with
//! finite kinematics (`operator::particles`: to second order in strain the incremental shear response of discrete element
//! codes); the mean stress is σ = (1/V) Σ f⊗l with the current branches and volume.
//!
//! The strain is prescribed as a logarithmic one and the constants are read from engineering strains e = exp(ε) − 1, as the
//! document's printed values are: its −1 % gives E = T/(−0.00995).
//!
//! Time is fictitious: a node's mass is its own 6×6 block of the stiffness, for which a step of 1 is always stable (no
//! frequency exceeds √2), and motion is damped viscously. Only the equilibrium at the end is a result.

use std::sync::Arc;

use nalgebra::{Matrix3, Matrix6};
use rayon::prelude::*;

use super::mechanism::Mechanism;
use super::static_test::Rotations;
use crate::operator::particles::Particles;
use crate::operator::{BondList, Kinematics, Network};
use crate::solver::particles::{Control, Servo, Verlet, affine_stiffness, mean_stress};
use crate::solver::{BlockJacobi, Watch};
use crate::tensor::{EngineeringConstants, PAIRS, Stiffness};
use crate::{Error, Result};

/// A dynamic element test; `DynamicTest::default()` is the document's: −1 % logarithmic strain, rotations free.
#[derive(Clone, Debug)]
pub struct DynamicTest {
    /// Logarithmic strain ε̂ along the axis, negative in compression; in the shear tests ε_ij = |ε̂| (γ = 2|ε̂|).
    pub strain: f64,
    /// Whether nodes rotate.
    pub rotations: Rotations,
    /// Steps in which the strain is applied.
    pub ramp: usize,
    /// Largest unbalanced force of a node at the end, relative to ‖Σ f⊗l‖/Σ ℓ, a mean force of the bonds; moments
    /// likewise, relative to that times their mean length.
    pub balance: f64,
    /// Largest lateral stress at the end, relative to the axial one (the document's t_r is 10⁻³).
    pub lateral: f64,
    /// Most steps of one test.
    pub most_steps: usize,
    /// Counts the steps of all six tests and can stop them.
    pub watch: Arc<Watch>,
}

impl Default for DynamicTest {
    fn default() -> Self {
        DynamicTest {
            strain: -0.01,
            rotations: Rotations::Free,
            ramp: 200,
            balance: 1e-5,
            lateral: 1e-6,
            most_steps: 20_000,
            watch: Arc::default(),
        }
    }
}

/// What a dynamic element test measured; secant values at its strain.
#[derive(Clone, Debug)]
pub struct DynamicTestResult {
    /// Logarithmic strain of the axial tests.
    pub strain: f64,
    /// Whether nodes rotated.
    pub rotations: Rotations,
    /// E_i = T_ii/e_ii, ν_ij = −e_jj/e_ii with engineering strains e, G_ij = T_ij/2ε_ij (S eqs eq-sim-Ex, eq-sim-Gij).
    pub engineering: EngineeringConstants,
    /// The orthotropic stiffness (Pa) of these constants: the inverse of the compliance whose couples ν_ij/E_i, ν_ji/E_j
    /// are averaged; `None` if it is singular.
    pub measured: Option<Stiffness>,
    /// Steps of the tests x, y, z, yz, zx, xy.
    pub steps: [usize; 6],
    /// Largest unbalanced force or moment left over, relative as [`DynamicTest::balance`] is.
    pub unbalanced: f64,
    /// Largest lateral stress left over, relative to the axial one.
    pub lateral: f64,
    /// Whether every test came to rest.
    pub converged: bool,
}

/// The end of one test.
struct Ending {
    strain: Matrix3<f64>,
    stress: Matrix3<f64>,
    steps: usize,
    unbalanced: f64,
    lateral: f64,
    converged: bool,
}

/// Share of its velocity that a node loses per step.
const DAMPING: f64 = 0.15;
/// Share of the lateral stresses that the servo takes away per step.
const SERVO: f64 = 0.1;
/// Strains beyond this are not small in any sense that the test is made for.
const LARGEST_STRAIN: f64 = 0.2;

impl DynamicTest {
    /// Run the six tests, in parallel; the result does not depend on the number of threads.
    ///
    /// # Errors
    /// A strain that is zero, not finite or beyond 20 %; no steps; a nodal term; what [`BondList::new`] refuses; nodes or parts that
    /// no bond joins; [`Error::Interrupted`] where the watch stops it.
    pub fn run(&self, network: &Network) -> Result<DynamicTestResult> {
        if !(self.strain.abs() > 0.0 && self.strain.abs() <= LARGEST_STRAIN) {
            return Err(Error::input(
                format!("the strain is {}", self.strain),
                format!("give a strain of at most {LARGEST_STRAIN} in absolute value, not zero"),
            ));
        }
        if self.ramp == 0 || self.most_steps <= self.ramp {
            return Err(Error::input(
                format!("{} steps of loading, {} in all", self.ramp, self.most_steps),
                "give at least one step of loading and more in all",
            ));
        }
        if network.nodal.is_some() {
            return Err(Error::input(
                "a dynamic test of a lattice with a nodal term: its finite strain is not defined",
                "use the static test",
            ));
        }
        if network.bonds.is_empty() {
            return Err(Error::mechanism("the lattice has no bonds", "give a larger contact radius"));
        }
        Mechanism::of_graph(network, self.rotations == Rotations::Free).refuse()?;
        let list = BondList::new(network)?;
        let mass = BlockJacobi::new(&list, self.rotations == Rotations::Free);
        let scale = affine_stiffness(network)?;
        let body = Particles::of_network(network, Kinematics::Finite)?;
        let endings: Result<Vec<Ending>> =
            (0..6).into_par_iter().map(|case| self.test(body.clone(), &mass, &scale, case)).collect();
        Ok(self.result(&endings?))
    }

    /// One test: load, hold and let come to rest.
    fn test(&self, mut body: Particles, mass: &BlockJacobi, scale: &Matrix6<f64>, case: usize) -> Result<Ending> {
        let unit = Verlet { step: 1.0, viscous: 0.0, local: 0.0 };
        let mut servo = Servo { controls: self.controls(case), gain: SERVO, fastest: f64::INFINITY, stiffness: *scale };
        let lengths: f64 = body.model().bonds.iter().map(|b| b.branch.norm()).sum();
        let length = lengths / body.model().bonds.len() as f64;
        let mut end = Ending {
            strain: Matrix3::zeros(),
            stress: Matrix3::zeros(),
            steps: 0,
            unbalanced: f64::INFINITY,
            lateral: f64::INFINITY,
            converged: false,
        };
        while end.steps < self.most_steps && !end.converged {
            self.watch.check("the dynamic element test")?;
            if end.steps == self.ramp {
                servo.controls = servo.controls.map(held);
            }
            let stretch = servo.gradient(&end.stress, unit.step)?;
            end.strain += stretch;
            // The stretch D takes l to exp(D) l, to second order.
            let virial = unit.move_on(&mut body, Some(&(stretch + 0.5 * stretch * stretch)))?.virial;
            end.stress = mean_stress(&body, &virial).unwrap_or_else(Matrix3::zeros);
            end.lateral = lateral(case, &end.stress);
            end.unbalanced = self.accelerate(mass, &mut body, virial.norm() / lengths, length);
            end.steps += 1;
            self.watch.count();
            end.converged = end.steps > self.ramp && end.unbalanced <= self.balance && end.lateral <= self.lateral;
        }
        Ok(end)
    }

    /// What drives the six components while loading: the prescribed strain in equal shares per step, no lateral stress in
    /// the axial tests and no other strain in the shear tests.
    fn controls(&self, case: usize) -> [Control; 6] {
        let share = 1.0 / self.ramp as f64;
        let mut controls = [Control::Rate(0.0); 6];
        if case < 3 {
            controls[..3].fill(Control::Stress(0.0));
            controls[case] = Control::Rate(share * self.strain);
        } else {
            controls[case] = Control::Rate(share * self.strain.abs());
        }
        controls
    }

    /// v ← (1 − c) v + M⁻¹ f; the largest unbalanced force relative to `force` (N), or moment relative to that times
    /// `length` (m).
    fn accelerate(&self, mass: &BlockJacobi, body: &mut Particles, force: f64, length: f64) -> f64 {
        let state = body.motion();
        let force = force.max(f64::MIN_POSITIVE);
        let mut worst = 0.0f64;
        for (node, load) in state.loads.iter().enumerate() {
            let size = |f: &[f64; 3]| f.iter().map(|x| x * x).sum::<f64>().sqrt();
            worst = worst.max(size(&load.force) / force);
            if self.rotations == Rotations::Free {
                worst = worst.max(size(&load.moment) / (force * length));
            }
            let [fx, fy, fz] = load.force;
            let [mx, my, mz] = load.moment;
            // Particles and bond lists number nodes along the same curve.
            let kick = mass.at(node, &[[fx], [fy], [fz], [mx], [my], [mz]]);
            for i in 0..3 {
                state.velocity[node][i] = (1.0 - DAMPING) * state.velocity[node][i] + kick[i][0];
                state.spin[node][i] = (1.0 - DAMPING) * state.spin[node][i] + kick[3 + i][0];
            }
        }
        worst
    }

    /// Secant constants from the six endings (S eqs eq-sim-Ex, eq-sim-Gij).
    fn result(&self, endings: &[Ending]) -> DynamicTestResult {
        let engineering = |i: usize, j: usize| endings[i].strain[(j, j)].exp_m1();
        let young = |i: usize| endings[i].stress[(i, i)] / engineering(i, i);
        let poisson = |i: usize, j: usize| -engineering(i, j) / engineering(i, i);
        let shear = |case: usize| {
            let (i, j) = PAIRS[case];
            let e = &endings[case];
            0.5 * (e.stress[(i, j)] + e.stress[(j, i)]) / (2.0 * e.strain[(i, j)])
        };
        let engineering = EngineeringConstants {
            e1: young(0),
            e2: young(1),
            e3: young(2),
            nu12: poisson(0, 1),
            nu21: poisson(1, 0),
            nu13: poisson(0, 2),
            nu31: poisson(2, 0),
            nu23: poisson(1, 2),
            nu32: poisson(2, 1),
            g23: shear(3),
            g13: shear(4),
            g12: shear(5),
        };
        let compliance = Matrix6::from_fn(|a, b| match (a == b, a < 3 && b < 3) {
            (true, true) => 1.0 / young(a),
            (true, false) => 1.0 / shear(a),
            (false, true) => -0.5 * (poisson(a, b) / young(a) + poisson(b, a) / young(b)),
            (false, false) => 0.0,
        });
        DynamicTestResult {
            strain: self.strain,
            rotations: self.rotations,
            engineering,
            measured: Stiffness::from_compliance_voigt(&compliance).ok(),
            steps: std::array::from_fn(|case| endings[case].steps),
            unbalanced: endings.iter().map(|e| e.unbalanced).fold(0.0, f64::max),
            lateral: endings.iter().map(|e| e.lateral).fold(0.0, f64::max),
            converged: endings.iter().all(|e| e.converged),
        }
    }
}

/// A component after loading: strains stay, stresses are still driven.
fn held(control: Control) -> Control {
    match control {
        Control::Rate(_) => Control::Rate(0.0),
        stress => stress,
    }
}

/// Largest lateral normal stress relative to the axial one; 0 for a shear test, whose strains are all prescribed.
fn lateral(case: usize, stress: &Matrix3<f64>) -> f64 {
    if case >= 3 {
        return 0.0;
    }
    let (p, q) = ((case + 1) % 3, (case + 2) % 3);
    stress[(p, p)].abs().max(stress[(q, q)].abs()) / stress[(case, case)].abs()
}
