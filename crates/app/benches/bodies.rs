//! Bodies on grids against closed forms: waves, beams, a pressurised hole, and how errors fall. Run with
//! `cargo bench -p anisobond-app --bench bodies [-- waves thin patch beam hole]`; `verification/bodies.sh` keeps what it prints.

use anisobond::calibration::{Model, ModelCalibrator, ModelSettings};
use anisobond::experiment::closed_forms::{Cantilever, PressurisedHole, bar_wave, plate_waves};
use anisobond::experiment::{Condition, FieldName, History, Problem, Simulation};
use anisobond::lattice::{Body, Grid, Influence, Neighbourhood};
use anisobond::operator::grid::{GridBonds, Stencil};
use anisobond::operator::{GridOperator, VectorField};
use anisobond::tensor::{Material, Stiffness};
use anisobond_app::CaseFile;
use nalgebra::{DMatrix, Matrix3, Vector3};

const SPACING: f64 = 1e-3;
const DENSITY: f64 = 2500.0;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let wanted = |name: &str| words.is_empty() || words.iter().any(|w| w == name);
    if wanted("waves") {
        plane_waves();
    }
    if wanted("thin") {
        thin_bodies();
    }
    if wanted("patch") {
        patch();
    }
    if wanted("beam") {
        beam();
    }
    if wanted("hole") {
        hole();
    }
}

/// log₂ of the ratio of two errors.
fn order(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).log2()
}

/// Bonds of a periodic block, and the stiffness that they reach.
fn periodic(nodes: [usize; 3], c: &Stiffness, hybrid: bool) -> (GridBonds<f64>, Stiffness) {
    let neighbourhood = Neighbourhood::sphere(3.0, SPACING, Influence::Inverse).expect("a neighbourhood");
    let settings = if hybrid { ModelSettings::Hybrid(None) } else { ModelSettings::central() };
    let material = ModelCalibrator::new(&neighbourhood, settings).and_then(|m| m.calibrate(c)).expect("a material");
    let mut stencil = Stencil::new(&neighbourhood, material.normal());
    stencil.nodal = material.nodal().copied().filter(|z| z.norm() > 0.0);
    let body = Body::full(Grid::new(nodes, SPACING, Vector3::zeros(), [true; 3]).expect("a grid"));
    let of_node = body.region.clone();
    let bonds = GridBonds::new(body, &neighbourhood, of_node, vec![stencil]).expect("bonds");
    let reached = bonds.bulk_stiffness(0);
    (bonds, reached)
}

/// Speeds (m/s), slowest first, of the three standing plane waves that a periodic block holds once along each axis of more
/// than one node: forces of u = e_a cos k·x are −K(k) e_a cos k·x.
fn speeds(bonds: &GridBonds<f64>) -> [f64; 3] {
    let grid = &bonds.body().grid;
    let k = Vector3::from_fn(|a, _| {
        if grid.nodes[a] > 1 { 2.0 * std::f64::consts::PI / (grid.nodes[a] as f64 * SPACING) } else { 0.0 }
    });
    let mut f = VectorField::zeros(grid.len());
    let columns = [0, 1, 2].map(|a| {
        let mut u = VectorField::zeros(grid.len());
        for node in 0..grid.len() {
            u.components[a][node] = k.dot(&(grid.position(node) - grid.position(0))).cos();
        }
        bonds.forces(&u, &mut f);
        -f.at(0)
    });
    let mass = DENSITY * SPACING.powi(3);
    let mut values: Vec<f64> = Matrix3::from_columns(&columns).symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(f64::total_cmp);
    [0, 1, 2].map(|i| (values[i] / mass).sqrt() / k.norm())
}

