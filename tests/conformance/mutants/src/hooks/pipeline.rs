//! Graphics pipelines.

use ash::vk;
use gaurast::vk::{
    DYNAMIC_STATE_GAUSSIAN_ALPHA_CEILING_GAURAST, DYNAMIC_STATE_GAUSSIAN_ALPHA_FLOOR_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_ANTIALIASING_GAURAST, DYNAMIC_STATE_GAUSSIAN_CONTRIBUTION_BUDGET_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_EXPONENTIAL_ERROR_GAURAST, DYNAMIC_STATE_GAUSSIAN_LOW_PASS_VARIANCE_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_ORDER_GAURAST, DYNAMIC_STATE_GAUSSIAN_SPHERICAL_HARMONICS_DEGREE_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_TRANSMITTANCE_FLOOR_GAURAST, GAUSSIAN_LOCATION_UNUSED_GAURAST,
    GaussianAntialiasingGAURAST as Antialiasing, GaussianCutOffGAURAST as CutOff, GaussianGeometryGAURAST as Geometry,
    GaussianHarmonicsDecodingGAURAST as HarmonicsDecoding, GaussianLinearizationGAURAST as Linearization,
    GaussianOrderGAURAST as Order, GaussianPrecisionGAURAST as Precision,
    GaussianProjectionModeGAURAST as ProjectionMode, PipelineGaussianStateCreateFlagsGAURAST as Flags,
    PipelineGaussianStateCreateInfoGAURAST as State, PipelineGaussianUnscentedStateCreateInfoGAURAST as Unscented,
};

use crate::mutant::Mutant;
use crate::next::next;
use crate::request::Request;
use crate::table::*;
use gaurast_layer_interface::slice;

pub(super) unsafe extern "system" fn create_graphics_pipelines(
    device: vk::Device,
    cache: vk::PipelineCache,
    count: u32,
    infos: *const vk::GraphicsPipelineCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    pipelines: *mut vk::Pipeline,
) -> vk::Result {
    // SAFETY: see the crate; the copies outlive the call.
    unsafe {
        let given = slice(infos, count);
        let mut requests: Vec<Request> = given.iter().map(|info| Request::of(info)).collect();
        requests.iter_mut().filter(|request| request.is_gaussian()).for_each(change);
        // The parts of a pipeline that is linked from libraries may be of Gaussians or not.
        let joined: Vec<_> = requests.iter_mut().map(Request::join).collect();
        (next().create_graphics_pipelines)(device, cache, count, joined.as_ptr(), allocator, pipelines)
    }
}

/// Makes the active mutant's change to a pipeline that draws Gaussians.
fn change(request: &mut Request) {
    if let Some(mut state) = request.gaussian {
        change_state(request, &mut state);
        request.gaussian = Some(state);
    }
    change_approximations(request);
    change_sigma_points(request);
    change_decodings(request);
    change_vertex_input(request);
    change_dynamic_states(request);
    change_tests(request);
    change_output(request);
}

