//! Texture sampling, compared with lavapipe's, both as accurate as possible. Results may differ by 1/255.
//!
//! Requests avoid the cases that Vulkan leaves to an implementation: nearest texels near edges between texels, nearest
//! levels near the change of level, and levels of detail at which minification and magnification change.

use ash::vk;
use gaurast_runner::{Case, Need, shards};
use gaurast_testkit::exact_lavapipe::{aspect_flags, exactly, expect_lacking, formats};
use gaurast_testkit::resource::aspect_format;
use gaurast_testkit::shader::words;
use gaurast_testkit::texels::Noise;
use gaurast_testkit::{Bindings, Buffer, Gpu, Image, ImageOptions, Kernel, Resource, Sampler, device_format};
use simdevice::format::Aspect;
use std::cell::OnceCell;

/// The kinds of images, in the order of the shader's bindings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    One,
    Two,
    Three,
    Cube,
    Ones,
    Twos,
    Cubes,
    Shadow,
    Shadows,
    CubeShadow,
}

const KINDS: [Kind; 10] = [
    Kind::One,
    Kind::Two,
    Kind::Three,
    Kind::Cube,
    Kind::Ones,
    Kind::Twos,
    Kind::Cubes,
    Kind::Shadow,
    Kind::Shadows,
    Kind::CubeShadow,
];

/// The sampling function of a shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    Lod,
    Gradient,
    Gather,
}

const WAYS: [Way; 3] = [Way::Lod, Way::Gradient, Way::Gather];

const LAYERS: u32 = 3;
const LEVELS: u32 = 4;
const REQUESTS: usize = 256;

impl Kind {
    fn compares(self) -> bool {
        matches!(self, Self::Shadow | Self::Shadows | Self::CubeShadow)
    }

    fn is_cube(self) -> bool {
        matches!(self, Self::Cube | Self::Cubes | Self::CubeShadow)
    }

    fn axes(self) -> usize {
        match self {
            Self::One | Self::Ones => 1,
            Self::Three => 3,
            _ => 2,
        }
    }

    fn view_type(self) -> vk::ImageViewType {
        match self {
            Self::One => vk::ImageViewType::TYPE_1D,
            Self::Two | Self::Shadow => vk::ImageViewType::TYPE_2D,
            Self::Three => vk::ImageViewType::TYPE_3D,
            Self::Cube | Self::CubeShadow => vk::ImageViewType::CUBE,
            Self::Ones => vk::ImageViewType::TYPE_1D_ARRAY,
            Self::Twos | Self::Shadows => vk::ImageViewType::TYPE_2D_ARRAY,
            Self::Cubes => vk::ImageViewType::CUBE_ARRAY,
        }
    }

    fn has_way(self, way: Way) -> bool {
        match way {
            Way::Lod => !matches!(self, Self::Shadows | Self::CubeShadow),
            Way::Gradient => true,
            Way::Gather => !matches!(self, Self::One | Self::Three | Self::Ones),
        }
    }

    /// The options of the image. Its sides are powers of two, so that edges between texels of small levels are also
    /// edges of large ones.
    fn shape(self, format: vk::Format) -> ImageOptions {
        let size = match self {
            Self::One | Self::Ones => [32, 1, 1],
            Self::Three => [16, 8, 8],
            Self::Cube | Self::Cubes | Self::CubeShadow => [16, 16, 1],
            _ => [32, 16, 1],
        };
        ImageOptions {
            size,
            levels: LEVELS,
            layers: match self {
                Self::Cube | Self::CubeShadow => 6,
                Self::Cubes => 12,
                Self::Ones | Self::Twos | Self::Shadows => LAYERS,
                _ => 1,
            },
            view: self.view_type(),
            ..ImageOptions::new(format, [1, 1], vk::ImageUsageFlags::SAMPLED)
        }
    }
}

/// An invocation's request; its layout is in the shader.
type Request = [[f32; 4]; 3];

