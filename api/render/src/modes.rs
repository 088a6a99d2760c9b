//! Modes of the pipeline that change the picture, not the cost.

use ash::vk;
use gaurast::vk::{
    GaussianAntialiasingGAURAST, GaussianCutOffGAURAST, GaussianGeometryGAURAST, GaussianOrderGAURAST,
    GaussianPrecisionGAURAST, GaussianResolveInputLocationsGAURAST, PipelineGaussianUnscentedStateCreateInfoGAURAST,
};
use gaurast_scene::{Antialiasing, Geometry, SortOrder};
use serde::{Deserialize, Serialize};

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
    /// The same, of a rectangle that compensation makes smaller, as gsplat's unscented projection has them.
    TileRectangleCompensated,
}

impl CutOff {
    /// As the pipeline is told.
    pub(crate) fn raw(self) -> GaussianCutOffGAURAST {
        match self {
            Self::None => GaussianCutOffGAURAST::NONE,
            Self::Ellipse => GaussianCutOffGAURAST::ELLIPSE,
            Self::TileSquare => GaussianCutOffGAURAST::TILE_SQUARE,
            Self::TileRectangle => GaussianCutOffGAURAST::TILE_RECTANGLE,
            Self::TileRectangleCompensated => GaussianCutOffGAURAST::TILE_RECTANGLE_COMPENSATED,
        }
    }
}

/// The sigma points of the unscented transform, by which covariances are projected without the Jacobian.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SigmaPoints {
    /// The spread of the points about the mean.
    pub alpha: f32,
    /// The part of the mean's own weight that a distribution decides: 2 for Gaussians.
    pub beta: f32,
    /// The second parameter of the spread.
    pub kappa: f32,
    /// The part of the picture's size by which points that count may lie outside of it.
    pub picture_margin: f32,
    /// True if a Gaussian is drawn only if all of its points count, false if one suffices.
    pub all: bool,
}

impl SigmaPoints {
    /// gsplat's.
    pub const GSPLAT: Self = Self { alpha: 0.1, beta: 2.0, kappa: 0.0, picture_margin: 0.1, all: false };

    /// The structure for the pipeline.
    pub(crate) fn raw(self) -> PipelineGaussianUnscentedStateCreateInfoGAURAST<'static> {
        PipelineGaussianUnscentedStateCreateInfoGAURAST::default()
            .alpha(self.alpha)
            .beta(self.beta)
            .kappa(self.kappa)
            .picture_margin(self.picture_margin)
            .all_sigma_points(self.all)
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

/// The pipeline's value for the order of Gaussians that the host has listed.
pub(crate) const LISTED: GaussianOrderGAURAST = GaussianOrderGAURAST::PRIMITIVE;

/// The pipeline's value for a sort order.
pub(crate) fn raw_order(order: SortOrder) -> GaussianOrderGAURAST {
    match order {
        SortOrder::Depth => GaussianOrderGAURAST::VIEW_DEPTH,
        SortOrder::Distance => GaussianOrderGAURAST::RADIAL_DISTANCE,
        SortOrder::PerPixel => GaussianOrderGAURAST::PER_PIXEL,
    }
}

/// The pipeline's value for a shape in space.
pub(crate) fn raw_geometry(geometry: Geometry) -> GaussianGeometryGAURAST {
    match geometry {
        Geometry::Volume => GaussianGeometryGAURAST::GAUSSIAN_3D,
        Geometry::Surfel => GaussianGeometryGAURAST::GAUSSIAN_2D,
    }
}

/// Two numbers that a frame keeps of each pixel besides its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kept {
    /// The expected and the median depth, as a depth buffer has them.
    Depths,
    /// The mean and the median depth.
    LinearDepths,
    /// The numbers of the Gaussian of the median depth and of the nearest one, from 1 on.
    Gaussians,
}

impl Kept {
    /// The format of the attachment.
    pub(crate) fn format(self) -> vk::Format {
        match self {
            Self::Depths | Self::LinearDepths => vk::Format::R32G32_SFLOAT,
            Self::Gaussians => vk::Format::R32G32_UINT,
        }
    }

    /// The SPIR-V module that writes it.
    pub(crate) fn shader(self) -> &'static [u8] {
        match self {
            Self::Depths | Self::LinearDepths => include_bytes!("shaders/depths.frag.spv"),
            Self::Gaussians => include_bytes!("shaders/gaussians.frag.spv"),
        }
    }

    /// The locations of that module's inputs.
    pub(crate) fn locations(self) -> GaussianResolveInputLocationsGAURAST {
        let locations = GaussianResolveInputLocationsGAURAST::default().accumulated_color(0);
        match self {
            Self::Depths => locations.depth(1),
            Self::LinearDepths => locations.linear_depth(1),
            Self::Gaussians => locations.median_gaussian(1).nearest_gaussian(2),
        }
    }
}

/// The variance of 3DGS's screen filter for a shape, in px^2.
pub(crate) fn low_pass_variance(geometry: Geometry) -> f32 {
    match geometry {
        Geometry::Volume => 0.3,
        Geometry::Surfel => 0.5,
    }
}

/// The pipeline's value for the compensation of the screen filter.
pub(crate) fn raw_antialiasing(antialiasing: Antialiasing) -> GaussianAntialiasingGAURAST {
    match antialiasing {
        Antialiasing::Off => GaussianAntialiasingGAURAST::DILATE,
        Antialiasing::Compensated => GaussianAntialiasingGAURAST::OPACITY_COMPENSATED,
    }
}
