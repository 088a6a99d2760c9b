//! Instances, messengers, and the creation of devices.

use std::ffi::CStr;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use ash::vk::{self, TaggedStructure};
use gaurast::vk::{
    PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as FeaturesStructure,
    PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST as Properties,
};

use crate::device::Device;
use crate::facts::{Facts, Features};
use crate::instance::Instance;
use crate::report::Faults;
use crate::rules;
use gaurast_layer_interface::{DeviceLink, InstanceLink, chain, find, slice, string, take_link};

pub(super) unsafe extern "system" fn create_instance(
    info: *const vk::InstanceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    instance: *mut vk::Instance,
) -> vk::Result {
    // SAFETY: see the module; the loader's link is in the chain.
    unsafe {
        let Some(link) = take_link::<InstanceLink>((*info).p_next) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let get = link.get_instance_proc_addr;
        let Some(create) = get(vk::Instance::null(), c"vkCreateInstance".as_ptr()) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let create = std::mem::transmute::<unsafe extern "system" fn(), vk::PFN_vkCreateInstance>(create);
        let result = create(info, allocator, instance);
        if result == vk::Result::SUCCESS {
            let register = AssertUnwindSafe(|| Instance::register(*instance, &link));
            let _ = catch_unwind(register);
        }
        result
    }
}

pub(super) unsafe extern "system" fn destroy_instance(
    instance: vk::Instance,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    if instance == vk::Instance::null() {
        return;
    }
    // SAFETY: see the module.
    unsafe {
        let Some(forgotten) = Instance::forget(instance) else {
            return;
        };
        if let Some(destroy) = forgotten.next.destroy {
            destroy(instance, allocator);
        }
    }
}

pub(super) unsafe extern "system" fn create_messenger(
    instance: vk::Instance,
    info: *const vk::DebugUtilsMessengerCreateInfoEXT<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    messenger: *mut vk::DebugUtilsMessengerEXT,
) -> vk::Result {
    // SAFETY: see the module.
    unsafe {
        let Some(own) = Instance::of(instance) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let Some(create) = own.next.create_messenger else {
            return vk::Result::ERROR_EXTENSION_NOT_PRESENT;
        };
        let result = create(instance, info, allocator, messenger);
        if result == vk::Result::SUCCESS {
            own.messengers.add(*messenger, &*info);
        }
        result
    }
}

pub(super) unsafe extern "system" fn destroy_messenger(
    instance: vk::Instance,
    messenger: vk::DebugUtilsMessengerEXT,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    // SAFETY: see the module.
    unsafe {
        let Some(own) = Instance::of(instance) else {
            return;
        };
        own.messengers.remove(messenger);
        if let Some(destroy) = own.next.destroy_messenger {
            destroy(instance, messenger, allocator);
        }
    }
}

pub(super) unsafe extern "system" fn create_device(
    physical_device: vk::PhysicalDevice,
    info: *const vk::DeviceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    device: *mut vk::Device,
) -> vk::Result {
    // SAFETY: see the module; the loader's link is in the chain.
    unsafe {
        let failed = vk::Result::ERROR_INITIALIZATION_FAILED;
        let Some(instance) = Instance::of(physical_device) else {
            return failed;
        };
        let Some(link) = take_link::<DeviceLink>((*info).p_next) else {
            return failed;
        };
        let get = link.get_instance_proc_addr;
        let Some(create) = get(instance.next_instance.handle, c"vkCreateDevice".as_ptr()) else {
            return failed;
        };
        let create = std::mem::transmute::<unsafe extern "system" fn(), vk::PFN_vkCreateDevice>(create);
        let result = create(physical_device, info, allocator, device);
        let (info, created) = (&*info, (result == vk::Result::SUCCESS).then(|| *device));
        let looked = catch_unwind(AssertUnwindSafe(|| {
            look(physical_device, info, created, &instance, &link);
        }));
        if looked.is_err() {
            eprintln!("VK_LAYER_GAURAST_validation: a defect of the layer; a device goes unchecked");
        }
        result
    }
}

