//! Line charts: several series over a number, in one panel or in small multiples that share a legend.

use std::collections::HashMap;
use std::path::Path;

use super::colour::Rgb;
use super::drawing::{Anchor, Drawing, Group, INK, MARGIN, Mark, SOFT_INK, heading, in_power, text, unit};
use super::finished::Picture;
use super::numbers::{round_range, some_ticks};
use super::scene::Scalar;
use super::text::{fit, width};
use anisobond::{Error, Result};
use anisobond_formats::flat::{FlatRow, csv_of};
use anisobond_formats::write_atomically;

/// Width and height of the plot of a single panel, and of one of several.
const ALONE: [f64; 2] = [760.0, 440.0];
const ONE_OF_MANY: [f64; 2] = [350.0, 225.0];
/// Room of a panel left of, above and below its plot.
const LEFT: f64 = 60.0;
const ABOVE: f64 = 46.0;
const BELOW: f64 = 66.0;
const GAP: f64 = 26.0;
/// Size of numbers and titles of axes.
const SIZE: f64 = 15.0;
const TITLE_SIZE: f64 = 16.0;
const LEGEND_SIZE: f64 = 16.0;
/// Length of the piece of line in the legend.
const KEY: f64 = 34.0;
pub(super) const GRID: Rgb = [228, 230, 234];
const AXIS: Rgb = [120, 124, 132];
const WHITE: Rgb = [255; 3];

/// Colours that the colour-blind tell apart (Okabe and Ito), after a dark one.
const COLOURS: [Rgb; 8] = [
    [60, 64, 72],
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [150, 84, 160],
    [86, 160, 220],
    [200, 140, 0],
    [140, 90, 60],
];

/// Largest magnitude of a number that can be drawn.
const MOST: f64 = 1e100;

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// A line, without marks: something known everywhere.
    Line,
    /// Marks joined by a line, in the order of the points.
    MarkedLine,
    /// Marks alone.
    Marks,
}

/// Points under one name.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// The name in the legend; series of one name look the same in all panels.
    pub name: String,
    /// (x, y) in the units of the panel's scalars.
    pub points: Vec<[f64; 2]>,
    /// How it is drawn.
    pub style: Style,
}

/// One plot of a chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// What runs to the right; the unit is that of the points (SI units get a prefix that suits).
    pub x: Scalar,
    /// What runs upwards.
    pub y: Scalar,
    /// The series, painted in this order.
    pub series: Vec<Series>,
}

/// A chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    title: String,
    subtitle: String,
    panels: Vec<Panel>,
}

impl Chart {
    /// A chart of one or more panels.
    ///
    /// # Errors
    /// No panel, a panel without points, or a number that is not finite (or beyond ±10¹⁰⁰).
    pub fn new(title: impl Into<String>, subtitle: impl Into<String>, panels: Vec<Panel>) -> Result<Self> {
        if panels.is_empty() {
            return Err(Error::input("the chart has no panel", "give at least one"));
        }
        for panel in &panels {
            let what = format!("the chart of {} over {}", panel.y.name, panel.x.name);
            if panel.series.iter().all(|series| series.points.is_empty()) {
                return Err(Error::input(format!("{what} has no point"), "give at least one"));
            }
            for series in &panel.series {
                if let Some([x, y]) = series.points.iter().find(|point| !point.iter().all(|x| x.abs() <= MOST)) {
                    let problem = format!("{what} has the point ({x}, {y}) in {:?}", series.name);
                    return Err(Error::input(problem, "leave out what is not finite"));
                }
            }
        }
        Ok(Chart { title: title.into(), subtitle: subtitle.into(), panels })
    }

    /// The chart as a picture.
    pub fn picture(&self) -> Picture {
        Picture(self.drawing())
    }

