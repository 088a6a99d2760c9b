//! Arithmetic: one kernel, a function of its own, for each operation.
//!
//! 32-bit operations that SIMD vectors have are written with vectors of 16 lanes; the rest lane by lane, which the Rust
//! compiler vectorises where it can. A step holds a pointer to its kernel, so that decoding it is one indirect call.

use crate::kernels::float::FusedMultiply;
use std::cmp::Ordering;

use fearless_simd::{Simd, f32x16, i32x16, mask32x16, prelude::*, u32x16};

use super::registers::{
    Kernel, RegisterFile, RegisterSlot, from_mask, map1, map2, map3, to_mask, vector1, vector2, vector3,
};
use super::{elementary, float};
use crate::ir::op::{Kind, Op};

type U<S> = u32x16<S>;
type I<S> = i32x16<S>;
type F<S> = f32x16<S>;

// The shapes of operations: the types of the operands and of the result.
macro_rules! word {
    (@ $shape:ident, |$($a:ident),+| $value:expr) => {
        |simd, file, dst, src| {
            simd.vectorize(
                #[inline(always)]
                move || $shape(
                    simd,
                    *file,
                    dst,
                    src,
                    #[inline(always)]
                    |$($a: U<S>),+| -> U<S> { $value },
                ),
            )
        }
    };
    (|$a:ident| $value:expr) => { word!(@ vector1, |$a| $value) };
    (|$a:ident, $b:ident| $value:expr) => { word!(@ vector2, |$a, $b| $value) };
    (|$a:ident, $b:ident, $c:ident| $value:expr) => { word!(@ vector3, |$a, $b, $c| $value) };
}
macro_rules! float {
    (|$($a:ident),+| $value:expr) => {
        word!(|$($a),+| {
            $(let $a = $a.bitcast::<F<S>>();)+
            let r: F<S> = $value;
            r.bitcast()
        })
    };
}
macro_rules! float_test {
    (|$($a:ident),+| $value:expr) => {
        word!(|$($a),+| {
            $(let $a = $a.bitcast::<F<S>>();)+
            let r: mask32x16<S> = $value;
            from_mask(r)
        })
    };
}
macro_rules! signed {
    (|$($a:ident),+| $value:expr) => {
        word!(|$($a),+| {
            $(let $a = $a.bitcast::<I<S>>();)+
            let r: I<S> = $value;
            r.bitcast()
        })
    };
}
/// Defines a kernel that runs lane by lane.
macro_rules! lanes {
    ($map:ident, $f:expr $(,)?) => {
        |simd, file, dst, src| {
            simd.vectorize(
                #[inline(always)]
                move || $map(*file, dst, src, $f),
            )
        }
    };
}
/// Defines a kernel that runs lane by lane, with a function whose first argument is the SIMD level.
macro_rules! lanes_of_level {
    ($map:ident, $f:path, $($a:ident),+) => {
        |simd, file, dst, src| {
            simd.vectorize(
                #[inline(always)]
                move || $map(*file, dst, src, |$($a),+| $f(simd, $($a),+)),
            )
        }
    };
}
/// `a` where it is `chosen` and `b` elsewhere, as [`float::least`] and [`float::greatest`]. Where one of the two is NaN,
/// the other one. That holds for a signalling NaN too, which AVX-512's minimum and maximum would make quiet and return.
#[inline(always)]
fn number_or_other<S: Simd>(chosen: mask32x16<S>, a: F<S>, b: F<S>) -> F<S> {
    b.simd_eq(b).select(chosen.select(a, b), a)
}

