//! Random structured programs. The batch engine's results must equal the scalar interpreter's, lane by lane.

use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use fearless_simd::Level;

use crate::builder::Builder;
use crate::compiler::Options;
use crate::ir::{Address, Block, Format, Label, Program, Rate, Reg, Space, Type};
use crate::level::SimdLevel;
use crate::machine::{Executable, LaneMask, Machine, Watchdog};
use crate::op::Op;
use crate::resources::Resources;

use super::reference::Lane;
use gaurast_runner::Case;

use super::{Random, level, machine, run};

const LANES: usize = 80;
/// A partial batch: the last lanes are not active.
const ACTIVE: usize = 75;
const INPUTS: usize = 4;
const MEMORY_WORDS: u32 = 8;

const INTEGER: &[Op] = &[
    Op::IAdd,
    Op::ISub,
    Op::IMul,
    Op::And,
    Op::Or,
    Op::Xor,
    Op::Shl,
    Op::UShr,
    Op::SShr,
    Op::SMin,
    Op::UMax,
    Op::UDiv,
    Op::SMod,
    Op::URem,
];
const FLOAT: &[Op] = &[Op::FAdd, Op::FSub, Op::FMul, Op::FDiv, Op::FMin, Op::FMax, Op::FRem];
const FUSED: &[Op] = &[Op::FFma, Op::FMulSub, Op::FNegMulAdd];
/// Operations of one float that are exact, or rounded once.
pub(super) const ROUNDING: &[Op] =
    &[Op::FFloor, Op::FCeil, Op::FTrunc, Op::FRoundEven, Op::FFract, Op::FSqrt, Op::RoundToF16];
/// Functions that the scalar interpreter computes in another way.
pub(super) const ELEMENTARY: &[Op] = &[
    Op::FExp,
    Op::FExp2,
    Op::FLog,
    Op::FLog2,
    Op::FSin,
    Op::FCos,
    Op::FTan,
    Op::FAsin,
    Op::FAcos,
    Op::FAtan,
    Op::FSinh,
    Op::FCosh,
    Op::FTanh,
    Op::FAsinh,
    Op::FAcosh,
    Op::FAtanh,
    Op::FInverseSqrt,
];
const INTEGER_TEST: &[Op] = &[Op::IEq, Op::INe, Op::SLt, Op::ULe];
const FLOAT_TEST: &[Op] = &[Op::FEq, Op::FLt, Op::FLe, Op::FNe];

/// Generates a program. Integers and floats are kept apart, so that no NaN's bits are read.
struct Grower {
    b: Builder,
    random: Random,
    integers: Vec<Reg>,
    floats: Vec<Reg>,
    bools: Vec<Reg>,
    integer_variables: Vec<Reg>,
    float_variables: Vec<Reg>,
    loops: Vec<Label>,
    breakable: Vec<Label>,
    budget: usize,
    /// The functions of one float.
    unary: &'static [&'static [Op]],
    /// The memory that is read and written.
    memory: Space,
}

/// The numbers of registers of each kind that are in scope.
struct Scope(usize, usize, usize);

impl Grower {
    fn new(seed: u64, budget: usize) -> Self {
        let mut b = Builder::new();
        let random = Random(seed);
        let mut integers: Vec<Reg> = (0..INPUTS as u32)
            .map(|slot| b.input(slot, Type::B32, if slot == 0 { Rate::Uniform } else { Rate::Varying }))
            .collect();
        integers.extend([0, 1, 3, 0xffff_ffff].map(|value| b.u32(value)));
        let floats: Vec<Reg> = [0.5, -3.0, 1e20].map(|value| b.f32(value)).to_vec();
        let bools = vec![b.bool(true)];
        let integer_variables: Vec<Reg> = (0..4).map(|_| b.variable(Type::B32)).collect();
        let float_variables: Vec<Reg> = (0..3).map(|_| b.variable(Type::B32)).collect();
        b.allocate_private(4 * MEMORY_WORDS);
        let mut grower = Self {
            b,
            random,
            integers,
            floats,
            bools,
            integer_variables,
            float_variables,
            loops: Vec::new(),
            breakable: Vec::new(),
            budget,
            unary: &[ROUNDING],
            memory: Space::Private,
        };
        for word in 0..MEMORY_WORDS {
            let zero = grower.b.u32(0);
            grower.b.store(Address { space: Space::Private, base: None, offset: 4 * word }, Format::B32, &[zero]);
        }
        for index in 0..4 {
            let value = grower.random.pick(&grower.integers);
            grower.b.assign(grower.integer_variables[index], value);
        }
        for index in 0..3 {
            let value = grower.random.pick(&grower.floats);
            grower.b.assign(grower.float_variables[index], value);
        }
        grower
    }

