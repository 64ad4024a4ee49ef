//! Charts of a sweep: what was measured over a parameter.

use serde_json::Value;

use super::charts::{Chart, Series, axis};
use super::facts::Section;
use super::numbers::number;
use super::table::Columns;
use crate::element_sweep::PARAMETERS;

/// Charts of a sweep whose columns are not those of element tests.
const MOST_COLUMNS: usize = 12;

/// Charts in all.
const MOST_CHARTS: usize = 48;

/// Lines whose points differ by less, relatively, are one.
const EQUAL: f64 = 1e-9;

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

/// Names of the components in these columns.
fn component(column: &str) -> String {
    let own = column.rsplit('.').next().unwrap_or_default();
    match own.split_at_checked(1) {
        Some(("c", digits)) => format!("C{digits}"),
        Some(("e", axis)) if axis.len() == 1 => format!("E_{axis}"),
        _ => own.replace('_', " "),
    }
}

/// Columns of numbers that element tests measure, which a table shows first.
pub(super) fn measured() -> impl Iterator<Item = &'static str> {
    MEASURED.iter().flat_map(|(_, columns)| columns.iter().copied())
}

/// Results of a sweep over the first parameter of numbers: a chart for each combination of the parameters that are texts
/// (materials, models), for their results may differ in size; in it a line for each value of the others. With what is left
/// out.
pub(super) fn sweep(results: &Columns) -> (Vec<Chart>, String) {
    let Some((x, panels)) = parameters(results) else {
        let words = "No parameter of numbers has more than one value, so that there is nothing to draw over it.";
        return (Vec::new(), words.into());
    };
    let chart = |title: &str, columns: &[usize], panel: &Panel| {
        let mut series: Vec<Series> = Vec::new();
        for (group, rows) in &panel.lines {
            for &y in columns {
                let mut points = results.points(x, y, |row| rows.contains(&row));
                points.sort_by(|a, b| a[0].total_cmp(&b[0]));
                let own = component(&results.names[y]);
                let names = [if columns.len() > 1 { own.as_str() } else { "" }, group];
                let name = names.into_iter().filter(|n| !n.is_empty()).collect::<Vec<_>>().join(", ");
                match series.iter_mut().find(|s| !points.is_empty() && equal(&s.points, &points)) {
                    Some(same) => same.name = format!("{} = {name}", same.name),
                    None => series.push(Series { name, points }),
                }
            }
        }
        let (x, y) = (axis(&results.names[x]), title.to_string());
        Chart { panel: panel.name.clone(), title: title.into(), x, y, series, note: String::new() }
    };
    let known: Vec<(&str, Vec<usize>)> = MEASURED
        .iter()
        .map(|(title, names)| (*title, names.iter().filter_map(|name| results.column(name)).collect()))
        .filter(|(_, columns): &(_, Vec<usize>)| !columns.is_empty())
        .collect();
    let drawn = |what: &[(&str, Vec<usize>)]| -> Vec<Chart> {
        let all = panels.iter().flat_map(|panel| what.iter().map(|(title, columns)| chart(title, columns, panel)));
        together(all.filter(Chart::has_lines).map(Chart::shortened), panels.len())
    };
    let mut charts = drawn(&known);
    if charts.is_empty() {
        let others = (x + 1..results.names.len()).filter(|&c| varies(results, c)).take(MOST_COLUMNS);
        charts = drawn(&others.map(|c| (results.names[c].as_str(), vec![c])).collect::<Vec<_>>());
    }
    let mut note = String::new();
    if charts.len() > MOST_CHARTS {
        note = format!("{MOST_CHARTS} of {} charts are drawn; all numbers are in results.csv.", charts.len());
        charts.truncate(MOST_CHARTS);
    }
    (charts, note)
}

/// The parameters of a sweep with their values, fixed ones last.
pub(super) fn asked(results: &Columns) -> Vec<Section> {
    let values = |c: usize| {
        let mut values: Vec<String> = Vec::new();
        for value in results.rows.iter().filter_map(|row| row.get(c)) {
            let word = value.as_f64().map_or_else(|| value.as_str().unwrap_or_default().to_string(), number);
            if !word.is_empty() && !values.contains(&word) {
                values.push(word);
            }
        }
        values
    };
    let known = (0..results.names.len()).filter(|c| PARAMETERS.contains(&results.names[*c].as_str()));
    let all: Vec<(String, Vec<String>)> = known.map(|c| (results.names[c].replace('_', " "), values(c))).collect();
    let (varied, fixed): (Vec<_>, Vec<_>) =
        all.into_iter().filter(|(_, v)| !v.is_empty()).partition(|(_, v)| v.len() > 1);
    let fixed = fixed.into_iter().map(|(name, v)| (format!("{name} (fixed)"), v));
    let mut facts: Vec<(String, String)> = varied.into_iter().chain(fixed).map(|(n, v)| (n, v.join(", "))).collect();
    facts.push(("jobs".into(), results.rows.len().to_string()));
    vec![("What was asked".into(), facts)]
}

/// Charts with the same lines as one, under the names of all their panels, or none if it is all of them.
fn together(charts: impl Iterator<Item = Chart>, panels: usize) -> Vec<Chart> {
    let mut out: Vec<(Vec<String>, Chart)> = Vec::new();
    for chart in charts {
        let same = |other: &Chart| {
            let lines = || other.series.iter().zip(&chart.series);
            other.title == chart.title
                && other.series.len() == chart.series.len()
                && lines().all(|(a, b)| a.name == b.name && equal(&a.points, &b.points))
        };
        match out.iter_mut().find(|(_, known)| same(known)) {
            Some((names, _)) => names.push(chart.panel),
            None => out.push((vec![chart.panel.clone()], chart)),
        }
    }
    let named = |(names, chart): (Vec<String>, Chart)| {
        let panel = if names.len() == panels { String::new() } else { names.join("; ") };
        Chart { panel, ..chart }
    };
    out.into_iter().map(named).collect()
}

