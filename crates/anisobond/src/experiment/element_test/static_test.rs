//! The static element test: periodic homogenisation.
//!
//! Six unit macroscopic strains E; for each the displacements u and rotations θ of least energy; then
//! C_kl = (1/V) ∂²W/∂E_k ∂E_l, W the least energy.

use std::sync::Arc;

use nalgebra::{Matrix6, Vector3, Vector6};
use serde::Serialize;

use super::mechanism::Mechanism;
use crate::operator::{BondList, Field, Network};
use crate::solver::{BlockJacobi, SolverReport, Stopping, Watch, solve_bonds};
use crate::tensor::{EngineeringConstants, PAIRS, Stiffness, mandel_weight};
use crate::{Error, Result};

/// Whether nodes rotate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rotations {
    /// Every node rotates so that its moments balance (spheres).
    #[default]
    Free,
    /// No node rotates: θ = 0.
    Blocked,
}

/// What to do with a lattice whose nodes can move at no cost. Its stiffness is well defined all the same (the least
/// energy does not depend on free modes), but the lattice will not stand in a simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mechanisms {
    /// An error that names the nodes.
    #[default]
    Refuse,
    /// The result carries the report ([`ElementTestResult::mechanism`]).
    Report,
}

/// A static element test; `ElementTest::default()` is the usual one: rotations free, mechanisms refused.
#[derive(Clone, Debug)]
pub struct ElementTest {
    /// Whether nodes rotate.
    pub rotations: Rotations,
    /// What to do with a mechanism.
    pub mechanisms: Mechanisms,
    /// When the solver stops.
    pub stopping: Stopping,
    /// Whether the result carries the displacement and rotation fields.
    pub fields: bool,
    /// Whether the load cases are shared between the threads of the current pool; the result is the same to the last
    /// bit. Leave it off where many tests run at once.
    pub threads: bool,
    /// Counts the solver's iterations, on either of two threads where load cases are shared, and can stop them.
    pub watch: Arc<Watch>,
}

impl Default for ElementTest {
    fn default() -> Self {
        ElementTest {
            rotations: Rotations::Free,
            mechanisms: Mechanisms::Refuse,
            stopping: Stopping::default(),
            fields: false,
            threads: true,
            watch: Arc::default(),
        }
    }
}

/// What a static element test measured, with its evidence.
#[derive(Clone, Debug)]
pub struct ElementTestResult {
    /// The measured stiffness (Pa).
    pub measured: Stiffness,
    /// The sum over bonds at uniform strain (Pa): an upper bound.
    pub summed: Stiffness,
    /// Engineering constants of the measured stiffness, from its inverse; `None` if it is singular.
    pub engineering: Option<EngineeringConstants>,
    /// Whether nodes rotated.
    pub rotations: Rotations,
    /// Displacements and rotations, if asked for.
    pub fields: Option<Fields>,
    /// How the solves ended.
    pub solver: SolverReport,
    /// Independent checks of the answer.
    pub certificate: Certificate,
    /// What moves freely; [`Mechanism::is_none`] for a sound lattice.
    pub mechanism: Mechanism,
}

/// Checks of a measured stiffness; all but the last are zero for an exact solution.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Certificate {
    /// Largest unbalanced force of a node, relative to the mean force of a bond, of all load cases.
    pub force_balance: f64,
    /// Largest unbalanced moment of a node, relative to mean force × mean length of a bond; 0 with blocked rotations.
    pub moment_balance: f64,
    /// ‖C_σ − C_σᵀ‖/‖C‖ of the stiffness read from the mean stresses (1/V) Σ f⊗L instead of the energy.
    pub asymmetry: f64,
    /// ‖C_σ − C‖/‖C‖: energy against mean stress.
    pub energy_consistency: f64,
    /// Largest antisymmetric part of a mean stress, relative to its norm: moment balance as a whole.
    pub stress_asymmetry: f64,
    /// Smallest eigenvalue of (sum over bonds − C), relative to the sum's largest: not negative, for uniform strain is
    /// an upper bound.
    pub below_sum: f64,
}

/// Displacements and rotations under the six unit strains 11 22 33 23 13 12 (shear cases: engineering strain 1), node by
/// node as in the network; the mean displacement is zero, the uniform strain not included.
#[derive(Clone, Debug)]
pub struct Fields {
    /// Displacements (m) per load case.
    pub displacement: [Vec<Vector3<f64>>; 6],
    /// Rotation vectors (radians) per load case.
    pub rotation: [Vec<Vector3<f64>>; 6],
}

