//! Counted draws of triangles: many small ones, a textured floor, and overlapping layers.

use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};
use gaurast_render::device::{Device, Purpose};
use gaurast_render::resource::{Buffer, CommandBuffers, Memory};
use gaurast_render::{COLOR_FORMAT, DeviceOptions, RenderError, Target, record_copy};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::objects::{Objects, begin_image};

/// Triangles of [`Triangles::small`].
const SMALL: usize = 15_000;

/// Width and height of the texture's first level.
const TEXTURE: u32 = 256;

const DEPTH_FORMAT: vk::Format = vk::Format::D32_SFLOAT;
const COLOR: vk::ImageAspectFlags = vk::ImageAspectFlags::COLOR;
const DEPTH: vk::ImageAspectFlags = vk::ImageAspectFlags::DEPTH;

/// A corner of a triangle.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Vertex {
    position: [f32; 4],
    color: [f32; 4],
}

/// Triangles with depth, ready to be drawn.
pub(super) struct Triangles {
    commands: CommandBuffers<1>,
    pipeline: vk::Pipeline,
    layout: vk::PipelineLayout,
    set: vk::DescriptorSet,
    vertices: Buffer,
    count: u32,
    target: Target,
    depth: (vk::Image, vk::ImageView),
    objects: Objects,
}

impl Triangles {
    /// Triangles of about four pixels at random places and depths.
    pub(super) fn small(entry: ash::Entry, size: [u32; 2]) -> Result<Self, RenderError> {
        let fragment = include_bytes!("shaders/plain.frag.spv");
        Self::new(entry, size, &small(size), fragment)
    }

    /// A floor with a texture that is magnified near the camera and minified far away, filtered within and between
    /// levels.
    pub(super) fn textured(entry: ash::Entry, size: [u32; 2]) -> Result<Self, RenderError> {
        let fragment = include_bytes!("shaders/textured.frag.spv");
        Self::new(entry, size, &floor(), fragment)
    }

    /// Layers that fill the picture, each of one colour. Those of the left half are drawn from back to front, those of
    /// the right half from front to back.
    pub(super) fn layered(entry: ash::Entry, size: [u32; 2], count: u32) -> Result<Self, RenderError> {
        let fragment = include_bytes!("shaders/plain.frag.spv");
        Self::new(entry, size, &layers(count), fragment)
    }

    fn new(
        entry: ash::Entry,
        [width, height]: [u32; 2],
        vertices: &[Vertex],
        fragment: &[u8],
    ) -> Result<Self, RenderError> {
        let device = Arc::new(Device::new(entry, Purpose::Triangles(""), &DeviceOptions::default())?);
        let mut objects = Objects::new(&device);
        let mut commands = CommandBuffers::new(&device)?;
        let target = Target::new(&device, width, height)?;
        let depth_info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(DEPTH_FORMAT)
            .extent(target.image.extent().into())
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT);
        let depth = objects.image(&depth_info, DEPTH)?;
        let bytes: &[u8] = bytemuck::cast_slice(vertices);
        let usage = vk::BufferUsageFlags::VERTEX_BUFFER;
        let buffer = Buffer::new(&device, bytes.len() as u64, usage, Memory::Host)?;
        buffer.write(bytes)?;
        let (layout, set) = texture(&mut objects, &mut commands)?;
        Ok(Self {
            pipeline: pipeline(&mut objects, layout, fragment)?,
            commands,
            layout,
            set,
            vertices: buffer,
            count: vertices.len() as u32,
            target,
            depth,
            objects,
        })
    }

    /// Draws them, copies the picture to the host, and waits.
    pub(super) fn draw(&mut self) -> Result<(), RenderError> {
        self.commands.record(0, |raw, commands| {
            self.record(raw, commands);
            record_copy(self.objects.device(), commands, &self.target);
        })?;
        self.commands.submit_and_wait(&[0])
    }

    /// The pixels that were drawn last.
    pub(super) fn picture(&self) -> Result<Vec<[f32; 4]>, RenderError> {
        let vk::Extent2D { width, height } = self.target.image.extent();
        let mut pixels = vec![[0.0; 4]; width as usize * height as usize];
        self.target.readback.read(&mut pixels)?;
        Ok(pixels)
    }

    fn record(&self, raw: &ash::Device, commands: vk::CommandBuffer) {
        use vk::{AccessFlags as Access, ImageLayout as Layout, PipelineStageFlags as Stage};
        let area = vk::Rect2D::default().extent(self.target.image.extent());
        let viewport =
            vk::Viewport::default().width(area.extent.width as f32).height(area.extent.height as f32).max_depth(1.0);
        let attachment = |view, layout| {
            vk::RenderingAttachmentInfo::default()
                .image_view(view)
                .image_layout(layout)
                .load_op(vk::AttachmentLoadOp::CLEAR)
        };
        let colors = [attachment(self.target.image.view(), Layout::COLOR_ATTACHMENT_OPTIMAL)
            .store_op(vk::AttachmentStoreOp::STORE)];
        let far = vk::ClearDepthStencilValue { depth: 1.0, stencil: 0 };
        let depth = attachment(self.depth.1, Layout::DEPTH_ATTACHMENT_OPTIMAL)
            .store_op(vk::AttachmentStoreOp::DONT_CARE)
            .clear_value(vk::ClearValue { depth_stencil: far });
        let rendering = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(1)
            .color_attachments(&colors)
            .depth_attachment(&depth);
        let barriers = [
            begin_image(self.target.image.handle(), COLOR, Layout::COLOR_ATTACHMENT_OPTIMAL)
                .dst_access_mask(Access::COLOR_ATTACHMENT_WRITE),
            begin_image(self.depth.0, DEPTH, Layout::DEPTH_ATTACHMENT_OPTIMAL)
                .dst_access_mask(Access::DEPTH_STENCIL_ATTACHMENT_WRITE),
        ];
        let graphics = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: the command buffer is recording; everything is of the same device and lives until the submission has
        // ended; the vertices lie within the buffer.
        unsafe {
            raw.cmd_pipeline_barrier(
                commands,
                Stage::TOP_OF_PIPE,
                Stage::COLOR_ATTACHMENT_OUTPUT | Stage::EARLY_FRAGMENT_TESTS,
                vk::DependencyFlags::empty(),
                &[],
                &[],
                &barriers,
            );
            raw.cmd_begin_rendering(commands, &rendering);
            raw.cmd_bind_pipeline(commands, graphics, self.pipeline);
            raw.cmd_bind_descriptor_sets(commands, graphics, self.layout, 0, &[self.set], &[]);
            raw.cmd_bind_vertex_buffers(commands, 0, &[self.vertices.handle()], &[0]);
            raw.cmd_set_viewport(commands, 0, &[viewport]);
            raw.cmd_set_scissor(commands, 0, &[area]);
            raw.cmd_draw(commands, self.count, 1, 0, 0);
            raw.cmd_end_rendering(commands);
        }
    }
}

