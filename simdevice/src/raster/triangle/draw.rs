//! A draw's state made ready for tiles, once for all workers: what its fragments need, when they are tested, where they
//! go, and which path they take.

use super::batch::Samples;
use super::setup::Needs;
use crate::geometry::PrimitiveDraw;
use crate::program::bindings::BoundResources;
use crate::program::fragment::{FragmentStage, Interface};
use crate::program::interface::{FragmentInput, Interpolation};
use crate::raster::color::ColorOutput;
use crate::raster::depth_stencil::Tests;
use crate::raster::output::{Targets, color_outputs};
use crate::raster::tile::{CENTER, SAMPLES_4};
use crate::raster::tile_buffer::Target;
use crate::runtime::Runtime;
use crate::state::{DrawState, Rect, Viewport};
use crate::stats::optimizations::{Optimization, Optimizations};
use fearless_simd::Level;
use std::time::Duration;

/// The path of a draw's fragments from coverage to the attachments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Path {
    /// Depth and stencil are tested first. A tile that a primitive covers waits to be shaded until it is clear that no
    /// other overwrites it; one is a batch of its own if `batches_tiles`.
    Deferred { batches_tiles: bool },
    /// Depth and stencil are tested first. A tile that a primitive covers is a batch of its own: fragments take nothing
    /// but varyings.
    WholeTiles,
    /// Depth and stencil are tested first, and quads are gathered to batches.
    EarlyTests,
    /// Quads are gathered to batches, and depth and stencil are tested after shading.
    LateTests,
}

impl Path {
    /// Tells whether a tile that a primitive covers is a batch of its own.
    pub(super) fn batches_tiles(self) -> bool {
        matches!(
            self,
            Self::WholeTiles
                | Self::Deferred {
                    batches_tiles: true
                }
        )
    }
}

/// A draw made ready for tiles, which all workers share.
pub struct TriangleTileDraw<'a> {
    pub(super) draw: &'a PrimitiveDraw,
    /// The program, if it must run.
    pub(super) stage: Option<&'a FragmentStage>,
    pub(super) bindings: BoundResources<'a>,
    pub(super) targets: Targets<'a>,
    pub(super) colors: Vec<Option<ColorOutput>>,
    pub(super) path: Path,
    pub(super) tests: Tests,
    /// The tests before shading, if there are any: all, or what fails for good of those that come after it.
    pub(super) early: Option<Tests>,
    /// Shading may take samples away.
    pub(super) removes: bool,
    /// Samples are counted after shading.
    pub(super) counts_late: bool,
    pub(super) samples: Samples,
    /// The pixels that the pass may touch.
    pub(super) area: Rect,
    /// Of each viewport: the range that depth is clamped to.
    pub(super) ranges: Vec<(f32, f32)>,
    /// The values that fragments need.
    pub(super) needs: Needs,
    /// The work that is left out in its tiles.
    pub(super) optimizations: Optimizations,
    pub(super) level: Level,
    pub(super) limit: Duration,
}

impl<'a> TriangleTileDraw<'a> {
    /// Makes a draw ready. `samples` are the attachments' samples, if there are attachments.
    pub fn new(
        draw: &'a PrimitiveDraw,
        targets: Targets<'a>,
        samples: Option<u32>,
        area: Rect,
        runtime: &Runtime,
    ) -> Self {
        let state = &*draw.state;
        let program = draw.pipeline.fragment.as_ref();
        let tests = Tests::new(
            &state.depth_stencil,
            targets.depth.map(Target::format),
            targets.stencil.is_some(),
        );
        let colors = color_outputs(
            program,
            targets.color,
            &state.blend,
            state.logic_op,
            state.blend_constants,
        );
        let effects = program.map_or_else(ShadingEffects::default, |program| {
            ShadingEffects::new(&program.interface, state, &tests)
        });
        let stage = program.filter(|program| {
            program.interface.has_side_effects
                || effects.counts_late
                || colors.iter().any(Option::is_some)
        });
        let interface = stage.map(|stage| &stage.interface);
        let multisampled = samples.unwrap_or(state.samples) > 1;
        let samples = Samples {
            positions: if multisampled { &SAMPLES_4 } else { &CENTER },
            each_shaded: multisampled
                && (state.sample_shading
                    || interface.is_some_and(|interface| interface.per_sample)),
        };
        let optimizations = runtime.config().optimizations;
        let takes_whole_tiles = !multisampled
            && state.sample_mask & 1 == 1
            && !effects.removes
            && !state.alpha_to_one
            // The record is of what hardware does that takes quads.
            && draw.record.is_none();
        let path = match interface {
            _ if effects.tests_late => Path::LateTests,
            Some(interface) if takes_whole_tiles => {
                whole_tile_path(interface, &colors, optimizations)
            }
            _ => Path::EarlyTests,
        };
        Self {
            draw,
            stage,
            bindings: draw.bindings.bind(runtime.level()),
            targets,
            colors,
            path,
            tests,
            early: if effects.tests_late {
                effects.filter
            } else {
                Some(tests).filter(Tests::any)
            },
            removes: effects.removes,
            counts_late: effects.counts_late,
            samples,
            area,
            ranges: depth_ranges(state),
            needs: interface.map_or_else(Needs::default, |interface| needs(interface, path)),
            optimizations,
            level: runtime.level(),
            limit: runtime.config().shader_timeout,
        }
    }

