//! Logical devices and their queues.

use crate::capabilities::extensions;
use crate::capabilities::features;
use crate::capabilities::queues;
use crate::dispatch;
use crate::entry_points;
use crate::environment;
use crate::error::Error;
use crate::handle;
use crate::object::device::Device;
use crate::pointer;
use crate::registry;
use ash::vk;
use std::ffi::{CStr, c_char};

/// How many queues are asked for.
unsafe fn queue_count(info: &vk::DeviceCreateInfo<'_>) -> Result<u32, Error> {
    // SAFETY: the caller promises a valid creation info.
    let families =
        unsafe { pointer::slice(info.p_queue_create_infos, info.queue_create_info_count)? };
    for family in families {
        if family.queue_family_index != queues::FAMILY || family.queue_count > queues::COUNT {
            return Err(Error::InitializationFailed(format!(
                "{} queues of family {} were asked for; there is family {} with {}",
                family.queue_count,
                family.queue_family_index,
                queues::FAMILY,
                queues::COUNT
            )));
        }
        if !family.flags.is_empty() {
            return Err(Error::FeatureNotPresent(
                "a queue's creation flag".to_owned(),
            ));
        }
    }
    Ok(families
        .iter()
        .map(|family| family.queue_count)
        .max()
        .unwrap_or(0))
}

entry_points! {
    #[doc(alias = "vkCreateDevice")]
    fn create_device(
        physical_device: vk::PhysicalDevice,
        info: *const vk::DeviceCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        device: *mut vk::Device,
    ) -> vk::Result {
        let physical_device = handle::get(physical_device)?;
        let info = pointer::input(info)?;
        let names = pointer::strings(info.pp_enabled_extension_names, info.enabled_extension_count)?;
        let extensions = extensions::resolve(registry::extensions::DEVICE, &names)?;
        let features = features::requested(info, &extensions)?;
        let created = Device::new(
            physical_device.require_instance()?,
            extensions,
            features,
            environment::open_device()?,
            queue_count(info)?,
        )?;
        pointer::output(device, handle::create(created))
    }

    #[doc(alias = "vkDestroyDevice")]
    fn destroy_device(
        device: vk::Device,
        _allocator: *const vk::AllocationCallbacks<'_>,
    ) {
        if let Some(device) = handle::destroy(device)? {
            device.stop();
        }
        Ok(())
    }

    #[doc(alias = "vkGetDeviceProcAddr")]
    fn get_device_proc_addr(device: vk::Device, name: *const c_char) -> vk::PFN_vkVoidFunction {
        let device = handle::get(device)?;
        let name: &CStr = pointer::string(name).ok_or(Error::NullPointer { what: "name" })?;
        Ok(dispatch::device_command(name, &device.enabled()))
    }

    #[doc(alias = "vkGetDeviceQueue")]
    fn get_device_queue(
        device: vk::Device,
        family: u32,
        index: u32,
        queue: *mut vk::Queue,
    ) {
        let found = if family == queues::FAMILY { handle::get(device)?.queue(index) } else { None };
        pointer::output(queue, found.unwrap_or_default())
    }

    #[doc(alias = "vkGetDeviceQueue2")]
    fn get_device_queue2(
        device: vk::Device,
        info: *const vk::DeviceQueueInfo2<'_>,
        queue: *mut vk::Queue,
    ) {
        let device = handle::get(device)?;
        let info = pointer::input(info)?;
        let matches = info.queue_family_index == queues::FAMILY && info.flags.is_empty();
        let found = if matches { device.queue(info.queue_index) } else { None };
        pointer::output(queue, found.unwrap_or_default())
    }

    #[doc(alias = "vkGetDeviceGroupPeerMemoryFeatures")]
    fn get_device_group_peer_memory_features(
        _device: vk::Device,
        _heap: u32,
        _local: u32,
        _remote: u32,
        features: *mut vk::PeerMemoryFeatureFlags,
    ) {
        // A group has one device, which is no peer of itself.
        pointer::output(features, vk::PeerMemoryFeatureFlags::empty())
    }

    #[doc(alias = "vkAcquireProfilingLockKHR")]
    fn acquire_profiling_lock_khr(
        device: vk::Device,
        _info: *const vk::AcquireProfilingLockInfoKHR<'_>,
    ) -> vk::Result {
        // Counters are always on and nobody else has them, so there is nothing to wait for.
        handle::get(device).map(|_| ())
    }
}
