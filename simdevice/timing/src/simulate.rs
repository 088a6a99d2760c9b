//! One frame on one piece of hardware: every model of this crate put together.

use crate::config::Config;
use crate::energy::{self, Changed, Energy};
use crate::fast;
use crate::raster::RasterReport;
use crate::schedule::{self, Policy, Span, Stages};
use crate::shader_cores::{self, Roofline};
use crate::work::{FrameWork, Mode, Saturation};
use serde::Serialize;

/// What a frame took, and what it would have taken without the rasterizer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Simulation {
    /// The rasterizer's cycles; zero if there is none.
    pub raster: RasterReport,
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
    /// Milliseconds of the stages.
    pub stages: Stages,
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
    /// Frames per second against the baseline's.
    pub speedup: f64,
    /// Millijoules of a frame.
    pub energy: Energy,
    /// Millijoules of a frame without a rasterizer.
    pub baseline_mj: f64,
}

/// Evaluations that stage 3 makes on shader cores: the original code ends a tile's list when all its pixels are
/// finished, and bins by the square around the 3-sigma circle.
pub fn baseline_evaluations(frame: &FrameWork) -> f64 {
    let of_draw = |draw: &crate::work::DrawWork| {
        let pairs = draw.pairs();
        let boxed = if pairs == 0 || draw.boxed_pairs == 0 {
            1.0
        } else {
            (draw.boxed_pairs as f64 / pairs as f64).max(1.0)
        };
        draw.evaluations(Saturation::Tile, false) as f64 * boxed
    };
    let gaussians = |draw: &&crate::work::DrawWork| draw.mode == Mode::Gaussian;
    frame.draws.iter().filter(gaussians).map(of_draw).sum()
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
    let baseline_raster_ms =
        shader_cores::stage_3_ms(baseline_evaluations(frame), config) + triangles_ms(frame, config);
    let alone = serial(frame, config, baseline_raster_ms);
    let baseline_ms = milliseconds(&alone.shader) + baseline_raster_ms;
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
    Simulation {
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
        baseline_fps: 1e3 / baseline_ms,
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
