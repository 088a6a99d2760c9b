//! The kernels of a Gaussian draw: `cargo bench -p gaurast-simdevice [NAME]`, by the SIMD level in `GAURAST_SIMD`.
//!
//! Projection is timed for each degree of spherical harmonics, whose evaluation is the difference; the stages behind it
//! see nothing of Gaussians that are off the screen. The tile kernel works on one tile that stays in the first-level
//! cache: its throughput is the roof for whole frames.

use divan::Bencher;
use divan::counter::ItemsCount;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use simdevice::gaussian::sort::radix;
use simdevice::gaussian::{BinnedDraw, GaussianSet, sort_and_bin};
use simdevice::packet::*;
use simdevice::raster::gaussian::GaussianTile;
use simdevice::runtime::SimdLevel;
use simdevice::state::gaussian::{Camera, CameraModel, GaussianState};
use simdevice::state::{Rect, Viewport};
use simdevice::stats::counters::{Counter, Counters};
use simdevice::{Allocation, BufferRange, Config, Device, Format};
use std::sync::Arc;

const WIDTH: u32 = 1280;
const HEIGHT: u32 = 720;

fn main() {
    divan::main();
}

/// A device of one thread.
fn device() -> Device {
    let name = std::env::var("GAURAST_SIMD").unwrap_or_else(|_| "best".to_owned());
    let config = Config {
        threads: 1,
        simd: SimdLevel::from_name(&name).expect("a SIMD level in GAURAST_SIMD"),
        ..Config::default()
    };
    Device::new(&config).expect("a device")
}

/// Gaussians, each of position 3, scale 3, rotation 4, opacity 1 and coefficients 48.
type Gaussian = [f32; 59];

/// Small Gaussians before [`begin`]'s camera, or beside what it sees.
fn cloud(count: usize, visible: bool) -> Vec<Gaussian> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let aside = if visible { 0.0 } else { 100.0 };
    (0..count)
        .map(|_| {
            let mut out = [0.0; 59];
            let z = rng.random_range(4.0..12.0_f32);
            out[0] = aside + z * rng.random_range(-0.6..0.6_f32);
            out[1] = z * rng.random_range(-0.35..0.35_f32);
            out[2] = z;
            for scale in &mut out[3..6] {
                *scale = 0.012 * rng.random_range(-1.0..1.0_f32).exp();
            }
            for part in &mut out[6..10] {
                *part = rng.random_range(-1.0..1.0);
            }
            out[10] = rng.random_range(0.01..1.0);
            for coefficient in &mut out[11..] {
                *coefficient = rng.random_range(-0.1..0.1);
            }
            out
        })
        .collect()
}

/// Gaussians of the first tile, too faint to saturate it, that cover it or a pixel each.
fn tile(count: usize, whole: bool) -> Vec<Gaussian> {
    (0..count)
        .map(|index| {
            let mut out = [0.0; 59];
            let (scale, opacity) = if whole { (4.0, 0.009) } else { (0.001, 0.05) };
            // A pixel is 0.01 at this distance.
            let place = |cell: usize, size: u32| 0.01 * (cell as f32 + 0.5 - size as f32 / 2.0);
            out[0] = place(index % 16, WIDTH);
            out[1] = place(index / 16 % 16, HEIGHT);
            out[2] = 10.0 + 1e-4 * index as f32;
            out[3..6].fill(scale);
            out[6] = 1.0;
            out[10] = opacity;
            out
        })
        .collect()
}

fn append(gaussians: &[Gaussian], degree: u32) -> GaussianAppend {
    let size = size_of_val(gaussians) as u64;
    let memory = Allocation::new(size, false).expect("memory");
    memory.write(0, gaussians).expect("it fits");
    let buffer = BufferRange { memory, offset: 0, size };
    let stream = |float: u32, format| AttributeStream {
        buffer: buffer.clone(),
        stride: size_of::<Gaussian>() as u32,
        offset: 4 * float,
        format,
        instance_divisor: None,
    };
    GaussianAppend {
        attributes: GaussianAttributes {
            position: stream(0, Format::R32G32B32Sfloat),
            scale: stream(3, Format::R32G32B32Sfloat),
            rotation: stream(6, Format::R32G32B32A32Sfloat),
            opacity: stream(10, Format::R32Sfloat),
            model: ModelAttributes::default(),
            activations: Default::default(),
            tables: None,
            spherical_harmonics: (0..(degree + 1).pow(2))
                .map(|k| stream(11 + 3 * k, Format::R32G32B32Sfloat))
                .collect(),
        },
        indices: None,
        first: 0,
        count: gaussians.len() as u32,
        first_instance: 0,
        instance_count: 1,
    }
}

