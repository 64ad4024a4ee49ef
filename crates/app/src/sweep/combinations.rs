//! Every combination of lists and ranges in a TOML file.

use super::job::{Job, Value};
use super::table::{MOST_JOBS, Name};
use anisobond::{Error, Result};
use anisobond_formats::tree::{Entry, Kind, Node, place};
use anisobond_formats::words::{enumeration, quoted, suggestion};

/// Most values of one range.
const MOST_VALUES: usize = 100_000;

/// Distance from a range's end, in steps, within which a value is the end.
const AT_END: f64 = 1e-6;

/// A parameter and its values.
struct Axis<'n> {
    name: &'n str,
    line: usize,
    values: Vec<Value>,
}

/// Axes that vary together, all of the same length.
struct Group<'n> {
    axes: Vec<Axis<'n>>,
}

impl Group<'_> {
    fn len(&self) -> usize {
        self.axes.first().map_or(0, |axis| axis.values.len())
    }
}

/// The jobs of a TOML document and the names of their parameters.
pub(super) fn jobs_of_toml(root: &Node) -> Result<(Vec<Job>, Vec<Name>)> {
    let fixed = fixed_values(root)?;
    let axes = axes(root)?;
    refuse_repeated_names(&axes, &fixed)?;
    let name = |axis: &Axis| Name { name: axis.name.into(), place: format!("line {}", axis.line) };
    let names = axes.iter().chain(&fixed).map(name).collect();
    let groups = grouped(axes, &zips(root)?)?;
    Ok((combinations(&groups, &fixed)?, names))
}

/// Values common to all jobs: `[fixed]` and single values at the top.
fn fixed_values(root: &Node) -> Result<Vec<Axis<'_>>> {
    let mut fixed = Vec::new();
    for entry in root.entries() {
        match (&entry.value.kind, entry.key.as_str()) {
            (Kind::Table(entries), "fixed") => {
                for entry in entries {
                    fixed.push(Axis { name: &entry.key, line: entry.line, values: vec![single(entry)?] });
                }
            }
            (_, "parameters" | "zip") => {}
            (Kind::Table(_), key) => {
                let problem = format!("unknown table [{key}]");
                return Err(Error::input(problem, suggestion(key, &["parameters", "fixed"])).at(at(entry)));
            }
            (_, key) => fixed.push(Axis { name: key, line: entry.line, values: vec![single(entry)?] }),
        }
    }
    Ok(fixed)
}

fn axes(root: &Node) -> Result<Vec<Axis<'_>>> {
    let Some(parameters) = root.get("parameters") else {
        return Err(Error::input(
            "there is no table [parameters]",
            "add [parameters] with lines such as contact_radius = [1.2, 1.4, 1.8]",
        ));
    };
    if !matches!(parameters.value.kind, Kind::Table(_)) {
        return Err(Error::input("parameters is no table", "write [parameters] on its own line").at(at(parameters)));
    }
    let entries = parameters.value.entries();
    entries.iter().map(|e| Ok(Axis { name: &e.key, line: e.line, values: values(e)? })).collect()
}

/// "line 3, contact_radius".
fn at(entry: &Entry) -> String {
    place(entry.line, &entry.key)
}

/// The values of an entry: a list, a range or one value.
fn values(entry: &Entry) -> Result<Vec<Value>> {
    let values = match &entry.value.kind {
        Kind::List(items) => items.iter().map(|item| scalar(item, &entry.key)).collect::<Result<Vec<_>>>()?,
        Kind::Table(_) => range(&entry.value).map_err(|e| e.at(at(entry)))?,
        _ => vec![scalar(&entry.value, &entry.key)?],
    };
    if values.is_empty() {
        return Err(Error::input("the list is empty", "give at least one value").at(at(entry)));
    }
    Ok(values)
}

fn single(entry: &Entry) -> Result<Value> {
    match entry.value.kind {
        Kind::List(_) | Kind::Table(_) => Err(Error::input(
            format!("{} stands where one value is needed", entry.value.described()),
            "move what varies to [parameters]",
        )
        .at(at(entry))),
        _ => scalar(&entry.value, &entry.key),
    }
}

