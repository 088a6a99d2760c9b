//! Times triangles on this driver and on lavapipe, alternating between them. Prints the ratio of each workload, their
//! geometric mean, and the peak memory of a process on each device.
//!
//! Both use one thread for each processor, unless `GAURAST_THREADS` and `LP_NUM_THREADS` are set; they should be set to
//! the same number. `GAURAST_SIMD` selects this driver's SIMD level, `--scene NAME` selects one workload, and
//! `--no-memory` omits the measurement of memory.
//!
//! `--runs-of DEVICE NAME TIMES BY` runs a workload TIMES times and prints nothing, with width, height and numbers of
//! triangles divided by `BY`. It is for counting instructions: the difference of two counts with different TIMES is the
//! cost of the additional runs. DEVICE is `own` or `lavapipe`.

use std::error::Error;
use std::process::Command;
use std::time::{Duration, Instant};

use gaurast_testkit::Gpu;
use gaurast_testkit::Settings;
use gaurast_tests::triangles::workloads::{NAMES, Workload};

/// The number of timed runs of each workload.
const RUNS: usize = 7;

/// The argument of a process that only measures memory; the device and the workload follow.
const MEMORY: &str = "--memory-of";

/// The argument of a process that only runs a workload, for counts.
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

/// The peak memory of this process in MiB, as Linux reports it.
fn peak_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kibibytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kibibytes / 1024.0)
}

/// The peak memory of a process that runs a workload twice on one device.
fn memory_of(device: &str, name: &str) -> Option<f64> {
    let output = Command::new(std::env::current_exe().ok()?).args([MEMORY, device, name]).output().ok()?;
    String::from_utf8_lossy(&output.stdout).trim().parse().ok()
}

/// The main function of the process that [`memory_of`] starts.
fn measure_memory(device: &str, name: &str) -> Result<(), Failure> {
    let gpu = open(device)?;
    let workload = Workload::new(&gpu, name)?;
    workload.run();
    workload.run();
    println!("{}", peak_memory().ok_or("this system does not tell")?);
    Ok(())
}

/// Runs a smaller workload `times` times.
fn run(device: &str, name: &str, times: &str, by: &str) -> Result<(), Failure> {
    let gpu = open(device)?;
    let workload = Workload::smaller(&gpu, name, by.parse()?)?;
    (0..times.parse()?).for_each(|_: u32| workload.run());
    Ok(())
}

fn compare(own: &Gpu, lavapipe: &Gpu, name: &str, with_memory: bool) -> Result<f64, Failure> {
    let (ours, theirs) = (Workload::new(own, name)?, Workload::new(lavapipe, name)?);
    // The first run touches memory for the first time, and is not counted.
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
    println!("{name:<22}{ours:>10.2}{theirs:>13.2}{ratio:>10.2}{:>10}{:>13}", memory("own"), memory("lavapipe"));
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
    println!("{} beside {}, median of {RUNS} runs, 1920x1080", own.name(), lavapipe.name());
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
