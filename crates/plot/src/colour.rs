//! Colours of numbers, and the shading that makes a disc a sphere.

/// Red, green, blue (0 … 255).
pub(super) type Rgb = [u8; 3];

/// Number of colours of the scale.
pub(super) const LEVELS: usize = VIRIDIS.len();

/// What a sphere is painted with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Paint {
    /// A colour of the scale, from 0 to [`LEVELS`] − 1.
    Level(usize),
    /// The value zero: a bond that carries nothing.
    Zero,
    /// A landmark without a value.
    Landmark,
}

impl Paint {
    /// The colour of a sphere where it is lit straight on.
    pub(super) fn colour(self) -> Rgb {
        match self {
            Paint::Level(level) => VIRIDIS[level.min(LEVELS - 1)],
            Paint::Zero => [214, 217, 221],
            Paint::Landmark => [38, 38, 42],
        }
    }

    /// A name for identifiers.
    pub(super) fn name(self) -> String {
        match self {
            Paint::Level(level) => format!("level-{level}"),
            Paint::Zero => "zero".into(),
            Paint::Landmark => "landmark".into(),
        }
    }
}

/// The brightest point of a sphere, in radii from its centre, x to the right and y downwards.
pub(super) const HIGHLIGHT: [f64; 2] = [-0.30, -0.36];

/// Where along the way from the highlight (0) to the rim (1) the shading has which colour: linear in between, in steps
/// small enough that no rings show, except the bright one that sets a landmark apart from dark neighbours.
pub(super) fn stops(paint: Paint) -> [(f64, Rgb); 8] {
    // Part of white (positive) or black (negative) mixed in.
    const SPHERE: [(f64, f64); 8] =
        [(0.0, 0.45), (0.12, 0.3), (0.26, 0.15), (0.42, 0.05), (0.58, 0.0), (0.8, -0.14), (0.93, -0.32), (1.0, -0.48)];
    const RINGED: [(f64, f64); 8] =
        [(0.0, 0.6), (0.12, 0.4), (0.26, 0.2), (0.42, 0.05), (0.58, 0.0), (0.74, 0.0), (0.79, 0.95), (1.0, 0.95)];
    let base = paint.colour();
    let steps = if paint == Paint::Landmark { RINGED } else { SPHERE };
    steps.map(|(at, part)| (at, mix(base, if part > 0.0 { 255 } else { 0 }, part.abs())))
}

/// A colour mixed with a grey.
pub(super) fn mix(colour: Rgb, grey: u8, part: f64) -> Rgb {
    colour.map(|c| (f64::from(c) * (1.0 - part) + f64::from(grey) * part).round() as u8)
}

/// How numbers become colours: linearly from the smallest to the largest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    /// Smallest and largest value.
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Scale {
    /// The scale of some finite values; `None` if there is none.
    pub(super) fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        values.fold(None, |scale, v| {
            let Scale { low, high } = scale.unwrap_or(Scale { low: v, high: v });
            Some(Scale { low: low.min(v), high: high.max(v) })
        })
    }

    /// Largest magnitude.
    pub(super) fn magnitude(&self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    /// Whether all values are equal, up to rounding.
    pub(super) fn is_single(&self) -> bool {
        self.high - self.low <= 1e-9 * self.magnitude()
    }

    /// Whether a value is zero, up to rounding.
    pub(super) fn is_zero(&self, value: f64) -> bool {
        value.abs() <= 1e-12 * self.magnitude()
    }

    /// Position of a value on the scale, 0 … 1; the middle if all are equal.
    pub(super) fn position(&self, value: f64) -> f64 {
        if self.is_single() {
            return 0.5;
        }
        // Halved, so that the difference of huge numbers of two signs is finite.
        ((0.5 * value - 0.5 * self.low) / (0.5 * self.high - 0.5 * self.low)).clamp(0.0, 1.0)
    }

    /// The paint of a value.
    pub(super) fn paint(&self, value: f64) -> Paint {
        if self.is_zero(value) {
            return Paint::Zero;
        }
        Paint::Level(((self.position(value) * LEVELS as f64) as usize).min(LEVELS - 1))
    }
}