/// Plane waves of all materials: largest relative error of the three speeds along x, xy and xyz at 12, 24 and 48 spacings
/// per period along the axes, against Christoffel's of the tensor that the bonds reach, and the order of its fall.
fn plane_waves() {
    println!("Plane waves in periodic blocks, horizon 3 spacings, periods of 12, 24 and 48 spacings along each axis:");
    println!("largest relative error of the three speeds against Christoffel's of the tensor that the bonds reach\n");
    println!("material   model    along     12        24        48     order   reached tensor's own error");
    for name in Material::builtin_names() {
        let c = Material::builtin(name).expect("a built-in material").stiffness;
        for hybrid in [false, true] {
            for (along, axes) in [("x", [true, false, false]), ("xy", [true, true, false]), ("xyz", [true; 3])] {
                let mut reached = c;
                let errors = [12, 24, 48].map(|n| {
                    let (bonds, tensor) = periodic(axes.map(|long| if long { n } else { 1 }), &c, hybrid);
                    reached = tensor;
                    let n = Vector3::from(axes.map(|long| if long { 1.0 } else { 0.0 }));
                    let exact = reached.waves(&n, DENSITY).expect("waves").map(|w| w.speed);
                    let pairs = speeds(&bonds).into_iter().zip(exact);
                    pairs.map(|(speed, exact)| (speed / exact - 1.0).abs()).fold(0.0, f64::max)
                });
                let [a, b, d] = errors;
                let model = if hybrid { "hybrid" } else { "central" };
                let gap = c.relative_error(&reached);
                println!("{name:10} {model:8} {along:5} {a:9.2e} {b:9.2e} {d:9.2e}  {:5.2}   {gap:.1e}", order(b, d));
            }
        }
    }
    println!();
}

/// A problem of full bodies without conditions.
fn problem(nodes: [usize; 3], periodic: [bool; 3], c: &Stiffness, surface: bool, text: &str) -> Problem {
    let size = nodes.map(|n| n.to_string()).join(", ");
    let case = format!(
        "name = 'bodies'\nmaterial = 'Pyroceram'\ndensity = '{DENSITY} kg/m3'\n[body]\nbox = {{ size = '{size} mm' }}\n\
         [grid]\nspacing = '1 mm'\nhorizon = 3\n[model]\nbonds = 'hybrid'\nsurface_calibration = {surface}\n{text}"
    );
    let mut problem = CaseFile::parse(&case, "bodies.toml", &[]).and_then(|case| case.problem()).expect("a problem");
    let grid = &problem.body.grid;
    assert_eq!(grid.nodes, nodes);
    problem.body.grid = Grid::new(nodes, grid.spacing, grid.origin, periodic).expect("a grid");
    problem.regions[0].stiffness = *c;
    problem
}

/// Speed (m/s) of the standing wave cos kx of velocity along p: from the first two zeros of the velocity's projection, with
/// the period 2 (t₂ − t₁).
fn standing_speed(mut problem: Problem, p: &Vector3<f64>, speed: f64) -> f64 {
    let grid = problem.body.grid.clone();
    let k = 2.0 * std::f64::consts::PI / (grid.nodes[0] as f64 * grid.spacing);
    let shape: Vec<f64> = (0..grid.len()).map(|node| (k * grid.position(node).x).cos()).collect();
    problem.initial_velocity = (0..grid.len()).map(|node| (vec![node as u32], shape[node] * 1e-3 * p)).collect();
    let period = 2.0 * std::f64::consts::PI / (k * speed);
    if let anisobond::experiment::Schedule::Motion { duration, .. } = &mut problem.schedule {
        *duration = 2.0 * period;
    }
    let mut simulation = Simulation::new(problem).expect("a simulation");
    let step = simulation.step_evidence().expect("a motion").step;
    let project = |simulation: &Simulation| {
        let v = simulation.velocity();
        (0..shape.len()).map(|node| shape[node] * v.at(node).dot(p)).sum::<f64>()
    };
    let (mut last, mut zeros) = (project(&simulation), Vec::new());
    while zeros.len() < 3 && !simulation.finished() {
        simulation.advance().expect("a step");
        let now = project(&simulation);
        if last * now < 0.0 {
            zeros.push(simulation.time() - step + step * last / (last - now));
        }
        last = now;
    }
    2.0 * std::f64::consts::PI / ((zeros[2] - zeros[0]) * k)
}

