//! The current render pass: draws are gathered, and rendered macro-tile by macro-tile when it is flushed.
//!
//! Every macro-tile is rendered by one worker that runs all draws in submission order against its tile buffers, so
//! that the image depends neither on the number of workers nor on when the pass is flushed.

use crate::counters::{Counter, Counters};
use crate::device::{Device, FlushPolicy};
use crate::format::Format;
use crate::gaussian::GaussianDraw;
use crate::geometry::PrimitiveDraw;
use crate::packet::{
    Aspect, Attachment, AttachmentClear, BlendState, ClearAttachments, LoadOp, Rect, Rendering,
    StoreOp,
};
use crate::raster::TILE_SIZE;
use crate::raster::blend::Blender;
use crate::raster::gaussian::GaussianTile;
use crate::raster::tile::{AttachmentError, Plane, Target, Tile, fill_rect};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// A draw that waits in a pass.
#[derive(Debug)]
pub enum PassDraw {
    /// Rectangles of attachments to clear.
    Clear(ClearAttachments),
    /// A sorted and binned set of Gaussians.
    Gaussians(GaussianDraw),
    /// Points, lines or triangles.
    Primitives(PrimitiveDraw),
}

impl PassDraw {
    /// Bytes of host memory that it holds while it waits.
    fn memory_bytes(&self) -> u64 {
        match self {
            Self::Clear(clear) => (size_of_val(&*clear.clears) + size_of_val(&*clear.rects)) as u64,
            Self::Gaussians(draw) => draw.memory_bytes(),
            Self::Primitives(draw) => draw.memory_bytes(),
        }
    }
}

/// A render pass between its beginning and its end.
#[derive(Debug)]
pub struct Pass {
    area: Rect,
    layer_count: u32,
    color: Vec<Option<Target>>,
    depth: Option<Target>,
    stencil: Option<Target>,
    draws: Vec<PassDraw>,
    bin_bytes: u64,
}

impl Pass {
    /// Starts a pass.
    ///
    /// # Errors
    /// [`AttachmentError`] if an attachment cannot be rendered to.
    pub fn begin(rendering: &Rendering) -> Result<Self, AttachmentError> {
        let target = |attachment: &Option<Attachment>, aspect| {
            attachment
                .as_ref()
                .map(|attachment| bind(attachment, aspect, rendering.layer_count))
                .transpose()
        };
        let mut pass = Self {
            area: rendering.area,
            layer_count: rendering.layer_count.max(1),
            color: rendering
                .color
                .iter()
                .map(|attachment| target(attachment, Aspect::Color))
                .collect::<Result<_, _>>()?,
            depth: target(&rendering.depth, Aspect::Depth)?,
            stencil: target(&rendering.stencil, Aspect::Stencil)?,
            draws: Vec::new(),
            bin_bytes: 0,
        };
        let (mut extent, mut layers) = ([0; 2], 0);
        for (number, target) in pass.targets().enumerate() {
            let [width, height] = target.extent();
            // Without attachments there is nothing to render; the smallest one bounds the others.
            if number == 0 {
                (extent, layers) = ([width, height], target.layer_count());
            }
            extent = [extent[0].min(width), extent[1].min(height)];
            layers = layers.min(target.layer_count());
        }
        let [width, height] = extent;
        pass.area = pass.area.intersect(Rect {
            x: 0,
            y: 0,
            width,
            height,
        });
        pass.layer_count = pass.layer_count.min(layers);
        Ok(pass)
    }

    /// The pixels that it may touch: its area, within all of its attachments.
    pub fn area(&self) -> Rect {
        self.area
    }

    /// How many layers are rendered.
    pub fn layer_count(&self) -> u32 {
        self.layer_count
    }

    /// The depth attachment's format, if there is one.
    pub fn depth_format(&self) -> Option<Format> {
        self.depth.as_ref().map(Target::format)
    }

    /// Adds a draw, and flushes the pass if the policy says so.
    pub fn push(&mut self, draw: PassDraw, device: &Device, counters: &mut Counters) {
        self.bin_bytes = self.bin_bytes.saturating_add(draw.memory_bytes());
        self.draws.push(draw);
        let config = device.config();
        let full = match config.flush {
            FlushPolicy::WhenFull => self.bin_bytes > config.bin_budget_bytes,
            FlushPolicy::EveryDraw => true,
        };
        if full {
            self.flush(device, counters);
        }
    }

    /// Renders all draws that wait, and stores the attachments.
    pub fn flush(&mut self, device: &Device, counters: &mut Counters) {
        self.render(device, counters, false);
    }

