//! The rules of a Gaussian pipeline's state, each with its id, and the features that its modes require.

use super::values;
use crate::abi::error::Error;
use crate::enabled::Enabled;
use crate::physical_device::limits::MAX_SPHERICAL_HARMONICS_DEGREE;
use crate::pipeline::dynamic_state::{GaussianStates, is_of_gaussians, may_gaussians_have};
use crate::pipeline::parts::GraphicsState;
use crate::pipeline::state::reads_second_source;
use crate::registry::features::Features;
use ash::vk;
use gaurast::vk::{
    GAUSSIAN_LOCATION_UNUSED_GAURAST, GaussianAntialiasingGAURAST, GaussianAttributeLocationsGAURAST,
    GaussianCutOffGAURAST, GaussianGeometryGAURAST, GaussianLinearizationGAURAST, GaussianOrderGAURAST,
    GaussianPrecisionGAURAST, GaussianProjectionModeGAURAST, PipelineGaussianStateCreateFlagsGAURAST as Flags,
    PipelineGaussianStateCreateInfoGAURAST,
};
use simdevice::state::gaussian::{
    CameraModel, GaussianApproximation, GaussianCutOff, GaussianFootprint, GaussianOrder, GaussianState,
    UnscentedTransform,
};
use std::ops::Range;
use std::sync::Arc;

pub(super) const STRUCTURE: &str = "VkPipelineGaussianStateCreateInfoGAURAST";

/// A feature of the extension.
pub(super) struct Feature {
    is_enabled: fn(&Features) -> bool,
    name: &'static str,
    /// The id of the rule that requires it.
    vuid: &'static str,
}

pub(super) const TOPOLOGY: Feature = Feature {
    is_enabled: |features| features.gaussian_primitive_topology,
    name: "gaussianPrimitiveTopology",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianPrimitiveTopology-90032",
};
pub(super) const VERTEX_SHADER_PROJECTION: Feature = Feature {
    is_enabled: |features| features.vertex_shader_projection,
    name: "vertexShaderProjection",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-vertexShaderProjection-90033",
};
pub(super) const RESOLVE_FRAGMENT_SHADER: Feature = Feature {
    is_enabled: |features| features.resolve_fragment_shader,
    name: "resolveFragmentShader",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-resolveFragmentShader-90034",
};
pub(super) const RADIAL_DISTANCE_ORDER: Feature = Feature {
    is_enabled: |features| features.radial_distance_order,
    name: "radialDistanceOrder",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-radialDistanceOrder-90035",
};
pub(super) const PRIMITIVE_ORDER: Feature = Feature {
    is_enabled: |features| features.primitive_order,
    name: "primitiveOrder",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-primitiveOrder-90036",
};
pub(super) const PER_PIXEL_ORDER: Feature = Feature {
    is_enabled: |features| features.per_pixel_order,
    name: "perPixelOrder",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-perPixelOrder-90037",
};
pub(super) const RASTERIZATION_FLOAT16: Feature = Feature {
    is_enabled: |features| features.rasterization_float16,
    name: "rasterizationFloat16",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-rasterizationFloat16-90038",
};
pub(super) const OPACITY_COMPENSATION: Feature = Feature {
    is_enabled: |features| features.opacity_compensation,
    name: "opacityCompensation",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-opacityCompensation-90039",
};
pub(super) const UNSCENTED_PROJECTION: Feature = Feature {
    is_enabled: |features| features.unscented_projection,
    name: "unscentedProjection",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-unscentedProjection-90040",
};
pub(super) const GAUSSIAN_2D: Feature = Feature {
    is_enabled: |features| features.gaussian_2d,
    name: "gaussian2D",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussian2D-90041",
};
pub(super) const UNIFORM_BUFFER_CAMERA: Feature = Feature {
    is_enabled: |features| features.uniform_buffer_camera,
    name: "uniformBufferCamera",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-uniformBufferCamera-90042",
};
pub(super) const INSTANCING: Feature = Feature {
    is_enabled: |features| features.gaussian_instancing,
    name: "gaussianInstancing",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianInstancing-90043",
};
pub(super) const DEPTH_STENCIL: Feature = Feature {
    is_enabled: |features| features.gaussian_depth_stencil,
    name: "gaussianDepthStencil",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianDepthStencil-90044",
};
pub(super) const MULTISAMPLE: Feature = Feature {
    is_enabled: |features| features.gaussian_multisample,
    name: "gaussianMultisample",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianMultisample-90045",
};
pub(super) const APPROXIMATION: Feature = Feature {
    is_enabled: |features| features.gaussian_approximation,
    name: "gaussianApproximation",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianApproximation-90050",
};

