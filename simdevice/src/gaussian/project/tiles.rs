//! The search for the tiles that a group's kept Gaussians reach: for several Gaussians at once if they are small, as
//! most are; for several rows of one Gaussian at once if it is tall; and one at a time otherwise.
//!
//! Several at once are searched in binary32. An ellipse is made larger by a bound of all rounding errors, so that no
//! tile is missed; [the derivation](../../../../docs/precision.md) is in the documentation. Ellipses for which the bound
//! does not hold are searched one at a time, in binary64.

use super::panorama;
use super::scratch::Scratch;
use super::screen::ScreenGaussians;
use super::surfel::surfel_of;
use super::tile_cut_off::clip;
use crate::gaussian::lanes::{Bits, GroupF64};
use crate::gaussian::splats::footprint::{FIRST_TILE_BITS, HELD_ROWS, PackedSpan, TileFootprint, TileSpan};
use crate::gaussian::splats::group::ProjectedGroup;
use crate::gaussian::view::constants::ViewConstants;
use crate::limits::TILE_SIZE;
use crate::simd::both;
use crate::state::gaussian::GaussianGeometry;
use crate::stats::counters::{Counter, Counters};
use crate::stats::optimizations::Optimization;
use fearless_simd::{Simd, prelude::*};
use isa::float::{self, FusedMultiply};

#[cfg(test)]
mod tests;

/// The sum of this and a whole number below it has the number in its low bits.
const POINT: f32 = (1u32 << 23) as f32;

/// The bound of the errors of an ellipse's places in pixels, relative to its size plus one pixel.
const MARGIN: f32 = 1.0 / (1u32 << 19) as f32;

/// The greatest size that is searched in binary32: the distance from the origin to the farthest point, at most.
const MOST_SIZE: f32 = (1u32 << 17) as f32;

/// The least variance in px^2, and the least determinant in px^4, that are searched in binary32. No intermediate result
/// overflows or underflows.
const LEAST_VARIANCE: f32 = 1.0 / (1u64 << 40) as f32;

/// The result of searching several lanes at once.
struct Found {
    /// The lanes that reach tiles. Their footprints are in the scratch's `reaches`.
    reached: Bits,
    /// The lanes that may reach more rows of tiles than a [`TileFootprint`] stores inline.
    tall: Bits,
    /// The lanes that must be searched one at a time.
    left: Bits,
}

/// The first and the last pixel along an axis, and their tiles.
struct Range<S: Simd> {
    low: S::f32s,
    high: S::f32s,
    first: S::f32s,
    last: S::f32s,
    /// True if there are pixels.
    any: S::mask32s,
}

impl<S: Simd> Range<S> {
    /// The integers of `first..=last` whose pixel centres are between `low` and `high`, in the same steps as in
    /// [`ellipse`](crate::gaussian::splats::ellipse).
    #[inline(always)]
    fn new(low: S::f32s, high: S::f32s, [first, last]: [S::f32s; 2]) -> Self {
        let low = float::ceil(low - 0.5).max(first);
        let high = float::floor(high - 0.5).min(last);
        let per_pixel = 1.0 / TILE_SIZE as f32;
        let [first, last] = [float::floor(low * per_pixel), float::floor(high * per_pixel)];
        Self { low, high, first, last, any: low.simd_le(high) }
    }

    /// The number of tiles.
    #[inline(always)]
    fn tiles(&self) -> S::f32s {
        self.last - self.first + 1.0
    }
}

/// Whole numbers below [`POINT`] as integers.
#[inline(always)]
fn integers<S: Simd>(simd: S, values: S::f32s) -> S::u32s {
    let point = S::f32s::splat(simd, POINT);
    (values + point).bitcast::<S::u32s>() - point.bitcast::<S::u32s>()
}

/// The bits of [`PackedSpan`]s of a number of tiles from a first one on.
#[inline(always)]
fn spans<S: Simd>(simd: S, first: S::f32s, tiles: S::f32s) -> S::u32s {
    integers(simd, first) | (integers(simd, tiles) << FIRST_TILE_BITS)
}

