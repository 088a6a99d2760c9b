//! The schedule of frames on three engines: the shader cores run dispatches, stages 1 and 2 and fragment programs, the
//! list writer writes records into lists if the machine has one, and the rasterizer runs stage 3. Collaborative scheduling lets the next frame's stages 1 and 2 run while a frame is
//! rasterized; without it a frame ends before the next one begins. Without a rasterizer all stages run on the shader
//! cores. A stage begins when the one before it has ended for the whole frame. So fragments are not shaded while their
//! frame is still rasterized, which costs latency but, if frames overlap, no throughput.

use serde::Serialize;

/// Milliseconds of a frame's stages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Stages {
    /// Dispatches, which come first.
    pub compute: f64,
    /// Stage 1.
    pub preprocess: f64,
    /// Stage 2.
    pub sort: f64,
    /// Writing records into lists; 0 without a list writer.
    pub lists: f64,
    /// Stage 3.
    pub raster: f64,
    /// Fragment programs of triangles.
    pub shade: f64,
}

impl Stages {
    /// The sum of all stages.
    pub fn total(&self) -> f64 {
        self.compute + self.preprocess + self.sort + self.lists + self.raster + self.shade
    }
}

/// An engine of the schedule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Engine {
    /// The shader cores.
    ShaderCores,
    /// The rasterizer.
    Rasterizer,
    /// The unit that writes records into lists.
    ListWriter,
}

impl Engine {
    /// All engines.
    pub const ALL: [Self; 3] = [Self::ShaderCores, Self::Rasterizer, Self::ListWriter];
}

impl Engine {
    /// The engine's name for readers.
    pub fn name(self) -> &'static str {
        match self {
            Self::ShaderCores => "shader cores",
            Self::Rasterizer => "rasterizer",
            Self::ListWriter => "list writer",
        }
    }
}

/// A piece of work on the timeline.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Span {
    /// The engine that works.
    pub engine: Engine,
    /// The frame, from 0.
    pub frame: usize,
    /// The stage's name.
    pub stage: &'static str,
    /// Its begin, in ms.
    pub begin_ms: f64,
    /// Its end, in ms.
    pub end_ms: f64,
}

/// The ways in which frames may overlap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Policy {
    /// True if stages 1 and 2 of a frame may run at the same time as stage 3 of an earlier one.
    pub collaborative: bool,
    /// The most frames that have begun and not ended.
    pub frames_in_flight: usize,
    /// True if a rasterizer runs stage 3.
    pub has_rasterizer: bool,
}

/// The progress of a frame through its stages.
struct Progress {
    frame: usize,
    stages: Vec<(Engine, &'static str, f64)>,
    /// The number of stages begun.
    next: usize,
    /// The end of the stage before the next one, in ms.
    ready: f64,
}

/// The timeline of frames. A free engine takes the stage that can begin first, of the oldest frame if several can.
pub fn timeline(frames: &[Stages], policy: Policy) -> Vec<Span> {
    let in_flight = if policy.collaborative { policy.frames_in_flight.max(1) } else { 1 };
    let mut free = [0.0f64; Engine::ALL.len()];
    let mut spans = Vec::new();
    let mut waiting = frames.iter().enumerate();
    let mut begun: Vec<Progress> = Vec::new();
    // The ends of the frames that have ended, by frame.
    let mut ends: Vec<f64> = vec![0.0; frames.len()];
    loop {
        while begun.len() < in_flight
            && let Some((frame, stages)) = waiting.next()
        {
            let before = frame.checked_sub(in_flight).map_or(0.0, |old| ends[old]);
            begun.push(Progress::new(frame, stages, policy, before));
        }
        let start = |progress: &Progress| progress.start(&free);
        let chosen = begun.iter_mut().min_by(|a, b| start(a).total_cmp(&start(b)).then(a.frame.cmp(&b.frame)));
        let Some(progress) = chosen else {
            return spans;
        };
        let begin_ms = progress.start(&free);
        let Some(&(engine, stage, length)) = progress.stages.get(progress.next) else {
            // The frame has ended, so another may begin.
            let (frame, end) = (progress.frame, progress.ready);
            ends[frame] = end;
            begun.retain(|progress| progress.frame != frame);
            continue;
        };
        let end_ms = begin_ms + length;
        progress.next += 1;
        progress.ready = end_ms;
        free[engine as usize] = end_ms;
        spans.push(Span { engine, frame: progress.frame, stage, begin_ms, end_ms });
    }
}

impl Progress {
    fn new(frame: usize, stages: &Stages, policy: Policy, ready: f64) -> Self {
        let raster = if policy.has_rasterizer { Engine::Rasterizer } else { Engine::ShaderCores };
        let all = [
            (Engine::ShaderCores, "compute", stages.compute),
            (Engine::ShaderCores, "preprocess", stages.preprocess),
            (Engine::ShaderCores, "sort", stages.sort),
            (Engine::ListWriter, "lists", stages.lists),
            (raster, "raster", stages.raster),
            (Engine::ShaderCores, "shade", stages.shade),
        ];
        // Only stages that every frame has are shown if they take no time.
        let is_of_every_frame = |stage: &str| !matches!(stage, "compute" | "lists" | "shade");
        let shown = |&(_, stage, length): &(Engine, &str, f64)| length > 0.0 || is_of_every_frame(stage);
        Self { frame, stages: all.into_iter().filter(shown).collect(), next: 0, ready }
    }

