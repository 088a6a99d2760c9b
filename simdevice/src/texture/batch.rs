//! Samples of 16 lanes at once. The bits are those of [`super::filter`], which does what this cannot; nothing here is
//! fused, so that every SIMD level gives them.
//!
//! Work goes in phases that hand arrays to each other: levels of detail, the texels along each axis, the texels'
//! contents and their mean. Only the first depends on everything, so that few kernels are compiled for each SIMD level.

use std::sync::atomic::AtomicU32;

use fearless_simd::Simd;

use super::address;
use super::axis::{Axis, axis};
use super::cube;
use super::filter::{border_texel, reference_value};
use super::lod;
use super::lod::Selection;
use super::packing::{PackedLevel, Packing, Rows};
use super::sampler::{AddressMode, CompareOp, Filter, Reduction, Sampler};
use super::surface::Surface;
use crate::format::Numeric;
use crate::texture::packing::Floats;
use isa::ir::{CHUNK_LANES, Dimension};
use isa::resources::{Lanes, SampleRequest};

/// The components of 16 texels.
type Texels = [Floats; 4];

/// What a request reads, and how.
struct Batch<'a, S> {
    simd: S,
    surface: &'a Surface,
    packing: &'a Packing,
    sampler: &'a Sampler,
    request: &'a SampleRequest,
    /// The comparison that is asked for.
    reference: Option<(CompareOp, Floats)>,
}

/// Filters for all lanes; None if this request has to be filtered lane by lane.
#[inline(always)]
pub(super) fn sample<S: Simd>(
    simd: S,
    surface: &Surface,
    sampler: &Sampler,
    request: &SampleRequest,
) -> Option<[Lanes; 4]> {
    let packing = surface.packing.as_ref()?;
    let shape = request.shape;
    let is_mean = sampler.reduction == Reduction::WeightedAverage;
    if shape.multisampled
        || shape.dimension == Dimension::Buffer
        || request.gather.is_some()
        || !is_mean
    {
        return None;
    }
    let reference = sampler.compare_op.zip(request.compare).map(|(op, bits)| {
        let unorm = surface.format.numeric() == Numeric::Unorm;
        (op, bits.map(|bits| reference_value(unorm, bits)))
    });
    let batch = Batch {
        simd,
        surface,
        packing,
        sampler,
        request,
        reference,
    };
    let selection = lod::select(surface, sampler, request);
    let texels = batch.select_filter(&selection)?;
    Some(batch.registers(&texels))
}

