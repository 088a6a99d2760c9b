//! Image accesses lane by lane: samples and gathers of any format, shape and sampler, fetches, reads, writes and
//! atomics. [`super::vector`] takes common samples faster, and [`super::access`] common reads and writes, with the same
//! bits. All accesses are bounds-checked: texels outside are read as zero, and writes to them are ignored.

use super::addressing::{self, Taps};
use super::cube;
use super::lod;
use super::sampler::{AddressMode, BorderColor, Filter, Reduction, Sampler};
use super::surface::{Surface, Texel};
use crate::format::{Channel, MAX_TEXEL_SIZE, Numeric};
use isa::combine;
use isa::float::{greatest, least};
use isa::ir::{AtomicOp, Dimension, Format as Word, ImageShape, VECTOR_LANES};
use isa::resources::{LaneWords, SampleRequest, TexelRequest};

/// The image, sampler and position of a read.
struct Reader<'a> {
    surface: &'a Surface,
    sampler: &'a Sampler,
    /// The border colour in the form of a texel.
    border: [u32; 4],
    /// The reference value of a comparison.
    reference: Option<f32>,
    level: usize,
    layer: u32,
}

/// Samples or gathers for every lane of the mask.
pub(super) fn sample(surface: &Surface, sampler: &Sampler, request: &SampleRequest) -> [LaneWords; 4] {
    let selection = lod::select(surface, sampler, request);
    let border = border_texel(surface, sampler);
    let mut out = [[0; VECTOR_LANES]; 4];
    for lane in (0..VECTOR_LANES).filter(|lane| request.mask >> lane & 1 != 0) {
        let mut reader = Reader {
            surface,
            sampler,
            border,
            reference: reference(surface, sampler, request, lane),
            level: selection.high[lane] as usize,
            layer: 0,
        };
        let texel = if let Some(component) = request.gather {
            reader.level = 0;
            reader.footprint(request, lane, Filter::Linear).gather(&reader, component)
        } else {
            let filter = selection.filter[lane];
            let mut texel = reader.footprint(request, lane, filter).filter(&reader);
            let weight = selection.weight[lane];
            if weight > 0.0 {
                reader.level = selection.low[lane] as usize;
                let low = reader.footprint(request, lane, filter).filter(&reader);
                texel = mix(sampler.reduction, texel, low, weight);
            }
            surface.swizzled(texel)
        };
        for (out, component) in out.iter_mut().zip(texel) {
            out[lane] = component;
        }
    }
    out
}

/// The reference value of a lane, if the sampler and the request compare.
fn reference(surface: &Surface, sampler: &Sampler, request: &SampleRequest, lane: usize) -> Option<f32> {
    sampler.compare_op?;
    let unorm = surface.format.numeric() == Numeric::Unorm;
    Some(reference_value(unorm, request.compare?[lane]))
}

/// A reference value from its bits. It is clamped for unsigned normalized formats.
#[inline(always)]
pub(super) fn reference_value(unorm: bool, bits: u32) -> f32 {
    let reference = f32::from_bits(bits);
    if unorm { reference.clamp(0.0, 1.0) } else { reference }
}

/// The border colour in the form of a texel. Components that the format lacks are 0, and alpha is 1.
pub(super) fn border_texel(surface: &Surface, sampler: &Sampler) -> [u32; 4] {
    let BorderColor([r, g, b, a]) = sampler.border_color;
    let format = surface.format;
    let or = |channels: &[Channel], value: u32, otherwise: u32| {
        let has = channels.iter().any(|channel| format.has(*channel));
        if has { value } else { otherwise }
    };
    [
        or(&[Channel::R, Channel::D, Channel::S], r, 0),
        or(&[Channel::G], g, 0),
        or(&[Channel::B], b, 0),
        or(&[Channel::A], a, surface.one()),
    ]
}

/// The texels around a point in one level.
enum Footprint {
    /// The texels of an image with edges, along x, y and z.
    Grid { axes: [Taps; 3], filters: [Filter; 3] },
    /// The texels of a cube: the face, the first texel, and weights.
    Cube { face: u32, first: [i32; 2], weights: [f32; 2], filter: Filter },
}