pub(super) const MULTIVIEW: Feature = Feature {
    is_enabled: |features| features.gaussian_multiview,
    name: "gaussianMultiview",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianMultiview-90049",
};

pub(super) const HARMONICS_BUFFER: Feature = Feature {
    is_enabled: |features| features.spherical_harmonics_buffer,
    name: "sphericalHarmonicsBuffer",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-sphericalHarmonicsBuffer-90047",
};
pub(super) const ATTRIBUTE_ACTIVATION: Feature = Feature {
    is_enabled: |features| features.attribute_activation,
    name: "attributeActivation",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-attributeActivation-90046",
};
pub(super) const RESOLVE_INDICES: Feature = Feature {
    is_enabled: |features| features.resolve_gaussian_indices,
    name: "resolveGaussianIndices",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-resolveGaussianIndices-90073",
};
pub(super) const CUT_OFF: Feature = Feature {
    is_enabled: |features| features.gaussian_cut_off,
    name: "gaussianCutOff",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianCutOff-90074",
};
pub(super) const SURFEL_CUT_OFF: Feature = Feature {
    is_enabled: |features| features.gaussian_2d_cut_off,
    name: "gaussian2DCutOff",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussian2DCutOff-90102",
};
pub(super) const COMPENSATION_FLOOR: Feature = Feature {
    is_enabled: |features| features.opacity_compensation_floor,
    name: "opacityCompensationFloor",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-opacityCompensationFloor-90075",
};
pub(super) const UNSCENTED_PARAMETERS: Feature = Feature {
    is_enabled: |features| features.unscented_parameters,
    name: "unscentedParameters",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-unscentedParameters-90090",
};
pub(super) const DECODING: Feature = Feature {
    is_enabled: |features| features.attribute_decoding,
    name: "attributeDecoding",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-attributeDecoding-90095",
};
pub(super) const DYNAMIC_STATE: Feature = Feature {
    is_enabled: |features| features.gaussian_dynamic_state,
    name: "gaussianDynamicState",
    vuid: "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianDynamicState-90048",
};

/// Requires the feature of `what`. The device has all of the extension's features.
pub(super) fn require(enabled: &Enabled, feature: &Feature, what: &str) -> Result<(), Error> {
    enabled.require((feature.is_enabled)(enabled.features()), || not_enabled(feature, what))
}

fn not_enabled(feature: &Feature, what: &str) -> Error {
    let Feature { name, vuid, .. } = feature;
    Error::FeatureNotEnabled { vuid, message: format!("{STRUCTURE}: {what}, but the feature {name} is not enabled") }
}

pub(super) fn unknown(field: &str, value: &dyn std::fmt::Debug) -> Error {
    let vuid = match field {
        "flags" => "VUID-VkPipelineGaussianStateCreateInfoGAURAST-flags-parameter",
        "geometry" => "VUID-VkPipelineGaussianStateCreateInfoGAURAST-geometry-parameter",
        "linearization" => "VUID-VkPipelineGaussianStateCreateInfoGAURAST-linearization-parameter",
        "order" => "VUID-VkPipelineGaussianStateCreateInfoGAURAST-order-parameter",
        "precision" => "VUID-VkPipelineGaussianStateCreateInfoGAURAST-precision-parameter",
        "antialiasing" => "VUID-VkPipelineGaussianStateCreateInfoGAURAST-antialiasing-parameter",
        "cameraSource" => "VUID-VkPipelineGaussianStateCreateInfoGAURAST-cameraSource-parameter",
        _ => "VUID-VkPipelineGaussianStateCreateInfoGAURAST-projectionMode-parameter",
    };
    Error::usage(vuid, format!("{STRUCTURE}: {field} has the unknown value {value:?}"))
}

