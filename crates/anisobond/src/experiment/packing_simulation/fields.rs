//! What is read from spheres: probes and fields.

use nalgebra::{Matrix3, Vector3};

use super::{PackingProblem, PackingSimulation};
use crate::experiment::field::{FieldName, Quantity, mean_components, principal, symmetric, von_mises};
use crate::experiment::problem::Probe;
use crate::operator::particles::Carried;
use crate::operator::{GradientFit, Kinematics, LocalState, StiffBond};

impl PackingSimulation {
    /// The columns of a probe.
    pub fn measure(&self, probe: &Probe) -> Vec<f64> {
        let count = probe.nodes.len().max(1) as f64;
        let nodes = || probe.nodes.iter().map(|&node| node as usize);
        let sum = |value: &dyn Fn(usize) -> Vector3<f64>| nodes().fold(Vector3::zeros(), |sum, node| sum + value(node));
        match probe.quantity {
            Quantity::Displacement => (sum(&|s| self.particles().displacement(s)) / count).iter().copied().collect(),
            Quantity::Velocity if !self.is_motion() => vec![0.0; 3],
            Quantity::Velocity => (sum(&|s| self.particles().velocity(s)) / count).iter().copied().collect(),
            Quantity::Reaction => (-sum(&|s| self.particles().force(s))).iter().copied().collect(),
            Quantity::Damage => {
                let damage = self.particles().damage();
                vec![nodes().map(|s| damage[s]).sum::<f64>() / count]
            }
            Quantity::Strain => self.mean_state(&probe.nodes, |state| state.strain),
            Quantity::Stress => self.mean_state(&probe.nodes, |state| state.stress),
        }
    }

    /// The mean of strains or stresses over spheres, components 11 22 33 23 13 12.
    fn mean_state(&self, spheres: &[u32], tensor: impl Fn(&LocalState) -> Matrix3<f64>) -> Vec<f64> {
        let mut wanted = vec![false; self.particles().len()];
        spheres.iter().for_each(|&s| wanted[s as usize] = true);
        let states = self.local_states(|s| wanted[s]);
        mean_components(spheres.iter().filter_map(|&s| states[s as usize]).map(|state| tensor(&state)))
    }

    /// The largest damage of a sphere (–).
    pub fn largest_damage(&self) -> f64 {
        self.particles().damage().into_iter().fold(0.0, f64::max)
    }

    /// A field: numbers per sphere, and the numbers of all spheres one after another. Virial (Pa) and energy density
    /// (J/m³) are those of the bonds, half of each for either end, over the volume of rock that a sphere stands for.
    pub fn field(&self, name: FieldName) -> (usize, Vec<f32>) {
        let n = self.particles().len();
        match name {
            FieldName::Displacement => (3, vectors(&self.particles().displacements())),
            FieldName::Velocity if !self.is_motion() => (3, vec![0.0; 3 * n]),
            FieldName::Velocity => (3, vectors(&self.particles().velocities())),
            FieldName::Force => (3, vectors(&self.particles().forces())),
            FieldName::Damage => (1, self.particles().damage().into_iter().map(|d| d as f32).collect()),
            FieldName::Region => (1, self.problem.region.iter().map(|&r| f32::from(r) + 1.0).collect()),
            FieldName::Energy => {
                let mut energy = vec![0.0; n];
                self.each_bond(|end, carried| energy[end] += 0.5 * carried.energy / self.problem.volumes[end]);
                (1, energy.into_iter().map(|e| e as f32).collect())
            }
            FieldName::Virial => {
                let mut stress = vec![Matrix3::zeros(); n];
                self.each_bond(|end, carried| stress[end] += carried.virial * (0.5 / self.problem.volumes[end]));
                (6, stress.iter().flat_map(symmetric).collect())
            }
            FieldName::Strain => (6, self.of_states(|s| symmetric(&s.strain))),
            FieldName::Stress => (6, self.of_states(|s| symmetric(&s.stress))),
            FieldName::VonMises => (1, self.of_states(|s| [von_mises(&s.stress)])),
            FieldName::PrincipalStress => (3, self.of_states(|s| principal(&s.stress))),
            FieldName::Stretch => (1, self.largest_stretches()),
            FieldName::PlasticStretch => {
                (1, self.particles().plastic_stretch().into_iter().map(|s| s as f32).collect())
            }
        }
    }

    /// Numbers of the strain and stress at every sphere.
    fn of_states<const N: usize>(&self, numbers: impl Fn(&LocalState) -> [f32; N]) -> Vec<f32> {
        let states = self.local_states(|_| true);
        states.iter().flat_map(|state| state.as_ref().map_or([0.0; N], &numbers)).collect()
    }

