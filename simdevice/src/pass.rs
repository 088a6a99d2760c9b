//! The current render pass. It gathers draws, and renders them macro-tile by macro-tile when it is flushed.
//!
//! One worker renders a macro-tile: it runs all draws in submission order against its tile buffers. The image therefore
//! depends neither on the number of workers nor on the moments at which the pass is flushed.

use crate::format::{Aspect, ClearValue, Format};
use crate::gaussian::BinnedDraw;
use crate::geometry::PrimitiveDraw;
use crate::limits::{MAX_FRAMEBUFFER_LAYERS, MAX_FRAMEBUFFER_SIZE};
use crate::packet::{Attachment, AttachmentClear, AttachmentResolve, ClearAttachments, LoadOp, Rendering, StoreOp};
use crate::raster::gaussian::GaussianTile;
use crate::raster::gaussian::GaussianTileDraw;
use crate::raster::output::{Buffers, Targets};
use crate::raster::tile::Tile;
use crate::raster::tile_buffer::{AttachmentError, Target, TileBuffer};
use crate::raster::triangle::{self, MacroTile, Scratch, TriangleTileDraw};
use crate::runtime::{FlushPolicy, Runtime};
use crate::state::{Rect, ResolveMode};
use crate::stats::counters::{Counter, Counters};
use crate::stats::optimizations::Optimization;
use devmem::host;
use isa::machine::Stopped;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// A draw that waits in a pass to be rendered.
#[derive(Debug)]
pub enum PassDraw {
    /// Rectangles of attachments to clear.
    Clear(ClearAttachments),
    /// A sorted and binned set of Gaussians.
    Gaussians(Box<BinnedDraw>),
    /// Points, lines or triangles.
    Primitives(Box<PrimitiveDraw>),
}

impl PassDraw {
    /// The host memory that it occupies while it waits, in bytes.
    fn memory_bytes(&self) -> u64 {
        match self {
            Self::Clear(clear) => (size_of_val(&*clear.clears) + size_of_val(&*clear.rects)) as u64,
            Self::Gaussians(draw) => draw.memory_bytes(),
            Self::Primitives(draw) => draw.memory_bytes(),
        }
    }
}

/// The targets that attachments are resolved to at the end of the pass.
#[derive(Debug, Default)]
struct Resolves {
    color: Vec<Option<Resolve>>,
    depth: Option<Resolve>,
    stencil: Option<Resolve>,
}

/// The resolve of an attachment's aspect.
#[derive(Debug)]
struct Resolve {
    target: Target,
    mode: ResolveMode,
}

/// A render pass between its beginning and its end.
#[derive(Debug)]
pub struct Pass {
    area: Rect,
    layer_count: u32,
    /// The layers that are views, one bit each; 0 if none is.
    view_mask: u32,
    color: Vec<Option<Target>>,
    depth: Option<Target>,
    stencil: Option<Target>,
    /// The targets that the attachments are resolved to.
    resolve: Resolves,
    /// The samples per pixel of the attachments, if there are any attachments.
    samples: Option<u32>,
    draws: Vec<PassDraw>,
    /// The number of draws so far, including those that were flushed.
    pushed: u64,
    bin_bytes: u64,
}

/// True if [`FlushPolicy::SomeDraws`] flushes after this draw: after about one draw in three, pseudo-randomly.
fn flushes(seed: u64, draw: u64) -> bool {
    // Multiplication by an odd constant carries low bits into high bits.
    let mixed = (seed ^ draw.wrapping_mul(0x9E37_79B9_7F4A_7C15)).wrapping_mul(0xD134_2543_DE82_EF95);
    (mixed >> 32).is_multiple_of(3)
}

