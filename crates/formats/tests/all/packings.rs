//! Files of spheres: every format gives the same three spheres, and what is wrong or ambiguous is said.

use anisobond_formats::{PackingFormat, PackingOptions, PackingReading, packing_text, parse_packing};
use nalgebra::Vector3;

/// Centres and radii of all samples (m), in a cell of 1 × 2 × 3 m.
const SPHERES: [[f64; 4]; 3] = [[0.25, 0.5, 0.75, 0.125], [0.5, 1.25, 2.5, 0.25], [0.875, 1.75, 0.25, 0.0625]];

fn options(unit: Option<&str>) -> PackingOptions {
    PackingOptions { length_unit: unit.map(String::from), ..PackingOptions::default() }
}

fn read(text: impl AsRef<[u8]>, unit: Option<&str>) -> PackingReading {
    let text = text.as_ref();
    parse_packing(text, &options(unit)).unwrap_or_else(|e| panic!("{e}\n{}", String::from_utf8_lossy(text)))
}

fn message(text: impl AsRef<[u8]>, options: &PackingOptions) -> String {
    match parse_packing(text.as_ref(), options) {
        Ok(reading) => panic!("{} from\n{}", reading.read_as, String::from_utf8_lossy(text.as_ref())),
        Err(e) => e.to_string(),
    }
}

/// Rows of a sample, its lengths `scale` times those in metres; the order of the values and what parts them.
fn rows(scale: f64, row: impl Fn(usize, [f64; 4]) -> String) -> String {
    SPHERES.iter().enumerate().map(|(n, s)| row(n + 1, s.map(|x| x * scale)) + "\n").collect()
}

fn plain(_: usize, [x, y, z, r]: [f64; 4]) -> String {
    format!("{x} {y} {z} {r}")
}

fn comma(text: &str) -> String {
    text.replace('.', ",")
}

#[test]
fn commands_of_pfc() {
    let of = |row: &dyn Fn(usize, [f64; 4]) -> String| format!("; a sample\nmodel new\n{}", rows(1.0, row));
    for text in [
        of(&|n, [x, y, z, r]| format!("ball create id {n} position ({x}, {y}, {z}) radius {r} group 'a'")),
        of(&|n, [x, y, z, r]| format!("BALL ID={n} X={x} Y={y} Z={z} RAD={r}")),
        of(&|n, [x, y, z, r]| format!("ball create radius {r} x {x} y {y} z {z} id {n} ; {n}")),
    ] {
        let reading = read(&text, None);
        same(&reading, false, "pfc");
        assert_eq!(reading.columns[2].column, "id");
        assert_eq!(reading.columns[2].taken_for, "nothing");
        assert_eq!(reading.notes[0], "1 other commands are passed over, the first in line 2");
        assert_eq!(read(text.replace("; a sample", "; in (mm)"), None).packing.radii()[0], 0.125e-3);
        assert!(message(text.replace("0.125", "x"), &options(None)).contains("line 3: \"x\" is not a finite number"));
    }
    assert!(message("ball create id 1 position 1 2 3 density 2600\n", &options(None)).contains("no radius"));
}

/// A dump of one time step; its rows by a function, its box from `low`.
fn dump(step: u64, low: [f64; 3], boundary: &str, columns: &str, rows: &str) -> String {
    let bounds: String = (0..3).map(|a| format!("{} {}\n", low[a], low[a] + [1.0, 2.0, 3.0][a])).collect();
    format!(
        "ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n3\nITEM: BOX BOUNDS {boundary}\n{bounds}ITEM: ATOMS {columns}\n{rows}"
    )
}

fn same(reading: &PackingReading, cell: bool, what: &str) {
    let expected: Vec<_> = SPHERES.iter().map(|s| (Vector3::new(s[0], s[1], s[2]), s[3])).collect();
    let packing = &reading.packing;
    assert_eq!(packing.cell(), cell.then_some(Vector3::new(1.0, 2.0, 3.0)), "{what}");
    for ((x, r), (centre, radius)) in packing.centres().iter().zip(packing.radii()).zip(&expected) {
        assert!((x - centre).norm() < 1e-12 && (r - radius).abs() < 1e-12, "{what}: {x} {r}");
    }
    assert_eq!(packing.len(), 3, "{what}");
}

