//! Packings: contacts, statistics, generation and files.

use crate::common;

use std::f64::consts::PI;

use anisobond::Error;
use anisobond::lattice::generate::{
    Crystal, Extent, Generated, Outcome, Progress, Radii, RandomPacking, Share, Target, crystal, random,
    random_observed,
};
use anisobond::lattice::{Contact, Lattice, Packing, contacts, naive_contacts};
use anisobond_formats::{PackingFormat, PackingOptions, packing_text, read_packing, write_packing};
use common::{Random, shared_data};
use nalgebra::Vector3;
use proptest::prelude::*;

fn packing(seed: u64, number: usize, cell: Option<[f64; 3]>, spread: f64) -> Packing {
    let mut random = Random(seed);
    let centres = (0..number).map(|_| Vector3::from_fn(|_, _| 3.0 * random.number())).collect();
    let radii = (0..number).map(|_| 0.3 * spread.powf(random.number())).collect();
    Packing::new(cell.map(Vector3::from), centres, radii).unwrap()
}

/// Length, and which spheres, of every contact, sorted: what does not depend on images or numbers.
fn shapes(contacts: &[Contact], name: impl Fn(u32) -> u32) -> Vec<(u32, u32, f64)> {
    let mut shapes: Vec<_> =
        contacts.iter().map(|c| (name(c.a).min(name(c.b)), name(c.a).max(name(c.b)), c.branch.norm())).collect();
    shapes.sort_by(|a, b| a.partial_cmp(b).unwrap());
    shapes
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(300) })]

    /// The same contacts in the same order, to the last bit; edges of the cell may be far below the search radius.
    #[test]
    fn the_cell_list_finds_what_the_naive_search_finds(
        seed in any::<u64>(), number in 1usize..60, periodic in any::<bool>(),
        edges in [0.2f64..6.0, 0.5f64..6.0, 0.2f64..6.0], spread in 1f64..20.0, contact_radius in 0.3f64..2.2,
    ) {
        let packing = packing(seed, number, periodic.then_some(edges), spread.powf(0.5));
        let naive = naive_contacts(&packing, contact_radius).unwrap();
        prop_assert_eq!(contacts(&packing, contact_radius).unwrap(), naive);
    }

    #[test]
    fn translation_images_and_numbering_do_not_matter(
        seed in any::<u64>(), number in 2usize..40, edges in [1f64..5.0, 1f64..5.0, 1f64..5.0], contact_radius in 0.8f64..2.0,
    ) {
        let given = packing(seed, number, Some(edges), 2.0);
        let expected = shapes(&contacts(&given, contact_radius).unwrap(), |i| i);
        let edges = Vector3::from(edges);
        let mut random = Random(seed ^ 1);
        let moved: Vec<_> = given.centres().iter().map(|x| {
            let image = Vector3::from_fn(|_, _| (3.0 * random.number()).round());
            x + Vector3::new(0.3, -7.1, 1e2) + edges.component_mul(&image)
        }).collect();
        let last = number as u32 - 1;
        let reversed = Packing::new(
            Some(edges), moved.into_iter().rev().collect(), given.radii().iter().rev().copied().collect(),
        ).unwrap();
        let found = shapes(&contacts(&reversed, contact_radius).unwrap(), |i| last - i);
        prop_assert_eq!(found.len(), expected.len());
        for (f, e) in found.iter().zip(&expected) {
            prop_assert!((f.0, f.1) == (e.0, e.1) && (f.2 - e.2).abs() < 1e-11, "{:?} {:?}", f, e);
        }
    }
}

/// S, I_R = 1.8: 28 678 contacts, 22.44 per sphere, porosity 0.478.
#[test]
fn the_document_s_packing() {
    let Some(text) = shared_data("woo-packing-2556.txt") else { return };
    let packing = parse_packing(&text).unwrap();
    assert_eq!(packing.cell(), Some(Vector3::repeat(0.821373)));
    let lattice = Lattice::new(packing, 1.8).unwrap();
    assert_eq!(lattice.contacts, naive_contacts(&lattice.packing, 1.8).unwrap());
    let s = lattice.statistics().unwrap();
    assert_eq!((s.number, s.contacts), (2556, 28_678));
    assert!((s.coordination.mean - 22.44).abs() < 0.005 && (s.porosity.unwrap() - 0.478).abs() < 5e-4);
    assert!(s.fabric_deviation < 0.02, "{}", s.fabric_deviation);
}

