//! Every instruction alone, one row each. The results are compared with an exact model, or with one of the precision
//! that Vulkan requires, on this driver and on lavapipe.

mod atomic;
mod composite;
mod conversion;
mod float;
mod function;
mod group;
mod integer;
mod linear;
mod reduction;
mod rows;
mod subgroup;

use super::lavapipe;
use gaurast_runner::{Case, Missing, Need, Variant, ignore};
use gaurast_tests::programs::types::Ty;
use gaurast_tests::programs::{Expect, LANES, Row, check};
use gaurast_workloads::kernels::Context;
use rows::{What, whole};
use spirv::{GlslStd450Op as G, Op};

/// All rows.
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

/// Runs rows. Those that fail must be in the list, which gives a reason for each; with an empty list none may fail. The
/// list of another driver was made with one version of it on one processor, so a few more may fail: half as many as the
/// list has of these rows.
fn check_all(context: &Context, rows: &[Row], list: &str) {
    let is_listed = |name: &str| {
        let mut lines = list.lines().filter(|line| !line.starts_with('#'));
        lines.any(|line| line.split_once(": ").is_some_and(|(listed, _)| listed == name))
    };
    let failures = check(context, rows).unwrap_or_else(|(error, rows)| {
        panic!("{}: {error}: {}", context.name, rows.join(", "));
    });
    let wrong: Vec<String> = failures
        .iter()
        .filter(|failure| !is_listed(&failure.row))
        .map(|it| format!("{}: {} lanes; {}", it.row, it.lanes, it.example))
        .collect();
    let listed = rows.iter().filter(|row| is_listed(&row.name)).count();
    assert!(
        wrong.len() <= listed / 2,
        "{}: of {} rows of {LANES} invocations, {} are outside the specification; the list lacks\n{}",
        context.name,
        rows.len(),
        failures.len(),
        wrong.join("\n")
    );
}

/// The rows in which lavapipe does not follow the specification.
const LAVAPIPE: &str = include_str!("../../../expected_failures/lavapipe_instructions.txt");

/// The opcodes of the tested groups of instructions.
const OPCODES: &[std::ops::RangeInclusive<u32>] = &[
    // Composites, conversions, arithmetic.
    77..=84,
    109..=116,
    124..=124,
    126..=152,
    // Booleans, relations, bits.
    154..=157,
    164..=191,
    194..=205,
    // Atomics, groups.
    227..=242,
    333..=366,
];

/// The opcodes among them that have no row of their own: they occur in all rows, or need features that Vulkan lacks.
const IN_ALL_ROWS: &[Op] = &[Op::CompositeExtract, Op::AtomicCompareExchangeWeak];

#[gaurast_runner::test]
fn every_instruction_has_a_row() {
    let mut rows = all();
    rows.extend(subgroup::rows());
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
    // The first is reserved; the others exist only in fragment shaders.
    let none = ["GlslIMix", "GlslInterpolateAtCentroid", "GlslInterpolateAtSample", "GlslInterpolateAtOffset"];
    assert_eq!(missing, none);
}

#[gaurast_runner::test]
fn the_reserved_function_is_refused() {
    let ty = Ty::scalar(gaurast_tests::programs::types::Kind::I32);
    let row = whole(What::Glsl(G::IMix), &[ty, ty, ty], ty, |_| vec![Expect::Any]);
    let refused = check(&Context::gaurast().unwrap(), &[row]);
    assert!(refused.is_err(), "GLSL.std.450 has no IMix");
}

#[gaurast_runner::test]
fn instructions_are_as_precise_as_vulkan_asks() {
    let context = Context::gaurast().unwrap();
    for (name, flags, _) in subgroup::GROUPS {
        assert!(context.subgroup_operations.contains(flags), "{name}");
    }
    let mut rows = all();
    rows.extend(subgroup::rows());
    check_all(&context, &rows, "");
}

#[gaurast_runner::test(needs = [Need::Lavapipe])]
fn lavapipe_differs_where_the_list_says() {
    check_all(&lavapipe(), &all(), LAVAPIPE);
}

fn groups() -> Vec<Variant> {
    let all = subgroup::GROUPS.into_iter();
    all.map(|(name, ..)| Variant::new(name)).collect()
}

#[gaurast_runner::test(needs = [Need::Lavapipe], each = groups())]
fn subgroups_of_lavapipe_differ_where_the_list_says(case: &Case) {
    let mut groups = subgroup::GROUPS.into_iter();
    let group = groups.find(|(name, ..)| *name == case.variant());
    let (_, flags, rows) = group.expect("a group");
    let context = lavapipe();
    if !context.subgroup_operations.contains(flags) {
        let reason = format!("{} has no subgroups with {flags:?}", context.name);
        ignore(Missing::Capability, reason);
    }
    check_all(&context, &rows(), LAVAPIPE);
}
