//! Times triangles on this driver and on lavapipe, run by run in turn, and prints the ratio of each
//! workload, their geometric mean, and the most memory that a process of each device needs.
//!
//! Both get as many threads as there are processors, unless `GAURAST_THREADS` and `LP_NUM_THREADS`
//! say otherwise; they should be set alike. `--simd LEVEL` chooses this driver's SIMD level (as
//! `GAURAST_SIMD` does), `--scene NAME` one workload, and `--no-memory` leaves out the processes
//! that measure memory.
//!
//! `--runs-of DEVICE NAME TIMES BY` does a workload so many times and says nothing, with width,
//! height and numbers of triangles divided by `BY`: for counts of instructions, which are those
//! of more runs less those of fewer. DEVICE is `own` or `lavapipe`.

use std::error::Error;
use std::process::Command;
use std::time::{Duration, Instant};

use gaurast_testkit::Gpu;
use gaurast_testkit::Settings;
use gaurast_tests::triangles::workloads::{NAMES, Workload};

/// Runs of each workload that are timed.
const RUNS: usize = 7;

/// Given to a process that only measures memory: the device, and the workload.
const MEMORY: &str = "--memory-of";

/// Given to a process that only does a workload, for counts.
const RUNS_OF: &str = "--runs-of";

type Failure = Box<dyn Error>;

fn time(workload: &Workload) -> Duration {
    let started = Instant::now();
    workload.run();
    started.elapsed()
}

fn median(mut times: Vec<Duration>) -> f64 {
    times.sort_unstable();
    times[times.len() / 2].as_secs_f64() * 1e3
}

fn open(device: &str) -> Result<Gpu, Failure> {
    Ok(match device {
        "own" => Gpu::embedded(&Settings::default())?,
        _ => Gpu::lavapipe()?,
    })
}

/// The most memory that this process has had, in MiB, as Linux counts it.
fn peak_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kibibytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kibibytes / 1024.0)
}

/// The peak of a process that does a workload twice on one device.
fn memory_of(device: &str, name: &str) -> Option<f64> {
    let output = Command::new(std::env::current_exe().ok()?)
        .args([MEMORY, device, name])
        .output()
        .ok()?;
    String::from_utf8_lossy(&output.stdout).trim().parse().ok()
}

/// What [`memory_of`] starts.
fn measure_memory(device: &str, name: &str) -> Result<(), Failure> {
    let gpu = open(device)?;
    let workload = Workload::new(&gpu, name)?;
    workload.run();
    workload.run();
    println!("{}", peak_memory().ok_or("this system does not tell")?);
    Ok(())
}

/// Does a smaller workload some times.
fn run(device: &str, name: &str, times: &str, by: &str) -> Result<(), Failure> {
    let gpu = open(device)?;
    let workload = Workload::smaller(&gpu, name, by.parse()?)?;
    (0..times.parse()?).for_each(|_: u32| workload.run());
    Ok(())
}

fn compare(own: &Gpu, lavapipe: &Gpu, name: &str, with_memory: bool) -> Result<f64, Failure> {
    let (ours, theirs) = (Workload::new(own, name)?, Workload::new(lavapipe, name)?);
    // The first run touches memory, and is not counted.
    ours.run();
    theirs.run();
    let (mut our_times, mut their_times) = (Vec::new(), Vec::new());
    for _ in 0..RUNS {
        our_times.push(time(&ours));
        their_times.push(time(&theirs));
    }
    let (ours, theirs) = (median(our_times), median(their_times));
    let memory = |device| match with_memory.then(|| memory_of(device, name)).flatten() {
        Some(mebibytes) => format!("{mebibytes:.0}"),
        None => "-".to_owned(),
    };
    let ratio = ours / theirs;
    println!(
        "{name:<22}{ours:>10.2}{theirs:>13.2}{ratio:>10.2}{:>10}{:>13}",
        memory("own"),
        memory("lavapipe")
    );
    Ok(ratio)
}

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [flag, device, name] = &arguments[..]
        && flag == MEMORY
    {
        return measure_memory(device, name);
    }
    if let [flag, device, name, times, by] = &arguments[..]
        && flag == RUNS_OF
    {
        return run(device, name, times, by);
    }
    let value_of = |flag: &str| {
        let position = arguments.iter().position(|argument| argument == flag)?;
        arguments.get(position + 1).cloned()
    };
    if let Some(level) = value_of("--simd") {
        // SAFETY: there are no other threads yet.
        unsafe { std::env::set_var("GAURAST_SIMD", level) };
    }
    let with_memory = !arguments.iter().any(|argument| argument == "--no-memory");
    let only = value_of("--scene");
    let own = open("own")?;
    let lavapipe = match Gpu::lavapipe() {
        Ok(lavapipe) => lavapipe,
        Err(error) => {
            println!("There is nothing to compare with: {error}.");
            return Ok(());
        }
    };
    println!(
        "{} beside {}, median of {RUNS} runs, 1920x1080",
        own.name(),
        lavapipe.name()
    );
    println!(
        "{:<22}{:>10}{:>13}{:>10}{:>10}{:>13}",
        "workload", "own ms", "lavapipe ms", "own / lp", "own MiB", "lavapipe MiB"
    );
    let mut logarithms = Vec::new();
    for name in NAMES {
        if only.as_deref().is_some_and(|only| only != name) {
            continue;
        }
        match compare(&own, &lavapipe, name, with_memory) {
            Ok(ratio) => logarithms.push(ratio.ln()),
            Err(error) => println!("{name:<22}left out: {error}"),
        }
    }
    let mean = (logarithms.iter().sum::<f64>() / logarithms.len() as f64).exp();
    println!("{:<22}{mean:>33.2}", "geometric mean");
    Ok(())
}
