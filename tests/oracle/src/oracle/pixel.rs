//! Step 7: compositing front to back. Decisions that cannot be required of binary32 are followed both ways.

use super::OracleState;
use super::error_model::{PrecisionClass, Transmittance, UNIT_ROUNDOFF};
use super::rules::{MedianHalf, WeighedBy};
use super::splat::{Alpha, Splat};

/// The number of undecidable decisions that are followed both ways along one path. Later ones follow binary64.
pub const MAX_DECISIONS: u32 = 6;

/// A Gaussian that may be a pixel's median.
#[derive(Clone, Copy, Debug, Default)]
struct Median {
    z: f32,
    z_error: f64,
    distance: f32,
    index: usize,
}

/// Gaussians, one of which is a pixel's median.
#[derive(Clone, Copy, Debug, Default)]
struct Medians {
    of: [Median; MAX_MEDIANS],
    count: usize,
    /// True if there are more than are kept.
    exhausted: bool,
}

/// The greatest number of candidates for the Gaussian at which T falls below one half; the reference gives up beyond
/// it.
const MAX_MEDIANS: usize = 4;

impl Medians {
    /// A Gaussian contributes where `before` is left; it is the median unless less than one half is.
    fn add(&mut self, median: Median, before: Transmittance, half: MedianHalf) {
        let (certainly_less, certainly_not) = (before.value + before.error < 0.5, before.value - before.error >= 0.5);
        let (certainly, certainly_another) = match half {
            MedianHalf::Upper => (certainly_not, certainly_less),
            MedianHalf::Lower => (certainly_less, certainly_not),
        };
        if certainly_another {
            return;
        }
        if certainly {
            self.count = 0;
        }
        match self.of.get_mut(self.count) {
            Some(slot) => {
                *slot = median;
                self.count += 1;
            }
            None => self.exhausted = true,
        }
    }
}

/// The result of one path of a pixel.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// (C, 1 - T).
    pub rgba: [f64; 4],
    /// True if a Gaussian contributed.
    pub covered: bool,
    /// Depth variables that the median may have, if covered, and their possible errors.
    pub medians: Vec<(f32, f64)>,
    /// True if the list of medians is incomplete.
    pub medians_exhausted: bool,
    /// The sums of weighted depths and of weights.
    pub depths: [f64; 2],
    /// The greatest possible errors of the depths and of the depth variables.
    pub depth_errors: [f64; 2],
    /// The error that the errors of alphas and colours make, per unit of the greatest colour; 0 with full precision.
    pub slack: f64,
    /// The sum of weighted depth variables.
    pub distances: f64,
    /// The first Gaussian that contributed, by its place in primitive order, if one did.
    pub nearest: Option<usize>,
    /// Places in primitive order of Gaussians that the median may be, as `medians`, and their depth variables.
    pub median_gaussians: Vec<(usize, f32)>,
}

/// One sequence of decisions at a pixel, and its result so far.
#[derive(Clone, Copy, Debug)]
struct Path {
    color: [f64; 3],
    transmittance: Transmittance,
    covered: bool,
    medians: Medians,
    nearest: Option<usize>,
    depths: [f64; 2],
    distances: f64,
    /// The greatest possible errors of the depths and depth variables that contributed.
    depth_errors: [f64; 2],
    /// The sum of T times the possible errors of alphas and colours, per unit of the greatest colour; 0 with full precision.
    slack: f64,
    finished: bool,
    /// Undecidable decisions taken so far, each of which was followed both ways.
    decisions: u32,
}

impl Path {
    const START: Self = Self {
        color: [0.0; 3],
        transmittance: Transmittance::ONE,
        covered: false,
        medians: Medians {
            of: [Median { z: 0.0, z_error: 0.0, distance: 0.0, index: 0 }; MAX_MEDIANS],
            count: 0,
            exhausted: false,
        },
        nearest: None,
        depths: [0.0; 2],
        distances: 0.0,
        depth_errors: [0.0; 2],
        slack: 0.0,
        finished: false,
        decisions: 0,
    };

    fn outcome(&self) -> Outcome {
        let medians = &self.medians.of[..self.medians.count];
        Outcome {
            rgba: self.rgba(),
            covered: self.covered,
            medians: medians.iter().map(|median| (median.z, median.z_error)).collect(),
            medians_exhausted: self.medians.exhausted,
            depths: self.depths,
            depth_errors: self.depth_errors,
            slack: self.slack,
            distances: self.distances,
            nearest: self.nearest,
            median_gaussians: (medians.iter()).map(|median| (median.index, median.distance)).collect(),
        }
    }

    fn rgba(&self) -> [f64; 4] {
        let [r, g, b] = self.color;
        [r, g, b, 1.0 - self.transmittance.value]
    }
}

/// A pixel while Gaussians are added to it, nearest first.
#[derive(Clone, Debug)]
pub struct Pixel {
    /// The path of the binary64 decisions.
    nominal: Path,
    /// The other paths, in the order in which they branched off.
    alternatives: Vec<Path>,
    /// True if a path met more than [`MAX_DECISIONS`] undecidable decisions.
    exhausted: bool,
}

impl Pixel {
    /// A pixel with nothing in it.
    pub const EMPTY: Self = Self { nominal: Path::START, alternatives: Vec::new(), exhausted: false };

    /// True if no further Gaussian can change it.
    pub fn is_finished(&self) -> bool {
        self.nominal.finished && self.alternatives.iter().all(|path| path.finished)
    }

