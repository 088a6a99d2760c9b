//! A canvas for points, lines and triangles: an image, with depth and stencil if needed, passes over it, and pipelines,
//! whose options may be changed before they are created.

use crate::{
    Bindings, Buffer, Gpu, Graphics, Image, ImageOptions, Pipeline, Resource, Sampler, Shader, attribute, binding,
};
use ash::vk;

use crate::devices::{image, open};
use crate::scene::{FORMAT, HEIGHT, WIDTH, extent, set_viewport};
use crate::shader::spirv;

/// The format of depth and stencil.
pub const DEPTH_FORMAT: vk::Format = vk::Format::D32_SFLOAT_S8_UINT;

/// A vertex as most tests store it: a position in clip space and a colour.
pub type Vertex = [f32; 8];

/// A vertex in the middle of the depth range.
pub fn vertex(x: f32, y: f32, color: [f32; 4]) -> Vertex {
    deep_vertex([x, y, 0.5], color)
}

/// A vertex at a depth.
pub fn deep_vertex([x, y, z]: [f32; 3], [r, g, b, a]: [f32; 4]) -> Vertex {
    [x, y, z, 1.0, r, g, b, a]
}

/// A pipeline for [`Vertex`]es over one colour attachment.
pub fn colored() -> Graphics<'static> {
    let floats = vk::Format::R32G32B32A32_SFLOAT;
    Graphics {
        shaders: vec![Shader::vertex(spirv("colored.vert")), Shader::fragment(spirv("colored.frag"))],
        push: vec![
            vk::PushConstantRange::default()
                .stage_flags(vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT)
                .size(64),
        ],
        bindings: vec![binding(0, size_of::<Vertex>() as u32)],
        attributes: vec![attribute(0, floats, 0), attribute(1, floats, 16)],
        ..Graphics::default()
    }
}

/// The clear colour of passes.
pub const CLEAR: [f32; 4] = [0.25, 0.25, 0.25, 0.0];

/// The clear depth of passes; stencil is cleared to 0.
pub const CLEAR_DEPTH: f32 = 0.5;

/// Opaque red.
pub const RED: [f32; 4] = [1.0, 0.0, 0.0, 1.0];
/// Green with an alpha of 1/2.
pub const GREEN: [f32; 4] = [0.0, 1.0, 0.0, 0.5];
/// Blue with an alpha of 1/4.
pub const BLUE: [f32; 4] = [0.0, 0.0, 1.0, 0.25];

/// The number of pixels of a canvas.
pub const PIXELS: usize = (WIDTH * HEIGHT) as usize;

/// A triangle that covers the whole canvas.
pub fn everything(color: [f32; 4]) -> [Vertex; 3] {
    [vertex(-1.0, -1.0, color), vertex(3.0, -1.0, color), vertex(-1.0, 3.0, color)]
}

/// The number of pixels of a colour.
pub fn count(pixels: &[[f32; 4]], color: [f32; 4]) -> usize {
    pixels.iter().filter(|pixel| **pixel == color).count()
}

/// A device and an image on which it draws.
pub struct Canvas {
    /// The device.
    pub gpu: Gpu,
    /// The image.
    pub image: Image,
    depth: Option<Image>,
}

impl Canvas {
    /// A canvas of floats without depth.
    #[expect(clippy::new_without_default, reason = "it opens a device")]
    pub fn new() -> Self {
        Self::of(FORMAT)
    }

    /// A canvas of a colour format without depth.
    pub fn of(format: vk::Format) -> Self {
        let gpu = open();
        Self { image: image(&gpu, format, [WIDTH, HEIGHT]), depth: None, gpu }
    }

    /// A canvas of floats with depth and stencil.
    pub fn with_depth() -> Self {
        let canvas = Self::new();
        let usage = vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT;
        let options = ImageOptions::new(DEPTH_FORMAT, [WIDTH, HEIGHT], usage);
        Self { depth: Some(Image::new(&canvas.gpu, &options)), ..canvas }
    }

    /// The image's pixels, if they are floats.
    pub fn pixels(&self) -> Vec<[f32; 4]> {
        self.image.colors()
    }

    /// Draws vertices as one instance.
    pub fn draw_vertices(&self, request: &Graphics<'_>, vertices: &[Vertex]) -> Vec<[f32; 4]> {
        self.draw(request, vertices, |device, commands, _| {
            // SAFETY: see the crate.
            unsafe { device.cmd_draw(commands, vertices.len() as u32, 1, 0, 0) };
        })
    }

    /// Creates a pipeline and draws the commands of `record` with it, with vertices bound.
    pub fn draw(
        &self,
        request: &Graphics<'_>,
        vertices: &[Vertex],
        record: impl FnOnce(&ash::Device, vk::CommandBuffer, &Pipeline),
    ) -> Vec<[f32; 4]> {
        self.draw_of(request, vertices.as_flattened(), record)
    }

