//! Batches of fragments: 2x2 quads of any primitives of a draw in a macro-tile, and the inputs of the fragment program
//! for them.

use super::setup::Needs;
use super::setup::TriangleSetup;
use crate::geometry::{Primitive, PrimitiveKind, Varyings};
use crate::limits::TILE_SIZE;
use crate::program::fragment::{BATCH_LANES, Interface};
use crate::program::interface::{FragmentInput, Interpolation, Sampling};
use crate::raster::tile_buffer::QuadAddresses;
use crate::simd::{bits_of, both, spread, three};
use fearless_simd::{Simd, f32x16, prelude::*};
use isa::Vector;
use isa::float::FusedMultiply;
use isa::machine::{LaneMask, Machine};

/// The number of lanes of the largest batch.
pub const LANES: usize = BATCH_LANES[1];
/// The number of quads of the largest batch.
pub const QUADS: usize = LANES / 4;

/// A quad to be shaded.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quad {
    /// The index in [`Batch::records`] of its primitive's record.
    pub record: u16,
    /// The index in the macro-tile of its tile.
    pub tile: u8,
    /// The index in the tile of its first pixel.
    pub place: u8,
    /// The covered samples: bit `4 sample + lane`.
    pub cover: u16,
    /// The sample that is shaded, in per-sample shading.
    pub sample: u8,
}

/// The samples of a draw's pixels.
#[derive(Clone, Copy, Debug)]
pub struct Samples {
    /// The positions in 1/256 pixels.
    pub positions: &'static [[i32; 2]],
    /// True for per-sample shading: each sample is shaded with its own values.
    pub each_shaded: bool,
}

/// The data of a primitive that its quads need.
#[derive(Clone, Debug)]
pub struct Record {
    /// The primitive's number within the instance.
    id: u32,
    layer: u16,
    pub front: bool,
    pub viewport: u8,
    is_point: bool,
    /// The number of the segment of a line that is no plain rectangle, and of its primitive.
    pub line: Option<(usize, u32)>,
    /// The values of 1 / w at corners 1 and 2; see [`TriangleSetup::weights`].
    weights: [f32; 2],
    /// The unit of [`BlockValues::inverse_w`].
    scale: f32,
    /// The derivatives of the barycentrics by x and y in pixels.
    slopes: [[f32; 2]; 2],
    /// The derivatives of [`BlockValues::inverse_w`].
    w_slopes: [f32; 2],
    /// The derivatives of depth.
    pub depth_slopes: [f32; 2],
}

/// The lanes of a chunk in groups that are written one after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Turns {
    /// The groups, and then zeros.
    lanes: [u16; 4],
}

impl Turns {
    /// Each quad for itself.
    pub const QUADS: Self = Self { lanes: [0xF, 0xF0, 0xF00, 0xF000] };

    /// The groups.
    #[inline(always)]
    pub fn groups(&self) -> impl Iterator<Item = u16> + '_ {
        self.lanes.iter().copied().take_while(|&lanes| lanes != 0)
    }
}

/// Fragments that are shaded together.
#[derive(Debug)]
pub struct Batch {
    /// The values that are stored for each quad.
    needs: Needs,
    /// The framebuffer coordinates of the macro-tile's first pixel.
    corner: [u32; 2],
    /// The macro-tile's side in tiles.
    side: u32,
    /// True if 1 / w is constant in each primitive, so that barycentrics need no perspective correction.
    affine: bool,
    pub quads: [Quad; QUADS],
    /// The sample masks that fragments of several samples read, for each quad: as [`Quad::cover`], before or after early
    /// tests.
    pub read_masks: [u16; QUADS],
    pub count: usize,
    /// A bit for each lane: 1 if it has a covered sample.
    covered: [u64; LANES / 64],
    /// A bit for each tile: 1 if the batch has quads of it.
    tiles: u64,
    pub records: Vec<Record>,
    /// The varyings of each record: see [`add_attributes`].
    attributes: Vec<[f32; 3]>,
    /// The linear barycentrics of corners 1 and 2, lane by lane.
    barycentrics: [[f32; LANES]; 2],
    /// The perspective-correct barycentrics.
    perspective: [[f32; LANES]; 2],
    pub depth: [f32; LANES],
    inverse_w: [f32; LANES],
    /// The record of all quads of each chunk of 16 lanes, if they have the same.
    common: [Option<u16>; LANES / 16],
    pub active: LaneMask,
    pub helpers: LaneMask,
}

