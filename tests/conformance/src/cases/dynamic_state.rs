//! Dynamic states, of the extension and of Vulkan: the pipeline has other values.

use ash::vk;
use gaurast::gaussian_primitive_topology::Device as Gaussian;
use gaurast::vk::{
    DYNAMIC_STATE_GAUSSIAN_ALPHA_CEILING_GAURAST, DYNAMIC_STATE_GAUSSIAN_ALPHA_FLOOR_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_ANTIALIASING_GAURAST, DYNAMIC_STATE_GAUSSIAN_CONTRIBUTION_BUDGET_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_EXPONENTIAL_ERROR_GAURAST, DYNAMIC_STATE_GAUSSIAN_LOW_PASS_VARIANCE_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_ORDER_GAURAST, DYNAMIC_STATE_GAUSSIAN_SPHERICAL_HARMONICS_DEGREE_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_TRANSMITTANCE_FLOOR_GAURAST, GaussianAntialiasingGAURAST as Antialiasing,
    GaussianOrderGAURAST as Order, PipelineGaussianApproximationStateCreateInfoGAURAST as Approximation,
};
use gaurast_testkit::{Commands, Graphics};

use super::attachments::{tested, with_depth};
use super::chapter::Chapter;
use super::scenes::dense;
use crate::draw::{Depth, Draw, State};
use crate::program::Program;

/// Values of the extension's dynamic states.
#[derive(Clone, Copy)]
struct Values {
    state: State,
    degree: u32,
    approximation: [f32; 2],
}

/// A dynamic state of the extension.
struct Dynamic {
    name: &'static str,
    state: vk::DynamicState,
    set: unsafe fn(&Gaussian, vk::CommandBuffer, &Values),
    /// The value that a case sets.
    value: fn(Values) -> Values,
}

static STATES: [Dynamic; 9] = [
    Dynamic {
        name: "order",
        state: DYNAMIC_STATE_GAUSSIAN_ORDER_GAURAST,
        // SAFETY: the caller's promise that commands are recorded, here and below.
        set: |gaussian, raw, values| unsafe { gaussian.cmd_set_gaussian_order(raw, values.state.order) },
        value: |values| Values { state: values.state.order(Order::PRIMITIVE), ..values },
    },
    Dynamic {
        name: "antialiasing",
        state: DYNAMIC_STATE_GAUSSIAN_ANTIALIASING_GAURAST,
        // SAFETY: as above.
        set: |gaussian, raw, values| unsafe { gaussian.cmd_set_gaussian_antialiasing(raw, values.state.antialiasing) },
        value: |values| Values { state: values.state.antialiasing(Antialiasing::OPACITY_COMPENSATED), ..values },
    },
    Dynamic {
        name: "low_pass_variance",
        state: DYNAMIC_STATE_GAUSSIAN_LOW_PASS_VARIANCE_GAURAST,
        set: |gaussian, raw, values| {
            // SAFETY: as above.
            unsafe { gaussian.cmd_set_gaussian_low_pass_variance(raw, values.state.low_pass_variance) };
        },
        value: |values| Values { state: values.state.low_pass_variance(1.25), ..values },
    },
    Dynamic {
        name: "alpha_floor",
        state: DYNAMIC_STATE_GAUSSIAN_ALPHA_FLOOR_GAURAST,
        // SAFETY: as above.
        set: |gaussian, raw, values| unsafe { gaussian.cmd_set_gaussian_alpha_floor(raw, values.state.alpha_floor) },
        value: |values| Values { state: values.state.alpha_floor(0.07), ..values },
    },
    Dynamic {
        name: "alpha_ceiling",
        state: DYNAMIC_STATE_GAUSSIAN_ALPHA_CEILING_GAURAST,
        set: |gaussian, raw, values| {
            // SAFETY: as above.
            unsafe { gaussian.cmd_set_gaussian_alpha_ceiling(raw, values.state.alpha_ceiling) };
        },
        value: |values| Values { state: values.state.alpha_ceiling(0.4), ..values },
    },
    Dynamic {
        name: "transmittance_floor",
        state: DYNAMIC_STATE_GAUSSIAN_TRANSMITTANCE_FLOOR_GAURAST,
        set: |gaussian, raw, values| {
            // SAFETY: as above.
            unsafe { gaussian.cmd_set_gaussian_transmittance_floor(raw, values.state.transmittance_floor) };
        },
        value: |values| Values { state: values.state.transmittance_floor(0.2), ..values },
    },
    Dynamic {
        name: "spherical_harmonics_degree",
        state: DYNAMIC_STATE_GAUSSIAN_SPHERICAL_HARMONICS_DEGREE_GAURAST,
        set: |gaussian, raw, values| {
            // SAFETY: as above.
            unsafe { gaussian.cmd_set_gaussian_spherical_harmonics_degree(raw, values.degree) };
        },
        value: |values| Values { degree: 1, ..values },
    },
    Dynamic {
        name: "exponential_error",
        state: DYNAMIC_STATE_GAUSSIAN_EXPONENTIAL_ERROR_GAURAST,
        set: |gaussian, raw, values| {
            // SAFETY: as above.
            unsafe { gaussian.cmd_set_gaussian_exponential_error(raw, values.approximation[0]) };
        },
        value: |values| Values { approximation: [0.0, values.approximation[1]], ..values },
    },
    Dynamic {
        name: "contribution_budget",
        state: DYNAMIC_STATE_GAUSSIAN_CONTRIBUTION_BUDGET_GAURAST,
        set: |gaussian, raw, values| {
            // SAFETY: as above.
            unsafe { gaussian.cmd_set_gaussian_contribution_budget(raw, values.approximation[1]) };
        },
        value: |values| Values { approximation: [values.approximation[0], 0.0], ..values },
    },
];

