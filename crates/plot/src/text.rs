//! The font of pictures, DejaVu Sans: inside the program, so that a picture does not depend on the machine.
//! Its licence, permissive, is in LICENSE-DejaVu.txt and goes with every copy of the program.

use std::sync::OnceLock;

use ab_glyph::{Font, FontRef, ScaleFont, point};

/// Fonts for readers of an SVG file without DejaVu Sans: those of nearly its widths first.
pub(super) const FAMILY: &str = "DejaVu Sans, Verdana, Segoe UI, Helvetica, Arial, sans-serif";

fn font() -> Option<&'static FontRef<'static>> {
    static FONT: OnceLock<Option<FontRef<'static>>> = OnceLock::new();
    FONT.get_or_init(|| FontRef::try_from_slice(dejavu::sans::regular()).ok()).as_ref()
}

/// Pixels per em of a font size, in the units of ab_glyph (which counts from ascent to descent).
fn scale(font: &FontRef, size: f64) -> f32 {
    size as f32 * font.height_unscaled() / font.units_per_em().unwrap_or(2048.0)
}

/// Width of a line of text of a given size, in the same units as the size.
pub(super) fn width(text: &str, size: f64) -> f64 {
    let Some(font) = font() else { return 0.6 * size * text.chars().count() as f64 };
    let font = font.as_scaled(scale(font, size));
    text.chars().map(|c| f64::from(font.h_advance(font.glyph_id(c)))).sum()
}

/// The text cut short and the size made smaller until it is at most so wide.
pub(super) fn fit(text: &str, size: f64, most: f64) -> (String, f64) {
    let needed = width(text, size);
    if needed <= most {
        return (text.into(), size);
    }
    let smaller = size * (most / needed).max(0.7);
    let mut kept: Vec<char> = text.chars().collect();
    let mut shown = text.to_string();
    while width(&shown, smaller) > most && kept.pop().is_some() {
        shown = kept.iter().collect::<String>().trim_end().to_string() + "…";
    }
    (shown, smaller)
}

/// Calls `paint(column, row, coverage)` for every pixel that a line of text touches; (x, y) is the left end of its
/// baseline.
pub(super) fn rasterise(text: &str, size: f64, x: f64, y: f64, mut paint: impl FnMut(i64, i64, f64)) {
    let Some(font) = font() else { return };
    let em = scale(font, size);
    let scaled = font.as_scaled(em);
    let mut left = x as f32;
    for c in text.chars() {
        let id = scaled.glyph_id(c);
        let glyph = id.with_scale_and_position(em, point(left, y as f32));
        left += scaled.h_advance(id);
        if let Some(outline) = font.outline_glyph(glyph) {
            let corner = outline.px_bounds().min;
            outline.draw(|column, row, coverage| {
                let (column, row) = (corner.x as i64 + i64::from(column), corner.y as i64 + i64::from(row));
                paint(column, row, f64::from(coverage).clamp(0.0, 1.0));
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_font_has_every_letter_of_the_pictures() {
        let font = font().unwrap();
        for c in "Micromodulus c (10⁻¹²³⁴⁵⁶⁷⁸⁹⁰ N/m⁶) ωξδΔ|− × · ₀₁₂₃ … µ".chars()
        {
            assert_ne!(font.glyph_id(c).0, 0, "{c}");
        }
    }

    #[test]
    fn widths_grow_with_text_and_size() {
        assert!((width("nn", 20.0) - 2.0 * width("n", 20.0)).abs() < 1e-3);
        assert!((width("word", 40.0) - 2.0 * width("word", 20.0)).abs() < 1e-3);
        // The n of DejaVu Sans is 1298/2048 em wide.
        assert!((width("n", 2048.0) - 1298.0).abs() < 0.5);
    }

    #[test]
    fn long_text_is_made_to_fit() {
        assert_eq!(fit("short", 20.0, 500.0), ("short".to_string(), 20.0));
        let long = "a very long name of a rock ".repeat(10);
        let (shown, size) = fit(&long, 20.0, 300.0);
        assert!(shown.ends_with('…') && size < 20.0 && width(&shown, size) <= 300.0);
    }
}
