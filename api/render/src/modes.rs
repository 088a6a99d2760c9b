//! Modes of the pipeline that change what a picture is, not what it costs.

use gaurast::vk::{
    GaussianAntialiasingGAURAST, GaussianCutOffGAURAST, GaussianGeometryGAURAST,
    GaussianOrderGAURAST, GaussianPrecisionGAURAST,
};
use serde::{Deserialize, Serialize};

/// What Gaussians are sorted by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Order {
    /// Depth along the camera's axis, as 3DGS does.
    #[default]
    Depth,
    /// Distance from the camera.
    Distance,
    /// Depth along each pixel's own ray: nothing pops as the camera turns.
    PerPixel,
}

impl Order {
    /// As the pipeline is told.
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

/// What Gaussians are in space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Geometry {
    /// Volumes with three axes, as of 3DGS.
    #[default]
    Volume,
    /// Flat discs with two, as of 2DGS; a third scale is not looked at
    Surfel,
}

impl Geometry {
    /// As the pipeline is told.
    pub(crate) fn raw(self) -> GaussianGeometryGAURAST {
        match self {
            Self::Volume => GaussianGeometryGAURAST::GAUSSIAN_3D,
            Self::Surfel => GaussianGeometryGAURAST::GAUSSIAN_2D,
        }
    }

    /// The variance of the filter that goes with it, in px^2.
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
    /// As the pipeline is told.
    pub(crate) fn raw(self) -> GaussianPrecisionGAURAST {
        match self {
            Self::Fp32 => GaussianPrecisionGAURAST::FLOAT32,
            Self::Fp16 => GaussianPrecisionGAURAST::FLOAT16,
        }
    }
}

/// What becomes of Gaussians that are smaller than a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Antialiasing {
    /// They are dilated and keep their opacity, as 3DGS does: what is far off looks too thick.
    #[default]
    Dilate,
    /// Their opacity makes up for the dilation: for scenes that are trained so.
    Compensated,
}

impl Antialiasing {
    /// As the pipeline is told.
    pub(crate) fn raw(self) -> GaussianAntialiasingGAURAST {
        match self {
            Self::Dilate => GaussianAntialiasingGAURAST::DILATE,
            Self::Compensated => GaussianAntialiasingGAURAST::OPACITY_COMPENSATED,
        }
    }
}
