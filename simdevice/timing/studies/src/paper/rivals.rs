//! The baseline as a SIMT machine, the traffic of sorting, and other ways to draw Gaussians.

use super::numbers::{SCENES, Scene};
use super::predicted::{Unpublished, frame};
use super::table::{Label, Row, Section};
use crate::rivals::{self, PUBLISHED};
use crate::simt;
use timing::config::{Config, ConfigError, DEFAULT_PRESET};
use timing::shader_cores::roofline;
use timing::work::FrameWork;

/// The sections about the SIMT machine, the traffic of sorting, and other ways to draw Gaussians.
///
/// # Errors
/// Returns a [`ConfigError`] if the preset can't be read.
pub fn sections() -> Result<[Section; 3], ConfigError> {
    let config = Config::preset(DEFAULT_PRESET, &[])?;
    Ok([baseline(&config), sorting(&config), others(&config)])
}

/// A scene's frame in two variants: no warp blends, and each warp does.
fn both(scene: &Scene, config: &Config) -> [FrameWork; 2] {
    let all = frame(scene, Unpublished::LEAST, config);
    let mut none = all.clone();
    for tile in none.draws.iter_mut().flat_map(|draw| &mut draw.tiles) {
        tile.runs.iter_mut().for_each(|run| run.reached = 0);
    }
    [none, all]
}

/// The mean relative error of predictions over the scenes' baselines.
fn mean_error(predicted: impl Fn(usize) -> f64) -> f64 {
    let error = |index: usize| (predicted(index) / SCENES[index].baseline_ms - 1.0).abs();
    (0..SCENES.len()).map(error).sum::<f64>() / SCENES.len() as f64
}

/// The mean of the other scenes' baselines.
fn mean_null(left_out: usize) -> f64 {
    let others = SCENES.iter().enumerate().filter(|(index, _)| *index != left_out);
    others.map(|(_, scene)| scene.baseline_ms).sum::<f64>() / (SCENES.len() - 1) as f64
}

/// The prediction of a scene's baseline by a line, fitted by least squares to the other scenes' times: GauRast's to
/// baseline.
fn affine_null(left_out: usize) -> f64 {
    let others = || {
        let all = SCENES.iter().enumerate();
        all.filter(|(index, _)| *index != left_out).map(|(_, scene)| scene)
    };
    let count = (SCENES.len() - 1) as f64;
    let mean = |of: fn(&Scene) -> f64| others().map(of).sum::<f64>() / count;
    let (x, y) = (mean(|s| s.gaurast_ms), mean(|s| s.baseline_ms));
    let (mut covariance, mut variance) = (0.0, 0.0);
    for scene in others() {
        covariance += (scene.gaurast_ms - x) * (scene.baseline_ms - y);
        variance += (scene.gaurast_ms - x).powi(2);
    }
    y + covariance / variance * (SCENES[left_out].gaurast_ms - x)
}

fn baseline(config: &Config) -> Section {
    let mut rows = Vec::new();
    let results: Vec<_> =
        SCENES.iter().map(|scene| both(scene, config).map(|frame| simt::simulate(&frame, config))).collect();
    let machine = "of the seven baselines; from microarchitecture, the compiled kernel and the implied pairs";
    let others = "of the seven baselines; from the other six and the scene's own GauRast time";
    let errors = [
        ("SIMT machine, each warp blends", mean_error(|index| results[index][1].milliseconds()), machine),
        ("SIMT machine, no warp blends", mean_error(|index| results[index][0].milliseconds()), machine),
        ("mean of the other scenes (null)", mean_error(mean_null), "of the seven baselines; from the other six"),
        ("line through the other scenes (null)", mean_error(affine_null), others),
    ];
    for (name, error, from) in errors {
        let model = format!("{:.1} %", error * 100.0);
        let label = if name.ends_with("(null)") { Label::Fit } else { Label::Predicted };
        rows.push(Row::new(format!("mean error: {name}"), "", model, label).note(from));
    }
    for (index, scene) in SCENES.iter().enumerate() {
        let [none, all] = results[index].map(|result| result.milliseconds());
        rows.push(
            Row::numbers(
                format!("{}, baseline raster from the implied pairs", scene.name),
                " ms",
                [scene.baseline_ms, all],
                0,
                Label::Predicted,
            )
            .note(format!(
                "{none:.0} ms if no warp blends; {:.1} ms of it the last blocks' tail, {:.0} ms of main memory beside it; nulls {:.0} and {:.0} ms",
                results[index][1].tail_ms,
                results[index][1].memory_ms,
                mean_null(index),
                affine_null(index),
            )),
        );
        rows.push(
            Row::new(
                format!("{}, baseline raster from its own work", scene.name),
                format!("{} ms", scene.baseline_ms),
                "not testable here",
                Label::Untestable,
            )
            .note("no trained model of the scene is at hand"),
        );
    }
    for parameter in simt::MACHINE {
        let label = if parameter.source.starts_with("assumed") { Label::Assumed } else { Label::Cited };
        let value = format!("{}", parameter.value);
        rows.push(Row::without_paper(parameter.name, value, label, parameter.source));
    }
    Section {
        title: "The baseline as a SIMT machine",
        text: "Stage 3 of the original code on the shader cores of the 10 W mode: batches of 256, warps of 32 that end with their \
               slowest lane, skipped and blended pairs, the last blocks' tail, L2 and main memory. Its numbers come from published \
               microarchitecture and from the compiled kernel. The first run had 32, 18 and 40 instructions, counted by hand \
               before it; who counted knew that 26.9 operations an evaluation had been calibrated. The compiled kernel's 40, 25 \
               and 47 replaced them later, when the first run's errors were known. Its pairs are those that GauRast's times \
               imply, spread evenly, of which none ends early, so that this tests the cost of a pair and nothing of the scenes. It \
               has no constant of the paper's; the nulls have one and two of the other six scenes. Its errors are above those \
               of both nulls: the pairs that GauRast's times imply are more than such a machine evaluates in the published \
               times. So the first table does not have them."
            .to_owned(),
        rows,
    }
}

