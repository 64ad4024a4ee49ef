//! Grains and layers of cases on packings.

use anisobond::experiment::PackingProblem;
use anisobond_app::CaseFile;

fn problem(region: &str) -> anisobond::Result<PackingProblem> {
    let text = format!(
        "region = [{region}]\npacking = {{ radius = \"0.5 mm\", number = 100, seed = 2, contact_radius = 1.6 }}\n\
         body = {{ box = {{ min = \"0, 0, 1 mm\", max = \"8, 8, 9 mm\" }} }}\nmotion = {{ duration = \"1 us\" }}\n\
         probe = [{{ name = \"all\", quantity = \"velocity\", on = \"r\" }}]\n"
    );
    CaseFile::parse(&text, "case.toml", &[]).and_then(|case| case.packing_problem())
}

/// Layers are counted from the body's lower face; each has its material, and the region is all of them.
#[test]
fn spheres_are_of_the_layer_that_they_are_in() {
    let layers = |first: f64, more: &str| {
        format!(
            "{{ name = \"r\", layers = {{ axis = \"z\"{more}, layup = [{{ thickness = \"{first} mm\", material = \"Si\", density = \
             \"2330 kg/m3\" }}, {{ thickness = \"3 mm\", material = \"Pyroceram\", density = \"2600 kg/m3\" }}] }} }}"
        )
    };
    let p = problem(&layers(5.0, "")).unwrap();
    let names: Vec<&str> = p.evidence.iter().map(|e| e.region.as_str()).collect();
    assert_eq!(names, ["r-1", "r-2"]);
    let mut seen = [0; 2];
    for sphere in 0..p.region.len() {
        let upper = p.position(sphere).z > 6e-3;
        assert_eq!(usize::from(p.region[sphere]), usize::from(upper), "{sphere}");
        let density = p.model.mass[sphere] / p.volumes[sphere];
        assert!((density / if upper { 2600.0 } else { 2330.0 } - 1.0).abs() < 1e-12);
        seen[usize::from(upper)] += 1;
    }
    assert!(seen[0] > 100 && seen[1] > 50 && p.probes[0].nodes.len() == p.region.len(), "{seen:?}");
    // Too thin a layup is named with the sphere that it does not reach.
    let said = problem(&layers(1.0, "")).unwrap_err().to_string();
    assert!(said.contains("the layers reach from z = 0.001 m to 0.005 m, but the region has a sphere at"), "{said}");
    // Repeated, layers alternate.
    let p = problem(&layers(1.0, ", repeat = 2")).unwrap();
    let layer = |z: f64| u16::from(((z - 1e-3) / 1e-3).rem_euclid(4.0) > 1.0);
    assert!((0..p.region.len()).all(|s| p.region[s] == layer(p.position(s).z)));
}

/// Grains are turned crystals: equal seeds give equal grains, each of its own lattice; every sphere is in the nearest.
#[test]
fn spheres_are_of_the_grain_that_is_nearest() {
    let grains = |seed: usize| {
        let table = format!("grains = {{ number = 5, seed = {seed} }}");
        problem(&format!("{{ name = \"r\", material = \"Si\", density = \"2330 kg/m3\", {table} }}")).unwrap()
    };
    let (p, again, other) = (grains(3), grains(3), grains(4));
    assert_eq!((p.evidence.len(), &p.region), (5, &again.region));
    assert_ne!(p.region, other.region);
    let silicon = anisobond::tensor::Material::builtin("Si").unwrap().stiffness;
    for (n, evidence) in p.evidence.iter().enumerate() {
        assert!(p.region.contains(&(n as u16)) && evidence.region == format!("r-{}", n + 1));
        let off = (evidence.prescribed.mandel() - silicon.mandel()).norm() / silicon.norm();
        assert!(off > 0.01 && (evidence.prescribed.norm() / silicon.norm() - 1.0).abs() < 1e-12);
    }
    // Cells of points are convex: the middle of two spheres of a grain is nearest to one of the same grain or between two.
    let near = |x: anisobond::nalgebra::Vector3<f64>| {
        let distance = |s: &usize| (p.position(*s) - x).norm();
        (0..p.region.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap()
    };
    let (mut same, mut all) = (0, 0);
    for a in (0..p.region.len()).step_by(17) {
        for b in (a + 1..p.region.len()).step_by(29).filter(|&b| p.region[a] == p.region[b]) {
            all += 1;
            same += usize::from(p.region[near(0.5 * (p.position(a) + p.position(b)))] == p.region[a]);
        }
    }
    assert!(all > 50 && same as f64 > 0.9 * all as f64, "{same} of {all}");
}