/// Bars of 6 × 6 and plates of 6 nodes' thickness, a period of 120 spacings.
fn thin_bodies() {
    println!(
        "Long waves in thin bars (6 × 6 nodes) and plates (6 nodes), period 120 spacings, horizon 3, model hybrid:"
    );
    println!("speed over the closed form's, less 1, without and with calibration of truncated neighbourhoods\n");
    println!("material    bar √(E/ρ)      off        on    plate fast      off        on");
    let motion = "[motion]\nduration = '1 us'\nsafety = 0.8\n";
    for name in Material::builtin_names() {
        let c = Material::builtin(name).expect("a built-in material").stiffness;
        let bar = bar_wave(&c, DENSITY, &Vector3::x()).expect("a bar");
        let plate = plate_waves(&c, DENSITY, &Vector3::x(), &Vector3::z()).expect("a plate")[1];
        let of = |nodes, periodic, p: &Vector3<f64>, exact, surface| {
            standing_speed(problem(nodes, periodic, &c, surface, motion), p, exact) / exact - 1.0
        };
        let bars = [false, true].map(|on| of([120, 6, 6], [true, false, false], &Vector3::x(), bar, on));
        let p = plate_polarisation(&c);
        let plates = [false, true].map(|on| of([120, 1, 6], [true, true, false], &p, plate, on));
        println!(
            "{name:10} {bar:7.0} m/s {:+9.4} {:+9.4}   {plate:7.0} m/s {:+9.4} {:+9.4}",
            bars[0], bars[1], plates[0], plates[1]
        );
    }
    println!();
}

/// Polarisation of the fast wave along x in a thin plate of normal z.
fn plate_polarisation(c: &Stiffness) -> Vector3<f64> {
    let block = |j: usize, l: usize| Matrix3::from_fn(|i, k| c.component(i, j, k, l));
    let (q, r, t) = (block(0, 0), block(0, 2), block(2, 2));
    let reduced = q - r * t.try_inverse().expect("a positive definite tensor") * r.transpose();
    let eigen = (0.5 * (reduced + reduced.transpose())).symmetric_eigen();
    eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned()
}

/// A bar of n × n × 3n nodes under tension, free: its longitudinal strain and its contraction over those of compliance, less 1,
/// from the mean displacement gradient of its middle third.
fn patch_errors(n: usize, c: &Stiffness, surface: bool) -> [f64; 2] {
    let text = "[[condition]]\non = 'z-max'\ntraction = '0, 0, 1 MPa'\n[[condition]]\non = 'z-min'\n\
                traction = '0, 0, -1 MPa'\n[equilibrium]\ntolerance = 1e-9\n";
    let mut simulation = Simulation::new(problem([n, n, 3 * n], [false; 3], c, surface, text)).expect("a simulation");
    simulation.advance().expect("an equilibrium");
    let (u, grid) = (simulation.displacement(), &simulation.problem().body.grid);
    let middle: Vec<usize> = (0..grid.len()).filter(|&i| (n..2 * n).contains(&grid.coordinates(i)[2])).collect();
    let count = middle.len() as f64;
    let centre = middle.iter().map(|&i| grid.position(i)).sum::<Vector3<f64>>() / count;
    let mean = middle.iter().map(|&i| u.at(i)).sum::<Vector3<f64>>() / count;
    let (mut ux, mut xx) = (Matrix3::zeros(), Matrix3::zeros());
    for &i in &middle {
        let x = grid.position(i) - centre;
        ux += (u.at(i) - mean) * x.transpose();
        xx += x * x.transpose();
    }
    let gradient = ux * xx.try_inverse().expect("a body of three dimensions");
    let s = c.compliance_voigt().expect("a positive definite tensor");
    let along = gradient[(2, 2)] / (s[(2, 2)] * 1e6) - 1.0;
    let across = (gradient[(0, 0)] + gradient[(1, 1)]) / ((s[(0, 2)] + s[(1, 2)]) * 1e6) - 1.0;
    [along, across]
}

