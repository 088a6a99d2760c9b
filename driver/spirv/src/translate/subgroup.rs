//! Operations across the lanes of a subgroup.

use isa::ir::{Reg, SubgroupOp, is_reducible};
use isa::op::Op as Ir;
use spirv::{GroupOperation, Op};

use super::emitter::op_for_width;
use super::translator::Translator;
use crate::error::{Result, malformed, unsupported};
use crate::instruction::Instruction;
use crate::types::Scalar;

fn group_op(opcode: Op, scalar: Scalar) -> Option<Ir> {
    let (narrow, wide) = match opcode {
        Op::GroupNonUniformIAdd => (Ir::IAdd, Ir::IAdd64),
        Op::GroupNonUniformFAdd => (Ir::FAdd, Ir::FAdd64),
        Op::GroupNonUniformIMul => (Ir::IMul, Ir::IMul64),
        Op::GroupNonUniformFMul => (Ir::FMul, Ir::FMul64),
        Op::GroupNonUniformSMin => (Ir::SMin, Ir::SMin64),
        Op::GroupNonUniformUMin => (Ir::UMin, Ir::UMin64),
        Op::GroupNonUniformFMin => (Ir::FMin, Ir::FMin64),
        Op::GroupNonUniformSMax => (Ir::SMax, Ir::SMax64),
        Op::GroupNonUniformUMax => (Ir::UMax, Ir::UMax64),
        Op::GroupNonUniformFMax => (Ir::FMax, Ir::FMax64),
        Op::GroupNonUniformBitwiseAnd => (Ir::And, Ir::And64),
        Op::GroupNonUniformBitwiseOr => (Ir::Or, Ir::Or64),
        Op::GroupNonUniformBitwiseXor => (Ir::Xor, Ir::Xor64),
        Op::GroupNonUniformLogicalAnd => return Some(Ir::BAnd),
        Op::GroupNonUniformLogicalOr => return Some(Ir::BOr),
        Op::GroupNonUniformLogicalXor => return Some(Ir::BXor),
        _ => return None,
    };
    Some(op_for_width(scalar, narrow, wide))
}

/// Translates `OpGroupNonUniform*` and the older `OpSubgroup*KHR`.
pub fn subgroup(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let opcode = instruction.opcode;
    // The newer instructions have a scope operand first.
    let khr = matches!(
        opcode,
        Op::SubgroupBallotKHR
            | Op::SubgroupFirstInvocationKHR
            | Op::SubgroupAllKHR
            | Op::SubgroupAnyKHR
            | Op::SubgroupAllEqualKHR
            | Op::SubgroupReadInvocationKHR
    );
    let first = usize::from(!khr);
    match opcode {
        Op::GroupNonUniformElect => {
            let elected = t.emit.builder.subgroup(SubgroupOp::Elect, None, None);
            t.define(instruction, vec![elected])
        }
        Op::GroupNonUniformAll | Op::SubgroupAllKHR => vote(t, instruction, SubgroupOp::All, first),
        Op::GroupNonUniformAny | Op::SubgroupAnyKHR => vote(t, instruction, SubgroupOp::Any, first),
        Op::GroupNonUniformAllEqual | Op::SubgroupAllEqualKHR => {
            let regs = t.regs(instruction.id(first)?)?;
            let mut all = None;
            for reg in regs.iter() {
                let equal = t.emit.builder.subgroup(SubgroupOp::AllEqual, Some(*reg), None);
                all = Some(match all {
                    Some(all) => t.emit.op(Ir::BAnd, &[all, equal]),
                    None => equal,
                });
            }
            t.define(instruction, all.into_iter().collect())
        }
        Op::GroupNonUniformBroadcastFirst | Op::SubgroupFirstInvocationKHR => {
            move_lanes(t, instruction, SubgroupOp::BroadcastFirst, first, None)
        }
        Op::GroupNonUniformBroadcast | Op::GroupNonUniformShuffle | Op::SubgroupReadInvocationKHR => {
            move_lanes(t, instruction, SubgroupOp::Shuffle, first, Some(first + 1))
        }
        Op::GroupNonUniformShuffleXor => move_lanes(t, instruction, SubgroupOp::ShuffleXor, first, Some(first + 1)),
        Op::GroupNonUniformShuffleUp => move_lanes(t, instruction, SubgroupOp::ShuffleUp, first, Some(first + 1)),
        Op::GroupNonUniformShuffleDown => move_lanes(t, instruction, SubgroupOp::ShuffleDown, first, Some(first + 1)),
        Op::GroupNonUniformRotateKHR => rotate(t, instruction),
        Op::GroupNonUniformQuadAllKHR | Op::GroupNonUniformQuadAnyKHR => quad_vote(t, instruction),
        Op::GroupNonUniformQuadBroadcast => {
            move_lanes(t, instruction, SubgroupOp::QuadBroadcast, first, Some(first + 1))
        }
        Op::GroupNonUniformQuadSwap => {
            let direction = t.literal(instruction.id(2)?)?;
            let across = t.emit.u32(direction.min(2) + 1);
            let regs = t.regs(instruction.id(1)?)?;
            let op = SubgroupOp::QuadSwap;
            let moved = regs.iter().map(|reg| t.emit.builder.subgroup(op, Some(*reg), Some(across))).collect();
            t.define(instruction, moved)
        }
        Op::GroupNonUniformBallot | Op::SubgroupBallotKHR => {
            let value = t.reg(instruction.id(first)?)?;
            let words = t.emit.builder.ballot(value);
            t.define(instruction, words.to_vec())
        }
        Op::GroupNonUniformInverseBallot => {
            let words = ballot_operand(t, instruction, 1)?;
            let lane = t.io.subgroup_lane(&mut t.emit);
            let bit = ballot_bit(t, &words, lane);
            t.define(instruction, vec![bit])
        }
        Op::GroupNonUniformBallotBitExtract => {
            let words = ballot_operand(t, instruction, 1)?;
            let index = t.reg(instruction.id(2)?)?;
            let bit = ballot_bit(t, &words, index);
            t.define(instruction, vec![bit])
        }
        Op::GroupNonUniformBallotBitCount => ballot_count(t, instruction),
        Op::GroupNonUniformBallotFindLSB | Op::GroupNonUniformBallotFindMSB => ballot_find(t, instruction),
        _ => group_arithmetic(t, instruction),
    }
}

