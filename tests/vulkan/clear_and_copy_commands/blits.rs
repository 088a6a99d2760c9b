//! `vkCmdBlitImage`, compared with lavapipe's.
//!
//! Vulkan leaves two things to an implementation (Vulkan 1.3, "Image Copies With Scaling"). One is the precision of
//! coordinates and weights, and with it the choice of the nearest texel if a centre is on an edge between texels. The
//! other is if filters read texels outside the source's region. Regions here avoid the first; both implementations read
//! outside the region.

use ash::vk;
use gaurast_runner::{Case, Missing, Need, Variant, ignore, shards};
use gaurast_testkit::exact_lavapipe::{aspect_flags, exactly, expect_lacking, formats};
use gaurast_testkit::resource::aspect_format;
use gaurast_testkit::texels::{Noise, distance};
use gaurast_testkit::{Gpu, Image, ImageOptions, device_format};
use simdevice::Format;
use simdevice::format::{Aspect, Numeric};

const GENERAL: vk::ImageLayout = vk::ImageLayout::GENERAL;

/// Options of a 2D image that is only copied and blitted.
fn flat(format: vk::Format, width: u32, height: u32) -> ImageOptions {
    ImageOptions::new(format, [width, height], vk::ImageUsageFlags::empty())
}

/// A blit between two images.
#[derive(Clone, Debug)]
struct Blit {
    from: ImageOptions,
    to: ImageOptions,
    filter: vk::Filter,
    regions: Vec<vk::ImageBlit>,
    aspects: Vec<Aspect>,
}

fn layers(aspect: Aspect, level: u32, layer_count: u32) -> vk::ImageSubresourceLayers {
    vk::ImageSubresourceLayers { aspect_mask: aspect_flags(aspect), mip_level: level, base_array_layer: 0, layer_count }
}

fn corners([x0, y0, z0]: [i32; 3], [x1, y1, z1]: [i32; 3]) -> [vk::Offset3D; 2] {
    [(x0, y0, z0), (x1, y1, z1)].map(|(x, y, z)| vk::Offset3D { x, y, z })
}

fn region(aspect: Aspect, from: [[i32; 3]; 2], to: [[i32; 3]; 2]) -> vk::ImageBlit {
    vk::ImageBlit {
        src_subresource: layers(aspect, 0, 1),
        src_offsets: corners(from[0], from[1]),
        dst_subresource: layers(aspect, 0, 1),
        dst_offsets: corners(to[0], to[1]),
    }
}

/// Blits, and returns the target's texels, aspect by aspect.
fn blitted(gpu: &Gpu, blit: &Blit) -> Vec<Vec<u8>> {
    let images = [blit.from, blit.to].map(|options| Image::new(gpu, &options));
    for (seed, image) in (1..).zip(&images) {
        for &aspect in &blit.aspects {
            let aspect = aspect_flags(aspect);
            let plane = aspect_format(image.options.format, aspect);
            let texels = Noise::new(seed).texels(plane, image.options.texels());
            image.upload(aspect, &texels);
        }
    }
    let [from, to] = images;
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        // SAFETY: see the crate.
        unsafe {
            device.cmd_blit_image(commands, from.raw, GENERAL, to.raw, GENERAL, &blit.regions, blit.filter);
        }
    });
    let contents = blit.aspects.iter();
    contents.map(|&aspect| to.download(aspect_flags(aspect))).collect()
}

/// The largest distance between the two devices' targets, in codes of an aspect's format.
fn compare(ours: &Gpu, theirs: &Gpu, blit: &Blit, unit: f64) -> f64 {
    let (a, b) = (blitted(ours, blit), blitted(theirs, blit));
    let mut largest = 0.0f64;
    for ((a, b), &aspect) in a.iter().zip(&b).zip(&blit.aspects) {
        let plane = aspect_format(blit.to.format, aspect_flags(aspect));
        let texels = |bytes: &[u8]| -> Vec<Vec<u8>> {
            let texels = bytes.chunks_exact(plane.texel_size());
            texels.map(<[u8]>::to_vec).collect()
        };
        for (a, b) in texels(a).iter().zip(&texels(b)) {
            largest = largest.max(distance(plane, a, b, unit));
        }
    }
    largest
}