/// Covariances in the picture and where they are cut off: see [`ScreenGaussians`].
struct Shapes<S: Simd> {
    mean: [S::f32s; 2],
    covariance: [S::f32s; 3],
    determinant: S::f32s,
    extent: S::f32s,
}

impl<S: Simd> Shapes<S> {
    /// The shapes that `load` finds in the arrays of all lanes.
    #[inline(always)]
    fn new(screen: &ScreenGaussians, load: impl Fn(&GroupF64) -> S::f32s) -> Self {
        let ([x, y], [xx, xy, yy]) = (&screen.mean, &screen.covariance);
        Self {
            mean: [load(x), load(y)],
            covariance: [load(xx), load(xy), load(yy)],
            determinant: load(&screen.determinant),
            extent: load(&screen.extent),
        }
    }
}

/// Ellipses whose tiles are searched row by row; see [`Ellipse`](crate::gaussian::splats::ellipse::Ellipse). They are larger than the
/// exact ones by more than all rounding errors.
struct Ellipses<S: Simd> {
    mean: [S::f32s; 2],
    slope: S::f32s,
    narrowing: S::f32s,
    peak: S::f32s,
    /// The square of the half extent in y.
    square: S::f32s,
    /// The bound of the errors of the columns.
    margin: S::f32s,
    /// The columns of pixels.
    across: Range<S>,
    /// The rows of pixels.
    along: Range<S>,
    /// The first and the last visible column of pixels.
    columns: [S::f32s; 2],
    /// True if there is an ellipse: the square root of a negative extent is NaN.
    exists: S::mask32s,
    /// True if the bound of the errors holds.
    is_moderate: S::mask32s,
}

/// The columns that ellipses reach in a row of tiles.
struct RowColumns<S: Simd> {
    range: Range<S>,
    /// True if the row belongs to the ellipse and the ellipse reaches a pixel centre there.
    within: S::mask32s,
}

impl<S: Simd> Ellipses<S> {
    /// The ellipses of some shapes.
    #[inline(always)]
    fn new(view: &ViewConstants, simd: S, shapes: &Shapes<S>) -> Self {
        let number = |value: f32| S::f32s::splat(simd, value);
        let pixels = |axis| both(view.visible.pixels(axis), |pixel| number(pixel as f32));
        let (columns, rows) = (pixels(0), pixels(1));
        let ([x, y], [a, b, c]) = (shapes.mean, shapes.covariance);
        let (per_a, per_c) = (number(1.0) / a, number(1.0) / c);
        let (half_x, half_y) = ((a * shapes.extent).sqrt(), (c * shapes.extent).sqrt());
        let size = x.abs() + y.abs() + half_x + half_y;
        let least = a.min(c).min(shapes.determinant);
        let slope = b * per_c;
        let margin = size * MARGIN + MARGIN;
        let (wide, tall) = (half_x + margin, half_y + margin);
        // See the derivation for the factor.
        let rise = half_y + margin * 3.0;
        Self {
            mean: [x, y],
            slope,
            narrowing: shapes.determinant * per_c * per_c,
            peak: b * per_a * half_x,
            square: rise * rise,
            margin: slope.abs().fused_add(margin, margin),
            across: Range::new(x - wide, x + wide, columns),
            along: Range::new(y - tall, y + tall, rows),
            columns,
            exists: half_y.simd_ge(0.0),
            is_moderate: size.simd_le(MOST_SIZE) & least.simd_ge(LEAST_VARIANCE),
        }
    }

