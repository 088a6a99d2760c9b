//! Runs arithmetic: one kernel for each operation.
//!
//! 32-bit operations that vectors have are written with vectors of 16 lanes; the rest lane by lane, which the compiler
//! vectorises where it can. The commonest are part of the loop over the steps; the others are in functions of their own, a
//! call being little beside them.

use fearless_simd::{Simd, f32x16, i32x16, mask32x16, prelude::*, u32x16};

use super::super::op::{Kind, Op};
use super::file::{File, Slot, from_mask, map1, map2, map3, to_mask, vector1, vector2, vector3};
use super::{integer, transcendental, wide};

type U<S> = u32x16<S>;
type I<S> = i32x16<S>;
type F<S> = f32x16<S>;

/// An operation's operands.
#[derive(Clone, Copy)]
struct Kernel<'a, S: Simd> {
    simd: S,
    file: File<'a>,
    dst: Slot,
    src: &'a [Slot; 4],
}

// The shapes of operation: what the operands are read as, and what the result is.
macro_rules! word {
    ($k:ident, |$a:ident| $value:expr) => {
        vector1(
            $k.simd,
            $k.file,
            $k.dst,
            $k.src,
            #[inline(always)]
            |$a: U<S>| $value,
        )
    };
    ($k:ident, |$a:ident, $b:ident| $value:expr) => {
        vector2(
            $k.simd,
            $k.file,
            $k.dst,
            $k.src,
            #[inline(always)]
            |$a: U<S>, $b: U<S>| $value,
        )
    };
    ($k:ident, |$a:ident, $b:ident, $c:ident| $value:expr) => {
        vector3(
            $k.simd,
            $k.file,
            $k.dst,
            $k.src,
            #[inline(always)]
            |$a: U<S>, $b: U<S>, $c: U<S>| $value,
        )
    };
}
macro_rules! float {
    ($k:ident, |$a:ident| $value:expr) => {
        word!($k, |a| {
            let $a = a.bitcast::<F<S>>();
            let r: F<S> = $value;
            r.bitcast()
        })
    };
    ($k:ident, |$a:ident, $b:ident| $value:expr) => {
        word!($k, |a, b| {
            let ($a, $b) = (a.bitcast::<F<S>>(), b.bitcast::<F<S>>());
            let r: F<S> = $value;
            r.bitcast()
        })
    };
    ($k:ident, |$a:ident, $b:ident, $c:ident| $value:expr) => {
        word!($k, |a, b, c| {
            let ($a, $b, $c) = (
                a.bitcast::<F<S>>(),
                b.bitcast::<F<S>>(),
                c.bitcast::<F<S>>(),
            );
            let r: F<S> = $value;
            r.bitcast()
        })
    };
}
macro_rules! float_test {
    ($k:ident, |$a:ident| $value:expr) => {
        word!($k, |a| {
            let $a = a.bitcast::<F<S>>();
            let r: mask32x16<S> = $value;
            from_mask(r)
        })
    };
    ($k:ident, |$a:ident, $b:ident| $value:expr) => {
        word!($k, |a, b| {
            let ($a, $b) = (a.bitcast::<F<S>>(), b.bitcast::<F<S>>());
            let r: mask32x16<S> = $value;
            from_mask(r)
        })
    };
}
macro_rules! signed {
    ($k:ident, |$a:ident| $value:expr) => {
        word!($k, |a| {
            let $a = a.bitcast::<I<S>>();
            let r: I<S> = $value;
            r.bitcast()
        })
    };
    ($k:ident, |$a:ident, $b:ident| $value:expr) => {
        word!($k, |a, b| {
            let ($a, $b) = (a.bitcast::<I<S>>(), b.bitcast::<I<S>>());
            let r: I<S> = $value;
            r.bitcast()
        })
    };
}

