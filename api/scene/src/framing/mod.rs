//! Cameras for a scene: one that has all of it in its picture, and one that stands inside.
//!
//! An object is framed by its silhouette: what it covers of the picture. A scene that surrounds its middle is framed by a
//! box around most of its opacity, which is that middle. `docs/command.md` says when a scene is which.

mod coverage;
mod extent;
mod silhouette;
mod surroundings;

use glam::{DMat3, DVec3};

use crate::camera::{Camera, CameraError, DEFAULT_NEAR};
use crate::scene::Scene;
pub use extent::Extent;

/// The size of the picture relative to the box, of a scene that surrounds its middle.
const MARGIN: f64 = 1.2;

/// The direction from the scene's centre to the eye: in front, somewhat to the side and above. Scenes have y down and z
/// forward.
const FROM: DVec3 = DVec3::new(0.35, -0.35, -1.0);

/// The default direction upwards, for scenes whose files give none.
pub const DEFAULT_UP: [f64; 3] = [0.0, -1.0, 0.0];

/// The number of sides from which an object fits the picture of an orbit.
const ORBIT_SIDES: u32 = 8;

/// The size of the picture of an orbit relative to what an object covers of it from these sides.
const ORBIT_MARGIN: f64 = 1.1;

/// The subject of a picture: an object, or the box around the middle of a scene.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// The box around most of the opacity.
    pub extent: Extent,
    /// The scene, if it is an object.
    object: Option<&'a Scene>,
}

impl<'a> Subject<'a> {
    /// The scene as an object, or the box around its middle if it surrounds that or most of it is far from there.
    pub fn of(scene: &'a Scene) -> Self {
        let extent = Extent::of(scene);
        if surroundings::surrounds(scene, &extent) {
            return Self::of_box(extent);
        }
        match Extent::of_middle(scene) {
            Some(middle) => Self::of_box(middle),
            None => Self { extent, object: Some(scene) },
        }
    }

    /// A box.
    pub fn of_box(extent: Extent) -> Self {
        Self { extent, object: None }
    }

    /// Returns true if it is framed by its silhouette.
    pub fn is_object(&self) -> bool {
        self.object.is_some()
    }
}

/// A camera that frames a subject.
#[derive(Clone, Debug, PartialEq)]
pub struct Framed {
    /// The camera.
    pub camera: Camera,
    /// The point in the middle of the picture.
    pub target: [f64; 3],
    /// The camera's distance from that point.
    pub distance: f64,
}

