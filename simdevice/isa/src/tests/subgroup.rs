//! Operations across lanes.

use crate::builder::Builder;
use crate::compiler::Options;
use crate::ir::{Axis, Program, Rate, Reg, SubgroupOp, Type};
use crate::machine::{Executable, LaneMask, Machine, Watchdog};
use crate::op::Op;
use crate::resources::Resources;

use gaurast_runner::Case;

use super::{level, machine, run};
use std::sync::Arc;

const LANES: usize = 64;
const SIZE: usize = 32;

/// A program that applies `f` to an input and gives the result in output 0.
fn program(f: impl FnOnce(&mut Builder, Reg) -> Reg) -> Program {
    let mut b = Builder::new();
    let x = b.input(0, Type::B32, Rate::Varying);
    let result = f(&mut b, x);
    let out = b.output(0, b.type_of(result));
    b.assign(out, result);
    b.finish().expect("a valid program")
}

/// Runs a program with `lane * 3 + 1` as input and all lanes but every fifth active. Returns each lane's input, and its
/// result if it is active.
fn results(case: &Case, program: &Program) -> Vec<(u32, Option<u32>)> {
    let (_, level) = level(case);
    let options = Options { lanes: LANES, subgroup_size: SIZE, ..Options::new(level) };
    let mut machine = Machine::new(Arc::new(Executable::new(program.clone(), &options).expect("a valid program")));
    let mut active = LaneMask::first(LANES);
    (0..LANES).step_by(5).for_each(|lane| active.set(lane, false));
    (0..LANES).for_each(|lane| machine.set_input(0, lane, lane as u32 * 3 + 1));
    machine.run(&active, &LaneMask::none(), &Resources::default(), Watchdog::default()).expect("it ends");
    (0..LANES).map(|lane| (lane as u32 * 3 + 1, active.contains(lane).then(|| machine.output(0, lane)))).collect()
}

/// Asserts that each active lane gets `expected(own index in the subgroup, its active inputs by index)`.
fn check(case: &Case, program: &Program, expected: impl Fn(usize, &[Option<u32>]) -> u32) {
    for group in results(case, program).chunks(SIZE) {
        let inputs: Vec<Option<u32>> = group.iter().map(|(input, got)| got.map(|_| *input)).collect();
        for (own, (_, got)) in group.iter().enumerate() {
            if let Some(got) = got {
                assert_eq!(*got, expected(own, &inputs), "lane {own} of {program}");
            }
        }
    }
}

