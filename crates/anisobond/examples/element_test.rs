//! A packing whose bonds reach a measured tensor, proved by the element test: `cargo run -p anisobond --example element_test`.

use anisobond::calibration::EllipticFit;
use anisobond::nalgebra::Vector3;
use anisobond::prelude::*;

/// Prints what the head of this file says.
pub fn main() -> Result<()> {
    // Cross-anisotropic rock, layers across z.
    let rock = TransverseConstants { c11: 130e6, c33: 55e6, c13: 28e6, c12: 40e6 };
    // A cubic crystal of spheres, shaken a little.
    let n = 8;
    let shake = |k: usize| 0.1 * ((k * 7919 % 101) as f64 / 101.0 - 0.5);
    let centre = |k: usize| {
        let at = Vector3::new((k % n) as f64, (k / n % n) as f64, (k / n / n) as f64);
        at + Vector3::new(shake(3 * k), shake(3 * k + 1), shake(3 * k + 2))
    };
    let centres = (0..n * n * n).map(centre).collect();
    let packing = Packing::new(Some(Vector3::repeat(n as f64)), centres, vec![0.5; n * n * n])?;
    let lattice = Lattice::new(packing, 1.6)?;
    let wanted = rock.stiffness(&Vector3::z());
    let fit = EllipticFit::new(&wanted, &Vector3::z())?;
    let stiffness = LatticeStiffness::new(&lattice, &fit.microplane)?;
    let tested = ElementTest::default().run(&Network::new(&lattice, &stiffness))?;
    for (i, j) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2)] {
        let (w, m) = (wanted.voigt()[(i, j)], tested.measured.voigt()[(i, j)]);
        println!("C{}{}: wanted {:.1} MPa, measured {:.1} MPa", i + 1, j + 1, w / 1e6, m / 1e6);
    }
    Ok(())
}
