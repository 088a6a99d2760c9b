//! Gaussian draws through the Vulkan loader: the shared library, found by its manifest.
//!
//! The loader and the layers read the environment, so that each test runs in a process of its own.

use std::ffi::CStr;

use ash::vk::{self, TaggedStructure};
use gaurast::vk::{
    GaussianCameraGAURAST, PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST,
    PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST,
    PipelineGaussianApproximationStateCreateInfoGAURAST, PipelineGaussianStateCreateInfoGAURAST,
};
use gaurast_runner::{Case, Need};
use gaurast_tests::contexts::{
    Buffer, Context, DeviceScene, Message, Pass, PassObject, Pipeline, PipelineOptions, Settings,
    Target, over,
};
use gaurast_tests::scenes;

use crate::loader::manifest;

const VALIDATION: &CStr = c"VK_LAYER_KHRONOS_validation";

/// What the validation layer says of valid Gaussian draws, since it does not know the extension:
/// the message's id, a part of its text, and why.
const EXPECTED: &[[&str; 3]] = &[
    [
        "VUID_Undefined",
        "VK_GAURAST_gaussian_primitive_topology is not supported by this layer",
        "the extension is not registered",
    ],
    [
        "VUID-VkPipelineInputAssemblyStateCreateInfo-topology-parameter",
        "topology",
        "the topology is the extension's",
    ],
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
];

/// Structures' types and sizes, as the validation layer wants to be told of those that it does not
/// know.
fn unregistered_structures() -> String {
    use PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as Features;
    use PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST as Properties;
    use PipelineGaussianApproximationStateCreateInfoGAURAST as Approximation;
    use PipelineGaussianStateCreateInfoGAURAST as State;
    let separator = if cfg!(windows) { ";" } else { ":" };
    [
        (Features::STRUCTURE_TYPE, size_of::<Features<'_>>()),
        (Properties::STRUCTURE_TYPE, size_of::<Properties<'_>>()),
        (State::STRUCTURE_TYPE, size_of::<State<'_>>()),
        (
            Approximation::STRUCTURE_TYPE,
            size_of::<Approximation<'_>>(),
        ),
    ]
    .map(|(structure, size)| format!("{}{separator}{size}", structure.as_raw()))
    .join(separator)
}

/// Runs `inside` in a process where the loader finds this driver alone.
fn through_the_loader(case: &Case, inside: impl FnOnce(ash::Entry)) {
    if case.is_alone() {
        // SAFETY: the loader is the system's own.
        let entry = unsafe { ash::Entry::load() };
        return inside(entry.expect("the loader"));
    }
    let folder = tempfile::tempdir().expect("a folder");
    let manifest = manifest(folder.path());
    case.run_alone(|command| {
        command
            .env("VK_DRIVER_FILES", &manifest)
            .env("VK_ICD_FILENAMES", &manifest)
            .env("VK_LAYER_CUSTOM_STYPE_LIST", unregistered_structures())
            .env_remove("VK_INSTANCE_LAYERS");
    });
}

const SIZE: [u32; 2] = [203, 139];

fn camera() -> GaussianCameraGAURAST<'static> {
    scenes::camera(SIZE[0], SIZE[1]).to_vulkan()
}

/// A picture that takes dynamic rendering, a render pass, indices and blending to draw.
fn picture(context: &Context) -> Vec<[f32; 4]> {
    let scene = scenes::cloud(31, 2000, 3);
    let on_device = DeviceScene::new(context, &scene);
    let indices: Vec<u32> = (0..on_device.count).rev().step_by(3).collect();
    let index_buffer = Buffer::of(context, &indices);
    let options = PipelineOptions {
        blend: over(),
        ..PipelineOptions::new(scene.degree)
    };
    let target = Target::new(context, options.format, SIZE);
    let object = PassObject::new(context, &target);
    let pipeline = Pipeline::new(context, &options);
    let pipeline_of_object = Pipeline::new(
        context,
        &PipelineOptions {
            render_pass: object.render_pass,
            ..options
        },
    );
    context.run(|commands| {
        let background = [0.1, 0.2, 0.3, 1.0];
        commands.pass(&target, &Pass::clear(background), || ());
        let pass = Pass {
            area: Some(vk::Rect2D::default().extent(target.extent)),
            object: Some(&object),
            ..Pass::clear(background)
        };
        commands.pass(&target, &pass, || {
            commands.bind(&pipeline_of_object, &on_device, &camera());
            commands.draw([500, 1, 1000, 0]);
        });
        commands.pass(&target, &Pass::default(), || {
            commands.bind(&pipeline, &on_device, &camera());
            commands.bind_indices(&index_buffer);
            commands.draw_indexed(indices.len() as u32, 0, 0);
        });
    });
    target.read()
}

/// The picture that the driver draws which is linked into the test.
fn embedded_picture() -> Vec<[f32; 4]> {
    picture(&Context::embedded(&Settings::default()))
}

#[gaurast_runner::test(needs = [Need::VulkanLoader])]
fn the_picture_is_that_of_the_embedded_door(case: &Case) {
    through_the_loader(case, |entry| {
        let context = Context::new(entry, &[]);
        let loaded = picture(&context);
        assert_eq!(context.messages(), []);
        assert!(loaded == embedded_picture());
    });
}

#[gaurast_runner::test(needs = [Need::ValidationLayer])]
fn the_validation_layer_says_what_is_expected(case: &Case) {
    through_the_loader(case, |entry| {
        let context = Context::new(entry, &[VALIDATION]);
        let validated = picture(&context);
        let messages = context.messages();
        // Layers of some versions say less.
        let unexpected: Vec<_> = messages
            .iter()
            .filter(|message| !EXPECTED.iter().any(|expected| is(message, expected)))
            .collect();
        assert!(unexpected.is_empty(), "{unexpected:#?}");
        assert!(validated == embedded_picture());
    });
}

fn is(message: &Message, [id, text, _]: &[&str; 3]) -> bool {
    message.id == *id && message.text.contains(text)
}
