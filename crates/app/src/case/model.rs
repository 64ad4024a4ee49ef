//! `[model]`: bonds, kinematics, surfaces, and what bonds do beyond the linear law.

use std::sync::Arc;

use anisobond::bond_law::{BondLaw, Brittle, ElasticPlastic, LinearSoftening, TableSoftening};
use anisobond::calibration::Model;
use anisobond::operator::Kinematics;
use anisobond::tensor::Metric;
use anisobond_formats::pairs::read_pairs;

use super::Result;
use super::section::{Section, Value};
use super::shapes::Shapes;

/// `[model]`.
#[derive(Clone, Debug)]
pub(super) struct ModelStatement {
    pub bonds: Model,
    pub metric: Metric,
    pub kinematics: Kinematics,
    pub surface_calibration: bool,
    pub law: Arc<dyn BondLaw>,
    /// The stretch at which a brittle bond of the same energy breaks, where the law itself says at which its bonds yield.
    pub critical: Option<f64>,
}

pub(super) fn model(root: &Section, shapes: &Shapes) -> Result<ModelStatement> {
    let mut model = ModelStatement {
        bonds: Model::Central,
        metric: Metric::Norm,
        kinematics: Kinematics::Linear,
        surface_calibration: true,
        law: Arc::new(Brittle),
        critical: None,
    };
    let Some(value) = root.get("model") else { return Ok(model) };
    let table = value.section(&["bonds", "metric", "kinematics", "surface_calibration", "softening", "plastic"])?;
    if let Some(v) = table.get("bonds") {
        if v.text().is_ok_and(|text| text == "micropolar") {
            return Err(v.wrong(
                "micropolar bonds turn their ends, and nodes of a grid do not turn",
                "use bonds = \"hybrid\", which reaches every stiffness, or a packing",
            ));
        }
        model.bonds = v.choice(&[("central", Model::Central), ("hybrid", Model::Hybrid)])?;
    }
    if let Some(v) = table.get("metric") {
        model.metric = v.choice(&[("norm", Metric::Norm), ("energy", Metric::Energy)])?;
        if model.bonds == Model::Hybrid {
            return Err(
                v.wrong("the hybrid model reaches every tensor", "leave metric out, or use bonds = \"central\"")
            );
        }
    }
    if let Some(v) = table.get("kinematics") {
        model.kinematics = v.choice(&[("linear", Kinematics::Linear), ("finite", Kinematics::Finite)])?;
    }
    if let Some(v) = table.get("surface_calibration") {
        model.surface_calibration = v.truth()?;
    }
    let (softening, plastic) = (table.get("softening"), table.get("plastic"));
    if let (Some(_), Some(plastic)) = (&softening, &plastic) {
        return Err(plastic.wrong("bonds that soften do not yield too", "keep one of softening and plastic"));
    }
    if let Some(value) = softening {
        model.law = softening_law(value, shapes)?;
    } else if let Some(value) = plastic {
        if model.bonds == Model::Hybrid {
            return Err(value.wrong(
                "bonds of a hybrid model yield, but its nodal term does not",
                "use bonds = \"central\", or leave plastic out",
            ));
        }
        (model.law, model.critical) = plastic_law(value)?;
    }
    Ok(model)
}

/// `softening = "brittle"`, `{ linear = 2 }`, `{ exponential = 1.5 }` or `{ table = … }`.
fn softening_law(value: Value, shapes: &Shapes) -> Result<Arc<dyn BondLaw>> {
    if value.is_text() {
        value.choice(&[("brittle", ())])?;
        return Ok(Arc::new(Brittle));
    }
    let spot = value.spot();
    let forms = ["linear", "exponential", "table"];
    match value.section(&forms)?.only(&forms)? {
        Some(("linear", v)) => {
            let ratio = v.number()?;
            let law = LinearSoftening::new(ratio)
                .map_err(|_| v.wrong(format!("softening ends at {ratio} times its onset"), "give a ratio above 1"))?;
            Ok(Arc::new(law))
        }
        Some(("exponential", v)) => Ok(Arc::new(TableSoftening::exponential(v.number()?).map_err(|e| v.spot().at(e))?)),
        Some((_, v)) => {
            let points = if v.is_text() {
                let what = "elongation and force, both relative to the onset of damage, as 1.5, 0.7";
                read_pairs(shapes.path(v.text()?), what).map_err(|e| v.spot().at(e))?
            } else {
                let row = |item: &Value| match item.items("[elongation, force]")?.as_slice() {
                    [x, f] => Ok((x.number()?, f.number()?)),
                    other => {
                        Err(item
                            .wrong(format!("two numbers are needed, not {}", other.len()), "write [elongation, force]"))
                    }
                };
                v.items("[[1, 1], [2, 0.3], [6, 0]]")?.iter().map(row).collect::<Result<Vec<_>>>()?
            };
            Ok(Arc::new(TableSoftening::new(points).map_err(|e| v.spot().at(e))?))
        }
        None => Err(spot.wrong("softening says nothing", "write softening = { linear = 2 }")),
    }
}

/// `plastic = { hardening = 0.1, ductility = 20 }`, where a fracture energy says when bonds yield, or `{ yield_stretch = 0.002,
/// breaking_stretch = 0.04 }`; `hardening` is 0 unless it is given. With the stretch of a brittle bond of the same energy in the
/// second form.
fn plastic_law(value: Value) -> Result<(Arc<dyn BondLaw>, Option<f64>)> {
    const EXAMPLE: &str = "write { hardening = 0.1, ductility = 20 } beside a fracture energy, or { yield_stretch = 0.002, \
                           breaking_stretch = 0.04, hardening = 0.1 } instead of one";
    let spot = value.spot();
    let table = value.section(&["hardening", "ductility", "yield_stretch", "breaking_stretch"])?;
    let hardening = table.get("hardening").map(|v| v.number()).transpose()?.unwrap_or(0.0);
    let numbers = ["ductility", "yield_stretch", "breaking_stretch"].map(|key| table.get(key));
    let (yields_at, ductility) = match &numbers {
        [Some(ductility), None, None] => (None, ductility.positive()?),
        [None, Some(yields), Some(breaks)] => {
            let (first, last) = (yields.positive()?, breaks.positive()?);
            if last <= first {
                return Err(breaks.wrong(
                    format!("bonds yield at the stretch {first} and break at {last}"),
                    "give a breaking_stretch above yield_stretch",
                ));
            }
            (Some(first), last / first)
        }
        _ => return Err(spot.wrong("it is not said when bonds yield and break", EXAMPLE)),
    };
    let law = ElasticPlastic::new(hardening, ductility).map_err(|e| spot.at(e))?;
    Ok((Arc::new(law), yields_at.map(|s| s * law.energy_ratio().sqrt())))
}