    /// The columns that each ellipse reaches in a row of tiles. The steps are those of
    /// [`Ellipse::reach`](crate::gaussian::splats::ellipse::Ellipse::reach).
    #[inline(always)]
    fn row(&self, simd: S, row: S::f32s) -> RowColumns<S> {
        let number = |value: f32| S::f32s::splat(simd, value);
        let (zero, tile) = (number(0.0), TILE_SIZE as f32);
        let [x, y] = self.mean;
        let row_top = row * tile;
        let above = self.along.low.max(row_top) + 0.5 - y;
        let below = self.along.high.min(row_top + (tile - 1.0)) + 0.5 - y;
        // Each side is monotonic above and below its furthest point, at height -peak and peak.
        let to_left = (zero - self.peak).max(above).min(below);
        let to_right = self.peak.max(above).min(below);
        let width = |height: S::f32s| {
            let square = height.fused_add(zero - height, self.square);
            (self.narrowing * square.max(zero)).sqrt() + self.margin
        };
        let low = x + (self.slope * to_left - width(to_left));
        let high = x + (self.slope * to_right + width(to_right));
        let range = Range::new(low, high, self.columns);
        let within = range.any & row.simd_le(self.along.last);
        RowColumns { range, within }
    }
}

/// The greatest binary64 number that rounds to a binary32 number of at most `value`.
fn last_rounded_to(value: f32) -> f64 {
    if value == f32::INFINITY {
        return f64::INFINITY;
    }
    // Numbers round to infinity from half a unit above the greatest binary32 number on.
    let wide = |value: f32| {
        if value.is_infinite() { libm::ldexp(1.0, 128).copysign(value.into()) } else { f64::from(value) }
    };
    let middle = 0.5 * (wide(value) + wide(value.next_up()));
    if middle as f32 <= value { middle } else { middle.next_down() }
}

/// Finds the kept Gaussians that reach a tile, and their footprints.
#[inline(always)]
pub(crate) fn find_tiles<S: Simd>(
    view: &ViewConstants,
    simd: S,
    scratch: &mut Scratch,
    projected: &mut ProjectedGroup,
) {
    let by_lanes = view.optimizations.has(Optimization::Ellipse)
        && view.period.is_none()
        && view.geometry == GaussianGeometry::Volume;
    find_tiles_by(view, simd, by_lanes, scratch, projected);
}

/// The body of [`find_tiles`]. If `by_lanes` is false, it searches one Gaussian at a time.
#[inline(always)]
fn find_tiles_by<S: Simd>(
    view: &ViewConstants,
    simd: S,
    by_lanes: bool,
    scratch: &mut Scratch,
    projected: &mut ProjectedGroup,
) {
    let drawn = find_drawn(view, simd, scratch, &mut projected.counters);
    let mut beside = 0;
    let found = if by_lanes {
        reach_in_lanes(view, simd, &drawn, scratch, &mut beside)
    } else {
        Found { reached: Bits::default(), tall: Bits::default(), left: drawn }
    };
    let Found { mut reached, tall, left } = found;
    tall.for_each(
        #[inline(always)]
        |at| {
            let spans = &mut projected.spans;
            if let Some(reach) = reach_by_rows(view, simd, at, scratch, spans, &mut beside) {
                scratch.reaches.set(at, &reach);
                reached.set_one(at, true);
            }
        },
    );
    projected.counters.add(Counter::TilesFoundWide, left.count());
    scratch.copies.clear();
    left.for_each(|at| {
        if let Some(reach) = reach_of_one(view, at, scratch, projected, &mut beside) {
            scratch.reaches.set(at, &reach);
            reached.set_one(at, true);
        }
    });
    if let Some(cut_off) = &view.list_cut_off {
        clip(view, cut_off, scratch, &mut projected.spans, &mut reached);
    }
    scratch.reached.clear();
    reached.for_each(|at| scratch.reached.push(at));
    let off_screen = drawn.without(&reached).count();
    projected.counters.add(Counter::SkippedOffScreen, off_screen);
    projected.counters.add(Counter::TilesBesideEllipse, beside);
}

