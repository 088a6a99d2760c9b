//! The processing element. The adders, multipliers, divider and exponential unit are methods that compute the bits of
//! [`crate::number`] and [`crate::exponential`], and every number is computed by one of them. The operations are
//! counted, not read from a table, so that tests can compare them with the paper's Table II; `rtl/pe.sv` computes the
//! same bits.
//!
//! The paper gives the numbers of units of a PE, not how they are connected. This is one design that needs exactly
//! them:
//!
//! - **Triangle**, 9 numbers in: the planes of u/w, v/w and 1/w over the tile, 3 each. Out: u, v and depth.
//! - **Gaussian**, 9 numbers in: mean (2), the three coefficients of the exponent, log-opacity, colour (3). Opacity is
//!   folded into the exponent; with the opacity as a factor there would be 11 multiplications on 10 multipliers. The
//!   exponent is to the base 2, so that the exponential needs no multiplication by log2(e). The two thresholds are
//!   subtractions on the adders. Out: colour; transmittance stays in the tile buffer.

use crate::exponential::{self, Exponential};
use crate::number::Format;
use timing::pe::Operations;

/// A plane over the tile: `[x, y, 1]` times the coefficients.
pub type Plane = [u32; 3];

/// The nine numbers of a triangle. Positions are relative to the tile's corner, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Triangle {
    /// The plane of u/w, the second vertex's weight over w.
    pub u: Plane,
    /// The plane of v/w, the third vertex's weight over w.
    pub v: Plane,
    /// The plane of 1/w.
    pub w: Plane,
}

impl Triangle {
    /// The triangle in numbers of a format.
    pub fn new(format: Format, [u, v, w]: [[f32; 3]; 3]) -> Self {
        let plane = |plane: [f32; 3]| plane.map(|value| format.number(value));
        let [u, v, w] = [u, v, w].map(plane);
        Self { u, v, w }
    }

    /// The numbers in the order of a list in memory.
    pub fn numbers(&self) -> [u32; 9] {
        let Self { u, v, w } = self;
        [u[0], u[1], u[2], v[0], v[1], v[2], w[0], w[1], w[2]]
    }
}

/// The nine numbers of a Gaussian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gaussian {
    /// The mean, in pixels from the tile's corner.
    pub mean: [u32; 2],
    /// The coefficients of dx^2, dx dy and dy^2 in the exponent, to the base 2.
    pub exponent: [u32; 3],
    /// The opacity's logarithm to the base 2.
    pub log_opacity: u32,
    /// Red, green, blue.
    pub color: [u32; 3],
}

impl Gaussian {
    /// The Gaussian in numbers of a format; its exponent is to the base e, and its opacity a factor.
    pub fn new(format: Format, mean: [f32; 2], exponent: [f32; 3], opacity: f32, color: [f32; 3]) -> Self {
        let of = |value| format.number(value);
        Self {
            mean: mean.map(of),
            exponent: exponent.map(|value| of(value * std::f32::consts::LOG2_E)),
            log_opacity: of(opacity.log2()),
            color: color.map(of),
        }
    }

    /// The numbers in the order of a list in memory. Each has the place of the triangle's number that goes to the same
    /// unit.
    pub fn numbers(&self) -> [u32; 9] {
        let ([mx, my], [a, b, c], [red, green, blue]) = (self.mean, self.exponent, self.color);
        [a, b, mx, c, my, red, green, blue, self.log_opacity]
    }
}

/// A pixel of the tile buffer in Gaussian mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pixel {
    /// Accumulated colour.
    pub color: [u32; 3],
    /// Transmittance.
    pub transmittance: u32,
    /// True if no Gaussian may change it any more.
    pub finished: bool,
}

impl Pixel {
    /// A black pixel with full transmittance.
    pub fn new(format: Format) -> Self {
        Self { color: [0; 3], transmittance: format.one(), finished: false }
    }
}

/// The thresholds of a draw, all of them positive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Thresholds {
    /// The least alpha that contributes.
    pub alpha_floor: u32,
    /// The greatest alpha.
    pub alpha_ceiling: u32,
    /// The least transmittance.
    pub transmittance_floor: u32,
}

impl Thresholds {
    /// The thresholds of the original 3DGS code.
    pub fn new(format: Format) -> Self {
        Self {
            alpha_floor: format.number(1.0 / 255.0),
            alpha_ceiling: format.number(0.99),
            transmittance_floor: format.number(1e-4),
        }
    }
}

/// The weights and depth of a triangle at a pixel that it covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fragment {
    /// The second vertex's weight, perspective-correct.
    pub u: u32,
    /// The third vertex's weight.
    pub v: u32,
    /// Depth.
    pub depth: u32,
}

/// A processing element.
#[derive(Clone, Debug)]
pub struct Pe {
    /// The layout of its numbers.
    pub format: Format,
    /// Its exponential unit's design.
    pub exponential: Exponential,
    /// The operations done so far.
    pub operations: Operations,
}

impl Pe {
    /// A processing element with no operations counted.
    pub fn new(format: Format, exponential: Exponential) -> Self {
        Self { format, exponential, operations: Operations::default() }
    }

