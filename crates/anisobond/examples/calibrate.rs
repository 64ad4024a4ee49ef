//! From a tensor to the bonds of a regular grid: `cargo run -p anisobond --example calibrate`.

use anisobond::prelude::*;

/// Prints what the head of this file says.
pub fn main() -> Result<()> {
    let bonds = Neighbourhood::sphere(3.0, 1e-3, Influence::Inverse)?;
    let calibrator = Calibrator::new(&bonds);
    println!("{} bonds per node", bonds.bonds().len());
    for name in ["KIO3", "CoTeO4", "Te2W", "Pyroceram"] {
        let Some(material) = Material::builtin(name) else { continue };
        // Bonds of normal stiffness alone reach tensors with c12 = c66 and the like; of others the nearest such tensor.
        let central = calibrator.calibrate(&material.stiffness, LowerBound::Value(0.0))?;
        println!(
            "{name:10} off by {:6.3} %, smallest micromodulus {:.3e} N/m6",
            100.0 * central.relative_error,
            least(&central)
        );
    }
    Ok(())
}

fn least(found: &Calibration) -> f64 {
    found.micromodulus.iter().copied().fold(f64::INFINITY, f64::min)
}