impl Reader<'_> {
    /// The texels for a lane's coordinates. It also sets the layer.
    fn footprint(&mut self, request: &SampleRequest, lane: usize, filter: Filter) -> Footprint {
        let coordinate = request.coordinate.map(|lanes| f32::from_bits(lanes[lane]));
        let dimension = request.shape.dimension;
        let count = dimension.coordinates();
        let layers = self.surface.layers;
        let layer = |layers| {
            if request.shape.arrayed { addressing::layer(coordinate[count], layers) } else { 0 }
        };
        let extent = self.surface.levels[self.level].extent;
        if dimension == Dimension::Cube {
            let hit = cube::Hit::new([coordinate[0], coordinate[1], coordinate[2]]);
            self.layer = 6 * layer(layers / 6);
            if self.sampler.has_seams {
                self.layer += hit.face;
                return self.grid(&hit.coordinates(), [0; 3], filter);
            }
            let taps = hit.coordinates().map(|s| {
                let u = addressing::texel_coordinate(AddressMode::ClampToEdge, s, true, extent[0]);
                addressing::first_texel(filter, u)
            });
            return Footprint::Cube {
                face: hit.face,
                first: taps.map(|(first, _)| first),
                weights: taps.map(|(_, weight)| weight),
                filter,
            };
        }
        self.layer = layer(layers);
        let offset = [0, 1, 2].map(|axis: usize| request.offset[axis][lane].cast_signed());
        self.grid(&coordinate[..count], offset, filter)
    }

    /// The texels of coordinates, of which there are as many as the image has axes.
    fn grid(&self, coordinate: &[f32], offset: [i32; 3], filter: Filter) -> Footprint {
        let extent = self.surface.levels[self.level].extent;
        let axis = |axis: usize| {
            let Some(coordinate) = coordinate.get(axis) else {
                return (Taps::FLAT, Filter::Nearest);
            };
            let taps = Taps::new(
                self.sampler.address_modes[axis],
                filter,
                *coordinate,
                !self.sampler.unnormalized_coordinates,
                extent[axis],
                offset[axis],
            );
            (taps, filter)
        };
        let axes = [0, 1, 2].map(axis);
        Footprint::Grid { axes: axes.map(|(taps, _)| taps), filters: axes.map(|(_, filter)| filter) }
    }

    /// A texel or the border colour. If a comparison is requested, red is its result.
    fn texel(&self, at: [Option<u32>; 3], layer: u32) -> [u32; 4] {
        let texel = match at {
            [Some(x), Some(y), Some(z)] => {
                let place = Texel { at: [x, y, z], layer, sample: 0 };
                self.surface.texel(self.level, place).unwrap_or_default()
            }
            _ => self.border,
        };
        match (self.reference, self.sampler.compare_op) {
            (Some(reference), Some(op)) => {
                let passes = op.holds(reference, f32::from_bits(texel[0]));
                let depth = if passes { 1f32 } else { 0.0 };
                [depth.to_bits(), texel[1], texel[2], texel[3]]
            }
            _ => texel,
        }
    }

    /// A texel of a cube's face, or the one that replaces it beyond an edge.
    fn cube_texel(&self, face: u32, at: [i32; 2]) -> [u32; 4] {
        let size = self.surface.levels[self.level].extent[0];
        let (texels, count) = cube::texels(face, at, size);
        let texel = |(face, [x, y]): (u32, [u32; 2])| self.texel([Some(x), Some(y), Some(0)], self.layer + face);
        if count == 1 || self.surface.is_integer() {
            return texel(texels[0]);
        }
        let [a, b, c] = texels.map(|place| texel(place).map(f32::from_bits));
        let reduce: fn([f32; 3]) -> f32 = match self.sampler.reduction {
            Reduction::WeightedAverage => |[a, b, c]| (a + b + c) / 3.0,
            Reduction::Min => |[a, b, c]| least(least(a, b), c),
            Reduction::Max => |[a, b, c]| greatest(greatest(a, b), c),
        };
        std::array::from_fn(|component| reduce([a[component], b[component], c[component]]).to_bits())
    }
}

