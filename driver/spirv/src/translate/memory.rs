//! Loads and stores.

use std::rc::Rc;

use isa::ir::{Format, Reg};
use isa::op::Op as Ir;

use super::super::error::{Result, malformed};
use super::super::instruction::Instruction;
use super::super::types::{Scalar, Type};
use super::access::{MemoryLayout, MemoryRef, Pointer, scalar_bytes, scalar_format};
use super::{Translator, Value};

/// The most elements of one load or store of the IR.
const MAX_ELEMENTS: usize = 16;

/// Scalars that lie next to each other: their first byte, format, and their places in the value.
struct ContiguousAccess {
    offset: u32,
    format: Format,
    places: Vec<usize>,
}

impl Translator<'_> {
    /// `OpLoad`.
    pub fn load(&mut self, it: &Instruction) -> Result<()> {
        let pointer = self.pointer(it.id(0)?)?;
        if let Pointer::Resource { binding, ty, .. } = pointer {
            let value = match self.globals.types.get(ty)? {
                Type::Image(image) => Value::Image(binding, *image),
                Type::Sampler => Value::Sampler(binding),
                Type::SampledImage { image } => match self.globals.types.get(*image)? {
                    Type::Image(image) => Value::SampledImage(binding, *image, binding),
                    _ => return malformed("a sampled image of no image"),
                },
                _ => return malformed("an array of descriptors can't be loaded"),
            };
            return self.define_as(it, value);
        }
        let regs = self.load_from(&pointer)?;
        self.define(it, regs)
    }

    /// `OpStore`.
    pub fn store(&mut self, it: &Instruction) -> Result<()> {
        let pointer = self.pointer(it.id(0)?)?;
        let regs = self.regs(it.id(1)?)?;
        self.store_to(&pointer, &regs)
    }

    /// `OpCopyMemory`.
    pub fn copy_memory(&mut self, it: &Instruction) -> Result<()> {
        let (target, source) = (self.pointer(it.id(0)?)?, self.pointer(it.id(1)?)?);
        let regs = self.load_from(&source)?;
        self.store_to(&target, &regs)
    }

    /// The value that a pointer points to.
    pub fn load_from(&mut self, pointer: &Pointer) -> Result<Vec<Reg>> {
        match pointer {
            Pointer::PromotedVariable {
                slot,
                start,
                steps,
                ty,
            } => {
                let count = self.globals.types.scalars(*ty)? as usize;
                self.read_slot(*slot, *start, steps, count)
            }
            Pointer::Memory(place) => self.load_place(place),
            _ => malformed("this pointer can't be loaded from"),
        }
    }

    /// Replaces what a pointer points to.
    pub fn store_to(&mut self, pointer: &Pointer, regs: &[Reg]) -> Result<()> {
        match pointer {
            Pointer::PromotedVariable {
                slot,
                start,
                steps,
                ty,
            } => {
                if regs.len() != self.globals.types.scalars(*ty)? as usize {
                    return malformed("the object doesn't fit the pointer");
                }
                self.write_slot(*slot, *start, steps, regs, None)
            }
            Pointer::Memory(place) => self.store_place(place, regs),
            _ => malformed("this pointer can't be stored to"),
        }
    }

    fn load_place(&mut self, place: &MemoryRef) -> Result<Vec<Reg>> {
        let scalars: Rc<[Scalar]> = self.globals.types.flatten(place.ty)?.into();
        self.charge_budget(scalars.len())?;
        let mut loaded = vec![None; scalars.len()];
        for run in self.runs(place, &scalars)? {
            let regs = self
                .builder
                .load(place.at(run.offset), run.format, run.places.len());
            for (reg, index) in regs.into_iter().zip(run.places) {
                loaded[index] = Some(self.loaded_scalar(scalars[index], place.layout, reg));
            }
        }
        match loaded.into_iter().collect() {
            Some(regs) => Ok(regs),
            None => malformed("a part of the value has no place in memory"),
        }
    }

    fn store_place(&mut self, place: &MemoryRef, regs: &[Reg]) -> Result<()> {
        let scalars: Rc<[Scalar]> = self.globals.types.flatten(place.ty)?.into();
        if scalars.len() != regs.len() {
            return malformed("the object doesn't fit the pointer");
        }
        self.charge_budget(scalars.len())?;
        self.note_write(place);
        for run in self.runs(place, &scalars)? {
            let src: Vec<Reg> = run
                .places
                .iter()
                .map(|index| self.stored_scalar(scalars[*index], place.layout, regs[*index]))
                .collect();
            self.builder.store(place.at(run.offset), run.format, &src);
        }
        Ok(())
    }

    /// The scalars of a value in memory, in runs of adjacent ones.
    fn runs(&self, place: &MemoryRef, scalars: &[Scalar]) -> Result<Vec<ContiguousAccess>> {
        let mut offsets = Vec::with_capacity(scalars.len());
        self.offsets(place.ty, place.layout, 0, &mut offsets)?;
        if offsets.len() != scalars.len() {
            return malformed("the type has no layout");
        }
        let mut order: Vec<usize> = (0..offsets.len()).collect();
        order.sort_by_key(|index| offsets[*index]);
        let mut runs: Vec<ContiguousAccess> = Vec::new();
        for index in order {
            let format = scalar_format(scalars[index], place.layout);
            let offset = offsets[index];
            match runs.last_mut() {
                Some(run)
                    if run.format == format
                        && run.places.len() < MAX_ELEMENTS
                        && run
                            .offset
                            .checked_add(format.bytes() * run.places.len() as u32)
                            == Some(offset) =>
                {
                    run.places.push(index);
                }
                _ => runs.push(ContiguousAccess {
                    offset,
                    format,
                    places: vec![index],
                }),
            }
        }
        Ok(runs)
    }

    /// The byte offsets of a type's scalars.
    fn offsets(
        &self,
        ty: u32,
        layout: MemoryLayout,
        start: u32,
        into: &mut Vec<u32>,
    ) -> Result<()> {
        let types = &self.globals.types;
        let at = |index: u32, stride: u32| start.saturating_add(index.saturating_mul(stride));
        match types.get(ty)? {
            Type::Scalar(_) | Type::Pointer { .. } => into.push(start),
            Type::Vector { element, count } => {
                let (scalar, _) = types.vector(*element)?;
                let stride = layout.component_stride;
                let stride = stride.unwrap_or(scalar_bytes(scalar, layout));
                into.extend((0..*count).map(|index| at(index, stride)));
            }
            Type::Matrix { column, count } => {
                let (scalar, rows) = types.vector(*column)?;
                let bytes = scalar_bytes(scalar, layout);
                let (column_stride, component_stride) = match layout {
                    MemoryLayout {
                        explicit: false, ..
                    } => (bytes * rows, None),
                    MemoryLayout {
                        matrix: Some((stride, true)),
                        ..
                    } => (bytes, Some(stride)),
                    MemoryLayout {
                        matrix: Some((stride, false)),
                        ..
                    } => (stride, None),
                    _ => return malformed("the matrix has no stride"),
                };
                let layout = MemoryLayout {
                    component_stride,
                    ..layout
                };
                for index in 0..*count {
                    self.offsets(*column, layout, at(index, column_stride), into)?;
                }
            }
            Type::Array {
                element,
                count,
                stride,
            } => {
                let stride = if layout.explicit {
                    match stride {
                        Some(stride) => *stride,
                        None => return malformed("the array has no stride"),
                    }
                } else {
                    u32::try_from(types.tight_size(*element)?).unwrap_or(u32::MAX)
                };
                for index in 0..*count {
                    self.offsets(*element, layout, at(index, stride), into)?;
                }
            }
            Type::Struct(members) => {
                let mut natural = 0_u32;
                for member in members.iter() {
                    let offset = if layout.explicit {
                        match member.offset {
                            Some(offset) => offset,
                            None => return malformed("a member has no offset"),
                        }
                    } else {
                        natural
                    };
                    let inner = MemoryLayout {
                        matrix: member
                            .matrix_stride
                            .map(|stride| (stride, member.row_major)),
                        ..layout
                    };
                    self.offsets(member.ty, inner, start.saturating_add(offset), into)?;
                    let size = types.tight_size(member.ty).unwrap_or(0);
                    natural = natural.saturating_add(u32::try_from(size).unwrap_or(u32::MAX));
                }
            }
            _ => return malformed("the type has no layout"),
        }
        Ok(())
    }

    /// A scalar's register from what was loaded.
    fn loaded_scalar(&mut self, scalar: Scalar, layout: MemoryLayout, loaded: Reg) -> Reg {
        match scalar {
            Scalar::Bool => {
                let zero = self.u32(0);
                self.op(Ir::INe, &[loaded, zero])
            }
            Scalar::Float { width: 16 } if layout.explicit => self.op(Ir::F16ToF, &[loaded]),
            _ => loaded,
        }
    }

    /// What to store for a scalar.
    fn stored_scalar(&mut self, scalar: Scalar, layout: MemoryLayout, reg: Reg) -> Reg {
        match scalar {
            Scalar::Bool => {
                let (one, zero) = (self.u32(1), self.u32(0));
                self.op(Ir::Select, &[reg, one, zero])
            }
            Scalar::Float { width: 16 } if layout.explicit => self.op(Ir::FToF16, &[reg]),
            _ => reg,
        }
    }
}