/// The kernel of an operation.
pub fn kernel<S: Simd>(op: Op) -> Kernel<S> {
    match op {
        Op::BAnd | Op::And => word!(|a, b| a & b),
        Op::BOr | Op::Or => word!(|a, b| a | b),
        Op::BXor | Op::Xor => word!(|a, b| a ^ b),
        Op::BNot | Op::Not => word!(|a| !a),
        Op::BSelect | Op::Select => word!(|c, a, b| to_mask(c).select(a, b)),
        Op::IAdd => word!(|a, b| a + b),
        Op::ISub => word!(|a, b| a - b),
        Op::IMul => word!(|a, b| a * b),
        Op::INeg => word!(|a| U::splat(a.simd, 0) - a),
        Op::SMin => signed!(|a, b| a.min(b)),
        Op::SMax => signed!(|a, b| a.max(b)),
        Op::UMin => word!(|a, b| a.min(b)),
        Op::UMax => word!(|a, b| a.max(b)),
        Op::IEq => word!(|a, b| from_mask(a.simd_eq(b))),
        Op::INe => word!(|a, b| !from_mask(a.simd_eq(b))),
        Op::SLt => word!(|a, b| from_mask(a.bitcast::<I<S>>().simd_lt(b.bitcast::<I<S>>()))),
        Op::SLe => word!(|a, b| from_mask(a.bitcast::<I<S>>().simd_le(b.bitcast::<I<S>>()))),
        Op::ULt => word!(|a, b| from_mask(a.simd_lt(b))),
        Op::ULe => word!(|a, b| from_mask(a.simd_le(b))),
        Op::FAdd => float!(|a, b| a + b),
        Op::FSub => float!(|a, b| a - b),
        Op::FMul => float!(|a, b| a * b),
        Op::FFma => float!(|a, b, c| a.fused_add(b, c)),
        Op::FMulSub => float!(|a, b, c| a.fused_sub(b, c)),
        Op::FNegMulAdd => float!(|a, b, c| (-a).fused_add(b, c)),
        Op::FDiv => float!(|a, b| a / b),
        Op::FNeg => float!(|a| -a),
        Op::FAbs => float!(|a| a.abs()),
        Op::FMin => float!(|a, b| number_or_other(a.simd_lt(b), a, b)),
        Op::FMax => float!(|a, b| number_or_other(a.simd_gt(b), a, b)),
        Op::FSqrt => float!(|a| a.sqrt()),
        Op::FEq => float_test!(|a, b| a.simd_eq(b)),
        Op::FNe => word!(|a, b| !from_mask(a.bitcast::<F<S>>().simd_eq(b.bitcast::<F<S>>()))),
        Op::FLt => float_test!(|a, b| a.simd_lt(b)),
        Op::FLe => float_test!(|a, b| a.simd_le(b)),
        _ => less_common(op),
    }
}

/// Operations that are rarer, or long at the lower SIMD levels.
fn less_common<S: Simd>(op: Op) -> Kernel<S> {
    match op {
        Op::SAbs => signed!(|a| a.abs()),
        Op::Shl => word!(|a, b| a << (b & 31)),
        Op::UShr => word!(|a, b| a >> (b & 31)),
        Op::SShr => word!(|a, b| (a.bitcast::<I<S>>() >> (b & 31).bitcast::<I<S>>()).bitcast()),
        Op::UAddCarry => word!(|a, b| from_mask((a + b).simd_lt(a)) & 1),
        Op::USubBorrow => word!(|a, b| from_mask(a.simd_lt(b)) & 1),
        Op::FSign => float!(|a| {
            let zero = F::splat(a.simd, 0.0);
            let one = a.simd_gt(zero).select(F::splat(a.simd, 1.0), zero);
            a.simd_lt(zero).select(F::splat(a.simd, -1.0), one)
        }),
        Op::FFloor => float!(|a| float::floor(a)),
        Op::FCeil => float!(|a| float::ceil(a)),
        Op::FTrunc => float!(|a| float::trunc(a)),
        Op::FRoundEven => float!(|a| float::round_ties_even(a)),
        Op::FFract => float!(|a| a - float::floor(a)),
        Op::FInverseSqrt => float!(|a| F::splat(a.simd, 1.0) / a.sqrt()),
        Op::FLtGt => float_test!(|a, b| a.simd_lt(b) | b.simd_lt(a)),
        Op::FIsNan => float_test!(|a| a.is_nan()),
        Op::FIsInf => float_test!(|a| a.is_infinite()),
        Op::FToS => word!(|a| I::truncate_from_precise(a.bitcast::<F<S>>()).bitcast()),
        Op::FToU => word!(|a| U::truncate_from_precise(a.bitcast::<F<S>>())),
        Op::SToF => word!(|a| F::float_from(a.bitcast::<I<S>>()).bitcast()),
        Op::UToF => word!(|a| F::float_from(a).bitcast()),
        _ if op.kind() == Kind::Wide => wide(op),
        _ if elementary::is_one(op) => elementary::kernel(op),
        _ => by_lane(op),
    }
}

