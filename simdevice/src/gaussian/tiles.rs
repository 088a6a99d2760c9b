//! The search for the tiles that a group's kept Gaussians reach: for several Gaussians at once if they are small, as
//! most are; for several rows of one Gaussian at once if it is tall; and one at a time otherwise.

use super::camera::ViewConstants;
use super::footprint::{Ellipse, HELD_ROWS, PackedSpan, TileFootprint, TileSpan};
use super::lanes::{Bits, GroupF64};
use super::panorama;
use super::scratch::{Scratch, ScreenGaussians};
use super::splat::ProjectedGroup;
use super::surfel::surfel_of;
use crate::limits::TILE_SIZE;
use crate::simd::both;
use crate::state::gaussian::GaussianGeometry;
use crate::stats::counters::{Counter, Counters};
use crate::stats::optimizations::Optimization;
use fearless_simd::{Simd, prelude::*};

/// The sum of this and an integer below 2^52 has the integer in its low bits.
const POINT: f64 = (1u64 << 52) as f64;

/// A bound of magnitudes that keeps squares from overflow.
const MODERATE: f64 = 1e100;

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
    low: S::f64s,
    high: S::f64s,
    first: S::f64s,
    last: S::f64s,
    /// True if there are pixels.
    any: S::mask64s,
}

impl<S: Simd> Range<S> {
    /// The integers of `first..=last` whose pixel centres are between `low` and `high`, in the same steps as in
    /// [`footprint`](super::footprint).
    #[inline(always)]
    fn new(low: S::f64s, high: S::f64s, [first, last]: [S::f64s; 2]) -> Self {
        let low = (low - 0.5).ceil().max(first);
        let high = (high - 0.5).floor().min(last);
        let per_pixel = 1.0 / f64::from(TILE_SIZE);
        Self {
            low,
            high,
            first: (low * per_pixel).floor(),
            last: (high * per_pixel).floor(),
            any: low.simd_le(high),
        }
    }

    /// The number of tiles.
    #[inline(always)]
    fn tiles(&self) -> S::f64s {
        self.last - self.first + 1.0
    }

    /// The span of its tiles, as the number whose bits are a [`PackedSpan`].
    #[inline(always)]
    fn span(&self) -> S::f64s {
        self.first + (self.last + 1.0) * 65536.0
    }
}

/// Ellipses whose tiles are searched row by row; see [`Ellipse`].
struct Ellipses<S: Simd> {
    mean: [S::f64s; 2],
    slope: S::f64s,
    narrowing: S::f64s,
    peak: S::f64s,
    /// The square of the half extent in y.
    square: S::f64s,
    /// The rows of pixels.
    along: Range<S>,
    /// The first and the last visible column of pixels.
    columns: [S::f64s; 2],
}

impl<S: Simd> Ellipses<S> {
    /// The columns that each ellipse reaches in a row of tiles. The mask is true if the row belongs to the ellipse and
    /// the ellipse reaches a pixel centre there. The steps are those of [`Ellipse::reach`].
    #[inline(always)]
    fn row(&self, simd: S, row: S::f64s) -> (Range<S>, S::mask64s) {
        let number = |value: f64| S::f64s::splat(simd, value);
        let (zero, tile) = (number(0.0), f64::from(TILE_SIZE));
        let [x, y] = self.mean;
        let row_top = row * tile;
        let above = self.along.low.max(row_top) + 0.5 - y;
        let below = self.along.high.min(row_top + (tile - 1.0)) + 0.5 - y;
        // See [`Ellipse::sides`].
        let to_left = (zero - self.peak).max(above).min(below);
        let to_right = self.peak.max(above).min(below);
        let width =
            |height: S::f64s| (self.narrowing * (self.square - height * height).max(zero)).sqrt();
        let low = x + (self.slope * to_left - width(to_left));
        let high = x + (self.slope * to_right + width(to_right));
        let range = Range::new(low, high, self.columns);
        let within = range.any & row.simd_le(self.along.last);
        (range, within)
    }
}

/// The greatest binary64 number that rounds to a binary32 number of at most `value`.
fn last_rounded_to(value: f32) -> f64 {
    if value == f32::INFINITY {
        return f64::INFINITY;
    }
    // Numbers round to infinity from half a unit above the greatest binary32 number on.
    let wide = |value: f32| {
        if value.is_infinite() {
            2f64.powi(128).copysign(value.into())
        } else {
            f64::from(value)
        }
    };
    let middle = 0.5 * (wide(value) + wide(value.next_up()));
    if middle as f32 <= value {
        middle
    } else {
        middle.next_down()
    }
}

