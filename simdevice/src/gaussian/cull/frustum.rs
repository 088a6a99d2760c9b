//! The frustum: planes that bound the part of space that a picture can show. A few operations show that a Gaussian, or
//! a cluster of them, is off the screen. The test is conservative: whatever is not certainly outside counts as inside.

use super::sides::{Plane, Sides, sides};
use crate::gaussian::lanes::{Bits, F32_LANES};
use crate::gaussian::linear_algebra::{Affine, Inverse, Linear, dot, inverse};
use crate::gaussian::read::attributes::Attributes;
use crate::gaussian::read::clusters::Bounds;
use crate::gaussian::view::constants::ViewConstants;
use crate::state::gaussian::CameraModel;
use fearless_simd::{Simd, prelude::*};
use isa::float::FusedMultiply;

#[cfg(test)]
mod tests;

/// The rounding error of binary32 sums here, relative to the sum of the magnitudes of the terms.
const ERROR: f64 = 1.0 / 1_048_576.0;

/// The greatest condition number of a matrix through which planes are transformed to another space.
const MAX_CONDITION: f64 = 1e5;

/// The planes of a camera that bound Gaussians of limited opacity.
#[derive(Clone, Debug)]
pub(crate) struct Frustum {
    eye: [f64; 3],
    /// The depths along the camera's axis; `None` if depths are distances from the eye.
    depth: Option<DepthRange>,
    /// The left, right, top and bottom planes; empty if no plane bounds the picture.
    sides: Vec<Plane>,
    /// A plane outside of which Gaussians are small enough for the sides to hold, if they do not hold for all
    /// Gaussians.
    small: Option<Plane>,
    alpha_floor: f64,
    /// The rounding error of a length, relative to it.
    rounding: f64,
    /// The rounding error of a length that is independent of it.
    displacement: f64,
}

/// The depths that a picture shows.
#[derive(Clone, Copy, Debug)]
struct DepthRange {
    /// The camera's axis, along which depths are measured.
    forward: [f64; 3],
    near: f32,
    far: f32,
}

/// A bound of binary64's rounding of a few operations, relative to their operands.
const ROUNDING: f64 = 1e-12;

/// The reason why Gaussians are not in a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outside {
    /// The opacities are below the floor.
    Faint,
    /// The Gaussians are not beyond the near plane.
    Near,
    /// The Gaussians are not before the far plane.
    Far,
    /// The Gaussians are to the left, right, top or bottom of the picture.
    Beside,
}

/// The lanes of a group that are not in a picture, by the reason.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct OutsideLanes {
    pub(crate) near: Bits,
    pub(crate) far: Bits,
    pub(crate) beside: Bits,
}

fn magnitude(v: [f64; 3]) -> f64 {
    v[0].abs() + v[1].abs() + v[2].abs()
}

impl Frustum {
    /// The frustum of Gaussians whose opacities are at most `opacity`.
    pub(crate) fn new(projection: &ViewConstants, opacity: f32) -> Self {
        let r = &projection.rotation;
        let depth = DepthRange { forward: [r[6], r[7], r[8]], near: projection.near, far: projection.far };
        let is_along_axis = !matches!(projection.model, CameraModel::Fisheye | CameraModel::Equirectangular);
        let Sides { planes, small } = sides(projection, opacity);
        Self {
            eye: projection.eye,
            depth: is_along_axis.then_some(depth),
            sides: planes,
            small,
            alpha_floor: projection.alpha_floor,
            rounding: ROUNDING,
            displacement: ROUNDING * magnitude(projection.eye),
        }
    }

    /// The same frustum in the space of Gaussians that a map places in the world; `None` if the
    /// matrix is so ill-conditioned that rounding makes the result uncertain.
    pub(crate) fn within(&self, map: Affine) -> Option<Self> {
        let Affine { linear: a, translation: b } = map;
        let Inverse { matrix: inverse, condition } = inverse(a);
        if condition.is_nan() || condition > MAX_CONDITION {
            return None;
        }
        let multiply = |a: Linear, v: [f64; 3]| a.map(|row| dot(row, v));
        let transposed = [0, 1, 2].map(|row| a.map(|of| of[row]));
        // The Frobenius norm: no length grows by more.
        let growth = a.map(|row| dot(row, row)).iter().sum::<f64>().sqrt();
        let rounding = ROUNDING * (1.0 + condition);
        let place = |plane: &Plane| Plane {
            normal: multiply(transposed, plane.normal),
            per_scale: plane.per_scale * growth,
            offset: plane.offset,
        };
        Some(Self {
            eye: multiply(inverse, [0, 1, 2].map(|axis| self.eye[axis] - b[axis])),
            depth: self.depth.map(|depth| DepthRange { forward: multiply(transposed, depth.forward), ..depth }),
            sides: self.sides.iter().map(place).collect(),
            small: self.small.as_ref().map(place),
            alpha_floor: self.alpha_floor,
            rounding,
            displacement: rounding * (magnitude(self.eye) + magnitude(b)) * condition / growth,
        })
    }

