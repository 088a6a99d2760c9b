//! FLIP for low dynamic range: the visibility of differences when flipping between two images.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: A Difference Evaluator
//! for Alternating Images", HPG 2020, with the constants of the authors' implementation. Colours
//! are filtered by the eye's contrast sensitivity and compared in a Hunt-adjusted L*a*b* space;
//! edges and points that appear or vanish raise the error.
//!
//! All filters are separable (one is a sum of two that are); borders repeat the outermost pixel. As in the authors'
//! implementation, numbers are binary32. Tiles are filtered one by one, and a tile row by row, so that a large image needs little
//! memory.

mod power;
#[cfg(test)]
mod reference;

use std::f64::consts::PI;

use fearless_simd::{Level, Simd, dispatch, f32x16, f64x8, prelude::*, u32x16};
use rayon::prelude::*;

use crate::tiles::{Filter, Form, Tile, sum, tiles};
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

/// X, Y and Z relative to white of linear red, green and blue.
const X_OF_WHITE: [f64; 3] = relative_to(WHITE[0], [10135552.0, 8788810.0, 4435075.0], 24577794.0);
const Y_OF_WHITE: [f64; 3] = relative_to(WHITE[1], [2613072.0, 8788810.0, 887015.0], 12288897.0);
const Z_OF_WHITE: [f64; 3] = relative_to(WHITE[2], [1425312.0, 8788810.0, 70074185.0], 73733382.0);

/// The weights of red, green and blue, which are quotients by `divisor`, relative to a value of white.
const fn relative_to(white: f64, [r, g, b]: [f64; 3], divisor: f64) -> [f64; 3] {
    [r / divisor / white, g / divisor / white, b / divisor / white]
}

/// The greatest colour difference, which is that from green to blue.
const GREATEST_DIFFERENCE: f64 = 203.301654592;

/// The steps of sRGB values of eight bits.
const STEPS: usize = 256;

/// Weights below this do not change a sum.
const LEAST_WEIGHT: f64 = 1e-10;

/// The FLIP error, 0 to 1, of each pixel of `test`. Both images are sRGB, clamped to 0 to 1 here,
/// with `width` pixels a row; what a pixel has beyond red, green and blue is ignored.
pub fn flip<const N: usize>(reference: &[[f32; N]], test: &[[f32; N]], width: u32, pixels_per_degree: f64) -> Vec<f64> {
    let width = width as usize;
    let mut errors = vec![0.0; reference.len()];
    for (tile, of_tile) in by_tile(reference, test, width, pixels_per_degree, |_, errors| errors.to_vec()) {
        for (row, of_row) in of_tile.chunks_exact(tile.columns()).enumerate() {
            for (column, error) in of_row[..tile.width].iter().enumerate() {
                errors[(tile.top + row) * width + tile.left + column] = (*error).into();
            }
        }
    }
    errors
}

/// The mean of [`flip`]'s errors.
pub fn mean<const N: usize>(reference: &[[f32; N]], test: &[[f32; N]], width: u32, pixels_per_degree: f64) -> f64 {
    let sum_of = |tile: Tile, errors: &[f32]| -> f64 {
        errors.chunks_exact(tile.columns()).map(|row| sum(&row[..tile.width])).sum()
    };
    let sums = by_tile(reference, test, width as usize, pixels_per_degree, sum_of);
    sums.into_iter().map(|(_, sum)| sum).sum::<f64>() / reference.len() as f64
}

/// The tiles of two images, and what is made of their errors, which are a plane of the tile's columns.
fn by_tile<const N: usize, T: Send>(
    reference: &[[f32; N]],
    test: &[[f32; N]],
    width: usize,
    pixels_per_degree: f64,
    made: impl Fn(Tile, &[f32]) -> T + Sync,
) -> Vec<(Tile, T)> {
    assert_eq!(reference.len(), test.len(), "the sizes differ");
    if reference.is_empty() {
        return Vec::new();
    }
    let vision = Vision::new(pixels_per_degree);
    let level = Level::new();
    let of_tile = |memory: &mut Memory, tile: Tile| {
        dispatch!(level, simd => vision.compute_errors(simd, reference, test, width, tile, memory));
        (tile, made(tile, &memory.errors))
    };
    tiles(width, reference.len() / width).into_par_iter().map_init(Memory::default, of_tile).collect()
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
    /// The linear values of sRGB's steps.
    linear: [f64; STEPS],
}

/// The memory of a thread, used again for each tile.
#[derive(Debug, Default)]
struct Memory {
    reference: Seen,
    test: Seen,
    rows: Rows,
    /// The errors of a tile's pixels, in a plane of its columns.
    errors: Vec<f32>,
}

