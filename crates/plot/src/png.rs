//! A drawing as a PNG file: a small rasteriser with antialiased edges.

use super::colour::{HIGHLIGHT, Paint, Rgb, stops};
use super::drawing::{Anchor, Drawing, Mark};
use super::text;
use anisobond::{Error, Result};

/// Widths that make sense (pixels).
const WIDTHS: std::ops::RangeInclusive<u32> = 200..=10_000;

/// Steps of a sphere's shading; neighbouring ones differ by less than one can see.
const SHADES: usize = 128;

/// The file's bytes, for a picture so many pixels wide.
pub(super) fn render(drawing: &Drawing, width: u32) -> Result<Vec<u8>> {
    file_of(std::slice::from_ref(&canvas(drawing, width)?), None)
}

/// The bytes of an animated file (APNG) of drawings of one size, shown over and over.
pub(super) fn animate(drawings: &[Drawing], width: u32, frames_per_second: u16) -> Result<Vec<u8>> {
    let canvases: Result<Vec<Canvas>> = drawings.iter().map(|drawing| canvas(drawing, width)).collect();
    file_of(&canvases?, Some(frames_per_second))
}

/// A drawing as pixels.
fn canvas(drawing: &Drawing, width: u32) -> Result<Canvas> {
    if !WIDTHS.contains(&width) {
        return Err(Error::input(
            format!("the picture is {width} pixels wide"),
            format!("choose a width from {} to {} pixels", WIDTHS.start(), WIDTHS.end()),
        ));
    }
    let scale = f64::from(width) / drawing.size[0];
    let mut canvas = Canvas::new(width as usize, (drawing.size[1] * scale).ceil() as usize);
    for mark in drawing.groups.iter().flat_map(|group| &group.marks) {
        canvas.paint(mark, scale);
    }
    Ok(canvas)
}

fn file_of(canvases: &[Canvas], frames_per_second: Option<u16>) -> Result<Vec<u8>> {
    encode(canvases, frames_per_second)
        .map_err(|error| Error::input(format!("the picture cannot be encoded: {error}"), ""))
}

fn encode(canvases: &[Canvas], frames_per_second: Option<u16>) -> std::result::Result<Vec<u8>, png::EncodingError> {
    let mut file = Vec::new();
    let [width, height] = [canvases[0].width as u32, canvases[0].height as u32];
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    if let Some(rate) = frames_per_second {
        encoder.set_animated(canvases.len() as u32, 0)?;
        encoder.set_frame_delay(1, rate)?;
    }
    let mut writer = encoder.write_header()?;
    for canvas in canvases {
        writer.write_image_data(canvas.pixels.as_flattened())?;
    }
    writer.finish()?;
    Ok(file)
}

/// Opaque pixels, row by row.
struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<Rgb>,
}

impl Canvas {
    fn new(width: usize, height: usize) -> Self {
        Canvas { width, height, pixels: vec![[255; 3]; width * height] }
    }

    fn paint(&mut self, mark: &Mark, scale: f64) {
        let point = |[x, y]: [f64; 2]| [x * scale, y * scale];
        match mark {
            Mark::Sphere { at, radius, paint } => self.sphere(point(*at), radius * scale, *paint),
            Mark::Line { from, to, width, colour } => self.line(point(*from), point(*to), width * scale, *colour),
            Mark::Disc { at, radius, colour } => self.line(point(*at), point(*at), 2.0 * radius * scale, *colour),
            Mark::Polygon { points, colour } => {
                self.polygon(&points.iter().map(|at| point(*at)).collect::<Vec<_>>(), *colour);
            }
            Mark::Path { points, width, colour } => {
                for ends in points.windows(2) {
                    self.line(point(ends[0]), point(ends[1]), width * scale, *colour);
                }
            }
            Mark::Rectangle { at, size, colour } => self.rectangle(point(*at), point(*size), *colour),
            Mark::Text { at, size, anchor, text: words, colour } => {
                let size = size * scale;
                let [x, y] = point(*at);
                let x = match anchor {
                    Anchor::Start => x,
                    Anchor::Middle => x - 0.5 * text::width(words, size),
                    Anchor::End => x - text::width(words, size),
                };
                text::rasterise(words, size, x, y, |column, row, coverage| {
                    self.blend(column, row, *colour, coverage);
                });
            }
        }
    }

    /// Mixes a colour into a pixel by the part of it that is covered; pixels outside the canvas are nothing.
    fn blend(&mut self, column: i64, row: i64, colour: Rgb, coverage: f64) {
        let (Ok(column), Ok(row)) = (usize::try_from(column), usize::try_from(row)) else { return };
        if column >= self.width || row >= self.height || coverage <= 0.0 {
            return;
        }
        let pixel = &mut self.pixels[row * self.width + column];
        let coverage = coverage.min(1.0);
        for channel in 0..3 {
            let (old, new) = (f64::from(pixel[channel]), f64::from(colour[channel]));
            pixel[channel] = (old + (new - old) * coverage + 0.5) as u8;
        }
    }

