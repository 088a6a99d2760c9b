//! Dynamic states, and commands that make several draws. Each is compared with pipelines that have the state, or with
//! draws that are recorded one by one.

use ash::vk;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{Buffer, Commands, Gpu, Pass, Pipeline, PipelineOptions, Target, TargetOptions, Vertex};
use vk::DynamicState as S;

const FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;
const SIZE: [u32; 2] = [32, 32];

/// A device with all of these extensions, and their commands.
struct Device {
    gpu: Gpu,
    states: ash::ext::extended_dynamic_state3::Device,
    logic: ash::ext::extended_dynamic_state2::Device,
    writes: ash::ext::color_write_enable::Device,
    input: ash::ext::vertex_input_dynamic_state::Device,
    multi: ash::ext::multi_draw::Device,
    lines: ash::ext::line_rasterization::Device,
}

impl Device {
    fn new() -> Self {
        let mut multi = vk::PhysicalDeviceMultiDrawFeaturesEXT::default().multi_draw(true);
        let mut input =
            vk::PhysicalDeviceVertexInputDynamicStateFeaturesEXT::default().vertex_input_dynamic_state(true);
        let mut writes = vk::PhysicalDeviceColorWriteEnableFeaturesEXT::default().color_write_enable(true);
        let mut clip = vk::PhysicalDeviceDepthClipEnableFeaturesEXT::default().depth_clip_enable(true);
        let mut control = vk::PhysicalDeviceDepthClipControlFeaturesEXT::default().depth_clip_control(true);
        let mut logic = vk::PhysicalDeviceExtendedDynamicState2FeaturesEXT::default()
            .extended_dynamic_state2(true)
            .extended_dynamic_state2_logic_op(true);
        let mut provoking = vk::PhysicalDeviceProvokingVertexFeaturesEXT::default().provoking_vertex_last(true);
        let mut restart =
            vk::PhysicalDevicePrimitiveTopologyListRestartFeaturesEXT::default().primitive_topology_list_restart(true);
        let mut lines = vk::PhysicalDeviceLineRasterizationFeaturesKHR::default()
            .rectangular_lines(true)
            .bresenham_lines(true)
            .stippled_rectangular_lines(true);
        let mut states = vk::PhysicalDeviceExtendedDynamicState3FeaturesEXT::default()
            .extended_dynamic_state3_alpha_to_coverage_enable(true)
            .extended_dynamic_state3_alpha_to_one_enable(true)
            .extended_dynamic_state3_color_blend_enable(true)
            .extended_dynamic_state3_color_blend_equation(true)
            .extended_dynamic_state3_color_write_mask(true)
            .extended_dynamic_state3_depth_clamp_enable(true)
            .extended_dynamic_state3_depth_clip_enable(true)
            .extended_dynamic_state3_depth_clip_negative_one_to_one(true)
            .extended_dynamic_state3_line_rasterization_mode(true)
            .extended_dynamic_state3_line_stipple_enable(true)
            .extended_dynamic_state3_logic_op_enable(true)
            .extended_dynamic_state3_polygon_mode(true)
            .extended_dynamic_state3_provoking_vertex_mode(true)
            .extended_dynamic_state3_sample_mask(true);
        input.p_next = (&raw mut multi).cast();
        writes.p_next = (&raw mut input).cast();
        clip.p_next = (&raw mut writes).cast();
        control.p_next = (&raw mut clip).cast();
        logic.p_next = (&raw mut control).cast();
        provoking.p_next = (&raw mut logic).cast();
        restart.p_next = (&raw mut provoking).cast();
        lines.p_next = (&raw mut restart).cast();
        states.p_next = (&raw mut lines).cast();
        let names = [
            ash::ext::extended_dynamic_state3::NAME,
            ash::ext::extended_dynamic_state2::NAME,
            ash::ext::color_write_enable::NAME,
            ash::ext::vertex_input_dynamic_state::NAME,
            ash::ext::multi_draw::NAME,
            ash::ext::depth_clip_enable::NAME,
            ash::ext::depth_clip_control::NAME,
            ash::ext::provoking_vertex::NAME,
            ash::ext::primitive_topology_list_restart::NAME,
            ash::ext::line_rasterization::NAME,
        ];
        let gpu = Gpu::extended(&names, &mut states).expect("a device");
        let (instance, device) = (gpu.instance(), gpu.device());
        Self {
            states: ash::ext::extended_dynamic_state3::Device::new(instance, device),
            logic: ash::ext::extended_dynamic_state2::Device::new(instance, device),
            writes: ash::ext::color_write_enable::Device::new(instance, device),
            input: ash::ext::vertex_input_dynamic_state::Device::new(instance, device),
            multi: ash::ext::multi_draw::Device::new(instance, device),
            lines: ash::ext::line_rasterization::Device::new(instance, device),
            gpu,
        }
    }