impl Footprint {
    /// The weighted mean, or another reduction, of the texels.
    fn filter(&self, reader: &Reader<'_>) -> [u32; 4] {
        let reduction = reader.sampler.reduction;
        match self {
            Self::Grid { axes, filters } => {
                let [x, y, z] = axes;
                let row = |j: usize, k: usize| {
                    let texel = |i: usize| reader.texel([x.index[i], y.index[j], z.index[k]], reader.layer);
                    along(reduction, filters[0], x.weight, texel)
                };
                let slice = |k: usize| along(reduction, filters[1], y.weight, |j| row(j, k));
                along(reduction, filters[2], z.weight, slice)
            }
            Self::Cube { face, first: [i, j], weights, filter: Filter::Linear } => {
                let row = |dj: usize| {
                    along(reduction, Filter::Linear, weights[0], |di| {
                        reader.cube_texel(*face, [i + di as i32, j + dj as i32])
                    })
                };
                along(reduction, Filter::Linear, weights[1], row)
            }
            Self::Cube { face, first, .. } => {
                let last = reader.surface.levels[reader.level].extent[0] as i32 - 1;
                reader.cube_texel(*face, first.map(|index| index.clamp(0, last)))
            }
        }
    }

    /// One component of the four texels, counter-clockwise from the lower left one.
    fn gather(&self, reader: &Reader<'_>, component: u8) -> [u32; 4] {
        [[0, 1], [1, 1], [1, 0], [0, 0]].map(|[di, dj]: [usize; 2]| {
            let texel = match self {
                Self::Grid { axes, .. } => {
                    let [x, y, z] = axes;
                    reader.texel([x.index[di], y.index[dj], z.index[0]], reader.layer)
                }
                Self::Cube { face, first: [i, j], .. } => reader.cube_texel(*face, [i + di as i32, j + dj as i32]),
            };
            reader.surface.component(&texel, component)
        })
    }
}

/// Filters two texels along an axis, or takes the first.
fn along(reduction: Reduction, filter: Filter, weight: f32, texel: impl Fn(usize) -> [u32; 4]) -> [u32; 4] {
    match filter {
        Filter::Nearest => texel(0),
        Filter::Linear => mix(reduction, texel(0), texel(1), weight),
    }
}

/// The weighted mean of two texels, or the least or the greatest of those that have a weight.
fn mix(reduction: Reduction, a: [u32; 4], b: [u32; 4], weight: f32) -> [u32; 4] {
    let pairs = |reduce: fn(f32, f32) -> f32| {
        std::array::from_fn(|component| {
            let (a, b) = (f32::from_bits(a[component]), f32::from_bits(b[component]));
            reduce(a, b).to_bits()
        })
    };
    match reduction {
        Reduction::WeightedAverage => std::array::from_fn(|component| {
            let (a, b) = (f32::from_bits(a[component]), f32::from_bits(b[component]));
            (a + weight * (b - a)).to_bits()
        }),
        _ if weight == 0.0 => a,
        Reduction::Min => pairs(least),
        Reduction::Max => pairs(greatest),
    }
}

/// The position of the texel that a lane accesses.
fn place(shape: ImageShape, request: &TexelRequest, lane: usize) -> Texel {
    let [x, y, z, w] = request.coordinate.map(|lanes| lanes[lane]);
    let (at, layer) = match (shape.dimension, shape.arrayed) {
        (Dimension::Buffer, _) | (Dimension::D1, false) => ([x, 0, 0], 0),
        (Dimension::D1, true) => ([x, 0, 0], y),
        (Dimension::D2, false) => ([x, y, 0], 0),
        (Dimension::D2, true) | (Dimension::Cube, _) => ([x, y, 0], z),
        (Dimension::D3, false) => ([x, y, z], 0),
        (Dimension::D3, true) => ([x, y, z], w),
    };
    let sample = if shape.multisampled { request.sample[lane] } else { 0 };
    Texel { at, layer, sample }
}

/// The active lanes, in order.
fn lanes(request: &TexelRequest) -> impl Iterator<Item = usize> {
    let mask = request.mask;
    (0..VECTOR_LANES).filter(move |lane| mask >> lane & 1 != 0)
}

