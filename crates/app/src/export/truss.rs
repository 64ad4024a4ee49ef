//! Abaqus and CalculiX: a bond is an element between two nodes, and the cell is periodic by equations.
//!
//! The far end of a bond across the border is a node of its own, tied to its image: u′ = u + E·s, s the sum of edges
//! between them. The six strains are the degrees of freedom of two reference nodes; a force V σ on one is a mean stress σ. The
//! engine is asked for strains of unit stresses, because reactions on such nodes are not printed by every engine.

use std::collections::HashMap;
use std::fmt::Write;

use super::{BondedCell, ExportFile, refuse_tangential};
use anisobond::Result;

/// What a bond becomes.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Element {
    /// T3D2 of Young's modulus 1 Pa and area k_n ℓ.
    Truss,
    /// SPRINGA of stiffness k_n: CalculiX turns trusses into solids with a hinge at each node, which hundreds of bonds at
    /// one node are too many for.
    Spring,
}

/// The file `element_test.inp`.
pub(super) fn files(cell: &BondedCell, element: Element) -> Result<Vec<ExportFile>> {
    let engine = if element == Element::Truss { "Abaqus" } else { "CalculiX" };
    refuse_tangential(cell, engine, "a truss or spring is normal only, and nodes have no rotation")?;
    Ok(vec![("element_test.inp".into(), input(cell, element).into_bytes())])
}

/// Nodes of the cell, then images; each image with the node and the shift that it repeats.
struct Images {
    of: Vec<(u32, [i32; 3])>,
    known: HashMap<(u32, [i32; 3]), usize>,
}

impl Images {
    /// The number of a node's image, from 1 on.
    fn number(&mut self, nodes: usize, node: u32, shift: [i32; 3]) -> usize {
        if shift == [0; 3] {
            return node as usize + 1;
        }
        *self.known.entry((node, shift)).or_insert_with(|| {
            self.of.push((node, shift));
            nodes + self.of.len()
        })
    }
}

/// A number in at most twenty characters: more are not read.
fn card(x: f64) -> String {
    let text = format!("{x:?}");
    if text.len() <= 20 { text } else { format!("{x:.13e}") }
}

fn input(cell: &BondedCell, element: Element) -> String {
    let (types, of) = cell.types();
    let nodes = cell.nodes.len();
    let mut images = Images { of: Vec::new(), known: HashMap::new() };
    let ends: Vec<[usize; 2]> =
        cell.bonds.iter().map(|b| [b.a as usize + 1, images.number(nodes, b.b, cell.shift(b))]).collect();
    let strains = [nodes + images.of.len() + 1, nodes + images.of.len() + 2];
    let mut text = format!(
        "** {}: bonds of anisobond {}; SI units.\n\
         ** Six steps of unit mean stress (1 Pa) 11, 22, 33, 23, 13, 12 in the volume {:?} m³. The displacements of nodes {}\n\
         ** (strains 11, 22, 33) and {} (γ 23, 13, 12) are the columns of the compliance (1/Pa); its inverse must be\n\
         ** expected.csv.\n\
         *NODE, NSET=NALL\n",
        cell.material.replace(char::is_control, " "),
        env!("CARGO_PKG_VERSION"),
        cell.volume(),
        strains[0],
        strains[1],
    );
    for (n, x) in cell.nodes.iter().enumerate() {
        let _ = writeln!(text, "{}, {}, {}, {}", n + 1, card(x.x), card(x.y), card(x.z));
    }
    for (n, (node, shift)) in images.of.iter().enumerate() {
        let x = cell.nodes[*node as usize];
        let at: [f64; 3] = std::array::from_fn(|i| x[i] + f64::from(shift[i]) * cell.edges[i]);
        let _ = writeln!(text, "{}, {}, {}, {}", nodes + n + 1, card(at[0]), card(at[1]), card(at[2]));
    }
    let _ = writeln!(text, "*NODE, NSET=STRAINS\n{}, 0.0, 0.0, 0.0\n{}, 0.0, 0.0, 0.0", strains[0], strains[1]);
    elements(&mut text, cell, element, &types, &of, &ends);
    equations(&mut text, cell, &images, strains);
    // Node 1 stays, against translations.
    text += "*BOUNDARY\n1, 1, 3\n";
    for case in 0..6 {
        let step = if element == Element::Truss { "*STEP, PERTURBATION" } else { "*STEP" };
        let _ = writeln!(
            text,
            "{step}\n*STATIC\n*CLOAD, OP=NEW\n{}, {}, {}\n*NODE PRINT, NSET=STRAINS\nU\n*END STEP",
            strains[case / 3],
            case % 3 + 1,
            card(cell.volume())
        );
    }
    text
}

