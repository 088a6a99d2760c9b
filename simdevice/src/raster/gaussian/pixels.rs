//! Phases 2 and 3 of the tile kernel: the alphas of Gaussians in blocks, and those through the pixels of a block, which stay in
//! registers.

use super::approximation::power;
use super::grid::{BLOCK_X, BLOCK_Y, LANE_X_64, LANE_Y_64};
use super::layer::Layer;
use super::passing::Passing;
use super::{
    BLOCKS, CHUNK, DepthMode, FIND_MEAN, FIND_MEDIAN, FIND_REACHED, LANES, NO_DEPTH, Record, Task,
    Thresholds,
};
use crate::gaussian::splat::Splat;
use fearless_simd::{Simd, f32x8, f32x16, f64x8, i32x16, mask32x16, prelude::*, u32x16};

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

/// The alphas of a chunk's Gaussians in the blocks that they may reach, by block and then in the order of the list.
#[derive(Debug)]
#[repr(C, align(64))]
pub(super) struct Alphas {
    alphas: [[f32; LANES]; BLOCKS * CHUNK],
    /// Which of the chunk each is of.
    numbers: [u32; BLOCKS * CHUNK],
}

impl Default for Alphas {
    fn default() -> Self {
        Self {
            alphas: [[0.0; LANES]; BLOCKS * CHUNK],
            numbers: [0; BLOCKS * CHUNK],
        }
    }
}

impl Alphas {
    /// Finds the alphas of what is reached.
    ///
    /// They come before any is composited, since they do not depend on each other: several are on their way at a time. A
    /// function of its own, so that its constants have the registers for themselves.
    #[inline(never)]
    fn find<S: Simd, const DEPTH: DepthMode>(
        &mut self,
        simd: S,
        reaching: &Reaching,
        chunk: &[Record; CHUNK],
        passing: &Passing,
        thresholds: Thresholds,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                let limits = Limits::new(simd, thresholds);
                let mut items = self.alphas.iter_mut().zip(&mut self.numbers);
                // Two blocks at a time, so that half as many loops end where nobody can foresee it.
                for (pair, words) in reaching.as_chunks::<2>().0.iter().enumerate() {
                    let mut rest = u64::from(words[0]) | u64::from(words[1]) << CHUNK;
                    while rest != 0 {
                        let bit = rest.trailing_zeros() as usize;
                        rest &= rest - 1;
                        let (block, number) = (2 * pair + bit / CHUNK, bit % CHUNK);
                        let g = &chunk[number];
                        let fall = g.falls(simd, block % BLOCKS);
                        let found = alpha::<_, DEPTH>(simd, block, fall, g.depth, passing, limits);
                        if let Some((alpha, to)) = items.next() {
                            found.store_slice(alpha);
                            *to = number as u32;
                        }
                    }
                }
            },
        );
    }
}

/// What bounds alphas, in all lanes.
#[derive(Clone, Copy)]
struct Limits<S: Simd> {
    most_fall: f32x16<S>,
    ceiling: f32x16<S>,
}

impl<S: Simd> Limits<S> {
    #[inline(always)]
    fn new(simd: S, thresholds: Thresholds) -> Self {
        Self {
            most_fall: f32x16::splat(simd, thresholds.most_fall),
            ceiling: f32x16::splat(simd, thresholds.alpha_ceiling),
        }
    }
}

/// The alphas of a block's pixels where they have fallen so far; zero where that is too far, or the depth doesn't pass.
#[inline(always)]
fn alpha<S: Simd, const DEPTH: DepthMode>(
    simd: S,
    block: usize,
    fall: f32x16<S>,
    depth: u32,
    passing: &Passing,
    limits: Limits<S>,
) -> f32x16<S> {
    let mut reached = fall.simd_le(limits.most_fall);
    if DEPTH > NO_DEPTH {
        reached &= passing.pixels(simd, block, depth);
    }
    // Where alpha has fallen too far, the power means nothing.
    only(reached, power::<_, DEPTH>(simd, fall).min(limits.ceiling))
}

/// The floats in the lanes of a mask, and zero in the others.
#[inline(always)]
fn only<S: Simd>(mask: mask32x16<S>, floats: f32x16<S>) -> f32x16<S> {
    (floats.bitcast::<i32x16<S>>() & mask.to_vector()).bitcast()
}

