//! FLIP for low dynamic range: the visibility of differences when flipping between two images.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: A Difference Evaluator
//! for Alternating Images", HPG 2020, with the constants of the authors' implementation. Colours
//! are filtered by the eye's contrast sensitivity and compared in a Hunt-adjusted L*a*b* space;
//! edges and points that appear or vanish raise the error.
//!
//! All filters are separable (one is a sum of two that are); borders repeat the outermost pixel. As in the authors'
//! implementation, numbers are binary32. Tiles are filtered one by one, so that a large image needs little memory.

mod power;
#[cfg(test)]
mod reference;

use std::f64::consts::PI;

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use crate::tiles::{Along, Filter, Form, Tile, tiles};
use power::power;

/// The default pixels per degree of visual angle: a 0.7 m wide display of 3840 pixels seen from 0.7 m.
pub const DEFAULT_PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;

/// Exponent of the colour difference.
const QC: f64 = 0.7;
/// The share of the greatest colour difference that is mapped to the share [`PT`] of the error range.
const PC: f64 = 0.4;
/// The share of the error range; see [`PC`].
const PT: f64 = 0.95;
/// Width of the feature detector in degrees.
const W: f64 = 0.082;
/// White of standard illuminant D65.
const WHITE: [f64; 3] = [0.950428545, 1.0, 1.088900371];

/// The greatest colour difference, which is that from green to blue.
const GREATEST_DIFFERENCE: f64 = 203.301654592;

/// Weights below this do not change a sum.
const LEAST_WEIGHT: f64 = 1e-10;

/// The FLIP error, 0 to 1, of each pixel of `test`. Both images are sRGB, clamped to 0 to 1 here,
/// with `width` pixels a row; what a pixel has beyond red, green and blue is ignored.
pub fn flip<const N: usize>(reference: &[[f32; N]], test: &[[f32; N]], width: u32, pixels_per_degree: f64) -> Vec<f64> {
    let width = width as usize;
    let mut errors = vec![0.0; reference.len()];
    for (tile, of_tile) in by_tile(reference, test, width, pixels_per_degree, |_, errors| errors) {
        for row in 0..tile.height {
            for column in 0..tile.width {
                let error = of_tile[row * tile.columns() + column];
                errors[(tile.top + row) * width + tile.left + column] = error.into();
            }
        }
    }
    errors
}

/// The mean of [`flip`]'s errors.
pub fn mean<const N: usize>(reference: &[[f32; N]], test: &[[f32; N]], width: u32, pixels_per_degree: f64) -> f64 {
    let sum = |tile: Tile, errors: Vec<f32>| tile.sum(&errors, 0..tile.height, 0..tile.width);
    let sums = by_tile(reference, test, width as usize, pixels_per_degree, sum);
    sums.into_iter().map(|(_, sum)| sum).sum::<f64>() / reference.len() as f64
}

/// The tiles of two images, and what is made of their errors.
fn by_tile<const N: usize, T: Send>(
    reference: &[[f32; N]],
    test: &[[f32; N]],
    width: usize,
    pixels_per_degree: f64,
    made: impl Fn(Tile, Vec<f32>) -> T + Sync,
) -> Vec<(Tile, T)> {
    assert_eq!(reference.len(), test.len(), "the sizes differ");
    if reference.is_empty() {
        return Vec::new();
    }
    let vision = Vision::new(pixels_per_degree);
    let level = Level::new();
    let error = |tile: Tile| {
        let errors = dispatch!(level, simd => vision.errors(simd, reference, test, width, tile));
        (tile, made(tile, errors))
    };
    tiles(width, reference.len() / width).into_par_iter().map(error).collect()
}

/// The filters of human vision.
struct Vision {
    /// The width of the border that they need.
    border: usize,
    /// Contrast sensitivities of the achromatic, the red-green and the blue-yellow channel: sums of weighted filters.
    sensitivities: [Vec<(f32, Filter<f32>)>; 3],
    /// The detectors of edges and of points, and what smooths along them.
    edge: Filter<f32>,
    point: Filter<f32>,
    smooth: Filter<f32>,
    /// The linear values of sRGB's 256 steps.
    linear: Vec<f64>,
}

