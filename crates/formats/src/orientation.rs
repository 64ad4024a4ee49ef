//! How a material is turned: a rotation (or reflection) Q, written in any of eight ways.
//!
//! Q maps the material's own axes into the frame of the sample: a direction v of the material lies along Q v, and the
//! stiffness in the sample is `stiffness.rotated(&q)`, C′_pqrs = Q_pi Q_qj Q_rk Q_sl C_ijkl (P eq 44).
//!
//! | in a file: `orientation = …` | on a command line | Q |
//! |---|---|---|
//! All turns are active and right-handed: they turn the material in the sample, counter-clockwise seen from the tip of the
//! axis; but for `prakash`, whose turn about y is the other way.
//!
//! | `{ bunge = [φ1, Φ, φ2] }` | `bunge:φ1,Φ,φ2` | R_z(φ1) R_x(Φ) R_z(φ2) |
//! | `{ axis = [x, y, z], angle = θ }` | `axis:x,y,z,θ` | right-handed turn by θ about the axis |
//! | `{ strike = α, dip = β }` | `strike-dip:α,β` | turn by β about the strike line |
//! | `{ x = […], z = […] }` | `xz:x1,x2,x3,z1,z2,z3` | where the material's e₁ and e₃ point |
//! | `{ xyz = [θ1, θ2, θ3] }` | `xyz:θ1,θ2,θ3` | R_x(θ1) R_y(θ2) R_z(θ3): about the material's x, its turned y, its turned z; one number stands for three |
//! | `{ prakash = [θ1, θ2, θ3] }` | `prakash:θ1,θ2,θ3` | the same with R_y turning the other way, P eq 103; one number stands for three |
//! | `{ matrix = [[…], […], […]] }` | `matrix:` and 9 numbers, row by row | the matrix |
//! | `{ mirror = [x, y, z] }` | `mirror:x,y,z` | reflection in the plane of that normal |
//!
//! A bare angle is in degrees; "0.5 rad" is in radians.

use std::str::FromStr;

use nalgebra::{Matrix3, Rotation3, Unit, Vector3};

use crate::tree::{Kind, Node, place};
use crate::units::{Dimension, split};
use crate::words::{enumeration, known_elsewhere, nearest_key, quoted, suggestion};
use anisobond::{Error, Result};

/// Largest |QᵀQ − I| of a matrix accepted as orthogonal (it is then made so to rounding).
const ORTHOGONAL: f64 = 1e-6;

/// Largest cosine between the two given directions accepted as perpendicular.
const PERPENDICULAR: f64 = 1e-3;

/// One way to say how a material is turned. Angles in radians; directions of any length but zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Orientation {
    /// Bunge's Euler angles (φ1, Φ, φ2): turn the sample frame by φ1 about its z, then Φ about the new x, then φ2 about
    /// the new z, and it lies along the crystal. The usual (passive) g takes sample to crystal coordinates; Q = gᵀ =
    /// R_z(φ1) R_x(Φ) R_z(φ2), with R the active right-handed turns, takes crystal to sample coordinates.
    Bunge([f64; 3]),
    /// A right-handed turn about an axis.
    AxisAngle {
        /// Direction of the axis.
        axis: Vector3<f64>,
        /// Angle (rad).
        angle: f64,
    },
    /// Strike α and dip β of the plane of isotropy, x east, y north, z up: α clockwise from north, the plane dips to the
    /// right of the strike. Its normal is a = (cos α sin β, −sin α sin β, cos β); Q turns by β about the strike line
    /// (sin α, cos α, 0), which is the smallest rotation that takes e₃ to a, and defined where a = ±e₃.
    StrikeDip {
        /// α (rad).
        strike: f64,
        /// β (rad).
        dip: f64,
    },
    /// Where the material's e₁ and e₃ point in the sample. z is kept, x made perpendicular to it.
    Directions {
        /// Direction of the material's e₁.
        x: Vector3<f64>,
        /// Direction of the material's e₃.
        z: Vector3<f64>,
    },
    /// R_x(θ1) R_y(θ2) R_z(θ3), right-handed turns about the material's own axes: x, then the turned y, then the turned z.
    Turns([f64; 3]),
    /// R_x(θ1) R_y(θ2) R_z(θ3) of P eq 103, whose R_y = [c 0 −s; 0 1 0; s 0 c] turns the opposite way to the usual one.
    TurnsOfTheDocument([f64; 3]),
    /// The matrix itself.
    Matrix(Matrix3<f64>),
    /// Reflection I − 2 n⊗n in the plane of normal n (P eq 45).
    Mirror(Vector3<f64>),
}

