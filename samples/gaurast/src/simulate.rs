//! `gaurast simulate`: the estimated cost of a scene on the simulated hardware.
//!
//! The work is that of a real run. This program draws the scene in a process of its own with `GAURAST_TRACE` set, which
//! works with any Vulkan program.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::{Args, ValueEnum};
use gaurast_picture::Size;
use thiserror::Error;
use timing::FrameWork;
use timing::config::{Config, ConfigError, DEFAULT_PRESET};
use timing::fast::{self, TileSpan};
use timing::raster::RasterReport;
use timing::schedule::{self, Engine, ModuleSpan, Span};
use timing::simulate::{self, Shared, Simulation};
use timing::work::{Trace, TraceError};
use timing_studies::what_if::{WhatIf, what_ifs};
use timing_studies::{area, paper, rtl, stepped};

use crate::simulate_plot as plot;
use crate::simulate_report as report;

/// A failure of the simulation. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum Error {
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error("{}: {source}", path.display())]
    File { path: PathBuf, source: std::io::Error },
    #[error("{}: not a trace of work: {source}", path.display())]
    Trace { path: PathBuf, source: serde_json::Error },
    #[error("{}: {source}", path.display())]
    Work { path: PathBuf, source: TraceError },
    #[error("{0}: there is no frame in the trace")]
    Empty(String),
    #[error("{0}: the last frame has no work, so there is nothing to simulate")]
    NoWork(String),
    #[error("--stepped takes at most {MAX_STEPPED_PAIRS} pairs of a tile and a primitive, and the trace has {0}")]
    TooLong(u64),
    #[error("drawing the scene: {0}")]
    Draw(String),
    #[error("--sweep {0}: not NAME=FIRST..LAST or NAME=VALUE,VALUE,...")]
    Sweep(String),
    #[error("--sweep: {0} machines, and at most {MAX_GRID}")]
    Grid(usize),
    #[error("output: {0}")]
    Output(#[from] std::io::Error),
    #[error("output: {0}")]
    Json(#[from] serde_json::Error),
}

/// The format of results.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Tables for people
    #[default]
    Table,
    /// Everything, as JSON
    Json,
    /// The main numbers, one line per machine
    Csv,
}

#[derive(Args)]
pub struct SimulateArguments {
    /// The scene file, or a trace of work (.json); a generated garden if there is none
    pub scene: Option<PathBuf>,

    /// The hardware: paper-15x16, paper-pipeline, paper-300, single-module, fp16, orin-nx-10w, orin-nx-maxn or m2-pro
    #[arg(long, value_name = "NAME", default_value = DEFAULT_PRESET)]
    pub preset: String,

    /// The hardware, from a TOML file; it may inherit from a preset
    #[arg(long, value_name = "FILE.toml", conflicts_with = "preset")]
    pub config: Option<PathBuf>,

    /// Change a parameter of the hardware, as in modules=30 or memory.efficiency=0.8; may be given more than once
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub settings: Vec<String>,

    /// Simulate one machine after the other, as in modules=1..32 or saturation=none,tile,block; if given more than
    /// once, every combination
    #[arg(long, value_name = "NAME=FIRST..LAST")]
    pub sweep: Vec<String>,

    /// Plot the sweep's speed-ups and energy
    #[arg(long, value_name = "FILE.svg", requires = "sweep")]
    pub plot: Option<PathBuf>,

    /// Plot each machine's raster time against its area, with the Pareto front
    #[arg(long, value_name = "FILE.svg", requires = "sweep")]
    pub pareto: Option<PathBuf>,

    /// Plot the stages under the rooflines of shader cores and rasterizer
    #[arg(long, value_name = "FILE.svg")]
    pub roofline: Option<PathBuf>,

    /// Draw the frame's tiles, coloured by their cycles
    #[arg(long, value_name = "FILE.svg")]
    pub tiles: Option<PathBuf>,

