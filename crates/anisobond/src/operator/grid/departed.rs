//! What bonds that left the linear law add to energies, stresses and damage, and how they are kept.

use nalgebra::Vector3;

use super::failing::FailingBonds;
use super::measure::{NodeState, elongation};
use super::nonlinear::{NonlinearBond, NonlinearBonds};
use super::padded::Padded;
use crate::bond_law::BondState;
use crate::operator::Kinematics;
use crate::{Error, Result};

impl FailingBonds {
    /// Every bond that left the linear law, with its stiffness g k (N/m).
    fn departed_bonds(&self) -> impl Iterator<Item = (&NonlinearBond, f64)> {
        self.nonlinear.iter().flat_map(|n| n.list.iter().map(|bond| (bond, n.stiffness(bond))))
    }

    /// Strain energy (J).
    ///
    /// # Errors
    /// Displacements of other bonds.
    pub fn energy(&self, u: &Padded<f64>, kinematics: Kinematics) -> Result<f64> {
        let of = |(bond, stiffness): (&NonlinearBond, f64)| {
            let [_, e] = self.grid.elongations(u, kinematics, |_, _| Vector3::zeros(), bond);
            let beyond = bond.beyond(e);
            0.5 * stiffness * beyond * beyond
        };
        let departed: f64 = self.departed_bonds().map(of).sum();
        Ok(self.grid.energy(u, kinematics)? + departed)
    }

    /// Σ ½ κ (e − p) p (J) of the bonds that yield: by so much their energy is less than −½ Σ u·f.
    pub fn energy_of_rest(&self, u: &Padded<f64>) -> f64 {
        if !self.yields() {
            return 0.0;
        }
        let of = |(bond, stiffness): (&NonlinearBond, f64)| {
            let [_, e] = self.grid.elongations(u, Kinematics::Linear, |_, _| Vector3::zeros(), bond);
            0.5 * stiffness * bond.beyond(e) * bond.state.permanent * bond.onset
        };
        self.departed_bonds().map(of).sum()
    }

    /// Energy and stress of every node; those of a bond that left the linear law are shared by its ends as those of others.
    pub fn node_states(&self, u: &Padded<f64>, kinematics: Kinematics) -> Vec<NodeState> {
        let mut states = self.grid.node_states(u, kinematics);
        let volume = self.grid.body.grid.spacing.powi(3);
        for (bond, k) in self.departed_bonds() {
            let eta = Vector3::from(u.at(bond.other as usize)) - Vector3::from(u.at(bond.node as usize));
            let (elongation, to) = elongation(kinematics, &self.grid.half.xi[usize::from(bond.half)], &eta);
            let beyond = bond.beyond(elongation);
            for node in [bond.node, bond.other] {
                let state = &mut states[node as usize];
                state.energy += 0.25 * k * beyond * beyond;
                state.stress += 0.5 * k * beyond / to.norm() / volume * to * to.transpose();
            }
        }
        states
    }

    /// Plastic stretch of each node (–): the mean over its original bonds of |p|/|ξ|, p the elongation at which a bond is without
    /// force.
    pub fn plastic_stretch(&self) -> Vec<f64> {
        let mut stretch = vec![0.0; self.grid.stencil.len()];
        for (bond, _) in self.departed_bonds() {
            let length = self.grid.half.xi[usize::from(bond.half)].norm();
            for node in [bond.node as usize, bond.other as usize] {
                let bonds = self.grid.original_bonds(node) as f64;
                stretch[node] += bond.state.permanent.abs() * bond.onset / length / bonds;
            }
        }
        stretch
    }

    /// Damage of each node (–): the mean over its original bonds of the share of their fracture energy that they have spent; of
    /// brittle bonds, the share that is broken.
    pub fn damage(&self) -> Vec<f64> {
        let mut damage = self.grid.damage();
        for (bond, law) in self.nonlinear.iter().flat_map(|n| n.list.iter().map(|b| (b, &n.law))) {
            for node in [bond.node, bond.other] {
                let unspent = 1.0 - law.damage(&bond.state);
                damage[node as usize] -= unspent / self.grid.original_bonds(node as usize) as f64;
            }
        }
        damage
    }

    /// Damage (–) of half bond p of a node, or of the bond at its −ξ, which is no longer linear.
    pub(super) fn spent(&self, node: usize, p: usize, ahead: bool) -> f64 {
        let is_it =
            |b: &&NonlinearBond| usize::from(b.half) == p && (if ahead { b.node } else { b.other }) as usize == node;
        let of = |n: &NonlinearBonds| n.of_node(node).find(is_it).map(|bond| n.law.damage(&bond.state));
        self.nonlinear.as_ref().and_then(of).unwrap_or(1.0)
    }

    /// The bonds that left the linear law, as they are kept: node and half bond in a word, history and permanent elongation.
    pub fn departed_state(&self) -> (Vec<u64>, [Vec<f64>; 2]) {
        let words = self.list().iter().map(|b| u64::from(b.node) << 16 | u64::from(b.half)).collect();
        let numbers = |of: fn(&BondState) -> f64| self.list().iter().map(|b| of(&b.state)).collect();
        (words, [numbers(|s| s.history), numbers(|s| s.permanent)])
    }

    /// Go on with bonds as they were: bits of [`GridBonds::unbroken_bits`](super::GridBonds::unbroken_bits), and what [`FailingBonds::departed_state`] says.
    ///
    /// # Errors
    /// The state of another body, or of bonds that fail otherwise.
    pub fn restore(&mut self, bits: &[u64], departed: &[u64], [history, permanent]: [&[f64]; 2]) -> Result<()> {
        self.grid.restore_bits(bits)?;
        let bond = |((&word, &history), &permanent): ((&u64, &f64), &f64)| {
            let event = ((word >> 16) as u32, word as u16);
            let inside = (event.0 as usize) < self.grid.stencil.len() && usize::from(event.1) < self.grid.half.len();
            inside.then(|| self.grid.nonlinear_bond(event, BondState { history, permanent })).flatten()
        };
        let list: Option<Vec<NonlinearBond>> = departed.iter().zip(history).zip(permanent).map(bond).collect();
        match (&mut self.nonlinear, list) {
            (Some(nonlinear), Some(list)) => nonlinear.set(list),
            (None, Some(list)) if list.is_empty() => {}
            _ => {
                return Err(Error::input(
                    "the saved bonds have another law than those of this case",
                    "resume with the case as it was",
                ));
            }
        }
        Ok(())
    }
}
