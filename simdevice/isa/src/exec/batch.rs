//! A batch while it runs: what every step may reach.

use std::cell::Cell;
use std::sync::atomic::AtomicU32;

use fearless_simd::{Simd, prelude::*};

use super::super::ir::{Reg, Statement, Type};
use super::super::resources::Resources;
use super::Executable;
use super::file::{Chunk, File, Slot, load, store};
use super::mask::{MaskId, Masks};

/// What a batch's steps work on.
#[derive(Clone, Copy)]
pub struct Batch<'a> {
    pub executable: &'a Executable,
    pub resources: &'a Resources<'a>,
    pub file: File<'a>,
    pub masks: Masks<'a>,
    /// Workgroup memory.
    pub shared: &'a [AtomicU32],
    /// Whether all lanes that the batch began with are active, of those in the chunks that the file spans.
    pub whole: bool,
    /// Private memory: a row of chunks for each word.
    pub private: &'a [Cell<Chunk>],
}

impl Batch<'_> {
    /// Where a register lives.
    #[inline(always)]
    pub fn slot(&self, reg: Reg) -> Slot {
        self.executable.slots[reg.0 as usize]
    }

    /// Finds out which chunks have active lanes, after the masks have changed.
    #[inline(always)]
    pub fn look_at_masks(&mut self) {
        let (span, whole) = self.masks.span();
        self.file = self.file.with_span(span);
        self.whole = whole;
    }

    /// `dst = src` in the active lanes; in all, if `dst` is uniform.
    #[inline(always)]
    pub fn assign<S: Simd>(&self, simd: S, dst: Slot, src: Slot, ty: Type) {
        let uniform = !dst.is_varying();
        if self.whole && !uniform {
            return self.copy(dst, src, ty);
        }
        let (dst, src, per_16) = match ty {
            Type::B64 => (self.file.wide(dst), self.file.wide(src), 2),
            Type::B32 | Type::Bool => (self.file.narrow(dst), self.file.narrow(src), 1),
        };
        if uniform {
            dst.iter()
                .zip(src)
                .for_each(|(dst, src)| dst.set(src.get()));
            return;
        }
        // A uniform source has one chunk (or pair) for all.
        let step = usize::from(src.len() == dst.len());
        for chunk in self.file.span() {
            let active = self.masks.chunk(MaskId::ACTIVE, chunk);
            for part in 0..per_16 {
                let to = &dst[chunk * per_16 + part];
                let new = load(simd, &src[chunk * per_16 * step + part]);
                let merged = if active == u16::MAX {
                    new
                } else if per_16 == 1 {
                    bits_to_mask(simd, active).select(new, load(simd, to))
                } else {
                    bits_to_mask(simd, double(active >> (8 * part))).select(new, load(simd, to))
                };
                store(to, merged);
            }
        }
    }

    /// `dst = src` in all lanes.
    #[inline(always)]
    pub fn copy(&self, dst: Slot, src: Slot, ty: Type) {
        match ty {
            Type::B64 => self.copy_chunks(dst, self.file.wide(dst), self.file.wide(src), 2),
            Type::B32 | Type::Bool => {
                self.copy_chunks(dst, self.file.narrow(dst), self.file.narrow(src), 1);
            }
        }
    }

    /// Copies the chunks to compute of a register; a uniform source has only the first `per_16`.
    #[inline(always)]
    fn copy_chunks(&self, slot: Slot, dst: &[Cell<Chunk>], src: &[Cell<Chunk>], per_16: usize) {
        let step = usize::from(src.len() == dst.len());
        for chunk in self.file.rounds(slot) {
            for part in 0..per_16 {
                dst[chunk * per_16 + part].set(src[chunk * per_16 * step + part].get());
            }
        }
    }

    /// Runs a statement that reaches across lanes or out of the registers.
    pub fn other<S: Simd>(&self, simd: S, statement: &Statement) {
        match statement {
            Statement::LaneIndex { dst } => {
                for chunk in 0..self.file.width() {
                    let lanes: [u32; 16] = std::array::from_fn(|lane| (16 * chunk + lane) as u32);
                    self.file.set(self.slot(*dst), chunk, lanes);
                }
            }
            Statement::IsHelper { dst } => {
                for chunk in 0..self.file.width() {
                    let helpers = self.masks.chunk(MaskId::HELPER, chunk);
                    let lanes: [bool; 16] = std::array::from_fn(|lane| helpers >> lane & 1 != 0);
                    self.file.set(self.slot(*dst), chunk, lanes);
                }
            }
            Statement::Load {
                dst,
                address,
                format,
            } => self.load(simd, dst, address, *format),
            Statement::Store {
                src,
                address,
                format,
            } => self.store(simd, src, address, *format),
            Statement::Atomic {
                op,
                dst,
                address,
                format,
                value,
                comparator,
            } => {
                self.atomic(simd, *op, *dst, address, *format, *value, *comparator);
            }
            Statement::BufferSize { dst, buffer } => self.buffer_size(*dst, buffer),
            Statement::Sample(sample) => self.sample(sample),
            Statement::ImageRead(read) => self.image_read(read),
            Statement::ImageWrite(write) => self.image_write(write),
            Statement::ImageAtomic(atomic) => self.image_atomic(atomic),
            Statement::ImageQuery {
                dst,
                image,
                shape,
                query,
            } => self.image_query(dst, image, *shape, query),
            Statement::Derivative {
                dst,
                src,
                axis,
                fine,
            } => self.derivative(*dst, *src, *axis, *fine),
            Statement::Subgroup {
                op,
                dst,
                src,
                index,
            } => self.subgroup(*op, dst, *src, *index),
            // The rest is arithmetic or control flow, which has steps of its own.
            _ => {}
        }
    }
}

/// A mask vector from bits.
#[inline(always)]
pub fn bits_to_mask<S: Simd>(simd: S, bits: u16) -> fearless_simd::mask32x16<S> {
    simd.from_bitmask_mask32x16(u64::from(bits))
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
