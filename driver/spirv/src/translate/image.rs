//! Images and samplers.

use isa::ir::{
    Binding, ImageQuery, ImageRead, ImageShape, ImageWrite, Lod, Reg, Sample, Statement, Type,
};
use isa::op::Op as Ir;
use spirv::{Dim, ImageOperands as ImageOperandMask, Op};

use super::super::error::{Result, malformed, unsupported};
use super::super::instruction::Instruction;
use super::super::interface::Stage;
use super::super::types::ImageType;
use super::access::Pointer;
use super::resource::shape;
use super::{Translator, Value};

/// The optional operands of an image instruction.
#[derive(Clone, Debug, Default)]
struct ImageOperands {
    bias: Option<Reg>,
    lod: Option<Reg>,
    gradient: Option<(Vec<Reg>, Vec<Reg>)>,
    offset: Vec<Reg>,
    /// Four offsets, one after the other.
    offsets: Vec<Reg>,
    sample: Option<Reg>,
    minimum: Option<Reg>,
}

/// What sample_op of sample an instruction takes.
struct SampleOp {
    explicit: bool,
    compare: bool,
    projective: bool,
    gather: bool,
}

fn sample_op(op: Op) -> SampleOp {
    use Op::*;
    SampleOp {
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

impl Translator<'_> {
    /// Image instructions.
    pub fn image(&mut self, it: &Instruction) -> Result<()> {
        match it.opcode {
            Op::SampledImage => {
                let (image, image_type) = self.image_operand(it.id(0)?)?;
                let Value::Sampler(sampler) = self.value(it.id(1)?)? else {
                    return malformed("the second operand isn't a sampler");
                };
                self.define_as(it, Value::SampledImage(image, image_type, sampler))
            }
            Op::Image => {
                let (image, image_type) = self.image_operand(it.id(0)?)?;
                self.define_as(it, Value::Image(image, image_type))
            }
            Op::ImageTexelPointer => self.texel_pointer(it),
            Op::ImageFetch | Op::ImageRead => self.read_image(it),
            Op::ImageWrite => self.write_image(it),
            Op::ImageQuerySizeLod
            | Op::ImageQuerySize
            | Op::ImageQueryLod
            | Op::ImageQueryLevels
            | Op::ImageQuerySamples => self.query_image(it),
            op => self.sample(it, &sample_op(op)),
        }
    }

    /// The image of an operand that is one, with or without a sampler.
    fn image_operand(&mut self, id: u32) -> Result<(Binding, ImageType)> {
        match self.value(id)? {
            Value::Image(binding, ty) | Value::SampledImage(binding, ty, _) => Ok((binding, ty)),
            _ => malformed(format!("%{id} isn't an image")),
        }
    }

    /// Reads the optional operands from a position on.
    fn image_operands(&mut self, it: &Instruction, from: usize) -> Result<ImageOperands> {
        let mut image_operands = ImageOperands::default();
        let Some(mask) = it.enumerant(from, ImageOperandMask::from_bits) else {
            return Ok(image_operands);
        };
        let mut next = from + 1;
        let mut take = |this: &mut Self| {
            next += 1;
            this.regs(it.id(next - 1)?)
        };
        let one = |regs: &[Reg]| match regs {
            [reg] => Ok(*reg),
            _ => malformed("an image operand isn't a scalar"),
        };
        let has = |operand| mask.contains(operand);
        if has(ImageOperandMask::BIAS) {
            image_operands.bias = Some(one(&take(self)?)?);
        }
        if has(ImageOperandMask::LOD) {
            image_operands.lod = Some(one(&take(self)?)?);
        }
        if has(ImageOperandMask::GRAD) {
            image_operands.gradient = Some((take(self)?.to_vec(), take(self)?.to_vec()));
        }
        if has(ImageOperandMask::CONST_OFFSET) {
            image_operands.offset = take(self)?.to_vec();
        }
        if has(ImageOperandMask::OFFSET) {
            image_operands.offset = take(self)?.to_vec();
        }
        if has(ImageOperandMask::CONST_OFFSETS) {
            image_operands.offsets = take(self)?.to_vec();
        }
        if has(ImageOperandMask::SAMPLE) {
            image_operands.sample = Some(one(&take(self)?)?);
        }
        if has(ImageOperandMask::MIN_LOD) {
            image_operands.minimum = Some(one(&take(self)?)?);
        }
        Ok(image_operands)
    }

    /// The first registers of a coordinate, as many as the shape needs.
    fn coordinate(&mut self, id: u32, count: usize) -> Result<Vec<Reg>> {
        match self.regs(id)?.get(..count) {
            Some(regs) => Ok(regs.to_vec()),
            None => malformed("the coordinate has too few components"),
        }
    }

    fn texels(&mut self, count: usize) -> [Option<Reg>; 4] {
        std::array::from_fn(|index| (index < count).then(|| self.builder.value(Type::B32)))
    }

    /// Defines the result of a read or sample, rounded if its type is.
    fn define_texel(&mut self, it: &Instruction, regs: impl Iterator<Item = Reg>) -> Result<()> {
        let (scalar, count) = self.globals.types.vector(it.ty()?)?;
        let regs = regs
            .take(count as usize)
            .map(|reg| self.wrap_to_width(scalar, reg));
        let regs = regs.collect();
        self.define(it, regs)
    }

    fn sample(&mut self, it: &Instruction, sample_op: &SampleOp) -> Result<()> {
        let Value::SampledImage(image, image_type, sampler) = self.value(it.id(0)?)? else {
            return malformed("the first operand isn't a sampled image");
        };
        let shape = shape(&image_type)?;
        let count = shape.coordinates();
        let mut coordinate =
            self.coordinate(it.id(1)?, count + usize::from(sample_op.projective))?;
        let mut compare = None;
        let mut component = 0;
        let mut next = 2;
        if sample_op.compare {
            compare = Some(self.reg(it.id(next)?)?);
            next += 1;
        } else if sample_op.gather {
            component = self.literal(it.id(next)?)?;
            next += 1;
        }
        let image_operands = self.image_operands(it, next)?;
        if sample_op.projective
            && let Some(divisor) = coordinate.pop()
        {
            for reg in coordinate.iter_mut().chain(&mut compare) {
                *reg = self.op(Ir::FDiv, &[*reg, divisor]);
            }
        }
        let lod = self.lod(sample_op, &image_operands, shape)?;
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
            // With four offsets, each result is the last texel of a gather of its own.
            let mut regs = Vec::with_capacity(4);
            for offset in image_operands.offsets.chunks_exact(2).take(4) {
                let dst = self.builder.value(Type::B32);
                self.builder
                    .statement(make([None, None, None, Some(dst)], offset.to_vec()));
                regs.push(dst);
            }
            return self.define_texel(it, regs.into_iter());
        }
        let offset = image_operands
            .offset
            .get(..axes)
            .unwrap_or_default()
            .to_vec();
        let dst = self.texels(if sample_op.compare && !sample_op.gather {
            1
        } else {
            4
        });
        self.builder.statement(make(dst, offset));
        self.define_texel(it, dst.into_iter().flatten())
    }

    fn lod(
        &mut self,
        sample_op: &SampleOp,
        image_operands: &ImageOperands,
        shape: ImageShape,
    ) -> Result<Lod> {
        let axes = shape.dimension.coordinates();
        if let Some((dx, dy)) = &image_operands.gradient {
            let (Some(dx), Some(dy)) = (dx.get(..axes), dy.get(..axes)) else {
                return malformed("the gradient has too few components");
            };
            return Ok(Lod::Gradient {
                dx: dx.to_vec(),
                dy: dy.to_vec(),
                minimum: image_operands.minimum,
            });
        }
        if sample_op.explicit {
            return match image_operands.lod {
                Some(lod) => Ok(Lod::Explicit(lod)),
                None => malformed("there is no level of detail"),
            };
        }
        if sample_op.gather || self.interface.stage != Stage::Fragment {
            // Without quads there are no derivatives.
            let level = image_operands.bias.filter(|_| !sample_op.gather);
            let zero = self.f32(0.0);
            return Ok(Lod::Explicit(level.unwrap_or(zero)));
        }
        Ok(Lod::Implicit {
            bias: image_operands.bias,
            minimum: image_operands.minimum,
        })
    }

    fn read_image(&mut self, it: &Instruction) -> Result<()> {
        let (image, image_type) = self.image_operand(it.id(0)?)?;
        let shape = shape(&image_type)?;
        let mut coordinate = self.coordinate(it.id(1)?, shape.coordinates())?;
        if image_type.dim == Dim::DimSubpassData {
            coordinate = self.pixel(&coordinate)?;
        }
        let image_operands = self.image_operands(it, 2)?;
        if let Some(offset) = image_operands.offset.get(..shape.dimension.coordinates()) {
            for (reg, offset) in coordinate.iter_mut().zip(offset) {
                *reg = self.op(Ir::IAdd, &[*reg, *offset]);
            }
        }
        let dst = self.texels(4);
        self.builder
            .statement(Statement::ImageRead(Box::new(ImageRead {
                dst,
                image,
                shape,
                coordinate,
                level: image_operands.lod,
                sample: image_operands.sample,
            })));
        self.define_texel(it, dst.into_iter().flatten())
    }

    /// The pixel being shaded, moved by an offset: where an input attachment is read.
    fn pixel(&mut self, offset: &[Reg]) -> Result<Vec<Reg>> {
        let mut coordinate = Vec::with_capacity(offset.len());
        for (axis, offset) in (0..2).zip(offset) {
            let position = self.frag_coord(axis)?;
            let pixel = self.op(Ir::FToS, &[position]);
            coordinate.push(self.op(Ir::IAdd, &[pixel, *offset]));
        }
        coordinate.extend_from_slice(offset.get(2..).unwrap_or_default());
        Ok(coordinate)
    }

    fn write_image(&mut self, it: &Instruction) -> Result<()> {
        let (image, image_type) = self.image_operand(it.id(0)?)?;
        let shape = shape(&image_type)?;
        let coordinate = self.coordinate(it.id(1)?, shape.coordinates())?;
        let (scalar, regs) = self.vector(it.id(2)?)?;
        if scalar.is_wide() {
            return unsupported("texels of 64-bit components");
        }
        let zero = self.u32(0);
        let image_operands = self.image_operands(it, 3)?;
        self.note_binding_write(image);
        self.builder
            .statement(Statement::ImageWrite(Box::new(ImageWrite {
                image,
                shape,
                coordinate,
                sample: image_operands.sample,
                texel: std::array::from_fn(|index| regs.get(index).copied().unwrap_or(zero)),
            })));
        Ok(())
    }

    fn texel_pointer(&mut self, it: &Instruction) -> Result<()> {
        let Pointer::Resource { binding, ty, .. } = self.pointer(it.id(0)?)? else {
            return malformed("the first operand isn't a pointer to an image");
        };
        let image_type = match self.globals.types.get(ty)? {
            super::super::types::Type::Image(image_type) => *image_type,
            _ => return malformed("the first operand isn't a pointer to an image"),
        };
        let coordinate = self.coordinate(it.id(1)?, shape(&image_type)?.coordinates())?;
        let sample = self.reg(it.id(2)?)?;
        let pointer = Pointer::Texel {
            image: binding,
            image_type,
            coordinate,
            sample,
        };
        self.define_as(it, Value::Pointer(pointer.into()))
    }

    fn query_image(&mut self, it: &Instruction) -> Result<()> {
        let (image, image_type) = self.image_operand(it.id(0)?)?;
        let shape = shape(&image_type)?;
        let query = match it.opcode {
            Op::ImageQuerySizeLod => ImageQuery::Size {
                level: Some(self.reg(it.id(1)?)?),
            },
            Op::ImageQuerySize => ImageQuery::Size { level: None },
            Op::ImageQueryLevels => ImageQuery::Levels,
            Op::ImageQuerySamples => ImageQuery::Samples,
            _ => match self.value(it.id(0)?)? {
                Value::SampledImage(_, _, sampler) => ImageQuery::Lod {
                    sampler,
                    coordinate: self.coordinate(it.id(1)?, shape.dimension.coordinates())?,
                },
                _ => return malformed("the first operand isn't a sampled image"),
            },
        };
        let (_, count) = self.globals.types.vector(it.ty()?)?;
        let dst: Vec<Reg> = (0..count).map(|_| self.builder.value(Type::B32)).collect();
        let is_size = matches!(query, ImageQuery::Size { .. });
        self.builder.statement(Statement::ImageQuery {
            dst: dst.clone(),
            image,
            shape,
            query,
        });
        let mut regs = dst;
        // A storage cube is an array of faces to the device.
        if is_size
            && image_type.dim == Dim::DimCube
            && image_type.sampled == 2
            && let Some(layers) = regs.get_mut(2)
        {
            let six = self.u32(6);
            *layers = self.op(Ir::UDiv, &[*layers, six]);
        }
        self.define(it, regs)
    }
}
