//! Bodies under way: homogeneous states, patch tests, energies, and runs that are gone on with.

use crate::common::grid_forces;

use anisobond::calibration::{ModelCalibrator, ModelSettings};
use anisobond::experiment::{Condition, History, Problem, Schedule, Simulation};
use anisobond::lattice::{Body, Grid, Influence, Neighbourhood};
use anisobond::operator::grid::{GridBonds, Stencil};
use anisobond::operator::{Kinematics, VectorField};
use anisobond::tensor::{Material, Stiffness};
use anisobond_app::CaseFile;
use grid_forces::forces;
use nalgebra::{Matrix3, Vector3};

/// A displacement gradient of small strain and rotation.
fn gradient() -> Matrix3<f64> {
    1e-3 * Matrix3::new(1.0, 0.4, -0.3, 0.2, -0.7, 0.5, 0.6, -0.1, 0.8)
}

/// Homogeneous deformation in the bulk: no force, and the stress C:ε of the reached tensor at every node.
#[test]
fn homogeneous_deformation_has_exact_stress_and_no_force() {
    let spacing = 2e-3;
    let neighbourhood = Neighbourhood::sphere(3.0, spacing, Influence::Inverse).unwrap();
    for name in ["KIO3", "CoTeO4", "Te2W", "Pyroceram"] {
        let c = Material::builtin(name).unwrap().stiffness;
        for settings in [ModelSettings::central(), ModelSettings::Hybrid(None)] {
            let material = ModelCalibrator::new(&neighbourhood, settings).unwrap().calibrate(&c).unwrap();
            let mut stencil = Stencil::new(&neighbourhood, material.normal());
            stencil.nodal = material.nodal().copied();
            // Nodes that are six layers from the faces see a block that goes on for ever.
            let grid = Grid::new([15; 3], spacing, Vector3::zeros(), [false; 3]).unwrap();
            let body = Body::full(grid.clone());
            let of_node = body.region.clone();
            let bonds = GridBonds::<f64>::new(body, &neighbourhood, of_node, vec![stencil.clone()]).unwrap();
            let mut u = VectorField::zeros(grid.len());
            (0..grid.len()).for_each(|n| u.set(n, &(gradient() * grid.position(n))));
            let mut padded = bonds.padded();
            padded.set(&u);
            let inner: Vec<usize> =
                (0..grid.len()).filter(|n| grid.coordinates(*n).iter().all(|&i| (6..9).contains(&i))).collect();
            let xi: Vec<_> = neighbourhood.bonds().iter().map(|b| b.xi).collect();
            let exact = stress_of(&bulk(&stencil, &xi, spacing), &gradient());
            let scale: f64 = stencil.stiffness.iter().map(|k| k.abs()).sum::<f64>() * 1e-3 * spacing;
            let states = bonds.node_states(&padded, Kinematics::Linear);
            for kinematics in [Kinematics::Linear, Kinematics::Finite] {
                let f = forces(&bonds, &u, kinematics);
                let most = inner.iter().map(|&n| f.at(n).amax()).fold(0.0, f64::max);
                assert!(most < 1e-12 * scale, "{name} {kinematics:?}: {most:e} of {scale:e}");
            }
            for &n in &inner {
                let error = (states[n].stress - exact).norm() / exact.norm();
                assert!(error < 1e-12, "{name}: {error:e}");
            }
        }
    }
}

/// C of a stencil, component by component: Σ ½ k |ξ| … over the bonds of a cell, and Z.
fn bulk(stencil: &Stencil, xi: &[Vector3<f64>], spacing: f64) -> impl Fn([usize; 4]) -> f64 {
    move |[i, j, k, l]| {
        let bond =
            |(x, s): (&Vector3<f64>, &f64)| 0.5 * s * x[i] * x[j] * x[k] * x[l] / x.norm_squared() / spacing.powi(3);
        let central: f64 = xi.iter().zip(&stencil.stiffness).map(bond).sum();
        central + stencil.nodal.map_or(0.0, |z| z.component(i, j, k, l))
    }
}

