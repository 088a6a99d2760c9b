//! Samples of one- and two-dimensional images and arrays of them, 16 lanes at once. The bits are those of
//! [`super::filter`], which does everything else; nothing here is fused, so that every SIMD level gives them.

use std::sync::atomic::AtomicU32;

use fearless_simd::{Simd, f32x16, i32x16, mask32x16, prelude::*, u32x16};

use super::address::{FAR, MAX_OFFSET, WHOLE, layer};
use super::filter::border_texel;
use super::lod::{self, Selection};
use super::packing::{
    Float16x4, Float32, Float32x4, Kind, Packing, Srgb8x4, Texels, Unorm8, Unorm8x2, Unorm8x4,
    Unorm16,
};
use super::sampler::{AddressMode, CompareOp, Filter, Sampler};
use super::surface::Surface;
use crate::format::Numeric;
use crate::isa::ir::{CHUNK_LANES, Dimension};
use crate::isa::resources::{Lanes, SampleRequest};

/// Whether 16 lanes of such a request can be done at once.
pub(super) fn handles(request: &SampleRequest) -> bool {
    let shape = request.shape;
    matches!(shape.dimension, Dimension::D1 | Dimension::D2)
        && !shape.multisampled
        && request.gather.is_none()
}

/// Filters for all lanes.
#[inline(always)]
pub(super) fn sample<S: Simd>(
    simd: S,
    surface: &Surface,
    packing: &Packing,
    sampler: &Sampler,
    request: &SampleRequest,
) -> [Lanes; 4] {
    let selection = lod::select(surface, sampler, request);
    let batch = Batch {
        simd,
        surface,
        packing,
        words: packing.words(surface),
        sampler,
        request,
    };
    let texel = match packing.kind {
        Kind::Unorm8 => batch.select_filter::<Unorm8>(&selection),
        Kind::Unorm8x2 => batch.select_filter::<Unorm8x2>(&selection),
        Kind::Unorm8x4 => batch.select_filter::<Unorm8x4>(&selection),
        Kind::Srgb8x4 => batch.select_filter::<Srgb8x4>(&selection),
        Kind::Unorm16 => batch.select_filter::<Unorm16>(&selection),
        Kind::Float16x4 => batch.select_filter::<Float16x4>(&selection),
        Kind::Float32 => batch.select_filter::<Float32>(&selection),
        Kind::Float32x4 => batch.select_filter::<Float32x4>(&selection),
    };
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    surface.swizzle.map(|from| {
        let component = from.pick(&texel, zero, one);
        component.bitcast::<u32x16<S>>().into()
    })
}

/// The texels of 16 coordinates along one axis.
#[derive(Clone, Copy)]
struct Axis<S: Simd> {
    index: [u32x16<S>; 2],
    /// Lanes whose texel the image has; if there is a border at all.
    inside: Option<[mask32x16<S>; 2]>,
    weight: f32x16<S>,
}

/// A mip level for each lane.
#[derive(Clone, Copy)]
struct Place<S: Simd> {
    size: [f32x16<S>; 2],
    /// The first texel of the lane's layer.
    base: u32x16<S>,
    row_pitch: u32x16<S>,
}

#[derive(Clone, Copy)]
struct Batch<'a, S> {
    simd: S,
    surface: &'a Surface,
    packing: &'a Packing,
    words: &'a [AtomicU32],
    sampler: &'a Sampler,
    request: &'a SampleRequest,
}

/// The greatest integers that aren't greater; of numbers within 2^30.
#[inline(always)]
fn floor<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
    let truncated = f32x16::float_from(i32x16::truncate_from(x));
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    truncated - truncated.simd_gt(x).select(one, zero)
}

/// `x` within a magnitude.
#[inline(always)]
fn clamp<S: Simd>(x: f32x16<S>, magnitude: f32) -> f32x16<S> {
    x.max(-magnitude).min(magnitude)
}

/// The weighted mean.
#[inline(always)]
fn mix<S: Simd>(a: f32x16<S>, b: f32x16<S>, weight: f32x16<S>) -> f32x16<S> {
    a + weight * (b - a)
}

/// An index reduced to 0.. of a period; if it isn't `far`, it is known to be within a period of that.
#[inline(always)]
fn reduce<S: Simd>(simd: S, i: f32x16<S>, period: f32x16<S>, far: bool) -> f32x16<S> {
    let zero = f32x16::splat(simd, 0.0);
    let i = if far {
        i - floor(simd, i / period) * period
    } else {
        i
    };
    let i = i + i.simd_lt(zero).select(period, zero);
    i - i.simd_ge(period).select(period, zero)
}

