//! What may run: a problem whose every node number, region, list and number was looked at, once, wherever it comes from.

use std::ops::Deref;

use nalgebra::Vector3;

use super::packing_simulation::{CellDrive, PackingProblem, ServoPlan};
use super::problem::{Condition, Crack, FractureEnergy, History, OutputPlan, Probe, Problem, RegionMaterial, Schedule};
use crate::calibration::Model;
use crate::lattice::Grid;
use crate::{Error, Result};

/// Relative difference of two spacings that are the same.
const SAME_SPACING: f64 = 1e-9;

/// Deviation of the length of a unit normal from 1.
const UNIT: f64 = 1e-6;

/// A problem that was checked: the only thing that a simulation runs. It cannot be changed any more.
#[derive(Clone, Debug, PartialEq)]
pub struct Checked<P>(P);

impl<P> Deref for Checked<P> {
    type Target = P;

    fn deref(&self) -> &P {
        &self.0
    }
}

impl Problem {
    /// The problem, checked: what [`super::Simulation`] runs, whether it comes from a case file, Rust or Python.
    ///
    /// # Errors
    /// A grid that holds no nodes, or whose list of regions has another length; a node of a region that is not listed; a
    /// neighbourhood of another spacing; micropolar bonds; a stiffness that is not positive definite; a density, fracture energy,
    /// load, history, velocity, crack, time or tolerance that is no number, or out of its range; lists of different lengths;
    /// node numbers beyond the body; probes of no nodes, or two of one name.
    pub fn checked(self) -> Result<Checked<Self>> {
        self.check()?;
        Ok(Checked(self))
    }

    /// What [`Problem::checked`] refuses.
    pub(super) fn check(&self) -> Result<()> {
        self.check_body()?;
        let names: Vec<&str> = self.regions.iter().map(|r| r.name.as_str()).collect();
        for (n, region) in self.regions.iter().enumerate() {
            region.check(&self.schedule).map_err(|e| e.at(placed("region", n, names[n])))?;
        }
        let ratio = self.law.energy_ratio();
        require(ratio.is_finite() && ratio >= 1.0, || {
            (
                format!("the law of bonds takes {ratio} times the energy up to its onset"),
                "let energy_ratio() be the energy of a bond stretched until it breaks over ½ k e₀²: finite, at least 1",
            )
        })?;
        require(!(self.law.yields() && self.model == Model::Hybrid), || {
            (
                "bonds of a hybrid model yield, but its nodal term does not".into(),
                "use central bonds, or a law that does not yield",
            )
        })?;
        let sites = Sites { called: "node", number: self.body.region.len(), has: &|node| self.body.has(node) };
        sites.check_acting(&self.conditions, &self.initial_velocity, &self.schedule)?;
        sites.check_numbers(&self.unbreakable).map_err(|e| e.at("unbreakable"))?;
        sites.check_probes(&self.probes)?;
        for (n, crack) in self.cracks.iter().enumerate() {
            crack.check().map_err(|e| e.at(format!("crack {}", n + 1)))?;
        }
        self.schedule.check()?;
        self.output.check()
    }

    fn check_body(&self) -> Result<()> {
        let Grid { nodes, spacing, origin, periodic } = self.body.grid;
        Grid::new(nodes, spacing, origin, periodic)?;
        require(is_finite(&origin), || ("the origin of the grid is no number".into(), "give finite coordinates"))?;
        let (listed, number) = (self.body.region.len(), self.body.grid.len());
        require(listed == number, || {
            (format!("the body lists the regions of {listed} nodes, its grid has {number}"), "list one for each node")
        })?;
        let (last, regions) = (self.body.region.iter().copied().max().unwrap_or(0), self.regions.len());
        require(last > 0, || ("the body has no nodes".into(), "use a smaller spacing or a larger body"))?;
        require(usize::from(last) <= regions, || {
            (
                format!("a node is of region {last}, but there are {regions}"),
                "list the material of every region: 1 is the first, 0 is no material",
            )
        })?;
        let own = self.neighbourhood.spacing();
        require((own - spacing).abs() <= SAME_SPACING * spacing, || {
            (
                format!("the neighbourhood has a spacing of {own} m, the grid one of {spacing} m"),
                "make the neighbourhood for the grid's spacing",
            )
        })?;
        require(self.model != Model::Micropolar, || {
            (
                "micropolar bonds do not run on grids: their nodes would have to rotate".into(),
                "use the model central or hybrid",
            )
        })
    }
}

