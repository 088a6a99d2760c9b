//! Sampler Y'CbCr conversions of every format with chroma, compared with the specification's formulas in binary64. Results
//! may differ by 1e-5: coordinates and weights are binary32, whose errors the formulas multiply by up to 4.

use super::image::{Arrangement, Chroma, ImagePlan, Picture, YcbcrImage};
use ash::vk;
use gaurast_runner::{Case, Missing, Need, ignore};
use gaurast_testkit::devices::own;
use gaurast_testkit::exact_lavapipe::exactly;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::shader::{Stage, compile};
use gaurast_testkit::texels::Noise;
use gaurast_testkit::{Buffer, Gpu, Kernel};
use std::sync::LazyLock;

const TOLERANCE: f64 = 1e-5;

/// The samples of a dispatch.
const SAMPLES: usize = 64;

const MODELS: [vk::SamplerYcbcrModelConversion; 5] = [
    vk::SamplerYcbcrModelConversion::RGB_IDENTITY,
    vk::SamplerYcbcrModelConversion::YCBCR_IDENTITY,
    vk::SamplerYcbcrModelConversion::YCBCR_709,
    vk::SamplerYcbcrModelConversion::YCBCR_601,
    vk::SamplerYcbcrModelConversion::YCBCR_2020,
];

const RANGES: [vk::SamplerYcbcrRange; 2] = [vk::SamplerYcbcrRange::ITU_FULL, vk::SamplerYcbcrRange::ITU_NARROW];

/// A conversion and the sampler's filter.
#[derive(Clone, Copy, Debug)]
struct Conversion {
    model: vk::SamplerYcbcrModelConversion,
    range: vk::SamplerYcbcrRange,
    offsets: [vk::ChromaLocation; 2],
    chroma_filter: vk::Filter,
    filter: vk::Filter,
    /// True if Cb and Cr are swapped before the conversion.
    is_swapped: bool,
}

impl Conversion {
    /// One of the combinations of places of chroma and filters.
    fn numbered(model: vk::SamplerYcbcrModelConversion, range: vk::SamplerYcbcrRange, number: usize) -> Self {
        let bit = |at: usize| number >> at & 1 == 1;
        let location = |at| if bit(at) { vk::ChromaLocation::MIDPOINT } else { vk::ChromaLocation::COSITED_EVEN };
        let filter = |at| if bit(at) { vk::Filter::LINEAR } else { vk::Filter::NEAREST };
        Self {
            model,
            range,
            offsets: [location(0), location(1)],
            chroma_filter: filter(2),
            filter: filter(3),
            is_swapped: bit(4),
        }
    }

    fn components(&self) -> vk::ComponentMapping {
        match self.is_swapped {
            false => vk::ComponentMapping::default(),
            true => vk::ComponentMapping {
                r: vk::ComponentSwizzle::B,
                b: vk::ComponentSwizzle::R,
                ..vk::ComponentMapping::default()
            },
        }
    }

    /// The colour of Cr, luma and Cb from 0 to 1: "Sampler Y'CBCR Range Expansion" and "Sampler Y'CBCR Model Conversion".
    fn color(&self, bits: u32, [cr, y, cb]: [f64; 3]) -> [f64; 3] {
        let [cr, cb] = if self.is_swapped { [cb, cr] } else { [cr, cb] };
        if self.model == vk::SamplerYcbcrModelConversion::RGB_IDENTITY {
            return [cr, y, cb];
        }
        let max = f64::from((1u32 << bits) - 1);
        let step = f64::from(1u32 << (bits - 8));
        let [cr, y, cb] = match self.range {
            vk::SamplerYcbcrRange::ITU_FULL => [cr - 128.0 * step / max, y, cb - 128.0 * step / max],
            _ => [
                (cr * max - 128.0 * step) / (224.0 * step),
                (y * max - 16.0 * step) / (219.0 * step),
                (cb * max - 128.0 * step) / (224.0 * step),
            ],
        };
        match self.model {
            vk::SamplerYcbcrModelConversion::YCBCR_IDENTITY => [cr, y, cb],
            vk::SamplerYcbcrModelConversion::YCBCR_601 => {
                [y + 1.402 * cr, y - (0.202008 * cb + 0.419198 * cr) / 0.587, y + 1.772 * cb]
            }
            vk::SamplerYcbcrModelConversion::YCBCR_709 => {
                [y + 1.5748 * cr, y - (0.13397432 * cb + 0.33480248 * cr) / 0.7152, y + 1.8556 * cb]
            }
            _ => [y + 1.4746 * cr, y - (0.11156702 * cb + 0.38737742 * cr) / 0.6780, y + 1.8814 * cb],
        }
    }

