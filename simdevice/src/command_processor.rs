//! The command processor: executes packets in order, by one match over [`Packet`].

use crate::compute;
use crate::device::Device;
use crate::gaussian::{self, GaussianSet, SortError};
use crate::geometry::{FrontEnd, Surface};
use crate::hardware_model::HardwareModel;
use crate::packet::{Draw, Packet};
use crate::pass::{Pass, PassDraw};
use crate::raster::tile_buffer::AttachmentError;
use crate::raster::triangle::recording;
use crate::stats::counters::{Counter, Counters};
use crate::stats::query::{QueryKind, host_time};
use crate::stats::recorder::{DrawRecord, Owner};
use crate::transfer::{self, Direction};
use devmem::host::{self, OutOfMemory};
use isa::machine::Stopped;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// The reasons why a packet could not be executed. Unless the reason says otherwise, nothing of the packet was done. A
/// Gaussian set or a pass that the packet would have ended has ended. The command processor can still be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ExecutionError {
    /// The packet belongs in a render pass.
    #[error("there is no render pass")]
    OutsidePass,
    /// The packet belongs outside of render passes.
    #[error("a render pass has not ended")]
    InsidePass,
    /// The packet belongs between the beginning and the end of a sorted set of Gaussians.
    #[error("no set of Gaussians was begun")]
    NoGaussianSet,
    /// The packet belongs outside of sorted sets of Gaussians.
    #[error("a set of Gaussians was not resolved")]
    GaussianSetOpen,
    /// An attachment cannot be rendered to.
    #[error(transparent)]
    Attachment(#[from] AttachmentError),
    /// A set is too large.
    #[error(transparent)]
    TooManyGaussians(SortError),
    /// A program ran for too long. The memory that it wrote until then stays written.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The host has no memory for what the packet asks for. The effect of the packet is undefined, so that no further
    /// packet may be executed.
    #[error(transparent)]
    OutOfMemory(#[from] OutOfMemory),
}

impl From<SortError> for ExecutionError {
    fn from(why: SortError) -> Self {
        match why {
            SortError::TooManyGaussians { .. } => Self::TooManyGaussians(why),
            SortError::Stopped(stopped) => stopped.into(),
        }
    }
}

/// Executes packets in order. Dropping it in the middle of a pass drops the draws that were not flushed.
#[derive(Debug)]
pub struct CommandProcessor {
    device: Arc<Device>,
    /// The number under which the recorder keeps its work.
    owner: Owner,
    counters: Counters,
    pass: Option<Pass>,
    /// The set of Gaussians that was begun and has not ended, once for each view.
    gaussians: Vec<GaussianSet>,
    /// The number of active queries of fragments.
    fragment_queries: u32,
    model: HardwareModel,
}

impl CommandProcessor {
    /// Makes a command processor outside of any pass, with all counters at zero.
    pub fn new(device: Arc<Device>) -> Self {
        static OWNERS: AtomicU64 = AtomicU64::new(0);
        let owner = OWNERS.fetch_add(1, Relaxed);
        Self {
            device,
            owner,
            counters: Counters::default(),
            pass: None,
            gaussians: Vec::new(),
            fragment_queries: 0,
            model: HardwareModel::new(owner),
        }
    }

    /// The values of its counters so far.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// True if a render pass has begun and not ended.
    pub fn in_pass(&self) -> bool {
        self.pass.is_some()
    }

    /// Drops a render pass, a set of Gaussians and queries that were begun and not ended. Draws that were not flushed
    /// are lost.
    pub fn reset(&mut self) {
        self.pass = None;
        self.gaussians.clear();
        self.fragment_queries = 0;
    }

    /// Executes one packet.
    ///
    /// # Errors
    /// [`ExecutionError`] if the packet does not fit what came before, or asks for too much.
    pub fn execute(&mut self, packet: &Packet) -> Result<(), ExecutionError> {
        host::catch(|| self.try_execute(packet))?
    }

    /// Executes a packet as [`CommandProcessor::execute`] does, but unwinds if the host has no memory.
    fn try_execute(&mut self, packet: &Packet) -> Result<(), ExecutionError> {
        match packet {
            Packet::CopyBuffer(copy) => self.transfer(|| transfer::copy_buffer(copy)),
            Packet::CopyBufferToImage(copy) => self.transfer(|| {
                transfer::copy_buffer_image(copy, Direction::ToImage, self.device.runtime());
            }),
            Packet::CopyImageToBuffer(copy) => self.transfer(|| {
                transfer::copy_buffer_image(copy, Direction::ToBuffer, self.device.runtime());
            }),
            Packet::CopyImage(copy) => self.transfer(|| transfer::copy_image(copy)),
            Packet::BlitImage(blit) => self.transfer(|| transfer::blit_image(blit)),
            Packet::ResolveImage(resolve) => self.transfer(|| transfer::resolve_image(resolve)),
            Packet::FillBuffer { target, word } => self.transfer(|| transfer::fill_buffer(target, *word)),
            Packet::UpdateBuffer { target, data } => self.transfer(|| transfer::update_buffer(target, data)),
            Packet::ClearImage(clear) => self.transfer(|| transfer::clear_image(clear)),
            Packet::BeginRendering(rendering) => {
                if self.pass.is_some() {
                    return Err(ExecutionError::InsidePass);
                }
                let pass = Pass::begin(rendering)?;
                if let Some(recorder) = self.device.runtime().recorder() {
                    recorder.begin_frame(self.owner, pass.area());
                }
                self.pass = Some(pass);
                Ok(())
            }
            Packet::ClearAttachments(clear) => self.draw(PassDraw::Clear(clear.clone())),
            Packet::GaussianBegin(begin) => {
                let pass = self.pass.as_ref().ok_or(ExecutionError::OutsidePass)?;
                self.outside_gaussian_set()?;
                let (area, depth) = (pass.area(), pass.depth_format());
                let views = pass.views().enumerate();
                self.gaussians = views
                    .map(|(number, view)| {
                        let layer = view.unwrap_or(0);
                        GaussianSet::begin_view(begin, number, layer, area, depth)
                    })
                    .collect();
                Ok(())
            }
            Packet::GaussianAppend(append) => {
                let sets = self.gaussian_set()?;
                sets.iter_mut().for_each(|set| set.append(append));
                Ok(())
            }
            Packet::GaussianAppendDraw(draw) => {
                let sets = self.gaussian_set()?;
                sets.iter_mut().for_each(|set| set.append_draw(draw));
                Ok(())
            }
            Packet::GaussianFragmentStage(fragment_stage) => {
                let sets = self.gaussian_set()?;
                sets.iter_mut().for_each(|set| set.shade_fragments(fragment_stage));
                Ok(())
            }
            Packet::GaussianEnd => {
                let sets = std::mem::take(self.gaussian_set()?);
                sets.into_iter().try_for_each(|set| self.gaussians(set))
            }
            Packet::Dispatch(dispatch) => {
                if self.pass.is_some() {
                    return Err(ExecutionError::InsidePass);
                }
                let recorder = self.device.runtime().recorder();
                let before = recorder.map(|_| self.counters.clone());
                compute::dispatch(dispatch, self.device.runtime(), &mut self.counters)?;
                if let (Some(recorder), Some(before)) = (recorder, before) {
                    recorder.add_dispatch(self.owner, &self.counters.since(&before));
                }
                Ok(())
            }
            Packet::Draw(draw) => self.primitives(draw),
            Packet::Barrier => self.flush(),
            Packet::EndRendering => {
                let pass = self.pass.take().ok_or(ExecutionError::OutsidePass)?;
                if !std::mem::take(&mut self.gaussians).is_empty() {
                    return Err(ExecutionError::GaussianSetOpen);
                }
                pass.end(self.device.runtime(), &mut self.counters)?;
                self.model.account(self.device.runtime(), &mut self.counters, None);
                Ok(())
            }
            // A query measures the work that was done, so draws that wait are rendered first.
            Packet::BeginQuery { pool, index } => {
                self.flush()?;
                if pool.kind() == QueryKind::Simulated {
                    let area = self.pass.as_ref().map(Pass::area);
                    self.model.begin(self.device.runtime(), &mut self.counters, area);
                }
                if pool.kind() == QueryKind::Fragments {
                    self.fragment_queries += 1;
                }
                pool.begin(*index, &self.counters);
                Ok(())
            }
            Packet::EndQuery { pool, index } => {
                self.flush()?;
                if pool.kind() == QueryKind::Simulated {
                    let area = self.pass.as_ref().map(Pass::area);
                    self.model.end(self.device.runtime(), &mut self.counters, area);
                }
                if pool.kind() == QueryKind::Fragments {
                    self.fragment_queries = self.fragment_queries.saturating_sub(1);
                }
                pool.end(*index, &self.counters);
                // In a pass with views, the first query has the result for all views; the queries of the other views
                // have zeros.
                for further in self.further_views() {
                    let index = index.saturating_add(further);
                    pool.begin(index, &self.counters);
                    pool.end(index, &self.counters);
                }
                Ok(())
            }
            Packet::BeginTransformFeedback { feedback, counters } => {
                feedback.begin(counters);
                Ok(())
            }
            Packet::EndTransformFeedback { feedback, counters } => {
                feedback.end(counters);
                Ok(())
            }
            Packet::ResetQueries { pool, first, count } => {
                pool.reset(*first, *count);
                Ok(())
            }
            Packet::WriteTimestamp { pool, index } => {
                self.flush()?;
                let now = self.now();
                pool.write_timestamp(*index, now);
                for further in self.further_views() {
                    pool.write_timestamp(index.saturating_add(further), now);
                }
                Ok(())
            }
        }
    }

    fn outside_gaussian_set(&self) -> Result<(), ExecutionError> {
        match self.gaussians.is_empty() {
            true => Ok(()),
            false => Err(ExecutionError::GaussianSetOpen),
        }
    }

    /// The set that was begun, once for each view.
    fn gaussian_set(&mut self) -> Result<&mut Vec<GaussianSet>, ExecutionError> {
        match self.gaussians.is_empty() {
            true => Err(ExecutionError::NoGaussianSet),
            false => Ok(&mut self.gaussians),
        }
    }

    /// Sorts and bins one view's set of Gaussians and adds it to the pass.
    fn gaussians(&mut self, set: GaussianSet) -> Result<(), ExecutionError> {
        let draw = gaussian::sort_and_bin(set, self.device.runtime(), self.device.caches(), &mut self.counters)?;
        let recorder = self.device.runtime().recorder();
        if let Some((recorder, record)) = recorder.zip(draw.record.as_ref()) {
            recorder.add_draw(self.owner, record);
        }
        self.draw(PassDraw::Gaussians(Box::new(draw)))
    }

    /// Runs `work`, or fails if it would run inside a render pass.
    fn transfer(&self, work: impl FnOnce()) -> Result<(), ExecutionError> {
        if self.pass.is_some() {
            return Err(ExecutionError::InsidePass);
        }
        work();
        Ok(())
    }

    /// Adds a draw to the pass.
    fn draw(&mut self, draw: PassDraw) -> Result<(), ExecutionError> {
        let pass = self.pass.as_mut().ok_or(ExecutionError::OutsidePass)?;
        Ok(pass.push(draw, self.device.runtime(), &mut self.counters)?)
    }

    /// The numbers, from 1, of the pass's views after the first; empty without views.
    fn further_views(&self) -> std::ops::Range<u32> {
        let views = self.pass.as_ref().map_or(1, |pass| pass.views().count());
        1..views as u32
    }

    /// Draws points, lines or triangles, view by view.
    fn primitives(&mut self, draw: &Draw) -> Result<(), ExecutionError> {
        let pass = self.pass.as_ref().ok_or(ExecutionError::OutsidePass)?;
        for view in pass.views() {
            self.primitives_of_view(draw, view)?;
        }
        Ok(())
    }

    /// Draws points, lines or triangles to one view, or without views to the layers that the vertices name. The front
    /// end yields the draw in parts.
    fn primitives_of_view(&mut self, draw: &Draw, view: Option<u32>) -> Result<(), ExecutionError> {
        let pass = self.pass.as_ref().ok_or(ExecutionError::OutsidePass)?;
        let surface = Surface { area: pass.area(), layers: pass.layer_count(), view, depth: pass.depth_format() };
        let device = Arc::clone(&self.device);
        let recorder = device.runtime().recorder();
        let record = recorder.map(|recorder| {
            let record = DrawRecord::new(recording::no_primitives());
            recorder.add_draw(self.owner, &record);
            record
        });
        let mut before = recorder.map(|_| self.counters.clone());
        let mut front = FrontEnd::new(draw, surface, device.runtime(), &mut self.counters);
        while let Some(mut part) = front.next_segments(&mut self.counters)? {
            if let (Some(record), Some(before)) = (&record, &before) {
                recording::add_front_end(record, &self.counters.since(before), draw, &part);
            }
            part.record = record.clone();
            part.counts_fragments = self.fragment_queries > 0;
            self.draw(PassDraw::Primitives(Box::new(part)))?;
            before = recorder.map(|_| self.counters.clone());
        }
        Ok(())
    }

    /// The time that a timestamp holds, in nanoseconds: the host's, or the simulated hardware's if the device is
    /// configured so.
    fn now(&mut self) -> u64 {
        if !self.device.runtime().config().simulated_timestamps {
            return host_time();
        }
        let area = self.pass.as_ref().map(Pass::area);
        self.model.account(self.device.runtime(), &mut self.counters, area);
        self.counters.get(Counter::SimulatedTime)
    }

    /// Renders the draws that wait in the pass, if there is one.
    fn flush(&mut self) -> Result<(), ExecutionError> {
        if let Some(pass) = &mut self.pass {
            pass.flush(self.device.runtime(), &mut self.counters)?;
        }
        Ok(())
    }
}
