//! Descriptor sets, their descriptors, and updates of them: writes, copies and templates.

use super::layout::DescriptorSetLayout;
use crate::abi::error::Error;
use crate::abi::handle::{self, objects};
use crate::abi::valid;
use crate::device::Device;
use crate::resource::buffer::{BufferRules, BufferView};
use crate::resource::image::ImageView;
use crate::resource::sampler::Sampler;
use ash::vk;
use simdevice::BufferRange;
use simdevice::{Allocation, host};
use std::ffi::c_void;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// An element of a descriptor set.
#[derive(Clone, Debug, Default)]
pub(crate) enum Descriptor {
    /// Nothing: programs read zero.
    #[default]
    Empty,
    /// A uniform or storage buffer.
    Buffer(BufferDescriptor),
    /// A texel buffer.
    TexelBuffer(Arc<BufferView>),
    /// An image, a sampler, or both.
    Image {
        /// The image.
        view: Option<Arc<ImageView>>,
        /// The sampler.
        sampler: Option<Arc<Sampler>>,
    },
}

/// A uniform or storage buffer's descriptor.
#[derive(Clone, Debug)]
pub(crate) struct BufferDescriptor {
    /// The bytes from the descriptor's offset to the end of the buffer.
    pub(crate) rest: BufferRange,
    /// The number of these bytes that are used; `None` (`VK_WHOLE_SIZE`) for all.
    pub(crate) size: Option<u64>,
}

impl BufferDescriptor {
    /// The bytes that a program may access, with a dynamic offset. They never exceed the buffer.
    pub(crate) fn range(&self, dynamic_offset: u32) -> BufferRange {
        let offset = u64::from(dynamic_offset).min(self.rest.size);
        let rest = self.rest.size - offset;
        BufferRange {
            memory: Arc::clone(&self.rest.memory),
            offset: self.rest.offset + offset,
            size: self.size.map_or(rest, |size| size.min(rest)),
        }
    }
}

/// A descriptor set. Commands read it when they execute.
#[derive(Debug)]
pub(crate) struct DescriptorSet {
    layout: Arc<DescriptorSetLayout>,
    variable_count: u32,
    descriptors: Mutex<Vec<Descriptor>>,
}

/// A descriptor of a set: an element of a binding; in an inline uniform block, a byte of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BindingElement {
    binding: u32,
    element: u32,
}

/// An update of consecutive descriptors, already converted.
#[derive(Clone, Debug)]
pub(crate) struct Write {
    /// The first binding.
    pub(crate) binding: u32,
    /// The first element of that binding.
    pub(crate) element: u32,
    /// The kind of the descriptors.
    pub(crate) kind: vk::DescriptorType,
    /// The new descriptors.
    pub(crate) descriptors: Vec<Descriptor>,
    /// The new bytes of an inline uniform block, from byte `element` on; empty for all other kinds.
    pub(crate) bytes: Vec<u8>,
}

objects! {
    vk::DescriptorSet => DescriptorSet;
    vk::DescriptorUpdateTemplate => UpdateTemplate;
}

impl DescriptorSet {
    /// A set that holds only immutable samplers and inline uniform blocks of zeros. Its variable binding has
    /// `variable_count` descriptors, or bytes.
    ///
    /// # Errors
    /// [`Error::OutOfDeviceMemory`] if there is no memory for inline uniform blocks.
    pub(crate) fn new(layout: Arc<DescriptorSetLayout>, variable_count: u32) -> Result<Self, Error> {
        let mut descriptors = host::with_capacity(layout.count());
        let variable = layout.variable_binding().map(|binding| binding.first);
        for binding in layout.bindings() {
            let is_variable = variable == Some(binding.first);
            if binding.inline_bytes > 0 {
                let bytes = match is_variable {
                    true => variable_count.min(binding.inline_bytes),
                    false => binding.inline_bytes,
                };
                descriptors.push(inline_block(bytes)?);
                continue;
            }
            let samplers = binding
                .immutable_samplers
                .iter()
                .map(|sampler| Descriptor::Image { view: None, sampler: Some(Arc::clone(sampler)) });
            descriptors.extend(samplers);
            let count = match is_variable {
                true => variable_count.min(binding.count),
                false => binding.count,
            };
            descriptors.resize(binding.first + count as usize, Descriptor::Empty);
        }
        Ok(Self { layout, variable_count, descriptors: Mutex::new(descriptors) })
    }