/// The patch test of a finite block.
fn patch() {
    println!(
        "Patch test: a free bar of n × n × 3n nodes under uniform tractions on its ends, horizon 3 spacings, model hybrid:"
    );
    println!("mean strain along and contraction across its middle third over the compliance's, less 1\n");
    println!("material         n      along off        on    across off        on");
    let glass = Stiffness::isotropic(28e9, 28e9);
    let mon = Material::builtin("MoN").expect("a built-in material").stiffness;
    // Its plate modulus is 3.9 times Young's modulus along x: an error of the contraction counts so many times.
    let coteo4 = Material::builtin("CoTeO4").expect("a built-in material").stiffness;
    let turned = coteo4.rotated(&Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0));
    for (name, c) in [("isotropic ν ¼", glass), ("MoN", mon), ("CoTeO4, x", turned)] {
        for n in [8, 16, 32] {
            let [off, on] = [false, true].map(|surface| patch_errors(n, &c, surface));
            println!("{name:14} {n:3}      {:+.2e} {:+.2e}     {:+.2e} {:+.2e}", off[0], on[0], off[1], on[1]);
        }
    }
    println!();
}

/// Prescribe a field of displacements (m) on nodes.
fn prescribe(problem: &mut Problem, nodes: impl Iterator<Item = usize>, field: impl Fn(&Vector3<f64>) -> Vector3<f64>) {
    for node in nodes {
        let u = field(&problem.body.grid.position(node));
        problem.conditions.push(Condition::Displacement {
            nodes: vec![node as u32],
            value: [Some(u.x), Some(u.y), Some(u.z)],
            history: History::Constant,
        });
    }
}

/// A cantilever of length 4 times its height in plane strain, its root prescribed and its end under the closed form's
/// traction: relative error of the deflection of the middle of the end. Height over spacing, and horizon over spacing.
fn cantilever_error(height: usize, m: f64, c: &Stiffness, surface: bool) -> f64 {
    let text = "[equilibrium]\ntolerance = 1e-9\n";
    let mut problem = problem([4 * height, height, 1], [false, false, true], c, surface, text);
    problem.neighbourhood =
        Neighbourhood::sphere(m, problem.body.grid.spacing, Influence::Inverse).expect("a neighbourhood");
    let (length, half) = (4.0 * height as f64 * SPACING, 0.5 * height as f64 * SPACING);
    let beam = Cantilever::new(c, length, half, 1e3, true).expect("a cantilever");
    let origin = problem.body.grid.position(0) - Vector3::new(0.5, 0.5, 0.0) * SPACING;
    let exact = |x: &Vector3<f64>| {
        let [u, v] = beam.displacement([x.x - origin.x, x.y - origin.y - half]);
        Vector3::new(u, v, 0.0)
    };
    let grid = problem.body.grid.clone();
    let root = (0..grid.len()).filter(|&node| grid.coordinates(node)[0] < m.ceil() as usize);
    prescribe(&mut problem, root, exact);
    let nodes: Vec<u32> = (0..height).map(|j| grid.index([grid.nodes[0] - 1, j, 0]) as u32).collect();
    let force = nodes.iter().map(|&node| {
        let y = grid.position(node as usize).y - origin.y - half;
        Vector3::new(0.0, beam.stress([length, y])[1], 0.0) * SPACING * SPACING
    });
    let force = force.collect();
    problem.conditions.push(Condition::Force { nodes: nodes.clone(), force, history: History::Constant });
    let mut simulation = Simulation::new(problem).expect("a simulation");
    simulation.advance().expect("an equilibrium");
    let u = simulation.displacement();
    let middle = [nodes[height / 2 - 1], nodes[height / 2]].map(|node| node as usize);
    let deflection = |u: &dyn Fn(usize) -> f64| 0.5 * middle.iter().map(|&node| u(node)).sum::<f64>();
    deflection(&|node| u.at(node).y) / deflection(&|node| exact(&grid.position(node)).y) - 1.0
}

