//! Depth along a pixel's ray, by which the per-pixel order sorts Gaussians at each pixel.
//!
//! A pixel's ray starts at `e + R^T o` and runs along `R^T r`, with `o` and `r` in camera axes. A Gaussian is greatest
//! on it at `tau = (a . b) / (a . a)`, where `a = B r`, `b = B (R (p - e) - o)`, and B takes camera axes to the
//! Gaussian's own axes, divided by its standard deviations: `tau` minimises `|b - tau a|`. Standard deviations below
//! 2^-10 of the greatest are raised to that, so that `a` is never zero and rounding leaves digits of `tau`. Everything
//! is binary64 without fused operations, so that all SIMD levels give the same bits.

use crate::gaussian::linear_algebra::{axes, dot};
use crate::state::Viewport;
use crate::state::gaussian::{Camera, CameraModel};
use fearless_simd::{Simd, f64x8, prelude::*};

/// The least standard deviation, relative to the Gaussian's greatest.
const LEAST_RATIO: f64 = 1.0 / 1024.0;

/// The number of low bits of a depth that rounding clears: 36 of the significand's 52 remain.
const ROUNDED_BITS: u32 = 16;

/// The coefficients of a Gaussian's depth along a ray.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RayDepth {
    /// The matrix B, by column.
    columns: [[f64; 3]; 3],
    /// The vector `b` for a ray from the eye.
    centre: [f64; 3],
}

impl RayDepth {
    /// The coefficients of a Gaussian with standard deviations `scale` along axes rotated by the quaternion `rotation`
    /// (w, x, y, z, any length but zero), whose centre is `offset` from the eye, in world axes. `camera` is the
    /// camera's rotation.
    pub(crate) fn new(camera: &[f64; 9], rotation: [f64; 4], scale: [f64; 3], offset: [f64; 3]) -> Self {
        let greatest = scale[0].max(scale[1]).max(scale[2]);
        let axes = axes(rotation);
        let mut depth = Self::default();
        for row in 0..3 {
            // A point has the depth of a ball.
            let stretch = if greatest > 0.0 { (greatest / scale[row]).min(1.0 / LEAST_RATIO) } else { 1.0 };
            let axis = axes[row].map(|component| component * stretch);
            for column in 0..3 {
                depth.columns[column][row] = dot(axis, row_of(camera, column));
            }
            depth.centre[row] = dot(axis, offset);
        }
        depth
    }

    /// The depths along eight of `rays`, from number `first` on.
    #[inline(always)]
    pub(crate) fn along<S: Simd>(&self, simd: S, rays: &Rays, first: usize) -> f64x8<S> {
        let number = |value: f64| f64x8::splat(simd, value);
        let load = |lanes: &[f64; RAYS]| f64x8::from_slice(simd, &lanes[first..first + 8]);
        let [x, y, z] = [load(&rays.direction[0]), load(&rays.direction[1]), load(&rays.direction[2])];
        let [cx, cy, cz] = &self.columns;
        let (mut product, mut square) = (number(0.0), number(0.0));
        for row in 0..3 {
            let a = x * cx[row] + y * cy[row] + z * cz[row];
            let mut b = number(self.centre[row]);
            if rays.parallel {
                let [x, y] = [load(&rays.origin[0]), load(&rays.origin[1])];
                b -= x * cx[row] + y * cy[row];
            }
            product += a * b;
            square += a * a;
        }
        product / square
    }
}

/// The inputs of the per-pixel order, in addition to a draw's splats.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayDepths<'a> {
    /// The Gaussians by group, in the order of the splats.
    pub(crate) by_group: &'a [Vec<RayDepth>],
    pub(crate) rays: PixelRays,
}

fn row_of(matrix: &[f64; 9], row: usize) -> [f64; 3] {
    [matrix[3 * row], matrix[3 * row + 1], matrix[3 * row + 2]]
}

