//! Case files and the files beside them: surfaces, tables, the cases of the repository and of the documentation.

use crate::given::case as case_common;

use anisobond::lattice::Solid;
use anisobond_app::{CaseFile, LatticeKind, starter_case};
use anisobond_formats::parse_stl;
use case_common::{ball, binary_stl, files, root};
use nalgebra::Vector3;

fn text_stl(triangles: &[[Vector3<f64>; 3]]) -> String {
    let facet = |t: &[Vector3<f64>; 3]| {
        let vertices: String = t.iter().map(|p| format!("  vertex {:e} {:e} {:e}\n", p.x, p.y, p.z)).collect();
        format!("facet normal 0 0 0\n outer loop\n{vertices} endloop\nendfacet\n")
    };
    format!("solid ball\n{}endsolid ball\n", triangles.iter().map(facet).collect::<String>())
}

#[test]
fn a_ball_from_stl_is_a_ball() {
    let triangles = ball(4);
    let mesh = parse_stl(&binary_stl(&triangles), 1e-3).unwrap();
    assert_eq!(mesh, parse_stl(text_stl(&triangles).as_bytes(), 1e-3).unwrap());
    assert_eq!(mesh.len(), 2048);
    let exact = Solid::Sphere { centre: Vector3::zeros(), radius: 1e-3 };
    for n in 0..4000 {
        let t = f64::from(n);
        let x = Vector3::new((0.7 * t).sin(), (1.3 * t).sin(), (2.9 * t).sin()) * 1.3e-3;
        // The largest triangles have edges of 0.15 and lie within 0.15²/6 of the sphere.
        assert!(
            (mesh.distance(&x) - exact.distance(&x)).abs() < 4e-6,
            "{x:?} {} {}",
            mesh.distance(&x),
            exact.distance(&x)
        );
    }
    for (bytes, part) in [
        (binary_stl(&triangles[..2047]), "not closed"),
        (binary_stl(&triangles)[..5000].to_vec(), "neither a binary nor a text STL"),
        (b"solid a\nvertex 1 2\n".to_vec(), "line 2: \"vertex 1 2\" is not a vertex"),
        (b"solid a\nendsolid\n".to_vec(), "no triangles"),
        (Vec::new(), "neither"),
    ] {
        let message = parse_stl(&bytes, 1.0).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn files_beside_the_case_are_found() {
    let folder = files();
    let path = folder.path().join("case.toml");
    let text = r#"
density = "1 kg/m3"
[body]
stl = { file = "part.stl", unit = "mm" }
rotate = { axis = [0, 0, 1], angle = 20 }
move = "1, 2, 3 mm"
[grid]
spacing = "0.1 mm"
[[region]]
name = "g"
material = "rock.toml"
grains = { number = 2, orientations = "orientations.csv" }
fracture = { directional = "energies.csv" }
[[condition]]
on = "x-min"
displacement = [0, 0, 0]
history = { table = "load.csv" }
[motion]
duration = "1 ms"
"#;
    std::fs::write(&path, text).unwrap();
    let p = anisobond_app::read_case(&path, &["name=ball".to_string()]).unwrap();
    // A polyhedron's volume is a sixth of the sum of a·(b × c).
    let exact = ball(3).iter().map(|[a, b, c]| a.dot(&b.cross(c))).sum::<f64>().abs() / 6.0 * 1e-9;
    let volume = p.body.nodes() as f64 * 1e-12;
    assert!((volume / exact - 1.0).abs() < 0.01, "{volume} {exact}");
    assert_eq!((p.name.as_str(), p.regions.len()), ("ball", 2));
    assert!(
        (p.body.grid.position(p.body.grid.index(p.body.grid.nodes.map(|n| n / 2))) - Vector3::new(1e-3, 2e-3, 3e-3))
            .norm()
            < 2e-4
    );
    for (from, to, parts) in [
        ("part.stl", "prt.stl", ["case.toml, line 4, body.stl.file", "cannot read"]),
        ("orientations.csv", "load.csv", ["region.0.grains.orientations", "3 numbers"]),
        ("number = 2", "number = 3", ["2 orientations for 3 grains", "one for each"]),
    ] {
        let wrong = text.replace(from, to);
        let result = CaseFile::parse(&wrong, path.to_str().unwrap(), &[]);
        let message = result.err().map(|e| e.to_string()).unwrap();
        // A file that cannot be read names itself.
        assert!(parts.iter().skip(usize::from(from == "part.stl")).all(|p| message.contains(p)), "{message}");
    }
}

/// Every case of the repository is read, and resolved on a grid four times as coarse.
#[test]
fn the_cases_of_the_repository_are_sound() {
    let mut found = 0;
    for entry in std::fs::read_dir(root().join("cases")).unwrap() {
        let path = entry.unwrap().path();
        let Ok(text) = std::fs::read_to_string(&path) else { continue };
        if path.extension().is_none_or(|e| e != "toml") || !text.contains("[body]") {
            continue;
        }
        found += 1;
        let case = CaseFile::read(&path, &[]).unwrap_or_else(|e| panic!("{e}"));
        let spacing = case.grid().unwrap().spacing;
        if case.grid().unwrap().len() < 100_000 {
            let p = case.problem().unwrap_or_else(|e| panic!("{e}"));
            let plan = case.plan(&p);
            assert!(
                plan.nodes > 1000 && plan.bonds > 10 * plan.nodes as u64 && plan.conditions.len() == p.conditions.len()
            );
            assert!(p.probes.iter().all(|q| !q.nodes.is_empty()) && !case.description().is_empty());
        }
        assert!(spacing > 0.0);
    }
    assert!(found >= 8, "{found}");
}

#[test]
fn the_starter_is_a_case() {
    for name in ["bar", "a \"b\"\n"] {
        let case = CaseFile::parse(&starter_case(name), "bar.toml", &[]).unwrap();
        let p = case.problem().unwrap();
        let plan = case.plan(&p);
        assert_eq!((plan.nodes, plan.conditions[0].force), (3200, Some([0.0, 80.0, 0.0])));
    }
}

/// Blocks of docs/cases.md are complete cases with what they leave out filled in.
#[test]
fn the_examples_of_the_page_are_read() {
    let folder = files();
    let page = std::fs::read_to_string(root().join("docs/cases.md")).unwrap();
    let blocks: Vec<&str> = page.split("```toml\n").skip(1).map(|rest| rest.split("```").next().unwrap()).collect();
    assert!(blocks.len() >= 10);
    for block in blocks {
        let has = |key: &str| {
            toml::from_str::<toml::Table>(block).unwrap_or_else(|e| panic!("{e}\n{block}")).contains_key(key)
        };
        let mut text = String::new();
        // Bonds of a packing that are not corrected need a Poisson's ratio below ¼.
        let stiff = "{ class = 'isotropic', unit = 'GPa', engineering = { e = 72, nu = 0.2 } }";
        let material = if has("packing") { format!("material = {stiff}\n") } else { "material = 'Pyroceram'\n".into() };
        for (key, line, fits) in [
            ("material", material.as_str(), true),
            ("density", "density = '2600 kg/m3'\n", true),
            ("body", "body = { box = { min = '0, 0, 0 mm', max = '100, 40, 20 mm' } }\n", !has("servo")),
            ("grid", "grid = { spacing = '2 mm' }\n", !has("packing")),
        ] {
            text += if has(key) || !fits { "" } else { line };
        }
        if !has("motion") && !has("equilibrium") {
            text += "motion = { duration = '1 us' }\n";
        }
        text += block;
        let place = folder.path().join("page.toml");
        let case = CaseFile::parse(&text, place.to_str().unwrap(), &[]).unwrap_or_else(|e| panic!("{e}\n{text}"));
        if case.lattice() == LatticeKind::Packing {
            let p = case.packing_problem().unwrap_or_else(|e| panic!("{e}\n{text}"));
            assert!(p.model.packing.len() >= 200 && p.model.bonds.len() > p.model.packing.len());
        } else if case.grid().unwrap().len() < 50_000 {
            case.problem().unwrap_or_else(|e| panic!("{e}\n{text}"));
        }
    }
}
