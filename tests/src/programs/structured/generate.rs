//! Generates programs from seeds.

use super::interpret::run;
use super::program::{
    Binary, Case, Compare, Condition, Expression, Function, Loop, Program, Statement, Switch, VARIABLES,
};
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The greatest number of steps of an invocation.
const STEPS: u32 = 3000;

/// The program of a seed, the same one each time. Programs that take too many steps for these inputs are skipped.
pub fn generate(seed: u64, inputs: &[[u32; 2]]) -> Program {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    loop {
        let program = program(&mut random);
        let short = |inputs: &[u32; 2]| run(&program, *inputs, STEPS).is_some();
        if inputs.iter().all(short) {
            return program;
        }
    }
}

fn program(random: &mut ChaCha8Rng) -> Program {
    let count = random.random_range(1..=3);
    let functions = (0..count)
        .map(|index| {
            let mut maker = Maker { random, callable: index, loops: 0, running: Vec::new(), budget: 14 };
            let body = maker.list(0, Place::default());
            let result = maker.expression(2);
            Function { body, result, loops: maker.loops }
        })
        .collect();
    Program { functions }
}

/// The jumps that are allowed at a statement.
#[derive(Clone, Copy, Default)]
struct Place {
    breaks: bool,
    continues: bool,
    /// True inside a construct that must not jump at all.
    calm: bool,
}

struct Maker<'a> {
    random: &'a mut ChaCha8Rng,
    /// The number of functions that can be called.
    callable: usize,
    loops: usize,
    /// The counters of the enclosing loops.
    running: Vec<usize>,
    /// The number of statements that may still be generated.
    budget: usize,
}

impl Maker<'_> {
    fn variable(&mut self) -> usize {
        self.random.random_range(0..VARIABLES)
    }

    fn list(&mut self, depth: usize, place: Place) -> Vec<Statement> {
        let mut statements = Vec::new();
        for _ in 0..self.random.random_range(1..=4) {
            if self.budget == 0 {
                break;
            }
            self.budget -= 1;
            statements.push(self.statement(depth, place));
        }
        if !place.calm && depth > 0 && self.random.random_ratio(1, 3) {
            statements.extend(self.jump(place));
        }
        statements
    }

    fn jump(&mut self, place: Place) -> Option<Statement> {
        Some(match self.random.random_range(0..5) {
            0 | 1 if place.breaks => Statement::Break,
            2 | 3 if place.continues => Statement::Continue,
            4 => Statement::Return(self.expression(2)),
            _ => return None,
        })
    }

    fn statement(&mut self, depth: usize, place: Place) -> Statement {
        let most = if depth < 4 && !place.calm { 14 } else { 7 };
        match self.random.random_range(0..most) {
            0 | 1 => Statement::Assign(self.variable(), self.expression(3)),
            2 => Statement::Store(self.expression(2), self.expression(2)),
            3 => Statement::Lend(self.expression(2)),
            4 if self.callable > 0 => {
                let lent = self.variable();
                Statement::Call {
                    function: self.random.random_range(0..self.callable),
                    arguments: [self.expression(2), self.expression(2)],
                    lent,
                    to: (lent + self.random.random_range(1..VARIABLES)) % VARIABLES,
                }
            }
            4..=6 => Statement::Mix(self.expression(2)),
            7..=9 => {
                let condition = self.condition();
                let then = self.list(depth + 1, place);
                let otherwise = match self.random.random() {
                    true => self.list(depth + 1, place),
                    false => Vec::new(),
                };
                Statement::If(condition, then, otherwise)
            }
            10 | 11 => Statement::Loop(self.repeat(depth)),
            _ => Statement::Switch(self.switch(depth, place)),
        }
    }

    fn repeat(&mut self, depth: usize) -> Loop {
        let counter = self.loops;
        self.loops += 1;
        self.running.push(counter);
        let condition = match self.random.random_ratio(1, 3) {
            true => self.condition(),
            false => {
                Condition { compare: Compare::Less, left: Expression::Constant(0), right: Expression::Constant(1) }
            }
        };
        let inside = Place { breaks: true, continues: true, calm: false };
        let body = self.list(depth + 1, inside);
        let calm = Place { calm: true, ..Place::default() };
        let continuing = match self.random.random_ratio(1, 2) {
            true => self.list(depth + 1, calm),
            false => Vec::new(),
        };
        self.running.pop();
        Loop {
            counter,
            count: self.random.random_range(1..=6),
            condition,
            at_end: self.random.random_ratio(1, 3),
            body,
            continuing,
        }
    }

    fn switch(&mut self, depth: usize, place: Place) -> Switch {
        let inside = Place { breaks: true, ..place };
        let count = self.random.random_range(1..=4);
        let default = self.random.random_range(0..=count);
        let mut next = 0;
        let cases = (0..count)
            .map(|index| {
                let values = (0..self.random.random_range(1..=2))
                    .map(|_| {
                        next += self.random.random_range(1..=2);
                        next
                    })
                    .collect();
                Case {
                    values: if index == default { Vec::new() } else { values },
                    body: self.list(depth + 1, inside),
                    falls_through: index + 1 < count && self.random.random_ratio(2, 5),
                }
            })
            .collect();
        let selector = Expression::Binary(Binary::And, self.expression(2).into(), Expression::Constant(7).into());
        Switch { selector, cases }
    }

    fn condition(&mut self) -> Condition {
        let compares = [Compare::Equal, Compare::NotEqual, Compare::Less, Compare::SignedLess, Compare::Meet];
        Condition {
            compare: *compares.choose(self.random).expect("some"),
            left: self.expression(2),
            right: self.expression(1),
        }
    }

    fn expression(&mut self, depth: usize) -> Expression {
        let most = if depth == 0 { 6 } else { 12 };
        match self.random.random_range(0..most) {
            0 => Expression::Constant(match self.random.random_range(0..3) {
                0 => self.random.random(),
                1 => u32::MAX,
                _ => self.random.random_range(0..9),
            }),
            1 => Expression::Parameter(self.random.random_range(0..2)),
            2 => match self.running.choose(self.random) {
                Some(counter) => Expression::Counter(*counter),
                None => Expression::Variable(self.variable()),
            },
            3 => Expression::Borrowed,
            4 | 5 => Expression::Variable(self.variable()),
            6 | 7 => Expression::Element(self.expression(depth - 1).into()),
            8 => Expression::Choose(
                self.condition().into(),
                self.expression(depth - 1).into(),
                self.expression(depth - 1).into(),
            ),
            _ => {
                let binaries = [
                    Binary::Add,
                    Binary::Subtract,
                    Binary::Multiply,
                    Binary::And,
                    Binary::Or,
                    Binary::Xor,
                    Binary::ShiftLeft,
                    Binary::ShiftRight,
                    Binary::Divide,
                    Binary::Remainder,
                ];
                Expression::Binary(
                    *binaries.choose(self.random).expect("some"),
                    self.expression(depth - 1).into(),
                    self.expression(depth - 1).into(),
                )
            }
        }
    }
}
