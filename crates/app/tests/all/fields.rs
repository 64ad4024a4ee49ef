//! Strain and stress at nodes: exact of what is linear on either side of cracks and interfaces, against closed forms at a hole,
//! and the register of fields against the documents.

use crate::given::case as case_common;

use anisobond::experiment::closed_forms::PressurisedHole;
use anisobond::experiment::{FieldName, Quantity, Simulation};
use anisobond::operator::{Kinematics, VectorField};
use case_common::{message, problem, root};
use nalgebra::{Matrix3, Vector3};

/// Two materials, a crack, a notch and a lone corner: on each side of both another linear displacement.
#[test]
fn linear_pieces_are_found_exactly_at_walls_interfaces_and_cracks() {
    let text = "[solids.notch]\nbox = { min = '-1, -1, 3 mm', max = '2.5, 13, 6 mm' }\n[body]\ndifference = [{ box = { min = '0, \
        0, 0 mm', max = '12, 12, 12 mm' } }, 'notch']\n[grid]\nspacing = '1 mm'\nhorizon = 2\n[model]\nsurface_calibration = \
        false\n[[region]]\nname = 'stiff'\nmaterial = 'Pyroceram'\nsolid = { box = { min = '-1, -1, -1 mm', max = '6, 13, 13 mm' \
        } }\n[[region]]\nname = 'soft'\nmaterial = 'Spinel'\n[[crack]]\nplane = { point = '0, 8, 0 mm', normal = 'y' }\n\
        [equilibrium]\n";
    let simulation = Simulation::new(problem(text)).unwrap();
    let body = &simulation.problem().body;
    let piece = |node: usize| {
        let above = if body.grid.position(node).y > 8e-3 { 1.0 } else { 0.0 };
        let region = f64::from(body.region[node]);
        1e-3 * Matrix3::new(region, 0.4, -0.3 + above, 0.2, -0.7 * region, 0.5, 0.6 - above, -0.1, 0.8 * region)
    };
    let mut u = VectorField::zeros(body.grid.len());
    let nodes: Vec<usize> = (0..body.grid.len()).filter(|n| body.has(*n)).collect();
    nodes
        .iter()
        .for_each(|&n| u.set(n, &(piece(n) * body.grid.position(n) + Vector3::repeat(f64::from(body.region[n])))));
    let bonds = simulation.bond_state().grid();
    let mut padded = bonds.padded();
    padded.set(&u);
    let all = bonds.gradients(&padded);
    let one_by_one = bonds.gradients_of(&padded, nodes.iter().copied());
    for (&node, one) in nodes.iter().zip(one_by_one) {
        assert_eq!(all[node], one);
        let error = (one.gradient - piece(node)).norm();
        // Offsets of a metre between the pieces leave 1e-16 m of rounding over a spacing.
        assert!(error < 1e-11, "{:?}: {error:e}", body.grid.coordinates(node));
    }
    assert!(nodes.len() > 1000 && simulation.regions().len() == 2);
}

/// A pressurised hole in an anisotropic solid, its nodes displaced as in the closed form: the stress at nodes that have all
/// bonds converges at second order, at the wall at first.
#[test]
fn stresses_of_exact_displacements_converge() {
    let errors = [8, 16, 32].map(|per_radius| {
        let text = format!(
            "material = {{ class = 'transversely-isotropic', unit = 'MPa', axis = [0, 1, 0], c11 = 130, c33 = 55, c13 = 28, c12 = \
             40, c44 = 32.25 }}\n[solids.hole]\ncylinder = {{ axis = 'z', radius = '1 m' }}\n[body]\ndifference = [{{ box = {{ \
             size = '4, 4, 4 m' }} }}, 'hole']\n[grid]\nspacing = '{} m'\nplane_strain = 'z'\n[model]\n\
             surface_calibration = false\n[equilibrium]\n",
            1.0 / f64::from(per_radius)
        );
        let simulation = Simulation::new(problem(&text)).unwrap();
        let body = &simulation.problem().body;
        let stiffness = simulation.problem().regions[0].stiffness;
        let hole = PressurisedHole::new(&stiffness, 1.0, 1e6).unwrap();
        let at = |n: usize| [body.grid.position(n).x, body.grid.position(n).y];
        let mut u = VectorField::zeros(body.grid.len());
        let nodes: Vec<usize> = (0..body.grid.len()).filter(|n| body.has(*n)).collect();
        nodes.iter().for_each(|&n| u.set(n, &hole.displacement(at(n))));
        let bonds = simulation.bond_state().grid();
        let mut padded = bonds.padded();
        padded.set(&u);
        let gradients = bonds.gradients(&padded);
        let spacing = body.grid.spacing;
        // The wall's nodes; and the ring from 1.5 to 1.6 radii, where all have all bonds.
        let rings = [[0.0, 1.0 + spacing], [1.5, 1.6]];
        rings.map(|[from, to]| {
            let of_ring = nodes.iter().filter(|&&n| (from..to).contains(&at(n)[0].hypot(at(n)[1])));
            let errors = of_ring.map(|&n| {
                let stress = gradients[n].state(&stiffness, Kinematics::Linear).stress;
                (stress - hole.stress(at(n))).norm() / hole.stress(at(n)).norm()
            });
            errors.fold(0.0, f64::max)
        })
    });
    let slope = |ring: usize, n: usize| (errors[n][ring] / errors[n + 1][ring]).log2();
    println!("{errors:?}");
    assert!(slope(0, 1) > 0.8 && errors[2][0] < 0.15, "wall {errors:?}");
    assert!(slope(1, 0) > 1.7 && slope(1, 1) > 1.7 && errors[2][1] < 0.01, "ring {errors:?}");
}

