//! A draw's state made ready for tiles, once for all workers: what its fragments need, when they are tested, and where
//! they go.

use super::color::ColorOutput;
use super::depth::Tests;
use super::setup::{CENTER, SAMPLES_4};
use super::tile::Target;
use crate::geometry::PrimitiveDraw;
use crate::program::bindings::BoundResources;
use crate::program::fragment::{FragmentStage, Interface};
use crate::program::interface::{FragmentInput, Interpolation};
use crate::raster::output::{Targets, color_outputs};
use crate::raster::setup::Needs;
use crate::runtime::Runtime;
use crate::state::Rect;
use crate::stats::optimizations::{Optimization, Optimizations};
use fearless_simd::Level;
use std::time::Duration;

/// When depth and stencil are tested.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Timing {
    /// Before shading.
    Early,
    /// After it.
    Late,
}

/// A draw made ready for tiles, which all workers share.
pub struct TileDraw<'a> {
    pub(super) draw: &'a PrimitiveDraw,
    /// The program, if it must run.
    pub(super) stage: Option<&'a FragmentStage>,
    pub(super) bindings: BoundResources<'a>,
    pub(super) targets: Targets<'a>,
    pub(super) colors: Vec<Option<ColorOutput>>,
    pub(super) tests: Tests,
    pub(super) timing: Timing,
    /// What can be tested early of late tests.
    pub(super) filter: Option<Tests>,
    /// Whether all that is covered is written.
    pub(super) keeps_all: bool,
    /// Nothing happens between a fragment's shading and its blending: all that is covered is written.
    pub(super) plain: bool,
    /// Tiles that a primitive covers may wait to be shaded until it is clear that none overwrites them.
    pub(super) defers: bool,
    /// Tiles that a primitive covers may be shaded at once: fragments take nothing but varyings.
    pub(super) takes_tiles: bool,
    /// Samples are counted after shading, which may discard some.
    pub(super) count_late: bool,
    /// Every sample is shaded for itself.
    pub(super) per_sample: bool,
    pub(super) positions: &'static [[i32; 2]],
    /// The pixels that the pass may touch.
    pub(super) area: Rect,
    /// Of each viewport: the range that depth is clamped to.
    pub(super) ranges: Vec<(f32, f32)>,
    /// What fragments need.
    pub(super) needs: Needs,
    /// What is left out in its tiles.
    pub(super) optimizations: Optimizations,
    pub(super) level: Level,
    pub(super) limit: Duration,
}

impl<'a> TileDraw<'a> {
    /// Makes a draw ready. `samples` are the attachments' samples, if there are attachments.
    pub fn new(
        draw: &'a PrimitiveDraw,
        targets: Targets<'a>,
        samples: Option<u32>,
        area: Rect,
        runtime: &Runtime,
    ) -> Self {
        let state = &*draw.state;
        let multisampled = samples.unwrap_or(state.samples) > 1;
        let mut stage = draw.pipeline.fragment.as_ref();
        let tests = Tests::new(
            &state.depth_stencil,
            targets.depth.map(Target::format),
            targets.stencil.is_some(),
        );
        let colors = color_outputs(
            stage,
            targets.color,
            &state.blend,
            state.logic_op,
            state.blend_constants,
        );
        let (mut timing, mut count_late, mut plain) = (Timing::Early, false, true);
        let (mut filter, mut keeps_all) = (None, !tests.any());
        if let Some(interface) = stage.map(|stage| &stage.interface) {
            let removes =
                interface.discards || interface.sample_mask.is_some() || state.alpha_to_coverage;
            let changes = interface.depth.is_some();
            let late = !interface.early_tests
                && (changes
                    || interface.has_side_effects && tests.any()
                    || removes && tests.writes());
            if late {
                timing = Timing::Late;
                filter = tests
                    .filter()
                    .filter(|_| !changes && !interface.has_side_effects);
            }
            keeps_all &= !removes;
            plain = !removes && !late;
            count_late = late || removes && !interface.early_tests;
            let needed = interface.has_side_effects
                || late
                || count_late
                || colors.iter().any(Option::is_some);
            if !needed {
                stage = None;
            }
        }
        let interface = stage.map(|stage| &stage.interface);
        let per_sample = multisampled
            && (state.sample_shading || interface.is_some_and(|interface| interface.per_sample));
        let reads = |wanted: fn(FragmentInput) -> bool| {
            interface.is_some_and(|interface| {
                interface.inputs.iter().any(|&(_, input, _)| wanted(input))
            })
        };
        let viewports = state.viewports.iter();
        let plain = plain && !state.alpha_to_one;
        // What was recorded is what hardware without this does.
        let defers = runtime
            .config()
            .optimizations
            .has(Optimization::OverwrittenQuads)
            && plain
            && !multisampled
            && state.sample_mask & 1 == 1
            && interface.is_some_and(|interface| !interface.has_side_effects)
            && colors.iter().flatten().all(ColorOutput::overwrites)
            && draw.record.is_none();
        let takes_tiles = plain
            && !multisampled
            && state.sample_mask & 1 == 1
            && interface.is_some_and(Interface::takes_varyings_alone)
            && draw.record.is_none();
        Self {
            draw,
            stage,
            bindings: draw.bindings.bind(runtime.level()),
            targets,
            colors,
            tests,
            timing,
            filter,
            keeps_all,
            plain,
            defers,
            takes_tiles,
            count_late,
            per_sample,
            positions: if multisampled { &SAMPLES_4 } else { &CENTER },
            area,
            ranges: viewports
                .map(|viewport| {
                    let (a, b) = (viewport.min_depth, viewport.max_depth);
                    if state.depth_clamp {
                        (a.min(b).clamp(0.0, 1.0), a.max(b).clamp(0.0, 1.0))
                    } else {
                        (0.0, 1.0)
                    }
                })
                .collect(),
            needs: Needs {
                barycentrics: reads(|input| {
                    matches!(
                        input,
                        FragmentInput::Varying { .. } | FragmentInput::PointCoord(_)
                    )
                }),
                depth: timing == Timing::Late
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
            },
            optimizations: runtime.config().optimizations,
            level: runtime.level(),
            limit: runtime.config().shader_timeout,
        }
    }

    /// Marks what its program may have written to as changed.
    pub fn finish(&self) {
        if self.stage.is_some() {
            self.draw.bindings.bump_generations();
        }
    }
}
