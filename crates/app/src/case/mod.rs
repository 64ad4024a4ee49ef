//! Case files: a body, how it is loaded, what is measured, in TOML. docs/cases.md names every key.

mod calibrated;
mod doubts;
mod loads;
mod matter;
mod model;
mod overrides;
mod packing;
mod parts;
mod plan;
mod resolve;
mod schedule;
mod section;
mod select;
mod shapes;
mod starter;
mod surface_loads;
mod unused;

use std::cell::Cell;
use std::path::{Path, PathBuf};

use nalgebra::Vector3;

use anisobond::experiment::{Crack, OutputPlan, PackingProblem, Problem, Schedule};
use anisobond::lattice::{Grid, Influence, Neighbourhood, Solid, solid};
use anisobond::tensor::Stiffness;
use anisobond::{Error, Result};
use anisobond_formats::inputs::{Inputs, recorded};
use anisobond_formats::pairs::read_influence;
use anisobond_formats::tree::{Node, parse_toml, read_text, without_mark};
use anisobond_formats::units::Dimension;
use anisobond_formats::words::{quoted, suggestion};
use loads::{ConditionStatement, Names, Where};
use matter::{Matters, RegionStatement};
use model::{ModelStatement, model};
use packing::PackingStatement;
use schedule::ProbeStatement;
use section::{AXES, Section, Spot, Value};
use shapes::Shapes;
use unused::Unused;

pub use calibrated::calibrated_case;
pub use packing::PackingPlan;
pub use plan::{CasePlan, ConditionPlan, RegionPlan};
pub use starter::starter_case;
pub(super) use unused::NOT_USED;

/// Keys of a case file's outermost table.
const KEYS: [&str; 24] = [
    "name",
    "description",
    "lattice",
    "solids",
    "body",
    "grid",
    "packing",
    "strength",
    "contact",
    "servo",
    "model",
    "material",
    "orientation",
    "density",
    "fracture",
    "region",
    "condition",
    "initial_velocity",
    "crack",
    "unbreakable",
    "motion",
    "equilibrium",
    "probe",
    "output",
];

/// A case file whose every value is known to be of the right kind; nodes are not made yet.
#[derive(Clone, Debug)]
pub struct CaseFile {
    name: String,
    description: String,
    /// Of the file, for messages.
    file: String,
    lattice: LatticeKind,
    body: Option<(Spot, Solid)>,
    grid: Option<GridStatement>,
    packing: Option<PackingStatement>,
    /// Keys that its lattice does not use.
    unused: Vec<Unused>,
    /// Of the outermost table.
    top: Spot,
    model: ModelStatement,
    regions: Vec<RegionStatement>,
    conditions: Vec<ConditionStatement>,
    velocities: Vec<(Where, Vector3<f64>)>,
    cracks: Vec<(Spot, Crack)>,
    unbreakable: Vec<Where>,
    schedule: Schedule,
    probes: Vec<ProbeStatement>,
    output: OutputPlan,
    /// The file as it was read, overrides applied.
    asked: serde_json::Value,
    /// What it is made of: its keys, and the files that they name.
    inputs: Inputs,
}

/// The lattice on which a case runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LatticeKind {
    /// Nodes of a grid.
    Grid,
    /// Spheres of a packing.
    Packing,
}

/// `[grid]`.
#[derive(Clone, Debug, PartialEq)]
struct GridStatement {
    spot: Spot,
    neighbourhood: Neighbourhood,
    periodic: [bool; 3],
    plane_strain: Option<usize>,
}

impl CaseFile {
    /// Reads a case file, with values replaced by `overrides` of the form `key=value` (`--set`). See [`CaseFile::parse`].
    ///
    /// # Errors
    /// A file that cannot be read or is not UTF-8, or what [`CaseFile::parse`] refuses.
    pub fn read(path: impl AsRef<Path>, overrides: &[String]) -> Result<Self> {
        let path = path.as_ref();
        CaseFile::parse(&read_text(path)?, &path.display().to_string(), overrides)
    }