/// A tile of an image as it is seen.
struct Perceived {
    /// Filtered colour in Hunt-adjusted L*a*b*.
    color: [Vec<f32>; 3],
    /// Strength of edges, per pixel.
    edges: Vec<f32>,
    /// Strength of points, per pixel.
    points: Vec<f32>,
}

impl Vision {
    fn new(ppd: f64) -> Self {
        // The widest of all channels' terms has b = 0.04 and sets the radius of each filter.
        let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * ppd).ceil();
        // Sums of Gaussians `a sqrt(pi / b) exp(-pi^2 r^2 / b)`, r in degrees, scaled so that their weights add up to 1.
        let sensitivity = |terms: &[(f64, f64)]| {
            let term = |&(a, b): &(f64, f64)| {
                let kernel = sample(radius, |x| (-(PI * x / ppd).powi(2) / b).exp());
                let sum: f64 = kernel.iter().sum();
                (a * (PI / b).sqrt() * sum * sum, filter(Form::Even, &normalised(kernel)))
            };
            let terms: Vec<_> = terms.iter().map(term).collect();
            let total: f64 = terms.iter().map(|(weight, _)| weight).sum();
            terms.into_iter().map(|(weight, filter)| ((weight / total) as f32, filter)).collect()
        };
        let sigma = 0.5 * W * ppd;
        let of_features = |f: &dyn Fn(f64) -> f64| sample((3.0 * sigma).ceil(), |x| f(x) * gaussian(x, sigma));
        Self {
            border: radius.max((3.0 * sigma).ceil()) as usize,
            sensitivities: [
                sensitivity(&[(1.0, 0.0047)]),
                sensitivity(&[(1.0, 0.0053)]),
                sensitivity(&[(34.1, 0.04), (13.5, 0.025)]),
            ],
            edge: filter(Form::Odd, &balanced(of_features(&|x| -x))),
            point: filter(Form::Balanced, &balanced(of_features(&|x| x * x / (sigma * sigma) - 1.0))),
            smooth: filter(Form::Even, &normalised(of_features(&|_| 1.0))),
            linear: (0..=255u8).map(|step| srgb_to_linear(f32::from(step) / 255.0)).collect(),
        }
    }

    /// The errors of a tile's pixels, in a plane of its columns.
    #[inline(always)]
    fn errors<S: Simd, const N: usize>(
        &self,
        simd: S,
        reference: &[[f32; N]],
        test: &[[f32; N]],
        width: usize,
        tile: Tile,
    ) -> Vec<f32> {
        simd.vectorize(
            #[inline(always)]
            || {
                let (reference, test) = (self.perceived(reference, width, tile), self.perceived(test, width, tile));
                let mut errors = vec![0.0; reference.edges.len()];
                for (at, value) in errors.iter_mut().enumerate() {
                    *value = error(&reference, &test, at);
                }
                errors
            },
        )
    }

    /// A tile of an image after the filters of human vision.
    #[inline(always)]
    fn perceived<const N: usize>(&self, image: &[[f32; N]], width: usize, tile: Tile) -> Perceived {
        let border = self.border;
        let [y, cx, cz] = self.opponent(image, width, tile);
        let [of_y, of_cx, of_cz] = &self.sensitivities;
        let color = hunt_lab(
            filtered(&y, of_y, tile, border),
            filtered(&cx, of_cx, tile, border),
            filtered(&cz, of_cz, tile, border),
        );

        let mut luminance = y;
        for value in &mut luminance {
            *value = (*value + 16.0) / 116.0;
        }
        let smooth = self.smooth.correlate(&luminance, tile, border, Along::Rows);
        Perceived {
            color,
            edges: self.gradient(&self.edge, &luminance, &smooth, tile),
            points: self.gradient(&self.point, &luminance, &smooth, tile),
        }
    }

    /// The strength of what `across` detects in both directions. `smooth` is the luminance smoothed along rows.
    #[inline(always)]
    fn gradient(&self, across: &Filter<f32>, luminance: &[f32], smooth: &[f32], tile: Tile) -> Vec<f32> {
        let horizontal = across.correlate(luminance, tile, self.border, Along::Rows);
        let horizontal = self.smooth.correlate(&horizontal, tile, self.border, Along::Columns);
        let mut strength = across.correlate(smooth, tile, self.border, Along::Columns);
        for (strength, x) in strength.iter_mut().zip(horizontal) {
            let y = *strength;
            *strength = (x * x + y * y).sqrt();
        }
        strength
    }

    /// A tile with its border in YCxCz, a linear form of L*a*b*, in which filters may be applied.
    #[inline(always)]
    fn opponent<const N: usize>(&self, image: &[[f32; N]], width: usize, tile: Tile) -> [Vec<f32>; 3] {
        let height = image.len() / width;
        let linear = tile.bordered(
            self.border,
            #[inline(always)]
            |x, y| {
                let x = x.clamp(0, width as isize - 1) as usize;
                let y = y.clamp(0, height as isize - 1) as usize;
                let pixel = image[y * width + x];
                [self.linear(pixel[0]), self.linear(pixel[1]), self.linear(pixel[2])]
            },
        );
        let (mut y, mut cx, mut cz) = (vec![0.0; linear.len()], vec![0.0; linear.len()], vec![0.0; linear.len()]);
        for (at, &[r, g, b]) in linear.iter().enumerate() {
            let x_of_white = (10135552.0 * r + 8788810.0 * g + 4435075.0 * b) / 24577794.0 / WHITE[0];
            let y_of_white = (2613072.0 * r + 8788810.0 * g + 887015.0 * b) / 12288897.0 / WHITE[1];
            let z_of_white = (1425312.0 * r + 8788810.0 * g + 70074185.0 * b) / 73733382.0 / WHITE[2];
            y[at] = (116.0 * y_of_white - 16.0) as f32;
            cx[at] = (500.0 * (x_of_white - y_of_white)) as f32;
            cz[at] = (200.0 * (y_of_white - z_of_white)) as f32;
        }
        [y, cx, cz]
    }

    /// The linear value of an sRGB value, which is clamped to 0 to 1.
    #[inline(always)]
    fn linear(&self, value: f32) -> f64 {
        let value = value.clamp(0.0, 1.0);
        let step = (value * 255.0 + 0.5) as usize;
        if step as f32 / 255.0 == value { self.linear[step] } else { srgb_to_linear(value) }
    }
}

