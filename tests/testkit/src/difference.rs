//! Comparison of the pictures that two devices drew with triangles.

use std::fmt;
use std::path::{Path, PathBuf};

use ash::vk;
use half::f16;
use image::{Rgb, RgbImage};

use gaurast_oracle::compare::PictureError;

use crate::output::{Output, Picture};
use crate::resource::texel_size;

/// The difference of one picture between two devices.
#[derive(Clone, Debug)]
pub struct Difference {
    /// The picture's name.
    pub picture: String,
    /// Texels that differ by more than the format's limit.
    pub texels: usize,
    /// The greatest difference, in multiples of the limit.
    pub worst: f64,
    /// The texel with the greatest difference: x and y.
    pub place: [u32; 2],
    /// The components of that texel: in the first output, and in the second.
    pub components: [Vec<f64>; 2],
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.place;
        let [first, second] = &self.components;
        write!(
            f,
            "{}: {} texels differ, most of all ({x}, {y}): {first:?} and {second:?}, {:.1} limits apart",
            self.picture, self.texels, self.worst
        )
    }
}

/// Returns the pictures that differ by more than their formats allow.
///
/// The limits by kind of component:
///
/// | component | limit |
/// |---|---|
/// | of 8 bits or fewer | 1, or 2 in an sRGB format, whose curve is steep near black |
/// | integer | 0 |
/// | float | 1e-4 of the magnitude or of 1 |
/// | half float | 1e-3 of the magnitude or of 1 |
/// | depth | two units of the format, or 1e-6 for a float |
///
/// # Panics
/// If the outputs don't have the same pictures.
pub fn differences(ours: &Output, theirs: &Output) -> Vec<Difference> {
    assert_eq!(ours.pictures.len(), theirs.pictures.len());
    let pairs = ours.pictures.iter().zip(&theirs.pictures);
    pairs.filter_map(|(ours, theirs)| difference(ours, theirs)).collect()
}

/// The difference of two pictures, or `None` if every texel is within its limit.
pub fn difference(ours: &Picture, theirs: &Picture) -> Option<Difference> {
    assert_eq!(ours.name, theirs.name);
    assert_eq!((ours.format, ours.size), (theirs.format, theirs.size));
    let mut found: Option<Difference> = None;
    for (index, (first, second)) in texels(ours).zip(texels(theirs)).enumerate() {
        let distance = distance(ours.format, first, second);
        if distance <= 1.0 {
            continue;
        }
        let difference = found.get_or_insert_with(|| Difference {
            picture: ours.name.clone(),
            texels: 0,
            worst: 0.0,
            place: [0; 2],
            components: Default::default(),
        });
        difference.texels += 1;
        if distance > difference.worst {
            let index = index as u32;
            difference.worst = distance;
            difference.place = [index % ours.size[0], index / ours.size[0]];
            difference.components = [first, second].map(|texel| components(ours.format, texel).0);
        }
    }
    found
}

fn texels(picture: &Picture) -> impl Iterator<Item = &[u8]> {
    picture.bytes.chunks_exact(texel_size(picture.format) as usize)
}

/// The greatest difference of a component, in multiples of the limit. NaN equals NaN and is infinitely far from
/// numbers.
fn distance(format: vk::Format, first: &[u8], second: &[u8]) -> f64 {
    if first == second {
        return 0.0;
    }
    let (first, limit) = components(format, first);
    let (second, _) = components(format, second);
    let pairs = first.iter().zip(&second);
    pairs
        .map(|(&first, &second)| {
            if first == second || (first.is_nan() && second.is_nan()) {
                return 0.0;
            }
            let distance = match limit {
                Limit::Absolute(limit) => (first - second).abs() / limit,
                Limit::Relative(limit) => (first - second).abs() / (limit * first.abs().max(second.abs()).max(1.0)),
            };
            if distance.is_nan() { f64::INFINITY } else { distance }
        })
        .fold(0.0, f64::max)
}

/// The limit on the difference of a component.
#[derive(Clone, Copy)]
enum Limit {
    /// An absolute difference.
    Absolute(f64),
    /// A share of the magnitude, or of 1 if the magnitude is less.
    Relative(f64),
}

