//! Gaussians as blended quads, as a Vulkan application draws them on a device that has only triangles, for example a
//! software device. Benchmarks compare [`Renderer`](gaurast_render::Renderer) with it.
//!
//! In each frame, the processor projects the Gaussians that may be visible, sorts them by depth and writes them to a
//! buffer. The device draws an oriented quad for each, from back to front. A quad ends where alpha reaches its floor.
//! Projection is in binary32. Saturated pixels are still blended.

mod pipeline;
mod project;
mod sort;

use std::sync::Arc;
use std::time::{Duration, Instant};

use ash::vk;
use rayon::prelude::*;

use gaurast_picture::Picture;
use gaurast_render::device::{Device, Purpose};
use gaurast_render::process_stats::processor_time;
use gaurast_render::resource::{Buffer, CommandBuffers, Memory};
use gaurast_render::{Counter, DeviceOptions, Frame, RenderError, Target, check_size, record_copy};
use gaurast_scene::Scene;
use gaurast_scene::camera::Camera;
use thiserror::Error;

use pipeline::{Push, QuadPipeline};
use project::{Projection, Splat};

/// Gaussians that a thread projects at once.
const CHUNK: usize = 4096;

/// Corners of a quad, and the indices of its two triangles.
const CORNERS: u32 = 4;
const QUAD: [u32; 6] = [0, 1, 2, 2, 1, 3];

/// A failure of drawing quads.
#[derive(Debug, Error)]
pub enum QuadError {
    /// The device failed, or there is none.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The Vulkan loader is missing.
    #[error("there is no Vulkan loader: {0}")]
    NoLoader(String),
    /// Threads could not be started.
    #[error("cannot start threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// Draws scenes with quads on any Vulkan 1.3 device.
pub struct QuadRenderer {
    pool: rayon::ThreadPool,
    pairs: [Vec<(u32, u32)>; 2],
    buffers: Option<Buffers>,
    target: Option<Target>,
    pipeline: QuadPipeline,
    commands: CommandBuffers<1>,
    device: Arc<Device>,
}

/// Buffers for a number of quads.
struct Buffers {
    splats: Buffer,
    indices: Buffer,
}

impl QuadRenderer {
    /// A renderer on the first device of `entry` whose name contains `device_name`. The projection uses `threads`
    /// threads; 0 means one for each processor.
    ///
    /// # Errors
    /// If there is no such device, or Vulkan fails.
    pub fn new(entry: ash::Entry, device_name: &str, threads: usize) -> Result<Self, QuadError> {
        Self::with_options(entry, device_name, threads, &DeviceOptions::default())
    }

    /// A renderer as [`QuadRenderer::new`] makes it, with options of the device.
    ///
    /// # Errors
    /// As [`QuadRenderer::new`]; also for an option that the driver refuses.
    pub fn with_options(
        entry: ash::Entry,
        device_name: &str,
        threads: usize,
        options: &DeviceOptions,
    ) -> Result<Self, QuadError> {
        let device = Arc::new(Device::new(entry, Purpose::Triangles(device_name), options)?);
        Ok(Self {
            pool: rayon::ThreadPoolBuilder::new().num_threads(threads).build()?,
            pairs: [Vec::new(), Vec::new()],
            buffers: None,
            target: None,
            pipeline: QuadPipeline::new(&device)?,
            commands: CommandBuffers::new(&device)?,
            device,
        })
    }

    /// A renderer as [`QuadRenderer::new`] makes it, on a device of the system's Vulkan loader.
    ///
    /// # Errors
    /// If there is no loader, no such device, or Vulkan fails.
    pub fn through_the_loader(device_name: &str, threads: usize) -> Result<Self, QuadError> {
        // SAFETY: the system's loader is sound.
        let entry = unsafe { ash::Entry::load() }.map_err(|error| QuadError::NoLoader(error.to_string()))?;
        Self::new(entry, device_name, threads)
    }

    /// The device's name.
    pub fn device_name(&self) -> &str {
        self.device.name()
    }

