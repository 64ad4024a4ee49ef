//! `Stiffness`: an elastic tensor with its name, density and source.

use anisobond::tensor::{DirectionalModuli, Material, Stiffness as Tensor};
use anisobond_app::TensorReport;
use anisobond_cli::describe;
use anisobond_formats::Dimension;
use nalgebra::{Matrix6, Vector3};
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use crate::convert;
use crate::material;
use crate::report::{Report, number, table};
use crate::work::{OrRaise, warned, wrong};

/// An elastic stiffness tensor (Pa), with a name, and a density (kg/m³) and source where they are known.
///
/// `material` is a built-in name ("KIO3"), the path of a material file, a dictionary of a material file's keys, a 6×6
/// matrix (`order` "voigt": 11 22 33 23 13 12, "mandel", "abaqus" or "lammps"), all 3×3×3×3 components, or a tensor of
/// pymatgen or Elasticipy. `unit` is that of arrays (Pa unless given), of other packages' tensors (GPa unless given), and of files
/// that name none.
///
/// >>> c = Stiffness("KIO3")
/// >>> c.voigt.shape, float(c.voigt[0, 0])
/// ((6, 6), 43000000000.0)
/// >>> Stiffness([[3, 1, 1, 0, 0, 0], [1, 3, 1, 0, 0, 0], [1, 1, 3, 0, 0, 0],
/// ...            [0, 0, 0, 1, 0, 0], [0, 0, 0, 0, 1, 0], [0, 0, 0, 0, 0, 1]], unit="GPa", name="soft")
/// <Stiffness of soft: C11 3 C22 3 C33 3 C44 1 C55 1 C66 1 GPa>
#[pyclass(frozen, eq, hash, module = "anisobond")]
pub struct Stiffness {
    pub material: Material,
}

/// What is equal has equal bits, once −0 is 0.
impl std::hash::Hash for Stiffness {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        self.tensor().mandel().iter().for_each(|x| (x + 0.0).to_bits().hash(state));
    }
}

impl PartialEq for Stiffness {
    fn eq(&self, other: &Self) -> bool {
        self.tensor() == other.tensor()
    }
}

impl Stiffness {
    /// A tensor that belongs to a material.
    pub fn named(tensor: Tensor, name: impl Into<String>) -> Self {
        let (density, source) = (None, String::new());
        Stiffness { material: Material { name: name.into(), stiffness: tensor, density, source } }
    }

    fn tensor(&self) -> &Tensor {
        &self.material.stiffness
    }

    /// The same material with another tensor.
    fn with_tensor(&self, stiffness: Tensor) -> Self {
        Stiffness { material: Material { stiffness, ..self.material.clone() } }
    }

    /// The Kelvin moduli, ascending.
    fn kelvin(&self) -> Vec<f64> {
        let mut moduli = self.tensor().eigen().0.as_slice().to_vec();
        moduli.sort_by(f64::total_cmp);
        moduli
    }

    fn directional(&self) -> PyResult<DirectionalModuli> {
        self.tensor().require_positive_definite().or_raise()?;
        DirectionalModuli::new(self.tensor()).or_raise()
    }
}

/// An array of any shape.
type Array<'py> = Bound<'py, PyArrayDyn<f64>>;

/// A density (kg/m³): a number, or a text with a unit.
fn density_of(given: &Bound<'_, PyAny>) -> PyResult<f64> {
    let density = convert::quantity(given, "density", Dimension::Density)?;
    if density.is_finite() && density > 0.0 {
        return Ok(density);
    }
    Err(wrong(format!("the density is {density} kg/m³"), "give a positive number"))
}

/// Distance within which a symmetry class counts as present; `None` for what the tensor's own noise suggests.
fn tolerance_of(given: Option<f64>) -> PyResult<Option<f64>> {
    match given {
        Some(tolerance) if !(tolerance >= 0.0 && tolerance.is_finite()) => {
            Err(wrong(format!("tolerance = {tolerance}"), "give a number ≥ 0, as 0.005"))
        }
        given => Ok(given),
    }
}

