//! Phase 2 of the tile kernel: Gaussians through the pixels of a block, which stay in registers.

use super::approximation::power;
use super::grid::{BLOCK_X, BLOCK_Y, LANE_X, LANE_X_64, LANE_Y, LANE_Y_64};
use super::layer::Layer;
use super::passing::Passing;
use super::{
    BLOCKS, CHUNK, DepthMode, FIND_MEAN, FIND_MEDIAN, FIND_REACHED, LANES, NO_DEPTH, Record, Task,
    Thresholds,
};
use crate::gaussian::splat::Splat;
use crate::lanes::{bits_of, floats_of};
use fearless_simd::{Simd, f32x16, f64x8, i32x16, prelude::*, u32x16};

/// The sign bit of a binary32 number.
const SIGN: u32 = 1 << 31;

/// Which of a chunk's Gaussians may reach each block: a bit for each.
pub(super) type Reaching = [u32; BLOCKS];

/// What a block's pixels have accumulated.
///
/// Nothing here is indexed or iterated over, or it would leave the registers.
struct Pixels<S: Simd> {
    red: f32x16<S>,
    green: f32x16<S>,
    blue: f32x16<S>,
    transmittance: f32x16<S>,
    /// How many Gaussians each accepted.
    accepted: i32x16<S>,
}

impl Layer {
    /// Composites those of `chunk` that reach a block in it, for each block; returns how many pixels accepted one.
    #[inline(always)]
    pub(super) fn evaluate<S: Simd, const DEPTH: DepthMode>(
        &mut self,
        simd: S,
        reaching: &Reaching,
        chunk: &[Record; CHUNK],
        passing: &Passing,
        thresholds: Thresholds,
    ) -> u64 {
        let mut contributions = i32x16::splat(simd, 0);
        for (block, &reaching) in reaching.iter().enumerate() {
            if reaching == 0 {
                continue;
            }
            let mut pixels = self.pixels(simd, block);
            let mut rest = reaching;
            while rest != 0 {
                let g = &chunk[rest.trailing_zeros() as usize % CHUNK];
                rest &= rest - 1;
                let (fall, look) = (g.falls(simd, block), (g.color, g.depth));
                let at = (block, &mut pixels);
                self.composite::<_, DEPTH>(simd, at, fall, look, passing, thresholds);
            }
            contributions += pixels.accepted;
            self.keep(block, pixels);
        }
        sum(&contributions.to_array())
    }

    /// As [`Layer::evaluate`], of one steep Gaussian in `blocks`: exponents are formed in binary64.
    #[inline(always)]
    pub(super) fn evaluate_steep<S: Simd, const DEPTH: DepthMode>(
        &mut self,
        simd: S,
        splat: &Splat,
        blocks: u64,
        passing: &Passing,
        task: &Task<'_>,
    ) -> u64 {
        let mut contributions = 0;
        for block in (0..BLOCKS).filter(|block| blocks >> block & 1 == 1) {
            let fall = falls_64(simd, splat, task, block);
            let look = (splat.color, splat.depth);
            contributions +=
                self.accumulate::<_, DEPTH>(simd, block, fall, look, passing, task.thresholds);
        }
        contributions
    }

    /// Composites a Gaussian of a colour and a depth in a block, where alpha is 2 to the power of `-fall`; returns
    /// how many pixels accepted it.
    #[inline(always)]
    pub(super) fn accumulate<S: Simd, const DEPTH: DepthMode>(
        &mut self,
        simd: S,
        block: usize,
        fall: f32x16<S>,
        look: ([f32; 3], u32),
        passing: &Passing,
        thresholds: Thresholds,
    ) -> u64 {
        let mut pixels = self.pixels(simd, block);
        let at = (block, &mut pixels);
        self.composite::<_, DEPTH>(simd, at, fall, look, passing, thresholds);
        let accepted = pixels.accepted.to_array();
        self.keep(block, pixels);
        sum(&accepted)
    }

    /// A block's pixels as they are, before any of a chunk.
    #[inline(always)]
    fn pixels<S: Simd>(&self, simd: S, block: usize) -> Pixels<S> {
        let [r, g, b] = &self.color;
        Pixels {
            red: f32x16::from_slice(simd, &r[block]),
            green: f32x16::from_slice(simd, &g[block]),
            blue: f32x16::from_slice(simd, &b[block]),
            transmittance: f32x16::from_slice(simd, &self.transmittance[block]),
            accepted: i32x16::splat(simd, 0),
        }
    }

    /// Puts a block's pixels back.
    #[inline(always)]
    fn keep<S: Simd>(&mut self, block: usize, pixels: Pixels<S>) {
        let [r, g, b] = &mut self.color;
        pixels.red.store_slice(&mut r[block]);
        pixels.green.store_slice(&mut g[block]);
        pixels.blue.store_slice(&mut b[block]);
        pixels
            .transmittance
            .store_slice(&mut self.transmittance[block]);
        // No alpha is so small that it leaves a transmittance what it was: low floors are for wider sums.
        let seen = pixels.transmittance.abs().simd_lt(1.0);
        self.covered[block] |= seen.to_bitmask() as u32;
    }

