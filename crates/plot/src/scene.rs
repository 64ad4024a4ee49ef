//! What a picture shows.

use std::path::Path;

use nalgebra::Vector3;

use super::drawing::Drawing;
use super::finished::Picture;
use super::numbers::vector;
use anisobond::{Error, Result};

/// Relative distance from the cutting plane within which a sphere's centre lies on it.
const ON_PLANE: f64 = 1e-9;

/// Lengths (m) above this, and radii below its inverse, would leave the range of f64 on the way to the picture.
const MOST: f64 = 1e100;

/// A sphere to draw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Centre (m).
    pub centre: Vector3<f64>,
    /// Radius (m).
    pub radius: f64,
    /// The scalar that colours it; `None` draws it dark, as a landmark.
    pub value: Option<f64>,
}

/// A straight rod to draw: a bond.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rod {
    /// Both ends (m).
    pub ends: [Vector3<f64>; 2],
    /// Radius (m).
    pub radius: f64,
    /// The scalar that colours it.
    pub value: f64,
}

/// The scalar that colours the spheres.
#[derive(Clone, Debug, PartialEq)]
pub struct Scalar {
    /// Name with symbol: "micromodulus c".
    pub name: String,
    /// Unit: "N/m⁶"; empty for a pure number.
    pub unit: String,
}

/// One panel of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Unit normal of the cutting plane; `None` shows everything.
    pub(super) normal: Option<Vector3<f64>>,
    /// Unit direction to the eye; `None` lets the normal decide.
    pub(super) to_eye: Option<Vector3<f64>>,
    /// Line under the panel.
    pub(super) caption: String,
}

impl View {
    /// Everything, seen from in front, the right and above.
    pub fn whole() -> Self {
        View { normal: None, to_eye: None, caption: "whole".into() }
    }

    /// A view cut by the plane through the middle with normal n (any length): what lies on the side to which n points is
    /// removed, and one looks obliquely onto the cut.
    ///
    /// # Errors
    /// A normal that is zero or not finite.
    pub fn cut(normal: Vector3<f64>) -> Result<Self> {
        let unit = normal / normal.amax();
        if !unit.iter().all(|x| x.is_finite()) {
            return Err(Error::input(
                format!("the normal of a cut is ({}, {}, {})", normal.x, normal.y, normal.z),
                "give a finite vector that is not zero",
            ));
        }
        Ok(View { normal: Some(unit.normalize()), to_eye: None, caption: format!("cut, n = {}", vector(&normal)) })
    }

    /// Everything, seen straight along the x axis with z upwards and y to the right.
    pub fn along_x() -> Self {
        View { normal: None, to_eye: Some(Vector3::x()), caption: "along x".into() }
    }

    /// The view with another caption.
    pub fn captioned(mut self, caption: impl Into<String>) -> Self {
        self.caption = caption.into();
        self
    }

    /// Whether the view shows a point given from the middle of the scene (m), of largest distance `extent` (m).
    pub(super) fn shows(&self, from_middle: &Vector3<f64>, extent: f64) -> bool {
        self.normal.is_none_or(|n| from_middle.dot(&n) <= ON_PLANE * extent)
    }
}

/// Spheres, the scalar that colours them, and the views of them side by side.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    pub(super) balls: Vec<Ball>,
    pub(super) rods: Vec<Rod>,
    pub(super) scalar: Scalar,
    pub(super) title: String,
    pub(super) subtitle: String,
    pub(super) views: Vec<View>,
}

impl Scene {
    /// A scene with one view of the whole and no title.
    ///
    /// # Errors
    /// No sphere, numbers that are not finite, or a radius that is not positive (lengths from 10⁻¹⁰⁰ to 10¹⁰⁰ m can be
    /// drawn).
    pub fn new(balls: Vec<Ball>, scalar: Scalar) -> Result<Self> {
        if balls.is_empty() {
            return Err(Error::input("there is no sphere to draw", "give at least one"));
        }
        for (index, ball) in balls.iter().enumerate() {
            let placed = ball.centre.iter().chain([&ball.radius]).all(|x| x.abs() <= MOST) && ball.radius >= 1.0 / MOST;
            if !(placed && ball.value.is_none_or(f64::is_finite)) {
                return Err(Error::input(
                    format!(
                        "sphere {} to draw has centre {}, radius {} and value {:?}",
                        index + 1,
                        vector(&ball.centre),
                        ball.radius,
                        ball.value
                    ),
                    "give finite numbers and a positive radius",
                ));
            }
        }
        Ok(Scene {
            balls,
            rods: Vec::new(),
            scalar,
            title: String::new(),
            subtitle: String::new(),
            views: vec![View::whole()],
        })
    }

    /// The scene with rods, coloured on the same scale as the spheres.
    ///
    /// # Errors
    /// Numbers that are not finite or a radius that is not positive, as for spheres.
    pub fn with_rods(mut self, rods: Vec<Rod>) -> Result<Self> {
        for (index, rod) in rods.iter().enumerate() {
            let placed = rod.ends.iter().flat_map(Vector3::iter).chain([&rod.radius]).all(|x| x.abs() <= MOST);
            if !(placed && rod.radius >= 1.0 / MOST && rod.value.is_finite()) {
                return Err(Error::input(
                    format!("rod {} to draw has radius {} and value {}", index + 1, rod.radius, rod.value),
                    "give finite numbers and a positive radius",
                ));
            }
        }
        self.rods = rods;
        Ok(self)
    }

    /// The scene with a title and a line below it.
    pub fn titled(mut self, title: impl Into<String>, subtitle: impl Into<String>) -> Self {
        self.title = title.into();
        self.subtitle = subtitle.into();
        self
    }

    /// The scene with other views, from left to right.
    ///
    /// # Errors
    /// No view.
    pub fn viewed(mut self, views: Vec<View>) -> Result<Self> {
        if views.is_empty() {
            return Err(Error::input("the picture has no view", "give at least one"));
        }
        self.views = views;
        Ok(self)
    }

    /// Middle of the box that holds the centres (m).
    pub(super) fn middle(&self) -> Vector3<f64> {
        let mut low = self.balls[0].centre;
        let mut high = low;
        for ball in &self.balls {
            low = low.inf(&ball.centre);
            high = high.sup(&ball.centre);
        }
        0.5 * low + 0.5 * high
    }

    /// The scene as a picture.
    pub fn picture(&self) -> Picture {
        Picture(Drawing::of(self))
    }

    /// The scene as an SVG picture.
    pub fn svg(&self) -> String {
        self.picture().svg()
    }

    /// The scene as a PNG picture; see [`Picture::png`].
    ///
    /// # Errors
    /// A width outside 200 … 10000.
    pub fn png(&self, width: u32) -> Result<Vec<u8>> {
        self.picture().png(width)
    }

    /// Writes the picture; see [`Picture::write`].
    ///
    /// # Errors
    /// Another extension; a file that cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        self.picture().write(path)
    }
}
