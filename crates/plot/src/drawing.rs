//! From a scene to marks in the plane: where panels, spheres, axes, words and the colour bar go.
//!
//! Picture units are pixels of a picture at its natural width; x to the right, y downwards.

use nalgebra::Vector3;

use super::camera::Camera;
use super::colour::{LEVELS, Paint, Rgb, Scale, mix};
use super::numbers::{engineering_power, significant, superscript, ticks};
use super::scene::{Ball, Rod, Scene, View};
use super::text::{fit, width};

pub(super) const MARGIN: f64 = 28.0;
/// Width of a panel, and its largest and smallest height: low enough for a flat packing, high enough for the colour bar.
const PANEL: f64 = 470.0;
const LOWEST_PANEL: f64 = 370.0;
const GAP: f64 = 14.0;
/// Height below a panel's picture, for the axes and the caption.
const STRIP: f64 = 92.0;
/// Length of the arrows that show the axes.
const ARROW: f64 = 30.0;
/// Part of white mixed into the farthest rod.
const HAZE: f64 = 0.72;
/// Width of the thinnest rod.
const THINNEST: f64 = 0.5;
const BAR: [f64; 2] = [24.0, 300.0];

pub(super) const INK: Rgb = [34, 36, 42];
pub(super) const SOFT_INK: Rgb = [88, 92, 100];
const AXES: [(&str, Rgb); 3] = [("x", [192, 57, 43]), ("y", [30, 122, 70]), ("z", [36, 86, 170])];

/// Which point of a line of text is given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// One thing to paint.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Mark {
    /// A shaded disc.
    Sphere { at: [f64; 2], radius: f64, paint: Paint },
    /// A straight line with round ends.
    Line { from: [f64; 2], to: [f64; 2], width: f64, colour: Rgb },
    /// A flat disc.
    Disc { at: [f64; 2], radius: f64, colour: Rgb },
    /// A filled convex polygon.
    Polygon { points: Vec<[f64; 2]>, colour: Rgb },
    /// A line through points, with round joints and ends.
    Path { points: Vec<[f64; 2]>, width: f64, colour: Rgb },
    /// A filled rectangle, from its upper left corner.
    Rectangle { at: [f64; 2], size: [f64; 2], colour: Rgb },
    /// A line of text on its baseline.
    Text { at: [f64; 2], size: f64, anchor: Anchor, text: String, colour: Rgb },
}

/// Marks that belong together, in the order of painting.
pub(super) struct Group {
    pub(super) name: String,
    pub(super) marks: Vec<Mark>,
}

/// A picture as marks.
pub(super) struct Drawing {
    pub(super) size: [f64; 2],
    pub(super) title: String,
    pub(super) groups: Vec<Group>,
}

impl Drawing {
    /// The drawing of a scene.
    pub(super) fn of(scene: &Scene) -> Self {
        let values = || scene.balls.iter().filter_map(|ball| ball.value).chain(scene.rods.iter().map(|rod| rod.value));
        let scale = Scale::of(values());
        let top = if scene.title.is_empty() { MARGIN } else { 96.0 };
        let panels = scene.views.len() as f64;
        let bar_left = MARGIN + panels * (PANEL + GAP) + 12.0;
        let bar = scale.map(|scale| colour_bar(scene, &scale, values(), [bar_left, top + 6.0]));
        let (bar_marks, bar_right) = bar.unwrap_or((Vec::new(), bar_left - 12.0 - GAP));

        let seen: Vec<Seen> = scene.views.iter().map(|view| Seen::of(scene, view, scale.as_ref())).collect();
        let metre = seen.iter().map(Seen::largest_scale).fold(f64::INFINITY, f64::min);
        let height = seen.iter().map(|seen| seen.height() * metre).fold(LOWEST_PANEL, f64::max).min(PANEL);
        let size = [bar_right + MARGIN, top + height + STRIP + 8.0];

        let mut groups = vec![Group {
            name: "heading".into(),
            marks: heading(&scene.title, &scene.subtitle, size[0] - 2.0 * MARGIN),
        }];
        for (index, (seen, view)) in seen.iter().zip(&scene.views).enumerate() {
            let left = MARGIN + index as f64 * (PANEL + GAP);
            let middle = [left + 0.5 * PANEL, top + 0.5 * height];
            groups.push(Group { name: format!("panel-{}", index + 1), marks: seen.marks(middle, metre) });
            let letter = if scene.views.len() > 1 { letter(index) } else { String::new() };
            let marks = legend(view, &letter, [left, top + height]);
            groups.push(Group { name: format!("legend-{}", index + 1), marks });
        }
        groups.push(Group { name: "colour-bar".into(), marks: bar_marks });
        Drawing { size, title: scene.title.clone(), groups }
    }
}

