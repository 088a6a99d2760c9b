//! Helpers that build a [`GaussianCameraGAURAST`] from an application's camera: view and projection matrices, or a pose
//! and intrinsics.
//!
//! Everything is computed in binary64 and rounded once. Matrices are column-major (`m[column][row]`,
//! as `glam`'s `to_cols_array_2d` and GLSL have them) and act on column vectors; projections map
//! depth to Vulkan's 0..1, in either direction.

use core::fmt;

use crate::vk::{GaussianCameraDataGAURAST, GaussianCameraGAURAST, GaussianCameraModelGAURAST};

/// The tolerance for the form of a matrix. It allows for matrices composed in binary32, but for no visible difference.
const TOLERANCE: f64 = 1e-4;

/// The reason that a camera can't be built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CameraError {
    /// An input, or the resulting camera, has a number that is infinite or not a number.
    NotFinite,
    /// The view matrix or the pose is not a rotation (or reflection) with a translation: it scales,
    /// shears, projects or is singular.
    NotRigid,
    /// The projection matrix is neither a perspective nor an orthographic one along the view axis,
    /// or it is singular: it has a skew, an oblique near plane, or maps every depth to one.
    UnsupportedProjection,
    /// The projection looks in the opposite direction along the view's z axis from that of the constructor.
    OppositeDirection,
    /// The viewport has no area.
    EmptyViewport,
    /// The depth range is empty, or its near plane is not in front of the camera.
    InvalidDepthRange,
}

impl fmt::Display for CameraError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "the camera has an infinite or undefined number",
            Self::NotRigid => "the view is not a rotation with a translation",
            Self::UnsupportedProjection => "the projection is neither perspective nor orthographic along the view axis",
            Self::OppositeDirection => "the projection looks backwards along the view axis",
            Self::EmptyViewport => "the viewport has no area",
            Self::InvalidDepthRange => "the depth range is empty or not in front of the camera",
        })
    }
}

impl core::error::Error for CameraError {}

impl From<&GaussianCameraGAURAST<'_>> for GaussianCameraDataGAURAST {
    fn from(camera: &GaussianCameraGAURAST<'_>) -> Self {
        let [xx, xy, xz, yx, yy, yz, zx, zy, zz] = camera.rotation;
        Self {
            eye: camera.eye,
            model: camera.model,
            reserved: 0,
            rotation: [[xx, xy, xz, 0.0], [yx, yy, yz, 0.0], [zx, zy, zz, 0.0]],
            focal_length: camera.focal_length,
            principal_point: camera.principal_point,
            depth_coefficients: camera.depth_coefficients,
            near_plane: camera.near_plane,
            far_plane: camera.far_plane,
            padding: [0; 4],
        }
    }
}

impl GaussianCameraDataGAURAST {
    /// The bytes of the camera as a uniform buffer holds them.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; 128] {
        let mut bytes = [0; 128];
        let mut rest = &mut bytes[..];
        let mut put = |value: &[u8]| {
            let (to, after) = std::mem::take(&mut rest).split_at_mut(value.len());
            to.copy_from_slice(value);
            rest = after;
        };
        for value in self.eye {
            put(&value.to_ne_bytes());
        }
        put(&self.model.as_raw().to_ne_bytes());
        put(&self.reserved.to_ne_bytes());
        let floats = (self.rotation.into_iter().flatten())
            .chain(self.focal_length)
            .chain(self.principal_point)
            .chain(self.depth_coefficients)
            .chain([self.near_plane, self.far_plane]);
        for value in floats {
            put(&value.to_ne_bytes());
        }
        bytes
    }
}

