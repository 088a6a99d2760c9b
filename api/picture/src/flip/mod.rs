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
    let sum = |tile: Tile, errors: Vec<f32>| tile.sum(|at| errors[at].into());
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
                let [reference, test] = [reference, test].map(|image| self.perceived(image, width, tile));
                (0..reference.edges.len()).map(|at| error(&reference, &test, at)).collect()
            },
        )
    }

    /// A tile of an image after the filters of human vision.
    #[inline(always)]
    fn perceived<const N: usize>(&self, image: &[[f32; N]], width: usize, tile: Tile) -> Perceived {
        let height = image.len() / width;
        let border = self.border;
        let opponent = tile.bordered(border, |x, y| {
            let x = x.clamp(0, width as isize - 1) as usize;
            let y = y.clamp(0, height as isize - 1) as usize;
            self.opponent(image[y * width + x])
        });
        let [y, cx, cz] =
            [0, 1, 2].map(|channel| -> Vec<f32> { opponent.iter().map(|color| color[channel]).collect() });
        let separable = |plane: &[f32], filter: &Filter<f32>| {
            let along_rows = filter.correlate(plane, tile, border, Along::Rows);
            filter.correlate(&along_rows, tile, border, Along::Columns)
        };
        let [y_seen, cx_seen, cz_seen] = [(&y, 0), (&cx, 1), (&cz, 2)].map(|(plane, channel)| {
            let mut sums = vec![0.0; tile.columns() * tile.height];
            for (weight, filter) in &self.sensitivities[channel] {
                for (sum, value) in sums.iter_mut().zip(separable(plane, filter)) {
                    *sum += weight * value;
                }
            }
            sums
        });
        let colors: Vec<[f32; 3]> =
            (0..y_seen.len()).map(|at| hunt_lab([y_seen[at], cx_seen[at], cz_seen[at]])).collect();

        let luminance: Vec<f32> = y.iter().map(|y| (y + 16.0) / 116.0).collect();
        let smooth = self.smooth.correlate(&luminance, tile, border, Along::Rows);
        let gradient = |across: &Filter<f32>| -> Vec<f32> {
            let horizontal = across.correlate(&luminance, tile, border, Along::Rows);
            let horizontal = self.smooth.correlate(&horizontal, tile, border, Along::Columns);
            let vertical = across.correlate(&smooth, tile, border, Along::Columns);
            horizontal.iter().zip(&vertical).map(|(x, y)| (x * x + y * y).sqrt()).collect()
        };
        Perceived {
            color: [0, 1, 2].map(|channel| colors.iter().map(|color| color[channel]).collect()),
            edges: gradient(&self.edge),
            points: gradient(&self.point),
        }
    }

    /// A pixel in YCxCz, a linear form of L*a*b*, in which filters may be applied.
    #[inline(always)]
    fn opponent<const N: usize>(&self, pixel: [f32; N]) -> [f32; 3] {
        let [r, g, b] = [pixel[0], pixel[1], pixel[2]].map(|value| {
            let value = value.clamp(0.0, 1.0);
            let step = (value * 255.0 + 0.5) as usize;
            if step as f32 / 255.0 == value { self.linear[step] } else { srgb_to_linear(value) }
        });
        let xyz = [
            (10135552.0 * r + 8788810.0 * g + 4435075.0 * b) / 24577794.0,
            (2613072.0 * r + 8788810.0 * g + 887015.0 * b) / 12288897.0,
            (1425312.0 * r + 8788810.0 * g + 70074185.0 * b) / 73733382.0,
        ];
        let [x, y, z] = [0, 1, 2].map(|axis| xyz[axis] / WHITE[axis]);
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)].map(|value| value as f32)
    }
}

/// The error of a pixel.
#[inline(always)]
fn error(reference: &Perceived, test: &Perceived, at: usize) -> f32 {
    // The HyAB distance: city-block in lightness, Euclidean in the other two.
    let [l, a, b] = [0, 1, 2].map(|channel: usize| reference.color[channel][at] - test.color[channel][at]);
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

/// A filtered colour of YCxCz as L*a*b*, with the Hunt effect: colours look more colourful where they are brighter.
#[inline(always)]
fn hunt_lab([y, cx, cz]: [f32; 3]) -> [f32; 3] {
    const CUBED: f32 = 216.0 / 24389.0;
    let y = (y + 16.0) * (1.0 / 116.0);
    let relative = [y + cx * (1.0 / 500.0), y, y - cz * (1.0 / 200.0)];
    let [x, y, z] = [0, 1, 2].map(|axis: usize| relative[axis] * WHITE[axis] as f32);
    let [r, g, b] = [
        3.241_003_3 * x - 1.537_398_9 * y - 0.498_615_86 * z,
        -0.969_224_33 * x + 1.875_930_1 * y + 0.041554224 * z,
        0.055639423 * x - 0.204_011_2 * y + 1.057_148_9 * z,
    ]
    .map(|c: f32| c.clamp(0.0, 1.0));
    let xyz = [
        (10135552.0 / 24577794.0) * r + (8788810.0 / 24577794.0) * g + (4435075.0 / 24577794.0) * b,
        (2613072.0 / 12288897.0) * r + (8788810.0 / 12288897.0) * g + (887015.0 / 12288897.0) * b,
        (1425312.0 / 73733382.0) * r + (8788810.0 / 73733382.0) * g + (70074185.0 / 73733382.0) * b,
    ];
    let [x, y, z] = [0, 1, 2].map(|axis: usize| {
        let relative = xyz[axis] * (1.0 / WHITE[axis]) as f32;
        let root = power(relative, 1.0 / 3.0);
        if relative > CUBED { root } else { relative * (841.0 / 108.0) + 4.0 / 29.0 }
    });
    let l = 116.0 * y - 16.0;
    [l, 0.01 * l * (500.0 * (x - y)), 0.01 * l * (200.0 * (y - z))]
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
