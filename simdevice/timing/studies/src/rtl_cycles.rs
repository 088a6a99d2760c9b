//! Cycles of the module in SystemVerilog compared with those of the models, for the same lists.

use crate::exponential::Exponential;
use crate::module::{Drawn, Groups, List, Module};
use crate::number::Format;
use crate::rtl::{Memory, ModuleBench, Rasterized};
use crate::stepped;
use std::io::{Error, Result};
use timing::FrameWork;
use timing::config::{Config, ConfigError};
use timing::fast;
use timing::raster::RasterReport;
use timing::work::{DrawWork, TileWork};

/// A configuration of the module.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Its name in a table.
    pub name: &'static str,
    /// The shape of its groups.
    pub groups: Groups,
    /// True if primitives are evaluated only in groups that they reach, and groups of finished pixels are skipped.
    pub masked: bool,
    /// A seed for its lists.
    pub seed: u64,
}

impl Setting {
    /// The paper's configuration, and two that skip groups.
    pub const ALL: [Self; 3] = [
        Self { name: "whole tiles", groups: Groups::Rows, masked: false, seed: 1 },
        Self { name: "blocks that are reached and open", groups: Groups::Blocks, masked: true, seed: 2 },
        Self { name: "rows that are reached and open", groups: Groups::Rows, masked: true, seed: 3 },
    ];

    /// The model of the module.
    pub fn module(&self, format: Format) -> Module {
        let mut module = Module::new(format, Exponential::Table, self.groups);
        module.skips_groups = self.masked;
        module
    }
}

/// Cycles of the module and of the stepped model for the same lists.
#[derive(Clone, Debug)]
pub struct Cycles {
    rasterized: Rasterized,
    stepped: RasterReport,
    /// The model's work for the lists, and its machine.
    frame: FrameWork,
    config: Config,
    /// The number of pixels in which the two differ.
    pub different_pixels: usize,
    /// The number of lists.
    pub tiles: usize,
    /// Cycles of a pixel in the pipeline of the module's PEs, with the register of its operands.
    pub latency: u32,
}

impl Cycles {
    /// Runs the module with a memory, and the model.
    ///
    /// # Errors
    /// Returns an error if the bench can't be run.
    pub fn of(bench: &ModuleBench, setting: Setting, format: Format, lists: &[List], memory: Memory) -> Result<Self> {
        let module = setting.module(format);
        let rasterized = bench.run(lists, &module, memory)?;
        let drawn: Vec<_> = lists.iter().map(|list| module.draw(list)).collect();
        let config = machine(format, memory).map_err(Error::other)?;
        let pairs = rasterized.pixels.iter().zip(&drawn);
        let different = |(ours, drawn): (&Vec<[u32; 3]>, &Drawn)| {
            let pairs = ours.iter().zip(&drawn.pixels);
            pairs.filter(|(ours, theirs)| ours != theirs).count()
        };
        let frame = frame(lists, &drawn);
        Ok(Self {
            different_pixels: pairs.map(different).sum(),
            tiles: lists.len(),
            latency: rasterized.latency,
            stepped: stepped::rasterize(&frame, &config, 0.0),
            rasterized,
            frame,
            config,
        })
    }

    /// The error of the model's cycles if the lists' waits are unknown, and `sharing` of the Gaussians that need not wait
    /// for the one before do wait; 0.1 if they are 10 % too many.
    pub fn error(&self, sharing: f64) -> f64 {
        let mut config = self.config.clone();
        config.rasterizer.neighbour_sharing = sharing;
        let mut frame = self.frame.clone();
        let tiles = frame.draws.iter_mut().flat_map(|draw| &mut draw.tiles);
        tiles.flat_map(|tile| &mut tile.runs).for_each(|run| run.waits = None);
        fast::rasterize(&frame, &config, 0.0).cycles / f64::from(self.rasterized.cycles) - 1.0
    }

    /// Cycles of the module, and of the model that simulations use.
    pub fn with_fast(&self) -> [f64; 2] {
        [f64::from(self.rasterized.cycles), fast::rasterize(&self.frame, &self.config, 0.0).cycles]
    }

