//! A 6×6 matrix in the shapes and component orders people write.

use nalgebra::Matrix6;

use crate::tree::{Node, place};
use crate::words::{quoted, suggestion};
use anisobond::tensor::{PAIRS, Stiffness, mandel_weight};
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
    /// Any other: the row in which each of Voigt's rows stands.
    Rows([usize; 6]),
}

const NAMES: [(&str, Order); 5] = [
    ("voigt", Order::Voigt),
    ("abaqus", Order::Abaqus),
    ("lammps", Order::Lammps),
    ("mandel", Order::Mandel),
    ("vasp", Order::VASP),
];

/// Names of Voigt's rows.
const ROWS: [[&str; 5]; 6] = [
    ["11", "xx", "11", "x", "1"],
    ["22", "yy", "22", "y", "2"],
    ["33", "zz", "33", "z", "3"],
    ["23", "yz", "32", "zy", "4"],
    ["13", "xz", "31", "zx", "5"],
    ["12", "xy", "21", "yx", "6"],
];

impl Order {
    /// VASP's: xx yy zz xy yz zx.
    pub const VASP: Order = Order::Rows([0, 1, 2, 4, 5, 3]);

    /// The key `order` of a table; Voigt's where absent. A name, or the six rows spelled out: "xx yy zz xy yz zx".
    pub fn of(table: &Node) -> Result<Self> {
        let Some(entry) = table.get("order") else { return Ok(Order::Voigt) };
        let spelled;
        let name = match entry.value.list() {
            Some(items) => {
                spelled = items.iter().map(|item| item.text("order")).collect::<Result<Vec<_>>>()?.join(" ");
                &spelled
            }
            None => entry.value.text("order")?,
        };
        Order::named(name).map_err(|e| e.at(place(entry.line, "order")))
    }

    /// An order by its name or by the names of its rows.
    fn named(name: &str) -> Result<Self> {
        if let Some((_, order)) = NAMES.iter().find(|(known, _)| known.eq_ignore_ascii_case(name.trim())) {
            return Ok(*order);
        }
        let rows: Vec<&str> = name.split(|c: char| !c.is_alphanumeric()).filter(|row| !row.is_empty()).collect();
        if let Some(order) = Order::of_names(&rows) {
            return Ok(order);
        }
        if rows.len() > 1 {
            let problem = format!("the order {} is not six different rows", quoted(name));
            return Err(Error::input(problem, "name each of 11 22 33 23 13 12 once, as xx yy zz xy yz zx"));
        }
        let known = NAMES.map(|(known, _)| known);
        Err(Error::input(
            format!("unknown order {}", quoted(name)),
            suggestion(name, &known)
                + if crate::words::nearest(name, known).is_none() {
                    ", or the six rows, as xx yy zz xy yz zx"
                } else {
                    ""
                },
        ))
    }

    /// The order of six names of rows, each once.
    pub(super) fn of_names(names: &[&str]) -> Option<Self> {
        let row = |name: &&str| ROWS.iter().position(|known| known.contains(&name.to_lowercase().as_str()));
        let rows: Vec<usize> = names.iter().map(row).collect::<Option<_>>()?;
        let mut places = [6; 6];
        rows.iter().enumerate().for_each(|(n, &row)| places[row] = n);
        (rows.len() == 6 && places.iter().all(|&n| n < 6)).then_some(Order::Rows(places))
    }

    /// The rows in words: "11 22 33 23 13 12".
    pub(super) fn words(self) -> String {
        let names = (0..6).map(|n| (0..6).find(|&a| self.row(a) == n).map_or("", |a| ROWS[a][0]));
        match self {
            Order::VASP => "XX YY ZZ XY YZ ZX".into(),
            Order::Mandel => "11 22 33 23 13 12 (Kelvin-Mandel)".into(),
            _ => names.collect::<Vec<_>>().join(" "),
        }
    }

    /// The row in which a row of Voigt's stands.
    pub(super) fn row(self, row: usize) -> usize {
        match self {
            Order::Voigt | Order::Mandel => row,
            Order::Abaqus | Order::Lammps => [0, 1, 2, 5, 4, 3][row],
            Order::Rows(places) => places[row],
        }
    }

    /// (row, column) of the n-th of 21 numbers: the upper triangle, row by row, or column by column for Abaqus.
    pub(super) fn upper(self) -> Vec<(usize, usize)> {
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
    match Order::named(name) {
        Ok(order) if (0..6).any(|a| order.row(a) != a) || order == Order::Mandel => Err(Error::input(
            format!("the order {:?} says nothing where c11 … c66 are named: their indices are Voigt's", name.trim()),
            "name the columns by Voigt's indices (11 22 33 23 13 12) and remove order",
        )),
        _ => Ok(()),
    }
}

/// Largest difference of two entries that should be equal which is rounding, over the largest entry.
pub(super) const ROUNDING: f64 = 1e-6;

/// A matrix under a key.
pub(super) struct Given<'n> {
    pub node: &'n Node,
    pub key: &'n str,
    pub order: Order,
    /// Largest difference of two entries that should be equal, over the largest entry (at least [`ROUNDING`]).
    pub scatter: f64,
}

