//! Descriptor pools.

use super::layout::DescriptorSetLayout;
use super::set::DescriptorSet;
use crate::abi::error::Error;
use crate::abi::handle::{self, objects};
use crate::abi::valid;
use crate::device::Device;
use crate::enabled::Enabled;
use ash::vk;
use std::collections::HashSet;
use std::mem::MaybeUninit;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A descriptor pool. It owns the handles of its sets, and allocates no more sets and descriptors than it was made for.
/// Descriptors of all types count alike. Programs rely on that, as other drivers allow it: GStreamer 1.22 names
/// one type of the two that it allocates. Bytes of inline uniform blocks are counted apart.
#[derive(Debug)]
pub(crate) struct DescriptorPool {
    max_sets: usize,
    capacity: DescriptorCounts,
    flags: vk::DescriptorPoolCreateFlags,
    allocated: Mutex<Allocated>,
}

/// The allocated sets, and the counts of their descriptors.
#[derive(Debug, Default)]
struct Allocated {
    sets: HashSet<vk::DescriptorSet>,
    counts: DescriptorCounts,
}

/// Numbers of descriptors of all types but inline uniform blocks, and of bytes in those.
#[derive(Clone, Copy, Debug, Default)]
struct DescriptorCounts {
    descriptors: u64,
    inline_bytes: u64,
}

impl DescriptorCounts {
    /// The counts of descriptors of each type.
    fn of(kinds: impl IntoIterator<Item = (vk::DescriptorType, u64)>) -> Self {
        let mut counts = Self::default();
        for (kind, count) in kinds {
            let sum = match kind {
                vk::DescriptorType::INLINE_UNIFORM_BLOCK => &mut counts.inline_bytes,
                _ => &mut counts.descriptors,
            };
            *sum = sum.saturating_add(count);
        }
        counts
    }

    /// The sum.
    fn plus(self, other: Self) -> Self {
        Self {
            descriptors: self.descriptors.saturating_add(other.descriptors),
            inline_bytes: self.inline_bytes.saturating_add(other.inline_bytes),
        }
    }

    /// The difference, at least zero.
    fn minus(self, other: Self) -> Self {
        Self {
            descriptors: self.descriptors.saturating_sub(other.descriptors),
            inline_bytes: self.inline_bytes.saturating_sub(other.inline_bytes),
        }
    }
}

objects! { vk::DescriptorPool => DescriptorPool; }

impl DescriptorPool {
    /// A pool of at most `max_sets` sets, with at most these numbers of descriptors together.
    pub(crate) fn new(
        max_sets: u32,
        pool_sizes: &[vk::DescriptorPoolSize],
        flags: vk::DescriptorPoolCreateFlags,
    ) -> Self {
        let sizes = pool_sizes.iter().map(|size| (size.ty, u64::from(size.descriptor_count)));
        Self { max_sets: max_sets as usize, capacity: DescriptorCounts::of(sizes), flags, allocated: Mutex::default() }
    }

    fn lock(&self) -> MutexGuard<'_, Allocated> {
        self.allocated.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Allocates a set of each layout, with the number of descriptors of its variable binding from `variable_counts`,
    /// or none.
    ///
    /// # Errors
    /// [`Error::OutOfPoolMemory`], or [`Error::OutOfDeviceMemory`] for the bytes of inline uniform blocks;
    /// a use of what is not enabled if sets of the layout are updated after bind and those of the pool are not.
    pub(crate) fn allocate(
        &self,
        enabled: &Enabled,
        layouts: Vec<Arc<DescriptorSetLayout>>,
        variable_counts: &[u32],
    ) -> Result<Vec<vk::DescriptorSet>, Error> {
        let mut allocated = self.lock();
        let mut wanted = allocated.counts;
        let after_bind = vk::DescriptorPoolCreateFlags::UPDATE_AFTER_BIND;
        for (index, layout) in layouts.iter().enumerate() {
            enabled.require(!layout.is_updated_after_bind() || self.flags.contains(after_bind), || {
                Error::usage(
                    "VUID-VkDescriptorSetAllocateInfo-pSetLayouts-03044",
                    "a set that is updated after bind is wanted of a pool of other sets",
                )
            })?;
            let variable = variable_counts.get(index).copied().unwrap_or(0);
            wanted = wanted.plus(DescriptorCounts::of(layout.kinds(variable)));
        }
        let sets = allocated.sets.len() + layouts.len();
        if sets > self.max_sets {
            return Err(Error::OutOfPoolMemory(format!("{sets} sets are wanted of a pool of {}", self.max_sets)));
        }
        for (what, wanted, size) in [
            ("descriptors", wanted.descriptors, self.capacity.descriptors),
            ("bytes of inline uniform blocks", wanted.inline_bytes, self.capacity.inline_bytes),
        ] {
            if wanted > size {
                return Err(Error::OutOfPoolMemory(format!("{wanted} {what} are wanted of a pool of {size}")));
            }
        }
        let sets = layouts.into_iter().enumerate().map(|(index, layout)| {
            let variable = variable_counts.get(index).copied().unwrap_or(0);
            DescriptorSet::new(layout, variable).map(Arc::new)
        });
        let sets: Vec<_> = sets.collect::<Result<_, Error>>()?;
        let sets: Vec<_> = sets.into_iter().map(handle::create).collect();
        allocated.sets.extend(&sets);
        allocated.counts = wanted;
        Ok(sets)
    }