pub(super) fn has_fragment_stage(graphics: &GraphicsState) -> bool {
    let mut stages = graphics.stages();
    stages.any(|(stage, _)| *stage == vk::ShaderStageFlags::FRAGMENT)
}

/// Reports whether a vertex shader projects, so that the state of fixed-function projection is ignored.
pub(super) fn is_shaded(gaussian: &PipelineGaussianStateCreateInfoGAURAST) -> bool {
    gaussian.projection_mode == GaussianProjectionModeGAURAST::VERTEX_SHADER
}

/// The modes of a pipeline that can't all be combined.
#[derive(Clone, Copy, Debug)]
pub(super) struct Modes {
    order: GaussianOrder,
    is_compensated: bool,
    is_shaded: bool,
    is_flat: bool,
    is_half: bool,
    is_linearized: bool,
    /// True if there are model matrices.
    is_placed: bool,
    /// True if the vertex shader writes the sort key.
    has_key: bool,
    /// The fragment stage has depths or Gaussians for inputs.
    is_tracking: bool,
    /// The fragment stage has a camera for an input.
    reads_camera: bool,
    /// There is a cut-off.
    cut_off: GaussianCutOffGAURAST,
}

impl Modes {
    pub(super) fn new(graphics: &GraphicsState, gaussian: &PipelineGaussianStateCreateInfoGAURAST) -> Self {
        let is_used = |location: u32| location != GAUSSIAN_LOCATION_UNUSED_GAURAST;
        let (resolves, inputs) = (has_fragment_stage(graphics), gaussian.resolve_input_locations);
        Self {
            // An invalid value is refused where it is converted.
            order: values::order(gaussian.order).unwrap_or(GaussianOrder::ViewDepth),
            is_compensated: values::is_compensated(gaussian.antialiasing).unwrap_or(false),
            is_shaded: is_shaded(gaussian),
            is_flat: gaussian.geometry == GaussianGeometryGAURAST::GAUSSIAN_2D,
            is_half: gaussian.precision == GaussianPrecisionGAURAST::FLOAT16,
            is_linearized: gaussian.linearization != GaussianLinearizationGAURAST::JACOBIAN,
            is_placed: is_used(gaussian.attribute_locations.first_model_matrix),
            has_key: is_used(gaussian.vertex_output_locations.depth_key),
            is_tracking: resolves
                && [inputs.depth, inputs.linear_depth, inputs.median_gaussian, inputs.nearest_gaussian]
                    .into_iter()
                    .any(is_used),
            reads_camera: resolves && is_used(inputs.first_camera),
            cut_off: graphics
                .pre_rasterization
                .footprint
                .map_or(GaussianCutOffGAURAST::NONE, |footprint| footprint.cut_off),
        }
    }

