//! The sensitivity of the paper's configuration to its numbers: sweeps over a generated scene, and the points from
//! which a larger number brings little.

use crate::chart::{self, Chart, Corner, Curve, Mark};
use crate::{rivals, scene, simt};
use std::fmt::Write;
use timing::config::{Config, ConfigError, DEFAULT_PRESET};
use timing::plan::Rates;
use timing::ring;
use timing::simulate::{Simulation, simulate};
use timing::work::{FrameWork, Mode, TILE_GROUPS};

/// The generated scene: pixels, Gaussians and seed.
const SIZE: [u32; 2] = [640, 360];
const GAUSSIANS: usize = 90_000;
const SEED: u64 = 1;

/// A configuration of a sweep, and its simulation.
#[derive(Clone, Debug)]
pub struct Point {
    /// The number that is swept.
    pub x: f64,
    /// The name of the configuration.
    pub name: String,
    /// The simulation of the scene on this configuration.
    pub simulation: Simulation,
}

/// A sweep over one number.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// The plot's file, without its extension.
    pub file: &'static str,
    /// A heading.
    pub title: &'static str,
    /// The name of the number.
    pub axis: &'static str,
    /// The configurations, in order of the number.
    pub points: Vec<Point>,
    /// The number in the paper's configuration.
    pub paper: f64,
    /// The reason for the curve's shape.
    pub why: String,
}

/// The scene.
pub fn frame() -> FrameWork {
    scene::gaussians(SIZE, GAUSSIANS, SEED)
}

/// The least gain of a useful step, as a share of the gain if speed grew in proportion to the number.
const PAYS: f64 = 0.25;

impl Sweep {
    /// The first point from which the next step brings less than a quarter of the gain that it would if speed grew in
    /// proportion to the number.
    pub fn knee(&self) -> Option<&Point> {
        let pays = |pair: &[Point]| {
            let speed = |point: &Point| point.simulation.raster_speedup;
            let gained = speed(&pair[1]) / speed(&pair[0]) - 1.0;
            gained >= PAYS * (pair[1].x / pair[0].x - 1.0)
        };
        let first = self.points.windows(2).find(|pair| !pays(pair));
        first.map(|pair| &pair[0])
    }

    /// A picture of the raster stage's and the frame's speed-up.
    pub fn svg(&self) -> String {
        let curve = |label, color, of: fn(&Simulation) -> f64| Curve {
            label,
            color,
            values: self.points.iter().map(|point| of(&point.simulation)).collect(),
        };
        let knee = self.knee().filter(|_| self.file != "precision");
        let mark = |label, color, x: Option<f64>| {
            let step = self.points.iter().position(|point| Some(point.x) == x)?;
            Some(Mark { label, color, step })
        };
        let marks = [mark("knee", "black", knee.map(|point| point.x)), mark("paper", "#787878", Some(self.paper))];
        chart::svg(&[Chart {
            size: [640, 360],
            axes: [self.axis, "speed-up over the shader cores"].map(str::to_owned),
            steps: self.points.iter().map(|point| point.name.clone()).collect(),
            curves: vec![
                curve("raster stage", "#1f77b4", |result| result.raster_speedup),
                curve("whole frame", "#d66027", |result| result.speedup),
            ],
            marks: marks.into_iter().flatten().collect(),
            legend_corner: Corner::LowerRight,
        }])
    }
}

fn machine(settings: &[String]) -> Result<Config, ConfigError> {
    Config::preset(DEFAULT_PRESET, settings)
}

/// The scene on configurations that differ in one field.
fn points(frame: &FrameWork, field: &str, values: &[f64]) -> Result<Vec<Point>, ConfigError> {
    let point = |&x: &f64| {
        let config = machine(&[format!("{field}={x}")])?;
        Ok(Point { x, name: format!("{x}"), simulation: simulate(frame, &config) })
    };
    values.iter().map(point).collect()
}

/// All sweeps over the scene.
///
/// # Errors
/// Returns a [`ConfigError`] if a preset can't be read.
pub fn sweeps(frame: &FrameWork) -> Result<Vec<Sweep>, ConfigError> {
    let paper = machine(&[])?;
    Ok(vec![
        modules(frame, &paper)?,
        tile_side(frame)?,
        batch(frame, &paper)?,
        bandwidth(frame, &paper)?,
        precision(frame)?,
    ])
}

