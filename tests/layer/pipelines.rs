//! Mistakes in the creation of pipelines, with all features enabled.

use ash::vk;
use gaurast::vk::{
    GaussianAntialiasingGAURAST, GaussianCameraSourceGAURAST, GaussianCutOffGAURAST, GaussianGeometryGAURAST,
    GaussianLinearizationGAURAST, GaussianOrderGAURAST, GaussianPrecisionGAURAST, GaussianProjectionModeGAURAST,
    PipelineGaussianApproximationStateCreateInfoGAURAST, PipelineGaussianFootprintStateCreateInfoGAURAST,
    PipelineGaussianStateCreateFlagsGAURAST, PipelineGaussianUnscentedStateCreateInfoGAURAST,
};
use gaurast_testkit::{Bindings, Buffer, Graphics, Resource, Shader, blend};

use crate::stage::{
    Mistake, State, creation, instanced, mistake, pipeline, resolved, shaded, shaders, spirv, splats, with,
};

pub fn allowing(exponential_error: f32, contribution_budget: f32) -> Graphics<'static> {
    let approximation = PipelineGaussianApproximationStateCreateInfoGAURAST::default()
        .exponential_error(exponential_error)
        .contribution_budget(contribution_budget);
    Graphics { approximation: Some(approximation), ..splats() }
}

/// A pipeline with a footprint state.
pub fn footprint(
    cut_off: GaussianCutOffGAURAST,
    cut_off_deviations: f32,
    compensation_floor: f32,
) -> Graphics<'static> {
    let footprint = PipelineGaussianFootprintStateCreateInfoGAURAST::default()
        .cut_off(cut_off)
        .cut_off_deviations(cut_off_deviations)
        .compensation_floor(compensation_floor);
    Graphics { footprint: Some(footprint), ..splats() }
}

/// A pipeline of the unscented transform with its sigma points.
pub fn sigma_points(
    change: fn(
        PipelineGaussianUnscentedStateCreateInfoGAURAST<'static>,
    ) -> PipelineGaussianUnscentedStateCreateInfoGAURAST<'static>,
) -> Graphics<'static> {
    let points = change(PipelineGaussianUnscentedStateCreateInfoGAURAST::default());
    Graphics { unscented: Some(points), ..with(|s| s.linearization(GaussianLinearizationGAURAST::UNSCENTED)) }
}

fn raster(change: impl Fn(Raster) -> Raster + 'static) -> impl Fn() -> Graphics<'static> + 'static {
    move || {
        let request = splats();
        Graphics { raster: change(request.raster), ..request }
    }
}
type Raster = vk::PipelineRasterizationStateCreateInfo<'static>;

fn counted(count: u32) -> impl Fn(&crate::stage::Stage) -> Vec<gaurast_testkit::Message> {
    move |stage| {
        let buffer = Buffer::new(&stage.full, 1024);
        let set = Bindings::new(&stage.full, &[Resource::Uniform(buffer.raw)]);
        let source = GaussianCameraSourceGAURAST::UNIFORM_BUFFER;
        let request = Graphics {
            view_mask: 0b101,
            set_layouts: vec![set.layout],
            ..with(|s| s.camera_source(source).camera_count(count))
        };
        creation(&stage.full, &request)
    }
}

pub fn mistakes() -> Vec<Mistake> {
    let mut all = structures();
    all.extend(numbers());
    all.extend(combinations());
    all.extend(fixed_functions());
    all.extend(output());
    all.extend(formats());
    all
}

/// The splats with another format of an attribute.
fn of_format(index: usize, format: vk::Format) -> impl Fn() -> Graphics<'static> {
    move || {
        let mut request = splats();
        request.attributes[index].format = format;
        request
    }
}

