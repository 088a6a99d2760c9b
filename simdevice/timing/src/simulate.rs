//! One frame on one piece of hardware: every model of this crate put together.

use crate::config::{Config, Lists};
use crate::energy::{self, Changed, Energy};
use crate::fast;
use crate::raster::RasterReport;
use crate::schedule::{self, Policy, Span, Stages};
use crate::shader_cores::{self, Roofline};
use crate::work::{FrameWork, Mode, Saturation};
use serde::Serialize;
use std::borrow::Cow;

/// What a frame took, and what it would have taken without the rasterizer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Simulation {
    /// The rasterizer's cycles as frames overlap in this configuration; zero if there is none.
    pub raster: RasterReport,
    /// The same for one frame at a time: what performance queries and simulated timestamps count.
    pub raster_alone: RasterReport,
    /// The share of Gaussians' evaluations that changed a pixel.
    pub blended: f64,
    /// The share of triangles' evaluations that covered a pixel and passed the early tests.
    pub covered: f64,
    /// Dispatches.
    pub compute: Roofline,
    /// Stage 1.
    pub preprocess: Roofline,
    /// Stage 2.
    pub sort: Roofline,
    /// Fragment programs.
    pub shade: Roofline,
    /// Milliseconds of the stages as frames overlap in this configuration.
    pub stages: Stages,
    /// The same for one frame at a time.
    pub stages_alone: Stages,
    /// GB/s that the shader cores take from the rasterizer while both run.
    pub contention_gb_s: f64,
    /// Frames per second as configured.
    pub fps: f64,
    /// Frames per second if frames overlap.
    pub fps_collaborative: f64,
    /// Frames per second if they don't.
    pub fps_serial: f64,
    /// Stage 3 without Gaussians in the rasterizer, in ms: Gaussians on the shader cores, triangles as before.
    pub baseline_raster_ms: f64,
    /// Frames per second without a rasterizer.
    pub baseline_fps: f64,
    /// Stage 3 against the baseline's.
    pub raster_speedup: f64,
    /// The factors of `raster_speedup`.
    pub gains: Gains,
    /// Frames per second against the baseline's.
    pub speedup: f64,
    /// Millijoules of a frame.
    pub energy: Energy,
    /// Millijoules of a frame without a rasterizer.
    pub baseline_mj: f64,
}

/// Factors of the raster stage's speed-up over the baseline, whose product it is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gains {
    /// The hardware on the rasterizer's lists, if its PEs never waited.
    pub hardware: f64,
    /// The rasterizer's lists instead of the baseline's, both on shader cores.
    pub lists: f64,
    /// Time in which PEs work over the time that they take: at most 1.
    pub stalls: f64,
}

impl Gains {
    /// No gains at all.
    const NONE: Self = Self {
        hardware: 1.0,
        lists: 1.0,
        stalls: 1.0,
    };
}

/// Evaluations that stage 3 makes on shader cores, whose original code ends a tile's list when all its pixels are
/// finished.
pub fn baseline_evaluations(frame: &FrameWork) -> f64 {
    let gaussians = |draw: &&crate::work::DrawWork| draw.mode == Mode::Gaussian;
    let evaluations = |draw: &crate::work::DrawWork| draw.evaluations(Saturation::Tile, false);
    let draws = frame.draws.iter().filter(gaussians);
    draws.map(evaluations).sum::<u64>() as f64
}

/// Milliseconds of stage 3 where shader cores draw Gaussians from a frame's lists.
fn baseline_raster_ms(frame: &FrameWork, config: &Config) -> f64 {
    shader_cores::stage_3_ms(baseline_evaluations(frame), config) + triangles_ms(frame, config)
}

/// The frame with the lists that are asked for.
fn listed(frame: &FrameWork, lists: Lists) -> Cow<'_, FrameWork> {
    match lists {
        Lists::Exact => Cow::Borrowed(frame),
        Lists::Squares => Cow::Owned(frame.with_squares()),
    }
}

