//! Observations two and three: the wall's displacement, across and along the hole.

use nalgebra::Vector3;
use serde::Serialize;

use super::body::CavityBody;
use super::closed::{Cavity, WallMotion};
use crate::{Error, Result};

/// Nodes up to this many spacings from the wall are the wall's.
const SHELL: f64 = 1.5;

/// The field is compared out to this many radii.
const OUT_TO: f64 = 2.5;

/// A body's displacements around the hole against the closed form.
#[derive(Clone, Debug, Serialize)]
pub struct CavityStatics {
    /// Nodes or spheres.
    pub nodes: usize,
    /// Hole's radius over the distance of neighbouring nodes.
    pub resolution: f64,
    /// Displacement of the wall where its normal is the stiffer and the softer direction across the hole, then along the
    /// hole (m): rows of u at either normal. Of the body.
    pub wall: [[f64; 3]; 2],
    /// The same of the closed form.
    pub closed: [[f64; 3]; 2],
    /// Radial displacement in the softer direction over that in the stiffer one (–), of the body.
    pub ratio: f64,
    /// The same of the closed form.
    pub closed_ratio: f64,
    /// Axial displacement at the softer direction over the radial one there (–), of the body.
    pub axial: f64,
    /// The same of the closed form.
    pub closed_axial: f64,
    /// ‖u − closed form‖/‖closed form‖ over the nodes out to 2.5 radii.
    pub field_error: f64,
}

/// The equilibrium of a pressurised hole in a body whose outer boundary the closed form of `cavity` holds, measured
/// against that closed form along two directions across the hole, the stiffer and the softer one.
///
/// The wall's motion is read from the nodes of a thin shell: both fields are fitted there by u = W n, and what the fits
/// differ by is added to the closed form's own W, so that the shell's thickness cancels.
///
/// # Errors
/// A body that does not run; one without nodes around the hole.
pub fn statics(body: CavityBody, cavity: &Cavity, directions: [Vector3<f64>; 2]) -> Result<CavityStatics> {
    let (nodes, spacing) = (body.nodes(), body.spacing());
    let mut running = body.embedded(cavity).start()?;
    while !running.finished() {
        running.advance()?;
    }
    let u = running.displacements();
    let within = |limit: f64| nodes.iter().filter(move |(_, x)| cavity.polar(x).0 <= limit);
    let shell: Vec<_> = within(cavity.radius() + SHELL * spacing).collect();
    let places: Vec<Vector3<f64>> = shell.iter().map(|(_, x)| *x).collect();
    let moved: Vec<Vector3<f64>> = shell.iter().map(|(n, _)| u[*n as usize]).collect();
    let exact: Vec<Vector3<f64>> = places.iter().map(|x| cavity.displacement(x)).collect();
    let (Some(of_body), Some(of_closed)) = (cavity.fitted(&places, &moved), cavity.fitted(&places, &exact)) else {
        return Err(Error::input(
            "there are no nodes around the hole",
            "give a body with a hole of the cavity's radius",
        ));
    };
    let closed = cavity.wall();
    let wall = WallMotion { matrix: closed.matrix + of_body.matrix - of_closed.matrix };
    let (mut error, mut size) = (0.0, 0.0);
    for (n, x) in within(OUT_TO * cavity.radius()) {
        let exact = cavity.displacement(x);
        error += (u[*n as usize] - exact).norm_squared();
        size += exact.norm_squared();
    }
    let rows = |w: &WallMotion| directions.map(|n| w.at(&n).into());
    let ratio = |w: &WallMotion| w.radial(&directions[1]) / w.radial(&directions[0]);
    let axial = |w: &WallMotion| cavity.axis().dot(&w.at(&directions[1])) / w.radial(&directions[1]);
    Ok(CavityStatics {
        nodes: nodes.len(),
        resolution: cavity.radius() / spacing,
        wall: rows(&wall),
        closed: rows(&closed),
        ratio: ratio(&wall),
        closed_ratio: ratio(&closed),
        axial: axial(&wall),
        closed_axial: axial(&closed),
        field_error: (error / size).sqrt(),
    })
}
