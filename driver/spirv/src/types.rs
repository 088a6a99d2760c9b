//! SPIR-V's types in the form of the translation: each value type is a sequence of scalars.

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use isa::ir::{self, Dimension, ImageShape};
use spirv::{BuiltIn, Dim, ImageFormat, StorageClass};

use super::error::{Result, malformed, unsupported};
use super::interface::ScalarType;

/// The most scalars that a value may have.
pub(crate) const MAX_SCALARS: u32 = 1 << 14;
/// The deepest that types may be nested.
pub(crate) const MAX_DEPTH: u32 = 32;

/// A scalar of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Scalar {
    Bool,
    /// 8, 16, 32 or 64 bits. Narrow integers are kept extended by their own signedness.
    Int {
        width: u32,
        signed: bool,
    },
    /// 16, 32 or 64 bits. Halves are kept as 32-bit floats.
    Float {
        width: u32,
    },
    /// A device address.
    Address,
}

impl Scalar {
    /// The register that holds it.
    pub fn register(self) -> ir::Type {
        match self {
            Self::Bool => ir::Type::Bool,
            Self::Address => ir::Type::B64,
            _ if self.is_wide() => ir::Type::B64,
            _ => ir::Type::B32,
        }
    }

    /// The number of bits of the scalar; 0 for a truth value.
    pub fn bits(self) -> u32 {
        match self {
            Self::Bool => 0,
            Self::Int { width, .. } | Self::Float { width } => width,
            Self::Address => 64,
        }
    }

    /// The type of the scalar at the interface.
    pub fn at_interface(self) -> ScalarType {
        match self {
            Self::Bool => ScalarType::Bool,
            Self::Int { width, signed: true } => ScalarType::Int { width },
            Self::Int { width, .. } => ScalarType::Uint { width },
            Self::Float { width } => ScalarType::Float { width },
            Self::Address => ScalarType::Uint { width: 64 },
        }
    }

    /// Reports whether it takes 64 bits.
    pub fn is_wide(self) -> bool {
        matches!(self, Self::Int { width: 64, .. } | Self::Float { width: 64 } | Self::Address)
    }

    /// The format in memory that the application sees.
    pub fn format(self) -> ir::Format {
        match self {
            Self::Int { width: 8, signed: true } => ir::Format::S8,
            Self::Int { width: 8, .. } => ir::Format::U8,
            Self::Int { width: 16, signed: true } => ir::Format::S16,
            Self::Int { width: 16, .. } | Self::Float { width: 16 } => ir::Format::U16,
            _ if self.is_wide() => ir::Format::B64,
            _ => ir::Format::B32,
        }
    }

    /// The format in workgroup and private memory, where narrow scalars take a word.
    pub fn tight_format(self) -> ir::Format {
        if self.is_wide() { ir::Format::B64 } else { ir::Format::B32 }
    }
}

/// A member of a struct.
#[derive(Clone, Debug)]
pub(crate) struct Member {
    pub ty: u32,
    /// The number of scalars before it.
    pub start: u32,
    /// Bytes before it, if the struct has an explicit layout.
    pub offset: Option<u32>,
    /// Bytes from one column (or row) to the next, if it is a matrix.
    pub matrix_stride: Option<u32>,
    pub row_major: bool,
    pub built_in: Option<BuiltIn>,
}

/// An image's type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ImageType {
    pub sampled_type: u32,
    pub dim: Dim,
    pub arrayed: bool,
    pub multisampled: bool,
    /// 1 with a sampler, 2 without (storage).
    pub sampled: u32,
    pub format: ImageFormat,
}

impl ImageType {
    /// The IR's name for the image's kind.
    pub fn shape(&self) -> Result<ImageShape> {
        let storage_cube = self.dim == Dim::DimCube && self.sampled == 2;
        let dimension = match self.dim {
            Dim::Dim1D => Dimension::D1,
            Dim::Dim2D | Dim::DimSubpassData => Dimension::D2,
            Dim::Dim3D => Dimension::D3,
            Dim::DimCube if storage_cube => Dimension::D2,
            Dim::DimCube => Dimension::Cube,
            Dim::DimBuffer => Dimension::Buffer,
            other => return unsupported(format!("an image of dimension {other:?}")),
        };
        if matches!(self.format, ImageFormat::R64i | ImageFormat::R64ui) {
            return unsupported("images of 64-bit components");
        }
        Ok(ImageShape {
            dimension,
            // An input attachment is read in the layer that is rendered to.
            arrayed: self.arrayed || storage_cube || self.dim == Dim::DimSubpassData,
            multisampled: self.multisampled,
        })
    }
}

