//! Spheres in motion: bond updates per second and scaling with their number.
//! Run with `cargo bench -p anisobond-app --bench particles [-- PARTS] [--packing FILE]`; parts: `kernel` (forces alone, one
//! thread and all), `step` (a whole step), `scaling` (to 10⁶ spheres, with the fitted exponent), `static` (the static
//! element test). Without a packing file the reference packing beside the checkout is used.
//!
//! `--yade` and `--lammps` run those on the same packing and bonds beside it (`verification/peers/yade_packing.py` by `yade`,
//! `verification/peers/lammps_bpm.py` by the Python in `LAMMPS_PYTHON`) and print how many times as fast the part is.

use std::time::Instant;

use anisobond::calibration::{EllipticFit, LatticeStiffness, TransverseConstants};
use anisobond::experiment::element_test::ElementTest;
use anisobond::experiment::particles::{MotionPlan, ParticleMotion};
use anisobond::lattice::{Lattice, Packing};
use anisobond::operator::particles::{ParticleModel, Particles, Strength, bulk_masses};
use anisobond::operator::{Kinematics, Network};
use anisobond::solver::particles::Acting;
use anisobond_formats::read_packing;
use nalgebra::Vector3;

/// Seconds of several runs: of the fastest by the clock, and on average of processor time of all threads (where Linux
/// tells), which counts on a machine that others use.
fn fastest(runs: usize, mut run: impl FnMut()) -> [f64; 2] {
    let (mut fastest, used) = (f64::INFINITY, processor_time());
    for _ in 0..runs {
        let start = Instant::now();
        run();
        fastest = fastest.min(start.elapsed().as_secs_f64());
    }
    [fastest, (processor_time() - used) / runs as f64]
}

/// Seconds that all threads of this process have run, in hundredths.
fn processor_time() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // After the name in brackets: user and system time are the 12th and 13th numbers, in hundredths of a second.
    let numbers: Vec<&str> = stat.rsplit(')').next().unwrap_or("").split_whitespace().collect();
    let hundredths = |i: usize| numbers.get(i).and_then(|x| x.parse::<f64>().ok()).unwrap_or(f64::NAN);
    0.01 * (hundredths(11) + hundredths(12))
}

/// The packing's file.
fn path() -> String {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/woo-packing-2556.txt");
    let mut given = std::env::args().skip_while(|a| a != "--packing").skip(1);
    given.next().unwrap_or_else(|| beside.to_string())
}

fn packing() -> Packing {
    read_packing(path()).expect("a valid packing")
}

/// The packing tiled, with the document's stiffnesses.
fn network(copies: [usize; 3]) -> (Lattice, Network) {
    let constants = TransverseConstants { c11: 130e6, c33: 55e6, c13: 28e6, c12: 40e6 };
    let fit = EllipticFit::new(&constants.stiffness(&Vector3::z()), &Vector3::z()).expect("an admissible rock");
    let lattice = Lattice::new(packing(), 1.8).and_then(|l| l.tiled(copies)).expect("a valid lattice");
    let stiffness = LatticeStiffness::new(&lattice, &fit.microplane).expect("positive moduli");
    let network = Network::new(&lattice, &stiffness);
    (lattice, network)
}

/// Spheres that vibrate a little.
fn moving(copies: [usize; 3], kinematics: Kinematics, breakable: bool) -> Particles {
    let (lattice, network) = network(copies);
    let mass = bulk_masses(&lattice.packing, lattice.volume, 2500.0);
    let mut model = ParticleModel::elastic(lattice.packing, &network, mass, kinematics);
    if breakable {
        let strong = Strength { tension: 1e12, cohesion: 1e12, friction_angle: 0.5 };
        model.strength = Some(vec![strong; model.bonds.len()]);
    }
    let mut particles = Particles::new(model).expect("a sound model");
    for i in 0..particles.len() {
        let phase = i as f64;
        particles.move_by(i, &(1e-5 * Vector3::new(phase.sin(), (2.0 * phase).sin(), (3.0 * phase).sin())));
        particles.turn_by(i, &(1e-4 * Vector3::new((1.5 * phase).sin(), (2.5 * phase).sin(), (3.5 * phase).sin())));
    }
    particles
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool")
}

