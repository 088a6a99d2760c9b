//! Private data slots.

use crate::entry_points;
use crate::object::private_data::PrivateDataSlot;
use crate::{handle, pointer};
use ash::vk;
use std::sync::Arc;

entry_points! {
    fn create_private_data_slot(
        _device: vk::Device,
        _info: *const vk::PrivateDataSlotCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        slot: *mut vk::PrivateDataSlot,
    ) -> vk::Result {
        pointer::output(slot, handle::create(Arc::new(PrivateDataSlot::default())))
    }

    fn destroy_private_data_slot(
        _device: vk::Device,
        slot: vk::PrivateDataSlot,
        _allocator: *const vk::AllocationCallbacks<'_>,
    ) {
        handle::destroy(slot).map(drop)
    }

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
