//! The options of devices: those that a program chains to `VkInstanceCreateInfo`, and those of the environment.
//!
//! A variable of the environment wins over the program's option, so that a person can change what a program asks for;
//! the settings of Khronos's layers have the same order. A trace of work goes to both. Only this file reads the
//! driver's variables (docs/environment.md), when a device is created. A wrong value, of either kind, is refused then.

use crate::abi::error::Error;
use crate::abi::guard;
use crate::abi::handle::Reporter;
use crate::abi::valid;
use ash::vk;
use gaurast::vk::{DriverOptionsGAURAST, SimdLevelGAURAST};
use simdevice::Config;
use simdevice::runtime::SimdLevel;
use simdevice::stats::optimizations::{Optimizations, UnknownOptimization};
use simdevice::stats::recorder::{Recorder, Trace};
use simdevice::timing::trace_file;
use std::ffi::{CString, c_void};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// The number of threads that a device may always have; beyond it, four for each processor are allowed.
const MIN_THREAD_LIMIT: usize = 64;

const SIMD: &str = "GAURAST_SIMD";
const THREADS: &str = "GAURAST_THREADS";
const TIMEOUT: &str = "GAURAST_TIMEOUT_MS";
const OPTIMIZATIONS: &str = "GAURAST_OPTIMIZATIONS";
const TRACE: &str = "GAURAST_TRACE";
const TIMESTAMPS: &str = "GAURAST_TIMESTAMPS";
const DUMP: &str = "GAURAST_DUMP";
const STRICT: &str = "GAURAST_STRICT";
const DEVICE_TYPE: &str = "GAURAST_DEVICE_TYPE";
const LOG: &str = "GAURAST_LOG";

/// The options that a program chains to `VkInstanceCreateInfo` as `VkDriverOptionsGAURAST`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Options {
    thread_count: u32,
    simd_level: SimdLevelGAURAST,
    shader_timeout: Duration,
    optimizations: Option<CString>,
    simulated_timestamps: bool,
    work_trace: Option<WorkTraceCallback>,
}