/// What one view shows, projected (m) and sorted from the farthest to the nearest.
struct Seen {
    bodies: Vec<Body>,
    low: [f64; 2],
    high: [f64; 2],
}

/// A projected sphere or rod (m).
enum Body {
    Sphere { at: [f64; 2], radius: f64, paint: Paint },
    Rod { ends: [[f64; 2]; 2], radius: f64, colour: Rgb },
}

/// Makes far rods paler, as haze does, so that one sees which are in front: bodies sorted by how near they are.
fn fade(bodies: &mut [(f64, Body)]) {
    let (Some(far), Some(near)) = (bodies.first().map(|b| b.0), bodies.last().map(|b| b.0)) else { return };
    for (nearness, body) in bodies {
        if let Body::Rod { colour, .. } = body {
            let part = if near > far { ((near - *nearness) / (near - far)).clamp(0.0, 1.0) } else { 0.0 };
            *colour = mix(*colour, 255, HAZE * part.powf(0.8));
        }
    }
}

impl Seen {
    fn of(scene: &Scene, view: &View, scale: Option<&Scale>) -> Self {
        let (camera, middle) = (Camera::of(view), scene.middle());
        let extent = scene.balls.iter().map(|ball| (ball.centre - middle).amax()).fold(0.0, f64::max);
        let paint = |value: Option<f64>| match (value, scale) {
            (Some(value), Some(scale)) => scale.paint(value),
            _ => Paint::Landmark,
        };
        let sphere = |ball: &Ball| {
            let from_middle = ball.centre - middle;
            let at = camera.project(&from_middle);
            (from_middle, Body::Sphere { at, radius: ball.radius, paint: paint(ball.value) })
        };
        let rod = |rod: &Rod| {
            let ends = rod.ends.map(|end| camera.project(&(end - middle)));
            let from_middle = 0.5 * (rod.ends[0] - middle) + 0.5 * (rod.ends[1] - middle);
            (from_middle, Body::Rod { ends, radius: rod.radius, colour: paint(Some(rod.value)).colour() })
        };
        let mut shown: Vec<(f64, Body)> = scene
            .balls
            .iter()
            .map(sphere)
            .chain(scene.rods.iter().map(rod))
            .filter(|(from_middle, _)| view.shows(from_middle, extent))
            .map(|(from_middle, body)| (camera.nearness(&from_middle), body))
            .collect();
        shown.sort_by(|a, b| a.0.total_cmp(&b.0));
        fade(&mut shown);
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut reach = |at: &[f64; 2], radius: f64| {
            for axis in 0..2 {
                low[axis] = low[axis].min(at[axis] - radius);
                high[axis] = high[axis].max(at[axis] + radius);
            }
        };
        for (_, body) in &shown {
            match body {
                Body::Sphere { at, radius, .. } => reach(at, *radius),
                Body::Rod { ends, radius, .. } => ends.iter().for_each(|end| reach(end, *radius)),
            }
        }
        Seen { bodies: shown.into_iter().map(|(_, body)| body).collect(), low, high }
    }

    /// Picture units per metre at which the view fills its panel.
    fn largest_scale(&self) -> f64 {
        let extent = (self.high[0] - self.low[0]).max(self.high[1] - self.low[1]);
        // A cut may have removed everything.
        if extent > 0.0 { PANEL / extent } else { f64::INFINITY }
    }

    /// Height (m).
    fn height(&self) -> f64 {
        (self.high[1] - self.low[1]).max(0.0)
    }

