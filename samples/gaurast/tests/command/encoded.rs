//! Tests of compressed scenes that are drawn as they lie: the device decodes their integers.

use std::fmt::Write;
use std::path::Path;

use gaurast_render::Renderer;
use gaurast_runner::Need;
use gaurast_scene::{Axes, Camera, Loaded, Options, Scene};

/// The greatest difference of a component from the decoded scene's picture, relative to 1 or to the component: what the contract
/// allows a picture, twice.
const TOLERANCE: f32 = 1e-5;

/// Draws the scene of a compressed file as it lies, and decoded, and compares the pictures.
fn check(renderer: &mut Renderer, path: &Path, options: &Options, sh_degree: Option<u32>) {
    let name = path.display();
    let loaded = gaurast_scene::load_with(path, options, |file, _| file).expect("a scene");
    let Loaded::Encoded(encoded) = loaded else {
        panic!("{name} is decoded");
    };
    let decoded = encoded.decode().expect("memory");
    let outline = encoded.outline().expect("memory");
    assert_eq!((outline.positions(), outline.shapes()), (decoded.positions(), decoded.shapes()), "{name}");
    let camera = gaurast_scene::frame(&outline, 50.0, [160, 90]);
    let expected = draw_decoded(renderer, &decoded, &camera, sh_degree);
    let scene = renderer.upload_encoded(*encoded, sh_degree).expect("uploaded");
    // Clusters are made of what later frames read.
    for frame in 0..4 {
        let picture = renderer.render(&scene, &camera).expect("a frame").picture;
        let numbers = picture.pixels.as_flattened().iter().zip(expected.as_flattened());
        for (found, expected) in numbers {
            let allowed = TOLERANCE * expected.abs().max(1.0);
            assert!((found - expected).abs() <= allowed, "{name}, frame {frame}: {found}, not {expected}");
        }
    }
}

/// The picture of a decoded scene, which is not empty.
fn draw_decoded(renderer: &mut Renderer, scene: &Scene, camera: &Camera, sh_degree: Option<u32>) -> Vec<[f32; 4]> {
    let uploaded = renderer.upload(scene, sh_degree).expect("uploaded");
    let picture = renderer.render(&uploaded, camera).expect("a frame").picture;
    assert!(picture.pixels.iter().any(|pixel| pixel[3] > 0.1), "an empty picture of {} Gaussians", scene.len());
    picture.pixels
}

fn renderer() -> Renderer {
    let renderer = Renderer::new(vulkan_gaurast::entry()).expect("a device");
    assert!(renderer.draws_encoded());
    renderer
}

/// A compressed PLY of `count` Gaussians with harmonics of degree 2.
pub(super) fn compressed_ply(count: usize) -> String {
    let mut state = 7_u64;
    let mut number = |low: f32, high: f32| {
        // Knuth's generator of 64 bits.
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (state >> 40) as f32 / (1 << 24) as f32
    };
    let chunks = count.div_ceil(256);
    let mut text = format!("ply\nformat ascii 1.0\nelement chunk {chunks}\n");
    for part in ["", "scale_"] {
        for end in ["min", "max"] {
            for axis in ["x", "y", "z"] {
                writeln!(text, "property float {end}_{part}{axis}").expect("text");
            }
        }
    }
    writeln!(text, "element vertex {count}").expect("text");
    for name in ["position", "rotation", "scale", "color"] {
        writeln!(text, "property uint packed_{name}").expect("text");
    }
    writeln!(text, "element sh {count}").expect("text");
    for index in 0..24 {
        writeln!(text, "property uchar f_rest_{index}").expect("text");
    }
    text += "end_header\n";
    for _ in 0..chunks {
        let low: Vec<f32> = (0..3).map(|_| number(-2.0, -1.0)).collect();
        let high: Vec<f32> = (0..3).map(|_| number(1.0, 2.0)).collect();
        let bounds = low.iter().chain(&high).map(f32::to_string).collect::<Vec<_>>().join(" ");
        writeln!(text, "{bounds} -4 -4.5 -5 -2 -2.5 -2").expect("text");
    }
    for _ in 0..count {
        let words: Vec<String> = (0..4).map(|_| (number(0.0, 4.2e9) as u32).to_string()).collect();
        writeln!(text, "{}", words.join(" ")).expect("text");
    }
    for _ in 0..count {
        let codes: Vec<String> = (0..24).map(|_| (number(90.0, 166.0) as u8).to_string()).collect();
        writeln!(text, "{}", codes.join(" ")).expect("text");
    }
    text
}

#[gaurast_runner::test]
fn a_compressed_ply_as_it_lies_is_the_decoded_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.compressed.ply");
    std::fs::write(&path, compressed_ply(700)).expect("written");
    let mut renderer = renderer();
    for degree in [None, Some(0), Some(1)] {
        check(&mut renderer, &path, &Options::default(), degree);
    }
    for axes in ["rub", "luf", "rfu"] {
        let axes: Option<Axes> = Some(axes.parse().expect("axes"));
        check(&mut renderer, &path, &Options { axes, ..Options::default() }, None);
    }
}

#[gaurast_runner::test]
fn sorting_by_z_wants_a_decoded_scene() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.compressed.ply");
    std::fs::write(&path, compressed_ply(3)).expect("written");
    let loaded = gaurast_scene::load_with(&path, &Options::default(), |file, _| file).expect("a scene");
    let Loaded::Encoded(encoded) = loaded else {
        panic!("it is decoded");
    };
    let mut renderer = renderer();
    let mut scene = renderer.upload_encoded(*encoded, None).expect("uploaded");
    let by_z = gaurast_render::Settings { by_z: true, ..Default::default() };
    let refused = renderer.set(&mut scene, by_z).expect_err("refused");
    assert!(refused.to_string().contains("decoded first"), "{refused}");
}

#[gaurast_runner::test(needs = [Need::Data("splats/skull.sog")])]
fn files_of_other_programs_as_they_lie_are_the_decoded_pictures() {
    let data = gaurast_runner::data_folder().expect("the folder of data");
    let mut renderer = renderer();
    let files = [
        "splats/guitar.compressed.ply",
        "splats/skull.sog",
        "splats/yashica-t4-top8192.sog",
        "splats/yashica-t4-top8192.spz",
        "splats/leica-sofort-top8192.spz",
        "fixtures/labels-out-of-range.sog",
        "fixtures/decode-degree4-v2.spz",
        "fixtures/minimal-v3.spz",
        "formats/v4-a.spz",
    ];
    for file in files {
        check(&mut renderer, &data.join(file), &Options::default(), None);
    }
}