    /// Simulate every frame of the trace, not only the last one
    #[arg(long, conflicts_with_all = ["sweep", "what_if", "stepped"])]
    pub every_frame: bool,

    /// Write the rasterizer module in SystemVerilog, and nothing else
    #[arg(long, value_name = "DIR", conflicts_with_all = ["scene", "sweep", "what_if", "trace", "stepped", "paper"])]
    pub emit_rtl: Option<PathBuf>,

    /// Show the saving of each skip as hardware
    #[arg(long, conflicts_with = "sweep")]
    pub what_if: bool,

    /// Write a timeline for chrome://tracing and Perfetto
    #[arg(long, value_name = "FILE.json")]
    pub trace: Option<PathBuf>,

    /// The number of frames of the timeline
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u16).range(1..))]
    pub frames: u16,

    /// Also step the rasterizer clock by clock, and print the error of the fast model
    #[arg(long, conflicts_with_all = ["sweep", "what_if"])]
    pub stepped: bool,

    /// Print the paper's numbers and the model's, and nothing else
    #[arg(long, conflicts_with_all = ["scene", "sweep", "what_if", "trace", "stepped"])]
    pub paper: bool,

    /// The format of results
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,

    /// A camera file, as for gaurast render
    #[arg(long, value_name = "FILE")]
    pub cameras: Option<PathBuf>,

    /// The camera's index in the file, from 0
    #[arg(long, value_name = "N", requires = "cameras", default_value_t = 0)]
    pub view: usize,

    /// The picture's size in pixels [default: 1280x720, or the camera file's]
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,
}

/// Simulates and prints the results.
pub fn run(arguments: &SimulateArguments) -> Result<(), Error> {
    if arguments.paper {
        return print(&match arguments.format {
            Format::Table => report::paper(&paper::report()),
            Format::Json => serde_json::to_string_pretty(&paper::report())? + "\n",
            Format::Csv => report::paper_csv(&paper::report()),
        });
    }
    if let Some(folder) = &arguments.emit_rtl {
        return rtl::write(folder).map_err(|source| Error::File { path: folder.clone(), source });
    }
    // Errors of the command line are reported before a large scene is drawn.
    let config = config(arguments)?;
    let machines = if arguments.sweep.is_empty() {
        vec![(machine_name(arguments), config.clone())]
    } else {
        let named = |settings: Vec<String>| Ok((settings.join(" "), config.with(&settings)?));
        let grid = grid(&arguments.sweep)?;
        grid.into_iter().map(named).collect::<Result<Vec<_>, Error>>()?
    };
    let trace = work(arguments)?;
    let name = || arguments.scene.as_ref().map_or("the garden".to_owned(), |path| path.display().to_string());
    let frame = trace.frames.last().ok_or_else(|| Error::Empty(name()))?;
    if frame.pairs() == 0 && frame.shader().iter().all(|work| work.operations() == 0.0) {
        return Err(Error::NoWork(name()));
    }
    if arguments.what_if {
        let variants = what_ifs(frame, &config);
        return print(&what_if_text(arguments.format, &variants)?);
    }
    if arguments.stepped {
        return print(&report::compared(&models(&trace, &config)?));
    }
    let results = if arguments.every_frame {
        let named = |(number, frame)| (format!("frame {number}"), simulate::simulate(frame, &config));
        trace.frames.iter().enumerate().map(named).collect()
    } else {
        simulate_all(frame, &machines)
    };
    if let Some(path) = &arguments.trace {
        let (_, config) = &machines[0];
        write_timeline(path, &trace, config, arguments.frames)?;
    }
    if let Some(path) = &arguments.plot {
        let swept: Vec<_> = arguments.sweep.iter().filter_map(|sweep| sweep.split('=').next()).collect();
        replace(path, plot::svg(&swept.join(", "), &results).as_bytes())?;
    }
    if let Some(path) = &arguments.pareto {
        replace(path, plot::pareto(&machines, &results).as_bytes())?;
    }
    if let (Some(path), Some((_, result))) = (&arguments.roofline, results.first()) {
        replace(path, plot::roofline(frame, result, &machines[0].1).as_bytes())?;
    }
    if let Some(path) = &arguments.tiles {
        let spans = tile_spans(frame, &machines[0].1);
        replace(path, plot::tiles(frame, &spans, &machines[0].1).as_bytes())?;
    }
    print(&match (arguments.format, results.as_slice()) {
        (Format::Table, [(_, one)]) if !arguments.every_frame => {
            let spans = tile_spans(frame, &machines[0].1);
            report::one(frame, one, &config, &spans)
        }
        (Format::Table, many) => report::many(many),
        (Format::Json, many) => serde_json::to_string_pretty(many)? + "\n",
        (Format::Csv, many) => report::csv(many, &areas(&machines, many.len())),
    })
}

