//! SPZ files.

use gaurast_runner::data;
use gaurast_scene::{AxesReason, Place, Reason, SceneError};

use super::support::*;

#[gaurast_runner::test]
fn malformed_spz_is_refused_with_place_and_reason() {
    let body = [7; 19];
    let good = |flags| [spz_header(2, 1, 0, flags), body.to_vec()].concat();
    assert_eq!(read("a.spz", &gzip(&good(0))).expect("a good file").len(), 1);

    let trailing = [good(0), b"EXTRA!".to_vec()].concat();
    let (place, reason) = refusal("a.spz", &gzip(&trailing));
    assert_eq!(place, Place::Byte(35));
    assert!(matches!(reason, Reason::Trailing));
    // With the flag, the following bytes are extension records.
    let extended = [good(2), b"EXTRA!".to_vec()].concat();
    assert_eq!(read("a.spz", &gzip(&extended)).expect("a good file").len(), 1);
    let junk = [gzip(&good(0)), b"JUNK".to_vec()].concat();
    assert!(matches!(refusal("a.spz", &junk).1, Reason::Trailing));

    let mut bad_sum = gzip(&good(0));
    let sum = bad_sum.len() - 8;
    bad_sum[sum] ^= 0xff;
    assert!(matches!(refusal("a.spz", &bad_sum).1, Reason::Gzip(_)));

    // Version 4 is not compressed as a whole, and all other versions are.
    let (place, reason) = refusal("a.spz", &gzip(&spz_header(4, 100, 1, 0)));
    assert_eq!(place, Place::Header("version"));
    assert!(matches!(reason, Reason::Version { found: 4, .. }));
    for version in 1..4 {
        let (place, reason) = refusal("a.spz", &[spz_header(version, 1, 0, 0), body.to_vec()].concat());
        assert_eq!(place, Place::Header("version"));
        assert!(matches!(reason, Reason::Unsupported(_)));
    }
    let (_, reason) = refusal("a.spz", &spz_header(5, 100, 1, 0));
    assert!(matches!(reason, Reason::Version { found: 5, .. }));

    // A gzip bomb: the header claims little, and a gigabyte follows.
    let bomb = [good(2), vec![0; 64 << 20]].concat();
    assert!(matches!(refusal("a.spz", &gzip(&bomb)).1, Reason::Trailing));
    // A file whose header claims as much as its size could hold, but which holds less.
    let claim = gzip(&spz_header(2, 1800, 0, 0));
    let (place, reason) = refusal("a.spz", &claim);
    assert!(matches!((place, reason), (Place::Byte(16), Reason::Truncated)));
}

#[gaurast_runner::test]
fn malformed_spz_fixtures_are_refused() {
    let refused: &[(&str, IsReason)] = &[
        ("bad-fhcrc-v2", |r| matches!(r, Reason::Gzip(_))),
        ("corrupt-deflate", |r| matches!(r, Reason::Gzip(_))),
        ("empty-points-v2", |r| matches!(r, Reason::Empty)),
        ("gzip-not-spz", |r| matches!(r, Reason::Magic { .. })),
        ("huge-count-v2", |r| matches!(r, Reason::TooShort { .. })),
        ("plaintext-v2", |r| matches!(r, Reason::Unsupported(_))),
        ("sh-degree-5-v2", |r| matches!(r, Reason::ShDegree(5))),
        ("trailing-decompressed-v2", |r| matches!(r, Reason::Trailing)),
        ("truncated-gzip-header", |r| matches!(r, Reason::Truncated)),
        ("version-0", |r| matches!(r, Reason::Version { found: 0, .. })),
    ];
    let fixtures = data("fixtures");
    for (name, is_reason) in refused {
        let path = fixtures.join(format!("{name}.spz"));
        let error = gaurast_scene::open(&path).expect_err(name);
        let SceneError::Malformed { reason, .. } = &error else {
            panic!("{name}: {error}");
        };
        assert!(is_reason(reason), "{name}: {error}");
        assert_eq!(error.to_string().lines().count(), 1, "{name}: {error}");
    }
}

