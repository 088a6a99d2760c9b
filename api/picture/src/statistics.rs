//! Statistics of the differences between two pictures.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
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
        let count = image.len();
        // The value that a share of 0.999 does not exceed is the least of these.
        let rank = (0.999 * count as f64).ceil() as usize;
        let mut largest = Largest::new(count - rank.saturating_sub(1).min(count));
        let (mut max, mut squares) = (0.0_f64, 0.0);
        for (a, b) in image.iter().zip(reference) {
            let differences: [f64; 4] = std::array::from_fn(|c| (f64::from(a[c]) - f64::from(b[c])).abs());
            let worst = differences.into_iter().fold(0.0, f64::max);
            max = max.max(worst);
            largest.add(worst);
            for difference in &differences[..3] {
                squares += difference * difference;
            }
        }
        let mean_square = squares / (3 * count) as f64;
        Self {
            max,
            p999: largest.least(),
            psnr: -10.0 * mean_square.log10(),
            flip: flip::mean(reference, image, width, flip::DEFAULT_PIXELS_PER_DEGREE),
        }
    }
}

impl fmt::Display for Statistics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "max {:.2e}, p99.9 {:.2e}, PSNR {:.1} dB, FLIP {:.5}", self.max, self.p999, self.psnr, self.flip)
    }
}

/// The largest of the numbers that are added, none of which is negative.
struct Largest {
    count: usize,
    /// Their bits, which are in the order of the numbers, the least first.
    bits: BinaryHeap<Reverse<u64>>,
    /// The bits of the least of them if there are `count`.
    least: Option<u64>,
}

impl Largest {
    /// Of none yet, with so many to keep.
    fn new(count: usize) -> Self {
        Self { count, bits: BinaryHeap::new(), least: None }
    }

    fn add(&mut self, value: f64) {
        let bits = value.to_bits();
        // Most numbers are none of the largest.
        if self.least.is_none_or(|least| bits > least) {
            self.keep(bits);
        }
    }

    #[cold]
    fn keep(&mut self, bits: u64) {
        if self.least.is_some() {
            self.bits.pop();
        }
        if self.count > 0 {
            self.bits.push(Reverse(bits));
        }
        self.least = self.bits.peek().map(|least| least.0).filter(|_| self.bits.len() == self.count);
    }

    /// The least of them; 0 if there are none.
    fn least(&self) -> f64 {
        self.bits.peek().map_or(0.0, |least| f64::from_bits(least.0))
    }
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