fn kernel() {
    println!("forces alone, {} bytes per bond", Particles::BYTES_PER_BOND);
    for copies in [[1, 1, 1], [2, 2, 2], [4, 4, 3]] {
        for (name, kinematics, breakable) in [
            ("linear", Kinematics::Linear, false),
            ("finite", Kinematics::Finite, false),
            ("finite, breakable", Kinematics::Finite, true),
        ] {
            let mut particles = moving(copies, kinematics, breakable);
            let bonds = particles.model().bonds.len();
            let runs = (20_000_000 / bonds).clamp(10, 2000);
            for threads in [1, rayon::current_num_threads()] {
                let [clock, used] = pool(threads).install(|| fastest(runs, || drop(particles.evaluate(0.0))));
                println!(
                    "{:8} spheres {bonds:9} bonds {name:18} {threads} threads: {:8.3} ms, {:6.1}e6 bonds/s; \
                     {:6.1}e6 per second of a core",
                    particles.len(),
                    1e3 * clock,
                    1e-6 * bonds as f64 / clock,
                    1e-6 * bonds as f64 / used
                );
            }
        }
    }
}

/// Spheres, bonds, bytes of the bonds' rows, seconds of a step.
fn stepped(copies: [usize; 3], threads: usize, steps: usize) -> (usize, usize, usize, [f64; 2]) {
    let particles = moving(copies, Kinematics::Finite, false);
    let (spheres, bonds, bytes) = (particles.len(), particles.model().bonds.len(), particles.bond_bytes());
    pool(threads).install(|| {
        let free = |_: &Particles, _: f64, _: f64| Acting::default();
        let mut motion = ParticleMotion::new(particles, &MotionPlan::default(), free).expect("a sound plan");
        let seconds = fastest(steps, || motion.advance(free).expect("a stable step"));
        (spheres, bonds, bytes, seconds)
    })
}

fn step() {
    println!("whole steps (finite): kick, drift, forces, energies");
    for threads in [1, rayon::current_num_threads()] {
        for copies in [[1, 1, 1], [2, 2, 2]] {
            let (spheres, bonds, _, [clock, used]) = stepped(copies, threads, 50);
            println!(
                "{spheres:8} spheres {threads} threads: {:8.3} ms, {:6.1}e6 bonds/s; {:6.1}e6 per second of a core",
                1e3 * clock,
                1e-6 * bonds as f64 / clock,
                1e-6 * bonds as f64 / used
            );
        }
    }
}

fn spheres_of(copies: [usize; 3]) -> usize {
    packing().len() * copies.iter().product::<usize>()
}

fn scaling() {
    println!("scaling, one thread");
    let mut points = Vec::new();
    for copies in [[1, 1, 1], [2, 1, 1], [2, 2, 1], [2, 2, 2], [4, 2, 2], [4, 4, 2], [4, 4, 4], [6, 6, 5], [8, 7, 7]] {
        // A second or so: processor time is told in hundredths.
        let (spheres, bonds, bytes, [_, used]) = stepped(copies, 1, (4_000_000 / spheres_of(copies)).max(8));
        println!(
            "{spheres:8} spheres: {:9.3} ms, {:6.1}e6 bonds/s of a core, {:5.1} bytes per bond",
            1e3 * used,
            1e-6 * bonds as f64 / used,
            bytes as f64 / bonds as f64
        );
        points.push(((spheres as f64).ln(), used.ln()));
    }
    let n = points.len() as f64;
    let mean = points.iter().fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
    let (xy, xx) =
        points.iter().fold((0.0, 0.0), |s, p| (s.0 + (p.0 - mean.0) * (p.1 - mean.1), s.1 + (p.0 - mean.0).powi(2)));
    println!("time of a step ~ spheres^{:.3}", xy / xx);
}

fn statics() {
    let (_, network) = network([1, 1, 1]);
    for threads in [1, rayon::current_num_threads()] {
        let [clock, used] = pool(threads)
            .install(|| fastest(5, || drop(ElementTest::default().run(&network).expect("a sound lattice"))));
        println!(
            "static element test, six cases, {threads} threads: {:.1} ms, {:.1} ms of a core (Yade relaxes one in 6 s)",
            1e3 * clock,
            1e3 * used
        );
    }
}

/// What a peer took for the reference packing.
struct Peer {
    name: String,
    bonds: f64,
    /// Seconds of a step by the clock, and of processor time.
    step: [f64; 2],
    /// Seconds of a static element test by relaxation, likewise, and C33 (Pa) that it measured.
    test: Option<([f64; 2], f64)>,
}

