//! The static element test of a packing at several contact radii, its parts timed.
//! Run with `cargo bench -p anisobond-app --bench element_test [-- PACKING]`; without a packing file the reference packing
//! beside the checkout is used, or where that is absent a jittered cubic one of 2744 spheres.

use std::hint::black_box;
use std::time::Instant;

use anisobond::calibration::{EllipticFit, LatticeStiffness, TransverseConstants};
use anisobond::experiment::element_test::{DynamicTest, ElementTest};
use anisobond::lattice::{Lattice, Packing};
use anisobond::operator::{BondList, Network};
use anisobond::solver::BlockJacobi;
use anisobond_formats::read_packing;
use nalgebra::Vector3;

/// Seconds of the fastest of several runs, and the last result.
fn best<T>(runs: usize, mut run: impl FnMut() -> T) -> (f64, T) {
    let mut fastest = f64::INFINITY;
    let mut last = None;
    for _ in 0..runs {
        let start = Instant::now();
        let result = run();
        fastest = fastest.min(start.elapsed().as_secs_f64());
        last = Some(black_box(result));
    }
    (fastest, last.expect("at least one run"))
}

fn packing() -> Packing {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/woo-packing-2556.txt");
    let path = std::env::args().skip(1).find(|a| !a.starts_with("--")).unwrap_or_else(|| beside.to_string());
    match std::fs::exists(&path) {
        Ok(true) => read_packing(&path).expect("a valid packing"),
        _ => jittered(14),
    }
}

fn jittered(n: usize) -> Packing {
    let mut state = 1u64;
    let mut number = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let centres: Vec<Vector3<f64>> = (0..n * n * n)
        .map(|k| Vector3::new((k % n) as f64, (k / n % n) as f64, (k / n / n) as f64))
        .map(|x| x + 0.4 * Vector3::new(number(), number(), number()))
        .collect();
    let radii = vec![0.5; centres.len()];
    Packing::new(Some(Vector3::repeat(n as f64)), centres, radii).expect("a valid packing")
}

fn main() {
    let packing = packing();
    let constants = TransverseConstants { c11: 130e6, c33: 55e6, c13: 28e6, c12: 40e6 };
    let fit = EllipticFit::new(&constants.stiffness(&Vector3::z()), &Vector3::z()).expect("an admissible rock");
    println!(
        "{} spheres; {} bytes per contact read by the kernel, {} per node and load case in five vectors",
        packing.len(),
        BondList::BYTES_PER_BOND,
        5 * 6 * 8
    );
    println!(
        "  I_R  contacts | contacts  stiffness  ordering  blocks  whole test  (two threads) | iterations  per bond and case"
    );
    let runs = 5;
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    for contact_radius in [1.2, 1.4, 1.6, 1.8, 2.0, 2.4, 2.8] {
        let (contacts, lattice) = best(1, || Lattice::new(packing.clone(), contact_radius).expect("a valid lattice"));
        let (stiffness, k) = best(runs, || LatticeStiffness::new(&lattice, &fit.microplane).expect("positive moduli"));
        let network = Network::new(&lattice, &k);
        let (ordering, list) = best(runs, || BondList::new(&network).expect("a valid network"));
        let (blocks, _) = best(runs, || BlockJacobi::new(&list, true));
        let (alone, result) =
            best(runs, || one.install(|| ElementTest::default().run(&network).expect("a sound lattice")));
        let (shared, _) = best(runs, || ElementTest::default().run(&network).expect("a sound lattice"));
        let per_bond = (alone - ordering - blocks) / (result.solver.iterations * list.len() * 6) as f64;
        println!(
            "{contact_radius:5} {:9} | {:6.1} ms  {:6.1} ms {:6.1} ms {:5.1} ms   {:7.1} ms     {:7.1} ms | {:6}      {:.2} ns",
            list.len(),
            1e3 * contacts,
            1e3 * stiffness,
            1e3 * ordering,
            1e3 * blocks,
            1e3 * alone,
            1e3 * shared,
            result.solver.iterations,
            1e9 * per_bond
        );
    }
    println!("dynamic tests to -1 %, six together");
    for contact_radius in [1.2, 1.8] {
        let lattice = Lattice::new(packing.clone(), contact_radius).expect("a valid lattice");
        let k = LatticeStiffness::new(&lattice, &fit.microplane).expect("positive moduli");
        let network = Network::new(&lattice, &k);
        let (seconds, r) = best(1, || DynamicTest::default().run(&network).expect("a sound lattice"));
        println!(
            "{contact_radius:5} {:9} | {:.0} ms, steps {:?}, converged {}",
            network.bonds.len(),
            1e3 * seconds,
            r.steps,
            r.converged
        );
    }
}