impl Orientation {
    /// The orthogonal matrix Q (dimensionless, 3×3).
    ///
    /// # Errors
    /// A direction of length zero, two directions that are not perpendicular to 10⁻³, a matrix that is not orthogonal to
    /// 10⁻⁶, or a number that is not finite.
    pub fn matrix(&self) -> Result<Matrix3<f64>> {
        match *self {
            Orientation::Bunge([phi1, phi, phi2]) => Ok(turn_z(phi1) * turn_x(phi) * turn_z(phi2)),
            Orientation::AxisAngle { axis, angle } => Ok(turn(unit(&axis)?, angle)),
            Orientation::StrikeDip { strike, dip } => {
                let (sin, cos) = strike.sin_cos();
                Ok(turn(Unit::new_normalize(Vector3::new(sin, cos, 0.0)), dip))
            }
            Orientation::Directions { x, z } => two_directions(&x, &z),
            Orientation::Turns([x, y, z]) => Ok(turn_x(x) * turn_y_of_the_document(-y) * turn_z(z)),
            Orientation::TurnsOfTheDocument([x, y, z]) => Ok(turn_x(x) * turn_y_of_the_document(y) * turn_z(z)),
            Orientation::Matrix(m) => nearest_orthogonal(&m),
            Orientation::Mirror(normal) => {
                let n = unit(&normal)?.into_inner();
                Ok(Matrix3::identity() - 2.0 * n * n.transpose())
            }
        }
        .and_then(|q: Matrix3<f64>| if q.iter().all(|x| x.is_finite()) { Ok(q) } else { Err(not_finite()) })
    }
}

/// The smallest rotation that takes e₃ to a direction: about e₃ × a; for a = −e₃ the half turn about e₁.
///
/// # Errors
/// A direction of length zero or not finite.
pub fn smallest_rotation(direction: &Vector3<f64>) -> Result<Matrix3<f64>> {
    let a = unit(direction)?;
    let horizontal = a.x.hypot(a.y);
    if horizontal == 0.0 {
        let half_turn = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
        return Ok(if a.z > 0.0 { Matrix3::identity() } else { half_turn });
    }
    Ok(turn(Unit::new_normalize(Vector3::new(-a.y, a.x, 0.0) / horizontal), horizontal.atan2(a.z)))
}

/// The matrix Q of an orientation written as on a command line; see the table of this module.
///
/// # Errors
/// An unknown form, a wrong count of numbers, or what [`Orientation::matrix`] refuses.
pub fn parse_orientation(text: &str) -> Result<Matrix3<f64>> {
    text.parse::<Orientation>()?.matrix()
}

impl FromStr for Orientation {
    type Err = Error;

    /// "bunge:10,20,30" and the other spellings of this module's table.
    fn from_str(text: &str) -> Result<Self> {
        let names: Vec<&str> = FORMS.iter().map(|f| f.name).collect();
        let Some((name, numbers)) = text.split_once(':') else {
            return Err(Error::input(
                format!("{} is no orientation", quoted(text)),
                format!("write a form and its numbers, as bunge:10,20,30; forms are {}", names.join(", ")),
            ));
        };
        let form = FORMS.iter().find(|f| f.name == name.trim()).ok_or_else(|| {
            Error::input(format!("unknown orientation {}", quoted(name)), suggestion(name.trim(), &names))
        })?;
        let scalars: Vec<Scalar> = numbers.split(',').map(Scalar::Text).collect();
        form.orientation(&scalars).map_err(|e| e.at(form.name))
    }
}

/// An orientation of a file, under its key: a table of one form, or a text as on the command line.
pub fn orientation_of(node: &Node, key: &str) -> Result<Matrix3<f64>> {
    let at_key = |e: Error| e.at(place(node.line, key));
    match &node.kind {
        Kind::Text(text) => parse_orientation(text).map_err(at_key),
        Kind::Table(entries) if !entries.is_empty() => {
            let form = form_of(node, key)?;
            let mut scalars = Vec::new();
            for &(part, count) in form.keys {
                let entry = node.get(part).ok_or_else(|| {
                    node.wrong(
                        key,
                        format!("{part} is missing"),
                        format!("give {}", enumeration(&form.keys.iter().map(|k| k.0).collect::<Vec<_>>())),
                    )
                })?;
                let before = scalars.len();
                flatten(&entry.value, &format!("{key}.{part}"), &mut scalars)?;
                let found = scalars.len() - before;
                if found != count && !(form.one_for_three() && found == 1) {
                    return Err(entry.value.wrong(
                        &format!("{key}.{part}"),
                        format!("{count} numbers are needed, not {found}"),
                        format!("write orientation = {{ {} }}", form.example),
                    ));
                }
            }
            form.orientation(&scalars).and_then(|o| o.matrix()).map_err(at_key)
        }
        _ => Err(node.wrong(
            key,
            format!("an orientation is needed, not {}", node.described()),
            "write it as orientation = { bunge = [10, 20, 30] }, or with axis and angle, strike and dip, x and z, xyz, \
             matrix or mirror",
        )),
    }
}

