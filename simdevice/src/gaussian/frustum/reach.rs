//! How far from their means' places Gaussians reach in a picture, by what they are and how they are projected: what the
//! sides of a frustum are moved out by.

use crate::gaussian::camera::ViewConstants;
use crate::gaussian::splat::{LEAST_HALF_FACTOR, binary16_headroom};
use crate::state::gaussian::{CameraModel, GaussianGeometry, GaussianPrecision};
use std::f64::consts::LN_2;

/// A Gaussian at `d` from the eye whose largest scale is `s` is outside where
/// `normal . d + per_scale s + offset < 0`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Plane {
    pub(super) normal: [f64; 3],
    pub(super) per_scale: f64,
    pub(super) offset: f64,
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn length(v: [f64; 3]) -> f64 {
    dot(v, v).sqrt()
}

/// How much wider than exact bounds are, so that rounding loses nothing.
const MARGIN: f64 = 1e-5;

/// Gaussians that are rasterized in binary16 and whose deviation, in pixels, exceeds this have no bounds: with it grows
/// how far binary16 may err.
const GREATEST_HALF_DEVIATION: f64 = 64.0;

/// The distance of an unscented transform's points from the mean, in standard deviations.
const POINT_DISTANCE: f64 = 1.732_050_807_568_877_3;

/// How much of what keeps a mean off the picture an unscented transform may take away: Gaussians for which it could be
/// more are not small.
const UNSCENTED_SHARE: f64 = 0.25;

/// A Gaussian whose deviation in the picture is `d` pixels reaches no farther than `pixels + per_deviation d` from the place
/// of its mean, if `d` is at most `greatest`.
#[derive(Clone, Copy, Debug)]
struct ScreenExtent {
    pixels: f64,
    per_deviation: f64,
    greatest: f64,
}

/// The sides of a camera's frustum, for Gaussians whose opacities are at most `opacity`, and the plane that says for which of
/// them they hold.
pub(super) fn sides(projection: &ViewConstants, opacity: f32) -> (Vec<Plane>, Option<Plane>) {
    let room = f64::from(opacity.max(1.0)).log2() - projection.log2_floor;
    let is_half = projection.precision == GaussianPrecision::Float16;
    let reach = if is_half {
        ScreenExtent::in_half(room, projection.low_pass)
    } else {
        Some(ScreenExtent::exact(room, projection.low_pass))
    };
    let none = (Vec::new(), None);
    let Some(reach) = reach else { return none };
    let is_linear = match projection.model {
        CameraModel::Pinhole => !projection.unscented,
        CameraModel::Orthographic => true,
        CameraModel::Fisheye | CameraModel::Equirectangular => return none,
    };
    if !is_linear && is_half {
        return none;
    }
    let ends = [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)];
    let ends = ends.map(|(axis, sign)| Side::new(projection, axis, sign, &reach));
    if is_linear {
        let deviations = ends.iter().map(|side| side.deviation);
        let deviation = deviations.fold(0.0, f64::max);
        let small = is_half.then(|| small_deviations(projection, deviation, &reach));
        return (ends.iter().map(|side| side.plane(&reach)).collect(), small);
    }
    let sides = ends.iter().map(|side| side.unscented(projection, &reach));
    let small = Points::new(projection, &reach).small(projection);
    (sides.collect(), Some(small))
}

impl ScreenExtent {
    fn exact(room: f64, low_pass: f64) -> Self {
        // Wider than the ellipse that the tile engine's margins ask for.
        let sigmas = (2.0 * LN_2 * (1.01 * room + 2e-3)).sqrt();
        Self {
            // The low-pass variance and the scale add in quadrature: their deviations' sum is no less.
            pixels: sigmas * low_pass.sqrt(),
            per_deviation: sigmas,
            greatest: f64::INFINITY,
        }
    }

    /// In binary16; `None` if nothing bounds it.
    fn in_half(room: f64, low_pass: f64) -> Option<Self> {
        let filter = low_pass.sqrt();
        let greatest = GREATEST_HALF_DEVIATION;
        // Factors are no less than the deviations of what they belong to are great.
        let least_factor = (0.5 / LN_2 / (greatest * greatest + low_pass)).sqrt();
        if !(filter > 0.0 && least_factor > 1.01 * LEAST_HALF_FACTOR) {
            return None;
        }
        // The ratio of the factors of the binary16 form is at most the ratio of deviation and filter, so that the reach is a
        // convex function of the deviation: the chord is above it.
        let reach_of = |deviation: f64| {
            let room = binary16_headroom([1.0, deviation / filter, 1.0], room);
            (2.0 * LN_2 * (1.01 * room + 2e-3)).sqrt() * (deviation + filter)
        };
        let (least, most) = (reach_of(0.0), reach_of(greatest));
        Some(Self {
            pixels: least,
            per_deviation: (most - least) / greatest,
            greatest,
        })
    }
}

/// A side of a picture.
struct Side {
    /// How far, in pixels, the picture's edge is from the principal point, moved out by what all Gaussians reach.
    edge: f64,
    /// Without their extent, Gaussians at `d` from the eye are outside where `normal . d + offset < 0`: pixels, or for a
    /// pinhole pixels times the depth.
    normal: [f64; 3],
    offset: f64,
    /// The deviation in the picture for each unit of scale, at most, in the same units.
    deviation: f64,
    focal: f64,
}

