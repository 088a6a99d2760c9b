//! The stress scenes. Each has a limit on the distance of its picture from the oracle's envelope, and the reason for
//! this limit. The limits were chosen before the measurements.

use gaurast::vk::{
    GaussianAntialiasingGAURAST, GaussianCameraGAURAST, GaussianCameraModelGAURAST, GaussianPrecisionGAURAST,
    PipelineGaussianStateCreateInfoGAURAST,
};
use gaurast_tests::scenes::{Gaussian, SceneBuffers};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub type State = PipelineGaussianStateCreateInfoGAURAST<'static>;
pub type Camera = GaussianCameraGAURAST<'static>;

/// The accuracy contract's distance, per unit of the greatest colour where that is above 1.
const CONTRACT: f64 = 5e-6;

/// A scene, its camera, and the limit on the picture's error.
#[derive(Clone)]
pub struct Stress {
    pub name: &'static str,
    pub scene: SceneBuffers,
    pub camera: Camera,
    pub state: State,
    pub size: [u32; 2],
    /// Greatest distance of a channel from the oracle's envelope.
    pub limit: f64,
    /// The reason for the limit.
    pub reason: &'static str,
    /// True if the whole scene must be invisible.
    pub is_empty: bool,
}

impl Stress {
    fn new(name: &'static str, reason: &'static str, gaussians: Vec<Gaussian>) -> Self {
        let degree = match gaussians.first().map_or(1, |gaussian| gaussian.sh.len()) {
            1 => 0,
            4 => 1,
            _ => 3,
        };
        Self {
            name,
            scene: SceneBuffers::new(degree, gaussians),
            camera: camera(SIZE, 0.8 * SIZE[0] as f32),
            state: State::default(),
            size: SIZE,
            limit: CONTRACT,
            reason,
            is_empty: false,
        }
    }

    fn seen_by(self, change: impl FnOnce(Camera) -> Camera) -> Self {
        Self { camera: change(self.camera), ..self }
    }

    fn drawn(self, change: impl FnOnce(State) -> State) -> Self {
        Self { state: change(self.state), ..self }
    }

    /// The same scene rasterized in binary16.
    pub fn in_binary16(self) -> Self {
        self.drawn(|state| state.precision(GaussianPrecisionGAURAST::FLOAT16))
    }

    fn sized(self, size: [u32; 2]) -> Self {
        let focal = 0.8 * size[0].max(size[1]) as f32;
        Self { camera: camera(size, focal), size, ..self }
    }

    fn within(self, limit: f64) -> Self {
        Self { limit, ..self }
    }

    fn invisible(self) -> Self {
        Self { is_empty: true, ..self }
    }
}

/// An odd size, so that tiles are cut.
const SIZE: [u32; 2] = [131, 97];

fn camera([width, height]: [u32; 2], focal: f32) -> Camera {
    Camera::default().focal_length([focal; 2]).principal_point([0.5 * width as f32, 0.5 * height as f32])
}

/// A grey Gaussian without rotation.
fn gaussian(position: [f32; 3], scale: [f32; 3], opacity: f32) -> Gaussian {
    Gaussian { position, scale, rotation: [1.0, 0.0, 0.0, 0.0], opacity, sh: vec![[0.3, -0.2, 0.9]] }
}

/// Gaussians in front of the camera with random places, rotations and colours.
fn many(seed: u64, count: usize, change: impl Fn(&mut ChaCha8Rng, &mut Gaussian)) -> Vec<Gaussian> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let one = |_| {
        let z = rng.random_range(2.0..9.0f32);
        let mut one = gaussian(
            [z * rng.random_range(-0.6..0.6), z * rng.random_range(-0.5..0.5), z],
            [0; 3].map(|_| rng.random_range(0.01..0.3)),
            rng.random_range(0.05..1.0),
        );
        one.rotation = [0; 4].map(|_| rng.random_range(-1.0..1.0));
        one.sh = vec![[0; 3].map(|_| rng.random_range(-1.7..1.7))];
        change(&mut rng, &mut one);
        one
    };
    (0..count).map(one).collect()
}

/// `count` layers in front of each other, each wider than the picture.
fn layers(count: usize, opacity: impl Fn(usize) -> f32) -> Vec<Gaussian> {
    let one = |index: usize| {
        let z = 2.0 + index as f32 * 1e-3;
        let color = [0, 1, 2].map(|c| ((index * (3 + c)) % 7) as f32 / 2.0 - 1.5);
        Gaussian { sh: vec![color], ..gaussian([0.0, 0.0, z], [50.0; 3], opacity(index)) }
    };
    (0..count).map(one).collect()
}