fn stress_of(c: &impl Fn([usize; 4]) -> f64, g: &Matrix3<f64>) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| (0..9).map(|n| c([i, j, n / 3, n % 3]) * g[(n / 3, n % 3)]).sum())
}

/// A case from its text, in a small box of glass.
fn case(nodes: [usize; 3], text: &str) -> Problem {
    let size = nodes.map(|n| n.to_string()).join(", ");
    let text = format!(
        "name = 'test'\nmaterial = 'Pyroceram'\ndensity = '2600 kg/m3'\n[body]\nbox = {{ min = '0, 0, 0 mm', max = '{size} mm' }}\n\
         [grid]\nspacing = '1 mm'\nhorizon = 2\n{text}"
    );
    CaseFile::parse(&text, "test.toml", &[]).unwrap().problem().unwrap()
}

fn run(problem: Problem) -> Simulation {
    let mut simulation = Simulation::new(problem).unwrap();
    while !simulation.finished() {
        simulation.advance().unwrap();
    }
    simulation
}

fn stretched(nodes: [usize; 3], surface: bool) -> Problem {
    case(
        nodes,
        &format!(
            "[model]\nsurface_calibration = {surface}\n[[condition]]\non = 'x-min'\nthickness = 2\ndisplacement = ['-1 um', 'free', 'free']\n\
             [[condition]]\non = 'x-max'\nthickness = 2\ndisplacement = ['1 um', 'free', 'free']\n[equilibrium]\ntolerance = 1e-10\n"
        ),
    )
}

/// A bar under tension: its force is E A ε, nearer to it with truncated neighbourhoods calibrated.
#[test]
fn patch_test_gains_from_calibrated_surfaces() {
    let error = |surface: bool| {
        let mut problem = stretched([24, 8, 8], surface);
        // Uniform strain prescribed on the grips, contraction left free.
        problem.conditions.iter_mut().for_each(|c| {
            if let Condition::Displacement { value, .. } = c {
                value[1] = None;
                value[2] = None;
            }
        });
        let simulation = run(problem);
        let (grid, u) = (simulation.problem().body.grid.clone(), simulation.displacement());
        let at = |i: usize, j: usize| u.at(grid.index([i, j, 4]));
        let axial = (at(15, 4).x - at(8, 4).x) / 7e-3;
        let forces = simulation.forces();
        let pull: f64 = (0..grid.len()).filter(|&n| grid.coordinates(n)[0] < 2).map(|n| forces.at(n).x).sum();
        // E = 86 GPa, 64 mm².
        (pull / (86e9 * 64e-6 * axial) - 1.0).abs()
    };
    let (off, on) = (error(false), error(true));
    assert!(on < 0.03 && on < 0.5 * off, "{off} {on}");
}

/// Motion with everything that moves energy.
fn busy(step: f64, extra: &str) -> Problem {
    case(
        [20, 6, 4],
        &format!(
            "[[condition]]\non = 'x-min'\nthickness = 2\nvelocity = ['2 m/s', 0, 'free']\nhistory = {{ ramp = ['0 us', '3 us'] }}\n\
             [[condition]]\non = 'x-max'\ntraction = '1, 2, 0 MPa'\nhistory = {{ pulse = ['0 us', '4 us'] }}\n\
             [[condition]]\non = 'z-max'\ndisplacement = ['free', 'free', '1 um']\nhistory = {{ ramp = ['1 us', '5 us'] }}\n\
             [motion]\nduration = '8 us'\nstep = '{step} ns'\n{extra}"
        ),
    )
}

