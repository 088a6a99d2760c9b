//! Both models of the rasterizer's timing over what devices recorded: hybrids of triangles and Gaussians, and random
//! interleavings.

use gaurast_tests::contexts::Settings;
use gaurast_tests::recorded::{Agreement, read};
use gaurast_tests::triangles::Gpu;

use crate::hybrid_scenes::{What, garden, playbot};
use crate::interleavings;

#[test]
fn models_of_the_rasterizer_agree_on_hybrids() {
    let folder = tempfile::tempdir().expect("a folder");
    let hybrids = [
        garden("head in the garden", ash::vk::Format::D32_SFLOAT, 1),
        garden(
            "head in the garden, four samples",
            ash::vk::Format::D16_UNORM,
            4,
        ),
        playbot(),
    ];
    let mut agreement = Agreement::default();
    let mut drawn = 0;
    for hybrid in hybrids.into_iter().flatten() {
        let path = folder.path().join(format!("{drawn}.json"));
        let gpu = Gpu::embedded(&Settings {
            trace: Some(&path),
            ..Settings::default()
        });
        hybrid.draw(&gpu.expect("a device"), What::Everything);
        let trace = read(&path);
        let hides = (trace.frames.iter().flat_map(|frame| &frame.draws))
            .any(|draw| draw.tiles.iter().any(|tile| tile.hidden_rest > 0));
        assert!(hides, "{}: the head hides Gaussians", hybrid.name);
        agreement.add(hybrid.name, &trace);
        drawn += 1;
    }
    if drawn > 0 {
        agreement.judge(drawn);
    }
}

#[test]
fn models_of_the_rasterizer_agree_on_interleavings() {
    let mut agreement = Agreement::default();
    for seed in 0..60 {
        agreement.add(&format!("interleaving {seed}"), &interleavings::work(seed));
    }
    agreement.judge(100);
}