impl Given<'_> {
    /// The stiffness, and how far entries that should be equal differ; `value` reads one entry (Pa).
    pub fn stiffness(&self, value: impl Fn(&Node, &str) -> Result<f64>) -> Result<(Stiffness, f64)> {
        let weight = |a: usize| if self.order == Order::Mandel { 1.0 / mandel_weight(a) } else { 1.0 };
        let voigt = self.voigt(value, |_| 1.0)?.map_with_location(|a, b, c| c * weight(a) * weight(b));
        let (voigt, off) = self.symmetric(voigt);
        Stiffness::from_voigt(&voigt)
            .map(|stiffness| (stiffness, off))
            .map_err(|e| e.at(place(self.node.line, self.key)))
    }

    /// The stiffness (Pa) of a compliance matrix; `value` reads one entry (1/Pa).
    pub fn compliance(&self, value: impl Fn(&Node, &str) -> Result<f64>) -> Result<(Stiffness, f64)> {
        let weight = |a: usize| if self.order == Order::Mandel { mandel_weight(a) } else { 1.0 };
        // Components of the tensor are those of strains, of which engineering shear strains are the double.
        let strains = |a: usize| if a < 3 { 1.0 } else { 2.0 };
        let voigt = self.voigt(value, strains)?.map_with_location(|a, b, s| s * weight(a) * weight(b));
        let (voigt, off) = self.symmetric(voigt);
        let stiffness = Stiffness::from_compliance_voigt(&voigt);
        stiffness.map(|stiffness| (stiffness, off)).map_err(|e| e.at(place(self.node.line, self.key)))
    }

    /// A matrix made symmetric where it is so within the scatter, and how far it was off.
    fn symmetric(&self, voigt: Matrix6<f64>) -> (Matrix6<f64>, f64) {
        let off = (voigt - voigt.transpose()).amax() / voigt.amax();
        if off > ROUNDING && off <= self.scatter { (0.5 * (voigt + voigt.transpose()), off) } else { (voigt, 0.0) }
    }

    /// The full matrix in Voigt's order, from any shape; `weight` is that of rows of all 3×3×3×3 components.
    fn voigt(&self, value: impl Fn(&Node, &str) -> Result<f64>, weight: impl Fn(usize) -> f64) -> Result<Matrix6<f64>> {
        let Given { node, key, order, .. } = *self;
        if let Some(all) = full(node) {
            if order != Order::Voigt {
                let problem = "order says nothing of all 3×3×3×3 components, whose indices are their order";
                return Err(node.wrong(key, problem, "remove it"));
            }
            return of_full(node, &all, key, self.scatter, value)
                .map(|m| m.map_with_location(|a, b, c| c * weight(a) * weight(b)));
        }
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
}

/// All 81 components in the order of their indices; `None` if a node is no such list.
pub(super) fn full(node: &Node) -> Option<Vec<&Node>> {
    fn three(nodes: Vec<&Node>) -> Option<Vec<&Node>> {
        let lists: Option<Vec<&[Node]>> = nodes.into_iter().map(|node| node.list().filter(|l| l.len() == 3)).collect();
        Some(lists?.into_iter().flatten().collect())
    }
    let all = (0..4).try_fold(vec![node], |nodes, _| three(nodes))?;
    all.iter().all(|node| node.list().is_none()).then_some(all)
}

/// The matrix of all 81 components, whose symmetries are checked: the mean of those that should be equal within the scatter.
fn of_full(
    node: &Node,
    all: &[&Node],
    key: &str,
    scatter: f64,
    value: impl Fn(&Node, &str) -> Result<f64>,
) -> Result<Matrix6<f64>> {
    let index = |n: usize| [n / 27, n / 9 % 3, n / 3 % 3, n % 3];
    let name = |[i, j, k, l]: [usize; 4]| format!("{key} component {}{}{}{}", i + 1, j + 1, k + 1, l + 1);
    let numbers: Vec<f64> =
        all.iter().enumerate().map(|(n, item)| value(item, &name(index(n)))).collect::<Result<_>>()?;
    let largest = numbers.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let c = |[i, j, k, l]: [usize; 4]| numbers[27 * i + 9 * j + 3 * k + l];
    for at @ [i, j, k, l] in (0..81).map(index) {
        if let Some(other) =
            [[j, i, k, l], [i, j, l, k]].into_iter().find(|&o| (c(at) - c(o)).abs() > scatter.max(ROUNDING) * largest)
        {
            let problem = format!("{} is not {}", name(at), name(other).rsplit(' ').next().unwrap_or(""));
            return Err(node.wrong(key, problem, "give a tensor with C_ijkl = C_jikl = C_ijlk"));
        }
    }
    Ok(Matrix6::from_fn(|a, b| {
        let ((i, j), (k, l)) = (PAIRS[a], PAIRS[b]);
        let equal = [[i, j, k, l], [j, i, k, l], [i, j, l, k], [j, i, l, k]];
        equal.map(c).iter().sum::<f64>() / 4.0
    }))
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
