//! The trace of work and the models' results: recording doesn't change the image, the trace agrees with the counters,
//! both models of the rasterizer agree with each other, and viewers of traces can read the timelines.

use crate::common::{HEIGHT, WIDTH};
use crate::scenes::{KINDS, Kind, draw, draw_on, recording};
use simdevice::stats::counters::{Counter, Counters};
use simdevice::stats::optimizations::{Optimization, Optimizations};
use simdevice::stats::query::{QueryKind, QueryPool, QueryResult};
use simdevice::timing::config::{Config as Hardware, preset_names};
use simdevice::timing::raster::RasterReport;
use simdevice::timing::stages::{self, GaussianCounts};
use simdevice::timing::work::{Mode, TileWork, Trace};
use simdevice::timing::{fast, schedule, simulate};
use simdevice::{Config, Device, Packet};
use std::sync::Arc;
use timing_studies::stepped;

const NOTHING: [&[Packet]; 2] = [&[], &[]];

fn trace(kind: Kind) -> Trace {
    let (config, recorder) = recording();
    draw(kind, &config, NOTHING);
    recorder.trace()
}

/// The counters of a query around a scene.
fn counted(kind: Kind, query: QueryKind, config: &Config) -> Counters {
    let pool = Arc::new(QueryPool::new(query, 1));
    let begin = Packet::BeginQuery { pool: pool.clone(), index: 0 };
    let end = Packet::EndQuery { pool: pool.clone(), index: 0 };
    draw(kind, config, [&[begin], &[end]]);
    match pool.result(0) {
        Some(QueryResult::Performance(counters)) => *counters,
        other => panic!("{other:?}"),
    }
}

/// The sum of a tile's number over the tiles of all draws of a mode.
fn sum(trace: &Trace, mode: Mode, of: impl Fn(&TileWork) -> u64) -> u64 {
    let draws = trace.frames.iter().flat_map(|frame| &frame.draws);
    let draws = draws.filter(|draw| draw.mode == mode);
    draws.flat_map(|draw| &draw.tiles).map(of).sum()
}

#[gaurast_runner::test]
fn nobody_sees_in_the_image_that_work_is_recorded() {
    for (kind, name) in KINDS {
        let plain = draw(kind, &Config::default(), NOTHING);
        assert_eq!(kind != Kind::Dispatches, plain.iter().any(|&byte| byte > 0));
        let (config, recorder) = recording();
        assert!(draw(kind, &config, NOTHING) == plain, "{name}, recorded");
        assert!(!recorder.trace().frames.is_empty(), "{name}");
        let simulated = Config { simulated_timestamps: true, ..Config::default() };
        assert!(draw(kind, &simulated, NOTHING) == plain, "{name}, timed");
        for threads in [1, 3] {
            let (config, again) = recording();
            draw(kind, &Config { threads, ..config }, NOTHING);
            assert_eq!(again.trace(), recorder.trace(), "{name}, {threads} threads");
        }
    }
}

#[gaurast_runner::test]
fn the_trace_of_triangles_agrees_with_the_counters() {
    // The trace describes hardware that also shades fragments that are overwritten later.
    let config =
        Config { optimizations: Optimizations::ALL.without(Optimization::OverwrittenQuads), ..Config::default() };
    let counters = counted(Kind::Triangles, QueryKind::Performance, &config);
    let trace = trace(Kind::Triangles);
    let of = |of: fn(&TileWork) -> u64| sum(&trace, Mode::Triangle, of);
    let hidden = of(|tile| tile.hidden().into());
    assert_eq!(hidden, counters.get(Counter::TilesHidden));
    assert!(hidden > 0 && of(|tile| tile.killed.into()) > 0);
    assert_eq!(of(|tile| tile.contributions), counters.get(Counter::SamplesPassed));
    assert_eq!(of(|tile| tile.contributions), counters.get(Counter::FragmentInvocations));
    let quads = of(|tile| tile.quads.into());
    assert!(4 * quads >= of(|tile| tile.contributions));
    for tile in trace.frames.iter().flat_map(|frame| &frame.draws[0].tiles) {
        let [run] = tile.runs.as_slice() else { panic!("one run: {tile:?}") };
        assert_eq!(run.primitives, tile.listed);
        assert!(run.reached + tile.hidden_blocks() <= 16 * tile.listed);
        assert!(tile.quads + tile.killed <= 4 * run.reached);
    }
    let draws: Vec<_> = trace.frames.iter().map(|frame| &frame.draws[0]).collect();
    let primitives: u64 = draws.iter().map(|draw| draw.primitives).sum();
    assert_eq!(primitives, counters.get(Counter::InputPrimitives));
    // All work of the shader cores is before or after that of tiles.
    let operations: f64 = draws.iter().map(|draw| draw.preprocess.operations() + draw.shade.operations()).sum();
    let lanes = counters.get(Counter::ShaderActiveLanes) + counters.get(Counter::ShaderUniform);
    assert!((operations - lanes as f64).abs() < 0.5, "{operations} {lanes}");
    for draw in draws {
        assert!(draw.preprocess.float > 0.0 && draw.shade.float > 0.0);
        // At least 32 bytes of attributes and 32 of outputs for each vertex, and 36 for each triangle.
        let least = 3.0 * draw.primitives as f64 * 64.0 + 36.0 * draw.drawn as f64;
        assert!(draw.preprocess.bytes >= least);
        assert!(draw.sized_pairs.is_sorted_by(|a, b| a > b), "{draw:?}");
        let listed: u64 = draw.pairs();
        // Bounding boxes are those of drawn primitives, so that lists have no more pairs.
        assert!(listed <= draw.sized_pairs[1], "{listed} {:?}", draw.sized_pairs);
    }
}

