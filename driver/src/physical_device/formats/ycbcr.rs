//! The formats whose luma and chroma are apart, and which shaders read by a conversion. The device knows none of them: it
//! has an image for each plane. "Compatible Formats of Planes of Multi-Planar Formats" of Vulkan gives the planes' formats.

use ash::vk::{self, Format as F};
use simdevice::Format;
use simdevice::texture::PlaneComponent;
use std::sync::LazyLock;

/// A format whose luma and chroma are apart.
#[derive(Debug)]
pub(crate) struct YcbcrFormat {
    /// Its name.
    pub(crate) format: vk::Format,
    /// The planes in memory, from that with the luma on.
    pub(crate) planes: Vec<YcbcrPlane>,
    /// The format of the only plane's texels if both chroma components are to be read from it, with half of its columns.
    pub(crate) packed_chroma: Option<Format>,
    /// The places of red, green and blue, which hold Cr, luma and Cb. A packed chroma counts as plane 1.
    pub(crate) components: [PlaneComponent; 3],
    /// The bits of a component.
    pub(crate) bits: u32,
}

/// A plane of a format.
#[derive(Clone, Copy, Debug)]
pub(crate) struct YcbcrPlane {
    /// The format of its texels.
    pub(crate) format: Format,
    /// The texels of luma for each of its own along x and y: 1 or 2.
    pub(crate) divisors: [u32; 2],
}

/// The arrangement of luma and chroma.
#[derive(Clone, Copy)]
enum Arrangement {
    /// One plane in which texels are for two columns: luma, Cb, luma, Cr.
    LumaFirst,
    /// The same in the order Cb, luma, Cr, luma.
    ChromaFirst,
    /// A plane of luma, and one of Cb and Cr with these divisors.
    Two([u32; 2]),
    /// A plane of luma, one of Cb and one of Cr with these divisors.
    Three([u32; 2]),
}

/// The divisors of formats with the suffixes `_420`, `_422` and `_444`.
const HALF: [u32; 2] = [2, 2];
const HALF_WIDTH: [u32; 2] = [2, 1];
const WHOLE: [u32; 2] = [1, 1];

/// The formats, with the bits of a component.
const FORMATS: &[(F, u32, Arrangement)] = {
    use Arrangement::{ChromaFirst, LumaFirst, Three, Two};
    &[
        (F::G8B8G8R8_422_UNORM, 8, LumaFirst),
        (F::B8G8R8G8_422_UNORM, 8, ChromaFirst),
        (F::G8_B8_R8_3PLANE_420_UNORM, 8, Three(HALF)),
        (F::G8_B8R8_2PLANE_420_UNORM, 8, Two(HALF)),
        (F::G8_B8_R8_3PLANE_422_UNORM, 8, Three(HALF_WIDTH)),
        (F::G8_B8R8_2PLANE_422_UNORM, 8, Two(HALF_WIDTH)),
        (F::G8_B8_R8_3PLANE_444_UNORM, 8, Three(WHOLE)),
        (F::G8_B8R8_2PLANE_444_UNORM, 8, Two(WHOLE)),
        (F::G10X6B10X6G10X6R10X6_422_UNORM_4PACK16, 10, LumaFirst),
        (F::B10X6G10X6R10X6G10X6_422_UNORM_4PACK16, 10, ChromaFirst),
        (F::G10X6_B10X6_R10X6_3PLANE_420_UNORM_3PACK16, 10, Three(HALF)),
        (F::G10X6_B10X6R10X6_2PLANE_420_UNORM_3PACK16, 10, Two(HALF)),
        (F::G10X6_B10X6_R10X6_3PLANE_422_UNORM_3PACK16, 10, Three(HALF_WIDTH)),
        (F::G10X6_B10X6R10X6_2PLANE_422_UNORM_3PACK16, 10, Two(HALF_WIDTH)),
        (F::G10X6_B10X6_R10X6_3PLANE_444_UNORM_3PACK16, 10, Three(WHOLE)),
        (F::G10X6_B10X6R10X6_2PLANE_444_UNORM_3PACK16, 10, Two(WHOLE)),
        (F::G12X4B12X4G12X4R12X4_422_UNORM_4PACK16, 12, LumaFirst),
        (F::B12X4G12X4R12X4G12X4_422_UNORM_4PACK16, 12, ChromaFirst),
        (F::G12X4_B12X4_R12X4_3PLANE_420_UNORM_3PACK16, 12, Three(HALF)),
        (F::G12X4_B12X4R12X4_2PLANE_420_UNORM_3PACK16, 12, Two(HALF)),
        (F::G12X4_B12X4_R12X4_3PLANE_422_UNORM_3PACK16, 12, Three(HALF_WIDTH)),
        (F::G12X4_B12X4R12X4_2PLANE_422_UNORM_3PACK16, 12, Two(HALF_WIDTH)),
        (F::G12X4_B12X4_R12X4_3PLANE_444_UNORM_3PACK16, 12, Three(WHOLE)),
        (F::G12X4_B12X4R12X4_2PLANE_444_UNORM_3PACK16, 12, Two(WHOLE)),
        (F::G16B16G16R16_422_UNORM, 16, LumaFirst),
        (F::B16G16R16G16_422_UNORM, 16, ChromaFirst),
        (F::G16_B16_R16_3PLANE_420_UNORM, 16, Three(HALF)),
        (F::G16_B16R16_2PLANE_420_UNORM, 16, Two(HALF)),
        (F::G16_B16_R16_3PLANE_422_UNORM, 16, Three(HALF_WIDTH)),
        (F::G16_B16R16_2PLANE_422_UNORM, 16, Two(HALF_WIDTH)),
        (F::G16_B16_R16_3PLANE_444_UNORM, 16, Three(WHOLE)),
        (F::G16_B16R16_2PLANE_444_UNORM, 16, Two(WHOLE)),
    ]
};

