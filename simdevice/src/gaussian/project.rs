//! Projection: 3D Gaussians to the nine numbers that the rasterizer takes.
//!
//! Everything from the camera-space mean to the conic is computed in binary64 and rounded once at the end: in
//! binary32 the determinant of a needle and the depth of neighbours are wrong in the fourth digit. What is
//! culled leaves before the covariance is computed, and spherical harmonics are read only for what reaches a
//! tile. No fused operations are used, so that keys and means are the same bits at every SIMD level.

use super::chunks::Harmonics;
use super::depth::CenterDepth;
use super::fetch::{Batch, COEFFICIENT_FLOATS, CoefficientReader};
use super::footprint::Visible;
use super::frustum::Frustum;
use super::instances::Matrices;
use super::lanes::{Bits, F32_LANES, Lanes, log2};
use super::panorama;
use super::scratch::{Attributes, Flat, Scratch};
use super::spherical_harmonics::{Bases, coefficient_count};
use super::splat::{Projected, half_room};
use crate::state::Viewport;
use crate::state::gaussian::{
    Camera, CameraModel, GaussianGeometry, GaussianLinearization, GaussianOrder, GaussianPrecision,
    GaussianState,
};
use crate::stats::counters::{Counter, Counters};
use crate::stats::optimizations::{Skip, Skips};
use fearless_simd::{Simd, prelude::*};

/// `log2_opacity` less this is how far the exponent may fall where the alpha floor is zero: beyond, alpha
/// underflows binary32.
const LEAST_LOG2_ALPHA: f64 = -150.0;

/// `q / 2` in units of natural exponents is this times `u^2 + v^2`: `ln 2`.
pub(super) const LN_2: f64 = std::f64::consts::LN_2;

/// What is the same for all Gaussians of a draw.
#[derive(Clone, Debug)]
pub(crate) struct Projection {
    pub(super) model: CameraModel,
    /// Whether covariances are those of projected points.
    pub(super) unscented: bool,
    pub(super) order: GaussianOrder,
    pub(super) geometry: GaussianGeometry,
    pub(super) precision: GaussianPrecision,
    pub(super) rotation: [f64; 9],
    pub(super) eye: [f64; 3],
    pub(super) focal: [f64; 2],
    /// The principal point in framebuffer pixels.
    pub(super) center: [f64; 2],
    /// After how many pixels the picture repeats to the right and to the left, if it does.
    pub(super) period: Option<f64>,
    /// Bounds of `t.x / t.z` and `t.y / t.z` in the Jacobian.
    pub(super) slope_min: [f64; 2],
    pub(super) slope_max: [f64; 2],
    pub(super) near: f32,
    pub(super) far: f32,
    pub(super) low_pass: f64,
    pub(super) compensated: bool,
    pub(super) alpha_floor: f64,
    pub(super) log2_floor: f64,
    pub(super) sh_degree: u32,
    pub(super) visible: Visible,
    pub(super) skips: Skips,
    /// How centres become depths, if the draw needs to know.
    pub(super) depth: Option<CenterDepth>,
}

/// A batch of Gaussians that were read.
pub(super) struct Source<'a> {
    /// What reads their colours.
    pub(super) reader: CoefficientReader<'a>,
    pub(super) batch: Batch<'a>,
    pub(super) attributes: &'a Attributes,
    /// Matrices that place them in the world, if it is not their own space.
    pub(super) matrices: Option<&'a Matrices>,
    /// None is skipped for what its attributes are.
    pub(super) is_sound: bool,
    /// Their spherical harmonics, if they were read already.
    pub(super) harmonics: Harmonics<'a>,
    /// No coefficient of theirs of a greater degree is other than zero.
    pub(super) degree: u32,
    /// What bounds those that can be seen; `None` tells nothing of them.
    pub(super) frustum: Option<&'a Frustum>,
}

impl Source<'_> {
    /// Has the spherical harmonics of degrees 0 to `degree` of some lanes on their way while other things are computed.
    #[inline(always)]
    fn prefetch_harmonics(&self, degree: u32, lanes: &[usize]) {
        let count = coefficient_count(degree.min(self.degree));
        for &lane in lanes {
            match self.harmonics.from(lane) {
                [] => self.reader.prefetch(&self.batch, lane, count),
                floats => devmem::prefetch(&floats[..floats.len().min(3 * count)]),
            }
        }
    }
}

