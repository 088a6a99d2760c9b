//! Elementary functions against `f64`: dense samples over all floats, in units in the last place.

use crate::builder::Builder;
use crate::ir::{Program, Rate, Type};
use crate::op::Op;
use crate::resources::Resources;

use gaurast_runner::Case;

use super::reference::by_exponential;
use super::{Random, level, machine, run};

pub const LANES: usize = 1024;

/// A program of one operation.
pub fn program(op: Op) -> Program {
    let mut b = Builder::new();
    let src: Vec<_> =
        (0..op.signature().operands.len() as u32).map(|slot| b.input(slot, Type::B32, Rate::Varying)).collect();
    let result = b.compute(op, &src);
    let out = b.output(0, Type::B32);
    b.assign(out, result);
    b.finish().expect("a valid program")
}

/// Runs a function on arguments (pairs; the second is ignored if it takes one). Calls `check(x, y, result)`.
fn for_each_result(case: &Case, op: Op, arguments: &[(f32, f32)], mut check: impl FnMut(f32, f32, f32)) {
    let (_, level) = level(case);
    let program = program(op);
    let mut machine = machine(&program, level, LANES);
    for batch in arguments.chunks(LANES) {
        for (lane, (x, y)) in batch.iter().enumerate() {
            machine.set_input(0, lane, x.to_bits());
            machine.set_input(1, lane, y.to_bits());
        }
        run(&mut machine, LANES, &Resources::default());
        for (lane, (x, y)) in batch.iter().enumerate() {
            check(*x, *y, f32::from_bits(machine.output(0, lane)));
        }
    }
}

/// The distance of one float to the next at a magnitude.
fn ulp(value: f64) -> f64 {
    let magnitude = value.abs().clamp(f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX));
    2f64.powi(magnitude.log2().floor() as i32 - 23)
}

/// Floats between two positive ones, and their negatives, evenly spaced by their bits.
fn samples(low: f32, high: f32) -> Vec<(f32, f32)> {
    let (low, high) = (low.to_bits(), high.to_bits());
    let step = ((high - low) / 20_000).max(1) as usize;
    let positive = (low..=high).step_by(step).map(f32::from_bits);
    positive.flat_map(|x| [(x, 0.0), (-x, 0.0)]).collect()
}

/// Asserts that the absolute error is at most `bound(x, exact)`; infinities and NaN must agree.
fn check_error(
    case: &Case,
    op: Op,
    arguments: &[(f32, f32)],
    exact: fn(f64, f64) -> f64,
    bound: impl Fn(f64, f64) -> f64,
) {
    let level = case.variant();
    for_each_result(case, op, arguments, |x, y, got| {
        let expected = exact(f64::from(x), f64::from(y));
        let case = format!("{}({x:e}, {y:e}) at {level}: {got:e}, not {expected:e}", op.name());
        if expected.is_nan() {
            assert!(got.is_nan(), "{case}");
            return;
        }
        assert!(!got.is_nan(), "{case}");
        let rounded = expected as f32;
        if got == rounded {
            return;
        }
        let limit = bound(f64::from(x), expected);
        let overflow = f64::from(f32::MAX) * (1.0 + 2f64.powi(-20));
        let got = if got.is_infinite() { overflow.copysign(f64::from(got)) } else { f64::from(got) };
        let expected = expected.clamp(-overflow, overflow);
        assert!((got - expected).abs() <= limit, "{case}: {:.2} ulp", (got - expected).abs() / ulp(expected));
    });
}

