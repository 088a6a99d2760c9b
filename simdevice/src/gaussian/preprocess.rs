//! Preprocessing: projects the Gaussians of a group to the rasterizer's nine numbers, with their tiles, colours and
//! keys.
//!
//! Everything from the camera-space mean to the conic is computed in binary64 and rounded once at the end: in binary32
//! the determinant of a very thin Gaussian and the depth of neighbours are wrong in the fourth digit. Tiles and
//! directions are computed in binary32 where that is enough. Gaussians are culled before the covariance is computed, and
//! spherical harmonics are read only for Gaussians that reach a tile. No fused operations are used for keys and means,
//! so that these have the same bits at every SIMD level.

use super::attributes::{Attributes, CoefficientReader, Fetcher, Group, Harmonics};
use super::camera::{LN_2, ViewConstants};
use super::clusters::Cluster;
use super::frustum::Frustum;
use super::identity::Identity;
use super::instances::{Matrices, cofactors, dot};
use super::lanes::{Bits, F32_LANES, GROUP, GroupF64, log2};
use super::ray_depth::RayDepth;
use super::scratch::{Scratch, ScreenGaussians};
use super::sort::ordered_bits;
use super::spherical_harmonics::{Bases, COEFFICIENT_FLOATS, DIRECTIONS, MAX_COEFFICIENTS, coefficient_count};
use super::splat::{ProjectedGroup, Splat, are_steep, binary16_headroom};
use super::surfel::surfel_of;
use super::tiles::find_tiles;
use super::{camera, panorama, unscented};
use crate::packet::GaussianAppend;
use crate::runtime::Runtime;
use crate::state::gaussian::{CameraModel, GaussianGeometry, GaussianOrder, GaussianPrecision};
use crate::stats::counters::{Counter, Counters};
use crate::stats::optimizations::Optimization;
use devmem::{dispatch, host};
use fearless_simd::{Simd, f32x16, prelude::*};
use rayon::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};

/// The most groups per task of a worker. Larger tasks make workers wait for the last one.
const GROUPS_PER_TASK: usize = 4;

/// The attributes of a group of Gaussians.
pub(super) struct Source<'a> {
    /// The reader of the Gaussians' spherical harmonics.
    pub(super) reader: CoefficientReader<'a>,
    pub(super) group: Group<'a>,
    pub(super) attributes: &'a Attributes,
    /// The model matrices of the Gaussians, if there are any.
    pub(super) matrices: Option<&'a Matrices>,
    /// True if all attributes are valid, so that no Gaussian is skipped because of them.
    pub(super) is_sound: bool,
    /// The spherical harmonics of the Gaussians, if they are in host memory already.
    pub(super) harmonics: Harmonics<'a>,
    /// The frustum for culling; `None` if they are not culled.
    pub(super) frustum: Option<&'a Frustum>,
}

impl Source<'_> {
    /// Reads the spherical harmonics of a lane into `read`, and zeros where the draw has fewer, and returns `read`.
    #[inline(never)]
    fn read_harmonics<'b>(&self, lane: usize, read: &'b mut [f32; COEFFICIENT_FLOATS]) -> &'b [f32] {
        let floats = self.reader.floats();
        match self.harmonics.from(lane).get(..floats) {
            Some(last) if floats > 0 => read[..floats].copy_from_slice(last),
            _ => self.reader.read(&self.group, lane, read),
        }
        read
    }

    /// Starts to load the spherical harmonics of degrees 0 to `degree` into the processor's cache, for the lanes that
    /// have a bit in `kept`.
    #[inline(always)]
    fn prefetch_harmonics(&self, degree: u32, lanes: &[usize], kept: u64) {
        let count = coefficient_count(degree);
        if let [first, .., last] = *lanes
            && last - first == lanes.len() - 1
            && let Some(floats) = self.harmonics.of_all(first..=last, 3 * count)
        {
            return devmem::prefetch(floats);
        }
        for (number, &lane) in lanes.iter().enumerate() {
            if kept >> number & 1 == 0 {
                continue;
            }
            match self.harmonics.from(lane) {
                [] => self.reader.prefetch(&self.group, lane, count),
                floats => devmem::prefetch(&floats[..floats.len().min(3 * count)]),
            }
        }
    }
}

/// The numbers in the set of a group's Gaussians.
#[derive(Clone, Copy, Debug)]
pub(super) enum Sequence<'a> {
    /// Consecutive numbers, from this one on.
    From(u32),
    /// These numbers, counted from the first one.
    Listed(u32, &'a [u32]),
}

