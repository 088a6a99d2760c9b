//! The types, constants and variables of a module, with specialization constants given their values.

use std::collections::HashMap;
use std::rc::Rc;

use half::f16;
use isa::op::Op as Ir;
use spirv::{Decoration, Dim, ImageFormat, Op, StorageClass};

use super::error::{Error, Result, malformed, unsupported};
use super::instruction::{Instruction, Operand};
use super::module::Module;
use super::types::{ImageType, Member, Scalar, Type, Types};

/// The most scalars of all constants together.
const MAX_CONSTANT_SCALARS: usize = 1 << 20;

/// Values for specialization constants.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Specialization {
    values: HashMap<u32, Vec<u8>>,
}

impl Specialization {
    /// Sets the value of the constant with this `SpecId`: the bytes of its type; four for a boolean.
    pub fn set(&mut self, id: u32, bytes: &[u8]) {
        self.values.insert(id, bytes.to_vec());
    }

    /// The bits given to a constant of `expected` bytes; None if it keeps its default.
    fn bits(&self, id: u32, expected: usize) -> Result<Option<u64>, Error> {
        let Some(bytes) = self.values.get(&id) else {
            return Ok(None);
        };
        if bytes.len() != expected {
            return Err(Error::Specialization { id, expected, given: bytes.len() });
        }
        let mut bits = [0; 8];
        bits[..expected].copy_from_slice(bytes);
        Ok(Some(u64::from_le_bytes(bits)))
    }
}

/// A constant: a bit pattern for each scalar, in the form of registers.
#[derive(Clone, Debug)]
pub(crate) struct Constant {
    pub ty: u32,
    pub bits: Rc<[u64]>,
}

/// A variable outside functions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GlobalVariable {
    /// The type of pointers to it.
    pub ty: u32,
    pub class: StorageClass,
    pub pointee: u32,
    pub initializer: Option<u32>,
    /// The initializer, if it is a variable, to which this one then points. It is declared before this one.
    pub initial_variable: Option<u32>,
}

/// All declarations before the functions of a module.
#[derive(Debug, Default)]
pub(crate) struct Globals {
    pub types: Types,
    pub constants: HashMap<u32, Constant>,
    pub variables: HashMap<u32, GlobalVariable>,
    /// Types of undefined ids that aren't values: images, samplers and pointers.
    pub undefined: HashMap<u32, u32>,
    scalars: usize,
}

impl Globals {
    /// Reads the declarations, in order.
    pub fn new(module: &Module, specialization: &Specialization) -> Result<Self, Error> {
        let mut globals = Self::default();
        for instruction in &module.sections.globals {
            globals
                .instruction(module, specialization, instruction)
                .map_err(|diagnostic| diagnostic.locate(instruction.reference()))?;
        }
        Ok(globals)
    }

    /// The value of a constant that is one unsigned number.
    pub fn constant_u32(&self, id: u32) -> Option<u32> {
        match &*self.constants.get(&id)?.bits {
            [bits] => Some(*bits as u32),
            _ => None,
        }
    }

    /// Adds a constant.
    pub fn define(&mut self, id: u32, ty: u32, bits: Vec<u64>) -> Result<()> {
        if bits.len() != self.types.scalars(ty)? as usize {
            return malformed("the constant doesn't have as many parts as its type");
        }
        self.scalars += bits.len();
        if self.scalars > MAX_CONSTANT_SCALARS {
            return Err(Error::TooLarge { what: "scalars of constants", limit: MAX_CONSTANT_SCALARS as u64 }.into());
        }
        let bits = bits.into();
        self.constants.insert(id, Constant { ty, bits });
        Ok(())
    }

    fn instruction(
        &mut self,
        module: &Module,
        specialization: &Specialization,
        instruction: &Instruction,
    ) -> Result<()> {
        if instruction.opcode == Op::Variable {
            let ty = instruction.ty()?;
            let (class, pointee) = self.types.pointer(ty)?;
            let initializer = instruction.id(1).ok();
            let initial_variable = initializer.filter(|id| self.variables.contains_key(id));
            let variable = GlobalVariable { ty, class, pointee, initializer, initial_variable };
            self.variables.insert(instruction.result()?, variable);
            return Ok(());
        }
        if instruction.opcode == Op::TypeForwardPointer {
            return match instruction.enumerant(1, StorageClass::from_u32) {
                Some(class) => self.types.forward(instruction.id(0)?, class),
                None => malformed("there is no storage class"),
            };
        }
        if instruction.opcode.is_type() {
            let ty = self.read_type(module, instruction)?;
            return self.types.declare(instruction.result()?, ty);
        }
        self.constant(module, specialization, instruction)
    }