#[gaurast_runner::test]
fn programs_that_project_and_resolve_gaussians_are_charged_for_what_they_did() {
    let counters = counted(Kind::Shaded, QueryKind::Performance, &Config::default());
    let trace = trace(Kind::Shaded);
    let draws: Vec<_> = trace.frames.iter().map(|frame| &frame.draws[0]).collect();
    assert_eq!(draws.len(), 2);
    let operations = counters.get(Counter::ShaderActiveLanes) + counters.get(Counter::ShaderUniform);
    let mut programs = 0.0;
    for draw in &draws {
        assert_eq!((draw.mode, draw.primitives), (Mode::Gaussian, 1000));
        assert!(draw.drawn > 100 && draw.drawn < 1000, "{}", draw.drawn);
        // After the vertex program the device computes footprints, but no projection and no harmonics.
        let [footprints, sort] = stages::gaussian(&GaussianCounts {
            shaded: 1000,
            pairs: draw.pairs(),
            tiles: u64::from(WIDTH.div_ceil(16) * HEIGHT.div_ceil(16)),
            ..GaussianCounts::default()
        });
        assert_eq!(draw.sort, sort);
        assert!(draw.preprocess.float > footprints.float && draw.shade.float > 0.0);
        // 48 bytes of attributes and as many of outputs.
        let bytes = footprints.bytes + 1000.0 * 96.0;
        assert!(draw.preprocess.bytes >= bytes && draw.preprocess.bytes < bytes + 4.0 * operations as f64);
        programs += draw.preprocess.operations() - footprints.operations() + draw.shade.operations();
    }
    // The operations of both programs, counted by lane.
    assert!((programs - operations as f64).abs() < 0.5, "{programs} {operations}");
}

#[gaurast_runner::test]
fn dispatches_are_in_the_trace() {
    let counters = counted(Kind::Dispatches, QueryKind::Performance, &Config::default());
    let alone = trace(Kind::Dispatches);
    assert_eq!(alone.frames.len(), 1);
    let frame = &alone.frames[0];
    assert_eq!((frame.dispatches, frame.draws.len()), (2, 0));
    let lanes = counters.get(Counter::ShaderActiveLanes) + counters.get(Counter::ShaderUniform);
    assert!((frame.compute.operations() - lanes as f64).abs() < 0.5);
    let mixed = trace(Kind::Mixed);
    assert!(mixed.frames.iter().all(|frame| frame.dispatches == 1));
    let hardware = Hardware::preset("paper-15x16", &[]).unwrap();
    let result = simulate::simulate(frame, &hardware);
    assert!(result.stages.compute > 0.0 && result.raster.cycles == 0.0 && result.fps.is_finite());
}

