//! Peridigm and PeriLab: bonds of one micromodulus, c = 18 K/(π δ⁴) (12 E/(π δ⁴) at ν = ¼), the closest to the calibrated
//! ones; a block of nodes under a uniform strain, all displacements prescribed, and Python that reads the forces.

use std::f64::consts::PI;
use std::fmt::Write;

use nalgebra::{Matrix6, Vector6};

use super::{BondedCell, Export, MEASURED, refuse_tangential, with_expected};
use anisobond::tensor::{PAIRS, Stiffness};
use anisobond::{Error, Result, Wording};

/// Python that turns the engine's output files into the stiffness.
const SCRIPT: &str = include_str!("measure.py");

/// Strain of the test; what is not linear is of this size relatively.
const STRAIN: f64 = 1e-6;

/// The horizon is this much longer than the longest bond, so that rounding leaves none out.
const MARGIN: f64 = 1e-6;

/// Which of the two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Program {
    Peridigm,
    PeriLab,
}

/// Bonds of one micromodulus in place of calibrated ones.
struct OneConstant {
    /// δ (m).
    horizon: f64,
    /// K (Pa).
    bulk_modulus: f64,
    /// ‖C − C′‖/‖C‖ of the perfect grid.
    error: f64,
    /// What a uniform strain measures of the block, whose faces are free (Pa).
    of_block: Stiffness,
}

/// `mesh.txt`, a deck for each of the six strains and `measure.py`; what they must measure is not what the calibrated bonds do.
/// `within` is the share by which the tensor of one micromodulus may miss the calibrated one.
pub(super) fn export(cell: &BondedCell, program: Program, within: f64) -> Result<Export> {
    let name = match program {
        Program::Peridigm => "Peridigm",
        Program::PeriLab => "PeriLab",
    };
    if within.is_nan() || within < 0.0 {
        return Err(Error::input(format!("a tensor within {within} of another"), "give a share ≥ 0, as 0.02"));
    }
    refuse_tangential(cell, name, "its bond-based material is central")?;
    let Some(spacing) = cell.spacing else {
        return Err(Error::input(
            format!("the bonds are those of sphere contacts; {name}'s bonds are all nodes within a horizon"),
            "export the bonds of a grid, or to lammps, yade, woo, calculix, matrix-market or numpy",
        ));
    };
    let one = OneConstant::closest(cell, spacing, name)?;
    if one.error > within {
        let percent = 100.0 * one.error;
        return Err(Error::input(
            format!(
                "{name}'s bond-based material has one micromodulus for all bonds, 18 K/(π δ⁴); the closest to these bonds, of \
                 K = {:.6e} Pa, makes a tensor that is {percent:.3} % off",
                one.bulk_modulus
            ),
            Wording::from("accept that with ")
                .choice("within", format!("{}", (1.01 * one.error * 1e3).ceil() / 1e3))
                .words(
                    ", or export to lammps, yade, woo, calculix, matrix-market or numpy, which take each bond as it is",
                ),
        ));
    }
    let header = if program == Program::Peridigm { "# x y z block_id volume" } else { "header: x y z block_id volume" };
    let mut mesh = format!("{header}\n");
    for x in &cell.nodes {
        let _ = writeln!(mesh, "{:?} {:?} {:?} 1 {:?}", x.x, x.y, x.z, spacing.powi(3));
    }
    let mut all = String::from(if program == Program::Peridigm { "" } else { "header: global_id\n" });
    (1..=cell.nodes.len()).for_each(|n| all += &format!("{n}\n"));
    let mut files = vec![("mesh.txt".into(), mesh.into_bytes()), ("nodes.txt".into(), all.into_bytes())];
    for case in 0..6 {
        let deck = match program {
            Program::Peridigm => peridigm(&one, case),
            Program::PeriLab => perilab(&one, case),
        };
        files.push((format!("strain_{}.yaml", component(case)), deck.into_bytes()));
    }
    let script =
        SCRIPT.replace("{strain}", &format!("{STRAIN:e}")).replace("{volume}", &format!("{:?}", cell.volume()));
    files.push(("measure.py".into(), script.into_bytes()));
    let outputs = (0..6).map(|case| format!("strain_{}.e", component(case))).chain([MEASURED.into()]).collect();
    Ok(Export { files: with_expected(files, &one.of_block), outputs, warning: None })
}