    /// A generator of programs with elementary functions.
    fn with_elementary(seed: u64, budget: usize) -> Self {
        Self { unary: &[ROUNDING, ELEMENTARY, ELEMENTARY], ..Self::new(seed, budget) }
    }

    /// A generator of programs with workgroup memory.
    fn with_workgroup_memory(seed: u64, budget: usize) -> Self {
        let mut grower = Self::new(seed, budget);
        grower.b.allocate_shared(4 * MEMORY_WORDS, 4);
        let lane = grower.b.lane_index();
        grower.integers.push(lane);
        Self { memory: Space::Shared, ..grower }
    }

    fn enter(&self) -> Scope {
        Scope(self.integers.len(), self.floats.len(), self.bools.len())
    }

    fn leave(&mut self, scope: &Scope) {
        self.integers.truncate(scope.0);
        self.floats.truncate(scope.1);
        self.bools.truncate(scope.2);
    }

    fn integer(&mut self) -> Reg {
        if self.random.once_in(3) {
            self.random.pick(&self.integer_variables)
        } else {
            self.random.pick(&self.integers)
        }
    }

    fn float(&mut self) -> Reg {
        if self.random.once_in(3) { self.random.pick(&self.float_variables) } else { self.random.pick(&self.floats) }
    }

    fn condition(&mut self) -> Reg {
        match self.random.below(5) {
            0 => self.random.pick(&self.bools),
            1 => {
                let (a, c) = (self.float(), self.float());
                let op = self.random.pick(FLOAT_TEST);
                self.b.compute(op, &[a, c])
            }
            _ => {
                let (a, c) = (self.integer(), self.integer());
                let op = self.random.pick(INTEGER_TEST);
                self.b.compute(op, &[a, c])
            }
        }
    }

    fn value(&mut self) {
        match self.random.below(9) {
            0 => {
                let (a, c) = (self.float(), self.float());
                let op = self.random.pick(FLOAT);
                let value = self.b.compute(op, &[a, c]);
                self.floats.push(value);
            }
            1 => {
                let (a, c, d) = (self.float(), self.float(), self.float());
                let op = self.random.pick(FUSED);
                let value = self.b.compute(op, &[a, c, d]);
                self.floats.push(value);
            }
            8 => {
                let a = self.float();
                let ops = self.random.pick(self.unary);
                let op = self.random.pick(ops);
                let value = self.b.compute(op, &[a]);
                self.floats.push(value);
            }
            2 => {
                let a = self.float();
                let value = self.b.compute(Op::FToS, &[a]);
                self.integers.push(value);
            }
            3 => {
                let a = self.integer();
                let value = self.b.compute(Op::SToF, &[a]);
                self.floats.push(value);
            }
            4 => {
                let condition = self.condition();
                self.bools.push(condition);
                let (a, c) = (self.integer(), self.integer());
                let value = self.b.compute(Op::Select, &[condition, a, c]);
                self.integers.push(value);
            }
            _ => {
                let (a, c) = (self.integer(), self.integer());
                let op = self.random.pick(INTEGER);
                let value = self.b.compute(op, &[a, c]);
                self.integers.push(value);
            }
        }
    }

    fn assign(&mut self) {
        if self.random.once_in(3) {
            let (dst, src) = (self.random.pick(&self.float_variables), self.float());
            self.b.assign(dst, src);
        } else if self.random.once_in(4) {
            let [a, c] = [self.integer_variables[0], self.integer_variables[1]];
            let held = self.b.variable(Type::B32);
            self.b.assign(held, a);
            self.b.assign(a, c);
            self.b.assign(c, held);
        } else {
            let (dst, src) = (self.random.pick(&self.integer_variables), self.integer());
            self.b.assign(dst, src);
        }
    }