/// Tests the fixture's four Gaussians, which are exactly representable; the test repeats the formulas that made it.
#[gaurast_runner::test]
fn spz_fixture_holds_the_values_that_made_it() {
    let path = data("fixtures/equiv-degree3-exact-v2.spz");
    let scene = gaurast_scene::open(&path).expect("a good file");
    assert_eq!((scene.len(), scene.sh_degree()), (4, 3));
    let rotations: [[f32; 4]; 4] =
        [[1.0, 0.0, 0.0, 0.0], [0.9, 0.3, -0.2, 0.1], [0.6, -0.5, 0.5, -0.377], [0.5, 0.5, -0.5, 0.5]];
    for (n, i) in (0_i32..4).enumerate() {
        let units = [(i - 1) * 1024 + 37, (1 - i) * 2048 - 61, (i * i - 2) * 512 + 13];
        let [x, y, z] = units.map(|u| u as f32 / 4096.0);
        assert_eq!(scene.positions()[n], [x, -y, -z]);
        let steps = [i - 16, 8 - 2 * i, 3 * i];
        let shape = scene.shapes()[n];
        close(&shape.scale, &steps.map(|s| (s as f32 / 16.0).exp()), 1e-6);
        close(&[shape.opacity], &[(25 + 60 * i) as f32 / 255.0], 1e-6);
        let length = rotations[n].iter().map(|c| c * c).sum::<f32>().sqrt();
        let [w, x, y, z] = rotations[n].map(|c| c / length);
        close(&shape.rotation, &[w, x, -y, -z], 8e-3);
        let bytes = [40 + 7 * i, 128 + 3 * i, 210 - 11 * i];
        close(&scene.sh()[16 * n], &bytes.map(|b| (b as f32 - 127.5) / 38.25), 1e-5);
        for (k, sign) in TURN.iter().enumerate() {
            let k_i = k as i32;
            let bytes =
                [13 * k_i + 5 * i, 200 - 9 * k_i + 4 * i, 128 + 17 * k_i - 6 * i].map(|b| 1 + b.rem_euclid(255));
            let expected = bytes.map(|b| sign * (b as f32 - 128.0) / 128.0);
            assert_eq!(scene.sh()[16 * n + 1 + k], expected, "coefficient {k} of {n}");
        }
    }
}

/// Tests that one Gaussian stored as a PLY file and as SPZ of each version is read as the same Gaussian.
#[gaurast_runner::test]
fn spz_and_ply_of_one_gaussian_agree() {
    let rest: Vec<u8> = (0..45).map(|i| 60 + 3 * i).collect();
    let (colour, scales, opacity) = ([40, 128, 210], [144, 160, 176], 200);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    // The frame is right-up-back.
    let (position, quaternion) = ([0.5, -2.25, 1.0], [half, 0.0, half, 0.0]);
    for version in 1..=3 {
        let mut file = spz_header(version, 1, 3, 0);
        for value in position {
            if version == 1 {
                file.extend(half::f16::from_f32(value).to_le_bytes());
            } else {
                file.extend(&((value * 4096.0) as i32).to_le_bytes()[..3]);
            }
        }
        file.push(opacity);
        file.extend(colour);
        file.extend(scales);
        if version < 3 {
            file.extend(quaternion[1..].iter().map(|c| (c * 127.5 + 127.5).round() as u8));
        } else {
            // The largest is y (index 1); x and z are zero, w is at its maximum.
            file.extend((1_u32 << 30 | 511).to_le_bytes());
        }
        file.extend(&rest);
        let spz = read("a.spz", &gzip(&file)).expect("a good file");

        let opacity = f32::from(opacity) / 255.0;
        let mut row = vec![position[0], -position[1], -position[2]];
        row.extend(scales.map(|b| f32::from(b) / 16.0 - 10.0));
        row.extend([quaternion[0], quaternion[1], -quaternion[2], -quaternion[3]]);
        row.push((opacity / (1.0 - opacity)).ln());
        row.extend(colour.map(|b| (f32::from(b) - 127.5) / 38.25));
        for channel in 0..3 {
            row.extend((0..15).map(|k| TURN[k] * (f32::from(rest[3 * k + channel]) - 128.0) / 128.0));
        }
        let (properties, _) = distinct(3, 0);
        let ply = read("a.ply", &ply(Encoding::Little, &properties, &[row])).expect("a good file");

        assert_eq!(spz.positions(), ply.positions(), "version {version}");
        close(&spz.shapes()[0].scale, &ply.shapes()[0].scale, 1e-7);
        close(&spz.shapes()[0].rotation, &ply.shapes()[0].rotation, 8e-3);
        close(&[spz.shapes()[0].opacity], &[ply.shapes()[0].opacity], 1e-6);
        close(spz.sh().as_flattened(), ply.sh().as_flattened(), 1e-5);
    }
}

#[gaurast_runner::test]
fn good_spz_fixtures_are_read() {
    let fixtures = data("fixtures");
    for (name, count, degree) in [
        ("minimal-v1", 1, 0),
        ("minimal-v3", 1, 0),
        ("decode-v1", 1, 0),
        ("decode-degree1-v2", 2, 1),
        ("three-points-degree1-v2", 3, 1),
        ("degree3-v2", 1, 3),
        ("decode-degree4-v2", 1, 4),
    ] {
        let path = fixtures.join(format!("{name}.spz"));
        let scene = gaurast_scene::open(&path).expect(name);
        assert_eq!((scene.len(), scene.sh_degree()), (count, degree), "{name}");
    }
}