/// Unit vectors of an array (…, 3).
fn directions(given: &Bound<'_, PyAny>, what: &str) -> PyResult<(Vec<Vector3<f64>>, Vec<usize>)> {
    let (mut vectors, shape) = convert::vectors(given, what)?;
    for v in &mut vectors {
        // Scaled first: the squares of what is very large or very small are not finite or zero.
        *v = (*v / v.amax()).try_normalize(0.0).filter(|n| n.iter().all(|x| x.is_finite())).ok_or_else(|| {
            wrong(format!("{what} has a vector without direction"), "give vectors of positive, finite length")
        })?;
    }
    Ok((vectors, shape))
}

#[pymethods]
impl Stiffness {
    #[new]
    #[pyo3(signature = (material, *, unit=None, order=None, name=None, density=None, source=None))]
    fn new(
        material: &Bound<'_, PyAny>,
        unit: Option<&str>,
        order: Option<&str>,
        name: Option<String>,
        density: Option<&Bound<'_, PyAny>>,
        source: Option<String>,
    ) -> PyResult<Self> {
        let mut material = material::read(material, unit, order)?;
        if let Some(name) = name {
            material.name = name;
        }
        if let Some(density) = density {
            material.density = Some(density_of(density)?);
        }
        if let Some(source) = source {
            material.source = source;
        }
        Ok(Stiffness { material })
    }

    /// From components or engineering constants, by the keys of a material file (docs/materials.md): `c11=…` with
    /// `symmetry`, `engineering={…}`, `compliance=…`, `axis`, `orientation`, `unit`, `name`, `density`, `source`. Numbers
    /// are in `unit`; texts carry their own.
    ///
    /// >>> Stiffness.of(symmetry="transversely-isotropic", unit="MPa", c11=130, c33=55, c13=28, c12=40, c44=32.25, name="rock")
    /// <Stiffness of rock: C11 130 C22 130 C33 55 C44 32.25 C55 32.25 C66 45 MPa>
    /// >>> Stiffness.of(engineering={"e": "70 GPa", "nu": 0.25}, symmetry="isotropic", name="glass")
    /// <Stiffness of glass: C11 84 C22 84 C33 84 C44 28 C55 28 C66 28 GPa>
    #[staticmethod]
    #[pyo3(signature = (*, symmetry=None, **keys))]
    fn of(py: Python<'_>, symmetry: Option<&str>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let all = PyDict::new(py);
        if let Some(symmetry) = symmetry {
            // `class` is a word of Python's own.
            all.set_item("class", symmetry)?;
        }
        if let Some(keys) = keys {
            all.update(keys.as_mapping())?;
        }
        Ok(Stiffness { material: material::of_keys(&all)? })
    }

    /// An isotropic tensor of bulk and shear modulus (Pa).
    #[staticmethod]
    #[pyo3(signature = (*, bulk, shear, name="isotropic"))]
    fn isotropic(bulk: &Bound<'_, PyAny>, shear: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
        let bulk = convert::quantity(bulk, "bulk", Dimension::Stress)?;
        let shear = convert::quantity(shear, "shear", Dimension::Stress)?;
        let tensor = Tensor::isotropic(bulk - 2.0 / 3.0 * shear, shear);
        tensor.require_positive_definite().or_raise()?;
        Ok(Stiffness::named(tensor, name))
    }

    /// From a pymatgen `ElasticTensor` (GPa unless `unit` says otherwise); a `structure` gives the density.
    #[staticmethod]
    #[pyo3(signature = (tensor, *, unit="GPa", structure=None, name=None))]
    fn from_pymatgen(
        tensor: &Bound<'_, PyAny>,
        unit: &str,
        structure: Option<&Bound<'_, PyAny>>,
        name: Option<String>,
    ) -> PyResult<Self> {
        let density =
            structure.map(|s| s.py().import("anisobond._interop")?.getattr("density")?.call1((s,))).transpose()?;
        Stiffness::new(tensor, Some(unit), None, name, density.as_ref(), None)
    }

    /// From an Elasticipy `StiffnessTensor` (GPa unless `unit` says otherwise).
    #[staticmethod]
    #[pyo3(signature = (tensor, *, unit="GPa", name=None))]
    fn from_elasticipy(tensor: &Bound<'_, PyAny>, unit: &str, name: Option<String>) -> PyResult<Self> {
        Stiffness::new(tensor, Some(unit), None, name, None, None)
    }

