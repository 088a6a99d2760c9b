//! Set-up and binning of a worker's primitives, piece by piece.

use super::bins::Bins;
use super::capture::{Capture, CapturedPrimitives};
use super::draw::PrimitiveSegment;
use super::order;
use super::primitive::Varyings;
use super::primitive_list::ListedPrimitive;
use super::setup::{Output, SegmentSetup, Setup};
use super::shade::Shaded;
use crate::stats::counters::{Counter, Counters};
use devmem::host;
use std::time::Instant;

/// The primitives that a worker has set up, in pieces of segments.
pub(super) struct Pieces<'a> {
    setup: &'a Setup<'a>,
    /// True if nothing is rasterized.
    pub discards: bool,
    numbers: Vec<u32>,
    output: Output,
    pub counters: Counters,
    capture: Option<Capture<'a>>,
    /// The captured primitives of the pieces.
    pub captured: Vec<(PieceNumber, CapturedPrimitives)>,
    /// The pieces that have primitives.
    pub segments: Vec<(PieceNumber, PrimitiveSegment)>,
}

/// The number of a piece; pieces are drawn in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct PieceNumber {
    /// The number of the segment in the draw.
    pub segment: u64,
    /// The number of the piece in the segment.
    pub piece: u32,
}

impl<'a> Pieces<'a> {
    pub(super) fn new(setup: &'a Setup<'a>, capture: Option<Capture<'a>>) -> Self {
        Self {
            setup,
            discards: setup.state.rasterizer_discard || setup.transforms.is_empty(),
            numbers: Vec::new(),
            output: Output::default(),
            counters: Counters::default(),
            capture,
            captured: Vec::new(),
            segments: Vec::new(),
        }
    }

    /// Begins to set up the primitives of these vertices.
    pub(super) fn begin<'s>(&'s mut self, shaded: &'s Shaded) -> SegmentSetup<'s> {
        self.output.clear();
        SegmentSetup::new(self.setup, shaded, &mut self.numbers, &mut self.output)
    }

    /// Captures listed primitives, and sets up those of the vertex stream that is rasterized.
    pub(super) fn set_up(&mut self, shaded: &Shaded, primitives: &[ListedPrimitive], number: PieceNumber) {
        for (stream, &counter) in (0..).zip(&Counter::PRIMITIVES_OF_STREAMS) {
            let of_stream = primitives.iter().filter(|it| it.stream == stream);
            self.counters.add(counter, of_stream.count() as u64);
        }
        if let Some(capture) = self.capture {
            let captured = capture.take(shaded, primitives);
            host::push(&mut self.captured, (number, captured));
        }
        let stream = self.setup.state.rasterized_stream;
        let rasterized = primitives.iter().filter(|it| it.stream == stream);
        if self.discards {
            let count = rasterized.count() as u64;
            self.counters.add(Counter::ClippingInvocations, count);
            return;
        }
        self.begin(shaded).run_list(rasterized);
        self.keep(number);
    }

    /// Keeps the primitives that were set up last, copied to memory of their size, with lists by macro-tile.
    pub(super) fn keep(&mut self, number: PieceNumber) {
        let (output, setup, counters) = (&self.output, self.setup, &mut self.counters);
        counters.add(Counter::ClippingInvocations, output.assembled);
        counters.add(Counter::ClippingPrimitives, output.clipped);
        counters.add(Counter::PrimitivesDrawn, output.primitives.len() as u64);
        if output.primitives.is_empty() {
            return;
        }
        let started = Instant::now();
        let mut bins = Bins::new(&setup.grid, setup.layers, &output.pairs);
        let per_vertex = setup.outputs.interpolation.len();
        let lines = host::copied(&output.lines);
        // Lines name their primitives by number.
        let few = if lines.is_empty() { order::FEW } else { usize::MAX };
        let (primitives, values) = order::in_order(output, per_vertex, &mut bins, few);
        counters.add(Counter::BinnedPairs, bins.pairs());
        let elapsed = started.elapsed().as_nanos() as u64;
        counters.add(Counter::BinningTime, elapsed);
        let piece = PrimitiveSegment { primitives, varyings: Varyings { values, per_vertex }, bins, lines };
        host::push(&mut self.segments, (number, piece));
    }
}
