//! Work under a watch: told to stop it ends within an iteration, not told to it is as without.

use crate::common;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anisobond::calibration::{LatticeStiffness, Model, TransverseConstants};
use anisobond::experiment::element_test::{DynamicTest, ElementTest};
use anisobond::experiment::{Correction, CorrectionChoice, GridStudy, LatticePlan, LatticeStudy};
use anisobond::lattice::Lattice;
use anisobond::operator::{BondList, Network};
use anisobond::solver::{BlockJacobi, Ending, Stopping, Watch, solve_bonds};
use anisobond::tensor::{Metric, Stiffness};
use anisobond::{Error, Result};
use anisobond_app::element_sweep::{ElementSweep, store_in};
use anisobond_app::sweep::{Job, JobLog, Options, ParameterTable, Store, run_sweep};
use anisobond_formats::write_packing;
use common::{jittered, jittered_lattice};
use nalgebra::Vector3;
use serde_json::json;

const ROCK: TransverseConstants = TransverseConstants { c11: 130e6, c33: 55e6, c13: 28e6, c12: 40e6 };

/// Threads that may be within an iteration while the work is told to stop.
const THREADS: u64 = 6;

fn lattice() -> Lattice {
    jittered_lattice(6, 4, 1.6)
}

fn rock() -> Stiffness {
    ROCK.stiffness(&Vector3::z())
}

fn network() -> Network {
    let lattice = lattice();
    Network::new(&lattice, &LatticeStiffness::new(&lattice, &|_: &Vector3<f64>| (3.0, 1.0)).unwrap())
}

/// A static test that is never content before so many iterations.
fn discontent(most_iterations: usize) -> ElementTest {
    ElementTest { stopping: Stopping { tolerance: 0.0, most_iterations }, ..ElementTest::default() }
}

/// What work says that its watch told to stop; it must end within an iteration of each of its threads.
fn stopped<T>(watch: &Watch, after: u64, work: impl FnOnce() -> Result<T>) -> String {
    let outcome = work();
    assert!((after..=after + THREADS).contains(&watch.iterations()), "{} after {after}", watch.iterations());
    match outcome {
        Err(Error::Interrupted { message }) => message.to_string(),
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("the work was finished"),
    }
}

#[test]
fn a_watch_that_stops_ends_tests_and_corrections() {
    let network = network();
    for threads in [false, true] {
        let test = ElementTest { threads, watch: Watch::stopped_after(3), ..discontent(100_000) };
        let said = stopped(&test.watch, 3, || test.run(&network));
        assert!(said.starts_with("the element test was not finished; "), "{said}");
        assert!(said.ends_with(&format!("{} iterations were done", test.watch.iterations())), "{said}");
    }
    let test = DynamicTest {
        ramp: usize::MAX - 1,
        most_steps: usize::MAX,
        watch: Watch::stopped_after(3),
        ..DynamicTest::default()
    };
    let said = stopped(&test.watch, 3, || test.run(&network));
    assert!(said.starts_with("the dynamic element test was not finished; "), "{said}");

    for choice in [CorrectionChoice::General, CorrectionChoice::Elliptic] {
        let study = |watch: &Arc<Watch>, tolerance: f64| {
            let test = ElementTest { watch: watch.clone(), ..discontent(40) };
            let correction = Correction { test, tolerance, ..Correction::default() };
            let plan =
                LatticePlan { model: Model::Micropolar, correction: Some((choice, correction)), metric: Metric::Norm };
            LatticeStudy::planned(lattice().packing, &rock(), &Vector3::z(), 1.6, &plan)
        };
        // A first test that is near enough has no correction after it.
        let whole = Arc::new(Watch::default());
        study(&whole, 0.999).unwrap();
        let after = whole.iterations() + 3;
        let watch = Watch::stopped_after(after);
        let said = stopped(&watch, after, || study(&watch, 0.0));
        assert!(said.contains("not finished (correction ") && said.contains(", error "), "{said}");
    }
}

/// Another thread may tell the work to stop.
#[test]
fn a_watch_is_shared() {
    let watch = Arc::new(Watch::default());
    std::thread::scope(|scope| scope.spawn(|| watch.stop()).join().unwrap());
    assert!(watch.stopped() && watch.check("the test").is_err());
}

#[test]
fn nothing_is_begun_that_is_to_stop_already() {
    let network = network();
    let watch = Watch::stopped_by(Arc::new(AtomicBool::new(true)));
    let test = ElementTest { watch: watch.clone(), ..ElementTest::default() };
    let dynamic = DynamicTest { watch: watch.clone(), ..DynamicTest::default() };
    let correction = Correction { test: test.clone(), ..Correction::default() };
    let interrupted = |error: Option<Error>| assert!(matches!(error, Some(Error::Interrupted { .. })), "{error:?}");
    interrupted(test.run(&network).err());
    interrupted(dynamic.run(&network).err());
    interrupted(correction.general(&lattice(), &rock()).err());
    interrupted(correction.central(&lattice(), &rock()).err());
    interrupted(correction.hybrid(&lattice(), &rock()).err());
    assert_eq!(watch.iterations(), 0);
}

