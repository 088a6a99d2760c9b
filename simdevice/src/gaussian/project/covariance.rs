//! Means and covariances: from a group's attributes to Gaussians in the picture.
//!
//! Everything from the camera-space mean to the conic is computed in binary64 and rounded once at the end: in binary32
//! the determinant of a very thin Gaussian and the depth of neighbours are wrong in the fourth digit. No operation is fused,
//! since SSE2 would take long for a fused one in binary64.

use super::scratch::Scratch;
use super::screen::shape;
use super::unscented;
use crate::gaussian::lanes::{GROUP, GroupF64};
use crate::gaussian::linear_algebra::{cofactors, dot};
use crate::gaussian::read::group::GroupAttributes;
use crate::gaussian::view::camera::{self, Linearization};
use crate::gaussian::view::constants::ViewConstants;
use crate::state::gaussian::CameraModel;
use fearless_simd::{Simd, prelude::*};

/// Computes mean, covariance and opacity in the picture for the kept Gaussians.
#[inline(always)]
pub(crate) fn to_screen<S: Simd>(view: &ViewConstants, simd: S, group: &GroupAttributes<'_>, scratch: &mut Scratch) {
    let by_matrices = group.matrices.is_some();
    if by_matrices {
        place_by_matrices(view, scratch);
    } else {
        place(view, simd, scratch);
    }
    let unscented = view.unscented;
    let is_pinhole = view.model == CameraModel::Pinhole && view.lens.is_none() && !by_matrices && !unscented;
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
    let screen = &mut *scratch.screen;
    let r = view.rotation;
    let (one, two) = (number(1.0), number(2.0));
    for at in (0..scratch.lanes.len()).step_by(S::f64s::LEN) {
        let store = |value: S::f64s, lanes: &mut GroupF64| {
            value.store_slice(&mut lanes[at..at + S::f64s::LEN]);
        };
        let end = scratch.lanes.len().min(at + S::f64s::LEN);
        let kept = scratch.kept.group(at, S::f64s::LEN);
        group.prefetch_harmonics(view.sh_degree, &scratch.lanes[at..end], kept);
        let [w, x] = [load(&rotation[0], at), load(&rotation[1], at)];
        let [y, z] = [load(&rotation[2], at), load(&rotation[3], at)];
        // Squares of binary32 numbers are in binary64's range.
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
        let scale = [load(&scale[0], at), load(&scale[1], at), load(&scale[2], at)];
        let per_depth = one / load(&scratch.camera[2], at);
        let mut m = [[one; 3]; 2];
        for axis in 0..2 {
            let [kx, ky, kz] = if is_pinhole {
                let slope = load(&scratch.camera[axis], at) * per_depth;
                let focal = number(view.focal[axis]);
                store(slope * focal + view.center[axis], &mut screen.mean[axis]);
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
                m[axis][part] = scale[part] * (kx * cx + ky * cy + kz * cz);
            }
        }
        let [[ax, ay, az], [bx, by, bz]] = m;
        let [cx, cy, cz] = [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
        let mut area2 = cx * cx + cy * cy + cz * cz;
        let mut covariance = [ax * ax + ay * ay + az * az, ax * bx + ay * by + az * bz, bx * bx + by * by + bz * bz];
        if unscented {
            covariance = [load(&moments[0], at), load(&moments[1], at), load(&moments[2], at)];
            area2 = load(&moments[3], at);
        }
        shape(view, simd, at, covariance, area2, load(opacity, at), screen);
    }
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

/// Computes the positions of the kept Gaussians in camera space, and the viewing directions in their own space.
pub(crate) fn place_by_matrices(view: &ViewConstants, scratch: &mut Scratch) {
    let Some(models) = &mut scratch.models else {
        return;
    };
    let r = &view.rotation;
    for at in 0..scratch.lanes.len().min(GROUP) {
        let a = models.linear(at);
        let p = scratch.position.each_ref().map(|lanes| lanes[at]);
        let d = [0, 1, 2].map(|axis| dot(a[axis], p) + (models.matrix[axis][3][at] - view.eye[axis]));
        let t = [0, 3, 6].map(|row| d[0] * r[row] + d[1] * r[row + 1] + d[2] * r[row + 2]);
        // The columns of the inverse, times the determinant. Only its sign matters for directions.
        let columns = cofactors(a);
        let sign = dot(a[0], columns[0]).signum();
        for axis in 0..3 {
            scratch.offset[axis][at] = d[axis];
            scratch.camera[axis][at] = t[axis];
            let sum = d[0] * columns[0][axis] + d[1] * columns[1][axis] + d[2] * columns[2][axis];
            models.toward[axis][at] = sign * sum;
        }
        scratch.depth[at] = t[2];
    }
}

/// Computes depths, means and Jacobians of the kept Gaussians, for all modes but an ideal pinhole without models.
pub(crate) fn linearize_group(view: &ViewConstants, by_matrices: bool, scratch: &mut Scratch) {
    let [x, y, z] = &*scratch.camera;
    let models = scratch.models.as_deref().filter(|_| by_matrices);
    let r = &view.rotation;
    for at in 0..scratch.lanes.len().min(GROUP) {
        let t = [x[at], y[at], z[at]];
        scratch.depth[at] = camera::depth(view.model, t);
        let Linearization { place, jacobian } = camera::linearize(view.model, view.lens.as_ref(), view.slopes(), t);
        for (axis, row) in jacobian.iter().enumerate() {
            scratch.screen.mean[axis][at] = place[axis] * view.focal[axis] + view.center[axis];
            let j = row.map(|element| element * view.focal[axis]);
            let of_column = |column| j[0] * r[column] + j[1] * r[3 + column] + j[2] * r[6 + column];
            let mut row = [0, 1, 2].map(of_column);
            if let Some(models) = models {
                row = models.row_from_world(at, row);
            }
            for (lanes, element) in scratch.jacobian[axis].iter_mut().zip(row) {
                lanes[at] = element;
            }
        }
    }
}
