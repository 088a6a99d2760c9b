//! Dynamic state: the table of states that a command buffer may set, and the states that it has set.

use super::parts::Parts;
use super::state::FixedFunctionState as Fixed;
use crate::convert::StencilOps;
use ash::vk;
use simdevice::state::gaussian::GaussianOrder;
use simdevice::state::{BlendEquations, CompareOp, DepthBias, LineMode, LineStipple, LogicOp, PolygonMode, Topology};

/// The face that a stencil state is for: 0 is the front, 1 the back.
pub(crate) type Face = usize;

/// The names of the extension's dynamic states, as Vulkan's.
pub(super) trait GaussianStates {
    const GAUSSIAN_ORDER: Self;
    const GAUSSIAN_ANTIALIASING: Self;
    const GAUSSIAN_LOW_PASS_VARIANCE: Self;
    const GAUSSIAN_ALPHA_FLOOR: Self;
    const GAUSSIAN_ALPHA_CEILING: Self;
    const GAUSSIAN_TRANSMITTANCE_FLOOR: Self;
    const GAUSSIAN_SPHERICAL_HARMONICS_DEGREE: Self;
    const GAUSSIAN_EXPONENTIAL_ERROR: Self;
    const GAUSSIAN_CONTRIBUTION_BUDGET: Self;
}

impl GaussianStates for vk::DynamicState {
    const GAUSSIAN_ORDER: Self = gaurast::vk::DYNAMIC_STATE_GAUSSIAN_ORDER_GAURAST;
    const GAUSSIAN_ANTIALIASING: Self = gaurast::vk::DYNAMIC_STATE_GAUSSIAN_ANTIALIASING_GAURAST;
    const GAUSSIAN_LOW_PASS_VARIANCE: Self = gaurast::vk::DYNAMIC_STATE_GAUSSIAN_LOW_PASS_VARIANCE_GAURAST;
    const GAUSSIAN_ALPHA_FLOOR: Self = gaurast::vk::DYNAMIC_STATE_GAUSSIAN_ALPHA_FLOOR_GAURAST;
    const GAUSSIAN_ALPHA_CEILING: Self = gaurast::vk::DYNAMIC_STATE_GAUSSIAN_ALPHA_CEILING_GAURAST;
    const GAUSSIAN_TRANSMITTANCE_FLOOR: Self = gaurast::vk::DYNAMIC_STATE_GAUSSIAN_TRANSMITTANCE_FLOOR_GAURAST;
    const GAUSSIAN_SPHERICAL_HARMONICS_DEGREE: Self =
        gaurast::vk::DYNAMIC_STATE_GAUSSIAN_SPHERICAL_HARMONICS_DEGREE_GAURAST;
    const GAUSSIAN_EXPONENTIAL_ERROR: Self = gaurast::vk::DYNAMIC_STATE_GAUSSIAN_EXPONENTIAL_ERROR_GAURAST;
    const GAUSSIAN_CONTRIBUTION_BUDGET: Self = gaurast::vk::DYNAMIC_STATE_GAUSSIAN_CONTRIBUTION_BUDGET_GAURAST;
}

/// Reports whether a state is one of the extension's.
pub(super) fn is_of_gaussians(state: vk::DynamicState) -> bool {
    use vk::DynamicState as S;
    [
        S::GAUSSIAN_ORDER,
        S::GAUSSIAN_ANTIALIASING,
        S::GAUSSIAN_LOW_PASS_VARIANCE,
        S::GAUSSIAN_ALPHA_FLOOR,
        S::GAUSSIAN_ALPHA_CEILING,
        S::GAUSSIAN_TRANSMITTANCE_FLOOR,
        S::GAUSSIAN_SPHERICAL_HARMONICS_DEGREE,
        S::GAUSSIAN_EXPONENTIAL_ERROR,
        S::GAUSSIAN_CONTRIBUTION_BUDGET,
    ]
    .contains(&state)
}

