mod approximation;
mod half;
mod per_pixel;
mod streamed;
mod tracking;
mod whole_draws;

use super::grid::TILE;
use super::kernel::needs_f64_sums;
use super::*;
use crate::device::Device;
use crate::format::Format;
use crate::gaussian::splats::splat::{Splat, SplatIndex};
use crate::gaussian::{GaussianSet, sort_and_bin};
use crate::packet::*;
use crate::runtime::Config;
use crate::simd::exp2::{CUBIC, GROWTH, POWERS_OF_EIGHTHS, QUADRATIC, exp2_of_negated};
use crate::state::gaussian::{Camera, CameraModel, GaussianOrder, GaussianPrecision, GaussianState};
use crate::state::{Rect, Viewport};
use crate::stats::optimizations::Optimizations;
use crate::stats::recorder::TileWork;
use crate::{level_of, token_of};
use devmem::Allocation;
use devmem::BufferRange;
use fearless_simd::f32x16;
use gaurast_runner::{Case, simd_levels};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

/// Powers of two at a level.
fn exp2_at(level: Level, x: [f32; BLOCK_PIXELS]) -> [f32; BLOCK_PIXELS] {
    dispatch!(level, simd => exp2_of_negated(simd, -f32x16::simd_from(simd, x)).to_array())
}

#[gaurast_runner::test(each = simd_levels())]
fn powers_of_two_are_within_their_bound(case: &Case) {
    let level = token_of(case);
    let mut worst = 0.0f64;
    let mut x = -126.0f32;
    while x <= 4.0 {
        let steps: [f32; BLOCK_PIXELS] = std::array::from_fn(|lane| x + lane as f32 / 1024.0);
        for (x, power) in steps.into_iter().zip(exp2_at(level, steps)) {
            let exact = f64::from(x).exp2();
            let ulp = f64::from((exact as f32).next_up()) - f64::from(exact as f32);
            worst = worst.max((f64::from(power) - exact).abs() / ulp);
        }
        x += 16.0 / 1024.0;
    }
    assert!(worst <= 1.35, "{worst} ulp");
}

/// A device of a test's variant.
fn device_of(case: &Case) -> Device {
    Device::new(&Config { threads: 2, simd: level_of(case), ..Config::default() }).unwrap()
}

/// A scene of `count` Gaussians before a camera at the origin, from ones smaller than a pixel to ones that fill the screen.
fn draw(seed: u64, count: u32, state: GaussianState, device: &Device, bounds: Rect) -> BinnedDraw {
    draw_with_depth(seed, count, state, device, bounds, None)
}