/// The kernel of a 32-bit operation that SIMD vectors don't have.
fn by_lane<S: Simd>(op: Op) -> Kernel<S> {
    match op {
        Op::UDiv => lanes!(map2, |a: u32, b: u32| { a.checked_div(b).unwrap_or(u32::MAX) }),
        Op::URem => lanes!(map2, |a: u32, b: u32| { a.checked_rem(b).unwrap_or(a) }),
        Op::SDiv => lanes!(map2, |a: i32, b: i32| if b == 0 { -1 } else { a.wrapping_div(b) },),
        Op::SRem => lanes!(map2, |a: i32, b: i32| if b == 0 { a } else { a.wrapping_rem(b) },),
        Op::SMod => lanes!(map2, floor_mod),
        Op::UMulHi => lanes!(map2, |a: u32, b: u32| { ((u64::from(a) * u64::from(b)) >> 32) as u32 }),
        Op::SMulHi => lanes!(map2, |a: i32, b: i32| { ((i64::from(a) * i64::from(b)) >> 32) as i32 }),
        Op::SSign => lanes!(map1, i32::signum),
        Op::BitReverse => lanes!(map1, u32::reverse_bits),
        Op::BitCount => lanes!(map1, |a: u32| a.count_ones()),
        Op::FindLsb => lanes!(map1, find_lsb),
        Op::FindUMsb => lanes!(map1, find_unsigned_msb),
        Op::FindSMsb => lanes!(map1, find_signed_msb),
        Op::BitfieldInsert => |simd, file, dst, src| {
            simd.vectorize(
                #[inline(always)]
                move || bitfield_insert(*file, dst, src),
            );
        },
        Op::BitfieldSExtract => lanes!(map3, signed_bitfield),
        Op::BitfieldUExtract => lanes!(map3, unsigned_bitfield),
        Op::SExt8 => lanes!(map1, |a: u32| i32::from(a as u8 as i8)),
        Op::SExt16 => lanes!(map1, |a: u32| i32::from(a as u16 as i16)),
        Op::FRem => lanes!(map2, |a: f32, b: f32| libm::fmodf(a, b)),
        Op::FMod => lanes!(map2, |a: f32, b: f32| {
            let r = libm::fmodf(a, b);
            if r != 0.0 && (r < 0.0) != (b < 0.0) { r + b } else { r }
        }),
        Op::FLdexp => lanes!(map2, elementary::ldexp),
        Op::FFrexpSignificand => lanes!(map1, |a: f32| elementary::frexp(a).0),
        Op::FFrexpExponent => lanes!(map1, |a: f32| elementary::frexp(a).1),
        Op::FToF16 => lanes!(map1, |a: f32| { u32::from(half::f16::from_f32(a).to_bits()) }),
        Op::F16ToF => lanes!(map1, |a: u32| { half::f16::from_bits(a as u16).to_f32() }),
        Op::RoundToF16 => lanes!(map1, |a: f32| half::f16::from_f32(a).to_f32()),
        // Every other operation has been taken.
        _ => {
            debug_assert!(false, "{} has no kernel", op.name());
            |_, _, _, _| {}
        }
    }
}