/// The use of a dynamic state by Gaussians.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Gaussians {
    /// The state affects their fragments.
    Taken,
    /// It has no effect on them.
    Ignored,
    /// The state may not be dynamic in a pipeline of Gaussians.
    Refused,
}

/// A row of the table.
struct Row {
    state: vk::DynamicState,
    /// The part of a pipeline that would have the value if it were static.
    part: Parts,
    /// Reports whether a draw with the rest of the state needs it to be set.
    is_needed: fn(&Fixed) -> bool,
    gaussians: Gaussians,
}

/// Defines the table. `LINE_WIDTH => LineWidth(width: f32), part .., set .., needed .., gaussians ..;` gives a state's
/// name and value, its part of a pipeline, the function that puts the value into fixed-function state, the condition under
/// which a draw needs it to be set, and the use by Gaussians. A state of each face, or of each colour attachment, has that in brackets.
macro_rules! dynamic_states {
    ($(
        $state:ident => $variant:ident $([$face:ident])? ($value:ident: $type:ty),
        part $part:ident, set $set:expr, needed $needed:expr, gaussians $gaussians:ident;
    )*) => {
        /// A state that a command buffer has set, with its value.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[allow(missing_docs, reason = "the names are those of Vulkan's commands")]
        pub(crate) enum DynamicState {
            $($variant { $($face: Face,)? $value: $type },)*
        }

        const ROWS: &[Row] = &[$(Row {
            state: vk::DynamicState::$state,
            part: Parts::$part,
            is_needed: $needed,
            gaussians: Gaussians::$gaussians,
        },)*];

        impl DynamicState {
            /// The state, and its face if it is set for a face.
            fn key(self) -> (vk::DynamicState, Option<Face>) {
                match self {
                    $(Self::$variant { $($face,)? .. } => {
                        (vk::DynamicState::$state, None::<Face>$(.or(Some($face)))?)
                    })*
                }
            }

            /// Puts the value into fixed-function state.
            pub(crate) fn apply(self, state: &mut Fixed) {
                fn apply(state: &mut Fixed, set: impl FnOnce(&mut Fixed)) {
                    set(state);
                }
                match self {
                    $(Self::$variant { $($face,)? $value } => apply(state, $set),)*
                }
            }
        }
    };
}

