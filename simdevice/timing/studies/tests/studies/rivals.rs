//! Tests that RIVALS.md is up to date and complete, and that the counts behind it agree with each other.

use timing_studies::techniques::measured::Stored;
use timing_studies::techniques::page::{self, TECHNIQUES};

fn stored() -> Stored {
    Stored::load().expect("counts")
}

#[gaurast_runner::test]
fn the_page_in_the_repository_is_up_to_date() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/RIVALS.md");
    let page = std::fs::read_to_string(path).expect("the page");
    let generated = page::markdown(&stored()).expect("presets");
    for (line, (page, generated)) in page.lines().zip(generated.lines()).enumerate() {
        assert_eq!(
            page,
            generated,
            "line {}: run `cargo run -p gaurast-timing-studies --example rivals > simdevice/timing/studies/RIVALS.md`",
            line + 1
        );
    }
    assert_eq!(page.lines().count(), generated.lines().count());
}

#[gaurast_runner::test]
fn each_technique_has_figures_and_what_is_not_testable() {
    let page = page::markdown(&stored()).expect("presets");
    let (figures, rest) = page.split_once("## Not testable here").expect("a chapter");
    let (untestable, formulas) = rest.split_once("## What is counted").expect("a chapter");
    for technique in TECHNIQUES {
        for chapter in [figures, untestable, formulas] {
            assert!(chapter.contains(&format!("\n| {technique} |")), "{technique}");
        }
    }
    assert!(!page.contains("NaN") && !page.contains("inf"));
    // A difference has a reason.
    let rows = figures.lines().filter(|line| line.starts_with("| ") && line.contains(" % |"));
    for row in rows.filter(|row| row.contains("| +") || row.contains("| -")) {
        assert!(!row.ends_with("|  |"), "{row}");
    }
}

#[gaurast_runner::test]
fn the_trace_and_the_geometry_count_the_same() {
    let stored = stored();
    assert!(stored.scenes.len() >= 3 && stored.command.contains("rival_work"));
    for scene in &stored.scenes {
        let near = |trace: u64, geometry: u64, tolerance: f64| {
            let error = (geometry as f64 / trace as f64 - 1.0).abs();
            assert!(error <= tolerance, "{}: {trace} {geometry}", scene.scene);
        };
        near(scene.trace_pairs[0], scene.shape_tests.exact, 0.02);
        near(scene.trace_squares, scene.shape_tests.squares, 0.02);
        near(scene.trace_contributions, scene.merging.open_fragments, 0.02);
        let tests = &scene.shape_tests;
        assert!(tests.boxes <= tests.long_boxes && tests.long_boxes <= tests.squares);
        assert!(scene.merging.merged_quads.is_sorted_by(|a, b| a >= b));
        assert!(scene.conditional.fetches <= scene.trace_pairs[0] && scene.conditional.listed <= scene.drawn);
    }
}

#[gaurast_runner::test]
fn the_ratios_in_the_simulators_page_are_those_of_the_table() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../docs/simulator.md");
    let text = std::fs::read_to_string(path).expect("the document");
    let (_, rest) = text.split_once("**Techniques of other accelerators.**").expect("a paragraph");
    let (table, _) = rest.split_once("\n\n**").expect("a paragraph after it");
    let page = page::markdown(&stored()).expect("presets");
    let is_ratio = |word: &&str| word.ends_with('x') && word.contains('.');
    let ratios: Vec<_> = table.split([' ', ',', ';']).filter(is_ratio).collect();
    assert!(ratios.len() > 15, "{ratios:?}");
    for ratio in ratios {
        assert!(page.contains(&format!(" {ratio} ")), "{ratio}");
    }
}
