//! Valid pipelines of points, lines and triangles, and the messages about invalid ones.

use ash::vk;
use gaurast_runner::Case;
use gaurast_testkit::canvas::colored;
use gaurast_testkit::devices::open;
use gaurast_testkit::scene::replace;
use gaurast_testkit::settings::strictly;
use gaurast_testkit::shader::spirv;
use gaurast_testkit::{Gpu, Graphics, Shader};

const USAGE: vk::Result = vk::Result::ERROR_VALIDATION_FAILED_EXT;
const LACKING: vk::Result = vk::Result::ERROR_FEATURE_NOT_PRESENT;

fn assert_made(gpu: &Gpu, request: &Graphics<'_>) {
    match request.create(gpu) {
        Ok(_) => {}
        Err(error) => panic!("{error}: {:?}", gpu.message_texts()),
    }
}

fn assert_refused(gpu: &Gpu, request: &Graphics<'_>, error: vk::Result, word: &str) {
    let result = request.create(gpu).map(drop);
    let message = gpu.message_texts().concat();
    assert_eq!(result, Err(error), "{word}: {message}");
    assert!(message.contains(word), "{message:?} does not say {word:?}");
    assert!(message.contains("vkCreateGraphicsPipelines"), "{message:?}");
}

#[gaurast_runner::test]
fn every_topology_has_pipelines(case: &Case) {
    strictly(case, create_pipelines_of_every_topology);
}

fn create_pipelines_of_every_topology() {
    let gpu = open();
    use vk::PrimitiveTopology as T;
    for topology in [
        T::POINT_LIST,
        T::LINE_LIST,
        T::LINE_STRIP,
        T::TRIANGLE_LIST,
        T::TRIANGLE_STRIP,
        T::TRIANGLE_FAN,
        T::LINE_LIST_WITH_ADJACENCY,
        T::LINE_STRIP_WITH_ADJACENCY,
        T::TRIANGLE_LIST_WITH_ADJACENCY,
        T::TRIANGLE_STRIP_WITH_ADJACENCY,
    ] {
        let request = Graphics { topology, ..colored() };
        assert_made(&gpu, &request);
        let restarting = Graphics { restart: true, ..request };
        match topology {
            T::POINT_LIST
            | T::LINE_LIST
            | T::TRIANGLE_LIST
            | T::LINE_LIST_WITH_ADJACENCY
            | T::TRIANGLE_LIST_WITH_ADJACENCY => {
                assert_refused(&gpu, &restarting, USAGE, "primitiveRestartEnable");
            }
            _ => assert_made(&gpu, &restarting),
        }
    }
    let request = Graphics { topology: T::PATCH_LIST, ..colored() };
    assert_refused(&gpu, &request, USAGE, "no tessellation stages");
    assert!(gpu.message_texts().is_empty());
}

/// Breaks VUID-VkGraphicsPipelineCreateInfo-stage-02096, VUID-VkGraphicsPipelineCreateInfo-stage-06897,
/// VUID-VkPipelineShaderStageCreateInfo-stage-00704 and VUID-VkPipelineShaderStageCreateInfo-pName-00707.
#[gaurast_runner::test]
fn stages_are_those_that_the_device_has() {
    let gpu = open();
    let mut request = colored();
    request.shaders.truncate(1);
    assert_made(&gpu, &request);
    request.shaders.clear();
    assert_refused(&gpu, &request, USAGE, "no vertex stage");
    let mut request = colored();
    request.shaders[0].stage = vk::ShaderStageFlags::MESH_EXT;
    assert_refused(&gpu, &request, LACKING, "MESH");
    let mut request = colored();
    request.shaders.push(request.shaders[0].clone());
    assert_refused(&gpu, &request, USAGE, "several");
    let mut request = colored();
    request.shaders.swap(0, 1);
    request.shaders[0].stage = vk::ShaderStageFlags::VERTEX;
    request.shaders[1].stage = vk::ShaderStageFlags::FRAGMENT;
    let invalid = vk::Result::ERROR_INVALID_SHADER_NV;
    assert_refused(&gpu, &request, invalid, "no vertex entry point");
}

/// Without used colour attachments there need be no blend state; with one, there must be.
#[gaurast_runner::test]
fn unused_attachments_need_no_blend_state() {
    let gpu = open();
    let unused = vk::Format::UNDEFINED;
    for formats in [vec![], vec![unused], vec![unused; 3]] {
        assert_made(&gpu, &Graphics { formats, blend: Vec::new(), ..colored() });
    }
    let formats = vec![unused, gaurast_testkit::scene::FORMAT];
    assert_refused(&gpu, &Graphics { formats, blend: Vec::new(), ..colored() }, USAGE, "attachmentCount is 0");
}

#[gaurast_runner::test]
fn stages_and_layout_correspond() {
    let gpu = open();
    let request = Graphics { has_layout: false, ..colored() };
    assert_refused(&gpu, &request, USAGE, "layout");
    let request = colored().with_shader(Shader::fragment(spirv("tinted.frag")));
    assert_refused(&gpu, &request, USAGE, "binding 0");
    let request = Graphics { shaders: vec![Shader::vertex(spirv("triangle.vert"))], ..colored() };
    assert_refused(&gpu, &request, USAGE, "push constants 16 to 80");
}

