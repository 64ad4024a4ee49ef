//! A packing's simulation as the subject of a run: points for VTK, slices of spheres cut by a plane, and of a servo the
//! curve of stress over strain.

use std::path::Path;

use nalgebra::Vector3;

use super::subject::{FrameWork, LastFile, Subject, time_text};
use super::summary::RunSummary;
use anisobond::experiment::{
    CellState, Ledger, Outcome, OutputPlan, PackingFacts, PackingSimulation, Probe, SavedState, Slice, StepLook,
};
use anisobond::{Error, Result};
use anisobond_formats::results::{FieldArray, point_data};
use anisobond_plot::{Disc, Scalar, SliceImage, Style, Window};

/// Columns of a periodic cell: stresses (Pa, tension positive) and strains.
const CELL_COLUMNS: [&str; 12] = [
    "stress_xx_Pa",
    "stress_yy_Pa",
    "stress_zz_Pa",
    "stress_yz_Pa",
    "stress_xz_Pa",
    "stress_xy_Pa",
    "strain_xx",
    "strain_yy",
    "strain_zz",
    "strain_yz",
    "strain_xz",
    "strain_xy",
];

/// Width of the curve's picture (pixels).
const WIDTH: u32 = 1400;

impl Subject for PackingSimulation {
    type Facts = PackingFacts;

    const FRAME: &'static str = "vtp";

    fn name(&self) -> &str {
        &self.problem().name
    }
    fn output(&self) -> &OutputPlan {
        &self.problem().output
    }
    fn advance(&mut self, look: StepLook) -> Result<()> {
        PackingSimulation::advance_seen(self, look)
    }
    fn outcome(&self) -> &Outcome {
        PackingSimulation::outcome(self)
    }
    fn show_broken(&mut self) {
        PackingSimulation::show_broken(self);
    }
    fn step(&self) -> u64 {
        PackingSimulation::step(self)
    }
    fn steps(&self) -> u64 {
        PackingSimulation::steps(self)
    }
    fn time(&self) -> f64 {
        PackingSimulation::time(self)
    }
    fn is_motion(&self) -> bool {
        PackingSimulation::is_motion(self)
    }
    fn bonds(&self) -> u64 {
        PackingSimulation::bonds(self)
    }
    fn ledger(&self) -> &Ledger {
        PackingSimulation::ledger(self)
    }
    fn warnings(&self) -> &[String] {
        PackingSimulation::warnings(self)
    }
    fn probes(&self) -> &[Probe] {
        &self.problem().probes
    }
    fn measure(&self, probe: &Probe) -> Vec<f64> {
        PackingSimulation::measure(self, probe)
    }
    fn own_columns(&self) -> Vec<&'static str> {
        if self.cell().is_some() { CELL_COLUMNS.to_vec() } else { Vec::new() }
    }
    fn own_row(&self) -> Vec<f64> {
        self.cell().map_or(Vec::new(), |CellState { stress, strain }| [stress, strain].concat())
    }
    fn save(&self) -> SavedState<PackingFacts> {
        PackingSimulation::save(self)
    }
    fn restore(&mut self, state: SavedState<PackingFacts>) -> Result<()> {
        PackingSimulation::restore(self, state)
    }

    fn frame(&self) -> FrameWork {
        let array = |&field: &_| FieldArray::of(field, self.field(field).1);
        let mut arrays: Vec<FieldArray> = self.problem().output.fields.iter().map(array).collect();
        let radii = self.problem().model.packing.radii().iter().map(|&r| r as f32).collect();
        arrays.push(FieldArray { name: "radius (m)".into(), components: &[], values: radii });
        let places = places(self);
        Box::new(move || point_data(&places, &arrays))
    }

    fn slice(&self, slice: &Slice) -> SliceImage {
        image(self, slice)
    }

    fn last_files(&self, folder: &Path) -> Result<Vec<LastFile>> {
        let plan = self.problem().servo.as_ref();
        match plan.and_then(|plan| plan.axial(self.time())) {
            None => Ok(Vec::new()),
            Some(axis) => curve(self, folder, axis),
        }
    }

    fn summary(&self, seconds: f64, warnings: Vec<String>) -> RunSummary {
        RunSummary::of_packing(self, seconds, warnings)
    }
}

/// Where the spheres are now (m), in the coordinates of the case; along periodic axes taken into the cell.
fn places(simulation: &PackingSimulation) -> Vec<Vector3<f64>> {
    let problem = simulation.problem();
    let cell = simulation.particles().cell();
    let inverse = cell.and_then(|h| h.try_inverse());
    let inside = |x: Vector3<f64>| match (cell, inverse) {
        (Some(h), Some(inverse)) => {
            let s = inverse * x;
            x - h * Vector3::from_fn(|a, _| if problem.periodic[a] { s[a].floor() } else { 0.0 })
        }
        _ => x,
    };
    simulation.particles().positions().into_iter().map(|x| inside(x) + problem.origin).collect()
}