/// The lanes that are between the near and far planes and have a positive definite covariance. Counts the reasons to
/// skip the others.
#[inline(always)]
fn find_drawn<S: Simd>(view: &ViewConstants, simd: S, scratch: &Scratch, counters: &mut Counters) -> Bits {
    let len = scratch.lanes.len();
    let number = |value: f64| S::f64s::splat(simd, value);
    let near = number(last_rounded_to(view.near));
    let before_far = number(last_rounded_to(view.far.next_down()));
    let (least, greatest) = (number(0.0), number(f64::MAX));
    let is_surfel = view.geometry == GaussianGeometry::Surfel;
    let [mut beyond_near, mut beyond_far, mut definite] = [Bits::default(); 3];
    for at in (0..len).step_by(S::f64s::LEN) {
        let load = |lanes: &GroupF64| S::f64s::from_slice(simd, &lanes[at..at + S::f64s::LEN]);
        let depth = load(&scratch.depth);
        let determinant = load(&scratch.screen.determinant);
        // Comparisons with NaN are false.
        beyond_near.set(at, depth.simd_gt(near));
        beyond_far.set(at, depth.simd_gt(before_far));
        definite.set(at, determinant.simd_gt(least) & determinant.simd_le(greatest));
    }
    if is_surfel {
        definite = Bits::first(len);
    }
    let kept = scratch.kept;
    let seen = kept.and(&beyond_near);
    counters.add(Counter::SkippedNear, kept.without(&seen).count());
    counters.add(Counter::SkippedFar, seen.and(&beyond_far).count());
    let seen = seen.without(&beyond_far);
    counters.add(Counter::SkippedDegenerate, seen.without(&definite).count());
    seen.and(&definite)
}

/// The footprints of the lanes of `drawn` that reach at most [`HELD_ROWS`] rows of tiles. The steps are those of
/// [`Ellipse::reach`](crate::gaussian::splats::ellipse::Ellipse::reach). Adds the number of tiles of bounding boxes that ellipses do
/// not reach to `beside`.
#[inline(always)]
fn reach_in_lanes<S: Simd>(
    view: &ViewConstants,
    simd: S,
    drawn: &Bits,
    scratch: &mut Scratch,
    beside: &mut u64,
) -> Found {
    let number = |value: f32| S::f32s::splat(simd, value);
    let (zero, one) = (number(0.0), number(1.0));
    let mut found = Found { reached: Bits::default(), tall: Bits::default(), left: Bits::default() };
    let mut apart = zero;
    for at in (0..scratch.lanes.len()).step_by(S::f32s::LEN) {
        let load = |lanes: &GroupF64| {
            let half = |at: usize| S::f64s::from_slice(simd, &lanes[at..at + S::f64s::LEN]);
            half(at).narrow(half(at + S::f64s::LEN))
        };
        let ellipses = Ellipses::<S>::new(view, simd, &Shapes::new(&scratch.screen, load));
        let drawn = S::mask32s::from_bitmask(simd, drawn.group(at, S::f32s::LEN));
        let drawn = drawn & ellipses.exists;
        let (across, along) = (&ellipses.across, &ellipses.along);
        let inside = drawn & ellipses.is_moderate & across.any & along.any;
        let (wide, tall) = (across.tiles(), along.tiles());
        let short = tall.simd_le(HELD_ROWS as f32);
        found.left.set(at, drawn & !ellipses.is_moderate);
        found.tall.set(at, inside & !short);
        let [first_row, last_row] = view.visible.pixels(1).map(|pixel| pixel as f32);
        let clipped = across.low.simd_eq(ellipses.columns[0])
            | across.high.simd_eq(ellipses.columns[1])
            | along.low.simd_eq(first_row)
            | along.high.simd_eq(last_row);
        let single = wide.simd_eq(one) & tall.simd_eq(one) & !clipped;
        let told = inside & short;

        let mut row = along.first;
        let mut reached = zero;
        let mut words = [S::u32s::splat(simd, 0); HELD_ROWS];
        for (number, word) in words.iter_mut().enumerate() {
            // Most have one or two rows.
            if !(told & row.simd_le(along.last)).any_true() {
                break;
            }
            let RowColumns { range: across_row, within } = ellipses.row(simd, row);
            let mut first = within.select(across_row.first, zero);
            let mut tiles = within.select(across_row.tiles(), zero);
            if number == 0 {
                first = single.select(across.first, first);
                tiles = single.select(one, tiles);
            }
            *word = spans(simd, first, tiles);
            reached += tiles;
            row += 1.0;
        }
        found.reached.set(at, told & reached.simd_gt(zero));
        let more = (wide * tall - reached).max(zero);
        apart += (told & !single).select(more, zero);

        let rows = integers(simd, along.first) | (integers(simd, tall) << 16);
        let [first, second, third] = words;
        // A lane's four words follow one another.
        let (rows, more_rows) = rows.interleave(second);
        let (others, more_others) = first.interleave(third);
        let (first, second) = rows.interleave(others);
        let (third, fourth) = more_rows.interleave(more_others);
        let words = scratch.reaches.0[at..at + S::f32s::LEN].as_flattened_mut();
        let parts = words.chunks_exact_mut(S::u32s::LEN);
        for (part, words) in parts.zip([first, second, third, fourth]) {
            words.store_slice(part);
        }
    }
    for &apart in apart.as_slice() {
        *beside += apart as u64;
    }
    found
}

