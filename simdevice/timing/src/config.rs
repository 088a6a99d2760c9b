//! The configuration of the hardware, read from a typed TOML file, and the presets. `presets/paper-15x16.toml` gives
//! the source of each number; a preset may inherit from another.

use crate::work::{INTERVALS, Mode, Saturation, Segment, TILE_SIDES};
use serde::{Deserialize, Serialize};
use std::fmt;
use toml::{Table, Value};

/// The configuration of the hardware.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// The rasterizer modules.
    pub rasterizer: Rasterizer,
    /// The unit that writes records into lists.
    pub list_writer: ListWriter,
    /// Main memory, shared by all units.
    pub memory: Memory,
    /// The shader cores.
    pub shader: Shader,
    /// Stage 3 on the shader cores, for a configuration without a rasterizer.
    pub baseline: Baseline,
    /// The chip around them.
    pub soc: Soc,
    /// The overlap of frames.
    pub schedule: ScheduleConfig,
    /// Energy.
    pub energy: EnergyConfig,
    /// Area.
    pub area: AreaConfig,
}

/// Tile lists of Gaussians.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lists {
    /// Tiles that a Gaussian's ellipse reaches, as the device makes them.
    Exact,
    /// Tiles that the square around a Gaussian's 3-sigma circle touches, as the original 3DGS code makes them.
    Squares,
}

/// The place from which the rasterizer reads a primitive's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Records {
    /// A list has indices, as the sort leaves them, and the rasterizer reads the records that they name.
    Gathered,
    /// A unit writes the records into the lists, one after the other, as the module in SystemVerilog reads them.
    Listed,
}

/// The unit that writes records into lists, for [`Records::Listed`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ListWriter {
    /// Cycles of the rasterizer's clock for a pair.
    pub cycles_per_pair: f64,
    /// Its area in mm2 of the rasterizer's technology.
    pub area_mm2: f64,
    /// The energy of a byte that passes through it, in pJ of the table's technology.
    pub pj_per_byte: f64,
}

/// The rasterizer modules.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rasterizer {
    /// The number of modules. If 0, stage 3 runs on the shader cores.
    pub modules: u32,
    /// Processing elements of a module.
    pub pes_per_module: u32,
    /// Clock in GHz.
    pub clock_ghz: f64,
    /// Cycles from one pixel to the next in a PE, in Gaussian mode.
    pub gaussian_interval: u32,
    /// Cycles from one pixel to the next in a PE, in triangle mode.
    pub triangle_interval: u32,
    /// Cycles from operands to the blended pixel.
    pub gaussian_latency: u32,
    /// Cycles from operands to weights and depth.
    pub triangle_latency: u32,
    /// The same with numbers of at most two bytes.
    pub half_triangle_latency: u32,
    /// Cycles from a pixel's transmittance to its next one: two Gaussians that share a pixel can't begin closer to each
    /// other.
    pub carried_latency: u32,
    /// The share of Gaussians taken to share a group of pixels with the one before, if the numbers of groups don't
    /// decide it.
    pub neighbour_sharing: f64,
    /// True if opacity is folded into the exponent. If not, a Gaussian takes one multiplication more than there are
    /// multipliers, and its interval is one cycle longer.
    pub opacity_folded: bool,
    /// The granularity at which finished pixels are skipped, for Gaussians.
    pub saturation: Saturation,
    /// The pixels of a tile at which a triangle is evaluated: those of the 4x4 blocks that it covers (`reached`), or
    /// all.
    pub triangle_traversal: Saturation,
    /// True if a primitive that all of a tile's depths hide is dropped before its pixels are evaluated.
    pub hierarchical_depth: bool,
    /// The side of a tile in pixels: 16, or 8, 32 and 64 as an estimate.
    pub tile_side: u32,
    /// Primitives that half of the tile buffers holds.
    pub batch: u32,
    /// The kind of the tile lists.
    pub lists: Lists,
    /// The place from which primitives' numbers are read.
    pub records: Records,
    /// Numbers that are read for a primitive.
    pub numbers_in: u32,
    /// Numbers that are written for a pixel.
    pub numbers_out: u32,
    /// Bytes of a number. Units of at most two bytes have the latencies, energies and areas whose names begin with
    /// `half`.
    pub number_bytes: u32,
    /// Bytes of an entry of a tile's list.
    pub index_bytes: u32,
    /// Width of a module's memory port.
    pub port_bytes_per_cycle: f64,
    /// Cycles of the controller at a tile's beginning.
    pub tile_overhead: u32,
    /// Cycles to reconfigure once the pipeline has drained.
    pub mode_switch: u32,
}

