//! The order in which rasterizer modules take up a frame: tile by tile, every draw of a tile before the next tile, as
//! the device does. Both models start from here, and share nothing else but the cost of one primitive.

use crate::config::Config;
use crate::work::{FrameWork, Mode, Saturation, Segment};
use std::collections::HashMap;

/// What one module does without interruption: all draws of a tile.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    /// Draws, in order.
    pub parts: Vec<Part>,
}

/// One draw in one tile.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// The mode that it needs.
    pub mode: Mode,
    /// Primitives that are evaluated, and in how many groups of 16 pixels.
    pub segments: Vec<Segment>,
    /// Primitives that are evaluated or at least looked at.
    pub needed: u32,
    /// Primitives that the list holds beyond those.
    pub left_over: u32,
}

/// The tasks of a frame in the order in which modules take them.
pub fn tasks(frame: &FrameWork, saturation: Saturation) -> Vec<Task> {
    let mut places = HashMap::new();
    let mut tasks: Vec<Task> = Vec::new();
    for draw in &frame.draws {
        for tile in &draw.tiles {
            let segments: Vec<_> = tile.segments(saturation).collect();
            let needed: u32 = segments.iter().map(|segment| segment.primitives).sum();
            if needed == 0 {
                continue;
            }
            let place = *places.entry(tile.at).or_insert_with(|| {
                tasks.push(Task { parts: Vec::new() });
                tasks.len() - 1
            });
            let part = Part {
                mode: draw.mode,
                segments,
                needed,
                left_over: tile.listed.saturating_sub(needed),
            };
            if let Some(task) = tasks.get_mut(place) {
                task.parts.push(part);
            }
        }
    }
    tasks
}

/// The rates that the rasterizer's clock sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// Bytes per cycle of one module's port.
    pub port: f64,
    /// Bytes per cycle of main memory, for all modules together.
    pub memory: f64,
    /// Cycles from a request to its first byte, where the request could not be made ahead.
    pub latency: u32,
}

impl Rates {
    /// What is left to the rasterizer while others move `others_gb_s`; at least a half of main memory is, because
    /// its arbiter is fair.
    pub fn new(config: &Config, others_gb_s: f64) -> Self {
        let memory = &config.memory;
        let whole = memory.bandwidth_gb_s * memory.efficiency;
        let clock = config.rasterizer.clock_ghz;
        Self {
            port: config.rasterizer.port_bytes_per_cycle,
            memory: (whole - others_gb_s).max(whole / 2.0) / clock,
            latency: (memory.latency_ns * clock).ceil() as u32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::work::{DrawWork, TileWork};

    #[test]
    fn draws_of_a_tile_are_one_task() {
        let draw = |mode, tiles: &[[u32; 2]]| DrawWork {
            mode,
            tiles: tiles.iter().map(|&at| TileWork::open(at, 5)).collect(),
            ..DrawWork::default()
        };
        let frame = FrameWork {
            size: [64, 16],
            draws: vec![
                draw(Mode::Triangle, &[[0, 0], [1, 0]]),
                draw(Mode::Gaussian, &[[2, 0], [1, 0]]),
            ],
        };
        let tasks = tasks(&frame, Saturation::Tile);
        let modes: Vec<Vec<_>> = tasks
            .iter()
            .map(|task| task.parts.iter().map(|part| part.mode).collect())
            .collect();
        let (t, g) = (Mode::Triangle, Mode::Gaussian);
        assert_eq!(modes, [vec![t], vec![t, g], vec![g]]);
    }

    #[test]
    fn others_take_at_most_half_of_main_memory() {
        let config = Config::preset("paper-15x16", &[]).unwrap();
        let alone = Rates::new(&config, 0.0).memory;
        assert!((alone - 68.3 * 0.9).abs() < 1e-9);
        assert!((Rates::new(&config, 1e3).memory - alone / 2.0).abs() < 1e-9);
        assert!((Rates::new(&config, 10.0).memory - (alone - 10.0)).abs() < 1e-9);
    }
}