fn formats() -> Vec<Mistake> {
    let unsigned = "GAURAST-Pipeline-unsigned-format";
    let logits = PipelineGaussianStateCreateFlagsGAURAST::LOGIT_OPACITY;
    let of_target = move |format| Graphics { formats: vec![format], ..with(move |s| s.flags(logits)) };
    vec![
        pipeline("positions of an unsigned format", unsigned, of_format(0, vk::Format::R16G16B16A16_UNORM)),
        pipeline("rotations of an unsigned format", unsigned, of_format(2, vk::Format::R8G8B8A8_UNORM)),
        pipeline("harmonics of an unsigned format", unsigned, of_format(4, vk::Format::R8G8B8A8_UNORM)),
        pipeline("attributes that overlap", "GAURAST-Pipeline-overlap", || {
            let mut request = splats();
            request.attributes[1].offset = 8;
            request
        }),
        pipeline("logits drawn to an sRGB attachment", "GAURAST-Pipeline-srgb-attachment", move || {
            of_target(vk::Format::R8G8B8A8_SRGB)
        }),
        pipeline("a target of picks without a resolve shader", "GAURAST-Pipeline-integer-attachment", || {
            let formats = vec![vk::Format::R32G32B32A32_SFLOAT, vk::Format::R32G32_UINT];
            Graphics { formats, blend: vec![gaurast_testkit::over(), gaurast_testkit::opaque()], ..splats() }
        }),
        shaders("a resolve shader that writes floats to integers", "GAURAST-Pipeline-output-type", || {
            let request = resolved(spirv!("toned.frag"), [2, 5], |s| s);
            Graphics { formats: vec![vk::Format::R32G32B32A32_UINT], blend: vec![gaurast_testkit::opaque()], ..request }
        }),
    ]
}

fn structures() -> Vec<Mistake> {
    let stages = "VUID-VkGraphicsPipelineCreateInfo-projectionMode-90008";
    vec![
        mistake(
            "a pipeline on a device on which the topology is not enabled",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianPrimitiveTopology-90032",
            |stage| creation(&stage.without, &splats()),
        ),
        pipeline("the topology without a Gaussian state", "VUID-VkGraphicsPipelineCreateInfo-topology-90007", || {
            Graphics { gaussian: None, ..splats() }
        }),
        pipeline("a Gaussian state beside a list of triangles", "GAURAST-Pipeline-topology", || Graphics {
            topology: vk::PrimitiveTopology::TRIANGLE_LIST,
            ..splats()
        }),
        pipeline("primitive restart", "VUID-VkPipelineInputAssemblyStateCreateInfo-topology-90009", || Graphics {
            restart: true,
            ..splats()
        }),
        shaders("a vertex stage with fixed-function projection", stages, || {
            splats().with_shader(Shader::vertex(spirv!("gaussian.vert")))
        }),
        pipeline("vertex-shader projection without a vertex stage", stages, || {
            with(|s| s.projection_mode(GaussianProjectionModeGAURAST::VERTEX_SHADER))
        }),
        shaders("a geometry stage", stages, || {
            let stage = vk::ShaderStageFlags::GEOMETRY;
            splats().with_shader(Shader::new(stage, spirv!("gaussian.vert")))
        }),
        pipeline("an order that is none", "VUID-VkPipelineGaussianStateCreateInfoGAURAST-order-parameter", || {
            with(|s| s.order(GaussianOrderGAURAST::from_raw(77)))
        }),
        pipeline("a geometry that is none", "VUID-VkPipelineGaussianStateCreateInfoGAURAST-geometry-parameter", || {
            with(|s| s.geometry(GaussianGeometryGAURAST::from_raw(-1)))
        }),
        pipeline("a flag that is none", "VUID-VkPipelineGaussianStateCreateInfoGAURAST-flags-parameter", || {
            with(|s| s.flags(PipelineGaussianStateCreateFlagsGAURAST::from_raw(0x100)))
        }),
    ]
}

