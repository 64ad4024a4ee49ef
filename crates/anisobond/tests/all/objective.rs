//! The nodal term at finite stretch: rigid turns cost nothing, force and tangent are derivatives of one energy, and uniform
//! deformation has the stress of the law that the documentation states (docs/models.md).

use crate::common::grid_forces;

use anisobond::lattice::{Body, Grid, Influence, Neighbourhood, Shape};
use anisobond::operator::grid::naive::NaiveBonds;
use anisobond::operator::grid::{GridBonds, InstructionSet, Real, Stencil};
use anisobond::operator::{Kinematics, PeriodicHybrid, VectorField};
use anisobond::tensor::Stiffness;
use grid_forces::forces;
use nalgebra::{Matrix3, Matrix6, Rotation3, Unit, Vector3};

const SPACING: f64 = 2e-3;

/// A repeatable number in (−1, 1).
fn noise(seed: u64) -> f64 {
    let mut z = seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// A positive definite tensor without any symmetry (Pa).
fn anisotropic(seed: u64) -> Stiffness {
    let a = Matrix6::from_fn(|i, j| noise(seed + (6 * i + j) as u64) + if i == j { 1.5 } else { 0.0 });
    Stiffness::from_mandel(2e9 * a * a.transpose())
}

struct Setup {
    neighbourhood: Neighbourhood,
    body: Body,
    stencil: Vec<u16>,
    stencils: Vec<Stencil>,
    /// Bonds from one side of this plane to the other are cut.
    crack: Option<fn(&Vector3<f64>) -> bool>,
}

/// Of so many stencils, all with nodal terms of their own but the third, by layers along the first axis.
fn setup(nodes: [usize; 3], periodic: [bool; 3], radius: f64, count: usize, voids: bool) -> Setup {
    let shape = Shape::Sphere { radius };
    let neighbourhood = Neighbourhood::new(shape, radius, SPACING, Influence::Inverse).unwrap();
    let mut body = Body::full(Grid::new(nodes, SPACING, Vector3::zeros(), periodic).unwrap());
    (0..body.grid.len()).filter(|&i| voids && noise(77 + i as u64) > 0.8).for_each(|i| body.region[i] = 0);
    let bonds = neighbourhood.bonds().len();
    let stencils = (0..count).map(|s| {
        let micro: Vec<f64> =
            (0..bonds).map(|b| 1e18 * (2.0 + noise((1000 * s + b.min(bonds - 1 - b)) as u64))).collect();
        Stencil { nodal: (s != 2).then(|| anisotropic(10 * s as u64)), ..Stencil::new(&neighbourhood, &micro) }
    });
    let stencils = stencils.collect();
    let layer = |i: usize| 1 + (i % nodes[0] * count / nodes[0]) as u16;
    let stencil = (0..body.grid.len()).map(|i| if body.region[i] > 0 { layer(i) } else { 0 }).collect();
    Setup { neighbourhood, body, stencil, stencils, crack: None }
}

/// Bulk, surfaces, cracks, several regions, missing nodes, periodic faces, one layer.
fn table() -> Vec<Setup> {
    let lower = |p: &Vector3<f64>| p.y > 1.5 * SPACING && p.x < 4.5 * SPACING;
    vec![
        setup([21, 5, 5], [false; 3], 2.0, 1, false),
        Setup { crack: Some(lower), ..setup([11, 6, 5], [false; 3], 3.0, 1, false) },
        setup([9, 6, 4], [false, true, false], 2.0, 3, true),
        Setup { crack: Some(lower), ..setup([17, 7, 1], [false, false, true], 3.0, 2, false) },
        setup([8, 9, 7], [true; 3], 3.0, 1, false),
    ]
}

impl Setup {
    fn naive(&self) -> NaiveBonds<'_> {
        let Setup { body, neighbourhood, stencil, stencils, .. } = self;
        let mut naive = NaiveBonds::whole(body, neighbourhood, stencil, stencils);
        if let Some(side) = self.crack {
            let crosses = |&(i, b, _): &(usize, usize, usize)| {
                let p = body.grid.position(i);
                side(&p) != side(&(p + neighbourhood.bonds()[b].xi))
            };
            naive.broken = naive.bonds().iter().filter(|bond| crosses(bond)).map(|&(i, b, _)| (i, b)).collect();
        }
        naive
    }

    fn kernels<T: Real>(&self, set: InstructionSet) -> GridBonds<T> {
        let (body, stencil, stencils) = (self.body.clone(), self.stencil.clone(), self.stencils.clone());
        let mut bonds = GridBonds::with_instructions(set, body, &self.neighbourhood, stencil, stencils).unwrap();
        if let Some(side) = self.crack {
            bonds.cut(|p, q| side(p) != side(q));
        }
        bonds
    }

    /// Displacements (F − 1) x + amplitude × noise (m); zero where there is no node.
    fn moved(&self, f: &Matrix3<f64>, amplitude: f64) -> VectorField {
        let mut u = VectorField::zeros(self.body.grid.len());
        for i in (0..u.len()).filter(|&i| self.stencil[i] > 0) {
            let shaken = Vector3::from_fn(|a, _| amplitude * noise((3 * i + a) as u64));
            u.set(i, &((f - Matrix3::identity()) * self.body.grid.position(i) + shaken));
        }
        u
    }

    fn is_bounded(&self) -> bool {
        self.body.grid.periodic == [false; 3]
    }
}

