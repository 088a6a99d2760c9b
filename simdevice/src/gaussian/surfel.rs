//! Surfels, or 2D Gaussians: flat discs whose exact projection is evaluated, without linearization.
//!
//! With the disc's axes `a` and `b` (scaled) and its centre `t`, all in camera axes, a ray `r` meets its plane at
//! `u a + v b + t`, where `u = (b x t) . r / w`, `v = (t x a) . r / w` and `w = (a x b) . r`: Cramer's rule for the
//! matrix `[a b t]`. With `r` at `d` pixels from the mean, the numerators are linear in `d` and zero at the mean, where
//! they lose no digits; `w` is linear, too. Everything is binary64, without fused operations.

use super::camera::{LN_2, ViewConstants};
use super::footprint::{Ellipse, TileFootprint, TileSpan, Visible};
use super::ray_depth;
use super::scratch::Scratch;
use crate::state::gaussian::CameraModel;
use fearless_simd::{Simd, f64x8, prelude::*};

/// The factor from a squared distance to an exponent of 2.
const UNIT: f64 = 0.5 / std::f64::consts::LN_2;

/// The least determinant, relative to its terms, that is not taken for zero.
const LEAST_DETERMINANT: f64 = 1e-9;

/// A disc in the picture.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Surfel {
    /// The gradients of `u w` and `v w` per pixel in x and y. Both are zero at the mean.
    across: [[f64; 2]; 2],
    /// The value of `w` at the mean, not negative, and its gradient per pixel in x and y.
    scale: [f64; 3],
    /// The upper bound of `w`: the ray meets the disc beyond the near plane only where `w` is between zero and this.
    limit: f64,
    /// The bounding box of pixels that it may reach: left, right, top, bottom, in framebuffer pixels.
    bounds: [f64; 4],
}

/// The place of a disc in camera space, and the camera.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    pub(super) model: CameraModel,
    pub(super) focal: [f64; 2],
    pub(super) near: f64,
    /// The axes, each as long as its standard deviation, in camera axes.
    pub(super) axes: [[f64; 3]; 2],
    pub(super) centre: [f64; 3],
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

impl Surfel {
    /// The surfel of a disc, without bounds.
    pub(super) fn new(placed: &Placed) -> Self {
        let [a, b] = placed.axes;
        let [fx, fy] = placed.focal;
        let depth = placed.centre[2];
        let is_parallel = placed.model == CameraModel::Orthographic;
        let ray = if is_parallel { [0.0, 0.0, 1.0] } else { placed.centre.map(|c| c / depth) };
        let normal = cross(a, b);
        let distance = if is_parallel { 1.0 } else { depth };
        let [u, v] = [cross(b, ray), cross(ray, a)].map(|c| [distance * c[0] / fx, distance * c[1] / fy]);
        let mut scale =
            if is_parallel { [normal[2], 0.0, 0.0] } else { [dot(normal, ray), normal[0] / fx, normal[1] / fy] };
        if scale[0] < 0.0 {
            scale = scale.map(|w| -w);
        }
        // Only ratios matter. Scaling keeps squares from overflow and underflow.
        let all = [u[0], u[1], v[0], v[1], scale[0], scale[1], scale[2]];
        let largest = all.iter().fold(0.0f64, |a, b| a.max(b.abs()));
        if !(largest > 0.0 && largest.is_finite()) {
            return Self::default();
        }
        let scale = scale.map(|w| w / largest);
        Self {
            across: [u, v].map(|c| c.map(|c| c / largest)),
            scale,
            limit: if is_parallel { f64::INFINITY } else { depth * scale[0] / placed.near },
            bounds: [0.0; 4],
        }
    }

