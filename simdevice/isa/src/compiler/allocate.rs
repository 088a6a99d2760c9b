//! Register allocation: gives each register a place in the register file, so that live registers fit in the L1 cache.

use crate::ir::{Block, Program, Rate, Reg, Role, Statement, Type};
use crate::kernels::registers::RegisterSlot;

/// The places of all registers.
pub struct Allocation {
    /// Each register's place.
    pub slots: Vec<RegisterSlot>,
    /// Vectors of the whole file.
    pub vectors: usize,
}

/// The live range of a register, in ticks: two for each statement, its reads and then its writes.
#[derive(Clone, Copy)]
struct Interval {
    start: u32,
    end: u32,
}

/// Allocates the registers of a program, for batches of `width` vectors. `varying` says which have a value for each
/// lane.
///
/// Constants and uniform inputs have places of their own, so that they are set only once. Other registers share places
/// if they are not live at the same time.
pub fn allocate(program: &Program, varying: &[bool], width: usize) -> Allocation {
    let count = program.registers.len();
    let mut liveness = Liveness { intervals: vec![None; count], defined_at: vec![0; count], tick: 2, program };
    for input in &program.inputs {
        liveness.touch(input.reg, 0);
    }
    liveness.block(&program.body);
    let end = liveness.tick;
    for output in &program.outputs {
        liveness.intervals[output.reg.0 as usize] = Some(Interval { start: 0, end });
    }
    let mut intervals = liveness.intervals;
    let mut places = Places { free: Default::default(), next: 2, width };
    let mut slots = vec![RegisterSlot::ZERO; count];
    let pinned = program.constants.iter().map(|constant| constant.reg);
    let uniform_inputs = program.inputs.iter().filter(|input| input.rate == Rate::Uniform);
    for reg in pinned.chain(uniform_inputs.map(|input| input.reg)) {
        slots[reg.0 as usize] = places.take(Class { varying: false, wide: is_wide(program, reg) });
        intervals[reg.0 as usize] = None;
    }
    scan(program, varying, &intervals, &mut places, &mut slots);
    Allocation { slots, vectors: places.next }
}

/// Visits the intervals in order of their start, and reuses the places of those that have ended.
fn scan(
    program: &Program,
    varying: &[bool],
    intervals: &[Option<Interval>],
    places: &mut Places,
    slots: &mut [RegisterSlot],
) {
    let mut order: Vec<(usize, Interval)> =
        intervals.iter().enumerate().filter_map(|(reg, interval)| Some((reg, (*interval)?))).collect();
    order.sort_by_key(|(reg, interval)| (interval.start, *reg));
    let mut live: std::collections::BinaryHeap<std::cmp::Reverse<(u32, usize)>> = Default::default();
    let class = |reg: usize| Class { varying: varying[reg], wide: is_wide(program, Reg(reg as u32)) };
    for (reg, interval) in order {
        while let Some(std::cmp::Reverse((end, done))) = live.peek().copied()
            && end < interval.start
        {
            live.pop();
            places.release(class(done), slots[done]);
        }
        slots[reg] = places.take(class(reg));
        live.push(std::cmp::Reverse((interval.end, reg)));
    }
}

fn is_wide(program: &Program, reg: Reg) -> bool {
    program.registers[reg.0 as usize].ty == Type::B64
}

/// A class of registers, whose places are interchangeable.
#[derive(Clone, Copy)]
struct Class {
    varying: bool,
    wide: bool,
}

struct Places {
    free: [Vec<RegisterSlot>; 4],
    next: usize,
    width: usize,
}

impl Places {
    fn take(&mut self, class: Class) -> RegisterSlot {
        if let Some(slot) = self.free[class.index()].pop() {
            return slot;
        }
        let start = self.next;
        let registers = if class.varying { self.width } else { 1 };
        self.next += registers * if class.wide { 2 } else { 1 };
        if class.varying { RegisterSlot::varying(start) } else { RegisterSlot::uniform(start) }
    }

    fn release(&mut self, class: Class, slot: RegisterSlot) {
        self.free[class.index()].push(slot);
    }
}

impl Class {
    fn index(self) -> usize {
        usize::from(self.varying) * 2 + usize::from(self.wide)
    }
}

struct Liveness<'a> {
    intervals: Vec<Option<Interval>>,
    /// The tick at which each value is defined.
    defined_at: Vec<u32>,
    tick: u32,
    program: &'a Program,
}

impl Liveness<'_> {
    fn touch(&mut self, reg: Reg, tick: u32) {
        let entry = &mut self.intervals[reg.0 as usize];
        let interval = entry.get_or_insert(Interval { start: tick, end: tick });
        interval.start = interval.start.min(tick);
        interval.end = interval.end.max(tick);
    }

    fn block(&mut self, block: &Block) {
        block.iter().for_each(|statement| self.statement(statement));
    }

    fn statement(&mut self, statement: &Statement) {
        let reads = self.tick;
        let writes = reads + 1;
        self.tick += 2;
        // Only a statement that works lane by lane may write its result over its operand.
        let by_lane = matches!(statement, Statement::Compute { .. } | Statement::Assign { .. });
        for reg in statement.uses() {
            self.touch(reg, if by_lane { reads } else { writes });
        }
        for reg in statement.definitions() {
            self.touch(reg, writes);
            self.defined_at[reg.0 as usize] = writes;
        }
        for block in statement.blocks() {
            self.block(block);
        }
        if let Statement::Switch { selector, .. } = statement {
            // Each case reads the selector again.
            self.touch(*selector, self.tick);
        }
        if let Statement::Loop { .. } = statement {
            self.extend_over_loop(statement, reads, self.tick);
        }
        self.tick += 2;
    }

    /// Extends to the end of a loop the values from before it that it reads, and the variables in it.
    fn extend_over_loop(&mut self, statement: &Statement, start: u32, end: u32) {
        for block in statement.blocks() {
            for inner in block {
                let variables = inner.definitions().into_iter().filter(|reg| self.role(*reg) == Role::Variable);
                for reg in variables.collect::<Vec<_>>() {
                    self.touch(reg, start);
                    self.touch(reg, end);
                }
                for reg in inner.uses() {
                    if self.role(reg) == Role::Variable {
                        self.touch(reg, start);
                        self.touch(reg, end);
                    } else if self.defined_at[reg.0 as usize] < start {
                        self.touch(reg, end);
                    }
                }
                self.extend_over_loop(inner, start, end);
            }
        }
    }

    fn role(&self, reg: Reg) -> Role {
        self.program.registers[reg.0 as usize].role
    }
}
