//! The comparison with what the papers of the techniques say, in Markdown.

use super::axis_sharing::EXPONENT;
use super::measured::{SceneWork, Stored};
use super::order_reuse::ReuseFigures;
use super::quad_merging::BINS;
use std::fmt::Write as _;
use timing::config::{Config, ConfigError};

/// The unit of a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Unit {
    /// A ratio.
    Times,
    /// A share.
    Percent,
    /// Places of a list.
    Places,
}

impl Unit {
    fn text(self, value: f64) -> String {
        match self {
            Self::Times => format!("{value:.2}x"),
            Self::Percent => format!("{:.1} %", 100.0 * value),
            Self::Places => format!("{value:.0}"),
        }
    }
}

/// A figure of a technique: the paper's, and this project's in each scene.
struct Row {
    technique: &'static str,
    figure: String,
    unit: Unit,
    /// The paper's figure, if one could be read.
    paper: Option<f64>,
    /// The place of the paper's figure.
    place: &'static str,
    ours: Vec<f64>,
    /// The reason for the difference.
    reason: &'static str,
}

impl Row {
    fn new(technique: &'static str, figure: impl Into<String>, unit: Unit, ours: Vec<f64>) -> Self {
        Self { technique, figure: figure.into(), unit, paper: None, place: "", ours, reason: "" }
    }

    /// The row with the paper's figure and its place.
    fn paper(self, value: f64, place: &'static str) -> Self {
        Self { paper: Some(value), place, ..self }
    }

    /// The row with the reason for the difference, or with what it shows.
    fn reason(self, reason: &'static str) -> Self {
        Self { reason, ..self }
    }

    /// The difference of the scenes' mean from the paper's figure.
    fn difference(&self) -> String {
        let mean = self.ours.iter().sum::<f64>() / self.ours.len() as f64;
        self.paper.map_or_else(String::new, |paper| format!("{:+.0} %", 100.0 * (mean / paper - 1.0)))
    }
}

/// The place in [`BINS`] of the capacity whose merging is nearest to the paper's.
const SPEED_UP_BIN: usize = 1;

const VR_PIPE: &str = "VR-Pipe";
const AXES: &str = "axis-shared terms";
const GSCORE: &str = "GSCore";
const NEO: &str = "Neo";
const VORION: &str = "Vorion";
const GBU: &str = "GBU";
const GCC: &str = "GCC";

/// The techniques, as the page names them.
pub const TECHNIQUES: [&str; 7] = [VR_PIPE, AXES, GSCORE, NEO, VORION, GBU, GCC];

fn ratio(whole: u64, part: u64) -> f64 {
    whole as f64 / part as f64
}

fn quads(scenes: &[SceneWork], config: &Config) -> Vec<Row> {
    let each = |of: &dyn Fn(&SceneWork) -> f64| scenes.iter().map(of).collect::<Vec<_>>();
    let mut rows = vec![
        Row::new(VR_PIPE, "fragments, early termination", Unit::Times, each(&|scene| scene.merging.termination()))
            .paper(2.52, "its evaluation; a summary's key results")
            .reason("the scenes: little lies behind the finished pixels of an object, more behind those of a garden"),
    ];
    for (index, bin) in BINS.into_iter().enumerate() {
        let row = Row::new(
            VR_PIPE,
            format!("quads, merged in bins of {bin}"),
            Unit::Times,
            each(&|scene| scene.merging.merging()[index]),
        );
        rows.push(
            row.paper(1.30, "after early termination; the same summary")
                .reason("the capacity of its bins could not be read; a Gaussian of many quads fills a bin alone"),
        );
    }
    rows.push(
        Row::new(
            VR_PIPE,
            format!("speed-up, bins of {}", BINS[SPEED_UP_BIN]),
            Unit::Times,
            each(&|scene| scene.merging.speed_up(scene.drawn, scene.size, config)[SPEED_UP_BIN]),
        )
        .paper(2.78, "the greatest of its scenes; abstract, last sentence")
        .reason("the product of the rows above, because blending limits before and after; merging costs nothing here"),
    );
    rows
}

