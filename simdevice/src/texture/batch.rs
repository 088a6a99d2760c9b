//! Samples of 16 lanes at once. The bits are those of [`super::filter`], which does what this cannot; nothing here is
//! fused, so that every SIMD level gives them.
//!
//! Work goes in phases that hand arrays to each other: levels of detail, the texels along each axis, the texels'
//! contents and their mean. Only the first depends on everything, so that few kernels are compiled for each SIMD level.

use std::sync::atomic::AtomicU32;

use fearless_simd::Level;

use super::address::layer;
use super::axis::{Axis, axis};
use super::cube;
use super::filter::{border_texel, reference};
use super::lod::{self, Floats, Selection};
use super::packing::{Packing, Rows};
use super::sampler::{AddressMode, Filter, Sampler};
use super::surface::Surface;
use crate::isa::ir::{CHUNK_LANES, Dimension};
use crate::isa::resources::{Lanes, SampleRequest};

/// The components of 16 texels.
type Texels = [Floats; 4];

/// What a request reads, and how.
pub(super) struct Batch<'a> {
    pub level: Level,
    pub surface: &'a Surface,
    pub packing: &'a Packing,
    pub sampler: &'a Sampler,
    pub request: &'a SampleRequest,
}

/// The texels around the lanes' points in one mip level.
struct Footprint {
    /// Along x, y and z.
    axes: [Axis; 3],
    /// The first texel of each lane's layer.
    base: Lanes,
    row_pitch: Lanes,
    depth_pitch: Lanes,
}

