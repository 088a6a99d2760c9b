//! The equirectangular projection: longitude and latitude, and pictures that repeat.

use super::{OracleCamera, OracleModel, Rules};
use std::f64::consts::TAU;

/// The cosine of the latitude beyond which the Jacobian no longer grows.
const POLE: f64 = 1.0 / 1024.0;

/// The mean and the Jacobian of a panorama: those of atan2(t.x, t.z) and atan2(t.y, |t.xz|), where the distance from
/// the axis through the poles is kept from falling below `POLE` times the distance.
pub fn equirectangular(camera: &OracleCamera, t: [f64; 3]) -> ([f64; 2], [[f64; 3]; 2]) {
    let [fx, fy] = camera.focal.map(f64::from);
    let [cx, cy] = camera.principal.map(f64::from);
    let [x, y, z] = t;
    let r = (x * x + z * z).sqrt();
    let square = r * r + y * y;
    let from_axis = r.max(POLE * square.sqrt());
    // On the axis the longitude is undefined; straight ahead is used.
    let (sin, cos) = if r == 0.0 { (0.0, 1.0) } else { (x / r, z / r) };
    let jacobian = [
        [fx * cos / from_axis, 0.0, -fx * sin / from_axis],
        [-fy * y * sin / square, fy * r / square, -fy * y * cos / square],
    ];
    ([fx * x.atan2(z) + cx, fy * y.atan2(r) + cy], jacobian)
}

/// The number of pixels after which a camera's picture repeats to the right and to the left; infinity if it does not.
pub fn period(camera: &OracleCamera, rules: &Rules) -> f64 {
    match camera.model {
        OracleModel::Equirectangular if rules.panorama_repeats => TAU * f64::from(camera.focal[0]),
        _ => f64::INFINITY,
    }
}

/// The distance of a pixel to the right of a mean, or of the mean's nearest copy one period away: at least -1/2 and
/// less than 1/2 of a period. `None` if no copy is that near.
pub fn nearest(dx: f64, period: f64) -> Option<f64> {
    if period == f64::INFINITY {
        return Some(dx);
    }
    let half = 0.5 * period;
    let copies = [dx, dx - period, dx + period];
    copies.into_iter().find(|dx| (-half..half).contains(dx))
}

#[cfg(test)]
use std::f64::consts::PI;

#[test]
fn the_nearest_copy_counts() {
    assert_eq!(nearest(1e9, f64::INFINITY), Some(1e9));
    let period = 2.0 * PI;
    assert_eq!(nearest(1.0, period), Some(1.0));
    assert_eq!(nearest(4.0, period), Some(4.0 - period));
    assert_eq!(nearest(-4.0, period), Some(period - 4.0));
    assert_eq!(nearest(-PI, period), Some(-PI));
    assert_eq!(nearest(10.0, period), None);
}
