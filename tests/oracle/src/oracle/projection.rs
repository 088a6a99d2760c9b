//! Projections of the camera models: the position of a point in the picture and its Jacobian.

use super::panorama;
use super::vectors::{dot, length};
use super::{OracleCamera, OracleModel, Rules};

/// The image position of a point in camera axes, and the Jacobian of the projection there.
pub(super) fn mean_and_jacobian(camera: &OracleCamera, rules: &Rules, t: [f64; 3]) -> ([f64; 2], [[f64; 3]; 2]) {
    let (mean, jacobian) = ideal(camera, rules, t);
    let Some(lens) = &camera.lens else {
        return (mean, jacobian);
    };
    let (focal, principal) = (camera.focal.map(f64::from), camera.principal.map(f64::from));
    let (place, derivative) = lens.distort(ideal_place(camera, rules, t));
    let distorted = [0, 1].map(|axis| focal[axis] * place[axis] + principal[axis]);
    if !rules.jacobian_is_distorted {
        return (distorted, jacobian);
    }
    // The chain rule; the ideal rows are for the focal lengths.
    let rows = [0, 1].map(|axis| {
        let by = derivative[axis];
        [0, 1, 2].map(|k| focal[axis] * (by[0] * jacobian[0][k] / focal[0] + by[1] * jacobian[1][k] / focal[1]))
    });
    (distorted, rows)
}

/// The place of a point in camera axes in the picture of an ideal lens, for focal lengths of 1 and relative to the principal
/// point.
pub(super) fn ideal_place(camera: &OracleCamera, rules: &Rules, t: [f64; 3]) -> [f64; 2] {
    let mean = ideal(camera, rules, t).0;
    [0, 1].map(|axis| (mean[axis] - f64::from(camera.principal[axis])) / f64::from(camera.focal[axis]))
}

/// The radius of that place.
pub(super) fn ideal_radius(camera: &OracleCamera, rules: &Rules, t: [f64; 3]) -> f64 {
    let [u, v] = ideal_place(camera, rules, t);
    (u * u + v * v).sqrt()
}

/// The image position and the Jacobian of an ideal lens.
fn ideal(camera: &OracleCamera, rules: &Rules, t: [f64; 3]) -> ([f64; 2], [[f64; 3]; 2]) {
    match camera.model {
        OracleModel::Pinhole => pinhole(camera, rules.slope_margin, t),
        OracleModel::Orthographic => orthographic(camera, t),
        OracleModel::Fisheye => fisheye(camera, t),
        OracleModel::Equirectangular => panorama::equirectangular(camera, t),
    }
}

/// The depth variable of a point in camera axes.
pub(super) fn depth_variable(model: OracleModel, t: [f64; 3]) -> f64 {
    match model {
        OracleModel::Pinhole | OracleModel::Orthographic => t[2],
        OracleModel::Fisheye | OracleModel::Equirectangular => length(t),
    }
}

/// The mean and the Jacobian of perspective. The point is clamped to the viewport and a margin, which is given as a share of
/// the viewport's side; both are wider by as much as a lens sees more.
fn pinhole(camera: &OracleCamera, margin: f64, t: [f64; 3]) -> ([f64; 2], [[f64; 3]; 2]) {
    let [fx, fy] = camera.focal.map(f64::from);
    let [cx, cy] = camera.principal.map(f64::from);
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let (tan_x, tan_y) = (t[0] / t[2], t[1] / t[2]);
    let mut across = [-(cx / fx + margin * width / fx), (width - cx) / fx + margin * width / fx];
    let mut down = [-(cy / fy + margin * height / fy), (height - cy) / fy + margin * height / fy];
    let is_between = |slope: f64, [least, greatest]: [f64; 2]| least <= slope && slope <= greatest;
    // Wider bounds change nothing between the others, and are dear to compute.
    if let Some(lens) = &camera.lens
        && !(is_between(tan_x, across) && is_between(tan_y, down))
    {
        let farthest = |[least, greatest]: [f64; 2]| least.abs().max(greatest.abs());
        let wider = lens.widening(farthest(across).hypot(farthest(down)));
        (across, down) = (across.map(|slope| slope * wider), down.map(|slope| slope * wider));
    }
    let u = tan_x.max(across[0]).min(across[1]);
    let v = tan_y.max(down[0]).min(down[1]);
    let jacobian = [[fx / t[2], 0.0, -fx * u / t[2]], [0.0, fy / t[2], -fy * v / t[2]]];
    ([fx * tan_x + cx, fy * tan_y + cy], jacobian)
}

/// The mean and the Jacobian of parallel projection.
fn orthographic(camera: &OracleCamera, t: [f64; 3]) -> ([f64; 2], [[f64; 3]; 2]) {
    let [fx, fy] = camera.focal.map(f64::from);
    let [cx, cy] = camera.principal.map(f64::from);
    let jacobian = [[fx, 0.0, 0.0], [0.0, fy, 0.0]];
    ([fx * t[0] + cx, fy * t[1] + cy], jacobian)
}

/// The mean and the Jacobian of the equidistant fisheye, by the chain rule from r = |t.xy| and a = atan2(r, t.z).
fn fisheye(camera: &OracleCamera, t: [f64; 3]) -> ([f64; 2], [[f64; 3]; 2]) {
    let r = (t[0] * t[0] + t[1] * t[1]).sqrt();
    let square = dot(t, t);
    let angle = r.atan2(t[2]);
    let focal = camera.focal.map(f64::from);
    let principal = camera.principal.map(f64::from);
    // On the axis the limits hold: only movement across the axis counts, by 1 / t.z.
    if r == 0.0 {
        let scale = if t[2] > 0.0 { 1.0 / t[2] } else { f64::NAN };
        return (principal, [[focal[0] * scale, 0.0, 0.0], [0.0, focal[1] * scale, 0.0]]);
    }
    let row = |axis: usize| {
        // The position is f (a / r) t[axis]; a / r has the gradient (a' r - a r') / r^2.
        let gradient: [f64; 3] = std::array::from_fn(|k| {
            let r_k = if k < 2 { t[k] / r } else { 0.0 };
            let a_k = if k < 2 { t[2] * t[k] / (r * square) } else { -r / square };
            let of_ratio = (a_k * r - angle * r_k) / (r * r);
            let own = if k == axis { angle / r } else { 0.0 };
            of_ratio * t[axis] + own
        });
        gradient.map(|g| focal[axis] * g)
    };
    let mean = [0, 1].map(|axis| focal[axis] * angle / r * t[axis] + principal[axis]);
    (mean, [row(0), row(1)])
}
