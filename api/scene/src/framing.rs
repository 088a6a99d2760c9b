//! Cameras for a scene: one that has all of it in its picture, and one that stands inside.

use glam::DVec3;

use crate::camera::{Camera, CameraError, DEFAULT_NEAR};
use crate::scene::Scene;

/// The part of the scene's opacity that lies outside the framed box at each end of each axis.
/// Trained scenes have a haze of far-off Gaussians.
const TAIL: f64 = 0.04;

/// The most Gaussians that the box is computed from.
const SAMPLE: usize = 1 << 18;

/// The size of the picture relative to the box.
const MARGIN: f64 = 1.2;

/// The direction from the scene's centre to the eye: in front, somewhat to the side and above. Scenes have y down and z
/// forward.
const FROM: DVec3 = DVec3::new(0.35, -0.35, -1.0);

/// The default direction upwards, for scenes whose files give none.
pub const DEFAULT_UP: [f64; 3] = [0.0, -1.0, 0.0];

/// Half of the least side of the framed box, for scenes without extent or sizes.
const LEAST: f64 = 1e-3;

/// A box around the opaque parts of a scene and its triangles, in the scene's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// The middle.
    pub centre: [f64; 3],
    /// Half of each side; positive.
    pub half: [f64; 3],
}

impl Extent {
    /// The box around most of `scene`'s opacity and all of its triangles.
    pub fn of(scene: &Scene) -> Self {
        let sample = sample(scene);
        let (mut min, mut max) = bounds(sample.iter().map(|s| (s.position, s.opacity)).collect());
        if let Some((least, greatest)) = scene.mesh().bounds() {
            let (least, greatest) = (DVec3::from_array(least), DVec3::from_array(greatest));
            (min, max) = if sample.is_empty() { (least, greatest) } else { (min.min(least), max.max(greatest)) };
        }
        let half = (max - min) / 2.0;
        // A scene of one point gets a box as large as its Gaussian.
        let size = typical_size(&sample);
        let least = if size > 0.0 {
            (2.0 * size).min(1e30)
        } else if half.max_element() > 0.0 {
            LEAST * half.max_element()
        } else {
            LEAST
        };
        Self { centre: ((min + max) / 2.0).into(), half: half.max(DVec3::splat(least)).into() }
    }

    /// Half of the box's diagonal.
    pub fn radius(&self) -> f64 {
        DVec3::from_array(self.half).length()
    }

    /// A near plane for cameras in and around the box: that of 3DGS, or nearer where the scene is small.
    pub fn near(&self) -> f64 {
        DEFAULT_NEAR.min(self.radius() / 5.0)
    }

    /// The distance from the box's middle to its farthest point in `direction`, a unit vector.
    fn reach(&self, direction: DVec3) -> f64 {
        DVec3::from_array(self.half).dot(direction.abs())
    }
}

/// A view of a scene from outside. Values that are None are chosen for the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Framing {
    /// The angle in degrees around the scene, from the front (from where the camera looks along +z) to its right.
    pub azimuth: Option<f64>,
    /// The angle in degrees above the horizon, at most 90.
    pub elevation: Option<f64>,
    /// The distance from the scene's middle, in its units.
    pub distance: Option<f64>,
    /// The magnification relative to the framed picture.
    pub zoom: f64,
    /// The direction upwards in the scene.
    pub up: [f64; 3],
    /// The vertical field of view in degrees, more than 0 and less than 180.
    pub fov: f64,
    /// The picture's size in pixels.
    pub size: [u32; 2],
}

impl Framing {
    /// A framing with all values chosen for the scene.
    pub fn new(fov: f64, size: [u32; 2]) -> Self {
        Self { azimuth: None, elevation: None, distance: None, zoom: 1.0, up: DEFAULT_UP, fov, size }
    }