dynamic_states! {
    LINE_WIDTH => LineWidth(width: f32),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.draw.line_width = width, needed Fixed::draws_lines, gaussians Ignored;
    DEPTH_BIAS => DepthBias(bias: DepthBias),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.depth_bias = bias, needed Fixed::biases_depth, gaussians Ignored;
    DEPTH_BIAS_ENABLE => DepthBiasEnable(enable: bool),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.depth_bias_enable = enable, needed Fixed::rasterizes, gaussians Ignored;
    BLEND_CONSTANTS => BlendConstants(constants: [f32; 4]),
        part FRAGMENT_OUTPUT_INTERFACE,
        set |state| state.draw.blend_constants = constants, needed Fixed::blends_by_constants, gaussians Taken;
    DEPTH_BOUNDS => DepthBounds(bounds: (f32, f32)),
        part FRAGMENT_SHADER,
        set |state| state.depth_bounds = bounds, needed Fixed::tests_depth_bounds, gaussians Taken;
    DEPTH_BOUNDS_TEST_ENABLE => DepthBoundsTestEnable(enable: bool),
        part FRAGMENT_SHADER,
        set |state| state.depth_bounds_test = enable, needed Fixed::rasterizes, gaussians Taken;
    DEPTH_TEST_ENABLE => DepthTestEnable(enable: bool),
        part FRAGMENT_SHADER,
        set |state| state.depth_test = enable, needed Fixed::rasterizes, gaussians Taken;
    DEPTH_WRITE_ENABLE => DepthWriteEnable(enable: bool),
        part FRAGMENT_SHADER,
        set |state| state.depth_write = enable, needed Fixed::tests_depth, gaussians Taken;
    DEPTH_COMPARE_OP => DepthCompareOp(op: CompareOp),
        part FRAGMENT_SHADER,
        set |state| state.depth_compare = op, needed Fixed::tests_depth, gaussians Taken;
    STENCIL_TEST_ENABLE => StencilTestEnable(enable: bool),
        part FRAGMENT_SHADER,
        set |state| state.stencil_test = enable, needed Fixed::rasterizes, gaussians Taken;
    STENCIL_OP => StencilOp[face](ops: StencilOps),
        part FRAGMENT_SHADER,
        set |state| ops.set(&mut state.stencil[face]), needed Fixed::tests_stencil, gaussians Taken;
    STENCIL_COMPARE_MASK => StencilCompareMask[face](mask: u8),
        part FRAGMENT_SHADER,
        set |state| state.stencil[face].compare_mask = mask, needed Fixed::tests_stencil, gaussians Taken;
    STENCIL_WRITE_MASK => StencilWriteMask[face](mask: u8),
        part FRAGMENT_SHADER,
        set |state| state.stencil[face].write_mask = mask, needed Fixed::tests_stencil, gaussians Taken;
    STENCIL_REFERENCE => StencilReference[face](reference: u8),
        part FRAGMENT_SHADER,
        set |state| state.stencil[face].reference = reference, needed Fixed::tests_stencil, gaussians Taken;
    CULL_MODE => CullMode(mode: vk::CullModeFlags),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.set_cull_mode(mode), needed Fixed::rasterizes, gaussians Ignored;
    FRONT_FACE => FrontFace(face: vk::FrontFace),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.set_front_face(face), needed Fixed::rasterizes, gaussians Ignored;
    PRIMITIVE_TOPOLOGY => PrimitiveTopology(topology: Topology),
        part VERTEX_INPUT_INTERFACE,
        set |state| state.draw.topology = topology, needed |_| true, gaussians Ignored;
    PATCH_CONTROL_POINTS_EXT => PatchControlPoints(count: u32),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.set_patch_control_points(count), needed Fixed::draws_patches, gaussians Ignored;
    TESSELLATION_DOMAIN_ORIGIN_EXT => TessellationDomainOrigin(origin: vk::TessellationDomainOrigin),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.draw.lower_left_domain = origin == vk::TessellationDomainOrigin::LOWER_LEFT,
        needed Fixed::draws_patches, gaussians Ignored;
    PRIMITIVE_RESTART_ENABLE => PrimitiveRestartEnable(enable: bool),
        part VERTEX_INPUT_INTERFACE,
        set |state| state.draw.primitive_restart = enable, needed |_| true, gaussians Refused;
    RASTERIZER_DISCARD_ENABLE => RasterizerDiscardEnable(enable: bool),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.draw.rasterizer_discard = enable, needed |_| true, gaussians Refused;
    GAUSSIAN_ORDER => GaussianOrder(order: GaussianOrder),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.set_gaussian(|own| own.order = order), needed Fixed::draws_gaussians, gaussians Taken;
    GAUSSIAN_ANTIALIASING => GaussianAntialiasing(compensated: bool),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.set_gaussian(|own| own.opacity_compensated = compensated),
        needed Fixed::draws_gaussians, gaussians Taken;
    GAUSSIAN_LOW_PASS_VARIANCE => GaussianLowPassVariance(variance: f32),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.set_gaussian(|own| own.low_pass_variance = variance),
        needed Fixed::draws_gaussians, gaussians Taken;
    GAUSSIAN_ALPHA_FLOOR => GaussianAlphaFloor(floor: f32),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.set_gaussian(|own| own.alpha_floor = floor), needed Fixed::draws_gaussians, gaussians Taken;
    GAUSSIAN_ALPHA_CEILING => GaussianAlphaCeiling(ceiling: f32),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.set_gaussian(|own| own.alpha_ceiling = ceiling), needed Fixed::draws_gaussians, gaussians Taken;
    GAUSSIAN_TRANSMITTANCE_FLOOR => GaussianTransmittanceFloor(floor: f32),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.set_gaussian(|own| own.transmittance_floor = floor),
        needed Fixed::draws_gaussians, gaussians Taken;
    GAUSSIAN_SPHERICAL_HARMONICS_DEGREE => GaussianSphericalHarmonicsDegree(degree: u32),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.set_gaussian(|own| own.sh_degree = degree), needed Fixed::draws_gaussians, gaussians Taken;
    GAUSSIAN_EXPONENTIAL_ERROR => GaussianExponentialError(error: f32),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.set_gaussian(|own| own.approximation.exponential_error = error),
        needed Fixed::draws_gaussians, gaussians Taken;
    GAUSSIAN_CONTRIBUTION_BUDGET => GaussianContributionBudget(budget: f32),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.set_gaussian(|own| own.approximation.contribution_budget = budget),
        needed Fixed::draws_gaussians, gaussians Taken;
    DEPTH_CLAMP_ENABLE_EXT => DepthClampEnable(enable: bool),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.draw.depth_clamp = enable, needed Fixed::rasterizes, gaussians Ignored;
    DEPTH_CLIP_ENABLE_EXT => DepthClipEnable(enable: bool),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.draw.depth_clip = Some(enable), needed Fixed::rasterizes, gaussians Ignored;
    DEPTH_CLIP_NEGATIVE_ONE_TO_ONE_EXT => DepthClipNegativeOneToOne(enable: bool),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.draw.negative_one_to_one = enable, needed Fixed::rasterizes, gaussians Taken;
    POLYGON_MODE_EXT => PolygonMode(mode: PolygonMode),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.draw.polygon_mode = mode, needed Fixed::rasterizes, gaussians Ignored;
    PROVOKING_VERTEX_MODE_EXT => ProvokingVertexMode(mode: vk::ProvokingVertexModeEXT),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.draw.provoking_last = mode == vk::ProvokingVertexModeEXT::LAST_VERTEX,
        needed Fixed::rasterizes, gaussians Ignored;
    RASTERIZATION_STREAM_EXT => RasterizationStream(stream: u32),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.draw.rasterized_stream = stream, needed Fixed::rasterizes, gaussians Ignored;
    LINE_RASTERIZATION_MODE_EXT => LineRasterizationMode(mode: LineMode),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.draw.line_mode = mode, needed Fixed::draws_lines, gaussians Ignored;
    LINE_STIPPLE_ENABLE_EXT => LineStippleEnable(enable: bool),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.draw.stipples_lines = enable, needed Fixed::draws_lines, gaussians Ignored;
    LINE_STIPPLE_KHR => LineStipple(stipple: LineStipple),
        part PRE_RASTERIZATION_SHADERS,
        set |state| state.draw.line_stipple = stipple, needed Fixed::stipples_lines, gaussians Ignored;
    SAMPLE_MASK_EXT => SampleMask(mask: u32),
        part FRAGMENT_OUTPUT_INTERFACE,
        set |state| state.draw.sample_mask = mask, needed Fixed::rasterizes, gaussians Taken;
    ALPHA_TO_COVERAGE_ENABLE_EXT => AlphaToCoverageEnable(enable: bool),
        part FRAGMENT_OUTPUT_INTERFACE,
        set |state| state.draw.alpha_to_coverage = enable, needed Fixed::rasterizes, gaussians Refused;
    ALPHA_TO_ONE_ENABLE_EXT => AlphaToOneEnable(enable: bool),
        part FRAGMENT_OUTPUT_INTERFACE,
        set |state| state.draw.alpha_to_one = enable, needed Fixed::rasterizes, gaussians Refused;
    LOGIC_OP_EXT => LogicOp(op: LogicOp),
        part FRAGMENT_OUTPUT_INTERFACE,
        set |state| state.logic_op = op, needed Fixed::operates, gaussians Taken;
    LOGIC_OP_ENABLE_EXT => LogicOpEnable(enable: bool),
        part FRAGMENT_OUTPUT_INTERFACE,
        set |state| state.logic_op_enable = enable, needed Fixed::has_colors, gaussians Taken;
    COLOR_BLEND_ENABLE_EXT => ColorBlendEnable[attachment](enable: bool),
        part FRAGMENT_OUTPUT_INTERFACE,
        set |state| state.set_attachment(attachment, |it| it.blend_enable = enable),
        needed Fixed::has_colors, gaussians Taken;
    COLOR_BLEND_EQUATION_EXT => ColorBlendEquation[attachment](equations: BlendEquations),
        part FRAGMENT_OUTPUT_INTERFACE,
        set |state| state.set_attachment(attachment, |it| it.equations = equations),
        needed Fixed::blends, gaussians Taken;
    COLOR_WRITE_MASK_EXT => ColorWriteMask[attachment](mask: u8),
        part FRAGMENT_OUTPUT_INTERFACE,
        set |state| state.set_attachment(attachment, |it| it.write_mask = mask),
        needed Fixed::has_colors, gaussians Taken;
    COLOR_WRITE_ENABLE_EXT => ColorWriteEnable[attachment](enable: bool),
        part FRAGMENT_OUTPUT_INTERFACE,
        set |state| state.set_attachment(attachment, |it| it.write_enable = enable),
        needed Fixed::has_colors, gaussians Taken;
}

