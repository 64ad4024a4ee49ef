//! The cross-anisotropy document's own element test: a finite strain, reached in motion, with servo-controlled lateral
//! stresses.
//!
//! Every step moves the cell by a small stretch D and the nodes by their velocities, then asks the bonds for forces:
//!
//! - normal force k_n (ℓ − ℓ₀) n on the current direction n;
//! - tangential force f_t, which turns with the bond and grows by k_t Δ_t, Δ = dl − ½(dθ_A + dθ_B)×l (incremental, as in
//!   discrete element codes; the contact point is the middle of the bond);
//! - mean stress σ = (1/V) Σ f⊗l with the current branches and volume.
//!
//! The strain is prescribed as a logarithmic one and the constants are read from engineering strains e = exp(ε) − 1, as the
//! document's printed values are: its −1 % gives E = T/(−0.00995).
//!
//! Time is fictitious: a node's mass is its own 6×6 block of the stiffness, for which a step of 1 is always stable (no
//! frequency exceeds √2), and motion is damped viscously. Only the equilibrium at the end is a result.

use nalgebra::{Matrix2, Matrix3, Matrix6, Vector2, Vector3};
use rayon::prelude::*;

use super::mechanism::Mechanism;
use super::static_test::Rotations;
use crate::operator::{BondList, Network, NodeField};
use crate::solver::BlockJacobi;
use crate::tensor::{EngineeringConstants, PAIRS, Stiffness};
use crate::{Error, Result};