fn change_state(request: &Request, state: &mut State<'_>) {
    let default = State::default();
    let is_fixed_function = state.projection_mode == ProjectionMode::FIXED_FUNCTION;
    LOW_PASS_VARIANCE.replaces(&mut state.low_pass_variance, default.low_pass_variance);
    let ceiling = state.alpha_ceiling;
    ALPHA_FLOOR.replaces(&mut state.alpha_floor, default.alpha_floor.min(ceiling));
    ALPHA_CEILING.replaces(&mut state.alpha_ceiling, default.alpha_ceiling);
    TRANSMITTANCE_FLOOR.replaces(&mut state.transmittance_floor, default.transmittance_floor);
    ANTIALIASING.replaces(&mut state.antialiasing, Antialiasing::DILATE);
    for (mutant, order) in [
        (&RADIAL_ORDER, Order::RADIAL_DISTANCE),
        (&PRIMITIVE_ORDER, Order::PRIMITIVE),
        (&PER_PIXEL_ORDER, Order::PER_PIXEL),
    ] {
        if state.order == order {
            mutant.replaces(&mut state.order, Order::VIEW_DEPTH);
        }
    }
    GEOMETRY.replaces(&mut state.geometry, Geometry::GAUSSIAN_3D);
    LINEARIZATION.replaces(&mut state.linearization, Linearization::JACOBIAN);
    DEGREE.changes(&mut state.spherical_harmonics_degree, |degree| degree.saturating_sub(1));
    PRECISION.replaces(&mut state.precision, Precision::FLOAT32);
    LOG_SCALE.changes(&mut state.flags, |flags| without(flags, Flags::LOG_SCALE));
    LOGIT_OPACITY.changes(&mut state.flags, |flags| without(flags, Flags::LOGIT_OPACITY));
    if state.flags.contains(Flags::LOG_SCALE) {
        BOTH_ACTIVATIONS.changes(&mut state.flags, |flags| without(flags, Flags::LOGIT_OPACITY));
    }
    VIEWS_CAMERA_COUNT.replaces(&mut state.camera_count, 1);
    let locations = &mut state.attribute_locations;
    if is_fixed_function {
        MODEL_MATRIX.replaces(&mut locations.first_model_matrix, GAUSSIAN_LOCATION_UNUSED_GAURAST);
        MODEL_OPACITY.replaces(&mut locations.model_opacity, GAUSSIAN_LOCATION_UNUSED_GAURAST);
        let ordered = [0, 1, 2, 3];
        let named = [locations.position, locations.scale, locations.rotation, locations.opacity];
        if LOCATION_ORDER.strikes(named != ordered) {
            [locations.position, locations.scale, locations.rotation, locations.opacity] = ordered;
        }
    } else {
        let outputs = &mut state.vertex_output_locations;
        PROJECTED_DEPTH_KEY.replaces(&mut outputs.depth_key, GAUSSIAN_LOCATION_UNUSED_GAURAST);
        if PROJECTED_COLOR.strikes(true) {
            std::mem::swap(&mut outputs.color, &mut outputs.covariance);
        }
        PROJECTED_LOW_PASS.replaces(&mut state.low_pass_variance, 0.0);
    }
    if request.has_fragment_stage() {
        let inputs = &mut state.resolve_input_locations;
        if RESOLVE_DEPTH.strikes(inputs.depth != inputs.linear_depth) {
            std::mem::swap(&mut inputs.depth, &mut inputs.linear_depth);
        }
        if RESOLVE_GAUSSIANS.strikes(inputs.median_gaussian != inputs.nearest_gaussian) {
            std::mem::swap(&mut inputs.median_gaussian, &mut inputs.nearest_gaussian);
        }
    }
    if request.parts.is_some() {
        let own = (state.low_pass_variance, state.alpha_ceiling);
        if LIBRARY_STATE.strikes(own != (default.low_pass_variance, default.alpha_ceiling)) {
            (state.low_pass_variance, state.alpha_ceiling) = (default.low_pass_variance, default.alpha_ceiling);
        }
    }
}

fn change_decodings(request: &mut Request) {
    if let Some(decoding) = &mut request.decoding {
        DECODING_SIGNED_LOG.replaces(&mut decoding.signed_log_position, vk::FALSE);
        DECODING_BASE_COLOR.replaces(&mut decoding.base_color, vk::FALSE);
        if decoding.spherical_harmonics == HarmonicsDecoding::PALETTE {
            DECODING_PALETTE.replaces(&mut decoding.spherical_harmonics, HarmonicsDecoding::CODEBOOK);
        }
    }
}

fn without(flags: Flags, left_out: Flags) -> Flags {
    Flags::from_raw(flags.as_raw() & !left_out.as_raw())
}

fn change_approximations(request: &mut Request) {
    if let Some(approximation) = &mut request.approximation {
        EXPONENTIAL_ERROR.changes(&mut approximation.exponential_error, |granted| granted.max(0.01));
        if approximation.contribution_budget > 0.0 {
            CONTRIBUTION_BUDGET.replaces(&mut approximation.contribution_budget, 0.1);
        }
    }
    let is_library = request.parts.is_some();
    if let Some(footprint) = &mut request.footprint {
        CUT_OFF.replaces(&mut footprint.cut_off, CutOff::NONE);
        if footprint.cut_off == CutOff::TILE_RECTANGLE {
            CUT_OFF_RECTANGLE.replaces(&mut footprint.cut_off, CutOff::TILE_SQUARE);
        }
        if footprint.cut_off == CutOff::TILE_RECTANGLE_COMPENSATED {
            CUT_OFF_COMPENSATED.replaces(&mut footprint.cut_off, CutOff::TILE_RECTANGLE);
        }
        if footprint.cut_off != CutOff::NONE {
            CUT_OFF_DEVIATIONS.replaces(&mut footprint.cut_off_deviations, 3.0);
        }
        COMPENSATION_FLOOR.replaces(&mut footprint.compensation_floor, 0.0);
        if LIBRARY_FOOTPRINT.strikes(is_library) {
            request.footprint = None;
        }
    }
}

