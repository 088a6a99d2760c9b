//! Instances, physical devices, and the creation of devices.

use std::collections::HashMap;
use std::ffi::{CStr, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use ash::vk;
use gaurast::gaussian_primitive_topology::{NAME, SPEC_VERSION};
use gaurast::vk::PhysicalDeviceGaussianPrecisionPropertiesGAURAST as PrecisionProperties;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as Features;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST as Properties;
use gaurast_layer_interface::{
    DeviceLink, InstanceLink, NextInstance, command, find_mut, set_loader_data, slice, string, take_link,
};

use crate::below::BELOW;
use crate::device::Device;
use crate::emulation::Emulation;
use crate::instance::Instance;
use crate::next::Next;
use crate::precision;
use crate::report::tell;
use crate::self_test::{self, TestQueue};
use crate::support;
use crate::unlinked::Unlinked;

/// The layer's name.
const LAYER: &CStr = c"VK_LAYER_GAURAST_emulation";

const FAILED: vk::Result = vk::Result::ERROR_INITIALIZATION_FAILED;

pub(super) unsafe extern "system" fn create_instance(
    info: *const vk::InstanceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    instance: *mut vk::Instance,
) -> vk::Result {
    // SAFETY: see the crate; where a layer is created, the loader's link is in the chain.
    unsafe {
        let link = take_link::<InstanceLink>((*info).p_next);
        let get = match (&link, BELOW.get()) {
            (Some(link), _) => link.get_instance_proc_addr,
            (None, Some(below)) => below.static_fn().get_instance_proc_addr,
            (None, None) => return FAILED,
        };
        let none = vk::Instance::null();
        let Some(create) = command::<vk::PFN_vkCreateInstance>(get, none, c"vkCreateInstance") else {
            return FAILED;
        };
        let result = create(info, allocator, instance);
        if result == vk::Result::SUCCESS {
            let version = (*info).p_application_info.as_ref().map_or(0, |application| application.api_version);
            let next_instance = NextInstance {
                handle: *instance,
                get_instance_proc_addr: get,
                get_physical_device_proc_addr: link.and_then(|link| link.get_physical_device_proc_addr),
            };
            let register = AssertUnwindSafe(|| Instance::register(next_instance, version));
            let _ = catch_unwind(register);
        }
        result
    }
}

pub(super) unsafe extern "system" fn destroy_instance(
    instance: vk::Instance,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        if instance == vk::Instance::null() {
            return;
        }
        if let Some(own) = Instance::forget(instance) {
            (own.next.fp_v1_0().destroy_instance)(instance, allocator);
        }
    }
}

pub(super) unsafe extern "system" fn enumerate_device_extension_properties(
    physical_device: vk::PhysicalDevice,
    layer: *const c_char,
    count: *mut u32,
    properties: *mut vk::ExtensionProperties,
) -> vk::Result {
    // SAFETY: see the crate.
    unsafe {
        let Some(instance) = Instance::of(physical_device) else {
            return FAILED;
        };
        let next = instance.next.fp_v1_0().enumerate_device_extension_properties;
        let is_own = !layer.is_null() && string(layer) == LAYER;
        if (!layer.is_null() && !is_own) || !instance.emulates(physical_device) {
            if is_own {
                *count = 0;
                return vk::Result::SUCCESS;
            }
            return next(physical_device, layer, count, properties);
        }
        let mut all = if is_own {
            Vec::new()
        } else {
            match instance.next.enumerate_device_extension_properties(physical_device) {
                Ok(all) => all,
                Err(error) => return error,
            }
        };
        all.retain(|extension| extension.extension_name_as_c_str() != Ok(NAME));
        let mut own = vk::ExtensionProperties { spec_version: SPEC_VERSION, ..Default::default() };
        for (to, from) in own.extension_name.iter_mut().zip(NAME.to_bytes_with_nul()) {
            *to = *from as c_char;
        }
        all.push(own);
        if properties.is_null() {
            *count = all.len() as u32;
            return vk::Result::SUCCESS;
        }
        let given = all.len().min(*count as usize);
        std::ptr::copy_nonoverlapping(all.as_ptr(), properties, given);
        *count = given as u32;
        if given < all.len() { vk::Result::INCOMPLETE } else { vk::Result::SUCCESS }
    }
}

pub(super) unsafe extern "system" fn get_physical_device_features2(
    physical_device: vk::PhysicalDevice,
    features: *mut vk::PhysicalDeviceFeatures2<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        let Some(instance) = Instance::of(physical_device) else {
            return;
        };
        let next = instance.next.fp_v1_1().get_physical_device_features2;
        if !instance.emulates(physical_device) {
            return next(physical_device, features);
        }
        let unlinked = Unlinked::<Features<'_>>::new(&raw mut (*features).p_next);
        next(physical_device, features);
        drop(unlinked);
        let can_store = (*features).features.vertex_pipeline_stores_and_atomics != vk::FALSE;
        if let Some(own) = find_mut::<Features<'_>>((*features).p_next) {
            support::answer_features(own, can_store);
        }
    }
}

