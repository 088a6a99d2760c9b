//! Unrolling of loops whose few iterations are known.
//!
//! A loop is replaced by its iterations if its first branch leaves it by a condition that follows from variables that are
//! constant in each iteration: a counter has a constant before the loop, and is assigned only in the continuing part. All
//! lanes that are in an iteration then have the same counter, which is a constant there. Loops around loops that stay are
//! left as they are: it is the inner ones that take the time.

use std::collections::{HashMap, HashSet};

use super::fold::Constants;
use crate::ir::{Block, Label, Program, Reg, Register, Role, Statement, contains};
use crate::kernels::evaluate;

/// The most iterations of a loop that is replaced.
const MOST_ITERATIONS: usize = 32;
/// The most statements that replace a loop.
const MOST_STATEMENTS: usize = 1024;
/// The most statements that replace all loops of a program.
const MOST_STATEMENTS_OF_PROGRAM: usize = 4096;

/// Replaces loops of few iterations by these. Returns true if there was one.
pub fn unroll(program: &mut Program) -> bool {
    let mut unrolling = Unrolling {
        constants: Constants::of(program),
        registers: std::mem::take(&mut program.registers),
        labels: labels(&program.body),
        left: MOST_STATEMENTS_OF_PROGRAM,
    };
    unrolling.block(&mut program.body);
    program.registers = unrolling.registers;
    program.constants.append(&mut unrolling.constants.new);
    unrolling.left < MOST_STATEMENTS_OF_PROGRAM
}

/// The constants that variables have.
type Known = HashMap<Reg, u64>;

struct Unrolling {
    constants: Constants,
    registers: Vec<Register>,
    /// The number of labels.
    labels: u32,
    /// The statements that may still be added.
    left: usize,
}

/// A loop that lanes leave by its first branch.
struct TestedLoop<'a> {
    label: Label,
    /// The statements before the branch: computations and assignments.
    test: &'a [Statement],
    condition: Reg,
    /// The condition for which lanes leave.
    leaves_if: bool,
    /// The rest of the body.
    rest: &'a [Statement],
    continuing: &'a [Statement],
}

impl<'a> TestedLoop<'a> {
    fn new(label: Label, body: &'a Block, continuing: &'a Block) -> Option<Self> {
        let is_simple =
            |statement: &Statement| matches!(statement, Statement::Compute { .. } | Statement::Assign { .. });
        let at = body.iter().position(|statement| !is_simple(statement))?;
        let Statement::If { condition, then, otherwise } = &body[at] else {
            return None;
        };
        let leaves = |block: &Block| matches!(block[..], [Statement::Break(left)] if left == label);
        let leaves_if = match (leaves(then), leaves(otherwise)) {
            (true, false) if otherwise.is_empty() => true,
            (false, true) if then.is_empty() => false,
            _ => return None,
        };
        let rest = &body[at + 1..];
        if rest.iter().chain(continuing).any(has_loop) {
            return None;
        }
        Some(Self { label, test: &body[..at], condition: *condition, leaves_if, rest, continuing })
    }

    /// The variables that only the continuing part assigns, outside of branches, or nothing does.
    fn counters(&self, known: &Known) -> Known {
        let mut assigned = HashSet::new();
        let nested = self.continuing.iter().flat_map(Statement::blocks).flatten();
        for statement in self.test.iter().chain(self.rest).chain(nested) {
            statement.collect_definitions(&mut assigned);
        }
        known
            .iter()
            .filter(|(variable, _)| !assigned.contains(variable))
            .map(|(variable, bits)| (*variable, *bits))
            .collect()
    }

    /// The variables that are known at the beginning of each iteration, and those at the end of the last one. `None` if
    /// there may be more than [`MOST_ITERATIONS`].
    fn iterations(&self, known: &Known, constants: &Constants) -> Option<(Vec<Known>, Known)> {
        let mut iterations = Vec::new();
        let mut counters = self.counters(known);
        loop {
            let mut values = counters.clone();
            let mut evaluate_all = |statements: &[Statement], counters: &mut Known| {
                for statement in statements {
                    let value = |reg: &Reg| values.get(reg).copied().or_else(|| constants.bits(*reg));
                    match statement {
                        Statement::Compute { op, dst, src } => {
                            let operands: Option<Vec<u64>> = src.iter().map(value).collect();
                            if let Some(operands) = operands {
                                values.insert(*dst, evaluate(*op, &operands));
                            }
                        }
                        Statement::Assign { dst, src } => {
                            let bits = value(src).filter(|_| counters.contains_key(dst));
                            match bits {
                                Some(bits) => {
                                    values.insert(*dst, bits);
                                    counters.insert(*dst, bits);
                                }
                                None => {
                                    values.remove(dst);
                                    counters.remove(dst);
                                }
                            }
                        }
                        _ => {}
                    }
                }
                values.get(&self.condition).copied().or_else(|| constants.bits(self.condition))
            };
            let leaves = (evaluate_all(self.test, &mut counters)? != 0) == self.leaves_if;
            if leaves {
                return Some((iterations, counters));
            }
            if iterations.len() == MOST_ITERATIONS {
                return None;
            }
            iterations.push(counters.clone());
            evaluate_all(self.rest, &mut counters);
            evaluate_all(self.continuing, &mut counters);
        }
    }

