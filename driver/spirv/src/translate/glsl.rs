//! The extended instructions of GLSL.std.450.

use isa::ir::{Axis, Reg};
use isa::op::Op as Ir;
use spirv::GlslStd450Op as G;

use super::super::error::{Result, malformed, unsupported};
use super::super::instruction::Instruction;
use super::super::interface::Sampling;
use super::super::types::Scalar;
use super::Translator;
use super::arithmetic::op_for_width;

/// Offsets of the samples from the pixel's centre, in 1/16 pixel: the standard positions of 1, 2, 4, 8 and 16 samples.
fn sample_offsets(samples: u32) -> &'static [[i8; 2]] {
    match samples {
        2 => &[[4, 4], [-4, -4]],
        4 => &[[-2, -6], [6, -2], [-6, 2], [2, 6]],
        8 => &[
            [1, -3],
            [-1, 3],
            [5, 1],
            [-3, -5],
            [-5, 5],
            [-7, -1],
            [3, 7],
            [7, -7],
        ],
        16 => &[
            [1, 1],
            [-1, -3],
            [-3, 2],
            [4, -1],
            [-5, -2],
            [2, 5],
            [5, 3],
            [3, -5],
            [-2, 6],
            [0, -7],
            [-4, -6],
            [-6, 4],
            [-8, 0],
            [7, -4],
            [6, 7],
            [-7, -8],
        ],
        _ => &[[0, 0]],
    }
}

