//! The Gaussian state by itself: the rules that a pipeline keeps when it is created, and again with the values of its
//! dynamic states when it draws.

use gaurast::vk::{
    GAUSSIAN_LOCATION_UNUSED_GAURAST as UNUSED, GaussianAntialiasingGAURAST as Antialiasing,
    GaussianCameraSourceGAURAST as CameraSource, GaussianGeometryGAURAST as Geometry,
    GaussianLinearizationGAURAST as Linearization, GaussianOrderGAURAST as Order,
    GaussianPrecisionGAURAST as Precision, GaussianProjectionModeGAURAST as Projection,
    PipelineGaussianStateCreateFlagsGAURAST as Flags, PipelineGaussianStateCreateInfoGAURAST,
};

use crate::facts::Facts;
use crate::report::Faults;
use crate::rules::dynamic::{is_antialiasing, is_order};

type State = PipelineGaussianStateCreateInfoGAURAST<'static>;

/// Reports whether the device projects.
pub(crate) fn is_fixed(state: &State) -> bool {
    state.projection_mode == Projection::FIXED_FUNCTION
}

/// Every enum is a value of its type, and the flags are known.
pub(crate) fn check_enums(state: &State, faults: &mut Faults) -> bool {
    let known = Flags::LOG_SCALE | Flags::LOGIT_OPACITY | Flags::SPHERICAL_HARMONICS_BUFFER;
    let (fixed, shader) = (Projection::FIXED_FUNCTION, Projection::VERTEX_SHADER);
    let is = |holds: bool, id: &'static str, raw: i32| (!holds).then_some((id, raw));
    let s = state;
    let wrong = [
        is(
            s.projection_mode == fixed || s.projection_mode == shader,
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-projectionMode-parameter",
            s.projection_mode.as_raw(),
        ),
        is(
            s.geometry == Geometry::GAUSSIAN_3D || s.geometry == Geometry::GAUSSIAN_2D,
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-geometry-parameter",
            s.geometry.as_raw(),
        ),
        is(
            s.linearization == Linearization::JACOBIAN || s.linearization == Linearization::UNSCENTED,
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-linearization-parameter",
            s.linearization.as_raw(),
        ),
        is(is_order(s.order), "VUID-VkPipelineGaussianStateCreateInfoGAURAST-order-parameter", s.order.as_raw()),
        is(
            s.precision == Precision::FLOAT32 || s.precision == Precision::FLOAT16,
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-precision-parameter",
            s.precision.as_raw(),
        ),
        is(
            is_antialiasing(s.antialiasing),
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-antialiasing-parameter",
            s.antialiasing.as_raw(),
        ),
        is(
            s.camera_source == CameraSource::COMMAND || s.camera_source == CameraSource::UNIFORM_BUFFER,
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-cameraSource-parameter",
            s.camera_source.as_raw(),
        ),
        is(
            known.contains(s.flags),
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-flags-parameter",
            s.flags.as_raw().cast_signed(),
        ),
    ];
    match wrong.into_iter().flatten().next() {
        None => true,
        Some((id, raw)) => {
            let name = id.split('-').nth(2).unwrap_or(id);
            faults.error(id, format!("{name} is {raw}, which is no value of its type"));
            false
        }
    }
}

/// Checks what dynamic states may change, in their combination with the rest.
pub(crate) fn check_values(
    state: &State,
    approximation: Option<[f32; 2]>,
    has_fragment: bool,
    facts: &Facts,
    faults: &mut Faults,
) {
    check_numbers(state, approximation, faults);
    check_combinations(state, has_fragment, faults);
    check_modes(state, approximation, facts, faults);
}