fn sets() -> impl Iterator<Item = InstructionSet> {
    [InstructionSet::Portable, InstructionSet::Avx2, InstructionSet::Avx512].into_iter().filter(|s| s.available())
}

fn energy<T: Real>(bonds: &GridBonds<T>, u: &VectorField) -> f64 {
    let mut padded = bonds.padded();
    padded.set(u);
    bonds.energy(&padded, Kinematics::Finite).unwrap()
}

fn largest(f: &VectorField) -> f64 {
    f.components.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()))
}

fn difference(a: &VectorField, b: &VectorField) -> f64 {
    (0..a.len()).map(|i| (a.at(i) - b.at(i)).amax()).fold(0.0, f64::max)
}

fn turn(axis: [f64; 3], degrees: f64) -> Matrix3<f64> {
    *Rotation3::from_axis_angle(&Unit::new_normalize(Vector3::from(axis)), degrees.to_radians()).matrix()
}

/// A stretch and shear, turned by 70° about an oblique axis.
fn deformed() -> Matrix3<f64> {
    turn([1.0, 2.0, -1.0], 70.0) * Matrix3::new(1.2, 0.1, 0.0, 0.0, 0.9, -0.05, 0.05, 0.0, 1.1)
}

fn agrees<T: Real>(tolerance: f64) {
    for (number, setup) in table().iter().enumerate() {
        let f = if setup.is_bounded() { deformed() } else { Matrix3::identity() };
        let mut u = setup.moved(&f, 0.05 * SPACING);
        u.components.iter_mut().flatten().for_each(|x| *x = T::of(*x).f64());
        let naive = setup.naive();
        for (set, kinematics) in sets().flat_map(|s| [Kinematics::Linear, Kinematics::Finite].map(|k| (s, k))) {
            let expected = naive.response(&u, kinematics, false);
            let bonds = setup.kernels::<T>(set);
            let found = difference(&forces(&bonds, &u, kinematics), &expected.forces) / largest(&expected.forces);
            assert!(found < tolerance, "{number} {set:?} {kinematics:?}: {found:e}");
            let mut padded = bonds.padded();
            padded.set(&u);
            let sum: f64 = expected.energy.iter().sum();
            let off = bonds.energy(&padded, kinematics).unwrap() / sum - 1.0;
            assert!(off.abs() < tolerance, "{number} {set:?} {kinematics:?}: energy {off:e}");
            let stress = expected.stress.iter().map(|s| s.amax()).fold(0.0, f64::max);
            for (node, state) in bonds.node_states(&padded, kinematics).iter().enumerate() {
                assert!((state.stress - expected.stress[node]).amax() < tolerance * stress, "{number} {node}");
                assert!((state.energy - expected.energy[node]).abs() < tolerance * sum, "{number} {node}");
            }
        }
    }
}

#[test]
fn kernels_agree_with_their_naive_twin() {
    agrees::<f64>(1e-12);
}

