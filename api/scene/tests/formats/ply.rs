//! PLY files of both layouts.

use gaurast_runner::data;
use gaurast_scene::{Place, Reason, SceneError};

use super::support::*;

#[gaurast_runner::test]
fn ply_values_in_every_encoding_degree_and_order() {
    for degree in 0..=4 {
        let (properties, rows) = distinct(degree, 3);
        let rest_per_channel = (degree + 1).pow(2) - 1;
        for encoding in [Encoding::Ascii, Encoding::Little, Encoding::Big] {
            let scene = read("a.ply", &ply(encoding, &properties, &rows)).expect("a good file");
            assert_eq!((scene.len(), scene.sh_degree()), (3, degree as u32));
            for (i, row) in rows.iter().enumerate() {
                assert_eq!(scene.positions()[i][..], row[..3]);
                let shape = scene.shapes()[i];
                for axis in 0..3 {
                    let expected = f64::from(row[3 + axis]).exp() as f32;
                    assert_eq!(shape.scale[axis], expected);
                }
                assert_eq!(shape.rotation[..], row[6..10]);
                let expected = 1.0 / (1.0 + (-f64::from(row[10])).exp());
                assert_eq!(shape.opacity, expected as f32);
                let sh = &scene.sh()[i * scene.sh_stride()..][..scene.sh_stride()];
                assert_eq!(sh[0][..], row[11..14]);
                for (k, rgb) in sh[1..].iter().enumerate() {
                    for (channel, value) in rgb.iter().enumerate() {
                        assert_eq!(*value, row[14 + channel * rest_per_channel + k]);
                    }
                }
            }
            // The same columns in another order, with an unknown one among them.
            let reversed: Vec<String> = properties.iter().rev().cloned().chain(["nx".to_owned()]).collect();
            let rows: Vec<Vec<f32>> = rows.iter().map(|row| row.iter().rev().copied().chain([9.0]).collect()).collect();
            let other = read("a.ply", &ply(encoding, &reversed, &rows)).expect("a good file");
            assert_eq!(scene, other, "{encoding:?}, degree {degree}");
        }
    }
}

#[gaurast_runner::test]
fn ply_keeps_non_finite_values_and_passes_over_other_elements() {
    let (properties, mut rows) = distinct(0, 2);
    rows[0][0] = f32::NAN;
    rows[1][3] = f32::INFINITY;
    for encoding in [Encoding::Ascii, Encoding::Little, Encoding::Big] {
        let file = ply(encoding, &properties, &rows);
        let scene = read("a.ply", &file).expect("not a load error");
        assert!(scene.positions()[0][0].is_nan());
        assert_eq!(scene.shapes()[1].scale[0], f32::INFINITY);
    }
    let before = "element camera 2\nproperty double focal\nproperty uchar id\n";
    let after = "element face 1\nproperty list uchar int vertex_indices\n";
    let text = String::from_utf8(ply(Encoding::Ascii, &properties, &rows)).expect("text");
    let text = text
        .replace("element vertex", &format!("{before}element vertex"))
        .replace("end_header\n", &format!("{after}end_header\n0.5 1\n0.5 2\n"));
    let scene = read("a.ply", (text + "3 0 1 2\n").as_bytes()).expect("a good file");
    assert_eq!(scene.positions()[1][..], rows[1][..3]);
}

#[gaurast_runner::test]
fn malformed_ply_is_refused_with_place_and_reason() {
    let (properties, rows) = distinct(1, 2);
    let good = ply(Encoding::Little, &properties, &rows);
    let text = |from: &str, to: &str| {
        let header = good.windows(11).position(|w| w == b"end_header\n").expect("it ends") + 11;
        let edited = String::from_utf8_lossy(&good[..header]).replacen(from, to, 1);
        [edited.as_bytes(), &good[header..]].concat()
    };

    let (place, reason) = refusal("a.ply", b"plx\n");
    assert_eq!(place, Place::Byte(0));
    assert!(matches!(reason, Reason::Magic { .. }));

    let (place, reason) = refusal("a.ply", b"ply\nformat ascii 1.0\nelement vertex 1\n");
    assert!(matches!((place, reason), (Place::Header(_), Reason::Truncated)));

    let (place, reason) = refusal("a.ply", &text("format binary_little_endian", "format ternary"));
    assert_eq!(place, Place::Line(2));
    assert!(matches!(reason, Reason::Header(_)));

    let (place, reason) = refusal("a.ply", &text("element vertex 2", "element vertex 3"));
    assert_eq!(place, Place::Element("vertex".to_owned()));
    let (claimed, available) = (3 * 23 * 4, 2 * 23 * 4);
    assert!(matches!(reason, Reason::TooShort { claimed: c, available: a }
        if (c, a) == (claimed, available)));

    // Far more than any machine could allocate.
    for count in ["18446744073709551615", "4611686018427387904", "99999999999"] {
        let claim = text("element vertex 2", &format!("element vertex {count}"));
        assert!(matches!(refusal("a.ply", &claim).1, Reason::TooShort { .. }));
    }
    let claim = text("element vertex 2", "element vertex 99999999999999999999999");
    assert!(matches!(refusal("a.ply", &claim).1, Reason::Header(_)));

    let (_, reason) = refusal("a.ply", &text("property float y", "property float x"));
    assert!(matches!(reason, Reason::Twice));

    let (place, reason) = refusal("a.ply", &text("property float f_rest_4", "property float f_rest_9"));
    assert_eq!(place, property("f_rest_4"));
    assert!(matches!(reason, Reason::Missing));

    let ascii = ply(Encoding::Ascii, &properties, &rows);
    let ascii = String::from_utf8(ascii).expect("text");
    let end = ascii.lines().count() as u64;
    let (place, reason) = refusal("a.ply", ascii.replace("0.14 ", "zero ").as_bytes());
    assert_eq!(place, Place::Line(end - 1));
    assert!(matches!(reason, Reason::Number(word) if word == "zero"));
    let (place, reason) = refusal("a.ply", (ascii.trim_end().to_owned() + " 1").as_bytes());
    assert_eq!(place, Place::Line(end));
    assert!(matches!(reason, Reason::Values { found: 24, expected: 23 }));
}

