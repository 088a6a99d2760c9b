//! Lowers descriptor sets: what the programs of a draw or dispatch are bound to, by their bind points.

use crate::command::bound::{BoundSet, BoundSets};
use crate::object::descriptor::Descriptor;
use crate::object::descriptor::layout::Binding;
use crate::object::image::ImageView;
use gaurast_spirv::{self as shader, DescriptorKind};
use simdevice::Allocation;
use simdevice::host;
use simdevice::program::bindings::Bindings;
use simdevice::texture::{ImageBinding, SampledImage, StorageImage, TexelBuffer};
use std::sync::Arc;

/// A set that is not bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("descriptor set {0}, which the pipeline uses, is not bound")]
pub(crate) struct Unbound(pub(super) u32);

/// What programs that use `descriptors` are bound to. What a set doesn't hold reads as zero.
///
/// # Errors
/// [`Unbound`] if a set is missing.
pub(crate) fn bindings(
    descriptors: &[shader::ShaderBinding],
    sets: &BoundSets,
    push_constants: &[u8],
) -> Result<Bindings, Unbound> {
    let mut bindings = Bindings {
        push_constants: push_constants.to_vec(),
        ..Bindings::default()
    };
    for used in descriptors {
        let bound = sets.get(used.set).ok_or(Unbound(used.set))?;
        if let Some(binding) = bound.set.layout().binding(used.binding) {
            bind(used, bound, binding, &mut bindings);
        }
    }
    Ok(bindings)
}

/// Binds what one variable of a program uses.
fn bind(
    used: &shader::ShaderBinding,
    bound: &BoundSet,
    binding: &Binding,
    bindings: &mut Bindings,
) {
    let held = bound.set.lock();
    let count = used.count.min(binding.count) as usize;
    for (element, descriptor) in held[binding.first..][..count].iter().enumerate() {
        let slot = used.slot as usize + element;
        let dynamic = binding.first_dynamic.map(|first| first + element);
        let offset = dynamic.and_then(|index| bound.dynamic_offsets.get(index));
        place(used, slot, descriptor, offset.copied(), bindings);
    }
}

/// Puts what a descriptor holds at a bind point.
fn place(
    used: &shader::ShaderBinding,
    slot: usize,
    descriptor: &Descriptor,
    dynamic_offset: Option<u32>,
    bindings: &mut Bindings,
) {
    match descriptor {
        Descriptor::Empty => {}
        Descriptor::Buffer(buffer) => {
            let range = buffer.range(dynamic_offset.unwrap_or(0));
            note_written(used, &range.memory, bindings);
            *element(&mut bindings.buffers, slot) = Some(range);
        }
        Descriptor::TexelBuffer(view) => {
            note_written(used, &view.range.memory, bindings);
            *element(&mut bindings.images, slot) = ImageBinding::TexelBuffer(TexelBuffer {
                range: view.range.clone(),
                format: view.format,
            });
        }
        Descriptor::Image { view, sampler } => {
            if let Some(view) = view {
                note_written(used, &view.view.image.memory, bindings);
                *element(&mut bindings.images, slot) = image(used.kind, view);
            }
            if let Some(sampler) = sampler {
                *element(&mut bindings.samplers, slot) = Some(sampler.state);
            }
        }
    }
}

/// An image's view as a variable of this kind reads it.
fn image(kind: DescriptorKind, view: &ImageView) -> ImageBinding {
    let (aspect, swizzle) = (view.aspect, view.swizzle);
    let view = view.view.clone();
    match kind {
        DescriptorKind::StorageImage => ImageBinding::Storage(StorageImage { view }),
        _ => ImageBinding::Sampled(SampledImage {
            view,
            aspect,
            swizzle,
        }),
    }
}

fn note_written(used: &shader::ShaderBinding, memory: &Arc<Allocation>, bindings: &mut Bindings) {
    if used.writable
        && !bindings
            .written
            .iter()
            .any(|known| Arc::ptr_eq(known, memory))
    {
        bindings.written.push(Arc::clone(memory));
    }
}

/// The element at a bind point, of a list that grows as needed.
fn element<T: Default>(slots: &mut Vec<T>, index: usize) -> &mut T {
    if slots.len() <= index {
        host::reserve(slots, index + 1 - slots.len());
        slots.resize_with(index + 1, T::default);
    }
    &mut slots[index]
}