/// The dynamic states for which no row has a value: those that are looked up for each draw, which are viewports, scissors,
/// strides and vertex input; and whether attachments are read, which they always may be. For Gaussians all but vertex
/// input are allowed.
const LOOKED_UP: [(vk::DynamicState, Parts); 7] = {
    use vk::DynamicState as S;
    const VERTEX_INPUT: Parts = Parts::VERTEX_INPUT_INTERFACE;
    const PRE_RASTERIZATION: Parts = Parts::PRE_RASTERIZATION_SHADERS;
    [
        (S::VIEWPORT, PRE_RASTERIZATION),
        (S::VIEWPORT_WITH_COUNT, PRE_RASTERIZATION),
        (S::SCISSOR, PRE_RASTERIZATION),
        (S::SCISSOR_WITH_COUNT, PRE_RASTERIZATION),
        (S::VERTEX_INPUT_BINDING_STRIDE, VERTEX_INPUT),
        (S::VERTEX_INPUT_EXT, VERTEX_INPUT),
        (S::ATTACHMENT_FEEDBACK_LOOP_ENABLE_EXT, Parts::FRAGMENT_SHADER),
    ]
};

fn row(state: vk::DynamicState) -> Option<&'static Row> {
    ROWS.iter().find(|row| row.state == state)
}