    fn read_type(&self, module: &Module, instruction: &Instruction) -> Result<Type> {
        let stride = |id| module.literal(id, Decoration::ArrayStride);
        Ok(match instruction.opcode {
            Op::TypeVoid => Type::Void,
            Op::TypeBool => Type::Scalar(Scalar::Bool),
            Op::TypeInt => {
                let (width, signed) = (instruction.number(0)?, instruction.number(1)? != 0);
                if !matches!(width, 8 | 16 | 32 | 64) {
                    return unsupported(format!("integers of {width} bits"));
                }
                Type::Scalar(Scalar::Int { width, signed })
            }
            Op::TypeFloat => {
                let width = instruction.number(0)?;
                if !matches!(width, 16 | 32 | 64) || instruction.operands.len() > 1 {
                    return unsupported("this kind of float");
                }
                Type::Scalar(Scalar::Float { width })
            }
            Op::TypeVector => {
                let (element, count) = (instruction.id(0)?, instruction.number(1)?);
                if !matches!(self.types.get(element)?, Type::Scalar(_)) || !(2..=4).contains(&count) {
                    return malformed("vectors have two to four scalars");
                }
                Type::Vector { element, count }
            }
            Op::TypeMatrix => {
                let (column, count) = (instruction.id(0)?, instruction.number(1)?);
                let Type::Vector { element, .. } = self.types.get(column)? else {
                    return malformed("columns of a matrix are vectors");
                };
                let (scalar, _) = self.types.vector(*element)?;
                if !matches!(scalar, Scalar::Float { .. }) || !(2..=4).contains(&count) {
                    return malformed("matrices have two to four columns of floats");
                }
                Type::Matrix { column, count }
            }
            Op::TypeArray => Type::Array {
                element: instruction.id(0)?,
                count: match self.constant_u32(instruction.id(1)?) {
                    Some(count) if count > 0 => count,
                    _ => return malformed("the length isn't a positive constant"),
                },
                stride: stride(instruction.result()?),
            },
            Op::TypeRuntimeArray => {
                Type::RuntimeArray { element: instruction.id(0)?, stride: stride(instruction.result()?) }
            }
            Op::TypeStruct => Type::Struct(self.members(module, instruction)?),
            Op::TypePointer => match instruction.enumerant(0, StorageClass::from_u32) {
                Some(class) => Type::Pointer { class, pointee: instruction.id(1)? },
                None => return malformed("there is no storage class"),
            },
            Op::TypeImage => Type::Image(image_type(instruction)?),
            Op::TypeSampler => Type::Sampler,
            Op::TypeSampledImage => Type::SampledImage { image: instruction.id(0)? },
            Op::TypeFunction => Type::Function,
            _ => return unsupported("this type"),
        })
    }

    fn members(&self, module: &Module, instruction: &Instruction) -> Result<Rc<[Member]>> {
        let id = instruction.result()?;
        let mut start = Some(0_u32);
        let mut members = Vec::with_capacity(instruction.operands.len());
        for (index, ty) in instruction.ids(0).into_iter().enumerate() {
            let index = index as u32;
            members.push(Member {
                ty,
                start: start.unwrap_or(0),
                offset: module.member_literal(id, index, Decoration::Offset),
                matrix_stride: module.member_literal(id, index, Decoration::MatrixStride),
                row_major: module.member_has(id, index, Decoration::RowMajor),
                built_in: module.member_built_in(id, index),
            });
            start = start.zip(self.types.scalars(ty).ok()).and_then(|(start, scalars)| start.checked_add(scalars));
        }
        Ok(members.into())
    }