impl Pass {
    /// Starts a pass.
    ///
    /// # Errors
    /// [`AttachmentError`] if an attachment cannot be rendered to.
    pub fn begin(rendering: &Rendering) -> Result<Self, AttachmentError> {
        let target = |attachment: &Option<Attachment>, aspect| {
            attachment.as_ref().map(|attachment| bind(attachment, aspect, rendering.layer_count)).transpose()
        };
        let resolve = |attachment: &Option<Attachment>, aspect| {
            let Some(attachment) = attachment else { return Ok(None) };
            match (attachment.multisampled, &attachment.resolve) {
                (Some(multisampled), _) => bind_own(attachment, multisampled.mode, aspect, rendering),
                (None, Some(resolve)) => bind_resolve(attachment, resolve, aspect, rendering).map(Some),
                (None, None) => Ok(None),
            }
        };
        let mut pass = Self {
            area: rendering.area,
            layer_count: rendering.layer_count.max(1),
            view_mask: rendering.view_mask,
            color: rendering
                .color
                .iter()
                .map(|attachment| target(attachment, Aspect::Color))
                .collect::<Result<_, _>>()?,
            depth: target(&rendering.depth, Aspect::Depth)?,
            stencil: target(&rendering.stencil, Aspect::Stencil)?,
            resolve: Resolves {
                color: rendering
                    .color
                    .iter()
                    .map(|attachment| resolve(attachment, Aspect::Color))
                    .collect::<Result<_, _>>()?,
                depth: resolve(&rendering.depth, Aspect::Depth)?,
                stencil: resolve(&rendering.stencil, Aspect::Stencil)?,
            },
            samples: None,
            draws: Vec::new(),
            pushed: 0,
            bin_bytes: 0,
        };
        // The smallest attachment limits the pass. Without attachments, the area and the layers of `rendering` do.
        let (mut extent, mut layers) = ([MAX_FRAMEBUFFER_SIZE; 2], MAX_FRAMEBUFFER_LAYERS);
        let mut samples = None;
        for target in pass.targets() {
            let [width, height] = target.extent();
            extent = [extent[0].min(width), extent[1].min(height)];
            layers = layers.min(target.layer_count());
            if samples.is_some_and(|samples| samples != target.samples()) {
                return Err(AttachmentError::Samples(target.samples()));
            }
            samples = Some(target.samples());
        }
        for target in pass.resolve_targets() {
            let [width, height] = target.extent();
            extent = [extent[0].min(width), extent[1].min(height)];
            layers = layers.min(target.layer_count());
        }
        pass.samples = samples;
        let [width, height] = extent;
        pass.area = pass.area.intersect(Rect { x: 0, y: 0, width, height });
        pass.layer_count = pass.layer_count.min(layers);
        Ok(pass)
    }

    /// The pixels that the pass may change: its area, cut at the smallest attachment.
    pub fn area(&self) -> Rect {
        self.area
    }

    /// The number of layers that are rendered.
    pub fn layer_count(&self) -> u32 {
        self.layer_count
    }

    /// The layers of the views that every draw is rendered to; a single `None` if there are no views, so that draws
    /// name their layers.
    pub fn views(&self) -> impl Iterator<Item = Option<u32>> + use<> {
        let mask = self.view_mask;
        let views = (0..u32::BITS).filter(move |view| mask & (1 << view) != 0);
        let none = (mask == 0).then_some(None);
        none.into_iter().chain(views.map(Some))
    }

    /// True if a layer is rendered. Without views every layer is.
    fn renders(&self, layer: u32) -> bool {
        self.view_mask == 0 || 1u32.checked_shl(layer).unwrap_or(0) & self.view_mask != 0
    }

    /// The depth attachment's format, if there is one.
    pub fn depth_format(&self) -> Option<Format> {
        self.depth.as_ref().map(Target::format)
    }

    /// Adds a draw, and flushes the pass if the policy says so.
    ///
    /// # Errors
    /// As [`Pass::flush`].
    pub fn push(&mut self, draw: PassDraw, runtime: &Runtime, counters: &mut Counters) -> Result<(), Stopped> {
        self.bin_bytes = self.bin_bytes.saturating_add(draw.memory_bytes());
        host::push(&mut self.draws, draw);
        self.pushed += 1;
        let config = runtime.config();
        let full = match config.flush {
            FlushPolicy::WhenFull => self.bin_bytes > config.bin_budget_bytes,
            FlushPolicy::EveryDraw => true,
            FlushPolicy::SomeDraws(seed) => flushes(seed, self.pushed),
        };
        if full {
            self.flush(runtime, counters)?;
        }
        Ok(())
    }

    /// Renders all draws that wait, and stores the attachments.
    ///
    /// # Errors
    /// [`Stopped`] if a fragment program ran for too long. The image is then undefined.
    pub fn flush(&mut self, runtime: &Runtime, counters: &mut Counters) -> Result<(), Stopped> {
        self.render(runtime, counters, false)
    }

    /// Renders all draws that wait, then stores and resolves the attachments by their operations.
    ///
    /// # Errors
    /// As [`Pass::flush`].
    pub fn end(mut self, runtime: &Runtime, counters: &mut Counters) -> Result<(), Stopped> {
        self.render(runtime, counters, true)
    }