/// As [`draw`], for a depth attachment of a format, with these depth coefficients.
fn draw_with_depth(
    seed: u64,
    count: u32,
    state: GaussianState,
    device: &Device,
    bounds: Rect,
    depth: Option<(Format, [f32; 2])>,
) -> BinnedDraw {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut floats = Vec::new();
    for _ in 0..count {
        let z = rng.random_range(1.0..6.0f32);
        let size = 10.0f32.powf(rng.random_range(-3.0..0.5));
        floats.extend([rng.random_range(-1.5..1.5) * z, rng.random_range(-1.0..1.0) * z, z]);
        floats.extend([size, size * rng.random_range(0.01..1.0), size * rng.random_range(0.01..1.0)]);
        floats.extend([0; 4].map(|_| rng.random_range(-1.0..1.0f32)));
        floats.push(rng.random_range(0.0..1.2));
        floats.extend([0; 3].map(|_| rng.random_range(-1.0..2.0f32)));
    }
    let size = 4 * floats.len() as u64;
    let memory = Allocation::new_zeroed(size).unwrap();
    memory.write(0, &floats).unwrap();
    let buffer = BufferRange { memory, offset: 0, size };
    let stream =
        |offset, format| AttributeStream { buffer: buffer.clone(), stride: 56, offset, format, instance_divisor: None };
    let append = GaussianAppend {
        attributes: GaussianAttributes {
            position: stream(0, Format::R32G32B32Sfloat),
            scale: stream(12, Format::R32G32B32Sfloat),
            rotation: stream(24, Format::R32G32B32A32Sfloat),
            opacity: stream(40, Format::R32Sfloat),
            model: ModelAttributes::default(),
            activations: Default::default(),
            tables: None,
            spherical_harmonics: vec![stream(44, Format::R32G32B32Sfloat)],
        },
        indices: None,
        first: 0,
        count,
        first_instance: 0,
        instance_count: 1,
    };
    let begin = GaussianBegin {
        state: Arc::new(state),
        further_cameras: Vec::new(),
        camera: Camera {
            model: CameraModel::Pinhole,
            rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            eye: [0.0; 3],
            focal_length: [40.0, 38.0],
            principal_point: [48.5, 30.0],
            near_plane: 0.2,
            far_plane: f32::INFINITY,
            depth_coefficients: depth.map_or([0.0; 2], |(_, coefficients)| coefficients),
            distortion: None,
        },
        viewport: Viewport { x: 0.0, y: 0.0, width: 96.0, height: 64.0, min_depth: 0.0, max_depth: 1.0 },
        scissor: bounds,
    };
    let mut set = GaussianSet::begin(&begin, bounds, depth.map(|(format, _)| format));
    set.append(&append);
    let mut counters = Counters::default();
    sort_and_bin(set, device.runtime(), device.caches(), &mut counters).unwrap()
}

fn defaults() -> GaussianState {
    GaussianState::default()
}

/// The tile kernel's naive twin: one pixel at a time through the whole list, no blocks, no saturation.
fn naive_pixel(draw: &BinnedDraw, tile: [u32; 2], x: usize, y: usize) -> Option<[f32; 4]> {
    naive_sample(draw, tile, [x, y], |_| true).fragment
}

/// A sample of a twin.
#[derive(Default)]
struct Naive {
    /// Some Gaussian's alpha reached the floor, whatever its depth.
    reached: bool,
    fragment: Option<[f32; 4]>,
    median: u32,
    tracked: tracking::NaiveTracked,
}

/// 2 to the power of `x`, by a table.
fn by_table(x: f32) -> f32 {
    let shifter = 12_582_912.0 / 8.0;
    let shifted = x + shifter;
    let f = x - (shifted - shifter);
    let parts = shifted.to_bits();
    let word = POWERS_OF_EIGHTHS[parts as usize % 8];
    let power = f32::from_bits(word.wrapping_add(parts << 20));
    let growth = GROWTH.iter().fold(0.0f32, |p, &c| p.mul_add(f, c));
    (power * f).mul_add(growth, power)
}

/// 2 to the power of `x`, by a polynomial.
fn by_polynomial(x: f32, coefficients: &[f32]) -> f32 {
    let n = (x + 12_582_912.0) - 12_582_912.0;
    let f = x - n;
    let p = coefficients.iter().fold(0.0f32, |p, &c| p.mul_add(f, c));
    f32::from_bits(p.to_bits().wrapping_add_signed((n as i32) << 23))
}

