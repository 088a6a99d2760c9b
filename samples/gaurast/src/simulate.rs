//! `gaurast simulate`: what the simulated hardware would have spent on a scene.
//!
//! The work is what the device really did: this program draws the scene once more in a process of its own, with
//! `GAURAST_TRACE` set, as one would with any other Vulkan program.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::{Args, ValueEnum};
use gaurast_picture::Size;
use thiserror::Error;
use timing::config::{Config, ConfigError, DEFAULT_PRESET};
use timing::schedule;
use timing::simulate::{self, Simulation};
use timing::what_if::{WhatIf, what_ifs};
use timing::work::{TRACE_VERSION, Trace};
use timing::{FrameWork, fast, paper, stepped};

use crate::simulate_plot as plot;
use crate::simulate_report as report;

/// Why there is no simulation. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum Error {
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error("{}: {source}", path.display())]
    File {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{}: not a trace of work: {source}", path.display())]
    Trace {
        path: PathBuf,
        source: serde_json::Error,
    },
    #[error("{}: a trace of version {found}, not {TRACE_VERSION}", path.display())]
    Version { path: PathBuf, found: u32 },
    #[error("{0}: there is no frame in the trace")]
    Empty(String),
    #[error("drawing the scene: {0}")]
    Draw(String),
    #[error("--sweep {0}: not NAME=FIRST..LAST or NAME=VALUE,VALUE,...")]
    Sweep(String),
    #[error("the plot: {0}")]
    Plot(String),
    #[error("output: {0}")]
    Output(#[from] std::io::Error),
    #[error("output: {0}")]
    Json(#[from] serde_json::Error),
}

/// How results are printed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Tables for people
    #[default]
    Table,
    /// Everything, as JSON
    Json,
    /// The main numbers, a line for each machine
    Csv,
}

#[derive(Args)]
pub struct SimulateArguments {
    /// The scene file, or a trace of work (.json); a generated garden if there is none
    pub scene: Option<PathBuf>,

    /// The hardware: paper-15x16, paper-300, single-module, fp16, orin-nx-10w, orin-nx-maxn or m2-pro
    #[arg(long, value_name = "NAME", default_value = DEFAULT_PRESET)]
    pub preset: String,

    /// The hardware, from a TOML file; it may inherit from a preset
    #[arg(long, value_name = "FILE.toml", conflicts_with = "preset")]
    pub config: Option<PathBuf>,

    /// Changes the hardware, as in modules=30 or memory.efficiency=0.8; may be given more than once
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub settings: Vec<String>,

    /// Simulates one machine after the other, as in modules=1..32 or saturation=none,tile,block
    #[arg(long, value_name = "NAME=FIRST..LAST")]
    pub sweep: Option<String>,

    /// Plots the sweep's speed-ups and energy
    #[arg(long, value_name = "FILE.svg", requires = "sweep")]
    pub plot: Option<PathBuf>,

    /// Shows what each skip would bring as hardware
    #[arg(long, conflicts_with = "sweep")]
    pub what_if: bool,

    /// Writes a timeline that chrome://tracing and Perfetto show
    #[arg(long, value_name = "FILE.json")]
    pub trace: Option<PathBuf>,

    /// Frames of the timeline
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u16).range(1..))]
    pub frames: u16,

    /// Steps the rasterizer clock by clock, too, and tells how far the fast model is off
    #[arg(long, conflicts_with_all = ["sweep", "what_if"])]
    pub stepped: bool,

    /// Prints the paper's numbers beside the model's, and nothing else
    #[arg(long, conflicts_with_all = ["scene", "sweep", "what_if", "trace", "stepped"])]
    pub paper: bool,

    /// How results are printed
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,

    /// A camera file, as for gaurast render
    #[arg(long, value_name = "FILE")]
    pub cameras: Option<PathBuf>,

    /// Which camera of the file, from 0
    #[arg(long, value_name = "N", requires = "cameras", default_value_t = 0)]
    pub view: usize,

    /// The picture's size in pixels [default: 1280x720, or the camera file's]
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,
}

/// Simulates and prints.
pub fn run(arguments: &SimulateArguments) -> Result<(), Error> {
    if arguments.paper {
        return print(&match arguments.format {
            Format::Table => report::paper(&paper::report()),
            Format::Json => serde_json::to_string_pretty(&paper::report())? + "\n",
            Format::Csv => report::paper_csv(&paper::report()),
        });
    }
    // Mistakes on the command line should not wait for a large scene.
    let config = config(arguments)?;
    let machines = match &arguments.sweep {
        Some(sweep) => sweep_values(sweep)?
            .into_iter()
            .map(|value| Ok((value.clone(), config.with(&[value])?)))
            .collect::<Result<Vec<_>, Error>>()?,
        None => vec![(machine_name(arguments), config.clone())],
    };
    let trace = work(arguments)?;
    let name = || {
        arguments
            .scene
            .as_ref()
            .map_or("the garden".to_owned(), |path| path.display().to_string())
    };
    let frame = trace.frames.last().ok_or_else(|| Error::Empty(name()))?;
    if arguments.what_if {
        let variants = what_ifs(frame, &config);
        return print(&what_if_text(arguments.format, &variants)?);
    }
    if arguments.stepped {
        return print(&report::compared(&models(&trace, &config)));
    }
    let results: Vec<_> = machines
        .iter()
        .map(|(name, config)| (name.clone(), simulate::simulate(frame, config)))
        .collect();
    if let Some(path) = &arguments.trace {
        let (_, config) = &machines[0];
        write_timeline(path, &trace, config, arguments.frames)?;
    }
    if let (Some(path), Some(sweep)) = (&arguments.plot, &arguments.sweep) {
        let swept = sweep.split('=').next().unwrap_or_default();
        let svg = plot::svg(swept, &results).map_err(Error::Plot)?;
        replace(path, svg.as_bytes())?;
    }
    print(&match (arguments.format, results.as_slice()) {
        (Format::Table, [(_, one)]) => report::one(frame, one, &config),
        (Format::Table, many) => report::many(many),
        (Format::Json, many) => serde_json::to_string_pretty(many)? + "\n",
        (Format::Csv, many) => report::csv(many),
    })
}

