//! The extent of Gaussians in a picture, measured from the projections of their means. The sides of a frustum are moved
//! outwards by it.

use crate::gaussian::linear_algebra::length;
use crate::gaussian::splats::binary16::{LEAST_HALF_FACTOR, binary16_headroom};
use crate::gaussian::splats::surfel::UNIT;
use crate::gaussian::view::constants::ViewConstants;
use crate::gaussian::view::distortion::Lens;
use crate::state::gaussian::{CameraModel, GaussianGeometry, GaussianPrecision};
use std::f64::consts::LN_2;

/// A Gaussian at `d` from the eye whose largest scale is `s` is outside where
/// `normal . d + per_scale s + offset < 0`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Plane {
    pub(crate) normal: [f64; 3],
    pub(crate) per_scale: f64,
    pub(crate) offset: f64,
}

/// The relative margin by which bounds are wider than exact ones, to allow for rounding.
const MARGIN: f64 = 1e-5;

/// The greatest standard deviation, in pixels, of a Gaussian that is rasterized in binary16 and has bounds. The error
/// of binary16 grows with the deviation.
const GREATEST_HALF_DEVIATION: f64 = 64.0;

/// The distance of an unscented transform's points from the mean, in standard deviations.
const POINT_DISTANCE: f64 = 1.732_050_807_568_877_3;

/// The largest part of a mean's distance from the picture that the points of an unscented transform may bridge.
/// Gaussians for which it could be more do not count as small.
const UNSCENTED_SHARE: f64 = 0.25;

/// The extent in pixels of a Gaussian whose standard deviation in the picture is `d` pixels: at most
/// `pixels + per_deviation d`, measured from the projection of its mean, if `d` is at most `greatest`.
#[derive(Clone, Copy, Debug)]
struct ScreenExtent {
    pixels: f64,
    per_deviation: f64,
    greatest: f64,
}

/// The sides of a camera's frustum.
pub(crate) struct Sides {
    /// The left, right, top and bottom planes; empty if nothing bounds the picture.
    pub(crate) planes: Vec<Plane>,
    /// The plane outside of which Gaussians are small enough for the sides to hold; `None` if they hold for all Gaussians.
    pub(crate) small: Option<Plane>,
}

/// The sides of a camera's frustum for Gaussians whose opacities are at most `opacity`.
pub(crate) fn sides(projection: &ViewConstants, opacity: f32) -> Sides {
    let log2_range = libm::log2(opacity.max(1.0).into()) - projection.log2_floor;
    // The middle of a disc's rectangle, about which its filter is, lies within one standard deviation.
    let least = if projection.surfel_cut_off.is_some() { UNIT } else { f64::NEG_INFINITY };
    let log2_range = log2_range.max(least);
    let is_half = projection.precision == GaussianPrecision::Float16;
    let extent = if is_half {
        ScreenExtent::in_half(log2_range, projection.low_pass)
    } else {
        Some(ScreenExtent::exact(log2_range, projection.low_pass))
    };
    let none = Sides { planes: Vec::new(), small: None };
    if let Some(lens) = &projection.lens {
        return Sides { planes: fold_planes(projection, lens), ..none };
    }
    let Some(extent) = extent else { return none };
    let is_linear = match projection.model {
        CameraModel::Pinhole if projection.unscented && !projection.sigma_points.are_default => return none,
        CameraModel::Pinhole => !projection.unscented,
        CameraModel::Orthographic => true,
        CameraModel::Fisheye | CameraModel::Equirectangular => return none,
    };
    if !is_linear && is_half {
        return none;
    }
    let ends = [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)];
    let ends = ends.map(|(axis, sign)| Side::new(projection, axis, sign, &extent));
    if is_linear {
        let deviations = ends.iter().map(|side| side.deviation);
        let deviation = deviations.fold(0.0, f64::max);
        let small = is_half.then(|| small_deviations(projection, deviation, &extent));
        return Sides { planes: ends.iter().map(|side| side.plane(&extent)).collect(), small };
    }
    let sides = ends.iter().map(|side| side.unscented(projection, &extent));
    let small = Points::new(projection, &extent).small(projection);
    Sides { planes: sides.collect(), small: Some(small) }
}

