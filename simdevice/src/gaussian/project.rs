//! Projection: 3D Gaussians to the nine numbers that the rasterizer takes.
//!
//! Everything from the camera-space mean to the conic is computed in binary64 and rounded once at the end: in
//! binary32 the determinant of a needle and the depth of neighbours are wrong in the fourth digit. What is
//! culled leaves before the covariance is computed, and spherical harmonics are read only for what reaches a
//! tile. No fused operations are used, so that keys and means are the same bits at every SIMD level.

use super::fetch::{BATCH, Batch, COEFFICIENT_FLOATS, CoefficientReader};
use super::footprint::{Ellipse, Span, Visible};
use super::lanes::{Bits, Lanes, log2};
use super::linearize;
use super::scratch::{Attributes, Scratch};
use super::sort::ordered_bits;
use super::spherical_harmonics;
use crate::counters::{Counter, Counters};
use crate::packet::{
    Camera, CameraModel, GaussianAttributes, GaussianOrder, GaussianState, Viewport,
};
use crate::skips::{Skip, Skips};
use fearless_simd::{Simd, prelude::*};

/// A projected Gaussian: what the tile engine needs of it, in one cache line.
///
/// At offset `d` pixels from the mean, `log2(alpha) = log2_opacity - u^2 - v^2` with `u = factor[0] d.x` and
/// `v = factor[1] d.x + factor[2] d.y`: the Cholesky factor of the conic, scaled so that base 2 needs no more.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(crate) struct Splat {
    /// The mean in framebuffer pixels.
    pub mean: [f64; 2],
    /// The scaled Cholesky factor of the conic, in 1/px.
    pub factor: [f64; 3],
    /// Base-2 logarithm of the opacity.
    pub log2_opacity: f32,
    /// Red, green, blue.
    pub color: [f32; 3],
}

/// What came of a batch.
#[derive(Debug, Default)]
pub(crate) struct Projected {
    /// What is drawn, in the order of the draw.
    pub splats: Vec<Splat>,
    /// The depth key of each.
    pub keys: Vec<u32>,
    /// The tiles of all of them, one after the other.
    pub spans: Vec<Span>,
    /// Where the tiles of each end in `spans`.
    pub span_ends: Vec<u32>,
    /// What was skipped and why.
    pub counters: Counters,
}

/// `log2_opacity` less this is how far the exponent may fall where the alpha floor is zero: beyond, alpha
/// underflows binary32.
const LEAST_LOG2_ALPHA: f64 = -150.0;

/// `q / 2` in units of natural exponents is this times `u^2 + v^2`: `ln 2`.
const LN_2: f64 = std::f64::consts::LN_2;

/// What is the same for all Gaussians of a draw.
#[derive(Clone, Debug)]
pub(crate) struct Projection {
    model: CameraModel,
    order: GaussianOrder,
    rotation: [f64; 9],
    eye: [f64; 3],
    focal: [f64; 2],
    /// The principal point in framebuffer pixels.
    center: [f64; 2],
    /// Bounds of `t.x / t.z` and `t.y / t.z` in the Jacobian.
    slope_min: [f64; 2],
    slope_max: [f64; 2],
    near: f32,
    far: f32,
    low_pass: f64,
    compensated: bool,
    alpha_floor: f64,
    log2_floor: f64,
    sh_degree: u32,
    visible: Visible,
    skips: Skips,
}

impl Projected {
    /// The tiles of a splat of the batch.
    #[inline(always)]
    pub(crate) fn spans_of(&self, place: usize) -> &[Span] {
        let start = place
            .checked_sub(1)
            .map_or(0, |before| self.span_ends[before]);
        &self.spans[start as usize..self.span_ends[place] as usize]
    }

    fn reserve(&mut self, count: usize) {
        self.splats.reserve_exact(count);
        self.keys.reserve_exact(count);
        self.span_ends.reserve_exact(count);
        self.spans.reserve(2 * count);
    }
}

