//! The state of Gaussian draws: the camera, and the state that the extension's pipelines fix.

use crate::state::{BlendState, DepthStencil, LogicOp};

/// The projection of a Gaussian draw's camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CameraModel {
    /// Perspective projection, whose principal point may be anywhere.
    Pinhole,
    /// Parallel projection. Focal lengths are in pixels per unit of length.
    Orthographic,
    /// Equidistant fisheye projection. Focal lengths are in pixels per radian from the axis.
    Fisheye,
    /// Projection to longitude and latitude. Focal lengths are in pixels per radian. The image repeats after a whole
    /// turn.
    Equirectangular,
}

/// The map from an ideal place (u, v) in the picture to the distorted one that a lens gives. See the extension for each
/// formula.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DistortionModel {
    /// The place times a quotient of cubic polynomials in the square of the radius.
    Rational,
    /// The place times a polynomial in the square of the radius.
    Polynomial,
    /// The same polynomial first. The tangential part and the thin prism distort its place.
    PolynomialFirst,
    /// An angle of the radius. The first radial coefficient is omega, the others are 0.
    FieldOfView,
    /// The inverse of a division by a polynomial. The first radial coefficient is k, the others are 0.
    Division,
}

/// The distortion of a lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distortion {
    /// The formula.
    pub model: DistortionModel,
    /// The radial coefficients k1 to k6.
    pub radial: [f32; 6],
    /// The tangential coefficients p1 and p2.
    pub tangential: [f32; 2],
    /// The coefficients of a thin prism, s1 to s4.
    pub thin_prism: [f32; 4],
}

/// The camera of a Gaussian draw: +x right, +y down, +z forward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The projection.
    pub model: CameraModel,
    /// The rotation from world to camera space, row-major.
    pub rotation: [f32; 9],
    /// The eye in world units. It is binary64, so that scenes far from the origin keep their precision.
    pub eye: [f64; 3],
    /// Focal lengths in pixels.
    pub focal_length: [f32; 2],
    /// The principal point in pixels from the viewport's corner (`x`, `y`).
    pub principal_point: [f32; 2],
    /// The depth variable, in world units, beyond which Gaussians must be. It is greater than 0 unless the camera is
    /// orthographic.
    pub near_plane: f32,
    /// The depth variable, in world units, before which Gaussians must be. It may be infinite.
    pub far_plane: f32,
    /// The coefficients c0 and c1 of the fragment depth `c0 + c1 / z`, or `c0 + c1 z` for an orthographic camera, where
    /// z is the depth variable.
    pub depth_coefficients: [f32; 2],
    /// The distortion of the lens of a pinhole or a fisheye, if some coefficient is not 0. It is for volumes only, and not
    /// for the per-pixel order.
    pub distortion: Option<Distortion>,
}

impl Default for Camera {
    /// A pinhole camera at the origin, with focal lengths of one pixel, 3DGS's planes and a depth of 0.
    fn default() -> Self {
        Self {
            model: CameraModel::Pinhole,
            rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            eye: [0.0; 3],
            focal_length: [1.0; 2],
            principal_point: [0.0; 2],
            near_plane: 0.2,
            far_plane: f32::INFINITY,
            depth_coefficients: [0.0; 2],
            distortion: None,
        }
    }
}

/// The key that Gaussians are sorted by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum GaussianOrder {
    /// The centre's depth variable: camera-space z, or the distance from the eye for fisheye and equirectangular
    /// cameras.
    ViewDepth,
    /// The centre's distance from the eye.
    RadialDistance,
    /// No key. Gaussians stay in the order of the draw.
    Primitive,
    /// The depth, separately for each pixel, at which the Gaussian is greatest along the pixel's ray.
    PerPixel,
}

/// The shape of a Gaussian in space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum GaussianGeometry {
    /// A volume with three standard deviations. Its projection is approximated by an ellipse.
    Volume,
    /// A flat disc with two standard deviations, whose projection is exact. It is for pinhole and orthographic cameras
    /// only.
    Surfel,
}

/// The rasterizer's arithmetic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum GaussianPrecision {
    /// binary32, or more precise.
    Float32,
    /// Every operation of a processing element is rounded to binary16. It is for volumes only, and not for the
    /// per-pixel order.
    Float16,
}

/// The method that projects the covariance of a Gaussian.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum GaussianLinearization {
    /// The camera's Jacobian at the mean.
    #[default]
    Jacobian,
    /// The unscented transform: the mean and the covariance of seven projected points. Where the camera does not see
    /// all of them, the Jacobian is used.
    Unscented,
}

/// The sigma points of the unscented transform, by its usual parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnscentedTransform {
    /// The spread of the points about the mean.
    pub alpha: f32,
    /// The knowledge of the distribution, which changes the weight of the mean's point. 2 is a Gaussian's.
    pub beta: f32,
    /// The second parameter of the spread. It is greater than -3.
    pub kappa: f32,
    /// The part of the picture's size by which points that count may lie outside of it. If it is infinite, Gaussians are
    /// drawn wherever their points lie.
    pub picture_margin: f32,
    /// True if all points must lie there for a Gaussian to be drawn, false if one must.
    pub needs_all: bool,
}