    /// The colour of a picture at a place in texels of luma.
    fn sampled(&self, picture: &Picture, place: [f64; 2]) -> [f64; 3] {
        let luma = filtered(self.filter, place, [0.5; 2], [1.0; 2], |at| picture.luma(at));
        let spacing = picture.plan.arrangement.spacing();
        // Chroma with as many texels as the luma is not reconstructed: the sampler's filter is for all components.
        let filter = if spacing == [1, 1] { self.filter } else { self.chroma_filter };
        let first = [0, 1].map(|axis| match (spacing[axis], self.offsets[axis]) {
            (2, vk::ChromaLocation::MIDPOINT) => 1.0,
            _ => 0.5,
        });
        let [cb, cr] = [Chroma::Cb, Chroma::Cr]
            .map(|which| filtered(filter, place, first, spacing.map(f64::from), |at| picture.chroma(which, at)));
        self.color(picture.plan.bits, [cr, luma, cb])
    }
}

/// The value at a place of texels that are `spacing` apart, of which the first is at `first`.
fn filtered(
    filter: vk::Filter,
    place: [f64; 2],
    first: [f64; 2],
    spacing: [f64; 2],
    texel: impl Fn([i64; 2]) -> f64,
) -> f64 {
    let at = [0, 1].map(|axis| (place[axis] - first[axis]) / spacing[axis]);
    if filter == vk::Filter::NEAREST {
        return texel(at.map(|at| (at + 0.5).floor() as i64));
    }
    let [x, y] = at.map(|at| at.floor() as i64);
    let [right, lower] = at.map(|at| at - at.floor());
    let row = |y| (1.0 - right) * texel([x, y]) + right * texel([x + 1, y]);
    (1.0 - lower) * row(y) + lower * row(y + 1)
}

/// Coordinates inside and beyond an image, away from the places where the nearest texel of luma or chroma changes: those are
/// multiples of half a texel of luma.
fn coordinates(noise: &mut Noise, [width, height]: [u32; 2]) -> Vec<[f32; 2]> {
    let along = |noise: &mut Noise, size: u32| {
        let half = (noise.bits() % (2 * size + 4)) as f32 - 2.0;
        0.5 * (half + 0.2 + 0.6 * noise.unit()) / size as f32
    };
    (0..SAMPLES).map(|_| [along(noise, width), along(noise, height)]).collect()
}

static SHADER: LazyLock<Vec<u32>> = LazyLock::new(|| {
    compile(
        Stage::Compute,
        "layout(local_size_x = 64) in;
         layout(binding = 0) uniform sampler2D image;
         layout(binding = 1, std430) readonly buffer Places { vec2 places[]; };
         layout(binding = 2, std430) writeonly buffer Results { vec4 results[]; };
         void main() {
             uint i = gl_GlobalInvocationID.x;
             results[i] = textureLod(image, places[i], 0.0);
         }",
    )
});

