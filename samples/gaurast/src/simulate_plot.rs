//! Plots of simulations: the curves of a sweep, the Pareto front of its machines, rooflines of the stages, and a
//! frame's tiles.

use std::fmt::Write as _;

use timing::area;
use timing::config::Config;
use timing::fast::TileSpan;
use timing::pe::Operations;

use timing::simulate::Simulation;
use timing::work::FrameWork;
use timing_studies::chart::{self, Chart, Corner, Curve};
use timing_studies::scatter::{self, Axis, Line, Plot, Point};

use crate::simulate_machines::MachineResult;

/// A panel's size in pixels.
const PANEL: [u32; 2] = [560, 380];

/// The colours of the curves, which people with colour blindness can tell apart (Okabe and Ito).
const COLORS: [&str; 3] = ["#0072b2", "#d55e00", "#009e73"];

/// A number of a simulation: its name and its function.
type Number = (&'static str, fn(&Simulation) -> f64);

const SPEED: [Number; 2] = [("raster stage", |result| result.raster_speedup), ("whole frame", |result| result.speedup)];
const ENERGY: [Number; 3] = [
    ("all", |result| result.energy.total()),
    ("modules", |result| result.energy.modules()),
    ("memory", |result| result.energy.memory),
];

/// An SVG of the machines' results. `swept` names the parameter that differs, and each machine is named by its value.
pub fn svg(swept: &str, results: &[MachineResult]) -> String {
    chart::svg(&[
        panel([swept, "speed-up over the shader cores"], &SPEED, results),
        panel([swept, "mJ a frame"], &ENERGY, results),
    ])
}

fn panel(axes: [&str; 2], numbers: &[Number], results: &[MachineResult]) -> Chart {
    let value = |name: &str| name.split_once('=').map_or(name, |(_, value)| value).to_owned();
    let curve = |(&(label, of), color): (&Number, &'static str)| Curve {
        label,
        color,
        values: results.iter().map(|result| of(&result.simulation)).collect(),
    };
    Chart {
        size: PANEL,
        axes: axes.map(str::to_owned),
        steps: results.iter().map(|result| value(&result.machine.name)).collect(),
        curves: numbers.iter().zip(COLORS).map(curve).collect(),
        marks: Vec::new(),
        legend_corner: Corner::UpperLeft,
    }
}

/// A plot of machines by area and raster time. Those on the Pareto front are named and joined by a line.
pub fn pareto(results: &[MachineResult]) -> String {
    let place = |result: &MachineResult| [area::area(&result.machine.config).added, result.simulation.stages.raster];
    let places: Vec<_> = results.iter().map(place).collect();
    let front = scatter::pareto(&places);
    let point = |(index, result): (usize, &MachineResult)| Point {
        at: places[index],
        name: format!("{}: {:.2} mJ", result.machine.name, result.simulation.energy.total()),
        labelled: front.contains(&index) && front.len() <= 12,
        color: if front.contains(&index) { COLORS[1] } else { "#bbb" },
    };
    let line =
        Line { through: front.iter().map(|&index| places[index]).collect(), name: String::new(), color: COLORS[1] };
    let axis = |name: &str| Axis { name: name.to_owned(), logarithmic: false };
    let plot = Plot {
        size: [760, 480],
        axes: [axis("mm2 that Gaussians add, arithmetic alone"), axis("raster stage, ms")],
        points: results.iter().enumerate().map(point).collect(),
        lines: vec![line],
    };
    plot.svg()
}

/// A roofline plot of the stages for the shader cores and the rasterizer: operations per second over operations per
/// byte.
pub fn roofline(frame: &FrameWork, result: &Simulation, config: &Config) -> String {
    let bandwidth = config.memory.bandwidth_gb_s * config.memory.efficiency;
    let shader = &config.shader;
    let cores = f64::from(shader.sms) * shader.float_per_cycle * shader.clock_ghz * shader.efficiency;
    let of = |operations: Operations| (operations.add + operations.mul + operations.div + operations.exp) as f64;
    let raster = &config.rasterizer;
    let pes = f64::from(raster.pes()) * raster.clock_ghz * of(Operations::GAUSSIAN);
    let mut points = Vec::new();
    let mut point = |name: &str, operations: f64, bytes: f64, ms: f64, color| {
        if operations > 0.0 && bytes > 0.0 && ms > 0.0 {
            points.push(Point {
                at: [operations / bytes, operations / ms * 1e-6],
                name: name.to_owned(),
                labelled: true,
                color,
            });
        }
    };
    let stages = frame.shader();
    let names = ["dispatches", "stage 1", "stage 2", "fragment programs"];
    let rooflines = [&result.compute, &result.preprocess, &result.sort, &result.shade];
    for ((name, work), roofline) in names.iter().zip(&stages).zip(rooflines) {
        point(name, work.operations(), work.bytes, roofline.milliseconds(), COLORS[0]);
    }
    let report = &result.raster_alone;
    let operations =
        report.gaussian_evaluations * of(Operations::GAUSSIAN) + report.triangle_evaluations * of(Operations::TRIANGLE);
    let bytes = report.bytes_in + report.bytes_out;
    point("stage 3", operations, bytes, result.stages_alone.raster, COLORS[1]);
    // From the slope of memory to the limit of the units, and beyond the points.
    let most = points.iter().map(|point| point.at[0]).fold(100.0, f64::max);
    let least = points.iter().map(|point| point.at[0]).fold(0.1, f64::min);
    let roof = |name: &str, peak: f64, color| Line {
        through: vec![[least, least * bandwidth], [peak / bandwidth, peak], [(peak / bandwidth).max(most) * 2.0, peak]],
        name: format!("{name}: {peak:.0} G operations/s"),
        color,
    };
    let mut lines = vec![roof("shader cores", cores, COLORS[0])];
    if raster.modules > 0 {
        lines.push(roof("rasterizer", pes, COLORS[1]));
    }
    let axis = |name: String| Axis { name, logarithmic: true };
    let plot = Plot {
        size: [760, 480],
        axes: [
            axis(format!("operations a byte of main memory ({bandwidth:.0} GB/s)")),
            axis("G operations/s".to_owned()),
        ],
        points,
        lines,
    };
    plot.svg()
}

/// The greatest width of the picture of a frame's tiles in pixels.
const WIDEST: f64 = 1280.0;

/// The height of the line below the picture of a frame's tiles, in pixels.
const CAPTION: f64 = 24.0;

/// The colour of a share of the most cycles: from white over orange to dark red.
fn heat(share: f64) -> String {
    let rest = 1.0 - share;
    let [r, g, b] = [255.0 - 120.0 * share * share * share, 255.0 * rest, 220.0 * rest * rest];
    format!("rgb({r:.0},{g:.0},{b:.0})")
}

/// A frame's tiles as squares, darker with more cycles, above a scale. Each square's title has its cycles.
pub fn tiles(frame: &FrameWork, spans: &[TileSpan], config: &Config) -> String {
    let [width, height] = frame.size.map(f64::from);
    let scale = (WIDEST / width.max(1.0)).min(1.0);
    let side = f64::from(config.rasterizer.tile_side) * scale;
    let most = spans.iter().map(|span| span.end - span.begin).fold(1.0, f64::max);
    let [width, height] = [width * scale, height * scale];
    let whole = height + CAPTION;
    let mut out = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{whole:.0}\" viewBox=\"0 0 {width:.0} {whole:.0}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<title>Cycles of each tile; the darkest takes {most:.0}</title>\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>"
    );
    for span in spans {
        let cycles = span.end - span.begin;
        let [x, y] = span.at.map(|at| f64::from(at) * side);
        let color = heat(cycles / most);
        let _ = writeln!(
            out,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{side:.1}\" height=\"{side:.1}\" fill=\"{color}\">\
             <title>{},{}: {cycles:.0} cycles</title></rect>",
            span.at[0], span.at[1]
        );
    }
    // Tiles at the edge may reach beyond the picture.
    let _ = writeln!(out, "<rect y=\"{height:.1}\" width=\"100%\" height=\"{CAPTION}\" fill=\"white\"/>");
    let (top, base) = (height + 6.0, height + 17.0);
    let _ = writeln!(out, "<text x=\"4\" y=\"{base:.1}\">0</text>");
    for step in 0..=10 {
        let (x, color) = (16 + 12 * step, heat(f64::from(step) / 10.0));
        let _ = writeln!(out, "<rect x=\"{x}\" y=\"{top:.1}\" width=\"12\" height=\"12\" fill=\"{color}\"/>");
    }
    let _ = writeln!(out, "<text x=\"154\" y=\"{base:.1}\">{most:.0} cycles a tile</text>");
    out + "</svg>\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate_machines::simulate_all;
    use crate::simulate_machines::tests::{machines, trace};
    use timing::simulate::even_frame;

    #[test]
    fn every_machine_is_a_step_of_every_curve() {
        let frame = even_frame([64, 64], 1000, 0.3);
        let machines = machines(&["saturation=none", "saturation=tile", "saturation=row"]);
        let results = simulate_all(&trace(frame), &machines);
        let svg = svg("saturation", &results);
        assert_eq!(svg.matches("<circle").count(), 3 * (SPEED.len() + ENERGY.len()));
        for word in ["none", "tile", "row", "modules", "whole frame"] {
            assert!(svg.contains(&format!(">{word}</text>")), "{word}");
        }
    }

    #[test]
    fn other_plots_show_every_machine_stage_and_tile() {
        let mut frame = even_frame([320, 200], 20_000, 0.3);
        frame.draws[0].sort = timing::work::ShaderWork { integer: 1e6, bytes: 1e6, ..Default::default() };
        let machines = machines(&["modules=2", "modules=4", "modules=8"]);
        let results = simulate_all(&trace(frame.clone()), &machines);
        assert_eq!(pareto(&results).matches("<circle").count(), 3);
        let (config, result) = (&machines[0].config, &results[0].simulation);
        let roofs = roofline(&frame, result, config);
        assert!(roofs.contains(">stage 2</text>") && roofs.contains(">stage 3</text>"));
        assert_eq!(roofs.matches("<polyline").count(), 2);
        let (_, spans) = timing::fast::rasterize_tiles(&frame, config, 0.0);
        let picture = tiles(&frame, &spans, config);
        assert_eq!(picture.matches(" cycles</title>").count(), 260);
    }
}