/// As [`naive_pixel`], of the Gaussians whose depth passes.
fn naive_sample(draw: &BinnedDraw, tile: [u32; 2], [x, y]: [usize; 2], passes: impl Fn(u32) -> bool) -> Naive {
    let mut out = Naive::default();
    let allowed = draw.state.approximation.exponential_error;
    let power = |x: f32| {
        if allowed >= QUADRATIC.error {
            by_polynomial(x, &QUADRATIC.coefficients)
        } else if allowed >= CUBIC.error {
            by_polynomial(x, &CUBIC.coefficients)
        } else {
            by_table(x)
        }
    };
    if draw.state.precision == GaussianPrecision::Float16 {
        return half::naive_sample(draw, tile, [x, y], passes);
    }
    if draw.ray_depths().is_some() {
        return per_pixel::naive_sample(draw, tile, [x, y], power, passes);
    }
    let state = &draw.state;
    let neg_log2_floor = (-libm::log2(state.alpha_floor.into())).min(126.0) as f32;
    let corner = tile.map(|tile| tile * TILE_SIZE);
    let (mut c, mut t, mut covered) = ([0.0f32; 3], 1.0f32, false);
    let (mut wide_c, mut wide_t) = ([0.0f64; 3], 1.0f64);
    for &primitive in draw.sorted.tiles.list(tile[0], tile[1]) {
        let index = SplatIndex::new(primitive);
        let g = index.of(&draw.sorted.splats);
        let middle = |at: usize, corner: u32, mean: f64| ((4 * (at / 4)) as f64 + 2.0 + f64::from(corner)) - mean;
        let (mx, my) = (middle(x, corner[0], g.mean[0]), middle(y, corner[1], g.mean[1]));
        let f = g.factor;
        let (u, v) = ((mx * f[0]) as f32, (mx * f[1] + my * f[2]) as f32);
        let (dx, dy) = ((x % 4) as f32 - 1.5, (y % 4) as f32 - 1.5);
        let u = u + dx * f[0] as f32;
        let v = v + dy.mul_add(f[2] as f32, dx * f[1] as f32);
        let neg_log2_alpha = if g.needs_f64 || needs_f64_sums(state) {
            let (dx, dy) = (f64::from(dx) + mx, f64::from(dy) + my);
            let (u, v) = (dx * f[0], dx * f[1] + dy * f[2]);
            if g.exceeds_period && !(-draw.half_period..draw.half_period).contains(&dx) {
                1e3
            } else {
                ((u * u + v * v - f64::from(g.log2_opacity)) as f32).max(-1.0)
            }
        } else {
            v.mul_add(v, u.mul_add(u, -g.log2_opacity))
        };
        if neg_log2_alpha > neg_log2_floor {
            continue;
        }
        let alpha = power(-neg_log2_alpha).min(state.alpha_ceiling);
        out.reached = true;
        if !passes(g.look.depth) {
            continue;
        }
        if needs_f64_sums(state) {
            let weight = wide_t * f64::from(alpha);
            if wide_t - weight < f64::from(state.transmittance_floor) {
                break;
            }
            if wide_t >= 0.5 {
                out.median = g.look.depth;
            }
            for (c, color) in wide_c.iter_mut().zip(g.look.color) {
                *c += weight * f64::from(color);
            }
            wide_t -= weight;
            (c, t) = (wide_c.map(|c| c as f32), wide_t as f32);
            covered = true;
            continue;
        }
        let weight = t * alpha;
        let rest = t.mul_add(-alpha, t);
        if rest < state.transmittance_floor {
            break;
        }
        if t >= 0.5 {
            out.median = g.look.depth;
        }
        if let Some(identities) = draw.identities() {
            out.tracked.add(*index.of(identities), t, weight);
        }
        for (c, color) in c.iter_mut().zip(g.look.color) {
            *c = weight.mul_add(color, *c);
        }
        t = rest;
        covered = true;
    }
    out.fragment = covered.then_some([c[0], c[1], c[2], 1.0 - t]);
    out
}

/// Every pixel of every tile equals the naive twin's, bit for bit.
fn check(case: &Case, seed: u64, count: u32, state: &GaussianState, bounds: Rect) {
    check_changed(case, seed, count, state, bounds, |_| {});
}

