//! The search for tiles in binary32 is held against the one in binary64, one Gaussian at a time.

use super::*;
use crate::gaussian::view::visible::Visible;
use crate::state::Viewport;
use crate::state::gaussian::{Camera, GaussianState};
use crate::stats::optimizations::Optimizations;
use crate::token_of;
use devmem::dispatch;
use fearless_simd::Level;
use gaurast_runner::{Case, simd_levels};
use proptest::prelude::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The tiles of a lane: rows, each with its first tile and one past its last.
type Spans = Vec<(u32, u16, u16)>;

/// A Gaussian in the picture.
#[derive(Clone, Copy, Debug)]
struct ScreenGaussian {
    mean: [f64; 2],
    /// The covariance.
    covariance: [f64; 3],
    determinant: f64,
    /// The cut-off of the quadratic form.
    extent: f64,
    depth: f64,
}

impl ScreenGaussian {
    /// True if the ellipse contains a visible pixel centre of a tile.
    fn reaches_a_centre(&self, visible: &Visible, (row, column): (u32, u16)) -> bool {
        let ([x, y], [a, b, c]) = (self.mean, self.covariance);
        let pixels = |tile: i64, first: i64, end: i64| {
            let (first, end) = (first.max(16 * tile), end.min(16 * tile + 16));
            (first..end).map(|pixel| pixel as f64 + 0.5)
        };
        pixels(row.into(), visible.top, visible.bottom).any(|below| {
            pixels(column.into(), visible.left, visible.right).any(|right| {
                let [dx, dy] = [right - x, below - y];
                c * dx * dx - 2.0 * b * dx * dy + a * dy * dy <= self.extent * self.determinant
            })
        })
    }

    /// A Gaussian with standard deviations `p` and `q` along an axis at `angle` and across it.
    fn new(mean: [f64; 2], [p, q, angle]: [f64; 3], extent: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        let difference = (p - q) * (p + q);
        Self {
            mean,
            covariance: [(p * cos).hypot(q * sin).powi(2), difference * sin * cos, (p * sin).hypot(q * cos).powi(2)],
            determinant: (p * q).powi(2),
            extent,
            depth: 1.0,
        }
    }

    fn put(&self, scratch: &mut Scratch, at: usize) {
        let screen = &mut *scratch.screen;
        for (lanes, value) in screen.mean.iter_mut().zip(self.mean) {
            lanes[at] = value;
        }
        for (lanes, value) in screen.covariance.iter_mut().zip(self.covariance) {
            lanes[at] = value;
        }
        screen.determinant[at] = self.determinant;
        screen.extent[at] = self.extent;
        scratch.depth[at] = self.depth;
    }

    /// The tiles that the bounding box reaches.
    fn boxed(&self, visible: &Visible) -> Spans {
        let mut scratch = Scratch::new();
        self.put(&mut scratch, 0);
        let mut others = Vec::new();
        let reach = scratch.screen.ellipse(0).reach(visible, &mut others, None);
        let spans = reach.iter().flat_map(|reach| reach.spans(&others));
        spans.map(|(row, span)| (row, span.first, span.end)).collect()
    }

    /// The ellipse moved outwards by so many times the greatest error that the search in binary32 allows for.
    fn widened(&self, times: f64) -> Self {
        let [a, _, c] = self.covariance;
        let half = |variance: f64| (variance * self.extent).sqrt();
        let size = self.mean[0].abs() + self.mean[1].abs() + half(a) + half(c) + 1.0;
        // The square of the lesser standard deviation is the determinant by that of the greater one.
        let greatest = 0.5 * (a + c) + (0.5 * (a - c)).hypot(self.covariance[1]);
        let narrow = (self.determinant / greatest).sqrt();
        let by = times * size * f64::from(MARGIN);
        Self { extent: (self.extent.sqrt() + by / narrow).powi(2), ..*self }
    }
}

fn projection(visible: Visible) -> ViewConstants {
    let camera = Camera { far_plane: 50.0, ..Camera::default() };
    let viewport = Viewport { x: 0.0, y: 0.0, width: 200.0, height: 150.0, min_depth: 0.0, max_depth: 1.0 };
    let state = GaussianState::default();
    ViewConstants::new(&state, &camera, &viewport, visible, None, Optimizations::ALL)
}

