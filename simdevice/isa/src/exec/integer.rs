//! Integer functions of one lane.

use super::file::{File, Slot};

/// The remainder with the sign of `b`; `a` if `b` is zero.
#[inline(always)]
pub fn floor_mod(a: i32, b: i32) -> i32 {
    if b == 0 {
        return a;
    }
    let remainder = a.wrapping_rem(b);
    if remainder != 0 && (remainder < 0) != (b < 0) {
        remainder + b
    } else {
        remainder
    }
}

/// [`floor_mod`] of 64 bits.
#[inline(always)]
pub fn floor_mod64(a: i64, b: i64) -> i64 {
    if b == 0 {
        return a;
    }
    let remainder = a.wrapping_rem(b);
    if remainder != 0 && (remainder < 0) != (b < 0) {
        remainder + b
    } else {
        remainder
    }
}

/// Index of the lowest one bit, or -1.
#[inline(always)]
pub fn find_lsb(a: u32) -> u32 {
    if a == 0 { u32::MAX } else { a.trailing_zeros() }
}

/// Index of the highest one bit, or -1.
#[inline(always)]
pub fn find_unsigned_msb(a: u32) -> u32 {
    31u32.wrapping_sub(a.leading_zeros())
}

/// Index of the highest bit that isn't the sign's, or -1.
#[inline(always)]
pub fn find_signed_msb(a: i32) -> u32 {
    find_unsigned_msb((a ^ (a >> 31)).cast_unsigned())
}

/// `count` ones from bit 0.
#[inline(always)]
fn ones(count: u32) -> u32 {
    if count >= 32 {
        u32::MAX
    } else {
        (1 << count) - 1
    }
}

/// `value` shifted right, also by 32.
#[inline(always)]
fn shift_right(value: u32, by: u32) -> u32 {
    value.checked_shr(by).unwrap_or(0)
}

/// `count` bits from `offset`, zero-extended.
#[inline(always)]
pub fn unsigned_bitfield(value: u32, offset: u32, count: u32) -> u32 {
    shift_right(value, offset) & ones(count)
}

/// `count` bits from `offset`, sign-extended.
#[inline(always)]
pub fn signed_bitfield(value: u32, offset: u32, count: u32) -> i32 {
    let count = count.min(32);
    if count == 0 {
        return 0;
    }
    let spare = 32 - count;
    (unsigned_bitfield(value, offset, count) << spare).cast_signed() >> spare
}

/// Replaces bits of a base.
#[inline(always)]
fn insert_bits(base: u32, insert: u32, offset: u32, count: u32) -> u32 {
    let mask = ones(count).checked_shl(offset).unwrap_or(0);
    base & !mask | insert.checked_shl(offset).unwrap_or(0) & mask
}

/// Replaces bits of bases.
#[inline(always)]
pub fn bitfield_insert(file: File<'_>, dst: Slot, src: &[Slot; 4]) {
    for index in file.rounds(dst) {
        let (base, insert) = (file.lanes(src[0], index), file.lanes(src[1], index));
        let (offset, count) = (file.lanes(src[2], index), file.lanes(src[3], index));
        let mut result = [0; 16];
        for lane in 0..16 {
            result[lane] = insert_bits(base[lane], insert[lane], offset[lane], count[lane]);
        }
        file.set(dst, index, result);
    }
}