fn check_numbers(state: &State, approximation: Option<[f32; 2]>, faults: &mut Faults) {
    let s = state;
    faults.require(
        s.low_pass_variance.is_finite() && s.low_pass_variance >= 0.0,
        "VUID-VkPipelineGaussianStateCreateInfoGAURAST-lowPassVariance-90011",
        || format!("lowPassVariance is {}, but must be finite and not negative", s.low_pass_variance),
    );
    let floor_is_right = (0.0..=1.0).contains(&s.alpha_floor);
    faults.require(floor_is_right, "VUID-VkPipelineGaussianStateCreateInfoGAURAST-alphaFloor-90012", || {
        format!("alphaFloor is {}, but must be in [0, 1]", s.alpha_floor)
    });
    let ceiling_is_right =
        s.alpha_ceiling > 0.0 && s.alpha_ceiling <= 1.0 && (!floor_is_right || s.alpha_ceiling >= s.alpha_floor);
    faults.require(ceiling_is_right, "VUID-VkPipelineGaussianStateCreateInfoGAURAST-alphaCeiling-90013", || {
        format!(
            "alphaCeiling is {}, but must be in (0, 1] and at least alphaFloor ({})",
            s.alpha_ceiling, s.alpha_floor
        )
    });
    faults.require(
        (0.0..1.0).contains(&s.transmittance_floor),
        "VUID-VkPipelineGaussianStateCreateInfoGAURAST-transmittanceFloor-90014",
        || format!("transmittanceFloor is {}, but must be in [0, 1)", s.transmittance_floor),
    );
    let Some([error, budget]) = approximation else {
        return;
    };
    faults.require(
        (0.0..=1.0).contains(&error),
        "VUID-VkPipelineGaussianApproximationStateCreateInfoGAURAST-exponentialError-90051",
        || format!("exponentialError is {error}, but must be in [0, 1]"),
    );
    faults.require(
        (0.0..=1.0).contains(&budget),
        "VUID-VkPipelineGaussianApproximationStateCreateInfoGAURAST-contributionBudget-90052",
        || format!("contributionBudget is {budget}, but must be in [0, 1]"),
    );
}

fn check_combinations(state: &State, has_fragment: bool, faults: &mut Faults) {
    let s = state;
    let is_flat = s.geometry == Geometry::GAUSSIAN_2D;
    let is_per_pixel = s.order == Order::PER_PIXEL;
    let is_half = s.precision == Precision::FLOAT16;
    let fixed = is_fixed(s);
    faults.require(
        fixed || s.order != Order::RADIAL_DISTANCE || s.vertex_output_locations.depth_key != UNUSED,
        "VUID-VkPipelineGaussianStateCreateInfoGAURAST-depthKey-90021",
        || {
            "order is RADIAL_DISTANCE with vertex-shader projection, but depthKey is unused: a shader must write the \
             distance"
                .to_owned()
        },
    );
    faults.require(
        fixed || !is_per_pixel,
        "VUID-VkPipelineGaussianStateCreateInfoGAURAST-projectionMode-90022",
        || "order is PER_PIXEL with vertex-shader projection, but it needs fixed-function projection".to_owned(),
    );
    faults.require(
        !fixed || !is_flat || s.antialiasing == Antialiasing::DILATE,
        "VUID-VkPipelineGaussianStateCreateInfoGAURAST-geometry-90027",
        || "geometry is GAUSSIAN_2D, but antialiasing is not DILATE".to_owned(),
    );
    let has_matrix = s.attribute_locations.first_model_matrix != UNUSED;
    faults.require(
        !fixed || !has_matrix || !is_per_pixel && !is_flat,
        "VUID-VkPipelineGaussianStateCreateInfoGAURAST-firstModelMatrix-90028",
        || "firstModelMatrix is used, but order is PER_PIXEL or geometry is not GAUSSIAN_3D".to_owned(),
    );
    faults.require(
        !fixed || !is_flat || s.linearization == Linearization::JACOBIAN,
        "VUID-VkPipelineGaussianStateCreateInfoGAURAST-geometry-90029",
        || "geometry is GAUSSIAN_2D, but linearization is not JACOBIAN".to_owned(),
    );
    faults.require(
        !is_half || fixed && !is_flat && !is_per_pixel,
        "VUID-VkPipelineGaussianStateCreateInfoGAURAST-precision-90030",
        || {
            "precision is FLOAT16, but that needs GAUSSIAN_3D, an order other than PER_PIXEL, and \
             FIXED_FUNCTION"
                .to_owned()
        },
    );
    let inputs = &s.resolve_input_locations;
    let kept = [
        ("depth", inputs.depth),
        ("linearDepth", inputs.linear_depth),
        ("medianGaussian", inputs.median_gaussian),
        ("nearestGaussian", inputs.nearest_gaussian),
    ];
    let used = kept.iter().find(|(_, location)| *location != UNUSED);
    if let Some((name, _)) = used.filter(|_| has_fragment && (is_half || is_per_pixel)) {
        faults.error(
            "VUID-VkGaussianResolveInputLocationsGAURAST-depth-90031",
            format!(
                "the {name} of resolveInputLocations is used, but neither depths nor Gaussians are kept with FLOAT16 or \
                 PER_PIXEL"
            ),
        );
    }
}

