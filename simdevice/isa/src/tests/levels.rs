//! The same bits at every SIMD level: each level against the least one, and fused operations against the hardest cases.

use gaurast_runner::{Case, is_long};

use super::random::{ELEMENTARY, ROUNDING};
use super::transcendental::{LANES, program};
use super::{Random, level, machine, run};
use crate::level::SimdLevel;
use crate::op::Op;
use crate::resources::Resources;

/// True if two results are the same: equal bits, or both NaN.
fn same(a: u32, b: u32) -> bool {
    a == b || f32::from_bits(a).is_nan() && f32::from_bits(b).is_nan()
}

/// Operations of one float, on all floats or on a sample of them.
#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn operations_of_one_float_give_the_same_bits(case: &Case) {
    let (name, level) = level(case);
    let least = SimdLevel::Baseline.resolve().expect("a level of every processor");
    // The step is odd, so that the low bits of the sample vary.
    let step = if is_long() { 1 } else { 40_009 };
    // The 32-bit operations of one float whose results are floats.
    for &op in ROUNDING.iter().chain(ELEMENTARY).chain(&[Op::FSign]) {
        let program = program(op);
        let [mut ours, mut theirs] = [level, least].map(|level| machine(&program, level, LANES));
        let mut next = 0u64;
        while next <= u64::from(u32::MAX) {
            for machine in [&mut ours, &mut theirs] {
                for lane in 0..LANES {
                    machine.set_input(0, lane, (next + step * lane as u64) as u32);
                }
                run(machine, LANES, &Resources::default());
            }
            for lane in 0..LANES {
                let (a, b) = (ours.output(0, lane), theirs.output(0, lane));
                assert!(same(a, b), "{} of {:#x} at {name}: {a:#x}, not {b:#x}", op.name(), next + step * lane as u64);
            }
            next += step * LANES as u64;
        }
    }
}

/// Operations of two and three floats, on random floats of all magnitudes and on special ones.
#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn operations_of_several_floats_give_the_same_bits(case: &Case) {
    let (name, level) = level(case);
    let least = SimdLevel::Baseline.resolve().expect("a level of every processor");
    let mut random = Random(5);
    let batches = if is_long() { 40_000 } else { 60 };
    let binary = [Op::FPow, Op::FAtan2, Op::FRem, Op::FMod, Op::FMin, Op::FMax, Op::FDiv, Op::FLdexp];
    for op in binary.into_iter().chain([Op::FFma, Op::FMulSub, Op::FNegMulAdd]) {
        let program = program(op);
        let [mut ours, mut theirs] = [level, least].map(|level| machine(&program, level, LANES));
        for _ in 0..batches {
            let operands: Vec<[u32; 3]> =
                (0..LANES).map(|_| std::array::from_fn(|_| some_float(&mut random))).collect();
            for machine in [&mut ours, &mut theirs] {
                for (lane, operands) in operands.iter().enumerate() {
                    for (slot, bits) in (0..).zip(&operands[..op.signature().operands.len()]) {
                        machine.set_input(slot, lane, *bits);
                    }
                }
                run(machine, LANES, &Resources::default());
            }
            for (lane, operands) in operands.iter().enumerate() {
                let (a, b) = (ours.output(0, lane), theirs.output(0, lane));
                assert!(same(a, b), "{} of {operands:x?} at {name}: {a:#x}, not {b:#x}", op.name());
            }
        }
    }
}

/// The bits of a random float: any, a small integer, near one, or a special one.
fn some_float(random: &mut Random) -> u32 {
    const SPECIAL: &[u32] = &[0, 0x8000_0000, 0x7f80_0000, 0xff80_0000, 0x7f80_0001, 0x7fc0_0000, 1, 0x007f_ffff];
    match random.below(8) {
        0 => random.pick(SPECIAL),
        1 => (random.below(64) as f32 - 32.0).to_bits(),
        2..5 => (0x3f00_0000 + (random.next() as u32 >> 8)) | (random.next() as u32 & 0x8000_0000),
        _ => random.next() as u32,
    }
}

/// The nearest binary32 of `a * b + c`, by integers alone.
fn exact_fma(a: f32, b: f32, c: f32) -> f32 {
    let (sa, ea) = parts(a);
    let (sb, eb) = parts(b);
    let (sc, ec) = parts(c);
    let (product, power) = (i128::from(sa) * i128::from(sb), ea + eb);
    // The terms as integers over a common power of two, if they are near. The test keeps them so.
    let common = power.min(ec);
    let sum = (product << (power - common)) + (i128::from(sc) << (ec - common));
    rounded(sum, common)
}

