//! Pictures of the renderer, compared with those of another renderer.

use std::path::Path;

use gaurast_render::Renderer;
use gaurast_runner::{Need, data};
use gaurast_scene::camera::Camera;
use gaurast_tests::compare::Statistics;

/// A scene, and another renderer's picture of it.
pub(super) struct Given {
    /// The scene's file.
    pub scene: &'static str,
    /// The picture's file.
    picture: &'static str,
    eye: [f64; 3],
    /// The picture's size in pixels.
    pub size: [u32; 2],
}

/// A scene of 400 round Gaussians.
pub(super) const TINY: Given = Given {
    scene: "reference/tiny.generated.ply",
    picture: "reference/tiny.webp",
    eye: [0.0, 5.0, -8.0],
    size: [320, 240],
};

/// A scene of 48,400 round Gaussians.
pub(super) const MID: Given = Given {
    scene: "reference/mid.generated.ply",
    picture: "reference/mid.webp",
    eye: [0.0, 10.0, -15.0],
    size: [640, 360],
};

impl Given {
    /// The two files.
    pub fn needs(&self) -> [Need; 2] {
        [Need::Data(self.scene), Need::Data(self.picture)]
    }

    /// The camera. In the other renderer's world y points up.
    pub fn camera(&self) -> Camera {
        let up = [0.0, 1.0, 0.0];
        Camera::look_at(self.eye, [0.0; 3], up, 60.0, self.size).expect("a camera")
    }

    /// The pixels of the given picture.
    pub fn pixels(&self) -> Vec<[f32; 4]> {
        pixels(&data(self.picture))
    }
}

fn pixels(path: &Path) -> Vec<[f32; 4]> {
    let picture = image::open(path).expect("a picture").into_rgb8();
    let pixel = |[r, g, b]: [u8; 3]| [r, g, b, 255].map(|c| f32::from(c) / 255.0);
    picture.pixels().map(|rgb| pixel(rgb.0)).collect()
}

/// Checks the PSNR of the PNG that the `gaurast` command would write.
fn assert_psnr(given: &Given, least: f64) {
    let scene = gaurast_scene::open(data(given.scene)).expect("a scene");
    let mut renderer = Renderer::new(vulkan_gaurast::entry()).expect("a device");
    let uploaded = renderer.upload(&scene, None).expect("uploaded");
    let frame = renderer.render(&uploaded, &given.camera());

    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("drawn.png");
    gaurast_picture::write(&path, &frame.expect("a frame").picture, None).expect("written");
    let statistics = Statistics::new(&pixels(&path), &given.pixels(), given.size[0]);
    assert!(statistics.psnr >= least, "{statistics}");
}

/// The two renderers cut Gaussians off at different distances.
#[gaurast_runner::test(needs = TINY.needs())]
fn tiny_is_as_another_renderer_drew_it() {
    assert_psnr(&TINY, 45.0);
}

#[gaurast_runner::test(needs = MID.needs())]
fn mid_is_as_another_renderer_drew_it() {
    assert_psnr(&MID, 40.0);
}
