//! Elementary functions of 32-bit floats, 16 lanes at a time.
//!
//! Arguments are reduced to a small range, in which a short polynomial with the coefficients of the Cephes library is
//! evaluated. The largest errors against `f64`, which the tests check by dense sampling, are a few units in the last
//! place. The Vulkan specification allows 3 + 2|x| ULP (exp), 3 ULP (log), 2^-11 absolute (sin, cos) and 4096 ULP
//! (inverse trigonometric functions).

use crate::kernels::float::FusedMultiply;
use fearless_simd::{Simd, f32x16, i32x16, mask32x16, prelude::*, u32x16};
use std::f32::consts::{FRAC_2_PI, FRAC_PI_2, FRAC_PI_4, LN_2, LOG2_E, PI, SQRT_2};

use super::float::round_ties_even;
use super::registers::{Kernel, vector1, vector2};
use crate::ir::op::Op;

type F<S> = f32x16<S>;
type I<S> = i32x16<S>;
type U<S> = u32x16<S>;
type M<S> = mask32x16<S>;

/// Reports whether an operation is an elementary function.
pub fn is_one(op: Op) -> bool {
    (Op::FExp as u8..=Op::FAtanh as u8).contains(&(op as u8))
}

/// The kernel of an elementary function.
pub fn kernel<S: Simd>(op: Op) -> Kernel<S> {
    macro_rules! unary {
        ($function:ident) => {
            |simd, file, dst, src| {
                simd.vectorize(
                    #[inline(always)]
                    move || {
                        vector1(
                            simd,
                            *file,
                            dst,
                            src,
                            #[inline(always)]
                            |a: U<S>| $function::<S>(a.bitcast()).bitcast(),
                        )
                    },
                )
            }
        };
    }
    macro_rules! binary {
        ($function:ident) => {
            |simd, file, dst, src| {
                simd.vectorize(
                    #[inline(always)]
                    move || {
                        vector2(
                            simd,
                            *file,
                            dst,
                            src,
                            #[inline(always)]
                            |a: U<S>, b: U<S>| $function::<S>(a.bitcast(), b.bitcast()).bitcast(),
                        )
                    },
                )
            }
        };
    }
    match op {
        Op::FExp => unary!(exp),
        Op::FExp2 => unary!(exp2),
        Op::FLog => unary!(log),
        Op::FLog2 => unary!(log2),
        Op::FPow => binary!(pow),
        Op::FSin => unary!(sin),
        Op::FCos => unary!(cos),
        Op::FTan => unary!(tan),
        Op::FAsin => unary!(asin),
        Op::FAcos => unary!(acos),
        Op::FAtan => unary!(atan),
        Op::FAtan2 => binary!(atan2),
        Op::FSinh => unary!(sinh),
        Op::FCosh => unary!(cosh),
        Op::FTanh => unary!(tanh),
        Op::FAsinh => unary!(asinh),
        Op::FAcosh => unary!(acosh),
        Op::FAtanh => unary!(atanh),
        _ => {
            debug_assert!(false, "{} isn't a transcendental function", op.name());
            |_, _, _, _| {}
        }
    }
}

#[inline(always)]
fn splat<S: Simd>(like: F<S>, value: f32) -> F<S> {
    F::splat(like.simd, value)
}

/// A polynomial, highest coefficient first.
#[inline(always)]
fn polynomial<S: Simd, const N: usize>(x: F<S>, coefficients: [f32; N]) -> F<S> {
    let mut sum = splat(x, coefficients[0]);
    for coefficient in &coefficients[1..] {
        sum = sum.fused_add(x, splat(x, *coefficient));
    }
    sum
}

/// `x` with the sign of `sign`.
#[inline(always)]
fn with_sign<S: Simd>(x: F<S>, sign: F<S>) -> F<S> {
    x.copysign(sign)
}

/// 2 to an integral power from -126 to 127.
#[inline(always)]
fn power_of_two<S: Simd>(exponent: I<S>) -> F<S> {
    ((exponent + 127) << 23).bitcast()
}

