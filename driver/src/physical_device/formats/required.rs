//! Tests of the tables "Required Format Support" of Vulkan 1.0, and of the choices that they leave.

use super::properties;
use ash::vk::{Format as F, FormatFeatureFlags as Feature};

/// The features that letters mean in the image column.
const IMAGE: &[(char, Feature)] = &[
    ('s', Feature::SAMPLED_IMAGE),
    ('b', Feature::BLIT_SRC),
    ('l', Feature::SAMPLED_IMAGE_FILTER_LINEAR),
    ('w', Feature::STORAGE_IMAGE),
    ('a', Feature::STORAGE_IMAGE_ATOMIC),
    ('c', Feature::COLOR_ATTACHMENT),
    ('d', Feature::BLIT_DST),
    ('m', Feature::COLOR_ATTACHMENT_BLEND),
    ('z', Feature::DEPTH_STENCIL_ATTACHMENT),
];

/// The features that letters mean in the buffer column.
const BUFFER: &[(char, Feature)] = &[
    ('v', Feature::VERTEX_BUFFER),
    ('u', Feature::UNIFORM_TEXEL_BUFFER),
    ('s', Feature::STORAGE_TEXEL_BUFFER),
    ('a', Feature::STORAGE_TEXEL_BUFFER_ATOMIC),
];

/// Formats, with the required features of images of optimal tiling, and of buffers.
const REQUIRED: &[(F, &str, &str)] = &[
    (F::B4G4R4A4_UNORM_PACK16, "sbl", ""),
    (F::R5G6B5_UNORM_PACK16, "sblcdm", ""),
    (F::A1R5G5B5_UNORM_PACK16, "sblcdm", ""),
    (F::R8_UNORM, "sblcdm", "vu"),
    (F::R8_SNORM, "sbl", "vu"),
    (F::R8_UINT, "sbcd", "vu"),
    (F::R8_SINT, "sbcd", "vu"),
    (F::R8G8_UNORM, "sblcdm", "vu"),
    (F::R8G8_SNORM, "sbl", "vu"),
    (F::R8G8_UINT, "sbcd", "vu"),
    (F::R8G8_SINT, "sbcd", "vu"),
    (F::R8G8B8A8_UNORM, "sblwcdm", "vus"),
    (F::R8G8B8A8_SNORM, "sblw", "vus"),
    (F::R8G8B8A8_UINT, "sbwcd", "vus"),
    (F::R8G8B8A8_SINT, "sbwcd", "vus"),
    (F::R8G8B8A8_SRGB, "sblcdm", ""),
    (F::B8G8R8A8_UNORM, "sblcdm", "vu"),
    (F::B8G8R8A8_SRGB, "sblcdm", ""),
    (F::A8B8G8R8_UNORM_PACK32, "sblcdm", "vus"),
    (F::A8B8G8R8_SNORM_PACK32, "sbl", "vus"),
    (F::A8B8G8R8_UINT_PACK32, "sbcd", "vus"),
    (F::A8B8G8R8_SINT_PACK32, "sbcd", "vus"),
    (F::A8B8G8R8_SRGB_PACK32, "sblcdm", ""),
    (F::A2B10G10R10_UNORM_PACK32, "sblcdm", "vu"),
    (F::A2B10G10R10_UINT_PACK32, "sbcd", "u"),
    (F::R16_UINT, "sbcd", "vu"),
    (F::R16_SINT, "sbcd", "vu"),
    (F::R16_SFLOAT, "sblcdm", "vu"),
    (F::R16G16_UINT, "sbcd", "vu"),
    (F::R16G16_SINT, "sbcd", "vu"),
    (F::R16G16_SFLOAT, "sblcdm", "vu"),
    (F::R16G16B16A16_UINT, "sbwcd", "vus"),
    (F::R16G16B16A16_SINT, "sbwcd", "vus"),
    (F::R16G16B16A16_SFLOAT, "sblwcdm", "vus"),
    (F::R32_UINT, "sbwacd", "vusa"),
    (F::R32_SINT, "sbwacd", "vusa"),
    (F::R32_SFLOAT, "sbwcd", "vus"),
    (F::R32G32_UINT, "sbwcd", "vus"),
    (F::R32G32_SINT, "sbwcd", "vus"),
    (F::R32G32_SFLOAT, "sbwcd", "vus"),
    (F::R32G32B32A32_UINT, "sbwcd", "vus"),
    (F::R32G32B32A32_SINT, "sbwcd", "vus"),
    (F::R32G32B32A32_SFLOAT, "sbwcd", "vus"),
    (F::B10G11R11_UFLOAT_PACK32, "sbl", "u"),
    (F::E5B9G9R9_UFLOAT_PACK32, "sbl", ""),
    (F::D16_UNORM, "sbz", ""),
    (F::D32_SFLOAT, "sb", ""),
    (F::R16_UNORM, "", "v"),
    (F::R16_SNORM, "", "v"),
    (F::R16G16_UNORM, "", "v"),
    (F::R16G16_SNORM, "", "v"),
    (F::R16G16B16A16_UNORM, "", "v"),
    (F::R16G16B16A16_SNORM, "", "v"),
    (F::R32G32B32_UINT, "", "v"),
    (F::R32G32B32_SINT, "", "v"),
    (F::R32G32B32_SFLOAT, "", "v"),
];

fn features(letters: &str, meanings: &[(char, Feature)]) -> Feature {
    letters.chars().fold(Feature::empty(), |all, letter| {
        let found = meanings.iter().find(|(known, _)| *known == letter);
        all | found.expect("a letter of the table").1
    })
}

#[test]
fn every_format_can_do_what_vulkan_requires() {
    for &(format, image, buffer) in REQUIRED {
        let found = properties(format);
        let transfer = Feature::TRANSFER_SRC | Feature::TRANSFER_DST;
        let mut required = features(image, IMAGE);
        if !required.is_empty() {
            // Since Vulkan 1.1 these features are explicit; 1.0 implied them for any image.
            required |= transfer;
        }
        let lacking = required & !found.optimal_tiling_features;
        assert!(lacking.is_empty(), "{format:?} lacks {lacking:?}");
        let lacking = features(buffer, BUFFER) & !found.buffer_features;
        assert!(lacking.is_empty(), "buffers of {format:?} lack {lacking:?}");
    }
}

/// Tests the families of compressed formats, BC, ETC2 with EAC, and ASTC; Vulkan requires one of them.
#[test]
fn blocks_are_sampled_filtered_and_blitted() {
    let required = features("sbl", IMAGE) | Feature::TRANSFER_SRC | Feature::TRANSFER_DST;
    let blocks = F::BC1_RGB_UNORM_BLOCK.as_raw()..=F::ASTC_12X12_SRGB_BLOCK.as_raw();
    assert_eq!(blocks.clone().count(), 16 + 10 + 28);
    for format in blocks.map(F::from_raw) {
        let lacking = required & !properties(format).optimal_tiling_features;
        assert!(lacking.is_empty(), "{format:?} lacks {lacking:?}");
    }
}

#[test]
fn depth_formats_leave_a_choice() {
    let renders = |format: &F| {
        let features = properties(*format).optimal_tiling_features;
        features.contains(Feature::DEPTH_STENCIL_ATTACHMENT)
    };
    assert!([F::X8_D24_UNORM_PACK32, F::D32_SFLOAT].iter().any(renders));
    let both = [F::D24_UNORM_S8_UINT, F::D32_SFLOAT_S8_UINT];
    assert!(both.iter().any(renders));
}
