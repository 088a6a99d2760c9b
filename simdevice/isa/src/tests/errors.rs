//! The errors of elementary functions in units in the last place, against binary64: the table of `docs/arithmetic.md`.
//!
//! `GAURAST_TEST_LONG=1` takes every argument, and prints each function's greatest error and the thousand arguments with
//! the greatest ones, which `worst_errors.py` compares with MPFR.

use std::ops::Range;

use gaurast_runner::{Case, Variant, is_long};

use super::transcendental::{LANES, program};
use super::{machine, run};
use crate::level::SimdLevel;
use crate::op::Op;
use crate::resources::Resources;

/// The number of arguments with the greatest errors that are kept.
const KEPT: usize = 1000;

/// A function, and what is promised of it.
struct Function {
    op: Op,
    exact: fn(f64) -> f64,
    /// The arguments, as ranges of bits.
    arguments: &'static [Range<u32>],
    /// The greatest error of all arguments in units in the last place, rounded up to two digits after the point.
    limit: f64,
    /// Results of a smaller magnitude have the unit in the last place of this one.
    least: f64,
}

/// Bits of floats: zero, one, infinity, and their negatives.
const ZERO: u32 = 0;
const ONE: u32 = 0x3f80_0000;
const INFINITY: u32 = 0x7f80_0000;
const NEGATIVE: u32 = 0x8000_0000;
/// From here on sines are rounded from binary64 (`elementary::LARGEST_ANGLE`).
const FAR: u32 = 0x4600_0000;

/// The functions of one argument. Those that are odd or even take positive arguments only; sines and cosines, whose
/// zeros lie between floats, err by an absolute amount.
#[expect(clippy::single_range_in_vec_init, reason = "a list of ranges of arguments, of which most functions have one")]
const FUNCTIONS: &[Function] = &[
    Function {
        op: Op::FExp,
        exact: f64::exp,
        arguments: &[ZERO..0x42b4_0000, NEGATIVE..0xc2d4_0000],
        limit: 1.02,
        least: 0.0,
    },
    Function {
        op: Op::FExp2,
        exact: f64::exp2,
        arguments: &[ZERO..0x4302_0000, NEGATIVE..0xc318_0000],
        limit: 0.96,
        least: 0.0,
    },
    Function { op: Op::FLog, exact: f64::ln, arguments: &[1..INFINITY], limit: 0.89, least: 0.0 },
    Function { op: Op::FLog2, exact: f64::log2, arguments: &[1..INFINITY], limit: 1.62, least: 0.0 },
    Function { op: Op::FSin, exact: f64::sin, arguments: &[ZERO..FAR], limit: 1.32, least: 0.5 },
    Function { op: Op::FCos, exact: f64::cos, arguments: &[ZERO..FAR], limit: 1.32, least: 0.5 },
    Function { op: Op::FTan, exact: f64::tan, arguments: &[ZERO..0x3fc0_0000], limit: 2.40, least: 0.0 },
    Function { op: Op::FAsin, exact: f64::asin, arguments: &[ZERO..ONE + 1], limit: 2.37, least: 0.0 },
    Function {
        op: Op::FAcos,
        exact: f64::acos,
        arguments: &[ZERO..ONE + 1, NEGATIVE..NEGATIVE + ONE + 1],
        limit: 1.28,
        least: 0.0,
    },
    Function { op: Op::FAtan, exact: f64::atan, arguments: &[ZERO..INFINITY + 1], limit: 2.82, least: 0.0 },
    Function { op: Op::FSinh, exact: f64::sinh, arguments: &[ZERO..0x42b1_7217], limit: 1.62, least: 0.0 },
    Function { op: Op::FCosh, exact: f64::cosh, arguments: &[ZERO..0x42b1_7217], limit: 1.47, least: 0.0 },
    Function { op: Op::FTanh, exact: f64::tanh, arguments: &[ZERO..INFINITY + 1], limit: 1.34, least: 0.0 },
    Function { op: Op::FAsinh, exact: f64::asinh, arguments: &[ZERO..INFINITY], limit: 3.79, least: 0.0 },
    Function { op: Op::FAcosh, exact: f64::acosh, arguments: &[ONE..INFINITY], limit: 2.36, least: 0.0 },
    Function { op: Op::FAtanh, exact: f64::atanh, arguments: &[ZERO..ONE], limit: 1.32, least: 0.0 },
    Function { op: Op::FInverseSqrt, exact: |x| 1.0 / x.sqrt(), arguments: &[1..INFINITY], limit: 1.50, least: 0.0 },
];

