//! Measures of the difference of two pictures, which `gaurast compare` and `gaurast eval` share.

use gaurast_picture::{Picture, Ssim, Statistics};
use serde::{Deserialize, Serialize};

/// The measures of a picture against a reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measures {
    /// In dB, over red, green and blue, the peak being 1. None, as in JSON, is infinity: the pictures are equal.
    pub psnr: Option<f64>,
    /// As `metrics.py` of 3DGS computes it.
    pub ssim: f64,
    /// As torchmetrics computes it; none if a side is shorter than 6 pixels.
    pub ssim_torchmetrics: Option<f64>,
    /// As pytorch-msssim computes it; none if the picture is smaller than its window.
    pub ssim_valid: Option<f64>,
    /// The mean FLIP error, 0 to 1.
    pub flip: f64,
    /// The largest difference of a channel, 0 to 1.
    pub largest: f64,
    pub equal: bool,
}

impl Measures {
    /// Compares two pictures of one size, as [`shown`].
    pub fn of(picture: &Picture, reference: &Picture) -> Self {
        let (pixels, of_reference, width) = (&picture.pixels, &reference.pixels, picture.width);
        let Statistics { psnr, flip, max, .. } = Statistics::new(pixels, of_reference, width);
        let Ssim { inria, torchmetrics, valid } = Ssim::new(pixels, of_reference, width);
        Self {
            psnr: psnr.is_finite().then_some(psnr),
            ssim: inria,
            ssim_torchmetrics: torchmetrics,
            ssim_valid: valid,
            flip,
            largest: max,
            equal: max == 0.0,
        }
    }

    /// The PSNR, which may be infinite.
    pub fn decibels(&self) -> f64 {
        self.psnr.unwrap_or(f64::INFINITY)
    }
}

/// Means over pictures, each with the same weight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Means {
    /// None if a picture's is infinite.
    pub psnr: Option<f64>,
    pub ssim: f64,
    pub ssim_torchmetrics: Option<f64>,
    pub ssim_valid: Option<f64>,
    pub flip: f64,
    /// The number of equal pictures.
    pub equal: usize,
}

impl Means {
    /// The means over `all`, of which there is at least one.
    pub fn of<'a>(all: impl Iterator<Item = &'a Measures> + Clone) -> Self {
        let count = all.clone().count().max(1) as f64;
        let mean = |value: &dyn Fn(&Measures) -> f64| all.clone().map(value).sum::<f64>() / count;
        let finite = |value: f64| value.is_finite().then_some(value);
        Self {
            psnr: finite(mean(&Measures::decibels)),
            ssim: mean(&|one| one.ssim),
            ssim_torchmetrics: finite(mean(&|one| one.ssim_torchmetrics.unwrap_or(f64::NAN))),
            ssim_valid: finite(mean(&|one| one.ssim_valid.unwrap_or(f64::NAN))),
            flip: mean(&|one| one.flip),
            equal: all.clone().filter(|one| one.equal).count(),
        }
    }

    /// The mean PSNR, which may be infinite.
    pub fn decibels(&self) -> f64 {
        self.psnr.unwrap_or(f64::INFINITY)
    }
}

/// The picture as a screen displays it: over the background, each channel 0 to 1. Large pictures are changed where they are.
pub fn shown(picture: Picture, background: [f32; 3]) -> Picture {
    let mut picture = picture.over(background);
    for channel in picture.pixels.as_flattened_mut() {
        *channel = if channel.is_nan() { 0.0 } else { channel.clamp(0.0, 1.0) };
    }
    picture
}

/// The picture after rounding to eight bits, as in a file.
pub fn in_eight_bits(mut picture: Picture) -> Picture {
    for value in picture.pixels.as_flattened_mut() {
        *value = libm::roundf(255.0 * value.clamp(0.0, 1.0)) / 255.0;
    }
    picture
}

/// The absolute differences of two pictures of one size, scaled so that `largest` is white.
pub fn difference(a: &Picture, b: &Picture, largest: f64) -> Picture {
    let scale = 1.0 / (largest as f32).max(f32::MIN_POSITIVE);
    let pixel = |(a, b): (&[f32; 4], &[f32; 4])| {
        let channel = |c: usize| (a[c] - b[c]).abs() * scale;
        [channel(0), channel(1), channel(2), 1.0]
    };
    Picture { width: a.width, height: a.height, pixels: a.pixels.iter().zip(&b.pixels).map(pixel).collect() }
}
