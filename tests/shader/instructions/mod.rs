//! Every instruction alone, a row each: its results against an exact model or one within the precision that Vulkan asks
//! for, on this driver and on lavapipe.

mod atomic;
mod composite;
mod conversion;
mod float;
mod function;
mod integer;
mod linear;
mod reduction;
mod subgroup;

use gaurast_tests::kernels::Context;
use gaurast_tests::programs::inputs::Domain;
use gaurast_tests::programs::types::Ty;
use gaurast_tests::programs::{Body, Expect, LANES, Model, Row, check};
use rspirv::spirv::{GlslStd450Op as G, Op};
use std::collections::BTreeMap;

/// An instruction of the core or of GLSL.std.450.
#[derive(Clone, Copy)]
enum What {
    Core(Op),
    Glsl(G),
}

impl What {
    fn emit(self, body: &mut Body, ty: Ty, operands: &[u32]) -> u32 {
        let ty = body.ty(ty);
        match self {
            Self::Core(op) => body.asm.emit(op, ty, operands),
            Self::Glsl(op) => body.asm.glsl(op, ty, operands),
        }
    }

    fn name(self) -> String {
        match self {
            Self::Core(op) => format!("{op:?}"),
            Self::Glsl(op) => format!("Glsl{op:?}"),
        }
    }
}

fn name_of(what: What, operands: &[Ty], results: &[Ty]) -> String {
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

/// A row whose model sees an invocation's operands.
fn row(
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
fn whole(
    what: What,
    operands: &[Ty],
    result: Ty,
    model: impl Fn(&[Vec<u64>]) -> Vec<Expect> + 'static,
) -> Row {
    row(
        name_of(what, operands, &[result]),
        operands,
        &[result],
        move |body, operands| vec![what.emit(body, result, operands)],
        model,
    )
}

/// A row of one instruction that works component by component.
fn each(
    what: What,
    operands: &[Ty],
    result: Ty,
    model: impl Fn(&[u64]) -> Expect + 'static,
) -> Row {
    whole(what, operands, result, move |operands| {
        (0..result.count())
            .map(|component| {
                let one: Vec<u64> = operands.iter().map(|all| all[component]).collect();
                model(&one)
            })
            .collect()
    })
}

/// All of them.
fn all() -> Vec<Row> {
    [
        integer::rows(),
        float::rows(),
        conversion::rows(),
        composite::rows(),
        linear::rows(),
        function::rows(),
        atomic::rows(),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Runs all rows; what fails must be what the list names, each with a reason. Without a list none may fail. The list of
/// another driver was made with one version of it on one processor: a few more are told, and no more than that.
fn check_all(context: &Context, list: &str) {
    let expected: BTreeMap<&str, &str> = list
        .lines()
        .filter(|line| !line.is_empty() && !line.starts_with('#'))
        .map(|line| line.split_once(": ").expect("a row, a colon and a reason"))
        .collect();
    let mut rows = all();
    rows.extend(subgroup::rows(context));
    let failures = check(context, &rows).unwrap_or_else(|(error, rows)| {
        panic!("{}: {error}: {}", context.name, rows.join(", "));
    });
    eprintln!(
        "{}: {} rows of {LANES} invocations, {} outside the specification",
        context.name,
        rows.len(),
        failures.len()
    );
    let wrong: Vec<String> = failures
        .iter()
        .filter(|failure| !expected.contains_key(failure.row.as_str()))
        .map(|it| format!("{}: {} lanes; {}", it.row, it.lanes, it.example))
        .collect();
    eprintln!("{}, not listed: {wrong:#?}", context.name);
    assert!(
        wrong.len() <= expected.len() / 2,
        "{}:\n{}",
        context.name,
        wrong.join("\n")
    );
    for name in expected.keys() {
        if !failures.iter().any(|failure| failure.row == *name) {
            eprintln!("{}: {name} is listed, but it passes here", context.name);
        }
    }
}

/// Opcodes of the groups of instructions that are tried here.
const OPCODES: &[std::ops::RangeInclusive<u32>] = &[
    // Composites, conversions, arithmetic.
    77..=84,
    109..=116,
    124..=124,
    126..=152,
    // Truth values, relations, bits.
    154..=157,
    164..=191,
    194..=205,
    // Atomics, groups.
    227..=242,
    333..=366,
];

/// Those among them that no row is named after: they are in all rows, or need what Vulkan doesn't have.
const IN_ALL_ROWS: &[Op] = &[Op::CompositeExtract, Op::AtomicCompareExchangeWeak];

#[test]
fn every_instruction_has_a_row() {
    let mut rows = all();
    rows.extend(subgroup::rows(&Context::gaurast().unwrap()));
    let names: Vec<&str> = rows.iter().map(|row| row.name.as_str()).collect();
    let is_named = |name: &str| {
        let is_word = |row: &str| row.split([' ', ',']).any(|word| word == name);
        names.iter().any(|row| is_word(row))
    };
    let core = OPCODES.iter().cloned().flatten().filter_map(Op::from_u32);
    let core = core.filter(|op| !IN_ALL_ROWS.contains(op));
    let missing: Vec<String> = core
        .map(What::Core)
        .chain((1..=81).filter_map(G::from_u32).map(What::Glsl))
        .map(What::name)
        .filter(|name| !is_named(name))
        .collect();
    // The first is reserved, the others are for fragments alone.
    let none = [
        "GlslIMix",
        "GlslInterpolateAtCentroid",
        "GlslInterpolateAtSample",
        "GlslInterpolateAtOffset",
    ];
    assert_eq!(missing, none);
}

#[test]
fn the_reserved_function_is_refused() {
    let ty = Ty::scalar(gaurast_tests::programs::types::Kind::I32);
    let row = whole(What::Glsl(G::IMix), &[ty, ty, ty], ty, |_| {
        vec![Expect::Any]
    });
    let refused = check(&Context::gaurast().unwrap(), &[row]);
    assert!(refused.is_err(), "GLSL.std.450 has no IMix");
}

#[test]
fn instructions_are_as_precise_as_vulkan_asks() {
    check_all(&Context::gaurast().unwrap(), "");
}

#[test]
fn lavapipe_differs_where_the_list_says() {
    match Context::lavapipe().unwrap() {
        Some(lavapipe) => check_all(
            &lavapipe,
            include_str!("../../expected_failures/lavapipe_instructions.txt"),
        ),
        None => eprintln!("skipped: the Vulkan loader does not know lavapipe"),
    }
}
