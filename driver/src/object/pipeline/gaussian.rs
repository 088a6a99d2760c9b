//! Pipelines of the Gaussian list topology.

use super::fixed::FixedState;
use super::gaussian_stages::{ResolveStage, VertexProjection};
use super::vertex_input::attribute;
use super::{
    CameraSource, GaussianAttributeSources, GaussianPipeline, GaussianSource, GraphicsPipelineInfo,
    blend, viewport,
};
use crate::capabilities::features::EnabledFeatures;
use crate::error::Error;
use crate::lower::camera::CameraModels;
use crate::lower::rendering;
use crate::object::descriptor::layout::Binding;
use crate::object::device::Device;
use ash::vk;
use gaurast::vk::{
    GAUSSIAN_LOCATION_UNUSED_GAURAST, GaussianAntialiasingGAURAST, GaussianCameraSourceGAURAST,
    GaussianGeometryGAURAST, GaussianLinearizationGAURAST, GaussianOrderGAURAST,
    GaussianPrecisionGAURAST, GaussianProjectionModeGAURAST,
    PipelineGaussianStateCreateFlagsGAURAST, PipelineGaussianStateCreateInfoGAURAST,
};
use simdevice::packet::draw::DrawState;
use simdevice::packet::{
    GaussianGeometry, GaussianLinearization, GaussianOrder, GaussianPrecision, GaussianState,
};
use std::sync::Arc;

/// The greatest degree of spherical harmonics that a pipeline may ask for.
pub(crate) const MAX_SPHERICAL_HARMONICS_DEGREE: u32 = 3;

const STRUCTURE: &str = "VkPipelineGaussianStateCreateInfoGAURAST";

impl GaussianPipeline {
    /// Validates and converts the Gaussian part of a pipeline.
    pub(super) fn new(device: &Device, info: &GraphicsPipelineInfo) -> Result<Self, Error> {
        let features = device.features();
        require(features, TOPOLOGY, "the topology is the Gaussian list")?;
        let Some(gaussian) = &info.gaussian else {
            return Err(Error::usage(
                "VUID-VkGraphicsPipelineCreateInfo-topology-GAURAST",
                format!(
                    "a pipeline of topology VK_PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST must chain a \
                     {STRUCTURE}; if a validation layer is enabled, name the structure to it with \
                     VK_LAYER_CUSTOM_STYPE_LIST"
                ),
            ));
        };
        validate_combinations(info, gaussian)?;
        validate_stages(info, gaussian, features)?;
        validate_modes(gaussian, features)?;
        validate_values(gaussian)?;
        validate_fixed_state(info, features)?;
        let fragments = FixedState::of_gaussians(info)?;

        Ok(Self {
            source: source(device, info, gaussian)?,
            resolve: ResolveStage::new(device, info, gaussian, &fragments)?,
            state: Arc::new(state(gaussian, features, fragments.lower())?),
            dynamic: info.dynamic.iter().copied().filter(is_taken).collect(),
            fixed: fragments,
            viewport: fixed(
                "viewport",
                info.is_dynamic(vk::DynamicState::VIEWPORT)
                    || info.is_dynamic(vk::DynamicState::VIEWPORT_WITH_COUNT),
                info.viewports,
            )?
            .map(viewport),
            scissor: fixed(
                "scissor",
                info.is_dynamic(vk::DynamicState::SCISSOR)
                    || info.is_dynamic(vk::DynamicState::SCISSOR_WITH_COUNT),
                info.scissors,
            )?
            .map(rendering::rect),
            camera: camera_source(info, gaussian, features)?,
            camera_models: CameraModels::of(features),
            merges_draws: gaussian
                .flags
                .contains(PipelineGaussianStateCreateFlagsGAURAST::MERGE_DRAWS),
        })
    }
}

