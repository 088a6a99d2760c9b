//! The register file: chunks of 16 lanes, and views of them as vectors and as typed lanes.

use std::cell::Cell;

use fearless_simd::{Simd, i32x16, mask32x16, prelude::*, u32x16};

use super::super::ir::CHUNK_LANES;

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
}

impl<'a> File<'a> {
    pub fn new(chunks: &'a [Cell<Chunk>], width: usize) -> Self {
        Self { chunks, width }
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
}

/// A type that a register's lanes may be read as.
pub trait Lane: Copy {
    /// The chunks of a register of this type's width.
    fn chunks<'a>(file: File<'a>, slot: Slot) -> &'a [Cell<Chunk>];
    /// Lanes 16 `index`..
    fn load(chunks: &[Cell<Chunk>], index: usize) -> [Self; CHUNK_LANES];
    /// Sets lanes 16 `index`..
    fn store(chunks: &[Cell<Chunk>], index: usize, value: [Self; CHUNK_LANES]);
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
                chunks[index].get().0.map($from)
            }

            #[inline(always)]
            fn store(chunks: &[Cell<Chunk>], index: usize, value: [Self; CHUNK_LANES]) {
                chunks[index].set(Chunk(value.map($to)));
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
                bytemuck::cast::<_, [u64; CHUNK_LANES]>(halves).map($from)
            }

            #[inline(always)]
            fn store(chunks: &[Cell<Chunk>], index: usize, value: [Self; CHUNK_LANES]) {
                let words: [[u32; CHUNK_LANES]; 2] = bytemuck::cast(value.map($to));
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

/// How many times a lane-by-lane kernel runs for a destination: once if it is uniform.
#[inline(always)]
fn rounds(file: File<'_>, dst: Slot) -> usize {
    if dst.is_varying() { file.width } else { 1 }
}

/// Lane by lane, one operand.
#[inline(always)]
pub fn map1<A: Lane, R: Lane>(file: File<'_>, dst: Slot, src: &[Slot; 4], f: impl Fn(A) -> R) {
    for index in 0..rounds(file, dst) {
        file.set(dst, index, file.lanes(src[0], index).map(&f));
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
    for index in 0..rounds(file, dst) {
        let (a, b) = (file.lanes(src[0], index), file.lanes(src[1], index));
        file.set(dst, index, std::array::from_fn(|lane| f(a[lane], b[lane])));
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
    for index in 0..rounds(file, dst) {
        let (a, b) = (file.lanes(src[0], index), file.lanes(src[1], index));
        let c = file.lanes(src[2], index);
        file.set(
            dst,
            index,
            std::array::from_fn(|lane| f(a[lane], b[lane], c[lane])),
        );
    }
}

/// A chunk as a vector.
#[inline(always)]
pub fn load<S: Simd>(simd: S, chunk: &Cell<Chunk>) -> u32x16<S> {
    u32x16::simd_from(simd, chunk.get().0)
}

/// A vector to a chunk.
#[inline(always)]
pub fn store<S: Simd>(chunk: &Cell<Chunk>, value: u32x16<S>) {
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

/// The chunk of an operand for one round: its own if it is `VARYING`, else the only one.
#[inline(always)]
fn operand<const VARYING: bool>(chunks: &[Cell<Chunk>], index: usize) -> &Cell<Chunk> {
    if VARYING { &chunks[index] } else { &chunks[0] }
}

/// As many chunks as there are rounds, so that indices below that need no check.
#[inline(always)]
fn cut<const VARYING: bool>(chunks: &[Cell<Chunk>], rounds: usize) -> &[Cell<Chunk>] {
    if VARYING {
        &chunks[..rounds]
    } else {
        &chunks[..1]
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
    let (dst, a) = (file.narrow(dst), file.narrow(src[0]));
    if a.len() == dst.len() {
        for (dst, a) in dst.iter().zip(a) {
            store(dst, f(load(simd, a)));
        }
    } else {
        let value = f(load(simd, &a[0]));
        dst.iter().for_each(|dst| store(dst, value));
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
    let (dst, a, b) = (file.narrow(dst), file.narrow(src[0]), file.narrow(src[1]));
    match (a.len() == dst.len(), b.len() == dst.len()) {
        (true, true) => rounds2::<S, true, true>(simd, dst, a, b, f),
        (true, false) => rounds2::<S, true, false>(simd, dst, a, b, f),
        (false, true) => rounds2::<S, false, true>(simd, dst, a, b, f),
        (false, false) => {
            let value = f(load(simd, &a[0]), load(simd, &b[0]));
            dst.iter().for_each(|dst| store(dst, value));
        }
    }
}

#[inline(always)]
fn rounds2<S: Simd, const A: bool, const B: bool>(
    simd: S,
    dst: &[Cell<Chunk>],
    a: &[Cell<Chunk>],
    b: &[Cell<Chunk>],
    f: impl Fn(u32x16<S>, u32x16<S>) -> u32x16<S>,
) {
    let (a, b) = (cut::<A>(a, dst.len()), cut::<B>(b, dst.len()));
    for (index, dst) in dst.iter().enumerate() {
        let (a, b) = (operand::<A>(a, index), operand::<B>(b, index));
        store(dst, f(load(simd, a), load(simd, b)));
    }
}

/// Vector by vector, three operands.
#[inline(always)]
pub fn vector3<S: Simd>(
    simd: S,
    file: File<'_>,
    dst: Slot,
    src: &[Slot; 4],
    f: impl Fn(u32x16<S>, u32x16<S>, u32x16<S>) -> u32x16<S>,
) {
    let (dst, a, b) = (file.narrow(dst), file.narrow(src[0]), file.narrow(src[1]));
    let c = file.narrow(src[2]);
    let n = dst.len();
    match (a.len() == n, b.len() == n, c.len() == n) {
        (true, true, true) => rounds3::<S, true, true, true>(simd, dst, a, b, c, f),
        (false, true, true) => rounds3::<S, false, true, true>(simd, dst, a, b, c, f),
        (true, false, true) => rounds3::<S, true, false, true>(simd, dst, a, b, c, f),
        (true, true, false) => rounds3::<S, true, true, false>(simd, dst, a, b, c, f),
        (true, false, false) => rounds3::<S, true, false, false>(simd, dst, a, b, c, f),
        (false, true, false) => rounds3::<S, false, true, false>(simd, dst, a, b, c, f),
        (false, false, true) => rounds3::<S, false, false, true>(simd, dst, a, b, c, f),
        (false, false, false) => rounds3::<S, false, false, false>(simd, dst, a, b, c, f),
    }
}

#[inline(always)]
fn rounds3<S: Simd, const A: bool, const B: bool, const C: bool>(
    simd: S,
    dst: &[Cell<Chunk>],
    a: &[Cell<Chunk>],
    b: &[Cell<Chunk>],
    c: &[Cell<Chunk>],
    f: impl Fn(u32x16<S>, u32x16<S>, u32x16<S>) -> u32x16<S>,
) {
    let rounds = dst.len();
    let (a, b, c) = (
        cut::<A>(a, rounds),
        cut::<B>(b, rounds),
        cut::<C>(c, rounds),
    );
    for (index, dst) in dst.iter().enumerate() {
        let (a, b) = (operand::<A>(a, index), operand::<B>(b, index));
        let c = operand::<C>(c, index);
        store(dst, f(load(simd, a), load(simd, b), load(simd, c)));
    }
}