/// A coordinate well inside some texel of an axis, or inside one of its repetitions.
fn inside_a_texel(noise: &mut Noise, size: u32) -> f32 {
    let texel = (noise.bits() % (5 * size)) as f32 - 2.0 * size as f32;
    (texel + 0.1 + 0.8 * noise.unit()) / size as f32
}

/// A level of detail well away from changes of level or filter.
fn level_of_detail(noise: &mut Noise) -> f32 {
    let whole = (noise.bits() % (LEVELS + 2)) as f32 - 2.0;
    let half = 0.5 * (noise.bits() % 2) as f32;
    whole + half + 0.1 + 0.3 * noise.unit()
}

fn request(kind: Kind, noise: &mut Noise) -> Request {
    let extent = kind.shape(vk::Format::R8_UNORM).size;
    let lod = level_of_detail(noise);
    let mut at = [0.0; 4];
    let (mut dx, mut dy) = ([0.0; 4], [0.0; 4]);
    // lavapipe's logarithm is linear between powers of two. (Vulkan 1.3, "LOD Operation", requires no more.)
    let rho = lod.floor().exp2();
    if kind.is_cube() {
        // A direction towards a face with the longest axis `major`, of any length.
        let major = (noise.bits() % 3) as usize;
        let scale = 0.5 + noise.unit();
        let sign = if noise.bits().is_multiple_of(2) { 1.0 } else { -1.0 };
        at[major] = sign * scale;
        for axis in (0..3).filter(|&axis| axis != major) {
            let texel = (noise.bits() % extent[0]) as f32 + 0.1 + 0.8 * noise.unit();
            at[axis] = scale * (2.0 * texel / extent[0] as f32 - 1.0);
        }
        // A step along the face.
        let along = (major + 1) % 3;
        let across = (major + 2) % 3;
        dx[along] = rho * 2.0 * scale / extent[0] as f32;
        dy[across] = 0.3 * dx[along];
    } else {
        for axis in 0..kind.axes() {
            at[axis] = inside_a_texel(noise, extent[axis]);
        }
        let axis = noise.bits() as usize % kind.axes();
        dx[axis] = 0.4 * rho / extent[axis] as f32;
        dy[axis] = -rho / extent[axis] as f32;
    }
    // Layers from before the first to after the last.
    at[3] = match kind {
        Kind::Cubes => (noise.bits() % 4) as f32 - 1.0 + 0.8 * (noise.unit() - 0.5),
        _ => (noise.bits() % (LAYERS + 2)) as f32 - 1.0 + 0.8 * (noise.unit() - 0.5),
    };
    dx[3] = lod;
    dy[3] = noise.unit();
    [at, dx, dy]
}

/// A device with the shader, an image of each kind, and buffers.
struct Bench<'a> {
    gpu: &'a Gpu,
    images: Vec<Image>,
    requests: Buffer,
    results: Buffer,
    kernel: OnceCell<Kernel>,
}

impl<'a> Bench<'a> {
    fn new(gpu: &'a Gpu, color: vk::Format, depth: vk::Format) -> Self {
        let images = KINDS.iter().map(|&kind| {
            // Compressed formats are tested with 2D images; the other images exist only for the shader's bindings.
            let is_flat = !matches!(kind, Kind::One | Kind::Three | Kind::Ones);
            let format = match kind {
                _ if kind.compares() => depth,
                _ if is_flat || device_format(color).decompressed().is_none() => color,
                _ => COLOR,
            };
            let shape = kind.shape(format);
            let image = Image::new(gpu, &shape);
            let aspect = aspect_flags(device_format(format).aspects()[0]);
            let plane = aspect_format(format, aspect);
            let texels = Noise::new(kind as u64).texels(plane, shape.texels());
            image.upload(aspect, &texels);
            image
        });
        Self {
            gpu,
            images: images.collect(),
            requests: Buffer::new(gpu, (REQUESTS * size_of::<Request>()) as u64),
            results: Buffer::new(gpu, (REQUESTS * 16) as u64),
            kernel: OnceCell::new(),
        }
    }

