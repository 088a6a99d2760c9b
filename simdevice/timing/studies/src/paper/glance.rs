//! The first section of the report: its main numbers, in the order of how much they say of the model.

use super::numbers::SCENES;
use super::table::{Label, Row, Section};

/// The title of the section.
pub const TITLE: &str = "At a glance";

/// The labels of the section's rows, in order, and the items of other sections that have them.
const SHOWN: [(Label, &[&str]); 4] = [
    (
        Label::Predicted,
        &[
            "FPS without a raster stage, 1.0 listed a needed pair",
            "FPS, 1.0 listed a needed pair",
            "end-to-end speed-up, 1.0 listed a needed pair",
            "FPS, 1.5 listed a needed pair",
            "end-to-end speed-up, 1.5 listed a needed pair",
            "mean error: SIMT machine, each warp blends",
            "mean error: SIMT machine, no warp blends",
            "mean error: line through the other scenes (null)",
        ],
    ),
    (
        Label::Calibrated,
        &[
            "operations of a shader core per evaluation",
            "area added over the enhanced units",
            "area added over the SoC",
            "area added for GSCore's speed, fp16",
            "bicycle, speed-up over the preset m2-pro",
            "Mini-Splatting pipelined: FPS",
            "Mini-Splatting pipelined: end-to-end speed-up",
        ],
    ),
    (Label::Solved, &["raster speed-up, 3DGS", "raster energy, 3DGS", "baseline FPS, 3DGS", "area ratio to GSCore"]),
    (
        Label::Input,
        &["modules of the scaled design", "PEs of a module", "clock", "typical power of a module", "SoC power"],
    ),
];

/// The section, of the rows of the others.
pub fn section(report: &[Section]) -> Section {
    let rows = || report.iter().flat_map(|section| &section.rows);
    let found = |item: &str, label: Label| rows().find(|row| row.item == item && row.label == label).cloned();
    let mut shown = Vec::new();
    for (label, items) in SHOWN {
        shown.extend(items.iter().filter_map(|item| found(item, label)));
    }
    shown.push(raster_times());
    let of_paper = |label| {
        let counted = |row: &&Row| row.label == label && !row.paper.is_empty();
        rows().filter(counted).count()
    };
    let [predicted, calibrated, solved, input] = SHOWN.map(|(label, _)| of_paper(label));
    Section {
        title: TITLE,
        text: format!(
            "The main rows of the tables below: what the model predicts, from what, and how far off it is; then what it was \
             calibrated for; then what follows from the paper's numbers alone; then what goes in. Below, {predicted} numbers \
             of the paper are predicted, {calibrated} calibrated, {solved} solved and {input} go in."
        ),
        rows: shown,
    }
}

/// The row for the published raster times.
fn raster_times() -> Row {
    let range = |times: [f64; SCENES.len()]| {
        let least = times.iter().copied().fold(f64::INFINITY, f64::min);
        let most = times.iter().copied().fold(0.0, f64::max);
        format!("{least}-{most} ms")
    };
    let baseline = range(SCENES.map(|scene| scene.baseline_ms));
    let ours = range(SCENES.map(|scene| scene.gaurast_ms));
    Row::input("raster times of seven scenes", format!("{baseline}; {ours}"))
        .note("the baseline's; GauRast's. Pairs of a tile and a Gaussian are solved from the latter")
}
