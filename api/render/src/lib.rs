//! A headless renderer of scenes: an ordinary Vulkan application that draws with the Gaussian
//! primitive topology.
//!
//! ```no_run
//! use gaurast_render::Renderer;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scene = gaurast_scene::open("garden.ply")?;
//! let camera = gaurast_scene::frame(&scene, 50.0, [1280, 720]);
//! let mut renderer = Renderer::new(vulkan_gaurast::entry())?; // or ash::Entry::load()?
//! let picture = renderer.draw(&scene, &camera)?;
//! gaurast_picture::write("garden.png".as_ref(), &picture, None)?;
//! # Ok(())
//! # }
//! ```
//!
//! [`Renderer::upload`] and [`Renderer::render`] draw a scene many times. A picture made on the spot:
//!
//! ```
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let garden = gaurast_scene::garden::scene(1, 2000);
//! let camera = gaurast_scene::garden::camera(None, [64, 36])?;
//! let picture = gaurast_render::Renderer::new(vulkan_gaurast::entry())?.draw(&garden, &camera)?;
//! assert!(picture.pixels.iter().any(|[red, ..]| *red > 0.1));
//! # Ok(())
//! # }
//! ```

pub mod device;
mod draw;
mod modes;
mod pipeline;
pub mod process_stats;
mod query;
pub mod resource;

use std::sync::Arc;
use std::time::{Duration, Instant};

use ash::vk;
use thiserror::Error;

use device::{Device, Purpose};
use draw::{DepthScale, Recorder};
use gaurast::gaussian_primitive_topology;
use gaurast_picture::Picture;
use gaurast_scene::camera::{CameraError, Model};
use gaurast_scene::{Camera, GaussianShape, MAX_SH_DEGREE, Scene};
pub use modes::{Antialiasing, Geometry, Order, Precision};
use pipeline::{BINDINGS, GaussianPipeline};
use process_stats::processor_time;
pub use query::Counter;
use query::CounterQuery;
use resource::{Buffer, CommandBuffers, Image, Memory};
use serde::{Deserialize, Serialize};

/// Bytes that go to the device at once.
const STAGING: u64 = 64 << 20;

/// The colour attachment's format: what a draw leaves is kept as it is.
pub const COLOR_FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;

/// The format of the attachment of expected and median depths.
const DEPTHS_FORMAT: vk::Format = vk::Format::R32G32_SFLOAT;