/// The same of a draw that is changed before it is rendered.
fn check_changed(
    case: &Case,
    seed: u64,
    count: u32,
    state: &GaussianState,
    bounds: Rect,
    change: impl Fn(&mut BinnedDraw),
) {
    let device = device_of(case);
    let mut draw = draw(seed, count, state.clone(), &device, bounds);
    change(&mut draw);
    let mut tile = Box::new(GaussianTile::default());
    let mut covered = 0;
    for at in (0..4).flat_map(|y| (0..6).map(move |x| [x, y])) {
        let any = tile.render(&draw, device.level(), at[0], at[1], &mut Counters::default());
        for (x, y) in (0..TILE).flat_map(|y| (0..TILE).map(move |x| (x, y))) {
            let pixel = [at[0] as usize * TILE + x, at[1] as usize * TILE + y];
            let inside = Rect { x: pixel[0] as i32, y: pixel[1] as i32, width: 1, height: 1 };
            let inside = !inside.intersect(bounds).is_empty();
            let expected = naive_pixel(&draw, at, x, y).filter(|_| inside);
            let got = tile.pixel(x, y).filter(|_| any);
            assert_eq!(got, expected, "seed {seed}, pixel {pixel:?}");
            covered += u32::from(got.is_some());
        }
    }
    assert!(covered > 0, "seed {seed}: nothing was drawn");
}

const WHOLE: Rect = Rect { x: 0, y: 0, width: 96, height: 64 };

#[gaurast_runner::test(each = simd_levels())]
fn the_kernel_equals_its_naive_twin(case: &Case) {
    for seed in 0..4 {
        check(case, seed, 400, &defaults(), WHOLE);
    }
}

#[gaurast_runner::test(each = simd_levels())]
fn it_does_so_where_nothing_ends_early_and_nothing_is_too_faint(case: &Case) {
    let state = GaussianState {
        alpha_floor: 0.0,
        alpha_ceiling: 1.0,
        transmittance_floor: 0.0,
        low_pass_variance: 0.0,
        ..defaults()
    };
    check(case, 10, 150, &state, Rect { x: 5, y: 3, width: 70, height: 51 });
}

#[gaurast_runner::test(each = simd_levels())]
fn it_does_so_where_gaussians_are_wider_than_a_period(case: &Case) {
    check_changed(case, 6, 400, &defaults(), WHOLE, |draw| {
        draw.half_period = 2.25;
        let sorted = Arc::get_mut(&mut draw.sorted).unwrap();
        for splat in sorted.splats.iter_mut().flatten().step_by(3) {
            (splat.exceeds_period, splat.needs_f64) = (true, true);
        }
    });
}

#[gaurast_runner::test(each = simd_levels())]
fn it_does_so_where_exponents_need_binary64(case: &Case) {
    // Without a filter the smallest ones are thinner than a pixel by far.
    let state = GaussianState { low_pass_variance: 0.0, ..defaults() };
    let device = Device::new(&Config::default()).unwrap();
    let drawn = draw(5, 3000, state.clone(), &device, WHOLE);
    let wide = drawn.sorted.splats.iter().flatten().filter(|splat| splat.needs_f64);
    assert!(wide.count() > 10);
    check(case, 5, 3000, &state, WHOLE);
}

#[gaurast_runner::test(each = simd_levels())]
fn it_does_so_where_pixels_end_at_once(case: &Case) {
    let state = GaussianState { transmittance_floor: 0.5, opacity_compensated: true, ..defaults() };
    check(case, 20, 400, &state, Rect { x: 17, y: 0, width: 30, height: 64 });
}

#[gaurast_runner::test(each = simd_levels())]
fn it_does_so_where_opacities_are_about_the_ceiling(case: &Case) {
    let state = GaussianState { alpha_ceiling: 0.9, ..defaults() };
    for above in [-3e-4, -1.01e-4, -0.99e-4, 0.0, 1e-6, 1e-3] {
        check_changed(case, 7, 300, &state, WHOLE, |draw| {
            let sorted = Arc::get_mut(&mut draw.sorted).unwrap();
            for splat in sorted.splats.iter_mut().flatten() {
                splat.log2_opacity = (0.9f64.log2() + above) as f32;
                // The alpha at the pixel's centre is the opacity.
                splat.mean = splat.mean.map(|at| at.floor() + 0.5);
            }
        });
    }
}

