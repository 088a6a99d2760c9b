//! A scalar interpreter that runs one lane at a time, written for clarity.

use std::collections::HashMap;

use crate::ir::{Address, Block, Format, Label, Program, Reg, Space, Statement, Type};
use crate::op::Op;

/// The run of a program in one lane. Programs may use registers, control flow and private memory.
pub struct Lane<'a> {
    program: &'a Program,
    registers: Vec<u64>,
    private: HashMap<u64, u32>,
    /// True if it was killed or demoted.
    pub killed: bool,
    /// True if it was killed, so that it has no outputs.
    pub ended: bool,
}

/// The continuation after a statement.
enum Flow {
    Next,
    Break(Label),
    Continue(Label),
    Done,
}

impl<'a> Lane<'a> {
    /// A lane that has these inputs, by slot.
    pub fn new(program: &'a Program, inputs: &[u64]) -> Self {
        let registers = vec![0; program.registers.len()];
        let mut lane = Self { program, registers, private: HashMap::new(), killed: false, ended: false };
        for constant in &program.constants {
            let is_bool = lane.type_of(constant.reg) == Type::Bool;
            lane.set(constant.reg, if is_bool { bool_bits(constant.bits != 0) } else { constant.bits });
        }
        for input in &program.inputs {
            lane.set(input.reg, inputs[input.slot as usize]);
        }
        lane
    }

    /// Runs the lane. Returns the outputs in the order of the program's.
    pub fn run(&mut self) -> Vec<u64> {
        let program = self.program;
        self.block(&program.body);
        program.outputs.iter().map(|output| self.get(output.reg)).collect()
    }

    fn type_of(&self, reg: Reg) -> Type {
        self.program.registers[reg.0 as usize].ty
    }

    fn get(&self, reg: Reg) -> u64 {
        self.registers[reg.0 as usize]
    }

    fn set(&mut self, reg: Reg, bits: u64) {
        self.registers[reg.0 as usize] = bits;
    }

    fn block(&mut self, block: &Block) -> Flow {
        for statement in block {
            match self.statement(statement) {
                Flow::Next => {}
                flow => return flow,
            }
        }
        Flow::Next
    }

    fn statement(&mut self, statement: &Statement) -> Flow {
        match statement {
            Statement::Compute { op, dst, src } => {
                let operands: Vec<u64> = src.iter().map(|reg| self.get(*reg)).collect();
                self.set(*dst, apply(*op, &operands));
            }
            Statement::Assign { dst, src } => self.set(*dst, self.get(*src)),
            Statement::Load { dst, address, format: Format::B32 } => {
                for (element, reg) in dst.iter().enumerate() {
                    let at = self.address(address) + 4 * element as u64;
                    self.set(*reg, u64::from(self.private.get(&at).copied().unwrap_or(0)));
                }
            }
            Statement::Store { src, address, format: Format::B32 } => {
                for (element, reg) in src.iter().enumerate() {
                    let at = self.address(address) + 4 * element as u64;
                    if at + 4 <= u64::from(self.program.private_bytes) && at.is_multiple_of(4) {
                        self.private.insert(at, self.get(*reg) as u32);
                    }
                }
            }
            Statement::If { condition, then, otherwise } => {
                return self.block(if self.get(*condition) != 0 { then } else { otherwise });
            }
            Statement::Switch { label, selector, cases } => {
                let value = self.get(*selector) as u32;
                let start = cases
                    .iter()
                    .position(|case| case.values.contains(&value))
                    .or_else(|| cases.iter().position(|case| case.default));
                for case in cases.iter().skip(start.unwrap_or(cases.len())) {
                    match self.block(&case.body) {
                        Flow::Next if case.fallthrough => {}
                        Flow::Next => break,
                        Flow::Break(target) if target == *label => break,
                        flow => return flow,
                    }
                }
            }
            Statement::Loop { label, body, continuing } => loop {
                match self.block(body) {
                    Flow::Next => {}
                    Flow::Continue(target) if target == *label => {}
                    Flow::Break(target) if target == *label => break,
                    flow => return flow,
                }
                match self.block(continuing) {
                    Flow::Next => {}
                    Flow::Break(target) if target == *label => break,
                    flow => return flow,
                }
            },
            Statement::Scope { label, body } => match self.block(body) {
                Flow::Break(target) if target == *label => {}
                flow => return flow,
            },
            Statement::Break(label) => return Flow::Break(*label),
            Statement::Continue(label) => return Flow::Continue(*label),
            Statement::Return => return Flow::Done,
            Statement::Kill => {
                (self.killed, self.ended) = (true, true);
                return Flow::Done;
            }
            Statement::Demote => self.killed = true,
            other => panic!("the scalar interpreter has no {other}"),
        }
        Flow::Next
    }