fn truth(value: bool) -> u32 {
    if value { u32::MAX } else { 0 }
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn votes_and_ballots(case: &Case) {
    let first = |inputs: &[Option<u32>]| inputs.iter().position(Option::is_some).unwrap_or(0);
    check(case, &program(|b, _| b.subgroup(SubgroupOp::Elect, None, None)), |own, inputs| truth(own == first(inputs)));
    let above = |limit: u32, op: SubgroupOp| {
        program(move |b, x| {
            let limit = b.u32(limit);
            let test = b.compute(Op::ULt, &[limit, x]);
            b.subgroup(op, Some(test), None)
        })
    };
    check(case, &above(90, SubgroupOp::Any), |_, inputs| truth(inputs.iter().flatten().any(|x| *x > 90)));
    check(case, &above(90, SubgroupOp::All), |_, inputs| truth(inputs.iter().flatten().all(|x| *x > 90)));
    check(case, &above(90, SubgroupOp::AllEqual), |_, inputs| {
        truth(inputs.iter().flatten().all(|x| *x > 90) || inputs.iter().flatten().all(|x| *x <= 90))
    });
    let ballot = program(|b, x| {
        let limit = b.u32(20);
        let test = b.compute(Op::ULt, &[limit, x]);
        b.ballot(test)[0]
    });
    check(case, &ballot, |_, inputs| {
        inputs.iter().enumerate().fold(0, |bits, (lane, x)| bits | u32::from(x.is_some_and(|x| x > 20)) << lane)
    });
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn shuffles(case: &Case) {
    let at = |inputs: &[Option<u32>], lane: usize| inputs.get(lane).copied().flatten().unwrap_or(0);
    let shuffle = |op: SubgroupOp, index: u32| {
        program(move |b, x| {
            let index = b.u32(index);
            b.subgroup(op, Some(x), Some(index))
        })
    };
    check(case, &shuffle(SubgroupOp::Shuffle, 7), |_, inputs| at(inputs, 7));
    check(case, &shuffle(SubgroupOp::Shuffle, 99), |_, _| 0);
    check(case, &shuffle(SubgroupOp::ShuffleXor, 3), |own, inputs| at(inputs, own ^ 3));
    check(case, &shuffle(SubgroupOp::ShuffleUp, 2), |own, inputs| {
        own.checked_sub(2).map_or(0, |lane| at(inputs, lane))
    });
    check(case, &shuffle(SubgroupOp::ShuffleDown, 9), |own, inputs| at(inputs, own + 9));
    check(case, &program(|b, x| b.subgroup(SubgroupOp::BroadcastFirst, Some(x), None)), |_, inputs| {
        inputs.iter().flatten().next().copied().unwrap_or(0)
    });
    // Inputs of a quad are 3 apart, whether a lane is active or not.
    for (lane, (input, got)) in results(case, &shuffle(SubgroupOp::QuadSwap, 1)).into_iter().enumerate() {
        let expected = if lane % 2 == 0 { input + 3 } else { input - 3 };
        assert!(got.is_none_or(|got| got == expected), "lane {lane}");
    }
    for (lane, (_, got)) in results(case, &shuffle(SubgroupOp::QuadBroadcast, 2)).into_iter().enumerate() {
        assert!(got.is_none_or(|got| got == (lane as u32 & !3 | 2) * 3 + 1), "lane {lane}");
    }
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn reductions_and_scans(case: &Case) {
    let reduce = |op: SubgroupOp| program(move |b, x| b.subgroup(op, Some(x), None));
    let all = SIZE as u32;
    let sum = |inputs: &[Option<u32>]| inputs.iter().flatten().sum::<u32>();
    check(case, &reduce(SubgroupOp::Reduce { op: Op::IAdd, cluster: all }), |_, inputs| sum(inputs));
    check(case, &reduce(SubgroupOp::Reduce { op: Op::IAdd, cluster: 1 << 10 }), |_, inputs| sum(inputs));
    check(case, &reduce(SubgroupOp::Reduce { op: Op::IAdd, cluster: 8 }), |own, inputs| {
        sum(&inputs[own & !7..(own & !7) + 8])
    });
    check(case, &reduce(SubgroupOp::Reduce { op: Op::UMax, cluster: all }), |_, inputs| {
        inputs.iter().flatten().copied().max().unwrap_or(0)
    });
    check(case, &reduce(SubgroupOp::InclusiveScan(Op::IAdd)), |own, inputs| sum(&inputs[..=own]));
    check(case, &reduce(SubgroupOp::ExclusiveScan(Op::IAdd)), |own, inputs| sum(&inputs[..own]));
    check(case, &reduce(SubgroupOp::ExclusiveScan(Op::UMin)), |own, inputs| {
        inputs[..own].iter().flatten().copied().min().unwrap_or(u32::MAX)
    });
    let floats = program(|b, x| {
        let float = b.compute(Op::UToF, &[x]);
        let total = b.subgroup(SubgroupOp::Reduce { op: Op::FAdd, cluster: all }, Some(float), None);
        b.compute(Op::FToU, &[total])
    });
    check(case, &floats, |_, inputs| sum(inputs));
    let wide = program(|b, x| {
        let wide = b.compute(Op::UToU64, &[x]);
        let total = b.subgroup(SubgroupOp::InclusiveScan(Op::IAdd64), Some(wide), None);
        b.compute(Op::Low32, &[total])
    });
    check(case, &wide, |own, inputs| sum(&inputs[..=own]));
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn derivatives_are_differences_within_quads(case: &Case) {
    let (_, level) = level(case);
    for (axis, fine) in [(Axis::X, false), (Axis::X, true), (Axis::Y, false), (Axis::Y, true)] {
        let mut b = Builder::new();
        let x = b.input(0, Type::B32, Rate::Varying);
        let d = b.derivative(x, axis, fine);
        let out = b.output(0, Type::B32);
        b.assign(out, d);
        let program = b.finish().expect("a valid program");
        let mut machine = machine(&program, level, 16);
        // The value is x^2 + 10 y^2 + x y at the four corners.
        let corner = |lane: usize| [0.0f32, 1.0, 10.0, 12.0][lane % 4];
        (0..16).for_each(|lane| {
            machine.set_input(0, lane, (corner(lane) + lane as f32 / 4.0).floor().to_bits());
        });
        run(&mut machine, 16, &Resources::default());
        for lane in 0..16 {
            let expected = match (axis, fine) {
                (Axis::X, true) if lane & 2 != 0 => 2.0,
                (Axis::X, _) => 1.0,
                (Axis::Y, true) if lane & 1 != 0 => 11.0,
                (Axis::Y, _) => 10.0,
            };
            assert_eq!(f32::from_bits(machine.output(0, lane)), expected, "{axis:?} {fine} lane {lane}");
        }
    }
}