/// The formats of texels of one, two and four components.
fn texel_formats(bits: u32) -> [Format; 3] {
    match bits {
        8 => [Format::R8Unorm, Format::R8G8Unorm, Format::R8G8B8A8Unorm],
        10 => [Format::R10X6UnormPack16, Format::R10X6G10X6Unorm2Pack16, Format::R10X6G10X6B10X6A10X6Unorm4Pack16],
        12 => [Format::R12X4UnormPack16, Format::R12X4G12X4Unorm2Pack16, Format::R12X4G12X4B12X4A12X4Unorm4Pack16],
        _ => [Format::R16Unorm, Format::R16G16Unorm, Format::R16G16B16A16Unorm],
    }
}

impl YcbcrFormat {
    fn new(format: vk::Format, bits: u32, arrangement: Arrangement) -> Self {
        let [one, two, four] = texel_formats(bits);
        let plane = |format, divisors| YcbcrPlane { format, divisors };
        let (planes, places) = match arrangement {
            Arrangement::LumaFirst => (vec![plane(two, WHOLE)], [(1, 3), (0, 0), (1, 1)]),
            Arrangement::ChromaFirst => (vec![plane(two, WHOLE)], [(1, 2), (0, 1), (1, 0)]),
            Arrangement::Two(divisors) => (vec![plane(one, WHOLE), plane(two, divisors)], [(1, 1), (0, 0), (1, 0)]),
            Arrangement::Three(divisors) => {
                (vec![plane(one, WHOLE), plane(one, divisors), plane(one, divisors)], [(2, 0), (0, 0), (1, 0)])
            }
        };
        Self {
            format,
            packed_chroma: (planes.len() == 1).then_some(four),
            planes,
            components: places.map(|(plane, component)| PlaneComponent { plane, component }),
            bits,
        }
    }

    /// True if the format has several planes.
    pub(crate) fn is_multi_planar(&self) -> bool {
        self.planes.len() > 1
    }

    /// The number of which an image's width and height are multiples.
    pub(crate) fn granularity(&self) -> [u32; 2] {
        let of_packed = if self.packed_chroma.is_some() { HALF_WIDTH } else { WHOLE };
        self.planes.iter().fold(of_packed, |most, plane| [0, 1].map(|axis| most[axis].max(plane.divisors[axis])))
    }

    /// The features of images of the format, of either tiling.
    pub(crate) fn image_features(&self) -> vk::FormatFeatureFlags {
        let disjoint = match self.is_multi_planar() {
            true => vk::FormatFeatureFlags::DISJOINT,
            false => vk::FormatFeatureFlags::empty(),
        };
        vk::FormatFeatureFlags::TRANSFER_SRC
            | vk::FormatFeatureFlags::TRANSFER_DST
            | vk::FormatFeatureFlags::SAMPLED_IMAGE
            | vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR
            | vk::FormatFeatureFlags::SAMPLED_IMAGE_YCBCR_CONVERSION_LINEAR_FILTER
            | vk::FormatFeatureFlags::SAMPLED_IMAGE_YCBCR_CONVERSION_SEPARATE_RECONSTRUCTION_FILTER
            | vk::FormatFeatureFlags::COSITED_CHROMA_SAMPLES
            | vk::FormatFeatureFlags::MIDPOINT_CHROMA_SAMPLES
            | disjoint
    }
}

/// The description of a format whose luma and chroma are apart; `None` for others.
pub(crate) fn ycbcr_format(format: vk::Format) -> Option<&'static YcbcrFormat> {
    static TABLE: LazyLock<Vec<YcbcrFormat>> = LazyLock::new(|| {
        FORMATS.iter().map(|&(format, bits, arrangement)| YcbcrFormat::new(format, bits, arrangement)).collect()
    });
    TABLE.iter().find(|known| known.format == format)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The names say what the table does: bits, planes, and the texels of chroma.
    #[test]
    fn formats_are_as_their_names_say() {
        for &(format, bits, _) in FORMATS {
            let name = format!("{format:?}");
            let known = ycbcr_format(format).unwrap();
            assert!(name.contains(&format!("G{bits}")), "{name}");
            let planes = ["2PLANE", "3PLANE"].iter().position(|part| name.contains(part)).map_or(1, |at| at + 2);
            assert_eq!(known.planes.len(), planes, "{name}");
            let granularity = match () {
                () if name.contains("_420_") => [2, 2],
                () if name.contains("_422_") => [2, 1],
                () => [1, 1],
            };
            assert_eq!(known.granularity(), granularity, "{name}");
            assert_eq!(known.image_features().contains(vk::FormatFeatureFlags::DISJOINT), planes > 1, "{name}");
            assert_eq!(name.starts_with('B'), planes == 1 && known.components[1].component == 1, "{name}");
        }
        assert_eq!(FORMATS.len(), 32);
    }
}
