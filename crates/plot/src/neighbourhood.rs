//! The picture of a neighbourhood, as in figures 2 to 10 of P.

use nalgebra::Vector3;

use super::numbers::{length, significant};
use super::scene::{Ball, Scalar, Scene, View};
use anisobond::Result;
use anisobond::lattice::{Influence, Neighbourhood};
use anisobond_formats::bonds::check_micromodulus;

/// Radius of a neighbour's sphere and of the node's own, in grid spacings.
const RADIUS: f64 = 0.48;
const OWN_RADIUS: f64 = 0.22;

/// What a picture of a neighbourhood shows besides the bonds.
#[derive(Clone, Debug, PartialEq)]
pub struct NeighbourhoodPicture {
    /// Name of the material, for the title.
    pub material: String,
    /// What the colours say, as "micromodulus c" (N/m⁶).
    pub quantity: String,
    /// The panels, from left to right.
    pub views: Vec<View>,
}

impl NeighbourhoodPicture {
    /// The three panels of P's figures: whole, cut with normal −e₂, cut with normal e₃.
    pub fn of(material: impl Into<String>) -> Self {
        let cut = |normal| View { normal: Some(normal), ..View::whole() };
        let views = vec![
            View::whole().captioned("whole neighbourhood"),
            cut(-Vector3::y()).captioned("cut, n = (0, −1, 0)"),
            cut(Vector3::z()).captioned("cut, n = (0, 0, 1)"),
        ];
        NeighbourhoodPicture { material: material.into(), quantity: "micromodulus c".into(), views }
    }
}

/// Spheres at the ends of the bonds, coloured by micromodulus (N/m⁶, one per bond), and the node itself, small and dark.
///
/// # Errors
/// Another number of micromoduli than bonds, one that is not finite, or no view.
pub fn neighbourhood_scene(
    neighbourhood: &Neighbourhood,
    micromodulus: &[f64],
    options: &NeighbourhoodPicture,
) -> Result<Scene> {
    check_micromodulus(neighbourhood, micromodulus)?;
    let spacing = neighbourhood.spacing();
    let bonds = neighbourhood.bonds().iter().zip(micromodulus);
    let mut balls: Vec<Ball> =
        bonds.map(|(bond, &c)| Ball { centre: bond.xi, radius: RADIUS * spacing, value: Some(c) }).collect();
    balls.push(Ball { centre: Vector3::zeros(), radius: OWN_RADIUS * spacing, value: None });
    let scalar = Scalar { name: options.quantity.clone(), unit: "N/m⁶".into() };
    Scene::new(balls, scalar)?.titled(options.material.clone(), subtitle(neighbourhood)).viewed(options.views.clone())
}

/// "924 bonds · sphere, horizon δ = 6 Δ · Δ = 1 m · influence ω = δ/|ξ|".
fn subtitle(neighbourhood: &Neighbourhood) -> String {
    let influence = match neighbourhood.influence() {
        Influence::Constant => "ω = 1",
        Influence::Inverse => "ω = δ/|ξ|",
        Influence::Hat => "ω = 1 − |ξ|/δ",
        Influence::Power => "ω = 1 − (|ξ|/δ)^1.5",
        Influence::Table(_) => "ω from a table",
    };
    format!(
        "{} bonds · {}, horizon δ = {} Δ · Δ = {} · influence {influence}",
        neighbourhood.bonds().len(),
        neighbourhood.shape().name(),
        significant(neighbourhood.horizon(), 4),
        length(neighbourhood.spacing())
    )
}
