//! Reports of a simulation, as tables and as lines.

use comfy_table::presets::UTF8_FULL_CONDENSED;
use comfy_table::{CellAlignment, ContentArrangement, Table};
use timing::Config;
use timing::area;
use timing::dram::{Dram, Timings};
use timing::energy::PAPER_MODULE_W;
use timing::fast::TileSpan;
use timing::raster::RasterReport;
use timing::simulate::Simulation;
use timing::work::{FrameWork, TileWork};
use timing_studies::paper::Section;
use timing_studies::{rivals, simt};

use crate::simulate_machines::MachineResult;

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
    let percent = if whole == 0.0 { 0.0 } else { part / whole * 100.0 };
    format!("{percent:.1} %")
}

/// The full report on one machine.
pub fn one(frame: &FrameWork, result: &Simulation, config: &Config, spans: &[TileSpan]) -> String {
    let mut table = new_table();
    let mut last = "";
    let mut row = |group: &'static str, name: &str, value: String, note: String| {
        // A group's name is in its first row.
        let shown = if group == last { "" } else { group };
        last = group;
        table.add_row([shown, name, &value, &note]);
    };
    let none = String::new;
    let ms = |value: f64| format!("{value:.3} ms");
    row("work", "size", format!("{} x {}", frame.size[0], frame.size[1]), none());
    row("work", "pairs listed", frame.pairs().to_string(), none());
    row("work", "pairs taken", format!("{:.0}", result.raster.pairs), none());
    let evaluated = [
        ("blended", result.blended, result.raster.gaussian_evaluations, "Gaussians'"),
        ("covered", result.covered, result.raster.triangle_evaluations, "triangles'"),
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
        let note = format!("compute {:.3}, memory {:.3} ms", roofline.compute_ms, roofline.memory_ms);
        row("time", name, ms(roofline.milliseconds()), note);
    }
    if result.lists.bytes > 0.0 {
        let note = format!("{:.1} MB; a unit writes records into lists", result.lists.bytes * 1e-6);
        row("time", "list writer", ms(stages.lists), note);
    }
    row("time", "stage 3, raster", ms(stages.raster), format!("{:.0} cycles", result.raster.cycles));
    row(
        "time",
        "stage 3, a frame alone",
        ms(result.stages_alone.raster),
        format!("{:.0} cycles", result.raster_alone.cycles),
    );
    let (modules, alone) = (&result.raster.modules, &result.raster_alone.modules);
    for ((cause, cycles), (_, in_one)) in modules.by_cause().into_iter().zip(alone.by_cause()) {
        let note = share(in_one, alone.total()) + " of a frame alone";
        row("PE cycles", cause, share(cycles, modules.total()), note);
    }
    let gb_s = |bytes: f64| format!("{:.1} GB/s", bytes / stages.raster.max(1e-9) * 1e-6);
    row(
        "memory",
        "primitives",
        gb_s(result.raster.bytes_in),
        share(result.raster.bytes_wasted, result.raster.bytes_in) + " in vain",
    );
    row("memory", "pixels", gb_s(result.raster.bytes_out), none());
    let streams = config.memory.bandwidth_gb_s * config.memory.efficiency;
    let note = format!("of {:.1} GB/s that they ask for; streams get {streams:.1} GB/s", result.contention_gb_s);
    row("memory", "shader cores meanwhile", format!("{:.1} GB/s", result.meanwhile_gb_s), note);
    let raster = &config.rasterizer;
    let batch = u64::from(raster.batch * raster.primitive_bytes());
    let by_banks = Dram::lists_gb_s(Timings::LPDDR5, raster.modules.max(1), batch);
    let note = format!("of {:.1} GB/s; lists of all modules, {batch} bytes at a time", Timings::LPDDR5.peak_gb_s());
    row("memory", "LPDDR5 by banks and rows", format!("{by_banks:.1} GB/s"), note);
    row("memory", "not counted", none(), "copies, clears, loads and stores of attachments, depth".to_owned());
    if let Some(longest) = longest(spans) {
        let cycles = longest.end - longest.begin;
        let part = cycles / result.raster_alone.cycles.max(1.0);
        let alone = share(part, 1.0) + " of the stage";
        row("tiles", "longest", format!("{cycles:.0} cycles"), alone);
        if part > MOST_OF_THE_TIME {
            let [x, y] = longest.at;
            let note = "takes most of the stage: more modules would wait for it".to_owned();
            row("tiles", "warning", format!("tile {x},{y}"), note);
        }
    }
    row("frames", "collaborative", format!("{:.1} FPS", result.fps_collaborative), none());
    row("frames", "serial", format!("{:.1} FPS", result.fps_serial), none());
    row(
        "frames",
        "baseline",
        format!("{:.1} FPS", result.baseline_fps),
        format!("raster {}", ms(result.baseline_raster_ms)),
    );
    row("frames", "speed-up", format!("{:.2}x", result.speedup), none());
    if result.raster.gaussian_evaluations > 0.0 {
        let squares = frame.with_squares();
        let threads = simt::simulate(&squares, config);
        let note = format!("{} of the warps blend; tail {}", share(threads.blended, 1.0), ms(threads.tail_ms));
        row("baseline", "as a SIMT machine", ms(threads.milliseconds()), note);
        let quads = rivals::quads(frame, config);
        let note = format!("{:.0} fragments; {} limits", quads.fragments, quads.limit());
        row("baseline", "as blended quads", ms(quads.milliseconds()), note);
    }
    let gains = &result.gains;
    for (name, factor, note) in [
        ("raster speed-up", result.raster_speedup, "product of:"),
        ("hardware", gains.hardware, "on the same lists, without stalls; calibrated: the paper's raster times"),
        ("lists", gains.lists, "the rasterizer's instead of the baseline's"),
        ("stalls", gains.stalls, "PEs busy while they are theirs"),
    ] {
        row("raster", name, format!("{factor:.2}x"), note.to_owned());
    }
    let note = "less than 3-sigma squares, on shader cores; no part of the product if both sides have the same";
    row("raster", "exact lists", format!("{:.2}x", result.exact_lists), note.to_owned());
    for (name, millijoules) in result.energy.by_component() {
        row("energy", name, format!("{millijoules:.2} mJ"), share(millijoules, result.energy.total()));
    }
    row(
        "energy",
        "baseline",
        format!("{:.1} mJ", result.baseline_mj),
        format!("{:.1}x", result.baseline_mj / result.energy.total()),
    );
    let power = &result.power;
    let budget = config.soc.power_w;
    let verdict = if power.exceeds_budget(config) { "warning: above" } else { "within" };
    row("power", "mean of the frame", format!("{:.1} W", power.frame_w), format!("{verdict} the budget of {budget} W"));
    let paper = f64::from(config.rasterizer.modules) * PAPER_MODULE_W;
    let note = format!("no budget: it lasts {}; {PAPER_MODULE_W} W a module would be {paper:.1} W", ms(stages.raster));
    row("power", "raster stage", format!("{:.1} W", power.raster_w), note);
    let area = area::area(config);
    let note = format!("{:.0} % buffers; {:.3} mm2 a module", area.buffers / area.module * 100.0, area.module);
    row("area", "modules", format!("{:.3} mm2", area.module * f64::from(config.rasterizer.modules)), note);
    row(
        "area",
        "added by Gaussians",
        format!("{:.3} mm2", area.added),
        share(area.ratio, 1.0) + " of the enhanced units",
    );
    row("area", "of the SoC", share(area.share_of_soc, 1.0), format!("{:.3} mm2 there", area.added_in_soc));
    right(&mut table, 2..3);
    format!("{table}\n")
}

