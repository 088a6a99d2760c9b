//! Which pipelines of points, lines and triangles there are, and what is said of others.

use crate::gpu::Gpu;
use crate::polygons::{Request, fragment_shader, vertex_shader};
use crate::scene::replace;
use crate::spirv;
use ash::vk;

const USAGE: vk::Result = vk::Result::ERROR_VALIDATION_FAILED_EXT;
const LACKING: vk::Result = vk::Result::ERROR_FEATURE_NOT_PRESENT;

fn assert_made(gpu: &Gpu, request: &Request) {
    match request.create(gpu) {
        Ok(made) => made.destroy(gpu),
        Err(error) => panic!("{error}: {:?}", gpu.take_messages()),
    }
}

fn assert_refused(gpu: &Gpu, request: &Request, error: vk::Result, word: &str) {
    let result = request.create(gpu).map(|made| made.destroy(gpu));
    let message = gpu.take_messages().concat();
    assert_eq!(result, Err(error), "{word}: {message}");
    assert!(message.contains(word), "{message:?} does not say {word:?}");
    assert!(message.contains("vkCreateGraphicsPipelines"), "{message:?}");
}

#[gaurast_runner::test]
fn every_topology_without_adjacency_has_pipelines() {
    let gpu = Gpu::new();
    use vk::PrimitiveTopology as T;
    for topology in [
        T::POINT_LIST,
        T::LINE_LIST,
        T::LINE_STRIP,
        T::TRIANGLE_LIST,
        T::TRIANGLE_STRIP,
        T::TRIANGLE_FAN,
    ] {
        let request = Request {
            topology,
            ..Request::default()
        };
        assert_made(&gpu, &request);
        let restarting = Request {
            restart: true,
            ..request
        };
        match topology {
            T::POINT_LIST | T::LINE_LIST | T::TRIANGLE_LIST => {
                assert_refused(&gpu, &restarting, USAGE, "primitiveRestartEnable");
            }
            _ => assert_made(&gpu, &restarting),
        }
    }
    for (topology, word) in [
        (T::LINE_LIST_WITH_ADJACENCY, "geometryShader"),
        (T::TRIANGLE_STRIP_WITH_ADJACENCY, "geometryShader"),
        (T::PATCH_LIST, "tessellationShader"),
    ] {
        let request = Request {
            topology,
            ..Request::default()
        };
        assert_refused(&gpu, &request, LACKING, word);
    }
    assert!(gpu.take_messages().is_empty());
}

#[gaurast_runner::test]
fn stages_are_those_that_the_device_has() {
    let gpu = Gpu::new();
    let mut request = Request::default();
    request.shaders.truncate(1);
    assert_made(&gpu, &request);
    request.shaders.clear();
    assert_refused(&gpu, &request, USAGE, "no vertex stage");
    let mut request = Request::default();
    request.shaders[0].stage = vk::ShaderStageFlags::GEOMETRY;
    assert_refused(&gpu, &request, LACKING, "GEOMETRY");
    let mut request = Request::default();
    request.shaders.push(request.shaders[0].clone());
    assert_refused(&gpu, &request, USAGE, "several");
    let mut request = Request::default();
    request.shaders.swap(0, 1);
    request.shaders[0].stage = vk::ShaderStageFlags::VERTEX;
    request.shaders[1].stage = vk::ShaderStageFlags::FRAGMENT;
    let invalid = vk::Result::ERROR_INVALID_SHADER_NV;
    assert_refused(&gpu, &request, invalid, "no vertex entry point");
}

#[gaurast_runner::test]
fn stages_and_layout_correspond() {
    let gpu = Gpu::new();
    let request = Request {
        has_layout: false,
        ..Request::default()
    };
    assert_refused(&gpu, &request, USAGE, "layout");
    let request = Request::default().with_fragment(spirv!("tinted.frag"));
    assert_refused(&gpu, &request, USAGE, "binding 0");
    let request = Request {
        shaders: vec![vertex_shader(spirv!("triangle.vert"))],
        ..Request::default()
    };
    assert_refused(&gpu, &request, USAGE, "push constants 16 to 80");
}

#[gaurast_runner::test]
fn a_fragment_input_that_nobody_writes_is_warned_of() {
    let gpu = Gpu::new();
    let request = Request {
        shaders: vec![
            vertex_shader(spirv!("colored.vert")),
            fragment_shader(spirv!("two_targets.frag")),
        ],
        formats: vec![crate::scene::FORMAT; 2],
        blend: vec![replace(); 2],
        ..Request::default()
    };
    assert_made(&gpu, &request);
    assert!(gpu.take_messages().is_empty());
    let mut request = Request::default();
    request.shaders[0] = vertex_shader(spirv!("block.vert"));
    request.attributes = (0..=4)
        .map(|location| vk::VertexInputAttributeDescription {
            location,
            ..request.attributes[0]
        })
        .collect();
    assert_made(&gpu, &request);
    let messages = gpu.take_messages().concat();
    assert!(messages.contains("location 0"), "{messages:?}");
    assert!(messages.contains("reads as 0"), "{messages:?}");
}