/// GB/s that a module needs to keep its PEs busy: primitives read, and pixels written in the scene's proportion.
fn appetite(config: &Config, result: &Simulation) -> f64 {
    let raster = &config.rasterizer;
    let cycles = f64::from(raster.tile_side.pow(2)) / f64::from(raster.pes_per_module);
    let bytes_in = f64::from(raster.primitive_bytes()) / cycles * raster.clock_ghz;
    bytes_in * (1.0 + result.raster.bytes_out / result.raster.bytes_in)
}

/// GB/s that main memory gives streams.
fn streams(config: &Config) -> f64 {
    config.memory.bandwidth_gb_s * config.memory.efficiency
}

fn modules(frame: &FrameWork, paper: &Config) -> Result<Sweep, ConfigError> {
    let mut points = points(frame, "modules", &[1.0, 2.0, 4.0, 8.0, 15.0, 30.0, 60.0, 120.0])?;
    for point in &mut points {
        point.x *= f64::from(paper.rasterizer.pes_per_module);
        point.name = format!("{:.0}", point.x);
    }
    let before = points[0].simulation.stages.preprocess + points[0].simulation.stages.sort;
    let enough = points.iter().find(|point| point.simulation.stages.raster < before);
    let result = simulate(frame, paper);
    let left = (streams(paper) - result.contention_gb_s).max(streams(paper) / 2.0);
    let each = appetite(paper, &result);
    let why = format!(
        "A busy module moves {each:.1} GB/s: {} bytes a primitive of 16 cycles, and the pixels of a tile for the {:.0} \
         primitives that it needs on average here. Streams get {:.1} GB/s of main memory, but stages 1 and 2 of the next \
         frame want {:.1} of it meanwhile, and the arbiter leaves the rasterizer {left:.1}: enough for {:.0} modules, \
         or {:.0} PEs, beyond which they wait. Alone it would be {:.0} PEs; longer lists would need fewer bytes for pixels. \
         The whole frame stops gaining much earlier: stages 1 and 2 take {before:.2} ms on the shader cores whatever the \
         rasterizer does, and from {} PEs on it is faster than they are.",
        paper.rasterizer.primitive_bytes(),
        frame.draws[0].needed_pairs() as f64 / frame.draws[0].tiles.len() as f64,
        streams(paper),
        result.contention_gb_s,
        left / each,
        left / each * f64::from(paper.rasterizer.pes_per_module),
        streams(paper) / each * f64::from(paper.rasterizer.pes_per_module),
        enough.map_or("no number of", |point| &point.name),
    );
    Ok(Sweep {
        file: "pes",
        title: "PE count",
        axis: "PEs (16 a module)",
        points,
        paper: f64::from(paper.rasterizer.pes()),
        why,
    })
}

fn tile_side(frame: &FrameWork) -> Result<Sweep, ConfigError> {
    let points = points(frame, "tile_side", &[8.0, 16.0, 32.0, 64.0])?;
    let [small, known, large, _] = frame.draws[0].sized_pairs.map(|pairs| pairs as f64);
    let why = format!(
        "An estimate: lists are those of 16x16 tiles, lengthened as bounding boxes say ({:.2} times the pairs at 8x8, {:.2} \
         times at 32x32). Small tiles evaluate fewer pixels that a Gaussian doesn't reach and end sooner, but their more numerous pairs \
         are each a fetch, for which memory is too slow, and an 8x8 tile is 4 cycles of 16 PEs, less than the 6 that a \
         pixel's transmittance takes to come back. Large tiles evaluate four times the pixels per pair for less than four times fewer pairs, \
         and end when their last pixel is finished. 16x16 is the smallest tile that hides the latency.",
        small / known,
        large / known,
    );
    Ok(Sweep { file: "tile_side", title: "Tile size", axis: "pixels along a tile's side", points, paper: 16.0, why })
}

