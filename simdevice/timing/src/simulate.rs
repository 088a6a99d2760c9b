//! The simulation of one frame on one configuration: all models of this crate combined.

use crate::config::{Config, Lists, Rasterizer, Records};
use crate::energy::{self, Changed, Energy, Power};
use crate::fast::{self, FrameLists};
use crate::plan::{self, Division, Task};
use crate::raster::RasterReport;
use crate::schedule::{self, Policy, Span, Stages};
use crate::shader_cores::{self, Roofline};
use crate::work::{DrawWork, FrameWork, Mode, Saturation};
use serde::Serialize;
use std::borrow::Cow;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// The time and energy of a frame, with the rasterizer and without it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Simulation {
    /// The rasterizer's cycles, with the overlap of frames that the configuration allows; zero if there is no
    /// rasterizer.
    pub raster: RasterReport,
    /// The rasterizer's cycles if frames don't overlap: the values of performance queries and simulated timestamps.
    pub raster_alone: RasterReport,
    /// The share of Gaussians' evaluations that changed a pixel.
    pub blended: f64,
    /// The share of triangles' evaluations that covered a pixel and passed the early tests.
    pub covered: f64,
    /// The work of the list writer.
    pub lists: ListWriting,
    /// Time of dispatches.
    pub compute: Roofline,
    /// Time of stage 1.
    pub preprocess: Roofline,
    /// Time of stage 2.
    pub sort: Roofline,
    /// Time of fragment programs.
    pub shade: Roofline,
    /// Milliseconds of the stages, with the overlap of frames that the configuration allows.
    pub stages: Stages,
    /// Milliseconds of the stages if frames don't overlap.
    pub stages_alone: Stages,
    /// GB/s that the shader cores and the list writer ask for while the rasterizer runs, which the arbiter counts with.
    pub contention_gb_s: f64,
    /// GB/s that they get while the rasterizer runs: what they ask for, as far as the rasterizer leaves it.
    pub meanwhile_gb_s: f64,
    /// Frames per second with the overlap that the configuration allows.
    pub fps: f64,
    /// Frames per second if frames overlap.
    pub fps_collaborative: f64,
    /// Frames per second if they don't.
    pub fps_serial: f64,
    /// Milliseconds of stage 3 if the shader cores draw the Gaussians, and the rasterizer only triangles.
    pub baseline_raster_ms: f64,
    /// Frames per second without a rasterizer for Gaussians.
    pub baseline_fps: f64,
    /// The speed-up of stage 3 over the baseline.
    pub raster_speedup: f64,
    /// The factors of `raster_speedup`.
    pub gains: Gains,
    /// The gain of exact lists over those of 3-sigma squares, both on shader cores. It is no part of `raster_speedup`,
    /// unless the rasterizer and the baseline have lists of different kinds.
    pub exact_lists: f64,
    /// The speed-up of frames per second over the baseline.
    pub speedup: f64,
    /// Millijoules of a frame.
    pub energy: Energy,
    /// Mean powers of the frame and of its raster stage.
    pub power: Power,
    /// Millijoules of a frame without a rasterizer for Gaussians.
    pub baseline_mj: f64,
}

/// The factors of the raster stage's speed-up over the baseline. Their product is the speed-up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gains {
    /// The gain of the hardware on the rasterizer's lists, if its PEs never waited.
    pub hardware: f64,
    /// The gain of the rasterizer's lists over the baseline's, both on shader cores.
    pub lists: f64,
    /// The time in which PEs evaluate over all their time: at most 1.
    pub stalls: f64,
}

impl Gains {
    /// No gain and no speed-up.
    const NONE: Self = Self { hardware: 1.0, lists: 1.0, stalls: 1.0 };
}