/// Finds the kept Gaussians that reach a tile, and their footprints.
#[inline(always)]
pub(super) fn find_tiles<S: Simd>(
    view: &ViewConstants,
    simd: S,
    scratch: &mut Scratch,
    out: &mut ProjectedGroup,
) {
    let by_lanes = view.optimizations.has(Optimization::Ellipse)
        && view.period.is_none()
        && view.geometry == GaussianGeometry::Volume;
    find_tiles_by(view, simd, by_lanes, scratch, out);
}

/// The body of [`find_tiles`]. If `by_lanes` is false, it searches one Gaussian at a time.
#[inline(always)]
fn find_tiles_by<S: Simd>(
    view: &ViewConstants,
    simd: S,
    by_lanes: bool,
    scratch: &mut Scratch,
    out: &mut ProjectedGroup,
) {
    let drawn = find_drawn(view, simd, scratch, &mut out.counters);
    let mut beside = 0;
    let found = if by_lanes {
        reach_in_lanes(view, simd, &drawn, scratch, &mut beside)
    } else {
        Found {
            reached: Bits::default(),
            tall: Bits::default(),
            left: drawn,
        }
    };
    let Found {
        mut reached,
        tall,
        left,
    } = found;
    tall.for_each(
        #[inline(always)]
        |at| {
            let spans = &mut out.spans;
            if let Some(reach) = reach_by_rows(view, simd, at, scratch, spans, &mut beside) {
                scratch.reaches.set(at, &reach);
                reached.set_one(at, true);
            }
        },
    );
    scratch.copies.clear();
    left.for_each(|at| {
        if let Some(reach) = reach_of_one(view, at, scratch, out, &mut beside) {
            scratch.reaches.set(at, &reach);
            reached.set_one(at, true);
        }
    });
    if let Some(cut_off) = &view.list_cut_off {
        cut_off.clip(scratch, &mut out.spans, &mut reached);
    }
    scratch.reached.clear();
    reached.for_each(|at| scratch.reached.push(at));
    let off_screen = drawn.without(&reached).count();
    out.counters.add(Counter::SkippedOffScreen, off_screen);
    out.counters.add(Counter::TilesBesideEllipse, beside);
}

