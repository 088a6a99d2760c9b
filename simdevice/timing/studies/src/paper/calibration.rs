//! Predictions of a scene's raster time from its baseline, calibrated on the other six scenes.

use super::numbers::{SCENES, Scene};
use timing::work::TILE_SIDE;

/// A model of GauRast's raster time in ms, with a constant for each feature of a scene.
pub struct Model {
    pub name: &'static str,
    pub features: fn(&Scene) -> Vec<f64>,
}

fn tiles(scene: &Scene) -> f64 {
    let [columns, rows] = scene.size.map(|side| f64::from(side.div_ceil(TILE_SIDE)));
    columns * rows * 1e-3
}

/// The models; the null model is the first.
pub const MODELS: [Model; 3] = [
    Model { name: "baseline / constant (null)", features: |scene| vec![scene.baseline_ms] },
    Model {
        name: "pairs from the baseline, and cycles per tile",
        features: |scene| vec![scene.baseline_ms, tiles(scene)],
    },
    Model {
        name: "pairs from the baseline, and time per Gaussian",
        features: |scene| vec![scene.baseline_ms, scene.gaussians],
    },
];

/// The predicted raster time of a scene in ms, calibrated on the six others.
pub fn leave_one_out(model: &Model, left_out: usize) -> f64 {
    let others: Vec<_> = (0..SCENES.len()).filter(|&index| index != left_out).collect();
    let features = (model.features)(&SCENES[left_out]);
    if features.len() == 1 {
        // The null model's constant is the ratio of the sums.
        let sum = |of: fn(&Scene) -> f64| others.iter().map(|&index| of(&SCENES[index])).sum::<f64>();
        return features[0] * sum(|scene| scene.gaurast_ms) / sum(|scene| scene.baseline_ms);
    }
    // Least squares of relative errors, two unknowns.
    let (mut a, mut b, mut c, mut p, mut q) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for &index in &others {
        let scene = &SCENES[index];
        let f: Vec<_> = (model.features)(scene).iter().map(|x| x / scene.gaurast_ms).collect();
        a += f[0] * f[0];
        b += f[0] * f[1];
        c += f[1] * f[1];
        p += f[0];
        q += f[1];
    }
    let determinant = a * c - b * b;
    let weights = [(p * c - q * b) / determinant, (q * a - p * b) / determinant];
    features.iter().zip(weights).map(|(f, w)| f * w).sum()
}

/// The mean relative error of a model over the scenes.
pub fn mean_error(model: &Model) -> f64 {
    let error = |index: usize| (leave_one_out(model, index) / SCENES[index].gaurast_ms - 1.0).abs();
    (0..SCENES.len()).map(error).sum::<f64>() / SCENES.len() as f64
}

/// The mean relative error of the null model if one constant, the ratio of the sums, is used for all scenes.
pub fn fitted_error() -> f64 {
    let sum = |of: fn(&Scene) -> f64| SCENES.iter().map(of).sum::<f64>();
    let constant = sum(|s| s.baseline_ms) / sum(|s| s.gaurast_ms);
    sum_of_errors(constant) / SCENES.len() as f64
}

fn sum_of_errors(constant: f64) -> f64 {
    let error = |s: &Scene| (s.baseline_ms / constant / s.gaurast_ms - 1.0).abs();
    SCENES.iter().map(error).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_null_models_error() {
        // Sums of all seven: 1570 / 68.6 = 22.9, with a mean error of 6.6 %; leaving one out can only be worse.
        let error = sum_of_errors(1570.0 / 68.6) / 7.0;
        assert!((error - fitted_error()).abs() < 1e-9);
        assert!((error - 0.066).abs() < 0.001, "{error}");
        assert!(mean_error(&MODELS[0]) >= error);
    }

    #[test]
    fn a_left_out_scene_does_not_enter_its_own_prediction() {
        // Two points determine two unknowns, so an exact law is recovered.
        for model in &MODELS {
            for index in 0..SCENES.len() {
                assert!(leave_one_out(model, index).is_finite());
            }
        }
    }
}
