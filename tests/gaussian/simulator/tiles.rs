//! Lists of tiles for the rasterizer module: those of scenes, and generated ones that are difficult.

use gaurast_oracle::oracle::project::project;
use gaurast_oracle::oracle::splat::Splat;
use gaurast_oracle::oracle::{OracleCamera, OracleState};
use gaurast_oracle::scenes::SceneBuffers;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use simdevice::timing::work::Mode;
use std::path::Path;
use timing_studies::module::{Groups, List, Primitive};
use timing_studies::number::Format;
use timing_studies::pe::{Gaussian, Triangle};
use timing_studies::rtl_cycles::Setting;

const SIDE: f64 = 16.0;

/// Projected Gaussians of a scene in depth order.
pub struct View {
    splats: Vec<Splat>,
    size: [u32; 2],
}

impl View {
    /// Opens the scene of a file, seen from a camera that has its middle in the picture.
    pub fn open(path: &Path, size: [u32; 2]) -> Self {
        let scene = gaurast_scene::open(path).expect("a scene");
        let camera = gaurast_scene::frame_middle(&scene, 60.0, size);
        let camera = OracleCamera::new(&camera.to_vulkan(), size).expect("a camera");
        let (buffers, state) = (SceneBuffers::from(&scene), OracleState::default());
        let oracle = buffers.as_oracle();
        let drawn = |index| project(&oracle, &camera, &state, index).ok();
        let mut splats: Vec<_> = (0..oracle.len()).filter_map(drawn).collect();
        splats.sort_by(|a, b| a.key.total_cmp(&b.key));
        Self { splats, size }
    }

    /// The lists of `count` random tiles that are not empty, selected by a seed.
    pub fn lists(&self, format: Format, groups: Option<Groups>, count: usize, seed: u64) -> Vec<List> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let [columns, rows] = self.size.map(|side| side.div_ceil(SIDE as u32));
        let mut tiles: Vec<_> = (0..columns * rows).map(|index| [index % columns, index / columns]).collect();
        let mut lists = Vec::new();
        while lists.len() < count && !tiles.is_empty() {
            let at = tiles.swap_remove(random.random_range(0..tiles.len()));
            lists.extend(self.list(format, groups, at));
        }
        lists
    }

    fn list(&self, format: Format, groups: Option<Groups>, at: [u32; 2]) -> Option<List> {
        let corner = at.map(|at| f64::from(at) * SIDE);
        let primitives: Vec<_> = self
            .splats
            .iter()
            .filter(|splat| boxes_touch(splat, corner))
            .filter_map(|splat| primitive(splat, format, groups, corner))
            .collect();
        (!primitives.is_empty()).then_some(List { mode: Mode::Gaussian, primitives })
    }
}

/// The distance along an axis at which alpha reaches its floor.
fn reach(splat: &Splat, axis: usize) -> f64 {
    let variance = [splat.covariance[0], splat.covariance[2]][axis];
    let square: f64 = 2.0 * (splat.opacity * 255.0).ln().max(0.0) * variance;
    square.sqrt()
}

fn boxes_touch(splat: &Splat, corner: [f64; 2]) -> bool {
    (0..2).all(|axis| {
        let (mean, reach) = (splat.mean[axis], reach(splat, axis));
        mean + reach > corner[axis] && mean - reach < corner[axis] + SIDE
    })
}

/// A Gaussian of a tile's list, evaluated at all pixels or only in the groups in which it covers a pixel's centre.
fn primitive(splat: &Splat, format: Format, groups: Option<Groups>, corner: [f64; 2]) -> Option<Primitive> {
    let [xx, xy, yy] = splat.covariance;
    let exponent = [-0.5 * yy, xy, -0.5 * xx].map(|value| value / splat.determinant);
    let mean = [0, 1].map(|axis| splat.mean[axis] - corner[axis]);
    let mask = match groups {
        None => u16::MAX,
        Some(groups) => reached(groups, mean, exponent, splat.opacity),
    };
    let gaussian = Gaussian::new(
        format,
        mean.map(|value| value as f32),
        exponent.map(|value| value as f32),
        splat.opacity as f32,
        splat.color.map(|value| value as f32),
    );
    (mask != 0).then_some(Primitive::Gaussian(mask, gaussian))
}

fn reached(groups: Groups, mean: [f64; 2], [a, b, c]: [f64; 3], opacity: f64) -> u16 {
    let is_reached = |group: usize| {
        (0..16).any(|lane| {
            let [x, y] = groups.centre(group, lane).map(f64::from);
            let (dx, dy) = (x - mean[0], y - mean[1]);
            opacity * (a * dx * dx + b * dx * dy + c * dy * dy).exp() >= 1.0 / 255.0
        })
    };
    (0..16).fold(0, |mask, group| mask | u16::from(is_reached(group)) << group)
}

/// A kind of generated Gaussians.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Gaussians a hundred times as long as wide.
    Needles,
    /// Nearly opaque Gaussians as large as the tile, so that pixels saturate before the end of the list.
    Saturated,
    /// Gaussians of all sizes and opacities.
    Mixed,
    /// Small Gaussians in single groups.
    Sparse,
}