/// Where Gaussians come from.
fn source(
    device: &Device,
    info: &GraphicsPipelineInfo,
    gaussian: &PipelineGaussianStateCreateInfoGAURAST,
) -> Result<GaussianSource, Error> {
    if is_shaded(gaussian) {
        let projection = VertexProjection::new(device, info, gaussian)?;
        return Ok(GaussianSource::VertexShader(projection));
    }
    let locations = &gaussian.attribute_locations;
    for (name, location) in [
        ("firstModelMatrix", locations.first_model_matrix),
        ("modelOpacity", locations.model_opacity),
    ] {
        if location != GAUSSIAN_LOCATION_UNUSED_GAURAST {
            require(device.features(), INSTANCING, &format!("{name} is used"))?;
        }
    }
    let degree = gaussian.spherical_harmonics_degree;
    let coefficients = (degree + 1) * (degree + 1);
    let first = locations.first_spherical_harmonics;
    let scales = match gaussian.geometry {
        GaussianGeometryGAURAST::GAUSSIAN_2D => 2,
        _ => 3,
    };
    Ok(GaussianSource::Attributes(GaussianAttributeSources {
        position: attribute(info, "position", locations.position, 3)?,
        scale: attribute(info, "scale", locations.scale, scales)?,
        rotation: attribute(info, "rotation", locations.rotation, 4)?,
        opacity: attribute(info, "opacity", locations.opacity, 1)?,
        spherical_harmonics: (0..coefficients)
            .map(|k| {
                let name = format!("spherical harmonics coefficient {k}");
                attribute(info, &name, first.saturating_add(k), 3)
            })
            .collect::<Result<_, _>>()?,
        model_matrix: match locations.first_model_matrix {
            GAUSSIAN_LOCATION_UNUSED_GAURAST => None,
            first => {
                let row = |k| attribute(info, "a model matrix's row", first.saturating_add(k), 4);
                Some([row(0)?, row(1)?, row(2)?])
            }
        },
        model_opacity: match locations.model_opacity {
            GAUSSIAN_LOCATION_UNUSED_GAURAST => None,
            location => Some(attribute(info, "modelOpacity", location, 1)?),
        },
    }))
}

fn has_fragment_stage(info: &GraphicsPipelineInfo) -> bool {
    let mut stages = info.stages.iter();
    stages.any(|(stage, _)| *stage == vk::ShaderStageFlags::FRAGMENT)
}

/// Whether a vertex shader projects, so that what fixed-function projection is told is ignored.
fn is_shaded(gaussian: &PipelineGaussianStateCreateInfoGAURAST) -> bool {
    gaussian.projection_mode == GaussianProjectionModeGAURAST::VERTEX_SHADER
}

/// The state's first element, unless it is dynamic.
fn fixed<T: Copy>(name: &str, dynamic: bool, values: &[T]) -> Result<Option<T>, Error> {
    match (dynamic, values.first()) {
        (true, _) => Ok(None),
        (false, Some(&value)) => Ok(Some(value)),
        (false, None) => Err(Error::usage(
            "VUID-VkGraphicsPipelineCreateInfo-pDynamicStates-04130",
            format!("the pipeline has no {name}, and its {name} is not dynamic"),
        )),
    }
}

fn state(
    gaussian: &PipelineGaussianStateCreateInfoGAURAST,
    features: &EnabledFeatures,
    fragments: DrawState,
) -> Result<GaussianState, Error> {
    let opacity_compensated = match gaussian.antialiasing {
        GaussianAntialiasingGAURAST::DILATE => false,
        GaussianAntialiasingGAURAST::OPACITY_COMPENSATED => {
            require(
                features,
                OPACITY_COMPENSATION,
                "antialiasing is OPACITY_COMPENSATED",
            )?;
            true
        }
        other => return Err(unknown("antialiasing", &other)),
    };
    let order = match gaussian.order {
        GaussianOrderGAURAST::VIEW_DEPTH => GaussianOrder::ViewDepth,
        GaussianOrderGAURAST::RADIAL_DISTANCE => {
            require(features, RADIAL_DISTANCE_ORDER, "order is RADIAL_DISTANCE")?;
            GaussianOrder::RadialDistance
        }
        GaussianOrderGAURAST::PRIMITIVE => {
            require(features, PRIMITIVE_ORDER, "order is PRIMITIVE")?;
            GaussianOrder::Primitive
        }
        GaussianOrderGAURAST::PER_PIXEL => {
            require(features, PER_PIXEL_ORDER, "order is PER_PIXEL")?;
            GaussianOrder::PerPixel
        }
        other => return Err(unknown("order", &other)),
    };
    Ok(GaussianState {
        precision: match gaussian.precision {
            GaussianPrecisionGAURAST::FLOAT16 => GaussianPrecision::Float16,
            _ => GaussianPrecision::Float32,
        },
        // What a vertex shader projects has neither.
        geometry: match gaussian.geometry {
            GaussianGeometryGAURAST::GAUSSIAN_2D if !is_shaded(gaussian) => {
                GaussianGeometry::Surfel
            }
            _ => GaussianGeometry::Volume,
        },
        sh_degree: if is_shaded(gaussian) {
            0
        } else {
            gaussian.spherical_harmonics_degree
        },
        linearization: match gaussian.linearization {
            GaussianLinearizationGAURAST::UNSCENTED if !is_shaded(gaussian) => {
                GaussianLinearization::Unscented
            }
            _ => GaussianLinearization::Jacobian,
        },
        order,
        opacity_compensated,
        low_pass_variance: gaussian.low_pass_variance,
        alpha_floor: gaussian.alpha_floor,
        alpha_ceiling: gaussian.alpha_ceiling,
        transmittance_floor: gaussian.transmittance_floor,
        sample_mask: fragments.sample_mask,
        depth_stencil: fragments.depth_stencil,
        logic_op: fragments.logic_op,
        blend: fragments.blend,
        blend_constants: fragments.blend_constants,
    })
}

