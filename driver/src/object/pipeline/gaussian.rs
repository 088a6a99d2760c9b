//! Pipelines of the Gaussian list topology.

use super::fixed::FixedState;
use super::vertex_input::attribute;
use super::{GaussianPipeline, GraphicsPipelineInfo, blend, viewport};
use crate::capabilities::features::EnabledFeatures;
use crate::error::Error;
use crate::lower::rendering;
use ash::vk;
use gaurast::vk::{
    GAUSSIAN_LOCATION_UNUSED_GAURAST, GaussianAntialiasingGAURAST, GaussianCameraSourceGAURAST,
    GaussianGeometryGAURAST, GaussianLinearizationGAURAST, GaussianOrderGAURAST,
    GaussianPrecisionGAURAST, GaussianProjectionModeGAURAST,
    PipelineGaussianStateCreateFlagsGAURAST, PipelineGaussianStateCreateInfoGAURAST,
};
use simdevice::packet::draw::DrawState;
use simdevice::packet::{GaussianOrder, GaussianState};
use std::sync::Arc;

/// The greatest degree of spherical harmonics that a pipeline may ask for.
pub(crate) const MAX_SPHERICAL_HARMONICS_DEGREE: u32 = 3;

const STRUCTURE: &str = "VkPipelineGaussianStateCreateInfoGAURAST";