fn axes(scenes: &[SceneWork]) -> Vec<Row> {
    let each = |of: &dyn Fn(&SceneWork) -> f64| scenes.iter().map(of).collect::<Vec<_>>();
    vec![
        Row::new(AXES, "operations of the exponent, whole tiles", Unit::Percent, each(&|scene| scene.sharing.in_tiles()[0]))
            .paper(0.63, "abstract of version 1; 12 become 4.44 in a summary's text")
            .reason("the opacity's logarithm is a term of the exponent here, and a factor there"),
        Row::new(AXES, "all operations, whole tiles", Unit::Percent, each(&|scene| scene.sharing.in_tiles()[1]))
            .paper(0.38, "abstract of version 2, of the same machine: with blending")
            .reason(
                "what is left has 11 operations here (Table II), of which three are thresholds; the paper's 38 % needs about 8",
            ),
        Row::new(AXES, "operations of the exponent, reached blocks", Unit::Percent, each(&|scene| scene.sharing.in_blocks()[0]))
            .reason("fewer pixels share a column's terms if only blocks that a Gaussian reaches are evaluated"),
        Row::new(AXES, "all operations, reached blocks", Unit::Percent, each(&|scene| scene.sharing.in_blocks()[1]))
            .reason("the same"),
    ]
}

fn shapes(scenes: &[SceneWork]) -> Vec<Row> {
    let each = |of: &dyn Fn(&SceneWork) -> f64| scenes.iter().map(of).collect::<Vec<_>>();
    vec![
        Row::new(
            GSCORE,
            "pairs, squares over boxes",
            Unit::Times,
            each(&|scene| ratio(scene.shape_tests.squares, scene.shape_tests.boxes)),
        )
        .reason("boxes of three deviations along each ellipse's axes"),
        Row::new(
            GSCORE,
            "pairs, squares over boxes of long ellipses",
            Unit::Times,
            each(&|scene| ratio(scene.shape_tests.squares, scene.shape_tests.long_boxes)),
        )
        .reason("boxes where an axis is twice the other, squares elsewhere"),
        Row::new(
            GSCORE,
            "pairs, squares over the device's exact lists",
            Unit::Times,
            each(&|scene| ratio(scene.shape_tests.squares, scene.shape_tests.exact)),
        )
        .reason("the exact test knows the opacity: faint Gaussians end before three deviations"),
        Row::new(
            GSCORE,
            "subtiles of 8x8 skipped, of boxes' pairs",
            Unit::Percent,
            each(&|scene| 1.0 - ratio(scene.shape_tests.box_subtiles_8, 4 * scene.shape_tests.boxes)),
        )
        .reason("the corners of tiles that a box touches"),
        Row::new(
            GSCORE,
            "subtiles of 4x4 skipped, of boxes' pairs",
            Unit::Percent,
            each(&|scene| 1.0 - ratio(scene.shape_tests.box_subtiles_4, 16 * scene.shape_tests.boxes)),
        )
        .reason("of the size of this project's blocks"),
        Row::new(
            GSCORE,
            "blocks of 4x4 skipped, of exact pairs",
            Unit::Percent,
            each(&|scene| 1.0 - ratio(scene.shape_tests.exact_blocks, 16 * scene.shape_tests.exact)),
        )
        .reason("`saturation = reached` of this project's machine"),
        Row::new(
            GSCORE,
            "entries that are never sorted",
            Unit::Percent,
            each(&|scene| 1.0 - ratio(scene.chunk_sorting.sorted, scene.chunk_sorting.listed)),
        )
        .reason("chunks of 256 after the tile's end; only long lists have one"),
    ]
}

