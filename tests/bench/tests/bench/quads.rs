//! Quads on any device give the picture of the Gaussian topology.

use gaurast_bench::quads::QuadRenderer;
use gaurast_oracle::compare::Statistics;
use gaurast_picture::Picture;
use gaurast_render::Renderer;
use gaurast_scene::Scene;
use gaurast_scene::camera::Camera;

const SIZE: [u32; 2] = [160, 90];
const ALPHA_FLOOR: f32 = 1.0 / 255.0;

/// Scenes with their views, of Gaussians small and large.
fn scenes() -> Vec<(Scene, Camera)> {
    vec![
        (gaurast_oracle::scenes::synthetic(2, 5000), gaurast_oracle::scenes::synthetic_camera(SIZE)),
        (gaurast_scene::garden::scene(2, 8000), gaurast_scene::garden::camera(None, SIZE).expect("a camera")),
    ]
}

fn meant(scene: &Scene, camera: &Camera) -> Picture {
    let mut renderer = Renderer::new(vulkan_gaurast::entry()).expect("a device");
    let scene = renderer.upload(scene, None).expect("uploaded");
    renderer.render(&scene, camera).expect("a frame").picture
}

/// Compares every pixel. The remaining differences come from binary32 and from contributions behind saturated pixels.
fn compare(quads: &mut QuadRenderer) {
    for (scene, camera) in scenes() {
        let expected = meant(&scene, &camera);
        // The first size is smaller, so that the second frame replaces the buffers.
        for camera in [camera.resized([64, 64]), camera] {
            let drawn = quads.render(&scene, &camera, 3, ALPHA_FLOOR);
            let drawn = drawn.expect("a frame").picture;
            if (drawn.width, drawn.height) != (SIZE[0], SIZE[1]) {
                continue;
            }
            let statistics = Statistics::new(&drawn.pixels, &expected.pixels, SIZE[0]);
            assert!(statistics.psnr > 60.0, "{}: {statistics}", quads.device_name());
            assert!(statistics.max < 0.02, "{}: {statistics}", quads.device_name());
        }
    }
}

#[gaurast_runner::test]
fn quads_on_this_driver_show_what_gaussians_are() {
    compare(&mut QuadRenderer::new(vulkan_gaurast::entry(), "", 1).expect("a device"));
}

#[gaurast_runner::test(needs = [gaurast_runner::Need::Lavapipe])]
fn quads_on_lavapipe_show_what_gaussians_are() {
    compare(&mut QuadRenderer::through_the_loader("llvmpipe", 1).expect("lavapipe"));
}

#[gaurast_runner::test]
fn a_device_that_is_not_there_is_named() {
    let error = QuadRenderer::new(vulkan_gaurast::entry(), "no such device", 1).err().expect("no device");
    assert!(error.to_string().contains("no such device"), "{error}");
}

#[gaurast_runner::test]
fn an_empty_scene_is_an_empty_picture() {
    let mut quads = QuadRenderer::new(vulkan_gaurast::entry(), "", 1).expect("a device");
    let scene = Scene::with_capacity(0, 0);
    let frame =
        quads.render(&scene, &gaurast_oracle::scenes::synthetic_camera([8, 8]), 0, ALPHA_FLOOR).expect("a frame");
    assert_eq!(frame.picture.pixels, vec![[0.0; 4]; 64]);
}
