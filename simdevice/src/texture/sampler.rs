//! Samplers: how coordinates become texels and how texels are mixed.

use crate::state::CompareOp;

/// How texels of one mip level are mixed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Filter {
    /// The texel that the coordinates lie in.
    #[default]
    Nearest,
    /// The weighted mean of the texels around. Integer formats are read as [`Filter::Nearest`].
    Linear,
}

/// How mip levels are mixed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum MipmapMode {
    /// The nearest level.
    #[default]
    Nearest,
    /// The weighted mean of two levels.
    Linear,
}

/// What coordinates outside the image mean, along one axis. Cubes without seams have no outside and ignore it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum AddressMode {
    /// The image repeats.
    #[default]
    Repeat,
    /// The image repeats, every other time mirrored.
    MirroredRepeat,
    /// The texel at the edge.
    ClampToEdge,
    /// The border colour.
    ClampToBorder,
    /// The image is mirrored once, then its edge goes on.
    MirrorClampToEdge,
}

/// What [`AddressMode::ClampToBorder`] reads outside the image: the bits of red, green, blue, alpha. Floats or
/// integers, as the image's format is. Components that the format lacks read as ever.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct BorderColor(pub [u32; 4]);

impl BorderColor {
    /// Zeros, of any format.
    pub const TRANSPARENT_BLACK: Self = Self([0; 4]);
    /// (0, 0, 0, 1), for float formats.
    pub const FLOAT_OPAQUE_BLACK: Self = Self::float([0.0, 0.0, 0.0, 1.0]);
    /// Ones, for float formats.
    pub const FLOAT_OPAQUE_WHITE: Self = Self::float([1.0; 4]);
    /// (0, 0, 0, 1), for integer formats.
    pub const INT_OPAQUE_BLACK: Self = Self([0, 0, 0, 1]);
    /// Ones, for integer formats.
    pub const INT_OPAQUE_WHITE: Self = Self([1; 4]);

    /// Any colour, for float formats.
    pub const fn float([r, g, b, a]: [f32; 4]) -> Self {
        Self([r.to_bits(), g.to_bits(), b.to_bits(), a.to_bits()])
    }
}

/// What becomes of the texels that a filter takes together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Reduction {
    /// Their weighted mean.
    #[default]
    WeightedAverage,
    /// The least of those that have a weight, component by component.
    Min,
    /// The greatest of those that have a weight, component by component.
    Max,
}

/// A sampler.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampler {
    /// Where an image is magnified: the level of detail is zero or less.
    pub mag_filter: Filter,
    /// Where it is minified.
    pub min_filter: Filter,
    /// Between levels.
    pub mipmap_mode: MipmapMode,
    /// Along u, v and w.
    pub address_modes: [AddressMode; 3],
    /// Added to the level of detail.
    pub mip_lod_bias: f32,
    /// The least level of detail.
    pub min_lod: f32,
    /// The greatest level of detail.
    pub max_lod: f32,
    /// The comparison with a reference value. Only instructions that bring a reference compare.
    pub compare_op: Option<CompareOp>,
    /// The colour outside.
    pub border_color: BorderColor,
    /// Whether a cube's faces are images of their own, each with an outside.
    pub has_seams: bool,
    /// Coordinates count texels of the view's first level, the only one that is read.
    pub unnormalized_coordinates: bool,
    /// The most samples along a pixel's footprint; at 1 filtering is isotropic.
    pub max_anisotropy: f32,
    /// What becomes of the texels that are filtered together.
    pub reduction: Reduction,
}

impl Default for Sampler {
    fn default() -> Self {
        Self {
            mag_filter: Filter::default(),
            min_filter: Filter::default(),
            mipmap_mode: MipmapMode::default(),
            address_modes: [AddressMode::default(); 3],
            mip_lod_bias: 0.0,
            min_lod: 0.0,
            max_lod: f32::MAX,
            compare_op: None,
            border_color: BorderColor::default(),
            has_seams: false,
            unnormalized_coordinates: false,
            max_anisotropy: 1.0,
            reduction: Reduction::default(),
        }
    }
}