fn reuse(scenes: &[SceneWork]) -> Vec<Row> {
    let mut rows = Vec::new();
    let steps = scenes.first().map_or(0, |scene| scene.reuse.len());
    for step in 0..steps {
        let each = |of: fn(&ReuseFigures) -> f64| scenes.iter().map(|scene| of(&scene.reuse[step])).collect::<Vec<_>>();
        let degrees = scenes[0].reuse[step].step_degrees;
        let place = "six Tanks and Temples scenes; a review and a digest of its text";
        rows.extend([
            Row::new(
                NEO,
                format!("tiles that keep more than 78 %, step {degrees} deg"),
                Unit::Percent,
                each(|f| f.tiles_above),
            )
            .paper(0.90, place)
            .reason("the step of its paths and its tiles' size, which could not be read"),
            Row::new(
                NEO,
                format!("places moved, 99th percentile, step {degrees} deg"),
                Unit::Places,
                each(|f| f64::from(f.moved)),
            )
            .paper(31.0, place)
            .reason("the same; what comes and goes in front moves all behind it"),
            Row::new(
                NEO,
                format!("places moved among those that stay, step {degrees} deg"),
                Unit::Places,
                each(|f| f64::from(f.moved_among_kept)),
            )
            .paper(31.0, place)
            .reason("which of the two it counts could not be read; this one is what remains to be sorted"),
        ]);
    }
    rows
}

fn scaling(scenes: &[SceneWork]) -> Vec<Row> {
    let each = |of: &dyn Fn(&SceneWork) -> f64| scenes.iter().map(of).collect::<Vec<_>>();
    vec![
        Row::new(VORION, "speed-up from 2 to 16 rasterizers", Unit::Times, each(&|scene| scene.scaling.speed_ups()[0]))
            .paper(8.0, "19 FPS with 2: abstract. 152 FPS with 16: in no text that could be read")
            .reason("a Gaussian takes 16 cycles of a module, so that 16 of them ask for less than main memory moves"),
        Row::new(
            VORION,
            "the same, if only reached blocks are evaluated",
            Unit::Times,
            each(&|scene| scene.scaling.speed_ups()[1]),
        )
        .paper(8.0, "the same")
        .reason("a Gaussian takes about half of the cycles, so that main memory limits 16 modules"),
    ]
}

fn rows_of_pixels(scenes: &[SceneWork]) -> Vec<Row> {
    let each = |of: &dyn Fn(&SceneWork) -> f64| scenes.iter().map(of).collect::<Vec<_>>();
    let operations = |scene: &SceneWork| scene.row_work.operations(EXPONENT);
    vec![
        Row::new(
            GBU,
            "operations of a covered pixel's exponent",
            Unit::Times,
            each(&|scene| {
                let [_, covered, rows] = operations(scene);
                covered / rows
            }),
        )
        .paper(5.5, "11 become 2; page 7, a digest of its text")
        .reason("10 become 2 here, and each row of a Gaussian has 11 more: rows have few covered pixels"),
        Row::new(GBU, "covered pixels, of exact pairs", Unit::Percent, each(&|scene| scene.row_work.covered()))
            .paper(0.137, "static scenes; page 5, the same digest")
            .reason("its lists are those of squares, which are longer"),
        Row::new(
            GBU,
            "covered pixels, of squares' pairs",
            Unit::Percent,
            each(&|scene| scene.row_work.covered() * ratio(scene.shape_tests.exact, scene.shape_tests.squares)),
        )
        .paper(0.137, "the same")
        .reason("as there, if the end of a tile shortens both lists alike"),
        Row::new(GBU, "lanes busy, a row each", Unit::Percent, each(&|scene| scene.row_work.lanes_busy()))
            .paper(0.189, "static scenes on the GPU; page 7, the same digest")
            .reason("16 lanes that wait for the longest row of a tile; a warp there has 32"),
        Row::new(
            GBU,
            "operations of the exponent, whole tiles over rows",
            Unit::Times,
            each(&|scene| {
                let [tiles, _, rows] = operations(scene);
                tiles / rows
            }),
        )
        .reason("the bound of what a row engine would save of this machine's exponent"),
    ]
}

fn preprocessing(scenes: &[SceneWork]) -> Vec<Row> {
    let each = |of: &dyn Fn(&SceneWork) -> f64| scenes.iter().map(of).collect::<Vec<_>>();
    vec![
        Row::new(
            GCC,
            "preprocessed Gaussians that no tile fetches",
            Unit::Percent,
            each(&|scene| scene.conditional.unused()),
        )
        .paper(0.60, "up to, in GSCore; a summary of its introduction")
        .reason("the greatest of its scenes, which could not be read; little of an object or a low garden is hidden"),
        Row::new(GCC, "loads of a fetched Gaussian", Unit::Times, each(&|scene| scene.conditional.loads()))
            .reason("what Gaussian-wise rendering loads once; its figure could not be read"),
        Row::new(
            GCC,
            "bytes of stage 1 that are saved",
            Unit::Percent,
            each(&|scene| scene.conditional.saved_bytes(scene.gaussians, scene.degree)),
        )
        .reason("the colours of those that no tile fetches"),
    ]
}

