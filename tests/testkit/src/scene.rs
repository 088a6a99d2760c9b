//! Pipelines, passes and scenes for Gaussian draws.

use crate::{Buffer, Gpu, Graphics, Image, Pipeline, binding};
use ash::vk;
use gaurast::vk::{
    GaussianAttributeLocationsGAURAST, GaussianCameraGAURAST, PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST,
    PipelineGaussianStateCreateInfoGAURAST,
};

use crate::devices::{gaussian, image, open};

pub use crate::{opaque as replace, over};

/// The width of pictures in pixels.
pub const WIDTH: u32 = 64;
/// The height of pictures in pixels.
pub const HEIGHT: u32 = 48;
/// The format of pictures.
pub const FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;

/// The pixel of the point straight ahead of [`camera`].
pub const CENTER: (u32, u32) = (32, 24);

/// A Gaussian as the tests store it: position, scale, rotation, opacity, degree-0 colour.
pub type Splat = [f32; 14];

/// A round Gaussian of one colour.
pub fn splat(position: [f32; 3], scale: f32, opacity: f32, color: [f32; 3]) -> Splat {
    // The degree-0 basis function is 1 / (2 sqrt(pi)).
    let basis = 0.282_094_8;
    let [r, g, b] = color.map(|c| (c - 0.5) / basis);
    let [x, y, z] = position;
    [x, y, z, scale, scale, scale, 1.0, 0.0, 0.0, 0.0, opacity, r, g, b]
}

/// The options of a pipeline for [`Splat`]s over one colour attachment, which may be changed before it is created.
pub fn splats() -> Graphics<'static> {
    let attribute = |location: u32, format: vk::Format, floats: u32| vk::VertexInputAttributeDescription {
        location,
        binding: 0,
        format,
        offset: floats * 4,
    };
    let locations = GaussianAttributeLocationsGAURAST::default()
        .position(0)
        .scale(1)
        .rotation(2)
        .opacity(3)
        .first_spherical_harmonics(4);
    Graphics {
        topology: PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST,
        attributes: vec![
            attribute(0, vk::Format::R32G32B32_SFLOAT, 0),
            attribute(1, vk::Format::R32G32B32_SFLOAT, 3),
            attribute(2, vk::Format::R32G32B32A32_SFLOAT, 6),
            attribute(3, vk::Format::R32_SFLOAT, 10),
            attribute(4, vk::Format::R32G32B32_SFLOAT, 11),
        ],
        bindings: vec![binding(0, size_of::<Splat>() as u32)],
        gaussian: Some(PipelineGaussianStateCreateInfoGAURAST::default().attribute_locations(locations)),
        ..Graphics::default()
    }
}

/// A camera at the origin that looks along +z, with the principal point at the centre of pixel [`CENTER`].
pub fn camera() -> GaussianCameraGAURAST<'static> {
    GaussianCameraGAURAST::default().focal_length([100.0, 100.0]).principal_point([32.5, 24.5])
}

/// An image's width and height.
pub fn extent(image: &Image) -> vk::Extent2D {
    let [width, height, _] = image.options.size;
    vk::Extent2D { width, height }
}

/// All of an image.
pub fn area(image: &Image) -> vk::Rect2D {
    vk::Rect2D { offset: vk::Offset2D::default(), extent: extent(image) }
}

/// Sets viewport and scissor to all of an image.
pub fn set_viewport(device: &ash::Device, commands: vk::CommandBuffer, image: &Image) {
    let viewports = [vk::Viewport {
        x: 0.0,
        y: 0.0,
        width: image.options.size[0] as f32,
        height: image.options.size[1] as f32,
        min_depth: 0.0,
        max_depth: 1.0,
    }];
    // SAFETY: see the crate.
    unsafe {
        device.cmd_set_viewport(commands, 0, &viewports);
        device.cmd_set_scissor(commands, 0, &[area(image)]);
    }
}

