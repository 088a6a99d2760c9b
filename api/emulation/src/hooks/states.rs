//! Vulkan's dynamic states, which are set again where a set's fragments were drawn with a pipeline of other states.

use ash::vk;
use gaurast_layer_interface::slice;

use crate::depth_stencil::TestState;
use crate::hooks::site::record;
use crate::next::Next;
use crate::recording::Recording;

/// Hooks of commands whose parameters are plain values: name, the functions' version, state, parameters, and what sets of Gaussians keep
/// of them.
macro_rules! values {
    ($($name:ident, $functions:ident, $state:ident, ($($parameter:ident: $type:ty),+), $keep:expr;)*) => {$(
        pub(super) unsafe extern "system" fn $name(commands: vk::CommandBuffer, $($parameter: $type),+) {
            // SAFETY: see the crate.
            unsafe {
                record(
                    commands,
                    |site, recording| {
                        (site.next.$functions().$name)(commands, $($parameter),+);
                        keep(&mut recording.tests, ($($parameter),+,), $keep);
                        repeat(recording, vk::DynamicState::$state, move |next, commands| {
                            (next.$functions().$name)(commands, $($parameter),+);
                        });
                    },
                    |next| (next.$functions().$name)(commands, $($parameter),+),
                );
            }
        }
    )*};
}

/// Keeps a state for sets of Gaussians.
fn keep<P>(tests: &mut TestState, parameters: P, keep: impl FnOnce(&mut TestState, P)) {
    keep(tests, parameters);
}

values! {
    cmd_set_line_width, fp_v1_0, LINE_WIDTH, (width: f32), |_, _| {};
    cmd_set_depth_bias, fp_v1_0, DEPTH_BIAS, (constant: f32, clamp: f32, slope: f32), |_, _| {};
    cmd_set_depth_bounds, fp_v1_0, DEPTH_BOUNDS, (least: f32, most: f32), |tests, (least, most)| tests.bounds = [least, most];
    cmd_set_cull_mode, fp_v1_3, CULL_MODE, (mode: vk::CullModeFlags), |_, _| {};
    cmd_set_front_face, fp_v1_3, FRONT_FACE, (face: vk::FrontFace), |_, _| {};
    cmd_set_primitive_topology, fp_v1_3, PRIMITIVE_TOPOLOGY, (topology: vk::PrimitiveTopology), |_, _| {};
    cmd_set_depth_test_enable, fp_v1_3, DEPTH_TEST_ENABLE, (enable: vk::Bool32),
        |tests, (enable,)| tests.is_depth_tested = enable != vk::FALSE;
    cmd_set_depth_write_enable, fp_v1_3, DEPTH_WRITE_ENABLE, (enable: vk::Bool32),
        |tests, (enable,)| tests.is_depth_written = enable != vk::FALSE;
    cmd_set_depth_compare_op, fp_v1_3, DEPTH_COMPARE_OP, (op: vk::CompareOp), |tests, (op,)| tests.depth_compare = op;
    cmd_set_depth_bounds_test_enable, fp_v1_3, DEPTH_BOUNDS_TEST_ENABLE, (enable: vk::Bool32),
        |tests, (enable,)| tests.are_bounds_tested = enable != vk::FALSE;
    cmd_set_stencil_test_enable, fp_v1_3, STENCIL_TEST_ENABLE, (enable: vk::Bool32),
        |tests, (enable,)| tests.is_stencil_tested = enable != vk::FALSE;
    cmd_set_rasterizer_discard_enable, fp_v1_3, RASTERIZER_DISCARD_ENABLE, (enable: vk::Bool32), |_, _| {};
    cmd_set_depth_bias_enable, fp_v1_3, DEPTH_BIAS_ENABLE, (enable: vk::Bool32), |_, _| {};
    cmd_set_primitive_restart_enable, fp_v1_3, PRIMITIVE_RESTART_ENABLE, (enable: vk::Bool32), |_, _| {};
}

/// Remembers a command that sets dynamic state; the last of each state counts.
fn repeat(
    recording: &mut Recording,
    state: vk::DynamicState,
    command: impl Fn(&Next, vk::CommandBuffer) + Send + 'static,
) {
    recording.states.insert(state.as_raw(), Box::new(command));
}

