//! PAPER.md is generated, complete and up to date.

#[gaurast_runner::test]
fn the_report_in_the_repository_is_up_to_date() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/PAPER.md");
    let stored = std::fs::read_to_string(path).unwrap();
    let generated = timing_studies::paper::markdown();
    for (line, (stored, generated)) in stored.lines().zip(generated.lines()).enumerate() {
        assert_eq!(
            stored,
            generated,
            "line {}: run `cargo run -p timing-studies --example paper > simdevice/timing/studies/PAPER.md`",
            line + 1
        );
    }
    assert_eq!(stored.lines().count(), generated.lines().count());
}

#[gaurast_runner::test]
fn every_number_of_the_papers_evaluation_has_a_row() {
    let rows: Vec<_> = timing_studies::paper::report()
        .into_iter()
        .flat_map(|section| section.rows)
        .collect();
    let has = |paper: &str| rows.iter().any(|row| row.paper.contains(paper));
    let numbers = [
        "321 ms",
        "15 ms",
        "149 ms",
        "6 ms",
        "232 ms",
        "9.6 ms",
        "236 ms",
        "10.5 ms",
        "216 ms",
        "9.8 ms",
        "269 ms",
        "12.2 ms",
        "147 ms",
        "5.5 ms",
        "23.0x",
        "24.0x",
        "20x",
        "22x",
        "6.00x",
        "24.0",
        "4.00x",
        "46.0",
        "> 80 %",
        "2-5",
        "21.0 %",
        "0.20 %",
        "0.16 mm2",
        "3.95 mm2",
        "24.7x",
        "11.2x",
        "2.6x",
        "1.7 W",
        "10 W",
        "300",
        "68.3 GB/s",
        "102.4 GB/s",
    ];
    for number in numbers {
        assert!(has(number), "{number}");
    }
}