    /// Calls `colour_at(x, y)`, a colour and a coverage, at the centre of every pixel of a box.
    fn fill(&mut self, low: [f64; 2], high: [f64; 2], colour_at: impl Fn(f64, f64) -> (Rgb, f64)) {
        let range = |axis: usize, size: usize| {
            (low[axis].floor().max(0.0) as i64)..(high[axis].ceil().clamp(0.0, size as f64) as i64)
        };
        for row in range(1, self.height) {
            for column in range(0, self.width) {
                let (colour, coverage) = colour_at(column as f64 + 0.5, row as f64 + 0.5);
                self.blend(column, row, colour, coverage);
            }
        }
    }

    /// A disc shaded as the radial gradient of the SVG file: circles from the highlight to the rim.
    fn sphere(&mut self, [x, y]: [f64; 2], radius: f64, paint: Paint) {
        let shades = shades(paint);
        let [hx, hy] = HIGHLIGHT;
        let rest = 1.0 - (hx * hx + hy * hy);
        let reach = radius + 1.0;
        self.fill([x - reach, y - reach], [x + reach, y + reach], |px, py| {
            let (dx, dy) = (px - x, py - y);
            let distance = dx.hypot(dy);
            let coverage = (radius + 0.5 - distance).clamp(0.0, 1.0);
            // Which circle of radius t around (1 − t)·highlight goes through the point.
            let (gx, gy) = (dx / radius - hx, dy / radius - hy);
            let along = gx * hx + gy * hy;
            let t = (along + (along * along + rest * (gx * gx + gy * gy)).sqrt()) / rest;
            (shades[((t * SHADES as f64) as usize).min(SHADES - 1)], coverage)
        });
    }

    fn line(&mut self, from: [f64; 2], to: [f64; 2], width: f64, colour: Rgb) {
        let reach = 0.5 * width + 1.0;
        let low = [0, 1].map(|axis| from[axis].min(to[axis]) - reach);
        let high = [0, 1].map(|axis| from[axis].max(to[axis]) + reach);
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let squared = (dx * dx + dy * dy).max(f64::MIN_POSITIVE);
        self.fill(low, high, |x, y| {
            let along = (((x - from[0]) * dx + (y - from[1]) * dy) / squared).clamp(0.0, 1.0);
            let distance = (x - from[0] - along * dx).hypot(y - from[1] - along * dy);
            (colour, (0.5 * width + 0.5 - distance).clamp(0.0, 1.0))
        });
    }

    /// A convex polygon; a pixel's part is how far its centre lies inside the nearest edge.
    fn polygon(&mut self, corners: &[[f64; 2]], colour: Rgb) {
        let low = [0, 1].map(|axis| corners.iter().map(|c| c[axis]).fold(f64::INFINITY, f64::min) - 1.0);
        let high = [0, 1].map(|axis| corners.iter().map(|c| c[axis]).fold(f64::NEG_INFINITY, f64::max) + 1.0);
        let edges = || corners.iter().zip(corners.iter().cycle().skip(1));
        let turn: f64 = edges().map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum();
        self.fill(low, high, |x, y| {
            let inside = |(a, b): (&[f64; 2], &[f64; 2])| {
                let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
                let length = dx.hypot(dy).max(f64::MIN_POSITIVE);
                turn.signum() * (dx * (y - a[1]) - dy * (x - a[0])) / length
            };
            let depth = edges().map(inside).fold(f64::INFINITY, f64::min);
            (colour, (depth + 0.5).clamp(0.0, 1.0))
        });
    }

    fn rectangle(&mut self, at: [f64; 2], size: [f64; 2], colour: Rgb) {
        let end = [at[0] + size[0], at[1] + size[1]];
        // The part of a pixel's width, centred at x, between two borders.
        let part = |x: f64, low: f64, high: f64| ((x + 0.5).min(high) - (x - 0.5).max(low)).clamp(0.0, 1.0);
        self.fill(at, end, |x, y| (colour, part(x, at[0], end[0]) * part(y, at[1], end[1])));
    }
}

/// The colours from the highlight (first) to the rim (last).
fn shades(paint: Paint) -> [Rgb; SHADES] {
    let stops = stops(paint);
    std::array::from_fn(|index| {
        let t = (index as f64 + 0.5) / SHADES as f64;
        let upper = stops.iter().position(|stop| stop.0 > t).unwrap_or(stops.len() - 1).max(1);
        let ((t0, low), (t1, high)) = (stops[upper - 1], stops[upper]);
        let part = (t - t0) / (t1 - t0);
        std::array::from_fn(|c| (f64::from(low[c]) + (f64::from(high[c]) - f64::from(low[c])) * part).round() as u8)
    })
}