impl GaussianCameraGAURAST<'_> {
    /// The camera of a right-handed view matrix, which looks along -z with +y up (OpenGL's convention), and a
    /// projection matrix for it, such as those of `glam::camera::rh::proj::vulkan`.
    ///
    /// `view` is world to camera. `viewport` is the Vulkan viewport's width and height in pixels; a negative height
    /// flips the picture, as in Vulkan. The projection may be off-centre, have either sign of y (so one made for
    /// another API gives an upside-down picture, exactly as it does for triangles), reverse depth, or have an infinite
    /// far plane. Its depths 0 and 1 become the camera's near and far plane.
    ///
    /// # Errors
    ///
    /// See [`CameraError`].
    pub fn from_view_projection(
        view: &[[f64; 4]; 4],
        projection: &[[f64; 4]; 4],
        viewport: [f32; 2],
    ) -> Result<Self, CameraError> {
        from_matrices(view, projection, viewport, -1.0)
    }

    /// The camera of a view matrix that looks along +z (the convention of OpenCV and COLMAP, with +y
    /// down, and of left-handed engines, with +y up) and a projection matrix for it, such as those
    /// of `glam::camera::lh::proj::vulkan`.
    ///
    /// Otherwise as [`from_view_projection`](Self::from_view_projection), with the same errors.
    pub fn from_forward_z_view_projection(
        view: &[[f64; 4]; 4],
        projection: &[[f64; 4]; 4],
        viewport: [f32; 2],
    ) -> Result<Self, CameraError> {
        from_matrices(view, projection, viewport, 1.0)
    }

    /// The pinhole camera of a pose and intrinsics, as in the `cameras.json` of 3DGS.
    ///
    /// `camera_to_world` holds the *rows* of the rotation from camera axes (+x right, +y down,
    /// +z forward) to world axes, so that its columns are those directions in world space; `eye` is
    /// the camera's position in world space; `focal_length` and `principal_point` are in pixels. The
    /// depth range is the default's; see [`depth_range`](Self::depth_range).
    ///
    /// # Errors
    ///
    /// [`CameraError::NotFinite`] or [`CameraError::NotRigid`].
    pub fn from_pose(
        camera_to_world: &[[f64; 3]; 3],
        eye: [f64; 3],
        focal_length: [f32; 2],
        principal_point: [f32; 2],
    ) -> Result<Self, CameraError> {
        let intrinsics = [focal_length, principal_point];
        let finite = camera_to_world.as_flattened().iter().chain(&eye).all(|x| x.is_finite())
            && intrinsics.as_flattened().iter().all(|x| x.is_finite());
        if !finite {
            return Err(CameraError::NotFinite);
        }
        let world_to_camera = transpose(camera_to_world);
        if !is_orthonormal(&world_to_camera) {
            return Err(CameraError::NotRigid);
        }
        Ok(Self::default()
            .rotation(flatten(&world_to_camera))
            .eye(eye)
            .focal_length(focal_length)
            .principal_point(principal_point))
    }

    /// A panorama of all 360 by 180 degrees that fills a viewport of the given width and height in pixels, with the
    /// direction forward in its middle. If the width is twice the height, a degree of longitude (on the horizon) has as
    /// many pixels as one of latitude.
    ///
    /// `camera_to_world` and `eye` are as for [`from_pose`](Self::from_pose).
    ///
    /// # Errors
    ///
    /// [`CameraError::EmptyViewport`], and as for [`from_pose`](Self::from_pose).
    pub fn panorama(camera_to_world: &[[f64; 3]; 3], eye: [f64; 3], viewport: [f32; 2]) -> Result<Self, CameraError> {
        let [width, height] = viewport.map(f64::from);
        if !viewport.iter().all(|side| side.is_finite()) {
            return Err(CameraError::NotFinite);
        }
        if width <= 0.0 || height == 0.0 {
            return Err(CameraError::EmptyViewport);
        }
        let height = height.abs();
        let focal_length = [width / core::f64::consts::TAU, height / core::f64::consts::PI];
        let principal_point = [0.5 * width, 0.5 * height];
        let camera =
            Self::from_pose(camera_to_world, eye, focal_length.map(|f| f as f32), principal_point.map(|c| c as f32))?;
        Ok(camera.model(GaussianCameraModelGAURAST::EQUIRECTANGULAR))
    }

    /// Sets the planes to `near` and `far` and the depth coefficients such that depth is 0 at `near`
    /// and 1 at `far`. `far` may be infinite unless the camera is orthographic.
    ///
    /// # Errors
    ///
    /// [`CameraError::InvalidDepthRange`] unless `near` < `far`, and 0 < `near` unless the camera
    /// is orthographic.
    pub fn depth_range(self, near: f32, far: f32) -> Result<Self, CameraError> {
        self.depth_from_planes(near, far, [0.0, 1.0])
    }

    /// As [`depth_range`](Self::depth_range), with depth 1 at `near` and 0 at `far`.
    ///
    /// # Errors
    ///
    /// As for [`depth_range`](Self::depth_range).
    pub fn reverse_depth_range(self, near: f32, far: f32) -> Result<Self, CameraError> {
        self.depth_from_planes(near, far, [1.0, 0.0])
    }

    /// The camera with depth `depths[0]` at `near` and `depths[1]` at `far`.
    fn depth_from_planes(self, near: f32, far: f32, depths: [f64; 2]) -> Result<Self, CameraError> {
        let orthographic = self.model == GaussianCameraModelGAURAST::ORTHOGRAPHIC;
        let bounded = near.is_finite() && (far.is_finite() || !orthographic);
        if !(bounded && near < far && (orthographic || near > 0.0)) {
            return Err(CameraError::InvalidDepthRange);
        }
        // Depth is linear in z or in 1/z, so two points determine it.
        let variable = |z: f32| {
            if orthographic { f64::from(z) } else { f64::from(z).recip() }
        };
        let slope = (depths[1] - depths[0]) / (variable(far) - variable(near));
        let offset = depths[1] - slope * variable(far);
        Ok(self.near_plane(near).far_plane(far).depth_coefficients([offset as f32, slope as f32]))
    }
}