/// A tile of an image, and one row of it as it is seen.
#[derive(Debug, Default)]
struct Seen {
    /// The tile with its border in YCxCz, a linear form of L*a*b*, in which filters may be applied.
    opponent: [Vec<f32>; 3],
    /// A row's filtered colour in Hunt-adjusted L*a*b*.
    color: [Vec<f32>; 3],
    /// A row's strength of edges.
    edges: Vec<f32>,
    /// A row's strength of points.
    points: Vec<f32>,
}

/// Rows of values between filters.
#[derive(Debug, Default)]
struct Rows {
    /// The sRGB steps of a row of an image in the tile and its border, all channels of a pixel after one another.
    steps: Vec<u32>,
    /// The linear red, green and blue of a row and its border.
    linear: [Vec<f64>; 3],
    /// A row and its border after a filter along columns, and after the smoothing one.
    down: Vec<f32>,
    smooth: Vec<f32>,
    /// A row after filters along both.
    along: Vec<f32>,
}

impl Memory {
    fn resize(&mut self, stride: usize, rows: usize, columns: usize) {
        for seen in [&mut self.reference, &mut self.test] {
            for plane in &mut seen.opponent {
                plane.resize(stride * rows, 0.0);
            }
            for row in seen.color.iter_mut().chain([&mut seen.edges, &mut seen.points]) {
                row.resize(columns, 0.0);
            }
        }
        for row in &mut self.rows.linear {
            row.resize(stride, 0.0);
        }
        self.rows.down.resize(stride, 0.0);
        self.rows.smooth.resize(stride, 0.0);
        self.rows.along.resize(columns, 0.0);
    }
}

impl Seen {
    /// Takes a row of the tile and its border, of linear red, green and blue.
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, row: usize, stride: usize, linear: &[Vec<f64>; 3]) {
        let [y, cx, cz] = self.opponent.each_mut().map(|plane| plane[row * stride..][..stride].chunks_exact_mut(8));
        let [red, green, blue] = linear.each_ref().map(|values| values[..stride].chunks_exact(8));
        for ((y, (cx, cz)), (red, (green, blue))) in y.zip(cx.zip(cz)).zip(red.zip(green.zip(blue))) {
            let red = f64x8::from_slice(simd, red);
            let green = f64x8::from_slice(simd, green);
            let blue = f64x8::from_slice(simd, blue);
            let x_of_white = red * X_OF_WHITE[0] + green * X_OF_WHITE[1] + blue * X_OF_WHITE[2];
            let y_of_white = red * Y_OF_WHITE[0] + green * Y_OF_WHITE[1] + blue * Y_OF_WHITE[2];
            let z_of_white = red * Z_OF_WHITE[0] + green * Z_OF_WHITE[1] + blue * Z_OF_WHITE[2];
            round_to(y, y_of_white * 116.0 - 16.0);
            round_to(cx, (x_of_white - y_of_white) * 500.0);
            round_to(cz, (y_of_white - z_of_white) * 200.0);
        }
    }
}

