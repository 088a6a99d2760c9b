//! The queue family: one, with one queue that does everything.

use ash::vk;

/// The index of the family.
pub(crate) const FAMILY: u32 = 0;

/// How many queues it has.
pub(crate) const COUNT: u32 = 1;

/// `VkQueueFamilyProperties` of the family. Timestamps are the host's nanoseconds in 64 bits.
pub(crate) fn properties() -> vk::QueueFamilyProperties {
    vk::QueueFamilyProperties {
        queue_flags: vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE | vk::QueueFlags::TRANSFER,
        queue_count: COUNT,
        timestamp_valid_bits: 64,
        min_image_transfer_granularity: vk::Extent3D {
            width: 1,
            height: 1,
            depth: 1,
        },
    }
}
