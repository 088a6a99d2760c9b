//! Reading of buffers, descriptors and cameras as a draw executes.

use ash::vk;

use crate::facts::Camera;
use crate::objects::BufferDescriptor;
use crate::recording::Draw;

/// Reads bytes of a buffer by offset and number, where the layer is sure of them.
pub(crate) trait Reader {
    /// Bytes, or nothing if the layer does not know them all.
    fn read(&self, buffer: vk::Buffer, offset: u64, length: u64) -> Option<Vec<u8>>;

    /// The size of a buffer.
    fn size(&self, buffer: vk::Buffer) -> Option<u64>;

    /// Reports whether the draw has been executed.
    fn is_late(&self) -> bool;

    /// Reports whether the buffer that had a handle still does, by its number.
    fn lives(&self, buffer: vk::Buffer, serial: u64) -> bool;

    /// Reports whether cameras were seen that differ from this one in their principal points alone.
    fn is_part_of_a_picture(&self, camera: &Camera) -> bool;

    /// The buffer of a descriptor; nothing if the layer does not know it, or a fault's text if it is not there.
    fn descriptor(&self, draw: &Draw) -> Option<Result<BufferDescriptor, String>>;
}