impl Options {
    /// The options in a chain; the default ones if it has none.
    ///
    /// # Safety
    /// The chain is valid.
    pub(crate) unsafe fn of_chain(first: *const c_void) -> Self {
        // SAFETY: the caller's promise.
        let Some(options) = (unsafe { valid::find_in_chain::<DriverOptionsGAURAST<'_>>(first) }) else {
            return Self::default();
        };
        Self {
            thread_count: options.thread_count,
            simd_level: options.simd_level,
            shader_timeout: Duration::from_nanos(options.shader_timeout),
            // SAFETY: the caller's promise.
            optimizations: unsafe { valid::string(options.p_optimizations) }.map(CString::from),
            simulated_timestamps: options.simulated_timestamps != vk::FALSE,
            work_trace: options
                .pfn_work_trace
                .map(|function| WorkTraceCallback { function, user_data: options.p_user_data }),
        }
    }

    /// The configuration of a device. Failures to write its trace go to `reporter`.
    ///
    /// # Errors
    /// [`Error::InitializationFailed`] for a wrong value of the environment, [`Error::InvalidUsage`] for one of the
    /// program.
    pub(crate) fn device_config(&self, reporter: Arc<dyn Reporter + Send + Sync>) -> Result<Config, Error> {
        let environment = Environment::read()?;
        let mut config = self.config(&environment)?;
        let file = environment.trace.map(PathBuf::from);
        if file.is_some() || self.work_trace.is_some() {
            let receivers = TraceReceivers { callback: self.work_trace, file, reporter };
            config.recorder = Some(Arc::new(Recorder::new(move |trace| receivers.give(&trace))));
        }
        Ok(config)
    }

    /// Reports whether timestamps of devices that are created now count the simulated hardware's time.
    ///
    /// # Errors
    /// As [`Options::device_config`].
    pub(crate) fn has_simulated_timestamps(&self) -> Result<bool, Error> {
        self.simulated_timestamps(&Environment::read()?)
    }

    /// The configuration without a recorder.
    fn config(&self, environment: &Environment) -> Result<Config, Error> {
        let mut config = Config {
            threads: self.threads(environment)?,
            simd: self.simd(environment)?,
            optimizations: self.optimizations(environment)?,
            simulated_timestamps: self.simulated_timestamps(environment)?,
            ..Config::default()
        };
        if let Some(timeout) = self.timeout(environment)? {
            config.shader_timeout = timeout;
        }
        Ok(config)
    }

    fn threads(&self, environment: &Environment) -> Result<usize, Error> {
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        let most = MIN_THREAD_LIMIT.max(4 * processors);
        let limit = format!("there are {processors} processors, and at most {most} threads are started");
        let Some(text) = &environment.threads else {
            let count = self.thread_count as usize;
            return if count <= most {
                Ok(count)
            } else {
                Err(wrong("VUID-VkDriverOptionsGAURAST-threadCount-91001", count, &limit))
            };
        };
        match text.parse() {
            Ok(count) if count <= most => Ok(count),
            Ok(_) => Err(wrong_variable(THREADS, text, &limit)),
            Err(_) => Err(wrong_variable(THREADS, text, "it is no number of threads")),
        }
    }

    fn simd(&self, environment: &Environment) -> Result<SimdLevel, Error> {
        if let Some(name) = &environment.simd {
            return SimdLevel::from_name(name).ok_or_else(|| {
                let names: Vec<_> = SimdLevel::NAMES.iter().map(|(name, _)| *name).collect();
                wrong_variable(SIMD, name, &format!("it is none of {}", names.join(", ")))
            });
        }
        match self.simd_level {
            SimdLevelGAURAST::BEST => Ok(SimdLevel::Best),
            SimdLevelGAURAST::SSE2 => Ok(SimdLevel::Baseline),
            SimdLevelGAURAST::AVX2 => Ok(SimdLevel::Avx2),
            SimdLevelGAURAST::AVX512 => Ok(SimdLevel::Avx512),
            other => Err(wrong(
                "VUID-VkDriverOptionsGAURAST-simdLevel-parameter",
                other.as_raw(),
                "it is no VkSimdLevelGAURAST",
            )),
        }
    }

    /// The longest time of a batch of shader invocations, if one is given.
    fn timeout(&self, environment: &Environment) -> Result<Option<Duration>, Error> {
        match &environment.timeout {
            Some(text) => match text.parse() {
                Ok(milliseconds) => Ok(Some(Duration::from_millis(milliseconds))),
                Err(_) => Err(wrong_variable(TIMEOUT, text, "it is no number of milliseconds")),
            },
            None => Ok(Some(self.shader_timeout).filter(|timeout| !timeout.is_zero())),
        }
    }

    fn optimizations(&self, environment: &Environment) -> Result<Optimizations, Error> {
        if let Some(names) = &environment.optimizations {
            let unknown = |error: UnknownOptimization| wrong_variable(OPTIMIZATIONS, names, &error.to_string());
            return names.parse().map_err(unknown);
        }
        let Some(names) = &self.optimizations else {
            return Ok(Optimizations::default());
        };
        let text = names
            .to_str()
            .map_err(|_| wrong("VUID-VkDriverOptionsGAURAST-pOptimizations-parameter", names, "it is not UTF-8"))?;
        text.parse().map_err(|error: UnknownOptimization| {
            wrong("VUID-VkDriverOptionsGAURAST-pOptimizations-91002", names, &error.to_string())
        })
    }

    fn simulated_timestamps(&self, environment: &Environment) -> Result<bool, Error> {
        match environment.timestamps.as_deref() {
            None => Ok(self.simulated_timestamps),
            Some("host") => Ok(false),
            Some("simulated") => Ok(true),
            Some(other) => Err(wrong_variable(TIMESTAMPS, other, "it is neither host nor simulated")),
        }
    }
}

/// The error of an option of the program. `rule` is the valid usage's id, whose last part but one is the member.
fn wrong(rule: &'static str, value: impl std::fmt::Debug, reason: &str) -> Error {
    let member = rule.rsplit('-').nth(1).unwrap_or(rule);
    Error::usage(rule, format!("VkDriverOptionsGAURAST::{member} is {value:?}: {reason}"))
}

/// The error of a variable of the environment.
fn wrong_variable(name: &str, value: &str, reason: &str) -> Error {
    Error::InitializationFailed(format!("{name}={value}: {reason}"))
}

/// The variables that are set, and not empty.
#[derive(Debug, Default)]
struct Environment {
    simd: Option<String>,
    threads: Option<String>,
    timeout: Option<String>,
    optimizations: Option<String>,
    timestamps: Option<String>,
    trace: Option<String>,
}

impl Environment {
    fn read() -> Result<Self, Error> {
        Ok(Self {
            simd: variable(SIMD)?,
            threads: variable(THREADS)?,
            timeout: variable(TIMEOUT)?,
            optimizations: variable(OPTIMIZATIONS)?,
            timestamps: variable(TIMESTAMPS)?,
            trace: variable(TRACE)?,
        })
    }
}

fn variable(name: &str) -> Result<Option<String>, Error> {
    match std::env::var(name) {
        Ok(value) => Ok(Some(value).filter(|value| !value.is_empty())),
        Err(std::env::VarError::NotPresent) => Ok(None),
        Err(std::env::VarError::NotUnicode(_)) => Err(Error::InitializationFailed(format!("{name} is not text"))),
    }
}

/// The level of the log where the Vulkan loader loads the driver, as a filter of the crate `env_logger`.
pub fn log_filter() -> String {
    std::env::var(LOG).unwrap_or_else(|_| "warn".to_owned())
}

/// Reports whether devices refuse the use of what they support and the application did not enable.
///
/// # Errors
/// [`Error::InitializationFailed`] for another value than 0 and 1.
pub(crate) fn is_strict() -> Result<bool, Error> {
    parse_switch(STRICT, variable(STRICT)?.as_deref())
}

/// A switch that is off, unless it is set.
fn parse_switch(name: &str, value: Option<&str>) -> Result<bool, Error> {
    match value {
        None | Some("0") => Ok(false),
        Some("1") => Ok(true),
        Some(other) => Err(wrong_variable(name, other, "it is neither 0 nor 1")),
    }
}

/// The type of device that applications are told of. It is that of a processor unless another one is asked for.
///
/// # Errors
/// [`Error::InitializationFailed`] for an unknown name.
pub(crate) fn device_type() -> Result<vk::PhysicalDeviceType, Error> {
    parse_device_type(variable(DEVICE_TYPE)?.as_deref())
}

fn parse_device_type(name: Option<&str>) -> Result<vk::PhysicalDeviceType, Error> {
    match name {
        None | Some("cpu") => Ok(vk::PhysicalDeviceType::CPU),
        Some("discrete") => Ok(vk::PhysicalDeviceType::DISCRETE_GPU),
        Some("integrated") => Ok(vk::PhysicalDeviceType::INTEGRATED_GPU),
        Some("virtual") => Ok(vk::PhysicalDeviceType::VIRTUAL_GPU),
        Some("other") => Ok(vk::PhysicalDeviceType::OTHER),
        Some(name) => {
            Err(wrong_variable(DEVICE_TYPE, name, "it is none of cpu, discrete, integrated, virtual and other"))
        }
    }
}

/// The texts that are printed for readers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Dump {
    /// True to print the device's programs when pipelines are created.
    pub(crate) ir: bool,
}