    /// A case from the text of a TOML file. `file` names it in messages, and paths in it are relative to its folder.
    ///
    /// # Errors
    /// A syntax error (file:line:column); an unknown key (with the nearest valid one), a missing one, one of a wrong kind
    /// or dimension, names that stand for nothing, files that cannot be read. All name file, line and key; of an
    /// override, the flag.
    pub fn parse(text: &str, file: &str, overrides: &[String]) -> Result<Self> {
        let mut root = parse_toml(without_mark(text), file)?;
        overrides.iter().try_for_each(|o| overrides::set(&mut root, o))?;
        let (case, read) = recorded(|| CaseFile::of(&root, file).map_err(|e| e.at(file)));
        let case = case?;
        let mut inputs = Inputs::of_program().and("the case's name", case.name.as_bytes());
        for entry in root.entries() {
            // The key, too: what is said of one is not what is said of another.
            let said = serde_json::json!([entry.key, entry.value.json()]).to_string();
            inputs = inputs.and(format!("{} in {file}", entry.key), said.as_bytes());
        }
        Ok(CaseFile { asked: unused::apart(root.json(), &case.unused), inputs: inputs.with(&read), ..case })
    }

    fn of(root: &Node, file: &str) -> Result<Self> {
        let root = Value { node: root, path: String::new() }.section(&KEYS)?;
        let folder = Path::new(file).parent().map_or_else(PathBuf::new, Path::to_path_buf);
        let named = root.get("solids").map(|v| v.table(&["names of solids"])).transpose()?;
        let shapes = Shapes { folder, named, count: Cell::new(0) };
        if let Some(named) = &shapes.named {
            for key in named.keys() {
                named.get(key).map(|v| shapes.solid(&v)).transpose()?;
            }
        }
        let text = |key: &str| root.get(key).map(|v| v.text().map(str::to_string)).transpose();
        let stem = || Path::new(file).file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
        let grid = root.get("grid").map(|v| grid(v, &shapes)).transpose()?;
        let packing = packing::statement(&root, &shapes)?;
        let lattice = lattice_kind(&root, grid.is_some(), packing.is_some())?;
        let schedule = schedule::schedule(&root, lattice)?;
        let body = root.get("body").map(|v| Ok((v.spot(), shapes.solid(&v)?))).transpose()?;
        if body.is_none() && lattice == LatticeKind::Grid {
            root.need("body", "body = { box = { size = \"100, 40, 10 mm\" } }")?;
        }
        let regions = Matters { shapes: &shapes, root: &root }.regions()?;
        let names = Names {
            shapes: &shapes,
            regions: regions.iter().map(|r| r.name.clone()).collect(),
            equilibrium: matches!(schedule, Schedule::Equilibrium { .. }),
        };
        let conditions = names.conditions(&root)?;
        Ok(CaseFile {
            name: text("name")?.unwrap_or_else(stem),
            description: text("description")?.unwrap_or_default(),
            file: file.into(),
            model: model(&root, &shapes)?,
            velocities: names.velocities(&root)?,
            unbreakable: names.unbreakable(&root)?,
            probes: schedule::probes(&root, &names, &conditions)?,
            cracks: loads::cracks(&root)?,
            output: schedule::output(&root)?,
            unused: unused::unused(&root, lattice, grid.is_some() && packing.is_some())?,
            top: root.spot(),
            lattice,
            packing,
            body,
            grid,
            regions,
            conditions,
            schedule,
            asked: serde_json::Value::Null,
            inputs: Inputs::default(),
        })
    }

    /// Name of the case: `name`, else that of the file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What the file says about itself; empty if nothing.
    pub fn description(&self) -> &str {
        &self.description
    }

    /// What a user should know of the file: keys that are for the other lattice that it states, and what is not plausible of
    /// its materials and sizes.
    pub fn notes(&self) -> Vec<String> {
        unused::note(&self.unused, self.lattice).into_iter().chain(doubts::doubts(self)).collect()
    }

