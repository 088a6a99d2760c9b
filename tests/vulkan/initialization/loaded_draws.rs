//! Gaussian draws through the Vulkan loader, with the shared library that its manifest names.
//!
//! The loader and the layers read the environment, so each test runs in a process of its own.

use std::ffi::CStr;

use ash::vk;
use gaurast::vk::GaussianCameraGAURAST;
use gaurast_runner::{Case, Need};
use gaurast_testkit::loader::through_the_loader;
use gaurast_testkit::{
    Buffer, Driver, GaussianOptions, GaussianPipeline, GaussianScene, Gpu, Message, Opening, Pass, PassObject,
    Settings, Target, over,
};
use gaurast_tests::scenes;

const VALIDATION: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Messages that the validation layer gives on valid Gaussian draws, since it does not know the extension: the
/// message's id, a part of its text, and the reason.
const EXPECTED: &[[&str; 3]] = &[
    [
        "VUID_Undefined",
        "VK_GAURAST_gaussian_primitive_topology is not supported by this layer",
        "the extension is not registered",
    ],
    ["VUID-VkPipelineInputAssemblyStateCreateInfo-topology-parameter", "topology", "the topology is the extension's"],
    [
        "VUID-VkGraphicsPipelineCreateInfo-pStages-06896",
        "does not contain any pre-raster shaders",
        "fixed-function projection has no vertex stage",
    ],
    [
        "VUID-VkGraphicsPipelineCreateInfo-stageCount-06604",
        "stageCount is 0",
        "fixed-function projection has no vertex stage",
    ],
    [
        "VUID-VkGraphicsPipelineCreateInfo-pStages-06600",
        "stageCount must be greater than 0",
        "fixed-function projection has no vertex stage",
    ],
    [
        "VUID-VkGraphicsPipelineCreateInfo-stage-00727",
        "Vertex Shader required",
        "fixed-function projection has no vertex stage",
    ],
    [
        "UNASSIGNED-CoreValidation-DrawState-InvalidImageLayout",
        "For optimal performance",
        "the tests keep every image in one layout: advice on speed, not an error",
    ],
];

const SIZE: [u32; 2] = [203, 139];

fn camera() -> GaussianCameraGAURAST<'static> {
    scenes::camera(SIZE[0], SIZE[1]).to_vulkan()
}

/// A picture that uses dynamic rendering, a render pass, indices and blending.
fn picture(gpu: &Gpu) -> Vec<[f32; 4]> {
    let scene = scenes::cloud(31, 2000, 3);
    let on_device = GaussianScene::new(gpu, &scene);
    let indices: Vec<u32> = (0..on_device.count).rev().step_by(3).collect();
    let index_buffer = Buffer::of(gpu, &indices);
    let options = GaussianOptions { blend: vec![over()], ..GaussianOptions::new(scene.degree) };
    let target = Target::floats(gpu, SIZE);
    let object = PassObject::new(&target);
    let pipeline = GaussianPipeline::new(gpu, &options);
    let pipeline_of_object =
        GaussianPipeline::new(gpu, &GaussianOptions { render_pass: Some(object.render_pass), ..options });
    gpu.run(|commands| {
        let background = [0.1, 0.2, 0.3, 1.0];
        commands.pass(&target, &Pass::clear(background), || ());
        let pass = Pass {
            area: Some(vk::Rect2D::default().extent(vk::Extent2D { width: SIZE[0], height: SIZE[1] })),
            ..Pass::clear(background)
        };
        commands.pass(&object, &pass, || {
            on_device.bind(commands, &pipeline_of_object, &camera());
            commands.draw(1000..1000 + 500);
        });
        commands.pass(&target, &Pass::load(), || {
            on_device.bind(commands, &pipeline, &camera());
            commands.indices(&index_buffer, 0, vk::IndexType::UINT32);
            commands.draw_indexed(0..indices.len() as u32, 0);
        });
    });
    target.read()
}

/// The same picture from the driver that is linked into the test.
fn embedded_picture() -> Vec<[f32; 4]> {
    picture(&Gpu::embedded(&Settings::default()).expect("a device"))
}

#[gaurast_runner::test(needs = [Need::VulkanLoader])]
fn the_picture_is_that_of_the_embedded_door(case: &Case) {
    through_the_loader(case, || {
        let gpu = Gpu::loaded().expect("this driver's device");
        let loaded = picture(&gpu);
        assert_eq!(gpu.messages(), []);
        assert!(loaded == embedded_picture());
    });
}

#[gaurast_runner::test(needs = [Need::ValidationLayer])]
fn the_validation_layer_says_what_is_expected(case: &Case) {
    through_the_loader(case, || {
        let gpu = Gpu::open(&Opening { layers: &[VALIDATION], ..Opening::of(Driver::Loaded) });
        let gpu = gpu.expect("this driver's device");
        let validated = picture(&gpu);
        let messages = gpu.messages();
        // Layers of some versions give fewer messages.
        let unexpected: Vec<_> =
            messages.iter().filter(|message| !EXPECTED.iter().any(|expected| is(message, expected))).collect();
        assert!(unexpected.is_empty(), "{unexpected:#?}");
        assert!(validated == embedded_picture());
    });
}

fn is(message: &Message, [id, text, _]: &[&str; 3]) -> bool {
    message.id == *id && message.text.contains(text)
}