/// The form a table's keys belong to.
fn form_of<'f>(node: &Node, key: &str) -> Result<&'f Form> {
    let all = || FORMS.iter().flat_map(|f| f.keys.iter().map(|k| k.0));
    let mut found: Option<(&Form, &str)> = None;
    for entry in node.entries() {
        let wrong = |problem: String, remedy: String| Error::input(problem, remedy).at(place(entry.line, key));
        let form = FORMS.iter().find(|f| f.keys.iter().any(|k| k.0 == entry.key)).ok_or_else(|| {
            let remedy = match nearest_key(&entry.key, all()) {
                Some(name) => format!("did you mean {name}?"),
                None => known_elsewhere(&entry.key)
                    .unwrap_or_else(|| format!("use {}", all().collect::<Vec<_>>().join(", "))),
            };
            wrong(format!("unknown key {}", quoted(&entry.key)), remedy)
        })?;
        match found {
            Some((first, name)) if first.name != form.name => {
                return Err(wrong(
                    format!("{name} and {} are two orientations", entry.key),
                    "keep one of them".to_string(),
                ));
            }
            _ => found = Some((form, &entry.key)),
        }
    }
    found.map(|(form, _)| form).ok_or_else(|| node.wrong(key, "the orientation is empty", "name a form, as bunge"))
}

/// All numbers and texts of a value, lists opened in order.
fn flatten<'n>(node: &'n Node, key: &str, into: &mut Vec<Scalar<'n>>) -> Result<()> {
    match &node.kind {
        Kind::Number(value) => into.push(Scalar::Number(*value)),
        Kind::Text(text) => into.push(Scalar::Text(text)),
        Kind::List(items) => items.iter().try_for_each(|item| flatten(item, key, into))?,
        _ => return Err(node.wrong(key, format!("a number is needed, not {}", node.described()), "write numbers")),
    }
    Ok(())
}

/// A number as either spelling gives it.
enum Scalar<'a> {
    Number(f64),
    Text(&'a str),
}

impl Scalar<'_> {
    /// The number, and the unit after it ("" if none).
    fn split(&self) -> Result<(f64, &str)> {
        match *self {
            Scalar::Number(value) if value.is_finite() => Ok((value, "")),
            Scalar::Number(value) => Err(Error::input(format!("{value} is not finite"), "write a finite number")),
            Scalar::Text(text) => split(text),
        }
    }

    fn number(&self) -> Result<f64> {
        match self.split()? {
            (value, "") => Ok(value),
            (_, unit) => {
                Err(Error::input(format!("{} is after a plain number", quoted(unit)), "write the number alone"))
            }
        }
    }

    /// An angle (rad); degrees where no unit is given.
    fn angle(&self) -> Result<f64> {
        match self.split()? {
            (value, "") => Ok(value.to_radians()),
            (value, unit) => Ok(value * Dimension::Angle.unit(unit)?),
        }
    }
}

/// One spelling: its name on the command line, its keys in a file with how many numbers each holds, and what it makes.
struct Form {
    name: &'static str,
    keys: &'static [(&'static str, usize)],
    example: &'static str,
    /// Which of the numbers are angles; the others are plain.
    angles: std::ops::Range<usize>,
    make: fn(&[f64]) -> Orientation,
}

const FORMS: [Form; 8] = [
    Form {
        name: "bunge",
        keys: &[("bunge", 3)],
        example: "bunge = [10, 20, 30]",
        angles: 0..3,
        make: |v| Orientation::Bunge([v[0], v[1], v[2]]),
    },
    Form {
        name: "axis",
        keys: &[("axis", 3), ("angle", 1)],
        example: "axis = [0, 0, 1], angle = 30",
        angles: 3..4,
        make: |v| Orientation::AxisAngle { axis: vector(v), angle: v[3] },
    },
    Form {
        name: "strike-dip",
        keys: &[("strike", 1), ("dip", 1)],
        example: "strike = 270, dip = 25",
        angles: 0..2,
        make: |v| Orientation::StrikeDip { strike: v[0], dip: v[1] },
    },
    Form {
        name: "xz",
        keys: &[("x", 3), ("z", 3)],
        example: "x = [1, 0, 0], z = [0, 0, 1]",
        angles: 0..0,
        make: |v| Orientation::Directions { x: vector(v), z: vector(&v[3..]) },
    },
    Form {
        name: "xyz",
        keys: &[("xyz", 3)],
        example: "xyz = [30, 30, 30]",
        angles: 0..3,
        make: |v| Orientation::Turns([v[0], v[1], v[2]]),
    },
    Form {
        name: "prakash",
        keys: &[("prakash", 3)],
        example: "prakash = [30, 30, 30]",
        angles: 0..3,
        make: |v| Orientation::TurnsOfTheDocument([v[0], v[1], v[2]]),
    },
    Form {
        name: "matrix",
        keys: &[("matrix", 9)],
        example: "matrix = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]",
        angles: 0..0,
        make: |v| Orientation::Matrix(Matrix3::from_row_slice(v)),
    },
    Form {
        name: "mirror",
        keys: &[("mirror", 3)],
        example: "mirror = [1, 0, 0]",
        angles: 0..0,
        make: |v| Orientation::Mirror(vector(v)),
    },
];

