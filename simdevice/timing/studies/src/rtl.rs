//! The rasterizer module in SystemVerilog: its files, and the benches that run it under Verilator and Icarus Verilog.

use crate::exponential::{Exponential, table_module};
use crate::module::{Groups, List, Module};
use crate::number::Format;
use std::io::{Error, Result};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use timing::work::{Mode, TILE_GROUPS, TILE_PIXELS};

/// Files of the hardware, in an order in which tools may read them.
const HARDWARE: &[(&str, &str)] = &[
    ("unit_latencies.svh", include_str!("../rtl/unit_latencies.svh")),
    ("latencies.svh", include_str!("../rtl/latencies.svh")),
    ("delay.sv", include_str!("../rtl/delay.sv")),
    ("multiply_add.sv", include_str!("../rtl/multiply_add.sv")),
    ("fp_round.sv", include_str!("../rtl/fp_round.sv")),
    ("fp_add.sv", include_str!("../rtl/fp_add.sv")),
    ("fp_mul.sv", include_str!("../rtl/fp_mul.sv")),
    ("fp_div.sv", include_str!("../rtl/fp_div.sv")),
    ("fp_exp2.sv", include_str!("../rtl/fp_exp2.sv")),
    ("pe.sv", include_str!("../rtl/pe.sv")),
    ("pixel_buffer.sv", include_str!("../rtl/pixel_buffer.sv")),
    ("primitive_buffer.sv", include_str!("../rtl/primitive_buffer.sv")),
    ("raster_module.sv", include_str!("../rtl/raster_module.sv")),
    ("round_robin.sv", include_str!("../rtl/round_robin.sv")),
    ("arbiter.sv", include_str!("../rtl/arbiter.sv")),
    ("rasterizer.sv", include_str!("../rtl/rasterizer.sv")),
];

/// Files of the benches, of the proof and of the measurements.
const BENCHES: &[(&str, &str)] = &[
    ("bench.cpp", include_str!("../rtl/bench.cpp")),
    ("bench.sv", include_str!("../rtl/bench.sv")),
    ("units.sv", include_str!("../rtl/units.sv")),
    ("units.cpp", include_str!("../rtl/units.cpp")),
    ("area.sh", include_str!("../rtl/area.sh")),
    ("properties.svh", include_str!("../rtl/properties.svh")),
    ("formal.sv", include_str!("../rtl/formal.sv")),
    ("prove.sh", include_str!("../rtl/prove.sh")),
    ("cells.sh", include_str!("../rtl/cells.sh")),
    ("silicon.sh", include_str!("../rtl/silicon.sh")),
    ("fan_out.awk", include_str!("../rtl/fan_out.awk")),
    ("power.sh", include_str!("../rtl/power.sh")),
    ("power.py", include_str!("../rtl/power.py")),
    ("module.py", include_str!("../rtl/module.py")),
    ("record.sv", include_str!("../rtl/record.sv")),
    ("coverage.sh", include_str!("../rtl/coverage.sh")),
    ("coverage.py", include_str!("../rtl/coverage.py")),
    ("README.md", include_str!("../rtl/README.md")),
];

/// The file of the exponential's table, which the model writes.
const TABLE: &str = "exp2_table.sv";

/// Names and texts of all files.
pub fn files() -> Vec<(&'static str, String)> {
    let given = HARDWARE.iter().chain(BENCHES);
    let mut files: Vec<_> = given.map(|&(name, text)| (name, text.to_owned())).collect();
    files.push((TABLE, table_module()));
    files
}

/// Names of the modules' files, for a tool's command line.
pub fn sources() -> Vec<&'static str> {
    let names = HARDWARE.iter().map(|(name, _)| *name);
    names.filter(|name| name.ends_with(".sv")).chain([TABLE]).collect()
}

/// The memory of a bench.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Memory {
    /// Cycles from a request to the first of its data.
    pub latency: u32,
    /// Cycles from one movement of 16 bytes, in or out, to the next: 1 for all that the port is wide enough for.
    pub interval: u32,
    /// A seed of random stalls, of half of the cycles of every port; 0 for none.
    pub stalls: u32,
}

