//! Pictures of stiffness tensors beside each other: over the contact radius, and along directions.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::chart::{Chart, GRID, Look, Panel, Series, Style, legend, prefixed};
use super::drawing::{Anchor, Drawing, Group, INK, MARGIN, Mark, SOFT_INK, heading, in_power, text};
use super::finished::Picture;
use super::numbers::ticks;
use super::scene::Scalar;
use anisobond::tensor::{DirectionalModuli, Stiffness};
use anisobond::{Error, Result};
use anisobond_formats::flat::{FlatRow, csv_of};

/// The stiffness of a packing at one contact radius, three ways.
#[derive(Clone, Debug)]
pub struct StiffnessRow {
    /// Contact radius I_R.
    pub contact_radius: f64,
    /// What was asked for.
    pub prescribed: Stiffness,
    /// Summed over the lattice (Voigt).
    pub lattice: Stiffness,
    /// Measured by element tests.
    pub measured: Stiffness,
}

/// The document's figure: components of stiffness (Voigt, from 1: `[(1, 1)]` is C₁₁) against the contact radius, one
/// panel each; prescribed, lattice and measured.
///
/// # Errors
/// No row or component, a component outside 1 … 6, numbers that are not finite.
pub fn stiffness_chart(
    title: &str,
    subtitle: &str,
    rows: &[StiffnessRow],
    components: &[(usize, usize)],
) -> Result<Chart> {
    if let Some((a, b)) = components.iter().find(|(a, b)| !(1..=6).contains(a) || !(1..=6).contains(b)) {
        return Err(Error::input(format!("there is no component C{a}{b}"), "use indices from 1 to 6"));
    }
    let mut rows: Vec<&StiffnessRow> = rows.iter().collect();
    rows.sort_by(|a, b| a.contact_radius.total_cmp(&b.contact_radius));
    let panel = |&(a, b): &(usize, usize)| {
        let series = |name: &str, style: Style, of: fn(&StiffnessRow) -> &Stiffness| Series {
            name: name.into(),
            points: rows.iter().map(|row| [row.contact_radius, of(row).voigt()[(a - 1, b - 1)]]).collect(),
            style,
        };
        Panel {
            x: Scalar { name: "Contact radius I_R".into(), unit: String::new() },
            y: Scalar { name: format!("C{}{}", subscript(a), subscript(b)), unit: "Pa".into() },
            series: vec![
                series("prescribed", Style::Line, |row| &row.prescribed),
                series("lattice (sum over bonds)", Style::Marks, |row| &row.lattice),
                series("measured (element tests)", Style::MarkedLine, |row| &row.measured),
            ],
        }
    };
    Chart::new(title, subtitle, components.iter().map(panel).collect())
}

fn subscript(digit: usize) -> char {
    ['₀', '₁', '₂', '₃', '₄', '₅', '₆', '₇', '₈', '₉'][digit % 10]
}

/// The three coordinate planes: the names of the axes to the right and upwards, and these axes.
const PLANES: [(&str, &str, usize, usize); 3] = [("y", "z", 1, 2), ("x", "z", 0, 2), ("x", "y", 0, 1)];
/// Directions around a plane.
const DIRECTIONS: usize = 360;
/// Largest radius of a curve, and half the edge of its panel.
const RADIUS: f64 = 170.0;
const HALF: f64 = 206.0;
/// Least distance between the number of a ring and a curve.
const CLEAR: f64 = 15.0;

/// Young's modulus E(n) (Pa) of each stiffness, at angles from the axis to the right.
fn curves(tensors: &[(&str, &Stiffness)]) -> Result<Vec<[Vec<f64>; 3]>> {
    if tensors.is_empty() {
        return Err(Error::input("there is no stiffness to draw", "give at least one"));
    }
    let curves = |(name, tensor): &(&str, &Stiffness)| -> Result<[Vec<f64>; 3]> {
        let moduli = DirectionalModuli::new(tensor).map_err(|e| e.at(name))?;
        Ok(PLANES.map(|(_, _, right, up)| (0..DIRECTIONS).map(|i| moduli.young(&direction(i, right, up))).collect()))
    };
    tensors.iter().map(curves).collect()
}

fn direction(step: usize, right: usize, up: usize) -> Vector3<f64> {
    let (sin, cos) = (TAU * step as f64 / DIRECTIONS as f64).sin_cos();
    let mut n = Vector3::zeros();
    n[right] = cos;
    n[up] = sin;
    n
}

