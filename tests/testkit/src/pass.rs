//! Passes: how they begin and end, and what commands are told of targets and pipelines.

use ash::vk;

/// How a pass begins and ends.
#[derive(Clone, Copy)]
pub struct Pass {
    /// What all colour attachments are cleared to.
    pub color: vk::ClearColorValue,
    /// What depth and stencil are cleared to.
    pub depth: vk::ClearDepthStencilValue,
    /// What becomes of the attachments' contents at the beginning.
    pub load: vk::AttachmentLoadOp,
    /// What becomes of them at the end.
    pub store: vk::AttachmentStoreOp,
    /// The area drawn to; everything by default.
    pub area: Option<vk::Rect2D>,
    /// Whether draws come from secondary command buffers.
    pub flags: vk::RenderingFlags,
}

impl Default for Pass {
    fn default() -> Self {
        Self {
            color: vk::ClearColorValue {
                float32: [0.1, 0.2, 0.3, 1.0],
            },
            depth: vk::ClearDepthStencilValue {
                depth: 1.0,
                stencil: 0,
            },
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
        Self {
            color: vk::ClearColorValue { uint32: [0; 4] },
            ..Self::default()
        }
    }

    /// A pass that clears to a colour.
    pub fn clear(float32: [f32; 4]) -> Self {
        Self {
            color: vk::ClearColorValue { float32 },
            ..Self::default()
        }
    }

    /// A pass that goes on with what is there.
    pub fn load() -> Self {
        Self {
            load: vk::AttachmentLoadOp::LOAD,
            ..Self::default()
        }
    }
}

/// Formats of attachments, and their samples.
#[derive(Clone, Debug)]
pub struct Formats {
    /// Of colour.
    pub colors: Vec<vk::Format>,
    /// Of depth, stencil or both; undefined if there is none.
    pub depth: vk::Format,
    /// Samples of a pixel.
    pub samples: u32,
}

impl Formats {
    /// One colour attachment of one sample.
    pub fn of(color: vk::Format) -> Self {
        Self {
            colors: vec![color],
            depth: vk::Format::UNDEFINED,
            samples: 1,
        }
    }
}

/// What passes draw to.
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

/// What is bound as a pipeline.
pub trait Bindable {
    /// The pipeline, and the layout by which descriptor sets and push constants reach it.
    fn handles(&self) -> (vk::Pipeline, vk::PipelineLayout);
}