    /// Refuses combinations of modes that have no meaning.
    pub(super) fn check(&self) -> Result<(), Error> {
        let per_pixel = self.order == GaussianOrder::PerPixel;
        let by_distance = self.order == GaussianOrder::RadialDistance;
        let (shaded, flat, half) = (self.is_shaded, self.is_flat, self.is_half);
        let rules = [
            (
                !shaded && self.is_placed && (per_pixel || flat),
                "VUID-VkPipelineGaussianStateCreateInfoGAURAST-firstModelMatrix-90028",
                "firstModelMatrix is used, but order is PER_PIXEL or geometry is GAUSSIAN_2D",
            ),
            (
                !shaded && flat && self.is_linearized,
                "VUID-VkPipelineGaussianStateCreateInfoGAURAST-geometry-90029",
                "linearization is not JACOBIAN, but geometry is GAUSSIAN_2D, which is not linearized",
            ),
            (
                flat && self.is_compensated,
                "VUID-VkPipelineGaussianStateCreateInfoGAURAST-geometry-90027",
                "antialiasing is OPACITY_COMPENSATED, but geometry is GAUSSIAN_2D, which is not dilated",
            ),
            (
                half && (flat || per_pixel || shaded),
                "VUID-VkPipelineGaussianStateCreateInfoGAURAST-precision-90030",
                "precision is FLOAT16, but geometry is GAUSSIAN_2D, order is PER_PIXEL or projectionMode is \
                 VERTEX_SHADER, which are for FLOAT32",
            ),
            (
                shaded && by_distance && !self.has_key,
                "VUID-VkPipelineGaussianStateCreateInfoGAURAST-depthKey-90021",
                "order is RADIAL_DISTANCE, but depthKey is unused",
            ),
            (
                shaded && per_pixel,
                "VUID-VkPipelineGaussianStateCreateInfoGAURAST-projectionMode-90022",
                "order is PER_PIXEL, but projectionMode is VERTEX_SHADER",
            ),
            (
                self.is_tracking && (half || per_pixel),
                "VUID-VkGaussianResolveInputLocationsGAURAST-depth-90031",
                "a fragment stage has depths or Gaussians for an input, but precision is FLOAT16 or order is PER_PIXEL, \
                 which keep none",
            ),
            (
                shaded && self.reads_camera,
                "VUID-VkGaussianResolveInputLocationsGAURAST-firstCamera-90072",
                "firstCamera is used, but projectionMode is VERTEX_SHADER, which has no camera",
            ),
            (
                self.cut_off != GaussianCutOffGAURAST::NONE
                    && (!shaded && flat && self.cut_off != GaussianCutOffGAURAST::TILE_RECTANGLE || half),
                "VUID-VkPipelineGaussianFootprintStateCreateInfoGAURAST-cutOff-90078",
                "there is a cut-off, but precision is FLOAT16, which has none, or geometry is GAUSSIAN_2D, which has \
                 TILE_RECTANGLE alone",
            ),
        ];
        match rules.iter().find(|(is_broken, ..)| *is_broken) {
            None => Ok(()),
            Some((_, id, what)) => Err(Error::usage(*id, format!("{STRUCTURE}: {what}"))),
        }
    }
}

/// The limits and enabled features for the values of dynamic states, and for cameras, when a draw executes.
#[derive(Debug)]
pub(crate) struct DynamicRules {
    modes: Modes,
    enabled: Arc<Enabled>,
    /// The greatest degree for which the pipeline has coefficients.
    max_degree: u32,
}

impl DynamicRules {
    pub(super) fn new(modes: Modes, enabled: &Arc<Enabled>, max_degree: u32) -> Self {
        Self { modes, enabled: Arc::clone(enabled), max_degree }
    }

    /// Requires the feature of a camera's model.
    ///
    /// # Errors
    /// An [`Error`] that names the feature that is not enabled.
    pub(crate) fn require_camera_model(&self, model: CameraModel) -> Result<(), Error> {
        let features = self.enabled.features();
        let (is_enabled, name) = match model {
            CameraModel::Pinhole => return Ok(()),
            CameraModel::Orthographic => (features.orthographic_camera, "orthographicCamera"),
            CameraModel::Fisheye => (features.fisheye_camera, "fisheyeCamera"),
            CameraModel::Equirectangular => (features.equirectangular_camera, "equirectangularCamera"),
        };
        self.enabled.require(is_enabled, || Error::FeatureNotEnabled {
            vuid: "VUID-VkGaussianCameraGAURAST-model-90079",
            message: format!("the camera's model is {model:?}, but the feature {name} is not enabled"),
        })
    }

    /// Requires the feature of cameras whose lens distorts.
    ///
    /// # Errors
    /// An [`Error`] that names the feature that is not enabled.
    pub(crate) fn require_distortion(&self) -> Result<(), Error> {
        self.enabled.require(self.enabled.features().gaussian_distortion, || Error::FeatureNotEnabled {
            vuid: "VUID-VkGaussianCameraDistortionGAURAST-gaussianDistortion-90084",
            message: "the camera's lens distorts, but the feature gaussianDistortion is not enabled".to_owned(),
        })
    }

    /// Refuses a state with dynamic values that a pipeline could not have.
    ///
    /// # Errors
    /// An [`Error`] that names the valid usage broken, or the feature that is not enabled.
    pub(crate) fn check(&self, state: &GaussianState) -> Result<(), Error> {
        let modes = Modes { order: state.order, is_compensated: state.opacity_compensated, ..self.modes };
        modes.check()?;
        require_modes(&self.enabled, state)?;
        ceiling_over_floor(state.alpha_floor, state.alpha_ceiling)?;
        if state.sh_degree > self.max_degree {
            return Err(Error::usage(
                "VUID-vkCmdDraw-sphericalHarmonicsDegree-90061",
                format!(
                    "sphericalHarmonicsDegree was set to {}, but the pipeline has coefficients of degree {}",
                    state.sh_degree, self.max_degree
                ),
            ));
        }
        Ok(())
    }
}