#[test]
fn a_watch_counts_and_changes_nothing() {
    let network = network();
    let (one, two) = (
        ElementTest { threads: false, ..ElementTest::default() },
        ElementTest { threads: true, ..ElementTest::default() },
    );
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let (a, b) = (one.run(&network).unwrap(), pool.install(|| two.run(&network)).unwrap());
    assert_eq!(a.measured, b.measured);
    let iterations = a.solver.iterations as u64;
    assert_eq!(one.watch.iterations(), iterations);
    assert!((iterations + 1..=2 * iterations).contains(&two.watch.iterations()));

    let dynamic = DynamicTest::default();
    let r = dynamic.run(&network).unwrap();
    assert_eq!(dynamic.watch.iterations(), r.steps.iter().sum::<usize>() as u64);

    // Every test of a correction counts on the same watch; the stage is over with it.
    let correction =
        Correction { test: ElementTest { threads: false, ..ElementTest::default() }, ..Correction::default() };
    let r = correction.general(&lattice(), &rock()).unwrap();
    let watch = &correction.test.watch;
    assert!(r.report.converged && watch.iterations() > (r.report.tests * r.test.solver.iterations / 2) as u64);
    assert_eq!(watch.stage(), "");
    let again = correction.general(&lattice(), &rock()).unwrap();
    assert_eq!(again.test.measured, r.test.measured);
}

#[test]
fn a_solve_that_is_watched_has_the_bits_of_one_that_is_not() {
    let list = BondList::new(&network()).unwrap();
    let m = BlockJacobi::new(&list, true);
    let mut b = list.zeros::<2>();
    list.apply_strain(&std::array::from_fn(|l| nalgebra::Vector6::from_fn(|i, _| (i + l) as f64)), &mut b);
    let stopping = Stopping::default();
    let (x, report) = solve_bonds(&list, &m, b.clone(), &[0.0; 2], (&stopping, &|_, _| true));
    let watch = Watch::default();
    let watched = |b| solve_bonds(&list, &m, b, &[0.0; 2], (&stopping, &watch.look()));
    assert_eq!((x, report), watched(b.clone()));
    assert!(report.converged() && report.iterations > 10 && watch.iterations() == report.iterations as u64);
    watch.stop();
    let (x, report) = watched(b);
    assert!(report.ending == Ending::Stopped && report.iterations == 0 && x == list.zeros());
}

/// Jobs under way end when the sweep is told to stop; the store then holds none of them, and the same call does them.
#[test]
fn a_sweep_that_stops_ends_its_jobs() {
    let folder = tempfile::tempdir().unwrap();
    write_packing(folder.path().join("p.txt"), &jittered(10, 3, 0.2)).unwrap();
    let words = "packing = \"p.txt\"\nc11 = \"130 MPa\"\nc33 = \"55 MPa\"\nc13 = \"28 MPa\"\nc12 = \"40 MPa\"\nmethod = \"dynamic\"\n";
    let text = format!("{words}[parameters]\ncontact_radius = [1.5, 1.6]\n");
    let file = folder.path().join("table.toml");
    let table = ParameterTable::parse(&text, &file.display().to_string()).unwrap();
    let sweep = ElementSweep::new(&table).unwrap();
    let store = Store::open(store_in(folder.path(), None), &table, None, &json!({})).unwrap();
    let options = Options { retry: false, logs: folder.path().join("logs") };
    let stop = AtomicBool::new(false);
    let job = |job: &Job, log: &mut JobLog| {
        let outcome = sweep.job(job, log, &Watch::stopped_after(3));
        stop.store(true, Ordering::Relaxed);
        outcome
    };
    let summary = run_sweep(&table, &store, &options, &stop, job, |_| ()).unwrap();
    assert!(std::fs::read_dir(&options.logs).unwrap().count() > 0 && summary.interrupted);
    assert_eq!((summary.counts.done, summary.counts.failed), (0, 0));
    let summary = run_sweep(&table, &store, &options, &AtomicBool::new(false), |_, _| Ok(json!({})), |_| ()).unwrap();
    assert_eq!((summary.counts.done, summary.interrupted), (2, false));
}

#[test]
fn a_grid_s_correction_can_be_stopped() {
    use anisobond::calibration::ModelCalibrator;
    use anisobond::experiment::element_test::Rotations;
    use anisobond::lattice::{Influence, Neighbourhood};
    use anisobond::operator::GridCell;

    let grid = Neighbourhood::sphere(2.0, 1.0, Influence::Inverse).unwrap();
    let calibrator = ModelCalibrator::new(&grid, GridStudy::settings(Model::Central, Rotations::Free)).unwrap();
    let cell = GridCell { nodes: [6; 3], missing: Vec::new(), displacement: 0.0, seed: 2 }.with_missing(0.1).unwrap();
    let test = ElementTest { watch: Watch::stopped_after(3), ..discontent(100_000) };
    let correction = Correction { test, ..Correction::default() };
    let work = || GridStudy::new(&calibrator, cell, &rock(), Some(&correction));
    let said = stopped(&correction.test.watch, 3, work);
    assert!(said.contains("before the first correction"), "{said}");
}