/// Six strains and two probes for zero-energy modes.
const LANES: usize = 8;

/// A probe's displacement that is left over by more than this share moves freely.
const FREE: f64 = 1e-4;

impl ElementTest {
    /// Test a network.
    ///
    /// # Errors
    /// What [`BondList::new`] refuses; a network without bonds; a mechanism, or displacements of negative energy, unless
    /// only to be reported; [`Error::Interrupted`] where the watch stops it.
    pub fn run(&self, network: &Network) -> Result<ElementTestResult> {
        self.watch.check("the element test")?;
        let mut mechanism = self.mechanism_of_graph(network)?;
        let list = BondList::new(network)?;
        let preconditioner = BlockJacobi::new(&list, self.rotations == Rotations::Free);
        let (x, solver) = self.solve(network, &list, &preconditioner);
        if !solver.converged() {
            self.watch.check("the element test")?;
        }
        let field = strain_lanes(&x);
        if solver.negative_curvature() && self.mechanisms == Mechanisms::Refuse {
            return Err(Error::mechanism(
                "the lattice is not stable: there are displacements that lower its energy",
                "use a nodal term with no negative eigenvalue, stiffer bonds, or ask for such lattices to be reported only",
            ));
        }
        if solver.converged() {
            self.free_modes(network, &list, &x, &mut mechanism)?;
        }
        let (measured, summed, certificate) = self.measure(&list, &field);
        if self.mechanisms == Mechanisms::Refuse && solver.converged() {
            refuse_free_strain(&measured)?;
        }
        Ok(ElementTestResult {
            measured,
            summed,
            engineering: measured.engineering_constants(),
            rotations: self.rotations,
            fields: self.fields.then(|| fields(&list, &field)),
            solver,
            certificate,
            mechanism,
        })
    }

    /// What the bonds' graph alone says, before any solve.
    fn mechanism_of_graph(&self, network: &Network) -> Result<Mechanism> {
        if network.bonds.is_empty() {
            return Err(Error::mechanism("the lattice has no bonds", "give a larger contact radius"));
        }
        let mechanism = Mechanism::of_graph(network, self.rotations == Rotations::Free);
        if self.mechanisms == Mechanisms::Refuse {
            mechanism.refuse()?;
        }
        Ok(mechanism)
    }

    /// All lanes, together or shared between threads: lanes do not interact, so the bits are the same.
    fn solve(&self, network: &Network, list: &BondList, m: &BlockJacobi) -> (Field<LANES>, SolverReport) {
        if !self.threads || rayon::current_num_threads() == 1 {
            return self.solve_lanes::<LANES>(network, list, m, 0);
        }
        let ((left, a), (right, b)) =
            rayon::join(|| self.solve_lanes::<4>(network, list, m, 0), || self.solve_lanes::<4>(network, list, m, 4));
        let joined = left.iter().zip(&right).map(|(left, right)| {
            std::array::from_fn(|i| std::array::from_fn(|l| if l < 4 { left[i][l] } else { right[i][l - 4] }))
        });
        (joined.collect(), a.and(b))
    }

    /// Lanes first … first + L: K x = −(forces of unit strain), or K x = K x₀ for the probes.
    fn solve_lanes<const L: usize>(
        &self,
        network: &Network,
        list: &BondList,
        m: &BlockJacobi,
        first: usize,
    ) -> (Field<L>, SolverReport) {
        let mut b = list.zeros::<L>();
        let mut forces = list.zeros::<L>();
        list.apply(&self.probes(network, list, first), &mut b);
        list.apply_strain(&std::array::from_fn(|l| unit_strain(first + l)), &mut forces);
        for (b, f) in b.iter_mut().flatten().flatten().zip(forces.iter().flatten().flatten()) {
            *b -= f;
        }
        solve_bonds(list, m, b, &[rounding(list, m); L], (&self.stopping, &self.watch.look()))
    }

    /// Random displacements and rotations in the probes' lanes, zero in the strains'. They depend on the node's number.
    fn probes<const L: usize>(&self, network: &Network, list: &BondList, first: usize) -> Field<L> {
        let length = mean_length(network);
        let mut x = list.zeros::<L>();
        for node in 0..network.nodes.len() {
            let x = &mut x[list.place(node)];
            for i in 0..if self.rotations == Rotations::Free { 6 } else { 3 } {
                for l in 0..L {
                    if first + l >= 6 {
                        x[i][l] = noise(((first + l) * 6 + i) as u64, node as u64) * if i < 3 { length } else { 1.0 };
                    }
                }
            }
        }
        x
    }

