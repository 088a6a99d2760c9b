//! The projection of discs to surfels, and the tiles that these reach.

use super::ellipse::Ellipse;
use super::scratch::Scratch;
use super::screen::LN_2;
use crate::gaussian::linear_algebra::{axes, cross, dot};
use crate::gaussian::splats::footprint::{TileFootprint, TileSpan};
use crate::gaussian::splats::surfel::Surfel;
use crate::gaussian::view::constants::ViewConstants;
use crate::gaussian::view::visible::Visible;
use crate::state::gaussian::CameraModel;

/// The least determinant, relative to its terms, that is not taken for zero.
const LEAST_DETERMINANT: f64 = 1e-9;

/// A disc in camera space, and the camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Disc {
    pub(crate) model: CameraModel,
    pub(crate) focal: [f64; 2],
    pub(crate) near: f64,
    /// The axes, each as long as its standard deviation, in camera axes.
    pub(crate) axes: [[f64; 3]; 2],
    pub(crate) centre: [f64; 3],
}

impl Disc {
    /// The surfel of a disc, without bounds.
    pub(crate) fn surfel(&self) -> Surfel {
        let [a, b] = self.axes;
        let [fx, fy] = self.focal;
        let depth = self.centre[2];
        let is_parallel = self.model == CameraModel::Orthographic;
        let ray = if is_parallel { [0.0, 0.0, 1.0] } else { self.centre.map(|c| c / depth) };
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
            return Surfel::default();
        }
        let scale = scale.map(|w| w / largest);
        Surfel {
            across: [u, v].map(|c| c.map(|c| c / largest)),
            scale,
            limit: if is_parallel { f64::INFINITY } else { depth * scale[0] / self.near },
            bounds: [0.0; 4],
        }
    }
}

/// The ellipse in the picture of the disc out to a squared distance of `extent`. If the disc's plane meets the
/// eye's plane there, the ellipse is infinite.
fn ellipse(surfel: &Surfel, mean: [f64; 2], extent: f64) -> Ellipse {
    let [[ux, uy], [vx, vy]] = surfel.across;
    let [w, wx, wy] = surfel.scale;
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
fn reach(
    surfel: &mut Surfel,
    mean: [f64; 2],
    extent: f64,
    low_pass: f64,
    visible: &Visible,
    others: &mut Vec<TileSpan>,
) -> Option<TileFootprint> {
    // NaN reaches no tile.
    if !(extent >= 0.0 && mean[0].is_finite() && mean[1].is_finite()) {
        return None;
    }
    let radius = (extent * low_pass).sqrt();
    let circle = Ellipse { mean, half: [radius; 2], slope: 0.0, narrowing: 1.0, peak: 0.0 };
    let disc = (surfel.scale[0] > 0.0).then(|| ellipse(surfel, mean, extent));
    let shapes = [disc, (low_pass > 0.0).then_some(circle)];
    surfel.bounds = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
    // Both shapes contain the mean, so that their union in a row of tiles is taken as one span.
    let mut rows: Vec<(u32, TileSpan)> = Vec::new();
    for shape in shapes.into_iter().flatten() {
        for axis in 0..2 {
            let (middle, half) = (shape.mean[axis], shape.half[axis]);
            surfel.bounds[2 * axis] = surfel.bounds[2 * axis].min(middle - half);
            surfel.bounds[2 * axis + 1] = surfel.bounds[2 * axis + 1].max(middle + half);
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

/// A surfel, and the tiles that it reaches, if there are any.
pub(crate) struct ProjectedSurfel {
    pub(crate) surfel: Surfel,
    pub(crate) footprint: Option<TileFootprint>,
}

/// The surfel of a kept Gaussian.
pub(crate) fn surfel_of(
    view: &ViewConstants,
    at: usize,
    scratch: &Scratch,
    spans: &mut Vec<TileSpan>,
) -> ProjectedSurfel {
    let [w, x, y, z] = &*scratch.rotation;
    let axes = axes([w[at], x[at], y[at], z[at]]);
    let r = &view.rotation;
    let placed = |axis: usize| {
        let [x, y, z] = axes[axis].map(|c| c * scratch.scale[axis][at]);
        [0, 1, 2].map(|row| x * r[3 * row] + y * r[3 * row + 1] + z * r[3 * row + 2])
    };
    let [x, y, z] = &*scratch.camera;
    let disc = Disc {
        model: view.model,
        focal: view.focal,
        near: view.near.into(),
        axes: [placed(0), placed(1)],
        centre: [x[at], y[at], z[at]],
    };
    let mut surfel = disc.surfel();
    let screen = &*scratch.screen;
    // The same margin as for volumes, in [`shape`](super::screen::shape).
    let log2_range = screen.log2_opacity[at] - view.log2_floor;
    let extent = (log2_range + log2_range.abs() * 1e-5 + 1e-3) * (2.0 * LN_2);
    let mean = [screen.mean[0][at], screen.mean[1][at]];
    let footprint = reach(&mut surfel, mean, extent, view.low_pass, &view.visible, spans);
    ProjectedSurfel { surfel, footprint }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gaussian::splats::surfel::UNIT;
    use crate::runtime::SimdLevel;
    use crate::token_of;
    use devmem::dispatch;
    use fearless_simd::{Level, f64x8, prelude::*};
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
                let placed = Disc { model, focal, near: 0.2, axes, centre: t };
                let mut surfel = placed.surfel();
                let mut others = Vec::new();
                let footprint = reach(&mut surfel, mean, extent, LOW_PASS, &VISIBLE, &mut others);
                let mut listed = std::collections::BTreeSet::new();
                for (row, span) in footprint.iter().flat_map(|footprint| footprint.spans(&others)) {
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
        let placed = Disc {
            model: CameraModel::Pinhole,
            focal: FOCAL,
            near: 0.2,
            axes: [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
            centre: [0.0, 0.0, 4.0],
        };
        let surfel = placed.surfel();
        for d in [[0.0, 0.0], [2.0, 0.0], [0.0, 1.0], [3.0, -2.0]] {
            let filter = (d[0] * d[0] + d[1] * d[1]) / LOW_PASS;
            assert_eq!(falloff(token_of(case), &surfel, d), filter * UNIT);
        }
    }
}
