//! Private data slots.

use crate::entry_points;
use crate::object::private_data::PrivateDataSlot;
use crate::{handle, pointer};
use ash::vk;
use std::sync::Arc;

entry_points! {
    #[doc(alias = "vkCreatePrivateDataSlot")]
    fn create_private_data_slot(
        _device: vk::Device,
        _info: *const vk::PrivateDataSlotCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        slot: *mut vk::PrivateDataSlot,
    ) -> vk::Result {
        pointer::output(slot, handle::create(Arc::new(PrivateDataSlot::default())))
    }

    #[doc(alias = "vkSetPrivateData")]
    fn set_private_data(
        _device: vk::Device,
        object_type: vk::ObjectType,
        object: u64,
        slot: vk::PrivateDataSlot,
        data: u64,
    ) -> vk::Result {
        handle::get(slot)?.set(handle::serial(object_type, object)?, data);
        Ok(())
    }

    #[doc(alias = "vkGetPrivateData")]
    fn get_private_data(
        _device: vk::Device,
        object_type: vk::ObjectType,
        object: u64,
        slot: vk::PrivateDataSlot,
        data: *mut u64,
    ) {
        let object = handle::serial(object_type, object)?;
        pointer::output(data, handle::get(slot)?.get(object))
    }
}
