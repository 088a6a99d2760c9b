//! The fast model against the cycle-stepped one, over random traces.

use gaurast_runner::{Case, Variant};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use timing::config::{Config, preset_names};
use timing::work::{DrawWork, Mode, Run, Saturation, TILE_SIDES, TileWork};
use timing::{FrameWork, fast};
use timing_studies::stepped;

/// The property that a random trace stresses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Any,
    OneTile,
    BandwidthBound,
    ModeSwitching,
}

const KINDS: [Kind; 4] = [Kind::Any, Kind::OneTile, Kind::BandwidthBound, Kind::ModeSwitching];

/// A tile whose pixels finish gradually, or never.
fn tile(random: &mut ChaCha8Rng, at: [u32; 2], mode: Mode, largest: f64) -> TileWork {
    let listed = largest.powf(random.random::<f64>()).ceil().max(1.0) as u32;
    let saturates = mode == Mode::Gaussian && random.random_bool(0.5);
    let needed = if saturates { random.random_range(1..=listed) } else { listed };
    let stretches = if saturates { random.random_range(1..=needed.min(8)) } else { 1 };
    let density = random.random_range(0.05..1.0);
    let (mut left, mut rows, mut blocks) = (needed, 16u8, 16u8);
    let mut runs = Vec::new();
    for stretch in 0..stretches {
        let primitives = if stretch + 1 == stretches { left } else { (left / 2).max(1).min(left) };
        if primitives == 0 {
            break;
        }
        left -= primitives;
        let hidden = random.random_range(0..=primitives);
        let reached = f64::from(primitives - hidden) * f64::from(blocks) * density;
        runs.push(Run {
            primitives,
            rows,
            blocks,
            reached: reached.round() as u32,
            hidden,
            hidden_blocks: hidden * random.random_range(0..=u32::from(blocks)),
            waits: (mode == Mode::Gaussian && random.random_bool(0.5)).then(|| {
                let most = random.random_range(0..=primitives);
                std::array::from_fn(|index| most * (index as u32 + 1))
            }),
        });
        rows = random.random_range(1..=rows);
        blocks = random.random_range(1..=blocks);
    }
    let last = runs.last().map_or(0, |run| run.hidden);
    let hidden_rest = match mode {
        Mode::Triangle => 0,
        Mode::Gaussian => random.random_range(0..=last),
    };
    TileWork {
        at,
        listed,
        runs,
        contributions: u64::from(needed) * 20,
        terminated: if saturates { 256 } else { 0 },
        hidden_rest,
        ..TileWork::default()
    }
}

fn trace(random: &mut ChaCha8Rng, kind: Kind) -> FrameWork {
    let tiles = match kind {
        Kind::OneTile => 1,
        _ => random.random_range(1..=24),
    };
    let draws = match kind {
        Kind::ModeSwitching => random.random_range(2..=4),
        Kind::OneTile => 1,
        _ => random.random_range(1..=2),
    };
    let largest = random.random_range(2.0..160.0);
    let draws = (0..draws).map(|index| {
        let mode = match kind {
            Kind::ModeSwitching if index % 2 == 1 => Mode::Triangle,
            Kind::ModeSwitching => Mode::Gaussian,
            _ if random.random_bool(0.2) => Mode::Triangle,
            _ => Mode::Gaussian,
        };
        let tiles = (0..tiles)
            .filter_map(|x| {
                let there = kind == Kind::OneTile || random.random_bool(0.9);
                there.then(|| tile(random, [x % 8, x / 8], mode, largest))
            })
            .collect();
        DrawWork { mode, tiles, ..DrawWork::default() }
    });
    let draws = draws.collect();
    FrameWork { size: [128, 128], draws, ..FrameWork::default() }
}

fn hardware(random: &mut ChaCha8Rng, kind: Kind) -> Config {
    let presets: Vec<_> =
        preset_names().into_iter().filter(|name| !name.starts_with("orin") && !name.starts_with("m2")).collect();
    let mut config = Config::preset(presets[random.random_range(0..presets.len())], &[]).unwrap();
    let raster = &mut config.rasterizer;
    raster.saturation = Saturation::ALL[random.random_range(0..Saturation::ALL.len())];
    raster.triangle_traversal = Saturation::ALL[random.random_range(0..Saturation::ALL.len())];
    raster.hierarchical_depth = random.random_bool(0.5);
    raster.tile_side = if random.random_bool(0.7) { 16 } else { TILE_SIDES[random.random_range(0..TILE_SIDES.len())] };
    raster.batch = [8, 16, 32, 64, 128][random.random_range(0..5)];
    raster.modules = random.random_range(1..=16);
    raster.port_bytes_per_cycle = [4.0, 8.0, 16.0, 32.0][random.random_range(0..4)];
    raster.tile_overhead = random.random_range(0..20);
    raster.mode_switch = random.random_range(0..100);
    config.memory.latency_ns = random.random_range(0.0..200.0);
    config.memory.bandwidth_gb_s = match kind {
        Kind::BandwidthBound => random.random_range(2.0..25.0),
        _ => random.random_range(20.0..120.0),
    };
    config
}

fn kinds() -> Vec<Variant> {
    let variant = |kind| Variant::new(format!("{kind:?}"));
    KINDS.map(variant).into()
}

#[gaurast_runner::test(each = kinds())]
fn the_fast_model_is_the_stepped_model(case: &Case) {
    // The number of traces of all kinds together.
    const TRACES: usize = 10_000;
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut pressed = 0;
    for number in 0..TRACES {
        let kind = KINDS[number % KINDS.len()];
        let frame = trace(&mut random, kind);
        let config = hardware(&mut random, kind);
        if format!("{kind:?}") != case.variant() {
            continue;
        }
        let fast = fast::rasterize(&frame, &config, 0.0);
        let slow = stepped::rasterize(&frame, &config, 0.0);
        pressed += usize::from(match kind {
            Kind::BandwidthBound => slow.modules.memory > slow.modules.busy,
            Kind::ModeSwitching => slow.switches >= 2.0,
            _ => slow.cycles > 0.0,
        });
        // Numbers of cycles are whole.
        assert_eq!(fast, slow, "trace {number}");
    }
    assert!(pressed >= 100, "{pressed}");
}
