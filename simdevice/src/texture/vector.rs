//! Samples of 16 lanes at once. The bits are those of [`super::scalar`], which handles requests that this module does
//! not. No operations are fused, so that every SIMD level gives the same bits.
//!
//! [`bilinear`] handles plain samples, by far the most frequent: of 2D images and of cubes, linear within levels, with the
//! same level for each lane of a quad. All values stay in vectors, from the coordinates to the results. Lanes that read
//! across an edge of a cube are then sampled one by one.
//!
//! [`general`] works in phases that pass arrays to each other: levels of detail, the texels along each axis, the
//! texels' contents and their mean. Only the first phase depends on all parameters, so that few kernels are compiled
//! for each SIMD level.

use std::sync::atomic::AtomicU32;

use fearless_simd::{Simd, f32x16, prelude::*, u32x4, u32x16};

use super::addressing::{self, Axis, axis, taps};
use super::cube;
use super::lod::{self, QUADS, Selection};
use super::sampler::{AddressMode, Filter, Reduction, Sampler};
use super::scalar::{self, border_texel, reference_value};
use super::surface::Surface;
use super::texels::{Comparison, Footprint2x2, PackedLevel, Rows, Texels, VectorLayout, for_codec};
use crate::format::Numeric;
use crate::simd::{bits_of, floats_of, spread};
use crate::state::CompareOp;
use crate::texture::texels::Floats;
use isa::ir::{Dimension, VECTOR_LANES};
use isa::resources::{LaneWords, LodRequest, SampleRequest};

/// The components of 16 texels.
type Components = [Floats; 4];

/// The inputs of sampling for a request.
struct Batch<'a, S> {
    simd: S,
    surface: &'a Surface,
    layout: &'a VectorLayout,
    sampler: &'a Sampler,
    request: &'a SampleRequest,
    /// The comparison and its reference values, if it is requested.
    reference: Option<(CompareOp, Floats)>,
}

/// Filters for all lanes. Returns false if this request must be filtered lane by lane.
#[inline(always)]
pub(super) fn general<S: Simd>(
    simd: S,
    surface: &Surface,
    sampler: &Sampler,
    request: &SampleRequest,
    texel: &mut [LaneWords; 4],
) -> bool {
    let Some(layout) = surface.layout.as_ref().filter(|layout| layout.is_filterable) else {
        return false;
    };
    let shape = request.shape;
    let is_mean = sampler.reduction == Reduction::WeightedAverage;
    if shape.multisampled || shape.dimension == Dimension::Buffer || request.gather.is_some() || !is_mean {
        return false;
    }
    let reference = match (sampler.compare_op, &request.compare) {
        (Some(op), Some(bits)) => Some((op, references(surface, bits))),
        _ => None,
    };
    let batch = Batch { simd, surface, layout, sampler, request, reference };
    let selection = lod::select(surface, sampler, request);
    let Some(texels) = batch.select_filter(&selection) else {
        return false;
    };
    *texel = batch.registers(&texels);
    true
}

/// The reference values of a comparison.
#[inline(always)]
fn references(surface: &Surface, bits: &LaneWords) -> Floats {
    let unorm = surface.format.numeric() == Numeric::Unorm;
    let mut values = [0.0; VECTOR_LANES];
    for lane in 0..VECTOR_LANES {
        values[lane] = reference_value(unorm, bits[lane]);
    }
    values
}

