//! The dispatch of instructions to the functions that translate them.

use isa::ir::Axis;
use isa::op::Op as Ir;
use spirv::Op;

use super::atomic::atomic;
use super::composite::{composite, linear_algebra};
use super::elementwise::{conversion, derivative, elementwise};
use super::glsl::glsl;
use super::image::image;
use super::integer_dot::integer_dot;
use super::memory::{copy_memory, load, store};
use super::pointer::{access_chain, array_length};
use super::pointer_value::compare_pointers;
use super::subgroup::subgroup;
use super::translator::Translator;
use super::value::Value;
use super::variables::local_variable;
use super::vertex_memory::{emit_stream_vertex, emit_vertex, end_primitive, end_stream_primitive};
use crate::error::{Result, unsupported};
use crate::instruction::Instruction;
use crate::module::ExtendedSet;

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
                | Op::GroupNonUniformRotateKHR
                | Op::GroupNonUniformQuadAllKHR
                | Op::GroupNonUniformQuadAnyKHR
        )
}

/// Translates an instruction within a block that is neither a phi nor a terminator.
pub fn translate(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    match instruction.opcode {
        Op::Nop => Ok(()),
        Op::Undef => {
            let undefined = t.undefined(instruction.ty()?)?;
            t.define_as(instruction, undefined)
        }
        Op::Variable => local_variable(t, instruction),
        Op::Load => load(t, instruction),
        Op::Store => store(t, instruction),
        Op::CopyMemory => copy_memory(t, instruction),
        Op::AccessChain | Op::InBoundsAccessChain | Op::PtrAccessChain | Op::InBoundsPtrAccessChain => {
            access_chain(t, instruction)
        }
        Op::ArrayLength => array_length(t, instruction),
        Op::PtrEqual | Op::PtrNotEqual | Op::PtrDiff => compare_pointers(t, instruction),
        Op::ExtInst | Op::ExtInstWithForwardRefsKHR => extended(t, instruction),
        // A promise of the program's, which nothing needs.
        Op::AssumeTrueKHR => Ok(()),
        // The value that is expected makes no difference.
        Op::CopyObject | Op::ExpectKHR => {
            let value = t.value(instruction.id(0)?)?;
            match value {
                Value::Regs(regs) => t.define(instruction, regs.to_vec()),
                other => t.define_as(instruction, other),
            }
        }
        Op::VectorExtractDynamic
        | Op::VectorInsertDynamic
        | Op::VectorShuffle
        | Op::CompositeConstruct
        | Op::CompositeConstructReplicateEXT
        | Op::CompositeExtract
        | Op::CompositeInsert
        | Op::CopyLogical
        | Op::Transpose => composite(t, instruction),
        Op::VectorTimesScalar
        | Op::MatrixTimesScalar
        | Op::VectorTimesMatrix
        | Op::MatrixTimesVector
        | Op::MatrixTimesMatrix
        | Op::OuterProduct
        | Op::Dot => linear_algebra(t, instruction),
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
        | Op::ConvertUToPtr => conversion(t, instruction),
        Op::DPdx | Op::DPdxCoarse => derivative(t, instruction, &[Axis::X], false),
        Op::DPdxFine => derivative(t, instruction, &[Axis::X], true),
        Op::DPdy | Op::DPdyCoarse => derivative(t, instruction, &[Axis::Y], false),
        Op::DPdyFine => derivative(t, instruction, &[Axis::Y], true),
        Op::Fwidth | Op::FwidthCoarse => derivative(t, instruction, &[Axis::X, Axis::Y], false),
        Op::FwidthFine => derivative(t, instruction, &[Axis::X, Axis::Y], true),
        Op::EmitVertex => emit_vertex(t, 0),
        Op::EndPrimitive => end_primitive(t, 0),
        Op::EmitStreamVertex => emit_stream_vertex(t, instruction),
        Op::EndStreamPrimitive => end_stream_primitive(t, instruction),
        Op::ControlBarrier => {
            t.emit.builder.barrier();
            Ok(())
        }
        // Each instruction ends for all lanes before the next begins.
        Op::MemoryBarrier => Ok(()),
        Op::DemoteToHelperInvocation => {
            t.interface.discards = true;
            t.emit.builder.demote();
            Ok(())
        }
        Op::IsHelperInvocationEXT => {
            let helper = t.emit.builder.is_helper();
            t.define(instruction, vec![helper])
        }
        Op::ReadClockKHR => read_clock(t, instruction),
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
        | Op::AtomicFMaxEXT => atomic(t, instruction),
        Op::SDot | Op::UDot | Op::SUDot | Op::SDotAccSat | Op::UDotAccSat | Op::SUDotAccSat => {
            integer_dot(t, instruction)
        }
        op if is_image(op) => image(t, instruction),
        op if is_subgroup(op) => subgroup(t, instruction),
        _ => elementwise(t, instruction),
    }
}

/// Reads the clock, which is the same for a subgroup and for the device, as a number of 64 bits or as its two words.
fn read_clock(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let time = t.emit.builder.clock();
    let (_, count) = t.globals.types.vector(instruction.ty()?)?;
    if count == 1 {
        return t.define(instruction, vec![time]);
    }
    let words = [Ir::Low32, Ir::High32].map(|word| t.emit.op(word, &[time]));
    t.define(instruction, words.to_vec())
}

fn extended(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    match t.module.extended_sets.get(&instruction.id(0)?) {
        Some(ExtendedSet::Glsl) => glsl(t, instruction),
        Some(ExtendedSet::NonSemantic) => Ok(()),
        _ => unsupported("an unknown set of extended instructions"),
    }
}