    /// The time at which the next stage can begin, in ms; negative infinity after the last stage, so that the frame is
    /// removed first.
    fn start(&self, free: &[f64; Engine::ALL.len()]) -> f64 {
        match self.stages.get(self.next) {
            Some(&(engine, ..)) => self.ready.max(free[engine as usize]),
            None => f64::NEG_INFINITY,
        }
    }
}

/// The frame rate at which a repeated frame settles; 0 for a frame that takes no time.
pub fn fps(stages: Stages, policy: Policy) -> f64 {
    const WARM_UP: usize = 8;
    const MEASURED: usize = 64;
    /// The frames after the measured ones, which are left out because nothing holds up the last frames.
    const AFTER: usize = 8;
    let spans = timeline(&[stages; WARM_UP + MEASURED + AFTER], policy);
    let end_of = |frame: usize| {
        let ends = spans.iter().filter(|span| span.frame == frame).map(|span| span.end_ms);
        ends.fold(0.0, f64::max)
    };
    let last = end_of(WARM_UP + MEASURED - 1) - end_of(WARM_UP - 1);
    if last > 0.0 { MEASURED as f64 / last * 1e3 } else { 0.0 }
}

/// A timeline in Chrome's trace event format, which Perfetto also opens: a row per engine. Serialize it as JSON.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct ChromeTrace<T> {
    trace_events: Vec<Event>,
    display_time_unit: &'static str,
    /// Further data for readers.
    other_data: T,
}

/// An event; times are in microseconds.
#[derive(Clone, Debug, Serialize)]
struct Event {
    name: String,
    /// The type: "M" for a name of a process or thread, "X" for a span.
    ph: &'static str,
    pid: u32,
    tid: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    cat: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ts: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    dur: Option<f64>,
    args: Arguments,
}

#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
enum Arguments {
    Name(String),
    Frame(usize),
}

/// A tile's time in a module, on the timeline.
#[derive(Clone, Debug, PartialEq)]
pub struct ModuleSpan {
    /// The module, from 0.
    pub module: usize,
    /// The frame, from 0.
    pub frame: usize,
    /// Column and row of its tile.
    pub at: [u32; 2],
    /// Its begin, in ms.
    pub begin_ms: f64,
    /// Its end, in ms.
    pub end_ms: f64,
}

/// The track of the first module.
const FIRST_MODULE: u32 = 10;