    fn resolve_targets(&self) -> impl Iterator<Item = &Target> {
        let rest = [&self.resolve.depth, &self.resolve.stencil];
        let all = self.resolve.color.iter().chain(rest).flatten();
        all.map(|resolve| &resolve.target)
    }

    fn targets(&self) -> impl Iterator<Item = &Target> {
        let rest = [&self.depth, &self.stencil];
        self.color.iter().chain(rest).flatten()
    }

    fn targets_mut(&mut self) -> impl Iterator<Item = &mut Target> {
        let rest = [&mut self.depth, &mut self.stencil];
        self.color.iter_mut().chain(rest).flatten()
    }

    fn render(&mut self, runtime: &Runtime, counters: &mut Counters, last: bool) -> Result<(), Stopped> {
        let pending =
            self.targets().any(|target| target.clear.is_some()) || last && self.resolve_targets().next().is_some();
        let mut done = Ok(());
        if !self.area.is_empty() && (pending || !self.draws.is_empty()) {
            let started = Instant::now();
            done = self.render_macro_tiles(runtime, counters, last);
            for target in self.targets().chain(self.resolve_targets()) {
                target.bump_generation();
            }
            let elapsed = started.elapsed().as_nanos() as u64;
            counters.add(Counter::RasterTime, elapsed);
        }
        // The memory of the attachments now holds the cleared and drawn pixels, so that nothing is cleared again.
        for target in self.targets_mut() {
            target.clear = None;
            target.initial = None;
        }
        self.draws.clear();
        self.bin_bytes = 0;
        done
    }

    /// Renders all macro-tiles. Each is rendered by the next free worker.
    fn render_macro_tiles(&self, runtime: &Runtime, counters: &mut Counters, last: bool) -> Result<(), Stopped> {
        let size = runtime.config().macro_tile_size;
        // The area's corner is not negative.
        let range = |start: i32, length: u32| {
            let start = start as u32;
            start / size..(start + length).div_ceil(size)
        };
        let columns = range(self.area.x, self.area.width);
        let rows = range(self.area.y, self.area.height);
        let (width, height) = (columns.len() as u64, rows.len() as u64);
        let count = width * height * u64::from(self.layer_count);
        let flush =
            Flush { pass: self, runtime, last, draws: self.tile_draws(runtime), cancel: AtomicBool::new(false) };
        let (workers, done) = runtime.share(
            0..count,
            1,
            &flush.cancel,
            || Worker::new(self, size),
            |worker, task| {
                let (layer, place) = (task / (width * height), task % (width * height));
                let at = [columns.start + (place % width) as u32, rows.start + (place / width) as u32];
                flush.render_macro_tile(worker, layer as u32, at)
            },
        );
        for worker in &workers {
            counters.add_all(&worker.counters);
        }
        for draw in &flush.draws {
            match draw {
                Ready::Primitives(draw) => draw.finish(),
                Ready::Gaussians(draw) => draw.finish(),
                Ready::Nothing | Ready::Clear(_) => {}
            }
        }
        done
    }

    /// The waiting draws, prepared for tiles.
    fn tile_draws<'a>(&'a self, runtime: &Runtime) -> Vec<Ready<'a>> {
        let targets = Targets { color: &self.color, depth: self.depth.as_ref(), stencil: self.stencil.as_ref() };
        let ready = |draw: &'a PassDraw| match draw {
            PassDraw::Clear(clear) => Ready::Clear(clear),
            PassDraw::Gaussians(draw) => {
                Ready::Gaussians(Box::new(GaussianTileDraw::new(draw, targets, self.samples, runtime)))
            }
            PassDraw::Primitives(draw) if draw.segments.is_empty() => Ready::Nothing,
            PassDraw::Primitives(draw) => {
                Ready::Primitives(Box::new(TriangleTileDraw::new(draw, targets, self.samples, self.area, runtime)))
            }
        };
        host::collect(self.draws.iter().map(ready))
    }
}