const BY_CONTRACT: &str = "the contract: exponents are formed in binary64 and rounded once";
const BY_LAYERS: &str = "the contract: a layer adds half a unit in the last place, and what is behind weighs less";

const BY_WIDE_SUMS: &str = "the contract: where floors are below the usual ones, sums are binary64 and rounded once";

/// Every scene.
pub fn all() -> Vec<Stress> {
    let mut all = shapes();
    all.extend(depths());
    all.extend(compositing());
    all.extend(attributes());
    all.extend(cameras());
    all
}

/// Needles, pancakes, very large, very small and degenerate Gaussians.
fn shapes() -> Vec<Stress> {
    let scaled = |name, seed, scale: fn(&mut ChaCha8Rng) -> [f32; 3]| {
        let gaussians = many(seed, 200, |rng, g| g.scale = scale(rng));
        Stress::new(name, BY_CONTRACT, gaussians)
    };
    const HUGE: f32 = 1e30;
    vec![
        scaled("needles of ratio 1e6", 1, |rng| [rng.random_range(1.0..30.0), 1e-5, 1e-5]),
        scaled("pancakes of ratio 1e6", 2, |rng| {
            let radius = rng.random_range(0.1..3.0);
            [radius, radius, 1e-6]
        }),
        scaled("giants, thousands of screens wide", 3, |rng| [0; 3].map(|_| rng.random_range(1e3..1e5))),
        scaled("specks of 1e-6 px", 4, |_| [1e-7; 3]),
        scaled("deviations beyond 1e9 pixels", 5, |rng| [0; 3].map(|_| rng.random_range(1e8..1e12))),
        scaled("scales near binary32's greatest", 6, |rng| [rng.random_range(1e30..3e38), 1e-3, HUGE]),
        Stress::new(
            "points without a filter",
            "a determinant of zero is skipped",
            many(7, 50, |_, g| g.scale = [0.0; 3]),
        )
        .drawn(|s| s.low_pass_variance(0.0))
        .invisible(),
        Stress::new(
            "lines without a filter",
            "a determinant of zero is skipped, whatever it rounds to",
            vec![gaussian([0.0, 0.0, 4.0], [1.0, 0.0, 0.0], 0.9)],
        )
        .drawn(|s| s.low_pass_variance(0.0))
        .invisible(),
        scaled("nearly singular without a filter", 8, |rng| {
            let radius = rng.random_range(0.1..1.0);
            [radius, radius * 1e-4, 0.0]
        })
        .drawn(|s| s.low_pass_variance(0.0)),
        scaled("sub-pixel, compensated", 9, |rng| [0; 3].map(|_| rng.random_range(1e-6..1e-2))).drawn(compensated),
        scaled("determinants that underflow binary32, compensated", 10, |rng| {
            [rng.random_range(1e-14..1e-11), 1e-13, 1e-12]
        })
        .drawn(|s| compensated(s).alpha_floor(0.0)),
    ]
}

fn compensated(state: State) -> State {
    state.antialiasing(GaussianAntialiasingGAURAST::OPACITY_COMPENSATED)
}

