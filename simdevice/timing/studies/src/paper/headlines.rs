//! The paper's headline numbers: their consequences, their consistency, and the model's values.

use super::numbers::{
    AREA_RATIO, AREA_SOC, BASELINE_FPS, FPS, GSCORE_MM2, GSCORE_RATIO, M2_RATE, M2_SPEEDUP, MODULE_W, MODULES,
    RASTER_ENERGY, RASTER_SHARE, RASTER_SPEEDUP, SCENES, SOC_W, SPEEDUP, mean,
};
use super::table::{Label, Row, Section};
use timing::area;
use timing::config::{Config, ConfigError};
use timing::schedule::{self, Policy, Stages};
use timing::shader_cores;

pub fn sections() -> Vec<Section> {
    let mut sections = vec![raster(), schedules(), inconsistencies()];
    sections.extend(areas());
    sections
}

fn raster() -> Section {
    let ratio = mean(|s| s.baseline_ms / s.gaurast_ms);
    let of_sums = mean(|s| s.baseline_ms) / mean(|s| s.gaurast_ms);
    let watts = MODULES * MODULE_W;
    let rows = vec![
        Row::numbers("raster speed-up, 3DGS", "x", [RASTER_SPEEDUP[0], ratio], 1, Label::Solved)
            .note(format!("mean of the scenes' ratios; ratio of the sums {of_sums:.1}x")),
        Row::numbers("raster energy, 3DGS", "x", [RASTER_ENERGY[0], of_sums * SOC_W / watts], 1, Label::Solved)
            .note("10 W x baseline over 15 x 1.7 W x GauRast; see below"),
        Row::new("raster speed-up, Mini-Splatting", "20x", "20x", Label::Input)
            .note("no times are published; enters the schedules below"),
        Row::new("raster energy, Mini-Splatting", "22x", "", Label::Input).note(format!(
            "no times are published; 20x at 25.5 W against 10 W is {:.1}x",
            RASTER_SPEEDUP[1] * SOC_W / watts
        )),
    ];
    Section { title: "Headlines of the raster stage", text: "From the published times and powers.".to_owned(), rows }
}

/// Frames per second of the schedule model for stages 1-2 and stage 3 of these milliseconds.
fn fps(before: f64, raster: f64, collaborative: bool) -> f64 {
    let stages = Stages { preprocess: before, raster, ..Stages::default() };
    let policy = Policy { collaborative, frames_in_flight: 2, has_rasterizer: true };
    schedule::fps(stages, policy)
}

fn schedules() -> Section {
    let (baseline, ours) = (mean(|s| s.baseline_ms), mean(|s| s.gaurast_ms));
    let mut rows = Vec::new();
    // If pipelined, stages 1-2 are the frame.
    let before = 1e3 / FPS[0];
    let pace = fps(before, ours, true);
    rows.push(
        Row::new("3DGS pipelined: stages 1-2", "", format!("{before:.1} ms"), Label::Solved)
            .note(format!("24 FPS is {before:.1} ms a frame, more than the mean raster {ours:.1} ms")),
    );
    let speedup = pace * (before + baseline) * 1e-3;
    rows.push(
        Row::numbers("3DGS pipelined: end-to-end speed-up", "x", [SPEEDUP[0], speedup], 2, Label::Solved)
            .note(format!("({before:.1} + {baseline:.1}) / {before:.1}")),
    );
    rows.push(
        Row::numbers("3DGS pipelined: FPS", "", [FPS[0], pace], 1, Label::Calibrated).note("by choice of stages 1-2"),
    );
    let share = baseline / (before + baseline);
    rows.push(
        Row::new(
            "3DGS pipelined: raster share of the baseline",
            "> 80 %",
            format!("{:.1} %", share * 100.0),
            Label::Solved,
        )
        .note("mean scene"),
    );
    // If serial, (s + baseline) / (s + ours) is the speed-up.
    let before = (baseline - SPEEDUP[0] * ours) / (SPEEDUP[0] - 1.0);
    rows.push(
        Row::new("3DGS serial: stages 1-2", "", format!("{before:.1} ms"), Label::Solved)
            .note(format!("({baseline:.1} - 6 x {ours:.1}) / 5")),
    );
    let pace = fps(before, ours, false);
    rows.push(
        Row::numbers(
            "3DGS serial: end-to-end speed-up",
            "x",
            [SPEEDUP[0], pace * (before + baseline) * 1e-3],
            2,
            Label::Calibrated,
        )
        .note("by choice of stages 1-2"),
    );
    rows.push(Row::numbers("3DGS serial: FPS", "", [FPS[0], pace], 1, Label::Solved));
    rows.push(
        Row::new(
            "3DGS serial: raster share of the baseline",
            "> 80 %",
            format!("{:.1} %", baseline / (before + baseline) * 100.0),
            Label::Solved,
        )
        .note("mean scene"),
    );
    rows.push(
        Row::new(
            "baseline FPS, 3DGS",
            format!("{}-{}", BASELINE_FPS[0], BASELINE_FPS[1]),
            format!("{:.1}-{:.1}", slowest(41.7), fastest(41.7)),
            Label::Solved,
        )
        .note("with the pipelined stages 1-2 for every scene"),
    );
    rows.extend(mini_splatting());
    Section {
        title: "What the headlines say of the schedule",
        text: "Six times and 24 FPS fit both frames that overlap (6.4x at 24 FPS) and frames that don't (6.0x at 23.3 \
               FPS), so the headlines alone cannot tell the two apart; the paper's text says that they overlap."
            .to_owned(),
        rows,
    }
}