impl Default for Batch {
    fn default() -> Self {
        Self {
            needs: Needs::default(),
            corner: [0; 2],
            side: 1,
            affine: true,
            quads: [Quad::default(); QUADS],
            read_masks: [0; QUADS],
            count: 0,
            covered: [0; LANES / 64],
            tiles: 0,
            records: Vec::new(),
            attributes: Vec::new(),
            barycentrics: [[0.0; LANES]; 2],
            perspective: [[0.0; LANES]; 2],
            depth: [0.0; LANES],
            inverse_w: [0.0; LANES],
            common: [None; LANES / 16],
            active: LaneMask::none(),
            helpers: LaneMask::none(),
        }
    }
}

/// The interpolated values at the pixel centres of a block.
#[derive(Clone, Copy)]
pub struct BlockValues<S: Simd> {
    pub barycentrics: [f32x16<S>; 2],
    pub depth: f32x16<S>,
    /// The value of 1 / w. If it is constant in the primitive, it is 1 here, and the unit is in the set-up.
    pub inverse_w: f32x16<S>,
}

impl<S: Simd> BlockValues<S> {
    /// The values of the block at pixel (x, y) that are needed.
    #[inline(always)]
    pub fn new(simd: S, setup: &TriangleSetup, [x, y]: [i32; 2], needs: Needs) -> Self {
        let bases = setup.barycentrics(x, y);
        let mut values = Self::of_depth(simd, setup, bases, needs.depth);
        values.find_rest(simd, setup, bases, needs);
        values
    }

    /// The depth alone, if it is needed, for early tests. `bases` are the barycentrics of the block's first pixel.
    #[inline(always)]
    pub fn of_depth(simd: S, setup: &TriangleSetup, bases: [f64; 2], is_needed: bool) -> Self {
        Self {
            barycentrics: [f32x16::splat(simd, 0.0); 2],
            depth: if is_needed {
                f32x16::simd_from(simd, setup.lane_depth) + setup.depth(bases)
            } else {
                f32x16::splat(simd, 0.0)
            },
            inverse_w: f32x16::splat(simd, 1.0),
        }
    }

    /// Adds the other values that are needed.
    #[inline(always)]
    pub fn find_rest(&mut self, simd: S, setup: &TriangleSetup, bases: [f64; 2], needs: Needs) {
        let add = |base: f32, lanes: [f32; 16]| f32x16::simd_from(simd, lanes) + base;
        if needs.barycentrics {
            self.barycentrics =
                [add(bases[0] as f32, setup.lane_barycentrics[0]), add(bases[1] as f32, setup.lane_barycentrics[1])];
        }
        if needs.inverse_w && !setup.affine {
            self.inverse_w = add(setup.inverse_w(bases), setup.lane_w);
        }
    }

    /// The values as arrays of lanes, in the order of the fields.
    #[inline(always)]
    pub fn lanes(self) -> [[f32; 16]; 4] {
        let [b1, b2] = self.barycentrics;
        [b1.into(), b2.into(), self.depth.into(), self.inverse_w.into()]
    }
}

impl Batch {
    /// Empties the batch for a draw whose fragments have these needs, in the macro-tile at column and row `at`, of
    /// `size` x `size` pixels.
    pub fn begin(&mut self, needs: Needs, at: [u32; 2], size: u32) {
        self.needs = needs;
        self.corner = at.map(|at| at * size);
        self.side = size / TILE_SIZE;
        self.clear();
    }

    /// Removes all quads and records.
    pub fn clear(&mut self) {
        self.affine = true;
        (self.count, self.tiles) = (0, 0);
        self.records.clear();
        self.attributes.clear();
    }

    /// Adds the record of a primitive whose quads may follow, and returns its index.
    pub fn add_primitive(
        &mut self,
        primitive: &Primitive,
        setup: &TriangleSetup,
        interface: &Interface,
        varyings: &Varyings,
    ) -> u16 {
        self.affine &= setup.affine;
        self.records.push(Record {
            id: primitive.id,
            layer: primitive.layer,
            front: primitive.front,
            viewport: primitive.viewport,
            is_point: primitive.kind == PrimitiveKind::Point,
            line: None,
            weights: setup.weights,
            scale: setup.scale,
            slopes: setup.slopes,
            w_slopes: setup.w_slopes,
            depth_slopes: setup.depth_slopes,
        });
        add_attributes(primitive, interface, varyings, &mut self.attributes);
        (self.records.len() - 1) as u16
    }

    /// Adds a quad with its values, which are those of quad `number` of a block.
    #[inline(always)]
    pub fn add(&mut self, quad: Quad, number: usize, values: &[[f32; 16]; 4]) {
        let at = 4 * self.count;
        let lanes = 4 * number..4 * number + 4;
        if self.needs.barycentrics {
            self.barycentrics[0][at..at + 4].copy_from_slice(&values[0][lanes.clone()]);
            self.barycentrics[1][at..at + 4].copy_from_slice(&values[1][lanes.clone()]);
        }
        if self.needs.depth {
            self.depth[at..at + 4].copy_from_slice(&values[2][lanes.clone()]);
        }
        if self.needs.inverse_w {
            self.inverse_w[at..at + 4].copy_from_slice(&values[3][lanes]);
        }
        self.tiles |= 1 << quad.tile;
        self.quads[self.count] = quad;
        self.count += 1;
    }

