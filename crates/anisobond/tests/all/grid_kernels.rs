//! Kernels of bonds on grids against their naive twin, over a table of bodies.

use crate::common::grid_forces;

use anisobond::lattice::{Body, Grid, Influence, Neighbourhood, Shape};
use anisobond::operator::grid::naive::NaiveBonds;
use anisobond::operator::grid::{GridBonds, InstructionSet, Real, Stencil};
use anisobond::operator::{GridOperator, Kinematics, PeriodicHybrid, VectorField};
use anisobond::tensor::Stiffness;
use grid_forces::forces;
use nalgebra::{Matrix3, Vector3};

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
    /// Three regions by layers along the first axis, and some nodes missing.
    Regions,
    /// A region by node at random, of three.
    Grains,
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
            (_, Fill::Layers | Fill::Regions) => 1 + (i % nodes[0] * 3 / nodes[0]) as u16,
            (_, Fill::Mixed | Fill::Grains) => 1 + ((1.0 + noise(900 + i as u64)) * 1.5) as u16,
        })
        .collect();
    if matches!(fill, Fill::Regions | Fill::Grains) {
        body.region.clone_from(&stencil);
    }
    Setup { neighbourhood, body, stencil, stencils }
}

impl Setup {
    fn naive(&self) -> NaiveBonds<'_> {
        NaiveBonds::whole(&self.body, &self.neighbourhood, &self.stencil, &self.stencils)
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

fn table() -> Vec<Setup> {
    let sphere = |radius| Shape::Sphere { radius };
    let mut table = vec![];
    let fills = [Fill::Full, Fill::Voids, Fill::Layers, Fill::Mixed, Fill::Regions, Fill::Grains];
    let grids = [[8, 5, 4], [19, 4, 3], [7, 9, 1], [1, 6, 5], [33, 3, 2], [3, 2, 2]];
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
            // Where regions meet the twin is slow: on a part of the grids.
            for fill in fills.into_iter().take(if (g + p) % 4 == 0 { 6 } else { 4 }) {
                // Every grid, period and fill, with shapes in turn.
                let shape = shapes[(pick + g + p) % shapes.len()];
                let horizon = shape.semi_axes().into_iter().fold(0.0, f64::max);
                table.push(setup(grid, periodic, shape, horizon, fill));
                pick += 3;
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
                    (bonds.energy(&padded, kinematics).unwrap() - energy).abs()
                        <= 4.0 * tolerance * size * amplitude * n as f64,
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
                let (broken, _) = bonds
                    .sweep_breaking(&padded, kinematics, [x, y, z], |_, from, to| {
                        for (to, from) in to.into_iter().zip(from) {
                            to.iter_mut().zip(from).for_each(|(to, from)| *to = from.f64());
                        }
                    })
                    .unwrap();
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

fn calibrated(nodes: [usize; 3], periodic: [bool; 3], nodal: bool) -> Setup {
    let mut setup = setup(nodes, periodic, Shape::Sphere { radius: 3.0 }, 3.0, Fill::Full);
    let bonds = setup.neighbourhood.bonds().len();
    let micro: Vec<f64> = (0..bonds).map(|b| 1e18 * (2.0 + noise(b.min(bonds - 1 - b) as u64))).collect();
    setup.stencils = vec![Stencil::new(&setup.neighbourhood, &micro)];
    if nodal {
        setup.stencils[0].nodal = Some(Stiffness::isotropic(3e9, 2e9));
    }
    setup
}

/// The nodal term against its own oracle, on periodic blocks.
#[test]
fn hybrid_forces_agree_with_the_periodic_oracle() {
    for nodes in [[7, 8, 9], [4, 6, 1], [16, 3, 5]] {
        let setup = calibrated(nodes, [true; 3], true);
        let bonds = setup.kernels::<f64>(InstructionSet::best());
        let neighbourhood = &setup.neighbourhood;
        let square = SPACING.powi(6);
        let micro: Vec<f64> = neighbourhood
            .bonds()
            .iter()
            .zip(&setup.stencils[0].stiffness)
            .map(|(b, k)| k * b.xi.norm() / (b.influence * square))
            .collect();
        let oracle = PeriodicHybrid::new(neighbourhood, &micro, &Stiffness::isotropic(3e9, 2e9), nodes).unwrap();
        let u = field(bonds.body().grid.len(), 1e-6, 3);
        let list: Vec<Vector3<f64>> = (0..u.len()).map(|i| u.at(i)).collect();
        let expected = oracle.response(&list, &Matrix3::zeros()).unwrap();
        let mut f = VectorField::zeros(u.len());
        bonds.forces(&u, &mut f);
        let size = expected.forces.iter().map(|f| f.norm()).fold(0.0, f64::max);
        for (i, expected) in expected.forces.iter().enumerate() {
            assert!((f.at(i) - expected).norm() < 1e-13 * size, "{nodes:?} {i}");
        }
        let mut padded = bonds.padded();
        padded.set(&u);
        let energy = bonds.energy(&padded, Kinematics::Linear).unwrap();
        assert!((energy / expected.energy - 1.0).abs() < 1e-13, "{energy} {}", expected.energy);
    }
}

/// −∂energy/∂u by central differences, with surfaces, several stencils, broken bonds and a nodal term; and the diagonal
/// blocks by the response to one node.
#[test]
fn forces_are_the_gradient_of_the_energy() {
    let kinds = [Kinematics::Linear, Kinematics::Finite].into_iter().flat_map(|k| [false, true].map(|n| (n, k)));
    for (nodal, kinematics) in kinds {
        let mut setup = setup([6, 5, 4], [false, true, false], Shape::Sphere { radius: 2.0 }, 2.0, Fill::Mixed);
        if nodal {
            for s in &mut setup.stencils[..2] {
                s.nodal = Some(Stiffness::isotropic(3e9, 2e9));
            }
        }
        let mut bonds = setup.kernels::<f64>(InstructionSet::best());
        assert!(bonds.cut(|p, q| (p.z < 0.5 * SPACING) != (q.z < 0.5 * SPACING) && p.x < 3.0 * SPACING) > 0);
        let u = field(bonds.body().grid.len(), 0.03 * SPACING, 5);
        let f = forces(&bonds, &u, kinematics);
        let size = f.components.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        for node in [0, 17, 43, 61, 88, 119].into_iter().filter(|&i| setup.stencil[i] > 0) {
            for a in 0..3 {
                let h = 1e-5 * SPACING;
                let [up, down] = [h, -h].map(|h| {
                    let mut moved = u.clone();
                    moved.components[a][node] += h;
                    let mut padded = bonds.padded();
                    padded.set(&moved);
                    bonds.energy(&padded, kinematics).unwrap()
                });
                let slope = -(up - down) / (2.0 * h);
                assert!((slope - f.components[a][node]).abs() < 2e-7 * size, "{kinematics:?} {node} {a}");
                let mut one = VectorField::zeros(u.len());
                one.components[a][node] = 1.0;
                let mut response = VectorField::zeros(u.len());
                bonds.forces(&one, &mut response);
                let block = bonds.diagonal_block(node);
                assert!((response.at(node) + block.column(a)).norm() < 1e-12 * block.norm(), "{nodal} {node}");
            }
        }
    }
}

#[test]
fn momentum_is_kept_and_translations_cost_nothing() {
    let setup = setup([21, 6, 5], [false, true, false], Shape::Sphere { radius: 3.0 }, 3.0, Fill::Mixed);
    let n = setup.body.grid.len();
    for set in sets() {
        let bonds = setup.kernels::<f64>(set);
        let u = field(n, 0.03 * SPACING, 8);
        for kinematics in [Kinematics::Linear, Kinematics::Finite] {
            let f = forces(&bonds, &u, kinematics);
            for component in &f.components {
                let size: f64 = component.iter().map(|x| x.abs()).sum();
                assert!(component.iter().sum::<f64>().abs() < 1e-14 * size);
            }
            let mut rigid = VectorField::zeros(n);
            (0..n).filter(|&i| setup.stencil[i] > 0).for_each(|i| rigid.set(i, &Vector3::new(0.1, -2.0, 0.7)));
            let f = forces(&bonds, &rigid, kinematics);
            assert!(f.components.iter().flatten().all(|&x| x == 0.0), "{set:?} {kinematics:?}");
        }
    }
}

#[test]
fn displacements_of_other_bonds_are_refused() {
    let [a, b] = [[4, 5, 3], [5, 4, 3]].map(|nodes| calibrated(nodes, [false; 3], false));
    let (mut ours, others) = (a.kernels::<f64>(InstructionSet::best()), b.kernels::<f64>(InstructionSet::best()));
    let (mut x, mut y, mut z) = (vec![(); 60], vec![(); 60], vec![(); 60]);
    let u = others.padded();
    let swept = ours.sweep(&u, Kinematics::Linear, [&mut x, &mut y, &mut z], |_, _, _| ());
    assert!(swept.unwrap_err().to_string().contains("other bonds"));
    assert!(ours.sweep_breaking(&u, Kinematics::Finite, [&mut x, &mut y, &mut z], |_, _, _| ()).is_err());
    assert!(ours.energy(&u, Kinematics::Linear).is_err());
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let setup = setup([21, 9, 8], [false, true, false], Shape::Sphere { radius: 3.0 }, 3.0, Fill::Mixed);
    let u = field(setup.body.grid.len(), 0.03 * SPACING, 8);
    let results = [1, 2, 5].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut bonds = setup.kernels::<f64>(InstructionSet::best());
            let mut padded = bonds.padded();
            padded.set(&u);
            let mut f = VectorField::zeros(u.len());
            let [x, y, z] = &mut f.components;
            let (broken, sums) = bonds
                .sweep_breaking(&padded, Kinematics::Finite, [x, y, z], |_, f, to| {
                    to.into_iter().zip(f).for_each(|(to, f)| to.copy_from_slice(f));
                    f[0].iter().sum::<f64>()
                })
                .unwrap();
            assert!(broken.count > 0);
            (f, broken, sums, bonds.damage(), bonds.energy(&padded, Kinematics::Finite).unwrap())
        })
    });
    assert!(results.iter().all(|r| *r == results[0]));
}