/// Collects differences that are too large, and fails if there are any.
#[derive(Default)]
struct Findings(Vec<String>);

impl Findings {
    fn check(&mut self, ours: &Gpu, theirs: &Gpu, blit: &Blit, unit: f64) {
        let found = compare(ours, theirs, blit, unit);
        if found > 1.0 {
            self.0.push(format!(
                "{:?} {:?} to {:?} {:?}, {:?}: {found} apart, {:?}",
                blit.from.format, blit.from.size, blit.to.format, blit.to.size, blit.filter, blit.regions
            ));
        }
    }

    fn done(self) {
        assert!(self.0.is_empty(), "{}", self.0.join("\n"));
    }
}

const FILTERS: [vk::Filter; 2] = [vk::Filter::NEAREST, vk::Filter::LINEAR];

#[gaurast_runner::test(needs = [Need::Lavapipe])]
fn regions_are_scaled_and_mirrored(case: &Case) {
    exactly(case, |ours, theirs| {
        let format = vk::Format::R8G8B8A8_UNORM;
        // The source and target ranges along an axis, of 13 and 17 texels. An odd number of texels has no centre on an
        // edge between them.
        let spans: [([i32; 2], [i32; 2]); 7] = [
            ([0, 13], [0, 13]),
            ([0, 13], [0, 17]),
            ([2, 9], [3, 17]),
            ([1, 12], [4, 8]),
            ([0, 13], [17, 0]),
            ([11, 2], [2, 16]),
            ([12, 1], [15, 1]),
        ];
        let mut findings = Findings::default();
        for filter in FILTERS {
            for (index, (x_from, x_to)) in spans.into_iter().enumerate() {
                let (y_from, y_to) = spans[(index * 3 + 1) % spans.len()];
                let (z_from, z_to) = spans[(index * 5 + 2) % spans.len()];
                let ends = |x: [i32; 2], y: [i32; 2], z: [i32; 2]| [0, 1].map(|i| [x[i], y[i], z[i]]);
                for (view, used) in
                    [(vk::ImageViewType::TYPE_1D, 1), (vk::ImageViewType::TYPE_2D, 2), (vk::ImageViewType::TYPE_3D, 3)]
                {
                    let shape = |size: u32| ImageOptions {
                        view,
                        size: [0, 1, 2].map(|axis| if axis < used { size } else { 1 }),
                        ..flat(format, size, size)
                    };
                    let within = |axis: usize, span: [i32; 2]| if axis < used { span } else { [0, 1] };
                    let blit = Blit {
                        from: shape(13),
                        to: shape(17),
                        filter,
                        regions: vec![region(
                            Aspect::Color,
                            ends(x_from, within(1, y_from), within(2, z_from)),
                            ends(x_to, within(1, y_to), within(2, z_to)),
                        )],
                        aspects: vec![Aspect::Color],
                    };
                    findings.check(ours, theirs, &blit, 1.0);
                }
            }
        }
        findings.done();
    });
}

#[gaurast_runner::test(needs = [Need::Lavapipe])]
fn mip_chains_are_made_of_layers(case: &Case) {
    exactly(case, |ours, theirs| {
        let mut findings = Findings::default();
        for format in [vk::Format::R8G8B8A8_SRGB, vk::Format::B8G8R8A8_UNORM] {
            let shape = ImageOptions { levels: 4, layers: 3, ..flat(format, 24, 20) };
            // Halving an even number puts the centres on edges, where the nearest texel is not defined.
            let filter = vk::Filter::LINEAR;
            for level in 1..4 {
                let extent = |level: u32| {
                    let [width, height, _] = shape.level_size(level);
                    [width as i32, height as i32, 1]
                };
                let blit = Blit {
                    from: shape,
                    to: shape,
                    filter,
                    regions: vec![vk::ImageBlit {
                        src_subresource: layers(Aspect::Color, level - 1, 3),
                        src_offsets: corners([0; 3], extent(level - 1)),
                        dst_subresource: layers(Aspect::Color, level, 3),
                        dst_offsets: corners([0; 3], extent(level)),
                    }],
                    aspects: vec![Aspect::Color],
                };
                findings.check(ours, theirs, &blit, 1.0);
            }
        }
        findings.done();
    });
}