    fn constant(&mut self, module: &Module, specialization: &Specialization, instruction: &Instruction) -> Result<()> {
        let (id, ty) = (instruction.result()?, instruction.ty()?);
        if instruction.opcode == Op::Undef && (self.types.is_opaque(ty) || self.types.is_runtime_array(ty)) {
            self.undefined.insert(id, ty);
            return Ok(());
        }
        let spec_id = module.literal(id, Decoration::SpecId);
        let given = |bytes| match spec_id {
            Some(spec_id) => specialization.bits(spec_id, bytes),
            None => Ok(None),
        };
        let opcode = instruction.opcode;
        let bits = match opcode {
            Op::ConstantTrue => vec![1],
            Op::ConstantFalse => vec![0],
            Op::SpecConstantTrue | Op::SpecConstantFalse => {
                let default = u64::from(opcode == Op::SpecConstantTrue);
                vec![given(4)?.map_or(default, |bits| u64::from(bits != 0))]
            }
            Op::Constant | Op::SpecConstant => {
                let (scalar, _) = self.types.vector(ty)?;
                let literal = match instruction.operands.first() {
                    Some(Operand::Literal(bits)) => u64::from(*bits),
                    Some(Operand::Literal64(bits)) => *bits,
                    _ => return malformed("there is no value"),
                };
                let bytes = match scalar {
                    Scalar::Int { width, .. } | Scalar::Float { width } => width as usize / 8,
                    _ => return malformed("this constant is neither an integer nor a float"),
                };
                let bits = match opcode {
                    Op::SpecConstant => given(bytes)?.unwrap_or(literal),
                    _ => literal,
                };
                vec![from_memory(scalar, bits)]
            }
            Op::ConstantComposite | Op::SpecConstantComposite => {
                let mut bits = Vec::new();
                let limit = self.types.scalars(ty)? as usize;
                for part in instruction.ids(0) {
                    let Some(part) = self.constants.get(&part) else {
                        return malformed(format!("%{part} isn't a constant"));
                    };
                    bits.extend_from_slice(&part.bits);
                    if bits.len() > limit {
                        return malformed("the constant has more parts than its type");
                    }
                }
                bits
            }
            Op::ConstantCompositeReplicateEXT | Op::SpecConstantCompositeReplicateEXT => {
                let part = instruction.id(0)?;
                let Some(part) = self.constants.get(&part) else {
                    return malformed(format!("%{part} isn't a constant"));
                };
                let count = self.types.scalars(ty)? as usize;
                part.bits.iter().copied().cycle().take(count).collect()
            }
            Op::ConstantNull => vec![0; self.types.scalars(ty)? as usize],
            Op::Undef => vec![0; self.types.scalars(ty)? as usize],
            Op::SpecConstantOp => evaluate(self, ty, &instruction.numbers(0))?,
            _ => return unsupported("this instruction outside a function"),
        };
        self.define(id, ty, bits)
    }
}

fn image_type(instruction: &Instruction) -> Result<ImageType> {
    let (Some(dim), Some(format)) =
        (instruction.enumerant(1, Dim::from_u32), instruction.enumerant(6, ImageFormat::from_u32))
    else {
        return malformed("the image type isn't complete");
    };
    Ok(ImageType {
        sampled_type: instruction.id(0)?,
        dim,
        arrayed: instruction.number(3)? != 0,
        multisampled: instruction.number(4)? != 0,
        sampled: instruction.number(5)?,
        format,
    })
}

/// The register form of a constant's bits in memory.
fn from_memory(scalar: Scalar, bits: u64) -> u64 {
    match scalar {
        Scalar::Bool => u64::from(bits != 0),
        Scalar::Float { width: 16 } => u64::from(f16::from_bits(bits as u16).to_f32().to_bits()),
        Scalar::Int { .. } | Scalar::Float { .. } | Scalar::Address => wrap_to_width(scalar, bits),
    }
}

/// Truncates an integer to its width and extends it by its own signedness to a register.
fn wrap_to_width(scalar: Scalar, bits: u64) -> u64 {
    match scalar {
        Scalar::Int { width: 8, signed: true } => u64::from(i32::from(bits as i8).cast_unsigned()),
        Scalar::Int { width: 8, .. } => bits & 0xff,
        Scalar::Int { width: 16, signed: true } => u64::from(i32::from(bits as i16).cast_unsigned()),
        Scalar::Int { width: 16, .. } => bits & 0xffff,
        _ if scalar.is_wide() => bits,
        _ => bits & 0xffff_ffff,
    }
}

/// An integer's value from its register form.
fn number(scalar: Scalar, bits: u64) -> Number {
    let Scalar::Int { width, .. } = scalar else {
        return Number { width: 32, unsigned: bits, signed: bits.cast_signed() };
    };
    let shift = 64 - width.min(64);
    Number { width, unsigned: bits << shift >> shift, signed: (bits << shift).cast_signed() >> shift }
}