fn numbers() -> Vec<Mistake> {
    let ceiling = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-alphaCeiling-90013";
    let state = |name, id, change: fn(State) -> State| pipeline(name, id, move || with(change));
    vec![
        state(
            "a degree of harmonics that the device does not have",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-sphericalHarmonicsDegree-90010",
            |s| s.spherical_harmonics_degree(9),
        ),
        state(
            "a negative low-pass variance",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-lowPassVariance-90011",
            |s| s.low_pass_variance(-0.3),
        ),
        state("an alpha floor of 1 in 255ths", "VUID-VkPipelineGaussianStateCreateInfoGAURAST-alphaFloor-90012", |s| {
            s.alpha_floor(255.0)
        }),
        state("an alpha ceiling of 0", ceiling, |s| s.alpha_ceiling(0.0)),
        state("an alpha ceiling below the floor", ceiling, |s| s.alpha_floor(0.5).alpha_ceiling(0.25)),
        state(
            "a transmittance floor of 1",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-transmittanceFloor-90014",
            |s| s.transmittance_floor(1.0),
        ),
        pipeline(
            "a negative error of the exponential",
            "VUID-VkPipelineGaussianApproximationStateCreateInfoGAURAST-exponentialError-90051",
            || allowing(-0.1, 0.0),
        ),
        pipeline(
            "a budget of contributions that is NaN",
            "VUID-VkPipelineGaussianApproximationStateCreateInfoGAURAST-contributionBudget-90052",
            || allowing(0.0, f32::NAN),
        ),
        pipeline(
            "a cut-off at no deviations",
            "VUID-VkPipelineGaussianFootprintStateCreateInfoGAURAST-cutOffDeviations-90076",
            || footprint(GaussianCutOffGAURAST::ELLIPSE, 0.0, 0.0),
        ),
        pipeline(
            "a floor of compensation above 1",
            "VUID-VkPipelineGaussianFootprintStateCreateInfoGAURAST-compensationFloor-90077",
            || footprint(GaussianCutOffGAURAST::NONE, 0.0, 1.5),
        ),
        pipeline(
            "a cut-off that is none",
            "VUID-VkPipelineGaussianFootprintStateCreateInfoGAURAST-cutOff-parameter",
            || footprint(GaussianCutOffGAURAST::from_raw(77), 3.0, 0.0),
        ),
        pipeline(
            "a cut-off in binary16",
            "VUID-VkPipelineGaussianFootprintStateCreateInfoGAURAST-cutOff-90078",
            || Graphics {
                gaussian: with(|s| s.precision(GaussianPrecisionGAURAST::FLOAT16)).gaussian,
                ..footprint(GaussianCutOffGAURAST::ELLIPSE, 3.0, 0.0)
            },
        ),
        pipeline(
            "an ellipse that cuts off 2D Gaussians",
            "VUID-VkPipelineGaussianFootprintStateCreateInfoGAURAST-cutOff-90078",
            || Graphics {
                gaussian: with(|s| s.geometry(GaussianGeometryGAURAST::GAUSSIAN_2D)).gaussian,
                ..footprint(GaussianCutOffGAURAST::ELLIPSE, 3.0, 0.0)
            },
        ),
        pipeline(
            "sigma points at their mean",
            "VUID-VkPipelineGaussianUnscentedStateCreateInfoGAURAST-alpha-90091",
            || sigma_points(|points| points.alpha(0.0)),
        ),
        pipeline("a beta that is NaN", "VUID-VkPipelineGaussianUnscentedStateCreateInfoGAURAST-beta-90092", || {
            sigma_points(|points| points.beta(f32::NAN))
        }),
        pipeline("a kappa of -3", "VUID-VkPipelineGaussianUnscentedStateCreateInfoGAURAST-kappa-90093", || {
            sigma_points(|points| points.kappa(-3.0))
        }),
        pipeline(
            "a negative margin of the picture",
            "VUID-VkPipelineGaussianUnscentedStateCreateInfoGAURAST-pictureMargin-90094",
            || sigma_points(|points| points.picture_margin(-0.1)),
        ),
        state("an alpha ceiling of 1 with a transmittance floor", "GAURAST-Pipeline-alpha-ceiling", |s| {
            s.alpha_ceiling(1.0)
        }),
    ]
}