    /// What the file says, with what `overrides` replaced, in the words and units of who wrote it; what its lattice does not
    /// use stands apart, under "not used".
    pub fn asked(&self) -> &serde_json::Value {
        &self.asked
    }

    /// What the case is made of, by content: its keys with what `overrides` replaced, the files that were read for them, and
    /// the program's version. The file of a packing is read later.
    pub fn inputs(&self) -> &Inputs {
        &self.inputs
    }

    /// The grid around the body. Takes no memory.
    ///
    /// # Errors
    /// As [`solid::grid_around`], placed at the body or the grid.
    pub fn grid(&self) -> Result<Grid> {
        self.grid_around_body().map_err(|e| e.at(&self.file))
    }

    fn grid_around_body(&self) -> Result<Grid> {
        let (grid, (_, shape)) = (self.grid_statement()?, self.body_statement()?);
        let spacing = grid.neighbourhood.spacing();
        solid::grid_around(shape, spacing, grid.periodic, grid.plane_strain).map_err(|e| grid.spot.at(e))
    }

    fn grid_statement(&self) -> Result<&GridStatement> {
        self.grid.as_ref().ok_or_else(|| self.top.wrong("the case has no grid", "add [grid] with spacing = \"1 mm\""))
    }

    fn body_statement(&self) -> Result<&(Spot, Solid)> {
        let example = "add body = { box = { size = \"100, 40, 10 mm\" } }";
        self.body.as_ref().ok_or_else(|| self.top.wrong("the case has no body", example))
    }

    /// The lattice on which the case runs: the one that it has, or of two the one that `lattice` names.
    pub fn lattice(&self) -> LatticeKind {
        self.lattice
    }

    /// The problem on the case's packing, resolved to spheres. What the moduli of bonds need (the packing, its
    /// calibration) is done here.
    ///
    /// # Errors
    /// A case without a packing, a packing that cannot be read, made or calibrated; regions, fracture energies and
    /// whatever else packings do not take; and as [`CaseFile::problem`].
    pub fn packing_problem(&self) -> Result<PackingProblem> {
        packing::problem(self).map_err(|e| e.at(&self.file))
    }

    /// The stiffness (Pa) that a static element test measures on the case's periodic packing, bonds as they are.
    ///
    /// # Errors
    /// As [`CaseFile::packing_problem`]; what the element test refuses.
    pub fn measured_stiffness(&self) -> Result<Stiffness> {
        packing::measured(self).map_err(|e| e.at(&self.file))
    }

    /// What a run on the packing would take.
    pub fn packing_plan(&self, problem: &PackingProblem) -> PackingPlan {
        packing::plan(self, problem)
    }

    /// Names of the conditions, in the order of [`Problem::conditions`].
    pub fn condition_names(&self) -> Vec<&str> {
        self.conditions.iter().map(|c| c.name.as_str()).collect()
    }

    /// The problem, resolved to nodes.
    ///
    /// # Errors
    /// A grid that cannot be ([`CaseFile::grid`]); a body or region of no nodes; regions that overlap without `over`, or
    /// leave nodes of the body out; a case without a grid; conditions of no nodes, or two that prescribe one component of a node differently; a
    /// missing density; a crack that cuts no bond.
    pub fn problem(&self) -> Result<Problem> {
        resolve::problem(self).map_err(|e| e.at(&self.file))
    }

    /// What a run would take: nodes, bonds, memory, regions and loads of the problem that this file states.
    pub fn plan(&self, problem: &Problem) -> CasePlan {
        plan::plan(self, problem)
    }
}