/// Forces are −∂energy/∂u of the kernels' energy, and their own derivative is the naive twin's tangent, far from the start.
#[test]
fn force_and_tangent_are_derivatives_of_one_energy() {
    for (number, setup) in table().iter().enumerate() {
        let f = if setup.is_bounded() { deformed() } else { Matrix3::identity() };
        let bonds = setup.kernels::<f64>(InstructionSet::best());
        let naive = setup.naive();
        let u = setup.moved(&f, 0.05 * SPACING);
        let force = forces(&bonds, &u, Kinematics::Finite);
        for seed in 0..3 {
            let mut way = VectorField::zeros(u.len());
            for i in (0..u.len()).filter(|&i| setup.stencil[i] > 0) {
                way.set(i, &Vector3::from_fn(|a, _| noise(1_000_000 * (seed + 1) + (3 * i + a) as u64)));
            }
            let h = 1e-5 * SPACING;
            let [ahead, behind] = [h, -h].map(|h| {
                let mut moved = u.clone();
                (0..u.len()).for_each(|i| moved.set(i, &(u.at(i) + h * way.at(i))));
                moved
            });
            let slope = -(energy(&bonds, &ahead) - energy(&bonds, &behind)) / (2.0 * h);
            let work: f64 = (0..u.len()).map(|i| force.at(i).dot(&way.at(i))).sum();
            let size: f64 = (0..u.len()).map(|i| force.at(i).norm() * way.at(i).norm()).sum();
            assert!((slope - work).abs() < 1e-8 * size, "{number}: {slope} {work}");
            let (up, down) = (forces(&bonds, &ahead, Kinematics::Finite), forces(&bonds, &behind, Kinematics::Finite));
            let mut change = VectorField::zeros(u.len());
            (0..u.len()).for_each(|i| change.set(i, &((up.at(i) - down.at(i)) / (2.0 * h))));
            let tangent = naive.tangent(&u, Kinematics::Finite, &way);
            let off = difference(&change, &tangent) / largest(&tangent);
            assert!(off < 1e-7, "{number}: tangent {off:e}");
        }
    }
}

/// A rigid turn by any angle about any axis costs less than 10⁻¹² of what a stretch of that size does, and pulls at nothing.
#[test]
fn rigid_turns_cost_nothing() {
    let axes = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 1.0, 1.0], [-0.3, 2.0, 0.7]];
    for (number, setup) in table().iter().enumerate() {
        let (bonds, naive) = (setup.kernels::<f64>(InstructionSet::best()), setup.naive());
        for (axis, degrees) in axes.into_iter().flat_map(|a| [1e-3, 30.0, 90.0, 180.0, 260.0].map(|d| (a, d))) {
            // Periodic faces turn with the body only about the axis of a layer, and not where the body goes on.
            if !setup.is_bounded() {
                continue;
            }
            let r = turn(axis, degrees);
            let size = (r - Matrix3::identity()).norm();
            let stretched = setup.moved(&(Matrix3::identity() * (1.0 + size)), 0.0);
            let turned = setup.moved(&r, 0.0);
            let (cost, full) = (energy(&bonds, &turned), energy(&bonds, &stretched));
            assert!(cost < 1e-12 * full, "{number} {axis:?} {degrees}: {cost:e} of {full:e}");
            let twin = naive.response(&turned, Kinematics::Finite, false);
            let (pull, reference) =
                (forces(&bonds, &turned, Kinematics::Finite), forces(&bonds, &stretched, Kinematics::Finite));
            assert!(twin.energy.iter().sum::<f64>() < 1e-12 * full);
            for f in [&pull, &twin.forces] {
                assert!(largest(f) < 1e-9 * largest(&reference), "{number} {axis:?} {degrees}");
            }
        }
    }
    let setup = setup([4, 3, 5], [true; 3], 3.0, 1, false);
    let micro = vec![1e18; setup.neighbourhood.bonds().len()];
    let block = PeriodicHybrid::new(&setup.neighbourhood, &micro, &anisotropic(4), [4, 3, 5]).unwrap();
    let block = block.with_kinematics(Kinematics::Finite);
    let rest = vec![Vector3::zeros(); block.nodes()];
    for (axis, degrees) in axes.into_iter().flat_map(|a| [30.0, 180.0].map(|d| (a, d))) {
        let h = turn(axis, degrees) - Matrix3::identity();
        let full = block.response(&rest, &(Matrix3::identity() * h.norm())).unwrap().energy;
        assert!(block.response(&rest, &h).unwrap().energy < 1e-12 * full);
    }
}

