//! Phases 2 and 3 of the tile kernel: the alphas of Gaussians in blocks, and those through the pixels of a block, which
//! stay in registers.

use super::accumulator::Accumulator;
use super::depth_ranges::DepthRanges;
use super::grid::{BLOCK_PIXELS, BLOCK_X, BLOCK_Y, BLOCKS, LANE_X_64, LANE_Y_64, ROUND};
use super::inputs::{DepthMode, FIND_MEAN, FIND_MEDIAN, FIND_REACHED, NO_DEPTH, Thresholds, TileInputs, power};
use super::masks::{Tally, only};
use super::staging::{Reaching, StagedRound};
use crate::gaussian::splat::{Splat, SplatLook};
use crate::simd::bits_of;
use fearless_simd::{Simd, f32x16, f64x8, i32x16, mask32x16, prelude::*, u32x16};

/// The sums of a block's pixels.
///
/// Nothing here is indexed or iterated over, or it would leave the registers.
#[derive(Clone, Copy)]
struct Pixels<S: Simd> {
    red: f32x16<S>,
    green: f32x16<S>,
    blue: f32x16<S>,
    transmittance: f32x16<S>,
}

/// A Gaussian's effect on a block's pixels.
struct Passed<S: Simd> {
    /// Its contribution.
    weight: f32x16<S>,
    /// The transmittance behind it.
    rest: f32x16<S>,
}

/// No pixel of more transmittance than this, in units of the floor, is looked out for while a round's Gaussians are
/// composited: it is seldom finished by one round, and where it is, that round is composited again.
const FAR_FROM_FLOOR: f32 = 8.0;

/// The alphas of a round's Gaussians in the blocks that they may reach, by block and then in the order of the list.
#[derive(Debug)]
#[repr(C, align(64))]
pub(super) struct Alphas {
    alphas: [[f32; BLOCK_PIXELS]; BLOCKS * ROUND],
}

impl Default for Alphas {
    fn default() -> Self {
        Self { alphas: [[0.0; BLOCK_PIXELS]; BLOCKS * ROUND] }
    }
}

impl Alphas {
    /// Finds the alphas of all Gaussians in the blocks that they may reach. Returns the number of pixels that they
    /// reach, of those that are not finished, and the number of pairs of a Gaussian and a block. Without `IS_CAPPED`,
    /// alphas are not compared with the ceiling, which none may reach then.
    ///
    /// They come before any is composited, since they do not depend on each other: several are on their way at a time.
    /// A function of its own, so that its constants have the registers for themselves.
    #[inline(never)]
    fn find<S: Simd, const DEPTH: DepthMode, const IS_CAPPED: bool>(
        &mut self,
        simd: S,
        reaching: &Reaching,
        (round, most_fall): (&StagedRound, &[[f32; BLOCK_PIXELS]; BLOCKS]),
        ranges: &DepthRanges,
        thresholds: Thresholds,
    ) -> (u64, u64) {
        simd.vectorize(
            #[inline(always)]
            || {
                let ceiling = f32x16::splat(simd, thresholds.alpha_ceiling);
                let mut pixels = Tally::new(simd);
                let mut items = &mut self.alphas[..];
                let mut count_of_all = 0;
                for (block, &reaching) in reaching.iter().enumerate() {
                    let count = reaching.count_ones() as usize;
                    let Some((alphas, others)) = items.split_at_mut_checked(count) else {
                        break;
                    };
                    items = others;
                    count_of_all += count as u64;
                    let Some(column) = round.column(block) else {
                        break;
                    };
                    let most_fall = f32x16::from_slice(simd, &most_fall[block]);
                    let mut rest = reaching;
                    for to in alphas {
                        let number = rest.trailing_zeros() as usize;
                        rest &= rest.wrapping_sub(1);
                        let fall = round.falls(simd, number, (block, column));
                        let at = (block, round.looks[number].depth);
                        let reached = reached(simd, DEPTH, at, fall, ranges, most_fall);
                        pixels.add(reached);
                        let power = power(simd, DEPTH, fall);
                        let alpha = if IS_CAPPED { power.min(ceiling) } else { power };
                        only(simd, reached, alpha).store_slice(to);
                    }
                }
                (pixels.total(), count_of_all)
            },
        )
    }
}