/// Linear bonds that do not break: what is there, lost and brought in balance to rounding at every step, whatever the step.
#[test]
fn energies_of_linear_motion_balance_to_rounding() {
    for step in [150.0, 50.0] {
        for damping in ["", "damping = '2e5 1/s'\n"] {
            let mut simulation = Simulation::new(busy(step, damping)).unwrap();
            while !simulation.finished() {
                simulation.advance().unwrap();
                if simulation.step().is_multiple_of(64) || simulation.finished() {
                    let drift = simulation.ledger().relative_drift();
                    assert!(drift < 1e-12, "{step} ns, step {}: {drift:e}", simulation.step());
                }
            }
            let ledger = simulation.ledger();
            assert!(ledger.external > 0.0 && ledger.kinetic > 0.0 && ledger.strain > 0.0);
            assert_eq!(ledger.damping > 0.0, !damping.is_empty());
        }
    }
}

/// Finite stretch: the drift falls with Δt².
#[test]
fn energies_of_finite_motion_drift_with_the_square_of_the_step() {
    let drift = |step: f64| {
        let mut problem = busy(step, "");
        problem.kinematics = Kinematics::Finite;
        problem.conditions.iter_mut().for_each(|c| match c {
            Condition::Force { force, .. } => force.iter_mut().for_each(|f| *f *= 300.0),
            Condition::Velocity { value, .. } => value[0] = Some(200.0),
            Condition::Displacement { .. } => {}
        });
        run(problem).ledger().relative_drift()
    };
    let drifts = [80.0, 40.0, 20.0].map(drift);
    assert!(drifts[0] < 0.01, "{drifts:?}");
    let order = (drifts[1] / drifts[2]).log2();
    assert!((1.7..2.4).contains(&order), "{order} {drifts:?}");
}

/// A bar pulled apart quickly.
fn breaking(step: f64) -> Problem {
    let text = format!(
        "[fracture]\nstretch = 2e-3\n[[condition]]\non = 'x-min'\nthickness = 2\nvelocity = ['-20 m/s', 0, 0]\n\
         [[condition]]\non = 'x-max'\nthickness = 2\nvelocity = ['20 m/s', 0, 0]\n[motion]\nduration = '6 us'\nstep = '{step} ns'\n"
    );
    // Top-level tables come after the bare keys, so that the text can follow them.
    case([20, 6, 4], &text)
}

/// Where bonds break, energies balance to rounding at any step: each is booked with what the scheme loses by it.
#[test]
fn energies_of_breaking_motion_balance_at_any_step() {
    let ends = [160.0, 40.0, 10.0].map(|step| *run(breaking(step)).ledger());
    for ledger in &ends {
        assert!(ledger.broken_bonds > 50 && ledger.fracture > 0.0, "{ledger:?}");
    }
    let drifts = ends.map(|l| l.relative_drift());
    assert!(drifts.iter().all(|&d| d < 1e-12), "{drifts:?}");
}

/// Without supports, momentum is that of the loads.
#[test]
fn momentum_is_the_impulse_of_the_loads() {
    let problem = case(
        [12, 6, 4],
        "[[condition]]\non = 'x-max'\ntraction = '3, 2, 1 MPa'\nhistory = { pulse = ['0 us', '4 us'] }\n[motion]\nduration = '6 us'\nstep = '100 ns'\n",
    );
    let simulation = run(problem);
    let v = simulation.velocity();
    let sum: Vector3<f64> = (0..v.len()).map(|n| v.at(n)).sum();
    // ∫ sin² over the pulse is half its length.
    let impulse = Vector3::new(3.0, 2.0, 1.0) * 1e6 * 24e-6 * 2e-6;
    let momentum = 2600.0 * 1e-9 * sum;
    assert!((momentum - impulse).norm() < 1e-9 * impulse.norm(), "{momentum} {impulse}");
}

const BENT: &str = "[[condition]]\non = 'x-min'\nthickness = 2\ndisplacement = [0, 0, 0]\n[[condition]]\non = 'x-max'\ntraction = '0, -1, 0 MPa'\n";

fn difference(a: &VectorField, b: &VectorField) -> f64 {
    let norm = |f: &dyn Fn(usize) -> f64| (0..a.len()).map(f).sum::<f64>().sqrt();
    norm(&|n| (a.at(n) - b.at(n)).norm_squared()) / norm(&|n| b.at(n).norm_squared())
}

