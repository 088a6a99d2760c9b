//! Conversions between types.

use super::rows::What::Core;
use super::rows::{each, whole};
use gaurast_tests::programs::inputs::Domain;
use gaurast_tests::programs::precision::{HALF, exactly};
use gaurast_tests::programs::types::{Kind, Ty};
use gaurast_tests::programs::{Expect, Row};
use spirv::Op;

pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for float in Kind::FLOATS {
        for integer in Kind::INTEGERS {
            rows.extend(between(float, integer));
        }
        for other in Kind::FLOATS.into_iter().filter(|other| *other != float) {
            rows.extend(between_floats(float, other));
        }
    }
    for from in Kind::INTEGERS {
        let wider = Kind::INTEGERS.into_iter().filter(|to| to.bits() != from.bits());
        for to in wider {
            rows.extend(between_integers(from, to));
        }
    }
    rows.push(quantized());
    rows.extend(bit_casts());
    rows
}

/// The value of an integer in a float, correctly rounded.
fn float_of(kind: Kind, value: i128) -> u64 {
    match kind {
        Kind::F32 => u64::from((value as f32).to_bits()),
        // A value outside the range of doubles is infinite as a half.
        kind => kind.round(value as f64),
    }
}

fn between(float: Kind, integer: Kind) -> Vec<Row> {
    let (floats, integers) = (Ty::vector(float, 2), Ty::vector(integer, 2));
    let (to, from) = match integer.is_signed() {
        true => (Op::ConvertFToS, Op::ConvertSToF),
        false => (Op::ConvertFToU, Op::ConvertUToF),
    };
    let to_integer = move |v: &[u64]| {
        let whole = float.float(v[0]).trunc();
        let bits = i32::try_from(integer.bits()).expect("few");
        let (low, high) = match integer.is_signed() {
            true => (-2f64.powi(bits - 1), 2f64.powi(bits - 1)),
            false => (0.0, 2f64.powi(bits)),
        };
        // A value outside the integer's range gives an undefined result.
        if whole >= low && whole < high { Expect::Is(integer.wrap(whole as i128)) } else { Expect::Any }
    };
    let most = 2f64.powi(i32::try_from(integer.bits()).expect("few")).min(65504.0);
    let mut within = each(Core(to), &[floats], integers, to_integer).of(0, Domain::Floats(-most, most));
    within.name += " in range";
    vec![
        each(Core(to), &[floats], integers, to_integer),
        within,
        each(Core(from), &[integers], floats, move |v| Expect::Is(float_of(float, integer.integer(v[0])))),
    ]
}

fn between_floats(from: Kind, to: Kind) -> Vec<Row> {
    let model = move |v: &[u64]| Expect::Is(to.round(from.float(v[0])));
    let (source, target) = (Ty::vector(from, 2), Ty::vector(to, 2));
    let mut rows = vec![each(Core(Op::FConvert), &[source], target, model)];
    if from.bits() > to.bits() {
        // Numbers near the midpoint of two narrower ones, for which rounding twice gives a wrong result.
        let mut row = each(Core(Op::FConvert), &[source], target, model).of(0, Domain::NearTies(to));
        row.name += " near ties";
        rows.push(row);
    }
    rows
}

fn between_integers(from: Kind, to: Kind) -> Vec<Row> {
    let (source, target) = (Ty::vector(from, 3), Ty::vector(to, 3));
    let signed = from.with_sign(true);
    let mut rows = Vec::new();
    if !to.is_signed() && !from.is_signed() {
        rows.push(each(Core(Op::UConvert), &[source], target, move |v| Expect::Is(to.wrap(from.integer(v[0])))));
    }
    if from.is_signed() || to.is_signed() {
        rows.push(each(Core(Op::SConvert), &[source], target, move |v| Expect::Is(to.wrap(signed.integer(v[0])))));
    }
    rows
}

/// Rounding to half precision: either neighbour is allowed, and zero in place of a denormal.
fn quantized() -> Row {
    let ty = Ty::vector(Kind::F32, 2);
    each(Core(Op::QuantizeToF16), &[ty], ty, |v| {
        let value = Kind::F32.float(v[0]);
        let zero = Kind::F32.round(0.0_f64.copysign(value));
        if !value.is_finite() {
            return Expect::Is(v[0]);
        }
        let near = HALF.rounded(exactly(value));
        let mut all: Vec<u64> = [near.low, near.high].into_iter().map(|value| Kind::F32.round(value)).collect();
        if value.abs() < Kind::F16.least_normal() {
            all.retain(|bits| Kind::F32.float(*bits).abs() >= Kind::F16.least_normal());
            all.push(zero);
        }
        if value.abs() > 65504.0 {
            all.push(Kind::F32.round(65504f64.copysign(value)));
        }
        Expect::OneOf(all)
    })
}

/// A signaling NaN as a quiet one; most operations may make this change.
fn quiet(kind: Kind, bits: u64) -> u64 {
    match kind {
        kind if kind.is_float() && kind.float(bits).is_nan() => {
            bits | kind.round(f64::NAN) & !kind.round(f64::INFINITY)
        }
        _ => bits,
    }
}

fn bit_casts() -> Vec<Row> {
    use Kind::{F16, F32, F64, I8, I16, I32, I64, U8, U16, U32, U64};
    let pairs = [
        ((F32, 1), (U32, 1)),
        ((U32, 3), (F32, 3)),
        ((I32, 2), (U32, 2)),
        ((F64, 1), (U64, 1)),
        ((I64, 2), (F64, 2)),
        ((F16, 2), (I16, 2)),
        ((U16, 3), (F16, 3)),
        ((I8, 4), (U8, 4)),
        ((F16, 2), (U32, 1)),
        ((U32, 2), (U64, 1)),
        ((F64, 1), (U32, 2)),
        ((U16, 4), (U64, 1)),
        ((I16, 4), (F32, 2)),
        ((U8, 4), (F32, 1)),
        ((U32, 1), (I8, 4)),
        ((F32, 2), (F16, 4)),
        ((U64, 2), (I32, 4)),
    ];
    pairs
        .into_iter()
        .map(|((from, count), (to, results))| {
            let (source, target) = (Ty::vector(from, count), Ty::vector(to, results));
            let mut row = whole(Core(Op::Bitcast), &[source], target, move |v| {
                let cast = |components: &[u64]| -> Vec<u64> {
                    let whole =
                        components.iter().rev().fold(0u128, |whole, part| whole << from.bits() | u128::from(*part));
                    (0..results).map(|index| (whole >> (index * to.bits())) as u64 & to.mask()).collect()
                };
                let quieted: Vec<u64> = v[0].iter().map(|bits| quiet(from, *bits)).collect();
                let pairs = cast(&v[0]).into_iter().zip(cast(&quieted));
                pairs.map(|(same, quieted)| Expect::OneOf(vec![same, quieted])).collect()
            });
            row.flushes = false;
            row
        })
        .collect()
}