    /// Strain and stress at the spheres that are wanted, fitted over the spheres that whole bonds join to them in their own
    /// region, or where those do not fill space in any; of the stiffness that the region's lattice has.
    fn local_states(&self, wanted: impl Fn(usize) -> bool) -> Vec<Option<LocalState>> {
        let (n, region) = (self.particles().len(), &self.problem.region);
        let same = |bond: &StiffBond| region[bond.a as usize] == region[bond.b as usize];
        let mut standing = vec![1.0; n];
        self.whole_bonds(|bond, _| {
            if same(bond) {
                standing[bond.a as usize] += 1.0;
                standing[bond.b as usize] += 1.0;
            }
        });
        let alone = |s: usize| {
            let mut fit = GradientFit::default();
            fit.add(standing[s], &Vector3::zeros(), &Vector3::zeros());
            fit
        };
        let mut own: Vec<GradientFit> = (0..n).map(alone).collect();
        let mut all = own.clone();
        self.whole_bonds(|bond, moved| {
            let (a, b) = (bond.a as usize, bond.b as usize);
            for (end, other, sign) in [(a, b, 1.0), (b, a, -1.0)] {
                if wanted(end) {
                    let (xi, u) = (sign * bond.branch, sign * moved);
                    all[end].add(standing[other], &xi, &u);
                    if same(bond) {
                        own[end].add(standing[other], &xi, &u);
                    }
                }
            }
        });
        let state = |s: usize| {
            let gradient = own[s].gradient();
            let gradient = if gradient.is_whole() { gradient } else { all[s].gradient() };
            let lattice = &self.problem.evidence[usize::from(region[s])];
            gradient.state(lattice.stiffness(), self.problem.model.kinematics)
        };
        (0..n).map(|s| wanted(s).then(|| state(s))).collect()
    }

    /// The largest stretch (–) of each sphere's whole bonds; zero without.
    fn largest_stretches(&self) -> Vec<f32> {
        let mut largest = vec![f64::NEG_INFINITY; self.particles().len()];
        self.whole_bonds(|bond, moved| {
            let (length, to) = (bond.branch.norm(), bond.branch + moved);
            let stretch = match self.problem.model.kinematics {
                Kinematics::Linear => bond.branch.dot(moved) / (length * length),
                Kinematics::Finite => moved.dot(&(to + bond.branch)) / (length * (to.norm() + length)),
            };
            for end in [bond.a, bond.b] {
                largest[end as usize] = largest[end as usize].max(stretch);
            }
        });
        largest.into_iter().map(|s| if s.is_finite() { s as f32 } else { 0.0 }).collect()
    }

    /// Every whole bond, and by how much its second end is displaced against the first (m).
    fn whole_bonds(&self, mut see: impl FnMut(&StiffBond, &Vector3<f64>)) {
        let particles = self.particles();
        let bonds = particles.model().bonds.iter().enumerate();
        bonds
            .filter(|(number, _)| particles.whole()[*number])
            .for_each(|(number, bond)| see(bond, &particles.moved(number)));
    }

    /// Every bond that is not broken, once for either end, with what it carries.
    fn each_bond(&self, mut see: impl FnMut(usize, &Carried)) {
        let particles = self.particles();
        for (number, bond) in particles.model().bonds.iter().enumerate() {
            if let Some(carried) = particles.carried(number) {
                see(bond.a as usize, &carried);
                see(bond.b as usize, &carried);
            }
        }
    }
}

/// A warning for every region of whose lattice only an upper bound of the stiffness is known, where stresses are asked for.
pub(super) fn stress_warnings(problem: &PackingProblem) -> Vec<String> {
    let of_field = |f: FieldName| matches!(f, FieldName::Stress | FieldName::VonMises | FieldName::PrincipalStress);
    let output = &problem.output;
    let asked = output.fields.iter().copied().chain(output.slices.iter().map(|s| s.field)).any(of_field)
        || problem.probes.iter().any(|p| p.quantity == Quantity::Stress);
    let unmeasured = problem.evidence.iter().filter(|e| asked && e.measured.is_none());
    unmeasured
        .map(|e| {
            format!(
                "region {}: stress is C:ε with the sum over the bonds for C, an upper bound of what the lattice has; \
                 packing.correct = true measures it, and the field virial is what the bonds carry",
                e.region
            )
        })
        .collect()
}

fn vectors(field: &[Vector3<f64>]) -> Vec<f32> {
    field.iter().flat_map(|v| [v.x as f32, v.y as f32, v.z as f32]).collect()
}