impl Layer {
    /// Composites those of `chunk` that reach a block in it, for each block; returns how many pixels accepted one.
    #[inline(always)]
    pub(super) fn evaluate<S: Simd, const DEPTH: DepthMode>(
        &mut self,
        simd: S,
        reaching: &Reaching,
        (chunk, alphas): (&[Record; CHUNK], &mut Alphas),
        passing: &Passing,
        thresholds: Thresholds,
    ) -> u64 {
        alphas.find::<_, DEPTH>(simd, reaching, chunk, passing, thresholds);
        self.composite_all::<_, DEPTH>(simd, reaching, (chunk, alphas), thresholds)
    }

    /// Composites the alphas of a chunk; returns how many pixels accepted one. A function of its own, as [`Alphas::find`].
    #[inline(never)]
    fn composite_all<S: Simd, const DEPTH: DepthMode>(
        &mut self,
        simd: S,
        reaching: &Reaching,
        (chunk, alphas): (&[Record; CHUNK], &Alphas),
        thresholds: Thresholds,
    ) -> u64 {
        simd.vectorize(
            #[inline(always)]
            || {
                let mut contributions = i32x16::splat(simd, 0);
                let mut items = alphas.alphas.iter().zip(&alphas.numbers);
                for (block, &reaching) in reaching.iter().enumerate() {
                    if reaching == 0 {
                        continue;
                    }
                    let mut pixels = self.pixels(simd, block);
                    for _ in 0..reaching.count_ones() {
                        let Some((alpha, &number)) = items.next() else {
                            break;
                        };
                        let g = &chunk[number as usize % CHUNK];
                        let alpha = f32x16::from_slice(simd, alpha);
                        let (to, look) = ((block, &mut pixels), (g.color, g.depth));
                        self.composite::<_, DEPTH>(simd, to, alpha, look, thresholds);
                    }
                    contributions += pixels.accepted;
                    self.keep(block, pixels);
                }
                sum(&contributions.to_array())
            },
        )
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
        let limits = Limits::new(simd, thresholds);
        let alpha = alpha::<_, DEPTH>(simd, block, fall, look.1, passing, limits);
        let at = (block, &mut pixels);
        self.composite::<_, DEPTH>(simd, at, alpha, look, thresholds);
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
    }

    /// Composites a Gaussian of a colour and a depth in a block.
    ///
    /// What does not reach a pixel is composited with an alpha of zero, which changes nothing: to leave it out would take
    /// longer.
    #[inline(always)]
    fn composite<S: Simd, const DEPTH: DepthMode>(
        &mut self,
        simd: S,
        (block, pixels): (usize, &mut Pixels<S>),
        alpha: f32x16<S>,
        (color, depth): ([f32; 3], u32),
        thresholds: Thresholds,
    ) {
        let t = pixels.transmittance;
        let finished = -t.abs();
        if DEPTH == FIND_REACHED {
            pixels.transmittance = alpha.simd_gt(0.0).select(finished, t);
            return;
        }
        let weight = t * alpha;
        let rest = t - weight;
        // A finished pixel's transmittance is negative, and what is left of it fails like one below the floor.
        let goes_on = rest.simd_ge(f32x16::splat(simd, thresholds.transmittance_floor));
        pixels.transmittance = goes_on.select(rest, finished);
        let weight = only(goes_on, weight);
        let accepted = weight.simd_gt(0.0);
        if DEPTH >= FIND_MEDIAN {
            let median = u32x16::from_slice(simd, &self.median[block]);
            let first_half = accepted & t.simd_ge(0.5);
            let median = first_half.select(u32x16::splat(simd, depth), median);
            median.store_slice(&mut self.median[block]);
        }
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
        pixels.accepted -= accepted.to_vector();
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
        // Rows of a block share what columns add.
        let u = f32x8::from_slice(simd, &self.across) + self.u[block];
        let v = f32x16::from_slice(simd, &self.along) + self.v[block];
        let from_u = u.mul_sub(u, f32x8::splat(simd, self.log2_opacity));
        v.mul_add(v, from_u.combine(from_u))
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
