//! The unscented transform against the moments of the exact picture of a Gaussian.

use super::*;
use crate::oracle::project::project;
use crate::scenes::{Gaussian, SceneBuffers};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Mean and covariance in the picture.
#[derive(Clone, Copy, Debug)]
struct Moments {
    mean: [f64; 2],
    covariance: [f64; 3],
}

impl Moments {
    /// The Bhattacharyya distance between two Gaussians with these moments.
    fn distance(&self, other: &Self) -> f64 {
        let determinant = |[xx, xy, yy]: [f64; 3]| xx * yy - xy * xy;
        let (a, b) = (self.covariance, other.covariance);
        let middle = [0, 1, 2].map(|part| 0.5 * (a[part] + b[part]));
        let [dx, dy] = [0, 1].map(|axis| self.mean[axis] - other.mean[axis]);
        let [xx, xy, yy] = middle;
        let square = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / determinant(middle);
        let ratio = determinant(middle) / (determinant(a) * determinant(b)).sqrt();
        square / 8.0 + 0.5 * ratio.ln()
    }
}

/// A wide field: more than 120 degrees.
fn wide(model: OracleModel) -> OracleCamera {
    OracleCamera { model, width: 400, height: 200, focal: [100.0, 100.0], principal: [200.0, 100.0], ..camera() }
}

fn gaussian(position: [f32; 3], scale: [f32; 3]) -> Gaussian {
    Gaussian { position, scale, rotation: [0.9, 0.2, -0.3, 0.1], opacity: 0.8, sh: vec![[0.5; 3]] }
}

/// The moments of a Gaussian's projection.
fn projected(gaussian: &Gaussian, camera: &OracleCamera, unscented: bool) -> Moments {
    let scene = SceneBuffers::new(0, [gaussian.clone()]);
    let state = OracleState { low_pass: 0.0, unscented, ..OracleState::default() };
    let splat = project(&scene.as_oracle(), camera, &state, 0).expect("it is drawn");
    Moments { mean: splat.mean, covariance: splat.covariance }
}

/// The moments of the pictures of many points of it, from one side of a seam.
fn truth(gaussian: &Gaussian, camera: &OracleCamera) -> Moments {
    const POINTS: usize = 40_000;
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut normal = || {
        let (a, b): (f64, f64) = (rng.random_range(1e-12..1.0), rng.random());
        (-2.0 * a.ln()).sqrt() * (TAU * b).cos()
    };
    let largest = gaussian.rotation.map(f64::from);
    let norm = largest.iter().map(|c| c * c).sum::<f64>().sqrt();
    let [w, x, y, z] = largest.map(|c| c / norm);
    let rotation = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ];
    let (fx, fy) = (f64::from(camera.focal[0]), f64::from(camera.focal[1]));
    let (cx, cy) = (f64::from(camera.principal[0]), f64::from(camera.principal[1]));
    let mut places = Vec::with_capacity(POINTS);
    while places.len() < POINTS {
        let own = gaussian.scale.map(|s| f64::from(s) * normal());
        let [x, y, z]: [f64; 3] = std::array::from_fn(|i| {
            let moved: f64 = rotation[i].iter().zip(own).map(|(r, o)| r * o).sum();
            f64::from(gaussian.position[i]) + moved
        });
        let (u, v) = match camera.model {
            // Points in front of the near plane have no picture.
            OracleModel::Pinhole if z < f64::from(camera.near) => continue,
            OracleModel::Pinhole => (x / z, y / z),
            OracleModel::Orthographic => (x, y),
            OracleModel::Fisheye => {
                let r = x.hypot(y);
                (r.atan2(z) / r * x, r.atan2(z) / r * y)
            }
            OracleModel::Equirectangular => (x.atan2(z), y.atan2(x.hypot(z))),
        };
        places.push([fx * u + cx, fy * v + cy]);
    }
    let count = POINTS as f64;
    let mean = [0, 1].map(|axis| places.iter().map(|p| p[axis]).sum::<f64>() / count);
    let moment = |i: usize, j: usize| {
        let products = places.iter().map(|p| (p[i] - mean[i]) * (p[j] - mean[j]));
        products.sum::<f64>() / count
    };
    Moments { mean, covariance: [moment(0, 0), moment(0, 1), moment(1, 1)] }
}

#[test]
fn it_agrees_with_the_jacobian_on_what_is_small_and_far() {
    let far = gaussian([3.0, -2.0, 20.0], [0.02, 0.03, 0.01]);
    for model in [OracleModel::Pinhole, OracleModel::Orthographic, OracleModel::Fisheye, OracleModel::Equirectangular] {
        let camera = wide(model);
        let [unscented, jacobian] = [true, false].map(|way| projected(&far, &camera, way));
        let distance = unscented.distance(&jacobian);
        assert!(distance < 1e-5, "{model:?}: {distance}");
    }
}

#[test]
fn it_is_nearer_to_the_truth_in_wide_fields_and_near_the_eye() {
    // The least factor by which the unscented transform is nearer. Near the poles of a panorama neither is good.
    let cases = [
        // Beyond the edge of the picture, where the Jacobian's slope is clamped.
        (OracleModel::Pinhole, gaussian([5.6, 0.4, 2.0], [0.45, 0.3, 0.25]), 5.0),
        (OracleModel::Pinhole, gaussian([-4.4, 3.0, 1.6], [0.25, 0.3, 0.2]), 20.0),
        // Near the eye.
        (OracleModel::Pinhole, gaussian([0.5, 0.3, 1.2], [0.2, 0.25, 0.2]), 4.0),
        (OracleModel::Fisheye, gaussian([1.5, 1.0, 0.2], [0.5, 0.3, 0.4]), 1.5),
        (OracleModel::Fisheye, gaussian([1.5, 1.0, -0.9], [0.4, 0.3, 0.3]), 1.5),
        (OracleModel::Equirectangular, gaussian([0.7, 1.0, -0.2], [0.1, 0.25, 0.2]), 10.0),
    ];
    for (model, gaussian, factor) in cases {
        let camera = wide(model);
        let truth = truth(&gaussian, &camera);
        let [unscented, jacobian] = [true, false].map(|way| projected(&gaussian, &camera, way).distance(&truth));
        assert!(factor * unscented < jacobian, "{model:?}: {unscented:.5}, by the Jacobian {jacobian:.5}");
    }
}

#[test]
fn what_is_not_seen_whole_is_projected_by_the_jacobian() {
    let pinhole = wide(OracleModel::Pinhole);
    let panorama = wide(OracleModel::Equirectangular);
    let fisheye = wide(OracleModel::Fisheye);
    let cases = [
        (pinhole, gaussian([0.3, 0.2, 0.6], [0.4; 3])),
        (panorama, gaussian([0.1, 2.0, 0.1], [0.2; 3])),
        (fisheye, gaussian([0.1, 0.1, -2.0], [0.2; 3])),
        (fisheye, gaussian([0.3, 0.1, 0.2], [0.3; 3])),
    ];
    for (camera, gaussian) in cases {
        let [unscented, jacobian] = [true, false].map(|way| projected(&gaussian, &camera, way));
        assert_eq!(unscented.mean, jacobian.mean);
        assert_eq!(unscented.covariance, jacobian.covariance);
    }
}
