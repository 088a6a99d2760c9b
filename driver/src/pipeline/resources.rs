//! The resources that a pipeline's programs use.

use crate::device::Device;
use crate::device_addresses::Addresses;
use gaurast_spirv::{Interface, ShaderBinding};
use std::sync::Arc;

/// The resources that a program uses.
#[derive(Debug, Default)]
pub(crate) struct ProgramResources {
    /// Its descriptors.
    pub(crate) descriptors: Vec<ShaderBinding>,
    /// The buffers that it may access by address; None if it uses no addresses.
    pub(crate) addresses: Option<Arc<Addresses>>,
    /// True if it writes to memory, and therefore may write through an address.
    pub(crate) writes: bool,
}

impl ProgramResources {
    /// The resources that a shader uses.
    pub(crate) fn new(device: &Device, interface: &Interface) -> Self {
        Self {
            descriptors: interface.descriptors.clone(),
            addresses: interface
                .uses_addresses
                .then(|| Arc::clone(device.addresses())),
            writes: interface.has_side_effects,
        }
    }
}