/// The tiles of a frame in the modules, for the frame alone.
fn tile_spans(frame: &FrameWork, config: &Config) -> Vec<TileSpan> {
    fast::rasterize_tiles(&simulate::of_rasterizer(frame, config), config, 0.0).1
}

/// The area that Gaussians add on each of `count` machines, or on the same one.
fn areas(machines: &[(String, Config)], count: usize) -> Vec<f64> {
    let of = |(_, config): &(String, Config)| area::area(config).added;
    machines.iter().map(of).cycle().take(count).collect()
}

/// Simulates the frame on every machine. Each of the host's cores takes the next machine when it is free.
fn simulate_all(frame: &FrameWork, machines: &[(String, Config)]) -> Vec<(String, Simulation)> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let shared = Shared::new(frame);
    let next = AtomicUsize::new(0);
    let take = || {
        let index = next.fetch_add(1, Ordering::Relaxed);
        let (name, config) = machines.get(index)?;
        Some((index, (name.clone(), shared.simulate(config))))
    };
    let mut results: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..cores.min(machines.len()))
            .map(|_| scope.spawn(|| std::iter::from_fn(take).collect::<Vec<_>>()))
            .collect();
        let results = threads.into_iter().flat_map(|thread| match thread.join() {
            Ok(results) => results,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        results.collect()
    });
    results.sort_unstable_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, result)| result).collect()
}

/// The greatest number of pairs that are stepped clock by clock, which takes some minutes.
const MAX_STEPPED_PAIRS: u64 = 1 << 24;

/// The cycles of each frame by both models, for single frames and for frames that overlap as the hardware allows.
fn models(trace: &Trace, config: &Config) -> Result<Vec<report::Compared>, Error> {
    let pairs = trace.frames.iter().map(FrameWork::pairs).sum();
    if pairs > MAX_STEPPED_PAIRS {
        return Err(Error::TooLong(pairs));
    }
    let mut compared = Vec::new();
    for (number, frame) in trace.frames.iter().enumerate() {
        let result = simulate::simulate(frame, config);
        let frame = simulate::of_rasterizer(frame, config);
        let mut compare = |how, fast: &RasterReport, others_gb_s| {
            compared.push(report::Compared {
                frame: number,
                how,
                fast: fast.clone(),
                stepped: stepped::rasterize(&frame, config, others_gb_s),
            });
        };
        compare("alone", &result.raster_alone, 0.0);
        if result.contention_gb_s > 0.0 {
            compare("overlapping", &result.raster, result.contention_gb_s);
        }
    }
    Ok(compared)
}

fn what_if_text(format: Format, variants: &[WhatIf]) -> Result<String, Error> {
    let named: Vec<_> = variants.iter().map(|variant| (variant.name.to_owned(), variant.simulation.clone())).collect();
    Ok(match format {
        Format::Table => report::many(&named),
        Format::Json => serde_json::to_string_pretty(variants)? + "\n",
        Format::Csv => report::csv(&named, &[]),
    })
}

