//! Consecutive words of memory as vectors. Other threads may access the words at the same time: each word is then an old
//! or a new one, as with relaxed atomics.
//!
//! The compiler never joins atomic accesses: 16 of them are 16 instructions, and a vector made of them goes through
//! memory. Vector instructions of x86-64 access an aligned word as a whole. They are in assembly here, since an access
//! that others race with, if it is not atomic, is undefined in Rust.

use fearless_simd::{Simd, prelude::*, u32x4, u32x16};
use std::sync::atomic::AtomicU32;

/// Four consecutive words.
#[inline(always)]
pub fn load_4<S: Simd>(simd: S, words: &[AtomicU32; 4]) -> u32x4<S> {
    u32x4::simd_from(simd, load(simd, words))
}

/// The two words from each of two places on.
///
/// # Safety
/// They must lie in `words`.
#[inline(always)]
pub(crate) unsafe fn load_2x2<S: Simd>(simd: S, words: &[AtomicU32], places: [u32; 2]) -> u32x4<S> {
    debug_assert!(places.iter().all(|place| (*place as usize) + 2 <= words.len()));
    // SAFETY: as this function's.
    u32x4::simd_from(simd, unsafe { load_pairs(simd, words, places) })
}

/// Sixteen consecutive words.
#[inline(always)]
pub fn load_16<S: Simd>(simd: S, words: &[AtomicU32; 16]) -> u32x16<S> {
    let (quarters, _) = words.as_chunks::<4>();
    let lower = load_4(simd, &quarters[0]).combine(load_4(simd, &quarters[1]));
    lower.combine(load_4(simd, &quarters[2]).combine(load_4(simd, &quarters[3])))
}

/// Stores sixteen consecutive words.
#[inline(always)]
pub fn store_16<S: Simd>(simd: S, words: &[AtomicU32; 16], values: u32x16<S>) {
    let values: [u32; 16] = values.into();
    for (words, values) in words.as_chunks().0.iter().zip(values.as_chunks().0) {
        store(simd, words, values);
    }
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn load<S: Simd>(simd: S, words: &[AtomicU32; 4]) -> [u32; 4] {
    use std::arch::{asm, x86_64::__m128i};
    let loaded: __m128i;
    // SAFETY: the instruction reads the 16 bytes of the array. A level with AVX2 has its form for AVX.
    unsafe {
        if simd.level().as_avx2().is_some() {
            asm!("vmovdqu {}, [{}]", lateout(xmm_reg) loaded, in(reg) words, options(nostack, preserves_flags, readonly));
        } else {
            asm!("movdqu {}, [{}]", lateout(xmm_reg) loaded, in(reg) words, options(nostack, preserves_flags, readonly));
        }
    }
    bytemuck::cast(loaded)
}

/// The two words from each of two places on.
///
/// # Safety
/// They must lie in `words`.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
unsafe fn load_pairs<S: Simd>(simd: S, words: &[AtomicU32], [first, second]: [u32; 2]) -> [u32; 4] {
    use std::arch::{asm, x86_64::__m128i};
    let words = words.as_ptr();
    let (first, second) = (first as usize, second as usize);
    let loaded: __m128i;
    // SAFETY: the instructions read eight bytes each, all of them words of the slice. A level with AVX2 has their forms
    // for AVX.
    unsafe {
        if simd.level().as_avx2().is_some() {
            asm!(
                "vmovq {loaded}, qword ptr [{words} + 4 * {first}]",
                "vmovhps {loaded}, {loaded}, qword ptr [{words} + 4 * {second}]",
                words = in(reg) words, first = in(reg) first, second = in(reg) second, loaded = out(xmm_reg) loaded,
                options(nostack, preserves_flags, readonly)
            );
        } else {
            asm!(
                "movq {loaded}, qword ptr [{words} + 4 * {first}]",
                "movhps {loaded}, qword ptr [{words} + 4 * {second}]",
                words = in(reg) words, first = in(reg) first, second = in(reg) second, loaded = out(xmm_reg) loaded,
                options(nostack, preserves_flags, readonly)
            );
        }
    }
    bytemuck::cast(loaded)
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn store<S: Simd>(simd: S, words: &[AtomicU32; 4], values: &[u32; 4]) {
    use std::arch::{asm, x86_64::__m128i};
    let values: __m128i = bytemuck::cast(*values);
    // SAFETY: the instruction writes the 16 bytes of the array, whose words are atomics. A level with AVX2 has its form
    // for AVX.
    unsafe {
        if simd.level().as_avx2().is_some() {
            asm!("vmovdqu [{}], {}", in(reg) words, in(xmm_reg) values, options(nostack, preserves_flags));
        } else {
            asm!("movdqu [{}], {}", in(reg) words, in(xmm_reg) values, options(nostack, preserves_flags));
        }
    }
}

#[cfg(not(target_arch = "x86_64"))]
#[inline(always)]
fn load<S: Simd>(_: S, words: &[AtomicU32; 4]) -> [u32; 4] {
    words.each_ref().map(|word| word.load(std::sync::atomic::Ordering::Relaxed))
}

/// The two words from each of two places on.
///
/// # Safety
/// They must lie in `words`.
#[cfg(not(target_arch = "x86_64"))]
#[inline(always)]
unsafe fn load_pairs<S: Simd>(_: S, words: &[AtomicU32], [first, second]: [u32; 2]) -> [u32; 4] {
    let (first, second) = (first as usize, second as usize);
    [first, first + 1, second, second + 1].map(|place| words[place].load(std::sync::atomic::Ordering::Relaxed))
}

#[cfg(not(target_arch = "x86_64"))]
#[inline(always)]
fn store<S: Simd>(_: S, words: &[AtomicU32; 4], values: &[u32; 4]) {
    words.iter().zip(values).for_each(|(word, value)| word.store(*value, std::sync::atomic::Ordering::Relaxed));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dispatch;
    use fearless_simd::Level;

    fn run<const N: usize>(words: &[AtomicU32], first: usize) -> &[AtomicU32; N] {
        words[first..].first_chunk().expect("long enough")
    }

    #[test]
    fn words_are_loaded_and_stored_wherever_they_begin() {
        for level in [Level::new(), Level::baseline()] {
            for first in 0..5 {
                let from: Vec<AtomicU32> = (0..24).map(|word| AtomicU32::new(100 + word)).collect();
                let to: Vec<AtomicU32> = (0..24).map(|_| AtomicU32::new(7)).collect();
                let four: [u32; 4] = dispatch!(level, simd => {
                    store_16(simd, run(&to, first), load_16(simd, run(&from, first)));
                    load_4(simd, run(&from, first)).into()
                });
                assert_eq!(four, [0, 1, 2, 3].map(|word| 100 + first as u32 + word));
                for (index, word) in (0u32..).zip(&to) {
                    let is_inside = (first..first + 16).contains(&(index as usize));
                    let expected = if is_inside { 100 + index } else { 7 };
                    assert_eq!(word.load(std::sync::atomic::Ordering::Relaxed), expected, "{level:?}");
                }
            }
        }
    }
}
