//! Tests of every topology against the tables of Vulkan 1.3, written out vertex by vertex.

use super::scene::*;
use crate::packet::IndexStream;
use crate::state::Topology;
use crate::state::Topology::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const TOPOLOGIES: [Topology; 10] = [
    PointList,
    LineList,
    LineStrip,
    TriangleList,
    TriangleStrip,
    TriangleFan,
    LineListWithAdjacency,
    LineStripWithAdjacency,
    TriangleListWithAdjacency,
    TriangleStripWithAdjacency,
];

/// The primitives of a run: their vertices, and the provoking vertices of first-vertex and last-vertex mode.
fn naive(topology: Topology, run: &[u32]) -> Vec<(Vec<u32>, [u32; 2])> {
    let mut out = Vec::new();
    let n = run.len();
    let mut add = |places: &[usize], first: usize, last: usize| {
        if places.iter().all(|&place| place < n) {
            let vertices = places.iter().map(|&place| run[place]).collect();
            out.push((vertices, [run[first], run[last]]));
        }
    };
    for i in 0..n {
        match topology {
            PointList => add(&[i], i, i),
            LineList if i % 2 == 0 => add(&[i, i + 1], i, i + 1),
            LineStrip => add(&[i, i + 1], i, i + 1),
            TriangleList if i % 3 == 0 => add(&[i, i + 1, i + 2], i, i + 2),
            TriangleStrip if i % 2 == 0 => add(&[i, i + 1, i + 2], i, i + 2),
            TriangleStrip => add(&[i, i + 2, i + 1], i, i + 2),
            TriangleFan => add(&[i + 1, i + 2, 0], i + 1, i + 2),
            // The adjacent vertices must exist, too.
            LineListWithAdjacency if i % 4 == 0 && i + 3 < n => add(&[i + 1, i + 2], i + 1, i + 2),
            LineStripWithAdjacency if i + 3 < n => add(&[i + 1, i + 2], i + 1, i + 2),
            TriangleListWithAdjacency if i % 6 == 0 && i + 5 < n => {
                add(&[i, i + 2, i + 4], i, i + 4);
            }
            TriangleStripWithAdjacency if i % 2 == 0 && i + 5 < n => {
                let order = if i % 4 == 0 { [i, i + 2, i + 4] } else { [i, i + 4, i + 2] };
                add(&order, i, i + 4);
            }
            _ => {}
        }
    }
    out
}

/// Rotates the least vertex to the front, so that only the winding order matters.
fn canonical(mut vertices: Vec<u32>) -> Vec<u32> {
    if vertices.len() == 3 {
        let least = (0..3).min_by_key(|&i| vertices[i]).unwrap();
        vertices.rotate_left(least);
    }
    vertices
}

/// Random positions in the framebuffer, of which no three are collinear.
fn positions(count: usize) -> Vec<[f32; 4]> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut coordinate = || rng.random_range(-0.9..0.9);
    (0..count).map(|_| [coordinate(), coordinate(), 0.5, 1.0]).collect()
}

/// The primitives of a draw: id, instance, vertices in winding order, and provoking vertex.
fn primitives(draw: &Found) -> Vec<(u32, u32, Vec<u32>, u32)> {
    let index = |vertex| varying_bits(draw, vertex, INDEX);
    let describe = |primitive: &super::super::Primitive| {
        let [a, b, c] = primitive.vertices.map(index);
        let vertices = match primitive.kind {
            super::super::PrimitiveKind::Point => vec![a],
            super::super::PrimitiveKind::Line | super::super::PrimitiveKind::StyledLine => vec![a, c],
            // Front faces are clockwise in this state, and their corners keep their order.
            super::super::PrimitiveKind::Triangle if primitive.front => vec![a, b, c],
            super::super::PrimitiveKind::Triangle => vec![a, c, b],
        };
        let instance = varying_bits(draw, primitive.provoking, INSTANCE);
        (primitive.id, instance, canonical(vertices), index(primitive.provoking))
    };
    draw.primitives.iter().map(describe).collect()
}

/// The expected primitives of a draw of these runs, for each of two instances from number 5 on. Primitives with two
/// equal vertices are left out.
fn expected(topology: Topology, runs: &[Vec<u32>], last: bool) -> Vec<(u32, u32, Vec<u32>, u32)> {
    let mut out = Vec::new();
    for instance in [5, 6] {
        let primitives = runs.iter().flat_map(|run| naive(topology, run));
        for (id, (vertices, provoking)) in (0..).zip(primitives) {
            let mut distinct = vertices.clone();
            distinct.sort_unstable();
            distinct.dedup();
            if distinct.len() == vertices.len() {
                let provoking = provoking[usize::from(last)];
                out.push((id, instance, canonical(vertices), provoking));
            }
        }
    }
    out
}

