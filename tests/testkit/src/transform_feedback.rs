//! Transform feedback: its commands, of which ash has the pointers only.

use ash::vk;

use crate::gpu::{Commands, Gpu};
use crate::resource::Buffer;

/// The commands of a device with `VK_EXT_transform_feedback`.
pub struct TransformFeedback(ash::ext::transform_feedback::Device);

/// A place in a buffer.
pub type Place<'a> = (&'a Buffer, vk::DeviceSize);

fn split(places: &[Place<'_>]) -> (Vec<vk::Buffer>, Vec<vk::DeviceSize>) {
    places.iter().map(|(buffer, offset)| (buffer.raw, *offset)).unzip()
}

impl TransformFeedback {
    /// The commands of a device.
    pub fn new(gpu: &Gpu) -> Self {
        let device = ash::ext::transform_feedback::Device::new(gpu.instance(), gpu.device());
        Self(device)
    }

    /// The flags of buffers that transform feedback writes, and of those with counters.
    pub fn usage() -> vk::BufferUsageFlags {
        vk::BufferUsageFlags::TRANSFORM_FEEDBACK_BUFFER_EXT
            | vk::BufferUsageFlags::TRANSFORM_FEEDBACK_COUNTER_BUFFER_EXT
    }

    /// Binds buffers from number `first` on.
    pub fn bind(&self, commands: &Commands, first: u32, places: &[Place<'_>]) {
        let (buffers, offsets) = split(places);
        // SAFETY: see the crate.
        unsafe {
            (self.0.fp().cmd_bind_transform_feedback_buffers_ext)(
                commands.raw().1,
                first,
                buffers.len() as u32,
                buffers.as_ptr(),
                offsets.as_ptr(),
                std::ptr::null(),
            );
        }
    }

    /// Makes it active. Buffers continue where their counters say.
    pub fn begin(&self, commands: &Commands, counters: &[Place<'_>]) {
        let (buffers, offsets) = split(counters);
        // SAFETY: see the crate.
        unsafe {
            (self.0.fp().cmd_begin_transform_feedback_ext)(
                commands.raw().1,
                0,
                buffers.len() as u32,
                buffers.as_ptr(),
                offsets.as_ptr(),
            );
        }
    }

    /// Ends it, and stores the counters.
    pub fn end(&self, commands: &Commands, counters: &[Place<'_>]) {
        let (buffers, offsets) = split(counters);
        // SAFETY: see the crate.
        unsafe {
            (self.0.fp().cmd_end_transform_feedback_ext)(
                commands.raw().1,
                0,
                buffers.len() as u32,
                buffers.as_ptr(),
                offsets.as_ptr(),
            );
        }
    }

    /// Draws the vertices of `stride` bytes that a counter counts, after the first `skipped` bytes.
    pub fn draw(&self, commands: &Commands, instances: u32, (counter, offset): Place<'_>, skipped: u32, stride: u32) {
        // SAFETY: see the crate.
        unsafe {
            (self.0.fp().cmd_draw_indirect_byte_count_ext)(
                commands.raw().1,
                instances,
                0,
                counter.raw,
                offset,
                skipped,
                stride,
            );
        }
    }

    /// Begins a query of a vertex stream.
    pub fn begin_query(&self, commands: &Commands, pool: vk::QueryPool, query: u32, stream: u32) {
        let flags = vk::QueryControlFlags::empty();
        // SAFETY: see the crate.
        unsafe {
            let begin = self.0.fp().cmd_begin_query_indexed_ext;
            begin(commands.raw().1, pool, query, flags, stream);
        }
    }

    /// Ends a query of a vertex stream.
    pub fn end_query(&self, commands: &Commands, pool: vk::QueryPool, query: u32, stream: u32) {
        // SAFETY: see the crate.
        unsafe {
            let end = self.0.fp().cmd_end_query_indexed_ext;
            end(commands.raw().1, pool, query, stream);
        }
    }
}