pub(super) unsafe extern "system" fn get_physical_device_properties2(
    physical_device: vk::PhysicalDevice,
    properties: *mut vk::PhysicalDeviceProperties2<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        let Some(instance) = Instance::of(physical_device) else {
            return;
        };
        let next = instance.next.fp_v1_1().get_physical_device_properties2;
        if !instance.emulates(physical_device) {
            return next(physical_device, properties);
        }
        let unlinked = Unlinked::<Properties<'_>>::new(&raw mut (*properties).p_next);
        let also_unlinked = Unlinked::<PrecisionProperties<'_>>::new(&raw mut (*properties).p_next);
        next(physical_device, properties);
        // In the order in which each is where it was.
        drop(also_unlinked);
        drop(unlinked);
        let limits = (*properties).properties.limits;
        if let Some(own) = find_mut::<Properties<'_>>((*properties).p_next) {
            support::answer_properties(own, &limits);
        }
        if let Some(own) = find_mut::<PrecisionProperties<'_>>((*properties).p_next) {
            own.precision_class = precision::class();
        }
    }
}

pub(super) unsafe extern "system" fn create_device(
    physical_device: vk::PhysicalDevice,
    info: *const vk::DeviceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    device: *mut vk::Device,
) -> vk::Result {
    let create = AssertUnwindSafe(|| {
        // SAFETY: see the crate.
        unsafe { create(physical_device, &*info, allocator, device) }
    });
    catch_unwind(create).unwrap_or(FAILED)
}

/// # Safety
/// See the crate.
unsafe fn create(
    physical_device: vk::PhysicalDevice,
    info: &vk::DeviceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    device: *mut vk::Device,
) -> vk::Result {
    // SAFETY: the caller's promise.
    unsafe {
        let Some(instance) = Instance::of(physical_device) else {
            return FAILED;
        };
        let link = take_link::<DeviceLink>(info.p_next);
        let get_instance =
            link.map_or(instance.next_instance.get_instance_proc_addr, |link| link.get_instance_proc_addr);
        let get = link.map_or(instance.next.fp_v1_0().get_device_proc_addr, |link| link.get_device_proc_addr);
        let found = command::<vk::PFN_vkCreateDevice>(get_instance, instance.next_instance.handle, c"vkCreateDevice");
        let Some(create) = found else {
            return FAILED;
        };
        let names = slice(info.pp_enabled_extension_names, info.enabled_extension_count);
        let is_wanted = names.iter().any(|&name| string(name) == NAME);
        if !is_wanted || !instance.emulates(physical_device) {
            let result = create(physical_device, info, allocator, device);
            if result == vk::Result::SUCCESS {
                let next = Arc::new(Next::new(*device, &instance, physical_device, get));
                Device::new(next, get, None).register();
            }
            return result;
        }
        let kept: Vec<*const c_char> = names.iter().copied().filter(|&name| string(name) != NAME).collect();
        let mut own = *info;
        own.enabled_extension_count = kept.len() as u32;
        own.pp_enabled_extension_names = kept.as_ptr();
        let mut needed = Needed::default();
        let changed = Changed::new(&mut own, &mut needed);
        let result = create(physical_device, &raw const own, allocator, device);
        drop(changed);
        if result != vk::Result::SUCCESS {
            return result;
        }
        let next = Arc::new(Next::new(*device, &instance, physical_device, get));
        let families = slice(info.p_queue_create_infos, info.queue_create_info_count);
        let mut queues = HashMap::new();
        for family in families {
            *queues.entry(family.queue_family_index).or_insert(0) += family.queue_count;
        }
        let queue = test_queue(&instance, physical_device, families)
            .map(|family| TestQueue { family, set_loader_data: set_loader_data(info.p_next) });
        let passed = match queue {
            Some(queue) if !precision::is_relaxed() => self_test::passes(&next, queue),
            _ => Ok(true),
        };
        let refusal = match passed {
            Ok(true) => {
                Device::new(Arc::clone(&next), get, Some(Emulation::new(&next, queues))).register();
                return vk::Result::SUCCESS;
            }
            Ok(false) => {
                tell(
                    "the device does not compute sums and products of pairs of binary32 as they are written, so that Gaussians would be wrong: the extension is refused; GAURAST_EMULATION_PRECISION=relaxed draws in binary32",
                );
                vk::Result::ERROR_FEATURE_NOT_PRESENT
            }
            Err(error) => {
                tell(&format!("the test of the device's arithmetic fails: {error}"));
                error
            }
        };
        next.destroy_device(allocator.as_ref());
        *device = vk::Device::null();
        refusal
    }
}