impl Projection {
    /// The constants of a draw that may touch the pixels of `visible`.
    pub(crate) fn new(
        state: &GaussianState,
        camera: &Camera,
        viewport: &Viewport,
        visible: Visible,
        skips: Skips,
    ) -> Self {
        let focal = camera.focal_length.map(f64::from);
        let principal = camera.principal_point.map(f64::from);
        let size = [viewport.width, viewport.height].map(f64::from);
        let margin = [0, 1].map(|axis| 0.15 * size[axis] / focal[axis]);
        Self {
            model: camera.model,
            order: state.order,
            rotation: camera.rotation.map(f64::from),
            eye: camera.eye,
            focal,
            center: [
                principal[0] + f64::from(viewport.x),
                principal[1] + f64::from(viewport.y),
            ],
            slope_min: [0, 1].map(|axis| -(principal[axis] / focal[axis] + margin[axis])),
            slope_max: [0, 1]
                .map(|axis| (size[axis] - principal[axis]) / focal[axis] + margin[axis]),
            near: camera.near_plane,
            far: camera.far_plane,
            low_pass: f64::from(state.low_pass_variance),
            compensated: state.opacity_compensated,
            alpha_floor: state.alpha_floor.into(),
            log2_floor: f64::from(state.alpha_floor).log2().max(LEAST_LOG2_ALPHA),
            sh_degree: state.sh_degree,
            visible,
            skips,
        }
    }

    /// Projects a batch.
    #[inline(always)]
    pub(super) fn run<S: Simd>(
        &self,
        simd: S,
        attributes: &GaussianAttributes,
        batch: &Batch,
        scratch: &mut Scratch,
        out: &mut Projected,
    ) {
        scratch.fetch(attributes, batch);
        out.counters.add(Counter::GaussiansRead, batch.len as u64);
        let mut colored = Bits::first(batch.len);
        if !self.skips.has(Skip::Harmonics) {
            colored = self.find_colored(simd, attributes, batch);
        }
        let kept = self.cull(simd, &colored, batch.len, scratch, &mut out.counters);
        scratch.gather(&kept);
        self.flatten(simd, scratch);
        self.emit(simd, attributes, batch, scratch, out);
    }

    /// Finds which lanes have finite spherical harmonics, of all that the batch holds.
    #[inline(always)]
    fn find_colored<S: Simd>(
        &self,
        simd: S,
        attributes: &GaussianAttributes,
        batch: &Batch,
    ) -> Bits {
        let reader = CoefficientReader::new(&attributes.spherical_harmonics);
        let mut coefficients = [0.0; COEFFICIENT_FLOATS];
        let mut colored = Bits::default();
        for lane in 0..batch.len {
            reader.read(batch, lane, &mut coefficients);
            let anywhere = [0.0, 0.0, 1.0];
            let color = spherical_harmonics::color(simd, self.sh_degree, anywhere, &coefficients);
            colored.set_one(lane, color.is_some());
        }
        colored
    }

