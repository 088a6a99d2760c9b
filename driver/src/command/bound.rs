//! What descriptors a bind point has while commands are replayed.

use crate::error::Error;
use crate::object::descriptor::Descriptor;
use crate::object::descriptor::layout::DescriptorSetLayout;
use crate::object::descriptor::set::{DescriptorSet, Write};
use ash::vk;
use simdevice::packet::BufferRange;
use std::sync::Arc;

/// A bind point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BindPoint {
    /// Draws.
    Graphics,
    /// Dispatches.
    Compute,
}

impl BindPoint {
    /// Vulkan's bind point.
    ///
    /// # Errors
    /// [`Error::FeatureNotPresent`] for those of extensions.
    pub(crate) fn from_vk(bind_point: vk::PipelineBindPoint) -> Result<Self, Error> {
        match bind_point {
            vk::PipelineBindPoint::GRAPHICS => Ok(Self::Graphics),
            vk::PipelineBindPoint::COMPUTE => Ok(Self::Compute),
            other => Err(Error::FeatureNotPresent(format!("bind point {other:?}"))),
        }
    }
}

/// A descriptor set as it is bound.
#[derive(Clone, Debug)]
pub(crate) struct BoundSet {
    /// The set; read when a command uses it.
    pub(crate) set: Arc<DescriptorSet>,
    /// As many as the set's layout wants.
    pub(crate) dynamic_offsets: Vec<u32>,
}

impl BoundSet {
    /// The bytes of the uniform or storage buffer that the first descriptor of a binding holds.
    pub(crate) fn buffer(&self, binding: u32) -> Option<BufferRange> {
        let binding = self.set.layout().binding(binding)?;
        let held = self.set.lock();
        let Descriptor::Buffer(buffer) = held.get(binding.first)? else {
            return None;
        };
        let offset = binding
            .first_dynamic
            .and_then(|index| self.dynamic_offsets.get(index));
        Some(buffer.range(offset.copied().unwrap_or(0)))
    }
}

/// The sets of a bind point, by number.
#[derive(Clone, Debug, Default)]
pub(crate) struct BoundSets(Vec<Option<BoundSet>>);

impl BoundSets {
    /// Binds sets from number `first` on.
    pub(crate) fn bind(&mut self, first: u32, sets: &[BoundSet]) {
        super::state::bind(&mut self.0, first, sets);
    }

    /// Changes descriptors of the pushed set `number`. What was pushed before stays, if it had the same layout.
    ///
    /// # Errors
    /// [`Error::Usage`] if the layout does not have what is written.
    pub(crate) fn push(
        &mut self,
        number: u32,
        layout: &Arc<DescriptorSetLayout>,
        writes: &[Write],
    ) -> Result<(), Error> {
        let same = |bound: &&BoundSet| {
            bound.set.layout().is_push() && Arc::ptr_eq(bound.set.layout(), layout)
        };
        let set = match self.get(number).filter(same) {
            Some(bound) => Arc::clone(&bound.set),
            None => {
                let set = Arc::new(DescriptorSet::new(Arc::clone(layout)));
                let bound = BoundSet {
                    set: Arc::clone(&set),
                    dynamic_offsets: Vec::new(),
                };
                self.bind(number, &[bound]);
                set
            }
        };
        writes.iter().try_for_each(|write| set.write(write))
    }

    /// Set `number`.
    pub(crate) fn get(&self, number: u32) -> Option<&BoundSet> {
        self.0.get(number as usize)?.as_ref()
    }
}
