//! Where six rows of six numbers stand in a text, and the words around them.

use super::figure::{Figure, figures};
use super::square::Square;
use crate::material::matrix::Order;

/// Most rows of a block, and most words above it, that are kept.
const MOST_ROWS: usize = 64;
const MOST_TITLES: usize = 6;

/// Most blocks that are kept whatever they are, and most that are matrices.
const MOST_BLOCKS: usize = 64;
const MOST_MATRICES: usize = 1024;

/// Numbers in rows without words between.
pub(super) struct Block {
    /// Its first line, from 1.
    pub line: usize,
    /// The numbers, without labels.
    pub rows: Vec<Vec<Figure>>,
    /// Whether there are more than are kept.
    pub more: bool,
    /// Labels of the rows ("XX"), where every row has one.
    pub labels: Option<Vec<String>>,
    /// The lines of words above, nearest last.
    pub titles: Vec<String>,
}

impl Block {
    /// Its matrices: one, or several below each other.
    pub fn squares(&self) -> Vec<Square> {
        if self.more {
            return Vec::new();
        }
        let rows = self.unnumbered();
        let six = rows.iter().all(|row| row.len() == 6);
        if six && rows.len() > 6 && rows.len().is_multiple_of(6) {
            return rows.chunks(6).filter_map(Square::of_rows).collect();
        }
        let lengths: Vec<usize> = rows.iter().map(Vec::len).collect();
        let usual = match lengths[..] {
            [6, 6, 6, 6, 6, 6] | [6, 5, 4, 3, 2, 1] | [1, 2, 3, 4, 5, 6] | [21] | [36] => true,
            [18, 18] | [12, 12, 12] | [9, 9, 9, 9] => true,
            _ => lengths.len() == 12 && lengths.chunks(2).all(|pair| pair == [4, 2]),
        };
        if usual { Square::of_rows(&rows).into_iter().collect() } else { Vec::new() }
    }

    /// The rows without the numbers 1 … 6 above them or before each.
    fn unnumbered(&self) -> Vec<Vec<Figure>> {
        let counts = |numbers: &[f64]| numbers.iter().enumerate().all(|(n, x)| *x == (n + 1) as f64);
        let values = |row: &Vec<Figure>| row.iter().map(|f| f.value).collect::<Vec<_>>();
        let mut rows = self.rows.clone();
        if rows.len() == 7 && rows[0].len() == 6 && counts(&values(&rows[0])) {
            rows.remove(0);
        }
        let firsts: Vec<f64> = rows.iter().filter_map(|row| row.first()).map(|f| f.value).collect();
        let full = rows.iter().all(|row| row.len() == 7) || rows.iter().enumerate().all(|(n, row)| row.len() == 7 - n);
        if rows.len() == 6 && rows[0].len() == 7 && full && counts(&firsts) {
            rows.iter_mut().for_each(|row| row.rotate_left(1));
            rows.iter_mut().for_each(|row| row.truncate(row.len() - 1));
        }
        rows
    }

    /// The order that labels of rows or words above name.
    pub fn order(&self) -> Option<Order> {
        let labels = self.labels.as_ref().map(|labels| labels.join(" "));
        let named = labels.iter().map(String::as_str).chain(self.titles.iter().rev().map(String::as_str));
        named.filter_map(order_in_words).next()
    }

    /// The nearest line above that fits.
    pub fn title(&self, fits: impl Fn(&str) -> bool) -> Option<&str> {
        self.titles.iter().rev().map(String::as_str).find(|title| fits(title))
    }

    /// The factor before all numbers: "1.0e+03 *" of MATLAB, "*10^2" behind a title.
    pub fn factor(&self) -> f64 {
        let factor = |title: &String| {
            let title = title.trim();
            let before = title.strip_suffix('*').and_then(|number| Figure::of(number.trim()));
            let power = || title.rsplit_once('*').and_then(|(_, power)| power.trim().strip_prefix("10^")?.parse().ok());
            before.map(|f| f.value).or_else(|| power().filter(|p: &i32| p.abs() < 20).map(|p| 10f64.powi(p)))
        };
        self.titles.last().and_then(factor).unwrap_or(1.0)
    }
}

/// Six names of components in a row among words, as an order.
pub(super) fn order_in_words(words: &str) -> Option<Order> {
    let words: Vec<&str> = words.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty()).collect();
    words.windows(6).filter(|six| six.iter().all(|word| word.len() == 2)).find_map(Order::of_names)
}

/// The blocks of a text.
pub(super) fn blocks(text: &str) -> Vec<Block> {
    let mut all: Vec<Block> = Vec::new();
    let mut titles: Vec<String> = Vec::new();
    let mut open = false;
    for (n, line) in text.lines().enumerate() {
        let Some((label, row)) = row(line) else {
            if separates(line) {
                continue;
            }
            if open {
                titles.clear();
            }
            open = false;
            if titles.len() == MOST_TITLES {
                titles.remove(0);
            }
            titles.push(line.trim().chars().take(200).collect());
            continue;
        };
        if !open {
            // Of a long text only what may be a matrix is kept.
            if all.len() > MOST_BLOCKS && all.last().is_some_and(|block| block.squares().is_empty()) {
                all.pop();
            }
            if all.len() > MOST_MATRICES {
                break;
            }
            all.push(Block { line: n + 1, rows: vec![], more: false, labels: Some(vec![]), titles: titles.clone() });
        }
        open = true;
        if let Some(block) = all.last_mut() {
            block.more |= block.rows.len() == MOST_ROWS;
            if !block.more {
                block.rows.push(row);
                match (label, &mut block.labels) {
                    (Some(label), Some(labels)) => labels.push(label),
                    _ => block.labels = None,
                }
            }
        }
    }
    all
}

/// A line without words or numbers.
fn separates(line: &str) -> bool {
    line.chars().all(|c| c.is_whitespace() || "-=_+~.[](){}|,;".contains(c))
}

/// The numbers of a line, and the label before them; `None` where there are words.
fn row(line: &str) -> Option<(Option<String>, Vec<Figure>)> {
    let line = line.trim();
    if line.starts_with(['#', '%', '!']) {
        return None;
    }
    let line = line.split(['#', '%', '!']).next().unwrap_or("");
    // The first line of MATLAB's and Python's matrices.
    let line = match line.split_once('=') {
        Some((name, rest)) if name.trim().chars().all(char::is_alphabetic) && rest.contains('[') => rest,
        _ => line,
    };
    let line = line.trim_end().trim_end_matches("...").replace(['[', ']', '{', '}', '|'], " ");
    let line = line.trim();
    let (first, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    if first.len() == 2 && first.chars().all(|c| "xyzXYZ".contains(c)) {
        return figures(rest).map(|row| (Some(first.to_string()), row));
    }
    figures(line).map(|row| (None, row))
}