    /// The camera that looks at the middle of `extent`.
    ///
    /// # Errors
    /// [`CameraError::NoUp`] if up is zero, and others for numbers that are not finite.
    pub fn camera(&self, extent: &Extent) -> Result<Camera, CameraError> {
        let centre = DVec3::from_array(extent.centre);
        let (from, up) = self.direction()?;
        let eye = centre + from;
        let looking = Camera::look_at(eye.into(), centre.into(), up.into(), self.fov, self.size);
        let mut camera = match looking {
            // The scene is so far from the origin that rounding loses the direction.
            Err(CameraError::NoDirection | CameraError::NoUp) => {
                Camera::new([[1., 0., 0.], [0., 1., 0.], [0., 0., 1.]], eye.into(), self.fov, self.size)
            }
            looking => looking?,
        };
        let [right, down, forward] = camera.rotation.map(DVec3::from_array);
        let half = DVec3::from_array(extent.half);
        // The distance at which every corner of the box is within the picture.
        let tangents = [camera.principal[0] / camera.focal[0] / MARGIN, camera.principal[1] / camera.focal[1] / MARGIN];
        let framed = (0..8)
            .map(|corner| {
                let sign = |bit: u32| if corner & (1 << bit) == 0 { -1.0 } else { 1.0 };
                let corner = half * DVec3::new(sign(0), sign(1), sign(2));
                let [x, y] = [corner.dot(right).abs(), corner.dot(down).abs()];
                (x / tangents[0]).max(y / tangents[1]) - corner.dot(forward)
            })
            .fold(0.0, f64::max);
        let distance = self.distance.unwrap_or(framed);
        camera.eye = (centre - forward * distance).into();
        // The near plane is half of the way to the box, unless 3DGS's plane is nearer.
        let nearest = distance - extent.reach(forward);
        let near = if nearest > 0.0 { nearest / 2.0 } else { extent.near() };
        Ok(camera.with_planes(near.min(DEFAULT_NEAR), f64::INFINITY).zoomed(self.zoom))
    }

    /// The direction from the middle to the eye, and the direction upwards in the picture.
    fn direction(&self) -> Result<(DVec3, DVec3), CameraError> {
        let given = self.azimuth.is_some() || self.elevation.is_some();
        if !given && self.up == DEFAULT_UP {
            return Ok((FROM, DVec3::from_array(self.up)));
        }
        let (default_azimuth, default_elevation) = default_angles();
        let azimuth = self.azimuth.unwrap_or(default_azimuth).to_radians();
        let elevation = self.elevation.unwrap_or(default_elevation).to_radians();
        if !(azimuth.is_finite() && elevation.is_finite()) {
            return Err(CameraError::NotFinite);
        }
        let up = (DVec3::from_array(self.up).try_normalize()).ok_or(CameraError::NoUp)?;
        let front = front(up);
        let side = up.cross(front);
        let level = libm::cos(azimuth) * front + libm::sin(azimuth) * side;
        let from = libm::cos(elevation) * level + libm::sin(elevation) * up;
        // Seen straight from above or below, the picture's upper edge is the far or the near one.
        let upwards = if libm::cos(elevation).abs() < 1e-6 { -level * libm::sin(elevation).signum() } else { up };
        Ok((from, upwards))
    }
}

/// The default azimuth and elevation of a framing, in degrees.
pub fn default_angles() -> (f64, f64) {
    let level = libm::hypot(FROM.x, FROM.z);
    (libm::atan2(FROM.x, -FROM.z).to_degrees(), libm::atan2(-FROM.y, level).to_degrees())
}

/// The direction of azimuth 0: the horizontal direction nearest to -z; or to +y, if -z is almost vertical.
fn front(up: DVec3) -> DVec3 {
    let level = |direction: DVec3| direction - direction.dot(up) * up;
    let towards = level(DVec3::NEG_Z);
    if towards.length() > 0.1 { towards.normalize() } else { level(DVec3::Y).normalize() }
}

