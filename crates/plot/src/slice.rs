//! A slice of a body, coloured by a number: one picture, or many in time as an animation (APNG).

use super::chart::prefixed;
use super::colour::{LEVELS, Paint, Rgb, Scale};
use super::drawing::{Anchor, Drawing, Group, INK, MARGIN, Mark, SOFT_INK};
use super::numbers::{length, ticks};
use super::{png, text};
use anisobond::{Error, Result};

/// Width and height of the place for the slice, in picture units.
const PLACE: [f64; 2] = [860.0, 560.0];

/// Size of the colour bar's title.
const BAR_TITLE: f64 = 13.0;

/// Most cells along a side; a larger slice shows every n-th node.
const MOST_CELLS: usize = 1200;

/// Width of an animation (pixels).
const ANIMATION_WIDTH: u32 = 900;

/// By how much cells reach under the ones painted after them, so that no seams show.
const OVERLAP: f64 = 0.7;

/// Colour of nodes without a value.
const NOTHING: Rgb = [255, 255, 255];

/// The values of a slice.
#[derive(Clone, Debug, PartialEq)]
pub struct SliceImage {
    /// Heading, as the name of the case.
    pub title: String,
    /// Second line, as the time.
    pub subtitle: String,
    /// Name of the number, and its unit (empty for pure numbers).
    pub quantity: [String; 2],
    /// Names of the axes to the right and upwards.
    pub axes: [&'static str; 2],
    /// Nodes to the right and upwards.
    pub cells: [usize; 2],
    /// Grid spacing (m).
    pub spacing: f64,
    /// Values, the axis to the right fastest; NaN where there is no node.
    pub values: Vec<f32>,
}

impl SliceImage {
    /// Smallest and largest value; `None` of a slice without nodes.
    pub fn range(&self) -> Option<[f64; 2]> {
        let finite = self.values.iter().filter(|v| v.is_finite()).map(|&v| f64::from(v));
        Scale::of(finite).map(|scale| [scale.low, scale.high])
    }

    /// The picture as a PNG file of a given width (pixels), colours over a range of values.
    ///
    /// # Errors
    /// A width outside 200 … 10000, or another number of values than cells.
    pub fn png(&self, width: u32, range: [f64; 2]) -> Result<Vec<u8>> {
        png::render(&self.drawing(range)?, width)
    }

    fn drawing(&self, [low, high]: [f64; 2]) -> Result<Drawing> {
        let [columns, rows] = self.cells;
        if self.values.len() != columns * rows || self.values.is_empty() {
            return Err(Error::input(
                format!("{} values for a slice of {columns} × {rows}", self.values.len()),
                "give one per node",
            ));
        }
        let cell = (PLACE[0] / columns as f64).min(PLACE[1] / rows as f64);
        let size = [cell * columns as f64, cell * rows as f64];
        let corner = [MARGIN, 84.0];
        let scale = Scale { low, high };
        let groups = vec![
            Group { name: "heading".into(), marks: self.heading() },
            Group { name: "slice".into(), marks: self.marks(&scale, corner, cell) },
            Group { name: "axes".into(), marks: self.axis_names(corner, size) },
            Group {
                name: "colour-bar".into(),
                marks: self.colour_bar(&scale, [corner[0] + size[0] + 26.0, corner[1]]),
            },
        ];
        let title = text::width(&self.bar_title(&scale).0, BAR_TITLE) + MARGIN;
        let width = (corner[0] + size[0] + 26.0 + title.max(120.0)).max(420.0);
        Ok(Drawing { size: [width, corner[1] + size[1].max(150.0) + 56.0], title: self.title.clone(), groups })
    }

    fn heading(&self) -> Vec<Mark> {
        let line = |y, size, text: &String, colour| Mark::Text {
            at: [MARGIN, y],
            size,
            anchor: Anchor::Start,
            text: text.clone(),
            colour,
        };
        vec![line(40.0, 22.0, &self.title, INK), line(66.0, 15.0, &self.subtitle, SOFT_INK)]
    }

