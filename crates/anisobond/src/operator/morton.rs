//! A space-filling curve: nodes close in space come close in memory.

use nalgebra::Vector3;

/// Bits per axis.
const BITS: u32 = 16;

/// The order of points along the Morton curve through their bounding box; equal codes keep the given order.
pub(super) fn morton_order(points: &[Vector3<f64>]) -> Vec<u32> {
    let Some(first) = points.first() else { return Vec::new() };
    let (low, high) = points.iter().fold((*first, *first), |(low, high), x| (low.inf(x), high.sup(x)));
    let edge = (high - low).max().max(f64::MIN_POSITIVE);
    let steps = f64::from((1u32 << BITS) - 1);
    let mut order: Vec<(u64, u32)> = points
        .iter()
        .enumerate()
        .map(|(i, x)| {
            let [a, b, c] = ((x - low) / edge * steps).data.0[0].map(|t| spread(t as u64));
            (a << 2 | b << 1 | c, i as u32)
        })
        .collect();
    order.sort_unstable();
    order.into_iter().map(|(_, i)| i).collect()
}

/// The bits of x, two zeros after each.
fn spread(x: u64) -> u64 {
    (0..BITS).map(|k| (x >> k & 1) << (3 * k)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_eight_corners_come_in_the_order_of_their_octants() {
        let corners: Vec<Vector3<f64>> =
            (0..8).rev().map(|k| Vector3::new((k >> 2) as f64, (k >> 1 & 1) as f64, (k & 1) as f64)).collect();
        assert_eq!(morton_order(&corners), [7, 6, 5, 4, 3, 2, 1, 0]);
        assert_eq!(morton_order(&[Vector3::zeros(); 3]), [0, 1, 2]);
    }
}
