//! Compares the SystemVerilog module, run by Verilator, with the model: its pixels bit by bit, and its cycles with the
//! stepped model's.

use super::page::{hold_rows, hold_table};
use super::tiles::{self, View};
use gaurast_runner::{Case, Missing, Need, Variant, data, ignore, is_long};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use simdevice::timing::config::Config;
use simdevice::timing::work::Mode;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Once, OnceLock};
use timing_studies::exponential::{Exponential, exp2};
use timing_studies::module::{Drawn, Groups, List, Module};
use timing_studies::number::Format;
use timing_studies::rtl::{self, Latencies, MODULES, Memory, ModuleBench, Rasterized, Simulator, UnitBench};
use timing_studies::rtl_cycles::{Cycles, Setting};

const FORMATS: [(&str, Format); 2] = [("fp32", Format::SINGLE), ("fp16", Format::HALF)];

fn formats() -> Vec<Variant> {
    FORMATS.map(|(name, _)| Variant::new(name)).into()
}

/// The formats that Icarus Verilog runs: binary16 or, in a long run, both.
fn formats_of_the_second_simulator() -> Vec<Variant> {
    formats().split_off(if is_long() { 0 } else { 1 })
}

fn format(case: &Case) -> Format {
    let found = FORMATS.iter().find(|(name, _)| *name == case.variant());
    found.expect("a format").1
}

/// A folder that keeps Verilator's build between test runs. Its files are written once, before two builds read them.
pub(super) fn folder() -> PathBuf {
    static FILES: Once = Once::new();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("rtl");
    FILES.call_once(|| rtl::write(&folder).expect("files"));
    folder
}

/// A module's format and the designs of its units.
struct Design {
    name: &'static str,
    format: Format,
    parameters: &'static [&'static str],
    exponential: Exponential,
    /// The bench, which all tests of the process share.
    bench: OnceLock<ModuleBench>,
}

impl Design {
    const fn of_presets(name: &'static str, format: Format) -> Self {
        Self { name, format, parameters: &[], exponential: Exponential::Table, bench: OnceLock::new() }
    }

    /// The other design of each unit: an adder with two paths, Booth's multiplier and the polynomial.
    const fn other(name: &'static str, format: Format) -> Self {
        Self {
            name,
            format,
            parameters: &["-GTWO_PATHS=1", "-GBOOTH=1", "-GPOLYNOMIAL=1"],
            exponential: Exponential::Polynomial,
            bench: OnceLock::new(),
        }
    }

    fn bench(&self) -> &ModuleBench {
        self.bench.get_or_init(|| {
            let parameters: Vec<_> = self.parameters.iter().map(ToString::to_string).collect();
            ModuleBench::build(Simulator::Verilator, &folder(), self.format, &parameters).expect("a bench")
        })
    }

    /// The model of the module in a setting.
    fn module(&self, setting: Setting) -> Module {
        let mut module = setting.module(self.format);
        module.exponential = self.exponential;
        module
    }
}

static DESIGNS: [Design; 4] = [
    Design::of_presets("fp32", Format::SINGLE),
    Design::of_presets("fp16", Format::HALF),
    Design::other("fp32, other units", Format::SINGLE),
    Design::other("fp16, other units", Format::HALF),
];

/// The designs that are built: those of the presets or, in a long run, all.
fn designs() -> Vec<Variant> {
    let count = if is_long() { 4 } else { 2 };
    let built = DESIGNS.iter().take(count);
    built.map(|design| Variant::new(design.name)).collect()
}

fn design(case: &Case) -> &'static Design {
    let found = DESIGNS.iter().find(|design| design.name == case.variant());
    found.expect("a design")
}