    /// Draws `scene` as `camera` sees it, with colours of degree `sh_degree` at most (and 3), where alpha is at least
    /// `alpha_floor` (1/255 in 3DGS).
    ///
    /// The frame's counters are the times of its steps; the frame's time is their sum.
    ///
    /// # Errors
    /// If the picture's size is not within the device's limits, or Vulkan fails.
    pub fn render(
        &mut self,
        scene: &Scene,
        camera: &Camera,
        sh_degree: u32,
        alpha_floor: f32,
    ) -> Result<Frame, QuadError> {
        let start = processor_time();
        let mut prepared = self.prepare(scene, camera, sh_degree, alpha_floor)?;
        prepared.draw()?;
        let processor = start.and_then(|start| Some(processor_time()? - start));
        let picture = prepared.picture()?;
        let Steps { sum, counters, .. } = prepared.steps;
        Ok(Frame { picture, time: sum, processor_time: processor, counters, depth: None, gaussians: None })
    }

    /// Does the processor's part of [`QuadRenderer::render`]: the sorted quads are in the buffers afterwards.
    ///
    /// # Errors
    /// As [`QuadRenderer::render`].
    pub fn prepare(
        &mut self,
        scene: &Scene,
        camera: &Camera,
        sh_degree: u32,
        alpha_floor: f32,
    ) -> Result<Prepared<'_>, QuadError> {
        let (width, height) = (camera.width, camera.height);
        check_size(&self.device, width, height)?;
        let target = match self.target.take() {
            Some(target) if target.image.extent() == vk::Extent2D { width, height } => target,
            _ => Target::new(&self.device, width, height)?,
        };
        let target = self.target.insert(target);

        let mut steps = Steps::start();
        let projection = Projection::new(camera, sh_degree, alpha_floor);
        let splats = self.pool.install(|| project_all(&projection, scene));
        steps.end("project");

        let [pairs, scratch] = &mut self.pairs;
        pairs.clear();
        // From back to front. Depths are positive, so their bits sort as the depths do.
        pairs.extend(splats.iter().zip(0..).map(|((depth, _), i)| (!depth.to_bits(), i)));
        sort::sort(pairs, scratch);
        steps.end("sort");

        let buffers = match self.buffers.take() {
            Some(buffers) if buffers.capacity() >= pairs.len() => buffers,
            _ => {
                let buffers = Buffers::new(&self.device, pairs.len())?;
                self.pipeline.pull_from(&buffers.splats);
                buffers
            }
        };
        let buffers = self.buffers.insert(buffers);
        buffers.splats.fill(pairs.len(), |places| {
            self.pool.install(|| {
                places.par_chunks_mut(CHUNK).zip(pairs.par_chunks(CHUNK)).for_each(|(places, pairs)| {
                    for (place, pair) in places.iter_mut().zip(pairs) {
                        place.write(splats[pair.1 as usize].1);
                    }
                });
            });
        })?;
        steps.end("write");
        Ok(Prepared {
            count: pairs.len() as u32,
            push: [2.0 / width as f32, 2.0 / height as f32, alpha_floor],
            steps,
            target,
            buffers,
            pipeline: &self.pipeline,
            commands: &mut self.commands,
            device: &self.device,
        })
    }
}

/// Quads in buffers, which can be drawn any number of times.
pub struct Prepared<'a> {
    count: u32,
    push: Push,
    steps: Steps,
    target: &'a Target,
    buffers: &'a Buffers,
    pipeline: &'a QuadPipeline,
    commands: &'a mut CommandBuffers<1>,
    device: &'a Device,
}

impl Prepared<'_> {
    /// Draws the quads and copies the picture to the host.
    ///
    /// # Errors
    /// If Vulkan fails.
    pub fn draw(&mut self) -> Result<(), QuadError> {
        self.commands.record(0, |_, commands| {
            record_draw(self.device, self.pipeline, commands, self.target, self.buffers, (self.count, self.push));
            record_copy(self.device, commands, self.target);
        })?;
        self.commands.submit_and_wait(&[0])?;
        self.steps.end("draw");
        Ok(())
    }

    /// The picture that was drawn last.
    ///
    /// # Errors
    /// If Vulkan fails.
    pub fn picture(&self) -> Result<Picture, QuadError> {
        let vk::Extent2D { width, height } = self.target.image.extent();
        let mut pixels = vec![[0.0; 4]; width as usize * height as usize];
        self.target.readback.read(&mut pixels)?;
        Ok(Picture { width, height, pixels })
    }
}

