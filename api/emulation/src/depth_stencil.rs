//! Depth and stencil tests of Gaussians: a pipeline's, or those that commands set.

use ash::vk;

/// The state of depth and stencil tests, of front faces.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TestState {
    pub(crate) is_depth_tested: bool,
    pub(crate) is_depth_written: bool,
    pub(crate) depth_compare: vk::CompareOp,
    pub(crate) are_bounds_tested: bool,
    /// The least depth and the most.
    pub(crate) bounds: [f32; 2],
    pub(crate) is_stencil_tested: bool,
    pub(crate) stencil: vk::StencilOpState,
}

impl TestState {
    /// The state of a pipeline.
    pub(crate) fn of_pipeline(state: &vk::PipelineDepthStencilStateCreateInfo<'_>) -> Self {
        Self {
            is_depth_tested: state.depth_test_enable != vk::FALSE,
            is_depth_written: state.depth_write_enable != vk::FALSE,
            depth_compare: state.depth_compare_op,
            are_bounds_tested: state.depth_bounds_test_enable != vk::FALSE,
            bounds: [state.min_depth_bounds, state.max_depth_bounds],
            is_stencil_tested: state.stencil_test_enable != vk::FALSE,
            stencil: state.front,
        }
    }

    /// The state in which those parts that are dynamic are what commands have set.
    #[must_use]
    pub(crate) fn with_dynamic(mut self, set: &Self, dynamic: &[vk::DynamicState]) -> Self {
        use vk::DynamicState as Dynamic;
        let is = |state: Dynamic| dynamic.contains(&state);
        let choose = |state: Dynamic, own: bool, other: bool| if is(state) { other } else { own };
        self.is_depth_tested = choose(Dynamic::DEPTH_TEST_ENABLE, self.is_depth_tested, set.is_depth_tested);
        self.is_depth_written = choose(Dynamic::DEPTH_WRITE_ENABLE, self.is_depth_written, set.is_depth_written);
        self.are_bounds_tested =
            choose(Dynamic::DEPTH_BOUNDS_TEST_ENABLE, self.are_bounds_tested, set.are_bounds_tested);
        self.is_stencil_tested = choose(Dynamic::STENCIL_TEST_ENABLE, self.is_stencil_tested, set.is_stencil_tested);
        if is(Dynamic::DEPTH_COMPARE_OP) {
            self.depth_compare = set.depth_compare;
        }
        if is(Dynamic::DEPTH_BOUNDS) {
            self.bounds = set.bounds;
        }
        let (own, other) = (&mut self.stencil, &set.stencil);
        if is(Dynamic::STENCIL_OP) {
            (own.fail_op, own.pass_op, own.depth_fail_op) = (other.fail_op, other.pass_op, other.depth_fail_op);
            own.compare_op = other.compare_op;
        }
        if is(Dynamic::STENCIL_COMPARE_MASK) {
            own.compare_mask = other.compare_mask;
        }
        if is(Dynamic::STENCIL_WRITE_MASK) {
            own.write_mask = other.write_mask;
        }
        if is(Dynamic::STENCIL_REFERENCE) {
            own.reference = other.reference;
        }
        self
    }

    /// Reports whether something is tested.
    pub(crate) fn tests_anything(&self) -> bool {
        self.is_depth_tested || self.are_bounds_tested || self.is_stencil_tested
    }

    /// Reports whether something is tested, or is where commands say so.
    pub(crate) fn may_test_anything(&self, dynamic: &[vk::DynamicState]) -> bool {
        use vk::DynamicState as Dynamic;
        let enables = [Dynamic::DEPTH_TEST_ENABLE, Dynamic::DEPTH_BOUNDS_TEST_ENABLE, Dynamic::STENCIL_TEST_ENABLE];
        self.tests_anything() || enables.iter().any(|enable| dynamic.contains(enable))
    }

    /// Reports whether two states are one, as far as they have an effect.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let depth = |own: &Self| own.is_depth_tested.then_some((own.is_depth_written, own.depth_compare));
        let bounds = |own: &Self| own.are_bounds_tested.then_some(own.bounds);
        let stencil = |own: &Self| {
            let state = &own.stencil;
            let operations = [state.fail_op, state.pass_op, state.depth_fail_op];
            let masks = [state.compare_mask, state.write_mask, state.reference];
            own.is_stencil_tested.then_some((operations, state.compare_op, masks))
        };
        depth(self) == depth(other) && bounds(self) == bounds(other) && stencil(self) == stencil(other)
    }
}

/// The dynamic states by which a set is shown where it is tested. The kernels have made the tests: what is left is to store.
pub(crate) const STORED: [vk::DynamicState; 7] = [
    vk::DynamicState::DEPTH_TEST_ENABLE,
    vk::DynamicState::DEPTH_WRITE_ENABLE,
    vk::DynamicState::STENCIL_TEST_ENABLE,
    vk::DynamicState::STENCIL_OP,
    vk::DynamicState::STENCIL_COMPARE_MASK,
    vk::DynamicState::STENCIL_WRITE_MASK,
    vk::DynamicState::STENCIL_REFERENCE,
];

/// The outcome of a sample's tests that a draw stores, as `shaders/outcomes.glsl` has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// Gaussians contributed.
    Passed,
    /// Some reached the sample, and none contributed.
    Failed,
    /// Some reached the sample, but its stencil test failed.
    StencilFailed,
}

impl Outcome {
    /// The number that the shader wants.
    pub(crate) fn number(self) -> f32 {
        match self {
            Self::Passed => 1.0,
            Self::Failed => -2.0,
            Self::StencilFailed => -3.0,
        }
    }

    /// Sets the dynamic state by which the outcome is stored.
    ///
    /// # Safety
    /// The command buffer is being recorded.
    pub(crate) unsafe fn set(self, next: &ash::Device, commands: vk::CommandBuffer, state: &TestState) {
        let (faces, keep) = (vk::StencilFaceFlags::FRONT_AND_BACK, vk::StencilOp::KEEP);
        let stencil = &state.stencil;
        let is_passed = self == Self::Passed;
        // Without a fragment the test fails, so that no depth is stored and no sample counted.
        let (fail, pass, compare) = match self {
            Self::Passed => (keep, stencil.pass_op, vk::CompareOp::ALWAYS),
            Self::Failed => (stencil.depth_fail_op, keep, vk::CompareOp::NEVER),
            Self::StencilFailed => (stencil.fail_op, keep, vk::CompareOp::NEVER),
        };
        // SAFETY: the caller's promise.
        unsafe {
            next.cmd_set_depth_test_enable(commands, is_passed && state.is_depth_tested);
            next.cmd_set_depth_write_enable(commands, is_passed && state.is_depth_tested && state.is_depth_written);
            next.cmd_set_stencil_test_enable(commands, state.is_stencil_tested);
            next.cmd_set_stencil_op(commands, faces, fail, pass, keep, compare);
            next.cmd_set_stencil_compare_mask(commands, faces, 0xFF);
            next.cmd_set_stencil_write_mask(commands, faces, stencil.write_mask);
            next.cmd_set_stencil_reference(commands, faces, stencil.reference);
        }
    }
}