/// Velocity Verlet of a periodic block rests just below the step of the eigenvalue; just above it grows, where the block
/// has the wave of that eigenvalue: at horizon 1 that of nodes against their neighbours.
#[test]
fn the_stable_step_is_exact_for_a_periodic_block() {
    for (radius, nodal) in [(1.0, None), (1.0, Some(1e5)), (3.0, None), (3.0, Some(2e9))] {
        let mut setup = setup([8, 8, 8], [true; 3], Shape::Sphere { radius }, radius, Fill::Full);
        setup.stencils[0].nodal = nodal.map(|z| Stiffness::isotropic(z, z));
        let bonds = setup.kernels::<f64>(InstructionSet::best());
        let density = 2500.0;
        let stable = 2.0 / bonds.eigenvalue_bound(&[density]).unwrap().sqrt();
        let mass = density * SPACING.powi(3);
        let grows = |factor: f64| {
            let step = factor * stable;
            let mut u = bonds.padded();
            u.set(&field(bonds.body().grid.len(), 1e-6, 4));
            let mut v = VectorField::zeros(bonds.body().grid.len());
            for _ in 0..100 {
                let [x, y, z] = &mut v.components;
                bonds
                    .sweep(&u, Kinematics::Linear, [x, y, z], |_, f, v| {
                        for (v, f) in v.into_iter().zip(f) {
                            v.iter_mut().zip(f).for_each(|(v, f)| *v += step / mass * f);
                        }
                    })
                    .unwrap();
                u.drift(v.components.each_ref().map(|v| &v[..]), step);
            }
            u.get().components.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs())) > 1e-3
        };
        assert!(!grows(0.99), "{radius} {nodal:?}");
        assert!(radius > 1.0 || grows(1.01), "{radius} {nodal:?}");
    }
}

