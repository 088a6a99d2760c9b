//! The register file: chunks of 16 lanes, and views of them as vectors and as typed lanes.

use std::cell::Cell;
use std::ops::Range;

use fearless_simd::{Simd, i32x16, mask32x16, prelude::*, u32x16};

use crate::ir::{CHUNK_LANES, Type};

/// 16 lanes of 32 bits; 64-bit registers use two for 16 lanes, the lower eight lanes first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C, align(64))]
pub struct Chunk(pub [u32; CHUNK_LANES]);

/// Where a register lives: its first chunk, and whether it has one for each 16 lanes or one for all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slot(u32);

impl Slot {
    const VARYING: u32 = 1 << 31;

    /// The register that is always zero; it stands for operands that aren't there.
    pub const ZERO: Self = Self(0);

    /// A register with one value for the whole batch.
    pub fn uniform(start: usize) -> Self {
        Self(start as u32)
    }

    /// A register with a value for each lane.
    pub fn varying(start: usize) -> Self {
        Self(start as u32 | Self::VARYING)
    }

    /// Whether it has a value for each lane.
    pub fn is_varying(self) -> bool {
        self.0 & Self::VARYING != 0
    }

    /// Its first chunk.
    pub fn start(self) -> usize {
        (self.0 & !Self::VARYING) as usize
    }
}

/// All registers of a batch.
#[derive(Clone, Copy)]
pub struct File<'a> {
    chunks: &'a [Cell<Chunk>],
    /// Chunks of a varying 32-bit register: lanes / 16.
    width: usize,
    /// The chunks that instructions compute.
    span: Span,
}

/// Chunks from the first to the last that has active lanes. The others are skipped: nobody looks at what an instruction
/// gives in lanes that are not active, except within their own chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    pub first: usize,
    pub count: usize,
}

impl<'a> File<'a> {
    pub fn new(chunks: &'a [Cell<Chunk>], width: usize) -> Self {
        let span = Span {
            first: 0,
            count: width,
        };
        Self {
            chunks,
            width,
            span,
        }
    }

    /// The same registers, of which other chunks shall be computed.
    #[inline(always)]
    pub fn with_span(self, span: Span) -> Self {
        Self { span, ..self }
    }

    /// The chunks to compute.
    #[inline(always)]
    pub fn span(self) -> Range<usize> {
        self.span.first..self.span.first + self.span.count
    }

    /// The chunks of a 32-bit register that are to be computed: the span's, or the only one.
    #[inline(always)]
    fn spanned(self, slot: Slot) -> &'a [Cell<Chunk>] {
        if slot.is_varying() {
            &self.chunks[slot.start() + self.span.first..][..self.span.count]
        } else {
            &self.chunks[slot.start()..][..1]
        }
    }

    /// The chunks to be computed of a register: the span, or the first if it is uniform.
    #[inline(always)]
    pub fn rounds(self, dst: Slot) -> Range<usize> {
        if dst.is_varying() { self.span() } else { 0..1 }
    }

    /// Chunks of a varying 32-bit register.
    #[inline(always)]
    pub fn width(self) -> usize {
        self.width
    }

    /// The chunks of a 32-bit register or bool: `width` of them, or one.
    #[inline(always)]
    pub fn narrow(self, slot: Slot) -> &'a [Cell<Chunk>] {
        let count = if slot.is_varying() { self.width } else { 1 };
        &self.chunks[slot.start()..][..count]
    }

    /// The chunks of a 64-bit register.
    #[inline(always)]
    pub fn wide(self, slot: Slot) -> &'a [Cell<Chunk>] {
        let count = if slot.is_varying() { 2 * self.width } else { 2 };
        &self.chunks[slot.start()..][..count]
    }

    /// The lanes of a register for 16 lanes of the batch.
    #[inline(always)]
    pub fn lanes<T: Lane>(self, slot: Slot, index: usize) -> [T; CHUNK_LANES] {
        let chunks = T::chunks(self, slot);
        T::load(chunks, if slot.is_varying() { index } else { 0 })
    }

    /// The value of a uniform register (or lane 0).
    #[inline(always)]
    pub fn first<T: Lane>(self, slot: Slot) -> T {
        T::load(T::chunks(self, slot), 0)[0]
    }

    /// Sets a register for 16 lanes of the batch.
    #[inline(always)]
    pub fn set<T: Lane>(self, slot: Slot, index: usize, value: [T; CHUNK_LANES]) {
        T::store(
            T::chunks(self, slot),
            if slot.is_varying() { index } else { 0 },
            value,
        );
    }

    /// Sets a uniform register to a constant's bits.
    pub fn set_constant(self, slot: Slot, ty: Type, bits: u64) {
        match ty {
            Type::Bool => self.set(slot, 0, [bits != 0; CHUNK_LANES]),
            Type::B32 => self.set(slot, 0, [bits as u32; CHUNK_LANES]),
            Type::B64 => self.set(slot, 0, [bits; CHUNK_LANES]),
        }
    }
}