/// The pipeline's values.
fn of_pipeline() -> Values {
    Values { state: State::default(), degree: 2, approximation: [0.0; 2] }
}

/// What the pipeline of a dynamic state may approximate: all that the state then forbids.
fn approximation(dynamic: &Dynamic) -> [f32; 2] {
    match dynamic.name {
        "exponential_error" => [1.0, 0.0],
        "contribution_budget" => [0.0, 1.0],
        _ => [0.0; 2],
    }
}

/// A draw of the values of a dynamic state.
fn draw(values: Values, seed: u64) -> Draw {
    Draw { degree: values.degree, state: values.state, ..Draw::new(dense(seed, 2)) }
}

/// Sets the pipeline's own values, and makes some states dynamic.
fn make_dynamic(graphics: &mut Graphics<'_>, own: Values, states: &[&Dynamic]) {
    let locations = graphics.gaussian.expect("a Gaussian state").attribute_locations;
    let state = own.state.spherical_harmonics_degree(own.degree).attribute_locations(locations);
    graphics.gaussian = Some(state);
    let [error, budget] = own.approximation;
    graphics.approximation = Some(Approximation::default().exponential_error(error).contribution_budget(budget));
    graphics.dynamic.extend(states.iter().map(|dynamic| dynamic.state));
    // The vertex input has all coefficients that the pipeline's degree has.
    let present = graphics.attributes.len() as u32 - 4;
    graphics.attributes.extend((present..(own.degree + 1).pow(2)).map(|k| vk::VertexInputAttributeDescription {
        location: 4 + k,
        binding: 4,
        format: vk::Format::R32G32B32_SFLOAT,
        offset: 12 * k,
    }));
}

fn set(commands: &Commands, dynamic: &Dynamic, values: &Values) {
    let gaussian = commands.gpu().gaussian().expect("a device that draws Gaussians");
    // SAFETY: the commands are being recorded.
    unsafe { (dynamic.set)(gaussian, commands.raw, values) };
}

pub(super) fn dynamic_state(chapter: &mut Chapter<'_>) {
    for dynamic in &STATES {
        let own = Values { approximation: approximation(dynamic), ..of_pipeline() };
        let values = (dynamic.value)(own);
        for (name, first) in [("once", None), ("again", Some(own))] {
            chapter.program(format!("{}.{name}", dynamic.name), move || {
                let program = Program::changed(
                    draw(values, 471),
                    move |graphics| make_dynamic(graphics, own, &[dynamic]),
                    move |stage| {
                        stage.run(|commands| {
                            if let Some(first) = &first {
                                set(commands, dynamic, first);
                            }
                            set(commands, dynamic, &values);
                            commands.draw(0..500);
                        });
                    },
                );
                let program = if own.approximation == [0.0; 2] { program } else { approximate(program) };
                program.needing("gaussianDynamicState")
            });
        }
    }
    chapter.program("all", || {
        let state = State::default()
            .order(Order::PRIMITIVE)
            .antialiasing(Antialiasing::OPACITY_COMPENSATED)
            .low_pass_variance(0.1)
            .alpha_floor(0.02)
            .alpha_ceiling(0.7)
            .transmittance_floor(0.05);
        let values = Values { state, degree: 1, approximation: [0.0; 2] };
        let own = of_pipeline();
        let all = || STATES.iter();
        let program = Program::changed(
            draw(values, 472),
            move |graphics| make_dynamic(graphics, own, &all().collect::<Vec<_>>()),
            move |stage| {
                stage.run(|commands| {
                    all().for_each(|dynamic| set(commands, dynamic, &values));
                    // Other pipelines keep the values.
                    commands.bind(&stage.pipeline);
                    commands.draw(0..500);
                });
            },
        );
        program.needing("gaussianDynamicState")
    });
    of_vulkan(chapter);
}

