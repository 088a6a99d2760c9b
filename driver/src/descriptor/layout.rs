//! Descriptor set layouts.

use crate::abi::error::Error;
use crate::abi::handle::{self, objects};
use crate::abi::valid::{self, OutputChain};
use crate::physical_device::limits;
use crate::resource::sampler::Sampler;
use ash::vk;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The most descriptors of a set.
pub(crate) const MAX_DESCRIPTORS: u32 = 1 << 20;

/// A binding, as the application describes it.
#[derive(Clone, Debug)]
pub(crate) struct BindingInfo {
    /// Its number.
    pub(crate) number: u32,
    /// The kind of its descriptors.
    pub(crate) kind: vk::DescriptorType,
    /// The number of its descriptors; 0 reserves the binding number.
    pub(crate) count: u32,
    /// The stages that may use it.
    pub(crate) stages: vk::ShaderStageFlags,
    /// Immutable samplers, one for each descriptor; or empty.
    pub(crate) immutable_samplers: Vec<Arc<Sampler>>,
    /// The rules on its descriptors.
    pub(crate) flags: vk::DescriptorBindingFlags,
}

/// A binding in its set.
#[derive(Clone, Debug)]
pub(crate) struct LayoutBinding {
    /// Its number.
    pub(crate) number: u32,
    /// The kind of its descriptors.
    pub(crate) kind: vk::DescriptorType,
    /// The number of its descriptors; the most, if the count is variable.
    pub(crate) count: u32,
    /// The bytes of an inline uniform block, which is one descriptor; the most, if the count is variable. 0 for other
    /// kinds.
    pub(crate) inline_bytes: u32,
    /// The stages that may use it.
    pub(crate) stages: vk::ShaderStageFlags,
    /// Immutable samplers, one for each descriptor; or empty.
    pub(crate) immutable_samplers: Vec<Arc<Sampler>>,
    /// The index of its first descriptor in the set.
    pub(crate) first: usize,
    /// The index of its first dynamic offset among the set's, if it has dynamic offsets.
    pub(crate) first_dynamic: Option<usize>,
}

/// A descriptor set layout.
#[derive(Debug)]
pub(crate) struct DescriptorSetLayout {
    /// The bindings in order of their numbers, which is that of their descriptors.
    bindings: Vec<LayoutBinding>,
    count: usize,
    dynamic_count: usize,
    flags: vk::DescriptorSetLayoutCreateFlags,
    has_variable_count: bool,
}

objects! { vk::DescriptorSetLayout => DescriptorSetLayout; }

/// Reports whether descriptors of this kind have dynamic offsets.
pub(crate) fn is_dynamic(kind: vk::DescriptorType) -> bool {
    matches!(kind, vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC | vk::DescriptorType::STORAGE_BUFFER_DYNAMIC)
}

/// Reports whether the driver supports descriptors of this kind.
pub(crate) fn is_supported(kind: vk::DescriptorType) -> bool {
    matches!(
        kind,
        vk::DescriptorType::SAMPLER
            | vk::DescriptorType::COMBINED_IMAGE_SAMPLER
            | vk::DescriptorType::SAMPLED_IMAGE
            | vk::DescriptorType::STORAGE_IMAGE
            | vk::DescriptorType::UNIFORM_TEXEL_BUFFER
            | vk::DescriptorType::STORAGE_TEXEL_BUFFER
            | vk::DescriptorType::UNIFORM_BUFFER
            | vk::DescriptorType::STORAGE_BUFFER
            | vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC
            | vk::DescriptorType::STORAGE_BUFFER_DYNAMIC
            | vk::DescriptorType::INPUT_ATTACHMENT
            | vk::DescriptorType::INLINE_UNIFORM_BLOCK
    )
}

