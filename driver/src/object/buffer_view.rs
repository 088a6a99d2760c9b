//! Buffer views: ranges of buffers read as texels.

use ash::vk;
use simdevice::Format;
use simdevice::packet::BufferRange;

/// A buffer view.
#[derive(Debug)]
pub(crate) struct BufferView {
    /// The bytes.
    pub(crate) range: BufferRange,
    /// How texels are stored in them.
    pub(crate) format: Format,
}

crate::objects! { vk::BufferView => BufferView; }
