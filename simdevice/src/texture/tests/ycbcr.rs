//! Tests of images with chroma against the specification's formulas in binary64.

use super::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const MODELS: [YcbcrModel; 5] = [
    YcbcrModel::RgbIdentity,
    YcbcrModel::YcbcrIdentity,
    YcbcrModel::Ycbcr601,
    YcbcrModel::Ycbcr709,
    YcbcrModel::Ycbcr2020,
];

/// The colour of Cr, luma and Cb from 0 to 1, by the formulas.
fn converted(conversion: &YcbcrConversion, [cr, y, cb]: [f64; 3]) -> [f64; 3] {
    let codes = 2f64.powi(conversion.bits as i32);
    let step = codes / 256.0;
    let [cr, y, cb] = match (conversion.model, conversion.range) {
        (YcbcrModel::RgbIdentity, _) => return [cr, y, cb],
        (_, YcbcrRange::Full) => [cr - codes / 2.0 / (codes - 1.0), y, cb - codes / 2.0 / (codes - 1.0)],
        (_, YcbcrRange::Narrow) => [
            (cr * (codes - 1.0) - 128.0 * step) / (224.0 * step),
            (y * (codes - 1.0) - 16.0 * step) / (219.0 * step),
            (cb * (codes - 1.0) - 128.0 * step) / (224.0 * step),
        ],
    };
    match conversion.model {
        YcbcrModel::RgbIdentity | YcbcrModel::YcbcrIdentity => [cr, y, cb],
        YcbcrModel::Ycbcr601 => [y + 1.402 * cr, y - 0.202008 / 0.587 * cb - 0.419198 / 0.587 * cr, y + 1.772 * cb],
        YcbcrModel::Ycbcr709 => {
            [y + 1.5748 * cr, y - 0.13397432 / 0.7152 * cb - 0.33480248 / 0.7152 * cr, y + 1.8556 * cb]
        }
        YcbcrModel::Ycbcr2020 => {
            [y + 1.4746 * cr, y - 0.11156702 / 0.6780 * cb - 0.38737742 / 0.6780 * cr, y + 1.8814 * cb]
        }
    }
}

/// The value at a place, in texels of luma, of texels `spacing` apart of which the first is at `first`.
fn filtered_at(filter: Filter, place: f64, first: f64, spacing: f64, texel: impl Fn(i64) -> f64) -> f64 {
    let number = (place - first) / spacing;
    match filter {
        Filter::Nearest => texel((number + 0.5).floor() as i64),
        Filter::Linear => {
            let weight = number - number.floor();
            let left = number.floor() as i64;
            (1.0 - weight) * texel(left) + weight * texel(left + 1)
        }
    }
}

/// A plane: its texels' components, row by row, and the texels of luma for each along x and y.
struct Plane {
    size: [u32; 2],
    texels: Vec<[f32; 4]>,
    spacing: [u32; 2],
}

impl Plane {
    fn random(rng: &mut ChaCha8Rng, luma: [u32; 2], spacing: [u32; 2], format: Format) -> Self {
        let size = [luma[0] / spacing[0], luma[1] / spacing[1]];
        let texel = |_| format.decode(&format.encode([(); 4].map(|()| rng.random())));
        Self { size, texels: (0..size[0] * size[1]).map(texel).collect(), spacing }
    }

    fn image(&self, format: Format) -> SampledImage {
        let [width, height] = self.size;
        image(desc(ImageKind::D2, format, [width, height, 1]), |_, _, [x, y, _]| self.texels[(y * width + x) as usize])
    }

    /// A component at a place in texels of luma. Coordinates beyond the edges are clamped.
    fn at(&self, component: usize, place: [f64; 2], filter: Filter, locations: [ChromaLocation; 2]) -> f64 {
        let first = [0, 1].map(|axis| match (self.spacing[axis], locations[axis]) {
            (2, ChromaLocation::Midpoint) => 1.0,
            _ => 0.5,
        });
        let spacing = self.spacing.map(f64::from);
        filtered_at(filter, place[1], first[1], spacing[1], |y| {
            filtered_at(filter, place[0], first[0], spacing[0], |x| {
                let [width, height] = self.size.map(i64::from);
                let (x, y) = (x.clamp(0, width - 1), y.clamp(0, height - 1));
                f64::from(self.texels[(y * width + x) as usize][component])
            })
        })
    }
}