fn vote(t: &mut Translator, instruction: &Instruction, op: SubgroupOp, operand: usize) -> Result<()> {
    let value = t.reg(instruction.id(operand)?)?;
    let reg = t.emit.builder.subgroup(op, Some(value), None);
    t.define(instruction, vec![reg])
}

fn move_lanes(
    t: &mut Translator,
    instruction: &Instruction,
    op: SubgroupOp,
    value: usize,
    index: Option<usize>,
) -> Result<()> {
    let regs = t.regs(instruction.id(value)?)?;
    let index = match index {
        Some(index) => Some(t.reg(instruction.id(index)?)?),
        None => None,
    };
    let moved = regs.iter().map(|reg| t.emit.builder.subgroup(op, Some(*reg), index)).collect();
    t.define(instruction, moved)
}

/// Moves values down by a number of lanes within the subgroup, or within clusters of it; the lowest lanes' go to the
/// highest.
fn rotate(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let cluster = match instruction.operands.len() {
        0..=3 => t.options.subgroup_size,
        _ => match t.literal(instruction.id(3)?)? {
            cluster if cluster.is_power_of_two() => cluster,
            _ => return malformed("the cluster size isn't a power of two"),
        },
    };
    let regs = t.regs(instruction.id(1)?)?;
    let delta = t.reg(instruction.id(2)?)?;
    let lane = t.io.subgroup_lane(&mut t.emit);
    let (within, outside) = (t.emit.u32(cluster - 1), t.emit.u32(!(cluster - 1)));
    let moved = t.emit.op(Ir::IAdd, &[lane, delta]);
    let moved = t.emit.op(Ir::And, &[moved, within]);
    let first = t.emit.op(Ir::And, &[lane, outside]);
    let from = t.emit.op(Ir::Or, &[first, moved]);
    let op = SubgroupOp::Shuffle;
    let rotated = regs.iter().map(|reg| t.emit.builder.subgroup(op, Some(*reg), Some(from))).collect();
    t.define(instruction, rotated)
}

/// Votes of the lanes of a quad that are active.
fn quad_vote(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let is_all = instruction.opcode == Op::GroupNonUniformQuadAllKHR;
    let value = t.reg(instruction.id(0)?)?;
    // All are true if none is false.
    let value = if is_all { t.emit.op(Ir::BNot, &[value]) } else { value };
    let words = t.emit.builder.ballot(value);
    let lane = t.io.subgroup_lane(&mut t.emit);
    let quad = t.emit.u32(!3);
    let first = t.emit.op(Ir::And, &[lane, quad]);
    let bits = ballot_from(t, &words, first);
    let (four, zero) = (t.emit.u32(0xF), t.emit.u32(0));
    let bits = t.emit.op(Ir::And, &[bits, four]);
    let vote = t.emit.op(if is_all { Ir::IEq } else { Ir::INe }, &[bits, zero]);
    t.define(instruction, vec![vote])
}

fn ballot_operand(t: &mut Translator, instruction: &Instruction, index: usize) -> Result<[Reg; 4]> {
    match *t.regs(instruction.id(index)?)? {
        [a, b, c, d] => Ok([a, b, c, d]),
        _ => malformed("a ballot has four words"),
    }
}

/// A truth value: true if a bit of a ballot is set.
fn ballot_bit(t: &mut Translator, words: &[Reg; 4], index: Reg) -> Reg {
    let (one, zero) = (t.emit.u32(1), t.emit.u32(0));
    let shifted = ballot_from(t, words, index);
    let bit = t.emit.op(Ir::And, &[shifted, one]);
    t.emit.op(Ir::INe, &[bit, zero])
}

