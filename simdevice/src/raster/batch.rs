//! Batches of fragments: 2x2 quads of any primitives of a draw within a macro-tile, and what the fragment program gets
//! of them.

use super::quads::Quads;
use super::setup::Setup;
use crate::geometry::{Primitive, PrimitiveKind, Varyings};
use crate::program::fragment::{BATCH_LANES, Interface};
use crate::program::interface::Interpolation;
use crate::simd::{both, three};
use crate::stats::optimizations::{Skip, Skips};
use fearless_simd::{Simd, f32x16, prelude::*};
use isa::exec::LaneMask;

mod inputs;

pub use inputs::{divided, varying};

/// Lanes of the largest batch.
pub const LANES: usize = BATCH_LANES[1];
/// Quads of it.
pub const QUADS: usize = LANES / 4;

/// A quad that is to be shaded.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quad {
    /// Its primitive: an index into [`Batch::records`].
    pub record: u16,
    /// Its tile of the macro-tile.
    pub tile: u8,
    /// Its first pixel's place within the tile.
    pub place: u8,
    /// Bit `4 sample + lane` tells which samples are covered.
    pub cover: u16,
    /// The sample shaded, where each sample is shaded for itself.
    pub sample: u8,
}

/// The samples of a draw's pixels.
#[derive(Clone, Copy, Debug)]
pub struct Samples {
    /// Where they are, in 1/256 pixels.
    pub positions: &'static [[i32; 2]],
    /// Whether each is shaded for itself, with its own values.
    pub each_shaded: bool,
}

/// What quads need of their primitive.
#[derive(Clone, Debug)]
pub struct Record {
    /// Its number within the instance.
    id: u32,
    layer: u16,
    pub front: bool,
    pub viewport: u8,
    is_point: bool,
    /// 1 / w at corners 1 and 2, as [`Setup::weights`].
    weights: [f32; 2],
    /// What [`BlockValues::inverse_w`] is to be multiplied by.
    scale: f32,
    /// Derivatives of the barycentrics by x and y in pixels.
    slopes: [[f32; 2]; 2],
    /// Derivatives of [`BlockValues::inverse_w`].
    w_slopes: [f32; 2],
    /// Derivatives of depth.
    pub depth_slopes: [f32; 2],
}

/// What fragments need of their primitive's planes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Needs {
    pub barycentrics: bool,
    /// After the early tests.
    pub depth: bool,
    /// 1 / w.
    pub inverse_w: bool,
}

/// Fragments to be shaded together.
#[derive(Debug)]
pub struct Batch {
    /// What is kept of quads' values.
    needs: Needs,
    /// The first pixel of the macro-tile in the framebuffer.
    corner: [u32; 2],
    /// Its side in tiles.
    side: u32,
    /// Whether some pixels of quads are not covered.
    partial: bool,
    /// Whether it is looked at whether batches are affine.
    detects_affine: bool,
    /// Whether 1 / w is the same all over each primitive, so that barycentrics need no correction.
    affine: bool,
    pub quads: [Quad; QUADS],
    pub count: usize,
    /// Bit `tile` tells that it has quads of that tile.
    tiles: u64,
    pub records: Vec<Record>,
    /// Of each record, each varying: see [`add_attributes`].
    attributes: Vec<[f32; 3]>,
    /// The barycentrics of corners 1 and 2, lane by lane.
    barycentrics: [[f32; LANES]; 2],
    /// The same, perspective-correct.
    perspective: [[f32; LANES]; 2],
    pub depth: [f32; LANES],
    inverse_w: [f32; LANES],
    /// The record of all quads of each chunk, if it is the same.
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
            partial: false,
            detects_affine: true,
            affine: true,
            quads: [Quad::default(); QUADS],
            count: 0,
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

/// Values that vary over the pixels of a block, at the centres.
#[derive(Clone, Copy)]
pub struct BlockValues<S: Simd> {
    pub barycentrics: [f32x16<S>; 2],
    pub depth: f32x16<S>,
    /// 1 / w, in units of its value if that is the same everywhere.
    pub inverse_w: f32x16<S>,
}

impl<S: Simd> BlockValues<S> {
    /// Those of the block at pixel (x, y), as far as they are needed.
    #[inline(always)]
    pub fn new(simd: S, setup: &Setup, [x, y]: [i32; 2], needs: Needs) -> Self {
        let bases = setup.barycentrics(x, y);
        let add = |base: f32, lanes: [f32; 16]| f32x16::simd_from(simd, lanes) + base;
        let mut values = Self {
            barycentrics: [f32x16::splat(simd, 0.0); 2],
            depth: f32x16::splat(simd, 0.0),
            inverse_w: f32x16::splat(simd, 1.0),
        };
        if needs.depth {
            values.depth = add(setup.depth(bases), setup.lane_depth);
        }
        if needs.barycentrics {
            values.barycentrics = [
                add(bases[0] as f32, setup.lane_barycentrics[0]),
                add(bases[1] as f32, setup.lane_barycentrics[1]),
            ];
        }
        if needs.inverse_w && !setup.affine {
            values.inverse_w = add(setup.inverse_w(bases), setup.lane_w);
        }
        values
    }

    /// As lanes, in the order of the fields.
    #[inline(always)]
    pub fn lanes(self) -> [[f32; 16]; 4] {
        let [b1, b2] = self.barycentrics;
        [
            b1.into(),
            b2.into(),
            self.depth.into(),
            self.inverse_w.into(),
        ]
    }
}

impl Batch {
    /// Empties it, for a draw whose fragments need this, within a macro-tile: its column and row, and its side in
    /// pixels.
    pub fn begin(&mut self, needs: Needs, at: [u32; 2], size: u32, skips: Skips) {
        self.needs = needs;
        self.detects_affine = skips.has(Skip::Affine);
        self.corner = at.map(|at| at * size);
        self.side = size / crate::limits::TILE_SIZE;
        self.clear();
    }