/// The features of modes that are used.
fn check_modes(state: &State, approximation: Option<[f32; 2]>, facts: &Facts, faults: &mut Faults) {
    let (s, f) = (state, &facts.features);
    let fixed = is_fixed(s);
    let activation = Flags::LOG_SCALE | Flags::LOGIT_OPACITY;
    let uses_instancing =
        s.attribute_locations.first_model_matrix != UNUSED || s.attribute_locations.model_opacity != UNUSED;
    let approximates = approximation.is_some_and(|numbers| numbers.iter().any(|&n| n != 0.0));
    let modes = [
        (
            !fixed,
            f.vertex_shader_projection,
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-vertexShaderProjection-90033",
        ),
        (
            s.order == Order::RADIAL_DISTANCE,
            f.radial_distance_order,
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-radialDistanceOrder-90035",
        ),
        (
            s.order == Order::PRIMITIVE,
            f.primitive_order,
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-primitiveOrder-90036",
        ),
        (
            s.order == Order::PER_PIXEL,
            f.per_pixel_order,
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-perPixelOrder-90037",
        ),
        (
            s.precision == Precision::FLOAT16,
            f.rasterization_float16,
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-rasterizationFloat16-90038",
        ),
        (
            s.antialiasing == Antialiasing::OPACITY_COMPENSATED,
            f.opacity_compensation,
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-opacityCompensation-90039",
        ),
        (
            fixed && s.linearization == Linearization::UNSCENTED,
            f.unscented_projection,
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-unscentedProjection-90040",
        ),
        (
            fixed && s.geometry == Geometry::GAUSSIAN_2D,
            f.gaussian_2d,
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussian2D-90041",
        ),
        (
            fixed && s.camera_source == CameraSource::UNIFORM_BUFFER,
            f.uniform_buffer_camera,
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-uniformBufferCamera-90042",
        ),
        (
            fixed && uses_instancing,
            f.gaussian_instancing,
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianInstancing-90043",
        ),
        (
            fixed && !(s.flags & activation).is_empty(),
            f.attribute_activation,
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-attributeActivation-90046",
        ),
        (
            fixed && s.flags.contains(Flags::SPHERICAL_HARMONICS_BUFFER),
            f.spherical_harmonics_buffer,
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-sphericalHarmonicsBuffer-90047",
        ),
        (
            approximates,
            f.gaussian_approximation,
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianApproximation-90050",
        ),
    ];
    for (is_used, feature, id) in modes {
        faults.require(!is_used || feature != 0, id, || absent(id));
    }
}

/// The message of a feature that is not enabled, which the rule's id names.
pub(crate) fn absent(id: &str) -> String {
    let name = id.split('-').nth(2).unwrap_or(id);
    format!("the pipeline uses a mode whose feature, {name}, is not enabled")
}