fn print(text: &str) -> Result<(), Error> {
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes())?;
    Ok(stdout.flush()?)
}

fn machine_name(arguments: &SimulateArguments) -> String {
    match &arguments.config {
        Some(path) => path.display().to_string(),
        None => arguments.preset.clone(),
    }
}

fn config(arguments: &SimulateArguments) -> Result<Config, Error> {
    let settings = &arguments.settings;
    Ok(match &arguments.config {
        Some(path) => Config::parse(&read(path)?, settings)?,
        None => Config::preset(&arguments.preset, settings)?,
    })
}

fn read(path: &Path) -> Result<String, Error> {
    std::fs::read_to_string(path).map_err(|source| Error::File { path: path.to_owned(), source })
}

/// The greatest number of machines of a range.
const MAX_MACHINES: u32 = 64;

/// The greatest number of machines of all combinations.
const MAX_GRID: usize = 10_000;

/// Every combination of the values of sweeps; the last one changes fastest.
fn grid(sweeps: &[String]) -> Result<Vec<Vec<String>>, Error> {
    let mut grid = vec![Vec::new()];
    for sweep in sweeps {
        let values = sweep_values(sweep)?;
        let count = grid.len() * values.len();
        if count > MAX_GRID {
            return Err(Error::Grid(count));
        }
        let with = |settings: &Vec<String>| {
            let settings = settings.clone();
            values.iter().map(move |value| [settings.as_slice(), std::slice::from_ref(value)].concat())
        };
        grid = grid.iter().flat_map(with).collect();
    }
    Ok(grid)
}

/// The settings of a sweep.
fn sweep_values(sweep: &str) -> Result<Vec<String>, Error> {
    let wrong = || Error::Sweep(sweep.to_owned());
    let (name, values) = sweep.split_once('=').ok_or_else(wrong)?;
    let Some((first, last)) = values.split_once("..") else {
        return Ok(values.split(',').map(|value| format!("{name}={value}")).collect());
    };
    let number = |text: &str| text.trim().parse::<u32>().map_err(|_| wrong());
    let (first, last) = (number(first)?, number(last)?);
    if first > last {
        return Err(wrong());
    }
    let step = ((last - first) / MAX_MACHINES + 1) as usize;
    Ok((first..=last).step_by(step).map(|value| format!("{name}={value}")).collect())
}

/// The work of the scene, from drawing it or from a file.
fn work(arguments: &SimulateArguments) -> Result<Trace, Error> {
    match &arguments.scene {
        Some(path) if path.extension().is_some_and(|extension| extension == "json") => load(path),
        _ => {
            let folder = tempfile::tempdir()?;
            draw(arguments, folder.path())
        }
    }
}

fn load(path: &Path) -> Result<Trace, Error> {
    let trace: Trace =
        serde_json::from_str(&read(path)?).map_err(|source| Error::Trace { path: path.to_owned(), source })?;
    trace.check().map_err(|source| Error::Work { path: path.to_owned(), source })?;
    Ok(trace)
}

/// Draws the scene in a process of its own, which writes the trace.
fn draw(arguments: &SimulateArguments, folder: &Path) -> Result<Trace, Error> {
    let (trace, picture) = (folder.join("work.json"), folder.join("picture.png"));
    let mut command = Command::new(std::env::current_exe()?);
    command.arg("render").arg("--quiet").arg("--output").arg(picture);
    command.env("GAURAST_TRACE", &trace);
    if let Some(cameras) = &arguments.cameras {
        command.arg("--cameras").arg(cameras).arg("--view").arg(arguments.view.to_string());
    }
    if let Some(Size([width, height])) = arguments.size {
        command.arg("--size").arg(format!("{width}x{height}"));
    }
    if let Some(scene) = &arguments.scene {
        command.arg("--").arg(scene);
    }
    let output = command.output()?;
    if !output.status.success() {
        let message = String::from_utf8_lossy(&output.stderr);
        let message = message.trim().trim_start_matches("gaurast: ");
        return Err(Error::Draw(message.lines().next().unwrap_or_default().to_owned()));
    }
    load(&trace)
}