    fn address(&self, address: &Address) -> u64 {
        assert_eq!(address.space, Space::Private);
        address.base.map_or(0, |base| self.get(base)) + u64::from(address.offset)
    }
}

/// A bool as its bits.
pub fn bool_bits(value: bool) -> u64 {
    if value { u64::from(u32::MAX) } else { 0 }
}

/// The result of an operation, as exact as the host's scalar arithmetic.
pub fn apply(op: Op, operands: &[u64]) -> u64 {
    let at = |index: usize| operands.get(index).copied().unwrap_or(0);
    let (a, b, c) = (at(0), at(1), at(2));
    if op.name().ends_with("64") && op.signature().operands.first() == Some(&Type::B64) {
        return apply64(op, a, b, c);
    }
    let u = |value: u32| u64::from(value);
    let s = |value: i32| u64::from(value.cast_unsigned());
    let f = |value: f32| u64::from(value.to_bits());
    let (ua, ub, uc) = (a as u32, b as u32, c as u32);
    let (sa, sb) = (ua.cast_signed(), ub.cast_signed());
    let (fa, fb, fc) = (f32::from_bits(ua), f32::from_bits(ub), f32::from_bits(uc));
    let wide = |function: fn(f64) -> f64| f(function(f64::from(fa)) as f32);
    let field = |value: u32, offset: u32, count: u32| -> u32 {
        (0..count.min(32))
            .filter(|bit| offset + bit < 32)
            .fold(0, |out, bit| out | (value >> (offset + bit) & 1) << bit)
    };
    match op {
        Op::BAnd | Op::And => a & b,
        Op::BOr | Op::Or => a | b,
        Op::BXor | Op::Xor => a ^ b,
        Op::BNot | Op::Not => u(!ua),
        Op::BSelect | Op::Select | Op::Select64 => {
            if a != 0 {
                b
            } else {
                c
            }
        }
        Op::Shl => u(ua << (ub % 32)),
        Op::UShr => u(ua >> (ub % 32)),
        Op::SShr => s(sa >> (ub % 32)),
        Op::BitReverse => u(ua.reverse_bits()),
        Op::BitCount => u(ua.count_ones()),
        Op::FindLsb => s((0..32).find(|bit| ua >> bit & 1 == 1).unwrap_or(-1)),
        Op::FindUMsb => s((0..32).rev().find(|bit| ua >> bit & 1 == 1).unwrap_or(-1)),
        Op::FindSMsb => s((0..32).rev().find(|bit| sa >> bit & 1 != sa >> 31 & 1).unwrap_or(-1)),
        Op::BitfieldInsert => {
            let (offset, count) = (uc, at(3) as u32);
            let bits = (0..count.min(32)).filter(|bit| offset.saturating_add(*bit) < 32);
            u(bits.fold(ua, |out, bit| out & !(1 << (offset + bit)) | (ub >> bit & 1) << (offset + bit)))
        }
        Op::BitfieldUExtract if ub >= 32 => 0,
        Op::BitfieldUExtract => u(field(ua, ub, uc)),
        Op::BitfieldSExtract if uc == 0 || ub >= 32 => 0,
        Op::BitfieldSExtract => {
            let bits = field(ua, ub, uc);
            let sign = bits >> (uc.min(32) - 1) & 1;
            u(if sign == 1 && uc < 32 { bits | u32::MAX << uc } else { bits })
        }
        Op::SExt8 => s(i32::from(ua as i8)),
        Op::SExt16 => s(i32::from(ua as i16)),
        Op::IAdd => u(ua.wrapping_add(ub)),
        Op::ISub => u(ua.wrapping_sub(ub)),
        Op::IMul => u(ua.wrapping_mul(ub)),
        Op::UMulHi => (u(ua) * u(ub)) >> 32,
        Op::SMulHi => u(((i64::from(sa) * i64::from(sb)) >> 32) as u32),
        Op::UAddCarry => u64::from(ua.checked_add(ub).is_none()),
        Op::USubBorrow => u64::from(ua < ub),
        Op::INeg => s(sa.wrapping_neg()),
        Op::SAbs => s(sa.wrapping_abs()),
        Op::SSign => s(sa.signum()),
        Op::UDiv => u(ua.checked_div(ub).unwrap_or(u32::MAX)),
        Op::URem => u(if ub == 0 { ua } else { ua % ub }),
        Op::SDiv => s(if sb == 0 { -1 } else { sa.wrapping_div(sb) }),
        Op::SRem => s(if sb == 0 { sa } else { sa.wrapping_rem(sb) }),
        Op::SMod => s(if sb == 0 {
            sa
        } else {
            (i64::from(sa) - i64::from(sb) * (i64::from(sa) as f64 / f64::from(sb)).floor() as i64) as i32
        }),
        Op::SMin => s(sa.min(sb)),
        Op::SMax => s(sa.max(sb)),
        Op::UMin => u(ua.min(ub)),
        Op::UMax => u(ua.max(ub)),
        Op::IEq => bool_bits(ua == ub),
        Op::INe => bool_bits(ua != ub),
        Op::SLt => bool_bits(sa < sb),
        Op::SLe => bool_bits(sa <= sb),
        Op::ULt => bool_bits(ua < ub),
        Op::ULe => bool_bits(ua <= ub),
        Op::FAdd => f(fa + fb),
        Op::FSub => f(fa - fb),
        Op::FMul => f(fa * fb),
        Op::FFma => f(fa.mul_add(fb, fc)),
        Op::FMulSub => f(fa.mul_add(fb, -fc)),
        Op::FNegMulAdd => f((-fa).mul_add(fb, fc)),
        Op::FDiv => f(fa / fb),
        Op::FRem => f(fa % fb),
        Op::FMod => {
            let r = f64::from(fa) % f64::from(fb);
            f(if r != 0.0 && (r < 0.0) != (fb < 0.0) { (r + f64::from(fb)) as f32 } else { r as f32 })
        }
        Op::FNeg => f(-fa),
        Op::FAbs => f(fa.abs()),
        Op::FSign => f(if fa > 0.0 {
            1.0
        } else if fa < 0.0 {
            -1.0
        } else {
            0.0
        }),
        Op::FFloor => f(fa.floor()),
        Op::FCeil => f(fa.ceil()),
        Op::FTrunc => f(fa.trunc()),
        Op::FRoundEven => f(fa.round_ties_even()),
        Op::FFract => f(fa - fa.floor()),
        Op::FMin => f(if fb.is_nan() || fa < fb { fa } else { fb }),
        Op::FMax => f(if fb.is_nan() || fa > fb { fa } else { fb }),
        Op::FSqrt => f(fa.sqrt()),
        Op::FInverseSqrt => wide(|a| 1.0 / a.sqrt()),
        Op::FEq => bool_bits(fa == fb),
        Op::FNe => bool_bits(fa != fb),
        Op::FLt => bool_bits(fa < fb),
        Op::FLe => bool_bits(fa <= fb),
        Op::FLtGt => bool_bits(fa.partial_cmp(&fb).is_some_and(|order| order.is_ne())),
        Op::FIsNan => bool_bits(fa.is_nan()),
        Op::FIsInf => bool_bits(fa.is_infinite()),
        Op::FExp => wide(f64::exp),
        Op::FExp2 => wide(f64::exp2),
        Op::FLog => wide(f64::ln),
        Op::FLog2 => wide(f64::log2),
        Op::FPow => f(f64::from(fa).powf(f64::from(fb)) as f32),
        Op::FSin => wide(f64::sin),
        Op::FCos => wide(f64::cos),
        Op::FTan => wide(f64::tan),
        Op::FAsin => wide(f64::asin),
        Op::FAcos => wide(f64::acos),
        Op::FAtan => wide(f64::atan),
        Op::FAtan2 => f(f64::from(fa).atan2(f64::from(fb)) as f32),
        Op::FSinh => wide(|x| by_exponential(x, f64::sinh)),
        Op::FCosh => wide(|x| by_exponential(x, f64::cosh)),
        Op::FTanh => wide(f64::tanh),
        Op::FAsinh => wide(f64::asinh),
        Op::FAcosh => wide(f64::acosh),
        Op::FAtanh => wide(f64::atanh),
        Op::FLdexp => f((f64::from(fa) * 2f64.powi(sb.clamp(-500, 500))) as f32),
        Op::FFrexpSignificand => f(frexp(f64::from(fa)).0 as f32),
        Op::FFrexpExponent => s(frexp(f64::from(fa)).1),
        Op::FToS => s(fa as i32),
        Op::FToU => u(fa as u32),
        Op::SToF => f(sa as f32),
        Op::UToF => f(ua as f32),
        Op::FToF16 => u64::from(half::f16::from_f32_const(fa).to_bits()),
        Op::F16ToF => f(half::f16::from_bits(ua as u16).to_f32_const()),
        Op::RoundToF16 => f(half::f16::from_f32_const(fa).to_f32_const()),
        Op::FToF64 => f64::from(fa).to_bits(),
        Op::SToF64 => f64::from(sa).to_bits(),
        Op::UToF64 => f64::from(ua).to_bits(),
        Op::FToS64 => (fa as i64).cast_unsigned(),
        Op::FToU64 => fa as u64,
        Op::SToS64 => i64::from(sa).cast_unsigned(),
        Op::UToU64 => u64::from(ua),
        Op::Join64 => u64::from(ua) | u64::from(ub) << 32,
        _ => apply64(op, a, b, c),
    }
}