/// Projects a group and appends the result to `out`.
#[inline(always)]
pub(super) fn project<S: Simd>(
    view: &ViewConstants,
    simd: S,
    source: &Source<'_>,
    scratch: &mut Scratch,
    sequence: Sequence<'_>,
    out: &mut ProjectedGroup,
) {
    let counters = &mut out.counters;
    counters.add(Counter::GaussiansRead, source.group.len as u64);
    let kept = cull(view, simd, source, counters);
    // In simple modes lanes that were culled are projected, too: that is cheap, and the results are not used.
    let is_plain = view.model == CameraModel::Pinhole
        && view.geometry == GaussianGeometry::Volume
        && view.precision == GaussianPrecision::Float32
        && source.matrices.is_none()
        && !view.unscented;
    scratch.gather(source.attributes, &kept, source.group.len, is_plain);
    if let Some(matrices) = source.matrices {
        scratch.gather_matrices(matrices);
    }
    flatten(view, simd, source, scratch);
    emit(view, simd, source, scratch, sequence, out);
}

/// The lanes with finite spherical harmonics. Reads the coefficients of all lanes.
#[inline(always)]
fn find_colored<S: Simd>(view: &ViewConstants, simd: S, source: &Source<'_>) -> Bits {
    let reader = &source.reader;
    let mut coefficients = [0.0; COEFFICIENT_FLOATS];
    let anywhere = Bases::default();
    let mut colored = Bits::default();
    for lane in 0..source.group.len {
        reader.read(&source.group, lane, &mut coefficients);
        let color = anywhere.color(simd, view.sh_degree, 0, &coefficients);
        colored.set_one(lane, color.is_some());
    }
    colored
}

