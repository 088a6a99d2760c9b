//! The rasterizer module in SystemVerilog: its files, and the bench's.

use crate::exponential::{Exponential, table_module};
use crate::number::Format;

/// Files of the hardware, in an order in which tools may read them.
const HARDWARE: &[(&str, &str)] = &[
    ("latencies.svh", include_str!("../rtl/latencies.svh")),
    ("delay.sv", include_str!("../rtl/delay.sv")),
    ("fp_round.sv", include_str!("../rtl/fp_round.sv")),
    ("fp_add.sv", include_str!("../rtl/fp_add.sv")),
    ("fp_mul.sv", include_str!("../rtl/fp_mul.sv")),
    ("fp_div.sv", include_str!("../rtl/fp_div.sv")),
    ("fp_exp2.sv", include_str!("../rtl/fp_exp2.sv")),
    ("pe.sv", include_str!("../rtl/pe.sv")),
    ("pixel_buffer.sv", include_str!("../rtl/pixel_buffer.sv")),
    (
        "primitive_buffer.sv",
        include_str!("../rtl/primitive_buffer.sv"),
    ),
    ("raster_module.sv", include_str!("../rtl/raster_module.sv")),
];

/// Files of the benches.
const BENCHES: &[(&str, &str)] = &[
    ("bench.cpp", include_str!("../rtl/bench.cpp")),
    ("units.sv", include_str!("../rtl/units.sv")),
    ("units.cpp", include_str!("../rtl/units.cpp")),
    ("area.sh", include_str!("../rtl/area.sh")),
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
    names
        .filter(|name| name.ends_with(".sv"))
        .chain([TABLE])
        .collect()
}

/// Cycles of a PE, as `latencies.svh` has them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Latencies {
    /// From a Gaussian's operands to the pixel's colour.
    pub gaussian: u32,
    /// From a triangle's operands to weights and depth.
    pub triangle: u32,
    /// Between two Gaussians of a pixel, at least.
    pub carried: u32,
}

impl Latencies {
    /// Those of a PE whose numbers and exponential are these.
    pub fn of(format: Format, exponential: Exponential) -> Self {
        let (add, mul) = (3, 3);
        let div = (format.mantissa + 3) / 2 + 2;
        let exp = match exponential {
            Exponential::Table => 4,
            Exponential::Polynomial if format.mantissa > 10 => 7,
            Exponential::Polynomial => 5,
        };
        let alpha = 4 * add + 2 * mul + exp;
        Self {
            gaussian: alpha + 2 * add + 2 * mul,
            triangle: mul + 2 * add + div + mul + 2 * add,
            carried: mul + add + 1,
        }
    }
}
