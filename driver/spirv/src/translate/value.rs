//! Meanings of ids: values in registers, pointers, images and samplers.

use std::rc::Rc;

use isa::ir::{Address, Binding, Format, Reg, Space};
use spirv::StorageClass;

use crate::types::{ImageType, Scalar};

/// The meaning of an id.
#[derive(Clone, Debug)]
pub enum Value {
    /// A value: a register for each scalar.
    Regs(Rc<[Reg]>),
    Pointer(Rc<Pointer>),
    Image(Binding, ImageType),
    Sampler(Binding),
    SampledImage(Binding, ImageType, Binding),
}

/// The target of a pointer.
#[derive(Clone, Debug)]
pub enum Pointer {
    /// A part of a variable held in registers.
    PromotedVariable {
        variable: usize,
        start: usize,
        indices: Vec<DynamicIndex>,
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

/// An index within a variable that is known only at run time.
#[derive(Clone, Copy, Debug)]
pub struct DynamicIndex {
    pub index: Reg,
    /// The number of elements from which it selects.
    pub count: u32,
    /// The number of scalars in an element.
    pub scalars: u32,
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
    /// The address `bytes` further on.
    pub fn at(&self, bytes: u32) -> Address {
        Address { space: self.space, base: self.base, offset: self.offset.saturating_add(bytes) }
    }
}

/// The layout of a value in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryLayout {
    /// True if decorations give the layout; otherwise scalars are packed, each in a word or two.
    pub explicit: bool,
    /// The stride of matrices, and true if it is from row to row.
    pub matrix: Option<(u32, bool)>,
    /// The bytes between the components of a vector, if they aren't adjacent.
    pub component_stride: Option<u32>,
}

/// The layout of memory that the application sees, outside matrices.
pub const EXPLICIT: MemoryLayout = MemoryLayout { explicit: true, matrix: None, component_stride: None };

/// The layout of workgroup and private memory.
pub const TIGHT: MemoryLayout = MemoryLayout { explicit: false, matrix: None, component_stride: None };

/// The format of a scalar in memory.
pub fn scalar_format(scalar: Scalar, layout: MemoryLayout) -> Format {
    if layout.explicit { scalar.format() } else { scalar.tight_format() }
}

/// Bytes of a scalar in memory.
pub fn scalar_bytes(scalar: Scalar, layout: MemoryLayout) -> u32 {
    scalar_format(scalar, layout).bytes()
}