/// A channel of a tile under a sensitivity: a sum of weighted filters.
#[inline(always)]
fn filtered(plane: &[f32], sensitivity: &[(f32, Filter<f32>)], tile: Tile, border: usize) -> Vec<f32> {
    let mut sums = vec![0.0; tile.columns() * tile.height];
    for (weight, filter) in sensitivity {
        for (sum, value) in sums.iter_mut().zip(filter.correlate_both(plane, tile, border)) {
            *sum += weight * value;
        }
    }
    sums
}

/// The error of a pixel.
#[inline(always)]
fn error(reference: &Perceived, test: &Perceived, at: usize) -> f32 {
    // The HyAB distance: city-block in lightness, Euclidean in the other two.
    let l = reference.color[0][at] - test.color[0][at];
    let a = reference.color[1][at] - test.color[1][at];
    let b = reference.color[2][at] - test.color[2][at];
    let difference = power(l.abs() + (a * a + b * b).sqrt(), QC as f32);
    // Differences are mapped to 0 to 1, and most of the range to small ones.
    let greatest = power(GREATEST_DIFFERENCE as f32, QC as f32);
    let (knee, part) = (PC as f32 * greatest, PT as f32);
    let beyond = part + (difference - knee) / (greatest - knee) * (1.0 - part);
    let color_error = if difference < knee { part / knee * difference } else { beyond };
    let edge = (reference.edges[at] - test.edges[at]).abs();
    let point = (reference.points[at] - test.points[at]).abs();
    // A root: the exponent of the feature difference is a half.
    let feature_error = (edge.max(point) * std::f32::consts::FRAC_1_SQRT_2).sqrt();
    power(color_error, 1.0 - feature_error)
}

