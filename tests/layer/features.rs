//! Modes whose features are not enabled.

use ash::vk;
use gaurast::vk::{
    GaussianAntialiasingGAURAST, GaussianCameraSourceGAURAST, GaussianCutOffGAURAST, GaussianGeometryGAURAST,
    GaussianLinearizationGAURAST, GaussianOrderGAURAST, GaussianPrecisionGAURAST,
    PipelineGaussianStateCreateFlagsGAURAST as Flags,
};
use gaurast_testkit::{Bindings, Buffer, Graphics, Resource};

use crate::pipelines::{allowing, footprint, sigma_points};
use crate::stage::{
    Mistake, State, creation, instanced, laid_out, mistake, pipeline, resolved, shaded, spirv, splats, with,
};

/// A pipeline on the device without optional modes.
fn bare(name: &'static str, id: &'static str, request: impl Fn() -> Graphics<'static> + 'static) -> Mistake {
    mistake(name, id, move |stage| creation(&stage.bare, &request()))
}

fn state(name: &'static str, id: &'static str, change: fn(State) -> State) -> Mistake {
    bare(name, id, move || with(change))
}

pub fn mistakes() -> Vec<Mistake> {
    let mut all = of_states();
    all.extend(of_shaders_and_sets());
    all.extend(of_fixed_functions());
    all
}

fn of_states() -> Vec<Mistake> {
    vec![
        state(
            "`RADIAL_DISTANCE` without its feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-radialDistanceOrder-90035",
            |s| s.order(GaussianOrderGAURAST::RADIAL_DISTANCE),
        ),
        state(
            "`PRIMITIVE` without its feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-primitiveOrder-90036",
            |s| s.order(GaussianOrderGAURAST::PRIMITIVE),
        ),
        state(
            "`PER_PIXEL` without its feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-perPixelOrder-90037",
            |s| s.order(GaussianOrderGAURAST::PER_PIXEL),
        ),
        state(
            "binary16 without its feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-rasterizationFloat16-90038",
            |s| s.precision(GaussianPrecisionGAURAST::FLOAT16),
        ),
        state(
            "opacity compensation without its feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-opacityCompensation-90039",
            |s| s.antialiasing(GaussianAntialiasingGAURAST::OPACITY_COMPENSATED),
        ),
        state(
            "the unscented transform without its feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-unscentedProjection-90040",
            |s| s.linearization(GaussianLinearizationGAURAST::UNSCENTED),
        ),
        state(
            "2D Gaussians without their feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussian2D-90041",
            |s| s.geometry(GaussianGeometryGAURAST::GAUSSIAN_2D),
        ),
        state(
            "logarithms of scales without their feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-attributeActivation-90046",
            |s| s.flags(Flags::LOG_SCALE),
        ),
        state(
            "logits of opacities without their feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-attributeActivation-90046",
            |s| s.flags(Flags::LOGIT_OPACITY),
        ),
        state(
            "harmonics in a buffer without their feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-sphericalHarmonicsBuffer-90047",
            |s| s.flags(Flags::SPHERICAL_HARMONICS_BUFFER),
        ),
        bare(
            "an approximation without its feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianApproximation-90050",
            || allowing(1e-3, 0.0),
        ),
        bare(
            "a cut-off without its feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianCutOff-90074",
            || footprint(GaussianCutOffGAURAST::ELLIPSE, 3.0, 0.0),
        ),
        mistake(
            "a cut-off of 2D Gaussians without its feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussian2DCutOff-90102",
            |stage| {
                let request = Graphics {
                    gaussian: with(|s| s.geometry(GaussianGeometryGAURAST::GAUSSIAN_2D)).gaussian,
                    ..footprint(GaussianCutOffGAURAST::TILE_RECTANGLE, 3.33, 0.0)
                };
                creation(&stage.resolving, &request)
            },
        ),
        bare(
            "a floor of compensation without its feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-opacityCompensationFloor-90075",
            || footprint(GaussianCutOffGAURAST::NONE, 0.0, 0.1),
        ),
        mistake(
            "other sigma points without their feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-unscentedParameters-90090",
            |stage| creation(&stage.resolving, &sigma_points(|points| points.alpha(0.1))),
        ),
        bare(
            "model matrices without their feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianInstancing-90043",
            instanced,
        ),
    ]
}

fn of_shaders_and_sets() -> Vec<Mistake> {
    vec![
        mistake(
            "vertex-shader projection without its feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-vertexShaderProjection-90033",
            |stage| {
                let (request, _set, _buffer) = laid_out(&stage.bare, shaded(|s| s));
                creation(&stage.bare, &request)
            },
        ),
        mistake(
            "a resolve shader without its feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-resolveFragmentShader-90034",
            |stage| {
                let request = resolved(spirv!("toned.frag"), [2, 5], |s| s);
                let (request, _set, _buffer) = laid_out(&stage.bare, request);
                creation(&stage.bare, &request)
            },
        ),
        mistake(
            "a Gaussian's index in a resolve shader without its feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-resolveGaussianIndices-90073",
            |stage| {
                let request = resolved(spirv!("toned.frag"), [2, 5], |mut s| {
                    s.resolve_input_locations.nearest_gaussian = 6;
                    s
                });
                let (request, _set, _buffer) = laid_out(&stage.resolving, request);
                creation(&stage.resolving, &request)
            },
        ),
        mistake(
            "a camera in a uniform buffer without its feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-uniformBufferCamera-90042",
            |stage| {
                let buffer = Buffer::new(&stage.bare, 1024);
                let set = Bindings::new(&stage.bare, &[Resource::Uniform(buffer.raw)]);
                let source = GaussianCameraSourceGAURAST::UNIFORM_BUFFER;
                let request = Graphics { set_layouts: vec![set.layout], ..with(|s| s.camera_source(source)) };
                creation(&stage.bare, &request)
            },
        ),
    ]
}

fn of_fixed_functions() -> Vec<Mistake> {
    let samples = |samples| {
        move || Graphics {
            multisample: vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(samples),
            ..splats()
        }
    };
    let multisample = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianMultisample-90045";
    vec![
        bare(
            "a depth test without its feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianDepthStencil-90044",
            || Graphics {
                depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default().depth_test_enable(true),
                depth_format: vk::Format::D32_SFLOAT,
                ..splats()
            },
        ),
        bare("four samples without their feature", multisample, samples(vk::SampleCountFlags::TYPE_4)),
        pipeline("samples that Gaussians do not have", multisample, samples(vk::SampleCountFlags::TYPE_64)),
        bare(
            "a dynamic state without its feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianDynamicState-90048",
            || splats().with_dynamic(gaurast::vk::DYNAMIC_STATE_GAUSSIAN_ORDER_GAURAST),
        ),
        bare(
            "views without their feature",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianMultiview-90049",
            || Graphics { view_mask: 1, ..splats() },
        ),
    ]
}
