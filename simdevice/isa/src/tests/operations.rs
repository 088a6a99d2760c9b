//! Every operation with exact results, on a table of edge cases, with each combination of uniform and varying operands.

use crate::builder::Builder;
use crate::ir::{Rate, Reg, Type};
use crate::op::{Kind, Op};
use crate::resources::Resources;

use super::reference::{apply, bool_bits};
use gaurast_runner::Case;

use super::{Random, fuses, level, machine, run};

const LANES: usize = 64;

fn words() -> Vec<u64> {
    let floats = [
        0.0f32,
        -0.0,
        1.0,
        -1.0,
        0.5,
        -0.5,
        1.5,
        2.5,
        -2.5,
        0.1,
        3.75,
        -7.25,
        1e-40,
        -1e-40,
        f32::MIN_POSITIVE,
        f32::MAX,
        f32::MIN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
        8_388_609.0,
        16_777_217.0,
        2_147_483_500.0,
        2_147_483_648.0,
        -2_147_483_648.0,
        4_294_967_000.0,
        4_294_967_296.0,
        65_504.0,
        65_520.0,
        6e-8,
        1e10,
        1e38,
    ];
    let integers =
        [1, 2, 3, 7, 31, 32, 33, 255, 0x80, 0x8000, 0xffff, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, 0xffff_fffe];
    floats.iter().map(|value| u64::from(value.to_bits())).chain(integers).collect()
}

fn doubles() -> Vec<u64> {
    let floats = [
        0.0f64,
        -0.0,
        1.0,
        -1.0,
        0.5,
        2.5,
        -2.5,
        0.1,
        -7.25,
        1e-310,
        f64::MIN_POSITIVE,
        f64::MAX,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NAN,
        1e300,
        1e-300,
        4_294_967_296.5,
        9.3e18,
        -9.3e18,
        1.9e19,
        1e38,
        1e39,
        3e9,
        5e-46,
    ];
    let integers = [1, 2, 3, 63, 64, 0xffff_ffff, 0x1_0000_0000, u64::MAX, u64::MAX - 1, i64::MAX as u64, 1 << 63];
    floats.iter().map(|value| value.to_bits()).chain(integers).collect()
}

fn table(ty: Type) -> Vec<u64> {
    match ty {
        Type::Bool => vec![bool_bits(false), bool_bits(true)],
        Type::B32 => words(),
        Type::B64 => doubles(),
    }
}

/// True if two results are the same: equal bits, or both NaN. Minimum and maximum may give either zero.
fn same(op: Op, got: u64, expected: u64) -> bool {
    if got == expected {
        return true;
    }
    let name = op.name();
    match op.signature().result_type {
        Type::B32 if name.starts_with('F') || name.ends_with('F') || op == Op::RoundToF16 => {
            let (a, b) = (f32::from_bits(got as u32), f32::from_bits(expected as u32));
            let half = op == Op::FToF16 && got & 0x7fff > 0x7c00 && expected & 0x7fff > 0x7c00;
            half || a.is_nan() && b.is_nan() || matches!(op, Op::FMin | Op::FMax) && a == b
        }
        Type::B64 if name.starts_with('F') || name.ends_with("F64") => {
            let (a, b) = (f64::from_bits(got), f64::from_bits(expected));
            a.is_nan() && b.is_nan() || matches!(op, Op::FMin64 | Op::FMax64) && a == b
        }
        _ => false,
    }
}

/// Reports whether an operation's results aren't exact. Such operations have tests of their own.
fn is_approximate(op: Op) -> bool {
    let exact = [Op::UDiv, Op::URem, Op::SDiv, Op::SRem, Op::SMod, Op::FDiv, Op::FRem, Op::FSqrt];
    op.kind() == Kind::Special && !exact.contains(&op)
}