/// The timeline as a Chrome trace with `other_data`. Each of `modules` has another row, on which each tile is a span.
pub fn chrome_trace<T: Serialize>(spans: &[Span], modules: &[ModuleSpan], other_data: T) -> ChromeTrace<T> {
    let track = |engine: Engine| match engine {
        Engine::ShaderCores => 1,
        Engine::Rasterizer => 2,
        Engine::ListWriter => 3,
    };
    let named = |kind: &str, tid, name: String| Event {
        name: kind.to_owned(),
        ph: "M",
        pid: 1,
        tid,
        cat: None,
        ts: None,
        dur: None,
        args: Arguments::Name(name),
    };
    let mut trace_events = vec![named("process_name", 0, "GauRast".to_owned())];
    let works = |engine: &Engine| *engine != Engine::ListWriter || spans.iter().any(|span| span.engine == *engine);
    for engine in Engine::ALL.into_iter().filter(works) {
        trace_events.push(named("thread_name", track(engine), engine.name().to_owned()));
    }
    trace_events.extend(spans.iter().map(|span| Event {
        name: format!("{} {}", span.stage, span.frame),
        ph: "X",
        pid: 1,
        tid: track(span.engine),
        cat: Some(span.stage),
        ts: Some(span.begin_ms * 1e3),
        dur: Some((span.end_ms - span.begin_ms) * 1e3),
        args: Arguments::Frame(span.frame),
    }));
    let count = modules.iter().map(|span| span.module + 1).max().unwrap_or(0);
    for module in 0..count {
        let track = FIRST_MODULE + module as u32;
        trace_events.push(named("thread_name", track, format!("module {module}")));
    }
    trace_events.extend(modules.iter().map(|span| Event {
        name: format!("tile {},{}", span.at[0], span.at[1]),
        ph: "X",
        pid: 1,
        tid: FIRST_MODULE + span.module as u32,
        cat: Some("tile"),
        ts: Some(span.begin_ms * 1e3),
        dur: Some((span.end_ms - span.begin_ms) * 1e3),
        args: Arguments::Frame(span.frame),
    }));
    ChromeTrace { trace_events, display_time_unit: "ms", other_data }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STAGES: Stages = Stages { compute: 0.0, preprocess: 20.0, sort: 10.0, lists: 0.0, raster: 12.0, shade: 0.0 };
    const POLICY: Policy = Policy { collaborative: true, frames_in_flight: 2, has_rasterizer: true };

    #[test]
    fn the_slower_engine_sets_the_pace_if_they_collaborate() {
        assert!((fps(STAGES, POLICY) - 1e3 / 30.0).abs() < 1e-9);
        let raster = Stages { raster: 50.0, ..STAGES };
        assert!((fps(raster, POLICY) - 1e3 / 50.0).abs() < 1e-9);
        let serial = Policy { collaborative: false, ..POLICY };
        assert!((fps(STAGES, serial) - 1e3 / 42.0).abs() < 1e-9);
        let one = Policy { frames_in_flight: 1, ..POLICY };
        assert!((fps(STAGES, one) - 1e3 / 42.0).abs() < 1e-9);
        // Fragments wait for the rasterizer, and the shader cores work on the next frame meanwhile.
        let shaded = Stages { shade: 5.0, ..STAGES };
        assert!((fps(shaded, POLICY) - 1e3 / 35.0).abs() < 1e-9);
        assert!((fps(shaded, serial) - 1e3 / 47.0).abs() < 1e-9);
        // A list writer of 15 ms hides behind the shader cores' 30, and one of 40 does not.
        assert!((fps(Stages { lists: 15.0, ..STAGES }, POLICY) - 1e3 / 30.0).abs() < 1e-9);
        assert!(
            (fps(Stages { lists: 40.0, ..STAGES }, Policy { frames_in_flight: 3, ..POLICY }) - 1e3 / 40.0).abs() < 1e-9
        );
        let none = Policy { has_rasterizer: false, ..POLICY };
        assert!((fps(STAGES, none) - 1e3 / 42.0).abs() < 1e-9);
    }

    #[test]
    fn an_engine_does_one_thing_at_a_time_and_stages_follow_each_other() {
        let frames: Vec<_> = (0..9)
            .map(|k| Stages {
                preprocess: f64::from(k * 7 % 5),
                sort: 1.0,
                lists: 0.0,
                raster: f64::from(k * 3 % 4),
                shade: f64::from(k * 5 % 3),
                compute: f64::from(k % 2),
            })
            .collect();
        let spans = timeline(&frames, POLICY);
        assert_eq!(spans.len(), 27 + 6 + 4);
        for (i, a) in spans.iter().enumerate() {
            assert!(a.end_ms >= a.begin_ms);
            for b in &spans[..i] {
                let apart = b.end_ms <= a.begin_ms || a.end_ms <= b.begin_ms;
                assert!(apart || a.engine != b.engine, "{a:?} {b:?}");
                assert!(a.frame != b.frame || b.end_ms <= a.begin_ms);
            }
        }
        // Two frames in flight: a third begins when the first has ended.
        let end = |frame| spans.iter().filter(|s| s.frame == frame).map(|s| s.end_ms).fold(0.0, f64::max);
        for span in &spans {
            assert!(span.frame < 2 || span.begin_ms >= end(span.frame - 2));
        }
    }

    #[test]
    fn the_trace_has_an_event_per_span() {
        let spans = timeline(&[STAGES; 3], POLICY);
        let trace = serde_json::to_value(chrome_trace(&spans, &[], [1])).unwrap();
        let events = trace["traceEvents"].as_array().unwrap();
        let complete: Vec<_> = events.iter().filter(|event| event["ph"] == "X").collect();
        assert_eq!(complete.len(), spans.len());
        let total: f64 = complete.iter().map(|event| event["dur"].as_f64().unwrap()).sum();
        assert!((total - 3.0 * 42.0 * 1e3).abs() < 1e-6);
    }
}