/// The lane numbers of a vector.
const NUMBERS: [f32; 16] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];

/// The footprint of a lane that [`reach_in_lanes`] found to be tall, if it reaches tiles: several rows at once, in the
/// steps of [`Ellipse::reach`](crate::gaussian::splats::ellipse::Ellipse::reach).
#[inline(always)]
fn reach_by_rows<S: Simd>(
    view: &ViewConstants,
    simd: S,
    at: usize,
    scratch: &Scratch,
    others: &mut Vec<TileSpan>,
    beside: &mut u64,
) -> Option<TileFootprint> {
    let number = |value: f32| S::f32s::splat(simd, value);
    let load = |lanes: &GroupF64| number(lanes[at] as f32);
    let ellipses = Ellipses::<S>::new(view, simd, &Shapes::new(&scratch.screen, load));
    let along = &ellipses.along;
    let whole = |value: S::f32s| value.as_slice()[0] as u64;
    let (first, count) = (whole(along.first), whole(along.tiles()) as usize);
    let reach = TileFootprint::new(first as u16, count as u16, others);
    let first_span = others.len() - count;
    let zero = number(0.0);
    let mut row = along.first + S::f32s::from_slice(simd, &NUMBERS[..S::f32s::LEN]);
    let mut reached = zero;
    for of_rows in others[first_span..].chunks_mut(S::f32s::LEN) {
        let RowColumns { range: across_row, within } = ellipses.row(simd, row);
        let tiles = within.select(across_row.tiles(), zero);
        let bits = spans(simd, within.select(across_row.first, zero), tiles);
        for (span, &bits) in of_rows.iter_mut().zip(bits.as_slice()) {
            *span = PackedSpan::from_bits(bits).into();
        }
        reached += tiles;
        row += S::f32s::LEN as f32;
    }
    let reached = reached.as_slice().iter().map(|&tiles| tiles as u64).sum::<u64>();
    let all = count as u64 * whole(ellipses.across.tiles());
    *beside += all.saturating_sub(reached);
    (reached > 0).then_some(reach)
}

/// The footprint of a lane, if it reaches tiles.
#[inline(never)]
fn reach_of_one(
    view: &ViewConstants,
    at: usize,
    scratch: &mut Scratch,
    projected: &mut ProjectedGroup,
    beside: &mut u64,
) -> Option<TileFootprint> {
    if view.geometry == GaussianGeometry::Surfel {
        return surfel_of(view, at, scratch).reach(&view.visible, &mut projected.spans);
    }
    let ellipse = scratch.screen.ellipse(at);
    // The square root of a negative extent is NaN.
    if ellipse.half[1].is_nan() {
        return None;
    }
    let beside = view.optimizations.has(Optimization::Ellipse).then_some(beside);
    match view.period {
        None => ellipse.reach(&view.visible, &mut projected.spans, beside),
        Some(period) => {
            let (visible, copies) = (&view.visible, &mut scratch.copies);
            panorama::reach(at, &ellipse, period, visible, copies, projected, beside)
        }
    }
}