    /// Rectangles of one colour, as long as a row has it.
    fn marks(&self, scale: &Scale, corner: [f64; 2], cell: f64) -> Vec<Mark> {
        let [columns, rows] = self.cells;
        let stride = columns.max(rows).div_ceil(MOST_CELLS);
        let part = cell * stride as f64;
        let mut marks = Vec::new();
        for (from_top, row) in (0..rows).rev().step_by(stride).enumerate() {
            let colours: Vec<Rgb> =
                (0..columns).step_by(stride).map(|column| colour(scale, self.values[row * columns + column])).collect();
            let mut start = 0;
            while start < colours.len() {
                let run = colours[start..].iter().take_while(|c| **c == colours[start]).count();
                let at = [corner[0] + start as f64 * part, corner[1] + from_top as f64 * part];
                if colours[start] != NOTHING {
                    let size = [run as f64 * part + OVERLAP, part + OVERLAP];
                    marks.push(Mark::Rectangle { at, size, colour: colours[start] });
                }
                start += run;
            }
        }
        marks
    }

    /// What lies to the right and upwards, and how large the slice is.
    fn axis_names(&self, corner: [f64; 2], size: [f64; 2]) -> Vec<Mark> {
        let extent = self.cells.map(|n| length(n as f64 * self.spacing));
        let text = format!("{} {} → · {} {} ↑", self.axes[0], extent[0], self.axes[1], extent[1]);
        let at = [corner[0], corner[1] + size[1] + 28.0];
        vec![Mark::Text { at, size: 14.0, anchor: Anchor::Start, text, colour: SOFT_INK }]
    }

    /// Name and unit of the number, and the power of ten that the unit stands for.
    fn bar_title(&self, scale: &Scale) -> (String, i32) {
        let [name, unit] = &self.quantity;
        let (unit, power) = prefixed(unit, scale.magnitude());
        (format!("{name} {unit}").trim().to_string(), power)
    }