#[gaurast_runner::test(each = formats(), needs = [Need::Program("verilator"), Need::Program("make"), Need::Program("c++")])]
fn units_compute_the_models_bits(case: &Case) {
    let format = format(case);
    let bench = UnitBench::build(&folder(), format).expect("a bench");
    let pairs = pairs(format, if is_long() { 1_000_000 } else { 20_000 });
    for (pair, results) in pairs.iter().zip(bench.run(&pairs).expect("results")) {
        assert_eq!(results, results_of_model(format, *pair), "{pair:x?}");
    }
}

/// Pairs of numbers: of random bits, of magnitudes near 1, and pairs that cancel.
pub(super) fn pairs(format: Format, count: usize) -> Vec<[u32; 2]> {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mask = u32::MAX >> (32 - format.bits());
    (0..count)
        .map(|index| {
            let mut number = || match index % 3 {
                0 => random.random::<u32>() & mask,
                // Numbers with magnitudes near 1.
                _ => {
                    let exponent = (format.bias() + random.random_range(-8..8)) as u32;
                    let rest = random.random::<u32>() & mask & !(((1 << format.exponent) - 1) << format.mantissa);
                    rest | exponent << format.mantissa
                }
            };
            let a = number();
            let near = a ^ (1 << (format.bits() - 1)) ^ (index as u32 % 7);
            [a, if index % 6 == 2 { near } else { number() }]
        })
        .collect()
}

/// The model's results for a pair, in the order of [`UnitBench::run`].
pub(super) fn results_of_model(format: Format, [a, b]: [u32; 2]) -> [u32; 7] {
    let (sum, product) = (format.add(a, b), format.mul(a, b));
    let powers = [Exponential::Table, Exponential::Polynomial].map(|exponential| exp2(format, exponential, a));
    [sum, sum, product, product, format.div(a, b), powers[0], powers[1]]
}

/// Draws lists on both, and compares every pixel.
fn compare(bench: &ModuleBench, module: &Module, lists: &[List]) -> Vec<Drawn> {
    let rasterized = bench.run(lists, module, Memory::OF_PRESETS).expect("a run");
    compare_pixels(&rasterized, module, lists)
}

/// Compares every pixel of lists that were drawn with those of the model.
fn compare_pixels(rasterized: &Rasterized, module: &Module, lists: &[List]) -> Vec<Drawn> {
    assert_eq!(rasterized.pixels.len(), lists.len());
    let drawn: Vec<_> = lists.iter().map(|list| module.draw(list)).collect();
    for (index, (ours, theirs)) in rasterized.pixels.iter().zip(&drawn).enumerate() {
        for (pixel, (ours, theirs)) in ours.iter().zip(&theirs.pixels).enumerate() {
            assert_eq!(ours, theirs, "list {index}, pixel {pixel}: {ours:x?} {theirs:x?}");
        }
    }
    drawn
}

#[gaurast_runner::test(each = designs(), needs = [Need::Program("verilator"), Need::Program("make"), Need::Program("c++")])]
fn the_module_draws_generated_tiles_as_the_model_does(case: &Case) {
    let design = design(case);
    let (format, bench) = (design.format, design.bench());
    let count = if is_long() { 300 } else { 5 };
    let mut contributions = 0;
    for setting in Setting::ALL {
        let module = design.module(setting);
        let lists = tiles::generated(format, setting.groups, setting.masked, count, setting.seed);
        let drawn = compare(bench, &module, &lists);
        contributions += drawn.iter().map(|drawn| drawn.work.contributions).sum::<u64>();
    }
    assert!(contributions > 1000 * count as u64, "{contributions}");
}