/// `dst = op(src...)`, all lanes.
#[inline(always)]
pub fn compute<S: Simd>(simd: S, file: File<'_>, op: Op, dst: Slot, src: &[Slot; 4]) {
    let k = Kernel {
        simd,
        file,
        dst,
        src,
    };
    match op {
        Op::BAnd | Op::And => word!(k, |a, b| a & b),
        Op::BOr | Op::Or => word!(k, |a, b| a | b),
        Op::BXor | Op::Xor => word!(k, |a, b| a ^ b),
        Op::BNot | Op::Not => word!(k, |a| !a),
        Op::BSelect | Op::Select => word!(k, |c, a, b| to_mask(c).select(a, b)),
        Op::IAdd => word!(k, |a, b| a + b),
        Op::ISub => word!(k, |a, b| a - b),
        Op::IMul => word!(k, |a, b| a * b),
        Op::INeg => word!(k, |a| U::splat(k.simd, 0) - a),
        Op::SMin => signed!(k, |a, b| a.min(b)),
        Op::SMax => signed!(k, |a, b| a.max(b)),
        Op::UMin => word!(k, |a, b| a.min(b)),
        Op::UMax => word!(k, |a, b| a.max(b)),
        Op::IEq => word!(k, |a, b| from_mask(a.simd_eq(b))),
        Op::INe => word!(k, |a, b| !from_mask(a.simd_eq(b))),
        Op::SLt => word!(k, |a, b| from_mask(
            a.bitcast::<I<S>>().simd_lt(b.bitcast::<I<S>>())
        )),
        Op::SLe => word!(k, |a, b| from_mask(
            a.bitcast::<I<S>>().simd_le(b.bitcast::<I<S>>())
        )),
        Op::ULt => word!(k, |a, b| from_mask(a.simd_lt(b))),
        Op::ULe => word!(k, |a, b| from_mask(a.simd_le(b))),
        Op::FAdd => float!(k, |a, b| a + b),
        Op::FSub => float!(k, |a, b| a - b),
        Op::FMul => float!(k, |a, b| a * b),
        Op::FFma => float!(k, |a, b, c| a.mul_add(b, c)),
        Op::FMulSub => float!(k, |a, b, c| a.mul_sub(b, c)),
        Op::FNegMulAdd => float!(k, |a, b, c| (-a).mul_add(b, c)),
        Op::FDiv => float!(k, |a, b| a / b),
        Op::FNeg => float!(k, |a| -a),
        Op::FAbs => float!(k, |a| a.abs()),
        Op::FMin => float!(k, |a, b| a.min_precise(b)),
        Op::FMax => float!(k, |a, b| a.max_precise(b)),
        Op::FSqrt => float!(k, |a| a.sqrt()),
        Op::FEq => float_test!(k, |a, b| a.simd_eq(b)),
        Op::FNe => word!(k, |a, b| !from_mask(
            a.bitcast::<F<S>>().simd_eq(b.bitcast::<F<S>>())
        )),
        Op::FLt => float_test!(k, |a, b| a.simd_lt(b)),
        Op::FLe => float_test!(k, |a, b| a.simd_le(b)),
        _ => simd.vectorize(
            #[inline(always)]
            || less_common(k, op),
        ),
    }
}

/// Operations that are rarer, or long at the lower SIMD levels.
#[inline(always)]
fn less_common<S: Simd>(k: Kernel<'_, S>, op: Op) {
    match op {
        Op::SAbs => signed!(k, |a| a.abs()),
        Op::Shl => word!(k, |a, b| a << (b & 31)),
        Op::UShr => word!(k, |a, b| a >> (b & 31)),
        Op::SShr => word!(k, |a, b| (a.bitcast::<I<S>>()
            >> (b & 31).bitcast::<I<S>>())
        .bitcast()),
        Op::UAddCarry => word!(k, |a, b| from_mask((a + b).simd_lt(a)) & 1),
        Op::USubBorrow => word!(k, |a, b| from_mask(a.simd_lt(b)) & 1),
        Op::FSign => float!(k, |a| {
            let zero = F::splat(k.simd, 0.0);
            let one = a.simd_gt(zero).select(F::splat(k.simd, 1.0), zero);
            a.simd_lt(zero).select(F::splat(k.simd, -1.0), one)
        }),
        Op::FFloor => float!(k, |a| a.floor()),
        Op::FCeil => float!(k, |a| a.ceil()),
        Op::FTrunc => float!(k, |a| a.trunc()),
        Op::FRoundEven => float!(k, |a| a.round_ties_even()),
        Op::FFract => float!(k, |a| a - a.floor()),
        Op::FInverseSqrt => float!(k, |a| F::splat(k.simd, 1.0) / a.sqrt()),
        Op::FLtGt => float_test!(k, |a, b| a.simd_lt(b) | b.simd_lt(a)),
        Op::FIsNan => float_test!(k, |a| a.is_nan()),
        Op::FIsInf => float_test!(k, |a| a.is_infinite()),
        Op::FToS => word!(k, |a| I::truncate_from_precise(a.bitcast::<F<S>>())
            .bitcast()),
        Op::FToU => word!(k, |a| U::truncate_from_precise(a.bitcast::<F<S>>())),
        Op::SToF => word!(k, |a| F::float_from(a.bitcast::<I<S>>()).bitcast()),
        Op::UToF => word!(k, |a| F::float_from(a).bitcast()),
        _ if op.kind() == Kind::Wide => k.simd.vectorize(
            #[inline(always)]
            || wide::run(k.file, op, k.dst, k.src),
        ),
        _ if transcendental::is_one(op) => k.simd.vectorize(
            #[inline(always)]
            || transcendental::run(k.simd, k.file, op, k.dst, k.src),
        ),
        _ => k.simd.vectorize(
            #[inline(always)]
            || by_lane(k.file, op, k.dst, k.src),
        ),
    }
}

