//! Kernels of bonds on grids against their naive twin, over a table of bodies.

use anisobond::lattice::{Body, Grid, Influence, Neighbourhood, Shape};
use anisobond::operator::grid::naive::NaiveBonds;
use anisobond::operator::grid::{GridBonds, InstructionSet, Real, Stencil};
use anisobond::operator::{GridOperator, Kinematics, VectorField};
use nalgebra::Vector3;

/// A repeatable number in (−1, 1).
fn noise(seed: u64) -> f64 {
    let mut z = seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

fn field(n: usize, amplitude: f64, seed: u64) -> VectorField {
    let mut u = VectorField::zeros(n);
    for i in 0..n {
        let at = |a: u64| amplitude * noise(seed * 1_000_003 + 3 * i as u64 + a);
        u.set(i, &Vector3::new(at(0), at(1), at(2)));
    }
    u
}

/// How the nodes of a body are filled.
#[derive(Clone, Copy, Debug)]
enum Fill {
    /// All, one stencil.
    Full,
    /// Some nodes are missing.
    Voids,
    /// Three stencils by layers along the first axis, and some nodes missing.
    Layers,
    /// A stencil by node at random, of three.
    Mixed,
}

struct Setup {
    neighbourhood: Neighbourhood,
    body: Body,
    stencil: Vec<u16>,
    stencils: Vec<Stencil>,
}

const SPACING: f64 = 2e-3;

fn setup(nodes: [usize; 3], periodic: [bool; 3], shape: Shape, horizon: f64, fill: Fill) -> Setup {
    let neighbourhood = Neighbourhood::new(shape, horizon, SPACING, Influence::Inverse).unwrap();
    let grid = Grid::new(nodes, SPACING, Vector3::zeros(), periodic).unwrap();
    let mut body = Body::full(grid);
    let n = body.grid.len();
    if !matches!(fill, Fill::Full) {
        for i in 0..n {
            if noise(77 + i as u64) > 0.8 {
                body.region[i] = 0;
            }
        }
    }
    let count = if matches!(fill, Fill::Full | Fill::Voids) { 1 } else { 3 };
    let bonds = neighbourhood.bonds().len();
    let stencils: Vec<Stencil> = (0..count)
        .map(|s| {
            // Of the bulk symmetric, of others not.
            let micro: Vec<f64> = (0..bonds)
                .map(|b| 1e18 * (2.0 + noise((1000 * s + if s == 1 { b } else { b.min(bonds - 1 - b) }) as u64)))
                .collect();
            let mut stencil = Stencil::new(&neighbourhood, &micro);
            for (b, c) in stencil.critical.iter_mut().enumerate() {
                *c = 0.02 * (1.5 + noise((500 + 1000 * s + b.min(bonds - 1 - b)) as u64));
            }
            if s == 2 {
                stencil.critical[..bonds / 4].fill(f64::INFINITY);
            }
            stencil
        })
        .collect();
    let stencil = (0..n)
        .map(|i| match (body.region[i], fill) {
            (0, _) => 0,
            (_, Fill::Full | Fill::Voids) => 1,
            (_, Fill::Layers) => 1 + (i % nodes[0] * 3 / nodes[0]) as u16,
            (_, Fill::Mixed) => 1 + ((1.0 + noise(900 + i as u64)) * 1.5) as u16,
        })
        .collect();
    Setup { neighbourhood, body, stencil, stencils }
}

impl Setup {
    fn naive(&self) -> NaiveBonds<'_> {
        NaiveBonds {
            body: &self.body,
            neighbourhood: &self.neighbourhood,
            stencil: &self.stencil,
            stencils: &self.stencils,
            broken: Default::default(),
        }
    }

    fn kernels<T: Real>(&self, set: InstructionSet) -> GridBonds<T> {
        let (body, stencil, stencils) = (self.body.clone(), self.stencil.clone(), self.stencils.clone());
        GridBonds::with_instructions(set, body, &self.neighbourhood, stencil, stencils).unwrap()
    }
}

fn sets() -> impl Iterator<Item = InstructionSet> {
    [InstructionSet::Portable, InstructionSet::Avx2, InstructionSet::Avx512].into_iter().filter(|s| s.available())
}

/// Largest difference relative to Σ k |η| of the naive twin's bonds, the rounding that a sum has.
fn difference(a: &VectorField, b: &VectorField, scale: f64) -> f64 {
    (0..a.len()).map(|i| (a.at(i) - b.at(i)).amax()).fold(0.0, f64::max) / scale
}

fn forces<T: Real>(bonds: &GridBonds<T>, u: &VectorField, kinematics: Kinematics) -> VectorField {
    let mut padded = bonds.padded();
    padded.set(u);
    let mut f = VectorField::zeros(u.len());
    let [x, y, z] = &mut f.components;
    bonds.sweep(&padded, kinematics, [x, y, z], |_, from, to| {
        for (to, from) in to.into_iter().zip(from) {
            to.iter_mut().zip(from).for_each(|(to, from)| *to = from.f64());
        }
    });
    f
}

