//! Variables outside functions: buffers, images, workgroup memory, push constants.

use isa::ir::{Binding, Dimension, ImageShape, MAX_MEMORY_BYTES, Space};
use spirv::{Decoration, Dim, ImageFormat, StorageClass};

use super::super::error::{Diagnostic, Error, Result, malformed, unsupported};
use super::super::globals::GlobalVariable;
use super::super::interface::{DescriptorKind, ImageUse, ScalarType, ShaderBinding};
use super::super::types::{ImageType, Scalar, Type};
use super::access::{EXPLICIT, MemoryRef, Pointer, TIGHT};
use super::{Translator, Value};

/// The most descriptors that a shader may be bound to.
const MAX_DESCRIPTORS: u32 = 1 << 20;

impl Translator<'_> {
    /// Makes all variables outside functions that are used, resource slots in order of set and binding.
    pub fn global_variables(&mut self) -> Result<(), Error> {
        let mut used: Vec<u32> = self.analysis.used.iter().copied().collect();
        let number = |id, decoration| self.module.literal(id, decoration).unwrap_or(0);
        used.sort_unstable_by_key(|id| {
            let set = number(*id, Decoration::DescriptorSet);
            (set, number(*id, Decoration::Binding), *id)
        });
        for id in used {
            let made = match self.global_variable(id) {
                Ok(_) if self.globals.variables[&id].class == StorageClass::Input => {
                    self.compute_inputs(id)
                }
                other => other.map(|_| ()),
            };
            if let Err(diagnostic) = made {
                let mut declarations = self.module.sections.globals.iter();
                return Err(
                    match (declarations.find(|it| it.result_id == Some(id)), diagnostic) {
                        (Some(declaration), diagnostic) => {
                            diagnostic.locate(declaration.reference())
                        }
                        (None, Diagnostic::Located(error)) => error,
                        (None, Diagnostic::Malformed(reason) | Diagnostic::Unsupported(reason)) => {
                            Error::Binary { reason }
                        }
                    },
                );
            }
        }
        Ok(())
    }

    /// The pointer to a variable outside functions.
    pub fn global_variable(&mut self, id: u32) -> Result<Value> {
        let Some(variable) = self.globals.variables.get(&id).copied() else {
            return malformed(format!("%{id} isn't a variable"));
        };
        let GlobalVariable { class, pointee, .. } = variable;
        let pointer = match class {
            StorageClass::Private if self.analysis.in_memory.contains(&id) => {
                self.private_variable(id, pointee)?
            }
            _ if Self::is_in_registers(class) => {
                let input = (class == StorageClass::Input).then_some(id);
                let slot = self.new_slot(pointee, input)?;
                self.slot_of.insert(id, slot);
                Pointer::PromotedVariable {
                    slot,
                    start: 0,
                    steps: Vec::new(),
                    ty: pointee,
                }
            }
            StorageClass::Workgroup => {
                let bytes = self.tight_bytes(pointee)?;
                let offset = self.builder.allocate_shared(bytes, 8);
                Pointer::Memory(MemoryRef {
                    space: Space::Shared,
                    base: None,
                    offset,
                    layout: TIGHT,
                    ty: pointee,
                })
            }
            StorageClass::PushConstant => Pointer::Memory(MemoryRef {
                space: Space::PushConstants,
                base: None,
                offset: 0,
                layout: EXPLICIT,
                ty: pointee,
            }),
            StorageClass::Uniform | StorageClass::StorageBuffer | StorageClass::UniformConstant => {
                let binding = self.descriptor(id, variable)?;
                self.resource(binding, class, pointee)?
            }
            other => return unsupported(format!("a variable of storage class {other:?}")),
        };
        // Workgroup memory begins as zero, which is the only initializer that it may have.
        if let Some(initializer) = variable.initializer
            && class != StorageClass::Workgroup
        {
            let regs = self.regs(initializer)?;
            self.store_to(&pointer, &regs)?;
        }
        let value = Value::Pointer(pointer.into());
        self.values.insert(id, value.clone());
        Ok(value)
    }

    /// A variable in private memory; each variable once, however often its function is inlined.
    pub fn private_variable(&mut self, id: u32, pointee: u32) -> Result<Pointer> {
        if let Some(Value::Pointer(pointer)) = self.values.get(&id)
            && let Pointer::Memory(_) = **pointer
        {
            return Ok((**pointer).clone());
        }
        let bytes = self.tight_bytes(pointee)?;
        let offset = self.builder.allocate_private(bytes);
        Ok(Pointer::Memory(MemoryRef {
            space: Space::Private,
            base: None,
            offset,
            layout: TIGHT,
            ty: pointee,
        }))
    }

    fn tight_bytes(&self, ty: u32) -> Result<u32> {
        let size = self.globals.types.tight_size(ty)?;
        match u32::try_from(size) {
            Ok(bytes) if bytes <= MAX_MEMORY_BYTES => Ok(bytes),
            _ => Err(Diagnostic::Located(Error::TooLarge {
                what: "bytes of workgroup or private memory",
                limit: MAX_MEMORY_BYTES.into(),
            })),
        }
    }

    /// Gives a descriptor variable its resource slots.
    fn descriptor(&mut self, id: u32, variable: GlobalVariable) -> Result<Binding> {
        let count = self.descriptor_count(variable.pointee)?;
        let slot = self.next_resource_slot;
        match slot.checked_add(count) {
            Some(end) if end <= MAX_DESCRIPTORS => self.next_resource_slot = end,
            _ => return unsupported("too many descriptors"),
        }
        let mut ty = variable.pointee;
        while let Type::Array { .. } | Type::RuntimeArray { .. } = self.globals.types.get(ty)? {
            ty = self.descriptors(ty)?.0;
        }
        let (Some(set), Some(binding)) = (
            self.module.literal(id, Decoration::DescriptorSet),
            self.module.literal(id, Decoration::Binding),
        ) else {
            return malformed("the variable has no descriptor set and binding");
        };
        let (kind, image) = self.descriptor_kind(variable.class, ty)?;
        let size = match kind {
            DescriptorKind::UniformBuffer | DescriptorKind::StorageBuffer => {
                self.globals.types.explicit_size(ty)?
            }
            _ => 0,
        };
        self.interface.descriptors.push(ShaderBinding {
            set,
            binding,
            kind,
            count,
            slot,
            size,
            writable: false,
            image,
            attachment: (kind == DescriptorKind::InputAttachment).then(|| {
                let index = self.module.literal(id, Decoration::InputAttachmentIndex);
                index.unwrap_or(0)
            }),
            name: self.descriptor_name(id, ty),
        });
        Ok(Binding {
            slot,
            count,
            index: None,
        })
    }

    /// A block without an instance name is known by its type's name.
    fn descriptor_name(&self, id: u32, ty: u32) -> Option<String> {
        let name = self.module.name(id).or_else(|| self.module.name(ty));
        name.map(str::to_owned)
    }

    fn descriptor_kind(
        &self,
        class: StorageClass,
        ty: u32,
    ) -> Result<(DescriptorKind, Option<ImageUse>)> {
        use DescriptorKind as Kind;
        let buffer_block = self.module.has(ty, Decoration::BufferBlock);
        Ok(match (self.globals.types.get(ty)?, class) {
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
                (kind, Some(self.image_use(image)?))
            }
            (Type::SampledImage { image }, _) => match self.globals.types.get(*image)? {
                Type::Image(image) if image.dim == Dim::DimBuffer => {
                    (Kind::UniformTexelBuffer, Some(self.image_use(image)?))
                }
                Type::Image(image) => (Kind::CombinedImageSampler, Some(self.image_use(image)?)),
                _ => return malformed("a sampled image of no image"),
            },
            _ => return unsupported("a descriptor of this type"),
        })
    }

    fn image_use(&self, image: &ImageType) -> Result<ImageUse> {
        let (scalar, _) = self.globals.types.vector(image.sampled_type)?;
        if scalar.is_wide() {
            return unsupported("images of 64-bit components");
        }
        Ok(ImageUse {
            shape: shape(image)?,
            numeric: numeric(scalar),
        })
    }

    /// Notes that a place may be written.
    pub fn note_write(&mut self, place: &MemoryRef) {
        match place.space {
            Space::Buffer(binding) => self.note_binding_write(binding),
            Space::Global => self.interface.has_side_effects = true,
            _ => {}
        }
    }

    /// Notes that a descriptor's memory may be written.
    pub fn note_binding_write(&mut self, binding: Binding) {
        self.interface.has_side_effects = true;
        let found = self
            .interface
            .descriptors
            .iter_mut()
            .find(|it| (it.slot..it.slot + it.count).contains(&binding.slot));
        if let Some(descriptor) = found {
            descriptor.writable = true;
        }
    }

    /// Says which push constants are declared.
    pub fn declare_push_constants(&mut self) -> Result<(), Error> {
        for id in &self.analysis.used {
            let Some(variable) = self.globals.variables.get(id) else {
                continue;
            };
            if variable.class != StorageClass::PushConstant {
                continue;
            }
            let size = self.globals.types.explicit_size(variable.pointee);
            let begin = match self.globals.types.get(variable.pointee) {
                Ok(Type::Struct(members)) => {
                    members.iter().filter_map(|member| member.offset).min()
                }
                _ => None,
            };
            let end = u32::try_from(size.unwrap_or(u64::MAX)).unwrap_or(u32::MAX);
            self.interface.push_constants = Some(begin.unwrap_or(0).min(end)..end);
        }
        Ok(())
    }
}

