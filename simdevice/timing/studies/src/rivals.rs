//! Other ways to draw Gaussians on the same chip: as blended quads through the rasterizer that every GPU has; and the
//! published numbers of other accelerators.

use serde::Serialize;
use timing::config::Config;
use timing::shader_cores;
use timing::work::{DrawWork, FrameWork, Mode, ShaderWork, TILE_GROUPS, TILE_PIXELS};

/// Stage 3 by quads: each Gaussian is two triangles around its ellipse, shaded by a fragment program and blended by the
/// ROPs. Nothing ends early, because blending hardware doesn't know that a pixel is finished.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Quads {
    /// Fragments that are shaded.
    pub fragments: f64,
    /// Milliseconds of shading vertices and fragments.
    pub shade_ms: f64,
    /// Milliseconds of setting up triangles.
    pub setup_ms: f64,
    /// Milliseconds of blending.
    pub blend_ms: f64,
    /// Milliseconds of main memory, if every blend hits the cache of its tile.
    pub memory_ms: f64,
}

/// Pixels that the ROPs blend in a cycle: 16 of them in Orin NX, 16-bit floats at half the rate (both assumed, because no
/// public text that gives them was found).
const BLENDS_PER_CYCLE: f64 = 8.0;
/// Triangles that are set up in a cycle, one for each of two GPCs (assumed).
const SETUPS_PER_CYCLE: f64 = 2.0;
/// Bytes of a pixel of 16-bit floats.
const PIXEL_BYTES: f64 = 8.0;
/// Bytes of a Gaussian's instance: centre, axes, colour and opacity.
const INSTANCE_BYTES: f64 = 36.0;
/// The ratio of shaded fragments to the pixels of a Gaussian's 4x4 blocks: a rectangle has 4/pi times the area of its
/// ellipse.
const RECTANGLE: f64 = 4.0 / std::f64::consts::PI;

/// The work of a fragment: the quadratic form of two interpolated numbers, its test, an exponential, four outputs.
const FRAGMENT: ShaderWork =
    ShaderWork { float: 10.0, integer: 2.0, special: 1.0, wide: 0.0, memory: 2.0, image: 0.0, other: 4.0, bytes: 0.0 };

/// The work of a vertex, which is a corner of the rectangle.
const VERTEX: ShaderWork =
    ShaderWork { float: 12.0, integer: 4.0, special: 0.0, wide: 0.0, memory: 9.0, image: 0.0, other: 4.0, bytes: 0.0 };

/// The work of drawing quads.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fragments {
    /// Fragments that are shaded.
    pub shaded: f64,
    /// Fragments that the ROPs blend.
    pub blended: f64,
    /// Gaussians, of which each is a rectangle.
    pub gaussians: f64,
}

impl Quads {
    /// The time of such work in a picture of this size, on the configuration's GPU without GauRast.
    pub fn of(fragments: &Fragments, size: [u32; 2], config: &Config) -> Self {
        let Fragments { shaded, blended, gaussians } = *fragments;
        let screen = f64::from(size[0]) * f64::from(size[1]);
        let mut work = FRAGMENT.times(shaded).plus(&VERTEX.times(4.0 * gaussians));
        work.bytes = INSTANCE_BYTES * gaussians + PIXEL_BYTES * screen;
        let roofline = shader_cores::roofline(&work, &config.shader, &config.memory);
        let cycles_per_ms = config.shader.clock_ghz * 1e6;
        Self {
            fragments: shaded,
            shade_ms: roofline.compute_ms,
            setup_ms: 2.0 * gaussians / SETUPS_PER_CYCLE / cycles_per_ms,
            blend_ms: blended / BLENDS_PER_CYCLE / cycles_per_ms,
            memory_ms: roofline.memory_ms,
        }
    }

    /// Milliseconds of the whole: the units work in parallel, and the slowest of them decides.
    pub fn milliseconds(&self) -> f64 {
        [self.shade_ms, self.setup_ms, self.blend_ms, self.memory_ms].into_iter().fold(0.0, f64::max)
    }

    /// The name of the slowest unit.
    pub fn limit(&self) -> &'static str {
        let units = [
            ("shading", self.shade_ms),
            ("setup", self.setup_ms),
            ("blending", self.blend_ms),
            ("main memory", self.memory_ms),
        ];
        let slowest = units.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
        slowest.map_or("", |(name, _)| name)
    }
}

/// The pixels of the 4x4 blocks that a draw's Gaussians reach, if no finished pixel is skipped. The rests of lists,
/// beyond the last run, are taken to reach as many blocks as their beginnings.
fn pixels(draw: &DrawWork) -> f64 {
    let tile = |tile: &timing::work::TileWork| {
        let runs = tile.runs.iter();
        let reached: u64 = runs.map(|run| u64::from(run.reached) + u64::from(run.hidden_blocks)).sum();
        let listed = f64::from(tile.listed) / f64::from(tile.needed().max(1));
        reached as f64 * listed * f64::from(TILE_PIXELS / TILE_GROUPS)
    };
    draw.tiles.iter().map(tile).sum()
}

