//! Images and samplers.

use isa::ir::Type as IrType;
use isa::ir::{Binding, ImageQuery, ImageRead, ImageShape, ImageWrite, Lod, Reg, Sample, Statement};
use isa::op::Op as Ir;
use spirv::ImageOperands as ImageOperandMask;
use spirv::{Dim, Op};

use super::descriptors::mark_binding_written;
use super::translator::Translator;
use super::value::{Pointer, Value};
use crate::error::{Result, malformed, unsupported};
use crate::instruction::Instruction;
use crate::interface::Stage;
use crate::types::{ImageType, Type};

/// The optional operands of an image instruction.
#[derive(Clone, Debug, Default)]
struct ImageOperands {
    bias: Option<Reg>,
    lod: Option<Reg>,
    gradient: Option<(Vec<Reg>, Vec<Reg>)>,
    offset: Vec<Reg>,
    /// Four offsets, in order.
    offsets: Vec<Reg>,
    sample: Option<Reg>,
    minimum: Option<Reg>,
}

/// The kind of sample that an instruction takes.
struct SampleOp {
    explicit: bool,
    compare: bool,
    projective: bool,
    gather: bool,
}

impl SampleOp {
    fn of(op: Op) -> Self {
        use Op::*;
        Self {
            explicit: matches!(
                op,
                ImageSampleExplicitLod
                    | ImageSampleDrefExplicitLod
                    | ImageSampleProjExplicitLod
                    | ImageSampleProjDrefExplicitLod
            ),
            compare: matches!(
                op,
                ImageSampleDrefImplicitLod
                    | ImageSampleDrefExplicitLod
                    | ImageSampleProjDrefImplicitLod
                    | ImageSampleProjDrefExplicitLod
                    | ImageDrefGather
            ),
            projective: matches!(
                op,
                ImageSampleProjImplicitLod
                    | ImageSampleProjExplicitLod
                    | ImageSampleProjDrefImplicitLod
                    | ImageSampleProjDrefExplicitLod
            ),
            gather: matches!(op, ImageGather | ImageDrefGather),
        }
    }
}

/// Translates image instructions.
pub fn image(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    match instruction.opcode {
        Op::SampledImage => {
            let (image, image_type) = image_operand(t, instruction.id(0)?)?;
            let Value::Sampler(sampler) = t.value(instruction.id(1)?)? else {
                return malformed("the second operand isn't a sampler");
            };
            t.define_as(instruction, Value::SampledImage(image, image_type, sampler))
        }
        Op::Image => {
            let (image, image_type) = image_operand(t, instruction.id(0)?)?;
            t.define_as(instruction, Value::Image(image, image_type))
        }
        Op::ImageTexelPointer => texel_pointer(t, instruction),
        Op::ImageFetch | Op::ImageRead => read_image(t, instruction),
        Op::ImageWrite => write_image(t, instruction),
        Op::ImageQuerySizeLod
        | Op::ImageQuerySize
        | Op::ImageQueryLod
        | Op::ImageQueryLevels
        | Op::ImageQuerySamples => query_image(t, instruction),
        op => sample(t, instruction, &SampleOp::of(op)),
    }
}

/// The image of an operand that is an image, with or without a sampler.
fn image_operand(t: &mut Translator, id: u32) -> Result<(Binding, ImageType)> {
    match t.value(id)? {
        Value::Image(binding, ty) | Value::SampledImage(binding, ty, _) => Ok((binding, ty)),
        _ => malformed(format!("%{id} isn't an image")),
    }
}

/// Reads the optional operands from a position on.
fn image_operands(t: &mut Translator, instruction: &Instruction, from: usize) -> Result<ImageOperands> {
    let mut image_operands = ImageOperands::default();
    let Some(mask) = instruction.enumerant(from, ImageOperandMask::from_bits) else {
        return Ok(image_operands);
    };
    let mut next = from + 1;
    let mut take = |t: &mut Translator| {
        next += 1;
        t.regs(instruction.id(next - 1)?)
    };
    let one = |regs: &[Reg]| match regs {
        [reg] => Ok(*reg),
        _ => malformed("an image operand isn't a scalar"),
    };
    let has = |operand| mask.contains(operand);
    if has(ImageOperandMask::BIAS) {
        image_operands.bias = Some(one(&take(t)?)?);
    }
    if has(ImageOperandMask::LOD) {
        image_operands.lod = Some(one(&take(t)?)?);
    }
    if has(ImageOperandMask::GRAD) {
        image_operands.gradient = Some((take(t)?.to_vec(), take(t)?.to_vec()));
    }
    if has(ImageOperandMask::CONST_OFFSET) {
        image_operands.offset = take(t)?.to_vec();
    }
    if has(ImageOperandMask::OFFSET) {
        image_operands.offset = take(t)?.to_vec();
    }
    if has(ImageOperandMask::CONST_OFFSETS) {
        image_operands.offsets = take(t)?.to_vec();
    }
    if has(ImageOperandMask::SAMPLE) {
        image_operands.sample = Some(one(&take(t)?)?);
    }
    if has(ImageOperandMask::MIN_LOD) {
        image_operands.minimum = Some(one(&take(t)?)?);
    }
    Ok(image_operands)
}