/// The lanes that are between the near and far planes and have a positive definite covariance. Counts the reasons to
/// skip the others.
#[inline(always)]
fn find_drawn<S: Simd>(
    view: &ViewConstants,
    simd: S,
    scratch: &Scratch,
    counters: &mut Counters,
) -> Bits {
    let len = scratch.lanes.len();
    let number = |value: f64| S::f64s::splat(simd, value);
    let near = number(last_rounded_to(view.near));
    let before_far = number(last_rounded_to(view.far.next_down()));
    let (least, greatest) = (number(0.0), number(f64::MAX));
    let is_flat = view.geometry == GaussianGeometry::Surfel;
    let [mut beyond_near, mut beyond_far, mut definite] = [Bits::default(); 3];
    for at in (0..len).step_by(S::f64s::LEN) {
        let load = |lanes: &GroupF64| S::f64s::from_slice(simd, &lanes[at..at + S::f64s::LEN]);
        let depth = load(&scratch.depth);
        let determinant = load(&scratch.flat.determinant);
        // Comparisons with NaN are false.
        beyond_near.set(at, depth.simd_gt(near));
        beyond_far.set(at, depth.simd_gt(before_far));
        definite.set(
            at,
            determinant.simd_gt(least) & determinant.simd_le(greatest),
        );
    }
    if is_flat {
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

/// The footprints of the lanes of `drawn` that reach at most [`HELD_ROWS`] rows of tiles. The results and steps are
/// those of [`Ellipse::reach`]. Adds the number of tiles of bounding boxes that ellipses do not reach to `beside`.
#[inline(always)]
fn reach_in_lanes<S: Simd>(
    view: &ViewConstants,
    simd: S,
    drawn: &Bits,
    scratch: &mut Scratch,
    beside: &mut u64,
) -> Found {
    let number = |value: f64| S::f64s::splat(simd, value);
    let columns = both(view.visible.pixels(0), number);
    let rows = both(view.visible.pixels(1), number);
    let (zero, one) = (number(0.0), number(1.0));
    let mut found = Found {
        reached: Bits::default(),
        tall: Bits::default(),
        left: Bits::default(),
    };
    let mut apart = zero;
    for at in (0..scratch.lanes.len()).step_by(S::f64s::LEN) {
        let load = |lanes: &GroupF64| S::f64s::from_slice(simd, &lanes[at..at + S::f64s::LEN]);
        let ScreenGaussians {
            mean,
            half,
            slope,
            narrowing,
            peak,
            ..
        } = &*scratch.flat;
        let (x, y) = (load(&mean[0]), load(&mean[1]));
        let (half_x, half_y) = (load(&half[0]), load(&half[1]));
        let (slope, narrowing, peak) = (load(slope), load(narrowing), load(peak));
        let drawn = S::mask64s::from_bitmask(simd, drawn.group(at, S::f64s::LEN));
        // The square root of a negative extent is NaN.
        let drawn = drawn & half_y.simd_ge(zero);
        let size = x.abs() + y.abs() + half_x + half_y + slope.abs() + narrowing + peak.abs();
        let moderate = size.simd_le(number(MODERATE));

        let across = Range::<S>::new(x - half_x, x + half_x, columns);
        let along = Range::<S>::new(y - half_y, y + half_y, rows);
        let inside = drawn & moderate & across.any & along.any;
        let (wide, tall) = (across.tiles(), along.tiles());
        let short = tall.simd_le(number(HELD_ROWS as f64));
        found.left.set(at, drawn & !moderate);
        found.tall.set(at, inside & !short);
        let clipped = across.low.simd_eq(columns[0])
            | across.high.simd_eq(columns[1])
            | along.low.simd_eq(rows[0])
            | along.high.simd_eq(rows[1]);
        let single = wide.simd_eq(one) & tall.simd_eq(one) & !clipped;

        let ellipses = Ellipses::<S> {
            mean: [x, y],
            slope,
            narrowing,
            peak,
            square: half_y * half_y,
            along,
            columns,
        };
        let along = &ellipses.along;
        let mut row = along.first;
        let mut reached = zero;
        let mut spans = [zero; HELD_ROWS];
        for (number, span) in spans.iter_mut().enumerate() {
            // Most have one or two rows.
            let any = inside & short & row.simd_le(along.last);
            if !any.any_true() {
                break;
            }
            let (across_row, within) = ellipses.row(simd, row);
            *span = within.select(across_row.span(), zero);
            reached += within.select(across_row.tiles(), zero);
            if number == 0 {
                *span = single.select(across.span(), *span);
                reached = single.select(one, reached);
            }
            row += 1.0;
        }
        let told = inside & short;
        let any = told & reached.simd_gt(zero);
        found.reached.set(at, any);
        let more = (wide * tall - reached).max(zero);
        apart += (told & !single).select(more, zero);

        let head = along.first + tall * 65536.0;
        let bits = |value: S::f64s| -> S::u64s { (value + POINT).bitcast() };
        let point: S::u64s = number(POINT).bitcast();
        let [first, second, third] = spans;
        let [words, more_words] = &mut scratch.reaches.0;
        let word = (bits(head) - point) | (bits(first) << 32);
        word.store_slice(&mut words[at..at + S::f64s::LEN]);
        let word = (bits(second) - point) | (bits(third) << 32);
        word.store_slice(&mut more_words[at..at + S::f64s::LEN]);
    }
    for lane in 0..S::f64s::LEN {
        *beside += apart.as_slice()[lane] as u64;
    }
    found
}

/// The lane numbers of a vector.
const NUMBERS: [f64; 8] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// The footprint of a lane that [`reach_in_lanes`] found to be tall, if it reaches tiles: several rows at once, in the
/// steps of [`Ellipse::reach`].
#[inline(always)]
fn reach_by_rows<S: Simd>(
    view: &ViewConstants,
    simd: S,
    at: usize,
    scratch: &Scratch,
    others: &mut Vec<TileSpan>,
    beside: &mut u64,
) -> Option<TileFootprint> {
    let number = |value: f64| S::f64s::splat(simd, value);
    let flat = &*scratch.flat;
    let (x, y) = (number(flat.mean[0][at]), number(flat.mean[1][at]));
    let (half_x, half_y) = (number(flat.half[0][at]), number(flat.half[1][at]));
    let columns = both(view.visible.pixels(0), number);
    let across = Range::<S>::new(x - half_x, x + half_x, columns);
    let rows = both(view.visible.pixels(1), number);
    let ellipses = Ellipses::<S> {
        mean: [x, y],
        slope: number(flat.slope[at]),
        narrowing: number(flat.narrowing[at]),
        peak: number(flat.peak[at]),
        square: half_y * half_y,
        along: Range::new(y - half_y, y + half_y, rows),
        columns,
    };
    let along = &ellipses.along;
    let whole = |value: S::f64s| value.as_slice()[0] as u64;
    let (first, count) = (whole(along.first), whole(along.tiles()) as usize);
    let reach = TileFootprint::new(first as u16, count as u16, others);
    let spans = others.len() - count;
    let spans = &mut others[spans..];
    let (zero, point) = (number(0.0), number(POINT));
    let mut row = along.first + S::f64s::from_slice(simd, &NUMBERS[..S::f64s::LEN]);
    let mut reached = zero;
    for spans in spans.chunks_mut(S::f64s::LEN) {
        let (across_row, within) = ellipses.row(simd, row);
        let bits: S::u64s = (within.select(across_row.span(), zero) + point).bitcast();
        for (span, &bits) in spans.iter_mut().zip(bits.as_slice()) {
            *span = PackedSpan::from_bits(bits as u32).into();
        }
        reached += within.select(across_row.tiles(), zero);
        row += S::f64s::LEN as f64;
    }
    let reached = reached.as_slice().iter().sum::<f64>() as u64;
    let all = count as u64 * whole(across.tiles());
    *beside += all.saturating_sub(reached);
    (reached > 0).then_some(reach)
}

/// The footprint of a lane, if it reaches tiles.
#[inline(never)]
fn reach_of_one(
    view: &ViewConstants,
    at: usize,
    scratch: &mut Scratch,
    out: &mut ProjectedGroup,
    beside: &mut u64,
) -> Option<TileFootprint> {
    if view.geometry == GaussianGeometry::Surfel {
        return surfel_of(view, at, scratch, &mut out.spans).1;
    }
    let flat = &*scratch.flat;
    let ellipse = Ellipse {
        mean: [flat.mean[0][at], flat.mean[1][at]],
        half: [flat.half[0][at], flat.half[1][at]],
        slope: flat.slope[at],
        narrowing: flat.narrowing[at],
        peak: flat.peak[at],
    };
    // The square root of a negative extent is NaN.
    if ellipse.half[1].is_nan() {
        return None;
    }
    let beside = view
        .optimizations
        .has(Optimization::Ellipse)
        .then_some(beside);
    match view.period {
        None => ellipse.reach(&view.visible, &mut out.spans, beside),
        Some(period) => {
            let (visible, copies) = (&view.visible, &mut scratch.copies);
            panorama::reach(at, &ellipse, period, visible, copies, out, beside)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::footprint::Visible;
    use super::*;
    use crate::state::Viewport;
    use crate::state::gaussian::{Camera, GaussianState};
    use crate::stats::optimizations::Optimizations;
    use crate::token_of;
    use devmem::dispatch;
    use gaurast_runner::{Case, simd_levels};
    use proptest::prelude::*;

    /// The rows, each with its first tile and one past its last.
    type Spans = Vec<(u32, u16, u16)>;

    /// The result for a group: the spans of each lane that reaches tiles, and the counters.
    #[derive(Debug, PartialEq)]
    struct Tiles {
        reached: Vec<(usize, Spans)>,
        counters: Vec<u64>,
    }

    fn projection() -> ViewConstants {
        let visible = Visible {
            left: 3,
            top: 0,
            right: 200,
            bottom: 150,
        };
        let camera = Camera {
            far_plane: 50.0,
            ..Camera::default()
        };
        let viewport = Viewport {
            x: 0.0,
            y: 0.0,
            width: 200.0,
            height: 150.0,
            min_depth: 0.0,
            max_depth: 1.0,
        };
        let state = GaussianState::default();
        ViewConstants::new(
            &state,
            &camera,
            &viewport,
            visible,
            None,
            Optimizations::ALL,
        )
    }

    fn tiles<S: Simd>(simd: S, by_lanes: bool, scratch: &mut Scratch) -> Tiles {
        let mut out = ProjectedGroup::default();
        find_tiles_by(&projection(), simd, by_lanes, scratch, &mut out);
        let spans = |at: usize| {
            let reach = scratch.reaches.get(at);
            let spans = reach.spans(&out.spans);
            let spans = spans.map(|(row, span)| (row, span.first, span.end));
            spans.filter(|(_, first, end)| first < end).collect()
        };
        let counters = Counter::ALL.iter();
        Tiles {
            reached: scratch.reached.iter().map(|&at| (at, spans(at))).collect(),
            counters: counters.map(|&counter| out.counters.get(counter)).collect(),
        }
    }

    /// Typical coordinates, those at edges of pixels and tiles, and invalid ones.
    fn place() -> impl Strategy<Value = f64> {
        prop_oneof![
            8 => -30.0..230.0f64,
            8 => (-20..500i32).prop_map(|halves| 0.5 * f64::from(halves)),
            1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(-1e200), Just(1e17)],
        ]
    }

    /// Standard deviations along both axes, in pixels, and the angle of the first axis.
    fn shape() -> impl Strategy<Value = [f64; 3]> {
        (0.05..12.0f64, 0.05..6.0f64, 0.0..3.2f64).prop_map(|(a, b, angle)| [a, b, angle])
    }

    #[gaurast_runner::test(each = simd_levels())]
    fn lanes_find_what_one_at_a_time_finds(case: &Case) {
        let level = token_of(case);
        proptest!(|(
            lanes in prop::collection::vec(
                ([place(), place()], shape(), prop_oneof![9 => 0.1..40.0f64, 1 => -1.0..0.0f64], 0.1..60.0f64),
                1..40,
            ),
            odd in (0..40usize, prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(-1.0), Just(1e120)]),
        )| {
            let mut scratch = Scratch::new();
            for (at, &(mean, [p, q, angle], extent, depth)) in lanes.iter().enumerate() {
                let (sin, cos) = angle.sin_cos();
                let [p, q] = [p * p, q * q];
                let [a, b, c] = [p * cos * cos + q * sin * sin, (p - q) * sin * cos, p * sin * sin + q * cos * cos];
                let flat = &mut *scratch.flat;
                flat.mean[0][at] = mean[0];
                flat.mean[1][at] = mean[1];
                flat.determinant[at] = a * c - b * b;
                flat.half[0][at] = (a * extent).sqrt();
                flat.half[1][at] = (c * extent).sqrt();
                flat.slope[at] = b / c;
                flat.narrowing[at] = flat.determinant[at] / (c * c);
                flat.peak[at] = b * (extent / a).sqrt();
                scratch.depth[at] = depth;
                scratch.lanes.push(at);
            }
            scratch.kept = Bits::first(lanes.len());
            let (at, value) = odd;
            let flat = &mut *scratch.flat;
            match at % 4 {
                0 => flat.determinant[at] = value,
                1 => flat.half[0][at] = value,
                2 => flat.narrowing[at] = value.abs(),
                _ => scratch.depth[at] = value,
            }
            let [one, all] = [false, true].map(|by_lanes| {
                dispatch!(level, simd => tiles(simd, by_lanes, &mut scratch))
            });
            prop_assert_eq!(one, all);
        });
    }

    proptest! {
        #[gaurast_runner::test]
        fn depths_are_compared_as_they_are_rounded(bits in any::<u32>(), ulps in -3..3i32) {
            let value = f32::from_bits(bits);
            prop_assume!(!value.is_nan());
            let last = last_rounded_to(value);
            prop_assert!(last as f32 <= value);
            prop_assert!(last == f64::INFINITY || last.next_up() as f32 > value, "{last:e}");
            let near = f64::from(value) * (1.0 + f64::from(ulps) / f64::from(1 << 24));
            prop_assert_eq!(near as f32 <= value, near <= last, "{:e} {:e}", near, last);
        }
    }

    #[gaurast_runner::test]
    fn the_last_number_before_infinity_is_known() {
        for value in [
            f32::MAX,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::MIN,
            0.0,
            -0.0,
            0.2,
        ] {
            let last = last_rounded_to(value);
            assert!(last as f32 <= value, "{value}");
            assert!(
                last == f64::INFINITY || last.next_up() as f32 > value,
                "{value}"
            );
        }
    }
}