/// The class of a format; only formats of one class can be converted to each other.
fn class(format: Format) -> u32 {
    match format.numeric() {
        Numeric::Uint => 0,
        Numeric::Sint => 1,
        _ => 2,
    }
}

/// The formats that lavapipe is known not to support as sources (Mesa 22.3).
const NO_SOURCES: &[vk::Format] = &[
    vk::Format::R4G4_UNORM_PACK8,
    vk::Format::R4G4B4A4_UNORM_PACK16,
    vk::Format::B5G6R5_UNORM_PACK16,
    vk::Format::R8_SRGB,
    vk::Format::R8G8_SRGB,
    vk::Format::R8G8B8_UNORM,
    vk::Format::R8G8B8_SNORM,
    vk::Format::R8G8B8_UINT,
    vk::Format::R8G8B8_SINT,
    vk::Format::R8G8B8_SRGB,
    vk::Format::B8G8R8_UNORM,
    vk::Format::B8G8R8_SNORM,
    vk::Format::B8G8R8_UINT,
    vk::Format::B8G8R8_SINT,
    vk::Format::B8G8R8_SRGB,
    vk::Format::A2R10G10B10_UNORM_PACK32,
    vk::Format::A2R10G10B10_SNORM_PACK32,
    vk::Format::A2R10G10B10_SINT_PACK32,
    vk::Format::A2B10G10R10_SNORM_PACK32,
    vk::Format::A2B10G10R10_SINT_PACK32,
    vk::Format::R16G16B16_UNORM,
    vk::Format::R16G16B16_SNORM,
    vk::Format::R16G16B16_UINT,
    vk::Format::R16G16B16_SINT,
    vk::Format::R16G16B16_SFLOAT,
    vk::Format::R32G32B32_UINT,
    vk::Format::R32G32B32_SINT,
    vk::Format::R32G32B32_SFLOAT,
];

/// The formats that lavapipe is known to support as sources, but not as targets (Mesa 22.3).
const SOURCES_ONLY: &[vk::Format] = &[vk::Format::B10G11R11_UFLOAT_PACK32, vk::Format::E5B9G9R9_UFLOAT_PACK32];

