//! The case file of a calibration: a bar of its grid and material, pulled.

use crate::report::influence_name;
use anisobond::calibration::ModelCalibration;
use anisobond::lattice::{Influence, Neighbourhood, Shape};
use anisobond::tensor::{Material, Metric};
use anisobond::{Error, Result};
use anisobond_formats::material::material_text;

/// Nodes of the bar along its axis and across.
const NODES: [f64; 2] = [36.0, 12.0];

/// Mean strain of the bar, as far as its largest modulus says.
const STRAIN: f64 = 1e-3;

/// A case that [`super::read_case`] reads: a bar of the material on the grid of the calibration, pulled along x in
/// equilibrium, to be changed.
///
/// # Errors
/// What cases cannot express: a neighbourhood that is no sphere or is turned, micropolar bonds, a lower bound of central ones, an
/// influence function of a file.
pub fn calibrated_case(material: &Material, neighbourhood: &Neighbourhood, found: &ModelCalibration) -> Result<String> {
    let refused = |problem: &str, remedy: &str| Err(Error::input(problem, remedy));
    let Shape::Sphere { .. } = neighbourhood.shape() else {
        return refused("cases have spherical neighbourhoods", "choose the shape sphere");
    };
    if *neighbourhood.orientation() != nalgebra::Matrix3::identity() {
        return refused("the grid of a case is not turned", "turn the material instead: orientation in its file");
    }
    let bonds = match found {
        ModelCalibration::Central(bonds, _) if bonds.lower_bound > 0.0 => {
            return refused("bonds of a case have no lower bound", "use the lower bound 0");
        }
        ModelCalibration::Central(bonds, _) if bonds.metric == Metric::Energy => "central\"\nmetric = \"energy",
        ModelCalibration::Central(..) => "central",
        ModelCalibration::Hybrid(_) => "hybrid",
        ModelCalibration::Micropolar(..) => {
            return refused("cases on grids have central or hybrid bonds", "choose one of these, or a packing");
        }
    };
    if let Influence::Table(_) = neighbourhood.influence() {
        return refused("the influence function is a file's", "write its path into a case by hand");
    }
    let (spacing, name) =
        (neighbourhood.spacing(), material.name.replace(['"', '\\'], "").replace(char::is_control, " "));
    let [length, width] = NODES.map(|n| n * spacing);
    let stress = STRAIN * material.stiffness.voigt_rows().iter().flatten().fold(0.0, |m: f64, c| m.max(c.abs()));
    Ok(format!(
        "# A bar of {name} on the calibrated grid, pulled along x.\n\
         #\n\
         #   anisobond check CASE.toml       what it would take\n\
         #   anisobond run CASE.toml         run it\n\
         #\n\
         # Every key is described in docs/cases.md.\n\
         name = \"{name}\"\n\
         description = \"a bar of {name}, pulled along x\"\n\
         \n\
         [body]\n\
         box = {{ size = \"{length:?}, {width:?}, {width:?} m\" }}\n\
         \n\
         [grid]\n\
         spacing = \"{spacing:?} m\"\n\
         horizon = {horizon:?}\n\
         influence = \"{influence}\"\n\
         \n\
         [model]\n\
         bonds = \"{bonds}\"\n\
         \n\
         [[condition]]\n\
         name = \"right\"\n\
         on = \"x-max\"\n\
         traction = \"{stress:.4e}, 0, 0 Pa\"\n\
         \n\
         [[condition]]\n\
         name = \"left\"\n\
         on = \"x-min\"\n\
         displacement = [0, 0, 0]\n\
         \n\
         [equilibrium]                            # or [motion] with duration = \"…\" and a density\n\
         tolerance = 1e-8\n\
         \n\
         [[probe]]\n\
         name = \"end\"\n\
         quantity = \"displacement\"\n\
         on = \"x-max\"\n\
         \n\
         [output]\n\
         fields = [\"displacement\", \"stress\"]\n\
         frames = 1\n\
         slices = [{{ axis = \"z\", field = \"displacement\" }}]\n\
         \n\
         [material]\n{material}",
        horizon = neighbourhood.horizon(),
        influence = influence_name(neighbourhood.influence()),
        material = material_text(material),
    ))
}