impl<S: Simd> Batch<'_, S> {
    /// The result registers for stored components: reordered, completed and swizzled.
    #[inline(always)]
    fn registers(&self, texels: &Components) -> [LaneWords; 4] {
        let components = self.layout.codec.components();
        let (zero, one) = ([0.0; VECTOR_LANES], [1.0; VECTOR_LANES]);
        let mut registers = [&zero, &zero, &zero, &one];
        for (register, stored) in registers.iter_mut().zip(self.layout.order) {
            if stored < components {
                *register = &texels[stored];
            }
        }
        let mut out = [[0; VECTOR_LANES]; 4];
        for (out, from) in out.iter_mut().zip(self.surface.swizzle) {
            *out = bytemuck::cast(*from.pick(&registers, &zero, &one));
        }
        out
    }

    /// Filters with the filter that each lane selects.
    #[inline(always)]
    fn select_filter(&self, selection: &Selection) -> Option<Components> {
        let first = selection.filter[0];
        let mut texels = self.select_levels(selection, first)?;
        if selection.filter != [first; VECTOR_LANES] {
            let other = match first {
                Filter::Nearest => Filter::Linear,
                Filter::Linear => Filter::Nearest,
            };
            let others = self.select_levels(selection, other)?;
            for (texel, other) in texels.iter_mut().zip(&others) {
                for lane in 0..VECTOR_LANES {
                    if selection.filter[lane] != first {
                        texel[lane] = other[lane];
                    }
                }
            }
        }
        Some(texels)
    }

    /// Filters in one or two levels, and averages between them.
    #[inline(always)]
    fn select_levels(&self, selection: &Selection, filter: Filter) -> Option<Components> {
        let high = self.filter_level(&selection.high, filter)?;
        let weights = selection.weight.iter().map(|weight| weight.to_bits());
        if weights.fold(0, |all, bits| all | bits) == 0 {
            return Some(high);
        }
        let low = self.filter_level(&selection.low, filter)?;
        let mut texels = mix(&high, &low, &selection.weight);
        for (texel, high) in texels.iter_mut().zip(&high) {
            for lane in 0..VECTOR_LANES {
                // A level of weight zero is not read, so that infinities in it have no effect.
                texel[lane] = if selection.weight[lane] > 0.0 { texel[lane] } else { high[lane] };
            }
        }
        Some(texels)
    }

    /// Filters in one level for each lane; `None` if some texels are across the edge of a cube's face. The kernel is
    /// compiled on its own.
    #[inline(always)]
    fn filter_level(&self, levels: &LaneWords, filter: Filter) -> Option<Components> {
        self.simd.vectorize(
            #[inline(always)]
            || self.footprint(levels, filter),
        )
    }

    #[inline(always)]
    fn footprint(&self, levels: &LaneWords, filter: Filter) -> Option<Components> {
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
        let sizes = LevelSizes::new(&self.layout.levels, levels);
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
            advance(&mut rows.base, &layers, &sizes.of(|level| level.layer_pitch));
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

    /// The faces that the lanes' directions meet, and the coordinates on them; see [`cube::Hit`].
    #[inline(always)]
    fn faces(&self) -> (LaneWords, [LaneWords; 4]) {
        let [x, y, z, _] = self.request.coordinate;
        let (face, s, t) = cube::faces(self.simd, [x, y, z]);
        (face.into(), [bits_of(s).into(), bits_of(t).into(), [0; VECTOR_LANES], [0; VECTOR_LANES]])
    }

    /// The layer of each lane; `None` if it is the first for all.
    #[inline(always)]
    fn layers(&self, faces: Option<&LaneWords>) -> Option<LaneWords> {
        let shape = self.request.shape;
        if !shape.arrayed {
            return faces.copied();
        }
        let per_element = if faces.is_some() { 6 } else { 1 };
        let elements = self.surface.layers / per_element;
        let coordinate = &self.request.coordinate[shape.dimension.coordinates()];
        let mut layers = faces.copied().unwrap_or_default();
        for (layer, coordinate) in layers.iter_mut().zip(coordinate) {
            *layer += addressing::layer(f32::from_bits(*coordinate), elements) * per_element;
        }
        Some(layers)
    }

    /// The texels of the lanes' coordinates along an axis.
    #[inline(always)]
    fn axis(&self, number: usize, filter: Filter, coordinate: &[LaneWords; 4], sizes: &LevelSizes<'_>) -> Axis {
        let size = match number {
            0 => sizes.of(|level| level.extent[0]),
            1 => sizes.of(|level| level.extent[1]),
            _ => sizes.of(|level| level.extent[2]),
        };
        let coordinate = &coordinate[number];
        if self.request.shape.dimension == Dimension::Cube {
            // Texels across an edge are detected by the border mode, and the request is then filtered lane by lane.
            let mode = match filter {
                Filter::Nearest => AddressMode::ClampToEdge,
                Filter::Linear => AddressMode::ClampToBorder,
            };
            let offset = [0; VECTOR_LANES];
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

    /// Filters in one slice. Lanes outside of `within` read the border.
    #[inline(always)]
    fn filter_slice(&self, rows: &Rows<'_>, [x, y]: [&Axis; 2], within: [u16; 2], filter: Filter) -> Components {
        let dimension = self.request.shape.dimension;
        let words = self.layout.words(&self.surface.memory);
        let bordered = x.has_outside || y.has_outside || within[0] != u16::MAX;
        // For a cube, only inactive lanes can be outside here.
        let plain = self.reference.is_none() && (!bordered || dimension == Dimension::Cube);
        if filter == Filter::Linear && dimension != Dimension::D1 && plain {
            let codec = self.layout.codec;
            return codec.bilinear(self.simd, words, rows, &x.weight, &y.weight);
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

    /// The components of texel (i, j) of those around each point. Lanes that are not `inside` get the border. If a
    /// comparison is requested, the first component is its result.
    #[inline(always)]
    fn texels(&self, words: &[AtomicU32], rows: &Rows<'_>, [i, j]: [usize; 2], inside: u16) -> Components {
        let mut texels = self.layout.codec.load(self.simd, words, rows, i, j);
        if inside != u16::MAX {
            let border = border_texel(self.surface, self.sampler).map(f32::from_bits);
            for (register, stored) in self.layout.order.into_iter().enumerate() {
                if stored < self.layout.codec.components() {
                    for lane in (0..VECTOR_LANES).filter(|lane| inside >> lane & 1 == 0) {
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

/// The sizes of each lane's mip level.
struct LevelSizes<'a> {
    table: &'a [PackedLevel],
    levels: &'a LaneWords,
    /// The level of all lanes, if it is the same.
    uniform: Option<&'a PackedLevel>,
}

impl<'a> LevelSizes<'a> {
    #[inline(always)]
    fn new(table: &'a [PackedLevel], levels: &'a LaneWords) -> Self {
        let differences = levels.iter().map(|level| level ^ levels[0]);
        let uniform = differences.fold(0, |all, difference| all | difference) == 0;
        Self { table, levels, uniform: uniform.then(|| &table[levels[0] as usize]) }
    }

    /// A property of each lane's level.
    #[inline(always)]
    fn of(&self, value: impl Fn(&PackedLevel) -> u32) -> LaneWords {
        match self.uniform {
            Some(level) => [value(level); VECTOR_LANES],
            None => {
                let mut values = [0; VECTOR_LANES];
                for (value_of_lane, level) in values.iter_mut().zip(self.levels) {
                    *value_of_lane = value(&self.table[*level as usize]);
                }
                values
            }
        }
    }
}

/// Advances texel indices by a number of steps of `pitch`.
#[inline(always)]
fn advance(base: &mut LaneWords, steps: &LaneWords, pitch: &LaneWords) {
    for lane in 0..VECTOR_LANES {
        base[lane] = base[lane].wrapping_add(steps[lane].wrapping_mul(pitch[lane]));
    }
}

/// Replaces depths by 1 if the comparison holds, and by 0 otherwise.
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
                *depth = if op.holds(*reference, *depth) { 1.0 } else { 0.0 };
            }
        }
    }
}

/// The weighted means of texels.
#[inline(always)]
fn mix(a: &Components, b: &Components, weight: &Floats) -> Components {
    let mut mixed = *a;
    for (mixed, b) in mixed.iter_mut().zip(b) {
        for lane in 0..VECTOR_LANES {
            mixed[lane] += weight[lane] * (b[lane] - mixed[lane]);
        }
    }
    mixed
}

/// Filters for all lanes. Returns false if the request is not plain.
#[inline(always)]
pub(super) fn bilinear<S: Simd>(
    simd: S,
    surface: &Surface,
    sampler: &Sampler,
    request: &SampleRequest,
    texel: &mut [LaneWords; 4],
) -> bool {
    let Some(layout) = surface.layout.as_ref().filter(|layout| layout.is_filterable) else {
        return false;
    };
    let compares_colors = sampler.compare_op.is_some() && request.compare.is_some() && !layout.codec.is_depth();
    if compares_colors || !is_plain(surface, sampler, request) {
        return false;
    }
    let edges = simd.vectorize(
        #[inline(always)]
        || filter(simd, surface, layout, sampler, request, texel),
    );
    if edges != 0 {
        let across = scalar::sample(surface, sampler, &SampleRequest { mask: edges, ..*request });
        for lane in (0..VECTOR_LANES).filter(|lane| edges >> lane & 1 != 0) {
            for (texel, across) in texel.iter_mut().zip(&across) {
                texel[lane] = across[lane];
            }
        }
    }
    true
}

/// True if a request needs nothing but bilinear filtering and mip levels per quad.
#[inline(always)]
fn is_plain(surface: &Surface, sampler: &Sampler, request: &SampleRequest) -> bool {
    let shape = request.shape;
    let [x, y, _] = sampler.address_modes;
    let mut moved = 0;
    for offset in request.offset[..2].as_flattened() {
        moved |= offset;
    }
    let in_plane = shape.dimension == Dimension::D2
        && x != AddressMode::ClampToBorder
        && y != AddressMode::ClampToBorder
        && moved == 0;
    let on_cube = shape.dimension == Dimension::Cube && surface.levels.len() == 1 && surface.layers >= 6;
    (in_plane || on_cube)
        && !shape.arrayed
        && !shape.multisampled
        && request.lod == LodRequest::Automatic
        && request.gather.is_none()
        && (sampler.mag_filter, sampler.min_filter) == (Filter::Linear, Filter::Linear)
        && !sampler.unnormalized_coordinates
        && sampler.reduction == Reduction::WeightedAverage
}

/// The place in a level that each lane samples.
struct Points<S: Simd> {
    coordinates: [f32x16<S>; 2],
    modes: [AddressMode; 2],
    /// The face of a cube.
    face: Option<u32x16<S>>,
}

impl<S: Simd> Points<S> {
    #[inline(always)]
    fn new(simd: S, sampler: &Sampler, request: &SampleRequest) -> Self {
        let [x, y, z, _] = request.coordinate;
        if request.shape.dimension == Dimension::Cube {
            let (face, s, t) = cube::faces(simd, [x, y, z]);
            return Self { coordinates: [s, t], modes: [AddressMode::ClampToEdge; 2], face: Some(face) };
        }
        let [x, y] = [floats_of(u32x16::simd_from(simd, x)), floats_of(u32x16::simd_from(simd, y))];
        let [along_x, along_y, _] = sampler.address_modes;
        Self { coordinates: [x, y], modes: [along_x, along_y], face: None }
    }

    /// The texels around the points in a level for each quad.
    #[inline(always)]
    fn around(&self, simd: S, layout: &VectorLayout, levels: &[u32; QUADS]) -> Footprint2x2<S> {
        let first = &layout.levels[levels[0] as usize];
        let (width, height, mut base, row_pitch);
        if *levels == [levels[0]; QUADS] {
            width = f32x16::splat(simd, first.extent[0] as f32);
            height = f32x16::splat(simd, first.extent[1] as f32);
            base = u32x16::splat(simd, first.base);
            row_pitch = u32x16::splat(simd, first.row_pitch);
        } else {
            let mut each = [first; QUADS];
            for quad in 1..QUADS {
                each[quad] = &layout.levels[levels[quad] as usize];
            }
            width = spread(simd, of_each(each, |level| level.extent[0] as f32));
            height = spread(simd, of_each(each, |level| level.extent[1] as f32));
            base = spread_words(simd, of_each(each, |level| level.base));
            row_pitch = spread_words(simd, of_each(each, |level| level.row_pitch));
        }
        // A cube has a single level here.
        if let Some(face) = self.face {
            base += face * first.layer_pitch;
        }
        let x = taps(simd, self.modes[0], self.coordinates[0], width);
        let y = taps(simd, self.modes[1], self.coordinates[1], height);
        Footprint2x2 {
            rows: [base + y.first * row_pitch, base + y.second * row_pitch],
            columns: [x.first, x.second],
            weights: [x.weight, y.weight],
        }
    }
}

/// Sets the result registers. Returns the active lanes whose texels are across an edge of a cube: their result is
/// undefined.
#[inline(always)]
fn filter<S: Simd>(
    simd: S,
    surface: &Surface,
    layout: &VectorLayout,
    sampler: &Sampler,
    request: &SampleRequest,
    registers: &mut [LaneWords; 4],
) -> u16 {
    let words = layout.words(&surface.memory);
    let selection = lod::select_quads(surface, sampler, request);
    let comparison = match (sampler.compare_op, &request.compare) {
        (Some(op), Some(bits)) => {
            Some(Comparison { op, reference: f32x16::simd_from(simd, references(surface, bits)) })
        }
        _ => None,
    };
    let points = Points::new(simd, sampler, request);
    let mut texel = [f32x16::splat(simd, 0.0); 4];
    let mut edges = 0;
    // A loop, so that one copy of the level's code serves both levels.
    for (is_low, levels) in [(false, &selection.high), (true, &selection.low)] {
        if is_low && selection.weight == [0.0; QUADS] {
            break;
        }
        let around = points.around(simd, layout, levels);
        let found = for_codec!(layout.codec, mean(simd, words, &around, comparison));
        if !is_low {
            texel = found;
            if points.face.is_some() {
                edges = around.at_edges() & request.mask;
            }
            continue;
        }
        let weight = spread(simd, selection.weight);
        let mixes = weight.simd_gt(0.0);
        for c in 0..4 {
            let mixed = texel[c] + weight * (found[c] - texel[c]);
            // A level of weight zero is not read, so that infinities in it have no effect.
            texel[c] = mixes.select(mixed, texel[c]);
        }
    }
    let mut stored = [u32x16::splat(simd, 0); 4];
    for c in 0..4 {
        stored[c] = bits_of(texel[c]);
    }
    layout.arrange(stored, 1f32.to_bits(), registers);
    edges
}

/// The weighted mean of the texels around each point.
#[inline(always)]
fn mean<S: Simd, T: Texels>(
    simd: S,
    words: &[AtomicU32],
    around: &Footprint2x2<S>,
    comparison: Option<Comparison<S>>,
) -> [f32x16<S>; 4] {
    around.filter::<T>(simd, words, comparison)
}

/// A property of each level. (The standard library's `map` is not always inlined.)
#[inline(always)]
fn of_each<T: Copy + Default>(levels: [&PackedLevel; QUADS], value: impl Fn(&PackedLevel) -> T) -> [T; QUADS] {
    let mut values = [T::default(); QUADS];
    for quad in 0..QUADS {
        values[quad] = value(levels[quad]);
    }
    values
}

/// The result of [`spread`], for integers.
#[inline(always)]
fn spread_words<S: Simd>(simd: S, [a, b, c, d]: [u32; QUADS]) -> u32x16<S> {
    let upper = u32x4::splat(simd, a).combine(u32x4::splat(simd, b));
    upper.combine(u32x4::splat(simd, c).combine(u32x4::splat(simd, d)))
}