/// Why rendering failed.
#[derive(Debug, Error)]
pub enum RenderError {
    /// A Vulkan call failed.
    #[error("{call} failed: {result}")]
    Vulkan {
        /// The call.
        call: &'static str,
        /// Its result.
        result: vk::Result,
    },
    /// No device draws Gaussians.
    #[error("no Vulkan device draws Gaussians (there is {found})")]
    NoDevice {
        /// The devices there are.
        found: String,
    },
    /// No device has the name that is wanted.
    #[error("no Vulkan device has \"{name}\" in its name and Vulkan 1.3 (there is {found})")]
    NoSuchDevice {
        /// The part of a name.
        name: String,
        /// The devices there are.
        found: String,
    },
    /// No memory type will do.
    #[error("the device has no {0} memory for a resource")]
    NoMemory(&'static str),
    /// The picture is too large or empty.
    #[error("a picture of {width}x{height} pixels is not within the device's 1x1 to {max}x{max}")]
    Size {
        /// The width in pixels.
        width: u32,
        /// The height in pixels.
        height: u32,
        /// The greatest width and height.
        max: u32,
    },
    /// The scene has more Gaussians than one draw takes.
    #[error("the scene has {count} Gaussians, and the device draws at most {max} at once")]
    TooMany {
        /// The scene's Gaussians.
        count: u64,
        /// The most in a draw.
        max: u64,
    },
    /// The camera cannot be drawn with.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The device doesn't draw modes together.
    #[error("{0}")]
    Combination(&'static str),
}

/// Names the call that a Vulkan error came from.
pub trait During<T> {
    /// The value, or the error with the name of the `call` that it came from.
    ///
    /// # Errors
    /// If the call failed.
    fn during(self, call: &'static str) -> Result<T, RenderError>;
}

impl<T> During<T> for ash::prelude::VkResult<T> {
    fn during(self, call: &'static str) -> Result<T, RenderError> {
        self.map_err(|result| RenderError::Vulkan { call, result })
    }
}

/// A device that draws Gaussians, and what it needs from frame to frame.
pub struct Renderer {
    query: Option<CounterQuery>,
    target: Option<Target>,
    commands: CommandBuffers<2>,
    gaussian: gaussian_primitive_topology::Device,
    device: Arc<Device>,
}

/// What a draw may save on: the pipeline's state as far as pictures are the better for it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Draw colours with spherical harmonics of at most this degree.
    pub sh_degree: u32,
    /// A Gaussian counts where its alpha is at least this.
    pub alpha_floor: f32,
    /// A pixel is finished before its transmittance would fall below this.
    pub transmittance_floor: f32,
    /// What Gaussians are sorted by.
    pub order: Order,
    /// What Gaussians are.
    pub geometry: Geometry,
    /// The rasterizer's arithmetic; binary16 is for volumes in another order than the pixels' own.
    pub precision: Precision,
    /// The greatest relative error of the exponential that alpha is made of.
    pub exponential_error: f32,
    /// What the contributions that are left out at a pixel may add up to.
    pub contribution_budget: f32,
    /// What becomes of Gaussians that are smaller than a pixel.
    pub antialiasing: Antialiasing,
    /// Keep depths, too: see [`Frame::depth`].
    pub depth: bool,
}

impl Default for Settings {
    /// 3DGS's, with all colour there is.
    fn default() -> Self {
        Self {
            sh_degree: MAX_SH_DEGREE,
            alpha_floor: 1.0 / 255.0,
            transmittance_floor: 1e-4,
            order: Order::Depth,
            geometry: Geometry::Volume,
            precision: Precision::Fp32,
            exponential_error: 0.0,
            contribution_budget: 0.0,
            antialiasing: Antialiasing::Dilate,
            depth: false,
        }
    }
}

impl Settings {
    /// Checks that the device draws these modes together, as `camera` sees it, and that the camera can be drawn with.
    ///
    /// # Errors
    /// [`RenderError::Combination`], or [`RenderError::Camera`].
    pub fn check(&self, camera: &Camera) -> Result<(), RenderError> {
        camera.check()?;
        let half = self.precision == Precision::Fp16;
        let surfels = self.geometry == Geometry::Surfel;
        let per_pixel = self.order == Order::PerPixel;
        let panorama = camera.model == Model::Equirectangular;
        let refused = [
            (
                surfels && half,
                "flat Gaussians (2d) are not drawn in binary16 (fp16)",
            ),
            (
                surfels && self.antialiasing == Antialiasing::Compensated,
                "flat Gaussians (2d) are not drawn with compensated opacity",
            ),
            (
                surfels && (panorama || camera.model == Model::Fisheye),
                "flat Gaussians (2d) are drawn by pinhole and orthographic cameras alone",
            ),
            (
                half && per_pixel,
                "binary16 (fp16) goes with an order of the whole draw, not with the order per-pixel",
            ),
            (
                half && panorama,
                "panoramas are not drawn in binary16 (fp16)",
            ),
            (self.depth && half, "depths are not kept in binary16 (fp16)"),
            (
                self.depth && per_pixel,
                "depths are not kept in the order per-pixel",
            ),
            (
                self.depth && camera.model == Model::Orthographic && camera.far.is_infinite(),
                "depths of an orthographic camera need a far plane",
            ),
        ];
        match refused.into_iter().find(|(refused, _)| *refused) {
            Some((_, sentence)) => Err(RenderError::Combination(sentence)),
            None => Ok(()),
        }
    }
}

/// A scene in device memory, with its pipeline.
pub struct DeviceScene {
    count: u32,
    strides: [u32; BINDINGS],
    stored_degree: u32,
    settings: Settings,
    pipeline: GaussianPipeline,
    /// One for each of [`BINDINGS`].
    buffers: [Buffer; BINDINGS],
}

/// A rendered picture and what it cost.
#[derive(Clone, Debug)]
pub struct Frame {
    /// (C, 1 - T) of every pixel, over nothing.
    pub picture: Picture,
    /// From the submission to its end, the copy to the host included.
    pub time: Duration,
    /// What all threads of the process spent meanwhile, if the system tells.
    pub processor_time: Option<Duration>,
    /// The device's counters of the draw, in its order; none if it has none.
    pub counters: Vec<Counter>,
    /// The expected and the median depth of every pixel, if the settings keep them; infinite where nothing is.
    ///
    /// Depth is the distance along the camera's axis, or from the eye for a fisheye and a panorama. The expected depth
    /// is the reciprocal of the mean reciprocal, weighted as colours are (the mean itself for parallel rays); the
    /// median is that of the Gaussian at which half of the light is gone, or of the last one.
    pub depth: Option<Vec<[f32; 2]>>,
}

/// Where a frame goes.
pub struct Target {
    /// The colour attachment.
    pub image: Image,
    /// Room for the pixels in memory of the host.
    pub readback: Buffer,
    /// The attachment of depths and the room for them, if there are some.
    depths: Option<(Image, Buffer)>,
}

impl Renderer {
    /// A renderer on the first device of `entry` that draws Gaussians.
    ///
    /// # Errors
    /// If there is none, or Vulkan fails.
    pub fn new(entry: ash::Entry) -> Result<Self, RenderError> {
        let device = Arc::new(Device::new(entry, Purpose::Gaussians)?);
        Ok(Self {
            query: CounterQuery::new(&device, false)?,
            target: None,
            commands: CommandBuffers::new(&device)?,
            gaussian: device.gaussian_functions(),
            device,
        })
    }

    /// Counts also what changes how long things take, such as what simulated hardware would spend.
    ///
    /// # Errors
    /// If Vulkan fails.
    pub fn count_everything(&mut self) -> Result<(), RenderError> {
        // A device has one profiling lock.
        self.query = None;
        self.query = CounterQuery::new(&self.device, true)?;
        Ok(())
    }

    /// The device's name.
    pub fn device_name(&self) -> &str {
        self.device.name()
    }

    /// Copies `scene` to the device. Its colours are drawn with the spherical harmonics degree that
    /// it stores, or `sh_degree`, or the device's greatest, whichever is least.
    ///
    /// # Errors
    /// If the scene is too large for the device, or Vulkan fails.
    pub fn upload(
        &mut self,
        scene: &Scene,
        sh_degree: Option<u32>,
    ) -> Result<DeviceScene, RenderError> {
        let settings = Settings {
            sh_degree: sh_degree.unwrap_or(MAX_SH_DEGREE),
            ..Settings::default()
        };
        let max = self.device.max_gaussians().min(u32::MAX.into());
        let count = scene.len() as u64;
        if count > max {
            return Err(RenderError::TooMany { count, max });
        }
        let strides = [
            size_of::<[f32; 3]>(),
            size_of::<GaussianShape>(),
            scene.sh_stride() * size_of::<[f32; 3]>(),
        ]
        .map(|stride| stride as u32);
        Ok(DeviceScene {
            count: count as u32,
            strides,
            stored_degree: scene.sh_degree(),
            settings,
            pipeline: self.pipeline(strides, scene.sh_degree(), settings)?,
            buffers: [
                self.upload_bytes(bytemuck::cast_slice(scene.positions()))?,
                self.upload_bytes(bytemuck::cast_slice(scene.shapes()))?,
                self.upload_bytes(bytemuck::cast_slice(scene.sh()))?,
            ],
        })
    }

    /// Draws `scene` once, as `camera` sees it, by 3DGS's settings.
    ///
    /// # Errors
    /// As [`Renderer::upload`] and [`Renderer::render`].
    pub fn draw(&mut self, scene: &Scene, camera: &Camera) -> Result<Picture, RenderError> {
        let scene = self.upload(scene, None)?;
        Ok(self.render(&scene, camera)?.picture)
    }

    /// Draws `scene` by other settings from now on.
    ///
    /// # Errors
    /// If Vulkan fails.
    pub fn set(&self, scene: &mut DeviceScene, settings: Settings) -> Result<(), RenderError> {
        scene.pipeline = self.pipeline(scene.strides, scene.stored_degree, settings)?;
        scene.settings = settings;
        Ok(())
    }

    fn pipeline(
        &self,
        strides: [u32; BINDINGS],
        stored_degree: u32,
        mut settings: Settings,
    ) -> Result<GaussianPipeline, RenderError> {
        settings.sh_degree = settings
            .sh_degree
            .min(stored_degree)
            .min(self.device.max_sh_degree());
        GaussianPipeline::new(&self.device, strides, settings, COLOR_FORMAT)
    }

    /// A device-local vertex buffer of `bytes`, by way of a staging buffer.
    fn upload_bytes(&mut self, bytes: &[u8]) -> Result<Buffer, RenderError> {
        use vk::BufferUsageFlags as Usage;
        let usage = Usage::VERTEX_BUFFER | Usage::TRANSFER_DST;
        // Vulkan has no empty buffers; an empty scene is drawn with none of this read.
        let size = (bytes.len() as u64).max(4);
        let buffer = Buffer::new(&self.device, size, usage, Memory::Device)?;
        let staging_size = size.min(STAGING);
        let staging = Buffer::new(
            &self.device,
            staging_size,
            Usage::TRANSFER_SRC,
            Memory::Host,
        )?;
        let mut offset = 0;
        for chunk in bytes.chunks(staging_size as usize) {
            staging.write(chunk)?;
            let region = vk::BufferCopy::default()
                .dst_offset(offset)
                .size(chunk.len() as u64);
            self.commands.record(0, |device, commands| {
                // SAFETY: the command buffer is recording, and the regions lie within both
                // buffers, which live until the submission below has ended.
                unsafe {
                    device.cmd_copy_buffer(commands, staging.handle(), buffer.handle(), &[region]);
                }
                // The next submission's draws read it as vertices.
                let barrier = vk::MemoryBarrier::default()
                    .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
                    .dst_access_mask(vk::AccessFlags::VERTEX_ATTRIBUTE_READ);
                // SAFETY: the command buffer is recording, outside a render pass.
                unsafe {
                    device.cmd_pipeline_barrier(
                        commands,
                        vk::PipelineStageFlags::TRANSFER,
                        vk::PipelineStageFlags::VERTEX_INPUT,
                        vk::DependencyFlags::empty(),
                        &[barrier],
                        &[],
                        &[],
                    );
                }
            })?;
            self.commands.submit_and_wait(&[0])?;
            offset += chunk.len() as u64;
        }
        Ok(buffer)
    }

    /// Draws `scene` as `camera` sees it, in a picture of the camera's size.
    ///
    /// # Errors
    /// If the size is not within the device's limits, modes don't go together, or Vulkan fails.
    pub fn render(&mut self, scene: &DeviceScene, camera: &Camera) -> Result<Frame, RenderError> {
        let (width, height) = (camera.width, camera.height);
        check_size(&self.device, width, height)?;
        scene.settings.check(camera)?;
        let depth = scene.settings.depth;
        let target = match self.target.take() {
            Some(target)
                if target.image.extent() == vk::Extent2D { width, height }
                    && target.depths.is_some() == depth =>
            {
                target
            }
            _ => Target::with_depths(&self.device, width, height, depth)?,
        };
        let target = self.target.insert(target);

        // A query is not reset in the submission that it begins in, and it spans a whole command
        // buffer, so that counters of any scope will do.
        if let Some(query) = &self.query {
            self.commands
                .record(0, |_, commands| query.reset(commands))?;
            self.commands.submit_and_wait(&[0])?;
        }
        self.commands.record(0, |_, commands| {
            if let Some(query) = &self.query {
                query.begin(commands);
            }
            let recorder = Recorder {
                device: &self.device,
                gaussian: &self.gaussian,
                commands,
            };
            recorder.record(target, scene, camera);
            if let Some(query) = &self.query {
                query.end(commands);
            }
        })?;
        self.commands
            .record(1, |_, commands| record_copy(&self.device, commands, target))?;
        let (start, processor) = (Instant::now(), processor_time());
        self.commands.submit_and_wait(&[0, 1])?;
        let time = start.elapsed();
        let processor_time = processor.and_then(|start| Some(processor_time()? - start));

        let pixels: Vec<[f32; 4]> = (target.readback).read_new(width as usize * height as usize)?;
        let depth = match &target.depths {
            None => None,
            Some((_, readback)) => {
                let mut depths = vec![[0.0; 2]; width as usize * height as usize];
                readback.read(&mut depths)?;
                let scale = DepthScale::of(camera);
                for (depths, [.., alpha]) in depths.iter_mut().zip(&pixels) {
                    let reached = *alpha > 0.0;
                    *depths = depths.map(|value| scale.depth(if reached { value } else { 0.0 }));
                }
                Some(depths)
            }
        };
        let counters = self.query.as_ref().map(CounterQuery::read).transpose()?;
        Ok(Frame {
            picture: Picture {
                width,
                height,
                pixels,
            },
            time,
            processor_time,
            counters: counters.unwrap_or_default(),
            depth,
        })
    }
}

/// Checks that the device can draw a picture of this size.
///
/// # Errors
/// [`RenderError::Size`] if it cannot.
pub fn check_size(device: &Device, width: u32, height: u32) -> Result<(), RenderError> {
    let max = device.max_size();
    if !(1..=max).contains(&width) || !(1..=max).contains(&height) {
        return Err(RenderError::Size { width, height, max });
    }
    Ok(())
}

impl Target {
    /// A target of [`COLOR_FORMAT`].
    ///
    /// # Errors
    /// If there is no memory for it, or Vulkan fails.
    pub fn new(device: &Arc<Device>, width: u32, height: u32) -> Result<Self, RenderError> {
        Self::with_depths(device, width, height, false)
    }

    fn with_depths(
        device: &Arc<Device>,
        width: u32,
        height: u32,
        depth: bool,
    ) -> Result<Self, RenderError> {
        let extent = vk::Extent2D { width, height };
        let image = |format| {
            let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT
                | vk::ImageUsageFlags::TRANSFER_SRC
                | vk::ImageUsageFlags::TRANSFER_DST;
            Image::new(device, extent, format, usage)
        };
        let readback = |pixel: usize| {
            let bytes = u64::from(width) * u64::from(height) * pixel as u64;
            let usage = vk::BufferUsageFlags::TRANSFER_DST;
            Buffer::new(device, bytes, usage, Memory::HostCached)
        };
        Ok(Self {
            image: image(COLOR_FORMAT)?,
            readback: readback(size_of::<[f32; 4]>())?,
            depths: if depth {
                Some((image(DEPTHS_FORMAT)?, readback(size_of::<[f32; 2]>())?))
            } else {
                None
            },
        })
    }
}

/// Copies the drawn picture to the buffer that the host reads, and depths if there are some.
pub fn record_copy(device: &Device, commands: vk::CommandBuffer, target: &Target) {
    copy_image(device, commands, &target.image, &target.readback);
    if let Some((image, readback)) = &target.depths {
        copy_image(device, commands, image, readback);
    }
}

fn copy_image(device: &Device, commands: vk::CommandBuffer, image: &Image, readback: &Buffer) {
    let to_source = image
        .barrier(
            vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
        )
        .src_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE)
        .dst_access_mask(vk::AccessFlags::TRANSFER_READ);
    let layers = vk::ImageSubresourceLayers::default()
        .aspect_mask(vk::ImageAspectFlags::COLOR)
        .layer_count(1);
    let region = vk::BufferImageCopy::default()
        .image_subresource(layers)
        .image_extent(image.extent().into());
    let to_host = vk::MemoryBarrier::default()
        .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
        .dst_access_mask(vk::AccessFlags::HOST_READ);
    let raw = device.raw();
    // SAFETY: the command buffer is recording; the buffer holds the whole image without gaps, and
    // both live until the submission has ended.
    unsafe {
        raw.cmd_pipeline_barrier(
            commands,
            vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT,
            vk::PipelineStageFlags::TRANSFER,
            vk::DependencyFlags::empty(),
            &[],
            &[],
            &[to_source],
        );
        raw.cmd_copy_image_to_buffer(
            commands,
            image.handle(),
            vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            readback.handle(),
            &[region],
        );
        raw.cmd_pipeline_barrier(
            commands,
            vk::PipelineStageFlags::TRANSFER,
            vk::PipelineStageFlags::HOST,
            vk::DependencyFlags::empty(),
            &[to_host],
            &[],
            &[],
        );
    }
}
