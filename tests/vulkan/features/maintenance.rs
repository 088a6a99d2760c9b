//! Maintenance: commands that take structures, longer words of flags, and relaxed rules.

use ash::vk;
use gaurast_testkit::descriptors::set_layout;
use gaurast_testkit::devices::{MAPPABLE, allocate};
use gaurast_testkit::newer::Flags;
use gaurast_testkit::shader::{GLSLANG, Stage, compile};
use gaurast_testkit::{
    Bindings, Buffer, Gpu, Graphics, Kernel, Pass, Pipeline, PipelineOptions, Resource, Shader, Target, Vertex, shapes,
};

/// A device with the sixth maintenance and pushed descriptors.
fn open() -> (Gpu, ash::khr::maintenance6::Device) {
    let mut features = vk::PhysicalDeviceMaintenance6FeaturesKHR::default().maintenance6(true);
    let names = [ash::khr::maintenance6::NAME, ash::khr::push_descriptor::NAME];
    let gpu = Gpu::extended(&names, &mut features).expect("a device");
    let commands = ash::khr::maintenance6::Device::new(gpu.instance(), gpu.device());
    (gpu, commands)
}

const KERNEL: &str = "
    layout(local_size_x = 4) in;
    layout(binding = 0) buffer Values { uint values[]; };
    layout(push_constant) uniform Push { uint first; uint step; };
    void main() { values[gl_LocalInvocationIndex] += first + step * gl_LocalInvocationIndex; }";

/// Sets and push constants are bound for graphics and compute by one command.
#[gaurast_runner::test(needs = [GLSLANG])]
fn sets_and_constants_are_bound_by_structures() {
    let (gpu, commands6) = open();
    let buffer = Buffer::of(&gpu, &[100u32; 4]);
    let bindings = Bindings::new(&gpu, &[Resource::Storage(buffer.raw)]);
    let kernel = Kernel::new(&gpu, KERNEL, &bindings);
    gpu.run(|commands| {
        let (device, raw) = commands.raw();
        let sets = [bindings.set];
        let stages = vk::ShaderStageFlags::ALL_GRAPHICS | vk::ShaderStageFlags::COMPUTE;
        let info =
            vk::BindDescriptorSetsInfoKHR::default().stage_flags(stages).layout(kernel.layout).descriptor_sets(&sets);
        let words = [5u32, 10].map(u32::to_le_bytes);
        let constants = vk::PushConstantsInfoKHR::default()
            .layout(kernel.layout)
            .stage_flags(vk::ShaderStageFlags::COMPUTE)
            .values(words.as_flattened());
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_pipeline(raw, vk::PipelineBindPoint::COMPUTE, kernel.raw);
            commands6.cmd_bind_descriptor_sets2(raw, &info);
            commands6.cmd_push_constants2(raw, &constants);
            device.cmd_dispatch(raw, 1, 1, 1);
        }
        commands.barrier();
    });
    assert_eq!(buffer.values::<u32>(), [105, 115, 125, 135]);
    assert_eq!(gpu.message_texts(), [""; 0]);
}

/// A buffer is pushed as a descriptor by a structure.
#[gaurast_runner::test(needs = [GLSLANG])]
fn descriptors_are_pushed_by_a_structure() {
    let (gpu, commands6) = open();
    let buffer = Buffer::of(&gpu, &[0u32; 4]);
    let flags = vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR;
    let layout = set_layout(&gpu, &[(0, vk::DescriptorType::STORAGE_BUFFER, 1)], flags);
    let kernel = Kernel::over(&gpu, &compile(Stage::Compute, KERNEL), &[layout]);
    gpu.run(|commands| {
        let (device, raw) = commands.raw();
        let buffers = [vk::DescriptorBufferInfo::default().buffer(buffer.raw).range(vk::WHOLE_SIZE)];
        let writes = [vk::WriteDescriptorSet::default()
            .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
            .buffer_info(&buffers)];
        let info = vk::PushDescriptorSetInfoKHR::default()
            .stage_flags(vk::ShaderStageFlags::COMPUTE)
            .layout(kernel.layout)
            .descriptor_writes(&writes);
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_pipeline(raw, vk::PipelineBindPoint::COMPUTE, kernel.raw);
            commands6.cmd_push_descriptor_set2(raw, &info);
        }
        kernel.push(raw, &[1, 2]);
        // SAFETY: see the crate.
        unsafe { device.cmd_dispatch(raw, 1, 1, 1) };
        commands.barrier();
    });
    assert_eq!(buffer.values::<u32>(), [1, 3, 5, 7]);
    assert_eq!(gpu.message_texts(), [""; 0]);
    // SAFETY: see the crate.
    unsafe { gpu.device().destroy_descriptor_set_layout(layout, None) };
}

