//! Kernels of bonds on grids: bond updates per second, each bond counted once, at horizon 3 spacings (61 per node).
//! Run with `cargo bench -p anisobond --bench grid_kernels [-- --lammps]`; `--lammps` runs `peri/pmb` of LAMMPS beside them
//! (`verification/peers/lammps_peri.py`, Python in `LAMMPS_PYTHON`).

use std::hint::black_box;
use std::time::Instant;

use anisobond::lattice::{Body, Grid, Influence, Neighbourhood};
use anisobond::operator::Kinematics;
use anisobond::operator::grid::{GridBonds, Real, Stencil};
use nalgebra::Vector3;

const SPACING: f64 = 1e-3;

/// Bonds per node at horizon 3, each counted once.
const BONDS: f64 = 61.0;

/// Seconds of the fastest of several runs.
fn best(runs: usize, mut run: impl FnMut()) -> f64 {
    (0..runs)
        .map(|_| {
            let start = Instant::now();
            run();
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}

/// What is measured.
#[derive(Clone, Copy)]
enum Kernel {
    Intact,
    Bits,
    Breaking,
}

/// Seconds of one pass over a periodic block of n³ nodes, and bytes per node of a run's arrays.
fn pass<T: Real>(n: usize, kernel: Kernel) -> (f64, f64) {
    let neighbourhood = Neighbourhood::sphere(3.0, SPACING, Influence::Constant).expect("a neighbourhood");
    let grid = Grid::new([n; 3], SPACING, Vector3::zeros(), [true; 3]).expect("a grid");
    let stencil = Stencil::new(&neighbourhood, &vec![1e18; neighbourhood.bonds().len()]).breaking_at(0.5);
    let nodes = grid.len();
    let mut bonds =
        GridBonds::<T>::new(Body::full(grid), &neighbourhood, vec![1; nodes], vec![stencil]).expect("valid bonds");
    if let Kernel::Bits = kernel {
        // One bond of every node is cut, so that no vector is whole.
        bonds.cut(|p, q| q.x - p.x > 2.5 * SPACING);
    }
    let mut u = bonds.padded();
    let mut velocity = [0, 1, 2].map(|_| vec![T::of(0.0); nodes]);
    let [x, y, z] = &mut velocity;
    let nothing = vec![(); nodes];
    u.update([&nothing, &nothing, &nothing], |row, u, _| {
        for (a, u) in u.into_iter().enumerate() {
            for (i, u) in u.iter_mut().enumerate() {
                *u = T::of(1e-6 * ((i * (a + 3) + row) as f64).sin());
            }
        }
    });
    let kick = |_: usize, f: [&[T]; 3], v: [&mut [T]; 3]| {
        for (v, f) in v.into_iter().zip(f) {
            for (v, &f) in v.iter_mut().zip(f) {
                *v += T::of(1e-9) * f;
            }
        }
    };
    let seconds = best(25, || match kernel {
        Kernel::Breaking => {
            let (broken, _) = bonds.sweep_breaking(&u, Kinematics::Finite, [x, y, z], kick).expect("own displacements");
            assert_eq!(broken.count, 0);
        }
        _ => {
            black_box(bonds.sweep(&u, Kinematics::Linear, [x, y, z], kick).expect("own displacements"));
        }
    });
    let bytes = (u.bytes() + bonds.bytes() + 3 * nodes * size_of::<T>()) as f64 / nodes as f64;
    (seconds, bytes)
}

/// Bond updates per second of LAMMPS' `peri/pmb` on as many nodes, on one core; `None` where it cannot be run.
fn lammps(n: usize) -> Option<f64> {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../verification/peers/lammps_peri.py");
    let python = std::env::var("LAMMPS_PYTHON").unwrap_or_else(|_| "python3".into());
    let output =
        std::process::Command::new(python).arg(script).arg(n.to_string()).env("OMP_NUM_THREADS", "1").output().ok()?;
    String::from_utf8(output.stdout).ok()?.split_whitespace().last()?.parse().ok()
}

fn main() {
    let peer = std::env::args().any(|a| a == "--lammps");
    println!("cells  threads   intact linear           linear with bits        finite, breaking        bytes/node");
    for n in [64, 96] {
        for threads in [1, 2] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            let mut line = format!("{n:4}³  {threads}         ");
            let (mut memory, mut rates) = (0.0, Vec::new());
            for kernel in [Kernel::Intact, Kernel::Bits, Kernel::Breaking] {
                let (seconds, bytes) = pool.install(|| pass::<f64>(n, kernel));
                let nodes = (n * n * n) as f64;
                let rate = BONDS * nodes / seconds;
                line += &format!("{:6.3}e9/s {:6.2} ns/node  ", rate / 1e9, 1e9 * seconds / nodes);
                rates.push(rate);
                memory = bytes;
            }
            println!("{line}{memory:6.1}");
            if threads == 1 && peer {
                match lammps(n) {
                    Some(rate) => println!(
                        "       LAMMPS peri/pmb {:.4}e9/s; times as fast: {}",
                        rate / 1e9,
                        rates.iter().map(|r: &f64| format!("{:.0}", r / rate)).collect::<Vec<_>>().join(", ")
                    ),
                    None => println!("       LAMMPS could not be run: see verification/peers/lammps_peri.py"),
                }
            }
        }
    }
}
