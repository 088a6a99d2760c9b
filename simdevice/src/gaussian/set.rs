//! A set of Gaussians that are sorted and drawn together, as packets describe it.

use super::lanes::GROUP;
use super::view::center_depth::CenterDepth;
use crate::format::Format;
use crate::packet::{Draw, GaussianAppend, GaussianBegin, GaussianFragmentStage};
use crate::state::gaussian::GaussianGeometry;
use crate::state::{Rect, Viewport};
use devmem::host;
use isa::machine::Stopped;

/// The most groups of a set: a splat's index, which is its group and its place there, has 32 bits.
pub(crate) const MAX_GROUPS: u64 = (1 << 32) / GROUP as u64;

/// True if instances of `count` Gaussians share groups: otherwise at least half of each group would be empty.
pub(crate) const fn is_packed(count: u32) -> bool {
    count as usize <= GROUP / 2
}

/// A set of Gaussians that are sorted and drawn together.
#[derive(Debug)]
pub struct GaussianSet {
    pub(crate) begin: GaussianBegin,
    /// The layer to which the set is drawn. It selects the view.
    pub(crate) layer: u32,
    pub(crate) bounds: Rect,
    pub(crate) depth: Option<CenterDepth>,
    /// The format to which depths are rounded.
    pub(crate) depth_format: Format,
    pub(crate) fragment_stage: Option<GaussianFragmentStage>,
    pub(crate) appends: Vec<GaussianAppend>,
    /// The number of Gaussians of the packets that lie beyond their buffers. They are not in `appends`.
    pub(crate) beyond_buffers: u64,
    /// The draws that a vertex program projects. They come after the appends.
    pub(crate) draws: Vec<Draw>,
}

/// The reasons why a set cannot be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SortError {
    /// The set has more Gaussians than one draw can sort.
    #[error("a sorted set of {groups} groups of Gaussians exceeds the {MAX_GROUPS} that a draw can hold")]
    TooManyGaussians {
        /// The number of groups that it would take.
        groups: u64,
    },
    /// A vertex program ran for too long.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// The pixels whose centres lie in the viewport.
fn viewport_pixels(viewport: &Viewport) -> Rect {
    let span = |start: f32, size: f32| {
        let (start, end) = (f64::from(start), f64::from(start) + f64::from(size));
        let first = libm::ceil(start - 0.5);
        let last = libm::ceil(end - 0.5);
        (first as i32, (last - first).max(0.0) as u32)
    };
    let (x, width) = span(viewport.x, viewport.width);
    let (y, height) = span(viewport.y, viewport.height);
    Rect { x, y, width, height }
}

/// The depths of a set's centres, as an attachment of `format` holds them.
fn center_depth(begin: &GaussianBegin, format: Format) -> CenterDepth {
    let negative_one_to_one = begin.state.negative_one_to_one;
    CenterDepth::new(&begin.camera, &begin.viewport, negative_one_to_one, format)
}

impl GaussianSet {
    /// Starts a set that may touch the pixels of `area` which lie in its scissor and its viewport. `depth` is the
    /// depth attachment's format, if there is one.
    pub fn begin(begin: &GaussianBegin, area: Rect, depth: Option<Format>) -> Self {
        let visible = area.intersect(begin.scissor).intersect(viewport_pixels(&begin.viewport));
        Self {
            begin: begin.clone(),
            layer: 0,
            bounds: visible,
            depth: depth
                .filter(|_| begin.state.depth_stencil.depth.is_some())
                .map(|format| center_depth(begin, format)),
            depth_format: depth.unwrap_or(Format::D32Sfloat),
            fragment_stage: None,
            appends: Vec::new(),
            beyond_buffers: 0,
            draws: Vec::new(),
        }
    }

    /// Starts the set that is drawn to `layer`, with the camera of the pass's view number `view`.
    pub fn begin_view(begin: &GaussianBegin, view: usize, layer: u32, area: Rect, depth: Option<Format>) -> Self {
        let own = view.checked_sub(1);
        let camera = own.and_then(|number| begin.further_cameras.get(number));
        let begin = GaussianBegin {
            camera: camera.copied().unwrap_or(begin.camera),
            further_cameras: Vec::new(),
            ..begin.clone()
        };
        Self { layer, ..Self::begin(&begin, area, depth) }
    }

    /// Adds the Gaussians of a packet to the set, except those [beyond its buffers](GaussianAppend::within_buffers).
    pub fn append(&mut self, append: &GaussianAppend) {
        let within = append.within_buffers();
        self.beyond_buffers = self.beyond_buffers.saturating_add(append.gaussians() - within.gaussians());
        if within.gaussians() > 0 {
            host::push(&mut self.appends, within);
        }
    }

    /// Lets a fragment program compute the colours of the set's fragments.
    pub fn shade_fragments(&mut self, fragment_stage: &GaussianFragmentStage) {
        if fragment_stage.program.reads_depth() {
            self.depth = Some(center_depth(&self.begin, self.depth_format));
        }
        self.fragment_stage = Some(fragment_stage.clone());
    }

    /// Adds Gaussians that a vertex program projects.
    pub fn append_draw(&mut self, draw: &Draw) {
        if draw.count > 0 && draw.instance_count > 0 {
            host::push(&mut self.draws, draw.clone());
        }
    }

    /// The number of groups of the set's Gaussians, where an instance has groups of its own unless it [is small](is_packed).
    pub(crate) fn groups(&self) -> u64 {
        let of_draw = |count: u32, instance_count: u32| {
            let per_instance = count.div_ceil(GROUP as u32);
            u64::from(per_instance) * u64::from(instance_count)
        };
        let appends = self.appends.iter().map(|append| match is_packed(append.count) {
            true => (u64::from(append.count) * u64::from(append.instance_count)).div_ceil(GROUP as u64),
            false => of_draw(append.count, append.instance_count),
        });
        let draws = self.draws.iter().map(|draw| of_draw(draw.count, draw.instance_count));
        appends.chain(draws).fold(0, u64::saturating_add)
    }

    /// True if a fragment program reads indices of Gaussians, or depth variables.
    pub(crate) fn is_tracked(&self) -> bool {
        let stage = self.fragment_stage.as_ref();
        stage.is_some_and(|stage| stage.program.is_tracking())
    }

    /// True if the set is of 2D Gaussians.
    pub(crate) fn has_surfels(&self) -> bool {
        self.begin.state.geometry == GaussianGeometry::Surfel
    }
}
