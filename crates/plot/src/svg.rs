//! A drawing as an SVG file. Spheres of one colour share one gradient.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::colour::{HIGHLIGHT, Paint, Rgb, stops};
use super::drawing::{Anchor, Drawing, Mark};
use super::text::FAMILY;

/// The file's text.
pub(super) fn render(drawing: &Drawing) -> String {
    let marks = drawing.groups.iter().map(|group| group.marks.len()).sum::<usize>();
    let mut svg = String::with_capacity(80 * marks + 30_000);
    let [width, height] = drawing.size;
    let _ = writeln!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.1} {height:.1}\" width=\"{width:.1}\" \
         height=\"{height:.1}\" font-family=\"{FAMILY}\" role=\"img\">"
    );
    let _ = writeln!(svg, "<title>{}</title>", escape(&drawing.title));
    let _ = writeln!(svg, "<defs>");
    for paint in paints(drawing) {
        gradient(&mut svg, paint);
    }
    let _ = writeln!(svg, "</defs>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>");
    for group in &drawing.groups {
        let _ = writeln!(svg, "<g id=\"{}\">", escape(&group.name));
        for mark in &group.marks {
            write_mark(&mut svg, mark);
        }
        let _ = writeln!(svg, "</g>");
    }
    svg.push_str("</svg>\n");
    svg
}

fn paints(drawing: &Drawing) -> BTreeSet<Paint> {
    let marks = drawing.groups.iter().flat_map(|group| &group.marks);
    marks.filter_map(|mark| if let Mark::Sphere { paint, .. } = mark { Some(*paint) } else { None }).collect()
}

/// The shading of a sphere, relative to the circle it fills.
fn gradient(svg: &mut String, paint: Paint) {
    let [fx, fy] = HIGHLIGHT.map(|x| 0.5 + 0.5 * x);
    let _ = write!(svg, "<radialGradient id=\"{}\" fx=\"{fx:.3}\" fy=\"{fy:.3}\">", paint.name());
    for (offset, colour) in stops(paint) {
        let _ = write!(svg, "<stop offset=\"{offset}\" stop-color=\"{}\"/>", hex(colour));
    }
    let _ = writeln!(svg, "</radialGradient>");
}

fn write_mark(svg: &mut String, mark: &Mark) {
    let _ = match mark {
        Mark::Sphere { at: [x, y], radius, paint } => {
            writeln!(svg, "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius:.2}\" fill=\"url(#{})\"/>", paint.name())
        }
        Mark::Line { from, to, width, colour } => writeln!(
            svg,
            "<line x1=\"{:.2}\" y1=\"{:.2}\" x2=\"{:.2}\" y2=\"{:.2}\" stroke-width=\"{width}\" stroke=\"{}\" \
             stroke-linecap=\"round\"/>",
            from[0],
            from[1],
            to[0],
            to[1],
            hex(*colour)
        ),
        Mark::Disc { at: [x, y], radius, colour } => {
            writeln!(svg, "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius:.2}\" fill=\"{}\"/>", hex(*colour))
        }
        Mark::Polygon { points: corners, colour } => {
            writeln!(svg, "<polygon points=\"{}\" fill=\"{}\"/>", points(corners), hex(*colour))
        }
        Mark::Path { points: stations, width, colour } => writeln!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke-width=\"{width}\" stroke=\"{}\" stroke-linecap=\"round\" \
             stroke-linejoin=\"round\"/>",
            points(stations),
            hex(*colour)
        ),
        Mark::Rectangle { at: [x, y], size: [width, height], colour } => writeln!(
            svg,
            "<rect x=\"{x:.2}\" y=\"{y:.2}\" width=\"{width:.2}\" height=\"{height:.2}\" fill=\"{}\"/>",
            hex(*colour)
        ),
        Mark::Text { at: [x, y], size, anchor, text, colour } => writeln!(
            svg,
            "<text x=\"{x:.2}\" y=\"{y:.2}\" font-size=\"{size:.2}\" fill=\"{}\"{}>{}</text>",
            hex(*colour),
            match anchor {
                Anchor::Start => "",
                Anchor::Middle => " text-anchor=\"middle\"",
                Anchor::End => " text-anchor=\"end\"",
            },
            escape(text)
        ),
    };
}

fn points(points: &[[f64; 2]]) -> String {
    points.iter().map(|[x, y]| format!("{x:.2},{y:.2}")).collect::<Vec<_>>().join(" ")
}

fn hex([red, green, blue]: Rgb) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// Text as XML: markup escaped, characters that XML 1.0 does not know replaced.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => escaped.push(' '),
            c => escaped.push(c),
        }
    }
    escaped
}
