//! Packings tiled, and bodies cut from them.

use crate::common;

use anisobond::experiment::element_test::ElementTest;
use anisobond::lattice::solid::{Window, exposed_spheres};
use anisobond::lattice::{Lattice, Solid};
use anisobond::operator::Network;
use common::jittered;
use common::spheres::network;
use nalgebra::Vector3;

#[test]
fn a_tiled_lattice_is_the_lattice_of_the_tiled_packing() {
    let (lattice, one) = network(&jittered(3, 67, 0.2), 1.5);
    let tiled = lattice.tiled([2, 1, 3]).unwrap();
    let searched = Lattice::new(tiled.packing.clone(), 1.5).unwrap();
    assert_eq!(tiled.packing.len(), 6 * lattice.packing.len());
    let key = |l: &Lattice| {
        let mut keys: Vec<(u32, u32, [i64; 3])> =
            l.contacts.iter().map(|c| (c.a, c.b, c.branch.map(|x| (x * 1e6).round() as i64).into())).collect();
        keys.sort_unstable();
        keys
    };
    assert_eq!(key(&tiled), key(&searched));
    let (_, many) = network(&tiled.packing, 1.5);
    let test = |network: &Network| ElementTest::default().run(network).unwrap().measured;
    // A periodic medium is the same medium, however many of its cells are looked at.
    assert!(test(&many).relative_error(&test(&one)) < 1e-6);
    assert!(lattice.tiled([0, 1, 1]).is_err() && lattice.tiled([100_000, 100_000, 1]).is_err());
}

#[test]
fn bodies_cut_from_a_packing() {
    let (lattice, _) = network(&jittered(8, 71, 0.2), 1.4);
    let middle = Vector3::repeat(3.5);
    let hole = Solid::Cylinder { centre: middle, axis: Vector3::z(), radius: 1.8, half_length: f64::INFINITY };
    let everything = Solid::Box { min: Vector3::repeat(-1.0), max: Vector3::repeat(9.0) };
    let rest = Solid::Difference(Box::new(everything.clone()), vec![hole.clone()]);
    let body = lattice.cut(&rest, true).unwrap();
    assert!(body.lattice.packing.cell().is_some() && body.floaters.is_empty());
    assert!(body.lattice.packing.centres().iter().all(|x| rest.contains(x, 0.0)));
    // Free: no bond through the faces.
    let free = lattice.cut(&rest, false).unwrap().lattice;
    let x = free.packing.centres();
    assert!(free.contacts.iter().all(|c| (x[c.b as usize] - x[c.a as usize] - c.branch).norm() < 1e-12));
    assert!(free.contacts.len() < body.lattice.contacts.len());
    // Far apart from the rest: named.
    let island = Solid::Sphere { centre: Vector3::repeat(7.0), radius: 0.9 };
    let corner = Solid::Box { min: Vector3::repeat(-1.0), max: Vector3::repeat(4.0) };
    let cut = lattice.cut(&Solid::Union(vec![corner, island.clone()]), false).unwrap();
    assert!(!cut.floaters.is_empty());
    assert!(cut.floaters.iter().all(|&i| island.contains(&lattice.packing.centres()[i as usize], 0.0)));
    // Pressure in the hole: its area, into the rock, with no resultant.
    let window = Window {
        low: Vector3::new(-1.0, -1.0, 0.0),
        high: Vector3::new(9.0, 9.0, 8.0),
        periodic: [false, false, true],
    };
    let surface = exposed_spheres(&free.packing, &hole, &rest, 1.2, &window).unwrap();
    let (area, patches) = (surface.area(), &surface.patches);
    let exact = 2.0 * std::f64::consts::PI * 1.8 * 8.0;
    assert!((area / exact - 1.0).abs() < 1e-3, "{area} {exact}");
    assert!(surface.normal.norm() < 1e-6 * exact, "{}", surface.normal);
    let work: f64 = patches
        .iter()
        .map(|p| {
            let x = free.packing.centres()[p.node as usize] - middle;
            -p.area * p.normal.dot(&Vector3::new(x.x, x.y, 0.0).normalize())
        })
        .sum();
    assert!((work / exact - 1.0).abs() < 0.1, "{work} {exact}");
    // A ball inside of the rock is no surface of it.
    let inside = Solid::Sphere { centre: Vector3::repeat(6.5), radius: 0.5 };
    assert!(exposed_spheres(&free.packing, &inside, &rest, 1.2, &window).is_err());
    assert!(exposed_spheres(&free.packing, &hole, &rest, -1.0, &window).is_err());
    assert!(lattice.cut(&Solid::Sphere { centre: Vector3::repeat(40.0), radius: 1.0 }, false).is_err());
}