/// Widens a column-major matrix, for applications that compute in binary32.
#[must_use]
pub fn widen(matrix: &[[f32; 4]; 4]) -> [[f64; 4]; 4] {
    matrix.map(|column| column.map(f64::from))
}

/// The parameters of a projection matrix. Offsets are in normalised device coordinates; scales are per unit of x/z
/// (perspective) or x (orthographic), with the matrix's signs.
struct Projection {
    orthographic: bool,
    scale: [f64; 2],
    offset: [f64; 2],
    depth_coefficients: [f64; 2],
}

/// The camera of `view` and `projection`, which look along the view's z axis in direction `forward`
/// (1 or -1).
fn from_matrices(
    view: &[[f64; 4]; 4],
    projection: &[[f64; 4]; 4],
    viewport: [f32; 2],
    forward: f64,
) -> Result<GaussianCameraGAURAST<'static>, CameraError> {
    let finite = view.as_flattened().iter().chain(projection.as_flattened()).all(|x| x.is_finite())
        && viewport.iter().all(|x| x.is_finite());
    if !finite {
        return Err(CameraError::NotFinite);
    }
    let [width, height] = viewport.map(f64::from);
    if width <= 0.0 || height == 0.0 {
        return Err(CameraError::EmptyViewport);
    }
    let (axes, eye) = decompose_view(view)?;
    let projection = decompose_projection(projection, forward)?;
    let (near, far) = depth_planes(&projection)?;

    // Focal lengths are positive: the signs of x, y and z are moved to the rotation. A negative height flips y about
    // the same corner.
    let half_extent = [width / 2.0, height.abs() / 2.0];
    let flip = [1.0, height.signum()];
    let signed_focal = [0, 1].map(|i| half_extent[i] * flip[i] * projection.scale[i]);
    let principal = [0, 1].map(|i| half_extent[i] * (1.0 + flip[i] * projection.offset[i]));
    let signs = [signed_focal[0].signum(), signed_focal[1].signum(), forward];
    let rotation = [0, 1, 2].map(|i| axes[i].map(|x| signs[i] * x));

    let model = if projection.orthographic {
        GaussianCameraModelGAURAST::ORTHOGRAPHIC
    } else {
        GaussianCameraModelGAURAST::PINHOLE
    };
    let camera = GaussianCameraGAURAST::default()
        .model(model)
        .rotation(flatten(&rotation))
        .eye(eye)
        .focal_length(signed_focal.map(|f| f.abs() as f32))
        .principal_point(principal.map(|c| c as f32))
        .near_plane(near)
        .far_plane(far)
        .depth_coefficients(projection.depth_coefficients.map(|c| c as f32));
    if fits_binary32(&camera) { Ok(camera) } else { Err(CameraError::NotFinite) }
}

/// True if every number is finite after rounding to binary32. The far plane may be infinite.
fn fits_binary32(camera: &GaussianCameraGAURAST<'_>) -> bool {
    let pairs = [camera.focal_length, camera.principal_point, camera.depth_coefficients];
    pairs.as_flattened().iter().all(|x| x.is_finite())
        && camera.near_plane.is_finite()
        && camera.eye.iter().all(|x| x.is_finite())
}

