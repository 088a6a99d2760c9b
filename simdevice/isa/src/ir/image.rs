//! Operands of image statements.

use super::memory::{AtomicOp, Binding};
use super::register::Reg;

/// An image's shape, without its array layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Dimension {
    /// One-dimensional.
    D1,
    /// Two-dimensional.
    D2,
    /// Three-dimensional.
    D3,
    /// Six faces, addressed by a direction.
    Cube,
    /// A texel buffer.
    Buffer,
}

impl Dimension {
    /// The number of coordinates that address a texel, without the layer.
    pub fn coordinates(self) -> usize {
        match self {
            Self::D1 | Self::Buffer => 1,
            Self::D2 => 2,
            Self::D3 | Self::Cube => 3,
        }
    }
}

/// The kind of image that an instruction expects. All operand registers of image statements are `B32`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ImageShape {
    /// Its dimension.
    pub dimension: Dimension,
    /// True if it has layers; the layer is the last coordinate. (For storage cubes, face and layer are one: 6 layer +
    /// face, the third coordinate; such an image is a `D2` array.)
    pub arrayed: bool,
    /// True if it has several samples.
    pub multisampled: bool,
}

impl ImageShape {
    /// The number of coordinates that address a texel, with the layer.
    pub fn coordinates(self) -> usize {
        self.dimension.coordinates() + usize::from(self.arrayed)
    }
}

/// The source of a sample's level of detail.
#[derive(Clone, Debug, PartialEq)]
pub enum Lod {
    /// Computed from the coordinates' differences within the quad, plus a bias.
    Implicit {
        /// Added to the level.
        bias: Option<Reg>,
        /// The level is at least this.
        minimum: Option<Reg>,
    },
    /// The level itself.
    Explicit(Reg),
    /// Computed from given gradients, one register for each coordinate without the layer.
    Gradient {
        /// Along x.
        dx: Vec<Reg>,
        /// Along y.
        dy: Vec<Reg>,
        /// The level is at least this.
        minimum: Option<Reg>,
    },
}

/// A filtered access through a sampler.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Red, green, blue, alpha; None for a component that is not used. A depth comparison has only the first.
    pub dst: [Option<Reg>; 4],
    /// The image.
    pub image: Binding,
    /// The sampler.
    pub sampler: Binding,
    /// The image's kind.
    pub shape: ImageShape,
    /// Coordinates: floats, already divided for projective access.
    pub coordinate: Vec<Reg>,
    /// Level of detail.
    pub lod: Lod,
    /// Texel offsets, signed integers, one for each coordinate without the layer; or empty.
    pub offset: Vec<Reg>,
    /// Reference value of a depth comparison.
    pub compare: Option<Reg>,
    /// The component to gather from the four texels that bilinear filtering would use. None to filter.
    pub gather: Option<u8>,
}

/// An access to one texel by integer coordinates, unfiltered (a fetch from a sampled image or a read of a storage
/// image).
#[derive(Clone, Debug, PartialEq)]
pub struct ImageRead {
    /// Red, green, blue, alpha; None for a component that is not used.
    pub dst: [Option<Reg>; 4],
    /// The image.
    pub image: Binding,
    /// The image's kind.
    pub shape: ImageShape,
    /// Coordinates: integers.
    pub coordinate: Vec<Reg>,
    /// Mip level, default 0.
    pub level: Option<Reg>,
    /// Sample index, default 0.
    pub sample: Option<Reg>,
}

/// A store of one texel.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageWrite {
    /// The image.
    pub image: Binding,
    /// The image's kind.
    pub shape: ImageShape,
    /// Coordinates: integers.
    pub coordinate: Vec<Reg>,
    /// Sample index, default 0.
    pub sample: Option<Reg>,
    /// Red, green, blue, alpha.
    pub texel: [Reg; 4],
}

/// An atomic operation on a texel of one 32-bit component.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageAtomic {
    /// The old value; None if it is not used.
    pub dst: Option<Reg>,
    /// The operation.
    pub op: AtomicOp,
    /// The image.
    pub image: Binding,
    /// The image's kind.
    pub shape: ImageShape,
    /// Coordinates: integers.
    pub coordinate: Vec<Reg>,
    /// Sample index, default 0.
    pub sample: Option<Reg>,
    /// The operand.
    pub value: Reg,
    /// The value that [`AtomicOp::CompareExchange`] compares with.
    pub comparator: Option<Reg>,
}

/// A query about an image.
#[derive(Clone, Debug, PartialEq)]
pub enum ImageQuery {
    /// Width, height, depth (as many as the dimension has), then layers, of a mip level (default 0).
    Size {
        /// The level.
        level: Option<Reg>,
    },
    /// Number of mip levels.
    Levels,
    /// Number of samples.
    Samples,
    /// The mip level that an implicit sample would use, clamped, and before clamping.
    Lod {
        /// The sampler.
        sampler: Binding,
        /// Coordinates: floats, without the layer.
        coordinate: Vec<Reg>,
    },
}