/// Samples an image through an immutable sampler with a conversion.
fn sample(gpu: &Gpu, image: &YcbcrImage, conversion: &Conversion, places: &[[f32; 2]]) -> Vec<[f32; 4]> {
    let device = gpu.device();
    let format = image.plan.format;
    let places = Buffer::of(gpu, places);
    let results = Buffer::new(gpu, 16 * SAMPLES as u64);
    let info = vk::SamplerYcbcrConversionCreateInfo::default()
        .format(format)
        .ycbcr_model(conversion.model)
        .ycbcr_range(conversion.range)
        .components(conversion.components())
        .x_chroma_offset(conversion.offsets[0])
        .y_chroma_offset(conversion.offsets[1])
        .chroma_filter(conversion.chroma_filter);
    let clamp = vk::SamplerAddressMode::CLAMP_TO_EDGE;
    // SAFETY: see the crate.
    unsafe {
        let made = device.create_sampler_ycbcr_conversion(&info, None).expect("a conversion");
        let mut chained = vk::SamplerYcbcrConversionInfo::default().conversion(made);
        let sampler_info = vk::SamplerCreateInfo::default()
            .mag_filter(conversion.filter)
            .min_filter(conversion.filter)
            .address_mode_u(clamp)
            .address_mode_v(clamp)
            .address_mode_w(clamp)
            .push_next(&mut chained);
        let samplers = [device.create_sampler(&sampler_info, None).expect("a sampler")];
        let view = image.view(made);
        let kinds = [vk::DescriptorType::COMBINED_IMAGE_SAMPLER, vk::DescriptorType::STORAGE_BUFFER];
        let binding = |number, ty| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(number)
                .descriptor_type(ty)
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::COMPUTE)
        };
        let bindings = [binding(0, kinds[0]).immutable_samplers(&samplers), binding(1, kinds[1]), binding(2, kinds[1])];
        let layout_info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        let layouts = [device.create_descriptor_set_layout(&layout_info, None).expect("a set layout")];
        // Other drivers need up to three descriptors for a sampler with a conversion.
        let sizes = kinds.map(|ty| vk::DescriptorPoolSize { ty, descriptor_count: 3 });
        let pool_info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        let pool = device.create_descriptor_pool(&pool_info, None).expect("a pool");
        let set_info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
        let set = device.allocate_descriptor_sets(&set_info).expect("a set")[0];
        let images = [vk::DescriptorImageInfo::default().image_view(view).image_layout(vk::ImageLayout::GENERAL)];
        let buffers = [&places, &results]
            .map(|buffer| vk::DescriptorBufferInfo::default().buffer(buffer.raw).range(vk::WHOLE_SIZE));
        let write = |number, ty| vk::WriteDescriptorSet::default().dst_set(set).dst_binding(number).descriptor_type(ty);
        let writes = [write(0, kinds[0]).image_info(&images), write(1, kinds[1]).buffer_info(&buffers)];
        device.update_descriptor_sets(&writes, &[]);
        let kernel = Kernel::over(gpu, &SHADER, &layouts);
        kernel.run(&[set], &[], [1, 1, 1]);
        drop(kernel);
        device.destroy_descriptor_pool(pool, None);
        device.destroy_descriptor_set_layout(layouts[0], None);
        device.destroy_image_view(view, None);
        device.destroy_sampler(samplers[0], None);
        device.destroy_sampler_ycbcr_conversion(made, None);
    }
    results.values()
}

/// The size of images.
const SIZE: [u32; 2] = [12, 6];

#[gaurast_runner::test(needs = [GLSLANG])]
fn colours_are_those_of_the_formulas() {
    let gpu = own();
    let mut noise = Noise::new(31);
    let mut number = 0;
    for plan in ImagePlan::all(SIZE) {
        let picture = Picture::random(plan, &mut noise);
        let image = YcbcrImage::joint(gpu, plan);
        image.upload(&picture);
        for (model, range) in MODELS.into_iter().flat_map(|model| RANGES.map(|range| (model, range))) {
            let conversion = Conversion::numbered(model, range, number);
            // 7 and 32 have no common divisor, so that all combinations come.
            number += 7;
            let places = coordinates(&mut noise, SIZE);
            let found = sample(gpu, &image, &conversion, &places);
            for (place, found) in places.iter().zip(found) {
                let at = [0, 1].map(|axis| f64::from(place[axis]) * f64::from(SIZE[axis]));
                let expected = conversion.sampled(&picture, at);
                let error = (0..3).map(|c| (f64::from(found[c]) - expected[c]).abs()).fold(0.0, f64::max);
                assert!(
                    error <= TOLERANCE && found[3] == 1.0,
                    "{:?}, {conversion:?} at {at:?}: {found:?} instead of {expected:?}",
                    plan.format
                );
            }
        }
    }
}

/// Planes in memory of their own, in another order, are those of an image in one memory.
#[gaurast_runner::test(needs = [GLSLANG])]
fn disjoint_planes_are_sampled_as_others() {
    let gpu = own();
    let mut noise = Noise::new(32);
    for plan in ImagePlan::all(SIZE).into_iter().filter(|plan| plan.arrangement.planes() > 1) {
        let picture = Picture::random(plan, &mut noise);
        let places = coordinates(&mut noise, SIZE);
        let conversion = Conversion::numbered(MODELS[2], RANGES[1], 15);
        let [joint, disjoint] = [YcbcrImage::joint(gpu, plan), YcbcrImage::disjoint(gpu, plan)].map(|image| {
            image.upload(&picture);
            sample(gpu, &image, &conversion, &places)
        });
        assert_eq!(joint, disjoint, "{:?}", plan.format);
        assert!(joint.iter().any(|color| color[..3] != joint[0][..3]));
    }
}

