//! The range of the predicted frame rate over everything that is assumed, an assumption at a time: a tornado plot.

use super::numbers::{FPS, SCENES};
use super::predicted::{Unpublished, frame};
use super::table::{Label, Row, Section};
use timing::config::{Config, ConfigError, DEFAULT_PRESET};
use timing::simulate::simulate;
use timing::work::FrameWork;

/// The title of the section.
pub const TITLE: &str = "Frames per second, an assumption at a time";

/// A field that the configuration calls assumed, and the least and greatest value that are plausible.
struct Assumed {
    field: &'static str,
    between: [&'static str; 2],
}

const fn assumed(field: &'static str, low: &'static str, high: &'static str) -> Assumed {
    Assumed { field, between: [low, high] }
}

/// The assumed fields. Energies and areas are halved and doubled.
const FIELDS: [Assumed; 28] = [
    assumed("rasterizer.saturation", "none", "reached"),
    assumed("rasterizer.triangle_traversal", "reached", "tile"),
    assumed("rasterizer.hierarchical_depth", "false", "true"),
    assumed("rasterizer.tile_side", "8", "32"),
    assumed("rasterizer.batch", "8", "128"),
    assumed("rasterizer.index_bytes", "2", "8"),
    assumed("rasterizer.port_bytes_per_cycle", "8", "32"),
    assumed("list_writer.cycles_per_pair", "2.5", "10"),
    assumed("list_writer.area_mm2", "0.01", "0.04"),
    assumed("list_writer.pj_per_byte", "0.5", "2"),
    assumed("memory.efficiency", "0.7", "0.95"),
    assumed("memory.latency_ns", "50", "300"),
    assumed("shader.memory_per_cycle", "16", "64"),
    assumed("shader.efficiency", "0.4", "0.8"),
    assumed("baseline.efficiency", "0.7", "1"),
    assumed("soc.area_mm2", "400", "500"),
    assumed("soc.node_scaling", "3", "8"),
    assumed("energy.scale", "1", "3"),
    assumed("energy.leakage_w_per_mm2", "0.1", "0.8"),
    assumed("energy.div_pj", "13", "52"),
    assumed("energy.exp_pj", "3.7", "14.8"),
    assumed("energy.half_div_pj", "3.9", "15.6"),
    assumed("energy.half_exp_pj", "1.1", "4.4"),
    assumed("energy.dram_pj_per_byte", "16", "64"),
    assumed("energy.blended_share", "0.1", "0.5"),
    assumed("area.div_um2", "5000", "20000"),
    assumed("area.sram_um2_per_bit", "0.3", "1.2"),
    assumed("rasterizer.neighbour_sharing", "0", "1"),
];

/// The shares of Gaussians that are in a picture, least and greatest.
const SEEN: [f64; 2] = [0.5, 1.0];

/// Listed pairs a needed pair, most and least.
const LISTED: [f64; 2] = [1.5, 1.0];

/// The frame rates with an assumption at both ends, and between them.
struct Range {
    /// The assumption, with both values.
    name: String,
    fps: [f64; 2],
    /// The frame rate with the preset's value.
    base: f64,
}

impl Range {
    fn least(&self) -> f64 {
        self.fps[0].min(self.fps[1]).min(self.base)
    }

    fn most(&self) -> f64 {
        self.fps[0].max(self.fps[1]).max(self.base)
    }