/// `dst = op(src...)` in the lanes that a file spans.
pub type Kernel<S> = fn(S, &File<'_>, Slot, &[Slot; 4]);

/// A type that a register's lanes may be read as.
pub trait Lane: Copy + Default {
    /// The chunks of a register of this type's width.
    fn chunks<'a>(file: File<'a>, slot: Slot) -> &'a [Cell<Chunk>];
    /// Lanes 16 `index`..
    fn load(chunks: &[Cell<Chunk>], index: usize) -> [Self; CHUNK_LANES];
    /// Sets lanes 16 `index`..
    fn store(chunks: &[Cell<Chunk>], index: usize, value: [Self; CHUNK_LANES]);
}

/// `f` of each lane. (The standard library's `map` is not always inlined.)
#[inline(always)]
pub fn each_lane<A: Copy, B: Copy + Default>(
    lanes: [A; CHUNK_LANES],
    f: impl Fn(A) -> B,
) -> [B; CHUNK_LANES] {
    let mut results = [B::default(); CHUNK_LANES];
    for lane in 0..CHUNK_LANES {
        results[lane] = f(lanes[lane]);
    }
    results
}

macro_rules! narrow_lane {
    ($type:ty, $from:expr, $to:expr) => {
        impl Lane for $type {
            #[inline(always)]
            fn chunks<'a>(file: File<'a>, slot: Slot) -> &'a [Cell<Chunk>] {
                file.narrow(slot)
            }

            #[inline(always)]
            fn load(chunks: &[Cell<Chunk>], index: usize) -> [Self; CHUNK_LANES] {
                each_lane(chunks[index].get().0, $from)
            }

            #[inline(always)]
            fn store(chunks: &[Cell<Chunk>], index: usize, value: [Self; CHUNK_LANES]) {
                chunks[index].set(Chunk(each_lane(value, $to)));
            }
        }
    };
}

narrow_lane!(u32, |bits| bits, |value| value);
narrow_lane!(i32, |bits: u32| bits.cast_signed(), |value: i32| value
    .cast_unsigned());
narrow_lane!(f32, f32::from_bits, f32::to_bits);
narrow_lane!(bool, |bits| bits != 0, |value| if value {
    u32::MAX
} else {
    0
});

macro_rules! wide_lane {
    ($type:ty, $from:expr, $to:expr) => {
        impl Lane for $type {
            #[inline(always)]
            fn chunks<'a>(file: File<'a>, slot: Slot) -> &'a [Cell<Chunk>] {
                file.wide(slot)
            }

            #[inline(always)]
            fn load(chunks: &[Cell<Chunk>], index: usize) -> [Self; CHUNK_LANES] {
                let halves: [[u64; CHUNK_LANES / 2]; 2] = [
                    bytemuck::cast(chunks[2 * index].get().0),
                    bytemuck::cast(chunks[2 * index + 1].get().0),
                ];
                each_lane(bytemuck::cast::<_, [u64; CHUNK_LANES]>(halves), $from)
            }

            #[inline(always)]
            fn store(chunks: &[Cell<Chunk>], index: usize, value: [Self; CHUNK_LANES]) {
                let words: [[u32; CHUNK_LANES]; 2] = bytemuck::cast(each_lane(value, $to));
                chunks[2 * index].set(Chunk(words[0]));
                chunks[2 * index + 1].set(Chunk(words[1]));
            }
        }
    };
}

wide_lane!(u64, |bits| bits, |value| value);
wide_lane!(i64, |bits: u64| bits.cast_signed(), |value: i64| value
    .cast_unsigned());
wide_lane!(f64, f64::from_bits, f64::to_bits);

/// Lane by lane, one operand.
#[inline(always)]
pub fn map1<A: Lane, R: Lane>(file: File<'_>, dst: Slot, src: &[Slot; 4], f: impl Fn(A) -> R) {
    for index in file.rounds(dst) {
        file.set(dst, index, each_lane(file.lanes(src[0], index), &f));
    }
}

/// Lane by lane, two operands.
#[inline(always)]
pub fn map2<A: Lane, B: Lane, R: Lane>(
    file: File<'_>,
    dst: Slot,
    src: &[Slot; 4],
    f: impl Fn(A, B) -> R,
) {
    for index in file.rounds(dst) {
        let (a, b) = (file.lanes(src[0], index), file.lanes(src[1], index));
        let mut results = [R::default(); CHUNK_LANES];
        for lane in 0..CHUNK_LANES {
            results[lane] = f(a[lane], b[lane]);
        }
        file.set(dst, index, results);
    }
}

