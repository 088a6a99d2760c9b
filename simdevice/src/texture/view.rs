//! The bindings of image slots: plain data that correspond to descriptors.

use super::conversion::YcbcrConversion;
use crate::format::{Aspect, Format};
use crate::image::ImageView;
use devmem::BufferRange;
use std::sync::Arc;

/// The source of a component that a program reads.
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
    /// The component's value, given the components of a texel and the values of zero and one.
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

/// The sources of red, green, blue and alpha.
pub type Swizzle = [ComponentSwizzle; 4];

/// The swizzle that changes nothing.
pub const IDENTITY: Swizzle =
    [ComponentSwizzle::Red, ComponentSwizzle::Green, ComponentSwizzle::Blue, ComponentSwizzle::Alpha];

/// An image that is sampled or fetched from, or an input attachment. The instruction determines its kind
/// ([`isa::ir::ImageShape`]). A cube's faces are six consecutive layers.
#[derive(Clone, Debug)]
pub struct SampledImage {
    /// The view of its subresources.
    pub view: ImageView,
    /// The aspect that is read.
    pub aspect: Aspect,
    /// The swizzle of its components. If it has chroma, the swizzle comes before the conversion.
    pub swizzle: Swizzle,
    /// The chroma of the image and its conversion, if the view is of its luma.
    pub chroma: Option<Arc<Chroma>>,
}

/// The place of a component: its plane and its index in the plane's texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PlaneComponent {
    /// The number of the plane. The luma's is 0.
    pub plane: usize,
    /// The index: 0 to 3 for red to alpha.
    pub component: usize,
}

/// The planes that an image has beside that of its luma, and the conversion of all to a colour. A plane has one mip level.
/// It may have fewer texels than the luma; then each is for two texels of luma along each axis on which the extents differ.
#[derive(Clone, Debug)]
pub struct Chroma {
    /// The views of the planes from number 1 on.
    pub planes: Vec<ImageView>,
    /// The places of red, green and blue.
    pub components: [PlaneComponent; 3],
    /// The conversion.
    pub conversion: YcbcrConversion,
}

/// An image that is read, written and updated texel by texel. Only the first level of its view is accessible.
#[derive(Clone, Debug)]
pub struct StorageImage {
    /// The view of its subresources.
    pub view: ImageView,
}

/// A buffer of texels: uniform or storage.
#[derive(Clone, Debug)]
pub struct TexelBuffer {
    /// The memory of the texels. An incomplete texel at the end is not accessible.
    pub range: BufferRange,
    /// The format of the texels.
    pub format: Format,
}

/// The content of an image slot.
#[derive(Clone, Debug, Default)]
pub enum ImageBinding {
    /// Nothing is bound: zero is read.
    #[default]
    Unbound,
    /// A sampled image.
    Sampled(SampledImage),
    /// A storage image.
    Storage(StorageImage),
    /// A texel buffer.
    TexelBuffer(TexelBuffer),
}
