//! Times compute kernels on this driver and on lavapipe, alternating between them, and prints the ratio of each.
//!
//! Both use one thread for each processor, unless `GAURAST_THREADS` and `LP_NUM_THREADS` are set; they should be set to
//! the same number. `GAURAST_SIMD` selects this driver's SIMD level.

use gaurast_tests::kernels::{Context, Prepared, Size, all};
use std::error::Error;
use std::time::{Duration, Instant};

/// The number of timed runs of each kernel.
const RUNS: usize = 7;

fn time(prepared: &Prepared) -> Result<Duration, Box<dyn Error>> {
    let started = Instant::now();
    prepared.run()?;
    Ok(started.elapsed())
}

fn median(mut times: Vec<Duration>) -> f64 {
    times.sort_unstable();
    times[times.len() / 2].as_secs_f64() * 1e3
}

fn main() -> Result<(), Box<dyn Error>> {
    let own = Context::gaurast()?;
    let Some(lavapipe) = Context::lavapipe()? else {
        println!("The Vulkan loader does not know lavapipe: there is nothing to compare with.");
        return Ok(());
    };
    println!("{} beside {}, median of {RUNS} runs", own.name, lavapipe.name);
    println!("{:<16}{:>12}{:>12}{:>10}", "kernel", "own ms", "lavapipe ms", "own / lp");
    let mut logarithms = Vec::new();
    for kernel in all(Size::Large) {
        let (ours, theirs) = (own.prepare(&kernel)?, lavapipe.prepare(&kernel)?);
        // The first run touches memory for the first time, and is not counted.
        ours.run()?;
        theirs.run()?;
        let (mut our_times, mut their_times) = (Vec::new(), Vec::new());
        for _ in 0..RUNS {
            our_times.push(time(&ours)?);
            their_times.push(time(&theirs)?);
        }
        let (ours, theirs) = (median(our_times), median(their_times));
        println!("{:<16}{ours:>12.3}{theirs:>12.3}{:>10.2}", kernel.name, ours / theirs);
        logarithms.push((ours / theirs).ln());
    }
    let mean = (logarithms.iter().sum::<f64>() / logarithms.len() as f64).exp();
    println!("{:<16}{:>34.2}", "geometric mean", mean);
    Ok(())
}
