//! Step 7: compositing front to back. Decisions that cannot be required of binary32 are followed both ways.

use super::OracleState;
use super::error_model::{Transmittance, UNIT_ROUNDOFF};
use super::splat::{Alpha, Splat};

/// The number of undecidable decisions that are followed both ways along one path. Later ones follow binary64.
pub const MAX_DECISIONS: u32 = 6;

/// The possible depth variables of a pixel's median.
#[derive(Clone, Copy, Debug, Default)]
struct Medians {
    z: [f32; MAX_MEDIANS],
    count: usize,
    /// True if there are more than are kept.
    exhausted: bool,
}

/// The greatest number of candidates for the Gaussian at which T falls below one half; the reference gives up beyond
/// it.
const MAX_MEDIANS: usize = 4;

impl Medians {
    /// Adds a Gaussian that contributes where the transmittance is `before`. It is the median candidate unless less
    /// than one half is left.
    fn add(&mut self, z: f32, before: Transmittance) {
        if before.value + before.error < 0.5 {
            return;
        }
        if before.value - before.error >= 0.5 {
            self.count = 0;
        }
        match self.z.get_mut(self.count) {
            Some(slot) => {
                *slot = z;
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
    /// Depth variables that the median may have, if covered.
    pub medians: Vec<f32>,
    /// True if the list of medians is incomplete.
    pub medians_exhausted: bool,
    /// The sums of weighted depths and of weights.
    pub depths: [f64; 2],
}

/// One sequence of decisions at a pixel, and its result so far.
#[derive(Clone, Copy, Debug)]
struct Path {
    color: [f64; 3],
    transmittance: Transmittance,
    covered: bool,
    medians: Medians,
    depths: [f64; 2],
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
            z: [0.0; MAX_MEDIANS],
            count: 0,
            exhausted: false,
        },
        depths: [0.0; 2],
        finished: false,
        decisions: 0,
    };

    fn outcome(&self) -> Outcome {
        Outcome {
            rgba: self.rgba(),
            covered: self.covered,
            medians: self.medians.z[..self.medians.count].to_vec(),
            medians_exhausted: self.medians.exhausted,
            depths: self.depths,
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
    pub const EMPTY: Self = Self {
        nominal: Path::START,
        alternatives: Vec::new(),
        exhausted: false,
    };

    /// True if no further Gaussian can change it.
    pub fn is_finished(&self) -> bool {
        self.nominal.finished && self.alternatives.iter().all(|path| path.finished)
    }

    /// Adds the next Gaussian by ascending depth.
    pub fn add(&mut self, splat: &Splat, alpha: Alpha, state: &OracleState) {
        if alpha.value + alpha.error < f64::from(state.alpha_floor) {
            return;
        }
        let mut step = Step {
            color: splat.color,
            z: splat.z,
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

    /// The results of the other paths.
    pub fn alternatives(&self) -> Vec<[f64; 4]> {
        self.alternatives.iter().map(Path::rgba).collect()
    }

    /// The outcome of every path, the binary64 one first.
    pub fn outcomes(&self) -> impl Iterator<Item = Outcome> {
        std::iter::once(&self.nominal)
            .chain(&self.alternatives)
            .map(Path::outcome)
    }

    /// True if a path met more undecidable decisions than are followed.
    pub fn is_exhausted(&self) -> bool {
        self.exhausted
    }
}

/// One Gaussian being added to all paths of a pixel.
struct Step<'a> {
    color: [f64; 3],
    z: f32,
    depth: f64,
    alpha: Alpha,
    state: &'a OracleState,
    /// Paths that branch off at this Gaussian, which is already added to them.
    forks: Vec<Path>,
    exhausted: bool,
}

impl Step<'_> {
    /// Step 6's decision: `alpha >= alphaFloor`.
    fn contribute_or_not(&mut self, path: &mut Path) {
        if path.finished {
            return;
        }
        let floor = f64::from(self.state.alpha_floor);
        let Alpha { value, error } = self.alpha;
        let contributes = value >= floor;
        // With a floor of 0 no alpha is below it, whatever its error.
        let undecidable = floor > 0.0 && (value - floor).abs() < error;
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
        let behind = path
            .transmittance
            .behind(self.alpha.value, self.alpha.error);
        // If 1 - alpha rounds to 1, T does not change, and it has passed this test before.
        let undecidable = floor > 0.0
            && self.alpha.value > 0.5 * UNIT_ROUNDOFF
            && (behind.value - floor).abs() < behind.error;
        let finishes = behind.value < floor;
        if let Some(mut other) = self.part(path, undecidable) {
            if finishes {
                self.blend(&mut other, behind);
            } else {
                other.finished = true;
            }
            self.forks.push(other);
        }
        if finishes {
            path.finished = true;
        } else {
            self.blend(path, behind);
        }
    }

    fn blend(&self, path: &mut Path, behind: Transmittance) {
        let weight = path.transmittance.value * self.alpha.value;
        for (sum, color) in path.color.iter_mut().zip(self.color) {
            *sum += weight * color;
        }
        path.depths[0] += weight * self.depth;
        path.depths[1] += weight;
        path.covered = true;
        path.medians.add(self.z, path.transmittance);
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