    fn add(&mut self, a: u32, b: u32) -> u32 {
        self.operations.add += 1;
        self.format.add(a, b)
    }

    fn sub(&mut self, a: u32, b: u32) -> u32 {
        self.operations.add += 1;
        self.format.sub(a, b)
    }

    fn mul(&mut self, a: u32, b: u32) -> u32 {
        self.operations.mul += 1;
        self.format.mul(a, b)
    }

    fn div(&mut self, a: u32, b: u32) -> u32 {
        self.operations.div += 1;
        self.format.div(a, b)
    }

    fn exp2(&mut self, a: u32) -> u32 {
        self.operations.exp += 1;
        exponential::exp2(self.format, self.exponential, a)
    }

    fn plane(&mut self, plane: Plane, [x, y]: [u32; 2]) -> u32 {
        let along = self.mul(plane[0], x);
        let down = self.mul(plane[1], y);
        let sum = self.add(along, down);
        self.add(sum, plane[2])
    }

    /// Evaluates a triangle at a pixel's centre. Returns the fragment; None if the pixel is not covered. Depth is
    /// `depth[0] + depth[1] / w`.
    pub fn triangle(&mut self, triangle: &Triangle, at: [u32; 2], depth: [u32; 2]) -> Option<Fragment> {
        let u = self.plane(triangle.u, at);
        let v = self.plane(triangle.v, at);
        let inverse_w = self.plane(triangle.w, at);
        let w = self.div(self.format.one(), inverse_w);
        let (u, v) = (self.mul(u, w), self.mul(v, w));
        let rest = self.sub(self.format.one(), u);
        let rest = self.sub(rest, v);
        let scaled = self.mul(depth[1], inverse_w);
        let depth = self.add(depth[0], scaled);
        // The signs tell whether the pixel is covered.
        let outside = [u, v, rest].into_iter().any(|weight| self.format.is_negative(weight));
        (!outside).then_some(Fragment { u, v, depth })
    }

