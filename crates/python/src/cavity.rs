//! `Cavity`: the closed form of a pressurised hole.

use anisobond::experiment::cavity::Cavity as Closed;
use nalgebra::Vector3;
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::convert;
use crate::material::material as material_of;
use crate::work::{OrRaise, wrong};

/// A pressurised circular hole through the origin of an infinite body of any stiffness, in generalised plane strain: the
/// closed form (Lekhnitskii; Stroh). `radius` in m, `pressure` in Pa, `axis` along the hole.
///
/// >>> hole = Cavity("Pyroceram", radius=1, pressure=1e9)
/// >>> u = hole.displacement([[1, 0, 0], [0, 2, 0]])
/// >>> u.shape, bool(abs(u[0, 0] - 2 * u[1, 1]) < 1e-12)
/// ((2, 3), True)
#[pyclass(frozen, module = "anisobond")]
pub struct Cavity {
    closed: Closed,
    pressure: f64,
}

#[pymethods]
impl Cavity {
    #[new]
    #[pyo3(signature = (material, *, radius, pressure, axis=None))]
    fn new(material: &Bound<'_, PyAny>, radius: f64, pressure: f64, axis: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let axis = axis.map_or(Ok(Vector3::z()), |a| convert::vector(a, "axis"))?;
        let closed = Closed::new(&material_of(material)?.stiffness, &axis, radius, pressure).or_raise()?;
        Ok(Cavity { closed, pressure })
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

    /// Displacement (m) at places (…, 3) (m); within the hole that of its wall.
    fn displacement<'py>(&self, py: Python<'py>, places: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (places, shape) = convert::vectors(places, "places")?;
        let moved: Vec<Vector3<f64>> = places.iter().map(|x| self.closed.displacement(x)).collect();
        convert::shaped(py, convert::coordinates(&moved), &[&shape[..], &[3]].concat())
    }

    /// Hoop stress (Pa) on the wall in directions (…, 3) away from the axis.
    fn hoop_stress<'py>(
        &self,
        py: Python<'py>,
        direction: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (directions, shape) = convert::vectors(direction, "direction")?;
        if directions.iter().any(|n| self.closed.polar(n).0.partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater)) {
            return Err(wrong("a direction lies along the hole", "give directions away from its axis"));
        }
        convert::shaped(py, directions.iter().map(|n| self.closed.hoop_stress(n)).collect(), &shape)
    }

    fn __repr__(&self) -> String {
        let n = crate::report::number;
        format!("<Cavity of radius {} m, pressure {} Pa>", n(self.closed.radius()), n(self.pressure))
    }
}