/// Filtered colours of YCxCz as L*a*b*, with the Hunt effect: colours look more colourful where they are brighter. Planes
/// become planes.
#[inline(always)]
fn hunt_lab(mut y: Vec<f32>, mut cx: Vec<f32>, mut cz: Vec<f32>) -> [Vec<f32>; 3] {
    let count = y.len();
    let (y_plane, cx_plane, cz_plane) = (&mut y[..count], &mut cx[..count], &mut cz[..count]);
    for at in 0..count {
        let of_white = (y_plane[at] + 16.0) * (1.0 / 116.0);
        let x = (of_white + cx_plane[at] * (1.0 / 500.0)) * WHITE[0] as f32;
        let y = of_white * WHITE[1] as f32;
        let z = (of_white - cz_plane[at] * (1.0 / 200.0)) * WHITE[2] as f32;
        let r = (3.241_003_3 * x - 1.537_398_9 * y - 0.498_615_86 * z).clamp(0.0, 1.0);
        let g = (-0.969_224_33 * x + 1.875_930_1 * y + 0.041554224 * z).clamp(0.0, 1.0);
        let b = (0.055639423 * x - 0.204_011_2 * y + 1.057_148_9 * z).clamp(0.0, 1.0);
        let x = (10135552.0 / 24577794.0) * r + (8788810.0 / 24577794.0) * g + (4435075.0 / 24577794.0) * b;
        let y = (2613072.0 / 12288897.0) * r + (8788810.0 / 12288897.0) * g + (887015.0 / 12288897.0) * b;
        let z = (1425312.0 / 73733382.0) * r + (8788810.0 / 73733382.0) * g + (70074185.0 / 73733382.0) * b;
        let (x, y, z) = (lab_root(x, WHITE[0]), lab_root(y, WHITE[1]), lab_root(z, WHITE[2]));
        let l = 116.0 * y - 16.0;
        y_plane[at] = l;
        cx_plane[at] = 0.01 * l * (500.0 * (x - y));
        cz_plane[at] = 0.01 * l * (200.0 * (y - z));
    }
    [y, cx, cz]
}

/// L*a*b*'s root of a value relative to that of white.
#[inline(always)]
fn lab_root(value: f32, white: f64) -> f32 {
    const CUBED: f32 = 216.0 / 24389.0;
    let relative = value * (1.0 / white) as f32;
    let root = power(relative, 1.0 / 3.0);
    if relative > CUBED { root } else { relative * (841.0 / 108.0) + 4.0 / 29.0 }
}

/// The filter of a kernel of odd length, without what does not change a sum at its ends.
fn filter(form: Form, kernel: &[f64]) -> Filter<f32> {
    let side = &kernel[kernel.len() / 2..];
    let count = side.iter().rposition(|weight| weight.abs() >= LEAST_WEIGHT).map_or(1, |last| last + 1);
    Filter { form, weights: side[..count].iter().map(|weight| *weight as f32).collect() }
}

/// `f` at the whole numbers from `-radius` to `radius`.
fn sample(radius: f64, f: impl Fn(f64) -> f64) -> Vec<f64> {
    let radius = radius as i32;
    (-radius..=radius).map(|x| f(f64::from(x))).collect()
}

fn gaussian(x: f64, sigma: f64) -> f64 {
    (-x * x / (2.0 * sigma * sigma)).exp()
}

/// Weights scaled to add up to 1.
fn normalised(weights: Vec<f64>) -> Vec<f64> {
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|w| w / sum).collect()
}

/// Weights scaled so that the positive ones add up to 1 and the negative ones to -1.
fn balanced(weights: Vec<f64>) -> Vec<f64> {
    let positive: f64 = weights.iter().filter(|w| **w > 0.0).sum();
    let negative: f64 = -weights.iter().filter(|w| **w < 0.0).sum::<f64>();
    let scale = |w: &f64| w / if *w < 0.0 { negative } else { positive };
    weights.iter().map(scale).collect()
}

