//! Modules built to be too much: nesting, recursion, calls and sizes are refused with a reason, on a small stack.

use crate::common::OPTIONS;
use gaurast_spirv::{Error, Module, Shader, Specialization, Stage, translate};
use rspirv::binary::Assemble;
use rspirv::dr::Builder;
use rspirv::spirv::{
    AddressingModel, Capability, ExecutionMode, ExecutionModel, FunctionControl, MemoryModel,
    SelectionControl, Word,
};

/// A module whose entry point is what `body` makes; it gets the types of void, function and bool,
/// and the constant that means a subgroup.
fn module(body: impl FnOnce(&mut Builder, [Word; 4]) -> Word) -> Vec<u32> {
    let mut b = Builder::new();
    b.set_version(1, 3);
    b.capability(Capability::Shader);
    b.memory_model(AddressingModel::Logical, MemoryModel::GLSL450);
    let void = b.type_void();
    let function = b.type_function(void, vec![]);
    b.capability(Capability::GroupNonUniform);
    let bool = b.type_bool();
    let uint = b.type_int(32, 0);
    let subgroup = b.constant_bit32(uint, 3);
    let main = body(&mut b, [void, function, bool, subgroup]);
    b.entry_point(ExecutionModel::GLCompute, main, "main", vec![]);
    b.execution_mode(main, ExecutionMode::LocalSize, vec![1, 1, 1]);
    b.module().assemble()
}

fn begin(b: &mut Builder, [void, ty, ..]: [Word; 4]) -> Word {
    let function = b
        .begin_function(void, None, FunctionControl::NONE, ty)
        .unwrap();
    b.begin_block(None).unwrap();
    function
}

/// Opens and closes nested selections, innermost first closed, with something within.
fn nest(
    b: &mut Builder,
    [_, _, bool, subgroup]: [Word; 4],
    depth: usize,
    within: impl FnOnce(&mut Builder),
) {
    let condition = b.group_non_uniform_elect(bool, None, subgroup).unwrap();
    let mut merges = Vec::new();
    for _ in 0..depth {
        let (then, merge) = (b.id(), b.id());
        b.selection_merge(merge, SelectionControl::NONE).unwrap();
        b.branch_conditional(condition, then, merge, vec![])
            .unwrap();
        b.begin_block(Some(then)).unwrap();
        merges.push(merge);
    }
    within(b);
    for merge in merges.into_iter().rev() {
        b.branch(merge).unwrap();
        b.begin_block(Some(merge)).unwrap();
    }
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
        module(|b, types| {
            let main = begin(b, types);
            nest(b, types, depth, |_| {});
            b.ret().unwrap();
            b.end_function().unwrap();
            main
        })
    };
    assert!(attempt(nested(100)).is_ok());
    let refused = attempt(nested(5000)).unwrap_err().to_string();
    assert!(refused.contains("nested too deeply"), "{refused}");
}

#[gaurast_runner::test]
fn nesting_adds_up_over_calls() {
    let words = module(|b, types| {
        let mut callee = None;
        for _ in 0..40 {
            let function = begin(b, types);
            nest(b, types, 100, |b| {
                if let Some(callee) = callee {
                    b.function_call(types[0], None, callee, vec![]).unwrap();
                }
            });
            b.ret().unwrap();
            b.end_function().unwrap();
            callee = Some(function);
        }
        callee.unwrap()
    });
    let refused = attempt(words).unwrap_err().to_string();
    assert!(refused.contains("nested too deeply"), "{refused}");
}

#[gaurast_runner::test]
fn recursion_is_refused() {
    let words = module(|b, types| {
        let main = begin(b, types);
        b.function_call(types[0], None, main, vec![]).unwrap();
        b.ret().unwrap();
        b.end_function().unwrap();
        main
    });
    let refused = attempt(words).unwrap_err().to_string();
    assert!(refused.contains("calls itself"), "{refused}");
}

#[gaurast_runner::test]
fn calls_that_multiply_are_refused() {
    // Thirty functions that each call the one before four times: 4^30 calls, which nobody would see the end of.
    let words = module(|b, types| {
        let mut callee = None;
        for _ in 0..30 {
            let function = begin(b, types);
            if let Some(callee) = callee {
                for _ in 0..4 {
                    b.function_call(types[0], None, callee, vec![]).unwrap();
                }
            }
            b.ret().unwrap();
            b.end_function().unwrap();
            callee = Some(function);
        }
        callee.unwrap()
    });
    assert!(matches!(attempt(words), Err(Error::TooLarge { .. })));
}
