//! The engine's fast paths against results computed lane by lane, at every SIMD level, over batches of many vectors,
//! some of them partly active or not at all.

use crate::builder::Builder;
use crate::ir::{Address, AtomicOp, Binding, Format, Program, Rate, Reg, Space, Type};
use crate::op::Op;
use crate::resources::{Resources, words};
use devmem::{Allocation, BufferRange};

use gaurast_runner::Case;

use super::{Random, level, machine, run};

const LANES: usize = 256;
const ACTIVE: usize = 250;
/// Words of the buffers.
const WORDS: u32 = 2000;

fn buffer(data: &[u32]) -> BufferRange {
    let size = 4 * data.len() as u64;
    let memory = Allocation::new_zeroed(size).expect("memory");
    memory.write(0, data).expect("it fits");
    BufferRange { memory, offset: 0, size }
}

fn contents(range: &BufferRange) -> Vec<u32> {
    let mut out = vec![0; (range.size / 4) as usize];
    range.memory.read(0, &mut out).expect("it fits");
    out
}

fn place(space: Space, base: Reg, offset: u32) -> Address {
    Address { space, base: Some(base), offset }
}

/// Addresses with another pattern in each vector: the same address, consecutive ones, scattered ones; some with a lane
/// that is out of range or misaligned.
fn addresses(random: &mut Random, elements: u32) -> Vec<u32> {
    let mut all = Vec::new();
    for _ in 0..LANES / 16 {
        let first = 4 * random.below(100) as u32;
        let pattern = random.below(4);
        let mut vector: Vec<u32> = (0..16)
            .map(|lane| match pattern {
                0 => first,
                1 => first + 4 * elements * lane,
                2 => first + 4 * lane,
                _ => 4 * random.below(WORDS as usize - 20) as u32,
            })
            .collect();
        match random.below(6) {
            0 => vector[random.below(16)] = 4 * WORDS - 4 * random.below(12) as u32,
            1 => vector[random.below(16)] += 1 + random.below(3) as u32,
            2 => vector[random.below(16)] = u32::MAX - random.below(9) as u32,
            _ => {}
        }
        all.append(&mut vector);
    }
    all
}

/// The active lanes: all of a vector, some, or none.
fn participants(random: &mut Random) -> Vec<bool> {
    let mut all = Vec::new();
    for _ in 0..LANES / 16 {
        let kind = random.below(3);
        all.extend((0..16).map(|_| kind == 0 || kind == 1 && random.once_in(2)));
    }
    all
}

