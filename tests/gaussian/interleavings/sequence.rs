//! Random sequences of steps.

use ash::vk::CompareOp;
use gaurast_tests::oracle::{OracleCamera, OracleDepthFormat, OracleTests};
use gaurast_tests::scenes::{self, SceneBuffers};
use gaurast_tests::triangles::edges::{Position, UNITS};
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The side of the framebuffer in pixels. With it, clip coordinates that are multiples of 1/64 are multiples of half a
/// pixel.
pub const SIZE: u32 = 64;
/// The number of triangles from which draws select.
pub const TRIANGLES: usize = 24;
/// The number of sets of Gaussians from which draws select.
pub const SCENES: usize = 3;
/// The near and the far plane.
pub const PLANES: [f32; 2] = [1.0, 16.0];

/// A rectangle: x, y, width and height.
pub type Area = [u32; 4];

/// A triangle of one depth. Its colour is in device memory, and steps change it.
#[derive(Clone, Debug)]
pub struct Flat {
    pub corners: [Position; 3],
    pub depth: f32,
    pub color: [f32; 4],
}

/// A comparison, and whether depth is written.
pub type DepthTest = Option<(CompareOp, bool)>;

/// A step of a sequence.
#[derive(Clone, Debug)]
pub enum Step {
    /// Begins a pass with clear values for colour and depth, or loads both.
    BeginPass(Option<([f32; 4], f32)>),
    EndPass,
    Triangles {
        first: usize,
        count: usize,
        /// True for premultiplied "over" blending, false for replacing.
        blends: bool,
        test: DepthTest,
    },
    Gaussians {
        scene: usize,
        test: DepthTest,
    },
    ClearAttachments {
        color: Option<[f32; 4]>,
        depth: Option<f32>,
        area: Area,
    },
    Barrier,
    /// Every triangle's colour becomes `color / 2 + 1/4`.
    Dispatch,
    ClearImage([f32; 4]),
    /// Copies texels to a buffer and from there to another place of the image.
    CopyThroughBuffer {
        from: Area,
        to: [u32; 2],
    },
    /// Copies one triangle's colour to another.
    CopyColor {
        from: usize,
        to: usize,
    },
}

/// A sequence of steps, and the objects that they use.
pub struct Interleaving {
    pub triangles: Vec<Flat>,
    pub scenes: Vec<SceneBuffers>,
    pub camera: OracleCamera,
    pub depth_coefficients: [f32; 2],
    pub steps: Vec<Step>,
}

impl Interleaving {
    pub fn random(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let [near, far] = PLANES;
        let mut interleaving = Self {
            triangles: (0..TRIANGLES).map(|_| triangle(&mut rng)).collect(),
            scenes: (0..SCENES).map(|_| gaussians(&mut rng)).collect(),
            camera: scenes::camera(SIZE, SIZE),
            depth_coefficients: [far / (far - near), -near * far / (far - near)],
            steps: Vec::new(),
        };
        let passes = rng.random_range(2..5);
        for pass in 0..passes {
            let clear = (pass == 0 || rng.random_bool(0.2)).then(|| (color(&mut rng), 1.0));
            interleaving.steps.push(Step::BeginPass(clear));
            for _ in 0..rng.random_range(2..6) {
                interleaving.steps.push(inside(&mut rng));
            }
            interleaving.steps.push(Step::EndPass);
            for _ in 0..rng.random_range(0..4) {
                interleaving.steps.push(outside(&mut rng));
            }
        }
        interleaving
    }

    /// The tests of a Gaussian draw.
    pub fn tests(&self, test: DepthTest) -> OracleTests {
        OracleTests {
            negative_one_to_one: false,
            depth_coefficients: self.depth_coefficients,
            depth_range: [0.0, 1.0],
            format: OracleDepthFormat::Float,
            depth: test,
            bounds: None,
            stencil: None,
        }
    }
}