impl PackingProblem {
    /// The problem, checked: what [`super::PackingSimulation`] runs. Spheres, bonds, masses, strength and contact are looked at
    /// where they are brought together (`ParticleModel`).
    ///
    /// # Errors
    /// Volumes or regions that are not one for each sphere; a sphere of a region that is not listed; loads, histories, velocities,
    /// times, damping or a servo's numbers that are none, or out of range; lists of different lengths; numbers of spheres that do
    /// not exist; probes of no spheres, or two of one name.
    pub fn checked(self) -> Result<Checked<Self>> {
        self.check()?;
        Ok(Checked(self))
    }

    pub(super) fn check(&self) -> Result<()> {
        let number = self.model.packing.len();
        for (what, listed) in [("volumes", self.volumes.len()), ("regions", self.region.len())] {
            require(listed == number, || {
                (format!("{listed} {what} for {number} spheres"), "give one for each sphere")
            })?;
        }
        let volume = self.volumes.iter().position(|v| !(v.is_finite() && *v > 0.0));
        require(volume.is_none(), || {
            let sphere = volume.unwrap_or(0);
            (format!("sphere {} stands for {} m³", sphere + 1, self.volumes[sphere]), "give positive volumes")
        })?;
        let last = self.region.iter().copied().max().map_or(0, usize::from);
        require(last < self.evidence.len(), || {
            (format!("a sphere is of region {last}, but there are {}", self.evidence.len()), "numbers start at 0")
        })?;
        require(is_finite(&self.origin), || ("the packing's origin is no number".into(), "give finite coordinates"))?;
        let sites = Sites { called: "sphere", number, has: &|_| true };
        sites.check_acting(&self.conditions, &self.initial_velocity, &self.schedule)?;
        sites.check_probes(&self.probes)?;
        self.servo.as_ref().map_or(Ok(()), ServoPlan::check).map_err(|e| e.at("servo"))?;
        self.schedule.check()?;
        self.output.check()
    }
}

/// What conditions and probes count: nodes of a grid, or spheres.
struct Sites<'a> {
    called: &'a str,
    number: usize,
    /// Whether the body has it.
    has: &'a dyn Fn(usize) -> bool,
}

impl Sites<'_> {
    /// Conditions and initial velocities.
    fn check_acting(
        &self,
        conditions: &[Condition],
        velocities: &[(Vec<u32>, Vector3<f64>)],
        schedule: &Schedule,
    ) -> Result<()> {
        for (n, condition) in conditions.iter().enumerate() {
            self.check_condition(condition, schedule).map_err(|e| e.at(format!("condition {}", n + 1)))?;
        }
        for (n, (numbers, velocity)) in velocities.iter().enumerate() {
            let place = |e: Error| e.at(format!("initial velocity {}", n + 1));
            self.check_numbers(numbers).map_err(place)?;
            require(is_finite(velocity), || ("the velocity is no number".into(), "give finite components"))
                .map_err(place)?;
        }
        Ok(())
    }

    fn check_condition(&self, condition: &Condition, schedule: &Schedule) -> Result<()> {
        let no_number =
            || ("a prescribed component is no number".into(), "give finite values, or none where it is free");
        match condition {
            Condition::Displacement { nodes, value, history } | Condition::Velocity { nodes, value, history } => {
                self.check_numbers(nodes)?;
                require(value.iter().flatten().all(|v| v.is_finite()), no_number)?;
                history.check()?;
            }
            Condition::Force { nodes, force, history } => {
                self.check_numbers(nodes)?;
                let (forces, number) = (force.len(), nodes.len());
                require(forces == number, || {
                    (format!("{forces} forces for {number} {}s", self.called), "give one force for each")
                })?;
                require(force.iter().all(is_finite), || ("a force is no number".into(), "give finite components"))?;
                history.check()?;
            }
        }
        let velocity = matches!(condition, Condition::Velocity { .. });
        require(!(velocity && matches!(schedule, Schedule::Equilibrium { .. })), || {
            (
                "a velocity is prescribed, but the body is to be in equilibrium".into(),
                "prescribe a displacement, or give a duration instead of load steps",
            )
        })
    }

    /// Whether all numbers are of the body.
    fn check_numbers(&self, numbers: &[u32]) -> Result<()> {
        let (called, number) = (self.called, self.number);
        let wrong = numbers.iter().find(|&&n| n as usize >= number || !(self.has)(n as usize));
        require(wrong.is_none(), || {
            let n = wrong.copied().unwrap_or(0);
            let problem = match n as usize {
                n if n >= number => format!("there is no {called} {n}: the last of {number} is {}", number - 1),
                n => format!("{called} {n} is outside the body"),
            };
            (problem, "give numbers, from 0, of the body's own")
        })
    }

    fn check_probes(&self, probes: &[Probe]) -> Result<()> {
        for (n, probe) in probes.iter().enumerate() {
            let place = |e: Error| e.at(placed("probe", n, &probe.name));
            self.check_numbers(&probe.nodes).map_err(place)?;
            require(!probe.nodes.is_empty(), || (format!("the probe has no {}s", self.called), "give it at least one"))
                .map_err(place)?;
            require(!probes[..n].iter().any(|other| other.name == probe.name), || {
                ("another probe has the same name".into(), "give each a name of its own")
            })
            .map_err(place)?;
        }
        Ok(())
    }
}