#[gaurast_runner::test(each = designs(), needs = [Need::Program("verilator"), Need::Program("make"), Need::Program("c++"), Need::Data("splats/playbot-125k.ply"), Need::Data("splats/skull.ply")])]
fn the_module_draws_real_tiles_as_the_model_does(case: &Case) {
    let design = design(case);
    let (format, bench) = (design.format, design.bench());
    let (count, size) = match is_long() {
        true => (350, [1280, 720]),
        false => (2, [640, 360]),
    };
    let mut contributions = 0;
    for path in ["splats/playbot-125k.ply", "splats/skull.ply"] {
        let view = View::open(&data(path), size);
        let module = Module::new(format, design.exponential, Groups::Rows);
        let lists = view.lists(format, None, count, 5);
        assert_eq!(lists.len(), count);
        let drawn = compare(bench, &module, &lists);
        contributions += drawn.iter().map(|drawn| drawn.work.contributions).sum::<u64>();
    }
    assert!(contributions > 1000 * count as u64, "{contributions}");
}

#[gaurast_runner::test(each = formats(), needs = [Need::Program("verilator"), Need::Program("make"), Need::Program("c++")])]
fn the_modules_cycles_are_the_stepped_models(case: &Case) {
    let design = design(case);
    let (format, bench) = (design.format, design.bench());
    let count = if is_long() { 120 } else { 24 };
    for setting in Setting::ALL {
        let lists = tiles::generated(format, setting.groups, setting.masked, count, setting.seed);
        let cycles = Cycles::of(bench, setting, format, &lists, Memory::OF_PRESETS).expect("cycles");
        let [all, busy, dependency, memory, controller, modes] = cycles.by_cause();
        let near = |[ours, model]: [f64; 2], share: f64| {
            assert!((ours - model).abs() <= share * all[1], "{setting:?}: {:?}", cycles.by_cause());
        };
        near(all, 0.02);
        near(busy, 0.015);
        near(dependency, if setting.masked { 0.005 } else { 0.0 });
        near(memory, 0.01);
        near(controller, 0.005);
        near(modes, 0.005);
        assert_eq!(cycles.latency, Latencies::of(format, Exponential::Table).longest() + 1);
    }
}

/// The first of 20 memories that stall in random cycles or, in a long run, all.
fn stalling_memories(sample: u32) -> impl Iterator<Item = Memory> {
    let count = if is_long() { 20 } else { sample };
    (1..=count).map(|stalls| Memory { latency: 37 * stalls % 150, interval: 1 + stalls % 2, stalls })
}

#[gaurast_runner::test(each = designs(), needs = [Need::Program("verilator"), Need::Program("make"), Need::Program("c++")])]
fn no_stall_of_a_port_changes_a_pixel(case: &Case) {
    let design = design(case);
    let (format, bench) = (design.format, design.bench());
    for setting in Setting::ALL {
        let module = design.module(setting);
        let mut lists = tiles::short(format, setting, 20);
        lists.extend(tiles::generated(format, setting.groups, setting.masked, 5, setting.seed));
        let free = bench.run(&lists, &module, Memory::OF_PRESETS).expect("a run");
        // The ring of 64 primitives has room for eight requests of eight.
        assert_eq!(free.requests, 8);
        for memory in stalling_memories(2) {
            let stalled = bench.run(&lists, &module, memory).expect("a run");
            assert!(stalled.cycles > free.cycles, "{memory:?}: {} {}", stalled.cycles, free.cycles);
            compare_pixels(&stalled, &module, &lists);
        }
    }
}

#[gaurast_runner::test(needs = [Need::Program("verilator"), Need::Program("make"), Need::Program("c++")])]
fn modules_share_a_memory() {
    let design = &DESIGNS[1];
    let (format, alone) = (design.format, design.bench());
    let count = if is_long() { 40 } else { 10 };
    let bench = ModuleBench::compile_rasterizer(&folder(), format).expect("a bench");
    for setting in Setting::ALL {
        let module = design.module(setting);
        let lists = tiles::generated(format, setting.groups, setting.masked, count, setting.seed);
        let one = alone.run(&lists, &module, Memory::OF_PRESETS).expect("a run");
        let all = bench.run(&lists, &module, Memory::OF_PRESETS).expect("a run");
        compare_pixels(&all, &module, &lists);
        // Nobody waits for long where evaluation takes most of the time.
        if !setting.masked {
            let share = f64::from(one.cycles) / f64::from(all.cycles);
            assert!(share > 0.75 * f64::from(MODULES), "{} {}", one.cycles, all.cycles);
        }
        assert!(all.requests > 8, "requests of several modules are in flight: {}", all.requests);
        for memory in stalling_memories(1) {
            compare_pixels(&bench.run(&lists, &module, memory).expect("a run"), &module, &lists);
        }
    }
}