fn change_sigma_points(request: &mut Request) {
    let default = Unscented::default();
    let Some(points) = &mut request.unscented else {
        return;
    };
    SIGMA_ALPHA.replaces(&mut points.alpha, default.alpha);
    SIGMA_BETA.replaces(&mut points.beta, default.beta);
    SIGMA_KAPPA.replaces(&mut points.kappa, default.kappa);
    SIGMA_MARGIN.replaces(&mut points.picture_margin, default.picture_margin);
    SIGMA_ALL.replaces(&mut points.all_sigma_points, default.all_sigma_points);
}

/// The bytes of a vertex format; 0 of one that the mutants leave alone.
fn bytes(format: vk::Format) -> u32 {
    use vk::Format as F;
    match format {
        F::R32_SFLOAT | F::R8G8B8A8_UNORM | F::R8G8B8A8_SNORM | F::A2B10G10R10_UNORM_PACK32 => 4,
        F::R32G32B32_SFLOAT => 12,
        F::R32G32B32A32_SFLOAT => 16,
        F::R16G16B16A16_SFLOAT | F::R16G16B16A16_UNORM | F::R16G16B16A16_SNORM => 8,
        F::R16_SFLOAT | F::R16_UNORM | F::R16_SNORM => 2,
        F::R8_UNORM | F::R8_SNORM => 1,
        _ => 0,
    }
}

/// The format that a mutant takes for another one.
fn mistaken(format: vk::Format) -> Option<(&'static Mutant, vk::Format)> {
    use vk::Format as F;
    Some(match format {
        F::R8_UNORM => (&UNORM8_IS_SNORM8, F::R8_SNORM),
        F::R8G8B8A8_UNORM => (&UNORM8_IS_SNORM8, F::R8G8B8A8_SNORM),
        F::R8_SNORM => (&SNORM8_IS_UNORM8, F::R8_UNORM),
        F::R8G8B8A8_SNORM => (&SNORM8_IS_UNORM8, F::R8G8B8A8_UNORM),
        F::R16_UNORM => (&UNORM16_IS_SNORM16, F::R16_SNORM),
        F::R16G16B16A16_UNORM => (&UNORM16_IS_SNORM16, F::R16G16B16A16_SNORM),
        F::R16_SNORM => (&SNORM16_IS_UNORM16, F::R16_UNORM),
        F::R16G16B16A16_SNORM => (&SNORM16_IS_UNORM16, F::R16G16B16A16_UNORM),
        F::R16_SFLOAT => (&FLOAT16_IS_UNORM16, F::R16_UNORM),
        F::R16G16B16A16_SFLOAT => (&FLOAT16_IS_UNORM16, F::R16G16B16A16_UNORM),
        F::B8G8R8A8_UNORM => (&BGRA8_IS_RGBA8, F::R8G8B8A8_UNORM),
        F::A2B10G10R10_UNORM_PACK32 => (&PACKED_10_IS_SNORM, F::A2B10G10R10_SNORM_PACK32),
        F::R8G8B8A8_USCALED => (&SCALED_IS_NORMALISED, F::R8G8B8A8_UNORM),
        F::R8G8B8A8_SSCALED => (&SCALED_IS_NORMALISED, F::R8G8B8A8_SNORM),
        _ => return None,
    })
}

