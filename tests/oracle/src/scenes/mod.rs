//! Generated scenes for tests and benchmarks that need no file. The same seed gives the same scene.

mod edit;
mod synthetic;
mod trained_like;

use gaurast_scene::Scene;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::oracle::spherical_harmonics::coefficient_count;
use crate::oracle::{OracleCamera, OracleModel, OracleScene};
pub use edit::{moved, partly_moved_away, scaled, shuffled_with, view_independent};
pub use synthetic::{synthetic, synthetic_camera};
pub use trained_like::trained_like;

/// One Gaussian, with attributes as [`OracleScene`] has them.
#[derive(Clone, Debug, PartialEq)]
pub struct Gaussian {
    /// Centre in world space.
    pub position: [f32; 3],
    /// Standard deviations along its own axes.
    pub scale: [f32; 3],
    /// Quaternion `w, x, y, z`.
    pub rotation: [f32; 4],
    /// Opacity.
    pub opacity: f32,
    /// `(degree + 1)^2` coefficients.
    pub sh: Vec<[f32; 3]>,
}

/// The attributes of a scene, each in a vector of its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneBuffers {
    /// Centres in world space.
    pub positions: Vec<[f32; 3]>,
    /// Standard deviations.
    pub scales: Vec<[f32; 3]>,
    /// Quaternions `w, x, y, z`.
    pub rotations: Vec<[f32; 4]>,
    /// Opacities.
    pub opacities: Vec<f32>,
    /// `(degree + 1)^2` coefficients for each Gaussian.
    pub sh: Vec<[f32; 3]>,
    /// Degree of the coefficients.
    pub degree: u32,
}

impl SceneBuffers {
    /// A scene of these Gaussians, all of which have `(degree + 1)^2` coefficients.
    pub fn new(degree: u32, gaussians: impl IntoIterator<Item = Gaussian>) -> Self {
        let mut scene = Self { degree, ..Self::default() };
        for gaussian in gaussians {
            assert_eq!(gaussian.sh.len(), coefficient_count(degree));
            scene.positions.push(gaussian.position);
            scene.scales.push(gaussian.scale);
            scene.rotations.push(gaussian.rotation);
            scene.opacities.push(gaussian.opacity);
            scene.sh.extend(gaussian.sh);
        }
        scene
    }

    /// The scene as the oracle takes it, drawn at the degree stored.
    pub fn as_oracle(&self) -> OracleScene<'_> {
        OracleScene {
            positions: &self.positions,
            scales: &self.scales,
            rotations: &self.rotations,
            opacities: &self.opacities,
            sh: &self.sh,
            stored_degree: self.degree,
            requested_degree: self.degree,
            instances: &[],
        }
    }
}

impl From<&Scene> for SceneBuffers {
    /// The scene as the oracle takes it.
    fn from(scene: &Scene) -> Self {
        let shapes = scene.shapes();
        Self {
            positions: scene.positions().to_vec(),
            scales: shapes.iter().map(|shape| shape.scale).collect(),
            rotations: shapes.iter().map(|shape| shape.rotation).collect(),
            opacities: shapes.iter().map(|shape| shape.opacity).collect(),
            sh: scene.sh().to_vec(),
            degree: scene.sh_degree(),
        }
    }
}

/// A camera at the origin that looks along +z, 64 degrees wide, with a centred principal point.
pub fn camera(width: u32, height: u32) -> OracleCamera {
    let focal = 0.8 * width as f32;
    OracleCamera {
        model: OracleModel::Pinhole,
        width,
        height,
        rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        eye: [0.0; 3],
        focal: [focal, focal],
        principal: [0.5 * width as f32, 0.5 * height as f32],
        near: 0.2,
        far: f32::INFINITY,
        lens: None,
    }
}

/// Gaussians as a trained scene has them: most of them small and flat, some large, many faint,
/// 2 to 12 units in front of [`camera`] and a little beyond its sides.
pub fn cloud(seed: u64, count: usize, degree: u32) -> SceneBuffers {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let gaussians = (0..count).map(|_| {
        let z = rng.random_range(2.0_f32..12.0);
        let size = 0.012 * libm::expf(rng.random_range(-1.2_f32..1.2) + rng.random_range(-1.2_f32..1.2));
        let opaque = rng.random_bool(0.4);
        Gaussian {
            position: [z * rng.random_range(-0.75..0.75), z * rng.random_range(-0.75..0.75), z],
            scale: [size, size * rng.random_range(0.2..1.0), size * rng.random_range(0.02..0.4)],
            rotation: quaternion(&mut rng),
            opacity: if opaque { rng.random_range(0.6..1.0) } else { rng.random_range(0.002..0.6) },
            sh: coefficients(&mut rng, degree),
        }
    });
    SceneBuffers::new(degree, gaussians)
}

/// Gaussians that are hard to draw in front of [`camera`]: huge, tiny and needle-shaped ones, some
/// behind the camera or next to it, some at the same depth, some with attributes for which they
/// are skipped.
pub fn awkward(seed: u64, count: usize, degree: u32) -> SceneBuffers {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let gaussians = (0..count).map(|_| {
        let z = match rng.random_range(0..6) {
            0 => rng.random_range(-3.0_f32..0.3),
            1 => 4.0,
            2 => rng.random_range(0.19..0.25),
            _ => rng.random_range(0.3..10.0),
        };
        let scale = match rng.random_range(0..6) {
            0 => [rng.random_range(10.0..1e6_f32); 3],
            1 => [rng.random_range(1e-9..1e-4_f32); 3],
            2 => [rng.random_range(1.0..100.0_f32), 1e-4, 1e-4],
            3 => [0.0, rng.random_range(0.0..0.5), rng.random_range(0.0..0.5)],
            _ => std::array::from_fn(|_| rng.random_range(0.001..0.3)),
        };
        let mut gaussian = Gaussian {
            position: [rng.random_range(-4.0..4.0), rng.random_range(-4.0..4.0), z],
            scale,
            rotation: quaternion(&mut rng),
            opacity: match rng.random_range(0..4) {
                0 => rng.random_range(0.0..0.006),
                1 => rng.random_range(1.0..50.0),
                _ => rng.random_range(0.0..1.0),
            },
            sh: coefficients(&mut rng, degree),
        };
        match rng.random_range(0..40) {
            0 => gaussian.position[1] = f32::NAN,
            1 => gaussian.scale[2] = f32::INFINITY,
            2 => gaussian.rotation = [0.0; 4],
            3 => gaussian.scale[0] = -1.0,
            4 => gaussian.rotation = gaussian.rotation.map(|c| c * 1e-30),
            5 => gaussian.opacity = f32::NAN,
            _ => {}
        }
        gaussian
    });
    SceneBuffers::new(degree, gaussians)
}

/// A random direction in four dimensions, of a random length: quaternions in files are not normalised either.
fn quaternion(rng: &mut ChaCha8Rng) -> [f32; 4] {
    std::array::from_fn(|_| rng.random_range(-2.0..2.0))
}

fn coefficients(rng: &mut ChaCha8Rng, degree: u32) -> Vec<[f32; 3]> {
    (0..coefficient_count(degree))
        .map(|k| {
            let size = if k == 0 { 1.7 } else { 0.3 };
            std::array::from_fn(|_| rng.random_range(-size..size))
        })
        .collect()
}