/// An error bound of a number of units in the last place.
fn ulps(count: f64) -> impl Fn(f64, f64) -> f64 {
    move |_, expected| count * ulp(expected)
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn exponentials_and_logarithms(case: &Case) {
    let all = samples(0.0, f32::MAX);
    check_error(case, Op::FExp, &all, |x, _| x.exp(), ulps(2.0));
    check_error(case, Op::FExp2, &all, |x, _| x.exp2(), ulps(2.0));
    check_error(case, Op::FLog, &all, |x, _| x.ln(), ulps(2.0));
    check_error(case, Op::FLog2, &all, |x, _| x.log2(), ulps(3.0));
    let near_one = samples(0.5, 2.0);
    check_error(case, Op::FLog, &near_one, |x, _| x.ln(), ulps(2.0));
    check_error(case, Op::FLog2, &near_one, |x, _| x.log2(), ulps(3.0));
    check_error(case, Op::FExp, &samples(1e-3, 100.0), |x, _| x.exp(), ulps(2.0));
    check_error(case, Op::FExp2, &samples(1e-3, 150.0), |x, _| x.exp2(), ulps(2.0));
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn powers(case: &Case) {
    let mut random = Random(3);
    let mut arguments: Vec<(f32, f32)> = (0..40_000)
        .map(|_| {
            let x = (random.next() as f32 / u64::MAX as f32 * 8.0).exp2();
            (x, random.next() as f32 / u64::MAX as f32 * 16.0 - 8.0)
        })
        .collect();
    arguments.extend([(0.0, 2.0), (1.0, 5.0), (2.0, 0.0), (3.0, 1.0), (f32::INFINITY, 2.0), (f32::INFINITY, -1.0)]);
    // The bound of exp2(y log2(x)): 3 ULP of the logarithm, scaled by y, and 3 + 2|y log2(x)| ULP of the exponential.
    check_error(
        case,
        Op::FPow,
        &arguments,
        |x, y| x.powf(y),
        |_, expected| {
            let exponent = expected.log2().abs();
            (3.0 + 4.0 * exponent) * ulp(expected)
        },
    );
    for_each_result(case, Op::FPow, &[(-2.0, 2.0), (-1.0, 0.5)], |_, _, got| {
        assert!(got.is_nan());
    });
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn trigonometric_functions(case: &Case) {
    let turns = samples(1e-6, std::f32::consts::PI);
    let absolute = |_: f64, expected: f64| 2.0 * ulp(expected).max(2f64.powi(-24));
    check_error(case, Op::FSin, &turns, |x, _| x.sin(), absolute);
    check_error(case, Op::FCos, &turns, |x, _| x.cos(), absolute);
    let far = samples(1.0, 8000.0);
    let far_absolute = |x: f64, expected: f64| absolute(x, expected) + x.abs() * 2f64.powi(-38);
    check_error(case, Op::FSin, &far, |x, _| x.sin(), far_absolute);
    check_error(case, Op::FCos, &far, |x, _| x.cos(), far_absolute);
    let huge = samples(8200.0, f32::MAX);
    check_error(case, Op::FSin, &huge, |x, _| x.sin(), absolute);
    check_error(case, Op::FCos, &huge, |x, _| x.cos(), absolute);
    check_error(case, Op::FTan, &huge, |x, _| x.tan(), ulps(2.0));
    check_error(case, Op::FTan, &samples(1e-6, 1.5), |x, _| x.tan(), ulps(4.0));
    let specials = [(0.0, 0.0), (-0.0, 0.0), (f32::INFINITY, 0.0), (f32::NAN, 0.0)];
    for op in [Op::FSin, Op::FCos, Op::FTan] {
        for_each_result(case, op, &specials, |x, _, got| {
            assert_eq!(got.is_nan(), !x.is_finite(), "{} of {x}", op.name());
            assert!(op == Op::FCos || x != 0.0 || got.to_bits() == x.to_bits(), "{} of {x}", op.name());
        });
    }
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn inverse_trigonometric_functions(case: &Case) {
    let unit = samples(1e-6, 1.0);
    check_error(case, Op::FAsin, &unit, |x, _| x.asin(), ulps(4.0));
    check_error(case, Op::FAcos, &unit, |x, _| x.acos(), |_, expected| 4.0 * ulp(expected.max(0.1)));
    check_error(case, Op::FAtan, &samples(1e-6, f32::MAX), |x, _| x.atan(), ulps(4.0));
    for_each_result(case, Op::FAsin, &[(1.5, 0.0), (-2.0, 0.0), (f32::NAN, 0.0)], |_, _, got| assert!(got.is_nan()));
    let mut random = Random(4);
    let mut points: Vec<(f32, f32)> = (0..40_000)
        .map(|_| (f32::from_bits(random.next() as u32), f32::from_bits(random.next() as u32)))
        .filter(|(y, x)| y.is_finite() && x.is_finite() && (y / x).abs() > 1e-37 && (y / x).abs() < 1e37)
        .collect();
    let corners = [0.0, -0.0, 1.0, -1.0, f32::INFINITY, f32::NEG_INFINITY];
    points.extend(corners.iter().flat_map(|y| corners.iter().map(|x| (*y, *x))));
    check_error(case, Op::FAtan2, &points, f64::atan2, ulps(4.0));
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn hyperbolic_functions(case: &Case) {
    check_error(case, Op::FSinh, &samples(1e-6, 100.0), |x, _| by_exponential(x, f64::sinh), ulps(4.0));
    check_error(case, Op::FCosh, &samples(1e-6, 100.0), |x, _| by_exponential(x, f64::cosh), ulps(4.0));
    check_error(case, Op::FTanh, &samples(1e-6, f32::MAX), |x, _| x.tanh(), ulps(4.0));
    check_error(case, Op::FAsinh, &samples(1e-6, f32::MAX), |x, _| x.asinh(), ulps(4.0));
    check_error(case, Op::FAcosh, &samples(1.0, f32::MAX), |x, _| x.acosh(), ulps(4.0));
    check_error(case, Op::FAtanh, &samples(1e-6, 0.999_999), |x, _| x.atanh(), ulps(4.0));
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn inverse_square_roots(case: &Case) {
    let bound = |_: f64, expected: f64| 2.0 * ulp(expected);
    check_error(case, Op::FInverseSqrt, &samples(f32::MIN_POSITIVE, f32::MAX), |x, _| 1.0 / x.sqrt(), bound);
    for_each_result(case, Op::FInverseSqrt, &[(0.0, 0.0)], |_, _, got| {
        assert_eq!(got, f32::INFINITY);
    });
}
