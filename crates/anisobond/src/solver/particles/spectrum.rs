//! The largest frequency, which the stable step comes from.

use crate::Result;
use crate::operator::lanczos::{STEPS, gaussian, lanczos_bound};
use crate::operator::particles::Particles;
use crate::operator::{BondList, Network, StiffBond};

/// An upper bound of the largest eigenvalue of M⁻¹K (1/s²), translations with masses and rotations with moments of
/// inertia, about the state at the start; too low with probability 10⁻⁹ (Kuczyński and Woźniakowski 1992, theorem 4.2).
///
/// Bonds that may become contacts count with the stiffer of both; breaking bonds only lowers the eigenvalue.
///
/// # Errors
/// What [`BondList::new`] refuses.
pub fn largest_squared_frequency(particles: &Particles) -> Result<f64> {
    let model = particles.model();
    let radii = model.packing.radii();
    let stiffest = |bond: &StiffBond| match &model.contact {
        None => *bond,
        Some(law) => {
            let kn = law.normal_stiffness(radii[bond.a as usize], radii[bond.b as usize]);
            let kt = kn * law.tangential_ratio;
            StiffBond { normal: bond.normal.max(kn), tangential: bond.tangential.max(kt), ..*bond }
        }
    };
    let network = Network {
        nodes: model.packing.centres().to_vec(),
        bonds: model.bonds.iter().map(stiffest).collect(),
        volume: 1.0,
        nodal: None,
    };
    let list = BondList::new(&network)?;
    let n = list.nodes();
    // 1/√m and 1/√I in the list's order.
    let mut scale = vec![[0.0; 2]; n];
    for sphere in 0..n {
        let (_, mass, inertia) = particles.sphere(sphere);
        scale[list.place(sphere)] = [mass.sqrt().recip(), inertia.sqrt().recip()];
    }
    let (mut x, mut y) = (list.zeros::<1>(), list.zeros::<1>());
    let start = (0..6 * n as u64).map(gaussian).collect();
    Ok(lanczos_bound(start, STEPS, |v, w| {
        for (k, (x, v)) in x.iter_mut().zip(v.chunks_exact(6)).enumerate() {
            *x = std::array::from_fn(|i| [v[i] * scale[k][i / 3]]);
        }
        list.apply(&x, &mut y);
        for (k, (y, w)) in y.iter().zip(w.chunks_exact_mut(6)).enumerate() {
            w.iter_mut().enumerate().for_each(|(i, w)| *w = y[i][0] * scale[k][i / 3]);
        }
    }))
}

/// The largest step (s) that local damping λ damps at: [`crate::solver::damped_step`] of the stable one.
///
/// # Errors
/// What [`BondList::new`] refuses.
pub fn damped_step(particles: &Particles, local: f64) -> Result<f64> {
    Ok(crate::solver::damped_step(stable_step(particles)?, local))
}

/// The largest stable step (s) of undamped linear motion, 2/√λ: a lower bound of it.
///
/// # Errors
/// What [`BondList::new`] refuses.
pub fn stable_step(particles: &Particles) -> Result<f64> {
    Ok(crate::solver::stable_step(largest_squared_frequency(particles)?))
}