impl DescriptorSetLayout {
    /// A layout of bindings. The flags say how its sets are allocated and updated.
    ///
    /// # Errors
    /// [`Error::FeatureNotPresent`] for an unsupported kind of descriptor, or too many of them; [`Error::InvalidUsage`]
    /// if two bindings have the same number, or bindings contradict their flags.
    pub(crate) fn new(infos: Vec<BindingInfo>, flags: vk::DescriptorSetLayoutCreateFlags) -> Result<Self, Error> {
        let mut sorted = BTreeMap::new();
        check_flags(&infos, flags)?;
        for info in infos {
            if !is_supported(info.kind) && info.count > 0 {
                return Err(Error::FeatureNotPresent(format!("a descriptor of type {:?}", info.kind)));
            }
            let number = info.number;
            if sorted.insert(number, info).is_some() {
                return Err(Error::usage(
                    "VUID-VkDescriptorSetLayoutCreateInfo-binding-00279",
                    format!("binding {number} is there twice"),
                ));
            }
        }
        let slots = |info: &BindingInfo| match info.kind {
            vk::DescriptorType::INLINE_UNIFORM_BLOCK => info.count.min(1),
            _ => info.count,
        };
        let variable = vk::DescriptorBindingFlags::VARIABLE_DESCRIPTOR_COUNT;
        let has_variable_count = sorted.values().next_back().is_some_and(|info| info.flags.contains(variable));
        let total: u64 = sorted.values().map(|info| u64::from(slots(info))).sum();
        if total > u64::from(MAX_DESCRIPTORS) {
            return Err(Error::FeatureNotPresent(format!(
                "a descriptor set of {total} descriptors (there may be {MAX_DESCRIPTORS})"
            )));
        }
        let (mut count, mut dynamic_count) = (0, 0);
        let place = |info: BindingInfo| {
            let (first, first_dynamic) = (count, dynamic_count);
            let dynamic = is_dynamic(info.kind);
            let held = slots(&info);
            count += held as usize;
            dynamic_count += if dynamic { info.count as usize } else { 0 };
            LayoutBinding {
                number: info.number,
                kind: info.kind,
                count: held,
                inline_bytes: match info.kind {
                    vk::DescriptorType::INLINE_UNIFORM_BLOCK => info.count,
                    _ => 0,
                },
                stages: info.stages,
                immutable_samplers: info.immutable_samplers,
                first,
                first_dynamic: dynamic.then_some(first_dynamic),
            }
        };
        let bindings = sorted.into_values().map(place).collect();
        Ok(Self { bindings, count, dynamic_count, flags, has_variable_count })
    }

    /// The binding with a variable number of descriptors, or of bytes: the last one, if any.
    pub(crate) fn variable_binding(&self) -> Option<&LayoutBinding> {
        self.bindings.last().filter(|_| self.has_variable_count)
    }

    /// The most descriptors that the variable binding may have beside those of the other bindings (bytes, for an inline
    /// uniform block); 0 without one.
    fn max_variable_count(&self) -> u32 {
        match self.variable_binding() {
            None => 0,
            Some(binding) if binding.kind == vk::DescriptorType::INLINE_UNIFORM_BLOCK => {
                limits::MAX_INLINE_UNIFORM_BLOCK_SIZE
            }
            Some(binding) => {
                let others = self.count() - binding.count as usize;
                (limits::MAX_PER_SET_DESCRIPTORS as usize).saturating_sub(others) as u32
            }
        }
    }

    /// The kinds of a set's descriptors, each with the number that it takes from its pool (bytes, for inline uniform
    /// blocks). The variable binding has `variable_count`.
    pub(crate) fn kinds(&self, variable_count: u32) -> impl Iterator<Item = (vk::DescriptorType, u64)> {
        let last = self.variable_binding().map(|binding| binding.first);
        self.bindings.iter().map(move |binding| {
            let most = binding.count.max(binding.inline_bytes);
            let taken = match last {
                Some(first) if first == binding.first => variable_count.min(most),
                _ => most,
            };
            (binding.kind, u64::from(taken))
        })
    }

    /// The binding of that number, unless it has no descriptors.
    pub(crate) fn binding(&self, number: u32) -> Option<&LayoutBinding> {
        let place = self.bindings.binary_search_by_key(&number, |binding| binding.number).ok()?;
        self.bindings.get(place).filter(|binding| binding.count > 0)
    }