/// An integer that orders as a depth does after rounding to 36 bits of its significand, so that depths that differ only
/// by rounding errors are equal.
pub(crate) fn ordered_key(depth: f64) -> u64 {
    // A carry into the exponent gives the correct next number. Negative zero becomes zero.
    let bits = (depth + 0.0).to_bits().wrapping_add(1 << (ROUNDED_BITS - 1));
    let bits = bits >> ROUNDED_BITS << ROUNDED_BITS;
    if bits >> 63 == 0 { bits | 1 << 63 } else { !bits }
}

/// The number of rays that are evaluated together: those of a block of 4x4 pixels.
pub(crate) const RAYS: usize = 16;

/// Rays in camera axes.
#[derive(Clone, Debug)]
pub(crate) struct Rays {
    direction: [[f64; RAYS]; 3],
    /// The starting points in x and y, if the rays are parallel; otherwise all start at the eye.
    origin: [[f64; RAYS]; 2],
    parallel: bool,
}

/// The map from pixels to rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelRays {
    model: CameraModel,
    focal: [f64; 2],
    /// The principal point in framebuffer pixels.
    center: [f64; 2],
}

impl PixelRays {
    pub(crate) fn new(camera: &Camera, viewport: &Viewport) -> Self {
        let principal = camera.principal_point.map(f64::from);
        Self {
            model: camera.model,
            focal: camera.focal_length.map(f64::from),
            center: [principal[0] + f64::from(viewport.x), principal[1] + f64::from(viewport.y)],
        }
    }

    /// The rays of these points of the framebuffer.
    pub(crate) fn of(&self, x: [f64; RAYS], y: [f64; RAYS]) -> Rays {
        let mut rays = Rays {
            direction: [[0.0; RAYS]; 3],
            origin: [[0.0; RAYS]; 2],
            parallel: self.model == CameraModel::Orthographic,
        };
        for lane in 0..RAYS {
            let u = (x[lane] - self.center[0]) / self.focal[0];
            let v = (y[lane] - self.center[1]) / self.focal[1];
            let direction = match self.model {
                CameraModel::Pinhole => [u, v, 1.0],
                CameraModel::Orthographic => [0.0, 0.0, 1.0],
                CameraModel::Fisheye => {
                    let angle = (u * u + v * v).sqrt();
                    // The limit on the axis.
                    let across = if angle == 0.0 { 1.0 } else { libm::sin(angle) / angle };
                    [u * across, v * across, libm::cos(angle)]
                }
                CameraModel::Equirectangular => {
                    let ((sin_u, cos_u), (sin_v, cos_v)) = (libm::sincos(u), libm::sincos(v));
                    [sin_u * cos_v, sin_v, cos_u * cos_v]
                }
            };
            for (lanes, component) in rays.direction.iter_mut().zip(direction) {
                lanes[lane] = component;
            }
            rays.origin[0][lane] = u;
            rays.origin[1][lane] = v;
        }
        rays
    }
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

    const TURNED: [f64; 9] = [0.36, 0.48, -0.8, -0.8, 0.6, 0.0, 0.48, 0.64, 0.6];

    fn pixel_rays(model: CameraModel) -> PixelRays {
        PixelRays { model, focal: [100.0, 90.0], center: [50.0, 40.0] }
    }

    /// The depths along rays. Asserts that the level gives those of the simplest.
    fn along(level: Level, depth: &RayDepth, rays: &Rays, first: usize) -> Vec<f64> {
        let simplest = SimdLevel::Baseline.resolve().unwrap();
        let [found, expected] =
            [level, simplest].map(|level| dispatch!(level, simd => depth.along(simd, rays, first).as_slice().to_vec()));
        assert_eq!(found, expected);
        found
    }

