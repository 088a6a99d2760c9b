//! Area from the paper's component counts: what a PE shares between modes, and what Gaussians add.

use serde::Serialize;
use timing::config::Config;

/// Areas in mm2 of the rasterizer's technology, except where said.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Area {
    /// A PE's 9 adders, 9 multipliers and divider.
    pub pe_triangle: f64,
    /// 2 adders, a multiplier and the exponential more.
    pub pe_added: f64,
    /// Of the added: the exponential.
    pub exponential: f64,
    /// What Gaussians add to all PEs.
    pub added: f64,
    /// The same in the chip's technology.
    pub added_in_soc: f64,
    /// The share of the chip that it is.
    pub share_of_soc: f64,
    /// Added over what was there.
    pub ratio: f64,
    /// The same as `added`, with 16-bit units.
    pub added_half: f64,
}

/// The area that a configuration's components take.
pub fn area(config: &Config) -> Area {
    let table = &config.area;
    // Areas shrink as the square of the feature size.
    let shrink = (table.technology_nm / table.reference_nm).powi(2) * 1e-6;
    let there = 9.0 * table.add_um2 + 9.0 * table.mul_um2 + table.div_um2;
    let known = 2.0 * table.add_um2 + table.mul_um2;
    let exp = match table.exp_um2 {
        // What the paper's ratio leaves to the exponential.
        0.0 => (table.enhanced_ratio * there - known).max(0.0),
        given => given,
    };
    let added = known + exp;
    let pes = f64::from(config.rasterizer.pes());
    let added_half =
        2.0 * table.half_add_um2 + table.half_mul_um2 + exp * table.half_mul_um2 / table.mul_um2;
    let in_soc = added * shrink * pes / config.soc.node_scaling;
    Area {
        pe_triangle: there * shrink,
        pe_added: added * shrink,
        exponential: exp * shrink,
        added: added * shrink * pes,
        added_in_soc: in_soc,
        share_of_soc: in_soc / config.soc.area_mm2,
        ratio: added / there,
        added_half: added_half * shrink * pes,
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
}
