//! Frames of a run: VTK images of the body and pictures of its slices, written in the background.

use std::path::{Path, PathBuf};

use crate::experiment::{FieldName, Simulation, Slice};
use crate::io::picture::{SliceImage, animation};
use crate::io::results::{BackgroundWriter, ImageArray, Series, image_data, npy, pvd, read_npy};
use crate::io::write_atomically;
use crate::lattice::Grid;
use crate::{Error, Result};

/// Width of a slice's picture (pixels).
const WIDTH: u32 = 1200;

/// Pictures per second of the animation.
const RATE: u16 = 12;

/// The frames written so far.
pub(super) struct Frames {
    folder: PathBuf,
    series: Series,
    writer: BackgroundWriter,
}

impl Frames {
    /// Frames in a folder, the first ones already there.
    pub(super) fn new(folder: &Path, times: &[f64]) -> Result<Self> {
        let frames = times.iter().enumerate().map(|(number, &time)| (time, vti_name(number))).collect();
        Ok(Frames { folder: folder.to_path_buf(), series: Series { frames }, writer: BackgroundWriter::start()? })
    }

    /// Times of the frames so far.
    pub(super) fn times(&self) -> Vec<f64> {
        self.series.frames.iter().map(|f| f.0).collect()
    }

    /// Write the present state as the next frame.
    pub(super) fn write(&mut self, simulation: &Simulation) -> Result<()> {
        let number = self.series.frames.len();
        self.series.frames.push((simulation.time(), vti_name(number)));
        let plan = &simulation.problem().output;
        let grid = simulation.problem().body.grid.clone();
        let arrays = plan.fields.iter().map(|&name| array(simulation, name)).collect::<Vec<_>>();
        let slices = plan.slices.iter().map(|slice| image(simulation, slice)).collect::<Vec<_>>();
        let (folder, list) = (self.folder.clone(), pvd(&self.series));
        self.writer.submit(move || {
            if !arrays.is_empty() {
                write_atomically(folder.join(vti_name(number)), image_data(&grid, &arrays)?)?;
                write_atomically(folder.join("frames.pvd"), list)?;
            }
            slices.iter().enumerate().try_for_each(|(i, image)| write_slice(&folder, i, number, image))
        })
    }

    /// Wait until the frames so far are on the disk.
    pub(super) fn drain(&mut self) -> Result<()> {
        self.writer.drain()
    }

    /// End: wait for the frames, and gather the slices into animations of one colour range each.
    pub(super) fn finish(mut self, simulation: &Simulation) -> Result<()> {
        self.writer.finish()?;
        for (i, slice) in simulation.problem().output.slices.iter().enumerate() {
            let last = image(simulation, slice);
            let images: Result<Vec<SliceImage>> = self
                .series
                .frames
                .iter()
                .enumerate()
                .map(|(number, (time, _))| {
                    let path = self.folder.join(slice_name(i, number, "npy"));
                    let bytes = std::fs::read(&path).map_err(|e| Error::file("read", &path, e))?;
                    let values = read_npy(&bytes).map_err(|e| e.at(path.display()))?.0;
                    Ok(SliceImage { values, subtitle: simulation.time_text(*time), ..last.clone() })
                })
                .collect();
            let images = images?;
            if images.len() > 1 && images.iter().any(|image| image.range().is_some()) {
                write_atomically(self.folder.join(format!("slice-{}.apng", i + 1)), animation(&images, RATE)?)?;
            }
        }
        Ok(())
    }
}

/// Name of a frame's VTK file.
fn vti_name(number: usize) -> String {
    format!("frame-{number:05}.vti")
}

/// Name of a slice's file.
fn slice_name(slice: usize, number: usize, extension: &str) -> String {
    format!("slice-{}-{number:05}.{extension}", slice + 1)
}

/// A slice as numbers, and as a picture where it shows any node.
fn write_slice(folder: &Path, slice: usize, number: usize, image: &SliceImage) -> Result<()> {
    let [columns, rows] = image.cells;
    write_atomically(folder.join(slice_name(slice, number, "npy")), npy(&image.values, [rows, columns]))?;
    match image.range() {
        Some(range) => write_atomically(folder.join(slice_name(slice, number, "png")), image.png(WIDTH, range)?),
        None => Ok(()),
    }
}

/// A field of all nodes.
fn array(simulation: &Simulation, name: FieldName) -> ImageArray {
    let (components, values) = simulation.field(name);
    let (label, unit) = label(name);
    let name = if unit.is_empty() { label.to_string() } else { format!("{label} ({unit})") };
    ImageArray { name, components, values }
}

/// A field's name and unit.
fn label(name: FieldName) -> (&'static str, &'static str) {
    match name {
        FieldName::Displacement => ("displacement", "m"),
        FieldName::Velocity => ("velocity", "m/s"),
        FieldName::Force => ("force", "N"),
        FieldName::Damage => ("damage", ""),
        FieldName::Energy => ("energy density", "J/m³"),
        FieldName::Stress => ("stress", "Pa"),
        FieldName::Region => ("region", ""),
    }
}

/// The nodes of a slice: of a vector its length, of a tensor its Frobenius norm.
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
            values.push(if body.has(node) { size(&all[components * node..components * (node + 1)]) } else { f32::NAN });
        }
    }
    let names = ["x", "y", "z"];
    let (label, unit) = label(slice.field);
    SliceImage {
        title: format!("{}: {label}", simulation.problem().name),
        subtitle: simulation.time_text(simulation.time()),
        quantity: [label.into(), unit.into()],
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

/// A number's value, a vector's length; of a symmetric tensor the norm, off-diagonal components twice.
fn size(components: &[f32]) -> f32 {
    match components {
        [value] => *value,
        [xx, yy, zz, xy, yz, xz] => (xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + xz * xz)).sqrt(),
        vector => vector.iter().map(|x| x * x).sum::<f32>().sqrt(),
    }
}
