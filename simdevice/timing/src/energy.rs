//! Energy: the number of operations, bits and bytes, times the energy of each. The table is of 45 nm (Horowitz, ISSCC
//! 2014). One factor scales it to the rasterizer's technology and includes everything that the table leaves out (clock
//! tree, control, wires). The factor and the leakage of an area were calibrated once, on the paper's machine
//! ([`calibration`]), and are numbers of the configuration: another machine has the same picojoules an operation. The
//! voltage is constant, so the energy of an operation does not depend on the clock.

use crate::area;
use crate::config::{Config, EnergyConfig, Rasterizer};
use crate::pe::{Operations, PerUnit};
use crate::raster::RasterReport;
use crate::work::Mode;
use serde::Serialize;

/// Energy in millijoules, by component.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Energy {
    /// Adders, multipliers, divider, exponential.
    pub arithmetic: f64,
    /// Tile buffers.
    pub buffers: f64,
    /// Leakage of the modules over the whole frame, whether they work or wait.
    pub leakage: f64,
    /// Main memory, for the rasterizer.
    pub memory: f64,
    /// The list writer, with its main memory.
    pub list_writer: f64,
    /// Shader cores, stages 1 and 2 (and 3, without a rasterizer).
    pub shader_cores: f64,
}

impl Energy {
    /// The energy of the modules alone.
    pub fn modules(&self) -> f64 {
        self.arithmetic + self.buffers + self.leakage
    }

    /// The sum over all components.
    pub fn total(&self) -> f64 {
        self.modules() + self.memory + self.list_writer + self.shader_cores
    }

    /// Names and values, for tables.
    pub fn by_component(&self) -> [(&'static str, f64); 6] {
        [
            ("PE arithmetic", self.arithmetic),
            ("tile buffers", self.buffers),
            ("module leakage", self.leakage),
            ("main memory", self.memory),
            ("list writer", self.list_writer),
            ("shader cores", self.shader_cores),
        ]
    }
}

/// Picojoules of one use of each unit, in the table's technology, for numbers of the configuration's width.
fn units_of(config: &Config) -> PerUnit {
    let table: &EnergyConfig = &config.energy;
    if config.rasterizer.is_half() {
        return PerUnit {
            add: table.half_add_pj,
            mul: table.half_mul_pj,
            div: table.half_div_pj,
            exp: table.half_exp_pj,
        };
    }
    PerUnit { add: table.add_pj, mul: table.mul_pj, div: table.div_pj, exp: table.exp_pj }
}

/// Bytes of the buffer that [`EnergyConfig::sram_pj_per_bit`] is of.
const REFERENCE_SRAM_BYTES: f64 = 8192.0;

/// The energy of a byte that is read from a buffer of `size` bytes or written to it, in pJ of the table's technology.
/// It grows with the square root of the size, as the lengths of the buffer's lines do: Horowitz has 10, 20 and 100 pJ
/// for 64 bits of 8 kB, 32 kB and 1 MB.
fn sram_pj_per_byte(size: f64, config: &Config) -> f64 {
    8.0 * config.energy.sram_pj_per_bit * (size / REFERENCE_SRAM_BYTES).sqrt()
}

/// The energy of a byte of the buffer for primitives, in pJ of the table's technology.
fn primitive_pj_per_byte(config: &Config) -> f64 {
    sram_pj_per_byte(config.rasterizer.primitive_buffer_bytes(), config)
}

/// The energy of a byte of the buffer for pixels, in pJ of the table's technology. Each PE has a bank of it.
fn pixel_pj_per_byte(config: &Config) -> f64 {
    let raster = &config.rasterizer;
    sram_pj_per_byte(raster.pixel_buffer_bytes() / f64::from(raster.pes_per_module), config)
}

/// The energy of one evaluation, in pJ of the table's technology: arithmetic, then buffers. `blended` is the share of
/// evaluations whose Gaussian is blended; for the others the units for blending are gated.
pub fn evaluation_pj(mode: Mode, blended: f64, config: &Config) -> [f64; 2] {
    let (units, raster) = (units_of(config), &config.rasterizer);
    let number = f64::from(raster.number_bytes);
    let (arithmetic, bytes) = match mode {
        Mode::Triangle => {
            let out = f64::from(raster.numbers_out) * number;
            // Depth is read and compared at each pixel; pixels that pass are written.
            (units.sum(Operations::TRIANGLE), number + out * blended)
        }
        Mode::Gaussian => {
            let gated = units.sum(Operations::BLEND) * (1.0 - blended);
            // Transmittance is read at each pixel. Where the Gaussian is blended, colour is read and both are written.
            let bytes = number + blended * number * (2.0 * f64::from(raster.numbers_out) + 1.0);
            (units.sum(Operations::GAUSSIAN) - gated, bytes)
        }
    };
    [arithmetic, bytes * pixel_pj_per_byte(config)]
}

/// The energy of a module's cycle in which all PEs evaluate, in pJ of the table's technology.
fn busy_cycle_pj(mode: Mode, config: &Config) -> f64 {
    let raster: &Rasterizer = &config.rasterizer;
    let [arithmetic, buffers] = evaluation_pj(mode, config.energy.blended_share, config);
    let interval = f64::from(raster.interval(mode));
    // A primitive passes through the buffer once for all PEs: it is written, then read.
    let cycles = f64::from(raster.tile_side).powi(2) * interval / f64::from(raster.pes_per_module);
    let primitive = 2.0 * f64::from(raster.primitive_bytes()) / cycles * primitive_pj_per_byte(config);
    f64::from(raster.pes_per_module) * (arithmetic + buffers) / interval + primitive
}

/// The utilization of the calibration frames: in the paper's scenes, PEs idle only at the edges of tiles.
pub const CALIBRATION_UTILIZATION: f64 = 0.95;

/// The paper's typical power of a module, in W.
pub const PAPER_MODULE_W: f64 = 1.7;

/// The static share of that power, which is assumed.
const STATIC_SHARE: f64 = 0.2;

/// The two constants of a configuration's energy that are calibrated.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Calibration {
    /// See [`EnergyConfig::scale`].
    pub scale: f64,
    /// See [`EnergyConfig::leakage_w_per_mm2`].
    pub leakage_w_per_mm2: f64,
}