    /// From a 6×6 matrix in ASE's conventions: order xx yy zz yz xz xy, eV/Å³; `atoms` give the density.
    #[staticmethod]
    #[pyo3(signature = (matrix, *, atoms=None, name=None))]
    fn from_ase(matrix: &Bound<'_, PyAny>, atoms: Option<&Bound<'_, PyAny>>, name: Option<String>) -> PyResult<Self> {
        Stiffness::from_pymatgen(matrix, "eV/A3", atoms, name)
    }

    /// As a pymatgen `ElasticTensor` (GPa).
    fn to_pymatgen<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("anisobond._interop")?.getattr("to_pymatgen")?.call1((slf,))
    }

    /// As an Elasticipy `StiffnessTensor` (GPa).
    fn to_elasticipy<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("anisobond._interop")?.getattr("to_elasticipy")?.call1((slf,))
    }

    /// As a 6×6 matrix in ASE's conventions: order xx yy zz yz xz xy, eV/Å³.
    fn to_ase<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("anisobond._interop")?.getattr("to_ase")?.call1((slf,))
    }

    /// Name of the material.
    #[getter]
    fn name(&self) -> &str {
        &self.material.name
    }

    /// Density (kg/m³), or None.
    #[getter]
    fn density(&self) -> Option<f64> {
        self.material.density
    }

    /// Where the numbers come from.
    #[getter]
    fn source(&self) -> &str {
        &self.material.source
    }

    /// The Voigt matrix (Pa), order 11 22 33 23 13 12.
    #[getter]
    fn voigt<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        convert::matrix6(py, &self.tensor().voigt())
    }

    /// The Kelvin-Mandel matrix (Pa): shear rows and columns scaled by √2, so that norms and eigenvalues are the tensor's.
    #[getter]
    fn mandel<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        convert::matrix6(py, self.tensor().mandel())
    }

    /// All components (Pa), 3×3×3×3.
    #[getter]
    fn full<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let all = (0..81).map(|i| self.tensor().component(i / 27, i / 9 % 3, i / 3 % 3, i % 3)).collect();
        convert::shaped(py, all, &[3, 3, 3, 3])
    }

    /// The compliance as a Voigt matrix (1/Pa), engineering shear strains: s44 = 1/G23.
    #[getter]
    fn compliance<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let s = self.tensor().compliance_voigt();
        convert::matrix6(py, &s.ok_or_else(|| wrong("the stiffness cannot be inverted", "check its components"))?)
    }

    /// The six Kelvin moduli (Pa), ascending: all positive for a stable material.
    #[getter]
    fn kelvin_moduli<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        convert::shaped(py, self.kelvin(), &[6])
    }

    /// The tensor's norm √(C_ijkl C_ijkl) (Pa).
    #[getter]
    fn norm(&self) -> f64 {
        self.tensor().norm()
    }

    /// The fully symmetric part, which is all that central bonds see of a tensor.
    #[getter]
    fn cauchy_part(&self) -> Self {
        self.with_tensor(self.tensor().cauchy_part())
    }

    /// ‖C − S‖/‖C‖, S the Cauchy part: the least error of central bonds on any neighbourhood.
    #[getter]
    fn cauchy_gap(&self) -> f64 {
        self.tensor().cauchy_gap()
    }

    /// What central bonds cannot see, 3×3 (Pa): D11 = C44 − C23, D12 = C36 − C45, …
    #[getter]
    fn cauchy_defect<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        convert::matrix3_array(py, &self.tensor().cauchy_defect())
    }

    /// The symmetry class in any orientation, within `tolerance` (relative distance) [what the noise that the tensor shows suggests,
    /// 0.005 at the least].
    ///
    /// >>> Stiffness("Spinel").symmetry(), Stiffness("KIO3").symmetry()
    /// ('cubic', 'triclinic')
    #[pyo3(signature = (*, tolerance=None))]
    fn symmetry(&self, py: Python<'_>, tolerance: Option<f64>) -> PyResult<&'static str> {
        let tolerance = tolerance_of(tolerance)?;
        let tensor = self.tensor();
        let found = py.detach(|| tolerance.map_or_else(|| tensor.symmetry_by_noise(), |t| tensor.symmetry(t)));
        Ok(found.class.name())
    }

    /// The tensor turned by a 3×3 rotation, or by one in the words of the command line ("bunge:10,20,30").
    ///
    /// >>> c = Stiffness("KIO3")
    /// >>> bool(c.rotated("axis:0,0,1,90").rotated("axis:0,0,1,-90").relative_error(c) < 1e-14)
    /// True
    fn rotated(&self, rotation: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(self.with_tensor(self.tensor().rotated(&convert::orientation(rotation)?)))
    }

    /// ‖self − other‖/‖self‖.
    fn relative_error(&self, other: &Bound<'_, PyAny>) -> PyResult<f64> {
        Ok(self.tensor().relative_error(&material::material(other)?.stiffness))
    }

    /// Least and largest relative error of the energy that a strain has in `other`, over all strains; None where this tensor is
    /// not positive definite.
    ///
    /// >>> c = Stiffness("Si")
    /// >>> [round(100 * e, 1) for e in c.energy_error(c.voigt * 1.02)]
    /// [2.0, 2.0]
    fn energy_error(&self, other: &Bound<'_, PyAny>) -> PyResult<Option<(f64, f64)>> {
        let [least, largest] = match self.tensor().energy_error(&material::material(other)?.stiffness) {
            Some(error) => error,
            None => return Ok(None),
        };
        Ok(Some((least, largest)))
    }

    /// Young's modulus (Pa) along directions (…, 3).
    ///
    /// >>> Stiffness("Pyroceram").young([1, 0, 0]).shape, Stiffness("Si").young([[1, 0, 0], [1, 1, 1]]).shape
    /// ((), (2,))
    fn young<'py>(&self, py: Python<'py>, direction: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (n, shape) = directions(direction, "direction")?;
        let moduli = self.directional()?;
        convert::shaped(py, py.detach(|| n.par_iter().map(|n| moduli.young(n)).collect()), &shape)
    }

    /// Linear compressibility (1/Pa) along directions (…, 3).
    fn linear_compressibility<'py>(
        &self,
        py: Python<'py>,
        direction: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (n, shape) = directions(direction, "direction")?;
        let moduli = self.directional()?;
        let along = |n| moduli.linear_compressibility(n);
        convert::shaped(py, py.detach(|| n.par_iter().map(along).collect()), &shape)
    }

    /// Speeds (m/s; …, 3; slowest first) and polarisations (…, 3, 3) of plane waves along directions (…, 3).
    #[pyo3(signature = (direction, *, density=None))]
    fn waves<'py>(
        &self,
        py: Python<'py>,
        direction: &Bound<'py, PyAny>,
        density: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Array<'py>, Array<'py>)> {
        let density = match density {
            Some(given) => density_of(given)?,
            None => self.material.density.ok_or_else(|| {
                wrong(format!("{} has no density", self.material.name), "give density=2650 or density=\"2650 kg/m3\"")
            })?,
        };
        let (n, shape) = directions(direction, "direction")?;
        let along = |n| self.tensor().waves(n, density);
        let waves: Vec<_> = py.detach(|| n.par_iter().map(along).collect::<anisobond::Result<_>>()).or_raise()?;
        let speeds = waves.iter().flatten().map(|wave| wave.speed).collect();
        let polarisations = waves.iter().flatten().flat_map(|wave| wave.polarisation).collect();
        let speed_shape = [&shape[..], &[3]].concat();
        let polarisation_shape = [&shape[..], &[3, 3]].concat();
        Ok((convert::shaped(py, speeds, &speed_shape)?, convert::shaped(py, polarisations, &polarisation_shape)?))
    }

    /// Everything of the tensor that needs no lattice, as `anisobond tensor`: moduli, engineering constants, extremes over
    /// directions, waves, symmetry class within `tolerance` [what the noise suggests], what central bonds can reach. What is not
    /// plausible of the material is a Python warning, too.
    #[pyo3(signature = (*, tolerance=None))]
    fn analyse(&self, py: Python<'_>, tolerance: Option<f64>) -> PyResult<Report> {
        let tolerance = tolerance_of(tolerance)?;
        let report = py.detach(|| TensorReport::new(&self.material, tolerance)).or_raise()?;
        warned(py, &report.warnings)?;
        let words = describe::tensor(&report, &serde_json::Value::Null);
        let summary = format!("{}: {}", report.material, report.symmetry.class.name());
        // As --json has them where no direction is asked for: see `young` and `waves`.
        let mut numbers = convert::value_of(&report)?;
        numbers["directions"] = serde_json::json!([]);
        Report::new(summary, &numbers, words)
    }

    /// The 21 components (Pa) as a table.
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let c = self.tensor().voigt();
        let pairs: Vec<(usize, usize)> = (0..6).flat_map(|a| (a..6).map(move |b| (a, b))).collect();
        let columns = PyDict::new(py);
        let names: Vec<String> = pairs.iter().map(|(a, b)| format!("c{}{}", a + 1, b + 1)).collect();
        columns.set_item("component", names)?;
        columns.set_item("stiffness", convert::shaped(py, pairs.iter().map(|&p| c[p]).collect(), &[pairs.len()])?)?;
        table(py, &format!("components of {} (Pa)", self.material.name), columns)
    }

    /// The components as a pandas DataFrame.
    fn to_pandas<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.table(py)?.call_method0("to_pandas")
    }

    /// The components as a pyarrow Table.
    fn to_arrow<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.table(py)?.call_method0("to_arrow")
    }

    /// Name, source, density (kg/m³) and the Voigt matrix (Pa) as a dictionary.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let m = &self.material;
        let rows = m.stiffness.voigt_rows();
        let value = serde_json::json!({"name": m.name, "source": m.source, "density": m.density, "stiffness": rows});
        convert::json(py, &value)
    }

    #[pyo3(signature = (dtype=None, copy=None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<&Bound<'py, PyAny>>,
        copy: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        // A new array either way, and the caller's own.
        let _ = copy;
        let array = self.voigt(py)?.into_any();
        match dtype {
            Some(dtype) => array.call_method1("astype", (dtype,)),
            None => array.call_method0("copy"),
        }
    }

    // The matrix that is kept: the Voigt matrix and back would lose a bit.
    fn __reduce__<'py>(&self, py: Python<'py>) -> convert::Pickled<'py, (Vec<f64>, String, Option<f64>, String)> {
        let m = &self.material;
        let made = py.import("anisobond._native")?.getattr("_stiffness")?;
        let mandel = self.tensor().mandel().as_slice().to_vec();
        Ok((made, (mandel, m.name.clone(), m.density, m.source.clone())))
    }

    fn __repr__(&self) -> String {
        let c = self.tensor().voigt();
        let (size, unit) = describe::stress_unit(c.amax());
        let diagonal: Vec<String> = (0..6).map(|a| format!("C{0}{0} {1}", a + 1, number(c[(a, a)] / size))).collect();
        format!("<Stiffness of {}: {} {unit}>", self.material.name, diagonal.join(" "))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), slf.get());
        let (m, c) = (&this.material, this.tensor());
        let tensor = *c;
        let class = py.detach(|| tensor.symmetry_by_noise()).class.name();
        let hill = c.require_positive_definite().ok().and_then(|()| c.average_moduli());
        let mut shown = serde_json::json!({
            "source": m.source, "density": m.density, "class": class, "cauchy_gap": c.cauchy_gap(),
            "kelvin_moduli": this.kelvin(),
        });
        if let Some(hill) = hill {
            shown["bulk"] = hill.hill.bulk.into();
            shown["shear"] = hill.hill.shear.into();
            shown["young"] = hill.hill_young.into();
            shown["poisson"] = hill.hill_poisson.into();
            shown["universal_anisotropy"] = hill.universal_anisotropy.into();
        }
        let matrix = convert::json(py, &serde_json::json!(c.voigt_rows()))?;
        let html = py.import("anisobond._html")?;
        html.getattr("stiffness")?.call1((this.name(), convert::json(py, &shown)?, matrix))
    }
}

/// A stiffness again, from what its pickle holds: the Kelvin-Mandel matrix column by column.
#[pyfunction]
#[pyo3(signature = (mandel, name, density, source))]
pub fn _stiffness(mandel: Vec<f64>, name: String, density: Option<f64>, source: String) -> PyResult<Stiffness> {
    let mandel = <[f64; 36]>::try_from(mandel).map_err(|_| wrong("a pickled stiffness is damaged", "make it anew"))?;
    let stiffness = Tensor::from_mandel(Matrix6::from_column_slice(&mandel));
    Ok(Stiffness { material: Material { name, stiffness, density, source } })
}
