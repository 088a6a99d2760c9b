//! Frames per second and the end-to-end speed-up, predicted: stages 1 and 2 from the shader cores' roofline, stage 3
//! from the pairs that its published time implies.

use super::numbers::{FPS, SCENES, SPEEDUP, Scene, implied_pairs};
use super::table::{Label, Row, Section};
use timing::config::{Config, ConfigError, DEFAULT_PRESET};
use timing::simulate::{Simulation, even_frame, simulate};
use timing::stages::{self, GaussianCounts};
use timing::work::{FrameWork, TILE_SIDE};

/// The ratio of listed and sorted pairs to those needed before a tile is finished, least and greatest. It is not
/// published.
const BAND: [f64; 2] = [1.0, 1.5];

/// Degree of the published models' spherical harmonics.
const DEGREE: u32 = 3;

/// A scene's frame: the pairs that its time implies, spread evenly, in lists that are `listed` times as long.
pub fn frame(scene: &Scene, listed: f64, config: &Config) -> FrameWork {
    let raster = &config.rasterizer;
    let needed = implied_pairs(scene.gaurast_ms, f64::from(raster.pes()), raster.clock_ghz) as u64;
    let mut frame = even_frame(scene.size, needed, config.energy.blended_share);
    let gaussians = (scene.gaussians * 1e6) as u64;
    let [columns, rows] = scene.size.map(|side| u64::from(side.div_ceil(TILE_SIDE)));
    for draw in &mut frame.draws {
        for tile in &mut draw.tiles {
            tile.listed = (f64::from(tile.listed) * listed).round() as u32;
        }
        let counts = GaussianCounts {
            read: gaussians,
            projected: gaussians,
            drawn: gaussians,
            shaded: 0,
            degree: DEGREE,
            pairs: draw.pairs(),
            tiles: columns * rows,
        };
        [draw.preprocess, draw.sort] = stages::gaussian(&counts);
        (draw.primitives, draw.drawn) = (gaussians, gaussians);
    }
    frame
}

/// The frame rates of a scene whose rasterizer takes no time.
struct Bound {
    before_ms: f64,
    fps: f64,
    speedup: f64,
}

impl Bound {
    fn of(scene: &Scene, result: &Simulation) -> Self {
        let before_ms = result.stages_alone.preprocess + result.stages_alone.sort;
        Self { before_ms, fps: 1e3 / before_ms, speedup: (before_ms + scene.baseline_ms) / before_ms }
    }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    values.sum::<f64>() / SCENES.len() as f64
}

/// The section of predicted frame rates and speed-ups.
///
/// # Errors
/// Returns a [`ConfigError`] if the preset can't be read.
pub fn section() -> Result<Section, ConfigError> {
    let config = Config::preset(DEFAULT_PRESET, &[])?;
    let mut rows = Vec::new();
    let mut scenes = Vec::new();
    for listed in BAND {
        let of = |scene: &Scene| {
            let result = simulate(&frame(scene, listed, &config), &config);
            (Bound::of(scene, &result), result)
        };
        let results: Vec<_> = SCENES.iter().map(of).collect();
        let paired = format!("{listed:.1} listed a needed pair");
        for (scene, (bound, result)) in SCENES.iter().zip(&results) {
            scenes.push(
                Row::new(
                    format!("{}, FPS without a raster stage, {paired}", scene.name),
                    "",
                    format!("{:.1}", bound.fps),
                    Label::Predicted,
                )
                .note(format!(
                    "{:.1}x; stages 1-2 take {:.1} ms; with {:.0} operations an evaluation the baseline's stage 3 takes {} ms",
                    bound.speedup, bound.before_ms, config.baseline.operations_per_evaluation, scene.baseline_ms,
                )),
            );
            scenes.push(
                Row::new(format!("{}, FPS, {paired}", scene.name), "", format!("{:.1}", result.fps), Label::Predicted)
                    .note(format!(
                        "{:.1}x; raster {:.1} ms beside stages 1-2, {:.1} ms alone; {:.0} mJ a frame",
                        result.speedup,
                        result.stages.raster,
                        result.stages_alone.raster,
                        result.energy.total(),
                    )),
            );
        }
        let bounds = || results.iter().map(|(bound, _)| bound);
        let simulated = || results.iter().map(|(_, result)| result);
        let mut row = |item: &str, unit, values: [f64; 2], decimals| {
            let item = format!("{item}, {paired}");
            rows.push(Row::numbers(item, unit, values, decimals, Label::Predicted).note(
                "mean of the scenes; stages 1-2 from this project's operation counts and published counts of Gaussians",
            ));
        };
        row("FPS without a raster stage", "", [FPS[0], mean(bounds().map(|b| b.fps))], 1);
        row("speed-up without a raster stage", "x", [SPEEDUP[0], mean(bounds().map(|b| b.speedup))], 2);
        row("FPS", "", [FPS[0], mean(simulated().map(|s| s.fps))], 1);
        row("end-to-end speed-up", "x", [SPEEDUP[0], mean(simulated().map(|s| s.speedup))], 2);
    }
    rows.extend(scenes);
    Ok(Section {
        title: "Frames, predicted",
        text: "Stages 1 and 2 on the shader cores' roofline; the paper gives no times for them. First the bound that no \
               rasterizer can pass, one of zero cycles, then the paper's. Pairs needed are solved from the published raster \
               times; how many more are listed and sorted is not published, so a band of 1.0 to 1.5 is shown. Every \
               Gaussian of the published models is taken to be seen, which is an upper bound. The paper's figures of \
               single scenes were not read: where they have a number, its column is blank."
            .to_owned(),
        rows,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_frame_is_faster_than_without_a_raster_stage() {
        let config = Config::preset(DEFAULT_PRESET, &[]).unwrap();
        let mut before = f64::INFINITY;
        for listed in BAND {
            let results: Vec<_> =
                SCENES.iter().map(|scene| (scene, simulate(&frame(scene, listed, &config), &config))).collect();
            for (scene, result) in &results {
                let bound = Bound::of(scene, result);
                assert!(result.fps <= bound.fps * (1.0 + 1e-9), "{}", scene.name);
                assert!(result.stages.raster >= result.stages_alone.raster, "{}", scene.name);
                // Both sides have the same lists.
                assert_eq!(result.gains.lists, 1.0);
            }
            let fps = mean(results.iter().map(|(_, result)| result.fps));
            assert!(fps < before);
            before = fps;
        }
    }
}