/// Figures for which nothing here is comparable.
const UNTESTABLE: [[&str; 4]; 7] = [
    [
        GSCORE,
        "15.86x over a mobile consumer GPU",
        "abstract, last sentence",
        "needs that GPU, its scenes, and its whole pipeline",
    ],
    [
        VR_PIPE,
        "2.07x on average",
        "a summary of its text",
        "needs trained models of its scenes: the ratio of fragments is the scenes'",
    ],
    [
        AXES,
        "1.33 to 1.88x over accelerators",
        "abstract of version 2",
        "most of it is order-independent transmittance, whose pictures are others",
    ],
    [
        NEO,
        "10.0x and 5.6x, 94.5 % of DRAM traffic",
        "abstract, last sentences",
        "needs videos of its six scenes and a sorting engine; only its premise is tested above",
    ],
    [
        VORION,
        "19 FPS, 38.6 iterations a second",
        "abstract, last sentences",
        "needs its scene, its SIMT cores, and training",
    ],
    [
        GBU,
        "1.72x on the GPU, 12.8 to 91.5 FPS with the unit",
        "abstract; Table V, page 10, a digest",
        "needs a GPU's timing of another kernel, and its cache",
    ],
    [
        GCC,
        "faster than GSCore",
        "abstract, last sentence",
        "the abstract has no number, and needs both accelerators whole",
    ],
];

const HEAD: &str = "\
# Techniques of other accelerators on this project's work

Generated by `cargo run -p gaurast-timing-studies --example rivals > simdevice/timing/studies/RIVALS.md`; a test keeps it up to date.
It reads the counts of `rival_work.json`, which one command measures:

```
COMMAND
```