/// The packing of a text, of which nothing else is known.
fn parse_packing(text: &str) -> anisobond::Result<Packing> {
    anisobond_formats::parse_packing(text.as_bytes(), &PackingOptions::default()).map(|reading| reading.packing)
}

const FORMATS: [PackingFormat; 4] =
    [PackingFormat::Text, PackingFormat::Csv, PackingFormat::Vtp, PackingFormat::Lammps];

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(100) })]

    #[test]
    fn files_read_back_to_the_same_bits(
        seed in any::<u64>(), number in 1usize..30, periodic in any::<bool>(), edges in [1e-9f64..1e9, 0.3f64..3.0, 0.3f64..3.0],
    ) {
        let packing = packing(seed, number, periodic.then_some(edges), 10.0);
        for format in FORMATS {
            prop_assert_eq!(&parse_packing(&packing_text(&packing, format)).unwrap(), &packing);
        }
    }

    #[test]
    fn no_text_panics(text in "(##PERIODIC::|# cell:|x,y,z,r|<VTKFile>|Atoms|atoms|xlo|[-0-9.einfa#,; \\n<>/]){0,40}", junk in "\\PC{0,60}") {
        let _ = parse_packing(&text);
        let _ = parse_packing(&junk);
        for format in FORMATS {
            // A good file with something in its midst.
            let good = packing_text(&packing(1, 3, Some([1.0; 3]), 2.0), format);
            let middle = (0..=good.len() / 2).rev().find(|&i| good.is_char_boundary(i)).unwrap();
            let _ = parse_packing(&format!("{}{text}{}", &good[..middle], &good[middle..]));
        }
    }

    /// Contact search of anything that can be read.
    #[test]
    fn extreme_packings_do_not_panic(
        numbers in prop::collection::vec(-1e3f64..1e3, 8), powers in prop::collection::vec(prop_oneof![-300i32..300, -3i32..3], 11), contact_radius in 0.1f64..10.0,
    ) {
        let scaled = |i: usize| numbers[i % 8] * 10f64.powi(powers[i]);
        let cell = Vector3::new(scaled(8).abs(), scaled(9).abs(), scaled(10).abs());
        let centres = vec![Vector3::new(scaled(0), scaled(1), scaled(2)), Vector3::new(scaled(3), scaled(4), scaled(5))];
        for cell in [None, Some(cell)] {
            if let Ok(packing) = Packing::new(cell, centres.clone(), vec![scaled(6).abs(), scaled(7).abs()])
                && packing.volume().is_none_or(|v| v > 0.0)
            {
                let _ = packing.statistics(contact_radius);
            }
        }
    }
}

/// Contacts per sphere at I_R = 1 and beyond the second shell, and porosity, of the closed forms.
#[test]
fn crystals_match_their_closed_forms() {
    let close_packed = 1.0 - PI / 18f64.sqrt();
    for (kind, touching, wide, second_shell, porosity) in [
        (Crystal::Sc, 6, 2f64.sqrt(), 18, 1.0 - PI / 6.0),
        (Crystal::Bcc, 8, 4.0 / 12f64.sqrt(), 14, 1.0 - 3f64.sqrt() * PI / 8.0),
        (Crystal::Fcc, 12, 2f64.sqrt(), 18, close_packed),
        (Crystal::Hcp, 12, 2f64.sqrt(), 18, close_packed),
    ] {
        // Down to a single unit cell, smaller than the search radius.
        for cells in [[1, 1, 1], [3, 2, 1], [4, 4, 4]] {
            let packing = crystal(kind, 0.03, cells, 0.0, 0).unwrap();
            assert_eq!(contacts(&packing, 1.5).unwrap(), naive_contacts(&packing, 1.5).unwrap());
            for (contact_radius, count) in [
                (0.9999, 0),
                (1.0, touching),
                (1.0001, touching),
                (0.9999 * wide, touching),
                (wide, second_shell),
                (1.0001 * wide, second_shell),
            ] {
                let s = packing.statistics(contact_radius).unwrap();
                let count = f64::from(count);
                assert_eq!(
                    (s.coordination.least, s.coordination.most),
                    (count, count),
                    "{kind:?} {cells:?} {contact_radius}"
                );
                assert!((s.porosity.unwrap() - porosity).abs() < 1e-12);
                assert!(s.largest_overlap < 1e-12);
                if kind != Crystal::Hcp && count > 0.0 {
                    assert!(s.fabric_deviation < 1e-12, "cubic symmetry");
                }
            }
        }
    }
    // Touching contacts of hcp: six in the plane, three above and three below at n_z² = 2/3; ⟨n_z²⟩ = 1/3.
    let hcp = Lattice::new(crystal(Crystal::Hcp, 1.0, [2, 2, 2], 0.0, 0).unwrap(), 1.0).unwrap();
    assert!(hcp.statistics().unwrap().fabric_deviation < 1e-12);
    assert_eq!(
        crystal(Crystal::Fcc, 1.0, [2, 2, 2], 0.1, 5).unwrap(),
        crystal(Crystal::Fcc, 1.0, [2, 2, 2], 0.1, 5).unwrap()
    );
    assert!(crystal(Crystal::Fcc, 1.0, [2, 2, 2], 0.1, 5).unwrap().statistics(1.0).unwrap().largest_overlap > 1e-3);
    for wrong in [
        crystal(Crystal::Sc, 0.0, [1; 3], 0.0, 0),
        crystal(Crystal::Sc, 1.0, [0, 1, 1], 0.0, 0),
        crystal(Crystal::Sc, 1.0, [1; 3], f64::NAN, 0),
    ] {
        assert!(matches!(wrong, Err(Error::Failure { .. })));
    }
}

