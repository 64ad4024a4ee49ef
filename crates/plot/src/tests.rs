//! Properties of whole pictures: what is shown, in which order, that nothing is cut off or overlaps.

use std::collections::HashSet;

use nalgebra::{Rotation3, Vector3};

use super::colour::Paint;
use super::drawing::{Anchor, Drawing, Mark};
use super::text::width;
use super::*;
use anisobond::Error;
use anisobond::lattice::{Bond, Influence, Neighbourhood, Shape};

fn neighbourhood(horizon: f64) -> Neighbourhood {
    Neighbourhood::sphere(horizon, 1e-3, Influence::Inverse).unwrap()
}

/// A smooth anisotropic micromodulus with zeros (N/m⁶).
fn micromodulus(bond: &Bond) -> f64 {
    let n = bond.xi.normalize();
    1e21 * (n.x.powi(4) + 0.4 * n.z.powi(4) - 0.2 * n.y * n.z - 0.05).max(0.0)
}

fn scene_of(neighbourhood: &Neighbourhood, value: impl Fn(&Bond) -> f64) -> Scene {
    let c: Vec<f64> = neighbourhood.bonds().iter().map(value).collect();
    neighbourhood_scene(neighbourhood, &c, &NeighbourhoodPicture::of("KIO₃ & <others>")).unwrap()
}

/// A table of scenes that every picture's property must hold for.
fn scenes() -> Vec<(&'static str, Scene)> {
    let flat = |i: i32| Ball {
        centre: Vector3::new(f64::from(i % 20), f64::from(i / 20), 0.0),
        radius: 0.3 + 0.01 * f64::from(i % 20),
        value: Some(f64::from(i)),
    };
    let cube = Neighbourhood::new(Shape::Cube { semi_edge: 2.0 }, 2.0, 1.0, Influence::Constant).unwrap();
    let scalar = Scalar { name: "height of a very long name".into(), unit: String::new() };
    let landmark = Ball { centre: Vector3::zeros(), radius: 1.0, value: None };
    vec![
        ("smooth", scene_of(&neighbourhood(4.0), micromodulus)),
        ("six bonds", scene_of(&neighbourhood(1.0), |bond| bond.xi.x + 2.0 * bond.xi.z)),
        ("all equal", scene_of(&neighbourhood(3.0), |_| 2.535e-7)),
        ("all zero", scene_of(&neighbourhood(2.0), |_| 0.0)),
        ("nearly equal", scene_of(&neighbourhood(2.0), |bond| 3e9 + 10.0 * bond.influence)),
        ("signed", scene_of(&cube, |bond| -1e300 * bond.xi.x)),
        ("subnormal", scene_of(&cube, |bond| 5e-324 * bond.xi.x.abs())),
        ("extreme", scene_of(&cube, |bond| f64::MAX * bond.xi.x.signum())),
        ("long title", scene_of(&neighbourhood(2.0), micromodulus).titled("rock ".repeat(100), "soil ".repeat(200))),
        ("flat", Scene::new((0..400).map(flat).collect(), scalar.clone()).unwrap().titled("plate", "")),
        ("one landmark", Scene::new(vec![landmark], scalar).unwrap()),
    ]
}

/// Left, top, right and bottom of a mark.
pub(super) fn reach(mark: &Mark) -> [f64; 4] {
    match mark {
        Mark::Sphere { at: [x, y], radius: r, .. } | Mark::Disc { at: [x, y], radius: r, .. } => {
            [x - r, y - r, x + r, y + r]
        }
        Mark::Line { from, to, .. } => [from[0].min(to[0]), from[1].min(to[1]), from[0].max(to[0]), from[1].max(to[1])],
        Mark::Polygon { points, .. } | Mark::Path { points, .. } => {
            points.iter().fold([f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY], |r, p| {
                [r[0].min(p[0]), r[1].min(p[1]), r[2].max(p[0]), r[3].max(p[1])]
            })
        }
        Mark::Rectangle { at: [x, y], size: [w, h], .. } => [*x, *y, x + w, y + h],
        Mark::Text { at: [x, y], size, anchor, text, .. } => {
            let wide = width(text, *size);
            let left = match anchor {
                Anchor::Start => *x,
                Anchor::Middle => x - 0.5 * wide,
                Anchor::End => x - wide,
            };
            [left, y - 0.76 * size, left + wide, y + 0.2 * size]
        }
    }
}