/// The index of the word that holds a lane's element. None if it is misaligned or out of range.
fn word_at(address: u32, offset: u32, element: u32) -> Option<usize> {
    let at = u64::from(address) + u64::from(offset) + 4 * u64::from(element);
    (at.is_multiple_of(4) && at + 4 <= 4 * u64::from(WORDS)).then_some(at as usize / 4)
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn words_are_loaded_alike_in_bulk_and_one_by_one(case: &Case) {
    let (name, level) = level(case);
    let data: Vec<u32> = (0..WORDS).map(|index| index.wrapping_mul(0x9e37)).collect();
    let buffers = [Some(buffer(&data))];
    let resources = Resources { buffers: &buffers, ..Resources::default() };
    let mut random = Random(1);
    for (elements, offset) in [(1, 0), (2, 4), (3, 8), (4, 0), (5, 12), (9, 0), (4, 2)] {
        let mut b = Builder::new();
        let address = b.input(0, Type::B32, Rate::Varying);
        let takes_part = b.input(1, Type::Bool, Rate::Varying);
        let outputs: Vec<_> = (0..elements).map(|slot| b.output(slot, Type::B32)).collect();
        b.begin_if(takes_part);
        let from = place(Space::Buffer(Binding::new(0)), address, offset);
        let values = b.load(from, Format::B32, elements as usize);
        for (out, value) in outputs.iter().zip(values) {
            b.assign(*out, value);
        }
        b.end();
        let program = b.finish().expect("a valid program");
        let mut machine = machine(&program, level, LANES);
        for _ in 0..20 {
            let (at, part) = (addresses(&mut random, elements), participants(&mut random));
            for lane in 0..LANES {
                machine.set_input(0, lane, at[lane]);
                machine.set_input(1, lane, if part[lane] { u32::MAX } else { 0 });
            }
            run(&mut machine, ACTIVE, &resources);
            for lane in 0..ACTIVE {
                for element in 0..elements {
                    let word = word_at(at[lane], offset, element).filter(|_| part[lane]);
                    assert_eq!(
                        machine.output(element, lane),
                        word.map_or(0, |word| data[word]),
                        "element {element} of lane {lane} at {name}"
                    );
                }
            }
        }
    }
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn words_are_stored_alike_in_bulk_and_one_by_one(case: &Case) {
    let (name, level) = level(case);
    let mut random = Random(2);
    for (elements, offset) in [(1, 0), (2, 4), (4, 0), (6, 8)] {
        let mut b = Builder::new();
        let address = b.input(0, Type::B32, Rate::Varying);
        let takes_part = b.input(1, Type::Bool, Rate::Varying);
        let value = b.input(2, Type::B32, Rate::Varying);
        b.begin_if(takes_part);
        let values: Vec<_> = (0..elements)
            .map(|element| {
                let step = b.u32(element << 16);
                b.compute(Op::IAdd, &[value, step])
            })
            .collect();
        let to = place(Space::Buffer(Binding::new(0)), address, offset);
        b.store(to, Format::B32, &values);
        b.end();
        let program = b.finish().expect("a valid program");
        let mut machine = machine(&program, level, LANES);
        for _ in 0..20 {
            let range = buffer(&vec![0; WORDS as usize]);
            let buffers = [Some(range.clone())];
            let resources = Resources { buffers: &buffers, ..Resources::default() };
            let (at, part) = (addresses(&mut random, elements), participants(&mut random));
            let mut allowed = vec![vec![]; WORDS as usize];
            for lane in 0..LANES {
                machine.set_input(0, lane, at[lane]);
                machine.set_input(1, lane, if part[lane] { u32::MAX } else { 0 });
                machine.set_input(2, lane, 1 + lane as u32);
                for element in (0..elements).filter(|_| part[lane] && lane < ACTIVE) {
                    if let Some(word) = word_at(at[lane], offset, element) {
                        allowed[word].push((element << 16) + 1 + lane as u32);
                    }
                }
            }
            run(&mut machine, ACTIVE, &resources);
            for (word, found) in contents(&range).into_iter().enumerate() {
                let allowed = &allowed[word];
                // If lanes store to the same word, one of them wins.
                assert!(
                    allowed.contains(&found) || allowed.is_empty() && found == 0,
                    "word {word} at {name}: {found:#x} of {allowed:x?}"
                );
            }
        }
    }
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn workgroup_and_buffer_atomics_agree(case: &Case) {
    let (name, level) = level(case);
    let mut random = Random(3);
    for op in [AtomicOp::IAdd, AtomicOp::SMin, AtomicOp::UMax, AtomicOp::Xor, AtomicOp::Exchange, AtomicOp::FAdd] {
        let mut b = Builder::new();
        let address = b.input(0, Type::B32, Rate::Varying);
        let value = b.input(1, Type::B32, Rate::Varying);
        b.allocate_shared(256, 4);
        for (slot, space) in [(0, Space::Buffer(Binding::new(0))), (1, Space::Shared)] {
            let to = place(space, address, 0);
            let old = b.atomic(op, to, Format::B32, value, None);
            let out = b.output(slot, Type::B32);
            b.assign(out, old);
        }
        let program = b.finish().expect("a valid program");
        let buffers = [Some(buffer(&[0; 64]))];
        let resources = Resources { buffers: &buffers, ..Resources::default() };
        let mut machine = machine(&program, level, LANES);
        for lane in 0..LANES {
            // Some are out of range, or misaligned.
            let at = random.below(270) as u32;
            machine.set_input(0, lane, if lane > 99 { at & !3 } else { at });
            machine.set_input(1, lane, (random.below(1000) as f32).to_bits());
        }
        run(&mut machine, ACTIVE, &resources);
        for lane in 0..ACTIVE {
            let (got, twin) = (machine.output(0, lane), machine.output(1, lane));
            assert_eq!(got, twin, "{op:?} of lane {lane} at {name}");
        }
    }
}

/// A program that reads a table in private memory, at a uniform and at a varying index. If `hidden`, the table is
/// filled under a condition, so that the compiler doesn't recognize it.
fn table(hidden: bool) -> Program {
    let mut b = Builder::new();
    let (uniform, varying) = (b.input(0, Type::B32, Rate::Uniform), b.input(1, Type::B32, Rate::Varying));
    let start = b.allocate_private(40);
    let values: Vec<_> = (0..10).map(|value| b.u32(100 + value * value)).collect();
    let to = |offset| Address { space: Space::Private, base: None, offset };
    b.store(to(start), Format::B32, &values[..4]);
    if hidden {
        let always = b.compute(Op::ULe, &[varying, varying]);
        let same = b.compute(Op::INe, &[uniform, varying]);
        let either = b.compute(Op::BOr, &[always, same]);
        b.begin_if(either);
    }
    b.store(to(start + 16), Format::B32, &values[4..]);
    if hidden {
        b.end();
    }
    let mut slot = 0;
    for base in [uniform, varying] {
        for value in b.load(place(Space::Private, base, start), Format::B32, 2) {
            let out = b.output(slot, Type::B32);
            b.assign(out, value);
            slot += 1;
        }
    }
    b.finish().expect("a valid program")
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn constant_tables_read_as_private_memory(case: &Case) {
    let (name, level) = level(case);
    let [mut plain, mut twin] = [false, true].map(|hidden| machine(&table(hidden), level, LANES));
    for uniform in [0, 4, 20, 36, 40, 41, 400, u32::MAX - 3] {
        for machine in [&mut plain, &mut twin] {
            machine.fill_input(0, uniform);
            for lane in 0..LANES {
                machine.set_input(1, lane, 4 * (lane as u32 % 11) + u32::from(lane % 17 == 3));
            }
            run(machine, ACTIVE, &Resources::default());
        }
        for lane in 0..ACTIVE {
            for slot in 0..4 {
                assert_eq!(plain.output(slot, lane), twin.output(slot, lane), "value {slot} of lane {lane} at {name}");
            }
        }
        assert_eq!(plain.output(2, 0), 100);
        assert_eq!(plain.output(3, 0), 101);
    }
}

/// Runs a program with an input for each lane and compares its output 0.
fn compare(case: &Case, program: &Program, limit: u32, expected: impl Fn(u32) -> u32) {
    let (name, level) = level(case);
    let mut random = Random(4);
    let mut machine = machine(program, level, LANES);
    for sparse in [1, 40] {
        let inputs: Vec<u32> =
            (0..LANES).map(|_| if random.once_in(sparse) { random.below(limit as usize) as u32 } else { 0 }).collect();
        for (lane, input) in inputs.iter().enumerate() {
            machine.set_input(0, lane, *input);
        }
        run(&mut machine, ACTIVE, &Resources::default());
        for (lane, input) in inputs.iter().take(ACTIVE).enumerate() {
            assert_eq!(machine.output(0, lane), expected(*input), "lane {lane} with {input} at {name}");
        }
    }
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn lanes_leave_a_loop_with_their_own_count(case: &Case) {
    // The counter is the same in all lanes that are still in the loop; the lanes that left read it afterwards.
    let mut b = Builder::new();
    let wanted = b.input(0, Type::B32, Rate::Varying);
    let out = b.output(0, Type::B32);
    let (zero, one) = (b.u32(0), b.u32(1));
    let [count, kept, sum] = std::array::from_fn(|_| b.variable(Type::B32));
    b.assign(count, zero);
    b.assign(sum, zero);
    let label = b.begin_loop();
    let done = b.compute(Op::ULe, &[wanted, count]);
    b.begin_if(done);
    b.assign(kept, count);
    b.break_to(label);
    b.end();
    let more = b.compute(Op::IAdd, &[sum, count]);
    b.assign(sum, more);
    b.begin_continuing();
    let next = b.compute(Op::IAdd, &[count, one]);
    b.assign(count, next);
    b.end();
    let thousand = b.u32(1000);
    let scaled = b.compute(Op::IMul, &[kept, thousand]);
    let both = b.compute(Op::IAdd, &[scaled, sum]);
    b.assign(out, both);
    let program = b.finish().expect("a valid program");
    compare(case, &program, 30, |wanted| 1000 * wanted + (0..wanted).sum::<u32>());
}

/// A construct that some lanes of a loop skip.
#[derive(Clone, Copy)]
enum Skipped {
    Branch,
    Scope,
    Switch,
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn lanes_that_skip_a_part_of_a_loop_keep_its_variables(case: &Case) {
    // Only the loop reads the tally, but lanes that skip an assignment in one round read it in the next.
    for skipped in [Skipped::Branch, Skipped::Scope, Skipped::Switch] {
        let mut b = Builder::new();
        let input = b.input(0, Type::B32, Rate::Varying);
        let out = b.output(0, Type::B32);
        let [zero, one, rounds, three] = [0, 1, 8, 3].map(|bits| b.u32(bits));
        let [round, tally, sum] = std::array::from_fn(|_| b.variable(Type::B32));
        b.assign(sum, zero);
        b.assign(round, zero);
        b.assign(tally, zero);
        let label = b.begin_loop();
        let done = b.compute(Op::ULe, &[rounds, round]);
        b.begin_if(done);
        b.break_to(label);
        b.end();
        let kind = b.compute(Op::IAdd, &[round, input]);
        let kind = b.compute(Op::URem, &[kind, three]);
        let is_zero = b.compute(Op::IEq, &[kind, zero]);
        let add = |b: &mut Builder| {
            // More than is worth a selection.
            let mut more = tally;
            for _ in 0..9 {
                more = b.compute(Op::IAdd, &[more, one]);
            }
            b.assign(tally, more);
        };
        match skipped {
            Skipped::Branch => {
                b.begin_if(is_zero);
                add(&mut b);
            }
            Skipped::Scope => {
                let scope = b.begin_scope();
                let is_other = b.compute(Op::BNot, &[is_zero]);
                b.begin_if(is_other);
                b.break_to(scope);
                b.end();
                add(&mut b);
            }
            Skipped::Switch => {
                b.begin_switch(kind);
                b.begin_case(&[0], false);
                add(&mut b);
            }
        }
        b.end();
        let total = b.compute(Op::IAdd, &[sum, tally]);
        b.assign(sum, total);
        b.begin_continuing();
        let next = b.compute(Op::IAdd, &[round, one]);
        b.assign(round, next);
        b.end();
        b.assign(out, sum);
        let program = b.finish().expect("a valid program");
        compare(case, &program, 9, |input| {
            let tally = |round| 9 * (0..=round).filter(|round| (round + input) % 3 == 0).count();
            (0..8).map(|round| tally(round) as u32).sum()
        });
    }
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn lanes_come_back_to_the_count_that_they_left(case: &Case) {
    // The inner loop's counter is set only before the outer loop: a lane that leaves the inner loop early finds its own
    // count when it enters it again.
    let mut b = Builder::new();
    let step = b.input(0, Type::B32, Rate::Varying);
    let out = b.output(0, Type::B32);
    let (zero, one, rounds) = (b.u32(0), b.u32(1), b.u32(5));
    let [round, count, sum] = std::array::from_fn(|_| b.variable(Type::B32));
    for variable in [round, count, sum] {
        b.assign(variable, zero);
    }
    let outer = b.begin_loop();
    let done = b.compute(Op::ULe, &[rounds, round]);
    b.begin_if(done);
    b.break_to(outer);
    b.end();
    let limit = b.compute(Op::IMul, &[round, step]);
    let inner = b.begin_loop();
    let total = b.compute(Op::IAdd, &[sum, count]);
    b.assign(sum, total);
    let reached = b.compute(Op::ULe, &[limit, count]);
    b.begin_if(reached);
    b.break_to(inner);
    b.end();
    b.begin_continuing();
    let next = b.compute(Op::IAdd, &[count, one]);
    b.assign(count, next);
    b.end();
    b.begin_continuing();
    let next = b.compute(Op::IAdd, &[round, one]);
    b.assign(round, next);
    b.end();
    b.assign(out, sum);
    let program = b.finish().expect("a valid program");
    compare(case, &program, 9, |step| {
        let (mut count, mut sum) = (0, 0);
        for round in 0..5 {
            loop {
                sum += count;
                if round * step <= count {
                    break;
                }
                count += 1;
            }
        }
        sum
    });
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn lanes_that_continue_early_miss_what_the_others_count(case: &Case) {
    let mut b = Builder::new();
    let which = b.input(0, Type::B32, Rate::Varying);
    let out = b.output(0, Type::B32);
    let (zero, one, rounds, bit) = (b.u32(0), b.u32(1), b.u32(8), b.u32(1));
    let [round, count] = std::array::from_fn(|_| b.variable(Type::B32));
    b.assign(round, zero);
    b.assign(count, zero);
    let label = b.begin_loop();
    let done = b.compute(Op::ULe, &[rounds, round]);
    b.begin_if(done);
    b.break_to(label);
    b.end();
    let shifted = b.compute(Op::UShr, &[which, round]);
    let odd = b.compute(Op::And, &[shifted, bit]);
    let skips = b.compute(Op::IEq, &[odd, zero]);
    b.begin_if(skips);
    b.continue_to(label);
    b.end();
    let next = b.compute(Op::IAdd, &[count, one]);
    b.assign(count, next);
    b.begin_continuing();
    let next = b.compute(Op::IAdd, &[round, one]);
    b.assign(round, next);
    b.end();
    b.assign(out, count);
    let program = b.finish().expect("a valid program");
    compare(case, &program, 256, u32::count_ones);
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn short_branches_assign_what_their_lanes_chose(case: &Case) {
    let mut b = Builder::new();
    let x = b.input(0, Type::B32, Rate::Varying);
    let out = b.output(0, Type::B32);
    let (ten, three) = (b.u32(10), b.u32(3));
    let [a, c] = std::array::from_fn(|_| b.variable(Type::B32));
    b.assign(a, ten);
    b.assign(c, three);
    let small = b.compute(Op::ULt, &[x, ten]);
    b.begin_if(small);
    let sum = b.compute(Op::IAdd, &[x, three]);
    b.assign(a, sum);
    b.begin_else();
    // Reads a variable that the other side of the branch assigns.
    let product = b.compute(Op::IMul, &[a, x]);
    b.assign(c, product);
    b.end();
    let tiny = b.compute(Op::ULt, &[x, three]);
    b.begin_if(tiny);
    b.assign(c, x);
    b.end();
    let thousand = b.u32(1000);
    let scaled = b.compute(Op::IMul, &[a, thousand]);
    let both = b.compute(Op::IAdd, &[scaled, c]);
    b.assign(out, both);
    let program = b.finish().expect("a valid program");
    compare(case, &program, 20, |x| {
        let a = if x < 10 { x + 3 } else { 10 };
        let c = if x >= 10 { 10 * x } else { 3 };
        1000 * a + if x < 3 { x } else { c }
    });
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn push_constants_are_loaded_once_and_right(case: &Case) {
    let (name, level) = level(case);
    let mut b = Builder::new();
    let x = b.input(0, Type::B32, Rate::Varying);
    let (zero, one) = (b.u32(0), b.u32(1));
    let outputs = [0, 1].map(|slot| b.output(slot, Type::B32));
    let [i, sum] = std::array::from_fn(|_| b.variable(Type::B32));
    b.assign(i, zero);
    b.assign(sum, zero);
    let push = |offset| Address { space: Space::PushConstants, base: None, offset };
    let label = b.begin_loop();
    let limit = b.load(push(4), Format::B32, 1)[0];
    let done = b.compute(Op::ULe, &[limit, i]);
    b.begin_if(done);
    b.break_to(label);
    b.end();
    let both = b.load(push(0), Format::B32, 2);
    let product = b.compute(Op::IMul, &[both[0], x]);
    let scaled = b.compute(Op::IAdd, &[product, both[1]]);
    let more = b.compute(Op::IAdd, &[sum, scaled]);
    b.assign(sum, more);
    b.begin_continuing();
    let next = b.compute(Op::IAdd, &[i, one]);
    b.assign(i, next);
    b.end();
    b.assign(outputs[0], sum);
    // Out of range.
    let nothing = b.load(push(400), Format::B32, 1)[0];
    b.assign(outputs[1], nothing);
    let program = b.finish().expect("a valid program");
    let pushed = words(bytemuck::cast_slice(&[7u32, 5]));
    let resources = Resources { push_constants: &pushed, ..Resources::default() };
    let mut machine = machine(&program, level, LANES);
    (0..LANES).for_each(|lane| machine.set_input(0, lane, lane as u32));
    run(&mut machine, ACTIVE, &resources);
    for lane in 0..ACTIVE {
        let sum = 5 * (7 * lane as u32 + 5);
        let got = [0, 1].map(|slot| machine.output(slot, lane));
        assert_eq!(got, [sum, 0], "lane {lane} at {name}");
    }
}