    /// Samples an image of this kind.
    fn sample(&self, kind: Kind, way: Way, sampler: &vk::SamplerCreateInfo<'_>, requests: &[Request]) -> Vec<[f32; 4]> {
        self.requests.write(requests);
        // Only depth images are compared with a reference.
        let samplers = [false, true].map(|compares| Sampler::new(self.gpu, &sampler.compare_enable(compares)));
        let images = KINDS
            .iter()
            .zip(&self.images)
            .map(|(kind, image)| Resource::Texture(image.view, samplers[usize::from(kind.compares())].raw));
        let buffers = [&self.requests, &self.results].map(|buffer| Resource::Storage(buffer.raw));
        let bound: Vec<_> = images.chain(buffers).collect();
        let bindings = Bindings::new(self.gpu, &bound);
        let kernel = self.kernel.get_or_init(|| {
            let words = words(include_bytes!("sampling.comp.spv"));
            Kernel::over(self.gpu, &words, &[bindings.layout])
        });
        let constants = [kind as u32, way as u32];
        let groups = [REQUESTS as u32 / 64, 1, 1];
        kernel.run(&[bindings.set], &constants, groups);
        self.results.values()
    }
}

/// Both devices with the same images, and the differences found.
struct Comparison<'a> {
    ours: Bench<'a>,
    theirs: Bench<'a>,
    findings: Vec<String>,
}

impl<'a> Comparison<'a> {
    fn new(ours: &'a Gpu, theirs: &'a Gpu, color: vk::Format, depth: vk::Format) -> Self {
        Self { ours: Bench::new(ours, color, depth), theirs: Bench::new(theirs, color, depth), findings: Vec::new() }
    }

    fn check(&mut self, kind: Kind, way: Way, sampler: &vk::SamplerCreateInfo<'_>) {
        if !kind.has_way(way) {
            return;
        }
        let mut noise = Noise::new(100 + kind as u64);
        let requests: Vec<_> = (0..REQUESTS).map(|_| request(kind, &mut noise)).collect();
        // Gradients here give integer levels of detail, where nearest filters and levels change.
        let bias = if way == Way::Gradient { 0.3 } else { 0.0 };
        let sampler = &sampler.mip_lod_bias(sampler.mip_lod_bias + bias);
        let ours = self.ours.sample(kind, way, sampler, &requests);
        let theirs = self.theirs.sample(kind, way, sampler, &requests);
        let apart = |a: &[f32; 4], b: &[f32; 4]| {
            let each = a.iter().zip(b);
            // Values beyond 1 are compared in proportion.
            let each = each.map(|(a, b)| (a - b).abs() / b.abs().max(1.0));
            each.fold(0.0, f32::max)
        };
        let mut worst = (0.0, 0);
        let mut count = 0;
        for (index, (a, b)) in ours.iter().zip(&theirs).enumerate() {
            let distance = apart(a, b);
            count += u32::from(distance > 1.0 / 255.0);
            if distance > worst.0 {
                worst = (distance, index);
            }
        }
        if count > 0 {
            let (distance, index) = worst;
            self.findings.push(format!(
                "{kind:?} {way:?} {:?}/{:?}/{:?} {:?} {:?} {:?}: {count} of {REQUESTS} apart, {distance} at {:?}: {:?}, \
                 not {:?}",
                sampler.mag_filter,
                sampler.min_filter,
                sampler.mipmap_mode,
                [sampler.address_mode_u, sampler.address_mode_v, sampler.address_mode_w],
                sampler.border_color,
                sampler.compare_op,
                requests[index],
                ours[index],
                theirs[index],
            ));
        }
    }

    fn done(self) {
        assert!(self.findings.is_empty(), "{}", self.findings.join("\n"));
    }
}