fn table() -> Vec<Setup> {
    let sphere = |radius| Shape::Sphere { radius };
    let mut table = vec![];
    let fills = [Fill::Full, Fill::Voids, Fill::Layers, Fill::Mixed];
    let grids = [[8, 8, 8], [19, 5, 4], [7, 9, 1], [1, 6, 5], [33, 4, 3], [3, 2, 2]];
    let periods = [[true; 3], [false; 3], [true, false, true], [false, true, false]];
    let shapes = [
        sphere(1.0),
        sphere(2f64.sqrt()),
        sphere(2.0),
        sphere(3.0),
        sphere(3.015),
        sphere(4.0),
        Shape::Cuboid { semi_axes: [3.0, 1.0, 2.0] },
        Shape::Ellipsoid { semi_axes: [2.0, 3.0, 1.0] },
    ];
    let mut pick = 0;
    for (g, grid) in grids.into_iter().enumerate() {
        for (p, periodic) in periods.into_iter().enumerate() {
            for fill in fills {
                // Every grid, period and fill, with shapes in turn.
                for _ in 0..2 {
                    let shape = shapes[(pick + g + p) % shapes.len()];
                    let horizon = shape.semi_axes().into_iter().fold(0.0, f64::max);
                    table.push(setup(grid, periodic, shape, horizon, fill));
                    pick += 3;
                }
            }
        }
    }
    table
}

/// Σ k |u| of a node's bonds, at most: what rounding is measured by.
fn scale(setup: &Setup, amplitude: f64) -> f64 {
    setup.stencils.iter().map(|s| s.stiffness.iter().sum::<f64>()).fold(0.0, f64::max) * amplitude
}

fn agrees<T: Real>(tolerance: f64) {
    for (number, setup) in table().iter().enumerate() {
        let n = setup.body.grid.len();
        let amplitude = 0.03 * SPACING;
        let u = {
            // As the storage type holds them.
            let mut u = field(n, amplitude, number as u64);
            u.components.iter_mut().flatten().for_each(|x| *x = T::of(*x).f64());
            (0..n).filter(|&i| setup.stencil[i] == 0).for_each(|i| u.set(i, &Vector3::zeros()));
            u
        };
        for set in sets() {
            let mut naive = setup.naive();
            let mut bonds = setup.kernels::<T>(set);
            for kinematics in [Kinematics::Linear, Kinematics::Finite] {
                let oracle = naive.response(&u, kinematics, false);
                let what =
                    format!("{number}: {:?} {:?} {set:?} {kinematics:?}", setup.body.grid, setup.neighbourhood.shape());
                let size = scale(setup, amplitude);
                let found = difference(&forces(&bonds, &u, kinematics), &oracle.forces, size);
                assert!(found < tolerance, "{what}: forces differ by {found:e}");
                let mut padded = bonds.padded();
                padded.set(&u);
                let energy = oracle.energy.iter().sum::<f64>();
                assert!(
                    (bonds.energy(&padded, kinematics) - energy).abs() <= 4.0 * tolerance * size * amplitude * n as f64,
                    "{what}"
                );
                for (state, (e, s)) in
                    bonds.node_states(&padded, kinematics).iter().zip(oracle.energy.iter().zip(&oracle.stress))
                {
                    assert!((state.energy - e).abs() <= 4.0 * tolerance * size * amplitude, "{what}");
                    let stress_scale = size * 5.0 * SPACING / SPACING.powi(3);
                    assert!((state.stress - s).amax() <= 4.0 * tolerance * stress_scale, "{what}");
                }
                // Break what is over its critical stretch, and go on with what is left.
                let oracle = naive.response(&u, kinematics, true);
                let mut f = VectorField::zeros(n);
                let [x, y, z] = &mut f.components;
                let (broken, _) = bonds.sweep_breaking(&padded, kinematics, [x, y, z], |_, from, to| {
                    for (to, from) in to.into_iter().zip(from) {
                        to.iter_mut().zip(from).for_each(|(to, from)| *to = from.f64());
                    }
                });
                let found = difference(&f, &oracle.forces, size);
                assert!(found < tolerance, "{what}: breaking forces differ by {found:e}");
                assert_eq!(broken.count, oracle.over.len(), "{what}");
                assert!((broken.energy - oracle.energy_over).abs() <= 4.0 * tolerance * size * amplitude * n as f64);
                naive.broken.extend(oracle.over);
                for (a, b) in bonds.damage().iter().zip(naive.damage()) {
                    assert!((a - b).abs() < 1e-12, "{what}: {a} {b}");
                }
            }
            // Some more bonds are cut by a plane, and linear forces are taken with what is left.
            let plane = |x: &Vector3<f64>| x[0] + 0.3 * x[1] > 0.4 * SPACING * setup.body.grid.nodes[0] as f64;
            let cut = bonds.cut(|p, q| plane(p) != plane(q));
            let passes: Vec<_> = naive
                .bonds()
                .into_iter()
                .filter(|&(i, b, _)| {
                    let p = setup.body.grid.position(i);
                    plane(&p) != plane(&(p + setup.neighbourhood.bonds()[b].xi))
                })
                .map(|(i, b, _)| (i, b))
                .collect();
            assert_eq!(cut, passes.len());
            naive.broken.extend(passes);
            let mut f = VectorField::zeros(n);
            bonds.forces(&u, &mut f);
            let oracle = naive.response(&u, Kinematics::Linear, false).forces;
            let found = difference(&f, &oracle, scale(setup, amplitude));
            assert!(found < tolerance, "{number} {set:?}: after the cut {found:e}");
        }
    }
}

#[test]
fn kernels_agree_with_their_naive_twin() {
    agrees::<f64>(2e-15);
}

#[test]
fn kernels_of_single_precision_agree_to_it() {
    agrees::<f32>(1e-6);
}