/// The IR's name for an image's kind.
pub fn shape(image: &ImageType) -> Result<ImageShape> {
    let storage_cube = image.dim == Dim::DimCube && image.sampled == 2;
    let dimension = match image.dim {
        Dim::Dim1D => Dimension::D1,
        Dim::Dim2D | Dim::DimSubpassData => Dimension::D2,
        Dim::Dim3D => Dimension::D3,
        Dim::DimCube if storage_cube => Dimension::D2,
        Dim::DimCube => Dimension::Cube,
        Dim::DimBuffer => Dimension::Buffer,
        other => return unsupported(format!("an image of dimension {other:?}")),
    };
    if matches!(image.format, ImageFormat::R64i | ImageFormat::R64ui) {
        return unsupported("images of 64-bit components");
    }
    Ok(ImageShape {
        dimension,
        arrayed: image.arrayed || storage_cube,
        multisampled: image.multisampled,
    })
}

/// The type of a scalar at the interface.
pub fn numeric(scalar: Scalar) -> ScalarType {
    match scalar {
        Scalar::Bool => ScalarType::Bool,
        Scalar::Int {
            width,
            signed: true,
        } => ScalarType::Int { width },
        Scalar::Int { width, .. } => ScalarType::Uint { width },
        Scalar::Float { width } => ScalarType::Float { width },
        Scalar::Address => ScalarType::Uint { width: 64 },
    }
}
