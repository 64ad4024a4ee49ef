//! Charts of a folder: a run's history, its cracks, results of a sweep.

use serde::Serialize;
use serde_json::Value;

use super::table::Columns;

/// Lines of one chart.
const MOST_LINES: usize = 12;

/// Charts of a sweep whose columns are not those of element tests.
const MOST_CHARTS: usize = 12;

/// Lines over a common x.
#[derive(Serialize)]
pub(super) struct Chart {
    title: String,
    x: String,
    y: String,
    series: Vec<Series>,
}

#[derive(Serialize)]
struct Series {
    name: String,
    points: Vec<[f64; 2]>,
}

impl Chart {
    /// Whether there is a line to draw.
    fn has_lines(&self) -> bool {
        self.series.iter().any(|s| s.points.len() > 1)
    }
}

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
        return ("energies (J)".into(), stem.into());
    }
    let split = COMPONENTS.iter().find_map(|ending| Some((stem.strip_suffix(ending)?, &ending[1..])));
    match split {
        Some((of, component)) => {
            // u of ux; a tensor has its name before the component.
            let vector = component.chars().next().filter(|c| "uvF".contains(*c));
            let title = vector.map_or(of.to_string(), |v| format!("{of} {v}"));
            (with_unit(&title, unit), component.into())
        }
        None => (with_unit(stem, unit), stem.into()),
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
            None => charts.push(Chart { x: axis(time), y: title.clone(), title, series: vec![series] }),
        }
    }
    charts.retain(Chart::has_lines);
    charts
}

/// The name of a column as the title of an axis.
fn axis(column: &str) -> String {
    let (stem, unit) = without_unit(column);
    with_unit(&stem.replace('_', " "), unit)
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
        let series = known.iter().take(MOST_LINES).map(line).filter(|s| s.points.len() > 1).collect();
        let chart = Chart { title: title.into(), x: axis(time), y: axis(column), series };
        chart.has_lines().then_some(chart)
    };
    let columns = [("length_m", "Length of the crack up to each tip"), ("speed_m_s", "Speed of the tips")];
    columns.into_iter().filter_map(chart).collect()
}

/// What element tests of a sweep measure: title and columns that belong in one chart.
const MEASURED: [(&str, &[&str]); 8] = [
    ("measured stiffness, normal (Pa)", &["measured.c11", "measured.c22", "measured.c33"]),
    ("measured stiffness, coupling (Pa)", &["measured.c23", "measured.c13", "measured.c12"]),
    ("measured stiffness, shear (Pa)", &["measured.c44", "measured.c55", "measured.c66"]),
    ("Young’s moduli (Pa)", &["engineering.ex", "engineering.ey", "engineering.ez"]),
    ("distance from prescribed (–)", &["relative_error"]),
    ("bonds per sphere (–)", &["coordination"]),
    ("μ (–)", &["mu"]),
    ("smallest eigenvalue (Pa)", &["smallest_eigenvalue"]),
];

/// Results of a sweep over the first parameter of numbers, a line per value of the other parameters.
pub(super) fn sweep(results: &Columns) -> Vec<Chart> {
    let Some((x, groups)) = parameters(results) else { return Vec::new() };
    let chart = |title: &str, columns: &[usize]| {
        let mut series = Vec::new();
        for (group, rows) in &groups {
            for &y in columns {
                let mut points = results.points(x, y, |row| rows.contains(&row));
                points.sort_by(|a, b| a[0].total_cmp(&b[0]));
                let own = results.names[y].rsplit('.').next().unwrap_or_default();
                let names = [if columns.len() > 1 { own } else { "" }, group];
                series.push(Series {
                    name: names.iter().filter(|n| !n.is_empty()).copied().collect::<Vec<_>>().join(", "),
                    points,
                });
            }
        }
        series.truncate(MOST_LINES);
        Chart { title: title.into(), x: axis(&results.names[x]), y: title.into(), series }
    };
    let known = MEASURED.iter().filter_map(|(title, names)| {
        let columns: Vec<usize> = names.iter().filter_map(|name| results.column(name)).collect();
        (!columns.is_empty()).then(|| chart(title, &columns))
    });
    let mut charts: Vec<Chart> = known.filter(Chart::has_lines).collect();
    if charts.is_empty() {
        let others = (x + 1..results.names.len()).filter(|&c| varies(results, c)).take(MOST_CHARTS);
        charts = others.map(|c| chart(&results.names[c], &[c])).filter(Chart::has_lines).collect();
    }
    charts
}