    /// Frees sets of this pool. Null handles are ignored.
    ///
    /// # Errors
    /// A use of what is not enabled if sets of this pool are not freed individually; [`Error::InvalidUsage`] if one is not
    /// of this pool; it is not freed.
    ///
    /// # Safety
    /// Nothing uses the handles any more.
    pub(crate) unsafe fn free(&self, enabled: &Enabled, sets: &[vk::DescriptorSet]) -> Result<(), Error> {
        let frees = vk::DescriptorPoolCreateFlags::FREE_DESCRIPTOR_SET;
        enabled.require(self.flags.contains(frees), || {
            Error::usage(
                "VUID-vkFreeDescriptorSets-descriptorPool-00312",
                "the pool was made without VK_DESCRIPTOR_POOL_CREATE_FREE_DESCRIPTOR_SET_BIT",
            )
        })?;
        let null = vk::DescriptorSet::null();
        let mut allocated = self.lock();
        for &set in sets.iter().filter(|&&set| set != null) {
            if !allocated.sets.remove(&set) {
                return Err(Error::usage(
                    "VUID-vkFreeDescriptorSets-pDescriptorSets-parent",
                    "a descriptor set is not of the pool",
                ));
            }
            // SAFETY: the pool made the handle and has not destroyed it, and the caller no longer uses it.
            if let Some(set) = unsafe { handle::destroy(set) }? {
                let counts = DescriptorCounts::of(set.layout().kinds(set.variable_count()));
                allocated.counts = allocated.counts.minus(counts);
            }
        }
        Ok(())
    }

    /// Frees every set.
    ///
    /// # Errors
    /// None, unless the driver has a defect.
    ///
    /// # Safety
    /// Nothing uses the handles of the pool's sets any more.
    pub(crate) unsafe fn reset(&self) -> Result<(), Error> {
        let allocated = std::mem::take(&mut *self.lock());
        for set in allocated.sets {
            // SAFETY: the pool made the handle and has not destroyed it, and the caller no longer uses it.
            unsafe { handle::destroy(set) }?;
        }
        Ok(())
    }
}

#[doc(alias = "vkCreateDescriptorPool")]
pub(crate) fn create_descriptor_pool(
    flags: vk::DescriptorPoolCreateFlags,
    max_sets: u32,
    pool_sizes: &[vk::DescriptorPoolSize],
) -> Result<Arc<DescriptorPool>, Error> {
    Ok(Arc::new(DescriptorPool::new(max_sets, pool_sizes, flags)))
}

/// # Safety
/// Nothing uses the pool's sets any more.
#[doc(alias = "vkDestroyDescriptorPool")]
pub(crate) unsafe fn destroy_descriptor_pool(descriptor_pool: Option<Arc<DescriptorPool>>) -> Result<(), Error> {
    match descriptor_pool {
        // SAFETY: the caller's promise.
        Some(pool) => unsafe { pool.reset() },
        None => Ok(()),
    }
}

/// # Safety
/// Nothing uses the pool's sets any more.
#[doc(alias = "vkResetDescriptorPool")]
pub(crate) unsafe fn reset_descriptor_pool(descriptor_pool: &DescriptorPool) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe { descriptor_pool.reset() }
}

/// Allocates sets. All are null if one fails.
///
/// # Safety
/// The allocate info and its handles are valid.
#[doc(alias = "vkAllocateDescriptorSets")]
pub(crate) unsafe fn allocate_descriptor_sets(
    device: &Device,
    allocate_info: &vk::DescriptorSetAllocateInfo<'_>,
    descriptor_sets: &mut [MaybeUninit<vk::DescriptorSet>],
) -> Result<(), Error> {
    let info = allocate_info;
    descriptor_sets.fill(MaybeUninit::new(vk::DescriptorSet::null()));
    // SAFETY: the caller's promise.
    let (pool, layouts, variable_counts) = unsafe {
        let layouts = valid::slice(info.p_set_layouts, info.descriptor_set_count)?;
        let variable = valid::find_in_chain::<vk::DescriptorSetVariableDescriptorCountAllocateInfo<'_>>(info.p_next);
        let counts = match variable {
            Some(info) => valid::slice(info.p_descriptor_counts, info.descriptor_set_count)?,
            None => &[],
        };
        (handle::get(info.descriptor_pool)?, handle::get_all(layouts)?, counts)
    };
    if layouts.iter().any(|layout| layout.is_push()) {
        return Err(Error::usage(
            "VUID-VkDescriptorSetAllocateInfo-pSetLayouts-00308",
            "a set is allocated whose layout is for pushed descriptors",
        ));
    }
    for (place, set) in descriptor_sets.iter_mut().zip(pool.allocate(device.enabled(), layouts, variable_counts)?) {
        place.write(set);
    }
    Ok(())
}

/// # Safety
/// Nothing uses the sets any more.
#[doc(alias = "vkFreeDescriptorSets")]
pub(crate) unsafe fn free_descriptor_sets(
    device: &Device,
    descriptor_pool: &DescriptorPool,
    descriptor_sets: &[vk::DescriptorSet],
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe { descriptor_pool.free(device.enabled(), descriptor_sets) }
}