impl Form {
    /// Whether one number stands for three.
    fn one_for_three(&self) -> bool {
        ["xyz", "prakash"].contains(&self.name)
    }

    /// The core of both spellings: as many numbers as the form needs, angles turned to radians.
    fn orientation(&self, scalars: &[Scalar]) -> Result<Orientation> {
        let count: usize = self.keys.iter().map(|k| k.1).sum();
        let one_for_three = self.one_for_three() && scalars.len() == 1;
        if scalars.len() != count && !one_for_three {
            return Err(Error::input(
                format!("{} numbers are needed, not {}", count, scalars.len()),
                format!(
                    "in a file this form is {{ {} }}; on a command line, the same numbers with commas",
                    self.example
                ),
            ));
        }
        let number = |(n, s): (usize, &Scalar)| if self.angles.contains(&n) { s.angle() } else { s.number() };
        let mut values: Vec<f64> = scalars.iter().enumerate().map(number).collect::<Result<_>>()?;
        if one_for_three {
            values = vec![values[0]; 3];
        }
        Ok((self.make)(&values))
    }
}

fn vector(v: &[f64]) -> Vector3<f64> {
    Vector3::new(v[0], v[1], v[2])
}

/// The unit vector of a direction.
fn unit(v: &Vector3<f64>) -> Result<Unit<Vector3<f64>>> {
    let largest = v.amax();
    if v.iter().any(|x| !x.is_finite()) {
        return Err(not_finite());
    }
    if largest == 0.0 {
        return Err(Error::input("the direction has length zero", "give three numbers that are not all zero"));
    }
    Ok(Unit::new_normalize(v / largest))
}

fn not_finite() -> Error {
    Error::input("the orientation is not finite", "give finite numbers")
}

/// e₁ → x made perpendicular to z, e₃ → z, e₂ → z × x.
fn two_directions(x: &Vector3<f64>, z: &Vector3<f64>) -> Result<Matrix3<f64>> {
    let (x, z) = (unit(x)?, unit(z)?);
    let cosine = x.dot(&z);
    if cosine.abs() > PERPENDICULAR {
        let angle = cosine.clamp(-1.0, 1.0).acos().to_degrees();
        return Err(Error::input(
            format!("x and z are {angle:.3}° apart, not 90°"),
            "give two perpendicular directions (to 0.05°)",
        ));
    }
    let x = unit(&(x.into_inner() - z.into_inner() * cosine))?;
    Ok(Matrix3::from_columns(&[x.into_inner(), z.cross(&x), z.into_inner()]))
}

/// The orthogonal matrix closest to one that is nearly so: Q ← ½(Q + Q⁻ᵀ), Newton's iteration of the polar
/// decomposition (Higham 1986); from 10⁻⁶ two steps reach rounding.
fn nearest_orthogonal(m: &Matrix3<f64>) -> Result<Matrix3<f64>> {
    let deviation = (m.transpose() * m - Matrix3::identity()).amax();
    if !deviation.is_finite() || deviation > ORTHOGONAL {
        return Err(Error::input(
            format!("the matrix is not orthogonal: its columns deviate by {deviation:.1e}"),
            "give a rotation or reflection whose columns are perpendicular unit vectors (to 1e-6)",
        ));
    }
    let mut q = *m;
    for _ in 0..3 {
        q = 0.5 * (q + q.try_inverse().ok_or_else(not_finite)?.transpose());
    }
    Ok(q)
}

fn turn(axis: Unit<Vector3<f64>>, angle: f64) -> Matrix3<f64> {
    *Rotation3::from_axis_angle(&axis, angle).matrix()
}

/// R_x (P eq 103).
fn turn_x(angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c)
}

/// R_y as P eq 103 prints it: the inverse of the usual one.
fn turn_y_of_the_document(angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    Matrix3::new(c, 0.0, -s, 0.0, 1.0, 0.0, s, 0.0, c)
}

/// R_z (P eq 103).
fn turn_z(angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
}

#[cfg(test)]
mod tests;
