//! Formats of vertex attributes, as the kernels read them.

use ash::vk;

/// A format as `shaders/attributes.glsl` has it: kind | components << 8. `None` for those that the kernels do not read.
pub(crate) fn code(format: vk::Format) -> Option<u32> {
    use vk::Format as F;
    let (kind, components) = match format {
        F::R32_SFLOAT => (0, 1),
        F::R32G32_SFLOAT => (0, 2),
        F::R32G32B32_SFLOAT => (0, 3),
        F::R32G32B32A32_SFLOAT => (0, 4),
        F::R16_SFLOAT => (1, 1),
        F::R16G16_SFLOAT => (1, 2),
        F::R16G16B16_SFLOAT => (1, 3),
        F::R16G16B16A16_SFLOAT => (1, 4),
        F::R8_UNORM => (2, 1),
        F::R8G8_UNORM => (2, 2),
        F::R8G8B8_UNORM => (2, 3),
        F::R8G8B8A8_UNORM | F::A8B8G8R8_UNORM_PACK32 => (2, 4),
        F::R8_SNORM => (3, 1),
        F::R8G8_SNORM => (3, 2),
        F::R8G8B8_SNORM => (3, 3),
        F::R8G8B8A8_SNORM | F::A8B8G8R8_SNORM_PACK32 => (3, 4),
        F::R16_UNORM => (4, 1),
        F::R16G16_UNORM => (4, 2),
        F::R16G16B16_UNORM => (4, 3),
        F::R16G16B16A16_UNORM => (4, 4),
        F::R16_SNORM => (5, 1),
        F::R16G16_SNORM => (5, 2),
        F::R16G16B16_SNORM => (5, 3),
        F::R16G16B16A16_SNORM => (5, 4),
        F::R8_USCALED => (6, 1),
        F::R8G8_USCALED => (6, 2),
        F::R8G8B8_USCALED => (6, 3),
        F::R8G8B8A8_USCALED | F::A8B8G8R8_USCALED_PACK32 => (6, 4),
        F::R8_SSCALED => (7, 1),
        F::R8G8_SSCALED => (7, 2),
        F::R8G8B8_SSCALED => (7, 3),
        F::R8G8B8A8_SSCALED | F::A8B8G8R8_SSCALED_PACK32 => (7, 4),
        F::R16_USCALED => (8, 1),
        F::R16G16_USCALED => (8, 2),
        F::R16G16B16_USCALED => (8, 3),
        F::R16G16B16A16_USCALED => (8, 4),
        F::R16_SSCALED => (9, 1),
        F::R16G16_SSCALED => (9, 2),
        F::R16G16B16_SSCALED => (9, 3),
        F::R16G16B16A16_SSCALED => (9, 4),
        F::B8G8R8A8_UNORM => (10, 4),
        F::A2B10G10R10_UNORM_PACK32 => (11, 4),
        F::A2B10G10R10_SNORM_PACK32 => (12, 4),
        F::A2R10G10B10_UNORM_PACK32 => (13, 4),
        F::A2R10G10B10_SNORM_PACK32 => (14, 4),
        F::A2B10G10R10_USCALED_PACK32 => (15, 4),
        F::A2B10G10R10_SSCALED_PACK32 => (16, 4),
        F::A2R10G10B10_USCALED_PACK32 => (17, 4),
        F::A2R10G10B10_SSCALED_PACK32 => (18, 4),
        F::B10G11R11_UFLOAT_PACK32 => (19, 3),
        F::R8_UINT => (20, 1),
        F::R8G8_UINT => (20, 2),
        F::R8G8B8_UINT => (20, 3),
        F::R8G8B8A8_UINT => (20, 4),
        F::R16_UINT => (21, 1),
        F::R16G16_UINT => (21, 2),
        F::R16G16B16_UINT => (21, 3),
        F::R16G16B16A16_UINT => (21, 4),
        F::R32_UINT => (22, 1),
        _ => return None,
    };
    Some(kind | components << 8)
}

/// Reports whether a format's code is that of integers, which attributes that are decoded have.
pub(crate) fn has_integers(code: u32) -> bool {
    code & 0xFF >= 20
}

/// Reports whether a format's code is that of 32-bit floats, with as many components as are wanted or more.
pub(crate) fn is_float32(code: u32, wanted: u32) -> bool {
    code & 0xFF == 0 && code >> 8 >= wanted
}