/// The planes outside of which a pinhole's lens has folded, so that means there are not drawn, whatever the extent of their
/// Gaussians.
fn fold_planes(projection: &ViewConstants, lens: &Lens) -> Vec<Plane> {
    let fold = lens.fold();
    if projection.model != CameraModel::Pinhole || fold == f64::INFINITY {
        return Vec::new();
    }
    let ends = [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)];
    let plane = |(axis, sign)| Plane {
        normal: add(row(projection, axis), sign, row(projection, 2), fold * (1.0 + MARGIN)),
        ..Plane::default()
    };
    ends.map(plane).to_vec()
}

impl ScreenExtent {
    fn exact(log2_range: f64, low_pass: f64) -> Self {
        // Wider than the ellipse with the tile engine's margins.
        let sigmas = (2.0 * LN_2 * (1.01 * log2_range + 2e-3)).sqrt();
        Self {
            // The low-pass variance and the scale's variance add up, and the sum of their deviations is no less.
            pixels: sigmas * low_pass.sqrt(),
            per_deviation: sigmas,
            greatest: f64::INFINITY,
        }
    }

    /// The extent in binary16; `None` if it has no bound.
    fn in_half(log2_range: f64, low_pass: f64) -> Option<Self> {
        let filter = low_pass.sqrt();
        let greatest = GREATEST_HALF_DEVIATION;
        // The factor of a Gaussian decreases with its deviation, so the greatest deviation has the least factor.
        let least_factor = (0.5 / LN_2 / (greatest * greatest + low_pass)).sqrt();
        if !(filter > 0.0 && least_factor > 1.01 * LEAST_HALF_FACTOR) {
            return None;
        }
        // The ratio of the factors of the binary16 form is at most the ratio of deviation and filter, so that the
        // extent is a convex function of the deviation, and a chord is above it.
        let extent_of = |deviation: f64| {
            let log2_range = binary16_headroom([1.0, deviation / filter, 1.0], log2_range);
            (2.0 * LN_2 * (1.01 * log2_range + 2e-3)).sqrt() * (deviation + filter)
        };
        let (least, most) = (extent_of(0.0), extent_of(greatest));
        Some(Self { pixels: least, per_deviation: (most - least) / greatest, greatest })
    }
}

/// A side of the frustum.
struct Side {
    /// The distance in pixels from the principal point to the picture's edge, plus the part of the extent that all
    /// Gaussians have.
    edge: f64,
    /// Without the rest of their extent, Gaussians at `d` from the eye are outside where `normal . d + offset < 0`. The
    /// unit is pixels, or for a pinhole pixels times the depth.
    normal: [f64; 3],
    offset: f64,
    /// The greatest deviation in the picture per unit of scale, in the same unit.
    deviation: f64,
    focal: f64,
}

impl Side {
    /// The side along `axis` at the lower (`sign` 1) or the higher coordinates (`sign` -1).
    fn new(projection: &ViewConstants, axis: usize, sign: f64, extent: &ScreenExtent) -> Self {
        let (across, forward) = (row(projection, axis), row(projection, 2));
        let focal = projection.focal[axis];
        let [first, end] = projection.visible_range(axis);
        let from_edge = sign * (projection.center[axis] - if sign > 0.0 { first } else { end });
        let edge = from_edge + extent.pixels;
        let normal = |depth: f64| add(across, sign * focal, forward, depth);
        let steepness = |slope: f64| length(add(across, 1.0, forward, -slope));
        let (normal, offset, deviation) = match (projection.model, projection.geometry) {
            (CameraModel::Orthographic, _) => (normal(0.0), edge, focal.abs() * length(across)),
            // sign (f x/z + c - edge) + extent, times z, which is positive in front of the eye.
            (_, GaussianGeometry::Volume) => {
                let ends = [projection.slope_min[axis], projection.slope_max[axis]];
                let steepest = steepness(ends[0]).max(steepness(ends[1]));
                (normal(edge), 0.0, focal.abs() * steepest)
            }
            // A disc is not in the picture if a plane through the eye separates it from the rays.
            (_, GaussianGeometry::Surfel) => (normal(edge), 0.0, length(normal(from_edge))),
        };
        Self { edge, normal, offset, deviation, focal: focal.abs() }
    }