/// The bits of a ballot's word from an index on.
fn ballot_from(t: &mut Translator, words: &[Reg; 4], index: Reg) -> Reg {
    let five = t.emit.u32(5);
    let which = t.emit.op(Ir::UShr, &[index, five]);
    let mut word = words[0];
    for (number, candidate) in (1..).zip(&words[1..]) {
        let number = t.emit.u32(number);
        let this = t.emit.op(Ir::IEq, &[which, number]);
        word = t.emit.select(this, *candidate, word);
    }
    t.emit.op(Ir::UShr, &[word, index])
}

/// A ballot's words without the bits above the subgroup's.
fn ballot_of_subgroup(t: &mut Translator, instruction: &Instruction, index: usize) -> Result<[Reg; 4]> {
    let mut words = ballot_operand(t, instruction, index)?;
    for (first, word) in (0..).step_by(32).zip(&mut words) {
        let bits = t.options.subgroup_size.saturating_sub(first).min(32);
        if bits < 32 {
            let mask = t.emit.u32((1 << bits) - 1);
            *word = t.emit.op(Ir::And, &[*word, mask]);
        }
    }
    Ok(words)
}

fn ballot_count(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let Some(group) = instruction.enumerant(1, GroupOperation::from_u32) else {
        return malformed("there is no group operation");
    };
    let words = ballot_of_subgroup(t, instruction, 2)?;
    let mut sum = t.emit.u32(0);
    for (index, word) in (0..).zip(words) {
        let mask = match group {
            GroupOperation::Reduce => None,
            GroupOperation::InclusiveScan => Some(spirv::BuiltIn::SubgroupLeMask),
            GroupOperation::ExclusiveScan => Some(spirv::BuiltIn::SubgroupLtMask),
            _ => return unsupported("this group operation"),
        };
        let word = match mask {
            Some(mask) => {
                let mask = t.io.lane_mask(&mut t.emit, mask, index);
                t.emit.op(Ir::And, &[word, mask])
            }
            None => word,
        };
        let count = t.emit.op(Ir::BitCount, &[word]);
        sum = t.emit.op(Ir::IAdd, &[sum, count]);
    }
    t.define(instruction, vec![sum])
}

fn ballot_find(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let lowest = instruction.opcode == Op::GroupNonUniformBallotFindLSB;
    let words = ballot_of_subgroup(t, instruction, 1)?;
    let zero = t.emit.u32(0);
    let mut found = t.emit.u32(u32::MAX);
    let order: [u32; 4] = if lowest { [3, 2, 1, 0] } else { [0, 1, 2, 3] };
    for index in order {
        let word = words[index as usize];
        let find = if lowest { Ir::FindLsb } else { Ir::FindUMsb };
        let bit = t.emit.op(find, &[word]);
        let first = t.emit.u32(32 * index);
        let bit = t.emit.op(Ir::IAdd, &[bit, first]);
        let any = t.emit.op(Ir::INe, &[word, zero]);
        found = t.emit.select(any, bit, found);
    }
    t.define(instruction, vec![found])
}

/// Translates reductions and scans.
fn group_arithmetic(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let (scalar, regs) = t.vector(instruction.id(2)?)?;
    let Some(op) = group_op(instruction.opcode, scalar).filter(|op| is_reducible(*op)) else {
        return unsupported(format!("Op{:?}", instruction.opcode));
    };
    let Some(group) = instruction.enumerant(1, GroupOperation::from_u32) else {
        return malformed("there is no group operation");
    };
    let operation = match group {
        GroupOperation::Reduce => SubgroupOp::Reduce { op, cluster: t.options.subgroup_size },
        GroupOperation::InclusiveScan => SubgroupOp::InclusiveScan(op),
        GroupOperation::ExclusiveScan => SubgroupOp::ExclusiveScan(op),
        GroupOperation::ClusteredReduce => SubgroupOp::Reduce {
            op,
            cluster: match t.literal(instruction.id(3)?)? {
                cluster if cluster.is_power_of_two() => cluster,
                _ => return malformed("the cluster size isn't a power of two"),
            },
        },
        _ => return unsupported("this group operation"),
    };
    let signed = matches!(op, Ir::SMin | Ir::SMax);
    let unsigned = matches!(op, Ir::UMin | Ir::UMax);
    let reduced = regs
        .iter()
        .map(|reg| {
            let reg = match (signed, unsigned) {
                (true, _) => t.emit.sign_extend(scalar, *reg),
                (_, true) => t.emit.zero_extend(scalar, *reg),
                _ => *reg,
            };
            let reg = t.emit.builder.subgroup(operation, Some(reg), None);
            let reg = if signed { clamped(t, scalar, op, reg) } else { reg };
            t.emit.wrap_to_width(scalar, reg)
        })
        .collect();
    t.define(instruction, reduced)
}

/// The identity of a minimum or maximum of narrow integers: the 32-bit identity clamped to the type's range.
fn clamped(t: &mut Translator, scalar: Scalar, op: Ir, reg: Reg) -> Reg {
    let Scalar::Int { width: width @ (8 | 16), .. } = scalar else {
        return reg;
    };
    let most = (1 << (width - 1)) - 1;
    let limit = t.emit.u32(if op == Ir::SMin { most } else { !most });
    t.emit.op(op, &[reg, limit])
}