/// Centres at the eye, at the near plane and behind it; equal depths; centres far from the origin.
fn depths() -> Vec<Stress> {
    let next = |z: f32, steps: u32| f32::from_bits(z.to_bits() + steps);
    let at = |z: f32| gaussian([0.01, -0.02, z], [0.05; 3], 0.7);
    let near = 0.2f32;
    let ties = |apart: u32| {
        let one = |index: u32| Gaussian {
            sh: vec![[index as f32 % 3.0 - 1.0, index as f32 % 5.0 - 2.0, 0.3]],
            ..gaussian([0.0, 0.0, next(4.0, index * apart)], [0.4; 3], 0.3)
        };
        // From back to front, so that the order of the draw is not that of depth.
        (0..40).rev().map(one).collect::<Vec<_>>()
    };
    let offset = [1e6f32, -1e6, 1e6];
    let far_away = many(20, 200, |_, g| {
        for (p, o) in g.position.iter_mut().zip(offset) {
            *p += o;
        }
    });
    vec![
        Stress::new(
            "at the eye and about the near plane",
            BY_CONTRACT,
            vec![at(0.0), at(near), at(next(near, 1)), at(f32::from_bits(near.to_bits() - 1)), at(-1.0), at(1e-30)],
        ),
        Stress::new("at the eye", "nothing is in front of it", vec![at(0.0); 3]).invisible(),
        Stress::new(
            "just beyond a tiny near plane",
            BY_CONTRACT,
            many(21, 60, |rng, g| {
                let z = rng.random_range(1e-6..1e-3f32);
                g.position = [z * rng.random_range(-0.5..0.5), z * rng.random_range(-0.4..0.4), z];
                g.scale = [1e-6; 3];
            }),
        )
        .seen_by(|c| c.near_plane(1e-7)),
        Stress::new("exact ties", "ties are broken by position", ties(0)),
        Stress::new("one unit in the last place apart", BY_CONTRACT, ties(1)),
        Stress::new(
            "a million units from the origin",
            "the contract: the eye is binary64, and positions lose nothing in the difference",
            far_away,
        )
        .seen_by(|c| c.eye(offset.map(f64::from))),
        Stress::new(
            "depths from 1e-3 to 1e6",
            BY_CONTRACT,
            many(22, 300, |rng, g| {
                let z = 10f32.powf(rng.random_range(-3.0..6.0));
                g.position = [z * rng.random_range(-0.5..0.5), z * rng.random_range(-0.4..0.4), z];
                g.scale = [0.02 * z; 3];
            }),
        )
        .seen_by(|c| c.near_plane(1e-4)),
        Stress::new("behind a parallel camera", BY_CONTRACT, many(23, 200, |_, g| g.position[2] -= 6.0)).seen_by(|c| {
            c.model(GaussianCameraModelGAURAST::ORTHOGRAPHIC).focal_length([14.0, 17.0]).near_plane(-10.0)
        }),
    ]
}

/// Thousands of layers; opacities at floor and ceiling; floors of zero and ceilings of one.
fn compositing() -> Vec<Stress> {
    let (floor, ceiling) = (1.0f32 / 255.0, 0.99f32);
    let small = |stress: Stress| stress.sized([20, 18]);
    let around = |value: f32| [-1, 0, 1].map(|by| f32::from_bits(value.to_bits().wrapping_add_signed(by)));
    let edges = around(floor).into_iter().chain(around(ceiling)).chain([1.0, 1.5, 1e30]);
    let edges: Vec<_> = (0u8..)
        .zip(edges)
        .map(|(index, opacity)| {
            let x = f32::from(index) * 0.5 - 2.0;
            gaussian([x, 0.1, 5.0 + 0.1 * x], [0.1; 3], opacity)
        })
        .collect();
    let unlimited = |s: State| s.alpha_floor(0.0).alpha_ceiling(1.0).transmittance_floor(0.0);
    vec![
        small(Stress::new("10,000 layers of 1/254", BY_LAYERS, layers(10_000, |_| 1.0 / 254.0))),
        small(Stress::new("10,000 layers of 1/254, to the end", BY_WIDE_SUMS, layers(10_000, |_| 1.0 / 254.0)))
            .drawn(|s| s.transmittance_floor(0.0)),
        small(Stress::new("4,096 layers of 0.004, to the end", BY_WIDE_SUMS, layers(4096, |_| 0.004)))
            .drawn(|s| s.transmittance_floor(0.0)),
        small(Stress::new("4,096 layers of 1/512, to the end", BY_WIDE_SUMS, layers(4096, |_| 1.0 / 512.0)))
            .drawn(|s| s.transmittance_floor(0.0).alpha_floor(1.0 / 1024.0)),
        small(Stress::new("30,000 layers of 1/4096, no floors", BY_WIDE_SUMS, layers(30_000, |_| 1.0 / 4096.0)))
            .drawn(|s| s.transmittance_floor(0.0).alpha_floor(0.0)),
        small(Stress::new(
            "10,000 layers from 1/254 to 0.999",
            BY_WIDE_SUMS,
            layers(10_000, |index| 1.0 / 254.0 + 0.995 * (index % 100) as f32 / 100.0),
        ))
        .drawn(|s| s.transmittance_floor(0.0).alpha_ceiling(0.999)),
        Stress::new("opacities at floor and ceiling", BY_CONTRACT, edges.clone()),
        Stress::new("no floors, no ceiling, no filter", BY_CONTRACT, edges)
            .drawn(|s| unlimited(s).low_pass_variance(0.0)),
        Stress::new("no floors, no ceiling, a cloud", BY_CONTRACT, many(30, 300, |_, _| {})).drawn(unlimited),
        Stress::new(
            "negative and huge colours",
            "the contract, per unit of the greatest colour of 3e5",
            many(31, 200, |rng, g| {
                let size = if rng.random_bool(0.3) { 1e6 } else { 2.0 };
                g.sh = vec![[0; 3].map(|_| rng.random_range(-size..size))];
            }),
        )
        .within(CONTRACT * 3e5),
    ]
}

