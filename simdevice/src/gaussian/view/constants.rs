//! The constants that all Gaussians of a view share.

use super::camera::period;
use super::center_depth::CenterDepth;
use super::cut_off::{TileCutOff, list_cut_off};
use super::distortion::Lens;
use super::sigma_points::SigmaPoints;
use super::visible::Visible;
use crate::state::Viewport;
use crate::state::gaussian::{
    Camera, CameraModel, GaussianGeometry, GaussianLinearization, GaussianOrder, GaussianPrecision, GaussianState,
};
use crate::stats::optimizations::Optimizations;

/// The least base-2 logarithm of alpha that is drawn where the alpha floor is zero: binary32 underflows below it.
const LEAST_LOG2_ALPHA: f64 = -150.0;

/// The constants that all Gaussians of a draw share.
#[derive(Clone, Debug)]
pub(crate) struct ViewConstants {
    pub(crate) model: CameraModel,
    /// The lens, if it distorts.
    pub(crate) lens: Option<Lens>,
    /// True if covariances come from the unscented transform.
    pub(crate) unscented: bool,
    pub(crate) sigma_points: SigmaPoints,
    pub(crate) order: GaussianOrder,
    pub(crate) geometry: GaussianGeometry,
    pub(crate) precision: GaussianPrecision,
    pub(crate) rotation: [f64; 9],
    pub(crate) eye: [f64; 3],
    pub(crate) focal: [f64; 2],
    /// The principal point in framebuffer pixels.
    pub(crate) center: [f64; 2],
    /// The number of pixels after which the picture repeats horizontally, if it does.
    pub(crate) period: Option<f64>,
    /// Bounds of `t.x / t.z` and `t.y / t.z` in the Jacobian.
    pub(crate) slope_min: [f64; 2],
    pub(crate) slope_max: [f64; 2],
    pub(crate) near: f32,
    pub(crate) far: f32,
    pub(crate) low_pass: f64,
    pub(crate) compensated: bool,
    /// The least ratio of determinants that compensation takes the root of.
    pub(crate) compensation_floor: f64,
    pub(crate) alpha_floor: f64,
    pub(crate) log2_floor: f64,
    pub(crate) sh_degree: u32,
    pub(crate) visible: Visible,
    pub(crate) optimizations: Optimizations,
    /// The map from depth variables to depths, if the draw needs depths.
    pub(crate) depth: Option<CenterDepth>,
    /// True if identities are kept.
    pub(crate) is_tracked: bool,
    /// The cut-off by which tiles are left out.
    pub(crate) list_cut_off: Option<TileCutOff>,
    /// The cut-off of discs, in lists or at pixels.
    pub(crate) surfel_cut_off: Option<TileCutOff>,
}

impl ViewConstants {
    /// The constants of a draw that may touch the pixels of `visible`.
    pub(crate) fn new(
        state: &GaussianState,
        camera: &Camera,
        viewport: &Viewport,
        visible: Visible,
        depth: Option<CenterDepth>,
        optimizations: Optimizations,
    ) -> Self {
        let focal = camera.focal_length.map(f64::from);
        let principal = camera.principal_point.map(f64::from);
        let size = [viewport.width, viewport.height].map(f64::from);
        let margin = [0, 1].map(|axis| 0.15 * size[axis] / focal[axis]);
        let slope_min = [0, 1].map(|axis| -(principal[axis] / focal[axis] + margin[axis]));
        let slope_max = [0, 1].map(|axis| (size[axis] - principal[axis]) / focal[axis] + margin[axis]);
        let lens = camera.distortion.as_ref().map(Lens::new);
        let wider = lens.as_ref().map(|lens| widening(lens, slope_min, slope_max));
        let widened = |slope: [f64; 2]| wider.map_or(slope, |factor| slope.map(|slope| slope * factor));
        Self {
            model: camera.model,
            lens,
            unscented: state.linearization == GaussianLinearization::Unscented,
            sigma_points: SigmaPoints::new(&state.unscented, camera, viewport),
            order: state.order,
            geometry: state.geometry,
            precision: state.precision,
            rotation: camera.rotation.map(f64::from),
            eye: camera.eye,
            focal,
            center: [principal[0] + f64::from(viewport.x), principal[1] + f64::from(viewport.y)],
            // Discs are not drawn by panoramas.
            period: period(camera).filter(|_| state.geometry == GaussianGeometry::Volume),
            slope_min: widened(slope_min),
            slope_max: widened(slope_max),
            near: camera.near_plane,
            far: camera.far_plane,
            low_pass: f64::from(state.low_pass_variance),
            compensated: state.opacity_compensated,
            compensation_floor: state.footprint.compensation_floor.into(),
            alpha_floor: state.alpha_floor.into(),
            log2_floor: libm::log2(state.alpha_floor.into()).max(LEAST_LOG2_ALPHA),
            sh_degree: state.sh_degree,
            visible,
            depth,
            is_tracked: false,
            list_cut_off: list_cut_off(state, camera, viewport),
            surfel_cut_off: TileCutOff::of(state, [viewport.x, viewport.y].map(f64::from))
                .filter(|_| state.geometry == GaussianGeometry::Surfel),
            optimizations,
        }
    }

    /// The least and the greatest slopes in x and y at which a pinhole's Jacobian is taken.
    pub(crate) fn slopes(&self) -> [[f64; 2]; 2] {
        [self.slope_min, self.slope_max]
    }

    /// Bounds of the visible pixels' centres along an axis, widened by a pixel on each side.
    pub(crate) fn visible_range(&self, axis: usize) -> [f64; 2] {
        let [first, last] = self.visible.pixels(axis);
        [first - 1.0, last + 2.0]
    }
}

/// The factor by which a lens that distorts widens the bounds of slopes, from the corner that is the farthest from the
/// principal point.
fn widening(lens: &Lens, least: [f64; 2], greatest: [f64; 2]) -> f64 {
    let farthest = [0, 1].map(|axis| least[axis].abs().max(greatest[axis].abs()));
    lens.widening(libm::hypot(farthest[0], farthest[1]))
}
