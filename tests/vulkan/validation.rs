//! A Gaussian draw through the loader, under the validation layer.

use crate::devices::everything_of;
use crate::scene::{CENTER, Scene, assert_close, at, premultiplied, splat, splats};
use gaurast_runner::{Case, Need};
use gaurast_testkit::loader::through_the_loader;
use gaurast_testkit::{Driver, Gpu, Opening};
use std::collections::BTreeSet;
use std::ffi::CStr;

const LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// The layer's messages about valid usage of the extension, which it does not know.
const EXPECTED: &[&str] = &[
    // The device extension is unknown.
    "VUID_Undefined",
    // The topology is out of the enum's range.
    "VUID-VkPipelineInputAssemblyStateCreateInfo-topology-parameter",
    // The pipeline has no vertex stage, and so no stage at all.
    "VUID-VkGraphicsPipelineCreateInfo-pStages-06600",
    "VUID-VkGraphicsPipelineCreateInfo-pStages-06896",
    "VUID-VkGraphicsPipelineCreateInfo-stage-00727",
    "VUID-VkGraphicsPipelineCreateInfo-stageCount-06604",
];

/// Advice of the layer on speed, which is ignored: the testkit keeps every image in one layout.
const ADVICE: &str = "For optimal performance";

#[gaurast_runner::test(needs = [Need::ValidationLayer])]
fn a_draw_is_as_it_is_without_the_layer(case: &Case) {
    through_the_loader(case, || {
        let color = [0.9, 0.2, 0.1];
        let gaussians = [splat([0.0, 0.0, 5.0], 0.1, 0.8, color)];
        let opening = Opening {
            layers: &[LAYER],
            ..everything_of(Driver::Loaded)
        };
        let gpu = Gpu::open(&opening).expect("a device");
        let scene = Scene::on(gpu, &gaussians, &splats());
        let pixels = scene.draw([0.0; 4], |device, commands| {
            // SAFETY: see the crate.
            unsafe { device.cmd_draw(commands, 1, 1, 0, 0) };
        });
        assert_close(at(&pixels, CENTER), premultiplied(color, 0.8));
        let messages = scene.gpu.message_texts();
        let ids: BTreeSet<_> = messages.iter().map(|message| id(message)).collect();
        let unexpected: Vec<_> = messages
            .iter()
            .filter(|message| !EXPECTED.contains(&id(message)) && !message.contains(ADVICE))
            .collect();
        assert!(unexpected.is_empty(), "{unexpected:#?}");
        let layer_was_there = "VUID-VkPipelineInputAssemblyStateCreateInfo-topology-parameter";
        assert!(ids.contains(layer_was_there), "{ids:?}");
    });
}

/// The id in a message of the layer: "Validation Error: [ ID ] ...".
fn id(message: &str) -> &str {
    let after = message.split_once("[ ").map_or(message, |(_, rest)| rest);
    after.split_once(" ]").map_or(after, |(id, _)| id)
}
