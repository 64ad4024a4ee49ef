//! A run with an observer of one's own: a bar is pulled at one end, and the wave's arrival at the other is looked for.
//! `cargo run -p anisobond --example run`.

use anisobond::nalgebra::Vector3;
use anisobond::prelude::*;

const NODES: [usize; 3] = [60, 4, 4];
const SPACING: f64 = 1e-3;

/// Prints what the head of this file says.
pub fn main() -> Result<()> {
    let grid = Grid::new(NODES, SPACING, Vector3::zeros(), [false; 3])?;
    let place = |node: u32| grid.coordinates(node as usize)[0];
    let nodes = || 0..grid.len() as u32;
    let (first, last): (Vec<u32>, Vec<u32>) =
        (nodes().filter(|n| place(*n) == 0).collect(), nodes().filter(|n| place(*n) == NODES[0] - 1).collect());

    let silicon = Material::builtin("Si").ok_or_else(|| Error::input("no silicon", "name another material"))?;
    let density = 2330.0;
    let region = RegionMaterial { name: "bar".into(), stiffness: silicon.stiffness, density, fracture: None };
    let bonds = Neighbourhood::sphere(3.0, SPACING, Influence::Inverse)?;
    let mut problem = Problem::new("bar", Body::full(grid.clone()), bonds, vec![region], Schedule::motion(12e-6));
    let pull = Vector3::new(-1.0, 0.0, 0.0);
    problem.conditions.push(Condition::Force {
        force: vec![pull; first.len()],
        nodes: first,
        history: History::Constant,
    });
    let probe = Probe { name: "end".into(), quantity: Quantity::Displacement, nodes: last };

    let mut run = Simulation::new(problem)?;
    let mut largest: f64 = 0.0;
    let mut arrival = None;
    while !run.finished() {
        run.advance()?;
        let moved = run.measure(&probe)[0].abs();
        largest = largest.max(moved);
        // Half of what the free end of a bar does while a front passes one spacing is far above its forerunners.
        if arrival.is_none() && moved > 1e-12 {
            arrival = Some(run.time());
        }
    }
    let length = (NODES[0] - 1) as f64 * SPACING;
    let speed = length / arrival.unwrap_or(f64::INFINITY);
    println!("first motion of the far end after {:.2e} s: {speed:.0} m/s; it moved by {largest:.2e} m", length / speed);
    println!("energy drift {:.1e} of the largest part", run.ledger().relative_drift());
    Ok(())
}