    fn width(&self) -> f64 {
        self.most() - self.least()
    }
}

/// The parts of a frame, of which one is simulated: all tiles are alike, and there are many.
const PARTS: usize = 16;

/// A part of a frame: its tiles, and as much of stages 1 and 2.
fn part(mut frame: FrameWork) -> FrameWork {
    for draw in &mut frame.draws {
        let kept: Vec<_> = draw.tiles.iter().step_by(PARTS).cloned().collect();
        let pairs = draw.pairs() as f64;
        draw.tiles = kept;
        let share = draw.pairs() as f64 / pairs;
        (draw.preprocess, draw.sort) = (draw.preprocess.times(share), draw.sort.times(share));
    }
    frame
}

/// The mean frame rate of the scenes.
fn fps(unpublished: Unpublished, settings: &[String]) -> Result<f64, ConfigError> {
    let config = Config::preset(DEFAULT_PRESET, settings)?;
    // The pairs follow from the published times, on the paper's machine.
    let paper = Config::preset(DEFAULT_PRESET, &[])?;
    let of = |scene| simulate(&part(frame(scene, unpublished, &paper)), &config).fps / PARTS as f64;
    Ok(SCENES.iter().map(of).sum::<f64>() / SCENES.len() as f64)
}

/// Sections of the configuration that no frame rate depends on.
const OTHERS: [&str; 4] = ["baseline.", "soc.", "energy.", "area."];

fn of_field(assumed: &Assumed, base: f64) -> Result<Range, ConfigError> {
    if OTHERS.iter().any(|section| assumed.field.starts_with(section)) {
        let [low, high] = assumed.between;
        return Ok(Range { name: format!("{}, {low} to {high}", assumed.field), fps: [base; 2], base });
    }
    let at = |value: &str| fps(Unpublished::LEAST, &[format!("{}={value}", assumed.field)]);
    let [low, high] = assumed.between;
    Ok(Range { name: format!("{}, {low} to {high}", assumed.field), fps: [at(low)?, at(high)?], base })
}

fn of_scene(name: String, ends: [Unpublished; 2], base: f64) -> Result<Range, ConfigError> {
    Ok(Range { name, fps: [fps(ends[0], &[])?, fps(ends[1], &[])?], base })
}

/// The ranges of the fields, in their order.
fn of_fields(base: f64) -> Result<Vec<Range>, ConfigError> {
    FIELDS.iter().map(|assumed| of_field(assumed, base)).collect()
}

/// The ranges of what is not published of the scenes.
fn of_scenes(base: f64) -> Result<Vec<Range>, ConfigError> {
    let mut ranges = Vec::new();
    let [least, most] = SEEN;
    let seen = SEEN.map(|seen| Unpublished { seen, ..Unpublished::LEAST });
    ranges.push(of_scene(format!("share of Gaussians seen, {least} to {most}"), seen, base)?);
    let [most, least] = LISTED;
    let listed = LISTED.map(|listed| Unpublished { listed, ..Unpublished::LEAST });
    ranges.push(of_scene(format!("listed a needed pair, {most} to {least}"), listed, base)?);
    Ok(ranges)
}

/// The frame rates with all assumptions at the ends that are worst and best for them.
fn altogether(fields: &[Range], base: f64) -> Result<Range, ConfigError> {
    let mut settings = [Vec::new(), Vec::new()];
    for (assumed, range) in FIELDS.iter().zip(fields) {
        let worst = usize::from(range.fps[1] < range.fps[0]);
        settings[0].push(format!("{}={}", assumed.field, assumed.between[worst]));
        settings[1].push(format!("{}={}", assumed.field, assumed.between[1 - worst]));
    }
    let [worst, best] = settings;
    let least = fps(Unpublished { listed: LISTED[0], seen: SEEN[1] }, &worst)?;
    let most = fps(Unpublished { listed: LISTED[1], seen: SEEN[0] }, &best)?;
    Ok(Range { name: "all of these at once".to_owned(), fps: [least, most], base })
}

/// Characters of a bar's scale.
const COLUMNS: usize = 40;

/// A bar from `range`'s least to its most, on a scale from 0 to `end`, with a mark at its base.
fn bar(range: &Range, end: f64) -> String {
    let column = |value: f64| ((value / end * COLUMNS as f64) as usize).min(COLUMNS - 1);
    let (from, to, middle) = (column(range.least()), column(range.most()), column(range.base));
    let character = |index| match index {
        _ if index == middle => '|',
        _ if (from..=to).contains(&index) => '=',
        _ => '.',
    };
    (0..COLUMNS).map(character).collect()
}

/// The section of the ranges.
///
/// # Errors
/// Returns a [`ConfigError`] if the preset can't be read.
pub fn section() -> Result<Section, ConfigError> {
    let base = fps(Unpublished::LEAST, &[])?;
    let mut ranges = of_fields(base)?;
    let all = altogether(&ranges, base)?;
    ranges.extend(of_scenes(base)?);
    ranges.sort_by(|a, b| b.width().total_cmp(&a.width()));
    let text = format!(
        "The mean frame rate of the seven scenes is {base:.1} with the preset's numbers, and {:.1} to {:.1} over all \
         assumptions at once; the paper says {}. Each row moves one assumption from one end of what is plausible to the \
         other. Bars begin at 0, and the mark is the preset's. Assumptions of energy, area and the baseline are here \
         because the configuration has them; they don't move the frame rate.",
        all.least(),
        all.most(),
        FPS[0]
    );
    let end = all.most();
    ranges.insert(0, all);
    let row = |range: &Range| {
        let value = format!("{:.1} to {:.1}", range.least(), range.most());
        Row::new(range.name.clone(), "", value, Label::Assumed).note(format!("`{}`", bar(range, end)))
    };
    Ok(Section { title: TITLE, text, rows: ranges.iter().map(row).collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_field_that_the_preset_calls_assumed_has_a_range() {
        let text = include_str!("../../../presets/paper-15x16.toml");
        let mut section = "";
        let mut count = 0;
        // "The same" continues the line before.
        for line in text.lines() {
            if let Some(name) = line.strip_prefix('[') {
                section = name.trim_end_matches(']');
            }
            let Some((field, rest)) = line.split_once(" = ").filter(|_| !line.starts_with('#')) else {
                continue;
            };
            if rest.split_once('#').is_some_and(|(_, comment)| comment.contains("assumed")) {
                let full = format!("{section}.{}", field.trim());
                assert!(FIELDS.iter().any(|assumed| assumed.field == full), "{full}");
                count += 1;
            }
        }
        assert!(count > 15, "{count}");
    }

    #[test]
    fn the_range_of_all_is_the_widest_and_has_the_papers_frame_rate() {
        let base = fps(Unpublished::LEAST, &[]).unwrap();
        let fields = of_fields(base).unwrap();
        let all = altogether(&fields, base).unwrap();
        for range in fields.into_iter().chain(of_scenes(base).unwrap()) {
            assert!(all.least() <= range.least() + 1e-9 && all.most() >= range.most() - 1e-9, "{}", range.name);
        }
        assert!(all.least() < FPS[0] && all.most() > FPS[0], "{:?}", all.fps);
    }

    #[test]
    fn a_part_has_the_frame_rate_of_the_whole() {
        let config = Config::preset(DEFAULT_PRESET, &[]).unwrap();
        let whole = frame(&SCENES[6], Unpublished::LEAST, &config);
        let [whole, part] = [simulate(&whole, &config).fps, simulate(&part(whole), &config).fps / PARTS as f64];
        assert!((part / whole - 1.0).abs() < 0.01, "{part} {whole}");
    }

    #[test]
    fn other_sections_move_no_frame_rate() {
        let base = fps(Unpublished::LEAST, &[]).unwrap();
        let others = FIELDS.iter().filter(|assumed| OTHERS.iter().any(|section| assumed.field.starts_with(section)));
        let settings: Vec<_> = others.map(|assumed| format!("{}={}", assumed.field, assumed.between[1])).collect();
        assert!(settings.len() > 8);
        assert_eq!(fps(Unpublished::LEAST, &settings).unwrap(), base);
    }

    #[test]
    fn bars_span_their_range() {
        let range = Range { name: String::new(), fps: [30.0, 10.0], base: 20.0 };
        let bar = bar(&range, 40.0);
        assert_eq!(bar, "..........==========|==========.........");
    }
}
