use super::*;
use std::collections::HashSet;

#[test]
fn every_format_of_the_device_has_a_vulkan_name() {
    // The first block of core formats, the formats of few bits that were added later, and those beside formats with chroma.
    let later = [
        vk::Format::A4R4G4B4_UNORM_PACK16,
        vk::Format::A4B4G4R4_UNORM_PACK16,
        vk::Format::A1B5G5R5_UNORM_PACK16_KHR,
        vk::Format::A8_UNORM_KHR,
    ];
    let ycbcr = vk::Format::G8B8G8R8_422_UNORM.as_raw()..=vk::Format::G16_B16_R16_3PLANE_444_UNORM.as_raw();
    let found: HashSet<_> = (0..=vk::Format::ASTC_12X12_SRGB_BLOCK.as_raw())
        .map(vk::Format::from_raw)
        .chain(later)
        .chain(ycbcr.map(vk::Format::from_raw))
        .filter_map(device_format)
        .collect();
    assert_eq!(found, Format::ALL.iter().copied().collect());
    assert_eq!(device_format(vk::Format::A2B10G10R10_UNORM_PACK32), Some(Format::A2B10G10R10UnormPack32));
    assert_eq!(device_format(vk::Format::UNDEFINED), None);
    assert_eq!(device_format(vk::Format::from_raw(-1)), None);
    assert_eq!(device_format(vk::Format::EAC_R11G11_SNORM_BLOCK), Some(Format::EacR11G11SnormBlock));
    assert_eq!(device_format(vk::Format::ASTC_10X8_SRGB_BLOCK), Some(Format::Astc10x8SrgbBlock));
    assert_eq!(device_format(vk::Format::ASTC_4X4_SFLOAT_BLOCK), None);
}

#[test]
fn formats_can_do_what_they_are_for() {
    let float = properties(vk::Format::R32G32B32A32_SFLOAT);
    assert!(float.optimal_tiling_features.contains(vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND));
    assert!(float.buffer_features.contains(vk::FormatFeatureFlags::VERTEX_BUFFER));
    let depth = properties(vk::Format::D32_SFLOAT);
    assert!(depth.optimal_tiling_features.contains(vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT));
    assert!(depth.linear_tiling_features.is_empty());
    let vertex = properties(vk::Format::R32G32B32_SFLOAT);
    assert!(vertex.buffer_features.contains(vk::FormatFeatureFlags::VERTEX_BUFFER));
    assert!(vertex.optimal_tiling_features.contains(vk::FormatFeatureFlags::COLOR_ATTACHMENT));
    assert!(!vertex.optimal_tiling_features.contains(vk::FormatFeatureFlags::STORAGE_IMAGE));
}

#[test]
fn images_that_cannot_be_are_refused() {
    let query = ImageQuery {
        format: vk::Format::R8G8B8A8_UNORM,
        ty: vk::ImageType::TYPE_2D,
        tiling: vk::ImageTiling::OPTIMAL,
        usage: vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC,
        flags: vk::ImageCreateFlags::empty(),
    };
    let properties = image_properties(query).unwrap();
    assert_eq!(properties.max_extent.width, 16384);
    assert_eq!(properties.max_mip_levels, 15);
    let refused = [
        ImageQuery { format: vk::Format::UNDEFINED, ..query },
        ImageQuery { usage: vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT, ..query },
        ImageQuery { format: vk::Format::R8G8B8A8_SRGB, usage: vk::ImageUsageFlags::STORAGE, ..query },
        ImageQuery { format: vk::Format::BC1_RGB_UNORM_BLOCK, ..query },
        ImageQuery {
            format: vk::Format::BC1_RGB_UNORM_BLOCK,
            ty: vk::ImageType::TYPE_1D,
            usage: vk::ImageUsageFlags::SAMPLED,
            ..query
        },
        ImageQuery { flags: vk::ImageCreateFlags::SPARSE_BINDING, ..query },
        ImageQuery { flags: vk::ImageCreateFlags::BLOCK_TEXEL_VIEW_COMPATIBLE, ..query },
        ImageQuery { format: vk::Format::D32_SFLOAT, tiling: vk::ImageTiling::LINEAR, ..query },
        ImageQuery { format: vk::Format::R8G8B8_UNORM, ..query },
    ];
    for query in refused {
        let error = image_properties(query).unwrap_err();
        assert_eq!(error.result(), vk::Result::ERROR_FORMAT_NOT_SUPPORTED, "{query:?}");
    }
}

#[test]
fn blocks_may_be_viewed_as_texels_of_their_size() {
    let query = ImageQuery {
        format: vk::Format::ASTC_8X5_UNORM_BLOCK,
        ty: vk::ImageType::TYPE_2D,
        tiling: vk::ImageTiling::OPTIMAL,
        usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::STORAGE,
        flags: VIEWED_FORMATS,
    };
    assert!(image_properties(query).is_err());
    let flags = query.flags | vk::ImageCreateFlags::BLOCK_TEXEL_VIEW_COMPATIBLE;
    let found = image_properties(ImageQuery { flags, ..query }).unwrap();
    assert_eq!(found.sample_counts, vk::SampleCountFlags::TYPE_1);
}

#[test]
fn attachments_of_two_dimensions_may_have_four_samples() {
    let query = ImageQuery {
        format: vk::Format::R8G8B8A8_UNORM,
        ty: vk::ImageType::TYPE_2D,
        tiling: vk::ImageTiling::OPTIMAL,
        usage: vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::SAMPLED,
        flags: vk::ImageCreateFlags::empty(),
    };
    let counts = |query| image_properties(query).unwrap().sample_counts;
    let (one, four) = (vk::SampleCountFlags::TYPE_1, vk::SampleCountFlags::TYPE_4);
    assert_eq!(counts(query), one | four);
    let stored = ImageQuery { usage: vk::ImageUsageFlags::STORAGE | vk::ImageUsageFlags::SAMPLED, ..query };
    assert_eq!(counts(stored), vk::SampleCountFlags::from_raw(0x7f), "what is no attachment has any number");
    let read =
        ImageQuery { usage: vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT, format: vk::Format::D32_SFLOAT, ..query };
    assert_eq!(counts(ImageQuery { usage: vk::ImageUsageFlags::SAMPLED, ..read }), one | four);
    let depth = ImageQuery {
        format: vk::Format::D24_UNORM_S8_UINT,
        usage: vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
        ..query
    };
    assert_eq!(counts(depth), one | four);
    let single = [
        ImageQuery { ty: vk::ImageType::TYPE_3D, ..query },
        ImageQuery { tiling: vk::ImageTiling::LINEAR, ..query },
        ImageQuery { flags: vk::ImageCreateFlags::CUBE_COMPATIBLE, ..query },
        ImageQuery { format: vk::Format::BC7_UNORM_BLOCK, usage: vk::ImageUsageFlags::SAMPLED, ..query },
        ImageQuery { format: vk::Format::E5B9G9R9_UFLOAT_PACK32, usage: vk::ImageUsageFlags::SAMPLED, ..query },
    ];
    for query in single {
        assert_eq!(counts(query), one, "{query:?}");
    }
}
