//! Rows of one instruction each.

use gaurast_tests::programs::inputs::Domain;
use gaurast_tests::programs::types::Ty;
use gaurast_tests::programs::{Body, Expect, Model, Row};
use spirv::{GlslStd450Op as G, Op};

/// An instruction of the core or of GLSL.std.450.
#[derive(Clone, Copy)]
pub enum What {
    Core(Op),
    Glsl(G),
}

impl What {
    pub fn emit(self, body: &mut Body, ty: Ty, operands: &[u32]) -> u32 {
        let ty = body.ty(ty);
        match self {
            Self::Core(op) => body.asm.emit(op, ty, operands),
            Self::Glsl(op) => body.asm.glsl(op, ty, operands),
        }
    }

    pub fn name(self) -> String {
        match self {
            Self::Core(op) => format!("{op:?}"),
            Self::Glsl(op) => format!("Glsl{op:?}"),
        }
    }
}

pub fn name_of(what: What, operands: &[Ty], results: &[Ty]) -> String {
    let one = |ty: &Ty| {
        let kind = format!("{:?}", ty.kind);
        match (ty.columns, ty.rows) {
            (1, 1) => kind,
            (1, rows) => format!("{kind}x{rows}"),
            (columns, rows) => format!("{kind}x{columns}x{rows}"),
        }
    };
    let all = |types: &[Ty]| types.iter().map(one).collect::<Vec<_>>().join(" ");
    format!("{} {} -> {}", what.name(), all(operands), all(results))
}

/// A row whose model depends only on an invocation's operands.
pub fn row(
    name: String,
    operands: &[Ty],
    results: &[Ty],
    emit: impl Fn(&mut Body, &[u32]) -> Vec<u32> + 'static,
    model: impl Fn(&[Vec<u64>]) -> Vec<Expect> + 'static,
) -> Row {
    Row {
        name,
        operands: operands.iter().map(|ty| (*ty, Domain::Any)).collect(),
        results: results.to_vec(),
        emit: Box::new(emit),
        model: Model::Lane(Box::new(model)),
        flushes: true,
    }
}

/// A row of one instruction with one result.
pub fn whole(what: What, operands: &[Ty], result: Ty, model: impl Fn(&[Vec<u64>]) -> Vec<Expect> + 'static) -> Row {
    row(
        name_of(what, operands, &[result]),
        operands,
        &[result],
        move |body, operands| vec![what.emit(body, result, operands)],
        model,
    )
}

/// A row of one instruction that works component by component.
pub fn each(what: What, operands: &[Ty], result: Ty, model: impl Fn(&[u64]) -> Expect + 'static) -> Row {
    whole(what, operands, result, move |operands| {
        (0..result.count())
            .map(|component| {
                let one: Vec<u64> = operands.iter().map(|all| all[component]).collect();
                model(&one)
            })
            .collect()
    })
}
