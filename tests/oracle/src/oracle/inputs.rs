//! The inputs of a draw after conversion to binary32: Gaussians, camera and state.

use gaurast::vk::{
    GaussianAntialiasingGAURAST, GaussianCameraDistortionGAURAST, GaussianCameraGAURAST, GaussianCameraModelGAURAST,
    GaussianCutOffGAURAST, GaussianGeometryGAURAST, GaussianLinearizationGAURAST, GaussianOrderGAURAST,
    PipelineGaussianFootprintStateCreateInfoGAURAST, PipelineGaussianStateCreateInfoGAURAST,
    PipelineGaussianUnscentedStateCreateInfoGAURAST,
};

use super::{OracleLens, Rules, spherical_harmonics};

/// The Gaussians of a draw, in primitive order (by draw, instance, position in the draw).
///
/// All slices but `sh` have one entry per Gaussian.
#[derive(Clone, Copy, Debug)]
pub struct OracleScene<'a> {
    /// Centres in world space.
    pub positions: &'a [[f32; 3]],
    /// Standard deviations along the Gaussian's own axes (not their logarithms).
    pub scales: &'a [[f32; 3]],
    /// Rotations from the Gaussian's axes to world space, as quaternions `w, x, y, z` of any
    /// length but zero.
    pub rotations: &'a [[f32; 4]],
    /// Opacities (after the sigmoid); more than 1 is allowed.
    pub opacities: &'a [f32],
    /// Spherical harmonics coefficients, `(stored_degree + 1)^2` red-green-blue triples for each
    /// Gaussian, one Gaussian after the other, in the order of 3DGS.
    pub sh: &'a [[f32; 3]],
    /// Degree of what `sh` holds, 0 to 4.
    pub stored_degree: u32,
    /// Degree that the pipeline asks for; the lower of the two is drawn.
    pub requested_degree: u32,
    /// The model matrix and the factor of the opacity of each Gaussian, or nothing.
    pub instances: &'a [OracleInstance],
}

/// The placement of a copy of a Gaussian in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleInstance {
    /// The rows of a matrix from model to world space.
    pub matrix: [[f32; 4]; 3],
    /// The factor of the opacity.
    pub opacity: f32,
}

impl Default for OracleInstance {
    fn default() -> Self {
        Self { matrix: [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]], opacity: 1.0 }
    }
}

impl OracleScene<'_> {
    /// Number of Gaussians.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// True if the draw has no Gaussian.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The degree that is drawn.
    pub fn degree(&self) -> u32 {
        self.stored_degree.min(self.requested_degree)
    }

    /// The coefficients of Gaussian `index` up to the degree that is drawn.
    pub(super) fn coefficients(&self, index: usize) -> &[[f32; 3]] {
        let stored = spherical_harmonics::coefficient_count(self.stored_degree);
        let drawn = spherical_harmonics::coefficient_count(self.degree());
        &self.sh[index * stored..][..drawn]
    }

    /// The placement of Gaussian `index` in the world; the identity if the draw has no instances.
    pub(super) fn instance(&self, index: usize) -> OracleInstance {
        self.instances.get(index).copied().unwrap_or_default()
    }

    /// The opacity of Gaussian `index`, rounded to binary32 once.
    pub(super) fn opacity(&self, index: usize) -> f32 {
        self.opacities[index] * self.instance(index).opacity
    }
}

/// The projection model of a camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OracleModel {
    /// Perspective.
    #[default]
    Pinhole,
    /// Parallel.
    Orthographic,
    /// Equidistant fisheye.
    Fisheye,
    /// Longitude and latitude of all directions.
    Equirectangular,
}

/// The shape of a Gaussian in space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OracleGeometry {
    /// A volume.
    #[default]
    Volume,
    /// A flat disc; the third scale is not read.
    Surfel,
}

/// The order of Gaussians.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OracleOrder {
    /// The depth variable.
    #[default]
    ViewDepth,
    /// The distance from the eye.
    RadialDistance,
    /// The order of the draw.
    Primitive,
    /// At each pixel, the depth at which a Gaussian's density is greatest on the pixel's ray.
    PerPixel,
}

impl OracleOrder {
    /// True if Gaussians are sorted by a depth or a distance.
    pub(super) fn has_keys(self) -> bool {
        matches!(self, Self::ViewDepth | Self::RadialDistance)
    }
}

/// The shape outside which a Gaussian does not contribute.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OracleCutOff {
    /// There is none.
    #[default]
    None,
    /// The ellipse of a Mahalanobis distance.
    Ellipse,
    /// The tiles that a square touches.
    TileSquare,
    /// The tiles that a rectangle touches.
    TileRectangle,
    /// The same, of no more deviations than those at which the compensated opacity reaches the alpha floor.
    TileRectangleCompensated,
}