    /// What is left of a probe after its solve costs no energy: x₀ − x is in the null space of K. Translations apart, its
    /// displacements are mechanisms and its rotations spins.
    fn free_modes(
        &self,
        network: &Network,
        list: &BondList,
        x: &Field<LANES>,
        mechanism: &mut Mechanism,
    ) -> Result<()> {
        let probes = self.probes::<LANES>(network, list, 0);
        let length = mean_length(network);
        let mut held = vec![true; network.nodes.len()];
        for &node in mechanism.floaters.iter().chain(&mechanism.apart) {
            held[node] = false;
        }
        let (mut moves, mut spins) = (vec![false; held.len()], vec![false; held.len()]);
        for lane in 6..LANES {
            let left = |node: usize, i: usize| {
                let place = list.place(node);
                probes[place][i][lane] - x[place][i][lane]
            };
            for i in 0..6 {
                let bonded = || (0..held.len()).filter(|&node| held[node]);
                let translation = if i < 3 { median(bonded().map(|node| left(node, i)).collect()) } else { 0.0 };
                for node in bonded() {
                    if i < 3 {
                        moves[node] |= (left(node, i) - translation).abs() > FREE * length;
                    } else {
                        spins[node] |= left(node, i).abs() > FREE;
                    }
                }
            }
        }
        let numbers = |free: &dyn Fn(usize) -> bool| (0..held.len()).filter(|&node| free(node)).collect();
        mechanism.loose = numbers(&|node| moves[node]);
        mechanism.spinning = numbers(&|node| spins[node] && !moves[node]);
        if self.mechanisms == Mechanisms::Refuse { mechanism.refuse() } else { Ok(()) }
    }

    /// C from the energy, and everything that can be checked of it.
    fn measure(&self, list: &BondList, x: &Field<6>) -> (Stiffness, Stiffness, Certificate) {
        let strains: [Vector6<f64>; 6] = std::array::from_fn(unit_strain);
        let affine = list.measure(&strains, &list.zeros());
        let relaxed = list.measure(&strains, x);
        let matrix = |energy: &[[f64; 6]; 6]| Matrix6::from_fn(|a, b| 0.5 * (energy[a][b] + energy[b][a]));
        let (c, sum) = (matrix(&relaxed.energy), matrix(&affine.energy));
        let from_stress = Matrix6::from_fn(|a, case| {
            let (i, j) = PAIRS[a];
            0.5 * (relaxed.stress[3 * i + j][case] + relaxed.stress[3 * j + i][case]) * mandel_weight(a)
        });
        let norm = c.norm().max(f64::MIN_POSITIVE);
        let (force_balance, moment_balance) = self.balance(list, &strains, x, &relaxed.mean_force, relaxed.mean_length);
        let certificate = Certificate {
            force_balance,
            moment_balance,
            asymmetry: (from_stress - from_stress.transpose()).norm() / norm,
            energy_consistency: (from_stress - c).norm() / norm,
            stress_asymmetry: if self.rotations == Rotations::Free { stress_asymmetry(&relaxed.stress) } else { 0.0 },
            below_sum: (sum - c).symmetric_eigenvalues().min() / sum.symmetric_eigenvalues().max(),
        };
        (Stiffness::from_mandel(c), Stiffness::from_mandel(sum), certificate)
    }

    /// Largest unbalanced force and moment of a node, relative to what a bond carries.
    fn balance(
        &self,
        list: &BondList,
        strains: &[Vector6<f64>; 6],
        x: &Field<6>,
        mean_force: &[f64; 6],
        length: f64,
    ) -> (f64, f64) {
        let mut gradient = list.zeros::<6>();
        let mut forces = list.zeros::<6>();
        list.apply(x, &mut gradient);
        list.apply_strain(strains, &mut forces);
        let (mut force, mut moment) = (0.0f64, 0.0f64);
        for (g, f) in gradient.iter().zip(&forces) {
            for case in 0..6 {
                let left = |i: usize| (g[i][case] + f[i][case]).powi(2);
                let scale = mean_force[case].max(f64::MIN_POSITIVE);
                force = force.max((left(0) + left(1) + left(2)).sqrt() / scale);
                moment = moment.max((left(3) + left(4) + left(5)).sqrt() / (scale * length));
            }
        }
        (force, if self.rotations == Rotations::Free { moment } else { 0.0 })
    }
}

