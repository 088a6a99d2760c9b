//! Compares the fast timing model of the rasterizer with the model that steps every cycle, on work that devices
//! recorded.

use gaurast::WorkTrace;
use simdevice::timing::config::Config;
use simdevice::timing::fast;
use simdevice::timing::work::Trace;
use timing_studies::stepped;

/// Machines on which traces are run: a preset, and its changed parameters.
const MACHINES: [(&str, &[&str]); 6] = [
    ("paper-15x16", &[]),
    ("paper-15x16", &["saturation=reached", "triangle_traversal=reached", "hierarchical_depth=true"]),
    ("paper-15x16", &["saturation=none", "batch=128", "mode_switch=100"]),
    ("paper-300", &["saturation=block", "memory.bandwidth_gb_s=20"]),
    ("single-module", &["saturation=row", "batch=8"]),
    ("fp16", &["saturation=reached", "port_bytes_per_cycle=4"]),
];

/// The trace of a device that was destroyed.
///
/// # Panics
/// If there is none, or it is invalid.
pub fn recorded(trace: &WorkTrace) -> Trace {
    let bytes = trace.take().expect("the device gave its trace");
    simdevice::timing::trace_file::from_bytes(&bytes).expect("a trace")
}

/// The differences between the fast model and the stepped model.
#[derive(Default)]
pub struct Agreement {
    /// Relative differences of cycles, and the run of each.
    errors: Vec<(f64, String)>,
}

impl Agreement {
    /// Runs every frame of a trace through both models on every machine.
    ///
    /// # Panics
    /// If the models do not agree on the amount of work.
    pub fn add(&mut self, name: &str, trace: &Trace) {
        for (number, frame) in trace.frames.iter().enumerate() {
            for (preset, settings) in MACHINES {
                let settings: Vec<_> = settings.iter().map(|&setting| setting.into()).collect();
                let machine = Config::preset(preset, &settings).expect("a machine");
                let fast = fast::rasterize(frame, &machine, 0.0);
                let slow = stepped::rasterize(frame, &machine, 0.0);
                let name = format!("{name}, frame {number}, {preset} {settings:?}");
                assert_eq!(fast.switches, slow.switches, "{name}");
                assert_eq!(fast.gaussian_evaluations, slow.gaussian_evaluations, "{name}");
                assert_eq!(fast.triangle_evaluations, slow.triangle_evaluations, "{name}");
                if slow.cycles > 0.0 {
                    let error = (fast.cycles - slow.cycles).abs() / slow.cycles;
                    self.errors.push((error, name));
                }
            }
        }
    }

    /// Checks the differences: 2 % at most and 0.5 % on average, over at least `least` runs.
    ///
    /// # Panics
    /// If a limit is exceeded.
    pub fn judge(&self, least: usize) {
        let worst = self.errors.iter().max_by(|a, b| a.0.total_cmp(&b.0));
        let (worst, name) = worst.expect("traces of something");
        let mean = self.errors.iter().map(|(error, _)| error).sum::<f64>() / self.errors.len() as f64;
        assert!(self.errors.len() >= least, "{} runs", self.errors.len());
        assert!(*worst <= 0.02, "{name}: {worst}");
        assert!(mean <= 0.005, "mean {mean}");
    }
}