fn approximate(program: Program) -> Program {
    program.needing("gaussianApproximation")
}

/// A dynamic state of Vulkan: the state, the change of the pipeline's own value, and the command.
struct OfVulkan {
    name: &'static str,
    state: vk::DynamicState,
    change: fn(&mut Graphics<'_>),
    set: unsafe fn(&ash::Device, vk::CommandBuffer),
}

/// Both faces.
const FACES: vk::StencilFaceFlags = vk::StencilFaceFlags::FRONT_AND_BACK;

/// The stencil state of the cases.
const STENCIL: vk::StencilOpState = vk::StencilOpState {
    fail_op: vk::StencilOp::INVERT,
    pass_op: vk::StencilOp::REPLACE,
    depth_fail_op: vk::StencilOp::INCREMENT_AND_WRAP,
    compare_op: vk::CompareOp::LESS,
    compare_mask: 0b11,
    write_mask: 0b1011,
    reference: 2,
};

/// Another one, which the pipelines have.
const OTHER: vk::StencilOpState = vk::StencilOpState {
    fail_op: vk::StencilOp::KEEP,
    pass_op: vk::StencilOp::ZERO,
    depth_fail_op: vk::StencilOp::KEEP,
    compare_op: vk::CompareOp::ALWAYS,
    compare_mask: 0xff,
    write_mask: 0xff,
    reference: 5,
};

static OF_VULKAN: [OfVulkan; 10] = [
    OfVulkan {
        name: "depth_test_enable",
        state: vk::DynamicState::DEPTH_TEST_ENABLE,
        change: |graphics| graphics.depth_stencil.depth_test_enable = vk::FALSE,
        // SAFETY: the caller's promise that commands are recorded, here and below.
        set: |device, raw| unsafe { device.cmd_set_depth_test_enable(raw, true) },
    },
    OfVulkan {
        name: "depth_write_enable",
        state: vk::DynamicState::DEPTH_WRITE_ENABLE,
        change: |graphics| graphics.depth_stencil.depth_write_enable = vk::FALSE,
        // SAFETY: as above.
        set: |device, raw| unsafe { device.cmd_set_depth_write_enable(raw, true) },
    },
    OfVulkan {
        name: "depth_compare_op",
        state: vk::DynamicState::DEPTH_COMPARE_OP,
        change: |graphics| graphics.depth_stencil.depth_compare_op = vk::CompareOp::GREATER,
        // SAFETY: as above.
        set: |device, raw| unsafe { device.cmd_set_depth_compare_op(raw, vk::CompareOp::LESS) },
    },
    OfVulkan {
        name: "depth_bounds_test_enable",
        state: vk::DynamicState::DEPTH_BOUNDS_TEST_ENABLE,
        change: |graphics| graphics.depth_stencil.depth_bounds_test_enable = vk::FALSE,
        // SAFETY: as above.
        set: |device, raw| unsafe { device.cmd_set_depth_bounds_test_enable(raw, true) },
    },
    OfVulkan {
        name: "depth_bounds",
        state: vk::DynamicState::DEPTH_BOUNDS,
        change: |graphics| {
            (graphics.depth_stencil.min_depth_bounds, graphics.depth_stencil.max_depth_bounds) = (0.0, 1.0);
        },
        // SAFETY: as above.
        set: |device, raw| unsafe { device.cmd_set_depth_bounds(raw, BOUNDS[0], BOUNDS[1]) },
    },
    OfVulkan {
        name: "stencil_test_enable",
        state: vk::DynamicState::STENCIL_TEST_ENABLE,
        change: |graphics| graphics.depth_stencil.stencil_test_enable = vk::FALSE,
        // SAFETY: as above.
        set: |device, raw| unsafe { device.cmd_set_stencil_test_enable(raw, true) },
    },
    OfVulkan {
        name: "stencil_op",
        state: vk::DynamicState::STENCIL_OP,
        change: |graphics| {
            let front = &mut graphics.depth_stencil.front;
            *front = vk::StencilOpState { compare_mask: front.compare_mask, write_mask: front.write_mask, ..OTHER };
            front.reference = STENCIL.reference;
        },
        set: |device, raw| {
            let vk::StencilOpState { fail_op, pass_op, depth_fail_op, compare_op, .. } = STENCIL;
            // SAFETY: as above.
            unsafe { device.cmd_set_stencil_op(raw, FACES, fail_op, pass_op, depth_fail_op, compare_op) };
        },
    },
    OfVulkan {
        name: "stencil_compare_mask",
        state: vk::DynamicState::STENCIL_COMPARE_MASK,
        change: |graphics| graphics.depth_stencil.front.compare_mask = OTHER.compare_mask,
        // SAFETY: as above.
        set: |device, raw| unsafe { device.cmd_set_stencil_compare_mask(raw, FACES, STENCIL.compare_mask) },
    },
    OfVulkan {
        name: "stencil_write_mask",
        state: vk::DynamicState::STENCIL_WRITE_MASK,
        change: |graphics| graphics.depth_stencil.front.write_mask = OTHER.write_mask,
        // SAFETY: as above.
        set: |device, raw| unsafe { device.cmd_set_stencil_write_mask(raw, FACES, STENCIL.write_mask) },
    },
    OfVulkan {
        name: "stencil_reference",
        state: vk::DynamicState::STENCIL_REFERENCE,
        change: |graphics| graphics.depth_stencil.front.reference = OTHER.reference,
        // SAFETY: as above.
        set: |device, raw| unsafe { device.cmd_set_stencil_reference(raw, FACES, STENCIL.reference) },
    },
];

/// The depth bounds of the cases.
const BOUNDS: [f32; 2] = [0.7, 0.98];

fn of_vulkan(chapter: &mut Chapter<'_>) {
    for dynamic in &OF_VULKAN {
        chapter.program(dynamic.name, move || {
            let depth = tested(vk::Format::D32_SFLOAT_S8_UINT, vk::CompareOp::LESS, true);
            let has_bounds = dynamic.name.starts_with("depth_bounds");
            let bounds = has_bounds.then_some(BOUNDS);
            let stencil = (!has_bounds).then_some(STENCIL);
            let draw = with_depth(Depth { bounds, stencil, ..depth });
            Program::changed(
                draw,
                move |graphics| {
                    (dynamic.change)(graphics);
                    graphics.dynamic.push(dynamic.state);
                },
                move |stage| {
                    stage.run(|commands| {
                        let (device, raw) = commands.raw();
                        // SAFETY: the commands are being recorded.
                        unsafe { (dynamic.set)(device, raw) };
                        commands.draw(0..stage.scene.count);
                    });
                },
            )
        });
    }
    chapter.program("viewport_and_scissor_with_count", || {
        let rectangle =
            vk::Rect2D::default().offset(vk::Offset2D { x: 17, y: 5 }).extent(vk::Extent2D { width: 60, height: 61 });
        let viewport = vk::Viewport { x: 13.0, y: 21.0, width: 61.0, height: 47.0, min_depth: 0.0, max_depth: 1.0 };
        let draw = Draw {
            scissor: Some(rectangle),
            viewport: Some(viewport),
            behind: [0.1, 0.2, 0.3, 0.4],
            ..Draw::new(dense(473, 0))
        };
        let change = |graphics: &mut Graphics<'_>| {
            graphics.viewports = 0;
            graphics.dynamic = vec![vk::DynamicState::VIEWPORT_WITH_COUNT, vk::DynamicState::SCISSOR_WITH_COUNT];
        };
        Program::changed(draw, change, move |stage| {
            stage.run(|commands| {
                let (device, raw) = commands.raw();
                // SAFETY: the commands are being recorded.
                unsafe {
                    device.cmd_set_viewport_with_count(raw, &[viewport]);
                    device.cmd_set_scissor_with_count(raw, &[rectangle]);
                }
                commands.draw(0..stage.scene.count);
            });
        })
    });
}