    /// Blends a Gaussian into the pixel with this centre. Returns true if it contributed.
    pub fn gaussian(&mut self, g: &Gaussian, at: [u32; 2], thresholds: &Thresholds, pixel: &mut Pixel) -> bool {
        let dx = self.sub(at[0], g.mean[0]);
        let dy = self.sub(at[1], g.mean[1]);
        let along = self.mul(g.exponent[0], dx);
        let across = self.mul(g.exponent[1], dy);
        let sum = self.add(along, across);
        let first = self.mul(sum, dx);
        let down = self.mul(g.exponent[2], dy);
        let second = self.mul(down, dy);
        let power = self.add(first, second);
        let power = self.add(power, g.log_opacity);
        // Both are positive, so they compare as integers.
        let alpha = self.exp2(power).min(thresholds.alpha_ceiling);
        let below = self.sub(alpha, thresholds.alpha_floor);
        let reaches = !self.format.is_negative(below);

        let t = pixel.transmittance;
        let weight = self.mul(t, alpha);
        let rest = self.sub(self.format.one(), alpha);
        let rest = self.mul(t, rest);
        let below = self.sub(rest, thresholds.transmittance_floor);
        let open = !self.format.is_negative(below);
        let mut color = pixel.color;
        for (channel, value) in color.iter_mut().zip(g.color) {
            let product = self.mul(weight, value);
            *channel = self.add(*channel, product);
        }
        // Selections: a pixel that is finished, or that the Gaussian doesn't reach, is unchanged.
        if pixel.finished || !reaches {
            return false;
        }
        pixel.finished = !open;
        if open {
            pixel.color = color;
            pixel.transmittance = rest;
        }
        open
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SINGLE: Format = Format::SINGLE;

    fn pe() -> Pe {
        Pe::new(SINGLE, Exponential::Table)
    }

    fn gaussians() -> Vec<Gaussian> {
        (0..40)
            .map(|k| {
                let k = k as f32;
                let (a, c) = (0.02 + 0.001 * k, 0.05 - 0.0008 * k);
                Gaussian::new(
                    SINGLE,
                    [(k * 3.7) % 16.0, (k * 5.3) % 16.0],
                    [-0.5 * a, -0.01, -0.5 * c],
                    0.2 + 0.02 * k,
                    [0.5 + 0.01 * k, 0.3, 1.0 - 0.02 * k],
                )
            })
            .collect()
    }

    /// The result in binary64, straight from the definition.
    fn reference(gaussians: &[Gaussian], at: [u32; 2]) -> ([f64; 3], f64) {
        let (mut color, mut t) = ([0.0; 3], 1.0);
        for g in gaussians {
            let [dx, dy] = [0, 1].map(|k| SINGLE.value(at[k]) - SINGLE.value(g.mean[k]));
            let [a, b, c] = g.exponent.map(|value| SINGLE.value(value));
            let opacity = SINGLE.value(g.log_opacity).exp2();
            let alpha = (opacity * (a * dx * dx + b * dx * dy + c * dy * dy).exp2()).min(0.99);
            if alpha < 1.0 / 255.0 {
                continue;
            }
            if t * (1.0 - alpha) < 1e-4 {
                break;
            }
            for (sum, value) in color.iter_mut().zip(g.color) {
                *sum += t * alpha * SINGLE.value(value);
            }
            t *= 1.0 - alpha;
        }
        (color, t)
    }

    #[test]
    fn a_gaussian_takes_11_additions_10_multiplications_and_an_exponential() {
        let mut pe = pe();
        let gaussians = gaussians();
        let mut contributions = 0;
        for y in 0..16 {
            for x in 0..16 {
                let at = [x, y].map(|c| SINGLE.number(c as f32 + 0.5));
                let mut pixel = Pixel::new(SINGLE);
                for g in &gaussians {
                    let before = pe.operations;
                    contributions += u32::from(pe.gaussian(g, at, &Thresholds::new(SINGLE), &mut pixel));
                    let after = pe.operations;
                    let spent = Operations {
                        add: after.add - before.add,
                        mul: after.mul - before.mul,
                        div: after.div - before.div,
                        exp: after.exp - before.exp,
                    };
                    assert_eq!(spent, Operations::GAUSSIAN);
                }
                let (color, t) = reference(&gaussians, at);
                for (ours, theirs) in pixel.color.iter().zip(color) {
                    assert!((SINGLE.value(*ours) - theirs).abs() < 2e-6, "{pixel:?} {color:?}");
                }
                assert!((SINGLE.value(pixel.transmittance) - t).abs() < 2e-6);
            }
        }
        assert!(contributions > 1000, "{contributions}");
    }

    #[test]
    fn a_triangle_takes_9_additions_9_multiplications_and_a_division() {
        // Screen positions and w of three vertices; weights and depth by solving for the planes in binary64.
        let vertices = [[1.1, 2.2, 1.0], [14.3, 3.4, 2.0], [5.7, 15.2, 4.0]];
        let plane = |values: [f64; 3]| -> [f32; 3] {
            let [[x0, y0, _], [x1, y1, _], [x2, y2, _]] = vertices;
            let area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0);
            let [d1, d2] = [values[1] - values[0], values[2] - values[0]];
            let a = (d1 * (y2 - y0) - d2 * (y1 - y0)) / area;
            let b = (d2 * (x1 - x0) - d1 * (x2 - x0)) / area;
            [a, b, values[0] - a * x0 - b * y0].map(|value| value as f32)
        };
        let inverse = vertices.map(|[_, _, w]: [f64; 3]| 1.0 / w);
        let triangle =
            Triangle::new(SINGLE, [plane([0.0, inverse[1], 0.0]), plane([0.0, 0.0, inverse[2]]), plane(inverse)]);
        let mut pe = pe();
        let mut covered = 0;
        for y in 0..16u8 {
            for x in 0..16u8 {
                let at = [f64::from(x) + 0.5, f64::from(y) + 0.5];
                pe.operations = Operations::default();
                let depth = [0.25, 0.5].map(|value| SINGLE.number(value));
                let fragment = pe.triangle(&triangle, at.map(|c| SINGLE.number(c as f32)), depth);
                assert_eq!(pe.operations, Operations::TRIANGLE);
                // Weights on the screen, then over w.
                let weight = |a: [f64; 3], b: [f64; 3]| (b[0] - a[0]) * (at[1] - a[1]) - (b[1] - a[1]) * (at[0] - a[0]);
                let [p, q, r] = vertices;
                let screen = [weight(q, r), weight(r, p), weight(p, q)];
                let inside = screen.iter().all(|&w| w >= 0.0);
                assert_eq!(fragment.is_some(), inside, "{at:?} {screen:?}");
                if let Some(fragment) = fragment {
                    covered += 1;
                    let over: Vec<_> = screen.iter().zip(inverse).map(|(s, i)| s * i).collect();
                    let sum: f64 = over.iter().sum();
                    assert!((SINGLE.value(fragment.u) - over[1] / sum).abs() < 1e-5);
                    assert!((SINGLE.value(fragment.v) - over[2] / sum).abs() < 1e-5);
                    let depth = 0.25 + 0.5 * sum / screen.iter().sum::<f64>();
                    assert!((SINGLE.value(fragment.depth) - depth).abs() < 1e-6);
                }
            }
        }
        assert!(covered > 50, "{covered}");
    }

    #[test]
    fn only_what_contributes_changes_a_pixel() {
        let mut pe = pe();
        let mut pixel = Pixel::new(SINGLE);
        let at = |x: f32| [SINGLE.number(x), SINGLE.number(0.5)];
        let opaque = Gaussian::new(SINGLE, [0.5, 0.5], [-0.5, 0.0, -0.5], 0.95, [1.0; 3]);
        let thresholds = Thresholds::new(SINGLE);
        assert!(!pe.gaussian(&opaque, at(9.5), &thresholds, &mut pixel));
        assert_eq!(pixel, Pixel::new(SINGLE));
        for _ in 0..3 {
            assert!(pe.gaussian(&opaque, at(0.5), &thresholds, &mut pixel));
        }
        let before = pixel;
        assert!(!pe.gaussian(&opaque, at(0.5), &thresholds, &mut pixel));
        assert!(pixel.finished && pixel.color == before.color);
    }
}