    /// Empties it.
    pub fn clear(&mut self) {
        (self.affine, self.partial) = (self.detects_affine, false);
        (self.count, self.tiles) = (0, 0);
        self.records.clear();
        self.attributes.clear();
    }

    /// Adds a primitive, of which quads may follow; returns its record.
    pub fn add_primitive(
        &mut self,
        primitive: &Primitive,
        setup: &Setup,
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
            weights: setup.weights,
            scale: setup.scale,
            slopes: setup.slopes,
            w_slopes: setup.w_slopes,
            depth_slopes: setup.depth_slopes,
        });
        add_attributes(primitive, interface, varyings, &mut self.attributes);
        (self.records.len() - 1) as u16
    }

    /// Adds a quad: `quad` of a block, whose values are given.
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
        self.partial |= covered_lanes(quad.cover) != 15;
        self.tiles |= 1 << quad.tile;
        self.quads[self.count] = quad;
        self.count += 1;
    }

    /// Adds all four quads of a block, for which there is room.
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
            values
                .inverse_w
                .store_slice(&mut self.inverse_w[at..at + 16]);
        }
        self.tiles |= 1 << quads[0].tile;
        self.quads[self.count..self.count + 4].copy_from_slice(&quads);
        self.count += 4;
    }

    /// Whether it has quads of a tile.
    pub fn has_tile(&self, tile: usize) -> bool {
        self.tiles >> tile & 1 == 1
    }

    /// Chunks of 16 lanes that have quads.
    pub fn chunks(&self) -> usize {
        self.count.div_ceil(4)
    }

    /// The quads of a chunk.
    #[inline(always)]
    pub fn chunk_quads(&self, chunk: usize) -> &[Quad; 4] {
        let (chunks, _) = self.quads.as_chunks();
        &chunks[chunk]
    }

    /// Where a chunk's quads are in a plane of `samples` samples a pixel.
    #[inline(always)]
    pub fn places(&self, chunk: usize, sample: usize, samples: usize) -> Quads {
        let mut first = [0; 4];
        for (first, quad) in first.iter_mut().zip(self.chunk_quads(chunk)) {
            let tile = usize::from(quad.tile) * samples + sample;
            *first = tile * super::tile::AREA + usize::from(quad.place);
        }
        let [a, b, c, d] = first;
        Quads {
            first,
            consecutive: b == a + 4 && c == a + 8 && d == a + 12,
        }
    }

    /// Whether two quads of a chunk cover the same sample, so that their order matters.
    #[inline(always)]
    pub fn overlaps(&self, chunk: usize) -> bool {
        // A primitive has each sample once.
        self.common[chunk].is_none() && self.overlap(chunk)
    }

    fn overlap(&self, chunk: usize) -> bool {
        let quads = self.chunk_quads(chunk);
        quads.iter().enumerate().any(|(index, a)| {
            quads[index + 1..]
                .iter()
                .any(|b| (a.tile, a.place) == (b.tile, b.place) && a.cover & b.cover != 0)
        })
    }

    /// Fills up the last chunk, and says which lanes are active and which only help with derivatives.
    pub fn prepare(&mut self) {
        let last = self.quads[self.count - 1];
        for quad in &mut self.quads[self.count..4 * self.count.div_ceil(4)] {
            *quad = Quad { cover: 0, ..last };
        }
        for (quads, common) in self.quads.as_chunks().0.iter().zip(&mut self.common) {
            let [a, b, c, d]: &[Quad; 4] = quads;
            let same = a.record == b.record && a.record == c.record && a.record == d.record;
            *common = same.then_some(a.record);
        }
        self.active = LaneMask::first(4 * self.count);
        self.helpers = LaneMask::none();
        if !self.partial {
            return;
        }
        for (number, quad) in self.quads[..self.count].iter().enumerate() {
            let covered = covered_lanes(quad.cover);
            if covered != 15 {
                for lane in 0..4 {
                    if covered >> lane & 1 == 0 {
                        self.helpers.set(4 * number + lane, true);
                    }
                }
            }
        }
    }
}

/// Adds what a primitive's varyings are, in the order of the interface: each one's value at corner 0, and how much more it
/// is at the others (the value alone if it is flat).
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
    let value = |vertex: &[u32], varying: u32| {
        f32::from_bits(vertex.get(varying as usize).copied().unwrap_or(0))
    };
    for &(varying, interpolation) in &interface.varyings {
        attributes.push(match interpolation {
            Interpolation::Flat => [value(provoking, varying), 0.0, 0.0],
            _ => {
                let first = value(a, varying);
                [first, value(b, varying) - first, value(c, varying) - first]
            }
        });
    }
}

/// A sample's offset from the pixel's centre in pixels, along an axis.
#[inline(always)]
pub fn offset(position: i32) -> f32 {
    (position - 128) as f32 / 256.0
}

/// The lanes of a quad of which some sample is covered.
pub fn covered_lanes(cover: u16) -> u16 {
    (cover | cover >> 4 | cover >> 8 | cover >> 12) & 15
}

/// Values of the block of a sample, from those at the centres.
#[inline(always)]
pub fn at_sample<S: Simd>(
    values: &BlockValues<S>,
    setup: &Setup,
    position: [i32; 2],
) -> BlockValues<S> {
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
