//! Interprets programs, one invocation at a time.

use super::program::{
    ARRAY, Binary, Compare, Condition, Expression, Function, Loop, Program, Statement, Switch, VARIABLES, mixed,
};

enum Flow {
    Next,
    Break,
    Continue,
    Return(u32),
}

struct Invocation<'a> {
    program: &'a Program,
    hash: u32,
    steps: u32,
}

struct Frame {
    parameters: [u32; 2],
    variables: [u32; VARIABLES],
    array: [u32; ARRAY],
    counters: Vec<u32>,
    borrowed: u32,
}

/// The hash and the result of an invocation with these inputs; `None` if it takes too many steps.
pub fn run(program: &Program, inputs: [u32; 2], steps: u32) -> Option<[u32; 2]> {
    let mut invocation = Invocation { program, hash: 0, steps };
    let last = program.functions.len() - 1;
    let (result, lent) = invocation.call(last, inputs, 0)?;
    Some([mixed(invocation.hash, lent), result])
}

impl Invocation<'_> {
    /// The result of a call, and the new value of the variable that the caller passes.
    fn call(&mut self, function: usize, parameters: [u32; 2], lent: u32) -> Option<(u32, u32)> {
        let program = self.program;
        let function: &Function = &program.functions[function];
        let mut frame = Frame {
            parameters,
            variables: std::array::from_fn(|index| parameters[index % 2].wrapping_add(index as u32)),
            array: std::array::from_fn(|index| index as u32),
            counters: vec![0; function.loops],
            borrowed: lent,
        };
        let result = match self.list(&mut frame, &function.body)? {
            Flow::Return(result) => result,
            _ => frame.value(&function.result),
        };
        Some((result, frame.borrowed))
    }

    fn list(&mut self, frame: &mut Frame, statements: &[Statement]) -> Option<Flow> {
        for statement in statements {
            match self.statement(frame, statement)? {
                Flow::Next => {}
                flow => return Some(flow),
            }
        }
        Some(Flow::Next)
    }

    fn statement(&mut self, frame: &mut Frame, statement: &Statement) -> Option<Flow> {
        self.steps = self.steps.checked_sub(1)?;
        match statement {
            Statement::Assign(variable, value) => frame.variables[*variable] = frame.value(value),
            Statement::Lend(value) => frame.borrowed = frame.value(value),
            Statement::Store(index, value) => {
                let index = frame.value(index) as usize % ARRAY;
                frame.array[index] = frame.value(value);
            }
            Statement::Mix(value) => self.hash = mixed(self.hash, frame.value(value)),
            Statement::Call { function, arguments: [first, second], lent, to } => {
                let arguments = [frame.value(first), frame.value(second)];
                let (result, left) = self.call(*function, arguments, frame.variables[*lent])?;
                frame.variables[*lent] = left;
                frame.variables[*to] = result;
            }
            Statement::If(condition, then, otherwise) => {
                let chosen = if frame.holds(condition) { then } else { otherwise };
                return self.list(frame, chosen);
            }
            Statement::Loop(it) => return self.repeat(frame, it),
            Statement::Switch(it) => return self.switch(frame, it),
            Statement::Break => return Some(Flow::Break),
            Statement::Continue => return Some(Flow::Continue),
            Statement::Return(value) => return Some(Flow::Return(frame.value(value))),
        }
        Some(Flow::Next)
    }

    fn repeat(&mut self, frame: &mut Frame, it: &Loop) -> Option<Flow> {
        frame.counters[it.counter] = 0;
        let goes_on = |frame: &Frame| frame.counters[it.counter] < it.count && frame.holds(&it.condition);
        loop {
            if !it.at_end && !goes_on(frame) {
                return Some(Flow::Next);
            }
            match self.list(frame, &it.body)? {
                Flow::Break => return Some(Flow::Next),
                Flow::Return(result) => return Some(Flow::Return(result)),
                Flow::Next | Flow::Continue => {}
            }
            self.list(frame, &it.continuing)?;
            frame.counters[it.counter] += 1;
            if it.at_end && !goes_on(frame) {
                return Some(Flow::Next);
            }
        }
    }

    fn switch(&mut self, frame: &mut Frame, it: &Switch) -> Option<Flow> {
        let selector = frame.value(&it.selector);
        let has = |values: &[u32]| values.contains(&selector);
        let found = it.cases.iter().position(|case| has(&case.values));
        let default = || it.cases.iter().position(|case| case.values.is_empty());
        let Some(first) = found.or_else(default) else {
            return Some(Flow::Next);
        };
        for case in &it.cases[first..] {
            match self.list(frame, &case.body)? {
                Flow::Next if case.falls_through => {}
                Flow::Next | Flow::Break => return Some(Flow::Next),
                flow => return Some(flow),
            }
        }
        Some(Flow::Next)
    }
}

impl Frame {
    fn value(&self, expression: &Expression) -> u32 {
        match expression {
            Expression::Constant(value) => *value,
            Expression::Parameter(index) => self.parameters[*index],
            Expression::Variable(index) => self.variables[*index],
            Expression::Borrowed => self.borrowed,
            Expression::Counter(index) => self.counters[*index],
            Expression::Element(index) => self.array[self.value(index) as usize % ARRAY],
            Expression::Binary(binary, left, right) => {
                let (left, right) = (self.value(left), self.value(right));
                match binary {
                    Binary::Add => left.wrapping_add(right),
                    Binary::Subtract => left.wrapping_sub(right),
                    Binary::Multiply => left.wrapping_mul(right),
                    Binary::And => left & right,
                    Binary::Or => left | right,
                    Binary::Xor => left ^ right,
                    Binary::ShiftLeft => left << (right & 31),
                    Binary::ShiftRight => left >> (right & 31),
                    Binary::Divide => left / (right | 1),
                    Binary::Remainder => left % (right | 1),
                }
            }
            Expression::Choose(condition, then, otherwise) => {
                self.value(if self.holds(condition) { then } else { otherwise })
            }
        }
    }

    fn holds(&self, condition: &Condition) -> bool {
        let (left, right) = (self.value(&condition.left), self.value(&condition.right));
        match condition.compare {
            Compare::Equal => left == right,
            Compare::NotEqual => left != right,
            Compare::Less => left < right,
            Compare::SignedLess => left.cast_signed() < right.cast_signed(),
            Compare::Meet => left & right != 0,
        }
    }
}