    /// Cycles of the module and of the stepped model, by cause: all, evaluating a pixel for each PE, waiting for a
    /// transmittance, for memory, for the controller, changing modes.
    pub fn by_cause(&self) -> [[f64; 2]; 6] {
        let modules = &self.stepped.modules;
        let [_, busy, dependency, memory, controller, modes] = self.rasterized.causes.map(f64::from);
        [
            [f64::from(self.rasterized.cycles), self.stepped.cycles],
            [busy, modules.busy],
            [dependency, modules.dependency],
            [memory, modules.memory],
            [controller, modules.controller],
            [modes, modules.mode_switch],
        ]
    }
}

/// The mean error, without its sign, of the model's cycles for some groups of lists.
pub fn mean_error(groups: &[&Cycles], sharing: f64) -> f64 {
    let errors = groups.iter().map(|cycles| cycles.error(sharing).abs());
    errors.sum::<f64>() / groups.len().max(1) as f64
}

/// The share of waiting Gaussians, in steps of a twentieth, with the least mean error for some groups of lists.
pub fn calibrated_sharing(groups: &[&Cycles]) -> f64 {
    let shares = (0..=20).map(|step| f64::from(step) / 20.0);
    let errors = shares.map(|sharing| (mean_error(groups, sharing), sharing));
    let best = errors.min_by(|(a, _), (b, _)| a.total_cmp(b));
    best.map_or(0.0, |(_, sharing)| sharing)
}

/// A configuration with one module of these numbers, limited only by its port. A list's runs say in which groups its
/// primitives are evaluated.
fn machine(format: Format, memory: Memory) -> std::result::Result<Config, ConfigError> {
    let base = match format {
        Format::HALF => "fp16",
        _ => "paper-15x16",
    };
    let mut settings: Vec<_> = ["modules=1", "bandwidth_gb_s=1000", "saturation=reached", "triangle_traversal=reached"]
        .map(str::to_owned)
        .into();
    settings.push(format!("memory.latency_ns={}", memory.latency));
    settings.push(format!("port_bytes_per_cycle={}", 16.0 / f64::from(memory.interval)));
    Config::preset(base, &settings)
}

/// A frame of lists that are drawn one after the other, each a tile of its own.
fn frame(lists: &[List], drawn: &[Drawn]) -> FrameWork {
    let draw = |(index, (list, drawn)): (usize, (&List, &Drawn))| DrawWork {
        mode: list.mode,
        tiles: vec![TileWork { at: [index as u32, 0], ..drawn.work.clone() }],
        ..DrawWork::default()
    };
    FrameWork {
        size: [16 * lists.len() as u32, 16],
        draws: lists.iter().zip(drawn).enumerate().map(draw).collect(),
        ..FrameWork::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use timing::work::Run;

    /// Lists of small Gaussians, for which the module takes the model's cycles with `sharing`.
    fn cycles(sharing: f64, reached: u32) -> Cycles {
        let config = machine(Format::SINGLE, Memory::OF_PRESETS).unwrap();
        let run = Run { primitives: 600, rows: 16, blocks: 16, reached: 600 * reached, ..Run::default() };
        let tile = TileWork { listed: 600, runs: vec![run], ..TileWork::default() };
        let draw = DrawWork { tiles: vec![tile], ..DrawWork::default() };
        let frame = FrameWork { size: [16, 16], draws: vec![draw], ..FrameWork::default() };
        let mut of_module = config.clone();
        of_module.rasterizer.neighbour_sharing = sharing;
        let report = stepped::rasterize(&frame, &of_module, 0.0);
        Cycles {
            rasterized: Rasterized {
                cycles: report.cycles as u32,
                causes: [0; 6],
                latency: 0,
                requests: 0,
                pixels: Vec::new(),
            },
            stepped: report,
            different_pixels: 0,
            tiles: 1,
            latency: 0,
            frame,
            config,
        }
    }

    #[test]
    fn the_share_that_made_the_cycles_is_found_again() {
        // Gaussians in one block wait up to six cycles: a sixth more or less is seen.
        let (few, many) = (cycles(0.5, 1), cycles(0.5, 1));
        assert!(mean_error(&[&few, &many], 0.5) < 1e-9);
        assert!((calibrated_sharing(&[&few, &many]) - 0.5).abs() < 0.1);
        assert!(calibrated_sharing(&[&cycles(1.0, 1)]) > 0.9);
        assert_eq!(calibrated_sharing(&[&cycles(0.0, 1)]), 0.0);
        assert!(few.error(1.0) > 0.1 && few.error(0.0) < -0.1);
    }
}
