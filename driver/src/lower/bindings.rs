//! Lowers descriptor sets: what the programs of a draw or dispatch are bound to, by their bind points.

use crate::command::bound::{BoundSet, BoundSets};
use crate::object::descriptor::layout::Binding;
use crate::object::descriptor::Descriptor;
use crate::shader;
use simdevice::bindings::Bindings;
use std::sync::Arc;

/// A set that is not bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("descriptor set {0}, which the pipeline uses, is not bound")]
pub(crate) struct Unbound(u32);

/// What programs that use `descriptors` are bound to. What a set doesn't hold reads as zero.
///
/// # Errors
/// [`Unbound`] if a set is missing.
pub(crate) fn bindings(
    descriptors: &[shader::Descriptor],
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
    used: &shader::Descriptor,
    bound: &BoundSet,
    binding: &Binding,
    bindings: &mut Bindings,
) {
    let held = bound.set.lock();
    let count = used.count.min(binding.count) as usize;
    for (element, descriptor) in held[binding.first..][..count].iter().enumerate() {
        let slot = used.slot as usize + element;
        match descriptor {
            Descriptor::Empty | Descriptor::TexelBuffer(_) | Descriptor::Image { .. } => {}
            Descriptor::Buffer(buffer) => {
                let dynamic = binding.first_dynamic.map(|first| first + element);
                let offset = dynamic.and_then(|index| bound.dynamic_offsets.get(index));
                let range = buffer.range(offset.copied().unwrap_or(0));
                if used.writable {
                    bindings.written.push(Arc::clone(&range.memory));
                }
                place(&mut bindings.buffers, slot, range);
            }
        }
    }
}

fn place<T>(slots: &mut Vec<Option<T>>, index: usize, value: T) {
    if slots.len() <= index {
        slots.resize_with(index + 1, || None);
    }
    slots[index] = Some(value);
}
