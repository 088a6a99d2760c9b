//! Wrong rasterizer modules: each is a module's file with one change, and must be told from the right one by the results of
//! its units, by the pixels that it draws and the cycles that it takes, or by the properties of the controller.

use super::rtl::{folder, pairs, results_of_model};
use super::tiles;
use gaurast_runner::{Case, Need, Variant, is_long};
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;
use timing_studies::number::Format;
use timing_studies::rtl::{self, Memory, ModuleBench, Rasterized, Simulator, UnitBench};
use timing_studies::rtl_cycles::Setting;

/// A change of a file.
struct Mutant {
    name: &'static str,
    file: &'static str,
    right: &'static str,
    wrong: &'static str,
}

const fn mutant(name: &'static str, file: &'static str, right: &'static str, wrong: &'static str) -> Mutant {
    Mutant { name, file, right, wrong }
}

const MUTANTS: &[Mutant] = &[
    mutant("ties away from even", "fp_round.sv", "(|significand[EXTRA-2:0] || significand[EXTRA])", "1'b1"),
    mutant("no sticky bit of the sum", "fp_add.sv", "{aligned[WIDTH-1:1], aligned[0] | lost}", "aligned"),
    mutant("no carry of the rounding", "fp_round.sv", "assign carry = rounded[MANTISSA+1];", "assign carry = 1'b0;"),
    mutant("the sign of a cancellation", "fp_add.sv", "zero && vanished2 ? 1'b0 : sign2", "sign2"),
    mutant("the exponential's slope", "fp_exp2.sv", "slope4 <= (SLOPE+1)'(bent >> BEND);", "slope4 <= slope3;"),
    mutant("the product's exponent", "fp_mul.sv", "{{(EXPONENT+1){1'b0}}, high}", "{(EXPONENT+2){1'b0}}"),
    mutant("no remainder of the quotient", "fp_div.sv", "rest[STAGES*(SIZE+1)+:SIZE+1] != 0}", "1'b0}"),
    mutant("no ceiling of alpha", "pe.sv", "power > alpha_ceiling ? alpha_ceiling : power", "power"),
    mutant("the floor of alpha is exclusive", "pe.sv", ".in(!a1[BITS-1])", ".in(!a1[BITS-1] && a1 != 0)"),
    mutant("red and blue", "pe.sv", "assign next_color = {a7, a2, a8};", "assign next_color = {a8, a2, a7};"),
    mutant(
        "coverage without its third weight",
        "pe.sv",
        "!u[BITS-1] && !v[BITS-1] && !a7[BITS-1]",
        "!u[BITS-1] && !v[BITS-1]",
    ),
    mutant(
        "finished pixels blend",
        "pixel_buffer.sv",
        "write && !finished[write_at] && reaches && open",
        "write && reaches && open",
    ),
    mutant(
        "pixels keep the last tile's colour",
        "pixel_buffer.sv",
        "colored[half*16+:16] <= 16'b0;",
        "colored[half*16+:16] <= colored[half*16+:16];",
    ),
    mutant("the depth test", "raster_module.sv", "covered && nearer", "covered"),
    mutant(
        "transmittance is read too early",
        "raster_module.sv",
        "i < CARRIED - 1; i = i + 1)\n            if (mode",
        "i < CARRIED - 2; i = i + 1)\n            if (mode",
    ),
    mutant(
        "the last primitive is left out",
        "raster_module.sv",
        "assign is_last_primitive = {1'b0, current} + 1'b1 == piece_count[using];",
        "assign is_last_primitive = {1'b0, current} + 2'd2 >= piece_count[using];",
    ),
    mutant("a list that ends early is fetched on", "raster_module.sv", "if (drop_list) listed <= 1'b0;", ""),
    mutant(
        "tiles leave while pixels are in flight",
        "raster_module.sv",
        "pixels[leave_tile] == 2 && !in_flight_of_leaving",
        "pixels[leave_tile] == 2",
    ),
    mutant(
        "the mode changes under pixels",
        "raster_module.sv",
        "piece_mode[using] != mode && !in_flight)",
        "piece_mode[using] != mode)",
    ),
    mutant("all pieces are one", "raster_module.sv", "filling <= filling + 1'b1;", "filling <= filling;"),
    mutant("groups of a block", "raster_module.sv", "{group[3:2], 2'(p / 4)}", "{group[1:0], 2'(p / 4)}"),
    mutant("a mask's last group", "raster_module.sv", "(pending & (pending - 1)) == 0", "pending == 16'h8000"),
    mutant(
        "a request in a piece in use",
        "raster_module.sv",
        "!asked[asking] && !ready[asking] &&",
        "!asked[asking] &&",
    ),
    mutant("a request is replaced", "raster_module.sv", " && (!request_valid || request_ready);", ";"),
    mutant("lists have two tags", "raster_module.sv", "localparam int TAG = NUMBER + 1;", "localparam int TAG = 1;"),
    mutant(
        "a piece begins before it has come",
        "raster_module.sv",
        "!piece_last[using] && ready[NUMBER'(using + 1'b1)]",
        "!piece_last[using]",
    ),
    mutant(
        "the port moves data both ways at a time",
        "raster_module.sv",
        "asked[filling] && !(write_valid && write_ready)",
        "asked[filling]",
    ),
    mutant(
        "pixels do not wait for memory",
        "raster_module.sv",
        "if (write_valid && write_ready) begin\n            if (leave_part",
        "if (write_valid) begin\n            if (leave_part",
    ),
    mutant(
        "a primitive's numbers begin a beat late",
        "primitive_buffer.sv",
        "rows[{piece, place}] <= with_data[32+:9*BITS];",
        "rows[{piece, place}] <= with_data[48+:9*BITS];",
    ),
];

