//! Which instruction is translated where.

use isa::ir::Axis;
use spirv::{Op, StorageClass};

use super::super::error::{Result, unsupported};
use super::super::instruction::Instruction;
use super::super::module::ExtendedSet;
use super::access::Pointer;
use super::{Translator, Value};

impl Translator<'_> {
    /// Translates an instruction within a block that is neither a phi nor a terminator.
    pub fn instruction(&mut self, it: &Instruction) -> Result<()> {
        match it.opcode {
            Op::Nop => Ok(()),
            Op::Undef => {
                let scalars = self.globals.types.flatten(it.ty()?)?;
                self.charge_budget(scalars.len())?;
                let zeros = scalars
                    .iter()
                    .map(|it| self.constant(it.register(), 0))
                    .collect();
                self.define(it, zeros)
            }
            Op::Variable => self.local_variable(it),
            Op::Load => self.load(it),
            Op::Store => self.store(it),
            Op::CopyMemory => self.copy_memory(it),
            Op::AccessChain
            | Op::InBoundsAccessChain
            | Op::PtrAccessChain
            | Op::InBoundsPtrAccessChain => self.access_chain(it),
            Op::ArrayLength => self.array_length(it),
            Op::FunctionCall => self.call(it),
            Op::ExtInst => self.extended(it),
            Op::CopyObject => {
                let value = self.value(it.id(0)?)?;
                match value {
                    Value::Regs(regs) => self.define(it, regs.to_vec()),
                    other => self.define_as(it, other),
                }
            }
            Op::VectorExtractDynamic
            | Op::VectorInsertDynamic
            | Op::VectorShuffle
            | Op::CompositeConstruct
            | Op::CompositeExtract
            | Op::CompositeInsert
            | Op::CopyLogical
            | Op::Transpose => self.composite(it),
            Op::VectorTimesScalar
            | Op::MatrixTimesScalar
            | Op::VectorTimesMatrix
            | Op::MatrixTimesVector
            | Op::MatrixTimesMatrix
            | Op::OuterProduct
            | Op::Dot => self.linear_algebra(it),
            Op::ConvertFToU
            | Op::ConvertFToS
            | Op::ConvertSToF
            | Op::ConvertUToF
            | Op::UConvert
            | Op::SConvert
            | Op::FConvert
            | Op::QuantizeToF16
            | Op::Bitcast
            | Op::ConvertPtrToU
            | Op::ConvertUToPtr => self.conversion(it),
            Op::DPdx | Op::DPdxCoarse => self.derivative(it, &[Axis::X], false),
            Op::DPdxFine => self.derivative(it, &[Axis::X], true),
            Op::DPdy | Op::DPdyCoarse => self.derivative(it, &[Axis::Y], false),
            Op::DPdyFine => self.derivative(it, &[Axis::Y], true),
            Op::Fwidth | Op::FwidthCoarse => self.derivative(it, &[Axis::X, Axis::Y], false),
            Op::FwidthFine => self.derivative(it, &[Axis::X, Axis::Y], true),
            Op::ControlBarrier => {
                self.builder.barrier();
                Ok(())
            }
            // Each instruction ends for all lanes before the next begins.
            Op::MemoryBarrier => Ok(()),
            Op::DemoteToHelperInvocation => {
                self.interface.discards = true;
                self.builder.demote();
                Ok(())
            }
            Op::IsHelperInvocationEXT => {
                let helper = self.builder.is_helper();
                self.define(it, vec![helper])
            }
            Op::AtomicLoad
            | Op::AtomicStore
            | Op::AtomicExchange
            | Op::AtomicCompareExchange
            | Op::AtomicIIncrement
            | Op::AtomicIDecrement
            | Op::AtomicIAdd
            | Op::AtomicISub
            | Op::AtomicSMin
            | Op::AtomicUMin
            | Op::AtomicSMax
            | Op::AtomicUMax
            | Op::AtomicAnd
            | Op::AtomicOr
            | Op::AtomicXor
            | Op::AtomicFAddEXT
            | Op::AtomicFMinEXT
            | Op::AtomicFMaxEXT => self.atomic(it),
            op if is_image(op) => self.image(it),
            op if is_subgroup(op) => self.subgroup(it),
            _ => self.arithmetic(it),
        }
    }

    fn local_variable(&mut self, it: &Instruction) -> Result<()> {
        let id = it.result()?;
        let (class, pointee) = self.globals.types.pointer(it.ty()?)?;
        if class != StorageClass::Function {
            return unsupported(format!(
                "a variable of storage class {class:?} in a function"
            ));
        }
        self.slot_of.remove(&id);
        let pointer = if self.analysis.in_memory.contains(&id) {
            self.private_variable(id, pointee)?
        } else {
            let slot = self.new_slot(pointee, None)?;
            self.slot_of.insert(id, slot);
            Pointer::PromotedVariable {
                slot,
                start: 0,
                steps: Vec::new(),
                ty: pointee,
            }
        };
        if let Ok(initializer) = it.id(1) {
            let regs = self.regs(initializer)?;
            self.store_to(&pointer, &regs)?;
        }
        self.define_as(it, Value::Pointer(pointer.into()))
    }

    fn extended(&mut self, it: &Instruction) -> Result<()> {
        match self.module.extended_sets.get(&it.id(0)?) {
            Some(ExtendedSet::Glsl) => self.glsl(it),
            Some(ExtendedSet::NonSemantic) => Ok(()),
            _ => unsupported("an unknown set of extended instructions"),
        }
    }
}

fn is_image(op: Op) -> bool {
    use Op::*;
    matches!(
        op,
        SampledImage
            | Image
            | ImageTexelPointer
            | ImageSampleImplicitLod
            | ImageSampleExplicitLod
            | ImageSampleDrefImplicitLod
            | ImageSampleDrefExplicitLod
            | ImageSampleProjImplicitLod
            | ImageSampleProjExplicitLod
            | ImageSampleProjDrefImplicitLod
            | ImageSampleProjDrefExplicitLod
            | ImageFetch
            | ImageGather
            | ImageDrefGather
            | ImageRead
            | ImageWrite
            | ImageQuerySizeLod
            | ImageQuerySize
            | ImageQueryLod
            | ImageQueryLevels
            | ImageQuerySamples
    )
}

fn is_subgroup(op: Op) -> bool {
    let number = op as u32;
    let core = Op::GroupNonUniformElect as u32..=Op::GroupNonUniformQuadSwap as u32;
    core.contains(&number)
        || matches!(
            op,
            Op::SubgroupBallotKHR
                | Op::SubgroupFirstInvocationKHR
                | Op::SubgroupAllKHR
                | Op::SubgroupAnyKHR
                | Op::SubgroupAllEqualKHR
                | Op::SubgroupReadInvocationKHR
        )
}
