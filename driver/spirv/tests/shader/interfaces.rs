//! Tests of the interfaces of translated shaders: inputs, outputs, descriptors, push constants; and of the entry point
//! that spirv-reflect finds.

use std::collections::HashSet;
use std::sync::Arc;

use crate::common::{OPTIONS, folder, translated, words_of};
use fearless_simd::Level;
use gaurast_spirv::{
    BuiltIn, DepthMode, DescriptorKind, Domain, InputPrimitive, InputSource, Interface, Interpolation, Module,
    OutputPrimitive, OutputTarget, PrimitiveModes, Sampling, ScalarType, Spacing, Specialization, Stage, VertexMemory,
    translate,
};
use isa::Options as ExecOptions;
use isa::machine::{Executable, LaneMask, Machine, Watchdog};
use isa::resources::{Resources, words};

const FLOAT: ScalarType = ScalarType::Float { width: 32 };

fn interface(name: &str) -> Interface {
    translated(name, &Specialization::default()).interface
}

fn outputs(interface: &Interface) -> Vec<OutputTarget> {
    interface.outputs.iter().map(|output| output.target).collect()
}

fn location(location: u32, component: u32) -> OutputTarget {
    OutputTarget::Location { location, component, index: 0 }
}

#[gaurast_runner::test]
fn a_vertex_shader_reads_only_what_it_uses() {
    let found = interface("triangle.vert");
    assert_eq!(found.locations_read(), [(0, FLOAT), (1, FLOAT)]);
    assert_eq!(found.push_constants, Some(16..80));
    let position = |component| OutputTarget::BuiltIn { built_in: BuiltIn::Position, component };
    // Of the block of built-ins, only the position is written.
    let mut written = outputs(&found);
    written.sort_by_key(|target| format!("{target:?}"));
    let mut expected: Vec<_> = (0..4).map(position).collect();
    expected.extend((0..3).map(|component| location(0, component)));
    assert_eq!(written, expected);
}

#[gaurast_runner::test]
fn matrices_arrays_and_blocks_take_consecutive_locations() {
    let found = interface("block.vert");
    let read: Vec<u32> = found.locations_read().iter().map(|(location, _)| *location).collect();
    assert_eq!(read, [0, 1, 2, 4]);
    let packed = found
        .inputs
        .iter()
        .any(|input| matches!(input.source, InputSource::Location { location: 4, component: 2, .. }));
    assert!(packed, "component 1 and 2 of location 4");
    let written = outputs(&found);
    for expected in [(2, 0), (2, 2), (3, 0), (4, 0), (5, 0)] {
        assert!(written.contains(&location(expected.0, expected.1)), "{expected:?}");
    }
    let distance = |component| OutputTarget::BuiltIn { built_in: BuiltIn::ClipDistance, component };
    assert!(written.contains(&distance(1)) && !written.contains(&distance(0)));
}

#[gaurast_runner::test]
fn a_fragment_shader_says_how_its_inputs_are_interpolated() {
    let found = interface("textured.frag");
    let of = |at: u32| {
        found
            .inputs
            .iter()
            .find_map(|input| match input.source {
                InputSource::Location { location, interpolation, sampling, .. } if location == at => {
                    Some((interpolation, sampling))
                }
                _ => None,
            })
            .unwrap()
    };
    assert_eq!(of(1), (Interpolation::Perspective, Sampling::Center));
    assert_eq!(of(2), (Interpolation::Flat, Sampling::Center));
    assert_eq!(of(3), (Interpolation::Linear, Sampling::Centroid));
    assert!(found.discards && !found.has_side_effects && !found.early_fragment_tests);
    assert_eq!(found.depth, DepthMode::Replacing);
    assert_eq!(found.descriptors.len(), 1);
    assert_eq!(found.descriptors[0].kind, DescriptorKind::CombinedImageSampler);
    assert_eq!(found.descriptors[0].name.as_deref(), Some("textures"));
    let id = found.outputs.iter().find(|output| output.target == location(1, 0));
    assert_eq!(id.map(|output| output.numeric), Some(ScalarType::Uint { width: 32 }));

    let found = interface("early_and_late.frag");
    assert!(found.early_fragment_tests, "nothing needs a late test");
    let found = interface("early_and_late_depth.frag");
    assert!(!found.early_fragment_tests);
    assert_eq!(found.depth, DepthMode::Greater);

    let found = interface("interpolation.frag");
    assert!(found.early_fragment_tests);
    assert_eq!(found.descriptors[0].attachment, Some(1));
    let samplings: Vec<Sampling> = found
        .inputs
        .iter()
        .filter_map(|input| match input.source {
            InputSource::Location { location: 0, sampling, .. } => Some(sampling),
            _ => None,
        })
        .collect();
    assert!(samplings.contains(&Sampling::Centroid) && samplings.contains(&Sampling::Center));
}