/// The kernel of a 64-bit operation or conversion.
fn wide<S: Simd>(op: Op) -> Kernel<S> {
    match op {
        Op::Select64 => lanes!(map3, |c: bool, a: u64, b: u64| if c { a } else { b },),

        Op::FToF64 => lanes!(map1, |a: f32| f64::from(a)),
        Op::F64ToF => lanes!(map1, |a: f64| a as f32),
        Op::F64ToS => lanes!(map1, |a: f64| a as i32),
        Op::F64ToU => lanes!(map1, |a: f64| a as u32),
        Op::SToF64 => lanes!(map1, |a: i32| f64::from(a)),
        Op::UToF64 => lanes!(map1, |a: u32| f64::from(a)),
        Op::F64ToS64 => lanes!(map1, |a: f64| a as i64),
        Op::F64ToU64 => lanes!(map1, |a: f64| a as u64),
        Op::S64ToF64 => lanes!(map1, |a: i64| a as f64),
        Op::U64ToF64 => lanes!(map1, |a: u64| a as f64),
        Op::FToS64 => lanes!(map1, |a: f32| a as i64),
        Op::FToU64 => lanes!(map1, |a: f32| a as u64),
        Op::S64ToF => lanes!(map1, |a: i64| a as f32),
        Op::U64ToF => lanes!(map1, |a: u64| a as f32),
        Op::SToS64 => lanes!(map1, |a: i32| i64::from(a)),
        Op::UToU64 => lanes!(map1, |a: u32| u64::from(a)),
        Op::Low32 => lanes!(map1, |a: u64| a as u32),
        Op::High32 => lanes!(map1, |a: u64| (a >> 32) as u32),
        Op::Join64 => lanes!(map2, |low: u32, high: u32| { u64::from(low) | u64::from(high) << 32 }),

        Op::FAdd64 => lanes!(map2, |a: f64, b: f64| a + b),
        Op::FSub64 => lanes!(map2, |a: f64, b: f64| a - b),
        Op::FMul64 => lanes!(map2, |a: f64, b: f64| a * b),
        Op::FDiv64 => lanes!(map2, |a: f64, b: f64| a / b),
        Op::FFma64 => lanes_of_level!(map3, float::mul_add64, a, b, c),
        Op::FRem64 => lanes!(map2, |a: f64, b: f64| libm::fmod(a, b)),
        Op::FMod64 => lanes!(map2, |a: f64, b: f64| {
            let r = libm::fmod(a, b);
            if r != 0.0 && (r < 0.0) != (b < 0.0) { r + b } else { r }
        }),
        Op::FNeg64 => lanes!(map1, |a: f64| -a),
        Op::FAbs64 => lanes!(map1, f64::abs),
        Op::FSign64 => lanes!(map1, |a: f64| { f64::from(i8::from(a > 0.0) - i8::from(a < 0.0)) }),
        Op::FFloor64 => lanes_of_level!(map1, float::floor64, a),
        Op::FCeil64 => lanes_of_level!(map1, float::ceil64, a),
        Op::FTrunc64 => lanes_of_level!(map1, float::trunc64, a),
        Op::FRoundEven64 => lanes_of_level!(map1, float::round_ties_even64, a),
        Op::FFract64 => lanes_of_level!(map1, float::fract64, a),
        Op::FMin64 => lanes!(map2, float::least::<f64>),
        Op::FMax64 => lanes!(map2, float::greatest::<f64>),
        Op::FSqrt64 => lanes!(map1, f64::sqrt),
        Op::FEq64 => lanes!(map2, |a: f64, b: f64| a == b),
        Op::FNe64 => lanes!(map2, |a: f64, b: f64| a != b),
        Op::FLt64 => lanes!(map2, |a: f64, b: f64| a < b),
        Op::FLe64 => lanes!(map2, |a: f64, b: f64| a <= b),
        Op::FLtGt64 => lanes!(map2, |a: f64, b: f64| { a.partial_cmp(&b).is_some_and(Ordering::is_ne) }),
        Op::FIsNan64 => lanes!(map1, f64::is_nan),
        Op::FIsInf64 => lanes!(map1, f64::is_infinite),
        Op::FLdexp64 => lanes!(map2, ldexp64),
        Op::FFrexpSignificand64 => lanes!(map1, |a: f64| frexp64(a).0),
        Op::FFrexpExponent64 => lanes!(map1, |a: f64| frexp64(a).1),

        Op::IAdd64 => lanes!(map2, u64::wrapping_add),
        Op::ISub64 => lanes!(map2, u64::wrapping_sub),
        Op::IMul64 => lanes!(map2, u64::wrapping_mul),
        Op::INeg64 => lanes!(map1, u64::wrapping_neg),
        Op::SAbs64 => lanes!(map1, i64::wrapping_abs),
        Op::SSign64 => lanes!(map1, i64::signum),
        Op::UDiv64 => lanes!(map2, |a: u64, b: u64| { a.checked_div(b).unwrap_or(u64::MAX) }),
        Op::URem64 => lanes!(map2, |a: u64, b: u64| { a.checked_rem(b).unwrap_or(a) }),
        Op::SDiv64 => lanes!(map2, |a: i64, b: i64| if b == 0 { -1 } else { a.wrapping_div(b) },),
        Op::SRem64 => lanes!(map2, |a: i64, b: i64| if b == 0 { a } else { a.wrapping_rem(b) },),
        Op::SMod64 => lanes!(map2, floor_mod64),
        Op::And64 => lanes!(map2, |a: u64, b: u64| a & b),
        Op::Or64 => lanes!(map2, |a: u64, b: u64| a | b),
        Op::Xor64 => lanes!(map2, |a: u64, b: u64| a ^ b),
        Op::Not64 => lanes!(map1, |a: u64| !a),
        Op::Shl64 => lanes!(map2, u64::wrapping_shl),
        Op::UShr64 => lanes!(map2, u64::wrapping_shr),
        Op::SShr64 => lanes!(map2, i64::wrapping_shr),
        Op::IEq64 => lanes!(map2, |a: u64, b: u64| a == b),
        Op::INe64 => lanes!(map2, |a: u64, b: u64| a != b),
        Op::SLt64 => lanes!(map2, |a: i64, b: i64| a < b),
        Op::SLe64 => lanes!(map2, |a: i64, b: i64| a <= b),
        Op::ULt64 => lanes!(map2, |a: u64, b: u64| a < b),
        Op::ULe64 => lanes!(map2, |a: u64, b: u64| a <= b),
        Op::SMin64 => lanes!(map2, |a: i64, b: i64| a.min(b)),
        Op::SMax64 => lanes!(map2, |a: i64, b: i64| a.max(b)),
        Op::UMin64 => lanes!(map2, |a: u64, b: u64| a.min(b)),
        Op::UMax64 => lanes!(map2, |a: u64, b: u64| a.max(b)),
        // Every other operation is 32-bit, and has been taken.
        _ => {
            debug_assert!(false, "{} isn't a 64-bit operation", op.name());
            |_, _, _, _| {}
        }
    }
}