/// Lists of the table of cycles with slow memories: drawn of all kinds, or short.
fn lists_for_slow_memories(format: Format, setting: Setting) -> [(&'static str, Vec<List>); 2] {
    let drawn = tiles::generated(format, setting.groups, setting.masked, 40, setting.seed);
    [("drawn", drawn), ("short", tiles::short(format, setting, 60))]
}

/// The errors of the model that simulations use, for memories of two latencies and ports that move 16 bytes in every cycle, in
/// every second and in every fourth. A sample has the short lists of fp16 with the longer latency.
#[gaurast_runner::test(needs = [Need::Program("verilator"), Need::Program("make"), Need::Program("c++")])]
fn the_modules_cycles_are_the_models_with_slow_memories() {
    let (designs, latencies, first) =
        if is_long() { (&DESIGNS[..2], vec![0, 100], 0) } else { (&DESIGNS[1..2], vec![100], 1) };
    let mut rows = String::new();
    for (design, setting) in designs.iter().flat_map(|design| Setting::ALL.map(|setting| (design, setting))) {
        let (format, name) = (design.format, design.name);
        for (kind, lists) in &lists_for_slow_memories(format, setting)[first..] {
            for &latency in &latencies {
                write!(rows, "| {kind} | {name} | {} | {latency} |", setting.name).expect("a string");
                for interval in [1, 2, 4] {
                    let memory = Memory { latency, interval, stalls: 0 };
                    let cycles = Cycles::of(design.bench(), setting, format, lists, memory).expect("cycles");
                    assert_eq!(cycles.different_pixels, 0);
                    let [ours, model] = cycles.with_fast();
                    let error = model / ours - 1.0;
                    write!(rows, " {ours:.0} / {model:.0} ({:+.1} %) |", error * 100.0).expect("a string");
                    assert!(error.abs() <= 0.05, "{memory:?}: {error}\n{rows}");
                }
                rows.push('\n');
            }
        }
    }
    if is_long() {
        let head = "| lists | numbers | groups | latency | all of the port | a half | a quarter |\n\
            |---|---|---|---:|---:|---:|---:|\n";
        hold_table("cycles with slow memories", &format!("{head}{rows}"));
    } else {
        hold_rows("cycles with slow memories", &rows);
    }
}

#[gaurast_runner::test]
fn the_presets_have_the_latencies_of_the_module() {
    for (name, format) in [("paper-15x16", Format::SINGLE), ("fp16", Format::HALF)] {
        let raster = Config::preset(name, &[]).expect("a preset").rasterizer;
        let latencies = Latencies::of(format, Exponential::Table);
        assert_eq!(raster.latency(Mode::Gaussian), latencies.gaussian);
        assert_eq!(raster.latency(Mode::Triangle), latencies.triangle);
        assert_eq!(raster.carried_latency, latencies.carried);
        assert_eq!([raster.gaussian_interval, raster.triangle_interval], [1, 1]);
    }
}

#[gaurast_runner::test(each = formats_of_the_second_simulator(), needs = [Need::Program("iverilog"), Need::Program("vvp")])]
fn a_second_simulator_draws_the_same(case: &Case) {
    let design = design(case);
    let bench = ModuleBench::build(Simulator::Icarus, &folder(), design.format, &[]).expect("a bench");
    // It takes a second for some twenty cycles.
    let longest = if is_long() { 40 } else { 2 };
    for setting in Setting::ALL {
        let kinds = tiles::KINDS.len() + 1;
        let mut lists = tiles::generated(design.format, setting.groups, setting.masked, kinds, setting.seed);
        if !is_long() {
            lists.drain(1..kinds - 1);
        }
        for list in &mut lists {
            list.primitives.truncate(longest);
        }
        compare(&bench, &design.module(setting), &lists);
    }
}

#[gaurast_runner::test(each = designs(), needs = [Need::Program("verilator")])]
fn verilator_has_nothing_to_warn_of(case: &Case) {
    let design = design(case);
    for top in ["raster_module", "rasterizer"] {
        let mut command = Command::new("verilator");
        command
            .current_dir(folder())
            .args(["--lint-only", "-Wall", "--top-module", top])
            .arg(format!("-GEXPONENT={}", design.format.exponent))
            .arg(format!("-GMANTISSA={}", design.format.mantissa))
            .args(design.parameters)
            .args(rtl::sources());
        let output = command.output().expect("verilator");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && said.is_empty(), "{said}");
    }
    let files = rtl::files();
    let waives = |text: &str| text.contains("lint_off") || text.contains("-Wno");
    let waivers: Vec<_> = files.iter().filter(|(_, text)| waives(text)).map(|(name, _)| name).collect();
    assert!(waivers.is_empty(), "{waivers:?}");
}

