//! Updates of descriptor sets: writes, copies and templates.

use crate::error::Error;
use crate::object::descriptor::layout::DescriptorSetLayout;
use crate::object::descriptor::set::Write;
use crate::object::descriptor::template::UpdateTemplate;
use crate::object::descriptor::{BufferDescriptor, Descriptor};
use crate::object::device::Device;
use crate::{handle, pointer};
use ash::vk;
use simdevice::host;
use std::ffi::c_void;
use std::sync::Arc;

crate::entry_points! {
    #[doc(alias = "vkUpdateDescriptorSets")]
    fn update_descriptor_sets(
        device: vk::Device,
        descriptor_write_count: u32,
        descriptor_writes: *const vk::WriteDescriptorSet<'_>,
        descriptor_copy_count: u32,
        descriptor_copies: *const vk::CopyDescriptorSet<'_>,
    ) {
        update(handle::get(device)?, || {
            for info in pointer::slice(descriptor_writes, descriptor_write_count)? {
                let set = handle::get(info.dst_set)?;
                set.write(&write(info, set.layout())?)?;
            }
            for copy in pointer::slice(descriptor_copies, descriptor_copy_count)? {
                handle::get(copy.dst_set)?.copy(
                    (copy.dst_binding, copy.dst_array_element),
                    handle::get(copy.src_set)?,
                    (copy.src_binding, copy.src_array_element),
                    copy.descriptor_count,
                )?;
            }
            Ok(())
        })
    }

    #[doc(alias = "vkCreateDescriptorUpdateTemplate")]
    fn create_descriptor_update_template(
        _device: vk::Device,
        create_info: *const vk::DescriptorUpdateTemplateCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        descriptor_update_template: *mut vk::DescriptorUpdateTemplate,
    ) -> vk::Result {
        let info = pointer::input(create_info)?;
        let entries = pointer::slice(
            info.p_descriptor_update_entries,
            info.descriptor_update_entry_count,
        )?;
        let pushes = info.template_type == vk::DescriptorUpdateTemplateType::PUSH_DESCRIPTORS_KHR;
        let template = UpdateTemplate {
            entries: host::copied(entries),
            push_bind_point: pushes.then_some(info.pipeline_bind_point),
        };
        pointer::output(descriptor_update_template, handle::create(Arc::new(template)))
    }

    #[doc(alias = "vkUpdateDescriptorSetWithTemplate")]
    fn update_descriptor_set_with_template(
        device: vk::Device,
        descriptor_set: vk::DescriptorSet,
        descriptor_update_template: vk::DescriptorUpdateTemplate,
        data: *const c_void,
    ) {
        update(handle::get(device)?, || {
            let set = handle::get(descriptor_set)?;
            let template = handle::get(descriptor_update_template)?;
            let writes = template_writes(template, set.layout(), data)?;
            writes.iter().try_for_each(|write| set.write(write))
        })
    }
}

/// Updates descriptors. There is no result to return, so that the device is lost where memory is wanting: what is drawn
/// with them would be something else.
fn update(device: &Device, body: impl FnOnce() -> Result<(), Error>) -> Result<(), Error> {
    host::catch(body).unwrap_or_else(|memory| {
        device.signals().lose(&memory.to_string());
        Err(Error::OutOfHostMemory(memory.to_string()))
    })
}

/// A write to a set of a layout, with its pointers followed and its objects looked up.
///
/// # Safety
/// The write is valid.
pub(super) unsafe fn write(
    info: &vk::WriteDescriptorSet<'_>,
    layout: &DescriptorSetLayout,
) -> Result<Write, Error> {
    let kind = info.descriptor_type;
    let contents = Contents::of(kind, layout, info.dst_binding)?;
    let (data, stride) = match contents {
        Contents::Image { .. } => (
            info.p_image_info.cast(),
            size_of::<vk::DescriptorImageInfo>(),
        ),
        Contents::Buffer => (
            info.p_buffer_info.cast(),
            size_of::<vk::DescriptorBufferInfo>(),
        ),
        Contents::TexelBuffer => (info.p_texel_buffer_view.cast(), size_of::<vk::BufferView>()),
    };
    // SAFETY: the caller's promise: the array that belongs to the kind has as many elements.
    let descriptors = unsafe { descriptors(contents, info.descriptor_count, data, stride)? };
    Ok(Write {
        binding: info.dst_binding,
        element: info.dst_array_element,
        kind,
        descriptors,
    })
}