/// A dynamic element test; `DynamicTest::default()` is the document's: −1 % logarithmic strain, rotations free.
#[derive(Clone, Copy, Debug)]
pub struct DynamicTest {
    /// Logarithmic strain ε̂ along the axis, negative in compression; in the shear tests ε_ij = |ε̂| (γ = 2|ε̂|).
    pub strain: f64,
    /// Whether nodes rotate.
    pub rotations: Rotations,
    /// Steps in which the strain is applied.
    pub ramp: usize,
    /// Largest unbalanced force of a node at the end, relative to the mean force of a bond; moments likewise.
    pub balance: f64,
    /// Largest lateral stress at the end, relative to the axial one (the document's t_r is 10⁻³).
    pub lateral: f64,
    /// Most steps of one test.
    pub most_steps: usize,
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
    /// Largest unbalanced force or moment left over, relative to the mean of a bond.
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
    /// no bond joins.
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
            return Err(Error::input("the lattice has no bonds", "give a larger contact radius"));
        }
        Mechanism::of_graph(network, self.rotations == Rotations::Free).refuse()?;
        let list = BondList::new(network)?;
        let mass = BlockJacobi::new(&list, self.rotations == Rotations::Free);
        let scale = affine_stiffness(&list);
        let endings: Vec<Ending> =
            (0..6).into_par_iter().map(|case| self.test(network, &list, &mass, &scale, case)).collect();
        Ok(self.result(&endings))
    }

    /// One test: load, hold and let come to rest.
    fn test(
        &self,
        network: &Network,
        list: &BondList,
        mass: &BlockJacobi,
        scale: &Matrix6<f64>,
        case: usize,
    ) -> Ending {
        let mut bonds: Vec<Moving> = network.bonds.iter().map(|b| Moving::new(b, list)).collect();
        let mut velocity = list.zeros::<1>();
        let mut force = list.zeros::<1>();
        let mut end = Ending {
            strain: Matrix3::zeros(),
            stress: Matrix3::zeros(),
            steps: 0,
            unbalanced: f64::INFINITY,
            lateral: f64::INFINITY,
            converged: false,
        };
        while end.steps < self.most_steps && !end.converged {
            let stretch = self.stretch(case, end.steps, &end.stress, scale);
            end.strain += stretch;
            let volume = network.volume * end.strain.trace().exp();
            let mean = move_bonds(&mut bonds, &stretch, &velocity, &mut force);
            end.stress = mean.virial / volume;
            end.unbalanced = self.unbalanced(&force, &mean);
            end.lateral = lateral(case, &end.stress);
            accelerate(mass, &force, &mut velocity);
            end.steps += 1;
            end.converged = end.steps > self.ramp && end.unbalanced <= self.balance && end.lateral <= self.lateral;
        }
        end
    }

    /// The cell's stretch D of one step: the prescribed share while loading, and the servo's answer to lateral stresses,
    /// D_lateral = −g C_ll⁻¹ σ_l with the lateral block of the affine stiffness.
    fn stretch(&self, case: usize, step: usize, stress: &Matrix3<f64>, scale: &Matrix6<f64>) -> Matrix3<f64> {
        let share = if step < self.ramp { 1.0 / self.ramp as f64 } else { 0.0 };
        let (i, j) = PAIRS[case];
        let mut stretch = Matrix3::zeros();
        if case >= 3 {
            stretch[(i, j)] = share * self.strain.abs();
            stretch[(j, i)] = stretch[(i, j)];
            return stretch;
        }
        stretch[(i, i)] = share * self.strain;
        let (p, q) = ((i + 1) % 3, (i + 2) % 3);
        let block = Matrix2::new(scale[(p, p)], scale[(p, q)], scale[(q, p)], scale[(q, q)]);
        if let Some(compliance) = block.try_inverse() {
            let answer = -SERVO * compliance * Vector2::new(stress[(p, p)], stress[(q, q)]);
            stretch[(p, p)] = answer.x;
            stretch[(q, q)] = answer.y;
        }
        stretch
    }

    /// Largest unbalanced force (moment) of a node relative to the mean force (× mean length) of a bond.
    fn unbalanced(&self, force: &[NodeField<1>], mean: &Means) -> f64 {
        let mut worst = 0.0f64;
        for f in force {
            let size = |i: usize| (f[i][0].powi(2) + f[i + 1][0].powi(2) + f[i + 2][0].powi(2)).sqrt();
            worst = worst.max(size(0) / mean.force);
            if self.rotations == Rotations::Free {
                worst = worst.max(size(3) / (mean.force * mean.length));
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

/// A bond on its way.
struct Moving {
    a: u32,
    b: u32,
    /// Current branch l (m).
    branch: Vector3<f64>,
    /// Length at rest ℓ₀ (m).
    rest: f64,
    /// k_n (N/m).
    normal: f64,
    /// k_t (N/m).
    tangential: f64,
    /// Tangential force f_t (N), on A from B.
    shear: Vector3<f64>,
}

/// What the bonds carry on average.
struct Means {
    /// Σ f⊗l (J).
    virial: Matrix3<f64>,
    /// Mean |f| (N).
    force: f64,
    /// Mean ℓ (m).
    length: f64,
}

impl Moving {
    fn new(bond: &crate::operator::StiffBond, list: &BondList) -> Self {
        Moving {
            a: list.place(bond.a as usize) as u32,
            b: list.place(bond.b as usize) as u32,
            branch: bond.branch,
            rest: bond.branch.norm(),
            normal: bond.normal,
            tangential: bond.tangential,
            shear: Vector3::zeros(),
        }
    }

    /// Move by the cell's stretch and the ends' velocities; the force on A from B afterwards.
    fn step(&mut self, stretch: &Matrix3<f64>, va: &NodeField<1>, vb: &NodeField<1>) -> Vector3<f64> {
        let part = |v: &NodeField<1>, i: usize| Vector3::new(v[i][0], v[i + 1][0], v[i + 2][0]);
        let old = self.branch;
        // The cell's stretch D takes l to exp(D) l, to second order.
        let stretched = stretch * (old + 0.5 * (stretch * old));
        let change = stretched + part(vb, 0) - part(va, 0);
        let spin = 0.5 * (part(va, 3) + part(vb, 3));
        self.branch = old + change;
        let middle = old + 0.5 * change;
        let square = middle.norm_squared();
        let slip = change - spin.cross(&middle);
        let slip = slip - middle * (middle.dot(&slip) / square);
        // f_t turns with the bond, and about it with its ends.
        let turn = middle.cross(&change) / square + middle * (middle.dot(&spin) / square);
        let length = self.branch.norm();
        let n = self.branch / length;
        let shear = self.shear + turn.cross(&self.shear) + self.tangential * slip;
        self.shear = shear - n * n.dot(&shear);
        self.normal * (length - self.rest) * n + self.shear
    }
}

/// Move every bond and sum forces and moments on the nodes.
fn move_bonds(
    bonds: &mut [Moving],
    stretch: &Matrix3<f64>,
    velocity: &[NodeField<1>],
    force: &mut [NodeField<1>],
) -> Means {
    force.fill([[0.0]; 6]);
    let mut sum = Means { virial: Matrix3::zeros(), force: 0.0, length: 0.0 };
    for bond in bonds.iter_mut() {
        let (a, b) = (bond.a as usize, bond.b as usize);
        let f = bond.step(stretch, &velocity[a], &velocity[b]);
        let moment = 0.5 * bond.branch.cross(&f);
        for i in 0..3 {
            force[a][i][0] += f[i];
            force[b][i][0] -= f[i];
            force[a][3 + i][0] += moment[i];
            force[b][3 + i][0] += moment[i];
        }
        sum.virial += f * bond.branch.transpose();
        sum.force += f.norm();
        sum.length += bond.branch.norm();
    }
    let count = bonds.len() as f64;
    Means { virial: sum.virial, force: (sum.force / count).max(f64::MIN_POSITIVE), length: sum.length / count }
}

/// v ← (1 − c) v + M⁻¹ f.
fn accelerate(mass: &BlockJacobi, force: &[NodeField<1>], velocity: &mut [NodeField<1>]) {
    for (node, (f, v)) in force.iter().zip(velocity).enumerate() {
        let kick = mass.apply(node, f);
        for i in 0..6 {
            v[i][0] = (1.0 - DAMPING) * v[i][0] + kick[i][0];
        }
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

/// The sum over bonds at uniform strain (Pa), Kelvin-Mandel: the servo's guess of the stiffness.
fn affine_stiffness(list: &BondList) -> Matrix6<f64> {
    let strains = std::array::from_fn(|case| nalgebra::Vector6::from_fn(|a, _| if a == case { 1.0 } else { 0.0 }));
    let energy = list.measure(&strains, &list.zeros::<6>()).energy;
    Matrix6::from_fn(|a, b| energy[a][b])
}
