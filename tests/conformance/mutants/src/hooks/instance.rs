//! Instances and devices; what a physical device says of itself.

use std::mem::transmute;
use std::sync::{PoisonError, RwLock};

use ash::vk;
use gaurast::vk::{
    PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as Features,
    PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST as Properties,
};

use crate::below::{Below, below, remember};
use crate::table::*;
use crate::{environment, next};
use gaurast_layer_interface::{DeviceLink, InstanceLink, find_mut, take_link};

/// What the layer below says of a physical device. The commands are looked up as the instance is created, since the
/// loader gives the first layer's functions later.
#[derive(Clone, Copy)]
struct Answers {
    destroy: vk::PFN_vkDestroyInstance,
    features: vk::PFN_vkGetPhysicalDeviceFeatures2,
    properties: vk::PFN_vkGetPhysicalDeviceProperties2,
}

static ANSWERS: RwLock<Option<Answers>> = RwLock::new(None);

fn answers() -> Option<Answers> {
    *ANSWERS.read().unwrap_or_else(PoisonError::into_inner)
}

pub(super) unsafe extern "system" fn create_instance(
    info: *const vk::InstanceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    instance: *mut vk::Instance,
) -> vk::Result {
    environment::choose();
    // SAFETY: see the crate; the loader's link is in the chain, and gives commands by name.
    unsafe {
        let Some(link) = take_link::<InstanceLink>((*info).p_next) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let get = link.get_instance_proc_addr;
        let Some(create) = get(vk::Instance::null(), c"vkCreateInstance".as_ptr()) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let create = transmute::<unsafe extern "system" fn(), vk::PFN_vkCreateInstance>(create);
        let result = create(info, allocator, instance);
        if result != vk::Result::SUCCESS {
            return result;
        }
        let found = (|| {
            Some(Answers {
                destroy: transmute::<unsafe extern "system" fn(), vk::PFN_vkDestroyInstance>(get(
                    *instance,
                    c"vkDestroyInstance".as_ptr(),
                )?),
                features: transmute::<unsafe extern "system" fn(), vk::PFN_vkGetPhysicalDeviceFeatures2>(get(
                    *instance,
                    c"vkGetPhysicalDeviceFeatures2".as_ptr(),
                )?),
                properties: transmute::<unsafe extern "system" fn(), vk::PFN_vkGetPhysicalDeviceProperties2>(get(
                    *instance,
                    c"vkGetPhysicalDeviceProperties2".as_ptr(),
                )?),
            })
        })();
        *ANSWERS.write().unwrap_or_else(PoisonError::into_inner) = found;
        remember(Below {
            instance: *instance,
            get_instance_proc_addr: get,
            get_physical_device_proc_addr: link.get_physical_device_proc_addr,
            get_device_proc_addr: None,
        });
        result
    }
}

pub(super) unsafe extern "system" fn destroy_instance(
    instance: vk::Instance,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    environment::report();
    if let Some(answers) = answers() {
        // SAFETY: see the crate.
        unsafe { (answers.destroy)(instance, allocator) };
    }
}

pub(super) unsafe extern "system" fn create_device(
    physical_device: vk::PhysicalDevice,
    info: *const vk::DeviceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    device: *mut vk::Device,
) -> vk::Result {
    // SAFETY: see the crate; the loader's link is in the chain, and gives commands by name.
    unsafe {
        let failed = vk::Result::ERROR_INITIALIZATION_FAILED;
        let (Some(below), Some(link)) = (below(), take_link::<DeviceLink>((*info).p_next)) else {
            return failed;
        };
        let Some(create) = (link.get_instance_proc_addr)(below.instance, c"vkCreateDevice".as_ptr()) else {
            return failed;
        };
        let create = transmute::<unsafe extern "system" fn(), vk::PFN_vkCreateDevice>(create);
        let result = create(physical_device, info, allocator, device);
        if result == vk::Result::SUCCESS {
            let get = link.get_device_proc_addr;
            let below = Below { get_device_proc_addr: Some(get), ..below };
            remember(below);
            next::load(|name| get(*device, name.as_ptr()));
        }
        result
    }
}

pub(super) unsafe extern "system" fn get_physical_device_features2(
    physical_device: vk::PhysicalDevice,
    features: *mut vk::PhysicalDeviceFeatures2<'_>,
) {
    let Some(answers) = answers() else {
        return;
    };
    // SAFETY: see the crate.
    unsafe {
        (answers.features)(physical_device, features);
        if let Some(own) = find_mut::<Features<'_>>((*features).p_next) {
            BASE_FEATURE.replaces(&mut own.gaussian_primitive_topology, vk::FALSE);
        }
    }
}

pub(super) unsafe extern "system" fn get_physical_device_properties2(
    physical_device: vk::PhysicalDevice,
    properties: *mut vk::PhysicalDeviceProperties2<'_>,
) {
    let Some(answers) = answers() else {
        return;
    };
    // SAFETY: see the crate.
    unsafe {
        (answers.properties)(physical_device, properties);
        if let Some(own) = find_mut::<Properties<'_>>((*properties).p_next) {
            TILE_SIZE.replaces(&mut own.tile_size, vk::Extent2D::default());
            MAX_DEGREE.replaces(&mut own.max_spherical_harmonics_degree, 2);
            SAMPLE_COUNTS.replaces(&mut own.gaussian_sample_counts, vk::SampleCountFlags::TYPE_4);
            MAX_PER_DRAW.replaces(&mut own.max_gaussians_per_draw, 0xffff);
            MAX_PER_SET.replaces(&mut own.max_gaussians_per_set, 1);
        }
    }
}
