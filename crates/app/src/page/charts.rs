//! Charts of a run: its history and its cracks.

use serde::Serialize;

use super::table::Columns;

/// Lines of one chart.
pub(super) const MOST_LINES: usize = 12;

/// Lines over a common x.
#[derive(Serialize)]
pub(super) struct Chart {
    /// What the charts have in common that may be compared in size; empty if all may.
    pub panel: String,
    pub title: String,
    pub x: String,
    pub y: String,
    pub series: Vec<Series>,
    /// What is left out; empty if nothing.
    pub note: String,
}

#[derive(Serialize)]
pub(super) struct Series {
    pub name: String,
    pub points: Vec<[f64; 2]>,
}

impl Chart {
    /// Whether there is a line to draw.
    pub fn has_lines(&self) -> bool {
        self.series.iter().any(|s| s.points.len() > 1)
    }

    /// With the first lines only if there are many, which is said.
    pub fn shortened(mut self) -> Self {
        if self.series.len() > MOST_LINES {
            self.note = format!("{MOST_LINES} of {} lines are drawn", self.series.len());
            self.series.truncate(MOST_LINES);
        }
        self
    }
}

/// Names of columns whose words are others.
const WORDS: [(&str, &str); 2] = [("drift", "drift of the sum"), ("load_factor", "load factor (–)")];

/// Endings of names that say a unit.
const UNITS: [(&str, &str); 6] = [("_m_s", "m/s"), ("_Pa", "Pa"), ("_J", "J"), ("_N", "N"), ("_m", "m"), ("_s", "s")];

/// Endings of names that say a component of what stands before.
const COMPONENTS: [&str; 15] =
    ["_ux", "_uy", "_uz", "_vx", "_vy", "_vz", "_Fx", "_Fy", "_Fz", "_xx", "_yy", "_zz", "_yz", "_xz", "_xy"];

/// A name without the ending that says its unit, and the unit.
fn without_unit(name: &str) -> (&str, &'static str) {
    let found = UNITS.iter().find_map(|(ending, unit)| Some((name.strip_suffix(ending)?, *unit)));
    found.unwrap_or((name, ""))
}

/// A label with its unit.
fn with_unit(label: &str, unit: &str) -> String {
    if unit.is_empty() { label.into() } else { format!("{label} ({unit})") }
}

/// Group and name of a column of probes: energies are one group, so are the components of one quantity of a probe.
fn grouped(column: &str) -> (String, String) {
    let (stem, unit) = without_unit(column);
    if unit == "J" {
        return ("energies (J)".into(), words(stem));
    }
    let split = COMPONENTS.iter().find_map(|ending| Some((stem.strip_suffix(ending)?, &ending[1..])));
    match split {
        Some((of, component)) => {
            // u of ux; a tensor has its name before the component.
            let vector = component.chars().next().filter(|c| "uvF".contains(*c));
            let title = vector.map_or(words(of), |v| format!("{} {v}", words(of)));
            (with_unit(&title, unit), component.into())
        }
        None => (with_unit(&words(stem), unit), words(stem)),
    }
}

/// A run's probes over time.
pub(super) fn history(probes: &Columns) -> Vec<Chart> {
    let Some(time) = probes.names.first() else { return Vec::new() };
    let mut charts: Vec<Chart> = Vec::new();
    for (column, name) in probes.names.iter().enumerate().skip(1) {
        let (title, name) = grouped(name);
        let series = Series { name, points: probes.points(0, column, |_| true) };
        match charts.iter_mut().find(|c| c.title == title) {
            Some(chart) => chart.series.push(series),
            None => {
                let note = String::new();
                let (x, y, panel) = (axis(time), title.clone(), String::new());
                charts.push(Chart { panel, x, y, title, series: vec![series], note });
            }
        }
    }
    charts.retain(Chart::has_lines);
    charts
}

/// A name as words.
fn words(name: &str) -> String {
    let found = WORDS.iter().find(|(known, _)| *known == name);
    found.map_or_else(|| name.replace('_', " "), |(_, words)| (*words).into())
}

/// The name of a column as the title of an axis.
pub(super) fn axis(column: &str) -> String {
    let (stem, unit) = without_unit(column);
    with_unit(&words(stem), unit)
}

/// The tips of cracks over time: length of the crack up to each, and its speed.
pub(super) fn cracks(tips: &Columns) -> Vec<Chart> {
    let (Some(time), Some(tip)) = (tips.names.first(), tips.column("tip")) else { return Vec::new() };
    let number = |row: usize| tips.number(row, tip).unwrap_or(0.0) as u64;
    let mut known: Vec<u64> = (0..tips.rows.len()).map(number).collect();
    known.sort_unstable();
    known.dedup();
    let chart = |(column, title): (&str, &str)| {
        let y = tips.column(column)?;
        let line = |&n: &u64| Series { name: format!("tip {n}"), points: tips.points(0, y, |row| number(row) == n) };
        let series = known.iter().map(line).filter(|s| s.points.len() > 1).collect();
        let (panel, note) = (String::new(), String::new());
        let chart = Chart { panel, title: title.into(), x: axis(time), y: axis(column), series, note };
        chart.has_lines().then(|| chart.shortened())
    };
    let columns = [("length_m", "Length of the crack up to each tip"), ("speed_m_s", "Speed of the tips")];
    columns.into_iter().filter_map(chart).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn titles(charts: &[Chart]) -> Vec<(&str, Vec<&str>)> {
        charts.iter().map(|c| (c.title.as_str(), c.series.iter().map(|s| s.name.as_str()).collect())).collect()
    }

    #[test]
    fn components_of_a_probe_are_one_chart() {
        let header = "time_s,kinetic_J,drift_J,broken_bonds,end_ux_m,end_uy_m,end_vx_m_s,grip_Fz_N,tip_damage,stress_xx_Pa,stress_xy_Pa,strain_xx";
        let row = |t: f64| (0..12).map(|c| (t * f64::from(c)).to_string()).collect::<Vec<_>>().join(",");
        let probes = Columns::parse(&format!("{header}\n{}\n{}\n", row(1.0), row(2.0))).unwrap();
        let charts = history(&probes);
        assert_eq!(
            titles(&charts),
            [
                ("energies (J)", vec!["kinetic", "drift of the sum"]),
                ("broken bonds", vec!["broken bonds"]),
                ("end u (m)", vec!["ux", "uy"]),
                ("end v (m/s)", vec!["vx"]),
                ("grip F (N)", vec!["Fz"]),
                ("tip damage", vec!["tip damage"]),
                ("stress (Pa)", vec!["xx", "xy"]),
                ("strain", vec!["xx"]),
            ]
        );
        assert_eq!((charts[0].x.as_str(), charts[2].series[1].points[1]), ("time (s)", [0.0, 10.0]));
    }

    #[test]
    fn every_tip_is_a_line() {
        let text = "time_s,tip,x_m,y_m,z_m,length_m,speed_m_s\n0,1,0,0,0,0,\n1,1,1,0,0,1,100\n1,2,1,0,0,1,90\n2,1,2,0,0,2,110\n2,2,2,1,0,2,80\n3,3,0,0,0,5,1\n";
        let charts = cracks(&Columns::parse(text).unwrap());
        let both = vec!["tip 1", "tip 2"];
        assert_eq!(
            titles(&charts),
            [("Length of the crack up to each tip", both.clone()), ("Speed of the tips", both)]
        );
        assert_eq!((charts[0].series[0].points.len(), charts[1].series[0].points.len()), (3, 2));
    }
}