/// Two spheres and one: by hand.
#[test]
fn small_packings_by_hand() {
    // One sphere of radius 1 in a cell of edge 3: its six images at distance 3 touch at I_R = 1.5.
    let one = Packing::new(Some(Vector3::repeat(3.0)), vec![Vector3::zeros()], vec![1.0]).unwrap();
    let s = one.statistics(1.5).unwrap();
    assert_eq!((s.contacts, s.coordination.mean, s.floaters), (3, 6.0, 0));
    assert_eq!(s.coordination_histogram, [0, 0, 0, 0, 0, 0, 1]);
    assert!((s.porosity.unwrap() - (1.0 - 4.0 / 3.0 * PI / 27.0)).abs() < 1e-15);
    // A free pair along z that overlaps by a tenth.
    let pair = Packing::new(None, vec![Vector3::zeros(), Vector3::new(0.0, 0.0, 1.8)], vec![1.0, 1.0]).unwrap();
    for contact_radius in [0.5, 1.0] {
        assert!((pair.statistics(contact_radius).unwrap().largest_overlap - 0.1).abs() < 1e-15);
    }
    let lattice = Lattice::free(pair.clone(), 1.0, 8.0).unwrap();
    let s = lattice.statistics().unwrap();
    assert_eq!((s.porosity, s.contacts, s.floaters), (None, 1, 2));
    assert_eq!(s.fabric, [[0.0; 3], [0.0; 3], [0.0, 0.0, 1.0]]);
    assert!((s.fabric_deviation - 1.0).abs() < 1e-15);
    assert_eq!((lattice.coordination(), lattice.floaters(1), lattice.floaters(2)), (vec![1, 1], vec![], vec![0, 1]));
    assert!(Lattice::free(pair.clone(), 1.0, 0.0).is_err() && Lattice::free(one, 1.0, 1.0).is_err());
    let message = Lattice::new(pair, 1.0).unwrap_err().to_string();
    assert!(message.contains("no periodic cell") && message.contains("##PERIODIC::"), "{message}");
}

#[test]
fn coincident_spheres_are_named() {
    let cell = Some(Vector3::repeat(1.0));
    let centres = vec![Vector3::repeat(0.5), Vector3::repeat(0.1), Vector3::repeat(1.1)];
    let packing = Packing::new(cell, centres, vec![0.1; 3]).unwrap();
    let message = Lattice::new(packing, 1.0).unwrap_err().to_string();
    assert!(message.contains("spheres 2 and 3 have the same centre"), "{message}");
    let far = Packing::new(cell, vec![Vector3::zeros()], vec![1e3]).unwrap();
    assert!(Lattice::new(far, 1.8).unwrap_err().to_string().contains("reduce the contact radius"));
    let plain = Packing::new(cell, vec![Vector3::zeros()], vec![0.1]).unwrap();
    for contact_radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(Lattice::new(plain.clone(), contact_radius).is_err());
    }
}