fn combinations() -> Vec<Mistake> {
    let (flat, half) = (GaussianGeometryGAURAST::GAUSSIAN_2D, GaussianPrecisionGAURAST::FLOAT16);
    let precision = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-precision-90030";
    let matrix = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-firstModelMatrix-90028";
    let binding = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-cameraBinding-90025";
    let count = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-cameraCount-90026";
    let changed = |change: fn(State) -> State| {
        move || {
            let request = instanced();
            Graphics { gaussian: request.gaussian.map(change), ..request }
        }
    };
    vec![
        pipeline(
            "2D Gaussians with opacity compensation",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-geometry-90027",
            move || {
                let compensated = GaussianAntialiasingGAURAST::OPACITY_COMPENSATED;
                with(|s| s.geometry(flat).antialiasing(compensated))
            },
        ),
        pipeline(
            "model matrices in the order of each pixel",
            matrix,
            changed(|s| s.order(GaussianOrderGAURAST::PER_PIXEL)),
        ),
        pipeline(
            "model matrices of 2D Gaussians",
            matrix,
            changed(|s| s.geometry(GaussianGeometryGAURAST::GAUSSIAN_2D)),
        ),
        pipeline(
            "the unscented transform of 2D Gaussians",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-geometry-90029",
            move || {
                let unscented = GaussianLinearizationGAURAST::UNSCENTED;
                with(|s| s.geometry(flat).linearization(unscented))
            },
        ),
        pipeline("binary16 in the order of each pixel", precision, move || {
            with(|s| s.precision(half).order(GaussianOrderGAURAST::PER_PIXEL))
        }),
        pipeline("binary16 of 2D Gaussians", precision, move || with(|s| s.precision(half).geometry(flat))),
        shaders("binary16 of what a shader projects", precision, move || shaded(|s| s.precision(half))),
        pipeline("a camera in a uniform buffer that the layout does not have", binding, || {
            with(|s| s.camera_source(GaussianCameraSourceGAURAST::UNIFORM_BUFFER))
        }),
        mistake("a camera in a storage buffer", binding, |stage| {
            let buffer = Buffer::new(&stage.full, 1024);
            let set = Bindings::new(&stage.full, &[Resource::Storage(buffer.raw)]);
            let source = GaussianCameraSourceGAURAST::UNIFORM_BUFFER;
            let request = Graphics { set_layouts: vec![set.layout], ..with(|s| s.camera_source(source)) };
            creation(&stage.full, &request)
        }),
        mistake("no cameras in a uniform buffer", count, counted(0)),
        mistake("fewer cameras in a uniform buffer than views", count, counted(2)),
    ]
}

fn fixed_functions() -> Vec<Mistake> {
    vec![
        pipeline(
            "culling of back faces",
            "GAURAST-Pipeline-cull-mode",
            raster(|raster| raster.cull_mode(vk::CullModeFlags::BACK)),
        ),
        pipeline(
            "a polygon mode of lines",
            "GAURAST-Pipeline-polygon-mode",
            raster(|raster| raster.polygon_mode(vk::PolygonMode::LINE)),
        ),
        pipeline(
            "rasterizer discard",
            "VUID-VkGraphicsPipelineCreateInfo-rasterizerDiscardEnable-90080",
            raster(|raster| raster.rasterizer_discard_enable(true)),
        ),
        pipeline("dynamic rasterizer discard", "VUID-VkGraphicsPipelineCreateInfo-pDynamicStates-90082", || {
            splats().with_dynamic(vk::DynamicState::RASTERIZER_DISCARD_ENABLE)
        }),
        pipeline("two viewports", "VUID-VkGraphicsPipelineCreateInfo-viewportCount-90081", || Graphics {
            viewports: 2,
            ..splats()
        }),
        pipeline("a vertex binding whose stride is 0", "GAURAST-Pipeline-stride", || {
            let mut request = splats();
            request.bindings[0].stride = 0;
            request
        }),
        pipeline("a vertex binding whose stride is counted in floats", "GAURAST-Pipeline-stride", || {
            let mut request = splats();
            request.bindings[0].stride = 14;
            request
        }),
    ]
}

fn output() -> Vec<Mistake> {
    use vk::BlendFactor as Factor;
    vec![
        pipeline("blending that multiplies by alpha once more", "GAURAST-Pipeline-blending", || Graphics {
            blend: vec![blend(Factor::SRC_ALPHA, Factor::ONE_MINUS_SRC_ALPHA, vk::BlendOp::ADD)],
            ..splats()
        }),
        pipeline("a write mask of nothing", "GAURAST-Pipeline-write-mask", || Graphics {
            blend: vec![vk::PipelineColorBlendAttachmentState::default()],
            ..splats()
        }),
        pipeline("an integer colour attachment", "GAURAST-Pipeline-integer-attachment", || Graphics {
            formats: vec![vk::Format::R32G32B32A32_UINT],
            blend: vec![gaurast_testkit::opaque()],
            ..splats()
        }),
    ]
}