    fn access(&mut self) {
        let index = self.integer();
        // Some addresses are slightly out of range.
        let bound = self.b.u32(MEMORY_WORDS + 1);
        let word = self.b.compute(Op::URem, &[index, bound]);
        let two = self.b.u32(2);
        let base = self.b.compute(Op::Shl, &[word, two]);
        let offset = 4 * self.random.below(2) as u32;
        let address = Address { space: self.memory, base: Some(base), offset };
        if self.random.once_in(2) {
            let value = self.integer();
            self.b.store(address, Format::B32, &[value]);
        } else {
            let value = self.b.load(address, Format::B32, 1)[0];
            self.integers.push(value);
        }
    }

    /// Generates a block.
    fn block(&mut self, depth: usize) {
        let scope = self.enter();
        for _ in 0..1 + self.random.below(6) {
            if self.budget == 0 {
                break;
            }
            self.budget -= 1;
            match self.random.below(if depth < 5 { 16 } else { 9 }) {
                0..4 => self.value(),
                4..7 => self.assign(),
                7 => self.access(),
                8 => {
                    if self.leave_statement() {
                        break;
                    }
                }
                9..11 => self.branch(depth),
                11..14 => self.repeat(depth),
                14 => self.switch(depth),
                _ => {
                    let label = self.b.begin_scope();
                    self.breakable.push(label);
                    self.block(depth + 1);
                    self.breakable.pop();
                    self.b.end();
                }
            }
        }
        self.leave(&scope);
    }

    /// Generates a statement that leaves a construct, if one can be left. Returns true if it did.
    fn leave_statement(&mut self) -> bool {
        match self.random.below(8) {
            0 => self.b.ret(),
            1 => self.b.kill(),
            2 => {
                self.b.demote();
                return false;
            }
            3..5 if !self.loops.is_empty() => {
                let label = self.random.pick(&self.loops);
                self.b.continue_to(label);
            }
            _ if !self.breakable.is_empty() => {
                let label = self.random.pick(&self.breakable);
                self.b.break_to(label);
            }
            _ => return false,
        }
        true
    }

    fn branch(&mut self, depth: usize) {
        let condition = self.condition();
        self.b.begin_if(condition);
        if !(self.random.once_in(4) && self.leave_statement()) {
            self.block(depth + 1);
        }
        if self.random.once_in(2) {
            self.b.begin_else();
            self.block(depth + 1);
        }
        self.b.end();
    }

    /// Generates a loop that ends after a few iterations, even if its body continues early. The number of iterations may be
    /// a constant.
    fn repeat(&mut self, depth: usize) {
        let scope = self.enter();
        let count = self.b.variable(Type::B32);
        let (zero, one, most) = (self.b.u32(0), self.b.u32(1), self.b.u32(4));
        let is_constant = self.random.once_in(2);
        let limit = match is_constant {
            true => self.b.u32(self.random.below(5) as u32),
            false => {
                let limit = self.integer();
                self.b.compute(Op::URem, &[limit, most])
            }
        };
        self.b.assign(count, zero);
        let label = self.b.begin_loop();
        // Values of the last iteration that a lane was in may be read after the loop.
        let source = self.integer();
        let escaping = self.b.compute(Op::IAdd, &[source, count]);
        let enough = self.b.compute(Op::ULe, &[limit, count]);
        if !is_constant {
            let next = self.b.compute(Op::IAdd, &[count, one]);
            self.b.assign(count, next);
        }
        self.b.begin_if(enough);
        self.b.break_to(label);
        self.b.end();
        self.loops.push(label);
        self.breakable.push(label);
        self.integers.push(count);
        self.block(depth + 1);
        self.loops.pop();
        if is_constant || self.random.once_in(2) {
            self.b.begin_continuing();
            self.block_without_exits();
            if is_constant {
                let next = self.b.compute(Op::IAdd, &[count, one]);
                self.b.assign(count, next);
            }
            if self.random.once_in(2) {
                let condition = self.condition();
                self.b.begin_if(condition);
                self.b.break_to(label);
                self.b.end();
            }
        }
        self.breakable.pop();
        self.b.end();
        self.leave(&scope);
        self.integers.push(escaping);
        self.integers.push(count);
    }

    fn block_without_exits(&mut self) {
        let scope = self.enter();
        for _ in 0..self.random.below(4) {
            if self.random.once_in(2) {
                self.value();
            } else {
                self.assign();
            }
        }
        self.leave(&scope);
    }