/// A camera that looks forward at `scene` from a little above, with its opaque parts in a picture of `size` pixels and
/// a vertical field of view of `fov` degrees (more than 0, less than 180).
pub fn frame(scene: &Scene, fov: f64, size: [u32; 2]) -> Camera {
    let extent = Extent::of(scene);
    Framing::new(fov, size)
        .camera(&extent)
        .unwrap_or_else(|_| Camera::new([[1., 0., 0.], [0., 1., 0.], [0., 0., 1.]], extent.centre, fov, size))
}

/// A camera in the middle of the scene that looks horizontally along `azimuth` degrees (0 looks along +z, as from the
/// front).
///
/// # Errors
/// [`CameraError::NoUp`] if `up` is zero, and others for numbers that are not finite.
pub fn inside(extent: &Extent, azimuth: f64, up: [f64; 3], fov: f64, size: [u32; 2]) -> Result<Camera, CameraError> {
    let framing = Framing { azimuth: Some(azimuth), elevation: Some(0.0), up, ..Framing::new(fov, size) };
    let mut camera = framing.camera(extent)?;
    camera.eye = extent.centre;
    Ok(camera.with_planes(extent.near() / 4.0, f64::INFINITY))
}

/// The data of a Gaussian that framing uses.
struct Sample {
    position: DVec3,
    opacity: f64,
    /// Its greatest standard deviation.
    size: f64,
}

fn sample(scene: &Scene) -> Vec<Sample> {
    let step = scene.len().div_ceil(SAMPLE).max(1);
    scene
        .positions()
        .iter()
        .zip(scene.shapes())
        .step_by(step)
        .map(|(position, shape)| Sample {
            position: DVec3::from_array(position.map(f64::from)),
            opacity: f64::from(shape.opacity),
            size: shape.scale.iter().copied().fold(0.0, f32::max).into(),
        })
        .filter(|s| s.position.is_finite() && s.opacity > 0.0 && s.opacity < 1e6)
        .collect()
}