impl Default for UnscentedTransform {
    /// Points at sqrt(3) standard deviations, whose weights are not negative.
    fn default() -> Self {
        Self { alpha: 1.0, beta: 2.0, kappa: 0.0, picture_margin: f32::INFINITY, needs_all: false }
    }
}

/// Errors that are permitted in exchange for speed. A stage that gains nothing from them is exact. By default none are
/// permitted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GaussianApproximation {
    /// The greatest relative error, 0 to 1, of the exponential in alpha. The comparison of alpha with its floor does
    /// not depend on it.
    pub exponential_error: f32,
    /// The greatest sum of contributions that may be omitted at a pixel, 0 to 1. A contribution is the transmittance in
    /// front of a Gaussian times the Gaussian's alpha.
    pub contribution_budget: f32,
}

/// The shape outside which a Gaussian does not contribute, whatever its alpha. Tiles are 16x16 pixels, from the upper left
/// corner of the viewport's area on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum GaussianCutOff {
    /// There is none.
    #[default]
    None,
    /// The ellipse of a Mahalanobis distance.
    Ellipse,
    /// The tiles that a square touches, whose half side is the longer standard deviation, rounded up to whole pixels.
    TileSquare,
    /// The tiles that a rectangle touches, whose half sides are standard deviations along x and y, rounded up so.
    TileRectangle,
    /// The same, but of no more deviations than those at which alpha would reach its floor if opacity were compensated.
    TileRectangleCompensated,
}

/// The pixels that Gaussians may reach, and what opacity they have at least. By default they reach all where their alpha
/// does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GaussianFootprint {
    /// The shape outside which they do not contribute.
    pub cut_off: GaussianCutOff,
    /// Its size in standard deviations.
    pub deviations: f32,
    /// The least ratio of determinants that compensation, and the cut-off by it, take the root of, 0 to 1.
    pub compensation_floor: f32,
}

/// The state of a Gaussian draw that its pipeline fixes. See the extension for each value's meaning.
#[derive(Clone, Debug, PartialEq)]
pub struct GaussianState {
    /// The spherical harmonics degree that is evaluated, 0 to 4.
    pub sh_degree: u32,
    /// The method that projects covariances.
    pub linearization: GaussianLinearization,
    /// The points of the unscented transform.
    pub unscented: UnscentedTransform,
    /// The rasterizer's arithmetic.
    pub precision: GaussianPrecision,
    /// The shape of the Gaussians.
    pub geometry: GaussianGeometry,
    /// The key that the Gaussians are sorted by.
    pub order: GaussianOrder,
    /// True if opacity is multiplied by a ratio of determinants, so that the low-pass filter conserves energy.
    pub opacity_compensated: bool,
    /// The number that is added to both diagonal elements of the screen-space covariance, in px^2.
    pub low_pass_variance: f32,
    /// The least alpha that contributes.
    pub alpha_floor: f32,
    /// The greatest alpha.
    pub alpha_ceiling: f32,
    /// The least transmittance of a pixel. A pixel is finished before its transmittance would fall below it.
    pub transmittance_floor: f32,
    /// The pixels that they may reach.
    pub footprint: GaussianFootprint,
    /// The approximations that pixels may have.
    pub approximation: GaussianApproximation,
    /// True if depths before the viewport, and those of clip space, are from -1, not from 0, to 1.
    pub negative_one_to_one: bool,
    /// The samples that may be covered.
    pub sample_mask: u32,
    /// The depth and stencil state. Gaussians are front-facing.
    pub depth_stencil: DepthStencil,
    /// The logic operation, if enabled. It then replaces blending.
    pub logic_op: Option<LogicOp>,
    /// The blending and write masks, one per colour attachment. Only the first attachment is written.
    pub blend: Vec<BlendState>,
    /// The constants of the constant blend factors.
    pub blend_constants: [f32; 4],
}

impl Default for GaussianState {
    /// The defaults of 3DGS, with harmonics of degree 0. Nothing is tested, and the fragment replaces the attachment's
    /// colour.
    fn default() -> Self {
        Self {
            sh_degree: 0,
            linearization: GaussianLinearization::Jacobian,
            unscented: UnscentedTransform::default(),
            precision: GaussianPrecision::Float32,
            geometry: GaussianGeometry::Volume,
            order: GaussianOrder::ViewDepth,
            opacity_compensated: false,
            low_pass_variance: 0.3,
            alpha_floor: 1.0 / 255.0,
            alpha_ceiling: 0.99,
            transmittance_floor: 1e-4,
            footprint: GaussianFootprint::default(),
            approximation: GaussianApproximation::default(),
            negative_one_to_one: false,
            sample_mask: u32::MAX,
            depth_stencil: DepthStencil::default(),
            logic_op: None,
            blend: Vec::new(),
            blend_constants: [0.0; 4],
        }
    }
}
