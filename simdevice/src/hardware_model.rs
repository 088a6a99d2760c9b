//! The model of the hardware beside the command processor: what was recorded becomes counters.

use crate::runtime::Runtime;
use crate::state::Rect;
use crate::stats::counters::{Counter, Counters};
use crate::stats::recorder::Owner;
use timing::FrameWork;
use timing::config::{Config, DEFAULT_PRESET};
use timing::simulate::simulate;

/// A command processor's view of the simulated hardware, which is the paper's.
#[derive(Debug)]
pub(crate) struct HardwareModel {
    /// Whose work it accounts for: other command processors' queries have models of their own.
    owner: Owner,
    /// Read when it is first needed.
    config: Option<Config>,
    /// Queries that are active.
    queries: u32,
    /// The first frame of the recorder that was not accounted for.
    next: u64,
}

impl HardwareModel {
    /// What accounts for an owner's work.
    pub(crate) fn new(owner: Owner) -> Self {
        Self {
            owner,
            config: None,
            queries: 0,
            next: 0,
        }
    }

    /// Whether what is done is accounted for.
    fn is_on(&self, runtime: &Runtime) -> bool {
        self.queries > 0 || runtime.config().simulated_timestamps
    }

    /// Begins to account for what is done; `area` is the current pass's, if there is one.
    pub(crate) fn begin(&mut self, runtime: &Runtime, counters: &mut Counters, area: Option<Rect>) {
        self.account(runtime, counters, area);
        let recorder = runtime.query_recorder();
        recorder.listen();
        if !self.is_on(runtime) {
            // What others recorded before is none of this query's.
            recorder.work_since(self.owner, &mut self.next);
        }
        self.queries += 1;
        if let Some(area) = area {
            recorder.begin_frame(self.owner, area);
        }
    }

    /// Ends what [`HardwareModel::begin`] began.
    pub(crate) fn end(&mut self, runtime: &Runtime, counters: &mut Counters, area: Option<Rect>) {
        self.account(runtime, counters, area);
        if self.queries > 0 {
            self.queries -= 1;
            runtime.query_recorder().stop_listening();
        }
    }

    /// Counts what was recorded since the last time. What a pass does from here on is a frame of its own, as its
    /// tiles have been written: `area` is that pass's.
    pub(crate) fn account(
        &mut self,
        runtime: &Runtime,
        counters: &mut Counters,
        area: Option<Rect>,
    ) {
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

/// Adds what a frame costs.
fn add(counters: &mut Counters, frame: &FrameWork, config: &Config) {
    use Counter as C;
    // One frame at a time: a timestamp or counter after it has waited for all of it.
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
        counters.add(counter, value.max(0.0).round() as u64);
    }
}
