//! Camera models: the projection of a point to the picture, the projection's Jacobian, and the depth variable.

use super::distortion::{Distorted, Lens};
use crate::state::gaussian::{Camera, CameraModel};
use isa::float;

/// After how many pixels a camera's picture repeats to the right and to the left, if it does.
pub(crate) fn period(camera: &Camera) -> Option<f64> {
    let focal = f64::from(camera.focal_length[0]);
    (camera.model == CameraModel::Equirectangular).then_some(std::f64::consts::TAU * focal)
}

/// The projection of a point, linearized, for focal lengths of 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Linearization {
    /// The point's position in the picture, relative to the principal point.
    pub(crate) place: [f64; 2],
    /// The rows of the projection's Jacobian.
    pub(crate) jacobian: [[f64; 3]; 2],
}

/// Linearizes the projection of a point `t` in camera axes through a lens that may distort. A pinhole's Jacobian is taken at
/// a slope that is clamped to the least and the greatest of `slopes`. Points that have no position give NaN.
pub(crate) fn linearize(model: CameraModel, lens: Option<&Lens>, slopes: [[f64; 2]; 2], t: [f64; 3]) -> Linearization {
    let ideal = ideal(model, slopes, t);
    lens.map_or(ideal, |lens| {
        let Distorted { place, derivative } = lens.distort(ideal.place);
        let [along_u, along_v] = ideal.jacobian;
        let jacobian = derivative.map(|[by_u, by_v]| [0, 1, 2].map(|axis| by_u * along_u[axis] + by_v * along_v[axis]));
        Linearization { place, jacobian }
    })
}

/// The same through an ideal lens.
fn ideal(model: CameraModel, slopes: [[f64; 2]; 2], t: [f64; 3]) -> Linearization {
    match model {
        CameraModel::Pinhole => pinhole(slopes, t),
        CameraModel::Orthographic => {
            Linearization { place: [t[0], t[1]], jacobian: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] }
        }
        CameraModel::Fisheye => fisheye(t),
        CameraModel::Equirectangular => equirectangular(t),
    }
}

fn pinhole([least, greatest]: [[f64; 2]; 2], [x, y, z]: [f64; 3]) -> Linearization {
    let place = [x / z, y / z];
    let [u, v] = [0, 1].map(|axis| float::least(float::greatest(place[axis], least[axis]), greatest[axis]));
    Linearization { place, jacobian: [[1.0 / z, 0.0, -u / z], [0.0, 1.0 / z, -v / z]] }
}

/// The equidistant projection: the distance from the principal point is the angle from the axis.
fn fisheye([x, y, z]: [f64; 3]) -> Linearization {
    let r = libm::hypot(x, y);
    if r == 0.0 {
        // A point straight behind the camera projects to a whole circle, so it has no position.
        let scale = if z > 0.0 { 1.0 / z } else { f64::NAN };
        return Linearization { place: [0.0; 2], jacobian: [[scale, 0.0, 0.0], [0.0, scale, 0.0]] };
    }
    // Along the radius a point moves by z / |t|^2, across it by angle / r, and along the axis by -r / |t|^2.
    let (cos, sin) = (x / r, y / r);
    let length = libm::hypot(r, z);
    let (along, across, axial) = (z / length / length, libm::atan2(r, z) / r, -(r / length / length));
    let mixed = (along - across) * cos * sin;
    Linearization {
        place: [across * x, across * y],
        jacobian: [
            [along * cos * cos + across * sin * sin, mixed, axial * cos],
            [mixed, along * sin * sin + across * cos * cos, axial * sin],
        ],
    }
}

/// The least cosine of the latitude for which a panorama's Jacobian is taken. At a pole itself it would be infinite,
/// because the meridians meet.
const POLE: f64 = 1.0 / 1024.0;

/// The equirectangular projection: longitude, from straight ahead to the right, and latitude, downwards.
fn equirectangular([x, y, z]: [f64; 3]) -> Linearization {
    let r = libm::hypot(x, z);
    let length = libm::hypot(r, y);
    // At a pole the longitude is undefined; that of straight ahead is taken.
    let (sin, cos) = if r > 0.0 { (x / r, z / r) } else { (0.0, 1.0) };
    let across = 1.0 / r.max(POLE * length);
    let (rise, run) = (y / length, r / length);
    Linearization {
        place: [libm::atan2(x, z), libm::atan2(y, r)],
        jacobian: [[cos * across, 0.0, -sin * across], [-sin * rise / length, run / length, -cos * rise / length]],
    }
}

