//! Bonds with tangential stiffness: bpm/rotational without bending and torsion has the forces
//! k_n Δ·n n + k_t (Δ − n n·Δ), Δ = u_B − u_A − ½(θ_A + θ_B)×L, at small rotations.

use std::fmt::Write;

use super::{ExportFile, connections, head, strains};
use crate::export::BondedCell;

/// Strain of the test. Central differences leave an error of its square; angles below it are rounding, for the engine has them
/// from cosines.
const STRAIN: f64 = 5e-4;

/// Force, or moment by length, that may be left on a node, relative to the force of a mean bond at the strain.
const BALANCE: f64 = 1e-5;

/// Most steps to come to rest.
const STEPS: usize = 1500;

/// Step (s): masses are such that the fastest motion takes about four.
const STEP: f64 = 0.5;

/// Damping, as a share of the masses, per second.
const DAMPING: f64 = 0.3;

/// The files `bonds.data`, `bonds.coeffs` and `in.element_test`.
pub(super) fn files(cell: &BondedCell) -> Vec<ExportFile> {
    let (kinds, of) = cell.kinds(|b| [b.normal, b.tangential]);
    let mut coefficients =
        String::from("# k_n and k_t (N/m); no bending, no torsion, no breaking, no damping of its own\n");
    for (n, [normal, tangential]) in kinds.iter().enumerate() {
        let _ = writeln!(
            coefficients,
            "bond_coeff {} {normal:?} {tangential:?} 0 0 1e300 1e300 1e300 1e300 0 0 0 0",
            n + 1
        );
    }
    let nodes = Nodes::of(cell);
    vec![
        ("bonds.data".into(), (data(cell, kinds.len(), &nodes) + &connections(cell, &of)).into_bytes()),
        ("bonds.coeffs".into(), coefficients.into_bytes()),
        ("in.element_test".into(), input(cell, &nodes).into_bytes()),
    ]
}

/// Masses and moments of inertia that let every node move and turn at the same pace: only the state at rest counts.
struct Nodes {
    /// Σ max(k_n, k_t), at 1 s² (kg).
    mass: Vec<f64>,
    /// Σ ¼ k_t ℓ², at 1 s² (kg m²).
    inertia: Vec<f64>,
}

impl Nodes {
    fn of(cell: &BondedCell) -> Self {
        let mut nodes = Nodes { mass: vec![0.0; cell.nodes.len()], inertia: vec![0.0; cell.nodes.len()] };
        for bond in &cell.bonds {
            for node in [bond.a as usize, bond.b as usize] {
                nodes.mass[node] += bond.normal.max(bond.tangential);
                nodes.inertia[node] += 0.25 * bond.tangential * bond.branch.norm_squared();
            }
        }
        // Nodes that nothing moves, or turns, have any mass, or inertia.
        let (mass, length) = (mean(&nodes.mass), cell.longest());
        nodes.mass.iter_mut().filter(|m| **m == 0.0).for_each(|m| *m = mass);
        nodes.inertia.iter_mut().filter(|i| **i == 0.0).for_each(|i| *i = mass * length * length);
        nodes
    }

    /// Radius of the sphere of a node's mass and inertia ⅖ m r² (m).
    fn radius(&self, node: usize) -> f64 {
        (self.inertia[node] / (0.4 * self.mass[node])).sqrt()
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The data file but for its bonds: atoms with diameter and density.
fn data(cell: &BondedCell, types: usize, nodes: &Nodes) -> String {
    let mut text = head(cell, types) + "Atoms # bpm/sphere\n\n";
    for (n, x) in cell.nodes.iter().enumerate() {
        let radius = nodes.radius(n);
        let density = nodes.mass[n] / (4.0 / 3.0 * std::f64::consts::PI * radius.powi(3));
        let _ = writeln!(text, "{} 1 1 {:?} {density:?} {:?} {:?} {:?}", n + 1, 2.0 * radius, x.x, x.y, x.z);
    }
    text
}

fn input(cell: &BondedCell, nodes: &Nodes) -> String {
    let longest = cell.longest();
    let lengths: Vec<f64> = cell.bonds.iter().map(|b| b.branch.norm()).collect();
    let forces: Vec<f64> = cell.bonds.iter().zip(&lengths).map(|(b, l)| b.normal * l).collect();
    let reach = 1.65 * longest;
    let text = format!(
        "# Element test of the bonds in bonds.data: six strains of ±{STRAIN:e}, nodes at rest, stiffness in Pa (Voigt).\n\
         # lmp -in in.element_test, or mpirun -n 2 lmp -in in.element_test; measured.csv must be expected.csv. Made for LAMMPS\n\
         # of 2025 with its packages BPM and EXTRA-FIX. Masses are such that every node moves at the same pace.\n\
         units           si\n\
         atom_style      bpm/sphere\n\
         boundary        p p p\n\
         newton          on off\n\
         special_bonds   lj/coul 1 1 1\n\
         pair_style      zero {longest:?} nocoeff\n\
         read_data       bonds.data extra/special/per/atom 1000\n\
         bond_style      bpm/rotational break no smooth no\n\
         include         bonds.coeffs\n\
         pair_coeff      * *\n\
         neighbor        {:?} bin\n\
         comm_modify     vel yes cutoff {reach:?}\n\
         compute         p all pressure NULL virial\n\
         compute         moment all property/atom tqx tqy tqz\n\
         variable        force atom sqrt(fx^2+fy^2+fz^2)\n\
         variable        moment atom sqrt(c_moment[1]^2+c_moment[2]^2+c_moment[3]^2)/{:?}\n\
         compute         left all reduce max v_force v_moment\n\
         variable        left equal c_left[1]+c_left[2]\n\
         fix             motion all nve/bpm/sphere\n\
         fix             damping all viscous {:?}\n\
         fix             turning all viscous/sphere {:?}\n\
         timestep        {STEP:?}\n\
         thermo          500\n\
         thermo_style    custom step v_left c_p[1] c_p[2] c_p[3] c_p[4] c_p[5] c_p[6]\n\
         # Bonds take what they are now as their rest.\n\
         run             0\n\
         fix             rest all halt 20 v_left < {:e} error continue\n\n",
        0.1 * longest,
        mean(&lengths),
        DAMPING * mean(&nodes.mass),
        DAMPING * mean(&nodes.inertia),
        BALANCE * STRAIN * mean(&forces),
    );
    // The compute's order is xx yy zz xy xz yz.
    let pressures = [1, 2, 3, 6, 5, 4].map(|k| format!("c_p[{k}]"));
    text + &strains(cell, STRAIN, &format!("run             {STEPS}"), &pressures)
}