/// The constants with which a module of the machine draws the paper's power at the mean activity of the calibration
/// frames. Those of the preset `paper-15x16` are its numbers; other machines keep them.
pub fn calibration(config: &Config) -> Calibration {
    let dynamic_w = PAPER_MODULE_W * (1.0 - STATIC_SHARE);
    let picojoules = dynamic_w / config.rasterizer.clock_ghz * 1e3;
    Calibration {
        scale: picojoules / (busy_cycle_pj(Mode::Gaussian, config) * CALIBRATION_UTILIZATION),
        leakage_w_per_mm2: PAPER_MODULE_W * STATIC_SHARE / area::area(config).module,
    }
}

/// The leakage of all modules and of the list writer in W: that of their area.
pub fn leakage_w(config: &Config) -> f64 {
    let area = area::area(config);
    config.energy.leakage_w_per_mm2 * (area.module * f64::from(config.rasterizer.modules) + area.list_writer)
}

/// Shares of evaluations that changed a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Changed {
    /// The share of Gaussians' evaluations that were blended.
    pub blended: f64,
    /// The share of triangles' evaluations that were covered and passed the early tests.
    pub covered: f64,
}

impl Changed {
    /// The same share for both.
    pub fn both(share: f64) -> Self {
        Self { blended: share, covered: share }
    }
}

/// The energy of stage 3 of a frame on the rasterizer. The next frame begins `frame_ms` after this one.
pub fn rasterizer(report: &RasterReport, changed: Changed, frame_ms: f64, config: &Config) -> Energy {
    let scale = config.energy.scale * 1e-9;
    let mut energy = Energy::default();
    let counts = [
        (Mode::Gaussian, report.gaussian_evaluations, changed.blended),
        (Mode::Triangle, report.triangle_evaluations, changed.covered),
    ];
    for (mode, count, share) in counts {
        let [arithmetic, buffers] = evaluation_pj(mode, share, config);
        energy.arithmetic += count * arithmetic * scale;
        energy.buffers += count * buffers * scale;
    }
    // Primitives are written to their buffer and read from it; pixels that leave are read.
    let through = 2.0 * report.bytes_in * primitive_pj_per_byte(config) + report.bytes_out * pixel_pj_per_byte(config);
    energy.buffers += through * scale;
    energy.leakage = leakage_w(config) * frame_ms;
    energy.memory = (report.bytes_in + report.bytes_out) * config.energy.dram_pj_per_byte * 1e-9;
    energy
}