/// Whether two lines are the same to rounding.
fn equal(a: &[[f64; 2]], b: &[[f64; 2]]) -> bool {
    let near = |a: f64, b: f64| (a - b).abs() <= EQUAL * a.abs().max(b.abs());
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| near(a[0], b[0]) && near(a[1], b[1]))
}

/// Whether a column of numbers is not always the same.
fn varies(table: &Columns, column: usize) -> bool {
    let values: Vec<f64> = (0..table.rows.len()).filter_map(|row| table.number(row, column)).collect();
    values.len() > 1 && values.iter().any(|v| (v - values[0]).abs() > 1e-12 * values[0].abs())
}

/// The rows of one chart: its values of texts, and for each combination of the other parameters their words and rows.
struct Panel {
    name: String,
    lines: Vec<(String, Vec<usize>)>,
}

/// The parameter over which to draw, and the rows by the values of the others. A job's title names the parameters that
/// vary: "contact_radius=1.4, model=central".
fn parameters(results: &Columns) -> Option<(usize, Vec<Panel>)> {
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
    let is_text = |name: &str| {
        let column = results.column(name);
        column.is_some_and(|c| (0..results.rows.len()).any(|row| results.number(row, c).is_none()))
    };
    let mut panels: Vec<Panel> = Vec::new();
    for row in 0..results.rows.len() {
        let others: Vec<(String, String)> = words(row).into_iter().filter(|(n, _)| n != name).collect();
        let (texts, numbers): (Vec<_>, Vec<_>) = others.into_iter().partition(|(n, _)| is_text(n));
        let panel = texts.into_iter().map(|(_, v)| v).collect::<Vec<_>>().join(", ");
        let line =
            numbers.into_iter().map(|(n, v)| format!("{} {v}", n.replace('_', " "))).collect::<Vec<_>>().join(", ");
        let at = panels.iter().position(|p| p.name == panel).unwrap_or_else(|| {
            panels.push(Panel { name: panel, lines: Vec::new() });
            panels.len() - 1
        });
        let lines = &mut panels[at].lines;
        match lines.iter_mut().find(|(known, _)| *known == line) {
            Some((_, rows)) => rows.push(row),
            None => lines.push((line, vec![row])),
        }
    }
    Some((x, panels))
}

#[cfg(test)]
mod tests {
    use super::*;

    const RESULTS: &str = "id,title,state,contact_radius,model,strain,measured.c11,measured.c22,relative_error,coordination\n\
                           a,\"contact_radius=1.5, model=central, strain=0\",done,1.5,central,0,5,5,0.1,11\n\
                           b,\"contact_radius=1.4, model=central, strain=0\",done,1.4,central,0,3,3,0.2,9\n\
                           c,\"contact_radius=1.4, model=hybrid, strain=0\",done,1.4,hybrid,0,100,200,0,9\n\
                           d,\"contact_radius=1.5, model=hybrid, strain=0\",done,1.5,hybrid,0,100,200,0,11\n\
                           e,\"contact_radius=1.4, model=central, strain=1\",done,1.4,central,1,1,2,0.3,9\n\
                           f,\"contact_radius=1.5, model=central, strain=1\",done,1.5,central,1,1,2,0.4,11\n\
                           g,\"contact_radius=1.4, model=hybrid, strain=1\",done,1.4,hybrid,1,50,60,0.1,9\n\
                           h,\"contact_radius=1.5, model=hybrid, strain=1\",done,1.5,hybrid,1,50,60,0.1,11\n";

    #[test]
    fn texts_have_charts_of_their_own_and_equal_lines_are_one() {
        let (charts, note) = sweep(&Columns::parse(RESULTS).unwrap());
        let lines = |n: usize| charts[n].series.iter().map(|s| s.name.as_str()).collect::<Vec<_>>();
        let titles: Vec<String> = charts.iter().map(|c| format!("{}: {}", c.panel, c.title)).collect();
        let stiffness = "measured stiffness, normal (Pa)";
        let error = "distance from prescribed (–)";
        let mut expected =
            ["central", "hybrid"].map(|m| [format!("{m}: {stiffness}"), format!("{m}: {error}")]).concat();
        // The same for both models.
        expected.insert(2, ": bonds per sphere (–)".into());
        assert_eq!((titles, note.as_str()), (expected, ""));
        assert_eq!(lines(0), ["C11, strain 0 = C22, strain 0", "C11, strain 1", "C22, strain 1"]);
        assert_eq!(lines(2), ["strain 0 = strain 1"]);
        assert_eq!(lines(3), ["C11, strain 0", "C22, strain 0", "C11, strain 1", "C22, strain 1"]);
        assert_eq!(charts[0].series[0].points, [[1.4, 3.0], [1.5, 5.0]]);
        let (none, why) = sweep(&Columns::parse("id,title\n").unwrap());
        assert!(none.is_empty() && why.contains("nothing to draw"));
    }

    #[test]
    fn many_lines_are_not_dropped_without_a_word() {
        let row = |s: usize, r: usize| format!("{s}{r},\"r={r}, s={s}\",done,{r},{s},{}\n", 7 * s + r);
        let rows: String = (0..20).flat_map(|s| (1..4).map(move |r| row(s, r))).collect();
        let (charts, _) = sweep(&Columns::parse(&format!("id,title,state,r,s,mu\n{rows}")).unwrap());
        assert_eq!((charts[0].series.len(), charts[0].note.as_str()), (12, "12 of 20 lines are drawn"));
    }
}