/// Conjugate gradients, relaxation and damped motion come to the same; motion from equilibrium stays there.
#[test]
fn equilibrium_relaxation_and_damped_motion_agree() {
    let with = |schedule: &str| case([14, 5, 4], &format!("{BENT}{schedule}"));
    let gradients = run(with("[equilibrium]\ntolerance = 1e-10\n")).displacement();
    let relaxed = run(with("[equilibrium]\ntolerance = 1e-9\nrelaxation = true\n")).displacement();
    assert!(difference(&relaxed, &gradients) < 1e-7, "{:e}", difference(&relaxed, &gradients));
    let damped = run(with("[motion]\nduration = '1500 us'\ndamping = '4e4 1/s'\n"));
    let error = difference(&damped.displacement(), &gradients);
    assert!(error < 1e-6, "{error:e}");
    let ledger = damped.ledger();
    assert!(ledger.kinetic < 1e-9 * ledger.strain && ledger.relative_drift() < 1e-11, "{ledger:?}");
    let still = run(with("[motion]\nduration = '20 us'\nfrom_equilibrium = true\n"));
    assert!(difference(&still.displacement(), &gradients) < 1e-6);
    assert!(still.ledger().kinetic < 1e-12 * still.ledger().strain, "{:?}", still.ledger());
}

/// A run on one thread and on three, whole and gone on with from any step: the same bits.
#[test]
fn runs_do_not_depend_on_threads_or_interruptions() {
    let pulled = || {
        let text = "[fracture]\nstretch = 1e-3\n[[condition]]\non = 'x-min'\nthickness = 2\ndisplacement = ['-12 um', 0, 0]\n\
                    [[condition]]\non = 'x-max'\nthickness = 2\ndisplacement = ['12 um', 0, 0]\n[equilibrium]\nsteps = 6\ntolerance = 1e-8\n";
        let mut problem = case([20, 6, 4], text);
        let grid = problem.body.grid.clone();
        let held = |n: &u32| !(6..14).contains(&grid.coordinates(*n as usize)[0]);
        problem.unbreakable = (0..grid.len() as u32).filter(held).collect();
        problem
    };
    let problems: [(&str, &(dyn Fn() -> Problem + Sync)); 3] = [
        ("breaking motion", &|| breaking(60.0)),
        ("damped motion", &|| busy(100.0, "damping = '1e5 1/s'\n")),
        ("breaking equilibrium", &pulled),
    ];
    for (name, problem) in problems {
        let on = |threads: usize| {
            let pool = rayon_pool(threads);
            pool.install(|| run(problem()))
        };
        let whole = on(1);
        assert_eq!(whole.ledger().broken_bonds > 0, name.starts_with("breaking"), "{name}: {:?}", whole.ledger());
        let state = whole.save();
        assert!(on(3).save() == state, "{name}: threads");
        for stop in [1, whole.steps() / 3, whole.steps() - 1] {
            let mut first = Simulation::new(problem()).unwrap();
            while first.step() < stop {
                first.advance().unwrap();
            }
            let saved = first.save();
            drop(first);
            let mut second = Simulation::new(problem()).unwrap();
            second.restore(saved.clone()).unwrap();
            assert!(second.save() == saved, "{name}: saved again at {stop}");
            while !second.finished() {
                second.advance().unwrap();
            }
            assert!(second.save() == state, "{name}: gone on with at {stop}");
            assert_eq!(second.ledger(), whole.ledger(), "{name}");
            assert_eq!(second.cracks(), whole.cracks(), "{name}");
        }
    }
}

fn rayon_pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap()
}

fn message(result: anisobond::Result<Simulation>) -> String {
    result.err().expect("a refusal").to_string()
}

