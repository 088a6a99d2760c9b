//! Buffer views.

use crate::capabilities::formats;
use crate::capabilities::limits::MIN_BUFFER_OFFSET_ALIGNMENT;
use crate::error::Error;
use crate::object::buffer_view::BufferView;
use crate::{handle, pointer};
use ash::vk;
use std::sync::Arc;

crate::entry_points! {
    #[doc(alias = "vkCreateBufferView")]
    fn create_buffer_view(
        _device: vk::Device,
        create_info: *const vk::BufferViewCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        view: *mut vk::BufferView,
    ) -> vk::Result {
        let info = pointer::input(create_info)?;
        let size = (info.range != vk::WHOLE_SIZE).then_some(info.range);
        let format = formats::device_format(info.format).ok_or_else(|| {
            Error::FormatNotSupported(format!("{:?} is not supported for buffer views", info.format))
        })?;
        if !info.offset.is_multiple_of(MIN_BUFFER_OFFSET_ALIGNMENT) {
            return Err(Error::usage(
                "VUID-VkBufferViewCreateInfo-offset-02749",
                format!("the offset {} is not a multiple of {MIN_BUFFER_OFFSET_ALIGNMENT}", info.offset),
            ));
        }
        let object = BufferView {
            range: handle::get(info.buffer)?.range(info.offset, size)?,
            format,
        };
        pointer::output(view, handle::create(Arc::new(object)))
    }
}