/// What a slice shows: the box of the spheres at the start, whole spheres along its edges.
fn window(simulation: &PackingSimulation, axes: [usize; 2]) -> Window {
    let problem = simulation.problem();
    let spheres = 0..problem.model.packing.len();
    let radii = problem.model.packing.radii();
    let side = |axis: usize| {
        let edge = problem.model.packing.cell().filter(|_| problem.periodic[axis]).map(|edges| edges[axis]);
        match edge {
            Some(edge) => (problem.origin[axis], problem.origin[axis] + edge),
            None => spheres.clone().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), s| {
                let x = problem.position(s)[axis];
                (low.min(x - radii[s]), high.max(x + radii[s]))
            }),
        }
    };
    let [right, up] = axes.map(side);
    Window { low: [right.0, up.0], high: [right.1, up.1] }
}

/// The spheres that a plane cuts.
fn image(simulation: &PackingSimulation, slice: &Slice) -> SliceImage {
    let problem = simulation.problem();
    let [right, up] = [[1, 2], [0, 2], [0, 1]][slice.axis];
    let (components, values) = simulation.field(slice.field);
    let across = window(simulation, [slice.axis, right]);
    let position = slice.position.unwrap_or(0.5 * (across.low[0] + across.high[0]));
    let disc = |(sphere, x): (usize, &Vector3<f64>)| {
        let rest = problem.model.packing.radii()[sphere].powi(2) - (x[slice.axis] - position).powi(2);
        let value = slice.field.number(slice.component, &values[components * sphere..components * (sphere + 1)]);
        (rest > 0.0).then(|| Disc { centre: [x[right], x[up]], radius: rest.sqrt(), value })
    };
    let discs: Vec<Disc> = places(simulation).iter().enumerate().filter_map(disc).collect();
    let (label, unit) = (slice.field.shown(slice.component), slice.field.about().unit);
    let names = ["x", "y", "z"];
    let about = SliceImage {
        title: format!("{}: {label}", problem.name),
        subtitle: time_text(simulation.time(), simulation.is_motion()),
        quantity: [label, unit.into()],
        axes: [names[right], names[up]],
        cells: [0, 0],
        spacing: 0.0,
        values: Vec::new(),
    };
    window(simulation, [right, up]).raster(&discs, problem.mean_radius(), about)
}

/// The curve of stress over strain along the axis that was strained, from the probes of the whole run.
fn curve(simulation: &PackingSimulation, folder: &Path, axis: usize) -> Result<Vec<LastFile>> {
    let path = folder.join("probes.csv");
    let file = std::fs::File::open(&path).map_err(|e| Error::file("read", &path, e))?;
    let mut reader = csv::Reader::from_reader(file);
    let unreadable = |e: csv::Error| Error::file("read", &path, e.into());
    let names = reader.headers().map_err(unreadable)?.clone();
    let column = |name: &str| names.iter().position(|n| n == name);
    let components = [0, 1, 2].map(|a| column(CELL_COLUMNS[a]));
    let (Some(strain), [Some(x), Some(y), Some(z)]) = (column(CELL_COLUMNS[6 + axis]), components) else {
        return Ok(Vec::new());
    };
    let numbers = |row: csv::StringRecord| row.iter().map(|word| word.parse().unwrap_or(f64::NAN)).collect();
    let rows: Vec<Vec<f64>> =
        reader.records().map(|row| row.map(numbers).map_err(unreadable)).collect::<Result<_>>()?;
    // Compression is drawn upwards and to the right where it is what was applied.
    let sign = if rows.last().is_some_and(|row| row[strain] < 0.0) { -1.0 } else { 1.0 };
    let own = [x, y, z][axis];
    let lateral = |row: &[f64]| 0.5 * (row[x] + row[y] + row[z] - row[own]);
    let points = |value: &dyn Fn(&[f64]) -> f64| -> Vec<[f64; 2]> {
        rows.iter().map(|row| [sign * 100.0 * row[strain], sign * value(row)]).filter(|p| p[1].is_finite()).collect()
    };
    let series = |name: &str, value: &dyn Fn(&[f64]) -> f64| anisobond_plot::Series {
        name: name.into(),
        points: points(value),
        style: Style::Line,
    };
    let letter = ["x", "y", "z"][axis];
    let panel = anisobond_plot::Panel {
        x: Scalar { name: format!("strain along {letter}"), unit: "%".into() },
        y: Scalar { name: "stress".into(), unit: "Pa".into() },
        series: vec![
            series("axial less lateral", &|row| row[own] - lateral(row)),
            series("axial", &|row| row[own]),
            series("lateral", &lateral),
        ],
    };
    let subtitle = simulation.peak().map_or(String::new(), |p| {
        let (stress, strain) = (p.differential / 1e6, 100.0 * p.strain.abs());
        format!("largest differential stress {stress:.4} MPa at a strain of {strain:.3} %")
    });
    let sense = if sign < 0.0 { "compression" } else { "tension" };
    let title = format!("{}: {sense} along {letter}", simulation.problem().name);
    let png = anisobond_plot::Chart::new(title, subtitle, vec![panel])?.picture().png(WIDTH)?;
    Ok(vec![("stress-strain.png", png)])
}
