//! Results of a sweep drawn over one of its parameters.

use super::store::Store;
use anisobond::Result;
use anisobond_plot::{Chart, Panel, Scalar, Series, Style};

/// A chart of results over a parameter: a panel for each of the columns `ys` (names as in [`Store::csv`]) over the column
/// `x`, and in it a series for each value of the column `by`, if there is one. Points are joined in the order of x.
///
/// # Errors
/// A column that is not there, with the nearest name; no job with these numbers; a store that cannot be read.
pub fn sweep_chart(store: &Store, title: &str, x: &str, ys: &[&str], by: Option<&str>) -> Result<Chart> {
    let scalar = |name: &str| Scalar { name: name.into(), unit: String::new() };
    let panel = |y: &&str| -> Result<Panel> {
        let mut groups: Vec<(String, Vec<[f64; 2]>)> = Vec::new();
        for (group, point) in store.grouped_points(x, y, by)? {
            match groups.iter_mut().find(|(name, _)| *name == group) {
                Some((_, points)) => points.push(point),
                None => groups.push((group, vec![point])),
            }
        }
        let series = groups.into_iter().map(|(value, mut points)| {
            points.sort_by(|a, b| a[0].total_cmp(&b[0]));
            let name = by.map_or(String::new(), |by| format!("{by} = {value}"));
            Series { name, points, style: Style::MarkedLine }
        });
        Ok(Panel { x: scalar(x), y: scalar(y), series: series.collect() })
    };
    Chart::new(title, "", ys.iter().map(panel).collect::<Result<_>>()?)
}
