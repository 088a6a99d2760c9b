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

/// The numbers of a scene's frame that nobody publishes.
#[derive(Clone, Copy, Debug)]
pub struct Unpublished {
    /// The ratio of listed and sorted pairs to those needed before a tile is finished.
    pub listed: f64,
    /// The share of the scene's Gaussians that are in the picture.
    pub seen: f64,
}

impl Unpublished {
    /// The least lists, of a picture that shows all Gaussians.
    pub const LEAST: Self = Self { listed: 1.0, seen: 1.0 };
}

/// A scene's frame: the pairs that its time implies, spread evenly over the tiles.
pub fn frame(scene: &Scene, unpublished: Unpublished, config: &Config) -> FrameWork {
    let raster = &config.rasterizer;
    let needed = implied_pairs(scene.gaurast_ms, f64::from(raster.pes()), raster.clock_ghz) as u64;
    let mut frame = even_frame(scene.size, needed, config.energy.blended_share);
    let gaussians = (scene.gaussians * 1e6) as u64;
    let [columns, rows] = scene.size.map(|side| u64::from(side.div_ceil(TILE_SIDE)));
    for draw in &mut frame.draws {
        for tile in &mut draw.tiles {
            tile.listed = (f64::from(tile.listed) * unpublished.listed).round() as u32;
        }
        let drawn = (gaussians as f64 * unpublished.seen) as u64;
        let counts = GaussianCounts {
            read: gaussians,
            projected: drawn,
            drawn,
            shaded: 0,
            degree: DEGREE,
            pairs: draw.pairs(),
            tiles: columns * rows,
        };
        [draw.preprocess, draw.sort] = stages::gaussian(&counts);
        (draw.primitives, draw.drawn) = (gaussians, drawn);
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
            let unpublished = Unpublished { listed, ..Unpublished::LEAST };
            let result = simulate(&frame(scene, unpublished, &config), &config);
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
                    Label::Bound,
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
        row("FPS", "", [FPS[0], mean(simulated().map(|s| s.fps))], 1);
        row("end-to-end speed-up", "x", [SPEEDUP[0], mean(simulated().map(|s| s.speedup))], 2);
        let [fps, speedup] = [mean(bounds().map(|bound| bound.fps)), mean(bounds().map(|bound| bound.speedup))];
        for (item, value) in [("FPS", format!("{fps:.1}")), ("speed-up", format!("{speedup:.2}x"))] {
            let item = format!("{item} without a raster stage, {paired}");
            rows.push(Row::new(item, "", value, Label::Bound).note("mean of the scenes; a rasterizer of zero cycles"));
        }
    }
    rows.extend(scenes);
    Ok(Section {
        title: "Frames, predicted",
        text: "Stages 1 and 2 on the shader cores' roofline; the paper gives no times for them. After \
               each prediction is the bound that no rasterizer can pass, one of zero cycles. Pairs needed are solved from the published raster \
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
            let results: Vec<_> = SCENES
                .iter()
                .map(|scene| {
                    let unpublished = Unpublished { listed, ..Unpublished::LEAST };
                    (scene, simulate(&frame(scene, unpublished, &config), &config))
                })
                .collect();
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
