//! The output of shaded fragments: removal of samples, late tests, and writes to the colour attachments.

use super::batch::{Batch, Covered, Turns, lanes_of_chunk, offset};
use super::draw::TriangleTileDraw;
use crate::format::unorm8::Colors;
use crate::program::fragment::Interface;
use crate::raster::color::{OverKernel, blend_bytes_over, blend_words_over, load};
use crate::raster::depth_stencil::Tests;
use crate::raster::output::{Buffers, Sources, covered_by_alpha, lanes_of};
use crate::raster::tile_buffer::QuadAddresses;
use crate::simd::as_floats;
use fearless_simd::{Simd, f32x16, prelude::*, u32x16};
use isa::Vector;
use isa::machine::Machine;

/// Runs the depth and stencil tests of 16 samples, updates the buffers, and returns the lanes that pass.
#[inline(always)]
pub fn test<S: Simd>(
    simd: S,
    tests: &Tests,
    lanes: u16,
    front: bool,
    code: u32x16<S>,
    quads: &QuadAddresses,
    buffers: &mut Buffers,
) -> u16 {
    let mut depths = [0; 16];
    if tests.reads_depth() {
        depths = quads.load(buffers.depth.words_mut());
    }
    let mut stencils = [0; 16];
    if tests.stencil.is_some() {
        let bytes = buffers.stencil.bytes_mut();
        for (first, stencils) in quads.first.iter().zip(stencils.as_chunks_mut::<4>().0) {
            stencils.copy_from_slice(&bytes[*first..][..4]);
        }
    }
    let passed = tests.test(simd, lanes, front, code, &mut depths, &mut stencils);
    if passed != 0 && tests.depth.is_some_and(|(_, write)| write) {
        // Lanes that did not pass are unchanged.
        let stored = if quads.consecutive { u16::MAX } else { passed };
        quads.store(buffers.depth.words_mut(), stored, &depths);
        for tile in quads.tiles(buffers.depth.samples()) {
            buffers.depth.changed(tile);
        }
    }
    if tests.stencil.is_some() {
        let bytes = buffers.stencil.bytes_mut();
        for lane in super::coverage::bits(lanes.into()) {
            bytes[quads.first[lane / 4] + lane % 4] = stencils[lane];
        }
    }
    passed
}

/// Writes a batch's results to the attachments, in order. `killed` are the lanes that the program killed, 64 to a word.
/// Returns the number of samples that passed, if they are counted after shading, and 0 otherwise.
#[inline(always)]
pub fn write<S: Simd>(
    simd: S,
    draw: &TriangleTileDraw<'_>,
    interface: &Interface,
    batch: &Batch,
    machine: &Machine,
    killed: &[u64],
    buffers: &mut Buffers,
) -> u64 {
    if draw.blends_directly() {
        write_directly(simd, draw, interface, batch, machine, killed, buffers);
        return if draw.counts_late { count_living(draw, batch, killed) } else { 0 };
    }
    let late = draw.tests_late();
    let sources: Vec<Sources<'_>> =
        interface.colors.iter().map(|slots| slots.map(|slots| slots.map(|slot| lanes_of(machine, slot)))).collect();
    let mut passed = 0;
    for chunk in 0..batch.chunks() {
        let alive = !lanes_of_chunk(killed, chunk);
        // Quads that cover the same sample are processed one after another, and so are quads that may have different
        // faces in a stencil test.
        let turns = if late && draw.tests.stencil.is_some() { Turns::QUADS } else { batch.turns(chunk, alive) };
        for turn in turns.groups() {
            let mut samples = sample_lanes(batch, chunk, alive & turn);
            remove(simd, draw, interface, machine, chunk, &mut samples);
            for (sample, lanes) in samples.iter_mut().enumerate().take(draw.samples.positions.len()) {
                if *lanes == 0 {
                    continue;
                }
                let quads = batch.places(chunk, sample, draw.samples.positions.len());
                if late {
                    let code = late_depth(simd, draw, interface, batch, machine, chunk, sample);
                    let number = turn.trailing_zeros() as usize / 4;
                    let quad = &batch.chunk_quads(chunk)[number];
                    let front = batch.records[usize::from(quad.record)].front;
                    *lanes = match stencil_references(interface, machine, chunk) {
                        None => test(simd, &draw.tests, *lanes, front, code, &quads, buffers),
                        Some(references) => super::coverage::bits((*lanes).into()).fold(0, |passed, lane| {
                            let tests = draw.tests.with_stencil_reference(references[lane] as u8);
                            passed | test(simd, &tests, 1 << lane, front, code, &quads, buffers)
                        }),
                    };
                }
                passed += u64::from(lanes.count_ones());
                write_colors(simd, draw, &sources, batch, chunk, *lanes, &quads, buffers);
            }
        }
    }
    if draw.counts_late { passed } else { 0 }
}