/// What a body turned by R feels is what it feels unturned, turned: forces R f, stress R τ Rᵀ, the same energy.
#[test]
fn what_a_turned_body_feels_turns_with_it() {
    let setup = &table()[1];
    let bonds = setup.kernels::<f64>(InstructionSet::best());
    let stretch = Matrix3::new(1.1, 0.1, 0.0, 0.0, 0.9, -0.05, 0.05, 0.0, 1.05);
    let u = setup.moved(&stretch, 0.05 * SPACING);
    let r = turn([0.4, -1.0, 0.3], 137.0);
    let mut turned = u.clone();
    for i in 0..u.len() {
        let x = setup.body.grid.position(i);
        turned.set(i, &(r * (x + u.at(i)) - x));
    }
    let (f, g) = (forces(&bonds, &u, Kinematics::Finite), forces(&bonds, &turned, Kinematics::Finite));
    let states = |u: &VectorField| {
        let mut padded = bonds.padded();
        padded.set(u);
        bonds.node_states(&padded, Kinematics::Finite)
    };
    for (i, (a, b)) in states(&u).iter().zip(states(&turned)).enumerate() {
        assert!((r * f.at(i) - g.at(i)).norm() < 1e-11 * largest(&f), "{i}");
        assert!((r * a.stress * r.transpose() - b.stress).norm() < 1e-11 * a.stress.norm(), "{i}");
        assert!((a.energy / b.energy - 1.0).abs() < 1e-11, "{i}");
    }
}

/// Under a uniform F a node with all its bonds has the Kirchhoff stress of the law,
/// τ = (1/2ΔV) Σ k (|Fξ| − |ξ|) Fξ⊗Fξ/|Fξ| + F (Z:E) Fᵀ, and the periodic block the nominal one, τ F⁻ᵀ.
#[test]
fn uniform_deformation_has_the_stress_of_the_law() {
    let setup = setup([7, 7, 7], [false; 3], 3.0, 1, false);
    let (bonds, stencil) = (setup.kernels::<f64>(InstructionSet::best()), &setup.stencils[0]);
    let volume = SPACING.powi(3);
    let micro: Vec<f64> = (setup.neighbourhood.bonds().iter().zip(&stencil.stiffness))
        .map(|(b, k)| k * b.xi.norm() / (b.influence * volume * volume))
        .collect();
    let z = stencil.nodal.unwrap();
    let block = PeriodicHybrid::new(&setup.neighbourhood, &micro, &z, [3, 3, 3]).unwrap();
    let block = block.with_kinematics(Kinematics::Finite);
    for f in [Matrix3::from_diagonal(&Vector3::new(1.3, 1.0, 1.0)), deformed()] {
        let e = 0.5 * (f.transpose() * f - Matrix3::identity());
        let second = Matrix3::from_fn(|i, j| {
            (0..9).map(|kl| z.component(i, j, kl / 3, kl % 3) * e[(kl / 3, kl % 3)]).sum::<f64>()
        });
        let mut law = f * second * f.transpose();
        for (bond, k) in setup.neighbourhood.bonds().iter().zip(&stencil.stiffness) {
            let to = f * bond.xi;
            law += 0.5 * k * (to.norm() - bond.xi.norm()) / (to.norm() * volume) * to * to.transpose();
        }
        let mut padded = bonds.padded();
        padded.set(&setup.moved(&f, 0.0));
        let state = bonds.node_states(&padded, Kinematics::Finite)[7 * 7 * 3 + 7 * 3 + 3];
        assert!((state.stress - law).norm() < 1e-12 * law.norm(), "{} {law}", state.stress);
        let rest = vec![Vector3::zeros(); block.nodes()];
        let nominal = block.response(&rest, &(f - Matrix3::identity())).unwrap().stress;
        assert!((nominal * f.transpose() - law).norm() < 1e-12 * law.norm());
    }
}
