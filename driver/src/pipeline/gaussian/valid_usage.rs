//! The rules of a Gaussian pipeline's state, each with its id, and the features that its modes need.

use crate::abi::error::Error;
use crate::physical_device::limits::MAX_SPHERICAL_HARMONICS_DEGREE;
use crate::pipeline::dynamic_state::may_gaussians_have;
use crate::pipeline::state::{GraphicsState, reads_second_source};
use crate::registry::features::Features;
use ash::vk;
use gaurast::vk::{
    GAUSSIAN_LOCATION_UNUSED_GAURAST, GaussianAntialiasingGAURAST,
    GaussianAttributeLocationsGAURAST, GaussianGeometryGAURAST, GaussianLinearizationGAURAST,
    GaussianOrderGAURAST, GaussianPrecisionGAURAST, GaussianProjectionModeGAURAST,
    PipelineGaussianStateCreateFlagsGAURAST, PipelineGaussianStateCreateInfoGAURAST,
};
use simdevice::state::gaussian::GaussianApproximation;
use std::ops::Range;

pub(super) const STRUCTURE: &str = "VkPipelineGaussianStateCreateInfoGAURAST";

/// A feature bit of the extension: its value, its name, and the id of the rule that asks for it.
pub(super) type Feature = (fn(&Features) -> bool, &'static str, &'static str);

pub(super) const TOPOLOGY: Feature = (
    |features| features.gaussian_primitive_topology,
    "gaussianPrimitiveTopology",
    "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianPrimitiveTopology-feature",
);
pub(super) const VERTEX_SHADER_PROJECTION: Feature = (
    |features| features.vertex_shader_projection,
    "vertexShaderProjection",
    "VUID-VkPipelineGaussianStateCreateInfoGAURAST-vertexShaderProjection-feature",
);
pub(super) const RESOLVE_FRAGMENT_SHADER: Feature = (
    |features| features.resolve_fragment_shader,
    "resolveFragmentShader",
    "VUID-VkPipelineGaussianStateCreateInfoGAURAST-resolveFragmentShader-feature",
);
pub(super) const RADIAL_DISTANCE_ORDER: Feature = (
    |features| features.radial_distance_order,
    "radialDistanceOrder",
    "VUID-VkPipelineGaussianStateCreateInfoGAURAST-radialDistanceOrder-feature",
);
pub(super) const PRIMITIVE_ORDER: Feature = (
    |features| features.primitive_order,
    "primitiveOrder",
    "VUID-VkPipelineGaussianStateCreateInfoGAURAST-primitiveOrder-feature",
);
pub(super) const PER_PIXEL_ORDER: Feature = (
    |features| features.per_pixel_order,
    "perPixelOrder",
    "VUID-VkPipelineGaussianStateCreateInfoGAURAST-perPixelOrder-feature",
);
pub(super) const RASTERIZATION_FLOAT16: Feature = (
    |features| features.rasterization_float16,
    "rasterizationFloat16",
    "VUID-VkPipelineGaussianStateCreateInfoGAURAST-rasterizationFloat16-feature",
);
pub(super) const OPACITY_COMPENSATION: Feature = (
    |features| features.opacity_compensation,
    "opacityCompensation",
    "VUID-VkPipelineGaussianStateCreateInfoGAURAST-opacityCompensation-feature",
);
pub(super) const UNSCENTED_PROJECTION: Feature = (
    |features| features.unscented_projection,
    "unscentedProjection",
    "VUID-VkPipelineGaussianStateCreateInfoGAURAST-unscentedProjection-feature",
);
pub(super) const GAUSSIAN_2D: Feature = (
    |features| features.gaussian_2d,
    "gaussian2D",
    "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussian2D-feature",
);
pub(super) const UNIFORM_BUFFER_CAMERA: Feature = (
    |features| features.uniform_buffer_camera,
    "uniformBufferCamera",
    "VUID-VkPipelineGaussianStateCreateInfoGAURAST-uniformBufferCamera-feature",
);
pub(super) const MERGED_DRAWS: Feature = (
    |features| features.merged_draws,
    "mergedDraws",
    "VUID-VkPipelineGaussianStateCreateInfoGAURAST-mergedDraws-feature",
);
pub(super) const INSTANCING: Feature = (
    |features| features.gaussian_instancing,
    "gaussianInstancing",
    "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianInstancing-feature",
);
pub(super) const DEPTH_STENCIL: Feature = (
    |features| features.gaussian_depth_stencil,
    "gaussianDepthStencil",
    "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianDepthStencil-feature",
);
pub(super) const MULTISAMPLE: Feature = (
    |features| features.gaussian_multisample,
    "gaussianMultisample",
    "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianMultisample-feature",
);
pub(super) const APPROXIMATION: Feature = (
    |features| features.gaussian_approximation,
    "gaussianApproximation",
    "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianApproximation-feature",
);

