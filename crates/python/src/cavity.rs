//! `Cavity`: the closed form of a pressurised hole.

use anisobond::experiment::cavity::Cavity as Closed;
use anisobond_formats::Dimension;
use nalgebra::Vector3;
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::convert;
use crate::material::material as material_of;
use crate::work::{OrRaise, wrong};

/// A pressurised circular hole through the origin of an infinite body of any stiffness, in generalised plane strain: the
/// closed form (Lekhnitskii; Stroh). `radius` in m, `pressure` in Pa, or texts with units; `axis` along the hole [z].
///
/// >>> hole = Cavity("Pyroceram", radius=1, pressure=1e9)
/// >>> u = hole.displacement([[1, 0, 0], [0, 2, 0]])
/// >>> u.shape, bool(abs(u[0, 0] - 2 * u[1, 1]) < 1e-12)
/// ((2, 3), True)
#[pyclass(frozen, module = "anisobond")]
pub struct Cavity {
    closed: Closed,
    pressure: f64,
    material: String,
}

/// Share of a vector's length below which its distance from the axis is rounding.
const ON_AXIS: f64 = 1e-12;

impl Cavity {
    /// Vectors of an array (…, 3) that point away from the axis, and the shape before the last axis.
    fn away(&self, given: &Bound<'_, PyAny>, what: &str) -> PyResult<(Vec<Vector3<f64>>, Vec<usize>)> {
        let (vectors, shape) = convert::vectors(given, what)?;
        match vectors.iter().position(|x| self.closed.polar(x).0 <= ON_AXIS * x.norm()) {
            None => Ok((vectors, shape)),
            Some(at) => {
                let x = vectors[at];
                let which = if shape.is_empty() { String::new() } else { format!(" {}", at + 1) };
                Err(wrong(
                    format!(
                        "{what}{which} = ({}, {}, {}) lies on the axis of the hole, from which no direction leads away",
                        x.x, x.y, x.z
                    ),
                    "give one beside it",
                ))
            }
        }
    }
}

#[pymethods]
impl Cavity {
    #[new]
    #[pyo3(signature = (material, *, radius, pressure, axis=None))]
    fn new(
        material: &Bound<'_, PyAny>,
        radius: &Bound<'_, PyAny>,
        pressure: &Bound<'_, PyAny>,
        axis: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let axis = axis.map_or(Ok(Vector3::z()), |a| convert::vector(a, "axis"))?;
        let radius = convert::length(radius, "radius")?;
        let pressure = convert::quantity(pressure, "pressure", Dimension::Stress)?;
        let material = material_of(material)?;
        let closed = Closed::new(&material.stiffness, &axis, radius, pressure).or_raise()?;
        Ok(Cavity { closed, pressure, material: material.name })
    }

    /// Radius (m).
    #[getter]
    fn radius(&self) -> f64 {
        self.closed.radius()
    }

    /// Pressure (Pa).
    #[getter]
    fn pressure(&self) -> f64 {
        self.pressure
    }

    /// Displacement (m) at places (…, 3) (m) away from the axis; within the hole that of its wall.
    fn displacement<'py>(&self, py: Python<'py>, places: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (places, shape) = self.away(places, "place")?;
        let moved: Vec<Vector3<f64>> = py.detach(|| places.par_iter().map(|x| self.closed.displacement(x)).collect());
        convert::shaped(py, convert::coordinates(&moved), &[&shape[..], &[3]].concat())
    }

    /// Hoop stress (Pa) on the wall in directions (…, 3) away from the axis.
    fn hoop_stress<'py>(
        &self,
        py: Python<'py>,
        direction: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (directions, shape) = self.away(direction, "direction")?;
        let along = |n| self.closed.hoop_stress(n);
        convert::shaped(py, py.detach(|| directions.par_iter().map(along).collect()), &shape)
    }

    /// Material, radius (m), pressure (Pa), axis, and W (m): the wall moves by W n where its normal is n.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let wall = self.closed.wall().matrix;
        let rows: [[f64; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| wall[(i, j)]));
        let axis: [f64; 3] = self.closed.axis().into();
        convert::json(
            py,
            &serde_json::json!({
                "material": self.material, "radius": self.closed.radius(), "pressure": self.pressure, "axis": axis,
                "wall": rows,
            }),
        )
    }

    fn __repr__(&self) -> String {
        let n = crate::report::number;
        format!("<Cavity of radius {} m, pressure {} Pa>", n(self.closed.radius()), n(self.pressure))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), slf.get());
        let title = format!("a hole in {}", this.material);
        py.import("anisobond._html")?.getattr("report")?.call1(("Cavity", title, this.to_dict(py)?))
    }
}
