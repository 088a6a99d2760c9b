//! Other renderers, whose pictures of a scene are asked for.

use clap::ValueEnum;
use gaurast_render::{CutOff, Settings, SigmaPoints};
use gaurast_scene::camera::Model;
use gaurast_scene::{Antialiasing, Camera, Geometry, SortOrder};

/// Values of `--as`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum OtherRenderer {
    /// 3DGS's own (diff-gaussian-rasterization): tiles of a square of 3 standard deviations, from 0.2 on
    Inria,
    /// gsplat's, from 1.6 on: tiles of a rectangle of 3.33 standard deviations, from 0.01 on
    Gsplat,
    /// gsplat's up to 1.5: the same with alphas of up to 0.999
    #[value(name = "gsplat-1.5")]
    Gsplat15,
    /// gsplat's with `with_ut=True`: by the unscented transform, as it draws all lenses that distort
    GsplatUnscented,
    /// As KHR_gaussian_splatting says: an ellipse of 3 standard deviations, by distance from the camera
    Gltf,
    /// As OpenUSD's ParticleField3DGaussianSplat says: no cut-off, by depth unless the file has a hint
    Usd,
}

impl OtherRenderer {
    /// The order in which it composites, if a file's hint has no say.
    pub fn order(self, of_file: Option<SortOrder>) -> SortOrder {
        match self {
            Self::Inria | Self::Gsplat | Self::Gsplat15 | Self::GsplatUnscented => SortOrder::Depth,
            Self::Gltf => SortOrder::Distance,
            Self::Usd => of_file.unwrap_or(SortOrder::Depth),
        }
    }

    /// Its near plane, if it has one of its own.
    pub fn near(self) -> Option<f64> {
        match self {
            Self::Inria => Some(0.2),
            Self::Gsplat | Self::Gsplat15 | Self::GsplatUnscented => Some(0.01),
            Self::Gltf | Self::Usd => None,
        }
    }

    /// The settings by which its pictures for `cameras` are drawn. All of them dilate by 0.3 px^2, leave out alphas below
    /// 1/255, and finish pixels at 0.0001.
    pub fn settings<'a>(self, settings: Settings, cameras: impl IntoIterator<Item = &'a Camera>) -> Settings {
        let is_surfel = settings.geometry == Geometry::Surfel;
        let is_gsplat = matches!(self, Self::Gsplat | Self::Gsplat15 | Self::GsplatUnscented);
        let is_compensated = settings.antialiasing == Antialiasing::Compensated;
        // What is listed by z has no near plane at the device: gsplat's rays meet discs, and its lenses see sigma points, anywhere
        // in front of the eye.
        let (mut is_other_depth, mut distorts) = (is_surfel || self == Self::GsplatUnscented, false);
        for camera in cameras {
            is_other_depth |= camera.model == Model::Fisheye;
            distorts |= !camera.distortion.is_none();
            is_other_depth |= distorts;
        }
        // gsplat draws lenses that distort by the unscented transform alone.
        let is_unscented = self == Self::GsplatUnscented || (is_gsplat && distorts);
        let (cut_off, cut_off_deviations) = match self {
            Self::Inria => (CutOff::TileSquare, 3.0),
            Self::Gsplat | Self::Gsplat15 | Self::GsplatUnscented if is_unscented => {
                (CutOff::TileRectangleCompensated, 3.33)
            }
            Self::Gsplat | Self::Gsplat15 | Self::GsplatUnscented => (CutOff::TileRectangle, 3.33),
            Self::Gltf => (CutOff::Ellipse, 3.0),
            Self::Usd => (CutOff::None, 3.0),
        };
        Settings {
            alpha_floor: 1.0 / 255.0,
            alpha_ceiling: match self {
                Self::Gsplat15 => 0.999,
                Self::Inria | Self::Gsplat | Self::GsplatUnscented | Self::Gltf | Self::Usd => 0.99,
            },
            transmittance_floor: 1e-4,
            cut_off,
            cut_off_deviations,
            compensation_floor: match self {
                Self::Inria | Self::Gsplat if is_compensated => 0.000_025,
                _ if is_unscented => 0.000_025,
                _ => 0.0,
            },
            sigma_points: is_unscented.then_some(SigmaPoints::GSPLAT),
            by_z: is_gsplat && settings.order == SortOrder::Depth && is_other_depth,
            ..settings
        }
    }
}