pub(super) const MULTIVIEW: Feature = (
    |features| features.gaussian_multiview,
    "gaussianMultiview",
    "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianMultiview-feature",
);

/// Refuses `what` unless its feature is enabled, which one that the device lacks never is.
pub(super) fn require(features: &Features, feature: Feature, what: &str) -> Result<(), Error> {
    if feature.0(features) {
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

pub(super) fn unknown(field: &str, value: &dyn std::fmt::Debug) -> Error {
    Error::usage(
        "VUID-VkPipelineGaussianStateCreateInfoGAURAST-parameter",
        format!("{STRUCTURE}: {field} has the unknown value {value:?}"),
    )
}

pub(super) fn has_fragment_stage(info: &GraphicsState) -> bool {
    let mut stages = info.stages();
    stages.any(|(stage, _)| *stage == vk::ShaderStageFlags::FRAGMENT)
}

/// Tells if a vertex shader projects, so that what fixed-function projection is told is ignored.
pub(super) fn is_shaded(gaussian: &PipelineGaussianStateCreateInfoGAURAST) -> bool {
    gaussian.projection_mode == GaussianProjectionModeGAURAST::VERTEX_SHADER
}

/// Refuses modes that mean nothing together.
pub(super) fn combinations(
    info: &GraphicsState,
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

pub(super) fn stages(
    info: &GraphicsState,
    gaussian: &PipelineGaussianStateCreateInfoGAURAST,
    features: &Features,
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
    let of = |wanted| info.stages().filter(move |(stage, _)| *stage == wanted);
    let known = vk::ShaderStageFlags::FRAGMENT
        | if shaded {
            vk::ShaderStageFlags::VERTEX
        } else {
            vk::ShaderStageFlags::empty()
        };
    let unwanted = info.stages().find(|(stage, _)| !known.contains(*stage));
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
    if info.vertex_input.primitive_restart {
        return Err(Error::usage(
            "VUID-VkPipelineInputAssemblyStateCreateInfo-topology-GAURAST",
            "primitiveRestartEnable is VK_TRUE, but the Gaussian list has no primitive restart",
        ));
    }
    Ok(())
}

/// Checks what fixed-function projection alone is told.
fn projection(
    gaussian: &PipelineGaussianStateCreateInfoGAURAST,
    features: &Features,
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

pub(super) fn modes(
    gaussian: &PipelineGaussianStateCreateInfoGAURAST,
    features: &Features,
) -> Result<(), Error> {
    if !is_shaded(gaussian) {
        projection(gaussian, features)?;
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

/// Refuses attributes that share a location: what was left zero names location 0.
pub(super) fn distinct_locations(
    locations: &GaussianAttributeLocationsGAURAST,
    coefficients: u32,
) -> Result<(), Error> {
    let members = [
        ("position", locations.position, 1),
        ("scale", locations.scale, 1),
        ("rotation", locations.rotation, 1),
        ("opacity", locations.opacity, 1),
        (
            "firstSphericalHarmonics",
            locations.first_spherical_harmonics,
            coefficients,
        ),
        ("firstModelMatrix", locations.first_model_matrix, 3),
        ("modelOpacity", locations.model_opacity, 1),
    ];
    let mut used: Vec<(&str, Range<u32>)> = Vec::new();
    for (name, first, count) in members {
        if first == GAUSSIAN_LOCATION_UNUSED_GAURAST {
            continue;
        }
        let own = first..first.saturating_add(count);
        let shared =
            |(_, other): &&(&str, Range<u32>)| own.start < other.end && other.start < own.end;
        if let Some((earlier, _)) = used.iter().find(shared) {
            return Err(Error::usage(
                "VUID-VkGaussianAttributeLocationsGAURAST-distinct",
                format!(
                    "{name} begins at location {first}, where {earlier} is: each needs locations of its own \
                     (VK_GAUSSIAN_LOCATION_UNUSED_GAURAST stands for none)"
                ),
            ));
        }
        used.push((name, own));
    }
    Ok(())
}

pub(super) fn values(gaussian: &PipelineGaussianStateCreateInfoGAURAST) -> Result<(), Error> {
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
        (
            "sphericalHarmonicsDegree",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-sphericalHarmonicsDegree-value",
        ),
        &g.spherical_harmonics_degree,
        "at most maxSphericalHarmonicsDegree (4)",
    )?;
    check(
        g.low_pass_variance >= 0.0 && g.low_pass_variance.is_finite(),
        (
            "lowPassVariance",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-lowPassVariance-value",
        ),
        &g.low_pass_variance,
        "finite and not negative",
    )?;
    check(
        (0.0..=1.0).contains(&g.alpha_floor),
        (
            "alphaFloor",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-alphaFloor-value",
        ),
        &g.alpha_floor,
        "at least 0 and at most 1",
    )?;
    check(
        g.alpha_ceiling > 0.0 && g.alpha_ceiling <= 1.0,
        (
            "alphaCeiling",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-alphaCeiling-value",
        ),
        &g.alpha_ceiling,
        "greater than 0 and at most 1",
    )?;
    check(
        g.alpha_ceiling >= g.alpha_floor,
        (
            "alphaCeiling",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-alphaCeiling-value",
        ),
        &g.alpha_ceiling,
        "at least alphaFloor",
    )?;
    check(
        g.transmittance_floor >= 0.0 && g.transmittance_floor < 1.0,
        (
            "transmittanceFloor",
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-transmittanceFloor-value",
        ),
        &g.transmittance_floor,
        "at least 0 and less than 1",
    )
}

/// Refuses what a Gaussian pipeline cannot do yet in the ordinary fixed-function state.
pub(super) fn fixed_state(info: &GraphicsState, features: &Features) -> Result<(), Error> {
    use vk::DynamicState as S;
    let depth_stencil = info.fragment_shader.depth_stencil.unwrap_or_default();
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
    let multisample = &info.fragment_output.multisample;
    let samples = multisample.rasterization_samples;
    if samples != vk::SampleCountFlags::TYPE_1 && !samples.is_empty() {
        require(
            features,
            MULTISAMPLE,
            "the pipeline has several samples per pixel",
        )?;
    }
    if info
        .pre_rasterization
        .rasterization
        .rasterizer_discard_enable
        != vk::FALSE
    {
        return Err(Error::FeatureNotPresent(
            "rasterizerDiscardEnable with Gaussians".into(),
        ));
    }
    let shades = has_fragment_stage(info);
    if let Some(state) = info
        .dynamic
        .iter()
        .find(|state| !may_gaussians_have(**state))
    {
        return Err(Error::FeatureNotPresent(format!(
            "the dynamic state {state:?} with Gaussians"
        )));
    }
    if !shades && info.fragment_output.blend.iter().any(reads_second_source) {
        return Err(Error::FeatureNotPresent(
            "a second source of blending (feature dualSrcBlend) with Gaussians and no fragment stage"
                .into(),
        ));
    }
    if info.pre_rasterization.viewport_count > 1 {
        return Err(Error::usage(
            "VUID-VkPipelineViewportStateCreateInfo-viewportCount-01216",
            "viewportCount is greater than 1, but Gaussians go to one viewport",
        ));
    }
    Ok(())
}

/// Validates and converts the chain's structure of approximations, if it has one.
pub(super) fn approximation(
    info: &GraphicsState,
    features: &Features,
) -> Result<GaussianApproximation, Error> {
    let Some(given) = &info.approximation else {
        return Ok(GaussianApproximation::default());
    };
    check_fraction(
        "exponentialError",
        "VUID-VkPipelineGaussianApproximationStateCreateInfoGAURAST-exponentialError-value",
        given.exponential_error,
    )?;
    check_fraction(
        "contributionBudget",
        "VUID-VkPipelineGaussianApproximationStateCreateInfoGAURAST-contributionBudget-value",
        given.contribution_budget,
    )?;
    let approximation = GaussianApproximation {
        exponential_error: given.exponential_error,
        contribution_budget: given.contribution_budget,
    };
    if approximation != GaussianApproximation::default() {
        let what = "exponentialError or contributionBudget is not 0";
        require(features, APPROXIMATION, what)?;
    }
    Ok(approximation)
}

fn check_fraction(name: &str, vuid: &'static str, value: f32) -> Result<(), Error> {
    // A NaN is in no range.
    if (0.0..=1.0).contains(&value) {
        return Ok(());
    }
    let message = format!(
        "VkPipelineGaussianApproximationStateCreateInfoGAURAST: {name} is {value}, but must be at least 0 and at most 1"
    );
    Err(Error::usage(vuid, message))
}