/// The part of a pipeline that would have a state's value if it were static; `None` if the driver doesn't support the
/// state.
pub(crate) fn part(state: vk::DynamicState) -> Option<Parts> {
    let of_looked_up = || LOOKED_UP.iter().find(|(other, _)| *other == state);
    row(state).map(|row| row.part).or_else(|| of_looked_up().map(|(_, part)| *part))
}

/// Reports whether the driver supports a dynamic state.
pub(crate) fn is_supported(state: vk::DynamicState) -> bool {
    part(state).is_some()
}

/// Reports whether a dynamic state has a value, which [`DynamicStates`] holds.
pub(crate) fn has_value(state: vk::DynamicState) -> bool {
    row(state).is_some()
}

/// Reports whether a Gaussian pipeline uses a state from the command buffer.
pub(crate) fn is_taken_by_gaussians(state: vk::DynamicState) -> bool {
    row(state).is_some_and(|row| row.gaussians == Gaussians::Taken)
}

/// Reports whether a state may be dynamic in a Gaussian pipeline.
pub(crate) fn may_gaussians_have(state: vk::DynamicState) -> bool {
    match row(state) {
        Some(row) => row.gaussians != Gaussians::Refused,
        None => state != vk::DynamicState::VERTEX_INPUT_EXT && is_supported(state),
    }
}

