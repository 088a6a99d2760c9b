//! Statistics of the differences between two pictures.

use std::fmt;

use crate::flip;

/// Differences between an image and a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// The greatest absolute difference of any of the four channels.
    pub max: f64,
    /// The 99.9th percentile, over the pixels, of each pixel's greatest difference.
    pub p999: f64,
    /// Peak signal-to-noise ratio in dB over red, green and blue, the peak being 1; infinite for
    /// equal images.
    pub psnr: f64,
    /// Mean FLIP error of red, green and blue, taken as sRGB, 0 to 1.
    pub flip: f64,
}

impl Statistics {
    /// Compares two images with `width` pixels in a row.
    pub fn new(image: &[[f32; 4]], reference: &[[f32; 4]], width: u32) -> Self {
        assert_eq!(image.len(), reference.len(), "the sizes differ");
        let differences = || {
            image
                .iter()
                .zip(reference)
                .map(|(a, b)| std::array::from_fn::<f64, 4, _>(|c| (f64::from(a[c]) - f64::from(b[c])).abs()))
        };
        let mut worst: Vec<f64> = differences().map(|d| d.into_iter().fold(0.0, f64::max)).collect();
        worst.sort_by(f64::total_cmp);
        let squares: f64 = differences().flat_map(|d| [d[0], d[1], d[2]]).map(|d| d * d).sum();
        let mean_square = squares / (3 * image.len()) as f64;
        let errors = flip::flip(&opaque(reference), &opaque(image), width, flip::DEFAULT_PIXELS_PER_DEGREE);
        Self {
            max: worst.last().copied().unwrap_or(0.0),
            p999: percentile(&worst, 0.999),
            psnr: -10.0 * mean_square.log10(),
            flip: errors.iter().sum::<f64>() / errors.len() as f64,
        }
    }
}

impl fmt::Display for Statistics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "max {:.2e}, p99.9 {:.2e}, PSNR {:.1} dB, FLIP {:.5}", self.max, self.p999, self.psnr, self.flip)
    }
}

/// The value that a `share` of the ascending `values` does not exceed; 0 if there are none.
fn percentile(values: &[f64], share: f64) -> f64 {
    let rank = (share * values.len() as f64).ceil() as usize;
    values.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
}

fn opaque(image: &[[f32; 4]]) -> Vec<[f32; 3]> {
    image.iter().map(|&[r, g, b, _]| [r, g, b]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_images_differ_by_nothing() {
        let image = vec![[0.1, 0.2, 0.3, 0.4]; 64];
        let statistics = Statistics::new(&image, &image, 8);
        assert_eq!((statistics.max, statistics.p999, statistics.flip), (0.0, 0.0, 0.0));
        assert_eq!(statistics.psnr, f64::INFINITY);
    }

    #[test]
    fn known_differences() {
        let reference = vec![[0.5; 4]; 2000];
        let mut image = reference.clone();
        // Two of 2000 pixels are the 99.9th percentile; one more exceeds it.
        image[0] = [0.75, 0.5, 0.5, 0.5];
        image[1] = [0.5, 0.5, 0.5, 0.625];
        image[2] = [0.5, 0.625, 0.5, 0.5];
        let statistics = Statistics::new(&image, &reference, 50);
        assert_eq!(statistics.max, 0.25);
        assert_eq!(statistics.p999, 0.125);
        let mean_square: f64 = (0.0625 + 0.015625) / 6000.0;
        assert!((statistics.psnr + 10.0 * mean_square.log10()).abs() < 1e-12);
        assert!(statistics.flip > 0.0);
    }
}