impl Rasterizer {
    /// The rasterizer with what the pieces of its lists depend on: without its number of modules, and of its buffers only
    /// the size of a piece. Machines that agree in it share the work of making them, if they are simulated one soon after
    /// the other.
    pub fn of_lists(&self) -> Self {
        Self { modules: 0, batch: self.piece(), ..self.clone() }
    }

    /// The number of PEs of all modules.
    pub fn pes(&self) -> u32 {
        self.modules * self.pes_per_module
    }

    /// The granularity at which pixels are skipped in a mode.
    pub fn granularity(&self, mode: Mode) -> Saturation {
        match mode {
            Mode::Triangle => self.triangle_traversal,
            Mode::Gaussian => self.saturation,
        }
    }

    /// Cycles from one pixel to the next in a PE.
    pub fn interval(&self, mode: Mode) -> u32 {
        match mode {
            Mode::Triangle => self.triangle_interval,
            Mode::Gaussian => self.gaussian_interval + u32::from(!self.opacity_folded),
        }
    }

    /// Cycles from operands to results.
    pub fn latency(&self, mode: Mode) -> u32 {
        match mode {
            Mode::Triangle if self.is_half() => self.half_triangle_latency,
            Mode::Triangle => self.triangle_latency,
            Mode::Gaussian => self.gaussian_latency,
        }
    }

    /// Cycles in which a module's PEs evaluate a primitive in `groups` groups of 16 pixels.
    pub fn busy_cycles(&self, mode: Mode, groups: u64) -> u64 {
        let pixels = groups * 16;
        pixels.div_ceil(u64::from(self.pes_per_module)) * u64::from(self.interval(mode))
    }

    /// Cycles in which the PEs wait for a pixel's transmittance after a primitive that is evaluated in `groups` of
    /// `open` groups of 16 pixels. Triangles have no transmittance. If each of two Gaussians takes at most half of the
    /// open groups, they need not share a pixel, and the cycles are multiplied by [`Self::neighbour_sharing`] and
    /// rounded.
    pub fn waiting_cycles(&self, mode: Mode, groups: u64, open: u64) -> u64 {
        if mode == Mode::Triangle || groups == 0 {
            return 0;
        }
        let most = u64::from(self.carried_latency).saturating_sub(self.busy_cycles(mode, groups));
        let must_share = 2 * groups > open;
        if must_share {
            return most;
        }
        (most as f64 * self.neighbour_sharing).round() as u64
    }

    /// Cycles in which the PEs wait for transmittances in a segment whose waits are known: those of the interval that
    /// [`Self::carried_latency`] is, in evaluations of a group.
    pub fn known_waiting_cycles(&self, mode: Mode, segment: &Segment) -> Option<u64> {
        let waits = segment.waits.filter(|_| mode == Mode::Gaussian)?;
        let cycles = self.busy_cycles(mode, 1);
        let interval = usize::try_from(u64::from(self.carried_latency).div_ceil(cycles)).ok()?;
        let evaluations = match interval.checked_sub(2) {
            None => 0,
            Some(index) if index < INTERVALS => u64::from(waits[index]),
            Some(index) => {
                // Beyond the longest interval of the trace, each further evaluation costs what the last one did.
                let [before, longest] = [waits[INTERVALS - 2], waits[INTERVALS - 1]].map(u64::from);
                let further = (index - INTERVALS + 1) as u64;
                longest + further * longest.saturating_sub(before)
            }
        };
        Some(evaluations * cycles)
    }

    /// Cycles of the controller for a primitive that is evaluated at no pixel.
    pub fn looking_cycles(groups: u64) -> u64 {
        u64::from(groups == 0)
    }

    /// True if the units are those of 16-bit numbers.
    pub fn is_half(&self) -> bool {
        self.number_bytes <= 2
    }

    /// Primitives of a piece of the tile buffers, which is fetched at a time: eight, if half of them holds as many.
    pub fn piece(&self) -> u32 {
        self.batch.min(8)
    }

    /// Pieces of both halves.
    pub fn pieces(&self) -> u32 {
        2 * self.batch / self.piece()
    }

    /// Bytes of a module's two halves for primitives.
    pub fn primitive_buffer_bytes(&self) -> f64 {
        2.0 * f64::from(self.batch) * f64::from(self.primitive_bytes())
    }

    /// Bytes of a module's two halves for pixels: a pixel has its numbers and its transmittance.
    pub fn pixel_buffer_bytes(&self) -> f64 {
        let pixels = f64::from(self.tile_side).powi(2);
        2.0 * pixels * f64::from(self.number_bytes) * f64::from(self.numbers_out + 1)
    }

