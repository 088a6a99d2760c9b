//! Energy: the number of operations and bytes, times the energy of each. The table is of 45 nm (Horowitz, ISSCC 2014).
//! One factor scales it to the rasterizer's technology and includes everything that the table leaves out (clock tree,
//! control, wires). The factor is calibrated so that a module at the mean activity of the calibration frames draws the
//! paper's typical power of a module.

use crate::config::{Config, EnergyConfig, Rasterizer};
use crate::pe::Operations;
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
    /// Leakage of the modules.
    pub leakage: f64,
    /// Main memory, for the rasterizer.
    pub memory: f64,
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
        self.modules() + self.memory + self.shader_cores
    }

    /// Names and values, for tables.
    pub fn by_component(&self) -> [(&'static str, f64); 5] {
        [
            ("PE arithmetic", self.arithmetic),
            ("tile buffers", self.buffers),
            ("module leakage", self.leakage),
            ("main memory", self.memory),
            ("shader cores", self.shader_cores),
        ]
    }
}

/// The energy of operations, in pJ of the table's technology.
fn operations_pj(count: Operations, energy: &EnergyConfig) -> f64 {
    count.add as f64 * energy.add_pj
        + count.mul as f64 * energy.mul_pj
        + count.div as f64 * energy.div_pj
        + count.exp as f64 * energy.exp_pj
}

/// The energy of one evaluation, in pJ of the table's technology: arithmetic, then buffers. `blended` is the share of
/// evaluations whose Gaussian is blended; for the others the units for blending are gated.
pub fn evaluation_pj(mode: Mode, blended: f64, config: &Config) -> [f64; 2] {
    let (energy, raster) = (&config.energy, &config.rasterizer);
    let number = f64::from(raster.number_bytes);
    match mode {
        Mode::Triangle => {
            let out = f64::from(raster.numbers_out) * number;
            // Depth is read and compared at each pixel; pixels that pass are written.
            let bytes = number + out * blended;
            [operations_pj(Operations::TRIANGLE, energy), bytes * energy.buffer_pj_per_byte]
        }
        Mode::Gaussian => {
            let all = operations_pj(Operations::GAUSSIAN, energy);
            let gated = operations_pj(Operations::BLEND, energy) * (1.0 - blended);
            // Transmittance is read at each pixel. Where the Gaussian is blended, colour is read and both are written.
            let bytes = number + blended * number * (2.0 * f64::from(raster.numbers_out) + 1.0);
            [all - gated, bytes * energy.buffer_pj_per_byte]
        }
    }
}

/// The energy of a module's cycle in which all PEs evaluate, in pJ of the table's technology.
fn busy_cycle_pj(mode: Mode, config: &Config) -> f64 {
    let raster: &Rasterizer = &config.rasterizer;
    let [arithmetic, buffers] = evaluation_pj(mode, config.energy.blended_share, config);
    // A primitive passes through the buffer once for all PEs: it is written, then read.
    let pixels =
        f64::from(raster.tile_side).powi(2) * f64::from(raster.interval(mode)) / f64::from(raster.pes_per_module);
    let primitive = 2.0 * f64::from(raster.primitive_bytes()) / pixels * config.energy.buffer_pj_per_byte;
    let interval = f64::from(raster.interval(mode));
    f64::from(raster.pes_per_module) * (arithmetic + buffers) / interval + primitive
}

/// The utilization of the calibration frames: in the paper's scenes, PEs idle only at the edges of tiles.
pub const CALIBRATION_UTILIZATION: f64 = 0.95;

/// PEs of the module whose power the paper gives.
const MEASURED_PES: u32 = 16;

/// The hardware whose power is known: this one with modules of the paper's width or, if its power is unknown, the
/// paper's own.
fn measured(config: &Config) -> Config {
    let mut measured = if config.energy.module_power_w > 0.0 {
        config.clone()
    } else {
        Config::preset(crate::config::DEFAULT_PRESET, &[]).unwrap_or_else(|_| config.clone())
    };
    measured.rasterizer.pes_per_module = MEASURED_PES;
    measured
}

