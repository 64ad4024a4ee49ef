//! Which materials of a table which model carries, and by what error in the norm and in energy.

use std::cmp::Ordering;

use serde::Serialize;
use serde_json::{Value, json};

use crate::report::{NeighbourhoodReport, universal_anisotropy};
use crate::rows::each_row;
use anisobond::calibration::{
    Calibrator, LowerBound, MicropolarCalibrator, Model, ModelCalibrator, ModelSettings, Outcome, Promise,
};
use anisobond::lattice::Neighbourhood;
use anisobond::tensor::{Material, Metric, Stiffness};
use anisobond::{Error, Result};
use anisobond_formats::flat::{FlatTable, columns, header};
use anisobond_formats::table::Table;
use anisobond_formats::words::suggestion;

/// What materials are ranked by.
#[derive(Clone, Debug)]
pub struct RankSettings {
    /// Models whose bonds are calibrated, simplest first: central, micropolar. What none of them carries, the hybrid model does.
    pub models: Vec<Model>,
    /// In which sense central bonds come close to a tensor out of reach.
    pub metric: Metric,
    /// A model carries a material whose energy it misses by no more than this share under any strain.
    pub within: f64,
}

/// How well a model's bonds do.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Carried {
    /// ‖target − reached‖/‖target‖ over all 81 components.
    pub relative_error: f64,
    /// Least and largest relative error of the energy of a strain, over all strains.
    pub energy_error: [f64; 2],
    /// The larger of both in size.
    pub largest_energy_error: f64,
    /// Root mean square of the six relative errors of energy between them.
    pub energy_distance: f64,
    /// Whether no neighbourhood brings bonds of this model closer in its metric.
    pub reaches_model_limit: bool,
    /// feasible, infeasible or not-converged.
    pub outcome: Outcome,
    /// ‖target − relaxed‖/‖target‖ with free node rotations, of micropolar bonds that promise their sum.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub free_rotations_error: Option<f64>,
}

/// A material among others.
#[derive(Clone, Debug, Serialize)]
pub struct RankedMaterial {
    /// Name of the material.
    pub material: String,
    /// The simplest model that carries it: central, micropolar, or hybrid, which carries every one.
    pub carried_by: Model,
    /// ‖C − S‖/‖C‖: the least error of central bonds in the norm.
    pub cauchy_gap: f64,
    /// Universal anisotropy index A^U.
    pub universal_anisotropy: f64,
    /// Poisson's ratio of Hill's average.
    pub poisson: f64,
    /// ‖C‖ (Pa).
    pub norm: f64,
    /// Density (kg/m³), if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// Normal bonds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub central: Option<Carried>,
    /// Normal and tangential bonds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub micropolar: Option<Carried>,
    /// What is not plausible of it.
    pub warnings: Vec<String>,
}

/// A table's materials, ranked: those that are shown, in order, and the rows that failed.
pub struct Ranking {
    /// What was asked.
    pub settings: RankSettings,
    /// On what.
    pub neighbourhood: NeighbourhoodReport,
    /// [`RankedMaterial`]s as JSON with `id`, `line` and `read_as`.
    pub rows: Vec<Value>,
    /// Failed rows as JSON: `id`, `line`, `error`, `kind`.
    pub failed: Vec<Value>,
    /// Rows of the table.
    pub all: usize,
}