/// Elements by kind, with their stiffness.
fn elements(
    text: &mut String,
    cell: &BondedCell,
    element: Element,
    types: &[super::cell::BondType],
    of: &[u32],
    ends: &[[usize; 2]],
) {
    let mut by_type = vec![Vec::new(); types.len()];
    of.iter().enumerate().for_each(|(bond, &kind)| by_type[kind as usize].push(bond));
    let name = if element == Element::Truss { "T3D2" } else { "SPRINGA" };
    for (n, (kind, bonds)) in types.iter().zip(&by_type).enumerate() {
        let _ = writeln!(text, "*ELEMENT, TYPE={name}, ELSET=B{}", n + 1);
        for &bond in bonds {
            let _ = writeln!(text, "{}, {}, {}", bond + 1, ends[bond][0], ends[bond][1]);
        }
        match element {
            Element::Truss => {
                let _ = writeln!(
                    text,
                    "*SOLID SECTION, ELSET=B{}, MATERIAL=UNIT\n{}",
                    n + 1,
                    card(kind.normal * kind.length)
                );
            }
            Element::Spring => {
                let _ = writeln!(text, "*SPRING, ELSET=B{}\n\n{}", n + 1, card(kind.normal));
            }
        }
    }
    if element == Element::Truss && !cell.bonds.is_empty() {
        text.push_str("*MATERIAL, NAME=UNIT\n*ELASTIC\n1.0, 0.0\n");
    }
}

/// u′ − u − E·s = 0, component by component.
fn equations(text: &mut String, cell: &BondedCell, images: &Images, strains: [usize; 2]) {
    // The shear strain γ between two axes, as degree of freedom of the second reference node.
    let shear = [[0, 3, 2], [3, 0, 1], [2, 1, 0]];
    for (n, (node, shift)) in images.of.iter().enumerate() {
        let image = cell.nodes.len() + n + 1;
        let s: [f64; 3] = std::array::from_fn(|i| f64::from(shift[i]) * cell.edges[i]);
        for i in 0..3 {
            let mut terms = vec![(image, i + 1, 1.0), (*node as usize + 1, i + 1, -1.0)];
            for j in 0..3 {
                match (s[j] == 0.0, i == j) {
                    (true, _) => {}
                    (false, true) => terms.push((strains[0], i + 1, -s[j])),
                    (false, false) => terms.push((strains[1], shear[i][j], -0.5 * s[j])),
                }
            }
            let _ = writeln!(text, "*EQUATION\n{}", terms.len());
            for (node, dof, factor) in terms {
                let _ = writeln!(text, "{node}, {dof}, {}", card(factor));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::card;

    #[test]
    fn numbers_fit_their_field_and_keep_their_digits() {
        for x in [-2.5467638355602257e-5, 3.0687028382754893e-6, 0.007373384711428692, -1.0 / 3.0e77, 1e9 / 7.0, 0.0] {
            let text = card(x);
            assert!(text.len() <= 20 && (text.parse::<f64>().unwrap() - x).abs() <= 1e-13 * x.abs(), "{text}");
        }
    }
}
