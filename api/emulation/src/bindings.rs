//! Descriptor sets and push constants as commands have bound them.

use std::collections::BTreeMap;

use ash::vk;

use crate::next::Next;

/// A descriptor set that is bound.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct BoundSet {
    pub(crate) layout: vk::PipelineLayout,
    pub(crate) set: vk::DescriptorSet,
    pub(crate) offsets: Vec<u32>,
}

/// Push constants as a command has set them.
#[derive(Clone, Debug)]
pub(crate) struct PushConstants {
    pub(crate) layout: vk::PipelineLayout,
    pub(crate) stages: vk::ShaderStageFlags,
    pub(crate) offset: u32,
    pub(crate) bytes: Vec<u8>,
}

/// Descriptor sets and push constants of graphics pipelines.
#[derive(Clone, Debug)]
pub(crate) struct Bindings {
    /// The sets, by number.
    pub(crate) sets: BTreeMap<u32, BoundSet>,
    pub(crate) constants: Vec<PushConstants>,
}

impl Bindings {
    /// Binds the descriptor sets that are not bound already.
    ///
    /// # Safety
    /// The command buffer is being recorded, and the application has bound the sets in it.
    pub(crate) unsafe fn bind_sets(&self, next: &Next, commands: vk::CommandBuffer, bound: &BTreeMap<u32, BoundSet>) {
        let graphics = vk::PipelineBindPoint::GRAPHICS;
        for (number, one) in self.sets.iter().filter(|(number, one)| bound.get(number) != Some(one)) {
            // SAFETY: the caller's promise.
            unsafe {
                next.cmd_bind_descriptor_sets(commands, graphics, one.layout, *number, &[one.set], &one.offsets);
            }
        }
    }

    /// Pushes the constants.
    ///
    /// # Safety
    /// The command buffer is being recorded, and the application has pushed the constants in it.
    pub(crate) unsafe fn push_constants(&self, next: &Next, commands: vk::CommandBuffer) {
        for pushed in &self.constants {
            // SAFETY: the caller's promise.
            unsafe { next.cmd_push_constants(commands, pushed.layout, pushed.stages, pushed.offset, &pushed.bytes) };
        }
    }
}
