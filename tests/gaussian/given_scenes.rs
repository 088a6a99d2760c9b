//! The oracle on scenes that were trained, and beside another renderer.

use gaurast_samples::camera::{Camera, DEFAULT_FOV};
use gaurast_samples::scene::Scene;
use gaurast_tests::compare::Statistics;
use gaurast_tests::data::require_data;
use gaurast_tests::oracle::{OracleCamera, OracleState, render_bounded};
use gaurast_tests::scenes::SceneBuffers;

#[test]
fn trained_scenes_are_drawn_and_nearly_all_decidable() {
    for name in [
        "splats/skull.ply",
        "splats/playbot-125k.ply",
        "splats/yashica-t4-top8192.ply",
    ] {
        let Some(path) = require_data(name) else {
            continue;
        };
        let scene = Scene::load(&path).unwrap();
        let size = [192, 144];
        let camera = Camera::framing(&scene, DEFAULT_FOV, size).to_vulkan();
        let reference = render_bounded(
            &SceneBuffers::from(&scene).as_oracle(),
            &OracleCamera::new(&camera, size).unwrap(),
            &OracleState::default(),
        );
        let pixels = reference.nominal.len();
        assert!(
            reference
                .nominal
                .iter()
                .filter(|rgba| rgba[3] > 0.5)
                .count()
                > pixels / 20
        );
        assert!(reference.alternatives.len() * 100 < pixels, "{name}");
        assert_eq!(reference.exhausted, 0, "{name}");
    }
}

#[test]
fn another_renderer_made_the_same_pictures() {
    // Pictures by splat-transform with its own cut-offs, 8 bits a channel and lossy: another
    // independent renderer is as far from them as is asked here.
    for (name, eye, size, psnr) in [
        ("tiny", [0.0, 5.0, -8.0], [320, 240], 47.5),
        ("mid", [0.0, 10.0, -15.0], [640, 360], 40.5),
    ] {
        let scene = require_data(&format!("reference/{name}.generated.ply"));
        let picture = require_data(&format!("reference/{name}.webp"));
        let (Some(scene), Some(picture)) = (scene, picture) else {
            continue;
        };
        let scene = Scene::load(&scene).unwrap();
        let camera = Camera::look_at(eye, [0.0; 3], [0.0, 1.0, 0.0], 60.0, size).unwrap();
        let drawn = render_bounded(
            &SceneBuffers::from(&scene).as_oracle(),
            &OracleCamera::new(&camera.to_vulkan(), size).unwrap(),
            &OracleState::default(),
        );
        let picture = image::open(picture).unwrap().into_rgb8();
        let picture: Vec<[f32; 4]> = picture
            .pixels()
            .map(|pixel| pixel.0.map(|c| f32::from(c) / 255.0))
            .map(|[r, g, b]| [r, g, b, 1.0])
            .collect();
        let drawn: Vec<[f32; 4]> = drawn
            .to_f32()
            .iter()
            .map(|[r, g, b, _]| [r.min(1.0), g.min(1.0), b.min(1.0), 1.0])
            .collect();
        let statistics = Statistics::new(&drawn, &picture, size[0]);
        assert!(statistics.psnr > psnr, "{name}: {statistics}");
    }
}
