//! Descriptor pools.

use super::layout::DescriptorSetLayout;
use super::set::DescriptorSet;
use crate::error::Error;
use crate::handle;
use ash::vk;
use std::collections::{HashMap, HashSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A descriptor pool. It owns the handles of its sets, and gives no more than it was made for.
#[derive(Debug)]
pub(crate) struct DescriptorPool {
    max_sets: usize,
    sizes: HashMap<vk::DescriptorType, u64>,
    frees_single: bool,
    given: Mutex<Given>,
}

/// What a pool has given.
#[derive(Debug, Default)]
struct Given {
    sets: HashSet<vk::DescriptorSet>,
    descriptors: HashMap<vk::DescriptorType, u64>,
}

crate::objects! { vk::DescriptorPool => DescriptorPool; }

impl DescriptorPool {
    /// A pool of at most `max_sets` sets with descriptors of at most these sizes together.
    pub(crate) fn new(
        max_sets: u32,
        pool_sizes: &[vk::DescriptorPoolSize],
        flags: vk::DescriptorPoolCreateFlags,
    ) -> Self {
        let mut sizes = HashMap::new();
        for size in pool_sizes {
            *sizes.entry(size.ty).or_default() += u64::from(size.descriptor_count);
        }
        Self {
            max_sets: max_sets as usize,
            sizes,
            frees_single: flags.contains(vk::DescriptorPoolCreateFlags::FREE_DESCRIPTOR_SET),
            given: Mutex::default(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Given> {
        self.given.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes a set of each layout, or none.
    ///
    /// # Errors
    /// [`Error::OutOfPoolMemory`].
    pub(crate) fn allocate(
        &self,
        layouts: Vec<Arc<DescriptorSetLayout>>,
    ) -> Result<Vec<vk::DescriptorSet>, Error> {
        let mut given = self.lock();
        let mut wanted = given.descriptors.clone();
        layouts.iter().for_each(|layout| add(&mut wanted, layout));
        let sets = given.sets.len() + layouts.len();
        if sets > self.max_sets {
            return Err(Error::OutOfPoolMemory(format!(
                "{sets} sets are wanted of a pool of {}",
                self.max_sets
            )));
        }
        for (kind, &count) in &wanted {
            let size = self.sizes.get(kind).copied().unwrap_or(0);
            if count > size {
                return Err(Error::OutOfPoolMemory(format!(
                    "{count} descriptors of type {kind:?} are wanted of a pool of {size}"
                )));
            }
        }
        let sets: Vec<_> = layouts
            .into_iter()
            .map(|layout| handle::create(Arc::new(DescriptorSet::new(layout))))
            .collect();
        given.sets.extend(&sets);
        given.descriptors = wanted;
        Ok(sets)
    }

    /// Frees sets of this pool; null is allowed.
    ///
    /// # Errors
    /// [`Error::Usage`] if sets of this pool are not freed singly, or one is not of this pool; it is left alone.
    ///
    /// # Safety
    /// Nothing uses the handles any more.
    pub(crate) unsafe fn free(&self, sets: &[vk::DescriptorSet]) -> Result<(), Error> {
        if !self.frees_single {
            return Err(Error::usage(
                "VUID-vkFreeDescriptorSets-descriptorPool-00312",
                "the pool was made without VK_DESCRIPTOR_POOL_CREATE_FREE_DESCRIPTOR_SET_BIT",
            ));
        }
        let null = vk::DescriptorSet::null();
        let mut given = self.lock();
        for &set in sets.iter().filter(|&&set| set != null) {
            if !given.sets.remove(&set) {
                return Err(Error::usage(
                    "VUID-vkFreeDescriptorSets-pDescriptorSets-parent",
                    "a descriptor set is not of the pool",
                ));
            }
            // SAFETY: the pool made the handle and has not destroyed it, and the caller uses it no more.
            if let Some(set) = unsafe { handle::destroy(set) }? {
                remove(&mut given.descriptors, set.layout());
            }
        }
        Ok(())
    }

    /// Frees every set.
    ///
    /// # Errors
    /// None but of a defect.
    ///
    /// # Safety
    /// Nothing uses the handles of the pool's sets any more.
    pub(crate) unsafe fn reset(&self) -> Result<(), Error> {
        let given = std::mem::take(&mut *self.lock());
        for set in given.sets {
            // SAFETY: the pool made the handle and has not destroyed it, and the caller uses it no more.
            unsafe { handle::destroy(set) }?;
        }
        Ok(())
    }
}

fn add(counts: &mut HashMap<vk::DescriptorType, u64>, layout: &DescriptorSetLayout) {
    for binding in layout.bindings() {
        *counts.entry(binding.kind).or_default() += u64::from(binding.count);
    }
}

fn remove(counts: &mut HashMap<vk::DescriptorType, u64>, layout: &DescriptorSetLayout) {
    for binding in layout.bindings() {
        let count = counts.entry(binding.kind).or_default();
        *count = count.saturating_sub(binding.count.into());
    }
}