/// `x * 2^exponent` for |exponent| up to 252; rounds once where the result is denormal.
#[inline(always)]
fn scale<S: Simd>(x: F<S>, exponent: I<S>) -> F<S> {
    let half = exponent >> 1;
    x * power_of_two(half) * power_of_two(exponent - half)
}

/// The greatest number whose exponential is finite.
const GREATEST_EXPONENT: f32 = 88.722_83;

/// `e^x * 2^bias`.
#[inline(always)]
fn exp_biased<S: Simd>(x: F<S>, bias: i32) -> F<S> {
    let clamped = x.max(splat(x, -104.0)).min(splat(x, 90.0));
    let n = round_ties_even(clamped * LOG2_E);
    let r = n.fused_add(splat(x, -0.693_359_4), clamped);
    let r = n.fused_add(splat(x, 2.121_944_4e-4), r);
    let p = polynomial(r, [1.987_569_1e-4, 1.398_2e-3, 8.333_452e-3, 4.166_579_6e-2, 1.666_666_5e-1, 5e-1]);
    let y = (r * r).fused_add(p, r) + 1.0;
    let y = scale(y, I::truncate_from(n) + bias);
    x.is_nan().select(x, y)
}

#[inline(always)]
fn exp<S: Simd>(x: F<S>) -> F<S> {
    exp_biased(x, 0)
}

#[inline(always)]
fn exp2<S: Simd>(x: F<S>) -> F<S> {
    let clamped = x.max(splat(x, -151.0)).min(splat(x, 129.0));
    let n = round_ties_even(clamped);
    let r = clamped - n;
    let y = polynomial(
        r,
        [1.535_336_2e-4, 1.339_887_4e-3, 9.618_437e-3, 5.550_332_5e-2, 2.402_264_8e-1, 6.931_472e-1, 1.0],
    );
    x.is_nan().select(x, scale(y, I::truncate_from(n)))
}

/// `x = 2^exponent (1 + fraction)` with 1 + fraction from sqrt(1/2) to sqrt(2); and `polynomial`, such that
/// log(1 + fraction) = fraction + polynomial.
struct Logarithm<S: Simd> {
    exponent: F<S>,
    fraction: F<S>,
    polynomial: F<S>,
}

#[inline(always)]
fn logarithm<S: Simd>(x: F<S>) -> Logarithm<S> {
    let denormal = x.simd_lt(splat(x, f32::MIN_POSITIVE));
    let normal = denormal.select(x * 16_777_216.0, x);
    let bits = normal.bitcast::<I<S>>();
    // Subtracting the bits of sqrt(1/2) makes the exponent change there.
    let shifted = bits - 0x3f35_04f3;
    let exponent = F::float_from(shifted >> 23) - denormal.select(splat(x, 24.0), splat(x, 0.0));
    let mantissa = ((shifted & 0x007f_ffff) + 0x3f35_04f3).bitcast::<F<S>>();
    let f = mantissa - 1.0;
    let z = f * f;
    let p = polynomial(
        f,
        [
            7.037_683_6e-2,
            -1.151_461e-1,
            1.167_699_8e-1,
            -1.242_014_1e-1,
            1.424_932_3e-1,
            -1.666_805_7e-1,
            2.000_071_5e-1,
            -2.499_999_4e-1,
            3.333_333e-1,
        ],
    );
    let p = z.fused_add(splat(x, -0.5), p * f * z);
    Logarithm { exponent, fraction: f, polynomial: p }
}

/// The special cases of logarithms: zero, negatives, infinity, NaN.
#[inline(always)]
fn logarithm_or_special<S: Simd>(x: F<S>, y: F<S>) -> F<S> {
    let infinity = splat(x, f32::INFINITY);
    let y = x.simd_lt(infinity).select(y, x);
    let y = x.simd_eq(splat(x, 0.0)).select(-infinity, y);
    x.simd_lt(splat(x, 0.0)).select(splat(x, f32::NAN), y)
}