    /// Bytes read for a primitive of a tile's list.
    pub fn primitive_bytes(&self) -> u32 {
        self.numbers_in * self.number_bytes + self.index_bytes
    }

    /// Bytes that the list writer moves for a pair: it reads an index and its record, and writes the entry.
    pub fn written_bytes(&self) -> u32 {
        match self.records {
            Records::Gathered => 0,
            Records::Listed => 2 * self.primitive_bytes(),
        }
    }

    /// Bytes written for a tile.
    pub fn tile_bytes(&self) -> u32 {
        self.tile_side * self.tile_side * self.numbers_out * self.number_bytes
    }
}

/// Main memory.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Memory {
    /// Peak bandwidth in GB/s.
    pub bandwidth_gb_s: f64,
    /// The share of the peak that streams reach.
    pub efficiency: f64,
    /// The latency until the first byte of a request, in ns.
    pub latency_ns: f64,
}

/// The shader cores. Rates are lanes per SM and cycle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "named after the fields of ShaderWork that they execute")]
pub struct Shader {
    pub sms: u32,
    pub clock_ghz: f64,
    pub float_per_cycle: f64,
    pub integer_per_cycle: f64,
    pub special_per_cycle: f64,
    pub wide_per_cycle: f64,
    pub memory_per_cycle: f64,
    pub image_per_cycle: f64,
    /// The share of issue slots that are used.
    pub efficiency: f64,
}

impl Shader {
    /// Peak 32-bit floating-point rate in TFLOPS, a fused multiply-add counted as two.
    pub fn tflops(&self) -> f64 {
        f64::from(self.sms) * self.float_per_cycle * 2.0 * self.clock_ghz * 1e-3
    }
}

/// Stage 3 on shader cores.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Baseline {
    /// The kind of the tile lists.
    pub lists: Lists,
    /// 32-bit operations per pixel and primitive.
    pub operations_per_evaluation: f64,
    /// The share of issue slots that are used.
    pub efficiency: f64,
}

/// The chip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Soc {
    /// Power in W while the shader cores work.
    pub power_w: f64,
    /// Area in mm2.
    pub area_mm2: f64,
    /// The factor by which a circuit's area shrinks from the rasterizer's technology to the chip's.
    pub node_scaling: f64,
}

/// The overlap of frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScheduleConfig {
    /// True if the next frame's stages 1 and 2 run while a frame is rasterized.
    pub collaborative: bool,
    /// The most frames that have begun and not ended.
    pub frames_in_flight: u32,
}

/// Energy: picojoules of the reference technology, unless a field says otherwise. The voltage is the same at every
/// clock.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "the operation or byte is in the name")]
pub struct EnergyConfig {
    /// Rasterizer pJ per pJ of this table, for operations and buffers.
    pub scale: f64,
    /// Leakage of a module in W per mm2 of its units and buffers, in the rasterizer's technology.
    pub leakage_w_per_mm2: f64,
    pub add_pj: f64,
    pub mul_pj: f64,
    pub div_pj: f64,
    pub exp_pj: f64,
    pub half_add_pj: f64,
    pub half_mul_pj: f64,
    pub half_div_pj: f64,
    pub half_exp_pj: f64,
    /// A bit read from a buffer of 8 kB or written to it. A buffer of another size takes the square root of the ratio
    /// of the sizes.
    pub sram_pj_per_bit: f64,
    /// Main memory, in pJ of its own technology.
    pub dram_pj_per_byte: f64,
    /// The share of the calibration frames' evaluations that are blended.
    pub blended_share: f64,
}

/// Area: square micrometres of the reference technology.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "the unit is in the name")]
pub struct AreaConfig {
    pub technology_nm: f64,
    pub reference_nm: f64,
    pub add_um2: f64,
    pub mul_um2: f64,
    pub div_um2: f64,
    /// The area of the exponential unit; 0 to solve it from `enhanced_ratio`.
    pub exp_um2: f64,
    pub half_add_um2: f64,
    pub half_mul_um2: f64,
    /// The area of a bit of a buffer, with its share of decoders and amplifiers.
    pub sram_um2_per_bit: f64,
    /// Area added for Gaussians over the area of the triangle units.
    pub enhanced_ratio: f64,
}