#[gaurast_runner::test]
fn descriptors_have_their_kinds_and_resource_slots() {
    use DescriptorKind::*;
    let found = interface("images.comp");
    let kinds: Vec<(u32, DescriptorKind, bool)> =
        found.descriptors.iter().map(|it| (it.binding, it.kind, it.writable)).collect();
    let expected = [
        (0, StorageImage, false),
        (1, StorageImage, true),
        (2, CombinedImageSampler, false),
        (3, SampledImage, false),
        (4, Sampler, false),
        (5, StorageImage, true),
        (6, UniformTexelBuffer, false),
        (8, CombinedImageSampler, false),
    ];
    assert_eq!(kinds, expected);
    let found = interface("descriptor_arrays.comp");
    let points: Vec<(u32, u32, u32)> = found.descriptors.iter().map(|it| (it.set, it.slot, it.count)).collect();
    assert_eq!(points, [(0, 0, 1), (1, 1, 4)]);
    assert_eq!(found.descriptors[1].size, 4);
}

#[gaurast_runner::test]
fn spirv_reflect_sees_the_same_entry_point() {
    use spirv_reflect::types::ReflectShaderStageFlags as Flags;
    let name = "block.vert";
    let bytes = std::fs::read(folder().join(format!("{name}.spv"))).unwrap();
    let theirs = spirv_reflect::ShaderModule::load_u8_data(&bytes).unwrap();
    let ours = Module::parse(&words_of(name)).unwrap().entry_points();
    assert_eq!(ours.len(), 1);
    assert_eq!(ours[0].0, theirs.get_entry_point_name());
    assert_eq!(theirs.get_shader_stage(), Flags::VERTEX);
}

/// The targets of a memory's scalars with their offsets and strides, in words.
fn places(memory: &VertexMemory) -> Vec<(OutputTarget, u32, Option<u32>)> {
    let words = |bytes| bytes / 4;
    let scalars = memory.scalars.iter();
    scalars.map(|it| (it.target, words(it.offset), it.vertex_stride.map(words))).collect()
}

#[gaurast_runner::test]
fn a_geometry_shader_stores_the_vertices_that_it_emits() {
    let shader = translated("strips.geom", &Specialization::default()).interface;
    let modes = PrimitiveModes {
        input: Some(InputPrimitive::TrianglesAdjacency),
        output: Some(OutputPrimitive::TriangleStrip),
        output_vertices: Some(20),
        invocations: Some(3),
        ..PrimitiveModes::default()
    };
    assert_eq!(shader.modes, modes);
    let exchange = &shader.exchange;
    assert_eq!((exchange.groups, exchange.lanes), (128, 128));
    let inputs = places(&exchange.inputs);
    for (at, component) in [(location(0, 2), 3), (location(1, 1), 2)] {
        let found = inputs.iter().find(|(target, ..)| *target == at);
        assert_eq!(found.expect("an input").2, Some(component));
    }
    // A vertex is a word, the position, sizes and distances of the block, the layer, the colour and two values; what is
    // never written is not named.
    let outputs = places(&exchange.outputs);
    let strides: HashSet<_> = outputs.iter().map(|(_, _, stride)| stride.unwrap()).collect();
    assert_eq!(strides.len(), 1);
    let stride = *strides.iter().next().unwrap();
    assert_eq!(exchange.outputs.stride, 4 * 20 * stride);
    let written: HashSet<_> = outputs.iter().map(|(target, ..)| *target).collect();
    let built_in = |built_in, component| OutputTarget::BuiltIn { built_in, component };
    let expected = (0..4)
        .flat_map(|component| [built_in(BuiltIn::Position, component), location(0, component)])
        .chain([built_in(BuiltIn::Layer, 0), location(2, 0), location(3, 0)]);
    assert_eq!(written, expected.collect());
    let mut offsets: Vec<_> = outputs.iter().map(|(_, offset, _)| *offset).collect();
    offsets.sort_unstable();
    offsets.dedup();
    assert_eq!(offsets.len(), outputs.len());
    assert!(offsets[0] >= 1 && offsets[offsets.len() - 1] < stride);
    assert_eq!(shader.outputs[0].target, OutputTarget::VertexCount);
}

#[gaurast_runner::test]
fn tessellation_shaders_share_vertices_and_patches() {
    let control = translated("patches.tesc", &Specialization::default()).interface;
    assert_eq!(control.modes.output_vertices, Some(5));
    // 25 patches of 5 vertices are the most in 128 lanes.
    assert!(control.exchange.groups <= 25);
    assert_eq!(control.exchange.lanes % 16, 0);
    let evaluation = translated("patches.tese", &Specialization::default()).interface;
    let modes = PrimitiveModes {
        domain: Some(Domain::Quads),
        spacing: Some(Spacing::FractionalEven),
        clockwise: Some(true),
        ..PrimitiveModes::default()
    };
    assert_eq!(evaluation.modes, modes);
    let given = places(&control.exchange.outputs);
    for (target, _, stride) in places(&evaluation.exchange.inputs) {
        let is_given = |&(other, _, given): &_| {
            let given: Option<u32> = given;
            other == target && given.is_some() == stride.is_some()
        };
        assert!(given.iter().any(is_given), "{target:?}");
    }
    let of_patch = given.iter().filter(|(_, _, stride)| stride.is_none());
    // Four and two levels, three values and a matrix.
    assert_eq!(of_patch.count(), 4 + 2 + 3 + 4);
    assert!(control.outputs.is_empty());
}