#[test]
fn every_list_and_table_is_the_same_packing() {
    let four = rows(1.0, plain);
    let csv = |heading: &str, scale: f64, diameter: bool| {
        let row =
            |n: usize, [x, y, z, r]: [f64; 4]| format!("{n},{z},{y},{x},{},a b", if diameter { 2.0 * r } else { r });
        format!("{heading}\n{}", rows(scale, row))
    };
    for (what, text, unit, cell, read_as) in [
        ("bare", four.clone(), None, false, "list of x y z r, lengths in m, for none is named"),
        (
            "woo",
            format!("##PERIODIC:: 1 2 3\n{four}"),
            None,
            true,
            "list of x y z r, the cell in ##PERIODIC::, lengths in m, by the custom of Woo",
        ),
        ("three edges", format!("1 2 3\n{four}"), None, true, "list of x y z r, lengths in m"),
        (
            "yade",
            format!("#format x_y_z_r\n{four}"),
            None,
            false,
            "table with headings, lengths in m, by the custom of Yade",
        ),
        (
            "yade in mm",
            format!("#format x_y_z_r\n{}", rows(1e3, plain)),
            Some("mm"),
            false,
            "lengths in mm, as asked for",
        ),
        (
            "attributes",
            format!("#format x_y_z_r_attrs\n{}", rows(1.0, |n, s| format!("{}\t{n}", plain(n, s)))),
            None,
            false,
            "custom of Yade",
        ),
        ("comment", format!("# x y z r (mm)\n{}", rows(1e3, plain)), None, false, "lengths in mm"),
        ("blanks", format!("x  y  z  r\n{four}"), None, false, "table with headings"),
        ("pfc", format!("id x y z rad\n{}", rows(1.0, |n, s| format!("{n} {}", plain(n, s)))), None, false, "table"),
        (
            "counted",
            rows(1.0, |n, s| format!("{n} {}", plain(n, s))) + "4 0.5 0.5 2.5 0.25\n",
            None,
            false,
            "list of x y z r",
        ),
        ("csv", csv("id,Z,Y,X,Radius,name", 1.0, false), None, false, "table with headings"),
        (
            "csv in mm",
            csv("id,z [mm],y [mm],x [mm],r [mm],name", 1e3, false),
            None,
            false,
            "lengths in mm, as the headings",
        ),
        ("diameters", csv("id,z,y,x,D,name", 1.0, true), None, false, "table"),
        ("sizes", csv("id,z_um,y_um,x_um,size_um,name", 1e6, true), None, false, "lengths in um"),
        ("ParaView", csv("id,Points:2,Points:1,Points:0,radii,name", 1.0, false), None, false, "table"),
        ("quoted", csv("\"id\",\"pos_z\",\"pos_y\",\"pos_x\",\"Diameter\",\"name\"", 1.0, true), None, false, "table"),
        (
            "mark",
            format!("\u{feff}x,y,z,r\n{}", rows(1.0, |_, [x, y, z, r]| format!("{x},{y},{z},{r}"))),
            None,
            false,
            "table",
        ),
        (
            "tabs",
            format!("x\ty\tz\td\n{}", rows(1.0, |_, [x, y, z, r]| format!("{x}\t{y}\t{z}\t{}", 2.0 * r))),
            None,
            false,
            "table",
        ),
        (
            "German",
            format!(
                "sep=;\nx (mm);y (mm);z (mm);Radius (mm)\n{}",
                comma(&rows(1e3, |_, [x, y, z, r]| format!("{x:.1};{y:.1};{z:.1};{r:.1}")))
            ),
            None,
            false,
            "table with headings, decimal commas, lengths in mm",
        ),
        (
            "German blanks",
            comma(&rows(1.0, |_, [x, y, z, r]| format!("{x:.4} {y:.4} {z:.4} {r:.4}"))),
            None,
            false,
            "list of x y z r, decimal commas",
        ),
        (
            "German quotes",
            format!("x,y,z,r\n{}", rows(1.0, |_, s| s.map(|x| format!("\"{}\"", comma(&format!("{x:.4}")))).join(","))),
            None,
            false,
            "table",
        ),
        (
            "cell of a table",
            format!("# cell: 1 2 3\nx,y,z,r\n{}", rows(1.0, |_, [x, y, z, r]| format!("{x},{y},{z},{r}"))),
            None,
            true,
            "table",
        ),
        (
            "titles",
            format!("Sample 7\nmade on a Monday\nx;y;z;r\n{}", rows(1.0, |_, [x, y, z, r]| format!("{x};{y};{z};{r}"))),
            None,
            false,
            "table",
        ),
        ("Fortran", rows(1.0, |_, s| s.map(|x| format!("{x:.4}D+00")).join(" ")), None, false, "list"),
    ] {
        if what == "counted" {
            assert_eq!(read(&text, unit).packing.len(), 4);
            continue;
        }
        let reading = read(&text, unit);
        same(&reading, cell, what);
        assert!(reading.read_as.contains(read_as), "{what}: {}", reading.read_as);
        let taken: Vec<&str> = reading.columns.iter().map(|c| c.taken_for.split(' ').next().unwrap()).collect();
        for role in ["x", "y", "z"] {
            assert_eq!(taken.iter().filter(|t| **t == role).count(), 1, "{what}: {:?}", reading.columns);
        }
        assert_eq!(reading.notes.is_empty(), !reading.read_as.contains("none is named"), "{what}: {:?}", reading.notes);
    }
    let columns = read(csv("id,z [mm],y [mm],x [mm],r [mm],name", 1e3, false), None).columns_in_words();
    assert_eq!(
        columns,
        "z [mm] as z (mm), y [mm] as y (mm), x [mm] as x (mm), r [mm] as radius (mm); not taken: id, name"
    );
}