/// The pixels of a block where alpha has fallen no further than it may, and the depth passes.
#[inline(always)]
fn reached<S: Simd>(
    simd: S,
    mode: DepthMode,
    (block, depth): (usize, u32),
    fall: f32x16<S>,
    ranges: &DepthRanges,
    most_fall: f32x16<S>,
) -> mask32x16<S> {
    let reached = fall.simd_le(most_fall);
    if mode > NO_DEPTH { reached & ranges.pixels(simd, block, depth) } else { reached }
}

/// The alphas of pixels where they have fallen so far; zero where nothing is reached: too far down, powers mean
/// nothing.
#[inline(always)]
fn alpha<S: Simd>(simd: S, mode: DepthMode, reached: mask32x16<S>, fall: f32x16<S>, ceiling: f32x16<S>) -> f32x16<S> {
    only(simd, reached, power(simd, mode, fall).min(ceiling))
}

/// The account of a round's composition.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Evaluated {
    /// Pairs of a Gaussian and a block whose pixels were evaluated.
    pub(super) items: u64,
    /// Pairs of a Gaussian and a pixel that accepted it.
    pub(super) contributions: u64,
    /// True if pixels may have been finished.
    pub(super) may_have_finished: bool,
}

/// Composites those of `round` that reach a block in it, for each block. Unless `is_capped`, no opacity is above the
/// ceiling.
#[inline(always)]
pub(super) fn evaluate<S: Simd, const DEPTH: DepthMode>(
    accumulator: &mut Accumulator,
    simd: S,
    (reaching, is_capped): (&Reaching, bool),
    (round, alphas): (&StagedRound, &mut Alphas),
    ranges: &DepthRanges,
    thresholds: Thresholds,
) -> Evaluated {
    let to = (round, &accumulator.most_fall);
    // Opacities are seldom above the ceiling. Less exact powers may be, whatever the opacity.
    let (reached, items) = if DEPTH < NO_DEPTH || is_capped {
        alphas.find::<_, DEPTH, true>(simd, reaching, to, ranges, thresholds)
    } else {
        alphas.find::<_, DEPTH, false>(simd, reaching, to, ranges, thresholds)
    };
    let refused = composite_all::<_, DEPTH>(accumulator, simd, reaching, (round, alphas), thresholds);
    Evaluated {
        items,
        contributions: reached.saturating_sub(refused.unwrap_or(0)),
        may_have_finished: refused.is_some(),
    }
}

/// Composites the alphas of a round; returns how many pixels refused one, since they are finished, or `None` if no
/// pixel was finished in the round. A function of its own, as [`Alphas::find`].
#[inline(never)]
fn composite_all<S: Simd, const DEPTH: DepthMode>(
    accumulator: &mut Accumulator,
    simd: S,
    reaching: &Reaching,
    (round, alphas): (&StagedRound, &Alphas),
    thresholds: Thresholds,
) -> Option<u64> {
    simd.vectorize(
        #[inline(always)]
        || {
            let mut refused = None;
            let mut rest = &alphas.alphas[..];
            for (block, &reaching) in reaching.iter().enumerate() {
                let count = reaching.count_ones() as usize;
                let Some((alphas, others)) = rest.split_at_checked(count) else {
                    break;
                };
                rest = others;
                if reaching == 0 {
                    continue;
                }
                let of_block = (block, reaching, alphas);
                if DEPTH == FIND_REACHED
                    || DEPTH >= FIND_MEDIAN
                    || !composite_far_from_floor(accumulator, simd, of_block, round, thresholds)
                {
                    let more = composite_near_floor::<_, DEPTH>(accumulator, simd, of_block, round, thresholds);
                    if let Some(more) = more {
                        refused = Some(refused.unwrap_or(0) + more);
                    }
                }
            }
            refused
        },
    )
}