    /// The ellipse in the picture of the disc out to a squared distance of `extent`. If the disc's plane meets the
    /// eye's plane there, the ellipse is infinite.
    fn ellipse(&self, mean: [f64; 2], extent: f64) -> Ellipse {
        let [[ux, uy], [vx, vy]] = self.across;
        let [w, wx, wy] = self.scale;
        // (u.d)^2 + (v.d)^2 <= extent (w + w'.d)^2 is d^T P d - 2 extent w w'.d <= extent w^2.
        let xx = [ux * ux + vx * vx, extent * wx * wx];
        let yy = [uy * uy + vy * vy, extent * wy * wy];
        let xy = ux * uy + vx * vy - extent * wx * wy;
        let (p, q) = (xx[0] - xx[1], yy[0] - yy[1]);
        let determinant = p * q - xy * xy;
        let total = (xx[0] + xx[1]) * (yy[0] + yy[1]);
        if !(p > 0.0 && determinant > LEAST_DETERMINANT * total) {
            return Ellipse { mean, half: [f64::INFINITY; 2], slope: 0.0, narrowing: 1.0, peak: 0.0 };
        }
        let force = [extent * w * wx, extent * w * wy];
        let shift = [(q * force[0] - xy * force[1]) / determinant, (p * force[1] - xy * force[0]) / determinant];
        let level = extent * w * w + shift[0] * force[0] + shift[1] * force[1];
        // The covariance: level P^-1.
        let (a, b, c) = (level * q / determinant, -level * xy / determinant, level * p / determinant);
        Ellipse {
            mean: [mean[0] + shift[0], mean[1] + shift[1]],
            half: [a.sqrt(), c.sqrt()],
            slope: b / c,
            narrowing: level * level / determinant / (c * c),
            peak: b / a.sqrt(),
        }
    }

    /// Sets the bounds of the disc and the filter's circle, both out to a squared distance of `extent` about `mean`,
    /// and returns their tiles, if there are any. Spans that do not fit inline go to `others`.
    pub(super) fn reach(
        &mut self,
        mean: [f64; 2],
        (extent, low_pass): (f64, f64),
        visible: &Visible,
        others: &mut Vec<TileSpan>,
    ) -> Option<TileFootprint> {
        // NaN reaches no tile.
        if !(extent >= 0.0 && mean[0].is_finite() && mean[1].is_finite()) {
            return None;
        }
        let radius = (extent * low_pass).sqrt();
        let circle = Ellipse { mean, half: [radius; 2], slope: 0.0, narrowing: 1.0, peak: 0.0 };
        let disc = (self.scale[0] > 0.0).then(|| self.ellipse(mean, extent));
        let shapes = [disc, (low_pass > 0.0).then_some(circle)];
        self.bounds = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
        // Both shapes contain the mean, so that their union in a row of tiles is taken as one span.
        let mut rows: Vec<(u32, TileSpan)> = Vec::new();
        for shape in shapes.into_iter().flatten() {
            for axis in 0..2 {
                let (middle, half) = (shape.mean[axis], shape.half[axis]);
                self.bounds[2 * axis] = self.bounds[2 * axis].min(middle - half);
                self.bounds[2 * axis + 1] = self.bounds[2 * axis + 1].max(middle + half);
            }
            let mut spans = Vec::new();
            let reach = shape.reach(visible, &mut spans, Some(&mut 0));
            for (row, span) in reach.iter().flat_map(|reach| reach.spans(&spans)) {
                if span.first == span.end {
                    continue;
                }
                match rows.iter_mut().find(|(other, _)| *other == row) {
                    Some((_, other)) => {
                        other.first = other.first.min(span.first);
                        other.end = other.end.max(span.end);
                    }
                    None => rows.push((row, span)),
                }
            }
        }
        let first = rows.iter().map(|(row, _)| *row).min()?;
        let last = rows.iter().map(|(row, _)| *row).max()?;
        let mut reach = TileFootprint::new(first as u16, (last - first + 1) as u16, others);
        for (row, span) in rows {
            reach.set(others, (row - first) as u16, span);
        }
        Some(reach)
    }

    /// The blocks of 4x4 pixels that it may reach in the tile of 16x16 pixels at `corner`: a bit for each, row by row.
    pub(crate) fn blocks(&self, corner: [u32; 2]) -> u64 {
        let axis = |axis: usize| {
            let corner = f64::from(corner[axis]);
            let [low, high] = [self.bounds[2 * axis] - corner, self.bounds[2 * axis + 1] - corner];
            let touched = |block: &usize| {
                let first = (4 * block) as f64 + 0.5;
                first + 3.0 >= low && first <= high
            };
            (0..4).filter(touched).fold(0u64, |bits, block| bits | 1 << block)
        };
        let (columns, rows) = (axis(0), axis(1));
        let mut blocks = 0;
        for row in (0..4).filter(|row| rows >> row & 1 == 1) {
            blocks |= columns << (4 * row);
        }
        blocks
    }