fn apply64(op: Op, a: u64, b: u64, c: u64) -> u64 {
    let s = i64::cast_unsigned;
    let f = f64::to_bits;
    let (sa, sb) = (a.cast_signed(), b.cast_signed());
    let (fa, fb, fc) = (f64::from_bits(a), f64::from_bits(b), f64::from_bits(c));
    match op {
        Op::F64ToF => u64::from((fa as f32).to_bits()),
        Op::F64ToS => u64::from((fa as i32).cast_unsigned()),
        Op::F64ToU => u64::from(fa as u32),
        Op::F64ToS64 => s(fa as i64),
        Op::F64ToU64 => fa as u64,
        Op::S64ToF64 => f(sa as f64),
        Op::U64ToF64 => f(a as f64),
        Op::S64ToF => u64::from((sa as f32).to_bits()),
        Op::U64ToF => u64::from((a as f32).to_bits()),
        Op::Low32 => a & 0xffff_ffff,
        Op::High32 => a >> 32,
        Op::FAdd64 => f(fa + fb),
        Op::FSub64 => f(fa - fb),
        Op::FMul64 => f(fa * fb),
        Op::FDiv64 => f(fa / fb),
        Op::FFma64 => f(fa.mul_add(fb, fc)),
        Op::FRem64 => f(fa % fb),
        Op::FMod64 => {
            let r = fa % fb;
            f(if r != 0.0 && (r < 0.0) != (fb < 0.0) { r + fb } else { r })
        }
        Op::FNeg64 => f(-fa),
        Op::FAbs64 => f(fa.abs()),
        Op::FSign64 => f(if fa > 0.0 {
            1.0
        } else if fa < 0.0 {
            -1.0
        } else {
            0.0
        }),
        Op::FFloor64 => f(fa.floor()),
        Op::FCeil64 => f(fa.ceil()),
        Op::FTrunc64 => f(fa.trunc()),
        Op::FRoundEven64 => f(fa.round_ties_even()),
        Op::FFract64 => f(fa - fa.floor()),
        Op::FMin64 => f(if fb.is_nan() || fa < fb { fa } else { fb }),
        Op::FMax64 => f(if fb.is_nan() || fa > fb { fa } else { fb }),
        Op::FSqrt64 => f(fa.sqrt()),
        Op::FEq64 => bool_bits(fa == fb),
        Op::FNe64 => bool_bits(fa != fb),
        Op::FLt64 => bool_bits(fa < fb),
        Op::FLe64 => bool_bits(fa <= fb),
        Op::FLtGt64 => bool_bits(fa.partial_cmp(&fb).is_some_and(|order| order.is_ne())),
        Op::FIsNan64 => bool_bits(fa.is_nan()),
        Op::FIsInf64 => bool_bits(fa.is_infinite()),
        Op::FLdexp64 => f(ldexp(fa, (b as u32).cast_signed())),
        Op::FFrexpSignificand64 => f(frexp(fa).0),
        Op::FFrexpExponent64 => u64::from(frexp(fa).1.cast_unsigned()),
        Op::IAdd64 => a.wrapping_add(b),
        Op::ISub64 => a.wrapping_sub(b),
        Op::IMul64 => a.wrapping_mul(b),
        Op::INeg64 => a.wrapping_neg(),
        Op::SAbs64 => s(sa.wrapping_abs()),
        Op::SSign64 => s(sa.signum()),
        Op::UDiv64 => a.checked_div(b).unwrap_or(u64::MAX),
        Op::URem64 => {
            if b == 0 {
                a
            } else {
                a % b
            }
        }
        Op::SDiv64 => s(if sb == 0 { -1 } else { sa.wrapping_div(sb) }),
        Op::SRem64 => s(if sb == 0 { sa } else { sa.wrapping_rem(sb) }),
        Op::SMod64 => {
            let (a, b) = (i128::from(sa), i128::from(sb));
            if b == 0 { s(sa) } else { (((a % b) + b) % b) as u64 }
        }
        Op::And64 => a & b,
        Op::Or64 => a | b,
        Op::Xor64 => a ^ b,
        Op::Not64 => !a,
        Op::Shl64 => a << (b % 64),
        Op::UShr64 => a >> (b % 64),
        Op::SShr64 => s(sa >> (b % 64)),
        Op::IEq64 => bool_bits(a == b),
        Op::INe64 => bool_bits(a != b),
        Op::SLt64 => bool_bits(sa < sb),
        Op::SLe64 => bool_bits(sa <= sb),
        Op::ULt64 => bool_bits(a < b),
        Op::ULe64 => bool_bits(a <= b),
        Op::SMin64 => s(sa.min(sb)),
        Op::SMax64 => s(sa.max(sb)),
        Op::UMin64 => a.min(b),
        Op::UMax64 => a.max(b),
        other => panic!("the scalar interpreter has no {}", other.name()),
    }
}

