//! Descriptor set layouts, pools, and the life of descriptor sets.

use crate::capabilities::limits;
use crate::error::Error;
use crate::object::descriptor::layout::{BindingInfo, DescriptorSetLayout};
use crate::object::descriptor::pool::DescriptorPool;
use crate::{handle, pnext, pointer};
use ash::vk;
use std::sync::Arc;

crate::entry_points! {
    #[doc(alias = "vkCreateDescriptorSetLayout")]
    fn create_descriptor_set_layout(
        _device: vk::Device,
        create_info: *const vk::DescriptorSetLayoutCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        set_layout: *mut vk::DescriptorSetLayout,
    ) -> vk::Result {
        let layout = new_layout(pointer::input(create_info)?)?;
        pointer::output(set_layout, handle::create(Arc::new(layout)))
    }

    #[doc(alias = "vkGetDescriptorSetLayoutSupport")]
    fn get_descriptor_set_layout_support(
        _device: vk::Device,
        create_info: *const vk::DescriptorSetLayoutCreateInfo<'_>,
        support: *mut vk::DescriptorSetLayoutSupport<'_>,
    ) {
        let layout = new_layout(pointer::input(create_info)?);
        let support = pointer::output_structure(support)?;
        // What is refused for another reason than its size has no answer but this.
        let fits = layout.is_ok_and(|layout| layout.count() <= limits::MAX_PER_SET_DESCRIPTORS as usize);
        support.supported = fits.into();
        pnext::for_each_output(support.p_next, |mut structure| {
            if let Some(variable) =
                structure.cast::<vk::DescriptorSetVariableDescriptorCountLayoutSupport<'_>>()
            {
                variable.max_variable_descriptor_count = 0;
            }
        });
        Ok(())
    }

    #[doc(alias = "vkCreateDescriptorPool")]
    fn create_descriptor_pool(
        _device: vk::Device,
        create_info: *const vk::DescriptorPoolCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        descriptor_pool: *mut vk::DescriptorPool,
    ) -> vk::Result {
        let info = pointer::input(create_info)?;
        if info.flags.contains(vk::DescriptorPoolCreateFlags::UPDATE_AFTER_BIND) {
            return Err(Error::FeatureNotPresent("a descriptor pool for update after bind".into()));
        }
        let sizes = pointer::slice(info.p_pool_sizes, info.pool_size_count)?;
        let pool = DescriptorPool::new(info.max_sets, sizes, info.flags);
        pointer::output(descriptor_pool, handle::create(Arc::new(pool)))
    }

    #[doc(alias = "vkDestroyDescriptorPool")]
    fn destroy_descriptor_pool(
        _device: vk::Device,
        descriptor_pool: vk::DescriptorPool,
        _allocator: *const vk::AllocationCallbacks<'_>,
    ) {
        match handle::destroy(descriptor_pool)? {
            Some(pool) => pool.reset(),
            None => Ok(()),
        }
    }

    #[doc(alias = "vkResetDescriptorPool")]
    fn reset_descriptor_pool(
        _device: vk::Device,
        descriptor_pool: vk::DescriptorPool,
        _flags: vk::DescriptorPoolResetFlags,
    ) -> vk::Result {
        handle::get(descriptor_pool)?.reset()
    }

    #[doc(alias = "vkAllocateDescriptorSets")]
    fn allocate_descriptor_sets(
        _device: vk::Device,
        allocate_info: *const vk::DescriptorSetAllocateInfo<'_>,
        descriptor_sets: *mut vk::DescriptorSet,
    ) -> vk::Result {
        let info = pointer::input(allocate_info)?;
        let count = info.descriptor_set_count as usize;
        // Vulkan has all of them null if any fails.
        for index in 0..count {
            pointer::output(descriptor_sets.add(index), vk::DescriptorSet::null())?;
        }
        let layouts = handle::get_all(pointer::slice(info.p_set_layouts, info.descriptor_set_count)?)?;
        if layouts.iter().any(|layout| layout.is_push()) {
            return Err(Error::usage(
                "VUID-VkDescriptorSetAllocateInfo-pSetLayouts-00308",
                "a set is allocated whose layout is for pushed descriptors",
            ));
        }
        let sets = handle::get(info.descriptor_pool)?.allocate(layouts)?;
        for (index, set) in sets.into_iter().enumerate() {
            pointer::output(descriptor_sets.add(index), set)?;
        }
        Ok(())
    }

    #[doc(alias = "vkFreeDescriptorSets")]
    fn free_descriptor_sets(
        _device: vk::Device,
        descriptor_pool: vk::DescriptorPool,
        descriptor_set_count: u32,
        descriptor_sets: *const vk::DescriptorSet,
    ) -> vk::Result {
        let sets = pointer::slice(descriptor_sets, descriptor_set_count)?;
        handle::get(descriptor_pool)?.free(sets)
    }
}