/// Each frame's cycles by the fast model and by the stepped one.
fn models(trace: &Trace, config: &Config) -> Vec<[f64; 2]> {
    let cycles = |frame: &FrameWork| {
        let fast = fast::rasterize(frame, config, 0.0).cycles;
        [fast, stepped::rasterize(frame, config, 0.0).cycles]
    };
    trace.frames.iter().map(cycles).collect()
}

fn what_if_text(format: Format, variants: &[WhatIf]) -> Result<String, Error> {
    let named: Vec<_> = variants
        .iter()
        .map(|variant| (variant.name.to_owned(), variant.simulation.clone()))
        .collect();
    Ok(match format {
        Format::Table => report::many(&named),
        Format::Json => serde_json::to_string_pretty(variants)? + "\n",
        Format::Csv => report::csv(&named),
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
    std::fs::read_to_string(path).map_err(|source| Error::File {
        path: path.to_owned(),
        source,
    })
}

/// The most machines of a range.
const MAX_MACHINES: u32 = 64;

/// The settings that a sweep goes through.
fn sweep_values(sweep: &str) -> Result<Vec<String>, Error> {
    let wrong = || Error::Sweep(sweep.to_owned());
    let (name, values) = sweep.split_once('=').ok_or_else(wrong)?;
    let Some((first, last)) = values.split_once("..") else {
        return Ok(values
            .split(',')
            .map(|value| format!("{name}={value}"))
            .collect());
    };
    let number = |text: &str| text.trim().parse::<u32>().map_err(|_| wrong());
    let (first, last) = (number(first)?, number(last)?);
    if first > last {
        return Err(wrong());
    }
    let step = ((last - first) / MAX_MACHINES + 1) as usize;
    Ok((first..=last)
        .step_by(step)
        .map(|value| format!("{name}={value}"))
        .collect())
}

/// The work of the scene, drawn for it or read from a file.
fn work(arguments: &SimulateArguments) -> Result<Trace, Error> {
    match &arguments.scene {
        Some(path)
            if path
                .extension()
                .is_some_and(|extension| extension == "json") =>
        {
            load(path)
        }
        _ => {
            let folder = tempfile::tempdir()?;
            draw(arguments, folder.path())
        }
    }
}

fn load(path: &Path) -> Result<Trace, Error> {
    let trace: Trace = serde_json::from_str(&read(path)?).map_err(|source| Error::Trace {
        path: path.to_owned(),
        source,
    })?;
    if trace.version != TRACE_VERSION {
        return Err(Error::Version {
            path: path.to_owned(),
            found: trace.version,
        });
    }
    Ok(trace)
}

/// Draws the scene in a process of its own, which leaves the trace.
fn draw(arguments: &SimulateArguments, folder: &Path) -> Result<Trace, Error> {
    let (trace, picture) = (folder.join("work.json"), folder.join("picture.png"));
    let mut command = Command::new(std::env::current_exe()?);
    command
        .arg("render")
        .arg("--quiet")
        .arg("--output")
        .arg(picture);
    command.env("GAURAST_TRACE", &trace);
    if let Some(cameras) = &arguments.cameras {
        command
            .arg("--cameras")
            .arg(cameras)
            .arg("--view")
            .arg(arguments.view.to_string());
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
        return Err(Error::Draw(
            message.lines().next().unwrap_or_default().to_owned(),
        ));
    }
    load(&trace)
}

/// Writes the timeline of the trace's frames, over and over.
fn write_timeline(path: &Path, trace: &Trace, config: &Config, count: u16) -> Result<(), Error> {
    let simulate = |frame: &FrameWork| simulate::simulate(frame, config);
    let once: Vec<Simulation> = trace.frames.iter().map(simulate).collect();
    let frames: Vec<_> = once.into_iter().cycle().take(count.into()).collect();
    let spans = simulate::timeline(&frames, config);
    let json = schedule::chrome_trace(&spans, config);
    replace(path, &serde_json::to_vec(&json)?)
}

fn replace(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    gaurast_picture::write_atomically(path, bytes).map_err(|source| Error::File {
        path: path.to_owned(),
        source,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweeps() {
        let values = |text: &str| sweep_values(text).unwrap_or_default();
        assert_eq!(
            values("modules=2..4"),
            ["modules=2", "modules=3", "modules=4"]
        );
        assert_eq!(
            values("saturation=none,tile"),
            ["saturation=none", "saturation=tile"]
        );
        assert!(values("batch=1..1000").len() <= 64);
        for bad in ["modules", "modules=4..2", "modules=a..b"] {
            assert!(sweep_values(bad).is_err(), "{bad}");
        }
    }
}