impl Projection {
    /// The constants of a draw that may touch the pixels of `visible`.
    pub(crate) fn new(
        state: &GaussianState,
        camera: &Camera,
        viewport: &Viewport,
        visible: Visible,
        depth: Option<CenterDepth>,
        skips: Skips,
    ) -> Self {
        let focal = camera.focal_length.map(f64::from);
        let principal = camera.principal_point.map(f64::from);
        let size = [viewport.width, viewport.height].map(f64::from);
        let margin = [0, 1].map(|axis| 0.15 * size[axis] / focal[axis]);
        Self {
            model: camera.model,
            unscented: state.linearization == GaussianLinearization::Unscented,
            order: state.order,
            geometry: state.geometry,
            precision: state.precision,
            rotation: camera.rotation.map(f64::from),
            eye: camera.eye,
            focal,
            center: [
                principal[0] + f64::from(viewport.x),
                principal[1] + f64::from(viewport.y),
            ],
            // Discs are not drawn by panoramas.
            period: panorama::period(camera).filter(|_| state.geometry == GaussianGeometry::Volume),
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
            depth,
            skips,
        }
    }

    /// Projects a batch. `sequence` tells of each of its Gaussians which of the set it is.
    #[inline(always)]
    pub(super) fn run<S: Simd>(
        &self,
        simd: S,
        source: &Source<'_>,
        scratch: &mut Scratch,
        sequence: impl Fn(usize) -> u32,
        out: &mut Projected,
    ) {
        let counters = &mut out.counters;
        counters.add(Counter::GaussiansRead, source.batch.len as u64);
        let kept = self.cull(simd, source, counters);
        scratch.gather(source.attributes, &kept);
        if let Some(matrices) = source.matrices {
            scratch.gather_matrices(matrices);
        }
        self.flatten(simd, source, scratch);
        self.emit(simd, source, scratch, sequence, out);
    }

    /// Finds which lanes have finite spherical harmonics, of all that the batch holds.
    #[inline(always)]
    fn find_colored<S: Simd>(&self, simd: S, source: &Source<'_>) -> Bits {
        let reader = &source.reader;
        let mut coefficients = [0.0; COEFFICIENT_FLOATS];
        let anywhere = Bases::default();
        let mut colored = Bits::default();
        for lane in 0..source.batch.len {
            reader.read(&source.batch, lane, &mut coefficients);
            let color = anywhere.color(simd, self.sh_degree, 0, &coefficients);
            colored.set_one(lane, color.is_some());
        }
        colored
    }

    /// Finds which lanes nothing is known against yet, and counts the first reason to skip the others.
    #[inline(always)]
    fn cull<S: Simd>(&self, simd: S, source: &Source<'_>, counters: &mut Counters) -> Bits {
        let len = source.batch.len;
        let mut kept = Bits::first(len);
        let mut keep = |passed: &Bits, counter: Counter| {
            let skipped = kept.without(passed).count();
            counters.add(counter, skipped);
            kept = kept.and(passed);
            skipped
        };
        if !self.skips.has(Skip::Harmonics) {
            let colored = self.find_colored(simd, source);
            keep(&colored, Counter::SkippedNonFinite);
        }
        if let Some(matrices) = source.matrices {
            keep(&matrices.find_finite(len), Counter::SkippedNonFinite);
        }
        if !source.is_sound {
            let [finite, rotated, positive] = find_sound(simd, source.attributes, len);
            keep(&finite, Counter::SkippedNonFinite);
            keep(&rotated, Counter::SkippedZeroRotation);
            keep(&positive, Counter::SkippedNegativeScale);
        }
        let bright = self.find_bright(simd, source.attributes, len);
        keep(&bright, Counter::SkippedFaint);
        if let Some(frustum) = source.frustum {
            let outside = frustum.lanes_outside(simd, source.attributes, len);
            let all = Bits::first(len);
            keep(&all.without(&outside.near), Counter::SkippedNear);
            keep(&all.without(&outside.far), Counter::SkippedFar);
            let beside = all.without(&outside.beside);
            let skipped = keep(&beside, Counter::SkippedOffScreen);
            counters.add(Counter::OutsideByBounds, skipped);
        }
        kept
    }

    /// Which lanes' opacities reach the alpha floor.
    #[inline(always)]
    fn find_bright<S: Simd>(&self, simd: S, attributes: &Attributes, len: usize) -> Bits {
        let mut bright = Bits::default();
        // The floor is binary32 in the first place.
        let floor = S::f32s::splat(simd, self.alpha_floor as f32);
        for at in (0..len).step_by(S::f32s::LEN) {
            let o = S::f32s::from_slice(simd, &attributes.opacity[at..at + S::f32s::LEN]);
            bright.set(at, o.simd_ge(floor));
        }
        bright
    }