    #[gaurast_runner::test(each = simd_levels())]
    fn the_gaussian_is_greatest_there(case: &Case) {
        let level = token_of(case);
        proptest!(|(
            px in -5.0..5.0f64, py in -5.0..5.0f64, pz in 1.0..9.0f64,
            w in -1.0..1.0f64, x in -1.0..1.0f64, y in -1.0..1.0f64, z in 0.1..1.0f64,
            sx in 0.1..2.0f64, sy in 0.1..2.0f64, sz in 0.1..2.0f64,
            at_x in 0.0..100.0f64, at_y in 0.0..80.0f64,
        )| {
            let (offset, rotation, scale) = ([px, py, pz], [w, x, y, z], [sx, sy, sz]);
            let depth = RayDepth::new(&TURNED, rotation, scale, offset);
            for model in [CameraModel::Pinhole, CameraModel::Orthographic, CameraModel::Fisheye] {
                let rays = pixel_rays(model).of([at_x; RAYS], [at_y; RAYS]);
                let t = along(level, &depth, &rays, 8)[3];
                // The squared distance from the centre in standard deviations, at a point of the ray.
                let distance = |t: f64| {
                    let parallel = model == CameraModel::Orthographic;
                    let from = |axis: usize| if parallel { rays.origin[axis][0] } else { 0.0 };
                    let d: [f64; 3] = std::array::from_fn(|i| rays.direction[i][0]);
                    let place = [from(0) + t * d[0], from(1) + t * d[1], t * d[2]];
                    let from_centre: [f64; 3] = std::array::from_fn(|i| {
                        place[0] * TURNED[i] + place[1] * TURNED[3 + i] + place[2] * TURNED[6 + i] - offset[i]
                    });
                    let axes = axes(rotation);
                    (0..3).map(|i| (dot(axes[i], from_centre) / scale[i]).powi(2)).sum::<f64>()
                };
                let step = 1e-3;
                prop_assert!(distance(t) <= distance(t + step) + 1e-9);
                prop_assert!(distance(t) <= distance(t - step) + 1e-9);
            }
        });
    }

    #[gaurast_runner::test(each = simd_levels())]
    fn flat_ones_meet_the_ray_and_points_are_balls(case: &Case) {
        let level = token_of(case);
        let upright = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        let rays = pixel_rays(CameraModel::Pinhole).of([150.0; RAYS], [40.0; RAYS]);
        // A wall at z = 4 whose thickness is raised to a thousandth of its width, seen at 45 degrees from its middle.
        let identity = [1.0, 0.0, 0.0, 0.0];
        let wall = RayDepth::new(&upright, identity, [2.0, 2.0, 0.0], [0.0, 0.0, 4.0]);
        let depth = along(level, &wall, &rays, 0)[0];
        assert!((depth - 4.0).abs() < 1e-5, "{depth}");
        // The depth is that of the perpendicular's foot.
        let point = RayDepth::new(&upright, identity, [0.0; 3], [0.0, 0.0, 4.0]);
        let depth = along(level, &point, &rays, 0)[0];
        assert!((depth - 2.0).abs() < 1e-12, "{depth}");
        // A needle parallel to the ray has the depth of its middle.
        let needle = RayDepth::new(&upright, identity, [0.0, 0.0, 3.0], [4.0, 0.0, 4.0]);
        let depth = along(level, &needle, &rays, 0)[0];
        assert!((depth - 4.0).abs() < 1e-5, "{depth}");
    }

    #[gaurast_runner::test]
    fn keys_order_as_depths_do_and_forgive_their_rounding() {
        let depths = [-1e30, -2.0, -1.0, -1e-300, 0.0, 1e-300, 1.0, 1.0 + 1e-10, 2.0, 1e30];
        assert!(depths.is_sorted());
        let keys = depths.map(ordered_key);
        assert!(keys.is_sorted_by(|a, b| a < b), "{keys:?}");
        assert_eq!(ordered_key(-0.0), ordered_key(0.0));
        assert_eq!(ordered_key(1.0), ordered_key(1.0f64.next_up()));
        assert_eq!(ordered_key(1.0), ordered_key(1.0f64.next_down()));
        assert_eq!(ordered_key(-3.0), ordered_key((-3.0f64).next_up()));
    }
}
