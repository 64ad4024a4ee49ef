//! Observation one: when the wave arrives, by direction.

use nalgebra::Vector3;
use serde::Serialize;

use super::body::{CavityBody, Running};
use super::closed::Cavity;
use crate::tensor::Stiffness;
use crate::{Error, Result};

/// Directions of rays that are looked at for the fastest way.
const DIRECTIONS: usize = 720;

/// Part of a station's first peak at which the wave has arrived.
const ARRIVED: f64 = 0.5;

/// A sector's half angle (radians).
const HALF_SECTOR: f64 = 5.0 * std::f64::consts::PI / 180.0;

/// The fastest plane waves across a hole.
#[derive(Clone, Debug)]
pub struct Rays {
    /// Unit directions across the hole, and slowness (s/m) of the fastest wave along each.
    slowness: Vec<(Vector3<f64>, f64)>,
}

impl Rays {
    /// Of a stiffness (Pa) and density (kg/m³), across the hole of a cavity.
    ///
    /// # Errors
    /// As [`Stiffness::waves`].
    pub fn new(stiffness: &Stiffness, density: f64, cavity: &Cavity) -> Result<Self> {
        let [first, second] = cavity.across();
        let slowness = (0..DIRECTIONS).map(|k| {
            let angle = std::f64::consts::TAU * k as f64 / DIRECTIONS as f64;
            let n = first * angle.cos() + second * angle.sin();
            Ok((n, 1.0 / stiffness.waves(&n, density)?[2].speed))
        });
        Ok(Rays { slowness: slowness.collect::<Result<_>>()? })
    }

    /// Speed (m/s) at which the fastest wave of a source at the axis arrives along a direction: a plane wave of slowness s
    /// along n has passed x at s n·x, and the last of all to do so is the front, 1/v = max s n·d.
    pub fn speed(&self, direction: &Vector3<f64>) -> f64 {
        let latest = self.slowness.iter().map(|(n, s)| s * n.dot(direction)).fold(0.0, f64::max);
        1.0 / latest
    }
}

/// When the wave arrives along a direction.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Arrival {
    /// Unit direction away from the hole.
    pub direction: [f64; 3],
    /// Mean distances (m) from the axis of the two stations.
    pub stations: [f64; 2],
    /// Arrival at either (s).
    pub times: [f64; 2],
    /// Speed between them (m/s).
    pub speed: f64,
    /// Speed of the fastest wave by Christoffel's tensor (m/s).
    pub christoffel: f64,
}

/// A hole's waves.
#[derive(Clone, Debug, Serialize)]
pub struct CavityWaves {
    /// Nodes or spheres.
    pub nodes: usize,
    /// By direction.
    pub arrivals: Vec<Arrival>,
    /// Speed along the stiffer direction (the first) over that along the softer one (the last).
    pub ratio: f64,
    /// The same by Christoffel's tensor.
    pub christoffel_ratio: f64,
}

/// Nodes that watch one direction at one distance.
struct Station {
    /// Ahead of the hole and behind it.
    nodes: [Vec<u32>; 2],
    /// Mean distance from the axis (m).
    distance: f64,
    /// Time (s) and mean velocity away from the hole (m/s).
    signal: Vec<[f64; 2]>,
}

/// Follow the wave of a pressure pulse on a hole's wall through a body in motion, along directions from the stiffer to the
/// softer one, between two distances (m) from the axis. A station is the ring of nodes that far within 5° of its
/// direction or its opposite; the wave has arrived when the mean radial velocity reaches half of its first peak.
///
/// # Errors
/// A body that does not run, a station without nodes, or one where no wave arrives.
pub fn waves(
    body: CavityBody,
    cavity: &Cavity,
    rays: &Rays,
    directions: &[Vector3<f64>],
    stations: [f64; 2],
) -> Result<CavityWaves> {
    let (nodes, width) = (body.nodes(), body.spacing());
    let station = |d: &Vector3<f64>, r: f64| Station::new(&nodes, cavity, d, r, width);
    let mut watches: Vec<[Station; 2]> =
        directions.iter().map(|d| Ok([station(d, stations[0])?, station(d, stations[1])?])).collect::<Result<_>>()?;
    let mut running = body.start()?;
    loop {
        for (watch, direction) in watches.iter_mut().zip(directions) {
            watch.iter_mut().for_each(|s| s.look(&running, direction));
        }
        if running.finished() {
            break;
        }
        running.advance()?;
    }
    let arrival = |(watch, direction): (&[Station; 2], &Vector3<f64>)| {
        let distances = [watch[0].distance, watch[1].distance];
        let times = [watch[0].arrived()?, watch[1].arrived()?];
        Ok(Arrival {
            direction: (*direction).into(),
            stations: distances,
            times,
            speed: (distances[1] - distances[0]) / (times[1] - times[0]),
            christoffel: rays.speed(direction),
        })
    };
    let arrivals = watches.iter().zip(directions).map(arrival).collect::<Result<Vec<Arrival>>>()?;
    let ratio = |speed: &dyn Fn(&Arrival) -> f64| match (arrivals.first(), arrivals.last()) {
        (Some(first), Some(last)) => speed(first) / speed(last),
        _ => f64::NAN,
    };
    let (measured, christoffel_ratio) = (ratio(&|a| a.speed), ratio(&|a| a.christoffel));
    Ok(CavityWaves { nodes: nodes.len(), ratio: measured, christoffel_ratio, arrivals })
}

