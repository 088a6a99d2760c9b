//! The state of Gaussian draws: the camera, and what an extension's pipeline fixes.

use crate::state::{BlendState, DepthStencil, LogicOp};

/// How a Gaussian draw's camera projects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CameraModel {
    /// Perspective with a principal point anywhere.
    Pinhole,
    /// Parallel: focal lengths are pixels per unit of length.
    Orthographic,
    /// Equidistant: focal lengths are pixels per radian from the axis.
    Fisheye,
    /// Longitude and latitude: focal lengths are pixels per radian. Pictures repeat after a period of a whole turn.
    Equirectangular,
}

/// The camera of a Gaussian draw: +x right, +y down, +z forward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// How it projects.
    pub model: CameraModel,
    /// World to camera, row-major.
    pub rotation: [f32; 9],
    /// The eye in world units; double, so that scenes far from the origin lose nothing.
    pub eye: [f64; 3],
    /// Focal lengths in pixels.
    pub focal_length: [f32; 2],
    /// The principal point in pixels from the viewport's corner.
    pub principal_point: [f32; 2],
    /// Gaussians must lie beyond this depth variable, in world units; greater than 0 unless the camera is orthographic.
    pub near_plane: f32,
    /// Gaussians must lie before this depth, in world units; may be infinite.
    pub far_plane: f32,
    /// Fragment depth is `c0 + c1 / z`, or `c0 + c1 z` for an orthographic camera, with the depth variable z.
    pub depth_coefficients: [f32; 2],
}

impl Default for Camera {
    /// At the origin, with focal lengths of one pixel, 3DGS's planes and a depth of 0.
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
        }
    }
}

/// What Gaussians are sorted by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum GaussianOrder {
    /// The centre's depth variable: camera-space z, or the distance for a fisheye and a panorama.
    ViewDepth,
    /// The centre's distance from the eye.
    RadialDistance,
    /// Nothing: the order of the draw.
    Primitive,
    /// At each pixel, the depth at which the Gaussian is greatest on the pixel's ray.
    PerPixel,
}

/// What a Gaussian is in space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum GaussianGeometry {
    /// A volume with three standard deviations, whose picture is approximated by an ellipse's.
    Volume,
    /// A flat disc with two, whose picture is exact. Not for fisheyes.
    Surfel,
}

/// The rasterizer's arithmetic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum GaussianPrecision {
    /// binary32, or better.
    Float32,
    /// Every operation of a processing element is rounded to binary16. Only for volumes, and not in the per-pixel order.
    Float16,
}

/// How a Gaussian in space becomes one in the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum GaussianLinearization {
    /// By the camera's Jacobian at the mean.
    #[default]
    Jacobian,
    /// By the mean and the covariance of seven points, where a camera sees all of them.
    Unscented,
}

/// What Gaussians may be drawn the cheaper for. Both are permissions: what has no use for one is exact. By default
/// nothing may be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GaussianApproximation {
    /// The greatest relative error of the exponential that alpha is made of, 0 to 1. Whether alpha reaches its floor is
    /// decided without it.
    pub exponential_error: f32,
    /// What the contributions that are left out at a pixel may add up to, 0 to 1: the transmittance in front of each,
    /// times its alpha.
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
}

/// The pixels that Gaussians may reach, and what opacity they have at least. By default they reach all where their alpha
/// does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GaussianFootprint {
    /// The shape outside which they do not contribute.
    pub cut_off: GaussianCutOff,
    /// Its size in standard deviations.
    pub deviations: f32,
    /// The least ratio of determinants that compensation takes the root of, 0 to 1.
    pub compensation_floor: f32,
}

/// The state of a Gaussian draw that its pipeline fixes. See the extension for each value's meaning.
#[derive(Clone, Debug, PartialEq)]
pub struct GaussianState {
    /// The spherical harmonics degree drawn, 0 to 3.
    pub sh_degree: u32,
    /// How they are projected.
    pub linearization: GaussianLinearization,
    /// The rasterizer's arithmetic.
    pub precision: GaussianPrecision,
    /// What the Gaussians are.
    pub geometry: GaussianGeometry,
    /// What the Gaussians are sorted by.
    pub order: GaussianOrder,
    /// Whether opacity is scaled by the ratio of determinants, so that the low-pass filter conserves energy.
    pub opacity_compensated: bool,
    /// Added to both diagonal elements of the screen-space covariance, in px^2.
    pub low_pass_variance: f32,
    /// The least alpha that contributes.
    pub alpha_floor: f32,
    /// The greatest alpha.
    pub alpha_ceiling: f32,
    /// A pixel is finished before its transmittance would fall below this.
    pub transmittance_floor: f32,
    /// The pixels that they may reach.
    pub footprint: GaussianFootprint,
    /// How far pixels may be from all that.
    pub approximation: GaussianApproximation,
    /// The samples that may be covered.
    pub sample_mask: u32,
    /// Depth and stencil. Gaussians face the front.
    pub depth_stencil: DepthStencil,
    /// The logic operation, if enabled; it then replaces blending.
    pub logic_op: Option<LogicOp>,
    /// Blending and write masks, one per colour attachment. Only the first attachment is written.
    pub blend: Vec<BlendState>,
    /// The constants of the constant blend factors.
    pub blend_constants: [f32; 4],
}

impl Default for GaussianState {
    /// The defaults of 3DGS, degree 0; nothing is tested, and the fragment replaces what the attachment holds.
    fn default() -> Self {
        Self {
            sh_degree: 0,
            linearization: GaussianLinearization::Jacobian,
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
            sample_mask: u32::MAX,
            depth_stencil: DepthStencil::default(),
            logic_op: None,
            blend: Vec::new(),
            blend_constants: [0.0; 4],
        }
    }
}