/// A view of a scene from outside. Values that are None are chosen for the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Framing {
    /// The angle in degrees around the scene, from the front (from where the camera looks along +z) to its right.
    pub azimuth: Option<f64>,
    /// The angle in degrees above the horizon, at most 90.
    pub elevation: Option<f64>,
    /// The distance from the target, in the scene's units.
    pub distance: Option<f64>,
    /// The point in the middle of the picture.
    pub target: Option<[f64; 3]>,
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
        Self { azimuth: None, elevation: None, distance: None, target: None, zoom: 1.0, up: DEFAULT_UP, fov, size }
    }

    /// The camera of [`Framing::framed`].
    ///
    /// # Errors
    /// As it.
    pub fn camera(&self, subject: &Subject<'_>) -> Result<Camera, CameraError> {
        Ok(self.framed(subject)?.camera)
    }

    /// The camera that has `subject` in its picture.
    ///
    /// # Errors
    /// [`CameraError::NoUp`] if up is zero, and others for numbers that are not finite.
    pub fn framed(&self, subject: &Subject<'_>) -> Result<Framed, CameraError> {
        let boxed = self.boxed(&subject.extent)?;
        let needed = self.distance.is_none() || self.target.is_none();
        let Some(fit) =
            subject.object.filter(|_| needed).and_then(|scene| silhouette::fit(scene, &boxed.camera, boxed.distance))
        else {
            return Ok(self.finished(boxed, &subject.extent, f64::INFINITY));
        };
        let forward = DVec3::from_array(boxed.camera.rotation[2]);
        let ahead = (DVec3::from_array(subject.extent.centre) - fit.eye).dot(forward);
        // A middle that is not ahead is none: the haze of the scene is elsewhere than its silhouette.
        let ahead = if ahead > fit.nearest { ahead } else { fit.nearest };
        let distance = self.distance.unwrap_or(ahead);
        let target = self.target.map_or(fit.eye + forward * ahead, DVec3::from_array);
        let camera = Camera { eye: (target - forward * distance).into(), ..boxed.camera };
        let framed = Framed { camera, target: target.into(), distance };
        Ok(self.finished(framed, &subject.extent, fit.nearest - ahead + distance))
    }

    /// The camera with which an orbit of `subject` begins, at a distance at which it fits the picture from all sides.
    ///
    /// # Errors
    /// As [`Framing::framed`].
    pub fn orbit(&self, subject: &Subject<'_>) -> Result<Framed, CameraError> {
        let Some(scene) = subject.object.filter(|_| self.distance.is_none()) else {
            return self.framed(subject);
        };
        let boxed = self.boxed(&subject.extent)?;
        let sides = (0..ORBIT_SIDES).map(|side| {
            let angle = std::f64::consts::TAU * f64::from(side) / f64::from(ORBIT_SIDES);
            boxed.camera.turned(boxed.target, self.up, angle)
        });
        let sides: Vec<Camera> = sides.collect();
        let fits: Vec<_> = sides.iter().filter_map(|camera| silhouette::fit(scene, camera, boxed.distance)).collect();
        let points: Vec<DVec3> = fits.iter().flat_map(|fit| fit.points.iter().copied()).collect();
        let bounds = points.iter().map(|point| (*point, *point)).reduce(|(min, max), (a, b)| (min.min(a), max.max(b)));
        let Some((min, max)) = bounds else {
            return Ok(self.finished(boxed, &subject.extent, f64::INFINITY));
        };
        let target = self.target.map_or((min + max) / 2.0, DVec3::from_array);
        let within = |camera: &Camera| {
            let axes = DMat3::from_cols_array_2d(&camera.rotation).transpose();
            let tangents = [0, 1].map(|axis| camera.principal[axis] / camera.focal[axis] / ORBIT_MARGIN);
            let needed = points.iter().map(|point| {
                let offset = axes * (*point - target);
                (offset.x.abs() / tangents[0]).max(offset.y.abs() / tangents[1]) - offset.z
            });
            needed.fold(0.0, f64::max)
        };
        let distance = sides.iter().map(within).fold(0.0, f64::max);
        let forward = DVec3::from_array(boxed.camera.rotation[2]);
        let nearest = points.iter().map(|point| distance - point.distance(target)).fold(f64::INFINITY, f64::min);
        let camera = Camera { eye: (target - forward * distance).into(), ..boxed.camera };
        Ok(self.finished(Framed { camera, target: target.into(), distance }, &subject.extent, nearest))
    }

    /// The camera with its planes and its magnification. `nearest` is the least distance of what is framed.
    fn finished(&self, framed: Framed, extent: &Extent, nearest: f64) -> Framed {
        // The near plane is half of the way to what is framed, unless 3DGS's plane is nearer.
        let forward = DVec3::from_array(framed.camera.rotation[2]);
        let nearest = nearest.min(framed.distance - extent.reach(forward));
        let near = if nearest > 0.0 { nearest / 2.0 } else { extent.near() };
        let camera = framed.camera.with_planes(near.min(DEFAULT_NEAR), f64::INFINITY).zoomed(self.zoom);
        Framed { camera, ..framed }
    }

    /// The camera that has the box in its picture.
    fn boxed(&self, extent: &Extent) -> Result<Framed, CameraError> {
        let target = DVec3::from_array(self.target.unwrap_or(extent.centre));
        let (from, up) = self.direction()?;
        let eye = target + from;
        let looking = Camera::look_at(eye.into(), target.into(), up.into(), self.fov, self.size);
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
        camera.eye = (target - forward * distance).into();
        Ok(Framed { camera, target: target.into(), distance })
    }

    /// The direction from the middle to the eye, and the direction upwards in the picture.
    fn direction(&self) -> Result<(DVec3, DVec3), CameraError> {
        let given = self.azimuth.is_some() || self.elevation.is_some();
        if !given && self.up == DEFAULT_UP {
            return Ok((FROM, DVec3::from_array(self.up)));
        }
        let up = (DVec3::from_array(self.up).try_normalize()).ok_or(CameraError::NoUp)?;
        let (azimuth, elevation) = self.angles();
        if !(azimuth.is_finite() && elevation.is_finite()) {
            return Err(CameraError::NotFinite);
        }
        let (azimuth, elevation) = (azimuth.to_radians(), elevation.to_radians());
        let front = front(up);
        let side = up.cross(front);
        let level = libm::cos(azimuth) * front + libm::sin(azimuth) * side;
        let from = libm::cos(elevation) * level + libm::sin(elevation) * up;
        // Seen straight from above or below, the picture's upper edge is the far or the near one.
        let upwards = if is_vertical(elevation) { -level * libm::sin(elevation).signum() } else { up };
        Ok((from, upwards))
    }

    /// The azimuth and the elevation in degrees. Seen straight from above or below, the default azimuth has north upwards
    /// in the picture: +z, or +y if the scene's z axis points up.
    pub fn angles(&self) -> (f64, f64) {
        let (default_azimuth, default_elevation) = default_angles();
        let elevation = self.elevation.unwrap_or(default_elevation);
        let azimuth = self.azimuth.unwrap_or_else(|| {
            let up = DVec3::from_array(self.up).try_normalize();
            match up.filter(|_| is_vertical(elevation.to_radians())) {
                None => default_azimuth,
                Some(up) if (front(up).y > 0.5) == (elevation > 0.0) => 180.0,
                Some(_) => 0.0,
            }
        });
        (azimuth, elevation)
    }
}