#[test]
fn dumps_are_read_in_all_their_coordinates() {
    let low = [-1.0, 0.5, 2.0];
    let moved = |[x, y, z, _]: [f64; 4]| [x + low[0], y + low[1], z + low[2]];
    let absolute = |n: usize, s: [f64; 4]| format!("{n} 1 {} {} {} {}", moved(s)[0], moved(s)[1], moved(s)[2], s[3]);
    let scaled = |n: usize, s: [f64; 4]| format!("{n} 1 {} {} {} {}", s[0], s[1] / 2.0, s[2] / 3.0, 2.0 * s[3]);
    let unwrapped =
        |n: usize, s: [f64; 4]| format!("{n} 1 {} {} {} {}", moved(s)[0] + 3.0, moved(s)[1] - 4.0, moved(s)[2], s[3]);
    let reversed = |text: String| text.lines().rev().map(|l| l.to_string() + "\n").collect::<String>();
    for (what, columns, lines, words) in [
        ("x", "id type x y z radius", rows(1.0, absolute), "centres from x y z, radii of their own"),
        ("any order", "id type x y z radius", reversed(rows(1.0, absolute)), "centres from x y z"),
        (
            "xs",
            "id type xs ys zs diameter",
            rows(1.0, scaled),
            "xs ys zs (in shares of the box), diameters of their own",
        ),
        ("xu", "id type xu yu zu radius", rows(1.0, unwrapped), "xu yu zu (unwrapped)"),
    ] {
        let text = dump(1000, low, "pp pp pp", columns, &lines);
        let reading = read(&text, None);
        same(&reading, true, what);
        assert!(
            reading.read_as.starts_with("LAMMPS dump, time step 1000, the only one; periodic box"),
            "{}",
            reading.read_as
        );
        assert!(reading.read_as.contains(words), "{what}: {}", reading.read_as);
        assert_eq!(reading.columns[1].taken_for, "nothing");
        // In the units of LAMMPS' styles.
        let micro = format!("ITEM: UNITS\nmicro\n{text}");
        let small = read(&micro, None);
        assert!(
            (small.packing.radii()[1] / 0.25e-6 - 1.0).abs() < 1e-12 && small.read_as.contains("1e-6 m (units micro)")
        );
        assert!(message(&micro, &options(Some("mm"))).contains("leave out"));
    }
    let text = dump(5, low, "pp pp pp", "id type x y z radius", &rows(1.0, absolute));
    let free = read(text.replace("pp pp pp", "ff ff ff"), None);
    assert_eq!(free.packing.cell(), None);
    let tilted = text.replace("BOX BOUNDS pp pp pp", "BOX BOUNDS xy xz yz pp pp pp").replace("-1 0\n", "-1 0 0.2\n");
    assert!(
        message(&tilted, &options(None))
            .contains("line 5: the box is tilted (triclinic), and the cell of a packing is rectangular")
    );
    assert!(message(text.replace("pp pp pp", "pp pp ff"), &options(None)).contains("periodic along some axes only"));
    assert!(
        message(format!("ITEM: UNITS\nlj\n{text}"), &options(None))
            .contains("have no unit (units lj): the largest radius, 0.25, would be 0.25 m in m and 0.00025 m in mm")
    );
    assert!((read(format!("ITEM: UNITS\nlj\n{text}"), Some("mm")).packing.radii()[1] - 0.25e-3).abs() < 1e-15);
}