/// Tests changes inside the gzip stream of an SPZ file; outside, a change would only break its checksum.
#[gaurast_runner::test]
fn every_header_byte_of_spz_may_be_anything() {
    let good = [spz_header(2, 1, 1, 0), vec![7; 28]].concat();
    for position in 0..16 {
        for byte in 0..=255 {
            let mut file = good.clone();
            file[position] = byte;
            if let Ok(scene) = read("a.spz", &gzip(&file)) {
                assert_eq!(scene.len(), 1);
            }
        }
    }
}

/// A zstd frame of `bytes`, not compressed.
fn zstd(bytes: &[u8]) -> Vec<u8> {
    // The magic, a descriptor that announces a size of four bytes, the size, and a last, raw block.
    let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0xa0];
    frame.extend((bytes.len() as u32).to_le_bytes());
    let block = (bytes.len() as u32) << 3 | 1;
    frame.extend(&block.to_le_bytes()[..3]);
    frame.extend(bytes);
    frame
}

/// The header, the extension records and the table of version 4, and its streams.
fn version_4_of(degree: u8, flags: u8, records: &[u8], arrays: &[Vec<u8>]) -> Vec<u8> {
    let mut file = spz_header(4, 2, degree, flags);
    file[15] = arrays.len() as u8;
    file.extend((32 + records.len() as u32).to_le_bytes());
    file.extend([0; 12]);
    file.extend(records);
    let streams: Vec<_> = arrays.iter().map(|array| zstd(array)).collect();
    for (stream, array) in streams.iter().zip(arrays) {
        file.extend((stream.len() as u64).to_le_bytes());
        file.extend((array.len() as u64).to_le_bytes());
    }
    file.extend(streams.concat());
    file
}

/// Arrays of two Gaussians of degree `degree`.
fn arrays(degree: u8) -> Vec<Vec<u8>> {
    let rest = 3 * ((usize::from(degree) + 1).pow(2) - 1);
    let array = |size: usize| (0..2 * size).map(|i| (37 * i + size) as u8).collect();
    [9, 1, 3, 3, 4, rest].into_iter().filter(|size| *size > 0).map(array).collect()
}

/// A file of version 4 with two Gaussians.
pub fn version_4(degree: u8, flags: u8) -> Vec<u8> {
    version_4_of(degree, flags, &[], &arrays(degree))
}

#[gaurast_runner::test]
fn version_4_of_spz_is_version_3_otherwise_stored() {
    for degree in 0..=4 {
        for flags in [0, 1] {
            let four = read("a.spz", &version_4(degree, flags)).expect("a good file");
            let body = [spz_header(3, 2, degree, flags), arrays(degree).concat()].concat();
            assert_eq!(four, read("a.spz", &gzip(&body)).expect("a good file"));
        }
    }
}

#[gaurast_runner::test]
fn the_small_files_of_version_4_are_read() {
    for name in ["a", "b"] {
        let scene = gaurast_scene::open(data("formats").join(format!("v4-{name}.spz"))).expect(name);
        assert_eq!((scene.len(), scene.sh_degree()), (4, 0));
        // The splats are at the corners of a tetrahedron of 24-bit steps, all of one opacity.
        let opacity = if name == "a" { 181.0 / 255.0 } else { 230.0 / 255.0 };
        for shape in scene.shapes() {
            close(&[shape.opacity], &[opacity], 1e-6);
            close(&[shape.rotation.iter().map(|c| c * c).sum()], &[1.0], 1e-5);
        }
    }
    let raw = gaurast_scene::open(data("formats/raw-not-gzipped.spz")).expect_err("no gzip");
    assert!(raw.to_string().ends_with("header, version: version 2 is not compressed with gzip"), "{raw}");
}

#[gaurast_runner::test]
fn malformed_version_4_of_spz_is_refused_with_place_and_reason() {
    let good = version_4(1, 0);
    let refused = |at: usize, byte: u8| {
        let mut file = good.clone();
        file[at] = byte;
        refusal("a.spz", &file)
    };
    assert!(matches!(refused(11, 0x70).1, Reason::TooShort { .. }));
    let (place, reason) = refused(15, 5);
    assert_eq!(place, Place::Header("numStreams"));
    assert!(matches!(reason, Reason::Count { found: 5, expected: 6 }));
    let (place, reason) = refused(16, 31);
    assert_eq!(place, Place::Header("tocByteOffset"));
    assert!(matches!(reason, Reason::Range { found: 31, .. }));
    assert!(matches!(refused(19, 1).1, Reason::Truncated));
    let stream = Place::Part("stream 0".to_owned());
    assert!(matches!(refused(39, 1), (p, Reason::TooShort { .. }) if p == stream));
    assert!(matches!(refused(40, 1), (p, Reason::Count { found: 1, expected: 18 }) if p == stream));
    let frame = 32 + 6 * 16;
    assert!(matches!(refused(frame, 0), (p, Reason::Zstd(_)) if p == stream));
    let trailing = [good.clone(), vec![0]].concat();
    assert!(matches!(refusal("a.spz", &trailing).1, Reason::Trailing));

    // A stream that holds more than it should, which is only found by reading all of it.
    let mut arrays = arrays(0);
    arrays[0].extend(vec![0; 100_000]);
    let mut file = version_4_of(0, 0, &[], &arrays);
    file[40..48].copy_from_slice(&18_u64.to_le_bytes());
    assert!(matches!(refusal("a.spz", &file).1, Reason::Count { found: 19, expected: 18 }));
}

