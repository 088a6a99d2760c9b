//! Descriptor sets.

use super::Descriptor;
use super::layout::{Binding, DescriptorSetLayout};
use crate::error::Error;
use ash::vk;
use simdevice::host;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A descriptor set. Commands read it when they execute.
#[derive(Debug)]
pub(crate) struct DescriptorSet {
    layout: Arc<DescriptorSetLayout>,
    descriptors: Mutex<Vec<Descriptor>>,
}

/// An update of consecutive descriptors: its contents are already converted.
#[derive(Clone, Debug)]
pub(crate) struct Write {
    /// The first binding.
    pub(crate) binding: u32,
    /// The first element of it.
    pub(crate) element: u32,
    /// What the descriptors hold.
    pub(crate) kind: vk::DescriptorType,
    /// What they become.
    pub(crate) descriptors: Vec<Descriptor>,
}

crate::objects! { vk::DescriptorSet => DescriptorSet; }

impl DescriptorSet {
    /// A set that holds nothing but immutable samplers.
    pub(crate) fn new(layout: Arc<DescriptorSetLayout>) -> Self {
        let mut descriptors = host::with_capacity(layout.count());
        for binding in layout.bindings() {
            let samplers = binding
                .immutable_samplers
                .iter()
                .map(|sampler| Descriptor::Image {
                    view: None,
                    sampler: Some(Arc::clone(sampler)),
                });
            descriptors.extend(samplers);
            descriptors.resize(binding.first + binding.count as usize, Descriptor::Empty);
        }
        Self {
            layout,
            descriptors: Mutex::new(descriptors),
        }
    }

    /// Its layout.
    pub(crate) fn layout(&self) -> &Arc<DescriptorSetLayout> {
        &self.layout
    }

    /// What it holds, by index.
    pub(crate) fn lock(&self) -> MutexGuard<'_, Vec<Descriptor>> {
        self.descriptors
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    /// Replaces descriptors.
    ///
    /// # Errors
    /// [`Error::Usage`], and nothing is replaced, if the set does not have them, or has others.
    pub(crate) fn write(&self, write: &Write) -> Result<(), Error> {
        let first = self.layout.index(write.binding, write.element)?;
        let end = first + write.descriptors.len();
        if end > self.layout.count() {
            return Err(Error::usage(
                "VUID-VkWriteDescriptorSet-dstArrayElement-00321",
                format!(
                    "{} descriptors from element {} of binding {} on go beyond the set",
                    write.descriptors.len(),
                    write.element,
                    write.binding
                ),
            ));
        }
        let written = self.overlapping(first, end);
        if let Some(other) = written.iter().find(|binding| binding.kind != write.kind) {
            return Err(Error::usage(
                "VUID-VkWriteDescriptorSet-descriptorType-00319",
                format!(
                    "descriptors of type {:?} are written to binding {}, which has {:?}",
                    write.kind, write.binding, other.kind
                ),
            ));
        }
        let immutable = written.iter().any(|b| !b.immutable_samplers.is_empty());
        let mut descriptors = self.lock();
        for (place, new) in descriptors[first..end].iter_mut().zip(&write.descriptors) {
            replace(place, new.clone(), immutable);
        }
        Ok(())
    }

    /// Replaces `count` descriptors by those of another set, or of another part of this one.
    ///
    /// # Errors
    /// [`Error::Usage`], and nothing is replaced, if either set does not have them.
    pub(crate) fn copy(
        &self,
        (binding, element): (u32, u32),
        source: &Self,
        (source_binding, source_element): (u32, u32),
        count: u32,
    ) -> Result<(), Error> {
        let kind = source.layout.binding(source_binding).map(|b| b.kind);
        let start = source.layout.index(source_binding, source_element)?;
        let found = source
            .lock()
            .get(start..start + count as usize)
            .map(host::copied);
        let Some(descriptors) = found else {
            return Err(Error::usage(
                "VUID-VkCopyDescriptorSet-srcArrayElement-00346",
                format!(
                    "{count} descriptors from element {source_element} of binding {source_binding} on go beyond the \
                     set"
                ),
            ));
        };
        self.write(&Write {
            binding,
            element,
            kind: kind.unwrap_or_default(),
            descriptors,
        })
    }

    /// The bindings that descriptors `first..end` belong to.
    fn overlapping(&self, first: usize, end: usize) -> Vec<&Binding> {
        let overlaps = |binding: &&Binding| {
            binding.first < end && first < binding.first + binding.count as usize
        };
        self.layout.bindings().filter(overlaps).collect()
    }
}

/// Replaces a descriptor; an immutable sampler stays.
fn replace(place: &mut Descriptor, new: Descriptor, immutable: bool) {
    match (place, new) {
        (Descriptor::Image { view, .. }, Descriptor::Image { view: new, .. }) if immutable => {
            *view = new;
        }
        (place, new) => *place = new,
    }
}
