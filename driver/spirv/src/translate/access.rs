//! Pointers and access chains.

use isa::ir::{Address, Binding, Format, Reg, Space};
use isa::op::Op as Ir;
use spirv::{Op, StorageClass};

use super::super::error::{Result, malformed, unsupported};
use super::super::instruction::Instruction;
use super::super::types::{ImageType, Scalar, Type};
use super::{Translator, Value};

/// A move within a variable that is known at run time only.
#[derive(Clone, Copy, Debug)]
pub struct DynamicIndex {
    pub index: Reg,
    /// Elements that it may pick.
    pub count: u32,
    /// Scalars of an element.
    pub scalars: u32,
}

/// How what a pointer into memory points to is laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryLayout {
    /// By decorations; otherwise scalars lie close together, each in a word or two.
    pub explicit: bool,
    /// The stride of matrices, and whether it is from row to row.
    pub matrix: Option<(u32, bool)>,
    /// Bytes between the components of a vector, if they aren't adjacent.
    pub component_stride: Option<u32>,
}

/// A place in memory.
#[derive(Clone, Copy, Debug)]
pub struct MemoryRef {
    pub space: Space,
    pub base: Option<Reg>,
    pub offset: u32,
    pub layout: MemoryLayout,
    pub ty: u32,
}

impl MemoryRef {
    /// The address some bytes further on.
    pub fn at(&self, bytes: u32) -> Address {
        Address {
            space: self.space,
            base: self.base,
            offset: self.offset.saturating_add(bytes),
        }
    }
}

/// What a pointer leads to.
#[derive(Clone, Debug)]
pub enum Pointer {
    /// A part of a variable held in registers.
    PromotedVariable {
        slot: usize,
        start: usize,
        steps: Vec<DynamicIndex>,
        ty: u32,
    },
    Memory(MemoryRef),
    /// A descriptor, or an array of them.
    Resource {
        binding: Binding,
        class: StorageClass,
        ty: u32,
    },
    /// A texel of a storage image.
    Texel {
        image: Binding,
        image_type: ImageType,
        coordinate: Vec<Reg>,
        sample: Reg,
    },
}

impl Pointer {
    /// The place in memory, if it is one with a device address.
    pub fn address(&self) -> Option<&MemoryRef> {
        match self {
            Self::Memory(place) if place.space == Space::Global => Some(place),
            _ => None,
        }
    }
}

/// An index of an access chain.
#[derive(Clone, Copy)]
enum Index {
    Constant(u32),
    Dynamic { reg: Reg, scalar: Scalar },
}