fn srgb_to_linear(value: f32) -> f64 {
    let value = f64::from(value.clamp(0.0, 1.0));
    if value > 0.04045 { ((value + 0.055) / 1.055).powf(2.4) } else { value / 12.92 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(reference: &[[f32; 3]], test: &[[f32; 3]], width: u32) -> f64 {
        let errors = flip(reference, test, width, DEFAULT_PIXELS_PER_DEGREE);
        let of_map = errors.iter().sum::<f64>() / errors.len() as f64;
        let mean = super::mean(reference, test, width, DEFAULT_PIXELS_PER_DEGREE);
        assert!((of_map - mean).abs() < 1e-12, "{of_map} {mean}");
        mean
    }

    #[test]
    fn errors_are_those_of_the_naive_form() {
        // More than a tile wide and high, with values between the steps of eight bits.
        let (width, height) = (300u32, 150u32);
        let pixels = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let noise = |x: u32, y: u32, seed: u32| (x * 7919 + y * 104_729 + x * y * seed) % 1009;
        let image = |seed: u32| -> Vec<[f32; 3]> {
            let smooth = |x: u32, y: u32| [x as f32 / width as f32, y as f32 / height as f32, 0.3];
            let pixel = |(x, y): (u32, u32)| {
                let random = noise(x, y, seed) as f32 / 1008.0;
                smooth(x, y).map(|c| 0.7 * c + 0.3 * random)
            };
            pixels().map(pixel).collect()
        };
        let (a, b) = (image(3), image(5));
        let expected = reference::flip(&a, &b, width, DEFAULT_PIXELS_PER_DEGREE);
        let found = flip(&a, &b, width, DEFAULT_PIXELS_PER_DEGREE);
        let furthest = expected.iter().zip(&found).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(furthest < 1e-4, "{furthest}");
        let greatest = reference::greatest_color_difference();
        assert!((greatest - GREATEST_DIFFERENCE).abs() < 1e-6, "{greatest}");
    }

    /// 48 x 32 pixels of coloured noise, and the same with a block inverted and the right side
    /// darkened.
    fn patterns() -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let pixels = || (0..32_u16).flat_map(|y| (0..48_u16).map(move |x| (x, y)));
        let reference = |(x, y): (u16, u16)| {
            let [r, g, b] = [(x * 7 + y * 3) % 32, (x * x + y) % 17, ((x * 5) ^ (y * 9)) % 64];
            [f32::from(r) / 31.0, f32::from(g) / 16.0, f32::from(b) / 63.0]
        };
        let test = |(x, y): (u16, u16)| {
            let inverted = (8..16).contains(&y) && (8..24).contains(&x);
            reference((x, y)).map(|c| {
                let c = if inverted { 1.0 - c } else { c };
                if x >= 30 { 0.5 * c } else { c }
            })
        };
        (pixels().map(reference).collect(), pixels().map(test).collect())
    }

    #[test]
    fn values_of_the_authors_implementation() {
        // flip-evaluator 1.7 (binary32), flip.evaluate(..., "LDR", applyMagma=False).
        let (reference, test) = patterns();
        assert!((mean(&reference, &test, 48) - 0.387766).abs() < 2e-5);
        let errors = flip(&reference, &test, 48, DEFAULT_PIXELS_PER_DEGREE);
        for (x, y, expected) in [(16, 12, 0.872548), (47, 31, 0.831654), (28, 12, 0.231202), (10, 20, 0.040328)] {
            let error = errors[y * 48 + x];
            assert!((error - expected).abs() < 1e-4, "({x}, {y}): {error}");
        }
    }

    #[test]
    fn values_of_flat_images() {
        // Values of the same implementation, except for the last, which holds by definition. On a flat image its
        // binary32 filters find features of about 1e-7, whose root, 3e-4, is in the exponent; hence the tolerance.
        let flat = |rgb| vec![rgb; 64];
        for (reference, test, expected) in
            [([1.0; 3], [0.0; 3], 0.967388), ([0.5; 3], [0.6; 3], 0.285063), ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0], 1.0)]
        {
            let error = mean(&flat(reference), &flat(test), 8);
            assert!((error - expected).abs() < 1e-4, "{error}");
        }
    }

    #[test]
    fn equal_images_have_no_error_and_the_error_is_symmetric() {
        let (reference, test) = patterns();
        assert_eq!(mean(&reference, &reference, 48), 0.0);
        assert_eq!(mean(&reference, &test, 48), mean(&test, &reference, 48));
        let errors = flip(&reference, &test, 48, DEFAULT_PIXELS_PER_DEGREE);
        assert!(errors.iter().all(|e| (0.0..=1.0).contains(e)));
    }
}
