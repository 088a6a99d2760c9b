//! Modes of the pipeline that change the picture, not the cost.

use gaurast::vk::{
    GaussianAntialiasingGAURAST, GaussianCutOffGAURAST, GaussianGeometryGAURAST, GaussianOrderGAURAST,
    GaussianPrecisionGAURAST,
};
use serde::{Deserialize, Serialize};

/// The key by which Gaussians are sorted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Order {
    /// Depth along the camera's axis, as in 3DGS.
    #[default]
    Depth,
    /// Distance from the camera.
    Distance,
    /// Depth along each pixel's own ray: no Gaussian pops as the camera turns.
    PerPixel,
}

impl Order {
    /// The value for the pipeline.
    pub(crate) fn raw(self) -> GaussianOrderGAURAST {
        match self {
            Self::Depth => GaussianOrderGAURAST::VIEW_DEPTH,
            Self::Distance => GaussianOrderGAURAST::RADIAL_DISTANCE,
            Self::PerPixel => GaussianOrderGAURAST::PER_PIXEL,
        }
    }
}

/// The shape outside which a Gaussian does not contribute, of a number of standard deviations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum CutOff {
    /// There is none: they contribute wherever their alpha reaches its floor.
    #[default]
    None,
    /// The ellipse, as glTF's extension has it.
    Ellipse,
    /// The tiles of 16x16 pixels that a square touches, as 3DGS has them.
    TileSquare,
    /// The tiles that a rectangle touches, as gsplat has them.
    TileRectangle,
}

impl CutOff {
    /// As the pipeline is told.
    pub(crate) fn raw(self) -> GaussianCutOffGAURAST {
        match self {
            Self::None => GaussianCutOffGAURAST::NONE,
            Self::Ellipse => GaussianCutOffGAURAST::ELLIPSE,
            Self::TileSquare => GaussianCutOffGAURAST::TILE_SQUARE,
            Self::TileRectangle => GaussianCutOffGAURAST::TILE_RECTANGLE,
        }
    }
}

/// The shape of Gaussians in space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Geometry {
    /// Volumes with three axes, as in 3DGS.
    #[default]
    Volume,
    /// Flat discs with two axes, as in 2DGS; a third scale is ignored.
    Surfel,
}

impl Geometry {
    /// The value for the pipeline.
    pub(crate) fn raw(self) -> GaussianGeometryGAURAST {
        match self {
            Self::Volume => GaussianGeometryGAURAST::GAUSSIAN_3D,
            Self::Surfel => GaussianGeometryGAURAST::GAUSSIAN_2D,
        }
    }

    /// The variance of the screen filter for this shape, in px^2.
    pub(crate) fn low_pass_variance(self) -> f32 {
        match self {
            Self::Volume => 0.3,
            Self::Surfel => 0.5,
        }
    }
}

/// The rasterizer's arithmetic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Precision {
    /// binary32.
    #[default]
    Fp32,
    /// binary16, rounded after every operation.
    Fp16,
}

impl Precision {
    /// The value for the pipeline.
    pub(crate) fn raw(self) -> GaussianPrecisionGAURAST {
        match self {
            Self::Fp32 => GaussianPrecisionGAURAST::FLOAT32,
            Self::Fp16 => GaussianPrecisionGAURAST::FLOAT16,
        }
    }
}

/// The treatment of Gaussians that are smaller than a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Antialiasing {
    /// They are dilated and keep their opacity, as in 3DGS: distant ones look too thick.
    #[default]
    Dilate,
    /// They are dilated and lose opacity in proportion, for scenes that are trained so.
    Compensated,
}

impl Antialiasing {
    /// The value for the pipeline.
    pub(crate) fn raw(self) -> GaussianAntialiasingGAURAST {
        match self {
            Self::Dilate => GaussianAntialiasingGAURAST::DILATE,
            Self::Compensated => GaussianAntialiasingGAURAST::OPACITY_COMPENSATED,
        }
    }
}
