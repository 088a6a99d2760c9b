//! Pairs of generated scenes compared with those that the published times imply.

use super::numbers::{SCENES, implied_pairs};
use super::table::{Label, Row, Section};
use serde::Deserialize;
use timing::config::Config;
use timing::fast;
use timing::simulate::even_frame;

/// The measurements that `tests/bench/examples/paper_scenes.rs` writes.
const MEASURED: &str = include_str!("../../generated_scenes.toml");

#[derive(Deserialize)]
struct Measured {
    #[serde(default)]
    scene: Vec<Scene>,
}

#[derive(Deserialize)]
struct Scene {
    name: String,
    /// The scene whose camera path was used.
    path: String,
    gaussians: u64,
    size: [u32; 2],
    /// Pairs of a tile and a Gaussian.
    pairs: u64,
    /// Pairs that were fetched before the tile was finished.
    needed: u64,
    /// Pairs of a 4x4 block and a Gaussian that was evaluated there.
    blocks: u64,
    /// Gaussians that reach a tile.
    drawn: u64,
}

/// The section. None if there are no measurements, or they or the presets can't be read.
pub fn section() -> Option<Section> {
    let measured: Measured = toml::from_str(MEASURED).ok()?;
    let config = Config::preset("paper-15x16", &[]).ok()?;
    let mut rows = Vec::new();
    for scene in &SCENES {
        let found = measured.scene.iter().find(|known| known.name == scene.name);
        let Some(found) = found else { continue };
        let millions = |count: u64| count as f64 * 1e-6;
        let implied = implied_pairs(scene.gaurast_ms, 240.0, 1.0) * 1e-6;
        let seen = found.drawn as f64 / found.gaussians as f64;
        rows.push(
            Row::new(
                format!("{}, pairs needed", scene.name),
                "",
                format!("{:.1} of {:.1} M", millions(found.needed), millions(found.pairs)),
                Label::Illustration,
            )
            .note(format!(
                "{implied:.1} M implied for 240 PEs; {:.2} M Gaussians, {:.0} % of them seen, along the path of {}; {:.1} of \
                 16 blocks of a needed pair reached",
                millions(found.gaussians),
                100.0 * seen,
                found.path,
                found.blocks as f64 / found.needed as f64,
            )),
        );
        let frame = even_frame(found.size, found.needed, config.energy.blended_share);
        let raster = fast::rasterize(&frame, &config, 0.0);
        let ms = raster.milliseconds(config.rasterizer.clock_ghz);
        rows.push(Row::numbers(
            format!("{}, GauRast raster of them", scene.name),
            " ms",
            [scene.gaurast_ms, ms],
            1,
            Label::Illustration,
        ));
    }
    (!rows.is_empty()).then(|| Section {
        title: "Pairs of generated scenes",
        text: "An illustration only: generated gardens with the scenes' sizes of pictures and within 4 % of their counts of \
               Gaussians, drawn along camera paths of the data set (stump along garden's, counter and kitchen along room's, which alone are \
               at hand), turned and scaled to go around the garden. What lies in front of what decides how many \
               pairs are needed, and in a garden that is another matter, so that nothing here confirms or refutes the pairs that the times imply. Measured by \
               `cargo run --release -p gaurast-bench --example paper_scenes -- CAMERAS > \
               simdevice/timing/studies/generated_scenes.toml`; the test of this document doesn't repeat it."
            .to_owned(),
        rows,
    })
}