/// The frame as the configuration's stage 3 takes it, in the rasterizer or, where there is none, on shader cores.
pub fn of_rasterizer<'a>(frame: &'a FrameWork, config: &Config) -> Cow<'a, FrameWork> {
    let lists = match config.rasterizer.modules {
        0 => config.baseline.lists,
        _ => config.rasterizer.lists,
    };
    listed(frame, lists)
}

/// Milliseconds of the frame's triangles in a rasterizer for triangles alone, which every GPU has: this one or, where
/// there is none for Gaussians, the paper's, since the published numbers tell nothing of it.
fn triangles_ms(frame: &FrameWork, config: &Config) -> f64 {
    if frame.draws.iter().all(|draw| draw.mode == Mode::Gaussian) {
        return 0.0;
    }
    let mut config = config.clone();
    if config.rasterizer.modules == 0 {
        config.rasterizer.modules = TRIANGLE_MODULES;
    }
    let triangles = frame.of_mode(Mode::Triangle);
    fast::rasterize(&triangles, &config, 0.0).milliseconds(config.rasterizer.clock_ghz)
}

/// Modules of the rasterizer that a machine without GauRast has for triangles: as many as the paper's.
const TRIANGLE_MODULES: u32 = 15;

/// What runs on shader cores, of which a frame in flight's rasterizer takes bytes away.
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

/// Milliseconds of all that runs on shader cores.
fn milliseconds(before: &[Roofline; 4]) -> f64 {
    before.iter().map(Roofline::milliseconds).sum()
}

/// Frames one at a time, and frames that overlap.
struct Both {
    shader: [Roofline; 4],
    raster: RasterReport,
    raster_ms: f64,
    contention_gb_s: f64,
}

impl Both {
    fn stages(&self) -> Stages {
        let [compute, preprocess, sort, shade] = self.shader.map(|stage| stage.milliseconds());
        Stages {
            compute,
            preprocess,
            sort,
            raster: self.raster_ms,
            shade,
        }
    }
}

/// The stages where nothing else runs.
fn serial(frame: &FrameWork, config: &Config, baseline_raster_ms: f64) -> Both {
    let has_rasterizer = config.rasterizer.modules > 0;
    let mut raster = RasterReport::default();
    let mut raster_ms = baseline_raster_ms;
    if has_rasterizer {
        raster = fast::rasterize(frame, config, 0.0);
        raster_ms = raster.milliseconds(config.rasterizer.clock_ghz);
    }
    Both {
        shader: on_shader_cores(frame, config, 0.0),
        raster,
        raster_ms,
        contention_gb_s: 0.0,
    }
}

/// The stages where a frame's work for shader cores runs beside another's stage 3: both move their bytes through one memory.
fn collaborative(frame: &FrameWork, config: &Config, alone: &Both) -> Both {
    let moved = alone.raster.bytes_in + alone.raster.bytes_out;
    let shader = on_shader_cores(frame, config, moved);
    let bytes: f64 = frame.shader().iter().map(|stage| stage.bytes).sum();
    let time = milliseconds(&shader);
    let contention_gb_s = if time > 0.0 { bytes / time * 1e-6 } else { 0.0 };
    let raster = fast::rasterize(frame, config, contention_gb_s);
    Both {
        shader,
        raster_ms: raster.milliseconds(config.rasterizer.clock_ghz),
        raster,
        contention_gb_s,
    }
}

