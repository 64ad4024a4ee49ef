//! Contact search and generation of packings. Run with `cargo bench -p anisobond --bench packing`; names of parts
//! (`contacts`, `small`, `large`, `dense`) choose some of them.

use std::time::Instant;

use anisobond::lattice::generate::{Extent, Radii, RandomPacking, Target, random};
use anisobond::lattice::{Packing, contacts};

fn generated(number: usize, porosity: f64, radii: Radii) -> Packing {
    let start = Instant::now();
    let wanted = RandomPacking {
        extent: Extent::Number(number),
        radii,
        target: Target::Porosity(porosity),
        contact_radius: 1.8,
        seed: 1,
    };
    let made = random(&wanted).expect("valid wishes");
    let (r, s) = (&made.report, &made.report.statistics);
    println!(
        "{number:>7} spheres, porosity {porosity}: {:7.3} s, {} force evaluations, {} trials, {:?} {:.5}, coordination {:.3}",
        start.elapsed().as_secs_f64(),
        r.iterations,
        r.trials,
        r.outcome,
        s.porosity.unwrap_or(1.0),
        s.coordination.mean
    );
    made.packing
}

fn timed_contacts(packing: &Packing, contact_radius: f64) {
    let mut times: Vec<f64> = (0..7)
        .map(|_| {
            let start = Instant::now();
            std::hint::black_box(contacts(packing, contact_radius).expect("a valid packing"));
            start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    let count = contacts(packing, contact_radius).expect("a valid packing").len();
    println!("{:>7} spheres, I_R {contact_radius}: {count} contacts in {:.4} s", packing.len(), times[3]);
}

fn main() {
    let asked: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let wants = |part: &str| asked.is_empty() || asked.iter().any(|a| a == part);
    let equal = || Radii::Uniform { radius: 0.03 };
    let mixed = || Radii::LogNormal { median: 0.03, deviation: 0.5, least: 0.005, most: 0.15 };
    if wants("small") {
        for porosity in [0.5, 0.478, 0.42, 0.4, 0.38, 0.37] {
            generated(2500, porosity, equal());
        }
        generated(2500, 0.45, mixed());
    }
    if wants("contacts") {
        for radii in [equal(), mixed()] {
            let packing = generated(100_000, 0.6, radii);
            for contact_radius in [1.05, 1.4, 1.8] {
                timed_contacts(&packing, contact_radius);
            }
        }
    }
    if wants("large") {
        for number in [10_000, 100_000] {
            generated(number, 0.478, equal());
        }
    }
    if wants("dense") {
        generated(2500, 0.34, equal());
        generated(10_000, 0.38, equal());
    }
}
