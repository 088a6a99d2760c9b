//! The simulation of one frame on one configuration: all models of this crate combined.

use crate::config::{Config, Lists};
use crate::energy::{self, Changed, Energy};
use crate::fast;
use crate::raster::RasterReport;
use crate::schedule::{self, Policy, Span, Stages};
use crate::shader_cores::{self, Roofline};
use crate::work::{FrameWork, Mode, Saturation};
use serde::Serialize;
use std::borrow::Cow;

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
    /// GB/s that the shader cores use while the rasterizer runs.
    pub contention_gb_s: f64,
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
    /// The speed-up of frames per second over the baseline.
    pub speedup: f64,
    /// Millijoules of a frame.
    pub energy: Energy,
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
    const NONE: Self = Self {
        hardware: 1.0,
        lists: 1.0,
        stalls: 1.0,
    };
}

/// The evaluations of stage 3 on shader cores. The original code ends a tile's list when all its pixels are finished.
pub fn baseline_evaluations(frame: &FrameWork) -> f64 {
    let gaussians = |draw: &&crate::work::DrawWork| draw.mode == Mode::Gaussian;
    let evaluations = |draw: &crate::work::DrawWork| draw.evaluations(Saturation::Tile, false);
    let draws = frame.draws.iter().filter(gaussians);
    draws.map(evaluations).sum::<u64>() as f64
}

/// Milliseconds of stage 3 if shader cores draw the Gaussians of a frame's lists.
fn baseline_raster_ms(frame: &FrameWork, config: &Config) -> f64 {
    shader_cores::stage_3_ms(baseline_evaluations(frame), config) + triangles_ms(frame, config)
}

/// The frame with lists of a kind.
fn listed(frame: &FrameWork, lists: Lists) -> Cow<'_, FrameWork> {
    match lists {
        Lists::Exact => Cow::Borrowed(frame),
        Lists::Squares => Cow::Owned(frame.with_squares()),
    }
}

/// The frame with the lists that the configuration's stage 3 uses: the rasterizer's or, if it has no modules, the
/// baseline's.
pub fn of_rasterizer<'a>(frame: &'a FrameWork, config: &Config) -> Cow<'a, FrameWork> {
    let lists = match config.rasterizer.modules {
        0 => config.baseline.lists,
        _ => config.rasterizer.lists,
    };
    listed(frame, lists)
}

/// Milliseconds of the frame's triangles in a rasterizer for triangles, which every GPU has: this one's modules or, if
/// there are none, as many as the paper's, because nothing is published about the GPU's own.
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

/// The times of the stages of a frame, for frames one at a time or for frames that overlap.
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

/// The times of the stages if frames don't overlap.
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

/// The times if a frame's work on shader cores overlaps stage 3 of another frame: both move bytes through one memory.
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

/// A frame of Gaussians that are spread evenly over the tiles of an image, in which no pixel finishes.
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
        // Both baselines sort and evaluate the pairs of squares.
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
        // Memory alone limits stages 1 and 2: a frame takes as long as all its bytes.
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