#[inline(always)]
fn log<S: Simd>(x: F<S>) -> F<S> {
    let Logarithm { exponent, fraction, polynomial } = logarithm(x);
    let low = exponent.fused_add(splat(x, -2.121_944_4e-4), polynomial);
    let y = exponent.fused_add(splat(x, 0.693_359_4), fraction + low);
    logarithm_or_special(x, y)
}

#[inline(always)]
fn log2<S: Simd>(x: F<S>) -> F<S> {
    let Logarithm { exponent, fraction, polynomial } = logarithm(x);
    // log2(e) - 1: splitting off 1 keeps the larger part exact.
    let excess = splat(x, LOG2_E - 1.0);
    let low = (polynomial * excess) + fraction * excess;
    let y = low + polynomial + fraction + exponent;
    logarithm_or_special(x, y)
}

#[inline(always)]
fn pow<S: Simd>(x: F<S>, y: F<S>) -> F<S> {
    let result = exp2(y * log2(x));
    y.simd_eq(splat(x, 0.0)).select(splat(x, 1.0), result)
}

/// The angle reduced to -pi/4 to pi/4, and the number of quarter turns that were removed.
#[inline(always)]
fn reduce<S: Simd>(x: F<S>) -> (F<S>, I<S>) {
    let n = round_ties_even(x * FRAC_2_PI);
    let r = n.fused_add(splat(x, -1.570_312_5), x);
    let r = n.fused_add(splat(x, -4.837_513e-4), r);
    let r = n.fused_add(splat(x, -7.549_79e-8), r);
    (r, I::truncate_from(n))
}

/// Above this the reduction loses accuracy.
const LARGEST_ANGLE: f32 = 8192.0;

/// `y`, except where `x` is too large for [`reduce`]: there, `exact` of `x`.
#[inline(always)]
fn or_exact<S: Simd>(x: F<S>, y: F<S>, exact: fn(f64) -> f64) -> F<S> {
    let small = x.abs().simd_le(splat(x, LARGEST_ANGLE));
    if small.all_true() {
        return y;
    }
    let wide: [f32; 16] = std::array::from_fn(|lane| exact(f64::from(x[lane])) as f32);
    small.select(y, F::simd_from(x.simd, wide))
}

#[inline(always)]
fn sine_polynomial<S: Simd>(r: F<S>, z: F<S>) -> F<S> {
    (polynomial(z, [-1.951_529_6e-4, 8.332_161e-3, -1.666_665_5e-1]) * z).fused_add(r, r)
}

#[inline(always)]
fn cosine_polynomial<S: Simd>(z: F<S>) -> F<S> {
    let p = polynomial(z, [2.443_315_7e-5, -1.388_731_6e-3, 4.166_664_6e-2]);
    (p * z).fused_add(z, z * -0.5) + 1.0
}

/// The sine of `x` plus `quarters` quarter turns.
#[inline(always)]
fn sine_after<S: Simd>(x: F<S>, quarters: i32) -> F<S> {
    let (r, n) = reduce(x);
    let n = n + quarters;
    let z = r * r;
    let odd: M<S> = (n & 1).simd_eq(I::splat(x.simd, 1));
    let y = odd.select(cosine_polynomial(z), sine_polynomial(r, z));
    let sign = (n & 2) << 30;
    (y.bitcast::<I<S>>() ^ sign).bitcast()
}

#[inline(always)]
fn sin<S: Simd>(x: F<S>) -> F<S> {
    let y = or_exact(x, sine_after(x, 0), libm::sin);
    x.simd_eq(splat(x, 0.0)).select(x, y)
}

#[inline(always)]
fn cos<S: Simd>(x: F<S>) -> F<S> {
    or_exact(x, sine_after(x, 1), libm::cos)
}

#[inline(always)]
fn tan<S: Simd>(x: F<S>) -> F<S> {
    let (r, n) = reduce(x);
    let z = r * r;
    let p = polynomial(z, [9.385_402e-3, 3.119_922_4e-3, 2.443_013_5e-2, 5.341_128e-2, 1.333_88e-1, 3.333_315_7e-1]);
    let y = (p * z).fused_add(r, r);
    let odd: M<S> = (n & 1).simd_eq(I::splat(x.simd, 1));
    let y = or_exact(x, odd.select(splat(x, -1.0) / y, y), libm::tan);
    x.simd_eq(splat(x, 0.0)).select(x, y)
}

