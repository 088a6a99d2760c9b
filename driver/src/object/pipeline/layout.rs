//! Pipeline layouts.

use crate::error::Error;
use crate::object::descriptor::layout::DescriptorSetLayout;
use ash::vk;
use std::sync::Arc;

/// A pipeline's layout: what its programs may be bound to.
#[derive(Debug)]
pub(crate) struct PipelineLayout {
    set_layouts: Vec<Option<Arc<DescriptorSetLayout>>>,
    push_constants: Vec<vk::PushConstantRange>,
}

crate::objects! { vk::PipelineLayout => PipelineLayout; }

impl PipelineLayout {
    /// A layout of sets by number and of push constants.
    ///
    /// # Errors
    /// [`Error::Usage`] if a range of push constants goes beyond `max_push_constants` bytes or is not aligned.
    pub(crate) fn new(
        set_layouts: Vec<Option<Arc<DescriptorSetLayout>>>,
        push_constants: &[vk::PushConstantRange],
        max_push_constants: u32,
    ) -> Result<Self, Error> {
        for range in push_constants {
            let end = range.offset.checked_add(range.size);
            let fits = end.is_some_and(|end| end <= max_push_constants);
            if !fits || range.offset % 4 != 0 || range.size % 4 != 0 {
                return Err(Error::usage(
                    "VUID-VkPushConstantRange-size-00298",
                    format!(
                        "{} bytes of push constants at offset {} (there are {max_push_constants}, in words)",
                        range.size, range.offset
                    ),
                ));
            }
        }
        Ok(Self {
            set_layouts,
            push_constants: push_constants.to_vec(),
        })
    }

    /// The layout of set `set`.
    ///
    /// # Errors
    /// [`Error::Usage`] if there is none.
    pub(crate) fn set_layout(&self, set: u32) -> Result<&Arc<DescriptorSetLayout>, Error> {
        let layout = self.set_layouts.get(set as usize).and_then(Option::as_ref);
        layout.ok_or_else(|| {
            Error::usage(
                "VUID-vkCmdBindDescriptorSets-firstSet-00360",
                format!("the pipeline layout has no set {set}"),
            )
        })
    }

    /// Whether stage `stage` may read all of `range`'s bytes of push constants.
    pub(crate) fn has_push_constants(
        &self,
        stage: vk::ShaderStageFlags,
        range: std::ops::Range<u32>,
    ) -> bool {
        self.push_constants.iter().any(|declared| {
            declared.stage_flags.contains(stage)
                && declared.offset <= range.start
                && range.end <= declared.offset + declared.size
        })
    }
}