#[test]
fn nothing_is_cut_off_and_no_words_overlap() {
    for (name, scene) in scenes() {
        let drawing = Drawing::of(&scene);
        let marks: Vec<&Mark> = drawing.groups.iter().flat_map(|group| &group.marks).collect();
        for mark in &marks {
            let [left, top, right, bottom] = reach(mark);
            let inside = left >= 8.0 && top >= 8.0 && right <= drawing.size[0] - 8.0 && bottom <= drawing.size[1] - 8.0;
            assert!(inside, "{name}: {mark:?} in {:?}", drawing.size);
        }
        for (index, a) in marks.iter().enumerate().filter(|(_, mark)| matches!(mark, Mark::Text { .. })) {
            for (other, b) in marks.iter().enumerate() {
                // The axes' names may touch their own arrows.
                if index == other || matches!(b, Mark::Line { .. }) {
                    continue;
                }
                let ([l, t, r, d], [l2, t2, r2, d2]) = (reach(a), reach(b));
                assert!(l >= r2 || l2 >= r || t >= d2 || t2 >= d, "{name}: {a:?} and {b:?}");
            }
        }
    }
}

#[test]
fn the_svg_shows_exactly_the_kept_side() {
    let turn = Rotation3::from_euler_angles(0.4, 0.1, -0.7);
    for neighbourhood in [neighbourhood(3.0), neighbourhood(3.0).rotated(turn.matrix()).unwrap()] {
        // A view cut along the turned grid, where rounding decides unless the plane has a thickness.
        let along = neighbourhood.orientation() * Vector3::new(0.0, -1.0, 0.0);
        let views = vec![View::whole(), View::cut(along).unwrap(), View::cut(3.0 * along).unwrap()];
        let options = NeighbourhoodPicture { views, ..NeighbourhoodPicture::of("rock") };
        let c: Vec<f64> = neighbourhood.bonds().iter().map(micromodulus).collect();
        let svg = neighbourhood_scene(&neighbourhood, &c, &options).unwrap().svg();
        let file = roxmltree::Document::parse(&svg).unwrap();
        let circles = |panel: &str| {
            let group = file.descendants().find(|node| node.attribute("id") == Some(panel)).unwrap();
            group.children().filter(|node| node.has_tag_name("circle")).count()
        };
        // One more for the node itself.
        let kept = neighbourhood.bonds().iter().filter(|bond| bond.offset[1] >= 0).count() + 1;
        assert_eq!([circles("panel-1"), circles("panel-2"), circles("panel-3")], [123, kept, kept]);
        let defined: HashSet<&str> = file.descendants().filter_map(|node| node.attribute("id")).collect();
        for fill in file.descendants().filter_map(|node| node.attribute("fill")) {
            if let Some(name) = fill.strip_prefix("url(#") {
                assert!(defined.contains(name.trim_end_matches(')')), "{fill}");
            }
        }
    }
}

#[test]
fn svg_is_well_formed_whatever_the_words() {
    for (name, scene) in scenes() {
        let scene = scene.titled("a < b & \"c\" \u{1}\u{fffe}\n", "]]> <!-- <script>");
        let svg = scene.svg();
        let file = roxmltree::Document::parse(&svg).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(file.root_element().tag_name().name(), "svg");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
    }
}

#[test]
fn colours_follow_values_and_the_nearest_is_painted_last() {
    // A row of spheres towards the eye, value falling.
    let ball = |i: i32| Ball {
        centre: f64::from(i) * Vector3::new(0.75, -1.3, 0.8),
        radius: 0.4,
        value: Some(f64::from(100 - i)),
    };
    let scene = Scene::new((0..100).rev().map(ball).collect(), Scalar { name: "v".into(), unit: "m".into() }).unwrap();
    let drawing = Drawing::of(&scene);
    let panel = drawing.groups.iter().find(|group| group.name == "panel-1").unwrap();
    let paints: Vec<Paint> = panel
        .marks
        .iter()
        .filter_map(|mark| if let Mark::Sphere { paint, .. } = mark { Some(*paint) } else { None })
        .collect();
    assert_eq!(paints.len(), 100);
    assert!(paints.windows(2).all(|w| w[0] >= w[1]), "{paints:?}");
    assert!(paints[0] > paints[99]);
}

