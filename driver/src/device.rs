//! Logical devices: the features that are enabled, queues, and private data.

use crate::abi::error::Error;
use crate::abi::handle::{self, Reporter, objects};
use crate::abi::sanitizer;
use crate::abi::valid;
use crate::device_addresses::Addresses;
use crate::device_sync::DeviceSync;
use crate::enabled::Enabled;
use crate::instance::{EnabledExtensions, Instance, PhysicalDevice, resolve_extensions};
use crate::options::{self, Dump};
use crate::physical_device::memory::{self, Heap};
use crate::physical_device::{GLOBAL_PRIORITY, QUEUE_COUNT, QUEUE_FAMILIES};
use crate::queue::Queue;
use crate::registry;
use crate::registry::features::Features;
use ash::vk;
use gaurast::gaussian_primitive_topology;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as GaussianFeatures;
use simdevice::CommandProcessor;
use std::collections::HashMap;
use std::ffi::CStr;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// The ratio of the heap's size to the budget of host memory for chunks of Gaussians.
const HEAP_PER_CLUSTER_BUDGET: u64 = 8;

/// A logical device with a simulated device of its own.
pub(crate) struct Device {
    instance: Arc<Instance>,
    enabled: Arc<Enabled>,
    simulated: Arc<simdevice::Device>,
    dump: Dump,
    sync: Arc<DeviceSync>,
    heap: Arc<Heap>,
    addresses: Arc<Addresses>,
    /// Its queues, each with its family.
    queues: OnceLock<Vec<(u32, vk::Queue)>>,
}

objects! {
    vk::Device => Device {
        fn reporter(&self) -> Option<Arc<dyn Reporter>> {
            Some(Arc::clone(&self.instance) as _)
        }
    };
    vk::PrivateDataSlot => PrivateDataSlot;
}

impl Device {
    /// Opens a device with a queue of each of these families.
    ///
    /// # Errors
    /// [`Error::InitializationFailed`] if the host can't start a queue's thread, or an environment variable is invalid.
    pub(crate) fn new(
        instance: Arc<Instance>,
        enabled: Enabled,
        simulated: simdevice::Device,
        families: &[u32],
    ) -> Result<Arc<Self>, Error> {
        if sanitizer::is_present() {
            simulated.runtime().install(|| rayon::broadcast(|_| sanitizer::ignore_thread()));
        }
        let device = Arc::new(Self {
            instance,
            enabled: Arc::new(enabled),
            simulated: Arc::new(simulated),
            dump: Dump::of_environment()?,
            sync: Arc::default(),
            heap: Arc::new(Heap::new(memory::heap_size())),
            addresses: Arc::default(),
            queues: OnceLock::new(),
        });
        let start = |&family: &u32| {
            let processor = CommandProcessor::new(Arc::clone(&device.simulated));
            let queue = Queue::start(Arc::clone(&device.instance), Arc::clone(&device.sync), processor);
            queue.map(|queue| (family, queue))
        };
        let queues: Vec<_> = families.iter().map(start).collect::<Result<_, _>>()?;
        device.queues.get_or_init(|| {
            let queues = queues.into_iter();
            queues.map(|(family, queue)| (family, handle::create(queue))).collect()
        });
        Ok(device)
    }

    /// The features and extensions that the application enabled.
    pub(crate) fn enabled(&self) -> &Arc<Enabled> {
        &self.enabled
    }

    /// The features that the application enabled.
    pub(crate) fn features(&self) -> &Features {
        self.enabled.features()
    }

    /// Reports whether the application enabled an extension.
    pub(crate) fn has(&self, extension: &CStr) -> bool {
        self.enabled.extensions().contains(&extension)
    }

    /// The simulated device.
    pub(crate) fn simulated(&self) -> &simdevice::Device {
        &self.simulated
    }

    /// Reports whether the device's programs are printed when pipelines are created.
    pub(crate) fn dumps_ir(&self) -> bool {
        self.dump.ir
    }