/// Refuses modes that mean nothing together.
fn validate_combinations(
    info: &GraphicsPipelineInfo,
    gaussian: &PipelineGaussianStateCreateInfoGAURAST,
) -> Result<(), Error> {
    let broken =
        |id: &'static str, what: &str| Err(Error::usage(id, format!("{STRUCTURE}: {what}")));
    let shaded = is_shaded(gaussian);
    let per_pixel = gaussian.order == GaussianOrderGAURAST::PER_PIXEL;
    let flat = gaussian.geometry == GaussianGeometryGAURAST::GAUSSIAN_2D;
    let half = gaussian.precision == GaussianPrecisionGAURAST::FLOAT16;
    let placed =
        gaussian.attribute_locations.first_model_matrix != GAUSSIAN_LOCATION_UNUSED_GAURAST;
    if !shaded && placed && (per_pixel || flat) {
        return broken(
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-firstModelMatrix-modes",
            "firstModelMatrix is used, but order is PER_PIXEL or geometry is GAUSSIAN_2D",
        );
    }
    if !shaded && flat && gaussian.linearization != GaussianLinearizationGAURAST::JACOBIAN {
        return broken(
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-geometry-linearization",
            "linearization is not JACOBIAN, but geometry is GAUSSIAN_2D, which is not linearized",
        );
    }
    if flat && gaussian.antialiasing == GaussianAntialiasingGAURAST::OPACITY_COMPENSATED {
        return broken(
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-geometry-antialiasing",
            "antialiasing is OPACITY_COMPENSATED, but geometry is GAUSSIAN_2D, which is not dilated",
        );
    }
    if half && (flat || per_pixel || shaded) {
        return broken(
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-precision-modes",
            "precision is FLOAT16, but geometry is GAUSSIAN_2D, order is PER_PIXEL or projectionMode is \
             VERTEX_SHADER, which are for FLOAT32",
        );
    }
    let reads_depth = has_fragment_stage(info)
        && gaussian.resolve_input_locations.depth != GAUSSIAN_LOCATION_UNUSED_GAURAST;
    if reads_depth && (half || per_pixel) {
        return broken(
            "VUID-VkGaussianResolveInputLocationsGAURAST-depth-modes",
            "a fragment stage has depths for an input, but precision is FLOAT16 or order is PER_PIXEL, which \
             accumulate none",
        );
    }
    Ok(())
}

fn validate_stages(
    info: &GraphicsPipelineInfo,
    gaussian: &PipelineGaussianStateCreateInfoGAURAST,
    features: &EnabledFeatures,
) -> Result<(), Error> {
    match gaussian.projection_mode {
        GaussianProjectionModeGAURAST::FIXED_FUNCTION => {}
        GaussianProjectionModeGAURAST::VERTEX_SHADER => {
            let what = "projectionMode is VERTEX_SHADER";
            require(features, VERTEX_SHADER_PROJECTION, what)?;
        }
        other => return Err(unknown("projectionMode", &other)),
    }
    if has_fragment_stage(info) {
        let what = "the pipeline has a fragment stage";
        require(features, RESOLVE_FRAGMENT_SHADER, what)?;
    }
    let shaded = is_shaded(gaussian);
    let of = |wanted| {
        info.stages
            .iter()
            .filter(move |(stage, _)| *stage == wanted)
    };
    let known = vk::ShaderStageFlags::FRAGMENT
        | if shaded {
            vk::ShaderStageFlags::VERTEX
        } else {
            vk::ShaderStageFlags::empty()
        };
    let unwanted = info
        .stages
        .iter()
        .find(|(stage, _)| !known.contains(*stage));
    let wrong = if let Some((stage, _)) = unwanted {
        Some(format!("must not have a stage {stage:?}"))
    } else if of(vk::ShaderStageFlags::VERTEX).count() != usize::from(shaded) {
        Some("must have one vertex stage".into())
    } else if of(vk::ShaderStageFlags::FRAGMENT).count() > 1 {
        Some("must not have several fragment stages".into())
    } else {
        None
    };
    if let Some(wrong) = wrong {
        return Err(Error::usage(
            "VUID-VkGraphicsPipelineCreateInfo-projectionMode-GAURAST",
            format!(
                "projectionMode is {:?}, so the pipeline {wrong}",
                gaussian.projection_mode
            ),
        ));
    }
    if info.primitive_restart {
        return Err(Error::usage(
            "VUID-VkPipelineInputAssemblyStateCreateInfo-topology-GAURAST",
            "primitiveRestartEnable is VK_TRUE, but the Gaussian list has no primitive restart",
        ));
    }
    Ok(())
}

