//! The module in SystemVerilog, under Verilator, against the model bit by bit, and its cycles against the stepped model's.

use crate::tiles::{self, View};
use gaurast_runner::{Case, Need, Variant, data, is_long};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use timing::FrameWork;
use timing::config::Config;
use timing::raster::RasterReport;
use timing::work::{DrawWork, TileWork};
use timing_studies::exponential::{Exponential, exp2};
use timing_studies::module::{Drawn, Groups, List, Module};
use timing_studies::number::Format;
use timing_studies::rtl::{self, Latencies, ModuleBench, Rasterized, UnitBench};
use timing_studies::stepped;

const FORMATS: [(&str, Format); 2] = [("fp32", Format::SINGLE), ("fp16", Format::HALF)];

/// Cycles until memory answers what could not be foreseen.
const LATENCY: u32 = 100;

fn formats() -> Vec<Variant> {
    FORMATS.map(|(name, _)| Variant::new(name)).into()
}

fn format(case: &Case) -> Format {
    let found = FORMATS.iter().find(|(name, _)| *name == case.variant());
    found.expect("a format").1
}

/// A folder that keeps what Verilator builds from one run of the tests to the next.
fn folder() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("rtl")
}

/// One build at a time: tests of a process share what is built.
static BUILDING: Mutex<()> = Mutex::new(());

fn module_bench(format: Format) -> ModuleBench {
    let _guard = BUILDING.lock();
    ModuleBench::build(&folder(), format, &[]).expect("a bench")
}

#[gaurast_runner::test(each = formats(), needs = [Need::Program("verilator"), Need::Program("make"), Need::Program("c++")])]
fn units_compute_the_models_bits(case: &Case) {
    let format = format(case);
    let bench = {
        let _guard = BUILDING.lock();
        UnitBench::build(&folder(), format).expect("a bench")
    };
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mask = u32::MAX >> (32 - format.bits());
    let count = if is_long() { 1_000_000 } else { 40_000 };
    let pairs: Vec<[u32; 2]> = (0..count)
        .map(|index| {
            let mut number = || match index % 3 {
                0 => random.random::<u32>() & mask,
                // Of magnitudes near 1.
                _ => {
                    let exponent = (format.bias() + random.random_range(-8..8)) as u32;
                    let rest = random.random::<u32>()
                        & mask
                        & !(((1 << format.exponent) - 1) << format.mantissa);
                    rest | exponent << format.mantissa
                }
            };
            let a = number();
            let near = a ^ 1 << (format.bits() - 1) ^ index as u32 % 7;
            [a, if index % 6 == 2 { near } else { number() }]
        })
        .collect();
    for ([a, b], results) in pairs.iter().zip(bench.run(&pairs).expect("results")) {
        let (sum, product) = (format.add(*a, *b), format.mul(*a, *b));
        let expected = [
            sum,
            sum,
            product,
            product,
            format.div(*a, *b),
            exp2(format, Exponential::Table, *a),
            exp2(format, Exponential::Polynomial, *a),
        ];
        assert_eq!(results, expected, "{a:x} {b:x}");
    }
}

/// Draws lists on both, and holds every pixel against its twin.
fn compare(bench: &ModuleBench, module: &Module, lists: &[List]) -> (Rasterized, Vec<Drawn>) {
    let rasterized = bench.run(lists, module, LATENCY).expect("a run");
    assert_eq!(rasterized.pixels.len(), lists.len());
    let drawn: Vec<_> = lists.iter().map(|list| module.draw(list)).collect();
    for (index, (ours, theirs)) in rasterized.pixels.iter().zip(&drawn).enumerate() {
        for (pixel, (ours, theirs)) in ours.iter().zip(&theirs.pixels).enumerate() {
            assert_eq!(
                ours, theirs,
                "list {index}, pixel {pixel}: {ours:x?} {theirs:x?}"
            );
        }
    }
    (rasterized, drawn)
}

#[gaurast_runner::test(each = formats(), needs = [Need::Program("verilator"), Need::Program("make"), Need::Program("c++")])]
fn the_module_draws_generated_tiles_as_the_model_does(case: &Case) {
    let format = format(case);
    let bench = module_bench(format);
    let count = if is_long() { 300 } else { 10 };
    let mut contributions = 0;
    for (seed, groups, masked, skips) in [
        (1, Groups::Rows, false, false),
        (2, Groups::Blocks, true, true),
        (3, Groups::Rows, true, true),
    ] {
        let mut module = Module::new(format, Exponential::Table, groups);
        module.skips_groups = skips;
        let lists = tiles::generated(format, groups, masked, count, seed);
        let (_, drawn) = compare(&bench, &module, &lists);
        contributions += drawn
            .iter()
            .map(|drawn| drawn.work.contributions)
            .sum::<u64>();
    }
    assert!(contributions > 1000 * count as u64, "{contributions}");
}