/// `lattice`, needed where both a grid and a packing are stated.
fn lattice_kind(root: &Section, grid: bool, packing: bool) -> Result<LatticeKind> {
    let Some(value) = root.get("lattice") else {
        return match (grid, packing) {
            (true, false) => Ok(LatticeKind::Grid),
            (false, true) => Ok(LatticeKind::Packing),
            (false, false) => Err(root
                .spot()
                .wrong("the case has no grid and no packing", "add [grid] with spacing = \"1 mm\", or [packing]")),
            (true, true) => Err(root
                .spot()
                .wrong("the case has a grid and a packing", "say which: lattice = \"grid\" or \"packing\"")),
        };
    };
    let kind = value.choice(&[("grid", LatticeKind::Grid), ("packing", LatticeKind::Packing)])?;
    match kind {
        LatticeKind::Grid if !grid => Err(value.wrong("the case has no grid", "add [grid] with spacing = \"1 mm\"")),
        LatticeKind::Packing if !packing => {
            Err(value.wrong("the case has no packing", "add [packing] with file and contact_radius"))
        }
        kind => Ok(kind),
    }
}

fn grid(value: Value, shapes: &Shapes) -> Result<GridStatement> {
    let table = value.section(&["spacing", "horizon", "influence", "periodic", "plane_strain"])?;
    let spacing = table.need("spacing", "spacing = \"1 mm\"")?.positive_quantity(Dimension::Length)?;
    let horizon = table.get("horizon").map(|v| v.positive()).transpose()?.unwrap_or(3.0);
    let influence = table.get("influence").map(|v| influence(&v, shapes)).transpose()?.unwrap_or(Influence::Inverse);
    if let Some(v) = table.get("horizon").filter(|_| horizon > 20.0) {
        let problem = format!("a horizon of {horizon} spacings is {:.0} bonds a node", 4.189 * horizon.powi(3));
        return Err(v.wrong(problem, "use at most 20; 3 is common"));
    }
    let at = table.get("horizon").map_or_else(|| table.spot(), |v| v.spot());
    let neighbourhood = Neighbourhood::sphere(horizon, spacing, influence).map_err(|e| at.at(e))?;
    let mut periodic = [false; 3];
    for item in table.get("periodic").map(|v| v.items("periodic = [\"z\"]")).transpose()?.unwrap_or_default() {
        periodic[item.choice(&AXES)?] = true;
    }
    let plane_strain = table.get("plane_strain").map(|v| v.axis()).transpose()?;
    Ok(GridStatement { spot: table.spot(), neighbourhood, periodic, plane_strain })
}

/// A name, a list of [r/δ, ω], or a CSV file.
fn influence(value: &Value, shapes: &Shapes) -> Result<Influence> {
    let at = |e: Error| value.spot().at(e);
    if value.is_text() {
        let text = value.text()?;
        let named = [
            ("inverse", Influence::Inverse),
            ("constant", Influence::Constant),
            ("hat", Influence::Hat),
            ("power", Influence::Power),
        ];
        if let Some((_, influence)) = named.iter().find(|(name, _)| *name == text) {
            return Ok(influence.clone());
        }
        if shapes.path(text).is_file() {
            return read_influence(shapes.path(text)).map_err(at);
        }
        let names: Vec<&str> = named.iter().map(|n| n.0).collect();
        let problem = format!("{} is neither an influence function nor a file", quoted(text));
        return Err(value.wrong(problem, suggestion(text, &names)));
    }
    let point = |item: &Value| match item.items("[r/δ, ω]")?.as_slice() {
        [r, w] => Ok((r.number()?, w.number()?)),
        _ => Err(item.wrong("two numbers are needed", "write [r/δ, ω]")),
    };
    let points = value.items("\"inverse\"")?.iter().map(point).collect::<Result<_>>()?;
    Influence::table(points).map_err(at)
}

/// A case file of a grid read and resolved: [`CaseFile::read`] and [`CaseFile::problem`].
///
/// # Errors
/// As they.
pub fn read_case(path: impl AsRef<Path>, overrides: &[String]) -> Result<Problem> {
    CaseFile::read(path, overrides)?.problem()
}
