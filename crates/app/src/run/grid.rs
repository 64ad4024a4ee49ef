//! A grid's simulation as the subject of a run: VTK images, slices along layers of nodes.

use std::path::Path;

use super::subject::{FrameWork, LastFile, Subject, time_text};
use super::summary::RunSummary;
use super::time_column;
use anisobond::Result;
use anisobond::experiment::{
    CrackPath, CrackPoint, GridFacts, Ledger, Outcome, OutputPlan, Probe, SavedState, Simulation, Slice, StepLook,
    TipPoint,
};
use anisobond::lattice::Grid;
use anisobond_formats::results::{FieldArray, image_data};
use anisobond_plot::SliceImage;

impl Subject for Simulation {
    type Facts = GridFacts;

    const FRAME: &'static str = "vti";

    fn name(&self) -> &str {
        &self.problem().name
    }
    fn output(&self) -> &OutputPlan {
        &self.problem().output
    }
    fn advance(&mut self, look: StepLook) -> Result<()> {
        Simulation::advance_seen(self, look)
    }
    fn outcome(&self) -> &Outcome {
        Simulation::outcome(self)
    }
    fn show_broken(&mut self) {
        Simulation::show_broken(self);
    }
    fn step(&self) -> u64 {
        Simulation::step(self)
    }
    fn steps(&self) -> u64 {
        Simulation::steps(self)
    }
    fn time(&self) -> f64 {
        Simulation::time(self)
    }
    fn is_motion(&self) -> bool {
        Simulation::is_motion(self)
    }
    fn bonds(&self) -> u64 {
        Simulation::bonds(self)
    }
    fn ledger(&self) -> &Ledger {
        Simulation::ledger(self)
    }
    fn warnings(&self) -> &[String] {
        Simulation::warnings(self)
    }
    fn probes(&self) -> &[Probe] {
        &self.problem().probes
    }
    fn measure(&self, probe: &Probe) -> Vec<f64> {
        Simulation::measure(self, probe)
    }
    fn own_columns(&self) -> Vec<&'static str> {
        Vec::new()
    }
    fn own_row(&self) -> Vec<f64> {
        Vec::new()
    }
    fn save(&self) -> SavedState<GridFacts> {
        Simulation::save(self)
    }
    fn restore(&mut self, state: SavedState<GridFacts>) -> Result<()> {
        Simulation::restore(self, state)
    }

    fn frame(&self) -> FrameWork {
        let body = &self.problem().body;
        let (grid, there) = (body.grid.clone(), (0..body.grid.len()).map(|node| body.has(node)).collect::<Vec<_>>());
        let array = |&field: &_| FieldArray::of(field, self.field(field).1);
        let arrays: Vec<FieldArray> = self.problem().output.fields.iter().map(array).collect();
        Box::new(move || image_data(&grid, &there, &arrays))
    }

    fn slice(&self, slice: &Slice) -> SliceImage {
        image(self, slice)
    }

    fn last_files(&self, _folder: &Path) -> Result<Vec<LastFile>> {
        let (cracks, motion) = (self.cracks(), self.is_motion());
        if cracks.is_empty() {
            return Ok(Vec::new());
        }
        Ok(vec![
            ("crack.csv", tip_table(&cracks, motion).into_bytes()),
            ("crack-nodes.csv", node_table(&cracks, motion).into_bytes()),
        ])
    }

    fn summary(&self, seconds: f64, warnings: Vec<String>) -> RunSummary {
        RunSummary::of_grid(self, seconds, warnings)
    }
}

/// The nodes of a slice.
fn image(simulation: &Simulation, slice: &Slice) -> SliceImage {
    let body = &simulation.problem().body;
    let grid = &body.grid;
    let (components, all) = simulation.field(slice.field);
    let [right, up] = [[1, 2], [0, 2], [0, 1]][slice.axis];
    let layer = layer(grid, slice);
    let cells = [grid.nodes[right], grid.nodes[up]];
    let mut values = Vec::with_capacity(cells[0] * cells[1]);
    for row in 0..cells[1] {
        for column in 0..cells[0] {
            let mut at = [layer; 3];
            (at[right], at[up]) = (column, row);
            let node = grid.index(at);
            values.push(if body.has(node) {
                slice.field.number(slice.component, &all[components * node..components * (node + 1)])
            } else {
                f32::NAN
            });
        }
    }
    let names = ["x", "y", "z"];
    let (label, unit) = (slice.field.shown(slice.component), slice.field.about().unit);
    SliceImage {
        title: format!("{}: {label}", simulation.problem().name),
        subtitle: time_text(simulation.time(), simulation.is_motion()),
        quantity: [label, unit.into()],
        axes: [names[right], names[up]],
        cells,
        spacing: grid.spacing,
        values,
    }
}

/// The layer of nodes that a slice shows.
fn layer(grid: &Grid, slice: &Slice) -> usize {
    let nodes = grid.nodes[slice.axis];
    slice.position.map_or(nodes / 2, |x| {
        let at = ((x - grid.origin[slice.axis]) / grid.spacing).round();
        (at.max(0.0) as usize).min(nodes - 1)
    })
}

/// The tips of all cracks in the order of time, numbered on from the longest crack's longest.
fn tip_table(cracks: &[CrackPath], motion: bool) -> String {
    let mut rows: Vec<(usize, &TipPoint)> = cracks
        .iter()
        .flat_map(|crack| &crack.tips)
        .enumerate()
        .flat_map(|(number, tip)| tip.history.iter().map(move |point| (number + 1, point)))
        .collect();
    rows.sort_by(|a, b| a.1.time.total_cmp(&b.1.time).then(a.0.cmp(&b.0)));
    let mut text = format!("{},tip,x_m,y_m,z_m,length_m,speed_m_s\n", time_column(motion));
    for (number, TipPoint { time, place, length, speed }) in rows {
        let speed = speed.map_or(String::new(), |v| format!("{v:?}"));
        text += &format!("{time:?},{number},{:?},{:?},{:?},{length:?},{speed}\n", place.x, place.y, place.z);
    }
    text
}

/// The nodes of cracks, numbered from the longest on.
fn node_table(cracks: &[CrackPath], motion: bool) -> String {
    let mut text = format!("crack,x_m,y_m,z_m,{},way_m\n", time_column(motion));
    for (number, crack) in cracks.iter().enumerate() {
        for CrackPoint { place, time, way } in &crack.points {
            text += &format!("{},{:?},{:?},{:?},{time:?},{way:?}\n", number + 1, place.x, place.y, place.z);
        }
    }
    text
}
