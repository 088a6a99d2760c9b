//! Dialects of scene files: axes, coordinates in binary64, Mip-Splatting's filter, unknown columns, points, and numbers
//! that are not finite.

use std::io::Cursor;
use std::path::Path;

use gaurast_scene::{Axes, AxesReason, Options, Place, Reason, Scene, Transform};
use glam::{DQuat, DVec3};

use super::support::*;

fn read_with(name: &str, bytes: &[u8], options: &Options) -> Scene {
    let read = gaurast_scene::read_with(Path::new(name), &mut Cursor::new(bytes), bytes.len() as u64, options);
    read.expect("a good file")
}

fn with_axes(name: &str, bytes: &[u8], axes: &str) -> Scene {
    read_with(name, bytes, &Options { axes: Some(axes.parse().expect(axes)), ..Options::default() })
}

/// A PLY file of degree 1 with a comment in its header.
fn commented(comment: &str) -> Vec<u8> {
    let (properties, rows) = distinct(1, 2);
    let file = String::from_utf8(ply(Encoding::Ascii, &properties, &rows)).expect("text");
    file.replace("element vertex", &format!("comment {comment}\nelement vertex")).into_bytes()
}

#[gaurast_runner::test]
fn axes_are_turned_in_every_format() {
    let (properties, rows) = distinct(1, 2);
    let files = [
        ("a.ply", ply(Encoding::Little, &properties, &rows)),
        ("a.compressed.ply", compressed_ply(true, true)),
        (
            "a.spz",
            gzip(&[spz_header(2, 2, 1, 0), (0..56).map(|i| 37 * i + 5).map(|i: u32| i as u8).collect()].concat()),
        ),
    ];
    for (name, file) in &files {
        let plain = with_axes(name, file, "rdf");
        for axes in ["rub", "luf", "rfu", "ruf", "fld"] {
            let turned = with_axes(name, file, axes);
            let matrix = axes.parse::<Axes>().expect(axes).matrix();
            let double = |p: [f32; 3]| DVec3::from_array(p.map(f64::from));
            for (from, to) in plain.positions().iter().zip(turned.positions()) {
                assert!((matrix * double(*from)).abs_diff_eq(double(*to), 1e-6), "{name} {axes}");
            }
            // The gradient of degree 1 turns with the positions.
            let gradient = |sh: &[[f32; 3]]| double([-sh[3][1], -sh[1][1], sh[2][1]]);
            assert!((matrix * gradient(plain.sh())).abs_diff_eq(gradient(turned.sh()), 1e-5), "{name} {axes}");
            let taken = turned.metadata().axes.expect("axes");
            assert_eq!((taken.axes.to_string().as_str(), taken.reason), (axes, AxesReason::Given));
            assert_eq!(taken.of_cameras, !name.ends_with("spz"));
        }
    }
}

#[gaurast_runner::test]
fn a_vertical_axis_is_honoured_unless_axes_are_given() {
    let (properties, rows) = distinct(1, 2);
    let plain = read("a.ply", &ply(Encoding::Ascii, &properties, &rows)).expect("a good file");
    let up = read("a.ply", &commented("Vertical Axis: z")).expect("a good file");
    let [x, y, z] = plain.positions()[1];
    assert_eq!(up.positions()[1], [x, -z, y]);
    assert_eq!(up.metadata().axes.map(|axes| axes.reason), Some(AxesReason::File));
    let given = with_axes("a.ply", &commented("Vertical Axis: z"), "rdf");
    assert_eq!(given.positions(), plain.positions());
    // Brush writes this for scenes whose y points down, as in 3DGS.
    assert_eq!(read("a.ply", &commented("Vertical Axis: y")).expect("a good file"), plain);
    let wrong = read("a.ply", &commented("Vertical Axis: upwards")).expect("a good file");
    assert_eq!(wrong.positions(), plain.positions());
    assert!(wrong.metadata().notes[0].contains("upwards"), "{:?}", wrong.metadata().notes);
}