impl Memory {
    /// The presets' memory for a module alone: 100 ns.
    pub const OF_PRESETS: Self = Self { latency: 100, interval: 1, stalls: 0 };
}

/// The number of modules that [`ModuleBench::compile_rasterizer`] compiles.
pub const MODULES: u32 = 4;

/// Cycles of a PE, as `latencies.svh` has them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Latencies {
    /// From a Gaussian's operands to the pixel's colour.
    pub gaussian: u32,
    /// From a triangle's operands to weights and depth.
    pub triangle: u32,
    /// The least distance between two Gaussians of a pixel.
    pub carried: u32,
}

impl Latencies {
    /// The latencies of a PE with a format and a design of the exponential.
    pub fn of(format: Format, exponential: Exponential) -> Self {
        let (add, mul) = (3, 3);
        let div = (format.mantissa + 3) / 2 + 2;
        let exp = match exponential {
            Exponential::Table => 6,
            Exponential::Polynomial if format.mantissa > 10 => 12,
            Exponential::Polynomial => 5,
        };
        let alpha = 4 * add + 2 * mul + exp + 1;
        Self {
            gaussian: alpha + 2 * add + 2 * mul,
            triangle: mul + 2 * add + div + mul + 2 * add,
            carried: mul + add + 1,
        }
    }

    /// The longer of the two modes' latencies.
    pub fn longest(self) -> u32 {
        self.gaussian.max(self.triangle)
    }
}

/// Writes all files to a folder, which is created if it doesn't exist.
///
/// # Errors
/// Returns the error of writing a file.
pub fn write(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder)?;
    for (name, text) in files() {
        let path = folder.join(name);
        // An unchanged file keeps its time, so that it is not compiled again.
        if std::fs::read_to_string(&path).is_ok_and(|there| there == text) {
            continue;
        }
        std::fs::write(path, text)?;
    }
    Ok(())
}

/// Compiles a top module and its bench with Verilator. Returns the program's path.
fn build(folder: &Path, top: &str, format: Format, parameters: &[String]) -> Result<PathBuf> {
    // Each design has a folder of its own, so that none replaces another's program.
    let letters = |text: &String| text.replace(|c: char| !c.is_alphanumeric(), "");
    let designs: String = parameters.iter().map(letters).collect();
    let objects = format!("{top}{}{designs}", format.bits());
    let mut command = Command::new("verilator");
    command
        .current_dir(folder)
        .args(["--cc", "--exe", "--build", "-O3", "--Mdir", &objects])
        .args(["-CFLAGS", "-O1", "-MAKEFLAGS", "OPT_FAST=-O1 OPT_SLOW=-O0 OPT_GLOBAL=-O1"])
        .args(["--top-module", top])
        .arg(format!("-GEXPONENT={}", format.exponent))
        .arg(format!("-GMANTISSA={}", format.mantissa))
        .args(parameters)
        .args(sources());
    match top {
        "units" => command.args(["units.sv", "units.cpp"]),
        // Processing elements are compiled once, and not once for each of the module's.
        "raster_module" => command.args(["--hierarchical", "bench.cpp"]),
        _ => command.args(["--hierarchical", "-CFLAGS"]).arg(format!("-DRASTERIZER={MODULES}")).arg("bench.cpp"),
    };
    let output = command.output()?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        return Err(Error::other(format!("verilator: {said}")));
    }
    Ok(folder.join(objects).join(format!("V{top}")))
}

/// Compiles the rasterizer module and its bench with Icarus Verilog. Returns the program's path.
fn build_icarus(folder: &Path, format: Format, parameters: &[String]) -> Result<PathBuf> {
    let program = folder.join(format!("bench{}.vvp", format.bits()));
    let output = Command::new("iverilog")
        .current_dir(folder)
        .args(["-g2012", "-I.", "-s", "bench"])
        .arg(format!("-Pbench.EXPONENT={}", format.exponent))
        .arg(format!("-Pbench.MANTISSA={}", format.mantissa))
        .args(parameters)
        .arg("-o")
        .arg(&program)
        .args(sources())
        .arg("bench.sv")
        .output()?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        return Err(Error::other(format!("iverilog: {said}")));
    }
    Ok(program)
}

