//! Reductions and scans over the invocations of a subgroup.

use super::group::{BOOL, group, scoped, where_true};
use gaurast_tests::programs::inputs::Domain;
use gaurast_tests::programs::types::{Kind, Ty};
use gaurast_tests::programs::{Body, Expect, Lane, Row};
use spirv::{Capability, GroupOperation, Op};

/// Combines two values, as bits.
type Combine = fn(Kind, u64, u64) -> u64;

fn integers(kind: Kind, a: u64, b: u64, function: fn(i128, i128) -> i128) -> u64 {
    kind.wrap(function(kind.integer(a), kind.integer(b)))
}

fn numbers(kind: Kind, a: u64, b: u64, function: fn(f64, f64) -> f64) -> u64 {
    kind.round(function(kind.float(a), kind.float(b)))
}

struct Reduction {
    op: Op,
    kinds: &'static [Kind],
    combine: Combine,
    /// The bits of the identity.
    identity: fn(Kind) -> u64,
}

const UNSIGNED: &[Kind] = &[Kind::U8, Kind::U32, Kind::U64];
const SIGNED: &[Kind] = &[Kind::I16, Kind::I32, Kind::I64];
const FLOATS: &[Kind] = &[Kind::F16, Kind::F32, Kind::F64];

const REDUCTIONS: &[Reduction] = &[
    Reduction {
        op: Op::GroupNonUniformIAdd,
        kinds: UNSIGNED,
        combine: |k, a, b| integers(k, a, b, |a, b| a + b),
        identity: |_| 0,
    },
    Reduction {
        op: Op::GroupNonUniformIMul,
        kinds: UNSIGNED,
        combine: |k, a, b| integers(k, a, b, |a, b| a.wrapping_mul(b)),
        identity: |_| 1,
    },
    Reduction {
        op: Op::GroupNonUniformSMin,
        kinds: SIGNED,
        combine: |k, a, b| integers(k, a, b, Ord::min),
        identity: |k| k.mask() >> 1,
    },
    Reduction {
        op: Op::GroupNonUniformSMax,
        kinds: SIGNED,
        combine: |k, a, b| integers(k, a, b, Ord::max),
        identity: |k| (k.mask() >> 1) + 1,
    },
    Reduction {
        op: Op::GroupNonUniformUMin,
        kinds: UNSIGNED,
        combine: |k, a, b| integers(k, a, b, Ord::min),
        identity: Kind::mask,
    },
    Reduction {
        op: Op::GroupNonUniformUMax,
        kinds: UNSIGNED,
        combine: |k, a, b| integers(k, a, b, Ord::max),
        identity: |_| 0,
    },
    Reduction {
        op: Op::GroupNonUniformFAdd,
        kinds: FLOATS,
        combine: |k, a, b| numbers(k, a, b, |a, b| a + b),
        identity: |_| 0,
    },
    Reduction {
        op: Op::GroupNonUniformFMul,
        kinds: FLOATS,
        combine: |k, a, b| numbers(k, a, b, |a, b| a * b),
        identity: |k| k.round(1.0),
    },
    Reduction {
        op: Op::GroupNonUniformFMin,
        kinds: FLOATS,
        combine: |k, a, b| numbers(k, a, b, f64::min),
        identity: |k| k.round(f64::INFINITY),
    },
    Reduction {
        op: Op::GroupNonUniformFMax,
        kinds: FLOATS,
        combine: |k, a, b| numbers(k, a, b, f64::max),
        identity: |k| k.round(f64::NEG_INFINITY),
    },
    Reduction { op: Op::GroupNonUniformBitwiseAnd, kinds: UNSIGNED, combine: |_, a, b| a & b, identity: Kind::mask },
    Reduction { op: Op::GroupNonUniformBitwiseOr, kinds: UNSIGNED, combine: |_, a, b| a | b, identity: |_| 0 },
    Reduction { op: Op::GroupNonUniformBitwiseXor, kinds: UNSIGNED, combine: |_, a, b| a ^ b, identity: |_| 0 },
    Reduction { op: Op::GroupNonUniformLogicalAnd, kinds: &[Kind::Bool], combine: |_, a, b| a & b, identity: |_| 1 },
    Reduction { op: Op::GroupNonUniformLogicalOr, kinds: &[Kind::Bool], combine: |_, a, b| a | b, identity: |_| 0 },
    Reduction { op: Op::GroupNonUniformLogicalXor, kinds: &[Kind::Bool], combine: |_, a, b| a ^ b, identity: |_| 0 },
];