    /// The amount that is subtracted from the exponent of 2 at eight points, `dx` and `dy` pixels from the mean.
    /// `inverse_low_pass` is the inverse of the filter's variance, if there is a filter.
    #[inline(always)]
    pub(crate) fn falloff<S: Simd>(
        &self,
        simd: S,
        dx: f64x8<S>,
        dy: f64x8<S>,
        inverse_low_pass: Option<f64>,
    ) -> f64x8<S> {
        let [[ux, uy], [vx, vy]] = self.across;
        let [w, wx, wy] = self.scale;
        let (u, v) = (dx * ux + dy * uy, dx * vx + dy * vy);
        let w = dx * wx + dy * wy + w;
        let square = w * w;
        let meets = w.simd_gt(0.0) & w.simd_lt(self.limit) & square.simd_gt(0.0);
        let infinite = f64x8::splat(simd, f64::INFINITY);
        let mut distance = meets.select((u * u + v * v) / square, infinite);
        if let Some(inverse) = inverse_low_pass {
            let filter = (dx * dx + dy * dy) * inverse;
            distance = distance.simd_lt(filter).select(distance, filter);
        }
        distance * UNIT
    }
}

/// The surfel of a kept Gaussian, and the tiles that it reaches, if there are any.
pub(super) fn surfel_of(
    view: &ViewConstants,
    at: usize,
    scratch: &Scratch,
    spans: &mut Vec<TileSpan>,
) -> (Surfel, Option<TileFootprint>) {
    let [w, x, y, z] = &*scratch.rotation;
    let axes = ray_depth::axes([w[at], x[at], y[at], z[at]]);
    let r = &view.rotation;
    let placed = |axis: usize| {
        let [x, y, z] = axes[axis].map(|c| c * scratch.scale[axis][at]);
        [0, 1, 2].map(|row| x * r[3 * row] + y * r[3 * row + 1] + z * r[3 * row + 2])
    };
    let [x, y, z] = &*scratch.camera;
    let mut surfel = Surfel::new(&Placed {
        model: view.model,
        focal: view.focal,
        near: view.near.into(),
        axes: [placed(0), placed(1)],
        centre: [x[at], y[at], z[at]],
    });
    let flat = &*scratch.flat;
    // The same margin as for volumes, in `preprocess`.
    let room = flat.log2_opacity[at] - view.log2_floor;
    let extent = (room + room.abs() * 1e-5 + 1e-3) * (2.0 * LN_2);
    let mean = [flat.mean[0][at], flat.mean[1][at]];
    let reach = surfel.reach(mean, (extent, view.low_pass), &view.visible, spans);
    (surfel, reach)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::SimdLevel;
    use crate::token_of;
    use devmem::dispatch;
    use fearless_simd::Level;
    use gaurast_runner::{Case, simd_levels};
    use proptest::prelude::*;

    const VISIBLE: Visible = Visible { left: 0, top: 0, right: 160, bottom: 96 };
    const FOCAL: [f64; 2] = [90.0, 80.0];
    const CENTER: [f64; 2] = [80.0, 48.0];
    const LOW_PASS: f64 = 0.5;

    /// The falloff at a pixel's centre. Asserts that the level gives the bits of the simplest.
    fn falloff(level: Level, surfel: &Surfel, d: [f64; 2]) -> f64 {
        let simplest = SimdLevel::Baseline.resolve().unwrap();
        let [found, expected] = [level, simplest].map(|level| {
            dispatch!(level, simd => {
                let [dx, dy] = d.map(|d| f64x8::splat(simd, d));
                surfel.falloff(simd, dx, dy, Some(1.0 / LOW_PASS)).as_slice()[3]
            })
        });
        assert_eq!(found.to_bits(), expected.to_bits());
        found
    }

    #[gaurast_runner::test(each = simd_levels())]
    fn it_is_the_ray_s_meeting_and_stays_in_its_bounds(case: &Case) {
        let level = token_of(case);
        proptest!(|(
            x in -2.0..2.0f64, y in -1.0..1.0f64, z in 0.6..6.0f64,
            a in prop::array::uniform3(-1.0..1.0f64), b in prop::array::uniform3(-1.0..1.0f64),
            size in 0.01..1.0f64, extent in 0.5..11.0f64,
        )| {
            let axes = [a.map(|c| c * size), b.map(|c| c * size)];
            for model in [CameraModel::Pinhole, CameraModel::Orthographic] {
                let t = [x, y, z];
                let mean = match model {
                    CameraModel::Orthographic => [0, 1].map(|i| FOCAL[i] * t[i] / 3.0 + CENTER[i]),
                    _ => [0, 1].map(|i| FOCAL[i] * t[i] / z + CENTER[i]),
                };
                let focal = match model {
                    CameraModel::Orthographic => FOCAL.map(|f| f / 3.0),
                    _ => FOCAL,
                };
                let placed = Placed { model, focal, near: 0.2, axes, centre: t };
                let mut surfel = Surfel::new(&placed);
                let mut others = Vec::new();
                let reach = surfel.reach(mean, (extent, LOW_PASS), &VISIBLE, &mut others);
                let mut listed = std::collections::BTreeSet::new();
                for (row, span) in reach.iter().flat_map(|reach| reach.spans(&others)) {
                    listed.extend((span.first..span.end).map(|column| (u32::from(column), row)));
                }
                for py in (0..96).step_by(3) {
                    for px in (0..160).step_by(3) {
                        let at = [f64::from(px) + 0.5, f64::from(py) + 0.5];
                        let d = [at[0] - mean[0], at[1] - mean[1]];
                        let r = [0, 1].map(|i| (at[i] - CENTER[i]) / focal[i]);
                        let (from, ray) = match model {
                            CameraModel::Orthographic => ([r[0], r[1], 0.0], [0.0, 0.0, 1.0]),
                            _ => ([0.0; 3], [r[0], r[1], 1.0]),
                        };
                        let t = [0, 1, 2].map(|i| t[i] - from[i]);
                        let w = dot(cross(axes[0], axes[1]), ray);
                        let depth = dot(cross(axes[0], axes[1]), t) / w;
                        let u = dot(cross(axes[1], t), ray) / w;
                        let v = dot(cross(t, axes[0]), ray) / w;
                        let filter = (d[0] * d[0] + d[1] * d[1]) / LOW_PASS;
                        let is_before = model == CameraModel::Pinhole && depth <= 0.2;
                        let expected = if is_before { filter } else { filter.min(u * u + v * v) };
                        let found = falloff(level, &surfel, d) / UNIT;
                        // Grazing planes amplify rounding.
                        if w.abs() > 1e-4 * size * size && (depth - 0.2).abs() > 1e-6 {
                            prop_assert!((found - expected).abs() <= 1e-6 * (1.0 + expected), "{found} {expected}");
                        }
                        if found <= extent * (1.0 - 1e-6) {
                            prop_assert!(listed.contains(&(px / 16, py / 16)), "{px} {py}");
                            let corner = [px / 16 * 16, py / 16 * 16];
                            let block = py % 16 / 4 * 4 + px % 16 / 4;
                            prop_assert!(surfel.blocks(corner) >> block & 1 == 1, "{px} {py}");
                        }
                    }
                }
            }
        });
    }

    #[gaurast_runner::test(each = simd_levels())]
    fn a_disc_seen_edge_on_is_its_filter(case: &Case) {
        let placed = Placed {
            model: CameraModel::Pinhole,
            focal: FOCAL,
            near: 0.2,
            axes: [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
            centre: [0.0, 0.0, 4.0],
        };
        let surfel = Surfel::new(&placed);
        for d in [[0.0, 0.0], [2.0, 0.0], [0.0, 1.0], [3.0, -2.0]] {
            let filter = (d[0] * d[0] + d[1] * d[1]) / LOW_PASS;
            assert_eq!(falloff(token_of(case), &surfel, d), filter * UNIT);
        }
    }
}
