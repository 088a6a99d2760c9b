//! Vulkan code that draws one small picture at a time. The end of the process frees the objects.

use std::error::Error;

use ash::vk::{self, MemoryPropertyFlags as Memory, PipelineStageFlags as Stage};
use gaurast::gaussian_primitive_topology;
use gaurast::vk::*;
use image::{Rgb, RgbImage};

const COLOR: vk::Format = vk::Format::R8G8B8A8_UNORM;
const DEPTH: vk::Format = vk::Format::D32_SFLOAT;
/// The first location of the model matrix, which has three rows.
const MODEL_MATRIX: u32 = 5;
const MODEL_OPACITY: u32 = 8;

/// The size in bytes of the vertex shader's constants: the picture's size and the focal lengths.
const CONSTANTS: u32 = 16;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// A Gaussian: position, scale, rotation (w x y z), opacity, and the coefficient of the constant spherical harmonic.
pub type Splat = [f32; 14];

/// The rows of a model matrix, and an opacity factor.
pub type Instance = [f32; 13];

/// A triangle of one depth: the position, from -1 to 1, and the colour of each corner.
pub struct Triangle {
    pub corners: [[f32; 5]; 3],
    pub depth: f32,
}

/// The contents of a picture and the mode of drawing.
pub struct Picture<'a> {
    pub size: [u32; 2],
    pub camera: GaussianCameraGAURAST<'static>,
    pub state: PipelineGaussianStateCreateInfoGAURAST<'static>,
    pub splats: &'a [Splat],
    /// The placements of the Gaussians; all are drawn once for each.
    pub instances: &'a [Instance],
    /// A triangle that is drawn before the Gaussians, which are tested against its depth.
    pub triangle: Option<Triangle>,
    pub samples: vk::SampleCountFlags,
    /// The number of Gaussians of each draw; empty if one draw has all.
    pub draws: &'a [u32],
    /// True if the draws are one sorted set.
    pub share_a_set: bool,
    /// True if a vertex shader projects the Gaussians.
    pub by_shader: bool,
    /// The resolve shader, if there is one.
    pub resolve: Option<Resolve>,
    /// True if alpha becomes coverage.
    pub coverage: bool,
}

/// A resolve shader.
#[derive(Clone, Copy)]
pub enum Resolve {
    /// Tone mapping with an edge.
    Tones = 0,
    /// Colours for the expected depth.
    Expected = 1,
    /// Colours for the median depth.
    Median = 2,
}

/// A device with the extension, and the objects that all pictures share.
pub struct Gpu {
    device: ash::Device,
    extension: gaussian_primitive_topology::Device,
    types: vk::PhysicalDeviceMemoryProperties,
    pool: vk::CommandPool,
    layout: vk::PipelineLayout,
}

/// An image and its view.
#[derive(Clone, Copy)]
struct Image {
    raw: vk::Image,
    view: vk::ImageView,
    pixels: *const u8,
}

