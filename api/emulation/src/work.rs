//! The work of a sorted set: parameters for the kernels, and their dispatches.

use std::sync::Arc;

use ash::vk;

use crate::kernels::{Kernel, Kernels, PUSHED};
use crate::next::Next;
use crate::pipeline::{Attribute, Pipeline};
use crate::scratch::{Extent, Memory, Places};

/// Width and height of a tile.
const TILE: u32 = 16;

/// A draw, as `shaders/set.glsl` has it.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Draw {
    pub(crate) indices: u64,
    pub(crate) index_bytes: u32,
    pub(crate) index_count: u32,
    pub(crate) first: u32,
    pub(crate) count: u32,
    pub(crate) vertex_offset: i32,
    pub(crate) first_instance: u32,
    pub(crate) instances: u32,
    pub(crate) base: u32,
    pub(crate) indirect_index: u32,
    pub(crate) is_indexed: u32,
    pub(crate) parameters: u64,
    pub(crate) draw_count: u64,
    pub(crate) harmonics: u64,
    pub(crate) harmonics_bytes: u32,
    pub(crate) harmonics_format: u32,
    pub(crate) harmonics_stride: u32,
    pub(crate) harmonics_coefficient_stride: u32,
}

/// A vertex buffer of a draw, as `shaders/set.glsl` has it.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct DrawSource {
    pub(crate) address: u64,
    pub(crate) bytes: u32,
    pub(crate) stride: u32,
    pub(crate) divisor: u32,
    pub(crate) unused: u32,
}

/// A camera: `VkGaussianCameraDataGAURAST`.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Camera {
    pub(crate) eye: [f64; 3],
    pub(crate) model: i32,
    pub(crate) reserved: i32,
    pub(crate) rotation: [[f32; 4]; 3],
    pub(crate) focal_length: [f32; 2],
    pub(crate) principal_point: [f32; 2],
    pub(crate) depth_coefficients: [f32; 2],
    pub(crate) near_plane: f32,
    pub(crate) far_plane: f32,
    pub(crate) unused: [u32; 4],
}

/// The parameters of a set, as `shaders/set.glsl` has them.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Parameters {
    counters: u64,
    keys: u64,
    values: u64,
    pair_keys: u64,
    pair_values: u64,
    histogram: u64,
    sums: u64,
    counts: u64,
    ranges: u64,
    records: u64,
    image: u64,
    feedback: u64,
    draws: u64,
    sources: u64,
    cameras: u64,
    derived: u64,
    area_origin: [i32; 2],
    area_size: [u32; 2],
    viewport: [f32; 4],
    tiles: [u32; 2],
    reserve: u32,
    pair_capacity: u32,
    draw_count: u32,
    source_count: u32,
    camera_count: u32,
    degree: u32,
    order: u32,
    compensated: u32,
    cut_off: u32,
    flags: u32,
    low_pass: f32,
    alpha_floor: f32,
    alpha_ceiling: f32,
    transmittance_floor: f32,
    compensation_floor: f32,
    cut_off_deviations: f32,
    unused: [u32; 2],
    attributes: [Attribute; 33],
    padding: u32,
}

/// The push constants of kernels.
#[derive(Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Pushed {
    set: u64,
    view: u32,
    sort: u32,
    shift: u32,
    is_first: u32,
    side: u32,
    /// The view's first pixel.
    plane: u32,
}

const _: () = assert!(size_of::<Pushed>() == PUSHED as usize);

/// The numbers of a pipeline that may be dynamic, as they are at the set's first draw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Values {
    pub(crate) order: u32,
    pub(crate) is_compensated: bool,
    pub(crate) low_pass: f32,
    pub(crate) alpha_floor: f32,
    pub(crate) alpha_ceiling: f32,
    pub(crate) transmittance_floor: f32,
    pub(crate) degree: u32,
}

/// The source of cameras.
#[derive(Clone, Debug)]
pub(crate) enum Cameras {
    Command(Vec<Camera>),
    /// A descriptor set with its dynamic offsets.
    Buffer(vk::DescriptorSet, Vec<u32>),
}

/// The part of the framebuffer that a set may reach.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Area {
    pub(crate) origin: [i32; 2],
    pub(crate) size: [u32; 2],
}

