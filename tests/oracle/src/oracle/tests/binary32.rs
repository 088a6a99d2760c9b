//! The error model against binary32 renderers. A careful renderer must be within the envelope. Careless ones must not
//! be, or else the comparison would prove nothing.

use super::*;
use crate::compare::{Accuracy, Limits};
use crate::oracle::project::project;
use crate::oracle::render_bounded;
use crate::oracle::splat::Splat;
use crate::scenes;

/// The step that a renderer does carelessly.
#[derive(Clone, Copy, PartialEq)]
enum Carelessness {
    None,
    /// Jacobian, rotations and scales are multiplied in binary32.
    Projection,
    /// The mean is one binary32 number, so a pixel's offset from it is rounded twice.
    Mean,
    /// The determinant is a difference of products, and the conic its adjugate.
    Determinant,
}

/// A Gaussian in binary32.
struct Record {
    key: f32,
    /// The mean as an integer pixel and a fraction.
    pixel: [f64; 2],
    fraction: [f32; 2],
    conic: Conic,
    log2_opacity: f32,
    color: [f32; 3],
}

enum Conic {
    Cholesky { swapped: bool, l: [f32; 3] },
    Adjugate([f32; 3]),
}

impl Record {
    /// A careful record is the rounded binary64 one. Careless parts are computed in binary32, starting with
    /// `t`, which the extension evaluates in binary64.
    fn new(
        splat: &Splat,
        scene: &SceneBuffers,
        index: usize,
        camera: &OracleCamera,
        carelessness: Carelessness,
    ) -> Self {
        let t: [f64; 3] = std::array::from_fn(|row| {
            (0..3)
                .map(|i| {
                    let offset = f64::from(scene.positions[index][i]) - camera.eye[i];
                    f64::from(camera.rotation[3 * row + i]) * offset
                })
                .sum()
        });
        let size = [camera.width as f32, camera.height as f32];
        let tan = [0, 1].map(|i| {
            let (focal, principal) = (camera.focal[i], camera.principal[i]);
            let margin = 0.15 * size[i] / focal;
            ((t[i] / t[2]) as f32).max(-(principal / focal + margin)).min((size[i] - principal) / focal + margin)
        });
        let z = t[2] as f32;
        let jacobian = [
            [camera.focal[0] / z, 0.0, -camera.focal[0] * tan[0] / z],
            [0.0, camera.focal[1] / z, -camera.focal[1] * tan[1] / z],
        ];
        let axes = rotation(scene.rotations[index]);
        let m = jacobian.map(|row| {
            let world: [f32; 3] = std::array::from_fn(|i| (0..3).map(|k| row[k] * camera.rotation[3 * k + i]).sum());
            std::array::from_fn::<f32, 3, _>(|i| {
                (0..3).map(|k| world[k] * axes[k][i]).sum::<f32>() * scene.scales[index][i]
            })
        });
        let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let low_pass = 0.3_f32;
        let (xx, xy, yy) = (dot(m[0], m[0]), dot(m[0], m[1]), dot(m[1], m[1]));
        let cross = [
            m[0][1] * m[1][2] - m[0][2] * m[1][1],
            m[0][2] * m[1][0] - m[0][0] * m[1][2],
            m[0][0] * m[1][1] - m[0][1] * m[1][0],
        ];
        let conic = match carelessness {
            Carelessness::Determinant => {
                let [a, b, c] = [xx + low_pass, xy, yy + low_pass];
                let determinant = a * c - b * b;
                Conic::Adjugate([c / determinant, -b / determinant, a / determinant])
            }
            Carelessness::Projection => {
                let determinant = dot(cross, cross) + low_pass * (xx + yy) + low_pass * low_pass;
                let larger = xx.max(yy) + low_pass;
                Conic::Cholesky {
                    swapped: yy > xx,
                    l: [larger.sqrt(), xy / larger.sqrt(), (determinant / larger).sqrt()],
                }
            }
            Carelessness::None | Carelessness::Mean => {
                Conic::Cholesky { swapped: splat.cholesky.swapped, l: splat.cholesky.l.map(|l| l as f32) }
            }
        };
        let pixel = match carelessness {
            Carelessness::Mean => [0.0; 2],
            _ => splat.mean.map(f64::floor),
        };
        Self {
            key: z,
            pixel,
            fraction: [0, 1].map(|i| (splat.mean[i] - pixel[i]) as f32),
            conic,
            log2_opacity: scene.opacities[index].log2(),
            color: splat.color.map(|c| c as f32),
        }
    }

    fn alpha(&self, x: u32, y: u32) -> f32 {
        let [x, y] = [(0, x), (1, y)].map(|(i, at)| ((f64::from(at) - self.pixel[i]) as f32 + 0.5) - self.fraction[i]);
        let q = match self.conic {
            Conic::Cholesky { swapped, l: [l11, l21, l22] } => {
                let (first, second) = if swapped { (y, x) } else { (x, y) };
                let y1 = first / l11;
                let y2 = (second - l21 * y1) / l22;
                y1 * y1 + y2 * y2
            }
            Conic::Adjugate([a, b, c]) => a * x * x + 2.0 * b * x * y + c * y * y,
        };
        (self.log2_opacity - 0.5 * std::f32::consts::LOG2_E * q).exp2().min(0.99)
    }
}