    /// Adds those quads of a block that have lanes of `lanes`, in a draw with one sample per pixel. The batch must have
    /// space for all four. `quad` is the block's first quad. Returns the number of quads that are left out.
    #[inline(always)]
    pub fn add_part<S: Simd>(&mut self, quad: Quad, lanes: u16, values: &BlockValues<S>) -> usize {
        let (first, mut count) = (self.count, self.count);
        let mut places = [0; 4];
        for (number, place) in places.iter_mut().enumerate() {
            let cover = lanes >> (4 * number) & 15;
            *place = count % QUADS;
            // The next quad is stored over one without lanes.
            self.quads[*place] = Quad { place: quad.place + 4 * number as u8, cover, ..quad };
            count += usize::from(cover != 0);
        }
        self.count = count;
        self.tiles |= 1 << quad.tile;
        if self.needs.barycentrics {
            scatter(values.barycentrics[0], &mut self.barycentrics[0], places);
            scatter(values.barycentrics[1], &mut self.barycentrics[1], places);
        }
        if self.needs.depth {
            scatter(values.depth, &mut self.depth, places);
        }
        if self.needs.inverse_w {
            scatter(values.inverse_w, &mut self.inverse_w, places);
        }
        4 - (count - first)
    }

    /// Adds all four quads of a block. The batch must have space for them.
    #[inline(always)]
    pub fn add_block<S: Simd>(&mut self, quads: [Quad; 4], values: &BlockValues<S>) {
        let at = 4 * self.count;
        if self.needs.barycentrics {
            values.barycentrics[0].store_slice(&mut self.barycentrics[0][at..at + 16]);
            values.barycentrics[1].store_slice(&mut self.barycentrics[1][at..at + 16]);
        }
        if self.needs.depth {
            values.depth.store_slice(&mut self.depth[at..at + 16]);
        }
        if self.needs.inverse_w {
            values.inverse_w.store_slice(&mut self.inverse_w[at..at + 16]);
        }
        self.tiles |= 1 << quads[0].tile;
        self.quads[self.count..self.count + 4].copy_from_slice(&quads);
        self.count += 4;
    }

    /// True if it has quads of a tile.
    pub fn has_tile(&self, tile: usize) -> bool {
        self.tiles >> tile & 1 == 1
    }

    /// The number of chunks of 16 lanes that have quads.
    pub fn chunks(&self) -> usize {
        self.count.div_ceil(4)
    }

    /// The quads of a chunk.
    #[inline(always)]
    pub fn chunk_quads(&self, chunk: usize) -> &[Quad; 4] {
        let (chunks, _) = self.quads.as_chunks();
        &chunks[chunk]
    }

    /// The addresses of a chunk's quads in a tile buffer of `samples` samples per pixel.
    #[inline(always)]
    pub fn places(&self, chunk: usize, sample: usize, samples: usize) -> QuadAddresses {
        let mut first = [0; 4];
        for (first, quad) in first.iter_mut().zip(self.chunk_quads(chunk)) {
            let tile = usize::from(quad.tile) * samples + sample;
            *first = tile * crate::raster::tile::AREA + usize::from(quad.place);
        }
        let [a, b, c, d] = first;
        QuadAddresses {
            first,
            consecutive: b == a + 4 && c == a + 8 && d == a + 12,
            // A primitive has each quad once. Quads that pad a chunk have the address of the last one.
            distinct: samples == 1 && self.common[chunk].is_some() && 4 * chunk + 4 <= self.count,
        }
    }

    /// The lanes of a chunk of the prepared batch that have a covered sample.
    #[inline(always)]
    pub fn covered(&self, chunk: usize) -> u16 {
        lanes_of_chunk(&self.covered, chunk)
    }

    /// The number of covered lanes that are not in the set `killed`, whose words have 64 lanes each.
    pub fn count_living(&self, killed: &[u64]) -> u64 {
        let killed = killed.iter().copied().chain(std::iter::repeat(0));
        self.covered.iter().zip(killed).map(|(covered, killed)| u64::from((covered & !killed).count_ones())).sum()
    }

    /// The lanes of a chunk in groups of consecutive quads. Within a group no two quads cover the same sample with lanes
    /// of `alive`, so that their order does not matter.
    #[inline(always)]
    pub fn turns(&self, chunk: usize, alive: u16) -> Turns {
        // A primitive covers each sample at most once.
        if self.common[chunk].is_some() { Turns { lanes: [u16::MAX, 0, 0, 0] } } else { self.separate(chunk, alive) }
    }