    /// The statements in the order of their execution.
    fn all(&self) -> impl Iterator<Item = &'a Statement> {
        self.test.iter().chain(self.rest).chain(self.continuing)
    }

    fn statements(&self) -> usize {
        self.all().map(statements).sum()
    }
}

impl Unrolling {
    fn block(&mut self, block: &mut Block) {
        let mut known = Known::new();
        for mut statement in std::mem::take(block) {
            statement.blocks_mut().into_iter().for_each(|inner| self.block(inner));
            let unrolled = match &statement {
                Statement::Loop { label, body, continuing } => {
                    TestedLoop::new(*label, body, continuing).and_then(|tested| self.unrolled(&tested, &known))
                }
                _ => None,
            };
            let mut assigned = HashSet::new();
            statement.collect_definitions(&mut assigned);
            known.retain(|variable, _| !assigned.contains(variable));
            if let Statement::Assign { dst, src } = statement
                && let Some(bits) = self.constants.bits(src)
            {
                known.insert(dst, bits);
            }
            match unrolled {
                Some(mut iterations) => block.append(&mut iterations),
                None => block.push(statement),
            }
        }
    }

    /// The iterations of a loop, if they are known and few.
    fn unrolled(&mut self, tested: &TestedLoop<'_>, known: &Known) -> Option<Block> {
        let (iterations, last) = tested.iterations(known, &self.constants)?;
        let statements = (iterations.len() * tested.statements()).max(1);
        if statements > MOST_STATEMENTS.min(self.left) {
            return None;
        }
        self.left -= statements;
        let label = tested.label;
        let is_continued = tested.rest.iter().any(|statement| goes_to(statement, &Statement::Continue(label)));
        let mut unrolled = Block::new();
        for counters in iterations {
            let mut copy = Copying::new(self, counters);
            unrolled.append(&mut copy.statements(tested.test));
            if is_continued {
                // Lanes that continue leave a scope.
                let scope = copy.unrolling.label();
                copy.continued = Some((label, scope));
                let body = copy.statements(tested.rest);
                unrolled.push(Statement::Scope { label: scope, body });
            } else {
                unrolled.append(&mut copy.statements(tested.rest));
            }
            unrolled.append(&mut copy.statements(tested.continuing));
        }
        unrolled.append(&mut Copying::new(self, last).statements(tested.test));
        // Some lanes may leave by other branches.
        Some(match contains(&unrolled, &Statement::Break(label)) {
            true => vec![Statement::Scope { label, body: unrolled }],
            false => unrolled,
        })
    }

    /// A new label.
    fn label(&mut self) -> Label {
        self.labels += 1;
        Label(self.labels - 1)
    }
}

/// Copies an iteration's statements. Values and labels get new names, and counters are constants.
struct Copying<'a> {
    unrolling: &'a mut Unrolling,
    counters: Known,
    registers: HashMap<Reg, Reg>,
    labels: HashMap<Label, Label>,
    /// The loop, and the scope that lanes leave in place of continuing it.
    continued: Option<(Label, Label)>,
}

impl<'a> Copying<'a> {
    fn new(unrolling: &'a mut Unrolling, counters: Known) -> Self {
        Self { unrolling, counters, registers: HashMap::new(), labels: HashMap::new(), continued: None }
    }

    fn statements(&mut self, statements: &[Statement]) -> Block {
        let mut copies = statements.to_vec();
        copies.iter_mut().for_each(|statement| self.rename(statement));
        copies
    }

    fn rename(&mut self, statement: &mut Statement) {
        statement.for_each_use(&mut |reg| {
            if let Some(bits) = self.counters.get(reg) {
                let ty = self.unrolling.registers[reg.0 as usize].ty;
                *reg = self.unrolling.constants.register(ty, *bits, &mut self.unrolling.registers);
            } else if let Some(renamed) = self.registers.get(reg) {
                *reg = *renamed;
            }
        });
        statement.for_each_definition(&mut |reg| {
            let register = self.unrolling.registers[reg.0 as usize];
            if register.role == Role::Variable {
                self.counters.remove(reg);
                return;
            }
            let renamed = Reg(self.unrolling.registers.len() as u32);
            self.unrolling.registers.push(register);
            self.registers.insert(*reg, renamed);
            *reg = renamed;
        });
        match statement {
            Statement::Switch { label, .. } | Statement::Loop { label, .. } | Statement::Scope { label, .. } => {
                let renamed = self.unrolling.label();
                self.labels.insert(*label, renamed);
                *label = renamed;
            }
            Statement::Continue(label)
                if let Some((of, scope)) = self.continued
                    && of == *label =>
            {
                *statement = Statement::Break(scope);
            }
            Statement::Break(label) | Statement::Continue(label) => {
                *label = self.labels.get(label).copied().unwrap_or(*label);
            }
            _ => {}
        }
        statement.blocks_mut().into_iter().flatten().for_each(|inner| self.rename(inner));
    }
}

