//! Priorities of queues in the system: there is one, the default.

use ash::vk;
use gaurast_testkit::devices::own;

/// Creates a device with a queue of a global priority, and destroys it.
fn create(priority: vk::QueueGlobalPriorityKHR) -> Result<(), vk::Result> {
    let gpu = own();
    let mut global = vk::DeviceQueueGlobalPriorityCreateInfoKHR::default().global_priority(priority);
    let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0]).push_next(&mut global)];
    let mut features = vk::PhysicalDeviceGlobalPriorityQueryFeaturesKHR::default().global_priority_query(true);
    let names = [ash::khr::global_priority::NAME.as_ptr()];
    let info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&names)
        .push_next(&mut features);
    // SAFETY: see the crate.
    unsafe {
        let device = gpu.instance().create_device(gpu.physical_device(), &info, None)?;
        device.destroy_device(None);
    }
    Ok(())
}

#[gaurast_runner::test]
fn queues_have_the_priority_that_their_family_lists() {
    use vk::QueueGlobalPriorityKHR as Priority;
    let gpu = own();
    let mut priorities = [vk::QueueFamilyGlobalPriorityPropertiesKHR::default(); 3];
    let mut families: Vec<_> =
        priorities.iter_mut().map(|it| vk::QueueFamilyProperties2::default().push_next(it)).collect();
    // SAFETY: see the crate.
    unsafe { gpu.instance().get_physical_device_queue_family_properties2(gpu.physical_device(), &mut families) };
    assert!(families.iter().all(|family| family.queue_family_properties.queue_count == 1));
    drop(families);
    for of_family in priorities {
        assert_eq!(of_family.priorities[..of_family.priority_count as usize], [Priority::MEDIUM]);
    }
    assert_eq!(create(Priority::MEDIUM), Ok(()));
    for other in [Priority::LOW, Priority::HIGH, Priority::REALTIME] {
        assert_eq!(create(other), Err(vk::Result::ERROR_INITIALIZATION_FAILED), "{other:?}");
    }
}
