//! Invalid Gaussian pipelines that are refused, and the messages about them.

use ash::vk;
use gaurast::vk::{
    GAUSSIAN_LOCATION_UNUSED_GAURAST, GaussianAntialiasingGAURAST, GaussianLinearizationGAURAST, GaussianOrderGAURAST,
    GaussianProjectionModeGAURAST, PipelineGaussianStateCreateInfoGAURAST,
};
use gaurast_testkit::devices::open;
use gaurast_testkit::scene::{over, replace, splats};
use gaurast_testkit::{Gpu, Graphics, Shader};

type State = PipelineGaussianStateCreateInfoGAURAST<'static>;

/// Creates a pipeline; an error has the result and the messages.
fn create(gpu: &Gpu, request: &Graphics<'_>) -> Result<(), (vk::Result, String)> {
    let created = request.create(gpu).map(drop);
    created.map_err(|error| (error, gpu.message_texts().concat()))
}

fn with_state(change: impl FnOnce(State) -> State) -> Graphics<'static> {
    let request = splats();
    let gaussian = request.gaussian.map(change);
    Graphics { gaussian, ..request }
}

fn assert_refused(gpu: &Gpu, request: &Graphics<'_>, error: vk::Result, word: &str) {
    let (result, message) = create(gpu, request).expect_err(word);
    assert_eq!(result, error, "{word}");
    assert!(message.contains(word), "{message:?} does not say {word:?}");
    assert!(message.contains("vkCreateGraphicsPipelines"), "{message:?}");
}

#[gaurast_runner::test]
fn a_pipeline_without_the_structure_is_refused() {
    let gpu = open();
    let request = Graphics { gaussian: None, ..splats() };
    let error = vk::Result::ERROR_VALIDATION_FAILED_EXT;
    assert_refused(&gpu, &request, error, "must chain");
}

#[gaurast_runner::test]
fn values_outside_their_ranges_are_refused() {
    let gpu = open();
    let bad = [
        (with_state(|s| s.spherical_harmonics_degree(5)), "Degree"),
        (with_state(|s| s.low_pass_variance(-0.1)), "lowPassVariance"),
        (with_state(|s| s.low_pass_variance(f32::INFINITY)), "lowPassVariance"),
        (with_state(|s| s.low_pass_variance(f32::NAN)), "lowPassVariance"),
        (with_state(|s| s.alpha_floor(-0.1)), "alphaFloor"),
        (with_state(|s| s.alpha_floor(1.5)), "alphaFloor"),
        (with_state(|s| s.alpha_floor(f32::NAN)), "alphaFloor"),
        (with_state(|s| s.alpha_ceiling(1.1)), "alphaCeiling"),
        (with_state(|s| s.alpha_ceiling(0.0)), "alphaCeiling"),
        (with_state(|s| s.alpha_floor(0.5).alpha_ceiling(0.4)), "alphaCeiling"),
        (with_state(|s| s.transmittance_floor(1.0)), "transmittanceFloor"),
        (with_state(|s| s.transmittance_floor(-1.0)), "transmittanceFloor"),
        (with_state(|s| s.order(GaussianOrderGAURAST::from_raw(9))), "order"),
    ];
    for (request, word) in bad {
        let error = vk::Result::ERROR_VALIDATION_FAILED_EXT;
        assert_refused(&gpu, &request, error, word);
    }
    let limits = with_state(|s| {
        let s = s.low_pass_variance(0.0).transmittance_floor(0.0);
        s.alpha_floor(0.0).alpha_ceiling(1.0)
    });
    create(&gpu, &limits).unwrap();
}

#[gaurast_runner::test]
fn modes_that_are_not_built_are_refused_by_their_feature() {
    let gpu = open();
    let request = Graphics { blend: vec![over().src_color_blend_factor(vk::BlendFactor::SRC1_COLOR)], ..splats() };
    let absent = vk::Result::ERROR_FEATURE_NOT_PRESENT;
    assert_refused(&gpu, &request, absent, "dualSrcBlend");
    let compensated = GaussianAntialiasingGAURAST::OPACITY_COMPENSATED;
    create(&gpu, &with_state(|s| s.antialiasing(compensated))).unwrap();
    let unscented = GaussianLinearizationGAURAST::UNSCENTED;
    create(&gpu, &with_state(|s| s.linearization(unscented))).unwrap();
    let placed = |matrix, opacity| {
        with_state(|s| {
            let locations = s.attribute_locations;
            let locations = locations.first_model_matrix(matrix).model_opacity(opacity);
            s.attribute_locations(locations)
        })
    };
    let unused = GAUSSIAN_LOCATION_UNUSED_GAURAST;
    // Locations 2 and 3 belong to the rotation and the opacity.
    for (request, word) in [
        (placed(2, unused), "firstModelMatrix"),
        (placed(unused, 3), "modelOpacity"),
        (placed(12, unused), "matrix"),
        (placed(unused, 9), "modelOpacity"),
    ] {
        let error = vk::Result::ERROR_VALIDATION_FAILED_EXT;
        assert_refused(&gpu, &request, error, word);
    }
    let logic = Graphics { logic_op: Some(vk::LogicOp::CLEAR), ..splats() };
    create(&gpu, &logic).unwrap();
    let tested = Graphics {
        depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default().depth_test_enable(true),
        depth_format: vk::Format::D32_SFLOAT,
        multisample: vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_4),
        ..splats()
    };
    create(&gpu, &tested).unwrap();
}