#[gaurast_runner::test(needs = [Need::Program("verilator"), Need::Program("make"), Need::Program("c++"), Need::Program("iverilog"), Need::Program("yosys")])]
fn the_commands_of_the_readme_run() {
    let folder = folder().join("readme");
    rtl::write(&folder).expect("files");
    let files = rtl::files();
    let readme = &files.iter().find(|(name, _)| *name == "README.md").expect("a README").1;
    let commands: Vec<_> = readme.lines().filter_map(|line| line.strip_prefix("    ")).collect();
    // The programs, the warnings of four modules, the proof and the table of areas take minutes.
    let starts =
        ["bash area.sh", "bash prove.sh", "verilator --cc", "verilator --lint-only -Wall --top-module rasterizer"];
    let is_long_one = |command: &&str| starts.iter().any(|start| command.starts_with(start));
    let (long, short): (Vec<_>, Vec<_>) = commands.into_iter().partition(is_long_one);
    assert_eq!(long.len(), 6);
    let script = if is_long() { [short, long].concat() } else { short }.join("\n");
    let output = Command::new("bash").args(["-euc", &script]).current_dir(&folder).output().expect("bash");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{script}\n{said}");
}

#[gaurast_runner::test(needs = [Need::Program("yosys"), Need::Program("sta")])]
fn a_cell_library_gives_areas_and_times() {
    if std::env::var_os("GAURAST_LIBERTY").is_none() {
        ignore(Missing::Capability, "GAURAST_LIBERTY names no cell library");
    }
    let folder = folder().join("silicon");
    rtl::write(&folder).expect("files");
    let mut command = Command::new("bash");
    command.arg("silicon.sh").args((!is_long()).then_some("quick"));
    let output = command.current_dir(&folder).output().expect("bash");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let table = String::from_utf8_lossy(&output.stdout);
    let rows: Vec<Vec<f64>> = (table.lines().skip(2))
        .map(|row| row.split('|').filter_map(|cell| cell.trim().parse().ok()).collect())
        .collect();
    assert_eq!(rows.len(), if is_long() { 19 } else { 1 });
    // Areas, times and clocks are positive; a slack need not be.
    let is_sound = |row: &Vec<f64>| matches!(row[..], [area, time, _, clock] if area.min(time).min(clock) > 0.0);
    assert!(rows.iter().all(is_sound), "{table}");
    if is_long() {
        let node = std::env::var("GAURAST_LIBERTY_NODE").expect("the gate length");
        hold_table(&format!("cells of {node} nm"), &table);
    }
}

