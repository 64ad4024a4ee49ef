//! What a run does and writes: motion or equilibrium, probes, output.

use nalgebra::Vector3;

use super::LatticeKind;
use super::loads::{ConditionStatement, Names, Place, Where};
use super::matter::name_of;
use super::section::{Section, Value};
use anisobond::Result;
use anisobond::experiment::{FieldName, OutputPlan, Quantity, Schedule, Slice};
use anisobond_formats::units::Dimension;
use anisobond_formats::words::{quoted, suggestion};

/// Nodes that a probe looks at.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Target {
    Nodes(Where),
    /// Those of a condition, by its number.
    Condition(usize),
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct ProbeStatement {
    pub name: String,
    pub quantity: Quantity,
    pub target: Target,
}

/// More than these no machine computes, or no disk holds.
const MOST_LOAD_STEPS: usize = 10_000_000;
const MOST_FRAMES: usize = 1_000_000;
const MOST_PROBES: usize = 10_000;

/// `[motion]` or `[equilibrium]`.
pub(super) fn schedule(root: &Section, lattice: LatticeKind) -> Result<Schedule> {
    let example = "[motion] with duration = \"1 ms\", or [equilibrium]";
    let Some((form, value)) = root.only(&["motion", "equilibrium"])? else {
        return Err(root.spot().wrong("the case neither moves nor rests", format!("add {example}")));
    };
    if form == "equilibrium" {
        let table = value.section(&["steps", "tolerance", "relaxation"])?;
        let tolerance = table.get("tolerance").map(|v| part(&v)).transpose()?.unwrap_or(1e-8);
        return Ok(Schedule::Equilibrium {
            steps: table.get("steps").map(|v| v.count(1, MOST_LOAD_STEPS, "load steps")).transpose()?.unwrap_or(1),
            tolerance,
            relaxation: truth(&table, "relaxation")?,
        });
    }
    let table =
        value.section(&["duration", "step", "safety", "damping", "local_damping", "force_step", "from_equilibrium"])?;
    let duration = table.need("duration", "duration = \"1 ms\"")?.positive_quantity(Dimension::Time)?;
    let step = table.get("step").map(|v| v.positive_quantity(Dimension::Time)).transpose()?;
    if let Some(value) = table.get("step").filter(|_| step.is_some_and(|s| s > duration)) {
        return Err(value.wrong("the step is longer than the duration", "give a shorter step, or leave it out"));
    }
    let damping = table.get("damping").map(|v| (v.quantity(Dimension::Rate), v));
    let damping = match damping {
        None => 0.0,
        Some((rate, v)) => {
            let rate = rate?;
            if rate < 0.0 {
                return Err(v.wrong("a negative damping would drive the body", "give 0 or more"));
            }
            rate
        }
    };
    Ok(Schedule::Motion {
        duration,
        step,
        safety: table.get("safety").map(|v| part(&v)).transpose()?.unwrap_or(0.9),
        damping,
        local_damping: local_damping(root, &table, lattice)?,
        force_step: truth(&table, "force_step")?,
        from_equilibrium: truth(&table, "from_equilibrium")?,
    })
}

/// `motion.local_damping`, or as it was called on packings, `packing.local_damping`.
fn local_damping(root: &Section, motion: &Section, lattice: LatticeKind) -> Result<f64> {
    let own = motion.get("local_damping");
    let of_packing = match root.get("packing").filter(|_| lattice == LatticeKind::Packing) {
        Some(packing) => packing.table(&["local_damping"])?.get("local_damping"),
        None => None,
    };
    let value = match (own, of_packing) {
        (Some(_), Some(value)) => {
            return Err(
                value.wrong("local damping is given twice", "keep motion.local_damping, which is for both lattices")
            );
        }
        (own, of_packing) => own.or(of_packing),
    };
    match value.map(|v| (v.number(), v)) {
        None => Ok(0.0),
        Some((number, v)) => match number? {
            x if (0.0..1.0).contains(&x) => Ok(x),
            x => Err(v.wrong(format!("local damping {x} is out of range"), "give at least 0 and below 1")),
        },
    }
}

fn truth(table: &Section, key: &str) -> Result<bool> {
    table.get(key).map_or(Ok(false), |v| v.truth())
}

/// A number above 0 and at most 1.
fn part(value: &Value) -> Result<f64> {
    let x = value.positive()?;
    if x <= 1.0 { Ok(x) } else { Err(value.wrong(format!("{x} is above 1"), "give a number above 0, at most 1")) }
}