/// A texel's components, unscaled, and the limit on their differences.
fn components(format: vk::Format, texel: &[u8]) -> (Vec<f64>, Limit) {
    use vk::Format as F;
    let bytes = || texel.iter().map(|&byte| f64::from(byte)).collect();
    let signed_bytes = || (texel.iter().map(|&byte| f64::from(byte as i8))).collect();
    let shorts = || {
        let shorts = texel.chunks_exact(2);
        shorts.map(|short| u16::from_le_bytes([short[0], short[1]]))
    };
    let words = || bytemuck::pod_collect_to_vec::<u8, u32>(texel).into_iter();
    let exact = Limit::Absolute(f64::MIN_POSITIVE);
    let unit = Limit::Absolute(1.0);
    match format {
        F::R8_UNORM | F::R8G8_UNORM | F::R8G8B8A8_UNORM | F::B8G8R8A8_UNORM => (bytes(), unit),
        F::R8G8B8A8_SNORM => (signed_bytes(), unit),
        F::R8G8B8A8_SRGB | F::B8G8R8A8_SRGB => (bytes(), Limit::Absolute(2.0)),
        F::R8_UINT | F::R8G8B8A8_UINT | F::S8_UINT => (bytes(), exact),
        F::R8G8B8A8_SINT => (signed_bytes(), exact),
        F::R16_UINT => (shorts().map(f64::from).collect(), exact),
        F::R16G16B16A16_UNORM => (shorts().map(f64::from).collect(), Limit::Absolute(8.0)),
        F::D16_UNORM => (shorts().map(f64::from).collect(), Limit::Absolute(2.0)),
        F::R16_SFLOAT | F::R16G16_SFLOAT | F::R16G16B16A16_SFLOAT => {
            (shorts().map(|bits| f16::from_bits(bits).to_f64()).collect(), Limit::Relative(1e-3))
        }
        F::R5G6B5_UNORM_PACK16 => (fields(shorts().map(u32::from).next(), &[5, 6, 5]), unit),
        F::A2B10G10R10_UNORM_PACK32 => (fields(words().next(), &[10, 10, 10, 2]), unit),
        F::B10G11R11_UFLOAT_PACK32 => (fields(words().next(), &[11, 11, 10]), unit),
        F::X8_D24_UNORM_PACK32 => (fields(words().next(), &[24]), Limit::Absolute(2.0)),
        F::R32_UINT | F::R32G32_UINT | F::R32G32B32A32_UINT => (words().map(f64::from).collect(), exact),
        F::R32_SINT => (words().map(|word| f64::from(word.cast_signed())).collect(), exact),
        F::D32_SFLOAT => (floats(words()), Limit::Absolute(1e-6)),
        _ => (floats(words()), Limit::Relative(1e-4)),
    }
}

fn floats(words: impl Iterator<Item = u32>) -> Vec<f64> {
    words.map(|word| f64::from(f32::from_bits(word))).collect()
}

/// Bit fields of a word, starting from the lowest bits.
fn fields(word: Option<u32>, widths: &[u32]) -> Vec<f64> {
    let mut word = word.unwrap_or(0);
    let mut field = |&width: &u32| {
        let field = word & ((1 << width) - 1);
        word = word.checked_shr(width).unwrap_or(0);
        f64::from(field)
    };
    widths.iter().map(&mut field).collect()
}

/// Writes a PNG of three panels for each picture of `differences`: the first output, the second, and the difference. In
/// the third, grey is a difference within the limit, and red a greater one.
///
/// # Errors
/// [`PictureError`] if a file cannot be written.
pub fn write_differences(
    folder: &Path,
    ours: &Output,
    theirs: &Output,
    differences: &[Difference],
) -> Result<Vec<PathBuf>, PictureError> {
    std::fs::create_dir_all(folder)?;
    let mut paths = Vec::new();
    for (ours, theirs) in ours.pictures.iter().zip(&theirs.pictures) {
        if differences.iter().any(|difference| difference.picture == ours.name) {
            let path = folder.join(format!("{}.png", ours.name.replace(' ', "_")));
            panels(ours, theirs).save(&path)?;
            paths.push(path);
        }
    }
    Ok(paths)
}

/// The picture as 8-bit colours, for people.
pub fn for_people(picture: &Picture) -> RgbImage {
    let all: Vec<_> = texels(picture).collect();
    let width = picture.size[0];
    RgbImage::from_fn(width, picture.size[1], |x, y| color(picture.format, all[(y * width + x) as usize]))
}

fn panels(ours: &Picture, theirs: &Picture) -> RgbImage {
    let [width, height] = ours.size;
    let (first, second) = (for_people(ours), for_people(theirs));
    let all: Vec<_> = texels(ours).zip(texels(theirs)).collect();
    RgbImage::from_fn(3 * width, height, |x, y| match x / width {
        0 => *first.get_pixel(x, y),
        1 => *second.get_pixel(x - width, y),
        _ => {
            let (ours_texel, theirs_texel) = all[(y * width + x - 2 * width) as usize];
            let distance = distance(ours.format, ours_texel, theirs_texel);
            if distance > 1.0 { Rgb([255, 0, 0]) } else { Rgb([(100.0 * distance) as u8; 3]) }
        }
    })
}