/// A frame with all that simulations on several machines share. Threads may use it at the same time.
#[derive(Debug)]
pub struct Shared<'a> {
    exact: Listed<'a>,
    squares: OnceLock<Listed<'a>>,
    /// The frame's triangles; none if all its draws are of Gaussians.
    triangles: OnceLock<Option<Listed<'a>>>,
}

/// A frame with lists of one kind.
#[derive(Debug)]
struct Listed<'a> {
    frame: Cow<'a, FrameWork>,
    baseline_evaluations: OnceLock<f64>,
    rasterizer_works: Mutex<Vec<(Division, Arc<RasterizerWork>)>>,
}

/// A frame's work for rasterizers of one division.
#[derive(Debug)]
struct RasterizerWork {
    tasks: Vec<Task>,
    changed: Changed,
    /// The lists for rasterizers that were asked for last, by what they depend on.
    lists: Mutex<VecDeque<(Rasterizer, Arc<FrameLists>)>>,
}

/// The greatest number of rasterizers whose lists are kept.
const KEPT_LISTS: usize = 16;

impl RasterizerWork {
    /// The lists for a rasterizer, made when it is first asked for.
    fn lists(&self, raster: &Rasterizer) -> Arc<FrameLists> {
        let key = raster.of_lists();
        let mut known = self.lists.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, lists)) = known.iter().find(|(of, _)| *of == key) {
            return Arc::clone(lists);
        }
        let lists = Arc::new(FrameLists::new(&self.tasks, &key));
        if known.len() == KEPT_LISTS {
            known.pop_front();
        }
        known.push_back((key, Arc::clone(&lists)));
        lists
    }
}

impl<'a> Listed<'a> {
    fn new(frame: Cow<'a, FrameWork>) -> Self {
        Self { frame, baseline_evaluations: OnceLock::new(), rasterizer_works: Mutex::default() }
    }

    /// The evaluations of stage 3 on shader cores. The original code ends a tile's list when all its pixels are
    /// finished.
    fn baseline_evaluations(&self) -> f64 {
        *self.baseline_evaluations.get_or_init(|| {
            let draws = self.frame.draws.iter();
            let gaussians = draws.filter(|draw| draw.mode == Mode::Gaussian);
            let evaluations = |draw: &DrawWork| draw.evaluations(Saturation::Tile, false);
            gaussians.map(evaluations).sum::<u64>() as f64
        })
    }

    /// The work for a rasterizer, made when it is first asked for.
    fn rasterizer_work(&self, raster: &Rasterizer) -> Arc<RasterizerWork> {
        let division = Division::of(raster);
        let mut known = self.rasterizer_works.lock().unwrap_or_else(PoisonError::into_inner);
        let found = known.iter().find(|(of, _)| *of == division);
        if let Some((_, work)) = found {
            return Arc::clone(work);
        }
        let work = Arc::new(RasterizerWork {
            tasks: plan::tasks(&self.frame, &division),
            changed: changed(&self.frame, &division),
            lists: Mutex::default(),
        });
        known.push((division, Arc::clone(&work)));
        work
    }

    /// Rasterizes while others move `others_gb_s` to and from main memory.
    fn rasterize(&self, config: &Config, others_gb_s: f64) -> RasterReport {
        let lists = self.rasterizer_work(&config.rasterizer).lists(&config.rasterizer);
        fast::rasterize_lists(&lists, config, others_gb_s).0
    }
}

impl<'a> Shared<'a> {
    /// A frame of which nothing is known yet.
    pub fn new(frame: &'a FrameWork) -> Self {
        Self { exact: Listed::new(Cow::Borrowed(frame)), squares: OnceLock::new(), triangles: OnceLock::new() }
    }

