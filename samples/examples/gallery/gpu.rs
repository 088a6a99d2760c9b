//! One small picture at a time, with pipelines of its own and the device, buffers and images of `gaurast-render`.

use std::error::Error;
use std::sync::Arc;

use ash::vk::{self, PipelineStageFlags as Stage};
use gaurast::gaussian_primitive_topology;
use gaurast::vk::*;
use gaurast_render::DeviceOptions;
use gaurast_render::device::{Device, Purpose};
use gaurast_render::resource::{Buffer, CommandBuffers, Image, Memory};
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

/// The pipelines of a picture.
struct Pipelines<'a> {
    gaussians: vk::Pipeline,
    triangle: vk::Pipeline,
    device: &'a Device,
}

impl Drop for Pipelines<'_> {
    fn drop(&mut self) {
        // SAFETY: every submission was waited for.
        unsafe {
            self.device.raw().destroy_pipeline(self.gaussians, None);
            self.device.raw().destroy_pipeline(self.triangle, None);
        }
    }
}

/// The attachments of a picture.
struct Attachments {
    /// The image that is read.
    target: Image,
    /// The colours of several samples, which are resolved to the target.
    samples: Option<Image>,
    depth: Image,
}

impl Attachments {
    fn new(device: &Arc<Device>, picture: &Picture<'_>) -> Outcome<Self> {
        let image = |format, usage, samples| Image::with_samples(device, extent(picture), format, usage, samples);
        let (color, one) = (vk::ImageUsageFlags::COLOR_ATTACHMENT, vk::SampleCountFlags::TYPE_1);
        let samples = picture.samples;
        Ok(Self {
            target: image(COLOR, color | vk::ImageUsageFlags::TRANSFER_SRC, one)?,
            samples: if samples == one { None } else { Some(image(COLOR, color, samples)?) },
            depth: image(DEPTH, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT, samples)?,
        })
    }

    /// The colour attachment, which is cleared to a dark background.
    fn color(&self) -> vk::RenderingAttachmentInfo<'static> {
        let info = vk::RenderingAttachmentInfo::default()
            .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .clear_value(vk::ClearValue { color: vk::ClearColorValue { float32: [0.03, 0.035, 0.05, 1.0] } });
        match &self.samples {
            None => info.image_view(self.target.view()),
            Some(samples) => info
                .image_view(samples.view())
                .resolve_mode(vk::ResolveModeFlags::AVERAGE)
                .resolve_image_view(self.target.view())
                .resolve_image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL),
        }
    }

    fn depth(&self) -> vk::RenderingAttachmentInfo<'static> {
        vk::RenderingAttachmentInfo::default()
            .image_view(self.depth.view())
            .image_layout(vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .clear_value(vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 1.0, stencil: 0 } })
    }

    /// The transitions to the layouts of attachments.
    fn barriers(&self) -> Vec<vk::ImageMemoryBarrier<'static>> {
        let from = vk::ImageLayout::UNDEFINED;
        let color = |image: &Image| {
            image
                .barrier(from, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
                .dst_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE)
        };
        let depth = self
            .depth
            .barrier(from, vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL)
            .dst_access_mask(vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE);
        [&self.target].into_iter().chain(&self.samples).map(color).chain([depth]).collect()
    }
}

/// The vertex buffers of a picture.
struct Vertices {
    splats: Buffer,
    instances: Buffer,
    corners: Buffer,
}

impl Vertices {
    fn new(device: &Arc<Device>, picture: &Picture<'_>) -> Outcome<Self> {
        // A buffer is not empty.
        let buffer = |bytes: &[u8]| -> Outcome<Buffer> {
            let usage = vk::BufferUsageFlags::VERTEX_BUFFER;
            let buffer = Buffer::new(device, bytes.len().max(64) as u64, usage, Memory::Host)?;
            buffer.write(bytes)?;
            Ok(buffer)
        };
        Ok(Self {
            splats: buffer(bytemuck::cast_slice(picture.splats))?,
            instances: buffer(bytemuck::cast_slice(picture.instances))?,
            corners: buffer(picture.triangle.as_ref().map_or(&[][..], |it| bytemuck::cast_slice(&it.corners)))?,
        })
    }
}

/// A device with the extension, and the objects that all pictures share.
pub struct Gpu {
    extension: gaussian_primitive_topology::Device,
    commands: CommandBuffers<1>,
    layout: vk::PipelineLayout,
    device: Arc<Device>,
}