/// A colour that shows a texel: for integers an arbitrary one.
fn color(format: vk::Format, texel: &[u8]) -> Rgb<u8> {
    use vk::Format as F;
    let (values, _) = components(format, texel);
    let value = |index: usize| values.get(index).copied().unwrap_or(0.0);
    let scaled = |scale: f64| Rgb([0, 1, 2].map(|index| (scale * value(index)) as u8));
    let grey = |value: f64| Rgb([(255.0 * value) as u8; 3]);
    match format {
        F::B8G8R8A8_UNORM | F::B8G8R8A8_SRGB => Rgb([2, 1, 0].map(|index| value(index) as u8)),
        F::R8_UNORM | F::R8G8_UNORM | F::R8G8B8A8_UNORM | F::R8G8B8A8_SRGB => scaled(1.0),
        F::R8G8B8A8_SNORM => scaled(2.0),
        F::R16G16B16A16_UNORM => scaled(1.0 / 257.0),
        F::A2B10G10R10_UNORM_PACK32 => scaled(0.25),
        F::B10G11R11_UFLOAT_PACK32 => scaled(0.125),
        F::R5G6B5_UNORM_PACK16 => Rgb([2, 1, 0].map(|index| (4.0 * value(index)) as u8)),
        F::D16_UNORM => grey(value(0) / 65535.0),
        F::X8_D24_UNORM_PACK32 => grey(value(0) / 16_777_215.0),
        F::D32_SFLOAT => grey(value(0)),
        F::S8_UINT | F::R8_UINT => Rgb([(16.0 * value(0)) as u8; 3]),
        _ if format!("{format:?}").contains("INT") => {
            let hash = (value(0) as i64 as u32).wrapping_mul(0x9e37_79b9);
            let [r, g, b, _] = hash.to_le_bytes();
            Rgb([r, g, b])
        }
        _ => scaled(255.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(format: vk::Format, bytes: &[u8]) -> Picture {
        Picture {
            name: "color 0".to_owned(),
            format,
            size: [bytes.len() as u32 / texel_size(format), 1],
            bytes: bytes.to_vec(),
        }
    }

    fn differing(format: vk::Format, first: &[u8], second: &[u8]) -> usize {
        difference(&picture(format, first), &picture(format, second)).map_or(0, |d| d.texels)
    }

    #[test]
    fn eight_bits_may_differ_by_one() {
        let format = vk::Format::R8G8B8A8_UNORM;
        assert_eq!(differing(format, &[1, 2, 3, 4], &[2, 1, 4, 3]), 0);
        assert_eq!(differing(format, &[1, 2, 3, 4], &[1, 2, 3, 6]), 1);
        assert_eq!(differing(vk::Format::R8G8B8A8_SRGB, &[3; 4], &[5; 4]), 0);
        assert_eq!(differing(vk::Format::R8G8B8A8_SRGB, &[3; 4], &[6; 4]), 1);
        assert_eq!(differing(vk::Format::R8G8B8A8_SNORM, &[255; 4], &[0; 4]), 0);
    }

    #[test]
    fn integers_may_not_differ() {
        assert_eq!(differing(vk::Format::S8_UINT, &[1, 2, 3], &[1, 3, 3]), 1);
        let words = |words: [u32; 2]| words.map(u32::to_le_bytes).concat();
        let format = vk::Format::R32_UINT;
        let (first, second) = (words([7, 1 << 31]), words([7, (1 << 31) + 1]));
        assert_eq!(differing(format, &first, &second), 1);
    }

    #[test]
    fn floats_and_depths_have_limits() {
        let floats = |floats: [f32; 3]| floats.map(f32::to_le_bytes).concat();
        let count = |format, first, second| differing(format, &floats(first), &floats(second));
        let depth = vk::Format::D32_SFLOAT;
        assert_eq!(count(depth, [0.5; 3], [0.500_000_9, 0.5, 0.500_002]), 1);
        let float = vk::Format::R32_SFLOAT;
        assert_eq!(count(float, [f32::NAN; 3], [f32::NAN, 0.0, f32::NAN]), 1);
        assert_eq!(count(float, [1e6; 3], [1.000_01e6, 1e6, 1.001e6]), 1);
        assert_eq!(differing(vk::Format::D16_UNORM, &[5, 1], &[7, 1]), 0);
        assert_eq!(differing(vk::Format::D16_UNORM, &[5, 1], &[8, 1]), 1);
    }

    #[test]
    fn packed_fields_are_compared_one_by_one() {
        let format = vk::Format::A2B10G10R10_UNORM_PACK32;
        let word = |word: u32| word.to_le_bytes();
        assert_eq!(differing(format, &word(0x3ff), &word(0x3fe)), 0);
        assert_eq!(differing(format, &word(0x3ff), &word(0x400)), 1);
    }

    #[test]
    fn panels_are_written_for_what_differs() {
        let format = vk::Format::R8G8B8A8_UNORM;
        let output = |bytes: &[u8]| Output { pictures: vec![picture(format, bytes)] };
        let (ours, theirs) = (output(&[9; 8]), output(&[9, 9, 9, 9, 0, 9, 9, 9]));
        let differences = differences(&ours, &theirs);
        let folder = tempfile::tempdir().unwrap();
        let paths = write_differences(folder.path(), &ours, &theirs, &differences).unwrap();
        let image = image::open(&paths[0]).unwrap().into_rgb8();
        assert_eq!(image.dimensions(), (6, 1));
        assert_eq!(image.get_pixel(4, 0).0, [0; 3]);
        assert_eq!(image.get_pixel(5, 0).0, [255, 0, 0]);
    }
}
