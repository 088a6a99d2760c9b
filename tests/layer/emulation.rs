//! `VK_LAYER_GAURAST_emulation` over lavapipe: cases of the conformance program, as it is.

use gaurast_conformance::{Device, Outcome, all, cases, run};
use gaurast_runner::{Case, Need, Variant};
use gaurast_testkit::loader::with_emulation;

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
#[gaurast_runner::test(needs = [Need::Lavapipe], each = ["commands", "views", "footprints"].map(Variant::new).to_vec())]
fn pairs_that_do_not_fit_are_drawn(case: &Case) {
    with_emulation(case, &[("GAURAST_EMULATION_PAIRS", "10")], || holds(case));
}