/// The layout that a create info asks for.
///
/// # Safety
/// The create info and its chain are valid.
unsafe fn new_layout(
    info: &vk::DescriptorSetLayoutCreateInfo<'_>,
) -> Result<DescriptorSetLayout, Error> {
    let is_push = info
        .flags
        .contains(vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR);
    let known = vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR;
    if !known.contains(info.flags) {
        return Err(Error::FeatureNotPresent(format!(
            "a descriptor set layout with flags {:?}",
            info.flags
        )));
    }
    // SAFETY: the caller's promise.
    unsafe {
        if let Some(flags) =
            pnext::find::<vk::DescriptorSetLayoutBindingFlagsCreateInfo<'_>>(info.p_next)
        {
            let flags = pointer::slice(flags.p_binding_flags, flags.binding_count)?;
            let known = vk::DescriptorBindingFlags::PARTIALLY_BOUND
                | vk::DescriptorBindingFlags::UPDATE_UNUSED_WHILE_PENDING;
            if let Some(flags) = flags.iter().find(|&&flags| !known.contains(flags)) {
                return Err(Error::FeatureNotPresent(format!(
                    "a descriptor binding with flags {flags:?}"
                )));
            }
        }
        let bindings = pointer::slice(info.p_bindings, info.binding_count)?;
        let bindings = bindings.iter().map(|binding| binding_info(binding));
        let layout = DescriptorSetLayout::new(bindings.collect::<Result<_, _>>()?, is_push)?;
        if is_push && layout.count() > limits::MAX_PUSH_DESCRIPTORS as usize {
            return Err(Error::usage(
                "VUID-VkDescriptorSetLayoutCreateInfo-flags-00281",
                format!(
                    "{} descriptors are pushed; there may be {}",
                    layout.count(),
                    limits::MAX_PUSH_DESCRIPTORS
                ),
            ));
        }
        Ok(layout)
    }
}

/// A binding with its pointers followed.
///
/// # Safety
/// The binding is valid.
unsafe fn binding_info(binding: &vk::DescriptorSetLayoutBinding<'_>) -> Result<BindingInfo, Error> {
    let has_samplers = matches!(
        binding.descriptor_type,
        vk::DescriptorType::SAMPLER | vk::DescriptorType::COMBINED_IMAGE_SAMPLER
    );
    let immutable_samplers = if has_samplers && !binding.p_immutable_samplers.is_null() {
        // SAFETY: the caller's promise; kinds without samplers may have any pointer, which isn't followed.
        unsafe {
            let samplers = pointer::slice(binding.p_immutable_samplers, binding.descriptor_count)?;
            handle::get_all(samplers)?
        }
    } else {
        Vec::new()
    };
    Ok(BindingInfo {
        number: binding.binding,
        kind: binding.descriptor_type,
        count: binding.descriptor_count,
        stages: binding.stage_flags,
        immutable_samplers,
    })
}