impl OneConstant {
    /// The micromodulus whose tensor is closest to that of a grid's bonds.
    fn closest(cell: &BondedCell, spacing: f64, name: &str) -> Result<Self> {
        let longest = cell.longest();
        if cell.bonds.len() != cell.nodes.len() * half_of_sphere(longest / spacing) {
            return Err(Error::input(
                format!("the neighbourhood is no sphere; {name}'s bonds are all nodes within a horizon"),
                Wording::from("calibrate with ")
                    .choice("shape", "sphere")
                    .words(", or export to lammps, yade, woo, calculix, matrix-market or numpy"),
            ));
        }
        // k = c ΔV²/ℓ (P eq 14): C = (1/V) Σ k ℓ² n⊗n⊗n⊗n.
        let of = |counts: &dyn Fn(usize) -> bool| {
            let bonds = cell.bonds.iter().enumerate().filter(|(b, _)| counts(*b));
            let sum: Matrix6<f64> = bonds
                .map(|(_, b)| {
                    let n = b.branch.normalize();
                    let nn = Vector6::from_fn(|a, _| n[PAIRS[a].0] * n[PAIRS[a].1]);
                    nn * nn.transpose() * (spacing.powi(6) * b.branch.norm())
                })
                .sum();
            Stiffness::from_voigt(&(sum / cell.volume()))
        };
        let (unit, calibrated) = (of(&|_| true)?, cell.measured()?.0);
        let c = unit.mandel().dot(calibrated.mandel()) / unit.mandel().norm_squared();
        let inside = of(&|b| cell.shift(&cell.bonds[b]) == [0; 3])?;
        let horizon = longest * (1.0 + MARGIN);
        Ok(OneConstant {
            horizon,
            bulk_modulus: c * PI * horizon.powi(4) / 18.0,
            error: calibrated.relative_error(&Stiffness::from_mandel(c * unit.mandel())),
            of_block: Stiffness::from_mandel(c * inside.mandel()),
        })
    }
}

/// Half the number of grid points within r spacings of one, itself not counted.
fn half_of_sphere(r: f64) -> usize {
    let (most, square) = (r.round() as i64 + 1, r * r * (1.0 + 1e-9));
    let line = || -most..=most;
    let inside = |&(i, j, k): &(i64, i64, i64)| ((i * i + j * j + k * k) as f64) <= square;
    let points = line().flat_map(|i| line().flat_map(move |j| line().map(move |k| (i, j, k))));
    (points.filter(inside).count() - 1) / 2
}

/// 11, 22, 33, 23, 13, 12.
fn component(case: usize) -> String {
    let (i, j) = PAIRS[case];
    format!("{}{}", i + 1, j + 1)
}

/// u_x, u_y, u_z of a strain's case, as expressions of x, y, z and the time t.
fn displacements(case: usize) -> [String; 3] {
    let (p, q) = PAIRS[case];
    let mut u = ["0.0"; 3].map(String::from);
    let share = if p == q { STRAIN } else { 0.5 * STRAIN };
    for (i, j) in [(p, q), (q, p)] {
        u[i] = format!("{share:e}*{}*t/{TIME:e}", ["x", "y", "z"][j]);
    }
    u
}

/// Time in which the strain is reached (s), in five steps. Nodes do not move by themselves.
const TIME: f64 = 1e-8;

/// A number as every reader of YAML takes it: with a point.
fn real(x: f64) -> String {
    let text = format!("{x:?}");
    match text.split_once('e') {
        Some((digits, power)) if !digits.contains('.') => format!("{digits}.0e{power}"),
        _ => text,
    }
}