fn change_vertex_input(request: &mut Request) {
    for attribute in &mut request.attributes {
        if let Some((mutant, format)) = mistaken(attribute.format) {
            mutant.replaces(&mut attribute.format, format);
        }
        ATTRIBUTE_OFFSET.replaces(&mut attribute.offset, 0);
    }
    let Some(state) = request.gaussian else {
        return;
    };
    let locations = state.attribute_locations;
    let given = request.attributes.clone();
    let place = |location| given.iter().find(|attribute| attribute.location == location).copied();
    if let (Some(position), Some(scale)) = (place(locations.position), place(locations.scale)) {
        let read = (position.binding, position.offset);
        if LOCATION_SCALE.strikes((scale.binding, scale.offset) != read) {
            let scales = request.attributes.iter_mut().filter(|one| one.location == locations.scale);
            scales.for_each(|scale| (scale.binding, scale.offset) = read);
        }
    }
    let fours = given.iter().filter(|attribute| bytes(attribute.format) == 16);
    if let (Some(last), Some(rotation)) = (fours.max_by_key(|one| one.location).copied(), place(locations.rotation)) {
        let read = (last.binding, last.offset);
        if LOCATION_ROTATION.strikes((rotation.binding, rotation.offset) != read) {
            let rotations = request.attributes.iter_mut().filter(|one| one.location == locations.rotation);
            rotations.for_each(|rotation| (rotation.binding, rotation.offset) = read);
        }
    }
    let of_opacity = place(locations.opacity).map(|attribute| attribute.binding);
    for binding in &mut request.bindings {
        let own = request.attributes.iter().filter(|attribute| attribute.binding == binding.binding);
        let packed = own.map(|attribute| attribute.offset + bytes(attribute.format)).max();
        STRIDE.changes(&mut binding.stride, |stride| packed.filter(|&packed| packed > 0).unwrap_or(stride));
        RATE_VERTEX.replaces(&mut binding.input_rate, vk::VertexInputRate::VERTEX);
        if of_opacity == Some(binding.binding) {
            RATE_INSTANCE.replaces(&mut binding.input_rate, vk::VertexInputRate::INSTANCE);
        }
    }
}

/// The mutants whose dynamic states are the pipeline's.
static STATIC: [(&Mutant, vk::DynamicState); 20] = [
    (&DYNAMIC_ORDER, DYNAMIC_STATE_GAUSSIAN_ORDER_GAURAST),
    (&DYNAMIC_ANTIALIASING, DYNAMIC_STATE_GAUSSIAN_ANTIALIASING_GAURAST),
    (&DYNAMIC_LOW_PASS_VARIANCE, DYNAMIC_STATE_GAUSSIAN_LOW_PASS_VARIANCE_GAURAST),
    (&DYNAMIC_ALPHA_FLOOR, DYNAMIC_STATE_GAUSSIAN_ALPHA_FLOOR_GAURAST),
    (&DYNAMIC_ALPHA_CEILING, DYNAMIC_STATE_GAUSSIAN_ALPHA_CEILING_GAURAST),
    (&DYNAMIC_TRANSMITTANCE_FLOOR, DYNAMIC_STATE_GAUSSIAN_TRANSMITTANCE_FLOOR_GAURAST),
    (&DYNAMIC_DEGREE, DYNAMIC_STATE_GAUSSIAN_SPHERICAL_HARMONICS_DEGREE_GAURAST),
    (&DYNAMIC_EXPONENTIAL_ERROR, DYNAMIC_STATE_GAUSSIAN_EXPONENTIAL_ERROR_GAURAST),
    (&DYNAMIC_CONTRIBUTION_BUDGET, DYNAMIC_STATE_GAUSSIAN_CONTRIBUTION_BUDGET_GAURAST),
    (&DYNAMIC_BLEND_CONSTANTS, vk::DynamicState::BLEND_CONSTANTS),
    (&DYNAMIC_DEPTH_TEST_ENABLE, vk::DynamicState::DEPTH_TEST_ENABLE),
    (&DYNAMIC_DEPTH_WRITE_ENABLE, vk::DynamicState::DEPTH_WRITE_ENABLE),
    (&DYNAMIC_DEPTH_COMPARE_OP, vk::DynamicState::DEPTH_COMPARE_OP),
    (&DYNAMIC_DEPTH_BOUNDS_ENABLE, vk::DynamicState::DEPTH_BOUNDS_TEST_ENABLE),
    (&DYNAMIC_DEPTH_BOUNDS, vk::DynamicState::DEPTH_BOUNDS),
    (&DYNAMIC_STENCIL_ENABLE, vk::DynamicState::STENCIL_TEST_ENABLE),
    (&DYNAMIC_STENCIL_OP, vk::DynamicState::STENCIL_OP),
    (&DYNAMIC_STENCIL_COMPARE_MASK, vk::DynamicState::STENCIL_COMPARE_MASK),
    (&DYNAMIC_STENCIL_WRITE_MASK, vk::DynamicState::STENCIL_WRITE_MASK),
    (&DYNAMIC_STENCIL_REFERENCE, vk::DynamicState::STENCIL_REFERENCE),
];

fn change_dynamic_states(request: &mut Request) {
    for (mutant, state) in STATIC {
        if mutant.strikes(request.is_dynamic(state)) {
            request.dynamic_states.retain(|other| *other != state);
        }
    }
}