/// A ring pulled at its outer edge (Lamé): at the free wall of the hole the hoop stress is a tenth off where the virial is a
/// quarter off, and no stress crosses the wall.
#[test]
fn the_stress_at_a_wall_is_closer_than_the_virial() {
    let text = "material = { class = 'isotropic', unit = 'GPa', engineering = { e = 10, nu = 0.25 } }\n[solids.hole]\ncylinder = \
        { axis = 'z', radius = '1 m' }\n[solids.disc]\ncylinder = { axis = 'z', radius = '3 m' }\n[body]\ndifference = ['disc', \
        'hole']\n[grid]\nspacing = '0.1 m'\nhorizon = 3\nplane_strain = 'z'\n[[condition]]\non = 'disc'\npressure = '-1 \
        MPa'\n[equilibrium]\n";
    let mut simulation = Simulation::new(problem(text)).unwrap();
    simulation.advance().unwrap();
    let (stress, virial) = (simulation.field(FieldName::Stress).1, simulation.field(FieldName::Virial).1);
    let body = &simulation.problem().body;
    // σ = A ∓ B/r², A = q b²/(b² − a²), B = A a².
    let a = 1e6 * 9.0 / 8.0;
    let (mut sums, mut count) = ([0.0; 4], 0.0);
    for node in (0..body.grid.len()).filter(|n| body.has(*n)) {
        let x = body.grid.position(node);
        let r = x.x.hypot(x.y);
        if r > 1.1 {
            continue;
        }
        let (n, t) = (Vector3::new(x.x / r, x.y / r, 0.0), Vector3::new(-x.y / r, x.x / r, 0.0));
        let exact = [a + a / (r * r), a - a / (r * r)];
        for (k, field) in [&stress, &virial].into_iter().enumerate() {
            let [xx, yy, zz, xy, yz, xz] = std::array::from_fn(|i| f64::from(field[6 * node + i]));
            let s = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
            sums[2 * k] += (t.dot(&(s * t)) / exact[0] - 1.0).powi(2);
            sums[2 * k + 1] += ((n.dot(&(s * n)) - exact[1]) / exact[0]).powi(2);
        }
        count += 1.0;
    }
    let [hoop, across, virial_hoop, _] = sums.map(|s: f64| (s / count).sqrt());
    println!("{count} nodes: hoop {hoop:.3}, across {across:.3}; virial {virial_hoop:.3}");
    assert!(hoop < 0.1 && across < 0.1 && virial_hoop > 0.15, "{hoop} {across} {virial_hoop}");
}

