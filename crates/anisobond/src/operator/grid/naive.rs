//! The same bonds one by one, slow and obvious: what the kernels must agree with.

use std::collections::HashSet;

use nalgebra::{Matrix3, Vector3};

use super::interface::ROUNDING;
use super::stencil::Stencil;
use crate::calibration::Layers;
use crate::lattice::{Body, Neighbourhood};
use crate::operator::hybrid_naive::{double_dot, nodal_response};
use crate::operator::{Kinematics, VectorField};
use crate::tensor::Stiffness;

/// A body's bonds, with the list of those that are broken.
#[derive(Clone, Debug)]
pub struct NaiveBonds<'a> {
    /// The body.
    pub body: &'a Body,
    /// Bonds of a node.
    pub neighbourhood: &'a Neighbourhood,
    /// Stencil of each node, from 1 on; 0 is none.
    pub stencil: &'a [u16],
    /// The stencils.
    pub stencils: &'a [Stencil],
    /// Broken bonds, as a node and a bond of the second half of the neighbourhood's order.
    pub broken: HashSet<(usize, usize)>,
}

/// Stiffness of each region's bulk, and by node the direction of what is of another region.
struct Regions {
    bulk: Vec<Stiffness>,
    contrast: Vec<Vector3<f64>>,
}

/// What displacements of all nodes cause.
#[derive(Clone, Debug)]
pub struct NaiveResponse {
    /// Force on every node (N).
    pub forces: VectorField,
    /// Energy of every node (J), half of each bond's and its nodal term's.
    pub energy: Vec<f64>,
    /// Virial stress of every node (Pa), with that of its nodal term; Kirchhoff's at finite stretch.
    pub stress: Vec<Matrix3<f64>>,
    /// Bonds above their critical stretch, each once.
    pub over: Vec<(usize, usize)>,
    /// Energy of those (J).
    pub energy_over: f64,
}

/// A node's nodal term: its Z, and the bonds that its gradient H = Σ η⊗g is the sum over.
struct NodalEnds<'a> {
    node: usize,
    z: &'a Stiffness,
    /// Other end, and g = ω K⁻¹ξ (1/m).
    ends: Vec<(usize, Vector3<f64>)>,
}

impl NodalEnds<'_> {
    fn gradient(&self, u: &VectorField) -> Matrix3<f64> {
        self.ends.iter().fold(Matrix3::zeros(), |h, (other, g)| h + (u.at(*other) - u.at(self.node)) * g.transpose())
    }

    /// f += −∂(ΔV nominal : H)/∂u.
    fn add_forces(&self, nominal: &Matrix3<f64>, volume: f64, f: &mut VectorField) {
        for (other, g) in &self.ends {
            let pull = volume * nominal * g;
            f.set(self.node, &(f.at(self.node) + pull));
            f.set(*other, &(f.at(*other) - pull));
        }
    }
}

/// Shape tensors flatter than this have no inverse, as in `hybrid`.
const FLAT: f64 = 1e-6;

impl<'a> NaiveBonds<'a> {
    /// The bonds of a body, none of them broken.
    pub fn whole(
        body: &'a Body,
        neighbourhood: &'a Neighbourhood,
        stencil: &'a [u16],
        stencils: &'a [Stencil],
    ) -> Self {
        NaiveBonds { body, neighbourhood, stencil, stencils, broken: HashSet::new() }
    }
}

