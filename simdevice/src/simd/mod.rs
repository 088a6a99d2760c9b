//! Helpers for hot code that processes several values at once. All are always inlined.
//!
//! The standard library's `map` of arrays is not always inlined: it calls its closure through an iterator, which took a
//! third of the time of setting up small triangles. Neither are fearless_simd's `to_bits` and `from_bits`: as calls
//! they are compiled without the SIMD level's instructions, and pass vectors through memory.

pub(crate) mod exp2;
pub(crate) mod half;

use fearless_simd::{Simd, f32x4, f32x16, prelude::*, u32x16};
use isa::Vector;

/// The bits of floats.
#[inline(always)]
pub(crate) fn bits_of<S: Simd>(floats: f32x16<S>) -> u32x16<S> {
    floats.bitcast()
}

/// The floats whose bits these are.
#[inline(always)]
pub(crate) fn floats_of<S: Simd>(bits: u32x16<S>) -> f32x16<S> {
    bits.bitcast()
}

/// The lanes of a chunk as floats.
#[inline(always)]
pub(crate) fn as_floats<S: Simd>(simd: S, chunk: &Vector) -> f32x16<S> {
    floats_of(u32x16::simd_from(simd, chunk.0))
}

/// The values of four quads, each repeated for the quad's lanes.
#[inline(always)]
pub(crate) fn spread<S: Simd>(simd: S, [a, b, c, d]: [f32; 4]) -> f32x16<S> {
    let low = f32x4::splat(simd, a).combine(f32x4::splat(simd, b));
    let high = f32x4::splat(simd, c).combine(f32x4::splat(simd, d));
    low.combine(high)
}

/// The results of `f` for both elements.
#[inline(always)]
pub(crate) fn both<A, B>([a, b]: [A; 2], mut f: impl FnMut(A) -> B) -> [B; 2] {
    [f(a), f(b)]
}

/// The results of `f` for all three elements.
#[inline(always)]
pub(crate) fn three<A, B>([a, b, c]: [A; 3], mut f: impl FnMut(A) -> B) -> [B; 3] {
    [f(a), f(b), f(c)]
}
