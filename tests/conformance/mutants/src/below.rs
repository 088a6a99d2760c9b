//! The functions of the next layer by which commands are looked up.

use std::sync::{PoisonError, RwLock};

use ash::vk;

use gaurast_layer_interface::GetInstanceProcAddr;

/// The functions of the next layer by which commands are looked up, and the instance for which they are.
#[derive(Clone, Copy)]
pub(crate) struct Below {
    pub(crate) instance: vk::Instance,
    pub(crate) get_instance_proc_addr: GetInstanceProcAddr,
    pub(crate) get_physical_device_proc_addr: Option<GetInstanceProcAddr>,
    pub(crate) get_device_proc_addr: Option<vk::PFN_vkGetDeviceProcAddr>,
}

/// Those of the instance that was created last.
static BELOW: RwLock<Option<Below>> = RwLock::new(None);

/// The functions of the next layer, if there is an instance.
pub(crate) fn below() -> Option<Below> {
    *BELOW.read().unwrap_or_else(PoisonError::into_inner)
}

/// Remembers the functions of a new instance, or of a new device of it.
pub(crate) fn remember(below: Below) {
    *BELOW.write().unwrap_or_else(PoisonError::into_inner) = Some(below);
}
