//! Counters of the device's work. They are summed from a command processor's creation on. A query reads the difference
//! between the values at its end and at its beginning.

use crate::limits::MAX_VERTEX_STREAMS;
use isa::machine::Work;
use isa::op::Kind;

/// The unit of a counter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// A number of things.
    Count,
    /// Host nanoseconds.
    Nanoseconds,
    /// Nanoseconds of the simulated hardware.
    SimulatedNanoseconds,
    /// Cycles of the simulated rasterizer's clock.
    Cycles,
    /// Bytes that the simulated hardware moves.
    Bytes,
    /// Nanojoules that the simulated hardware spends.
    Nanojoules,
    /// Hundredths of a whole.
    Percent,
}

/// The description of a counter for people.
#[derive(Clone, Copy, Debug)]
pub struct CounterInfo {
    /// A stable name, such as "gaussians drawn".
    pub name: &'static str,
    /// The group of the counter.
    pub category: &'static str,
    /// A sentence that describes the counter.
    pub description: &'static str,
    /// The counter's unit.
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

            /// The counter's description for people.
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
    ClustersBuilt: "gaussians", "clusters built", Count, "Clusters of up to 256 Gaussians that were made of memory that is drawn again";
    GaussiansDrawn: "gaussians", "gaussians drawn", Count, "Gaussians that reached at least one tile";
    TilesFoundWide: "gaussians", "tiles found in binary64", Count, "Gaussians whose tiles were searched in binary64, since the error of binary32 has no bound, or in a mode without a search in binary32";
    SkippedNonFinite: "gaussians skipped", "non-finite", Count, "Gaussians with a non-finite attribute";
    SkippedZeroRotation: "gaussians skipped", "zero quaternion", Count, "Gaussians whose quaternion is all zero";
    SkippedNegativeScale: "gaussians skipped", "negative scale", Count, "Gaussians with a negative scale";
    SkippedFaint: "gaussians skipped", "below alpha floor", Count, "Gaussians whose opacity is below the alpha floor";
    SkippedNear: "gaussians skipped", "before near plane", Count, "Gaussians not beyond the near plane";
    SkippedFar: "gaussians skipped", "beyond far plane", Count, "Gaussians not before the far plane";
    SkippedDegenerate: "gaussians skipped", "degenerate covariance", Count, "Gaussians whose screen-space covariance is not positive and finite";
    SkippedOffScreen: "gaussians skipped", "off screen", Count, "Gaussians that reach no pixel of the scissored viewport at the alpha floor";
    OutsideByClusters: "optimizations", "outside by clusters", Count, "Gaussians that were not read because the bounds of their cluster are outside the picture";
    HiddenByOthers: "optimizations", "hidden by others", Count, "Gaussians that were not read because others before their cluster finish all pixels that it reaches";
    SetsUnchanged: "optimizations", "sets unchanged", Count, "sets of Gaussians that were drawn as they had been projected, sorted and binned before";
    OutsideByBounds: "optimizations", "outside by bounds", Count, "Gaussians off screen by a sphere about them, and so not projected further";
    TilesBesideEllipse: "optimizations", "tiles beside ellipse", Count, "Tiles of Gaussians' boxes that their ellipses do not reach";
    HarmonicsUnread: "optimizations", "harmonics unread", Count, "Gaussians whose spherical harmonics were not read";
    BlocksBesideEllipse: "optimizations", "blocks beside ellipse", Count, "Pairs of an unfinished 4x4 block and a Gaussian of its tile that does not reach the block";
    BlocksSaturated: "optimizations", "blocks saturated", Count, "Pairs of a finished 4x4 block and a Gaussian of its tile";
    TilesUntouched: "optimizations", "tiles untouched", Count, "Tiles of attachments that were not loaded, because nothing was drawn to them";
    TilesOverwritten: "optimizations", "tiles overwritten", Count, "Tiles of colour attachments that were neither loaded nor cleared, because a primitive overwrote them as a whole";
    QuadsOverwritten: "optimizations", "quads overwritten", Count, "Quads of tiles that were not shaded, because a later primitive of the draw overwrote the tile as a whole";
    QuadsMasked: "optimizations", "quads masked", Count, "Quads of primitives' blocks that were not shaded, because no sample of them was left";
    BatchesAffine: "optimizations", "batches affine", Count, "Batches of fragments whose perspective-correct inputs needed no division";
    InputVertices: "geometry", "input vertices", Count, "Vertices or indices of draws of points, lines and triangles";
    InputPrimitives: "geometry", "input primitives", Count, "Points, lines and triangles that were assembled";
    VertexInvocations: "geometry", "vertex invocations", Count, "Vertices shaded";
    TessellationPatches: "geometry", "tessellation patches", Count, "Patches that tessellation control programs shaded";
    TessellationInvocations: "geometry", "tessellation evaluation invocations", Count, "Vertices that tessellation evaluation programs shaded";
    GeometryInvocations: "geometry", "geometry invocations", Count, "Invocations of geometry programs";
    GeometryPrimitives: "geometry", "geometry primitives", Count, "Primitives that geometry programs emitted";
    ClippingInvocations: "geometry", "clipping invocations", Count, "Primitives that reached clipping";
    ClippingPrimitives: "geometry", "clipping primitives", Count, "Primitives that clipping left, as it cut them";
    PrimitivesDrawn: "geometry", "primitives drawn", Count, "Primitives that were not culled and may cover a sample";
    BinnedPairs: "geometry", "binned pairs", Count, "Pairs of a macro-tile and a primitive that may touch it";
    PrimitivesOfStream0: "transform feedback", "primitives of stream 0", Count, "Primitives of vertex stream 0 that the last program before rasterization made";
    PrimitivesOfStream1: "transform feedback", "primitives of stream 1", Count, "Primitives of vertex stream 1 that the last program before rasterization made";
    PrimitivesOfStream2: "transform feedback", "primitives of stream 2", Count, "Primitives of vertex stream 2 that the last program before rasterization made";
    PrimitivesOfStream3: "transform feedback", "primitives of stream 3", Count, "Primitives of vertex stream 3 that the last program before rasterization made";
    CaptureNeeded0: "transform feedback", "to capture of stream 0", Count, "Primitives of vertex stream 0 that were made while transform feedback was active";
    CaptureNeeded1: "transform feedback", "to capture of stream 1", Count, "Primitives of vertex stream 1 that were made while transform feedback was active";
    CaptureNeeded2: "transform feedback", "to capture of stream 2", Count, "Primitives of vertex stream 2 that were made while transform feedback was active";
    CaptureNeeded3: "transform feedback", "to capture of stream 3", Count, "Primitives of vertex stream 3 that were made while transform feedback was active";
    Captured0: "transform feedback", "captured of stream 0", Count, "Primitives of vertex stream 0 that transform feedback wrote to buffers";
    Captured1: "transform feedback", "captured of stream 1", Count, "Primitives of vertex stream 1 that transform feedback wrote to buffers";
    Captured2: "transform feedback", "captured of stream 2", Count, "Primitives of vertex stream 2 that transform feedback wrote to buffers";
    Captured3: "transform feedback", "captured of stream 3", Count, "Primitives of vertex stream 3 that transform feedback wrote to buffers";
    TilePairs: "raster", "tile pairs", Count, "Pairs of a 16x16 tile and a Gaussian that reaches a pixel centre's rectangle of it";
    TilePairsEvaluated: "raster", "tile pairs evaluated", Count, "Tile pairs that were fetched before their tile was saturated";
    BlockEvaluations: "raster", "block evaluations", Count, "Pairs of a 4x4 block and a Gaussian whose alpha was evaluated";
    PixelContributions: "raster", "pixel contributions", Count, "Pairs of a pixel and a Gaussian that contributed to it";
    FragmentInvocations: "raster", "fragment invocations", Count, "Invocations of fragment programs, those that only help with derivatives apart";
    TilesHidden: "raster", "tiles hidden", Count, "Pairs of a tile and a primitive that was skipped there because all of the tile's depths hide it";
    GaussianTilesHidden: "raster", "gaussian tiles hidden", Count, "Pairs of a tile and a Gaussian that was skipped there because its depth fails against all of the tile's";
    GaussianBlocksHidden: "raster", "gaussian blocks hidden", Count, "Pairs of a 4x4 block and a Gaussian that was skipped there because its depth fails against all of the block's";
    BlocksLeftOut: "raster", "blocks left out", Count, "Pairs of an unfinished 4x4 block and a Gaussian of its tile that was left out, since all of the block's light is within the budget of contributions";
    SamplesPassed: "raster", "samples passed", Count, "Samples that passed all tests, those of Gaussian draws' fragments included";
    ComputeInvocations: "shader cores", "compute invocations", Count, "Invocations of compute programs";
    ShaderBatches: "shader cores", "batches", Count, "Batches of shader invocations run";
    ShaderFloat: "shader cores", "float instructions", Count, "32-bit float instructions, each counted once for a batch";
    ShaderInteger: "shader cores", "integer instructions", Count, "32-bit integer and bit instructions, each counted once for a batch";
    ShaderSpecial: "shader cores", "special function instructions", Count, "Divisions, roots and transcendental functions, each counted once for a batch";
    ShaderWide: "shader cores", "64-bit instructions", Count, "64-bit instructions, each counted once for a batch";
    ShaderMove: "shader cores", "move instructions", Count, "Moves, selections and conversions, each counted once for a batch";
    ShaderCrossLane: "shader cores", "cross-lane instructions", Count, "Derivatives and subgroup operations, each counted once for a batch";
    ShaderMemory: "shader cores", "memory instructions", Count, "Loads and stores, each counted once for a batch";
    ShaderAtomic: "shader cores", "atomic instructions", Count, "Atomic operations, each counted once for a batch";
    ShaderImage: "shader cores", "image instructions", Count, "Image samples, reads and writes, each counted once for a batch";
    ShaderControl: "shader cores", "control flow instructions", Count, "Branches, loops and mask updates, each counted once for a batch";
    ShaderUniform: "shader cores", "uniform instructions", Count, "Instructions computed once for all lanes of a batch; they are in the counts by kind too";
    ShaderActiveLanes: "shader cores", "active lanes", Count, "Lanes that were active, summed over the instructions that work on each lane";
    ShaderLanes: "shader cores", "lanes", Count, "Lanes that could have been active, summed alike; active lanes by it is the lane occupancy";
    GeometryTime: "time", "geometry", Nanoseconds, "All of points, lines and triangles before tiles: vertices, set-up, binning";
    PreprocessTime: "time", "preprocess", Nanoseconds, "Reading, culling, projecting and colouring Gaussians";
    ClusterTime: "time", "clusters", Nanoseconds, "Putting Gaussians that are drawn again into clusters; not part of preprocess";
    SortTime: "time", "sort", Nanoseconds, "Sorting by depth";
    BinningTime: "time", "binning", Nanoseconds, "Placing Gaussians and primitives in the lists of their tiles";
    ShaderTime: "time", "dispatches", Nanoseconds, "Running the workgroups of compute programs";
    RasterTime: "time", "raster", Nanoseconds, "Rendering tiles: load, evaluate, blend, store";
    SimulatedTime: "simulated hardware", "simulated time", SimulatedNanoseconds, "All stages, one after the other";
    SimulatedCompute: "simulated hardware", "simulated dispatches", SimulatedNanoseconds, "Compute programs on the shader cores";
    SimulatedPreprocess: "simulated hardware", "simulated preprocess", SimulatedNanoseconds, "Stage 1 on the shader cores: vertex programs, or projection and colours of Gaussians";
    SimulatedSort: "simulated hardware", "simulated sort", SimulatedNanoseconds, "Stage 2: making tile lists, of Gaussians in depth order";
    SimulatedRaster: "simulated hardware", "simulated raster", SimulatedNanoseconds, "Stage 3 on the rasterizer";
    SimulatedShade: "simulated hardware", "simulated fragments", SimulatedNanoseconds, "Fragment programs on the shader cores";
    SimulatedRasterCycles: "simulated hardware", "raster cycles", Cycles, "Cycles of the rasterizer from the first fetch to the last byte written";
    SimulatedBusy: "simulated hardware", "PE busy", Cycles, "Cycles of modules whose PEs evaluated pixels, summed over the modules";
    SimulatedDependency: "simulated hardware", "PE stall, dependency", Cycles, "Cycles of modules that waited for a pixel's transmittance";
    SimulatedMemoryStall: "simulated hardware", "PE stall, memory", Cycles, "Cycles of modules that waited for main memory";
    SimulatedController: "simulated hardware", "PE stall, controller", Cycles, "Cycles of modules at a tile's beginning, or at primitives that reach no pixel";
    SimulatedModeSwitch: "simulated hardware", "PE stall, mode switch", Cycles, "Cycles of modules that drained and reconfigured between triangles and Gaussians";
    SimulatedIdle: "simulated hardware", "PE idle", Cycles, "Cycles of modules that had nothing left to do";
    SimulatedOccupancy: "simulated hardware", "PE occupancy", Percent, "Busy cycles of all modules' cycles";
    SimulatedSwitches: "simulated hardware", "mode switches", Count, "Switches between triangles and Gaussians, of all modules";
    SimulatedBytesIn: "simulated hardware", "bytes fetched", Bytes, "Primitives and lists that modules fetched";
    SimulatedBytesOut: "simulated hardware", "bytes written", Bytes, "Pixels that modules wrote";
    SimulatedArithmeticEnergy: "simulated hardware", "energy, PE arithmetic", Nanojoules, "Nanojoules of adders, multipliers, dividers and exponentials";
    SimulatedBufferEnergy: "simulated hardware", "energy, tile buffers", Nanojoules, "Nanojoules of tile buffers";
    SimulatedLeakageEnergy: "simulated hardware", "energy, leakage", Nanojoules, "Nanojoules that modules spend whatever they do";
    SimulatedMemoryEnergy: "simulated hardware", "energy, main memory", Nanojoules, "Nanojoules of main memory, for the rasterizer";
    SimulatedShaderEnergy: "simulated hardware", "energy, shader cores", Nanojoules, "Nanojoules of the shader cores";
}