/// The Gaussians that may be visible, in the scene's order.
fn project_all(projection: &Projection, scene: &Scene) -> Vec<(f32, Splat)> {
    let chunks: Vec<Vec<(f32, Splat)>> = (0..scene.len().div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let first = chunk * CHUNK;
            (first..scene.len().min(first + CHUNK)).filter_map(|index| projection.splat(scene, index)).collect()
        })
        .collect();
    chunks.concat()
}

/// The times of a frame's steps.
struct Steps {
    since: Instant,
    sum: Duration,
    counters: Vec<Counter>,
}

impl Steps {
    fn start() -> Self {
        Self { since: Instant::now(), sum: Duration::ZERO, counters: Vec::new() }
    }

    fn end(&mut self, name: &str) {
        let time = self.since.elapsed();
        self.sum += time;
        self.counters.push(Counter {
            category: "time".to_owned(),
            name: name.to_owned(),
            description: String::new(),
            unit: vk::PerformanceCounterUnitKHR::NANOSECONDS,
            value: time.as_nanos() as f64,
        });
        self.since = Instant::now();
    }
}

impl Buffers {
    /// Buffers for `count` quads and a reserve, since the camera moves.
    fn new(device: &Arc<Device>, count: usize) -> Result<Self, RenderError> {
        use vk::BufferUsageFlags as Usage;
        let capacity = (count + count / 4).max(1024) as u32;
        let buffer = |size, usage| Buffer::new(device, u64::from(capacity) * size, usage, Memory::Host);
        let splats = buffer(size_of::<Splat>() as u64, Usage::STORAGE_BUFFER)?;
        let indices = buffer(size_of_val(&QUAD) as u64, Usage::INDEX_BUFFER)?;
        indices.fill::<[u32; 6]>(capacity as usize, |quads| {
            for (quad, first) in quads.iter_mut().zip((0..).step_by(CORNERS as usize)) {
                quad.write(QUAD.map(|corner| first + corner));
            }
        })?;
        Ok(Self { splats, indices })
    }

    fn capacity(&self) -> usize {
        self.splats.size() as usize / size_of::<Splat>()
    }
}

/// Clears the target to zero and draws the first quads into it.
fn record_draw(
    device: &Device,
    pipeline: &QuadPipeline,
    commands: vk::CommandBuffer,
    target: &Target,
    buffers: &Buffers,
    (count, push): (u32, Push),
) {
    let area = vk::Rect2D::default().extent(target.image.extent());
    let viewport =
        vk::Viewport::default().width(area.extent.width as f32).height(area.extent.height as f32).max_depth(1.0);
    let attachments = [vk::RenderingAttachmentInfo::default()
        .image_view(target.image.view())
        .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)];
    let rendering = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&attachments);
    let to_attachment = target
        .image
        .barrier(vk::ImageLayout::UNDEFINED, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
        .dst_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE);
    let raw = device.raw();
    // SAFETY: the command buffer is recording; image, pipeline and buffers belong to the same
    // device and live until the submission has ended; the indices are those of the quads that
    // were written before.
    unsafe {
        raw.cmd_pipeline_barrier(
            commands,
            vk::PipelineStageFlags::TRANSFER,
            vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT,
            vk::DependencyFlags::empty(),
            &[],
            &[],
            &[to_attachment],
        );
        raw.cmd_begin_rendering(commands, &rendering);
        pipeline.bind(commands, &push);
        raw.cmd_bind_index_buffer(commands, buffers.indices.handle(), 0, vk::IndexType::UINT32);
        raw.cmd_set_viewport(commands, 0, &[viewport]);
        raw.cmd_set_scissor(commands, 0, &[area]);
        raw.cmd_draw_indexed(commands, count * QUAD.len() as u32, 1, 0, 0, 0);
        raw.cmd_end_rendering(commands);
    }
}