    /// Creates a pipeline and draws the commands of `record` with it, with a vertex buffer bound.
    pub fn draw_of<T: bytemuck::NoUninit>(
        &self,
        request: &Graphics<'_>,
        vertices: &[T],
        record: impl FnOnce(&ash::Device, vk::CommandBuffer, &Pipeline),
    ) -> Vec<[f32; 4]> {
        let made = request.create(&self.gpu).unwrap_or_else(|error| panic!("{error}: {:?}", self.gpu.messages()));
        let vertices = Buffer::of(&self.gpu, vertices);
        self.pass(&[&self.image], |device, commands| {
            // SAFETY: see the crate.
            unsafe {
                device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, made.raw);
                device.cmd_bind_vertex_buffers(commands, 0, &[vertices.raw], &[0]);
            }
            record(device, commands, &made);
        });
        self.pixels()
    }

    /// Runs a pass that clears images, with viewport and scissor set.
    pub fn pass(&self, color: &[&Image], record: impl FnOnce(&ash::Device, vk::CommandBuffer)) {
        self.gpu.run(|recording| {
            let (device, commands) = recording.raw();
            self.record_pass(device, commands, color, 1, || {
                set_viewport(device, commands, &self.image);
                record(device, commands);
            });
        });
    }

    /// Records a pass that clears layers of images.
    pub fn record_pass(
        &self,
        device: &ash::Device,
        commands: vk::CommandBuffer,
        color: &[&Image],
        layers: u32,
        record: impl FnOnce(),
    ) {
        let attachments: Vec<_> = color.iter().map(|image| attachment(image)).collect();
        self.record_pass_of(device, commands, &attachments, layers, record);
    }

    /// Records a pass that clears `samples` and resolves them to the canvas.
    pub fn record_resolving_pass(
        &self,
        device: &ash::Device,
        commands: vk::CommandBuffer,
        samples: &Image,
        record: impl FnOnce(),
    ) {
        let resolving = attachment(samples)
            .resolve_mode(vk::ResolveModeFlags::AVERAGE)
            .resolve_image_view(self.image.view)
            .resolve_image_layout(vk::ImageLayout::GENERAL);
        self.record_pass_of(device, commands, &[resolving], 1, || {
            set_viewport(device, commands, &self.image);
            record();
        });
    }

    fn record_pass_of(
        &self,
        device: &ash::Device,
        commands: vk::CommandBuffer,
        color: &[vk::RenderingAttachmentInfo],
        layers: u32,
        record: impl FnOnce(),
    ) {
        let depth = self.depth.as_ref().map(|depth| {
            attachment(depth).clear_value(vk::ClearValue {
                depth_stencil: vk::ClearDepthStencilValue { depth: CLEAR_DEPTH, stencil: 0 },
            })
        });
        let mut rendering = vk::RenderingInfo::default()
            .render_area(vk::Rect2D { offset: vk::Offset2D::default(), extent: extent(&self.image) })
            .layer_count(layers)
            .color_attachments(color);
        if let Some(depth) = &depth {
            rendering = rendering.depth_attachment(depth).stencil_attachment(depth);
        }
        // SAFETY: see the crate.
        unsafe { device.cmd_begin_rendering(commands, &rendering) };
        record();
        // SAFETY: see the crate.
        unsafe { device.cmd_end_rendering(commands) };
    }

    /// A sampler with nearest filtering.
    pub fn nearest_sampler(&self) -> Sampler {
        Sampler::new(&self.gpu, &vk::SamplerCreateInfo::default())
    }

    /// A set of one storage buffer, for all stages.
    pub fn storage_set(&self, buffer: &Buffer) -> Bindings {
        Bindings::new(&self.gpu, &[Resource::Storage(buffer.raw)])
    }
}

fn attachment(image: &Image) -> vk::RenderingAttachmentInfo<'static> {
    vk::RenderingAttachmentInfo::default()
        .image_view(image.attachment)
        .image_layout(vk::ImageLayout::GENERAL)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)
        .clear_value(vk::ClearValue { color: vk::ClearColorValue { float32: CLEAR } })
}

/// An image of several layers with a view of them all.
pub fn layered_image(gpu: &Gpu, layers: u32) -> Image {
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT;
    let options = ImageOptions {
        layers,
        view: vk::ImageViewType::TYPE_2D_ARRAY,
        ..ImageOptions::new(FORMAT, [WIDTH, HEIGHT], usage)
    };
    Image::new(gpu, &options)
}

/// An image of several samples.
pub fn sampled_image(gpu: &Gpu, samples: vk::SampleCountFlags) -> Image {
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT;
    let options = ImageOptions { samples: samples.as_raw(), ..ImageOptions::new(FORMAT, [WIDTH, HEIGHT], usage) };
    Image::new(gpu, &options)
}

/// The float texels of a layer.
pub fn read_layer(image: &Image, layer: u32) -> Vec<[f32; 4]> {
    let all: Vec<[f32; 4]> = image.colors();
    all[layer as usize * PIXELS..][..PIXELS].to_vec()
}