#[gaurast_runner::test]
fn a_saturated_tile_fetches_no_more() {
    let device = Device::new(&Config::default()).unwrap();
    let mut tile = Box::new(GaussianTile::default());
    let mut evaluated = |state| {
        let draw = draw(30, 4000, state, &device, WHOLE);
        let mut counters = Counters::default();
        tile.render(&draw, device.level(), 2, 2, &mut counters);
        let list = draw.sorted.tiles.list(2, 2).len() as u64;
        (counters.get(Counter::TilePairsEvaluated), list)
    };
    let (ends, list) = evaluated(defaults());
    assert!(ends < list / 4, "{ends} of {list}");
    let (all, list) = evaluated(GaussianState { transmittance_floor: 0.0, ..defaults() });
    assert_eq!(all, list);
}

#[gaurast_runner::test]
fn recording_work_changes_no_bit_and_agrees_with_the_counters() {
    use crate::stats::recorder::{DrawWork, Recorder};
    let quiet = Device::new(&Config::default()).unwrap();
    for (seed, bounds) in [(40, WHOLE), (41, Rect { x: 5, y: 3, width: 70, height: 50 })] {
        let recorder = Arc::new(Recorder::default());
        let recording = Device::new(&Config { recorder: Some(Arc::clone(&recorder)), ..Config::default() }).unwrap();
        recorder.begin_frame(0, bounds);
        let pictures = [&quiet, &recording].map(|device| {
            let draw = draw(seed, 3000, defaults(), device, bounds);
            assert_eq!(draw.record.is_some(), device.runtime().config().recorder.is_some());
            if let Some((recorder, record)) = device.runtime().recorder().zip(draw.record.as_ref()) {
                recorder.add_draw(0, record);
            }
            let mut tile = Box::new(GaussianTile::default());
            let mut counters = Counters::default();
            let mut pixels = Vec::new();
            for (y, x) in (0..8).flat_map(|y| (0..8).map(move |x| (y, x))) {
                if !draw.sorted.tiles.list(x, y).is_empty() {
                    tile.render(&draw, device.level(), x, y, &mut counters);
                    let all = (0..TILE * TILE).map(|at| tile.pixel(at % TILE, at / TILE));
                    pixels.extend(all.map(|pixel| pixel.map(|rgba| rgba.map(f32::to_bits))));
                }
            }
            (pixels, counters, draw.sorted.tiles.pairs())
        });
        let [(without, counters, _), (with, counted, pairs)] = pictures;
        assert!(without == with && !with.is_empty());
        assert_eq!(counters, counted);
        let trace = recorder.trace();
        let work: &DrawWork = &trace.frames[0].draws[0];
        assert_eq!(work.pairs(), pairs);
        assert_eq!(work.needed_pairs(), counted.get(Counter::TilePairsEvaluated));
        let sum = |of: fn(&TileWork) -> u64| work.tiles.iter().map(of).sum::<u64>();
        let reached = sum(|tile| tile.runs.iter().map(|run| u64::from(run.reached)).sum());
        assert_eq!(reached, counted.get(Counter::BlockEvaluations));
        assert_eq!(sum(|tile| tile.contributions), counted.get(Counter::PixelContributions));
        assert!(sum(|tile| u64::from(tile.terminated)) > 0, "some pixels saturate");
        // What finishes stays finished, and a row or block has pixels as long as the tile has.
        for tile in &work.tiles {
            for pair in tile.runs.windows(2) {
                assert!(pair[1].rows <= pair[0].rows && pair[1].blocks <= pair[0].blocks);
            }
            assert!(tile.runs.iter().all(|run| run.rows > 0 && run.blocks > 0));
        }
        assert!(work.boxed_pairs > 0 && work.preprocess.bytes > 0.0 && work.sort.bytes > 0.0);
    }
}