    fn switch(&mut self, depth: usize) {
        let (selector, bound) = (self.integer(), self.b.u32(6));
        let selector = self.b.compute(Op::URem, &[selector, bound]);
        let label = self.b.begin_switch(selector);
        self.breakable.push(label);
        let default = self.random.below(5);
        for case in 0..3usize {
            self.b.begin_case(&[2 * case as u32, 2 * case as u32 + 1][..1 + self.random.below(2)], case == default);
            if self.random.once_in(3) {
                self.b.fall_through();
            }
            self.block(depth + 1);
        }
        self.breakable.pop();
        self.b.end();
    }

    fn finish(mut self) -> Builder {
        while self.budget > 0 {
            self.block(0);
        }
        let values: Vec<Reg> = self.integer_variables.iter().chain(&self.float_variables).copied().collect();
        for (slot, value) in values.into_iter().enumerate() {
            let out = self.b.output(slot as u32, Type::B32);
            self.b.assign(out, value);
        }
        if let Some(value) = self.integers.last().copied() {
            let out = self.b.output(99, Type::B32);
            self.b.assign(out, value);
        }
        self.b
    }
}

fn equal(got: u32, expected: u32) -> bool {
    got == expected || f32::from_bits(got).is_nan() && f32::from_bits(expected).is_nan()
}

/// The inputs of a lane.
fn inputs(seed: u64, lane: usize) -> [u64; INPUTS] {
    let mut random = Random(seed.wrapping_mul(31).wrapping_add(lane as u64));
    let mut uniform = Random(seed);
    [uniform.next() & 7, random.next() & 7, random.next() & 0xffff_ffff, (lane / 5) as u64]
}

/// The scalar interpreter's results for each lane: the outputs, none if it was killed, and true if it was killed or
/// demoted.
fn expected(program: &Program, seed: u64) -> Vec<(Vec<u64>, bool)> {
    let lane = |lane| {
        let mut scalar = Lane::new(program, &inputs(seed, lane));
        let outputs = scalar.run();
        (if scalar.ended { Vec::new() } else { outputs }, scalar.killed)
    };
    (0..ACTIVE).map(lane).collect()
}

/// Sets the inputs of a batch to those of consecutive lanes.
fn set_inputs(machine: &mut Machine, seed: u64, lanes: Range<usize>) {
    for (place, lane) in lanes.enumerate() {
        for (slot, value) in inputs(seed, lane).into_iter().enumerate() {
            machine.set_input(slot as u32, place, value as u32);
        }
    }
    machine.fill_input(0, inputs(seed, 0)[0] as u32);
}

fn check(case: &Case, seed: u64, budget: usize) {
    let (name, level) = level(case);
    let as_written = Grower::new(seed, budget).finish().finish_as_written().expect("well formed");
    let program =
        Grower::new(seed, budget).finish().finish().unwrap_or_else(|problem| panic!("seed {seed}: {problem}"));
    // Two batches: the second shows whether a result depends on state that the first left.
    let rounds = [seed, seed + 1];
    let wanted = rounds.map(|seed| expected(&as_written, seed));
    let mut machine = machine(&program, level, LANES);
    for (round, seed) in rounds.into_iter().enumerate() {
        set_inputs(&mut machine, seed, 0..LANES);
        run(&mut machine, ACTIVE, &Resources::default());
        let killed: LaneMask = machine.killed();
        for (lane, (outputs, was_killed)) in wanted[round].iter().enumerate() {
            for (output, expected) in as_written.outputs.iter().zip(outputs) {
                let got = machine.output(output.slot, lane);
                assert!(
                    equal(got, *expected as u32),
                    "seed {seed}, lane {lane}, output {} at {name}: {got:#x}, not {expected:#x}\n{program}",
                    output.slot
                );
            }
            assert_eq!(killed.contains(lane), *was_killed, "seed {seed}, lane {lane} at {name}");
        }
    }
}

#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn random_programs_equal_the_scalar_interpreter(case: &Case) {
    // Short programs first: they are easier to read when they fail.
    for seed in 0..2500 {
        check(case, seed, 4 + seed as usize / 25);
    }
}

