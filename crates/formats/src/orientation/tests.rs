//! Tests of the module.

use super::*;

fn close(a: &Matrix3<f64>, b: &Matrix3<f64>) -> bool {
    (a - b).amax() < 1e-14
}

#[test]
fn every_form_is_orthogonal_and_both_spellings_agree() {
    for (text, table) in [
        ("bunge:10,20,30", "{ bunge = [10, 20, 30] }"),
        ("axis:0,0,2,60", "{ axis = [0, 0, 2], angle = 60 }"),
        ("axis:1,-1,2,0.5 rad", "{ axis = [1, -1, 2], angle = \"0.5 rad\" }"),
        ("strike-dip:270,25", "{ strike = 270, dip = \"25 deg\" }"),
        ("xz:1,0,0,0,0,1", "{ x = [1, 0, 0], z = [0, 0, 1] }"),
        ("xyz:30", "{ xyz = [30, 30, 30] }"),
        ("xyz:30,20,10", "\"xyz: 30, 20, 10\""),
        ("prakash:30,20,10", "{ prakash = [30, 20, 10] }"),
        ("mirror:1,2,2", "{ mirror = [1, 2, 2] }"),
        ("matrix:0,-1,0,1,0,0,0,0,1", "{ matrix = [[0, -1, 0], [1, 0, 0], [0, 0, 1]] }"),
    ] {
        let q = parse_orientation(text).unwrap();
        assert!(close(&(q * q.transpose()), &Matrix3::identity()), "{text}");
        let tree = super::super::tree::parse_toml(&format!("o = {table}"), "f").unwrap();
        let same = orientation_of(&tree.get("o").unwrap().value, "o").unwrap();
        assert!(close(&q, &same), "{text}");
    }
}

/// Bunge's g as every textbook prints it (passive, sample → crystal); Q is its transpose.
#[test]
fn bunge_is_the_transpose_of_the_textbook_matrix() {
    let (a, b, c) = (0.3_f64, 0.7_f64, -1.1_f64);
    let ((s1, c1), (s, co), (s2, c2)) = (a.sin_cos(), b.sin_cos(), c.sin_cos());
    let g = Matrix3::new(
        c1 * c2 - s1 * s2 * co,
        s1 * c2 + c1 * s2 * co,
        s2 * s,
        -c1 * s2 - s1 * c2 * co,
        -s1 * s2 + c1 * c2 * co,
        c2 * s,
        s1 * s,
        -c1 * s,
        co,
    );
    assert!(close(&Orientation::Bunge([a, b, c]).matrix().unwrap(), &g.transpose()));
}

#[test]
fn strike_and_dip_take_e3_to_the_axis_by_the_smallest_rotation() {
    for (strike, dip) in [(270.0_f64, 25.0_f64), (10.0, 0.0), (123.0, 90.0), (40.0, 170.0)] {
        let (alpha, beta) = (strike.to_radians(), dip.to_radians());
        let a = Vector3::new(alpha.cos() * beta.sin(), -alpha.sin() * beta.sin(), beta.cos());
        let q = Orientation::StrikeDip { strike: alpha, dip: beta }.matrix().unwrap();
        assert!((q * Vector3::z() - a).norm() < 1e-15);
        assert!((q - smallest_rotation(&a).unwrap()).amax() < 1e-13);
    }
}

#[test]
fn smallest_rotation_at_its_poles() {
    assert_eq!(smallest_rotation(&Vector3::new(0.0, 0.0, 3.0)).unwrap(), Matrix3::identity());
    for a in [Vector3::new(0.0, 0.0, -2.0), Vector3::new(1e-9, -1e-9, -1.0), Vector3::new(0.0, 1e-300, 1e300)] {
        let q = smallest_rotation(&a).unwrap();
        assert!((q * Vector3::z() - a / a.amax()).norm() < 1e-8);
        assert!((q.determinant() - 1.0).abs() < 1e-15);
    }
}