#[test]
fn threads_do_not_change_contacts() {
    let packing = packing(4, 3000, Some([6.0, 5.0, 4.0]), 3.0);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| contacts(&packing, 1.2).unwrap())
    };
    assert_eq!(with(1), with(3));
}

fn wanted(number: usize, target: Target) -> RandomPacking {
    RandomPacking {
        extent: Extent::Number(number),
        radii: Radii::Uniform { radius: 0.03 },
        target,
        contact_radius: 1.8,
        seed: 7,
    }
}

/// No overlap at all, near-isotropic contacts, and a report that tells the truth.
fn checked(made: &Generated) {
    let s = &made.report.statistics;
    assert_eq!(s, &made.packing.statistics(s.contact_radius).unwrap());
    assert_eq!(s.largest_overlap, 0.0);
    assert!(s.fabric_deviation < 1.0 / (s.contacts as f64).sqrt() * 4.0, "{} of {}", s.fabric_deviation, s.contacts);
}

#[test]
fn random_packings_reach_their_porosity() {
    for porosity in [0.9, 0.6, 0.478, 0.42] {
        let made = random(&wanted(600, Target::Porosity(porosity))).unwrap();
        checked(&made);
        assert_eq!((made.report.outcome, made.report.trials, made.packing.len()), (Outcome::Reached, 1, 600));
        assert!((made.packing.porosity().unwrap() - porosity).abs() < 1e-12);
    }
}

#[test]
fn random_packings_reach_their_coordination() {
    for (coordination, contact_radius) in [(22.44, 1.8), (6.0, 1.2), (40.0, 2.2)] {
        let asked = RandomPacking { contact_radius, ..wanted(600, Target::Coordination(coordination)) };
        let made = random(&asked).unwrap();
        checked(&made);
        assert_eq!(made.report.outcome, Outcome::Reached, "{}", made.report.message);
        assert!((made.report.statistics.coordination.mean / coordination - 1.0).abs() <= 0.005);
    }
    let made = random(&wanted(300, Target::Coordination(60.0))).unwrap();
    checked(&made);
    assert_eq!(made.report.outcome, Outcome::Jammed, "{:?}", made.report);
    assert!(made.report.message.contains("jam"));
}

#[test]
fn targets_beyond_jamming_give_the_densest_found() {
    let made = random(&wanted(300, Target::Porosity(0.3))).unwrap();
    checked(&made);
    assert_eq!(made.report.outcome, Outcome::Jammed);
    let porosity = made.packing.porosity().unwrap();
    assert!((0.35..0.41).contains(&porosity), "{porosity}");
    assert!(made.report.message.contains("not reached"));
}

#[test]
fn seeds_reproduce_bits_on_any_number_of_threads() {
    let asked = RandomPacking {
        radii: Radii::LogNormal { median: 0.03, deviation: 0.4, least: 0.01, most: 0.1 },
        ..wanted(1500, Target::Porosity(0.45))
    };
    let with = |threads, asked: &RandomPacking| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| random(asked).unwrap())
    };
    let (one, two) = (with(1, &asked), with(2, &asked));
    checked(&one);
    assert_eq!((&one.packing, &one.report), (&two.packing, &two.report));
    let other = random(&RandomPacking { seed: 8, ..asked }).unwrap();
    assert_ne!(one.packing, other.packing);
}

/// The drawn radii keep to their distribution; a cell is kept as given.
#[test]
fn radii_and_cells_are_as_wanted() {
    let cell = Extent::Cell([0.9, 0.6, 1.2]);
    let asked = |radii| RandomPacking { extent: cell, radii, ..wanted(1, Target::Porosity(0.5)) };
    let made = |radii| {
        let made = random(&asked(radii)).unwrap();
        checked(&made);
        assert_eq!(made.report.outcome, Outcome::Reached);
        assert_eq!(made.packing.cell(), Some(Vector3::new(0.9, 0.6, 1.2)));
        assert!((made.packing.porosity().unwrap() - 0.5).abs() < 2e-3);
        made.packing
    };
    let fuzzy = made(Radii::Fuzzy { mean: 0.03, fuzz: 0.3 });
    assert!(fuzzy.radii().iter().all(|r| (0.021..=0.039).contains(r)));
    let clipped = made(Radii::LogNormal { median: 0.03, deviation: 0.5, least: 0.02, most: 0.05 });
    assert!(clipped.radii().iter().all(|r| (0.02..=0.05).contains(r)));
    let median = {
        let mut r = clipped.radii().to_vec();
        r.sort_by(f64::total_cmp);
        r[r.len() / 2]
    };
    assert!((median - 0.03).abs() < 2e-3, "{median}");
    let rows = vec![(0.02, 0.5), (0.04, 0.5)];
    // Equal volumes: eight small spheres for a large one.
    for (share, large) in [(Share::Number, 0.5), (Share::Volume, 1.0 / 9.0)] {
        let packing = made(Radii::Table { rows: rows.clone(), share });
        let count = packing.radii().iter().filter(|r| **r == 0.04).count() as f64 / packing.len() as f64;
        assert!((count - large).abs() < 0.05, "{count} {large}");
    }
}