fn batch(frame: &FrameWork, paper: &Config) -> Result<Sweep, ConfigError> {
    let points = points(frame, "batch", &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0])?;
    let raster = &paper.rasterizer;
    let wasted = |point: &Point| 100.0 * point.simulation.raster.bytes_wasted / point.simulation.raster.bytes_in;
    let (first, last) = (&points[0], &points[points.len() - 1]);
    let rates = Rates::new(paper, 0.0);
    let piece_bytes = ring::piece_bytes(raster, 0, raster.piece());
    let comes = ring::REQUEST + u64::from(rates.latency) + ring::port_cycles(piece_bytes, &rates);
    let cycles = raster.busy_cycles(Mode::Gaussian, TILE_GROUPS.into());
    let why = format!(
        "Half of the buffer holds so many primitives of {} bytes. Both halves are a ring of pieces of {} primitives, or of half \
         of the buffer if it is less. A piece that is requested when another is left comes {comes} cycles later, in which the PEs \
         evaluate {:.1} primitives of {cycles} cycles. With so many beside the piece that is evaluated, the latency of memory is \
         hidden, and more buys no speed, because the controller knows a tile's list and asks ahead. What grows with \
         it is what was fetched for a tile that had ended, which costs time where memory is the limit: {:.1} % of the bytes \
         with {} a half, {:.1} % with {}.",
        raster.primitive_bytes(),
        raster.piece(),
        comes as f64 / cycles as f64,
        wasted(first),
        first.name,
        wasted(last),
        last.name,
    );
    Ok(Sweep {
        file: "batch",
        title: "Buffer size",
        axis: "primitives in half of the tile buffer",
        points,
        paper: f64::from(raster.batch),
        why,
    })
}

fn bandwidth(frame: &FrameWork, paper: &Config) -> Result<Sweep, ConfigError> {
    let values = [8.0, 16.0, 24.0, 34.0, 48.0, 68.3, 102.4, 204.8];
    let points = points(frame, "bandwidth_gb_s", &values)?;
    let result = simulate(frame, paper);
    let wanted = appetite(paper, &result) * f64::from(paper.rasterizer.modules);
    let why = format!(
        "Fifteen busy modules move {wanted:.1} GB/s, primitives and pixels. With {:.0} % of the peak for streams, {:.0} GB/s \
         would feed them alone. Stages 1 and 2 of the next frame move their bytes meanwhile, as fast as they get them ({:.1} \
         GB/s at {} GB/s), and the arbiter leaves the rasterizer half: that takes {:.0} GB/s. The whole frame goes on \
         gaining beyond it, since sorting is limited by memory.",
        100.0 * paper.memory.efficiency,
        wanted / paper.memory.efficiency,
        result.contention_gb_s,
        paper.memory.bandwidth_gb_s,
        2.0 * wanted / paper.memory.efficiency,
    );
    Ok(Sweep {
        file: "bandwidth",
        title: "Bandwidth",
        axis: "GB/s, peak of main memory",
        points,
        paper: paper.memory.bandwidth_gb_s,
        why,
    })
}

fn precision(frame: &FrameWork) -> Result<Sweep, ConfigError> {
    let mut points = Vec::new();
    for (x, name, preset, settings) in [
        (0.0, "fp32, 68.3 GB/s", DEFAULT_PRESET, &[][..]),
        (1.0, "fp16, 68.3 GB/s", "fp16", &[]),
        (2.0, "fp32, 24 GB/s", DEFAULT_PRESET, &["bandwidth_gb_s=24"]),
        (3.0, "fp16, 24 GB/s", "fp16", &["bandwidth_gb_s=24"]),
    ] {
        let settings: Vec<_> = settings.iter().map(|&setting| setting.to_owned()).collect();
        points.push(Point {
            x,
            name: name.to_owned(),
            simulation: simulate(frame, &Config::preset(preset, &settings)?),
        });
    }
    let energy = |point: &Point| point.simulation.energy.modules();
    let speed = |a: usize, b: usize| points[b].simulation.raster_speedup / points[a].simulation.raster_speedup;
    let waits = &points[0].simulation.raster.modules;
    let why = format!(
        "A PE takes a pixel a cycle whatever its numbers' width, so that half floats buy no speed where PEs limit. They \
         halve a primitive's nine numbers and a pixel's three (not the index), which pays where memory limits: {:.2} times \
         the speed here, where modules wait for memory in {:.0} % of their cycles, and {:.2} times with a third of the \
         bandwidth. The modules spend {:.0} % of the energy, on narrower units and in less time. What half floats do to the \
         picture is another question.",
        speed(0, 1),
        100.0 * waits.memory / waits.total(),
        speed(2, 3),
        100.0 * energy(&points[1]) / energy(&points[0]),
    );
    Ok(Sweep { file: "precision", title: "Precision", axis: "numbers and bandwidth", points, paper: 0.0, why })
}

