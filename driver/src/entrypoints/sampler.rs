//! Samplers.

use crate::object::sampler::Sampler;
use crate::{handle, pointer};
use ash::vk;
use std::sync::Arc;

crate::entry_points! {
    #[doc(alias = "vkCreateSampler")]
    fn create_sampler(
        _device: vk::Device,
        create_info: *const vk::SamplerCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        sampler: *mut vk::Sampler,
    ) -> vk::Result {
        let object = Sampler::new(pointer::input(create_info)?)?;
        pointer::output(sampler, handle::create(Arc::new(object)))
    }
}