/// True if a camera at this elevation, in radians, looks straight up or down.
fn is_vertical(elevation: f64) -> bool {
    libm::cos(elevation).abs() < 1e-6
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

/// A camera that looks forward at `scene` from a little above, in a picture of `size` pixels with a vertical field of view
/// of `fov` degrees (more than 0, less than 180). An object fills the picture; of other scenes it shows the middle.
pub fn frame(scene: &Scene, fov: f64, size: [u32; 2]) -> Camera {
    framed_or_at_its_centre(&Subject::of(scene), fov, size)
}

/// A camera like [`frame`]'s, with the box around the scene's middle in its picture, whatever the scene is.
pub fn frame_middle(scene: &Scene, fov: f64, size: [u32; 2]) -> Camera {
    framed_or_at_its_centre(&Subject::of_box(Extent::of(scene)), fov, size)
}

fn framed_or_at_its_centre(subject: &Subject<'_>, fov: f64, size: [u32; 2]) -> Camera {
    Framing::new(fov, size)
        .camera(subject)
        .unwrap_or_else(|_| Camera::new([[1., 0., 0.], [0., 1., 0.], [0., 0., 1.]], subject.extent.centre, fov, size))
}

/// A camera in the middle of the scene that looks horizontally along `azimuth` degrees (0 looks along +z, as from the
/// front).
///
/// # Errors
/// [`CameraError::NoUp`] if `up` is zero, and others for numbers that are not finite.
pub fn inside(extent: &Extent, azimuth: f64, up: [f64; 3], fov: f64, size: [u32; 2]) -> Result<Camera, CameraError> {
    let framing = Framing { azimuth: Some(azimuth), elevation: Some(0.0), up, ..Framing::new(fov, size) };
    let mut camera = framing.camera(&Subject::of_box(*extent))?;
    camera.eye = extent.centre;
    Ok(camera.with_planes(extent.near() / 4.0, f64::INFINITY))
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
        // Its alpha of 0.9 falls to a half at sqrt(2 ln 1.8) standard deviations.
        let diameter = 2.0 * pixels * (2.0 * 1.8_f64.ln()).sqrt();
        assert!((86.0..91.0).contains(&diameter), "{diameter}");
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
            let camera = framing.camera(&Subject::of_box(extent)).expect("a camera");
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
        assert_eq!(no_up.camera(&Subject::of_box(extent)), Err(CameraError::NoUp));
    }

    #[test]
    fn remnants_of_a_background_are_not_framed() {
        // Most Gaussians are a small thing, and most of the area is a few large ones on one side, far away.
        let thing = (0..900_u16).map(|i| [f32::from(i % 30) / 30.0, f32::from(i / 30) / 30.0, 0.0]);
        let mut remnants = scene(0.02, thing.clone());
        let large = GaussianShape { scale: [1.0; 3], opacity: 0.9, ..GaussianShape::default() };
        for i in 0..50_u8 {
            remnants.push([f32::from(i % 10) - 5.0, f32::from(i / 10), 12.0], large, &[[0.0; 3]]);
        }
        let subject = Subject::of(&remnants);
        assert!(!subject.is_object());
        let [x, y, z] = subject.extent.centre;
        assert!((x - 0.5).abs() < 0.05 && (y - 0.5).abs() < 0.05 && z.abs() < 0.05, "{:?}", subject.extent);
        assert!(subject.extent.half.iter().all(|half| *half < 0.6), "{:?}", subject.extent);
        // Large ones that are near belong to the thing.
        let mut whole = scene(0.02, thing);
        for i in 0..50_u8 {
            whole.push([f32::from(i) / 50.0, 1.2, 0.0], large, &[[0.0; 3]]);
        }
        assert!(Subject::of(&whole).is_object());
    }

    #[test]
    fn a_plan_has_north_upwards() {
        let extent = Extent { centre: [1.0, 2.0, 3.0], half: [1.0; 3] };
        for (up, north) in [(DEFAULT_UP, DVec3::Z), ([0.0, 1.0, 0.0], DVec3::Z), ([0.0, 0.0, 1.0], DVec3::Y)] {
            for elevation in [90.0, -90.0] {
                let framing = Framing { elevation: Some(elevation), up, ..Framing::new(DEFAULT_FOV, [64, 64]) };
                let camera = framing.camera(&Subject::of_box(extent)).expect("a camera");
                let [_, down, forward] = camera.rotation.map(DVec3::from_array);
                assert!(down.abs_diff_eq(-north, 1e-9), "{up:?} {elevation}: {down}");
                let from = DVec3::from_array(up) * elevation.signum();
                assert!(forward.abs_diff_eq(-from, 1e-9), "{up:?} {elevation}: {forward}");
            }
        }
        let turned = Framing { azimuth: Some(30.0), elevation: Some(90.0), ..Framing::new(DEFAULT_FOV, [64, 64]) };
        assert_eq!(turned.angles(), (30.0, 90.0));
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
