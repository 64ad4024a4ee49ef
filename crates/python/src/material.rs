//! What may stand where a material is wanted.

use anisobond::tensor::{Material, Stiffness as Tensor};
use nalgebra::Matrix6;
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::convert;
use crate::stiffness::Stiffness;
use crate::work::{OrRaise, wrong};

/// A `Stiffness`; a built-in name or the path of a file; a dictionary of a material file's keys; a tensor of pymatgen or
/// Elasticipy; a 6×6 or 3×3×3×3 array in Pa.
pub fn material(given: &Bound<'_, PyAny>) -> PyResult<Material> {
    read(given, None, None)
}

/// A material in a unit (of arrays, of other packages' tensors, and of files that name none), 6×6 arrays in an order.
pub fn read(given: &Bound<'_, PyAny>, unit: Option<&str>, order: Option<&str>) -> PyResult<Material> {
    let py = given.py();
    let keywords = [("unit", unit.is_some()), ("order", order.is_some())];
    // Nothing that was asked for is passed over in silence.
    let refuse = |taken: &[&str], what: &str, remedy: &str| {
        let found = keywords.iter().find(|(name, is_given)| *is_given && !taken.contains(name));
        found.map_or(Ok(()), |(name, _)| Err(wrong(format!("{name} is given with {what}"), remedy)))
    };
    if let Ok(stiffness) = given.cast::<Stiffness>() {
        refuse(&[], "a Stiffness, which is in Pa", "leave it out")?;
        return Ok(stiffness.get().material.clone());
    }
    if let Ok(keys) = given.cast::<PyDict>() {
        refuse(&[], "a dictionary", "make it a key of the dictionary")?;
        return of_keys(keys);
    }
    if given.hasattr("__fspath__")? || given.extract::<String>().is_ok() {
        let path = convert::path(given)?;
        let file = path.is_file();
        let what = if file {
            "a file, which has an order of its own"
        } else {
            "a name, whose numbers have units of their own"
        };
        refuse(if file { &["unit"] } else { &[] }, what, "leave it out")?;
        if file && anisobond_formats::is_table(&path) {
            let remedy = "give it to calibrate_table, or one of its rows as an array";
            return Err(wrong(format!("{} is a table of materials", path.display()), remedy));
        }
        return anisobond_formats::find_material(&path.to_string_lossy(), None, unit).or_raise();
    }
    let known = py.import("anisobond._interop")?.getattr("recognise")?.call1((given,))?;
    if !known.is_none() {
        let (matrix, its_unit): (Bound<'_, PyAny>, String) = known.extract()?;
        refuse(&["unit"], "a tensor of another package, which knows its own", "leave it out")?;
        return Ok(unnamed(of_array(&matrix, unit.unwrap_or(&its_unit), None)?));
    }
    Ok(unnamed(of_array(given, unit.unwrap_or("Pa"), order)?))
}

fn unnamed(stiffness: Tensor) -> Material {
    Material { name: "stiffness".into(), stiffness, density: None, source: String::new() }
}

/// The keys of a material file as a dictionary: read by the reader of files.
pub fn of_keys(keys: &Bound<'_, PyDict>) -> PyResult<Material> {
    let text = convert::json_text(keys, "the material")?;
    let mut material = anisobond_formats::parse_material(&text, "material").or_raise()?;
    if material.name == "material" {
        material.name = "stiffness".into();
    }
    Ok(material)
}

/// A 6×6 matrix in an order, or all 81 components, in a unit of stress.
fn of_array(given: &Bound<'_, PyAny>, unit: &str, order: Option<&str>) -> PyResult<Tensor> {
    let array = convert::array(given, "stiffness")?;
    let size = anisobond_formats::parse_stress(&format!("1 {unit}")).or_raise()?;
    let shape = array.shape().to_vec();
    let numbers = array.as_slice().map_err(|_| wrong("the stiffness is not contiguous", "copy it"))?;
    match shape[..] {
        [6, 6] => {
            let rows: Vec<Vec<f64>> = numbers.chunks_exact(6).map(<[f64]>::to_vec).collect();
            let order = order.unwrap_or("voigt");
            let text = serde_json::json!({ "stiffness": rows, "order": order, "unit": "Pa" }).to_string();
            // Orders and the check of symmetry are the reader's; the unit is applied after it, so that no digit is lost.
            let c = anisobond_formats::parse_material(&text, "stiffness").or_raise()?.stiffness;
            Ok(c.scaled(size))
        }
        [3, 3, 3, 3] if order.is_some() => {
            Err(wrong("order is given with all 3×3×3×3 components, whose indices are their order", "leave it out"))
        }
        [3, 3, 3, 3] => {
            let c = full(numbers)?;
            c.require_positive_definite().or_raise()?;
            Ok(c.scaled(size))
        }
        _ => {
            Err(wrong(format!("the stiffness has the shape {shape:?}"), "give a 6×6 matrix or all 3×3×3×3 components"))
        }
    }
}

/// All 81 components, whose symmetries are checked.
fn full(numbers: &[f64]) -> PyResult<Tensor> {
    let c = |[i, j, k, l]: [usize; 4]| numbers[27 * i + 9 * j + 3 * k + l];
    let largest = numbers.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    for i in 0..81 {
        let at @ [a, b, k, l] = [i / 27, i / 9 % 3, i / 3 % 3, i % 3];
        for other in [[b, a, k, l], [k, l, a, b]] {
            let difference = (c(at) - c(other)).abs();
            if difference.is_nan() || difference > 1e-6 * largest {
                let name = |x: [usize; 4]| x.map(|x| (x + 1).to_string()).concat();
                return Err(wrong(
                    format!("C{} = {} but C{} = {}", name(at), c(at), name(other), c(other)),
                    "give a tensor with C_ijkl = C_jikl = C_klij",
                ));
            }
        }
    }
    let pairs = anisobond::tensor::PAIRS;
    let voigt = Matrix6::from_fn(|a, b| {
        let ((i, j), (k, l)) = (pairs[a], pairs[b]);
        0.5 * (c([i, j, k, l]) + c([k, l, i, j]))
    });
    Tensor::from_voigt(&voigt).or_raise()
}