/// Calibrate every material of a table by every model asked for. Rows in the table's order; [`Ranking::sort`] and
/// [`Ranking::keep`] choose among them.
///
/// # Errors
/// No model, or one that is not central or micropolar; a tolerance that is none. A row that fails is no error.
pub fn rank(table: &Table, neighbourhood: &Neighbourhood, settings: RankSettings) -> Result<Ranking> {
    if settings.models.is_empty() || settings.models.contains(&Model::Hybrid) {
        return Err(Error::input("hybrid bonds reach every tensor", "rank by central, micropolar, or both"));
    }
    if !(settings.within >= 0.0 && settings.within.is_finite()) {
        return Err(Error::input(format!("an error of {} at most", settings.within), "give a share ≥ 0, as 0.01"));
    }
    let prepared = ModelCalibrator::new(neighbourhood, ModelSettings::central())?;
    let central = settings.models.contains(&Model::Central).then(|| Calibrator::new(neighbourhood));
    let micropolar = settings.models.contains(&Model::Micropolar).then(|| MicropolarCalibrator::new(neighbourhood));
    let (metric, within) = (settings.metric, settings.within);
    let report = |material: &Material| -> Result<RankedMaterial> {
        let c = &material.stiffness;
        let central = central.as_ref().map(|calibrator| {
            let r = calibrator.calibrate_in(c, LowerBound::Value(0.0), metric)?;
            carried(c, &r.reached, r.outcome(), None)
        });
        let micropolar = micropolar.as_ref().map(|calibrator| {
            let r = calibrator.calibrate(c, Promise::Sum)?;
            carried(c, &r.reached, r.outcome(), Some(r.relaxed_error))
        });
        let (central, micropolar) = (central.transpose()?, micropolar.transpose()?);
        let carries = |of: &Option<Carried>| of.is_some_and(|of| of.largest_energy_error <= within);
        Ok(RankedMaterial {
            material: material.name.clone(),
            carried_by: match (carries(&central), carries(&micropolar)) {
                (true, _) => Model::Central,
                (_, true) => Model::Micropolar,
                _ => Model::Hybrid,
            },
            cauchy_gap: c.cauchy_gap(),
            universal_anisotropy: universal_anisotropy(c),
            poisson: c.average_moduli().map_or(f64::NAN, |m| m.hill_poisson),
            norm: c.norm(),
            density: material.density,
            central,
            micropolar,
            warnings: material.doubts(),
        })
    };
    let (failed, rows) = each_row(table, report).into_iter().partition(|row| !row["error"].is_null());
    let neighbourhood = NeighbourhoodReport::new(&prepared);
    Ok(Ranking { settings, neighbourhood, rows, failed, all: table.rows.len() })
}

fn carried(c: &Stiffness, reached: &Stiffness, outcome: Outcome, relaxed: Option<f64>) -> Result<Carried> {
    let energy_error = c.energy_error(reached).ok_or_else(|| {
        Error::input("the stiffness has no Cholesky factor in floating point", "check its components")
    })?;
    Ok(Carried {
        relative_error: c.relative_error(reached),
        energy_error,
        largest_energy_error: energy_error[0].abs().max(energy_error[1].abs()),
        energy_distance: c.energy_distance(reached).unwrap_or(f64::NAN),
        reaches_model_limit: outcome == Outcome::Feasible,
        outcome,
        free_rotations_error: relaxed,
    })
}

impl Ranking {
    /// The column that is sorted by where none is named: the first model's largest error of energy.
    pub fn usual_order(&self) -> String {
        format!("{}.largest_energy_error", self.settings.models[0].name())
    }

    /// Sort by a column, ascending, or with "-" before its name descending; rows without the column come last.
    ///
    /// # Errors
    /// A column that no row has.
    pub fn sort(&mut self, order: &str) -> Result<()> {
        let (name, down) = order.strip_prefix('-').map_or((order, false), |name| (name, true));
        self.known(name)?;
        let mut keyed: Vec<(Option<Value>, Value)> = self.rows.drain(..).map(|row| (cell(&row, name), row)).collect();
        keyed.sort_by(|a, b| match (&a.0, &b.0) {
            (Some(a), Some(b)) if down => ordered(b, a),
            (Some(a), Some(b)) => ordered(a, b),
            (a, b) => a.is_none().cmp(&b.is_none()),
        });
        self.rows = keyed.into_iter().map(|(_, row)| row).collect();
        Ok(())
    }

