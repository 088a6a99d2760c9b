//! Gaussians by an application's own shaders. A vertex shader makes and projects them, here rings that wobble with
//! time. A resolve shader computes a colour from the accumulated values of each pixel: fog by the expected depth, and
//! tone mapping. It writes wobbling_gaussians.png, four moments side by side.

use ash::vk::{self, MemoryPropertyFlags as Memory, PipelineStageFlags as Stage};
use gaurast::{gaussian_primitive_topology, vk::*};

const SIZE: u32 = 256;
const FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;
const DRAWN: Stage = Stage::COLOR_ATTACHMENT_OUTPUT;

/// The moments that are drawn, in seconds.
const TIMES: [f32; 4] = [0.0, 0.7, 1.4, 2.1];
/// The number of Gaussians of a ring, and the number of rings.
const COUNTS: [u32; 2] = [96 * 24, 5];
const FOG: [f32; 4] = [0.55, 0.62, 0.72, 1.0];

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
            .gaussian_primitive_topology(true).vertex_shader_projection(true).resolve_fragment_shader(true);
        let mut features = vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true);
        let info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues).enabled_extension_names(&names)
            .push_next(&mut topology).push_next(&mut features);
        let device = instance.create_device(physical, &info, None)?;
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

        // The picture.
        let width = SIZE * TIMES.len() as u32;
        let (extent, one) = (vk::Extent2D { width, height: SIZE }, vk::SampleCountFlags::TYPE_1);
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

        // The pipeline: two shaders, and the locations of their outputs and inputs.
        let module = |code: &[u8]| {
            let code = ash::util::read_spv(&mut std::io::Cursor::new(code))?;
            let info = vk::ShaderModuleCreateInfo::default().code(&code);
            Ok::<_, Box<dyn std::error::Error>>(device.create_shader_module(&info, None)?)
        };
        let stage = |flags, module| {
            vk::PipelineShaderStageCreateInfo::default().stage(flags).module(module).name(c"main")
        };
        let (vertex, fragment) = (vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT);
        let stages = [
            stage(vertex, module(include_bytes!("shaders/wobbling_gaussians.vert.spv"))?),
            stage(fragment, module(include_bytes!("shaders/fog.frag.spv"))?),
        ];
        let mut gaussian = PipelineGaussianStateCreateInfoGAURAST::default()
            .projection_mode(GaussianProjectionModeGAURAST::VERTEX_SHADER)
            .vertex_output_locations(
                GaussianVertexOutputLocationsGAURAST::default().covariance(0).opacity(1).color(2))
            .resolve_input_locations(
                GaussianResolveInputLocationsGAURAST::default().accumulated_color(0).depth(1));
        let ranges = [vk::PushConstantRange::default().stage_flags(vertex).size(4)];
        let info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&ranges);
        let layout = device.create_pipeline_layout(&info, None)?;
        let vertices = vk::PipelineVertexInputStateCreateInfo::default();
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST);
        let area: [vk::Rect2D; 1] = [extent.into()];
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissors(&area);
        let dynamic = vk::PipelineDynamicStateCreateInfo::default()
            .dynamic_states(&[vk::DynamicState::VIEWPORT]);
        let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let samples = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(one);
        let rgba = vk::ColorComponentFlags::RGBA;
        let writes = [vk::PipelineColorBlendAttachmentState::default().color_write_mask(rgba)
            .blend_enable(true) // "Over": the shader's colours are premultiplied.
            .src_color_blend_factor(vk::BlendFactor::ONE)
            .dst_color_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)];
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

        // One command buffer: a draw for each moment, to its part of the picture.
        let pool = device.create_command_pool(&Default::default(), None)?;
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        let commands = device.allocate_command_buffers(&info)?;
        let barrier = vk::ImageMemoryBarrier::default().image(image).subresource_range(range)
            .new_layout(vk::ImageLayout::GENERAL).dst_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE);
        let target = [vk::RenderingAttachmentInfo::default().image_view(view)
            .image_layout(vk::ImageLayout::GENERAL).load_op(vk::AttachmentLoadOp::CLEAR)
            .clear_value(vk::ClearValue { color: vk::ClearColorValue { float32: FOG } })];
        let info = vk::RenderingInfo::default().render_area(area[0]).layer_count(1).color_attachments(&target);
        let to_host = vk::MemoryBarrier::default().dst_access_mask(vk::AccessFlags::HOST_READ)
            .src_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE);
        let no = vk::DependencyFlags::empty();
        device.begin_command_buffer(commands[0], &Default::default())?;
        device.cmd_pipeline_barrier(commands[0], Stage::TOP_OF_PIPE, DRAWN, no, &[], &[], &[barrier]);
        device.cmd_begin_rendering(commands[0], &info);
        device.cmd_bind_pipeline(commands[0], vk::PipelineBindPoint::GRAPHICS, pipeline);
        for (part, time) in TIMES.into_iter().enumerate() {
            let side = SIZE as f32;
            let viewport = vk::Viewport::default()
                .x(side * part as f32).width(side).height(side).max_depth(1.0);
            device.cmd_set_viewport(commands[0], 0, &[viewport]);
            device.cmd_push_constants(commands[0], layout, vertex, 0, &time.to_ne_bytes());
            device.cmd_draw(commands[0], COUNTS[0], COUNTS[1], 0, 0);
        }
        device.cmd_end_rendering(commands[0]);
        device.cmd_pipeline_barrier(commands[0], DRAWN, Stage::HOST, no, &[to_host], &[], &[]);
        device.end_command_buffer(commands[0])?;
        let submits = [vk::SubmitInfo::default().command_buffers(&commands)];
        device.queue_submit(device.get_device_queue(0, 0), &submits, vk::Fence::null())?;
        device.device_wait_idle()?;

        // Rows of a linear image may be padded.
        let plane = vk::ImageSubresource::default().aspect_mask(vk::ImageAspectFlags::COLOR);
        let rows = device.get_image_subresource_layout(image, plane);
        image::RgbImage::from_fn(width, SIZE, |x, y| {
            let offset = rows.offset + u64::from(y) * rows.row_pitch + u64::from(x) * 4;
            image::Rgb(pixels.add(offset as usize).cast::<[u8; 3]>().read())
        }).save("wobbling_gaussians.png")?;
    }
    Ok(())
}
