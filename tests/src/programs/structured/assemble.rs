//! Assembles programs as SPIR-V.

use super::super::assembler::{Assembler, Id};
use super::program::{
    ARRAY, Binary, Compare, Condition, Expression, Function, INVOCATIONS, Loop, Program, Statement, Switch, VARIABLES,
};
use spirv::{BuiltIn, Op, StorageClass};

struct Types {
    void: Id,
    bool: Id,
    u32: Id,
    local: Id,
    array: Id,
}

/// A function under construction.
struct Writer<'a> {
    asm: &'a mut Assembler,
    types: &'a Types,
    /// The functions that can be called.
    callable: &'a [Id],
    hash: Id,
    parameters: [Id; 2],
    borrowed: Id,
    variables: Vec<Id>,
    counters: Vec<Id>,
    array: Id,
    /// The block under construction, if it is known.
    block: Id,
}

/// The targets of jumps.
#[derive(Clone, Copy, Default)]
struct Targets {
    breaks: Id,
    continues: Id,
}

/// A shader that runs programs one after another. Each reads an invocation's two words from binding 0 and writes its
/// hash and its result to binding 1. The outputs of all invocations of a program are contiguous.
pub fn assemble(programs: &[Program]) -> Vec<u32> {
    let mut asm = Assembler::new(INVOCATIONS as u32);
    let types = declare_types(&mut asm);
    let input = asm.storage_buffer(0, types.u32, 4);
    let output = asm.storage_buffer(1, types.u32, 4);
    let hash = asm.global(StorageClass::Private, types.u32);
    let triple = asm.declare(Op::TypeVector, None, &[types.u32, 3]);
    let id = asm.built_in(BuiltIn::GlobalInvocationId, triple);
    let entries: Vec<Id> = programs
        .iter()
        .map(|program| {
            let mut written = Vec::new();
            for function in &program.functions {
                let id = write_function(&mut asm, &types, hash, &written, function);
                written.push(id);
            }
            *written.last().expect("a program has functions")
        })
        .collect();
    let id = asm.emit(Op::Load, triple, &[id]);
    let lane = asm.emit(Op::CompositeExtract, types.u32, &[id, 0]);
    let place = |asm: &mut Assembler, buffer: Id, scale: u32, add: u32| {
        let (scale, add, zero) = (asm.u32(scale), asm.u32(add), asm.u32(0));
        let index = asm.emit(Op::IMul, types.u32, &[lane, scale]);
        let index = asm.emit(Op::IAdd, types.u32, &[index, add]);
        let pointer = asm.pointer(StorageClass::StorageBuffer, types.u32);
        asm.emit(Op::AccessChain, pointer, &[buffer, zero, index])
    };
    let inputs = [0, 1].map(|word| {
        let place = place(&mut asm, input, 2, word);
        asm.emit(Op::Load, types.u32, &[place])
    });
    let lent = asm.local(types.u32);
    for (index, entry) in (0..).zip(entries) {
        let zero = asm.u32(0);
        asm.act(Op::Store, &[hash, zero]);
        asm.act(Op::Store, &[lent, zero]);
        let result = asm.emit(Op::FunctionCall, types.u32, &[entry, inputs[0], inputs[1], lent]);
        let left = asm.emit(Op::Load, types.u32, &[lent]);
        mix(&mut asm, &types, hash, left);
        let hash = asm.emit(Op::Load, types.u32, &[hash]);
        for (word, value) in (0..).zip([hash, result]) {
            let place = place(&mut asm, output, 2, 2 * INVOCATIONS as u32 * index + word);
            asm.act(Op::Store, &[place, value]);
        }
    }
    asm.act(Op::Return, &[]);
    asm.function(asm.main(), types.void, &[]);
    asm.finish()
}

fn declare_types(asm: &mut Assembler) -> Types {
    let u32 = asm.declare(Op::TypeInt, None, &[32, 0]);
    let length = asm.u32(ARRAY as u32);
    Types {
        void: asm.declare(Op::TypeVoid, None, &[]),
        bool: asm.declare(Op::TypeBool, None, &[]),
        u32,
        local: asm.pointer(StorageClass::Function, u32),
        array: asm.declare(Op::TypeArray, None, &[u32, length]),
    }
}