#[test]
fn the_last_time_step_is_taken_or_the_one_asked_for() {
    let of = |step: u64, r: f64| {
        dump(
            step,
            [0.0; 3],
            "pp pp pp",
            "id type x y z radius",
            &rows(1.0, |n, [x, y, z, _]| format!("{n} 1 {x} {y} {z} {r}")),
        )
    };
    let all = of(0, 0.1) + &of(500, 0.2) + &of(1000, 0.3);
    let at = |frame: Option<u64>| parse_packing(all.as_bytes(), &PackingOptions { frame, ..PackingOptions::default() });
    assert_eq!(at(None).unwrap().packing.radii()[0], 0.3);
    assert!(at(None).unwrap().read_as.contains("time step 1000, the last of 3"));
    assert_eq!(at(Some(500)).unwrap().packing.radii()[0], 0.2);
    assert!(
        at(Some(7)).unwrap_err().to_string().contains("there is no time step 7 in the dump; it has 0, 500 and 1000")
    );
    let cut = all.lines().take(all.lines().count() - 1).collect::<Vec<_>>().join("\n");
    let said = message(&cut, &options(None));
    assert!(said.contains("3 atoms are announced, 2 listed") && said.contains("frame = \"500\""), "{said}");
    let list = PackingOptions { frame: Some(3), ..PackingOptions::default() };
    assert!(message(rows(1.0, plain), &list).contains("the file has no time steps; leave out"));
}

#[test]
fn atoms_of_types_take_the_radii_that_are_given() {
    let lines = rows(1.0, |n, [x, y, z, _]| format!("{n} {} {x} {y} {z}", 1 + n % 2));
    let dumped = dump(0, [0.0; 3], "pp pp pp", "id type x y z", &lines);
    let data = format!("title\n\n3 atoms\n0 1 xlo xhi\n0 2 ylo yhi\n0 3 zlo zhi\n\nAtoms # atomic\n\n{lines}");
    let given = PackingOptions { type_radii: vec![0.125, 0.25], length_unit: Some("mm".into()), frame: None };
    for text in [dumped, data] {
        let reading = parse_packing(text.as_bytes(), &given).unwrap();
        assert_eq!(reading.packing.radii(), [0.25, 0.125, 0.25], "radii are in m");
        assert!((reading.packing.cell().unwrap() - Vector3::new(1e-3, 2e-3, 3e-3)).norm() < 1e-15);
        assert!(
            reading.read_as.contains("radii by type, as given") && reading.notes[0].contains("wider than the cell")
        );
        assert!(message(&text, &options(None)).contains("type_radii"), "{}", message(&text, &options(None)));
        let few = PackingOptions { type_radii: vec![0.125], ..PackingOptions::default() };
        assert!(message(&text, &few).contains("type \"2\" has no radius among the 1"));
    }
    let unneeded = PackingOptions { type_radii: vec![0.1], ..PackingOptions::default() };
    assert!(message(rows(1.0, plain), &unneeded).contains("the file has the radii of its spheres"));
}

