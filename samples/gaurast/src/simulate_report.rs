//! What a simulation says, as tables and as lines.

use comfy_table::presets::UTF8_FULL_CONDENSED;
use comfy_table::{CellAlignment, ContentArrangement, Table};
use timing::Config;
use timing::area;
use timing::paper::Section;
use timing::simulate::Simulation;
use timing::work::{FrameWork, TileWork};

fn new_table() -> Table {
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED);
    table
}

fn right(table: &mut Table, columns: std::ops::Range<usize>) {
    for column in columns {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}

fn share(part: f64, whole: f64) -> String {
    let percent = if whole == 0.0 {
        0.0
    } else {
        part / whole * 100.0
    };
    format!("{percent:.1} %")
}

/// Everything about one machine.
pub fn one(frame: &FrameWork, result: &Simulation, config: &Config) -> String {
    let mut table = new_table();
    let mut last = "";
    let mut row = |group: &'static str, name: &str, value: String, note: String| {
        // A group's name stands in its first row.
        let shown = if group == last { "" } else { group };
        last = group;
        table.add_row([shown, name, &value, &note]);
    };
    let none = String::new;
    let ms = |value: f64| format!("{value:.3} ms");
    row(
        "work",
        "size",
        format!("{} x {}", frame.size[0], frame.size[1]),
        none(),
    );
    row("work", "pairs listed", frame.pairs().to_string(), none());
    row(
        "work",
        "pairs taken",
        format!("{:.0}", result.raster.pairs),
        none(),
    );
    let evaluated = [
        (
            "blended",
            result.blended,
            result.raster.gaussian_evaluations,
            "Gaussians'",
        ),
        (
            "covered",
            result.covered,
            result.raster.triangle_evaluations,
            "triangles'",
        ),
    ];
    for (name, changed, evaluations, whose) in evaluated {
        if evaluations > 0.0 {
            let note = format!("of {whose} {evaluations:.0} evaluations");
            row("work", name, share(changed, 1.0), note);
        }
    }
    let tiles = || frame.draws.iter().flat_map(|draw| &draw.tiles);
    let count = |of: fn(&TileWork) -> u32| tiles().map(|tile| u64::from(of(tile))).sum::<u64>();
    let quads = count(|tile| tile.quads);
    if quads > 0 {
        let note = format!(
            "early tests killed {}, and hid {} primitives in whole tiles",
            count(|tile| tile.killed),
            count(TileWork::hidden)
        );
        row("work", "quads shaded", quads.to_string(), note);
    }
    let stages = &result.stages;
    let always = |name: &str| name.starts_with("stage");
    for (name, roofline) in [
        ("dispatches", &result.compute),
        ("stage 1, preprocess", &result.preprocess),
        ("stage 2, sort", &result.sort),
        ("fragment programs", &result.shade),
    ] {
        if !always(name) && roofline.milliseconds() == 0.0 {
            continue;
        }
        let note = format!(
            "compute {:.3}, memory {:.3} ms",
            roofline.compute_ms, roofline.memory_ms
        );
        row("time", name, ms(roofline.milliseconds()), note);
    }
    row(
        "time",
        "stage 3, raster",
        ms(stages.raster),
        format!("{:.0} cycles", result.raster.cycles),
    );
    let modules = &result.raster.modules;
    for (cause, cycles) in modules.by_cause() {
        row("PE cycles", cause, share(cycles, modules.total()), none());
    }
    let gb_s = |bytes: f64| format!("{:.1} GB/s", bytes / stages.raster.max(1e-9) * 1e-6);
    row(
        "memory",
        "primitives",
        gb_s(result.raster.bytes_in),
        share(result.raster.bytes_wasted, result.raster.bytes_in) + " in vain",
    );
    row("memory", "pixels", gb_s(result.raster.bytes_out), none());
    row(
        "memory",
        "shader cores meanwhile",
        format!("{:.1} GB/s", result.contention_gb_s),
        none(),
    );
    row(
        "frames",
        "collaborative",
        format!("{:.1} FPS", result.fps_collaborative),
        none(),
    );
    row(
        "frames",
        "serial",
        format!("{:.1} FPS", result.fps_serial),
        none(),
    );
    row(
        "frames",
        "baseline",
        format!("{:.1} FPS", result.baseline_fps),
        format!("raster {}", ms(result.baseline_raster_ms)),
    );
    row(
        "frames",
        "speed-up",
        format!("{:.2}x", result.speedup),
        format!("raster {:.1}x", result.raster_speedup),
    );
    for (name, millijoules) in result.energy.by_component() {
        row(
            "energy",
            name,
            format!("{millijoules:.2} mJ"),
            share(millijoules, result.energy.total()),
        );
    }
    row(
        "energy",
        "baseline",
        format!("{:.1} mJ", result.baseline_mj),
        format!("{:.1}x", result.baseline_mj / result.energy.total()),
    );
    let area = area::area(config);
    row(
        "area",
        "added by Gaussians",
        format!("{:.3} mm2", area.added),
        share(area.ratio, 1.0) + " of the enhanced units",
    );
    row(
        "area",
        "of the SoC",
        share(area.share_of_soc, 1.0),
        format!("{:.3} mm2 there", area.added_in_soc),
    );
    right(&mut table, 2..3);
    format!("{table}\n")
}