impl<S: Simd> Batch<'_, S> {
    /// Red, green, blue and alpha, with the filter that each lane asks for.
    #[inline(always)]
    fn select_filter<P: Texels>(&self, selection: &Selection) -> [f32x16<S>; 4] {
        let simd = self.simd;
        let linear = selection
            .filter
            .map(|filter| u32::from(filter == Filter::Linear));
        let count: u32 = linear.iter().sum();
        let texel = match count {
            0 => self.select_levels::<P>(selection, Filter::Nearest),
            16 => self.select_levels::<P>(selection, Filter::Linear),
            _ => {
                let nearest = self.select_levels::<P>(selection, Filter::Nearest);
                let mixed = self.select_levels::<P>(selection, Filter::Linear);
                let linear = u32x16::simd_from(simd, linear).simd_gt(u32x16::splat(simd, 0));
                std::array::from_fn(|c| linear.select(mixed[c], nearest[c]))
            }
        };
        let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
        std::array::from_fn(|register| match self.packing.order[register] {
            stored if stored < P::COMPONENTS => texel[stored],
            _ if register == 3 => one,
            _ => zero,
        })
    }

    /// The stored components, mixed between levels.
    #[inline(always)]
    fn select_levels<P: Texels>(&self, selection: &Selection, filter: Filter) -> [f32x16<S>; 4] {
        let simd = self.simd;
        let high = self.filter_level::<P>(&selection.high, filter);
        let weight = f32x16::simd_from(simd, selection.weight);
        let between = weight.simd_gt(f32x16::splat(simd, 0.0));
        if !between.any_true() {
            return high;
        }
        let low = self.filter_level::<P>(&selection.low, filter);
        let mut texel = high;
        for c in 0..P::COMPONENTS {
            texel[c] = between.select(mix(high[c], low[c], weight), high[c]);
        }
        texel
    }

    /// The stored components, of one level for each lane.
    #[inline(always)]
    fn filter_level<P: Texels>(
        &self,
        levels: &[u32; CHUNK_LANES],
        filter: Filter,
    ) -> [f32x16<S>; 4] {
        let place = self.place(levels);
        let x = self.axis(0, filter, place.size[0]);
        let y = if self.request.shape.dimension == Dimension::D1 {
            let (zero, all) = (f32x16::splat(self.simd, 0.0), u32x16::splat(self.simd, 0));
            Axis {
                index: [all; 2],
                inside: None,
                weight: zero,
            }
        } else {
            self.axis(1, filter, place.size[1])
        };
        let row = |j: usize| place.base + y.index[j] * place.row_pitch;
        let top = row(0);
        let at = |row: u32x16<S>, i: usize, j: usize| {
            let texel = P::load(self.simd, self.words, row + x.index[i]);
            self.finish::<P>(texel, &x, &y, i, j)
        };
        match filter {
            Filter::Nearest => at(top, 0, 0),
            Filter::Linear => {
                let mut texel = at(top, 0, 0);
                let right = at(top, 1, 0);
                for c in 0..P::COMPONENTS {
                    texel[c] = mix(texel[c], right[c], x.weight);
                }
                if self.request.shape.dimension == Dimension::D1 {
                    return texel;
                }
                let bottom = row(1);
                let (left, right) = (at(bottom, 0, 1), at(bottom, 1, 1));
                for c in 0..P::COMPONENTS {
                    texel[c] = mix(texel[c], mix(left[c], right[c], x.weight), y.weight);
                }
                texel
            }
        }
    }

    /// The border and the comparison.
    #[inline(always)]
    fn finish<P: Texels>(
        &self,
        mut texel: [f32x16<S>; 4],
        x: &Axis<S>,
        y: &Axis<S>,
        i: usize,
        j: usize,
    ) -> [f32x16<S>; 4] {
        let inside = match (&x.inside, &y.inside) {
            (Some(x), Some(y)) => Some(x[i] & y[j]),
            (Some(x), None) => Some(x[i]),
            (None, Some(y)) => Some(y[j]),
            (None, None) => None,
        };
        if let Some(inside) = inside {
            let border = border_texel(self.surface, self.sampler).map(f32::from_bits);
            for (register, stored) in self.packing.order.into_iter().enumerate() {
                if stored < P::COMPONENTS {
                    let border = f32x16::splat(self.simd, border[register]);
                    texel[stored] = inside.select(texel[stored], border);
                }
            }
        }
        if let (Some(op), Some(reference)) = (self.sampler.compare_op, self.request.compare) {
            texel[0] = self.compare(op, reference, texel[0]);
        }
        texel
    }

    /// 1 where a comparison holds, else 0.
    #[inline(always)]
    fn compare(&self, op: CompareOp, reference: Lanes, texel: f32x16<S>) -> f32x16<S> {
        let simd = self.simd;
        let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
        let mut reference: f32x16<S> = u32x16::simd_from(simd, reference).bitcast();
        if self.surface.format.numeric() == Numeric::Unorm {
            reference = reference.simd_gt(one).select(one, reference);
            reference = reference.simd_lt(zero).select(zero, reference);
        }
        match op {
            CompareOp::Never => zero,
            CompareOp::Less => reference.simd_lt(texel).select(one, zero),
            CompareOp::Equal => reference.simd_eq(texel).select(one, zero),
            CompareOp::LessOrEqual => reference.simd_le(texel).select(one, zero),
            CompareOp::Greater => reference.simd_gt(texel).select(one, zero),
            CompareOp::NotEqual => reference.simd_eq(texel).select(zero, one),
            CompareOp::GreaterOrEqual => reference.simd_ge(texel).select(one, zero),
            CompareOp::Always => one,
        }
    }

    /// Where the lanes' levels and layers lie.
    #[inline(always)]
    fn place(&self, levels: &[u32; CHUNK_LANES]) -> Place<S> {
        let simd = self.simd;
        let table = &self.packing.levels;
        let first = &table[levels[0] as usize];
        let uniform = levels.iter().all(|level| *level == levels[0]);
        let (mut place, layer_pitch) = if uniform {
            let place = Place {
                size: [first.width, first.height].map(|size| f32x16::splat(simd, size)),
                base: u32x16::splat(simd, first.base),
                row_pitch: u32x16::splat(simd, first.row_pitch),
            };
            (place, u32x16::splat(simd, first.layer_pitch))
        } else {
            let of = levels.map(|level| &table[level as usize]);
            let place = Place {
                size: [
                    f32x16::simd_from(simd, of.map(|level| level.width)),
                    f32x16::simd_from(simd, of.map(|level| level.height)),
                ],
                base: u32x16::simd_from(simd, of.map(|level| level.base)),
                row_pitch: u32x16::simd_from(simd, of.map(|level| level.row_pitch)),
            };
            let layer_pitch = of.map(|level| level.layer_pitch);
            (place, u32x16::simd_from(simd, layer_pitch))
        };
        if self.request.shape.arrayed && self.surface.layers > 1 {
            let coordinate = self.request.coordinate[self.request.shape.dimension.coordinates()];
            let layers = coordinate.map(|bits| layer(f32::from_bits(bits), self.surface.layers));
            place.base = place.base + u32x16::simd_from(simd, layers) * layer_pitch;
        }
        place
    }

    /// The texels of the lanes' coordinates along an axis.
    #[inline(always)]
    fn axis(&self, axis: usize, filter: Filter, size: f32x16<S>) -> Axis<S> {
        let simd = self.simd;
        let mode = self.sampler.address_modes[axis];
        let zero = f32x16::splat(simd, 0.0);
        let half = f32x16::splat(simd, 0.5);
        let coordinate: f32x16<S> =
            u32x16::simd_from(simd, self.request.coordinate[axis]).bitcast();
        let u = self.texel_coordinate(mode, coordinate, size);
        let shifted = match filter {
            Filter::Nearest => u,
            Filter::Linear => u - half,
        };
        let whole = floor(simd, shifted);
        let weight = shifted - whole;
        let offsets = &self.request.offset[axis];
        let far = self.sampler.unnormalized_coordinates || *offsets != [0; CHUNK_LANES];
        let first = if far {
            let clamped =
                offsets.map(|offset| offset.cast_signed().clamp(-MAX_OFFSET, MAX_OFFSET) as f32);
            whole + f32x16::simd_from(simd, clamped)
        } else {
            whole
        };
        let steps = [first, first + 1.0];
        let last = size - 1.0;
        let clamped = |i: f32x16<S>| i.max(zero).min(last);
        let inside = (mode == AddressMode::ClampToBorder)
            .then(|| steps.map(|i| i.simd_ge(zero) & i.simd_le(last)));
        let index = steps.map(|i| {
            let wrapped = match mode {
                AddressMode::Repeat => reduce(simd, i, size, far),
                AddressMode::MirroredRepeat => {
                    let period = size + size;
                    let within = reduce(simd, i, period, far);
                    within.min(period - 1.0 - within)
                }
                AddressMode::ClampToEdge | AddressMode::ClampToBorder => clamped(i),
                AddressMode::MirrorClampToEdge => {
                    clamped(i.simd_lt(zero).select(zero - 1.0 - i, i))
                }
            };
            i32x16::truncate_from(wrapped).bitcast::<u32x16<S>>()
        });
        Axis {
            index,
            inside,
            weight,
        }
    }

    /// As [`super::address::texel_coordinate`].
    #[inline(always)]
    fn texel_coordinate(
        &self,
        mode: AddressMode,
        coordinate: f32x16<S>,
        size: f32x16<S>,
    ) -> f32x16<S> {
        let simd = self.simd;
        let zero = f32x16::splat(simd, 0.0);
        let s = coordinate.simd_eq(coordinate).select(coordinate, zero);
        match mode {
            _ if self.sampler.unnormalized_coordinates => clamp(s, FAR),
            AddressMode::Repeat => {
                let s = clamp(s, WHOLE);
                (s - floor(simd, s)) * size
            }
            AddressMode::MirroredRepeat => {
                let half = clamp(s, WHOLE) * 0.5;
                (half - floor(simd, half)) * 2.0 * size
            }
            _ => clamp(s * size, FAR),
        }
    }
}