/// Stage 3 of a frame's Gaussians, drawn as quads on the configuration's GPU without GauRast.
pub fn quads(frame: &FrameWork, config: &Config) -> Quads {
    let draws = || frame.draws.iter().filter(|draw| draw.mode == Mode::Gaussian);
    let fragments = draws().map(pixels).sum::<f64>() * RECTANGLE;
    let gaussians = draws().map(|draw| draw.drawn as f64).sum::<f64>();
    Quads::of(&Fragments { shaded: fragments, blended: fragments, gaussians }, frame.size, config)
}

/// A published number of another way to draw Gaussians.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Published {
    /// Its name.
    pub name: &'static str,
    /// The number.
    pub number: &'static str,
    /// The scenes; or a note that the abstract doesn't name them.
    pub scenes: &'static str,
    /// Resolution of the pictures.
    pub resolution: &'static str,
    /// The baseline of the comparison.
    pub baseline: &'static str,
    /// The source of the number.
    pub source: &'static str,
}

const GSCORE: Published = Published {
    name: "GSCore, mean speed-up",
    number: "15.86x",
    scenes: "synthetic and real-world, not named in the abstract",
    resolution: "varying, not named in the abstract",
    baseline: "a mobile consumer GPU",
    source: "GSCore's abstract, ASPLOS 2024 (doi 10.1145/3620666.3651385)",
};

/// Published numbers, each with its conditions. What was read of the papers is the abstract. None of them is an input of
/// the model.
pub const PUBLISHED: [Published; 8] = [
    GSCORE,
    Published {
        name: "GBU, speed-up of its row-by-row order on the GPU alone",
        number: "1.72x",
        scenes: "real-world static scenes, not named in the abstract",
        resolution: "not named in the abstract",
        baseline: "Jetson Orin NX, 7-17 FPS",
        source: "GBU's abstract, HPCA 2025 (arXiv 2503.23625)",
    },
    Published {
        name: "StreamingGS, speed-up, at most",
        number: "45.7x",
        scenes: "not named in the abstract",
        resolution: "not named in the abstract",
        baseline: "a mobile Ampere GPU; 3DGS has 2-9 FPS there (the introduction names Orin NX)",
        source: "StreamingGS's abstract and introduction, DAC 2025 (arXiv 2506.09070)",
    },
    Published {
        name: "StreamingGS, energy, at most",
        number: "62.9x",
        scenes: "not named in the abstract",
        resolution: "not named in the abstract",
        baseline: "the same",
        source: "the same",
    },
    Published {
        name: "VR-Pipe, speed-up, at most",
        number: "2.78x",
        scenes: "synthetic and real-world, not named in the abstract",
        resolution: "not named in the abstract",
        baseline: "the conventional graphics pipeline",
        source: "VR-Pipe's abstract, HPCA 2025 (arXiv 2502.17078)",
    },
    Published {
        name: "Neo, throughput over an edge GPU, at most",
        number: "10.0x",
        scenes: "not named in the abstract",
        resolution: "not named in the abstract",
        baseline: "an edge GPU",
        source: "Neo's abstract (arXiv 2511.12930)",
    },
    Published {
        name: "Neo, throughput over another accelerator, at most",
        number: "5.6x",
        scenes: "not named in the abstract",
        resolution: "not named in the abstract",
        baseline: "the state-of-the-art ASIC, not named in the abstract",
        source: "the same",
    },
    Published {
        name: "Neo, DRAM traffic less than an edge GPU",
        number: "94.5 %",
        scenes: "not named in the abstract",
        resolution: "not named in the abstract",
        baseline: "an edge GPU",
        source: "the same",
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use timing::simulate::even_frame;

    #[test]
    fn quads_are_never_spared() {
        let config = Config::preset("orin-nx-10w", &[]).unwrap();
        let mut frame = even_frame([320, 320], 400_000, 0.2);
        frame.draws[0].drawn = 100_000;
        let all = quads(&frame, &config);
        assert!((all.fragments / (400_000.0 * 256.0 * RECTANGLE) - 1.0).abs() < 1e-9);
        // Half of the list was evaluated; quads draw all of it.
        for tile in &mut frame.draws[0].tiles {
            tile.runs[0].primitives /= 2;
            tile.runs[0].reached /= 2;
        }
        let same = quads(&frame, &config);
        assert!((same.fragments / all.fragments - 1.0).abs() < 0.01);
        assert!(all.milliseconds() >= all.blend_ms && all.blend_ms > 0.0);
        assert_eq!(all.limit() == "blending", all.blend_ms >= all.shade_ms);
    }

    #[test]
    fn a_number_has_a_source_and_what_it_is_held_against() {
        for row in PUBLISHED {
            let parts = [row.number, row.source, row.baseline];
            assert!(parts.iter().all(|part| !part.is_empty()), "{}", row.name);
        }
    }
}
