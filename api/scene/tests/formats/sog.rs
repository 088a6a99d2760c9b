//! SOG files.

use std::io::Write;
use std::path::Path;

use flate2::Compression;
use flate2::write::DeflateEncoder;
use gaurast_runner::data;
use gaurast_scene::{Antialiasing, Geometry, Options, Place, Reason, Scene, SceneError};
use serde_json::{Value, json};

use super::support::*;

/// A lossless WebP image of `texels`, each red, green, blue and alpha.
fn webp(width: u32, height: u32, texels: &[[u8; 4]]) -> Vec<u8> {
    let mut bytes = Vec::new();
    image_webp::WebPEncoder::new(&mut bytes)
        .encode(texels.as_flattened(), width, height, image_webp::ColorType::Rgba8)
        .expect("it fits");
    bytes
}

/// A zip archive of `entries`, deflated or stored.
fn zip(entries: &[(String, Vec<u8>)], deflate: bool) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut archive = rawzip::ZipArchiveWriter::new(&mut bytes);
    for (name, content) in entries {
        let method = if deflate { rawzip::CompressionMethod::DEFLATE } else { rawzip::CompressionMethod::STORE };
        let file = archive.new_file(name).compression_method(method);
        let (mut entry, config) = file.start().expect("memory takes it");
        let descriptor = if deflate {
            let encoder = DeflateEncoder::new(&mut entry, Compression::default());
            let mut writer = config.wrap(encoder);
            writer.write_all(content).expect("memory takes it");
            let (encoder, descriptor) = writer.finish().expect("memory takes it");
            encoder.finish().expect("memory takes it");
            descriptor
        } else {
            let mut writer = config.wrap(&mut entry);
            writer.write_all(content).expect("memory takes it");
            writer.finish().expect("memory takes it").1
        };
        entry.finish(descriptor).expect("memory takes it");
    }
    archive.finish().expect("memory takes it");
    bytes
}

/// The files of a scene of version 1 or 2: two Gaussians of degree 1 in images of 2x1 pixels.
pub fn entries(version: u32) -> Vec<(String, Vec<u8>)> {
    let codebook = |scale: f64| -> Vec<f64> { (0..256).map(|i| f64::from(i - 128) * scale).collect() };
    let image = |name: &str, texels: [[u8; 4]; 2]| (format!("{name}.webp"), webp(2, 1, &texels));
    let mut palette = vec![[0; 4]; 192];
    for (k, texel) in palette.iter_mut().enumerate().take(6) {
        *texel = [10 * k as u8, 10 * k as u8 + 1, 10 * k as u8 + 2, 255];
    }
    let files = |names: &[&str]| names.iter().map(|n| format!("{n}.webp")).collect::<Vec<_>>();
    let mut meta = json!({
        "means": {"mins": [-1.0, 0.0, 2.0], "maxs": [1.0, 0.5, 2.0], "files": files(&["means_l", "means_u"])},
        "scales": {"files": files(&["scales"])},
        "quats": {"files": files(&["quats"])},
        "sh0": {"files": files(&["sh0"])},
        "shN": {"files": files(&["shN_centroids", "shN_labels"])},
    });
    if version == 2 {
        meta["version"] = json!(2);
        meta["count"] = json!(2);
        meta["scales"]["codebook"] = json!(codebook(0.0625));
        meta["sh0"]["codebook"] = json!(codebook(0.03125));
        meta["shN"]["codebook"] = json!(codebook(0.015625));
        meta["shN"]["bands"] = json!(1);
        meta["shN"]["count"] = json!(2);
    } else {
        meta["means"]["shape"] = json!([2, 3]);
        meta["scales"]["mins"] = json!([-5.1, -5.1, -5.1]);
        meta["scales"]["maxs"] = json!([0.0, 0.0, 0.0]);
        meta["sh0"]["mins"] = json!([0.0, 0.0, 0.0, -2.55]);
        meta["sh0"]["maxs"] = json!([2.55, 2.55, 2.55, 2.55]);
        meta["shN"]["mins"] = json!(-1.275);
        meta["shN"]["maxs"] = json!(1.275);
    }
    vec![
        ("meta.json".to_owned(), meta.to_string().into_bytes()),
        image("means_l", [[0, 0, 0, 255], [255, 255, 255, 255]]),
        image("means_u", [[0, 0, 0, 255], [255, 255, 255, 255]]),
        image("scales", [[100, 110, 120, 255], [128, 64, 255, 255]]),
        image("quats", [[255, 128, 0, 252], [0, 255, 128, 254]]),
        image("sh0", [[128, 160, 96, 51], [0, 255, 128, 255]]),
        ("shN_centroids.webp".to_owned(), webp(192, 1, &palette)),
        image("shN_labels", [[1, 0, 0, 255], [0, 0, 0, 255]]),
    ]
}