fn has_loop(statement: &Statement) -> bool {
    matches!(statement, Statement::Loop { .. }) || statement.blocks().into_iter().flatten().any(has_loop)
}

/// Reports whether a statement is another one, or has it within.
fn goes_to(statement: &Statement, wanted: &Statement) -> bool {
    statement == wanted || statement.blocks().into_iter().any(|block| contains(block, wanted))
}

/// The number of statements of a statement and within it.
fn statements(statement: &Statement) -> usize {
    1 + statement.blocks().into_iter().flatten().map(statements).sum::<usize>()
}

/// One more than the greatest label.
fn labels(block: &Block) -> u32 {
    let of = |statement: &Statement| {
        let own = match statement {
            Statement::Switch { label, .. } | Statement::Loop { label, .. } | Statement::Scope { label, .. } => {
                label.0 + 1
            }
            _ => 0,
        };
        statement.blocks().into_iter().map(labels).fold(own, u32::max)
    };
    block.iter().map(of).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::Builder;
    use crate::compiler::forwarding::assignments;
    use crate::ir::op::Op;
    use crate::ir::{Rate, Type};

    /// A loop of `count` from 0 while it is below a bound, which `within` fills.
    fn counted(bound: impl FnOnce(&mut Builder) -> Reg, within: impl FnOnce(&mut Builder, Label, Reg, Reg)) -> Program {
        let mut b = Builder::new();
        let (zero, one) = (b.u32(0), b.u32(1));
        let bound = bound(&mut b);
        let sum = b.output(0, Type::B32);
        let count = b.variable(Type::B32);
        b.assign(count, zero);
        let label = b.begin_loop();
        let goes_on = b.compute(Op::ULt, &[count, bound]);
        b.begin_if(goes_on);
        b.begin_else();
        b.break_to(label);
        b.end();
        within(&mut b, label, count, sum);
        b.begin_continuing();
        let next = b.compute(Op::IAdd, &[count, one]);
        b.assign(count, next);
        b.end();
        b.finish().expect("a valid program")
    }

    fn add(b: &mut Builder, _: Label, count: Reg, sum: Reg) {
        let next = b.compute(Op::IAdd, &[sum, count]);
        b.assign(sum, next);
    }

    fn loops(block: &Block) -> usize {
        let own = |statement: &Statement| usize::from(matches!(statement, Statement::Loop { .. }));
        block.iter().map(|statement| own(statement) + statement.blocks().into_iter().map(loops).sum::<usize>()).sum()
    }

    /// The number of assignments of sums, if there is no loop left.
    fn unrolled(mut program: Program) -> Option<usize> {
        let sum = program.outputs[0].reg;
        let is_changed = unroll(&mut program);
        assert_eq!(is_changed, loops(&program.body) == 0);
        is_changed.then(|| assignments(&program.body, sum))
    }

    #[gaurast_runner::test]
    fn few_iterations_that_are_known_replace_their_loop() {
        for count in [0, 1, 5, MOST_ITERATIONS] {
            assert_eq!(unrolled(counted(|b| b.u32(count as u32), add)), Some(count));
        }
        assert_eq!(unrolled(counted(|b| b.u32(MOST_ITERATIONS as u32 + 1), add)), None);
        assert_eq!(unrolled(counted(|b| b.input(0, Type::B32, Rate::Uniform), add)), None);
    }

    #[gaurast_runner::test]
    fn lanes_may_leave_an_iteration_early() {
        let early = |continues: bool| {
            counted(
                |b| b.u32(3),
                |b, label, count, sum| {
                    let x = b.input(0, Type::B32, Rate::Varying);
                    let enough = b.compute(Op::ULe, &[x, count]);
                    b.begin_if(enough);
                    if continues {
                        b.continue_to(label);
                    } else {
                        b.break_to(label);
                    }
                    b.end();
                    add(b, label, count, sum);
                },
            )
        };
        assert_eq!(unrolled(early(true)), Some(3));
        assert_eq!(unrolled(early(false)), Some(3));
    }

    #[gaurast_runner::test]
    fn a_counter_that_some_lanes_assign_is_not_known() {
        let program = counted(
            |b| b.u32(3),
            |b, label, count, sum| {
                let x = b.input(0, Type::Bool, Rate::Varying);
                b.begin_if(x);
                let bound = b.u32(3);
                b.assign(count, bound);
                b.end();
                add(b, label, count, sum);
            },
        );
        assert_eq!(unrolled(program), None);
    }

    #[gaurast_runner::test]
    fn loops_that_would_be_too_long_stay() {
        let long = |statements: usize| {
            counted(|b| b.u32(8), |b, label, count, sum| (0..statements).for_each(|_| add(b, label, count, sum)))
        };
        assert_eq!(unrolled(long(32)), Some(8 * 32));
        assert_eq!(unrolled(long(MOST_STATEMENTS / 8)), None);
    }
}
