//! A minimal program with all stages of a draw: plain `ash` in one file. Only the entry is this driver's.
//!
//! The corners of an icosahedron become a ball of many triangles, whose edges are drawn: a tessellation control shader
//! chooses how finely each edge is divided, an evaluation shader places the points, and a geometry shader marks the
//! corners of each triangle. It writes hello_tessellation.png. It uses this driver or, with the argument `--loader`, the first device that the Vulkan
//! loader finds: the same program runs on both.

use ash::vk::{self, MemoryPropertyFlags as Memory, PipelineStageFlags as Stage, ShaderStageFlags as F};

const SIZE: u32 = 512;
const FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;
const DRAWN: Stage = Stage::COLOR_ATTACHMENT_OUTPUT;

/// The golden ratio, of which an icosahedron's corners are made.
const PHI: f32 = 1.618_034;

/// The corners, at the same distance from the middle.
#[rustfmt::skip]
const CORNERS: [[f32; 3]; 12] = [
    [-1.0, PHI, 0.0], [1.0, PHI, 0.0], [-1.0, -PHI, 0.0], [1.0, -PHI, 0.0],
    [0.0, -1.0, PHI], [0.0, 1.0, PHI], [0.0, -1.0, -PHI], [0.0, 1.0, -PHI],
    [PHI, 0.0, -1.0], [PHI, 0.0, 1.0], [-PHI, 0.0, -1.0], [-PHI, 0.0, 1.0],
];

/// The corners of the faces, counter-clockwise from outside.
#[rustfmt::skip]
const FACES: [[usize; 3]; 20] = [
    [0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6], [7, 1, 8],
    [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1],
];

