//! A camera that has the whole scene in its picture.

use glam::DVec3;

use crate::camera::Camera;
use crate::scene::Scene;

/// The part of the scene's opacity that lies outside the framed box at each end of each axis.
/// Trained scenes have a haze of far-off Gaussians.
const TAIL: f64 = 0.04;

/// Gaussians that are looked at, at most.
const SAMPLE: usize = 1 << 18;

/// The room around the box, relative to the picture.
const MARGIN: f64 = 1.2;

/// From the scene's centre to the eye: in front, somewhat to the side and above. Scenes have
/// y down and z forward.
const FROM: DVec3 = DVec3::new(0.35, -0.35, -1.0);

/// A camera that looks forward at `scene` from a little above, with what is opaque of it in
/// a picture of `size` pixels and a vertical field of view of `fov` degrees (more than 0, less
/// than 180).
pub fn frame(scene: &Scene, fov: f64, size: [u32; 2]) -> Camera {
    let (min, max) = bounds(scene);
    let centre = (min + max) / 2.0;
    // A point is framed, too.
    let half = ((max - min) / 2.0).max(DVec3::splat(1e-3));
    let eye = centre + FROM;
    let up = [0.0, -1.0, 0.0];
    let mut camera =
        Camera::look_at(eye.into(), centre.into(), up, fov, size).unwrap_or_else(|_| {
            // The scene is so far out that FROM is lost in rounding.
            Camera::new(
                [[1., 0., 0.], [0., 1., 0.], [0., 0., 1.]],
                eye.into(),
                fov,
                size,
            )
        });
    let [right, down, forward] = camera.rotation.map(DVec3::from_array);
    // The distance at which every corner of the box is within the picture.
    let tangents = [
        camera.principal[0] / camera.focal[0] / MARGIN,
        camera.principal[1] / camera.focal[1] / MARGIN,
    ];
    let distance = (0..8)
        .map(|corner| {
            let sign = |bit: u32| if corner & (1 << bit) == 0 { -1.0 } else { 1.0 };
            let corner = half * DVec3::new(sign(0), sign(1), sign(2));
            let [x, y] = [corner.dot(right).abs(), corner.dot(down).abs()];
            (x / tangents[0]).max(y / tangents[1]) - corner.dot(forward)
        })
        .fold(0.0, f64::max);
    camera.eye = (centre - forward * distance).into();
    camera
}

/// Opposite corners of a box around most of the scene's opacity.
fn bounds(scene: &Scene) -> (DVec3, DVec3) {
    let step = scene.len().div_ceil(SAMPLE).max(1);
    let mut sample: Vec<(DVec3, f64)> = scene
        .positions()
        .iter()
        .zip(scene.shapes())
        .step_by(step)
        .map(|(position, shape)| {
            let position = position.map(f64::from);
            (DVec3::from_array(position), f64::from(shape.opacity))
        })
        .filter(|(position, opacity)| position.is_finite() && *opacity > 0.0 && *opacity < 1e6)
        .collect();
    let total: f64 = sample.iter().map(|(_, opacity)| opacity).sum();
    let (mut min, mut max) = (DVec3::ZERO, DVec3::ZERO);
    for axis in 0..3 {
        sample.sort_unstable_by(|(a, _), (b, _)| a[axis].total_cmp(&b[axis]));
        let beyond = |fraction: f64| {
            let mut sum = 0.0;
            sample
                .iter()
                .find(|(_, opacity)| {
                    sum += opacity;
                    sum >= fraction * total
                })
                .or(sample.last())
                .map_or(0.0, |(position, _)| position[axis])
        };
        (min[axis], max[axis]) = (beyond(TAIL), beyond(1.0 - TAIL));
    }
    (min, max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::DEFAULT_FOV;
    use crate::scene::GaussianShape;

    /// A cube of points around (10, 20, 30), and a few far outliers that are not framed.
    #[test]
    fn framing_fits_the_bulk_and_ignores_outliers() {
        let mut scene = Scene::with_capacity(0, 0);
        let mut push = |position: [f32; 3], opacity: f32| {
            let shape = GaussianShape {
                opacity,
                ..GaussianShape::default()
            };
            scene.push(position, shape, &[[0.0; 3]]);
        };
        for i in 0..1000_u16 {
            let digit = |d: u16| f32::from(i / 10_u16.pow(d.into()) % 10) / 4.5 - 1.0;
            push([10.0 + digit(0), 20.0 + digit(1), 30.0 + digit(2)], 0.9);
        }
        for far in [1e4, -1e6, f32::INFINITY, f32::NAN] {
            push([far, -far, far], 1.0);
        }
        for size in [[640, 360], [300, 900]] {
            let camera = frame(&scene, DEFAULT_FOV, size);
            let mut extent = [0.0_f64; 2];
            for position in &scene.positions()[..1000] {
                let at = camera.project(position.map(f64::from)).expect("in front");
                for axis in 0..2 {
                    let offset = (at[axis] / camera.principal[axis] - 1.0).abs();
                    extent[axis] = extent[axis].max(offset);
                }
            }
            assert!(extent.iter().all(|e| *e <= 1.1), "{extent:?}");
            assert!(extent.iter().any(|e| *e > 0.6), "{extent:?}");
            // Seen from above: y points down.
            assert!(camera.eye[1] < 20.0 && camera.eye[2] < 30.0);
        }
    }

    #[test]
    fn framing_nothing_or_a_point_is_still_a_camera() {
        let mut scene = Scene::with_capacity(0, 0);
        assert!(
            frame(&scene, DEFAULT_FOV, [8, 8])
                .eye
                .iter()
                .all(|c| c.is_finite())
        );
        let shape = GaussianShape {
            opacity: 1.0,
            ..GaussianShape::default()
        };
        scene.push([1e30; 3], shape, &[[0.0; 3]]);
        assert!(
            frame(&scene, DEFAULT_FOV, [8, 8])
                .eye
                .iter()
                .all(|c| c.is_finite())
        );
    }
}
