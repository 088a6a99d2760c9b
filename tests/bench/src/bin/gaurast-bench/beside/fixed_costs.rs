//! Workloads that are many small commands: their cost is the driver's own.

use ash::vk;
use gaurast_testkit::{
    Bindings, Buffer, Gpu, Image, ImageOptions, Kernel, Pass, Pipeline, PipelineOptions, Resource, Target,
    TargetOptions, Vertex, depth_test, devices::COLOR_LAYERS, whole,
};

use super::workload::Workload;

/// Width and height of small targets.
const SMALL: [u32; 2] = [64; 2];

/// Prepares the workload of a name, if there is one.
pub(super) fn prepare(gpu: &Gpu, name: &str) -> Option<Workload> {
    Some(match name {
        "20,000 draws" => draws(gpu.clone(), 20_000),
        "2,000 descriptor sets" => descriptor_sets(gpu.clone(), 2000),
        "10,000 dispatches" => dispatches(gpu.clone(), 10_000),
        "500 image copies, timeline semaphores" => image_copies(gpu.clone(), 500),
        "blits between formats" => blits(gpu.clone()),
        _ => return None,
    })
}

/// A triangle of a few pixels.
fn triangle() -> [Vertex; 3] {
    [[-0.1, -0.1], [0.1, -0.1], [-0.1, 0.1]].map(|[x, y]| Vertex { position: [x, y, 0.5, 1.0], color: [1.0; 4] })
}

/// Records, submits and executes draws of a triangle of a few pixels, each with a scissor, a vertex buffer and push
/// constants of its own.
fn draws(gpu: Gpu, count: u32) -> Workload {
    let target = Target::new(&gpu, &TargetOptions { size: SMALL, ..TargetOptions::with_depth(vk::Format::D32_SFLOAT) });
    let options = PipelineOptions { depth_stencil: depth_test(vk::CompareOp::LESS), ..PipelineOptions::default() };
    let pipeline = Pipeline::new(&gpu, &target, &options);
    let vertices = Buffer::of(&gpu, &triangle().repeat(16));
    Workload::of(move || {
        gpu.run(|commands| {
            commands.pass(&target, &Pass::default(), || {
                commands.bind(&pipeline);
                for draw in 0..count {
                    commands.scissor([0, 0], SMALL);
                    commands.vertex_buffer(0, &vertices, u64::from(draw % 16) * size_of_val(&triangle()) as u64);
                    commands.push(0, &[draw]);
                    commands.draw(0..3);
                }
            });
        });
    })
}

/// Writes a descriptor set for each draw, binds it and draws.
fn descriptor_sets(gpu: Gpu, count: usize) -> Workload {
    let target = Target::new(&gpu, &TargetOptions { size: SMALL, ..TargetOptions::default() });
    let buffers = [0.25_f32, 0.75].map(|value| Buffer::of(&gpu, &[value; 64]));
    let first = Bindings::new(&gpu, &[Resource::Uniform(buffers[0].raw)]);
    let options = PipelineOptions {
        fragment: Some(
            "layout(set = 0, binding = 0) uniform Values { vec4 value; };
             layout(location = 0) in vec4 v_color;
             layout(location = 0) out vec4 color;
             void main() { color = v_color * value; }",
        ),
        bindings: Some(&first),
        ..PipelineOptions::default()
    };
    let pipeline = Pipeline::new(&gpu, &target, &options);
    let vertices = Buffer::of(&gpu, &triangle());
    let sets: Vec<_> = (0..count).map(|_| Bindings::new(&gpu, &[Resource::Uniform(buffers[0].raw)])).collect();
    let mut turn = 0;
    Workload::of(move || {
        turn += 1;
        for (index, set) in sets.iter().enumerate() {
            let info = [whole(&buffers[(index + turn) % 2])];
            let write = vk::WriteDescriptorSet::default()
                .dst_set(set.set)
                .descriptor_type(vk::DescriptorType::UNIFORM_BUFFER)
                .buffer_info(&info);
            // SAFETY: no submission is pending, and the buffer is of the same device.
            unsafe { gpu.device().update_descriptor_sets(&[write], &[]) };
        }
        let _ = &first;
        gpu.run(|commands| {
            commands.pass(&target, &Pass::default(), || {
                commands.bind(&pipeline);
                commands.vertices(&vertices);
                for set in &sets {
                    commands.bind_set(set, &[]);
                    commands.draw(0..3);
                }
            });
        });
    })
}

