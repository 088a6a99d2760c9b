//! The scenes' raster times: the pairs that they imply, the model's times for these, and the prediction of each scene
//! from the others.

use super::calibration::{MODELS, fitted_error, leave_one_out, mean_error};
use super::numbers::{SCENES, implied_pairs, mean};
use super::predicted::{Unpublished, frame};
use super::table::{Label, Row, Section};
use timing::config::{Config, ConfigError};
use timing::energy;
use timing::simulate::simulate;
use timing::work::TILE_PIXELS;

/// Operations of a shader core per evaluation that the published times imply for 240 PEs.
pub fn operations_per_evaluation(config: &Config) -> f64 {
    let shader = &config.shader;
    let lanes = f64::from(shader.sms) * shader.float_per_cycle * shader.clock_ghz * 1e6;
    let evaluations = |ms: f64| {
        let pes = f64::from(config.rasterizer.pes());
        implied_pairs(ms, pes, config.rasterizer.clock_ghz) * f64::from(TILE_PIXELS)
    };
    mean(|s| s.baseline_ms) * lanes * config.baseline.efficiency / mean(|s| evaluations(s.gaurast_ms))
}

pub fn sections() -> Vec<Section> {
    let mut sections = model_sections();
    sections.extend([times(), implied()]);
    sections
}

fn times() -> Section {
    let mut rows = Vec::new();
    for scene in &SCENES {
        rows.push(Row::input(format!("{}, baseline raster", scene.name), format!("{} ms", scene.baseline_ms)));
        rows.push(
            Row::input(format!("{}, GauRast raster", scene.name), format!("{} ms", scene.gaurast_ms))
                .note(format!("{:.1}x", scene.baseline_ms / scene.gaurast_ms)),
        );
    }
    Section { title: "Raster times", text: "Stage 3 as published, in the 10 W mode.".to_owned(), rows }
}

fn implied() -> Section {
    let mut rows = Vec::new();
    for scene in &SCENES {
        let [fewer, more] = [240.0, 300.0].map(|pes| implied_pairs(scene.gaurast_ms, pes, 1.0));
        let model = format!("{:.1} / {:.1} M", fewer * 1e-6, more * 1e-6);
        let traffic = fewer * 36.0 / (scene.gaurast_ms * 1e6);
        rows.push(Row::new(format!("{}, pairs", scene.name), "", model, Label::Solved).note(format!(
            "{:.1} pairs a Gaussian, {:.0} a tile; 36 bytes each are {traffic:.1} of 68.3 GB/s",
            fewer * 1e-6 / scene.gaussians,
            fewer / f64::from(scene.size[0].div_ceil(16) * scene.size[1].div_ceil(16)),
        )));
    }
    Section {
        title: "Pairs that the times imply",
        text: "Pairs of a 16x16 tile and a Gaussian that 240 and 300 PEs evaluate at every pixel of the tile in the \
               published time, one pixel per PE and cycle: time x PEs / 256."
            .to_owned(),
        rows,
    }
}

/// The two sections that need presets. Empty if the presets can't be read.
fn model_sections() -> Vec<Section> {
    model().unwrap_or_default()
}