/// The bound of bodies is above the largest eigenvalue, which many steps of the power method come near, but not by much.
#[test]
fn the_bound_of_a_body_is_safe_and_close() {
    for (fill, nodal) in [(Fill::Voids, false), (Fill::Layers, false), (Fill::Mixed, false), (Fill::Layers, true)] {
        let mut setup = setup([9, 8, 7], [false, true, false], Shape::Sphere { radius: 2.0 }, 2.0, fill);
        if nodal {
            setup.stencils.iter_mut().for_each(|s| s.nodal = Some(Stiffness::isotropic(3e9, 2e9)));
        }
        let bonds = setup.kernels::<f64>(InstructionSet::best());
        let bound = bonds.eigenvalue_bound(&[1000.0]).unwrap();
        let mut v = field(setup.body.grid.len(), 1.0, 11);
        let mut largest = 0.0;
        for _ in 0..400 {
            let mut f = VectorField::zeros(v.len());
            bonds.forces(&v, &mut f);
            let norm = |v: &VectorField| v.components.iter().flatten().map(|x| x * x).sum::<f64>().sqrt();
            largest = norm(&f) / norm(&v) / (1000.0 * SPACING.powi(3));
            let size = norm(&f);
            f.components.iter_mut().flatten().for_each(|x| *x /= size);
            v = f;
        }
        assert!(largest <= bound && bound < 1.3 * largest, "{fill:?}: {largest:e} {bound:e}");
    }
}