/// The first registers of a coordinate, the number that the shape needs.
fn coordinate(t: &mut Translator, id: u32, count: usize) -> Result<Vec<Reg>> {
    match t.regs(id)?.get(..count) {
        Some(regs) => Ok(regs.to_vec()),
        None => malformed("the coordinate has too few components"),
    }
}

fn texels(t: &mut Translator, count: usize) -> [Option<Reg>; 4] {
    std::array::from_fn(|index| (index < count).then(|| t.emit.builder.value(IrType::B32)))
}

/// Defines the result of a read or sample, rounded if its type requires it.
fn define_texel(t: &mut Translator, instruction: &Instruction, regs: impl Iterator<Item = Reg>) -> Result<()> {
    let (scalar, count) = t.globals.types.vector(instruction.ty()?)?;
    let regs = regs.take(count as usize).map(|reg| t.emit.wrap_to_width(scalar, reg));
    let regs = regs.collect();
    t.define(instruction, regs)
}

fn sample(t: &mut Translator, instruction: &Instruction, sample_op: &SampleOp) -> Result<()> {
    let Value::SampledImage(image, image_type, sampler) = t.value(instruction.id(0)?)? else {
        return malformed("the first operand isn't a sampled image");
    };
    let shape = image_type.shape()?;
    let count = shape.coordinates();
    let mut coordinate = coordinate(t, instruction.id(1)?, count + usize::from(sample_op.projective))?;
    let mut compare = None;
    let mut component = 0;
    let mut next = 2;
    if sample_op.compare {
        compare = Some(t.reg(instruction.id(next)?)?);
        next += 1;
    } else if sample_op.gather {
        component = t.literal(instruction.id(next)?)?;
        next += 1;
    }
    let image_operands = image_operands(t, instruction, next)?;
    if sample_op.projective
        && let Some(divisor) = coordinate.pop()
    {
        for reg in coordinate.iter_mut().chain(&mut compare) {
            *reg = t.emit.op(Ir::FDiv, &[*reg, divisor]);
        }
    }
    let lod = lod(t, sample_op, &image_operands, shape)?;
    let gather = match u8::try_from(component) {
        Ok(component @ 0..4) => sample_op.gather.then_some(component),
        _ => return malformed("there is no such component"),
    };
    let axes = shape.dimension.coordinates();
    let make = |dst, offset| {
        Statement::Sample(Box::new(Sample {
            dst,
            image,
            sampler,
            shape,
            coordinate: coordinate.clone(),
            lod: lod.clone(),
            offset,
            compare,
            gather,
        }))
    };
    if sample_op.gather && !image_operands.offsets.is_empty() {
        // With four offsets, each result is the last texel of a separate gather.
        let mut regs = Vec::with_capacity(4);
        for offset in image_operands.offsets.chunks_exact(2).take(4) {
            let dst = t.emit.builder.value(IrType::B32);
            t.emit.builder.statement(make([None, None, None, Some(dst)], offset.to_vec()));
            regs.push(dst);
        }
        return define_texel(t, instruction, regs.into_iter());
    }
    let offset = image_operands.offset.get(..axes).unwrap_or_default().to_vec();
    let dst = texels(t, if sample_op.compare && !sample_op.gather { 1 } else { 4 });
    t.emit.builder.statement(make(dst, offset));
    define_texel(t, instruction, dst.into_iter().flatten())
}

fn lod(t: &mut Translator, sample_op: &SampleOp, image_operands: &ImageOperands, shape: ImageShape) -> Result<Lod> {
    let axes = shape.dimension.coordinates();
    if let Some((dx, dy)) = &image_operands.gradient {
        let (Some(dx), Some(dy)) = (dx.get(..axes), dy.get(..axes)) else {
            return malformed("the gradient has too few components");
        };
        return Ok(Lod::Gradient { dx: dx.to_vec(), dy: dy.to_vec(), minimum: image_operands.minimum });
    }
    if sample_op.explicit {
        return match image_operands.lod {
            Some(lod) => Ok(Lod::Explicit(lod)),
            None => malformed("there is no level of detail"),
        };
    }
    if sample_op.gather || t.interface.stage != Stage::Fragment {
        // Without quads there are no derivatives.
        let level = image_operands.bias.filter(|_| !sample_op.gather);
        let zero = t.emit.f32(0.0);
        return Ok(Lod::Explicit(level.unwrap_or(zero)));
    }
    Ok(Lod::Implicit { bias: image_operands.bias, minimum: image_operands.minimum })
}