fn model() -> Result<Vec<Section>, ConfigError> {
    let config = Config::preset("paper-15x16", &[])?;
    let operations = operations_per_evaluation(&config);
    let mut rows = vec![
        Row::new("operations of a shader core per evaluation", "", format!("{operations:.1}"), Label::Calibrated)
            .note("all scenes' baseline over the evaluations that 240 PEs imply, 90 % of issue slots used"),
    ];
    let mut energy_rows = Vec::new();
    let blended = config.energy.blended_share;
    for scene in &SCENES {
        let result = simulate(&frame(scene, Unpublished::LEAST, &config), &config);
        let (alone, beside) = (&result.raster_alone, &result.raster);
        rows.push(
            Row::numbers(
                format!("{}, GauRast raster, a frame alone", scene.name),
                " ms",
                [scene.gaurast_ms, result.stages_alone.raster],
                2,
                Label::Solved,
            )
            .note(format!("PEs busy {:.1} % of cycles", alone.utilization() * 100.0)),
        );
        rows.push(
            Row::numbers(
                format!("{}, GauRast raster, beside stages 1-2", scene.name),
                " ms",
                [scene.gaurast_ms, result.stages.raster],
                2,
                Label::Solved,
            )
            .note(format!(
                "PEs busy {:.1} % of cycles, waiting for memory {:.1} %: stages 1-2 of the next frame move {:.1} GB/s",
                beside.utilization() * 100.0,
                beside.modules.memory / beside.modules.total() * 100.0,
                result.contention_gb_s,
            )),
        );
        let spent = energy::rasterizer(alone, energy::Changed::both(blended), result.stages_alone.raster, &config);
        let baseline = scene.baseline_ms * config.soc.power_w;
        energy_rows.push(
            Row::new(
                format!("{}, raster energy", scene.name),
                "",
                format!("{:.0} mJ", spent.modules() + spent.memory),
                Label::Calibrated,
            )
            .note(format!(
                "modules {:.0} mJ and main memory {:.0} mJ against {baseline:.0} mJ (10 W x {} ms): {:.1}x",
                spent.modules(),
                spent.memory,
                scene.baseline_ms,
                baseline / (spent.modules() + spent.memory)
            )),
        );
    }
    Ok(vec![
        Section {
            title: "What the model makes of the pairs",
            text: "The implied pairs, spread evenly over the tiles, through `simulate`: what tiles, fetches and write-backs \
                   add to an ideal machine, and what stages 1-2 of the next frame do, with which memory is shared. That the \
                   time comes back is no evidence for the pairs. Even lists are the \
                   worst case for write-backs: where modules end tiles at the same time, their pixels crowd out fetches."
                .to_owned(),
            rows,
        },
        Section {
            title: "Energy of the raster stage",
            text: "With 1.7 W a module at the calibration frames' activity, times solved, a frame alone. The paper's figure of single scenes was not read, so its column is blank.".to_owned(),
            rows: energy_rows,
        },
    ])
}

/// The section that fits each scene from the others.
pub fn left_out() -> Section {
    let mut rows = Vec::new();
    for model in &MODELS {
        for (index, scene) in SCENES.iter().enumerate() {
            let predicted = leave_one_out(model, index);
            rows.push(Row::numbers(
                format!("{}: {}", scene.name, model.name),
                " ms",
                [scene.gaurast_ms, predicted],
                2,
                Label::Fit,
            ));
        }
    }
    let errors = MODELS.map(|model| (model.name, mean_error(&model)));
    let in_sample = fitted_error();
    let [null, ours @ ..] = &errors;
    let mut text = format!(
        "Regressions: no machine is simulated. Constants of six scenes' published times give the seventh's GauRast time \
         from its baseline. Mean error: {} {:.1} %",
        null.0,
        null.1 * 100.0
    );
    let null_text = format!(
        " With one constant of all seven scenes, {:.1}, the null model's mean error is {:.1} %; but then each scene has \
         helped to predict itself, and what it is held against must be left out alike.",
        mean(|s| s.baseline_ms) / mean(|s| s.gaurast_ms),
        in_sample * 100.0
    );
    for (name, error) in ours {
        text += &format!("; {name} {:.1} %", error * 100.0);
    }
    let best = ours.iter().map(|(_, error)| *error).fold(f64::INFINITY, f64::min);
    text += if best < null.1 {
        ". A second feature helps here; with six scenes and two constants that may be chance."
    } else {
        ". No model of ours is better than the null model: what tells scenes apart is not in the published numbers."
    };
    text += &null_text;
    Section { title: "Each scene fitted from the others", text, rows }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_of_bicycle_and_bonsai() {
        let pairs = |ms, pes| (implied_pairs(ms, pes, 1.0) * 1e-5).round() / 10.0;
        assert_eq!([pairs(15.0, 240.0), pairs(15.0, 300.0)], [14.1, 17.6]);
        assert_eq!([pairs(5.5, 240.0), pairs(5.5, 300.0)], [5.2, 6.4]);
    }

    #[test]
    fn the_preset_has_the_calibrated_constant() {
        let config = Config::preset("paper-15x16", &[]).unwrap();
        let calibrated = operations_per_evaluation(&config);
        assert!((calibrated - config.baseline.operations_per_evaluation).abs() < 0.05, "{calibrated}");
    }
}