    /// Finds the place of the kept Gaussians in camera space.
    #[inline(always)]
    fn place<S: Simd>(&self, simd: S, scratch: &mut Scratch) {
        let r = self.rotation;
        for at in (0..scratch.lanes.len()).step_by(S::f64s::LEN) {
            let load = |lanes: &Lanes| S::f64s::from_slice(simd, &lanes[at..at + S::f64s::LEN]);
            let store = |value: S::f64s, lanes: &mut Lanes| {
                value.store_slice(&mut lanes[at..at + S::f64s::LEN]);
            };
            let [px, py, pz] = &*scratch.position;
            let dx = load(px) - self.eye[0];
            let dy = load(py) - self.eye[1];
            let dz = load(pz) - self.eye[2];
            let [x, y, z] = &mut *scratch.offset;
            store(dx, x);
            store(dy, y);
            store(dz, z);
            let tz = dx * r[6] + dy * r[7] + dz * r[8];
            let [x, y, z] = &mut *scratch.camera;
            store(dx * r[0] + dy * r[1] + dz * r[2], x);
            store(dx * r[3] + dy * r[4] + dz * r[5], y);
            store(tz, z);
            store(tz, &mut scratch.depth);
        }
    }

    /// The bounds of slopes in a pinhole's Jacobian: the least ones and the greatest.
    pub(super) fn slopes(&self) -> [[f64; 2]; 2] {
        [self.slope_min, self.slope_max]
    }

    /// Bounds of the visible pixels' centres along an axis, with a pixel to spare.
    pub(super) fn visible_range(&self, axis: usize) -> [f64; 2] {
        let [first, last] = self.visible.pixels(axis);
        [first - 1.0, last + 2.0]
    }

