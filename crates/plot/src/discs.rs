//! Spheres cut by a plane, as numbers on a raster: each shows as the disc that the plane cuts out of it.

use super::slice::SliceImage;

/// Cells of the raster along a sphere's mean radius, and along the longer side at most.
const CELLS_PER_RADIUS: f64 = 6.0;
const MOST_CELLS: f64 = 700.0;

/// The part of a plane that a raster shows: lower and upper corner (m), to the right and upwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Lower left corner (m).
    pub low: [f64; 2],
    /// Upper right corner (m).
    pub high: [f64; 2],
}

/// The disc that a plane cuts out of a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Its centre (m), to the right and upwards.
    pub centre: [f64; 2],
    /// Its radius √(r² − d²) (m), d the distance of the sphere's centre from the plane.
    pub radius: f64,
    /// The number that colours it.
    pub value: f32,
}

impl Window {
    /// Width of a raster's cell (m) for spheres of a mean radius (m).
    fn cell(&self, radius: f64) -> f64 {
        let longer = (self.high[0] - self.low[0]).max(self.high[1] - self.low[1]);
        (radius / CELLS_PER_RADIUS).max(longer / MOST_CELLS)
    }

    /// Discs on a raster as fine as spheres of a mean radius (m) need; NaN where there is none, and where discs overlap
    /// the value of the larger. Heading, quantity and axes are those of `about`.
    pub fn raster(&self, discs: &[Disc], radius: f64, about: SliceImage) -> SliceImage {
        let cell = self.cell(radius);
        let cells = [0, 1].map(|a| (((self.high[a] - self.low[a]) / cell).ceil() as usize).max(1));
        let mut values = vec![f32::NAN; cells[0] * cells[1]];
        let mut discs: Vec<&Disc> = discs.iter().filter(|d| d.radius > 0.0).collect();
        discs.sort_by(|a, b| a.radius.total_cmp(&b.radius));
        for disc in discs {
            // Cell i has its middle at low + (i + ½) cell.
            let range = |a: usize, centre: f64, half: f64| {
                let from = ((centre - half - self.low[a]) / cell - 0.5).ceil().max(0.0);
                let to = ((centre + half - self.low[a]) / cell - 0.5).floor().min(cells[a] as f64 - 1.0);
                if from <= to { from as usize..to as usize + 1 } else { 0..0 }
            };
            for row in range(1, disc.centre[1], disc.radius) {
                let up = self.low[1] + (row as f64 + 0.5) * cell - disc.centre[1];
                let half = (disc.radius * disc.radius - up * up).max(0.0).sqrt();
                let columns = range(0, disc.centre[0], half);
                values[row * cells[0]..][columns].fill(disc.value);
            }
        }
        SliceImage { cells, spacing: cell, values, ..about }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn about() -> SliceImage {
        SliceImage {
            title: String::new(),
            subtitle: String::new(),
            quantity: [String::new(), String::new()],
            axes: ["x", "y"],
            cells: [0, 0],
            spacing: 0.0,
            values: Vec::new(),
        }
    }

    /// The area of the cells of a disc is that of the disc, and its centroid the centre.
    #[test]
    fn discs_have_their_area_and_place() {
        let window = Window { low: [-2.0, -1.0], high: [2.0, 1.0] };
        for (centre, radius) in [([0.3, 0.1], 0.7), ([-1.2, -0.2], 0.5), ([0.0, 0.0], 0.31)] {
            let image = window.raster(&[Disc { centre, radius, value: 3.0 }], 0.2, about());
            let inside: Vec<usize> = (0..image.values.len()).filter(|&i| image.values[i] == 3.0).collect();
            let area = inside.len() as f64 * image.spacing.powi(2);
            let exact = std::f64::consts::PI * radius * radius;
            assert!((area / exact - 1.0).abs() < 0.02, "{area} {exact}");
            let middle = |a: usize, of: &dyn Fn(usize) -> usize| {
                let sum: f64 = inside.iter().map(|&i| of(i) as f64 + 0.5).sum();
                window.low[a] + sum / inside.len() as f64 * image.spacing
            };
            assert!((middle(0, &|i| i % image.cells[0]) - centre[0]).abs() < 0.01);
            assert!((middle(1, &|i| i / image.cells[0]) - centre[1]).abs() < 0.01);
        }
    }

    /// Discs beyond the window or smaller than a cell do no harm; of two the larger is on top.
    #[test]
    fn discs_at_the_border() {
        let window = Window { low: [0.0, 0.0], high: [1.0, 1.0] };
        let disc = |x: f64, radius: f64, value: f32| Disc { centre: [x, 0.5], radius, value };
        let image = window.raster(&[disc(0.5, 0.3, 2.0), disc(0.5, 0.1, 1.0), disc(9.0, 0.5, 7.0)], 0.1, about());
        assert_eq!(image.range(), Some([2.0, 2.0]));
        let none = window.raster(&[disc(-0.5, 1e-9, 1.0), disc(0.5, f64::NAN, 1.0)], 0.1, about());
        assert_eq!(none.range(), None);
    }
}
