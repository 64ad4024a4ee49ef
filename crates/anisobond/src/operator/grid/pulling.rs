//! Forces of a body's bonds, those that left the linear law among them.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::failing::{FailingBonds, Overstretched};
use super::measure::elongation;
use super::nonlinear::NonlinearBond;
use super::padded::Padded;
use super::sweep::Law;
use crate::Result;
use crate::lattice::Body;
use crate::operator::{GridOperator, Kinematics, VectorField};
use crate::tensor::Stiffness;

/// Which state bonds that left the linear law pull by.
#[derive(Clone, Copy, PartialEq)]
enum Pulling {
    /// Their own.
    Own,
    /// Their own, taken from where they are without force: linear in the displacements.
    FromRest,
    /// That which the displacements would bring them to.
    Coming,
}

impl FailingBonds {
    /// Forces (N) of displacements, row by row, as [`GridBonds::sweep_breaking`](super::GridBonds::sweep_breaking) visits them; brittle bonds that are stretched
    /// too far are without force and are returned, to be broken by [`FailingBonds::break_off`]. Bonds that left the linear law pull
    /// as that of theirs lets them.
    ///
    /// # Errors
    /// As [`GridBonds::sweep`](super::GridBonds::sweep).
    pub fn sweep<V: Send, R: Send>(
        &self,
        u: &Padded<f64>,
        kinematics: Kinematics,
        fields: [&mut [V]; 3],
        visit: impl Fn(usize, [&[f64]; 3], [&mut [V]; 3]) -> R + Sync,
    ) -> Result<(Overstretched, Vec<R>)> {
        if self.nonlinear.is_none() {
            self.grid.refuse_others(u)?;
            let law = Law { kinematics, breaking: self.grid.breakable() };
            let (results, events) = self.grid.pass(u, law, fields, visit);
            return Ok((Overstretched(events), results));
        }
        Ok((Overstretched::default(), self.sweep_intact(u, kinematics, fields, visit)?))
    }

    /// As [`FailingBonds::sweep`], and nothing fails.
    ///
    /// # Errors
    /// As [`GridBonds::sweep`](super::GridBonds::sweep).
    pub fn sweep_intact<V: Send, R: Send>(
        &self,
        u: &Padded<f64>,
        kinematics: Kinematics,
        fields: [&mut [V]; 3],
        visit: impl Fn(usize, [&[f64]; 3], [&mut [V]; 3]) -> R + Sync,
    ) -> Result<Vec<R>> {
        self.grid.refuse_others(u)?;
        let n = self.grid.row_nodes();
        let pulls = self.pulls(kinematics, Pulling::Own, |node| Vector3::from(u.at(node)));
        self.grid.sweep(u, kinematics, fields, |row, force, fields| {
            let here = row_of(&pulls, row * n, n);
            if here.is_empty() {
                return visit(row, force, fields);
            }
            let mut force = force.map(<[f64]>::to_vec);
            for (node, pull) in here {
                force.iter_mut().zip(pull.iter()).for_each(|(f, p)| f[*node as usize - row * n] += p);
            }
            let [x, y, z] = &force;
            visit(row, [x, y, z], fields)
        })
    }

    /// Forces (N) of displacements (m) under either kinematics.
    pub fn forces_of(&self, u: &VectorField, kinematics: Kinematics, f: &mut VectorField) {
        self.forces_by(u, kinematics, Pulling::Own, f);
    }

    /// Forces (N) of displacements (m), those of bonds that yield as their law has them there, not linear in the displacements: the
    /// forces with which an equilibrium is solved for.
    pub fn coming_forces(&self, u: &VectorField, kinematics: Kinematics, f: &mut VectorField) {
        let pulling = if self.yields() { Pulling::Coming } else { Pulling::Own };
        self.forces_by(u, kinematics, pulling, f);
    }