impl Counter {
    /// The primitives of each vertex stream.
    pub const PRIMITIVES_OF_STREAMS: [Self; MAX_VERTEX_STREAMS] =
        [Self::PrimitivesOfStream0, Self::PrimitivesOfStream1, Self::PrimitivesOfStream2, Self::PrimitivesOfStream3];

    /// The primitives of each vertex stream that transform feedback had to write.
    pub const CAPTURE_NEEDED: [Self; MAX_VERTEX_STREAMS] =
        [Self::CaptureNeeded0, Self::CaptureNeeded1, Self::CaptureNeeded2, Self::CaptureNeeded3];

    /// The primitives of each vertex stream that transform feedback wrote.
    pub const CAPTURED: [Self; MAX_VERTEX_STREAMS] =
        [Self::Captured0, Self::Captured1, Self::Captured2, Self::Captured3];

    /// True if the counter needs a model of the hardware to run.
    pub fn is_simulated(self) -> bool {
        self as usize >= Self::SimulatedTime as usize
    }
}

/// The counter of instructions of one kind.
fn of_kind(kind: Kind) -> Counter {
    match kind {
        Kind::Float => Counter::ShaderFloat,
        Kind::Integer => Counter::ShaderInteger,
        Kind::Special => Counter::ShaderSpecial,
        Kind::Wide => Counter::ShaderWide,
        Kind::Move => Counter::ShaderMove,
        Kind::CrossLane => Counter::ShaderCrossLane,
        Kind::Memory => Counter::ShaderMemory,
        Kind::Atomic => Counter::ShaderAtomic,
        Kind::Image => Counter::ShaderImage,
        Kind::Control => Counter::ShaderControl,
    }
}

