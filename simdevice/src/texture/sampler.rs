//! Samplers: the conversion of coordinates to texels, and the filtering of texels.

use crate::state::CompareOp;

/// The filter within one mip level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Filter {
    /// The texel that contains the coordinates.
    #[default]
    Nearest,
    /// The weighted mean of the surrounding texels. Integer formats are read as with [`Filter::Nearest`].
    Linear,
}

/// The filter between mip levels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum MipmapMode {
    /// The nearest level.
    #[default]
    Nearest,
    /// The weighted mean of two levels.
    Linear,
}

/// The meaning of coordinates outside the image, along one axis. Cubes without seams have no outside and ignore it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum AddressMode {
    /// The image repeats.
    #[default]
    Repeat,
    /// The image repeats, and every second copy is mirrored.
    MirroredRepeat,
    /// The texel at the edge is repeated.
    ClampToEdge,
    /// The border colour is read.
    ClampToBorder,
    /// The image is mirrored once, then the texel at the edge is repeated.
    MirrorClampToEdge,
}

/// The colour that [`AddressMode::ClampToBorder`] reads outside the image: the bits of red, green, blue, alpha. They
/// are floats or integers, as the image's format is. Components that the format lacks are read as 0, and alpha as 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct BorderColor(pub [u32; 4]);

impl BorderColor {
    /// Zeros, for any format.
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

/// The reduction of the texels that a filter reads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Reduction {
    /// The weighted mean.
    #[default]
    WeightedAverage,
    /// The least of the texels with a weight, component by component.
    Min,
    /// The greatest of the texels with a weight, component by component.
    Max,
}

/// A sampler.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampler {
    /// The filter if the image is magnified: the level of detail is zero or less.
    pub mag_filter: Filter,
    /// The filter if the image is minified.
    pub min_filter: Filter,
    /// The filter between levels.
    pub mipmap_mode: MipmapMode,
    /// The address modes along u, v and w.
    pub address_modes: [AddressMode; 3],
    /// The bias that is added to the level of detail.
    pub mip_lod_bias: f32,
    /// The least level of detail.
    pub min_lod: f32,
    /// The greatest level of detail.
    pub max_lod: f32,
    /// The comparison with a reference value. Only instructions with a reference compare.
    pub compare_op: Option<CompareOp>,
    /// The colour outside of the image.
    pub border_color: BorderColor,
    /// True if a cube's faces are images of their own, each with an outside.
    pub has_seams: bool,
    /// Coordinates count texels of the view's first level, the only one that is read.
    pub unnormalized_coordinates: bool,
    /// The most samples along a pixel's footprint. With 1, filtering is isotropic.
    pub max_anisotropy: f32,
    /// The reduction of the texels that a filter reads.
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