    fn forces_by(&self, u: &VectorField, kinematics: Kinematics, pulling: Pulling, f: &mut VectorField) {
        match kinematics {
            Kinematics::Linear => self.grid.forces(u, f),
            Kinematics::Finite => self.grid.finite_forces(u, f),
        }
        for (node, pull) in self.pulls(kinematics, pulling, |node| u.at(node)) {
            let sum = f.at(node as usize) + pull;
            f.set(node as usize, &sum);
        }
    }

    /// Forces (N) of the bonds that left the linear law on their ends, by node.
    fn pulls(
        &self,
        kinematics: Kinematics,
        pulling: Pulling,
        at: impl Fn(usize) -> Vector3<f64> + Sync,
    ) -> Vec<(u32, Vector3<f64>)> {
        let Some(nonlinear) = &self.nonlinear else { return Vec::new() };
        let of = |bond: &NonlinearBond| {
            let eta = at(bond.other as usize) - at(bond.node as usize);
            let (elongation, to) = elongation(kinematics, &self.grid.half.xi[usize::from(bond.half)], &eta);
            let (stiffness, beyond) = match pulling {
                Pulling::Own => (nonlinear.stiffness(bond), bond.beyond(elongation)),
                Pulling::FromRest => (nonlinear.stiffness(bond), elongation),
                Pulling::Coming => {
                    let state = nonlinear.law.after_unbroken(&bond.state, elongation / bond.onset);
                    let coming = NonlinearBond { state, ..*bond };
                    (nonlinear.stiffness(&coming), coming.beyond(elongation))
                }
            };
            stiffness * beyond / to.norm() * to
        };
        let pulls: Vec<Vector3<f64>> = nonlinear.list.par_iter().with_min_len(256).map(of).collect();
        let of_end = |&(node, place): &(u32, u32)| {
            let (bond, pull) = (&nonlinear.list[place as usize], pulls[place as usize]);
            (node, if bond.node == node { pull } else { -pull })
        };
        nonlinear.ends().iter().map(of_end).collect()
    }
}

/// Entries of nodes `first` … `first + count − 1` of a list sorted by node.
fn row_of(pulls: &[(u32, Vector3<f64>)], first: usize, count: usize) -> &[(u32, Vector3<f64>)] {
    let from = |node: usize| pulls.partition_point(|(n, _)| (*n as usize) < node);
    &pulls[from(first)..from(first + count)]
}

impl GridOperator for FailingBonds {
    fn body(&self) -> &Body {
        self.grid.body()
    }

    fn forces(&self, u: &VectorField, f: &mut VectorField) {
        self.forces_by(u, Kinematics::Linear, Pulling::FromRest, f);
    }

    fn diagonal_block(&self, node: usize) -> Matrix3<f64> {
        let mut block = self.grid.diagonal_block(node);
        for (nonlinear, bond) in self.nonlinear.iter().flat_map(|n| n.of_node(node).map(move |b| (n, b))) {
            let n = self.grid.half.xi[usize::from(bond.half)].normalize();
            block += nonlinear.stiffness(bond) * n * n.transpose();
        }
        block
    }

    fn half_bonds(&self, node: usize, visit: &mut dyn FnMut(usize)) {
        self.grid.half_bonds(node, visit);
        let list = self.list();
        let from = list.partition_point(|b| (b.node as usize) < node);
        let own = list[from..].iter().take_while(|b| b.node as usize == node);
        own.filter(|b| b.stiffness != 0.0).for_each(|b| visit(b.other as usize));
    }

    fn bonds_along(&self, offset: [i32; 3], visit: &(dyn Fn(usize, usize) + Sync)) {
        self.grid.bonds_along(offset, visit);
    }

    fn bulk_stiffness(&self, region: u16) -> Stiffness {
        self.grid.bulk_stiffness(region)
    }

    fn bulk_bonds(&self, region: u16) -> Vec<([i32; 3], f64)> {
        self.grid.bulk_bonds(region)
    }

    fn wholeness(&self, node: usize) -> f64 {
        self.grid.wholeness(node)
    }
}
