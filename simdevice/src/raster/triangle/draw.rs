//! The preparation of a draw for its tiles, once for all workers: the values that its fragments need, the tests and
//! their time, the outputs, and the path of fragments.

use super::batch::Samples;
use super::setup::Needs;
use crate::format::depth::DepthEncoding;
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
use crate::state::{DrawState, LineMode, Rect, Viewport};
use crate::stats::optimizations::{Optimization, Optimizations};
use fearless_simd::Level;
use std::time::Duration;

/// The path of a draw's fragments from coverage to the attachments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Path {
    /// Depth and stencil are tested first. A tile that a primitive covers completely is shaded only when no later
    /// primitive can overwrite it. It is a batch of its own if `batches_tiles`.
    Deferred { batches_tiles: bool },
    /// Depth and stencil are tested first. A tile that a primitive covers completely is a batch of its own. The only
    /// inputs of fragments are varyings.
    WholeTiles,
    /// Depth and stencil are tested first, and quads are collected in batches.
    EarlyTests,
    /// Quads are collected in batches, and depth and stencil are tested after shading.
    LateTests,
}

impl Path {
    /// True if a tile that a primitive covers completely is a batch of its own.
    pub(super) fn batches_tiles(self) -> bool {
        matches!(self, Self::WholeTiles | Self::Deferred { batches_tiles: true })
    }
}

/// A draw that is prepared for its tiles. All workers share it.
pub struct TriangleTileDraw<'a> {
    pub(super) draw: &'a PrimitiveDraw,
    /// The fragment program, if it must run.
    pub(super) stage: Option<&'a FragmentStage>,
    pub(super) bound: BoundResources<'a>,
    pub(super) targets: Targets<'a>,
    pub(super) colors: Vec<Option<ColorOutput>>,
    pub(super) path: Path,
    pub(super) tests: Tests,
    /// The tests before shading, if there are any: all tests, or those of the late tests that reject fragments early.
    pub(super) early: Option<Tests>,
    /// True if shading may remove samples.
    pub(super) removes: bool,
    /// True if shading may remove some samples of a fragment.
    pub(super) masks_samples: bool,
    /// True if samples are counted after shading.
    pub(super) counts_late: bool,
    pub(super) samples: Samples,
    /// The pixels that the pass may touch.
    pub(super) area: Rect,
    /// The range to which depth is clamped, for each viewport.
    pub(super) ranges: Vec<(f32, f32)>,
    /// The values that fragments need.
    pub(super) needs: Needs,
    /// The optimizations that are enabled in its tiles.
    pub(super) optimizations: Optimizations,
    pub(super) level: Level,
    pub(super) limit: Duration,
}

impl<'a> TriangleTileDraw<'a> {
    /// Prepares a draw. `samples` is the number of the attachments' samples, if there are attachments.
    pub fn new(
        draw: &'a PrimitiveDraw,
        targets: Targets<'a>,
        samples: Option<u32>,
        area: Rect,
        runtime: &Runtime,
    ) -> Self {
        let state = &*draw.state;
        let program = draw.pipeline.fragment.as_ref();
        let tests = Tests::new(&state.depth_stencil, targets.depth.map(Target::format), targets.stencil.is_some());
        let colors = color_outputs(program, targets.color, &state.blend, state.logic_op, state.blend_constants);
        let effects = program
            .map_or_else(ShadingEffects::default, |program| ShadingEffects::new(&program.interface, state, &tests));
        let stage = program.filter(|program| {
            program.interface.has_side_effects || effects.counts_late || colors.iter().any(Option::is_some)
        });
        let interface = stage.map(|stage| &stage.interface);
        let multisampled = samples.unwrap_or(state.samples) > 1;
        let samples = Samples {
            positions: if multisampled { &SAMPLES_4 } else { &CENTER },
            each_shaded: multisampled
                && (state.sample_shading || interface.is_some_and(|interface| interface.per_sample)),
        };
        let optimizations = runtime.config().optimizations;
        let takes_whole_tiles = !multisampled
            && state.sample_mask & 1 == 1
            && !effects.removes
            && !state.alpha_to_one
            && state.line_mode != LineMode::Smooth
            && !state.reads_attachments
            // A recording describes hardware that processes quads.
            && draw.record.is_none();
        let path = match interface {
            _ if effects.tests_late => Path::LateTests,
            Some(interface) if takes_whole_tiles => {
                let hides = optimizations.has(Optimization::OverwrittenQuads);
                let hides = hides && !draw.counts_fragments;
                whole_tile_path(interface, &colors, hides)
            }
            _ => Path::EarlyTests,
        };
        Self {
            draw,
            stage,
            bound: draw.bindings.bind(runtime.level()),
            targets,
            colors,
            path,
            tests,
            early: if effects.tests_late { effects.filter } else { Some(tests).filter(Tests::any) },
            removes: effects.removes,
            masks_samples: effects.masks_samples,
            counts_late: effects.counts_late,
            samples,
            area,
            ranges: depth_ranges(state, tests.code),
            needs: interface.map_or_else(Needs::default, |interface| needs(interface, path, optimizations)),
            optimizations,
            level: runtime.level(),
            limit: runtime.config().shader_timeout,
        }
    }