/// Pixels of a PNG file, and its width and height.
fn decode(file: &[u8]) -> (Vec<[u8; 3]>, u32, u32) {
    let mut reader = ::png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    (bytes.as_chunks::<3>().0.to_vec(), info.width, info.height)
}

#[test]
fn the_png_has_its_size_and_its_colours() {
    for (name, scene) in scenes() {
        let (pixels, width, height) = decode(&scene.png(600).unwrap());
        let drawing = Drawing::of(&scene);
        assert_eq!(width, 600, "{name}");
        assert_eq!(height, (600.0 * drawing.size[1] / drawing.size[0]).ceil() as u32, "{name}");
        let colours: HashSet<&[u8; 3]> = pixels.iter().collect();
        assert!(colours.len() > 100, "{name}: {} colours", colours.len());
        // A white border all around.
        let (w, h) = (width as usize, height as usize);
        let border = (0..w * h).filter(|i| i % w == 0 || i % w == w - 1 || i / w == 0 || i / w == h - 1);
        assert!(border.into_iter().all(|i| pixels[i] == [255; 3]), "{name}");
    }
}

#[test]
fn a_sphere_has_its_place_and_colour_in_the_png() {
    let scene = Scene::new(
        vec![Ball { centre: Vector3::zeros(), radius: 2.0, value: Some(3.0) }],
        Scalar { name: "v".into(), unit: "m".into() },
    )
    .unwrap();
    let drawing = Drawing::of(&scene);
    let Some(Mark::Sphere { at, radius, paint }) =
        drawing.groups.iter().find(|group| group.name == "panel-1").and_then(|group| group.marks.first())
    else {
        panic!("no sphere")
    };
    let (pixels, width, _) = decode(&scene.png(drawing.size[0].round() as u32).unwrap());
    let pixel = |x: f64, y: f64| pixels[y as usize * width as usize + x as usize];
    // Where the shading is the colour itself: down to the right of the middle, and white outside.
    let [middle, base] = [pixel(at[0] + 0.25 * radius, at[1] + 0.2 * radius), paint.colour()];
    assert!((0..3).all(|c| middle[c].abs_diff(base[c]) <= 12), "{middle:?} {base:?}");
    assert_eq!(pixel(at[0] + radius + 2.0, at[1]), [255; 3]);
    assert_ne!(pixel(at[0] + radius - 2.0, at[1]), [255; 3]);
}

#[test]
fn wrong_input_and_paths_are_refused() {
    let six = neighbourhood(1.0);
    let options = NeighbourhoodPicture::of("rock");
    for wrong in [vec![1.0; 5], vec![f64::NAN; 6], vec![1.0, 1.0, f64::INFINITY, 1.0, 1.0, 1.0]] {
        assert!(matches!(neighbourhood_scene(&six, &wrong, &options), Err(Error::Failure { .. })));
    }
    let scalar = || Scalar { name: "v".into(), unit: "m".into() };
    let ball = |radius: f64, value: f64| Ball { centre: Vector3::zeros(), radius, value: Some(value) };
    assert!(matches!(Scene::new(vec![], scalar()), Err(Error::Failure { .. })));
    for (radius, value) in [(0.0, 1.0), (f64::NAN, 1.0), (1e200, 1.0), (1e-200, 1.0), (1.0, f64::NAN)] {
        assert!(matches!(Scene::new(vec![ball(radius, value)], scalar()), Err(Error::Failure { .. })));
    }
    let scene = neighbourhood_scene(&six, &[1.0; 6], &options).unwrap();
    assert!(matches!(scene.clone().viewed(vec![]), Err(Error::Failure { .. })));
    assert!(matches!(scene.png(10), Err(Error::Failure { .. })));
    let folder = tempfile::tempdir().unwrap();
    assert!(matches!(scene.write(folder.path().join("a.jpg")), Err(Error::Failure { .. })));
    assert!(matches!(scene.write(folder.path().join("missing").join("a.svg")), Err(Error::File { .. })));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    for name in ["a.svg", "a.PNG"] {
        scene.write(folder.path().join(name)).unwrap();
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}