/// An archive of `entries`, not compressed.
pub fn stored(entries: &[(String, Vec<u8>)]) -> Vec<u8> {
    zip(entries, false)
}

/// The archive of [`entries`] with the document changed by `edit`.
fn edited(version: u32, edit: impl FnOnce(&mut Value)) -> Vec<u8> {
    let mut entries = entries(version);
    let mut meta = serde_json::from_slice(&entries[0].1).expect("JSON");
    edit(&mut meta);
    entries[0].1 = meta.to_string().into_bytes();
    zip(&entries, false)
}

/// A valid archive.
pub fn archive(version: u32) -> Vec<u8> {
    edited(version, |_| {})
}

fn check_geometry(scene: &Scene) {
    assert_eq!((scene.len(), scene.sh_degree()), (2, 1));
    // exp(1) - 1, with signs.
    let far = 1_f64.exp_m1() as f32;
    let expected = [
        [-far, 0.0, 2_f64.exp_m1() as f32],
        // All Gaussians have the same z, whose span counts as one.
        [far, 0.5_f64.exp_m1() as f32, 3_f64.exp_m1() as f32],
    ];
    for (found, expected) in scene.positions().iter().zip(&expected) {
        close(found, expected, 1e-5);
    }
    let [half, middle] = [std::f32::consts::FRAC_1_SQRT_2, 0.002_773];
    close(&scene.shapes()[0].rotation, &[0.0, half, middle, -half], 1e-5);
    close(&scene.shapes()[1].rotation, &[-half, half, 0.0, middle], 1e-5);
}

#[gaurast_runner::test]
fn sog_values_of_both_versions() {
    for deflate in [false, true] {
        let scene = read("a.sog", &zip(&entries(2), deflate)).expect("a good file");
        check_geometry(&scene);
        let exp = |byte: i32| (f64::from(byte - 128) * 0.0625).exp() as f32;
        assert_eq!(scene.shapes()[0].scale, [exp(100), exp(110), exp(120)]);
        assert_eq!(scene.shapes()[1].scale, [exp(128), exp(64), exp(255)]);
        assert_eq!(scene.shapes().each_opacity(), [0.2, 1.0]);
        assert_eq!(scene.sh()[0], [0.0, 1.0, -1.0]);
        assert_eq!(scene.sh()[4], [-4.0, 127.0 * 0.03125, 0.0]);
        for k in 0..3 {
            let value = |byte: usize| (byte as f32 - 128.0) * 0.015625;
            let entry = |label: usize| {
                let first = 10 * (3 * label + k);
                [value(first), value(first + 1), value(first + 2)]
            };
            assert_eq!(scene.sh()[1 + k], entry(1));
            assert_eq!(scene.sh()[5 + k], entry(0));
        }
        assert_eq!(scene.metadata().antialiasing, None);
        assert!(scene.metadata().notes.is_empty());
    }

    let scene = read("a.sog", &archive(1)).expect("a good file");
    check_geometry(&scene);
    let exp = |byte: u8| (f64::from(byte) * 0.02 - 5.1).exp() as f32;
    close(&scene.shapes()[0].scale, &[exp(100), exp(110), exp(120)], 1e-6);
    let sigmoid = |x: f64| (1.0 / (1.0 + (-x).exp())) as f32;
    close(&scene.shapes().each_opacity(), &[sigmoid(0.02 * 51.0 - 2.55), sigmoid(2.55)], 1e-6);
    close(&scene.sh()[0], &[1.28, 1.6, 0.96], 1e-6);
    close(&scene.sh()[1], &[-0.975, -0.965, -0.955], 1e-6);
}

