//! Blits: scaled and mirrored regions, nearest and linear filters, and conversions between formats.

use ash::vk;
use ash::vk::Format as F;
use gaurast_testkit::resource::aspect_format;
use gaurast_testkit::texels::Noise;
use gaurast_testkit::{Gpu, Image, ImageOptions};

/// Pairs of a source's and a target's format.
const FORMATS: [(F, F); 13] = [
    (F::R8G8B8A8_UNORM, F::R8G8B8A8_UNORM),
    (F::R8G8B8A8_SRGB, F::R8G8B8A8_SRGB),
    (F::R8G8B8A8_UNORM, F::R8G8B8A8_SRGB),
    (F::R8G8B8A8_SRGB, F::R32G32B32A32_SFLOAT),
    (F::R8G8B8A8_SNORM, F::R16G16B16A16_SFLOAT),
    (F::R16G16B16A16_UNORM, F::A2B10G10R10_UNORM_PACK32),
    (F::R16G16B16A16_SFLOAT, F::R8G8B8A8_UNORM),
    (F::R16G16B16A16_SFLOAT, F::B10G11R11_UFLOAT_PACK32),
    (F::B10G11R11_UFLOAT_PACK32, F::R32G32B32A32_SFLOAT),
    (F::R32G32B32A32_SFLOAT, F::R16G16B16A16_SFLOAT),
    (F::R32G32B32A32_SFLOAT, F::R5G6B5_UNORM_PACK16),
    (F::R32G32B32A32_SFLOAT, F::R16G16B16A16_SNORM),
    (F::A2B10G10R10_UNORM_PACK32, F::B8G8R8A8_SRGB),
];

/// A blit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Blit {
    from: F,
    to: F,
    filter: vk::Filter,
}

impl Blit {
    /// All blits.
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        let filters = [vk::Filter::NEAREST, vk::Filter::LINEAR];
        FORMATS.into_iter().flat_map(move |(from, to)| filters.map(|filter| Self { from, to, filter }))
    }

    /// Its name.
    pub(crate) fn name(self) -> String {
        let Self { from, to, filter } = self;
        format!("blit_{from:?}_{to:?}_{filter:?}").to_lowercase()
    }
}

/// The corners of a region.
fn corners(x: [i32; 2], y: [i32; 2]) -> [vk::Offset3D; 2] {
    [0, 1].map(|at| vk::Offset3D { x: x[at], y: y[at], z: at as i32 })
}

/// The target's texels.
pub(crate) fn texels(gpu: &Gpu, blit: Blit) -> Vec<u8> {
    let (color, general) = (vk::ImageAspectFlags::COLOR, vk::ImageLayout::GENERAL);
    let layers = vk::ImageSubresourceLayers::default().aspect_mask(color).layer_count(1);
    let region = |from: [vk::Offset3D; 2], to: [vk::Offset3D; 2]| vk::ImageBlit {
        src_subresource: layers,
        src_offsets: from,
        dst_subresource: layers,
        dst_offsets: to,
    };
    // Larger, smaller and mirrored.
    let regions = [
        region(corners([0, 13], [0, 11]), corners([0, 17], [0, 19])),
        region(corners([0, 13], [0, 11]), corners([17, 24], [0, 6])),
        region(corners([2, 9], [1, 10]), corners([29, 17], [19, 7])),
    ];
    let [from, to] = [(blit.from, [13, 11]), (blit.to, [29, 19])].map(|(format, size)| {
        let image = Image::new(gpu, &ImageOptions::new(format, size, vk::ImageUsageFlags::empty()));
        image.upload(color, &Noise::new(5).texels(aspect_format(format, color), image.options.texels()));
        image
    });
    gpu.run(|commands| {
        let (device, commands) = commands.raw();
        // SAFETY: see the testkit.
        unsafe { device.cmd_blit_image(commands, from.raw, general, to.raw, general, &regions, blit.filter) };
    });
    to.download(color)
}