/// Lane by lane, three operands.
#[inline(always)]
pub fn map3<A: Lane, B: Lane, C: Lane, R: Lane>(
    file: File<'_>,
    dst: Slot,
    src: &[Slot; 4],
    f: impl Fn(A, B, C) -> R,
) {
    for index in file.rounds(dst) {
        let (a, b) = (file.lanes(src[0], index), file.lanes(src[1], index));
        let c = file.lanes(src[2], index);
        let mut results = [R::default(); CHUNK_LANES];
        for lane in 0..CHUNK_LANES {
            results[lane] = f(a[lane], b[lane], c[lane]);
        }
        file.set(dst, index, results);
    }
}

/// A chunk as a vector.
#[inline(always)]
pub fn load_vector<S: Simd>(simd: S, chunk: &Cell<Chunk>) -> u32x16<S> {
    u32x16::simd_from(simd, chunk.get().0)
}

/// A vector to a chunk.
#[inline(always)]
pub fn store_vector<S: Simd>(chunk: &Cell<Chunk>, value: u32x16<S>) {
    chunk.set(Chunk(value.into()));
}

/// A bool register's chunk as a mask.
#[inline(always)]
pub fn to_mask<S: Simd>(value: u32x16<S>) -> mask32x16<S> {
    value
        .simd
        .from_vector_mask32x16(value.bitcast::<i32x16<S>>())
}

/// A mask as a bool register's chunk.
#[inline(always)]
pub fn from_mask<S: Simd>(mask: mask32x16<S>) -> u32x16<S> {
    ExtractToken::token(&mask)
        .to_vector_mask32x16(mask)
        .bitcast::<u32x16<S>>()
}

// The loops below are over indices, because the standard library's adapters are not always inlined into functions of
// another SIMD level.

/// `value` to all chunks.
#[inline(always)]
fn fill<S: Simd>(dst: &[Cell<Chunk>], value: u32x16<S>) {
    for chunk in dst {
        store_vector(chunk, value);
    }
}

/// Vector by vector, one operand.
#[inline(always)]
pub fn vector1<S: Simd>(
    simd: S,
    file: File<'_>,
    dst: Slot,
    src: &[Slot; 4],
    f: impl Fn(u32x16<S>) -> u32x16<S>,
) {
    let (dst, a) = (file.spanned(dst), file.spanned(src[0]));
    let n = dst.len();
    if a.len() == n {
        for i in 0..n {
            store_vector(&dst[i], f(load_vector(simd, &a[i])));
        }
    } else {
        fill(dst, f(load_vector(simd, &a[0])));
    }
}

/// Vector by vector, two operands.
#[inline(always)]
pub fn vector2<S: Simd>(
    simd: S,
    file: File<'_>,
    dst: Slot,
    src: &[Slot; 4],
    f: impl Fn(u32x16<S>, u32x16<S>) -> u32x16<S>,
) {
    let dst = file.spanned(dst);
    let (a, b) = (file.spanned(src[0]), file.spanned(src[1]));
    let n = dst.len();
    if a.len() == n && b.len() == n {
        for i in 0..n {
            store_vector(
                &dst[i],
                f(load_vector(simd, &a[i]), load_vector(simd, &b[i])),
            );
        }
    } else if a.len() == n {
        let b = load_vector(simd, &b[0]);
        for i in 0..n {
            store_vector(&dst[i], f(load_vector(simd, &a[i]), b));
        }
    } else if b.len() == n {
        let a = load_vector(simd, &a[0]);
        for i in 0..n {
            store_vector(&dst[i], f(a, load_vector(simd, &b[i])));
        }
    } else {
        fill(dst, f(load_vector(simd, &a[0]), load_vector(simd, &b[0])));
    }
}

/// Vector by vector, three operands. Only the commonest case has a loop without checks.
#[inline(always)]
pub fn vector3<S: Simd>(
    simd: S,
    file: File<'_>,
    dst: Slot,
    src: &[Slot; 4],
    f: impl Fn(u32x16<S>, u32x16<S>, u32x16<S>) -> u32x16<S>,
) {
    let dst = file.spanned(dst);
    let (a, b) = (file.spanned(src[0]), file.spanned(src[1]));
    let c = file.spanned(src[2]);
    let n = dst.len();
    if a.len() == n && b.len() == n && c.len() == n {
        for i in 0..n {
            let (a, b) = (load_vector(simd, &a[i]), load_vector(simd, &b[i]));
            store_vector(&dst[i], f(a, b, load_vector(simd, &c[i])));
        }
        return;
    }
    // A uniform operand has one chunk for all rounds.
    let step = |operand: &[Cell<Chunk>]| if operand.len() == n { usize::MAX } else { 0 };
    let (at_a, at_b, at_c) = (step(a), step(b), step(c));
    for i in 0..n {
        let (a, b) = (
            load_vector(simd, &a[i & at_a]),
            load_vector(simd, &b[i & at_b]),
        );
        store_vector(&dst[i], f(a, b, load_vector(simd, &c[i & at_c])));
    }
}