pub const KINDS: [Kind; 4] = [Kind::Needles, Kind::Saturated, Kind::Mixed, Kind::Sparse];

/// A generated list of Gaussians.
pub fn gaussians(format: Format, groups: Option<Groups>, kind: Kind, random: &mut ChaCha8Rng) -> List {
    let count = match kind {
        Kind::Saturated => random.random_range(60..300),
        _ => random.random_range(1..200),
    };
    let mut primitives = Vec::new();
    while primitives.len() < count {
        let scale = |random: &mut ChaCha8Rng, low: f64, high: f64| random.random_range(low..high).exp();
        let sigmas = match kind {
            Kind::Needles => {
                let short = scale(random, -0.7, 0.7);
                [100.0 * short, short]
            }
            Kind::Saturated => [scale(random, 2.5, 4.0), scale(random, 2.5, 4.0)],
            Kind::Mixed => [scale(random, -0.6, 4.0), scale(random, -0.6, 4.0)],
            Kind::Sparse => [scale(random, -0.6, 0.2), scale(random, -0.6, 0.2)],
        };
        let opacity = match kind {
            Kind::Saturated => random.random_range(0.6..1.0),
            _ => random.random_range(0.01..1.0),
        };
        let (sin, cos) = random.random_range(0.0..std::f64::consts::PI).sin_cos();
        let [u, v] = sigmas.map(|sigma| sigma.powi(-2));
        let [a, b, c] = [u * cos * cos + v * sin * sin, 2.0 * (u - v) * sin * cos, u * sin * sin + v * cos * cos];
        let exponent = [a, b, c].map(|value| -0.5 * value);
        let mean = [0; 2].map(|_| random.random_range(-4.0..20.0));
        let mask = groups.map_or(u16::MAX, |groups| reached(groups, mean, exponent, opacity));
        if mask == 0 && random.random_bool(0.9) {
            continue;
        }
        let gaussian = Gaussian::new(
            format,
            mean.map(|value| value as f32),
            exponent.map(|value| value as f32),
            opacity as f32,
            [0; 3].map(|_| random.random_range(0.0..1.5)),
        );
        primitives.push(Primitive::Gaussian(mask, gaussian));
    }
    List { mode: Mode::Gaussian, primitives }
}

/// A generated list of triangles, some of them needles, each of which covers a part of the tile.
pub fn triangles(format: Format, groups: Groups, random: &mut ChaCha8Rng) -> List {
    let count = random.random_range(1..80);
    let mut primitives = Vec::new();
    while primitives.len() < count {
        let thin = random.random_bool(0.3);
        let mut vertex = || [0, 1].map(|_| random.random_range(-10.0..26.0f64));
        let (p, q, mut r) = (vertex(), vertex(), vertex());
        if thin {
            r = [q[0] + 0.3, q[1] - 0.4];
        }
        let inverse = [0; 3].map(|_| random.random_range(0.05..1.0f64));
        let area = (q[0] - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (q[1] - p[1]);
        if area.abs() < 0.5 {
            continue;
        }
        let plane = |values: [f64; 3]| {
            let [d1, d2] = [values[1] - values[0], values[2] - values[0]];
            let a = (d1 * (r[1] - p[1]) - d2 * (q[1] - p[1])) / area;
            let b = (d2 * (q[0] - p[0]) - d1 * (r[0] - p[0])) / area;
            [a, b, values[0] - a * p[0] - b * p[1]].map(|value| value as f32)
        };
        let planes = [plane([0.0, inverse[1], 0.0]), plane([0.0, 0.0, inverse[2]]), plane(inverse)];
        let weight = |[a, b, c]: [f32; 3], x: f32, y: f32| a * x + b * y + c;
        let covers = |group: usize| {
            (0..16).any(|lane| {
                let [x, y] = groups.centre(group, lane);
                let [u, v, w] = planes.map(|plane| weight(plane, x, y));
                u > -0.01 && v > -0.01 && w - u - v > -0.01
            })
        };
        let mask = (0..16).fold(0, |mask, group| mask | u16::from(covers(group)) << group);
        if mask != 0 {
            primitives.push(Primitive::Triangle(mask, Triangle::new(format, planes)));
        }
    }
    List { mode: Mode::Triangle, primitives }
}

/// Generated lists: each kind of Gaussians, then triangles, and again from the first.
pub fn generated(format: Format, groups: Groups, masked: bool, count: usize, seed: u64) -> Vec<List> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let list = |index: usize| match KINDS.get(index % (KINDS.len() + 1)) {
        Some(&kind) => gaussians(format, masked.then_some(groups), kind, &mut random),
        None => triangles(format, groups, &mut random),
    };
    (0..count).map(list).collect()
}

/// Generated lists of 1 to 24 primitives, of which some saturate their tile.
pub fn short(format: Format, setting: Setting, count: usize) -> Vec<List> {
    let mut lists = generated(format, setting.groups, setting.masked, count, setting.seed + 100);
    for (index, list) in lists.iter_mut().enumerate() {
        list.primitives.truncate(1 + index * 7 % 24);
    }
    lists
}