    /// Adds the next Gaussian by ascending depth.
    pub fn add(&mut self, splat: &Splat, alpha: Alpha, state: &OracleState) {
        let is_faint = alpha.value + alpha.error < f64::from(state.alpha_floor);
        if is_faint || alpha.is_certainly_cut() {
            return;
        }
        let mut step = Step {
            color: splat.color,
            median: Median {
                z: splat.z,
                z_error: splat.error.rounding().depth,
                distance: splat.distance,
                index: splat.index,
            },
            color_error: splat.error.rounding().color,
            depth_error: splat.depth_error,
            depth: splat.depth,
            alpha,
            state,
            forks: Vec::new(),
            exhausted: false,
        };
        step.contribute_or_not(&mut self.nominal);
        for path in &mut self.alternatives {
            step.contribute_or_not(path);
        }
        self.exhausted |= step.exhausted;
        self.alternatives.append(&mut step.forks);
    }

    /// Takes all paths of a pixel that was composited in another order.
    pub(super) fn take_ways_of(&mut self, other: Self) {
        self.alternatives.push(other.nominal);
        self.alternatives.extend(other.alternatives);
        self.exhausted |= other.exhausted;
    }

    /// Notes that some paths were not followed.
    pub(super) fn exhaust(&mut self) {
        self.exhausted = true;
    }

    /// The binary64 result: (C, 1 - T).
    pub fn rgba(&self) -> [f64; 4] {
        self.nominal.rgba()
    }

    /// The greatest error of a path that the errors of alphas and colours make, per unit of the greatest colour.
    pub fn slack(&self) -> f64 {
        self.alternatives.iter().fold(self.nominal.slack, |most, path| most.max(path.slack))
    }

    /// The results of the other paths.
    pub fn alternatives(&self) -> Vec<[f64; 4]> {
        self.alternatives.iter().map(Path::rgba).collect()
    }

    /// The outcome of every path, the binary64 one first.
    pub fn outcomes(&self) -> impl Iterator<Item = Outcome> {
        std::iter::once(&self.nominal).chain(&self.alternatives).map(Path::outcome)
    }

    /// True if a path met more undecidable decisions than are followed.
    pub fn is_exhausted(&self) -> bool {
        self.exhausted
    }
}

/// One Gaussian being added to all paths of a pixel.
struct Step<'a> {
    color: [f64; 3],
    median: Median,
    depth: f64,
    color_error: f64,
    depth_error: f64,
    alpha: Alpha,
    state: &'a OracleState,
    /// Paths that branch off at this Gaussian, which is already added to them.
    forks: Vec<Path>,
    exhausted: bool,
}

impl Step<'_> {
    /// Step 6's decisions: `alpha >= alphaFloor`, and that it is not cut off.
    fn contribute_or_not(&mut self, path: &mut Path) {
        if path.finished {
            return;
        }
        let floor = f64::from(self.state.alpha_floor);
        let Alpha { value, error, is_cut, cut_undecidable } = self.alpha;
        let contributes = value >= floor && !is_cut;
        // No alpha is below a floor of 0, whatever its error.
        let at_floor = floor > 0.0 && (value - floor).abs() < error;
        if value < floor && !at_floor {
            return;
        }
        let undecidable = at_floor || cut_undecidable;
        if let Some(mut other) = self.part(path, undecidable) {
            if !contributes {
                self.finish_or_blend(&mut other);
            }
            self.forks.push(other);
        }
        if contributes {
            self.finish_or_blend(path);
        }
    }

    /// Step 7's decision, `T (1 - alpha) < transmittanceFloor`, and its consequence.
    fn finish_or_blend(&mut self, path: &mut Path) {
        let floor = f64::from(self.state.transmittance_floor);
        let behind = path.transmittance.behind(self.alpha.value, self.alpha.error);
        // If 1 - alpha rounds to 1, T does not change, and it has passed this test before.
        let undecidable =
            floor > 0.0 && self.alpha.value > 0.5 * UNIT_ROUNDOFF && (behind.value - floor).abs() < behind.error;
        let finishes = behind.value < floor;
        if let Some(mut other) = self.part(path, undecidable) {
            if finishes {
                self.blend(&mut other, behind);
            } else {
                self.finish(&mut other, behind);
            }
            self.forks.push(other);
        }
        if finishes {
            self.finish(path, behind);
        } else {
            self.blend(path, behind);
        }
    }

    fn finish(&self, path: &mut Path, behind: Transmittance) {
        if self.state.rules.last_contributes {
            self.blend(path, behind);
        }
        path.finished = true;
    }

    fn blend(&self, path: &mut Path, behind: Transmittance) {
        let transmittance = match self.state.rules.weighed_by {
            WeighedBy::TransmittanceBefore => path.transmittance.value,
            WeighedBy::TransmittanceBehind => behind.value,
        };
        let weight = transmittance * self.alpha.value;
        for (sum, color) in path.color.iter_mut().zip(self.color) {
            *sum += weight * color;
        }
        if self.state.rules.precision == PrecisionClass::Relaxed {
            path.slack += path.transmittance.value * (self.alpha.error + self.alpha.value * self.color_error);
        }
        path.depth_errors[0] = path.depth_errors[0].max(self.depth_error);
        path.depth_errors[1] = path.depth_errors[1].max(self.median.z_error);
        path.depths[0] += weight * self.depth;
        path.depths[1] += weight;
        path.distances += weight * f64::from(self.median.distance);
        path.nearest = path.nearest.or(Some(self.median.index));
        path.covered = true;
        path.medians.add(self.median, path.transmittance, self.state.rules.median_half);
        path.transmittance = behind;
    }

    /// The path that decides otherwise, if both ways are to be followed.
    fn part(&mut self, path: &mut Path, undecidable: bool) -> Option<Path> {
        if !undecidable {
            return None;
        }
        if path.decisions == MAX_DECISIONS {
            self.exhausted = true;
            return None;
        }
        path.decisions += 1;
        Some(*path)
    }
}