impl Translator<'_> {
    /// The pointer that an id stands for.
    pub fn pointer(&mut self, id: u32) -> Result<Pointer> {
        match self.value(id)? {
            Value::Pointer(pointer) => Ok((*pointer).clone()),
            Value::Regs(regs) => {
                let (class, pointee) = self.globals.types.pointer(self.type_of(id)?)?;
                match (class, &*regs) {
                    (StorageClass::PhysicalStorageBuffer, [address]) => {
                        Ok(Pointer::Memory(MemoryRef {
                            space: Space::Global,
                            base: Some(*address),
                            offset: 0,
                            layout: EXPLICIT,
                            ty: pointee,
                        }))
                    }
                    _ => unsupported(format!("%{id} as a pointer")),
                }
            }
            _ => malformed(format!("%{id} isn't a pointer")),
        }
    }

    /// The 64-bit address of a place.
    pub fn pointer_to_address(&mut self, place: &MemoryRef) -> Result<Reg> {
        let Some(base) = place.base else {
            return malformed("the pointer has no address");
        };
        if place.offset == 0 {
            return Ok(base);
        }
        let offset = self.u64(u64::from(place.offset));
        Ok(self.op(Ir::IAdd64, &[base, offset]))
    }

    /// `OpAccessChain` and its relatives.
    pub fn access_chain(&mut self, it: &Instruction) -> Result<()> {
        let by_element = matches!(it.opcode, Op::PtrAccessChain | Op::InBoundsPtrAccessChain);
        let mut pointer = self.pointer(it.id(0)?)?;
        if by_element {
            let element = self.index(it.id(1)?)?;
            pointer = self.next_element(pointer, self.type_of(it.id(0)?)?, element)?;
        }
        for id in it.ids(1 + usize::from(by_element)) {
            let index = self.index(id)?;
            pointer = self.pointer_to_part(pointer, index)?;
        }
        self.define_as(it, Value::Pointer(pointer.into()))
    }

    fn index(&mut self, id: u32) -> Result<Index> {
        if let Some(index) = self.globals.constant_u32(id) {
            return Ok(Index::Constant(index));
        }
        let (scalar, regs) = self.vector(id)?;
        match (scalar, &*regs) {
            (Scalar::Int { width: 64, .. }, [reg]) => Ok(Index::Dynamic {
                reg: self.op(Ir::Low32, &[*reg]),
                scalar: Scalar::Int {
                    width: 32,
                    signed: true,
                },
            }),
            (Scalar::Int { .. }, [reg]) => Ok(Index::Dynamic { reg: *reg, scalar }),
            _ => malformed(format!("index %{id} isn't an integer")),
        }
    }

    /// A pointer moved by whole elements of the array that it points into.
    fn next_element(&mut self, pointer: Pointer, ty: u32, element: Index) -> Result<Pointer> {
        let stride = self.module.literal(ty, spirv::Decoration::ArrayStride);
        match (pointer, stride) {
            (Pointer::Memory(place), Some(stride)) => {
                Ok(Pointer::Memory(self.moved(place, element, stride)?))
            }
            _ => unsupported("pointer arithmetic on this pointer"),
        }
    }

    fn pointer_to_part(&mut self, pointer: Pointer, index: Index) -> Result<Pointer> {
        match pointer {
            Pointer::PromotedVariable {
                slot,
                start,
                mut steps,
                ty,
            } => {
                let (part, start) = match index {
                    Index::Constant(index) => {
                        let (part, before) = self.globals.types.part(ty, index)?;
                        (part, start + before as usize)
                    }
                    Index::Dynamic { reg, .. } => {
                        let (part, count) = self.elements(ty)?;
                        let scalars = self.globals.types.scalars(part)?;
                        steps.push(DynamicIndex {
                            index: reg,
                            count,
                            scalars,
                        });
                        (part, start)
                    }
                };
                Ok(Pointer::PromotedVariable {
                    slot,
                    start,
                    steps,
                    ty: part,
                })
            }
            Pointer::Memory(place) => Ok(Pointer::Memory(self.place_of_part(place, index)?)),
            Pointer::Resource { binding, class, ty } => {
                let (element, _) = self.descriptors(ty)?;
                let each = self.descriptor_count(element)?;
                let binding = self.pick_descriptor(binding, index, each)?;
                self.resource(binding, class, element)
            }
            Pointer::Texel { .. } => malformed("a texel has no parts"),
        }
    }

    /// The element type and the length of what a run-time index may go into.
    fn elements(&self, ty: u32) -> Result<(u32, u32)> {
        match self.globals.types.get(ty)? {
            Type::Vector { element, count }
            | Type::Matrix {
                column: element,
                count,
            }
            | Type::Array { element, count, .. } => Ok((*element, *count)),
            _ => malformed("an index that isn't constant into what isn't an array"),
        }
    }

    fn place_of_part(&mut self, mut place: MemoryRef, index: Index) -> Result<MemoryRef> {
        let types = &self.globals.types;
        match types.get(place.ty)? {
            Type::Struct(members) => {
                let Index::Constant(number) = index else {
                    return malformed("the index of a member isn't a constant");
                };
                let Some(member) = members.get(number as usize) else {
                    return malformed(format!("there is no member {number}"));
                };
                let offset = if place.layout.explicit {
                    place.layout.matrix = member
                        .matrix_stride
                        .map(|stride| (stride, member.row_major));
                    match member.offset {
                        Some(offset) => offset,
                        None => return malformed(format!("member {number} has no offset")),
                    }
                } else {
                    let mut before = 0_u64;
                    for earlier in &members[..number as usize] {
                        before += types.tight_size(earlier.ty)?;
                    }
                    u32::try_from(before).unwrap_or(u32::MAX)
                };
                place.offset = place.offset.saturating_add(offset);
                place.ty = member.ty;
                Ok(place)
            }
            Type::Array {
                element, stride, ..
            }
            | Type::RuntimeArray { element, stride } => {
                let (element, stride) = (*element, *stride);
                let stride = if place.layout.explicit {
                    match stride {
                        Some(stride) => stride,
                        None => return malformed("the array has no stride"),
                    }
                } else {
                    u32::try_from(types.tight_size(element)?).unwrap_or(u32::MAX)
                };
                place.ty = element;
                self.moved(place, index, stride)
            }
            Type::Matrix { column, .. } => {
                let column = *column;
                let (scalar, rows) = types.vector(column)?;
                place.ty = column;
                let bytes = scalar_bytes(scalar, place.layout);
                let stride = match place.layout {
                    MemoryLayout {
                        explicit: false, ..
                    } => bytes * rows,
                    MemoryLayout {
                        matrix: Some((stride, row_major)),
                        ..
                    } => {
                        place.layout.component_stride = row_major.then_some(stride);
                        if row_major { bytes } else { stride }
                    }
                    _ => return malformed("the matrix has no stride"),
                };
                self.moved(place, index, stride)
            }
            Type::Vector { element, .. } => {
                let element = *element;
                let (scalar, _) = types.vector(element)?;
                place.ty = element;
                let stride = place.layout.component_stride;
                let stride = stride.unwrap_or(scalar_bytes(scalar, place.layout));
                self.moved(place, index, stride)
            }
            _ => malformed("an index into what has no parts"),
        }
    }

    /// A place moved by `index * stride` bytes.
    fn moved(&mut self, mut place: MemoryRef, index: Index, stride: u32) -> Result<MemoryRef> {
        match index {
            Index::Constant(index) if place.space != Space::Global || index < 1 << 31 => {
                let bytes = u64::from(index) * u64::from(stride) + u64::from(place.offset);
                place.offset = u32::try_from(bytes).unwrap_or(u32::MAX);
            }
            _ if place.space == Space::Global => {
                let wide = match index {
                    Index::Constant(index) => self.u64(i64::from(index.cast_signed()) as u64),
                    Index::Dynamic { reg, scalar } => {
                        let signed = matches!(scalar, Scalar::Int { signed: true, .. });
                        self.op(if signed { Ir::SToS64 } else { Ir::UToU64 }, &[reg])
                    }
                };
                let stride = self.u64(u64::from(stride));
                let bytes = self.op(Ir::IMul64, &[wide, stride]);
                let base = place.base.unwrap_or(bytes);
                place.base = Some(self.op(Ir::IAdd64, &[base, bytes]));
            }
            Index::Constant(_) => return malformed("the index is out of range"),
            Index::Dynamic { reg, .. } => {
                let stride = self.u32(stride);
                let bytes = self.op(Ir::IMul, &[reg, stride]);
                place.base = Some(match place.base {
                    Some(base) => self.op(Ir::IAdd, &[base, bytes]),
                    None => bytes,
                });
            }
        }
        Ok(place)
    }

    /// The element type and length of an array of descriptors.
    pub fn descriptors(&self, ty: u32) -> Result<(u32, u32)> {
        match self.globals.types.get(ty)? {
            Type::Array { element, count, .. } => Ok((*element, *count)),
            Type::RuntimeArray { element, .. } => Ok((*element, self.options.unsized_descriptors)),
            _ => malformed("an index into what is no array of descriptors"),
        }
    }

    /// How many descriptors a type takes.
    pub fn descriptor_count(&self, mut ty: u32) -> Result<u32> {
        let mut count = 1_u32;
        while let Type::Array { .. } | Type::RuntimeArray { .. } = self.globals.types.get(ty)? {
            let (element, length) = self.descriptors(ty)?;
            count = match count.checked_mul(length) {
                Some(count) => count,
                None => return unsupported("an array of too many descriptors"),
            };
            ty = element;
        }
        Ok(count)
    }

    /// One element, of `each` descriptors, of an array of descriptors.
    fn pick_descriptor(&mut self, array: Binding, index: Index, each: u32) -> Result<Binding> {
        let index = match index {
            Index::Constant(index) if array.index.is_none() => {
                let first = u64::from(index) * u64::from(each);
                if first + u64::from(each) > u64::from(array.count) {
                    return malformed("the index is beyond the end of the array of descriptors");
                }
                return Ok(Binding {
                    slot: array.slot + first as u32,
                    count: each,
                    index: None,
                });
            }
            Index::Constant(index) => self.u32(index),
            Index::Dynamic { reg, .. } => reg,
        };
        let each = self.u32(each);
        let mut element = self.op(Ir::IMul, &[index, each]);
        if let Some(outer) = array.index {
            element = self.op(Ir::IAdd, &[outer, element]);
        }
        Ok(Binding {
            index: Some(element),
            ..array
        })
    }

    /// The pointer to a descriptor of some type.
    pub fn resource(&mut self, binding: Binding, class: StorageClass, ty: u32) -> Result<Pointer> {
        Ok(match self.globals.types.get(ty)? {
            Type::Struct(_) => Pointer::Memory(MemoryRef {
                space: Space::Buffer(binding),
                base: None,
                offset: 0,
                layout: EXPLICIT,
                ty,
            }),
            _ => Pointer::Resource { binding, class, ty },
        })
    }

    /// `OpArrayLength`.
    pub fn array_length(&mut self, it: &Instruction) -> Result<()> {
        let pointer = self.pointer(it.id(0)?)?;
        let member = it.number(1)?;
        let Pointer::Memory(MemoryRef {
            space: Space::Buffer(buffer),
            offset: 0,
            base: None,
            ty,
            ..
        }) = pointer
        else {
            return malformed("the operand isn't a pointer to a buffer");
        };
        let (array, _) = self.globals.types.part(ty, member)?;
        let (
            Type::RuntimeArray {
                stride: Some(stride),
                ..
            },
            Type::Struct(members),
        ) = (self.globals.types.get(array)?, self.globals.types.get(ty)?)
        else {
            return malformed("the member isn't an array with a stride");
        };
        let offset = members[member as usize].offset.unwrap_or(0);
        let size = self.builder.buffer_size(buffer);
        let (offset, stride) = (self.u32(offset), self.u32((*stride).max(1)));
        let end = self.op(Ir::UMax, &[size, offset]);
        let bytes = self.op(Ir::ISub, &[end, offset]);
        let length = self.op(Ir::UDiv, &[bytes, stride]);
        self.define(it, vec![length])
    }
}

/// Bytes of a scalar in memory.
pub fn scalar_bytes(scalar: Scalar, layout: MemoryLayout) -> u32 {
    scalar_format(scalar, layout).bytes()
}

/// The format of a scalar in memory.
pub fn scalar_format(scalar: Scalar, layout: MemoryLayout) -> Format {
    if layout.explicit {
        scalar.format()
    } else {
        scalar.tight_format()
    }
}

/// The layout of memory that the application sees, outside matrices.
pub const EXPLICIT: MemoryLayout = MemoryLayout {
    explicit: true,
    matrix: None,
    component_stride: None,
};

/// The layout of workgroup and private memory.
pub const TIGHT: MemoryLayout = MemoryLayout {
    explicit: false,
    matrix: None,
    component_stride: None,
};
