//! A description of the machine on which the figures were measured.

use serde::Serialize;

/// A machine as far as the system describes it.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    /// The processor's name.
    pub processor: String,
    /// Processors that the process may use.
    pub processors: usize,
    /// The processor's features by which the device selects its SIMD level.
    pub simd: Vec<String>,
    /// Bytes of memory, 0 if unknown.
    pub memory: u64,
    /// The operating system.
    pub system: String,
    /// The program's version and build profile.
    pub program: String,
    /// The average number of runnable processes in the minute before the run. More than one is a busy machine.
    pub load: f64,
}

impl Machine {
    /// The machine that runs the program.
    pub fn this() -> Self {
        let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
        let cpu = read("/proc/cpuinfo");
        let value = |name: &str| {
            let line = cpu.lines().find(|line| line.starts_with(name));
            let value = line.and_then(|line| line.split_once(':'));
            value.map_or("", |(_, value)| value.trim()).to_owned()
        };
        let flags = value("flags");
        let memory = read("/proc/meminfo");
        let memory = memory
            .lines()
            .find_map(|line| line.strip_prefix("MemTotal:"))
            .and_then(|rest| rest.trim().strip_suffix(" kB")?.parse::<u64>().ok());
        let kernel = read("/proc/sys/kernel/osrelease");
        Self {
            processor: match value("model name") {
                name if name.is_empty() => std::env::consts::ARCH.to_owned(),
                name => name,
            },
            processors: std::thread::available_parallelism().map_or(1, usize::from),
            simd: ["sse2", "sse4_2", "avx2", "avx512f"]
                .iter()
                .filter(|level| flags.split(' ').any(|flag| flag == **level))
                .map(|level| (*level).to_owned())
                .collect(),
            memory: memory.unwrap_or(0) * 1024,
            system: format!("{} {}", std::env::consts::OS, kernel.trim()),
            program: format!(
                "gaurast {}{}",
                env!("CARGO_PKG_VERSION"),
                if cfg!(debug_assertions) { ", built with debug assertions" } else { "" }
            ),
            load: read("/proc/loadavg").split(' ').next().and_then(|load| load.parse().ok()).unwrap_or(0.0),
        }
    }

    /// The description in one line.
    pub fn line(&self) -> String {
        format!(
            "{}, {} processors, {:.0} GiB, {}; {}; load {:.1}",
            self.processor,
            self.processors,
            self.memory as f64 / f64::from(1 << 30),
            self.system,
            self.program,
            self.load
        )
    }
}