    /// Renders all draws that wait, and stores the attachments that are to be stored.
    pub fn end(mut self, device: &Device, counters: &mut Counters) {
        self.render(device, counters, true);
    }

    fn targets(&self) -> impl Iterator<Item = &Target> {
        let rest = [&self.depth, &self.stencil];
        self.color.iter().chain(rest).flatten()
    }

    fn targets_mut(&mut self) -> impl Iterator<Item = &mut Target> {
        let rest = [&mut self.depth, &mut self.stencil];
        self.color.iter_mut().chain(rest).flatten()
    }

    fn render(&mut self, device: &Device, counters: &mut Counters, last: bool) {
        let pending = self.targets().any(|target| target.clear.is_some());
        if !self.area.is_empty() && (pending || !self.draws.is_empty()) {
            let started = Instant::now();
            for work in self.render_macro_tiles(device, last) {
                counters.add_all(&work);
            }
            for target in self.targets() {
                target.bump_generation();
            }
            let elapsed = started.elapsed().as_nanos() as u64;
            counters.add(Counter::RasterTime, elapsed);
        }
        // From now on the attachments' memory holds what the pass has made of them.
        for target in self.targets_mut() {
            target.clear = None;
        }
        self.draws.clear();
        self.bin_bytes = 0;
    }

    /// Renders all macro-tiles, each by whichever worker is free; returns what every worker counted.
    fn render_macro_tiles(&self, device: &Device, last: bool) -> Vec<Counters> {
        let size = device.config().macro_tile_size;
        // The area begins at or after the framebuffer's corner.
        let range = |start: i32, length: u32| {
            let start = start as u32;
            start / size..(start + length).div_ceil(size)
        };
        let columns = range(self.area.x, self.area.width);
        let rows = range(self.area.y, self.area.height);
        let (width, height) = (columns.len() as u64, rows.len() as u64);
        let count = width * height * u64::from(self.layer_count);
        let frame = Frame {
            pass: self,
            device,
            last,
            blenders: self.blenders(),
        };
        let next = AtomicU64::new(0);
        let work = || {
            let mut worker = Worker::new(self, size);
            loop {
                let job = next.fetch_add(1, Ordering::Relaxed);
                if job >= count {
                    return worker.counters;
                }
                let (layer, place) = (job / (width * height), job % (width * height));
                let at = [
                    columns.start + (place % width) as u32,
                    rows.start + (place / width) as u32,
                ];
                frame.render_macro_tile(&mut worker, layer as u32, at);
            }
        };
        device.install(|| rayon::broadcast(|_| work()))
    }

    /// How each waiting draw blends into the first colour attachment, if it does.
    fn blenders(&self) -> Vec<Option<Blender>> {
        const REPLACE: BlendState = BlendState {
            equations: None,
            write_mask: 0xF,
        };
        let format = self
            .color
            .first()
            .and_then(Option::as_ref)
            .map(Target::format);
        let blender = |draw: &PassDraw| match draw {
            PassDraw::Clear(_) => None,
            PassDraw::Gaussians(draw) => {
                // A draw's floating-point colours mean nothing to an integer attachment.
                let format = format.filter(|format: &Format| !format.is_integer())?;
                let state = draw.state.blend.first().unwrap_or(&REPLACE);
                let blender = Blender::new(state, draw.state.blend_constants, format);
                (!blender.writes_nothing()).then_some(blender)
            }
            PassDraw::Primitives(_) => None,
        };
        self.draws.iter().map(blender).collect()
    }
}

/// Prepares an attachment's aspect.
fn bind(
    attachment: &Attachment,
    aspect: Aspect,
    layer_count: u32,
) -> Result<Target, AttachmentError> {
    let view = &attachment.view;
    let mut target = Target::new(view, aspect, layer_count, attachment.store)?;
    target.clear = match attachment.load {
        LoadOp::Load | LoadOp::DontCare => None,
        LoadOp::Clear(value) => Some(view.format.encode_clear(aspect, value)),
    };
    Ok(target)
}

/// What a worker keeps from one macro-tile to the next.
struct Worker {
    color: Vec<Plane<[f32; 4]>>,
    depth: Plane<f32>,
    stencil: Plane<u8>,
    gaussians: GaussianTile,
    counters: Counters,
}