    /// The data as a CSV table: a row per x, a column per panel and series.
    ///
    /// # Errors
    /// None in practice: writing to memory does not fail.
    pub fn csv(&self) -> Result<String> {
        let mut header: Vec<String> = Vec::new();
        let mut rows: Vec<Datum> = Vec::new();
        for panel in &self.panels {
            let x_name = with_unit(&panel.x);
            if !header.contains(&x_name) {
                header.push(x_name.clone());
            }
            for series in &panel.series {
                let name = format!("{}: {}", with_unit(&panel.y), series.name);
                add_column(&mut rows, &x_name, &name, &series.points);
                header.push(name);
            }
        }
        rows.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.again.cmp(&b.again)));
        csv_of(&header, &rows.into_iter().map(|row| row.cells).collect::<Vec<_>>())
    }

    /// Writes the picture, and the data beside it in a file of the same name that ends in `.csv`.
    ///
    /// # Errors
    /// A picture that is neither .svg nor .png, a file that cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        self.picture().write(path)?;
        write_atomically(path.with_extension("csv"), self.csv()?)
    }

    /// Names and styles of the legend: every series name once.
    fn legend(&self) -> Vec<(&str, Look)> {
        let mut names: Vec<(&str, Look)> = Vec::new();
        for series in self.panels.iter().flat_map(|panel| &panel.series) {
            if !names.iter().any(|(name, _)| *name == series.name) {
                let marked = names.iter().filter(|(_, look)| look.style != Style::Line).count();
                let look = Look { colour: COLOURS[names.len() % COLOURS.len()], shape: marked, style: series.style };
                names.push((&series.name, look));
            }
        }
        names
    }

    fn drawing(&self) -> Drawing {
        let looks = self.legend();
        let alone = self.panels.len() == 1;
        let columns = match self.panels.len() {
            n @ 1..=3 => n,
            4 => 2,
            _ => 3,
        };
        let plot = if alone { ALONE } else { ONE_OF_MANY };
        let cell = [LEFT + plot[0] + GAP, ABOVE + plot[1] + BELOW];
        let size_x = 2.0 * MARGIN + columns as f64 * cell[0] - GAP;
        let mut top = match (self.title.is_empty(), self.subtitle.is_empty()) {
            (true, _) => MARGIN,
            (false, true) => 76.0,
            (false, false) => 104.0,
        };
        let room = size_x - 2.0 * MARGIN;
        let mut groups = vec![Group { name: "heading".into(), marks: heading(&self.title, &self.subtitle, room) }];
        let named = looks.len() > 1 || looks.iter().any(|(name, _)| !name.is_empty());
        if named {
            let (marks, height) = legend(&looks, [MARGIN, top], room);
            groups.push(Group { name: "legend".into(), marks });
            top += height;
        }
        for (index, panel) in self.panels.iter().enumerate() {
            let (row, column) = (index / columns, index % columns);
            let corner = [MARGIN + LEFT + column as f64 * cell[0], top + ABOVE + row as f64 * cell[1]];
            let marks = Plot::of(panel, corner, plot).marks(panel, &looks);
            groups.push(Group { name: format!("panel-{}", index + 1), marks });
        }
        let rows = self.panels.len().div_ceil(columns) as f64;
        Drawing { size: [size_x, top + rows * cell[1] + 4.0], title: self.title.clone(), groups }
    }
}

/// One row of the data: an x, and how often that x came before in its series.
struct Datum {
    x_name: String,
    x: f64,
    again: usize,
    cells: FlatRow,
}

/// Adds a series to the rows of data.
fn add_column(rows: &mut Vec<Datum>, x_name: &str, name: &str, points: &[[f64; 2]]) {
    // Rows by the bits of x; −0 is 0.
    let key = |x: f64, again: usize| ((x + 0.0).to_bits(), again);
    let own = rows.iter().enumerate().filter(|(_, row)| row.x_name == x_name);
    let mut known: HashMap<(u64, usize), usize> = own.map(|(at, row)| (key(row.x, row.again), at)).collect();
    let mut before: HashMap<u64, usize> = HashMap::new();
    for &[x, y] in points {
        let count = before.entry(key(x, 0).0).or_insert(0);
        let again = *count;
        *count += 1;
        let at = *known.entry(key(x, again)).or_insert_with(|| {
            rows.push(Datum { x_name: x_name.into(), x, again, cells: vec![(x_name.into(), x.to_string().into())] });
            rows.len() - 1
        });
        rows[at].cells.push((name.into(), y.to_string().into()));
    }
}

/// "C₁₁ (Pa)".
fn with_unit(scalar: &Scalar) -> String {
    if scalar.unit.is_empty() { scalar.name.clone() } else { format!("{} ({})", scalar.name, scalar.unit) }
}

