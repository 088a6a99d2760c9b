//! Both models of the rasterizer's timing on the recorded work of devices: scenes with triangles and Gaussians, and
//! random interleavings.

use ash::vk;
use gaurast_runner::{Case, Need, Variant};
use gaurast_testkit::Gpu;
use gaurast_testkit::Settings;
use gaurast_tests::recorded::{Agreement, recorded};
use std::sync::Arc;

use super::hybrid_scenes::{GARDEN, WITH_PLAYBOT, What, garden, playbot};
use super::interleavings;

/// A variant for each of these scenes, by name.
fn hybrids() -> Vec<Variant> {
    let variant = |name, needs: &[Need]| Variant { needs: needs.to_vec(), ..Variant::new(name) };
    vec![variant("garden", &GARDEN), variant("garden, four samples", &GARDEN), variant("playbot", &WITH_PLAYBOT)]
}

#[gaurast_runner::test(each = hybrids())]
fn models_of_the_rasterizer_agree_on_hybrids(case: &Case) {
    let hybrid = match case.variant() {
        "garden" => garden("head in the garden", vk::Format::D32_SFLOAT, 1),
        "playbot" => playbot(),
        _ => garden("head in the garden, four samples", vk::Format::D16_UNORM, 4),
    };
    let trace = Arc::default();
    let gpu = Gpu::embedded(&Settings { trace: Some(&trace), ..Settings::default() });
    let gpu = gpu.expect("a device");
    hybrid.draw(&gpu, What::Everything);
    drop(gpu);
    let trace = recorded(&trace);
    let hides = (trace.frames.iter().flat_map(|frame| &frame.draws))
        .any(|draw| draw.tiles.iter().any(|tile| tile.hidden_rest > 0));
    assert!(hides, "the head hides Gaussians");
    let mut agreement = Agreement::default();
    agreement.add(hybrid.name, &trace);
    agreement.judge(6);
}

#[gaurast_runner::test]
fn models_of_the_rasterizer_agree_on_interleavings() {
    let mut agreement = Agreement::default();
    for seed in 0..60 {
        agreement.add(&format!("interleaving {seed}"), &interleavings::work(seed));
    }
    agreement.judge(100);
}