/// The mutants that are tried: a sample or, in a long run, all.
fn tried() -> Vec<Variant> {
    let count = if is_long() { MUTANTS.len() } else { 2 };
    MUTANTS.iter().take(count).map(|mutant| Variant::new(mutant.name)).collect()
}

/// True if the units of a folder have the model's results.
fn computes_right(folder: &Path) -> bool {
    let format = Format::SINGLE;
    let pairs = pairs(format, 20_000);
    let results = UnitBench::compile(folder, format).and_then(|bench| bench.run(&pairs));
    results.is_ok_and(|results| {
        pairs.iter().zip(results).all(|(pair, results)| results == results_of_model(format, *pair))
    })
}

/// Runs of the module of a folder over generated tiles and over short lists, for each setting and with ports that stall
/// and that do not. `None` if it is not compiled, or does not end.
fn runs(folder: &Path) -> Option<Vec<Rasterized>> {
    let format = Format::HALF;
    let bench = ModuleBench::compile(Simulator::Verilator, folder, format, &[]).ok()?;
    let count = 2 * (tiles::KINDS.len() + 1);
    let mut runs = Vec::new();
    for setting in Setting::ALL {
        let module = setting.module(format);
        let lists = tiles::generated(format, setting.groups, setting.masked, count, setting.seed);
        let short = tiles::short(format, setting, 3 * count);
        for memory in [Memory::OF_PRESETS, Memory { stalls: 1, ..Memory::OF_PRESETS }] {
            runs.push(bench.run(&lists, &module, memory).ok()?);
            runs.push(bench.run(&short, &module, memory).ok()?);
        }
    }
    Some(runs)
}

/// Runs of the right module, whose pixels are held against the model's elsewhere.
fn right_runs() -> &'static [Rasterized] {
    static RUNS: OnceLock<Vec<Rasterized>> = OnceLock::new();
    RUNS.get_or_init(|| {
        let folder = folder().join("mutants").join("right");
        rtl::write(&folder).expect("files");
        runs(&folder).expect("a module that runs")
    })
}

/// True if the module of a folder draws generated tiles in as many cycles as the right one, with the same pixels.
fn draws_right(folder: &Path) -> bool {
    runs(folder).is_some_and(|runs| runs == right_runs())
}

/// True if yosys proves the properties of the controller of a folder.
fn satisfies_properties(folder: &Path) -> bool {
    let output = Command::new("bash").args(["prove.sh"]).current_dir(folder).output().expect("bash");
    output.status.success()
}

#[gaurast_runner::test(each = tried(), needs = [Need::Program("verilator"), Need::Program("make"), Need::Program("c++"), Need::Program("yosys")])]
fn a_wrong_module_is_told_from_the_right_one(case: &Case) {
    let mutant = MUTANTS.iter().find(|mutant| mutant.name == case.variant()).expect("a mutant");
    let folder = folder().join("mutants").join(mutant.name.replace(' ', "-").replace('\'', ""));
    rtl::write(&folder).expect("files");
    let path = folder.join(mutant.file);
    let text = std::fs::read_to_string(&path).expect("a file");
    assert_eq!(text.matches(mutant.right).count(), 1, "{}", mutant.right);
    std::fs::write(&path, text.replace(mutant.right, mutant.wrong)).expect("a file");
    let is_right = computes_right(&folder) && draws_right(&folder) && satisfies_properties(&folder);
    assert!(!is_right, "it is not told from the right module");
}

#[gaurast_runner::test(needs = [Need::Program("yosys")])]
fn the_controller_satisfies_its_properties() {
    let folder = folder().join("proof");
    rtl::write(&folder).expect("files");
    let cycles = if is_long() { "24" } else { "18" };
    let output = Command::new("bash").args(["prove.sh", cycles]).current_dir(&folder).output().expect("bash");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
}
