//! The register file: vectors of 16 lanes, read as SIMD registers or as typed lanes.

use std::cell::Cell;
use std::ops::Range;

use fearless_simd::{Simd, i32x16, mask32x16, prelude::*, u32x16};

use crate::ir::{Type, VECTOR_LANES};

/// 16 lanes of 32 bits; 64-bit registers use two for 16 lanes, the lower eight lanes first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C, align(64))]
pub struct Vector(pub [u32; VECTOR_LANES]);

/// The place of a register in the register file: its first vector, and whether it has one for each 16 lanes or one for
/// all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RegisterSlot(u32);

impl RegisterSlot {
    const VARYING: u32 = 1 << 31;

    /// The register that is always zero; it stands for absent operands.
    pub const ZERO: Self = Self(0);

    /// A register with one value for the whole batch.
    pub fn uniform(start: usize) -> Self {
        Self(start as u32)
    }

    /// A register with a value for each lane.
    pub fn varying(start: usize) -> Self {
        Self(start as u32 | Self::VARYING)
    }

    /// Reports whether it has a value for each lane.
    pub fn is_varying(self) -> bool {
        self.0 & Self::VARYING != 0
    }

    /// Its first vector.
    pub fn start(self) -> usize {
        (self.0 & !Self::VARYING) as usize
    }
}

/// All registers of a batch.
#[derive(Clone, Copy)]
pub struct RegisterFile<'a> {
    vectors: &'a [Cell<Vector>],
    /// Vectors of a varying 32-bit register: lanes / 16.
    width: usize,
    /// The vectors that instructions compute.
    span: Span,
}

/// A range of vectors, from the first to the last that has active lanes. The others are skipped: the result of an
/// instruction in an inactive lane is read only within its own vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    pub first: usize,
    pub count: usize,
}

impl<'a> RegisterFile<'a> {
    pub fn new(vectors: &'a [Cell<Vector>], width: usize) -> Self {
        let span = Span { first: 0, count: width };
        Self { vectors, width, span }
    }

    /// The same register file, with another span of vectors to compute.
    #[inline(always)]
    pub fn with_span(self, span: Span) -> Self {
        Self { span, ..self }
    }

    /// The vectors to compute.
    #[inline(always)]
    pub fn span(self) -> Range<usize> {
        self.span.first..self.span.first + self.span.count
    }

    /// The vectors of a 32-bit register to compute: the span's, or the only one if it is uniform.
    #[inline(always)]
    fn spanned(self, slot: RegisterSlot) -> &'a [Cell<Vector>] {
        if slot.is_varying() {
            &self.vectors[slot.start() + self.span.first..][..self.span.count]
        } else {
            &self.vectors[slot.start()..][..1]
        }
    }

    /// The indices of a register's vectors to compute: the span's, or only the first if it is uniform.
    #[inline(always)]
    pub fn rounds(self, dst: RegisterSlot) -> Range<usize> {
        if dst.is_varying() { self.span() } else { 0..1 }
    }

    /// Vectors of a varying 32-bit register.
    #[inline(always)]
    pub fn width(self) -> usize {
        self.width
    }

    /// The vectors of a 32-bit register or bool: `width` of them, or one.
    #[inline(always)]
    pub fn narrow(self, slot: RegisterSlot) -> &'a [Cell<Vector>] {
        let count = if slot.is_varying() { self.width } else { 1 };
        &self.vectors[slot.start()..][..count]
    }

    /// The vectors of a 64-bit register.
    #[inline(always)]
    pub fn wide(self, slot: RegisterSlot) -> &'a [Cell<Vector>] {
        let count = if slot.is_varying() { 2 * self.width } else { 2 };
        &self.vectors[slot.start()..][..count]
    }

    /// The vector of a 32-bit register for 16 lanes of the batch.
    #[inline(always)]
    pub fn vector(self, slot: RegisterSlot, index: usize) -> &'a Cell<Vector> {
        &self.narrow(slot)[if slot.is_varying() { index } else { 0 }]
    }

    /// Returns a register's value in the 16 lanes of a vector of the batch.
    #[inline(always)]
    pub fn lanes<T: Lane>(self, slot: RegisterSlot, index: usize) -> [T; VECTOR_LANES] {
        let vectors = T::vectors(self, slot);
        T::load(vectors, if slot.is_varying() { index } else { 0 })
    }

    /// The value of a uniform register (or lane 0).
    #[inline(always)]
    pub fn first<T: Lane>(self, slot: RegisterSlot) -> T {
        T::load(T::vectors(self, slot), 0)[0]
    }

    /// Sets a register in the 16 lanes of a vector of the batch.
    #[inline(always)]
    pub fn set<T: Lane>(self, slot: RegisterSlot, index: usize, value: [T; VECTOR_LANES]) {
        T::store(T::vectors(self, slot), if slot.is_varying() { index } else { 0 }, value);
    }

    /// Sets a uniform register to a constant's bits.
    pub fn set_constant(self, slot: RegisterSlot, ty: Type, bits: u64) {
        match ty {
            Type::Bool => self.set(slot, 0, [bits != 0; VECTOR_LANES]),
            Type::B32 => self.set(slot, 0, [bits as u32; VECTOR_LANES]),
            Type::B64 => self.set(slot, 0, [bits; VECTOR_LANES]),
        }
    }
}

