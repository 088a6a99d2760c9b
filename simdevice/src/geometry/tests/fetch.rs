//! Tests of vertex fetch against the formats' own decoder, element by element.

use super::scene::*;
use crate::format::{Channel, Format};
use crate::packet::AttributeStream;
use crate::program::interface::{DrawPrograms, VertexInput, VertexOutput};
use crate::state::Topology;
use devmem::BufferRange;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Programs that draw each vertex as a point in the middle of the screen, with an attribute's components as varyings.
fn pass_through() -> DrawPrograms {
    let mut inputs: Vec<_> = attribute(0).collect();
    inputs.extend(attribute(1));
    let mut outputs: Vec<_> = (0..4).map(|c| Some(VertexOutput::Position(c))).collect();
    outputs.extend((0..4).map(|number| Some(VertexOutput::Varying(number))));
    DrawPrograms {
        vertex: copies(8, &[0, 1, 2, 3, 4, 5, 6, 7].map(|slot| (slot, slot))),
        vertex_inputs: inputs,
        vertex_outputs: outputs,
        varyings: 4,
        captured: None,
        tessellation: None,
        geometry: None,
        fragment: Some(fragment(&[crate::program::interface::Interpolation::Flat; 4])),
    }
}

/// The values that each of `vertices`, in each instance, reads from a stream.
fn naive(stream: &AttributeStream, vertices: &[u32], first_instance: u32, instances: u32) -> Vec<[u32; 4]> {
    let size = stream.format.texel_size() as u64;
    let mut out = Vec::new();
    for instance in 0..instances {
        for &vertex in vertices {
            let element = match stream.instance_divisor {
                None => vertex,
                Some(0) => first_instance,
                Some(divisor) => first_instance + instance / divisor,
            };
            let start = u64::from(element) * u64::from(stream.stride) + u64::from(stream.offset);
            let mut bytes = vec![0u8; size as usize];
            if start + size <= stream.buffer.size {
                let at = stream.buffer.offset + start;
                stream.buffer.memory.read(at, &mut bytes).unwrap();
            }
            out.push(stream.format.decode(&bytes).map(f32::to_bits));
        }
    }
    out
}

fn check(stream: AttributeStream, vertices: &[u32], consecutive: bool) {
    let device = device(1);
    let positions = vec![[0.0, 0.0, 0.5, 1.0]; 1 + vertices.iter().max().copied().unwrap_or(0) as usize];
    let mut draw = draw_with(&device, pass_through(), state(Topology::PointList), &positions);
    draw.attributes[1] = stream.clone();
    if consecutive {
        (draw.first, draw.count) = (vertices[0], vertices.len() as u32);
    } else {
        draw.indices = Some(indices(vertices));
        draw.count = vertices.len() as u32;
    }
    (draw.first_instance, draw.instance_count) = (2, 3);
    let found = run(&device, &draw);
    let expected = naive(&stream, vertices, 2, 3);
    assert_eq!(found.primitives.len(), expected.len());
    for (primitive, expected) in found.primitives.iter().zip(expected) {
        let found = [0, 1, 2, 3].map(|number| varying_bits(&found, primitive.provoking, number));
        // The bits of a NaN may change.
        for (found, expected) in found.into_iter().zip(expected) {
            let both_nan = f32::from_bits(found).is_nan() && f32::from_bits(expected).is_nan();
            assert!(found == expected || both_nan, "{stream:?}: {found:x} {expected:x}");
        }
    }
}

/// A stream over a buffer of random bytes that is shorter than its memory.
fn random_stream(rng: &mut ChaCha8Rng, format: Format, bytes: usize) -> AttributeStream {
    let contents: Vec<u8> = (0..bytes + 64).map(|_| rng.random()).collect();
    let BufferRange { memory, .. } = buffer(&contents);
    AttributeStream {
        buffer: BufferRange { memory, offset: 12, size: bytes as u64 },
        stride: rng.random_range(0..40),
        offset: rng.random_range(0..20),
        format,
        instance_divisor: [None, None, Some(0), Some(1), Some(2)][rng.random_range(0..5)],
    }
}

#[gaurast_runner::test]
fn every_format_is_decoded() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for &format in Format::ALL {
        if format.has(Channel::D) || format.has(Channel::S) {
            continue;
        }
        let stream = random_stream(&mut rng, format, 3000);
        check(stream, &(5..150).collect::<Vec<_>>(), true);
    }
}

#[gaurast_runner::test]
fn what_lies_outside_the_buffer_is_zero() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for format in [Format::R32G32B32Sfloat, Format::R8G8B8A8Unorm, Format::R16G16Sint] {
        for bytes in [0, 1, 50, 500] {
            for _ in 0..4 {
                let stream = random_stream(&mut rng, format, bytes);
                let vertices: Vec<u32> = (0..140).map(|_| rng.random_range(0..200)).collect();
                check(stream.clone(), &vertices, false);
                check(stream, &(9..160).collect::<Vec<_>>(), true);
            }
        }
    }
}

#[gaurast_runner::test]
fn built_in_inputs_are_what_vulkan_says() {
    let device = device(1);
    let mut programs = pass_through();
    for (slot, input) in [
        (4, VertexInput::VertexIndex),
        (5, VertexInput::BaseVertex),
        (6, VertexInput::BaseInstance),
        (7, VertexInput::DrawIndex),
    ] {
        programs.vertex_inputs[slot] = Some(input);
    }
    let mut draw = draw_with(&device, programs, state(Topology::PointList), &[[0.0, 0.0, 0.5, 1.0]; 20]);
    (draw.first, draw.count, draw.first_instance, draw.draw_index) = (3, 4, 11, 6);
    let of = |draw: &crate::packet::Draw| {
        let found = run(&device, draw);
        let vertex = found.primitives[1].provoking;
        [0, 1, 2, 3].map(|number| varying_bits(&found, vertex, number))
    };
    assert_eq!(of(&draw), [4, 3, 11, 6]);
    let mut stream = indices(&[0, 0, 0, 7, 9, 9, 9]);
    stream.vertex_offset = 5;
    draw.indices = Some(stream);
    assert_eq!(of(&draw), [14, 5, 11, 6]);
}