    /// The pixels of a target of one or four samples, resolved.
    fn draw(
        &self,
        samples: u32,
        options: &PipelineOptions<'_>,
        vertices: &[Vertex],
        record: impl FnOnce(&Commands),
    ) -> Vec<u8> {
        let target = TargetOptions { size: SIZE, ..TargetOptions::of(FORMAT) };
        let target = match samples {
            1 => target,
            _ => target.multisampled(),
        };
        let target = Target::new(&self.gpu, &target);
        let pipeline = Pipeline::new(&self.gpu, &target, options);
        let vertices = Buffer::of(&self.gpu, vertices);
        let pass = Pass { color: vk::ClearColorValue { float32: [0.25, 0.5, 0.75, 0.5] }, ..Pass::default() };
        self.gpu.run(|commands| {
            commands.pass(&target, &pass, || {
                commands.bind(&pipeline);
                commands.vertices(&vertices);
                record(commands);
            });
        });
        let images = if samples == 1 { &target.colors } else { &target.resolved };
        images[0].read(vk::ImageAspectFlags::COLOR, 4)
    }
}

/// Two triangles that cover most of the target, the right corner deeper than the far plane.
fn triangles() -> Vec<Vertex> {
    let vertex = |x: f32, y: f32, z: f32, color: [f32; 4]| Vertex { position: [x, y, z, 1.0], color };
    let (red, green) = ([1.0, 0.3, 0.0, 0.5], [0.0, 0.8, 0.4, 0.5]);
    vec![
        vertex(-0.9, -0.9, 0.5, red),
        vertex(0.9, -0.7, 1.5, green),
        vertex(-0.7, 0.9, 0.5, red),
        vertex(-0.2, 0.9, 0.5, green),
        vertex(0.9, 0.9, 0.5, green),
        vertex(0.9, -0.2, 0.5, red),
    ]
}