#[gaurast_runner::test]
fn a_vertex_shader_transforms() {
    let shader = translated("triangle.vert", &Specialization::default());
    let options = ExecOptions { lanes: 16, subgroup_size: 16, ..ExecOptions::new(Level::new()) };
    let executable = Executable::new(shader.program.clone(), &options).unwrap();
    let mut machine = Machine::new(Arc::new(executable));
    for (slot, input) in (0..).zip(&shader.interface.inputs) {
        for lane in 0..16 {
            let value = match input.source {
                InputSource::Location { location, component, .. } => {
                    (10 * location + component + 100 * lane as u32) as f32
                }
                InputSource::BuiltIn { .. } | InputSource::Patch => {
                    machine.set_input(slot, lane, 7);
                    continue;
                }
            };
            machine.set_input(slot, lane, value.to_bits());
        }
    }
    // A matrix whose column c, row r is 4 c + r.
    let mut push = vec![0_u8; 16];
    push.extend((0..16).flat_map(|n| (n as f32).to_le_bytes()));
    let push = words(&push);
    let resources = Resources { push_constants: &push, ..Resources::default() };
    let all = LaneMask::first(16);
    machine.run(&all, &LaneMask::none(), &resources, Watchdog::default()).unwrap();
    for (slot, output) in (0..).zip(&shader.interface.outputs) {
        for lane in 0..16 {
            let x = 100.0 * lane as f32;
            let expected = match output.target {
                OutputTarget::Location { component, .. } => 10.0 + component as f32 + x,
                OutputTarget::VertexCount => panic!("a vertex shader emits no vertices"),
                OutputTarget::BuiltIn { component, .. } => {
                    let column = |c: u32| (4 * c + component) as f32;
                    column(0) * x + column(1) * (x + 1.0) + column(2) * 7.0 + column(3)
                }
            };
            assert_eq!(f32::from_bits(machine.output(slot, lane)), expected, "{output:?}");
        }
    }
}

#[gaurast_runner::test]
fn captured_outputs_have_places_in_buffers() {
    let captured = interface("captured.geom").transform_feedback;
    let captured = captured.expect("something is captured");
    assert_eq!(captured.strides, [32, 20, 16, 16]);
    assert_eq!(captured.streams, [2, 1, 0, 0]);
    let scalars = captured.scalars.iter();
    let found: Vec<_> = scalars.map(|it| (it.buffer, it.offset, it.target)).collect();
    // The members of a block have a location each. A number of 64 bits is two words, at a multiple of 8, as is the
    // structure that it is in.
    let expected = [
        (0, 8, location(8, 0)),
        (0, 16, location(9, 0)),
        (0, 24, location(10, 0)),
        (0, 28, location(10, 1)),
        (1, 4, location(0, 0)),
        (1, 8, location(0, 1)),
        (1, 12, location(1, 0)),
        (1, 16, location(1, 1)),
        (2, 0, location(4, 0)),
        (2, 8, location(2, 0)),
        (3, 0, location(7, 0)),
        (3, 8, location(5, 0)),
    ];
    assert_eq!(found, expected);
    assert_eq!(interface("strips.geom").transform_feedback, None);
}

/// The words of `captured.geom`, in which a member of its block has another offset.
fn captured_with_offset(offset: u32) -> Vec<u32> {
    let mut words = words_of("captured.geom");
    // OpMemberDecorate %Block 0 Offset 8
    let at = words.windows(5).position(|it| it[0] == 5 << 16 | 72 && it[2..] == [0, 35, 8]).expect("the decoration");
    words[at + 4] = offset;
    words
}

#[gaurast_runner::test]
fn captured_outputs_lie_apart_and_inside_their_vertex() {
    for (offset, reason) in [
        (6, "byte 6 of 16"),
        (16, "byte 16 of 16"),
        (u32::MAX - 3, "of 16"),
        (0, "two outputs are captured at one place"),
    ] {
        let module = Module::parse(&captured_with_offset(offset)).expect("a module");
        let translated = translate(&module, "main", Stage::Geometry, &Specialization::default(), &OPTIONS);
        let error = translated.map(|_| ()).expect_err(reason).to_string();
        assert!(error.contains(reason), "{offset}: {error}");
    }
}
