//! Which bonds are unbroken, kept and brought back; forces and breaking of displacements in natural order.

use super::aligned::Aligned;
use super::build::GridBonds;
use super::failing::FailingBonds;
use super::nonlinear::NonlinearBond;
use super::real::Real;
use super::sweep::{Broken, Law};
use crate::operator::{Kinematics, VectorField};
use crate::{Error, Result};

impl GridBonds<f64> {
    /// Forces (N) of displacements (m) at finite stretch.
    pub fn finite_forces(&self, u: &VectorField, f: &mut VectorField) {
        let law = Law { kinematics: Kinematics::Finite, breaking: false };
        let mut padded = self.padded();
        padded.set(u);
        let [x, y, z] = &mut f.components;
        self.pass(&padded, law, [x, y, z], |_, from, to| {
            to.into_iter().zip(from).for_each(|(to, from)| to.copy_from_slice(from));
        });
    }

    /// Break every bond that displacements (m) stretch above its critical stretch.
    pub fn break_overstretched(&mut self, u: &VectorField, kinematics: Kinematics) -> Broken {
        if !self.breakable() {
            return Broken::default();
        }
        let mut padded = self.padded();
        padded.set(u);
        let n = u.len();
        let (mut x, mut y, mut z) = (vec![(); n], vec![(); n], vec![(); n]);
        self.pass_breaking(&padded, kinematics, [&mut x, &mut y, &mut z], |_, _, _| ()).0
    }
}

/// Which bonds of a body are unbroken, and which follow another law: what [`FailingBonds::put_back`] goes back to.
#[derive(Clone, Debug)]
pub struct KeptBonds {
    bits: Aligned<<f64 as Real>::Word>,
    whole: Vec<bool>,
    torn: Vec<bool>,
    unbroken: Vec<u16>,
    nonlinear: Option<Vec<NonlinearBond>>,
}

impl FailingBonds {
    /// The bonds' state, to go back to.
    pub fn kept(&self) -> KeptBonds {
        let grid = &self.grid;
        KeptBonds {
            bits: grid.bits.clone(),
            whole: grid.whole.clone(),
            torn: grid.torn.clone(),
            unbroken: grid.surroundings.unbroken().to_vec(),
            nonlinear: self.nonlinear.as_ref().map(|n| n.list.clone()),
        }
    }

    /// Go back to a state of these bonds, or on to one.
    pub fn put_back(&mut self, kept: &KeptBonds) {
        let grid = &mut self.grid;
        grid.bits.clone_from(&kept.bits);
        grid.whole.clone_from(&kept.whole);
        grid.torn.clone_from(&kept.torn);
        grid.surroundings.set_unbroken(&kept.unbroken);
        if let (Some(nonlinear), Some(list)) = (&mut self.nonlinear, &kept.nonlinear) {
            nonlinear.set(list.clone());
        }
    }
}

impl<T: Real> GridBonds<T> {
    /// Number of unbroken bonds, each pair once.
    pub fn unbroken(&self) -> usize {
        let n = self.row_nodes();
        let of = |node: usize| (0..self.half.len()).filter(|&p| self.own_bit(node / n, node % n, p)).count();
        (0..self.stencil.len()).filter(|&node| self.stencil[node] > 0).map(of).sum()
    }

    /// One bit per half bond, node by node, whole words per node: whether it is unbroken; bonds in the order of the second
    /// half of the neighbourhood's.
    pub fn unbroken_bits(&self) -> Vec<u64> {
        let (n, words) = (self.row_nodes(), self.half.len().div_ceil(64));
        let mut bits = vec![0; words * self.stencil.len()];
        for (node, bits) in bits.chunks_exact_mut(words.max(1)).enumerate().filter(|(node, _)| self.stencil[*node] > 0)
        {
            for p in (0..self.half.len()).filter(|&p| self.own_bit(node / n, node % n, p)) {
                let place = self.half.full[p] - self.half.bonds / 2;
                bits[place / 64] |= 1 << (place % 64);
            }
        }
        bits
    }

    /// Break the bonds that are broken in `bits` ([`GridBonds::unbroken_bits`]).
    ///
    /// # Errors
    /// Bits of another body, or of bonds that are broken here but not there.
    pub fn restore_bits(&mut self, bits: &[u64]) -> Result<()> {
        let now = self.unbroken_bits();
        if now.len() != bits.len() || now.iter().zip(bits).any(|(now, then)| then & !now != 0) {
            return Err(Error::input("the saved bonds are of another body", "resume with the case as it was"));
        }
        let words = self.half.len().div_ceil(64).max(1);
        let mut half_of = vec![0; self.half.len()];
        self.half.full.iter().enumerate().for_each(|(p, b)| half_of[b - self.half.bonds / 2] = p);
        let mut broken = Vec::new();
        for (place, (now, then)) in now.iter().zip(bits).enumerate() {
            let gone = now & !then;
            let bits = (0..64).filter(|b| gone >> b & 1 == 1);
            broken.extend(bits.map(|b| (place / words, half_of[place % words * 64 + b])));
        }
        self.fail_bonds(broken.into_iter());
        Ok(())
    }
}
