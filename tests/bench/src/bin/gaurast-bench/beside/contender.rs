//! Drivers that are compared, each in a process of its own that runs one workload when it is asked to.

use std::fmt;
use std::io::{BufRead, BufReader, Write, stdin, stdout};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::str::FromStr;
use std::time::Instant;

use clap::Args;
use gaurast_render::process_stats::{peak_memory, processor_time};
use gaurast_testkit::gpu::{Driver, Opening};
use gaurast_testkit::{Gpu, Settings};

use super::list;
use super::workload::Workload;
use crate::error::BenchError;

/// The hidden command that makes a process a worker.
const WORKER: &str = "beside-worker";

/// A driver to measure.
#[derive(Clone, Debug)]
pub(super) enum Contender {
    /// This driver, linked into the process.
    Own,
    /// The driver of a manifest, with the libraries of the system in a folder if there is one.
    Other { manifest: PathBuf, system: Option<PathBuf> },
}

impl Contender {
    /// The driver of a manifest, with this system's libraries.
    pub(super) fn of(manifest: PathBuf) -> Self {
        Self::Other { manifest, system: None }
    }
}

impl FromStr for Contender {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (manifest, system) = match text.split_once('@') {
            Some((manifest, system)) => (manifest, Some(PathBuf::from(system))),
            None => (text, None),
        };
        let manifest = PathBuf::from(manifest);
        if !manifest.is_file() {
            return Err("there is no such file".to_owned());
        }
        Ok(Self::Other { manifest, system })
    }
}

impl fmt::Display for Contender {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Own => f.write_str("this driver"),
            Self::Other { manifest, .. } => write!(f, "{}", manifest.display()),
        }
    }
}

/// Arguments of a worker.
#[derive(Args)]
pub struct WorkerArguments {
    /// The workload's name
    workload: String,

    /// The driver: this one, or the first that the loader finds
    #[arg(long)]
    loaded: bool,

    /// Threads of this driver
    #[arg(long, default_value_t = 1)]
    threads: usize,

    /// A folder of data
    #[arg(long)]
    data: Option<PathBuf>,

    /// Runs the workload this many times without being asked, for counting instructions
    #[arg(long)]
    runs: Option<u32>,
}

/// The cost of one run. Times are in milliseconds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) wall: f64,
    /// The time of all threads of the process.
    pub(super) processor: f64,
    /// The peak memory of the process so far, in MiB.
    pub(super) memory: f64,
}

/// A worker process as its parent uses it. It has prepared its workload and run it once.
pub(super) struct Process {
    child: Child,
    requests: Option<ChildStdin>,
    replies: BufReader<ChildStdout>,
    /// The driver's name and version.
    pub(super) driver: String,
}

impl Process {
    /// Starts a worker on the first `threads` processors.
    pub(super) fn start(
        contender: &Contender,
        workload: &str,
        threads: usize,
        data: Option<&Path>,
    ) -> Result<Self, BenchError> {
        // Some drivers start a thread for each processor that the process may use, and have no setting for it.
        let mut command = Command::new("taskset");
        command.args(["--cpu-list", &format!("0-{}", threads.saturating_sub(1))]);
        command.env("LP_NUM_THREADS", threads.to_string());
        if let Contender::Other { manifest, system } = contender {
            if let Some(system) = system {
                let libraries = format!("lib/{0}-linux-gnu", std::env::consts::ARCH);
                let folders = [&libraries, &format!("usr/{libraries}")].map(|folder| system.join(folder));
                command.arg(linker(system)?).arg("--library-path").arg(std::env::join_paths(folders).map_err(worker)?);
            }
            command.env("VK_DRIVER_FILES", manifest).env("VK_ICD_FILENAMES", manifest);
        }
        command.arg(std::env::current_exe()?).args([WORKER, workload, "--threads", &threads.to_string()]);
        if matches!(contender, Contender::Other { .. }) {
            command.arg("--loaded");
        }
        if let Some(data) = data {
            command.arg("--data").arg(data);
        }
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let (Some(requests), Some(replies)) = (child.stdin.take(), child.stdout.take()) else {
            unreachable!("both are pipes");
        };
        let mut process =
            Self { child, requests: Some(requests), replies: BufReader::new(replies), driver: String::new() };
        process.driver = process.reply()?;
        Ok(process)
    }