    /// The state that can be waited for on it, and its loss.
    pub(crate) fn sync(&self) -> &Arc<DeviceSync> {
        &self.sync
    }

    /// The heap of a memory type, and true if the host may map its memory; `None` if there is no such type.
    pub(crate) fn memory_type(&self, index: u32) -> Option<(&Arc<Heap>, bool)> {
        let properties = memory::type_properties(index)?;
        let host_visible = properties.contains(vk::MemoryPropertyFlags::HOST_VISIBLE);
        Some((&self.heap, host_visible))
    }

    /// The addresses of its buffers.
    pub(crate) fn addresses(&self) -> &Arc<Addresses> {
        &self.addresses
    }

    /// The handle of queue `index` of a family.
    pub(crate) fn queue(&self, family: u32, index: u32) -> Option<vk::Queue> {
        let queues = self.queues.get().map_or(&[][..], Vec::as_slice);
        let mut of_family = queues.iter().filter(|(of, _)| *of == family);
        of_family.nth(index as usize).map(|&(_, queue)| queue)
    }

    /// The handles of its queues.
    pub(crate) fn queues(&self) -> impl Iterator<Item = vk::Queue> {
        let queues = self.queues.get().map_or(&[][..], Vec::as_slice);
        queues.iter().map(|&(_, queue)| queue)
    }

    /// The version and extensions under which commands are looked up through this device.
    pub(crate) fn enabled_extensions(&self) -> EnabledExtensions<'_> {
        EnabledExtensions { device_extensions: self.enabled.extensions(), ..self.instance.enabled_extensions() }
    }

    /// Executes the work of its queues and joins their threads.
    pub(crate) fn stop(&self) {
        for queue in self.queues() {
            // SAFETY: the handle was made with the device and lives as long.
            match unsafe { handle::get(queue) } {
                Ok(queue) => queue.stop(),
                Err(error) => log::error!("a queue's handle was overwritten: {error}"),
            }
        }
    }

    /// The instance.
    pub(crate) fn instance(&self) -> &Arc<Instance> {
        &self.instance
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        for queue in self.queues() {
            // SAFETY: the handle was made with the device, and the application may not use it once that is destroyed.
            if let Err(error) = unsafe { handle::destroy(queue) } {
                log::error!("a queue's handle was overwritten: {error}");
            }
        }
    }
}

/// A private data slot: one value per object, by the serial number of its handle. Values stay until the slot is
/// destroyed.
#[derive(Default)]
pub(crate) struct PrivateDataSlot(Mutex<HashMap<u64, u64>>);

impl PrivateDataSlot {
    /// Attaches a value to an object.
    pub(crate) fn set(&self, object: u64, data: u64) {
        let mut values = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        values.insert(object, data);
    }

    /// The value attached to an object, or 0.
    pub(crate) fn get(&self, object: u64) -> u64 {
        let values = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        values.get(&object).copied().unwrap_or(0)
    }
}