    /// The bindings in order of their descriptors.
    pub(crate) fn bindings(&self) -> impl Iterator<Item = &LayoutBinding> {
        self.bindings.iter()
    }

    /// The bindings that descriptors `first..end` belong to.
    pub(crate) fn overlapping(&self, first: usize, end: usize) -> &[LayoutBinding] {
        let start = self.bindings.partition_point(|binding| binding.first + binding.count as usize <= first);
        let stop = self.bindings.partition_point(|binding| binding.first < end);
        self.bindings.get(start..stop).unwrap_or_default()
    }

    /// The number of descriptors in a set.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// The number of dynamic offsets of a set.
    pub(crate) fn dynamic_count(&self) -> usize {
        self.dynamic_count
    }

    /// Reports whether its sets are pushed rather than allocated.
    pub(crate) fn is_push(&self) -> bool {
        self.flags.contains(vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR)
    }

    /// Reports whether its sets may be updated after they are bound.
    pub(crate) fn is_updated_after_bind(&self) -> bool {
        self.flags.contains(vk::DescriptorSetLayoutCreateFlags::UPDATE_AFTER_BIND_POOL)
    }

    /// The index in the set of element `element` of binding `number`, which may be beyond the binding.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if there is no such binding.
    pub(crate) fn index(&self, number: u32, element: u32) -> Result<usize, Error> {
        self.binding(number).map(|binding| binding.first + element as usize).ok_or_else(|| {
            Error::usage(
                "VUID-VkWriteDescriptorSet-dstBinding-00315",
                format!("the descriptor set has no binding {number}"),
            )
        })
    }
}

/// Checks that bindings agree with their flags and with those of their layout.
fn check_flags(infos: &[BindingInfo], flags: vk::DescriptorSetLayoutCreateFlags) -> Result<(), Error> {
    let is_push = flags.contains(vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR);
    let after_bind = vk::DescriptorBindingFlags::UPDATE_AFTER_BIND;
    let updates_after_bind = infos.iter().any(|info| info.flags.contains(after_bind));
    let pool = vk::DescriptorSetLayoutCreateFlags::UPDATE_AFTER_BIND_POOL;
    if updates_after_bind && !flags.contains(pool) {
        return Err(Error::usage(
            "VUID-VkDescriptorSetLayoutCreateInfo-flags-03000",
            "a binding is updated after bind, and its layout is not for pools of such sets",
        ));
    }
    if updates_after_bind && infos.iter().any(|info| is_dynamic(info.kind)) {
        return Err(Error::usage(
            "VUID-VkDescriptorSetLayoutCreateInfo-descriptorType-03001",
            "a layout has both bindings that are updated after bind and dynamic offsets",
        ));
    }
    for info in infos {
        let is_inline = info.kind == vk::DescriptorType::INLINE_UNIFORM_BLOCK;
        if is_inline && is_push {
            return Err(Error::usage(
                "VUID-VkDescriptorSetLayoutCreateInfo-flags-02208",
                "an inline uniform block is pushed",
            ));
        }
        if is_inline && info.count % 4 != 0 {
            return Err(Error::usage(
                "VUID-VkDescriptorSetLayoutBinding-descriptorType-02209",
                format!("an inline uniform block of {} bytes", info.count),
            ));
        }
        if is_inline && info.count > limits::MAX_INLINE_UNIFORM_BLOCK_SIZE {
            return Err(Error::usage(
                "VUID-VkDescriptorSetLayoutBinding-descriptorType-08004",
                format!(
                    "an inline uniform block of {} bytes; it may have {}",
                    info.count,
                    limits::MAX_INLINE_UNIFORM_BLOCK_SIZE
                ),
            ));
        }
        if info.flags.contains(vk::DescriptorBindingFlags::VARIABLE_DESCRIPTOR_COUNT) && is_dynamic(info.kind) {
            return Err(Error::usage(
                "VUID-VkDescriptorSetLayoutBindingFlagsCreateInfo-pBindingFlags-03015",
                "a binding of dynamic offsets has a variable count",
            ));
        }
    }
    let last = infos.iter().map(|info| info.number).max();
    let is_elsewhere = |info: &BindingInfo| {
        info.flags.contains(vk::DescriptorBindingFlags::VARIABLE_DESCRIPTOR_COUNT) && Some(info.number) != last
    };
    if let Some(info) = infos.iter().find(|info| is_elsewhere(info)) {
        return Err(Error::usage(
            "VUID-VkDescriptorSetLayoutBindingFlagsCreateInfo-pBindingFlags-03004",
            format!("binding {} has a variable count and is not the last", info.number),
        ));
    }
    Ok(())
}