    /// Runs the workload once.
    pub(super) fn run(&mut self) -> Result<Sample, BenchError> {
        if let Some(requests) = &mut self.requests {
            requests.write_all(b"\n")?;
            requests.flush()?;
        }
        let line = self.reply()?;
        let numbers: Option<Vec<f64>> = line.split(' ').map(|number| number.parse().ok()).collect();
        match numbers.as_deref() {
            Some(&[wall, processor, memory]) => Ok(Sample { wall, processor, memory }),
            _ => Err(BenchError::Worker(format!("it said \"{line}\""))),
        }
    }

    fn reply(&mut self) -> Result<String, BenchError> {
        let mut line = String::new();
        self.replies.read_line(&mut line)?;
        match line.trim().split_once(' ') {
            Some(("done", rest)) => Ok(rest.to_owned()),
            Some(("failed", reason)) => Err(BenchError::Worker(reason.to_owned())),
            _ => Err(BenchError::Worker("it ended without a word".to_owned())),
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // The worker exits at the end of its input.
        self.requests = None;
        let _ = self.child.wait();
    }
}

/// The dynamic linker of the system in a folder.
fn linker(system: &Path) -> Result<PathBuf, BenchError> {
    let names = ["lib64/ld-linux-x86-64.so.2", "lib/ld-linux-aarch64.so.1"].map(|name| system.join(name));
    let found = names.into_iter().find(|path| path.exists());
    found.ok_or_else(|| BenchError::Worker(format!("{}: there is no dynamic linker", system.display())))
}

fn worker(error: impl fmt::Display) -> BenchError {
    BenchError::Worker(error.to_string())
}

/// The main loop of a worker process: it prepares its workload, and runs it once for each line of its input.
pub(super) fn work(arguments: &WorkerArguments) -> Result<(), BenchError> {
    let (name, mut workload) = match prepare(arguments) {
        Ok(prepared) => prepared,
        Err(reason) => {
            println!("failed {}", reason.replace('\n', " "));
            return Ok(());
        }
    };
    if let Some(runs) = arguments.runs {
        (0..runs).for_each(|_| workload.run());
        return Ok(());
    }
    // The first run touches memory for the first time, and drivers may compile in it.
    workload.run();
    println!("done {name}");
    stdout().flush()?;
    for line in stdin().lock().lines() {
        line?;
        let (start, before) = (Instant::now(), processor_time());
        workload.run();
        let (wall, after) = (start.elapsed(), processor_time());
        let processor = before.zip(after).map_or(f64::NAN, |(before, after)| (after - before).as_secs_f64());
        let memory = peak_memory().map_or(f64::NAN, |bytes| bytes as f64 / f64::from(1 << 20));
        println!("done {} {} {memory}", wall.as_secs_f64() * 1e3, processor * 1e3);
        stdout().flush()?;
    }
    Ok(())
}

/// The driver's name and version, and the prepared workload.
fn prepare(arguments: &WorkerArguments) -> Result<(String, Workload), String> {
    let opening = if arguments.loaded {
        Opening::of(Driver::Any)
    } else {
        let settings = Settings { threads: Some(arguments.threads), ..Settings::default() };
        Opening { settings, ..Opening::of(Driver::Embedded) }
    };
    let gpu = Gpu::open(&opening).map_err(|error| error.to_string())?;
    let data = arguments.data.clone().or_else(|| std::env::var_os("GAURAST_TEST_DATA").map(PathBuf::from));
    let name = gpu.name().to_owned();
    let workload = list::prepare(&gpu, &arguments.workload, arguments.threads, data.as_deref())?;
    Ok((name, workload))
}