/// Arc sine of up to 1/2.
#[inline(always)]
fn asin_polynomial<S: Simd>(x: F<S>, z: F<S>) -> F<S> {
    let p = polynomial(z, [4.216_32e-2, 2.418_131_2e-2, 4.547_002_6e-2, 7.495_3e-2, 1.666_675_2e-1]);
    (p * z).fused_add(x, x)
}

#[inline(always)]
fn asin<S: Simd>(x: F<S>) -> F<S> {
    let a = x.abs();
    let large = a.simd_gt(splat(x, 0.5));
    let half = (splat(x, 1.0) - a) * 0.5;
    let z = large.select(half, a * a);
    let root = large.select(half.sqrt(), a);
    let y = asin_polynomial(root, z);
    let y = large.select(splat(x, FRAC_PI_2) - y * 2.0, y);
    with_sign(y, x)
}

#[inline(always)]
fn acos<S: Simd>(x: F<S>) -> F<S> {
    let a = x.abs();
    let large = a.simd_gt(splat(x, 0.5));
    let half = (splat(x, 1.0) - a) * 0.5;
    let z = large.select(half, a * a);
    let root = large.select(half.sqrt(), a);
    let y = asin_polynomial(root, z);
    let negative = x.simd_lt(splat(x, 0.0));
    let double = y * 2.0;
    let beyond = negative.select(splat(x, PI) - double, double);
    let within = splat(x, FRAC_PI_2) - with_sign(y, x);
    large.select(beyond, within)
}

/// Arc tangent of a non-negative number.
#[inline(always)]
fn atan_positive<S: Simd>(t: F<S>) -> F<S> {
    let one = splat(t, 1.0);
    let large = t.simd_gt(splat(t, 2.414_213_7));
    let middle = t.simd_gt(splat(t, 0.414_213_57));
    let numerator = large.select(-one, middle.select(t - one, t));
    let denominator = large.select(t, middle.select(t + one, one));
    let base = large.select(splat(t, FRAC_PI_2), middle.select(splat(t, FRAC_PI_4), splat(t, 0.0)));
    let x = numerator / denominator;
    let z = x * x;
    let p = polynomial(z, [8.053_744_5e-2, -1.387_768_6e-1, 1.997_771e-1, -3.333_295e-1]);
    base + (p * z).fused_add(x, x)
}

#[inline(always)]
fn atan<S: Simd>(x: F<S>) -> F<S> {
    with_sign(atan_positive(x.abs()), x)
}

#[inline(always)]
fn atan2<S: Simd>(y: F<S>, x: F<S>) -> F<S> {
    let (ax, ay) = (x.abs(), y.abs());
    let is_y_larger = ay.simd_gt(ax);
    let (small, large) = (is_y_larger.select(ax, ay), is_y_larger.select(ay, ax));
    let equal = small.simd_eq(large);
    let zero = large.simd_eq(splat(x, 0.0));
    // 0/0 and infinity/infinity have an angle, too.
    let ratio = equal.select(zero.select(splat(x, 0.0), splat(x, 1.0)), small / large);
    let angle = atan_positive(ratio);
    let angle = is_y_larger.select(splat(x, FRAC_PI_2) - angle, angle);
    let angle = x.is_sign_negative().select(splat(x, PI) - angle, angle);
    let angle = with_sign(angle, y);
    (x.is_nan() | y.is_nan()).select(splat(x, f32::NAN), angle)
}

/// Half of `e^x`, infinite where `e^x` overflows: Vulkan derives hyperbolic functions from exponentials.
#[inline(always)]
fn half_of_exp<S: Simd>(x: F<S>) -> F<S> {
    let overflows = x.simd_gt(splat(x, GREATEST_EXPONENT));
    overflows.select(splat(x, f32::INFINITY), exp_biased(x, -1))
}