    /// Composites a Gaussian of a colour and a depth in a block, where alpha is 2 to the power of `-fall`.
    ///
    /// What does not reach a pixel is composited with an alpha of zero, which changes nothing: to leave it out would take
    /// longer.
    #[inline(always)]
    fn composite<S: Simd, const DEPTH: DepthMode>(
        &mut self,
        simd: S,
        (block, pixels): (usize, &mut Pixels<S>),
        fall: f32x16<S>,
        (color, depth): ([f32; 3], u32),
        passing: &Passing,
        thresholds: Thresholds,
    ) {
        let mut reached = fall.simd_le(f32x16::splat(simd, thresholds.most_fall));
        let t = pixels.transmittance;
        let finished = floats_of(bits_of(t) | SIGN);
        if DEPTH == FIND_REACHED {
            pixels.transmittance = reached.select(finished, t);
            return;
        }
        if DEPTH > NO_DEPTH {
            reached &= passing.pixels(simd, block, depth);
        }
        let ceiling = f32x16::splat(simd, thresholds.alpha_ceiling);
        let nothing = f32x16::splat(simd, thresholds.nothing);
        // Where alpha has fallen too far, the power means nothing.
        let alpha = power::<_, DEPTH>(simd, fall).min(ceiling);
        let weight = t * reached.select(alpha, nothing);
        let rest = t - weight;
        // A finished pixel's transmittance is negative, and what is left of it fails like one below the floor.
        let goes_on = rest.simd_ge(f32x16::splat(simd, thresholds.transmittance_floor));
        let accepted = reached & goes_on;
        if DEPTH >= FIND_MEDIAN {
            let median = u32x16::from_slice(simd, &self.median[block]);
            let first_half = accepted & t.simd_ge(0.5);
            let median = first_half.select(u32x16::splat(simd, depth), median);
            median.store_slice(&mut self.median[block]);
        }
        pixels.transmittance = goes_on.select(rest, finished);
        let weight = goes_on.select(weight, nothing);
        if DEPTH == FIND_MEAN {
            let depth = f32x16::splat(simd, thresholds.depth_unit.decode(depth));
            let [depths, weights] = &mut self.means;
            let sum = f32x16::from_slice(simd, &depths[block]);
            weight.mul_add(depth, sum).store_slice(&mut depths[block]);
            let sum = f32x16::from_slice(simd, &weights[block]) + weight;
            sum.store_slice(&mut weights[block]);
        }
        let [red, green, blue] = color;
        pixels.red = weight.mul_add(f32x16::splat(simd, red), pixels.red);
        pixels.green = weight.mul_add(f32x16::splat(simd, green), pixels.green);
        pixels.blue = weight.mul_add(f32x16::splat(simd, blue), pixels.blue);
        pixels.accepted -= i32x16::simd_from(simd, <[i32; LANES]>::from(accepted));
    }
}

/// The sum of counts.
fn sum(counts: &[i32; LANES]) -> u64 {
    counts
        .iter()
        .map(|&count| u64::from(count.unsigned_abs()))
        .sum()
}

impl Record {
    /// How far alpha has fallen at a block's pixels: minus its base-2 logarithm.
    #[inline(always)]
    fn falls<S: Simd>(&self, simd: S, block: usize) -> f32x16<S> {
        let across = f32x16::simd_from(simd, LANE_X);
        let down = f32x16::simd_from(simd, LANE_Y);
        let [a, b, c] = self.factor;
        let u = across.mul_add(f32x16::splat(simd, a), f32x16::splat(simd, self.u[block]));
        // Rows of a block share what columns add.
        let v = across.mul_add(f32x16::splat(simd, b), f32x16::splat(simd, self.v[block]));
        let v = down.mul_add(f32x16::splat(simd, c), v);
        let opacity = f32x16::splat(simd, self.log2_opacity);
        v.mul_add(v, u.mul_sub(u, opacity))
    }
}

/// How far a Gaussian's alpha has fallen at a block's pixels, formed in binary64: minus its base-2 logarithm, but no less
/// than -1, which is more than any ceiling, and still a power that is formed.
///
/// What is wider than the period of a panorama counts where it is nearer than its copies.
#[inline(always)]
pub(super) fn falls_64<S: Simd>(
    simd: S,
    splat: &Splat,
    task: &Task<'_>,
    block: usize,
) -> f32x16<S> {
    let [a, b, c] = splat.factor;
    let from_mean = |axis: usize| f64::from(task.corner[axis]) - splat.mean[axis];
    let opacity = f64x8::splat(simd, splat.log2_opacity.into());
    let half_period = if splat.wide {
        task.half_period
    } else {
        f64::INFINITY
    };
    let within = f64x8::splat(simd, half_period);
    let nothing = f64x8::splat(simd, 1e3);
    let middle = [BLOCK_X[block] + from_mean(0), BLOCK_Y[block] + from_mean(1)];
    let fall = |first: usize| {
        let dx = f64x8::from_slice(simd, &LANE_X_64[first..first + 8]) + middle[0];
        let dy = f64x8::from_slice(simd, &LANE_Y_64[first..first + 8]) + middle[1];
        let (u, v) = (dx * a, dx * b + dy * c);
        let fall = u * u + v * v - opacity;
        let inside = dx.simd_ge(-within) & dx.simd_lt(within);
        inside.select(fall, nothing)
    };
    let fall: f32x16<S> = fall(0).narrow(fall(8));
    fall.max(-1.0)
}