/// A type.
#[derive(Clone, Debug)]
pub(crate) enum Type {
    Void,
    Scalar(Scalar),
    Vector { element: u32, count: u32 },
    Matrix { column: u32, count: u32 },
    Array { element: u32, count: u32, stride: Option<u32> },
    RuntimeArray { element: u32, stride: Option<u32> },
    Struct(Rc<[Member]>),
    Pointer { class: StorageClass, pointee: u32 },
    Image(ImageType),
    Sampler,
    SampledImage { image: u32 },
    Function,
}

/// The scalars of a pointer as a value; empty if pointers of the storage class are not values.
pub(crate) fn pointer_scalars(class: StorageClass) -> &'static [Scalar] {
    const WORD: Scalar = Scalar::Int { width: 32, signed: false };
    match class {
        StorageClass::PhysicalStorageBuffer => &[Scalar::Address],
        // The slot of a descriptor and the bytes from its start. Slots are counted from 1; 0 means the null pointer.
        StorageClass::StorageBuffer => &[WORD, WORD],
        // The bytes from the start of workgroup memory, counted from 1; 0 means the null pointer.
        StorageClass::Workgroup => &[WORD],
        _ => &[],
    }
}

#[derive(Clone, Debug)]
struct Entry {
    ty: Type,
    /// The number of scalars of a value; None if it can't be a value.
    scalars: Option<u32>,
    depth: u32,
}

/// All types of a module.
#[derive(Debug, Default)]
pub(crate) struct Types {
    entries: HashMap<u32, Entry>,
    /// Pointers that are announced but not declared.
    forward: HashSet<u32>,
    /// The layout of the members of a matrix type, if they all have the same.
    matrix_layouts: HashMap<u32, Option<MatrixLayout>>,
}

/// The layout of a matrix: the bytes from one column (or row) to the next, and true if it is from row to row.
pub(crate) type MatrixLayout = (u32, bool);

impl Types {
    /// Announces a pointer type whose pointee isn't declared yet.
    pub fn forward(&mut self, id: u32, class: StorageClass) -> Result<()> {
        if class != StorageClass::PhysicalStorageBuffer {
            return unsupported(format!("a forward pointer of storage class {class:?}"));
        }
        self.forward.insert(id);
        self.declare(id, Type::Pointer { class, pointee: 0 })
    }

    /// Declares a type whose parts are declared already.
    pub fn declare(&mut self, id: u32, ty: Type) -> Result<()> {
        // Sizes of types are cached, so the types of their parts must not change.
        let announced = matches!(
            ty,
            Type::Pointer { class: StorageClass::PhysicalStorageBuffer, pointee } if pointee != 0
        ) && self.forward.remove(&id);
        if self.entries.contains_key(&id) && !announced {
            return malformed("the type is declared twice");
        }
        let parts: Vec<u32> = match &ty {
            Type::Vector { element, .. } | Type::Array { element, .. } | Type::RuntimeArray { element, .. } => {
                vec![*element]
            }
            Type::Matrix { column, .. } => vec![*column],
            Type::Struct(members) => members.iter().map(|member| member.ty).collect(),
            _ => Vec::new(),
        };
        if let Type::Struct(members) = &ty {
            self.note_matrix_layouts(members);
        }
        let mut depth = 0;
        let mut all = Some(0_u32);
        for part in parts {
            let Some(entry) = self.entries.get(&part) else {
                return malformed(format!("type %{part} isn't defined"));
            };
            depth = depth.max(entry.depth + 1);
            all = all.zip(entry.scalars).and_then(|(sum, scalars)| sum.checked_add(scalars));
        }
        if depth > MAX_DEPTH {
            return unsupported("types are nested too deeply");
        }
        let scalars = match &ty {
            Type::Scalar(_) => Some(1),
            Type::Vector { count, .. } | Type::Matrix { count, .. } | Type::Array { count, .. } => {
                all.and_then(|each| each.checked_mul(*count))
            }
            Type::Struct(_) => all,
            Type::Pointer { class, .. } => match pointer_scalars(*class) {
                [] => None,
                scalars => Some(scalars.len() as u32),
            },
            _ => None,
        };
        self.entries.insert(id, Entry { ty, scalars: scalars.filter(|scalars| *scalars <= MAX_SCALARS), depth });
        Ok(())
    }