    /// The plane for Gaussians that are linearized, and for discs.
    fn plane(&self, extent: &ScreenExtent) -> Plane {
        Plane {
            normal: self.normal,
            per_scale: extent.per_deviation * self.deviation * (1.0 + MARGIN),
            offset: self.offset + self.offset.abs() * MARGIN,
        }
    }

    /// The plane for a pinhole's unscented transform, for Gaussians that are as small as [`Points::nearness`] demands.
    ///
    /// Let A be `normal . d` for a mean at depth z and slope u, and c the edge; A is negative if the mean is beyond the
    /// edge. Let r be the points' distance from the mean, with `r <= Q z`. No point appears farther than D from the
    /// mean in the picture, with `D z <= f r (1 + |u|) / (1 - Q)`. The transform's mean is at most D away, too. To its
    /// variance the middle point contributes at most `2 D^2` and the other points at most `D^2`. The Gaussian's
    /// extent times z is at most `reach (f r + Q f |u| z)`. Since `f |u| z <= |A| + |c| z`, that is at most
    /// `f r reach + share (|A| + |c| z)` with `share = Q reach`. The Gaussian is outside if that is less than `|A|`.
    fn unscented(&self, projection: &ViewConstants, extent: &ScreenExtent) -> Plane {
        let points = Points::new(projection, extent);
        let straight = self.plane(extent);
        let of_points = self.focal * points.reach * points.per_scale * (1.0 + MARGIN);
        let depth = UNSCENTED_SHARE * self.edge.abs();
        Plane {
            normal: add(straight.normal, 1.0 - UNSCENTED_SHARE, row(projection, 2), depth),
            // Where the projection of some points is undefined, the Jacobian is used.
            per_scale: straight.per_scale.max(of_points),
            offset: 0.0,
        }
    }
}

/// Bounds from the points of an unscented transform.
struct Points {
    /// The greatest distance of the points from the mean in camera space, per unit of scale.
    per_scale: f64,
    /// The extent of a Gaussian per unit of the distance at which its points appear from its mean.
    reach: f64,
    /// The greatest ratio of the points' distance and the mean's depth for which a Gaussian is small.
    nearness: f64,
}

impl Points {
    fn new(projection: &ViewConstants, extent: &ScreenExtent) -> Self {
        let growth = (0..3).map(|axis| length(row(projection, axis)));
        let of_places = 1.0 + 3.0f64.sqrt() * extent.per_deviation;
        let nearness = UNSCENTED_SHARE / (of_places + UNSCENTED_SHARE);
        Self {
            per_scale: POINT_DISTANCE * growth.fold(0.0, f64::max) * (1.0 + MARGIN),
            reach: of_places / (1.0 - nearness),
            nearness,
        }
    }

    /// The plane outside of which Gaussians are small.
    fn small(&self, projection: &ViewConstants) -> Plane {
        Plane {
            normal: row(projection, 2).map(|forward| -self.nearness * forward),
            per_scale: self.per_scale,
            offset: 0.0,
        }
    }
}

/// The plane outside of which a Gaussian's deviation in the picture is at most `extent.greatest`. Deviations are at most
/// `deviation` per unit of scale.
fn small_deviations(projection: &ViewConstants, deviation: f64, extent: &ScreenExtent) -> Plane {
    let (normal, offset) = match projection.model {
        CameraModel::Orthographic => ([0.0; 3], -extent.greatest),
        _ => (row(projection, 2).map(|forward| -extent.greatest * forward), 0.0),
    };
    Plane { normal, per_scale: deviation * (1.0 + MARGIN), offset }
}

/// A row of the camera's rotation.
fn row(projection: &ViewConstants, axis: usize) -> [f64; 3] {
    [0, 1, 2].map(|i| projection.rotation[3 * axis + i])
}

/// `p a + q b`.
fn add(a: [f64; 3], p: f64, b: [f64; 3], q: f64) -> [f64; 3] {
    [0, 1, 2].map(|i| p * a[i] + q * b[i])
}
