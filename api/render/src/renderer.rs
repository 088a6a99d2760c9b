//! The renderer: copies scenes to device memory, and draws frames of them into host memory.

use std::sync::Arc;
use std::time::{Duration, Instant};

use ash::vk;
use bytemuck::Pod;
use gaurast::gaussian_primitive_topology;
use gaurast_picture::Picture;
use gaurast_scene::{Camera, EncodedScene, GaussianShape, Geometry, MAX_SH_DEGREE, Scene, SceneArrays};
use glam::{DMat3, DVec3};

use crate::arrays::Arrays;
use crate::device::{Device, Purpose};
use crate::device_scene::{DecodedVertices, DeviceScene, Vertices};
use crate::draw::{DepthScale, Recorder};
use crate::encoded::{EncodedVertices, Encoding, Tables};
use crate::error::RenderError;
use crate::listed::{self, List};
use crate::mesh::{self, DeviceMesh, MeshPipeline};
use crate::modes::{CutOff, Kept};
use crate::options::DeviceOptions;
use crate::pipeline::{BINDINGS, GaussianPipeline, VertexLayout};
use crate::process_stats::processor_time;
use crate::query::{Counter, CounterQuery};
use crate::resource::{Buffer, CommandBuffers, Memory};
use crate::settings::Settings;
use crate::target::{COLOR_FORMAT, Target, check_size, record_copy};

/// The most bytes that are copied to the device at once.
const STAGING: u64 = 64 << 20;

/// The reason for which a compressed scene is not listed.
const ENCODED_BY_Z: &str =
    "Gaussians of a compressed scene are sorted by the device alone: to sort them by z, they are decoded first";

/// A device that draws Gaussians, with the objects that it reuses for each frame.
pub struct Renderer {
    query: Option<CounterQuery>,
    target: Option<Target>,
    commands: CommandBuffers<2>,
    gaussian: gaussian_primitive_topology::Device,
    /// The number of threads that hash arrays.
    threads: usize,
    device: Arc<Device>,
}

/// A rendered picture and its cost.
#[derive(Clone, Debug)]
pub struct Frame {
    /// (C, 1 - T) of every pixel, without a background.
    pub picture: Picture,
    /// The time from the submission to its end, including the copy to the host.
    pub time: Duration,
    /// The processor time of all threads of the process in that time, if the system reports it.
    pub processor_time: Option<Duration>,
    /// The device's counters of the draw, in its order; empty if it has none.
    pub counters: Vec<Counter>,
    /// The expected and the median depth of every pixel, if the settings ask for them; infinite where nothing is drawn.
    ///
    /// Depth is the distance along the camera's axis, or from the eye for a fisheye and a panorama. The expected depth
    /// is the reciprocal of the mean reciprocal depth, weighted as colours are (the mean depth itself if orthographic).
    /// The median depth is that of the Gaussian at which transmittance falls below one half, or of the last one.
    pub depth: Option<Vec<[f32; 2]>>,
    /// The numbers of the Gaussian of the median depth and of the nearest one at every pixel, if the settings ask for
    /// them; [`u32::MAX`] where nothing is drawn.
    pub gaussians: Option<Vec<[u32; 2]>>,
}

impl Renderer {
    /// A renderer on the first device of `entry` that draws Gaussians.
    ///
    /// # Errors
    /// If there is none, or Vulkan fails.
    pub fn new(entry: ash::Entry) -> Result<Self, RenderError> {
        Self::with_options(entry, &DeviceOptions::default())
    }

