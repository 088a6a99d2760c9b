//! Arguments of commands.

use std::path::PathBuf;

use clap::Args;
use gaurast_picture::Size;

use crate::worker::{CONTENDERS, Contender};

/// Arguments of the benchmark of whole frames.
#[derive(Args)]
pub struct FramesArguments {
    /// Scene files; the synthetic benchmark scene if there is none
    pub scenes: Vec<PathBuf>,

    /// Gaussians of the synthetic scene
    #[arg(long, value_name = "N", default_value_t = 300_000)]
    pub count: usize,

    /// The pictures' size in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720")]
    pub size: Size,

    /// Measured frames of each contender, each from another viewpoint, after a first, cold one
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub runs: u32,

    /// Numbers of threads to draw with
    #[arg(long, value_name = "N,N", value_delimiter = ',', default_values_t = [1, 2])]
    pub threads: Vec<usize>,

    /// Frames whose error is measured
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub judged: u32,

    /// Writes every measured frame as a row
    #[arg(long, value_name = "FILE.csv")]
    pub csv: Option<PathBuf>,

    /// Writes everything
    #[arg(long, value_name = "FILE.json")]
    pub json: Option<PathBuf>,
}

/// Arguments of the benchmark of a viewer's frames.
#[derive(Args)]
pub struct PathArguments {
    /// Scene files
    pub scenes: Vec<PathBuf>,

    /// Gaussians of synthetic scenes, which are written to a file first
    #[arg(long = "count", value_name = "N,N", value_delimiter = ',')]
    pub counts: Vec<usize>,

    /// The pictures' size in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720")]
    pub size: Size,

    /// Frames of the path
    #[arg(long, value_name = "N", default_value_t = 240, value_parser = clap::value_parser!(u32).range(13..=10_000))]
    pub frames: u32,

    /// Threads to draw with, 0 for one for each processor
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub threads: usize,

    /// Writes every frame as a row
    #[arg(long, value_name = "FILE.csv")]
    pub csv: Option<PathBuf>,
}

/// Arguments of a sweep.
#[derive(Args)]
pub struct SweepArguments {
    /// Fewer frames of fewer pixels, and nothing that is larger than a million Gaussians
    #[arg(long)]
    pub quick: bool,

    /// The folder that CSV, JSON, PNG and SVG files go to
    #[arg(short, long, value_name = "FOLDER", default_value = "samples/benchmarks")]
    pub output: PathBuf,

    /// Measured frames of each point
    #[arg(long, value_name = "N")]
    pub runs: Option<u32>,

    /// Threads to draw with, 0 for one for each processor
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub threads: usize,
}

/// Arguments of the comparison of optimizations.
#[derive(Args)]
pub struct OptimizationsArguments {
    #[command(flatten)]
    pub sweep: SweepArguments,

    /// Counts instructions of a frame with and without each, by Callgrind, instead of measuring time
    #[arg(long)]
    pub instructions: bool,

    /// Counts for optimizations of these names only
    #[arg(long, value_name = "NAME", requires = "instructions")]
    pub only: Vec<String>,
}

/// Arguments of the sweep over settings.
#[derive(Args)]
pub struct ParetoArguments {
    #[command(flatten)]
    pub sweep: SweepArguments,

    /// A folder with cameras/*.json and splats/* [default: GAURAST_TEST_DATA of the environment]
    ///
    /// Missing cameras are replaced by an orbit; missing scenes are left out.
    #[arg(long, value_name = "FOLDER")]
    pub data: Option<PathBuf>,

    /// Leaves out settings of other names; "as meant" compares with the peers alone
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,

    /// Leaves out a contender: "quads on gaurast", say, which takes most of the time
    #[arg(long, value_name = "NAME", value_parser = contender)]
    pub without: Vec<Contender>,
}

/// The contender of a name.
fn contender(name: &str) -> Result<Contender, String> {
    let found = CONTENDERS.into_iter().find(|one| one.name() == name);
    found.ok_or_else(|| format!("it is one of {:?}", CONTENDERS.map(Contender::name)))
}