/// The scale factor: pJ of the rasterizer's technology per pJ of the table.
pub fn scale(config: &Config) -> f64 {
    if config.energy.scale > 0.0 {
        return config.energy.scale;
    }
    let measured = measured(config);
    let dynamic_w = measured.energy.module_power_w * (1.0 - measured.energy.static_share);
    let picojoules = dynamic_w / measured.rasterizer.clock_ghz * 1e3;
    picojoules / (busy_cycle_pj(Mode::Gaussian, &measured) * CALIBRATION_UTILIZATION)
}

/// The static power of a module in W. It grows with the number of PEs; narrower units are smaller and leak less.
pub fn static_w(config: &Config) -> f64 {
    let measured = measured(config);
    let mut alike = config.clone();
    alike.rasterizer.pes_per_module = MEASURED_PES;
    let of = |config| busy_cycle_pj(Mode::Gaussian, config);
    let size = of(&alike) / of(&measured) * f64::from(config.rasterizer.pes_per_module) / f64::from(MEASURED_PES);
    measured.energy.module_power_w * measured.energy.static_share * size
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

/// The energy of stage 3 of a frame on the rasterizer.
pub fn rasterizer(report: &RasterReport, changed: Changed, config: &Config) -> Energy {
    let scale = scale(config) * 1e-9;
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
    let through = 2.0 * report.bytes_in + report.bytes_out;
    energy.buffers += through * config.energy.buffer_pj_per_byte * scale;
    let seconds = report.cycles / config.rasterizer.clock_ghz * 1e-9;
    energy.leakage = static_w(config) * f64::from(config.rasterizer.modules) * seconds * 1e3;
    energy.memory = (report.bytes_in + report.bytes_out) * config.energy.dram_pj_per_byte * 1e-9;
    energy
}

/// The energy in mJ of shader cores that work for `milliseconds`: the power of the paper's baseline chip times the
/// time.
pub fn shader_cores_mj(milliseconds: f64, config: &Config) -> f64 {
    milliseconds * config.soc.power_w
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fast;
    use crate::work::{DrawWork, FrameWork, TileWork};

    fn report(config: &Config) -> RasterReport {
        let tiles = (0..400).map(|x| TileWork::open([x % 20, x / 20], 2000)).collect();
        let draws = vec![DrawWork { tiles, ..DrawWork::default() }];
        fast::rasterize(&FrameWork { size: [320, 320], draws, ..FrameWork::default() }, config, 0.0)
    }

    #[test]
    fn a_module_at_mean_activity_draws_the_papers_power() {
        let config = Config::preset("single-module", &[]).unwrap();
        let report = report(&config);
        let energy = rasterizer(&report, Changed::both(config.energy.blended_share), &config);
        let watts = energy.modules() / report.milliseconds(config.rasterizer.clock_ghz);
        // This frame keeps the PEs busier than the calibration frames do.
        let dynamic = 1.7 * 0.8 * report.utilization() / CALIBRATION_UTILIZATION;
        assert!((watts - (dynamic + 1.7 * 0.2)).abs() < 0.02, "{watts} {}", report.utilization());
    }

    #[test]
    fn power_is_what_the_configuration_says() {
        let config = Config::preset("single-module", &["module_power_w=0.64".to_owned()]).unwrap();
        let report = report(&config);
        let energy = rasterizer(&report, Changed::both(config.energy.blended_share), &config);
        let watts = energy.modules() / report.milliseconds(config.rasterizer.clock_ghz);
        assert!((watts / 0.64 - 1.0).abs() < 0.06, "{watts}");
        let wide = Config::preset("single-module", &["pes_per_module=32".to_owned()]).unwrap();
        assert!((static_w(&wide) / 0.34 - 2.0).abs() < 1e-9);
    }

    #[test]
    fn half_floats_and_gating_spend_less() {
        let full = Config::preset("paper-15x16", &[]).unwrap();
        let half = Config::preset("fp16", &[]).unwrap();
        let (a, b) = (report(&full), report(&half));
        let spent = |report, blended, config| rasterizer(report, Changed::both(blended), config).modules();
        assert!(spent(&b, 0.25, &half) < 0.6 * spent(&a, 0.25, &full));
        assert!(spent(&a, 0.1, &full) < spent(&a, 0.9, &full));
    }
}