    /// As [`Renderer::new`], with options of the device.
    ///
    /// # Errors
    /// As [`Renderer::new`]; also for an option that the driver refuses.
    pub fn with_options(entry: ash::Entry, options: &DeviceOptions) -> Result<Self, RenderError> {
        let device = Arc::new(Device::new(entry, Purpose::Gaussians, options)?);
        let threads = match options.threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            threads => threads as usize,
        };
        Ok(Self {
            query: CounterQuery::new(&device, false)?,
            target: None,
            commands: CommandBuffers::new(&device)?,
            gaussian: device.gaussian_functions(),
            threads,
            device,
        })
    }

    /// Includes counters that affect performance, such as those of simulated hardware.
    ///
    /// # Errors
    /// Returns an error if Vulkan fails.
    pub fn count_everything(&mut self) -> Result<(), RenderError> {
        // A device has only one profiling lock.
        self.query = None;
        self.query = CounterQuery::new(&self.device, true)?;
        Ok(())
    }

    /// The device's name.
    pub fn device_name(&self) -> &str {
        self.device.name()
    }

    /// Copies `scene` to the device, with its triangles. Its colours are drawn with the spherical harmonics degree that
    /// it stores, or `sh_degree`, or the device's greatest, whichever is least.
    ///
    /// # Errors
    /// If the scene is too large for the device, or Vulkan fails.
    pub fn upload(&mut self, scene: &Scene, sh_degree: Option<u32>) -> Result<DeviceScene, RenderError> {
        let count = self.checked_count(scene.len())?;
        let buffers = [
            self.upload_bytes(bytemuck::cast_slice(scene.positions()))?,
            self.upload_bytes(bytemuck::cast_slice(scene.shapes()))?,
            self.upload_bytes(bytemuck::cast_slice(scene.sh()))?,
        ];
        self.with_buffers(scene, sh_degree, count, buffers)
    }

    /// As [`Renderer::upload`], and frees the scene's arrays as they are copied, so that there is hardly any memory that has them
    /// twice.
    ///
    /// # Errors
    /// As [`Renderer::upload`].
    pub fn upload_and_free(&mut self, mut scene: Scene, sh_degree: Option<u32>) -> Result<DeviceScene, RenderError> {
        let count = self.checked_count(scene.len())?;
        let SceneArrays { positions, shapes, sh, .. } = scene.take_arrays();
        let usage = vk::BufferUsageFlags::VERTEX_BUFFER;
        let buffers = [
            self.upload_and_free_array(positions, usage)?,
            self.upload_and_free_array(shapes, usage)?,
            self.upload_and_free_array(sh, usage)?,
        ];
        self.with_buffers(&scene, sh_degree, count, buffers)
    }

    /// The scene on the device, whose `count` Gaussians are in the buffers.
    fn with_buffers(
        &mut self,
        scene: &Scene,
        sh_degree: Option<u32>,
        count: u32,
        buffers: [Buffer; BINDINGS],
    ) -> Result<DeviceScene, RenderError> {
        let settings = Settings { sh_degree: sh_degree.unwrap_or(MAX_SH_DEGREE), ..Settings::default() };
        let strides = [size_of::<[f32; 3]>(), size_of::<GaussianShape>(), scene.sh_stride() * size_of::<[f32; 3]>()]
            .map(|stride| stride as u32);
        let lit = mesh::lit(scene);
        let mesh = if lit.is_empty() {
            None
        } else {
            let vertices = u32::try_from(lit.len())
                .map_err(|_| RenderError::TooMany { count: lit.len() as u64, max: u32::MAX.into() })?;
            Some(DeviceMesh {
                vertices,
                buffer: self.upload_bytes(bytemuck::cast_slice(&lit))?,
                pipeline: MeshPipeline::new(&self.device)?,
            })
        };
        let pipeline = self.pipeline(&VertexLayout::Decoded(strides), scene.sh_degree(), settings, mesh.is_some())?;
        Ok(DeviceScene {
            mesh,
            origin: DVec3::from_array(scene.origin()),
            turn: DMat3::IDENTITY,
            count,
            stored_degree: scene.sh_degree(),
            settings,
            pipeline,
            vertices: Vertices::Decoded(Box::new(DecodedVertices { strides, resident: None, buffers, hash: None })),
        })
    }

    /// Returns true if the device draws compressed scenes as they are.
    pub fn draws_encoded(&self) -> bool {
        self.device.decodes()
    }

    /// Copies a compressed scene to the device, which decodes its integers as it draws them. The degree is as in
    /// [`Renderer::upload`]. Each array in host memory is freed when it has been copied.
    ///
    /// # Errors
    /// If the device has no `attributeDecoding`, the scene is too large for it, or Vulkan fails.
    pub fn upload_encoded(
        &mut self,
        mut scene: EncodedScene,
        sh_degree: Option<u32>,
    ) -> Result<DeviceScene, RenderError> {
        if !self.draws_encoded() {
            return Err(RenderError::Combination("the device does not decode attributes (attributeDecoding)"));
        }
        let settings = Settings { sh_degree: sh_degree.unwrap_or(MAX_SH_DEGREE), ..Settings::default() };
        let count = self.checked_count(scene.count)?;
        let encoding = Encoding::of(&scene);
        let pipeline = self.pipeline(&VertexLayout::Encoded(&encoding), scene.sh_degree, settings, false)?;
        let mut buffers = Vec::new();
        for stream in std::mem::take(&mut scene.streams) {
            buffers.push(self.upload_and_free_array(stream.bytes, vk::BufferUsageFlags::VERTEX_BUFFER)?);
        }
        let usage = vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
        let numbers = self.upload_for(bytemuck::cast_slice(&scene.numbers), usage)?;
        let (mut codes, mut labels) = (None, None);
        if let Some(harmonics) = &mut scene.harmonics {
            codes = Some(self.upload_and_free_array(std::mem::take(&mut harmonics.codes.bytes), usage)?);
            if let Some(stream) = &mut harmonics.labels {
                labels = Some(self.upload_and_free_array(std::mem::take(&mut stream.bytes), usage)?);
            }
        }
        let tables = Tables::new(&scene, numbers, codes, labels);
        Ok(DeviceScene {
            mesh: None,
            origin: DVec3::ZERO,
            turn: scene.turn,
            count,
            stored_degree: scene.sh_degree,
            settings,
            pipeline,
            vertices: Vertices::Encoded(Box::new(EncodedVertices { encoding, buffers, tables })),
        })
    }

    /// Draws `scene` once, as `camera` sees it, with 3DGS's settings.
    ///
    /// # Errors
    /// As [`Renderer::upload`] and [`Renderer::render`].
    pub fn draw(&mut self, scene: &Scene, camera: &Camera) -> Result<Picture, RenderError> {
        let scene = self.upload(scene, None)?;
        Ok(self.render(&scene, camera)?.picture)
    }

    /// Draws `scene` with other settings from now on.
    ///
    /// # Errors
    /// If Vulkan fails.
    pub fn set(&self, scene: &mut DeviceScene, settings: Settings) -> Result<(), RenderError> {
        let layout = match &scene.vertices {
            Vertices::Encoded(_) if settings.by_z => return Err(RenderError::Combination(ENCODED_BY_Z)),
            Vertices::Encoded(vertices) => VertexLayout::Encoded(&vertices.encoding),
            Vertices::Decoded(vertices) => VertexLayout::Decoded(vertices.strides),
        };
        scene.pipeline = self.pipeline(&layout, scene.stored_degree, settings, scene.mesh.is_some())?;
        scene.settings = settings;
        Ok(())
    }

    /// The number of Gaussians of a draw, if the device draws that many.
    fn checked_count(&self, count: usize) -> Result<u32, RenderError> {
        let max = self.device.max_gaussians().min(u32::MAX.into());
        let too_many = RenderError::TooMany { count: count as u64, max };
        u32::try_from(count).ok().filter(|count| u64::from(*count) <= max).ok_or(too_many)
    }

    fn pipeline(
        &self,
        layout: &VertexLayout<'_>,
        stored_degree: u32,
        mut settings: Settings,
        over_mesh: bool,
    ) -> Result<GaussianPipeline, RenderError> {
        if settings.sigma_points.is_some() && !self.device.has_sigma_points() {
            return Err(RenderError::Combination("the device has no unscented transform with other sigma points"));
        }
        let cuts_discs = settings.cut_off != CutOff::None && settings.geometry == Geometry::Surfel;
        if cuts_discs && !self.device.has_surfel_cut_off() {
            return Err(RenderError::Combination("the device has no cut-off of flat Gaussians (2d)"));
        }
        settings.sh_degree = settings.sh_degree.min(stored_degree).min(self.device.max_sh_degree());
        GaussianPipeline::new(&self.device, layout, settings, COLOR_FORMAT, over_mesh)
    }

    /// A device-local vertex buffer of `bytes`.
    fn upload_bytes(&mut self, bytes: &[u8]) -> Result<Buffer, RenderError> {
        self.upload_for(bytes, vk::BufferUsageFlags::VERTEX_BUFFER)
    }

    /// A device-local buffer of `bytes` for a usage, copied through a staging buffer.
    fn upload_for(&mut self, bytes: &[u8], usage: vk::BufferUsageFlags) -> Result<Buffer, RenderError> {
        let buffer = self.device_buffer(bytes.len(), usage)?;
        let staging = self.staging_for(&buffer)?;
        let most = staging.size() as usize;
        for (number, piece) in bytes.chunks(most).enumerate() {
            self.copy_piece(piece, &staging, &buffer, (number * most) as u64)?;
        }
        Ok(buffer)
    }

    /// The same of the bytes of `values`, which are freed on the way, from the last one on.
    fn upload_and_free_array<T: Pod>(
        &mut self,
        mut values: Vec<T>,
        usage: vk::BufferUsageFlags,
    ) -> Result<Buffer, RenderError> {
        let buffer = self.device_buffer(size_of_val(&values[..]), usage)?;
        let staging = self.staging_for(&buffer)?;
        let most = (staging.size() as usize / size_of::<T>()).max(1);
        while !values.is_empty() {
            let first = (values.len() - 1) / most * most;
            let place = first * size_of::<T>();
            self.copy_piece(bytemuck::cast_slice(&values[first..]), &staging, &buffer, place as u64)?;
            values.truncate(first);
            values.shrink_to_fit();
        }
        Ok(buffer)
    }

    /// A buffer of `size` bytes in the device's own memory, to which the host's are copied.
    fn device_buffer(&self, size: usize, usage: vk::BufferUsageFlags) -> Result<Buffer, RenderError> {
        use vk::BufferUsageFlags as Usage;
        let usage = usage | Usage::TRANSFER_DST | Usage::TRANSFER_SRC;
        // Vulkan has no empty buffers; an empty scene is drawn without reading this one.
        Buffer::new(&self.device, (size as u64).max(4), usage, Memory::Device)
    }

    /// A buffer through which pieces of what `buffer` holds are copied.
    fn staging_for(&self, buffer: &Buffer) -> Result<Buffer, RenderError> {
        Buffer::new(&self.device, buffer.size().min(STAGING), vk::BufferUsageFlags::TRANSFER_SRC, Memory::Host)
    }

    /// Copies `piece` through the staging buffer to a place of a buffer.
    fn copy_piece(
        &mut self,
        piece: &[u8],
        staging: &Buffer,
        buffer: &Buffer,
        place: vk::DeviceSize,
    ) -> Result<(), RenderError> {
        staging.write(piece)?;
        let region = vk::BufferCopy::default().dst_offset(place).size(piece.len() as u64);
        self.copy(&[(staging, buffer, region)])
    }

    /// Copies regions of buffers to others, from which the next submission's draws read vertices and tables, or the host.
    fn copy(&mut self, regions: &[(&Buffer, &Buffer, vk::BufferCopy)]) -> Result<(), RenderError> {
        self.commands.record(0, |device, commands| {
            for (from, to, region) in regions {
                // SAFETY: the command buffer is recording, and the regions lie within both buffers, which live until the
                // submission below has ended.
                unsafe { device.cmd_copy_buffer(commands, from.handle(), to.handle(), &[*region]) };
            }
            let barrier =
                vk::MemoryBarrier::default().src_access_mask(vk::AccessFlags::TRANSFER_WRITE).dst_access_mask(
                    vk::AccessFlags::VERTEX_ATTRIBUTE_READ | vk::AccessFlags::SHADER_READ | vk::AccessFlags::HOST_READ,
                );
            use vk::PipelineStageFlags as Stage;
            // SAFETY: the command buffer is recording, outside a render pass.
            unsafe {
                device.cmd_pipeline_barrier(
                    commands,
                    Stage::TRANSFER,
                    Stage::VERTEX_INPUT | Stage::VERTEX_SHADER | Stage::HOST,
                    vk::DependencyFlags::empty(),
                    &[barrier],
                    &[],
                    &[],
                );
            }
        })?;
        self.commands.submit_and_wait(&[0])
    }

    /// Copies `arrays` to the device, to be drawn with `settings`. `used` is a scene that this function returned before, whose
    /// memory and pipeline it uses again where they serve.
    ///
    /// Arrays are drawn from host memory the first time. Those that come again unchanged are copied to the device's own, for which
    /// drivers keep what they compute.
    ///
    /// # Errors
    /// If there are too many Gaussians for the device, or Vulkan fails.
    ///
    /// # Panics
    /// If the arrays are not of one length, or have too few harmonics.
    pub fn upload_arrays(
        &mut self,
        arrays: &Arrays<'_>,
        settings: Settings,
        used: Option<DeviceScene>,
    ) -> Result<DeviceScene, RenderError> {
        arrays.check();
        let hash = arrays.hash(self.threads);
        let count = self.checked_count(arrays.positions.len())?;
        let (stored_degree, sh_stride) = arrays.harmonics();
        let strides = [size_of::<[f32; 3]>(), size_of::<GaussianShape>(), sh_stride * size_of::<[f32; 3]>()];
        let strides = strides.map(|stride| stride as u32);
        let bytes = strides.map(|stride| u64::from(stride) * u64::from(count));
        let layout = VertexLayout::Decoded(strides);
        let scene = |vertices: Box<DecodedVertices>, pipeline: GaussianPipeline| DeviceScene {
            mesh: None,
            origin: DVec3::ZERO,
            turn: DMat3::IDENTITY,
            count,
            stored_degree,
            settings,
            pipeline,
            vertices: Vertices::Decoded(vertices),
        };
        let (mut vertices, pipeline) = match used {
            Some(DeviceScene {
                vertices: Vertices::Decoded(held),
                pipeline,
                stored_degree: held_degree,
                settings: held_settings,
                ..
            }) => {
                let keeps_pipeline = (held_degree, held_settings) == (stored_degree, settings);
                let is_same = held.hash == Some(hash);
                let pipeline = if keeps_pipeline && held.strides == strides {
                    pipeline
                } else {
                    self.pipeline(&layout, stored_degree, settings, false)?
                };
                if is_same {
                    return Ok(scene(self.made_resident(held, bytes)?, pipeline));
                }
                (Box::new(DecodedVertices { strides, resident: None, hash: None, ..*held }), pipeline)
            }
            _ => {
                let buffers = [self.vertices(bytes[0])?, self.vertices(bytes[1])?, self.vertices(bytes[2])?];
                let pipeline = self.pipeline(&layout, stored_degree, settings, false)?;
                (Box::new(DecodedVertices { strides, buffers, resident: None, hash: None }), pipeline)
            }
        };
        for (buffer, bytes) in vertices.buffers.iter_mut().zip(bytes) {
            if buffer.size() < bytes {
                *buffer = self.vertices(bytes)?;
            }
        }
        arrays.write_to(&vertices.buffers)?;
        vertices.hash = Some(hash);
        Ok(scene(vertices, pipeline))
    }

    /// The vertices with copies in the device's memory, of which the first `bytes` are drawn.
    fn made_resident(
        &mut self,
        mut vertices: Box<DecodedVertices>,
        bytes: [u64; BINDINGS],
    ) -> Result<Box<DecodedVertices>, RenderError> {
        if vertices.resident.is_none() && bytes[0] > 0 {
            let usage = vk::BufferUsageFlags::VERTEX_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
            let copy = |bytes: u64| Buffer::new(&self.device, bytes, usage, Memory::Device);
            let copies = [copy(bytes[0])?, copy(bytes[1])?, copy(bytes[2])?];
            let region = |bytes: u64| vk::BufferCopy::default().size(bytes);
            let [positions, shapes, harmonics] = &vertices.buffers;
            self.copy(&[
                (positions, &copies[0], region(bytes[0])),
                (shapes, &copies[1], region(bytes[1])),
                (harmonics, &copies[2], region(bytes[2])),
            ])?;
            vertices.resident = Some(copies);
        }
        Ok(vertices)
    }

    /// A vertex buffer in host memory of `bytes`.
    fn vertices(&self, bytes: u64) -> Result<Buffer, RenderError> {
        let usage = vk::BufferUsageFlags::VERTEX_BUFFER | vk::BufferUsageFlags::TRANSFER_SRC;
        // Vulkan has no empty buffers.
        Buffer::new(&self.device, bytes.max(4), usage, Memory::Host)
    }

    /// The list of what `camera` sees of `scene`, by z.
    fn list(&mut self, scene: &DeviceScene, camera: &Camera) -> Result<List, RenderError> {
        let Vertices::Decoded(vertices) = &scene.vertices else {
            return Err(RenderError::Combination(ENCODED_BY_Z));
        };
        let bytes = u64::from(scene.count) * size_of::<[f32; 3]>() as u64;
        // Vulkan has no empty buffers.
        let read = Buffer::new(&self.device, bytes.max(4), vk::BufferUsageFlags::TRANSFER_DST, Memory::HostCached)?;
        if scene.count > 0 {
            self.copy(&[(&vertices.buffers[0], &read, vk::BufferCopy::default().size(bytes))])?;
        }
        let numbers = read.look(scene.count as usize, |positions| listed::by_z(positions, camera))?;
        let size = (size_of_val(&numbers[..]) as u64).max(4);
        let indices = Buffer::new(&self.device, size, vk::BufferUsageFlags::INDEX_BUFFER, Memory::Host)?;
        indices.write(bytemuck::cast_slice(&numbers))?;
        Ok(List { indices, count: numbers.len() as u32 })
    }

    /// Draws `scene` as `camera` sees it, in a picture of the camera's size.
    ///
    /// # Errors
    /// Returns an error if the size exceeds the device's limits, modes can't be combined, or Vulkan fails.
    pub fn render(&mut self, scene: &DeviceScene, camera: &Camera) -> Result<Frame, RenderError> {
        let camera = &scene.seen_by(camera);
        let (width, height) = (camera.width, camera.height);
        check_size(&self.device, width, height)?;
        scene.settings.check(camera)?;
        if !camera.distortion.is_none() && !self.device.distorts() {
            let sentence = "the device draws ideal lenses alone, and the camera's distorts (--undistorted)";
            return Err(RenderError::Combination(sentence));
        }
        let tested = scene.mesh.is_some();
        if tested {
            scene.settings.check_mesh(camera)?;
        }
        let list = if scene.settings.by_z { Some(self.list(scene, camera)?) } else { None };
        let kept = scene.settings.kept();
        let target = match self.target.take() {
            Some(target)
                if target.image.extent() == vk::Extent2D { width, height }
                    && target.kept.as_ref().map(|(kept, ..)| *kept) == kept
                    && target.tested.is_some() == tested =>
            {
                target
            }
            _ => Target::keeping(&self.device, width, height, kept, tested)?,
        };
        let target = self.target.insert(target);

        // A query is not reset in the submission in which it begins, and it spans a whole command buffer, so that
        // counters of any scope can be used.
        if let Some(query) = &self.query {
            self.commands.record(0, |_, commands| query.reset(commands))?;
            self.commands.submit_and_wait(&[0])?;
        }
        self.commands.record(0, |_, commands| {
            if let Some(query) = &self.query {
                query.begin(commands);
            }
            let recorder = Recorder { device: &self.device, gaussian: &self.gaussian, commands };
            recorder.record(target, scene, camera, list.as_ref());
            if let Some(query) = &self.query {
                query.end(commands);
            }
        })?;
        self.commands.record(1, |_, commands| record_copy(&self.device, commands, target))?;
        let (start, processor) = (Instant::now(), processor_time());
        self.commands.submit_and_wait(&[0, 1])?;
        let time = start.elapsed();
        let processor_time = processor.and_then(|start| Some(processor_time()? - start));

        let pixels: Vec<[f32; 4]> = (target.readback).read_new(width as usize * height as usize)?;
        let (mut depth, mut gaussians) = (None, None);
        match &target.kept {
            None => {}
            Some((Kept::Gaussians, _, readback)) => {
                let mut numbers: Vec<[u32; 2]> = readback.read_new(pixels.len())?;
                numbers.iter_mut().flatten().for_each(|number| *number = number.wrapping_sub(1));
                gaussians = Some(numbers);
            }
            Some((kept, _, readback)) => {
                let mut depths: Vec<[f32; 2]> = readback.read_new(pixels.len())?;
                let scale = DepthScale::of(camera);
                let of_value = |value: f32| match kept {
                    Kept::LinearDepths => value,
                    _ => scale.depth(value),
                };
                for (depths, [.., alpha]) in depths.iter_mut().zip(&pixels) {
                    *depths = if *alpha > 0.0 { depths.map(of_value) } else { [f32::INFINITY; 2] };
                }
                depth = Some(depths);
            }
        }
        let counters = self.query.as_ref().map(CounterQuery::read).transpose()?;
        Ok(Frame {
            picture: Picture { width, height, pixels },
            time,
            processor_time,
            counters: counters.unwrap_or_default(),
            depth,
            gaussians,
        })
    }
}