/// The lanes that no test culls. Counts the others by the first reason to skip them.
#[inline(always)]
fn cull<S: Simd>(view: &ViewConstants, simd: S, source: &Source<'_>, counters: &mut Counters) -> Bits {
    let len = source.group.len;
    let mut kept = Bits::first(len);
    let mut keep = |passed: &Bits, counter: Counter| {
        let skipped = kept.without(passed).count();
        counters.add(counter, skipped);
        kept = kept.and(passed);
        skipped
    };
    if !view.optimizations.has(Optimization::Harmonics) {
        let colored = find_colored(view, simd, source);
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
    let bright = find_bright(view, simd, source.attributes, len);
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

/// The lanes whose opacities reach the alpha floor.
#[inline(always)]
fn find_bright<S: Simd>(view: &ViewConstants, simd: S, attributes: &Attributes, len: usize) -> Bits {
    let mut bright = Bits::default();
    // The floor was binary32 originally.
    let floor = S::f32s::splat(simd, view.alpha_floor as f32);
    for at in (0..len).step_by(S::f32s::LEN) {
        let o = S::f32s::from_slice(simd, &attributes.opacity[at..at + S::f32s::LEN]);
        bright.set(at, o.simd_ge(floor));
    }
    bright
}

/// Computes the positions of the kept Gaussians in camera space.
#[inline(always)]
fn place<S: Simd>(view: &ViewConstants, simd: S, scratch: &mut Scratch) {
    let r = view.rotation;
    for at in (0..scratch.lanes.len()).step_by(S::f64s::LEN) {
        let load = |lanes: &GroupF64| S::f64s::from_slice(simd, &lanes[at..at + S::f64s::LEN]);
        let store = |value: S::f64s, lanes: &mut GroupF64| {
            value.store_slice(&mut lanes[at..at + S::f64s::LEN]);
        };
        let [px, py, pz] = &*scratch.position;
        let dx = load(px) - view.eye[0];
        let dy = load(py) - view.eye[1];
        let dz = load(pz) - view.eye[2];
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

/// Computes mean, covariance and opacity in the picture for the kept Gaussians.
#[inline(always)]
fn flatten<S: Simd>(view: &ViewConstants, simd: S, source: &Source<'_>, scratch: &mut Scratch) {
    let by_matrices = source.matrices.is_some();
    if by_matrices {
        place_by_matrices(view, scratch);
    } else {
        place(view, simd, scratch);
    }
    let unscented = view.unscented;
    let is_pinhole = view.model == CameraModel::Pinhole && !by_matrices && !unscented;
    if !is_pinhole {
        linearize_group(view, by_matrices, scratch);
    }
    if unscented {
        unscented::transform(view, by_matrices, scratch);
    }
    let moments = &*scratch.moments;
    let number = |value: f64| S::f64s::splat(simd, value);
    let load = |lanes: &GroupF64, at: usize| S::f64s::from_slice(simd, &lanes[at..at + S::f64s::LEN]);
    let (scale, rotation, opacity) = (&*scratch.scale, &*scratch.rotation, &*scratch.opacity);
    let flat = &mut *scratch.flat;
    let r = view.rotation;
    let (one, two) = (number(1.0), number(2.0));
    for at in (0..scratch.lanes.len()).step_by(S::f64s::LEN) {
        let store = |value: S::f64s, lanes: &mut GroupF64| {
            value.store_slice(&mut lanes[at..at + S::f64s::LEN]);
        };
        let end = scratch.lanes.len().min(at + S::f64s::LEN);
        let kept = scratch.kept.group(at, S::f64s::LEN);
        source.prefetch_harmonics(view.sh_degree, &scratch.lanes[at..end], kept);
        let [w, x] = [load(&rotation[0], at), load(&rotation[1], at)];
        let [y, z] = [load(&rotation[2], at), load(&rotation[3], at)];
        // Squares of binary32 numbers are in binary64's range.
        let double = two / z.mul_add(z, y.mul_add(y, x.mul_add(x, w * w)));
        let [dx, dy, dz] = [double * x, double * y, double * z];
        let (xx, yy, zz) = (dx * x, dy * y, dz * z);
        let (xy, xz, yz) = (dx * y, dx * z, dy * z);
        let (wx, wy, wz) = (dx * w, dy * w, dz * w);
        let columns = [
            [one - (yy + zz), xy + wz, xz - wy],
            [xy - wz, one - (xx + zz), yz + wx],
            [xz + wy, yz - wx, one - (xx + yy)],
        ];
        let scale = [load(&scale[0], at), load(&scale[1], at), load(&scale[2], at)];
        let per_depth = one / load(&scratch.camera[2], at);
        let mut m = [[one; 3]; 2];
        for axis in 0..2 {
            let [kx, ky, kz] = if is_pinhole {
                let slope = load(&scratch.camera[axis], at) * per_depth;
                let focal = number(view.focal[axis]);
                store(slope * focal + view.center[axis], &mut flat.mean[axis]);
                let clamped = slope.max(view.slope_min[axis]).min(view.slope_max[axis]);
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
                m[axis][part] = scale[part] * kz.mul_add(cz, ky.mul_add(cy, kx * cx));
            }
        }
        let [[ax, ay, az], [bx, by, bz]] = m;
        let [cx, cy, cz] = [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
        let mut area2 = cz.mul_add(cz, cy.mul_add(cy, cx * cx));
        let mut covariance = [
            az.mul_add(az, ay.mul_add(ay, ax * ax)),
            az.mul_add(bz, ay.mul_add(by, ax * bx)),
            bz.mul_add(bz, by.mul_add(by, bx * bx)),
        ];
        if unscented {
            covariance = [load(&moments[0], at), load(&moments[1], at), load(&moments[2], at)];
            area2 = load(&moments[3], at);
        }
        shape(view, simd, at, covariance, area2, load(opacity, at), flat);
    }
}

/// Computes the numbers that rasterization and the search for tiles need, for Gaussians from lane `at` on. The inputs
/// are the covariances in the picture before the low-pass filter (xx, xy, yy) in px^2, their determinants, and
/// opacities.
#[inline(always)]
pub(super) fn shape<S: Simd>(
    view: &ViewConstants,
    simd: S,
    at: usize,
    [xx, xy, yy]: [S::f64s; 3],
    area2: S::f64s,
    mut o: S::f64s,
    flat: &mut ScreenGaussians,
) {
    let number = |value: f64| S::f64s::splat(simd, value);
    let store = |value: S::f64s, lanes: &mut GroupF64| {
        value.store_slice(&mut lanes[at..at + S::f64s::LEN]);
    };
    let low_pass = number(view.low_pass);
    let determinant = low_pass.mul_add(xx + yy, area2) + low_pass * low_pass;
    store(determinant, &mut flat.determinant);
    if view.compensated {
        let mut ratio = area2 / determinant;
        if view.compensation_floor > 0.0 {
            ratio = ratio.max(number(view.compensation_floor));
        }
        o *= ratio.sqrt();
    }
    let log2_opacity = log2(simd, o);
    store(log2_opacity, &mut flat.log2_opacity);

    let (a, b, c) = (xx + low_pass, xy, yy + low_pass);
    // alpha = opacity exp(-q / 2) = 2^(log2 opacity - q / (2 ln 2)), and
    // q = d.x^2 / a + (a / det) (d.y - (b / a) d.x)^2.
    let unit = (0.5 / LN_2).sqrt();
    let per_a = number(1.0) / a;
    let vertical = (a / determinant).sqrt() * unit;
    let factor = [per_a.sqrt() * unit, -(b * per_a) * vertical, vertical];
    store(factor[0], &mut flat.factor[0]);
    store(factor[1], &mut flat.factor[1]);
    store(factor[2], &mut flat.factor[2]);
    if at == 0 {
        flat.steep = Bits::default();
    }
    flat.steep.set(at, are_steep::<S>(factor, log2_opacity));
    // The tile engine evaluates the exponent in binary32. A margin wider than its error keeps every pixel that it would
    // accept. Gaussians that still cannot reach the floor have a negative extent.
    let room = log2_opacity - view.log2_floor;
    let mut extent = (room + room.abs() * 1e-5 + 1e-3) * (2.0 * LN_2);
    if view.precision == GaussianPrecision::Float16 {
        for lane in at..at + S::f64s::LEN {
            let factor = [0, 1, 2].map(|element| flat.factor[element][lane]);
            let room = flat.log2_opacity[lane] - view.log2_floor;
            flat.extent[lane] = binary16_headroom(factor, room) * (2.0 * LN_2);
        }
        extent = S::f64s::from_slice(simd, &flat.extent[at..at + S::f64s::LEN]);
    }
    store(extent, &mut flat.extent);
    for (element, lanes) in [a, b, c].into_iter().zip(&mut flat.covariance) {
        store(element, lanes);
    }
}

/// Computes the positions of the kept Gaussians in camera space, and the viewing directions in their own space.
pub(super) fn place_by_matrices(view: &ViewConstants, scratch: &mut Scratch) {
    let Some(placed) = &mut scratch.placed else {
        return;
    };
    let r = &view.rotation;
    for at in 0..scratch.lanes.len().min(GROUP) {
        let a = placed.linear(at);
        let p = scratch.position.each_ref().map(|lanes| lanes[at]);
        let d = [0, 1, 2].map(|axis| dot(a[axis], p) + (placed.matrix[axis][3][at] - view.eye[axis]));
        let t = [0, 3, 6].map(|row| d[0] * r[row] + d[1] * r[row + 1] + d[2] * r[row + 2]);
        // The columns of the inverse, times the determinant. Only its sign matters for directions.
        let columns = cofactors(a);
        let sign = dot(a[0], columns[0]).signum();
        for axis in 0..3 {
            scratch.offset[axis][at] = d[axis];
            scratch.camera[axis][at] = t[axis];
            let sum = d[0] * columns[0][axis] + d[1] * columns[1][axis] + d[2] * columns[2][axis];
            placed.toward[axis][at] = sign * sum;
        }
        scratch.depth[at] = t[2];
    }
}

/// Computes depths, means and Jacobians of the kept Gaussians, for all modes but a pinhole without models.
pub(super) fn linearize_group(view: &ViewConstants, by_matrices: bool, scratch: &mut Scratch) {
    let [x, y, z] = &*scratch.camera;
    let placed = scratch.placed.as_deref().filter(|_| by_matrices);
    let r = &view.rotation;
    for at in 0..scratch.lanes.len().min(GROUP) {
        let t = [x[at], y[at], z[at]];
        scratch.depth[at] = camera::depth(view.model, t);
        let (place, rows) = camera::linearize(view.model, view.slopes(), t);
        for (axis, row) in rows.iter().enumerate() {
            scratch.flat.mean[axis][at] = place[axis] * view.focal[axis] + view.center[axis];
            let j = row.map(|element| element * view.focal[axis]);
            let of_column = |column| j[0] * r[column] + j[1] * r[3 + column] + j[2] * r[6 + column];
            let mut row = [0, 1, 2].map(of_column);
            if let Some(placed) = placed {
                row = placed.row_from_world(at, row);
            }
            for (lanes, element) in scratch.jacobian[axis].iter_mut().zip(row) {
                lanes[at] = element;
            }
        }
    }
}

/// A kept lane's depth in the encoding of the depth attachment.
#[inline(always)]
fn center_depth(view: &ViewConstants, at: usize, scratch: &Scratch) -> u32 {
    view.depth.map_or(0, |depth| depth.code(scratch.depth[at] as f32))
}

/// Computes the sort key and the sequence number of each kept lane.
#[inline(always)]
fn find_keys(view: &ViewConstants, sequence: Sequence<'_>, scratch: &mut Scratch) {
    let [keys, sequences] = &mut *scratch.keys;
    let to_lanes = sequences.iter_mut().zip(&scratch.lanes);
    match sequence {
        Sequence::From(first) => to_lanes.for_each(|(to, &lane)| *to = first + lane as u32),
        // All lanes are there, in order.
        Sequence::Listed(first, numbers) if numbers.len() == scratch.lanes.len() => {
            let to_lanes = sequences.iter_mut().zip(numbers);
            to_lanes.for_each(|(to, &number)| *to = first + number);
        }
        Sequence::Listed(first, numbers) => {
            to_lanes.for_each(|(to, &lane)| *to = first + numbers[lane]);
        }
    }
    match view.order {
        GaussianOrder::ViewDepth => {
            for (key, &depth) in keys.iter_mut().zip(&*scratch.depth) {
                *key = ordered_bits(depth as f32);
            }
        }
        GaussianOrder::RadialDistance => {
            let [x, y, z] = &*scratch.offset;
            for (key, ((x, y), z)) in keys.iter_mut().zip(x.iter().zip(y).zip(z)) {
                *key = ordered_bits((x * x + y * y + z * z).sqrt() as f32);
            }
        }
        // Per-pixel sorting happens later, and uses the order of the draw for equal depths.
        GaussianOrder::Primitive | GaussianOrder::PerPixel => *keys = *sequences,
    }
}

/// The inputs for a kept lane's depth along a pixel's ray.
fn ray_depth(view: &ViewConstants, at: usize, scratch: &Scratch) -> RayDepth {
    let [w, x, y, z] = &*scratch.rotation;
    let [sx, sy, sz] = &*scratch.scale;
    let [dx, dy, dz] = &*scratch.offset;
    RayDepth::new(&view.rotation, [w[at], x[at], y[at], z[at]], [sx[at], sy[at], sz[at]], [dx[at], dy[at], dz[at]])
}

/// The vectors from the eye to the means of the kept Gaussians, in the axes of the Gaussians' own space.
fn toward<'a>(source: &Source<'_>, scratch: &'a Scratch) -> &'a [GroupF64; 3] {
    match &scratch.placed {
        Some(placed) if source.matrices.is_some() => &placed.toward,
        _ => &scratch.offset,
    }
}

/// The least and the greatest square of a length that is formed in binary32. Numbers of such lengths neither overflow
/// nor lose digits to underflow.
const SQUARES: [f32; 2] = [1e-20, 1e20];

/// Gives vectors the length 1, in binary32. Changes nothing and returns false if the square of a length is outside of
/// [`SQUARES`].
#[inline(always)]
fn normalize<S: Simd>(simd: S, vectors: &mut [[f32; DIRECTIONS]; 3]) -> bool {
    let [x, y, z] = vectors.each_ref().map(|lanes| f32x16::from_slice(simd, lanes));
    let square = z.mul_add(z, y.mul_add(y, x * x));
    let [least, greatest] = SQUARES;
    if !square.max(least).min(greatest).simd_eq(square).all_true() {
        return false;
    }
    let per_length = f32x16::splat(simd, 1.0) / square.sqrt();
    for (lanes, part) in vectors.iter_mut().zip([x, y, z]) {
        (part * per_length).store_slice(lanes);
    }
    true
}

/// Computes the directions of a batch of elements from the vectors `toward` them, whatever their lengths.
#[cold]
fn normalize_wide(toward: &[GroupF64; 3], batch: &[usize], directions: &mut [[f32; DIRECTIONS]; 3]) {
    for (number, &at) in batch.iter().enumerate() {
        let vector = toward.each_ref().map(|lanes| lanes[at % GROUP]);
        let [x, y, z] = vector.map(f64::abs);
        let unit = 1.0 / x.max(y).max(z);
        let [x, y, z] = vector.map(|part| part * unit);
        let per_length = 1.0 / (x * x + y * y + z * z).sqrt();
        for (lanes, part) in directions.iter_mut().zip([x, y, z]) {
            lanes[number % DIRECTIONS] = (part * per_length) as f32;
        }
    }
}

/// Finds the tiles and colours of the kept Gaussians and appends those that reach a tile to `out`.
#[inline(always)]
pub(super) fn emit<S: Simd>(
    view: &ViewConstants,
    simd: S,
    source: &Source<'_>,
    scratch: &mut Scratch,
    sequence: Sequence<'_>,
    out: &mut ProjectedGroup,
) {
    out.reserve(scratch.lanes.len());
    find_tiles(view, simd, scratch, out);
    find_keys(view, sequence, scratch);
    let degree = view.sh_degree;
    let toward = toward(source, scratch);
    // Elements without a Gaussian have a direction too, so that they do not look like one without.
    let (mut directions, mut bases) = ([[1.0; DIRECTIONS]; 3], Bases::default());
    let mut read = [0.0; COEFFICIENT_FLOATS];
    let mut copies = &*scratch.copies;
    for group in scratch.reached.chunks(DIRECTIONS) {
        for (parts, lanes) in directions.iter_mut().zip(toward) {
            for (part, &at) in parts.iter_mut().zip(group) {
                *part = lanes[at % GROUP] as f32;
            }
        }
        if !normalize(simd, &mut directions) {
            normalize_wide(toward, group, &mut directions);
        }
        bases.find(simd, degree, &directions);
        // All colours are computed first, so that their reads from memory overlap.
        let lanes = &*scratch.lanes;
        let colored = match degree {
            0 => color::<S, 1>(simd, source, lanes, group, &bases, &mut read),
            1 => color::<S, 4>(simd, source, lanes, group, &bases, &mut read),
            2 => color::<S, 9>(simd, source, lanes, group, &bases, &mut read),
            3 => color::<S, 16>(simd, source, lanes, group, &bases, &mut read),
            _ => color::<S, MAX_COEFFICIENTS>(simd, source, lanes, group, &bases, &mut read),
        };
        let uncolored = group.len() - colored.all().len();
        out.counters.add(Counter::SkippedNonFinite, uncolored as u64);
        let Some(period) = view.period else {
            append(view, colored.all(), scratch, out);
            continue;
        };
        for one in colored.all() {
            append(view, std::slice::from_ref(one), scratch, out);
            panorama::copy_last(one.at, period, &mut copies, out);
        }
    }
    let counters = &mut out.counters;
    counters.add(Counter::GaussiansDrawn, out.splats.len() as u64);
    if view.optimizations.has(Optimization::Harmonics) {
        let unread = source.group.len - scratch.reached.len();
        counters.add(Counter::HarmonicsUnread, unread as u64);
    }
}

/// Appends kept lanes and their colours to `out`.
#[inline(always)]
fn append(view: &ViewConstants, lanes: &[ColoredLane], scratch: &Scratch, out: &mut ProjectedGroup) {
    // Iterators of known length append without checking the capacity each time.
    let [keys, sequences] = &*scratch.keys;
    let keys = lanes.iter().map(|one| [keys[one.at], sequences[one.at]]);
    out.keys.extend(keys);
    let splats = lanes.iter().map(
        #[inline(always)]
        |one| one.splat(view, scratch),
    );
    match view.period {
        None => out.splats.extend(splats),
        Some(period) => out.splats.extend(lanes.iter().zip(splats).map(|(one, splat)| {
            let wide = 2.0 * scratch.flat.ellipse(one.at).half[0] >= period;
            Splat { needs_f64: wide || splat.needs_f64, exceeds_period: wide, ..splat }
        })),
    }
    let reaches = lanes.iter().map(|one| scratch.reaches.get(one.at));
    out.reaches.extend(reaches);
    if view.geometry == GaussianGeometry::Surfel {
        let surfels = lanes.iter().map(|one| surfel_of(view, one.at, scratch, &mut Vec::new()).0);
        out.surfels.extend(surfels);
    }
    if view.order == GaussianOrder::PerPixel {
        let depths = lanes.iter().map(|one| ray_depth(view, one.at, scratch));
        out.ray_depths.extend(depths);
    }
    if view.is_tracked {
        let identities =
            lanes.iter().map(|one| Identity { z: scratch.depth[one.at] as f32, sequence: sequences[one.at] });
        out.identities.extend(identities);
    }
}

/// A kept lane and its colour.
#[derive(Clone, Copy, Debug, Default)]
struct ColoredLane {
    at: usize,
    /// Red, green and blue; the fourth number is unused.
    color: [f32; 4],
}

impl ColoredLane {
    /// The splat that the tile engine reads.
    #[inline(always)]
    fn splat(&self, view: &ViewConstants, scratch: &Scratch) -> Splat {
        let [red, green, blue, _] = self.color;
        let depth = center_depth(view, self.at, scratch);
        Splat::new(&scratch.flat, self.at, [red, green, blue], depth)
    }
}

/// The coloured lanes of a batch of directions.
struct Colored {
    lanes: [ColoredLane; DIRECTIONS],
    len: usize,
}

impl Colored {
    #[inline(always)]
    fn all(&self) -> &[ColoredLane] {
        &self.lanes[..self.len.min(DIRECTIONS)]
    }
}

/// Computes the colours of a batch of elements from `COUNT` coefficients each, in the directions of `bases`. Elements
/// whose coefficients are not finite are left out. `lanes` are the elements' lanes, and `read` is scratch, of zeros where
/// the draw has no coefficients.
#[inline(always)]
fn color<S: Simd, const COUNT: usize>(
    simd: S,
    source: &Source<'_>,
    lanes: &[usize],
    batch: &[usize],
    bases: &Bases,
    read: &mut [f32; COEFFICIENT_FLOATS],
) -> Colored {
    let mut colored = [ColoredLane::default(); DIRECTIONS];
    let mut len = 0;
    // One more than there are, since vectors have four numbers and coefficients three.
    let needed = 3 * COUNT + 1;
    let held = if source.reader.floats() + 1 >= needed { source.harmonics } else { Harmonics::default() };
    for (number, &at) in batch.iter().enumerate() {
        let lane = lanes[at % GROUP];
        let coefficients = match held.first(lane, needed) {
            Some(coefficients) => coefficients,
            None => source.read_harmonics(lane, read),
        };
        if let Some(color) = bases.color_of::<S, COUNT>(simd, number, coefficients) {
            let to = &mut colored[len % DIRECTIONS];
            to.at = at % GROUP;
            color.store_slice(&mut to.color);
            len += 1;
        }
    }
    Colored { lanes: colored, len }
}

/// The lanes whose attributes are finite, those with a nonzero rotation, and those without a negative scale.
#[inline(always)]
fn find_sound<S: Simd>(simd: S, attributes: &Attributes, len: usize) -> [Bits; 3] {
    let mut sound = [Bits::default(); 3];
    let zero = S::f32s::splat(simd, 0.0);
    for at in (0..len).step_by(S::f32s::LEN) {
        let load = |lanes: &[f32; F32_LANES]| S::f32s::from_slice(simd, &lanes[at..at + S::f32s::LEN]);
        // Times zero, a number that is not finite becomes NaN, and sums stay NaN.
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

/// A group to project.
#[derive(Clone)]
pub(super) struct GroupTask<'a> {
    pub(super) append: &'a GaussianAppend,
    pub(super) instance: u32,
    /// The number in the set of the instance's first Gaussian.
    pub(super) sequence: u32,
    pub(super) part: GroupSource<'a>,
    /// True if the cluster holds the append's spherical harmonics.
    pub(super) has_harmonics: bool,
    pub(super) frustum: Arc<Frustum>,
}

#[derive(Clone, Copy)]
pub(super) enum GroupSource<'a> {
    /// The vertices from this one on.
    From(u32),
    Cluster(&'a Cluster),
}

impl<'a> GroupTask<'a> {
    /// Reads the group, unless its cluster holds the attributes, and the model's attributes.
    pub(super) fn read<'b>(
        &'b self,
        fetcher: &mut Fetcher,
        attributes: &'b mut Attributes,
        matrices: &'b mut Option<Box<Matrices>>,
        is_flat: bool,
    ) -> Source<'b> {
        let streams = &self.append.attributes;
        let group = match self.part {
            GroupSource::From(start) => {
                let len = (self.append.count - start).min(GROUP as u32) as usize;
                Group::new(self.append, self.instance, start, len)
            }
            GroupSource::Cluster(cluster) => Group::of_cluster(self.append, self.instance, &cluster.numbers),
        };
        let matrices = streams.model.matrix.as_ref().map(|rows| {
            let matrices = matrices.get_or_insert_default();
            matrices.read(fetcher, rows, &group);
            &**matrices
        });
        let is_faded = streams.model.opacity.is_some();
        let harmonics = match self.part {
            GroupSource::Cluster(cluster) if self.has_harmonics => cluster.harmonics(),
            _ => Harmonics::default(),
        };
        let (attributes, is_sound) = match self.part {
            GroupSource::Cluster(cluster) if !is_faded => (&cluster.attributes, cluster.is_sound),
            GroupSource::Cluster(cluster) => {
                attributes.clone_from(&cluster.attributes);
                fetcher.fade(streams, &group, attributes);
                // Products of finite numbers may overflow.
                (&*attributes, false)
            }
            GroupSource::From(_) => {
                fetcher.read_own(streams, &group, attributes);
                fetcher.fade(streams, &group, attributes);
                if is_flat {
                    attributes.scale[2][..group.len].fill(0.0);
                }
                (&*attributes, false)
            }
        };
        Source {
            reader: CoefficientReader::new(&streams.spherical_harmonics),
            group,
            attributes,
            matrices,
            is_sound,
            harmonics,
            frustum: None,
        }
    }
}

/// Projects groups of Gaussians for one view.
pub(super) struct Preprocessor<'a> {
    pub(super) runtime: &'a Runtime,
    pub(super) constants: &'a ViewConstants,
    pub(super) is_flat: bool,
}

impl Preprocessor<'_> {
    /// Projects all groups, and keeps their order.
    pub(super) fn run(&self, tasks: &[GroupTask<'_>]) -> Vec<ProjectedGroup> {
        // Each thread allocates its scratch once. No other thread takes its lock, and no task waits for others, so that
        // no task begins within another on the same thread.
        let workers = (0..rayon::current_num_threads()).map(|_| Mutex::new(None));
        let workers: Vec<Mutex<Option<Worker>>> = workers.collect();
        let one = |task| {
            let own = rayon::current_thread_index().unwrap_or(0) % workers.len();
            let mut worker = workers[own].lock().unwrap_or_else(PoisonError::into_inner);
            self.task(worker.get_or_insert_with(Worker::new), task)
        };
        let mut groups = host::with_capacity(tasks.len());
        tasks.par_iter().with_max_len(GROUPS_PER_TASK).map(one).collect_into_vec(&mut groups);
        groups
    }

    /// Projects one group.
    fn task(&self, worker: &mut Worker, task: &GroupTask<'_>) -> ProjectedGroup {
        let Worker { fetcher, attributes, matrices, scratch } = worker;
        let mut out = ProjectedGroup::default();
        let constants = self.constants;
        let source = task.read(fetcher, attributes, matrices, self.is_flat);
        // The task's frustum is for opacities of at most 1, or of at most the clusters' opacity.
        let wider;
        let mut frustum = &*task.frustum;
        if let GroupSource::From(_) = task.part {
            let opacities = &source.attributes.opacity[..source.group.len];
            let opacity = opacities.iter().copied().fold(1.0, f32::max);
            if opacity > 1.0 {
                wider = Frustum::new(constants, opacity);
                frustum = &wider;
            }
        }
        let placed;
        let mut bounds = constants.optimizations.has(Optimization::Bounds).then_some(frustum);
        if let Some(matrices) = source.matrices {
            // With one matrix for all lanes, the frustum is transformed to the space before it.
            let uniform = bounds.and(matrices.uniform());
            placed = uniform.and_then(|matrix| frustum.within(matrix));
            bounds = placed.as_ref();
        }
        let source = Source { frustum: bounds, ..source };
        let sequence = match task.part {
            GroupSource::From(start) => Sequence::From(task.sequence + start),
            GroupSource::Cluster(cluster) => Sequence::Listed(task.sequence, &cluster.numbers),
        };
        dispatch!(self.runtime.level(), simd => project(constants, simd, &source, scratch, sequence, &mut out));
        out
    }
}

/// The buffers that a worker reuses from one group to the next.
struct Worker {
    fetcher: Fetcher,
    attributes: Box<Attributes>,
    /// Allocated when first needed.
    matrices: Option<Box<Matrices>>,
    scratch: Scratch,
}

impl Worker {
    fn new() -> Self {
        Self { fetcher: Fetcher::default(), attributes: Box::default(), matrices: None, scratch: Scratch::new() }
    }
}