/// The reason that a configuration can't be read.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// No preset has this name.
    #[error("there is no preset {0}; there are {list}", list = preset_names().join(", "))]
    UnknownPreset(String),
    /// The file is not TOML, or a field is missing, unknown or of the wrong kind.
    #[error("{0}")]
    Toml(String),
    /// A setting is not `name=value`.
    #[error("{0} is not NAME=VALUE")]
    Setting(String),
    /// No field has this name.
    #[error("there is no field {0}")]
    UnknownField(String),
    /// Several sections have a field of this name.
    #[error("there are several fields {name}: {}", among.join(", "))]
    Ambiguous {
        /// The name in the setting.
        name: String,
        /// The full names of the fields.
        among: Vec<String>,
    },
    /// A number is out of its range.
    #[error("{field} is {value}; it must be {range}")]
    Range {
        /// The field's full name.
        field: String,
        /// The number as it is written.
        value: String,
        /// The numbers that the field may have.
        range: Range,
    },
    /// Presets inherit from each other in a cycle, or too deeply.
    #[error("{0} inherits from too many")]
    Inheritance(String),
}

const PRESETS: &[(&str, &str)] = &[
    ("paper-15x16", include_str!("../presets/paper-15x16.toml")),
    ("paper-pipeline", include_str!("../presets/paper-pipeline.toml")),
    ("paper-300", include_str!("../presets/paper-300.toml")),
    ("single-module", include_str!("../presets/single-module.toml")),
    ("fp16", include_str!("../presets/fp16.toml")),
    ("orin-nx-10w", include_str!("../presets/orin-nx-10w.toml")),
    ("orin-nx-maxn", include_str!("../presets/orin-nx-maxn.toml")),
    ("m2-pro", include_str!("../presets/m2-pro.toml")),
];

/// The preset for callers that name none.
pub const DEFAULT_PRESET: &str = "paper-15x16";

/// The names of the presets.
pub fn preset_names() -> Vec<&'static str> {
    PRESETS.iter().map(|(name, _)| *name).collect()
}

/// A range of a field's numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Range {
    /// From the first to the second, both included.
    From(f64, f64),
    /// From the first to the second, without the first.
    Above(f64, f64),
    /// Only these numbers.
    OneOf(&'static [u32]),
}

impl Range {
    fn contains(&self, value: f64) -> bool {
        match *self {
            Self::From(low, high) => (low..=high).contains(&value),
            Self::Above(low, high) => value > low && value <= high,
            Self::OneOf(values) => values.iter().any(|&known| f64::from(known) == value),
        }
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::From(low, high) => write!(f, "from {low} to {high}"),
            Self::Above(low, high) => write!(f, "more than {low} and at most {high}"),
            Self::OneOf(values) => {
                let names: Vec<_> = values.iter().map(u32::to_string).collect();
                write!(f, "one of {}", names.join(", "))
            }
        }
    }
}