/// The first family of queues that runs kernels.
///
/// # Safety
/// The physical device is the instance's.
unsafe fn test_queue(
    instance: &Instance,
    physical_device: vk::PhysicalDevice,
    families: &[vk::DeviceQueueCreateInfo<'_>],
) -> Option<u32> {
    // SAFETY: the caller's promise.
    let all = unsafe { instance.next.get_physical_device_queue_family_properties(physical_device) };
    let computes = |family: &u32| {
        all.get(*family as usize).is_some_and(|family| family.queue_flags.contains(vk::QueueFlags::COMPUTE))
    };
    let usable = families.iter().filter(|family| family.flags.is_empty() && family.queue_count > 0);
    usable.map(|family| family.queue_family_index).find(computes)
}

/// The features that the emulation needs, as structures that are chained where the application has none with them.
#[derive(Default)]
struct Needed<'a> {
    features: vk::PhysicalDeviceFeatures,
    rendering: vk::PhysicalDeviceDynamicRenderingFeatures<'a>,
    address: vk::PhysicalDeviceBufferDeviceAddressFeatures<'a>,
    demote: vk::PhysicalDeviceShaderDemoteToHelperInvocationFeatures<'a>,
}

/// A chain of `VkDeviceCreateInfo` from which the extension's features are taken out, and in which the features that the emulation needs
/// are enabled. It is the application's again when this is dropped.
struct Changed {
    _unlinked: Unlinked<Features<'static>>,
    /// Features that were off.
    enabled: Vec<*mut vk::Bool32>,
}

impl Changed {
    /// # Safety
    /// The chain is valid, and nobody else uses it while this lives.
    unsafe fn new<'a>(info: &mut vk::DeviceCreateInfo<'a>, needed: &'a mut Needed<'a>) -> Self {
        // SAFETY: the caller's promise. The structures are restored as soon as the device is created.
        unsafe {
            let projects = find_mut::<Features<'_>>(info.p_next.cast_mut())
                .is_some_and(|features| features.vertex_shader_projection != vk::FALSE);
            let unlinked = Unlinked::new((&raw mut info.p_next).cast());
            let mut own = Self { _unlinked: unlinked, enabled: Vec::new() };
            let first = info.p_next.cast_mut();
            let address = match find_mut::<vk::PhysicalDeviceVulkan12Features<'_>>(first) {
                Some(all) => Some(&raw mut all.buffer_device_address),
                None => find_mut::<vk::PhysicalDeviceBufferDeviceAddressFeatures<'_>>(first)
                    .map(|one| &raw mut one.buffer_device_address),
            };
            let demote = match find_mut::<vk::PhysicalDeviceVulkan13Features<'_>>(first) {
                Some(all) => Some(&raw mut all.shader_demote_to_helper_invocation),
                None => find_mut::<vk::PhysicalDeviceShaderDemoteToHelperInvocationFeatures<'_>>(first)
                    .map(|one| &raw mut one.shader_demote_to_helper_invocation),
            };
            if projects {
                match find_mut::<vk::PhysicalDeviceFeatures2<'_>>(first) {
                    Some(all) => {
                        own.enable(Some(&raw mut all.features.vertex_pipeline_stores_and_atomics));
                    }
                    None => {
                        needed.features = info.p_enabled_features.as_ref().copied().unwrap_or_default();
                        needed.features.vertex_pipeline_stores_and_atomics = vk::TRUE;
                        info.p_enabled_features = &raw const needed.features;
                    }
                }
                let rendering = match find_mut::<vk::PhysicalDeviceVulkan13Features<'_>>(first) {
                    Some(all) => Some(&raw mut all.dynamic_rendering),
                    None => find_mut::<vk::PhysicalDeviceDynamicRenderingFeatures<'_>>(first)
                        .map(|one| &raw mut one.dynamic_rendering),
                };
                if !own.enable(rendering) {
                    needed.rendering.dynamic_rendering = vk::TRUE;
                    needed.rendering.p_next = info.p_next.cast_mut();
                    info.p_next = (&raw const needed.rendering).cast();
                }
            }
            // The extension's features may have been the first, which the copied creation info names.
            if !own.enable(address) {
                needed.address.buffer_device_address = vk::TRUE;
                needed.address.p_next = info.p_next.cast_mut();
                info.p_next = (&raw const needed.address).cast();
            }
            if !own.enable(demote) {
                needed.demote.shader_demote_to_helper_invocation = vk::TRUE;
                needed.demote.p_next = info.p_next.cast_mut();
                info.p_next = (&raw const needed.demote).cast();
            }
            own
        }
    }

    /// Enables a feature, if the application's chain has it.
    ///
    /// # Safety
    /// The feature is the chain's.
    unsafe fn enable(&mut self, feature: Option<*mut vk::Bool32>) -> bool {
        // SAFETY: the caller's promise.
        unsafe {
            match feature {
                Some(feature) if *feature == vk::FALSE => {
                    *feature = vk::TRUE;
                    self.enabled.push(feature);
                    true
                }
                Some(_) => true,
                None => false,
            }
        }
    }
}

impl Drop for Changed {
    fn drop(&mut self) {
        for feature in self.enabled.drain(..) {
            // SAFETY: the application's structures are as valid as before.
            unsafe { *feature = vk::FALSE };
        }
    }
}