/// The layout of a create info.
///
/// # Safety
/// The create info and its chain are valid.
unsafe fn new_layout(info: &vk::DescriptorSetLayoutCreateInfo<'_>) -> Result<DescriptorSetLayout, Error> {
    let is_push = info.flags.contains(vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR);
    let known = vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR
        | vk::DescriptorSetLayoutCreateFlags::UPDATE_AFTER_BIND_POOL;
    if !known.contains(info.flags) {
        return Err(Error::FeatureNotPresent(format!("a descriptor set layout with flags {:?}", info.flags)));
    }
    // SAFETY: the caller's promise.
    unsafe {
        let mut binding_flags: &[vk::DescriptorBindingFlags] = &[];
        if let Some(flags) = valid::find_in_chain::<vk::DescriptorSetLayoutBindingFlagsCreateInfo<'_>>(info.p_next) {
            let flags = valid::slice(flags.p_binding_flags, flags.binding_count)?;
            let known = vk::DescriptorBindingFlags::PARTIALLY_BOUND
                | vk::DescriptorBindingFlags::UPDATE_UNUSED_WHILE_PENDING
                | vk::DescriptorBindingFlags::UPDATE_AFTER_BIND
                | vk::DescriptorBindingFlags::VARIABLE_DESCRIPTOR_COUNT;
            binding_flags = flags;
            if let Some(flags) = flags.iter().find(|&&flags| !known.contains(flags)) {
                return Err(Error::FeatureNotPresent(format!("a descriptor binding with flags {flags:?}")));
            }
        }
        let bindings = valid::slice(info.p_bindings, info.binding_count)?;
        let bindings = bindings.iter().enumerate().map(|(index, binding)| {
            let flags = binding_flags.get(index).copied().unwrap_or_default();
            binding_info(binding, flags)
        });
        let layout = DescriptorSetLayout::new(bindings.collect::<Result<_, _>>()?, info.flags)?;
        if is_push && layout.count() > limits::MAX_PUSH_DESCRIPTORS as usize {
            return Err(Error::usage(
                "VUID-VkDescriptorSetLayoutCreateInfo-flags-00281",
                format!("{} descriptors are pushed; there may be {}", layout.count(), limits::MAX_PUSH_DESCRIPTORS),
            ));
        }
        Ok(layout)
    }
}

/// Follows the pointers of a binding.
///
/// # Safety
/// The binding is valid.
unsafe fn binding_info(
    binding: &vk::DescriptorSetLayoutBinding<'_>,
    flags: vk::DescriptorBindingFlags,
) -> Result<BindingInfo, Error> {
    let has_samplers =
        matches!(binding.descriptor_type, vk::DescriptorType::SAMPLER | vk::DescriptorType::COMBINED_IMAGE_SAMPLER);
    let immutable_samplers = if has_samplers && !binding.p_immutable_samplers.is_null() {
        // SAFETY: the caller's promise; kinds without samplers may have any pointer, which isn't followed.
        unsafe {
            let samplers = valid::slice(binding.p_immutable_samplers, binding.descriptor_count)?;
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
        flags,
    })
}

/// # Safety
/// The create info and its chain are valid.
#[doc(alias = "vkCreateDescriptorSetLayout")]
pub(crate) unsafe fn create_descriptor_set_layout(
    create_info: &vk::DescriptorSetLayoutCreateInfo<'_>,
) -> Result<Arc<DescriptorSetLayout>, Error> {
    // SAFETY: the caller's promise.
    unsafe { new_layout(create_info) }.map(Arc::new)
}