/// What fixed-function projection alone is told.
fn validate_projection(
    gaussian: &PipelineGaussianStateCreateInfoGAURAST,
    features: &EnabledFeatures,
) -> Result<(), Error> {
    match gaussian.geometry {
        GaussianGeometryGAURAST::GAUSSIAN_3D => {}
        GaussianGeometryGAURAST::GAUSSIAN_2D => {
            require(features, GAUSSIAN_2D, "geometry is GAUSSIAN_2D")?;
        }
        other => return Err(unknown("geometry", &other)),
    }
    match gaussian.linearization {
        GaussianLinearizationGAURAST::JACOBIAN => {}
        GaussianLinearizationGAURAST::UNSCENTED => {
            require(features, UNSCENTED_PROJECTION, "linearization is UNSCENTED")?;
        }
        other => return Err(unknown("linearization", &other)),
    }
    Ok(())
}

fn validate_modes(
    gaussian: &PipelineGaussianStateCreateInfoGAURAST,
    features: &EnabledFeatures,
) -> Result<(), Error> {
    if !is_shaded(gaussian) {
        validate_projection(gaussian, features)?;
    }
    match gaussian.precision {
        GaussianPrecisionGAURAST::FLOAT32 => {}
        GaussianPrecisionGAURAST::FLOAT16 => {
            require(features, RASTERIZATION_FLOAT16, "precision is FLOAT16")?;
        }
        other => return Err(unknown("precision", &other)),
    }
    let merge_draws = PipelineGaussianStateCreateFlagsGAURAST::MERGE_DRAWS;
    if gaussian.flags.contains(merge_draws) {
        require(features, MERGED_DRAWS, "flags has MERGE_DRAWS")?;
    }
    if !merge_draws.contains(gaussian.flags) {
        return Err(unknown("flags", &gaussian.flags));
    }
    Ok(())
}

/// Where draws take their camera from.
fn camera_source(
    info: &GraphicsPipelineInfo,
    gaussian: &PipelineGaussianStateCreateInfoGAURAST,
    features: &EnabledFeatures,
) -> Result<CameraSource, Error> {
    match gaussian.camera_source {
        _ if is_shaded(gaussian) => return Ok(CameraSource::None),
        GaussianCameraSourceGAURAST::COMMAND => return Ok(CameraSource::Command),
        GaussianCameraSourceGAURAST::UNIFORM_BUFFER => {}
        other => return Err(unknown("cameraSource", &other)),
    }
    require(
        features,
        UNIFORM_BUFFER_CAMERA,
        "cameraSource is UNIFORM_BUFFER",
    )?;
    let (set, binding) = (gaussian.camera_set, gaussian.camera_binding);
    let is_there = info.layout.is_some_and(|layout| {
        let found = layout.set_layout(set).ok();
        found
            .and_then(|set| set.binding(binding))
            .is_some_and(holds_camera)
    });
    if !is_there {
        return Err(Error::usage(
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-cameraBinding-layout",
            format!(
                "{STRUCTURE}: the pipeline layout has no uniform buffer visible to the vertex stage at set {set}, \
                 binding {binding}, where cameraSet and cameraBinding want one"
            ),
        ));
    }
    Ok(CameraSource::UniformBuffer { set, binding })
}

/// Whether a binding is a uniform buffer that the vertex stage sees.
fn holds_camera(binding: &Binding) -> bool {
    let is_uniform = matches!(
        binding.kind,
        vk::DescriptorType::UNIFORM_BUFFER | vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC
    );
    is_uniform && binding.count > 0 && binding.stages.contains(vk::ShaderStageFlags::VERTEX)
}

