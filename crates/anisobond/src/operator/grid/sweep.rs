//! One pass over all rows: forces, and bonds that break.

use std::sync::atomic::Ordering;

use rayon::prelude::*;

use super::ahead::Ahead;
use super::build::GridBonds;
use super::padded::Padded;
use super::real::Real;
use super::strip::{Event, Scratch, Task};
use super::tables::Wanted;
use crate::operator::Kinematics;
use crate::{Error, Result};

/// How bonds respond in a pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Law {
    /// Linear or finite stretch.
    pub kinematics: Kinematics,
    /// Whether bonds above their critical stretch break. They break in tension only.
    pub breaking: bool,
}

/// Bonds that broke in a pass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Broken {
    /// Number.
    pub count: usize,
    /// Elastic energy that they held (J).
    pub energy: f64,
}

impl<T: Real> GridBonds<T> {
    /// Forces (N) of displacements, row by row in parallel: `visit` is given a row's number j + n₂k, its forces in
    /// natural order (zero where there is no node) and the row's part of three arrays of one value per node, and returns
    /// what is gathered by row. Bonds do not break.
    ///
    /// # Errors
    /// Displacements in the layout of another body or neighbourhood: they are made by [`GridBonds::padded`] of these bonds.
    pub fn sweep<V: Send, R: Send>(
        &self,
        u: &Padded<T>,
        kinematics: Kinematics,
        fields: [&mut [V]; 3],
        visit: impl Fn(usize, [&[T]; 3], [&mut [V]; 3]) -> R + Sync,
    ) -> Result<Vec<R>> {
        self.refuse_others(u)?;
        Ok(self.pass(u, Law { kinematics, breaking: false }, fields, visit).0)
    }

    /// As [`GridBonds::sweep`]; bonds stretched above their critical stretch break, are without force already in this
    /// pass, and are counted. Both ends of a bond decide identically.
    ///
    /// # Errors
    /// As [`GridBonds::sweep`].
    pub fn sweep_breaking<V: Send, R: Send>(
        &mut self,
        u: &Padded<T>,
        kinematics: Kinematics,
        fields: [&mut [V]; 3],
        visit: impl Fn(usize, [&[T]; 3], [&mut [V]; 3]) -> R + Sync,
    ) -> Result<(Broken, Vec<R>)> {
        self.refuse_others(u)?;
        Ok(self.pass_breaking(u, kinematics, fields, visit))
    }

    /// Passes over all bonds for forces so far.
    pub fn passes(&self) -> u64 {
        self.passes.load(Ordering::Relaxed)
    }

    /// Displacements of other bonds are in another layout, or may be.
    pub(super) fn refuse_others(&self, u: &Padded<T>) -> Result<()> {
        match std::sync::Arc::ptr_eq(&u.layout, &self.layout) {
            true => Ok(()),
            false => Err(Error::input(
                "the displacements are in the layout of other bonds",
                "make them by `padded` of these bonds",
            )),
        }
    }

    /// [`GridBonds::sweep_breaking`] for displacements of these bonds.
    pub(super) fn pass_breaking<V: Send, R: Send>(
        &mut self,
        u: &Padded<T>,
        kinematics: Kinematics,
        fields: [&mut [V]; 3],
        visit: impl Fn(usize, [&[T]; 3], [&mut [V]; 3]) -> R + Sync,
    ) -> (Broken, Vec<R>) {
        let (result, events) = self.pass(u, Law { kinematics, breaking: self.breakable }, fields, visit);
        let energy =
            events.iter().map(|&(node, p)| self.bond_energy(u, kinematics, node as usize, usize::from(p))).sum();
        let broken = Broken { count: events.len(), energy };
        self.fail_bonds(events.iter().map(|&(node, p)| (node as usize, usize::from(p))));
        (broken, result)
    }