/// Requires the features of modes, among those that may be dynamic.
pub(super) fn require_modes(enabled: &Enabled, state: &GaussianState) -> Result<(), Error> {
    if state.opacity_compensated {
        let what = "antialiasing is OPACITY_COMPENSATED";
        require(enabled, &OPACITY_COMPENSATION, what)?;
    }
    match state.order {
        GaussianOrder::ViewDepth => {}
        GaussianOrder::RadialDistance => {
            require(enabled, &RADIAL_DISTANCE_ORDER, "order is RADIAL_DISTANCE")?;
        }
        GaussianOrder::Primitive => require(enabled, &PRIMITIVE_ORDER, "order is PRIMITIVE")?,
        GaussianOrder::PerPixel => require(enabled, &PER_PIXEL_ORDER, "order is PER_PIXEL")?,
    }
    if state.approximation != GaussianApproximation::default() {
        let what = "exponentialError or contributionBudget is not 0";
        require(enabled, &APPROXIMATION, what)?;
    }
    Ok(())
}

fn ceiling_over_floor(floor: f32, ceiling: f32) -> Result<(), Error> {
    if ceiling >= floor {
        return Ok(());
    }
    Err(Error::usage(
        "VUID-VkPipelineGaussianStateCreateInfoGAURAST-alphaCeiling-90013",
        format!("alphaCeiling is {ceiling}, but must be at least alphaFloor, which is {floor}"),
    ))
}

/// The create info with the members of dynamic states replaced by values that break no rule.
pub(super) fn without_dynamic<'a>(
    graphics: &GraphicsState,
    gaussian: &PipelineGaussianStateCreateInfoGAURAST<'a>,
) -> PipelineGaussianStateCreateInfoGAURAST<'a> {
    use vk::DynamicState as S;
    let mut own = *gaussian;
    if graphics.is_dynamic(S::GAUSSIAN_ORDER) {
        own.order = GaussianOrderGAURAST::VIEW_DEPTH;
    }
    if graphics.is_dynamic(S::GAUSSIAN_ANTIALIASING) {
        own.antialiasing = GaussianAntialiasingGAURAST::DILATE;
    }
    for (state, member, value) in [
        (S::GAUSSIAN_LOW_PASS_VARIANCE, &mut own.low_pass_variance, 0.0),
        (S::GAUSSIAN_ALPHA_FLOOR, &mut own.alpha_floor, 0.0),
        (S::GAUSSIAN_ALPHA_CEILING, &mut own.alpha_ceiling, 1.0),
        (S::GAUSSIAN_TRANSMITTANCE_FLOOR, &mut own.transmittance_floor, 0.0),
    ] {
        if graphics.is_dynamic(state) {
            *member = value;
        }
    }
    own
}

pub(super) fn stages(
    graphics: &GraphicsState,
    gaussian: &PipelineGaussianStateCreateInfoGAURAST,
    enabled: &Enabled,
) -> Result<(), Error> {
    match gaussian.projection_mode {
        GaussianProjectionModeGAURAST::FIXED_FUNCTION => {}
        GaussianProjectionModeGAURAST::VERTEX_SHADER => {
            let what = "projectionMode is VERTEX_SHADER";
            require(enabled, &VERTEX_SHADER_PROJECTION, what)?;
        }
        other => return Err(unknown("projectionMode", &other)),
    }
    if has_fragment_stage(graphics) {
        let inputs = &gaussian.resolve_input_locations;
        let indices = [inputs.median_gaussian, inputs.nearest_gaussian];
        if indices != [GAUSSIAN_LOCATION_UNUSED_GAURAST; 2] {
            let what = "medianGaussian or nearestGaussian is used";
            require(enabled, &RESOLVE_INDICES, what)?;
        }
        let what = "the pipeline has a fragment stage";
        require(enabled, &RESOLVE_FRAGMENT_SHADER, what)?;
    }
    let shaded = is_shaded(gaussian);
    let of = |wanted| graphics.stages().filter(move |(stage, _)| *stage == wanted);
    let known = vk::ShaderStageFlags::FRAGMENT
        | if shaded { vk::ShaderStageFlags::VERTEX } else { vk::ShaderStageFlags::empty() };
    let unwanted = graphics.stages().find(|(stage, _)| !known.contains(*stage));
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
            "VUID-VkGraphicsPipelineCreateInfo-projectionMode-90008",
            format!("projectionMode is {:?}, so the pipeline {wrong}", gaussian.projection_mode),
        ));
    }
    if graphics.vertex_input.primitive_restart {
        return Err(Error::usage(
            "VUID-VkPipelineInputAssemblyStateCreateInfo-topology-90009",
            "primitiveRestartEnable is VK_TRUE, but the Gaussian list has no primitive restart",
        ));
    }
    Ok(())
}