#[gaurast_runner::test(each = formats(), needs = [Need::Program("verilator"), Need::Program("make"), Need::Program("c++"), Need::Data("splats/playbot-125k.ply"), Need::Data("splats/skull.ply")])]
fn the_module_draws_real_tiles_as_the_model_does(case: &Case) {
    let format = format(case);
    let bench = module_bench(format);
    let count = if is_long() { 350 } else { 4 };
    let mut contributions = 0;
    for path in ["splats/playbot-125k.ply", "splats/skull.ply"] {
        let view = View::open(&data(path), [640, 360]);
        let module = Module::new(format, Exponential::Table, Groups::Rows);
        let lists = view.lists(format, None, count, 5);
        assert_eq!(lists.len(), count);
        let (_, drawn) = compare(&bench, &module, &lists);
        contributions += drawn
            .iter()
            .map(|drawn| drawn.work.contributions)
            .sum::<u64>();
    }
    assert!(contributions > 1000 * count as u64, "{contributions}");
}

/// The machine as the model has it: one module of these numbers whose port alone limits.
fn machine(format: Format) -> Config {
    let latencies = Latencies::of(format, Exponential::Table);
    let settings = [
        format!("number_bytes={}", format.bits() / 8),
        format!("gaussian_latency={}", latencies.gaussian),
        format!("triangle_latency={}", latencies.triangle),
        format!("carried_latency={}", latencies.carried),
        format!("latency_ns={LATENCY}"),
        "bandwidth_gb_s=1000".to_owned(),
        "saturation=reached".to_owned(),
        "triangle_traversal=reached".to_owned(),
    ];
    Config::preset("single-module", &settings).expect("a machine")
}

/// The work of lists one after the other, each a tile of its own.
fn frame(lists: &[List], drawn: &[Drawn]) -> FrameWork {
    let draw = |(index, (list, drawn)): (usize, (&List, &Drawn))| DrawWork {
        mode: list.mode,
        tiles: vec![TileWork {
            at: [index as u32, 0],
            ..drawn.work.clone()
        }],
        ..DrawWork::default()
    };
    FrameWork {
        size: [16 * lists.len() as u32, 16],
        draws: lists.iter().zip(drawn).enumerate().map(draw).collect(),
        ..FrameWork::default()
    }
}

/// Cycles by cause of both: all, a pixel each, transmittance, memory, controller, modes.
fn causes(rasterized: &Rasterized, report: &RasterReport) -> [[f64; 2]; 6] {
    let modules = &report.modules;
    let [_, ours @ ..] = rasterized.causes.map(f64::from);
    let theirs = [
        modules.busy,
        modules.dependency,
        modules.memory,
        modules.controller,
        modules.mode_switch,
    ];
    let mut all = [[f64::from(rasterized.cycles), report.cycles]; 6];
    for (place, pair) in all[1..].iter_mut().zip(ours.into_iter().zip(theirs)) {
        *place = [pair.0, pair.1];
    }
    all
}

#[gaurast_runner::test(each = formats(), needs = [Need::Program("verilator"), Need::Program("make"), Need::Program("c++")])]
fn the_modules_cycles_are_the_stepped_models(case: &Case) {
    let format = format(case);
    let bench = module_bench(format);
    let config = machine(format);
    for (seed, groups, masked, skips) in [
        (1, Groups::Rows, false, false),
        (2, Groups::Blocks, true, true),
        (3, Groups::Rows, true, true),
    ] {
        let mut module = Module::new(format, Exponential::Table, groups);
        module.skips_groups = skips;
        let lists = tiles::generated(format, groups, masked, 10, seed);
        let (rasterized, drawn) = compare(&bench, &module, &lists);
        let report = stepped::rasterize(&frame(&lists, &drawn), &config, 0.0);
        println!(
            "{seed} {groups:?} {masked} {skips} {:?} latency {}",
            causes(&rasterized, &report),
            rasterized.latency
        );
    }
}

#[gaurast_runner::test(needs = [Need::Program("yosys")])]
fn yosys_reads_the_module() {
    let folder = folder().join("yosys");
    rtl::write(&folder).expect("files");
    let script = format!(
        "read_verilog -sv -I. {}; hierarchy -check -top raster_module",
        rtl::sources().join(" ")
    );
    let output = std::process::Command::new("yosys")
        .current_dir(&folder)
        .args(["-q", "-p", &script])
        .output()
        .expect("yosys");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
}
