//! Rows whose model depends on a whole subgroup.

use gaurast_tests::programs::inputs::Domain;
use gaurast_tests::programs::types::{Kind, Ty};
use gaurast_tests::programs::{Body, Expect, Lane, Model, Row};
use spirv::{Capability, Op};

/// The type of one Boolean.
pub const BOOL: Ty = Ty::scalar(Kind::Bool);

/// A row whose model depends on the whole subgroup. Its instruction has a scope as first operand.
pub fn group(
    name: impl Into<String>,
    operands: &[Ty],
    result: Ty,
    emit: impl Fn(&mut Body, &[u32]) -> u32 + 'static,
    model: impl Fn(&[Lane], usize) -> Vec<Expect> + 'static,
) -> Row {
    Row {
        name: name.into(),
        operands: operands.iter().map(|ty| (*ty, Domain::Any)).collect(),
        results: vec![result],
        emit: Box::new(move |body, v| vec![emit(body, v)]),
        model: Model::Subgroup(Box::new(model)),
        flushes: true,
    }
}

/// An instruction whose first operand is the scope of a subgroup.
pub fn scoped(body: &mut Body, op: Op, needs: Capability, ty: Ty, operands: &[u32]) -> u32 {
    body.asm.capability(Capability::GroupNonUniform);
    body.asm.capability(needs);
    let (ty, scope) = (body.ty(ty), body.asm.u32(3));
    body.asm.emit(op, ty, &[&[scope], operands].concat())
}

/// The result of `emit` if a condition holds, and zero otherwise.
pub fn where_true(body: &mut Body, condition: u32, ty: Ty, emit: impl FnOnce(&mut Body) -> u32) -> u32 {
    let id = body.ty(ty);
    let null = body.asm.declare(Op::ConstantNull, Some(id), &[]);
    let variable = body.asm.local(id);
    body.asm.act(Op::Store, &[variable, null]);
    let (inside, after) = (body.asm.id(), body.asm.id());
    body.asm.act(Op::SelectionMerge, &[after, 0]);
    body.asm.act(Op::BranchConditional, &[condition, inside, after]);
    body.asm.label(inside);
    let value = emit(body);
    body.asm.act(Op::Store, &[variable, value]);
    body.asm.act(Op::Branch, &[after]);
    body.asm.label(after);
    body.asm.emit(Op::Load, id, &[variable])
}