/// The opacities of a scene, to compare all at once.
trait EachOpacity {
    fn each_opacity(&self) -> Vec<f32>;
}

impl EachOpacity for [gaurast_scene::GaussianShape] {
    fn each_opacity(&self) -> Vec<f32> {
        self.iter().map(|shape| shape.opacity).collect()
    }
}

#[gaurast_runner::test]
fn the_model_of_sog_is_told() {
    let load = |model: Value| read("a.sog", &edited(2, |meta| meta["model"] = model)).expect("good");
    let scene = load(json!("antialiased"));
    assert_eq!(scene.antialiasing(), Antialiasing::Compensated);
    assert_eq!(load(json!("2dgs")).geometry(), Geometry::Surfel);
    assert_eq!(load(json!("default")).metadata().antialiasing, Some(Antialiasing::Off));
    let unknown = load(json!("wavy"));
    assert_eq!(unknown.metadata().antialiasing, None);
    assert_eq!(unknown.metadata().notes, [r#"the model "wavy" is unknown and ignored"#]);
}

#[gaurast_runner::test]
fn the_null_that_begins_a_codebook_is_guessed() {
    let scene = read("a.sog", &edited(2, |meta| meta["sh0"]["codebook"][0] = Value::Null));
    let red = scene.expect("a good file").sh()[4][0];
    close(&[red], &[0.03125 * (-127.0 - 254.0 / 255.0)], 1e-6);
}

#[gaurast_runner::test]
fn a_sog_folder_is_the_same_as_its_archive() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, content) in entries(2) {
        std::fs::write(folder.path().join(name), content).expect("written");
    }
    let expected = read("a.sog", &archive(2)).expect("a good file");
    let by_folder = gaurast_scene::open(folder.path()).expect("a good folder");
    let by_file = gaurast_scene::open(folder.path().join("meta.json")).expect("a good folder");
    assert_eq!(by_folder, expected);
    assert_eq!(by_file, expected);
    std::fs::remove_file(folder.path().join("sh0.webp")).expect("removed");
    let error = gaurast_scene::open(folder.path()).expect_err("a part is missing");
    assert!(matches!(
        error,
        SceneError::Malformed { place: Place::Entry(name), reason: Reason::Companion(_), .. } if name == "sh0.webp"
    ));
}

/// Writes a streamed scene: level 0 is both Gaussians of one file, level 1 one of them, and there is an environment.
fn streamed(folder: &Path) {
    let meta = json!({
        "lodLevels": 2,
        "filenames": ["0_0/meta.json", "b.sog"],
        "environment": "env/meta.json",
        "tree": {"bound": {"min": [0, 0, 0], "max": [1, 1, 1]}, "children": [
            {"lods": {"0": {"file": 0, "offset": 0, "count": 1}, "1": {"file": 1, "offset": 1, "count": 1}}},
            {"lods": {"0": {"file": 0, "offset": 1, "count": 1}}},
        ]},
    });
    std::fs::write(folder.join("lod-meta.json"), meta.to_string()).expect("written");
    std::fs::write(folder.join("b.sog"), archive(2)).expect("written");
    for below in ["0_0", "env"] {
        std::fs::create_dir(folder.join(below)).expect("made");
        for (name, content) in entries(2) {
            std::fs::write(folder.join(below).join(name), content).expect("written");
        }
    }
}

#[gaurast_runner::test]
fn streamed_sog_is_read_at_a_level() {
    let folder = tempfile::tempdir().expect("a folder");
    streamed(folder.path());
    let unit = read("a.sog", &archive(2)).expect("a good file");
    let load = |level| {
        let options = Options { level, ..Options::default() };
        gaurast_scene::open_with(folder.path(), &options, |file, _| file)
    };
    let positions = |indices: &[usize]| -> Vec<_> { indices.iter().map(|i| unit.positions()[*i]).collect() };
    assert_eq!(load(0).expect("level 0").positions(), positions(&[0, 1, 0, 1]));
    let coarse = load(1).expect("level 1");
    assert_eq!(coarse.positions(), positions(&[1, 0, 1]));
    assert_eq!(coarse.sh()[..4], unit.sh()[4..]);
    let error = load(2).expect_err("no such level").to_string();
    assert!(error.ends_with("lodLevels: level 2 is not one of the scene's 2 levels"), "{error}");
}