/// R_x R_y R_z (P eq 103): equal turns by π are the identity, by π/2 they are not (erratum of P).
#[test]
fn the_documents_turns() {
    assert!(close(&parse_orientation("prakash:180").unwrap(), &Matrix3::identity()));
    let quarter_turn_about_y = Matrix3::new(0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0);
    assert!(close(&parse_orientation("prakash:90").unwrap(), &quarter_turn_about_y));
}

/// Each angle alone turns right-handed about its own axis, x to y to z to x; together they are nalgebra's turns in this order.
#[test]
fn xyz_turns_right_handed_about_each_axis() {
    let axes = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
    for (k, axis) in axes.into_iter().enumerate() {
        let angles: Vec<&str> = (0..3).map(|n| if n == k { "90" } else { "0" }).collect();
        let q = parse_orientation(&format!("xyz:{}", angles.join(","))).unwrap();
        let (next, last) = (axes[(k + 1) % 3].into_inner(), axes[(k + 2) % 3].into_inner());
        assert!((q * next - last).norm() < 1e-15, "{axis:?}");
    }
    let [a, b, c] = [30.0f64, 20.0, 10.0].map(f64::to_radians);
    let turns = [(0, a), (1, b), (2, c)].map(|(k, angle)| Rotation3::from_axis_angle(&axes[k], angle));
    let expected = turns[0] * turns[1] * turns[2];
    assert!(close(&parse_orientation("xyz:30,20,10").unwrap(), expected.matrix()));
    assert!(!close(&parse_orientation("prakash:30,20,10").unwrap(), expected.matrix()));
}

#[test]
fn nearly_orthogonal_matrices_are_polished() {
    let q = parse_orientation("matrix:0.6,-0.8000003,0,0.8,0.6,0,0,0,1").unwrap();
    assert!(close(&(q * q.transpose()), &Matrix3::identity()));
}

#[test]
fn refusals() {
    for (text, part) in [
        ("bunge", "forms are bunge, axis"),
        ("bungee:1,2,3", "did you mean bunge?"),
        ("bunge:1,2", "3 numbers are needed, not 2"),
        ("bunge:1,2,x", "\"x\" is not a finite number"),
        ("bunge:1,2,3 mm", "is a unit of a length"),
        ("axis:0,0,0,30", "length zero"),
        ("axis:0,0,1 m,30", "after a plain number"),
        ("xz:1,0,0,1,0,0", "0.000° apart"),
        ("xz:1,0,0.002,0,0,1", "89.885° apart"),
        ("matrix:1,0,0,0,1,0,0,0,1.1", "not orthogonal"),
        ("matrix:1e300,0,0,0,1,0,0,0,1", "not orthogonal"),
        ("mirror:nan,0,1", "not a finite number"),
    ] {
        let message = parse_orientation(text).unwrap_err().to_string();
        assert!(message.contains(part), "{text}: {message}");
    }
    for (table, part) in [
        ("{ bunge = [1, 2, 3], mirror = [1, 0, 0] }", "line 1, o: bunge and mirror are two orientations"),
        ("{ axis = [0, 0, 1] }", "angle is missing; give axis and angle"),
        ("{ strik = 1 }", "unknown key \"strik\"; did you mean strike?"),
        ("{ bunge = [1, 2] }", "line 1, o.bunge: 3 numbers are needed, not 2"),
        ("{ bunge = [1, 2, true] }", "a number is needed, not a truth value"),
        ("{ bunge = [1, 2, inf] }", "inf is not finite"),
        ("{}", "not an empty table"),
        ("3", "an orientation is needed, not 3"),
    ] {
        let tree = super::super::tree::parse_toml(&format!("o = {table}"), "f").unwrap();
        let message = orientation_of(&tree.get("o").unwrap().value, "o").unwrap_err().to_string();
        assert!(message.contains(part), "{table}: {message}");
    }
}
