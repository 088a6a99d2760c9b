//! Pipeline layouts.

use crate::error::Error;
use crate::object::descriptor::layout::DescriptorSetLayout;
use crate::shader::{self, DescriptorKind, Interface, Stage};
use ash::vk;
use std::ops::Range;
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

    /// The most descriptors of a binding: what a descriptor array without a length may have.
    pub(crate) fn longest_binding(&self) -> u32 {
        let bindings = self.set_layouts.iter().flatten().flat_map(|set| set.bindings());
        bindings.map(|binding| binding.count).max().unwrap_or(0).max(1)
    }

    /// Checks that what a shader uses is there.
    ///
    /// # Errors
    /// [`Error::Usage`] names what is missing.
    pub(crate) fn check(&self, interface: &Interface) -> Result<(), Error> {
        let stage = stage_flag(interface.stage);
        interface
            .descriptors
            .iter()
            .try_for_each(|used| self.check_descriptor(used, stage))?;
        match &interface.push_constants {
            Some(range) if !self.has_push_constants(stage, range) => Err(Error::usage(
                "VUID-VkComputePipelineCreateInfo-layout-07987",
                format!(
                    "the {} shader reads bytes {range:?} of push constants, which the pipeline layout does not give it",
                    interface.stage
                ),
            )),
            _ => Ok(()),
        }
    }

    fn check_descriptor(
        &self,
        used: &shader::Descriptor,
        stage: vk::ShaderStageFlags,
    ) -> Result<(), Error> {
        let wrong = |vuid, problem: String| {
            let name = used.name.as_deref().unwrap_or("a variable");
            let place = format!("set {}, binding {}", used.set, used.binding);
            Err(Error::usage(
                vuid,
                format!("the shader's {name} is at {place}, {problem}"),
            ))
        };
        let missing = "VUID-VkComputePipelineCreateInfo-layout-07988";
        let set = self.set_layouts.get(used.set as usize).and_then(Option::as_ref);
        let Some(binding) = set.and_then(|set| set.binding(used.binding)) else {
            return wrong(missing, "which the pipeline layout does not have".into());
        };
        if !binding.stages.contains(stage) {
            return wrong(missing, format!("which is for stages {:?}", binding.stages));
        }
        if !holds(binding.kind, used.kind) {
            let problem = format!("which holds {:?}, not {:?}", binding.kind, used.kind);
            return wrong("VUID-VkComputePipelineCreateInfo-layout-07990", problem);
        }
        if binding.count < used.count {
            let problem = format!("which has {} descriptors, not {}", binding.count, used.count);
            return wrong("VUID-VkComputePipelineCreateInfo-layout-07991", problem);
        }
        Ok(())
    }

    /// Whether the stage may read all of the range's bytes of push constants.
    fn has_push_constants(&self, stage: vk::ShaderStageFlags, range: &Range<u32>) -> bool {
        self.push_constants.iter().any(|declared| {
            declared.stage_flags.contains(stage)
                && declared.offset <= range.start
                && range.end <= declared.offset + declared.size
        })
    }
}

fn stage_flag(stage: Stage) -> vk::ShaderStageFlags {
    match stage {
        Stage::Vertex => vk::ShaderStageFlags::VERTEX,
        Stage::Fragment => vk::ShaderStageFlags::FRAGMENT,
        Stage::Compute => vk::ShaderStageFlags::COMPUTE,
    }
}

/// Whether descriptors of this type are what a shader's variable of this kind needs.
fn holds(ty: vk::DescriptorType, kind: DescriptorKind) -> bool {
    use vk::DescriptorType as Type;
    match kind {
        DescriptorKind::Sampler => matches!(ty, Type::SAMPLER | Type::COMBINED_IMAGE_SAMPLER),
        DescriptorKind::SampledImage => {
            matches!(ty, Type::SAMPLED_IMAGE | Type::COMBINED_IMAGE_SAMPLER)
        }
        DescriptorKind::CombinedImageSampler => ty == Type::COMBINED_IMAGE_SAMPLER,
        DescriptorKind::StorageImage => ty == Type::STORAGE_IMAGE,
        DescriptorKind::UniformTexelBuffer => ty == Type::UNIFORM_TEXEL_BUFFER,
        DescriptorKind::StorageTexelBuffer => ty == Type::STORAGE_TEXEL_BUFFER,
        DescriptorKind::UniformBuffer => {
            matches!(ty, Type::UNIFORM_BUFFER | Type::UNIFORM_BUFFER_DYNAMIC)
        }
        DescriptorKind::StorageBuffer => {
            matches!(ty, Type::STORAGE_BUFFER | Type::STORAGE_BUFFER_DYNAMIC)
        }
        DescriptorKind::InputAttachment => ty == Type::INPUT_ATTACHMENT,
    }
}