    fn separate(&self, chunk: usize, alive: u16) -> Turns {
        let quads = self.chunk_quads(chunk);
        let mut covers = [0; 4];
        for (index, (cover, quad)) in covers.iter_mut().zip(quads).enumerate() {
            *cover = quad.cover & ((alive >> (4 * index) & 15) * 0x1111);
        }
        let mut turns = Turns { lanes: [0; 4] };
        let (mut turn, mut first) = (0, 0);
        for index in 0..4 {
            let overlaps = |other: usize| {
                let [a, b] = [&quads[other], &quads[index]];
                (a.tile, a.place) == (b.tile, b.place) && covers[other] & covers[index] != 0
            };
            if (first..index).any(overlaps) {
                (turn, first) = (turn + 1, index);
            }
            turns.lanes[turn] |= 15 << (4 * index);
        }
        turns
    }

    /// Pads the last chunk, and determines the covered lanes, the active ones, and the helper lanes for derivatives.
    pub fn prepare(&mut self) {
        let last = self.quads[self.count - 1];
        for quad in &mut self.quads[self.count..4 * self.count.div_ceil(4)] {
            *quad = Quad { cover: 0, ..last };
        }
        self.covered = [0; LANES / 64];
        let chunks = self.quads.as_chunks().0.iter().zip(&mut self.common).take(self.count.div_ceil(4));
        for (chunk, (quads, common)) in chunks.enumerate() {
            let [a, b, c, d]: &[Quad; 4] = quads;
            let same = a.record == b.record && a.record == c.record && a.record == d.record;
            *common = same.then_some(a.record);
            self.covered[chunk / 4] |= u64::from(Covered::of(quads).any()) << (16 * (chunk % 4));
        }
        self.active = LaneMask::first(4 * self.count);
        let mut helpers = [0; LANES / 64];
        for ((helpers, active), covered) in helpers.iter_mut().zip(self.active.words()).zip(&self.covered) {
            *helpers = active & !covered;
        }
        self.helpers = LaneMask::of_words(&helpers);
    }
}

/// The lanes of a chunk in a set whose words have 64 lanes each. Words beyond the end are 0.
#[inline(always)]
pub fn lanes_of_chunk(words: &[u64], chunk: usize) -> u16 {
    (words.get(chunk / 4).copied().unwrap_or(0) >> (16 * (chunk % 4))) as u16
}

/// The coverage of a chunk's quads: [`Quad::cover`] of each, from the lowest bits on.
pub struct Covered(u64);

impl Covered {
    /// The coverage of four quads.
    #[inline(always)]
    pub fn of([a, b, c, d]: &[Quad; 4]) -> Self {
        let at = |cover: u16, number: u32| u64::from(cover) << (16 * number);
        Self(at(a.cover, 0) | at(b.cover, 1) | at(c.cover, 2) | at(d.cover, 3))
    }

    /// The lanes for which a sample is covered.
    #[inline(always)]
    pub fn lanes(&self, sample: usize) -> u16 {
        let nibbles = self.0 >> (4 * sample) & 0x000F_000F_000F_000F;
        (nibbles | nibbles >> 12 | nibbles >> 24 | nibbles >> 36) as u16
    }

    /// The lanes for which any sample is covered.
    #[inline(always)]
    fn any(&self) -> u16 {
        let pairs = self.0 | self.0 >> 4;
        Self(pairs | pairs >> 8).lanes(0)
    }
}

/// Stores the values of a block's quads, each at the lanes of its place in a batch.
#[inline(always)]
fn scatter<S: Simd>(values: f32x16<S>, to: &mut [f32; LANES], places: [usize; 4]) {
    let values: [f32; 16] = values.into();
    let (quads, to) = (values.as_chunks::<4>().0, to.as_chunks_mut::<4>().0);
    for (quad, place) in quads.iter().zip(places) {
        to[place % QUADS] = *quad;
    }
}

/// Appends a primitive's varyings in the order of the interface. Each is its value at corner 0 and its differences to
/// the values at corners 1 and 2. For a flat varying the differences are zero.
#[inline(always)]
pub fn add_attributes(
    primitive: &Primitive,
    interface: &Interface,
    varyings: &Varyings,
    attributes: &mut Vec<[f32; 3]>,
) {
    let of_vertex = |vertex: u32| {
        let at = vertex as usize * varyings.per_vertex;
        varyings.values.get(at..at + varyings.per_vertex)
    };
    let [a, b, c] = three(primitive.vertices, |v| of_vertex(v).unwrap_or_default());
    let provoking = of_vertex(primitive.provoking).unwrap_or_default();
    let value = |vertex: &[u32], varying: u32| f32::from_bits(vertex.get(varying as usize).copied().unwrap_or(0));
    attributes.extend(interface.varyings.iter().map(|&(varying, interpolation)| match interpolation {
        Interpolation::Flat => [value(provoking, varying), 0.0, 0.0],
        _ => {
            let first = value(a, varying);
            [first, value(b, varying) - first, value(c, varying) - first]
        }
    }));
}