/// The families of the requested queues, one for each queue.
///
/// # Safety
/// The creation info is valid.
unsafe fn queue_families(info: &vk::DeviceCreateInfo<'_>) -> Result<Vec<u32>, Error> {
    // SAFETY: the caller promises a valid creation info.
    let families = unsafe { valid::slice(info.p_queue_create_infos, info.queue_create_info_count)? };
    let mut queues = Vec::new();
    for family in families {
        let exists = (family.queue_family_index as usize) < QUEUE_FAMILIES.len();
        if !exists || family.queue_count > QUEUE_COUNT {
            return Err(Error::InitializationFailed(format!(
                "{} queues of family {} were asked for; there are {} families with {QUEUE_COUNT} each",
                family.queue_count,
                family.queue_family_index,
                QUEUE_FAMILIES.len()
            )));
        }
        // SAFETY: the caller promises a valid creation info.
        let priority = unsafe { valid::find_in_chain::<vk::DeviceQueueGlobalPriorityCreateInfoKHR<'_>>(family.p_next) };
        if let Some(given) = priority
            && given.global_priority != GLOBAL_PRIORITY
        {
            return Err(Error::InitializationFailed(format!(
                "queues of the global priority {:?} were asked for; there are those of {GLOBAL_PRIORITY:?} only",
                given.global_priority
            )));
        }
        queues.extend((0..family.queue_count).map(|_| family.queue_family_index));
        if !family.flags.is_empty() {
            return Err(Error::FeatureNotPresent("a queue's creation flag".to_owned()));
        }
    }
    Ok(queues)
}

/// # Safety
/// The create info and its chain are valid.
#[doc(alias = "vkCreateDevice")]
pub(crate) unsafe fn create_device(
    physical_device: &PhysicalDevice,
    create_info: &vk::DeviceCreateInfo<'_>,
) -> Result<Arc<Device>, Error> {
    let info = create_info;
    // SAFETY: the caller's promise.
    unsafe {
        let names = valid::strings(info.pp_enabled_extension_names, info.enabled_extension_count)?;
        let extensions = resolve_extensions(registry::extensions::DEVICE, &names)?;
        let instance = physical_device.require_instance()?;
        if extensions.contains(&gaussian_primitive_topology::NAME)
            && valid::find_in_chain::<GaussianFeatures<'_>>(info.p_next).is_none()
        {
            warn_of_lost_features(&instance);
        }
        options::device_type()?;
        let mut enabled = Enabled::new(extensions, options::is_strict()?, Arc::clone(&instance) as _);
        enabled.enable_features(info)?;
        let simulated = open_simulated(&instance)?;
        Device::new(instance, enabled, simulated, &queue_families(info)?)
    }
}

/// Opens a simulated device with the options of the instance and of the environment.
///
/// # Errors
/// As [`Options::device_config`](crate::options::Options::device_config), and [`Error::InitializationFailed`] for an
/// option that this machine can't satisfy.
fn open_simulated(instance: &Arc<Instance>) -> Result<simdevice::Device, Error> {
    let mut config = instance.options().device_config(Arc::clone(instance) as _)?;
    config.cluster_budget_bytes = memory::heap_size() / HEAP_PER_CLUSTER_BUDGET;
    simdevice::Device::new(&config).map_err(|error| Error::InitializationFailed(error.to_string()))
}

/// Says that the extension is enabled and nothing of it can be used, as where a layer drops the structure of its features.
fn warn_of_lost_features(instance: &Instance) {
    let text = format!(
        "vkCreateDevice: {} is enabled, but the pNext chain has no \
         VkPhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST, so that none of its features is enabled. The Khronos \
         validation layer drops structures that it does not know: name them in VK_LAYER_CUSTOM_STYPE_LIST",
        gaussian_primitive_topology::NAME.to_string_lossy()
    );
    log::warn!("{text}");
    instance.report(
        vk::DebugUtilsMessageSeverityFlagsEXT::WARNING,
        vk::DebugUtilsMessageTypeFlagsEXT::GENERAL,
        "GAURAST-no-features",
        &text,
    );
}

#[doc(alias = "vkDestroyDevice")]
pub(crate) fn destroy_device(device: Option<Arc<Device>>) -> Result<(), Error> {
    if let Some(device) = device {
        device.stop();
    }
    Ok(())
}

#[doc(alias = "vkGetDeviceQueue")]
pub(crate) fn get_device_queue(device: &Device, queue_family_index: u32, queue_index: u32) -> Result<vk::Queue, Error> {
    let found = device.queue(queue_family_index, queue_index);
    Ok(found.unwrap_or_default())
}

#[doc(alias = "vkGetDeviceQueue2")]
pub(crate) fn get_device_queue2(device: &Device, queue_info: &vk::DeviceQueueInfo2<'_>) -> Result<vk::Queue, Error> {
    if queue_info.flags.is_empty() {
        get_device_queue(device, queue_info.queue_family_index, queue_info.queue_index)
    } else {
        Ok(vk::Queue::null())
    }
}

#[doc(alias = "vkDeviceWaitIdle")]
pub(crate) fn device_wait_idle(device: &Device) -> Result<(), Error> {
    device.queues().try_for_each(|queue| {
        // SAFETY: the handle was made with the device and lives as long.
        unsafe { handle::get(queue)? }.wait_idle()
    })
}

/// Returns no features: a group has one device, which has no peer.
#[doc(alias = "vkGetDeviceGroupPeerMemoryFeatures")]
pub(crate) fn get_device_group_peer_memory_features() -> Result<vk::PeerMemoryFeatureFlags, Error> {
    Ok(vk::PeerMemoryFeatureFlags::empty())
}

/// Does nothing: counters are always on, and nothing else can use them.
#[doc(alias = "vkAcquireProfilingLockKHR")]
pub(crate) fn acquire_profiling_lock(_device: &Device) -> Result<(), Error> {
    Ok(())
}

#[doc(alias = "vkCreatePrivateDataSlot")]
pub(crate) fn create_private_data_slot() -> Result<Arc<PrivateDataSlot>, Error> {
    Ok(Arc::default())
}

/// # Safety
/// The object's handle is of the type, and live.
#[doc(alias = "vkSetPrivateData")]
pub(crate) unsafe fn set_private_data(
    object_type: vk::ObjectType,
    object_handle: u64,
    private_data_slot: &PrivateDataSlot,
    data: u64,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    let object = unsafe { handle::serial(object_type, object_handle)? };
    private_data_slot.set(object, data);
    Ok(())
}

/// # Safety
/// As [`set_private_data`].
#[doc(alias = "vkGetPrivateData")]
pub(crate) unsafe fn get_private_data(
    object_type: vk::ObjectType,
    object_handle: u64,
    private_data_slot: &PrivateDataSlot,
) -> Result<u64, Error> {
    // SAFETY: the caller's promise.
    let object = unsafe { handle::serial(object_type, object_handle)? };
    Ok(private_data_slot.get(object))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry::features::{MANDATORY, SUPPORTED};
    use crate::registry::newer;
    use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST;
    use std::collections::HashMap;

    /// Features that Vulkan requires and that are not supported; `driver/support.toml` has the reasons.
    const REQUIRED_BUT_MISSING: &[&str] = &[];

    /// The number of supported features of a structure.
    fn count<T: vk::TaggedStructure>() -> usize {
        // SAFETY: such a structure begins with its type and a pointer, and all else are truth values.
        let mut structure = unsafe {
            let mut structure = std::mem::MaybeUninit::<T>::zeroed();
            (*structure.as_mut_ptr().cast::<vk::BaseOutStructure<'_>>()).s_type = T::STRUCTURE_TYPE;
            structure.assume_init()
        };
        let mut head = vk::PhysicalDeviceFeatures2 { p_next: (&raw mut structure).cast(), ..Default::default() };
        let mut features = Features::NONE;
        // SAFETY: the structure is alone in its chain.
        unsafe {
            let mut chain = valid::OutputChain::new(&raw mut head).unwrap();
            chain.for_each_chained(|out| SUPPORTED.write(out));
            valid::chain((&raw const structure).cast()).for_each(|it| features.add(it));
        }
        count_of(&features)
    }

    fn count_of(features: &Features) -> usize {
        features.list().filter(|(_, is_on)| *is_on).count()
    }

    #[test]
    fn supported_features_are_those_of_the_structures() {
        let mut core = Features::NONE;
        core.add_core(&SUPPORTED.core());
        let counts = [
            count_of(&core),
            count::<vk::PhysicalDeviceVulkan11Features<'_>>(),
            count::<vk::PhysicalDeviceVulkan12Features<'_>>(),
            count::<vk::PhysicalDeviceVulkan13Features<'_>>(),
            count::<newer::PhysicalDeviceVulkan14Features>(),
            count::<vk::PhysicalDevicePerformanceQueryFeaturesKHR<'_>>(),
            count::<vk::PhysicalDeviceGraphicsPipelineLibraryFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceAttachmentFeedbackLoopLayoutFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceTransformFeedbackFeaturesEXT<'_>>(),
            count::<vk::PhysicalDevicePrimitivesGeneratedQueryFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceExtendedDynamicStateFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceExtendedDynamicState2FeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceTexelBufferAlignmentFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceProvokingVertexFeaturesEXT<'_>>(),
            count::<vk::PhysicalDevice4444FormatsFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceBorderColorSwizzleFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceCustomBorderColorFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceDepthClipEnableFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceDepthClipControlFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceDepthClampZeroOneFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceConditionalRenderingFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceImage2DViewOf3DFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceNonSeamlessCubeMapFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceRobustness2FeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceShaderClockFeaturesKHR<'_>>(),
            count::<vk::PhysicalDeviceShaderEarlyAndLateFragmentTestsFeaturesAMD<'_>>(),
            count::<vk::PhysicalDeviceShaderAtomicFloatFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceShaderAtomicFloat2FeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceWorkgroupMemoryExplicitLayoutFeaturesKHR<'_>>(),
            count::<vk::PhysicalDeviceColorWriteEnableFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceExtendedDynamicState3FeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceMultiDrawFeaturesEXT<'_>>(),
            count::<vk::PhysicalDevicePrimitiveTopologyListRestartFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceVertexInputDynamicStateFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceRasterizationOrderAttachmentAccessFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceMultisampledRenderToSingleSampledFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceYcbcr2Plane444FormatsFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceAttachmentFeedbackLoopDynamicStateFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceDepthBiasControlFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceDynamicRenderingUnusedAttachmentsFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceMemoryPriorityFeaturesEXT<'_>>(),
            count::<vk::PhysicalDevicePageableDeviceLocalMemoryFeaturesEXT<'_>>(),
            count::<vk::PhysicalDeviceShaderMaximalReconvergenceFeaturesKHR<'_>>(),
            count::<vk::PhysicalDeviceShaderQuadControlFeaturesKHR<'_>>(),
            count::<vk::PhysicalDeviceShaderSubgroupUniformControlFlowFeaturesKHR<'_>>(),
            count::<newer::PhysicalDevicePrimitiveRestartIndexFeaturesEXT>(),
            count::<newer::PhysicalDeviceShaderReplicatedCompositesFeaturesEXT>(),
            count::<newer::PhysicalDeviceZeroInitializeDeviceMemoryFeaturesEXT>(),
            count::<newer::PhysicalDeviceShaderRelaxedExtendedInstructionFeaturesKHR>(),
            count::<newer::PhysicalDeviceUnifiedImageLayoutsFeaturesKHR>(),
            count::<PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST<'_>>(),
        ];
        assert_eq!(
            counts,
            [
                44, 10, 43, 14, 21, 1, 1, 1, 2, 3, 1, 3, 1, 2, 2, 2, 2, 1, 1, 1, 2, 2, 1, 3, 2, 1, 6, 3, 4, 1, 16, 1,
                2, 1, 3, 1, 1, 1, 4, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 30
            ]
        );
        assert_eq!(count_of(&SUPPORTED), counts.iter().sum::<usize>());
    }

    #[test]
    fn missing_features_are_listed_truly() {
        let supported: HashMap<_, _> = SUPPORTED.list().collect();
        let mut missing: Vec<_> = MANDATORY.iter().map(|(name, _)| *name).filter(|name| !supported[name]).collect();
        missing.sort_unstable();
        assert_eq!(missing, REQUIRED_BUT_MISSING);
    }
}