/// The faces of a mask.
pub(crate) fn faces(mask: vk::StencilFaceFlags) -> impl Iterator<Item = Face> {
    let flags = [vk::StencilFaceFlags::FRONT, vk::StencilFaceFlags::BACK];
    (0..).zip(flags).filter_map(move |(face, flag)| mask.contains(flag).then_some(face))
}

/// The states that a command buffer has set so far, with the last value of each.
#[derive(Clone, Debug, Default)]
pub(crate) struct DynamicStates(Vec<DynamicState>);

impl DynamicStates {
    /// Sets a state, and replaces its earlier value.
    pub(crate) fn set(&mut self, state: DynamicState) {
        match self.0.iter_mut().find(|old| old.key() == state.key()) {
            Some(old) => *old = state,
            None => self.0.push(state),
        }
    }

    /// The values of a state: one, or one for each face.
    fn of(&self, state: vk::DynamicState) -> impl Iterator<Item = DynamicState> {
        self.0.iter().copied().filter(move |it| it.key().0 == state)
    }

    /// Puts the values of the states `dynamic` that are set into fixed-function state.
    ///
    /// # Errors
    /// The first state that is not set but needed by the draw.
    pub(crate) fn apply(&self, dynamic: &[vk::DynamicState], fixed: &mut Fixed) -> Result<(), vk::DynamicState> {
        let mut missing = Vec::new();
        for &state in dynamic {
            let mut values = self.of(state).peekable();
            if values.peek().is_none() {
                missing.push(state);
            }
            values.for_each(|value| value.apply(fixed));
        }
        let is_needed = |&state: &_| row(state).is_some_and(|row| (row.is_needed)(fixed));
        missing.into_iter().find(is_needed).map_or(Ok(()), Err)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_value_of_a_face_holds() {
        let reference = |face, reference| DynamicState::StencilReference { face, reference };
        let mut states = DynamicStates::default();
        for face in faces(vk::StencilFaceFlags::FRONT_AND_BACK) {
            states.set(reference(face, 1));
        }
        for face in faces(vk::StencilFaceFlags::BACK) {
            states.set(reference(face, 2));
        }
        let width = DynamicState::LineWidth { width: 3.0 };
        states.set(width);
        let of = |state| states.of(state).collect::<Vec<_>>();
        assert_eq!(of(vk::DynamicState::STENCIL_REFERENCE), [reference(0, 1), reference(1, 2)]);
        assert_eq!(of(vk::DynamicState::LINE_WIDTH), [width]);
        assert!(of(vk::DynamicState::DEPTH_BIAS).is_empty());
    }

    #[test]
    fn gaussians_take_ignore_or_refuse_each_state() {
        use vk::DynamicState as S;
        let looked_up = LOOKED_UP.map(|(state, _)| state);
        let all = || ROWS.iter().map(|row| row.state).chain(looked_up);
        assert!(all().all(is_supported));
        assert!(!is_supported(S::RASTERIZATION_SAMPLES_EXT));
        let taken = all().filter(|&state| is_taken_by_gaussians(state));
        assert_eq!(taken.count(), 28);
        let refused: Vec<_> = all().filter(|&state| !may_gaussians_have(state)).collect();
        let expected = [
            S::PRIMITIVE_RESTART_ENABLE,
            S::RASTERIZER_DISCARD_ENABLE,
            S::ALPHA_TO_COVERAGE_ENABLE_EXT,
            S::ALPHA_TO_ONE_ENABLE_EXT,
            S::VERTEX_INPUT_EXT,
        ];
        assert_eq!(refused, expected);
    }
}