#[test]
fn wrong_wishes_are_refused() {
    let good = wanted(100, Target::Porosity(0.5));
    let radii = |radii| RandomPacking { radii, ..good.clone() };
    let wrong = [
        wanted(0, Target::Porosity(0.5)),
        wanted(usize::MAX, Target::Porosity(0.5)),
        wanted(100, Target::Porosity(0.0)),
        wanted(100, Target::Porosity(f64::NAN)),
        wanted(100, Target::Porosity(0.2)),
        wanted(100, Target::Coordination(-1.0)),
        RandomPacking { contact_radius: 1.0, ..wanted(100, Target::Coordination(6.0)) },
        RandomPacking { contact_radius: 0.0, ..good.clone() },
        RandomPacking { extent: Extent::Cell([1.0, 0.0, 1.0]), ..good.clone() },
        RandomPacking { extent: Extent::Cell([1.0, 0.05, 1.0]), ..good.clone() },
        RandomPacking { extent: Extent::Cell([1e9; 3]), ..good.clone() },
        radii(Radii::Uniform { radius: -0.1 }),
        radii(Radii::Fuzzy { mean: 1.0, fuzz: 1.0 }),
        radii(Radii::LogNormal { median: 1.0, deviation: 9.0, least: 0.999_999_9, most: 1.0 }),
        radii(Radii::LogNormal { median: 1.0, deviation: 0.1, least: 2.0, most: 3.0 }),
        radii(Radii::Table { rows: vec![], share: Share::Number }),
        radii(Radii::Table { rows: vec![(1.0, -1.0)], share: Share::Volume }),
    ];
    for asked in wrong {
        assert!(matches!(random(&asked), Err(Error::Failure { .. })), "{asked:?}");
    }
    // A single sphere is a packing, if a poor one; its own images touch at a porosity of 1 − π/6.
    assert_eq!(random(&wanted(1, Target::Porosity(0.6))).unwrap().report.outcome, Outcome::Reached);
    assert_eq!(random(&wanted(1, Target::Porosity(0.4))).unwrap().report.outcome, Outcome::Jammed);
}

#[test]
fn messages_name_line_and_remedy() {
    for (content, expected) in [
        ("", "the file is empty"),
        ("1 1 1\n", "the packing has no sphere"),
        ("1 1 1\n0 0 0 0.1\n0.5 0.5 0.5\n", "line 3: 3 numbers where x y z r are expected; write one sphere per line"),
        ("1 1 1\n0 0 0 NaN\n", "line 2: \"NaN\" is not a finite number"),
        ("1 1 1\n0 0 0 0\n", "line 2: the radius of sphere 1 is 0; give positive radii"),
        ("1 1 1\n0 0 0 -0.1\n", "line 2: the radius of sphere 1 is -0.1"),
        ("##PERIODIC:: 1 1\n0 0 0 1\n", "line 1: the cell has 2 numbers; give the three edges"),
        ("##PERIODIC:: 1 0 1\n0 0 0 1\n", "line 1: the cell's edges are 1 0 1"),
        ("0 0 0 1\n##PERIODIC:: 1 1 1\n", "line 2: a second or late cell"),
        ("x,y,r\n", "line 1: there is no column \"z\" among"),
        ("x,y,z,r\n1,2,3\n", "line 2: 3 entries for 4 columns"),
        ("x,y,z,r\n1,2,3,inf\n", "line 2, column r: \"inf\" is not a finite number"),
        (
            "t\n1 atoms\n0 1 xlo xhi\n0 1 ylo yhi\nAtoms # sphere\n\n1 1 0.1 1 0 0 0\n",
            "the bounds of the box are missing",
        ),
        ("t\n2 atoms\nAtoms # sphere\n\n1 1 0.1 1 0 0 0\n", "2 atoms are announced, 1 listed"),
        ("t\nAtoms # full\n", "line 2: the atom style is \"full\""),
        ("t\n1 atoms\n0 0.1 0 xy xz yz\n", "line 3: the box is tilted"),
        ("t\nAtoms\n1 1 0.1 1 0 0\n", "line 3: 6 entries of an atom"),
        ("<a", "the file is not XML"),
        ("<VTKFile type=\"ImageData\"/>", "the file is not VTK PolyData"),
        ("<VTKFile type=\"PolyData\"/>", "there is no array Points"),
    ] {
        let message = parse_packing(content).unwrap_err().to_string();
        assert!(message.starts_with(expected), "{message}");
    }
}