fn beam() {
    println!(
        "Cantilever 4 : 1 in plane strain, root prescribed, end under the closed form's traction, faces free, model hybrid:"
    );
    println!(
        "deflection of the end over the closed form's, less 1, without and with calibration of truncated neighbourhoods\n"
    );
    let glass = Stiffness::isotropic(28e9, 28e9);
    let mut turned = Material::builtin("MoN").expect("a built-in material").stiffness;
    turned = turned.rotated(&Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0));
    for (name, c) in [("isotropic", glass), ("MoN, axis turned", turned)] {
        println!("{name}, δ → 0 at δ = 3 Δ");
        println!("height/Δ      off    order        on    order");
        let mut last: Option<[f64; 2]> = None;
        for height in [12, 24, 48, 96] {
            let errors = [false, true].map(|on| cantilever_error(height, 3.0, &c, on));
            let order_of =
                |i: usize| last.map_or(String::new(), |l| format!("{:.2}", order(l[i].abs(), errors[i].abs())));
            println!("{height:8} {:+9.2e} {:>6} {:+9.2e} {:>6}", errors[0], order_of(0), errors[1], order_of(1));
            last = Some(errors);
        }
        println!("{name}, δ = height/8 fixed, m = δ/Δ grows");
        println!("m             off        on");
        for m in [2, 3, 4, 6] {
            let errors = [false, true].map(|on| cantilever_error(8 * m, m as f64, &c, on));
            println!("{m:<8} {:+9.2e} {:+9.2e}", errors[0], errors[1]);
        }
        println!();
    }
}

/// The pressurised hole in the document's rock.
fn hole() {
    println!(
        "Circular hole (radius a) under pressure in transversely isotropic rock, its axis y in the section, plane strain,"
    );
    println!("model hybrid, horizon 3 spacings, a square of 8 a with the closed form's displacement at its edges.");
    println!("Wall: nodes nearest to (a, 0) and (0, a), against the closed form there; ring: 1.4 a < r < 2 a\n");
    println!("a/Δ  surface  nodes   u_x −1      u_y −1      (u_y/u_x) −1   ‖u‖ ring    σ_θθ ring");
    let mut hoops = Vec::new();
    for surface in [false, true] {
        let mut last: Option<[f64; 2]> = None;
        let on = if surface { "on" } else { "off" };
        for per_radius in [10, 20, 40, 80] {
            let hole = Hole::new(per_radius, surface);
            let (wall, ring) = (hole.wall(), hole.ring());
            let orders = last.map_or(String::new(), |l| {
                format!("   orders {:.2} {:.2}", order(l[0], ring[0]), order(l[1], ring[1]))
            });
            println!(
                "{per_radius:3}  {on:7} {:6}  {:+.3e}  {:+.3e}  {:+.3e}     {:.3e}   {:.3e}{orders}",
                hole.simulation.problem().body.nodes(),
                wall[0],
                wall[1],
                wall[2],
                ring[0],
                ring[1]
            );
            last = Some(ring);
            hoops.push((per_radius, on, hole.hoop()));
        }
    }
    print_hoops(&hoops);
}

/// Angles (degrees) at which the hoop stress is looked at.
const ANGLES: [f64; 7] = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0];

/// Places (radii of the hole) at which it is looked at.
const RADII: [f64; 3] = [1.1, 1.2, 1.4];

/// Hoop stress over pressure, measured and exact, by radius and angle.
type Hoop = [[[f64; 2]; 7]; 3];