/// Simulates a frame.
pub fn simulate(frame: &FrameWork, config: &Config) -> Simulation {
    let policy = policy(config);
    let of_baseline = listed(frame, config.baseline.lists);
    let of_rasterizer = of_rasterizer(frame, config);
    let frame: &FrameWork = &of_rasterizer;
    let on_baseline = on_shader_cores(&of_baseline, config, 0.0);
    let baseline_raster_ms = baseline_raster_ms(&of_baseline, config);
    let same_lists_ms = self::baseline_raster_ms(frame, config);
    let baseline_ms = milliseconds(&on_baseline) + baseline_raster_ms;
    let alone = serial(frame, config, baseline_raster_ms);
    let (raster_alone, stages_alone) = (alone.raster.clone(), alone.stages());
    let fps = |stages, collaborative| {
        schedule::fps(
            stages,
            Policy {
                collaborative,
                ..policy
            },
        )
    };
    let fps_serial = fps(alone.stages(), false);
    let shader_ms = if policy.has_rasterizer {
        milliseconds(&alone.shader)
    } else {
        baseline_ms
    };
    let mut fps_collaborative = fps_serial;
    let mut chosen = alone;
    if policy.has_rasterizer {
        let together = collaborative(frame, config, &chosen);
        fps_collaborative = fps(together.stages(), true);
        if policy.collaborative {
            chosen = together;
        }
    }
    let changed = changed(frame, config);
    let mut energy = Energy::default();
    if policy.has_rasterizer {
        energy = energy::rasterizer(&chosen.raster, changed, config);
    }
    energy.shader_cores = energy::shader_cores_mj(shader_ms, config);
    let fps = if policy.collaborative {
        fps_collaborative
    } else {
        fps_serial
    };
    let stages = chosen.stages();
    let [compute, preprocess, sort, shade] = chosen.shader;
    let busy_ms = chosen.raster.modules.busy
        / f64::from(config.rasterizer.modules.max(1))
        / config.rasterizer.clock_ghz
        * 1e-6;
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
        compute,
        preprocess,
        sort,
        shade,
        stages,
        contention_gb_s: chosen.contention_gb_s,
        fps,
        fps_collaborative,
        fps_serial,
        baseline_raster_ms,
        baseline_fps: if baseline_ms > 0.0 {
            1e3 / baseline_ms
        } else {
            0.0
        },
        raster_speedup: if stages.raster > 0.0 {
            baseline_raster_ms / stages.raster
        } else {
            1.0
        },
        speedup: fps * baseline_ms * 1e-3,
        energy,
        baseline_mj: energy::shader_cores_mj(baseline_ms, config),
        raster: chosen.raster,
    }
}

/// How the configuration lets frames overlap.
pub fn policy(config: &Config) -> Policy {
    Policy {
        collaborative: config.schedule.collaborative,
        frames_in_flight: config.schedule.frames_in_flight as usize,
        has_rasterizer: config.rasterizer.modules > 0,
    }
}

/// Frames one after the other on the timeline.
pub fn timeline(frames: &[Simulation], config: &Config) -> Vec<Span> {
    let stages: Vec<_> = frames.iter().map(|frame| frame.stages).collect();
    schedule::timeline(&stages, policy(config))
}

/// The shares of evaluations that changed a pixel.
fn changed(frame: &FrameWork, config: &Config) -> Changed {
    let share = |mode| {
        let (mut changed, mut evaluated) = (0, 0);
        for draw in frame.draws.iter().filter(|draw| draw.mode == mode) {
            changed += draw
                .tiles
                .iter()
                .map(|tile| tile.contributions)
                .sum::<u64>();
            let raster = &config.rasterizer;
            evaluated += draw.evaluations(raster.granularity(mode), raster.hierarchical_depth);
        }
        match evaluated {
            0 => 0.0,
            _ => (changed as f64 / evaluated as f64).min(1.0),
        }
    };
    Changed {
        blended: share(Mode::Gaussian),
        covered: share(Mode::Triangle),
    }
}

