//! The Gaussian under the pointer: a resolve shader writes which one a pixel shows, and the point in space, as integers.
//! Each place is a draw of one pixel: the viewport is moved so that it falls on a pixel of a row of results. It prints
//! what is found.

use ash::vk::{self, MemoryPropertyFlags as Memory, PipelineStageFlags as Stage};
use gaurast::{gaussian_primitive_topology, vk::*};

/// Width and height of the window.
const SIZE: u32 = 256;
/// Vertex, and the bits of a point's x, y and z.
const FORMAT: vk::Format = vk::Format::R32G32B32A32_UINT;
const DRAWN: Stage = Stage::COLOR_ATTACHMENT_OUTPUT;

/// Places of the pointer, in pixels.
const POINTERS: [[u32; 2]; 5] = [[128, 128], [72, 128], [184, 128], [128, 70], [10, 10]];

/// Position, scale, rotation (w x y z), opacity, and the constant spherical harmonic's colour.
#[rustfmt::skip]
const GAUSSIANS: [[f32; 14]; 5] = [
    [ 0.0,  0.0, 3.0,  0.25, 0.25, 0.25,  1.0, 0.0, 0.0,  0.0,  0.9,   1.7,  1.2, -1.0],
    [-0.7,  0.0, 3.2,  0.10, 0.45, 0.10,  1.0, 0.0, 0.0,  0.2,  0.8,   1.7, -1.4, -1.2],
    [ 0.7,  0.0, 3.2,  0.10, 0.45, 0.10,  1.0, 0.0, 0.0,  0.2,  0.8,  -1.5, -0.6,  1.7],
    [ 0.0, -0.7, 3.2,  0.45, 0.10, 0.10,  1.0, 0.0, 0.0,  0.2,  0.8,  -1.2,  1.5, -0.8],
    [ 0.0,  0.7, 3.2,  0.45, 0.10, 0.10,  1.0, 0.0, 0.0,  0.2,  0.8,   0.9, -1.2,  1.6],
];

