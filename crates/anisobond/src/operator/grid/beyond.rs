//! Bonds beyond their critical stretch: which they are, and what nodal terms lose where they break.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::build::GridBonds;
use super::failing::Way;
use super::measure::elongation;
use super::nonlinear::NonlinearBond;
use super::padded::Padded;
use super::strip::Event;
use super::sweep::Law;
use crate::bond_law::BondState;
use crate::operator::Kinematics;

impl GridBonds<f64> {
    /// Bonds above their critical stretch.
    pub(super) fn overstretched(&self, u: &Padded<f64>, kinematics: Kinematics) -> Vec<Event> {
        let nodes = self.stencil.len();
        let (mut x, mut y, mut z) = (vec![(); nodes], vec![(); nodes], vec![(); nodes]);
        let law = Law { kinematics, breaking: true };
        self.pass(u, law, [&mut x, &mut y, &mut z], |_, _, _| ()).1
    }

    /// Unbroken bonds that could fail and are compressed by more than their critical stretch.
    pub(super) fn compressed(&self, u: &Padded<f64>, kinematics: Kinematics) -> Vec<Event> {
        let n = self.row_nodes();
        let of_node = |node: usize| {
            let (row, e) = (node / n, node % n);
            let here = Vector3::from(u.at(node));
            let is = move |p: usize| {
                let xi = &self.half.xi[p];
                let Some(other) = self.node_at(row, e, self.half.offset[p]).filter(|_| self.own_bit(row, e, p)) else {
                    return false;
                };
                let (shortened, _) = elongation(kinematics, xi, &(Vector3::from(u.at(other)) - here));
                // Most bonds are stretched, or hardly shortened.
                shortened < 0.0 && -shortened > self.constants_of(node, p, true)[1] * xi.norm()
            };
            (0..self.half.len()).filter(move |&p| is(p)).map(move |p| (node as u32, p as u16))
        };
        let nodes = (0..self.stencil.len()).into_par_iter().with_min_len(256);
        nodes.filter(|&node| self.stencil[node] > 0).flat_map_iter(of_node).collect()
    }

    /// A half bond, whether broken or not, in a state of its law; `None` without a node at its end.
    pub(super) fn nonlinear_bond(&self, (node, half): Event, state: BondState) -> Option<NonlinearBond> {
        let (n, p) = (self.row_nodes(), usize::from(half));
        let other = self.node_at(node as usize / n, node as usize % n, self.half.offset[p])?;
        let [stiffness, critical] = self.constants_of(node as usize, p, true);
        let onset = critical * self.half.xi[p].norm();
        Some(NonlinearBond { node, half, other: other as u32, stiffness, onset, state })
    }

    /// Elongations of a bond (m): before its ends moved apart (m), and now.
    pub(super) fn elongations(
        &self,
        u: &Padded<f64>,
        kinematics: Kinematics,
        moved: impl Fn(usize, usize) -> Vector3<f64>,
        bond: &NonlinearBond,
    ) -> [f64; 2] {
        let xi = &self.half.xi[usize::from(bond.half)];
        let (first, second) = (bond.node as usize, bond.other as usize);
        let now = Vector3::from(u.at(second)) - Vector3::from(u.at(first));
        let way = moved(first, second);
        [now - way, now].map(|eta| elongation(kinematics, xi, &eta).0)
    }

    /// Break bonds, and return the energy (J) that nodal terms lose by it on a way from u or, with a negative time, to u.
    ///
    /// On a way w from u to u' a changing quadratic energy ½ B(u, u) loses ½ B(u, u') − ½ B'(u, u'), and ½ B(u, u') is the
    /// energy of the mean of both less that of half their difference. Of any energy W it is W(u) + ½ W'(u) w, which at finite
    /// stretch leaves an error of second order in the step.
    pub(super) fn clear_with_nodal(
        &mut self,
        events: &[Event],
        u: &Padded<f64>,
        kinematics: Kinematics,
        way: Option<Way>,
    ) -> f64 {
        let broken = || events.iter().map(|&(node, p)| (node as usize, usize::from(p)));
        if !self.has_nodal_term() || events.is_empty() {
            self.fail_bonds(broken());
            return 0.0;
        }
        let other = |&(node, p): &Event| {
            let n = self.row_nodes();
            self.node_at(node as usize / n, node as usize % n, self.half.offset[usize::from(p)])
        };
        let mut ends: Vec<usize> = events.iter().filter_map(other).chain(broken().map(|(node, _)| node)).collect();
        ends.sort_unstable();
        ends.dedup();
        let (mut middle, mut half_way) = (u.clone(), self.padded());
        if let (Some((velocity, step)), Kinematics::Linear) = (way, kinematics) {
            let [x, y, z] = &velocity.components;
            middle.drift([x, y, z], 0.5 * step);
            half_way.drift([x, y, z], 0.5 * step);
        }
        let of = |bonds: &Self, node: usize| match kinematics {
            Kinematics::Linear => {
                bonds.nodal_state(&middle, kinematics, node).0 - bonds.nodal_state(&half_way, kinematics, node).0
            }
            Kinematics::Finite => {
                let work = way.map_or(0.0, |way| 0.5 * bonds.nodal_work(u, node, way));
                bonds.nodal_state(u, kinematics, node).0 + work
            }
        };
        let energy = |bonds: &Self| -> f64 { ends.iter().map(|&node| of(bonds, node)).sum() };
        let before = energy(self);
        self.fail_bonds(broken());
        before - energy(self)
    }

    /// Number of bonds of a node before any broke.
    pub(super) fn original_bonds(&self, node: usize) -> usize {
        let n = self.row_nodes();
        let offsets = self.half.offset.iter().flat_map(|&offset| [offset, offset.map(|x| -x)]);
        offsets.filter(|&offset| self.node_at(node / n, node % n, offset).is_some()).count()
    }
}
