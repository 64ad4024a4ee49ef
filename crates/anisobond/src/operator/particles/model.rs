//! What spheres and bonds are, before anything moves.

use std::f64::consts::PI;
use std::sync::Arc;

use super::contact::ContactLaw;
use crate::bond_law::{BondLaw, Brittle};
use crate::lattice::Packing;
use crate::operator::{Kinematics, Network, StiffBond};
use crate::{Error, Result};

/// Spheres, their masses, and what joins them.
#[derive(Clone, Debug)]
pub struct ParticleModel {
    /// The spheres; with a cell they are periodic.
    pub packing: Packing,
    /// Bonds between them, as those of [`Network::new`]; each once.
    pub bonds: Vec<StiffBond>,
    /// Mass of each sphere (kg): [`sphere_masses`] or [`bulk_masses`]. Moments of inertia are those of balls, ⅖ m r².
    pub mass: Vec<f64>,
    /// Small displacements and rotations about the state given here, or finite ones.
    pub kinematics: Kinematics,
    /// Strength of each bond, at which it leaves the linear law; `None`: bonds do not break.
    pub strength: Option<Vec<Strength>>,
    /// What bonds do from there on.
    pub law: Arc<dyn BondLaw>,
    /// How spheres that no bond joins touch; `None`: they pass through each other.
    pub contact: Option<ContactLaw>,
}

impl ParticleModel {
    /// Elastic bonds of a network between the spheres of a packing; strength and contact are the caller's to add.
    pub fn elastic(packing: Packing, network: &Network, mass: Vec<f64>, kinematics: Kinematics) -> Self {
        let bonds = network.bonds.clone();
        ParticleModel { packing, bonds, mass, kinematics, strength: None, law: Arc::new(Brittle), contact: None }
    }

    /// What is wrong with it.
    ///
    /// # Errors
    /// Lists that do not fit the spheres or bonds; masses or strengths that are not positive; contact numbers that are
    /// negative. (Bonds are checked when their rows are built.)
    pub(super) fn check(&self) -> Result<()> {
        let spheres = self.packing.len();
        if self.mass.len() != spheres {
            return Err(Error::input(
                format!("{} masses for {spheres} spheres", self.mass.len()),
                "give one mass per sphere",
            ));
        }
        if let Some(i) = self.mass.iter().position(|m| !(m.is_finite() && *m > 0.0)) {
            return Err(Error::input(
                format!("sphere {} has mass {} kg", i + 1, self.mass[i]),
                "give a positive density",
            ));
        }
        if let Some(strength) = &self.strength {
            if strength.len() != self.bonds.len() {
                return Err(Error::input(
                    format!("{} strengths for {} bonds", strength.len(), self.bonds.len()),
                    "give one strength per bond",
                ));
            }
            strength.iter().try_for_each(Strength::check)?;
        }
        self.contact.as_ref().map_or(Ok(()), ContactLaw::check)
    }
}

/// When a bond leaves the linear law; a brittle one breaks: normal force N (N, tension positive) above `tension`, or shear force
/// above `cohesion` − N tan `friction_angle` (Mohr-Coulomb; compression holds it).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strength {
    /// Largest tensile force (N); may be infinite.
    pub tension: f64,
    /// Shear force that breaks it without normal force (N); may be infinite.
    pub cohesion: f64,
    /// Friction angle φ (radians), 0 ≤ φ < π/2.
    pub friction_angle: f64,
}

impl Strength {
    /// A bond that never breaks.
    pub const UNBREAKABLE: Strength = Strength { tension: f64::INFINITY, cohesion: f64::INFINITY, friction_angle: 0.0 };

    /// From stresses (Pa) over the cross-section π r², r (m) the smaller radius, as the bonds' stiffnesses are
    /// (THEORY section 2).
    pub fn of_stresses(tensile: f64, cohesion: f64, friction_angle: f64, smaller_radius: f64) -> Self {
        let area = PI * smaller_radius * smaller_radius;
        Strength { tension: tensile * area, cohesion: cohesion * area, friction_angle }
    }

    /// Whether a bond with a normal force (tension positive) and the magnitude of a shear force (N) holds.
    pub fn holds(&self, normal: f64, shear: f64) -> bool {
        normal <= self.tension && self.holds_in_shear(normal, shear)
    }

    /// The same, tensile strength left aside.
    pub fn holds_in_shear(&self, normal: f64, shear: f64) -> bool {
        shear <= self.cohesion - normal * self.friction_angle.tan()
    }

    /// The share (–) of its strength that a bond uses: 1 where it just holds, and in proportion to tension and shear together.
    /// Compression holds with all of its friction, whatever is left of the bond.
    pub fn share(&self, normal: f64, shear: f64) -> f64 {
        let friction = normal * self.friction_angle.tan();
        if normal > 0.0 {
            (normal / self.tension).max((shear + friction) / self.cohesion)
        } else {
            shear / (self.cohesion - friction)
        }
    }

    fn check(&self) -> Result<()> {
        let angle = (0.0..0.5 * PI).contains(&self.friction_angle);
        if self.tension > 0.0 && self.cohesion > 0.0 && angle {
            return Ok(());
        }
        Err(Error::input(
            format!(
                "a strength of {} N in tension, {} N in shear, friction angle {} rad",
                self.tension, self.cohesion, self.friction_angle
            ),
            "give positive strengths and a friction angle of at least 0 and below a right angle",
        ))
    }
}

/// Masses (kg) of balls of a density (kg/m³): 4/3 π r³ ρ.
pub fn sphere_masses(packing: &Packing, density: f64) -> Vec<f64> {
    packing.radii().iter().map(|r| 4.0 / 3.0 * PI * r.powi(3) * density).collect()
}

/// Masses (kg) in proportion to r³ whose sum is that of a volume (m³) filled with a density (kg/m³): the mass of the
/// rock that the packing stands for, pores included. Waves then travel as in that rock.
pub fn bulk_masses(packing: &Packing, volume: f64, density: f64) -> Vec<f64> {
    let cubes: f64 = packing.radii().iter().map(|r| r.powi(3)).sum();
    packing.radii().iter().map(|r| volume * density * r.powi(3) / cubes).collect()
}
