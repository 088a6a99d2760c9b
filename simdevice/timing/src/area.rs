//! Area from the paper's component counts: the triangle units of a PE, the units added for Gaussians, and buffers.

use crate::config::{AreaConfig, Config, Records};
use crate::pe::{Operations, PerUnit};
use serde::Serialize;

/// Areas in mm2 of the rasterizer's technology, unless a field says otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Area {
    /// A PE's 9 adders, 9 multipliers and divider.
    pub pe_triangle: f64,
    /// Its additional 2 adders, multiplier and exponential unit.
    pub pe_added: f64,
    /// The exponential unit, which is part of `pe_added`.
    pub exponential: f64,
    /// A module's PEs and buffers.
    pub module: f64,
    /// The list writer, if the machine has one.
    pub list_writer: f64,
    /// The module's buffers for primitives and pixels, which are part of `module`.
    pub buffers: f64,
    /// The area added for Gaussians in all PEs.
    pub added: f64,
    /// The area added for Gaussians in all PEs, in mm2 of the chip's technology.
    pub added_in_soc: f64,
    /// `added_in_soc` as a share of the chip's area.
    pub share_of_soc: f64,
    /// The added area over the area of the triangle units.
    pub ratio: f64,
    /// The area added for Gaussians in all PEs if their units had 16 bits.
    pub added_half: f64,
}

/// The units that Gaussians add to a PE for triangles; GauRast, Table II.
const ADDED: Operations = Operations { add: 2, mul: 1, div: 0, exp: 1 };

/// Areas of single 32-bit units in um2 of the reference technology. If the exponential's area is not given, it is solved from the
/// paper's ratio.
fn single_units(table: &AreaConfig) -> PerUnit {
    let units = PerUnit { add: table.add_um2, mul: table.mul_um2, div: table.div_um2, exp: table.exp_um2 };
    if units.exp != 0.0 {
        return units;
    }
    let exp = table.enhanced_ratio * units.sum(Operations::TRIANGLE) - units.sum(ADDED);
    PerUnit { exp: exp.max(0.0), ..units }
}

/// The same of 16-bit units. Divider and exponential shrink as multipliers do.
fn half_units(table: &AreaConfig) -> PerUnit {
    let single = single_units(table);
    let shrink = table.half_mul_um2 / table.mul_um2;
    PerUnit { add: table.half_add_um2, mul: table.half_mul_um2, div: single.div * shrink, exp: single.exp * shrink }
}

/// The area of a configuration's components. Units have 16 bits if its numbers have at most two bytes.
pub fn area(config: &Config) -> Area {
    let table = &config.area;
    let units = if config.rasterizer.is_half() { half_units(table) } else { single_units(table) };
    let (triangle, added) = (units.sum(Operations::TRIANGLE), units.sum(ADDED));
    // Areas shrink as the square of the feature size.
    let shrink = (table.technology_nm / table.reference_nm).powi(2) * 1e-6;
    let pes = f64::from(config.rasterizer.pes());
    let buffer_bytes = config.rasterizer.primitive_buffer_bytes() + config.rasterizer.pixel_buffer_bytes();
    let buffers = 8.0 * buffer_bytes * table.sram_um2_per_bit * shrink;
    let module_pes = f64::from(config.rasterizer.pes_per_module);
    let in_soc = added * shrink * pes / config.soc.node_scaling;
    Area {
        pe_triangle: triangle * shrink,
        pe_added: added * shrink,
        exponential: units.exp * shrink,
        module: module_pes * (triangle + added) * shrink + buffers,
        list_writer: match config.rasterizer.records {
            Records::Gathered => 0.0,
            Records::Listed => config.list_writer.area_mm2,
        },
        buffers,
        added: added * shrink * pes,
        added_in_soc: in_soc,
        share_of_soc: in_soc / config.soc.area_mm2,
        ratio: added / triangle,
        added_half: half_units(table).sum(ADDED) * shrink * pes,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_is_what_the_papers_ratio_leaves() {
        let config = Config::preset("paper-15x16", &[]).unwrap();
        let solved = area(&config);
        assert!((solved.ratio - 0.21).abs() < 1e-12);
        assert!(solved.exponential > 0.0 && solved.exponential < solved.pe_added);
        let given = area(&config.with(&["exp_um2=20000".to_owned()]).unwrap());
        assert!(given.ratio > 0.3);
        let twice = area(&config.with(&["modules=30".to_owned()]).unwrap());
        assert!((twice.added - 2.0 * solved.added).abs() < 1e-12);
    }

    #[test]
    fn a_module_has_its_pes_and_buffers() {
        let of = |settings: &[&str]| {
            let settings: Vec<_> = settings.iter().map(|&setting| setting.to_owned()).collect();
            area(&Config::preset("paper-15x16", &settings).unwrap())
        };
        let paper = of(&[]);
        assert!((paper.module - paper.buffers - 16.0 * (paper.pe_triangle + paper.pe_added)).abs() < 1e-12);
        // 64 primitives of 40 bytes, and 512 pixels of four numbers.
        let bits = 8.0 * (64.0 * 40.0 + 512.0 * 16.0);
        assert!((paper.buffers - bits * 0.6e-6 * (28.0_f64 / 45.0).powi(2)).abs() < 1e-12);
        let larger = of(&["batch=64"]);
        assert!((larger.module - larger.buffers - paper.module + paper.buffers).abs() < 1e-12);
        assert!(larger.buffers > paper.buffers && of(&["number_bytes=2"]).module < 0.5 * paper.module);
    }

    #[test]
    fn a_machine_of_16_bits_has_units_of_16_bits() {
        let of = |preset: &str| area(&Config::preset(preset, &[]).unwrap());
        let (single, half) = (of("paper-15x16"), of("fp16"));
        assert_eq!(half.added, single.added_half);
        assert!(half.added < 0.5 * single.added && half.pe_triangle < 0.5 * single.pe_triangle);
        assert!(half.share_of_soc < 0.5 * single.share_of_soc);
    }
}
