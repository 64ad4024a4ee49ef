//! The tensors of a report, and what is wrong with a result.

use nalgebra::Matrix6;
use serde::Serialize;
use serde_json::Value;

use super::numbers::quantities;
use anisobond::tensor::Stiffness;

/// A Kelvin modulus below this share of the largest is zero.
const SINGULAR: f64 = 1e-9;

/// Tensors that are compared, in the order of what was asked to what was reached, by their keys in a report.
const COMPARED: [(&str, &str); 9] = [
    ("target", "target"),
    ("prescribed", "prescribed"),
    ("elliptic", "what elliptic moduli stand for"),
    ("lattice", "lattice"),
    ("promised", "promised"),
    ("reached", "reached"),
    ("sum", "reached by the sum over bonds"),
    ("relaxed", "with free rotations"),
    ("measured", "measured"),
];

/// Tensors that are parts or bounds of the others.
const PARTS: [(&str, &str); 4] = [
    ("reached_by_bonds", "of it by bonds"),
    ("nodal_term", "nodal term Z"),
    ("summed", "sum over bonds (upper bound)"),
    ("best_fit", "best fit"),
];

#[derive(Serialize)]
pub(super) struct Tensor {
    name: &'static str,
    /// Pa.
    voigt: [[f64; 6]; 6],
    /// Not compared with the others: a part or a bound of them.
    part: bool,
    /// Whether all Kelvin moduli are positive.
    positive: bool,
    /// The smallest one (Pa).
    #[serde(skip)]
    smallest: f64,
}

impl Tensor {
    fn new(name: &'static str, value: &Value, part: bool) -> Option<Self> {
        let voigt = matrix(value)?;
        let stiffness = Stiffness::from_voigt(&Matrix6::from_fn(|a, b| voigt[a][b])).ok()?;
        let moduli = stiffness.eigen().0;
        Some(Tensor { name, voigt, part, positive: moduli[0] > SINGULAR * moduli[5].abs(), smallest: moduli[0] })
    }
}

/// The tensors that the report holds.
pub(super) fn tensors(report: &Value) -> Vec<Tensor> {
    // With rotations `reached` is one of the other two.
    let twice = !report["relaxed"].is_null();
    let compared = COMPARED.iter().filter(|(key, _)| !(twice && *key == "reached"));
    let compared = compared.filter_map(|(key, name)| Tensor::new(name, &report[*key], false));
    compared.chain(PARTS.iter().filter_map(|(key, name)| Tensor::new(name, &report[*key], true))).collect()
}

/// A 6×6 matrix.
fn matrix(value: &Value) -> Option<[[f64; 6]; 6]> {
    let row = |row: &Value| -> Option<[f64; 6]> {
        row.as_array()?.iter().map(Value::as_f64).collect::<Option<Vec<_>>>()?.try_into().ok()
    };
    value.as_array()?.iter().map(row).collect::<Option<Vec<_>>>()?.try_into().ok()
}

/// What a reader must know before anything else.
pub(super) fn warnings(report: &Value, tensors: &[Tensor]) -> Vec<String> {
    let mut out = Vec::new();
    if report["stable"] == false {
        let weakest = report["smallest_eigenvalue"].as_f64();
        let words = weakest
            .map_or(String::new(), |e| format!(": the smallest eigenvalue of its waves is {}", quantities(&[e], "Pa")));
        out.push(format!("Not stable{words}. Some displacement has no energy, or a negative one."));
    }
    if report["stable"] == true && report["stability"]["evidence"] == "sampled" {
        out.push("Stable as sampled, not proved: a wave that was not tried may have a negative energy.".into());
    }
    for region in report["regions"].as_array().into_iter().flatten().filter(|r| r["stable"] == false) {
        out.push(format!("Region {} is not stable.", region["name"].as_str().unwrap_or_default()));
    }
    if report["reaches_model_limit"] == false && report["outcome"] != "not-converged" {
        let why = report["infeasibility"]["explanation"].as_str().map_or(String::new(), |why| format!(": {why}"));
        out.push(format!("The target is out of reach{why}"));
    }
    for tensor in tensors.iter().filter(|t| !t.part && !t.positive) {
        let smallest = quantities(&[tensor.smallest], "Pa");
        out.push(format!(
            "The tensor “{}” is singular or indefinite: its smallest Kelvin modulus is {smallest}, so that some strain \
             meets no resistance.",
            tensor.name
        ));
    }
    if report["solver"]["converged"] == false {
        out.push("The solver did not converge; the values are not final.".into());
    }
    out.extend(report["correction"]["shortfall"].as_str().map(|s| format!("Correction: {s}")));
    let own = report["warnings"].as_array().into_iter().flatten();
    out.extend(own.filter_map(|w| w.as_str().map(String::from)));
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn diagonal(last: f64) -> Value {
        json!(std::array::from_fn::<[f64; 6], 6, _>(|a| std::array::from_fn(|b| match a == b {
            true if a == 5 => last,
            true => 1e9,
            false => 0.0,
        })))
    }

    #[test]
    fn singular_unstable_and_infeasible_are_said() {
        let report = json!({ "target": diagonal(1e9), "reached": diagonal(0.0), "stable": false, "smallest_eigenvalue": -2e6,
            "reaches_model_limit": false, "infeasibility": { "explanation": "because" }, "warnings": ["own"] });
        let tensors = tensors(&report);
        assert_eq!(tensors.iter().map(|t| t.positive).collect::<Vec<_>>(), [true, false]);
        let all = warnings(&report, &tensors);
        assert_eq!(all.len(), 4);
        for (warning, words) in all.iter().zip(["−2 MPa", "out of reach: because", "“reached” is singular", "own"])
        {
            assert!(warning.contains(words), "{warning}");
        }
        let fine =
            json!({ "target": diagonal(1e9), "reached": diagonal(1e9), "stable": true, "reaches_model_limit": true });
        assert!(warnings(&fine, &super::tensors(&fine)).is_empty());
    }

    #[test]
    fn free_rotations_are_what_is_compared_last() {
        let report = json!({ "target": diagonal(1e9), "reached": diagonal(2e9), "sum": diagonal(2e9),
            "relaxed": diagonal(3e9), "nodal_term": diagonal(1.0) });
        let names: Vec<_> = tensors(&report).iter().map(|t| (t.name, t.part)).collect();
        let sum = "reached by the sum over bonds";
        let expected = [("target", false), (sum, false), ("with free rotations", false), ("nodal term Z", true)];
        assert_eq!(names, expected);
    }
}
