//! Samplers.

use ash::vk;

/// A sampler.
#[derive(Debug)]
pub(crate) struct Sampler {}

crate::objects! { vk::Sampler => Sampler; }