/// Indices of a null buffer are zero: all corners are the first vertex, and nothing is drawn.
#[gaurast_runner::test(needs = [GLSLANG])]
fn indices_of_no_buffer_are_zero() {
    let (gpu, _) = open();
    let target = Target::floats(&gpu, [8; 2]);
    let options = PipelineOptions { topology: vk::PrimitiveTopology::POINT_LIST, ..PipelineOptions::default() };
    let pipeline = Pipeline::new(&gpu, &target, &options);
    let vertices = Buffer::of(&gpu, &shapes::rectangle([0.1, 0.1, 0.9, 0.9], 0.5, [1.0; 4]));
    gpu.run(|commands| {
        commands.pass(&target, &Pass::zeros(), || {
            commands.bind(&pipeline);
            commands.vertices(&vertices);
            commands.indices(vk::Buffer::null(), 0, vk::IndexType::UINT32);
            commands.draw_indexed(0..4, 0);
        });
    });
    let drawn = target.read::<[f32; 4]>().iter().filter(|pixel| **pixel == [1.0; 4]).count();
    assert_eq!(drawn, 1, "all points are the first vertex");
    assert_eq!(gpu.message_texts(), [""; 0]);
}

/// Each resource has its own result.
#[gaurast_runner::test]
fn each_binding_has_a_result() {
    let (gpu, _) = open();
    let device = gpu.device();
    let info = vk::BufferCreateInfo::default().size(256).usage(vk::BufferUsageFlags::TRANSFER_DST);
    let mut results = [vk::Result::NOT_READY; 3];
    // SAFETY: see the crate.
    unsafe {
        let buffers = [(); 3].map(|()| device.create_buffer(&info, None).expect("a buffer"));
        let memory = allocate(&gpu, 1024, MAPPABLE);
        let mut statuses = results.each_mut().map(|result| vk::BindMemoryStatusKHR::default().result(result));
        // The second is at no multiple of the alignment.
        let infos: Vec<_> = statuses
            .iter_mut()
            .zip(buffers)
            .zip([0, 257, 512])
            .map(|((status, buffer), offset)| {
                vk::BindBufferMemoryInfo::default()
                    .buffer(buffer)
                    .memory(memory)
                    .memory_offset(offset)
                    .push_next(status)
            })
            .collect();
        assert!(device.bind_buffer_memory2(&infos).is_err());
        drop(infos);
        assert_eq!([results[0], results[2]], [vk::Result::SUCCESS; 2]);
        assert!(results[1].as_raw() < 0, "{:?}", results[1]);
        buffers.into_iter().for_each(|buffer| device.destroy_buffer(buffer, None));
        device.free_memory(memory, None);
    }
}