impl<S: Simd> Batch<'_, S> {
    /// Stored components as a program gets them.
    #[inline(always)]
    fn registers(&self, texels: &Texels) -> [Lanes; 4] {
        let components = self.packing.kind.components();
        let (zero, one) = ([0.0; CHUNK_LANES], [1.0; CHUNK_LANES]);
        let mut registers = [&zero, &zero, &zero, &one];
        for (register, stored) in registers.iter_mut().zip(self.packing.order) {
            if stored < components {
                *register = &texels[stored];
            }
        }
        let mut out = [[0; CHUNK_LANES]; 4];
        for (out, from) in out.iter_mut().zip(self.surface.swizzle) {
            *out = bytemuck::cast(*from.pick(&registers, &zero, &one));
        }
        out
    }

    /// With the filter that each lane asks for.
    #[inline(always)]
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
    #[inline(always)]
    fn select_levels(&self, selection: &Selection, filter: Filter) -> Option<Texels> {
        let high = self.filter_level(&selection.high, filter)?;
        let weights = selection.weight.iter().map(|weight| weight.to_bits());
        if weights.fold(0, |all, bits| all | bits) == 0 {
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

    /// Of one level for each lane; None if some lie across the edge of a cube's face. Compiled on its own.
    #[inline(always)]
    fn filter_level(&self, levels: &Lanes, filter: Filter) -> Option<Texels> {
        self.simd.vectorize(
            #[inline(always)]
            || self.footprint(levels, filter),
        )
    }

    #[inline(always)]
    fn footprint(&self, levels: &Lanes, filter: Filter) -> Option<Texels> {
        let face = (self.request.shape.dimension == Dimension::Cube).then(|| self.faces());
        let (faces, coordinate) = match &face {
            Some((faces, coordinate)) => (Some(faces), coordinate),
            None => (None, &self.request.coordinate),
        };
        let layers = self.layers(faces);
        let missing = |layer: &u32| *layer >= self.surface.layers;
        if layers.is_some_and(|layers| layers.iter().any(missing)) {
            return None;
        }
        let sizes = LevelSizes::new(&self.packing.levels, levels);
        let dimension = self.request.shape.dimension;
        let x = self.axis(0, filter, coordinate, &sizes);
        let (y, z);
        let (y, z) = match dimension {
            Dimension::D1 | Dimension::Buffer => (&Axis::FLAT, &Axis::FLAT),
            Dimension::D2 | Dimension::Cube => {
                y = self.axis(1, filter, coordinate, &sizes);
                (&y, &Axis::FLAT)
            }
            Dimension::D3 => {
                y = self.axis(1, filter, coordinate, &sizes);
                z = self.axis(2, filter, coordinate, &sizes);
                (&y, &z)
            }
        };
        if dimension == Dimension::Cube {
            let inside = x.inside[0] & x.inside[1] & y.inside[0] & y.inside[1];
            if inside | !self.request.mask != u16::MAX {
                return None;
            }
        }
        let mut rows = Rows {
            base: sizes.of(|level| level.base),
            row_pitch: sizes.of(|level| level.row_pitch),
            x: &x.index,
            y: &y.index,
        };
        if let Some(layers) = layers {
            advance(
                &mut rows.base,
                &layers,
                &sizes.of(|level| level.layer_pitch),
            );
        }
        if dimension != Dimension::D3 {
            return Some(self.filter_slice(&rows, [&x, y], [u16::MAX; 2], filter));
        }
        let first = rows.base;
        let pitch = sizes.of(|level| level.depth_pitch);
        advance(&mut rows.base, &z.index[0], &pitch);
        let slice = self.filter_slice(&rows, [&x, y], [z.inside[0]; 2], filter);
        if filter == Filter::Nearest {
            return Some(slice);
        }
        rows.base = first;
        advance(&mut rows.base, &z.index[1], &pitch);
        let next = self.filter_slice(&rows, [&x, y], [z.inside[1]; 2], filter);
        Some(mix(&slice, &next, &z.weight))
    }

    /// Where the lanes' directions meet a cube: the face, and the coordinates on it.
    #[inline(always)]
    fn faces(&self) -> (Lanes, [Lanes; 4]) {
        let mut faces = [0; CHUNK_LANES];
        let mut coordinate = [[0; CHUNK_LANES]; 4];
        for lane in 0..CHUNK_LANES {
            let direction = [0, 1, 2].map(|axis| self.request.coordinate[axis][lane]);
            let hit = cube::Hit::new(direction.map(f32::from_bits));
            let [s, t] = hit.coordinates();
            faces[lane] = hit.face;
            [coordinate[0][lane], coordinate[1][lane]] = [s.to_bits(), t.to_bits()];
        }
        (faces, coordinate)
    }

    /// The layer of each lane; None if it is the first for all.
    #[inline(always)]
    fn layers(&self, faces: Option<&Lanes>) -> Option<Lanes> {
        let shape = self.request.shape;
        if !shape.arrayed {
            return faces.copied();
        }
        let per_element = if faces.is_some() { 6 } else { 1 };
        let elements = self.surface.layers / per_element;
        let coordinate = &self.request.coordinate[shape.dimension.coordinates()];
        let mut layers = faces.copied().unwrap_or_default();
        for (layer, coordinate) in layers.iter_mut().zip(coordinate) {
            *layer += address::layer(f32::from_bits(*coordinate), elements) * per_element;
        }
        Some(layers)
    }

    /// The texels of the lanes' coordinates along an axis.
    #[inline(always)]
    fn axis(
        &self,
        number: usize,
        filter: Filter,
        coordinate: &[Lanes; 4],
        sizes: &LevelSizes<'_>,
    ) -> Axis {
        let size = match number {
            0 => sizes.of(|level| level.extent[0]),
            1 => sizes.of(|level| level.extent[1]),
            _ => sizes.of(|level| level.extent[2]),
        };
        let coordinate = &coordinate[number];
        if self.request.shape.dimension == Dimension::Cube {
            // What lies across an edge is found out here, and done lane by lane.
            let mode = match filter {
                Filter::Nearest => AddressMode::ClampToEdge,
                Filter::Linear => AddressMode::ClampToBorder,
            };
            let offset = [0; CHUNK_LANES];
            return axis(self.simd, mode, filter, true, coordinate, &size, &offset);
        }
        axis(
            self.simd,
            self.sampler.address_modes[number],
            filter,
            !self.sampler.unnormalized_coordinates,
            coordinate,
            &size,
            &self.request.offset[number],
        )
    }

    /// Of one slice, which lanes have as far as they are `within`.
    #[inline(always)]
    fn filter_slice(
        &self,
        rows: &Rows<'_>,
        [x, y]: [&Axis; 2],
        within: [u16; 2],
        filter: Filter,
    ) -> Texels {
        let dimension = self.request.shape.dimension;
        let words = self.packing.words(&self.surface.memory);
        let bordered = x.has_outside || y.has_outside || within[0] != u16::MAX;
        // A cube's outside is that of lanes that nobody asks for.
        let plain = self.reference.is_none() && (!bordered || dimension == Dimension::Cube);
        if filter == Filter::Linear && dimension != Dimension::D1 && plain {
            let kind = self.packing.kind;
            return kind.bilinear(self.simd, words, rows, &x.weight, &y.weight);
        }
        let texel = |i: usize, j: usize| {
            let inside = x.inside[i] & y.inside[j] & within[0];
            self.texels(words, rows, [i, j], inside)
        };
        let row = |j: usize| mix(&texel(0, j), &texel(1, j), &x.weight);
        match (filter, dimension) {
            (Filter::Nearest, _) => texel(0, 0),
            (Filter::Linear, Dimension::D1) => row(0),
            (Filter::Linear, _) => mix(&row(0), &row(1), &y.weight),
        }
    }

    /// Texels (i, j) of those around, or the border's where they aren't `inside`; compared, if that is asked for.
    #[inline(always)]
    fn texels(
        &self,
        words: &[AtomicU32],
        rows: &Rows<'_>,
        [i, j]: [usize; 2],
        inside: u16,
    ) -> Texels {
        let mut texels = self.packing.kind.load(self.simd, words, rows, i, j);
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
        if let Some((op, reference)) = &self.reference {
            compare(*op, reference, &mut texels[0]);
        }
        texels
    }
}

/// The mip level of each lane.
struct LevelSizes<'a> {
    table: &'a [PackedLevel],
    levels: &'a Lanes,
    /// The level of all lanes, if it is one.
    uniform: Option<&'a PackedLevel>,
}

