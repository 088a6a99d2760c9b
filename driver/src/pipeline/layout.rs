//! Pipeline layouts.

use crate::abi::error::Error;
use crate::abi::handle::objects;
use crate::descriptor::layout::DescriptorSetLayout;
use crate::physical_device::limits;
use ash::vk;
use gaurast_spirv::{DescriptorKind, Interface, ShaderBinding, Stage};
use std::ops::Range;
use std::sync::Arc;

/// A pipeline's layout: the resources that its programs may use.
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
        Ok(Self { set_layouts, push_constants: push_constants.to_vec() })
    }

    /// The sets and push constants of two layouts. The layouts of a pipeline's libraries agree on a set that both have.
    pub(crate) fn union(one: &Arc<Self>, other: &Arc<Self>) -> Arc<Self> {
        if Arc::ptr_eq(one, other) {
            return Arc::clone(one);
        }
        let count = one.set_layouts.len().max(other.set_layouts.len());
        let set = |number: usize| {
            let of = |layout: &Self| layout.set_layouts.get(number).cloned().flatten();
            of(one).or_else(|| of(other))
        };
        Arc::new(Self {
            set_layouts: (0..count).map(set).collect(),
            push_constants: [&one.push_constants[..], &other.push_constants].concat(),
        })
    }

    /// The layout of set number `set`.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if there is none.
    pub(crate) fn set_layout(&self, set: u32) -> Result<&Arc<DescriptorSetLayout>, Error> {
        let layout = self.set_layouts.get(set as usize).and_then(Option::as_ref);
        layout.ok_or_else(|| {
            Error::usage("VUID-vkCmdBindDescriptorSets-firstSet-00360", format!("the pipeline layout has no set {set}"))
        })
    }

    /// The most descriptors of a binding: the greatest length of a descriptor array without one.
    pub(crate) fn longest_binding(&self) -> u32 {
        let bindings = self.set_layouts.iter().flatten().flat_map(|set| set.bindings());
        bindings.map(|binding| binding.count).max().unwrap_or(0).max(1)
    }

    /// Checks that the layout has the resources that a shader uses.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] lists everything that is missing.
    pub(crate) fn check(&self, interface: &Interface) -> Result<(), Error> {
        let mismatches = self.mismatches(interface);
        if mismatches.is_empty() {
            return Ok(());
        }
        let vuid = match interface.stage {
            Stage::Compute => "VUID-VkComputePipelineCreateInfo-layout-07988",
            _ => "VUID-VkGraphicsPipelineCreateInfo-layout-07988",
        };
        Err(Error::usage(vuid, mismatches.join("; ")))
    }

    /// The differences between a shader and the layout.
    pub(super) fn mismatches(&self, interface: &Interface) -> Vec<String> {
        let stage = interface.stage;
        let descriptors = interface.descriptors.iter();
        let mut found: Vec<String> = descriptors.filter_map(|wanted| self.descriptor_mismatch(stage, wanted)).collect();
        if let Some(bytes) = &interface.push_constants
            && !self.has_push_constants(stage, bytes)
        {
            found.push(format!(
                "the {stage} shader uses push constants {} to {}, which no range of the pipeline layout covers",
                bytes.start, bytes.end
            ));
        }
        found
    }

    /// The difference between a shader's binding and the layout, if there is one.
    fn descriptor_mismatch(&self, stage: Stage, shader_binding: &ShaderBinding) -> Option<String> {
        let set = self.set_layouts.get(shader_binding.set as usize);
        let set = set.and_then(Option::as_ref);
        let given = set.and_then(|set| set.binding(shader_binding.binding));
        let given = given.and_then(|given| Some((given, kind(given.kind)?)));
        let name = shader_binding.name.as_ref();
        let name = name.map_or_else(String::new, |name| format!(" (\"{name}\")"));
        let place = format!("set {}, binding {}{name}", shader_binding.set, shader_binding.binding);
        let Some((given, given_kind)) = given else {
            return Some(format!("the {stage} shader uses {place}, which the pipeline layout doesn't have"));
        };
        if !given.stages.contains(stage_flag(stage)) {
            return Some(format!("{place} of the pipeline layout isn't visible to the {stage} stage"));
        }
        // A combined descriptor can be used as either of its parts.
        let is_part = given_kind == DescriptorKind::CombinedImageSampler
            && matches!(shader_binding.kind, DescriptorKind::SampledImage | DescriptorKind::Sampler);
        if shader_binding.kind != given_kind && !is_part {
            return Some(format!(
                "{place} is a {:?} in the {stage} shader, but a {given_kind:?} in the pipeline layout",
                shader_binding.kind
            ));
        }
        (shader_binding.count > given.count && !shader_binding.is_unsized).then(|| {
            format!(
                "{place} has {} descriptors in the pipeline layout; the {stage} shader wants {}",
                given.count, shader_binding.count
            )
        })
    }

    /// Reports whether the ranges of a stage cover all bytes.
    fn has_push_constants(&self, stage: Stage, bytes: &Range<u32>) -> bool {
        let ranges = self.push_constants.iter();
        let mut visible: Vec<(u32, u32)> = ranges
            .filter(|range| range.stage_flags.contains(stage_flag(stage)))
            .map(|range| (range.offset, range.offset.saturating_add(range.size)))
            .collect();
        visible.sort_unstable();
        let mut covered = bytes.start;
        for (first, last) in visible {
            if first <= covered {
                covered = covered.max(last);
            }
        }
        covered >= bytes.end
    }
}

fn stage_flag(stage: Stage) -> vk::ShaderStageFlags {
    match stage {
        Stage::Vertex => vk::ShaderStageFlags::VERTEX,
        Stage::TessellationControl => vk::ShaderStageFlags::TESSELLATION_CONTROL,
        Stage::TessellationEvaluation => vk::ShaderStageFlags::TESSELLATION_EVALUATION,
        Stage::Geometry => vk::ShaderStageFlags::GEOMETRY,
        Stage::Fragment => vk::ShaderStageFlags::FRAGMENT,
        Stage::Compute => vk::ShaderStageFlags::COMPUTE,
    }
}

/// The kind of the shader variables that use descriptors of a type.
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

#[doc(alias = "vkCreatePipelineLayout")]
pub(crate) fn create_pipeline_layout(
    set_layouts: &[Option<Arc<DescriptorSetLayout>>],
    push_constant_ranges: &[vk::PushConstantRange],
) -> Result<Arc<PipelineLayout>, Error> {
    let most = limits::MAX_PUSH_CONSTANTS_SIZE;
    PipelineLayout::new(set_layouts.to_vec(), push_constant_ranges, most).map(Arc::new)
}