/// Every attribute zero, huge, denormal or not finite; quaternions of any length.
fn attributes() -> Vec<Stress> {
    let values = [
        0.0,
        -0.0,
        1e-40,
        f32::MIN_POSITIVE,
        1e-20,
        1e20,
        f32::MAX,
        -f32::MAX,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
    ];
    let plain = || {
        let mut plain = gaussian([0.1, 0.2, 5.0], [0.3, 0.2, 0.1], 0.8);
        plain.rotation = [0.9, 0.1, -0.3, 0.2];
        plain.sh = vec![[0.3, 0.2, 0.1]; 4];
        plain
    };
    let mut extremes = Vec::new();
    for value in values {
        for slot in 0..23 {
            let mut one = plain();
            // Each has a different position, unless the position is what is changed.
            one.position[0] += (extremes.len() % 16) as f32 * 0.2 - 1.6;
            one.position[1] += (extremes.len() / 16) as f32 * 0.2 - 1.6;
            match slot {
                0..3 => one.position[slot] = value,
                3..6 => one.scale[slot - 3] = value,
                6..10 => one.rotation[slot - 6] = value,
                10 => one.opacity = value,
                _ => one.sh[(slot - 11) / 3][(slot - 11) % 3] = value,
            }
            extremes.push(one);
        }
    }
    // Colours above the range of all targets are in another scene, because they would hide everything here.
    let is_mild = |g: &Gaussian| {
        let colors = g.sh.as_flattened().iter();
        colors.clone().all(|c| !c.is_finite() || c.abs() < 1e19)
    };
    extremes.retain(is_mild);
    let lengths = |length: f32| {
        many(40, 100, move |_, g| {
            g.rotation = g.rotation.map(|c| c * length);
        })
    };
    vec![
        Stress::new(
            "extremes in every attribute",
            "the contract: what is not finite is skipped, the rest drawn",
            extremes,
        ),
        Stress::new("quaternions of length 1e-20", BY_CONTRACT, lengths(1e-20)),
        Stress::new("quaternions of length 1e20", BY_CONTRACT, lengths(1e20)),
        Stress::new("quaternions that are denormal", BY_CONTRACT, lengths(1e-38)),
    ]
}

/// Fields of view, principal points, unequal focal lengths, non-orthogonal rotations, sizes.
fn cameras() -> Vec<Stress> {
    let cloud = |seed| many(seed, 200, |_, _| {});
    let scene = |name, seed| Stress::new(name, BY_CONTRACT, cloud(seed));
    let focal = |degrees: f32| 0.5 * SIZE[0] as f32 / (0.5 * degrees.to_radians()).tan();
    let wide = |c: Camera| c.focal_length([focal(170.0); 2]);
    let narrow = |c: Camera| c.focal_length([focal(1.0); 2]);
    vec![
        scene("1 degree wide", 50).seen_by(narrow),
        scene("170 degrees wide", 51).seen_by(wide),
        Stress::new(
            "170 degrees wide, at the edge",
            BY_CONTRACT,
            many(52, 200, |rng, g| {
                let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
                g.position[0] = side * g.position[2] * rng.random_range(3.0..14.0);
            }),
        )
        .seen_by(wide),
        scene("fx is not fy", 53).seen_by(|c| c.focal_length([30.0, 310.0])),
        scene("principal point outside the picture", 54).seen_by(|c| c.principal_point([-20.0, 120.0])),
        scene("a camera that shears", 55).seen_by(|c| c.rotation([1.0, 0.4, -0.1, 0.0, 0.7, 0.2, 0.1, -0.3, 1.5])),
        scene("a camera that mirrors", 56).seen_by(|c| c.rotation([-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])),
        scene("a camera that flattens", 57).seen_by(|c| c.rotation([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])),
        scene("one pixel", 58).sized([1, 1]),
        scene("a row of 8192 pixels", 59).sized([8192, 1]),
        scene("a column of 8192 pixels", 60).sized([1, 8192]),
        scene("a fisheye of 300 degrees", 61)
            .seen_by(|c| c.model(GaussianCameraModelGAURAST::FISHEYE).focal_length([25.0; 2]).eye([0.0, 0.0, 5.0])),
    ]
}