/// Tests an operation on `cases`, each with one value for each operand. `rates` are the rates of the operands; a
/// uniform operand is the same in all lanes.
fn check(case: &Case, op: Op, rates: &[Rate], cases: &[Vec<u64>]) {
    let (name, level) = level(case);
    let signature = op.signature();
    let mut b = Builder::new();
    let src: Vec<Reg> = signature
        .operands
        .iter()
        .zip(rates)
        .enumerate()
        .map(|(slot, (ty, rate))| b.input(slot as u32, *ty, *rate))
        .collect();
    let result = b.compute(op, &src);
    let out = b.output(0, signature.result_type);
    b.assign(out, result);
    let program = b.finish().expect("a valid program");
    let mut machine = machine(&program, level, LANES);
    for batch in cases.chunks(LANES) {
        let operand = |lane: usize, index: usize| {
            let case = if rates[index] == Rate::Uniform { 0 } else { lane % batch.len() };
            batch[case][index]
        };
        for (index, ty) in signature.operands.iter().enumerate() {
            for lane in 0..LANES {
                if *ty == Type::B64 {
                    machine.set_input64(index as u32, lane, operand(lane, index));
                } else {
                    machine.set_input(index as u32, lane, operand(lane, index) as u32);
                }
            }
        }
        run(&mut machine, LANES, &Resources::default());
        for lane in 0..LANES {
            let operands: Vec<u64> = (0..src.len()).map(|index| operand(lane, index)).collect();
            let expected = apply(op, &operands, fuses(name));
            let got = match signature.result_type {
                Type::B64 => machine.output64(0, lane),
                _ => u64::from(machine.output(0, lane)),
            };
            assert!(
                same(op, got, expected),
                "{} of {operands:x?} at {name}, {rates:?}: {got:#x}, not {expected:#x}",
                op.name()
            );
        }
    }
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn exact_operations_equal_the_scalar_interpreter(case: &Case) {
    let mut random = Random(1);
    for op in Op::ALL.iter().copied().filter(|op| !is_approximate(*op)) {
        let operands = op.signature().operands;
        let tables: Vec<Vec<u64>> = operands.iter().map(|ty| table(*ty)).collect();
        // All pairs, and as many random combinations of more.
        let pairs: Vec<Vec<u64>> = (0..tables[0].len() * tables.get(1).map_or(1, Vec::len))
            .map(|index| {
                let mut case = vec![tables[0][index % tables[0].len()]];
                case.extend(tables.get(1).map(|table| table[index / tables[0].len()]));
                case.extend(tables.iter().skip(2).map(|table| random.pick(table)));
                case
            })
            .collect();
        check(case, op, &vec![Rate::Varying; operands.len()], &pairs);
        for pattern in 1..1 << operands.len() {
            let rates: Vec<Rate> = (0..operands.len())
                .map(|index| if pattern >> index & 1 == 1 { Rate::Uniform } else { Rate::Varying })
                .collect();
            check(case, op, &rates, &pairs[..pairs.len().min(2 * LANES)]);
        }
    }
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn bitfields_take_any_offset_and_count(case: &Case) {
    let mut cases = Vec::new();
    for offset in [0, 1, 7, 16, 31, 32, 40, u64::from(u32::MAX)] {
        for count in [0, 1, 8, 16, 31, 32, 33, u64::from(u32::MAX)] {
            cases.push(vec![0xdead_beef, 0x1234_5678, offset, count]);
        }
    }
    check(case, Op::BitfieldInsert, &[Rate::Varying; 4], &cases);
    let cases: Vec<Vec<u64>> = cases.into_iter().map(|case| vec![case[0], case[2], case[3]]).collect();
    check(case, Op::BitfieldUExtract, &[Rate::Varying; 3], &cases);
    check(case, Op::BitfieldSExtract, &[Rate::Varying; 3], &cases);
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn folding_gives_what_running_gives(case: &Case) {
    let (name, level) = level(case);
    let mut random = Random(2);
    for op in Op::ALL.iter().copied().filter(|op| !is_approximate(*op)) {
        let operands: Vec<u64> = op.signature().operands.iter().map(|ty| random.pick(&table(*ty))).collect();
        let as_bool = |bits: u64| u64::from(bits != 0);
        let folded = crate::kernels::evaluate(level, op, &operands);
        let expected = apply(op, &operands, fuses(name));
        let expected = if op.signature().result_type == Type::Bool { as_bool(expected) } else { expected };
        assert!(same(op, folded, expected), "{} of {operands:x?} at {name}", op.name());
    }
}