impl Station {
    /// The ring of nodes at a distance (m), as wide as nodes are apart, in the sectors ahead and behind.
    fn new(
        nodes: &[(u32, Vector3<f64>)],
        cavity: &Cavity,
        direction: &Vector3<f64>,
        distance: f64,
        width: f64,
    ) -> Result<Self> {
        let mut station = Station { nodes: [Vec::new(), Vec::new()], distance: 0.0, signal: Vec::new() };
        let mut sum = 0.0;
        for (node, x) in nodes {
            let (r, n) = cavity.polar(x);
            let cosine = n.dot(direction);
            if (r - distance).abs() <= 0.5 * width && cosine.abs() >= HALF_SECTOR.cos() {
                station.nodes[usize::from(cosine < 0.0)].push(*node);
                sum += r;
            }
        }
        let count = station.nodes.iter().map(Vec::len).sum::<usize>();
        if count == 0 {
            return Err(Error::input(
                format!("no node is {distance} m from the hole's axis along {:?}", direction.as_slice()),
                "give stations inside the body",
            ));
        }
        station.distance = sum / count as f64;
        Ok(station)
    }

    fn look(&mut self, running: &Running, direction: &Vector3<f64>) {
        let [ahead, behind] = &self.nodes;
        let sum = |nodes: &[u32]| running.velocity(nodes) * nodes.len() as f64;
        let outwards = (sum(ahead) - sum(behind)).dot(direction) / (ahead.len() + behind.len()) as f64;
        self.signal.push([running.time(), outwards]);
    }

    /// When the velocity first reached half of its largest value.
    fn arrived(&self) -> Result<f64> {
        let peak = self.signal.iter().map(|s| s[1]).fold(0.0, f64::max);
        let level = ARRIVED * peak;
        let crossed = self.signal.windows(2).find(|w| w[0][1] < level && level <= w[1][1]);
        crossed.map(|w| w[0][0] + (w[1][0] - w[0][0]) * (level - w[0][1]) / (w[1][1] - w[0][1])).ok_or_else(|| {
            Error::input(
                format!("no wave arrives {} m from the hole's axis", self.distance),
                "let the motion last longer, or press harder",
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::closed::tests::rock;
    use super::*;

    /// Along axes of symmetry the front's speed is the phase speed; nowhere is it above it.
    #[test]
    fn fronts_are_as_fast_as_christoffel_says() {
        let c = rock(0.0);
        let cavity = Cavity::new(&c, &Vector3::y(), 1.0, 1e6).unwrap();
        let rays = Rays::new(&c, 1e6, &cavity).unwrap();
        // THEORY section 9: √(C/ρ) with ρ = 1 and C in MPa, of the fastest waves.
        assert!((rays.speed(&Vector3::x()) - 11.402).abs() < 1e-3 && (rays.speed(&Vector3::z()) - 7.416).abs() < 1e-3);
        for k in 0..36 {
            let angle = f64::from(k) * std::f64::consts::PI / 36.0;
            let d = Vector3::new(angle.cos(), 0.0, angle.sin());
            let phase = c.waves(&d, 1e6).unwrap()[2].speed;
            // The ray along d is slowed by every plane wave, that along d among them.
            assert!(rays.speed(&d) <= phase * (1.0 + 1e-12) && rays.speed(&d) >= 7.416 - 1e-3, "{angle}");
        }
    }
}
