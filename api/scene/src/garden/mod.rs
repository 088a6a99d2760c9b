//! The default scene: a garden at sunset, with a knot of polished metal over a pond.
//!
//! Light is baked into colours, as in trained scenes: matte light into the constant coefficient, reflections into the
//! higher bands. Everything is laid out with y up and converted to the scene's frame as the last step.

mod brush;
mod directions;
mod light;
mod parts;

use glam::DVec3;

use crate::camera::{Camera, CameraError};
use crate::scene::Scene;
use brush::Brush;

/// The number of Gaussians that [`scene`] is composed for.
pub const DEFAULT_COUNT: usize = 300_000;

/// A garden of `count` Gaussians of degree 3, the same for the same `seed`. See
/// [`camera`].
pub fn scene(seed: u64, count: usize) -> Scene {
    let mut brush = Brush::new(seed, count);
    let mut left = count;
    let mut share = |of_thousand: usize| {
        let share = (count * of_thousand / 1000).min(left);
        left -= share;
        share
    };
    parts::sky(&mut brush, share(12));
    parts::meadow(&mut brush, share(230));
    parts::flowers(&mut brush, share(40));
    parts::trees(&mut brush, share(400));
    parts::pond(&mut brush, share(38));
    parts::fireflies(&mut brush, share(1));
    let knot = share(1000);
    parts::knot(&mut brush, knot);
    brush.finish()
}

/// The view that [`scene`] is composed for, with another vertical field of view of `fov` degrees if given.
///
/// # Errors
/// Returns [`CameraError::FieldOfView`] unless `fov` is more than 0 and less than 180.
pub fn camera(fov: Option<f64>, size: [u32; 2]) -> Result<Camera, CameraError> {
    let turn = |v: DVec3| brush::turn(v).to_array();
    Camera::look_at(
        turn(DVec3::new(2.3, 1.55, 5.6)),
        turn(DVec3::new(0.0, 1.0, 0.0)),
        turn(DVec3::Y),
        fov.unwrap_or(42.0),
        size,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_garden_has_the_count_asked_for_and_depends_on_the_seed() {
        for count in [0, 1, 10, 999, 5000] {
            let garden = scene(3, count);
            assert_eq!((garden.len(), garden.sh_degree()), (count, 3));
        }
        assert_eq!(scene(3, 2000), scene(3, 2000));
        assert_ne!(scene(3, 2000), scene(4, 2000));
    }

    #[test]
    fn a_garden_is_made_of_proper_gaussians_before_its_camera() {
        let garden = scene(0, 20_000);
        for shape in garden.shapes() {
            assert!(shape.scale.iter().all(|s| (1e-4..100.0).contains(s)), "{shape:?}");
            let length: f32 = shape.rotation.iter().map(|c| c * c).sum();
            assert!((length - 1.0).abs() < 1e-5, "{shape:?}");
            assert!((0.0..=1.0).contains(&shape.opacity), "{shape:?}");
        }
        assert!(garden.sh().as_flattened().iter().all(|c| c.is_finite()));
        let camera = camera(None, [1280, 720]).expect("a camera");
        let seen = garden.positions().iter().filter(|position| {
            camera
                .project(position.map(f64::from))
                .is_some_and(|[x, y]| (0.0..1280.0).contains(&x) && (0.0..720.0).contains(&y))
        });
        assert!(seen.count() > 10_000);
        // The sky is above, at smaller y.
        let [x, y] = camera.project([0.0, -20.0, 50.0]).expect("in front");
        assert!((0.0..1280.0).contains(&x) && y < 360.0);
    }
}
