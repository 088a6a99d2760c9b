//! Tests of modules that exceed limits: nesting, recursion, calls and sizes are refused with a reason, on a small
//! stack.

use crate::common::OPTIONS;
use gaurast_spirv::{Error, Module, Shader, Specialization, Stage, translate};
use spirv::{AddressingModel, Capability, ExecutionMode, ExecutionModel, MAGIC_NUMBER, MemoryModel, Op};

// The ids of all modules: the types of void, of a function and of bool, and the constant of the subgroup scope.
const VOID: u32 = 1;
const FUNCTION: u32 = 2;
const BOOL: u32 = 3;
const UINT: u32 = 4;
const SUBGROUP: u32 = 5;

/// A module under construction.
struct Builder {
    words: Vec<u32>,
    next_id: u32,
}

impl Builder {
    fn id(&mut self) -> u32 {
        self.next_id += 1;
        self.next_id - 1
    }

    fn op(&mut self, op: Op, operands: &[u32]) {
        self.words.push((operands.len() as u32 + 1) << 16 | op as u32);
        self.words.extend_from_slice(operands);
    }

    /// Begins a function. Returns its id.
    fn begin(&mut self) -> u32 {
        let (function, label) = (self.id(), self.id());
        self.op(Op::Function, &[VOID, function, 0, FUNCTION]);
        self.op(Op::Label, &[label]);
        function
    }

    fn end(&mut self) {
        self.op(Op::Return, &[]);
        self.op(Op::FunctionEnd, &[]);
    }

    fn call(&mut self, callee: u32) {
        let result = self.id();
        self.op(Op::FunctionCall, &[VOID, result, callee]);
    }

    /// Emits `depth` nested selections, with the instructions of `within` in the innermost.
    fn nest(&mut self, depth: usize, within: impl FnOnce(&mut Self)) {
        let condition = self.id();
        self.op(Op::GroupNonUniformElect, &[BOOL, condition, SUBGROUP]);
        let mut merges = Vec::new();
        for _ in 0..depth {
            let (then, merge) = (self.id(), self.id());
            self.op(Op::SelectionMerge, &[merge, 0]);
            self.op(Op::BranchConditional, &[condition, then, merge]);
            self.op(Op::Label, &[then]);
            merges.push(merge);
        }
        within(self);
        for merge in merges.into_iter().rev() {
            self.op(Op::Branch, &[merge]);
            self.op(Op::Label, &[merge]);
        }
    }
}

/// A module whose functions `body` emits; `body` returns the id of the entry point's function.
fn module(body: impl FnOnce(&mut Builder) -> u32) -> Vec<u32> {
    let mut functions = Builder { words: Vec::new(), next_id: SUBGROUP + 1 };
    let main = body(&mut functions);
    let bound = functions.next_id;
    let mut it = Builder { words: vec![MAGIC_NUMBER, 0x0001_0300, 0, bound, 0], next_id: bound };
    it.op(Op::Capability, &[Capability::Shader as u32]);
    it.op(Op::Capability, &[Capability::GroupNonUniform as u32]);
    it.op(Op::MemoryModel, &[AddressingModel::Logical as u32, MemoryModel::GLSL450 as u32]);
    let name = u32::from_le_bytes(*b"main");
    it.op(Op::EntryPoint, &[ExecutionModel::GLCompute as u32, main, name, 0]);
    it.op(Op::ExecutionMode, &[main, ExecutionMode::LocalSize as u32, 1, 1, 1]);
    it.op(Op::TypeVoid, &[VOID]);
    it.op(Op::TypeFunction, &[FUNCTION, VOID]);
    it.op(Op::TypeBool, &[BOOL]);
    it.op(Op::TypeInt, &[UINT, 32, 0]);
    it.op(Op::Constant, &[UINT, SUBGROUP, 3]);
    it.words.append(&mut functions.words);
    it.words
}

fn attempt(words: Vec<u32>) -> Result<Shader, Error> {
    let small_stack = std::thread::Builder::new().stack_size(1 << 20);
    let translation = small_stack.spawn(move || {
        let module = Module::parse(&words)?;
        let specialization = Specialization::default();
        translate(&module, "main", Stage::Compute, &specialization, &OPTIONS)
    });
    translation.unwrap().join().unwrap()
}

#[gaurast_runner::test]
fn nesting_is_bounded() {
    let nested = |depth| {
        module(|b| {
            let main = b.begin();
            b.nest(depth, |_| {});
            b.end();
            main
        })
    };
    assert!(attempt(nested(100)).is_ok());
    let refused = attempt(nested(5000)).unwrap_err().to_string();
    assert!(refused.contains("nested too deeply"), "{refused}");
}

#[gaurast_runner::test]
fn nesting_adds_up_over_calls() {
    let words = module(|b| {
        let mut callee = None;
        for _ in 0..40 {
            let function = b.begin();
            b.nest(100, |b| {
                if let Some(callee) = callee {
                    b.call(callee);
                }
            });
            b.end();
            callee = Some(function);
        }
        callee.unwrap()
    });
    let refused = attempt(words).unwrap_err().to_string();
    assert!(refused.contains("nested too deeply"), "{refused}");
}

#[gaurast_runner::test]
fn recursion_is_refused() {
    let words = module(|b| {
        let main = b.begin();
        b.call(main);
        b.end();
        main
    });
    let refused = attempt(words).unwrap_err().to_string();
    assert!(refused.contains("calls itself"), "{refused}");
}

#[gaurast_runner::test]
fn calls_that_multiply_are_refused() {
    // Thirty functions that each call the one before four times: 4^30 calls, far too many to translate.
    let words = module(|b| {
        let mut callee = None;
        for _ in 0..30 {
            let function = b.begin();
            if let Some(callee) = callee {
                for _ in 0..4 {
                    b.call(callee);
                }
            }
            b.end();
            callee = Some(function);
        }
        callee.unwrap()
    });
    assert!(matches!(attempt(words), Err(Error::TooLarge { .. })));
}
