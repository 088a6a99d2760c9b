//! A processing element that computes real pixels and counts what it did: the adders, multipliers, divider and
//! exponential unit are methods, and every number goes through one of them. Nothing here is read from a table, so the
//! counts can be held against the paper's Table II.
//!
//! The paper says how many units a PE has, not how they are wired. This is one wiring that needs exactly those:
//!
//! - **Triangle**, 9 numbers in: the planes of u/w, v/w and 1/w over the screen, 3 each. Out: u, v and depth.
//! - **Gaussian**, 9 numbers in: mean (2), the three coefficients of the exponent, log-opacity, colour (3). Opacity is
//!   folded into the exponent; with the opacity as a factor there would be 11 multiplications on 10 multipliers. The
//!   two thresholds are subtractions on the adders. Out: colour; transmittance stays in the tile buffer.

use timing::pe::Operations;

/// A plane over the screen: `[x, y, 1]` times the coefficients.
pub type Plane = [f32; 3];

/// The nine numbers of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// u/w, the second vertex's weight over w.
    pub u: Plane,
    /// v/w, the third vertex's weight over w.
    pub v: Plane,
    /// 1/w.
    pub w: Plane,
}

/// The nine numbers of a Gaussian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaussian {
    /// Pixels.
    pub mean: [f32; 2],
    /// Of dx^2, dx dy and dy^2 in the exponent.
    pub exponent: [f32; 3],
    /// The natural logarithm of the opacity.
    pub log_opacity: f32,
    /// Red, green, blue.
    pub color: [f32; 3],
}

/// What a pixel of the tile buffer holds in Gaussian mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// Accumulated colour.
    pub color: [f32; 3],
    /// Transmittance.
    pub transmittance: f32,
    /// Whether no Gaussian may change it any more.
    pub finished: bool,
}

impl Default for Pixel {
    fn default() -> Self {
        Self {
            color: [0.0; 3],
            transmittance: 1.0,
            finished: false,
        }
    }
}

/// The thresholds of a draw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// Least alpha that contributes.
    pub alpha_floor: f32,
    /// Greatest alpha.
    pub alpha_ceiling: f32,
    /// Least transmittance.
    pub transmittance_floor: f32,
}

/// What a triangle gives a pixel that it covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fragment {
    /// The second vertex's weight, perspective-correct.
    pub u: f32,
    /// The third vertex's weight.
    pub v: f32,
    /// Depth.
    pub depth: f32,
}

/// A processing element.
#[derive(Clone, Debug, Default)]
pub struct Pe {
    /// What it has done.
    pub operations: Operations,
}

impl Pe {
    fn add(&mut self, a: f32, b: f32) -> f32 {
        self.operations.add += 1;
        a + b
    }

    fn mul(&mut self, a: f32, b: f32) -> f32 {
        self.operations.mul += 1;
        a * b
    }

    fn div(&mut self, a: f32, b: f32) -> f32 {
        self.operations.div += 1;
        a / b
    }

    fn exp(&mut self, a: f32) -> f32 {
        self.operations.exp += 1;
        a.exp()
    }

    fn plane(&mut self, plane: Plane, [x, y]: [f32; 2]) -> f32 {
        let along = self.mul(plane[0], x);
        let down = self.mul(plane[1], y);
        let sum = self.add(along, down);
        self.add(sum, plane[2])
    }

    /// Evaluates a triangle at a pixel's centre; the fragment, if the pixel is covered. Depth is
    /// `depth[0] + depth[1] / w`.
    pub fn triangle(
        &mut self,
        triangle: &Triangle,
        at: [f32; 2],
        depth: [f32; 2],
    ) -> Option<Fragment> {
        let u = self.plane(triangle.u, at);
        let v = self.plane(triangle.v, at);
        let inverse_w = self.plane(triangle.w, at);
        let w = self.div(1.0, inverse_w);
        let (u, v) = (self.mul(u, w), self.mul(v, w));
        let rest = self.add(1.0, -u);
        let rest = self.add(rest, -v);
        let scaled = self.mul(depth[1], inverse_w);
        let depth = self.add(depth[0], scaled);
        // Coverage is in the signs.
        (u >= 0.0 && v >= 0.0 && rest >= 0.0).then_some(Fragment { u, v, depth })
    }