/// Checks the state that only fixed-function projection uses.
fn projection(gaussian: &PipelineGaussianStateCreateInfoGAURAST, enabled: &Enabled) -> Result<(), Error> {
    match gaussian.geometry {
        GaussianGeometryGAURAST::GAUSSIAN_3D => {}
        GaussianGeometryGAURAST::GAUSSIAN_2D => {
            require(enabled, &GAUSSIAN_2D, "geometry is GAUSSIAN_2D")?;
        }
        other => return Err(unknown("geometry", &other)),
    }
    match gaussian.linearization {
        GaussianLinearizationGAURAST::JACOBIAN => {}
        GaussianLinearizationGAURAST::UNSCENTED => {
            require(enabled, &UNSCENTED_PROJECTION, "linearization is UNSCENTED")?;
        }
        other => return Err(unknown("linearization", &other)),
    }
    Ok(())
}

pub(super) fn modes(gaussian: &PipelineGaussianStateCreateInfoGAURAST, enabled: &Enabled) -> Result<(), Error> {
    if !is_shaded(gaussian) {
        projection(gaussian, enabled)?;
    }
    match gaussian.precision {
        GaussianPrecisionGAURAST::FLOAT32 => {}
        GaussianPrecisionGAURAST::FLOAT16 => {
            require(enabled, &RASTERIZATION_FLOAT16, "precision is FLOAT16")?;
        }
        other => return Err(unknown("precision", &other)),
    }
    let activations = Flags::LOG_SCALE | Flags::LOGIT_OPACITY;
    if !(activations | Flags::SPHERICAL_HARMONICS_BUFFER).contains(gaussian.flags) {
        return Err(unknown("flags", &gaussian.flags));
    }
    if gaussian.flags.intersects(activations) && !is_shaded(gaussian) {
        let what = "flags has LOG_SCALE or LOGIT_OPACITY";
        require(enabled, &ATTRIBUTE_ACTIVATION, what)?;
    }
    Ok(())
}