fn scalar(node: &Node, key: &str) -> Result<Value> {
    match &node.kind {
        Kind::Number(x) if x.is_finite() => Ok(Value::Number(*x)),
        Kind::Text(text) if !text.trim().is_empty() => Ok(Value::Text(text.trim().into())),
        _ => Err(node.wrong(
            key,
            format!("a finite number or a text is needed, not {}", node.described()),
            "write 1.2, or a text in quotes",
        )),
    }
}

/// The values of `{ from, to, step }` or `{ from, to, count, spacing }`.
fn range(node: &Node) -> Result<Vec<Value>> {
    const KEYS: [&str; 5] = ["from", "to", "step", "count", "spacing"];
    if let Some(entry) = node.entries().iter().find(|e| !KEYS.contains(&e.key.as_str())) {
        return Err(Error::input(format!("unknown key {}", quoted(&entry.key)), suggestion(&entry.key, &KEYS)));
    }
    let number = |key: &str| node.get(key).map(|e| e.value.number(key)).transpose();
    let end = |key: &str| {
        number(key)?.ok_or_else(|| {
            Error::input(format!("the range has no `{key}`"), "write { from = 1.2, to = 2.8, step = 0.2 }")
        })
    };
    let (from, to) = (end("from")?, end("to")?);
    let log = match node.get("spacing").map(|e| e.value.text("spacing")).transpose()? {
        None | Some("linear") => false,
        Some("log") => true,
        Some(other) => {
            return Err(Error::input(format!("unknown spacing {}", quoted(other)), "use \"linear\" or \"log\""));
        }
    };
    let points = match (number("step")?, number("count")?) {
        (Some(step), None) if !log => by_step(from, to, step),
        (Some(_), None) => Err(Error::input("a step with spacing = \"log\"", "give count in place of step")),
        (None, Some(count)) => by_count(from, to, count, log),
        (Some(_), Some(_)) => Err(Error::input("both step and count are given", "keep one of them")),
        (None, None) => Err(Error::input("the range has neither step nor count", "add step = 0.2 or count = 9")),
    }?;
    Ok(points.into_iter().map(Value::Number).collect())
}

fn by_step(from: f64, to: f64, step: f64) -> Result<Vec<f64>> {
    let steps = (to - from) / step;
    if step == 0.0 || !steps.is_finite() || steps < 0.0 {
        let problem = format!("steps of {step} do not lead from {from} to {to}");
        return Err(Error::input(problem, "give a step that is not zero and has the sign of to − from"));
    }
    let last = (steps + AT_END).floor();
    let count = refuse_many(last + 1.0)?;
    let reaches = (steps - last).abs() <= AT_END;
    Ok((0..count).map(|i| if reaches && i + 1 == count { to } else { round(from + i as f64 * step) }).collect())
}

fn by_count(from: f64, to: f64, count: f64, log: bool) -> Result<Vec<f64>> {
    if count.fract() != 0.0 || count < 1.0 || (count == 1.0 && from != to) {
        return Err(Error::input(format!("count = {count}"), "give a whole number, at least 2 with two ends"));
    }
    let count = refuse_many(count)?;
    if log && !(from > 0.0 && to > 0.0) {
        return Err(Error::input(format!("logarithmic spacing from {from} to {to}"), "give two positive ends"));
    }
    let point = |i: usize| {
        let t = i as f64 / (count - 1) as f64;
        match i {
            0 => from,
            i if i + 1 == count => to,
            _ if log => round((from.ln() * (1.0 - t) + to.ln() * t).exp()),
            _ => round(from * (1.0 - t) + to * t),
        }
    };
    Ok((0..count).map(point).collect())
}

fn refuse_many(count: f64) -> Result<usize> {
    if count > MOST_VALUES as f64 {
        return Err(Error::input(
            format!("the range has {count} values"),
            format!("give at most {MOST_VALUES}: a larger step"),
        ));
    }
    Ok(count as usize)
}

/// Twelve significant digits, so that 1.2 + 2·0.2 is 1.6.
fn round(x: f64) -> f64 {
    format!("{x:.11e}").parse().unwrap_or(x)
}

/// The lists of names under `zip`, with their lines.
fn zips(root: &Node) -> Result<Vec<(usize, Vec<&str>)>> {
    let Some(entry) = root.get("zip") else { return Ok(Vec::new()) };
    let mut zips = Vec::new();
    for group in list_of_zip(&entry.value)? {
        let names = list_of_zip(group)?.iter().map(|name| name.text("zip"));
        zips.push((group.line, names.collect::<Result<_>>()?));
    }
    Ok(zips)
}