/// Another index than the greatest restarts a strip, until an index buffer is bound.
#[gaurast_runner::test(needs = [GLSLANG])]
fn another_index_restarts_primitives() {
    const SIDE: usize = 16;
    let mut features = Flags::<1_000_678_000, 1>::new([vk::TRUE]);
    let gpu = Gpu::extended(&[c"VK_EXT_primitive_restart_index"], &mut features).expect("a device");
    // SAFETY: the function has this type.
    let set_index: unsafe extern "system" fn(vk::CommandBuffer, u32) = unsafe {
        let name = c"vkCmdSetPrimitiveRestartIndexEXT".as_ptr();
        let found = gpu.instance().get_device_proc_addr(gpu.device().handle(), name);
        std::mem::transmute(found.expect("the command"))
    };
    let target = Target::floats(&gpu, [SIDE as u32; 2]);
    let topology = vk::PrimitiveTopology::LINE_STRIP;
    let options = PipelineOptions { topology, restart: true, ..PipelineOptions::default() };
    let pipeline = Pipeline::new(&gpu, &target, &options);
    // Two rows of a line each, which vertex 7 joins unless the strip restarts there.
    let vertex = |x: f32, y: f32| Vertex { position: [x, y, 0.5, 1.0], color: [1.0; 4] };
    let (upper, middle, lower) = (-0.4375, 0.0625, 0.5625);
    let mut corners = vec![vertex(0.0, middle); 8];
    corners[..2].copy_from_slice(&[vertex(-0.9, upper), vertex(0.9, upper)]);
    corners[2..4].copy_from_slice(&[vertex(0.9, lower), vertex(-0.9, lower)]);
    let vertices = Buffer::of(&gpu, &corners);
    let indices = Buffer::of(&gpu, &[0u16, 1, 7, 2, 3]);
    let joined = |sets: bool, binds_again: bool| {
        gpu.run(|commands| {
            commands.pass(&target, &Pass::zeros(), || {
                commands.bind(&pipeline);
                commands.vertices(&vertices);
                commands.indices(&indices, 0, vk::IndexType::UINT16);
                if sets {
                    let (_, raw) = commands.raw();
                    // SAFETY: see the crate.
                    unsafe { set_index(raw, 7) };
                }
                if binds_again {
                    commands.indices(&indices, 0, vk::IndexType::UINT16);
                }
                commands.draw_indexed(0..5, 0);
            });
        });
        let pixels = target.read::<[f32; 4]>();
        let row = |y: usize| pixels[y * SIDE..(y + 1) * SIDE].iter().any(|pixel| pixel[0] > 0.0);
        assert!(row(4) && row(12), "both lines are drawn");
        row(8)
    };
    assert!(!joined(true, false), "the strip restarts");
    // The greatest index restarts, so that the strip goes through the middle.
    assert!(joined(false, false) && joined(true, true));
    assert_eq!(gpu.message_texts(), [""; 0]);
}

/// A device with the fifth maintenance and nothing else, and its commands.
fn open5() -> (Gpu, ash::khr::maintenance5::Device) {
    let mut features = vk::PhysicalDeviceMaintenance5FeaturesKHR::default().maintenance5(true);
    let gpu = Gpu::extended(&[ash::khr::maintenance5::NAME], &mut features).expect("a device");
    let commands = ash::khr::maintenance5::Device::new(gpu.instance(), gpu.device());
    (gpu, commands)
}

/// Points of one pixel, without a size and without shader modules: of four indices the last two are beyond the buffer's
/// range, and so zero.
#[gaurast_runner::test(needs = [GLSLANG])]
fn ranges_of_indices_end_and_points_have_a_size() {
    let (gpu, commands5) = open5();
    let target = Target::floats(&gpu, [8; 2]);
    let vertex = "void main() {
        gl_Position = vec4(0.25 * gl_VertexIndex - 0.9, 0.1, 0.0, 1.0);
    }";
    let fragment = "layout(location = 0) out vec4 color; void main() { color = vec4(1.0); }";
    let graphics = Graphics {
        shaders: vec![
            Shader::vertex(compile(Stage::Vertex, vertex)),
            Shader::fragment(compile(Stage::Fragment, fragment)),
        ],
        inline_modules: true,
        topology: vk::PrimitiveTopology::POINT_LIST,
        ..Graphics::default()
    };
    let pipeline = graphics.create(&gpu).expect("a pipeline");
    let indices = Buffer::of(&gpu, &[9u16, 1, 2, 3, 4]);
    gpu.run(|commands| {
        commands.pass(&target, &Pass::zeros(), || {
            commands.bind(&pipeline);
            let (_, raw) = commands.raw();
            // SAFETY: see the crate.
            unsafe { commands5.cmd_bind_index_buffer2(raw, indices.raw, 2, 4, vk::IndexType::UINT16) };
            commands.draw_indexed(0..4, 0);
        });
    });
    let pixels = target.read::<[f32; 4]>();
    let row: Vec<bool> = pixels[4 * 8..5 * 8].iter().map(|pixel| pixel[0] == 1.0).collect();
    assert_eq!(row, [true, true, true, false, false, false, false, false]);
    assert_eq!(pixels.iter().filter(|pixel| pixel[0] == 1.0).count(), 3);
    assert_eq!(gpu.message_texts(), [""; 0]);
}

