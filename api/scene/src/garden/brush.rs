//! Builds the garden from splats, which have y up, and converts them to Gaussians of a scene.

use glam::{DQuat, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::light;
use crate::harmonics::SH_C0;
use crate::random::normal;
use crate::scene::Scene;
use crate::shape::GaussianShape;

/// One Gaussian before it is in a scene.
pub(super) struct Splat {
    pub(super) position: DVec3,
    pub(super) rotation: DQuat,
    pub(super) scale: DVec3,
    pub(super) opacity: f64,
    pub(super) colour: DVec3,
    /// Bright spots that the surface reflects: for each, the direction from the eye in which the reflection is seen,
    /// and its colour.
    pub(super) shine: Vec<(DVec3, DVec3)>,
}

impl Splat {
    /// A matte, opaque ball.
    pub(super) fn new(position: DVec3, size: f64, colour: DVec3) -> Self {
        Self {
            position,
            rotation: DQuat::IDENTITY,
            scale: DVec3::splat(size),
            opacity: 0.95,
            colour,
            shine: Vec::new(),
        }
    }
}

/// A scene under construction, and its random numbers.
pub(super) struct Brush {
    rng: ChaCha8Rng,
    scene: Scene,
}

impl Brush {
    pub(super) fn new(seed: u64, count: usize) -> Self {
        Self { rng: ChaCha8Rng::seed_from_u64(seed), scene: Scene::with_capacity(3, count) }
    }

    pub(super) fn finish(self) -> Scene {
        self.scene
    }

    /// A number evenly distributed from `low` to `high`.
    pub(super) fn even(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.rng.random::<f64>()
    }

    /// A number normally distributed with mean 0.
    pub(super) fn normal(&mut self, deviation: f64) -> f64 {
        deviation * normal(&mut self.rng)
    }

    /// An evenly distributed direction.
    pub(super) fn direction(&mut self) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| normal(&mut self.rng))).normalize_or(DVec3::Y)
    }

    /// An evenly distributed point of the disc of `radius` on the ground.
    pub(super) fn on_disc(&mut self, radius: f64) -> DVec3 {
        let (sin, cos) = libm::sincos(self.even(0.0, std::f64::consts::TAU));
        let radius = radius * self.even(0.0, 1.0).sqrt();
        DVec3::new(radius * cos, 0.0, radius * sin)
    }

    /// Adds a splat to the scene.
    pub(super) fn paint(&mut self, splat: &Splat) {
        let mut sh = [DVec3::ZERO; 16];
        sh[0] = (splat.colour - DVec3::splat(0.5)) / SH_C0;
        for (axis, colour) in &splat.shine {
            for (sum, lobe) in sh.iter_mut().zip(light::lobe(turn(*axis), *colour)) {
                *sum += lobe;
            }
        }
        let DQuat { x, y, z, w } = splat.rotation.normalize();
        let shape = GaussianShape {
            scale: splat.scale.as_vec3().to_array(),
            rotation: [w, x, -y, -z].map(|c| c as f32),
            opacity: splat.opacity as f32,
        };
        let position = turn(splat.position).as_vec3().to_array();
        let sh = sh.map(|c| c.as_vec3().to_array());
        self.scene.push(position, shape, &sh);
    }
}

/// Converts from y up to the scene's frame, y down: half a turn around x.
pub(super) fn turn(v: DVec3) -> DVec3 {
    DVec3::new(v.x, -v.y, -v.z)
}