/// The main numbers of a result, and their names.
fn summary(result: &Simulation) -> [(&'static str, f64, usize); 11] {
    [
        ("cycles", result.raster.cycles, 0),
        ("raster ms", result.stages.raster, 3),
        ("utilization", result.raster.utilization(), 3),
        (
            "memory stall",
            result.raster.modules.memory / result.raster.modules.total().max(1.0),
            3,
        ),
        ("FPS", result.fps, 1),
        ("FPS serial", result.fps_serial, 1),
        ("raster speed-up", result.raster_speedup, 2),
        ("speed-up", result.speedup, 2),
        ("modules mJ", result.energy.modules(), 2),
        ("memory mJ", result.energy.memory, 2),
        ("total mJ", result.energy.total(), 2),
    ]
}

/// A row for each machine.
pub fn many(results: &[(String, Simulation)]) -> String {
    let mut table = new_table();
    for (name, result) in results {
        let summary = summary(result);
        if table.header().is_none() {
            let names = summary.iter().map(|(name, ..)| *name);
            table.set_header(std::iter::once("machine").chain(names));
        }
        let values = summary
            .iter()
            .map(|(_, value, decimals)| format!("{value:.decimals$}"));
        table.add_row(std::iter::once(name.clone()).chain(values));
    }
    right(&mut table, 1..12);
    format!("{table}\n")
}

/// The fast model beside the stepped one, a row for each frame.
pub fn compared(frames: &[[f64; 2]]) -> String {
    let mut table = new_table();
    table.set_header(["frame", "fast cycles", "stepped cycles", "difference"]);
    for (number, [fast, stepped]) in frames.iter().enumerate() {
        let difference = if *stepped == 0.0 {
            0.0
        } else {
            (fast / stepped - 1.0) * 100.0
        };
        let values = [
            format!("{fast:.0}"),
            format!("{stepped:.0}"),
            format!("{difference:+.3} %"),
        ];
        table.add_row(std::iter::once(number.to_string()).chain(values));
    }
    right(&mut table, 1..4);
    format!("{table}\n")
}

/// A field of a line, quoted where that is needed.
fn field(text: &str) -> String {
    if text.contains([',', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// A line for each machine.
pub fn csv(results: &[(String, Simulation)]) -> String {
    let mut out = String::new();
    for (index, (name, result)) in results.iter().enumerate() {
        let summary = summary(result);
        if index == 0 {
            let names: Vec<_> = summary.iter().map(|(name, ..)| *name).collect();
            out += &format!("machine,{}\n", names.join(","));
        }
        let values: Vec<_> = summary
            .iter()
            .map(|(_, value, _)| value.to_string())
            .collect();
        out += &format!("{},{}\n", field(name), values.join(","));
    }
    out
}

/// The paper's numbers beside the model's.
pub fn paper(sections: &[Section]) -> String {
    let mut out = String::new();
    for section in sections {
        let mut table = new_table();
        table.set_content_arrangement(ContentArrangement::Dynamic);
        table.set_header(["", "paper", "model", "difference", "label", "how"]);
        for row in &section.rows {
            table.add_row([
                &row.item,
                &row.paper,
                &row.model,
                &row.difference,
                row.label.name(),
                &row.note,
            ]);
        }
        right(&mut table, 1..4);
        out += &format!("{}\n{}\n{table}\n\n", section.title, section.text);
    }
    out
}

/// The same, a line for each number.
pub fn paper_csv(sections: &[Section]) -> String {
    let mut out = "section,item,paper,model,difference,label,how\n".to_owned();
    for section in sections {
        for row in &section.rows {
            let fields = [
                section.title,
                &row.item,
                &row.paper,
                &row.model,
                &row.difference,
                row.label.name(),
                &row.note,
            ];
            out += &(fields.map(field).join(",") + "\n");
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use timing::simulate::{even_frame, simulate};

    #[test]
    fn tables_and_lines_show_what_there_is() {
        let frame = even_frame([320, 200], 50_000, 0.3);
        let config = Config::preset("paper-15x16", &[]).expect("a preset");
        let result = simulate(&frame, &config);
        let text = one(&frame, &result, &config);
        for part in [
            "320 x 200",
            "50000",
            "stage 3, raster",
            "mode switch",
            "FPS",
            "mJ",
            "mm2",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
        let results = [("a,b".to_owned(), result.clone()), ("c".to_owned(), result)];
        assert_eq!(csv(&results).lines().count(), 3);
        assert!(csv(&results).contains("\"a,b\","));
        assert!(many(&results).contains("raster speed-up"));
        let sections = timing::paper::report();
        assert!(paper(&sections).contains("GSCore"));
        let rows: usize = sections.iter().map(|section| section.rows.len()).sum();
        assert_eq!(paper_csv(&sections).lines().count(), rows + 1);
    }
}
