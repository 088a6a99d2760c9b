//! Counters of the work that the device does. They accumulate over a command processor's life; a query reads
//! the difference between its end and its beginning.

/// What a counter counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Things.
    Count,
    /// Host nanoseconds.
    Nanoseconds,
}

/// How a counter is presented to people.
#[derive(Clone, Copy, Debug)]
pub struct CounterInfo {
    /// A stable name, such as "gaussians drawn".
    pub name: &'static str,
    /// The group it belongs to.
    pub category: &'static str,
    /// One sentence.
    pub description: &'static str,
    /// What it counts.
    pub unit: Unit,
}

macro_rules! counters {
    ($($variant:ident: $category:literal, $name:literal, $unit:ident, $description:literal;)*) => {
        /// A counter; its discriminant is its index in [`Counters`] and [`Counter::ALL`].
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Counter {
            $(#[doc = $description] $variant,)*
        }

        impl Counter {
            /// Every counter, in order.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// How it is presented to people.
            pub fn info(self) -> CounterInfo {
                match self {
                    $(Self::$variant => CounterInfo {
                        name: $name,
                        category: $category,
                        description: $description,
                        unit: Unit::$unit,
                    },)*
                }
            }
        }
    };
}

counters! {
    GaussiansRead: "gaussians", "gaussians read", Count, "Gaussians that draws named";
    GaussiansDrawn: "gaussians", "gaussians drawn", Count, "Gaussians that reached at least one tile";
    SkippedNonFinite: "gaussians skipped", "non-finite", Count, "Gaussians with a non-finite attribute";
    SkippedZeroRotation: "gaussians skipped", "zero quaternion", Count, "Gaussians whose quaternion is all zero";
    SkippedNegativeScale: "gaussians skipped", "negative scale", Count, "Gaussians with a negative scale";
    SkippedFaint: "gaussians skipped", "below alpha floor", Count, "Gaussians whose opacity is below the alpha floor";
    SkippedNear: "gaussians skipped", "before near plane", Count, "Gaussians not beyond the near plane";
    SkippedFar: "gaussians skipped", "beyond far plane", Count, "Gaussians not before the far plane";
    SkippedDegenerate: "gaussians skipped", "degenerate covariance", Count, "Gaussians whose screen-space covariance is not positive and finite";
    SkippedOffScreen: "gaussians skipped", "off screen", Count, "Gaussians that reach no pixel of the scissored viewport at the alpha floor";
    TilePairs: "raster", "tile pairs", Count, "Pairs of a 16x16 tile and a Gaussian that reaches a pixel centre's rectangle of it";
    TilePairsEvaluated: "raster", "tile pairs evaluated", Count, "Tile pairs that were fetched before their tile was saturated";
    BlockEvaluations: "raster", "block evaluations", Count, "Pairs of a 4x4 block and a Gaussian whose alpha was evaluated";
    PixelContributions: "raster", "pixel contributions", Count, "Pairs of a pixel and a Gaussian that contributed to it";
    PreprocessTime: "time", "preprocess", Nanoseconds, "Reading, culling, projecting and colouring Gaussians";
    SortTime: "time", "sort", Nanoseconds, "Sorting by depth";
    BinningTime: "time", "binning", Nanoseconds, "Finding the tiles of each Gaussian, and placing it in their lists";
    RasterTime: "time", "raster", Nanoseconds, "Rendering tiles: load, evaluate, blend, store";
}

/// A value for every [`Counter`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Counters {
    values: [u64; Counter::ALL.len()],
}

impl Default for Counters {
    fn default() -> Self {
        Self {
            values: [0; Counter::ALL.len()],
        }
    }
}

impl Counters {
    /// The counter's value.
    pub fn get(&self, counter: Counter) -> u64 {
        self.values[counter as usize]
    }

    /// Adds to the counter.
    pub fn add(&mut self, counter: Counter, amount: u64) {
        let value = &mut self.values[counter as usize];
        *value = value.wrapping_add(amount);
    }

    /// Adds every counter of `other`.
    pub fn add_all(&mut self, other: &Self) {
        for (value, amount) in self.values.iter_mut().zip(other.values) {
            *value = value.wrapping_add(amount);
        }
    }

    /// What was added since `earlier`.
    pub fn since(&self, earlier: &Self) -> Self {
        let mut values = self.values;
        for (value, earlier) in values.iter_mut().zip(earlier.values) {
            *value = value.wrapping_sub(earlier);
        }
        Self { values }
    }

    /// The values in the order of [`Counter::ALL`].
    pub fn values(&self) -> &[u64] {
        &self.values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_query_reads_the_difference() {
        let mut counters = Counters::default();
        counters.add(Counter::TilePairs, 5);
        let begin = counters.clone();
        counters.add(Counter::TilePairs, 7);
        counters.add(Counter::GaussiansRead, 1);
        let difference = counters.since(&begin);
        assert_eq!(difference.get(Counter::TilePairs), 7);
        assert_eq!(difference.get(Counter::GaussiansRead), 1);
        assert_eq!(difference.get(Counter::GaussiansDrawn), 0);
    }

    #[test]
    fn names_are_distinct() {
        let mut names: Vec<_> = Counter::ALL.iter().map(|c| c.info().name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), Counter::ALL.len());
    }
}