    fn note_matrix_layouts(&mut self, members: &[Member]) {
        for member in members {
            if let (Some(stride), Some(matrix)) = (member.matrix_stride, self.matrix_in(member.ty)) {
                let layout = Some((stride, member.row_major));
                let noted = self.matrix_layouts.entry(matrix).or_insert(layout);
                if *noted != layout {
                    *noted = None;
                }
            }
        }
    }

    /// The matrix type that a type is, or that it is an array of.
    pub fn matrix_in(&self, mut id: u32) -> Option<u32> {
        loop {
            match self.get(id).ok()? {
                Type::Array { element, .. } | Type::RuntimeArray { element, .. } => id = *element,
                Type::Matrix { .. } => return Some(id),
                _ => return None,
            }
        }
    }

    /// The layout that all members of a matrix type have.
    pub fn matrix_layout(&self, matrix: u32) -> Option<MatrixLayout> {
        self.matrix_layouts.get(&matrix).copied().flatten()
    }

    /// The bytes between elements of a type in all arrays of them; None if these differ, or none has a stride.
    pub fn stride_of_arrays(&self, of: u32) -> Option<u32> {
        let mut strides = self.entries.values().filter_map(|entry| match entry.ty {
            Type::Array { element, stride, .. } | Type::RuntimeArray { element, stride } if element == of => stride,
            _ => None,
        });
        let first = strides.next()?;
        strides.all(|stride| stride == first).then_some(first)
    }

    /// A type by id.
    pub fn get(&self, id: u32) -> Result<&Type> {
        match self.entries.get(&id) {
            Some(entry) => Ok(&entry.ty),
            None => malformed(format!("type %{id} isn't defined")),
        }
    }

    /// The number of scalars of a value of a type.
    pub fn scalars(&self, id: u32) -> Result<u32> {
        match self.entries.get(&id).map(|entry| entry.scalars) {
            Some(Some(scalars)) => Ok(scalars),
            Some(None) => unsupported(format!("%{id} is too large, or no type, for a value")),
            None => malformed(format!("type %{id} isn't defined")),
        }
    }

    /// Tells if values of a type exist.
    pub fn is_value(&self, id: u32) -> bool {
        self.scalars(id).is_ok()
    }

    /// Tells if a type is of images, samplers or pointers that aren't values.
    pub fn is_opaque(&self, id: u32) -> bool {
        match self.get(id) {
            Ok(Type::Image(_) | Type::Sampler | Type::SampledImage { .. }) => true,
            Ok(Type::Pointer { class, .. }) => pointer_scalars(*class).is_empty(),
            _ => false,
        }
    }

    /// Reports whether a type is an array without a length, of which there are no values.
    pub fn is_runtime_array(&self, id: u32) -> bool {
        matches!(self.get(id), Ok(Type::RuntimeArray { .. }))
    }

    /// The scalars of a value, in order.
    pub fn flatten(&self, id: u32) -> Result<Vec<Scalar>> {
        let mut scalars = Vec::with_capacity(self.scalars(id)? as usize);
        self.flatten_into(id, &mut scalars)?;
        Ok(scalars)
    }

    fn flatten_into(&self, id: u32, into: &mut Vec<Scalar>) -> Result<()> {
        match self.get(id)? {
            Type::Scalar(scalar) => into.push(*scalar),
            Type::Pointer { class, .. } => into.extend_from_slice(pointer_scalars(*class)),
            Type::Vector { element, count }
            | Type::Matrix { column: element, count }
            | Type::Array { element, count, .. } => {
                let begin = into.len();
                if *count > 0 {
                    self.flatten_into(*element, into)?;
                }
                let each = into.len() - begin;
                for _ in 1..*count {
                    into.extend_from_within(begin..begin + each);
                }
            }
            Type::Struct(members) => {
                for member in members.iter() {
                    self.flatten_into(member.ty, into)?;
                }
            }
            _ => return malformed(format!("%{id} has no values")),
        }
        Ok(())
    }

    /// The scalar of a scalar or vector type, and the number of components.
    pub fn vector(&self, id: u32) -> Result<(Scalar, u32)> {
        match self.get(id)? {
            Type::Scalar(scalar) => Ok((*scalar, 1)),
            Type::Vector { element, count } => Ok((self.vector(*element)?.0, *count)),
            Type::Pointer { class: StorageClass::PhysicalStorageBuffer, .. } => Ok((Scalar::Address, 1)),
            _ => malformed(format!("%{id} is neither a scalar nor a vector")),
        }
    }