#[gaurast_runner::test(needs = [Need::Lavapipe], each = shards(4))]
fn formats_are_converted(case: &Case) {
    exactly(case, |ours, theirs| {
        let last = vk::Format::E5B9G9R9_UFLOAT_PACK32;
        let [sources, targets] = [vk::FormatFeatureFlags::BLIT_SRC, vk::FormatFeatureFlags::BLIT_DST]
            .map(|feature| formats(ours, theirs, last, |gpu, format| gpu.format_features(format).contains(feature)));
        assert!(sources.of_both.len() > 50 && targets.of_both.len() > 30);
        let hubs = [
            vk::Format::R32G32B32A32_UINT,
            vk::Format::R32G32B32A32_SINT,
            vk::Format::R32G32B32A32_SFLOAT,
            vk::Format::R8G8B8A8_UINT,
            vk::Format::R8G8B8A8_SINT,
            vk::Format::R8G8B8A8_UNORM,
            vk::Format::R8G8B8A8_SRGB,
        ];
        let from_all = sources.of_both.iter().flat_map(|&from| hubs.map(|to| (from, to)));
        let to_all = targets.of_both.iter().flat_map(|&to| hubs.map(|from| (from, to)));
        let mut findings = Findings::default();
        for (index, (from, to)) in from_all.chain(to_all).enumerate() {
            if !case.shard().has(index) {
                continue;
            }
            let [from_class, to_class] = [from, to].map(|format| class(device_format(format)));
            if from_class != to_class {
                continue;
            }
            // lavapipe decodes sRGB by a polynomial with an error of 1e-3, which is sufficient for 8 bits. (This
            // driver's decoding is compared with the transfer function in the tests of formats.)
            let is_srgb = device_format(from).numeric() == Numeric::Srgb;
            if is_srgb && device_format(to).components()[0].bits > 8 {
                continue;
            }
            let filters: &[_] = if from_class == 2 { &FILTERS } else { &FILTERS[..1] };
            // A binary16's step at 2, the step of the shortest mantissa, or the error of weights from binary32
            // coordinates.
            let unit = match device_format(to) {
                Format::B10G11R11UfloatPack32 => 2.0 / 32.0,
                Format::E5B9G9R9UfloatPack32 => 2.0 / 256.0,
                format if format.components()[0].bits == 32 => 2e-5,
                _ => 2.0 / 1024.0,
            };
            for &filter in filters {
                let blit = Blit {
                    from: flat(from, 5, 3),
                    to: flat(to, 7, 9),
                    filter,
                    regions: vec![region(Aspect::Color, [[0; 3], [5, 3, 1]], [[0; 3], [7, 9, 1]])],
                    aspects: vec![Aspect::Color],
                };
                findings.check(ours, theirs, &blit, unit);
            }
        }
        findings.done();
        expect_lacking("sources of blits", &sources.of_ours_alone, NO_SOURCES);
        let no_targets = [NO_SOURCES, SOURCES_ONLY].concat();
        expect_lacking("targets of blits", &targets.of_ours_alone, &no_targets);
    });
}

const DEPTH_AND_STENCIL: [vk::Format; 6] = [
    vk::Format::D16_UNORM,
    vk::Format::X8_D24_UNORM_PACK32,
    vk::Format::D32_SFLOAT,
    vk::Format::S8_UINT,
    vk::Format::D24_UNORM_S8_UINT,
    vk::Format::D32_SFLOAT_S8_UINT,
];

/// A variant for each format of depth or stencil.
fn depth_and_stencil() -> Vec<Variant> {
    DEPTH_AND_STENCIL.map(|format| Variant::new(format!("{format:?}"))).into()
}

#[gaurast_runner::test(needs = [Need::Lavapipe], each = depth_and_stencil())]
fn depth_and_stencil_are_scaled(case: &Case) {
    let format = DEPTH_AND_STENCIL.into_iter().find(|format| format!("{format:?}") == case.variant()).unwrap();
    exactly(case, |ours, theirs| {
        let blits = vk::FormatFeatureFlags::BLIT_SRC | vk::FormatFeatureFlags::BLIT_DST;
        assert!(ours.format_features(format).contains(blits));
        if !theirs.format_features(format).contains(blits) {
            ignore(Missing::Capability, format!("lavapipe does not blit {format:?}"));
        }
        let aspects = device_format(format).aspects().to_vec();
        let mut both = region(Aspect::Color, [[0; 3], [9, 7, 1]], [[12, 0, 0], [0, 12, 1]]);
        let mask = aspects.iter().fold(vk::ImageAspectFlags::empty(), |all, &aspect| all | aspect_flags(aspect));
        both.src_subresource.aspect_mask = mask;
        both.dst_subresource.aspect_mask = mask;
        let blit = Blit {
            from: flat(format, 9, 7),
            to: flat(format, 12, 12),
            filter: vk::Filter::NEAREST,
            regions: vec![both],
            aspects,
        };
        let mut findings = Findings::default();
        findings.check(ours, theirs, &blit, 1e-9);
        findings.done();
    });
}