impl NaiveBonds<'_> {
    /// Unbroken bonds with both ends: node, bond of the second half, other node.
    pub fn bonds(&self) -> Vec<(usize, usize, usize)> {
        let list = self.neighbourhood.bonds();
        let mut found = Vec::new();
        for node in (0..self.stencil.len()).filter(|&i| self.stencil[i] > 0) {
            for (b, bond) in list.iter().enumerate().skip(list.len() / 2) {
                if let Some(other) = self.body.grid.neighbour(node, bond.offset).filter(|&j| self.stencil[j] > 0)
                    && !self.broken.contains(&(node, b))
                {
                    found.push((node, b, other));
                }
            }
        }
        found
    }

    /// k (N/m) and s_c (–) of a bond: the mean of what both ends say, and where its way leads through several regions what
    /// these are as layers ([`Layers`]) and the weakest of them.
    fn constants(&self, node: usize, b: usize, other: usize, known: &Regions) -> [f64; 2] {
        let bonds = self.neighbourhood.bonds();
        let opposite = bonds.len() - 1 - b;
        let of = |stencil: u16, b: usize| {
            let stencil = &self.stencils[usize::from(stencil) - 1];
            [stencil.stiffness[b], stencil.critical[b]]
        };
        let mean = |[k, s]: [f64; 2], [l, t]: [f64; 2]| [0.5 * (k + l), 0.5 * (s + t)];
        let (from, to) = (self.stencil[node], self.stencil[other]);
        // In so many steps every face of a cell is between two of them.
        let steps = bonds[b].offset.iter().map(|n| 2 * n.abs().max(1)).product::<i32>();
        let mut shares: Vec<(u16, f64)> = Vec::new();
        for step in 0..steps {
            let at = (f64::from(step) + 0.5) / f64::from(steps);
            let cell = self.body.grid.neighbour(node, bonds[b].offset.map(|n| (at * f64::from(n)).round() as i32));
            let region = cell.map_or(0, |cell| self.body.region[cell]);
            match shares.iter_mut().find(|(r, _)| *r == region) {
                _ if region == 0 => {}
                Some((_, share)) => *share += 1.0,
                None => shares.push((region, 1.0)),
            }
        }
        if shares.len() < 2 {
            return mean(of(from, b), of(to, opposite));
        }
        let all: f64 = shares.iter().map(|(_, share)| share).sum();
        let values = |region: u16| match (region == self.body.region[node], region == self.body.region[other]) {
            (true, false) => of(from, b),
            (false, true) => of(to, opposite),
            (true, true) => mean(of(from, b), of(to, opposite)),
            (false, false) => mean(of(region, b), of(region, opposite)),
        };
        let parts: Vec<(f64, [f64; 2])> = shares.iter().map(|(region, share)| (share / all, values(*region))).collect();
        let materials: Vec<Stiffness> = shares.iter().map(|(r, _)| known.bulk[usize::from(*r) - 1]).collect();
        let [here, there] = [known.contrast[node], known.contrast[other]];
        let normal = if here.dot(&there) < -ROUNDING { here - there } else { here + there };
        let direction = bonds[b].xi.normalize();
        let layers = Layers::new(&materials, &normal.try_normalize(ROUNDING).unwrap_or(direction));
        let by_part: Vec<(f64, f64)> = parts.iter().map(|(share, [k, _])| (*share, *k)).collect();
        let k = match layers {
            Some(layers) => layers.stiffness(&direction, &by_part),
            None => by_part.iter().map(|(share, k)| share * k).sum(),
        };
        let energies = parts.iter().map(|(_, [k, s])| k * s * s).filter(|e| e.is_finite() && *e > 0.0);
        let spared = [(node, b), (other, opposite)]
            .into_iter()
            .any(|(end, b)| of(self.body.region[end], b)[1].is_finite() && of(self.stencil[end], b)[1].is_infinite());
        match energies.reduce(f64::min) {
            Some(energy) if k > 0.0 && !spared => [k, (energy / k).sqrt()],
            _ => [k, f64::INFINITY],
        }
    }

    /// What bonds through several regions ask for again and again.
    fn regions(&self) -> Regions {
        let xi: Vec<_> = self.neighbourhood.bonds().iter().map(|b| b.xi).collect();
        let volume = self.body.grid.spacing.powi(3);
        let nodes = 0..self.stencil.len();
        Regions {
            bulk: self.stencils.iter().map(|s| s.bulk(&xi, volume)).collect(),
            contrast: nodes.map(|n| if self.stencil[n] > 0 { self.contrast(n) } else { Vector3::zeros() }).collect(),
        }
    }

    /// Gradient by least squares of what is of another region around a node.
    fn contrast(&self, node: usize) -> Vector3<f64> {
        let around = self.neighbourhood.bonds().iter().map(|b| b.offset).chain([[0; 3]]);
        let found: Vec<(Vector3<f64>, f64)> = around
            .filter_map(|o| self.body.grid.neighbour(node, o).map(|n| (o, self.body.region[n])))
            .filter(|(_, region)| *region > 0)
            .map(|(o, r)| (Vector3::from(o.map(f64::from)), if r == self.body.region[node] { 0.0 } else { 1.0 }))
            .collect();
        let count = found.len() as f64;
        let middle = found.iter().map(|(o, _)| o).sum::<Vector3<f64>>() / count;
        let mean = found.iter().map(|(_, v)| v).sum::<f64>() / count;
        let spread: Matrix3<f64> = found.iter().map(|(o, _)| (o - middle) * (o - middle).transpose()).sum();
        let slope: Vector3<f64> = found.iter().map(|(o, v)| (o - middle) * (v - mean)).sum();
        spread.try_inverse().map_or(slope, |inverse| inverse * slope)
    }

    /// The nodes with a nodal term; every bond that is broken is taken as one cut beforehand.
    fn nodal_terms(&self) -> Vec<NodalEnds<'_>> {
        let list = self.neighbourhood.bonds();
        let outer = |b: usize| list[b].influence * list[b].xi * list[b].xi.transpose();
        let bulk = (0..list.len()).fold(Matrix3::zeros(), |k, b| k + outer(b)).try_inverse().unwrap_or_default();
        let mut ends: Vec<Vec<(usize, usize, f64)>> = vec![vec![]; self.stencil.len()];
        for (i, b, j) in self.bonds() {
            ends[i].push((j, b, 1.0));
            ends[j].push((i, b, -1.0));
        }
        let term = |(node, ends): (usize, &Vec<(usize, usize, f64)>)| {
            let z = self.stencils.get(usize::from(self.stencil[node]).checked_sub(1)?)?.nodal.as_ref()?;
            let shape = ends.iter().fold(Matrix3::zeros(), |k, (_, b, _)| k + outer(*b));
            let inverse = shape.try_inverse().filter(|i| FLAT * i.norm() < bulk.norm())?;
            let g = |b: usize| list[b].influence * (inverse * list[b].xi);
            Some(NodalEnds { node, z, ends: ends.iter().map(|&(other, b, sign)| (other, sign * g(b))).collect() })
        };
        ends.iter().enumerate().filter_map(term).collect()
    }

    /// What displacements w (m) change of the forces (N) at displacements u (m): their derivative along w.
    pub fn tangent(&self, u: &VectorField, kinematics: Kinematics, w: &VectorField) -> VectorField {
        let mut f = VectorField::zeros(u.len());
        let known = self.regions();
        for (i, b, j) in self.bonds() {
            let xi = self.neighbourhood.bonds()[b].xi;
            let (eta, way) = (u.at(j) - u.at(i), w.at(j) - w.at(i));
            let [k, _] = self.constants(i, b, j, &known);
            // k (n⊗n + (1 − |ξ|/ℓ)(1 − n⊗n)), ℓ = |ξ + η|.
            let (n, across) = match kinematics {
                Kinematics::Linear => (xi.normalize(), 0.0),
                Kinematics::Finite => ((xi + eta).normalize(), 1.0 - xi.norm() / (xi + eta).norm()),
            };
            let along = n.dot(&way) * n;
            let change = k * (along + across * (way - along));
            f.set(i, &(f.at(i) + change));
            f.set(j, &(f.at(j) - change));
        }
        let volume = self.body.grid.spacing.powi(3);
        for term in self.nodal_terms() {
            let (h, way) = (term.gradient(u), term.gradient(w));
            let change = match kinematics {
                Kinematics::Linear => nodal_response(term.z, kinematics, &way).2,
                Kinematics::Finite => {
                    // δP = δH (Z:E) + F̄ Z:sym(F̄ᵀδH).
                    let deformation = Matrix3::identity() + h;
                    let twice = deformation.transpose() * way;
                    let strain = 0.5 * (twice + twice.transpose());
                    way * nodal_response(term.z, kinematics, &h).1 + deformation * double_dot(term.z, &strain)
                }
            };
            term.add_forces(&change, volume, &mut f);
        }
        f
    }

    /// Forces, energies and stresses of displacements (m). With `breaking`, bonds above their critical stretch exert no
    /// force and hold no energy.
    pub fn response(&self, u: &VectorField, kinematics: Kinematics, breaking: bool) -> NaiveResponse {
        let n = u.len();
        let mut out = NaiveResponse {
            forces: VectorField::zeros(n),
            energy: vec![0.0; n],
            stress: vec![Matrix3::zeros(); n],
            over: vec![],
            energy_over: 0.0,
        };
        let (volume, known) = (self.body.grid.spacing.powi(3), self.regions());
        for (i, b, j) in self.bonds() {
            let xi = self.neighbourhood.bonds()[b].xi;
            let eta = u.at(j) - u.at(i);
            let [k, critical] = self.constants(i, b, j, &known);
            let (elongation, to) = match kinematics {
                Kinematics::Linear => (xi.normalize().dot(&eta), xi),
                Kinematics::Finite => {
                    let elongation = eta.dot(&(2.0 * xi + eta)) / ((xi + eta).norm() + xi.norm());
                    (elongation, xi + eta)
                }
            };
            let energy = 0.5 * k * elongation * elongation;
            if breaking && elongation / xi.norm() > critical {
                out.over.push((i, b));
                out.energy_over += energy;
                continue;
            }
            let force = k * elongation * to.normalize();
            let add = |field: &mut VectorField, node: usize, f: Vector3<f64>| field.set(node, &(field.at(node) + f));
            add(&mut out.forces, i, force);
            add(&mut out.forces, j, -force);
            for node in [i, j] {
                out.energy[node] += 0.5 * energy;
                out.stress[node] += 0.5 * force * to.transpose() / volume;
            }
        }
        for term in self.nodal_terms() {
            let h = term.gradient(u);
            let (strain, stress, nominal) = nodal_response(term.z, kinematics, &h);
            out.energy[term.node] += 0.5 * volume * stress.dot(&strain);
            out.stress[term.node] += match kinematics {
                Kinematics::Linear => nominal,
                Kinematics::Finite => nominal * (Matrix3::identity() + h).transpose(),
            };
            term.add_forces(&nominal, volume, &mut out.forces);
        }
        out
    }

    /// Share of a node's original bonds that are broken.
    pub fn damage(&self) -> Vec<f64> {
        let mut all = vec![0.0; self.stencil.len()];
        let mut left = all.clone();
        let whole = NaiveBonds { broken: HashSet::new(), ..self.clone() };
        for (count, bonds) in [(&mut all, whole.bonds()), (&mut left, self.bonds())] {
            for (i, _, j) in bonds {
                count[i] += 1.0;
                count[j] += 1.0;
            }
        }
        all.iter().zip(&left).map(|(all, left)| if *all > 0.0 { 1.0 - left / all } else { 0.0 }).collect()
    }
}