/// Emits the hash function that the interpreter computes by `mixed`.
fn mix(asm: &mut Assembler, types: &Types, hash: Id, value: Id) {
    let old = asm.emit(Op::Load, types.u32, &[hash]);
    let both = asm.emit(Op::BitwiseXor, types.u32, &[old, value]);
    let factor = asm.u32(0x0100_0193);
    let new = asm.emit(Op::IMul, types.u32, &[both, factor]);
    asm.act(Op::Store, &[hash, new]);
}

fn write_function(asm: &mut Assembler, types: &Types, hash: Id, callable: &[Id], function: &Function) -> Id {
    let parameters = [asm.id(), asm.id()];
    let borrowed = asm.id();
    let variables = (0..VARIABLES).map(|_| asm.local(types.u32)).collect();
    let counters = (0..function.loops).map(|_| asm.local(types.u32)).collect();
    let array = asm.local(types.array);
    let mut writer = Writer { asm, types, callable, hash, parameters, borrowed, variables, counters, array, block: 0 };
    writer.initialize();
    if writer.list(&function.body, Targets::default()) {
        let result = writer.value(&function.result);
        writer.asm.act(Op::ReturnValue, &[result]);
    }
    let id = asm.id();
    let (u32, local) = (types.u32, types.local);
    let parameters = [(parameters[0], u32), (parameters[1], u32), (borrowed, local)];
    asm.function(id, u32, &parameters);
    id
}