fn print_hoops(hoops: &[(usize, &str, Hoop)]) {
    println!(
        "\nHoop stress over pressure on circles around the hole, from displacement gradients (a quadratic through the nodes"
    );
    println!("within 2.2 spacings), and its largest error over these angles\n");
    println!("r/a   a/Δ surface      {}   largest error", ANGLES.map(|a| format!("{a:5}°")).join(" "));
    let row = |values: [f64; 7]| values.map(|v| format!("{v:6.3}")).join(" ");
    for (i, radius) in RADII.iter().enumerate() {
        let mut last: Option<(&str, f64)> = None;
        for (per_radius, on, hoop) in hoops {
            let error = hoop[i].iter().map(|[found, exact]| (found / exact - 1.0).abs()).fold(0.0, f64::max);
            let order = last.filter(|(of, _)| of == on).map(|(_, l)| format!("   order {:.2}", order(l, error)));
            let values = row(hoop[i].map(|[found, _]| found));
            println!("{radius:3}   {per_radius:3} {on:7}      {values}   {error:.1e}{}", order.unwrap_or_default());
            last = Some((on, error));
        }
        if let Some((_, _, hoop)) = hoops.first() {
            println!("{radius:3}   closed form      {}", row(hoop[i].map(|[_, exact]| exact)));
        }
    }
    println!();
}

/// A pressurised hole of radius 1 m, p = 1 MPa, in equilibrium.
struct Hole {
    simulation: Simulation,
    displacement: VectorField,
    exact: PressurisedHole,
    stiffness: Stiffness,
}

const PRESSURE: f64 = 1e6;

impl Hole {
    fn new(per_radius: usize, surface: bool) -> Self {
        let text = format!(
            "name = 'hole'\nmaterial = {{ class = 'transversely-isotropic', unit = 'MPa', axis = [0, 1, 0], c11 = 130, c33 = 55, \
             c13 = 28, c12 = 40, c44 = 32.25 }}\n[solids.hole]\ncylinder = {{ axis = 'z', radius = '1 m' }}\n[body]\n\
             difference = [{{ box = {{ size = '8, 8, 8 m' }} }}, 'hole']\n[grid]\nspacing = '{} m'\nhorizon = 3\n\
             plane_strain = 'z'\n[model]\nbonds = 'hybrid'\nsurface_calibration = {surface}\n[[condition]]\non = 'hole'\n\
             pressure = '1 MPa'\n[equilibrium]\ntolerance = 1e-9\n",
            1.0 / per_radius as f64
        );
        let case = CaseFile::parse(&text, "hole.toml", &[]).expect("a case");
        let mut problem = case.problem().expect("a problem");
        assert_eq!(problem.model, Model::Hybrid);
        let stiffness = problem.regions[0].stiffness;
        let exact = PressurisedHole::new(&stiffness, 1.0, PRESSURE).expect("a hole");
        let grid = problem.body.grid.clone();
        let edges = (0..grid.len()).filter(|&node| {
            let at = grid.coordinates(node);
            (0..2).any(|a| at[a] < 3 || at[a] + 3 >= grid.nodes[a])
        });
        prescribe(&mut problem, edges, |x| exact.displacement([x.x, x.y]));
        let mut simulation = Simulation::new(problem).expect("a simulation");
        simulation.advance().expect("an equilibrium");
        let displacement = simulation.displacement();
        Hole { simulation, displacement, exact, stiffness }
    }

    /// Material nodes within a distance (m) of a point of the section.
    fn near(&self, to: [f64; 2], distance: f64) -> Vec<usize> {
        let body = &self.simulation.problem().body;
        let within = |n: &usize| {
            let x = body.grid.position(*n);
            (x.x - to[0]).hypot(x.y - to[1]) < distance
        };
        (0..body.grid.len()).filter(|n| body.has(*n) && within(n)).collect()
    }

