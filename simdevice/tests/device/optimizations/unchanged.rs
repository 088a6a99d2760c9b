//! Reuse of unchanged sets: a set that is drawn again unchanged is not projected again, and every change is noticed.

use super::drawing::{draw_as_without_skips, programs};
use crate::common::{OVER, attachment, gaussians_in, image, rendering, single};
use simdevice::BufferRange;
use simdevice::format::ClearValue;
use simdevice::packet::{
    AttributeStream, Decoding, DecodingTables, GaussianAppend, GaussianBegin, GaussianFragmentStage, LoadOp,
};
use simdevice::program::bindings::Bindings;
use simdevice::program::fragment::GaussianFragmentProgram;
use simdevice::program::interface::resolve;
use simdevice::program::interface::{FragmentInput, FragmentPrograms, Interpolation, Sampling};
use simdevice::state::gaussian::{GaussianGeometry, GaussianOrder, GaussianState};
use simdevice::stats::counters::Counter;
use simdevice::{Allocation, CommandProcessor, Device, Format, Packet};
use std::sync::Arc;

/// A change of packets before they are drawn again.
pub(super) type Edit = Box<dyn FnMut(&mut [Packet])>;

/// Draws `packets` repeatedly, with a change before each pass but the first. Returns the number of reused sets in each
/// pass. Every picture must equal that of a device without optimizations.
fn reused(packets: &mut [Packet], mut changes: Vec<Edit>) -> Vec<u64> {
    let device = Arc::new(Device::new(&single()).unwrap());
    let mut processor = CommandProcessor::new(device);
    let mut reused = Vec::new();
    for pass in 0..=changes.len() {
        if let Some(change) = pass.checked_sub(1).map(|before| &mut changes[before]) {
            change(packets);
        }
        let counters = draw_as_without_skips(&mut processor, packets);
        reused.push(counters.get(Counter::SetsUnchanged));
        assert!(counters.get(Counter::GaussiansDrawn) > 0, "{pass}");
    }
    reused
}

fn nothing() -> Edit {
    Box::new(|_| {})
}

pub(super) fn of_begin(mut change: impl FnMut(&mut GaussianBegin) + 'static) -> Edit {
    Box::new(move |packets| {
        if let Packet::GaussianBegin(begin) = &mut packets[0] {
            change(begin);
        }
    })
}

pub(super) fn of_append(mut change: impl FnMut(&mut GaussianAppend) + 'static) -> Edit {
    Box::new(move |packets| {
        if let Packet::GaussianAppend(append) = &mut packets[1] {
            change(append);
        }
    })
}

/// A few Gaussians in memory that only the device writes, too few for chunks.
fn few() -> Vec<Packet> {
    gaussians_in(false, 41, 300, OVER)
}

#[gaurast_runner::test]
fn what_has_not_changed_is_drawn_as_it_was() {
    assert_eq!(reused(&mut few(), vec![nothing(), nothing()]), [0, 1, 1]);
    // Chunks are made for the second picture, and give more detail about what can be skipped.
    let mut many = gaussians_in(false, 42, 3000, OVER);
    let changes = vec![nothing(), nothing(), nothing()];
    assert_eq!(reused(&mut many, changes), [0, 0, 1, 1]);
    assert_eq!(reused(&mut placed_in_the_device(), vec![nothing()]), [0, 1]);
}

#[gaurast_runner::test]
fn what_the_host_may_write_is_read_again() {
    let mut packets = gaussians_in(true, 43, 300, OVER);
    assert_eq!(reused(&mut packets, vec![nothing(), nothing()]), [0, 0, 0]);
}

#[gaurast_runner::test]
fn every_change_is_seen() {
    let state = |change: fn(&mut GaussianState)| of_begin(move |begin| change(Arc::make_mut(&mut begin.state)));
    let changes = vec![
        of_begin(|begin| begin.camera.eye[0] += 1e-9),
        of_begin(|begin| begin.viewport.width -= 1.0),
        of_begin(|begin| begin.scissor.width -= 3),
        state(|state| state.alpha_floor = 0.1),
        state(|state| state.low_pass_variance = 0.5),
        state(|state| state.order = GaussianOrder::PerPixel),
        state(|state| state.geometry = GaussianGeometry::Surfel),
        of_append(|append| append.count -= 1),
        of_append(|append| append.first += 1),
        of_append(|append| append.attributes.scale.offset += 4),
        of_append(|append| append.instance_count = 2),
        of_append(|append| {
            let memory = &append.attributes.opacity.buffer.memory;
            memory.write(40, &[0.9f32]).unwrap();
            memory.bump_generation();
        }),
        nothing(),
    ];
    let mut expected = vec![0; changes.len()];
    expected.push(1);
    assert_eq!(reused(&mut few(), changes), expected);
}

/// Bytes in memory that only the device writes, as a stream.
fn stream(bytes: &[u8], stride: u32) -> AttributeStream {
    let size = bytes.len() as u64;
    let memory = Allocation::new(size, false).unwrap();
    memory.write(0, bytes).unwrap();
    let buffer = BufferRange { memory, offset: 0, size };
    AttributeStream { buffer, stride, offset: 0, format: Format::R8Uint, instance_divisor: None }
}