/// An integer, as signed and as unsigned.
#[derive(Clone, Copy)]
struct Number {
    width: u32,
    unsigned: u64,
    signed: i64,
}

/// The value of an operation on constants: `words` are its opcode and its operands.
fn evaluate(globals: &Globals, ty: u32, words: &[u32]) -> Result<Vec<u64>> {
    let Some((opcode, operands)) = words.split_first() else {
        return malformed("there is no operation");
    };
    let Some(op) = Op::from_u32(*opcode) else {
        return malformed(format!("there is no operation {opcode}"));
    };
    let operand = |index: usize| -> Result<&Constant> {
        let id = operands.get(index).copied().unwrap_or(0);
        match globals.constants.get(&id) {
            Some(constant) => Ok(constant),
            None => malformed(format!("operand {index} isn't a constant")),
        }
    };
    match op {
        Op::CompositeExtract => {
            let whole = operand(0)?;
            let indices = operands.get(1..).unwrap_or_default();
            let (part, start) = path(globals, whole.ty, indices)?;
            let count = globals.types.scalars(part)? as usize;
            return Ok(whole.bits[start..start + count].to_vec());
        }
        Op::CompositeInsert => {
            let (object, whole) = (operand(0)?, operand(1)?);
            let indices = operands.get(2..).unwrap_or_default();
            let (part, start) = path(globals, whole.ty, indices)?;
            let count = globals.types.scalars(part)? as usize;
            if object.bits.len() != count {
                return malformed("the object doesn't fit its place");
            }
            let mut bits = whole.bits.to_vec();
            bits[start..start + count].copy_from_slice(&object.bits);
            return Ok(bits);
        }
        Op::VectorShuffle => {
            let (a, b) = (operand(0)?, operand(1)?);
            let pick = |index: &u32| {
                let both = a.bits.iter().chain(b.bits.iter());
                both.copied().nth(*index as usize).unwrap_or(0)
            };
            let indices = operands.get(2..).unwrap_or_default();
            return Ok(indices.iter().take(4).map(pick).collect());
        }
        Op::Select => {
            let (condition, a, b) = (operand(0)?, operand(1)?, operand(2)?);
            if a.bits.len() != b.bits.len() || condition.bits.is_empty() {
                return malformed("the operands differ in size");
            }
            let pick = |index: usize| {
                let condition = condition.bits[index.min(condition.bits.len() - 1)];
                if condition != 0 { a.bits[index] } else { b.bits[index] }
            };
            return Ok((0..a.bits.len()).map(pick).collect());
        }
        _ => {}
    }
    let (result, count) = globals.types.vector(ty)?;
    let first = operand(0)?;
    let (from, _) = globals.types.vector(first.ty)?;
    let second = match operands.len() {
        1 => first,
        _ => operand(1)?,
    };
    let (from_second, _) = globals.types.vector(second.ty)?;
    if first.bits.len() != count as usize || second.bits.len() != count as usize {
        return malformed("the operands differ in size");
    }
    let pairs = first.bits.iter().zip(second.bits.iter());
    pairs
        .map(|(a, b)| match (from, result) {
            (Scalar::Float { .. }, _) => float(op, from, result, *a),
            (Scalar::Bool, _) => logical(op, *a != 0, *b != 0).map(u64::from),
            _ => {
                let value = integer(op, number(from, *a), number(from_second, *b))?;
                Ok(wrap_to_width(result, value))
            }
        })
        .collect()
}

/// The part of a composite at a path of indices: its type and the number of scalars before it.
fn path(globals: &Globals, mut ty: u32, indices: &[u32]) -> Result<(u32, usize)> {
    let mut start = 0;
    for index in indices {
        let (part, before) = globals.types.part(ty, *index)?;
        ty = part;
        start += before as usize;
    }
    Ok((ty, start))
}