impl Translator<'_> {
    /// `OpExtInst` of GLSL.std.450.
    pub fn glsl(&mut self, it: &Instruction) -> Result<()> {
        let Some(op) = G::from_u32(it.number(1)?) else {
            return malformed(format!("GLSL.std.450 has no instruction {}", it.number(1)?));
        };
        let result = self.glsl_elementwise(it, op)?;
        match result {
            Some(regs) => self.define(it, regs),
            None => self.glsl_other(it, op),
        }
    }

    /// The operands of an extended instruction: scalar type of the first, and each one's registers, all of one size.
    fn operands(&mut self, it: &Instruction, count: usize) -> Result<(Scalar, Vec<Vec<Reg>>)> {
        let mut scalar = None;
        let mut all: Vec<Vec<Reg>> = Vec::with_capacity(count);
        for index in 0..count {
            let (this, regs) = self.vector(it.id(2 + index)?)?;
            scalar.get_or_insert(this);
            if all.first().is_some_and(|first| first.len() != regs.len()) {
                return malformed("the operands differ in size");
            }
            all.push(regs.to_vec());
        }
        match scalar {
            Some(scalar) => Ok((scalar, all)),
            None => malformed("there are no operands"),
        }
    }

    /// Applies a function to each component of its operands.
    fn each(
        &mut self,
        it: &Instruction,
        count: usize,
        mut function: impl FnMut(&mut Self, Scalar, &[Reg]) -> Reg,
    ) -> Result<Option<Vec<Reg>>> {
        let (scalar, operands) = self.operands(it, count)?;
        let regs = (0..operands[0].len())
            .map(|component| {
                let src: Vec<Reg> = operands.iter().map(|regs| regs[component]).collect();
                let reg = function(self, scalar, &src);
                self.wrap_to_width(scalar, reg)
            })
            .collect();
        Ok(Some(regs))
    }

    /// Functions that work component by component; None for the others.
    fn glsl_elementwise(&mut self, it: &Instruction, op: G) -> Result<Option<Vec<Reg>>> {
        let mut simple = |narrow: Ir, wide: Ir| {
            let count = narrow.signature().operands.len();
            self.each(it, count, |this, scalar, src| {
                this.op(op_for_width(scalar, narrow, wide), src)
            })
        };
        match op {
            G::Round | G::RoundEven => simple(Ir::FRoundEven, Ir::FRoundEven64),
            G::Trunc => simple(Ir::FTrunc, Ir::FTrunc64),
            G::FAbs => simple(Ir::FAbs, Ir::FAbs64),
            G::FSign => simple(Ir::FSign, Ir::FSign64),
            G::Floor => simple(Ir::FFloor, Ir::FFloor64),
            G::Ceil => simple(Ir::FCeil, Ir::FCeil64),
            G::Fract => simple(Ir::FFract, Ir::FFract64),
            G::Sqrt => simple(Ir::FSqrt, Ir::FSqrt64),
            G::FMin | G::NMin => simple(Ir::FMin, Ir::FMin64),
            G::FMax | G::NMax => simple(Ir::FMax, Ir::FMax64),
            G::Fma => simple(Ir::FFma, Ir::FFma64),
            G::Sin => simple(Ir::FSin, Ir::FSin),
            G::Cos => simple(Ir::FCos, Ir::FCos),
            G::Tan => simple(Ir::FTan, Ir::FTan),
            G::Asin => simple(Ir::FAsin, Ir::FAsin),
            G::Acos => simple(Ir::FAcos, Ir::FAcos),
            G::Atan => simple(Ir::FAtan, Ir::FAtan),
            G::Atan2 => simple(Ir::FAtan2, Ir::FAtan2),
            G::Sinh => simple(Ir::FSinh, Ir::FSinh),
            G::Cosh => simple(Ir::FCosh, Ir::FCosh),
            G::Tanh => simple(Ir::FTanh, Ir::FTanh),
            G::Asinh => simple(Ir::FAsinh, Ir::FAsinh),
            G::Acosh => simple(Ir::FAcosh, Ir::FAcosh),
            G::Atanh => simple(Ir::FAtanh, Ir::FAtanh),
            G::Pow => simple(Ir::FPow, Ir::FPow),
            G::Exp => simple(Ir::FExp, Ir::FExp),
            G::Exp2 => simple(Ir::FExp2, Ir::FExp2),
            G::Log => simple(Ir::FLog, Ir::FLog),
            G::Log2 => simple(Ir::FLog2, Ir::FLog2),
            G::InverseSqrt => {
                self.each(it, 1, |this, scalar, src| this.inverse_sqrt(scalar, src[0]))
            }
            G::Radians => self.scaled(it, std::f64::consts::PI / 180.0),
            G::Degrees => self.scaled(it, 180.0 / std::f64::consts::PI),
            G::FClamp | G::NClamp => self.each(it, 3, |this, scalar, src| {
                let low = this.op(op_for_width(scalar, Ir::FMax, Ir::FMax64), &src[..2]);
                this.op(op_for_width(scalar, Ir::FMin, Ir::FMin64), &[low, src[2]])
            }),
            G::FMix => self.each(it, 3, |this, scalar, src| this.mix(scalar, src)),
            G::Step => self.each(it, 2, |this, scalar, src| {
                let below = this.op(op_for_width(scalar, Ir::FLt, Ir::FLt64), &[src[1], src[0]]);
                let (one, zero) = (this.float(scalar, 1.0), this.float(scalar, 0.0));
                this.select(below, zero, one)
            }),
            G::SmoothStep => self.each(it, 3, |this, scalar, src| this.smooth_step(scalar, src)),
            _ => self.glsl_integers(it, op),
        }
    }

    fn glsl_integers(&mut self, it: &Instruction, op: G) -> Result<Option<Vec<Reg>>> {
        let (narrow, wide, signed) = match op {
            G::SAbs => (Ir::SAbs, Ir::SAbs64, true),
            G::SSign => (Ir::SSign, Ir::SSign64, true),
            G::SMin => (Ir::SMin, Ir::SMin64, true),
            G::SMax => (Ir::SMax, Ir::SMax64, true),
            G::UMin => (Ir::UMin, Ir::UMin64, false),
            G::UMax => (Ir::UMax, Ir::UMax64, false),
            G::SClamp | G::UClamp => {
                let signed = op == G::SClamp;
                return self.each(it, 3, |this, scalar, src| {
                    let src = this.extended_as(scalar, src, signed);
                    let (max, min) = match (signed, scalar.is_wide()) {
                        (true, false) => (Ir::SMax, Ir::SMin),
                        (true, true) => (Ir::SMax64, Ir::SMin64),
                        (false, false) => (Ir::UMax, Ir::UMin),
                        (false, true) => (Ir::UMax64, Ir::UMin64),
                    };
                    let low = this.op(max, &src[..2]);
                    this.op(min, &[low, src[2]])
                });
            }
            G::FindILsb | G::FindSMsb | G::FindUMsb => {
                let find = match op {
                    G::FindILsb => Ir::FindLsb,
                    G::FindSMsb => Ir::FindSMsb,
                    _ => Ir::FindUMsb,
                };
                let (scalar, _) = self.vector(it.id(2)?)?;
                if scalar.is_wide() {
                    return unsupported("this on 64-bit integers");
                }
                return self.each(it, 1, |this, scalar, src| {
                    let src = this.extended_as(scalar, src, op == G::FindSMsb);
                    this.op(find, &src)
                });
            }
            _ => return Ok(None),
        };
        let count = narrow.signature().operands.len();
        self.each(it, count, |this, scalar, src| {
            let src = this.extended_as(scalar, src, signed);
            this.op(op_for_width(scalar, narrow, wide), &src)
        })
    }

    fn extended_as(&mut self, scalar: Scalar, src: &[Reg], signed: bool) -> Vec<Reg> {
        src.iter()
            .map(|reg| match signed {
                true => self.sign_extend(scalar, *reg),
                false => self.zero_extend(scalar, *reg),
            })
            .collect()
    }

    /// A float constant.
    fn float(&mut self, scalar: Scalar, value: f64) -> Reg {
        if scalar.is_wide() {
            self.f64(value)
        } else {
            self.f32(value as f32)
        }
    }

    fn inverse_sqrt(&mut self, scalar: Scalar, reg: Reg) -> Reg {
        if scalar.is_wide() {
            let (one, root) = (self.f64(1.0), self.op(Ir::FSqrt64, &[reg]));
            self.op(Ir::FDiv64, &[one, root])
        } else {
            self.op(Ir::FInverseSqrt, &[reg])
        }
    }

    fn scaled(&mut self, it: &Instruction, factor: f64) -> Result<Option<Vec<Reg>>> {
        self.each(it, 1, |this, scalar, src| {
            let factor = this.float(scalar, factor);
            this.mul(scalar, src[0], factor)
        })
    }

    /// `x (1 - a) + y a`, exact at both ends.
    fn mix(&mut self, scalar: Scalar, src: &[Reg]) -> Reg {
        let one = self.float(scalar, 1.0);
        let rest = self.minus(scalar, one, src[2]);
        let near = self.mul(scalar, src[0], rest);
        self.op(
            op_for_width(scalar, Ir::FFma, Ir::FFma64),
            &[src[1], src[2], near],
        )
    }

    fn smooth_step(&mut self, scalar: Scalar, src: &[Reg]) -> Reg {
        let (zero, one) = (self.float(scalar, 0.0), self.float(scalar, 1.0));
        let (two, three) = (self.float(scalar, 2.0), self.float(scalar, 3.0));
        let (top, span) = (
            self.minus(scalar, src[2], src[0]),
            self.minus(scalar, src[1], src[0]),
        );
        let t = self.over(scalar, top, span);
        let t = self.op(op_for_width(scalar, Ir::FMax, Ir::FMax64), &[t, zero]);
        let t = self.op(op_for_width(scalar, Ir::FMin, Ir::FMin64), &[t, one]);
        let twice = self.mul(scalar, two, t);
        let slope = self.minus(scalar, three, twice);
        let square = self.mul(scalar, t, t);
        self.mul(scalar, square, slope)
    }

    /// Functions that don't work component by component.
    fn glsl_other(&mut self, it: &Instruction, op: G) -> Result<()> {
        match op {
            G::Modf | G::ModfStruct | G::Frexp | G::FrexpStruct => self.split_float(it, op),
            G::Ldexp => {
                let (scalar, a) = self.vector(it.id(2)?)?;
                let (exponent, b) = self.vector(it.id(3)?)?;
                if a.len() != b.len() || exponent.is_wide() {
                    return malformed("the operands don't fit each other");
                }
                let mut regs = Vec::with_capacity(a.len());
                for (a, b) in a.iter().zip(b.iter()) {
                    let b = self.sign_extend(exponent, *b);
                    let reg = self.op(op_for_width(scalar, Ir::FLdexp, Ir::FLdexp64), &[*a, b]);
                    regs.push(self.wrap_to_width(scalar, reg));
                }
                self.define(it, regs)
            }
            G::Determinant | G::MatrixInverse => {
                let ty = self.type_of(it.id(2)?)?;
                let (_, _, _, scalar) = self.globals.types.matrix(ty)?;
                let matrix = self.matrix(it.id(2)?)?;
                let regs = match op {
                    G::Determinant => vec![self.determinant(scalar, &matrix)?],
                    _ => self.inverse(scalar, &matrix)?,
                };
                self.define(it, regs)
            }
            G::Length
            | G::Distance
            | G::Normalize
            | G::Cross
            | G::FaceForward
            | G::Reflect
            | G::Refract => self.geometric(it, op),
            G::PackSnorm4x8
            | G::PackUnorm4x8
            | G::PackSnorm2x16
            | G::PackUnorm2x16
            | G::PackHalf2x16
            | G::PackDouble2x32 => self.pack(it, op),
            G::UnpackSnorm4x8
            | G::UnpackUnorm4x8
            | G::UnpackSnorm2x16
            | G::UnpackUnorm2x16
            | G::UnpackHalf2x16
            | G::UnpackDouble2x32 => self.unpack(it, op),
            G::InterpolateAtCentroid | G::InterpolateAtSample | G::InterpolateAtOffset => {
                self.interpolate(it, op)
            }
            other => unsupported(format!("GLSL.std.450 {other:?}")),
        }
    }

    fn split_float(&mut self, it: &Instruction, op: G) -> Result<()> {
        let (scalar, x) = self.vector(it.id(2)?)?;
        let (mut first, mut second) = (Vec::new(), Vec::new());
        for x in x.iter() {
            if matches!(op, G::Modf | G::ModfStruct) {
                let whole = self.op(op_for_width(scalar, Ir::FTrunc, Ir::FTrunc64), &[*x]);
                let fraction = self.minus(scalar, *x, whole);
                // An infinity has no fraction; zero has the sign of x.
                let infinite = self.op(op_for_width(scalar, Ir::FIsInf, Ir::FIsInf64), &[*x]);
                let zero = self.float(scalar, 0.0);
                first.push(self.select(infinite, zero, fraction));
                second.push(whole);
            } else {
                let significand =
                    op_for_width(scalar, Ir::FFrexpSignificand, Ir::FFrexpSignificand64);
                first.push(self.op(significand, &[*x]));
                second.push(self.op(
                    op_for_width(scalar, Ir::FFrexpExponent, Ir::FFrexpExponent64),
                    &[*x],
                ));
            }
        }
        if matches!(op, G::Modf | G::Frexp) {
            let pointer = self.pointer(it.id(3)?)?;
            self.store_to(&pointer, &second)?;
        } else {
            first.extend(second);
        }
        self.define(it, first)
    }

    fn length(&mut self, scalar: Scalar, x: &[Reg]) -> Result<Reg> {
        if let [one] = x {
            return Ok(self.op(op_for_width(scalar, Ir::FAbs, Ir::FAbs64), &[*one]));
        }
        let square = self.dot(scalar, x, x, true)?;
        Ok(self.op(op_for_width(scalar, Ir::FSqrt, Ir::FSqrt64), &[square]))
    }

    fn geometric(&mut self, it: &Instruction, op: G) -> Result<()> {
        let count = match op {
            G::Length | G::Normalize => 1,
            G::FaceForward => 3,
            _ => 2,
        };
        let (scalar, operands) = self.operands(it, count)?;
        let x = &operands[0];
        let regs = match op {
            G::Length => vec![self.length(scalar, x)?],
            G::Distance => {
                let pairs = x.iter().zip(&operands[1]);
                let apart: Vec<Reg> = pairs.map(|(a, b)| self.minus(scalar, *a, *b)).collect();
                vec![self.length(scalar, &apart)?]
            }
            G::Normalize => {
                let square = self.dot(scalar, x, x, true)?;
                let inverse = self.inverse_sqrt(scalar, square);
                x.iter().map(|x| self.mul(scalar, *x, inverse)).collect()
            }
            G::Cross => {
                let ([a0, a1, a2], [b0, b1, b2]) = (x.as_slice(), operands[1].as_slice()) else {
                    return malformed("the operands don't have three components");
                };
                [[a1, b2, a2, b1], [a2, b0, a0, b2], [a0, b1, a1, b0]]
                    .map(|[a, b, c, d]| {
                        let (left, right) = (self.mul(scalar, *a, *b), self.mul(scalar, *c, *d));
                        self.minus(scalar, left, right)
                    })
                    .to_vec()
            }
            G::FaceForward => {
                let along = self.dot(scalar, &operands[2], &operands[1], true)?;
                let zero = self.float(scalar, 0.0);
                let facing = self.op(op_for_width(scalar, Ir::FLt, Ir::FLt64), &[along, zero]);
                x.iter()
                    .map(|x| {
                        let away = self.op(op_for_width(scalar, Ir::FNeg, Ir::FNeg64), &[*x]);
                        self.select(facing, *x, away)
                    })
                    .collect()
            }
            G::Reflect => {
                let along = self.dot(scalar, &operands[1], x, true)?;
                let two = self.float(scalar, 2.0);
                let twice = self.mul(scalar, two, along);
                let pairs = x.iter().zip(&operands[1]);
                pairs
                    .map(|(i, n)| {
                        let back = self.mul(scalar, twice, *n);
                        self.minus(scalar, *i, back)
                    })
                    .collect()
            }
            _ => self.refract(it, scalar, x, &operands[1])?,
        };
        let regs = regs
            .into_iter()
            .map(|reg| self.wrap_to_width(scalar, reg))
            .collect();
        self.define(it, regs)
    }

    fn refract(
        &mut self,
        it: &Instruction,
        scalar: Scalar,
        i: &[Reg],
        n: &[Reg],
    ) -> Result<Vec<Reg>> {
        let eta = self.reg(it.id(4)?)?;
        let (zero, one) = (self.float(scalar, 0.0), self.float(scalar, 1.0));
        let along = self.dot(scalar, n, i, true)?;
        let (along_2, eta_2) = (self.mul(scalar, along, along), self.mul(scalar, eta, eta));
        let rest = self.minus(scalar, one, along_2);
        let rest = self.mul(scalar, eta_2, rest);
        let k = self.minus(scalar, one, rest);
        let total = self.op(op_for_width(scalar, Ir::FLt, Ir::FLt64), &[k, zero]);
        let root = self.op(op_for_width(scalar, Ir::FSqrt, Ir::FSqrt64), &[k]);
        let forward = self.mul(scalar, eta, along);
        let factor = self.plus(scalar, forward, root);
        Ok(i.iter()
            .zip(n)
            .map(|(i, n)| {
                let (bent, normal) = (self.mul(scalar, eta, *i), self.mul(scalar, factor, *n));
                let refracted = self.minus(scalar, bent, normal);
                self.select(total, zero, refracted)
            })
            .collect())
    }

    fn pack(&mut self, it: &Instruction, op: G) -> Result<()> {
        let x = self.regs(it.id(2)?)?;
        if op == G::PackDouble2x32 {
            let [low, high] = *x else {
                return malformed("the operand doesn't have two components");
            };
            let joined = self.op(Ir::Join64, &[low, high]);
            return self.define(it, vec![joined]);
        }
        let (count, bits, scale, least) = match op {
            G::PackSnorm4x8 => (4, 8, 127.0, -1.0),
            G::PackUnorm4x8 => (4, 8, 255.0, 0.0),
            G::PackSnorm2x16 => (2, 16, 32767.0, -1.0),
            G::PackUnorm2x16 => (2, 16, 65535.0, 0.0),
            _ => (2, 16, 0.0, 0.0),
        };
        if x.len() != count {
            return malformed("the operand has the wrong size");
        }
        let mut word = None;
        for (index, x) in (0..).zip(x.iter()) {
            let part = if op == G::PackHalf2x16 {
                self.op(Ir::FToF16, &[*x])
            } else {
                let (least, most, scale) = (self.f32(least), self.f32(1.0), self.f32(scale));
                let x = self.op(Ir::FMax, &[*x, least]);
                let x = self.op(Ir::FMin, &[x, most]);
                let x = self.op(Ir::FMul, &[x, scale]);
                let x = self.op(Ir::FRoundEven, &[x]);
                let x = self.op(Ir::FToS, &[x]);
                let mask = self.u32((1 << bits) - 1);
                self.op(Ir::And, &[x, mask])
            };
            let by = self.u32(bits * index);
            let placed = self.op(Ir::Shl, &[part, by]);
            word = Some(match word {
                Some(word) => self.op(Ir::Or, &[word, placed]),
                None => placed,
            });
        }
        self.define(it, word.into_iter().collect())
    }

    fn unpack(&mut self, it: &Instruction, op: G) -> Result<()> {
        let x = self.reg(it.id(2)?)?;
        if op == G::UnpackDouble2x32 {
            let halves = [Ir::Low32, Ir::High32].map(|half| self.op(half, &[x]));
            return self.define(it, halves.to_vec());
        }
        let (count, bits, scale) = match op {
            G::UnpackSnorm4x8 => (4, 8, 127.0),
            G::UnpackUnorm4x8 => (4, 8, 255.0),
            G::UnpackSnorm2x16 => (2, 16, 32767.0),
            G::UnpackUnorm2x16 => (2, 16, 65535.0),
            _ => (2, 16, 1.0),
        };
        let signed = matches!(op, G::UnpackSnorm4x8 | G::UnpackSnorm2x16);
        let mut regs = Vec::with_capacity(count as usize);
        for index in 0..count {
            let (at, width) = (self.u32(bits * index), self.u32(bits));
            let extract = if signed {
                Ir::BitfieldSExtract
            } else {
                Ir::BitfieldUExtract
            };
            let part = self.op(extract, &[x, at, width]);
            if op == G::UnpackHalf2x16 {
                regs.push(self.op(Ir::F16ToF, &[part]));
                continue;
            }
            let value = self.op(if signed { Ir::SToF } else { Ir::UToF }, &[part]);
            let scale = self.f32(scale);
            let value = self.op(Ir::FDiv, &[value, scale]);
            regs.push(if signed {
                let least = self.f32(-1.0);
                self.op(Ir::FMax, &[value, least])
            } else {
                value
            });
        }
        self.define(it, regs)
    }

    /// Interpolation elsewhere in the pixel. At a centroid it is an input of its own; at a sample or an offset it
    /// follows from the derivatives of the attribute divided by w, which are constant over the primitive.
    fn interpolate(&mut self, it: &Instruction, op: G) -> Result<()> {
        let pointer = self.pointer(it.id(2)?)?;
        if op == G::InterpolateAtCentroid {
            let regs = self.read_input(&pointer, Sampling::Centroid)?;
            return self.define(it, regs);
        }
        let regs = self.read_input(&pointer, Sampling::Center)?;
        let [dx, dy] = if op == G::InterpolateAtOffset {
            match *self.regs(it.id(3)?)? {
                [dx, dy] => [dx, dy],
                _ => return malformed("the offset doesn't have two components"),
            }
        } else {
            let sample = self.reg(it.id(3)?)?;
            self.sample_offset(sample)
        };
        if self.is_flat(&pointer) {
            return self.define(it, regs);
        }
        let linear = self.is_linear(&pointer);
        let at = |this: &mut Self, value: Reg| {
            let x = this.builder.derivative(value, Axis::X, true);
            let y = this.builder.derivative(value, Axis::Y, true);
            let moved = this.op(Ir::FFma, &[x, dx, value]);
            this.op(Ir::FFma, &[y, dy, moved])
        };
        let inverse_w = self.frag_coord(3)?;
        let moved_w = at(self, inverse_w);
        let mut moved = Vec::with_capacity(regs.len());
        for reg in regs {
            moved.push(if linear {
                at(self, reg)
            } else {
                let over_w = self.op(Ir::FMul, &[reg, inverse_w]);
                let over_w = at(self, over_w);
                self.op(Ir::FDiv, &[over_w, moved_w])
            });
        }
        self.define(it, moved)
    }

    /// The offset of a sample from the pixel's centre.
    fn sample_offset(&mut self, sample: Reg) -> [Reg; 2] {
        let offsets = sample_offsets(self.options.samples);
        [0, 1].map(|axis| {
            let offset = |index: usize| f32::from(offsets[index][axis]) / 16.0;
            let mut found = self.f32(offset(0));
            for index in 1..offsets.len() {
                let number = self.u32(index as u32);
                let this = self.op(Ir::IEq, &[sample, number]);
                let value = self.f32(offset(index));
                found = self.select(this, value, found);
            }
            found
        })
    }
}
