//! The work of stages 1 and 2 of a Gaussian draw on shader cores: operations per Gaussian and per pair, counted from
//! the steps of the usual implementation (3DGS's CUDA code: one thread per Gaussian, a radix sort of 64-bit keys). The
//! counts are this project's; the paper gives no times of stages 1 and 2.

use crate::work::ShaderWork;

/// Work for every Gaussian that is read: the transform to camera space and the near plane's test. 12 bytes of position.
const CULL: ShaderWork =
    ShaderWork { float: 16.0, integer: 8.0, special: 0.0, wide: 0.0, memory: 3.0, image: 0.0, other: 0.0, bytes: 12.0 };

/// Work for every Gaussian that passes: normalised quaternion and rotation (34), J W R S (60), its product with its
/// transpose (18), determinant, conic, radius and rectangle (40); reads 32 bytes of scale, rotation and opacity, writes
/// 48.
const PROJECT: ShaderWork = ShaderWork {
    float: 152.0,
    integer: 20.0,
    special: 6.0,
    wide: 0.0,
    memory: 20.0,
    image: 0.0,
    other: 0.0,
    bytes: 80.0,
};

/// Work for every Gaussian that a vertex program projected and that passes: only determinant, conic, radius and
/// rectangle; writes 48 bytes.
const FOOTPRINT: ShaderWork = ShaderWork {
    float: 40.0,
    integer: 20.0,
    special: 2.0,
    wide: 0.0,
    memory: 12.0,
    image: 0.0,
    other: 0.0,
    bytes: 48.0,
};

/// Work for every Gaussian that is drawn: the view direction and the spherical harmonics basis.
const DIRECTION: ShaderWork =
    ShaderWork { float: 45.0, integer: 4.0, special: 2.0, wide: 0.0, memory: 3.0, image: 0.0, other: 0.0, bytes: 0.0 };

/// Work for every spherical harmonics coefficient of three colours.
const COEFFICIENT: ShaderWork =
    ShaderWork { float: 3.0, integer: 0.0, special: 0.0, wide: 0.0, memory: 3.0, image: 0.0, other: 0.0, bytes: 12.0 };

/// Work for every pair: its key and value, 12 bytes; finding the tiles' ranges reads the key again.
const EMIT: ShaderWork =
    ShaderWork { float: 0.0, integer: 14.0, special: 0.0, wide: 0.0, memory: 4.0, image: 0.0, other: 0.0, bytes: 20.0 };

/// Work for every pair and pass of the sort: reads and writes 12 bytes.
const SORT_PASS: ShaderWork =
    ShaderWork { float: 0.0, integer: 24.0, special: 0.0, wide: 0.0, memory: 4.0, image: 0.0, other: 0.0, bytes: 24.0 };

/// Bits of the key that a pass sorts by.
const DIGIT_BITS: u32 = 8;

/// The counts of a draw of Gaussians that decide the work of its stages 1 and 2.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GaussianCounts {
    /// Gaussians that the draw named and the device projects.
    pub read: u64,
    /// The Gaussians of `read` that are beyond the near plane and not too faint.
    pub projected: u64,
    /// The Gaussians of `projected` that reach a tile.
    pub drawn: u64,
    /// Gaussians that a vertex program projected and that are beyond the near plane and not too faint. The work of the
    /// program itself is not derived from these counts.
    pub shaded: u64,
    /// Degree of the spherical harmonics.
    pub degree: u32,
    /// Pairs of a tile and a Gaussian.
    pub pairs: u64,
    /// Tiles of the picture.
    pub tiles: u64,
}

/// The work of stages 1 and 2 of a draw.
pub fn gaussian(counts: &GaussianCounts) -> [ShaderWork; 2] {
    let coefficients = f64::from((counts.degree + 1).pow(2));
    let preprocess = CULL
        .times(counts.read as f64)
        .plus(&PROJECT.times(counts.projected as f64))
        .plus(&FOOTPRINT.times(counts.shaded as f64))
        .plus(&DIRECTION.plus(&COEFFICIENT.times(coefficients)).times(counts.drawn as f64));
    // 32 bits of depth in the key below the tile's number.
    let bits = 32 + u64::BITS - counts.tiles.saturating_sub(1).leading_zeros();
    let passes = f64::from(bits.div_ceil(DIGIT_BITS));
    let sort = EMIT.plus(&SORT_PASS.times(passes)).times(counts.pairs as f64);
    [preprocess, sort]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_grows_with_what_there_is() {
        let counts = GaussianCounts { read: 10, projected: 8, drawn: 5, shaded: 0, degree: 3, pairs: 20, tiles: 3600 };
        let [one, two] = gaussian(&counts);
        assert!((one.bytes - (10.0 * 12.0 + 8.0 * 80.0 + 5.0 * 192.0)).abs() < 1e-9);
        // 12 bits of tile number: 44 bits, 6 passes.
        assert!((two.bytes - 20.0 * (20.0 + 6.0 * 24.0)).abs() < 1e-9);
        let [flat, _] = gaussian(&GaussianCounts { degree: 0, ..counts });
        assert!(flat.float < one.float);
        let [more, _] = gaussian(&GaussianCounts { shaded: 7, ..counts });
        assert!((more.bytes - one.bytes - 7.0 * 48.0).abs() < 1e-9);
    }
}