/// The depth variable, by which near and far plane, fragment depth and the view-depth order go: `t.z` for pinhole and
/// orthographic cameras, the distance from the eye for the others.
pub(crate) fn depth(model: CameraModel, [x, y, z]: [f64; 3]) -> f64 {
    match model {
        CameraModel::Pinhole | CameraModel::Orthographic => z,
        CameraModel::Fisheye | CameraModel::Equirectangular => (x * x + y * y + z * z).sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::gaussian::{Distortion, DistortionModel};
    use proptest::prelude::*;

    /// Bounds beyond every slope in these tests.
    const SLOPES: [[f64; 2]; 2] = [[-1e3; 2], [1e3; 2]];

    const MODELS: [CameraModel; 4] =
        [CameraModel::Pinhole, CameraModel::Orthographic, CameraModel::Fisheye, CameraModel::Equirectangular];

    /// The Jacobian by central differences.
    fn jacobian(model: CameraModel, t: [f64; 3]) -> [[f64; 3]; 2] {
        let step = 1e-5 * (t[0].abs() + t[1].abs() + t[2].abs());
        let mut rows = [[0.0; 3]; 2];
        for axis in 0..3 {
            let moved = |by: f64| {
                let mut t = t;
                t[axis] += by;
                linearize(model, None, SLOPES, t).place
            };
            let (ahead, behind) = (moved(step), moved(-step));
            for (row, (a, b)) in rows.iter_mut().zip(ahead.into_iter().zip(behind)) {
                row[axis] = (a - b) / (2.0 * step);
            }
        }
        rows
    }

    proptest! {
        #[gaurast_runner::test]
        fn the_jacobian_is_the_derivative(x in -3.0..3.0f64, y in -3.0..3.0f64, z in 0.5..9.0f64, behind: bool) {
            for model in MODELS {
                // Fisheyes and panoramas see to the sides and behind. A fisheye has no position for what is straight
                // behind.
                let t = match model {
                    CameraModel::Fisheye | CameraModel::Equirectangular if behind => [x + x.signum(), y, -z],
                    _ => [x, y, z],
                };
                let Linearization { jacobian: rows, .. } = linearize(model, None, SLOPES, t);
                for (row, expected) in rows.iter().zip(jacobian(model, t)) {
                    for (a, b) in row.iter().zip(expected) {
                        prop_assert!((a - b).abs() < 1e-6, "{model:?} {t:?}: {rows:?}");
                    }
                }
            }
        }
    }

    #[gaurast_runner::test]
    fn a_lens_distorts_the_place_and_the_jacobian() {
        let (model, radial) = (DistortionModel::Polynomial, [0.1, -0.02, 0.0, 0.0, 0.0, 0.0]);
        let lens = Lens::new(&Distortion { model, radial, tangential: [0.01, -0.02], thin_prism: [0.0; 4] });
        let place = |t| linearize(CameraModel::Fisheye, Some(&lens), SLOPES, t).place;
        let (t, step) = ([0.4, -0.7, 1.1], 1e-6);
        let Linearization { jacobian, .. } = linearize(CameraModel::Fisheye, Some(&lens), SLOPES, t);
        for axis in 0..3 {
            let [ahead, behind] = [step, -step].map(|by| {
                let mut moved = t;
                moved[axis] += by;
                place(moved)
            });
            for (row, (ahead, behind)) in jacobian.iter().zip(ahead.into_iter().zip(behind)) {
                assert!((row[axis] - (ahead - behind) / (2.0 * step)).abs() < 1e-8);
            }
        }
    }

    #[gaurast_runner::test]
    fn on_the_axis_a_fisheye_is_a_pinhole_and_behind_it_nothing() {
        let at_axis = linearize(CameraModel::Fisheye, None, SLOPES, [0.0, 0.0, 4.0]);
        assert_eq!(at_axis, linearize(CameraModel::Pinhole, None, SLOPES, [0.0, 0.0, 4.0]));
        let Linearization { jacobian: rows, .. } = linearize(CameraModel::Fisheye, None, SLOPES, [1e-9, 0.0, 4.0]);
        assert!((rows[1][1] - 0.25).abs() < 1e-12);
        let Linearization { jacobian: rows, .. } = linearize(CameraModel::Fisheye, None, SLOPES, [0.0, 0.0, -4.0]);
        assert!(rows[0][0].is_nan());
    }

    #[gaurast_runner::test]
    fn a_panorama_sees_all_directions() {
        let place = |t| linearize(CameraModel::Equirectangular, None, SLOPES, t).place;
        let right = std::f64::consts::FRAC_PI_2;
        assert_eq!(place([0.0, 0.0, 3.0]), [0.0, 0.0]);
        assert_eq!(place([2.0, 0.0, 0.0]), [right, 0.0]);
        assert_eq!(place([0.0, 0.0, -1.0]), [2.0 * right, 0.0]);
        assert_eq!(place([0.0, 5.0, 0.0]), [0.0, right]);
        assert_eq!(place([0.0, -5.0, 0.0]), [0.0, -right]);
        // At a pole, and a little away from it, a point moves no faster than the stated limit.
        for x in [0.0, 1e-9] {
            let Linearization { jacobian: rows, .. } =
                linearize(CameraModel::Equirectangular, None, SLOPES, [0.0, 2.0, x]);
            assert_eq!(rows[0], [512.0, 0.0, 0.0]);
            assert!((rows[1][2] + 0.5).abs() < 1e-9, "{rows:?}");
        }
    }

    #[gaurast_runner::test]
    fn the_depth_of_what_sees_all_around_is_the_distance() {
        assert_eq!(depth(CameraModel::Fisheye, [2.0, 3.0, -6.0]), 7.0);
        assert_eq!(depth(CameraModel::Equirectangular, [2.0, 3.0, -6.0]), 7.0);
        assert_eq!(depth(CameraModel::Orthographic, [2.0, 3.0, -6.0]), -6.0);
    }
}