/// The share of the stage's time above which a single tile is reported.
const MOST_OF_THE_TIME: f64 = 0.5;

/// The tile with the most cycles.
fn longest(spans: &[TileSpan]) -> Option<&TileSpan> {
    let cycles = |span: &TileSpan| span.end - span.begin;
    spans.iter().max_by(|a, b| cycles(a).total_cmp(&cycles(b)))
}

/// The main numbers of a result, each with its name and its number of digits.
fn summary(result: &MachineResult) -> [(&'static str, f64, usize); 17] {
    let area = area::area(&result.machine.config);
    let result = &result.simulation;
    [
        ("cycles", result.raster.cycles, 0),
        ("raster ms", result.stages.raster, 3),
        ("utilization", result.raster.utilization(), 3),
        ("memory stall", result.raster.modules.memory / result.raster.modules.total().max(1.0), 3),
        ("FPS", result.fps, 1),
        ("FPS serial", result.fps_serial, 1),
        ("raster speed-up", result.raster_speedup, 2),
        ("hardware", result.gains.hardware, 2),
        ("lists", result.gains.lists, 2),
        ("stalls", result.gains.stalls, 2),
        ("speed-up", result.speedup, 2),
        ("modules mJ", result.energy.modules(), 2),
        ("memory mJ", result.energy.memory, 2),
        ("total mJ", result.energy.total(), 2),
        ("frame W", result.power.frame_w, 2),
        ("raster W", result.power.raster_w, 2),
        ("added mm2", area.added, 3),
    ]
}

/// A row for each machine, and a warning if the power of some exceeds their budgets.
pub fn many(results: &[MachineResult]) -> String {
    let mut table = new_table();
    for result in results {
        let summary = summary(result);
        if table.header().is_none() {
            let names = summary.iter().map(|(name, ..)| *name);
            table.set_header(std::iter::once("machine").chain(names));
        }
        let values = summary.iter().map(|(_, value, decimals)| format!("{value:.decimals$}"));
        table.add_row(std::iter::once(result.machine.name.clone()).chain(values));
    }
    right(&mut table, 1..18);
    let over = results.iter().filter(|result| result.simulation.power.exceeds_budget(&result.machine.config)).count();
    let warning = match over {
        0 => String::new(),
        _ => format!("warning: of {over} of {} rows the frame's mean power is above soc.power_w\n", results.len()),
    };
    format!("{table}\n{warning}")
}

/// The cycles of a frame by the fast model and by the stepped one.
#[derive(Debug)]
pub struct Compared {
    /// The frame's number, from 0.
    pub frame: usize,
    /// The word for a single frame or for overlapping frames.
    pub how: &'static str,
    pub fast: RasterReport,
    pub stepped: RasterReport,
}

/// A table of both models: cycles, and the share of each cause of stalls.
pub fn compared(frames: &[Compared]) -> String {
    let mut table = new_table();
    table.set_header(["frame", "", "", "fast", "stepped", "difference"]);
    for frame in frames {
        let (fast, stepped) = (&frame.fast, &frame.stepped);
        let difference = if stepped.cycles == 0.0 { 0.0 } else { (fast.cycles / stepped.cycles - 1.0) * 100.0 };
        table.add_row([
            frame.frame.to_string(),
            frame.how.to_owned(),
            "cycles".to_owned(),
            format!("{:.0}", fast.cycles),
            format!("{:.0}", stepped.cycles),
            format!("{difference:+.3} %"),
        ]);
        let causes = fast.modules.by_cause().into_iter();
        for ((cause, ours), (_, theirs)) in causes.zip(stepped.modules.by_cause()) {
            let of = |part: f64, report: &RasterReport| match report.modules.total() {
                0.0 => 0.0,
                total => part / total * 100.0,
            };
            let (ours, theirs) = (of(ours, fast), of(theirs, stepped));
            table.add_row([
                String::new(),
                String::new(),
                cause.to_owned(),
                format!("{ours:.1} %"),
                format!("{theirs:.1} %"),
                format!("{:+.1}", ours - theirs),
            ]);
        }
    }
    right(&mut table, 3..6);
    format!("{table}\n")
}

/// A field of a CSV line, quoted if necessary.
fn field(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

/// A CSV line for each machine.
pub fn csv(results: &[MachineResult]) -> String {
    let mut out = String::new();
    for (index, result) in results.iter().enumerate() {
        let summary = summary(result);
        if index == 0 {
            let names: Vec<_> = summary.iter().map(|(name, ..)| *name).collect();
            out += &format!("machine,{}\n", names.join(","));
        }
        let values: Vec<_> = summary.iter().map(|(_, value, _)| value.to_string()).collect();
        out += &format!("{},{}\n", field(&result.machine.name), values.join(","));
    }
    out
}

/// A table of the paper's numbers and the model's.
pub fn paper(sections: &[Section]) -> String {
    let mut out = String::new();
    for section in sections {
        let mut table = new_table();
        table.set_content_arrangement(ContentArrangement::Dynamic);
        table.set_header(["", "paper", "model", "difference", "label", "how"]);
        for row in &section.rows {
            table.add_row([&row.item, &row.paper, &row.model, &row.difference, row.label.name(), &row.note]);
        }
        right(&mut table, 1..4);
        out += &format!("{}\n{}\n{table}\n\n", section.title, section.text);
    }
    out
}

/// The same numbers as CSV, one line each.
pub fn paper_csv(sections: &[Section]) -> String {
    let mut out = "section,item,paper,model,difference,label,how\n".to_owned();
    for section in sections {
        for row in &section.rows {
            let fields =
                [section.title, &row.item, &row.paper, &row.model, &row.difference, row.label.name(), &row.note];
            out += &(fields.map(field).join(",") + "\n");
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate_machines::simulate_all;
    use crate::simulate_machines::tests::{machines, trace};
    use timing::simulate::{even_frame, simulate};

    #[test]
    fn tables_and_lines_show_what_there_is() {
        let frame = even_frame([320, 200], 50_000, 0.3);
        let config = Config::preset("paper-15x16", &[]).expect("a preset");
        let result = simulate(&frame, &config);
        let (_, spans) = timing::fast::rasterize_tiles(&frame, &config, 0.0);
        let text = one(&frame, &result, &config, &spans);
        assert!(!text.contains("takes most of the stage"), "{text}");
        let alone = [TileSpan { end: result.raster_alone.cycles, ..spans[0] }];
        assert!(one(&frame, &result, &config, &alone).contains("takes most of the stage"));
        let result_gains = result.gains;
        for part in ["320 x 200", "50000", "stage 3, raster", "mode switch", "FPS", "mJ", "mm2"] {
            assert!(text.contains(part), "{part}: {text}");
        }
        let mut results = simulate_all(&trace(frame), &machines(&["modules=15", "modules=16"]));
        results[0].machine.name = "a,b".to_owned();
        // Compares whole rows.
        let cell = |row: &str, column: usize| -> String {
            let line = text.lines().find(|line| line.split('┆').nth(1).is_some_and(|name| name.trim() == row));
            let line = line.unwrap_or_else(|| panic!("{row}: {text}"));
            line.split('┆').nth(column).unwrap_or_default().trim_matches([' ', '│']).to_owned()
        };
        assert_eq!(cell("lists", 2), "1.00x");
        let gains = result_gains.hardware * result_gains.stalls;
        assert_eq!(cell("raster speed-up", 2), format!("{gains:.2}x"));
        assert_eq!(cell("dependency", 3), "0.0 % of a frame alone");
        let lines = csv(&results);
        assert_eq!(lines.lines().count(), 3);
        assert!(lines.contains("\"a,b\",") && lines.contains(",added mm2\n"));
        assert!(many(&results).contains("raster speed-up"));
        // The shader cores do nothing in this frame, and the modules draw more than the chip may.
        assert!(many(&results).contains("of 2 of 2 rows"), "{}", many(&results));
        assert!(cell("mean of the frame", 3).starts_with("warning: above the budget of 10 W"));
        assert!(cell("raster stage", 3).ends_with("1.7 W a module would be 25.5 W"));
        let sections = timing_studies::paper::report();
        assert!(paper(&sections).contains("GSCore"));
        let rows: usize = sections.iter().map(|section| section.rows.len()).sum();
        assert_eq!(paper_csv(&sections).lines().count(), rows + 1);
    }
}