/// The stencil references that the program writes for the lanes of a chunk, if it does.
fn stencil_references(interface: &Interface, machine: &Machine, chunk: usize) -> Option<[u32; 16]> {
    let slot = interface.stencil_reference?;
    machine.output_vectors(slot).get(chunk).map(|references| references.0)
}

/// The number of covered samples of fragments that the program did not kill.
fn count_living(draw: &TriangleTileDraw<'_>, batch: &Batch, killed: &[u64]) -> u64 {
    if draw.samples.positions.len() == 1 {
        return batch.count_living(killed);
    }
    let of_chunk = |chunk| sample_lanes(batch, chunk, !lanes_of_chunk(killed, chunk));
    let samples = (0..batch.chunks()).flat_map(of_chunk);
    samples.map(|lanes| u64::from(lanes.count_ones())).sum()
}

/// Writes a batch's results as [`write`] does, for draws in which shading removes whole fragments only, and without tests
/// after it.
#[inline(always)]
fn write_directly<S: Simd>(
    simd: S,
    draw: &TriangleTileDraw<'_>,
    interface: &Interface,
    batch: &Batch,
    machine: &Machine,
    killed: &[u64],
    buffers: &mut Buffers,
) {
    let count = draw.samples.positions.len();
    for (index, output) in draw.colors.iter().enumerate() {
        let (Some(output), Some(slots)) = (output, interface.colors.get(index)) else {
            continue;
        };
        let sources = slots.map(|slots| slots.map(|slot| lanes_of(machine, slot)));
        let words = buffers.color[index].words_mut();
        // A loop of its own for each of the kernels, so that vectors stay in registers.
        match output.over_kernel() {
            Some(OverKernel::Words { over }) if count == 1 => {
                write_chunks(simd, &sources[0], batch, killed, |source, lanes, quads| {
                    blend_words_over(simd, over, source, lanes, quads, words);
                });
                continue;
            }
            Some(OverKernel::Unorm8 { over, bgra }) if count == 1 => {
                write_chunks(simd, &sources[0], batch, killed, |source, lanes, quads| {
                    blend_bytes_over(simd, over, bgra, source, lanes, quads, words);
                });
                continue;
            }
            _ => {}
        }
        let dual = output.is_dual_source();
        for chunk in 0..batch.chunks() {
            let alive = !lanes_of_chunk(killed, chunk);
            let living = batch.covered(chunk) & alive;
            if living == 0 {
                continue;
            }
            let source = load(simd, &sources[0], chunk);
            let lanes_of = |sample: usize| {
                if count == 1 { living } else { Covered::of(batch.chunk_quads(chunk)).lanes(sample) & alive }
            };
            if let Some(packed) = output.replacement(simd, &source) {
                // Quads are stored in order, so that the last one with an address remains.
                for sample in 0..count {
                    let quads = batch.places(chunk, sample, count);
                    quads.store(words, lanes_of(sample), &packed);
                }
                continue;
            }
            let mut second = [f32x16::splat(simd, 0.0); 4];
            if dual {
                second = load(simd, &sources[1], chunk);
            }
            for turn in batch.turns(chunk, alive).groups() {
                for sample in 0..count {
                    let lanes = lanes_of(sample) & turn;
                    if lanes != 0 {
                        let quads = batch.places(chunk, sample, count);
                        output.write_shared(simd, &source, &second, lanes, &quads, words);
                    }
                }
            }
        }
    }
}

/// Calls `write` with the sources, lanes and addresses of all living fragments, in order. Pixels have one sample.
#[inline(always)]
fn write_chunks<S: Simd>(
    simd: S,
    source: &[&[Vector]; 4],
    batch: &Batch,
    killed: &[u64],
    mut write: impl FnMut(&Colors<S>, u16, &QuadAddresses),
) {
    for chunk in 0..batch.chunks() {
        let alive = !lanes_of_chunk(killed, chunk);
        let living = batch.covered(chunk) & alive;
        if living == 0 {
            continue;
        }
        let quads = batch.places(chunk, 0, 1);
        let source = load(simd, source, chunk);
        for turn in batch.turns(chunk, alive).groups() {
            if living & turn != 0 {
                write(&source, living & turn, &quads);
            }
        }
    }
}

/// The covered lanes of a chunk, by sample, restricted to the lanes `among`.
#[inline(always)]
fn sample_lanes(batch: &Batch, chunk: usize, among: u16) -> [u16; 4] {
    let covered = Covered::of(batch.chunk_quads(chunk));
    let mut samples = [0; 4];
    for (sample, lanes) in samples.iter_mut().enumerate() {
        *lanes = covered.lanes(sample) & among;
    }
    samples
}