/// `frexp` by halving and doubling.
fn frexp(mut a: f64) -> (f64, i32) {
    let mut exponent = 0;
    if a == 0.0 || !a.is_finite() {
        return (a, 0);
    }
    while a.abs() >= 1.0 {
        a /= 2.0;
        exponent += 1;
    }
    while a.abs() < 0.5 {
        a *= 2.0;
        exponent -= 1;
    }
    (a, exponent)
}

/// `ldexp` by doubling, or by halving until one division by a power of two is left.
fn ldexp(mut a: f64, mut exponent: i32) -> f64 {
    if a == 0.0 || !a.is_finite() {
        return a;
    }
    let (significand, own) = frexp(a);
    exponent = exponent.saturating_add(own);
    a = significand;
    if exponent > 1100 {
        return a * f64::INFINITY;
    }
    if exponent < -1200 {
        return a * 0.0;
    }
    while exponent > 0 {
        a *= 2.0;
        exponent -= 1;
    }
    if exponent < -1021 {
        // Only the last multiplication may round.
        return a * 2f64.powi(-1021) * 2f64.powi(exponent + 1021);
    }
    a * 2f64.powi(exponent)
}

/// A hyperbolic function of a binary32 number, as half of an exponential that overflows in binary32.
pub fn by_exponential(x: f64, function: fn(f64) -> f64) -> f64 {
    match x.abs() > f64::from(f32::MAX).ln() {
        true => function(x).signum() * f64::INFINITY,
        false => function(x),
    }
}