/// # Safety
/// Handles and the creation info are valid.
unsafe fn look(
    physical_device: vk::PhysicalDevice,
    info: &vk::DeviceCreateInfo<'_>,
    created: Option<vk::Device>,
    instance: &Arc<Instance>,
    link: &DeviceLink,
) {
    let mut faults = Faults::default();
    // SAFETY: the caller's promise.
    let (names, features, can, of_core) = unsafe {
        let names = slice(info.pp_enabled_extension_names, info.enabled_extension_count);
        let names: Vec<&CStr> = names.iter().map(|&name| string(name)).collect();
        let mut structures = chain(info.p_next);
        let found = structures.find(|s| s.s_type == FeaturesStructure::STRUCTURE_TYPE);
        let features = found.map(|found| Features::of(&*std::ptr::from_ref(found).cast::<FeaturesStructure<'_>>()));
        (names, features, supported(physical_device, instance), core_features(info))
    };
    rules::device::check(&names, features.as_ref(), can.as_ref(), &mut faults);
    let is_enabled = names.contains(&gaurast::gaussian_primitive_topology::NAME);
    // SAFETY: the caller's promise.
    let facts = unsafe { facts(physical_device, instance, is_enabled, features, &of_core) };
    for fault in &faults.0 {
        instance.messengers.tell(fault);
    }
    if let Some(device) = created {
        let get = link.get_device_proc_addr;
        Device::new(device, physical_device, get, Arc::clone(instance), facts).register();
    }
}

/// The features of Vulkan 1.0 that a device is created with.
///
/// # Safety
/// The creation info is valid.
unsafe fn core_features(info: &vk::DeviceCreateInfo<'_>) -> vk::PhysicalDeviceFeatures {
    // SAFETY: the caller's promise.
    unsafe {
        let chained = find::<vk::PhysicalDeviceFeatures2<'_>>(info.p_next).map(|all| all.features);
        chained.or(info.p_enabled_features.as_ref().copied()).unwrap_or_default()
    }
}

/// The features of the extension that a physical device has, if it tells.
///
/// # Safety
/// The physical device is valid.
unsafe fn supported(physical_device: vk::PhysicalDevice, instance: &Instance) -> Option<Features> {
    // SAFETY: the caller's promise; the structures are valid.
    unsafe {
        let get = instance.next.features?;
        let mut own = FeaturesStructure::default();
        let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut own);
        get(physical_device, &raw mut all);
        (own.gaussian_primitive_topology != 0).then(|| Features::of(&own))
    }
}

/// # Safety
/// The physical device is valid.
unsafe fn facts(
    physical_device: vk::PhysicalDevice,
    instance: &Instance,
    is_enabled: bool,
    features: Option<Features>,
    of_core: &vk::PhysicalDeviceFeatures,
) -> Facts {
    let none = Features::of(&FeaturesStructure::default());
    let mut own = Properties::default();
    let mut views = vk::PhysicalDeviceMultiviewProperties::default();
    let mut memory = vk::PhysicalDeviceMemoryProperties::default();
    // SAFETY: the caller's promise; the structures are valid.
    unsafe {
        if let Some(get) = instance.next.properties {
            let all = vk::PhysicalDeviceProperties2::default().push_next(&mut views);
            let mut all = all.push_next(&mut own);
            get(physical_device, &raw mut all);
        }
        if let Some(get) = instance.next.memory_properties {
            get(physical_device, &raw mut memory);
        }
    }
    let types = memory.memory_types_as_slice().iter().enumerate();
    let mappable = types
        .filter(|(_, ty)| ty.property_flags.contains(vk::MemoryPropertyFlags::HOST_VISIBLE))
        .fold(0, |bits, (index, _)| bits | 1 << index);
    Facts {
        has_extension: is_enabled,
        features: features.filter(|_| is_enabled).unwrap_or(none),
        max_degree: own.max_spherical_harmonics_degree,
        sample_counts: own.gaussian_sample_counts,
        max_gaussians_per_draw: own.max_gaussians_per_draw,
        max_views: views.max_multiview_view_count.max(1),
        has_multi_draw_indirect: of_core.multi_draw_indirect != 0,
        has_first_instance: of_core.draw_indirect_first_instance != 0,
        mappable,
    }
}