/// The words of a bench's file IN, as `bench.cpp` says: lists that a module draws one after the other with a memory.
pub fn bench_input(format: Format, lists: &[List], module: &Module, memory: Memory) -> Vec<u32> {
    let thresholds = &module.thresholds;
    let mut words = vec![
        lists.len() as u32,
        memory.latency,
        memory.interval,
        memory.stalls,
        thresholds.alpha_floor,
        thresholds.alpha_ceiling,
        thresholds.transmittance_floor,
        module.depth[0],
        module.depth[1],
        u32::from(module.groups == Groups::Blocks),
        if module.skips_groups { 2 } else { 1 },
    ];
    let mut contents = Vec::new();
    for list in lists {
        let count = list.primitives.len() as u32;
        words.extend([u32::from(list.mode == Mode::Gaussian), contents.len() as u32, count]);
        store(format, list, &mut contents);
    }
    let (contents, _) = contents.as_chunks();
    words.extend(contents.iter().map(|&bytes| u32::from_le_bytes(bytes)));
    words
}

/// Appends a list to memory, padded to a multiple of 16 bytes.
fn store(format: Format, list: &List, memory: &mut Vec<u8>) {
    let bytes = format.bits() as usize / 8;
    for primitive in &list.primitives {
        memory.extend(u32::from(primitive.groups()).to_le_bytes());
        for number in primitive.numbers() {
            memory.extend(&number.to_le_bytes()[..bytes]);
        }
    }
    memory.resize(memory.len().next_multiple_of(16), 0);
}

/// Runs a bench on input words. Returns its output words.
fn run(program: &Path, words: &[u32]) -> Result<Vec<u32>> {
    let folder = program.parent().unwrap_or(Path::new("."));
    let unique = format!("{}-{:?}", std::process::id(), std::thread::current().id());
    let [input, output] = ["in", "out"].map(|name| folder.join(format!("{name}-{unique}")));
    let bytes: Vec<_> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    std::fs::write(&input, bytes)?;
    let status = if program.extension().is_some_and(|extension| extension == "vvp") {
        let arguments = [("+in=", &input), ("+out=", &output)];
        let arguments = arguments.map(|(name, path)| format!("{name}{}", path.display()));
        Command::new("vvp").arg("-N").arg(program).args(arguments).stdout(Stdio::null()).status()
    } else {
        Command::new(program).args([&input, &output]).status()
    };
    let bytes = std::fs::read(&output);
    let _ = std::fs::remove_file(&input);
    let _ = std::fs::remove_file(&output);
    if !status?.success() {
        return Err(Error::other(format!("{}: failed", program.display())));
    }
    let words = bytes?;
    Ok(words.chunks_exact(4).map(|word| word.iter().rev().fold(0, |all, &byte| all << 8 | u32::from(byte))).collect())
}

/// A program that runs every unit, in every design, under Verilator.
#[derive(Debug)]
pub struct UnitBench(PathBuf);

impl UnitBench {
    /// Writes all files to a folder, and compiles them as [`UnitBench::compile`] does.
    ///
    /// # Errors
    /// Returns an error if a file can't be written, or if Verilator is missing or fails.
    pub fn build(folder: &Path, format: Format) -> Result<Self> {
        write(folder)?;
        Self::compile(folder, format)
    }

    /// Compiles the units for a format from the files of a folder, which keeps the compiled program.
    ///
    /// # Errors
    /// Returns an error if Verilator is missing or fails.
    pub fn compile(folder: &Path, format: Format) -> Result<Self> {
        build(folder, "units", format, &[]).map(Self)
    }

    /// Computes for each pair: the sum, the sum by two paths, the product, the product by Booth's digits, the quotient,
    /// and the power of the first number by the table and by the polynomial.
    ///
    /// # Errors
    /// Returns an error if the program can't be run.
    pub fn run(&self, pairs: &[[u32; 2]]) -> Result<Vec<[u32; 7]>> {
        let words = run(&self.0, pairs.as_flattened())?;
        let (results, _) = words.as_chunks();
        Ok(results.to_vec())
    }
}