#[gaurast_runner::test]
fn every_topology_makes_the_primitives_of_the_specification() {
    let device = device(1);
    for topology in TOPOLOGIES {
        for count in [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 13, 31] {
            for last in [false, true] {
                let mut draw = draw(&device, topology, &positions(count + 3));
                let mut state = state(topology);
                state.provoking_last = last;
                draw.state = state.into();
                (draw.first, draw.count) = (3, count as u32);
                (draw.first_instance, draw.instance_count) = (5, 2);
                let run_of_all = (3..3 + count as u32).collect();
                let found = primitives(&run(&device, &draw));
                let expected = expected(topology, &[run_of_all], last);
                assert_eq!(found, expected, "{topology:?}, {count} vertices, last {last}");
            }
        }
    }
}

#[gaurast_runner::test]
fn indices_and_restarts_make_the_primitives_of_the_specification() {
    let device = device(1);
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    for topology in TOPOLOGIES {
        for (index_size, restart, own) in
            [(1, 0xFF, None), (2, 0xFFFF, None), (4, u32::MAX, None), (1, 11, Some(11)), (4, 9, Some(9))]
        {
            for restarts in [false, true] {
                let mut draw = draw(&device, topology, &positions(100));
                let mut state = state(topology);
                state.primitive_restart = restarts;
                draw.state = state.into();
                // Small numbers repeat vertices; the offset must be added to them.
                let mut list: Vec<u32> = (0..90).map(|_| rng.random_range(0..90)).collect();
                if restarts {
                    list.iter_mut().for_each(|index| {
                        if rng.random_bool(0.1) {
                            *index = restart;
                        }
                    });
                }
                let buffer = match index_size {
                    1 => buffer(&list.iter().map(|&i| i as u8).collect::<Vec<_>>()),
                    2 => buffer(&list.iter().map(|&i| i as u16).collect::<Vec<_>>()),
                    _ => buffer(&list),
                };
                draw.indices = Some(IndexStream { buffer, index_size, vertex_offset: 7, restart: own });
                (draw.first, draw.count) = (2, 85);
                (draw.first_instance, draw.instance_count) = (5, 2);
                let runs: Vec<Vec<u32>> = list[2..87]
                    .split(|&index| restarts && index == restart)
                    .map(|run| run.iter().map(|index| index + 7).collect())
                    .collect();
                let found = primitives(&run(&device, &draw));
                assert_eq!(found, expected(topology, &runs, false), "{topology:?} {index_size}");
            }
        }
    }
}

#[gaurast_runner::test]
fn draws_of_many_chunks_are_like_one() {
    let device = device(3);
    let positions = positions(5000);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for topology in [TriangleList, TriangleStrip, TriangleFan, LineStrip] {
        // Indices far apart and close together use the two ways to find distinct vertices.
        for spread in [5000, 40] {
            let mut at = 0;
            let list: Vec<u32> = (0..9000)
                .map(|_| {
                    at = (at + rng.random_range(0..spread)) % 5000;
                    at
                })
                .collect();
            let mut draw = draw(&device, topology, &positions);
            draw.indices = Some(indices(&list));
            draw.count = 9000;
            (draw.first_instance, draw.instance_count) = (5, 2);
            let found = primitives(&run(&device, &draw));
            let expected = expected(topology, std::slice::from_ref(&list), false);
            // Some primitives are too small to cover anything. The others must be in order.
            let mut rest = expected.iter();
            for primitive in &found {
                assert!(rest.any(|other| other == primitive), "{topology:?}: {primitive:?}");
            }
            assert!(found.len() * 10 > expected.len() * 9);
        }
    }
}

#[gaurast_runner::test]
fn small_instances_share_chunks() {
    let device = device(2);
    let positions = positions(6);
    let mut draw = draw(&device, TriangleList, &positions);
    draw.indices = Some(indices(&[0, 1, 2, 2, 1, 3, 5, 4, 3]));
    draw.count = 9;
    draw.instance_count = 3000;
    let found = primitives(&run(&device, &draw));
    assert_eq!(found.len(), 9000);
    for (number, (id, instance, vertices, _)) in found.into_iter().enumerate() {
        assert_eq!((id as usize, instance as usize), (number % 3, number / 3));
        let expected = [vec![0, 1, 2], vec![1, 3, 2], vec![3, 5, 4]];
        assert_eq!(vertices, expected[number % 3]);
    }
}