#[gaurast_runner::test]
fn malformed_sog_is_refused_with_place_and_reason() {
    let part = |part: &str| Place::Part(format!("meta.json, {part}"));
    let entry = |entry: &str| Place::Entry(entry.to_owned());
    let refused = |edit: fn(&mut Value)| refusal("a.sog", &edited(2, edit));

    let (place, reason) = refused(|meta| meta["version"] = json!(3));
    assert_eq!(place, part("version"));
    assert!(matches!(reason, Reason::Version { found: 3, .. }));
    for count in [json!(-1), json!(0.5), json!(1e300)] {
        let file = edited(2, |meta| meta["count"] = count);
        let (place, reason) = refusal("a.sog", &file);
        assert_eq!(place, part("count"));
        assert!(matches!(reason, Reason::Unsupported(_)));
    }
    let (place, reason) = refused(|meta| meta["count"] = json!(3));
    assert_eq!(place, entry("means_l.webp"));
    assert!(matches!(reason, Reason::Pixels { width: 2, height: 1, expected: 3 }));
    let (place, reason) = refused(|meta| meta["count"] = json!(0));
    assert!(matches!((place, reason), (p, Reason::Empty) if p == part("count")));
    let (place, reason) = refused(|meta| meta["scales"]["files"] = json!([]));
    assert!(matches!((place, reason), (p, Reason::Missing) if p == part("scales.files")));
    let (place, reason) = refused(|meta| meta["scales"]["files"] = json!(["none.webp"]));
    assert!(matches!((place, reason), (p, Reason::Missing) if p == entry("none.webp")));
    for name in ["../scales.webp", "/scales.webp", "a\\b", "NUL", "com1.webp", "", "C:x"] {
        let file = edited(2, |meta| meta["scales"]["files"] = json!([name]));
        let (place, reason) = refusal("a.sog", &file);
        assert!(matches!((place, reason), (p, Reason::Name) if p == entry(name)));
    }
    let (_, reason) = refused(|meta| meta["means"] = json!(7));
    assert!(matches!(reason, Reason::Json(_)));

    let mut entries = entries(2);
    entries[3].1.truncate(40);
    let (place, reason) = refusal("a.sog", &zip(&entries, true));
    assert_eq!(place, entry("scales.webp"));
    assert!(matches!(reason, Reason::Image(_)));
    // An image of a gigabyte for two Gaussians.
    entries[3].1 = webp(4096, 4096, &vec![[0; 4]; 1 << 24]);
    let (place, reason) = refusal("a.sog", &zip(&entries, true));
    assert_eq!(place, entry("scales.webp"));
    assert!(matches!(reason, Reason::Pixels { width: 4096, .. }));

    let mut bad_sum = archive(2);
    let at = bad_sum.windows(8).position(|w| w == b"\"mins\":[").expect("the document");
    bad_sum[at + 8] ^= 1;
    assert!(matches!(refusal("a.sog", &bad_sum).1, Reason::Zip(_)));
}