impl Batch<'_> {
    /// Filters for all lanes; None if this request has to be filtered lane by lane.
    pub fn sample(&self) -> Option<[Lanes; 4]> {
        let shape = self.request.shape;
        if shape.multisampled || shape.dimension == Dimension::Buffer {
            return None;
        }
        if self.request.gather.is_some() {
            return None;
        }
        let selection = lod::select(self.surface, self.sampler, self.request);
        let texels = self.select_filter(&selection)?;
        Some(self.registers(&texels))
    }

    /// Stored components as a program gets them.
    fn registers(&self, texels: &Texels) -> [Lanes; 4] {
        let mut registers = [[0.0; CHUNK_LANES]; 4];
        registers[3] = [1.0; CHUNK_LANES];
        for (register, stored) in registers.iter_mut().zip(self.packing.order) {
            if stored < self.packing.kind.components() {
                *register = texels[stored];
            }
        }
        let (zero, one) = ([0.0; CHUNK_LANES], [1.0; CHUNK_LANES]);
        self.surface
            .swizzle
            .map(|from| from.pick(&registers, zero, one).map(f32::to_bits))
    }

    /// With the filter that each lane asks for.
    fn select_filter(&self, selection: &Selection) -> Option<Texels> {
        let first = selection.filter[0];
        let mut texels = self.select_levels(selection, first)?;
        if selection.filter != [first; CHUNK_LANES] {
            let other = match first {
                Filter::Nearest => Filter::Linear,
                Filter::Linear => Filter::Nearest,
            };
            let others = self.select_levels(selection, other)?;
            for (texel, other) in texels.iter_mut().zip(&others) {
                for lane in 0..CHUNK_LANES {
                    if selection.filter[lane] != first {
                        texel[lane] = other[lane];
                    }
                }
            }
        }
        Some(texels)
    }

    /// Mixed between levels.
    fn select_levels(&self, selection: &Selection, filter: Filter) -> Option<Texels> {
        let high = self.filter_level(&selection.high, filter)?;
        if selection.weight == [0.0; CHUNK_LANES] {
            return Some(high);
        }
        let low = self.filter_level(&selection.low, filter)?;
        let mut texels = mix(&high, &low, &selection.weight);
        for (texel, high) in texels.iter_mut().zip(&high) {
            for lane in 0..CHUNK_LANES {
                // A level of weight zero isn't read, though it be infinite.
                texel[lane] = if selection.weight[lane] > 0.0 {
                    texel[lane]
                } else {
                    high[lane]
                };
            }
        }
        Some(texels)
    }

    /// Of one level for each lane.
    fn filter_level(&self, levels: &Lanes, filter: Filter) -> Option<Texels> {
        let footprint = self.footprint(levels, filter)?;
        let [_, _, z] = &footprint.axes;
        let slice = self.filter_slice(&footprint, 0, filter);
        if self.request.shape.dimension == Dimension::D3 && filter == Filter::Linear {
            let next = self.filter_slice(&footprint, 1, filter);
            return Some(mix(&slice, &next, &z.weight));
        }
        Some(slice)
    }

    /// Of slice `k` of two.
    fn filter_slice(&self, footprint: &Footprint, k: usize, filter: Filter) -> Texels {
        let [x, y, z] = &footprint.axes;
        let words = self.packing.words(self.surface);
        let mut rows = Rows {
            base: footprint.base,
            row_pitch: footprint.row_pitch,
            x: &x.index,
            y: &y.index,
        };
        if self.request.shape.dimension == Dimension::D3 {
            for lane in 0..CHUNK_LANES {
                let slice = z.index[k][lane].wrapping_mul(footprint.depth_pitch[lane]);
                rows.base[lane] = rows.base[lane].wrapping_add(slice);
            }
        }
        let plain = self.sampler.compare_op.is_none() || self.request.compare.is_none();
        let bordered = footprint.axes.iter().any(|axis| axis.has_outside);
        let kind = self.packing.kind;
        if filter == Filter::Linear
            && self.request.shape.dimension != Dimension::D1
            && plain
            && !bordered
        {
            return kind.bilinear(self.level, words, &rows, &x.weight, &y.weight);
        }
        let texel = |i: usize, j: usize| {
            let inside = x.inside[i] & y.inside[j] & z.inside[k];
            self.texels(words, &rows, [i, j], inside)
        };
        let row = |j: usize| mix(&texel(0, j), &texel(1, j), &x.weight);
        match (filter, self.request.shape.dimension) {
            (Filter::Nearest, _) => texel(0, 0),
            (Filter::Linear, Dimension::D1) => row(0),
            (Filter::Linear, _) => mix(&row(0), &row(1), &y.weight),
        }
    }

    /// Texels (i, j) of those around, or the border's where they aren't `inside`; compared, if that is asked for.
    fn texels(
        &self,
        words: &[AtomicU32],
        rows: &Rows<'_>,
        [i, j]: [usize; 2],
        inside: u16,
    ) -> Texels {
        let mut texels = self.packing.kind.load(self.level, words, rows, i, j);
        if inside != u16::MAX {
            let border = border_texel(self.surface, self.sampler).map(f32::from_bits);
            for (register, stored) in self.packing.order.into_iter().enumerate() {
                if stored < self.packing.kind.components() {
                    for lane in (0..CHUNK_LANES).filter(|lane| inside >> lane & 1 == 0) {
                        texels[stored][lane] = border[register];
                    }
                }
            }
        }
        if let Some(op) = self.sampler.compare_op {
            for (lane, depth) in texels[0].iter_mut().enumerate() {
                if let Some(reference) = reference(self.surface, self.sampler, self.request, lane) {
                    *depth = if op.holds(reference, *depth) {
                        1.0
                    } else {
                        0.0
                    };
                }
            }
        }
        texels
    }

    /// The texels that the lanes' coordinates mean; None if some lie across the edge of a cube's face.
    fn footprint(&self, levels: &Lanes, filter: Filter) -> Option<Footprint> {
        let table = &self.packing.levels;
        let uniform = levels.iter().all(|level| *level == levels[0]);
        let of = |value: fn(&super::packing::PackedLevel) -> u32| {
            if uniform {
                [value(&table[levels[0] as usize]); CHUNK_LANES]
            } else {
                levels.map(|level| value(&table[level as usize]))
            }
        };
        let extents = [
            of(|level| level.extent[0]),
            of(|level| level.extent[1]),
            of(|level| level.extent[2]),
        ];
        let mut base = of(|level| level.base);
        let dimension = self.request.shape.dimension;
        let cube = dimension == Dimension::Cube;
        let mut coordinate = [0, 1, 2].map(|axis| self.request.coordinate[axis]);
        let mut layers = [0; CHUNK_LANES];
        if cube {
            for lane in 0..CHUNK_LANES {
                let direction = coordinate.map(|lanes| f32::from_bits(lanes[lane]));
                let hit = cube::Hit::new(direction);
                let [s, t] = hit.coordinates();
                layers[lane] = hit.face;
                [coordinate[0][lane], coordinate[1][lane]] = [s.to_bits(), t.to_bits()];
            }
        }
        if self.request.shape.arrayed {
            let elements = self.surface.layers / if cube { 6 } else { 1 };
            let coordinate = &self.request.coordinate[dimension.coordinates()];
            for lane in 0..CHUNK_LANES {
                let element = layer(f32::from_bits(coordinate[lane]), elements);
                layers[lane] += element * if cube { 6 } else { 1 };
            }
        }
        if layers != [0; CHUNK_LANES] {
            if layers.iter().any(|layer| *layer >= self.surface.layers) {
                return None;
            }
            let pitch = of(|level| level.layer_pitch);
            for lane in 0..CHUNK_LANES {
                base[lane] = base[lane].wrapping_add(layers[lane].wrapping_mul(pitch[lane]));
            }
        }
        let axis = |number: usize| {
            // A cube has edges, which one would cross to where another face is.
            let mode = if cube && filter == Filter::Linear {
                AddressMode::ClampToBorder
            } else if cube {
                AddressMode::ClampToEdge
            } else {
                self.sampler.address_modes[number]
            };
            axis(
                self.level,
                mode,
                filter,
                !self.sampler.unnormalized_coordinates || cube,
                &coordinate[number],
                &extents[number],
                if cube {
                    &[0; CHUNK_LANES]
                } else {
                    &self.request.offset[number]
                },
            )
        };
        let axes = match dimension {
            Dimension::D1 | Dimension::Buffer => [axis(0), Axis::FLAT, Axis::FLAT],
            Dimension::D2 | Dimension::Cube => [axis(0), axis(1), Axis::FLAT],
            Dimension::D3 => [axis(0), axis(1), axis(2)],
        };
        let crosses =
            |axis: &Axis| (axis.inside[0] & axis.inside[1]) | !self.request.mask != u16::MAX;
        if cube && axes.iter().any(crosses) {
            return None;
        }
        let mut footprint = Footprint {
            axes,
            base,
            row_pitch: of(|level| level.row_pitch),
            depth_pitch: of(|level| level.depth_pitch),
        };
        if cube {
            // What lanes that nobody asks for read doesn't matter.
            for axis in &mut footprint.axes {
                axis.has_outside = false;
            }
        }
        Some(footprint)
    }
}

/// The weighted means of texels.
fn mix(a: &Texels, b: &Texels, weight: &Floats) -> Texels {
    let mut mixed = *a;
    for (mixed, b) in mixed.iter_mut().zip(b) {
        for lane in 0..CHUNK_LANES {
            mixed[lane] += weight[lane] * (b[lane] - mixed[lane]);
        }
    }
    mixed
}