#[rustfmt::skip] // A step a line, so that a screen or two show everything.
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let through_loader = std::env::args().any(|argument| argument == "--loader");
    // SAFETY: the system's loader is sound. Handles are used while they are valid, structures are valid, commands are
    // in order, and the host touches memory only while the device is idle.
    unsafe {
        let entry = if through_loader { ash::Entry::load()? } else { vulkan_gaurast::entry() };

        // A device with the extension.
        let app = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default().application_info(&app);
        let instance = entry.create_instance(&info, None)?;
        let physical = instance.enumerate_physical_devices()?[0];
        let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
        let names = [gaussian_primitive_topology::NAME.as_ptr()];
        let mut topology = PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST::default()
            .gaussian_primitive_topology(true).resolve_fragment_shader(true).resolve_gaussian_indices(true);
        let mut features = vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true);
        let info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues).enabled_extension_names(&names)
            .push_next(&mut topology).push_next(&mut features);
        let device = instance.create_device(physical, &info, None)?;
        let extension = gaussian_primitive_topology::Device::new(&instance, &device);
        let types = instance.get_physical_device_memory_properties(physical);
        let allocate = |needs: vk::MemoryRequirements| {
            let index = (0..types.memory_type_count).find(|index| {
                let flags = types.memory_types[*index as usize].property_flags;
                needs.memory_type_bits & (1 << index) != 0
                    && flags.contains(Memory::HOST_VISIBLE | Memory::HOST_COHERENT)
            });
            let index = index.ok_or(vk::Result::ERROR_OUT_OF_HOST_MEMORY)?;
            let info = vk::MemoryAllocateInfo::default().allocation_size(needs.size).memory_type_index(index);
            let memory = device.allocate_memory(&info, None)?;
            let mapped = device.map_memory(memory, 0, vk::WHOLE_SIZE, Default::default())?;
            Ok::<_, vk::Result>((memory, mapped.cast::<u8>()))
        };

        // The Gaussians: an ordinary vertex buffer.
        let bytes: &[u8] = bytemuck::cast_slice(&GAUSSIANS);
        let info = vk::BufferCreateInfo::default().size(bytes.len() as u64);
        let buffer = device.create_buffer(&info.usage(vk::BufferUsageFlags::VERTEX_BUFFER), None)?;
        let (memory, mapped) = allocate(device.get_buffer_memory_requirements(buffer))?;
        device.bind_buffer_memory(buffer, memory, 0)?;
        mapped.copy_from(bytes.as_ptr(), bytes.len());

        // The results: a pixel for each place.
        let extent = vk::Extent2D { width: POINTERS.len() as u32, height: 1 };
        let one = vk::SampleCountFlags::TYPE_1;
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D).format(FORMAT).extent(extent.into())
            .mip_levels(1).array_layers(1).samples(one)
            .tiling(vk::ImageTiling::LINEAR).usage(vk::ImageUsageFlags::COLOR_ATTACHMENT);
        let image = device.create_image(&info, None)?;
        let (memory, results) = allocate(device.get_image_memory_requirements(image))?;
        device.bind_image_memory(image, memory, 0)?;
        let range = vk::ImageSubresourceRange::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR).level_count(1).layer_count(1);
        let info = vk::ImageViewCreateInfo::default().image(image)
            .view_type(vk::ImageViewType::TYPE_2D).format(FORMAT).subresource_range(range);
        let view = device.create_image_view(&info, None)?;

        // The pipeline: the shader, and the locations at which it reads what the rasterizer knows.
        let code = ash::util::read_spv(&mut std::io::Cursor::new(include_bytes!("shaders/pick.frag.spv")))?;
        let module = device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(&code), None)?;
        let fragment = vk::ShaderStageFlags::FRAGMENT;
        let stages = [vk::PipelineShaderStageCreateInfo::default().stage(fragment).module(module).name(c"main")];
        let bindings = [vk::VertexInputBindingDescription::default().stride(14 * 4)];
        let attribute = |location: u32, format, first: u32| {
            vk::VertexInputAttributeDescription { location, binding: 0, format, offset: 4 * first }
        };
        let (vec3, vec4) = (vk::Format::R32G32B32_SFLOAT, vk::Format::R32G32B32A32_SFLOAT);
        let attributes = [attribute(0, vec3, 0), attribute(1, vec3, 3), attribute(2, vec4, 6),
            attribute(3, vk::Format::R32_SFLOAT, 10), attribute(4, vec3, 11)];
        let mut gaussian = PipelineGaussianStateCreateInfoGAURAST::default()
            .attribute_locations(GaussianAttributeLocationsGAURAST::default()
                .position(0).scale(1).rotation(2).opacity(3).first_spherical_harmonics(4))
            .resolve_input_locations(GaussianResolveInputLocationsGAURAST::default()
                .median_gaussian(0).linear_depth(1).first_camera(2));
        let ranges = [vk::PushConstantRange::default().stage_flags(fragment).size(8)];
        let info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&ranges);
        let layout = device.create_pipeline_layout(&info, None)?;
        let vertices = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings).vertex_attribute_descriptions(&attributes);
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let dynamic = vk::PipelineDynamicStateCreateInfo::default()
            .dynamic_states(&[vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR]);
        let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let samples = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(one);
        let rgba = vk::ColorComponentFlags::RGBA;
        let writes = [vk::PipelineColorBlendAttachmentState::default().color_write_mask(rgba)];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&writes);
        let mut rendering = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&[FORMAT]);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages).vertex_input_state(&vertices).input_assembly_state(&assembly)
            .viewport_state(&viewport).rasterization_state(&raster)
            .multisample_state(&samples).color_blend_state(&blend)
            .dynamic_state(&dynamic).layout(layout)
            .push_next(&mut gaussian).push_next(&mut rendering);
        let pipelines = device.create_graphics_pipelines(Default::default(), &[info], None);
        let pipeline = pipelines.map_err(|(_, error)| error)?[0];

        // One command buffer: a camera at the origin that looks along +z, and a draw for each place.
        let pool = device.create_command_pool(&Default::default(), None)?;
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        let commands = device.allocate_command_buffers(&info)?;
        let barrier = vk::ImageMemoryBarrier::default().image(image).subresource_range(range)
            .new_layout(vk::ImageLayout::GENERAL).dst_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE);
        let nothing = vk::ClearValue { color: vk::ClearColorValue { uint32: [u32::MAX; 4] } };
        let target = [vk::RenderingAttachmentInfo::default().image_view(view).clear_value(nothing)
            .image_layout(vk::ImageLayout::GENERAL).load_op(vk::AttachmentLoadOp::CLEAR)];
        let info = vk::RenderingInfo::default()
            .render_area(extent.into()).layer_count(1).color_attachments(&target);
        let side = SIZE as f32;
        let camera = GaussianCameraGAURAST::default()
            .focal_length([side; 2]).principal_point([side / 2.0; 2]);
        let to_host = vk::MemoryBarrier::default().dst_access_mask(vk::AccessFlags::HOST_READ)
            .src_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE);
        let no = vk::DependencyFlags::empty();
        device.begin_command_buffer(commands[0], &Default::default())?;
        device.cmd_pipeline_barrier(commands[0], Stage::TOP_OF_PIPE, DRAWN, no, &[], &[], &[barrier]);
        device.cmd_begin_rendering(commands[0], &info);
        device.cmd_bind_pipeline(commands[0], vk::PipelineBindPoint::GRAPHICS, pipeline);
        device.cmd_bind_vertex_buffers(commands[0], 0, &[buffer], &[0]);
        extension.cmd_set_gaussian_cameras(commands[0], &[camera]);
        for (slot, [x, y]) in POINTERS.into_iter().enumerate() {
            let viewport = vk::Viewport::default().width(side).height(side).max_depth(1.0)
                .x(slot as f32 - x as f32).y(-(y as f32));
            let pixel = vk::Rect2D::default().extent(vk::Extent2D { width: 1, height: 1 })
                .offset(vk::Offset2D { x: slot as i32, y: 0 });
            let centre = [x, y].map(|place| place as f32 + 0.5);
            device.cmd_set_viewport(commands[0], 0, &[viewport]);
            device.cmd_set_scissor(commands[0], 0, &[pixel]);
            device.cmd_push_constants(commands[0], layout, fragment, 0, bytemuck::cast_slice(&centre));
            device.cmd_draw(commands[0], GAUSSIANS.len() as u32, 1, 0, 0);
        }
        device.cmd_end_rendering(commands[0]);
        device.cmd_pipeline_barrier(commands[0], DRAWN, Stage::HOST, no, &[to_host], &[], &[]);
        device.end_command_buffer(commands[0])?;
        let submits = [vk::SubmitInfo::default().command_buffers(&commands)];
        device.queue_submit(device.get_device_queue(0, 0), &submits, vk::Fence::null())?;
        device.device_wait_idle()?;

        // A linear image may begin behind the memory's first byte.
        let plane = vk::ImageSubresource::default().aspect_mask(vk::ImageAspectFlags::COLOR);
        let start = device.get_image_subresource_layout(image, plane).offset as usize;
        let results = results.add(start).cast::<[u32; 4]>();
        for (slot, [x, y]) in POINTERS.into_iter().enumerate() {
            let [vertex, point @ ..] = results.add(slot).read_unaligned();
            if vertex == u32::MAX {
                println!("({x}, {y}): nothing");
            } else {
                let [px, py, pz] = point.map(f32::from_bits);
                println!("({x}, {y}): Gaussian {vertex} at ({px:.2}, {py:.2}, {pz:.2})");
            }
        }
    }
    Ok(())
}