/// `[output]`.
pub(super) fn output(root: &Section) -> Result<OutputPlan> {
    let mut plan = OutputPlan {
        fields: vec![FieldName::Displacement, FieldName::Damage],
        frames: 20,
        slices: Vec::new(),
        probe_every: 1,
        checkpoint_every: 600.0,
    };
    let Some(value) = root.get("output") else { return Ok(plan) };
    let table = value.section(&["fields", "frames", "slices", "probe_every", "checkpoint"])?;
    if let Some(fields) = table.get("fields") {
        plan.fields = Vec::new();
        for item in fields.items("[\"displacement\", \"damage\"]")? {
            let field = item.choice(&fields_by_name())?;
            if plan.fields.contains(&field) {
                return Err(item.wrong("the field is named twice", "name it once"));
            }
            plan.fields.push(field);
        }
    }
    if let Some(frames) = table.get("frames") {
        plan.frames = frames.count(0, MOST_FRAMES, "frames")?;
    }
    if let Some(every) = table.get("probe_every") {
        plan.probe_every = every.whole(1)?;
    }
    if let Some(interval) = table.get("checkpoint") {
        plan.checkpoint_every = interval.positive_quantity(Dimension::Time)?;
    }
    if let Some(slices) = table.get("slices") {
        let items = slices.items("[{ axis = \"z\", field = \"damage\" }]")?;
        plan.slices = items.into_iter().map(slice).collect::<Result<_>>()?;
    }
    Ok(plan)
}

/// Fields by name.
fn fields_by_name() -> [(&'static str, FieldName); FieldName::ALL.len()] {
    FieldName::ALL.map(|field| (field.about().key, field))
}

fn slice(value: Value) -> Result<Slice> {
    let table = value.section(&["axis", "position", "field", "component"])?;
    let field = table.need("field", "field = \"damage\"")?.choice(&fields_by_name())?;
    let component = table.get("component").map(|v| component(field, &v)).transpose()?;
    Ok(Slice {
        axis: table.need("axis", "axis = \"z\"")?.axis()?,
        position: table.get("position").map(|v| v.quantity(Dimension::Length)).transpose()?,
        field,
        component,
    })
}

/// The number of a component of a field.
fn component(field: FieldName, value: &Value) -> Result<usize> {
    let about = field.about();
    if about.components.is_empty() {
        return Err(value.wrong(format!("{} has no components", about.key), "leave component out"));
    }
    let names: Vec<(&str, usize)> = about.components.iter().copied().zip(0..).collect();
    value.choice(&names)
}

/// `[[probe]]`s.
pub(super) fn probes<'n>(
    root: &Section<'n>,
    names: &Names<'_, 'n>,
    conditions: &[ConditionStatement],
) -> Result<Vec<ProbeStatement>> {
    let mut all: Vec<ProbeStatement> = Vec::new();
    for (n, value) in root.tables("probe")?.into_iter().enumerate() {
        let table = value.section(&["name", "quantity", "on", "thickness", "at", "condition"])?;
        let probe = ProbeStatement {
            name: name_of(&table, "probe", n)?,
            quantity: table.need("quantity", "quantity = \"displacement\"")?.choice(&Quantity::NAMES)?,
            target: target(&table, names, conditions)?,
        };
        if all.iter().any(|p| p.name == probe.name) {
            let problem = format!("two probes are called {}", quoted(&probe.name));
            return Err(table.spot().wrong(problem, "give each a name of its own"));
        }
        all.push(probe);
        if all.len() > MOST_PROBES {
            return Err(table.spot().wrong(format!("there are more than {MOST_PROBES} probes"), "use fewer"));
        }
    }
    Ok(all)
}

fn target<'n>(table: &Section<'n>, names: &Names<'_, 'n>, conditions: &[ConditionStatement]) -> Result<Target> {
    match table.only(&["on", "at", "condition"])? {
        None => Err(table.spot().wrong("the probe is nowhere", "add at = \"x, y, z mm\", on, or condition")),
        Some(("on", _)) => names.on(table).map(Target::Nodes),
        Some(("at", value)) => {
            let items = value.node.list().unwrap_or(&[]);
            let many = items.first().is_some_and(|item| item.list().is_some() || text_of_three(item));
            let points: Vec<Vector3<f64>> = if many {
                value.items("[x, y, z]")?.iter().map(|v| v.vector(Dimension::Length)).collect::<Result<_>>()?
            } else {
                vec![value.vector(Dimension::Length)?]
            };
            Ok(Target::Nodes(Where { spot: value.spot(), place: Place::Points(points) }))
        }
        Some((_, value)) => {
            let wanted = value.text()?;
            let found = conditions.iter().position(|c| c.name == wanted);
            found.map(Target::Condition).ok_or_else(|| {
                let all: Vec<&str> = conditions.iter().map(|c| c.name.as_str()).collect();
                let remedy = if all.is_empty() { "there are no conditions".into() } else { suggestion(wanted, &all) };
                value.wrong(format!("there is no condition {}", quoted(wanted)), remedy)
            })
        }
    }
}

/// "1, 2, 3 mm".
fn text_of_three(node: &anisobond_formats::tree::Node) -> bool {
    node.text("").is_ok_and(|text| text.contains(','))
}