/// A function that computes `dst = op(src...)` in the vectors that the register file spans.
pub type Kernel<S> = fn(S, &RegisterFile<'_>, RegisterSlot, &[RegisterSlot; 4]);

/// A type that a register's lanes may be read as.
pub trait Lane: Copy + Default {
    /// The vectors of a register of this type's width.
    fn vectors<'a>(file: RegisterFile<'a>, slot: RegisterSlot) -> &'a [Cell<Vector>];
    /// Loads the 16 lanes from lane 16 `index` on.
    fn load(vectors: &[Cell<Vector>], index: usize) -> [Self; VECTOR_LANES];
    /// Stores the 16 lanes from lane 16 `index` on.
    fn store(vectors: &[Cell<Vector>], index: usize, value: [Self; VECTOR_LANES]);
}

/// `f` of each lane. (The standard library's `map` is not always inlined.)
#[inline(always)]
pub fn each_lane<A: Copy, B: Copy + Default>(lanes: [A; VECTOR_LANES], f: impl Fn(A) -> B) -> [B; VECTOR_LANES] {
    let mut results = [B::default(); VECTOR_LANES];
    for lane in 0..VECTOR_LANES {
        results[lane] = f(lanes[lane]);
    }
    results
}

macro_rules! narrow_lane {
    ($type:ty, $from:expr, $to:expr) => {
        impl Lane for $type {
            #[inline(always)]
            fn vectors<'a>(file: RegisterFile<'a>, slot: RegisterSlot) -> &'a [Cell<Vector>] {
                file.narrow(slot)
            }

            #[inline(always)]
            fn load(vectors: &[Cell<Vector>], index: usize) -> [Self; VECTOR_LANES] {
                each_lane(vectors[index].get().0, $from)
            }

            #[inline(always)]
            fn store(vectors: &[Cell<Vector>], index: usize, value: [Self; VECTOR_LANES]) {
                vectors[index].set(Vector(each_lane(value, $to)));
            }
        }
    };
}

narrow_lane!(u32, |bits| bits, |value| value);
narrow_lane!(i32, |bits: u32| bits.cast_signed(), |value: i32| value.cast_unsigned());
narrow_lane!(f32, f32::from_bits, f32::to_bits);
narrow_lane!(bool, |bits| bits != 0, |value| if value { u32::MAX } else { 0 });

macro_rules! wide_lane {
    ($type:ty, $from:expr, $to:expr) => {
        impl Lane for $type {
            #[inline(always)]
            fn vectors<'a>(file: RegisterFile<'a>, slot: RegisterSlot) -> &'a [Cell<Vector>] {
                file.wide(slot)
            }

            #[inline(always)]
            fn load(vectors: &[Cell<Vector>], index: usize) -> [Self; VECTOR_LANES] {
                let halves: [[u64; VECTOR_LANES / 2]; 2] =
                    [bytemuck::cast(vectors[2 * index].get().0), bytemuck::cast(vectors[2 * index + 1].get().0)];
                each_lane(bytemuck::cast::<_, [u64; VECTOR_LANES]>(halves), $from)
            }

            #[inline(always)]
            fn store(vectors: &[Cell<Vector>], index: usize, value: [Self; VECTOR_LANES]) {
                let words: [[u32; VECTOR_LANES]; 2] = bytemuck::cast(each_lane(value, $to));
                vectors[2 * index].set(Vector(words[0]));
                vectors[2 * index + 1].set(Vector(words[1]));
            }
        }
    };
}

wide_lane!(u64, |bits| bits, |value| value);
wide_lane!(i64, |bits: u64| bits.cast_signed(), |value: i64| value.cast_unsigned());
wide_lane!(f64, f64::from_bits, f64::to_bits);