/// Random programs with elementary functions, which the scalar interpreter computes in another way, against the least
/// level.
#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn random_programs_give_the_same_bits_at_every_level(case: &Case) {
    let (name, level) = level(case);
    let least = SimdLevel::Baseline.resolve().expect("a level of every processor");
    let programs = if gaurast_runner::is_long() { 100_000 } else { 1000 };
    for seed in 0..programs {
        let program =
            Grower::with_elementary(seed, 20 + seed as usize % 60).finish().finish().expect("a valid program");
        let mut machines = [level, least].map(|level| machine(&program, level, LANES));
        for machine in &mut machines {
            set_inputs(machine, seed, 0..LANES);
            run(machine, ACTIVE, &Resources::default());
        }
        let [ours, theirs] = &machines;
        for output in &program.outputs {
            for lane in 0..ACTIVE {
                let [got, expected] = [ours, theirs].map(|machine| machine.output(output.slot, lane));
                assert!(
                    equal(got, expected),
                    "seed {seed}, lane {lane}, output {} at {name}: {got:#x}, not {expected:#x}\n{program}",
                    output.slot
                );
            }
        }
    }
}

/// Random programs with workgroup memory: two workgroups in one batch against each in a batch of its own.
#[gaurast_runner::test(each = gaurast_runner::simd_levels())]
fn workgroups_that_share_a_batch_give_the_bits_of_each_alone(case: &Case) {
    const GROUP: usize = 48;
    let (name, level) = level(case);
    let programs = if gaurast_runner::is_long() { 100_000 } else { 2000 };
    for seed in 0..programs {
        let grower = Grower::with_workgroup_memory(seed, 4 + seed as usize % 80);
        let program = grower.finish().finish().expect("a valid program");
        let [mut together, mut alone] = [2 * GROUP, GROUP].map(|lanes| {
            let options = Options { lanes, workgroup: Some(GROUP), subgroup_size: 16, ..Options::new(level) };
            Machine::new(Arc::new(Executable::new(program.clone(), &options).expect("a valid program")))
        });
        set_inputs(&mut together, seed, 0..2 * GROUP);
        run(&mut together, 2 * GROUP, &Resources::default());
        for first in [0, GROUP] {
            set_inputs(&mut alone, seed, first..first + GROUP);
            run(&mut alone, GROUP, &Resources::default());
            for lane in 0..GROUP {
                for output in &program.outputs {
                    let (got, expected) = (together.output(output.slot, first + lane), alone.output(output.slot, lane));
                    assert!(
                        equal(got, expected),
                        "seed {seed}, lane {lane} of {first}, output {} at {name}: {got:#x}, not {expected:#x}\n{program}",
                        output.slot
                    );
                }
                let killed = [together.killed().contains(first + lane), alone.killed().contains(lane)];
                assert_eq!(killed[0], killed[1], "seed {seed}, lane {lane} of {first} at {name}");
            }
        }
    }
}

/// Changes a random statement within a block: a register that it names, or its place.
fn mutate(block: &mut Block, registers: usize, random: &mut Random) {
    if block.is_empty() {
        return;
    }
    let (at, other) = (random.below(block.len()), random.below(block.len()));
    let mut inner = block[at].blocks_mut();
    if !inner.is_empty() && !random.once_in(4) {
        let within = random.below(inner.len());
        return mutate(inner[within], registers, random);
    }
    match random.below(5) {
        0 => drop(block.remove(at)),
        1 => block.swap(at, other),
        2 => {
            let copy = block[at].clone();
            block.insert(other, copy);
        }
        3 => {
            block[at].for_each_definition(&mut |reg| *reg = Reg(random.below(registers + 1) as u32));
        }
        _ => block[at].for_each_use(&mut |reg| *reg = Reg(random.below(registers + 1) as u32)),
    }
}

#[gaurast_runner::test]
fn broken_programs_are_refused_or_run_without_harm() {
    let (mut refused, mut ended) = (0, 0);
    let watchdog = Watchdog { limit: Duration::from_millis(2), cancel: None };
    for seed in 0..1500 {
        let mut program = Grower::new(seed, 30).finish().finish().expect("a valid program");
        let mut random = Random(seed);
        let registers = program.registers.len();
        (0..1 + random.below(3)).for_each(|_| mutate(&mut program.body, registers, &mut random));
        match Executable::new(program, &Options { lanes: 32, ..Options::new(Level::new()) }) {
            Err(_) => refused += 1,
            Ok(executable) => {
                let mut machine = Machine::new(Arc::new(executable));
                set_inputs(&mut machine, seed, 0..LANES);
                let done = machine.run(&LaneMask::first(32), &LaneMask::none(), &Resources::default(), watchdog);
                ended += u32::from(done.is_ok());
            }
        }
    }
    assert!(refused > 100 && ended > 100, "{refused} refused, {ended} ended");
}