const FILTERS: [(vk::Filter, vk::Filter, vk::SamplerMipmapMode); 5] = {
    use vk::SamplerMipmapMode as Mip;
    let (nearest, linear) = (vk::Filter::NEAREST, vk::Filter::LINEAR);
    [
        (nearest, nearest, Mip::NEAREST),
        (linear, nearest, Mip::NEAREST),
        (nearest, linear, Mip::LINEAR),
        (linear, linear, Mip::NEAREST),
        (linear, linear, Mip::LINEAR),
    ]
};

const MODES: [vk::SamplerAddressMode; 5] = [
    vk::SamplerAddressMode::REPEAT,
    vk::SamplerAddressMode::MIRRORED_REPEAT,
    vk::SamplerAddressMode::CLAMP_TO_EDGE,
    vk::SamplerAddressMode::CLAMP_TO_BORDER,
    vk::SamplerAddressMode::MIRROR_CLAMP_TO_EDGE,
];

/// A sampler whose axes wrap in modes `mode`, `mode` + 1 and `mode` + 2.
fn sampler(
    (mag, min, mip): (vk::Filter, vk::Filter, vk::SamplerMipmapMode),
    mode: usize,
) -> vk::SamplerCreateInfo<'static> {
    let mode = |axis: usize| MODES[(mode + axis) % MODES.len()];
    vk::SamplerCreateInfo::default()
        .mag_filter(mag)
        .min_filter(min)
        .mipmap_mode(mip)
        .address_mode_u(mode(0))
        .address_mode_v(mode(1))
        .address_mode_w(mode(2))
        .max_lod(vk::LOD_CLAMP_NONE)
        .border_color(vk::BorderColor::FLOAT_OPAQUE_BLACK)
        .compare_op(vk::CompareOp::LESS)
}

const COLOR: vk::Format = vk::Format::R8G8B8A8_UNORM;
const DEPTH: vk::Format = vk::Format::D32_SFLOAT;

#[gaurast_runner::test(needs = [Need::Lavapipe])]
fn filters_and_address_modes(case: &Case) {
    exactly(case, |ours, theirs| {
        let mut comparison = Comparison::new(ours, theirs, COLOR, DEPTH);
        for kind in KINDS.into_iter().filter(|kind| !kind.compares()) {
            for filter in FILTERS {
                for mode in 0..MODES.len() {
                    let way = WAYS[mode % 2];
                    comparison.check(kind, way, &sampler(filter, mode));
                }
            }
            comparison.check(kind, Way::Gather, &sampler(FILTERS[0], 3));
        }
        comparison.done();
    });
}

#[gaurast_runner::test(needs = [Need::Lavapipe])]
fn comparisons(case: &Case) {
    exactly(case, |ours, theirs| {
        for depth in [DEPTH, vk::Format::D16_UNORM] {
            let mut comparison = Comparison::new(ours, theirs, COLOR, depth);
            for kind in KINDS.into_iter().filter(|kind| kind.compares()) {
                for (index, op) in (0..8).map(vk::CompareOp::from_raw).enumerate() {
                    let way = if kind.has_way(WAYS[index % 3]) { WAYS[index % 3] } else { Way::Gradient };
                    let sampler = sampler(FILTERS[index % FILTERS.len()], index % MODES.len());
                    comparison.check(kind, way, &sampler.compare_op(op));
                }
            }
            comparison.done();
        }
    });
}

