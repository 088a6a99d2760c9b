//! SSIM: the structural similarity of two images.
//!
//! Wang, Bovik, Sheikh, Simoncelli, "Image Quality Assessment: From Error Visibility to Structural Similarity", 2004,
//! as the original 3DGS code computes it: a Gaussian window of 11x11 with a standard deviation of 1.5, zeros beyond the
//! border, constants 0.01 and 0.03, the mean over pixels and channels.

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use crate::tiles::{Along, Filter, Form, Tile, tiles};

/// Half the window's width.
const RADIUS: usize = 5;
/// The window's standard deviation.
const SIGMA: f64 = 1.5;
/// The square of the first constant times the range, which is 1.
const C1: f64 = 0.01 * 0.01;
/// The square of the second constant times the range.
const C2: f64 = 0.03 * 0.03;

/// The mean SSIM of red, green and blue, at most 1, which is the value of equal images. Rows have `width` pixels.
///
/// # Panics
/// Panics if the sizes differ.
pub fn ssim(image: &[[f32; 4]], reference: &[[f32; 4]], width: u32) -> f64 {
    assert_eq!(image.len(), reference.len(), "the sizes differ");
    if image.is_empty() {
        return 1.0;
    }
    let width = width as usize;
    let (height, filter) = (image.len() / width, Filter { form: Form::Even, weights: window()[RADIUS..].to_vec() });
    let level = Level::new();
    let sum_of =
        |tile: Tile| dispatch!(level, simd => tile_sum(simd, image, reference, [width, height], tile, &filter));
    // Summed in the order of the tiles, so that threads change nothing.
    let sums: Vec<f64> = tiles(width, height).into_par_iter().map(sum_of).collect();
    sums.into_iter().sum::<f64>() / (3 * image.len()) as f64
}

/// The sum of a tile's values of three channels.
#[inline(always)]
fn tile_sum<S: Simd>(
    simd: S,
    a: &[[f32; 4]],
    b: &[[f32; 4]],
    [width, height]: [usize; 2],
    tile: Tile,
    filter: &Filter<f64>,
) -> f64 {
    simd.vectorize(
        #[inline(always)]
        || {
            let smooth = |plane: &[f64]| {
                let along_rows = filter.correlate(plane, tile, RADIUS, Along::Rows);
                filter.correlate(&along_rows, tile, RADIUS, Along::Columns)
            };
            let mut sum = 0.0;
            for channel in 0..3 {
                let plane = |image: &[[f32; 4]]| {
                    tile.bordered(RADIUS, |x, y| {
                        let inside = (0..width as isize).contains(&x) && (0..height as isize).contains(&y);
                        if inside { f64::from(image[y as usize * width + x as usize][channel]) } else { 0.0 }
                    })
                };
                let (a, b) = (plane(a), plane(b));
                let both: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a * b).collect();
                let squares: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a * a + b * b).collect();
                let (mean_a, mean_b) = (smooth(&a), smooth(&b));
                let (both, squares) = (smooth(&both), smooth(&squares));
                sum += tile.sum(|at| {
                    let (x, y) = (mean_a[at], mean_b[at]);
                    let covariance = both[at] - x * y;
                    let variances = squares[at] - (x * x + y * y);
                    (2.0 * x * y + C1) * (2.0 * covariance + C2) / ((x * x + y * y + C1) * (variances + C2))
                });
            }
            sum
        },
    )
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

    /// Correlates rows, then columns, with zeros beyond the border.
    fn filtered(values: &[f64], width: usize, window: &[f64]) -> Vec<f64> {
        let height = values.len() / width;
        let correlate = |at: usize, count: usize, value: &dyn Fn(usize) -> f64| {
            let taps = window.iter().enumerate();
            taps.filter_map(|(i, weight)| {
                let position = (at + i).checked_sub(RADIUS).filter(|p| *p < count)?;
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

    /// The sum of a channel's values, one pixel after the other.
    fn channel_sum(a: &[f64], b: &[f64], width: usize) -> f64 {
        let window = window();
        let product = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a * b).collect() };
        let smooth = |values: &[f64]| filtered(values, width, &window);
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
            .sum()
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
        let sums = (0..3).map(|channel| channel_sum(&plane(&a, channel), &plane(&b, channel), width));
        let expected = sums.sum::<f64>() / (3 * width * height) as f64;
        let found = ssim(&a, &b, width as u32);
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }

    fn grey(value: impl Fn(usize) -> f32, count: usize) -> Vec<[f32; 4]> {
        (0..count).map(|i| [value(i), value(i), value(i), 1.0]).collect()
    }

    #[test]
    fn equal_images_are_alike_and_noise_is_not() {
        let ramp = grey(|i| (i % 32) as f32 / 31.0, 32 * 24);
        assert!((ssim(&ramp, &ramp, 32) - 1.0).abs() < 1e-12);
        let noise = grey(|i| (i * 7919 % 101) as f32 / 100.0, 32 * 24);
        let alike = ssim(&ramp, &noise, 32);
        assert!(alike < 0.3, "{alike}");
        assert!((alike - ssim(&noise, &ramp, 32)).abs() < 1e-12);
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
        assert!((ssim(&a, &b, 1) - expected).abs() < 1e-12);
    }
}