impl RegionMaterial {
    fn check(&self, schedule: &Schedule) -> Result<()> {
        let finite = self.stiffness.mandel().iter().all(|c| c.is_finite());
        require(finite, || ("the stiffness has a component that is no number".into(), "give finite components"))?;
        self.stiffness.require_positive_definite()?;
        let (name, density) = (&self.name, self.density);
        require(density.is_finite() && density >= 0.0, || {
            (format!("a density of {density} kg/m³"), "give a finite density, or 0 where equilibrium needs none")
        })?;
        require(density > 0.0 || matches!(schedule, Schedule::Equilibrium { .. }), || {
            (
                format!("region {name} has no density, but the body is to move"),
                "give it a density, as density = \"2700 kg/m3\"",
            )
        })?;
        self.fracture.as_ref().map_or(Ok(()), FractureEnergy::check)
    }
}

impl FractureEnergy {
    fn check(&self) -> Result<()> {
        let positive = |x: f64, what: &str, unit: &str| {
            let problem =
                || (format!("{what} of {x} {unit}"), "give a positive, finite number; leave fracture out for none");
            require(x.is_finite() && x > 0.0, problem)
        };
        match self {
            FractureEnergy::Isotropic(energy) => positive(*energy, "a fracture energy", "J/m²"),
            FractureEnergy::Stretch(stretch) => positive(*stretch, "a critical stretch", ""),
            FractureEnergy::Directional(values) => {
                require(!values.is_empty(), || ("no fracture energy is given".into(), "give one per normal"))?;
                values.iter().try_for_each(|(normal, energy)| {
                    require_unit(normal)?;
                    positive(*energy, "a fracture energy", "J/m²")
                })
            }
        }
    }
}

impl History {
    fn check(&self) -> Result<()> {
        let ascending = |start: f64, end: f64| start.is_finite() && end.is_finite() && start < end;
        match self {
            History::Constant => Ok(()),
            History::Ramp { start, end } | History::Pulse { start, end } => require(ascending(*start, *end), || {
                (format!("a history from {start} s to {end} s"), "let it begin before it ends")
            }),
            History::Table(points) => {
                let finite = points.iter().all(|(t, value)| t.is_finite() && value.is_finite());
                require(!points.is_empty() && finite, || {
                    ("a history's table is empty, or holds what is no number".into(), "give pairs of finite numbers")
                })?;
                require(points.windows(2).all(|w| w[0].0 < w[1].0), || {
                    ("the moments of a history's table do not ascend".into(), "sort them, each once")
                })
            }
        }
    }
}