/// 32-bit operations that vectors don't have.
#[inline(always)]
fn by_lane(file: File<'_>, op: Op, dst: Slot, src: &[Slot; 4]) {
    match op {
        Op::UDiv => map2(file, dst, src, |a: u32, b: u32| {
            a.checked_div(b).unwrap_or(u32::MAX)
        }),
        Op::URem => map2(file, dst, src, |a: u32, b: u32| {
            a.checked_rem(b).unwrap_or(a)
        }),
        Op::SDiv => map2(
            file,
            dst,
            src,
            |a: i32, b: i32| if b == 0 { -1 } else { a.wrapping_div(b) },
        ),
        Op::SRem => map2(
            file,
            dst,
            src,
            |a: i32, b: i32| if b == 0 { a } else { a.wrapping_rem(b) },
        ),
        Op::SMod => map2(file, dst, src, integer::floor_mod),
        Op::UMulHi => map2(file, dst, src, |a: u32, b: u32| {
            ((u64::from(a) * u64::from(b)) >> 32) as u32
        }),
        Op::SMulHi => map2(file, dst, src, |a: i32, b: i32| {
            ((i64::from(a) * i64::from(b)) >> 32) as i32
        }),
        Op::SSign => map1(file, dst, src, i32::signum),
        Op::BitReverse => map1(file, dst, src, u32::reverse_bits),
        Op::BitCount => map1(file, dst, src, |a: u32| a.count_ones()),
        Op::FindLsb => map1(file, dst, src, integer::find_lsb),
        Op::FindUMsb => map1(file, dst, src, integer::find_unsigned_msb),
        Op::FindSMsb => map1(file, dst, src, integer::find_signed_msb),
        Op::BitfieldInsert => integer::bitfield_insert(file, dst, src),
        Op::BitfieldSExtract => map3(file, dst, src, integer::signed_bitfield),
        Op::BitfieldUExtract => map3(file, dst, src, integer::unsigned_bitfield),
        Op::SExt8 => map1(file, dst, src, |a: u32| i32::from(a as u8 as i8)),
        Op::SExt16 => map1(file, dst, src, |a: u32| i32::from(a as u16 as i16)),
        Op::FRem => map2(file, dst, src, |a: f32, b: f32| a % b),
        Op::FMod => map2(file, dst, src, |a: f32, b: f32| {
            let r = a % b;
            if r != 0.0 && (r < 0.0) != (b < 0.0) {
                r + b
            } else {
                r
            }
        }),
        Op::FLdexp => map2(file, dst, src, transcendental::ldexp),
        Op::FFrexpSignificand => map1(file, dst, src, |a: f32| transcendental::frexp(a).0),
        Op::FFrexpExponent => map1(file, dst, src, |a: f32| transcendental::frexp(a).1),
        Op::FToF16 => map1(file, dst, src, |a: f32| {
            u32::from(half::f16::from_f32(a).to_bits())
        }),
        Op::F16ToF => map1(file, dst, src, |a: u32| {
            half::f16::from_bits(a as u16).to_f32()
        }),
        Op::RoundToF16 => map1(file, dst, src, |a: f32| half::f16::from_f32(a).to_f32()),
        // Every other operation has been taken.
        _ => debug_assert!(false, "{} has no kernel", op.name()),
    }
}