#[gaurast_runner::test]
fn a_fragment_input_that_nobody_writes_is_warned_of() {
    let gpu = open();
    let request = Graphics {
        shaders: vec![Shader::vertex(spirv("colored.vert")), Shader::fragment(spirv("two_targets.frag"))],
        formats: vec![gaurast_testkit::scene::FORMAT; 2],
        blend: vec![replace(); 2],
        ..colored()
    };
    assert_made(&gpu, &request);
    assert!(gpu.message_texts().is_empty());
    let mut request = colored();
    request.shaders[0] = Shader::vertex(spirv("block.vert"));
    request.attributes =
        (0..=4).map(|location| vk::VertexInputAttributeDescription { location, ..request.attributes[0] }).collect();
    assert_made(&gpu, &request);
    let messages = gpu.message_texts().concat();
    assert!(messages.contains("location 0"), "{messages:?}");
    assert!(messages.contains("reads as 0"), "{messages:?}");
}

/// Breaks VUID-VkVertexInputAttributeDescription-format-00623.
#[gaurast_runner::test]
fn attributes_are_of_the_kinds_that_the_shader_reads() {
    let gpu = open();
    let mut missing = colored();
    missing.attributes.pop();
    assert_refused(&gpu, &missing, USAGE, "location 1");
    let mut integers = colored();
    integers.attributes[1].format = vk::Format::R32G32B32A32_UINT;
    assert_refused(&gpu, &integers, USAGE, "Uint");
    let mut bytes = colored();
    bytes.attributes[1].format = vk::Format::R8G8B8A8_UNORM;
    assert_made(&gpu, &bytes);
    let mut unread = colored();
    unread.attributes[1].format = vk::Format::BC7_UNORM_BLOCK;
    assert_refused(&gpu, &unread, USAGE, "BC7_UNORM_BLOCK");
    let mut cells = Graphics { shaders: vec![Shader::vertex(spirv("numbered.vert"))], ..colored() };
    assert_refused(&gpu, &cells, USAGE, "Float");
    cells.attributes[0].format = vk::Format::R8G8_UINT;
    assert_made(&gpu, &cells);
}

#[gaurast_runner::test]
fn inputs_of_64_bits_need_attributes_of_64_bits() {
    let gpu = open();
    let request = Graphics { shaders: vec![Shader::vertex(spirv("double_attribute.vert"))], ..colored() };
    assert_refused(&gpu, &request, USAGE, "location 0");
    let outputs = Graphics { shaders: vec![Shader::vertex(spirv("doubles.vert"))], ..colored() };
    assert_made(&gpu, &outputs);
}

#[gaurast_runner::test]
fn state_that_is_ignored_may_be_anything() {
    let gpu = open();
    let nonsense = vk::CompareOp::from_raw(77);
    // There is no depth attachment.
    let request = Graphics {
        depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(true)
            .depth_compare_op(nonsense),
        ..colored()
    };
    assert_made(&gpu, &request);
    let request = Graphics { depth_format: vk::Format::D32_SFLOAT, ..request };
    assert_refused(&gpu, &request, USAGE, "77");
    let request = request.with_dynamic(vk::DynamicState::DEPTH_COMPARE_OP);
    assert_made(&gpu, &request);
    // Nothing is rasterized.
    let request = Graphics {
        raster: vk::PipelineRasterizationStateCreateInfo::default().rasterizer_discard_enable(true),
        viewports: 0,
        blend: vec![],
        multisample: vk::PipelineMultisampleStateCreateInfo::default(),
        ..colored()
    };
    assert_made(&gpu, &request);
    let request = request.with_dynamic(vk::DynamicState::RASTERIZER_DISCARD_ENABLE);
    assert_refused(&gpu, &request, USAGE, "viewport");
}

/// Breaks VUID-VkGraphicsPipelineCreateInfo-renderPass-06055 and
/// VUID-VkPipelineViewportStateCreateInfo-viewportCount-01218.
#[gaurast_runner::test]
fn counts_correspond() {
    let gpu = open();
    let request = Graphics { blend: vec![replace(); 2], ..colored() };
    assert_refused(&gpu, &request, USAGE, "attachmentCount");
    let request = Graphics { viewports: 17, ..colored() };
    assert_refused(&gpu, &request, USAGE, "maxViewports");
    let request = Graphics { dynamic: vec![], ..colored() };
    assert_refused(&gpu, &request, USAGE, "not dynamic");
    let request = Graphics {
        viewports: 0,
        dynamic: vec![vk::DynamicState::VIEWPORT_WITH_COUNT, vk::DynamicState::SCISSOR_WITH_COUNT],
        ..colored()
    };
    assert_made(&gpu, &request);
}

#[gaurast_runner::test]
fn state_that_the_device_lacks_is_refused() {
    let gpu = open();
    let request = Graphics {
        multisample: vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_8),
        ..colored()
    };
    assert_refused(&gpu, &request, LACKING, "TYPE_8");
    for state in [vk::DynamicState::RASTERIZATION_SAMPLES_EXT, vk::DynamicState::SAMPLE_LOCATIONS_ENABLE_EXT] {
        let request = colored().with_dynamic(state);
        assert_refused(&gpu, &request, LACKING, &format!("{state:?}"));
    }
}