    /// The spheres and rods around a point of the drawing.
    fn marks(&self, at_middle: [f64; 2], metre: f64) -> Vec<Mark> {
        let middle = [0, 1].map(|axis| 0.5 * self.low[axis] + 0.5 * self.high[axis]);
        let place =
            |at: &[f64; 2]| [at_middle[0] + (at[0] - middle[0]) * metre, at_middle[1] - (at[1] - middle[1]) * metre];
        let mark = |body: &Body| match body {
            Body::Sphere { at, radius, paint } => Mark::Sphere { at: place(at), radius: radius * metre, paint: *paint },
            Body::Rod { ends, radius, colour } => {
                let [from, to] = ends.each_ref().map(place);
                Mark::Line { from, to, width: (2.0 * radius * metre).max(THINNEST), colour: *colour }
            }
        };
        self.bodies.iter().map(mark).collect()
    }
}

pub(super) fn text(at: [f64; 2], size: f64, anchor: Anchor, text: impl Into<String>, colour: Rgb) -> Mark {
    Mark::Text { at, size, anchor, text: text.into(), colour }
}

/// The title and the line below it, at most so wide.
pub(super) fn heading(title: &str, subtitle: &str, most: f64) -> Vec<Mark> {
    let lines = [(title, 26.0, 50.0, INK), (subtitle, 17.0, 79.0, SOFT_INK)];
    let shown = lines.into_iter().filter(|(line, ..)| !line.is_empty());
    shown
        .map(|(line, size, y, colour)| {
            let (line, size) = fit(line, size, most);
            text([MARGIN, y], size, Anchor::Start, line, colour)
        })
        .collect()
}

/// "(a) ", "(b) ", …
fn letter(index: usize) -> String {
    match u8::try_from(index) {
        Ok(index) if index < 26 => format!("({}) ", char::from(b'a' + index)),
        _ => format!("({}) ", index + 1),
    }
}

/// The axes and the caption of a panel whose lower left corner is given.
fn legend(view: &View, letter: &str, corner: [f64; 2]) -> Vec<Mark> {
    let origin = [corner[0] + 44.0, corner[1] + 50.0];
    let mut marks = axes(&Camera::of(view), origin);
    // The caption keeps clear of the axes on the left and, to stay in the middle, as much on the right.
    let (caption, size) = fit(&format!("{letter}{}", view.caption), 19.0, PANEL - 2.0 * 92.0);
    marks.push(text([corner[0] + 0.5 * PANEL, origin[1] + 7.0], size, Anchor::Middle, caption, INK));
    marks
}

/// Three arrows along the axes, the farthest first.
fn axes(camera: &Camera, origin: [f64; 2]) -> Vec<Mark> {
    let directions = [Vector3::x(), Vector3::y(), Vector3::z()];
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| camera.nearness(&directions[a]).total_cmp(&camera.nearness(&directions[b])));
    order.into_iter().flat_map(|axis| arrow(origin, camera.project(&directions[axis]), AXES[axis])).collect()
}

/// An arrow from `origin` along a projected unit vector, with its name beyond the tip.
fn arrow(origin: [f64; 2], [right, up]: [f64; 2], (name, colour): (&str, Rgb)) -> Vec<Mark> {
    let length = right.hypot(up);
    // Seen nearly end on, an axis is a dot with its name beside it.
    let (dx, dy) = if length > 0.05 { (right / length, -up / length) } else { (-0.7, 0.7) };
    let tip = [origin[0] + ARROW * right, origin[1] - ARROW * up];
    let line = |from, to| Mark::Line { from, to, width: 2.4, colour };
    let mut marks = vec![line(origin, tip)];
    if length > 0.3 {
        for side in [-1.0, 1.0] {
            marks.push(line([tip[0] - 7.0 * dx - 4.0 * side * dy, tip[1] - 7.0 * dy + 4.0 * side * dx], tip));
        }
    }
    marks.push(text([tip[0] + 11.0 * dx, tip[1] + 11.0 * dy + 5.0], 16.0, Anchor::Middle, name, colour));
    marks
}

