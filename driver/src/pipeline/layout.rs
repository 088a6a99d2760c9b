//! Pipeline layouts.

use crate::abi::error::Error;
use crate::abi::handle::{self, objects};
use crate::abi::valid;
use crate::descriptor::layout::DescriptorSetLayout;
use crate::physical_device::limits;
use crate::pipeline::reflect;
use ash::vk;
use gaurast_spirv::{DescriptorKind, Interface, Stage};
use std::sync::Arc;

/// A pipeline's layout: what its programs may be bound to.
#[derive(Debug)]
pub(crate) struct PipelineLayout {
    set_layouts: Vec<Option<Arc<DescriptorSetLayout>>>,
    push_constants: Vec<vk::PushConstantRange>,
}

objects! { vk::PipelineLayout => PipelineLayout; }

impl PipelineLayout {
    /// A layout of sets by number and of push constants.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if a range of push constants goes beyond `max_push_constants` bytes or is not aligned.
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
    /// [`Error::InvalidUsage`] if there is none.
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
        let bindings = self
            .set_layouts
            .iter()
            .flatten()
            .flat_map(|set| set.bindings());
        bindings
            .map(|binding| binding.count)
            .max()
            .unwrap_or(0)
            .max(1)
    }

    /// Checks that what a shader uses is there.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] names all that is missing.
    pub(crate) fn check(&self, interface: &Interface) -> Result<(), Error> {
        let stage = stage_flag(interface.stage);
        let bindings = (0..).zip(&self.set_layouts).flat_map(|(set, layout)| {
            let bindings = layout.iter().flat_map(|layout| layout.numbered());
            bindings.filter_map(move |(number, binding)| {
                Some(reflect::LayoutBinding {
                    set,
                    binding: number,
                    kind: kind(binding.kind)?,
                    count: binding.count,
                    visible: binding.stages.contains(stage),
                })
            })
        });
        let push_constants = self
            .push_constants
            .iter()
            .map(|range| reflect::PushConstantRange {
                offset: range.offset,
                size: range.size,
                visible: range.stage_flags.contains(stage),
            });
        let layout = reflect::Layout {
            bindings: bindings.collect(),
            push_constants: push_constants.collect(),
        };
        let mismatches = reflect::check(interface, &layout);
        if mismatches.is_empty() {
            return Ok(());
        }
        let messages: Vec<_> = mismatches.iter().map(ToString::to_string).collect();
        let vuid = match interface.stage {
            Stage::Compute => "VUID-VkComputePipelineCreateInfo-layout-07988",
            Stage::Vertex | Stage::Fragment => "VUID-VkGraphicsPipelineCreateInfo-layout-07988",
        };
        Err(Error::usage(vuid, messages.join("; ")))
    }
}

fn stage_flag(stage: Stage) -> vk::ShaderStageFlags {
    match stage {
        Stage::Vertex => vk::ShaderStageFlags::VERTEX,
        Stage::Fragment => vk::ShaderStageFlags::FRAGMENT,
        Stage::Compute => vk::ShaderStageFlags::COMPUTE,
    }
}

/// The kind of a shader's variable that uses descriptors of a type.
fn kind(ty: vk::DescriptorType) -> Option<DescriptorKind> {
    match ty {
        vk::DescriptorType::SAMPLER => Some(DescriptorKind::Sampler),
        vk::DescriptorType::COMBINED_IMAGE_SAMPLER => Some(DescriptorKind::CombinedImageSampler),
        vk::DescriptorType::SAMPLED_IMAGE => Some(DescriptorKind::SampledImage),
        vk::DescriptorType::STORAGE_IMAGE => Some(DescriptorKind::StorageImage),
        vk::DescriptorType::UNIFORM_TEXEL_BUFFER => Some(DescriptorKind::UniformTexelBuffer),
        vk::DescriptorType::STORAGE_TEXEL_BUFFER => Some(DescriptorKind::StorageTexelBuffer),
        vk::DescriptorType::UNIFORM_BUFFER
        | vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC
        | vk::DescriptorType::INLINE_UNIFORM_BLOCK => Some(DescriptorKind::UniformBuffer),
        vk::DescriptorType::STORAGE_BUFFER | vk::DescriptorType::STORAGE_BUFFER_DYNAMIC => {
            Some(DescriptorKind::StorageBuffer)
        }
        vk::DescriptorType::INPUT_ATTACHMENT => Some(DescriptorKind::InputAttachment),
        _ => None,
    }
}

/// # Safety
/// The create info and its handles are valid.
#[doc(alias = "vkCreatePipelineLayout")]
pub(crate) unsafe fn create_pipeline_layout(
    create_info: &vk::PipelineLayoutCreateInfo<'_>,
) -> Result<Arc<PipelineLayout>, Error> {
    let info = create_info;
    // SAFETY: the caller's promise.
    unsafe {
        let set_layouts = valid::slice(info.p_set_layouts, info.set_layout_count)?
            .iter()
            .map(|&layout| Ok(handle::get_optional(layout)?.cloned()));
        PipelineLayout::new(
            set_layouts.collect::<Result<_, Error>>()?,
            valid::slice(info.p_push_constant_ranges, info.push_constant_range_count)?,
            limits::MAX_PUSH_CONSTANTS_SIZE,
        )
        .map(Arc::new)
    }
}