/// A state, off and on: in a pipeline, and set by a command buffer.
struct Case {
    state: S,
    samples: u32,
    base: fn(&mut PipelineOptions<'_>),
    fixed: fn(&mut PipelineOptions<'_>, bool),
    set: fn(&Device, vk::CommandBuffer, bool),
}

fn blend(on: bool) -> vk::PipelineColorBlendAttachmentState {
    let to = if on { vk::BlendFactor::ONE } else { vk::BlendFactor::ZERO };
    gaurast_testkit::blend(vk::BlendFactor::SRC_ALPHA, to, vk::BlendOp::ADD)
}

fn mask(on: bool) -> vk::ColorComponentFlags {
    if on { vk::ColorComponentFlags::G | vk::ColorComponentFlags::A } else { vk::ColorComponentFlags::RGBA }
}

fn polygon(on: bool) -> vk::PolygonMode {
    if on { vk::PolygonMode::LINE } else { vk::PolygonMode::FILL }
}

fn logic(on: bool) -> vk::LogicOp {
    if on { vk::LogicOp::XOR } else { vk::LogicOp::COPY }
}

fn provoking(on: bool) -> vk::ProvokingVertexModeEXT {
    if on { vk::ProvokingVertexModeEXT::LAST_VERTEX } else { vk::ProvokingVertexModeEXT::FIRST_VERTEX }
}

fn line_mode(on: bool) -> vk::LineRasterizationModeEXT {
    if on { vk::LineRasterizationModeEXT::BRESENHAM } else { vk::LineRasterizationModeEXT::RECTANGULAR }
}

fn pattern(on: bool) -> u16 {
    if on { 0x3333 } else { 0x00FF }
}

/// Polygons of which the edges are drawn, in this mode, and by a pattern if there is one.
fn edges(options: &mut PipelineOptions<'_>, mode: vk::LineRasterizationModeEXT, pattern: Option<u16>) {
    options.raster.polygon_mode = vk::PolygonMode::LINE;
    let state = vk::PipelineRasterizationLineStateCreateInfoKHR::default()
        .line_rasterization_mode(mode)
        .stippled_line_enable(pattern.is_some())
        .line_stipple_factor(1)
        .line_stipple_pattern(pattern.unwrap_or(0x3333));
    chained(options, state);
}

/// Chains a structure to a pipeline's rasterization state. It is never freed.
fn chained<T: 'static>(options: &mut PipelineOptions<'_>, structure: T) {
    let leaked: &'static mut T = Box::leak(Box::new(structure));
    options.raster.p_next = std::ptr::from_mut(leaked).cast();
}

// SAFETY of all commands: the command buffer records, and its device has the extensions and features.
fn cases() -> Vec<Case> {
    let case = |state, samples, fixed, set| Case { state, samples, base: |_| {}, fixed, set };
    vec![
        case(
            S::POLYGON_MODE_EXT,
            1,
            |options, on| options.raster.polygon_mode = polygon(on),
            // SAFETY: see above.
            |device, c, on| unsafe { device.states.cmd_set_polygon_mode(c, polygon(on)) },
        ),
        case(
            S::DEPTH_CLAMP_ENABLE_EXT,
            1,
            |options, on| options.raster.depth_clamp_enable = on.into(),
            // SAFETY: see above.
            |device, c, on| unsafe { device.states.cmd_set_depth_clamp_enable(c, on) },
        ),
        case(
            S::DEPTH_CLIP_ENABLE_EXT,
            1,
            |options, on| {
                let state = vk::PipelineRasterizationDepthClipStateCreateInfoEXT::default();
                chained(options, state.depth_clip_enable(on));
            },
            // SAFETY: see above.
            |device, c, on| unsafe { device.states.cmd_set_depth_clip_enable(c, on) },
        ),
        Case {
            // Before zero, and beyond it.
            base: |options| {
                options.vertex = "layout(location = 0) in vec4 position;
                    layout(location = 1) in vec4 color;
                    layout(location = 0) out vec4 v_color;
                    void main() {
                        gl_Position = position - vec4(0.0, 0.0, 1.0, 0.0);
                        v_color = color;
                    }";
            },
            ..case(
                S::DEPTH_CLIP_NEGATIVE_ONE_TO_ONE_EXT,
                1,
                |options, on| options.negative_one_to_one = on,
                // SAFETY: see above.
                |device, c, on| unsafe {
                    device.states.cmd_set_depth_clip_negative_one_to_one(c, on);
                },
            )
        },
        Case {
            base: |options| {
                options.vertex = "layout(location = 0) in vec4 position;
                    layout(location = 1) in vec4 color;
                    layout(location = 0) flat out vec4 flat_color;
                    void main() { gl_Position = position; flat_color = color; }";
                options.fragment = Some(
                    "layout(location = 0) flat in vec4 flat_color;
                    layout(location = 0) out vec4 color;
                    void main() { color = flat_color; }",
                );
            },
            ..case(
                S::PROVOKING_VERTEX_MODE_EXT,
                1,
                |options, on| {
                    let state = vk::PipelineRasterizationProvokingVertexStateCreateInfoEXT::default();
                    chained(options, state.provoking_vertex_mode(provoking(on)));
                },
                // SAFETY: see above.
                |device, c, on| unsafe {
                    device.states.cmd_set_provoking_vertex_mode(c, provoking(on));
                },
            )
        },
        case(
            S::SAMPLE_MASK_EXT,
            4,
            |options, on| options.sample_mask = if on { 0b0101 } else { 0b1111 },
            |device, c, on| {
                let mask = [if on { 0b0101 } else { 0b1111 }];
                // SAFETY: see above.
                unsafe {
                    let samples = vk::SampleCountFlags::TYPE_4;
                    device.states.cmd_set_sample_mask(c, samples, &mask);
                }
            },
        ),
        case(
            S::ALPHA_TO_COVERAGE_ENABLE_EXT,
            4,
            |options, on| options.alpha_to_coverage = on,
            // SAFETY: see above.
            |device, c, on| unsafe { device.states.cmd_set_alpha_to_coverage_enable(c, on) },
        ),
        case(
            S::ALPHA_TO_ONE_ENABLE_EXT,
            4,
            |options, on| options.alpha_to_one = on,
            // SAFETY: see above.
            |device, c, on| unsafe { device.states.cmd_set_alpha_to_one_enable(c, on) },
        ),
        case(
            S::LOGIC_OP_ENABLE_EXT,
            1,
            // A pipeline without a logic operation has the value of the first one, which clears.
            |options, on| options.logic_op = on.then_some(vk::LogicOp::CLEAR),
            // SAFETY: see above.
            |device, c, on| unsafe { device.states.cmd_set_logic_op_enable(c, on) },
        ),
        case(
            S::LOGIC_OP_EXT,
            1,
            |options, on| options.logic_op = Some(logic(on)),
            // SAFETY: see above.
            |device, c, on| unsafe { device.logic.cmd_set_logic_op(c, logic(on)) },
        ),
        case(
            S::COLOR_BLEND_ENABLE_EXT,
            1,
            |options, on| {
                options.blend = vec![blend(true).blend_enable(on)];
            },
            // SAFETY: see above.
            |device, c, on| unsafe {
                device.states.cmd_set_color_blend_enable(c, 0, &[on.into()]);
            },
        ),
        case(
            S::COLOR_BLEND_EQUATION_EXT,
            1,
            |options, on| options.blend = vec![blend(on)],
            |device, c, on| {
                let state = blend(on);
                let equation = vk::ColorBlendEquationEXT {
                    src_color_blend_factor: state.src_color_blend_factor,
                    dst_color_blend_factor: state.dst_color_blend_factor,
                    color_blend_op: state.color_blend_op,
                    src_alpha_blend_factor: state.src_alpha_blend_factor,
                    dst_alpha_blend_factor: state.dst_alpha_blend_factor,
                    alpha_blend_op: state.alpha_blend_op,
                };
                // SAFETY: see above.
                unsafe {
                    device.states.cmd_set_color_blend_equation(c, 0, &[equation]);
                }
            },
        ),
        case(
            S::COLOR_WRITE_MASK_EXT,
            1,
            |options, on| options.blend = vec![blend(true).color_write_mask(mask(on))],
            // SAFETY: see above.
            |device, c, on| unsafe {
                device.states.cmd_set_color_write_mask(c, 0, &[mask(on)]);
            },
        ),
        case(
            S::LINE_RASTERIZATION_MODE_EXT,
            1,
            |options, on| edges(options, line_mode(on), None),
            // SAFETY: see above.
            |device, c, on| unsafe {
                device.states.cmd_set_line_rasterization_mode(c, line_mode(on));
            },
        ),
        case(
            S::LINE_STIPPLE_ENABLE_EXT,
            1,
            |options, on| edges(options, line_mode(false), on.then_some(0x3333)),
            // SAFETY: see above.
            |device, c, on| unsafe {
                device.states.cmd_set_line_stipple_enable(c, on);
            },
        ),
        case(
            S::LINE_STIPPLE_EXT,
            1,
            |options, on| edges(options, line_mode(false), Some(pattern(on))),
            // SAFETY: see above.
            |device, c, on| unsafe {
                (device.lines.fp().cmd_set_line_stipple_ext)(c, 1, pattern(on));
            },
        ),
        case(
            S::COLOR_WRITE_ENABLE_EXT,
            1,
            // A disabled attachment is equal to a write mask of no component.
            |options, on| {
                let all = vk::ColorComponentFlags::RGBA;
                let mask = if on { all } else { vk::ColorComponentFlags::empty() };
                options.blend = vec![blend(true).color_write_mask(mask)];
            },
            // SAFETY: see above.
            |device, c, on| unsafe {
                let enables: [vk::Bool32; 1] = [on.into()];
                (device.writes.fp().cmd_set_color_write_enable_ext)(c, 1, enables.as_ptr());
            },
        ),
    ]
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn what_is_set_is_as_what_a_pipeline_has() {
    let device = Device::new();
    let vertices = triangles();
    for case in cases() {
        let options = |on| {
            let mut options = PipelineOptions::default();
            (case.base)(&mut options);
            (case.fixed)(&mut options, on);
            options
        };
        let images = [false, true].map(|on| {
            let fixed = device.draw(case.samples, &options(on), &vertices, |commands| {
                commands.draw(0..6);
            });
            // The pipeline's own value is the opposite, except where that would write nothing or is not preserved.
            let own = match case.state {
                S::COLOR_WRITE_ENABLE_EXT => true,
                _ => !on,
            };
            let mut dynamic = options(own);
            dynamic.dynamic.push(case.state);
            let set = device.draw(case.samples, &dynamic, &vertices, |commands| {
                (case.set)(&device, commands.raw, on);
                commands.draw(0..6);
            });
            assert!(set == fixed, "{:?} {on}", case.state);
            fixed
        });
        assert!(images[0] != images[1], "{:?} has no effect", case.state);
    }
}

/// Vertex attributes that a command sets are read with their offsets and formats.
#[gaurast_runner::test(needs = [GLSLANG])]
fn vertex_input_is_set() {
    let device = Device::new();
    let vertices = triangles();
    let fixed = device.draw(1, &PipelineOptions::default(), &vertices, |commands| {
        commands.draw(0..3);
    });
    // The pipeline has no vertex input of its own.
    let options = PipelineOptions {
        vertex_bindings: Vec::new(),
        vertex_attributes: Vec::new(),
        dynamic: vec![S::VERTEX_INPUT_EXT],
        ..PipelineOptions::default()
    };
    let vec4 = vk::Format::R32G32B32A32_SFLOAT;
    let set = |commands: &Commands, stride: u32, color: u32| {
        let bindings = [vk::VertexInputBindingDescription2EXT::default()
            .binding(0)
            .stride(stride)
            .input_rate(vk::VertexInputRate::VERTEX)
            .divisor(1)];
        let attribute = |location, offset| {
            vk::VertexInputAttributeDescription2EXT::default().location(location).format(vec4).offset(offset)
        };
        // SAFETY: the command buffer records, and its device has the extension.
        unsafe {
            let attributes = [attribute(0, 0), attribute(1, color)];
            device.input.cmd_set_vertex_input(commands.raw, &bindings, &attributes);
        }
    };
    let dynamic = device.draw(1, &options, &vertices, |commands| {
        set(commands, 32, 16);
        commands.draw(0..3);
    });
    assert!(dynamic == fixed);
    let of_positions = device.draw(1, &options, &vertices, |commands| {
        set(commands, 32, 0);
        commands.draw(0..3);
    });
    assert!(of_positions != fixed);
    // Every other vertex.
    let sparse = device.draw(1, &options, &vertices, |commands| {
        set(commands, 64, 16);
        commands.draw(0..3);
    });
    let picked: Vec<Vertex> = vertices.iter().copied().step_by(2).collect();
    let expected = device.draw(1, &PipelineOptions::default(), &picked, |commands| {
        commands.draw(0..3);
    });
    assert!(sparse == expected);
}

/// A command of several draws equals several commands, and each draw has its `gl_DrawID`.
#[gaurast_runner::test(needs = [GLSLANG])]
fn several_draws_are_one_command() {
    let device = Device::new();
    let options = PipelineOptions {
        vertex: "#extension GL_ARB_shader_draw_parameters : require
            layout(location = 0) in vec4 position;
            layout(location = 1) in vec4 color;
            layout(location = 0) out vec4 drawn;
            void main() { gl_Position = position; drawn = vec4(color.rg, 0.25 * gl_DrawIDARB, 1.0); }",
        fragment: Some(
            "layout(location = 0) in vec4 drawn;
            layout(location = 0) out vec4 color;
            void main() { color = drawn; }",
        ),
        ..PipelineOptions::default()
    };
    let mut vertices = triangles();
    vertices.iter_mut().for_each(|it| it.position[2] = 0.5);
    let draws = [
        vk::MultiDrawInfoEXT::default().first_vertex(3).vertex_count(3),
        vk::MultiDrawInfoEXT::default().first_vertex(0).vertex_count(3),
    ];
    let blue = |pixels: &[u8], x: usize, y: usize| pixels[4 * (y * SIZE[0] as usize + x) + 2];
    let drawn = device.draw(1, &options, &vertices, |commands| {
        let stride = size_of::<vk::MultiDrawInfoEXT>() as u32;
        // SAFETY: the command buffer records, and its device has the extension.
        unsafe {
            let draw = device.multi.fp().cmd_draw_multi_ext;
            draw(commands.raw, 2, draws.as_ptr(), 1, 0, stride);
        }
    });
    assert_eq!((blue(&drawn, 4, 4), blue(&drawn, 28, 28)), (64, 0));

    let indices: Vec<u32> = vec![0, 1, 2, 0, 1, 2];
    let indices = Buffer::of(&device.gpu, &indices);
    let draws = [
        vk::MultiDrawIndexedInfoEXT::default().first_index(0).index_count(3).vertex_offset(3),
        vk::MultiDrawIndexedInfoEXT::default().first_index(3).index_count(3),
    ];
    let draw = |offset: Option<i32>| {
        device.draw(1, &options, &vertices, |commands| {
            commands.indices(&indices, 0, vk::IndexType::UINT32);
            let stride = size_of::<vk::MultiDrawIndexedInfoEXT>() as u32;
            // SAFETY: the command buffer records, and its device has the extension.
            unsafe {
                let offset = offset.as_ref().map_or(std::ptr::null(), std::ptr::from_ref);
                let draw = device.multi.fp().cmd_draw_multi_indexed_ext;
                draw(commands.raw, 2, draws.as_ptr(), 1, 0, stride, offset);
            }
        })
    };
    assert!(draw(None) == drawn);
    // One offset for both draws: both draw the second triangle.
    let both = draw(Some(3));
    assert_eq!((blue(&both, 4, 4), blue(&both, 28, 28)), (191, 64));
}

/// Restart in a list begins a new primitive at the index of all ones.
#[gaurast_runner::test(needs = [GLSLANG])]
fn lists_restart() {
    let device = Device::new();
    let vertices = triangles();
    let options = PipelineOptions { restart: true, ..PipelineOptions::default() };
    let indices: Vec<u32> = vec![0, 1, u32::MAX, 3, 4, 5];
    let indices = Buffer::of(&device.gpu, &indices);
    let restarted = device.draw(1, &options, &vertices, |commands| {
        commands.indices(&indices, 0, vk::IndexType::UINT32);
        commands.draw_indexed(0..6, 0);
    });
    let second = device.draw(1, &PipelineOptions::default(), &vertices, |commands| {
        commands.draw(3..6);
    });
    assert!(restarted == second);
}