fn slowest(before: f64) -> f64 {
    1e3 / (before + SCENES.iter().map(|s| s.baseline_ms).fold(0.0, f64::max))
}

fn fastest(before: f64) -> f64 {
    1e3 / (before + SCENES.iter().map(|s| s.baseline_ms).fold(f64::INFINITY, f64::min))
}

fn mini_splatting() -> Vec<Row> {
    let frame = 1e3 / FPS[1];
    let baseline = (SPEEDUP[1] - 1.0) * frame;
    let raster = baseline / RASTER_SPEEDUP[1];
    let pace = fps(frame, raster, true);
    let serial_raster = (SPEEDUP[1] - 1.0) * frame / (RASTER_SPEEDUP[1] - 1.0);
    let serial = frame - serial_raster;
    vec![
        Row::new(
            "Mini-Splatting pipelined: stages 1-2, baseline raster, GauRast raster",
            "",
            format!("{frame:.1} / {baseline:.1} / {raster:.1} ms"),
            Label::Solved,
        )
        .note("46 FPS, 4x and 20x"),
        Row::numbers("Mini-Splatting pipelined: FPS", "", [FPS[1], pace], 1, Label::Calibrated),
        Row::numbers(
            "Mini-Splatting pipelined: end-to-end speed-up",
            "x",
            [SPEEDUP[1], pace * (frame + baseline) * 1e-3],
            2,
            Label::Calibrated,
        ),
        Row::new(
            "Mini-Splatting serial: stages 1-2, baseline raster, GauRast raster",
            "",
            format!("{serial:.1} / {:.1} / {serial_raster:.1} ms", serial_raster * RASTER_SPEEDUP[1]),
            Label::Solved,
        )
        .note("the same three headlines, fitted as well"),
        Row::numbers(
            "Mini-Splatting serial: FPS",
            "",
            [FPS[1], fps(serial, serial_raster, false)],
            1,
            Label::Calibrated,
        ),
        Row::new(
            "Mini-Splatting pipelined: raster share of the baseline",
            "",
            format!("{:.1} %", baseline / (frame + baseline) * 100.0),
            Label::Solved,
        ),
    ]
}

fn inconsistencies() -> Section {
    let of_sums = mean(|s| s.baseline_ms) / mean(|s| s.gaurast_ms);
    let watts = MODULES * MODULE_W;
    let needed = of_sums * SOC_W / RASTER_ENERGY[0] / MODULES;
    let bicycle = SCENES[0];
    let mut rows = vec![
        Row::new("PEs", "300", format!("{:.0}", MODULES * 16.0), Label::Contradiction)
            .note("\"15 instances of the 16-PE module\": 15 x 16; 300 would be 15 x 20, or 18.75 modules"),
        Row::numbers("raster energy ratio", "x", [RASTER_ENERGY[0], of_sums * SOC_W / watts], 1, Label::Contradiction)
            .note(format!("15 x 1.7 W = {watts} W, against 10 W: {of_sums:.1} x 10 / {watts}")),
        Row::new("power of a module for 24x", "1.7 W", format!("{needed:.2} W"), Label::Contradiction)
            .note(format!("{of_sums:.1} x 10 W / 24 / 15")),
        Row::numbers(
            "raster energy ratio, if 1.7 W is the whole machine's",
            "x",
            [RASTER_ENERGY[0], of_sums * SOC_W / MODULE_W],
            1,
            Label::Contradiction,
        )
        .note(format!(
            "{of_sums:.1} x 10 W / {MODULE_W} W; a module's is the reading of the text, and neither gives 24x"
        )),
        Row::new("power of the raster stage", format!("{SOC_W} W"), format!("{watts} W"), Label::Contradiction)
            .note("15 x 1.7 W, inside a chip whose mode allows 10 W, if the modules work all the time"),
    ];
    for scene in SCENES.iter().filter(|scene| RASTER_SHARE * 1e3 / scene.baseline_ms > BASELINE_FPS[1]) {
        let fps = RASTER_SHARE * 1e3 / scene.baseline_ms;
        rows.push(
            Row::new(
                format!("{}, baseline FPS if raster is 80 %", scene.name),
                "2-5",
                format!("{fps:.1}"),
                Label::Contradiction,
            )
            .note(format!("0.8 / {} ms; more than 80 % would be faster still", scene.baseline_ms)),
        );
    }
    let over_m2 = bicycle.baseline_ms / M2_RATE / bicycle.gaurast_ms;
    rows.push(
        Row::numbers("bicycle, speed-up over the M2 Pro", "x", [M2_SPEEDUP, over_m2], 1, Label::Contradiction)
            .note(format!("if it is 2.6 times the baseline: {} / 2.6 / {}", bicycle.baseline_ms, bicycle.gaurast_ms)),
    );
    rows.extend(m2_rates().unwrap_or_default());
    Section {
        title: "Where the paper's numbers do not fit together",
        text: "The arithmetic, with no judgement of which number is meant otherwise than it reads.".to_owned(),
        rows,
    }
}