/// How a series looks everywhere.
#[derive(Clone, Copy)]
pub(super) struct Look {
    pub colour: Rgb,
    /// Which mark: circle, square, triangle, diamond.
    pub shape: usize,
    pub style: Style,
}

impl Look {
    /// The look of the n-th of some lines without marks.
    pub(super) fn line(n: usize) -> Self {
        Look { colour: COLOURS[n % COLOURS.len()], shape: 0, style: Style::Line }
    }

    fn width(&self) -> f64 {
        if self.style == Style::Line { 3.0 } else { 2.2 }
    }

    /// Line and marks through points of the drawing.
    fn marks(&self, points: Vec<[f64; 2]>) -> Vec<Mark> {
        let mut marks = Vec::new();
        if self.style != Style::Marks && points.len() > 1 {
            marks.push(Mark::Path { points: points.clone(), width: self.width(), colour: self.colour });
        }
        // A single point would be invisible as a line.
        if self.style != Style::Line || points.len() == 1 {
            for at in points {
                marks.extend([(7.2, WHITE), (5.4, self.colour)].map(|(size, colour)| self.mark(at, size, colour)));
            }
        }
        marks
    }

    fn mark(&self, at: [f64; 2], size: f64, colour: Rgb) -> Mark {
        let corners = |offsets: &[[f64; 2]]| Mark::Polygon {
            points: offsets.iter().map(|[x, y]| [at[0] + x * size, at[1] + y * size]).collect(),
            colour,
        };
        match self.shape % 4 {
            0 => Mark::Disc { at, radius: size, colour },
            1 => corners(&[[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]]),
            2 => corners(&[[0.0, -1.2], [1.1, 0.8], [-1.1, 0.8]]),
            _ => corners(&[[0.0, -1.25], [1.25, 0.0], [0.0, 1.25], [-1.25, 0.0]]),
        }
    }
}

/// The legend from its upper left corner, in as many lines as it needs, and its height.
pub(super) fn legend(looks: &[(&str, Look)], corner: [f64; 2], most: f64) -> (Vec<Mark>, f64) {
    let (mut x, mut y) = (corner[0], corner[1] + 12.0);
    let mut marks = Vec::new();
    for (name, look) in looks {
        let (name, size) = fit(name, LEGEND_SIZE, most - KEY - 12.0);
        let wide = KEY + 9.0 + width(&name, size) + 28.0;
        if x > corner[0] && x + wide - 28.0 > corner[0] + most {
            (x, y) = (corner[0], y + 26.0);
        }
        if look.style != Style::Marks {
            marks.push(Mark::Line { from: [x, y], to: [x + KEY, y], width: look.width(), colour: look.colour });
        }
        if look.style != Style::Line {
            marks.extend(look.marks(vec![[x + 0.5 * KEY, y]]));
        }
        marks.push(text([x + KEY + 9.0, y + 5.5], size, Anchor::Start, name, INK));
        x += wide;
    }
    (marks, y + 18.0 - corner[1])
}

/// The prefix of a unit and the power of ten it stands for, such that a magnitude is in 1 … 1000.
pub(super) fn prefixed(name: &str, magnitude: f64) -> (String, i32) {
    const PREFIXES: [&str; 9] = ["p", "n", "µ", "m", "", "k", "M", "G", "T"];
    const UNITS: [&str; 8] = ["Pa", "m", "N", "N/m", "J", "s", "Hz", "m/s"];
    let power = if magnitude > 0.0 { 3 * (magnitude.log10() / 3.0 + 1e-9).floor() as i32 } else { 0 };
    let plain = (0.01..1e4).contains(&magnitude);
    let prefix = usize::try_from(power / 3 + 4).ok().and_then(|at| PREFIXES.get(at));
    match prefix {
        Some(prefix) if UNITS.contains(&name) => (format!("({prefix}{name})"), power),
        _ if plain => (unit(name, 0), 0),
        _ => (unit(name, power), power),
    }
}

/// "Stiffness C₁₁ (MPa)" and the power of ten that the unit stands for.
fn axis_title(scalar: &Scalar, magnitude: f64) -> (String, i32) {
    let (unit, power) = prefixed(&scalar.unit, magnitude);
    (format!("{} {unit}", scalar.name).trim().into(), power)
}

