//! The projection of discs to surfels.

use super::scratch::Scratch;
use super::screen::LN_2;
use crate::gaussian::linear_algebra::{axes, cross, dot};
use crate::gaussian::splats::surfel::Surfel;
use crate::gaussian::view::constants::ViewConstants;
use crate::state::gaussian::CameraModel;

/// The least square of half a side of a disc's rectangle, in px^2.
const LEAST_SQUARE: f64 = 1e-4;

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
    /// The rectangle of the disc's outline at one standard deviation: its middle, in pixels from the mean, and half its sides, at
    /// least a hundredth of a pixel. `None` if the outline touches the eye's plane. Beyond that plane the same formulas go on, as in
    /// gsplat.
    fn rectangle(&self) -> Option<[[f64; 2]; 2]> {
        let [a, b] = self.axes;
        let t = self.centre;
        let is_parallel = self.model == CameraModel::Orthographic;
        // The outline is where a quadratic form of the rows of [a b t] is 0; of the third row with itself it is the divisor.
        let divisor = if is_parallel { -1.0 } else { a[2] * a[2] + b[2] * b[2] - t[2] * t[2] };
        if divisor == 0.0 {
            return None;
        }
        let sides = [0, 1].map(|i| {
            let slope = if is_parallel { 0.0 } else { t[i] / t[2] };
            let along = |axis: [f64; 3]| self.focal[i] * (axis[i] - axis[2] * slope);
            let (along_a, along_b) = (along(a), along(b));
            let middle = if is_parallel { 0.0 } else { (along_a * a[2] + along_b * b[2]) / divisor };
            let square = middle * middle - (along_a * along_a + along_b * along_b) / divisor;
            [middle, square.max(LEAST_SQUARE).sqrt()]
        });
        Some([[sides[0][0], sides[1][0]], [sides[0][1], sides[1][1]]])
    }

    /// The surfel of a disc, which is not placed in the picture yet.
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
            ..Surfel::default()
        }
    }
}

/// The surfel of a kept Gaussian.
pub(crate) fn surfel_of(view: &ViewConstants, at: usize, scratch: &Scratch) -> Surfel {
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
    let screen = &*scratch.screen;
    // The same margin as for volumes, in [`shape`](super::screen::shape).
    let log2_range = screen.log2_opacity[at] - view.log2_floor;
    let extent = (log2_range + log2_range.abs() * 1e-5 + 1e-3) * (2.0 * LN_2);
    let mean = [screen.mean[0][at], screen.mean[1][at]];
    let surfel = disc.surfel();
    let Some(cut_off) = &view.surfel_cut_off else {
        return surfel.placed(mean, extent, view.low_pass);
    };
    let Some([filter, halves]) = disc.rectangle() else {
        return Surfel::default();
    };
    let tiles = cut_off.rectangle([mean[0] + filter[0], mean[1] + filter[1]], halves);
    Surfel { filter, tiles, ..surfel }.placed(mean, extent, view.low_pass)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gaussian::splats::surfel::UNIT;
    use crate::gaussian::view::visible::Visible;
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
                let surfel = placed.surfel().placed(mean, extent, LOW_PASS);
                let mut others = Vec::new();
                let footprint = surfel.reach(&VISIBLE, &mut others);
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

    /// The tiles that a surfel is listed in, and their blocks, of which a bit is set.
    fn listed(surfel: &Surfel) -> (usize, u32) {
        let mut others = Vec::new();
        let footprint = surfel.reach(&VISIBLE, &mut others);
        let spans = footprint.iter().flat_map(|footprint| footprint.spans(&others));
        let tiles: Vec<_> =
            spans.flat_map(|(row, span)| (span.first..span.end).map(move |at| [at.into(), row])).collect();
        let blocks = tiles.iter().map(|tile: &[u32; 2]| surfel.blocks(tile.map(|at| 16 * at)).count_ones()).sum();
        (tiles.len(), blocks)
    }

    #[gaurast_runner::test]
    fn needles_and_discs_at_the_eye_s_plane_are_bounded() {
        let disc = |axes, centre: [f64; 3]| {
            let placed = Disc { model: CameraModel::Pinhole, focal: FOCAL, near: 0.2, axes, centre };
            let mean = [0, 1].map(|axis| FOCAL[axis] * centre[axis] / centre[2] + CENTER[axis]);
            placed.surfel().placed(mean, 11.0, LOW_PASS)
        };
        // Needles across the picture, of any thinness, reach the tiles of a line: 160 pixels are 10 tiles.
        for thin in [1e-3, 1e-8, 1e-20, 0.0] {
            let (tiles, blocks) = listed(&disc([[0.6, 0.0, 0.1], [0.0, thin, 0.0]], [0.0, 0.03, 2.0]));
            assert!(tiles <= 10 && blocks <= 80, "{thin}: {tiles} tiles, {blocks} blocks");
        }
        // A disc whose plane is seen at an angle, through the eye's plane and on one side of the picture.
        let open = disc([[0.0, 0.0, 1.0], [0.0, 0.1, 0.0]], [1.2, 0.0, 2.0]);
        assert!(matches!(open.outline, crate::gaussian::splats::surfel::Outline::Open));
        let (tiles, blocks) = listed(&open);
        assert!((1..=30).contains(&tiles) && blocks <= 16 * 30, "{tiles} tiles, {blocks} blocks");
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