/// The writes to a set of a layout that a template makes of the application's data.
///
/// # Safety
/// The data is what the template describes.
pub(super) unsafe fn template_writes(
    template: &UpdateTemplate,
    layout: &DescriptorSetLayout,
    data: *const c_void,
) -> Result<Vec<Write>, Error> {
    if data.is_null() {
        return Err(Error::NullPointer {
            what: "an update template's data",
        });
    }
    let write = |entry: &vk::DescriptorUpdateTemplateEntry| {
        let contents = Contents::of(entry.descriptor_type, layout, entry.dst_binding)?;
        // SAFETY: the caller's promise: the entry's offset and stride lead to valid contents.
        let descriptors = unsafe {
            descriptors(
                contents,
                entry.descriptor_count,
                data.byte_add(entry.offset),
                entry.stride,
            )?
        };
        Ok(Write {
            binding: entry.dst_binding,
            element: entry.dst_array_element,
            kind: entry.descriptor_type,
            descriptors,
        })
    };
    let mut writes = host::with_capacity(template.entries.len());
    for entry in &template.entries {
        writes.push(write(entry)?);
    }
    Ok(writes)
}

/// The structure that describes a descriptor, and what of it counts.
#[derive(Clone, Copy)]
enum Contents {
    Image { view: bool, sampler: bool },
    Buffer,
    TexelBuffer,
}

impl Contents {
    /// What describes a descriptor of this kind in a binding of a layout.
    fn of(
        kind: vk::DescriptorType,
        layout: &DescriptorSetLayout,
        binding: u32,
    ) -> Result<Self, Error> {
        let immutable = layout
            .binding(binding)
            .is_some_and(|binding| !binding.immutable_samplers.is_empty());
        match kind {
            vk::DescriptorType::SAMPLER => Ok(Self::Image {
                view: false,
                sampler: !immutable,
            }),
            vk::DescriptorType::COMBINED_IMAGE_SAMPLER => Ok(Self::Image {
                view: true,
                sampler: !immutable,
            }),
            vk::DescriptorType::SAMPLED_IMAGE
            | vk::DescriptorType::STORAGE_IMAGE
            | vk::DescriptorType::INPUT_ATTACHMENT => Ok(Self::Image {
                view: true,
                sampler: false,
            }),
            vk::DescriptorType::UNIFORM_BUFFER
            | vk::DescriptorType::STORAGE_BUFFER
            | vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC
            | vk::DescriptorType::STORAGE_BUFFER_DYNAMIC => Ok(Self::Buffer),
            vk::DescriptorType::UNIFORM_TEXEL_BUFFER | vk::DescriptorType::STORAGE_TEXEL_BUFFER => {
                Ok(Self::TexelBuffer)
            }
            other => Err(Error::FeatureNotPresent(format!(
                "a descriptor of type {other:?}"
            ))),
        }
    }
}

/// `count` descriptors, described every `stride` bytes from `data` on.
///
/// # Safety
/// The structures that belong to the kind lie there and are valid.
unsafe fn descriptors(
    contents: Contents,
    count: u32,
    data: *const c_void,
    stride: usize,
) -> Result<Vec<Descriptor>, Error> {
    if count > 0 && data.is_null() {
        return Err(Error::NullPointer {
            what: "the contents of descriptors",
        });
    }
    // SAFETY: the caller's promise, for each element.
    let one = |index: u32| unsafe {
        let data = data.byte_add(index as usize * stride);
        match contents {
            Contents::Image { view, sampler } => image(
                view,
                sampler,
                &data.cast::<vk::DescriptorImageInfo>().read_unaligned(),
            ),
            Contents::Buffer => buffer(&data.cast::<vk::DescriptorBufferInfo>().read_unaligned()),
            Contents::TexelBuffer => {
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

/// An image's view and a sampler, as far as they count; what doesn't may be anything.
///
/// # Safety
/// The handles that count are live.
unsafe fn image(
    view: bool,
    sampler: bool,
    info: &vk::DescriptorImageInfo,
) -> Result<Descriptor, Error> {
    let view = if view {
        info.image_view
    } else {
        vk::ImageView::null()
    };
    let sampler = if sampler {
        info.sampler
    } else {
        vk::Sampler::null()
    };
    // SAFETY: the caller's promise.
    unsafe {
        Ok(Descriptor::Image {
            view: handle::get_optional(view)?.cloned(),
            sampler: handle::get_optional(sampler)?.cloned(),
        })
    }
}

/// # Safety
/// The buffer is live.
unsafe fn buffer(info: &vk::DescriptorBufferInfo) -> Result<Descriptor, Error> {
    // SAFETY: the caller's promise.
    let Some(buffer) = (unsafe { handle::get_optional(info.buffer)? }) else {
        return Ok(Descriptor::Empty);
    };
    Ok(Descriptor::Buffer(BufferDescriptor {
        rest: buffer.range(info.offset, None)?,
        size: (info.range != vk::WHOLE_SIZE).then_some(info.range),
    }))
}
