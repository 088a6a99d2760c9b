//! Operations across the lanes of a subgroup.

use isa::ir::{Reg, SubgroupOp, is_reducible};
use isa::op::Op as Ir;
use spirv::{GroupOperation, Op};

use super::super::error::{Result, malformed, unsupported};
use super::super::instruction::Instruction;
use super::super::types::Scalar;
use super::Translator;
use super::arithmetic::op_for_width;

impl Translator<'_> {
    /// `OpGroupNonUniform*` and the older `OpSubgroup*KHR`.
    pub fn subgroup(&mut self, it: &Instruction) -> Result<()> {
        self.interface.uses_subgroups = true;
        let opcode = it.opcode;
        // The newer instructions name a scope first.
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
                let elected = self.builder.subgroup(SubgroupOp::Elect, None, None);
                self.define(it, vec![elected])
            }
            Op::GroupNonUniformAll | Op::SubgroupAllKHR => self.vote(it, SubgroupOp::All, first),
            Op::GroupNonUniformAny | Op::SubgroupAnyKHR => self.vote(it, SubgroupOp::Any, first),
            Op::GroupNonUniformAllEqual | Op::SubgroupAllEqualKHR => {
                let regs = self.regs(it.id(first)?)?;
                let mut all = None;
                for reg in regs.iter() {
                    let equal = self
                        .builder
                        .subgroup(SubgroupOp::AllEqual, Some(*reg), None);
                    all = Some(match all {
                        Some(all) => self.op(Ir::BAnd, &[all, equal]),
                        None => equal,
                    });
                }
                self.define(it, all.into_iter().collect())
            }
            Op::GroupNonUniformBroadcastFirst | Op::SubgroupFirstInvocationKHR => {
                self.move_lanes(it, SubgroupOp::BroadcastFirst, first, None)
            }
            Op::GroupNonUniformBroadcast
            | Op::GroupNonUniformShuffle
            | Op::SubgroupReadInvocationKHR => {
                self.move_lanes(it, SubgroupOp::Shuffle, first, Some(first + 1))
            }
            Op::GroupNonUniformShuffleXor => {
                self.move_lanes(it, SubgroupOp::ShuffleXor, first, Some(first + 1))
            }
            Op::GroupNonUniformShuffleUp => {
                self.move_lanes(it, SubgroupOp::ShuffleUp, first, Some(first + 1))
            }
            Op::GroupNonUniformShuffleDown => {
                self.move_lanes(it, SubgroupOp::ShuffleDown, first, Some(first + 1))
            }
            Op::GroupNonUniformQuadBroadcast => {
                self.move_lanes(it, SubgroupOp::QuadBroadcast, first, Some(first + 1))
            }
            Op::GroupNonUniformQuadSwap => {
                let direction = self.literal(it.id(2)?)?;
                let across = self.u32(direction.min(2) + 1);
                let regs = self.regs(it.id(1)?)?;
                let op = SubgroupOp::QuadSwap;
                let moved = regs
                    .iter()
                    .map(|reg| self.builder.subgroup(op, Some(*reg), Some(across)))
                    .collect();
                self.define(it, moved)
            }
            Op::GroupNonUniformBallot | Op::SubgroupBallotKHR => {
                let value = self.reg(it.id(first)?)?;
                let words = self.builder.ballot(value);
                self.define(it, words.to_vec())
            }
            Op::GroupNonUniformInverseBallot => {
                let words = self.ballot_operand(it, 1)?;
                let lane = self.subgroup_lane();
                let bit = self.ballot_bit(&words, lane);
                self.define(it, vec![bit])
            }
            Op::GroupNonUniformBallotBitExtract => {
                let words = self.ballot_operand(it, 1)?;
                let index = self.reg(it.id(2)?)?;
                let bit = self.ballot_bit(&words, index);
                self.define(it, vec![bit])
            }
            Op::GroupNonUniformBallotBitCount => self.ballot_count(it),
            Op::GroupNonUniformBallotFindLSB | Op::GroupNonUniformBallotFindMSB => {
                self.ballot_find(it)
            }
            _ => self.group_arithmetic(it),
        }
    }

    fn vote(&mut self, it: &Instruction, op: SubgroupOp, operand: usize) -> Result<()> {
        let value = self.reg(it.id(operand)?)?;
        let reg = self.builder.subgroup(op, Some(value), None);
        self.define(it, vec![reg])
    }

    fn move_lanes(
        &mut self,
        it: &Instruction,
        op: SubgroupOp,
        value: usize,
        index: Option<usize>,
    ) -> Result<()> {
        let regs = self.regs(it.id(value)?)?;
        let index = match index {
            Some(index) => Some(self.reg(it.id(index)?)?),
            None => None,
        };
        let moved = regs
            .iter()
            .map(|reg| self.builder.subgroup(op, Some(*reg), index))
            .collect();
        self.define(it, moved)
    }

    fn ballot_operand(&mut self, it: &Instruction, index: usize) -> Result<[Reg; 4]> {
        match *self.regs(it.id(index)?)? {
            [a, b, c, d] => Ok([a, b, c, d]),
            _ => malformed("a ballot has four words"),
        }
    }

    /// Whether a bit of a ballot is set.
    fn ballot_bit(&mut self, words: &[Reg; 4], index: Reg) -> Reg {
        let (five, one, zero) = (self.u32(5), self.u32(1), self.u32(0));
        let which = self.op(Ir::UShr, &[index, five]);
        let mut word = words[0];
        for (number, candidate) in (1..).zip(&words[1..]) {
            let number = self.u32(number);
            let this = self.op(Ir::IEq, &[which, number]);
            word = self.select(this, *candidate, word);
        }
        let shifted = self.op(Ir::UShr, &[word, index]);
        let bit = self.op(Ir::And, &[shifted, one]);
        self.op(Ir::INe, &[bit, zero])
    }

    /// A ballot's words without the bits above the subgroup's.
    fn ballot_of_subgroup(&mut self, it: &Instruction, index: usize) -> Result<[Reg; 4]> {
        let mut words = self.ballot_operand(it, index)?;
        for (first, word) in (0..).step_by(32).zip(&mut words) {
            let bits = self.options.subgroup_size.saturating_sub(first).min(32);
            if bits < 32 {
                let mask = self.u32((1 << bits) - 1);
                *word = self.op(Ir::And, &[*word, mask]);
            }
        }
        Ok(words)
    }

    fn ballot_count(&mut self, it: &Instruction) -> Result<()> {
        let Some(group) = it.enumerant(1, GroupOperation::from_u32) else {
            return malformed("there is no group operation");
        };
        let words = self.ballot_of_subgroup(it, 2)?;
        let mut sum = self.u32(0);
        for (index, word) in (0..).zip(words) {
            let mask = match group {
                GroupOperation::Reduce => None,
                GroupOperation::InclusiveScan => Some(spirv::BuiltIn::SubgroupLeMask),
                GroupOperation::ExclusiveScan => Some(spirv::BuiltIn::SubgroupLtMask),
                _ => return unsupported("this group operation"),
            };
            let word = match mask {
                Some(mask) => {
                    let mask = self.lane_mask(mask, index);
                    self.op(Ir::And, &[word, mask])
                }
                None => word,
            };
            let count = self.op(Ir::BitCount, &[word]);
            sum = self.op(Ir::IAdd, &[sum, count]);
        }
        self.define(it, vec![sum])
    }

    fn ballot_find(&mut self, it: &Instruction) -> Result<()> {
        let lowest = it.opcode == Op::GroupNonUniformBallotFindLSB;
        let words = self.ballot_of_subgroup(it, 1)?;
        let zero = self.u32(0);
        let mut found = self.u32(u32::MAX);
        let order: [u32; 4] = if lowest { [3, 2, 1, 0] } else { [0, 1, 2, 3] };
        for index in order {
            let word = words[index as usize];
            let find = if lowest { Ir::FindLsb } else { Ir::FindUMsb };
            let bit = self.op(find, &[word]);
            let first = self.u32(32 * index);
            let bit = self.op(Ir::IAdd, &[bit, first]);
            let any = self.op(Ir::INe, &[word, zero]);
            found = self.select(any, bit, found);
        }
        self.define(it, vec![found])
    }

    /// Reductions and scans.
    fn group_arithmetic(&mut self, it: &Instruction) -> Result<()> {
        let (scalar, regs) = self.vector(it.id(2)?)?;
        let Some(op) = group_op(it.opcode, scalar).filter(|op| is_reducible(*op)) else {
            return unsupported(format!("Op{:?}", it.opcode));
        };
        let Some(group) = it.enumerant(1, GroupOperation::from_u32) else {
            return malformed("there is no group operation");
        };
        let operation = match group {
            GroupOperation::Reduce => SubgroupOp::Reduce {
                op,
                cluster: self.options.subgroup_size,
            },
            GroupOperation::InclusiveScan => SubgroupOp::InclusiveScan(op),
            GroupOperation::ExclusiveScan => SubgroupOp::ExclusiveScan(op),
            GroupOperation::ClusteredReduce => SubgroupOp::Reduce {
                op,
                cluster: match self.literal(it.id(3)?)? {
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
                    (true, _) => self.sign_extend(scalar, *reg),
                    (_, true) => self.zero_extend(scalar, *reg),
                    _ => *reg,
                };
                let reg = self.builder.subgroup(operation, Some(reg), None);
                let reg = if signed {
                    self.clamped(scalar, op, reg)
                } else {
                    reg
                };
                self.wrap_to_width(scalar, reg)
            })
            .collect();
        self.define(it, reduced)
    }
}

impl Translator<'_> {
    /// The least or greatest of no narrow integers: what 32 bits have for it, brought to the type's range.
    fn clamped(&mut self, scalar: Scalar, op: Ir, reg: Reg) -> Reg {
        let Scalar::Int {
            width: width @ (8 | 16),
            ..
        } = scalar
        else {
            return reg;
        };
        let most = (1 << (width - 1)) - 1;
        let limit = self.u32(if op == Ir::SMin { most } else { !most });
        self.op(op, &[reg, limit])
    }
}

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
