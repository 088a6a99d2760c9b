//! Scene files with arbitrary bytes.

use std::path::Path;

use flate2::Compression;
use flate2::read::GzEncoder;
use std::io::Read;

use super::bytes::Bytes;

/// File names, each with true if the bytes are compressed here. SPZ files are compressed, so most changes of their
/// bytes fail at the checksum. One kind of SPZ file is therefore compressed after the changes.
const KINDS: [(&str, bool); 10] = [
    ("a.ply", false),
    ("a.splat", false),
    ("a.spz", false),
    ("a.spz", true),
    ("a", false),
    ("a.ksplat", false),
    ("a.sog", false),
    ("a.glb", false),
    ("a.gltf", false),
    ("a.ply.gz", true),
];

/// Reads bytes as a scene. The first byte selects the kind, and the others are the file. Returns the number of
/// Gaussians if the file is valid.
///
/// # Panics
/// If the scene is inconsistent.
pub fn load(data: &[u8]) -> Option<usize> {
    let mut bytes = Bytes::new(data);
    let (name, compress) = bytes.one(&KINDS);
    let mut file = data.get(1..).unwrap_or_default().to_vec();
    if compress {
        let mut compressed = Vec::new();
        let mut encoder = GzEncoder::new(&file[..], Compression::fast());
        encoder.read_to_end(&mut compressed).expect("memory does not fail");
        file = compressed;
    }
    let len = file.len() as u64;
    match gaurast_scene::read(Path::new(name), &mut &file[..], len) {
        Ok(scene) => {
            let count = scene.len();
            assert_eq!(scene.positions().len(), count);
            assert_eq!(scene.shapes().len(), count);
            assert_eq!(scene.sh().len(), count * scene.sh_stride());
            Some(count)
        }
        Err(error) => {
            // The message is a single line.
            let message = error.to_string();
            assert!(!message.is_empty() && !message.contains('\n'), "{message:?}");
            None
        }
    }
}

/// Seed files, one of each kind, in the form that [`load`] expects.
pub fn seeds() -> Vec<Vec<u8>> {
    let header = |format: &str, properties: &[&str]| {
        let properties: Vec<_> = properties.iter().map(|name| format!("property float {name}\n")).collect();
        format!(
            "ply\nformat {format} 1.0\ncomment made for tests\nelement vertex 3\n{}end_header\n",
            properties.concat()
        )
    };
    let names = [
        "x", "y", "z", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3", "opacity", "f_dc_0",
        "f_dc_1", "f_dc_2",
    ];
    let row = [0.1f32, 0.2, 3.0, -1.0, -2.0, -3.0, 1.0, 0.1, 0.2, 0.3, 2.0, 0.5, -0.5, 1.0];
    let kind = |kind: u8, file: Vec<u8>| [vec![kind], file].concat();
    let line = row.map(|value| value.to_string()).join(" ") + "\n";
    let ascii = header("ascii", &names) + &line.repeat(3);
    let little = row.iter().flat_map(|value| value.to_le_bytes());
    let little: Vec<u8> = little.collect::<Vec<_>>().repeat(3);
    let big = row.iter().flat_map(|value| value.to_be_bytes());
    let big: Vec<u8> = big.collect::<Vec<_>>().repeat(3);
    let mut splat = Vec::new();
    for _ in 0..3 {
        let floats = [0.1f32, 0.2, 3.0, 0.3, 0.2, 0.1];
        splat.extend(floats.iter().flat_map(|value| value.to_le_bytes()));
        splat.extend([200, 100, 50, 255, 255, 128, 130, 140]);
    }
    // Magic, version, count, degree, bits of a fraction, flags, reserved; then positions, alphas, colours, scales and
    // rotations of all Gaussians.
    let spz = |version: u32, rotation: usize| {
        let mut file = Vec::new();
        file.extend([0x5053_474eu32, version, 2].iter().flat_map(|word| word.to_le_bytes()));
        file.extend([0, 12, 0, 0]);
        file.extend((0..2 * (9 + 1 + 3 + 3 + rotation)).map(|at| (at * 37) as u8));
        file
    };
    vec![
        kind(0, ascii.into_bytes()),
        kind(0, [header("binary_little_endian", &names).into_bytes(), little].concat()),
        kind(0, [header("binary_big_endian", &names).into_bytes(), big].concat()),
        kind(0, compressed_ply()),
        kind(1, splat),
        kind(3, spz(2, 3)),
        kind(3, spz(3, 4)),
        kind(7, glb()),
    ]
}

