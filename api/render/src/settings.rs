//! How a scene is drawn.

use gaurast_scene::camera::Model;
use gaurast_scene::{Camera, MAX_SH_DEGREE};
use serde::{Deserialize, Serialize};

use crate::error::RenderError;
use crate::modes::{Antialiasing, CutOff, Geometry, Order, Precision};

/// What a draw may save on: the pipeline's state as far as pictures are the better for it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Draw colours with spherical harmonics of at most this degree.
    pub sh_degree: u32,
    /// A Gaussian counts where its alpha is at least this.
    pub alpha_floor: f32,
    /// Alpha is at most this.
    pub alpha_ceiling: f32,
    /// A pixel is finished before its transmittance would fall below this.
    pub transmittance_floor: f32,
    /// What Gaussians are sorted by.
    pub order: Order,
    /// What Gaussians are.
    pub geometry: Geometry,
    /// The rasterizer's arithmetic; binary16 is for volumes in another order than the pixels' own.
    pub precision: Precision,
    /// The greatest relative error of the exponential that alpha is made of.
    pub exponential_error: f32,
    /// What the contributions that are left out at a pixel may add up to.
    pub contribution_budget: f32,
    /// What becomes of Gaussians that are smaller than a pixel.
    pub antialiasing: Antialiasing,
    /// The least ratio of determinants that compensated opacity is the root of.
    pub compensation_floor: f32,
    /// The shape outside which Gaussians do not contribute.
    pub cut_off: CutOff,
    /// The size of that shape in standard deviations.
    pub cut_off_deviations: f32,
    /// Keep depths, too: see [`Frame::depth`](crate::Frame::depth).
    pub depth: bool,
}

impl Default for Settings {
    /// 3DGS's, with all colour there is.
    fn default() -> Self {
        Self {
            sh_degree: MAX_SH_DEGREE,
            alpha_floor: 1.0 / 255.0,
            alpha_ceiling: 0.99,
            transmittance_floor: 1e-4,
            order: Order::Depth,
            geometry: Geometry::Volume,
            precision: Precision::Fp32,
            exponential_error: 0.0,
            contribution_budget: 0.0,
            antialiasing: Antialiasing::Dilate,
            compensation_floor: 0.0,
            cut_off: CutOff::None,
            cut_off_deviations: 3.0,
            depth: false,
        }
    }
}

impl Settings {
    /// Checks that the device draws these modes together, as `camera` sees it, and that the camera can be drawn with.
    ///
    /// # Errors
    /// [`RenderError::Combination`], or [`RenderError::Camera`].
    pub fn check(&self, camera: &Camera) -> Result<(), RenderError> {
        camera.check()?;
        let half = self.precision == Precision::Fp16;
        let surfels = self.geometry == Geometry::Surfel;
        let per_pixel = self.order == Order::PerPixel;
        let panorama = camera.model == Model::Equirectangular;
        let refused = [
            (
                surfels && half,
                "flat Gaussians (2d) are not drawn in binary16 (fp16)",
            ),
            (
                surfels && self.antialiasing == Antialiasing::Compensated,
                "flat Gaussians (2d) are not drawn with compensated opacity",
            ),
            (
                surfels && (panorama || camera.model == Model::Fisheye),
                "flat Gaussians (2d) are drawn by pinhole and orthographic cameras alone",
            ),
            (
                half && per_pixel,
                "binary16 (fp16) goes with an order of the whole draw, not with the order per-pixel",
            ),
            (
                half && panorama,
                "panoramas are not drawn in binary16 (fp16)",
            ),
            (
                self.cut_off != CutOff::None && (surfels || half),
                "cut-offs, and so other renderers' pictures, are of volumes (3d) in binary32 (fp32)",
            ),
            (self.depth && half, "depths are not kept in binary16 (fp16)"),
            (
                self.depth && per_pixel,
                "depths are not kept in the order per-pixel",
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