/// A simulator of SystemVerilog.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Simulator {
    /// Verilator, which compiles to C++.
    Verilator,
    /// Icarus Verilog, which interprets events.
    Icarus,
}

/// A program that runs a rasterizer module in a simulator.
#[derive(Debug)]
pub struct ModuleBench {
    program: PathBuf,
    format: Format,
}

/// The result of a run of the module.
#[derive(Clone, Debug, PartialEq)]
pub struct Rasterized {
    /// Cycles until all work is done.
    pub cycles: u32,
    /// Cycles of the PEs by cause: no work, evaluating a pixel each, waiting for a transmittance, for memory, for the
    /// controller, changing modes.
    pub causes: [u32; 6],
    /// The most cycles that a pixel spends in the pipeline; of one module only.
    pub latency: u32,
    /// The most requests that memory had not answered at one time.
    pub requests: u32,
    /// The pixels of each list, as [`crate::module::Drawn::pixels`].
    pub pixels: Vec<Vec<[u32; 3]>>,
}

impl ModuleBench {
    /// Writes all files to a folder, and compiles them as [`ModuleBench::compile`] does.
    ///
    /// # Errors
    /// Returns an error if a file can't be written, or if the simulator is missing or fails.
    pub fn build(simulator: Simulator, folder: &Path, format: Format, parameters: &[String]) -> Result<Self> {
        write(folder)?;
        Self::compile(simulator, folder, format, parameters)
    }

    /// Compiles [`MODULES`] modules and their arbiter for a format with Verilator, from the files of a folder, which
    /// keeps the compiled program.
    ///
    /// # Errors
    /// Returns an error if Verilator is missing or fails.
    pub fn compile_rasterizer(folder: &Path, format: Format) -> Result<Self> {
        Ok(Self { program: build(folder, "rasterizer", format, &[])?, format })
    }

    /// Compiles a module for a format from the files of a folder, which keeps the compiled program. `parameters` are the
    /// simulator's arguments.
    ///
    /// # Errors
    /// Returns an error if the simulator is missing or fails.
    pub fn compile(simulator: Simulator, folder: &Path, format: Format, parameters: &[String]) -> Result<Self> {
        let program = match simulator {
            Simulator::Verilator => build(folder, "raster_module", format, parameters)?,
            Simulator::Icarus => build_icarus(folder, format, parameters)?,
        };
        Ok(Self { program, format })
    }

    /// Draws lists one after the other on a module with a memory.
    ///
    /// # Errors
    /// Returns an error if the program can't be run.
    pub fn run(&self, lists: &[List], module: &Module, memory: Memory) -> Result<Rasterized> {
        let words = bench_input(self.format, lists, module, memory);
        let out = run(&self.program, &words)?;
        let (head, beats) = out.split_first_chunk::<9>().ok_or_else(|| Error::other("the bench wrote nothing"))?;
        let &[cycles, a, b, c, d, e, f, latency, requests] = head;
        let per_tile = (TILE_PIXELS * 3 * self.format.bits() / 32) as usize;
        Ok(Rasterized {
            cycles,
            causes: [a, b, c, d, e, f],
            latency,
            requests,
            pixels: beats.chunks(per_tile).map(|tile| self.pixels(tile)).collect(),
        })
    }

    /// A tile's pixels from the written words: for each group, the first numbers of all its pixels, then the second
    /// ones.
    fn pixels(&self, tile: &[u32]) -> Vec<[u32; 3]> {
        let bits = self.format.bits() as usize;
        let number = |index: usize| {
            let word = tile.get(index * bits / 32).copied().unwrap_or_default();
            word >> (index * bits % 32) & (u32::MAX >> (32 - bits))
        };
        let lanes = (TILE_PIXELS / TILE_GROUPS) as usize;
        let pixel = |index: usize| {
            let (group, lane) = (index / lanes, index % lanes);
            [0, 1, 2].map(|which| number((group * 3 + which) * lanes + lane))
        };
        (0..TILE_PIXELS as usize).map(pixel).collect()
    }
}