    /// Blends a Gaussian into a pixel with this centre; returns whether it contributed.
    pub fn gaussian(
        &mut self,
        g: &Gaussian,
        at: [f32; 2],
        thresholds: &Thresholds,
        pixel: &mut Pixel,
    ) -> bool {
        let dx = self.add(at[0], -g.mean[0]);
        let dy = self.add(at[1], -g.mean[1]);
        let along = self.mul(g.exponent[0], dx);
        let across = self.mul(g.exponent[1], dy);
        let sum = self.add(along, across);
        let first = self.mul(sum, dx);
        let down = self.mul(g.exponent[2], dy);
        let second = self.mul(down, dy);
        let power = self.add(first, second);
        let power = self.add(power, g.log_opacity);
        let alpha = self.exp(power).min(thresholds.alpha_ceiling);
        let reaches = self.add(alpha, -thresholds.alpha_floor) >= 0.0;

        let t = pixel.transmittance;
        let weight = self.mul(t, alpha);
        let rest = self.add(1.0, -alpha);
        let rest = self.mul(t, rest);
        let open = self.add(rest, -thresholds.transmittance_floor) >= 0.0;
        let mut color = pixel.color;
        for (channel, value) in color.iter_mut().zip(g.color) {
            let product = self.mul(weight, value);
            *channel = self.add(*channel, product);
        }
        // Selections: a pixel that is finished, or that the Gaussian doesn't reach, keeps what it has.
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

    const THRESHOLDS: Thresholds = Thresholds {
        alpha_floor: 1.0 / 255.0,
        alpha_ceiling: 0.99,
        transmittance_floor: 1e-4,
    };

    fn gaussians() -> Vec<Gaussian> {
        (0..40)
            .map(|k| {
                let k = k as f32;
                let (a, c) = (0.02 + 0.001 * k, 0.05 - 0.0008 * k);
                Gaussian {
                    mean: [(k * 3.7) % 16.0, (k * 5.3) % 16.0],
                    exponent: [-0.5 * a, -0.01, -0.5 * c],
                    log_opacity: (0.2 + 0.02 * k).ln(),
                    color: [0.5 + 0.01 * k, 0.3, 1.0 - 0.02 * k],
                }
            })
            .collect()
    }

    /// The same in binary64, straight from the definition.
    fn reference(gaussians: &[Gaussian], at: [f32; 2]) -> ([f64; 3], f64) {
        let (mut color, mut t) = ([0.0; 3], 1.0);
        for g in gaussians {
            let [dx, dy] = [0, 1].map(|k| f64::from(at[k]) - f64::from(g.mean[k]));
            let [a, b, c] = g.exponent.map(f64::from);
            let opacity = f64::from(g.log_opacity).exp();
            let alpha = (opacity * (a * dx * dx + b * dx * dy + c * dy * dy).exp()).min(0.99);
            if alpha < 1.0 / 255.0 {
                continue;
            }
            if t * (1.0 - alpha) < 1e-4 {
                break;
            }
            for (sum, value) in color.iter_mut().zip(g.color) {
                *sum += t * alpha * f64::from(value);
            }
            t *= 1.0 - alpha;
        }
        (color, t)
    }

    #[test]
    fn a_gaussian_takes_11_additions_10_multiplications_and_an_exponential() {
        let mut pe = Pe::default();
        let gaussians = gaussians();
        let mut contributions = 0;
        for y in 0..16 {
            for x in 0..16 {
                let at = [x as f32 + 0.5, y as f32 + 0.5];
                let mut pixel = Pixel::default();
                for g in &gaussians {
                    let before = pe.operations;
                    contributions += u32::from(pe.gaussian(g, at, &THRESHOLDS, &mut pixel));
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
                    assert!(
                        (f64::from(*ours) - theirs).abs() < 2e-6,
                        "{pixel:?} {color:?}"
                    );
                }
                assert!((f64::from(pixel.transmittance) - t).abs() < 2e-6);
            }
        }
        assert!(contributions > 1000, "{contributions}");
    }

    #[test]
    fn a_triangle_takes_9_additions_9_multiplications_and_a_division() {
        // Screen positions and w of three vertices; weights and depth by solving for the planes in binary64.
        let vertices = [[1.1, 2.2, 1.0], [14.3, 3.4, 2.0], [5.7, 15.2, 4.0]];
        let plane = |values: [f64; 3]| -> Plane {
            let [[x0, y0, _], [x1, y1, _], [x2, y2, _]] = vertices;
            let area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0);
            let [d1, d2] = [values[1] - values[0], values[2] - values[0]];
            let a = (d1 * (y2 - y0) - d2 * (y1 - y0)) / area;
            let b = (d2 * (x1 - x0) - d1 * (x2 - x0)) / area;
            [a, b, values[0] - a * x0 - b * y0].map(|value| value as f32)
        };
        let inverse = vertices.map(|[_, _, w]: [f64; 3]| 1.0 / w);
        let triangle = Triangle {
            u: plane([0.0, inverse[1], 0.0]),
            v: plane([0.0, 0.0, inverse[2]]),
            w: plane(inverse),
        };
        let mut pe = Pe::default();
        let mut covered = 0;
        for y in 0..16u8 {
            for x in 0..16u8 {
                let at = [f64::from(x) + 0.5, f64::from(y) + 0.5];
                pe.operations = Operations::default();
                let fragment = pe.triangle(&triangle, at.map(|c| c as f32), [0.25, 0.5]);
                assert_eq!(pe.operations, Operations::TRIANGLE);
                // Weights on the screen, then over w.
                let weight = |a: [f64; 3], b: [f64; 3]| {
                    (b[0] - a[0]) * (at[1] - a[1]) - (b[1] - a[1]) * (at[0] - a[0])
                };
                let [p, q, r] = vertices;
                let screen = [weight(q, r), weight(r, p), weight(p, q)];
                let inside = screen.iter().all(|&w| w >= 0.0);
                assert_eq!(fragment.is_some(), inside, "{at:?} {screen:?}");
                if let Some(fragment) = fragment {
                    covered += 1;
                    let over: Vec<_> = screen.iter().zip(inverse).map(|(s, i)| s * i).collect();
                    let sum: f64 = over.iter().sum();
                    assert!((f64::from(fragment.u) - over[1] / sum).abs() < 1e-5);
                    assert!((f64::from(fragment.v) - over[2] / sum).abs() < 1e-5);
                    let depth = 0.25 + 0.5 * sum / screen.iter().sum::<f64>();
                    assert!((f64::from(fragment.depth) - depth).abs() < 1e-6);
                }
            }
        }
        assert!(covered > 50, "{covered}");
    }

    #[test]
    fn only_what_contributes_changes_a_pixel() {
        let mut pe = Pe::default();
        let mut pixel = Pixel::default();
        let opaque = Gaussian {
            mean: [0.5, 0.5],
            exponent: [-0.5, 0.0, -0.5],
            log_opacity: 0.95f32.ln(),
            color: [1.0; 3],
        };
        assert!(!pe.gaussian(&opaque, [9.5, 0.5], &THRESHOLDS, &mut pixel));
        assert_eq!(pixel, Pixel::default());
        for _ in 0..3 {
            assert!(pe.gaussian(&opaque, [0.5, 0.5], &THRESHOLDS, &mut pixel));
        }
        let before = pixel;
        assert!(!pe.gaussian(&opaque, [0.5, 0.5], &THRESHOLDS, &mut pixel));
        assert!(pixel.finished && pixel.color == before.color);
    }
}