#[test]
fn data_files_of_every_style() {
    let head = |title: &str, style: &str| {
        format!("{title}\n\n3 atoms\n2 atom types\n\n-1 0 xlo xhi\n0 2 ylo yhi\n0 3 zlo zhi\n\nAtoms{style}\n\n")
    };
    let sphere = rows(1.0, |n, [x, y, z, r]| format!("{n} 1 {} 2650 {} {y} {z}", 2.0 * r, x - 1.0));
    let bonded = rows(1.0, |n, [x, y, z, r]| format!("{n} 0 1 {} 2650 {} {y} {z} 0 0 0", 2.0 * r, x - 1.0));
    same(&read(head("LAMMPS data file", " # sphere") + &sphere, None), true, "sphere");
    same(&read(head("LAMMPS data file", "") + &sphere, None), true, "no style");
    let bpm = read(head("LAMMPS data file via write_data, units = si", " # bpm/sphere") + &bonded, None);
    same(&bpm, true, "bpm/sphere");
    assert_eq!(
        bpm.read_as,
        "LAMMPS data, atom style bpm/sphere, the box taken as the periodic cell, lengths in m (units si)"
    );
    assert_eq!(
        bpm.columns_in_words(),
        "diameter as diameter, x as x, y as y, z as z; not taken: id, molecule, type, density"
    );
    let hybrid = message(head("t", " # hybrid sphere bond") + &sphere, &options(None));
    assert!(
        hybrid.contains("line 10: the atom style is \"hybrid sphere bond\"; write the data with one style"),
        "{hybrid}"
    );
    assert!(message(head("t", " # full") + &sphere, &options(None)).contains("\"full\""));
    assert!(
        message(head("t", "") + &bonded, &options(None)).contains("11 entries of an atom, and no atom style is named")
    );
    let lj = head("LAMMPS data file via write_data, timestep = 0, units = lj", " # sphere") + &sphere;
    assert!(message(&lj, &options(None)).contains("units lj"));
}

#[test]
fn lengths_without_a_unit_are_asked_back_where_metres_are_absurd() {
    let large = rows(10.0, plain);
    let said = message(&large, &options(None));
    assert!(
        said.contains("no unit of length is named: the largest radius, 2.5, would be 2.5 m in m and 0.0025 m in mm")
            && said.contains("length_unit = \"mm\""),
        "{said}"
    );
    assert!((read(&large, Some("mm")).packing.radii()[0] - 1.25e-3).abs() < 1e-15);
    assert!(message(&large, &options(Some("GPa"))).contains("a length is needed"));
    let half = "x [mm],y [mm],z [mm],r\n1,2,3,4\n";
    assert!(message(half, &options(None)).contains("\"r\" may have the unit of \"x [mm]\", or metres"));
    let mixed = "x [mm],y [mm],z [mm],r [um]\n1,2,3,4\n";
    assert_eq!(read(mixed, None).packing.radii(), [4e-6]);
    assert!(message(mixed, &options(Some("mm"))).contains("the file is in mm and um, and the unit asked for is mm"));
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    let good = rows(1.0, plain);
    for (what, text, parts) in [
        ("twins", format!("{good}{good}"), &["line 4: the sphere has the same centre as that in line 1"][..]),
        (
            "twins over the border",
            "1 1 1\n0 0.5 0.5 0.1\n1 0.5 0.5 0.2\n".into(),
            &["line 3: the sphere has the same centre as that in line 2"],
        ),
        ("zero", good.replace("0.25\n", "0\n"), &["line 2: the radius of sphere 2 is 0; give positive radii"]),
        ("negative", good.replace("0.25\n", "-0.25\n"), &["line 2: the radius of sphere 2 is -0.25"]),
        ("nan", good.replace("0.5 1.25", "nan 1.25"), &["line 2: \"nan\" is not a finite number"]),
        ("words", good.replace("1.25", "abc"), &["line 2: \"abc\" is not a finite number"]),
        ("short", good.replace(" 0.25\n", "\n"), &["line 2: 3 numbers where x y z r are expected"]),
        ("two cells", format!("1 2 3\n##PERIODIC:: 1 2 3\n{good}"), &["line 2: a second or late cell"]),
        (
            "ids without radii",
            "1 2 3 4\n2 3 4 5\n3 4 5 6\n4 5 6 7\n".into(),
            &["x y z r, or number x y z without a radius"],
        ),
        (
            "five",
            "1.5 2 3 4 5\n".into(),
            &["five numbers per line may be x y z r and one more, or a number before x y z r"],
        ),
        ("both sizes", "x,y,z,r,d\n1,2,3,.1,.3\n".into(), &["line 2: radius and diameter are of two spheres"]),
        (
            "two radii",
            "x,y,z,r,Radius\n1,2,3,.1,.3\n".into(),
            &["line 1: columns \"r\" and \"Radius\" may both be radius"],
        ),
        (
            "no size",
            "x,y,z,mass\n1,2,3,.1\n".into(),
            &["there is no column \"radius\" among \"x\", \"y\", \"z\" and \"mass\""],
        ),
        ("misspelt", "x,y,z,radus\n1,2,3,.1\n".into(), &["is \"radus\" meant?"]),
        ("no z", "x,y,r\n1,2,3\n".into(), &["line 1: there is no column \"z\""]),
        ("stresses", "x (GPa),y,z,r\n1,2,3,4\n".into(), &["column \"x (GPa)\"", "a length is needed"]),
        ("prose", "What a wonderful day.".into(), &["no spheres are found in the file; known are VTK XML"]),
    ] {
        let said = message(text.as_bytes(), &options(None));
        for part in parts {
            assert!(said.contains(part), "{what}: wanted {part:?} in {said:?}");
        }
    }
    assert!(message([0x66, 0xfc, 0x72], &options(None)).contains("line 1: the file is not UTF-8 text"));
    // Outside the cell is a periodic image, and said.
    let outside = read("##PERIODIC:: 1 2 3\n0.5 0.5 0.5 0.1\n1.5 -0.5 3.5 0.1\n", None);
    assert_eq!(outside.packing.centres()[1], Vector3::new(0.5, 1.5, 0.5));
    assert_eq!(
        outside.notes,
        ["1 of 2 centres outside the cell, the first in line 3: it is taken to the periodic image inside"]
    );
}