#[rustfmt::skip] // A step a line, so that a screen or two show everything.
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let through_loader = std::env::args().any(|argument| argument == "--loader");
    // SAFETY: the system's loader is sound. Handles are used while they are valid, structures are valid, commands are
    // in order, and the host touches memory only while the device is idle.
    unsafe {
        let entry = if through_loader { ash::Entry::load()? } else { vulkan_gaurast::entry() };

        // A device with dynamic rendering, tessellation and geometry shaders.
        let app = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default().application_info(&app);
        let instance = entry.create_instance(&info, None)?;
        let physical = *instance.enumerate_physical_devices()?.first().ok_or("there is no Vulkan device")?;
        let name = instance.get_physical_device_properties(physical);
        println!("{}", name.device_name_as_c_str()?.to_string_lossy());
        let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
        let mut features = vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true);
        let core = vk::PhysicalDeviceFeatures::default().tessellation_shader(true).geometry_shader(true);
        let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues)
            .enabled_features(&core).push_next(&mut features);
        let device = instance.create_device(physical, &info, None)?;
        let types = instance.get_physical_device_memory_properties(physical);
        let allocate = |needs: vk::MemoryRequirements, wanted: Memory| {
            let index = (0..types.memory_type_count).find(|index| {
                let flags = types.memory_types[*index as usize].property_flags;
                needs.memory_type_bits & (1 << index) != 0 && flags.contains(wanted)
            });
            let index = index.ok_or(vk::Result::ERROR_OUT_OF_DEVICE_MEMORY)?;
            let info = vk::MemoryAllocateInfo::default().allocation_size(needs.size).memory_type_index(index);
            device.allocate_memory(&info, None)
        };
        let mapped_buffer = |size: u64, usage| {
            let info = vk::BufferCreateInfo::default().size(size).usage(usage);
            let buffer = device.create_buffer(&info, None)?;
            let needs = device.get_buffer_memory_requirements(buffer);
            let memory = allocate(needs, Memory::HOST_VISIBLE | Memory::HOST_COHERENT)?;
            device.bind_buffer_memory(buffer, memory, 0)?;
            let mapped = device.map_memory(memory, 0, vk::WHOLE_SIZE, Default::default())?;
            Ok::<_, vk::Result>((buffer, mapped.cast::<u8>()))
        };

        // The vertices, and the buffer to which the picture is copied.
        let length = (1.0 + PHI * PHI).sqrt();
        let patches = FACES.map(|face| face.map(|corner| CORNERS[corner].map(|axis| axis / length)));
        let bytes: &[u8] = bytemuck::cast_slice(&patches);
        let (vertices, mapped) = mapped_buffer(bytes.len() as u64, vk::BufferUsageFlags::VERTEX_BUFFER)?;
        mapped.copy_from(bytes.as_ptr(), bytes.len());
        let size = u64::from(SIZE * SIZE) * 4;
        let (copy, pixels) = mapped_buffer(size, vk::BufferUsageFlags::TRANSFER_DST)?;

        // The picture.
        let (extent, one) = (vk::Extent2D { width: SIZE, height: SIZE }, vk::SampleCountFlags::TYPE_1);
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D).format(FORMAT).extent(extent.into())
            .mip_levels(1).array_layers(1).samples(one)
            .usage(vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC);
        let image = device.create_image(&info, None)?;
        let memory = allocate(device.get_image_memory_requirements(image), Memory::empty())?;
        device.bind_image_memory(image, memory, 0)?;
        let range = vk::ImageSubresourceRange::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR).level_count(1).layer_count(1);
        let info = vk::ImageViewCreateInfo::default().image(image)
            .view_type(vk::ImageViewType::TYPE_2D).format(FORMAT).subresource_range(range);
        let view = device.create_image_view(&info, None)?;

        // The pipeline: five shaders, the attribute of a vertex, and the vertices of a patch.
        let module = |bytes: &[u8]| {
            let words = ash::util::read_spv(&mut std::io::Cursor::new(bytes))?;
            let info = vk::ShaderModuleCreateInfo::default().code(&words);
            Ok::<_, Box<dyn std::error::Error>>(device.create_shader_module(&info, None)?)
        };
        let stage = |stage, module| {
            vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(c"main")
        };
        let stages = [
            stage(F::VERTEX, module(include_bytes!("shaders/hello_tessellation.vert.spv"))?),
            stage(F::TESSELLATION_CONTROL, module(include_bytes!("shaders/hello_tessellation.tesc.spv"))?),
            stage(F::TESSELLATION_EVALUATION, module(include_bytes!("shaders/hello_tessellation.tese.spv"))?),
            stage(F::GEOMETRY, module(include_bytes!("shaders/hello_tessellation.geom.spv"))?),
            stage(F::FRAGMENT, module(include_bytes!("shaders/hello_tessellation.frag.spv"))?),
        ];
        let bindings = [vk::VertexInputBindingDescription::default().stride(3 * 4)];
        let attributes = [vk::VertexInputAttributeDescription::default().format(vk::Format::R32G32B32_SFLOAT)];
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings).vertex_attribute_descriptions(&attributes);
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(vk::PrimitiveTopology::PATCH_LIST);
        let tessellation = vk::PipelineTessellationStateCreateInfo::default().patch_control_points(3);
        let side = SIZE as f32;
        let (area, full) = ([extent.into()], [vk::Viewport::default().width(side).height(side).max_depth(1.0)]);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewports(&full).scissors(&area);
        let raster = vk::PipelineRasterizationStateCreateInfo::default()
            .line_width(1.0).cull_mode(vk::CullModeFlags::BACK);
        let samples = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(one);
        let rgba = vk::ColorComponentFlags::RGBA;
        let writes = [vk::PipelineColorBlendAttachmentState::default().color_write_mask(rgba)];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&writes);
        let mut rendering = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&[FORMAT]);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages).vertex_input_state(&vertex_input).input_assembly_state(&assembly)
            .tessellation_state(&tessellation)
            .viewport_state(&viewport).rasterization_state(&raster)
            .multisample_state(&samples).color_blend_state(&blend)
            .layout(device.create_pipeline_layout(&Default::default(), None)?)
            .push_next(&mut rendering);
        let pipelines = device.create_graphics_pipelines(Default::default(), &[info], None);
        let pipeline = pipelines.map_err(|(_, error)| error)?[0];

        // One command buffer: a draw and a copy.
        let pool = device.create_command_pool(&Default::default(), None)?;
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        let commands = device.allocate_command_buffers(&info)?;
        let (written, read) = (vk::AccessFlags::COLOR_ATTACHMENT_WRITE, vk::AccessFlags::TRANSFER_READ);
        let (attached, copied) = (vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL, vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
        let barrier = vk::ImageMemoryBarrier::default().image(image).subresource_range(range);
        let begin = barrier.new_layout(attached).dst_access_mask(written);
        let drawn = barrier.old_layout(attached).new_layout(copied).src_access_mask(written).dst_access_mask(read);
        let target = [vk::RenderingAttachmentInfo::default().image_view(view)
            .image_layout(attached).load_op(vk::AttachmentLoadOp::CLEAR)];
        let info = vk::RenderingInfo::default().render_area(area[0]).layer_count(1).color_attachments(&target);
        let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
        let region = vk::BufferImageCopy::default().image_subresource(layers).image_extent(extent.into());
        let to_host = vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::TRANSFER_WRITE).dst_access_mask(vk::AccessFlags::HOST_READ);
        let no = vk::DependencyFlags::empty();
        device.begin_command_buffer(commands[0], &Default::default())?;
        device.cmd_pipeline_barrier(commands[0], Stage::TOP_OF_PIPE, DRAWN, no, &[], &[], &[begin]);
        device.cmd_begin_rendering(commands[0], &info);
        device.cmd_bind_pipeline(commands[0], vk::PipelineBindPoint::GRAPHICS, pipeline);
        device.cmd_bind_vertex_buffers(commands[0], 0, &[vertices], &[0]);
        device.cmd_draw(commands[0], 3 * FACES.len() as u32, 1, 0, 0);
        device.cmd_end_rendering(commands[0]);
        device.cmd_pipeline_barrier(commands[0], DRAWN, Stage::TRANSFER, no, &[], &[], &[drawn]);
        device.cmd_copy_image_to_buffer(commands[0], image, copied, copy, &[region]);
        device.cmd_pipeline_barrier(commands[0], Stage::TRANSFER, Stage::HOST, no, &[to_host], &[], &[]);
        device.end_command_buffer(commands[0])?;
        let submits = [vk::SubmitInfo::default().command_buffers(&commands)];
        device.queue_submit(device.get_device_queue(0, 0), &submits, vk::Fence::null())?;
        device.device_wait_idle()?;

        image::RgbImage::from_fn(SIZE, SIZE, |x, y| {
            let offset = (y * SIZE + x) as usize * 4;
            image::Rgb(pixels.add(offset).cast::<[u8; 3]>().read())
        }).save("hello_tessellation.png")?;
    }
    Ok(())
}