impl GaussianPipeline {
    /// Validates and converts the Gaussian part of a pipeline.
    pub(super) fn new(
        info: &GraphicsPipelineInfo,
        features: &EnabledFeatures,
    ) -> Result<Self, Error> {
        require(
            "gaussianPrimitiveTopology",
            features.has("gaussian_primitive_topology"),
        )?;
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
        validate_stages(info, gaussian)?;
        validate_modes(gaussian)?;
        validate_values(gaussian)?;
        validate_fixed_state(info, features)?;
        let fragments = FixedState::of_gaussians(info)?;

        let locations = &gaussian.attribute_locations;
        for (name, location) in [
            ("firstModelMatrix", locations.first_model_matrix),
            ("modelOpacity", locations.model_opacity),
        ] {
            if location != GAUSSIAN_LOCATION_UNUSED_GAURAST {
                return Err(unbuilt(&format!("{name} is used"), "gaussianInstancing"));
            }
        }
        let degree = gaussian.spherical_harmonics_degree;
        let coefficients = (degree + 1) * (degree + 1);
        let first = locations.first_spherical_harmonics;
        Ok(Self {
            position: attribute(info, "position", locations.position, 3)?,
            scale: attribute(info, "scale", locations.scale, 3)?,
            rotation: attribute(info, "rotation", locations.rotation, 4)?,
            opacity: attribute(info, "opacity", locations.opacity, 1)?,
            spherical_harmonics: (0..coefficients)
                .map(|k| {
                    let name = format!("spherical harmonics coefficient {k}");
                    attribute(info, &name, first.saturating_add(k), 3)
                })
                .collect::<Result<_, _>>()?,
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
        })
    }
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
            require("opacityCompensation", features.has("opacity_compensation"))?;
            true
        }
        other => return Err(unknown("antialiasing", &other)),
    };
    let order = match gaussian.order {
        GaussianOrderGAURAST::VIEW_DEPTH => GaussianOrder::ViewDepth,
        GaussianOrderGAURAST::RADIAL_DISTANCE => {
            require("radialDistanceOrder", features.has("radial_distance_order"))?;
            GaussianOrder::RadialDistance
        }
        GaussianOrderGAURAST::PRIMITIVE => {
            require("primitiveOrder", features.has("primitive_order"))?;
            GaussianOrder::Primitive
        }
        GaussianOrderGAURAST::PER_PIXEL => {
            return Err(unbuilt("order is PER_PIXEL", "perPixelOrder"));
        }
        other => return Err(unknown("order", &other)),
    };
    Ok(GaussianState {
        sh_degree: gaussian.spherical_harmonics_degree,
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

fn validate_stages(
    info: &GraphicsPipelineInfo,
    gaussian: &PipelineGaussianStateCreateInfoGAURAST,
) -> Result<(), Error> {
    match gaussian.projection_mode {
        GaussianProjectionModeGAURAST::FIXED_FUNCTION => {}
        GaussianProjectionModeGAURAST::VERTEX_SHADER => {
            return Err(unbuilt(
                "projectionMode is VERTEX_SHADER",
                "vertexShaderProjection",
            ));
        }
        other => return Err(unknown("projectionMode", &other)),
    }
    let has_fragment_stage = info
        .stages
        .iter()
        .any(|(stage, _)| *stage == vk::ShaderStageFlags::FRAGMENT);
    if has_fragment_stage {
        return Err(unbuilt(
            "the pipeline has a fragment stage",
            "resolveFragmentShader",
        ));
    }
    if let Some((stage, _)) = info.stages.first() {
        return Err(Error::usage(
            "VUID-VkGraphicsPipelineCreateInfo-projectionMode-GAURAST",
            format!(
                "projectionMode is FIXED_FUNCTION, so the pipeline must not have a stage {stage:?}"
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

fn validate_modes(gaussian: &PipelineGaussianStateCreateInfoGAURAST) -> Result<(), Error> {
    match gaussian.geometry {
        GaussianGeometryGAURAST::GAUSSIAN_3D => {}
        GaussianGeometryGAURAST::GAUSSIAN_2D => {
            return Err(unbuilt("geometry is GAUSSIAN_2D", "gaussian2D"));
        }
        other => return Err(unknown("geometry", &other)),
    }
    match gaussian.linearization {
        GaussianLinearizationGAURAST::JACOBIAN => {}
        GaussianLinearizationGAURAST::UNSCENTED => {
            return Err(unbuilt("linearization is UNSCENTED", "unscentedProjection"));
        }
        other => return Err(unknown("linearization", &other)),
    }
    match gaussian.precision {
        GaussianPrecisionGAURAST::FLOAT32 => {}
        GaussianPrecisionGAURAST::FLOAT16 => {
            return Err(unbuilt("precision is FLOAT16", "rasterizationFloat16"));
        }
        other => return Err(unknown("precision", &other)),
    }
    match gaussian.camera_source {
        GaussianCameraSourceGAURAST::COMMAND => {}
        GaussianCameraSourceGAURAST::UNIFORM_BUFFER => {
            return Err(unbuilt(
                "cameraSource is UNIFORM_BUFFER",
                "uniformBufferCamera",
            ));
        }
        other => return Err(unknown("cameraSource", &other)),
    }
    if gaussian
        .flags
        .contains(PipelineGaussianStateCreateFlagsGAURAST::MERGE_DRAWS)
    {
        return Err(unbuilt("flags has MERGE_DRAWS", "mergedDraws"));
    }
    if !gaussian.flags.is_empty() {
        return Err(unknown("flags", &gaussian.flags));
    }
    Ok(())
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
        g.spherical_harmonics_degree <= MAX_SPHERICAL_HARMONICS_DEGREE,
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
            "gaussianDepthStencil",
            features.has("gaussian_depth_stencil"),
        )?;
    }
    let multisample = &info.multisample;
    let samples = multisample.rasterization_samples;
    if samples != vk::SampleCountFlags::TYPE_1 && !samples.is_empty() {
        require("gaussianMultisample", features.has("gaussian_multisample"))?;
    }
    if info.rasterization.rasterizer_discard_enable != vk::FALSE {
        return Err(Error::FeatureNotPresent(
            "rasterizerDiscardEnable with Gaussians".into(),
        ));
    }
    if multisample.alpha_to_coverage_enable != vk::FALSE
        || multisample.alpha_to_one_enable != vk::FALSE
    {
        return Err(Error::FeatureNotPresent(
            "alphaToCoverageEnable or alphaToOneEnable with Gaussians".into(),
        ));
    }
    if let Some(state) = info.dynamic.iter().find(|state| !may_be_dynamic(**state)) {
        return Err(Error::FeatureNotPresent(format!(
            "the dynamic state {state:?} with Gaussians"
        )));
    }
    if info.blend.iter().any(blend::reads_second_source) {
        return Err(Error::FeatureNotPresent(
            "a second source of blending (feature dualSrcBlend) with Gaussians".into(),
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

fn require(feature: &str, enabled: bool) -> Result<(), Error> {
    if enabled {
        return Ok(());
    }
    Err(Error::FeatureNotPresent(format!(
        "{STRUCTURE}: what needs the feature {feature}, which is not enabled on the device,"
    )))
}

/// A mode that the extension has and this device doesn't.
fn unbuilt(what: &str, feature: &str) -> Error {
    Error::FeatureNotPresent(format!("{STRUCTURE}: {what} (feature {feature}), which"))
}

fn unknown(field: &str, value: &dyn std::fmt::Debug) -> Error {
    Error::usage(
        "VUID-VkPipelineGaussianStateCreateInfoGAURAST-parameter",
        format!("{STRUCTURE}: {field} has the unknown value {value:?}"),
    )
}