// SAFETY of all `unsafe` here: handles are used while they are valid, structures are valid, commands are in order, and
// the host touches memory only while the device is idle.
impl Gpu {
    pub fn new(entry: &ash::Entry) -> Outcome<Self> {
        let app = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default().application_info(&app);
        let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
        let names = [gaussian_primitive_topology::NAME.as_ptr()];
        let mut gaussian = PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST::default();
        let mut rendering = vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true);
        // SAFETY: see above.
        unsafe {
            let instance = entry.create_instance(&info, None)?;
            let physical = instance.enumerate_physical_devices()?[0];
            let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut gaussian);
            instance.get_physical_device_features2(physical, &mut all);
            // All modes that the device has.
            gaussian.p_next = std::ptr::null_mut();
            let info = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .enabled_extension_names(&names)
                .push_next(&mut gaussian)
                .push_next(&mut rendering);
            let device = instance.create_device(physical, &info, None)?;
            let constants =
                [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::VERTEX).size(CONSTANTS)];
            let info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&constants);
            Ok(Self {
                layout: device.create_pipeline_layout(&info, None)?,
                extension: gaussian_primitive_topology::Device::new(&instance, &device),
                types: instance.get_physical_device_memory_properties(physical),
                pool: device.create_command_pool(&Default::default(), None)?,
                device,
            })
        }
    }

    /// Draws a picture over a dark background.
    pub fn draw(&self, picture: &Picture<'_>) -> Outcome<RgbImage> {
        let target = self.image(picture, COLOR, vk::SampleCountFlags::TYPE_1)?;
        let color = match picture.samples {
            vk::SampleCountFlags::TYPE_1 => target,
            samples => self.image(picture, COLOR, samples)?,
        };
        let depth = self.image(picture, DEPTH, picture.samples)?;
        let splats = self.buffer(bytemuck::cast_slice(picture.splats))?;
        let instances = self.buffer(bytemuck::cast_slice(picture.instances))?;
        let gaussians = self.gaussian_pipeline(picture)?;
        let triangles = self.triangle_pipeline(picture)?;
        let extent = extent(picture);
        let mut color_info = vk::RenderingAttachmentInfo::default()
            .image_view(color.view)
            .image_layout(vk::ImageLayout::GENERAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .clear_value(vk::ClearValue { color: vk::ClearColorValue { float32: [0.03, 0.035, 0.05, 1.0] } });
        if picture.samples != vk::SampleCountFlags::TYPE_1 {
            color_info = color_info
                .resolve_mode(vk::ResolveModeFlags::AVERAGE)
                .resolve_image_view(target.view)
                .resolve_image_layout(vk::ImageLayout::GENERAL);
        }
        let colors = [color_info];
        let depth_info = vk::RenderingAttachmentInfo::default()
            .image_view(depth.view)
            .image_layout(vk::ImageLayout::GENERAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .clear_value(vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 1.0, stencil: 0 } });
        let info = vk::RenderingInfo::default()
            .render_area(extent.into())
            .layer_count(1)
            .color_attachments(&colors)
            .depth_attachment(&depth_info);
        let point = vk::PipelineBindPoint::GRAPHICS;
        self.run(&[(target, COLOR), (color, COLOR), (depth, DEPTH)], |c| {
            let device = &self.device;
            // SAFETY: see above.
            unsafe {
                device.cmd_begin_rendering(c, &info);
                if let Some(triangle) = &picture.triangle {
                    let corners = self.buffer(bytemuck::cast_slice(&triangle.corners))?;
                    let depths = [triangle.depth; 2];
                    device.cmd_bind_pipeline(c, point, triangles);
                    device.cmd_set_viewport(c, 0, &[viewport(picture, depths)]);
                    device.cmd_bind_vertex_buffers(c, 0, &[corners], &[0]);
                    device.cmd_draw(c, 3, 1, 0, 0);
                }
                device.cmd_bind_pipeline(c, point, gaussians);
                device.cmd_set_viewport(c, 0, &[viewport(picture, [0.0, 1.0])]);
                device.cmd_bind_vertex_buffers(c, 0, &[splats, instances], &[0; 2]);
                self.extension.cmd_set_gaussian_cameras(c, &[picture.camera]);
                let [fx, fy] = picture.camera.focal_length;
                let [width, height] = picture.size.map(|side| side as f32);
                let (vertex, constants) = (vk::ShaderStageFlags::VERTEX, [width, height, fx, fy]);
                let constants = bytemuck::bytes_of(&constants);
                device.cmd_push_constants(c, self.layout, vertex, 0, constants);
                let all = [picture.splats.len() as u32];
                let draws = if picture.draws.is_empty() { &all } else { picture.draws };
                let (mut first, instances) = (0, picture.instances.len().max(1) as u32);
                if picture.share_a_set {
                    self.extension.cmd_begin_gaussian_set(c);
                }
                for &count in draws {
                    device.cmd_draw(c, count, instances, first, 0);
                    first += count;
                }
                if picture.share_a_set {
                    self.extension.cmd_end_gaussian_set(c);
                }
                device.cmd_end_rendering(c);
            }
            Ok(())
        })?;
        let plane = vk::ImageSubresource::default().aspect_mask(vk::ImageAspectFlags::COLOR);
        // SAFETY: see above; the rows of a linear image are in its memory as its layout says.
        unsafe {
            let layout = (self.device).get_image_subresource_layout(target.raw, plane);
            let [width, height] = picture.size;
            Ok(RgbImage::from_fn(width, height, |x, y| {
                let offset = layout.offset + u64::from(y) * layout.row_pitch + u64::from(x) * 4;
                Rgb(target.pixels.add(offset as usize).cast::<[u8; 3]>().read())
            }))
        }
    }

    /// Records transitions of images and then commands, and waits until they have run.
    fn run(
        &self,
        images: &[(Image, vk::Format)],
        record: impl FnOnce(vk::CommandBuffer) -> Outcome<()>,
    ) -> Outcome<()> {
        let info = vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
        let barriers: Vec<_> = (images.iter())
            .map(|&(image, format)| {
                vk::ImageMemoryBarrier::default()
                    .image(image.raw)
                    .subresource_range(range(format))
                    .new_layout(vk::ImageLayout::GENERAL)
                    .dst_access_mask(vk::AccessFlags::MEMORY_WRITE)
            })
            .collect();
        let to_host = vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE)
            .dst_access_mask(vk::AccessFlags::HOST_READ);
        let (device, no) = (&self.device, vk::DependencyFlags::empty());
        let all = Stage::ALL_COMMANDS;
        // SAFETY: see above.
        unsafe {
            let commands = device.allocate_command_buffers(&info)?;
            let c = commands[0];
            device.begin_command_buffer(c, &Default::default())?;
            device.cmd_pipeline_barrier(c, Stage::TOP_OF_PIPE, all, no, &[], &[], &barriers);
            record(c)?;
            device.cmd_pipeline_barrier(c, all, Stage::HOST, no, &[to_host], &[], &[]);
            device.end_command_buffer(c)?;
            let submits = [vk::SubmitInfo::default().command_buffers(&commands)];
            let queue = device.get_device_queue(0, 0);
            device.queue_submit(queue, &submits, vk::Fence::null())?;
            Ok(device.device_wait_idle()?)
        }
    }

    /// Mapped memory for an object.
    fn allocate(&self, needs: vk::MemoryRequirements) -> Outcome<(vk::DeviceMemory, *mut u8)> {
        let types = &self.types;
        let index = (0..types.memory_type_count).find(|index| {
            let flags = types.memory_types[*index as usize].property_flags;
            needs.memory_type_bits & (1 << index) != 0 && flags.contains(Memory::HOST_VISIBLE | Memory::HOST_COHERENT)
        });
        let info = vk::MemoryAllocateInfo::default()
            .allocation_size(needs.size)
            .memory_type_index(index.ok_or("no memory that the host sees")?);
        // SAFETY: see above.
        unsafe {
            let memory = self.device.allocate_memory(&info, None)?;
            let (whole, no) = (vk::WHOLE_SIZE, Default::default());
            Ok((memory, self.device.map_memory(memory, 0, whole, no)?.cast()))
        }
    }

    /// A vertex buffer with `bytes`; it has a minimum size if they are empty.
    fn buffer(&self, bytes: &[u8]) -> Outcome<vk::Buffer> {
        let info =
            vk::BufferCreateInfo::default().size(bytes.len().max(64) as u64).usage(vk::BufferUsageFlags::VERTEX_BUFFER);
        // SAFETY: see above.
        unsafe {
            let buffer = self.device.create_buffer(&info, None)?;
            let needs = self.device.get_buffer_memory_requirements(buffer);
            let (memory, mapped) = self.allocate(needs)?;
            self.device.bind_buffer_memory(buffer, memory, 0)?;
            mapped.copy_from(bytes.as_ptr(), bytes.len());
            Ok(buffer)
        }
    }

    /// An attachment of a picture's size. A colour attachment with one sample can be read.
    fn image(&self, picture: &Picture<'_>, format: vk::Format, samples: vk::SampleCountFlags) -> Outcome<Image> {
        let (usage, tiling) = match (format, samples) {
            (DEPTH, _) => (vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT, vk::ImageTiling::OPTIMAL),
            (_, vk::SampleCountFlags::TYPE_1) => (vk::ImageUsageFlags::COLOR_ATTACHMENT, vk::ImageTiling::LINEAR),
            _ => (vk::ImageUsageFlags::COLOR_ATTACHMENT, vk::ImageTiling::OPTIMAL),
        };
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(extent(picture).into())
            .mip_levels(1)
            .array_layers(1)
            .samples(samples)
            .tiling(tiling)
            .usage(usage);
        // SAFETY: see above.
        unsafe {
            let raw = self.device.create_image(&info, None)?;
            let needs = self.device.get_image_memory_requirements(raw);
            let (memory, pixels) = self.allocate(needs)?;
            self.device.bind_image_memory(raw, memory, 0)?;
            let info = vk::ImageViewCreateInfo::default()
                .image(raw)
                .view_type(vk::ImageViewType::TYPE_2D)
                .format(format)
                .subresource_range(range(format));
            Ok(Image { raw, view: self.device.create_image_view(&info, None)?, pixels })
        }
    }

    /// A shader's stage.
    fn stage(&self, spirv: &[u8], kind: vk::ShaderStageFlags) -> Outcome<vk::PipelineShaderStageCreateInfo<'static>> {
        let words = ash::util::read_spv(&mut std::io::Cursor::new(spirv))?;
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: see above.
        let module = unsafe { self.device.create_shader_module(&info, None)? };
        Ok(vk::PipelineShaderStageCreateInfo::default().stage(kind).module(module).name(c"main"))
    }

    /// A pipeline for a picture's Gaussians.
    fn gaussian_pipeline(&self, picture: &Picture<'_>) -> Outcome<vk::Pipeline> {
        let instanced = !picture.instances.is_empty();
        let bindings = [
            vk::VertexInputBindingDescription::default().stride(size_of::<Splat>() as u32),
            vk::VertexInputBindingDescription::default()
                .binding(1)
                .stride(size_of::<Instance>() as u32)
                .input_rate(vk::VertexInputRate::INSTANCE),
        ];
        let attribute = |location, binding, format, first: u32| vk::VertexInputAttributeDescription {
            location,
            binding,
            format,
            offset: 4 * first,
        };
        let float = vk::Format::R32_SFLOAT;
        let (vec3, vec4) = (vk::Format::R32G32B32_SFLOAT, vk::Format::R32G32B32A32_SFLOAT);
        let attributes = [
            attribute(0, 0, vec3, 0),
            attribute(1, 0, vec3, 3),
            attribute(2, 0, vec4, 6),
            attribute(3, 0, float, 10),
            attribute(4, 0, vec3, 11),
            attribute(MODEL_MATRIX, 1, vec4, 0),
            attribute(MODEL_MATRIX + 1, 1, vec4, 4),
            attribute(MODEL_MATRIX + 2, 1, vec4, 8),
            attribute(MODEL_OPACITY, 1, float, 12),
        ];
        let mut locations = GaussianAttributeLocationsGAURAST::default()
            .position(0)
            .scale(1)
            .rotation(2)
            .opacity(3)
            .first_spherical_harmonics(4);
        if instanced {
            locations = locations.first_model_matrix(MODEL_MATRIX).model_opacity(MODEL_OPACITY);
        }
        let mut gaussian = picture.state.attribute_locations(locations);
        let mut stages = Vec::new();
        if picture.by_shader {
            gaussian = gaussian.projection_mode(GaussianProjectionModeGAURAST::VERTEX_SHADER).vertex_output_locations(
                GaussianVertexOutputLocationsGAURAST::default().covariance(0).opacity(1).color(2),
            );
            let code = include_bytes!("../shaders/project.vert.spv");
            stages.push(self.stage(code, vk::ShaderStageFlags::VERTEX)?);
        }
        let kind = picture.resolve.map_or(0, |resolve| resolve as u32);
        let kind = kind.to_ne_bytes();
        let entries = [vk::SpecializationMapEntry::default().size(4)];
        let special = vk::SpecializationInfo::default().map_entries(&entries).data(&kind);
        if picture.resolve.is_some() {
            let inputs = GaussianResolveInputLocationsGAURAST::default();
            gaussian = gaussian.resolve_input_locations(inputs.accumulated_color(0).depth(1));
            let code = include_bytes!("../shaders/resolve.frag.spv");
            let stage = self.stage(code, vk::ShaderStageFlags::FRAGMENT)?;
            stages.push(stage.specialization_info(&special));
        }
        let vertices = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings)
            .vertex_attribute_descriptions(&attributes);
        let over = vk::PipelineColorBlendAttachmentState::default()
            .color_write_mask(vk::ColorComponentFlags::RGBA)
            .blend_enable(true)
            .src_color_blend_factor(vk::BlendFactor::ONE)
            .dst_color_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
            .src_alpha_blend_factor(vk::BlendFactor::ONE)
            .dst_alpha_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA);
        let topology = PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST;
        self.pipeline(picture, &vertices, topology, over, &stages, Some(&mut gaussian))
    }

    /// A pipeline for a triangle.
    fn triangle_pipeline(&self, picture: &Picture<'_>) -> Outcome<vk::Pipeline> {
        let stages = [
            self.stage(include_bytes!("../shaders/hello_triangle.vert.spv"), vk::ShaderStageFlags::VERTEX)?,
            self.stage(include_bytes!("../shaders/hello_triangle.frag.spv"), vk::ShaderStageFlags::FRAGMENT)?,
        ];
        let bindings = [vk::VertexInputBindingDescription::default().stride(5 * 4)];
        let attributes = [
            vk::VertexInputAttributeDescription::default().format(vk::Format::R32G32_SFLOAT),
            vk::VertexInputAttributeDescription::default().location(1).format(vk::Format::R32G32B32_SFLOAT).offset(8),
        ];
        let vertices = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings)
            .vertex_attribute_descriptions(&attributes);
        let replace = vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA);
        let topology = vk::PrimitiveTopology::TRIANGLE_LIST;
        self.pipeline(picture, &vertices, topology, replace, &stages, None)
    }

    fn pipeline(
        &self,
        picture: &Picture<'_>,
        vertices: &vk::PipelineVertexInputStateCreateInfo<'_>,
        topology: vk::PrimitiveTopology,
        blend: vk::PipelineColorBlendAttachmentState,
        stages: &[vk::PipelineShaderStageCreateInfo<'_>],
        gaussian: Option<&mut PipelineGaussianStateCreateInfoGAURAST<'_>>,
    ) -> Outcome<vk::Pipeline> {
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(topology);
        let scissors = [extent(picture).into()];
        let view = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissors(&scissors);
        let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let samples = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(picture.samples)
            .alpha_to_coverage_enable(picture.coverage);
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(true)
            .depth_write_enable(true)
            .depth_compare_op(vk::CompareOp::LESS);
        let blends = [blend];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
        let states = [vk::DynamicState::VIEWPORT];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&states);
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(&[COLOR])
            .depth_attachment_format(DEPTH);
        // SAFETY: see above.
        unsafe {
            let mut info = vk::GraphicsPipelineCreateInfo::default()
                .stages(stages)
                .vertex_input_state(vertices)
                .input_assembly_state(&assembly)
                .viewport_state(&view)
                .rasterization_state(&raster)
                .multisample_state(&samples)
                .depth_stencil_state(&depth)
                .color_blend_state(&blend)
                .dynamic_state(&dynamic)
                .layout(self.layout)
                .push_next(&mut rendering);
            if let Some(gaussian) = gaussian {
                info = info.push_next(gaussian);
            }
            let cache = vk::PipelineCache::null();
            let created = self.device.create_graphics_pipelines(cache, &[info], None);
            Ok(created.map_err(|(_, error)| error)?[0])
        }
    }
}

fn extent(picture: &Picture<'_>) -> vk::Extent2D {
    let [width, height] = picture.size;
    vk::Extent2D { width, height }
}

fn viewport(picture: &Picture<'_>, [min_depth, max_depth]: [f32; 2]) -> vk::Viewport {
    let [width, height] = picture.size.map(|side| side as f32);
    vk::Viewport { x: 0.0, y: 0.0, width, height, min_depth, max_depth }
}

fn range(format: vk::Format) -> vk::ImageSubresourceRange {
    let aspect = match format {
        DEPTH => vk::ImageAspectFlags::DEPTH,
        _ => vk::ImageAspectFlags::COLOR,
    };
    vk::ImageSubresourceRange::default().aspect_mask(aspect).level_count(1).layer_count(1)
}