#[gaurast_runner::test]
fn malformed_ply_fixtures_are_refused() {
    let refused: &[(&str, Place, IsReason)] = &[
        ("list-property", property("opacity"), |r| matches!(r, Reason::List)),
        ("missing-opacity", property("opacity"), |r| matches!(r, Reason::Missing)),
        ("non-contiguous-sh", property("f_rest_2"), |r| matches!(r, Reason::Missing)),
        ("sh-count-not-rgb", Place::Element("vertex".to_owned()), |r| matches!(r, Reason::ShCount(2))),
        ("empty-vertex", Place::Element("vertex".to_owned()), |r| matches!(r, Reason::Empty)),
    ];
    let fixtures = data("fixtures");
    for (name, expected, is_reason) in refused {
        let path = fixtures.join(format!("{name}.ply"));
        let error = gaurast_scene::open(&path).expect_err(name);
        let SceneError::Malformed { place, reason, .. } = &error else {
            panic!("{name}: {error}");
        };
        assert_eq!(place, expected, "{name}");
        assert!(is_reason(reason), "{name}: {reason:?}");
        assert!(error.to_string().starts_with(&path.display().to_string()));
        assert_eq!(error.to_string().lines().count(), 1, "{name}: {error}");
    }
}

#[gaurast_runner::test]
fn good_ply_fixtures_hold_their_values() {
    let fixtures = data("fixtures");
    let load = |name: &str| gaurast_scene::open(fixtures.join(name)).expect(name);
    let scene = load("degree-2-sh.ply");
    assert_eq!((scene.len(), scene.sh_degree()), (1, 2));
    assert_eq!(scene.shapes()[0].opacity, 0.5);
    assert_eq!(scene.shapes()[0].scale, [1.0, 2.0, 0.5]);
    assert_eq!(scene.sh()[0], [0.1, 0.2, 0.3]);
    for k in 1..9 {
        let k_f = k as f32;
        assert_eq!(scene.sh()[k], [k_f, 100.0 + k_f, 200.0 + k_f]);
    }
    // Not errors: degree 4 is supported, and the device skips values that overflow.
    assert_eq!(load("degree-4-sh.ply").sh_degree(), 4);
    let overflow = load("overflow-scale.ply");
    assert_eq!(overflow.shapes()[0].scale[0], f32::INFINITY);
    assert_eq!(load("three-gaussian-binary-le.ply").len(), 3);
    assert_eq!(load("one-gaussian-binary-le.ply").len(), 1);
}

#[gaurast_runner::test]
fn compressed_ply_values() {
    let scene = read("a.compressed.ply", &compressed_ply(true, true)).expect("a good file");
    assert_eq!((scene.len(), scene.sh_degree()), (2, 1));
    assert_eq!(scene.positions(), [[-1.0, -2.0, -3.0], [1.0, 2.0, 3.0]]);
    assert_eq!(scene.shapes()[0].scale, [(-4.0_f64).exp() as f32; 3]);
    assert_eq!(scene.shapes()[1].scale, [1.0; 3]);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    // The sum of squares exceeds one, so the largest component is zero.
    assert_eq!(scene.shapes()[0].rotation, [0.0, half, -half, -half]);
    assert_eq!(scene.shapes()[1].rotation, [half, -half, 0.0, -half]);
    assert_eq!(scene.shapes()[0].opacity, (128.0 / 255.0) as f32);
    let colour = scene.sh()[0].map(|c| 0.5 + SH_C0 * c);
    close(&colour, &[2.0, 0.0, 0.4], 1e-6);
    // Channel by channel; the extremes are exact, other bytes mean the middle of their interval.
    let value = |byte: u8| 8.0 * ((f32::from(byte) + 0.5) / 256.0 - 0.5);
    assert_eq!(scene.sh()[1], [-4.0, value(1), value(4)]);
    assert_eq!(scene.sh()[2], [4.0, value(2), value(5)]);

    let plain = read("a.compressed.ply", &compressed_ply(false, false)).expect("a good file");
    assert_eq!(plain.sh_degree(), 0);
    close(&plain.sh()[0].map(|c| 0.5 + SH_C0 * c), &[1.0, 0.0, 0.2], 1e-6);

    let text = compressed_ply(true, false);
    let edit = |from: &str, to: &str| {
        let text = String::from_utf8_lossy(&text).into_owned();
        let header = text.find("end_header").expect("it ends");
        let edited = text[..header].replacen(from, to, 1);
        [edited.as_bytes(), &compressed_ply(true, false)[header..]].concat()
    };
    let (place, reason) = refusal("a.ply", &edit("uint packed_scale", "float packed_scale"));
    assert_eq!(place, property("packed_scale"));
    assert!(matches!(reason, Reason::Type { expected: "uint", .. }));
    let (place, reason) = refusal("a.ply", &edit("element chunk 1", "element chunk 0"));
    assert_eq!(place, Place::Element("chunk".to_owned()));
    assert!(matches!(reason, Reason::Count { found: 0, expected: 1 }));
}