/// A record of an extension.
fn record(kind: u32, content: &[u8]) -> Vec<u8> {
    let mut record = kind.to_le_bytes().to_vec();
    record.extend((content.len() as u32).to_le_bytes());
    record.extend(content);
    record
}

/// Tests that files in each of the extension's frames are read as the same scene, as by the format's library.
#[gaurast_runner::test]
fn the_frame_that_an_spz_extension_names_is_turned() {
    let plain = read("a.spz", &version_4(4, 0)).expect("a good file");
    // For each frame, the directions of x, y and z, in order. A scene's are right, down and forward.
    let frames = [
        "LDB", "RDB", "LUB", "RUB", "LDF", "RDF", "LUF", "RUF", "LFD", "RFD", "LFU", "RFU", "LBD", "RBD", "LBU", "RBU",
    ];
    let raw = {
        let [x, y, z] = plain.positions()[0];
        [x, -y, -z]
    };
    for (number, frame) in (1_u32..).zip(frames) {
        let records = record(0xadbe_0003, &number.to_le_bytes());
        let file = version_4_of(4, 2, &records, &arrays(4));
        let scene = read("a.spz", &file).expect("a good file");
        let mut expected = [0.0; 3];
        for (axis, value) in frame.chars().zip(raw) {
            let (place, sign) = match axis {
                'R' => (0, 1.0),
                'L' => (0, -1.0),
                'D' => (1, 1.0),
                'U' => (1, -1.0),
                'F' => (2, 1.0),
                _ => (2, -1.0),
            };
            expected[place] = sign * value;
        }
        assert_eq!(scene.positions()[0], expected, "{frame}");
        assert_eq!(scene.shapes()[0].scale, plain.shapes()[0].scale);
        assert!(scene.metadata().notes.is_empty());
        let taken = scene.metadata().axes.expect("axes");
        assert_eq!((taken.axes.to_string(), taken.reason), (frame.to_lowercase(), AxesReason::File));
        // The function of degree 2 that is z^2 minus the mean of x^2 and y^2, in the file's frame.
        let energy = |scene: &gaurast_scene::Scene| -> f32 { scene.sh()[4..9].iter().map(|c| c[0] * c[0]).sum() };
        close(&[energy(&scene)], &[energy(&plain)], 1e-4);
        if frame == "RUB" {
            assert_eq!(
                (scene.positions(), scene.shapes(), scene.sh()),
                (plain.positions(), plain.shapes(), plain.sh())
            );
        }
        // The gradient of degree 1 rotates with the file's axes, as the positions do.
        let gradient = |sh: &[[f32; 3]]| [-sh[3][1], -sh[1][1], sh[2][1]];
        let [x, y, z] = gradient(plain.sh());
        let mut turned = [0.0; 3];
        for (axis, value) in frame.chars().zip([x, -y, -z]) {
            let (place, sign) = match axis {
                'R' => (0, 1.0),
                'L' => (0, -1.0),
                'D' => (1, 1.0),
                'U' => (1, -1.0),
                'F' => (2, 1.0),
                _ => (2, -1.0),
            };
            turned[place] = sign * value;
        }
        assert_eq!(gradient(scene.sh()), turned, "{frame}");
    }
}

#[gaurast_runner::test]
fn other_spz_extensions_are_named() {
    let records = [
        record(0xadbe_0002, &[0; 12]),
        record(0x1234_0001, &[1, 2, 3]),
        record(0xadbe_0003, &99_u32.to_le_bytes()),
        vec![1, 2, 3],
    ]
    .concat();
    let four = version_4_of(0, 2, &records, &arrays(0));
    let body = [spz_header(3, 2, 0, 2), arrays(0).concat(), records].concat();
    for file in [four, gzip(&body)] {
        let notes = read("a.spz", &file).expect("a good file").metadata().notes.clone();
        assert_eq!(notes.len(), 4, "{notes:?}");
        assert!(notes[0].contains("SPZ_ADOBE_safe_orbit_camera"));
        assert!(notes[1].contains("0x12340001"));
        assert!(notes[2].contains("SPZ_ADOBE_coordinate_system"));
    }
}
