//! Times the stages of a Gaussian draw on a synthetic scene: `gaussian_stages [COUNT] [LEVEL] [THREADS] [DEPTH]`.
//!
//! DEPTH is `none`; `test`, against a depth buffer that nothing is behind; `write`, the same and the median is stored; or
//! `behind`, against one that half of the scene is behind.
//!
//! The scene: 35 % on a sphere shell, 35 % on a plane, 30 % in a box; log-normal scales (median 0.012, sigma
//! 0.6), flattened; random rotations; opacity logit N(0.5, 2); degree 3. 1280x720, focal length 1000 px.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use simdevice::format::ClearValue;
use simdevice::gaussian::{GaussianSet, sort_and_bin};
use simdevice::image::{ImageDesc, ImageKind};
use simdevice::packet::*;
use simdevice::pass::{Pass, PassDraw};
use simdevice::runtime::SimdLevel;
use simdevice::state::gaussian::{Camera, CameraModel, GaussianState};
use simdevice::state::{CompareOp, DepthStencil, DepthTest, Rect, Viewport};
use simdevice::stats::counters::{Counter, Counters};
use simdevice::{Allocation, BufferRange, Config, Device, Format, Image, ImageView};
use std::f64::consts::TAU;
use std::sync::Arc;
use std::time::Instant;

const WIDTH: u32 = 1280;
const HEIGHT: u32 = 720;
const FLOATS: usize = 3 + 8 + 48;

fn normal(rng: &mut ChaCha8Rng, mean: f64, sigma: f64) -> f64 {
    let (a, b): (f64, f64) = (rng.random(), rng.random());
    mean + sigma * (-2.0 * (1.0 - a).ln()).sqrt() * (TAU * b).cos()
}

fn gaussian(rng: &mut ChaCha8Rng) -> [f32; FLOATS] {
    let which: f64 = rng.random();
    let position = if which < 0.35 {
        let v = [0; 3].map(|_| normal(rng, 0.0, 1.0));
        let norm = v.iter().map(|v| v * v).sum::<f64>().sqrt();
        v.map(|v| 1.5 * v / norm)
    } else if which < 0.7 {
        [rng.random_range(-5.0..5.0), 1.6, rng.random_range(-6.0..6.0)]
    } else {
        [rng.random_range(-4.0..4.0), rng.random_range(-2.2..2.2), rng.random_range(-5.0..5.0)]
    };
    let mut scale = [0; 3].map(|_| normal(rng, 0.012f64.ln(), 0.6).exp());
    scale[2] *= normal(rng, -0.7, 0.5).exp();
    let rotation = [0; 4].map(|_| normal(rng, 0.0, 1.0));
    let opacity = 1.0 / (1.0 + (-normal(rng, 0.5, 2.0)).exp());
    let mut out = [0.0; FLOATS];
    let head = position.into_iter().chain(scale).chain(rotation).chain([opacity]);
    for (out, value) in out.iter_mut().zip(head) {
        *out = value as f32;
    }
    for out in &mut out[11..14] {
        *out = normal(rng, 0.0, 1.0) as f32;
    }
    for out in &mut out[14..] {
        *out = normal(rng, 0.0, 0.08) as f32;
    }
    out
}

/// The depth modes: what becomes of depth.
struct Depth {
    test: Option<DepthTest>,
    stored: f32,
}

impl Depth {
    fn new(name: &str) -> Result<Self, String> {
        let test = |write| Some(DepthTest { compare: CompareOp::Less, write });
        // The camera is 6 before the scene's middle, and depths are 1 - 0.2 / z.
        let (test, stored) = match name {
            "none" => (None, 1.0),
            "test" => (test(false), 1.0),
            "write" => (test(true), 1.0),
            "behind" => (test(false), 1.0 - 0.2 / 6.0),
            other => return Err(format!("no DEPTH is called {other}")),
        };
        Ok(Self { test, stored })
    }
}