    /// True if fragments read the samples that their primitive covers, of which early tests may remove some.
    pub(super) fn reads_samples_before_tests(&self) -> bool {
        let reads = |stage: &FragmentStage| {
            let mut inputs = stage.interface.inputs.iter();
            !stage.interface.post_depth_coverage && inputs.any(|(_, input, _)| *input == FragmentInput::SampleMask)
        };
        self.early.is_some()
            && self.samples.positions.len() > 1
            && !self.samples.each_shaded
            && self.stage.is_some_and(reads)
    }

    /// True if all covered samples are written.
    pub(super) fn writes_all(&self) -> bool {
        !self.tests.any() && !self.removes
    }

    /// True if all covered blocks of a tile go to the batch: there is one sample per pixel, which nothing removes before
    /// shading, and nobody records the work.
    #[inline(always)]
    pub(super) fn appends_untested(&self) -> bool {
        self.early.is_none()
            && self.stage.is_some()
            && self.samples.positions.len() == 1
            && self.draw.state.sample_mask & 1 == 1
            && self.draw.record.is_none()
            && self.optimizations.has(Optimization::MaskedQuads)
    }

    /// True if depth and stencil are tested after shading.
    pub(super) fn tests_late(&self) -> bool {
        self.path == Path::LateTests && self.tests.any()
    }

    /// True if nothing happens to a fragment between shading and blending, unless its program kills it.
    pub(super) fn blends_directly(&self) -> bool {
        !self.tests_late() && !self.masks_samples && !self.draw.state.alpha_to_one && !self.smooths_lines()
    }

    /// True if the alpha of lines is multiplied by their coverage.
    pub(super) fn smooths_lines(&self) -> bool {
        self.draw.state.line_mode == LineMode::Smooth
    }

    /// Marks the memory that its program may have written as changed.
    pub fn finish(&self) {
        if self.stage.is_some() {
            self.draw.bindings.bump_generations();
        }
    }
}

/// The effects of a program on samples, and the time of the tests.
#[derive(Clone, Copy, Debug, Default)]
struct ShadingEffects {
    /// True if samples may be removed.
    removes: bool,
    /// True if only some samples of a fragment may be removed.
    masks_samples: bool,
    /// True if depth and stencil must be tested after shading.
    tests_late: bool,
    /// The part of late tests that can be done early.
    filter: Option<Tests>,
    /// True if samples must be counted after shading.
    counts_late: bool,
}

impl ShadingEffects {
    fn new(interface: &Interface, state: &DrawState, tests: &Tests) -> Self {
        let masks_samples = interface.sample_mask.is_some() || state.alpha_to_coverage;
        let removes = interface.discards || masks_samples;
        let changes_tests =
            interface.depth.is_some() || interface.stencil_reference.is_some() && tests.stencil.is_some();
        let tests_late = !interface.early_tests
            && (changes_tests || interface.has_side_effects && tests.any() || removes && tests.writes());
        Self {
            removes,
            masks_samples,
            tests_late,
            filter: tests.filter().filter(|_| !changes_tests && !interface.has_side_effects),
            counts_late: tests_late || removes && !interface.early_tests,
        }
    }
}

/// The path of a draw that may process whole tiles at once. Hidden surfaces are left out only if `may_hide`.
fn whole_tile_path(interface: &Interface, colors: &[Option<ColorOutput>], may_hide: bool) -> Path {
    let batches_tiles = interface.takes_varyings_alone();
    let removes_hidden_surfaces =
        may_hide && !interface.has_side_effects && colors.iter().flatten().all(ColorOutput::overwrites);
    if removes_hidden_surfaces {
        Path::Deferred { batches_tiles }
    } else if batches_tiles {
        Path::WholeTiles
    } else {
        Path::EarlyTests
    }
}

/// The range to which depth is clamped in each viewport (Vulkan 1.3, "Depth Clamping and Range Adjustment").
fn depth_ranges(state: &DrawState, code: DepthEncoding) -> Vec<(f32, f32)> {
    let (least, greatest) = if state.unrestricted_depth && code == DepthEncoding::Float {
        (f32::NEG_INFINITY, f32::INFINITY)
    } else {
        (0.0, 1.0)
    };
    let range = |viewport: &Viewport| {
        let (a, b) = (viewport.min_depth, viewport.max_depth);
        if state.depth_clamp {
            let inside = |depth: f32| depth.clamp(least, greatest);
            (inside(a.min(b)), inside(a.max(b)))
        } else {
            (least, greatest)
        }
    };
    state.viewports.iter().map(range).collect()
}

/// The values that the fragments of a program need on a path.
fn needs(interface: &Interface, path: Path, optimizations: Optimizations) -> Needs {
    let reads = |wanted: fn(FragmentInput) -> bool| {
        let mut inputs = interface.inputs.iter();
        inputs.any(|&(_, input, _)| wanted(input))
    };
    Needs {
        barycentrics: reads(|input| matches!(input, FragmentInput::Varying { .. } | FragmentInput::PointCoord(_))),
        depth: path == Path::LateTests || reads(|input| matches!(input, FragmentInput::FragCoord(2))),
        inverse_w: reads(|input| {
            matches!(
                input,
                FragmentInput::Varying { interpolation: Interpolation::Perspective, .. } | FragmentInput::FragCoord(3)
            )
        }),
        detects_affine: optimizations.has(Optimization::Affine),
    }
}