    /// Relative errors of u_x at (a, 0), u_y at (0, a) and their ratio, at the nearest nodes.
    fn wall(&self) -> [f64; 3] {
        let grid = &self.simulation.problem().body.grid;
        let at = |to: [f64; 2], axis: usize| {
            let distance = |n: &usize| {
                let x = grid.position(*n);
                (x.x - to[0]).hypot(x.y - to[1])
            };
            let nearest =
                self.near(to, 2.0 * grid.spacing).into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let node = nearest.expect("a node at the wall");
            let x = grid.position(node);
            (self.displacement.at(node)[axis], self.exact.displacement([x.x, x.y])[axis])
        };
        let (x, y) = (at([1.0, 0.0], 0), at([0.0, 1.0], 1));
        [x.0 / x.1 - 1.0, y.0 / y.1 - 1.0, (y.0 / x.0) / (y.1 / x.1) - 1.0]
    }

    /// Root mean square errors of displacement and hoop stress (of the virial) on the ring 1.4 a < r < 2 a.
    fn ring(&self) -> [f64; 2] {
        let body = &self.simulation.problem().body;
        let (_, stress) = self.simulation.field(FieldName::Virial);
        let mut sums = [0.0; 4];
        for node in (0..body.grid.len()).filter(|n| body.has(*n)) {
            let p = body.grid.position(node);
            let r = p.x.hypot(p.y);
            if !(1.4..2.0).contains(&r) {
                continue;
            }
            let wanted = self.exact.displacement([p.x, p.y]);
            sums[0] += (self.displacement.at(node) - wanted).norm_squared();
            sums[1] += wanted.norm_squared();
            let own = hoop_of([0, 1, 3].map(|i| f64::from(stress[6 * node + i])), [p.x, p.y]);
            let wanted = self.exact_hoop([p.x, p.y]);
            sums[2] += (own - wanted).powi(2);
            sums[3] += wanted * wanted;
        }
        [(sums[0] / sums[1]).sqrt(), (sums[2] / sums[3]).sqrt()]
    }

    fn exact_hoop(&self, x: [f64; 2]) -> f64 {
        let s = self.exact.stress(x);
        hoop_of([s[(0, 0)], s[(1, 1)], s[(0, 1)]], x)
    }

    /// Hoop stress (Pa) at a point from the gradient of the quadratic that fits the displacements around it best.
    fn fitted_hoop(&self, x: [f64; 2]) -> f64 {
        let grid = &self.simulation.problem().body.grid;
        let nodes = self.near(x, 2.2 * grid.spacing);
        let offset = |n: usize| {
            let p = grid.position(n);
            [(p.x - x[0]) / grid.spacing, (p.y - x[1]) / grid.spacing]
        };
        let rows = DMatrix::from_fn(nodes.len(), 6, |r, c| {
            let [dx, dy] = offset(nodes[r]);
            [1.0, dx, dy, dx * dx, dx * dy, dy * dy][c]
        });
        let values = DMatrix::from_fn(nodes.len(), 3, |r, c| self.displacement.at(nodes[r])[c]);
        let fit = rows.svd(true, true).solve(&values, 1e-12).expect("both factors");
        let gradient = Matrix3::from_fn(|i, j| if j < 2 { fit[(1 + j, i)] / grid.spacing } else { 0.0 });
        let stress = |i: usize, j: usize| -> f64 {
            (0..9).map(|n| self.stiffness.component(i, j, n / 3, n % 3) * gradient[(n / 3, n % 3)]).sum()
        };
        hoop_of([stress(0, 0), stress(1, 1), stress(0, 1)], x)
    }

    fn hoop(&self) -> Hoop {
        RADII.map(|r| {
            ANGLES.map(|angle| {
                let (sin, cos) = f64::to_radians(angle).sin_cos();
                let at = [r * cos, r * sin];
                [self.fitted_hoop(at) / PRESSURE, self.exact_hoop(at) / PRESSURE]
            })
        })
    }
}

/// σ_θθ at a point of (σ_xx, σ_yy, σ_xy).
fn hoop_of(s: [f64; 3], [x, y]: [f64; 2]) -> f64 {
    (s[0] * y * y + s[1] * x * x - 2.0 * s[2] * x * y) / (x * x + y * y)
}
