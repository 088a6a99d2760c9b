//! Projection: 3D Gaussians to the nine numbers that the rasterizer takes.
//!
//! Everything from the camera-space mean to the conic is computed in binary64 and rounded once at the end: in
//! binary32 the determinant of a needle and the depth of neighbours are wrong in the fourth digit. What is
//! culled leaves before the covariance is computed, and spherical harmonics are read only for what reaches a
//! tile. No fused operations are used, so that keys and means are the same bits at every SIMD level.

use super::depth::CenterDepth;
use super::fetch::{BATCH, Batch, COEFFICIENT_FLOATS, CoefficientReader};
use super::footprint::{Ellipse, Reach, Span, Visible};
use super::frustum::Frustum;
use super::instances::Matrices;
use super::lanes::{Bits, F32_LANES, Lanes, log2};
use super::panorama;
use super::rays::{self, RayDepth};
use super::scratch::{Attributes, Flat, Scratch};
use super::sort::ordered_bits;
use super::spherical_harmonics::{Bases, DIRECTIONS};
use super::splat::{Projected, Splat, half_room};
use super::surfel::{Placed, Surfel};
use crate::counters::{Counter, Counters};
use crate::packet::{
    Camera, CameraModel, GaussianAttributes, GaussianGeometry, GaussianLinearization,
    GaussianOrder, GaussianPrecision, GaussianState, Viewport,
};
use crate::skips::{Skip, Skips};
use fearless_simd::{Simd, prelude::*};

/// `log2_opacity` less this is how far the exponent may fall where the alpha floor is zero: beyond, alpha
/// underflows binary32.
const LEAST_LOG2_ALPHA: f64 = -150.0;

/// `q / 2` in units of natural exponents is this times `u^2 + v^2`: `ln 2`.
const LN_2: f64 = std::f64::consts::LN_2;

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
    depth: Option<CenterDepth>,
}

