//! The calibration of the document's eight materials, paired in one run with a general QP solver (clarabel at its
//! default tolerance) on the same problems. Run with `cargo bench -p anisobond-app --bench calibration`.
//!
//! Prints the median time for the eight, the ratio, and both residuals ‖Xc − S‖/‖S‖ (of the solver's, where it claims to
//! have solved); then the time of a table of 1000 materials on one thread, from tensor to finished JSON.

#[path = "../../anisobond/tests/all/common/mod.rs"]
mod common;

use std::hint::black_box;
use std::time::Instant;

use anisobond::calibration::{Calibrator, LowerBound, ModelCalibrator, ModelSettings, Promise};
use anisobond::lattice::{Influence, Neighbourhood};
use anisobond::tensor::{Material, Stiffness};
use anisobond_app::{ModelReport, NeighbourhoodReport};

/// Seconds of the median of several runs.
fn median(runs: usize, mut run: impl FnMut()) -> f64 {
    let mut times: Vec<f64> = (0..runs)
        .map(|_| {
            let start = Instant::now();
            run();
            start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[runs / 2]
}

fn main() {
    let materials: Vec<_> = Material::builtin_names().into_iter().filter_map(Material::builtin).collect();
    println!("horizon  bonds   prepare     ours/8    clarabel/8   ratio   residual ours / clarabel");
    for horizon in [3.0, 6.0, 10.0] {
        let neighbourhood = Neighbourhood::sphere(horizon, 1.0, Influence::Inverse).expect("a valid neighbourhood");
        let prepare = median(11, || {
            black_box(Calibrator::new(&neighbourhood));
        });
        let calibrator = Calibrator::new(&neighbourhood);
        let (columns, unit) = common::qp::columns(&neighbourhood);
        let mut worst = [0.0f64; 2];
        let mut ours = Vec::new();
        let mut theirs = Vec::new();
        for _ in 0..7 {
            ours.push(median(31, || {
                for m in &materials {
                    let r = calibrator.calibrate(&m.stiffness, LowerBound::Value(0.0)).expect("a valid tensor");
                    worst[0] = worst[0].max(r.residual);
                    black_box(r);
                }
            }));
            theirs.push(median(1, || {
                for m in &materials {
                    let r = common::qp::calibrate(&columns, unit, &m.stiffness, 0.0, false);
                    if r.0 == clarabel::solver::SolverStatus::Solved {
                        worst[1] = worst[1].max(r.2);
                    }
                    black_box(r);
                }
            }));
        }
        ours.sort_by(f64::total_cmp);
        theirs.sort_by(f64::total_cmp);
        println!(
            "{horizon:7} {:6} {:7.1} µs {:8.1} µs {:10.1} µs {:7.0}   {:.1e} / {:.1e}",
            neighbourhood.bonds().len(),
            1e6 * prepare,
            1e6 * ours[3],
            1e6 * theirs[3],
            theirs[3] / ours[3],
            worst[0],
            worst[1]
        );
    }

    println!("\ntable of 1000 materials, one thread: tensor to JSON, waves included");
    let table = thousand(&materials);
    let models = [
        ("central", ModelSettings::central()),
        ("micropolar", ModelSettings::Micropolar(Promise::Sum)),
        ("hybrid", ModelSettings::Hybrid(None)),
    ];
    for horizon in [3.0, 6.0] {
        let neighbourhood = Neighbourhood::sphere(horizon, 1.0, Influence::Inverse).expect("a valid neighbourhood");
        for (name, settings) in models {
            let mut unstable = 0;
            let seconds = median(5, || {
                unstable = 0;
                let calibrator = ModelCalibrator::new(&neighbourhood, settings).expect("a valid neighbourhood");
                let description = NeighbourhoodReport::new(&calibrator);
                for m in &table {
                    let r = calibrator.calibrate(&m.stiffness).expect("a valid tensor");
                    unstable += usize::from(!r.stability().stable);
                    let report = ModelReport::new(m, &description, &r);
                    black_box(serde_json::to_string(&report).expect("finite numbers"));
                }
            });
            println!("horizon {horizon}, {name}: {seconds:.3} s ({unstable} not stable)");
        }
    }
}

/// The eight materials, each disturbed 125 times by up to a tenth in every Kelvin-Mandel entry.
fn thousand(materials: &[Material]) -> Vec<Material> {
    let mut random = common::Random(5);
    let mut table = Vec::new();
    while table.len() < 1000 {
        let base = &materials[table.len() % materials.len()];
        let stiffness = Stiffness::from_mandel(base.stiffness.mandel().map(|x| x * (1.0 + 0.1 * random.number())));
        if stiffness.require_positive_definite().is_ok() {
            table.push(Material { stiffness, ..base.clone() });
        }
    }
    table
}
