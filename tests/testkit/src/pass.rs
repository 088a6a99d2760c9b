//! Passes: their beginning and end, and the traits of targets and pipelines that commands use.

use ash::vk;

/// The options of a pass: load and store operations, clear values, area and flags.
#[derive(Clone, Copy)]
pub struct Pass {
    /// The clear value of all colour attachments.
    pub color: vk::ClearColorValue,
    /// The clear value of depth and stencil.
    pub depth: vk::ClearDepthStencilValue,
    /// The load operation of all attachments.
    pub load: vk::AttachmentLoadOp,
    /// The store operation of all attachments.
    pub store: vk::AttachmentStoreOp,
    /// The render area; the whole target by default.
    pub area: Option<vk::Rect2D>,
    /// The rendering flags, for example for draws in secondary command buffers.
    pub flags: vk::RenderingFlags,
}

impl Default for Pass {
    fn default() -> Self {
        Self {
            color: vk::ClearColorValue { float32: [0.1, 0.2, 0.3, 1.0] },
            depth: vk::ClearDepthStencilValue { depth: 1.0, stencil: 0 },
            load: vk::AttachmentLoadOp::CLEAR,
            store: vk::AttachmentStoreOp::STORE,
            area: None,
            flags: vk::RenderingFlags::empty(),
        }
    }
}

impl Pass {
    /// A pass that clears to zeros, whatever the format.
    pub fn zeros() -> Self {
        Self { color: vk::ClearColorValue { uint32: [0; 4] }, ..Self::default() }
    }

    /// A pass that clears to a colour.
    pub fn clear(float32: [f32; 4]) -> Self {
        Self { color: vk::ClearColorValue { float32 }, ..Self::default() }
    }

    /// A pass that loads the attachments' contents.
    pub fn load() -> Self {
        Self { load: vk::AttachmentLoadOp::LOAD, ..Self::default() }
    }
}

/// Formats and sample count of attachments.
#[derive(Clone, Debug)]
pub struct Formats {
    /// Formats of the colour attachments.
    pub colors: Vec<vk::Format>,
    /// Format of depth, stencil or both; undefined if there is none.
    pub depth: vk::Format,
    /// Number of samples per pixel.
    pub samples: u32,
}

impl Formats {
    /// The formats of one colour attachment with one sample.
    pub fn of(color: vk::Format) -> Self {
        Self { colors: vec![color], depth: vk::Format::UNDEFINED, samples: 1 }
    }
}

/// A set of attachments to which passes draw.
pub trait Attachments {
    /// Width and height in pixels.
    fn size(&self) -> [u32; 2];

    /// Formats and samples.
    fn attachment_formats(&self) -> Formats;

    /// Records the beginning of a pass.
    fn begin(&self, device: &ash::Device, commands: vk::CommandBuffer, pass: &Pass);

    /// Records its end.
    fn end(&self, device: &ash::Device, commands: vk::CommandBuffer) {
        // SAFETY: see the crate.
        unsafe { device.cmd_end_rendering(commands) };
    }
}

/// An object that is bound as a graphics pipeline.
pub trait Bindable {
    /// The pipeline, and its layout for descriptor sets and push constants.
    fn handles(&self) -> (vk::Pipeline, vk::PipelineLayout);
}