    fn listed(&self, lists: Lists) -> &Listed<'a> {
        match lists {
            Lists::Exact => &self.exact,
            Lists::Squares => self.squares.get_or_init(|| Listed::new(Cow::Owned(self.exact.frame.with_squares()))),
        }
    }

    /// Milliseconds of the frame's triangles in a rasterizer for triangles, which every GPU has: this one's modules or,
    /// if there are none, as many as the paper's, because nothing is published about the GPU's own.
    fn triangles_ms(&self, config: &Config) -> f64 {
        let triangles = self.triangles.get_or_init(|| {
            let frame = &self.exact.frame;
            let is_gaussian = |draw: &DrawWork| draw.mode == Mode::Gaussian;
            let triangles = || Listed::new(Cow::Owned(frame.of_mode(Mode::Triangle)));
            (!frame.draws.iter().all(is_gaussian)).then(triangles)
        });
        let Some(triangles) = triangles else {
            return 0.0;
        };
        let mut config = config.clone();
        if config.rasterizer.modules == 0 {
            config.rasterizer.modules = TRIANGLE_MODULES;
        }
        let report = triangles.rasterize(&config, 0.0);
        report.milliseconds(config.rasterizer.clock_ghz)
    }
}

/// The evaluations of stage 3 on shader cores. The original code ends a tile's list when all its pixels are finished.
pub fn baseline_evaluations(frame: &FrameWork) -> f64 {
    Listed::new(Cow::Borrowed(frame)).baseline_evaluations()
}

/// The kind of the lists that the configuration's stage 3 uses: the rasterizer's or, if it has no modules, the
/// baseline's.
fn lists_of_rasterizer(config: &Config) -> Lists {
    match config.rasterizer.modules {
        0 => config.baseline.lists,
        _ => config.rasterizer.lists,
    }
}

/// The frame with the lists that the configuration's stage 3 uses: the rasterizer's or, if it has no modules, the
/// baseline's.
pub fn of_rasterizer<'a>(frame: &'a FrameWork, config: &Config) -> Cow<'a, FrameWork> {
    match lists_of_rasterizer(config) {
        Lists::Exact => Cow::Borrowed(frame),
        Lists::Squares => Cow::Owned(frame.with_squares()),
    }
}

/// The number of modules of the triangle rasterizer of a GPU without GauRast: the paper's.
const TRIANGLE_MODULES: u32 = 15;

/// The times of the work on shader cores, while a rasterizer moves `rasters_bytes` for another frame.
fn on_shader_cores(frame: &FrameWork, config: &Config, rasters_bytes: f64) -> [Roofline; 4] {
    let stages = frame.shader();
    let bytes: f64 = stages.iter().map(|stage| stage.bytes).sum();
    stages.map(|mut stage| {
        if bytes > 0.0 {
            stage.bytes += rasters_bytes * stage.bytes / bytes;
        }
        shader_cores::roofline(&stage, &config.shader, &config.memory)
    })
}

/// Milliseconds of all work on shader cores.
fn milliseconds(before: &[Roofline; 4]) -> f64 {
    before.iter().map(Roofline::milliseconds).sum()
}

/// The work of the list writer for a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ListWriting {
    /// Bytes that it moves.
    pub bytes: f64,
    /// Its milliseconds: those of its cycles, or of its bytes if main memory is slower.
    pub ms: f64,
}

impl ListWriting {
    /// The work for all pairs of a frame's lists, whether a tile needs them or not.
    fn of(frame: &FrameWork, config: &Config) -> Self {
        let raster = &config.rasterizer;
        if raster.modules == 0 || raster.records == Records::Gathered {
            return Self::default();
        }
        let pairs = frame.pairs() as f64;
        let bytes = pairs * f64::from(raster.written_bytes());
        let cycles_ms = pairs * config.list_writer.cycles_per_pair / raster.clock_ghz * 1e-6;
        let memory_ms = bytes / (config.memory.bandwidth_gb_s * config.memory.efficiency * 1e6);
        Self { bytes, ms: cycles_ms.max(memory_ms) }
    }
}

/// The times of the stages of a frame, for frames one at a time or for frames that overlap.
struct Both {
    lists: ListWriting,
    shader: [Roofline; 4],
    raster: RasterReport,
    raster_ms: f64,
    contention_gb_s: f64,
}

