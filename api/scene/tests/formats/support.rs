//! Files made in memory for the tests, and common assertions.

use std::io::{Cursor, Write};
use std::path::Path;

use flate2::Compression;
use flate2::write::GzEncoder;
use gaurast_scene::{Place, Reason, Scene, SceneError};

/// A check that a reason is the expected one.
pub type IsReason = fn(&Reason) -> bool;

pub const SH_C0: f32 = 0.282_094_8;

/// Signs of the coefficients of a scene rotated half a turn around x, bands 1 to 3.
pub const TURN: [f32; 15] = [-1., -1., 1., -1., 1., 1., -1., 1., -1., 1., -1., -1., 1., -1., 1.];

pub fn read(name: &str, bytes: &[u8]) -> Result<Scene, SceneError> {
    gaurast_scene::read(Path::new(name), &mut Cursor::new(bytes), bytes.len() as u64)
}

/// The place and reason with which `bytes` are refused.
#[track_caller]
pub fn refusal(name: &str, bytes: &[u8]) -> (Place, Reason) {
    match read(name, bytes) {
        Err(SceneError::Malformed { place, reason, .. }) => (place, reason),
        other => panic!("{name}: not refused as malformed: {other:?}"),
    }
}

pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).expect("memory takes it");
    encoder.finish().expect("memory takes it")
}

pub fn property(name: &str) -> Place {
    Place::Property { element: "vertex".to_owned(), property: name.to_owned() }
}

/// An encoding of PLY payloads, for `ply`.
#[derive(Clone, Copy, Debug)]
pub enum Encoding {
    Ascii,
    Little,
    Big,
}

pub const REQUIRED: [&str; 14] = [
    "x", "y", "z", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3", "opacity", "f_dc_0", "f_dc_1",
    "f_dc_2",
];

/// A PLY file of float properties.
pub fn ply(encoding: Encoding, properties: &[String], rows: &[Vec<f32>]) -> Vec<u8> {
    let format = match encoding {
        Encoding::Ascii => "ascii",
        Encoding::Little => "binary_little_endian",
        Encoding::Big => "binary_big_endian",
    };
    let mut file = format!("ply\nformat {format} 1.0\nelement vertex {}\n", rows.len());
    for property in properties {
        file += &format!("property float {property}\n");
    }
    let mut file = (file + "end_header\n").into_bytes();
    for row in rows {
        for value in row {
            match encoding {
                Encoding::Ascii => write!(file, "{value} ").expect("memory takes it"),
                Encoding::Little => file.extend(value.to_le_bytes()),
                Encoding::Big => file.extend(value.to_be_bytes()),
            }
        }
        if matches!(encoding, Encoding::Ascii) {
            file.push(b'\n');
        }
    }
    file
}

/// Properties and rows of a scene of `count` Gaussians with distinct values.
pub fn distinct(degree: usize, count: usize) -> (Vec<String>, Vec<Vec<f32>>) {
    let rest = 3 * ((degree + 1).pow(2) - 1);
    let properties: Vec<String> =
        REQUIRED.iter().map(ToString::to_string).chain((0..rest).map(|i| format!("f_rest_{i}"))).collect();
    let rows = (0..count)
        .map(|row| (0..properties.len()).map(|column| 0.01 * (column as f32 + 1.0) - 0.1 * row as f32).collect())
        .collect();
    (properties, rows)
}

/// A compressed PLY of one chunk with two Gaussians.
pub fn compressed_ply(coloured: bool, sh: bool) -> Vec<u8> {
    let axes = |prefix: &str, names: [&str; 3]| {
        ["min", "max"].map(|end| names.map(|n| format!("property float {end}_{prefix}{n}\n")).concat())
    };
    let mut header = "ply\nformat binary_little_endian 1.0\nelement chunk 1\n".to_owned();
    header += &axes("", ["x", "y", "z"]).concat();
    header += &axes("scale_", ["x", "y", "z"]).concat();
    if coloured {
        header += &axes("", ["r", "g", "b"]).concat();
    }
    header += "element vertex 2\n";
    for name in ["position", "rotation", "scale", "color"] {
        header += &format!("property uint packed_{name}\n");
    }
    if sh {
        header += "element sh 2\n";
        for i in 0..9 {
            header += &format!("property uchar f_rest_{i}\n");
        }
    }
    let mut file = (header + "end_header\n").into_bytes();
    let bounds = [-1.0_f32, -2.0, -3.0, 1.0, 2.0, 3.0, -4.0, -4.0, -4.0, 0.0, 0.0, 0.0];
    let colours = [0.0_f32, 0.0, 0.0, 2.0, 2.0, 2.0];
    for value in bounds.iter().chain(colours.iter().filter(|_| coloured)) {
        file.extend(value.to_le_bytes());
    }
    for (largest, position) in [(0_u32, 0_u32), (2, u32::MAX)] {
        let rotation = largest << 30 | 1023 << 20;
        for word in [position, rotation, position, 0xff00_3380] {
            file.extend(word.to_le_bytes());
        }
    }
    if sh {
        file.extend([0, 255, 128, 1, 2, 3, 4, 5, 6]);
        file.extend([6, 5, 4, 3, 2, 1, 128, 255, 0]);
    }
    file
}

/// The header of an SPZ file.
pub fn spz_header(version: u32, count: u32, degree: u8, flags: u8) -> Vec<u8> {
    let mut header = b"NGSP".to_vec();
    header.extend(version.to_le_bytes());
    header.extend(count.to_le_bytes());
    header.extend([degree, 12, flags, 0]);
    header
}

/// Asserts that `a` and `b` are equal within `tolerance`.
#[track_caller]
pub fn close(a: &[f32], b: &[f32], tolerance: f32) {
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() <= tolerance, "{a} against {b}");
    }
}
