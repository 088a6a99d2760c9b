//! The hardware model's connection to the command processor: it turns recorded work into counters.

use crate::runtime::Runtime;
use crate::state::Rect;
use crate::stats::counters::{Counter, Counters};
use crate::stats::recorder::Owner;
use timing::FrameWork;
use timing::config::{Config, DEFAULT_PRESET};
use timing::simulate::simulate;

/// Simulates the paper's hardware for the work of one command processor.
#[derive(Debug)]
pub(crate) struct HardwareModel {
    /// The command processor whose work is accounted for.
    owner: Owner,
    /// The hardware's configuration, read when it is first needed.
    config: Option<Config>,
    /// The number of active queries.
    queries: u32,
    /// The number of the first recorded frame that is not accounted for yet.
    next: u64,
}

impl HardwareModel {
    /// Makes a model of the work of `owner`.
    pub(crate) fn new(owner: Owner) -> Self {
        Self { owner, config: None, queries: 0, next: 0 }
    }

    /// True if work is accounted for at present.
    fn is_on(&self, runtime: &Runtime) -> bool {
        self.queries > 0 || runtime.config().simulated_timestamps
    }

    /// Begins a query: accounts for the work from here on. `area` is the current pass's, if there is one.
    pub(crate) fn begin(&mut self, runtime: &Runtime, counters: &mut Counters, area: Option<Rect>) {
        self.account(runtime, counters, area);
        let recorder = runtime.query_recorder();
        recorder.listen();
        if !self.is_on(runtime) {
            // Work that was recorded before the query is not part of it.
            recorder.work_since(self.owner, &mut self.next);
        }
        self.queries += 1;
        if let Some(area) = area {
            recorder.begin_frame(self.owner, area);
        }
    }

    /// Ends a query that [`HardwareModel::begin`] began.
    pub(crate) fn end(&mut self, runtime: &Runtime, counters: &mut Counters, area: Option<Rect>) {
        self.account(runtime, counters, area);
        if self.queries > 0 {
            self.queries -= 1;
            runtime.query_recorder().stop_listening();
        }
    }

    /// Adds the cost of the work that was recorded since the last call to the counters. In a pass, whose area is
    /// `area`, the work after this call is a frame of its own, because its tiles have been written.
    pub(crate) fn account(&mut self, runtime: &Runtime, counters: &mut Counters, area: Option<Rect>) {
        if !self.is_on(runtime) {
            return;
        }
        let recorder = runtime.query_recorder();
        let frames = recorder.work_since(self.owner, &mut self.next);
        if runtime.config().recorder.is_none() {
            recorder.clear(self.owner);
        }
        if let Some(area) = area {
            recorder.begin_frame(self.owner, area);
        }
        if frames.is_empty() {
            return;
        }
        let config = match &self.config {
            Some(config) => config,
            None => match Config::preset(DEFAULT_PRESET, &[]) {
                Ok(config) => self.config.insert(config),
                Err(_) => return,
            },
        };
        for frame in &frames {
            add(counters, frame, config);
        }
    }
}

/// Adds the simulated time, cycles, bytes and energy of a frame.
fn add(counters: &mut Counters, frame: &FrameWork, config: &Config) {
    use Counter as C;
    // Frames do not overlap, because a timestamp or query after a frame waits for all of it.
    let mut serial = config.clone();
    serial.schedule.collaborative = false;
    let result = simulate(frame, &serial);
    let (stages, raster, energy) = (&result.stages, &result.raster, &result.energy);
    let nanoseconds = [
        (C::SimulatedTime, stages.total()),
        (C::SimulatedCompute, stages.compute),
        (C::SimulatedPreprocess, stages.preprocess),
        (C::SimulatedSort, stages.sort),
        (C::SimulatedRaster, stages.raster),
        (C::SimulatedShade, stages.shade),
    ];
    let nanojoules = [
        (C::SimulatedArithmeticEnergy, energy.arithmetic),
        (C::SimulatedBufferEnergy, energy.buffers),
        (C::SimulatedLeakageEnergy, energy.leakage),
        (C::SimulatedMemoryEnergy, energy.memory),
        (C::SimulatedShaderEnergy, energy.shader_cores),
    ];
    let modules = &raster.modules;
    let counts = [
        (C::SimulatedRasterCycles, raster.cycles),
        (C::SimulatedBusy, modules.busy),
        (C::SimulatedDependency, modules.dependency),
        (C::SimulatedMemoryStall, modules.memory),
        (C::SimulatedController, modules.controller),
        (C::SimulatedModeSwitch, modules.mode_switch),
        (C::SimulatedIdle, modules.idle),
        (C::SimulatedSwitches, raster.switches),
        (C::SimulatedBytesIn, raster.bytes_in),
        (C::SimulatedBytesOut, raster.bytes_out),
    ];
    let millis = nanoseconds.into_iter().chain(nanojoules);
    let scaled = millis.map(|(counter, value)| (counter, value * 1e6));
    for (counter, value) in scaled.chain(counts) {
        counters.add(counter, libm::round(value.max(0.0)) as u64);
    }
}