/// Composites a block's alphas, if no pixel comes so near the floor that it is finished; else it changes nothing.
/// Returns whether it did.
#[inline(always)]
fn composite_far_from_floor<S: Simd>(
    accumulator: &mut Accumulator,
    simd: S,
    (block, mut reaching, alphas): (usize, u32, &[[f32; BLOCK_PIXELS]]),
    round: &StagedRound,
    thresholds: Thresholds,
) -> bool {
    let floor = thresholds.transmittance_floor;
    let mut pixels = pixels(accumulator, simd, block);
    let before = pixels.transmittance;
    // As whole numbers, transmittances are in the order of what they stand for, and greater than all where a pixel is
    // finished. (Masks are not combined here: that would be calls, before which the pixels leave their registers.)
    let near = f32x16::splat(simd, FAR_FROM_FLOOR * floor);
    if bits_of(before).simd_lt(bits_of(near)).any_true() {
        return false;
    }
    // What is finished has alphas of zero.
    pixels.transmittance = before.max(0.0);
    for alpha in alphas {
        let look = &round.looks[reaching.trailing_zeros() as usize];
        reaching &= reaching.wrapping_sub(1);
        let passed = pixels.pass(f32x16::from_slice(simd, alpha));
        pixels.transmittance = passed.rest;
        pixels.add(simd, passed.weight, look.color);
    }
    let signs: i32x16<S> = before.bitcast();
    let below = pixels.transmittance.simd_lt(floor).to_vector();
    // What is finished has a sign, and is none of those.
    if (below & (signs ^ -1)).simd_lt(0).any_true() {
        return false;
    }
    pixels.transmittance = signs.simd_lt(0).select(before, pixels.transmittance);
    keep(accumulator, block, pixels);
    true
}

/// Composites a block's alphas; returns how many pixels refused one, or `None` if no pixel was finished. A function of
/// its own, so that what goes the quick way has the registers for itself.
#[inline(never)]
fn composite_near_floor<S: Simd, const DEPTH: DepthMode>(
    accumulator: &mut Accumulator,
    simd: S,
    (block, reaching, alphas): (usize, u32, &[[f32; BLOCK_PIXELS]]),
    round: &StagedRound,
    thresholds: Thresholds,
) -> Option<u64> {
    simd.vectorize(
        #[inline(always)]
        || {
            let (mut reaching, mut alphas) = (reaching, alphas);
            if DEPTH != FIND_REACHED && DEPTH < FIND_MEDIAN {
                let of_block = (block, reaching, alphas);
                (reaching, alphas) = composite_until_finished(accumulator, simd, of_block, round, thresholds);
                if alphas.is_empty() {
                    return None;
                }
            }
            let of_block = (block, reaching, alphas);
            let refused = composite_carefully::<_, DEPTH>(accumulator, simd, of_block, round, thresholds);
            Some(refused)
        },
    )
}

/// Alphas of a block, in order, and bits for the numbers of their Gaussians.
type BlockAlphas<'a> = (u32, &'a [[f32; BLOCK_PIXELS]]);

/// Composites the first of a block's alphas, up to one that finishes a pixel, and returns the others.
#[inline(always)]
fn composite_until_finished<'a, S: Simd>(
    accumulator: &mut Accumulator,
    simd: S,
    (block, mut reaching, mut alphas): (usize, u32, &'a [[f32; BLOCK_PIXELS]]),
    round: &StagedRound,
    thresholds: Thresholds,
) -> BlockAlphas<'a> {
    let floor = f32x16::splat(simd, thresholds.transmittance_floor);
    let mut pixels = pixels(accumulator, simd, block);
    let before = pixels.transmittance;
    let signs: i32x16<S> = before.bitcast();
    // What is finished has alphas of zero: here it has light that stays.
    let light = f32x16::splat(simd, f32::MAX);
    pixels.transmittance = signs.simd_lt(0).select(light, before);
    while let [alpha, rest @ ..] = alphas {
        let passed = pixels.pass(f32x16::from_slice(simd, alpha));
        if passed.rest.simd_lt(floor).any_true() {
            break;
        }
        let look = &round.looks[reaching.trailing_zeros() as usize];
        reaching &= reaching.wrapping_sub(1);
        alphas = rest;
        pixels.transmittance = passed.rest;
        pixels.add(simd, passed.weight, look.color);
    }
    pixels.transmittance = signs.simd_lt(0).select(before, pixels.transmittance);
    keep(accumulator, block, pixels);
    (reaching, alphas)
}