fn script(name: &str) -> String {
    format!("{}/../../verification/peers/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// The words or the document that a peer's last line holds.
fn last_line(command: &mut std::process::Command) -> Option<String> {
    let output = command.output().ok()?;
    String::from_utf8(output.stdout).ok()?.lines().last().map(str::to_string)
}

/// Yade with the bonds of the packing; `None` where it cannot be run.
fn yade(network: &Network, law: &str, threads: usize) -> Option<Peer> {
    let bonds: String =
        network.bonds.iter().map(|b| format!("{} {} {} {}\n", b.a, b.b, b.normal, b.tangential)).collect();
    let file = tempfile::NamedTempFile::new().ok()?;
    std::fs::write(file.path(), bonds).ok()?;
    let mut command = std::process::Command::new("yade");
    command.args(["-n", "-x", &format!("-j{threads}"), &script("yade_packing.py"), &path()]);
    let line = last_line(command.arg(file.path()).arg(law))?;
    let answer: serde_json::Value = serde_json::from_str(line.strip_prefix("yade ")?).ok()?;
    let number = |key: &str| answer[key].as_f64();
    Some(Peer {
        name: format!("Yade, {law}, {threads} threads"),
        bonds: number("interactions")?,
        step: [number("step_s")?, number("step_core_s")?],
        test: Some(([number("test_s")?, number("test_core_s")?], number("C33_Pa")?)),
    })
}

/// LAMMPS' bpm/rotational in one process; `None` where it cannot be run.
fn lammps() -> Option<Peer> {
    let python = std::env::var("LAMMPS_PYTHON").unwrap_or_else(|_| "python3".into());
    let mut command = std::process::Command::new(python);
    let line = last_line(command.args([&script("lammps_bpm.py"), &path(), "1", "40"]).env("OMP_NUM_THREADS", "1"))?;
    let numbers: Vec<f64> = line.split_whitespace().filter_map(|x| x.parse().ok()).collect();
    let [_, bonds, _, step, ..] = numbers[..] else { return None };
    Some(Peer { name: "LAMMPS, bpm/rotational, 1 thread".into(), bonds, step: [step, step], test: None })
}

/// The peers beside ours, whole steps and a static element test, on the reference packing.
fn peers(asked: impl Fn(&str) -> bool) {
    let (_, network) = network([1, 1, 1]);
    let ours = [1, 2].map(|threads| stepped([1, 1, 1], threads, 1000).3);
    let test = pool(1).install(|| fastest(5, || drop(ElementTest::default().run(&network).expect("a sound lattice"))));
    let measured = ElementTest::default().run(&network).expect("a sound lattice").measured;
    let mut rows = Vec::new();
    if asked("--yade") {
        let runs = [("cohfrict", 1), ("cpm", 1), ("cohfrict", 2)]
            .map(|(law, threads)| (yade(&network, law, threads), threads));
        rows.extend(runs);
    }
    if asked("--lammps") {
        rows.push((lammps(), 1));
    }
    if rows.iter().any(|row| row.0.is_none()) {
        println!("a peer is not here or did not run: see verification/peers");
    }
    for (peer, threads) in rows.into_iter().filter_map(|(peer, threads)| Some((peer?, threads))) {
        let Peer { name, bonds, step, test: relaxed } = peer;
        let rate = |seconds: f64, bonds: f64| 1e-6 * bonds / seconds;
        let own = ours[threads - 1];
        let n = network.bonds.len() as f64;
        println!(
            "{name}: {:.2}e6 bonds/s, {:.2}e6 per second of a core; ours {:.1}e6, {:.1}e6: {:.0}, {:.0} times as many",
            rate(step[0], bonds),
            rate(step[1], bonds),
            rate(own[0], n),
            rate(own[1], n),
            rate(own[0], n) / rate(step[0], bonds),
            rate(own[1], n) / rate(step[1], bonds)
        );
        if let (Some((seconds, c33)), 1) = (relaxed, threads) {
            println!(
                "    static test along z: {:.2} s, {:.2} s of a core, C33 {:.4} MPa; ours, six cases: {:.4} s, {:.4} s, {:.4} MPa: \
                 {:.0}, {:.0} times as fast",
                seconds[0],
                seconds[1],
                1e-6 * c33,
                test[0],
                test[1],
                1e-6 * measured.voigt()[(2, 2)],
                seconds[0] / test[0],
                seconds[1] / test[1]
            );
        }
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let asked = |name: &str| arguments.iter().any(|a| a == name);
    let parts: [(&str, fn()); 4] = [("kernel", kernel), ("step", step), ("scaling", scaling), ("static", statics)];
    let peer = asked("--yade") || asked("--lammps");
    let any = peer || parts.iter().any(|(name, _)| asked(name));
    for (name, part) in parts {
        if !any || asked(name) {
            part();
        }
    }
    if peer {
        peers(asked);
    }
}