#[gaurast_runner::test]
fn both_models_agree_on_every_kind_of_scene() {
    for (kind, name) in KINDS {
        for frame in &trace(kind).frames {
            for preset in preset_names() {
                let saturations = ["tile", "block", "reached"];
                for setting in saturations {
                    let settings = [format!("saturation={setting}")];
                    let hardware = Hardware::preset(preset, &settings).unwrap();
                    let fast = fast::rasterize(frame, &hardware, 0.0);
                    let slow = stepped::rasterize(frame, &hardware, 0.0);
                    let off = (fast.cycles - slow.cycles).abs();
                    assert!(off <= 0.02 * slow.cycles, "{name}, {preset}, {setting}: {} {}", fast.cycles, slow.cycles);
                    assert_eq!(fast.switches, slow.switches, "{name}, {preset}");
                    let evaluations =
                        |report: &RasterReport| [report.gaussian_evaluations, report.triangle_evaluations];
                    assert_eq!(evaluations(&fast), evaluations(&slow));
                }
            }
        }
    }
}

#[gaurast_runner::test]
fn mode_switches_cost_what_the_configuration_says() {
    let mixed = trace(Kind::Mixed);
    let frame = &mixed.frames[0];
    let cycles = |mode_switch: u32| {
        let setting = format!("mode_switch={mode_switch}");
        let hardware = Hardware::preset("single-module", &[setting]).unwrap();
        fast::rasterize(frame, &hardware, 0.0)
    };
    let (cheap, dear) = (cycles(16), cycles(116));
    assert!(cheap.switches > 10.0);
    assert_eq!(cheap.switches, dear.switches);
    let more = dear.modules.mode_switch - cheap.modules.mode_switch;
    assert!((more - 100.0 * cheap.switches).abs() < 1e-6);
    assert!(dear.cycles > cheap.cycles + 50.0 * cheap.switches);
    let triangles =
        fast::rasterize(&frame.of_mode(Mode::Triangle), &Hardware::preset("single-module", &[]).unwrap(), 0.0);
    assert_eq!(triangles.switches, 0.0);
}

#[gaurast_runner::test]
fn timelines_are_well_formed_and_engines_do_one_thing_at_a_time() {
    for (kind, name) in KINDS {
        let trace = trace(kind);
        for preset in ["paper-15x16", "orin-nx-10w"] {
            let hardware = Hardware::preset(preset, &[]).unwrap();
            let frames: Vec<_> =
                trace.frames.iter().map(|frame| simulate::simulate(frame, &hardware)).cycle().take(5).collect();
            let spans = simulate::timeline(&frames, &hardware);
            let text = serde_json::to_string(&schedule::chrome_trace(&spans, &[], &hardware)).unwrap();
            let json: serde_json::Value = serde_json::from_str(&text).unwrap();
            let events = json["traceEvents"].as_array().unwrap();
            let mut tracks = std::collections::BTreeMap::<u64, Vec<[f64; 2]>>::new();
            let mut named = 0;
            for event in events {
                assert!(event["name"].is_string() && event["pid"].is_u64());
                match event["ph"].as_str() {
                    Some("M") => named += 1,
                    Some("X") => {
                        let [ts, dur] = ["ts", "dur"].map(|key| event[key].as_f64().unwrap());
                        assert!(ts >= 0.0 && dur >= 0.0, "{event}");
                        let track = event["tid"].as_u64().unwrap();
                        tracks.entry(track).or_default().push([ts, ts + dur]);
                    }
                    _ => panic!("{event}"),
                }
            }
            assert_eq!(named, 3);
            let expected = match (kind, preset) {
                (Kind::Dispatches, _) | (_, "orin-nx-10w") => 1,
                _ => 2,
            };
            assert!(tracks.len() >= expected, "{name}, {preset}");
            for spans in tracks.values_mut() {
                spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
                let apart = |pair: &[[f64; 2]]| pair[0][1] <= pair[1][0] + 1e-6;
                assert!(spans.windows(2).all(apart), "{name}, {preset}: {spans:?}");
            }
        }
    }
}