fn change_tests(request: &mut Request) {
    let Some(tests) = &mut request.depth_stencil else {
        return;
    };
    if tests.depth_test_enable != vk::FALSE {
        DEPTH_COMPARE.replaces(&mut tests.depth_compare_op, vk::CompareOp::LESS);
        DEPTH_WRITE.replaces(&mut tests.depth_write_enable, vk::FALSE);
    }
    DEPTH_BOUNDS.replaces(&mut tests.depth_bounds_test_enable, vk::FALSE);
    if tests.stencil_test_enable == vk::FALSE {
        return;
    }
    let front = &mut tests.front;
    STENCIL_PASS_OP.replaces(&mut front.pass_op, vk::StencilOp::KEEP);
    STENCIL_FAIL_OP.replaces(&mut front.fail_op, vk::StencilOp::KEEP);
    STENCIL_DEPTH_FAIL_OP.replaces(&mut front.depth_fail_op, vk::StencilOp::KEEP);
    STENCIL_COMPARE_OP.replaces(&mut front.compare_op, vk::CompareOp::ALWAYS);
    STENCIL_COMPARE_MASK.replaces(&mut front.compare_mask, 0xff);
    STENCIL_WRITE_MASK.replaces(&mut front.write_mask, 0xff);
    STENCIL_REFERENCE.replaces(&mut front.reference, 0);
    if STENCIL_BACK.strikes(true) {
        tests.front = tests.back;
    }
}

fn change_output(request: &mut Request) {
    if SAMPLE_MASK.strikes(request.sample_mask.is_some_and(|mask| mask != u32::MAX)) {
        request.sample_mask = None;
    }
    let has_fragment_stage = request.has_fragment_stage();
    if request.gaussian.is_some() {
        for stage in &mut request.stages {
            let is_specialized = !stage.p_specialization_info.is_null();
            if stage.stage == vk::ShaderStageFlags::FRAGMENT && RESOLVE_CONSTANTS.strikes(is_specialized) {
                stage.p_specialization_info = std::ptr::null();
            }
        }
    }
    if let Some(state) = &mut request.color_blend {
        BLEND_CONSTANTS.replaces(&mut state.blend_constants, [0.0; 4]);
    }
    let Some(first) = request.blends.first().copied() else {
        return;
    };
    let is_library = request.parts.is_some();
    for (index, blend) in request.blends.iter_mut().enumerate() {
        if BLEND_OF_FIRST.strikes(index > 0 && has_fragment_stage) {
            let color_write_mask = blend.color_write_mask;
            *blend = vk::PipelineColorBlendAttachmentState { color_write_mask, ..first };
        }
        WRITE_MASK_OF_FIRST.replaces(&mut blend.color_write_mask, first.color_write_mask);
        if index > 0 && has_fragment_stage {
            ATTACHMENTS_FIRST_ONLY.replaces(&mut blend.color_write_mask, vk::ColorComponentFlags::empty());
        }
        WRITE_MASK.replaces(&mut blend.color_write_mask, vk::ColorComponentFlags::RGBA);
        if blend.blend_enable == vk::FALSE {
            continue;
        }
        BLEND_ENABLE.replaces(&mut blend.blend_enable, vk::FALSE);
        if LIBRARY_BLEND.strikes(is_library) {
            blend.blend_enable = vk::FALSE;
        }
        BLEND_OP.replaces(&mut blend.color_blend_op, vk::BlendOp::ADD);
        BLEND_OP.replaces(&mut blend.alpha_blend_op, vk::BlendOp::ADD);
        let over = [vk::BlendFactor::ONE, vk::BlendFactor::ONE_MINUS_SRC_ALPHA];
        if BLEND_FACTORS.strikes([blend.src_color_blend_factor, blend.dst_color_blend_factor] != over) {
            [blend.src_color_blend_factor, blend.dst_color_blend_factor] = over;
            [blend.src_alpha_blend_factor, blend.dst_alpha_blend_factor] = over;
        }
        let of_color = [blend.src_color_blend_factor, blend.dst_color_blend_factor];
        if BLEND_OF_ALPHA.strikes([blend.src_alpha_blend_factor, blend.dst_alpha_blend_factor] != of_color) {
            [blend.src_alpha_blend_factor, blend.dst_alpha_blend_factor] = of_color;
            blend.alpha_blend_op = blend.color_blend_op;
        }
    }
}