impl<'a> LevelSizes<'a> {
    #[inline(always)]
    fn new(table: &'a [PackedLevel], levels: &'a Lanes) -> Self {
        let differences = levels.iter().map(|level| level ^ levels[0]);
        let uniform = differences.fold(0, |all, difference| all | difference) == 0;
        Self {
            table,
            levels,
            uniform: uniform.then(|| &table[levels[0] as usize]),
        }
    }

    /// A number of each lane's level.
    #[inline(always)]
    fn of(&self, value: impl Fn(&PackedLevel) -> u32) -> Lanes {
        match self.uniform {
            Some(level) => [value(level); CHUNK_LANES],
            None => self.levels.map(|level| value(&self.table[level as usize])),
        }
    }
}

/// Moves texels on by some steps.
#[inline(always)]
fn advance(base: &mut Lanes, steps: &Lanes, pitch: &Lanes) {
    for lane in 0..CHUNK_LANES {
        base[lane] = base[lane].wrapping_add(steps[lane].wrapping_mul(pitch[lane]));
    }
}

/// Replaces depths by 1 where a comparison holds, else 0.
#[inline(always)]
fn compare(op: CompareOp, reference: &Floats, depths: &mut Floats) {
    let mut each = |holds: fn(f32, f32) -> bool| {
        for (depth, reference) in depths.iter_mut().zip(reference) {
            *depth = if holds(*reference, *depth) { 1.0 } else { 0.0 };
        }
    };
    match op {
        CompareOp::Less => each(|reference, depth| reference < depth),
        CompareOp::LessOrEqual => each(|reference, depth| reference <= depth),
        CompareOp::Greater => each(|reference, depth| reference > depth),
        CompareOp::GreaterOrEqual => each(|reference, depth| reference >= depth),
        _ => {
            for (depth, reference) in depths.iter_mut().zip(reference) {
                *depth = if op.holds(*reference, *depth) {
                    1.0
                } else {
                    0.0
                };
            }
        }
    }
}

/// The weighted means of texels.
#[inline(always)]
fn mix(a: &Texels, b: &Texels, weight: &Floats) -> Texels {
    let mut mixed = *a;
    for (mixed, b) in mixed.iter_mut().zip(b) {
        for lane in 0..CHUNK_LANES {
            mixed[lane] += weight[lane] * (b[lane] - mixed[lane]);
        }
    }
    mixed
}
