//! Atomic instructions, with private memory for each invocation: the old value and the new value. (The driver's tests
//! cover many invocations on the same memory.)

use super::rows::row;
use gaurast_tests::programs::types::{Kind, Ty};
use gaurast_tests::programs::{Body, Expect, Row};
use spirv::{Capability, Op};

/// Computes the new value from the old value and the operand.
type Update = fn(Kind, u64, u64) -> u64;

fn pick(kind: Kind, signed: bool, least: bool, [a, b]: [u64; 2]) -> u64 {
    let seen = kind.with_sign(signed);
    let smaller = seen.integer(a) < seen.integer(b);
    if smaller == least { a } else { b }
}

const UPDATES: &[(Op, Update)] = &[
    (Op::AtomicExchange, |_, _, value| value),
    (Op::AtomicIAdd, |_, old, value| old.wrapping_add(value)),
    (Op::AtomicISub, |_, old, value| old.wrapping_sub(value)),
    (Op::AtomicSMin, |kind, old, value| pick(kind, true, true, [old, value])),
    (Op::AtomicUMin, |kind, old, value| pick(kind, false, true, [old, value])),
    (Op::AtomicSMax, |kind, old, value| pick(kind, true, false, [old, value])),
    (Op::AtomicUMax, |kind, old, value| pick(kind, false, false, [old, value])),
    (Op::AtomicAnd, |_, old, value| old & value),
    (Op::AtomicOr, |_, old, value| old | value),
    (Op::AtomicXor, |_, old, value| old ^ value),
    (Op::AtomicIIncrement, |_, old, _| old.wrapping_add(1)),
    (Op::AtomicIDecrement, |_, old, _| old.wrapping_sub(1)),
];

/// Device scope, and no semantics.
fn scope(body: &mut Body) -> [u32; 2] {
    [body.asm.u32(1), body.asm.u32(0)]
}

fn cell_with(body: &mut Body, kind: Kind, value: u32) -> u32 {
    if kind == Kind::U64 {
        body.asm.capability(Capability::Int64Atomics);
    }
    let cell = body.cell(kind);
    body.asm.act(Op::Store, &[cell, value]);
    cell
}

pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for kind in [Kind::U32, Kind::U64] {
        let ty = Ty::scalar(kind);
        for (op, update) in UPDATES {
            rows.push(row(
                format!("{op:?} {kind:?}"),
                &[ty, ty],
                &[ty, ty],
                move |body, v| {
                    let id = body.ty(ty);
                    let cell = cell_with(body, kind, v[0]);
                    let [scope, semantics] = scope(body);
                    let mut operands = vec![cell, scope, semantics];
                    if !matches!(op, Op::AtomicIIncrement | Op::AtomicIDecrement) {
                        operands.push(v[1]);
                    }
                    let old = body.asm.emit(*op, id, &operands);
                    vec![old, body.asm.emit(Op::Load, id, &[cell])]
                },
                move |v| {
                    let new = update(kind, v[0][0], v[1][0]) & kind.mask();
                    vec![Expect::Is(v[0][0]), Expect::Is(new)]
                },
            ));
        }
        rows.push(row(
            format!("AtomicCompareExchange {kind:?}"),
            &[ty, ty, ty],
            &[ty, ty],
            move |body, v| {
                let id = body.ty(ty);
                let cell = cell_with(body, kind, v[0]);
                let [scope, semantics] = scope(body);
                let operands = [cell, scope, semantics, semantics, v[2], v[1]];
                let old = body.asm.emit(Op::AtomicCompareExchange, id, &operands);
                vec![old, body.asm.emit(Op::Load, id, &[cell])]
            },
            |v| {
                let new = if v[0] == v[1] { v[2][0] } else { v[0][0] };
                vec![Expect::Is(v[0][0]), Expect::Is(new)]
            },
        ));
        rows.push(row(
            format!("AtomicStore, AtomicLoad {kind:?}"),
            &[ty],
            &[ty],
            move |body, v| {
                let id = body.ty(ty);
                let cell = cell_with(body, kind, v[0]);
                let [scope, semantics] = scope(body);
                let flipped = body.asm.emit(Op::Not, id, &[v[0]]);
                body.asm.act(Op::AtomicStore, &[cell, scope, semantics, flipped]);
                let operands = [cell, scope, semantics];
                vec![body.asm.emit(Op::AtomicLoad, id, &operands)]
            },
            move |v| vec![Expect::Is(!v[0][0] & kind.mask())],
        ));
    }
    rows
}
