//! Tests that PAPER.md is generated, complete and up to date.

use std::sync::LazyLock;
use timing_studies::paper::{AT_A_GLANCE, Label, Section, TORNADO};

/// The report, which takes ten seconds.
static REPORT: LazyLock<Vec<Section>> = LazyLock::new(timing_studies::paper::report);

#[gaurast_runner::test]
fn the_report_in_the_repository_is_up_to_date() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/PAPER.md");
    let stored = std::fs::read_to_string(path).unwrap();
    let generated = timing_studies::paper::markdown(&REPORT);
    for (line, (stored, generated)) in stored.lines().zip(generated.lines()).enumerate() {
        assert_eq!(
            stored,
            generated,
            "line {}: run `cargo run -p gaurast-timing-studies --example paper > simdevice/timing/studies/PAPER.md`",
            line + 1
        );
    }
    assert_eq!(stored.lines().count(), generated.lines().count());
}

#[gaurast_runner::test]
fn every_number_of_the_papers_evaluation_has_a_row() {
    let rows: Vec<_> =
        REPORT.iter().filter(|section| section.title != AT_A_GLANCE).flat_map(|section| &section.rows).collect();
    let scenes = [
        ("bicycle", "321 ms", "15 ms"),
        ("stump", "149 ms", "6 ms"),
        ("garden", "232 ms", "9.6 ms"),
        ("room", "236 ms", "10.5 ms"),
        ("counter", "216 ms", "9.8 ms"),
        ("kitchen", "269 ms", "12.2 ms"),
        ("bonsai", "147 ms", "5.5 ms"),
    ];
    let mut numbers = vec![
        ("raster speed-up, 3DGS".to_owned(), "23.0x", Label::Solved),
        ("raster energy, 3DGS".to_owned(), "24.0x", Label::Solved),
    ];
    for (name, baseline, ours) in scenes {
        numbers.push((format!("{name}, baseline raster"), baseline, Label::Input));
        numbers.push((format!("{name}, GauRast raster"), ours, Label::Input));
    }
    let others = [
        ("raster speed-up, Mini-Splatting", "20x", Label::Input),
        ("raster energy, Mini-Splatting", "22x", Label::Input),
        ("FPS, 1.0 listed a needed pair", "24.0", Label::Predicted),
        ("end-to-end speed-up, 1.0 listed a needed pair", "6.00x", Label::Predicted),
        ("Mini-Splatting pipelined: FPS", "46.0", Label::Calibrated),
        ("Mini-Splatting pipelined: end-to-end speed-up", "4.00x", Label::Calibrated),
        ("3DGS pipelined: raster share of the baseline", "> 80 %", Label::Solved),
        ("baseline FPS, 3DGS", "2-5", Label::Solved),
        ("area added over the enhanced units", "21.0 %", Label::Calibrated),
        ("area added over the SoC", "0.20 %", Label::Calibrated),
        ("area added for GSCore's speed, fp16", "0.16 mm2", Label::Calibrated),
        ("area of GSCore", "3.95 mm2", Label::Input),
        ("area ratio to GSCore", "24.7x", Label::Solved),
        ("speed-up of GSCore over Xavier NX", "20x", Label::Input),
        ("speed-up of GSCore over a mobile GPU", "", Label::Cited),
        ("bicycle, speed-up over the M2 Pro", "11.2x", Label::Contradiction),
        ("bicycle, speed-up over the preset m2-pro", "11.2x", Label::Calibrated),
        ("M2 Pro's fp32 rate over the baseline's", "2.6x", Label::Contradiction),
        ("typical power of a module", "1.7 W", Label::Input),
        ("SoC power", "10 W", Label::Input),
        ("PEs of the scaled design", "300", Label::Contradiction),
        ("bandwidth, 10 W mode", "", Label::Cited),
        ("bandwidth, maximum mode", "", Label::Cited),
        ("tile side", "", Label::Cited),
        ("cycles between pixels of a PE", "", Label::Solved),
        ("Gaussians of the scenes", "", Label::Cited),
    ];
    numbers.extend(others.map(|(item, paper, label)| (item.to_owned(), paper, label)));
    for (item, paper, label) in numbers {
        let of_it: Vec<_> = rows.iter().filter(|row| row.item == item).collect();
        assert_eq!(of_it.len(), 1, "{item}");
        assert_eq!((of_it[0].paper.as_str(), of_it[0].label), (paper, label), "{item}");
    }
}

#[gaurast_runner::test]
fn the_first_screen_has_predictions_then_assumptions_fits_and_inputs() {
    let (first, others) = REPORT.split_first().expect("a section");
    assert_eq!(first.title, AT_A_GLANCE);
    // A screen has fifty lines.
    assert!(first.rows.len() <= 40, "{}", first.rows.len());
    let order = [
        Label::Predicted,
        Label::Assumed,
        Label::Fit,
        Label::Calibrated,
        Label::Solved,
        Label::Contradiction,
        Label::Input,
    ];
    let place = |label| order.iter().position(|&known| known == label);
    let places: Vec<_> = first.rows.iter().map(|row| place(row.label)).collect();
    assert!(places.is_sorted() && places.iter().all(Option::is_some));
    assert!((0..order.len()).all(|place| places.contains(&Some(place))));
    for row in &first.rows {
        if row.label == Label::Predicted {
            assert!(!row.note.is_empty(), "{}", row.item);
            assert_eq!(row.difference.is_empty(), row.paper.is_empty(), "{}", row.item);
        }
        // The row is that of a section below; only the raster times are put together.
        let mut below = others.iter().flat_map(|section| &section.rows);
        let is_together = row.item == "raster times of seven scenes";
        assert_eq!(below.any(|other| other == row), !is_together, "{}", row.item);
    }
    // No row that should be shown is missing: these, and the raster times.
    assert_eq!(first.rows.len(), 32);
}

#[gaurast_runner::test]
fn the_first_rows_are_predictions_and_say_how_far_off_they_are() {
    let report = &REPORT[1..];
    assert_eq!(report[0].title, "Frames, predicted");
    for row in &report[0].rows {
        // A bound is held against nothing.
        let is_bound = row.item.contains("without a raster stage");
        assert_eq!(row.label, if is_bound { Label::Bound } else { Label::Predicted }, "{}", row.item);
        assert!(!is_bound || row.paper.is_empty(), "{}", row.item);
        assert_eq!(row.difference.is_empty(), row.paper.is_empty(), "{}", row.item);
    }
    let differences = report[0].rows.iter().filter(|row| row.difference.ends_with(" %")).count();
    assert_eq!(differences, 4);
    assert_eq!(report[1].title, TORNADO);
    let cell = |item: &str| {
        let row = report[0].rows.iter().find(|row| row.item == item);
        row.map(|row| row.model.clone()).unwrap_or_else(|| panic!("{item}"))
    };
    // No rasterizer exceeds the bound.
    let number = |item: &str| cell(item).trim_end_matches('x').parse::<f64>().unwrap();
    for listed in ["1.0", "1.5"] {
        let paired = format!("{listed} listed a needed pair");
        assert!(number(&format!("FPS, {paired}")) <= number(&format!("FPS without a raster stage, {paired}")));
    }
}