fn area() -> Rect {
    Rect { x: 0, y: 0, width: WIDTH, height: HEIGHT }
}

fn begin(degree: u32) -> GaussianBegin {
    GaussianBegin {
        state: Arc::new(GaussianState { sh_degree: degree, ..GaussianState::default() }),
        further_cameras: Vec::new(),
        camera: Camera {
            model: CameraModel::Pinhole,
            rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            eye: [0.0; 3],
            focal_length: [1000.0; 2],
            principal_point: [WIDTH as f32 / 2.0, HEIGHT as f32 / 2.0],
            near_plane: 0.2,
            far_plane: f32::INFINITY,
            depth_coefficients: [0.0; 2],
            distortion: None,
        },
        viewport: Viewport {
            x: 0.0,
            y: 0.0,
            width: WIDTH as f32,
            height: HEIGHT as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        },
        scissor: area(),
    }
}

fn resolve(device: &Device, begin: &GaussianBegin, append: &GaussianAppend) -> BinnedDraw {
    let mut set = GaussianSet::begin(begin, area(), None);
    set.append(append);
    let mut counters = Counters::default();
    sort_and_bin(set, device.runtime(), device.caches(), &mut counters).expect("not too many")
}

const COUNT: usize = 50_000;

/// Reading and culling alone.
#[divan::bench]
fn project_off_screen(bencher: Bencher) {
    let (device, begin) = (device(), begin(3));
    let append = append(&cloud(COUNT, false), 3);
    bencher.counter(ItemsCount::new(COUNT)).bench_local(|| resolve(&device, &begin, &append));
}

/// Everything up to tile lists: reading, projection, colours of the degree, sorting, binning.
#[divan::bench(args = [0, 1, 2, 3])]
fn project_sort_and_bin(bencher: Bencher, degree: u32) {
    let (device, begin) = (device(), begin(degree));
    let append = append(&cloud(COUNT, true), degree);
    bencher.counter(ItemsCount::new(COUNT)).bench_local(|| resolve(&device, &begin, &append));
}

#[divan::bench(args = [1000, 100_000, 1_000_000])]
fn depth_sort(bencher: Bencher, count: usize) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let depth = |rng: &mut ChaCha8Rng| rng.random_range(0.2..100.0_f32).to_bits();
    let pairs: Vec<(u32, u32)> = (0..count as u32).map(|i| (depth(&mut rng), i)).collect();
    bencher.counter(ItemsCount::new(count)).with_inputs(|| pairs.clone()).bench_local_refs(radix::sort_by_key);
}

/// Items are pairs of the tile and a Gaussian.
#[divan::bench(args = [false, true])]
fn tile_pairs(bencher: Bencher, whole: bool) {
    tile_kernel(bencher, whole, |counters| counters.get(Counter::TilePairsEvaluated));
}

/// Items are evaluations of a Gaussian at a pixel.
#[divan::bench(args = [false, true])]
fn tile_pixels(bencher: Bencher, whole: bool) {
    tile_kernel(bencher, whole, |counters| 16 * counters.get(Counter::BlockEvaluations));
}

fn tile_kernel(bencher: Bencher, whole: bool, items: impl Fn(&Counters) -> u64) {
    let device = device();
    let draw = resolve(&device, &begin(0), &append(&tile(512, whole), 0));
    let mut tile = Box::new(GaussianTile::default());
    let mut counters = Counters::default();
    assert!(tile.render(&draw, device.level(), 0, 0, &mut counters));
    bencher
        .counter(ItemsCount::new(items(&counters)))
        .bench_local(|| tile.render(&draw, device.level(), 0, 0, &mut Counters::default()));
}
