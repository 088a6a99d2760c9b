//! The naive form of FLIP, in binary64, one pixel after the other.

use super::{PC, PT, QC, W, WHITE, balanced, gaussian, normalised, sample, srgb_to_linear};
use std::f64::consts::PI;

/// Exponent of the feature difference.
const QF: f64 = 0.5;

/// The FLIP error, 0 to 1, of each pixel of `test`. Both images are sRGB, clamped to 0 to 1 here,
/// with `width` pixels a row.
pub(super) fn flip(reference: &[[f32; 3]], test: &[[f32; 3]], width: u32, pixels_per_degree: f64) -> Vec<f64> {
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
            .map(|i| {
                let row = &self.values[i / width * width..][..width];
                correlate(horizontal, i % width, width, &|x| row[x])
            })
            .collect();
        let values = (0..self.values.len())
            .map(|i| {
                let x = i % width;
                correlate(vertical, i / width, height, &|y| along_rows[y * width + x])
            })
            .collect();
        Self { width, values }
    }
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
pub(super) fn greatest_color_difference() -> f64 {
    let perceived = |rgb| hunt(xyz_to_lab(linear_to_xyz(rgb)));
    hyab(perceived([0.0, 1.0, 0.0]), perceived([0.0, 0.0, 1.0]))
}

/// Maps differences to 0 to 1, and most of the range to small ones.
fn redistribute(difference: f64, greatest: f64) -> f64 {
    let knee = PC * greatest;
    if difference < knee { PT / knee * difference } else { PT + (difference - knee) / (greatest - knee) * (1.0 - PT) }
}