    /// Computes mean, covariance and opacity on the screen of the kept Gaussians.
    #[inline(always)]
    fn flatten<S: Simd>(&self, simd: S, source: &Source<'_>, scratch: &mut Scratch) {
        let by_matrices = source.matrices.is_some();
        if by_matrices {
            self.place_by_matrices(scratch);
        } else {
            self.place(simd, scratch);
        }
        let unscented = self.unscented;
        let is_pinhole = self.model == CameraModel::Pinhole && !by_matrices && !unscented;
        if !is_pinhole {
            self.linearize(by_matrices, scratch);
        }
        if unscented {
            self.transform(by_matrices, scratch);
        }
        let moments = &*scratch.moments;
        let toward = match &scratch.placed {
            Some(placed) if by_matrices => &placed.toward,
            _ => &*scratch.offset,
        };
        let number = |value: f64| S::f64s::splat(simd, value);
        let load =
            |lanes: &Lanes, at: usize| S::f64s::from_slice(simd, &lanes[at..at + S::f64s::LEN]);
        let (scale, rotation, opacity) = (&*scratch.scale, &*scratch.rotation, &*scratch.opacity);
        let flat = &mut *scratch.flat;
        let r = self.rotation;
        let (one, two) = (number(1.0), number(2.0));
        for at in (0..scratch.lanes.len()).step_by(S::f64s::LEN) {
            let store = |value: S::f64s, lanes: &mut Lanes| {
                value.store_slice(&mut lanes[at..at + S::f64s::LEN]);
            };
            let end = scratch.lanes.len().min(at + S::f64s::LEN);
            source.prefetch_harmonics(self.sh_degree, &scratch.lanes[at..end]);
            let [w, x] = [load(&rotation[0], at), load(&rotation[1], at)];
            let [y, z] = [load(&rotation[2], at), load(&rotation[3], at)];
            // What was binary32 can be squared in binary64, whatever its size.
            let double = two / (w * w + x * x + y * y + z * z);
            let [dx, dy, dz] = [double * x, double * y, double * z];
            let (xx, yy, zz) = (dx * x, dy * y, dz * z);
            let (xy, xz, yz) = (dx * y, dx * z, dy * z);
            let (wx, wy, wz) = (dx * w, dy * w, dz * w);
            let columns = [
                [one - (yy + zz), xy + wz, xz - wy],
                [xy - wz, one - (xx + zz), yz + wx],
                [xz + wy, yz - wx, one - (xx + yy)],
            ];
            let scale = [
                load(&scale[0], at),
                load(&scale[1], at),
                load(&scale[2], at),
            ];
            let per_depth = one / load(&scratch.camera[2], at);
            let mut m = [[one; 3]; 2];
            for axis in 0..2 {
                let [kx, ky, kz] = if is_pinhole {
                    let slope = load(&scratch.camera[axis], at) * per_depth;
                    let focal = number(self.focal[axis]);
                    store(slope * focal + self.center[axis], &mut flat.mean[axis]);
                    let clamped = slope.max(self.slope_min[axis]).min(self.slope_max[axis]);
                    let to_screen = focal * per_depth;
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
            let mut area2 = cx * cx + cy * cy + cz * cz;
            let mut covariance = [
                ax * ax + ay * ay + az * az,
                ax * bx + ay * by + az * bz,
                bx * bx + by * by + bz * bz,
            ];
            if unscented {
                covariance = [
                    load(&moments[0], at),
                    load(&moments[1], at),
                    load(&moments[2], at),
                ];
                area2 = load(&moments[3], at);
            }
            self.shape(simd, at, covariance, area2, load(opacity, at), flat);

            let [dx, dy, dz] = toward;
            let [dx, dy, dz] = [load(dx, at), load(dy, at), load(dz, at)];
            let unit = one / dx.abs().max(dy.abs()).max(dz.abs());
            let [dx, dy, dz] = [dx * unit, dy * unit, dz * unit];
            let per_norm = one / (dx * dx + dy * dy + dz * dz).sqrt();
            for (lanes, d) in flat.direction.iter_mut().zip([dx, dy, dz]) {
                store(d * per_norm, lanes);
            }
        }
    }

    /// What the tile engine and the search for tiles need of Gaussians from lane `at` on, given their covariances on the
    /// screen before the low-pass filter (xx, xy, yy), the determinants of those, and opacities.
    #[inline(always)]
    pub(super) fn shape<S: Simd>(
        &self,
        simd: S,
        at: usize,
        [xx, xy, yy]: [S::f64s; 3],
        area2: S::f64s,
        mut o: S::f64s,
        flat: &mut Flat,
    ) {
        let number = |value: f64| S::f64s::splat(simd, value);
        let store = |value: S::f64s, lanes: &mut Lanes| {
            value.store_slice(&mut lanes[at..at + S::f64s::LEN]);
        };
        let low_pass = number(self.low_pass);
        let determinant = area2 + low_pass * (xx + yy) + low_pass * low_pass;
        store(determinant, &mut flat.determinant);
        if self.compensated {
            o *= (area2 / determinant).sqrt();
        }
        let log2_opacity = log2(simd, o);
        store(log2_opacity, &mut flat.log2_opacity);

        let (a, b, c) = (xx + low_pass, xy, yy + low_pass);
        // alpha = opacity exp(-q / 2) = 2^(log2 opacity - q / (2 ln 2)), and
        // q = d.x^2 / a + (a / det) (d.y - (b / a) d.x)^2.
        let unit = (0.5 / LN_2).sqrt();
        let (per_a, per_c) = (number(1.0) / a, number(1.0) / c);
        let vertical = (a / determinant).sqrt() * unit;
        store(per_a.sqrt() * unit, &mut flat.factor[0]);
        store(-(b * per_a) * vertical, &mut flat.factor[1]);
        store(vertical, &mut flat.factor[2]);
        // The tile engine evaluates the exponent in binary32: a margin wider than its error keeps every
        // pixel that it would accept. What cannot reach the floor even so has a negative extent.
        let room = log2_opacity - self.log2_floor;
        let mut extent = (room + room.abs() * 1e-5 + 1e-3) * (2.0 * LN_2);
        if self.precision == GaussianPrecision::Float16 {
            for lane in at..at + S::f64s::LEN {
                let factor = [0, 1, 2].map(|element| flat.factor[element][lane]);
                let room = flat.log2_opacity[lane] - self.log2_floor;
                flat.half[0][lane] = half_room(factor, room) * (2.0 * LN_2);
            }
            extent = S::f64s::from_slice(simd, &flat.half[0][at..at + S::f64s::LEN]);
        }
        let half_x = (a * extent).sqrt();
        store(half_x, &mut flat.half[0]);
        store((c * extent).sqrt(), &mut flat.half[1]);
        store(b * per_c, &mut flat.slope);
        store(determinant * per_c * per_c, &mut flat.narrowing);
        store(b * per_a * half_x, &mut flat.peak);
    }
}

/// Which lanes are finite, which have a rotation, and which have no negative scale.
#[inline(always)]
fn find_sound<S: Simd>(simd: S, attributes: &Attributes, len: usize) -> [Bits; 3] {
    let mut sound = [Bits::default(); 3];
    let zero = S::f32s::splat(simd, 0.0);
    for at in (0..len).step_by(S::f32s::LEN) {
        let load =
            |lanes: &[f32; F32_LANES]| S::f32s::from_slice(simd, &lanes[at..at + S::f32s::LEN]);
        // Multiplied by zero, what is not finite becomes NaN, and stays it.
        let mut nothing = load(&attributes.opacity) * zero;
        let mut least = zero;
        for lanes in &attributes.scale {
            least = least.min(load(lanes));
        }
        let mut largest = zero;
        for lanes in &attributes.rotation {
            let part = load(lanes);
            nothing += part * zero;
            largest = largest.max(part.abs());
        }
        for lanes in attributes.position.iter().chain(&attributes.scale) {
            nothing += load(lanes) * zero;
        }
        let [finite, rotated, positive] = &mut sound;
        finite.set(at, nothing.simd_eq(zero));
        rotated.set(at, largest.simd_gt(zero));
        positive.set(at, least.simd_ge(zero));
    }
    sound
}
