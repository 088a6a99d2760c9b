//! Floating-point arithmetic and comparisons.

use super::rows::What::{Core, Glsl};
use super::rows::{each, row};
use gaurast_tests::programs::precision::{Interval, exactly, format};
use gaurast_tests::programs::types::{Kind, Ty};
use gaurast_tests::programs::{Expect, Row};
use spirv::{GlslStd450Op as G, Op};
use std::cmp::Ordering::{self, Equal, Greater, Less};

/// A shape for each kind, so that all sizes of vectors occur.
pub fn shape(kind: Kind) -> Ty {
    match kind {
        Kind::F16 => Ty::vector(kind, 2),
        Kind::F32 => Ty::vector(kind, 3),
        _ => Ty::scalar(kind),
    }
}

/// The correctly rounded result, as bits.
pub fn correct(kind: Kind, value: f64) -> Expect {
    Expect::Is(kind.round(value))
}

/// The correctly rounded result, or zero of either sign for a zero.
pub fn correct_but_sign_of_zero(kind: Kind, value: f64) -> Expect {
    match value {
        0.0 => Expect::OneOf(vec![kind.round(0.0), kind.round(-0.0)]),
        value => correct(kind, value),
    }
}

type Arithmetic = fn(f64, f64) -> f64;

const ARITHMETIC: &[(Op, Arithmetic)] = &[(Op::FAdd, |a, b| a + b), (Op::FSub, |a, b| a - b), (Op::FMul, |a, b| a * b)];

/// A relation of two numbers that are compared; `None` if one of them is NaN.
type Relation = fn(Option<Ordering>) -> bool;

const COMPARISONS: &[(Op, Relation)] = &[
    (Op::FOrdEqual, |order| order == Some(Equal)),
    (Op::FUnordEqual, |order| matches!(order, None | Some(Equal))),
    (Op::FOrdNotEqual, |order| matches!(order, Some(Less | Greater))),
    (Op::FUnordNotEqual, |order| order != Some(Equal)),
    (Op::FOrdLessThan, |order| order == Some(Less)),
    (Op::FUnordLessThan, |order| matches!(order, None | Some(Less))),
    (Op::FOrdGreaterThan, |order| order == Some(Greater)),
    (Op::FUnordGreaterThan, |order| matches!(order, None | Some(Greater))),
    (Op::FOrdLessThanEqual, |order| matches!(order, Some(Less | Equal))),
    (Op::FUnordLessThanEqual, |order| order != Some(Greater)),
    (Op::FOrdGreaterThanEqual, |order| matches!(order, Some(Greater | Equal))),
    (Op::FUnordGreaterThanEqual, |order| order != Some(Less)),
];

pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for kind in Kind::FLOATS {
        let ty = shape(kind);
        let truth = ty.of(Kind::Bool);
        for (op, model) in ARITHMETIC {
            rows.push(each(Core(*op), &[ty, ty], ty, move |v| {
                correct(kind, model(kind.float(v[0]), kind.float(v[1])))
            }));
        }
        for (op, model) in COMPARISONS {
            rows.push(each(Core(*op), &[ty, ty], truth, move |v| {
                let order = kind.float(v[0]).partial_cmp(&kind.float(v[1]));
                Expect::Is(u64::from(model(order)))
            }));
        }
        rows.extend([
            each(Core(Op::FNegate), &[ty], ty, move |v| correct(kind, -kind.float(v[0]))),
            each(Core(Op::IsNan), &[ty], truth, move |v| Expect::Is(u64::from(kind.float(v[0]).is_nan()))),
            each(Core(Op::IsInf), &[ty], truth, move |v| Expect::Is(u64::from(kind.float(v[0]).is_infinite()))),
            each(Core(Op::FDiv), &[ty, ty], ty, move |v| quotient(kind, kind.float(v[0]), kind.float(v[1]))),
            each(Core(Op::FRem), &[ty, ty], ty, move |v| {
                let (x, y) = (kind.float(v[0]), kind.float(v[1]));
                modulo(kind, [x, y], x % y, f64::trunc)
            }),
            each(Core(Op::FMod), &[ty, ty], ty, move |v| {
                let (x, y) = (kind.float(v[0]), kind.float(v[1]));
                let rest = x % y;
                let truth = if rest != 0.0 && (rest < 0.0) != (y < 0.0) { rest + y } else { rest };
                modulo(kind, [x, y], truth, f64::floor)
            }),
            fused_by_hand(kind, ty),
        ]);
        rows.extend(minimum_and_maximum(kind, ty));
    }
    rows
}