/// Applies a function of one operand lane by lane.
#[inline(always)]
pub fn map1<A: Lane, R: Lane>(file: RegisterFile<'_>, dst: RegisterSlot, src: &[RegisterSlot; 4], f: impl Fn(A) -> R) {
    for index in file.rounds(dst) {
        file.set(dst, index, each_lane(file.lanes(src[0], index), &f));
    }
}

/// Applies a function of two operands lane by lane.
#[inline(always)]
pub fn map2<A: Lane, B: Lane, R: Lane>(
    file: RegisterFile<'_>,
    dst: RegisterSlot,
    src: &[RegisterSlot; 4],
    f: impl Fn(A, B) -> R,
) {
    for index in file.rounds(dst) {
        let (a, b) = (file.lanes(src[0], index), file.lanes(src[1], index));
        let mut results = [R::default(); VECTOR_LANES];
        for lane in 0..VECTOR_LANES {
            results[lane] = f(a[lane], b[lane]);
        }
        file.set(dst, index, results);
    }
}

/// Applies a function of three operands lane by lane.
#[inline(always)]
pub fn map3<A: Lane, B: Lane, C: Lane, R: Lane>(
    file: RegisterFile<'_>,
    dst: RegisterSlot,
    src: &[RegisterSlot; 4],
    f: impl Fn(A, B, C) -> R,
) {
    for index in file.rounds(dst) {
        let (a, b) = (file.lanes(src[0], index), file.lanes(src[1], index));
        let c = file.lanes(src[2], index);
        let mut results = [R::default(); VECTOR_LANES];
        for lane in 0..VECTOR_LANES {
            results[lane] = f(a[lane], b[lane], c[lane]);
        }
        file.set(dst, index, results);
    }
}

/// Loads a vector into a SIMD register.
#[inline(always)]
pub fn load_vector<S: Simd>(simd: S, vector: &Cell<Vector>) -> u32x16<S> {
    u32x16::simd_from(simd, vector.get().0)
}

/// Stores a vector from a SIMD register.
#[inline(always)]
pub fn store_vector<S: Simd>(vector: &Cell<Vector>, value: u32x16<S>) {
    vector.set(Vector(value.into()));
}

/// A bool register's vector as a mask.
#[inline(always)]
pub fn to_mask<S: Simd>(value: u32x16<S>) -> mask32x16<S> {
    value.simd.from_vector_mask32x16(value.bitcast::<i32x16<S>>())
}

/// A mask as a bool register's vector.
#[inline(always)]
pub fn from_mask<S: Simd>(mask: mask32x16<S>) -> u32x16<S> {
    ExtractToken::token(&mask).to_vector_mask32x16(mask).bitcast::<u32x16<S>>()
}

// The loops below are over indices, because the standard library's adapters are not always inlined into functions of
// another SIMD level.

/// Stores `value` to all vectors.
#[inline(always)]
fn fill<S: Simd>(dst: &[Cell<Vector>], value: u32x16<S>) {
    for vector in dst {
        store_vector(vector, value);
    }
}

/// Applies a function of one operand vector by vector.
#[inline(always)]
pub fn vector1<S: Simd>(
    simd: S,
    file: RegisterFile<'_>,
    dst: RegisterSlot,
    src: &[RegisterSlot; 4],
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

/// Applies a function of two operands vector by vector.
#[inline(always)]
pub fn vector2<S: Simd>(
    simd: S,
    file: RegisterFile<'_>,
    dst: RegisterSlot,
    src: &[RegisterSlot; 4],
    f: impl Fn(u32x16<S>, u32x16<S>) -> u32x16<S>,
) {
    let dst = file.spanned(dst);
    let (a, b) = (file.spanned(src[0]), file.spanned(src[1]));
    let n = dst.len();
    if a.len() == n && b.len() == n {
        for i in 0..n {
            store_vector(&dst[i], f(load_vector(simd, &a[i]), load_vector(simd, &b[i])));
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

/// Applies a function of three operands vector by vector. Only the commonest case has a loop without bounds checks.
#[inline(always)]
pub fn vector3<S: Simd>(
    simd: S,
    file: RegisterFile<'_>,
    dst: RegisterSlot,
    src: &[RegisterSlot; 4],
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
    // A uniform operand has one vector for all iterations.
    let step = |operand: &[Cell<Vector>]| if operand.len() == n { usize::MAX } else { 0 };
    let (at_a, at_b, at_c) = (step(a), step(b), step(c));
    for i in 0..n {
        let (a, b) = (load_vector(simd, &a[i & at_a]), load_vector(simd, &b[i & at_b]));
        store_vector(&dst[i], f(a, b, load_vector(simd, &c[i & at_c])));
    }
}