/// The range of every number, by section and field.
const RANGES: &[(&str, &str, Range)] = {
    use Range::{Above, From, OneOf};
    const SHARE: Range = Above(0.0, 1.0);
    const RATE: Range = From(0.001, 1e5);
    &[
        ("rasterizer", "modules", From(0.0, 4096.0)),
        ("rasterizer", "pes_per_module", From(1.0, 4096.0)),
        ("rasterizer", "clock_ghz", From(0.001, 100.0)),
        ("rasterizer", "gaussian_interval", From(1.0, 1000.0)),
        ("rasterizer", "triangle_interval", From(1.0, 1000.0)),
        ("rasterizer", "gaussian_latency", From(0.0, 10_000.0)),
        ("rasterizer", "triangle_latency", From(0.0, 10_000.0)),
        ("rasterizer", "half_triangle_latency", From(0.0, 10_000.0)),
        ("rasterizer", "carried_latency", From(0.0, 10_000.0)),
        ("rasterizer", "neighbour_sharing", From(0.0, 1.0)),
        ("rasterizer", "tile_side", OneOf(&TILE_SIDES)),
        ("rasterizer", "batch", From(1.0, 65_536.0)),
        ("rasterizer", "numbers_in", From(1.0, 256.0)),
        ("rasterizer", "numbers_out", From(1.0, 256.0)),
        ("rasterizer", "number_bytes", From(1.0, 16.0)),
        ("rasterizer", "index_bytes", From(0.0, 16.0)),
        ("rasterizer", "port_bytes_per_cycle", From(0.01, 65_536.0)),
        ("rasterizer", "tile_overhead", From(0.0, 100_000.0)),
        ("rasterizer", "mode_switch", From(0.0, 100_000.0)),
        ("list_writer", "cycles_per_pair", From(0.0, 1e6)),
        ("list_writer", "area_mm2", From(0.0, 1e5)),
        ("list_writer", "pj_per_byte", From(0.0, 1e6)),
        ("memory", "bandwidth_gb_s", From(0.01, 1e5)),
        ("memory", "efficiency", SHARE),
        ("memory", "latency_ns", From(0.0, 1e6)),
        ("shader", "sms", From(1.0, 4096.0)),
        ("shader", "clock_ghz", From(0.001, 100.0)),
        ("shader", "float_per_cycle", RATE),
        ("shader", "integer_per_cycle", RATE),
        ("shader", "special_per_cycle", RATE),
        ("shader", "wide_per_cycle", RATE),
        ("shader", "memory_per_cycle", RATE),
        ("shader", "image_per_cycle", RATE),
        ("shader", "efficiency", SHARE),
        ("baseline", "operations_per_evaluation", From(0.001, 1e5)),
        ("baseline", "efficiency", SHARE),
        ("soc", "power_w", Above(0.0, 10_000.0)),
        ("soc", "area_mm2", Above(0.0, 100_000.0)),
        ("soc", "node_scaling", From(0.001, 1000.0)),
        ("schedule", "frames_in_flight", From(1.0, 64.0)),
        ("energy", "scale", From(0.0, 1000.0)),
        ("energy", "leakage_w_per_mm2", From(0.0, 1000.0)),
        ("energy", "add_pj", Above(0.0, 1e6)),
        ("energy", "mul_pj", Above(0.0, 1e6)),
        ("energy", "div_pj", From(0.0, 1e6)),
        ("energy", "exp_pj", From(0.0, 1e6)),
        ("energy", "half_add_pj", Above(0.0, 1e6)),
        ("energy", "half_mul_pj", Above(0.0, 1e6)),
        ("energy", "half_div_pj", From(0.0, 1e6)),
        ("energy", "half_exp_pj", From(0.0, 1e6)),
        ("energy", "sram_pj_per_bit", From(0.0, 1e6)),
        ("energy", "dram_pj_per_byte", From(0.0, 1e6)),
        ("energy", "blended_share", From(0.0, 1.0)),
        ("area", "technology_nm", From(1.0, 1000.0)),
        ("area", "reference_nm", From(1.0, 1000.0)),
        ("area", "add_um2", Above(0.0, 1e9)),
        ("area", "mul_um2", Above(0.0, 1e9)),
        ("area", "div_um2", From(0.0, 1e9)),
        ("area", "exp_um2", From(0.0, 1e9)),
        ("area", "half_add_um2", Above(0.0, 1e9)),
        ("area", "half_mul_um2", Above(0.0, 1e9)),
        ("area", "sram_um2_per_bit", From(0.0, 1e6)),
        ("area", "enhanced_ratio", From(0.0, 10.0)),
    ]
};

/// Checks that every number of a configuration's table is in its range. Missing fields and other types are left to
/// serde.
fn check(table: &Table) -> Result<(), ConfigError> {
    for &(section, field, range) in RANGES {
        let value = table.get(section).and_then(|fields| fields.get(field));
        let number = match value {
            Some(Value::Integer(number)) => *number as f64,
            Some(Value::Float(number)) => *number,
            _ => continue,
        };
        if !range.contains(number) {
            return Err(ConfigError::Range { field: format!("{section}.{field}"), value: number.to_string(), range });
        }
    }
    Ok(())
}

/// The most levels of inheritance.
const MAX_DEPTH: usize = 8;

fn parse(text: &str) -> Result<Table, ConfigError> {
    text.parse().map_err(|error: toml::de::Error| ConfigError::Toml(error.to_string()))
}

fn preset_table(name: &str, depth: usize) -> Result<Table, ConfigError> {
    let (_, text) =
        PRESETS.iter().find(|(known, _)| *known == name).ok_or_else(|| ConfigError::UnknownPreset(name.to_owned()))?;
    resolve(parse(text)?, depth)
}

/// The table merged with the presets that it inherits from.
fn resolve(mut table: Table, depth: usize) -> Result<Table, ConfigError> {
    let Some(parent) = table.remove("inherits") else {
        return Ok(table);
    };
    let Value::String(parent) = parent else {
        return Err(ConfigError::Toml("inherits is not the name of a preset".to_owned()));
    };
    if depth >= MAX_DEPTH {
        return Err(ConfigError::Inheritance(parent));
    }
    let mut whole = preset_table(&parent, depth + 1)?;
    for (section, fields) in table {
        match (whole.get_mut(&section), fields) {
            (Some(Value::Table(known)), Value::Table(fields)) => known.extend(fields),
            (_, fields) => {
                whole.insert(section, fields);
            }
        }
    }
    Ok(whole)
}

impl Config {
    /// A preset changed by settings, each `section.field=value`, or `field=value` if only one section has the field.
    ///
    /// # Errors
    /// Returns a [`ConfigError`] for unknown names and numbers out of range.
    pub fn preset(name: &str, settings: &[String]) -> Result<Self, ConfigError> {
        Self::from_table(preset_table(name, 0)?, settings)
    }

