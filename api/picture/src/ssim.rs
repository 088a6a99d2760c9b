//! SSIM: the structural similarity of two images.
//!
//! Wang, Bovik, Sheikh, Simoncelli, "Image Quality Assessment: From Error Visibility to Structural Similarity", 2004,
//! with a Gaussian window of 11x11, a standard deviation of 1.5, constants 0.01 and 0.03, and the mean over pixels and
//! channels. Programs differ in what they do at the border.

use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch, f64x8, prelude::*};
use rayon::prelude::*;

use crate::tiles::{Filter, Form, Tile, sum, tiles};

/// Half the window's width.
const RADIUS: usize = 5;
/// The window's standard deviation.
const SIGMA: f64 = 1.5;
/// The square of the first constant times the range, which is 1.
const C1: f64 = 0.01 * 0.01;
/// The square of the second constant times the range.
const C2: f64 = 0.03 * 0.03;

/// Mean SSIM of red, green and blue, each at most 1, which is the value of equal images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ssim {
    /// Over all pixels, with zeros beyond the border, as `metrics.py` of the original 3DGS code computes it.
    pub inria: f64,
    /// Over all pixels, with the image reflected at its border, as torchmetrics (which gsplat uses) computes it from version 1.4
    /// on. None if a side has no pixels to be reflected, at most 5.
    pub torchmetrics: Option<f64>,
    /// Over the pixels whose window lies in the image, as pytorch-msssim (which nerfstudio uses) and older torchmetrics compute
    /// it. None if there is no such pixel.
    pub valid: Option<f64>,
}

/// The values beyond an image's border.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Border {
    /// Zeros.
    Zeros,
    /// The image reflected at its outermost pixels, which are not repeated.
    Reflection,
}

impl Ssim {
    /// Compares two images with `width` pixels in a row.
    ///
    /// # Panics
    /// Panics if the sizes differ.
    pub fn new(image: &[[f32; 4]], reference: &[[f32; 4]], width: u32) -> Self {
        assert_eq!(image.len(), reference.len(), "the sizes differ");
        if image.is_empty() {
            return Self { inria: 1.0, torchmetrics: None, valid: None };
        }
        let width = width as usize;
        let (height, filter) = (image.len() / width, Filter { form: Form::Even, weights: window()[RADIUS..].to_vec() });
        let level = Level::new();
        let sums = |tiles: Vec<Tile>, border: Border| {
            let of_tile = |memory: &mut Memory, tile: Tile| {
                let images = Images { a: image, b: reference, width, height };
                dispatch!(level, simd => memory.sums(simd, images, tile, &filter, border))
            };
            let sums: Vec<Sums> = tiles.into_par_iter().map_init(Memory::default, of_tile).collect();
            // Summed in the order of the tiles, so that threads change nothing.
            sums.iter()
                .fold(Sums::default(), |sum, one| Sums { all: sum.all + one.all, inside: sum.inside + one.inside })
        };
        let zeros = sums(tiles(width, height), Border::Zeros);
        let count = width.saturating_sub(2 * RADIUS) * height.saturating_sub(2 * RADIUS);
        let mean = |sum: f64, pixels: usize| sum / (3 * pixels) as f64;
        let torchmetrics = (width.min(height) > RADIUS).then(|| {
            let reflected = if count > 0 { edges(width, height) } else { tiles(width, height) };
            mean(zeros.inside + sums(reflected, Border::Reflection).all, image.len())
        });
        Self {
            inria: mean(zeros.all, image.len()),
            torchmetrics,
            valid: (count > 0).then(|| mean(zeros.inside, count)),
        }
    }
}

/// The pixels of an image whose window does not lie in it, as tiles. Both sides are longer than twice the radius.
fn edges(width: usize, height: usize) -> Vec<Tile> {
    let rows = height - 2 * RADIUS;
    vec![
        Tile { left: 0, top: 0, width, height: RADIUS },
        Tile { left: 0, top: RADIUS, width: RADIUS, height: rows },
        Tile { left: width - RADIUS, top: RADIUS, width: RADIUS, height: rows },
        Tile { left: 0, top: height - RADIUS, width, height: RADIUS },
    ]
}

/// Sums of a tile's values of three channels.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    all: f64,
    /// Of the pixels whose window lies in the image.
    inside: f64,
}

/// The part of a tile's rows or columns whose windows lie in an image of `side` rows or columns.
fn inside(first: usize, count: usize, side: usize) -> Range<usize> {
    let end = side.saturating_sub(RADIUS).saturating_sub(first).min(count);
    RADIUS.saturating_sub(first).min(end)..end
}