#[gaurast_runner::test]
fn colours_are_those_of_the_formulas() {
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    let size = [12, 6];
    let mut worst = 0f64;
    for (luma_format, chroma_format, bits) in [
        (Format::R8Unorm, Format::R8G8Unorm, 8),
        (Format::R10X6UnormPack16, Format::R10X6G10X6Unorm2Pack16, 10),
        (Format::R12X4UnormPack16, Format::R12X4G12X4Unorm2Pack16, 12),
        (Format::R16Unorm, Format::R16G16Unorm, 16),
    ] {
        for case in 0..320 {
            let spacing = [[2, 2], [2, 1], [1, 1]][case % 3];
            let location = |bit: usize| match case >> bit & 1 {
                0 => ChromaLocation::CositedEven,
                _ => ChromaLocation::Midpoint,
            };
            let filter = |bit: usize| if case >> bit & 1 == 0 { Filter::Nearest } else { Filter::Linear };
            let conversion = YcbcrConversion {
                model: MODELS[case % 5],
                range: if case >> 4 & 1 == 0 { YcbcrRange::Full } else { YcbcrRange::Narrow },
                bits,
                chroma_locations: [location(0), location(1)],
                chroma_filter: filter(2),
            };
            let luma = Plane::random(&mut rng, size, [1, 1], luma_format);
            let chroma = Plane::random(&mut rng, size, spacing, chroma_format);
            let mut bound = luma.image(luma_format);
            let place = |plane, component| PlaneComponent { plane, component };
            bound.chroma = Some(Arc::new(Chroma {
                planes: vec![chroma.image(chroma_format).view],
                components: [place(1, 1), place(0, 0), place(1, 0)],
                conversion,
            }));
            let luma_filter = filter(3);
            let sampler = Sampler { address_modes: [AddressMode::ClampToEdge; 3], ..filtered(luma_filter) };
            let at: Vec<[f32; 4]> = (0..16).map(|_| [(); 4].map(|()| rng.random_range(-0.1..1.1))).collect();
            let mut request = request(Dimension::D2, &at);
            if case % 7 < 3 {
                request.lod = LodRequest::Automatic;
            }
            let table = table(bound, sampler);
            let answer = table.sampled(0, 0, &request);
            assert_eq!(answer, table.lane_by_lane().sampled(0, 0, &request), "{conversion:?}");
            // Chroma that is not subsampled has the sampler's filter.
            let chroma_filter = if spacing == [1, 1] { luma_filter } else { conversion.chroma_filter };
            for (lane, at) in at.iter().enumerate() {
                let place = [0, 1].map(|axis| f64::from(at[axis]) * f64::from(size[axis]));
                let near_an_edge = place.iter().any(|place| {
                    let quarters = 2.0 * place;
                    (quarters - quarters.round()).abs() < 1e-4
                });
                if near_an_edge {
                    continue;
                }
                let chroma = |component| chroma.at(component, place, chroma_filter, conversion.chroma_locations);
                let stored = [chroma(1), luma.at(0, place, luma_filter, [ChromaLocation::Midpoint; 2]), chroma(0)];
                let expected = converted(&conversion, stored);
                let found = floats(&answer, lane);
                for channel in 0..3 {
                    let error = (f64::from(found[channel]) - expected[channel]).abs();
                    assert!(error < 1e-5, "{conversion:?} {luma_filter:?} {spacing:?} {at:?}: {found:?} {expected:?}");
                    worst = worst.max(error);
                }
                assert_eq!(found[3], 1.0);
            }
        }
    }
    assert!(worst > 0.0);
}

#[gaurast_runner::test]
fn a_swizzle_comes_before_the_conversion() {
    let luma = image(desc(ImageKind::D2, Format::R8Unorm, [2, 2, 1]), |_, _, _| [0.5, 0.0, 0.0, 1.0]);
    let [cb, cr] = [0.25, 0.75].map(|chroma| {
        image(desc(ImageKind::D2, Format::R8Unorm, [1, 1, 1]), move |_, _, _| [chroma, 0.0, 0.0, 1.0]).view
    });
    let place = |plane| PlaneComponent { plane, component: 0 };
    let conversion =
        YcbcrConversion { model: YcbcrModel::Ycbcr601, range: YcbcrRange::Full, bits: 8, ..YcbcrConversion::default() };
    let chroma = Chroma { planes: vec![cb, cr], components: [place(2), place(0), place(1)], conversion };
    let colour = |swizzle| {
        let bound = SampledImage { swizzle, chroma: Some(Arc::new(chroma.clone())), ..luma.clone() };
        let at = [[0.5; 4]];
        floats(&table(bound, filtered(Filter::Linear)).sampled(0, 0, &request(Dimension::D2, &at)), 0)
    };
    use ComponentSwizzle::{Blue, Green, Red, Zero};
    let code = |value: f64| (value * 255.0).round_ties_even() / 255.0;
    let [cb, cr, y] = [0.25, 0.75, 0.5].map(code);
    let expected = |stored, alpha| {
        let [red, green, blue] = converted(&conversion, stored);
        [red, green, blue, alpha]
    };
    for (swizzle, expected) in
        [(IDENTITY, expected([cr, y, cb], 1.0)), ([Blue, Green, Red, Zero], expected([cb, y, cr], 0.0))]
    {
        let found = colour(swizzle);
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((f64::from(found) - expected).abs() < 1e-6, "{swizzle:?}: {found} {expected}");
        }
    }
}

/// Grey has no chroma: it is the same in all models, and exactly so.
#[gaurast_runner::test]
fn grey_is_grey() {
    let grey = 128.0 / 255.0;
    let luma = image(desc(ImageKind::D2, Format::R8Unorm, [2, 2, 1]), |_, _, _| [1.0, 0.0, 0.0, 1.0]);
    let chroma = image(desc(ImageKind::D2, Format::R8G8Unorm, [1, 1, 1]), |_, _, _| [grey, grey, 0.0, 1.0]).view;
    let place = |plane, component| PlaneComponent { plane, component };
    for model in [YcbcrModel::Ycbcr601, YcbcrModel::Ycbcr709, YcbcrModel::Ycbcr2020] {
        let conversion = YcbcrConversion { model, range: YcbcrRange::Full, bits: 8, ..YcbcrConversion::default() };
        let components = [place(1, 1), place(0, 0), place(1, 0)];
        let chroma = Some(Arc::new(Chroma { planes: vec![chroma.clone()], components, conversion }));
        let table = table(SampledImage { chroma, ..luma.clone() }, filtered(Filter::Linear));
        assert_eq!(floats(&table.sampled(0, 0, &request(Dimension::D2, &[[0.5; 4]])), 0), [1.0; 4]);
    }
}