    /// Forces, and what breaks, for displacements of these bonds ([`GridBonds::refuse_others`]).
    pub(super) fn pass<V: Send, R: Send>(
        &self,
        u: &Padded<T>,
        law: Law,
        fields: [&mut [V]; 3],
        visit: impl Fn(usize, [&[T]; 3], [&mut [V]; 3]) -> R + Sync,
    ) -> (Vec<R>, Vec<Event>) {
        let n = self.row_nodes();
        self.passes.fetch_add(1, Ordering::Relaxed);
        let tables = self.tables(law, Wanted::Forces);
        let nodal = self.nodal(u, law.kinematics);
        let mut parts: Vec<Option<[&mut [V]; 3]>> = self.parts(fields).into_iter().map(Some).collect();
        let order = self.layout.order.iter().filter_map(|&s| parts[s].take().map(|part| (s, part)));
        let mut visited: Vec<(usize, Vec<R>, Vec<Event>)> = order
            .collect::<Vec<_>>()
            .into_par_iter()
            .map_init(
                || (Scratch::new(self), Ahead::default()),
                |(scratch, ahead), (strip, [x, y, z])| {
                    let rows = self.layout.strips[strip].clone();
                    let task = Task {
                        bonds: self,
                        u,
                        law,
                        tables: &tables,
                        rows: rows.clone(),
                        wanted: Wanted::Forces,
                        nodal: nodal.as_ref(),
                    };
                    task.ask_ahead([x, y, z], ahead);
                    let mut events = Vec::new();
                    T::strip(&task, scratch, ahead, &mut events);
                    let parts = x.chunks_mut(n).zip(y.chunks_mut(n)).zip(z.chunks_mut(n));
                    let results = rows.zip(parts).map(|(row, ((x, y), z))| {
                        T::natural(&task, scratch, row, &mut events);
                        let [fx, fy, fz] = &scratch.natural;
                        visit(row, [fx, fy, fz], [x, y, z])
                    });
                    (strip, results.collect(), events)
                },
            )
            .collect();
        self.keep_nodal(nodal);
        visited.sort_unstable_by_key(|(strip, ..)| *strip);
        let (mut results, mut events) = (Vec::with_capacity(self.layout.rows()), Vec::new());
        for (_, of_rows, broken) in visited {
            results.extend(of_rows);
            events.extend(broken);
        }
        (results, events)
    }

    /// Values of every node by strips.
    fn parts<'a, V>(&self, fields: [&'a mut [V]; 3]) -> Vec<[&'a mut [V]; 3]> {
        let [mut x, mut y, mut z] = fields;
        let mut parts = Vec::with_capacity(self.layout.strips.len());
        for rows in &self.layout.strips {
            let n = rows.len() * self.row_nodes();
            parts.push([&mut x, &mut y, &mut z].map(|field| {
                let (part, rest) = std::mem::take(field).split_at_mut(n);
                *field = rest;
                part
            }));
        }
        parts
    }

    /// Energy (J) of the bonds without nodal terms, summed in f64 by nodes and rows in their order.
    pub(super) fn bonds_energy(&self, u: &Padded<T>, kinematics: Kinematics) -> f64 {
        let law = Law { kinematics, breaking: false };
        let tables = self.tables(law, Wanted::Energy);
        let of_strip = |(scratch, ahead): &mut (Scratch<T>, Ahead), rows: &std::ops::Range<usize>| {
            let task =
                Task { bonds: self, u, law, tables: &tables, rows: rows.clone(), wanted: Wanted::Energy, nodal: None };
            T::strip(&task, scratch, ahead, &mut Vec::new());
            let of_row = |row| {
                T::natural(&task, scratch, row, &mut Vec::new());
                scratch.natural[0].iter().map(|e| e.f64()).sum()
            };
            rows.clone().map(of_row).collect::<Vec<f64>>()
        };
        let energies: Vec<Vec<f64>> =
            self.layout.strips.par_iter().map_init(|| (Scratch::new(self), Ahead::default()), of_strip).collect();
        energies.iter().flatten().sum()
    }
}