/// Records a pass that clears `image` and sets viewport and scissor, with the commands of `record`.
pub fn pass(device: &ash::Device, commands: vk::CommandBuffer, image: &Image, clear: [f32; 4], record: impl FnOnce()) {
    let flags = vk::RenderingFlags::empty();
    pass_with(flags, device, commands, image, clear, || {
        set_viewport(device, commands, image);
        record();
    });
}

/// Records a pass that clears `image`, with the commands of `record`.
pub fn pass_with(
    flags: vk::RenderingFlags,
    device: &ash::Device,
    commands: vk::CommandBuffer,
    image: &Image,
    clear: [f32; 4],
    record: impl FnOnce(),
) {
    let attachments = [vk::RenderingAttachmentInfo::default()
        .image_view(image.view)
        .image_layout(vk::ImageLayout::GENERAL)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)
        .clear_value(vk::ClearValue { color: vk::ClearColorValue { float32: clear } })];
    let rendering = vk::RenderingInfo::default()
        .flags(flags)
        .render_area(area(image))
        .layer_count(1)
        .color_attachments(&attachments);
    // SAFETY: see the crate.
    unsafe { device.cmd_begin_rendering(commands, &rendering) };
    record();
    // SAFETY: see the crate.
    unsafe { device.cmd_end_rendering(commands) };
}

/// Gaussians, a pipeline that draws them, and an image for the picture.
pub struct Scene {
    /// The device.
    pub gpu: Gpu,
    /// The pipeline.
    pub pipeline: Pipeline,
    /// The picture.
    pub image: Image,
    /// The Gaussians, each a [`Splat`].
    pub splats: Buffer,
}

impl Scene {
    /// The scene on a new device with all that this driver supports.
    pub fn new(splats: &[Splat], request: &Graphics<'_>) -> Self {
        Self::on(open(), splats, request)
    }

    /// The scene on a device that was opened before.
    pub fn on(gpu: Gpu, splats: &[Splat], request: &Graphics<'_>) -> Self {
        Self {
            pipeline: request.create(&gpu).unwrap(),
            image: image(&gpu, FORMAT, [WIDTH, HEIGHT]),
            splats: Buffer::of(&gpu, splats.as_flattened()),
            gpu,
        }
    }

    /// Draws in a pass that clears to `clear`; `record` records the draw.
    pub fn draw(&self, clear: [f32; 4], draw: impl FnOnce(&ash::Device, vk::CommandBuffer)) -> Vec<[f32; 4]> {
        self.gpu.run(|recording| {
            let (device, commands) = recording.raw();
            pass(device, commands, &self.image, clear, || {
                self.bind(device, commands);
                draw(device, commands);
            });
        });
        self.pixels()
    }

    /// The pixels of the image.
    pub fn pixels(&self) -> Vec<[f32; 4]> {
        self.image.colors()
    }

    /// Binds the pipeline, the Gaussians and the camera.
    pub fn bind(&self, device: &ash::Device, commands: vk::CommandBuffer) {
        let graphics = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_pipeline(commands, graphics, self.pipeline.raw);
            device.cmd_bind_vertex_buffers(commands, 0, &[self.splats.raw], &[0]);
            gaussian(&self.gpu).cmd_set_gaussian_cameras(commands, &[camera()]);
        }
    }
}

/// The pixel at (x, y).
pub fn at(pixels: &[[f32; 4]], (x, y): (u32, u32)) -> [f32; 4] {
    pixels[(y * WIDTH + x) as usize]
}

/// The premultiplied colour with its alpha.
pub fn premultiplied(color: [f32; 3], alpha: f32) -> [f32; 4] {
    let [r, g, b] = color.map(|c| c * alpha);
    [r, g, b, alpha]
}

/// Asserts that two colours are equal up to 5e-6.
///
/// # Panics
/// If they are not.
pub fn assert_close(actual: [f32; 4], expected: [f32; 4]) {
    let close = actual.iter().zip(expected).all(|(a, e)| (a - e).abs() <= 5e-6);
    assert!(close, "{actual:?} is not {expected:?}");
}
