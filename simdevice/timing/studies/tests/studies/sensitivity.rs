//! Tests that SENSITIVITY.md and its plots are generated and up to date.

use timing_studies::sensitivity;

const HOW: &str = "run `cargo run --release -p gaurast-timing-studies --example sensitivity`";

fn stored(file: &str) -> String {
    let path = format!("{}/{file}", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}; {HOW}"))
}

#[gaurast_runner::test]
fn the_document_and_its_plots_are_up_to_date() {
    let generated = sensitivity::markdown().unwrap();
    let document = stored("SENSITIVITY.md");
    for (stored, generated) in document.lines().zip(generated.lines()) {
        assert_eq!(stored, generated, "{HOW}");
    }
    assert_eq!(document.lines().count(), generated.lines().count(), "{HOW}");
    for sweep in sensitivity::sweeps(&sensitivity::frame()).unwrap() {
        let file = format!("sensitivity/{}.svg", sweep.file);
        assert!(generated.contains(&file));
        assert!(stored(&file) == sweep.svg(), "{file}: {HOW}");
    }
}

#[gaurast_runner::test]
fn the_paper_is_on_every_curve_and_more_is_never_slower() {
    for sweep in sensitivity::sweeps(&sensitivity::frame()).unwrap() {
        assert!(sweep.points.iter().any(|point| point.x == sweep.paper), "{}", sweep.file);
        if matches!(sweep.file, "pes" | "bandwidth") {
            let speed = |at: usize| sweep.points[at].simulation.raster_speedup;
            for at in 1..sweep.points.len() {
                assert!(speed(at) >= 0.99 * speed(at - 1), "{} {at}", sweep.file);
            }
            assert!(sweep.knee().is_some(), "{}", sweep.file);
        }
    }
}
