//! Descriptors: the resource slots of the variables that they are bound to.

use isa::ir::{Binding, Space};
use spirv::{Capability, Decoration, Dim, StorageClass};

use super::translator::Translator;
use super::value::{EXPLICIT, MemoryRef, Pointer};
use crate::error::{Result, malformed, unsupported};
use crate::globals::GlobalVariable;
use crate::interface::{DescriptorKind, ImageUse, ShaderBinding};
use crate::types::{ImageType, Type};

/// The most descriptors that a shader may be bound to.
const MAX_DESCRIPTORS: u32 = 1 << 24;

/// Assigns resource slots to a descriptor variable.
pub fn descriptor(t: &mut Translator, id: u32, variable: GlobalVariable) -> Result<Binding> {
    let count = descriptor_count(t, variable.pointee)?;
    let slot = t.next_resource_slot;
    match slot.checked_add(count) {
        Some(end) if end <= MAX_DESCRIPTORS => t.next_resource_slot = end,
        _ => return unsupported("too many descriptors"),
    }
    let is_unsized = matches!(t.globals.types.get(variable.pointee)?, Type::RuntimeArray { .. });
    let mut ty = variable.pointee;
    while let Type::Array { .. } | Type::RuntimeArray { .. } = t.globals.types.get(ty)? {
        ty = descriptors(t, ty)?.0;
    }
    let (Some(set), Some(binding)) =
        (t.module.literal(id, Decoration::DescriptorSet), t.module.literal(id, Decoration::Binding))
    else {
        return malformed("the variable has no descriptor set and binding");
    };
    let (kind, image) = descriptor_kind(t, variable.class, ty)?;
    let size = match kind {
        DescriptorKind::UniformBuffer | DescriptorKind::StorageBuffer => t.globals.types.explicit_size(ty)?,
        _ => 0,
    };
    t.interface.descriptors.push(ShaderBinding {
        set,
        binding,
        kind,
        count,
        is_unsized,
        slot,
        size,
        writable: false,
        image,
        attachment: (kind == DescriptorKind::InputAttachment).then(|| {
            let index = t.module.literal(id, Decoration::InputAttachmentIndex);
            index.unwrap_or(0)
        }),
        name: descriptor_name(t, id, ty),
    });
    Ok(Binding { slot, count, index: None })
}

/// The name of a descriptor variable; that of its type for a block without an instance name.
fn descriptor_name(t: &Translator, id: u32, ty: u32) -> Option<String> {
    let name = t.module.name(id).or_else(|| t.module.name(ty));
    name.map(str::to_owned)
}

fn descriptor_kind(t: &Translator, class: StorageClass, ty: u32) -> Result<(DescriptorKind, Option<ImageUse>)> {
    use DescriptorKind as Kind;
    let buffer_block = t.module.has(ty, Decoration::BufferBlock);
    Ok(match (t.globals.types.get(ty)?, class) {
        (Type::Struct(_), StorageClass::StorageBuffer) => (Kind::StorageBuffer, None),
        (Type::Struct(_), StorageClass::Uniform) if buffer_block => (Kind::StorageBuffer, None),
        (Type::Struct(_), StorageClass::Uniform) => (Kind::UniformBuffer, None),
        (Type::Sampler, _) => (Kind::Sampler, None),
        (Type::Image(image), _) => {
            let kind = match (image.dim, image.sampled) {
                (Dim::DimSubpassData, _) => Kind::InputAttachment,
                (Dim::DimBuffer, 2) => Kind::StorageTexelBuffer,
                (Dim::DimBuffer, _) => Kind::UniformTexelBuffer,
                (_, 2) => Kind::StorageImage,
                _ => Kind::SampledImage,
            };
            (kind, Some(image_use(t, image)?))
        }
        (Type::SampledImage { image }, _) => match t.globals.types.get(*image)? {
            Type::Image(image) if image.dim == Dim::DimBuffer => (Kind::UniformTexelBuffer, Some(image_use(t, image)?)),
            Type::Image(image) => (Kind::CombinedImageSampler, Some(image_use(t, image)?)),
            _ => return malformed("a sampled image of no image"),
        },
        _ => return unsupported("a descriptor of this type"),
    })
}

fn image_use(t: &Translator, image: &ImageType) -> Result<ImageUse> {
    let (scalar, _) = t.globals.types.vector(image.sampled_type)?;
    if scalar.is_wide() {
        return unsupported("images of 64-bit components");
    }
    Ok(ImageUse { shape: image.shape()?, numeric: scalar.at_interface() })
}

/// The element type and length of an array of descriptors.
pub fn descriptors(t: &Translator, ty: u32) -> Result<(u32, u32)> {
    match t.globals.types.get(ty)? {
        Type::Array { element, count, .. } => Ok((*element, *count)),
        Type::RuntimeArray { .. } if !t.module.declares(Capability::RuntimeDescriptorArray) => {
            malformed("an array of descriptors without a length needs RuntimeDescriptorArray")
        }
        Type::RuntimeArray { element, .. } => Ok((*element, t.options.unsized_descriptors)),
        _ => malformed("an index into what is no array of descriptors"),
    }
}

/// The number of descriptors that a type takes.
pub fn descriptor_count(t: &Translator, mut ty: u32) -> Result<u32> {
    let mut count = 1_u32;
    while let Type::Array { .. } | Type::RuntimeArray { .. } = t.globals.types.get(ty)? {
        let (element, length) = descriptors(t, ty)?;
        count = match count.checked_mul(length) {
            Some(count) => count,
            None => return unsupported("an array of too many descriptors"),
        };
        ty = element;
    }
    Ok(count)
}

/// The pointer to a descriptor of some type.
pub fn resource(t: &mut Translator, binding: Binding, class: StorageClass, ty: u32) -> Result<Pointer> {
    Ok(match t.globals.types.get(ty)? {
        Type::Struct(_) => {
            Pointer::Memory(MemoryRef { space: Space::Buffer(binding), base: None, offset: 0, layout: EXPLICIT, ty })
        }
        _ => Pointer::Resource { binding, class, ty },
    })
}

/// Records that a place in memory may be written.
pub fn mark_written(t: &mut Translator, memory: &MemoryRef) {
    match memory.space {
        Space::Buffer(binding) => mark_binding_written(t, binding),
        Space::Global => t.interface.has_side_effects = true,
        _ => {}
    }
}

/// Records that a descriptor's memory may be written. A variable pointer may point to any storage buffer.
pub fn mark_binding_written(t: &mut Translator, binding: Binding) {
    t.interface.has_side_effects = true;
    let end = binding.slot + binding.count;
    for descriptor in &mut t.interface.descriptors {
        let slots = descriptor.slot..descriptor.slot + descriptor.count;
        let overlaps = slots.start < end && binding.slot < slots.end;
        let is_whole = slots.start <= binding.slot && end <= slots.end;
        if overlaps && (is_whole || descriptor.kind == DescriptorKind::StorageBuffer) {
            descriptor.writable = true;
        }
    }
}