#[test]
fn files_are_written_by_their_ending() {
    let folder = tempfile::tempdir().unwrap();
    let packing = packing(2, 20, Some([1.0, 2.0, 3.0]), 2.0);
    for name in ["a.txt", "a.csv", "a.vtp", "a.data", "a.LMP"] {
        let path = folder.path().join(name);
        write_packing(&path, &packing).unwrap();
        assert_eq!(read_packing(&path).unwrap(), packing);
    }
    let message = write_packing(folder.path().join("a.cvs"), &packing).unwrap_err().to_string();
    assert!(message.contains("did you mean csv?"), "{message}");
    assert!(matches!(read_packing(folder.path().join("none.txt")), Err(Error::File { action: "read", .. })));
    std::fs::write(folder.path().join("bad.txt"), "1 1 1\n0 0 0\n").unwrap();
    let message = read_packing(folder.path().join("bad.txt")).unwrap_err().to_string();
    assert!(message.contains("bad.txt, line 2"), "{message}");
}

/// What other programs write: comments, commas, a shifted box, images, any order, positions outside the cell.
#[test]
fn foreign_files_are_read() {
    let text = "1, 2, 3 # the cell\n# a comment\n\n0.1, 0.2, 0.3, 0.05\n1.5;-0.5;3;0.1 # outside\n";
    let packing = parse_packing(text).unwrap();
    assert_eq!(packing.cell(), Some(Vector3::new(1.0, 2.0, 3.0)));
    assert_eq!(packing.centres()[1], Vector3::new(0.5, 1.5, 0.0));
    let csv = "\u{feff}# cell: 1 1 1\n\"id\";Radius;Z;Y;X\n7;0.1;0.3;0.2;0.1\n";
    let packing = parse_packing(csv).unwrap();
    assert_eq!((packing.centres()[0], packing.radii()[0]), (Vector3::new(0.1, 0.2, 0.3), 0.1));
    let lammps = "LAMMPS data file\n\n2 atoms\n1 atom types\n\n-1 1 xlo xhi\n0 1 ylo yhi\n0 1 zlo zhi\n0 0 0 xy xz yz\n\nAtoms # sphere\n\n2 1 0.2 1 0 0.5 0.5 0 0 1\n1 1 0.4 1 -1 0 0 0 0 0\n\nVelocities\n\n1 0 0 0 0 0 0\n";
    let packing = parse_packing(lammps).unwrap();
    assert_eq!((packing.cell(), packing.radii()), (Some(Vector3::new(2.0, 1.0, 1.0)), &[0.2, 0.1][..]));
    assert_eq!(packing.centres()[1], Vector3::new(1.0, 0.5, 0.5));
}

#[test]
fn generation_is_observed_and_can_be_stopped() {
    use std::ops::ControlFlow;
    let asked = wanted(200, Target::Porosity(0.5));
    let mut heard = Vec::new();
    let mut listen = |p: &Progress| {
        heard.push(*p);
        ControlFlow::Continue(())
    };
    let made = random_observed(&asked, &mut listen).unwrap();
    assert_eq!(made.packing, random(&asked).unwrap().packing);
    assert_eq!(heard.len() + 1, made.report.iterations);
    assert!(heard.iter().enumerate().all(|(i, p)| (p.trial, p.iterations, p.porosity) == (1, i + 1, 0.5)));
    let mut stop = |p: &Progress| if p.iterations < 3 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) };
    assert!(matches!(random_observed(&asked, &mut stop), Err(Error::Interrupted { .. })));
}
