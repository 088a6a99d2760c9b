//! A minimal program that draws 3D Gaussians: plain `ash` in one file. It writes hello_gaussians.png. The end of the
//! process frees the objects; the crate `gaurast-render` (`api/render`) destroys its own.

use ash::vk::{self, MemoryPropertyFlags as Memory, PipelineStageFlags as Stage};
use gaurast::{gaussian_primitive_topology, vk::*};

const SIZE: u32 = 256;
const FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;
const DRAWN: Stage = Stage::COLOR_ATTACHMENT_OUTPUT;

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
            .gaussian_primitive_topology(true);
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

        // The picture.
        let (extent, one) = (vk::Extent2D { width: SIZE, height: SIZE }, vk::SampleCountFlags::TYPE_1);
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D).format(FORMAT).extent(extent.into())
            .mip_levels(1).array_layers(1).samples(one)
            .tiling(vk::ImageTiling::LINEAR).usage(vk::ImageUsageFlags::COLOR_ATTACHMENT);
        let image = device.create_image(&info, None)?;
        let (memory, pixels) = allocate(device.get_image_memory_requirements(image))?;
        device.bind_image_memory(image, memory, 0)?;
        let range = vk::ImageSubresourceRange::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR).level_count(1).layer_count(1);
        let info = vk::ImageViewCreateInfo::default().image(image)
            .view_type(vk::ImageViewType::TYPE_2D).format(FORMAT).subresource_range(range);
        let view = device.create_image_view(&info, None)?;

        // The pipeline: no shaders, but the topology and the attributes of a Gaussian.
        let bindings = [vk::VertexInputBindingDescription::default().stride(14 * 4)];
        let attribute = |location: u32, format, first: u32| {
            vk::VertexInputAttributeDescription { location, binding: 0, format, offset: 4 * first }
        };
        let (vec3, vec4) = (vk::Format::R32G32B32_SFLOAT, vk::Format::R32G32B32A32_SFLOAT);
        let attributes = [attribute(0, vec3, 0), attribute(1, vec3, 3), attribute(2, vec4, 6),
            attribute(3, vk::Format::R32_SFLOAT, 10), attribute(4, vec3, 11)];
        let mut gaussian = PipelineGaussianStateCreateInfoGAURAST::default().attribute_locations(
            GaussianAttributeLocationsGAURAST::default()
                .position(0).scale(1).rotation(2).opacity(3).first_spherical_harmonics(4));
        let vertices = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings).vertex_attribute_descriptions(&attributes);
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST);
        let side = SIZE as f32;
        let (area, full) = ([extent.into()], [vk::Viewport::default().width(side).height(side).max_depth(1.0)]);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewports(&full).scissors(&area);
        let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let samples = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(one);
        let rgba = vk::ColorComponentFlags::RGBA;
        let writes = [vk::PipelineColorBlendAttachmentState::default().color_write_mask(rgba)];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&writes);
        let mut rendering = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&[FORMAT]);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .vertex_input_state(&vertices).input_assembly_state(&assembly)
            .viewport_state(&viewport).rasterization_state(&raster)
            .multisample_state(&samples).color_blend_state(&blend)
            .layout(device.create_pipeline_layout(&Default::default(), None)?)
            .push_next(&mut gaussian).push_next(&mut rendering);
        let pipelines = device.create_graphics_pipelines(Default::default(), &[info], None);
        let pipeline = pipelines.map_err(|(_, error)| error)?[0];

        // One command buffer: a camera at the origin that looks along +z, and a draw.
        let pool = device.create_command_pool(&Default::default(), None)?;
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        let commands = device.allocate_command_buffers(&info)?;
        let barrier = vk::ImageMemoryBarrier::default().image(image).subresource_range(range)
            .new_layout(vk::ImageLayout::GENERAL).dst_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE);
        let target = [vk::RenderingAttachmentInfo::default().image_view(view)
            .image_layout(vk::ImageLayout::GENERAL).load_op(vk::AttachmentLoadOp::CLEAR)];
        let info = vk::RenderingInfo::default().render_area(area[0]).layer_count(1).color_attachments(&target);
        let camera = GaussianCameraGAURAST::default().focal_length([side; 2]).principal_point([side / 2.0; 2]);
        let to_host = vk::MemoryBarrier::default().dst_access_mask(vk::AccessFlags::HOST_READ)
            .src_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE);
        let no = vk::DependencyFlags::empty();
        device.begin_command_buffer(commands[0], &Default::default())?;
        device.cmd_pipeline_barrier(commands[0], Stage::TOP_OF_PIPE, DRAWN, no, &[], &[], &[barrier]);
        device.cmd_begin_rendering(commands[0], &info);
        device.cmd_bind_pipeline(commands[0], vk::PipelineBindPoint::GRAPHICS, pipeline);
        device.cmd_bind_vertex_buffers(commands[0], 0, &[buffer], &[0]);
        extension.cmd_set_gaussian_cameras(commands[0], &[camera]);
        device.cmd_draw(commands[0], GAUSSIANS.len() as u32, 1, 0, 0);
        device.cmd_end_rendering(commands[0]);
        device.cmd_pipeline_barrier(commands[0], DRAWN, Stage::HOST, no, &[to_host], &[], &[]);
        device.end_command_buffer(commands[0])?;
        let submits = [vk::SubmitInfo::default().command_buffers(&commands)];
        device.queue_submit(device.get_device_queue(0, 0), &submits, vk::Fence::null())?;
        device.device_wait_idle()?;

        // Rows of a linear image may be padded. Without its premultiplied alpha, the picture is over black.
        let plane = vk::ImageSubresource::default().aspect_mask(vk::ImageAspectFlags::COLOR);
        let layout = device.get_image_subresource_layout(image, plane);
        image::RgbImage::from_fn(SIZE, SIZE, |x, y| {
            let offset = layout.offset + u64::from(y) * layout.row_pitch + u64::from(x) * 4;
            image::Rgb(pixels.add(offset as usize).cast::<[u8; 3]>().read())
        }).save("hello_gaussians.png")?;
    }
    Ok(())
}
