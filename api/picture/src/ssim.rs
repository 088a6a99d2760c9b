//! SSIM: the structural similarity of two images.
//!
//! Wang, Bovik, Sheikh, Simoncelli, "Image Quality Assessment: From Error Visibility to Structural Similarity", 2004,
//! as the original 3DGS code computes it: a Gaussian window of 11x11 with a standard deviation of 1.5, zeros beyond the
//! border, constants 0.01 and 0.03, the mean over pixels and channels.

use rayon::prelude::*;

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
    let sum: f64 = (0..3)
        .into_par_iter()
        .map(|channel| {
            let plane =
                |pixels: &[[f32; 4]]| -> Vec<f64> { pixels.iter().map(|pixel| pixel[channel].into()).collect() };
            channel_sum(&plane(image), &plane(reference), width)
        })
        .sum();
    sum / (3 * image.len()) as f64
}

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

fn window() -> [f64; 2 * RADIUS + 1] {
    let weights: [f64; 2 * RADIUS + 1] = std::array::from_fn(|i| {
        let x = i as f64 - RADIUS as f64;
        (-x * x / (2.0 * SIGMA * SIGMA)).exp()
    });
    let sum: f64 = weights.iter().sum();
    weights.map(|weight| weight / sum)
}

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

#[cfg(test)]
mod tests {
    use super::*;

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
