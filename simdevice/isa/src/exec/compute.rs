//! Arithmetic: one kernel, a function of its own, for each operation.
//!
//! 32-bit operations that vectors have are written with vectors of 16 lanes; the rest lane by lane, which the compiler
//! vectorises where it can. A step holds which kernel it runs, so that decoding it is one indirect call.

use fearless_simd::{Simd, f32x16, i32x16, mask32x16, prelude::*, u32x16};

use super::super::op::{Kind, Op};
use super::file::{File, Slot, from_mask, map1, map2, map3, to_mask, vector1, vector2, vector3};
use super::{integer, transcendental, wide};

type U<S> = u32x16<S>;
type I<S> = i32x16<S>;
type F<S> = f32x16<S>;

/// `dst = op(src...)` in the lanes that a file spans.
pub type Kernel<S> = fn(S, &File<'_>, Slot, &[Slot; 4]);

// The shapes of operation: what the operands are read as, and what the result is.
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
/// Lane by lane.
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
pub(super) use lanes;

/// `a` where it is `chosen` and `b` elsewhere, but where one of both is not a number, the other: also where it is a signalling
/// one, which AVX-512's own minimum and maximum make quiet and return.
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
        Op::FFma => float!(|a, b, c| a.mul_add(b, c)),
        Op::FMulSub => float!(|a, b, c| a.mul_sub(b, c)),
        Op::FNegMulAdd => float!(|a, b, c| (-a).mul_add(b, c)),
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
        Op::FFloor => float!(|a| a.floor()),
        Op::FCeil => float!(|a| a.ceil()),
        Op::FTrunc => float!(|a| a.trunc()),
        Op::FRoundEven => float!(|a| a.round_ties_even()),
        Op::FFract => float!(|a| a - a.floor()),
        Op::FInverseSqrt => float!(|a| F::splat(a.simd, 1.0) / a.sqrt()),
        Op::FLtGt => float_test!(|a, b| a.simd_lt(b) | b.simd_lt(a)),
        Op::FIsNan => float_test!(|a| a.is_nan()),
        Op::FIsInf => float_test!(|a| a.is_infinite()),
        Op::FToS => word!(|a| I::truncate_from_precise(a.bitcast::<F<S>>()).bitcast()),
        Op::FToU => word!(|a| U::truncate_from_precise(a.bitcast::<F<S>>())),
        Op::SToF => word!(|a| F::float_from(a.bitcast::<I<S>>()).bitcast()),
        Op::UToF => word!(|a| F::float_from(a).bitcast()),
        _ if op.kind() == Kind::Wide => wide::kernel(op),
        _ if transcendental::is_one(op) => transcendental::kernel(op),
        _ => by_lane(op),
    }
}

/// 32-bit operations that vectors don't have.
fn by_lane<S: Simd>(op: Op) -> Kernel<S> {
    match op {
        Op::UDiv => lanes!(map2, |a: u32, b: u32| {
            a.checked_div(b).unwrap_or(u32::MAX)
        }),
        Op::URem => lanes!(map2, |a: u32, b: u32| { a.checked_rem(b).unwrap_or(a) }),
        Op::SDiv => lanes!(map2, |a: i32, b: i32| if b == 0 {
            -1
        } else {
            a.wrapping_div(b)
        },),
        Op::SRem => lanes!(map2, |a: i32, b: i32| if b == 0 {
            a
        } else {
            a.wrapping_rem(b)
        },),
        Op::SMod => lanes!(map2, integer::floor_mod),
        Op::UMulHi => lanes!(map2, |a: u32, b: u32| {
            ((u64::from(a) * u64::from(b)) >> 32) as u32
        }),
        Op::SMulHi => lanes!(map2, |a: i32, b: i32| {
            ((i64::from(a) * i64::from(b)) >> 32) as i32
        }),
        Op::SSign => lanes!(map1, i32::signum),
        Op::BitReverse => lanes!(map1, u32::reverse_bits),
        Op::BitCount => lanes!(map1, |a: u32| a.count_ones()),
        Op::FindLsb => lanes!(map1, integer::find_lsb),
        Op::FindUMsb => lanes!(map1, integer::find_unsigned_msb),
        Op::FindSMsb => lanes!(map1, integer::find_signed_msb),
        Op::BitfieldInsert => |simd, file, dst, src| {
            simd.vectorize(
                #[inline(always)]
                move || integer::bitfield_insert(*file, dst, src),
            );
        },
        Op::BitfieldSExtract => lanes!(map3, integer::signed_bitfield),
        Op::BitfieldUExtract => lanes!(map3, integer::unsigned_bitfield),
        Op::SExt8 => lanes!(map1, |a: u32| i32::from(a as u8 as i8)),
        Op::SExt16 => lanes!(map1, |a: u32| i32::from(a as u16 as i16)),
        Op::FRem => lanes!(map2, |a: f32, b: f32| a % b),
        Op::FMod => lanes!(map2, |a: f32, b: f32| {
            let r = a % b;
            if r != 0.0 && (r < 0.0) != (b < 0.0) {
                r + b
            } else {
                r
            }
        }),
        Op::FLdexp => lanes!(map2, transcendental::ldexp),
        Op::FFrexpSignificand => lanes!(map1, |a: f32| transcendental::frexp(a).0),
        Op::FFrexpExponent => lanes!(map1, |a: f32| transcendental::frexp(a).1),
        Op::FToF16 => lanes!(map1, |a: f32| {
            u32::from(half::f16::from_f32(a).to_bits())
        }),
        Op::F16ToF => lanes!(map1, |a: u32| { half::f16::from_bits(a as u16).to_f32() }),
        Op::RoundToF16 => lanes!(map1, |a: f32| half::f16::from_f32(a).to_f32()),
        // Every other operation has been taken.
        _ => {
            debug_assert!(false, "{} has no kernel", op.name());
            |_, _, _, _| {}
        }
    }
}