/// A member's name and the id of the rule on its value.
macro_rules! named {
    ($name:literal) => {
        (
            $name,
            concat!(
                "VUID-VkPipelineGaussianStateCreateInfoGAURAST-",
                $name,
                "-value"
            ),
        )
    };
}

fn validate_values(gaussian: &PipelineGaussianStateCreateInfoGAURAST) -> Result<(), Error> {
    let check = |valid: bool, (name, vuid), value: &dyn std::fmt::Display, rule: &str| {
        if valid {
            return Ok(());
        }
        let message: String = format!("{STRUCTURE}: {name} is {value}, but must be {rule}");
        Err(Error::usage(vuid, message))
    };
    // Comparisons are false for NaN, which is therefore refused.
    let g = gaussian;
    check(
        is_shaded(g) || g.spherical_harmonics_degree <= MAX_SPHERICAL_HARMONICS_DEGREE,
        named!("sphericalHarmonicsDegree"),
        &g.spherical_harmonics_degree,
        "at most maxSphericalHarmonicsDegree (3)",
    )?;
    check(
        g.low_pass_variance >= 0.0 && g.low_pass_variance.is_finite(),
        named!("lowPassVariance"),
        &g.low_pass_variance,
        "finite and not negative",
    )?;
    check(
        (0.0..=1.0).contains(&g.alpha_floor),
        named!("alphaFloor"),
        &g.alpha_floor,
        "at least 0 and at most 1",
    )?;
    check(
        g.alpha_ceiling > 0.0 && g.alpha_ceiling <= 1.0,
        named!("alphaCeiling"),
        &g.alpha_ceiling,
        "greater than 0 and at most 1",
    )?;
    check(
        g.alpha_ceiling >= g.alpha_floor,
        named!("alphaCeiling"),
        &g.alpha_ceiling,
        "at least alphaFloor",
    )?;
    check(
        g.transmittance_floor >= 0.0 && g.transmittance_floor < 1.0,
        named!("transmittanceFloor"),
        &g.transmittance_floor,
        "at least 0 and less than 1",
    )
}

/// Refuses what a Gaussian pipeline cannot do yet in the ordinary fixed-function state.
fn validate_fixed_state(
    info: &GraphicsPipelineInfo,
    features: &EnabledFeatures,
) -> Result<(), Error> {
    use vk::DynamicState as S;
    let depth_stencil = info.depth_stencil.unwrap_or_default();
    let tests = [
        (depth_stencil.depth_test_enable, S::DEPTH_TEST_ENABLE),
        (
            depth_stencil.depth_bounds_test_enable,
            S::DEPTH_BOUNDS_TEST_ENABLE,
        ),
        (depth_stencil.stencil_test_enable, S::STENCIL_TEST_ENABLE),
    ];
    if tests
        .iter()
        .any(|&(enable, state)| enable != vk::FALSE || info.is_dynamic(state))
    {
        require(
            features,
            DEPTH_STENCIL,
            "the pipeline has a depth, depth bounds or stencil test",
        )?;
    }
    let multisample = &info.multisample;
    let samples = multisample.rasterization_samples;
    if samples != vk::SampleCountFlags::TYPE_1 && !samples.is_empty() {
        require(
            features,
            MULTISAMPLE,
            "the pipeline has several samples per pixel",
        )?;
    }
    if info.rasterization.rasterizer_discard_enable != vk::FALSE {
        return Err(Error::FeatureNotPresent(
            "rasterizerDiscardEnable with Gaussians".into(),
        ));
    }
    let shades = has_fragment_stage(info);
    if !shades
        && (multisample.alpha_to_coverage_enable != vk::FALSE
            || multisample.alpha_to_one_enable != vk::FALSE)
    {
        return Err(Error::FeatureNotPresent(
            "alphaToCoverageEnable or alphaToOneEnable with Gaussians and no fragment stage".into(),
        ));
    }
    if let Some(state) = info.dynamic.iter().find(|state| !may_be_dynamic(**state)) {
        return Err(Error::FeatureNotPresent(format!(
            "the dynamic state {state:?} with Gaussians"
        )));
    }
    if !shades && info.blend.iter().any(blend::reads_second_source) {
        return Err(Error::FeatureNotPresent(
            "a second source of blending (feature dualSrcBlend) with Gaussians and no fragment stage"
                .into(),
        ));
    }
    if info.viewport_count > 1 {
        return Err(Error::usage(
            "VUID-VkPipelineViewportStateCreateInfo-viewportCount-01216",
            "viewportCount is greater than 1, but Gaussians go to one viewport",
        ));
    }
    Ok(())
}