/// What goes wrong is named.
#[test]
fn faults_are_named() {
    // A step above the stable one, refused unless forced; forced, it explodes.
    let motion = |extra: &str| case([12, 6, 4], &format!("{BENT}[motion]\nduration = '1 ms'\nstep = '1 us'\n{extra}"));
    let refused = message(Simulation::new(motion("")));
    assert!(refused.contains("above the stable one") && refused.contains("force_step"), "{refused}");
    let mut forced = Simulation::new(motion("force_step = true\n")).unwrap();
    let failure = loop {
        if let Err(error) = forced.advance() {
            break error.to_string();
        }
        assert!(!forced.finished());
    };
    assert!(failure.contains("the motion explodes at ("), "{failure}");
    // A rigid body under load.
    let loose = case([8, 5, 4], "[[condition]]\non = 'x-max'\ntraction = '0, -1, 0 MPa'\n[equilibrium]\n");
    let failure = message(Simulation::new(loose));
    assert!(failure.contains("nothing holds") && failure.contains("translation along y"), "{failure}");
    // No density, no nodes, no load steps, a velocity in equilibrium.
    let mut problem = busy(100.0, "");
    problem.regions[0].density = 0.0;
    assert!(message(Simulation::new(problem)).contains("density"));
    let mut problem = busy(100.0, "");
    problem.body.region.fill(0);
    assert!(message(Simulation::new(problem)).contains("no nodes"));
    let mut problem = busy(100.0, "");
    problem.schedule = Schedule::Equilibrium { steps: 3, tolerance: 1e-8, relaxation: false };
    assert!(message(Simulation::new(problem)).contains("velocity"));
    // Two conditions that say different things of one node.
    let mut problem = stretched([8, 5, 4], false);
    let nodes = vec![0];
    problem.conditions.push(Condition::Displacement {
        nodes,
        value: [Some(5.0), None, None],
        history: History::Constant,
    });
    assert!(message(Simulation::new(problem)).contains("prescribed differently"));
    // A saved state of another body.
    let state = run(stretched([8, 5, 4], false)).save();
    let other = Simulation::new(stretched([9, 5, 4], false)).unwrap().restore(state).unwrap_err().to_string();
    assert!(other.contains("displacement"), "{other}");
    // Isotropic materials whose ν is not ¼ are reached to a share only, and the run says so.
    let mut problem = stretched([8, 5, 4], false);
    problem.regions[0].stiffness = Stiffness::isotropic(60e9, 20e9);
    assert!(Simulation::new(problem).unwrap().warnings()[0].contains("hybrid"));
}

/// Thin free bars of every built-in material come to equilibrium, and with calibrated surfaces in at most four times the iterations:
/// bonds are within a quarter of and four times what they are without.
#[test]
fn calibrated_surfaces_leave_nothing_loose() {
    for name in ["KIO3", "CoTeO4", "Te2W", "Ta2C", "Si", "MoN", "Spinel", "Pyroceram"] {
        for model in ["central", "hybrid"] {
            let iterations = [false, true].map(|surface| {
                let text = format!(
                    "name = 'bar'\nmaterial = '{name}'\n[body]\nbox = {{ size = '12, 5, 5 mm' }}\n[grid]\nspacing = '1 mm'\n\
                     horizon = 3\n[model]\nbonds = '{model}'\nsurface_calibration = {surface}\n[[condition]]\non = 'x-max'\n\
                     traction = '1, 0, 0 MPa'\n[[condition]]\non = 'x-min'\ntraction = '-1, 0, 0 MPa'\n[equilibrium]\n"
                );
                let case = CaseFile::parse(&text, "bar.toml", &[]).unwrap();
                let mut simulation = Simulation::new(case.problem().unwrap()).unwrap();
                simulation.advance().unwrap_or_else(|e| panic!("{name} {model} {surface}: {e}"));
                simulation.static_evidence().unwrap().report.iterations
            });
            println!("{name} {model}: {iterations:?}");
            assert!(iterations[1] <= 4 * iterations[0], "{name} {model}: {iterations:?}");
        }
    }
}
