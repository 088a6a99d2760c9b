//! Integers, bits and Booleans.

use super::rows::What::{Core, Glsl};
use super::rows::{each, row, whole};
use gaurast_tests::programs::inputs::Domain;
use gaurast_tests::programs::types::{Kind, Ty};
use gaurast_tests::programs::{Expect, Row};
use spirv::{GlslStd450Op as G, Op};

/// The result of two integers; `None` if it is undefined.
type Two = fn(i128, i128) -> Option<i128>;

/// The interpretation of an instruction's operands.
#[derive(Clone, Copy, PartialEq)]
enum Sees {
    /// By their type.
    Typed,
    /// Signed, whatever the type.
    Signed,
    /// Unsigned, with an unsigned type.
    Unsigned,
}

const TWO: &[(Op, Sees, Two)] = &[
    (Op::IAdd, Sees::Typed, |a, b| Some(a + b)),
    (Op::ISub, Sees::Typed, |a, b| Some(a - b)),
    (Op::IMul, Sees::Typed, |a, b| Some(a.wrapping_mul(b))),
    (Op::SDiv, Sees::Signed, divide),
    (Op::UDiv, Sees::Unsigned, divide),
    (Op::UMod, Sees::Unsigned, |a, b| a.checked_rem(b)),
    // Vulkan leaves remainders of negative numbers undefined.
    (Op::SRem, Sees::Signed, remainder),
    (Op::SMod, Sees::Signed, remainder),
    (Op::BitwiseOr, Sees::Typed, |a, b| Some(a | b)),
    (Op::BitwiseXor, Sees::Typed, |a, b| Some(a ^ b)),
    (Op::BitwiseAnd, Sees::Typed, |a, b| Some(a & b)),
];

fn divide(a: i128, b: i128) -> Option<i128> {
    a.checked_div(b)
}

fn remainder(a: i128, b: i128) -> Option<i128> {
    (a >= 0 && b > 0).then(|| a % b)
}

type Relation = fn(i128, i128) -> bool;

const COMPARISONS: &[(Op, Sees, Relation)] = &[
    (Op::IEqual, Sees::Typed, |a, b| a == b),
    (Op::INotEqual, Sees::Typed, |a, b| a != b),
    (Op::UGreaterThan, Sees::Unsigned, |a, b| a > b),
    (Op::SGreaterThan, Sees::Signed, |a, b| a > b),
    (Op::UGreaterThanEqual, Sees::Unsigned, |a, b| a >= b),
    (Op::SGreaterThanEqual, Sees::Signed, |a, b| a >= b),
    (Op::ULessThan, Sees::Unsigned, |a, b| a < b),
    (Op::SLessThan, Sees::Signed, |a, b| a < b),
    (Op::ULessThanEqual, Sees::Unsigned, |a, b| a <= b),
    (Op::SLessThanEqual, Sees::Signed, |a, b| a <= b),
];

const GLSL: &[(G, Sees, Two)] = &[
    (G::SMin, Sees::Signed, |a, b| Some(a.min(b))),
    (G::SMax, Sees::Signed, |a, b| Some(a.max(b))),
    (G::UMin, Sees::Unsigned, |a, b| Some(a.min(b))),
    (G::UMax, Sees::Unsigned, |a, b| Some(a.max(b))),
];

/// A shape for each kind, so that all sizes of vectors occur.
fn shape(kind: Kind) -> Ty {
    let rows = match kind {
        Kind::U8 => 4,
        Kind::U16 | Kind::I64 => 2,
        Kind::I32 => 3,
        _ => 1,
    };
    Ty::vector(kind, rows)
}

/// The kind as which an instruction interprets its operands.
fn seen(kind: Kind, sees: Sees) -> Option<Kind> {
    match sees {
        Sees::Typed => Some(kind),
        Sees::Signed => Some(kind.with_sign(true)),
        Sees::Unsigned => (!kind.is_signed()).then_some(kind),
    }
}

fn outcome(kind: Kind, value: Option<i128>) -> Expect {
    value.map_or(Expect::Any, |value| Expect::Is(kind.wrap(value)))
}

pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for kind in Kind::INTEGERS {
        let ty = shape(kind);
        for (op, sees, model) in TWO {
            let Some(seen) = seen(kind, *sees) else {
                continue;
            };
            rows.push(each(Core(*op), &[ty, ty], ty, move |v| {
                // The most negative number divided by -1 cannot be represented.
                let value = model(seen.integer(v[0]), seen.integer(v[1]));
                let lost = matches!(op, Op::SDiv) && value == Some(1 << (kind.bits() - 1));
                outcome(kind, value.filter(|_| !lost))
            }));
        }
        for (op, sees, model) in COMPARISONS {
            let Some(seen) = seen(kind, *sees) else {
                continue;
            };
            rows.push(each(Core(*op), &[ty, ty], ty.of(Kind::Bool), move |v| {
                let truth = model(seen.integer(v[0]), seen.integer(v[1]));
                Expect::Is(u64::from(truth))
            }));
        }
        for (op, sees, model) in GLSL {
            if seen(kind, *sees).is_some_and(|seen| seen == kind) {
                rows.push(each(Glsl(*op), &[ty, ty], ty, move |v| {
                    outcome(kind, model(kind.integer(v[0]), kind.integer(v[1])))
                }));
            }
        }
        rows.extend(one_operand(kind, ty));
        rows.extend(shifts(kind, ty));
    }
    rows.extend(Kind::INTEGERS.into_iter().filter(|kind| kind.bits() == 32).flat_map(bits));
    rows.extend(extended());
    rows.extend(logic());
    rows
}

fn one_operand(kind: Kind, ty: Ty) -> Vec<Row> {
    let signed = kind.with_sign(true);
    let mut rows = vec![
        each(Core(Op::Not), &[ty], ty, move |v| Expect::Is(!v[0] & kind.mask())),
        each(Core(Op::SNegate), &[ty], ty, move |v| outcome(kind, Some(-signed.integer(v[0])))),
    ];
    if kind.is_signed() {
        rows.extend([
            each(Glsl(G::SAbs), &[ty], ty, move |v| outcome(kind, Some(kind.integer(v[0]).abs()))),
            each(Glsl(G::SSign), &[ty], ty, move |v| outcome(kind, Some(kind.integer(v[0]).signum()))),
        ]);
    }
    let clamp = if kind.is_signed() { G::SClamp } else { G::UClamp };
    rows.push(each(Glsl(clamp), &[ty, ty, ty], ty, move |v| {
        let [x, low, high] = [0, 1, 2].map(|index| kind.integer(v[index]));
        outcome(kind, (low <= high).then(|| x.clamp(low, high)))
    }));
    rows
}

fn shifts(kind: Kind, ty: Ty) -> Vec<Row> {
    let amounts = Domain::Integers(0, i128::from(kind.bits()) - 1);
    type Shift = fn(Kind, u64, u64) -> i128;
    let models: [(Op, Shift); 3] = [
        (Op::ShiftLeftLogical, |kind, a, by| kind.integer(a) << by),
        (Op::ShiftRightLogical, |kind, a, by| kind.with_sign(false).integer(a) >> by),
        (Op::ShiftRightArithmetic, |kind, a, by| kind.with_sign(true).integer(a) >> by),
    ];
    models
        .into_iter()
        .map(|(op, model)| {
            each(Core(op), &[ty, ty], ty, move |v| outcome(kind, Some(model(kind, v[0], v[1])))).of(1, amounts)
        })
        .collect()
}

/// Instructions that support only 32 bits.
fn bits(kind: Kind) -> Vec<Row> {
    let ty = Ty::vector(kind, 2);
    let count = Ty::scalar(Kind::U32);
    let find = |value: u64| match value as u32 {
        0 => u64::from(u32::MAX),
        value => u64::from(31 - value.leading_zeros()),
    };
    let any = Domain::Integers(0, 32);
    let extract = |signed: bool| {
        move |v: &[Vec<u64>]| {
            let (at, width) = (v[1][0], v[2][0]);
            let one = |value: &u64| {
                if at + width > 32 {
                    return Expect::Any;
                }
                let part = value >> at & ((1 << width) - 1);
                let negative = signed && width > 0 && part >> (width - 1) & 1 == 1;
                let above = if negative { u64::MAX << width } else { 0 };
                Expect::Is((part | above) & 0xffff_ffff)
            };
            v[0].iter().map(one).collect()
        }
    };
    vec![
        each(Core(Op::BitReverse), &[ty], ty, |v| Expect::Is(u64::from((v[0] as u32).reverse_bits()))),
        each(Core(Op::BitCount), &[ty], ty, |v| Expect::Is(u64::from(v[0].count_ones()))),
        each(Glsl(G::FindILsb), &[ty], ty, |v| {
            Expect::Is(match v[0] {
                0 => u64::from(u32::MAX),
                value => u64::from(value.trailing_zeros()),
            })
        }),
        each(Glsl(G::FindUMsb), &[ty], ty, move |v| Expect::Is(find(v[0]))),
        each(Glsl(G::FindSMsb), &[ty], ty, move |v| {
            let negative = v[0] >> 31 == 1;
            Expect::Is(find(if negative { !v[0] } else { v[0] }))
        }),
        whole(Core(Op::BitFieldSExtract), &[ty, count, count], ty, extract(true)).of(1, any).of(2, any),
        whole(Core(Op::BitFieldUExtract), &[ty, count, count], ty, extract(false)).of(1, any).of(2, any),
        whole(Core(Op::BitFieldInsert), &[ty, ty, count, count], ty, |v| {
            let (at, width) = (v[2][0], v[3][0]);
            let mask = ((1 << width) - 1) << at;
            let one = |(base, part): (&u64, &u64)| match at + width > 32 {
                true => Expect::Any,
                false => Expect::Is(base & !mask | part << at & mask),
            };
            v[0].iter().zip(&v[1]).map(one).collect()
        })
        .of(2, any)
        .of(3, any),
    ]
}