/// A binary glTF file of one Gaussian.
fn glb() -> Vec<u8> {
    let sizes = [3, 4, 3, 1, 3];
    let names = ["ROTATION", "SCALE", "OPACITY", "SH_DEGREE_0_COEF_0"];
    let names = names.map(|name| format!("KHR_gaussian_splatting:{name}"));
    let names = std::iter::once("POSITION").chain(names.iter().map(String::as_str));
    let attributes: Vec<_> = names.enumerate().map(|(i, name)| format!("\"{name}\":{i}")).collect();
    let mut offset = 0;
    let (mut accessors, mut views) = (Vec::new(), Vec::new());
    for (i, size) in sizes.into_iter().enumerate() {
        let shape = ["", "SCALAR", "VEC2", "VEC3", "VEC4"][size];
        accessors.push(format!("{{\"bufferView\":{i},\"componentType\":5126,\"count\":1,\"type\":\"{shape}\"}}"));
        views.push(format!("{{\"buffer\":0,\"byteOffset\":{offset},\"byteLength\":{}}}", 4 * size));
        offset += 4 * size;
    }
    let mut json = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{{\"mesh\":0,\"scale\":[1,2,3]}}],\
         \"meshes\":[{{\"primitives\":[{{\"mode\":0,\"attributes\":{{{}}},\"extensions\":\
         {{\"KHR_gaussian_splatting\":{{\"kernel\":\"ellipse\"}}}}}}]}}],\
         \"accessors\":[{}],\"bufferViews\":[{}],\"buffers\":[{{\"byteLength\":{offset}}}]}}",
        attributes.join(","),
        accessors.join(","),
        views.join(",")
    )
    .into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut file = b"glTF".to_vec();
    let len = 12 + 8 + json.len() + 8 + offset;
    for word in [2, len as u32, json.len() as u32] {
        file.extend(word.to_le_bytes());
    }
    file.extend(b"JSON");
    file.extend(json);
    file.extend((offset as u32).to_le_bytes());
    file.extend(b"BIN\0");
    file.extend((0..offset / 4).flat_map(|i| (0.1 * i as f32 + 0.1).to_le_bytes()));
    file
}

/// A compressed PLY file as SuperSplat writes them, of one chunk of two Gaussians.
fn compressed_ply() -> Vec<u8> {
    let chunk = [
        "min_x",
        "min_y",
        "min_z",
        "max_x",
        "max_y",
        "max_z",
        "min_scale_x",
        "min_scale_y",
        "min_scale_z",
        "max_scale_x",
        "max_scale_y",
        "max_scale_z",
    ];
    let packed = ["packed_position", "packed_rotation", "packed_scale", "packed_color"];
    let floats: String = chunk.iter().map(|name| format!("property float {name}\n")).collect();
    let words: String = packed.iter().map(|name| format!("property uint {name}\n")).collect();
    let header =
        format!("ply\nformat binary_little_endian 1.0\nelement chunk 1\n{floats}element vertex 2\n{words}end_header\n");
    let bounds = [-1.0f32, -1.0, 2.0, 1.0, 1.0, 4.0, -4.0, -4.0, -4.0, -1.0, -1.0, -1.0];
    let mut file = header.into_bytes();
    file.extend(bounds.iter().flat_map(|value| value.to_le_bytes()));
    file.extend((0..32).map(|at| (at * 53) as u8));
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_seed_is_a_scene() {
        for (number, seed) in seeds().iter().enumerate() {
            assert!(load(seed).is_some_and(|count| count > 0), "seed {number}");
        }
        assert_eq!(load(&[]), None);
    }
}