impl Crack {
    fn check(&self) -> Result<()> {
        match self {
            Crack::Disc { centre, normal, radius } => {
                require(is_finite(centre), || ("its centre is no number".into(), "give finite coordinates"))?;
                require_unit(normal)?;
                require(*radius > 0.0, || (format!("its radius is {radius} m"), "give a positive radius"))
            }
            Crack::Parallelogram { corner, a, b } => {
                let area = a.cross(b).norm();
                require([corner, a, b].into_iter().all(is_finite) && area.is_finite() && area > 0.0, || {
                    ("it has no area, or a coordinate that is no number".into(), "give two edges that span an area")
                })
            }
        }
    }
}

impl Schedule {
    fn check(&self) -> Result<()> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        match *self {
            Schedule::Motion { duration, step, safety, damping, local_damping, .. } => {
                require(positive(duration), || (format!("a duration of {duration} s"), "give a positive, finite one"))?;
                require(step.is_none_or(positive), || {
                    (
                        format!("a time step of {} s", step.unwrap_or(0.0)),
                        "give a positive, finite one, or leave it out",
                    )
                })?;
                require(positive(safety) && safety <= 1.0, || {
                    (format!("a safety factor of {safety}"), "give one above 0 and at most 1")
                })?;
                require(damping.is_finite() && damping >= 0.0, || {
                    (format!("damping of {damping} 1/s"), "give 0 or more: a negative one would drive the body")
                })?;
                require((0.0..1.0).contains(&local_damping), || {
                    (format!("local damping {local_damping}"), "give a number of at least 0 and below 1")
                })
            }
            Schedule::Equilibrium { steps, tolerance, .. } => {
                require(steps > 0, || ("equilibrium in 0 load steps".into(), "give at least 1 step"))?;
                require(positive(tolerance) && tolerance <= 1.0, || {
                    (format!("a tolerance of {tolerance}"), "give one above 0 and at most 1")
                })
            }
        }
    }
}

impl OutputPlan {
    fn check(&self) -> Result<()> {
        require(self.probe_every > 0, || ("probes every 0 steps".into(), "give at least 1"))?;
        let every = self.checkpoint_every;
        require(every > 0.0, || (format!("checkpoints every {every} s"), "give a positive time; it may be infinite"))?;
        for slice in &self.slices {
            require(slice.axis < 3, || (format!("a slice along axis {}", slice.axis), "give 0, 1 or 2"))?;
            let position = slice.position.unwrap_or(0.0);
            require(position.is_finite(), || (format!("a slice at {position} m"), "give a finite position"))?;
        }
        Ok(())
    }
}

impl ServoPlan {
    fn check(&self) -> Result<()> {
        let finite = self.drives.iter().all(|drive| match *drive {
            CellDrive::Rate(x) | CellDrive::Stress(x) => x.is_finite(),
            CellDrive::StressThenRate { stress, until, rate } => [stress, until, rate].iter().all(|x| x.is_finite()),
        });
        require(finite, || ("a stress, rate or moment is no number".into(), "give finite ones"))?;
        let (gain, fastest) = (self.gain, self.fastest);
        require(gain.is_finite() && gain > 0.0, || (format!("a gain of {gain}"), "give a positive, finite one"))?;
        require(fastest > 0.0, || (format!("a largest strain rate of {fastest} 1/s"), "give a positive one"))
    }
}

/// An error unless something holds.
fn require(holds: bool, otherwise: impl FnOnce() -> (String, &'static str)) -> Result<()> {
    if holds {
        return Ok(());
    }
    let (problem, remedy) = otherwise();
    Err(Error::input(problem, remedy))
}

fn require_unit(normal: &Vector3<f64>) -> Result<()> {
    let length = normal.norm();
    require((length - 1.0).abs() <= UNIT, || {
        (format!("the normal ({}, {}, {}) has length {length}", normal.x, normal.y, normal.z), "give a unit vector")
    })
}

fn is_finite(v: &Vector3<f64>) -> bool {
    v.iter().all(|x| x.is_finite())
}

/// Its name, or its number where it has none.
fn placed(what: &str, number: usize, name: &str) -> String {
    if name.is_empty() { format!("{what} {}", number + 1) } else { format!("{what} {name}") }
}