    /// The number of descriptors, or of bytes, of its variable binding.
    pub(crate) fn variable_count(&self) -> u32 {
        self.variable_count
    }

    /// Its layout.
    pub(crate) fn layout(&self) -> &Arc<DescriptorSetLayout> {
        &self.layout
    }

    /// The descriptors, by index.
    pub(crate) fn lock(&self) -> MutexGuard<'_, Vec<Descriptor>> {
        self.descriptors.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Replaces descriptors.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`], and nothing is replaced, if the set does not have these descriptors, or they are of
    /// another kind.
    pub(crate) fn write(&self, write: &Write) -> Result<(), Error> {
        if write.kind == vk::DescriptorType::INLINE_UNIFORM_BLOCK {
            let block = self.inline_block(write.binding)?;
            return in_block(&block, write.element, write.bytes.len(), |memory, offset| {
                memory.write(offset, &write.bytes)
            });
        }
        let first = self.layout.index(write.binding, write.element)?;
        let end = first + write.descriptors.len();
        if end > self.lock().len() {
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
        let written = self.layout.overlapping(first, end);
        // Bindings without descriptors are skipped.
        let other = written.iter().find(|binding| binding.count > 0 && binding.kind != write.kind);
        if let Some(other) = other {
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
    /// [`Error::InvalidUsage`], and nothing is replaced, if either set does not have these descriptors.
    pub(crate) fn copy(
        &self,
        to: BindingElement,
        source: &Self,
        from: BindingElement,
        count: u32,
    ) -> Result<(), Error> {
        let BindingElement { binding, element } = to;
        let kind = source.layout.binding(from.binding).map(|b| b.kind);
        if kind == Some(vk::DescriptorType::INLINE_UNIFORM_BLOCK) {
            let mut bytes = host::with_capacity(count as usize);
            bytes.resize(count as usize, 0u8);
            let block = source.inline_block(from.binding)?;
            in_block(&block, from.element, bytes.len(), |memory, offset| memory.read(offset, &mut bytes))?;
            return self.write(&Write {
                binding,
                element,
                kind: kind.unwrap_or_default(),
                descriptors: Vec::new(),
                bytes,
            });
        }
        let start = source.layout.index(from.binding, from.element)?;
        let found = source.lock().get(start..start + count as usize).map(host::copied);
        let Some(descriptors) = found else {
            return Err(Error::usage(
                "VUID-VkCopyDescriptorSet-srcArrayElement-00346",
                format!(
                    "{count} descriptors from element {} of binding {} on go beyond the set",
                    from.element, from.binding
                ),
            ));
        };
        self.write(&Write { binding, element, kind: kind.unwrap_or_default(), descriptors, bytes: Vec::new() })
    }

    /// The bytes of the inline uniform block of a binding.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if the binding is not an inline uniform block.
    fn inline_block(&self, binding: u32) -> Result<BufferRange, Error> {
        let found = self.layout.binding(binding);
        let block = found.filter(|binding| binding.inline_bytes > 0);
        match block.and_then(|binding| self.lock().get(binding.first).cloned()) {
            Some(Descriptor::Buffer(block)) => Ok(block.rest),
            _ => Err(Error::usage(
                "VUID-VkWriteDescriptorSet-descriptorType-00319",
                format!("binding {binding} is no inline uniform block"),
            )),
        }
    }
}

/// The descriptor of an inline uniform block of `bytes` bytes, in memory of its own.
fn inline_block(bytes: u32) -> Result<Descriptor, Error> {
    let size = u64::from(bytes);
    let memory = Allocation::new_zeroed(size.max(1)).map_err(|error| Error::OutOfDeviceMemory(error.to_string()))?;
    Ok(Descriptor::Buffer(BufferDescriptor { rest: BufferRange { memory, offset: 0, size }, size: None }))
}

/// Reads or writes `count` bytes of an inline uniform block from byte `start` on.
///
/// # Errors
/// [`Error::InvalidUsage`] if the block does not have these bytes.
fn in_block<E>(
    block: &BufferRange,
    start: u32,
    count: usize,
    access: impl FnOnce(&Allocation, u64) -> Result<(), E>,
) -> Result<(), Error> {
    let start = u64::from(start);
    let fits = start + count as u64 <= block.size;
    if fits && access(&block.memory, block.offset + start).is_ok() {
        return Ok(());
    }
    Err(Error::usage(
        "VUID-VkWriteDescriptorSet-dstArrayElement-00321",
        format!("{count} bytes from byte {start} on of an inline uniform block of {}", block.size),
    ))
}

/// Replaces a descriptor, but keeps an immutable sampler.
fn replace(place: &mut Descriptor, new: Descriptor, immutable: bool) {
    match (place, new) {
        (Descriptor::Image { view, .. }, Descriptor::Image { view: new, .. }) if immutable => {
            *view = new;
        }
        (place, new) => *place = new,
    }
}

/// A descriptor update template.
#[derive(Debug)]
pub(crate) struct UpdateTemplate {
    /// The entries: the updated descriptors, and the places of their contents in the application's data.
    pub(crate) entries: Vec<vk::DescriptorUpdateTemplateEntry>,
    /// The bind point, for templates of pushed descriptors.
    pub(crate) push_bind_point: Option<vk::PipelineBindPoint>,
}

/// Updates descriptors. The command returns no result, so the device is lost if memory is lacking: draws with the set
/// would give wrong results.
fn update(device: &Device, body: impl FnOnce() -> Result<(), Error>) -> Result<(), Error> {
    host::catch(body).unwrap_or_else(|memory| {
        device.sync().lose(Error::DeviceLost(memory.to_string()));
        Err(Error::OutOfHostMemory(memory.to_string()))
    })
}

/// Converts a write to a set of a layout: follows its pointers and looks up its objects.
///
/// # Safety
/// The write is valid.
pub(crate) unsafe fn write(info: &vk::WriteDescriptorSet<'_>, layout: &DescriptorSetLayout) -> Result<Write, Error> {
    let kind = info.descriptor_type;
    if kind == vk::DescriptorType::INLINE_UNIFORM_BLOCK {
        // SAFETY: the caller's promise.
        let bytes = unsafe {
            let block = valid::find_in_chain::<vk::WriteDescriptorSetInlineUniformBlock<'_>>(info.p_next)
                .ok_or(Error::NullPointer { what: "the bytes of an inline uniform block" })?;
            valid::slice(block.p_data.cast::<u8>(), block.data_size)?
        };
        return Ok(Write {
            binding: info.dst_binding,
            element: info.dst_array_element,
            kind,
            descriptors: Vec::new(),
            bytes: host::copied(bytes),
        });
    }
    let contents = DescriptorSource::of(kind, layout, info.dst_binding)?;
    let (data, stride) = match contents {
        DescriptorSource::Image { .. } => (info.p_image_info.cast(), size_of::<vk::DescriptorImageInfo>()),
        DescriptorSource::Buffer => (info.p_buffer_info.cast(), size_of::<vk::DescriptorBufferInfo>()),
        DescriptorSource::TexelBuffer => (info.p_texel_buffer_view.cast(), size_of::<vk::BufferView>()),
    };
    // SAFETY: the caller's promise: the array that belongs to the kind has as many elements.
    let descriptors = unsafe { descriptors(contents, info.descriptor_count, data, stride)? };
    Ok(Write { binding: info.dst_binding, element: info.dst_array_element, kind, descriptors, bytes: Vec::new() })
}

/// The writes to a set of a layout by a template with the application's data.
///
/// # Safety
/// The data is what the template describes.
pub(crate) unsafe fn template_writes(
    template: &UpdateTemplate,
    layout: &DescriptorSetLayout,
    data: *const c_void,
) -> Result<Vec<Write>, Error> {
    if data.is_null() {
        return Err(Error::NullPointer { what: "an update template's data" });
    }
    let write = |entry: &vk::DescriptorUpdateTemplateEntry| {
        if entry.descriptor_type == vk::DescriptorType::INLINE_UNIFORM_BLOCK {
            // SAFETY: the caller's promise: the bytes of the entry are at its offset.
            let bytes = unsafe {
                let start = data.byte_add(entry.offset).cast::<u8>();
                valid::slice(start, entry.descriptor_count)?
            };
            return Ok(Write {
                binding: entry.dst_binding,
                element: entry.dst_array_element,
                kind: entry.descriptor_type,
                descriptors: Vec::new(),
                bytes: host::copied(bytes),
            });
        }
        let contents = DescriptorSource::of(entry.descriptor_type, layout, entry.dst_binding)?;
        // SAFETY: the caller's promise: the entry's offset and stride lead to valid contents.
        let descriptors =
            unsafe { descriptors(contents, entry.descriptor_count, data.byte_add(entry.offset), entry.stride)? };
        Ok(Write {
            binding: entry.dst_binding,
            element: entry.dst_array_element,
            kind: entry.descriptor_type,
            descriptors,
            bytes: Vec::new(),
        })
    };
    let mut writes = host::with_capacity(template.entries.len());
    for entry in &template.entries {
        writes.push(write(entry)?);
    }
    Ok(writes)
}

/// The structure that describes a descriptor, and the parts of it that are used.
#[derive(Clone, Copy)]
enum DescriptorSource {
    Image { view: bool, sampler: bool },
    Buffer,
    TexelBuffer,
}

impl DescriptorSource {
    /// The source of a descriptor of this kind in a binding of a layout.
    fn of(kind: vk::DescriptorType, layout: &DescriptorSetLayout, binding: u32) -> Result<Self, Error> {
        let immutable = layout.binding(binding).is_some_and(|binding| !binding.immutable_samplers.is_empty());
        match kind {
            vk::DescriptorType::SAMPLER => Ok(Self::Image { view: false, sampler: !immutable }),
            vk::DescriptorType::COMBINED_IMAGE_SAMPLER => Ok(Self::Image { view: true, sampler: !immutable }),
            vk::DescriptorType::SAMPLED_IMAGE
            | vk::DescriptorType::STORAGE_IMAGE
            | vk::DescriptorType::INPUT_ATTACHMENT => Ok(Self::Image { view: true, sampler: false }),
            vk::DescriptorType::UNIFORM_BUFFER
            | vk::DescriptorType::STORAGE_BUFFER
            | vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC
            | vk::DescriptorType::STORAGE_BUFFER_DYNAMIC => Ok(Self::Buffer),
            vk::DescriptorType::UNIFORM_TEXEL_BUFFER | vk::DescriptorType::STORAGE_TEXEL_BUFFER => {
                Ok(Self::TexelBuffer)
            }
            other => Err(Error::FeatureNotPresent(format!("a descriptor of type {other:?}"))),
        }
    }
}

/// `count` descriptors, described every `stride` bytes from `data` on.
///
/// # Safety
/// The structures that belong to the kind lie there and are valid.
unsafe fn descriptors(
    contents: DescriptorSource,
    count: u32,
    data: *const c_void,
    stride: usize,
) -> Result<Vec<Descriptor>, Error> {
    if count > 0 && data.is_null() {
        return Err(Error::NullPointer { what: "the contents of descriptors" });
    }
    // SAFETY: the caller's promise, for each element.
    let one = |index: u32| unsafe {
        let data = data.byte_add(index as usize * stride);
        match contents {
            DescriptorSource::Image { view, sampler } => {
                image(view, sampler, &data.cast::<vk::DescriptorImageInfo>().read_unaligned())
            }
            DescriptorSource::Buffer => buffer(&data.cast::<vk::DescriptorBufferInfo>().read_unaligned()),
            DescriptorSource::TexelBuffer => {
                let view = data.cast::<vk::BufferView>().read_unaligned();
                let view = handle::get_optional(view)?.cloned();
                Ok(view.map_or(Descriptor::Empty, Descriptor::TexelBuffer))
            }
        }
    };
    let mut all = host::with_capacity(count as usize);
    for index in 0..count {
        all.push(one(index)?);
    }
    Ok(all)
}

/// An image's view and a sampler, if they are used; the others may be invalid.
///
/// # Safety
/// The handles that are used are live.
unsafe fn image(view: bool, sampler: bool, info: &vk::DescriptorImageInfo) -> Result<Descriptor, Error> {
    let view = if view { info.image_view } else { vk::ImageView::null() };
    let sampler = if sampler { info.sampler } else { vk::Sampler::null() };
    // SAFETY: the caller's promise.
    unsafe {
        Ok(Descriptor::Image {
            view: handle::get_optional(view)?.cloned(),
            sampler: handle::get_optional(sampler)?.cloned(),
        })
    }
}

/// The rules on the buffer of a descriptor.
const DESCRIBED: BufferRules = BufferRules {
    memory: "VUID-VkWriteDescriptorSet-descriptorType-00329",
    range: "VUID-VkDescriptorBufferInfo-offset-00340",
};

/// # Safety
/// The buffer is live.
unsafe fn buffer(info: &vk::DescriptorBufferInfo) -> Result<Descriptor, Error> {
    // SAFETY: the caller's promise.
    let Some(buffer) = (unsafe { handle::get_optional(info.buffer)? }) else {
        return Ok(Descriptor::Empty);
    };
    Ok(Descriptor::Buffer(BufferDescriptor {
        rest: buffer.range(info.offset, None, &DESCRIBED)?,
        size: (info.range != vk::WHOLE_SIZE).then_some(info.range),
    }))
}

/// # Safety
/// The writes and copies, their chains and their handles are valid.
#[doc(alias = "vkUpdateDescriptorSets")]
pub(crate) unsafe fn update_descriptor_sets(
    device: &Device,
    descriptor_writes: &[vk::WriteDescriptorSet<'_>],
    descriptor_copies: &[vk::CopyDescriptorSet<'_>],
) -> Result<(), Error> {
    update(device, || {
        for info in descriptor_writes {
            // SAFETY: the caller's promise.
            unsafe {
                let set = handle::get(info.dst_set)?;
                set.write(&write(info, set.layout())?)?;
            }
        }
        for copy in descriptor_copies {
            // SAFETY: the caller's promise.
            let (target, source) = unsafe { (handle::get(copy.dst_set)?, handle::get(copy.src_set)?) };
            target.copy(
                BindingElement { binding: copy.dst_binding, element: copy.dst_array_element },
                source,
                BindingElement { binding: copy.src_binding, element: copy.src_array_element },
                copy.descriptor_count,
            )?;
        }
        Ok(())
    })
}

/// # Safety
/// The create info is valid.
#[doc(alias = "vkCreateDescriptorUpdateTemplate")]
pub(crate) unsafe fn create_descriptor_update_template(
    create_info: &vk::DescriptorUpdateTemplateCreateInfo<'_>,
) -> Result<Arc<UpdateTemplate>, Error> {
    let info = create_info;
    // SAFETY: the caller's promise.
    let entries = unsafe { valid::slice(info.p_descriptor_update_entries, info.descriptor_update_entry_count)? };
    let pushes = info.template_type == vk::DescriptorUpdateTemplateType::PUSH_DESCRIPTORS_KHR;
    Ok(Arc::new(UpdateTemplate {
        entries: host::copied(entries),
        push_bind_point: pushes.then_some(info.pipeline_bind_point),
    }))
}

/// # Safety
/// The data is what the template describes, and its handles are live.
#[doc(alias = "vkUpdateDescriptorSetWithTemplate")]
pub(crate) unsafe fn update_descriptor_set_with_template(
    device: &Device,
    descriptor_set: &DescriptorSet,
    descriptor_update_template: &UpdateTemplate,
    data: *const c_void,
) -> Result<(), Error> {
    update(device, || {
        let layout = descriptor_set.layout();
        // SAFETY: the caller's promise.
        let writes = unsafe { template_writes(descriptor_update_template, layout, data)? };
        writes.iter().try_for_each(|write| descriptor_set.write(write))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dynamic_offsets_stay_inside_the_buffer() {
        let mut buffer = BufferDescriptor {
            rest: BufferRange { memory: Allocation::new_zeroed(4096).unwrap(), offset: 256, size: 100 },
            size: Some(64),
        };
        let range = |buffer: &BufferDescriptor, offset| {
            let range = buffer.range(offset);
            (range.offset, range.size)
        };
        assert_eq!(range(&buffer, 0), (256, 64));
        assert_eq!(range(&buffer, 64), (320, 36));
        assert_eq!(range(&buffer, 4000), (356, 0));
        buffer.size = None;
        assert_eq!(range(&buffer, 64), (320, 36));
    }
}
