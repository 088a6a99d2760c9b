//! FLIP for low dynamic range: the visibility of differences when flipping between two images.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: A Difference Evaluator
//! for Alternating Images", HPG 2020, with the constants of the authors' implementation. Colours
//! are filtered by the eye's contrast sensitivity and compared in a Hunt-adjusted L*a*b* space;
//! edges and points that appear or vanish raise the error.
//!
//! All filters are separable (one is a sum of two that are); borders repeat the outermost pixel.

use std::f64::consts::PI;

use rayon::prelude::*;

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
/// Exponent of the feature difference.
const QF: f64 = 0.5;

/// White of standard illuminant D65.
const WHITE: [f64; 3] = [0.950428545, 1.0, 1.088900371];

/// The FLIP error, 0 to 1, of each pixel of `test`. Both images are sRGB, clamped to 0 to 1 here,
/// with `width` pixels a row.
pub fn flip(reference: &[[f32; 3]], test: &[[f32; 3]], width: u32, pixels_per_degree: f64) -> Vec<f64> {
    assert_eq!(reference.len(), test.len(), "the sizes differ");
    let reference = Perceived::new(reference, width as usize, pixels_per_degree);
    let test = Perceived::new(test, width as usize, pixels_per_degree);
    let greatest = greatest_color_difference().powf(QC);
    (0..reference.color.len())
        .map(|i| {
            let difference = hyab(reference.color[i], test.color[i]).powf(QC);
            let color_error = redistribute(difference, greatest);
            let edge = (reference.edges[i] - test.edges[i]).abs();
            let point = (reference.points[i] - test.points[i]).abs();
            let feature_error = (edge.max(point) / 2.0_f64.sqrt()).powf(QF);
            color_error.powf(1.0 - feature_error)
        })
        .collect()
}

/// An image after the filters of human vision.
struct Perceived {
    /// Filtered colour in Hunt-adjusted L*a*b*.
    color: Vec<[f64; 3]>,
    /// Strength of edges, per pixel.
    edges: Vec<f64>,
    /// Strength of points, per pixel.
    points: Vec<f64>,
}

impl Perceived {
    fn new(image: &[[f32; 3]], width: usize, ppd: f64) -> Self {
        let opponent: Vec<[f64; 3]> =
            image.iter().map(|rgb| xyz_to_ycxcz(linear_to_xyz(rgb.map(srgb_to_linear)))).collect();
        let plane = |channel: usize| Plane { width, values: opponent.iter().map(|color| color[channel]).collect() };
        let [y, cx, cz] = [0, 1, 2].map(plane);

        // Contrast sensitivities of the achromatic, red-green and blue-yellow channels.
        let filtered = [
            y.filter_gaussians(&[(1.0, 0.0047)], ppd),
            cx.filter_gaussians(&[(1.0, 0.0053)], ppd),
            cz.filter_gaussians(&[(34.1, 0.04), (13.5, 0.025)], ppd),
        ];
        let color = (0..image.len())
            .map(|i| {
                let [y, cx, cz] = [0, 1, 2].map(|c| filtered[c].values[i]);
                let linear = xyz_to_linear(ycxcz_to_xyz([y, cx, cz])).map(|c| c.clamp(0.0, 1.0));
                hunt(xyz_to_lab(linear_to_xyz(linear)))
            })
            .collect();

        let luminance = Plane { width, values: y.values.iter().map(|y| (y + 16.0) / 116.0).collect() };
        let sigma = 0.5 * W * ppd;
        let smooth = normalised(sample((3.0 * sigma).ceil(), |x| gaussian(x, sigma)));
        let edge = sample((3.0 * sigma).ceil(), |x| -x * gaussian(x, sigma));
        let point = sample((3.0 * sigma).ceil(), |x| (x * x / (sigma * sigma) - 1.0) * gaussian(x, sigma));
        Self {
            color,
            edges: luminance.gradient(&balanced(edge), &smooth),
            points: luminance.gradient(&balanced(point), &smooth),
        }
    }
}

/// One channel of an image.
struct Plane {
    width: usize,
    values: Vec<f64>,
}