fn read_image(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let (image, image_type) = image_operand(t, instruction.id(0)?)?;
    let shape = image_type.shape()?;
    let is_input = image_type.dim == Dim::DimSubpassData;
    let count = if is_input { 2 } else { shape.coordinates() };
    let mut coordinate = coordinate(t, instruction.id(1)?, count)?;
    if is_input {
        coordinate = pixel(t, &coordinate)?;
    }
    let image_operands = image_operands(t, instruction, 2)?;
    if let Some(offset) = image_operands.offset.get(..shape.dimension.coordinates()) {
        for (reg, offset) in coordinate.iter_mut().zip(offset) {
            *reg = t.emit.op(Ir::IAdd, &[*reg, *offset]);
        }
    }
    let dst = texels(t, 4);
    t.emit.builder.statement(Statement::ImageRead(Box::new(ImageRead {
        dst,
        image,
        shape,
        coordinate,
        level: image_operands.lod,
        sample: image_operands.sample,
    })));
    define_texel(t, instruction, dst.into_iter().flatten())
}

/// The position at which an input attachment is read: the current pixel plus an offset, and its layer.
fn pixel(t: &mut Translator, offset: &[Reg]) -> Result<Vec<Reg>> {
    let mut coordinate = Vec::with_capacity(3);
    for (axis, offset) in (0..2).zip(offset) {
        let position = t.io.frag_coord(&mut t.emit, axis)?;
        let pixel = t.emit.op(Ir::FToS, &[position]);
        coordinate.push(t.emit.op(Ir::IAdd, &[pixel, *offset]));
    }
    coordinate.push(t.io.layer(&mut t.emit));
    Ok(coordinate)
}

fn write_image(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let (image, image_type) = image_operand(t, instruction.id(0)?)?;
    let shape = image_type.shape()?;
    let coordinate = coordinate(t, instruction.id(1)?, shape.coordinates())?;
    let (scalar, regs) = t.vector(instruction.id(2)?)?;
    if scalar.is_wide() {
        return unsupported("texels of 64-bit components");
    }
    let zero = t.emit.u32(0);
    let image_operands = image_operands(t, instruction, 3)?;
    mark_binding_written(t, image);
    t.emit.builder.statement(Statement::ImageWrite(Box::new(ImageWrite {
        image,
        shape,
        coordinate,
        sample: image_operands.sample,
        texel: std::array::from_fn(|index| regs.get(index).copied().unwrap_or(zero)),
    })));
    Ok(())
}

fn texel_pointer(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let Pointer::Resource { binding, ty, .. } = t.pointer(instruction.id(0)?)? else {
        return malformed("the first operand isn't a pointer to an image");
    };
    let image_type = match t.globals.types.get(ty)? {
        Type::Image(image_type) => *image_type,
        _ => return malformed("the first operand isn't a pointer to an image"),
    };
    let coordinate = coordinate(t, instruction.id(1)?, image_type.shape()?.coordinates())?;
    let sample = t.reg(instruction.id(2)?)?;
    let pointer = Pointer::Texel { image: binding, image_type, coordinate, sample };
    t.define_as(instruction, Value::Pointer(pointer.into()))
}

fn query_image(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let (image, image_type) = image_operand(t, instruction.id(0)?)?;
    let shape = image_type.shape()?;
    let query = match instruction.opcode {
        Op::ImageQuerySizeLod => ImageQuery::Size { level: Some(t.reg(instruction.id(1)?)?) },
        Op::ImageQuerySize => ImageQuery::Size { level: None },
        Op::ImageQueryLevels => ImageQuery::Levels,
        Op::ImageQuerySamples => ImageQuery::Samples,
        _ => match t.value(instruction.id(0)?)? {
            Value::SampledImage(_, _, sampler) => ImageQuery::Lod {
                sampler,
                coordinate: coordinate(t, instruction.id(1)?, shape.dimension.coordinates())?,
            },
            _ => return malformed("the first operand isn't a sampled image"),
        },
    };
    let (_, count) = t.globals.types.vector(instruction.ty()?)?;
    let dst: Vec<Reg> = (0..count).map(|_| t.emit.builder.value(IrType::B32)).collect();
    let is_size = matches!(query, ImageQuery::Size { .. });
    t.emit.builder.statement(Statement::ImageQuery { dst: dst.clone(), image, shape, query });
    let mut regs = dst;
    // The device treats a storage cube as an array of faces.
    if is_size
        && image_type.dim == Dim::DimCube
        && image_type.sampled == 2
        && let Some(layers) = regs.get_mut(2)
    {
        let six = t.emit.u32(6);
        *layers = t.emit.op(Ir::UDiv, &[*layers, six]);
    }
    t.define(instruction, regs)
}