/// A set whose draws are known.
#[derive(Clone)]
pub(crate) struct Work {
    pub(crate) pipeline: Arc<Pipeline>,
    pub(crate) values: Values,
    pub(crate) cameras: Cameras,
    /// x, y, width and height; not negative.
    pub(crate) viewport: [f32; 4],
    pub(crate) area: Area,
    pub(crate) draws: Vec<Draw>,
    pub(crate) sources: Vec<DrawSource>,
    /// The most Gaussians.
    pub(crate) gaussians: u64,
    /// Pixels in memory of their own, where they are shown by another command buffer.
    pub(crate) pixels: Option<Arc<Memory>>,
}

/// Places of dispatches' sizes in the counters, as `shaders/set.glsl` has them.
#[derive(Clone, Copy)]
enum Groups {
    ByGaussian = 4,
    SortGaussians = 7,
    ScanGaussians = 10,
    BySeen = 13,
    SortSeen = 16,
    ScanSeen = 19,
    ScanCounts = 22,
    ByPair = 25,
    SortPairs = 28,
    ScanPairs = 31,
}

impl Work {
    pub(crate) fn tiles(&self) -> [u32; 2] {
        self.area.size.map(|size| size.div_ceil(TILE))
    }

    /// Bytes of the pixels of all views.
    pub(crate) fn pixel_bytes(&self) -> u64 {
        16 * u64::from(self.area.size[0]) * u64::from(self.area.size[1]) * u64::from(self.pipeline.planes())
    }

    fn camera_count(&self) -> u32 {
        match &self.cameras {
            Cameras::Command(cameras) => cameras.len() as u32,
            Cameras::Buffer(..) => self.pipeline.camera_buffer.as_ref().map_or(0, |camera| camera.count),
        }
    }

    /// The sizes of the set's scratch. `pairs` is the most of them that any set has had.
    pub(crate) fn extent(&self, pairs: u64) -> Extent {
        let [across, down] = self.tiles().map(u64::from);
        // A guess that later frames correct: what does not fit is drawn slowly, not wrongly.
        let guess = (8 * self.gaussians + (1 << 20)).max(pairs + pairs / 4);
        let forced = std::env::var("GAURAST_EMULATION_PAIRS").ok().and_then(|value| value.parse().ok());
        Extent {
            gaussians: self.gaussians,
            pairs: forced.unwrap_or(guess).clamp(1, 1 << 27),
            tiles: across * down,
            parameters: size_of::<Parameters>() as u64,
            draws: size_of_val(self.draws.as_slice()) as u64,
            sources: size_of_val(self.sources.as_slice()).max(4) as u64,
            cameras: 128 * u64::from(self.camera_count().max(1)),
            pixels: if self.pixels.is_some() { 0 } else { self.pixel_bytes() },
        }
    }

    /// The address of the pixels.
    pub(crate) fn pixels_at(&self, scratch: &Memory, places: &Places) -> u64 {
        self.pixels.as_ref().map_or(scratch.address + places.pixels, |memory| memory.address)
    }

    fn parameters(&self, scratch: &Memory, places: &Places, extent: &Extent, feedback: u64) -> Parameters {
        let at = |place: u64| scratch.address + place;
        let pipeline = &self.pipeline;
        let flags = [(pipeline.has_matrix, 1), (pipeline.has_factor, 2), (pipeline.has_harmonics_buffer(), 4)];
        Parameters {
            counters: at(places.counters),
            keys: at(places.keys),
            values: at(places.values),
            pair_keys: at(places.pair_keys),
            pair_values: at(places.pair_values),
            histogram: at(places.histogram),
            sums: at(places.sums),
            counts: at(places.counts),
            ranges: at(places.ranges),
            records: at(places.records),
            image: self.pixels_at(scratch, places),
            feedback,
            draws: at(places.draws),
            sources: at(places.sources),
            cameras: at(places.cameras),
            derived: at(places.derived),
            area_origin: self.area.origin,
            area_size: self.area.size,
            viewport: self.viewport,
            tiles: self.tiles(),
            reserve: extent.gaussians as u32,
            pair_capacity: extent.pairs as u32,
            draw_count: self.draws.len() as u32,
            source_count: pipeline.sources.len() as u32,
            camera_count: self.camera_count(),
            degree: self.values.degree,
            order: self.values.order,
            compensated: u32::from(self.values.is_compensated),
            cut_off: pipeline.cut_off,
            flags: flags.iter().filter(|(is_set, _)| *is_set).map(|(_, flag)| flag).sum(),
            low_pass: self.values.low_pass,
            alpha_floor: self.values.alpha_floor,
            alpha_ceiling: self.values.alpha_ceiling,
            transmittance_floor: self.values.transmittance_floor,
            compensation_floor: pipeline.compensation_floor,
            cut_off_deviations: pipeline.cut_off_deviations,
            unused: [0; 2],
            attributes: pipeline.attributes,
            padding: 0,
        }
    }