#[gaurast_runner::test(needs = [Need::Lavapipe])]
fn borders_biases_and_limits(case: &Case) {
    exactly(case, |ours, theirs| {
        let mut comparison = Comparison::new(ours, theirs, COLOR, DEPTH);
        let linear = FILTERS[4];
        for border in [
            vk::BorderColor::FLOAT_TRANSPARENT_BLACK,
            vk::BorderColor::FLOAT_OPAQUE_BLACK,
            vk::BorderColor::FLOAT_OPAQUE_WHITE,
        ] {
            for kind in [Kind::One, Kind::Two, Kind::Three, Kind::Twos, Kind::Shadow] {
                let sampler = sampler(linear, 3).border_color(border);
                comparison.check(kind, Way::Lod, &sampler);
            }
        }
        for bias in [-15.0, -1.0, 0.5, 2.25, 15.0] {
            for way in [Way::Lod, Way::Gradient] {
                let sampler = sampler(linear, 0).mip_lod_bias(bias);
                comparison.check(Kind::Two, way, &sampler);
            }
        }
        for (min, max) in [(0.0, 0.0), (1.25, 1.25), (0.75, 2.5), (2.0, 100.0)] {
            let sampler = sampler(linear, 0).min_lod(min).max_lod(max);
            comparison.check(Kind::Twos, Way::Lod, &sampler);
            comparison.check(Kind::Cube, Way::Gradient, &sampler);
        }
        comparison.done();
    });
}

/// Returns true if lavapipe filters a format exactly. It interpolates BC1 to BC5 in 8-bit integers and truncates, with
/// an error of a code or more. (This driver's results are compared with exact values in the tests of block decoding.)
fn is_exact(format: vk::Format) -> bool {
    let name = format!("{format:?}");
    let truncated = ["BC1", "BC2", "BC3", "BC4", "BC5"];
    !truncated.iter().any(|block| name.starts_with(block))
}

/// The colour formats that lavapipe is known not to filter (Mesa 22.3).
const NOT_FILTERED: &[vk::Format] = &[
    vk::Format::R4G4_UNORM_PACK8,
    vk::Format::R4G4B4A4_UNORM_PACK16,
    vk::Format::R8_SRGB,
    vk::Format::R8G8_SRGB,
    vk::Format::R8G8B8_UNORM,
    vk::Format::R8G8B8_SNORM,
    vk::Format::R8G8B8_SRGB,
    vk::Format::B8G8R8_UNORM,
    vk::Format::B8G8R8_SNORM,
    vk::Format::B8G8R8_SRGB,
    vk::Format::R16G16B16_UNORM,
    vk::Format::R16G16B16_SNORM,
    vk::Format::R16G16B16_SFLOAT,
];

#[gaurast_runner::test(needs = [Need::Lavapipe], each = shards(4))]
fn every_format_is_filtered(case: &Case) {
    exactly(case, |ours, theirs| {
        let sampled = vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR | vk::FormatFeatureFlags::TRANSFER_DST;
        let filtered = formats(ours, theirs, vk::Format::BC7_SRGB_BLOCK, |gpu, format| {
            gpu.format_features(format).contains(sampled) && device_format(format).aspects() == [Aspect::Color]
        });
        let compared = filtered.of_both.iter().filter(|&&format| is_exact(format));
        let compared: Vec<_> = compared.collect();
        // Vulkan requires 21 of them, and BC6H and BC7 are 4.
        assert!(compared.len() >= 25, "{compared:?}");
        let mut findings = Vec::new();
        for (index, &&format) in compared.iter().enumerate() {
            if !case.shard().has(index) {
                continue;
            }
            let mut comparison = Comparison::new(ours, theirs, format, DEPTH);
            // Interpolated values between numbers of very different sizes cannot be compared well.
            let is_huge = format!("{format:?}").starts_with("BC6H");
            let filter = FILTERS[if is_huge { 0 } else { 4 }];
            comparison.check(Kind::Two, Way::Lod, &sampler(filter, 0));
            comparison.check(Kind::Three, Way::Lod, &sampler(FILTERS[0], 1));
            comparison.check(Kind::Cubes, Way::Lod, &sampler(filter, 0));
            let found = comparison.findings.iter();
            findings.extend(found.map(|finding| format!("{format:?}: {finding}")));
        }
        assert!(findings.is_empty(), "{}", findings.join("\n"));
        expect_lacking("filters", &filtered.of_ours_alone, NOT_FILTERED);
    });
}