fn sorting(config: &Config) -> Section {
    let mut rows = Vec::new();
    let mut shares = [0.0; 3];
    for scene in &SCENES {
        let work = frame(scene, Unpublished::LEAST, config);
        let [_, one, two, _] = work.shader();
        let time = |work| roofline(work, &config.shader, &config.memory).milliseconds();
        let (before, sort) = (time(&one), time(&two));
        let raster = &config.rasterizer;
        let pixels = f64::from(scene.size[0] * scene.size[1] * raster.numbers_out * raster.number_bytes);
        let moved = work.pairs() as f64 * f64::from(raster.primitive_bytes()) + pixels;
        let all = one.bytes + two.bytes + moved;
        let of =
            [sort / (before + sort + scene.baseline_ms), sort / (before + sort).max(scene.gaurast_ms), two.bytes / all];
        for (sum, share) in shares.iter_mut().zip(of) {
            *sum += share / SCENES.len() as f64;
        }
        rows.push(
            Row::new(
                format!("{}, sorting", scene.name),
                "",
                format!("{:.0} % of a frame", of[1] * 100.0),
                Label::Predicted,
            )
            .note(format!(
                "{sort:.1} ms; {:.0} % of the baseline's frame; {:.0} % of {:.0} MB: preprocessing {:.0} %, rasterizing {:.0} %",
                of[0] * 100.0,
                of[2] * 100.0,
                all * 1e-6,
                one.bytes / all * 100.0,
                moved / all * 100.0,
            )),
        );
    }
    rows.insert(
        0,
        Row::new("sorting, mean of the scenes", "", format!("{:.0} % of a frame", shares[1] * 100.0), Label::Predicted)
            .note(format!(
                "{:.0} % of the baseline's frame, {:.0} % of all bytes",
                shares[0] * 100.0,
                shares[2] * 100.0
            )),
    );
    Section {
        title: "Sorting, once rasterizing is fast",
        text: "What Neo is about: with a rasterizer of 23 times the speed, sorting is a large part of what is left. One listed pair a \
               needed one; a radix sort of 64-bit keys, as in the original code."
            .to_owned(),
        rows,
    }
}

fn others(config: &Config) -> Section {
    let mut rows = Vec::new();
    for scene in &SCENES {
        let quads = rivals::quads(&frame(scene, Unpublished::LEAST, config), config);
        rows.push(
            Row::new(
                format!("{}, blended quads from the implied pairs, at most", scene.name),
                "",
                format!("{:.0} ms", quads.milliseconds()),
                Label::Predicted,
            )
            .note(format!(
                "{} limits; each pair is taken to cover its tile. Shading {:.0}, setup {:.1}, blending {:.0}, main memory {:.1} ms; \
                 the paper's baseline takes {} ms",
                quads.limit(),
                quads.shade_ms,
                quads.setup_ms,
                quads.blend_ms,
                quads.memory_ms,
                scene.baseline_ms,
            )),
        );
    }
    for published in PUBLISHED {
        let parts = [
            ("scenes", published.scenes),
            ("resolution", published.resolution),
            ("against", published.baseline),
            ("source", published.source),
        ];
        let parts = parts.iter().filter(|(_, text)| !text.is_empty());
        let note: Vec<_> = parts.map(|(name, text)| format!("{name}: {text}")).collect();
        rows.push(Row::without_paper(published.name, published.number, Label::Cited, note.join("; ")));
    }
    Section {
        title: "Other ways to draw Gaussians",
        text: "First quads on the unmodified rasterizer and ROPs (`gaurast simulate` shows them for any scene), then what others say \
               of their own hardware. These are of different scenes, sizes and baselines and do not compare."
            .to_owned(),
        rows,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_does_not_enter_its_own_null() {
        let mean = SCENES.iter().map(|s| s.baseline_ms).sum::<f64>() / 7.0;
        for (index, scene) in SCENES.iter().enumerate() {
            assert!((mean_null(index) < mean) == (scene.baseline_ms > mean));
            assert!(affine_null(index).is_finite());
        }
    }
}