    /// Records the set's dispatches, outside of a render pass.
    ///
    /// # Safety
    /// The command buffer is being recorded, and the scratch is as large as the places say.
    pub(crate) unsafe fn record(
        &self,
        next: &Next,
        kernels: &Kernels,
        commands: vk::CommandBuffer,
        scratch: &Memory,
        extent: &Extent,
    ) {
        let places = Places::of(extent);
        let parameters = self.parameters(scratch, &places, extent, kernels.feedback.address);
        let run = Run { next, kernels, commands, scratch, places };
        // SAFETY: the caller's promise, for all below.
        unsafe {
            run.barrier();
            run.write(places.parameters, bytemuck::bytes_of(&parameters));
            run.write(places.draws, bytemuck::cast_slice(&self.draws));
            run.write(places.sources, bytemuck::cast_slice(&self.sources));
            match &self.cameras {
                Cameras::Command(cameras) => run.write(places.cameras, bytemuck::cast_slice(cameras)),
                Cameras::Buffer(set, offsets) => self.copy_cameras(&run, *set, offsets),
            }
            for view in self.pipeline.views() {
                self.record_view(&run, view);
            }
            run.barrier();
        }
    }

    /// # Safety
    /// As [`Self::record`].
    unsafe fn copy_cameras(&self, run: &Run<'_>, set: vk::DescriptorSet, offsets: &[u32]) {
        let Some(camera) = &self.pipeline.camera_buffer else {
            return;
        };
        let pushed = Pushed { set: run.scratch.address + run.places.cameras, ..Pushed::default() };
        let compute = vk::PipelineBindPoint::COMPUTE;
        // SAFETY: the caller's promise.
        unsafe {
            let (next, commands) = (run.next, run.commands);
            next.cmd_bind_pipeline(commands, compute, camera.pipeline);
            next.cmd_bind_descriptor_sets(commands, compute, camera.layout, camera.set, &[set], offsets);
            let stages = vk::ShaderStageFlags::COMPUTE;
            next.cmd_push_constants(commands, camera.layout, stages, 0, bytemuck::bytes_of(&pushed));
            next.cmd_dispatch(commands, 1, 1, 1);
        }
    }

    /// # Safety
    /// As [`Self::record`].
    unsafe fn record_view(&self, run: &Run<'_>, view: u32) {
        let [across, down] = self.tiles();
        let tiles = across * down;
        let plane = view * self.area.size[0] * self.area.size[1];
        let pushed = Pushed { set: run.scratch.address + run.places.parameters, view, plane, ..Pushed::default() };
        // SAFETY: the caller's promise.
        unsafe {
            run.barrier();
            run.next.cmd_fill_buffer(run.commands, run.scratch.buffer, run.places.ranges, 8 * u64::from(tiles), 0);
            run.one(Kernel::Prepare, pushed);
            run.indirect(Kernel::Project, pushed, Groups::ByGaussian);
            // By depth: what is not seen falls out with the first digit.
            for digit in 0..4 {
                let is_first = u32::from(digit == 0);
                let pushed = Pushed { sort: 0, shift: 8 * digit, is_first, side: digit & 1, ..pushed };
                let (by, scan) = if digit == 0 {
                    (Groups::SortGaussians, Groups::ScanGaussians)
                } else {
                    (Groups::SortSeen, Groups::ScanSeen)
                };
                run.sort(pushed, by, scan);
            }
            run.indirect(Kernel::Count, pushed, Groups::BySeen);
            let counted = Pushed { sort: 2, ..pushed };
            run.indirect(Kernel::ScanBlocks, counted, Groups::ScanCounts);
            run.one(Kernel::ScanSums, counted);
            run.indirect(Kernel::Emit, pushed, Groups::BySeen);
            // By tile.
            let digits = (u32::BITS - (tiles - 1).leading_zeros()).div_ceil(8).max(1);
            for digit in 0..digits {
                let pushed = Pushed { sort: 1, shift: 8 * digit, is_first: 0, side: digit & 1, ..pushed };
                run.sort(pushed, Groups::SortPairs, Groups::ScanPairs);
            }
            let sorted = Pushed { side: digits & 1, ..pushed };
            run.indirect(Kernel::Ranges, sorted, Groups::ByPair);
            run.dispatch(Kernel::Raster, sorted, [across, down]);
        }
    }
}