fn rotation(quaternion: [f32; 4]) -> [[f32; 3]; 3] {
    let largest = quaternion.iter().fold(0.0, |a: f32, c| a.max(c.abs()));
    let scaled = quaternion.map(|c| c / largest);
    let norm = scaled.iter().map(|c| c * c).sum::<f32>().sqrt();
    let [w, x, y, z] = scaled.map(|c| c / norm);
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

/// Judges a binary32 rendering with the default state.
fn accuracy_of(scene: &SceneBuffers, camera: &OracleCamera, carelessness: Carelessness) -> Accuracy {
    let state = OracleState::default();
    let input = scene.as_oracle();
    let mut records: Vec<Record> = (0..input.len())
        .filter_map(|i| project(&input, camera, &state, i).ok().map(|splat| (i, splat)))
        .map(|(i, splat)| Record::new(&splat, scene, i, camera, carelessness))
        .collect();
    records.sort_by(|a, b| a.key.total_cmp(&b.key));
    let pixels = (0..camera.height).flat_map(|y| (0..camera.width).map(move |x| (x, y)));
    let image: Vec<[f32; 4]> = pixels
        .map(|(x, y)| {
            let (mut color, mut transmittance) = ([0.0_f32; 3], 1.0_f32);
            for record in &records {
                let alpha = record.alpha(x, y);
                if alpha >= 1.0 / 255.0 {
                    let behind = transmittance * (1.0 - alpha);
                    if behind < 1e-4 {
                        break;
                    }
                    for (sum, c) in color.iter_mut().zip(record.color) {
                        *sum += transmittance * alpha * c;
                    }
                    transmittance = behind;
                }
            }
            [color[0], color[1], color[2], 1.0 - transmittance]
        })
        .collect();
    let reference = render_bounded(&input, camera, &state);
    Accuracy::of(&image, &reference, Limits::ENVELOPE_ONLY)
}

/// Long thin Gaussians in all directions, most of whose length may be outside the picture.
fn needles(seed: u64) -> SceneBuffers {
    let mut scene = scenes::cloud(seed, 300, 0);
    for scale in &mut scene.scales {
        *scale = [200.0 * scale[0], 0.1 * scale[0], 0.1 * scale[0]];
    }
    scene
}

/// The greatest ratio of alpha's error to the model's bound, over all pixels to which Gaussians contribute.
fn greatest_share_of_the_bound(scene: &SceneBuffers, camera: &OracleCamera, carelessness: Carelessness) -> f64 {
    let state = OracleState::default();
    let input = scene.as_oracle();
    let mut greatest = 0.0_f64;
    for index in 0..input.len() {
        let Ok(splat) = project(&input, camera, &state, index) else {
            continue;
        };
        let record = Record::new(&splat, scene, index, camera, carelessness);
        for (x, y) in (0..camera.height).flat_map(|y| (0..camera.width).map(move |x| (x, y))) {
            let expected = splat.alpha(x, y, &state);
            if expected.value >= f64::from(state.alpha_floor) && expected.error > 0.0 {
                let error = (f64::from(record.alpha(x, y)) - expected.value).abs();
                greatest = greatest.max(error / expected.error);
            }
        }
    }
    greatest
}

#[test]
fn the_model_bounds_what_binary32_does() {
    let camera = OracleCamera { principal: [20.0, 40.0], ..scenes::camera(96, 64) };
    for seed in 0..3 {
        for scene in [scenes::cloud(seed, 400, 0), scenes::awkward(seed, 200, 0), needles(seed)] {
            let projected = greatest_share_of_the_bound(&scene, &camera, Carelessness::Projection);
            let careful = greatest_share_of_the_bound(&scene, &camera, Carelessness::None);
            assert!(projected < 1.0 && careful < 1.0, "{projected} {careful}");
            // The bound is not too wide to be useful.
            assert!(projected > 0.1 && careful > 0.05, "{projected} {careful}");
        }
    }
}

#[test]
fn careful_binary32_lies_within_the_envelope() {
    for seed in 0..4 {
        let camera = scenes::camera(96, 64);
        let accuracy = accuracy_of(&scenes::cloud(seed, 1500, 0), &camera, Carelessness::None);
        assert!(accuracy.holds(), "{accuracy}");
        let accuracy = accuracy_of(&needles(seed), &camera, Carelessness::None);
        assert!(accuracy.holds(), "{accuracy}");
    }
}

#[test]
fn a_projection_in_binary32_is_enough_unless_there_are_needles() {
    let camera = scenes::camera(96, 64);
    let accuracy = accuracy_of(&scenes::cloud(1, 1500, 0), &camera, Carelessness::Projection);
    assert!(accuracy.holds(), "{accuracy}");
    let accuracy = accuracy_of(&needles(2), &camera, Carelessness::Projection);
    assert!(!accuracy.holds(), "{accuracy}");
}

#[test]
fn a_mean_in_one_number_does_not() {
    // Small Gaussians on a picture so wide that binary32 pixels are coarse at its right end.
    let camera = OracleCamera { focal: [6553.6; 2], ..scenes::camera(8192, 2) };
    let mut scene = scenes::cloud(1, 400, 0);
    for (position, scale) in scene.positions.iter_mut().zip(&mut scene.scales) {
        position[1] *= 0.001;
        *scale = scale.map(|s| s / 100.0);
    }
    let careful = accuracy_of(&scene, &camera, Carelessness::None);
    assert!(careful.holds(), "{careful}");
    let careless = accuracy_of(&scene, &camera, Carelessness::Mean);
    assert!(!careless.holds(), "{careless}");
}

#[test]
fn a_determinant_that_cancels_does_not() {
    let camera = scenes::camera(96, 64);
    let careless = accuracy_of(&needles(1), &camera, Carelessness::Determinant);
    assert!(!careless.holds(), "{careless}");
}