/// A camera and the viewport that it fills, as `VkGaussianCameraGAURAST` holds them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleCamera {
    /// The projection model.
    pub model: OracleModel,
    /// Width of the viewport in pixels.
    pub width: u32,
    /// Height of the viewport in pixels.
    pub height: u32,
    /// World to camera, row-major; the camera looks along +z, +x is right and +y is down.
    pub rotation: [f32; 9],
    /// The camera's position in world space.
    pub eye: [f64; 3],
    /// Focal lengths in pixels (per unit of length, or per radian).
    pub focal: [f32; 2],
    /// Principal point in pixels from the viewport's upper left corner.
    pub principal: [f32; 2],
    /// Gaussians are drawn where `near < z`.
    pub near: f32,
    /// Gaussians are drawn where `z < far`.
    pub far: f32,
    /// The lens, if it distorts.
    pub lens: Option<OracleLens>,
}

/// The sigma points of the unscented transform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleSigmaPoints {
    /// The first parameter of their spread.
    pub alpha: f32,
    /// The parameter of the weight of the mean's point.
    pub beta: f32,
    /// The second parameter of their spread.
    pub kappa: f32,
    /// The part of the viewport's size by which points that count may lie outside; infinite if none is left out.
    pub picture_margin: f32,
    /// True if all points must count, false if one must.
    pub all: bool,
}

impl Default for OracleSigmaPoints {
    fn default() -> Self {
        Self { alpha: 1.0, beta: 2.0, kappa: 0.0, picture_margin: f32::INFINITY, all: false }
    }
}

/// The pipeline's Gaussian state. The defaults are the extension's, which are those of 3DGS.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleState {
    /// Variance in px^2 added to both axes of the projected covariance.
    pub low_pass: f32,
    /// A Gaussian contributes to a pixel where its alpha is at least this.
    pub alpha_floor: f32,
    /// Alpha is at most this.
    pub alpha_ceiling: f32,
    /// A pixel is finished before the Gaussian that would bring its transmittance below this.
    pub transmittance_floor: f32,
    /// True if opacity compensates for the area that the low-pass filter adds.
    pub opacity_compensated: bool,
    /// True if Gaussians are projected by the unscented transform.
    pub unscented: bool,
    /// The points of the unscented transform.
    pub sigma_points: OracleSigmaPoints,
    /// The shape of Gaussians.
    pub geometry: OracleGeometry,
    /// The order of Gaussians.
    pub order: OracleOrder,
    /// The shape outside which they do not contribute.
    pub cut_off: OracleCutOff,
    /// Its size in standard deviations.
    pub cut_off_deviations: f32,
    /// The least ratio of determinants that compensation takes the root of.
    pub compensation_floor: f32,
    /// The rules that the steps follow; the text's by default.
    pub rules: Rules,
}

impl OracleState {
    /// The same with a pipeline's structure of footprints.
    #[must_use]
    pub fn with_footprint(self, footprint: &PipelineGaussianFootprintStateCreateInfoGAURAST<'_>) -> Self {
        Self {
            cut_off: match footprint.cut_off {
                GaussianCutOffGAURAST::ELLIPSE => OracleCutOff::Ellipse,
                GaussianCutOffGAURAST::TILE_SQUARE => OracleCutOff::TileSquare,
                GaussianCutOffGAURAST::TILE_RECTANGLE => OracleCutOff::TileRectangle,
                GaussianCutOffGAURAST::TILE_RECTANGLE_COMPENSATED => OracleCutOff::TileRectangleCompensated,
                _ => OracleCutOff::None,
            },
            cut_off_deviations: footprint.cut_off_deviations,
            compensation_floor: footprint.compensation_floor,
            ..self
        }
    }

    /// The same with a pipeline's structure of sigma points.
    #[must_use]
    pub fn with_unscented(self, unscented: &PipelineGaussianUnscentedStateCreateInfoGAURAST<'_>) -> Self {
        let sigma_points = OracleSigmaPoints {
            alpha: unscented.alpha,
            beta: unscented.beta,
            kappa: unscented.kappa,
            picture_margin: unscented.picture_margin,
            all: unscented.all_sigma_points != 0,
        };
        Self { sigma_points, ..self }
    }

    /// The factor that compensates opacity, and the root of the determinant whose error it has. `area` is the root of the
    /// determinant before the low-pass.
    pub(super) fn compensation(&self, area: f64, determinant: f64) -> [f64; 2] {
        let floor = f64::from(self.compensation_floor);
        let area = area.max((floor * determinant).sqrt());
        [area / determinant.sqrt(), area]
    }
}