    /// Keep the rows of which a condition holds: "central.relative_error < 0.05", "carried_by = central", "material ~ Si" (the
    /// text is in it); < <= > >= = != ~, shares also as "5%".
    ///
    /// # Errors
    /// A condition without a comparison, a column that no row has, a text compared by size.
    pub fn keep(&mut self, condition: &str) -> Result<()> {
        const SIGNS: [&str; 7] = ["<=", ">=", "!=", "<", ">", "=", "~"];
        let found = SIGNS.iter().filter_map(|sign| Some((condition.find(sign)?, *sign)));
        let Some((at, sign)) = found.min_by_key(|(at, sign)| (*at, std::cmp::Reverse(sign.len()))) else {
            let problem = format!("{condition:?} compares nothing");
            return Err(Error::input(
                problem,
                "write a column, a comparison and a value, as central.relative_error<0.05",
            ));
        };
        let (name, value) = (condition[..at].trim(), condition[at + sign.len()..].trim());
        if self.rows.is_empty() {
            return Ok(());
        }
        self.known(name)?;
        let share = value.strip_suffix('%').and_then(|n| n.trim().parse::<f64>().ok()).map(|n| 0.01 * n);
        let number = share.or_else(|| value.parse::<f64>().ok());
        if number.is_none() && ["<", ">", "<=", ">="].contains(&sign) {
            return Err(Error::input(format!("{value:?} is no number"), format!("compare {name} with a number")));
        }
        let text = |cell: &Value| cell.as_str().map_or_else(|| cell.to_string(), str::to_lowercase);
        let holds = |row: &Value| {
            let Some(cell) = cell(row, name) else { return false };
            let order = match (cell.as_f64(), number) {
                (Some(own), Some(other)) => own.partial_cmp(&other),
                _ => Some(text(&cell).cmp(&value.to_lowercase())),
            };
            match sign {
                "<" => order == Some(Ordering::Less),
                ">" => order == Some(Ordering::Greater),
                "<=" => matches!(order, Some(Ordering::Less | Ordering::Equal)),
                ">=" => matches!(order, Some(Ordering::Greater | Ordering::Equal)),
                "=" => order == Some(Ordering::Equal),
                "!=" => order != Some(Ordering::Equal),
                _ => text(&cell).contains(&value.to_lowercase()),
            }
        };
        self.rows.retain(holds);
        Ok(())
    }

    /// Names of the columns of all rows.
    pub fn columns(&self) -> Vec<String> {
        header(&self.rows.iter().map(columns).collect::<Vec<_>>())
    }

    fn known(&self, name: &str) -> Result<()> {
        let all = self.columns();
        if all.is_empty() || all.iter().any(|known| known == name) {
            return Ok(());
        }
        let names: Vec<&str> = all.iter().map(String::as_str).collect();
        Err(Error::input(format!("there is no column {name:?}"), suggestion(name, &names)))
    }

    /// How many materials of those shown each model carries, simplest first.
    pub fn counts(&self) -> Vec<(&'static str, usize)> {
        let models = self.settings.models.iter().chain([&Model::Hybrid]);
        let count = |name: &str| self.rows.iter().filter(|row| row["carried_by"] == name).count();
        models.map(|model| (model.name(), count(model.name()))).collect()
    }

    /// The ranking as one JSON object.
    pub fn json(&self) -> Value {
        let counts: serde_json::Map<String, Value> =
            self.counts().into_iter().map(|(name, count)| (name.into(), count.into())).collect();
        json!({
            "models": self.settings.models.iter().map(|m| m.name()).collect::<Vec<_>>(),
            "metric": self.settings.metric,
            "within": self.settings.within,
            "neighbourhood": self.neighbourhood,
            "all": self.all,
            "shown": self.rows.len(),
            "carried_by": counts,
            "rows": self.rows,
            "failed": self.failed,
        })
    }

    /// The rows as CSV; failed ones come last with their errors.
    ///
    /// # Errors
    /// None in practice: writing to memory does not fail.
    pub fn csv(&self) -> Result<String> {
        FlatTable::of(self.rows.iter().chain(&self.failed)).csv()
    }
}

/// A value of a row by its dotted name.
fn cell(row: &Value, name: &str) -> Option<Value> {
    columns(row).into_iter().find(|(own, _)| own == name).map(|(_, value)| value)
}

/// Numbers by size, others as text.
fn ordered(a: &Value, b: &Value) -> Ordering {
    match (a.as_f64(), b.as_f64()) {
        (Some(a), Some(b)) => a.total_cmp(&b),
        _ => a.to_string().cmp(&b.to_string()),
    }
}