/// A draw that is prepared for tiles.
enum Ready<'a> {
    /// A draw that changes nothing.
    Nothing,
    Clear(&'a ClearAttachments),
    Gaussians(Box<GaussianTileDraw<'a>>),
    Primitives(Box<TriangleTileDraw<'a>>),
}

/// Prepares the target that an attachment's aspect is resolved to.
fn bind_resolve(
    attachment: &Attachment,
    resolve: &AttachmentResolve,
    aspect: Aspect,
    rendering: &Rendering,
) -> Result<Resolve, AttachmentError> {
    let view = &resolve.view;
    let target = Target::new(view, aspect, rendering.layer_count, StoreOp::Store)?;
    let of = attachment.view.format.plane(aspect);
    if of.map(Format::texel_size) != Some(target.format().texel_size()) {
        return Err(AttachmentError::Format(view.format));
    }
    if target.samples() != 1 {
        return Err(AttachmentError::Samples(target.samples()));
    }
    Ok(Resolve { target, mode: resolve.mode })
}

/// Prepares the resolve of an attachment with several samples during the pass alone to its own view, if that is stored.
fn bind_own(
    attachment: &Attachment,
    mode: ResolveMode,
    aspect: Aspect,
    rendering: &Rendering,
) -> Result<Option<Resolve>, AttachmentError> {
    if attachment.store != StoreOp::Store {
        return Ok(None);
    }
    let target = Target::new(&attachment.view, aspect, rendering.layer_count, StoreOp::Store)?;
    Ok(Some(Resolve { target, mode }))
}

/// Prepares an attachment's aspect.
fn bind(attachment: &Attachment, aspect: Aspect, layer_count: u32) -> Result<Target, AttachmentError> {
    let view = &attachment.view;
    let mut target = Target::new(view, aspect, layer_count, attachment.store)?;
    if let Some(multisampled) = attachment.multisampled {
        let single = target;
        if single.samples() != 1 {
            return Err(AttachmentError::Samples(single.samples()));
        }
        target = single.with_samples(multisampled.samples)?;
        target.initial = (attachment.load == LoadOp::Load).then(|| Box::new(single));
    }
    target.clear = match attachment.load {
        LoadOp::Load | LoadOp::DontCare => None,
        LoadOp::Clear(value) => Some(view.format.encode_clear(aspect, value)),
    };
    Ok(target)
}

/// The state that a worker keeps from one macro-tile to the next.
struct Worker {
    buffers: Buffers,
    /// Made for the first draw of Gaussians.
    gaussians: Option<Box<GaussianTile>>,
    scratch: Scratch,
    counters: Counters,
}

impl Worker {
    fn new(pass: &Pass, size: u32) -> Self {
        Self {
            buffers: Buffers {
                color: pass.color.iter().map(|target| TileBuffer::new(size, target.as_ref())).collect(),
                depth: TileBuffer::new(size, pass.depth.as_ref()),
                stencil: TileBuffer::new(size, pass.stencil.as_ref()),
            },
            gaussians: None,
            scratch: Scratch::default(),
            counters: Counters::default(),
        }
    }
}

/// The data that the workers of a flush share.
struct Flush<'a> {
    pass: &'a Pass,
    runtime: &'a Runtime,
    /// True if the pass ends, so that only attachments with [`StoreOp::Store`] are stored.
    last: bool,
    draws: Vec<Ready<'a>>,
    /// Set when a program was stopped.
    cancel: AtomicBool,
}

impl Flush<'_> {
    /// Runs all draws in one macro-tile, then stores the macro-tile's tiles.
    fn render_macro_tile(&self, worker: &mut Worker, layer: u32, at: [u32; 2]) -> Result<(), Stopped> {
        let pass = self.pass;
        if !pass.renders(layer) {
            return Ok(());
        }
        let size = self.runtime.config().macro_tile_size;
        let tiles = || Tile::of_macro_tile(size, at, pass.area);
        for draw in &self.draws {
            match draw {
                Ready::Nothing => {}
                Ready::Clear(clear) => {
                    tiles().for_each(|tile| self.clear(worker, clear, layer, &tile));
                }
                Ready::Gaussians(draw) if layer == draw.layer() => {
                    let buffers = &mut worker.buffers;
                    let gaussian_tile = worker.gaussians.get_or_insert_default();
                    for tile in tiles() {
                        let counters = &mut worker.counters;
                        draw.render(&tile, buffers, gaussian_tile, counters, &self.cancel)?;
                    }
                }
                Ready::Gaussians(_) => {}
                Ready::Primitives(draw) => triangle::render(
                    draw,
                    MacroTile { layer, at, size },
                    &mut worker.buffers,
                    &mut worker.scratch,
                    &mut worker.counters,
                    &self.cancel,
                )?,
            }
        }
        if !self.runtime.config().optimizations.has(Optimization::EmptyTiles) {
            tiles().for_each(|tile| self.load_all(worker, layer, &tile));
        }
        for tile in tiles() {
            self.finish(worker, layer, &tile);
        }
        Ok(())
    }

    /// Loads or clears the planes of a tile that no draw has touched.
    fn load_all(&self, worker: &mut Worker, layer: u32, tile: &Tile) {
        let (pass, buffers) = (self.pass, &mut worker.buffers);
        let colors = buffers.color.iter_mut().zip(&pass.color);
        let rest = [(&mut buffers.depth, &pass.depth), (&mut buffers.stencil, &pass.stencil)];
        for (plane, target) in colors.chain(rest) {
            if let Some(target) = target {
                plane.load_or_clear(target, layer, tile);
            }
        }
    }

    /// Resolves and stores a tile.
    fn finish(&self, worker: &mut Worker, layer: u32, tile: &Tile) {
        let (pass, buffers) = (self.pass, &mut worker.buffers);
        let colors = pass.color.iter().zip(&pass.resolve.color);
        let planes = buffers.color.iter_mut().zip(colors);
        let planes = planes.map(|(plane, (target, resolve))| (plane, target.as_ref(), resolve.as_ref())).chain([
            (&mut buffers.depth, pass.depth.as_ref(), pass.resolve.depth.as_ref()),
            (&mut buffers.stencil, pass.stencil.as_ref(), pass.resolve.stencil.as_ref()),
        ]);
        for (plane, target, resolve) in planes {
            let Some(target) = target else { continue };
            let untouched = !plane.is_touched(tile.index);
            worker.counters.add(Counter::TilesUntouched, untouched.into());
            if let Some(resolve) = resolve.filter(|_| self.last) {
                plane.load_or_clear(target, layer, tile);
                let level = self.runtime.level();
                plane.resolve(level, target, &resolve.target, resolve.mode, layer, tile);
            }
            let keep = !self.last || target.store == StoreOp::Store;
            plane.finish(target, layer, tile, keep);
        }
    }

    /// Clears the rectangles of a clear within one tile.
    fn clear(&self, worker: &mut Worker, clear: &ClearAttachments, layer: u32, tile: &Tile) {
        let pass = self.pass;
        for &(rect, first_layer, layers) in &clear.rects {
            // In a pass with views, a clear applies to all of them.
            let in_layers = pass.view_mask != 0 || layer.checked_sub(first_layer).is_some_and(|index| index < layers);
            if !in_layers || tile.pixels.intersect(rect).is_empty() {
                continue;
            }
            let buffers = &mut worker.buffers;
            for clear in &clear.clears {
                let (target, plane, aspect, value) = match *clear {
                    AttachmentClear::Color { index, value } => {
                        let target = pass.color.get(index).and_then(Option::as_ref);
                        (target, buffers.color.get_mut(index), Aspect::Color, value)
                    }
                    AttachmentClear::Depth(depth) => {
                        let value = ClearValue::DepthStencil { depth, stencil: 0 };
                        let plane = Some(&mut buffers.depth);
                        (pass.depth.as_ref(), plane, Aspect::Depth, value)
                    }
                    AttachmentClear::Stencil(stencil) => {
                        let value = ClearValue::DepthStencil { depth: 0.0, stencil };
                        let plane = Some(&mut buffers.stencil);
                        (pass.stencil.as_ref(), plane, Aspect::Stencil, value)
                    }
                };
                if let (Some(target), Some(plane)) = (target, plane) {
                    let format = target.format();
                    plane.load_or_clear(target, layer, tile);
                    plane.fill_rect(format, tile, rect, &format.encode_clear(aspect, value));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[gaurast_runner::test]
    fn without_attachments_there_are_as_many_layers_as_a_framebuffer_may_have() {
        let rendering = |layer_count| Rendering {
            area: Rect { x: 0, y: 0, width: 40, height: 30 },
            layer_count,
            view_mask: 0,
            color: Vec::new(),
            depth: None,
            stencil: None,
        };
        for (asked, given) in [(0, 1), (3, 3), (u32::MAX, MAX_FRAMEBUFFER_LAYERS)] {
            let pass = Pass::begin(&rendering(asked)).unwrap();
            assert_eq!(pass.layer_count(), given);
        }
    }
}
