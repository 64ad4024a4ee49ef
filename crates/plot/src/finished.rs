//! A picture that is ready to be written.

use std::path::Path;

use super::drawing::Drawing;
use super::{png, svg};
use anisobond::{Error, Result};
use anisobond_formats::write_atomically;

/// Width of a PNG picture written by [`Picture::write`] (pixels).
const PNG_WIDTH: u32 = 1800;

/// A picture, as SVG or PNG.
pub struct Picture(pub(super) Drawing);

impl Picture {
    /// The SVG file's text.
    pub fn svg(&self) -> String {
        svg::render(&self.0)
    }

    /// The PNG file of a given width (pixels); the height follows.
    ///
    /// # Errors
    /// A width outside 200 … 10000.
    pub fn png(&self, width: u32) -> Result<Vec<u8>> {
        png::render(&self.0, width)
    }

    /// Writes the picture, as SVG or as PNG 1800 pixels wide, by the name's extension; whole or not at all.
    ///
    /// # Errors
    /// Another extension; a file that cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        match extension.as_str() {
            "svg" => write_atomically(path, self.svg()),
            "png" => write_atomically(path, self.png(PNG_WIDTH)?),
            _ => Err(Error::input(
                format!("the picture \"{}\" is neither .svg nor .png", path.display()),
                "end its name in .svg or .png",
            )),
        }
    }
}