/// The colour map viridis in 64 steps: perceptually uniform, readable in grey and by the colour-blind.
/// By Stéfan van der Walt, Nathaniel Smith and Eric Firing for matplotlib, released under CC0.
const VIRIDIS: [Rgb; 64] = [
    [68, 1, 84],
    [70, 7, 90],
    [71, 13, 96],
    [71, 19, 101],
    [72, 24, 107],
    [72, 30, 111],
    [72, 35, 116],
    [72, 40, 120],
    [71, 45, 124],
    [70, 50, 127],
    [69, 55, 130],
    [67, 60, 132],
    [66, 65, 134],
    [64, 70, 136],
    [62, 74, 137],
    [60, 79, 138],
    [58, 83, 139],
    [56, 87, 140],
    [54, 92, 141],
    [52, 96, 141],
    [50, 100, 142],
    [49, 104, 142],
    [47, 108, 142],
    [45, 112, 142],
    [44, 116, 142],
    [42, 119, 142],
    [41, 123, 142],
    [39, 127, 142],
    [38, 131, 142],
    [36, 135, 142],
    [35, 138, 141],
    [33, 142, 141],
    [32, 146, 140],
    [31, 150, 139],
    [31, 154, 138],
    [31, 157, 137],
    [31, 161, 135],
    [33, 165, 134],
    [35, 169, 132],
    [38, 172, 129],
    [42, 176, 127],
    [47, 180, 124],
    [53, 183, 121],
    [59, 187, 117],
    [66, 190, 113],
    [74, 194, 109],
    [82, 197, 105],
    [90, 200, 100],
    [99, 203, 95],
    [108, 206, 89],
    [118, 208, 84],
    [128, 211, 77],
    [138, 213, 71],
    [148, 216, 65],
    [159, 218, 58],
    [169, 220, 51],
    [180, 221, 44],
    [191, 223, 37],
    [202, 224, 31],
    [212, 226, 26],
    [223, 227, 24],
    [233, 228, 26],
    [243, 230, 30],
    [253, 231, 37],
];

#[cfg(test)]
mod tests {
    use super::*;

    /// CIE lightness, to within what the test needs.
    fn lightness(colour: Rgb) -> f64 {
        let [r, g, b] = colour.map(|c| (f64::from(c) / 255.0).powf(2.2));
        116.0 * (0.2126 * r + 0.7152 * g + 0.0722 * b).cbrt() - 16.0
    }

    #[test]
    fn lightness_rises_evenly_along_the_scale() {
        let steps: Vec<f64> = VIRIDIS.windows(2).map(|w| lightness(w[1]) - lightness(w[0])).collect();
        assert!(steps.iter().all(|&step| step > 0.3 && step < 2.5), "{steps:?}");
    }

    #[test]
    fn larger_values_have_higher_levels_and_zero_is_apart() {
        let scale = Scale::of([0.0, 3e21, 1e21].into_iter()).unwrap();
        let paints: Vec<Paint> = (1..=300).map(|v| scale.paint(f64::from(v) * 1e19)).collect();
        assert!(paints.windows(2).all(|w| w[0] <= w[1]));
        assert_eq!((paints[0], paints[299]), (Paint::Level(0), Paint::Level(LEVELS - 1)));
        assert_eq!((scale.paint(0.0), scale.paint(1e-9)), (Paint::Zero, Paint::Zero));
        let signed = Scale::of([-f64::MAX, f64::MAX].into_iter()).unwrap();
        assert_eq!(signed.paint(-f64::MAX), Paint::Level(0));
    }

    #[test]
    fn equal_values_share_the_middle() {
        let scale = Scale::of([2.0, 2.0 + 1e-12].into_iter()).unwrap();
        assert!(scale.is_single());
        assert_eq!(scale.paint(2.0), Paint::Level(LEVELS / 2));
        assert_eq!(Scale::of([0.0; 3].into_iter()).unwrap().paint(0.0), Paint::Zero);
        assert!(Scale::of(std::iter::empty()).is_none());
    }
}