/// The rows of a view matrix's rotation, and the position of its eye.
fn decompose_view(view: &[[f64; 4]; 4]) -> Result<([[f64; 3]; 3], [f64; 3]), CameraError> {
    let row = |r: usize| [view[0][r], view[1][r], view[2][r]];
    let axes = [row(0), row(1), row(2)];
    let affine = row(3) == [0.0; 3] && view[3][3] == 1.0;
    if !affine || !is_orthonormal(&axes) {
        return Err(CameraError::NotRigid);
    }
    // The eye solves axes * eye = -translation. The true inverse, not the transpose, keeps the translation exact if the
    // eye is far away and the axes have rounding errors.
    let cofactors = [cross(axes[1], axes[2]), cross(axes[2], axes[0]), cross(axes[0], axes[1])];
    let determinant = dot(axes[0], cofactors[0]);
    let eye = [0, 1, 2].map(|i| {
        let sum: f64 = (0..3).map(|r| cofactors[r][i] * view[3][r]).sum();
        -sum / determinant
    });
    Ok((axes, eye))
}

/// Decomposes a perspective or orthographic matrix that looks along `forward`.
fn decompose_projection(projection: &[[f64; 4]; 4], forward: f64) -> Result<Projection, CameraError> {
    let row = |r: usize| [projection[0][r], projection[1][r], projection[2][r], projection[3][r]];
    let [x, y, z, w] = [row(0), row(1), row(2), row(3)];
    let is_zero = |row: [f64; 4], element: usize| {
        let largest = row.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        row[element].abs() <= 1e-6 * largest
    };
    let only = |row: [f64; 4], used: [usize; 2]| (0..4).all(|element| used.contains(&element) || is_zero(row, element));

    let orthographic = is_zero(w, 2);
    // x and y are shifted in proportion to w, which is a constant or z.
    let shift = if orthographic { 3 } else { 2 };
    let supported = only(w, [shift, shift])
        && only(x, [0, shift])
        && only(y, [1, shift])
        && only(z, [2, 3])
        && x[0] != 0.0
        && y[1] != 0.0;
    if !supported {
        return Err(CameraError::UnsupportedProjection);
    }
    // w is `divisor` times 1 or times the distance ahead; it must be positive.
    let direction = if orthographic { 1.0 } else { forward };
    let divisor = direction * w[shift];
    if divisor < 0.0 {
        return Err(CameraError::OppositeDirection);
    }
    if divisor == 0.0 {
        return Err(CameraError::UnsupportedProjection);
    }
    // The coefficients of depth for the view's z and for a constant; z is `forward` times the distance ahead.
    let depth_coefficients = if orthographic {
        [z[3] / divisor, forward * z[2] / divisor]
    } else {
        [forward * z[2] / divisor, z[3] / divisor]
    };
    if depth_coefficients[1] == 0.0 {
        return Err(CameraError::UnsupportedProjection);
    }
    Ok(Projection {
        orthographic,
        scale: [x[0] / divisor, y[1] / divisor],
        offset: [direction * x[shift] / divisor, direction * y[shift] / divisor],
        depth_coefficients,
    })
}

/// The nearest and the farthest distance ahead at which depth is within 0..1.
fn depth_planes(projection: &Projection) -> Result<(f32, f32), CameraError> {
    let [c0, c1] = projection.depth_coefficients;
    let distance_at = |depth: f64| {
        if projection.orthographic {
            return (depth - c0) / c1;
        }
        // A depth that is reached only behind the camera, or not at all, is never reached ahead.
        let distance = c1 / (depth - c0);
        if distance > 0.0 { distance } else { f64::INFINITY }
    };
    let [a, b] = [distance_at(0.0), distance_at(1.0)];
    let (near, far) = (a.min(b) as f32, a.max(b) as f32);
    if near < far && (projection.orthographic || near > 0.0) {
        Ok((near, far))
    } else {
        Err(CameraError::InvalidDepthRange)
    }
}

/// True if the rows are orthonormal, within [`TOLERANCE`].
fn is_orthonormal(rows: &[[f64; 3]; 3]) -> bool {
    (0..3).all(|i| {
        (0..3).all(|j| {
            let expected = if i == j { 1.0 } else { 0.0 };
            (dot(rows[i], rows[j]) - expected).abs() <= TOLERANCE
        })
    })
}

fn transpose(rows: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    [0, 1, 2].map(|i| [rows[0][i], rows[1][i], rows[2][i]])
}

/// The elements in row-major order, rounded to binary32.
fn flatten(rows: &[[f64; 3]; 3]) -> [f32; 9] {
    core::array::from_fn(|i| rows[i / 3][i % 3] as f32)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
