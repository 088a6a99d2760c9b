//! The machines of a simulation, one or those of a sweep, and their results.

use std::sync::atomic::{AtomicUsize, Ordering};

use serde::Serialize;
use thiserror::Error;
use timing::area::{self, Area};
use timing::config::{Config, ConfigError};
use timing::simulate::{Shared, Simulation};
use timing::work::{FrameWork, TRACE_VERSION, Trace};
use timing_studies::rivals::{self, Quads};
use timing_studies::simt::{self, Simt};

/// The reason that a sweep has no machines. Displayed as one sentence.
#[derive(Debug, Error)]
pub enum SweepError {
    #[error("--sweep {0}: not NAME=FIRST..LAST or NAME=VALUE,VALUE,...")]
    Form(String),
    #[error("--sweep: {0} machines, and at most {MAX_MACHINES}")]
    TooMany(u64),
    #[error(transparent)]
    Config(#[from] ConfigError),
}

/// A configuration of the hardware, with its name in tables.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    pub name: String,
    pub config: Config,
}

/// A frame of a trace on a machine.
#[derive(Clone, Debug, PartialEq)]
pub struct MachineResult {
    /// The frame's number, from 0.
    pub frame: usize,
    pub machine: Machine,
    pub simulation: Simulation,
}

/// Simulates the trace's last frame on every machine. Each of the host's cores takes the next machine when it is free.
pub fn simulate_all(trace: &Trace, machines: &[Machine]) -> Vec<MachineResult> {
    let Some(frame) = trace.frames.last() else {
        return Vec::new();
    };
    let number = trace.frames.len() - 1;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let shared = Shared::new(frame);
    // Machines that share batches come one after the other.
    let mut order: Vec<_> = (0..machines.len()).collect();
    order.sort_by_cached_key(|&index| format!("{:?}", machines[index].config.rasterizer.of_lists()));
    let next = AtomicUsize::new(0);
    let take = || {
        let &index = order.get(next.fetch_add(1, Ordering::Relaxed))?;
        let machine = machines.get(index)?;
        let simulation = shared.simulate(&machine.config);
        Some((index, MachineResult { frame: number, machine: machine.clone(), simulation }))
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

/// The greatest number of machines of a sweep.
pub const MAX_MACHINES: u64 = 10_000;

/// The configuration with every combination of the values of sweeps; the last one changes fastest.
pub fn sweep(sweeps: &[String], config: &Config) -> Result<Vec<Machine>, SweepError> {
    let machine = |settings: Vec<String>| Ok(Machine { name: settings.join(" "), config: config.with(&settings)? });
    let machines: Result<Vec<_>, ConfigError> = combinations(sweeps)?.into_iter().map(machine).collect();
    Ok(machines?)
}

/// The settings of every combination.
fn combinations(sweeps: &[String]) -> Result<Vec<Vec<String>>, SweepError> {
    let mut combinations = vec![Vec::new()];
    for sweep in sweeps {
        let values = sweep_values(sweep)?;
        let count = combinations.len() as u64 * values.len() as u64;
        if count > MAX_MACHINES {
            return Err(SweepError::TooMany(count));
        }
        let with = |settings: &Vec<String>| {
            let settings = settings.clone();
            values.iter().map(move |value| [settings.as_slice(), std::slice::from_ref(value)].concat())
        };
        combinations = combinations.iter().flat_map(with).collect();
    }
    Ok(combinations)
}

/// The settings of a sweep: the values of a list, or every number of a range.
fn sweep_values(sweep: &str) -> Result<Vec<String>, SweepError> {
    let wrong = || SweepError::Form(sweep.to_owned());
    let (name, values) = sweep.split_once('=').ok_or_else(wrong)?;
    let Some((first, last)) = values.split_once("..") else {
        return Ok(values.split(',').map(|value| format!("{name}={value}")).collect());
    };
    let number = |text: &str| text.trim().parse::<u32>().map_err(|_| wrong());
    let (first, last) = (number(first)?, number(last)?);
    if first > last {
        return Err(wrong());
    }
    let count = u64::from(last - first) + 1;
    if count > MAX_MACHINES {
        return Err(SweepError::TooMany(count));
    }
    Ok((first..=last).map(|value| format!("{name}={value}")).collect())
}

/// The results as JSON.
#[derive(Serialize)]
pub struct Document<'a> {
    /// The version of this program.
    version: &'static str,
    /// The version of traces that it reads.
    trace_version: u32,
    results: Vec<Entry<'a>>,
}

/// A result with all that the tables show of it.
#[derive(Serialize)]
struct Entry<'a> {
    machine: &'a str,
    /// The frame's number, from 0.
    frame: usize,
    config: &'a Config,
    simulation: &'a Simulation,
    area: Area,
    /// Stage 3 of the frame's Gaussians on a SIMT machine, with the lists of 3-sigma squares.
    simt: Simt,
    /// Stage 3 of the frame's Gaussians as blended quads.
    quads: Quads,
}