impl Both {
    fn stages(&self) -> Stages {
        let [compute, preprocess, sort, shade] = self.shader.map(|stage| stage.milliseconds());
        Stages { compute, preprocess, sort, lists: self.lists.ms, raster: self.raster_ms, shade }
    }
}

/// The times of the stages if frames don't overlap.
fn serial(listed: &Listed, config: &Config, baseline_raster_ms: f64) -> Both {
    let has_rasterizer = config.rasterizer.modules > 0;
    let mut raster = RasterReport::default();
    let mut raster_ms = baseline_raster_ms;
    if has_rasterizer {
        raster = listed.rasterize(config, 0.0);
        raster_ms = raster.milliseconds(config.rasterizer.clock_ghz);
    }
    let lists = ListWriting::of(&listed.frame, config);
    Both { lists, shader: on_shader_cores(&listed.frame, config, 0.0), raster, raster_ms, contention_gb_s: 0.0 }
}

/// The times if a frame's work on shader cores overlaps stage 3 of another frame: both move bytes through one memory.
fn collaborative(listed: &Listed, config: &Config, alone: &Both) -> Both {
    let frame = &listed.frame;
    let moved = alone.raster.bytes_in + alone.raster.bytes_out + alone.lists.bytes;
    let shader = on_shader_cores(frame, config, moved);
    let bytes = frame.shader().iter().map(|stage| stage.bytes).sum::<f64>() + alone.lists.bytes;
    let time = milliseconds(&shader);
    let contention_gb_s = if time > 0.0 { bytes / time * 1e-6 } else { 0.0 };
    let raster = listed.rasterize(config, contention_gb_s);
    let raster_ms = raster.milliseconds(config.rasterizer.clock_ghz);
    Both { lists: alone.lists, shader, raster_ms, raster, contention_gb_s }
}

/// Simulates a frame.
pub fn simulate(frame: &FrameWork, config: &Config) -> Simulation {
    Shared::new(frame).simulate(config)
}

impl Shared<'_> {
    /// Simulates the frame on a machine, as [`simulate`] does.
    pub fn simulate(&self, config: &Config) -> Simulation {
        let of_baseline = self.listed(config.baseline.lists);
        let of_rasterizer = self.listed(lists_of_rasterizer(config));
        let triangles_ms = self.triangles_ms(config);
        let simulation = simulate_listed(of_baseline, of_rasterizer, triangles_ms, config);
        let on_cores_ms =
            |lists| shader_cores::stage_3_ms(self.listed(lists).baseline_evaluations(), config) + triangles_ms;
        let exact_ms = on_cores_ms(Lists::Exact);
        let exact_lists = if exact_ms > 0.0 { on_cores_ms(Lists::Squares) / exact_ms } else { 1.0 };
        Simulation { exact_lists, ..simulation }
    }
}