    /// The reason why a whole cluster is outside, if it is.
    pub(crate) fn excludes(&self, bounds: &Bounds) -> Option<Outside> {
        if f64::from(bounds.opacity) < self.alpha_floor {
            return Some(Outside::Faint);
        }
        let [mut middle, mut half] = [[0.0; 3]; 2];
        for axis in 0..3 {
            let [low, high] = [bounds.low[axis], bounds.high[axis]].map(f64::from);
            middle[axis] = 0.5 * (low + high) - self.eye[axis];
            half[axis] = 0.5 * (high - low);
        }
        // The rise of a linear function from the middle of the box to a corner, with a margin for rounding.
        let size = magnitude(middle) + magnitude(half);
        let slack = self.rounding * size + self.displacement;
        let rise = |normal: [f64; 3]| dot(normal.map(f64::abs), half) + magnitude(normal) * slack;
        if let Some(DepthRange { forward, near, far }) = self.depth {
            let (depth, rise) = (dot(forward, middle), rise(forward));
            if depth + rise <= f64::from(near) {
                return Some(Outside::Near);
            }
            if depth - rise >= f64::from(far) {
                return Some(Outside::Far);
            }
        }
        let scale = f64::from(bounds.scale);
        let is_outside = |plane: &Plane| {
            let greatest = dot(plane.normal, middle) + rise(plane.normal);
            greatest + plane.per_scale * scale + plane.offset < 0.0
        };
        let beside = self.sides.iter().any(is_outside) && self.small.iter().all(is_outside);
        beside.then_some(Outside::Beside)
    }

    /// The lanes that are outside, computed in binary32. Lanes whose result is within the rounding error count as
    /// inside.
    #[inline(always)]
    pub(crate) fn lanes_outside<S: Simd>(&self, simd: S, attributes: &Attributes, len: usize) -> OutsideLanes {
        let number = |value: f64| S::f32s::splat(simd, value as f32);
        let mut outside = OutsideLanes::default();
        let Some(DepthRange { forward, near, far }) = self.depth else {
            return outside;
        };
        // The eye is split into two binary32 parts, so that little precision is lost far from the origin.
        let eye = self.eye.map(number);
        let rest = self.eye.map(|eye| eye - f64::from(eye as f32));
        let far_off = number(magnitude(rest));
        let rest = rest.map(number);
        let error = |normal: [f64; 3]| number(ERROR * normal.map(f64::abs).into_iter().sum::<f64>());
        let depth = (forward.map(number), error(forward));
        let (near, far) = (number(near.into()), number(far.into()));
        let mut planes = [([number(0.0); 3], number(0.0), number(0.0), number(0.0)); 4];
        for (plane, side) in planes.iter_mut().zip(&self.sides) {
            let normal = side.normal.map(number);
            let (per_scale, offset) = (number(side.per_scale), number(side.offset));
            *plane = (normal, per_scale, offset, error(side.normal));
        }
        let planes = &planes[..self.sides.len().min(4)];
        for at in (0..len).step_by(S::f32s::LEN) {
            let load = |lanes: &[f32; F32_LANES]| S::f32s::from_slice(simd, &lanes[at..at + S::f32s::LEN]);
            let [x, y, z] = &attributes.position;
            let (x, y, z) = (load(x) - eye[0], load(y) - eye[1], load(z) - eye[2]);
            let size = x.abs() + y.abs() + z.abs() + far_off;
            let (x, y, z) = (x - rest[0], y - rest[1], z - rest[2]);
            let ([nx, ny, nz], error) = depth;
            let t = x.fused_add(nx, y.fused_add(ny, z * nz));
            let slack = size * error;
            outside.near.set(at, (t + slack).simd_le(near));
            outside.far.set(at, (t - slack).simd_ge(far));
            let [sx, sy, sz] = &attributes.scale;
            let scale = load(sx).max(load(sy)).max(load(sz));
            let mut beside = S::mask32s::splat(simd, false);
            for &([nx, ny, nz], per_scale, offset, error) in planes {
                let slack = size.fused_add(error, scale.fused_add(per_scale, offset));
                let value = x.fused_add(nx, y.fused_add(ny, z.fused_add(nz, slack)));
                beside |= value.simd_lt(0.0);
            }
            outside.beside.set(at, beside);
        }
        if let Some(small) = self.small_lanes(attributes, len) {
            outside.beside = outside.beside.and(&small);
        }
        outside
    }

    /// The lanes whose Gaussians are small enough for the sides to hold; `None` if the sides hold for all.
    fn small_lanes(&self, attributes: &Attributes, len: usize) -> Option<Bits> {
        let small = self.small?;
        let mut lanes = Bits::default();
        for lane in 0..len.min(attributes.opacity.len()) {
            let at = |of: &[f32; F32_LANES]| f64::from(of[lane]);
            let position = attributes.position.each_ref().map(at);
            let scale = attributes.scale.each_ref().map(at);
            let d = [0, 1, 2].map(|axis| position[axis] - self.eye[axis]);
            let scale = scale.into_iter().fold(0.0, f64::max);
            // Binary64's errors are far below the margins.
            let value = dot(small.normal, d) + small.per_scale * scale + small.offset;
            lanes.set_one(lane, value < 0.0);
        }
        Some(lanes)
    }
}