/// Rounds numbers to binary32.
#[inline(always)]
fn round_to<S: Simd>(values: &mut [f32], numbers: f64x8<S>) {
    let numbers: [f64; 8] = numbers.into();
    for (value, number) in values.iter_mut().zip(numbers) {
        *value = number as f32;
    }
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
            linear: std::array::from_fn(|step| srgb_to_linear(step as f32 / 255.0)),
        }
    }

    /// Computes the errors of a tile's pixels.
    #[inline(always)]
    fn compute_errors<S: Simd, const N: usize>(
        &self,
        simd: S,
        reference: &[[f32; N]],
        test: &[[f32; N]],
        width: usize,
        tile: Tile,
        memory: &mut Memory,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                let (stride, columns) = (tile.stride(self.border), tile.columns());
                memory.resize(stride, tile.rows(self.border), columns);
                memory.errors.resize(columns * tile.height, 0.0);
                for row in 0..tile.rows(self.border) {
                    // A row is taken when it is first needed, and is still in a cache when it is filtered.
                    for (image, seen) in [(reference, &mut memory.reference), (test, &mut memory.test)] {
                        let y = (tile.top + row).saturating_sub(self.border).min(image.len() / width - 1);
                        self.take_linear(simd, &image[y * width..][..width], tile, &mut memory.rows);
                        seen.take(simd, row, stride, &memory.rows.linear);
                    }
                    if let Some(row) = row.checked_sub(2 * self.border) {
                        self.see(simd, &mut memory.reference, row, stride, &mut memory.rows);
                        self.see(simd, &mut memory.test, row, stride, &mut memory.rows);
                        let errors = &mut memory.errors[row * columns..][..columns];
                        compare(simd, &memory.reference, &memory.test, errors);
                    }
                }
            },
        );
    }

    /// Takes the linear values of a row of an image in the tile and its border.
    #[inline(always)]
    fn take_linear<S: Simd, const N: usize>(&self, simd: S, pixels: &[[f32; N]], tile: Tile, rows: &mut Rows) {
        let stride = tile.stride(self.border);
        let place = |at: usize| (tile.left + at).saturating_sub(self.border).min(pixels.len() - 1);
        let (first, end) = (place(0), place(stride - 1) + 1);
        let [red, green, blue] = rows.linear.each_mut().map(|row| &mut row[..stride]);
        if take_steps(simd, pixels[first..end].as_flattened(), &mut rows.steps) {
            for at in 0..stride {
                let of_pixel = &rows.steps[(place(at) - first) * N..][..3];
                red[at] = self.linear[of_pixel[0] as usize % STEPS];
                green[at] = self.linear[of_pixel[1] as usize % STEPS];
                blue[at] = self.linear[of_pixel[2] as usize % STEPS];
            }
        } else {
            for at in 0..stride {
                let (pixel, steps) = (pixels[place(at)], &rows.steps[(place(at) - first) * N..]);
                red[at] = self.linear_of(pixel[0], steps[0]);
                green[at] = self.linear_of(pixel[1], steps[1]);
                blue[at] = self.linear_of(pixel[2], steps[2]);
            }
        }
    }

    /// The linear value of an sRGB value, of which `step` is the nearest step.
    #[inline(always)]
    fn linear_of(&self, value: f32, step: u32) -> f64 {
        if step as f32 / 255.0 == value { self.linear[step as usize % STEPS] } else { srgb_to_linear(value) }
    }

    /// Filters a row of the tile as human vision does.
    #[inline(always)]
    fn see<S: Simd>(&self, simd: S, seen: &mut Seen, row: usize, stride: usize, rows: &mut Rows) {
        let Seen { opponent, color, edges, points } = seen;
        let middle = (row + self.border) * stride;
        for ((plane, sensitivity), sums) in opponent.iter().zip(&self.sensitivities).zip(color.iter_mut()) {
            sums.fill(0.0);
            for (weight, filter) in sensitivity {
                filter.correlate(simd, plane, middle, stride, &mut rows.down);
                filter.correlate(simd, &rows.down, self.border, 1, &mut rows.along);
                for (sum, value) in sums.chunks_exact_mut(16).zip(rows.along.chunks_exact(16)) {
                    let value = f32x16::from_slice(simd, value);
                    (f32x16::from_slice(simd, sum) + value * *weight).store_slice(sum);
                }
            }
        }
        hunt_lab(simd, color);
        let luminance = &opponent[0];
        self.smooth.correlate(simd, luminance, middle, stride, &mut rows.smooth);
        for (across, strength) in [(&self.edge, edges), (&self.point, points)] {
            across.correlate(simd, luminance, middle, stride, &mut rows.down);
            self.smooth.correlate(simd, &rows.down, self.border, 1, &mut rows.along);
            across.correlate(simd, &rows.smooth, self.border, 1, strength);
            for (x, y) in strength.chunks_exact_mut(16).zip(rows.along.chunks_exact(16)) {
                let (across, along) = (f32x16::from_slice(simd, x), f32x16::from_slice(simd, y));
                // Luminance is (Y + 16) / 116, and equal values have no strength.
                ((across * across + along * along).sqrt() * (1.0 / 116.0)).store_slice(x);
            }
        }
    }
}

/// Takes the nearest step of sRGB of each value, or any step of a value beyond 0 to 1. Returns false if one is no step.
#[inline(always)]
fn take_steps<S: Simd>(simd: S, values: &[f32], steps: &mut Vec<u32>) -> bool {
    steps.resize(values.len().next_multiple_of(16), 0);
    let (groups, rest) = values.as_chunks::<16>();
    let (group_steps, rest_steps) = steps.split_at_mut(16 * groups.len());
    let mut others = u32x16::splat(simd, 0);
    for (steps, group) in group_steps.chunks_exact_mut(16).zip(groups) {
        let values = f32x16::from_slice(simd, group);
        let nearest = (values * 255.0 + power::WHOLE).bitcast::<u32x16<S>>() & u32x16::splat(simd, 0xFF);
        nearest.store_slice(steps);
        others |= (f32x16::float_from(nearest) / 255.0).bitcast::<u32x16<S>>() ^ values.bitcast::<u32x16<S>>();
    }
    let mut are_steps = <[u32; 16]>::from(others) == [0; 16];
    for (step, &value) in rest_steps.iter_mut().zip(rest) {
        *step = (value * 255.0 + power::WHOLE).to_bits() & 0xFF;
        are_steps &= *step as f32 / 255.0 == value;
    }
    are_steps
}

