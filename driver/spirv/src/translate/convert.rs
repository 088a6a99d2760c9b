//! Conversions between types.

use isa::ir::Reg;
use isa::op::Op as Ir;
use spirv::Op;

use super::super::error::{Result, malformed, unsupported};
use super::super::instruction::Instruction;
use super::super::types::Scalar;
use super::Translator;

impl Translator<'_> {
    /// Conversions, `OpBitcast`, and between addresses and integers.
    pub fn conversion(&mut self, it: &Instruction) -> Result<()> {
        let opcode = it.opcode;
        if matches!(opcode, Op::Bitcast | Op::ConvertPtrToU | Op::ConvertUToPtr) {
            return self.bitcast(it);
        }
        let (to, _) = self.globals.types.vector(it.ty()?)?;
        let (from, regs) = self.vector(it.id(0)?)?;
        let regs = regs
            .iter()
            .map(|reg| self.convert(opcode, from, to, *reg))
            .collect::<Result<_>>()?;
        self.define(it, regs)
    }

    fn convert(&mut self, opcode: Op, from: Scalar, to: Scalar, reg: Reg) -> Result<Reg> {
        let wide = (from.is_wide(), to.is_wide());
        Ok(match opcode {
            Op::ConvertFToU | Op::ConvertFToS => {
                let signed = opcode == Op::ConvertFToS;
                let op = match (signed, wide) {
                    (true, (false, false)) => Ir::FToS,
                    (true, (false, true)) => Ir::FToS64,
                    (true, (true, false)) => Ir::F64ToS,
                    (true, (true, true)) => Ir::F64ToS64,
                    (false, (false, false)) => Ir::FToU,
                    (false, (false, true)) => Ir::FToU64,
                    (false, (true, false)) => Ir::F64ToU,
                    (false, (true, true)) => Ir::F64ToU64,
                };
                let reg = self.op(op, &[reg]);
                self.wrap_to_width(to, reg)
            }
            Op::ConvertSToF | Op::ConvertUToF => {
                let signed = opcode == Op::ConvertSToF;
                let reg = if signed {
                    self.sign_extend(from, reg)
                } else {
                    self.zero_extend(from, reg)
                };
                let op = match (signed, wide) {
                    (true, (false, false)) => Ir::SToF,
                    (true, (false, true)) => Ir::SToF64,
                    (true, (true, false)) => Ir::S64ToF,
                    (true, (true, true)) => Ir::S64ToF64,
                    (false, (false, false)) => Ir::UToF,
                    (false, (false, true)) => Ir::UToF64,
                    (false, (true, false)) => Ir::U64ToF,
                    (false, (true, true)) => Ir::U64ToF64,
                };
                let reg = self.op(op, &[reg]);
                self.wrap_to_width(to, reg)
            }
            Op::UConvert | Op::SConvert => {
                let signed = opcode == Op::SConvert;
                let reg = if signed {
                    self.sign_extend(from, reg)
                } else {
                    self.zero_extend(from, reg)
                };
                match wide {
                    (false, true) if signed => self.op(Ir::SToS64, &[reg]),
                    (false, true) => self.op(Ir::UToU64, &[reg]),
                    (true, false) => {
                        let low = self.op(Ir::Low32, &[reg]);
                        self.wrap_to_width(to, low)
                    }
                    (false, false) => self.wrap_to_width(to, reg),
                    (true, true) => reg,
                }
            }
            Op::FConvert => match wide {
                (false, true) => self.op(Ir::FToF64, &[reg]),
                (true, false) if to == (Scalar::Float { width: 16 }) => {
                    let odd = self.round_to_odd(reg);
                    self.wrap_to_width(to, odd)
                }
                (true, false) => self.op(Ir::F64ToF, &[reg]),
                (false, false) => self.wrap_to_width(to, reg),
                (true, true) => reg,
            },
            Op::QuantizeToF16 => self.quantize(reg),
            other => return unsupported(format!("Op{other:?}")),
        })
    }

    /// A double as a single from which rounding further to a half gives what rounding the double at once would: rounded
    /// towards zero, and made odd if that was inexact.
    fn round_to_odd(&mut self, reg: Reg) -> Reg {
        let near = self.op(Ir::F64ToF, &[reg]);
        let back = self.op(Ir::FToF64, &[near]);
        let inexact = self.op(Ir::FNe64, &[back, reg]);
        let (found, exact) = (self.op(Ir::FAbs64, &[back]), self.op(Ir::FAbs64, &[reg]));
        let outwards = self.op(Ir::FLt64, &[exact, found]);
        let one = self.u32(1);
        let below = self.op(Ir::ISub, &[near, one]);
        let inwards = self.select(outwards, below, near);
        let odd = self.op(Ir::Or, &[inwards, one]);
        self.select(inexact, odd, near)
    }

    /// `OpQuantizeToF16`: to what a half can hold, with denormals flushed to zero of the same sign.
    fn quantize(&mut self, reg: Reg) -> Reg {
        let rounded = self.op(Ir::RoundToF16, &[reg]);
        let size = self.op(Ir::FAbs, &[rounded]);
        let least = self.f32(f32::from_bits(0x3880_0000));
        let denormal = self.op(Ir::FLt, &[size, least]);
        let mask = self.u32(0x8000_0000);
        let zero = self.op(Ir::And, &[rounded, mask]);
        self.select(denormal, zero, rounded)
    }

    /// Reads the same bits as another type; what has fewer components has wider ones.
    fn bitcast(&mut self, it: &Instruction) -> Result<()> {
        let from = match self.globals.types.vector(self.type_of(it.id(0)?)?) {
            Ok((scalar, _)) => scalar,
            Err(_) => return unsupported("this pointer"),
        };
        let regs = self.regs(it.id(0)?)?;
        let (to, count) = self.globals.types.vector(it.ty()?)?;
        let (from_bits, to_bits) = (bits(from), bits(to));
        if from_bits * regs.len() as u32 != to_bits * count || from_bits == 0 {
            return malformed("the types differ in size");
        }
        if from == to {
            return self.define(it, regs.to_vec());
        }
        if from_bits == to_bits {
            let regs = regs.iter().map(|reg| {
                let raw = self.raw_bits(from, *reg);
                self.typed_bits(to, raw)
            });
            let regs = regs.collect();
            return self.define(it, regs);
        }
        let words = self.pack_words(from, &regs);
        let regs = self.unpack_words(to, count, &words);
        self.define(it, regs)
    }

    /// A scalar's own bits, zero-extended: 32 of them, or 64 if it is wide.
    fn raw_bits(&mut self, scalar: Scalar, reg: Reg) -> Reg {
        match scalar {
            Scalar::Float { width: 16 } => self.op(Ir::FToF16, &[reg]),
            _ => self.zero_extend(scalar, reg),
        }
    }

    fn typed_bits(&mut self, scalar: Scalar, reg: Reg) -> Reg {
        match scalar {
            Scalar::Float { width: 16 } => self.op(Ir::F16ToF, &[reg]),
            _ => self.wrap_to_width(scalar, reg),
        }
    }

    /// The bits of scalars in order, in words of 32.
    pub fn pack_words(&mut self, scalar: Scalar, regs: &[Reg]) -> Vec<Reg> {
        let width = bits(scalar);
        if width == 64 {
            return regs
                .iter()
                .flat_map(|reg| [Ir::Low32, Ir::High32].map(|half| self.op(half, &[*reg])))
                .collect();
        }
        let mut words = Vec::new();
        for group in regs.chunks((32 / width.max(8)) as usize) {
            let mut word = None;
            for (index, reg) in group.iter().enumerate() {
                let mut part = self.raw_bits(scalar, *reg);
                if index > 0 {
                    let by = self.u32(width * index as u32);
                    part = self.op(Ir::Shl, &[part, by]);
                }
                word = Some(match word {
                    Some(word) => self.op(Ir::Or, &[word, part]),
                    None => part,
                });
            }
            words.extend(word);
        }
        words
    }

    /// Scalars from words of 32 bits.
    fn unpack_words(&mut self, scalar: Scalar, count: u32, words: &[Reg]) -> Vec<Reg> {
        let width = bits(scalar);
        if width == 64 {
            return words
                .chunks_exact(2)
                .map(|pair| self.op(Ir::Join64, pair))
                .collect();
        }
        (0..count)
            .filter_map(|index| {
                let bit = index * width;
                let word = *words.get((bit / 32) as usize)?;
                let by = self.u32(bit % 32);
                let part = self.op(Ir::UShr, &[word, by]);
                let part = match scalar {
                    Scalar::Float { width: 16 } => {
                        let mask = self.u32(0xffff);
                        self.op(Ir::And, &[part, mask])
                    }
                    _ => part,
                };
                Some(self.typed_bits(scalar, part))
            })
            .collect()
    }
}

/// Bits of a scalar; 0 for a truth value, which has none.
fn bits(scalar: Scalar) -> u32 {
    match scalar {
        Scalar::Bool => 0,
        Scalar::Int { width, .. } | Scalar::Float { width } => width,
        Scalar::Address => 64,
    }
}
