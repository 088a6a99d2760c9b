//! The renderer's pictures against pictures that another renderer made.

use gaurast_samples::camera::Camera;
use gaurast_samples::output;
use gaurast_samples::renderer::Renderer;
use gaurast_samples::scene::Scene;
use gaurast_tests::compare::Statistics;
use gaurast_tests::contexts::{Settings, with_settings};
use gaurast_tests::data::require_data;

/// `reference/<name>` from its camera: PSNR of the PNG that the `gaurast` command would write.
#[track_caller]
fn assert_psnr(name: &str, eye: [f64; 3], size: [u32; 2], least: f64) {
    let scene = require_data(&format!("reference/{name}.generated.ply"));
    let picture = require_data(&format!("reference/{name}.webp"));
    let (Some(scene), Some(picture)) = (scene, picture) else {
        return;
    };
    let scene = Scene::load(&scene).expect("a scene");
    // The other renderer's world has y upwards.
    let camera = Camera::look_at(eye, [0.0; 3], [0.0, 1.0, 0.0], 60.0, size).expect("a camera");
    let renderer = with_settings(&Settings::default(), || {
        Renderer::new(vulkan_gaurast::entry())
    });
    let mut renderer = renderer.expect("a device");
    let uploaded = renderer.upload(&scene, None).expect("uploaded");
    let frame = renderer.render(&uploaded, &camera).expect("a frame");

    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("drawn.png");
    output::write(&path, &frame.picture, None).expect("written");
    let statistics = Statistics::new(&pixels(&path), &pixels(&picture), size[0]);
    eprintln!("{name}: {statistics}");
    assert!(statistics.psnr >= least, "{name}: {statistics}");
}

fn pixels(path: &std::path::Path) -> Vec<[f32; 4]> {
    let picture = image::open(path).expect("a picture").into_rgb8();
    let pixel = |[r, g, b]: [u8; 3]| [r, g, b, 255].map(|c| f32::from(c) / 255.0);
    picture.pixels().map(|rgb| pixel(rgb.0)).collect()
}

/// 400 round Gaussians; the two renderers cut them off elsewhere.
#[test]
fn tiny_is_as_another_renderer_drew_it() {
    assert_psnr("tiny", [0.0, 5.0, -8.0], [320, 240], 45.0);
}

/// 48,400 of them.
#[test]
fn mid_is_as_another_renderer_drew_it() {
    assert_psnr("mid", [0.0, 10.0, -15.0], [640, 360], 40.0);
}