/// The energy in mJ of the list writer that moves `bytes`.
pub fn list_writer_mj(bytes: f64, config: &Config) -> f64 {
    let through = config.list_writer.pj_per_byte * config.energy.scale;
    bytes * (through + config.energy.dram_pj_per_byte) * 1e-9
}

/// Mean powers in W.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Power {
    /// The power of shader cores, rasterizer and its main memory over a whole frame.
    pub frame_w: f64,
    /// The power of the modules and their main memory while a frame is rasterized.
    pub raster_w: f64,
}

impl Power {
    /// The powers of a frame after which the next begins in `frame_ms`, and whose stage 3 takes `raster_ms`.
    pub fn of(energy: &Energy, frame_ms: f64, raster_ms: f64, config: &Config) -> Self {
        let over =
            |millijoules: f64, milliseconds: f64| if milliseconds > 0.0 { millijoules / milliseconds } else { 0.0 };
        let dynamic = energy.arithmetic + energy.buffers + energy.memory;
        let raster_w = if dynamic > 0.0 { over(dynamic, raster_ms) + leakage_w(config) } else { 0.0 };
        Self { frame_w: over(energy.total(), frame_ms), raster_w }
    }

    /// True if the frame's power exceeds the chip's budget. A budget is for seconds, so it does not limit the power of
    /// the raster stage, which lasts milliseconds.
    pub fn exceeds_budget(&self, config: &Config) -> bool {
        self.frame_w > config.soc.power_w * (1.0 + 1e-9)
    }
}