/// Stencil states are of one face or of both: each face has its own.
macro_rules! faces {
    ($($name:ident, $functions:ident, $state:ident, ($($parameter:ident: $type:ty),+), $keep:expr;)*) => {$(
        pub(super) unsafe extern "system" fn $name(
            commands: vk::CommandBuffer,
            faces: vk::StencilFaceFlags,
            $($parameter: $type),+
        ) {
            // SAFETY: see the crate.
            unsafe {
                record(
                    commands,
                    |site, recording| {
                        (site.next.$functions().$name)(commands, faces, $($parameter),+);
                        if faces.contains(vk::StencilFaceFlags::FRONT) {
                            keep(&mut recording.tests, ($($parameter),+,), $keep);
                        }
                        for (face, place) in [(vk::StencilFaceFlags::FRONT, 0), (vk::StencilFaceFlags::BACK, 1)] {
                            if faces.contains(face) {
                                let key = -2 * vk::DynamicState::$state.as_raw() - place;
                                recording.states.insert(key, Box::new(move |next, commands| {
                                    (next.$functions().$name)(commands, face, $($parameter),+);
                                }));
                            }
                        }
                    },
                    |next| (next.$functions().$name)(commands, faces, $($parameter),+),
                );
            }
        }
    )*};
}

faces! {
    cmd_set_stencil_compare_mask, fp_v1_0, STENCIL_COMPARE_MASK, (mask: u32),
        |tests, (mask,)| tests.stencil.compare_mask = mask;
    cmd_set_stencil_write_mask, fp_v1_0, STENCIL_WRITE_MASK, (mask: u32),
        |tests, (mask,)| tests.stencil.write_mask = mask;
    cmd_set_stencil_reference, fp_v1_0, STENCIL_REFERENCE, (reference: u32),
        |tests, (reference,)| tests.stencil.reference = reference;
    cmd_set_stencil_op, fp_v1_3, STENCIL_OP,
        (fail: vk::StencilOp, pass: vk::StencilOp, depth_fail: vk::StencilOp, compare: vk::CompareOp),
        |tests, (fail, pass, depth_fail, compare)| {
            let stencil = &mut tests.stencil;
            (stencil.fail_op, stencil.pass_op, stencil.depth_fail_op) = (fail, pass, depth_fail);
            stencil.compare_op = compare;
        };
}

pub(super) unsafe extern "system" fn cmd_set_blend_constants(commands: vk::CommandBuffer, constants: *const [f32; 4]) {
    // SAFETY: see the crate.
    unsafe {
        let constants = *constants;
        record(
            commands,
            |site, recording| {
                site.next.cmd_set_blend_constants(commands, &constants);
                repeat(recording, vk::DynamicState::BLEND_CONSTANTS, move |next, commands| {
                    next.cmd_set_blend_constants(commands, &constants);
                });
            },
            |next| next.cmd_set_blend_constants(commands, &constants),
        );
    }
}

/// Viewports and scissors are lists, of which the first is kept for sets: name of the command and of the one with a count, and
/// their states; member of a recording, type.
macro_rules! lists {
    ($($name:ident $state:ident, $with_count:ident $state_with_count:ident: $member:ident, $type:ty;)*) => {$(
        pub(super) unsafe extern "system" fn $name(
            commands: vk::CommandBuffer,
            first: u32,
            count: u32,
            values: *const $type,
        ) {
            // SAFETY: see the crate.
            unsafe {
                let values = slice(values, count);
                record(
                    commands,
                    |site, recording| {
                        site.next.$name(commands, first, values);
                        if first == 0 {
                            let kept = values.to_vec();
                            recording.$member = kept.first().copied();
                            repeat(recording, vk::DynamicState::$state, move |next, commands| {
                                next.$name(commands, first, &kept);
                            });
                        }
                    },
                    |next| next.$name(commands, first, values),
                );
            }
        }

        pub(super) unsafe extern "system" fn $with_count(
            commands: vk::CommandBuffer,
            count: u32,
            values: *const $type,
        ) {
            // SAFETY: see the crate.
            unsafe {
                let values = slice(values, count);
                record(
                    commands,
                    |site, recording| {
                        site.next.$with_count(commands, values);
                        let kept = values.to_vec();
                        recording.$member = kept.first().copied();
                        repeat(recording, vk::DynamicState::$state_with_count, move |next, commands| {
                            next.$with_count(commands, &kept);
                        });
                    },
                    |next| next.$with_count(commands, values),
                );
            }
        }
    )*};
}

lists! {
    cmd_set_viewport VIEWPORT, cmd_set_viewport_with_count VIEWPORT_WITH_COUNT: viewport, vk::Viewport;
    cmd_set_scissor SCISSOR, cmd_set_scissor_with_count SCISSOR_WITH_COUNT: scissor, vk::Rect2D;
}
