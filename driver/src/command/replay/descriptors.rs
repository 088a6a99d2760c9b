//! Conversion of bound descriptor sets to the resources of programs, by their slots; and dispatches.

use super::state::{BoundSets, State};
use crate::command::BoundSet;
use crate::descriptor::layout::LayoutBinding;
use crate::descriptor::set::Descriptor;
use crate::pipeline::stages::ProgramResources;
use crate::resource::image::ImageView;
use gaurast_spirv::{DescriptorKind, ShaderBinding};
use simdevice::packet::Dispatch;
use simdevice::program::bindings::Bindings;
use simdevice::texture::{ImageBinding, SampledImage, StorageImage, TexelBuffer};
use simdevice::{Allocation, Packet, host};
use std::sync::Arc;

/// A set that is not bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("descriptor set {0}, which the pipeline uses, is not bound")]
pub(crate) struct DescriptorSetNotBound(pub(super) u32);

/// The resources to bind to a program that uses `resources`. Descriptors that a set doesn't have read as zero.
///
/// # Errors
/// [`DescriptorSetNotBound`] if a set is missing.
pub(crate) fn bindings(
    resources: &ProgramResources,
    sets: &BoundSets,
    push_constants: &[u8],
) -> Result<Bindings, DescriptorSetNotBound> {
    let mut bindings = Bindings { push_constants: push_constants.to_vec(), ..Bindings::default() };
    if let Some(addresses) = &resources.addresses {
        let table = addresses.table();
        if resources.writes {
            let written = table.buffers().map(|range| &range.memory);
            written.for_each(|memory| keep_written(memory, &mut bindings));
        }
        bindings.addresses = Some(table);
    }
    for used in &resources.descriptors {
        let bound = sets.get(used.set).ok_or(DescriptorSetNotBound(used.set))?;
        if let Some(binding) = bound.set.layout().binding(used.binding) {
            bind(used, bound, binding, &mut bindings);
        }
    }
    Ok(bindings)
}

/// Binds the descriptors of one variable of a program.
fn bind(shader_binding: &ShaderBinding, bound: &BoundSet, binding: &LayoutBinding, bindings: &mut Bindings) {
    let held = bound.set.lock();
    // A set may have fewer descriptors of its last binding than the layout.
    let held = held.get(binding.first..).unwrap_or_default();
    let count = (shader_binding.count.min(binding.count) as usize).min(held.len());
    for (element, descriptor) in held[..count].iter().enumerate() {
        let slot = shader_binding.slot as usize + element;
        let dynamic = binding.first_dynamic.map(|first| first + element);
        let offset = dynamic.and_then(|index| bound.dynamic_offsets.get(index));
        place(shader_binding, slot, descriptor, offset.copied(), bindings);
    }
}

/// Binds a descriptor to a resource slot.
fn place(
    shader_binding: &ShaderBinding,
    slot: usize,
    descriptor: &Descriptor,
    dynamic_offset: Option<u32>,
    bindings: &mut Bindings,
) {
    match descriptor {
        Descriptor::Empty => {}
        Descriptor::Buffer(buffer) => {
            let range = buffer.range(dynamic_offset.unwrap_or(0));
            mark_written(shader_binding, &range.memory, bindings);
            *element(&mut bindings.buffers, slot) = Some(range);
        }
        Descriptor::TexelBuffer(view) => {
            mark_written(shader_binding, &view.range.memory, bindings);
            *element(&mut bindings.images, slot) =
                ImageBinding::TexelBuffer(TexelBuffer { range: view.range.clone(), format: view.format });
        }
        Descriptor::Image { view, sampler } => {
            if let Some(view) = view {
                mark_written(shader_binding, &view.view.image.memory, bindings);
                *element(&mut bindings.images, slot) = image(shader_binding.kind, view);
            }
            if let Some(sampler) = sampler {
                *element(&mut bindings.samplers, slot) = Some(sampler.state);
            }
        }
    }
}

/// An image view as a variable of this kind reads it.
fn image(kind: DescriptorKind, view: &ImageView) -> ImageBinding {
    let (aspect, swizzle, chroma) = (view.aspect, view.swizzle, view.chroma.clone());
    let view = view.view.clone();
    match kind {
        DescriptorKind::StorageImage => ImageBinding::Storage(StorageImage { view }),
        _ => ImageBinding::Sampled(SampledImage { view, aspect, swizzle, chroma }),
    }
}

fn mark_written(shader_binding: &ShaderBinding, memory: &Arc<Allocation>, bindings: &mut Bindings) {
    if shader_binding.writable {
        keep_written(memory, bindings);
    }
}

fn keep_written(memory: &Arc<Allocation>, bindings: &mut Bindings) {
    let is_known = |known: &Arc<Allocation>| Arc::ptr_eq(known, memory);
    if !bindings.written.iter().any(is_known) {
        bindings.written.push(Arc::clone(memory));
    }
}

/// The element of a resource slot in a list, which grows as needed.
fn element<T: Default>(slots: &mut Vec<T>, index: usize) -> &mut T {
    if slots.len() <= index {
        host::reserve(slots, index + 1 - slots.len());
        slots.resize_with(index + 1, T::default);
    }
    &mut slots[index]
}

/// The reason that a dispatch does nothing: state that it needs is undefined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum DispatchError {
    /// No pipeline is bound.
    #[error("no compute pipeline is bound")]
    Pipeline,
    /// A descriptor set that the pipeline reads is not bound.
    #[error(transparent)]
    DescriptorSetNotBound(#[from] DescriptorSetNotBound),
}

/// The packet of one dispatch.
///
/// # Errors
/// [`DispatchError`] where bound state that the dispatch needs is missing.
pub(crate) fn dispatch(state: &State, base: [u32; 3], count: [u32; 3]) -> Result<Packet, DispatchError> {
    let pipeline = state.compute_pipeline.as_ref().ok_or(DispatchError::Pipeline)?;
    let bindings = bindings(&pipeline.resources, &state.compute_sets, &state.push_constants)?;
    Ok(Packet::Dispatch(Box::new(Dispatch { program: Arc::clone(&pipeline.program), base, count, bindings })))
}