    /// Finds the camera-space mean of each lane, and counts the first reason to skip it, if there is one.
    /// Returns which lanes have none. Lanes that are not `colored` are not finite.
    #[inline(always)]
    fn cull<S: Simd>(
        &self,
        simd: S,
        colored: &Bits,
        len: usize,
        scratch: &mut Scratch,
        counters: &mut Counters,
    ) -> Bits {
        let number = |value: f64| S::f64s::splat(simd, value);
        let load =
            |lanes: &Lanes, at: usize| S::f64s::from_slice(simd, &lanes[at..at + S::f64s::LEN]);
        let Attributes {
            position,
            scale,
            rotation,
            opacity,
        } = &*scratch.attributes;
        let zero = number(0.0);
        let largest_opacity = opacity[..len].iter().fold(1.0f64, |a, &b| a.max(b));
        // A hundredth more than the ellipse needs, so that rounding loses nothing.
        let extent = number(2.02 * LN_2 * (largest_opacity.log2() - self.log2_floor));
        let low_pass = number(self.low_pass);
        let bounded = self.model == CameraModel::Pinhole && self.skips.has(Skip::Bounds);
        let r = self.rotation;
        let [
            mut finite,
            mut rotated,
            mut positive,
            mut bright,
            mut inside,
        ] = [Bits::default(); 5];
        for at in (0..len).step_by(S::f64s::LEN) {
            let [px, py, pz] = [0, 1, 2].map(
                #[inline(always)]
                |axis| load(&position[axis], at),
            );
            let [sx, sy, sz] = [
                load(&scale[0], at),
                load(&scale[1], at),
                load(&scale[2], at),
            ];
            let [qw, qx] = [load(&rotation[0], at), load(&rotation[1], at)];
            let [qy, qz] = [load(&rotation[2], at), load(&rotation[3], at)];
            let o = load(opacity, at);
            // Multiplied by zero, what is not finite becomes NaN, and stays it.
            let nothing = (px + py + pz) * zero
                + (sx * zero + sy * zero + sz * zero)
                + (qw * zero + qx * zero + qy * zero + qz * zero)
                + o * zero;
            finite.set(at, nothing.simd_eq(zero));
            rotated.set(
                at,
                (qw.abs() + qx.abs() + qy.abs() + qz.abs()).simd_gt(zero),
            );
            positive.set(at, sx.min(sy).min(sz).simd_ge(zero));
            bright.set(at, o.simd_ge(self.alpha_floor));

            let d = [px - self.eye[0], py - self.eye[1], pz - self.eye[2]];
            for (lanes, d) in scratch.offset.iter_mut().zip(d) {
                d.store_slice(&mut lanes[at..at + S::f64s::LEN]);
            }
            let [dx, dy, dz] = d;
            let tx = dx * r[0] + dy * r[1] + dz * r[2];
            let ty = dx * r[3] + dy * r[4] + dz * r[5];
            let tz = dx * r[6] + dy * r[7] + dz * r[8];
            for (lanes, t) in scratch.camera.iter_mut().zip([tx, ty, tz]) {
                t.store_slice(&mut lanes[at..at + S::f64s::LEN]);
            }

            if !bounded {
                inside.set(at, S::mask64s::splat(simd, true));
                continue;
            }
            // The projection of a sphere about the Gaussian bounds that of the Gaussian. Comparisons are such
            // that NaN counts as inside.
            let largest = sx.max(sy).max(sz);
            let mut outside = S::mask64s::splat(simd, false);
            for (axis, t) in [tx, ty].into_iter().enumerate() {
                let slope = t / tz;
                let clamped = slope.max(self.slope_min[axis]).min(self.slope_max[axis]);
                let kx = number(r[3 * axis]) - clamped * r[6];
                let ky = number(r[3 * axis + 1]) - clamped * r[7];
                let kz = number(r[3 * axis + 2]) - clamped * r[8];
                let scale = largest * self.focal[axis] / tz;
                let variance = scale * scale * (kx * kx + ky * ky + kz * kz) + low_pass;
                let reach = (extent * variance).sqrt();
                let center = slope * self.focal[axis] + self.center[axis];
                let [first, end] = self.visible_range(axis);
                outside = outside | (center + reach).simd_lt(first) | (center - reach).simd_gt(end);
            }
            inside.set(at, !outside);
        }
        let [mut beyond_near, mut before_far] = [Bits::default(); 2];
        for (lane, &z) in self.depths(len, scratch).iter().enumerate() {
            let z = z as f32;
            beyond_near.set_one(lane, self.near < z);
            before_far.set_one(lane, z < self.far);
        }
        let mut kept = Bits::first(len);
        finite = finite.and(colored);
        for (passed, counter) in [
            (finite, Counter::SkippedNonFinite),
            (rotated, Counter::SkippedZeroRotation),
            (positive, Counter::SkippedNegativeScale),
            (bright, Counter::SkippedFaint),
            (beyond_near, Counter::SkippedNear),
            (before_far, Counter::SkippedFar),
        ] {
            counters.add(counter, kept.without(&passed).count());
            kept = kept.and(&passed);
        }
        let outside = kept.without(&inside).count();
        counters.add(Counter::SkippedOffScreen, outside);
        counters.add(Counter::OutsideByBounds, outside);
        kept.and(&inside)
    }