/// The tiles of a group's Gaussians, and the counters.
fn tiles(
    level: Option<Level>,
    view: &ViewConstants,
    gaussians: &[ScreenGaussian],
    scratch: &mut Scratch,
) -> (Vec<Spans>, Counters) {
    scratch.lanes = (0..gaussians.len()).collect();
    scratch.kept = Bits::first(gaussians.len());
    for (at, gaussian) in gaussians.iter().enumerate() {
        gaussian.put(scratch, at);
    }
    let mut projected = ProjectedGroup::default();
    match level {
        None => {
            dispatch!(Level::new(), simd => find_tiles_by(view, simd, false, scratch, &mut projected));
        }
        Some(level) => dispatch!(level, simd => find_tiles_by(view, simd, true, scratch, &mut projected)),
    }
    let mut found = vec![Spans::new(); gaussians.len()];
    for &at in &scratch.reached {
        let reach = scratch.reaches.get(at);
        let spans = reach.spans(&projected.spans);
        let spans = spans.map(|(row, span)| (row, span.first, span.end));
        found[at] = spans.filter(|(_, first, end)| first < end).collect();
        assert!(!found[at].is_empty(), "{at} reaches nothing");
    }
    (found, projected.counters)
}

/// True if all of `inner` is in `outer`.
fn contains(outer: &Spans, inner: &Spans) -> bool {
    inner.iter().all(|&(row, first, end)| {
        let is_in = |&(other, from, to): &(u32, u16, u16)| row == other && from <= first && end <= to;
        outer.iter().any(is_in)
    })
}

/// True if an ellipse is known to reach the tiles that the reference finds: it does not test one whose box is in one tile.
fn is_reached(gaussian: &ScreenGaussian, view: &ViewConstants, exact: &Spans) -> bool {
    match exact[..] {
        [(row, first, end)] if end - first == 1 => gaussian.reaches_a_centre(&view.visible, (row, first)),
        _ => true,
    }
}

/// Asserts that the search in binary32 finds all tiles that Gaussians reach at a level, and none that they do not reach
/// if they are moved outwards by eight times its bound. Returns the numbers of tiles that are reached and that are found,
/// and of Gaussians that were searched in binary64.
fn assert_bounded(level: Level, view: &ViewConstants, gaussians: &[ScreenGaussian], scratch: &mut Scratch) -> [u64; 3] {
    let (exact, _) = tiles(None, view, gaussians, scratch);
    let (found, counters) = tiles(Some(level), view, gaussians, scratch);
    let wider: Vec<ScreenGaussian> = gaussians.iter().map(|gaussian| gaussian.widened(8.0)).collect();
    let (wide, _) = tiles(None, view, &wider, scratch);
    for (at, gaussian) in gaussians.iter().enumerate() {
        let (exact, found) = (&exact[at], &found[at]);
        // If the box of an ellipse is in one tile, the ellipse itself is not tested.
        let wide = match found[..] {
            [(_, first, end)] if end - first == 1 => &wider[at].boxed(&view.visible),
            _ => &wide[at],
        };
        let is_reached = is_reached(gaussian, view, exact);
        assert!(!is_reached || contains(found, exact), "{gaussian:?} reaches {exact:?}, found {found:?}");
        let is_sane = wider[at].extent.is_finite() && gaussian.extent >= 0.0;
        assert!(!is_sane || contains(wide, found), "{gaussian:?} found {found:?}, and a wider one reaches {wide:?}");
    }
    let count = |of: &[Spans]| {
        let spans = of.iter().flatten();
        spans.map(|&(_, first, end)| u64::from(end - first)).sum()
    };
    [count(&exact), count(&found), counters.get(Counter::TilesFoundWide)]
}