/// The offset of a sample from the pixel's centre along an axis, in pixels.
#[inline(always)]
pub fn offset(position: i32) -> f32 {
    (position - 128) as f32 / 256.0
}

/// The values of a block at a sample position, derived from those at the centres.
#[inline(always)]
pub fn at_sample<S: Simd>(values: &BlockValues<S>, setup: &TriangleSetup, position: [i32; 2]) -> BlockValues<S> {
    let [x, y] = both(position, offset);
    let move_by = |value: f32x16<S>, [dx, dy]: [f32; 2]| value + (dx * x + dy * y);
    BlockValues {
        barycentrics: [
            move_by(values.barycentrics[0], setup.slopes[0]),
            move_by(values.barycentrics[1], setup.slopes[1]),
        ],
        depth: move_by(values.depth, setup.depth_slopes),
        inverse_w: move_by(values.inverse_w, setup.w_slopes),
    }
}

impl Batch {
    /// A value of each lane's primitive, as a vector.
    #[inline(always)]
    fn of_records<S: Simd>(&self, simd: S, chunk: usize, value: impl Fn(&Record) -> f32) -> f32x16<S> {
        if let Some(record) = self.common[chunk] {
            return f32x16::splat(simd, value(&self.records[usize::from(record)]));
        }
        let mut values = [0.0; 4];
        for (quad, out) in self.chunk_quads(chunk).iter().zip(&mut values) {
            *out = value(&self.records[usize::from(quad.record)]);
        }
        spread(simd, values)
    }

    /// A varying's value at corner 0 and differences to the other corners, of each lane's primitive.
    #[inline(always)]
    fn attribute<S: Simd>(&self, simd: S, chunk: usize, varying: usize, per_record: usize) -> [f32x16<S>; 3] {
        if let Some(record) = self.common[chunk] {
            let [a, b, c] = self.attributes[usize::from(record) * per_record + varying];
            return [f32x16::splat(simd, a), f32x16::splat(simd, b), f32x16::splat(simd, c)];
        }
        let mut of_quads = [[0.0; 4]; 3];
        for (number, quad) in self.chunk_quads(chunk).iter().enumerate() {
            let [a, b, c] = self.attributes[usize::from(quad.record) * per_record + varying];
            of_quads[0][number] = a;
            of_quads[1][number] = b;
            of_quads[2][number] = c;
        }
        [spread(simd, of_quads[0]), spread(simd, of_quads[1]), spread(simd, of_quads[2])]
    }

    /// Sets a program's inputs. Returns true if perspective-correct varyings needed no division.
    #[inline(always)]
    pub fn set_inputs<S: Simd>(
        &mut self,
        simd: S,
        interface: &Interface,
        samples: Samples,
        machine: &mut Machine,
    ) -> bool {
        let perspective =
            interface.varyings.iter().any(|(_, interpolation)| *interpolation == Interpolation::Perspective);
        let divides = perspective && !self.affine;
        if divides {
            self.divide(simd);
        }
        let at_centers = samples.positions.len() == 1 || samples.each_shaded;
        for &(slot, kind, place) in &interface.inputs {
            let lanes = machine.input_mut(slot);
            let count = self.chunks().min(lanes.len());
            let lanes = &mut lanes[..count];
            match kind {
                FragmentInput::Varying { interpolation, sampling, .. }
                    if interpolation != Interpolation::Flat && (at_centers || sampling != Sampling::Centroid) =>
                {
                    let barycentrics = match interpolation {
                        Interpolation::Perspective if divides => &self.perspective,
                        _ => &self.barycentrics,
                    };
                    self.interpolate(simd, place, interface.varyings.len(), barycentrics, lanes);
                }
                FragmentInput::Varying { interpolation: Interpolation::Flat, .. } => {
                    self.copy_flat(simd, place, interface.varyings.len(), lanes);
                }
                _ => {
                    for (chunk, lanes) in lanes.iter_mut().enumerate() {
                        *lanes = Vector(self.input(simd, kind, place, chunk, interface, samples));
                    }
                }
            }
        }
        perspective && !divides
    }