#[gaurast_runner::test]
fn attributes_must_be_in_the_vertex_input_state() {
    let gpu = open();
    let error = vk::Result::ERROR_VALIDATION_FAILED_EXT;
    for (index, name) in ["position", "scale", "rotation", "opacity", "coefficient 0"].into_iter().enumerate() {
        let mut missing = splats();
        missing.attributes.retain(|a| a.location != index as u32);
        assert_refused(&gpu, &missing, error, name);
        let mut unbound = splats();
        unbound.attributes[index].binding = 7;
        assert_refused(&gpu, &unbound, error, name);
        let mut integers = splats();
        integers.attributes[index].format = vk::Format::R32G32B32A32_UINT;
        assert_refused(&gpu, &integers, error, name);
    }
    let mut short = splats();
    short.attributes[2].format = vk::Format::R32G32B32_SFLOAT;
    assert_refused(&gpu, &short, error, "fewer than 4 components");
    // Degree 1 has four coefficients, but only one attribute is given.
    let degree1 = with_state(|s| s.spherical_harmonics_degree(1));
    assert_refused(&gpu, &degree1, error, "coefficient 1");
}

#[gaurast_runner::test]
fn fixed_function_projection_has_no_vertex_stage() {
    let gpu = open();
    let code = [0x0723_0203, 0x0001_0000, 0, 1, 0];
    let stage = |stage| Shader::new(stage, code.to_vec());
    let mut request = Graphics { shaders: vec![stage(vk::ShaderStageFlags::VERTEX)], ..splats() };
    let error = vk::Result::ERROR_VALIDATION_FAILED_EXT;
    assert_refused(&gpu, &request, error, "VERTEX");
    request.shaders = vec![stage(vk::ShaderStageFlags::GEOMETRY)];
    assert_refused(&gpu, &request, error, "GEOMETRY");
    request.shaders = vec![stage(vk::ShaderStageFlags::FRAGMENT); 2];
    assert_refused(&gpu, &request, error, "several");
    let text = vk::ShaderModuleCreateInfo::default().code(&[1, 2, 3]);
    // SAFETY: the words are not a valid module, which the driver must survive.
    unsafe { assert!(gpu.device().create_shader_module(&text, None).is_err()) };
}

/// The device has these stages, but neither projection of Gaussians does.
#[gaurast_runner::test]
fn gaussians_have_no_tessellation_or_geometry_stage() {
    use vk::ShaderStageFlags as Stage;
    let gpu = open();
    let features = gpu.features();
    assert_eq!(features.tessellation_shader, vk::TRUE);
    assert_eq!(features.geometry_shader, vk::TRUE);
    let code = [0x0723_0203, 0x0001_0000, 0, 1, 0];
    let shaders = |stages: &[Stage]| {
        let shaders = stages.iter();
        shaders.map(|&stage| Shader::new(stage, code.to_vec())).collect()
    };
    let projected = |mode| with_state(|s| s.projection_mode(mode));
    let modes = [
        (GaussianProjectionModeGAURAST::FIXED_FUNCTION, Stage::FRAGMENT),
        (GaussianProjectionModeGAURAST::VERTEX_SHADER, Stage::VERTEX),
    ];
    for (mode, used) in modes {
        for stages in [
            &[Stage::TESSELLATION_CONTROL, Stage::TESSELLATION_EVALUATION][..],
            &[Stage::TESSELLATION_EVALUATION],
            &[Stage::GEOMETRY],
        ] {
            let request = Graphics { shaders: shaders(&[&[used], stages].concat()), ..projected(mode) };
            let error = vk::Result::ERROR_VALIDATION_FAILED_EXT;
            let refused = format!("must not have a stage {:?}", stages[0]);
            assert_refused(&gpu, &request, error, &refused);
            let rule = "VUID-VkGraphicsPipelineCreateInfo-projectionMode-90008";
            assert_refused(&gpu, &request, error, rule);
        }
    }
}

#[gaurast_runner::test]
fn blend_state_and_attachments_correspond() {
    let gpu = open();
    let request = Graphics { blend: vec![replace(); 2], ..splats() };
    let error = vk::Result::ERROR_VALIDATION_FAILED_EXT;
    assert_refused(&gpu, &request, error, "attachmentCount");
    let request = Graphics { dynamic: vec![vk::DynamicState::SCISSOR], ..splats() };
    assert_refused(&gpu, &request, error, "viewport");
}

#[gaurast_runner::test]
fn compute_pipelines_without_a_shader_are_refused_with_null_handles() {
    let gpu = open();
    let infos = [vk::ComputePipelineCreateInfo::default(); 2];
    // SAFETY: see the crate.
    let created = unsafe { gpu.device().create_compute_pipelines(vk::PipelineCache::null(), &infos, None) };
    let (pipelines, error) = created.unwrap_err();
    assert_eq!(error, vk::Result::ERROR_VALIDATION_FAILED_EXT);
    assert_eq!(pipelines, [vk::Pipeline::null(); 2]);
}

#[gaurast_runner::test]
fn a_pipeline_cache_is_empty_and_says_whose_it_is() {
    let gpu = open();
    // SAFETY: see the crate.
    unsafe {
        let info = vk::PipelineCacheCreateInfo::default();
        let cache = gpu.device().create_pipeline_cache(&info, None).unwrap();
        let data = gpu.device().get_pipeline_cache_data(cache).unwrap();
        assert_eq!(data.len(), 32);
        assert_eq!(data[..8], [32, 0, 0, 0, 1, 0, 0, 0]);
        gpu.device().destroy_pipeline_cache(cache, None);
    }
}
