//! Frames of a run: VTK files of the body and pictures of its slices, written in the background.

use std::path::{Path, PathBuf};

use super::subject::{Subject, time_text};
use anisobond::{Error, Result};
use anisobond_formats::results::{BackgroundWriter, Series, npy, pvd, read_npy};
use anisobond_formats::write_atomically;
use anisobond_plot::{SliceImage, animation};

/// Width of a slice's picture (pixels).
const WIDTH: u32 = 1200;

/// Pictures per second of the animation.
const RATE: u16 = 12;

/// The frames written so far.
pub(super) struct Frames {
    folder: PathBuf,
    /// Ending of the names of VTK files.
    extension: &'static str,
    series: Series,
    writer: BackgroundWriter,
}

impl Frames {
    /// Frames in a folder, the first ones already there.
    pub(super) fn new(folder: &Path, extension: &'static str, times: &[f64]) -> Result<Self> {
        let frames = times.iter().enumerate().map(|(number, &time)| (time, vtk_name(number, extension))).collect();
        let writer = BackgroundWriter::start()?;
        Ok(Frames { folder: folder.to_path_buf(), extension, series: Series { frames }, writer })
    }

    /// Times of the frames so far.
    pub(super) fn times(&self) -> Vec<f64> {
        self.series.frames.iter().map(|f| f.0).collect()
    }

    /// Write the present state as the next frame.
    pub(super) fn write(&mut self, subject: &impl Subject) -> Result<()> {
        let number = self.series.frames.len();
        let name = vtk_name(number, self.extension);
        self.series.frames.push((subject.time(), name.clone()));
        let plan = subject.output();
        let fields = (!plan.fields.is_empty()).then(|| subject.frame());
        let slices = plan.slices.iter().map(|slice| subject.slice(slice)).collect::<Vec<_>>();
        let (folder, list) = (self.folder.clone(), pvd(&self.series));
        self.writer.submit(move || {
            if let Some(fields) = fields {
                write_atomically(folder.join(name), fields()?)?;
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
    pub(super) fn finish(mut self, subject: &impl Subject) -> Result<()> {
        self.writer.finish()?;
        for (i, slice) in subject.output().slices.iter().enumerate() {
            let last = subject.slice(slice);
            let images: Result<Vec<SliceImage>> = self
                .series
                .frames
                .iter()
                .enumerate()
                .map(|(number, (time, _))| {
                    let path = self.folder.join(slice_name(i, number, "npy"));
                    let bytes = std::fs::read(&path).map_err(|e| Error::file("read", &path, e))?;
                    let values = read_npy(&bytes).map_err(|e| e.at(path.display()))?.0;
                    Ok(SliceImage { values, subtitle: time_text(*time, subject.is_motion()), ..last.clone() })
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
fn vtk_name(number: usize, extension: &str) -> String {
    format!("frame-{number:05}.{extension}")
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