// SAFETY of all `unsafe` here: handles are used while they are valid, structures are valid, commands are in order, and
// every submission is waited for.
impl Gpu {
    pub fn new(entry: ash::Entry) -> Outcome<Self> {
        let device = Arc::new(Device::new(entry, Purpose::Gaussians, &DeviceOptions::default())?);
        let constants = [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::VERTEX).size(CONSTANTS)];
        let info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&constants);
        Ok(Self {
            extension: device.gaussian_functions(),
            commands: CommandBuffers::new(&device)?,
            // SAFETY: see above.
            layout: unsafe { device.raw().create_pipeline_layout(&info, None)? },
            device,
        })
    }

    /// Draws a picture over a dark background.
    pub fn draw(&mut self, picture: &Picture<'_>) -> Outcome<RgbImage> {
        let attachments = Attachments::new(&self.device, picture)?;
        let vertices = Vertices::new(&self.device, picture)?;
        let [width, height] = picture.size;
        let bytes = u64::from(4 * width * height);
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let readback = Buffer::new(&self.device, bytes, usage, Memory::HostCached)?;
        let device = Arc::clone(&self.device);
        let pipelines = Pipelines {
            gaussians: self.gaussian_pipeline(picture)?,
            triangle: self.triangle_pipeline(picture)?,
            device: &device,
        };
        self.commands.record(0, |raw, c| {
            let (colors, depth) = ([attachments.color()], attachments.depth());
            let info = vk::RenderingInfo::default()
                .render_area(extent(picture).into())
                .layer_count(1)
                .color_attachments(&colors)
                .depth_attachment(&depth);
            let to = Stage::COLOR_ATTACHMENT_OUTPUT | Stage::EARLY_FRAGMENT_TESTS;
            let none = vk::DependencyFlags::empty();
            // SAFETY: see above.
            unsafe {
                raw.cmd_pipeline_barrier(c, Stage::TOP_OF_PIPE, to, none, &[], &[], &attachments.barriers());
                raw.cmd_begin_rendering(c, &info);
                self.record_draws(raw, c, picture, &pipelines, &vertices);
                raw.cmd_end_rendering(c);
            }
            gaurast_render::copy_image(&device, c, &attachments.target, &readback);
        })?;
        self.commands.submit_and_wait(&[0])?;
        let pixels: Vec<[u8; 4]> = readback.read_new((width * height) as usize)?;
        Ok(RgbImage::from_fn(width, height, |x, y| {
            let [red, green, blue, _] = pixels[(y * width + x) as usize];
            Rgb([red, green, blue])
        }))
    }

    /// Records the draws of a picture: the triangle, if there is one, and the Gaussians.
    fn record_draws(
        &self,
        raw: &ash::Device,
        c: vk::CommandBuffer,
        picture: &Picture<'_>,
        pipelines: &Pipelines<'_>,
        vertices: &Vertices,
    ) {
        let point = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: see above.
        unsafe {
            if let Some(triangle) = &picture.triangle {
                raw.cmd_bind_pipeline(c, point, pipelines.triangle);
                raw.cmd_set_viewport(c, 0, &[viewport(picture, [triangle.depth; 2])]);
                raw.cmd_bind_vertex_buffers(c, 0, &[vertices.corners.handle()], &[0]);
                raw.cmd_draw(c, 3, 1, 0, 0);
            }
            raw.cmd_bind_pipeline(c, point, pipelines.gaussians);
            raw.cmd_set_viewport(c, 0, &[viewport(picture, [0.0, 1.0])]);
            let buffers = [vertices.splats.handle(), vertices.instances.handle()];
            raw.cmd_bind_vertex_buffers(c, 0, &buffers, &[0; 2]);
            self.extension.cmd_set_gaussian_cameras(c, &[picture.camera]);
            let [fx, fy] = picture.camera.focal_length;
            let [width, height] = picture.size.map(|side| side as f32);
            let constants = [width, height, fx, fy];
            let bytes = bytemuck::bytes_of(&constants);
            raw.cmd_push_constants(c, self.layout, vk::ShaderStageFlags::VERTEX, 0, bytes);
            let all = [picture.splats.len() as u32];
            let draws = if picture.draws.is_empty() { &all } else { picture.draws };
            let (mut first, instances) = (0, picture.instances.len().max(1) as u32);
            if picture.share_a_set {
                self.extension.cmd_begin_gaussian_set(c);
            }
            for &count in draws {
                raw.cmd_draw(c, count, instances, first, 0);
                first += count;
            }
            if picture.share_a_set {
                self.extension.cmd_end_gaussian_set(c);
            }
        }
    }

    /// A shader's stage. Its module is destroyed with the pipeline's creation.
    fn stage(&self, spirv: &[u8], kind: vk::ShaderStageFlags) -> Outcome<vk::PipelineShaderStageCreateInfo<'static>> {
        let words = ash::util::read_spv(&mut std::io::Cursor::new(spirv))?;
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: see above.
        let module = unsafe { self.device.raw().create_shader_module(&info, None)? };
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
            let created = self.device.raw().create_graphics_pipelines(cache, &[info], None);
            for stage in stages {
                self.device.raw().destroy_shader_module(stage.module, None);
            }
            Ok(created.map_err(|(_, error)| error)?[0])
        }
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        // SAFETY: the pipelines of the layout are destroyed.
        unsafe { self.device.raw().destroy_pipeline_layout(self.layout, None) };
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
