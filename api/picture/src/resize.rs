//! Pictures in another size, to the bit as PIL's `Image.resize` makes them by default: bicubic, in eight bits. Trainers of
//! 3DGS make photographs smaller by it.

use rayon::prelude::*;

use crate::picture::Picture;

/// The fractional bits of weights.
const PRECISION: u32 = 22;

/// The filter's reach on each side, in pixels of the smaller picture.
const SUPPORT: f64 = 2.0;

/// The sharpness of the bicubic filter.
const A: f64 = -0.5;

/// The picture in another size. Its values are rounded to eight bits.
pub fn resized(picture: &Picture, [width, height]: [u32; 2]) -> Picture {
    let bytes: Vec<[u8; 4]> = picture.pixels.iter().map(|pixel| pixel.map(byte)).collect();
    let old_width = picture.width as usize;
    // Rows first; an axis whose size stays is left as it is.
    let bytes = if width == picture.width { bytes } else { along_rows(&bytes, old_width, width as usize) };
    let bytes = if height == picture.height { bytes } else { along_columns(&bytes, width as usize, height as usize) };
    Picture { width, height, pixels: bytes.iter().map(|pixel| pixel.map(|byte| f32::from(byte) / 255.0)).collect() }
}

fn byte(value: f32) -> u8 {
    libm::roundf(255.0 * value.clamp(0.0, 1.0)) as u8
}

/// The pixels of a row or column that one new pixel is made of, and their weights.
struct Taps {
    first: usize,
    weights: Vec<i32>,
}

/// The taps of each of `new` pixels that are made of `old` ones.
fn taps(old: usize, new: usize) -> Vec<Taps> {
    let scale = old as f64 / new as f64;
    let stretch = scale.max(1.0);
    let support = SUPPORT * stretch;
    let tap = |at: usize| {
        let centre = (at as f64 + 0.5) * scale;
        let first = (centre - support + 0.5).max(0.0) as usize;
        let end = ((centre + support + 0.5) as usize).min(old);
        let weights: Vec<f64> = (first..end).map(|x| bicubic((x as f64 - centre + 0.5) * (1.0 / stretch))).collect();
        let sum: f64 = weights.iter().sum();
        let fixed = |weight: &f64| libm::round(weight / sum * f64::from(1 << PRECISION)) as i32;
        Taps { first, weights: weights.iter().map(fixed).collect() }
    };
    (0..new).map(tap).collect()
}

fn bicubic(x: f64) -> f64 {
    let x = x.abs();
    if x < 1.0 {
        ((A + 2.0) * x - (A + 3.0)) * x * x + 1.0
    } else if x < 2.0 {
        (((x - 5.0) * x + 8.0) * x - 4.0) * A
    } else {
        0.0
    }
}

/// The sum of weighted pixels.
fn sum<'a>(pixels: impl Iterator<Item = &'a [u8; 4]>, weights: &[i32]) -> [u8; 4] {
    let mut sums = [1_i32 << (PRECISION - 1); 4];
    for (pixel, weight) in pixels.zip(weights) {
        for (sum, byte) in sums.iter_mut().zip(pixel) {
            *sum += i32::from(*byte) * weight;
        }
    }
    sums.map(|sum| (sum >> PRECISION).clamp(0, 255) as u8)
}

fn along_rows(pixels: &[[u8; 4]], old: usize, new: usize) -> Vec<[u8; 4]> {
    let taps = taps(old, new);
    let row = |row: &[[u8; 4]]| -> Vec<[u8; 4]> {
        taps.iter().map(|taps| sum(row[taps.first..].iter(), &taps.weights)).collect()
    };
    pixels.par_chunks_exact(old).flat_map_iter(row).collect()
}

fn along_columns(pixels: &[[u8; 4]], width: usize, new: usize) -> Vec<[u8; 4]> {
    let row = |taps: &Taps| -> Vec<[u8; 4]> {
        let column = |x: usize| sum(pixels[taps.first * width + x..].iter().step_by(width), &taps.weights);
        (0..width).map(column).collect()
    };
    taps(pixels.len() / width, new).par_iter().flat_map_iter(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of 13x11 pixels with edges in both directions.
    fn pattern() -> Picture {
        let pixel = |at: u32| {
            let (x, y) = (at % 13, at / 13);
            let bytes = [(x * 37 + y * 11) % 256, (x * x * 5 + y * 29) % 256, if (x + y) % 3 == 0 { 255 } else { 0 }];
            let [r, g, b] = bytes.map(|byte| byte as f32 / 255.0);
            [r, g, b, 1.0]
        };
        Picture { width: 13, height: 11, pixels: (0..13 * 11).map(pixel).collect() }
    }

    /// Sums of the bytes of each channel, and of them times 1, 2, 3 and so on, modulo 65521.
    fn sums(picture: &Picture) -> [[u32; 2]; 3] {
        [0, 1, 2].map(|channel| {
            let bytes = picture.pixels.iter().map(|pixel| u32::from(byte(pixel[channel])));
            let (plain, weighted) = bytes
                .zip(1..)
                .fold((0, 0), |(plain, weighted), (byte, at)| (plain + byte, (weighted + byte * at) % 65_521));
            [plain, weighted]
        })
    }

    #[test]
    fn pictures_are_those_of_pil() {
        for (size, expected) in EXPECTED {
            assert_eq!(sums(&resized(&pattern(), size)), expected, "{size:?}");
        }
    }

    #[test]
    fn the_same_size_is_the_same_picture() {
        assert_eq!(resized(&pattern(), [13, 11]), pattern());
    }

    /// Pillow 13.0: `Image.resize(size)`.
    const EXPECTED: [([u32; 2], [[u32; 2]; 3]); 4] = [
        ([5, 4], [[2611, 28667], [2500, 27204], [1704, 17909]]),
        ([12, 11], [[16950, 47833], [16442, 11875], [12221, 21344]]),
        ([13, 3], [[5046, 39823], [4897, 36454], [3334, 1143]]),
        ([20, 17], [[43570, 37803], [42320, 15009], [31822, 22835]]),
    ];
}