impl Dump {
    /// The texts that the environment asks to print.
    ///
    /// # Errors
    /// [`Error::InitializationFailed`] for an unknown name.
    pub(crate) fn of_environment() -> Result<Self, Error> {
        Self::parse(variable(DUMP)?.as_deref().unwrap_or_default())
    }

    fn parse(names: &str) -> Result<Self, Error> {
        let mut dump = Self::default();
        for name in names.split(',').filter(|name| !name.is_empty()) {
            match name {
                "ir" => dump.ir = true,
                _ => return Err(wrong_variable(DUMP, names, "it is not ir")),
            }
        }
        Ok(dump)
    }
}

/// The program's function that receives traces of work.
#[derive(Clone, Copy, Debug)]
struct WorkTraceCallback {
    function: unsafe extern "system" fn(*mut c_void, usize, *const c_void),
    user_data: *mut c_void,
}

// SAFETY: `user_data` is the program's and only handed back to its function, which may be called on any thread.
unsafe impl Send for WorkTraceCallback {}
// SAFETY: as for `Send`.
unsafe impl Sync for WorkTraceCallback {}

/// The receivers of a device's trace of work.
struct TraceReceivers {
    callback: Option<WorkTraceCallback>,
    file: Option<PathBuf>,
    reporter: Arc<dyn Reporter + Send + Sync>,
}