/// The significand in [0.5, 1) and the exponent.
fn frexp64(a: f64) -> (f64, i32) {
    if a == 0.0 || !a.is_finite() {
        return (a, 0);
    }
    // Denormals are scaled to normal numbers first.
    let (scaled, bias) = if a.abs() < f64::MIN_POSITIVE { (a * power_of_two(64), -64) } else { (a, 0) };
    let bits = scaled.to_bits();
    let exponent = (bits >> 52 & 0x7ff) as i32 - 1022;
    (f64::from_bits(bits & !(0x7ff << 52) | 1022 << 52), exponent + bias)
}

/// `a * 2^exponent`, rounded once.
fn ldexp64(a: f64, exponent: i32) -> f64 {
    let (significand, own) = frexp64(a);
    if significand == 0.0 || !significand.is_finite() {
        return a;
    }
    let total = own.saturating_add(exponent);
    // Only the last factor rounds: it moves a normal number into the denormal range.
    if total > 1024 {
        significand * f64::MAX * 4.0
    } else if total >= -1021 {
        significand * 2.0 * power_of_two(total - 1)
    } else {
        significand * power_of_two(-1021) * power_of_two((total + 1021).max(-200))
    }
}

/// 2 to a power from -1022 to 1023.
fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

/// The remainder with the sign of `b`; `a` if `b` is zero.
#[inline(always)]
fn floor_mod(a: i32, b: i32) -> i32 {
    if b == 0 {
        return a;
    }
    let remainder = a.wrapping_rem(b);
    if remainder != 0 && (remainder < 0) != (b < 0) { remainder + b } else { remainder }
}

/// [`floor_mod`] of 64 bits.
#[inline(always)]
fn floor_mod64(a: i64, b: i64) -> i64 {
    if b == 0 {
        return a;
    }
    let remainder = a.wrapping_rem(b);
    if remainder != 0 && (remainder < 0) != (b < 0) { remainder + b } else { remainder }
}

/// Index of the lowest one bit, or -1.
#[inline(always)]
fn find_lsb(a: u32) -> u32 {
    if a == 0 { u32::MAX } else { a.trailing_zeros() }
}

/// Index of the highest one bit, or -1.
#[inline(always)]
fn find_unsigned_msb(a: u32) -> u32 {
    31u32.wrapping_sub(a.leading_zeros())
}

/// Index of the highest bit that isn't the sign's, or -1.
#[inline(always)]
fn find_signed_msb(a: i32) -> u32 {
    find_unsigned_msb((a ^ (a >> 31)).cast_unsigned())
}

/// `count` ones from bit 0.
#[inline(always)]
fn ones(count: u32) -> u32 {
    if count >= 32 { u32::MAX } else { (1 << count) - 1 }
}

/// `value` shifted right, also by 32.
#[inline(always)]
fn shift_right(value: u32, by: u32) -> u32 {
    value.checked_shr(by).unwrap_or(0)
}

/// `count` bits from `offset`, zero-extended.
#[inline(always)]
fn unsigned_bitfield(value: u32, offset: u32, count: u32) -> u32 {
    shift_right(value, offset) & ones(count)
}

/// `count` bits from `offset`, sign-extended.
#[inline(always)]
fn signed_bitfield(value: u32, offset: u32, count: u32) -> i32 {
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
fn bitfield_insert(file: RegisterFile<'_>, dst: RegisterSlot, src: &[RegisterSlot; 4]) {
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