/// Two images of one size.
#[derive(Clone, Copy, Debug)]
struct Images<'a> {
    a: &'a [[f32; 4]],
    b: &'a [[f32; 4]],
    width: usize,
    height: usize,
}

/// The memory of a thread, used again for each tile.
#[derive(Debug, Default)]
struct Memory {
    /// Of a channel of a tile and its border: both images, their product, and the sum of their squares.
    planes: [Vec<f64>; 4],
    /// A row of a plane, filtered along columns.
    down: Vec<f64>,
    /// A row of each plane, filtered along both.
    filtered: [Vec<f64>; 4],
    /// The values of a row's pixels.
    values: Vec<f64>,
}

impl Memory {
    /// The sums of a tile.
    #[inline(always)]
    fn sums<S: Simd>(&mut self, simd: S, images: Images<'_>, tile: Tile, filter: &Filter<f64>, border: Border) -> Sums {
        simd.vectorize(
            #[inline(always)]
            || {
                let (stride, columns) = (tile.stride(RADIUS), tile.columns());
                for plane in &mut self.planes {
                    plane.resize(stride * tile.rows(RADIUS), 0.0);
                }
                self.down.resize(stride, 0.0);
                for row in self.filtered.iter_mut().chain([&mut self.values]) {
                    row.resize(columns, 0.0);
                }
                let inner_rows = inside(tile.top, tile.height, images.height);
                let inner_columns = inside(tile.left, tile.width, images.width);
                let mut sums = Sums::default();
                for channel in 0..3 {
                    for row in 0..tile.rows(RADIUS) {
                        // A row is taken when it is first needed, and is still in a cache when it is filtered.
                        self.take_row(simd, images, tile, row, channel, border);
                        let Some(row) = row.checked_sub(2 * RADIUS) else { continue };
                        for (plane, filtered) in self.planes.iter().zip(&mut self.filtered) {
                            filter.correlate(simd, plane, (row + RADIUS) * stride, stride, &mut self.down);
                            filter.correlate(simd, &self.down, RADIUS, 1, filtered);
                        }
                        self.compute_values(simd);
                        sums.all += sum(&self.values[..tile.width]);
                        if inner_rows.contains(&row) {
                            sums.inside += sum(&self.values[inner_columns.clone()]);
                        }
                    }
                }
                sums
            },
        )
    }

    /// Fills a row of the planes with a channel of the images.
    #[inline(always)]
    fn take_row<S: Simd>(
        &mut self,
        simd: S,
        images: Images<'_>,
        tile: Tile,
        row: usize,
        channel: usize,
        border: Border,
    ) {
        let stride = tile.stride(RADIUS);
        let [a, b, both, squares] = self.planes.each_mut().map(|plane| &mut plane[row * stride..][..stride]);
        let y = (tile.top + row) as isize - RADIUS as isize;
        let y = if border == Border::Reflection { reflected(y, images.height) } else { y };
        for (values, image) in [(&mut *a, images.a), (&mut *b, images.b)] {
            if (0..images.height as isize).contains(&y) {
                take_channel(&image[y as usize * images.width..][..images.width], tile, channel, border, values);
            } else {
                values.fill(0.0);
            }
        }
        let [a, b] = [&*a, &*b].map(|values| values.chunks_exact(8));
        let [both, squares] = [both, squares].map(|values| values.chunks_exact_mut(8));
        for ((a, b), (both, squares)) in a.zip(b).zip(both.zip(squares)) {
            let (a, b) = (f64x8::from_slice(simd, a), f64x8::from_slice(simd, b));
            (a * b).store_slice(both);
            (a * a + b * b).store_slice(squares);
        }
    }

    /// Computes the values of a row's pixels from what is filtered.
    #[inline(always)]
    fn compute_values<S: Simd>(&mut self, simd: S) {
        let [mean_a, mean_b, both, squares] = self.filtered.each_ref().map(|row| row.chunks_exact(8));
        let means = mean_a.zip(mean_b);
        for (value, ((x, y), (both, squares))) in self.values.chunks_exact_mut(8).zip(means.zip(both.zip(squares))) {
            let (x, y) = (f64x8::from_slice(simd, x), f64x8::from_slice(simd, y));
            let product = x * y;
            let of_means = x * x + y * y;
            let covariance = f64x8::from_slice(simd, both) - product;
            let variances = f64x8::from_slice(simd, squares) - of_means;
            let similar = (product * 2.0 + C1) * (covariance * 2.0 + C2);
            (similar / ((of_means + C1) * (variances + C2))).store_slice(value);
        }
    }
}