impl Writer<'_> {
    fn initialize(&mut self) {
        for index in 0..VARIABLES {
            let offset = self.asm.u32(index as u32);
            let parameter = self.parameters[index % 2];
            let value = self.emit(Op::IAdd, &[parameter, offset]);
            self.store(self.variables[index], value);
        }
        for index in 0..ARRAY {
            let index = self.asm.u32(index as u32);
            let place = self.element(index);
            self.store(place, index);
        }
    }

    fn emit(&mut self, op: Op, operands: &[Id]) -> Id {
        self.asm.emit(op, self.types.u32, operands)
    }

    fn store(&mut self, place: Id, value: Id) {
        self.asm.act(Op::Store, &[place, value]);
    }

    fn load(&mut self, place: Id) -> Id {
        self.emit(Op::Load, &[place])
    }

    /// A pointer to the array element at an index, which wraps.
    fn element(&mut self, index: Id) -> Id {
        let mask = self.asm.u32(ARRAY as u32 - 1);
        let index = self.emit(Op::BitwiseAnd, &[index, mask]);
        self.asm.emit(Op::AccessChain, self.types.local, &[self.array, index])
    }

    fn label(&mut self, id: Id) {
        self.asm.label(id);
        self.block = id;
    }

    fn branch(&mut self, to: Id) {
        self.asm.act(Op::Branch, &[to]);
    }

    /// Emits statements; returns true if their end is reachable.
    fn list(&mut self, statements: &[Statement], targets: Targets) -> bool {
        statements.iter().all(|statement| self.statement(statement, targets))
    }

    fn statement(&mut self, statement: &Statement, targets: Targets) -> bool {
        match statement {
            Statement::Assign(variable, value) => {
                let value = self.value(value);
                self.store(self.variables[*variable], value);
            }
            Statement::Lend(value) => {
                let value = self.value(value);
                self.store(self.borrowed, value);
            }
            Statement::Store(index, value) => {
                let index = self.value(index);
                let value = self.value(value);
                let place = self.element(index);
                self.store(place, value);
            }
            Statement::Mix(value) => {
                let value = self.value(value);
                mix(self.asm, self.types, self.hash, value);
            }
            Statement::Call { function, arguments: [first, second], lent, to } => {
                let (first, second) = (self.value(first), self.value(second));
                let function = self.callable[*function];
                let operands = [function, first, second, self.variables[*lent]];
                let result = self.emit(Op::FunctionCall, &operands);
                self.store(self.variables[*to], result);
            }
            Statement::If(condition, then, otherwise) => {
                return self.branches(condition, [then, otherwise], targets);
            }
            Statement::Loop(it) => self.repeat(it),
            Statement::Switch(it) => return self.switch(it, targets),
            Statement::Break => {
                self.branch(targets.breaks);
                return false;
            }
            Statement::Continue => {
                self.branch(targets.continues);
                return false;
            }
            Statement::Return(value) => {
                let value = self.value(value);
                self.asm.act(Op::ReturnValue, &[value]);
                return false;
            }
        }
        true
    }

    /// Begins the block after a construct, which may be unreachable.
    fn merge(&mut self, label: Id, reachable: bool) -> bool {
        self.label(label);
        if !reachable {
            self.asm.act(Op::Unreachable, &[]);
        }
        reachable
    }

    fn branches(&mut self, condition: &Condition, [then, otherwise]: [&[Statement]; 2], targets: Targets) -> bool {
        let condition = self.holds(condition);
        let [inside, outside, after] = [(); 3].map(|()| self.asm.id());
        // Without an else part the branch may go straight to the end.
        let other = if otherwise.is_empty() { after } else { outside };
        self.asm.act(Op::SelectionMerge, &[after, 0]);
        self.asm.act(Op::BranchConditional, &[condition, inside, other]);
        let mut reachable = otherwise.is_empty();
        let parts = [(inside, then), (outside, otherwise)];
        for (label, statements) in &parts[..if reachable { 1 } else { 2 }] {
            self.label(*label);
            if self.list(statements, targets) {
                self.branch(after);
                reachable = true;
            }
        }
        self.merge(after, reachable)
    }

    /// Emits the branch that continues or ends a loop.
    fn goes_on(&mut self, it: &Loop, [to, end]: [Id; 2]) {
        let count = self.asm.u32(it.count);
        let counter = self.load(self.counters[it.counter]);
        let bool = self.types.bool;
        let few = self.asm.emit(Op::ULessThan, bool, &[counter, count]);
        let condition = self.holds(&it.condition);
        let both = self.asm.emit(Op::LogicalAnd, bool, &[few, condition]);
        self.asm.act(Op::BranchConditional, &[both, to, end]);
    }

    fn repeat(&mut self, it: &Loop) {
        let [header, check, body, continues, end] = [(); 5].map(|()| self.asm.id());
        let zero = self.asm.u32(0);
        self.store(self.counters[it.counter], zero);
        self.branch(header);
        self.label(header);
        self.asm.act(Op::LoopMerge, &[end, continues, 0]);
        if it.at_end {
            self.branch(body);
        } else {
            self.branch(check);
            self.label(check);
            self.goes_on(it, [body, end]);
        }
        self.label(body);
        let targets = Targets { breaks: end, continues };
        if self.list(&it.body, targets) {
            self.branch(continues);
        }
        self.label(continues);
        self.list(&it.continuing, Targets::default());
        let counter = self.load(self.counters[it.counter]);
        let one = self.asm.u32(1);
        let next = self.emit(Op::IAdd, &[counter, one]);
        self.store(self.counters[it.counter], next);
        if it.at_end {
            self.goes_on(it, [header, end]);
        } else {
            self.branch(header);
        }
        self.label(end);
    }

    fn switch(&mut self, it: &Switch, targets: Targets) -> bool {
        let selector = self.value(&it.selector);
        let after = self.asm.id();
        let labels: Vec<Id> = it.cases.iter().map(|_| self.asm.id()).collect();
        let default = it.cases.iter().position(|case| case.values.is_empty());
        let mut operands = vec![selector, default.map_or(after, |index| labels[index])];
        for (case, label) in it.cases.iter().zip(&labels) {
            for value in &case.values {
                operands.extend([*value, *label]);
            }
        }
        self.asm.act(Op::SelectionMerge, &[after, 0]);
        self.asm.act(Op::Switch, &operands);
        let inside = Targets { breaks: after, ..targets };
        let mut reachable = default.is_none();
        for (index, case) in it.cases.iter().enumerate() {
            self.label(labels[index]);
            let through = self.list(&case.body, inside);
            if through {
                let next = labels.get(index + 1).filter(|_| case.falls_through);
                reachable |= next.is_none();
                self.branch(next.copied().unwrap_or(after));
            }
            reachable |= breaks(&case.body);
        }
        self.merge(after, reachable)
    }

    fn value(&mut self, expression: &Expression) -> Id {
        match expression {
            Expression::Constant(value) => self.asm.u32(*value),
            Expression::Parameter(index) => self.parameters[*index],
            Expression::Variable(index) => self.load(self.variables[*index]),
            Expression::Borrowed => self.load(self.borrowed),
            Expression::Counter(index) => self.load(self.counters[*index]),
            Expression::Element(index) => {
                let index = self.value(index);
                let place = self.element(index);
                self.load(place)
            }
            Expression::Binary(binary, left, right) => {
                let (left, right) = (self.value(left), self.value(right));
                self.binary(*binary, left, right)
            }
            Expression::Choose(condition, then, otherwise) => self.choose(condition, [then, otherwise]),
        }
    }

    fn binary(&mut self, binary: Binary, left: Id, right: Id) -> Id {
        let (low, one) = (self.asm.u32(31), self.asm.u32(1));
        let (op, right) = match binary {
            Binary::Add => (Op::IAdd, right),
            Binary::Subtract => (Op::ISub, right),
            Binary::Multiply => (Op::IMul, right),
            Binary::And => (Op::BitwiseAnd, right),
            Binary::Or => (Op::BitwiseOr, right),
            Binary::Xor => (Op::BitwiseXor, right),
            Binary::ShiftLeft => (Op::ShiftLeftLogical, self.emit(Op::BitwiseAnd, &[right, low])),
            Binary::ShiftRight => (Op::ShiftRightLogical, self.emit(Op::BitwiseAnd, &[right, low])),
            Binary::Divide => (Op::UDiv, self.emit(Op::BitwiseOr, &[right, one])),
            Binary::Remainder => (Op::UMod, self.emit(Op::BitwiseOr, &[right, one])),
        };
        self.emit(op, &[left, right])
    }

    fn choose(&mut self, condition: &Condition, parts: [&Expression; 2]) -> Id {
        let condition = self.holds(condition);
        let [inside, outside, after] = [(); 3].map(|()| self.asm.id());
        self.asm.act(Op::SelectionMerge, &[after, 0]);
        self.asm.act(Op::BranchConditional, &[condition, inside, outside]);
        let mut operands = Vec::with_capacity(4);
        for (label, part) in [inside, outside].into_iter().zip(parts) {
            self.label(label);
            let value = self.value(part);
            operands.extend([value, self.block]);
            self.branch(after);
        }
        self.label(after);
        self.emit(Op::Phi, &operands)
    }

    fn holds(&mut self, condition: &Condition) -> Id {
        let (left, right) = (self.value(&condition.left), self.value(&condition.right));
        let bool = self.types.bool;
        let op = match condition.compare {
            Compare::Equal => Op::IEqual,
            Compare::NotEqual => Op::INotEqual,
            Compare::Less => Op::ULessThan,
            Compare::SignedLess => Op::SLessThan,
            Compare::Meet => {
                let both = self.emit(Op::BitwiseAnd, &[left, right]);
                let zero = self.asm.u32(0);
                return self.asm.emit(Op::INotEqual, bool, &[both, zero]);
            }
        };
        self.asm.emit(op, bool, &[left, right])
    }
}

/// True if these statements contain a break that leaves the enclosing switch.
fn breaks(statements: &[Statement]) -> bool {
    statements.iter().any(|statement| match statement {
        Statement::Break => true,
        Statement::If(_, then, otherwise) => breaks(then) || breaks(otherwise),
        _ => false,
    })
}