/// An SPZ file of a floor and of a ball above it, with y downwards or upwards.
fn grounded(down: bool) -> Vec<u8> {
    let mut positions = Vec::new();
    let mut scales = Vec::new();
    for i in 0..2000_i32 {
        let (a, b) = (i % 40 - 20, i / 40 - 20);
        let (x, height, z) = if i < 1600 { (a, 0, b) } else { (a / 4, 4 + i % 7, b / 4) };
        let sign = if down { -1 } else { 1 };
        for value in [x, sign * height, z] {
            positions.extend(&(value * 409).to_le_bytes()[..3]);
        }
        scales.extend(if i < 1600 { [120, 60, 120] } else { [96; 3] });
    }
    let count = 2000;
    let header = spz_header(2, count, 0, 0);
    let [opacities, colours] = [1, 3].map(|width| vec![200; width * count as usize]);
    let rotations = vec![128; 3 * count as usize];
    gzip(&[header, positions, opacities, colours, scales, rotations].concat())
}

#[gaurast_runner::test]
fn the_ground_of_an_spz_file_is_below() {
    let [up, down] = [false, true].map(|down| read("a.spz", &grounded(down)).expect("a good file"));
    for (scene, axes) in [(&up, "rub"), (&down, "rdf")] {
        let taken = scene.metadata().axes.expect("axes");
        assert_eq!((taken.axes.to_string().as_str(), taken.reason), (axes, AxesReason::Ground));
        // y points down: the ball is above the floor.
        assert!(scene.positions()[1999][1] < scene.positions()[0][1]);
    }
    // Few Gaussians decide nothing.
    let few = read("a.spz", &gzip(&[spz_header(2, 1, 0, 0), vec![7; 19]].concat())).expect("a good file");
    let taken = few.metadata().axes.expect("axes");
    assert_eq!((taken.axes.to_string().as_str(), taken.reason), ("rub", AxesReason::Format));
}

/// A PLY file of two Gaussians whose coordinates are binary64, at `places`.
fn wide(places: [[f64; 3]; 2]) -> Vec<u8> {
    let (properties, rows) = distinct(0, 2);
    let narrow = ply(Encoding::Little, &properties, &rows);
    let end = narrow.windows(11).position(|window| window == b"end_header\n").expect("a header") + 11;
    let mut header = String::from_utf8(narrow[..end].to_vec()).expect("text");
    for axis in ["x", "y", "z"] {
        header = header.replace(&format!("float {axis}\n"), &format!("double {axis}\n"));
    }
    let mut file = header.into_bytes();
    for (place, row) in places.iter().zip(narrow[end..].chunks_exact(4 * properties.len())) {
        file.extend(place.iter().flat_map(|value| value.to_le_bytes()));
        file.extend(&row[12..]);
    }
    file
}

#[gaurast_runner::test]
fn binary64_coordinates_keep_their_digits() {
    let places = [[500_000.125, 5_400_000.3, 299.7], [500_001.625, 5_400_001.1, 300.2]];
    let scene = read("a.ply", &wide(places)).expect("a good file");
    let origin = DVec3::from_array(scene.origin());
    assert!(origin.abs_diff_eq(DVec3::new(500_001.0, 5_400_001.0, 300.0), 2.0), "{origin}");
    let place = |scene: &Scene, index: usize| {
        DVec3::from_array(scene.origin()) + DVec3::from_array(scene.positions()[index].map(f64::from))
    };
    for (index, expected) in places.into_iter().enumerate() {
        assert!(place(&scene, index).abs_diff_eq(expected.into(), 1e-6), "{index}");
    }
    let extent = gaurast_scene::Extent::of(&scene);
    assert!(DVec3::from_array(extent.centre).abs_diff_eq(DVec3::new(500_000.9, 5_400_000.7, 300.0), 0.5));
    let bounds = gaurast_scene::info::Info::new(&scene).bounds.expect("bounds");
    assert!(DVec3::from_array(bounds.min).abs_diff_eq(DVec3::new(500_000.125, 5_400_000.3, 299.7), 1e-6));

    // Another file of the picture has the same origin, whichever is first.
    let (properties, rows) = distinct(0, 1);
    let near = read("a.ply", &ply(Encoding::Little, &properties, &rows)).expect("a good file");
    assert_eq!(near.origin(), [0.0; 3]);
    for (mut first, second, index) in [(scene.clone(), &near, 0), (near.clone(), &scene, 1)] {
        first.append(second, &Transform::default());
        assert_eq!(first.origin(), scene.origin());
        assert!(place(&first, index).abs_diff_eq(places[0].into(), 1e-6));
    }
    // A turned scene has a turned origin.
    let turn = Transform { rotation: DQuat::from_rotation_z(0.5), ..Transform::default() };
    let mut turned = Scene::default();
    turned.append(&scene, &turn);
    assert!(place(&turned, 1).abs_diff_eq(turn.rotation * DVec3::from_array(places[1]), 1e-6));
    // Coordinates that binary32 holds stay what they are.
    let small = read("a.ply", &wide([[0.1, 0.2, 0.3], [1.0, 2.0, 3.0]])).expect("a good file");
    assert_eq!(small.origin(), [0.0; 3]);
    assert_eq!(small.positions()[0], [0.1, 0.2, 0.3]);
}

