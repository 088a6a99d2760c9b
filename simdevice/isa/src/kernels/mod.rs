//! Kernels: the functions that compute operations on registers, compiled for every SIMD level.

pub mod arithmetic;
mod elementary;
pub mod registers;

use std::cell::Cell;

use devmem::dispatch;
use fearless_simd::Level;

use crate::ir::op::Op;
use crate::ir::{AtomicOp, Format, Type};
use registers::{RegisterFile, RegisterSlot, Vector};

/// The result of an operation on constants, computed with the kernels that programs run.
pub fn evaluate(level: Level, op: Op, operands: &[u64]) -> u64 {
    let signature = op.signature();
    let place = |index: usize| RegisterSlot::uniform(2 * index);
    let vectors: [Cell<Vector>; 10] = Default::default();
    let file = RegisterFile::new(&vectors, 1);
    let mut src = [RegisterSlot::ZERO; 4];
    for (index, (bits, ty)) in operands.iter().zip(signature.operands).enumerate() {
        src[index] = place(index + 1);
        file.set_constant(src[index], *ty, *bits);
    }
    dispatch!(level, simd => arithmetic::kernel(op)(simd, &file, place(0), &src));
    match signature.result_type {
        Type::Bool => u64::from(file.first::<bool>(place(0))),
        Type::B32 => u64::from(file.first::<u32>(place(0))),
        Type::B64 => file.first(place(0)),
    }
}

/// The new value of an atomic operation.
pub fn combine(op: AtomicOp, format: Format, old: u64, value: u64, comparator: u64) -> u64 {
    if format == Format::B64 {
        let (signed_old, signed) = (old.cast_signed(), value.cast_signed());
        let (float_old, float) = (f64::from_bits(old), f64::from_bits(value));
        return match op {
            AtomicOp::IAdd => old.wrapping_add(value),
            AtomicOp::SMin => signed_old.min(signed).cast_unsigned(),
            AtomicOp::SMax => signed_old.max(signed).cast_unsigned(),
            AtomicOp::UMin => old.min(value),
            AtomicOp::UMax => old.max(value),
            AtomicOp::And => old & value,
            AtomicOp::Or => old | value,
            AtomicOp::Xor => old ^ value,
            AtomicOp::Exchange => value,
            AtomicOp::CompareExchange => {
                if old == comparator {
                    value
                } else {
                    old
                }
            }
            AtomicOp::FAdd => (float_old + float).to_bits(),
            AtomicOp::FMin => float_old.min(float).to_bits(),
            AtomicOp::FMax => float_old.max(float).to_bits(),
        };
    }
    let (old, value) = (old as u32, value as u32);
    let (signed_old, signed) = (old.cast_signed(), value.cast_signed());
    let (float_old, float) = (f32::from_bits(old), f32::from_bits(value));
    u64::from(match op {
        AtomicOp::IAdd => old.wrapping_add(value),
        AtomicOp::SMin => signed_old.min(signed).cast_unsigned(),
        AtomicOp::SMax => signed_old.max(signed).cast_unsigned(),
        AtomicOp::UMin => old.min(value),
        AtomicOp::UMax => old.max(value),
        AtomicOp::And => old & value,
        AtomicOp::Or => old | value,
        AtomicOp::Xor => old ^ value,
        AtomicOp::Exchange => value,
        AtomicOp::CompareExchange => {
            if old == comparator as u32 {
                value
            } else {
                old
            }
        }
        AtomicOp::FAdd => (float_old + float).to_bits(),
        AtomicOp::FMin => float_old.min(float).to_bits(),
        AtomicOp::FMax => float_old.max(float).to_bits(),
    })
}