/// Instructions with two results.
fn extended() -> Vec<Row> {
    type Both = fn(i128, i128) -> [i128; 2];
    let all: [(Op, Kind, Both); 4] = [
        (Op::IAddCarry, Kind::U32, |a, b| [a + b, (a + b) >> 32]),
        (Op::ISubBorrow, Kind::U32, |a, b| [a - b, i128::from(a < b)]),
        (Op::UMulExtended, Kind::U32, |a, b| [a * b, (a * b) >> 32]),
        (Op::SMulExtended, Kind::I32, |a, b| [a * b, (a * b) >> 32]),
    ];
    all.into_iter()
        .map(|(op, kind, model)| {
            let ty = Ty::vector(kind, 2);
            row(
                format!("{op:?}"),
                &[ty, ty],
                &[ty, ty],
                move |body, operands| {
                    let part = body.ty(ty);
                    let both = body.asm.declare(Op::TypeStruct, None, &[part, part]);
                    let result = body.asm.emit(op, both, operands);
                    [0, 1].map(|index| body.asm.emit(Op::CompositeExtract, part, &[result, index])).to_vec()
                },
                move |v| {
                    let value = |k: usize| model(kind.integer(v[0][k]), kind.integer(v[1][k]));
                    let place = |half: usize, k: usize| Expect::Is(kind.wrap(value(k)[half]));
                    vec![place(0, 0), place(0, 1), place(1, 0), place(1, 1)]
                },
            )
        })
        .collect()
}

fn logic() -> Vec<Row> {
    let ty = Ty::vector(Kind::Bool, 4);
    let one = Ty::scalar(Kind::Bool);
    type Both = fn(u64, u64) -> u64;
    let two: [(Op, Both); 4] = [
        (Op::LogicalOr, |a, b| a | b),
        (Op::LogicalAnd, |a, b| a & b),
        (Op::LogicalEqual, |a, b| 1 - (a ^ b)),
        (Op::LogicalNotEqual, |a, b| a ^ b),
    ];
    let mut rows: Vec<Row> = two
        .into_iter()
        .map(|(op, model)| each(Core(op), &[ty, ty], ty, move |v| Expect::Is(model(v[0], v[1]))))
        .collect();
    rows.extend([
        each(Core(Op::LogicalNot), &[ty], ty, |v| Expect::Is(1 - v[0])),
        whole(Core(Op::Any), &[ty], one, |v| vec![Expect::Is(u64::from(v[0].contains(&1)))]),
        whole(Core(Op::All), &[ty], one, |v| vec![Expect::Is(u64::from(!v[0].contains(&0)))]),
    ]);
    for kind in [Kind::Bool, Kind::I16, Kind::U64, Kind::F16, Kind::F32, Kind::F64] {
        let value = Ty::vector(kind, 3);
        rows.push(each(Core(Op::Select), &[Ty::vector(Kind::Bool, 3), value, value], value, |v| {
            Expect::Is(if v[0] != 0 { v[1] } else { v[2] })
        }));
        rows.push(whole(Core(Op::Select), &[one, value, value], value, |v| {
            let picked = if v[0][0] != 0 { &v[1] } else { &v[2] };
            picked.iter().map(|bits| Expect::Is(*bits)).collect()
        }));
    }
    rows
}