/// A value for every [`Counter`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Counters {
    values: [u64; Counter::ALL.len()],
}

impl Default for Counters {
    fn default() -> Self {
        Self { values: [0; Counter::ALL.len()] }
    }
}

impl Counters {
    /// The value of a counter.
    pub fn get(&self, counter: Counter) -> u64 {
        self.values[counter as usize]
    }

    /// Adds `amount` to a counter.
    pub fn add(&mut self, counter: Counter, amount: u64) {
        let value = &mut self.values[counter as usize];
        *value = value.wrapping_add(amount);
    }

    /// Computes the counters that follow from other counters.
    pub(crate) fn derive(&mut self) {
        let busy = self.get(Counter::SimulatedBusy);
        let stalls = [
            Counter::SimulatedDependency,
            Counter::SimulatedMemoryStall,
            Counter::SimulatedController,
            Counter::SimulatedModeSwitch,
            Counter::SimulatedIdle,
        ];
        let all = busy + stalls.iter().map(|&stall| self.get(stall)).sum::<u64>();
        let percent = (100 * busy + all / 2).checked_div(all).unwrap_or(0);
        self.values[Counter::SimulatedOccupancy as usize] = percent;
    }

    /// Adds the work of shader cores.
    pub fn add_work(&mut self, work: &Work) {
        for kind in Kind::ALL {
            self.add(of_kind(kind), work.instructions[kind as usize]);
        }
        self.add(Counter::ShaderBatches, work.batches);
        let uniform = work.uniform_instructions.iter().sum();
        self.add(Counter::ShaderUniform, uniform);
        self.add(Counter::ShaderActiveLanes, work.active_lanes);
        self.add(Counter::ShaderLanes, work.lanes);
    }

    /// Adds every counter of `other`.
    pub fn add_all(&mut self, other: &Self) {
        for (value, amount) in self.values.iter_mut().zip(other.values) {
            *value = value.wrapping_add(amount);
        }
    }

    /// The differences of all counters to `earlier`.
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

    #[gaurast_runner::test]
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

    #[gaurast_runner::test]
    fn names_are_distinct() {
        let mut names: Vec<_> = Counter::ALL.iter().map(|c| c.info().name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), Counter::ALL.len());
    }
}
