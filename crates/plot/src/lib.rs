//! Pictures of spheres coloured by a number: neighbourhoods coloured by micromodulus, packings by any scalar.
//!
//! Scene (what there is, in metres) → drawing (marks in the plane, in picture units) → SVG or PNG. Orthographic
//! projection; spheres are painted from the farthest to the nearest, which is exact for spheres of any radii that do
//! not intersect, because the plane between two of them separates them along every line of sight.

mod camera;
mod chart;
mod colour;
mod discs;
mod drawing;
mod finished;
mod lattice;
mod neighbourhood;
mod numbers;
mod png;
mod scene;
mod slice;
mod stiffness;
mod svg;
mod text;

#[cfg(test)]
mod chart_tests;
#[cfg(test)]
mod tests;

pub use chart::{Chart, Panel, Series, Style};
pub use discs::{Disc, Window};
pub use finished::Picture;
pub use lattice::{LatticeView, lattice_scene};
pub use neighbourhood::{NeighbourhoodPicture, neighbourhood_scene};
pub use scene::{Ball, Rod, Scalar, Scene, View};
pub use slice::{SliceImage, animation};
pub use stiffness::{StiffnessRow, directional_csv, directional_picture, stiffness_chart};