/// An argument's error in units in the last place.
#[derive(Clone, Copy, Debug)]
struct Error {
    ulps: f64,
    x: f32,
    got: f32,
}

/// The distance of binary32 numbers at a magnitude.
fn ulp(magnitude: f64) -> f64 {
    let exponent = (magnitude.to_bits() >> 52) as i64 - 1023;
    f64::from_bits(((exponent.clamp(-126, 127) - 23 + 1023) as u64) << 52)
}

impl Function {
    /// The arguments with the greatest errors, the greatest first.
    fn worst(&self, step: u64) -> Vec<Error> {
        let level = SimdLevel::Best.resolve().expect("a level of this processor");
        let mut machine = machine(&program(self.op), level, LANES);
        let mut worst = Vec::new();
        let mut least = -1.0;
        for range in self.arguments {
            let mut next = u64::from(range.start);
            while next < u64::from(range.end) {
                let at = |lane: usize| (next + step * lane as u64).min(u64::from(range.end) - 1) as u32;
                for lane in 0..LANES {
                    machine.set_input(0, lane, at(lane));
                }
                run(&mut machine, LANES, &Resources::default());
                for lane in 0..LANES {
                    let (x, got) = (f32::from_bits(at(lane)), f32::from_bits(machine.output(0, lane)));
                    let ulps = self.error(x, got);
                    if ulps.total_cmp(&least).is_gt() {
                        worst.push(Error { ulps, x, got });
                        if worst.len() == 2 * KEPT {
                            least = keep(&mut worst);
                        }
                    }
                }
                next += step * LANES as u64;
            }
        }
        keep(&mut worst);
        worst
    }

    fn error(&self, x: f32, got: f32) -> f64 {
        let exact = (self.exact)(f64::from(x));
        if got == exact as f32 && got.is_infinite() {
            return 0.0;
        }
        (f64::from(got) - exact).abs() / ulp(exact.abs().max(self.least))
    }
}

/// Keeps the greatest errors, sorted, and returns the least of them. NaN is greater than all.
fn keep(errors: &mut Vec<Error>) -> f64 {
    errors.sort_by(|a, b| b.ulps.total_cmp(&a.ulps));
    errors.dedup_by_key(|error| error.x.to_bits());
    errors.truncate(KEPT);
    errors.last().map_or(-1.0, |error| error.ulps)
}

/// A variant for each function.
fn functions() -> Vec<Variant> {
    FUNCTIONS.iter().map(|function| Variant::new(function.op.name())).collect()
}

#[gaurast_runner::test(each = functions())]
fn functions_err_by_what_the_documentation_says(case: &Case) {
    let function = FUNCTIONS.iter().find(|function| function.op.name() == case.variant()).expect("a function");
    let name = function.op.name();
    let worst = function.worst(if is_long() { 1 } else { 50_021 });
    let Error { ulps, x, got } = worst[0];
    if is_long() {
        println!("greatest,{name},{ulps:.4},{x:e},{got:e}");
        for Error { ulps, x, got } in &worst {
            println!("worst,{name},{},{},{ulps:.6}", x.to_bits(), got.to_bits());
        }
    }
    assert!(ulps <= function.limit, "{name} of {x:e}: {got:e} errs by {ulps:.3} ulp");
}