#[gaurast_runner::test]
fn attributes_are_of_the_kinds_that_the_shader_reads() {
    let gpu = Gpu::new();
    let mut missing = Request::default();
    missing.attributes.pop();
    assert_refused(&gpu, &missing, USAGE, "location 1");
    let mut integers = Request::default();
    integers.attributes[1].format = vk::Format::R32G32B32A32_UINT;
    assert_refused(&gpu, &integers, USAGE, "Uint");
    let mut bytes = Request::default();
    bytes.attributes[1].format = vk::Format::R8G8B8A8_UNORM;
    assert_made(&gpu, &bytes);
    let mut unread = Request::default();
    unread.attributes[1].format = vk::Format::BC7_UNORM_BLOCK;
    assert_refused(&gpu, &unread, USAGE, "BC7_UNORM_BLOCK");
    let mut cells = Request {
        shaders: vec![vertex_shader(spirv!("numbered.vert"))],
        ..Request::default()
    };
    assert_refused(&gpu, &cells, USAGE, "Float");
    cells.attributes[0].format = vk::Format::R8G8_UINT;
    assert_made(&gpu, &cells);
}

#[gaurast_runner::test]
fn values_of_64_bits_do_not_pass_between_stages() {
    let gpu = Gpu::new();
    let request = Request {
        shaders: vec![vertex_shader(spirv!("doubles.vert"))],
        ..Request::default()
    };
    assert_refused(&gpu, &request, LACKING, "64 bits");
}

#[gaurast_runner::test]
fn state_that_is_ignored_may_be_anything() {
    let gpu = Gpu::new();
    let nonsense = vk::CompareOp::from_raw(77);
    // There is no depth attachment.
    let request = Request {
        depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(true)
            .depth_compare_op(nonsense),
        ..Request::default()
    };
    assert_made(&gpu, &request);
    let request = Request {
        depth_format: vk::Format::D32_SFLOAT,
        ..request
    };
    assert_refused(&gpu, &request, USAGE, "77");
    let request = request.with_dynamic(vk::DynamicState::DEPTH_COMPARE_OP);
    assert_made(&gpu, &request);
    // Nothing is rasterized.
    let request = Request {
        raster: vk::PipelineRasterizationStateCreateInfo::default().rasterizer_discard_enable(true),
        viewports: 0,
        blend: vec![],
        multisample: vk::PipelineMultisampleStateCreateInfo::default(),
        ..Request::default()
    };
    assert_made(&gpu, &request);
    let request = request.with_dynamic(vk::DynamicState::RASTERIZER_DISCARD_ENABLE);
    assert_refused(&gpu, &request, USAGE, "viewport");
}

#[gaurast_runner::test]
fn counts_correspond() {
    let gpu = Gpu::new();
    let request = Request {
        blend: vec![replace(); 2],
        ..Request::default()
    };
    assert_refused(&gpu, &request, USAGE, "attachmentCount");
    let request = Request {
        viewports: 17,
        ..Request::default()
    };
    assert_refused(&gpu, &request, USAGE, "maxViewports");
    let request = Request {
        dynamic: vec![],
        ..Request::default()
    };
    assert_refused(&gpu, &request, USAGE, "not dynamic");
    let request = Request {
        viewports: 0,
        dynamic: vec![
            vk::DynamicState::VIEWPORT_WITH_COUNT,
            vk::DynamicState::SCISSOR_WITH_COUNT,
        ],
        ..Request::default()
    };
    assert_made(&gpu, &request);
}

#[gaurast_runner::test]
fn state_that_the_device_lacks_is_refused() {
    let gpu = Gpu::new();
    let request = Request {
        multisample: vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_8),
        ..Request::default()
    };
    assert_refused(&gpu, &request, LACKING, "TYPE_8");
    for state in [
        vk::DynamicState::RASTERIZATION_SAMPLES_EXT,
        vk::DynamicState::PATCH_CONTROL_POINTS_EXT,
        vk::DynamicState::TESSELLATION_DOMAIN_ORIGIN_EXT,
    ] {
        let request = Request::default().with_dynamic(state);
        assert_refused(&gpu, &request, LACKING, &format!("{state:?}"));
    }
}