/// Whether a column of numbers is not always the same.
fn varies(table: &Columns, column: usize) -> bool {
    let values: Vec<f64> = (0..table.rows.len()).filter_map(|row| table.number(row, column)).collect();
    values.len() > 1 && values.iter().any(|v| (v - values[0]).abs() > 1e-12 * values[0].abs())
}

/// Values of parameters in words, and the rows that have them.
type Group = (String, Vec<usize>);

/// The parameter over which to draw, and the rows of each combination of the others. A job's title names the parameters
/// that vary: "contact_radius=1.4, model=central".
fn parameters(results: &Columns) -> Option<(usize, Vec<Group>)> {
    let title = results.column("title")?;
    let words = |row: usize| -> Vec<(String, String)> {
        let text = results.rows[row].get(title).and_then(Value::as_str).unwrap_or_default();
        let pairs = text.split(", ").filter_map(|word| word.split_once('='));
        pairs.map(|(name, value)| (name.to_string(), value.to_string())).collect()
    };
    let names: Vec<String> =
        if results.rows.is_empty() { Vec::new() } else { words(0).into_iter().map(|(name, _)| name).collect() };
    let (x, name) =
        names.iter().find_map(|name| Some((results.column(name).filter(|&c| varies(results, c))?, name)))?;
    let mut groups: Vec<Group> = Vec::new();
    for row in 0..results.rows.len() {
        let others: Vec<String> =
            words(row).into_iter().filter(|(n, _)| n != name).map(|(n, v)| format!("{n} {v}")).collect();
        let group = others.join(", ");
        match groups.iter_mut().find(|(known, _)| *known == group) {
            Some((_, rows)) => rows.push(row),
            None => groups.push((group, vec![row])),
        }
    }
    Some((x, groups))
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
                ("energies (J)", vec!["kinetic", "drift"]),
                ("broken_bonds", vec!["broken_bonds"]),
                ("end u (m)", vec!["ux", "uy"]),
                ("end v (m/s)", vec!["vx"]),
                ("grip F (N)", vec!["Fz"]),
                ("tip_damage", vec!["tip_damage"]),
                ("stress (Pa)", vec!["xx", "xy"]),
                ("strain", vec!["xx"]),
            ]
        );
        assert_eq!((charts[0].x.as_str(), charts[2].series[1].points[1]), ("time (s)", [0.0, 10.0]));
    }

    #[test]
    fn a_sweep_of_two_parameters_has_a_line_for_each_value_of_the_second() {
        let text = "id,title,state,contact_radius,model,measured.c11,measured.c22,relative_error\n\
                    a,\"contact_radius=1.5, model=central\",done,1.5,central,5,6,0.1\n\
                    b,\"contact_radius=1.4, model=central\",done,1.4,central,3,4,0.2\n\
                    c,\"contact_radius=1.4, model=hybrid\",done,1.4,hybrid,1,2,0\n\
                    d,\"contact_radius=1.5, model=hybrid\",done,1.5,hybrid,1,2,0\n";
        let charts = sweep(&Columns::parse(text).unwrap());
        let lines = vec!["c11, model central", "c22, model central", "c11, model hybrid", "c22, model hybrid"];
        let errors = vec!["model central", "model hybrid"];
        assert_eq!(
            titles(&charts),
            [("measured stiffness, normal (Pa)", lines), ("distance from prescribed (–)", errors)]
        );
        assert_eq!(charts[0].series[0].points, [[1.4, 3.0], [1.5, 5.0]]);
        assert!(sweep(&Columns::parse("id,title\n").unwrap()).is_empty());
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