fn color(rng: &mut ChaCha8Rng) -> [f32; 4] {
    let alpha = rng.random_range(0.2..1.0f32);
    let [r, g, b] = [0; 3].map(|_| alpha * rng.random_range(0.0..1.0f32));
    [r, g, b, alpha]
}

/// A random depth of a small set, so that some depths are equal.
fn depth(rng: &mut ChaCha8Rng) -> f32 {
    *[0.6, 0.7, 0.8, 0.85, 0.9, 0.95].choose(rng).unwrap()
}

fn triangle(rng: &mut ChaCha8Rng) -> Flat {
    let spread = *[12, 40, 70].choose(rng).unwrap();
    let middle = [0; 2].map(|_| rng.random_range(-50..50));
    loop {
        let corners: [Position; 3] = std::array::from_fn(|_| {
            let [x, y] = middle.map(|at: i64| at + rng.random_range(-spread..=spread));
            [x, y, 0, UNITS]
        });
        let [a, b, c] = corners;
        if (b[0] - a[0]) * (c[1] - a[1]) != (b[1] - a[1]) * (c[0] - a[0]) {
            return Flat { corners, depth: depth(rng), color: color(rng) };
        }
    }
}

/// A few random Gaussians, large enough to cover much of the picture.
fn gaussians(rng: &mut ChaCha8Rng) -> SceneBuffers {
    let mut scene = scenes::cloud(rng.random(), rng.random_range(1..60), 0);
    for scale in &mut scene.scales {
        *scale = scale.map(|s| 12.0 * s);
    }
    scene
}

fn area(rng: &mut ChaCha8Rng) -> Area {
    let [x, y] = [0; 2].map(|_| rng.random_range(0..SIZE - 8));
    let size = |rng: &mut ChaCha8Rng, at: u32| rng.random_range(1..=SIZE - at);
    [x, y, size(rng, x), size(rng, y)]
}

fn test(rng: &mut ChaCha8Rng) -> DepthTest {
    let ops = [
        CompareOp::LESS,
        CompareOp::LESS,
        CompareOp::LESS_OR_EQUAL,
        CompareOp::GREATER,
        CompareOp::NOT_EQUAL,
        CompareOp::ALWAYS,
    ];
    rng.random_bool(0.8).then(|| (*ops.choose(rng).unwrap(), rng.random()))
}

/// A random step within a pass.
fn inside(rng: &mut ChaCha8Rng) -> Step {
    match rng.random_range(0..10) {
        0..4 => {
            let first = rng.random_range(0..TRIANGLES);
            Step::Triangles {
                first,
                count: rng.random_range(1..=TRIANGLES - first).min(8),
                blends: rng.random(),
                test: test(rng),
            }
        }
        4..8 => Step::Gaussians { scene: rng.random_range(0..SCENES), test: test(rng) },
        8 => {
            let clears_color: bool = rng.random();
            Step::ClearAttachments {
                color: clears_color.then(|| color(rng)),
                depth: (!clears_color || rng.random()).then(|| depth(rng)),
                area: area(rng),
            }
        }
        _ => Step::Barrier,
    }
}

/// A random step between passes.
fn outside(rng: &mut ChaCha8Rng) -> Step {
    match rng.random_range(0..10) {
        0..4 => Step::Dispatch,
        4 => Step::ClearImage(color(rng)),
        5..8 => {
            let from = area(rng);
            let [_, _, width, height] = from;
            let place = |rng: &mut ChaCha8Rng, size| rng.random_range(0..=SIZE - size);
            Step::CopyThroughBuffer { from, to: [place(rng, width), place(rng, height)] }
        }
        _ => Step::CopyColor { from: rng.random_range(0..TRIANGLES), to: rng.random_range(0..TRIANGLES) },
    }
}

/// The contents of the attachments: colours, and depths as bits.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    pub color: Vec<[f32; 4]>,
    pub depth: Vec<u32>,
}