/// A batch of Gaussians that were read.
pub(super) struct Source<'a> {
    /// Where their colours are.
    pub(super) streams: &'a GaussianAttributes,
    pub(super) batch: Batch<'a>,
    pub(super) attributes: &'a Attributes,
    /// Matrices that place them in the world, if it is not their own space.
    pub(super) matrices: Option<&'a Matrices>,
    /// None is skipped for what its attributes are.
    pub(super) is_sound: bool,
    /// Their spherical harmonics, if they were read already, one after the other.
    pub(super) harmonics: &'a [f32],
    /// No coefficient of theirs of a greater degree is other than zero.
    pub(super) degree: u32,
    /// What bounds those that can be seen; `None` tells nothing of them.
    pub(super) frustum: Option<&'a Frustum>,
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
        self.flatten(simd, source.matrices.is_some(), scratch);
        self.emit(simd, source, scratch, sequence, out);
    }

    /// Finds which lanes have finite spherical harmonics, of all that the batch holds.
    #[inline(always)]
    fn find_colored<S: Simd>(&self, simd: S, source: &Source<'_>) -> Bits {
        let reader = CoefficientReader::new(&source.streams.spherical_harmonics);
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

    /// A kept lane's depth as the attachment holds it.
    #[inline(always)]
    fn center_depth(&self, at: usize, scratch: &Scratch) -> u32 {
        self.depth
            .map_or(0, |depth| depth.code(scratch.depth[at] as f32))
    }

    /// What a kept lane is sorted by.
    #[inline(always)]
    fn key(&self, at: usize, sequence: u32, scratch: &Scratch) -> u32 {
        let depth = match self.order {
            GaussianOrder::ViewDepth => scratch.depth[at],
            GaussianOrder::RadialDistance => {
                let [x, y, z] = &*scratch.offset;
                (x[at] * x[at] + y[at] * y[at] + z[at] * z[at]).sqrt()
            }
            // Pixels sort later, and take the order of the draw for equal depths.
            GaussianOrder::Primitive | GaussianOrder::PerPixel => return sequence,
        };
        ordered_bits(depth as f32)
    }

    /// What a kept lane is sorted by at a pixel.
    fn ray_depth(&self, at: usize, scratch: &Scratch) -> RayDepth {
        let [w, x, y, z] = &*scratch.rotation;
        let [sx, sy, sz] = &*scratch.scale;
        let [dx, dy, dz] = &*scratch.offset;
        RayDepth::new(
            &self.rotation,
            [w[at], x[at], y[at], z[at]],
            [sx[at], sy[at], sz[at]],
            [dx[at], dy[at], dz[at]],
        )
    }

    /// A kept lane as a 2D Gaussian, and the tiles that it reaches, if there are any.
    fn surfel(
        &self,
        at: usize,
        scratch: &Scratch,
        spans: &mut Vec<Span>,
    ) -> (Surfel, Option<Reach>) {
        let [w, x, y, z] = &*scratch.rotation;
        let axes = rays::axes([w[at], x[at], y[at], z[at]]);
        let r = &self.rotation;
        let placed = |axis: usize| {
            let [x, y, z] = axes[axis].map(|c| c * scratch.scale[axis][at]);
            [0, 1, 2].map(|row| x * r[3 * row] + y * r[3 * row + 1] + z * r[3 * row + 2])
        };
        let [x, y, z] = &*scratch.camera;
        let mut surfel = Surfel::new(&Placed {
            model: self.model,
            focal: self.focal,
            near: self.near.into(),
            axes: [placed(0), placed(1)],
            centre: [x[at], y[at], z[at]],
        });
        let flat = &*scratch.flat;
        // As wide as for volumes: see there.
        let room = flat.log2_opacity[at] - self.log2_floor;
        let extent = (room + room.abs() * 1e-5 + 1e-3) * (2.0 * LN_2);
        let mean = [flat.mean[0][at], flat.mean[1][at]];
        let reach = surfel.reach(mean, (extent, self.low_pass), &self.visible, spans);
        (surfel, reach)
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
    fn flatten<S: Simd>(&self, simd: S, by_matrices: bool, scratch: &mut Scratch) {
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

    /// Why a kept Gaussian is skipped after all, by what does not depend on tiles and colours.
    #[inline(always)]
    fn why_skipped(&self, at: usize, scratch: &Scratch) -> Option<Counter> {
        let z = scratch.depth[at] as f32;
        let determinant = scratch.flat.determinant[at];
        // What is not a number is nowhere.
        if z.is_nan() || z <= self.near {
            Some(Counter::SkippedNear)
        } else if z >= self.far {
            Some(Counter::SkippedFar)
        } else if self.geometry == GaussianGeometry::Volume
            && !(determinant > 0.0 && determinant.is_finite())
        {
            Some(Counter::SkippedDegenerate)
        } else {
            None
        }
    }

    /// Finds the kept Gaussians that reach a tile.
    #[inline(always)]
    pub(super) fn find_tiles(&self, scratch: &mut Scratch, out: &mut Projected) {
        let mut beside = self.skips.has(Skip::Ellipse).then_some(0);
        scratch.reached.clear();
        scratch.copies.clear();
        let is_flat = self.geometry == GaussianGeometry::Surfel;
        for at in 0..scratch.lanes.len().min(BATCH) {
            if let Some(reason) = self.why_skipped(at, scratch) {
                out.counters.add(reason, 1);
                continue;
            }
            if is_flat {
                match self.surfel(at, scratch, &mut out.spans).1 {
                    Some(reach) => scratch.reached.push((at, reach)),
                    None => out.counters.add(Counter::SkippedOffScreen, 1),
                }
                continue;
            }
            let flat = &*scratch.flat;
            let ellipse = Ellipse {
                mean: [flat.mean[0][at], flat.mean[1][at]],
                half: [flat.half[0][at], flat.half[1][at]],
                slope: flat.slope[at],
                narrowing: flat.narrowing[at],
                peak: flat.peak[at],
            };
            let mut reach = None;
            // The square root of a negative extent is not a number.
            if ellipse.half[1] >= 0.0 {
                reach = match self.period {
                    None => ellipse.reach(&self.visible, &mut out.spans, beside.as_mut()),
                    Some(period) => {
                        let (visible, copies) = (&self.visible, &mut scratch.copies);
                        panorama::reach(at, &ellipse, period, visible, copies, out, beside.as_mut())
                    }
                };
            }
            match reach {
                Some(reach) => scratch.reached.push((at, reach)),
                None => out.counters.add(Counter::SkippedOffScreen, 1),
            }
        }
        let beside = beside.unwrap_or_default();
        out.counters.add(Counter::TilesBesideEllipse, beside);
    }

    /// The degree up to which spherical harmonics of a batch make a difference in some directions.
    #[inline(always)]
    fn degree_in(
        &self,
        source: &Source<'_>,
        directions: &[[f32; DIRECTIONS]; 3],
        out: &mut Projected,
    ) -> u32 {
        if source.degree >= self.sh_degree || !self.skips.has(Skip::Bands) {
            return self.sh_degree;
        }
        // Nothing makes zero of what is not a number.
        if directions.as_flattened().iter().any(|part| part.is_nan()) {
            return self.sh_degree;
        }
        out.counters.add(Counter::BandsOfZeros, DIRECTIONS as u64);
        source.degree
    }

    /// Finds the tiles and the colour of the kept Gaussians and appends what reaches a tile to `out`.
    #[inline(always)]
    fn emit<S: Simd>(
        &self,
        simd: S,
        source: &Source<'_>,
        scratch: &mut Scratch,
        sequence: impl Fn(usize) -> u32,
        out: &mut Projected,
    ) {
        out.reserve(scratch.lanes.len());
        self.find_tiles(scratch, out);
        let reader = CoefficientReader::new(&source.streams.spherical_harmonics);
        let mut coefficients = [[0.0; COEFFICIENT_FLOATS]; DIRECTIONS];
        let (mut directions, mut bases) = ([[0.0; DIRECTIONS]; 3], Bases::default());
        let mut copies = &*scratch.copies;
        for group in scratch.reached.chunks(DIRECTIONS) {
            // Reading several at a time overlaps the waits for memory.
            for (&(at, _), coefficients) in group.iter().zip(&mut coefficients) {
                let (lane, floats) = (scratch.lanes[at], reader.floats());
                match source.harmonics.get(lane * floats..(lane + 1) * floats) {
                    Some(read) if floats > 0 => coefficients[..floats].copy_from_slice(read),
                    _ => reader.read(&source.batch, lane, coefficients),
                }
            }
            for (parts, lanes) in directions.iter_mut().zip(&scratch.flat.direction) {
                for (part, &(at, _)) in parts.iter_mut().zip(group) {
                    *part = lanes[at % BATCH] as f32;
                }
            }
            let degree = self.degree_in(source, &directions, out);
            bases.find(simd, degree, &directions);
            for (number, &(at, reach)) in group.iter().enumerate() {
                let at = at % BATCH;
                let flat = &*scratch.flat;
                let coefficients = &coefficients[number % DIRECTIONS];
                let Some(color) = bases.color(simd, degree, number, coefficients) else {
                    out.counters.add(Counter::SkippedNonFinite, 1);
                    continue;
                };
                let sequence = sequence(scratch.lanes[at]);
                out.keys.push([self.key(at, sequence, scratch), sequence]);
                let depth = self.center_depth(at, scratch);
                let wide = self
                    .period
                    .is_some_and(|period| 2.0 * flat.half[0][at] >= period);
                let splat = Splat::new(flat, at, color, depth);
                out.splats.push(Splat {
                    steep: wide || splat.steep,
                    wide,
                    ..splat
                });
                out.reaches.push(reach);
                if self.geometry == GaussianGeometry::Surfel {
                    let (surfel, _) = self.surfel(at, scratch, &mut Vec::new());
                    out.surfels.push(surfel);
                }
                if self.order == GaussianOrder::PerPixel {
                    out.ray_depths.push(self.ray_depth(at, scratch));
                }
                if let Some(period) = self.period {
                    panorama::copy_last(at, period, &mut copies, out);
                }
            }
        }
        let counters = &mut out.counters;
        counters.add(Counter::GaussiansDrawn, out.splats.len() as u64);
        if self.skips.has(Skip::Harmonics) {
            let unread = source.batch.len - scratch.reached.len();
            counters.add(Counter::HarmonicsUnread, unread as u64);
        }
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