Every technique is evaluated on the same views. The device draws them and gives a trace of its work; the geometry that a trace
lacks is that of the projected Gaussians of the reference renderer. The difference is that of the scenes' mean from the paper's
figure. Sources and what was read of each are in [docs/simulator.md](../../../docs/simulator.md#sources). A figure without a
paper's is one that its paper has in a place that could not be read, or a bound for this machine.
";

const FORMULAS: &str = "
## What is counted

| technique | count | code |
|---|---|---|
| VR-Pipe | fragments: pairs of a pixel and a Gaussian with alpha of at least 1/255, with and without finished pixels; quads of 2x2 pixels of the same place that meet in a tile's bin are blended in twos | `techniques/quad_merging.rs` |
| axis-shared terms | `dx`, `a dx^2` and `b dx` once for a column, `dy`, `c dy^2` and the opacity once for a row; a product and two additions for a pixel | `techniques/axis_sharing.rs` |
| GSCore | pairs of a Gaussian and a tile, or a part of it, that a box along the ellipse's axes overlaps (separating axes); entries of the chunks of 256 that a tile begins | `techniques/shape_tests.rs` |
| Neo | the share of a tile's list that the next frame's list has, and by how many places its members move | `techniques/order_reuse.rs` |
| Vorion | stage 3 of the preset `paper-15x16` with 2, 4, 8 and 16 modules | `techniques/scaling.rs` |
| GBU | `u = step dx + shear dy` and `v = height dy`, with `u^2 + v^2` as the form: an addition and a product for a pixel, 11 operations for a row; covered pixels by rows | `techniques/row_transform.rs` |
| GCC | Gaussians in lists, and those that a tile fetches before it is finished, by their ids in the trace | `techniques/conditional.rs` |
";

fn table(out: &mut String, scenes: &[SceneWork], rows: &[Row]) -> std::fmt::Result {
    *out += "\n| technique | figure | paper | place |";
    for scene in scenes {
        write!(out, " {} |", scene.scene)?;
    }
    *out += " difference | reason |\n|---|---|---:|---|";
    scenes.iter().for_each(|_| *out += "---:|");
    *out += "---:|---|\n";
    for row in rows {
        let paper = row.paper.map_or_else(String::new, |paper| row.unit.text(paper));
        write!(out, "| {} | {} | {paper} | {} |", row.technique, row.figure, row.place)?;
        for value in &row.ours {
            write!(out, " {} |", row.unit.text(*value))?;
        }
        writeln!(out, " {} | {} |", row.difference(), row.reason)?;
    }
    Ok(())
}

fn inputs(out: &mut String, scenes: &[SceneWork]) -> std::fmt::Result {
    *out += "\n## Inputs\n\nCounts of the trace, and of the projected Gaussians. A camera frames each file's scene, with the command's default field of view, and the \
             garden's own camera the garden. The last column also has the fragment that finishes a pixel, which changes nothing.\n\n";
    *out += "| scene | picture | Gaussians | drawn | pairs, trace | pairs, geometry | squares, trace | squares, geometry | \
             contributions, trace | fragments of open pixels, geometry |\n|---|---|---:|---:|---:|---:|---:|---:|---:|---:|\n";
    for scene in scenes {
        writeln!(
            out,
            "| {} | {}x{} | {} | {} | {} | {} | {} | {} | {} | {} |",
            scene.scene,
            scene.size[0],
            scene.size[1],
            scene.gaussians,
            scene.drawn,
            scene.trace_pairs[0],
            scene.shape_tests.exact,
            scene.trace_squares,
            scene.shape_tests.squares,
            scene.trace_contributions,
            scene.merging.open_fragments,
        )?;
    }
    *out += "\nThe path of Neo's rows turns the camera around the middle of the picture, about the scene's upright axis, by the \
             same angle between two frames:\n\n| scene | degrees | pairs of frames | nine of ten tiles keep more than |\n|---|---:|---:|---:|\n";
    for scene in scenes {
        for figures in &scene.reuse {
            writeln!(
                out,
                "| {} | {} | {} | {} |",
                scene.scene,
                figures.step_degrees,
                figures.steps,
                Unit::Percent.text(figures.kept_by_nine_of_ten)
            )?;
        }
    }
    *out += "\nMilliseconds of stage 3 of Vorion's rows:\n\n| scene | evaluated | 2 | 4 | 8 | 16 |\n|---|---|---:|---:|---:|---:|\n";
    for scene in scenes {
        let times = [("whole tiles", scene.scaling.tiles_ms), ("reached blocks", scene.scaling.blocks_ms)];
        for (evaluated, times) in times {
            let times = times.map(|time| format!("{time:.3}")).join(" | ");
            writeln!(out, "| {} | {evaluated} | {times} |", scene.scene)?;
        }
    }
    Ok(())
}

/// The page of the stored counts.
///
/// # Errors
/// Returns a [`ConfigError`] if a preset can't be read.
pub fn markdown(stored: &Stored) -> Result<String, ConfigError> {
    let config = Config::preset("orin-nx-10w", &[])?;
    let scenes = &stored.scenes;
    let rows: Vec<_> = [
        quads(scenes, &config),
        axes(scenes),
        shapes(scenes),
        reuse(scenes),
        scaling(scenes),
        rows_of_pixels(scenes),
        preprocessing(scenes),
    ]
    .into_iter()
    .flatten()
    .collect();
    let mut out = HEAD.replace("COMMAND", &stored.command);
    // Writing to a string cannot fail.
    let _ = table(&mut out, scenes, &rows);
    out += "\n## Not testable here\n\n| technique | figure | place | what it needs |\n|---|---|---|---|\n";
    for cells in UNTESTABLE {
        out += &format!("| {} |\n", cells.join(" | "));
    }
    out += FORMULAS;
    let _ = inputs(&mut out, scenes);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_is_that_of_the_mean() {
        let row = Row::new(NEO, "a figure", Unit::Places, vec![20.0, 40.0]).paper(25.0, "a place");
        assert_eq!(row.difference(), "+20 %");
        assert_eq!(Row::new(NEO, "a figure", Unit::Times, vec![1.0]).difference(), "");
        let units = [Unit::Times, Unit::Percent, Unit::Places].map(|unit| unit.text(0.385));
        assert_eq!(units, ["0.39x", "38.5 %", "0"]);
    }
}