/// # Safety
/// As [`create_descriptor_set_layout`].
#[doc(alias = "vkGetDescriptorSetLayoutSupport")]
pub(crate) unsafe fn get_descriptor_set_layout_support(
    create_info: &vk::DescriptorSetLayoutCreateInfo<'_>,
    mut support: OutputChain<'_, vk::DescriptorSetLayoutSupport<'_>>,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    let layout = unsafe { new_layout(create_info) };
    // A layout that is refused for another reason than its size is reported as unsupported, too.
    let most = limits::MAX_PER_SET_DESCRIPTORS as usize;
    let layout = layout.ok().filter(|layout| layout.count() <= most);
    support.supported = layout.is_some().into();
    let max_variable_count = layout.map_or(0, |layout| layout.max_variable_count());
    support.for_each_chained(|mut structure| {
        if let Some(variable) = structure.cast::<vk::DescriptorSetVariableDescriptorCountLayoutSupport<'_>>() {
            variable.max_variable_descriptor_count = max_variable_count;
        }
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info(number: u32, kind: vk::DescriptorType, count: u32) -> BindingInfo {
        BindingInfo {
            number,
            kind,
            count,
            stages: vk::ShaderStageFlags::ALL,
            immutable_samplers: Vec::new(),
            flags: vk::DescriptorBindingFlags::empty(),
        }
    }

    const NONE: vk::DescriptorSetLayoutCreateFlags = vk::DescriptorSetLayoutCreateFlags::empty();

    #[test]
    fn bindings_follow_each_other_by_number() {
        let dynamic = vk::DescriptorType::STORAGE_BUFFER_DYNAMIC;
        let infos = vec![
            info(9, dynamic, 2),
            info(4, vk::DescriptorType::SAMPLER, 0),
            info(2, vk::DescriptorType::UNIFORM_BUFFER, 3),
            info(1, dynamic, 1),
        ];
        let layout = DescriptorSetLayout::new(infos, NONE).unwrap();
        assert_eq!((layout.count(), layout.dynamic_count()), (6, 3));
        assert_eq!(layout.index(2, 1).unwrap(), 2);
        assert_eq!(layout.index(9, 0).unwrap(), 4);
        assert_eq!(layout.binding(9).unwrap().first_dynamic, Some(1));
        assert_eq!(layout.binding(2).unwrap().first_dynamic, None);
        assert!(layout.index(4, 0).is_err(), "reserved only");
        assert!(layout.index(3, 0).is_err());
    }

    #[test]
    fn a_variable_binding_may_have_what_the_others_leave() {
        let kind = vk::DescriptorType::STORAGE_BUFFER;
        let with_last = |kind, count| {
            let flags = vk::DescriptorBindingFlags::VARIABLE_DESCRIPTOR_COUNT;
            let last = BindingInfo { flags, ..info(7, kind, count) };
            DescriptorSetLayout::new(vec![info(1, vk::DescriptorType::SAMPLER, 5), last], NONE).unwrap()
        };
        for count in [0, 1, 100] {
            assert_eq!(with_last(kind, count).max_variable_count(), limits::MAX_PER_SET_DESCRIPTORS - 5);
            let inline = with_last(vk::DescriptorType::INLINE_UNIFORM_BLOCK, 4 * count);
            assert_eq!(inline.max_variable_count(), limits::MAX_INLINE_UNIFORM_BLOCK_SIZE);
        }
        let fixed = DescriptorSetLayout::new(vec![info(1, kind, 5)], NONE).unwrap();
        assert_eq!(fixed.max_variable_count(), 0);
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let kind = vk::DescriptorType::STORAGE_BUFFER;
        let twice = vec![info(1, kind, 1), info(1, kind, 1)];
        assert!(DescriptorSetLayout::new(twice, NONE).is_err());
        let many = vec![info(1, kind, u32::MAX), info(2, kind, u32::MAX)];
        assert!(DescriptorSetLayout::new(many, NONE).is_err());
        let unknown = vec![info(1, vk::DescriptorType::MUTABLE_EXT, 1)];
        assert!(DescriptorSetLayout::new(unknown, NONE).is_err());
    }
}