/// The host writes texels where the layouts of the planes of a linear image say.
#[gaurast_runner::test(needs = [GLSLANG])]
fn linear_planes_lie_where_their_layouts_say() {
    let gpu = own();
    let mut noise = Noise::new(33);
    let conversion = Conversion::numbered(MODELS[3], RANGES[0], 15);
    for plan in ImagePlan::all(SIZE) {
        let picture = Picture::random(plan, &mut noise);
        let places = coordinates(&mut noise, SIZE);
        let optimal = YcbcrImage::joint(gpu, plan);
        optimal.upload(&picture);
        let expected = sample(gpu, &optimal, &conversion, &places);
        for is_disjoint in [false, true].into_iter().filter(|disjoint| !disjoint || plan.arrangement.planes() > 1) {
            let linear = YcbcrImage::linear(gpu, plan, is_disjoint);
            linear.write_mapped(&picture);
            assert_eq!(sample(gpu, &linear, &conversion, &places), expected, "{:?}", plan.format);
            assert_eq!(linear.download(), picture.bytes(), "{:?}", plan.format);
        }
    }
}

/// lavapipe has conversions since Mesa 23. Where it filters in binary32, colours differ by up to 1/255.
#[gaurast_runner::test(needs = [GLSLANG, Need::Lavapipe])]
fn lavapipe_finds_the_same_colours(case: &Case) {
    exactly(case, compare);
}

/// Compares the colours of two devices in all formats that both have.
fn compare(ours: &Gpu, theirs: &Gpu) {
    use vk::FormatFeatureFlags as Feature;
    let mut noise = Noise::new(34);
    let locations = Feature::MIDPOINT_CHROMA_SAMPLES | Feature::COSITED_CHROMA_SAMPLES;
    let supported = |plan: &ImagePlan| {
        let features = theirs.format_features(plan.format);
        features.contains(Feature::SAMPLED_IMAGE) && features.intersects(locations)
    };
    let plans: Vec<_> = ImagePlan::all(SIZE).into_iter().filter(supported).collect();
    if plans.is_empty() {
        ignore(Missing::Capability, format!("{} has no conversions", theirs.name()));
    }
    for plan in plans {
        let picture = Picture::random(plan, &mut noise);
        let places = coordinates(&mut noise, SIZE);
        let features = theirs.format_features(plan.format);
        let filters = match features.contains(Feature::SAMPLED_IMAGE_YCBCR_CONVERSION_LINEAR_FILTER) {
            true => &[vk::Filter::NEAREST, vk::Filter::LINEAR][..],
            false => &[vk::Filter::NEAREST],
        };
        for (model, range) in MODELS.into_iter().flat_map(|model| RANGES.map(|range| (model, range))) {
            for &filter in filters {
                // Chroma is in the middle of luma, or at the first of both where the device has nothing else.
                let number = if features.contains(Feature::MIDPOINT_CHROMA_SAMPLES) { 3 } else { 0 };
                let conversion = Conversion::numbered(model, range, number);
                let conversion = Conversion { filter, chroma_filter: filter, ..conversion };
                let [ours, theirs] = [ours, theirs].map(|gpu| {
                    let image = YcbcrImage::joint(gpu, plan);
                    image.upload(&picture);
                    sample(gpu, &image, &conversion, &places)
                });
                for (ours, theirs) in ours.iter().zip(theirs) {
                    let difference = ours.iter().zip(theirs).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                    assert!(difference <= 1.0 / 255.0, "{:?} {conversion:?}: {ours:?} {theirs:?}", plan.format);
                }
            }
        }
    }
}

/// The arrangements of the tests are all that there are.
#[gaurast_runner::test]
fn every_arrangement_is_tested() {
    let plans = ImagePlan::all(SIZE);
    assert_eq!(plans.len(), 32);
    for arrangement in [Arrangement::LumaFirst, Arrangement::ChromaFirst] {
        assert_eq!(plans.iter().filter(|plan| plan.arrangement == arrangement).count(), 4);
    }
}
