//! The settings with which a scene is drawn.

use gaurast_scene::camera::Model;
use gaurast_scene::{Antialiasing, Camera, Geometry, MAX_SH_DEGREE, SortOrder};
use serde::{Deserialize, Serialize};

use crate::error::RenderError;
use crate::modes::{CutOff, Kept, Precision, SigmaPoints};

/// The pipeline's settings that affect the picture or its cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// The highest spherical harmonics degree of colours.
    pub sh_degree: u32,
    /// The least alpha with which a Gaussian contributes to a pixel.
    pub alpha_floor: f32,
    /// Alpha is at most this.
    pub alpha_ceiling: f32,
    /// A pixel is finished before its transmittance would fall below this.
    pub transmittance_floor: f32,
    /// The key by which Gaussians are sorted.
    pub order: SortOrder,
    /// The shape of Gaussians.
    pub geometry: Geometry,
    /// The rasterizer's arithmetic. binary16 supports only volumes, in another order than per pixel.
    pub precision: Precision,
    /// The greatest relative error of the exponential in alpha.
    pub exponential_error: f32,
    /// The greatest sum of contributions that may be skipped at a pixel.
    pub contribution_budget: f32,
    /// The treatment of Gaussians that are smaller than a pixel.
    pub antialiasing: Antialiasing,
    /// The least ratio of determinants that compensated opacity is the root of.
    pub compensation_floor: f32,
    /// The shape outside which Gaussians do not contribute.
    pub cut_off: CutOff,
    /// The size of that shape in standard deviations.
    pub cut_off_deviations: f32,
    /// The variance of the screen filter in px^2; `None` is 3DGS's 0.3, or 0.5 of flat Gaussians.
    pub low_pass_variance: Option<f32>,
    /// Project covariances by the unscented transform with these sigma points, and not by the Jacobian.
    pub sigma_points: Option<SigmaPoints>,
    /// Leave out Gaussians, and sort them, by the z of their centres, whatever `order` says: the renderer lists them for each
    /// frame. Else a fisheye and a panorama go by distance, and the near plane cuts each ray that meets a flat Gaussian.
    pub by_z: bool,
    /// Keep depths, too: see [`Frame::depth`](crate::Frame::depth).
    pub depth: bool,
    /// Keep depths whose expected value is the mean depth itself, not the reciprocal of the mean reciprocal.
    pub linear_depth: bool,
    /// Keep the numbers of Gaussians, too: see [`Frame::gaussians`](crate::Frame::gaussians).
    pub gaussians: bool,
}

impl Default for Settings {
    /// 3DGS's settings, with the highest degree.
    fn default() -> Self {
        Self {
            sh_degree: MAX_SH_DEGREE,
            alpha_floor: 1.0 / 255.0,
            alpha_ceiling: 0.99,
            transmittance_floor: 1e-4,
            order: SortOrder::Depth,
            geometry: Geometry::Volume,
            precision: Precision::Fp32,
            exponential_error: 0.0,
            contribution_budget: 0.0,
            antialiasing: Antialiasing::Off,
            compensation_floor: 0.0,
            cut_off: CutOff::None,
            cut_off_deviations: 3.0,
            low_pass_variance: None,
            sigma_points: None,
            by_z: false,
            depth: false,
            linear_depth: false,
            gaussians: false,
        }
    }
}

impl Settings {
    /// The value that a frame keeps of each pixel besides its colour.
    pub(crate) fn kept(&self) -> Option<Kept> {
        match self {
            Self { depth: true, .. } => Some(Kept::Depths),
            Self { linear_depth: true, .. } => Some(Kept::LinearDepths),
            Self { gaussians: true, .. } => Some(Kept::Gaussians),
            _ => None,
        }
    }

    /// Checks that triangles are drawn with these modes and `camera`.
    ///
    /// # Errors
    /// [`RenderError::Combination`].
    pub fn check_mesh(&self, camera: &Camera) -> Result<(), RenderError> {
        let refused = [
            (
                matches!(camera.model, Model::Fisheye | Model::Equirectangular),
                "meshes are drawn by pinhole and orthographic cameras alone",
            ),
            (!camera.distortion.is_none(), "meshes are drawn by ideal lenses alone (--undistorted)"),
            (self.kept().is_some(), "depths are not kept of scenes with meshes"),
            (
                camera.model == Model::Orthographic && camera.far.is_infinite(),
                "meshes seen by an orthographic camera need a far plane",
            ),
        ];
        match refused.into_iter().find(|(refused, _)| *refused) {
            Some((_, sentence)) => Err(RenderError::Combination(sentence)),
            None => Ok(()),
        }
    }

    /// Checks that the device can combine these modes with `camera`, and that the camera is valid.
    ///
    /// # Errors
    /// [`RenderError::Combination`], or [`RenderError::Camera`].
    pub fn check(&self, camera: &Camera) -> Result<(), RenderError> {
        camera.check()?;
        let half = self.precision == Precision::Fp16;
        let surfels = self.geometry == Geometry::Surfel;
        let per_pixel = self.order == SortOrder::PerPixel;
        let panorama = camera.model == Model::Equirectangular;
        let distorted = !camera.distortion.is_none();
        let refused = [
            (surfels && half, "flat Gaussians (2d) are not drawn in binary16 (fp16)"),
            (
                surfels && self.antialiasing == Antialiasing::Compensated,
                "flat Gaussians (2d) are not drawn with compensated opacity",
            ),
            (
                surfels && (panorama || camera.model == Model::Fisheye),
                "flat Gaussians (2d) are drawn by pinhole and orthographic cameras alone",
            ),
            (
                surfels && self.sigma_points.is_some(),
                "flat Gaussians (2d) are not projected by the unscented transform",
            ),
            (surfels && distorted, "flat Gaussians (2d) are drawn by ideal lenses alone (--undistorted)"),
            (per_pixel && distorted, "the order per-pixel goes with ideal lenses alone (--undistorted)"),
            (half && per_pixel, "binary16 (fp16) goes with an order of the whole draw, not with the order per-pixel"),
            (half && panorama, "panoramas are not drawn in binary16 (fp16)"),
            (
                self.cut_off != CutOff::None && (surfels && self.cut_off != CutOff::TileRectangle || half),
                "cut-offs, and so other renderers' pictures, are of volumes (3d) in binary32 (fp32); flat Gaussians (2d) have \
                 gsplat's alone",
            ),
            (self.kept().is_some() && half, "depths are not kept in binary16 (fp16)"),
            (self.kept().is_some() && per_pixel, "depths are not kept in the order per-pixel"),
            (
                [self.depth, self.linear_depth, self.gaussians].iter().filter(|kept| **kept).count() > 1,
                "a frame keeps depths, linear depths or the numbers of Gaussians, one of them",
            ),
            (
                self.depth && camera.model == Model::Orthographic && camera.far.is_infinite(),
                "depths of an orthographic camera need a far plane",
            ),
        ];
        match refused.into_iter().find(|(refused, _)| *refused) {
            Some((_, sentence)) => Err(RenderError::Combination(sentence)),
            None => Ok(()),
        }
    }
}