impl TraceReceivers {
    /// Gives the trace to the program's function and writes it to the file. A failure is reported.
    fn give(&self, trace: &Trace) {
        let bytes = match trace_file::to_bytes(trace) {
            Ok(bytes) => bytes,
            Err(error) => return self.report(&error.to_string()),
        };
        if let Some(WorkTraceCallback { function, user_data }) = self.callback {
            // SAFETY: the program keeps the function callable until its devices are destroyed.
            unsafe { function(user_data, bytes.len(), bytes.as_ptr().cast()) };
        }
        if let Some(file) = &self.file
            && let Err(error) = std::fs::write(file, &bytes)
        {
            self.report(&format!("{TRACE}={}: {error}", Path::display(file)));
        }
    }

    fn report(&self, reason: &str) {
        let error = Error::TraceNotWritten(reason.to_owned());
        guard::report(Some(&*self.reporter), "vkDestroyDevice", &error);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simdevice::stats::optimizations::Optimization;

    /// The configuration from a variable alone.
    fn config_of(set: impl FnOnce(&mut Environment)) -> Result<Config, Error> {
        let mut environment = Environment::default();
        set(&mut environment);
        Options::default().config(&environment)
    }

    fn some(text: &str) -> Option<String> {
        Some(text.to_owned())
    }

    #[test]
    fn variables_are_understood_or_refused() {
        assert_eq!(config_of(|_| ()).unwrap().threads, 0);
        let chosen = config_of(|environment| {
            *environment = Environment {
                simd: some("sse2"),
                threads: some("3"),
                timeout: some("250"),
                optimizations: some("blocks,bounds"),
                timestamps: some("simulated"),
                trace: None,
            }
        });
        let chosen = chosen.unwrap();
        assert_eq!((chosen.simd, chosen.threads), (SimdLevel::Baseline, 3));
        assert_eq!(chosen.shader_timeout, Duration::from_millis(250));
        assert!(chosen.optimizations.has(Optimization::Bounds) && !chosen.optimizations.has(Optimization::Ellipse));
        assert!(chosen.simulated_timestamps);
        let refused = |set: fn(&mut Environment), text: &str| {
            let error = config_of(set).unwrap_err();
            assert_eq!(error.result(), vk::Result::ERROR_INITIALIZATION_FAILED);
            assert!(error.to_string().contains(text), "{error}");
        };
        refused(|it| it.simd = some("mmx"), "GAURAST_SIMD=mmx: it is none of best, sse2");
        refused(|it| it.threads = some("-1"), "GAURAST_THREADS=-1: it is no number");
        refused(|it| it.threads = some("100000"), "GAURAST_THREADS=100000: there are ");
        refused(|it| it.timeout = some("soon"), "GAURAST_TIMEOUT_MS=soon");
        refused(|it| it.optimizations = some("blocks,much"), "GAURAST_OPTIMIZATIONS=blocks,much: \"much\" is");
        refused(|it| it.timestamps = some("device"), "GAURAST_TIMESTAMPS=device");
        assert_eq!(parse_device_type(None).unwrap(), vk::PhysicalDeviceType::CPU);
        assert_eq!(parse_device_type(Some("integrated")).unwrap(), vk::PhysicalDeviceType::INTEGRATED_GPU);
        assert!(parse_device_type(Some("gpu")).unwrap_err().to_string().contains("none of cpu"));
        assert!(parse_switch(STRICT, Some("1")).unwrap() && !parse_switch(STRICT, None).unwrap());
        assert!(!parse_switch(STRICT, Some("0")).unwrap());
        assert!(parse_switch(STRICT, Some("yes")).is_err());
        assert!(Dump::parse("ir").unwrap().ir);
        assert!(!Dump::parse("").unwrap().ir);
        assert!(Dump::parse("ir,everything").is_err());
    }

    /// The options of a structure in a chain.
    fn options_of(structure: &DriverOptionsGAURAST<'_>) -> Options {
        // SAFETY: the chain is the structure alone, which is valid.
        unsafe { Options::of_chain(std::ptr::from_ref(structure).cast()) }
    }

    #[test]
    fn options_of_the_program_are_understood_or_refused() {
        let structure = DriverOptionsGAURAST::default();
        let config = |structure| options_of(&structure).config(&Environment::default());
        let (default, chosen) = (config(structure).unwrap(), Config::default());
        assert_eq!((default.threads, default.simd), (chosen.threads, chosen.simd));
        assert_eq!(default.shader_timeout, chosen.shader_timeout);
        assert_eq!(default.optimizations, chosen.optimizations);
        let chosen = config(
            structure
                .thread_count(2)
                .simd_level(SimdLevelGAURAST::AVX2)
                .shader_timeout(1_500_000)
                .p_optimizations(c"all,-blocks".as_ptr())
                .simulated_timestamps(true),
        );
        let chosen = chosen.unwrap();
        assert_eq!((chosen.threads, chosen.simd), (2, SimdLevel::Avx2));
        assert_eq!(chosen.shader_timeout, Duration::from_micros(1500));
        assert!(chosen.optimizations.has(Optimization::Bounds) && !chosen.optimizations.has(Optimization::Blocks));
        assert!(chosen.simulated_timestamps);
        for (wrong, rule) in [
            (structure.thread_count(100_000), "threadCount-91001"),
            (structure.simd_level(SimdLevelGAURAST::from_raw(7)), "simdLevel-parameter"),
            (structure.p_optimizations(c"\xff".as_ptr()), "pOptimizations-parameter"),
            (structure.p_optimizations(c"much".as_ptr()), "pOptimizations-91002"),
        ] {
            let error = config(wrong).unwrap_err();
            assert_eq!(error.result(), vk::Result::ERROR_VALIDATION_FAILED_EXT);
            assert!(error.message_id().ends_with(rule), "{}", error.message_id());
        }
    }

    #[test]
    fn the_environment_wins() {
        let structure = DriverOptionsGAURAST::default()
            .thread_count(100_000)
            .simd_level(SimdLevelGAURAST::AVX2)
            .shader_timeout(1_000)
            .p_optimizations(c"none".as_ptr())
            .simulated_timestamps(true);
        let environment = Environment {
            simd: some("sse2"),
            threads: some("1"),
            timeout: some("7"),
            optimizations: some("bounds"),
            timestamps: some("host"),
            trace: None,
        };
        let config = options_of(&structure).config(&environment).unwrap();
        assert_eq!((config.threads, config.simd), (1, SimdLevel::Baseline));
        assert_eq!(config.shader_timeout, Duration::from_millis(7));
        assert!(config.optimizations.has(Optimization::Bounds) && !config.simulated_timestamps);
    }

    #[test]
    fn other_structures_are_ignored() {
        let last = DriverOptionsGAURAST::default().thread_count(2);
        let first = vk::ValidationFeaturesEXT {
            p_next: std::ptr::from_ref(&last).cast(),
            ..vk::ValidationFeaturesEXT::default()
        };
        // SAFETY: the chain consists of two valid structures.
        let options = unsafe { Options::of_chain(std::ptr::from_ref(&first).cast()) };
        assert_eq!(options.thread_count, 2);
    }
}