    /// The depth variable of each lane.
    fn depths<'a>(&self, len: usize, scratch: &'a mut Scratch) -> &'a [f64] {
        if self.model != CameraModel::Fisheye {
            return &scratch.camera[2][..len];
        }
        let [x, y, z] = &*scratch.camera;
        for (lane, distance) in scratch.distance[..len].iter_mut().enumerate() {
            *distance = linearize::depth(self.model, [x[lane], y[lane], z[lane]]);
        }
        &scratch.distance[..len]
    }

    /// What a lane is sorted by.
    fn key(&self, lane: usize, scratch: &Scratch) -> u32 {
        let depth = match self.order {
            GaussianOrder::ViewDepth if self.model == CameraModel::Fisheye => {
                scratch.distance[lane]
            }
            GaussianOrder::ViewDepth => scratch.camera[2][lane],
            GaussianOrder::RadialDistance => {
                let [x, y, z] = &*scratch.offset;
                (x[lane] * x[lane] + y[lane] * y[lane] + z[lane] * z[lane]).sqrt()
            }
            GaussianOrder::Primitive => 0.0,
        };
        ordered_bits(depth as f32)
    }

    /// Means and Jacobians of the kept Gaussians, for cameras that are no pinholes.
    fn linearize(&self, scratch: &mut Scratch) {
        let [x, y, z] = &*scratch.dense_camera;
        let r = &self.rotation;
        for at in 0..scratch.lanes.len().min(BATCH) {
            let (place, rows) = linearize::linearize(self.model, [x[at], y[at], z[at]]);
            for (axis, row) in rows.iter().enumerate() {
                scratch.flat.mean[axis][at] = place[axis] * self.focal[axis] + self.center[axis];
                let j = row.map(|element| element * self.focal[axis]);
                for column in 0..3 {
                    scratch.jacobian[axis][column][at] =
                        j[0] * r[column] + j[1] * r[3 + column] + j[2] * r[6 + column];
                }
            }
        }
    }

    /// Bounds of the visible pixels' centres along an axis, with a pixel to spare.
    fn visible_range(&self, axis: usize) -> [f64; 2] {
        let Visible {
            left,
            top,
            right,
            bottom,
        } = self.visible;
        let [first, end] = [[left, right], [top, bottom]][axis];
        [first as f64 - 1.0, end as f64 + 1.0]
    }

    /// Computes mean, covariance and opacity on the screen of the kept Gaussians.
    #[inline(always)]
    fn flatten<S: Simd>(&self, simd: S, scratch: &mut Scratch) {
        let is_pinhole = self.model == CameraModel::Pinhole;
        if !is_pinhole {
            self.linearize(scratch);
        }
        let number = |value: f64| S::f64s::splat(simd, value);
        let load =
            |lanes: &Lanes, at: usize| S::f64s::from_slice(simd, &lanes[at..at + S::f64s::LEN]);
        let Attributes {
            scale,
            rotation,
            opacity,
            ..
        } = &*scratch.dense;
        let flat = &mut *scratch.flat;
        let r = self.rotation;
        let (one, two, low_pass) = (number(1.0), number(2.0), number(self.low_pass));
        for at in (0..scratch.lanes.len()).step_by(S::f64s::LEN) {
            let store = |value: S::f64s, lanes: &mut Lanes| {
                value.store_slice(&mut lanes[at..at + S::f64s::LEN]);
            };
            let [w, x] = [load(&rotation[0], at), load(&rotation[1], at)];
            let [y, z] = [load(&rotation[2], at), load(&rotation[3], at)];
            // Divided by the largest component first, a quaternion of any size can be squared.
            let largest = w.abs().max(x.abs()).max(y.abs().max(z.abs()));
            let [w, x, y, z] = [w / largest, x / largest, y / largest, z / largest];
            let norm = (w * w + x * x + y * y + z * z).sqrt();
            let [w, x, y, z] = [w / norm, x / norm, y / norm, z / norm];
            let columns = [
                [
                    one - two * (y * y + z * z),
                    two * (x * y + w * z),
                    two * (x * z - w * y),
                ],
                [
                    two * (x * y - w * z),
                    one - two * (x * x + z * z),
                    two * (y * z + w * x),
                ],
                [
                    two * (x * z + w * y),
                    two * (y * z - w * x),
                    one - two * (x * x + y * y),
                ],
            ];
            let scale = [
                load(&scale[0], at),
                load(&scale[1], at),
                load(&scale[2], at),
            ];
            let depth = load(&scratch.dense_camera[2], at);
            let mut m = [[one; 3]; 2];
            for axis in 0..2 {
                let [kx, ky, kz] = if is_pinhole {
                    let slope = load(&scratch.dense_camera[axis], at) / depth;
                    let focal = number(self.focal[axis]);
                    store(slope * focal + self.center[axis], &mut flat.mean[axis]);
                    let clamped = slope.max(self.slope_min[axis]).min(self.slope_max[axis]);
                    let to_screen = focal / depth;
                    [
                        to_screen * (number(r[3 * axis]) - clamped * r[6]),
                        to_screen * (number(r[3 * axis + 1]) - clamped * r[7]),
                        to_screen * (number(r[3 * axis + 2]) - clamped * r[8]),
                    ]
                } else {
                    let row = &scratch.jacobian[axis];
                    [load(&row[0], at), load(&row[1], at), load(&row[2], at)]
                };
                for part in 0..3 {
                    let [cx, cy, cz] = columns[part];
                    m[axis][part] = scale[part] * (kx * cx + ky * cy + kz * cz);
                }
            }
            let [[ax, ay, az], [bx, by, bz]] = m;
            let [cx, cy, cz] = [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
            let area2 = cx * cx + cy * cy + cz * cz;
            let xx = ax * ax + ay * ay + az * az;
            let yy = bx * bx + by * by + bz * bz;
            let determinant = area2 + low_pass * (xx + yy) + low_pass * low_pass;
            store(determinant, &mut flat.determinant);
            let mut o = load(opacity, at);
            if self.compensated {
                o *= (area2 / determinant).sqrt();
            }
            let log2_opacity = log2(simd, o);
            store(log2_opacity, &mut flat.log2_opacity);

            let (a, b, c) = (xx + low_pass, ax * bx + ay * by + az * bz, yy + low_pass);
            // alpha = opacity exp(-q / 2) = 2^(log2 opacity - q / (2 ln 2)), and
            // q = d.x^2 / a + (a / det) (d.y - (b / a) d.x)^2.
            let unit = (0.5 / LN_2).sqrt();
            let vertical = (a / determinant).sqrt() * unit;
            store(number(unit) / a.sqrt(), &mut flat.factor[0]);
            store(-(b / a) * vertical, &mut flat.factor[1]);
            store(vertical, &mut flat.factor[2]);
            // The tile engine evaluates the exponent in binary32: a margin wider than its error keeps every
            // pixel that it would accept. What cannot reach the floor even so has a negative extent.
            let room = log2_opacity - self.log2_floor;
            let extent = (room + room.abs() * 1e-5 + 1e-3) * (2.0 * LN_2);
            let half_x = (a * extent).sqrt();
            store(half_x, &mut flat.half[0]);
            store((c * extent).sqrt(), &mut flat.half[1]);
            store(b / c, &mut flat.slope);
            store(determinant / (c * c), &mut flat.narrowing);
            store(b * half_x / a, &mut flat.peak);

            let d = &scratch.dense_offset;
            let [dx, dy, dz] = [load(&d[0], at), load(&d[1], at), load(&d[2], at)];
            let largest = dx.abs().max(dy.abs()).max(dz.abs());
            let [dx, dy, dz] = [dx / largest, dy / largest, dz / largest];
            let norm = (dx * dx + dy * dy + dz * dz).sqrt();
            for (lanes, d) in flat.direction.iter_mut().zip([dx, dy, dz]) {
                store(d / norm, lanes);
            }
        }
    }

    /// Finds the tiles and the colour of the kept Gaussians and appends what reaches a tile to `out`.
    #[inline(always)]
    fn emit<S: Simd>(
        &self,
        simd: S,
        attributes: &GaussianAttributes,
        batch: &Batch,
        scratch: &Scratch,
        out: &mut Projected,
    ) {
        let reader = CoefficientReader::new(&attributes.spherical_harmonics);
        let mut coefficients = [0.0; COEFFICIENT_FLOATS];
        let flat = &*scratch.flat;
        out.reserve(scratch.lanes.len());
        let mut beside = self.skips.has(Skip::Ellipse).then_some(0);
        let mut read = 0;
        for (at, &lane) in scratch.lanes.iter().enumerate() {
            let at = at % BATCH;
            let determinant = flat.determinant[at];
            if !(determinant > 0.0 && determinant.is_finite()) {
                out.counters.add(Counter::SkippedDegenerate, 1);
                continue;
            }
            let first_span = out.spans.len();
            let ellipse = Ellipse {
                mean: [flat.mean[0][at], flat.mean[1][at]],
                half: [flat.half[0][at], flat.half[1][at]],
                slope: flat.slope[at],
                narrowing: flat.narrowing[at],
                peak: flat.peak[at],
            };
            // The square root of a negative extent is not a number.
            if ellipse.half[1] >= 0.0 {
                ellipse.append_spans(&self.visible, &mut out.spans, beside.as_mut());
            }
            if out.spans.len() == first_span {
                out.counters.add(Counter::SkippedOffScreen, 1);
                continue;
            }
            reader.read(batch, lane, &mut coefficients);
            read += 1;
            let d = &flat.direction;
            let direction = [d[0][at] as f32, d[1][at] as f32, d[2][at] as f32];
            let degree = self.sh_degree;
            let Some(color) = spherical_harmonics::color(simd, degree, direction, &coefficients)
            else {
                out.spans.truncate(first_span);
                out.counters.add(Counter::SkippedNonFinite, 1);
                continue;
            };
            out.keys.push(self.key(lane % BATCH, scratch));
            out.splats.push(Splat {
                mean: ellipse.mean,
                factor: [flat.factor[0][at], flat.factor[1][at], flat.factor[2][at]],
                log2_opacity: flat.log2_opacity[at] as f32,
                color,
            });
            out.span_ends.push(out.spans.len() as u32);
        }
        let counters = &mut out.counters;
        counters.add(Counter::GaussiansDrawn, out.splats.len() as u64);
        counters.add(Counter::TilesBesideEllipse, beside.unwrap_or_default());
        if self.skips.has(Skip::Harmonics) {
            counters.add(Counter::HarmonicsUnread, batch.len as u64 - read);
        }
    }
}