/// Whether a Gaussian pipeline takes the state from the command buffer, or has no use for it.
fn may_be_dynamic(state: vk::DynamicState) -> bool {
    use vk::DynamicState as S;
    is_taken(&state)
        || matches!(
            state,
            S::VIEWPORT
                | S::SCISSOR
                | S::VIEWPORT_WITH_COUNT
                | S::SCISSOR_WITH_COUNT
                | S::VERTEX_INPUT_BINDING_STRIDE
                | S::LINE_WIDTH
                | S::DEPTH_BIAS
                | S::DEPTH_BIAS_ENABLE
                | S::CULL_MODE
                | S::FRONT_FACE
                | S::PRIMITIVE_TOPOLOGY
        )
}

/// Whether the state says what becomes of a Gaussian draw's fragments.
fn is_taken(state: &vk::DynamicState) -> bool {
    use vk::DynamicState as S;
    matches!(
        *state,
        S::BLEND_CONSTANTS
            | S::DEPTH_BOUNDS
            | S::DEPTH_BOUNDS_TEST_ENABLE
            | S::DEPTH_TEST_ENABLE
            | S::DEPTH_WRITE_ENABLE
            | S::DEPTH_COMPARE_OP
            | S::STENCIL_TEST_ENABLE
            | S::STENCIL_COMPARE_MASK
            | S::STENCIL_WRITE_MASK
            | S::STENCIL_REFERENCE
            | S::STENCIL_OP
    )
}

/// A feature bit of the extension: its name here, its name there, and the id of the rule that asks for it.
type Feature = (&'static str, &'static str, &'static str);

macro_rules! feature {
    ($field:literal, $name:literal) => {
        (
            $field,
            $name,
            concat!(
                "VUID-VkPipelineGaussianStateCreateInfoGAURAST-",
                $name,
                "-feature"
            ),
        )
    };
}

const TOPOLOGY: Feature = feature!("gaussian_primitive_topology", "gaussianPrimitiveTopology");
const VERTEX_SHADER_PROJECTION: Feature =
    feature!("vertex_shader_projection", "vertexShaderProjection");
const RESOLVE_FRAGMENT_SHADER: Feature =
    feature!("resolve_fragment_shader", "resolveFragmentShader");
const RADIAL_DISTANCE_ORDER: Feature = feature!("radial_distance_order", "radialDistanceOrder");
const PRIMITIVE_ORDER: Feature = feature!("primitive_order", "primitiveOrder");
const PER_PIXEL_ORDER: Feature = feature!("per_pixel_order", "perPixelOrder");
const RASTERIZATION_FLOAT16: Feature = feature!("rasterization_float16", "rasterizationFloat16");
const OPACITY_COMPENSATION: Feature = feature!("opacity_compensation", "opacityCompensation");
const UNSCENTED_PROJECTION: Feature = feature!("unscented_projection", "unscentedProjection");
const GAUSSIAN_2D: Feature = feature!("gaussian_2d", "gaussian2D");
const UNIFORM_BUFFER_CAMERA: Feature = feature!("uniform_buffer_camera", "uniformBufferCamera");
const MERGED_DRAWS: Feature = feature!("merged_draws", "mergedDraws");
const INSTANCING: Feature = feature!("gaussian_instancing", "gaussianInstancing");
const DEPTH_STENCIL: Feature = feature!("gaussian_depth_stencil", "gaussianDepthStencil");
const MULTISAMPLE: Feature = feature!("gaussian_multisample", "gaussianMultisample");

/// Refuses `what` unless its feature is enabled, which one that the device lacks never is.
fn require(features: &EnabledFeatures, feature: Feature, what: &str) -> Result<(), Error> {
    if features.has(feature.0) {
        return Ok(());
    }
    Err(not_enabled(feature, what))
}

fn not_enabled((_, name, vuid): Feature, what: &str) -> Error {
    Error::FeatureNotEnabled {
        vuid,
        message: format!("{STRUCTURE}: {what}, but the feature {name} is not enabled"),
    }
}

fn unknown(field: &str, value: &dyn std::fmt::Debug) -> Error {
    Error::usage(
        "VUID-VkPipelineGaussianStateCreateInfoGAURAST-parameter",
        format!("{STRUCTURE}: {field} has the unknown value {value:?}"),
    )
}
