//! What an image bind point may hold: plain data, as a descriptor set has it.

use crate::format::{Aspect, Format};
use crate::image::ImageView;
use crate::packet::BufferRange;

/// Where a component that a program reads comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ComponentSwizzle {
    /// 0.
    Zero,
    /// 1, or 1.0 for float formats.
    One,
    /// The texel's red.
    Red,
    /// The texel's green.
    Green,
    /// The texel's blue.
    Blue,
    /// The texel's alpha.
    Alpha,
}

impl ComponentSwizzle {
    /// The component's value of a texel's registers.
    #[inline(always)]
    pub(super) fn pick<T: Copy>(self, texel: &[T; 4], zero: T, one: T) -> T {
        match self {
            Self::Zero => zero,
            Self::One => one,
            Self::Red => texel[0],
            Self::Green => texel[1],
            Self::Blue => texel[2],
            Self::Alpha => texel[3],
        }
    }
}

/// Where red, green, blue and alpha come from.
pub type Swizzle = [ComponentSwizzle; 4];

/// Components as they are.
pub const IDENTITY: Swizzle = [
    ComponentSwizzle::Red,
    ComponentSwizzle::Green,
    ComponentSwizzle::Blue,
    ComponentSwizzle::Alpha,
];

/// An image that is sampled or fetched from, or an input attachment. The instruction says of what kind it is
/// ([`isa::ir::ImageShape`]); a cube's faces are six consecutive layers.
#[derive(Clone, Debug)]
pub struct SampledImage {
    /// Its subresources.
    pub view: ImageView,
    /// Which of them are read.
    pub aspect: Aspect,
    /// How components are rearranged.
    pub swizzle: Swizzle,
}

/// An image that is read, written and updated texel by texel. Of a view with several levels only the first is reached.
#[derive(Clone, Debug)]
pub struct StorageImage {
    /// Its subresources.
    pub view: ImageView,
}

/// A buffer of texels: uniform or storage.
#[derive(Clone, Debug)]
pub struct TexelBuffer {
    /// Where the texels are; what is left over at the end is not reached.
    pub range: BufferRange,
    /// How they are stored.
    pub format: Format,
}

/// What an image bind point holds.
#[derive(Clone, Debug, Default)]
pub enum ImageBinding {
    /// Nothing: zero is read.
    #[default]
    Unbound,
    /// A sampled image.
    Sampled(SampledImage),
    /// A storage image.
    Storage(StorageImage),
    /// A texel buffer.
    TexelBuffer(TexelBuffer),
}