/// A pipeline of triangles with a depth test.
fn pipeline(objects: &mut Objects, layout: vk::PipelineLayout, fragment: &[u8]) -> Result<vk::Pipeline, RenderError> {
    let vertex = include_bytes!("shaders/plain.vert.spv");
    let stages = [
        objects.stage(vk::ShaderStageFlags::VERTEX, vertex)?,
        objects.stage(vk::ShaderStageFlags::FRAGMENT, fragment)?,
    ];
    let bindings = [vk::VertexInputBindingDescription::default().stride(size_of::<Vertex>() as u32)];
    let attribute = |location, offset| {
        vk::VertexInputAttributeDescription::default()
            .location(location)
            .format(vk::Format::R32G32B32A32_SFLOAT)
            .offset(offset)
    };
    let attributes = [attribute(0, 0), attribute(1, 16)];
    let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
        .vertex_binding_descriptions(&bindings)
        .vertex_attribute_descriptions(&attributes);
    let input_assembly =
        vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    let rasterization = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    let multisample =
        vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let depth = vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(true)
        .depth_write_enable(true)
        .depth_compare_op(vk::CompareOp::LESS);
    let attachments =
        [vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA)];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
    let dynamic_states = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic_states);
    let formats = [COLOR_FORMAT];
    let mut rendering = vk::PipelineRenderingCreateInfo::default()
        .color_attachment_formats(&formats)
        .depth_attachment_format(DEPTH_FORMAT);
    let create_info = vk::GraphicsPipelineCreateInfo::default()
        .stages(&stages)
        .vertex_input_state(&vertex_input)
        .input_assembly_state(&input_assembly)
        .viewport_state(&viewport)
        .rasterization_state(&rasterization)
        .multisample_state(&multisample)
        .depth_stencil_state(&depth)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(layout)
        .push_next(&mut rendering);
    objects.graphics_pipeline(create_info)
}