/// Records, submits and executes dispatches of one workgroup, with a barrier after each.
fn dispatches(gpu: Gpu, count: u32) -> Workload {
    let buffer = Buffer::of(&gpu, &[0_u32; 64]);
    let bindings = Bindings::new(&gpu, &[Resource::Storage(buffer.raw)]);
    let kernel = Kernel::new(
        &gpu,
        "layout(local_size_x = 64) in;
         layout(set = 0, binding = 0) buffer Values { uint values[]; };
         void main() { values[gl_LocalInvocationIndex] += gl_WorkGroupID.x + 1; }",
        &bindings,
    );
    Workload::of(move || {
        // A closure keeps only the fields that it names.
        let _ = (&buffer, &bindings);
        gpu.run(|commands| {
            for _ in 0..count {
                kernel.dispatch(commands, &[bindings.set], &[], [1, 1, 1]);
                commands.barrier();
            }
        });
    })
}

/// Submits copies of a small image one by one, each of which waits for the value of a timeline semaphore that the one
/// before signals.
fn image_copies(gpu: Gpu, count: u64) -> Workload {
    let options = ImageOptions::new(vk::Format::R8G8B8A8_UNORM, SMALL, vk::ImageUsageFlags::empty());
    let [from, to] = [0, 1].map(|_| Image::new(&gpu, &options));
    let extent = vk::Extent3D { width: SMALL[0], height: SMALL[1], depth: 1 };
    let region = [vk::ImageCopy::default().src_subresource(COLOR_LAYERS).dst_subresource(COLOR_LAYERS).extent(extent)];
    let copy = gpu.record(|commands| {
        let (device, buffer) = commands.raw();
        let layout = vk::ImageLayout::GENERAL;
        // SAFETY: the command buffer is recording, and both images are in this layout and of this size.
        unsafe { device.cmd_copy_image(buffer, from.raw, layout, to.raw, layout, &region) };
        commands.barrier();
    });
    let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
    let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
    // SAFETY: the structure is valid; the semaphore is destroyed with the process, which runs only this workload.
    let semaphores = [unsafe { gpu.device().create_semaphore(&info, None) }.expect("a timeline semaphore")];
    let mut value = 0;
    Workload::of(move || {
        let _ = (&from, &to, &copy);
        let (device, queue, buffers) = (gpu.device(), gpu.queue(), [copy.raw]);
        let stages = [vk::PipelineStageFlags::ALL_COMMANDS];
        for _ in 0..count {
            let (before, after) = ([value], [value + 1]);
            let mut values = vk::TimelineSemaphoreSubmitInfo::default()
                .wait_semaphore_values(&before)
                .signal_semaphore_values(&after);
            let submit = vk::SubmitInfo::default()
                .command_buffers(&buffers)
                .wait_semaphores(&semaphores)
                .wait_dst_stage_mask(&stages)
                .signal_semaphores(&semaphores)
                .push_next(&mut values);
            // SAFETY: the command buffer may be pending once: a later submission waits for the one before, which has
            // signalled when this thread waits below.
            unsafe {
                device.queue_submit(queue, &[submit], vk::Fence::null()).expect("it is submitted");
                let wait = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&after);
                device.wait_semaphores(&wait, u64::MAX).expect("it finishes");
            }
            value += 1;
        }
    })
}

/// Scales an image to half its size and changes its format, for each of four formats.
fn blits(gpu: Gpu) -> Workload {
    const SIDE: u32 = 512;
    let image = |format, side| Image::new(&gpu, &ImageOptions::new(format, [side; 2], vk::ImageUsageFlags::empty()));
    let formats = [
        vk::Format::R16G16B16A16_SFLOAT,
        vk::Format::R32_SFLOAT,
        vk::Format::A2B10G10R10_UNORM_PACK32,
        vk::Format::R8G8B8A8_SRGB,
    ];
    let pairs = formats.map(|format| (image(format, SIDE), image(vk::Format::R8G8B8A8_UNORM, SIDE / 2)));
    let corner = |side: u32| {
        let side = side.cast_signed();
        [vk::Offset3D::default(), vk::Offset3D { x: side, y: side, z: 1 }]
    };
    let region = [vk::ImageBlit::default()
        .src_subresource(COLOR_LAYERS)
        .src_offsets(corner(SIDE))
        .dst_subresource(COLOR_LAYERS)
        .dst_offsets(corner(SIDE / 2))];
    let recorded = gpu.record(|commands| {
        let (device, buffer) = commands.raw();
        let layout = vk::ImageLayout::GENERAL;
        for (from, to) in &pairs {
            // SAFETY: the command buffer is recording, and both images are in this layout and of these sizes.
            unsafe {
                device.cmd_blit_image(buffer, from.raw, layout, to.raw, layout, &region, vk::Filter::LINEAR);
            }
        }
        commands.barrier();
    });
    Workload::of(move || {
        let _ = &pairs;
        recorded.submit();
    })
}