impl Plane {
    /// Filters with a sum of Gaussians `a sqrt(pi / b) exp(-pi^2 r^2 / b)`, r in degrees, scaled so
    /// that its weights add up to 1.
    fn filter_gaussians(&self, terms: &[(f64, f64)], ppd: f64) -> Self {
        // The widest of all channels' terms has b = 0.04 and sets the radius of each filter.
        let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * ppd).ceil();
        let parts: Vec<(f64, Vec<f64>)> = terms
            .iter()
            .map(|&(a, b)| {
                let kernel = sample(radius, |x| (-(PI * x / ppd).powi(2) / b).exp());
                let sum: f64 = kernel.iter().sum();
                (a * (PI / b).sqrt() * sum * sum, normalised(kernel))
            })
            .collect();
        let total: f64 = parts.iter().map(|(weight, _)| weight).sum();
        let mut values = vec![0.0; self.values.len()];
        for (weight, kernel) in &parts {
            for (sum, value) in values.iter_mut().zip(self.separable(kernel, kernel).values) {
                *sum += weight / total * value;
            }
        }
        Self { values, ..*self }
    }

    /// Length of the gradient that `across` makes in either direction, smoothed along the other.
    fn gradient(&self, across: &[f64], smooth: &[f64]) -> Vec<f64> {
        let horizontal = self.separable(across, smooth);
        let vertical = self.separable(smooth, across);
        let pairs = horizontal.values.iter().zip(&vertical.values);
        pairs.map(|(x, y)| x.hypot(*y)).collect()
    }

    /// Correlates rows with `horizontal`, then columns with `vertical`; both have odd lengths.
    fn separable(&self, horizontal: &[f64], vertical: &[f64]) -> Self {
        let (width, height) = (self.width, self.values.len() / self.width);
        let correlate = |kernel: &[f64], position: usize, count: usize, value: &dyn Fn(usize) -> f64| {
            let radius = kernel.len() / 2;
            kernel
                .iter()
                .enumerate()
                .map(|(i, weight)| {
                    let at = (position + i).saturating_sub(radius).min(count - 1);
                    weight * value(at)
                })
                .sum::<f64>()
        };
        let along_rows: Vec<f64> = (0..self.values.len())
            .into_par_iter()
            .map(|i| {
                let row = &self.values[i / width * width..][..width];
                correlate(horizontal, i % width, width, &|x| row[x])
            })
            .collect();
        let values = (0..self.values.len())
            .into_par_iter()
            .map(|i| {
                let x = i % width;
                correlate(vertical, i / width, height, &|y| along_rows[y * width + x])
            })
            .collect();
        Self { width, values }
    }
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

fn linear_to_xyz([r, g, b]: [f64; 3]) -> [f64; 3] {
    [
        (10135552.0 * r + 8788810.0 * g + 4435075.0 * b) / 24577794.0,
        (2613072.0 * r + 8788810.0 * g + 887015.0 * b) / 12288897.0,
        (1425312.0 * r + 8788810.0 * g + 70074185.0 * b) / 73733382.0,
    ]
}

fn xyz_to_linear([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.241003275 * x - 1.537398934 * y - 0.498615861 * z,
        -0.969224334 * x + 1.875930071 * y + 0.041554224 * z,
        0.055639423 * x - 0.204011202 * y + 1.057148933 * z,
    ]
}

/// Converts to YCxCz, a linear form of L*a*b*, in which filters may be applied.
fn xyz_to_ycxcz(xyz: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = std::array::from_fn(|i| xyz[i] / WHITE[i]);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn ycxcz_to_xyz([y, cx, cz]: [f64; 3]) -> [f64; 3] {
    let y = (y + 16.0) / 116.0;
    let relative = [y + cx / 500.0, y, y - cz / 200.0];
    std::array::from_fn(|i| relative[i] * WHITE[i])
}

fn xyz_to_lab(xyz: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let [x, y, z] = std::array::from_fn(|i| {
        let relative = xyz[i] / WHITE[i];
        if relative > DELTA.powi(3) { relative.cbrt() } else { relative / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Applies the Hunt effect: colours look more colourful where they are brighter.
fn hunt([l, a, b]: [f64; 3]) -> [f64; 3] {
    [l, 0.01 * l * a, 0.01 * l * b]
}

/// The HyAB distance: city-block in lightness, Euclidean in the other two.
fn hyab(p: [f64; 3], q: [f64; 3]) -> f64 {
    (p[0] - q[0]).abs() + (p[1] - q[1]).hypot(p[2] - q[2])
}

/// The greatest colour difference, which is that from green to blue.
fn greatest_color_difference() -> f64 {
    let perceived = |rgb| hunt(xyz_to_lab(linear_to_xyz(rgb)));
    hyab(perceived([0.0, 1.0, 0.0]), perceived([0.0, 0.0, 1.0]))
}

/// Maps differences to 0 to 1, and most of the range to small ones.
fn redistribute(difference: f64, greatest: f64) -> f64 {
    let knee = PC * greatest;
    if difference < knee { PT / knee * difference } else { PT + (difference - knee) / (greatest - knee) * (1.0 - PT) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(reference: &[[f32; 3]], test: &[[f32; 3]], width: u32) -> f64 {
        let errors = flip(reference, test, width, DEFAULT_PIXELS_PER_DEGREE);
        errors.iter().sum::<f64>() / errors.len() as f64
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