/// Simulates a frame with the baseline's lists and with the rasterizer's.
fn simulate_listed(of_baseline: &Listed, of_rasterizer: &Listed, triangles_ms: f64, config: &Config) -> Simulation {
    let policy = policy(config);
    let on_baseline = on_shader_cores(&of_baseline.frame, config, 0.0);
    let on_cores_ms = |listed: &Listed| shader_cores::stage_3_ms(listed.baseline_evaluations(), config) + triangles_ms;
    let baseline_raster_ms = on_cores_ms(of_baseline);
    let same_lists_ms = on_cores_ms(of_rasterizer);
    let baseline_ms = milliseconds(&on_baseline) + baseline_raster_ms;
    let alone = serial(of_rasterizer, config, baseline_raster_ms);
    let (raster_alone, stages_alone) = (alone.raster.clone(), alone.stages());
    let fps = |stages, collaborative| schedule::fps(stages, Policy { collaborative, ..policy });
    let fps_serial = fps(alone.stages(), false);
    let shader_ms = if policy.has_rasterizer { milliseconds(&alone.shader) } else { baseline_ms };
    let mut fps_collaborative = fps_serial;
    let mut chosen = alone;
    if policy.has_rasterizer {
        let together = collaborative(of_rasterizer, config, &chosen);
        fps_collaborative = fps(together.stages(), true);
        if policy.collaborative {
            chosen = together;
        }
    }
    let changed = of_rasterizer.rasterizer_work(&config.rasterizer).changed;
    let fps = if policy.collaborative { fps_collaborative } else { fps_serial };
    let frame_ms = if fps > 0.0 { 1e3 / fps } else { 0.0 };
    let mut energy = Energy::default();
    if policy.has_rasterizer {
        energy = energy::rasterizer(&chosen.raster, changed, frame_ms, config);
    }
    energy.list_writer = energy::list_writer_mj(chosen.lists.bytes, config);
    energy.shader_cores = energy::shader_cores_mj(shader_ms, config);
    let stages = chosen.stages();
    let moved = chosen.raster.bytes_in + chosen.raster.bytes_out;
    let raster_gb_s = if stages.raster > 0.0 { moved / stages.raster * 1e-6 } else { 0.0 };
    let left_gb_s = (config.memory.bandwidth_gb_s * config.memory.efficiency - raster_gb_s).max(0.0);
    let [compute, preprocess, sort, shade] = chosen.shader;
    let busy_ms =
        chosen.raster.modules.busy / f64::from(config.rasterizer.modules.max(1)) / config.rasterizer.clock_ghz * 1e-6;
    let gains = if policy.has_rasterizer && busy_ms > 0.0 && same_lists_ms > 0.0 {
        Gains {
            hardware: same_lists_ms / busy_ms,
            lists: baseline_raster_ms / same_lists_ms,
            stalls: busy_ms / stages.raster,
        }
    } else {
        Gains::NONE
    };
    Simulation {
        raster_alone,
        stages_alone,
        gains,
        blended: changed.blended,
        covered: changed.covered,
        lists: chosen.lists,
        compute,
        preprocess,
        sort,
        shade,
        stages,
        contention_gb_s: chosen.contention_gb_s,
        meanwhile_gb_s: chosen.contention_gb_s.min(left_gb_s),
        exact_lists: 1.0,
        fps,
        fps_collaborative,
        fps_serial,
        baseline_raster_ms,
        baseline_fps: if baseline_ms > 0.0 { 1e3 / baseline_ms } else { 0.0 },
        raster_speedup: if stages.raster > 0.0 { baseline_raster_ms / stages.raster } else { 1.0 },
        speedup: fps * baseline_ms * 1e-3,
        power: Power::of(&energy, frame_ms, stages.raster, config),
        energy,
        baseline_mj: energy::shader_cores_mj(baseline_ms, config),
        raster: chosen.raster,
    }
}

/// The overlap of frames that the configuration allows.
pub fn policy(config: &Config) -> Policy {
    Policy {
        collaborative: config.schedule.collaborative,
        frames_in_flight: config.schedule.frames_in_flight as usize,
        has_rasterizer: config.rasterizer.modules > 0,
    }
}

/// The timeline of frames.
pub fn timeline(frames: &[Simulation], config: &Config) -> Vec<Span> {
    let stages: Vec<_> = frames.iter().map(|frame| frame.stages).collect();
    schedule::timeline(&stages, policy(config))
}

/// The shares of evaluations that changed a pixel.
fn changed(frame: &FrameWork, division: &Division) -> Changed {
    let share = |mode| {
        let (mut changed, mut evaluated) = (0, 0);
        for draw in frame.draws.iter().filter(|draw| draw.mode == mode) {
            changed += draw.tiles.iter().map(|tile| tile.contributions).sum::<u64>();
            evaluated += draw.evaluations(division.granularity(mode), division.hierarchical_depth);
        }
        match evaluated {
            0 => 0.0,
            _ => (changed as f64 / evaluated as f64).min(1.0),
        }
    };
    Changed { blended: share(Mode::Gaussian), covered: share(Mode::Triangle) }
}

