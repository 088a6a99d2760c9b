//! Instructions across the invocations of a subgroup.

use super::group::{BOOL, group, scoped, where_true};
use super::reduction;
use ash::vk::SubgroupFeatureFlags as Flags;
use gaurast_tests::programs::inputs::Domain;
use gaurast_tests::programs::types::{Kind, Ty};
use gaurast_tests::programs::{Expect, Lane, Row};
use spirv::{BuiltIn, Capability, GroupOperation, Op};

/// A group of instructions that a driver supports as a whole: the name, Vulkan's flag, and the rows.
pub type Group = (&'static str, Flags, fn() -> Vec<Row>);

/// All groups.
pub const GROUPS: [Group; 8] = [
    ("basic", Flags::BASIC, basic),
    ("vote", Flags::VOTE, votes),
    ("ballot", Flags::BALLOT, ballots),
    ("shuffle", Flags::SHUFFLE, shuffles),
    ("relative shuffle", Flags::SHUFFLE_RELATIVE, relative_shuffles),
    ("arithmetic", Flags::ARITHMETIC, reduction::arithmetic),
    ("clustered", Flags::CLUSTERED, reduction::clustered),
    ("quad", Flags::QUAD, quads),
];

/// The rows of all groups.
pub fn rows() -> Vec<Row> {
    GROUPS.iter().flat_map(|(.., rows)| rows()).collect()
}

const WORD: Ty = Ty::scalar(Kind::U32);
const BALLOT: Ty = Ty::vector(Kind::U32, 4);

fn truth(value: bool) -> Vec<Expect> {
    vec![Expect::Is(u64::from(value))]
}

fn basic() -> Vec<Row> {
    let base = Capability::GroupNonUniform;
    vec![
        group(
            "GroupNonUniformElect",
            &[],
            BOOL,
            move |body, _| scoped(body, Op::GroupNonUniformElect, base, BOOL, &[]),
            |_, me| truth(me == 0),
        ),
        group(
            "GroupNonUniformElect where a condition holds",
            &[BOOL],
            BOOL,
            move |body, v| where_true(body, v[0], BOOL, |body| scoped(body, Op::GroupNonUniformElect, base, BOOL, &[])),
            |lanes, me| truth(lanes.iter().position(|lane| lane[0][0] != 0) == Some(me)),
        ),
        group(
            "SubgroupLocalInvocationId",
            &[],
            WORD,
            move |body, _| {
                body.asm.capability(base);
                let ty = body.ty(WORD);
                let variable = body.asm.built_in(BuiltIn::SubgroupLocalInvocationId, ty);
                body.asm.emit(Op::Load, ty, &[variable])
            },
            |_, me| vec![Expect::Is(me as u64)],
        ),
    ]
}

fn votes() -> Vec<Row> {
    let needs = Capability::GroupNonUniformVote;
    let mut rows = Vec::new();
    for (op, all) in [(Op::GroupNonUniformAll, true), (Op::GroupNonUniformAny, false)] {
        let vote = move |lanes: &[Lane], operand: usize| match all {
            true => lanes.iter().all(|lane| lane[operand][0] != 0),
            false => lanes.iter().any(|lane| lane[operand][0] != 0),
        };
        // Random Booleans are rarely all equal, so values are compared with a bound.
        for bound in [1, 30, 1 << 30] {
            rows.push(
                group(
                    format!("{op:?} of numbers below {bound}"),
                    &[WORD],
                    BOOL,
                    move |body, v| {
                        let (ty, bound) = (body.ty(BOOL), body.asm.u32(bound));
                        let less = body.asm.emit(Op::ULessThan, ty, &[v[0], bound]);
                        scoped(body, op, needs, BOOL, &[less])
                    },
                    move |lanes, _| {
                        let less: Vec<Lane> =
                            lanes.iter().map(|lane| vec![vec![u64::from(lane[0][0] < u64::from(bound))]]).collect();
                        truth(vote(&less, 0))
                    },
                )
                .of(0, Domain::Integers(0, 31)),
            );
        }
        rows.push(group(
            format!("{op:?} where a condition holds"),
            &[BOOL, BOOL],
            BOOL,
            move |body, v| where_true(body, v[0], BOOL, |body| scoped(body, op, needs, BOOL, &[v[1]])),
            move |lanes, me| {
                let active: Vec<Lane> = lanes.iter().filter(|lane| lane[0][0] != 0).cloned().collect();
                truth(lanes[me][0][0] != 0 && vote(&active, 1))
            },
        ));
    }
    for kind in [Kind::U32, Kind::F32, Kind::I16, Kind::F64] {
        let ty = Ty::scalar(kind);
        rows.push(
            group(
                format!("GroupNonUniformAllEqual {kind:?}"),
                &[ty, Ty::scalar(Kind::U32)],
                BOOL,
                move |body, v| {
                    // The value is equal for all invocations in about half of the subgroups.
                    let (truth, id) = (body.ty(BOOL), body.ty(ty));
                    let zero = body.asm.u32(0);
                    let same = body.asm.emit(Op::IEqual, truth, &[v[1], zero]);
                    let null = body.asm.declare(Op::ConstantNull, Some(id), &[]);
                    let value = body.asm.emit(Op::Select, id, &[same, v[0], null]);
                    scoped(body, Op::GroupNonUniformAllEqual, needs, BOOL, &[value])
                },
                move |lanes, _| {
                    let value = |lane: &Lane| if lane[1][0] == 0 { lane[0][0] } else { 0 };
                    let first = value(&lanes[0]);
                    let number = |bits: u64| !kind.is_float() || !kind.float(bits).is_nan();
                    let equal = lanes.iter().all(|lane| {
                        let bits = value(lane);
                        let zeros = kind.is_float() && kind.float(bits) == kind.float(first);
                        number(bits) && (bits == first || zeros)
                    });
                    truth(equal)
                },
            )
            .of(0, Domain::Integers(1, 2))
            .of(1, Domain::Integers(0, 40)),
        );
    }
    rows
}

/// The words of a ballot.
fn ballot_of(truths: impl Iterator<Item = bool>) -> [u64; 4] {
    let mut words = [0; 4];
    for (lane, truth) in truths.enumerate() {
        words[lane / 32] |= u64::from(truth) << (lane % 32);
    }
    words
}

fn bit_of(words: &[u64], index: usize) -> bool {
    words[index / 32] >> (index % 32) & 1 == 1
}

fn ballots() -> Vec<Row> {
    let needs = Capability::GroupNonUniformBallot;
    let all = |words: [u64; 4]| words.map(Expect::Is).to_vec();
    let mut rows = vec![
        group(
            "GroupNonUniformBallot",
            &[BOOL],
            BALLOT,
            move |body, v| scoped(body, Op::GroupNonUniformBallot, needs, BALLOT, v),
            move |lanes, _| all(ballot_of(lanes.iter().map(|lane| lane[0][0] != 0))),
        ),
        group(
            "GroupNonUniformBallot where a condition holds",
            &[BOOL, BOOL],
            BALLOT,
            move |body, v| {
                where_true(body, v[0], BALLOT, |body| scoped(body, Op::GroupNonUniformBallot, needs, BALLOT, &[v[1]]))
            },
            move |lanes, me| match lanes[me][0][0] {
                0 => all([0; 4]),
                _ => all(ballot_of(lanes.iter().map(|lane| lane[0][0] != 0 && lane[1][0] != 0))),
            },
        ),
        group(
            "GroupNonUniformInverseBallot",
            &[BALLOT],
            BOOL,
            move |body, v| {
                // The value must be equal for all, so it is the first invocation's.
                let op = Op::GroupNonUniformBroadcastFirst;
                let first = scoped(body, op, needs, BALLOT, v);
                scoped(body, Op::GroupNonUniformInverseBallot, needs, BOOL, &[first])
            },
            |lanes, me| truth(bit_of(&lanes[0][0], me)),
        ),
        group(
            "GroupNonUniformBroadcastFirst where a condition holds",
            &[BOOL, WORD],
            WORD,
            move |body, v| {
                where_true(body, v[0], WORD, |body| {
                    scoped(body, Op::GroupNonUniformBroadcastFirst, needs, WORD, &[v[1]])
                })
            },
            |lanes, me| {
                let first = lanes.iter().find(|lane| lane[0][0] != 0);
                let here = lanes[me][0][0] != 0;
                vec![Expect::Is(first.filter(|_| here).map_or(0, |lane| lane[1][0]))]
            },
        ),
    ];
    for kind in [Kind::U8, Kind::F16, Kind::U32, Kind::F32, Kind::I64, Kind::F64] {
        let ty = Ty::vector(kind, 2);
        for from in [0, 5] {
            let mut row = group(
                format!("GroupNonUniformBroadcast {kind:?} from {from}"),
                &[ty],
                ty,
                move |body, v| {
                    let from = body.asm.u32(from);
                    let operands = [v[0], from];
                    scoped(body, Op::GroupNonUniformBroadcast, needs, ty, &operands)
                },
                move |lanes, _| {
                    let picked = &lanes[from as usize][0];
                    picked.iter().map(|bits| Expect::Is(*bits)).collect()
                },
            );
            row.flushes = false;
            rows.push(row);
        }
    }
    rows.push(
        group(
            "GroupNonUniformBallotBitExtract",
            &[BALLOT, WORD],
            BOOL,
            move |body, v| scoped(body, Op::GroupNonUniformBallotBitExtract, needs, BOOL, v),
            |lanes, me| {
                let index = lanes[me][1][0] as usize;
                match index < lanes.len() {
                    true => truth(bit_of(&lanes[me][0], index)),
                    false => vec![Expect::Any],
                }
            },
        )
        .of(1, Domain::Integers(0, 63)),
    );
    rows.extend(ballot_bits());
    rows
}

/// Counts and positions of a ballot's bits. Only the bits of the subgroup count.
fn ballot_bits() -> Vec<Row> {
    let needs = Capability::GroupNonUniformBallot;
    let mut rows = Vec::new();
    for (operation, name) in [
        (GroupOperation::Reduce, "Reduce"),
        (GroupOperation::InclusiveScan, "InclusiveScan"),
        (GroupOperation::ExclusiveScan, "ExclusiveScan"),
    ] {
        rows.push(group(
            format!("GroupNonUniformBallotBitCount {name}"),
            &[BALLOT],
            WORD,
            move |body, v| {
                let operands = [operation as u32, v[0]];
                scoped(body, Op::GroupNonUniformBallotBitCount, needs, WORD, &operands)
            },
            move |lanes, me| {
                let end = match operation {
                    GroupOperation::Reduce => lanes.len(),
                    GroupOperation::InclusiveScan => me + 1,
                    _ => me,
                };
                let count = (0..end).filter(|lane| bit_of(&lanes[me][0], *lane)).count();
                vec![Expect::Is(count as u64)]
            },
        ));
    }
    for (op, lowest) in [(Op::GroupNonUniformBallotFindLSB, true), (Op::GroupNonUniformBallotFindMSB, false)] {
        rows.push(group(
            format!("{op:?}"),
            &[BALLOT],
            WORD,
            move |body, v| scoped(body, op, needs, WORD, v),
            move |lanes, me| {
                let mut set = (0..lanes.len()).filter(|lane| bit_of(&lanes[me][0], *lane));
                let found = if lowest { set.next() } else { set.next_back() };
                // Without a set bit the result is undefined.
                vec![found.map_or(Expect::Any, |lane| Expect::Is(lane as u64))]
            },
        ));
    }
    rows
}

/// A row that reads a value of another invocation, if that exists.
fn moved(op: Op, needs: Capability, kind: Kind, domain: Domain, from: fn(usize, usize) -> Option<usize>) -> Row {
    let ty = Ty::scalar(kind);
    let mut row = group(
        format!("{op:?} {kind:?}"),
        &[ty, WORD],
        ty,
        move |body, v| scoped(body, op, needs, ty, v),
        move |lanes, me| {
            let from = from(me, lanes[me][1][0] as usize).filter(|from| *from < lanes.len());
            vec![from.map_or(Expect::Any, |from| Expect::Is(lanes[from][0][0]))]
        },
    )
    .of(1, domain);
    row.flushes = false;
    row
}

const MOVED: [Kind; 5] = [Kind::Bool, Kind::I8, Kind::F16, Kind::F32, Kind::U64];

fn shuffles() -> Vec<Row> {
    let needs = Capability::GroupNonUniformShuffle;
    MOVED
        .into_iter()
        .flat_map(|kind| {
            let index = Domain::Integers(0, 7);
            [
                moved(Op::GroupNonUniformShuffle, needs, kind, index, |_, id| Some(id)),
                moved(Op::GroupNonUniformShuffleXor, needs, kind, index, |me, mask| Some(me ^ mask)),
            ]
        })
        .collect()
}

fn relative_shuffles() -> Vec<Row> {
    let needs = Capability::GroupNonUniformShuffleRelative;
    MOVED
        .into_iter()
        .flat_map(|kind| {
            let delta = Domain::Integers(0, 12);
            [
                moved(Op::GroupNonUniformShuffleUp, needs, kind, delta, |me, delta| me.checked_sub(delta)),
                moved(Op::GroupNonUniformShuffleDown, needs, kind, delta, |me, delta| Some(me + delta)),
            ]
        })
        .collect()
}

fn quads() -> Vec<Row> {
    let needs = Capability::GroupNonUniformQuad;
    let mut rows = Vec::new();
    for kind in MOVED {
        let ty = Ty::scalar(kind);
        for index in 0..4 {
            let mut row = group(
                format!("GroupNonUniformQuadBroadcast {kind:?} from {index}"),
                &[ty],
                ty,
                move |body, v| {
                    let operands = [v[0], body.asm.u32(index)];
                    scoped(body, Op::GroupNonUniformQuadBroadcast, needs, ty, &operands)
                },
                move |lanes, me| vec![Expect::Is(lanes[me / 4 * 4 + index as usize][0][0])],
            );
            row.flushes = false;
            rows.push(row);
        }
        for (direction, name) in (0..).zip(["horizontal", "vertical", "diagonal"]) {
            let mut row = group(
                format!("GroupNonUniformQuadSwap {kind:?} {name}"),
                &[ty],
                ty,
                move |body, v| {
                    let operands = [v[0], body.asm.u32(direction)];
                    scoped(body, Op::GroupNonUniformQuadSwap, needs, ty, &operands)
                },
                move |lanes, me| vec![Expect::Is(lanes[me ^ (direction as usize + 1)][0][0])],
            );
            row.flushes = false;
            rows.push(row);
        }
    }
    rows
}