/// The colour bar with its upper left corner at `at`, and its right end.
fn colour_bar(scene: &Scene, scale: &Scale, values: impl Iterator<Item = f64>, at: [f64; 2]) -> (Vec<Mark>, f64) {
    let power = engineering_power(scale.magnitude());
    let [x, mut y] = at;
    let mut marks = Vec::new();
    let mut line = |x: f64, y: f64, size: f64, words: String, colour: Rgb| {
        marks.push(text([x, y], size, Anchor::Start, words, colour))
    };
    line(x, y + 16.0, 17.0, scene.scalar.name.clone(), INK);
    line(x, y + 40.0, 17.0, unit(&scene.scalar.unit, power), INK);
    y += 62.0;
    let (zeros, all) = values.fold((0, 0), |(zeros, all), v| (zeros + usize::from(scale.is_zero(v)), all + 1));
    if zeros < all {
        let digits = |value| significant(in_power(value, power), 4);
        if !scale.is_single() {
            line(x, y + BAR[1] + 30.0, 15.0, format!("max {}", digits(scale.high)), SOFT_INK);
            line(x, y + BAR[1] + 52.0, 15.0, format!("min {}", digits(scale.low)), SOFT_INK);
        }
        marks.extend(bar([x, y], scale, power));
        y += BAR[1] + 66.0;
    }
    if zeros > 0 {
        marks.push(Mark::Sphere { at: [x + 8.0, y + 8.0], radius: 8.0, paint: Paint::Zero });
        marks.push(text([x + 24.0, y + 13.5], 15.0, Anchor::Start, format!("zero: {zeros} of {all}"), SOFT_INK));
    }
    let right = marks.iter().map(right_end).fold(x, f64::max);
    (marks, right)
}

/// The bar itself with ticks.
fn bar([x, y]: [f64; 2], scale: &Scale, power: i32) -> Vec<Mark> {
    let [wide, high] = BAR;
    let mut marks = Vec::new();
    let rectangle = |at, size, colour| Mark::Rectangle { at, size, colour };
    marks.push(rectangle([x - 1.0, y - 1.0], [wide + 2.0, high + 2.0], SOFT_INK));
    let ticks = if scale.is_single() {
        marks.push(rectangle([x, y], [wide, high], scale.paint(scale.high).colour()));
        vec![(0.5, significant(in_power(scale.high, power), 6))]
    } else {
        // Each step covers the rest of the bar below it, so that no seams show between them.
        for level in (0..LEVELS).rev() {
            let down = high * (LEVELS - 1 - level) as f64 / LEVELS as f64;
            marks.push(rectangle([x, y + down], [wide, high - down], Paint::Level(level).colour()));
        }
        let (low, high) = (in_power(scale.low, power), in_power(scale.high, power));
        ticks(low, high).into_iter().map(|(value, words)| ((value - low) / (high - low), words)).collect()
    };
    for (position, words) in ticks {
        let level = y + high * (1.0 - position);
        let (from, to) = ([x + wide + 1.0, level], [x + wide + 7.0, level]);
        marks.push(Mark::Line { from, to, width: 1.4, colour: SOFT_INK });
        marks.push(text([x + wide + 13.0, level + 5.5], 16.0, Anchor::Start, words, INK));
    }
    marks
}

/// A value in units of 10^power, for powers beyond those of f64 too.
pub(super) fn in_power(value: f64, power: i32) -> f64 {
    value * 10f64.powi(-(power / 2)) * 10f64.powi(-(power - power / 2))
}

/// "(10⁹ N/m⁶)".
pub(super) fn unit(unit: &str, power: i32) -> String {
    let factor = if power == 0 { String::new() } else { format!("10{}", superscript(power)) };
    match (factor.is_empty(), unit.is_empty()) {
        (true, true) => String::new(),
        (true, false) => format!("({unit})"),
        (false, true) => format!("({factor})"),
        (false, false) => format!("({factor} {unit})"),
    }
}

fn right_end(mark: &Mark) -> f64 {
    match mark {
        Mark::Text { at, size, text, .. } => at[0] + width(text, *size),
        Mark::Rectangle { at, size, .. } => at[0] + size[0],
        Mark::Sphere { at, radius, .. } | Mark::Disc { at, radius, .. } => at[0] + radius,
        Mark::Polygon { points, .. } | Mark::Path { points, .. } => {
            points.iter().map(|point| point[0]).fold(f64::NEG_INFINITY, f64::max)
        }
        Mark::Line { from, to, .. } => from[0].max(to[0]),
    }
}