/// Computes the errors of a row's pixels.
#[inline(always)]
fn compare<S: Simd>(simd: S, reference: &Seen, test: &Seen, errors: &mut [f32]) {
    // The colour difference that is mapped to the share PT, and the greatest one.
    let greatest = GREATEST_DIFFERENCE.powf(QC) as f32;
    let knee = PC as f32 * greatest;
    for (group, errors) in errors.chunks_exact_mut(16).enumerate() {
        let l = difference(simd, group, &reference.color[0], &test.color[0]);
        let a = difference(simd, group, &reference.color[1], &test.color[1]);
        let b = difference(simd, group, &reference.color[2], &test.color[2]);
        // The HyAB distance: city-block in lightness, Euclidean in the other two.
        let color = power(simd, l.abs() + (a * a + b * b).sqrt(), f32x16::splat(simd, QC as f32));
        // Differences are mapped to 0 to 1, and most of the range to small ones.
        let part = PT as f32;
        let beyond = (color - knee) / (greatest - knee) * (1.0 - part) + part;
        let color_error = color.simd_lt(knee).select(color * (part / knee), beyond);
        let edge = difference(simd, group, &reference.edges, &test.edges).abs();
        let point = difference(simd, group, &reference.points, &test.points).abs();
        // A root: the exponent of the feature difference is a half.
        let feature_error = (edge.max(point) * std::f32::consts::FRAC_1_SQRT_2).sqrt();
        power(simd, color_error, f32x16::splat(simd, 1.0) - feature_error).store_slice(errors);
    }
}

/// The difference of a group of two rows.
#[inline(always)]
fn difference<S: Simd>(simd: S, group: usize, reference: &[f32], test: &[f32]) -> f32x16<S> {
    let place = 16 * group..16 * group + 16;
    f32x16::from_slice(simd, &reference[place.clone()]) - f32x16::from_slice(simd, &test[place])
}

/// Changes a row of filtered colours of YCxCz to L*a*b*, with the Hunt effect: colours look more colourful where they are brighter.
#[inline(always)]
fn hunt_lab<S: Simd>(simd: S, color: &mut [Vec<f32>; 3]) {
    let [y_row, cx_row, cz_row] = color.each_mut().map(|row| row.chunks_exact_mut(16));
    let zero = f32x16::splat(simd, 0.0);
    let one = f32x16::splat(simd, 1.0);
    for (y_row, (cx_row, cz_row)) in y_row.zip(cx_row.zip(cz_row)) {
        let of_white = (f32x16::from_slice(simd, y_row) + 16.0) * (1.0 / 116.0);
        let x = (f32x16::from_slice(simd, cx_row) * (1.0 / 500.0) + of_white) * WHITE[0] as f32;
        let y = of_white * WHITE[1] as f32;
        let z = (of_white - f32x16::from_slice(simd, cz_row) * (1.0 / 200.0)) * WHITE[2] as f32;
        let r = (x * 3.241_003_3 - y * 1.537_398_9 - z * 0.498_615_86).max(zero).min(one);
        let g = (y * 1.875_930_1 - x * 0.969_224_33 + z * 0.041554224).max(zero).min(one);
        let b = (x * 0.055639423 - y * 0.204_011_2 + z * 1.057_148_9).max(zero).min(one);
        let x = r * (10135552.0 / 24577794.0) + g * (8788810.0 / 24577794.0) + b * (4435075.0 / 24577794.0);
        let y = r * (2613072.0 / 12288897.0) + g * (8788810.0 / 12288897.0) + b * (887015.0 / 12288897.0);
        let z = r * (1425312.0 / 73733382.0) + g * (8788810.0 / 73733382.0) + b * (70074185.0 / 73733382.0);
        let x = lab_root(simd, x * (1.0 / WHITE[0]) as f32);
        let y = lab_root(simd, y * (1.0 / WHITE[1]) as f32);
        let z = lab_root(simd, z * (1.0 / WHITE[2]) as f32);
        let l = y * 116.0 - 16.0;
        l.store_slice(y_row);
        (l * 0.01 * ((x - y) * 500.0)).store_slice(cx_row);
        (l * 0.01 * ((y - z) * 200.0)).store_slice(cz_row);
    }
}

/// L*a*b*'s roots of values relative to those of white.
#[inline(always)]
fn lab_root<S: Simd>(simd: S, relative: f32x16<S>) -> f32x16<S> {
    const CUBED: f32 = 216.0 / 24389.0;
    let root = power(simd, relative, f32x16::splat(simd, 1.0 / 3.0));
    relative.simd_gt(CUBED).select(root, relative * (841.0 / 108.0) + 4.0 / 29.0)
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
