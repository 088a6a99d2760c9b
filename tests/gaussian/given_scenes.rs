//! The oracle on trained scenes, compared with another renderer.

use gaurast_runner::{Case, Need, Variant, data};
use gaurast_scene::camera::DEFAULT_FOV;
use gaurast_tests::compare::Statistics;
use gaurast_tests::oracle::{OracleCamera, OracleState, render_bounded};
use gaurast_tests::scenes::SceneBuffers;

use super::reference::{Given, MID, TINY};
use super::{PLAYBOT, SKULL};

const TRAINED: [&str; 3] = [SKULL, PLAYBOT, "splats/yashica-t4-top8192.ply"];

/// A variant for each of [`TRAINED`].
fn trained() -> Vec<Variant> {
    let variant = |file| Variant { needs: vec![Need::Data(file)], ..Variant::new(file) };
    TRAINED.map(variant).into()
}

#[gaurast_runner::test(each = trained())]
fn trained_scenes_are_drawn_and_nearly_all_decidable(case: &Case) {
    let file = TRAINED.into_iter().find(|file| *file == case.variant());
    let scene = gaurast_scene::open(data(file.expect("a file"))).unwrap();
    let size = [192, 144];
    let camera = gaurast_scene::frame_middle(&scene, DEFAULT_FOV, size).to_vulkan();
    let reference = render_bounded(
        &SceneBuffers::from(&scene).as_oracle(),
        &OracleCamera::new(&camera, size).unwrap(),
        &OracleState::default(),
    );
    let pixels = reference.nominal.len();
    let covered = reference.nominal.iter().filter(|rgba| rgba[3] > 0.5);
    assert!(covered.count() > pixels / 20);
    assert!(reference.alternatives.len() * 100 < pixels);
    assert_eq!(reference.exhausted, 0);
}

/// Checks the PSNR of the oracle's picture. The given pictures come from splat-transform, which has its own cut-offs
/// and writes lossy 8-bit images. Another independent renderer differs from them by about as much.
fn assert_psnr(given: &Given, least: f64) {
    let scene = gaurast_scene::open(data(given.scene)).unwrap();
    let drawn = render_bounded(
        &SceneBuffers::from(&scene).as_oracle(),
        &OracleCamera::new(&given.camera().to_vulkan(), given.size).unwrap(),
        &OracleState::default(),
    );
    let drawn: Vec<[f32; 4]> =
        drawn.to_f32().iter().map(|[r, g, b, _]| [r.min(1.0), g.min(1.0), b.min(1.0), 1.0]).collect();
    let statistics = Statistics::new(&drawn, &given.pixels(), given.size[0]);
    assert!(statistics.psnr > least, "{statistics}");
}

#[gaurast_runner::test(needs = TINY.needs())]
fn another_renderer_made_the_same_picture_of_tiny() {
    assert_psnr(&TINY, 47.5);
}

#[gaurast_runner::test(needs = MID.needs())]
fn another_renderer_made_the_same_picture_of_mid() {
    assert_psnr(&MID, 40.5);
}