/// Whatever a file is, it is read to a packing that is written and read back the same, or refused with a message.
#[test]
fn damaged_files_are_read_or_refused() {
    let three = rows(1.0, plain);
    let vtk = "# vtk DataFile Version 3.0\nspheres\nASCII\nDATASET POLYDATA\nPOINTS 2 float\n0 0 0 1 1 1\nPOINT_DATA 2\nSCALARS radius float\nLOOKUP_TABLE default\n.1 .2\n";
    let packing = read(format!("##PERIODIC:: 1 2 3\n{three}"), None).packing;
    let own = |format: PackingFormat| packing_text(&packing, format);
    let samples = [
        dump(7, [0.0; 3], "pp pp pp", "id type x y z radius", &rows(1.0, |n, s| format!("{n} 1 {}", plain(n, s)))),
        format!("#format x_y_z_r\n{three}"),
        "sep=;\nx (mm);y (mm);z (mm);D (mm)\n1,5;2,5;3;1\n".into(),
        "; a sample (mm)\nball create id 1 position (1, 2, 3) radius .1\nball create x 1 y 1 z 1 rad .2\n".into(),
        vtk.into(),
        own(PackingFormat::Text),
        own(PackingFormat::Csv),
        own(PackingFormat::Vtp),
        own(PackingFormat::Lammps),
    ];
    // A fixed series of numbers (Knuth's multiplier).
    let mut state = 20_261_201_u64;
    let mut next = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below.max(1)
    };
    let pieces: [&[u8]; 12] =
        [b"\n", b" ", b",", b";", b"-1", b"nan", b"1e308", b"#", b"ITEM: TIMESTEP\n", b"x", b"999999999999", b"\xff"];
    let mut read = 0;
    for sample in samples.iter().flat_map(|sample| std::iter::repeat_n(sample, 400)) {
        let mut bytes = sample.clone().into_bytes();
        for _ in 0..=next(4) {
            let at = next(bytes.len());
            match next(4) {
                0 => bytes.truncate(at),
                1 => drop(bytes.drain(at..(at + next(20)).min(bytes.len()))),
                2 => drop(bytes.splice(at..at, pieces[next(pieces.len())].iter().copied())),
                _ => bytes.iter_mut().skip(at).take(1).for_each(|b| *b = b"0123456789.- \nxe"[next(16)]),
            }
        }
        match parse_packing(&bytes, &options(None)) {
            Ok(reading) => {
                read += 1;
                for format in [PackingFormat::Text, PackingFormat::Csv, PackingFormat::Vtp, PackingFormat::Lammps] {
                    let written = packing_text(&reading.packing, format);
                    let again = parse_packing(written.as_bytes(), &options(None));
                    assert_eq!(again.expect("what we write is read").packing, reading.packing, "{written}");
                }
            }
            Err(e) => assert!(e.to_string().contains("; "), "{e}"),
        }
    }
    assert!((100..3000).contains(&read), "{read} of 3600 are read");
}
