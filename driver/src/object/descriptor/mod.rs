//! Descriptors: layouts, the pools that sets come from, sets and what they hold, and update templates.
//!
//! A set is a flat array: its layout gives each binding a run of it, in order of binding numbers. So an update that
//! spills over into the next binding, as Vulkan allows, just goes on.

pub(crate) mod layout;
pub(crate) mod pool;
pub(crate) mod set;
pub(crate) mod template;

use crate::object::buffer_view::BufferView;
use crate::object::image::ImageView;
use crate::object::sampler::Sampler;
use simdevice::packet::BufferRange;
use std::sync::Arc;

/// What one element of a descriptor set holds.
#[derive(Clone, Debug, Default)]
pub(crate) enum Descriptor {
    /// Nothing: programs read zero from it.
    #[default]
    Empty,
    /// A uniform or storage buffer.
    Buffer(BufferDescriptor),
    /// A texel buffer.
    TexelBuffer(Arc<BufferView>),
    /// An image, a sampler, or both.
    Image {
        /// The image.
        view: Option<Arc<ImageView>>,
        /// The sampler.
        sampler: Option<Arc<Sampler>>,
    },
}

/// What a uniform or storage buffer's descriptor holds.
#[derive(Clone, Debug)]
pub(crate) struct BufferDescriptor {
    /// The bytes from the descriptor's offset to the end of the buffer.
    pub(crate) rest: BufferRange,
    /// How many of them count; `None` (`VK_WHOLE_SIZE`) for all.
    pub(crate) size: Option<u64>,
}

impl BufferDescriptor {
    /// The bytes that a program may reach, with a dynamic offset. They never go beyond the buffer.
    pub(crate) fn range(&self, dynamic_offset: u32) -> BufferRange {
        let offset = u64::from(dynamic_offset).min(self.rest.size);
        let rest = self.rest.size - offset;
        BufferRange {
            memory: Arc::clone(&self.rest.memory),
            offset: self.rest.offset + offset,
            size: self.size.map_or(rest, |size| size.min(rest)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simdevice::Allocation;

    #[test]
    fn dynamic_offsets_stay_inside_the_buffer() {
        let mut buffer = BufferDescriptor {
            rest: BufferRange {
                memory: Allocation::new_zeroed(4096).unwrap(),
                offset: 256,
                size: 100,
            },
            size: Some(64),
        };
        let range = |buffer: &BufferDescriptor, offset| {
            let range = buffer.range(offset);
            (range.offset, range.size)
        };
        assert_eq!(range(&buffer, 0), (256, 64));
        assert_eq!(range(&buffer, 64), (320, 36));
        assert_eq!(range(&buffer, 4000), (356, 0));
        buffer.size = None;
        assert_eq!(range(&buffer, 64), (320, 36));
    }
}