/// Polar curves of Young's modulus E(n) in the three coordinate planes, for named stiffnesses: prescribed against
/// measured.
///
/// # Errors
/// No stiffness, or one that is not positive definite.
pub fn directional_picture(title: &str, subtitle: &str, tensors: &[(&str, &Stiffness)]) -> Result<Picture> {
    let curves = curves(tensors)?;
    let largest = curves.iter().flatten().flatten().copied().fold(0.0, f64::max);
    let (unit, power) = prefixed("Pa", largest);
    let largest = in_power(largest, power);
    let rings: Vec<(f64, String)> = ticks(0.0, largest).into_iter().filter(|(value, _)| *value > 0.0).collect();
    let looks: Vec<(&str, Look)> = tensors.iter().enumerate().map(|(n, (name, _))| (*name, Look::line(n))).collect();
    let size_x = 2.0 * MARGIN + 6.0 * HALF;
    let mut top = if title.is_empty() { MARGIN } else { 104.0 };
    let mut groups = vec![Group { name: "heading".into(), marks: heading(title, subtitle, size_x - 2.0 * MARGIN) }];
    let (mut marks, height) = legend(&looks, [MARGIN, top], size_x - 2.0 * MARGIN - 420.0);
    let step = rings.first().map_or("", |(_, words)| words);
    let note = format!("Young’s modulus E(n), a ring every {step} {}", unit.trim_matches(['(', ')']));
    marks.push(text([size_x - MARGIN, top + 17.5], 16.0, Anchor::End, note, INK));
    groups.push(Group { name: "legend".into(), marks });
    top += height + 6.0;
    for (panel, &(right, up, ..)) in PLANES.iter().enumerate() {
        let middle = [MARGIN + (2 * panel + 1) as f64 * HALF, top + HALF];
        let mut marks = web(middle, &rings, largest, [right, up]);
        for (curve, (_, look)) in curves.iter().zip(&looks) {
            let at = |step: usize| {
                let radius = RADIUS * in_power(curve[panel][step % DIRECTIONS], power) / largest;
                let (sin, cos) = (TAU * step as f64 / DIRECTIONS as f64).sin_cos();
                [middle[0] + radius * cos, middle[1] - radius * sin]
            };
            marks.push(Mark::Path { points: (0..=DIRECTIONS).map(at).collect(), width: 3.0, colour: look.colour });
        }
        let radii: Vec<[f64; 12]> = curves
            .iter()
            .map(|curve| between_spokes().map(|step| RADIUS * in_power(curve[panel][step], power) / largest))
            .collect();
        marks.extend(ring_names(middle, &rings, largest, &radii));
        let caption = format!("{right}–{up} plane");
        marks.push(text([middle[0], middle[1] + HALF + 12.0], 17.0, Anchor::Middle, caption, INK));
        groups.push(Group { name: format!("panel-{}", panel + 1), marks });
    }
    Ok(Picture(Drawing { size: [size_x, top + 2.0 * HALF + 36.0], title: title.into(), groups }))
}

/// Rings and axes of a polar panel.
fn web(middle: [f64; 2], rings: &[(f64, String)], largest: f64, names: [&str; 2]) -> Vec<Mark> {
    let mut marks = Vec::new();
    let spoke = |angle: f64, length: f64| [middle[0] + length * angle.cos(), middle[1] - length * angle.sin()];
    for step in 0..6 {
        let angle = TAU * f64::from(step) / 12.0;
        let length = if step % 3 == 0 { RADIUS + 14.0 } else { RADIUS };
        let (from, to) = (spoke(angle + TAU / 2.0, length), spoke(angle, length));
        marks.push(Mark::Line { from, to, width: 1.2, colour: GRID });
    }
    for (value, _) in rings {
        let radius = RADIUS * value / largest;
        let points = (0..=120).map(|i| spoke(TAU * f64::from(i) / 120.0, radius)).collect();
        marks.push(Mark::Path { points, width: 1.2, colour: GRID });
    }
    marks.push(text([middle[0] + RADIUS + 24.0, middle[1] + 6.0], 17.0, Anchor::Middle, names[0], INK));
    marks.push(text([middle[0], middle[1] - RADIUS - 20.0], 17.0, Anchor::Middle, names[1], INK));
    marks
}

/// The directions half-way between the spokes, where the numbers of the rings may stand.
fn between_spokes() -> [usize; 12] {
    std::array::from_fn(|k| DIRECTIONS * (2 * k + 1) / 24)
}

/// The numbers of the rings between the two spokes where most of them keep clear of the curves, whose radii there are
/// given; those that would touch one are left out.
fn ring_names(middle: [f64; 2], rings: &[(f64, String)], largest: f64, curves: &[[f64; 12]]) -> Vec<Mark> {
    let ring = |value: f64| RADIUS * value / largest;
    let distance =
        |k: usize, value: f64| curves.iter().map(|c| (c[k] - ring(value)).abs()).fold(f64::INFINITY, f64::min);
    let clear = |k: usize| rings.iter().filter(|(value, _)| distance(k, *value) >= CLEAR).count();
    // Of equals the first: near the axis to the right.
    let best = (0..12).rev().max_by_key(|&k| clear(k)).unwrap_or(0);
    let (sin, cos) = (TAU * between_spokes()[best] as f64 / DIRECTIONS as f64).sin_cos();
    let name = |(value, words): &(f64, String)| {
        let at = [middle[0] + ring(*value) * cos, middle[1] - ring(*value) * sin + 4.5];
        text(at, 13.0, Anchor::Middle, words.as_str(), SOFT_INK)
    };
    rings.iter().filter(|(value, _)| distance(best, *value) >= CLEAR).map(name).collect()
}

/// The curves of [`directional_picture`] as a CSV table: plane, angle from its first axis (degrees), E(n) (Pa) of each.
///
/// # Errors
/// As [`directional_picture`].
pub fn directional_csv(tensors: &[(&str, &Stiffness)]) -> Result<String> {
    let curves = curves(tensors)?;
    let columns: Vec<String> = tensors.iter().map(|(name, _)| format!("{name} E(n) (Pa)")).collect();
    let header: Vec<String> = ["plane".into(), "angle (deg)".into()].into_iter().chain(columns.clone()).collect();
    let mut rows = Vec::new();
    for (panel, (right, up, ..)) in PLANES.iter().enumerate() {
        for step in 0..DIRECTIONS {
            let angle = 360.0 * step as f64 / DIRECTIONS as f64;
            let mut row: FlatRow =
                vec![("plane".into(), format!("{right}{up}").into()), ("angle (deg)".into(), angle.to_string().into())];
            let values = curves.iter().map(|curve| curve[panel][step].to_string().into());
            row.extend(columns.iter().cloned().zip(values));
            rows.push(row);
        }
    }
    csv_of(&header, &rows)
}