#[gaurast_runner::test]
fn sog_fixtures_are_what_their_names_say() {
    let fixtures = data("fixtures");
    let refused: &[(&str, IsReason)] = &[
        ("bad-bands", |r| matches!(r, Reason::Unsupported(_))),
        ("bad-zip", |r| matches!(r, Reason::Zip(_))),
        ("count-exceeds-plane", |r| matches!(r, Reason::Pixels { .. })),
        ("device-plane-name", |r| matches!(r, Reason::Name)),
        ("escaping-plane-name", |r| matches!(r, Reason::Name)),
        ("huge-count", |r| matches!(r, Reason::Unsupported(_))),
        ("huge-version", |r| matches!(r, Reason::Version { .. })),
        ("malformed-meta", |r| matches!(r, Reason::Json(_))),
        ("no-meta", |r| matches!(r, Reason::Missing)),
        ("short-codebook", |r| matches!(r, Reason::Count { found: 255, expected: 256 })),
        ("version-3", |r| matches!(r, Reason::Version { found: 3, .. })),
    ];
    for (name, is_reason) in refused {
        let path = fixtures.join(format!("{name}.sog"));
        let error = gaurast_scene::open(&path).expect_err(name);
        let SceneError::Malformed { reason, .. } = &error else {
            panic!("{name}: {error}");
        };
        assert!(is_reason(reason), "{name}: {error}");
        assert_eq!(error.to_string().lines().count(), 1, "{name}: {error}");
    }
    let load = |name: &str| gaurast_scene::open(fixtures.join(name)).expect(name);
    // Its second Gaussian's label is beyond the palette.
    let scene = load("labels-out-of-range.sog");
    assert_eq!((scene.len(), scene.sh_degree()), (2, 1));
    assert_ne!(scene.sh()[1], [0.0; 3]);
    assert_eq!(scene.sh()[5..], [[0.0; 3]; 3]);
    assert_eq!(scene.metadata().notes.len(), 1);
    // The values that the file was made from, in the frame of PLY files.
    let scene = load("kit-multi-degree3.sog");
    assert_eq!((scene.len(), scene.sh_degree()), (3, 3));
    for i in 0..3 {
        let f = i as f32;
        let position = [f + 0.5, f + 0.25, 1.0 - 2.0 * f];
        close(&scene.positions()[i], &position, 1e-4);
        let shape = scene.shapes()[i];
        close(&shape.scale, &[0.01, 0.02, 0.05].map(|s| s * (f + 1.0)), 1e-6);
        close(&[shape.opacity], &[0.25 * (f + 1.0)], 2.5e-3);
        let sh = &scene.sh()[16 * i..16 * (i + 1)];
        close(&sh[0], &[0.1, -0.2, 0.3].map(|c| c * (f + 1.0)), 1e-6);
        for (k, sign) in TURN.iter().enumerate() {
            let base = f + k as f32 / 100.0;
            close(&sh[1 + k], &[0.0, 0.001, 0.002].map(|c| sign * (base + c)), 1e-6);
        }
    }
}

/// Tests the same Gaussians as SOG and in another format, within the rounding of both: positions by a logarithm in 16
/// bits, opacities in 8.
#[gaurast_runner::test]
fn sog_files_agree_with_the_same_scenes_in_other_formats() {
    let agree = |a: &[f32], b: &[f32], tolerance: f32| {
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() <= tolerance * (1.0 + b.abs()), "{a} against {b}");
        }
    };
    for (sog, other) in [
        ("fixtures/equiv-degree1-offgrid.sog", "fixtures/equiv-degree1-offgrid-binary-le.ply"),
        ("fixtures/equiv-degree3-exact.sog", "fixtures/equiv-degree3-exact-v2.spz"),
    ] {
        let [a, b] = [sog, other].map(|file| gaurast_scene::open(data(file)).expect(file));
        assert_eq!((a.len(), a.sh_degree()), (b.len(), b.sh_degree()), "{sog}");
        for i in 0..a.len() {
            agree(&a.positions()[i], &b.positions()[i], 1e-4);
            agree(&a.shapes()[i].scale, &b.shapes()[i].scale, 1e-5);
            agree(&[a.shapes()[i].opacity], &[b.shapes()[i].opacity], 2.5e-3);
        }
        agree(a.sh().as_flattened(), b.sh().as_flattened(), 1e-5);
    }
}

/// Tests a SOG file against a PLY file that the format's own tool decoded from it: the same Gaussians in the same
/// order, except that the tool clamps opacities, which are logits in PLY, to 1/512 and 511/512.
#[gaurast_runner::test]
fn a_real_sog_has_the_values_that_its_own_tool_decodes() {
    let sog = gaurast_scene::open(data("splats/skull.sog")).expect("a good file");
    let ply = gaurast_scene::open(data("splats/skull.ply")).expect("a good file");
    assert_eq!((sog.len(), sog.sh_degree()), (94_936, 3));
    for i in 0..sog.len() {
        close(&sog.positions()[i], &ply.positions()[i], 1e-6);
        let (a, b) = (sog.shapes()[i], ply.shapes()[i]);
        close(&a.scale, &b.scale, 1e-6);
        close(&a.rotation, &b.rotation, 1e-6);
        let opacity = a.opacity.clamp(1.0 / 512.0, 511.0 / 512.0);
        close(&[opacity], &[b.opacity], 2e-6);
    }
    close(sog.sh().as_flattened(), ply.sh().as_flattened(), 1e-6);
}