#[inline(always)]
fn sinh<S: Simd>(x: F<S>) -> F<S> {
    let a = x.abs();
    let z = x * x;
    let near = (polynomial(z, [2.037_219_1e-4, 8.330_284e-3, 1.666_671_6e-1]) * z).fused_add(a, a);
    let half = half_of_exp(a);
    let far = half - splat(x, 0.25) / half;
    with_sign(a.simd_lt(splat(x, 1.0)).select(near, far), x)
}

#[inline(always)]
fn cosh<S: Simd>(x: F<S>) -> F<S> {
    let half = half_of_exp(x.abs());
    half + splat(x, 0.25) / half
}

#[inline(always)]
fn tanh<S: Simd>(x: F<S>) -> F<S> {
    let a = x.abs();
    let z = x * x;
    let p = polynomial(z, [-5.704_988_7e-3, 2.063_909e-2, -5.373_971_6e-2, 1.333_144_2e-1, -3.333_328e-1]);
    let near = (p * z).fused_add(a, a);
    let far = splat(x, 1.0) - splat(x, 2.0) / (exp(a + a) + 1.0);
    with_sign(a.simd_lt(splat(x, 0.625)).select(near, far), x)
}

#[inline(always)]
fn asinh<S: Simd>(x: F<S>) -> F<S> {
    let a = x.abs();
    let z = x * x;
    let p = polynomial(z, [2.012_200_3e-2, -4.269_934e-2, 7.484_759e-2, -1.666_628_8e-1]);
    let near = (p * z).fused_add(a, a);
    let huge = a.simd_gt(splat(x, 1500.0));
    let sum = huge.select(a, a + (z + 1.0).sqrt());
    let far = log(sum) + huge.select(splat(x, LN_2), splat(x, 0.0));
    with_sign(a.simd_lt(splat(x, 0.5)).select(near, far), x)
}

#[inline(always)]
fn acosh<S: Simd>(x: F<S>) -> F<S> {
    let t = x - 1.0;
    let p = polynomial(t, [1.759_688_1e-3, -7.527_288_7e-3, 2.645_490_5e-2, -1.178_474_2e-1, SQRT_2]);
    let near = p * t.sqrt();
    let huge = x.simd_gt(splat(x, 1500.0));
    let sum = huge.select(x, x + (t * (x + 1.0)).sqrt());
    let far = log(sum) + huge.select(splat(x, LN_2), splat(x, 0.0));
    let y = t.simd_lt(splat(x, 0.5)).select(near, far);
    t.simd_lt(splat(x, 0.0)).select(splat(x, f32::NAN), y)
}

#[inline(always)]
fn atanh<S: Simd>(x: F<S>) -> F<S> {
    let a = x.abs();
    let z = x * x;
    let p = polynomial(z, [1.817_400_8e-1, 8.243_703e-2, 1.466_914_3e-1, 1.997_821_6e-1, 3.333_373e-1]);
    let near = (p * z).fused_add(a, a);
    let one = splat(x, 1.0);
    let far = log((one + a) / (one - a)) * 0.5;
    with_sign(a.simd_lt(splat(x, 0.5)).select(near, far), x)
}

/// `a * 2^exponent`, rounded once: exact in `f64`.
#[inline(always)]
pub fn ldexp(a: f32, exponent: i32) -> f32 {
    let power = f64::from_bits(((exponent.clamp(-600, 600) + 1023) as u64) << 52);
    (f64::from(a) * power) as f32
}

/// The significand in [0.5, 1) and the exponent.
#[inline(always)]
pub fn frexp(a: f32) -> (f32, i32) {
    if a == 0.0 || !a.is_finite() {
        return (a, 0);
    }
    // Every denormal is a normal f64.
    let bits = f64::from(a).to_bits();
    let exponent = (bits >> 52 & 0x7ff) as i32 - 1022;
    (f64::from_bits(bits & !(0x7ff << 52) | 1022 << 52) as f32, exponent)
}