/// A random Gaussian: of all sizes, from needles to discs, many of them at the limits of what is searched in binary32.
fn random(rng: &mut ChaCha8Rng, visible: &Visible) -> ScreenGaussian {
    let [width, height] = [visible.right, visible.bottom].map(|end| end as f64);
    let place = |rng: &mut ChaCha8Rng, size: f64| match rng.random_range(0..4) {
        // At edges of pixels and tiles.
        0 => 0.5 * (rng.random_range(-0.2..1.2) * 2.0 * size).round(),
        1 => 16.0 * (rng.random_range(-0.2..1.2) * size / 16.0).round() + 0.5,
        _ => rng.random_range(-0.2..1.2) * size,
    };
    let mean = [place(rng, width), place(rng, height)];
    let long = 2f64.powf(rng.random_range(-12.0..6.0));
    let short = match rng.random_range(0..4) {
        // The least determinant that is searched in binary32, or hardly less or more.
        0 => f64::from(LEAST_VARIANCE).sqrt() / long * (1.0 + f64::from(rng.random_range(-2..=2)) * 1e-7),
        1 => long,
        _ => long * 2f64.powf(rng.random_range(-14.0..0.0)),
    };
    let angle = match rng.random_range(0..3) {
        0 => 0.0,
        1 => std::f64::consts::FRAC_PI_2 * f64::from(rng.random_range(0..4)) + rng.random_range(-1e-4..1e-4),
        _ => rng.random_range(0.0..3.2),
    };
    let extent = match rng.random_range(0..8) {
        0 => rng.random_range(-0.1..0.1),
        _ => rng.random_range(0.1..40.0),
    };
    let mut screen = ScreenGaussian::new(mean, [long, short, angle], extent);
    // One of many has about the greatest size.
    if rng.random_range(0..512) == 0 {
        let size = f64::from(MOST_SIZE) * (1.0 + f64::from(rng.random_range(-2..=2)) * 1e-7);
        let rest = size - mean[0].abs() - mean[1].abs();
        let [a, _, c] = screen.covariance;
        let by = (rest / ((a * extent.abs()).sqrt() + (c * extent.abs()).sqrt())).powi(2);
        screen.covariance = screen.covariance.map(|element| element * by);
        screen.determinant *= by * by;
    }
    screen
}

#[gaurast_runner::test(each = simd_levels())]
fn binary32_finds_every_tile_that_binary64_finds_and_hardly_more(case: &Case) {
    let visible = |left, top, right, bottom| Visible { left, top, right, bottom };
    let views =
        [visible(3, 0, 200, 150), visible(0, 0, 1280, 720), visible(0, 7, 16384, 16384), visible(0, 0, 65536, 256)]
            .map(projection);
    let groups = if gaurast_runner::is_long() { 400_000 } else { 400 };
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut scratch = Scratch::new();
    let mut sums = [0; 3];
    for group in 0..groups {
        let view = &views[group % views.len()];
        let gaussians: Vec<ScreenGaussian> = (0..255).map(|_| random(&mut rng, &view.visible)).collect();
        let counts = assert_bounded(token_of(case), view, &gaussians, &mut scratch);
        for (sum, count) in sums.iter_mut().zip(counts) {
            *sum += count;
        }
    }
    let [reached, found, wide] = sums;
    assert!(found - reached <= reached / 200, "{found} of {reached}");
    // Both ways are tested.
    let all = 255 * groups as u64;
    assert!(wide > all / 100 && wide < all / 2, "{wide} of {all}");
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
fn invalid_numbers_lose_no_tiles(case: &Case) {
    let level = token_of(case);
    proptest!(|(
        lanes in prop::collection::vec(
            ([place(), place()], shape(), prop_oneof![9 => 0.1..40.0f64, 1 => -1.0..0.0f64], 0.1..60.0f64),
            1..40,
        ),
        odd in (0..40usize, prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(-1.0), Just(1e120)]),
    )| {
        let view = projection(Visible { left: 3, top: 0, right: 200, bottom: 150 });
        let mut gaussians: Vec<ScreenGaussian> = lanes
            .iter()
            .map(|&(mean, shape, extent, depth)| ScreenGaussian { depth, ..ScreenGaussian::new(mean, shape, extent) })
            .collect();
        let (at, value) = odd;
        let count = gaussians.len();
        let one = &mut gaussians[at % count];
        match at % 4 {
            0 => one.determinant = value,
            1 => one.covariance[0] = value,
            2 => one.covariance[1] = value,
            _ => one.depth = value,
        }
        let mut scratch = Scratch::new();
        let (exact, expected) = tiles(None, &view, &gaussians, &mut scratch);
        let (found, counters) = tiles(Some(level), &view, &gaussians, &mut scratch);
        for ((gaussian, exact), found) in gaussians.iter().zip(&exact).zip(&found) {
            let is_reached = is_reached(gaussian, &view, exact);
            prop_assert!(!is_reached || contains(found, exact), "{:?} {:?} {:?}", gaussian, exact, found);
        }
        for counter in [Counter::SkippedNear, Counter::SkippedFar, Counter::SkippedDegenerate] {
            prop_assert_eq!(counters.get(counter), expected.get(counter));
        }
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
    for value in [f32::MAX, f32::INFINITY, f32::NEG_INFINITY, f32::MIN, 0.0, -0.0, 0.2] {
        let last = last_rounded_to(value);
        assert!(last as f32 <= value, "{value}");
        assert!(last == f64::INFINITY || last.next_up() as f32 > value, "{value}");
    }
}