/// Layouts of subresources are the same by each command, with an image and without.
#[gaurast_runner::test]
fn layouts_of_subresources_need_no_image() {
    let (gpu, commands5) = open5();
    let device = gpu.device();
    let info = vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(vk::Format::R8G8B8A8_UNORM)
        .extent(vk::Extent3D { width: 20, height: 12, depth: 1 })
        .mip_levels(3)
        .array_layers(2)
        .samples(vk::SampleCountFlags::TYPE_1)
        .tiling(vk::ImageTiling::LINEAR)
        .usage(vk::ImageUsageFlags::TRANSFER_DST);
    // SAFETY: see the crate.
    unsafe {
        let image = device.create_image(&info, None).expect("an image");
        for (mip_level, array_layer) in [(0, 0), (2, 1)] {
            let subresource = vk::ImageSubresource { aspect_mask: vk::ImageAspectFlags::COLOR, mip_level, array_layer };
            let expected = device.get_image_subresource_layout(image, subresource);
            let asked = vk::ImageSubresource2KHR::default().image_subresource(subresource);
            let mut of_image = vk::SubresourceLayout2KHR::default();
            commands5.get_image_subresource_layout2(image, &asked, &mut of_image);
            let of_device = vk::DeviceImageSubresourceInfoKHR::default().create_info(&info).subresource(&asked);
            let mut without_image = vk::SubresourceLayout2KHR::default();
            commands5.get_device_image_subresource_layout(&of_device, &mut without_image);
            for found in [of_image, without_image].map(|found| found.subresource_layout) {
                assert_eq!((found.offset, found.size), (expected.offset, expected.size));
                let pitches = |of: vk::SubresourceLayout| [of.row_pitch, of.array_pitch, of.depth_pitch];
                assert_eq!(pitches(found), pitches(expected));
            }
        }
        device.destroy_image(image, None);
        let area = vk::RenderingAreaInfoKHR::default();
        assert_eq!(commands5.get_rendering_area_granularity(&area), vk::Extent2D { width: 1, height: 1 });
    }
    assert_eq!(gpu.message_texts(), [""; 0]);
}

/// The longer words of flags are used in place of the shorter: a buffer has an address, and a pipeline that may not be
/// compiled is not.
#[gaurast_runner::test(needs = [GLSLANG])]
fn longer_words_of_flags_are_used() {
    let (gpu, _) = open5();
    let device = gpu.device();
    let words = compile(Stage::Compute, "layout(local_size_x = 1) in; void main() {}");
    // SAFETY: see the crate.
    unsafe {
        let mut usage =
            vk::BufferUsageFlags2CreateInfoKHR::default().usage(vk::BufferUsageFlags2KHR::SHADER_DEVICE_ADDRESS);
        let info = vk::BufferCreateInfo::default().size(64).push_next(&mut usage);
        let buffer = device.create_buffer(&info, None).expect("a buffer");
        let mut flags = vk::MemoryAllocateFlagsInfo::default().flags(vk::MemoryAllocateFlags::DEVICE_ADDRESS);
        let info =
            vk::MemoryAllocateInfo::default().allocation_size(1024).memory_type_index(MAPPABLE).push_next(&mut flags);
        let memory = device.allocate_memory(&info, None).expect("memory");
        device.bind_buffer_memory(buffer, memory, 0).expect("it is bound");
        let info = vk::BufferDeviceAddressInfo::default().buffer(buffer);
        assert_ne!(device.get_buffer_device_address(&info), 0);
        device.destroy_buffer(buffer, None);
        device.free_memory(memory, None);

        let layout = device.create_pipeline_layout(&vk::PipelineLayoutCreateInfo::default(), None).expect("a layout");
        let mut code = vk::ShaderModuleCreateInfo::default().code(&words);
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .name(c"main")
            .push_next(&mut code);
        let mut flags = vk::PipelineCreateFlags2CreateInfoKHR::default()
            .flags(vk::PipelineCreateFlags2KHR::FAIL_ON_PIPELINE_COMPILE_REQUIRED);
        let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout).push_next(&mut flags);
        let created = device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None);
        let refused = created.map_err(|(_, result)| result);
        assert_eq!(refused, Err(vk::Result::PIPELINE_COMPILE_REQUIRED));
        device.destroy_pipeline_layout(layout, None);
    }
    assert_eq!(gpu.message_texts(), [""; 0]);
}