/// Refuses attributes that share a location. A location that was left zero is location 0.
pub(super) fn distinct_locations(
    locations: &GaussianAttributeLocationsGAURAST,
    coefficients: u32,
) -> Result<(), Error> {
    let members = [
        ("position", locations.position, 1),
        ("scale", locations.scale, 1),
        ("rotation", locations.rotation, 1),
        ("opacity", locations.opacity, 1),
        ("firstSphericalHarmonics", locations.first_spherical_harmonics, coefficients),
        ("firstModelMatrix", locations.first_model_matrix, 3),
        ("modelOpacity", locations.model_opacity, 1),
    ];
    let mut used: Vec<(&str, Range<u32>)> = Vec::new();
    for (name, first, count) in members {
        if first == GAUSSIAN_LOCATION_UNUSED_GAURAST || count == 0 {
            continue;
        }
        let own = first..first.saturating_add(count);
        let shared = |(_, other): &&(&str, Range<u32>)| own.start < other.end && other.start < own.end;
        if let Some((earlier, _)) = used.iter().find(shared) {
            return Err(Error::usage(
                "VUID-VkGaussianAttributeLocationsGAURAST-None-90019",
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

/// Refuses numbers outside their ranges.
pub(super) fn numbers(gaussian: &PipelineGaussianStateCreateInfoGAURAST) -> Result<(), Error> {
    let g = gaussian;
    let degree = g.spherical_harmonics_degree;
    if !is_shaded(g) && degree > MAX_SPHERICAL_HARMONICS_DEGREE {
        return Err(Error::usage(
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-sphericalHarmonicsDegree-90010",
            format!(
                "{STRUCTURE}: sphericalHarmonicsDegree is {degree}, but must be at most \
                 maxSphericalHarmonicsDegree ({MAX_SPHERICAL_HARMONICS_DEGREE})"
            ),
        ));
    }
    values::LOW_PASS_VARIANCE
        .check(g.low_pass_variance, "VUID-VkPipelineGaussianStateCreateInfoGAURAST-lowPassVariance-90011")?;
    values::ALPHA_FLOOR.check(g.alpha_floor, "VUID-VkPipelineGaussianStateCreateInfoGAURAST-alphaFloor-90012")?;
    values::ALPHA_CEILING.check(g.alpha_ceiling, "VUID-VkPipelineGaussianStateCreateInfoGAURAST-alphaCeiling-90013")?;
    ceiling_over_floor(g.alpha_floor, g.alpha_ceiling)?;
    values::TRANSMITTANCE_FLOOR
        .check(g.transmittance_floor, "VUID-VkPipelineGaussianStateCreateInfoGAURAST-transmittanceFloor-90014")
}

/// Refuses fixed-function state that a Gaussian pipeline doesn't support.
pub(super) fn fixed_state(graphics: &GraphicsState, enabled: &Enabled) -> Result<(), Error> {
    use vk::DynamicState as S;
    let depth_stencil = graphics.depth_stencil().copied().unwrap_or_default();
    let tests = [
        (depth_stencil.depth_test_enable, S::DEPTH_TEST_ENABLE),
        (depth_stencil.depth_bounds_test_enable, S::DEPTH_BOUNDS_TEST_ENABLE),
        (depth_stencil.stencil_test_enable, S::STENCIL_TEST_ENABLE),
    ];
    if tests.iter().any(|&(enable, state)| enable != vk::FALSE || graphics.is_dynamic(state)) {
        require(enabled, &DEPTH_STENCIL, "the pipeline has a depth, depth bounds or stencil test")?;
    }
    let multisample = &graphics.fragment_output.multisample;
    let samples = multisample.rasterization_samples;
    if samples != vk::SampleCountFlags::TYPE_1 && !samples.is_empty() {
        require(enabled, &MULTISAMPLE, "the pipeline has several samples per pixel")?;
    }
    if graphics.pre_rasterization.rasterization.rasterizer_discard_enable != vk::FALSE {
        return Err(Error::usage(
            "VUID-VkGraphicsPipelineCreateInfo-rasterizerDiscardEnable-90080",
            "rasterizerDiscardEnable is VK_TRUE, but must be VK_FALSE with Gaussians",
        ));
    }
    if graphics.dynamic.iter().copied().any(is_of_gaussians) {
        let what = "a dynamic state of Gaussians is used";
        require(enabled, &DYNAMIC_STATE, what)?;
    }
    let shades = has_fragment_stage(graphics);
    if let Some(state) = graphics.dynamic.iter().find(|state| !may_gaussians_have(**state)) {
        return Err(Error::usage(
            "VUID-VkGraphicsPipelineCreateInfo-pDynamicStates-90082",
            format!("{state:?} must not be dynamic in a Gaussian pipeline"),
        ));
    }
    if !shades && graphics.fragment_output.blend.iter().any(reads_second_source) {
        return Err(Error::FeatureNotPresent(
            "a second source of blending (feature dualSrcBlend) with Gaussians and no fragment stage".into(),
        ));
    }
    if graphics.pre_rasterization.viewport_count > 1 {
        return Err(Error::usage(
            "VUID-VkGraphicsPipelineCreateInfo-viewportCount-90081",
            "viewportCount is greater than 1, but Gaussians go to one viewport",
        ));
    }
    Ok(())
}

/// Validates and converts the chain's structure of footprints, if it has one.
pub(super) fn footprint(
    graphics: &GraphicsState,
    gaussian: &PipelineGaussianStateCreateInfoGAURAST<'_>,
    enabled: &Enabled,
) -> Result<GaussianFootprint, Error> {
    let Some(given) = graphics.pre_rasterization.footprint else {
        return Ok(GaussianFootprint::default());
    };
    let cut_off = values::cut_off(given.cut_off).ok_or_else(|| {
        Error::usage(
            "VUID-VkPipelineGaussianFootprintStateCreateInfoGAURAST-cutOff-parameter",
            format!("cutOff has the unknown value {:?}", given.cut_off),
        )
    })?;
    if cut_off != GaussianCutOff::None {
        require(enabled, &CUT_OFF, "cutOff is not NONE")?;
        if !is_shaded(gaussian) && gaussian.geometry == GaussianGeometryGAURAST::GAUSSIAN_2D {
            require(enabled, &SURFEL_CUT_OFF, "cutOff is not NONE and geometry is GAUSSIAN_2D")?;
        }
        values::CUT_OFF_DEVIATIONS.check(
            given.cut_off_deviations,
            "VUID-VkPipelineGaussianFootprintStateCreateInfoGAURAST-cutOffDeviations-90076",
        )?;
    }
    values::COMPENSATION_FLOOR.check(
        given.compensation_floor,
        "VUID-VkPipelineGaussianFootprintStateCreateInfoGAURAST-compensationFloor-90077",
    )?;
    if given.compensation_floor != 0.0 {
        require(enabled, &COMPENSATION_FLOOR, "compensationFloor is not 0")?;
    }
    Ok(GaussianFootprint {
        cut_off,
        deviations: given.cut_off_deviations,
        compensation_floor: given.compensation_floor,
    })
}

/// Validates and converts the chain's structure of sigma points, if it has one. It is ignored where no Gaussian is projected
/// by the unscented transform.
pub(super) fn unscented(
    graphics: &GraphicsState,
    gaussian: &PipelineGaussianStateCreateInfoGAURAST,
    enabled: &Enabled,
) -> Result<UnscentedTransform, Error> {
    let is_used = gaussian.linearization == GaussianLinearizationGAURAST::UNSCENTED && !is_shaded(gaussian);
    let Some(given) = graphics.pre_rasterization.unscented.filter(|_| is_used) else {
        return Ok(UnscentedTransform::default());
    };
    values::ALPHA.check(given.alpha, "VUID-VkPipelineGaussianUnscentedStateCreateInfoGAURAST-alpha-90091")?;
    values::BETA.check(given.beta, "VUID-VkPipelineGaussianUnscentedStateCreateInfoGAURAST-beta-90092")?;
    values::KAPPA.check(given.kappa, "VUID-VkPipelineGaussianUnscentedStateCreateInfoGAURAST-kappa-90093")?;
    values::PICTURE_MARGIN
        .check(given.picture_margin, "VUID-VkPipelineGaussianUnscentedStateCreateInfoGAURAST-pictureMargin-90094")?;
    let transform = UnscentedTransform {
        alpha: given.alpha,
        beta: given.beta,
        kappa: given.kappa,
        picture_margin: given.picture_margin,
        needs_all: given.all_sigma_points != vk::FALSE,
    };
    if transform != UnscentedTransform::default() {
        require(enabled, &UNSCENTED_PARAMETERS, "sigma points are not the default's")?;
    }
    Ok(transform)
}

/// Validates and converts the chain's structure of approximations, if it has one, as far as it is not dynamic.
pub(super) fn approximation(graphics: &GraphicsState) -> Result<GaussianApproximation, Error> {
    use vk::DynamicState as S;
    let given = graphics.pre_rasterization.approximation.unwrap_or_default();
    let mut own = GaussianApproximation::default();
    if !graphics.is_dynamic(S::GAUSSIAN_EXPONENTIAL_ERROR) {
        let vuid = "VUID-VkPipelineGaussianApproximationStateCreateInfoGAURAST-exponentialError-90051";
        values::EXPONENTIAL_ERROR.check(given.exponential_error, vuid)?;
        own.exponential_error = given.exponential_error;
    }
    if !graphics.is_dynamic(S::GAUSSIAN_CONTRIBUTION_BUDGET) {
        let vuid = "VUID-VkPipelineGaussianApproximationStateCreateInfoGAURAST-contributionBudget-90052";
        values::CONTRIBUTION_BUDGET.check(given.contribution_budget, vuid)?;
        own.contribution_budget = given.contribution_budget;
    }
    Ok(own)
}