/// Composites a block's alphas; returns the number of pixels that refused one.
#[inline(always)]
fn composite_carefully<S: Simd, const DEPTH: DepthMode>(
    accumulator: &mut Accumulator,
    simd: S,
    (block, mut reaching, alphas): (usize, u32, &[[f32; BLOCK_PIXELS]]),
    round: &StagedRound,
    thresholds: Thresholds,
) -> u64 {
    let thresholds = Thresholds { depth_mode: DEPTH, ..thresholds };
    let mut pixels = pixels(accumulator, simd, block);
    let mut refused = Tally::new(simd);
    for alpha in alphas {
        let look = &round.looks[reaching.trailing_zeros() as usize];
        reaching &= reaching.wrapping_sub(1);
        let alpha = f32x16::from_slice(simd, alpha);
        let to = (block, &mut pixels);
        let goes_on = composite_one(accumulator, simd, to, alpha, *look, thresholds);
        refused.add_without(alpha.simd_gt(0.0), goes_on);
    }
    keep(accumulator, block, pixels);
    accumulator.find_most_fall(simd, block, thresholds.most_fall);
    refused.total()
}

/// Composites one steep Gaussian in `blocks`, its exponents formed in binary64; returns the number of pixels that
/// accepted it.
#[inline(always)]
pub(super) fn evaluate_steep<S: Simd, const DEPTH: DepthMode>(
    accumulator: &mut Accumulator,
    simd: S,
    splat: &Splat,
    blocks: u64,
    ranges: &DepthRanges,
    task: &TileInputs<'_>,
) -> u64 {
    let thresholds = Thresholds { depth_mode: DEPTH, ..task.thresholds };
    let mut contributions = 0;
    for block in (0..BLOCKS).filter(|block| blocks >> block & 1 == 1) {
        let fall = falls_64(simd, splat, task, block);
        let look = splat.look;
        contributions += accumulate(accumulator, simd, block, fall, look, ranges, thresholds);
        accumulator.find_most_fall(simd, block, thresholds.most_fall);
    }
    contributions
}

/// Composites a Gaussian of a colour and a depth in a block, where alpha is 2 to the power of `-fall`; returns
/// how many pixels accepted it.
#[inline(always)]
pub(super) fn accumulate<S: Simd>(
    accumulator: &mut Accumulator,
    simd: S,
    block: usize,
    fall: f32x16<S>,
    look: SplatLook,
    ranges: &DepthRanges,
    thresholds: Thresholds,
) -> u64 {
    let mut pixels = pixels(accumulator, simd, block);
    let most_fall = f32x16::splat(simd, thresholds.most_fall);
    let mode = thresholds.depth_mode;
    let reached = reached(simd, mode, (block, look.depth), fall, ranges, most_fall);
    let ceiling = f32x16::splat(simd, thresholds.alpha_ceiling);
    let alpha = alpha(simd, mode, reached, fall, ceiling);
    let at = (block, &mut pixels);
    let goes_on = composite_one(accumulator, simd, at, alpha, look, thresholds);
    keep(accumulator, block, pixels);
    let accepted = goes_on.to_bitmask() & reached.to_bitmask();
    accepted.count_ones().into()
}

/// A block's pixels as they are, before any of a round.
#[inline(always)]
fn pixels<S: Simd>(accumulator: &Accumulator, simd: S, block: usize) -> Pixels<S> {
    let [r, g, b] = &accumulator.color;
    Pixels {
        red: f32x16::from_slice(simd, &r[block]),
        green: f32x16::from_slice(simd, &g[block]),
        blue: f32x16::from_slice(simd, &b[block]),
        transmittance: f32x16::from_slice(simd, &accumulator.transmittance[block]),
    }
}