impl Side {
    /// The side along `axis` that `sign` (1: the lower coordinates) names.
    fn new(projection: &ViewConstants, axis: usize, sign: f64, reach: &ScreenExtent) -> Self {
        let (across, forward) = (row(projection, axis), row(projection, 2));
        let focal = projection.focal[axis];
        let [first, end] = projection.visible_range(axis);
        let from_edge = sign * (projection.center[axis] - if sign > 0.0 { first } else { end });
        let edge = from_edge + reach.pixels;
        let normal = |depth: f64| add(across, sign * focal, forward, depth);
        let steepness = |slope: f64| length(add(across, 1.0, forward, -slope));
        let (normal, offset, deviation) = match (projection.model, projection.geometry) {
            (CameraModel::Orthographic, _) => (normal(0.0), edge, focal.abs() * length(across)),
            // sign (f x/z + c - edge) + reach, times z, which is positive where it matters.
            (_, GaussianGeometry::Volume) => {
                let ends = [projection.slope_min[axis], projection.slope_max[axis]];
                let steepest = steepness(ends[0]).max(steepness(ends[1]));
                (normal(edge), 0.0, focal.abs() * steepest)
            }
            // A disc is nowhere in the picture if a plane through the eye is between it and the rays.
            (_, GaussianGeometry::Surfel) => (normal(edge), 0.0, length(normal(from_edge))),
        };
        Self {
            edge,
            normal,
            offset,
            deviation,
            focal: focal.abs(),
        }
    }

    /// The plane for what is linearized, and for discs.
    fn plane(&self, reach: &ScreenExtent) -> Plane {
        Plane {
            normal: self.normal,
            per_scale: reach.per_deviation * self.deviation * (1.0 + MARGIN),
            offset: self.offset + self.offset.abs() * MARGIN,
        }
    }

    /// The plane for a pinhole's unscented transform, if it is no farther off than [`Points::nearness`] asks for.
    ///
    /// Let A be `normal . d` for a mean at depth z and slope u, which is negative, and c the edge. No point appears farther than
    /// D from the mean, with `f D z <= f r (1 + |u|) / (1 - Q)`, r the points' distance and `r <= Q z`. Neither does the
    /// transform's mean, and of its variance the middle point makes `2 D^2` at most and the others one more. All that reaches
    /// `share = Q reach` of `f |u| z <= |A| + |c| z` toward the edge, and `f r reach` besides.
    fn unscented(&self, projection: &ViewConstants, reach: &ScreenExtent) -> Plane {
        let points = Points::new(projection, reach);
        let straight = self.plane(reach);
        let of_points = self.focal * points.reach * points.per_scale * (1.0 + MARGIN);
        let depth = UNSCENTED_SHARE * self.edge.abs();
        Plane {
            normal: add(
                straight.normal,
                1.0 - UNSCENTED_SHARE,
                row(projection, 2),
                depth,
            ),
            // Where not all points are seen, it is the Jacobian after all.
            per_scale: straight.per_scale.max(of_points),
            offset: 0.0,
        }
    }
}

/// What an unscented transform's points bound.
struct Points {
    /// Their distance from the mean in camera space for each unit of scale, at most.
    per_scale: f64,
    /// How far a Gaussian reaches for each unit of the distance at which its points appear from its mean.
    reach: f64,
    /// Gaussians are small if their points' distance is at most this times the mean's depth.
    nearness: f64,
}

impl Points {
    fn new(projection: &ViewConstants, reach: &ScreenExtent) -> Self {
        let growth = (0..3).map(|axis| length(row(projection, axis)));
        let of_places = 1.0 + 3.0f64.sqrt() * reach.per_deviation;
        let nearness = UNSCENTED_SHARE / (of_places + UNSCENTED_SHARE);
        Self {
            per_scale: POINT_DISTANCE * growth.fold(0.0, f64::max) * (1.0 + MARGIN),
            reach: of_places / (1.0 - nearness),
            nearness,
        }
    }

    /// Outside of this plane Gaussians are small.
    fn small(&self, projection: &ViewConstants) -> Plane {
        Plane {
            normal: row(projection, 2).map(|forward| -self.nearness * forward),
            per_scale: self.per_scale,
            offset: 0.0,
        }
    }
}

/// Outside of this plane Gaussians whose deviations are at most `deviation` for each unit of scale have those that `reach`
/// asks for.
fn small_deviations(projection: &ViewConstants, deviation: f64, reach: &ScreenExtent) -> Plane {
    let (normal, offset) = match projection.model {
        CameraModel::Orthographic => ([0.0; 3], -reach.greatest),
        _ => (
            row(projection, 2).map(|forward| -reach.greatest * forward),
            0.0,
        ),
    };
    Plane {
        normal,
        per_scale: deviation * (1.0 + MARGIN),
        offset,
    }
}

/// A row of the camera's rotation.
fn row(projection: &ViewConstants, axis: usize) -> [f64; 3] {
    [0, 1, 2].map(|i| projection.rotation[3 * axis + i])
}

/// `p a + q b`.
fn add(a: [f64; 3], p: f64, b: [f64; 3], q: f64) -> [f64; 3] {
    [0, 1, 2].map(|i| p * a[i] + q * b[i])
}
