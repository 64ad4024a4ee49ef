//! `output_el_cons.dat` of Quantum ESPRESSO's thermo_pw: a stiffness in kbar and below it its inverse, every row in lines of four
//! and of two numbers, no words. That the second is the inverse of the first tells the file from others.

use nalgebra::Matrix6;

use super::figure::{Figure, figures};
use super::square::Square;
use super::unit::settled;
use super::{Found, Source};
use crate::material::StressUnit;
use crate::material::matrix::Order;
use crate::units::Dimension;
use anisobond::Result;

/// How far the product of both may be from the identity.
const INVERSE: f64 = 1e-3;

pub(super) fn read(source: &Source) -> Option<Result<Found>> {
    let lines: Vec<&str> = source.text.lines().filter(|line| !line.trim().is_empty()).take(25).collect();
    if lines.len() != 24 {
        return None;
    }
    let rows: Vec<Vec<Figure>> = lines.iter().map(|line| figures(line)).collect::<Option<_>>()?;
    if !rows.chunks(2).all(|pair| pair[0].len() == 4 && pair[1].len() == 2) {
        return None;
    }
    let (stiffness, inverse) = rows.split_at(12);
    let matrix = |rows: &[Vec<Figure>]| Matrix6::from_row_iterator(rows.iter().flatten().map(|figure| figure.value));
    let off = matrix(stiffness) * matrix(inverse) - Matrix6::identity();
    (off.amax() < INVERSE).then(|| of(source, &Square::of_rows(stiffness)?)).flatten()
}

fn of(source: &Source, square: &Square) -> Option<Result<Found>> {
    let own = StressUnit { name: "kbar".into(), size: Dimension::Stress.unit("kbar").ok()? };
    Some(
        settled(source, &[own], square.largest())
            .and_then(|unit| {
                let (stiffness, done) = square.stiffness(unit.size, Order::Voigt)?;
                let order = Order::Voigt.words();
                Ok(Found::new(
                    stiffness,
                    format!("thermo_pw's output_el_cons.dat, above its inverse, {}, order {order}{done}", unit.name),
                ))
            })
            .map_err(|e| e.at(source.place)),
    )
}