fn attachment(format: Format, clear: ClearValue) -> Result<Attachment, Box<dyn std::error::Error>> {
    let desc = ImageDesc {
        kind: ImageKind::D2,
        format,
        extent: [WIDTH, HEIGHT, 1],
        mip_levels: 1,
        array_layers: 1,
        samples: 1,
    };
    let memory = Allocation::new(desc.memory_size().ok_or("too large")?, false)?;
    let view = ImageView {
        image: Arc::new(Image::new(desc, memory, 0)?),
        format,
        base_mip_level: 0,
        level_count: 1,
        base_layer: 0,
        layer_count: 1,
    };
    Ok(Attachment { view, load: LoadOp::Clear(clear), store: StoreOp::Store, resolve: None })
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let count: u32 = arguments.next().map_or(Ok(300_000), |text| text.parse())?;
    let simd = arguments.next().unwrap_or_else(|| "best".into());
    let simd = SimdLevel::from_name(&simd).ok_or("an unknown SIMD level")?;
    let threads = arguments.next().map_or(Ok(1), |text| text.parse())?;
    let depth = Depth::new(arguments.next().as_deref().unwrap_or("none"))?;
    let device = Device::new(&Config { threads, simd, ..Config::default() })?;

    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let scene: Vec<[f32; FLOATS]> = (0..count).map(|_| gaussian(&mut rng)).collect();
    let part = |range: std::ops::Range<usize>| -> Result<_, Box<dyn std::error::Error>> {
        let floats: Vec<f32> = scene.iter().flat_map(|g| g[range.clone()].to_vec()).collect();
        let size = 4 * floats.len() as u64;
        let memory = Allocation::new(size, false)?;
        memory.write(0, &floats)?;
        Ok((BufferRange { memory, offset: 0, size }, 4 * range.len() as u32))
    };
    let stream = |(buffer, stride): &(BufferRange, u32), offset, format| AttributeStream {
        buffer: buffer.clone(),
        stride: *stride,
        offset,
        format,
        instance_divisor: None,
    };
    let (position, shape, harmonics) = (part(0..3)?, part(3..11)?, part(11..59)?);
    let append = GaussianAppend {
        attributes: GaussianAttributes {
            position: stream(&position, 0, Format::R32G32B32Sfloat),
            scale: stream(&shape, 0, Format::R32G32B32Sfloat),
            rotation: stream(&shape, 12, Format::R32G32B32A32Sfloat),
            opacity: stream(&shape, 28, Format::R32Sfloat),
            model: ModelAttributes::default(),
            activations: Default::default(),
            spherical_harmonics: (0..16).map(|k| stream(&harmonics, 12 * k, Format::R32G32B32Sfloat)).collect(),
        },
        indices: None,
        first: 0,
        count,
        first_instance: 0,
        instance_count: 1,
    };
    let area = Rect { x: 0, y: 0, width: WIDTH, height: HEIGHT };
    let begin = GaussianBegin {
        state: Arc::new(GaussianState {
            sh_degree: 3,
            depth_stencil: DepthStencil { depth: depth.test, ..DepthStencil::default() },
            ..GaussianState::default()
        }),
        further_cameras: Vec::new(),
        camera: Camera {
            model: CameraModel::Pinhole,
            rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            eye: [0.0, 0.0, -6.0],
            focal_length: [1000.0; 2],
            principal_point: [WIDTH as f32 / 2.0, HEIGHT as f32 / 2.0],
            near_plane: 0.2,
            far_plane: f32::INFINITY,
            depth_coefficients: [1.0, -0.2],
        },
        viewport: Viewport {
            x: 0.0,
            y: 0.0,
            width: WIDTH as f32,
            height: HEIGHT as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        },
        scissor: area,
    };
    let rendering = Rendering {
        area,
        layer_count: 1,
        view_mask: 0,
        color: vec![Some(attachment(Format::R8G8B8A8Unorm, ClearValue::Float([0.0; 4]))?)],
        depth: Some(attachment(Format::D32Sfloat, ClearValue::DepthStencil { depth: depth.stored, stencil: 0 })?),
        stencil: None,
    };
    let mut times: Vec<[f64; 4]> = Vec::new();
    let mut last = Counters::default();
    for _ in 0..9 {
        let mut counters = Counters::default();
        let mut set = GaussianSet::begin(&begin, area, Some(Format::D32Sfloat));
        set.append(&append);
        let draw = sort_and_bin(set, device.runtime(), device.caches(), &mut counters)?;
        let started = Instant::now();
        let mut pass = Pass::begin(&rendering)?;
        pass.push(PassDraw::Gaussians(Box::new(draw)), device.runtime(), &mut counters)?;
        pass.end(device.runtime(), &mut counters)?;
        let raster = started.elapsed().as_secs_f64() * 1e3;
        let ms = |counter| counters.get(counter) as f64 / 1e6;
        times.push([ms(Counter::PreprocessTime), ms(Counter::SortTime), ms(Counter::BinningTime), raster]);
        last = counters;
    }
    for (stage, name) in ["preprocess", "sort", "binning", "raster"].iter().enumerate() {
        let mut stage: Vec<f64> = times.iter().map(|time| time[stage]).collect();
        stage.sort_by(f64::total_cmp);
        println!("{name:>18}: {:8.2} ms (median of 9)", stage[4]);
    }
    for counter in Counter::ALL {
        println!("{:>24}: {}", counter.info().name, last.get(*counter));
    }
    Ok(())
}