/// Removes the samples that alpha to coverage and the program's sample mask do not cover.
#[inline(always)]
fn remove<S: Simd>(
    simd: S,
    draw: &TriangleTileDraw<'_>,
    interface: &Interface,
    machine: &Machine,
    chunk: usize,
    samples: &mut [u16; 4],
) {
    if let Some(masks) = interface.sample_mask.and_then(|slot| machine.output_vectors(slot).get(chunk)) {
        for (lane, mask) in masks.0.iter().enumerate() {
            for (sample, lanes) in samples.iter_mut().enumerate() {
                if mask >> sample & 1 == 0 {
                    *lanes &= !(1 << lane);
                }
            }
        }
    }
    let coverage_alpha = interface.coverage_alpha.filter(|_| draw.draw.state.alpha_to_coverage);
    if let Some(alpha) = coverage_alpha.and_then(|slot| machine.output_vectors(slot).get(chunk)) {
        let covered = covered_by_alpha(simd, alpha, draw.samples.positions.len());
        for (lanes, covered) in samples.iter_mut().zip(covered) {
            *lanes &= covered;
        }
    }
}

/// The depths of a chunk's samples in the encoding of the attachment.
#[inline(always)]
fn late_depth<S: Simd>(
    simd: S,
    draw: &TriangleTileDraw<'_>,
    interface: &Interface,
    batch: &Batch,
    machine: &Machine,
    chunk: usize,
    sample: usize,
) -> u32x16<S> {
    let written = interface.depth.and_then(|slot| machine.output_vectors(slot).get(chunk));
    let depth = match written {
        Some(depth) => as_floats(simd, depth),
        None => {
            let mut depth = f32x16::from_slice(simd, &batch.depth[16 * chunk..][..16]);
            // In per-sample shading, depths are already those of the samples.
            if draw.samples.positions.len() > 1 && !draw.samples.each_shaded {
                let [x, y] = draw.samples.positions[sample].map(offset);
                let mut offsets = [0.0; 16];
                for (lane, offset) in offsets.iter_mut().enumerate() {
                    let quad = &batch.chunk_quads(chunk)[lane / 4];
                    let [dx, dy] = batch.records[usize::from(quad.record)].depth_slopes;
                    *offset = dx * x + dy * y;
                }
                depth += f32x16::simd_from(simd, offsets);
            }
            depth
        }
    };
    let mut codes = [0; 16];
    for (number, quad) in batch.chunk_quads(chunk).iter().enumerate() {
        let viewport = usize::from(batch.records[usize::from(quad.record)].viewport);
        let range = draw.ranges.get(viewport).copied().unwrap_or((0.0, 1.0));
        let all: [u32; 16] = draw.tests.code.encode(simd, depth, range).into();
        codes[4 * number..4 * number + 4].copy_from_slice(&all[4 * number..4 * number + 4]);
    }
    u32x16::simd_from(simd, codes)
}

/// The share of the pixel of each lane of a chunk that its line covers; 1 for other primitives.
#[cold]
fn line_coverage(draw: &TriangleTileDraw<'_>, batch: &Batch, chunk: usize) -> [f32; 16] {
    let mut coverage = [1.0; 16];
    for (number, quad) in batch.chunk_quads(chunk).iter().enumerate() {
        let line = batch.records.get(usize::from(quad.record)).and_then(|record| record.line);
        let line = line.and_then(|(segment, primitive)| {
            let segment = draw.draw.segments.get(segment)?;
            segment.lines.get(segment.line(primitive)?)
        });
        if let Some(line) = line {
            for lane in 0..4 {
                let pixel = [0, 1].map(|axis| batch.pixel(quad, lane, axis) as i32);
                coverage[4 * number + lane] = line.coverage(pixel);
            }
        }
    }
    coverage
}

/// Writes 16 fragments to one sample of the colour attachments.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "the draw, its batch, and the place and the contents of a chunk of it")]
fn write_colors<S: Simd>(
    simd: S,
    draw: &TriangleTileDraw<'_>,
    sources: &[Sources<'_>],
    batch: &Batch,
    chunk: usize,
    lanes: u16,
    quads: &QuadAddresses,
    buffers: &mut Buffers,
) {
    if lanes == 0 {
        return;
    }
    for (index, output) in draw.colors.iter().enumerate() {
        let (Some(output), Some(sources)) = (output, sources.get(index)) else {
            continue;
        };
        let mut source = load(simd, &sources[0], chunk);
        if index == 0 && draw.smooths_lines() {
            source[3] *= f32x16::simd_from(simd, line_coverage(draw, batch, chunk));
        }
        let mut second =
            if output.is_dual_source() { load(simd, &sources[1], chunk) } else { [f32x16::splat(simd, 0.0); 4] };
        if draw.draw.state.alpha_to_one {
            source[3] = f32x16::splat(simd, 1.0);
            second[3] = f32x16::splat(simd, 1.0);
        }
        let words = buffers.color[index].words_mut();
        output.write_shared(simd, &source, &second, lanes, quads, words);
    }
}