impl Worker {
    fn new(pass: &Pass, size: u32) -> Self {
        let size_if = |present: bool| if present { size } else { 0 };
        Self {
            color: pass
                .color
                .iter()
                .map(|target| Plane::new(size_if(target.is_some())))
                .collect(),
            depth: Plane::new(size_if(pass.depth.is_some())),
            stencil: Plane::new(size_if(pass.stencil.is_some())),
            gaussians: GaussianTile::default(),
            counters: Counters::default(),
        }
    }
}

/// What the workers of a flush share.
struct Frame<'a> {
    pass: &'a Pass,
    device: &'a Device,
    /// Whether the pass ends, so that only what is to be stored is kept.
    last: bool,
    blenders: Vec<Option<Blender>>,
}

impl Frame<'_> {
    /// Runs all draws in one macro-tile, then stores its tiles.
    fn render_macro_tile(&self, worker: &mut Worker, layer: u32, at: [u32; 2]) {
        let pass = self.pass;
        let size = self.device.config().macro_tile_size;
        let tiles = || Tile::of_macro_tile(size, at, pass.area);
        for (draw, blender) in pass.draws.iter().zip(&self.blenders) {
            match draw {
                PassDraw::Clear(clear) => {
                    tiles().for_each(|tile| self.clear(worker, clear, layer, &tile));
                }
                // Only clears reach layers beyond the first: nothing else says which layer it is drawn to.
                PassDraw::Gaussians(draw) => {
                    if let Some(blender) = blender.as_ref().filter(|_| layer == 0) {
                        tiles().for_each(|tile| self.gaussians(worker, draw, blender, &tile));
                    }
                }
                PassDraw::Primitives(_) => {}
            }
        }
        let keep = |target: &Target| !self.last || target.store == StoreOp::Store;
        for tile in tiles() {
            for (plane, target) in worker.color.iter_mut().zip(&pass.color) {
                if let Some(target) = target {
                    plane.finish(target, layer, &tile, keep(target));
                }
            }
            if let Some(target) = &pass.depth {
                worker.depth.finish(target, layer, &tile, keep(target));
            }
            if let Some(target) = &pass.stencil {
                worker.stencil.finish(target, layer, &tile, keep(target));
            }
        }
    }

    /// Clears what lies in one tile.
    fn clear(&self, worker: &mut Worker, clear: &ClearAttachments, layer: u32, tile: &Tile) {
        let pass = self.pass;
        for &(rect, first_layer, layers) in &clear.rects {
            let in_layers = layer
                .checked_sub(first_layer)
                .is_some_and(|index| index < layers);
            if !in_layers || tile.pixels.intersect(rect).is_empty() {
                continue;
            }
            for clear in &clear.clears {
                match *clear {
                    AttachmentClear::Color { index, value } => {
                        let target = pass.color.get(index).and_then(Option::as_ref);
                        if let (Some(target), Some(plane)) = (target, worker.color.get_mut(index)) {
                            let format = target.format();
                            let texel = format.decode(&format.encode_clear(Aspect::Color, value));
                            fill_rect(plane.touch(target, layer, tile), tile, rect, texel);
                        }
                    }
                    AttachmentClear::Depth(depth) => {
                        if let Some(target) = &pass.depth {
                            let format = target.format();
                            let [depth, ..] = format.decode(&format.encode([depth, 0.0, 0.0, 0.0]));
                            let texels = worker.depth.touch(target, layer, tile);
                            fill_rect(texels, tile, rect, depth);
                        }
                    }
                    AttachmentClear::Stencil(stencil) => {
                        if let Some(target) = &pass.stencil {
                            let texels = worker.stencil.touch(target, layer, tile);
                            fill_rect(texels, tile, rect, stencil as u8);
                        }
                    }
                }
            }
        }
    }

    /// Renders what a Gaussian draw covers of one tile, and blends it into the first colour attachment.
    fn gaussians(&self, worker: &mut Worker, draw: &GaussianDraw, blender: &Blender, tile: &Tile) {
        let (Some(Some(target)), Some(plane)) = (self.pass.color.first(), worker.color.first_mut())
        else {
            return;
        };
        if !draw.touches(tile.pixels) {
            return;
        }
        let [x, y] = tile.at;
        let (fragments, counters) = (&mut worker.gaussians, &mut worker.counters);
        if !fragments.render(draw, self.device.level(), x, y, counters) {
            return;
        }
        let texels = plane.touch(target, 0, tile);
        for (y, columns) in tile.rows(draw.bounds) {
            let row = &mut texels[y * TILE_SIZE as usize..][columns.clone()];
            blender.blend_row(row, columns.map(|x| fragments.pixel(x, y)));
        }
    }
}
