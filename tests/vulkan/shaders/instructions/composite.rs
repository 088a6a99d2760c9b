//! Composites and memory: instructions that move values.

use super::rows::row;
use gaurast_tests::programs::assembler::Id;
use gaurast_tests::programs::inputs::Domain;
use gaurast_tests::programs::types::{Kind, Ty};
use gaurast_tests::programs::{Body, Expect, Row};
use spirv::{Op, StorageClass};

/// A row that only moves values; its model gives the exact bits.
fn moves(
    name: impl Into<String>,
    operands: &[Ty],
    results: &[Ty],
    emit: impl Fn(&mut Body, &[Id]) -> Vec<Id> + 'static,
    model: impl Fn(&[Vec<u64>]) -> Vec<u64> + 'static,
) -> Row {
    let model = move |v: &[Vec<u64>]| model(v).into_iter().map(Expect::Is).collect();
    let mut row = row(name.into(), operands, results, emit, model);
    row.flushes = false;
    row
}

pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for kind in [Kind::Bool, Kind::U8, Kind::I16, Kind::F16, Kind::F32, Kind::U64, Kind::F64] {
        rows.extend(vectors(kind));
    }
    for kind in Kind::FLOATS {
        rows.extend(matrices(kind));
    }
    for kind in [Kind::I8, Kind::F16, Kind::I32, Kind::F32, Kind::F64] {
        for class in [StorageClass::Function, StorageClass::Private] {
            rows.push(array(kind, class));
        }
        rows.extend(variables(kind));
    }
    rows
}

fn vectors(kind: Kind) -> Vec<Row> {
    let (four, two, one) = (Ty::vector(kind, 4), Ty::vector(kind, 2), Ty::scalar(kind));
    let index = Ty::scalar(Kind::U32);
    let four_lanes = Domain::Integers(0, 3);
    vec![
        moves(
            format!("VectorExtractDynamic {kind:?}"),
            &[four, index],
            &[one],
            move |body, v| {
                let ty = body.ty(one);
                vec![body.asm.emit(Op::VectorExtractDynamic, ty, v)]
            },
            |v| vec![v[0][v[1][0] as usize]],
        )
        .of(1, four_lanes),
        moves(
            format!("VectorInsertDynamic {kind:?}"),
            &[four, one, index],
            &[four],
            move |body, v| {
                let ty = body.ty(four);
                vec![body.asm.emit(Op::VectorInsertDynamic, ty, v)]
            },
            |v| {
                let mut all = v[0].clone();
                all[v[2][0] as usize] = v[1][0];
                all
            },
        )
        .of(2, four_lanes),
        moves(
            format!("VectorShuffle {kind:?}"),
            &[four, two],
            &[four],
            move |body, v| {
                let ty = body.ty(four);
                let operands = [v[0], v[1], 5, 0, 3, 4];
                vec![body.asm.emit(Op::VectorShuffle, ty, &operands)]
            },
            |v| vec![v[1][1], v[0][0], v[0][3], v[1][0]],
        ),
        moves(
            format!("CompositeConstruct from vectors {kind:?}"),
            &[one, two, one],
            &[four],
            move |body, v| {
                let ty = body.ty(four);
                vec![body.asm.emit(Op::CompositeConstruct, ty, v)]
            },
            <[Vec<u64>]>::concat,
        ),
        moves(
            format!("CompositeInsert, CopyObject {kind:?}"),
            &[four, one],
            &[four],
            move |body, v| {
                let ty = body.ty(four);
                let inserted = body.asm.emit(Op::CompositeInsert, ty, &[v[1], v[0], 2]);
                vec![body.asm.emit(Op::CopyObject, ty, &[inserted])]
            },
            |v| vec![v[0][0], v[0][1], v[1][0], v[0][3]],
        ),
    ]
}

fn matrices(kind: Kind) -> Vec<Row> {
    let tall = Ty::matrix(kind, 2, 3);
    let wide = Ty::matrix(kind, 3, 2);
    let column = Ty::vector(kind, 3);
    vec![
        moves(
            format!("Transpose {kind:?}"),
            &[tall],
            &[wide],
            move |body, v| {
                let ty = body.ty(wide);
                vec![body.asm.emit(Op::Transpose, ty, v)]
            },
            |v| [0, 3, 1, 4, 2, 5].map(|at| v[0][at]).to_vec(),
        ),
        moves(
            format!("CompositeInsert of a column {kind:?}"),
            &[tall, column],
            &[tall],
            move |body, v| {
                let ty = body.ty(tall);
                vec![body.asm.emit(Op::CompositeInsert, ty, &[v[1], v[0], 1])]
            },
            |v| [&v[0][..3], &v[1]].concat(),
        ),
        moves(
            format!("a matrix in memory, its columns indexed {kind:?}"),
            &[tall, Ty::scalar(Kind::I32)],
            &[column],
            move |body, v| {
                let (ty, part) = (body.ty(tall), body.ty(column));
                let variable = body.asm.local(ty);
                body.asm.act(Op::Store, &[variable, v[0]]);
                let pointer = body.asm.pointer(StorageClass::Function, part);
                let place = body.asm.emit(Op::AccessChain, pointer, &[variable, v[1]]);
                vec![body.asm.emit(Op::Load, part, &[place])]
            },
            |v| v[0][3 * v[1][0] as usize..][..3].to_vec(),
        )
        .of(1, Domain::Integers(0, 1)),
    ]
}