/// Fields that are made of the stress, and probes, say the same as the stress.
#[test]
fn scalars_and_probes_are_those_of_the_stress() {
    let text = "material = 'Pyroceram'\n[body]\nbox = { size = '6, 5, 4 mm' }\n[grid]\nspacing = '1 mm'\nhorizon = 2\n[model]\n\
        kinematics = 'finite'\n[[condition]]\non = 'x-min'\ndisplacement = [0, 0, 0]\n[[condition]]\non = \
        'x-max'\ntraction = ['100 MPa', '30 MPa', 0]\n[equilibrium]\n[[probe]]\nname = 'end'\nquantity = 'stress'\non = 'x-max'\n\
        [[probe]]\nname = 'all'\nquantity = 'strain'\non = 'all'\n";
    let mut simulation = Simulation::new(problem(text)).unwrap();
    simulation.advance().unwrap();
    let field = |name: FieldName| {
        let (numbers, values) = simulation.field(name);
        assert_eq!(numbers, name.numbers());
        values.into_iter().map(f64::from).collect::<Vec<_>>()
    };
    let (stress, mises, principal) =
        (field(FieldName::Stress), field(FieldName::VonMises), field(FieldName::PrincipalStress));
    for node in 0..mises.len() {
        let [xx, yy, zz, xy, yz, xz] = std::array::from_fn(|i| stress[6 * node + i]);
        let equivalent = (0.5 * ((xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2))
            + 3.0 * (xy * xy + yz * yz + xz * xz))
            .sqrt();
        assert!((mises[node] / equivalent - 1.0).abs() < 1e-5);
        let p = &principal[3 * node..3 * node + 3];
        assert!(p[0] >= p[1] && p[1] >= p[2]);
        assert!((p.iter().sum::<f64>() - (xx + yy + zz)).abs() < 1e-5 * equivalent);
        let square = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + xz * xz);
        assert!((p.iter().map(|p| p * p).sum::<f64>() / square - 1.0).abs() < 1e-5);
    }
    // Columns xx yy zz yz xz xy, fields xx yy zz xy yz xz.
    for (probe, field) in simulation.problem().probes.iter().zip([stress, field(FieldName::Strain)]) {
        let columns = probe.quantity.columns();
        assert!(columns[0].contains("_xx") && columns[3].contains("_yz") && columns[5].contains("_xy"));
        let (found, scale) = (simulation.measure(probe), field.iter().fold(0.0, |m: f64, x| m.max(x.abs())));
        for (k, i) in [0, 1, 2, 4, 5, 3].into_iter().enumerate() {
            let mean = probe.nodes.iter().map(|&n| field[6 * n as usize + i]).sum::<f64>() / probe.nodes.len() as f64;
            assert!((found[k] - mean).abs() < 1e-6 * scale, "{} {k}: {} {mean}", probe.name, found[k]);
        }
    }
    // The stretch that is shown is the one that would break a bond.
    let stretch = field(FieldName::Stretch);
    let largest = stretch.iter().copied().fold(0.0, f64::max);
    let breaking = |at: f64| {
        let fracture = format!("fracture = {{ stretch = {at:?} }}\n{text}");
        let mut broken = Simulation::new(problem(&fracture)).unwrap();
        broken.advance().map(|()| broken.ledger().broken_bonds)
    };
    assert_eq!(breaking(1.001 * largest).unwrap(), 0);
    assert!(breaking(0.999 * largest).map_or(true, |n| n > 0));
}

/// The documents have every field and quantity as the register has it.
#[test]
fn the_documents_name_every_field() {
    let text = std::fs::read_to_string(root().join("docs/cases.md")).unwrap();
    for field in FieldName::ALL {
        let about = field.about();
        let unit = if about.unit.is_empty() { "–" } else { about.unit };
        let components = if about.components.is_empty() { "–".into() } else { about.components.join(" ") };
        let row = format!("| `{}` | {unit} | {components} | {} |", about.key, about.meaning);
        assert!(text.contains(&row), "docs/cases.md has no row\n{row}");
    }
    for (name, quantity) in Quantity::NAMES {
        let columns = quantity.columns();
        let row = format!("| `{name}` | `{}` |", columns.join("` `"));
        assert!(text.contains(&row), "docs/cases.md has no row\n{row}");
    }
}

#[test]
fn components_that_are_none_are_refused() {
    let with =
        |slice: &str| message(&format!("{}\n[output]\nslices = [{{ axis = 'z', {slice} }}]\n", case_common::BLOCK));
    let refused = with("field = 'damage', component = 'x'");
    assert!(refused.contains("output.slices.0.component: damage has no components"), "{refused}");
    let refused = with("field = 'stress', component = 'x'");
    assert!(refused.contains("\"x\" is not known here") && refused.contains("xx"), "{refused}");
    let refused = with("field = 'stres'");
    assert!(refused.contains("stress"), "{refused}");
}