impl Default for OracleState {
    fn default() -> Self {
        Self {
            low_pass: 0.3,
            alpha_floor: 1.0 / 255.0,
            alpha_ceiling: 0.99,
            transmittance_floor: 1e-4,
            opacity_compensated: false,
            unscented: false,
            sigma_points: OracleSigmaPoints::default(),
            geometry: OracleGeometry::Volume,
            order: OracleOrder::ViewDepth,
            cut_off: OracleCutOff::None,
            cut_off_deviations: 0.0,
            compensation_floor: 0.0,
            rules: Rules::default(),
        }
    }
}

impl OracleCamera {
    /// The camera of a draw and its viewport's width and height, or `None` if the oracle lacks its
    /// model.
    pub fn new(camera: &GaussianCameraGAURAST, [width, height]: [u32; 2]) -> Option<Self> {
        let model = match camera.model {
            GaussianCameraModelGAURAST::PINHOLE => OracleModel::Pinhole,
            GaussianCameraModelGAURAST::ORTHOGRAPHIC => OracleModel::Orthographic,
            GaussianCameraModelGAURAST::FISHEYE => OracleModel::Fisheye,
            GaussianCameraModelGAURAST::EQUIRECTANGULAR => OracleModel::Equirectangular,
            _ => return None,
        };
        Some(Self {
            model,
            width,
            height,
            rotation: camera.rotation,
            eye: camera.eye,
            focal: camera.focal_length,
            principal: camera.principal_point,
            near: camera.near_plane,
            far: camera.far_plane,
            lens: None,
        })
    }

    /// The same camera with the lens of a structure, if it distorts.
    #[must_use]
    pub fn with_distortion(self, distortion: Option<&GaussianCameraDistortionGAURAST<'_>>) -> Self {
        Self { lens: distortion.and_then(OracleLens::new), ..self }
    }

    /// The camera as a draw takes it, without the structure of its lens.
    pub fn to_vulkan(&self) -> GaussianCameraGAURAST<'static> {
        let model = match self.model {
            OracleModel::Pinhole => GaussianCameraModelGAURAST::PINHOLE,
            OracleModel::Orthographic => GaussianCameraModelGAURAST::ORTHOGRAPHIC,
            OracleModel::Fisheye => GaussianCameraModelGAURAST::FISHEYE,
            OracleModel::Equirectangular => GaussianCameraModelGAURAST::EQUIRECTANGULAR,
        };
        GaussianCameraGAURAST::default()
            .model(model)
            .rotation(self.rotation)
            .eye(self.eye)
            .focal_length(self.focal)
            .principal_point(self.principal)
            .near_plane(self.near)
            .far_plane(self.far)
    }
}

impl From<&PipelineGaussianStateCreateInfoGAURAST<'_>> for OracleState {
    fn from(info: &PipelineGaussianStateCreateInfoGAURAST) -> Self {
        Self {
            low_pass: info.low_pass_variance,
            alpha_floor: info.alpha_floor,
            alpha_ceiling: info.alpha_ceiling,
            transmittance_floor: info.transmittance_floor,
            opacity_compensated: info.antialiasing == GaussianAntialiasingGAURAST::OPACITY_COMPENSATED,
            unscented: info.linearization == GaussianLinearizationGAURAST::UNSCENTED,
            sigma_points: OracleSigmaPoints::default(),
            geometry: match info.geometry {
                GaussianGeometryGAURAST::GAUSSIAN_2D => OracleGeometry::Surfel,
                _ => OracleGeometry::Volume,
            },
            order: match info.order {
                GaussianOrderGAURAST::RADIAL_DISTANCE => OracleOrder::RadialDistance,
                GaussianOrderGAURAST::PRIMITIVE => OracleOrder::Primitive,
                GaussianOrderGAURAST::PER_PIXEL => OracleOrder::PerPixel,
                _ => OracleOrder::ViewDepth,
            },
            cut_off: OracleCutOff::None,
            cut_off_deviations: 0.0,
            compensation_floor: 0.0,
            rules: Rules::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_those_of_the_extension() {
        let info = PipelineGaussianStateCreateInfoGAURAST::default();
        assert_eq!(OracleState::from(&info), OracleState::default());
        let info = info.antialiasing(GaussianAntialiasingGAURAST::OPACITY_COMPENSATED);
        assert!(OracleState::from(&info).opacity_compensated);
    }

    #[test]
    fn other_cameras_are_refused() {
        let camera = GaussianCameraGAURAST::default();
        assert!(OracleCamera::new(&camera, [8, 8]).is_some());
        let own = crate::scenes::camera(8, 8);
        assert_eq!(OracleCamera::new(&own.to_vulkan(), [8, 8]), Some(own));
        let camera = camera.model(GaussianCameraModelGAURAST::from_raw(77));
        assert_eq!(OracleCamera::new(&camera, [8, 8]), None);
    }
}