    /// The records of the quads of each chunk: of all four, if they have the same, and each.
    #[inline(always)]
    fn records_of_chunks(&self) -> impl Iterator<Item = (Option<u16>, [u16; 4])> + '_ {
        let quads = self.quads.as_chunks::<4>().0;
        self.common.iter().zip(quads).map(|(common, [a, b, c, d])| (*common, [a.record, b.record, c.record, d.record]))
    }

    /// Interpolates a varying for all chunks of `out`.
    #[inline(always)]
    fn interpolate<S: Simd>(
        &self,
        simd: S,
        place: usize,
        per_record: usize,
        [b1, b2]: &[[f32; LANES]; 2],
        out: &mut [Vector],
    ) {
        let attributes = &self.attributes[..];
        let of_record = |record: u16| attributes[usize::from(record) * per_record + place];
        let (b1, b2) = (b1.as_chunks::<16>().0, b2.as_chunks::<16>().0);
        for (((out, b1), b2), (common, each)) in out.iter_mut().zip(b1).zip(b2).zip(self.records_of_chunks()) {
            let splat = |value: f32| f32x16::splat(simd, value);
            let attribute = match common {
                Some(record) => three(of_record(record), splat),
                None => {
                    let [a, b, c, d] = each;
                    let [a, b, c, d] = [of_record(a), of_record(b), of_record(c), of_record(d)];
                    three([0, 1, 2], |value: usize| spread(simd, [a[value], b[value], c[value], d[value]]))
                }
            };
            let b1 = f32x16::simd_from(simd, *b1);
            let b2 = f32x16::simd_from(simd, *b2);
            *out = Vector(bits_of(varying(attribute, [b1, b2])).into());
        }
    }

    /// Copies a flat varying for all chunks of `out`.
    #[inline(always)]
    fn copy_flat<S: Simd>(&self, simd: S, place: usize, per_record: usize, out: &mut [Vector]) {
        let attributes = &self.attributes[..];
        let value = |record: u16| attributes[usize::from(record) * per_record + place][0];
        for (out, (common, each)) in out.iter_mut().zip(self.records_of_chunks()) {
            let lanes = match common {
                Some(record) => f32x16::splat(simd, value(record)),
                None => {
                    let [a, b, c, d] = each;
                    spread(simd, [value(a), value(b), value(c), value(d)])
                }
            };
            *out = Vector(bits_of(lanes).into());
        }
    }

    /// Computes perspective-correct barycentrics.
    #[inline(always)]
    fn divide<S: Simd>(&mut self, simd: S) {
        for chunk in 0..self.chunks() {
            let [p1, p2] = self.perspective_at(simd, chunk, self.linear_at(simd, chunk));
            p1.store_slice(&mut self.perspective[0][16 * chunk..][..16]);
            p2.store_slice(&mut self.perspective[1][16 * chunk..][..16]);
        }
    }

    #[inline(always)]
    fn linear_at<S: Simd>(&self, simd: S, chunk: usize) -> [f32x16<S>; 3] {
        [
            f32x16::from_slice(simd, &self.barycentrics[0][16 * chunk..][..16]),
            f32x16::from_slice(simd, &self.barycentrics[1][16 * chunk..][..16]),
            f32x16::from_slice(simd, &self.inverse_w[16 * chunk..][..16]),
        ]
    }

    #[inline(always)]
    fn perspective_at<S: Simd>(&self, simd: S, chunk: usize, [b1, b2, inverse_w]: [f32x16<S>; 3]) -> [f32x16<S>; 2] {
        let w1 = self.of_records(simd, chunk, |record| record.weights[0]);
        let w2 = self.of_records(simd, chunk, |record| record.weights[1]);
        perspective_correct(simd, [b1, b2], inverse_w, [w1, w2])
    }

    /// The barycentrics and 1 / w of each lane at a covered sample, or at the centre if all samples are covered.
    #[inline(always)]
    fn centroid_at<S: Simd>(&self, simd: S, chunk: usize, positions: &[[i32; 2]]) -> [f32x16<S>; 3] {
        let (mut x, mut y) = ([0.0; 16], [0.0; 16]);
        for lane in 0..16 {
            let cover = self.chunk_quads(chunk)[lane / 4].cover >> (lane % 4) & 0x1111;
            if cover != 0 && cover != 0x1111 {
                let [at_x, at_y] = positions[cover.trailing_zeros() as usize / 4];
                (x[lane], y[lane]) = (offset(at_x), offset(at_y));
            }
        }
        let (x, y) = (f32x16::simd_from(simd, x), f32x16::simd_from(simd, y));
        let [b1, b2, inverse_w] = self.linear_at(simd, chunk);
        let slope = |corner: usize, axis: usize| self.of_records(simd, chunk, |record| record.slopes[corner][axis]);
        [
            b1 + slope(0, 0) * x + slope(0, 1) * y,
            b2 + slope(1, 0) * x + slope(1, 1) * y,
            inverse_w
                + self.of_records(simd, chunk, |record| record.w_slopes[0]) * x
                + self.of_records(simd, chunk, |record| record.w_slopes[1]) * y,
        ]
    }

    /// The bits of an input for the 16 lanes of a chunk.
    #[inline(always)]
    fn input<S: Simd>(
        &self,
        simd: S,
        kind: FragmentInput,
        place: usize,
        chunk: usize,
        interface: &Interface,
        samples: Samples,
    ) -> [u32; 16] {
        match kind {
            FragmentInput::Varying { interpolation, .. } => {
                let attribute = self.attribute(simd, chunk, place, interface.varyings.len());
                // At the centres, [`Batch::interpolate`] is used, and [`Batch::copy_flat`] for flat ones.
                let linear = self.centroid_at(simd, chunk, samples.positions);
                let barycentrics = match interpolation {
                    Interpolation::Flat => return bits_of(attribute[0]).into(),
                    Interpolation::Linear => [linear[0], linear[1]],
                    Interpolation::Perspective => self.perspective_at(simd, chunk, linear),
                };
                bits_of(varying(attribute, barycentrics)).into()
            }
            FragmentInput::FragCoord(2) => {
                let depth = f32x16::from_slice(simd, &self.depth[16 * chunk..][..16]);
                bits_of(depth).into()
            }
            FragmentInput::FragCoord(3) => {
                let [.., inverse_w] = self.linear_at(simd, chunk);
                let scale = self.of_records(simd, chunk, |record| record.scale);
                bits_of(inverse_w * scale).into()
            }
            FragmentInput::PointCoord(axis) => {
                let [b1, b2, _] = self.linear_at(simd, chunk);
                let value = if axis == 0 { b1 + b2 } else { b2 };
                // Primitives other than points have no point coordinate.
                let is_point = self.of_records(simd, chunk, |record| f32::from(record.is_point));
                bits_of(value * is_point).into()
            }
            _ => self.scalar_input(kind, chunk, samples),
        }
    }

    /// The column or row of a lane of a quad in the framebuffer.
    pub fn pixel(&self, quad: &Quad, lane: usize, axis: usize) -> u32 {
        let tile = u32::from(quad.tile);
        let tile = [tile % self.side, tile / self.side][axis];
        // See `tile::place`.
        let bits = (u32::from(quad.place) | lane as u32) >> axis;
        let within = bits & 1 | bits >> 1 & 2 | bits >> (2 + axis) & 12;
        self.corner[axis] + tile * TILE_SIZE + within
    }

    /// The bits of an input that follows from the quad alone, for the 16 lanes of a chunk.
    fn scalar_input(&self, kind: FragmentInput, chunk: usize, samples: Samples) -> [u32; 16] {
        let quads = self.chunk_quads(chunk);
        let mut lanes = [0; 16];
        for (number, lane) in lanes.iter_mut().enumerate() {
            let quad = &quads[number / 4];
            let record = &self.records[usize::from(quad.record)];
            let sample = usize::from(quad.sample);
            // In per-sample shading, fragments are at their sample.
            let within =
                if samples.each_shaded { samples.positions[sample].map(|at| at as f32 / 256.0) } else { [0.5; 2] };
            *lane = match kind {
                FragmentInput::FragCoord(axis) => {
                    let axis = axis.min(1);
                    let pixel = self.pixel(quad, number % 4, axis);
                    (pixel as f32 + within[axis]).to_bits()
                }
                FragmentInput::FrontFacing => {
                    if record.front {
                        u32::MAX
                    } else {
                        0
                    }
                }
                FragmentInput::PrimitiveId => record.id,
                FragmentInput::SampleId => sample as u32,
                FragmentInput::SamplePosition(axis) => within[axis.min(1)].to_bits(),
                FragmentInput::SampleMask => {
                    let read = self.read_masks[4 * chunk + number / 4];
                    let cover = if samples.positions.len() == 1 { quad.cover } else { read } >> (number % 4);
                    (0..4).map(|s| u32::from(cover >> (4 * s) & 1) << s).sum()
                }
                FragmentInput::Layer => record.layer.into(),
                FragmentInput::ViewportIndex => record.viewport.into(),
                FragmentInput::Varying { .. } | FragmentInput::PointCoord(_) => 0,
            };
        }
        lanes
    }
}

