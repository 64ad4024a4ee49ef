//! Only what was checked runs: every number of a problem made by hand is looked at, and what is wrong is named.

use crate::given::case as common;

use anisobond::bond_law::{BondLaw, BondState, ElasticPlastic};
use anisobond::experiment::{
    CellDrive, Condition, Crack, FractureEnergy, History, PackingProblem, PackingSimulation, Probe, Problem, Quantity,
    RunCost, Schedule, ServoPlan, Simulation, Slice,
};
use anisobond::tensor::Stiffness;
use common::{BLOCK, case, files, with};
use nalgebra::Vector3;

/// A law that does not know its energy.
#[derive(Debug)]
struct NoLaw;

impl BondLaw for NoLaw {
    fn energy_ratio(&self) -> f64 {
        f64::NAN
    }
    fn start(&self) -> BondState {
        BondState { history: 0.0, permanent: 0.0 }
    }
    fn after(&self, state: &BondState, _: f64) -> BondState {
        *state
    }
    fn secant(&self, _: &BondState) -> f64 {
        1.0
    }
    fn damage(&self, _: &BondState) -> f64 {
        0.0
    }
}

/// A change that spoils a problem, and words of the message.
type Spoiled<P> = (&'static str, fn(&mut P));

fn force(nodes: Vec<u32>, force: Vec<Vector3<f64>>, history: History) -> Condition {
    Condition::Force { nodes, force, history }
}

fn still(node: u32, value: f64) -> Condition {
    Condition::Displacement { nodes: vec![node], value: [Some(value), None, None], history: History::Constant }
}

fn probe(name: &str, nodes: Vec<u32>) -> Probe {
    Probe { name: name.into(), quantity: Quantity::Damage, nodes }
}

const GRID: [Spoiled<Problem>; 41] = [
    ("list one for each node", |p| p.body.region.truncate(7)),
    ("list one for each node", |p| p.body.region.push(1)),
    ("the body has no nodes", |p| p.body.region.fill(0)),
    ("a node is of region 2, but there are 1", |p| p.body.region[3] = 2),
    ("the grid has 0 ×", |p| p.body.grid.nodes[0] = 0),
    ("spacing = NaN", |p| p.body.grid.spacing = f64::NAN),
    ("the neighbourhood has a spacing", |p| p.body.grid.spacing *= 2.0),
    ("the origin of the grid", |p| p.body.grid.origin.y = f64::INFINITY),
    ("micropolar", |p| p.model = anisobond::calibration::Model::Micropolar),
    ("region body: the stiffness has a component that is no number", |p| {
        p.regions[0].stiffness = Stiffness::isotropic(f64::NAN, 1.0)
    }),
    ("not positive definite", |p| p.regions[0].stiffness = Stiffness::isotropic(1e9, -1e9)),
    ("a density of inf", |p| p.regions[0].density = f64::INFINITY),
    ("has no density", |p| p.regions[0].density = 0.0),
    ("a density of -1", |p| p.regions[0].density = -1.0),
    ("a fracture energy of -3", |p| p.regions[0].fracture = Some(FractureEnergy::Isotropic(-3.0))),
    ("a critical stretch of NaN", |p| p.regions[0].fracture = Some(FractureEnergy::Stretch(f64::NAN))),
    ("no fracture energy is given", |p| p.regions[0].fracture = Some(FractureEnergy::Directional(vec![]))),
    ("has length 2", |p| p.regions[0].fracture = Some(FractureEnergy::Directional(vec![(2.0 * Vector3::x(), 1.0)]))),
    ("bonds of a hybrid model yield", |p| {
        p.model = anisobond::calibration::Model::Hybrid;
        p.law = std::sync::Arc::new(ElasticPlastic::new(0.1, 5.0).unwrap());
    }),
    ("takes NaN times the energy", |p| p.law = std::sync::Arc::new(NoLaw)),
    ("condition 1: there is no node 240", |p| p.conditions.push(still(240, 0.0))),
    ("no number", |p| p.conditions.push(still(0, f64::NAN))),
    ("node 0 is outside the body", |p| {
        p.body.region[0] = 0;
        p.conditions.push(still(0, 1.0));
    }),
    ("1 forces for 2 nodes", |p| p.conditions.push(force(vec![0, 1], vec![Vector3::x()], History::Constant))),
    ("a force is no number", |p| p.conditions.push(force(vec![0], vec![Vector3::x() / 0.0], History::Constant))),
    ("let it begin before it ends", |p| {
        p.conditions.push(force(vec![0], vec![Vector3::x()], History::Ramp { start: 1.0, end: 1.0 }));
    }),
    ("do not ascend", |p| {
        p.conditions.push(force(vec![0], vec![Vector3::x()], History::Table(vec![(1.0, 0.0), (0.5, 1.0)])));
    }),
    ("table is empty", |p| p.conditions.push(force(vec![0], vec![Vector3::x()], History::Table(vec![])))),
    ("a velocity is prescribed", |p| {
        p.schedule = Schedule::Equilibrium { steps: 1, tolerance: 1e-8, relaxation: false };
        let value = [Some(1.0), None, None];
        p.conditions.push(Condition::Velocity { nodes: vec![0], value, history: History::Constant });
    }),
    ("initial velocity 1: there is no node 999", |p| p.initial_velocity.push((vec![999], Vector3::zeros()))),
    ("the velocity is no number", |p| p.initial_velocity.push((vec![0], Vector3::new(f64::NAN, 0.0, 0.0)))),
    ("unbreakable: there is no node 240", |p| p.unbreakable.push(240)),
    ("the probe has no nodes", |p| p.probes.push(probe("p", vec![]))),
    ("probe p: there is no node 4000000000", |p| p.probes.push(probe("p", vec![4_000_000_000]))),
    ("another probe has the same name", |p| p.probes.extend([probe("p", vec![0]), probe("p", vec![1])])),
    ("crack 1: the normal (0, 0, 3) has length 3", |p| {
        p.cracks.push(Crack::Disc { centre: Vector3::zeros(), normal: 3.0 * Vector3::z(), radius: 1.0 });
    }),
    ("it has no area", |p| {
        p.cracks.push(Crack::Parallelogram { corner: Vector3::zeros(), a: Vector3::x(), b: Vector3::x() });
    }),
    ("a duration of NaN", |p| {
        if let Schedule::Motion { duration, .. } = &mut p.schedule {
            *duration = f64::NAN;
        }
    }),
    ("in 0 load steps", |p| p.schedule = Schedule::Equilibrium { steps: 0, tolerance: 1e-8, relaxation: false }),
    ("probes every 0 steps", |p| p.output.probe_every = 0),
    ("a slice along axis 3", |p| {
        let field = p.output.fields[0];
        p.output.slices.push(Slice { axis: 3, position: None, field, component: None });
    }),
];

#[test]
fn problems_on_grids_are_checked_before_they_run() {
    let good = with("");
    assert_eq!(good.body.region.len(), 240);
    assert!(good.clone().checked().is_ok());
    for (words, spoil) in GRID {
        let mut problem = good.clone();
        spoil(&mut problem);
        let message = problem.clone().checked().expect_err(words).to_string();
        assert!(message.contains(words), "{words}: {message}");
        assert!(message.contains(';'), "no remedy: {message}");
        // Nothing that runs, or says what a run would take, does without.
        assert_eq!(RunCost::of(&problem).expect_err(words).to_string(), message);
        assert_eq!(Simulation::new(problem).err().expect(words).to_string(), message);
    }
}

const PACKING: [Spoiled<PackingProblem>; 12] = [
    ("volumes for", |p| p.volumes.truncate(3)),
    ("stands for NaN m³", |p| p.volumes[0] = f64::NAN),
    ("regions for", |p| p.region.push(0)),
    ("a sphere is of region 1", |p| p.region[0] = 1),
    ("origin", |p| p.origin.x = f64::NAN),
    ("there is no sphere 100000", |p| p.conditions.push(still(100_000, 0.0))),
    ("2 forces for 1 spheres", |p| p.conditions.push(force(vec![0], vec![Vector3::x(); 2], History::Constant))),
    ("the probe has no spheres", |p| p.probes.push(probe("p", vec![]))),
    ("local damping 1", |p| {
        if let Schedule::Motion { local_damping, .. } = &mut p.schedule {
            *local_damping = 1.0;
        }
    }),
    ("a stress, rate or moment is no number", |p| {
        let drives = [CellDrive::Rate(f64::NAN); 6];
        p.servo = Some(ServoPlan { drives, gain: 1.0, fastest: 1.0 });
    }),
    ("masses for", |p| p.model.mass.truncate(2)),
    ("has mass -1", |p| p.model.mass[4] = -1.0),
];

#[test]
fn problems_on_packings_are_checked_before_they_run() {
    let folder = files();
    let file = folder.path().join("spheres.txt");
    let text = BLOCK.split("[grid]").next().unwrap().split("[body]").next().unwrap().to_string()
        + &format!("[packing]\nfile = '{}'\ncontact_radius = 1.2\n[motion]\nduration = '1 us'\n", file.display());
    let good = case(&text).packing_problem().unwrap();
    assert!(good.clone().checked().is_ok());
    for (words, spoil) in PACKING {
        let mut problem = good.clone();
        spoil(&mut problem);
        let message = problem.cost().expect_err(words).to_string();
        assert!(message.contains(words) && message.contains(';'), "{words}: {message}");
        assert_eq!(PackingSimulation::new(problem).err().expect(words).to_string(), message);
    }
}
