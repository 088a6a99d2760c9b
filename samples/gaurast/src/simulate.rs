//! `gaurast simulate`: the estimated cost of a scene on the simulated hardware.
//!
//! The work is that of a real run: of the scene, which this program draws, or of any Vulkan program that ran with
//! `GAURAST_TRACE` set.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use gaurast_picture::Size;
use thiserror::Error;
use timing::FrameWork;
use timing::config::{Config, ConfigError, DEFAULT_PRESET};
use timing::fast::{self, TileSpan};
use timing::raster::RasterReport;
use timing::schedule::{self, Engine, ModuleSpan, Span};
use timing::simulate::{self, Simulation};
use timing::trace_file::{self, FileError};
use timing::work::Trace;
use timing_studies::what_if::{WhatIf, what_ifs};
use timing_studies::{paper, rtl, stepped};

use crate::args::RenderArguments;
use crate::render;
use crate::simulate_machines::{Document, Machine, MachineResult, SweepError, simulate_all, sweep};
use crate::simulate_plot as plot;
use crate::simulate_report as report;

/// A failure of the simulation. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum Error {
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error("{}: {source}", path.display())]
    File { path: PathBuf, source: std::io::Error },
    #[error("{}: {source}", path.display())]
    Trace { path: PathBuf, source: FileError },
    #[error("{0}: there is no frame in the trace")]
    Empty(String),
    #[error("{0}: the last frame has no work, so there is nothing to simulate")]
    NoWork(String),
    #[error("--stepped takes at most {MAX_STEPPED_PAIRS} pairs of a tile and a primitive, and the trace has {0}")]
    TooLong(u64),
    #[error("drawing the scene: {0}")]
    Draw(#[from] render::Error),
    #[error(transparent)]
    Sweep(#[from] SweepError),
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
    /// The scene file, or a trace of work (.json, or a binary one of any name); a generated garden if there is none
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

    /// Simulate one machine after the other, as in modules=1..32 or saturation=none,tile,block: every number from the
    /// first to the last; if given more than once, every combination
    #[arg(long, value_name = "NAME=FIRST..LAST")]
    pub sweep: Vec<String>,

    /// Plot the sweep's speed-ups and energy
    #[arg(long, value_name = "FILE.svg", requires = "sweep")]
    pub plot: Option<PathBuf>,

    /// Plot each machine's raster time against its area, with the Pareto front
    #[arg(long, value_name = "FILE.svg", requires = "sweep")]
    pub pareto: Option<PathBuf>,

    /// Plot the stages under the rooflines of shader cores and rasterizer
    #[arg(long, value_name = "FILE.svg", conflicts_with_all = ["sweep", "what_if", "every_frame"])]
    pub roofline: Option<PathBuf>,

    /// Draw the frame's tiles, coloured by their cycles
    #[arg(long, value_name = "FILE.svg", conflicts_with = "sweep")]
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

    /// Write a timeline of one machine for chrome://tracing and Perfetto
    #[arg(long, value_name = "FILE.json", conflicts_with = "sweep")]
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
    let machine = machine(arguments)?;
    let config = &machine.config;
    let machines = if arguments.sweep.is_empty() { vec![machine.clone()] } else { sweep(&arguments.sweep, config)? };
    let trace = work(arguments)?;
    let name = || arguments.scene.as_ref().map_or("the garden".to_owned(), |path| path.display().to_string());
    let frame = trace.frames.last().ok_or_else(|| Error::Empty(name()))?;
    if frame.pairs() == 0 && frame.shader().iter().all(|work| work.operations() == 0.0) {
        return Err(Error::NoWork(name()));
    }
    if arguments.stepped {
        return print(&report::compared(&models(&trace, config)?));
    }
    let results = if arguments.what_if {
        variants(&trace, config)
    } else if arguments.every_frame {
        every_frame(&trace, &machine)
    } else {
        simulate_all(&trace, &machines)
    };
    if let Some(path) = &arguments.trace {
        write_timeline(path, &trace, config, arguments.frames)?;
    }
    if let Some(path) = &arguments.plot {
        let swept: Vec<_> = arguments.sweep.iter().filter_map(|sweep| sweep.split('=').next()).collect();
        replace(path, plot::svg(&swept.join(", "), &results).as_bytes())?;
    }
    if let Some(path) = &arguments.pareto {
        replace(path, plot::pareto(&results).as_bytes())?;
    }
    if let (Some(path), Some(result)) = (&arguments.roofline, results.first()) {
        replace(path, plot::roofline(frame, &result.simulation, config).as_bytes())?;
    }
    if let Some(path) = &arguments.tiles {
        replace(path, plot::tiles(frame, &tile_spans(frame, config), config).as_bytes())?;
    }
    let has_one_machine = arguments.sweep.is_empty() && !arguments.what_if && !arguments.every_frame;
    print(&match (arguments.format, results.as_slice()) {
        (Format::Table, [one]) if has_one_machine => {
            report::one(frame, &one.simulation, config, &tile_spans(frame, config))
        }
        (Format::Table, many) => report::many(many),
        (Format::Json, many) => serde_json::to_string_pretty(&Document::of(&trace, many))? + "\n",
        (Format::Csv, many) => report::csv(many),
    })
}

/// The last frame on the hardware with each of the device's skips.
fn variants(trace: &Trace, config: &Config) -> Vec<MachineResult> {
    let last = trace.frames.len().saturating_sub(1);
    let simulated = |variant: WhatIf| MachineResult {
        frame: last,
        machine: Machine { name: variant.name.to_owned(), config: variant.config },
        simulation: variant.simulation,
    };
    let variants = trace.frames.last().map(|frame| what_ifs(frame, config)).unwrap_or_default();
    variants.into_iter().map(simulated).collect()
}

/// Every frame of the trace on one machine.
fn every_frame(trace: &Trace, machine: &Machine) -> Vec<MachineResult> {
    let simulated = |(number, frame)| MachineResult {
        frame: number,
        machine: Machine { name: format!("frame {number}"), ..machine.clone() },
        simulation: simulate::simulate(frame, &machine.config),
    };
    trace.frames.iter().enumerate().map(simulated).collect()
}

/// The tiles of a frame in the modules, for the frame alone.
fn tile_spans(frame: &FrameWork, config: &Config) -> Vec<TileSpan> {
    fast::rasterize_tiles(&simulate::of_rasterizer(frame, config), config, 0.0).1
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

fn print(text: &str) -> Result<(), Error> {
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes())?;
    Ok(stdout.flush()?)
}

/// The machine of the command line.
fn machine(arguments: &SimulateArguments) -> Result<Machine, Error> {
    let settings = &arguments.settings;
    Ok(match &arguments.config {
        Some(path) => {
            let text = String::from_utf8_lossy(&read(path)?).into_owned();
            Machine { name: path.display().to_string(), config: Config::parse(&text, settings)? }
        }
        None => Machine { name: arguments.preset.clone(), config: Config::preset(&arguments.preset, settings)? },
    })
}

fn read(path: &Path) -> Result<Vec<u8>, Error> {
    std::fs::read(path).map_err(|source| Error::File { path: path.to_owned(), source })
}

/// The work of the scene, from drawing it or from a file.
fn work(arguments: &SimulateArguments) -> Result<Trace, Error> {
    match &arguments.scene {
        Some(path) if is_trace(path) => load(path),
        _ => {
            let folder = tempfile::tempdir()?;
            draw(arguments, folder.path())
        }
    }
}

/// True if a file is a trace, by its name or by its first bytes.
fn is_trace(path: &Path) -> bool {
    let is_binary = || {
        let mut first = [0; trace_file::MAGIC.len()];
        let read = std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut first));
        read.is_ok() && first == trace_file::MAGIC
    };
    path.extension().is_some_and(|extension| extension == "json") || is_binary()
}

fn load(path: &Path) -> Result<Trace, Error> {
    trace_file::from_bytes(&read(path)?).map_err(|source| Error::Trace { path: path.to_owned(), source })
}

/// Draws the scene, and returns the work. The picture goes to `folder`.
fn draw(arguments: &SimulateArguments, folder: &Path) -> Result<Trace, Error> {
    let mut render = RenderArguments::default();
    render.scene.scenes.extend(arguments.scene.clone());
    render.camera.cameras.clone_from(&arguments.cameras);
    if arguments.cameras.is_some() {
        render.camera.view.push(arguments.view.to_string());
    }
    render.camera.size = arguments.size;
    render.output.output.push(folder.join("picture.png"));
    render.report.quiet = true;
    Ok(render::work(&render)?)
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