/// The median of the finite sizes; 0 if there are none.
fn typical_size(sample: &[Sample]) -> f64 {
    let mut sizes: Vec<f64> = (sample.iter().map(|s| s.size)).filter(|size| size.is_finite()).collect();
    if sizes.is_empty() {
        return 0.0;
    }
    let middle = sizes.len() / 2;
    *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Opposite corners of a box around most of the opacity.
fn bounds(mut sample: Vec<(DVec3, f64)>) -> (DVec3, DVec3) {
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
    use crate::shape::GaussianShape;

    /// A scene of Gaussians of this size at `positions`.
    fn scene(scale: f32, positions: impl IntoIterator<Item = [f32; 3]>) -> Scene {
        let mut scene = Scene::with_capacity(0, 0);
        let shape = GaussianShape { scale: [scale; 3], opacity: 0.9, ..GaussianShape::default() };
        for position in positions {
            scene.push(position, shape, &[[0.0; 3]]);
        }
        scene
    }

    /// A cube of points around (10, 20, 30), and a few far outliers that are not framed.
    #[test]
    fn framing_fits_the_bulk_and_ignores_outliers() {
        let mut scene = Scene::with_capacity(0, 0);
        let mut push = |position: [f32; 3], opacity: f32| {
            let shape = GaussianShape { opacity, ..GaussianShape::default() };
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
            // The eye is above: y points down.
            assert!(camera.eye[1] < 20.0 && camera.eye[2] < 30.0);
            assert_eq!(camera.near, DEFAULT_NEAR);
        }
    }

    #[test]
    fn framing_nothing_or_a_point_is_still_a_camera() {
        let mut scene = Scene::with_capacity(0, 0);
        assert!(frame(&scene, DEFAULT_FOV, [8, 8]).eye.iter().all(|c| c.is_finite()));
        let shape = GaussianShape { opacity: 1.0, ..GaussianShape::default() };
        scene.push([1e30; 3], shape, &[[0.0; 3]]);
        assert!(frame(&scene, DEFAULT_FOV, [8, 8]).eye.iter().all(|c| c.is_finite()));
    }

    #[test]
    fn a_tiny_scene_lies_beyond_the_near_plane() {
        for size in [0.02_f32, 1e-4, 1e-6] {
            let corners = [[-1.0, 0.3, 1.0], [1.0, -0.2, -1.0], [0.0, 0.0, 0.0]];
            let scene = scene(0.05 * size, corners.map(|c| c.map(|x: f32| x * size)));
            let camera = frame(&scene, DEFAULT_FOV, [640, 360]);
            let [_, _, forward] = camera.rotation.map(DVec3::from_array);
            let mut spread = 0.0_f64;
            for position in scene.positions() {
                let position = position.map(f64::from);
                let depth = (DVec3::from_array(position) - DVec3::from_array(camera.eye)).dot(forward);
                assert!(depth > camera.near, "{size}: {depth} {}", camera.near);
                let at = camera.project(position).expect("in front");
                spread = spread.max((at[0] - 320.0).abs());
            }
            assert!(spread > 128.0, "{size}: {spread}");
            assert_eq!(camera.check(), Ok(()));
        }
    }

    #[test]
    fn one_gaussian_fills_its_picture() {
        let camera = frame(&scene(0.3, [[5.0, 6.0, 7.0]]), DEFAULT_FOV, [100, 100]);
        let distance = (DVec3::from_array(camera.eye) - DVec3::new(5.0, 6.0, 7.0)).length();
        let pixels = camera.focal[0] * 0.3 / distance;
        assert!((10.0..40.0).contains(&pixels), "{pixels}");
    }

    #[test]
    fn angles_go_around_the_scene() {
        let extent = Extent { centre: [1.0, 2.0, 3.0], half: [1.0; 3] };
        let at = |azimuth, elevation, up| {
            let framing = Framing {
                azimuth: Some(azimuth),
                elevation: Some(elevation),
                distance: Some(10.0),
                up,
                ..Framing::new(DEFAULT_FOV, [64, 64])
            };
            let camera = framing.camera(&extent).expect("a camera");
            DVec3::from_array(camera.eye) - DVec3::from_array(extent.centre)
        };
        let near = |a: DVec3, b: [f64; 3]| assert!(a.abs_diff_eq(b.into(), 1e-9), "{a} {b:?}");
        near(at(0.0, 0.0, DEFAULT_UP), [0.0, 0.0, -10.0]);
        near(at(90.0, 0.0, DEFAULT_UP), [10.0, 0.0, 0.0]);
        near(at(-180.0, 0.0, DEFAULT_UP), [0.0, 0.0, 10.0]);
        near(at(45.0, 90.0, DEFAULT_UP), [0.0, -10.0, 0.0]);
        near(at(0.0, -90.0, DEFAULT_UP), [0.0, 10.0, 0.0]);
        // With z upwards, the front is at the greatest y.
        near(at(0.0, 0.0, [0.0, 0.0, 1.0]), [0.0, 10.0, 0.0]);
        near(at(0.0, 90.0, [0.0, 0.0, 2.0]), [0.0, 0.0, 10.0]);
        let (azimuth, elevation) = default_angles();
        near(at(azimuth, elevation, DEFAULT_UP), (FROM.normalize() * 10.0).to_array());
        let no_up = Framing { up: [0.0; 3], ..Framing::new(DEFAULT_FOV, [64, 64]) };
        assert_eq!(no_up.camera(&extent), Err(CameraError::NoUp));
    }

    #[test]
    fn inside_is_in_the_middle_and_level() {
        let extent = Extent { centre: [1.0, 2.0, 3.0], half: [1.0; 3] };
        let camera = inside(&extent, 0.0, DEFAULT_UP, DEFAULT_FOV, [64, 32]).expect("a camera");
        assert_eq!(camera.eye, extent.centre);
        assert!((camera.rotation[2][2] - 1.0).abs() < 1e-12);
        assert!(camera.near < 0.06);
    }
}
