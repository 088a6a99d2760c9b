//! The shader cores: a roofline over the work of stages 1 and 2 (and, without a rasterizer, of stage 3).

use crate::config::{Config, Memory, Shader};
use crate::work::ShaderWork;

/// The two limits of a piece of work: issuing instructions and moving bytes.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Roofline {
    /// Milliseconds to issue the instructions.
    pub compute_ms: f64,
    /// Milliseconds to move the bytes.
    pub memory_ms: f64,
}

impl Roofline {
    /// Milliseconds that the work takes.
    pub fn milliseconds(&self) -> f64 {
        self.compute_ms.max(self.memory_ms)
    }
}

/// The roofline of a piece of work.
pub fn roofline(work: &ShaderWork, shader: &Shader, memory: &Memory) -> Roofline {
    // Units of different kinds work in parallel, but one scheduler issues for all: float and integer share its slots.
    let units = [
        (work.float + work.integer) / shader.float_per_cycle,
        work.integer / shader.integer_per_cycle,
        work.special / shader.special_per_cycle,
        work.wide / shader.wide_per_cycle,
        work.memory / shader.memory_per_cycle,
        work.image / shader.image_per_cycle,
        work.operations() / shader.float_per_cycle,
    ];
    let cycles = units.into_iter().fold(0.0, f64::max);
    let rate = f64::from(shader.sms) * shader.clock_ghz * shader.efficiency * 1e6;
    Roofline { compute_ms: cycles / rate, memory_ms: work.bytes / (memory.bandwidth_gb_s * memory.efficiency * 1e6) }
}

/// Milliseconds of stage 3 on the shader cores, for `evaluations` pairs of a pixel and a primitive.
pub fn stage_3_ms(evaluations: f64, config: &Config) -> f64 {
    let shader = &config.shader;
    let lanes = f64::from(shader.sms) * shader.float_per_cycle * shader.clock_ghz * 1e6;
    evaluations * config.baseline.operations_per_evaluation / (lanes * config.baseline.efficiency)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slowest_unit_or_memory_limits() {
        let config = Config::preset("paper-15x16", &["shader.efficiency=1".to_owned()]).unwrap();
        let time = |work: ShaderWork| roofline(&work, &config.shader, &config.memory);
        let lanes = 4.0 * 0.612e6;
        let float = time(ShaderWork { float: 128.0 * lanes, ..ShaderWork::default() });
        assert!((float.milliseconds() - 1.0).abs() < 1e-9);
        let special = time(ShaderWork { special: 32.0 * lanes, ..ShaderWork::default() });
        assert!((special.milliseconds() - 2.0).abs() < 1e-9);
        let bytes = time(ShaderWork { bytes: 68.3e6 * 0.9 * 3.0, float: lanes, ..ShaderWork::default() });
        assert!((bytes.milliseconds() - 3.0).abs() < 1e-9);
    }
}