/// Converts a float as the shader cores do, with their own operations.
fn float(op: Op, from: Scalar, result: Scalar, bits: u64) -> Result<u64> {
    let is_half = result == Scalar::Float { width: 16 };
    let apply = |op: Ir, operand: u64| isa::evaluate(op, &[operand]);
    match (op, result) {
        (Op::QuantizeToF16, _) => Ok(quantized(bits)),
        (Op::FConvert, Scalar::Float { .. }) => Ok(match (from.is_wide(), result.is_wide()) {
            (true, true) => bits,
            (false, true) => apply(Ir::FToF64, bits),
            (true, false) if is_half => apply(Ir::RoundToF16, rounded_to_odd(bits)),
            (true, false) => apply(Ir::F64ToF, bits),
            (false, false) if is_half => apply(Ir::RoundToF16, bits),
            (false, false) => bits,
        }),
        _ => unsupported(format!("Op{op:?} on constant floats")),
    }
}

/// The bits of a binary64 rounded to odd in binary32, as `elementwise::round_to_odd` computes them.
fn rounded_to_odd(bits: u64) -> u64 {
    let near = isa::evaluate(Ir::F64ToF, &[bits]);
    let (back, exact) = (f64::from_bits(isa::evaluate(Ir::FToF64, &[near])), f64::from_bits(bits));
    if back == exact || exact.is_nan() { near } else { (near - u64::from(exact.abs() < back.abs())) | 1 }
}

/// The bits of a binary32 rounded to binary16, with denormals flushed to zero of the same sign, as
/// `elementwise::quantize` computes them.
fn quantized(bits: u64) -> u64 {
    let rounded = isa::evaluate(Ir::RoundToF16, &[bits]);
    let is_denormal = f32::from_bits(rounded as u32).abs() < f16::MIN_POSITIVE.to_f32_const();
    if is_denormal { rounded & 0x8000_0000 } else { rounded }
}

fn logical(op: Op, a: bool, b: bool) -> Result<bool> {
    Ok(match op {
        Op::LogicalOr => a || b,
        Op::LogicalAnd => a && b,
        Op::LogicalNot => !a,
        Op::LogicalEqual => a == b,
        Op::LogicalNotEqual => a != b,
        _ => return unsupported(format!("Op{op:?} on constant booleans")),
    })
}

fn integer(op: Op, a: Number, b: Number) -> Result<u64> {
    let (ua, ub, sa, sb) = (a.unsigned, b.unsigned, a.signed, b.signed);
    // Shifting by the width or more isn't defined; it is taken modulo the width, as the device does.
    let shift = (ub % u64::from(a.width)) as u32;
    let signed = |value: i64| value.cast_unsigned();
    Ok(match op {
        Op::SConvert => signed(sa),
        Op::UConvert => ua,
        Op::SNegate => signed(sa.wrapping_neg()),
        Op::Not => !ua,
        Op::IAdd => ua.wrapping_add(ub),
        Op::ISub => ua.wrapping_sub(ub),
        Op::IMul => ua.wrapping_mul(ub),
        Op::UDiv => ua.checked_div(ub).unwrap_or(u64::MAX),
        Op::SDiv if sb == 0 => u64::MAX,
        Op::SDiv => signed(sa.wrapping_div(sb)),
        Op::UMod => ua.checked_rem(ub).unwrap_or(ua),
        Op::SRem | Op::SMod if sb == 0 => ua,
        Op::SRem => signed(sa.wrapping_rem(sb)),
        Op::SMod => {
            let remainder = sa.wrapping_rem(sb);
            let differs = remainder != 0 && (remainder < 0) != (sb < 0);
            signed(if differs { remainder.wrapping_add(sb) } else { remainder })
        }
        Op::ShiftRightLogical => ua >> shift,
        Op::ShiftRightArithmetic => signed(sa >> shift),
        Op::ShiftLeftLogical => ua << shift,
        Op::BitwiseOr => ua | ub,
        Op::BitwiseXor => ua ^ ub,
        Op::BitwiseAnd => ua & ub,
        Op::IEqual => u64::from(ua == ub),
        Op::INotEqual => u64::from(ua != ub),
        Op::ULessThan => u64::from(ua < ub),
        Op::SLessThan => u64::from(sa < sb),
        Op::UGreaterThan => u64::from(ua > ub),
        Op::SGreaterThan => u64::from(sa > sb),
        Op::ULessThanEqual => u64::from(ua <= ub),
        Op::SLessThanEqual => u64::from(sa <= sb),
        Op::UGreaterThanEqual => u64::from(ua >= ub),
        Op::SGreaterThanEqual => u64::from(sa >= sb),
        _ => return unsupported(format!("Op{op:?} on constants")),
    })
}