/// The text of SENSITIVITY.md.
///
/// # Errors
/// Returns a [`ConfigError`] if a preset can't be read.
pub fn markdown() -> Result<String, ConfigError> {
    let frame = frame();
    let draw = &frame.draws[0];
    let tiles = draw.tiles.len() as f64;
    let mut out = format!(
        "# What the machine's numbers are worth\n\n\
         Generated by `cargo run --release -p gaurast-timing-studies --example sensitivity`, with the plots beside it; a test keeps both up \
         to date.\n`gaurast simulate SCENE --sweep NAME=VALUES` does the same for any scene and field.\n\n\
         The machine is the paper's (`paper-15x16`), and one number at a time is changed. The scene is generated \
         (`studies/src/scene.rs`):\n{GAUSSIANS} round Gaussians on {} x {} pixels, {:.0} pairs a tile, of which {:.0} % are needed \
         until the tile is finished.\nSpeed-ups are over the same scene on the shader cores alone, of the raster stage and \
         of whole frames. A knee is where\nthe next step brings less than a quarter of what it would if speed grew with the \
         number.\n",
        SIZE[0],
        SIZE[1],
        draw.pairs() as f64 / tiles,
        100.0 * draw.needed_pairs() as f64 / draw.pairs() as f64,
    );
    for sweep in sweeps(&frame)? {
        // Writing to a string cannot fail.
        let _ = write!(out, "\n## {}\n\n", sweep.title);
        out += "| | raster speed-up | speed-up | raster ms | PEs busy | waiting for memory | raster mJ |\n";
        out += "|---:|---:|---:|---:|---:|---:|---:|\n";
        for point in &sweep.points {
            let result = &point.simulation;
            let modules = &result.raster.modules;
            let share = |cycles: f64| 100.0 * cycles / modules.total();
            let _ = writeln!(
                out,
                "| {} | {:.1}x | {:.2}x | {:.3} | {:.0} % | {:.0} % | {:.2} |",
                point.name,
                result.raster_speedup,
                result.speedup,
                result.stages.raster,
                share(modules.busy),
                share(modules.memory),
                result.energy.modules() + result.energy.memory,
            );
        }
        let _ = write!(out, "\n![{}](sensitivity/{}.svg)\n\n", sweep.title, sweep.file);
        if sweep.file != "precision" {
            match sweep.knee() {
                Some(knee) => {
                    let _ = write!(out, "Knee: {}. ", knee.name);
                }
                None => out += "No knee in this range. ",
            }
        }
        out += &sweep.why;
        out += "\n";
    }
    out += &baselines(&frame)?;
    Ok(out)
}

/// The section of the same scene's stage 3 on other machines.
fn baselines(frame: &FrameWork) -> Result<String, ConfigError> {
    let config = Config::preset(DEFAULT_PRESET, &[])?;
    let result = simulate(frame, &config);
    let threads = simt::simulate(&frame.with_squares(), &config);
    let quads = rivals::quads(frame, &config);
    let ours = result.stages_alone.raster;
    let rows = [
        ("Gaussian mode, a frame alone", ours),
        ("shader cores, calibrated", result.baseline_raster_ms),
        ("shader cores, SIMT machine", threads.milliseconds()),
        ("blended quads on the plain rasterizer", quads.milliseconds()),
    ];
    let mut out = "\n## Other machines\n\n| stage 3 | ms | over the Gaussian mode |\n|---|---:|---:|\n".to_owned();
    for (name, ms) in rows {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "| {name} | {ms:.3} | {:.1}x |", ms / ours);
    }
    let _ = write!(
        out,
        "\nThe shader cores draw the lists of 3-sigma squares, as the original code does. The calibrated number of \
         operations an evaluation comes from the paper's times; the SIMT machine (`studies/src/simt.rs`) has none of them: \
         {:.0} % of its warps blend. Quads are never spared, and {} limits them.\n",
        100.0 * threads.blended,
        quads.limit(),
    );
    Ok(out)
}