/// A frame of Gaussians that are spread evenly over the tiles of an image, in which no pixel finishes.
pub fn even_frame(size: [u32; 2], pairs: u64, contributions: f64) -> FrameWork {
    let [columns, rows] = size.map(|side| side.div_ceil(crate::work::TILE_SIDE));
    let tiles = u64::from(columns) * u64::from(rows);
    let tile = |index: u64| {
        let listed = (pairs * (index + 1) / tiles - pairs * index / tiles) as u32;
        let at = [(index % u64::from(columns)) as u32, (index / u64::from(columns)) as u32];
        let mut work = crate::work::TileWork::open(at, listed);
        work.contributions = (work.contributions as f64 * contributions) as u64;
        work
    };
    let draw = DrawWork { tiles: (0..tiles).map(tile).collect(), ..DrawWork::default() };
    FrameWork { size, draws: vec![draw], ..FrameWork::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::work::ShaderWork;

    fn frame() -> FrameWork {
        let mut frame = even_frame([640, 480], 1_000_000, 0.25);
        let draw = &mut frame.draws[0];
        draw.preprocess = ShaderWork { float: 3e9, bytes: 2e8, ..ShaderWork::default() };
        draw.sort = ShaderWork { integer: 5e8, bytes: 4e8, ..ShaderWork::default() };
        frame
    }

    #[test]
    fn the_speed_up_is_the_product_of_what_it_is_made_of() {
        let mut frame = frame();
        frame.draws[0].boxed_pairs = 3_000_000;
        let with = |preset: &str, settings: &[&str]| {
            let settings: Vec<_> = settings.iter().map(|&setting| setting.to_owned()).collect();
            simulate(&frame, &Config::preset(preset, &settings).unwrap())
        };
        let alike = with("paper-15x16", &[]);
        let exact = with("paper-15x16", &["baseline.lists=squares"]);
        let squares = with("paper-pipeline", &[]);
        for result in [&alike, &exact, &squares] {
            assert!((result.exact_lists - 3.0).abs() < 0.01, "{}", result.exact_lists);
            let Gains { hardware, lists, stalls } = result.gains;
            let product = hardware * lists * stalls;
            assert!((product / result.raster_speedup - 1.0).abs() < 1e-9);
            // 26.9 operations an evaluation on 282 G lanes/s, against 240 G evaluations/s.
            let lanes = 4.0 * 128.0 * 0.612 * 0.9;
            assert!((hardware - 240.0 * 26.9 / lanes).abs() < 0.05, "{hardware}");
            assert!(stalls <= 1.0);
        }
        assert!((exact.gains.lists - 3.0).abs() < 0.01);
        assert_eq!([alike.gains.lists, squares.gains.lists], [1.0; 2]);
        // Both baselines sort and evaluate the pairs of squares.
        assert!((exact.baseline_fps - squares.baseline_fps).abs() < 1e-9);
        assert!((squares.sort.memory_ms / exact.sort.memory_ms - 3.0).abs() < 0.6);
        let baseline = with("orin-nx-10w", &[]);
        assert!((baseline.fps - alike.baseline_fps).abs() < 1e-9);
        assert_eq!(baseline.gains, Gains::NONE);
    }

    #[test]
    fn one_frame_at_a_time_is_the_same_whether_others_may_overlap_or_not() {
        let overlapping = Config::preset("paper-15x16", &[]).unwrap();
        let serial = overlapping.with(&["collaborative=false".to_owned()]).unwrap();
        let (a, b) = (simulate(&frame(), &overlapping), simulate(&frame(), &serial));
        assert_eq!(a.raster_alone, b.raster);
        assert_eq!(a.raster_alone, b.raster_alone);
        assert_eq!(a.stages_alone, b.stages);
        assert!(a.contention_gb_s > 0.0 && a.raster.modules.memory > b.raster.modules.memory);
    }

    #[test]
    fn nothing_is_simulated_in_finite_numbers() {
        let config = Config::preset("paper-15x16", &[]).unwrap();
        let result = simulate(&FrameWork::default(), &config);
        let numbers = [
            result.fps,
            result.fps_serial,
            result.fps_collaborative,
            result.baseline_fps,
            result.raster_speedup,
            result.speedup,
            result.energy.total(),
        ];
        assert!(numbers.iter().all(|number| number.is_finite()), "{numbers:?}");
    }

    #[test]
    fn more_modules_are_faster_until_something_else_limits() {
        let mut last = f64::INFINITY;
        for modules in [1, 2, 4, 8, 15, 30, 60] {
            let setting = format!("modules={modules}");
            let config = Config::preset("paper-15x16", &[setting]).unwrap();
            let raster = simulate(&frame(), &config).stages.raster;
            assert!(raster <= last * 1.001, "{modules}: {raster} {last}");
            last = raster;
        }
        // A million pairs of 40 bytes cannot take less time than their bytes.
        assert!(last > 1e6 * 40.0 / (68.3e6 * 0.9));
    }

    #[test]
    fn the_baseline_has_no_rasterizer() {
        let config = Config::preset("orin-nx-10w", &[]).unwrap();
        let simulation = simulate(&frame(), &config);
        assert!((simulation.speedup - 1.0).abs() < 1e-9 && (simulation.raster_speedup - 1.0).abs() < 1e-9);
        assert!((simulation.energy.total() - simulation.baseline_mj).abs() < 1e-9);
        let paper = simulate(&frame(), &Config::preset("paper-15x16", &[]).unwrap());
        assert!((paper.baseline_fps - simulation.fps).abs() < 1e-9);
        assert!(paper.fps_collaborative > paper.fps_serial && paper.fps_serial > simulation.fps);
    }

    #[test]
    fn a_list_writer_costs_time_bytes_area_and_energy() {
        let frame = frame();
        let with = |settings: &[&str]| {
            let settings: Vec<_> = settings.iter().map(|&setting| setting.to_owned()).collect();
            let config = Config::preset("paper-15x16", &settings).unwrap();
            (simulate(&frame, &config), crate::area::area(&config))
        };
        let (gathered, area) = with(&[]);
        assert_eq!((gathered.lists, gathered.stages.lists, area.list_writer), (ListWriting::default(), 0.0, 0.0));
        assert_eq!(gathered.energy.list_writer, 0.0);
        let (listed, area) = with(&["records=listed"]);
        // A million pairs of 40 bytes in and as many out; five cycles each are longer than their bytes.
        assert!((listed.lists.bytes - 8e7).abs() < 1.0);
        assert!((listed.stages.lists - 5.0).abs() < 1e-9);
        assert!(area.list_writer > 0.0 && listed.energy.list_writer > 80e6 * 32e-9);
        assert!(listed.energy.total() > gathered.energy.total() && listed.fps_serial < gathered.fps_serial);
        // Main memory is the limit of a faster unit.
        let (fast, _) = with(&["records=listed", "list_writer.cycles_per_pair=0.5"]);
        assert!((fast.stages.lists - 8e7 / (68.3e6 * 0.9)).abs() < 1e-9);
    }

    #[test]
    fn all_units_together_move_no_more_than_memory_does() {
        let mut frame = frame();
        // Short lists: primitives and pixels alone need more than there is, and so do stages 1 and 2.
        frame.draws[0].tiles = even_frame([1280, 720], 40_000, 0.25).draws.remove(0).tiles;
        for setting in ["modules=1", "modules=15", "modules=60", "memory.efficiency=0.5"] {
            let config = Config::preset("paper-15x16", &[setting.to_owned()]).unwrap();
            let result = simulate(&frame, &config);
            let raster = (result.raster.bytes_in + result.raster.bytes_out) / result.stages.raster * 1e-6;
            let whole = config.memory.bandwidth_gb_s * config.memory.efficiency;
            assert!(result.meanwhile_gb_s > 0.0 && result.meanwhile_gb_s <= result.contention_gb_s, "{setting}");
            assert!(raster + result.meanwhile_gb_s <= whole * (1.0 + 1e-9), "{setting}: {raster} of {whole}");
        }
    }

    #[test]
    fn overlapping_frames_share_memory() {
        // Memory alone limits stages 1 and 2: a frame takes as long as all its bytes.
        let mut frame = frame();
        let [draw] = frame.draws.as_mut_slice() else { panic!("one draw") };
        draw.preprocess = ShaderWork { bytes: 2e8, ..ShaderWork::default() };
        draw.sort = ShaderWork { bytes: 4e8, ..ShaderWork::default() };
        let config = Config::preset("paper-15x16", &[]).unwrap();
        let simulation = simulate(&frame, &config);
        let bytes = 6e8 + simulation.raster.bytes_in + simulation.raster.bytes_out;
        let least_ms = bytes / (68.3e6 * 0.9);
        assert!((1e3 / simulation.fps / least_ms - 1.0).abs() < 0.01, "{} {least_ms}", simulation.fps);
        assert!(simulation.stages.raster > 0.0 && simulation.contention_gb_s < 68.3 * 0.9);
    }

    #[test]
    fn finer_saturation_never_costs_cycles() {
        // Half of each tile finishes early.
        let mut frame = frame();
        for tile in &mut frame.draws[0].tiles {
            let n = tile.listed;
            let run = |primitives, rows, blocks| crate::work::Run {
                primitives,
                rows,
                blocks,
                reached: primitives * u32::from(blocks) / 2,
                ..crate::work::Run::default()
            };
            tile.runs = vec![run(n / 3, 16, 16), run(n / 3, 12, 8)];
        }
        let mut last = f64::INFINITY;
        for saturation in ["none", "tile", "row", "block", "reached"] {
            let config = Config::preset("single-module", &[format!("saturation={saturation}")]).unwrap();
            let cycles = simulate(&frame, &config).raster.cycles;
            assert!(cycles < last, "{saturation}: {cycles} {last}");
            last = cycles;
        }
    }
    #[test]
    fn simulations_that_share_a_frame_are_those_of_the_frame_alone() {
        let mut frame = frame();
        frame.draws[0].boxed_pairs = 1_700_000;
        frame.draws[0].sized_pairs = [3_000_000, 1_000_000, 500_000, 200_000];
        for tile in &mut frame.draws[0].tiles {
            let needed = tile.listed / 2;
            tile.runs = vec![crate::work::Run {
                primitives: needed,
                rows: 11,
                blocks: 9,
                reached: needed * 5,
                ..crate::work::Run::default()
            }];
        }
        let mut triangles = even_frame([640, 480], 50_000, 0.5).draws.remove(0);
        triangles.mode = Mode::Triangle;
        frame.draws.push(triangles);
        let shared = Shared::new(&frame);
        let machines = [
            "modules=15",
            "modules=3",
            "batch=17",
            "saturation=reached",
            "saturation=row",
            "triangle_traversal=tile",
            "tile_side=32",
            "rasterizer.lists=squares",
            "baseline.lists=exact",
            "modules=0",
            "bandwidth_gb_s=400",
            "modules=15",
        ];
        for setting in machines {
            let config = Config::preset("paper-15x16", &[setting.to_owned()]).unwrap();
            let alone = simulate(&frame, &config);
            assert_eq!(shared.simulate(&config), alone, "{setting}");
        }
    }
}
