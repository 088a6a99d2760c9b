//! The driver's own cost, without the device: recording draws and creating pipelines.

mod work;

use clap::Args;

use crate::callgrind;
use crate::error::BenchError;
use crate::median::median;
use crate::output::Rows;
use work::Work;

/// The hidden command that makes a process a worker.
const WORKER: &str = "commands-worker";

/// Arguments of the benchmark.
#[derive(Args)]
pub struct CommandsArguments {
    /// Draws that are recorded
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    draws: u32,

    /// Pipelines that are created
    #[arg(long, value_name = "N", default_value_t = 1000)]
    pipelines: u32,

    /// Repetitions of each measurement; the median counts
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    runs: u32,

    /// Counts instructions too, by Callgrind
    #[arg(long)]
    instructions: bool,
}

/// Arguments of a worker.
#[derive(Args)]
pub struct CommandsWorkerArguments {
    draws: u32,
    pipelines: u32,

    /// Executes the draws too
    #[arg(long)]
    submit: bool,
}

/// Measures, and prints a row for each kind of work.
///
/// # Errors
/// If the driver refuses the work, or instructions can't be counted.
pub fn run(arguments: &CommandsArguments) -> Result<(), BenchError> {
    let work = Work::new(vulkan_gaurast::entry())?;
    let (draws, pipelines) = (arguments.draws, arguments.pipelines);
    let runs = || 0..arguments.runs;
    let recorded = runs().map(|_| work.record_draws(draws, false));
    let recorded = recorded.collect::<Result<Vec<_>, _>>()?;
    let created = runs().map(|_| work.create_pipelines(pipelines));
    let created = created.collect::<Result<Vec<_>, _>>()?;
    drop(work);

    let mut rows = Rows::new(&["work", "count", "ns each", "instructions each"]);
    for (name, count, times, worker) in
        [("draws recorded", draws, recorded, (draws, 0)), ("pipelines created", pipelines, created, (0, pipelines))]
    {
        let time = median(times.iter().map(std::time::Duration::as_secs_f64));
        let instructions = if arguments.instructions {
            let difference = instructions(worker)? - instructions((0, 0))?;
            format!("{:.0}", difference as f64 / f64::from(count))
        } else {
            "-".to_owned()
        };
        rows.rows.push(vec![
            name.to_owned(),
            count.to_string(),
            format!("{:.0}", 1e9 * time / f64::from(count)),
            instructions,
        ]);
    }
    println!("{}", rows.table());
    Ok(())
}

/// The instructions of a process that records `draws` draws and creates `pipelines` pipelines.
fn instructions((draws, pipelines): (u32, u32)) -> Result<u64, BenchError> {
    let arguments = [WORKER, &draws.to_string(), &pipelines.to_string()];
    Ok(callgrind::count(&arguments, &[], &[])?.instructions)
}

/// Does the work of a worker process, whose instructions are counted.
///
/// # Errors
/// If the driver refuses it.
pub fn work(arguments: &CommandsWorkerArguments) -> Result<(), BenchError> {
    let work = Work::new(vulkan_gaurast::entry())?;
    work.record_draws(arguments.draws, arguments.submit)?;
    work.create_pipelines(arguments.pipelines)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_driver_takes_the_work() {
        let work = Work::new(vulkan_gaurast::entry()).expect("a device");
        for _ in 0..2 {
            work.record_draws(10, true).expect("recorded");
            work.create_pipelines(2).expect("created");
        }
    }
}