    /// A configuration from a file's text, which may inherit from a preset, changed by settings.
    ///
    /// # Errors
    /// As for [`Self::preset`].
    pub fn parse(text: &str, settings: &[String]) -> Result<Self, ConfigError> {
        Self::from_table(resolve(parse(text)?, 0)?, settings)
    }

    /// The configuration changed by settings.
    ///
    /// # Errors
    /// As for [`Self::preset`].
    pub fn with(&self, settings: &[String]) -> Result<Self, ConfigError> {
        let table = Table::try_from(self).map_err(|error| ConfigError::Toml(error.to_string()))?;
        Self::from_table(table, settings)
    }

    fn from_table(mut table: Table, settings: &[String]) -> Result<Self, ConfigError> {
        for setting in settings {
            let (name, value) = setting.split_once('=').ok_or_else(|| ConfigError::Setting(setting.clone()))?;
            set(&mut table, name.trim(), value.trim())?;
        }
        check(&table)?;
        Value::Table(table).try_into().map_err(|error: toml::de::Error| ConfigError::Toml(error.to_string()))
    }
}

/// Sets a field by its full name, or by its own if only one section has it.
fn set(table: &mut Table, name: &str, text: &str) -> Result<(), ConfigError> {
    let unknown = || ConfigError::UnknownField(name.to_owned());
    let full = match name.split_once('.') {
        Some(_) => name.to_owned(),
        None => {
            let among: Vec<_> = table
                .iter()
                .filter(|(_, fields)| fields.get(name).is_some())
                .map(|(section, _)| format!("{section}.{name}"))
                .collect();
            match among.as_slice() {
                [] => return Err(unknown()),
                [one] => one.clone(),
                _ => {
                    let name = name.to_owned();
                    return Err(ConfigError::Ambiguous { name, among });
                }
            }
        }
    };
    let (section, field) = full.split_once('.').ok_or_else(unknown)?;
    let value = table.get_mut(section).and_then(|fields| fields.get_mut(field)).ok_or_else(unknown)?;
    let wrong = || ConfigError::Setting(format!("{name}={text}"));
    *value = match value {
        Value::Integer(_) => Value::Integer(text.parse().map_err(|_| wrong())?),
        Value::Float(_) => Value::Float(text.parse().map_err(|_| wrong())?),
        Value::Boolean(_) => Value::Boolean(text.parse().map_err(|_| wrong())?),
        _ => Value::String(text.to_owned()),
    };
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_can_be_read() {
        for name in preset_names() {
            Config::preset(name, &[]).unwrap_or_else(|error| panic!("{name}: {error}"));
        }
        let paper = Config::preset("paper-15x16", &[]).unwrap();
        assert_eq!(paper.rasterizer.pes(), 240);
        let larger = Config::preset("paper-300", &[]).unwrap();
        assert_eq!(larger.rasterizer.pes(), 300);
        assert_eq!(larger.memory, paper.memory);
    }

    #[test]
    fn every_number_of_the_presets_says_where_it_comes_from() {
        for (name, text) in PRESETS {
            let fields = text.lines().filter(|line| line.contains(" = ") && !line.starts_with("inherits"));
            for line in fields.filter(|line| line.contains(char::is_numeric)) {
                let explained = line.contains('#') || line.trim() == "modules = 0";
                assert!(explained, "{name}: {line}");
            }
        }
    }

    #[test]
    fn settings_by_full_and_by_unique_names() {
        let settings = ["modules=30", "memory.efficiency=0.5", "saturation=block"];
        let config = Config::preset("paper-15x16", &settings.map(str::to_owned)).unwrap();
        assert_eq!(config.rasterizer.modules, 30);
        assert!((config.memory.efficiency - 0.5).abs() < 1e-12);
        assert_eq!(config.rasterizer.saturation, Saturation::Block);
        let error = |setting: &str| Config::preset("fp16", &[setting.to_owned()]).unwrap_err();
        assert!(matches!(error("clock_ghz=1"), ConfigError::Ambiguous { among, .. } if among.len() == 2));
        assert!(matches!(error("moduls=1"), ConfigError::UnknownField(_)));
        assert!(matches!(error("modules"), ConfigError::Setting(_)));
        assert!(matches!(Config::preset("paper", &[]).unwrap_err(), ConfigError::UnknownPreset(_)));
    }

    #[test]
    fn a_file_may_inherit_and_unknown_fields_are_refused() {
        let config = Config::parse("inherits = 'fp16'\n[rasterizer]\nmodules = 3", &[]).unwrap();
        assert_eq!((config.rasterizer.modules, config.rasterizer.number_bytes), (3, 2));
        let typo = Config::parse("inherits = 'fp16'\n[rasterizer]\nmodulse = 3", &[]);
        assert!(matches!(typo, Err(ConfigError::Toml(_))));
        let again = config.with(&["modules=4".to_owned()]).unwrap();
        assert_eq!(again.rasterizer.modules, 4);
    }

    #[test]
    fn what_is_out_of_range_is_named_with_its_value_and_range() {
        let said = |setting: &str| match Config::preset("paper-15x16", &[setting.to_owned()]) {
            Err(error @ ConfigError::Range { .. }) => error.to_string(),
            other => panic!("{setting}: {other:?}"),
        };
        for (setting, sentence) in [
            ("memory.efficiency=100", "memory.efficiency is 100; it must be more than 0 and at most 1"),
            ("power_w=-5", "soc.power_w is -5; it must be more than 0 and at most 10000"),
            ("bandwidth_gb_s=nan", "memory.bandwidth_gb_s is NaN; it must be from 0.01 to 100000"),
            ("numbers_in=4294967295", "rasterizer.numbers_in is 4294967295; it must be from 1 to 256"),
            ("modules=-1", "rasterizer.modules is -1; it must be from 0 to 4096"),
            ("batch=0", "rasterizer.batch is 0; it must be from 1 to 65536"),
            ("tile_side=15", "rasterizer.tile_side is 15; it must be one of 8, 16, 32, 64"),
            ("latency_ns=inf", "memory.latency_ns is inf; it must be from 0 to 1000000"),
        ] {
            assert_eq!(said(setting), sentence);
        }
    }

    #[test]
    fn every_number_has_a_range_that_its_presets_are_in() {
        let table = preset_table("paper-15x16", 0).unwrap();
        let numbers = |fields: &Value| -> Vec<String> {
            let fields = fields.as_table().unwrap().iter();
            let numbers = fields.filter(|(_, value)| value.is_integer() || value.is_float());
            numbers.map(|(name, _)| name.clone()).collect()
        };
        let mut count = 0;
        for (section, fields) in &table {
            for name in numbers(fields) {
                let of_it = RANGES.iter().filter(|(s, f, _)| (s, f) == (&section.as_str(), &name.as_str()));
                assert_eq!(of_it.count(), 1, "{section}.{name}");
                count += 1;
                // NaN is in no range.
                let nan = Config::preset("paper-15x16", &[format!("{section}.{name}=nan")]);
                assert!(nan.is_err(), "{section}.{name}");
            }
        }
        assert_eq!(count, RANGES.len());
    }

    /// A number as a field of a table writes it: integers without a point.
    fn written(number: f64, is_integer: bool) -> String {
        if is_integer { format!("{number:.0}") } else { format!("{number:e}") }
    }

    #[test]
    fn every_number_may_be_at_the_ends_of_its_range_and_not_beyond() {
        let table = preset_table("paper-15x16", 0).unwrap();
        let mut frame = crate::simulate::even_frame([64, 48], 3000, 0.3);
        frame.draws[0].preprocess.float = 1e6;
        frame.draws[0].sort.bytes = 1e6;
        let mut triangles = frame.draws[0].clone();
        triangles.mode = Mode::Triangle;
        frame.draws.push(triangles);
        for &(section, field, range) in RANGES {
            let is_integer = table[section][field].is_integer();
            let with = |number: f64| {
                let text = written(number, is_integer);
                let setting = format!("{section}.{field}={text}");
                Config::preset("paper-15x16", &[setting])
            };
            let (accepted, refused) = match range {
                Range::From(low, high) => (vec![low, high], vec![low - 1.0, high + 1.0]),
                Range::Above(low, high) => (vec![high], vec![low, low - 1.0, high + 1.0]),
                Range::OneOf(values) => {
                    let values: Vec<_> = values.iter().map(|&value| f64::from(value)).collect();
                    let others = values.iter().map(|value| value + 1.0).collect();
                    (values, others)
                }
            };
            for number in accepted {
                let config = with(number);
                let config = config.unwrap_or_else(|error| panic!("{section}.{field}: {error}"));
                let result = crate::simulate::simulate(&frame, &config);
                let numbers = [
                    result.raster.cycles,
                    result.stages.total(),
                    result.fps,
                    result.raster_speedup,
                    result.energy.total(),
                    result.baseline_mj,
                ];
                assert!(
                    numbers.iter().all(|number| number.is_finite() && *number >= 0.0),
                    "{section}.{field}={number}: {numbers:?}"
                );
            }
            let too_large = [1e19, f64::MAX];
            for number in refused.into_iter().chain(too_large) {
                assert!(with(number).is_err(), "{section}.{field}={number}");
            }
            for text in ["", "nan", "inf", "-inf", "1e400", "one", "0x10", "1,5"] {
                let setting = format!("{section}.{field}={text}");
                let config = Config::preset("paper-15x16", &[setting]);
                assert!(config.is_err(), "{section}.{field}={text}");
            }
        }
    }

    #[test]
    fn machines_with_all_numbers_at_one_end_are_simulated() {
        let table = preset_table("paper-15x16", 0).unwrap();
        let frame = crate::simulate::even_frame([64, 48], 3000, 0.3);
        for end in [0, 1] {
            let settings: Vec<_> = RANGES
                .iter()
                .map(|&(section, field, range)| {
                    let number = match range {
                        // A machine without modules has no rasterizer.
                        Range::From(low, _) if field == "modules" && end == 0 => low + 1.0,
                        Range::From(low, high) => [low, high][end],
                        Range::Above(low, high) => [low + high * 1e-6, high][end],
                        Range::OneOf(values) => f64::from(values[end * (values.len() - 1)]),
                    };
                    let text = written(number, table[section][field].is_integer());
                    format!("{section}.{field}={text}")
                })
                .collect();
            let config = Config::preset("paper-15x16", &settings);
            let config = config.unwrap_or_else(|error| panic!("{error}"));
            let result = crate::simulate::simulate(&frame, &config);
            let numbers = [result.raster.cycles, result.fps, result.energy.total()];
            assert!(numbers.iter().all(|number| number.is_finite()), "{numbers:?}");
        }
    }

    #[test]
    fn a_gaussian_takes_16_cycles_of_a_tile() {
        let raster = Config::preset("paper-15x16", &[]).unwrap().rasterizer;
        let gaussian = |raster: &Rasterizer, groups| raster.busy_cycles(Mode::Gaussian, groups);
        assert_eq!(gaussian(&raster, 16), 16);
        assert_eq!(raster.busy_cycles(Mode::Triangle, 16), 16);
        let wide = Rasterizer { pes_per_module: 20, ..raster.clone() };
        assert_eq!(gaussian(&wide, 16), 13, "256 pixels on 20 PEs");
        let unfolded = Rasterizer { opacity_folded: false, ..raster };
        assert_eq!(gaussian(&unfolded, 16), 32, "11 multiplications on 10 units");
    }

    #[test]
    fn waits_of_the_trace_are_those_of_the_latency() {
        let segment = Segment { primitives: 9, groups: 9, open: 16, waits: Some([1, 2, 4, 7, 11, 16, 22, 29]) };
        let with = |setting: &str| {
            let config = Config::preset("paper-15x16", &[setting.to_owned()]).unwrap();
            config.rasterizer.known_waiting_cycles(Mode::Gaussian, &segment)
        };
        for (latency, cycles) in [(0, 0), (1, 0), (2, 1), (7, 16), (9, 29), (11, 43)] {
            assert_eq!(with(&format!("carried_latency={latency}")), Some(cycles), "{latency}");
        }
        // A group takes two cycles, so that seven cycles are four evaluations.
        assert_eq!(with("pes_per_module=8"), Some(8));
        let raster = Config::preset("paper-15x16", &[]).unwrap().rasterizer;
        assert_eq!(raster.known_waiting_cycles(Mode::Triangle, &segment), None);
        assert_eq!(raster.known_waiting_cycles(Mode::Gaussian, &Segment { waits: None, ..segment }), None);
    }

    #[test]
    fn gaussians_that_share_a_pixel_wait_and_others_do_not() {
        let raster = Config::preset("paper-15x16", &[]).unwrap().rasterizer;
        let waits = |mode, groups, open| raster.waiting_cycles(mode, groups, open);
        assert_eq!(waits(Mode::Gaussian, 16, 16), 0, "16 groups hide it");
        assert_eq!(waits(Mode::Gaussian, 2, 2), 5, "both have both blocks");
        assert_eq!(waits(Mode::Gaussian, 2, 3), 5, "two of three are shared");
        assert_eq!(waits(Mode::Gaussian, 2, 4), 3, "half of them are apart");
        let apart = Rasterizer { neighbour_sharing: 0.0, ..raster.clone() };
        assert_eq!(apart.waiting_cycles(Mode::Gaussian, 2, 4), 0, "all are");
        assert_eq!(waits(Mode::Gaussian, 0, 16), 0);
        assert_eq!(waits(Mode::Triangle, 2, 2), 0, "no transmittance");
        assert_eq!([0, 1].map(Rasterizer::looking_cycles), [1, 0]);
    }
}
