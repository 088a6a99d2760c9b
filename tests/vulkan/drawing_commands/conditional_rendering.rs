//! Conditional rendering: a word of a buffer switches draws, dispatches and clears of attachments off, and nothing else.

use ash::vk;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{
    Bindings, Buffer, Commands, Gpu, Kernel, Pass, Pipeline, PipelineOptions, Resource, Target, TargetOptions, Vertex,
};

/// The words that decide, and the flags that go with each; then whether commands are executed.
const CASES: [(u32, vk::ConditionalRenderingFlagsEXT, bool); 4] = [
    (0, vk::ConditionalRenderingFlagsEXT::empty(), false),
    (0x8000_0000, vk::ConditionalRenderingFlagsEXT::empty(), true),
    (0, vk::ConditionalRenderingFlagsEXT::INVERTED, true),
    (7, vk::ConditionalRenderingFlagsEXT::INVERTED, false),
];

struct Device {
    gpu: Gpu,
    commands: ash::ext::conditional_rendering::Device,
}

impl Device {
    fn new() -> Self {
        let mut features = vk::PhysicalDeviceConditionalRenderingFeaturesEXT::default()
            .conditional_rendering(true)
            .inherited_conditional_rendering(true);
        let gpu = Gpu::extended(&[ash::ext::conditional_rendering::NAME], &mut features).expect("a device");
        let commands = ash::ext::conditional_rendering::Device::new(gpu.instance(), gpu.device());
        Self { gpu, commands }
    }

    /// Records commands that the second word of a buffer decides on.
    fn when(
        &self,
        commands: vk::CommandBuffer,
        words: &Buffer,
        flags: vk::ConditionalRenderingFlagsEXT,
        record: impl FnOnce(),
    ) {
        let info = vk::ConditionalRenderingBeginInfoEXT::default().buffer(words.raw).offset(4).flags(flags);
        // SAFETY: the command buffer records, its device has the extension, and the buffer is alive.
        unsafe {
            let functions = self.commands.fp();
            (functions.cmd_begin_conditional_rendering_ext)(commands, &info);
            record();
            (functions.cmd_end_conditional_rendering_ext)(commands);
        }
    }
}

/// Dispatches, direct and indirect, add to a number; a fill between them is executed whatever the word.
#[gaurast_runner::test(needs = [GLSLANG])]
fn dispatches_are_executed_or_not() {
    let device = Device::new();
    let gpu = &device.gpu;
    for (word, flags, executed) in CASES {
        let words = Buffer::of(gpu, &[!word, word]);
        let counts = Buffer::of(gpu, &[0u32, 0]);
        let groups = Buffer::of(gpu, &[2u32, 1, 1]);
        let bindings = Bindings::new(gpu, &[Resource::Storage(counts.raw)]);
        let kernel = Kernel::new(
            gpu,
            "layout(local_size_x = 1) in;
            layout(binding = 0) buffer Counts { uint counts[2]; };
            void main() { atomicAdd(counts[0], 1); }",
            &bindings,
        );
        gpu.run(|commands: &Commands| {
            device.when(commands.raw, &words, flags, || {
                kernel.dispatch(commands, &[bindings.set], &[], [3, 1, 1]);
                // SAFETY: the command buffer records, and the buffers are alive.
                unsafe {
                    let device = commands.device();
                    device.cmd_dispatch_indirect(commands.raw, groups.raw, 0);
                    device.cmd_fill_buffer(commands.raw, counts.raw, 4, 4, 9);
                }
            });
            commands.barrier();
            // It holds until its end.
            kernel.dispatch(commands, &[bindings.set], &[], [10, 1, 1]);
        });
        let expected = if executed { 15 } else { 10 };
        assert_eq!(counts.values::<u32>(), [expected, 9], "{word} {flags:?}");
    }
}

/// The device writes the word in the same submission; draws and clears of attachments go by it, clears of images don't.
#[gaurast_runner::test(needs = [GLSLANG])]
fn draws_and_clears_go_by_what_the_device_wrote() {
    let device = Device::new();
    let gpu = &device.gpu;
    let vertex = |x: f32, y: f32| Vertex { position: [x, y, 0.5, 1.0], color: [1.0, 0.0, 0.0, 1.0] };
    let corners = [vertex(-1.0, -1.0), vertex(3.0, -1.0), vertex(-1.0, 3.0)];
    let vertices = Buffer::of(gpu, &corners);
    for (word, flags, executed) in CASES {
        for clears in [false, true] {
            let target =
                Target::new(gpu, &TargetOptions { size: [4, 4], ..TargetOptions::of(vk::Format::R8G8B8A8_UNORM) });
            let pipeline = Pipeline::new(gpu, &target, &PipelineOptions::default());
            let words = Buffer::of(gpu, &[!word, !word]);
            let pass = Pass { color: vk::ClearColorValue { float32: [0.0, 1.0, 0.0, 1.0] }, ..Pass::default() };
            gpu.run(|commands| {
                // SAFETY: the command buffer records, and the buffer is alive.
                unsafe {
                    let device = commands.device();
                    device.cmd_fill_buffer(commands.raw, words.raw, 4, 4, word);
                }
                commands.barrier();
                commands.pass(&target, &pass, || {
                    device.when(commands.raw, &words, flags, || {
                        if clears {
                            let clear =
                                vk::ClearAttachment::default().aspect_mask(vk::ImageAspectFlags::COLOR).clear_value(
                                    vk::ClearValue { color: vk::ClearColorValue { float32: [1.0, 0.0, 0.0, 1.0] } },
                                );
                            let rect = vk::ClearRect::default()
                                .rect(vk::Rect2D::default().extent(vk::Extent2D { width: 4, height: 4 }))
                                .layer_count(1);
                            // SAFETY: the command buffer records within a pass.
                            unsafe {
                                let device = commands.device();
                                device.cmd_clear_attachments(commands.raw, &[clear], &[rect]);
                            }
                        } else {
                            commands.bind(&pipeline);
                            commands.vertices(&vertices);
                            commands.draw(0..3);
                        }
                    });
                });
            });
            let expected = if executed { [255, 0, 0, 255] } else { [0, 255, 0, 255] };
            let pixels = target.colors[0].colors::<[u8; 4]>();
            assert_eq!(pixels, [expected; 16], "{word} {flags:?} {clears}");
        }
    }
}