/// Reads texels. Those of the active lanes are decoded together.
pub(super) fn read(surface: &Surface, request: &TexelRequest) -> [LaneWords; 4] {
    let mut out = [[0; VECTOR_LANES]; 4];
    let mut put = |lane: usize, texel: [u32; 4]| {
        for (out, component) in out.iter_mut().zip(surface.swizzled(texel)) {
            out[lane] = component;
        }
    };
    let size = surface.texel_size;
    let mut bytes = [0; VECTOR_LANES * MAX_TEXEL_SIZE];
    let mut read = [0; VECTOR_LANES];
    let mut count = 0;
    for lane in lanes(request) {
        let texel = place(request.shape, request, lane);
        let offset = surface.offset(request.level[lane] as usize, texel);
        let into = &mut bytes[size * count..][..size];
        match offset.and_then(|offset| load(surface, offset, into)) {
            Some(()) => {
                read[count] = lane;
                count += 1;
            }
            None => put(lane, surface.outside()),
        }
    }
    let mut texels = [[0.0; 4]; VECTOR_LANES];
    surface.format.decode_row(&bytes[..size * count], &mut texels);
    for (lane, texel) in read[..count].iter().zip(texels) {
        put(*lane, texel.map(f32::to_bits));
    }
    out
}

/// Writes texels, which are encoded together. Nothing is written to a surface that is not writable.
pub(super) fn write(surface: &Surface, request: &TexelRequest, texel: &[LaneWords; 4]) {
    if !surface.writable {
        return;
    }
    let mut offsets = [0; VECTOR_LANES];
    let mut texels = [[0.0; 4]; VECTOR_LANES];
    let mut count = 0;
    for lane in lanes(request) {
        if let Some(offset) = surface.offset(0, place(request.shape, request, lane)) {
            offsets[count] = offset;
            texels[count] = texel.map(|lanes| f32::from_bits(lanes[lane]));
            count += 1;
        }
    }
    let size = surface.texel_size;
    let mut bytes = [0; VECTOR_LANES * MAX_TEXEL_SIZE];
    surface.format.encode_row(&texels[..count], &mut bytes[..size * count]);
    for (offset, bytes) in offsets[..count].iter().zip(bytes.chunks_exact(size)) {
        store(surface, *offset, bytes);
    }
}

/// Loads a texel's bytes; `None` if they are not all in memory.
fn load(surface: &Surface, offset: u64, into: &mut [u8]) -> Option<()> {
    let memory = &surface.memory;
    match into.len() {
        4 if offset.is_multiple_of(4) => {
            into.copy_from_slice(&memory.load_u32(offset)?.to_le_bytes());
        }
        8 if offset.is_multiple_of(8) => {
            into.copy_from_slice(&memory.load_u64(offset)?.to_le_bytes());
        }
        _ => memory.read(offset, into).ok()?,
    }
    Some(())
}

/// Stores a texel's bytes. A texel of at most 8 bytes, if their number is a power of two, is stored atomically.
fn store(surface: &Surface, offset: u64, bytes: &[u8]) {
    let memory = &surface.memory;
    let stored = match *bytes {
        [a] => memory.store_u8(offset, a),
        [a, b] => memory.store_u16(offset, u16::from_le_bytes([a, b])),
        [a, b, c, d] => memory.store_u32(offset, u32::from_le_bytes([a, b, c, d])),
        [a, b, c, d, e, f, g, h] => memory.store_u64(offset, u64::from_le_bytes([a, b, c, d, e, f, g, h])),
        _ => None,
    };
    if stored.is_none() {
        // The offset lies in the surface, so that this cannot fail.
        let _ = memory.write(offset, bytes);
    }
}

/// Updates texels of one 32-bit component, and returns the old values. For other formats it returns zero and changes
/// nothing.
pub(super) fn atomic(
    surface: &Surface,
    request: &TexelRequest,
    op: AtomicOp,
    value: &LaneWords,
    comparator: &LaneWords,
) -> LaneWords {
    let mut old = [0; VECTOR_LANES];
    let one_word = surface.texel_size == 4 && surface.format.components().len() == 1;
    if !surface.writable || !one_word {
        return old;
    }
    for lane in lanes(request) {
        let texel = place(request.shape, request, lane);
        let changed = surface.offset(0, texel).and_then(|offset| {
            surface.memory.update_u32(offset, |old| {
                let (value, comparator) = (u64::from(value[lane]), u64::from(comparator[lane]));
                combine(op, Word::B32, u64::from(old), value, comparator) as u32
            })
        });
        old[lane] = changed.unwrap_or(0);
    }
    old
}
