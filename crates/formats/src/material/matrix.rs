//! A 6×6 matrix in the shapes and component orders people write.

use nalgebra::Matrix6;

use crate::tree::{Node, place};
use crate::words::{quoted, suggestion};
use anisobond::tensor::{Stiffness, mandel_weight};
use anisobond::{Error, Result};

/// The order (and scaling) of the six rows of an input matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// 11 22 33 23 13 12.
    Voigt,
    /// 11 22 33 12 13 23; a list of 21 is column by column: D1111 D1122 D2222 D1133 D2233 D3333 D1112 …
    Abaqus,
    /// xx yy zz xy xz yz.
    Lammps,
    /// 11 22 33 23 13 12, shear rows and columns scaled by √2 (both stiffness and compliance).
    Mandel,
}

const NAMES: [(&str, Order); 4] =
    [("voigt", Order::Voigt), ("abaqus", Order::Abaqus), ("lammps", Order::Lammps), ("mandel", Order::Mandel)];

impl Order {
    /// The key `order` of a table; Voigt's where absent.
    pub fn of(table: &Node) -> Result<Self> {
        let Some(entry) = table.get("order") else { return Ok(Order::Voigt) };
        let name = entry.value.text("order")?;
        NAMES.iter().find(|(known, _)| known.eq_ignore_ascii_case(name.trim())).map(|&(_, order)| order).ok_or_else(
            || {
                Error::input(
                    format!("unknown order {}", quoted(name)),
                    suggestion(name, &NAMES.map(|(known, _)| known)),
                )
                .at(place(entry.line, "order"))
            },
        )
    }

    /// Voigt's row of a row of this order.
    fn row(self, row: usize) -> usize {
        match self {
            Order::Voigt | Order::Mandel => row,
            Order::Abaqus | Order::Lammps => [0, 1, 2, 5, 4, 3][row],
        }
    }

    /// (row, column) of the n-th of 21 numbers: the upper triangle, row by row, or column by column for Abaqus.
    fn upper(self) -> Vec<(usize, usize)> {
        let pairs = |n: usize| (0..n).flat_map(move |a| (a..6).map(move |b| (a, b)));
        let mut all: Vec<_> = pairs(6).collect();
        if self == Order::Abaqus {
            all.sort_by_key(|&(a, b)| (b, a));
        }
        all
    }
}

/// Refuses an order of rows other than Voigt's beside components that are named; another text means something else.
pub fn refuse_reordered(name: &str) -> Result<()> {
    match NAMES.iter().find(|(known, _)| known.eq_ignore_ascii_case(name.trim())) {
        None | Some((_, Order::Voigt)) => Ok(()),
        Some((known, _)) => Err(Error::input(
            format!("the order {known:?} says nothing where c11 … c66 are named: their indices are Voigt's"),
            "name the columns by Voigt's indices (11 22 33 23 13 12) and remove order",
        )),
    }
}

/// The stiffness of a matrix under a key; `value` reads one entry (Pa).
pub fn stiffness_of(
    node: &Node,
    key: &str,
    order: Order,
    value: impl Fn(&Node, &str) -> Result<f64>,
) -> Result<Stiffness> {
    let weight = |a: usize| if order == Order::Mandel { 1.0 / mandel_weight(a) } else { 1.0 };
    let voigt = voigt(node, key, order, value)?.map_with_location(|a, b, c| c * weight(a) * weight(b));
    Stiffness::from_voigt(&voigt).map_err(|e| e.at(place(node.line, key)))
}

/// The stiffness (Pa) of a compliance matrix; `value` reads one entry (1/Pa).
pub(super) fn compliance_of(
    node: &Node,
    order: Order,
    value: impl Fn(&Node, &str) -> Result<f64>,
) -> Result<Stiffness> {
    let weight = |a: usize| if order == Order::Mandel { mandel_weight(a) } else { 1.0 };
    let voigt = voigt(node, "compliance", order, value)?.map_with_location(|a, b, s| s * weight(a) * weight(b));
    Stiffness::from_compliance_voigt(&voigt).map_err(|e| e.at(place(node.line, "compliance")))
}

/// The full matrix in Voigt's order, from any shape.
fn voigt(node: &Node, key: &str, order: Order, value: impl Fn(&Node, &str) -> Result<f64>) -> Result<Matrix6<f64>> {
    let entries = numbered(node, key, order)?;
    let mut matrix = Matrix6::zeros();
    let full = entries.len() == 36;
    for &(a, b, entry) in &entries {
        let name = format!("{key} row {} column {}", a + 1, b + 1);
        let number = value(entry, &name)?;
        matrix[(a, b)] = number;
        if !full {
            matrix[(b, a)] = number;
        }
    }
    let lower_is_zero = (0..6).all(|a| (0..a).all(|b| matrix[(a, b)] == 0.0));
    if lower_is_zero {
        matrix.fill_lower_triangle_with_upper_triangle();
    }
    Ok(Matrix6::from_fn(|a, b| matrix[(order.row(a), order.row(b))]))
}

/// Every entry with its row and column: 36 of a full matrix, or 21 of an upper triangle.
fn numbered<'n>(node: &'n Node, key: &str, order: Order) -> Result<Vec<(usize, usize, &'n Node)>> {
    let items = node.list().unwrap_or(&[]);
    let rows: Option<Vec<&[Node]>> = items.iter().map(Node::list).collect();
    let Some(rows) = rows.filter(|rows| !rows.is_empty()) else {
        return flat(node, items, key, order);
    };
    let lengths: Vec<usize> = rows.iter().map(|row| row.len()).collect();
    let first = match lengths[..] {
        [6, 6, 6, 6, 6, 6] => |_: usize| 0,
        [6, 5, 4, 3, 2, 1] => |row: usize| row,
        _ => return Err(shape(node, key, &format!("rows of {lengths:?} numbers"))),
    };
    let numbered = |(a, row): (usize, &&'n [Node])| {
        let row: &'n [Node] = row;
        row.iter().enumerate().map(move |(n, entry)| (a, first(a) + n, entry)).collect::<Vec<_>>()
    };
    Ok(rows.iter().enumerate().flat_map(numbered).collect())
}

/// One list of 21 or 36 numbers.
fn flat<'n>(node: &Node, items: &'n [Node], key: &str, order: Order) -> Result<Vec<(usize, usize, &'n Node)>> {
    let places: Vec<(usize, usize)> = match items.len() {
        21 => order.upper(),
        36 => (0..36).map(|n| (n / 6, n % 6)).collect(),
        _ => return Err(shape(node, key, &node.described())),
    };
    Ok(places.into_iter().zip(items).map(|((a, b), entry)| (a, b, entry)).collect())
}

fn shape(node: &Node, key: &str, found: &str) -> Error {
    let found: String = found.chars().take(60).collect();
    node.wrong(
        key,
        format!("a 6×6 matrix is needed, not {found}"),
        "give six rows of six numbers, rows of 6, 5, 4, 3, 2 and 1 (upper triangle), or one list of 21 or 36",
    )
}