#[gaurast_runner::test]
fn a_query_counts_what_the_model_says_of_the_trace() {
    let mut hardware = Hardware::preset("paper-15x16", &[]).unwrap();
    hardware.schedule.collaborative = false;
    for (kind, name) in KINDS {
        let counters = counted(kind, QueryKind::Simulated, &Config::default());
        let (config, _) = recording();
        let recorded = counted(kind, QueryKind::Simulated, &config);
        let results: Vec<_> = trace(kind).frames.iter().map(|frame| simulate::simulate(frame, &hardware)).collect();
        let total = |of: fn(&simulate::Simulation) -> f64| results.iter().map(of).sum::<f64>();
        let expected = [
            (Counter::SimulatedTime, total(|r| r.stages.total() * 1e6)),
            (Counter::SimulatedShade, total(|r| r.stages.shade * 1e6)),
            (Counter::SimulatedRasterCycles, total(|r| r.raster.cycles)),
            (Counter::SimulatedBusy, total(|r| r.raster.modules.busy)),
            (Counter::SimulatedDependency, total(|r| r.raster.modules.dependency)),
            (Counter::SimulatedMemoryStall, total(|r| r.raster.modules.memory)),
            (Counter::SimulatedController, total(|r| r.raster.modules.controller)),
            (Counter::SimulatedModeSwitch, total(|r| r.raster.modules.mode_switch)),
            (Counter::SimulatedIdle, total(|r| r.raster.modules.idle)),
            (Counter::SimulatedBytesIn, total(|r| r.raster.bytes_in)),
            (Counter::SimulatedBytesOut, total(|r| r.raster.bytes_out)),
            (Counter::SimulatedSwitches, total(|r| r.raster.switches)),
            (Counter::SimulatedArithmeticEnergy, total(|r| r.energy.arithmetic * 1e6)),
        ];
        for (counter, expected) in expected {
            for counters in [&counters, &recorded] {
                let value = counters.get(counter) as f64;
                assert!((value - expected).abs() <= 2.0, "{name}, {counter:?}: {value} {expected}");
            }
        }
        assert!(counters.get(Counter::SimulatedTime) > 0, "{name}");
        let occupancy = counters.get(Counter::SimulatedOccupancy);
        assert_eq!(occupancy > 0, kind != Kind::Dispatches, "{name}: {occupancy}");
        assert!(occupancy <= 100);
        // Without a request for the model, no time is simulated.
        let plain = counted(kind, QueryKind::Performance, &Config::default());
        assert_eq!(plain.get(Counter::SimulatedTime), 0);
    }
}

/// The counters of a query around a scene, on a device that others may use.
fn counted_on(device: &Arc<Device>, kind: Kind) -> Counters {
    let pool = Arc::new(QueryPool::new(QueryKind::Simulated, 1));
    let [begin, end] = [true, false].map(|begins| {
        let (pool, index) = (Arc::clone(&pool), 0);
        if begins { Packet::BeginQuery { pool, index } } else { Packet::EndQuery { pool, index } }
    });
    draw_on(device, kind, [&[begin], &[end]]);
    match pool.result(0) {
        Some(QueryResult::Performance(counters)) => *counters,
        other => panic!("{other:?}"),
    }
}

#[gaurast_runner::test]
fn queries_of_several_queues_count_what_is_their_own() {
    for config in [Config::default(), recording().0] {
        let device = Arc::new(Device::new(&config).unwrap());
        let alone: Vec<_> = KINDS.map(|(kind, _)| counted_on(&device, kind)).into();
        std::thread::scope(|scope| {
            for round in 0..3 {
                let (device, alone) = (&device, &alone);
                scope.spawn(move || {
                    for step in 0..2 * KINDS.len() {
                        let index = (step * (round + 1) + round) % KINDS.len();
                        let (kind, name) = KINDS[index];
                        let counted = counted_on(device, kind);
                        for counter in Counter::ALL {
                            // Host times differ between runs.
                            if counter.info().category != "time" {
                                let values = [&counted, &alone[index]].map(|c| c.get(*counter));
                                assert_eq!(values[0], values[1], "{name}, {counter:?}");
                            }
                        }
                    }
                });
            }
        });
    }
}

#[gaurast_runner::test]
fn timestamps_may_count_the_models_nanoseconds() {
    let config = Config { simulated_timestamps: true, ..Config::default() };
    let pool = Arc::new(QueryPool::new(QueryKind::Timestamp, 3));
    let stamp = |index| Packet::WriteTimestamp { pool: pool.clone(), index };
    draw(Kind::Mixed, &config, [&[stamp(0)], &[stamp(1), stamp(2)]]);
    let times: Vec<_> = (0..3).map(|index| pool.result(index)).collect();
    let counters = counted(Kind::Mixed, QueryKind::Simulated, &Config::default());
    let time = |nanoseconds| Some(QueryResult::Timestamp(nanoseconds));
    let total = counters.get(Counter::SimulatedTime);
    assert_eq!(times, [time(0), time(total), time(total)]);
}