/// An array with elements that are written and read at indices known only at run time.
fn array(kind: Kind, class: StorageClass) -> Row {
    let value = Ty::vector(kind, 2);
    let index = Ty::scalar(Kind::U32);
    moves(
        format!("AccessChain of a {class:?} array {kind:?}"),
        &[value, value, index, index],
        &[value, Ty::scalar(kind)],
        move |body, v| {
            let (ty, part) = (body.ty(value), body.ty(Ty::scalar(kind)));
            let length = body.asm.u32(5);
            let array = body.asm.declare(Op::TypeArray, None, &[ty, length]);
            let variable = match class {
                StorageClass::Function => body.asm.local(array),
                class => body.asm.global(class, array),
            };
            let pointer = body.asm.pointer(class, ty);
            for element in 0..5 {
                let element = body.asm.u32(element);
                let place = body.asm.emit(Op::AccessChain, pointer, &[variable, element]);
                body.asm.act(Op::Store, &[place, v[0]]);
            }
            let written = body.asm.emit(Op::InBoundsAccessChain, pointer, &[variable, v[2]]);
            body.asm.act(Op::Store, &[written, v[1]]);
            let read = body.asm.emit(Op::AccessChain, pointer, &[variable, v[3]]);
            let pointer = body.asm.pointer(class, part);
            let one = body.asm.u32(1);
            let component = body.asm.emit(Op::AccessChain, pointer, &[written, one]);
            vec![body.asm.emit(Op::Load, ty, &[read]), body.asm.emit(Op::Load, part, &[component])]
        },
        |v| {
            let found = if v[2] == v[3] { &v[1] } else { &v[0] };
            [found.as_slice(), &v[1][1..]].concat()
        },
    )
    .of(2, Domain::Integers(0, 4))
    .of(3, Domain::Integers(0, 4))
}

fn variables(kind: Kind) -> Vec<Row> {
    let value = Ty::vector(kind, 3);
    let structure = move |body: &mut Body| {
        let (ty, part) = (body.ty(value), body.ty(Ty::scalar(kind)));
        body.asm.declare(Op::TypeStruct, None, &[ty, part])
    };
    vec![
        moves(
            format!("CopyMemory {kind:?}"),
            &[value],
            &[value],
            move |body, v| {
                let ty = body.ty(value);
                let (from, to) = (body.asm.local(ty), body.asm.local(ty));
                body.asm.act(Op::Store, &[from, v[0]]);
                body.asm.act(Op::CopyMemory, &[to, from]);
                vec![body.asm.emit(Op::Load, ty, &[to])]
            },
            |v| v[0].clone(),
        ),
        moves(
            format!("a structure in memory {kind:?}"),
            &[value, Ty::scalar(kind)],
            &[value],
            move |body, v| {
                let (ty, whole) = (body.ty(value), structure(body));
                let variable = body.asm.local(whole);
                let built = body.asm.emit(Op::CompositeConstruct, whole, v);
                body.asm.act(Op::Store, &[variable, built]);
                let part = body.ty(Ty::scalar(kind));
                let pointer = body.asm.pointer(StorageClass::Function, part);
                let (zero, two) = (body.asm.u32(0), body.asm.u32(2));
                let place = body.asm.emit(Op::AccessChain, pointer, &[variable, zero, two]);
                body.asm.act(Op::Store, &[place, v[1]]);
                let loaded = body.asm.emit(Op::Load, whole, &[variable]);
                vec![body.asm.emit(Op::CompositeExtract, ty, &[loaded, 0])]
            },
            |v| vec![v[0][0], v[0][1], v[1][0]],
        ),
        moves(
            format!("CopyLogical {kind:?}"),
            &[value, Ty::scalar(kind)],
            &[Ty::scalar(kind)],
            move |body, v| {
                let from = structure(body);
                let (ty, part) = (body.ty(value), body.ty(Ty::scalar(kind)));
                let to = body.asm.declare_anew(Op::TypeStruct, None, &[ty, part]);
                let built = body.asm.emit(Op::CompositeConstruct, from, v);
                let copied = body.asm.emit(Op::CopyLogical, to, &[built]);
                vec![body.asm.emit(Op::CompositeExtract, part, &[copied, 1])]
            },
            |v| v[1].clone(),
        ),
    ]
}