fn m2_rates() -> Result<Vec<Row>, ConfigError> {
    let (pro, paper) = (Config::preset("m2-pro", &[])?, Config::preset("orin-nx-10w", &[])?);
    let m2 = pro.shader.tflops();
    let bicycle = &SCENES[0];
    let stage_3_ms = |config| shader_cores::stage_3_ms(1.0, config);
    let on_m2 = bicycle.baseline_ms * stage_3_ms(&pro) / stage_3_ms(&paper);
    let max = Config::preset("orin-nx-maxn", &[])?.shader.tflops();
    let ten = Config::preset("orin-nx-10w", &[])?.shader.tflops();
    // 16 of 19 cores in the smaller model.
    let small = m2 * 16.0 / 19.0;
    let model = format!("{:.1}-{:.1}x", small / max, m2 / max);
    let note = format!(
        "{small:.1}-{m2:.1} TFLOPS (16 or 19 cores) over {max:.2} in the maximum mode; over {ten:.2} in the 10 W mode it is \
         {:.1}-{:.1}x",
        small / ten,
        m2 / ten
    );
    Ok(vec![
        Row::new(
            "M2 Pro's fp32 rate over the baseline's",
            format!("{M2_RATE}x"),
            model,
            Label::Contradiction,
        )
        .note(note),
        Row::numbers(
            "bicycle, speed-up over the preset m2-pro",
            "x",
            [M2_SPEEDUP, on_m2 / bicycle.gaurast_ms],
            1,
            Label::Calibrated,
        )
        .note(format!(
            "{on_m2:.1} ms with the operations an evaluation of the 10 W mode, on 19 cores; a 2.6 times faster baseline would \
             take {:.1} ms",
            bicycle.baseline_ms / M2_RATE
        )),
    ])
}

/// The section about areas. None if the presets can't be read.
fn areas() -> Option<Section> {
    let config = Config::preset("paper-15x16", &[]).ok()?;
    let area = area::area(&config);
    let [ours, gscore] = GSCORE_MM2;
    let half_per_pe = area.added_half / f64::from(config.rasterizer.pes());
    let rows = vec![
        Row::numbers(
            "area added over the enhanced units",
            " %",
            [AREA_RATIO * 100.0, area.ratio * 100.0],
            1,
            Label::Calibrated,
        )
        .note(format!("by choice of the exponential's area, {:.0} um2 at 28 nm", area.exponential * 1e6)),
        Row::new("area added, 240 PEs, fp32", "", format!("{:.2} mm2", area.added), Label::Calibrated)
            .note("28 nm, arithmetic units alone"),
        Row::numbers(
            "area added over the SoC",
            " %",
            [AREA_SOC * 100.0, area.share_of_soc * 100.0],
            2,
            Label::Calibrated,
        )
        .note(format!(
            "{:.2} mm2 in the SoC's technology (assumed: {} times denser) of {} mm2",
            area.added_in_soc, config.soc.node_scaling, config.soc.area_mm2
        )),
        Row::numbers("area ratio to GSCore", "x", [GSCORE_RATIO, gscore / ours], 1, Label::Solved)
            .note("3.95 / 0.16 mm2; the enhancement alone, GSCore whole"),
        Row::numbers("area added for GSCore's speed, fp16", " mm2", [ours, area.added_half], 2, Label::Calibrated)
            .note(format!("240 PEs with fp16 units; 0.16 mm2 would hold {:.0} PEs", ours / half_per_pe)),
        Row::input("area of GSCore", "3.95 mm2"),
    ];
    Some(Section {
        title: "Area",
        text: "Component counts of Table II times published areas of single units.".to_owned(),
        rows,
    })
}