/// The domain of operands. Sums and products of floats use numbers for which they are exact in any order.
fn domain(op: Op, kind: Kind) -> Domain {
    match op {
        Op::GroupNonUniformFAdd => Domain::Integers(-8, 8),
        Op::GroupNonUniformFMul => Domain::Integers(-1, 1),
        Op::GroupNonUniformFMin | Op::GroupNonUniformFMax => Domain::Integers(-1000, 1000),
        _ if kind.is_float() => Domain::Floats(-1.0, 1.0),
        _ => Domain::Any,
    }
}

/// The result of combining the values of the active invocations, for each kind of scan.
fn combined(reduction: &Reduction, kind: Kind, values: impl Iterator<Item = u64>) -> Vec<Expect> {
    let identity = (reduction.identity)(kind);
    let bits = values.fold(identity, |sum, value| (reduction.combine)(kind, sum, value));
    // The sign of a zero depends on the order.
    match kind.is_float() && kind.float(bits) == 0.0 {
        true => vec![Expect::OneOf(vec![kind.round(0.0), kind.round(-0.0)])],
        false => vec![Expect::Is(bits)],
    }
}

fn reductions(needs: Capability, operation: GroupOperation, cluster: Option<u32>, guarded: bool) -> Vec<Row> {
    let mut rows = Vec::new();
    for reduction in REDUCTIONS {
        for kind in reduction.kinds.iter().copied() {
            let ty = Ty::scalar(kind);
            let domain = domain(reduction.op, kind);
            // Floats are converted from integers, so that they are integers.
            let whole = kind.is_float() && matches!(domain, Domain::Integers(..));
            let source = if whole { Ty::scalar(Kind::I32) } else { ty };
            let suffix = if guarded { " where a condition holds" } else { "" };
            let cluster_text = cluster.map(|size| format!(" of {size}")).unwrap_or_default();
            rows.push(
                group(
                    format!("{:?} {kind:?} {operation:?}{cluster_text}{suffix}", reduction.op),
                    &[source, BOOL],
                    ty,
                    move |body, v| {
                        let mut value = v[0];
                        if whole {
                            let id = body.ty(ty);
                            value = body.asm.emit(Op::ConvertSToF, id, &[value]);
                        }
                        let mut operands = vec![operation as u32, value];
                        if let Some(size) = cluster {
                            operands.push(body.asm.u32(size));
                        }
                        let combine = |body: &mut Body| scoped(body, reduction.op, needs, ty, &operands);
                        match guarded {
                            true => where_true(body, v[1], ty, combine),
                            false => combine(body),
                        }
                    },
                    move |lanes, me| {
                        let value = |lane: &Lane| match whole {
                            true => kind.round(Kind::I32.integer(lane[0][0]) as f64),
                            false => lane[0][0],
                        };
                        let active = |lane: &Lane| !guarded || lane[1][0] != 0;
                        if !active(&lanes[me]) {
                            return vec![Expect::Is(0)];
                        }
                        let size = cluster.map_or(lanes.len(), |size| size as usize);
                        let first = me / size * size;
                        let range = match operation {
                            GroupOperation::InclusiveScan => first..me + 1,
                            GroupOperation::ExclusiveScan => first..me,
                            _ => first..first + size,
                        };
                        let part = lanes[range].iter().filter(|lane| active(lane));
                        combined(reduction, kind, part.map(value))
                    },
                )
                .of(0, domain),
            );
        }
    }
    rows
}

pub fn arithmetic() -> Vec<Row> {
    let needs = Capability::GroupNonUniformArithmetic;
    let mut rows = reductions(needs, GroupOperation::Reduce, None, false);
    rows.extend(reductions(needs, GroupOperation::InclusiveScan, None, false));
    rows.extend(reductions(needs, GroupOperation::ExclusiveScan, None, true));
    rows.extend(reductions(needs, GroupOperation::Reduce, None, true));
    rows
}

pub fn clustered() -> Vec<Row> {
    let needs = Capability::GroupNonUniformClustered;
    let operation = GroupOperation::ClusteredReduce;
    let mut rows = reductions(needs, operation, Some(4), false);
    rows.extend(reductions(needs, operation, Some(8), true));
    rows
}