fn said(one: &OneConstant, case: usize, run: &str) -> String {
    format!(
        "# A block of nodes under the strain {}, all displacements prescribed: {run}, then python measure.py.\n\
         # Bonds of one micromodulus, the closest to the calibrated ones: the tensor of the bulk is {:.3e} off.\n\n",
        component(case),
        one.error
    )
}

fn peridigm(one: &OneConstant, case: usize) -> String {
    let file = format!("strain_{}", component(case));
    let mut text = said(one, case, &format!("Peridigm {file}.yaml"));
    let _ = write!(
        text,
        "Peridigm:\n\n  Discretization:\n    Type: \"Text File\"\n    Input Mesh File: \"mesh.txt\"\n\n\
         \x20 Materials:\n    Bonds:\n      Material Model: \"Elastic Bond Based\"\n      Density: 1000.0\n      \
         Bulk Modulus: {}\n\n  Blocks:\n    Block:\n      Block Names: \"block_1\"\n      Material: \"Bonds\"\n      \
         Horizon: {}\n\n  Boundary Conditions:\n    All Nodes: \"nodes.txt\"\n",
        real(one.bulk_modulus),
        real(one.horizon)
    );
    for (axis, u) in ["x", "y", "z"].iter().zip(displacements(case)) {
        let _ = write!(
            text,
            "    Displacement {axis}:\n      Type: \"Prescribed Displacement\"\n      Node Set: \"All Nodes\"\n      \
             Coordinate: \"{axis}\"\n      Value: \"{u}\"\n"
        );
    }
    let _ = write!(
        text,
        "\n  Solver:\n    Verbose: false\n    Initial Time: 0.0\n    Final Time: {}\n    Verlet:\n      Fixed dt: {}\n\n\
         \x20 Output:\n    Output File Type: \"ExodusII\"\n    Output Filename: \"{file}\"\n    Output Frequency: 1\n    \
         Output Variables:\n      Displacement: true\n      Force: true\n",
        real(TIME),
        real(TIME / 5.0)
    );
    text
}

fn perilab(one: &OneConstant, case: usize) -> String {
    let file = format!("strain_{}", component(case));
    let mut text = said(one, case, &format!("in Julia, using PeriLab; PeriLab.main(\"{file}.yaml\")"));
    let _ = write!(
        text,
        "PeriLab:\n  Discretization:\n    Type: \"Text File\"\n    Input Mesh File: \"mesh.txt\"\n    Node Sets:\n      \
         All Nodes: \"nodes.txt\"\n  Models:\n    Material Models:\n      Bonds:\n        Material Model: \"Bond-based Elastic\"\n        \
         Symmetry: \"isotropic\"\n        Young's Modulus: {}\n        Poisson's Ratio: 0.25\n  Blocks:\n    block_1:\n      \
         Block ID: 1\n      Material Model: \"Bonds\"\n      Density: 1000.0\n      Horizon: {}\n  Boundary Conditions:\n",
        // E = 3 K (1 − 2 ν).
        real(1.5 * one.bulk_modulus),
        real(one.horizon)
    );
    for (axis, u) in ["x", "y", "z"].iter().zip(displacements(case)) {
        let _ = write!(
            text,
            "    Displacement {axis}:\n      Variable: \"Displacements\"\n      Type: Dirichlet\n      Node Set: \"All Nodes\"\n      \
             Coordinate: \"{axis}\"\n      Value: \"{u}\"\n"
        );
    }
    let _ = write!(
        text,
        "  Solver:\n    Material Models: True\n    Initial Time: 0.0\n    Final Time: {}\n    Verlet:\n      Fixed dt: {}\n  \
         Outputs:\n    Output1:\n      Output Filename: \"{file}\"\n      Output File Type: Exodus\n      Number of Output Steps: 1\n      \
         Output Variables:\n        Displacements: True\n        Forces: True\n",
        real(TIME),
        real(TIME / 5.0)
    );
    text
}
