//! `VK_LAYER_GAURAST_emulation` over lavapipe: cases of the conformance program, as it is.

use gaurast_conformance::{Device, Outcome, all, cases, run};
use gaurast_runner::{Case, Need, Variant};
use gaurast_testkit::loader::with_emulation;
use gaurast_tests::long_run::memory;

/// Parts of the conformance program, each with the least number of its cases that the layer must pass.
const PARTS: &[(&str, &[&str], usize)] = &[
    ("commands", &["topology.*.primitive.*", "draws.indirect", "draws.multi"], 20),
    ("cameras", &["camera.pinhole", "camera.parallel"], 15),
    ("passes", &["passes"], 12),
    ("instances", &["instances.one", "instances.pinhole"], 10),
    ("footprints", &["footprint.ellipse", "footprint.tile_square"], 20),
    ("dynamic states", &["dynamic_state"], 15),
    ("numerics", &["numerics.needles", "numerics.discs"], 12),
    ("views", &["views"], 14),
    ("updates", &["updates"], 20),
    ("libraries", &["libraries"], 9),
    ("angles", &["camera.fisheye", "camera.panorama"], 20),
    ("sigma points", &["unscented.pinhole"], 20),
    ("surfels", &["surfel"], 50),
    ("depths", &["depth.d16", "depth.d24", "depth.d32", "depth.samples", "depth.median"], 60),
    ("stencils", &["stencil.pass", "stencil.fail", "stencil.depth_fail", "stencil.compare", "stencil.masks"], 35),
    ("logarithms and logits", &["activation"], 12),
    ("areas", &["interactions.viewport", "interactions.scissor", "interactions.area"], 38),
];

fn parts() -> Vec<Variant> {
    PARTS.iter().map(|(name, ..)| Variant::new(*name)).collect()
}

/// Runs a part's cases: none fails, and enough pass.
fn holds(case: &Case) {
    let (_, patterns, least) = PARTS.iter().find(|(name, ..)| *name == case.variant()).expect("a part");
    let device = Device::open("llvmpipe").unwrap_or_else(|error| panic!("{}", error.0));
    let mut failures = Vec::new();
    let mut passed = 0;
    for one in all().iter().filter(|one| patterns.iter().any(|pattern| cases::fits(&one.path(), pattern))) {
        match run(one, &device) {
            Outcome::Pass(_) => passed += 1,
            Outcome::Fail(failure) => failures.push(format!("{}: {}", one.path(), failure.message)),
            Outcome::NotSupported(_) => {}
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
    assert!(passed >= *least, "{passed}");
}

#[gaurast_runner::test(needs = [Need::Lavapipe], each = parts())]
fn lavapipe_draws_gaussians(case: &Case) {
    with_emulation(case, &[], || holds(case));
}

/// Pairs that do not fit are looked for by every tile: the pictures are as right.
#[gaurast_runner::test(needs = [Need::Lavapipe], each = ["commands", "views", "footprints", "areas"].map(Variant::new).to_vec())]
fn pairs_that_do_not_fit_are_drawn(case: &Case) {
    with_emulation(case, &[("GAURAST_EMULATION_PAIRS", "10")], || holds(case));
}

/// Draws a generated garden by the first device of the loader, and writes its picture to the file that the environment names.
fn draw_garden() {
    // SAFETY: the loader is the system's own.
    let entry = unsafe { ash::Entry::load() }.expect("the loader");
    let mut renderer = gaurast_render::Renderer::new(entry).expect("a renderer");
    let scene = gaurast_scene::garden::scene(7, 2000);
    let camera = gaurast_scene::garden::camera(None, [96, 64]).expect("a camera");
    let picture = renderer.draw(&scene, &camera).expect("a picture");
    let file = std::env::var_os(PICTURE).expect("a file");
    std::fs::write(file, bytemuck::cast_slice(&picture.pixels)).expect("the picture is written");
}

/// The variable for the file of a picture.
const PICTURE: &str = "GAURAST_TEST_PICTURE";

/// A picture is the same, bit for bit, however many pairs fit the memory.
#[gaurast_runner::test(needs = [Need::Lavapipe])]
fn pictures_do_not_depend_on_the_memory_for_pairs(case: &Case) {
    if case.is_alone() {
        return draw_garden();
    }
    let folder = tempfile::tempdir().expect("a folder");
    let pictures = ["100000", "1000", "1"].map(|pairs| {
        let file = folder.path().join(pairs);
        let path = file.to_str().expect("a path of Unicode");
        with_emulation(case, &[("GAURAST_EMULATION_PAIRS", pairs), (PICTURE, path)], || {});
        std::fs::read(&file).expect("the picture")
    });
    let [all, some, none] = &pictures;
    assert!(all.iter().any(|byte| *byte != 0));
    assert!(all == some && all == none, "pictures differ");
}

/// Frames leave nothing behind.
#[gaurast_runner::test(needs = [Need::Lavapipe])]
fn frames_take_no_more_memory(case: &Case) {
    with_emulation(case, &[], || {
        // SAFETY: the loader is the system's own.
        let entry = unsafe { ash::Entry::load() }.expect("the loader");
        let mut renderer = gaurast_render::Renderer::new(entry).expect("a renderer");
        let scene = gaurast_scene::garden::scene(7, 50);
        let camera = gaurast_scene::garden::camera(None, [32, 32]).expect("a camera");
        let frames = if gaurast_runner::is_long() { 10_000 } else { 200 };
        let mut early = None;
        for frame in 0..frames {
            renderer.draw(&scene, &camera).expect("a picture");
            if frame == frames / 4 {
                early = memory("VmRSS:");
            }
        }
        let (Some(early), Some(late)) = (early, memory("VmRSS:")) else {
            return;
        };
        assert!(late < early + (4 << 20), "{early} bytes, and {late} later");
    });
}
