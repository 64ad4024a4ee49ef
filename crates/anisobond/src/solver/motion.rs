//! Motion in time: velocity Verlet in the form of a leapfrog.
//!
//! Displacements live at t_n, velocities at t_n + Δt/2:
//! v_{n+½} = v_{n−½} + Δt a_n, u_{n+1} = u_n + Δt v_{n+½}. Damping α acts on the mean of both velocities,
//! m (v₊ − v₋)/Δt = f − α m (v₊ + v₋)/2, and the first kick, from v₀, is of half a step. Neither forces nor
//! accelerations are stored.
//!
//! Local damping λ (Cundall 1987) takes λ|f| against the mean v̄ of both velocities, component by component, f all the force but
//! viscous damping. Like dry friction it is found together with v̄: where v₋ + h f/2m is below h λ|f|/2m in magnitude, v̄ = 0 and the
//! drag is what holds it there. So no kick gains energy from damping, −h v̄ (α m v̄ + λ|f| sgn v̄) ≤ 0, and ½ m v₊² + ½ uₙ·K uₙ₊₁ of
//! linear bonds, positive below the stable step, never grows: the motion is stable for every λ < 1. Held components are not damped
//! locally.

/// How velocities change at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kick {
    /// Time between the velocities before and after (s): Δt, or Δt/2 at the start.
    pub step: f64,
    /// Damping α (1/s).
    pub damping: f64,
    /// Local damping λ (–), 0 ≤ λ < 1.
    pub local: f64,
}

impl Kick {
    /// v₊ = ((1 − αh/2) v₋ + h f/m)/(1 + αh/2), for one component of some nodes with forces f (N) and 1/m (1/kg).
    #[inline]
    pub fn apply(&self, velocity: &mut [f64], force: &[f64], per_mass: impl Iterator<Item = f64>) {
        let (keep, push) = self.factors();
        for ((v, f), per_mass) in velocity.iter_mut().zip(force).zip(per_mass) {
            *v = keep * *v + push * per_mass * f;
        }
    }

    /// What a force (N) adds to a velocity (m/s).
    pub fn push(&self, force: f64, per_mass: f64) -> f64 {
        self.factors().1 * per_mass * force
    }

    /// Local drag λ|f| sgn v̄ (N) on a component under a force f (N), or what makes v̄ = 0 where that is less.
    ///
    /// v̄ (1 + α h/2) = v₋ + h (f − drag)/2m; at the `first` kick v̄ is the velocity at the start.
    #[inline(always)]
    pub(crate) fn drag(&self, first: bool, before: f64, force: f64, mass: f64) -> f64 {
        let most = self.local * force.abs();
        if first {
            return most * sign(before);
        }
        (force + 2.0 * mass / self.step * before).max(-most).min(most)
    }

    /// (keep, push): v₊ = keep v₋ + push f/m.
    pub(crate) fn factors(&self) -> (f64, f64) {
        let half = 0.5 * self.damping * self.step;
        ((1.0 - half) / (1.0 + half), self.step / (1.0 + half))
    }
}

/// −1, 0 or 1.
fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        0.0
    }
}

/// The largest step (s) that local damping λ damps at: the stable one of undamped motion over √(1 + λ).
///
/// Between this and the stable step the motion stays bounded, but a mode of frequency ω ≥ 2/h√(1 + λ) may swing for ever: from
/// −u to u and back in one step each, v̄ = 0 at both ends, as h ω² u is within (1 ± λ) of the change of velocity that turns it.
pub fn damped_step(stable: f64, local: f64) -> f64 {
    stable / (1.0 + local).sqrt()
}

/// The largest stable step (s) of undamped motion whose largest squared frequency λ of M⁻¹K (1/s²) is known: 2/√λ.
pub fn stable_step(largest_squared_frequency: f64) -> f64 {
    2.0 / largest_squared_frequency.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An oscillator k = ω² m, damped: error of displacement after 0.7 periods (at the whole one it would be stationary, and
    /// an error of the phase not seen), at n steps.
    fn error(steps: usize, damping: f64) -> f64 {
        let omega = 2.0;
        let damped = (omega * omega - 0.25 * damping * damping).sqrt();
        let duration = 1.4 * std::f64::consts::PI / omega;
        let step = duration / steps as f64;
        let (mut u, mut v) = (1.0, [-0.5 * damping]);
        for n in 0..steps {
            let step_of_kick = if n == 0 { 0.5 * step } else { step };
            Kick { step: step_of_kick, damping, local: 0.0 }.apply(
                &mut v,
                &[-omega * omega * u * 3.0],
                std::iter::once(1.0 / 3.0),
            );
            u += step * v[0];
        }
        // u = exp(−αt/2) cos ω't solves the damped oscillator with u(0) = 1, v(0) = −α/2.
        (u - (-0.5 * damping * duration).exp() * (damped * duration).cos()).abs()
    }

    #[test]
    fn second_order_with_and_without_damping() {
        for damping in [0.0, 0.7] {
            let order = (error(50, damping) / error(100, damping)).log2();
            assert!((1.9..2.1).contains(&order), "{damping}: {order}");
        }
    }

    #[test]
    fn stable_up_to_the_stable_step_and_not_beyond() {
        let run = |factor: f64| {
            let lambda = 9.0;
            let step = factor * stable_step(lambda);
            let (mut u, mut v) = (1.0f64, [0.0]);
            for n in 0..2000 {
                let kick = Kick { step: if n == 0 { 0.5 * step } else { step }, damping: 0.0, local: 0.0 };
                kick.apply(&mut v, &[-lambda * u], std::iter::once(1.0));
                u += step * v[0];
            }
            u.abs()
        };
        assert!(run(0.99) < 100.0 && run(1.01) > 1e6);
    }
}