/// A varying at these barycentrics, given its value at corner 0 and its differences to the values at corners 1 and 2.
#[inline(always)]
pub fn varying<S: Simd>([a, da, db]: [f32x16<S>; 3], [b1, b2]: [f32x16<S>; 2]) -> f32x16<S> {
    db.fused_add(b2, da.fused_add(b1, a))
}

/// Perspective-correct barycentrics, from the linear ones, 1 / w at the same place, and 1 / w at corners 1 and 2.
#[inline(always)]
pub fn perspective_correct<S: Simd>(
    simd: S,
    [b1, b2]: [f32x16<S>; 2],
    inverse_w: f32x16<S>,
    [w1, w2]: [f32x16<S>; 2],
) -> [f32x16<S>; 2] {
    let inverse = f32x16::splat(simd, 1.0) / inverse_w;
    [b1 * w1 * inverse, b2 * w2 * inverse]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::token_of;
    use devmem::dispatch;
    use gaurast_runner::{Case, simd_levels};

    #[gaurast_runner::test]
    fn quads_that_cover_the_same_sample_are_written_in_turn() {
        let quad = |record, place, cover| Quad { record, place, cover, ..Quad::default() };
        let groups = |quads: [Quad; 4], alive| {
            let mut batch = Batch { count: 4, ..Batch::default() };
            batch.quads[..4].copy_from_slice(&quads);
            batch.prepare();
            batch.turns(0, alive).groups().collect::<Vec<_>>()
        };
        let apart = [quad(0, 0, 15), quad(0, 4, 15), quad(1, 8, 15), quad(1, 12, 15)];
        assert_eq!(groups(apart, u16::MAX), [0xFFFF]);
        let all = [0, 1, 2, 3].map(|record| quad(record, 0, 15));
        assert_eq!(groups(all, u16::MAX), [0xF, 0xF0, 0xF00, 0xF000]);
        // The second overlaps the first, and the fourth the third.
        let pairs = [quad(0, 0, 3), quad(1, 0, 2), quad(2, 4, 1), quad(3, 4, 9)];
        assert_eq!(groups(pairs, u16::MAX), [0xF, 0xFF0, 0xF000]);
        // What they have in common is not alive in one of them.
        assert_eq!(groups(pairs, 0xFFDF), [0xFFF, 0xF000]);
        // One primitive covers each sample once.
        assert_eq!(groups(all.map(|all| Quad { record: 0, ..all }), u16::MAX), [0xFFFF]);
    }

    #[gaurast_runner::test(each = simd_levels())]
    fn parts_of_blocks_are_added_as_their_quads_are(case: &Case) {
        let level = token_of(case);
        let needs = Needs { barycentrics: true, depth: true, inverse_w: true, detects_affine: false };
        let (mut parts, mut quads) = (Batch::default(), Batch::default());
        for batch in [&mut parts, &mut quads] {
            batch.begin(needs, [0, 0], 64);
        }
        let mut left_out = 0;
        for (number, lanes) in [0x0F03, 0xFFFF, 0, 0x8000, 0x0100, 0xF0F0, 0x1248, 0x000C].into_iter().enumerate() {
            let values: [[f32; 16]; 4] =
                std::array::from_fn(|value| std::array::from_fn(|lane| (1000 * number + 100 * value + lane) as f32));
            let first = Quad { record: number as u16, tile: 3, place: 16 * number as u8, ..Quad::default() };
            dispatch!(level, simd => {
                let [b1, b2, depth, inverse_w] = values.map(|value| f32x16::simd_from(simd, value));
                let values = BlockValues { barycentrics: [b1, b2], depth, inverse_w };
                left_out += parts.add_part(first, lanes, &values);
            });
            for quad in (0..4).filter(|quad| lanes >> (4 * quad) & 15 != 0) {
                let place = first.place + 4 * quad as u8;
                quads.add(Quad { place, cover: lanes >> (4 * quad) & 15, ..first }, quad, &values);
            }
        }
        parts.prepare();
        quads.prepare();
        assert_eq!((parts.count, left_out), (15, 17));
        let all = |batch: &Batch| {
            let lanes = 4 * batch.count;
            let values = [&batch.barycentrics[0], &batch.barycentrics[1], &batch.depth, &batch.inverse_w];
            let helpers: Vec<_> = (0..lanes).filter(|lane| batch.helpers.contains(*lane)).collect();
            let covered: Vec<_> = (0..batch.chunks()).map(|chunk| batch.covered(chunk)).collect();
            let quads = format!("{:?}", &batch.quads[..batch.count]);
            (values.map(|value| value[..lanes].to_vec()), helpers, covered, quads, batch.tiles)
        };
        assert_eq!(all(&parts), all(&quads));
        let (_, helpers, covered, ..) = all(&parts);
        for lane in 0..4 * parts.count {
            let is_covered = covered[lane / 16] >> (lane % 16) & 1 == 1;
            let quad = &parts.quads[lane / 4];
            assert_eq!(is_covered, quad.cover >> (lane % 4) & 1 == 1);
            assert_eq!(helpers.contains(&lane), !is_covered);
        }
        assert_eq!(parts.count_living(&[]), covered.iter().map(|lanes| u64::from(lanes.count_ones())).sum::<u64>());
        assert_eq!(parts.count_living(&[u64::MAX << 16]), u64::from(covered[0].count_ones()));
    }
}
