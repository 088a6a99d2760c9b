//! 64-bit operations and conversions, lane by lane.

use std::cmp::Ordering;

use fearless_simd::Simd;

use super::super::op::Op;
use super::compute::{Kernel, lanes};
use super::file::{map1, map2, map3};
use super::integer::floor_mod64;

/// The kernel of a 64-bit operation or conversion.
pub fn kernel<S: Simd>(op: Op) -> Kernel<S> {
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
        Op::Join64 => lanes!(map2, |low: u32, high: u32| {
            u64::from(low) | u64::from(high) << 32
        }),

        Op::FAdd64 => lanes!(map2, |a: f64, b: f64| a + b),
        Op::FSub64 => lanes!(map2, |a: f64, b: f64| a - b),
        Op::FMul64 => lanes!(map2, |a: f64, b: f64| a * b),
        Op::FDiv64 => lanes!(map2, |a: f64, b: f64| a / b),
        Op::FFma64 => lanes!(map3, |a: f64, b: f64, c: f64| a.mul_add(b, c)),
        Op::FRem64 => lanes!(map2, |a: f64, b: f64| a % b),
        Op::FMod64 => lanes!(map2, |a: f64, b: f64| {
            let r = a % b;
            if r != 0.0 && (r < 0.0) != (b < 0.0) {
                r + b
            } else {
                r
            }
        }),
        Op::FNeg64 => lanes!(map1, |a: f64| -a),
        Op::FAbs64 => lanes!(map1, f64::abs),
        Op::FSign64 => lanes!(map1, |a: f64| {
            f64::from(i8::from(a > 0.0) - i8::from(a < 0.0))
        }),
        Op::FFloor64 => lanes!(map1, f64::floor),
        Op::FCeil64 => lanes!(map1, f64::ceil),
        Op::FTrunc64 => lanes!(map1, f64::trunc),
        Op::FRoundEven64 => lanes!(map1, f64::round_ties_even),
        Op::FFract64 => lanes!(map1, |a: f64| a - a.floor()),
        Op::FMin64 => lanes!(map2, f64::min),
        Op::FMax64 => lanes!(map2, f64::max),
        Op::FSqrt64 => lanes!(map1, f64::sqrt),
        Op::FEq64 => lanes!(map2, |a: f64, b: f64| a == b),
        Op::FNe64 => lanes!(map2, |a: f64, b: f64| a != b),
        Op::FLt64 => lanes!(map2, |a: f64, b: f64| a < b),
        Op::FLe64 => lanes!(map2, |a: f64, b: f64| a <= b),
        Op::FLtGt64 => lanes!(map2, |a: f64, b: f64| {
            a.partial_cmp(&b).is_some_and(Ordering::is_ne)
        }),
        Op::FIsNan64 => lanes!(map1, f64::is_nan),
        Op::FIsInf64 => lanes!(map1, f64::is_infinite),
        Op::FLdexp64 => lanes!(map2, ldexp),
        Op::FFrexpSignificand64 => lanes!(map1, |a: f64| frexp(a).0),
        Op::FFrexpExponent64 => lanes!(map1, |a: f64| frexp(a).1),

        Op::IAdd64 => lanes!(map2, u64::wrapping_add),
        Op::ISub64 => lanes!(map2, u64::wrapping_sub),
        Op::IMul64 => lanes!(map2, u64::wrapping_mul),
        Op::INeg64 => lanes!(map1, u64::wrapping_neg),
        Op::SAbs64 => lanes!(map1, i64::wrapping_abs),
        Op::SSign64 => lanes!(map1, i64::signum),
        Op::UDiv64 => lanes!(map2, |a: u64, b: u64| {
            a.checked_div(b).unwrap_or(u64::MAX)
        }),
        Op::URem64 => lanes!(map2, |a: u64, b: u64| { a.checked_rem(b).unwrap_or(a) }),
        Op::SDiv64 => lanes!(map2, |a: i64, b: i64| if b == 0 {
            -1
        } else {
            a.wrapping_div(b)
        },),
        Op::SRem64 => lanes!(map2, |a: i64, b: i64| if b == 0 {
            a
        } else {
            a.wrapping_rem(b)
        },),
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
        // Every other operation is 32-bit, and `compute` has taken it.
        _ => {
            debug_assert!(false, "{} isn't a 64-bit operation", op.name());
            |_, _, _, _| {}
        }
    }
}

/// The significand in [0.5, 1) and the exponent.
fn frexp(a: f64) -> (f64, i32) {
    if a == 0.0 || !a.is_finite() {
        return (a, 0);
    }
    // Denormals are scaled to normal numbers first.
    let (scaled, bias) = if a.abs() < f64::MIN_POSITIVE {
        (a * 2f64.powi(64), -64)
    } else {
        (a, 0)
    };
    let bits = scaled.to_bits();
    let exponent = (bits >> 52 & 0x7ff) as i32 - 1022;
    (
        f64::from_bits(bits & !(0x7ff << 52) | 1022 << 52),
        exponent + bias,
    )
}

/// `a * 2^exponent`, rounded once.
fn ldexp(a: f64, exponent: i32) -> f64 {
    let (significand, own) = frexp(a);
    if significand == 0.0 || !significand.is_finite() {
        return a;
    }
    let total = own.saturating_add(exponent);
    // The last factor alone may round: it brings a normal number into the denormal range.
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