/// The smallest and the largest of some numbers, apart even if all are equal.
fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)]);
    let magnitude = low.abs().max(high.abs());
    if high - low > 1e-9 * magnitude {
        return [low, high];
    }
    let half = if magnitude > 0.0 { 0.05 * magnitude } else { 1.0 };
    [low - half, high + half]
}

/// Where a panel's numbers are in the drawing.
struct Plot {
    corner: [f64; 2],
    size: [f64; 2],
    /// Titles of the axes.
    titles: [String; 2],
    /// Powers of ten of the units, and the ranges in these units.
    powers: [i32; 2],
    ranges: [[f64; 2]; 2],
    ticks: [Vec<(f64, String)>; 2],
}

impl Plot {
    fn of(panel: &Panel, corner: [f64; 2], size: [f64; 2]) -> Self {
        let values = |axis: usize| panel.series.iter().flat_map(|s| &s.points).map(move |point| point[axis]);
        let magnitude = |axis: usize| values(axis).map(f64::abs).fold(0.0, f64::max);
        let (x_title, x_power) = axis_title(&panel.x, magnitude(0));
        let (y_title, y_power) = axis_title(&panel.y, magnitude(1));
        let [left, right] = range(values(0)).map(|x| in_power(x, x_power));
        let [low, high] = range(values(1)).map(|y| in_power(y, y_power));
        let counts = if size[1] > 300.0 { [9.0, 6.0] } else { [4.0, 4.0] };
        let aside = 0.035 * (right - left);
        let x_range = [left - aside, right + aside];
        let margin = 0.02 * (high - low);
        let (y_range, y_ticks) = round_range(low - margin, high + margin, counts[1]);
        Plot {
            corner,
            size,
            titles: [x_title, y_title],
            powers: [x_power, y_power],
            ticks: [some_ticks(x_range[0], x_range[1], counts[0]), y_ticks],
            ranges: [x_range, y_range],
        }
    }

    /// A position in units of the axes.
    fn place(&self, axis: usize, value: f64) -> f64 {
        let [low, high] = self.ranges[axis];
        let part = (value - low) / (high - low);
        self.corner[axis] + self.size[axis] * if axis == 0 { part } else { 1.0 - part }
    }

    fn marks(&self, panel: &Panel, looks: &[(&str, Look)]) -> Vec<Mark> {
        let mut marks = self.grid();
        for series in &panel.series {
            let Some((_, look)) = looks.iter().find(|(name, _)| *name == series.name) else { continue };
            let at = |point: &[f64; 2]| [0, 1].map(|axis| self.place(axis, in_power(point[axis], self.powers[axis])));
            marks.extend(Look { style: series.style, ..*look }.marks(series.points.iter().map(at).collect()));
        }
        marks
    }

    /// Grid, axes, their numbers and titles.
    fn grid(&self) -> Vec<Mark> {
        let ([left, top], [wide, high]) = (self.corner, self.size);
        let bottom = top + high;
        let mut marks = Vec::new();
        let line = |from, to, width, colour| Mark::Line { from, to, width, colour };
        for (value, words) in &self.ticks[1] {
            let y = self.place(1, *value);
            marks.push(line([left, y], [left + wide, y], 1.2, GRID));
            let (words, size) = fit(words, SIZE, LEFT);
            marks.push(text([left - 10.0, y + 5.3], size, Anchor::End, words, SOFT_INK));
        }
        for (value, words) in &self.ticks[0] {
            let x = self.place(0, *value);
            marks.push(line([x, top], [x, bottom], 1.2, GRID));
            marks.push(line([x, bottom], [x, bottom + 5.0], 1.4, AXIS));
            marks.push(text([x, bottom + 22.0], SIZE, Anchor::Middle, words.as_str(), SOFT_INK));
        }
        marks.push(line([left, bottom], [left + wide, bottom], 1.6, AXIS));
        let (x_title, size) = fit(&self.titles[0], TITLE_SIZE, wide);
        marks.push(text([left + 0.5 * wide, bottom + 47.0], size, Anchor::Middle, x_title, INK));
        let (y_title, size) = fit(&self.titles[1], TITLE_SIZE, wide + LEFT);
        marks.push(text([left - LEFT, top - 20.0], size, Anchor::Start, y_title, INK));
        marks
    }
}