#[gaurast_runner::test]
fn mip_splattings_filter_is_fused() {
    let (mut properties, mut rows) = distinct(0, 2);
    let filters = [0.3_f32, 0.0];
    properties.insert(2, "filter_3D".to_owned());
    for (row, filter) in rows.iter_mut().zip(filters) {
        row.insert(2, filter);
    }
    let scene = read("a.ply", &ply(Encoding::Big, &properties, &rows)).expect("a good file");
    assert!(scene.metadata().warnings.is_empty());
    for (index, filter) in filters.map(f64::from).into_iter().enumerate() {
        let value = |name: &str| {
            let column = properties.iter().position(|property| property == name).expect("a property");
            f64::from(rows[index][column])
        };
        let scale = ["scale_0", "scale_1", "scale_2"].map(|name| value(name).exp());
        let fused = scale.map(|scale| scale.hypot(filter));
        let ratio: f64 = scale.iter().zip(fused).map(|(scale, fused)| scale / fused).product();
        let opacity = ratio / (1.0 + (-value("opacity")).exp());
        close(&scene.shapes()[index].scale, &fused.map(|scale| scale as f32), 1e-6);
        close(&[scene.shapes()[index].opacity], &[opacity as f32], 1e-6);
    }
}

#[gaurast_runner::test]
fn unknown_columns_are_named_and_harmless_ones_are_not() {
    let (mut properties, mut rows) = distinct(0, 1);
    for name in ["nx", "red", "time", "motion_0", "motion_1", "motion_2", "opacity_center"] {
        properties.push(name.to_owned());
        rows[0].push(0.5);
    }
    let scene = read("a.ply", &ply(Encoding::Little, &properties, &rows)).expect("a good file");
    let warnings = &scene.metadata().warnings;
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].contains("time, motion_0 to motion_2, opacity_center are unknown"), "{warnings:?}");
}

#[gaurast_runner::test]
fn numbers_that_are_not_finite_are_named() {
    let (properties, mut rows) = distinct(0, 5);
    rows[0][0] = f32::NAN;
    rows[1][4] = f32::INFINITY;
    rows[2][3] = f32::NEG_INFINITY;
    rows[3][5] = f32::NEG_INFINITY;
    for encoding in [Encoding::Ascii, Encoding::Little] {
        let warnings =
            read("a.ply", &ply(encoding, &properties, &rows)).expect("a good file").metadata().warnings.clone();
        assert_eq!(warnings.len(), 2, "{warnings:?}");
        assert!(warnings[0].starts_with("2 Gaussians have a scale of -inf"), "{warnings:?}");
        assert!(warnings[1].starts_with("2 of 5 Gaussians"), "{warnings:?}");
    }
    let mut file = compressed_ply(true, false);
    let end = file.windows(11).position(|window| window == b"end_header\n").expect("a header") + 11;
    file[end..end + 4].copy_from_slice(&f32::INFINITY.to_le_bytes());
    let warnings = read("a.compressed.ply", &file).expect("a good file").metadata().warnings.clone();
    assert!(warnings[0].starts_with("1 of 1 chunks"), "{warnings:?}");
}

#[gaurast_runner::test]
fn points_without_scales_are_refused_or_drawn() {
    let file = b"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n1 2 3 255 0 51\n4 5 6 0 0 0\n";
    let (place, reason) = refusal("a.ply", file);
    assert_eq!(place, Place::Element("vertex".to_owned()));
    assert!(matches!(reason, Reason::PointCloud));
    let scene = read_with("a.ply", file, &Options { points: Some(0.5), ..Options::default() });
    assert_eq!(scene.positions(), [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    close(&scene.sh()[0].map(|c| 0.5 + SH_C0 * c), &[1.0, 0.0, 0.2], 1e-6);
    let shape = scene.shapes()[0];
    assert_eq!(shape.opacity, 1.0);
    // At half of its diameter, a point has half of its opacity.
    let half = (-0.5 * (0.25 / f64::from(shape.scale[0])).powi(2)).exp();
    assert!((half - 0.5).abs() < 1e-6, "{half}");
}
