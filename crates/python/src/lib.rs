//! The Python package's native half: Python values to library types, library results to Python values. No physics here.
//!
//! What the package shows in notebooks and as tables is in `python/anisobond`; its types are described in `_native.pyi`.

mod calibrate_table;
mod calibration;
mod case;
mod cavity;
mod convert;
mod grid_test;
mod lattice;
mod material;
mod neighbourhood;
mod packing;
mod rank;
mod report;
mod stiffness;
mod sweep;
mod tools;
mod work;

use pyo3::prelude::*;

/// The native half of anisobond.
#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::calibrate_table::calibrate_table;
    #[pymodule_export]
    use crate::calibration::{Advice, Calibration, advise, calibrate};
    #[pymodule_export]
    use crate::case::{Case, Run, open_run, run};
    #[pymodule_export]
    use crate::cavity::Cavity;
    #[pymodule_export]
    use crate::grid_test::{GridTest, grid_test};
    #[pymodule_export]
    use crate::lattice::{ElementTest, Lattice, element_test, lattice};
    #[pymodule_export]
    use crate::neighbourhood::Neighbourhood;
    #[pymodule_export]
    use crate::packing::{_packing, Packing};
    #[pymodule_export]
    use crate::rank::rank;
    #[pymodule_export]
    use crate::report::{_report, Report};
    #[pymodule_export]
    use crate::stiffness::{_stiffness, Stiffness};
    #[pymodule_export]
    use crate::sweep::{Sweep, sweep};
    #[pymodule_export]
    use crate::tools::{builtin_materials, command_line, export, fields, report, set_threads, verify};

    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
