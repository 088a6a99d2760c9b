//! The state of a batch while it runs.

use std::cell::Cell;
use std::sync::atomic::AtomicU32;

use fearless_simd::{Simd, prelude::*};

use super::masks::{Masks, bits_to_mask};
use crate::compiler::CompiledProgram;
use crate::compiler::step::MaskId;
use crate::ir::{Reg, Space, Type, VECTOR_LANES};
use crate::kernels::registers::{RegisterFile, RegisterSlot, Span, Vector, load_vector, store_vector};
use crate::resources::Resources;

/// The state that a batch's steps work on.
#[derive(Clone, Copy)]
pub struct Batch<'a> {
    pub program: &'a CompiledProgram,
    pub resources: &'a Resources<'a>,
    pub file: RegisterFile<'a>,
    pub masks: Masks<'a>,
    /// The memory of each workgroup, one after the other.
    pub shared: &'a [AtomicU32],
    /// True if all lanes that the batch began with are active in the vectors that the file spans.
    pub whole: bool,
    /// Private memory: a row of vectors for each word.
    pub private: &'a [Cell<Vector>],
}

impl<'a> Batch<'a> {
    /// The place of a register in the register file.
    #[inline(always)]
    pub fn slot(&self, reg: Reg) -> RegisterSlot {
        self.program.slots[reg.0 as usize]
    }

    /// Calls `access` once for each memory that lanes of the batch reach at the same address: with each workgroup for
    /// workgroup memory, otherwise with the whole batch.
    #[inline(always)]
    pub fn for_each_memory(&self, space: &Space, access: impl Fn(&Self)) {
        if *space == Space::Shared && self.program.has_several_workgroups() {
            self.workgroups().for_each(|part| access(&part));
        } else {
            access(self);
        }
    }

    /// The parts of the batch that belong to one workgroup each, with its memory.
    fn workgroups(&self) -> impl Iterator<Item = Self> {
        let batch = *self;
        let vectors = batch.program.workgroup / VECTOR_LANES;
        let words = batch.program.shared_words();
        let span = batch.file.span();
        (span.start / vectors..span.end.div_ceil(vectors)).map(move |group| {
            let first = span.start.max(vectors * group);
            let end = span.end.min(vectors * (group + 1));
            let file = batch.file.with_span(Span { first, count: end - first });
            Self { file, shared: &batch.shared[words * group..][..words], ..batch }
        })
    }

    /// Recomputes the span of vectors that have active lanes, after the masks have changed.
    #[inline(always)]
    pub fn refresh_span(&mut self) {
        let (span, whole) = self.masks.span();
        self.file = self.file.with_span(span);
        self.whole = whole;
    }

    /// `dst = src` in the active lanes; in all, if `dst` is uniform.
    #[inline(always)]
    pub fn assign<S: Simd>(&self, simd: S, dst: RegisterSlot, src: RegisterSlot, ty: Type) {
        let uniform = !dst.is_varying();
        if self.whole && !uniform {
            return self.copy(dst, src, ty);
        }
        let (dst, src, per_16) = match ty {
            Type::B64 => (self.file.wide(dst), self.file.wide(src), 2),
            Type::B32 | Type::Bool => (self.file.narrow(dst), self.file.narrow(src), 1),
        };
        if uniform {
            dst.iter().zip(src).for_each(|(dst, src)| dst.set(src.get()));
            return;
        }
        // A uniform source has one vector (or pair) for all.
        let step = usize::from(src.len() == dst.len());
        for vector in self.file.span() {
            let active = self.masks.bits(MaskId::ACTIVE, vector);
            for part in 0..per_16 {
                let to = &dst[vector * per_16 + part];
                let new = load_vector(simd, &src[vector * per_16 * step + part]);
                let merged = if active == u16::MAX {
                    new
                } else if per_16 == 1 {
                    bits_to_mask(simd, active).select(new, load_vector(simd, to))
                } else {
                    bits_to_mask(simd, double(active >> (8 * part))).select(new, load_vector(simd, to))
                };
                store_vector(to, merged);
            }
        }
    }

    /// `dst = src` in all lanes.
    #[inline(always)]
    pub fn copy(&self, dst: RegisterSlot, src: RegisterSlot, ty: Type) {
        match ty {
            Type::B64 => self.copy_vectors(dst, self.file.wide(dst), self.file.wide(src), 2),
            Type::B32 | Type::Bool => {
                self.copy_vectors(dst, self.file.narrow(dst), self.file.narrow(src), 1);
            }
        }
    }

    /// Copies the vectors of a register that are computed; a uniform source has only the first `per_16`.
    #[inline(always)]
    fn copy_vectors(&self, slot: RegisterSlot, dst: &[Cell<Vector>], src: &[Cell<Vector>], per_16: usize) {
        let step = usize::from(src.len() == dst.len());
        for vector in self.file.rounds(slot) {
            for part in 0..per_16 {
                dst[vector * per_16 + part].set(src[vector * per_16 * step + part].get());
            }
        }
    }
}

/// Each of the low eight bits twice: masks of 64-bit lanes as masks of their halves.
#[inline(always)]
fn double(bits: u16) -> u16 {
    let mut spread = bits & 0xff;
    spread = (spread | spread << 4) & 0x0f0f;
    spread = (spread | spread << 2) & 0x3333;
    spread = (spread | spread << 1) & 0x5555;
    spread | spread << 1
}