    /// Tells whether all that is covered is written.
    pub(super) fn writes_all(&self) -> bool {
        !self.tests.any() && !self.removes
    }

    /// Tells whether nothing happens to a fragment between shading and blending.
    pub(super) fn blends_directly(&self) -> bool {
        self.path != Path::LateTests && !self.removes && !self.draw.state.alpha_to_one
    }

    /// Marks what its program may have written to as changed.
    pub fn finish(&self) {
        if self.stage.is_some() {
            self.draw.bindings.bump_generations();
        }
    }
}

/// The effects of a program on which samples there are, and when they are known.
#[derive(Clone, Copy, Debug, Default)]
struct ShadingEffects {
    /// Samples may be taken away.
    removes: bool,
    /// Depth and stencil have to be tested after shading.
    tests_late: bool,
    /// What can be tested early of late tests.
    filter: Option<Tests>,
    /// Samples have to be counted after shading.
    counts_late: bool,
}

impl ShadingEffects {
    fn new(interface: &Interface, state: &DrawState, tests: &Tests) -> Self {
        let removes =
            interface.discards || interface.sample_mask.is_some() || state.alpha_to_coverage;
        let changes_depth = interface.depth.is_some();
        let tests_late = !interface.early_tests
            && (changes_depth
                || interface.has_side_effects && tests.any()
                || removes && tests.writes());
        Self {
            removes,
            tests_late,
            filter: tests
                .filter()
                .filter(|_| !changes_depth && !interface.has_side_effects),
            counts_late: tests_late || removes && !interface.early_tests,
        }
    }
}

/// The path of a draw that may take whole tiles at once.
fn whole_tile_path(
    interface: &Interface,
    colors: &[Option<ColorOutput>],
    optimizations: Optimizations,
) -> Path {
    let batches_tiles = interface.takes_varyings_alone();
    let removes_hidden_surfaces = optimizations.has(Optimization::OverwrittenQuads)
        && !interface.has_side_effects
        && colors.iter().flatten().all(ColorOutput::overwrites);
    if removes_hidden_surfaces {
        Path::Deferred { batches_tiles }
    } else if batches_tiles {
        Path::WholeTiles
    } else {
        Path::EarlyTests
    }
}

/// The range that depth is clamped to in each viewport.
fn depth_ranges(state: &DrawState) -> Vec<(f32, f32)> {
    let range = |viewport: &Viewport| {
        let (a, b) = (viewport.min_depth, viewport.max_depth);
        if state.depth_clamp {
            (a.min(b).clamp(0.0, 1.0), a.max(b).clamp(0.0, 1.0))
        } else {
            (0.0, 1.0)
        }
    };
    state.viewports.iter().map(range).collect()
}

/// The values that the fragments of a program need on a path.
fn needs(interface: &Interface, path: Path) -> Needs {
    let reads = |wanted: fn(FragmentInput) -> bool| {
        let mut inputs = interface.inputs.iter();
        inputs.any(|&(_, input, _)| wanted(input))
    };
    Needs {
        barycentrics: reads(|input| {
            matches!(
                input,
                FragmentInput::Varying { .. } | FragmentInput::PointCoord(_)
            )
        }),
        depth: path == Path::LateTests
            || reads(|input| matches!(input, FragmentInput::FragCoord(2))),
        inverse_w: reads(|input| {
            matches!(
                input,
                FragmentInput::Varying {
                    interpolation: Interpolation::Perspective,
                    ..
                } | FragmentInput::FragCoord(3)
            )
        }),
    }
}