/// A texture of random texels in a descriptor set, and the pipeline layout of that set.
fn texture(
    objects: &mut Objects,
    commands: &mut CommandBuffers<1>,
) -> Result<(vk::PipelineLayout, vk::DescriptorSet), RenderError> {
    let levels = TEXTURE.ilog2() + 1;
    let side = |level: u32| TEXTURE >> level;
    let create_info = vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(vk::Format::R8G8B8A8_UNORM)
        .extent(vk::Extent3D { width: TEXTURE, height: TEXTURE, depth: 1 })
        .mip_levels(levels)
        .array_layers(1)
        .samples(vk::SampleCountFlags::TYPE_1)
        .usage(vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST);
    let (image, view) = objects.image(&create_info, COLOR)?;

    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut texels: Vec<[u8; 4]> = Vec::new();
    let regions: Vec<_> = (0..levels)
        .map(|level| {
            let offset = 4 * texels.len() as u64;
            texels.extend((0..side(level).pow(2)).map(|_| rng.random::<[u8; 4]>()));
            let layers = vk::ImageSubresourceLayers::default().aspect_mask(COLOR).mip_level(level).layer_count(1);
            vk::BufferImageCopy::default().buffer_offset(offset).image_subresource(layers).image_extent(vk::Extent3D {
                width: side(level),
                height: side(level),
                depth: 1,
            })
        })
        .collect();
    let device = objects.device().clone();
    let bytes: &[u8] = bytemuck::cast_slice(&texels);
    let usage = vk::BufferUsageFlags::TRANSFER_SRC;
    let staging = Buffer::new(&device, bytes.len() as u64, usage, Memory::Host)?;
    staging.write(bytes)?;
    commands.record(0, |raw, commands| {
        use vk::{AccessFlags as Access, ImageLayout as Layout, PipelineStageFlags as Stage};
        let to_copy = begin_image(image, COLOR, Layout::TRANSFER_DST_OPTIMAL).dst_access_mask(Access::TRANSFER_WRITE);
        let to_shader = begin_image(image, COLOR, Layout::SHADER_READ_ONLY_OPTIMAL)
            .old_layout(Layout::TRANSFER_DST_OPTIMAL)
            .src_access_mask(Access::TRANSFER_WRITE)
            .dst_access_mask(Access::SHADER_READ);
        let barrier = |from, to, barrier| {
            let none = vk::DependencyFlags::empty();
            // SAFETY: the command buffer is recording, and the image lives until the submission has ended.
            unsafe { raw.cmd_pipeline_barrier(commands, from, to, none, &[], &[], &[barrier]) };
        };
        barrier(Stage::TOP_OF_PIPE, Stage::TRANSFER, to_copy);
        // SAFETY: the command buffer is recording; the regions lie within buffer and image, which live until the
        // submission has ended.
        unsafe {
            raw.cmd_copy_buffer_to_image(commands, staging.handle(), image, Layout::TRANSFER_DST_OPTIMAL, &regions);
        }
        barrier(Stage::TRANSFER, Stage::FRAGMENT_SHADER, to_shader);
    })?;
    commands.submit_and_wait(&[0])?;

    let sampler_info = vk::SamplerCreateInfo::default()
        .mag_filter(vk::Filter::LINEAR)
        .min_filter(vk::Filter::LINEAR)
        .mipmap_mode(vk::SamplerMipmapMode::LINEAR)
        .max_lod(vk::LOD_CLAMP_NONE);
    let sampler = objects.sampler(&sampler_info)?;
    let kind = vk::DescriptorType::COMBINED_IMAGE_SAMPLER;
    let (layout, set) = objects.descriptors(kind, 1, vk::ShaderStageFlags::FRAGMENT)?;
    let info = [vk::DescriptorImageInfo::default()
        .sampler(sampler)
        .image_view(view)
        .image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)];
    let write = vk::WriteDescriptorSet::default().dst_set(set).descriptor_type(kind).image_info(&info);
    // SAFETY: the set is unused, and view and sampler are of the same device.
    unsafe { device.raw().update_descriptor_sets(&[write], &[]) };
    Ok((layout, set))
}

/// Triangles of about four pixels.
fn small(size: [u32; 2]) -> Vec<Vertex> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let pixel = size.map(|side| 2.0 / side as f32);
    let mut vertices = Vec::with_capacity(3 * SMALL);
    for _ in 0..SMALL {
        let middle = [0; 2].map(|_| rng.random_range(-0.99..0.99_f32));
        let z = rng.random_range(0.0..1.0);
        for corner in [[-1.4, -1.4], [1.4, -1.4], [-1.4, 1.4_f32]] {
            let [x, y] = [0, 1].map(|axis| middle[axis] + corner[axis] * pixel[axis]);
            vertices.push(Vertex { position: [x, y, z, 1.0], color: [x, y, z, 1.0] });
        }
    }
    vertices
}

/// Two triangles for each layer of each half of the picture.
fn layers(count: u32) -> Vec<Vertex> {
    let mut vertices = Vec::new();
    for layer in 0..count {
        let far = (count - layer) as f32 / (count + 1) as f32;
        let near = (layer + 1) as f32 / (count + 1) as f32;
        for (left, right, z) in [(-1.0, 0.0, far), (0.0, 1.0, near)] {
            let corners = [[left, -1.0], [right, -1.0], [left, 1.0], [right, 1.0]];
            let corners =
                corners.map(|[x, y]: [f32; 2]| Vertex { position: [x, y, z, 1.0], color: [z, 0.5, 1.0 - z, 1.0] });
            vertices.extend([0, 1, 2, 2, 1, 3].map(|index: usize| corners[index]));
        }
    }
    vertices
}

/// Two triangles that fill the picture: the floor, eight times as far away at the bottom as at the top.
fn floor() -> Vec<Vertex> {
    let corners = [[-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [-1.0, 1.0, 8.0], [1.0, 1.0, 8.0]];
    let corners = corners.map(|[x, y, w]| Vertex { position: [x * w, y * w, 0.5 * w, w], color: [x * w, w, 0.0, 0.0] });
    [0, 1, 2, 2, 1, 3].map(|index: usize| corners[index]).to_vec()
}