/// The figures of an adder in binary16 that was mapped to cells, for a record of its operands and of the model's sums, of which one
/// bit may be wrong.
fn energy_of_an_adder(folder: &Path, pairs: &[[u32; 2]], wrong: u32) -> Option<Vec<f64>> {
    let latencies = std::fs::read_to_string(folder.join("unit_latencies.svh")).expect("latencies");
    let (_, rest) = latencies.split_once("ADD = ").expect("an adder's latency");
    let latency: usize = rest.split_once(';').and_then(|(cycles, _)| cycles.parse().ok()).expect("cycles");
    let sums = pairs.iter().map(|&[a, b]| Format::HALF.add(a, b));
    let mut record = "issue a b sum\n".to_owned();
    for ([a, b], sum) in pairs.iter().zip(std::iter::repeat_n(0, latency).chain(sums)) {
        writeln!(record, "1 {a:04x} {b:04x} {:04x}", sum ^ wrong).expect("a string");
    }
    let path = folder.join("adder.txt");
    std::fs::write(&path, record).expect("a record");
    let mut command = Command::new("bash");
    command.current_dir(folder).arg("power.sh").arg(&path).arg("adder");
    let output = command.output().expect("bash");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(said.contains("differs from the record"), wrong != 0, "{said}");
    let figures = String::from_utf8_lossy(&output.stdout);
    output
        .status
        .success()
        .then(|| figures.split_whitespace().map(|number| number.parse().expect("a number")).collect())
}

#[gaurast_runner::test(needs = [Need::Program("yosys"), Need::Program("python3")])]
fn toggles_of_cells_give_energy() {
    if std::env::var_os("GAURAST_LIBERTY").is_none() {
        ignore(Missing::Capability, "GAURAST_LIBERTY names no cell library");
    }
    let folder = folder().join("power");
    rtl::write(&folder).expect("files");
    let moving = pairs(Format::HALF, 1000);
    let figures = energy_of_an_adder(&folder, &moving, 0).expect("figures");
    let &[low, middle, high, internal, loads, clock, idle, leakage, bits, busy, _] = figures.as_slice() else {
        panic!("{figures:?}");
    };
    assert!(low < middle && middle < high && idle < low && leakage > 0.0, "{figures:?}");
    assert!((internal + loads + clock - middle).abs() < 1e-9 * middle && internal > 0.0 && loads > 0.0, "{figures:?}");
    assert_eq!((bits, busy), (16.0, 1.0));
    // Where nothing moves, the clock alone costs.
    let still = energy_of_an_adder(&folder, &[moving[0]; 1000], 0).expect("figures");
    let clock_alone = still[..2].iter().all(|energy| (energy / still[6] - 1.0).abs() < 1e-9);
    assert!(clock_alone && still[3] + still[4] == 0.0, "{still:?}");
    assert_eq!(energy_of_an_adder(&folder, &moving, 1), None);
}

#[gaurast_runner::test(needs = [Need::Program("yosys")])]
fn a_gate_count_gives_areas() {
    let folder = folder().join("area");
    rtl::write(&folder).expect("files");
    let mut command = Command::new("bash");
    command.arg("area.sh").args((!is_long()).then_some("quick"));
    let output = command.current_dir(&folder).output().expect("bash");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let table = String::from_utf8_lossy(&output.stdout);
    assert_eq!(table.lines().count(), if is_long() { 18 } else { 3 }, "{table}");
    if is_long() {
        hold_table("transistors", &table);
    } else {
        hold_rows("transistors", &table);
    }
}

#[gaurast_runner::test(needs = [Need::Program("yosys")])]
fn yosys_reads_the_modules() {
    let folder = folder().join("yosys");
    rtl::write(&folder).expect("files");
    let script = format!("read_verilog -sv -I. {}; hierarchy -check -top rasterizer", rtl::sources().join(" "));
    let output = Command::new("yosys").current_dir(&folder).args(["-q", "-p", &script]).output().expect("yosys");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
}