/// Gaussians whose opacities are numbers of values in a codebook.
fn with_codebook(count: u32) -> Vec<Packet> {
    let mut packets = gaussians_in(false, 45, count, OVER);
    let Packet::GaussianAppend(append) = &mut packets[1] else {
        panic!("what follows the beginning of a set");
    };
    let codes: Vec<u8> = (0..count).map(|vertex| (vertex * 37 % 256) as u8).collect();
    let book: Vec<u8> = (0..=255_u8).flat_map(|number| (f32::from(number) / 256.0).to_le_bytes()).collect();
    let attributes = &mut append.attributes;
    attributes.opacity = stream(&codes, 1);
    attributes.activations.decodings.opacity = Decoding::Codebook { is_binary64: false };
    attributes.tables = Some(Box::new(DecodingTables { opacity: Some(stream(&book, 8)), ..DecodingTables::default() }));
    packets
}

/// A change of the codebook of opacities.
fn of_table(mut change: impl FnMut(&mut AttributeStream) + 'static) -> Edit {
    of_append(move |append| {
        let table = append.attributes.tables.as_mut().and_then(|tables| tables.opacity.as_mut());
        change(table.expect("a codebook of opacities"));
    })
}

/// A change of the numbers in the codebook.
fn of_numbers() -> Edit {
    of_table(|table| {
        let memory = &table.buffer.memory;
        memory.write(100, &[0.9f32; 50]).unwrap();
        memory.bump_generation();
    })
}

#[gaurast_runner::test]
fn every_change_of_a_table_is_seen() {
    let chunks = |size| {
        of_append(move |append| {
            append.attributes.activations.decodings.opacity = Decoding::Chunk { size, is_binary64: false };
        })
    };
    let changes = vec![
        nothing(),
        of_numbers(),
        of_table(|table| table.buffer.size -= 512),
        chunks(100),
        chunks(50),
        of_table(|table| table.stride = 16),
        nothing(),
    ];
    assert_eq!(reused(&mut with_codebook(300), changes), [0, 1, 0, 0, 0, 0, 0, 1]);
    // Chunks of Gaussians hold what was decoded.
    let changes = vec![nothing(), nothing(), of_numbers(), nothing(), nothing()];
    assert_eq!(reused(&mut with_codebook(3000), changes), [0, 0, 1, 0, 0, 1]);
}

#[gaurast_runner::test]
fn what_a_program_resolves_is_a_set_of_its_own() {
    let device = Arc::new(Device::new(&single()).unwrap());
    let mut processor = CommandProcessor::new(Arc::clone(&device));
    let input = |number| {
        Some(FragmentInput::Varying {
            index: resolve::ACCUMULATED + number,
            interpolation: Interpolation::Flat,
            sampling: Sampling::Center,
        })
    };
    let program = FragmentPrograms { inputs: (0..4).map(input).collect(), ..programs().fragment.unwrap() };
    let shader = Packet::GaussianFragmentStage(Box::new(GaussianFragmentStage {
        program: Arc::new(GaussianFragmentProgram::new(device.level(), &program).unwrap()),
        bindings: Bindings::default(),
        sample_shading: false,
        alpha_to_coverage: false,
        alpha_to_one: false,
    }));
    let packets = few();
    let target = image(Format::R32G32B32A32Sfloat, 1, 0);
    let clear = LoadOp::Clear(ClearValue::Float([0.0; 4]));
    let begin = Packet::BeginRendering(Box::new(rendering(attachment(&target, clear))));
    let reused = [false, true, true, false, false].map(|is_resolved| {
        let before = processor.counters().clone();
        let shader = is_resolved.then_some(&shader);
        let all = [&begin, &packets[0]].into_iter().chain(shader);
        for packet in all.chain(&packets[1..]).chain([&Packet::EndRendering]) {
            processor.execute(packet).unwrap();
        }
        let counters = processor.counters().since(&before);
        counters.get(Counter::SetsUnchanged)
    });
    // Gaussians behind others may be skipped in one of the pictures and not in the other.
    assert_eq!(reused, [0, 0, 1, 0, 1]);
}

/// Two instances, placed by matrices that only the device writes.
fn placed_in_the_device() -> Vec<Packet> {
    let mut packets = few();
    let rows = [[1.0f32, 0.0, 0.0, 0.5], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.3]];
    let memory = Allocation::new(96, false).unwrap();
    memory.write(0, rows.as_flattened()).unwrap();
    memory.write(48, rows.as_flattened()).unwrap();
    let stream = |row: u32| AttributeStream {
        buffer: BufferRange { memory: memory.clone(), offset: 0, size: 96 },
        stride: 48,
        offset: 16 * row,
        format: Format::R32G32B32A32Sfloat,
        instance_divisor: Some(1),
    };
    if let Packet::GaussianAppend(append) = &mut packets[1] {
        append.instance_count = 2;
        append.attributes.model.matrix = Some(Box::new([stream(0), stream(1), stream(2)]));
    }
    packets
}