impl<'a> Document<'a> {
    pub fn of(trace: &Trace, results: &'a [MachineResult]) -> Self {
        let squares: Vec<_> = trace.frames.iter().map(FrameWork::with_squares).collect();
        let entry = |result: &'a MachineResult| Entry {
            machine: &result.machine.name,
            frame: result.frame,
            config: &result.machine.config,
            simulation: &result.simulation,
            area: area::area(&result.machine.config),
            simt: simt::simulate(&squares[result.frame], &result.machine.config),
            quads: rivals::quads(&trace.frames[result.frame], &result.machine.config),
        };
        let version = env!("CARGO_PKG_VERSION");
        Self { version, trace_version: TRACE_VERSION, results: results.iter().map(entry).collect() }
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use timing::config::DEFAULT_PRESET;
    use timing::simulate::{even_frame, simulate};

    /// A trace of one frame.
    pub fn trace(frame: FrameWork) -> Trace {
        Trace { version: TRACE_VERSION, frames: vec![frame] }
    }

    /// The default preset with a setting each.
    pub fn machines(settings: &[&str]) -> Vec<Machine> {
        let machine = |&setting: &&str| {
            let config = Config::preset(DEFAULT_PRESET, &[setting.to_owned()]);
            Machine { name: setting.to_owned(), config: config.expect("a preset") }
        };
        settings.iter().map(machine).collect()
    }

    #[test]
    fn sweeps_have_every_value() {
        let values = |text: &str| sweep_values(text).unwrap_or_default();
        assert_eq!(values("modules=2..4"), ["modules=2", "modules=3", "modules=4"]);
        assert_eq!(values("saturation=none,tile"), ["saturation=none", "saturation=tile"]);
        assert_eq!(values("modules=1..100").len(), 100);
        for bad in ["modules", "modules=4..2", "modules=a..b"] {
            assert!(sweep_values(bad).is_err(), "{bad}");
        }
        assert!(matches!(sweep_values("batch=0..4294967295"), Err(SweepError::TooMany(4_294_967_296))));
    }

    #[test]
    fn several_sweeps_have_every_combination() {
        let of = |sweeps: &[&str]| {
            let sweeps: Vec<_> = sweeps.iter().map(ToString::to_string).collect();
            combinations(&sweeps)
        };
        let all = of(&["modules=2..3", "batch=16,32,64"]).unwrap_or_default();
        assert_eq!(all.len(), 6);
        assert_eq!(all[1], ["modules=2", "batch=32"]);
        assert_eq!(all[5], ["modules=3", "batch=64"]);
        let many = ["modules=1..64", "batch=1..64", "pes_per_module=1..64"];
        assert!(matches!(of(&many), Err(SweepError::TooMany(262_144))));
    }

    #[test]
    fn a_sweep_has_the_results_of_one_machine_after_the_other() {
        let frame = even_frame([64, 64], 1000, 0.3);
        let machines = machines(&["modules=1", "modules=2", "modules=3", "modules=4", "modules=5"]);
        let all = simulate_all(&trace(frame.clone()), &machines);
        assert_eq!(all.len(), machines.len());
        for (result, machine) in all.iter().zip(&machines) {
            assert_eq!(&result.machine, machine);
            assert_eq!(result.simulation, simulate(&frame, &machine.config));
        }
    }

    #[test]
    fn json_has_the_configuration_the_area_and_the_version() {
        let trace = trace(even_frame([64, 64], 1000, 0.3));
        let results = simulate_all(&trace, &machines(&["modules=3"]));
        let json = serde_json::to_value(Document::of(&trace, &results)).expect("JSON");
        assert_eq!(json["version"], env!("CARGO_PKG_VERSION"));
        assert_eq!(json["trace_version"], TRACE_VERSION);
        let result = &json["results"][0];
        assert_eq!(result["machine"], "modules=3");
        assert_eq!(result["config"]["rasterizer"]["modules"], 3);
        for (part, number) in [("area", "module"), ("simt", "compute_ms"), ("quads", "shade_ms")] {
            assert!(result[part][number].as_f64().is_some_and(|number| number > 0.0), "{part}.{number}");
        }
        assert!(result["simulation"]["power"]["frame_w"].as_f64().is_some_and(|watts| watts > 0.0));
    }
}