/// Fills a row of a plane with a channel of a row of an image.
#[inline(always)]
fn take_channel(pixels: &[[f32; 4]], tile: Tile, channel: usize, border: Border, values: &mut [f64]) {
    // The columns of the plane whose pixels are in the image.
    let first = RADIUS.saturating_sub(tile.left);
    let of_image = &pixels[tile.left + first - RADIUS..];
    let end = values.len().min(first + of_image.len());
    for (value, pixel) in values[first..end].iter_mut().zip(of_image) {
        *value = f64::from(pixel[channel]);
    }
    for column in (0..first).chain(end..values.len()) {
        let x = (tile.left + column) as isize - RADIUS as isize;
        let at = pixels.get(reflected(x, pixels.len()) as usize).filter(|_| border == Border::Reflection);
        values[column] = at.map_or(0.0, |pixel| f64::from(pixel[channel]));
    }
}

/// A coordinate reflected at the outermost ones of an image of `side` pixels, if it lies beyond.
#[inline(always)]
fn reflected(at: isize, side: usize) -> isize {
    let last = side as isize - 1;
    let at = at.abs();
    if at > last { 2 * last - at } else { at }
}

fn window() -> [f64; 2 * RADIUS + 1] {
    let weights: [f64; 2 * RADIUS + 1] = std::array::from_fn(|i| {
        let x = i as f64 - RADIUS as f64;
        (-x * x / (2.0 * SIGMA * SIGMA)).exp()
    });
    let sum: f64 = weights.iter().sum();
    weights.map(|weight| weight / sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Correlates rows, then columns.
    fn filtered(values: &[f64], width: usize, window: &[f64], border: Border) -> Vec<f64> {
        let height = values.len() / width;
        let correlate = |at: usize, count: usize, value: &dyn Fn(usize) -> f64| {
            let taps = window.iter().enumerate();
            taps.filter_map(|(i, weight)| {
                let position = match border {
                    Border::Zeros => (at + i).checked_sub(RADIUS).filter(|p| *p < count)?,
                    Border::Reflection if at + i < RADIUS => RADIUS - at - i,
                    Border::Reflection if at + i - RADIUS >= count => 2 * (count - 1) - (at + i - RADIUS),
                    Border::Reflection => at + i - RADIUS,
                };
                Some(weight * value(position))
            })
            .sum::<f64>()
        };
        let rows: Vec<f64> = (0..values.len())
            .map(|i| {
                let row = &values[i / width * width..][..width];
                correlate(i % width, width, &|x| row[x])
            })
            .collect();
        (0..values.len()).map(|i| correlate(i / width, height, &|y| rows[y * width + i % width])).collect()
    }

    /// A channel's values, one pixel after the other.
    fn channel_values(a: &[f64], b: &[f64], width: usize, border: Border) -> Vec<f64> {
        let window = window();
        let product = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a * b).collect() };
        let smooth = |values: &[f64]| filtered(values, width, &window, border);
        let (mean_a, mean_b) = (smooth(a), smooth(b));
        let (square_a, square_b) = (smooth(&product(a, a)), smooth(&product(b, b)));
        let both = smooth(&product(a, b));
        (0..a.len())
            .map(|i| {
                let (x, y) = (mean_a[i], mean_b[i]);
                let covariance = both[i] - x * y;
                let variances = square_a[i] - x * x + square_b[i] - y * y;
                (2.0 * x * y + C1) * (2.0 * covariance + C2) / ((x * x + y * y + C1) * (variances + C2))
            })
            .collect()
    }

    #[test]
    fn values_are_those_of_the_naive_form() {
        // More than a tile wide and high.
        let (width, height) = (300, 150);
        let image = |seed: usize| -> Vec<[f32; 4]> {
            let pixel = |i: usize| [i * seed % 97, i * 7 % 89, (i / width) * seed % 83, 96].map(|c| c as f32 / 96.0);
            (0..width * height).map(pixel).collect()
        };
        let (a, b) = (image(31), image(37));
        let plane =
            |image: &[[f32; 4]], channel: usize| -> Vec<f64> { image.iter().map(|p| p[channel].into()).collect() };
        let values_of = |border: Border| -> Vec<Vec<f64>> {
            (0..3).map(|channel| channel_values(&plane(&a, channel), &plane(&b, channel), width, border)).collect()
        };
        let values = values_of(Border::Zeros);
        let expected = values.iter().flatten().sum::<f64>() / (3 * width * height) as f64;
        let found = Ssim::new(&a, &b, width as u32);
        assert!((found.inria - expected).abs() < 1e-12, "{found:?} {expected}");
        let is_inside = |at: &usize| (5..width - 5).contains(&(at % width)) && (5..height - 5).contains(&(at / width));
        let inside =
            (0..width * height).filter(is_inside).map(|at| values.iter().map(|values| values[at]).sum::<f64>());
        let expected = inside.sum::<f64>() / (3 * (width - 10) * (height - 10)) as f64;
        let valid = found.valid.expect("windows fit");
        assert!((valid - expected).abs() < 1e-12, "{found:?} {expected}");
        let reflected = values_of(Border::Reflection);
        let expected = reflected.iter().flatten().sum::<f64>() / (3 * width * height) as f64;
        let torchmetrics = found.torchmetrics.expect("pixels to be reflected");
        assert!((torchmetrics - expected).abs() < 1e-12, "{found:?} {expected}");
        // A picture in which no window lies.
        let (a, b) = (&a[..7 * 9], &b[..7 * 9]);
        let values = channel_values(&plane(a, 0), &plane(b, 0), 7, Border::Reflection).into_iter();
        let values = values.chain(channel_values(&plane(a, 1), &plane(b, 1), 7, Border::Reflection));
        let values = values.chain(channel_values(&plane(a, 2), &plane(b, 2), 7, Border::Reflection));
        let expected = values.sum::<f64>() / (3.0 * 7.0 * 9.0);
        let torchmetrics = Ssim::new(a, b, 7).torchmetrics.expect("pixels to be reflected");
        assert!((torchmetrics - expected).abs() < 1e-12, "{torchmetrics} {expected}");
    }

    #[test]
    fn an_image_in_which_no_window_fits_has_fewer_values() {
        let image = grey(|i| i as f32 / 120.0, 10 * 12);
        assert_eq!(Ssim::new(&image, &image, 10), Ssim { inria: 1.0, torchmetrics: Some(1.0), valid: None });
        assert_eq!(Ssim::new(&image, &image, 12).valid, None);
        assert_eq!(Ssim::new(&image, &image, 24), Ssim { inria: 1.0, torchmetrics: None, valid: None });
        let image = grey(|i| i as f32 / 121.0, 11 * 11);
        assert_eq!(Ssim::new(&image, &image, 11), Ssim { inria: 1.0, torchmetrics: Some(1.0), valid: Some(1.0) });
    }

    fn grey(value: impl Fn(usize) -> f32, count: usize) -> Vec<[f32; 4]> {
        (0..count).map(|i| [value(i), value(i), value(i), 1.0]).collect()
    }

    fn inria(image: &[[f32; 4]], reference: &[[f32; 4]], width: u32) -> f64 {
        Ssim::new(image, reference, width).inria
    }

    #[test]
    fn equal_images_are_alike_and_noise_is_not() {
        let ramp = grey(|i| (i % 32) as f32 / 31.0, 32 * 24);
        assert!((inria(&ramp, &ramp, 32) - 1.0).abs() < 1e-12);
        let noise = grey(|i| (i * 7919 % 101) as f32 / 100.0, 32 * 24);
        let alike = inria(&ramp, &noise, 32);
        assert!(alike < 0.3, "{alike}");
        assert!((alike - inria(&noise, &ramp, 32)).abs() < 1e-12);
    }

    #[test]
    fn flat_images_follow_the_formula() {
        // Far from the border there is no variance: a pixel's value is (2xy + C1) / (x^2 + y^2 + C1). A single pixel
        // has the window's centre as its weight.
        let (a, b) = (grey(|_| 0.25, 1), grey(|_| 0.75, 1));
        let weight = window()[RADIUS].powi(2);
        let (x, y) = (0.25 * weight, 0.75 * weight);
        let variance = |p: f64, q: f64| weight * p * q - (weight * p) * (weight * q);
        let expected = (2.0 * x * y + C1) * (2.0 * variance(0.25, 0.75) + C2)
            / ((x * x + y * y + C1) * (variance(0.25, 0.25) + variance(0.75, 0.75) + C2));
        assert!((inria(&a, &b, 1) - expected).abs() < 1e-12);
    }
}