/// Writes the timeline of the trace's frames, repeated until it has `count` frames.
fn write_timeline(path: &Path, trace: &Trace, config: &Config, count: u16) -> Result<(), Error> {
    let simulate = |frame: &FrameWork| simulate::simulate(frame, config);
    let once: Vec<Simulation> = trace.frames.iter().map(simulate).collect();
    let frames: Vec<_> = once.into_iter().cycle().take(count.into()).collect();
    let spans = simulate::timeline(&frames, config);
    let modules = module_spans(trace, &frames, &spans, config);
    let json = schedule::chrome_trace(&spans, &modules, config);
    replace(path, &serde_json::to_vec(&json)?)
}

/// The tiles of each frame in the modules, within the frame's time in the rasterizer.
fn module_spans(trace: &Trace, frames: &[Simulation], spans: &[Span], config: &Config) -> Vec<ModuleSpan> {
    let tiles: Vec<_> = trace
        .frames
        .iter()
        .zip(frames)
        .map(|(frame, result)| {
            let frame = simulate::of_rasterizer(frame, config);
            fast::rasterize_tiles(&frame, config, result.contention_gb_s).1
        })
        .collect();
    let to_ms = 1e-6 / config.rasterizer.clock_ghz;
    let rasters = spans.iter().filter(|span| span.engine == Engine::Rasterizer);
    rasters
        .flat_map(|span| {
            let tiles = &tiles[span.frame % tiles.len()];
            tiles.iter().map(|tile| ModuleSpan {
                module: tile.module,
                frame: span.frame,
                at: tile.at,
                begin_ms: span.begin_ms + tile.begin * to_ms,
                end_ms: span.begin_ms + tile.end * to_ms,
            })
        })
        .collect()
}

fn replace(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    gaurast_picture::write_atomically(path, bytes).map_err(|source| Error::File { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweeps() {
        let values = |text: &str| sweep_values(text).unwrap_or_default();
        assert_eq!(values("modules=2..4"), ["modules=2", "modules=3", "modules=4"]);
        assert_eq!(values("saturation=none,tile"), ["saturation=none", "saturation=tile"]);
        assert!(values("batch=1..1000").len() <= 64);
        for bad in ["modules", "modules=4..2", "modules=a..b"] {
            assert!(sweep_values(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn grids_have_every_combination() {
        let of = |sweeps: &[&str]| {
            let sweeps: Vec<_> = sweeps.iter().map(ToString::to_string).collect();
            grid(&sweeps)
        };
        let all = of(&["modules=2..3", "batch=16,32,64"]).unwrap_or_default();
        assert_eq!(all.len(), 6);
        assert_eq!(all[1], ["modules=2", "batch=32"]);
        assert_eq!(all[5], ["modules=3", "batch=64"]);
        let many = ["modules=1..64", "batch=1..64", "pes_per_module=1..64"];
        assert!(matches!(of(&many), Err(Error::Grid(262_144))));
    }

    #[test]
    fn a_sweep_has_the_results_of_one_machine_after_the_other() {
        let frame = simulate::even_frame([64, 64], 1000, 0.3);
        let machines: Vec<_> = (1..8)
            .map(|modules| {
                let setting = format!("modules={modules}");
                let config = Config::preset(DEFAULT_PRESET, std::slice::from_ref(&setting));
                (setting, config.expect("a preset"))
            })
            .collect();
        let all = simulate_all(&frame, &machines);
        assert_eq!(all.len(), machines.len());
        for ((name, result), (machine, config)) in all.iter().zip(&machines) {
            assert_eq!((name, result), (machine, &simulate::simulate(&frame, config)));
        }
    }
}