    fn colour_bar(&self, scale: &Scale, at: [f64; 2]) -> Vec<Mark> {
        let height =
            0.7 * (PLACE[0] / self.cells[0] as f64).min(PLACE[1] / self.cells[1] as f64) * self.cells[1] as f64;
        let height = height.max(110.0);
        let (title, power) = self.bar_title(scale);
        let factor = 10f64.powi(power);
        let mut marks = vec![Mark::Text { at, size: BAR_TITLE, anchor: Anchor::Start, text: title, colour: INK }];
        let top = at[1] + 14.0;
        let step = height / LEVELS as f64;
        for level in 0..LEVELS {
            let y = top + height - (level + 1) as f64 * step;
            let colour = Paint::Level(level).colour();
            marks.push(Mark::Rectangle { at: [at[0], y], size: [20.0, step + 0.5], colour });
        }
        let labels = if scale.is_single() {
            vec![(scale.low / factor, format!("{:.4}", scale.low / factor))]
        } else {
            ticks(scale.low / factor, scale.high / factor)
        };
        for (value, text) in labels {
            let y = top + height * (1.0 - scale.position(value * factor));
            marks.push(Mark::Line { from: [at[0] + 20.0, y], to: [at[0] + 25.0, y], width: 1.0, colour: INK });
            let at = [at[0] + 30.0, y + 4.5];
            marks.push(Mark::Text { at, size: 13.0, anchor: Anchor::Start, text, colour: INK });
        }
        marks
    }
}

/// The colour of a value.
fn colour(scale: &Scale, value: f32) -> Rgb {
    if !value.is_finite() {
        return NOTHING;
    }
    let level = (scale.position(f64::from(value)) * LEVELS as f64) as usize;
    Paint::Level(level.min(LEVELS - 1)).colour()
}

/// Slices in time as one animated PNG file, shown at so many frames per second, all with the colours of one range.
///
/// # Errors
/// No slices, or slices of different shapes.
pub fn animation(slices: &[SliceImage], frames_per_second: u16) -> Result<Vec<u8>> {
    let ranges: Vec<[f64; 2]> = slices.iter().filter_map(SliceImage::range).collect();
    let low = ranges.iter().map(|r| r[0]).fold(f64::INFINITY, f64::min);
    let high = ranges.iter().map(|r| r[1]).fold(f64::NEG_INFINITY, f64::max);
    if ranges.is_empty() || slices.iter().any(|s| s.cells != slices[0].cells) {
        return Err(Error::input("no slices, or slices of different shapes", "give slices of one body in time"));
    }
    let drawings: Result<Vec<Drawing>> = slices.iter().map(|s| s.drawing([low, high])).collect();
    png::animate(&drawings?, ANIMATION_WIDTH, frames_per_second)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slice(cells: [usize; 2], value: impl Fn(usize) -> f32) -> SliceImage {
        SliceImage {
            title: "a plate".into(),
            subtitle: "t = 1 µs".into(),
            quantity: ["speed".into(), "m/s".into()],
            axes: ["x", "y"],
            cells,
            spacing: 1e-3,
            values: (0..cells[0] * cells[1]).map(value).collect(),
        }
    }

    /// Colours of the picture's pixels.
    fn pixels(file: &[u8]) -> (usize, Vec<[u8; 3]>) {
        let mut reader = ::png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        (info.width as usize, bytes.as_chunks::<3>().0.to_vec())
    }

    #[test]
    fn low_is_dark_high_is_bright_and_holes_are_white() {
        // Left half low, right half high, a hole in the lower left quarter.
        let image = slice([40, 20], |i| match (i % 40, i / 40) {
            (c, r) if c < 20 && r < 10 => f32::NAN,
            (c, _) => {
                if c < 20 {
                    -1.0
                } else {
                    5.0
                }
            }
        });
        assert_eq!(image.range(), Some([-1.0, 5.0]));
        let drawing = image.drawing([-1.0, 5.0]).unwrap();
        let (width, pixels) = pixels(&image.png(800, [-1.0, 5.0]).unwrap());
        let at = |x: f64, y: f64| {
            let scale = width as f64 / drawing.size[0];
            let (x, y) = (MARGIN + x * PLACE[0], 84.0 + y * 0.5 * PLACE[0]);
            pixels[(y * scale) as usize * width + (x * scale) as usize]
        };
        assert_eq!(at(0.26, 0.26), Paint::Level(0).colour());
        assert_eq!(at(0.76, 0.51), Paint::Level(LEVELS - 1).colour());
        assert_eq!(at(0.26, 0.76), [255; 3]);
    }

    #[test]
    fn an_animation_has_all_frames() {
        let slices: Vec<_> = (0..5).map(|t| slice([30, 12], |i| (i + t) as f32)).collect();
        let file = animation(&slices, 10).unwrap();
        let reader = ::png::Decoder::new(std::io::Cursor::new(file.as_slice())).read_info().unwrap();
        assert_eq!(reader.info().animation_control().unwrap().num_frames, 5);
        assert!(animation(&[], 10).is_err());
        assert!(animation(&[slice([3, 3], |_| 1.0), slice([2, 2], |_| 1.0)], 10).is_err());
        assert!(animation(&[slice([3, 3], |_| f32::NAN)], 10).is_err());
    }

    #[test]
    fn a_large_slice_is_thinned_and_a_wrong_one_refused() {
        let image = slice([5000, 3], |i| i as f32);
        assert!(image.drawing([0.0, 15000.0]).unwrap().groups[1].marks.len() <= 1200);
        let mut wrong = slice([4, 4], |i| i as f32);
        wrong.values.pop();
        assert!(wrong.png(400, [0.0, 1.0]).is_err());
    }
}