/// A frame of Gaussians spread evenly over the tiles of an image, none of which finishes.
pub fn even_frame(size: [u32; 2], pairs: u64, contributions: f64) -> FrameWork {
    let [columns, rows] = size.map(|side| side.div_ceil(crate::work::TILE_SIDE));
    let tiles = u64::from(columns) * u64::from(rows);
    let tile = |index: u64| {
        let listed = (pairs * (index + 1) / tiles - pairs * index / tiles) as u32;
        let at = [
            (index % u64::from(columns)) as u32,
            (index / u64::from(columns)) as u32,
        ];
        let mut work = crate::work::TileWork::open(at, listed);
        work.contributions = (work.contributions as f64 * contributions) as u64;
        work
    };
    let draw = crate::work::DrawWork {
        tiles: (0..tiles).map(tile).collect(),
        ..crate::work::DrawWork::default()
    };
    FrameWork {
        size,
        draws: vec![draw],
        ..FrameWork::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::work::ShaderWork;

    fn frame() -> FrameWork {
        let mut frame = even_frame([640, 480], 1_000_000, 0.25);
        let draw = &mut frame.draws[0];
        draw.preprocess = ShaderWork {
            float: 3e9,
            bytes: 2e8,
            ..ShaderWork::default()
        };
        draw.sort = ShaderWork {
            integer: 5e8,
            bytes: 4e8,
            ..ShaderWork::default()
        };
        frame
    }

    #[test]
    fn the_speed_up_is_the_product_of_what_it_is_made_of() {
        let mut frame = frame();
        frame.draws[0].boxed_pairs = 3_000_000;
        let with = |preset: &str| simulate(&frame, &Config::preset(preset, &[]).unwrap());
        let (exact, squares) = (with("paper-15x16"), with("paper-pipeline"));
        for result in [&exact, &squares] {
            let Gains {
                hardware,
                lists,
                stalls,
            } = result.gains;
            let product = hardware * lists * stalls;
            assert!((product / result.raster_speedup - 1.0).abs() < 1e-9);
            // 26.9 operations an evaluation on 282 G lanes/s, against 240 G evaluations/s.
            let lanes = 4.0 * 128.0 * 0.612 * 0.9;
            assert!((hardware - 240.0 * 26.9 / lanes).abs() < 0.05, "{hardware}");
            assert!(stalls <= 1.0);
        }
        assert!((exact.gains.lists - 3.0).abs() < 0.01);
        assert_eq!(squares.gains.lists, 1.0);
        // Both baselines sort and evaluate what squares give.
        assert!((exact.baseline_fps - squares.baseline_fps).abs() < 1e-9);
        assert!((squares.sort.memory_ms / exact.sort.memory_ms - 3.0).abs() < 0.6);
        let baseline = with("orin-nx-10w");
        assert!((baseline.fps - exact.baseline_fps).abs() < 1e-9);
        assert_eq!(baseline.gains, Gains::NONE);
    }

    #[test]
    fn one_frame_at_a_time_is_the_same_whether_others_may_overlap_or_not() {
        let overlapping = Config::preset("paper-15x16", &[]).unwrap();
        let serial = overlapping
            .with(&["collaborative=false".to_owned()])
            .unwrap();
        let (a, b) = (
            simulate(&frame(), &overlapping),
            simulate(&frame(), &serial),
        );
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
        assert!(
            numbers.iter().all(|number| number.is_finite()),
            "{numbers:?}"
        );
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
        assert!(
            (simulation.speedup - 1.0).abs() < 1e-9
                && (simulation.raster_speedup - 1.0).abs() < 1e-9
        );
        assert!((simulation.energy.total() - simulation.baseline_mj).abs() < 1e-9);
        let paper = simulate(&frame(), &Config::preset("paper-15x16", &[]).unwrap());
        assert!((paper.baseline_fps - simulation.fps).abs() < 1e-9);
        assert!(paper.fps_collaborative > paper.fps_serial && paper.fps_serial > simulation.fps);
    }

    #[test]
    fn overlapping_frames_share_memory() {
        // Stages 1 and 2 limited by memory alone: a frame takes as long as all its bytes.
        let mut frame = frame();
        let [draw] = frame.draws.as_mut_slice() else {
            panic!("one draw")
        };
        draw.preprocess = ShaderWork {
            bytes: 2e8,
            ..ShaderWork::default()
        };
        draw.sort = ShaderWork {
            bytes: 4e8,
            ..ShaderWork::default()
        };
        let config = Config::preset("paper-15x16", &[]).unwrap();
        let simulation = simulate(&frame, &config);
        let bytes = 6e8 + simulation.raster.bytes_in + simulation.raster.bytes_out;
        let least_ms = bytes / (68.3e6 * 0.9);
        assert!(
            (1e3 / simulation.fps / least_ms - 1.0).abs() < 0.01,
            "{} {least_ms}",
            simulation.fps
        );
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
            let config =
                Config::preset("single-module", &[format!("saturation={saturation}")]).unwrap();
            let cycles = simulate(&frame, &config).raster.cycles;
            assert!(cycles < last, "{saturation}: {cycles} {last}");
            last = cycles;
        }
    }
}