fn list_of_zip(node: &Node) -> Result<&[Node]> {
    let wrong = || node.wrong("zip", "a list of lists of names is needed", "write zip = [[\"a\", \"b\"]]");
    node.list().ok_or_else(wrong)
}

/// The axes in groups: those zipped together, at the place of the first of them, and each other one alone.
fn grouped<'n>(axes: Vec<Axis<'n>>, zips: &[(usize, Vec<&str>)]) -> Result<Vec<Group<'n>>> {
    let wrong = |line: usize, problem: String, remedy: &str| Error::input(problem, remedy).at(place(line, "zip"));
    let known: Vec<&str> = axes.iter().map(|axis| axis.name).collect();
    let mut group_of: Vec<Option<usize>> = vec![None; axes.len()];
    for (group, (line, names)) in zips.iter().enumerate() {
        for name in names {
            let Some(axis) = known.iter().position(|own| own == name) else {
                let problem = format!("{} is not among [parameters]", quoted(name));
                return Err(wrong(*line, problem, &suggestion(name, &known)));
            };
            if group_of[axis].replace(group).is_some() {
                return Err(wrong(*line, format!("{} is zipped twice", quoted(name)), "keep it in one list"));
            }
        }
    }
    let mut groups: Vec<(Option<usize>, Group)> = Vec::new();
    for (axis, zip) in axes.into_iter().zip(group_of) {
        match groups.iter_mut().find(|(own, _)| zip.is_some() && *own == zip) {
            Some((_, group)) => group.axes.push(axis),
            None => groups.push((zip, Group { axes: vec![axis] })),
        }
    }
    for (zip, group) in &groups {
        if let Some(other) = group.axes.iter().find(|axis| axis.values.len() != group.len()) {
            let first = &group.axes[0];
            let problem = format!(
                "{} has {} values, but {} has {}",
                first.name,
                first.values.len(),
                other.name,
                other.values.len()
            );
            let line = zip.map_or(other.line, |zip| zips[zip].0);
            return Err(wrong(line, problem, "zipped parameters need equally many values"));
        }
    }
    Ok(groups.into_iter().map(|(_, group)| group).collect())
}

/// One job per combination, the first group varying slowest.
fn combinations(groups: &[Group], fixed: &[Axis]) -> Result<Vec<Job>> {
    if groups.is_empty() {
        return Ok(Vec::new());
    }
    let count = groups.iter().try_fold(1_usize, |n, group| n.checked_mul(group.len()).filter(|&n| n <= MOST_JOBS));
    let Some(count) = count else {
        return Err(Error::input(
            format!("there are more than {MOST_JOBS} combinations"),
            "give shorter lists, or zip parameters that belong together",
        ));
    };
    let job = |index: usize| {
        let mut rest = index;
        let mut chosen = vec![0; groups.len()];
        for (at, group) in chosen.iter_mut().zip(groups).rev() {
            *at = rest % group.len();
            rest /= group.len();
        }
        let mut parameters = Vec::new();
        let mut title = Vec::new();
        for (&at, group) in chosen.iter().zip(groups) {
            for axis in &group.axes {
                if axis.values.len() > 1 {
                    title.push(format!("{}={}", axis.name, axis.values[at]));
                }
                parameters.push((axis.name.to_string(), axis.values[at].clone()));
            }
        }
        parameters.extend(fixed.iter().map(|axis| (axis.name.to_string(), axis.values[0].clone())));
        let place = format!("combination {}", index + 1);
        let title = if title.is_empty() { place.clone() } else { title.join(", ") };
        Job::new(title, parameters, place)
    };
    Ok((0..count).map(job).collect())
}

fn refuse_repeated_names(axes: &[Axis], fixed: &[Axis]) -> Result<()> {
    let all: Vec<&Axis> = axes.iter().chain(fixed).collect();
    let twice = all.iter().enumerate().find(|(n, axis)| all[..*n].iter().any(|before| before.name == axis.name));
    match twice {
        None => Ok(()),
        Some((n, axis)) => {
            let first = all[..n].iter().find(|before| before.name == axis.name).map_or(0, |before| before.line);
            let lines = enumeration(&[first.to_string(), axis.line.to_string()]);
            Err(Error::input(format!("{} is given twice, on lines {lines}", quoted(axis.name)), "keep one of them"))
        }
    }
}