/// The energy in mJ of shader cores that work for `milliseconds`: the power of the paper's baseline chip times the
/// time.
pub fn shader_cores_mj(milliseconds: f64, config: &Config) -> f64 {
    milliseconds * config.soc.power_w
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::DEFAULT_PRESET;
    use crate::fast;
    use crate::work::{DrawWork, FrameWork, TileWork};

    fn machine(preset: &str, settings: &[&str]) -> Config {
        let settings: Vec<_> = settings.iter().map(|&setting| setting.to_owned()).collect();
        Config::preset(preset, &settings).unwrap()
    }

    fn report(config: &Config) -> RasterReport {
        let tiles = (0..400).map(|x| TileWork::open([x % 20, x / 20], 2000)).collect();
        let draws = vec![DrawWork { tiles, ..DrawWork::default() }];
        fast::rasterize(&FrameWork { size: [320, 320], draws, ..FrameWork::default() }, config, 0.0)
    }

    /// The energy of the frame on a machine, whose next frame begins when it ends.
    fn spent(config: &Config) -> Energy {
        let report = report(config);
        let frame_ms = report.milliseconds(config.rasterizer.clock_ghz);
        rasterizer(&report, Changed::both(config.energy.blended_share), frame_ms, config)
    }

    #[test]
    fn the_preset_has_the_calibrated_constants() {
        let config = machine(DEFAULT_PRESET, &[]);
        let Calibration { scale, leakage_w_per_mm2 } = calibration(&config);
        assert!((config.energy.scale / scale - 1.0).abs() < 1e-3, "{scale}");
        assert!((config.energy.leakage_w_per_mm2 / leakage_w_per_mm2 - 1.0).abs() < 1e-3, "{leakage_w_per_mm2}");
    }

    #[test]
    fn a_module_at_mean_activity_draws_the_papers_power() {
        let config = machine("single-module", &[]);
        let report = report(&config);
        let watts = spent(&config).modules() / report.milliseconds(config.rasterizer.clock_ghz);
        // This frame keeps the PEs busier than the calibration frames do.
        let dynamic = 1.7 * 0.8 * report.utilization() / CALIBRATION_UTILIZATION;
        assert!((watts - (dynamic + 1.7 * 0.2)).abs() < 0.02, "{watts} {}", report.utilization());
    }

    #[test]
    fn the_clock_changes_power_and_leakage_and_no_dynamic_energy() {
        let with = |clock: &str| spent(&machine(DEFAULT_PRESET, &[clock]));
        let [slow, paper, fast] =
            ["rasterizer.clock_ghz=0.5", "rasterizer.clock_ghz=1", "rasterizer.clock_ghz=2"].map(with);
        for other in [slow, fast] {
            assert!((other.arithmetic / paper.arithmetic - 1.0).abs() < 1e-9);
            assert!((other.buffers / paper.buffers - 1.0).abs() < 0.01);
            assert!((other.memory / paper.memory - 1.0).abs() < 0.01);
        }
        // At twice the clock the modules wait longer for memory, in cycles.
        let ratio = slow.leakage / paper.leakage;
        assert!(ratio > 1.5 && ratio <= 2.0, "{ratio}");
    }

    #[test]
    fn dearer_adders_cost_their_share() {
        let (paper, dear) =
            (spent(&machine(DEFAULT_PRESET, &[])), spent(&machine(DEFAULT_PRESET, &["energy.add_pj=9"])));
        // 11 additions and 10 multiplications, of which 3 of each are gated for three quarters of the evaluations; an
        // exponential.
        let [adders, multipliers] = [11.0 - 3.0 * 0.75, 10.0 - 3.0 * 0.75];
        let share = adders * 0.9 / (adders * 0.9 + multipliers * 3.7 + 7.4);
        let more = dear.arithmetic / paper.arithmetic - 1.0;
        assert!((more - 9.0 * share).abs() < 1e-9, "{more} {share}");
        assert_eq!(dear.buffers, paper.buffers);
    }

    #[test]
    fn buffers_cost_by_their_size() {
        let with = |settings: &[&str]| spent(&machine(DEFAULT_PRESET, settings));
        let paper = with(&[]);
        let large = with(&["batch=128"]);
        let sram = |config: &Config| primitive_pj_per_byte(config);
        let ratio = sram(&machine(DEFAULT_PRESET, &["batch=128"])) / sram(&machine(DEFAULT_PRESET, &[]));
        assert!((ratio - 2.0).abs() < 1e-12, "four times the size");
        assert!(large.buffers > paper.buffers, "{large:?} {paper:?}");
        assert!(leakage_w(&machine(DEFAULT_PRESET, &["batch=128"])) > leakage_w(&machine(DEFAULT_PRESET, &[])));
        let sizes =
            [8192.0, 32768.0, 1_048_576.0].map(|size| 8.0 * sram_pj_per_byte(size, &machine(DEFAULT_PRESET, &[])));
        // Horowitz's three sizes: 10, 20 and 100 pJ for 8 bytes.
        for (ours, published) in sizes.into_iter().zip([10.0, 20.0, 100.0]) {
            assert!((ours / published - 1.0_f64).abs() < 0.14, "{ours} {published}");
        }
    }

    #[test]
    fn more_area_leaks_more() {
        let leakage = |settings: &[&str]| leakage_w(&machine("single-module", settings));
        assert!((leakage(&[]) - 0.34).abs() < 1e-3);
        // Twice the units share the buffers.
        let wide = leakage(&["pes_per_module=32"]) / leakage(&[]);
        assert!(wide > 1.5 && wide < 2.0, "{wide}");
        assert!(leakage(&["number_bytes=2"]) < 0.6 * leakage(&[]));
        assert!((leakage(&["modules=4"]) / leakage(&[]) - 4.0).abs() < 1e-9);
    }

    #[test]
    fn two_bytes_a_number_are_the_preset_of_16_bits() {
        assert_eq!(machine(DEFAULT_PRESET, &["number_bytes=2"]), machine("fp16", &[]));
        let (full, half) = (spent(&machine(DEFAULT_PRESET, &[])), spent(&machine("fp16", &[])));
        assert!(half.modules() < 0.6 * full.modules());
    }

    #[test]
    fn gating_spends_less() {
        let config = machine(DEFAULT_PRESET, &[]);
        let report = report(&config);
        let spent = |blended| rasterizer(&report, Changed::both(blended), 1.0, &config).modules();
        assert!(spent(0.1) < spent(0.9));
    }

    #[test]
    fn the_frames_power_is_held_against_the_budget() {
        let config = machine(DEFAULT_PRESET, &[]);
        let energy = Energy { arithmetic: 20.0, shader_cores: 60.0, ..Energy::default() };
        let power = Power::of(&energy, 10.0, 1.0, &config);
        assert!((power.frame_w - 8.0).abs() < 1e-9);
        // 20 W of arithmetic, and 15 modules that leak 0.34 W each.
        assert!((power.raster_w - 25.1).abs() < 0.01, "{power:?}");
        assert!(!power.exceeds_budget(&config));
        assert!(Power::of(&energy, 7.0, 1.0, &config).exceeds_budget(&config));
    }
}
