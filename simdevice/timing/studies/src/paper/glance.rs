//! The first section of the report: its main numbers, in the order of how much they say of the model.

use super::numbers::SCENES;
use super::table::{Label, Row, Section};
use super::tornado;

/// The number of ranges of assumptions that are shown, with that of all at once.
const WIDEST: usize = 6;

/// The title of the section.
pub const TITLE: &str = "At a glance";

/// The labels of the section's rows, in order, and the items of other sections that have them.
const SHOWN: [(Label, &[&str]); 6] = [
    (
        Label::Predicted,
        &[
            "FPS, 1.0 listed a needed pair",
            "end-to-end speed-up, 1.0 listed a needed pair",
            "FPS, 1.5 listed a needed pair",
            "end-to-end speed-up, 1.5 listed a needed pair",
        ],
    ),
    (Label::Fit, &["mean error: line through the other scenes (null)"]),
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
        Label::Contradiction,
        &[
            "PEs",
            "raster energy ratio",
            "raster energy ratio, if 1.7 W is the whole machine's",
            "power of the raster stage",
        ],
    ),
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
        if label == Label::Predicted {
            let tornado = report.iter().filter(|section| section.title == tornado::TITLE);
            shown.extend(tornado.flat_map(|section| &section.rows).take(WIDEST).cloned());
        }
    }
    shown.push(raster_times());
    let of_paper = |label| {
        let counted = |row: &&Row| row.label == label && !row.paper.is_empty();
        rows().filter(counted).count()
    };
    let [predicted, fit, calibrated, solved, contradiction, input] = SHOWN.map(|(label, _)| of_paper(label));
    Section {
        title: TITLE,
        text: format!(
            "The main rows of the tables below: what the model predicts, from what, and how far off it is; the range of the \
             frame rate over all that is assumed, and the assumptions that move it most; a fit; what the model was calibrated \
             for; what follows from the paper's numbers alone; what contradicts itself in them; and what goes in. Below, \
             {predicted} numbers of the paper are predicted, {fit} fitted, {calibrated} calibrated, {solved} solved, \
             {contradiction} contradict others and {input} go in."
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