/// The place in which dispatches are recorded.
struct Run<'a> {
    next: &'a Next,
    kernels: &'a Kernels,
    commands: vk::CommandBuffer,
    scratch: &'a Memory,
    places: Places,
}

impl Run<'_> {
    /// All that was written before is there for what follows.
    ///
    /// # Safety
    /// The command buffer is being recorded, outside of a render pass; here and below.
    unsafe fn barrier(&self) {
        // SAFETY: the caller's promise.
        unsafe { barrier(self.next, self.commands) };
    }

    /// Between kernels.
    unsafe fn kernel_barrier(&self) {
        use vk::AccessFlags as Access;
        use vk::PipelineStageFlags as Stages;
        let barriers = [vk::MemoryBarrier::default()
            .src_access_mask(Access::SHADER_WRITE | Access::TRANSFER_WRITE)
            .dst_access_mask(Access::SHADER_READ | Access::SHADER_WRITE | Access::INDIRECT_COMMAND_READ)];
        let (from, to) = (Stages::COMPUTE_SHADER | Stages::TRANSFER, Stages::COMPUTE_SHADER | Stages::DRAW_INDIRECT);
        let flags = vk::DependencyFlags::empty();
        // SAFETY: the caller's promise.
        unsafe { self.next.cmd_pipeline_barrier(self.commands, from, to, flags, &barriers, &[], &[]) };
    }

    /// Writes bytes to scratch; at most 65,536 by a command.
    unsafe fn write(&self, place: u64, bytes: &[u8]) {
        for (index, part) in bytes.chunks(65536).enumerate() {
            let at = place + 65536 * index as u64;
            // SAFETY: the caller's promise.
            unsafe { self.next.cmd_update_buffer(self.commands, self.scratch.buffer, at, part) };
        }
    }

    unsafe fn bind(&self, kernel: Kernel, pushed: Pushed) {
        let stages = vk::ShaderStageFlags::COMPUTE;
        // SAFETY: the caller's promise.
        unsafe {
            self.kernel_barrier();
            let pipeline = self.kernels.pipeline(kernel);
            self.next.cmd_bind_pipeline(self.commands, vk::PipelineBindPoint::COMPUTE, pipeline);
            let bytes = bytemuck::bytes_of(&pushed);
            self.next.cmd_push_constants(self.commands, self.kernels.layout, stages, 0, bytes);
        }
    }

    unsafe fn dispatch(&self, kernel: Kernel, pushed: Pushed, [x, y]: [u32; 2]) {
        // SAFETY: the caller's promise.
        unsafe {
            self.bind(kernel, pushed);
            self.next.cmd_dispatch(self.commands, x, y, 1);
        }
    }

    unsafe fn one(&self, kernel: Kernel, pushed: Pushed) {
        // SAFETY: the caller's promise.
        unsafe { self.dispatch(kernel, pushed, [1, 1]) };
    }

    unsafe fn indirect(&self, kernel: Kernel, pushed: Pushed, groups: Groups) {
        // SAFETY: the caller's promise.
        unsafe {
            self.bind(kernel, pushed);
            let at = self.places.counters + 4 * groups as u64;
            self.next.cmd_dispatch_indirect(self.commands, self.scratch.buffer, at);
        }
    }

    /// A digit of a sort.
    unsafe fn sort(&self, pushed: Pushed, by: Groups, scan: Groups) {
        // SAFETY: the caller's promise.
        unsafe {
            self.indirect(Kernel::Histogram, pushed, by);
            self.indirect(Kernel::ScanBlocks, pushed, scan);
            self.one(Kernel::ScanSums, pushed);
            self.indirect(Kernel::Scatter, pushed, by);
        }
    }
}

/// All that was written before is there for what follows.
///
/// # Safety
/// The command buffer is being recorded, outside of a render pass.
pub(crate) unsafe fn barrier(next: &Next, commands: vk::CommandBuffer) {
    let barriers = [vk::MemoryBarrier::default()
        .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
        .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)];
    let all = vk::PipelineStageFlags::ALL_COMMANDS;
    // SAFETY: the caller's promise.
    unsafe { next.cmd_pipeline_barrier(commands, all, all, vk::DependencyFlags::empty(), &barriers, &[], &[]) };
}