fn quotient(kind: Kind, x: f64, y: f64) -> Expect {
    match format(kind).div(exactly(x), exactly(y)) {
        Some(within) if x.is_finite() => Expect::Within(within),
        Some(_) => correct(kind, x / y),
        None => Expect::Any,
    }
}

/// `x - y round(x / y)`.
fn modulo(kind: Kind, [x, y]: [f64; 2], truth: f64, round: fn(f64) -> f64) -> Expect {
    let p = format(kind);
    let formula = || {
        let quotient = p.rounded(p.div(exactly(x), exactly(y))?);
        let whole = Interval { low: round(quotient.low), high: round(quotient.high) };
        p.sub(exactly(x), p.mul(exactly(y), whole)?)
    };
    p.inherited(truth, formula()).into()
}

/// A product and a sum, which may be fused unless they are decorated.
fn fused_by_hand(kind: Kind, ty: Ty) -> Row {
    row(
        format!("FMul FAdd without contraction {kind:?}"),
        &[ty, ty, ty],
        &[ty],
        move |body, v| {
            let id = body.ty(ty);
            let product = body.asm.emit(Op::FMul, id, &v[..2]);
            let sum = body.asm.emit(Op::FAdd, id, &[product, v[2]]);
            for id in [product, sum] {
                let decoration = spirv::Decoration::NoContraction;
                body.asm.decorate(id, decoration, &[]);
            }
            vec![sum]
        },
        move |v| {
            (0..ty.count())
                .map(|k| {
                    let [a, b, c] = [0, 1, 2].map(|index| kind.float(v[index][k]));
                    let product = kind.float(kind.round(a * b));
                    correct(kind, product + c)
                })
                .collect()
        },
    )
}

fn minimum_and_maximum(kind: Kind, ty: Ty) -> Vec<Row> {
    // For zeros of both signs either may be the result. If one operand is NaN, FMin may give either, and NMin gives the
    // other.
    let pick = move |v: &[u64], number: bool, least: bool| {
        let (a, b) = (kind.float(v[0]), kind.float(v[1]));
        match (a.is_nan(), b.is_nan()) {
            (true, true) => Expect::Is(v[0]),
            (true, _) if number => Expect::Is(v[1]),
            (_, true) if number => Expect::Is(v[0]),
            (false, false) if a != b => Expect::Is(if (a < b) == least { v[0] } else { v[1] }),
            _ => Expect::OneOf(vec![v[0], v[1]]),
        }
    };
    let clamp = move |v: &[u64], number: bool| {
        let [x, low, high] = [0, 1, 2].map(|index| kind.float(v[index]));
        // Zeros of both signs are equal.
        let equal_to = |value: f64| {
            let equal = v.iter().filter(|bits| kind.float(**bits) == value);
            Expect::OneOf(equal.copied().collect())
        };
        match x {
            _ if low.is_nan() || high.is_nan() || low > high => Expect::Any,
            x if x.is_nan() && number => equal_to(low),
            x if x.is_nan() => Expect::OneOf(v.to_vec()),
            x => equal_to(x.clamp(low, high)),
        }
    };
    let two = [ty, ty];
    let three = [ty, ty, ty];
    vec![
        each(Glsl(G::FMin), &two, ty, move |v| pick(v, false, true)),
        each(Glsl(G::FMax), &two, ty, move |v| pick(v, false, false)),
        each(Glsl(G::NMin), &two, ty, move |v| pick(v, true, true)),
        each(Glsl(G::NMax), &two, ty, move |v| pick(v, true, false)),
        each(Glsl(G::FClamp), &three, ty, move |v| clamp(v, false)),
        each(Glsl(G::NClamp), &three, ty, move |v| clamp(v, true)),
    ]
}