/// Puts a block's pixels back.
#[inline(always)]
fn keep<S: Simd>(accumulator: &mut Accumulator, block: usize, pixels: Pixels<S>) {
    let [r, g, b] = &mut accumulator.color;
    pixels.red.store_slice(&mut r[block]);
    pixels.green.store_slice(&mut g[block]);
    pixels.blue.store_slice(&mut b[block]);
    pixels.transmittance.store_slice(&mut accumulator.transmittance[block]);
}

/// Composites a Gaussian of a colour and a depth in a block; returns which pixels it does not finish.
///
/// A Gaussian that does not reach a pixel is composited with an alpha of zero, which changes nothing: to leave it out
/// would take longer.
#[inline(always)]
fn composite_one<S: Simd>(
    accumulator: &mut Accumulator,
    simd: S,
    (block, pixels): (usize, &mut Pixels<S>),
    alpha: f32x16<S>,
    SplatLook { color, depth }: SplatLook,
    thresholds: Thresholds,
) -> mask32x16<S> {
    let t = pixels.transmittance;
    let finished = -t.abs();
    if thresholds.depth_mode == FIND_REACHED {
        let reached = alpha.simd_gt(0.0);
        pixels.transmittance = reached.select(finished, t);
        return !reached;
    }
    let Passed { weight, rest } = pixels.pass(alpha);
    // A finished pixel's transmittance is negative, and what is left of it fails like one below the floor.
    let goes_on = rest.simd_ge(f32x16::splat(simd, thresholds.transmittance_floor));
    pixels.transmittance = goes_on.select(rest, finished);
    let weight = only(simd, goes_on, weight);
    if thresholds.depth_mode >= FIND_MEDIAN {
        let median = u32x16::from_slice(simd, &accumulator.median[block]);
        let first_half = weight.simd_gt(0.0) & t.simd_ge(0.5);
        let median = first_half.select(u32x16::splat(simd, depth), median);
        median.store_slice(&mut accumulator.median[block]);
    }
    if thresholds.depth_mode == FIND_MEAN {
        let depth = f32x16::splat(simd, thresholds.depth_unit.decode(depth));
        let [depths, weights] = &mut accumulator.means;
        let sum = f32x16::from_slice(simd, &depths[block]);
        weight.mul_add(depth, sum).store_slice(&mut depths[block]);
        let sum = f32x16::from_slice(simd, &weights[block]) + weight;
        sum.store_slice(&mut weights[block]);
    }
    pixels.add(simd, weight, color);
    goes_on
}

impl<S: Simd> Pixels<S> {
    /// The effect of a Gaussian of so much alpha. The transmittance behind it is rounded once, where processors can.
    #[inline(always)]
    fn pass(&self, alpha: f32x16<S>) -> Passed<S> {
        let t = self.transmittance;
        Passed { weight: t * alpha, rest: t.mul_add(-alpha, t) }
    }

    /// Adds so much of a colour.
    #[inline(always)]
    fn add(&mut self, simd: S, weight: f32x16<S>, [red, green, blue]: [f32; 3]) {
        self.red = weight.mul_add(f32x16::splat(simd, red), self.red);
        self.green = weight.mul_add(f32x16::splat(simd, green), self.green);
        self.blue = weight.mul_add(f32x16::splat(simd, blue), self.blue);
    }
}

/// The fall of a Gaussian's alpha at a block's pixels, formed in binary64: minus its base-2 logarithm, but no less
/// than -1, which is more than any ceiling, and still a power that is formed.
///
/// A Gaussian wider than the period of a panorama counts where it is nearer than its copies.
#[inline(always)]
pub(super) fn falls_64<S: Simd>(simd: S, splat: &Splat, task: &TileInputs<'_>, block: usize) -> f32x16<S> {
    let [a, b, c] = splat.factor;
    let from_mean = |axis: usize, block: f64| (f64::from(task.corner[axis]) + block) - splat.mean[axis];
    let opacity = f64x8::splat(simd, splat.log2_opacity.into());
    let half_period = if splat.exceeds_period { task.half_period } else { f64::INFINITY };
    let within = f64x8::splat(simd, half_period);
    let nothing = f64x8::splat(simd, 1e3);
    let middle = [from_mean(0, BLOCK_X[block]), from_mean(1, BLOCK_Y[block])];
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