    /// The columns and rows of a matrix type, its column type and its scalar.
    pub fn matrix(&self, id: u32) -> Result<(u32, u32, u32, Scalar)> {
        match self.get(id)? {
            Type::Matrix { column, count } => {
                let (scalar, rows) = self.vector(*column)?;
                Ok((*count, rows, *column, scalar))
            }
            _ => malformed(format!("%{id} isn't a matrix")),
        }
    }

    /// A part of a composite type: its type and the scalars before it.
    pub fn part(&self, id: u32, index: u32) -> Result<(u32, u32)> {
        let (element, count) = match self.get(id)? {
            Type::Vector { element, count }
            | Type::Matrix { column: element, count }
            | Type::Array { element, count, .. } => (*element, *count),
            Type::Struct(members) => {
                return match members.get(index as usize) {
                    Some(member) => Ok((member.ty, member.start)),
                    None => malformed(format!("%{id} has no member {index}")),
                };
            }
            _ => return malformed(format!("%{id} isn't a composite")),
        };
        if index >= count {
            return malformed(format!("index {index} is beyond the end of %{id}"));
        }
        // The product is less than the number of scalars of the whole, if that is a value.
        match self.scalars(element)?.checked_mul(index) {
            Some(start) => Ok((element, start)),
            None => unsupported(format!("%{id} is too large")),
        }
    }

    /// The class and the pointee of a pointer type.
    pub fn pointer(&self, id: u32) -> Result<(StorageClass, u32)> {
        match self.get(id)? {
            Type::Pointer { class, pointee } => Ok((*class, *pointee)),
            _ => malformed(format!("%{id} isn't a pointer")),
        }
    }

    /// Bytes of a type in workgroup and private memory.
    pub fn tight_size(&self, id: u32) -> Result<u64> {
        Ok(match self.get(id)? {
            Type::Scalar(scalar) => u64::from(scalar.tight_format().bytes()),
            Type::Pointer { class, .. } => {
                let scalars = pointer_scalars(*class).iter();
                scalars.map(|it| u64::from(it.tight_format().bytes())).sum()
            }
            Type::Vector { element, count }
            | Type::Matrix { column: element, count }
            | Type::Array { element, count, .. } => self.tight_size(*element)?.saturating_mul(u64::from(*count)),
            Type::Struct(members) => {
                let mut size = 0_u64;
                for member in members.iter() {
                    size = size.saturating_add(self.tight_size(member.ty)?);
                }
                size
            }
            _ => return unsupported(format!("%{id} can't lie in workgroup or private memory")),
        })
    }

    /// Bytes that a type with an explicit layout spans, without trailing padding; a runtime array counts for nothing.
    pub fn explicit_size(&self, id: u32) -> Result<u64> {
        Ok(match self.get(id)? {
            Type::Scalar(scalar) => u64::from(scalar.format().bytes()),
            Type::Pointer { .. } => 8,
            Type::Vector { element, count } => self.explicit_size(*element)? * u64::from(*count),
            Type::Matrix { .. } => return malformed(format!("matrix %{id} has no stride")),
            Type::Array { element, count, stride } => {
                let each = self.explicit_size(*element)?;
                let stride = stride.map_or(each, u64::from);
                each + stride.saturating_mul(u64::from(*count).saturating_sub(1))
            }
            Type::RuntimeArray { .. } => 0,
            Type::Struct(members) => {
                let mut end = 0;
                for member in members.iter() {
                    end = end.max(u64::from(member.offset.unwrap_or(0)) + self.member_size(member)?);
                }
                end
            }
            _ => return malformed(format!("%{id} can't lie in a buffer")),
        })
    }

    /// Bytes of a member, with matrices by their stride, also in arrays.
    fn member_size(&self, member: &Member) -> Result<u64> {
        let mut ty = member.ty;
        let mut before = 0_u64;
        while let Type::Array { element, count, stride } = self.get(ty)? {
            let last = u64::from(*count).saturating_sub(1);
            before = before.saturating_add(u64::from(stride.unwrap_or(0)).saturating_mul(last));
            ty = *element;
        }
        let size = match self.get(ty)? {
            Type::Matrix { .. } => {
                let (columns, rows, _, scalar) = self.matrix(ty)?;
                let Some(stride) = member.matrix_stride else {
                    return malformed(format!("matrix %{ty} has no stride"));
                };
                let (vectors, each) = if member.row_major { (rows, columns) } else { (columns, rows) };
                u64::from(stride) * u64::from(vectors.saturating_sub(1))
                    + u64::from(each) * u64::from(scalar.format().bytes())
            }
            Type::RuntimeArray { .. } => 0,
            _ => self.explicit_size(ty)?,
        };
        Ok(before.saturating_add(size))
    }
}