/// The significand, with its sign, and the exponent of its last bit.
fn parts(x: f32) -> (i64, i32) {
    let bits = x.to_bits();
    let (field, fraction) = ((bits >> 23 & 0xff) as i32, i64::from(bits & 0x007f_ffff));
    let (significand, exponent) = if field == 0 { (fraction, -149) } else { (fraction | 1 << 23, field - 150) };
    (if x.is_sign_negative() { -significand } else { significand }, exponent)
}

/// An integer times a power of two, rounded to the nearest binary32, ties to even.
fn rounded(value: i128, exponent: i32) -> f32 {
    let magnitude = value.unsigned_abs();
    let width = 128 - magnitude.leading_zeros() as i32;
    // The number of bits that the result has no place for.
    let excess = (width - 24).max(-149 - exponent).max(0) as u32;
    let kept = if excess >= 128 { 0 } else { magnitude >> excess };
    let rest = if excess >= 128 { magnitude } else { magnitude - (kept << excess) };
    let half = if excess == 0 || excess > 128 { u128::MAX } else { 1 << (excess - 1) };
    let up = excess > 0 && (rest > half || rest == half && kept & 1 == 1);
    let nearest = (kept + u128::from(up)) as f64;
    // Two factors, because a power of two below 2^-1022 may be needed.
    let total = exponent + excess as i32;
    let power = |exponent: i32| f64::from_bits(((exponent + 1023) as u64) << 52);
    let result = (nearest * power(total / 2) * power(total - total / 2)) as f32;
    if value < 0 { -result } else { result }
}

/// Sums that are near the middle of two floats, or among the denormals, and would be rounded twice by way of binary64.
#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn fused_operations_round_once(case: &Case) {
    let (name, level) = level(case);
    let mut random = Random(6);
    let program = program(Op::FFma);
    let mut machine = machine(&program, level, LANES);
    let batches = if is_long() { 20_000 } else { 100 };
    for _ in 0..batches {
        let operands: Vec<[f32; 3]> = (0..LANES).map(|_| hard_case(&mut random)).collect();
        for (lane, operands) in operands.iter().enumerate() {
            for (slot, operand) in (0..).zip(operands) {
                machine.set_input(slot, lane, operand.to_bits());
            }
        }
        run(&mut machine, LANES, &Resources::default());
        for (lane, &[a, b, c]) in operands.iter().enumerate() {
            let (got, expected) = (machine.output(0, lane), exact_fma(a, b, c));
            // An exact sum of zero has a sign of its own rules, which the table of edge cases has.
            let zero = expected == 0.0 && f32::from_bits(got) == 0.0;
            assert!(zero || got == expected.to_bits(), "{a:e} * {b:e} + {c:e} at {name}: {got:#x}, not {expected:e}");
        }
    }
}

/// Operands whose product has few bits in common with a sum's last place, at an exponent from denormal to large.
fn hard_case(random: &mut Random) -> [f32; 3] {
    let float = |random: &mut Random, exponent: i32| {
        // Significands with few bits set make ties likely.
        let [one, other] = [(); 2].map(|()| 1u32 << random.below(23));
        let any = random.next() as u32;
        let fraction = random.pick(&[one, one ^ other, any]);
        let field = (exponent + 127).clamp(0, 254) as u32;
        f32::from_bits((random.next() as u32 & 0x8000_0000) | field << 23 | fraction & 0x007f_ffff)
    };
    let product = random.below(180) as i32 - 170;
    let part = random.below(40) as i32 - 20;
    let (a, b) = (float(random, product / 2 + part), float(random, product - product / 2 - part));
    let from_product = random.below(52) as i32 - 26;
    let c = float(random, product + from_product);
    [a, b, c]
}

#[gaurast_runner::test]
fn the_exact_model_of_fused_operations_is_the_hosts() {
    let mut random = Random(7);
    for _ in 0..200_000 {
        let [a, b, c] = hard_case(&mut random);
        let (model, host) = (exact_fma(a, b, c), a.mul_add(b, c));
        assert!(model == host, "{a:e} * {b:e} + {c:e}: {model:e}, not {host:e}");
    }
}
