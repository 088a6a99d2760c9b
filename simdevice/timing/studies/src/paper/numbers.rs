//! The numbers of the paper's evaluation.

use super::table::{Label, Row, Section};
use timing::work::TILE_PIXELS;

/// A scene of the evaluation.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    pub name: &'static str,
    /// Stage 3 on the shader cores, in ms.
    pub baseline_ms: f64,
    /// Stage 3 on GauRast, in ms.
    pub gaurast_ms: f64,
    /// Gaussians of the 3DGS authors' trained model, in millions: the vertices of its file of 30,000 iterations. The
    /// files were not opened. DirectXSplat's benchmark (`benches/README.md`, cdaba92) lists the points of the files
    /// `iteration_30000/point_cloud.ply`, and AAA-Gaussians (`full_eval.py`, 30e7aa4) has the same seven numbers.
    pub gaussians: f64,
    /// Pixels of the data set's images; the same list of DirectXSplat has them.
    pub size: [u32; 2],
}

const fn scene(name: &'static str, baseline_ms: f64, gaurast_ms: f64, gaussians: f64, size: [u32; 2]) -> Scene {
    Scene { name, baseline_ms, gaurast_ms, gaussians, size }
}

/// The scenes, in the paper's order.
pub const SCENES: [Scene; 7] = [
    scene("bicycle", 321.0, 15.0, 6.131_954, [1237, 822]),
    scene("stump", 149.0, 6.0, 4.961_797, [1245, 825]),
    scene("garden", 232.0, 9.6, 5.834_784, [1297, 840]),
    scene("room", 236.0, 10.5, 1.593_376, [1557, 1038]),
    scene("counter", 216.0, 9.8, 1.222_956, [1558, 1038]),
    scene("kitchen", 269.0, 12.2, 1.852_335, [1558, 1039]),
    scene("bonsai", 147.0, 5.5, 1.244_819, [1559, 1039]),
];

/// Mean of a number over the scenes.
pub fn mean(of: impl Fn(&Scene) -> f64) -> f64 {
    SCENES.iter().map(of).sum::<f64>() / SCENES.len() as f64
}

/// Pairs of a tile and a Gaussian that `pes` PEs evaluate in a time, at one evaluation each per cycle.
pub fn implied_pairs(milliseconds: f64, pes: f64, clock_ghz: f64) -> f64 {
    milliseconds * clock_ghz * 1e6 * pes / f64::from(TILE_PIXELS)
}

/// Power of the SoC, W.
pub const SOC_W: f64 = 10.0;
/// Power of a module, W.
pub const MODULE_W: f64 = 1.7;
/// Modules of the scaled design.
pub const MODULES: f64 = 15.0;
/// Raster speed-up and energy ratio, 3DGS and Mini-Splatting.
pub const RASTER_SPEEDUP: [f64; 2] = [23.0, 20.0];
pub const RASTER_ENERGY: [f64; 2] = [24.0, 22.0];
/// End-to-end speed-up and FPS, 3DGS and Mini-Splatting.
pub const SPEEDUP: [f64; 2] = [6.0, 4.0];
pub const FPS: [f64; 2] = [24.0, 46.0];
/// The least share of the baseline frame that stage 3 takes.
pub const RASTER_SHARE: f64 = 0.8;
/// FPS of the baseline.
pub const BASELINE_FPS: [f64; 2] = [2.0, 5.0];
/// Added area over that of the enhanced units, and over the SoC's.
pub const AREA_RATIO: f64 = 0.21;
pub const AREA_SOC: f64 = 0.002;
/// mm2 of GauRast's enhancement in fp16, and of GSCore, at equal speed.
pub const GSCORE_MM2: [f64; 2] = [0.16, 3.95];
pub const GSCORE_RATIO: f64 = 24.7;
/// Apple M2 Pro: fp32 rate over the baseline's, and GauRast's speed-up over it on bicycle.
pub const M2_RATE: f64 = 2.6;
pub const M2_SPEEDUP: f64 = 11.2;

/// The section of the inputs.
pub fn inputs() -> Section {
    let rows = vec![
        Row::input("PEs of a module", "16"),
        Row::input("clock", "1 GHz"),
        Row::input("technology", "28 nm"),
        Row::input("typical power of a module", "1.7 W"),
        Row::input("numbers in, per primitive", "9").note("Table II"),
        Row::input("numbers out, per pixel", "3").note("Table II"),
        Row::input("shared units of a PE", "9 add, 9 mul")
            .note("Table II; computed and counted by the scalar PE's tests"),
        Row::input("added for triangles", "1 div").note("Table II; the same"),
        Row::input("added for Gaussians", "2 add, 1 mul, 1 exp")
            .note("Table II; the same. They suffice with the opacity folded into the exponent, which is modelled"),
        Row::input("modules of the scaled design", "15"),
        Row::new("PEs of the scaled design", "300", "240", Label::Contradiction)
            .note("15 x 16 = 240; preset paper-300 has 15 x 20"),
        Row::input("SoC power", "10 W"),
        Row::input("speed-up of GSCore over Xavier NX", "20x").note("as GauRast tells of it; enters nothing"),
        Row::without_paper(
            "speed-up of GSCore over a mobile GPU",
            "15.86x",
            Label::Cited,
            "GSCore's own abstract (ASPLOS 2024): on average; enters nothing",
        ),
        Row::input("SoC of the evaluation", "Jetson Orin NX, 10 W mode"),
        Row::without_paper(
            "shader cores, 10 W mode",
            "4 SM, 612 MHz",
            Label::Cited,
            "NVIDIA's power modes of Orin NX 16 GB (nvpmodel_p3767_0000.conf), mode 10W: two TPCs, 612 MHz",
        ),
        Row::without_paper(
            "bandwidth, 10 W mode",
            "68.3 GB/s",
            Label::Cited,
            "the same: memory at 2133 MHz, two transfers a cycle of 128 bits",
        ),
        Row::without_paper(
            "shader cores, maximum mode",
            "8 SM, 918 MHz",
            Label::Cited,
            "the same, mode MAXN: four TPCs; a device query of an Orin NX 16 GB prints 8 multiprocessors and 918 MHz",
        ),
        Row::without_paper(
            "bandwidth, maximum mode",
            "102.4 GB/s",
            Label::Cited,
            "NVIDIA's data sheet of Orin NX, as others quote it",
        ),
        Row::without_paper(
            "tile side",
            "16 pixels",
            Label::Cited,
            "the original 3DGS code (config.h); that the hardware's tiles are as large is assumed",
        ),
        Row::without_paper(
            "cycles between pixels of a PE",
            "1",
            Label::Solved,
            "the paper counts a PE's units, not its cycles; studies/rtl/pe.sv has those units and begins a pixel in each cycle",
        ),
        Row::without_paper(
            "Gaussians of the scenes",
            "1.22-6.13 M",
            Label::Cited,
            "vertices of the 3DGS authors' trained models, 30,000 iterations, as two public repositories list them \
             (docs/simulator.md, Sources); that the paper draws these is assumed",
        ),
    ];
    Section {
        title: "What goes in",
        text: "The hardware of the paper's sections on the design and on the evaluation's set-up; what these don't say is cited from elsewhere or assumed, with an empty column of the paper's."
            .to_owned(),
        rows,
    }
}
