//! The extension's features, and what is said where one is missing.

use super::STRUCTURE;
use crate::error::Error;
use crate::registry::features::Features;

/// A feature bit of the extension: its value, its name, and the id of the rule that asks for it.
pub(super) type Feature = (fn(&Features) -> bool, &'static str, &'static str);

macro_rules! feature {
    ($field:ident, $name:literal) => {
        (
            |features| features.$field,
            $name,
            concat!(
                "VUID-VkPipelineGaussianStateCreateInfoGAURAST-",
                $name,
                "-feature"
            ),
        )
    };
}

pub(super) const TOPOLOGY: Feature =
    feature!(gaussian_primitive_topology, "gaussianPrimitiveTopology");
pub(super) const VERTEX_SHADER_PROJECTION: Feature =
    feature!(vertex_shader_projection, "vertexShaderProjection");
pub(super) const RESOLVE_FRAGMENT_SHADER: Feature =
    feature!(resolve_fragment_shader, "resolveFragmentShader");
pub(super) const RADIAL_DISTANCE_ORDER: Feature =
    feature!(radial_distance_order, "radialDistanceOrder");
pub(super) const PRIMITIVE_ORDER: Feature = feature!(primitive_order, "primitiveOrder");
pub(super) const PER_PIXEL_ORDER: Feature = feature!(per_pixel_order, "perPixelOrder");
pub(super) const RASTERIZATION_FLOAT16: Feature =
    feature!(rasterization_float16, "rasterizationFloat16");
pub(super) const OPACITY_COMPENSATION: Feature =
    feature!(opacity_compensation, "opacityCompensation");
pub(super) const UNSCENTED_PROJECTION: Feature =
    feature!(unscented_projection, "unscentedProjection");
pub(super) const GAUSSIAN_2D: Feature = feature!(gaussian_2d, "gaussian2D");
pub(super) const UNIFORM_BUFFER_CAMERA: Feature =
    feature!(uniform_buffer_camera, "uniformBufferCamera");
pub(super) const MERGED_DRAWS: Feature = feature!(merged_draws, "mergedDraws");
pub(super) const INSTANCING: Feature = feature!(gaussian_instancing, "gaussianInstancing");
pub(super) const DEPTH_STENCIL: Feature = feature!(gaussian_depth_stencil, "gaussianDepthStencil");
pub(super) const MULTISAMPLE: Feature = feature!(gaussian_multisample, "gaussianMultisample");
pub(super) const APPROXIMATION: Feature = feature!(gaussian_approximation, "gaussianApproximation");

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