/// A Kelvin modulus below this share of the largest is no stiffness.
const NO_STIFFNESS: f64 = 1e-10;

/// Nodes may all be held and the lattice still yield as a whole: a strain that costs no energy.
fn refuse_free_strain(measured: &Stiffness) -> Result<()> {
    let (moduli, strains) = measured.eigen();
    if moduli[0] > NO_STIFFNESS * moduli[5] {
        return Ok(());
    }
    let strain = strains.column(0);
    let strain: Vec<String> = (0..6).map(|a| format!("{:.3}", strain[a] / mandel_weight(a) + 0.0)).collect();
    Err(Error::mechanism(
        format!(
            "the lattice is a mechanism as a whole: the strain (11 22 33 23 13 12) = ({}) costs no energy",
            strain.join(" ")
        ),
        "give a larger contact radius or bonds with tangential stiffness",
    ))
}

/// Loads below this share of what the bonds of the nodes could carry are the rounding of forces that balance, and of the moduli
/// that make them balance. What solving for them could change of the stiffness is of the order of its square.
const ROUNDING: f64 = 1e-11;

/// r·M⁻¹r of loads that are rounding. On a perfect grid the forces of uniform strain balance at every node: solving for what
/// is left of them would follow the noise of a singular matrix.
fn rounding(list: &BondList, m: &BlockJacobi) -> f64 {
    let carried = list.carried().into_iter().enumerate().map(|(node, [force, moment])| {
        let load = [[force], [force], [force], [moment], [moment], [moment]];
        m.at(node, &load).iter().zip(&load).map(|(z, r)| z[0] * r[0]).sum::<f64>()
    });
    ROUNDING.powi(2) * carried.sum::<f64>()
}

/// The unit strain of a case in Kelvin-Mandel coordinates; zero beyond the sixth (probes).
fn unit_strain(case: usize) -> Vector6<f64> {
    Vector6::from_fn(|a, _| if a == case { 1.0 } else { 0.0 })
}

/// The six strains' lanes.
fn strain_lanes(x: &Field<LANES>) -> Field<6> {
    x.iter().map(|node| node.map(|row| std::array::from_fn(|l| row[l]))).collect()
}

/// Mean length of a bond (m).
fn mean_length(network: &Network) -> f64 {
    network.bonds.iter().map(|b| b.branch.norm()).sum::<f64>() / network.bonds.len() as f64
}

/// A repeatable number in (−1, 1) (splitmix64).
fn noise(stream: u64, index: u64) -> f64 {
    let mut z = (index << 8 | stream).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// The middle value: the translation that most nodes share.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Largest ‖antisymmetric part‖/‖σ‖ of the mean stresses.
fn stress_asymmetry(stress: &[[f64; 6]; 9]) -> f64 {
    let of_case = |case: usize| {
        let norm: f64 = stress.iter().map(|s| s[case].powi(2)).sum();
        let skew: f64 = [(1, 3), (2, 6), (5, 7)].map(|(p, q)| (stress[p][case] - stress[q][case]).powi(2)).iter().sum();
        (0.5 * skew / norm.max(f64::MIN_POSITIVE)).sqrt()
    };
    (0..6).map(of_case).fold(0.0, f64::max)
}

/// The fields in the network's order, shear cases scaled to engineering strain 1, the mean displacement taken out.
fn fields(list: &BondList, x: &Field<6>) -> Fields {
    let column = |case: usize, first: usize| -> Vec<Vector3<f64>> {
        // Unit Kelvin-Mandel shear is ε_ij = 1/√2; engineering strain 1 is ε_ij = ½.
        let scale = 1.0 / mandel_weight(case);
        (0..list.nodes())
            .map(|node| {
                let x = &x[list.place(node)];
                scale * Vector3::new(x[first][case], x[first + 1][case], x[first + 2][case])
            })
            .collect()
    };
    let displacement = std::array::from_fn(|case| {
        let u = column(case, 0);
        let mean = u.iter().sum::<Vector3<f64>>() / u.len() as f64;
        u.into_iter().map(|u| u - mean).collect()
    });
    Fields { displacement, rotation: std::array::from_fn(|case| column(case, 3)) }
}
