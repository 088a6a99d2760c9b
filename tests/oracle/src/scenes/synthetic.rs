//! The synthetic scene that performance is measured on.

use std::f64::consts::TAU;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use gaurast_scene::camera::{Camera, DEFAULT_NEAR, Model};
use gaurast_scene::random::normal;
use gaurast_scene::{Distortion, GaussianShape, SH_C0, Scene, sigmoid};

/// `count` Gaussians of degree 3 as trained scenes have them: 35 % on a sphere of radius 1.5,
/// 35 % on the plane y = 1.6 (10 x 12 units), 30 % in a box of 8 x 4.4 x 10 units; small, of
/// any rotation, most of them flat, many of them faint. See [`synthetic_camera`].
pub fn synthetic(seed: u64, count: usize) -> Scene {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut scene = Scene::with_capacity(3, count);
    let mut sh = [[0.0; 3]; 16];
    for _ in 0..count {
        let position = position(&mut rng);
        let mut scale: [f64; 3] = std::array::from_fn(|_| 0.012 * libm::exp(0.6 * normal(&mut rng)));
        scale[2] *= libm::exp(-0.7 + 0.5 * normal(&mut rng));
        let rotation: [f64; 4] = std::array::from_fn(|_| normal(&mut rng));
        let length = rotation.iter().map(|c| c * c).sum::<f64>().sqrt();
        let shape = GaussianShape {
            scale: scale.map(|s| s as f32),
            rotation: rotation.map(|c| (c / length) as f32),
            opacity: sigmoid(0.5 + 2.0 * normal(&mut rng)),
        };
        sh[0] = std::array::from_fn(|_| ((rng.random::<f64>() - 0.5) / SH_C0) as f32);
        for rgb in &mut sh[1..] {
            *rgb = std::array::from_fn(|_| (0.08 * normal(&mut rng)) as f32);
        }
        scene.push(position.map(|c| c as f32), shape, &sh);
    }
    scene
}

/// The view of [`synthetic`]: from (0, 0, -6) along +z, with a focal length of 1000
/// pixels at 1280 x 720 and in proportion to the height otherwise.
pub fn synthetic_camera([width, height]: [u32; 2]) -> Camera {
    Camera {
        model: Model::Pinhole,
        rotation: [[1., 0., 0.], [0., 1., 0.], [0., 0., 1.]],
        eye: [0., 0., -6.],
        focal: [1000.0 / 720.0 * f64::from(height); 2],
        principal: [f64::from(width) / 2.0, f64::from(height) / 2.0],
        distortion: Distortion::default(),
        width,
        height,
        near: DEFAULT_NEAR,
        far: f64::INFINITY,
    }
}

fn position(rng: &mut ChaCha8Rng) -> [f64; 3] {
    let mut within = |side: f64| side * (rng.random::<f64>() - 0.5);
    // The choice is made first, so that it uses the first random number of each Gaussian.
    match within(1.0) + 0.5 {
        ..0.35 => {
            let y = within(2.0);
            let (sin, cos) = libm::sincos(within(TAU));
            let ring = (1.0 - y * y).sqrt();
            [ring * cos, y, ring * sin].map(|c| 1.5 * c)
        }
        ..0.7 => [within(10.0), 1.6, within(12.0)],
        _ => [within(8.0), within(4.4), within(10.0)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_benchmark_scene_has_its_distributions() {
        let scene = synthetic(1, 20_000);
        assert_eq!(scene, synthetic(1, 20_000));
        assert_ne!(scene, synthetic(2, 20_000));
        let share = |wanted: &dyn Fn(&[f32; 3]) -> bool| {
            scene.positions().iter().filter(|p| wanted(p)).count() as f64 / 20_000.0
        };
        let on_sphere = |p: &[f32; 3]| (p.iter().map(|c| c * c).sum::<f32>() - 2.25).abs() < 1e-4;
        assert!((share(&on_sphere) - 0.35).abs() < 0.02);
        assert!((share(&|p| p[1] == 1.6) - 0.35).abs() < 0.02);
        let mut widths: Vec<f32> = scene.shapes().iter().map(|s| s.scale[0]).collect();
        widths.sort_by(f32::total_cmp);
        assert!((widths[10_000] / 0.012 - 1.0).abs() < 0.03);
        let spread = (widths[16_827] / widths[10_000]).ln();
        assert!((spread - 0.6).abs() < 0.03, "{spread}");
        let mut opacities: Vec<f32> = scene.shapes().iter().map(|s| s.opacity).collect();
        opacities.sort_by(f32::total_cmp);
        assert!((opacities[10_000] - sigmoid(0.5)).abs() < 0.03);
        let rest: f32 = scene.sh().chunks(16).map(|sh| sh[7][1].powi(2)).sum();
        assert!(((rest / 20_000.0).sqrt() - 0.08).abs() < 0.003);
    }

    #[test]
    fn the_benchmark_camera_has_its_focal_length() {
        let camera = synthetic_camera([1280, 720]);
        let at = camera.project([1.0, 0.5, 4.0]).expect("in front");
        assert_eq!(at, [740.0, 410.0]);
    }
}
