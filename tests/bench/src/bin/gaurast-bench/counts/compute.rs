//! A counted dispatch of an n-body simulation: arithmetic, workgroup memory, loads and stores.

use std::sync::Arc;

use ash::vk;
use gaurast_render::device::{Device, Purpose};
use gaurast_render::resource::{Buffer, CommandBuffers, Memory};
use gaurast_render::{DeviceOptions, RenderError};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::objects::Objects;

/// The number of bodies, each of which attracts all others.
const BODIES: u32 = 1024;

/// The number of bodies of a workgroup.
const GROUP: u32 = 64;

/// Bodies that attract each other.
pub(super) struct Bodies {
    commands: CommandBuffers<1>,
    pipeline: vk::Pipeline,
    layout: vk::PipelineLayout,
    set: vk::DescriptorSet,
    pulls: Buffer,
    _bodies: Buffer,
    _objects: Objects,
}

impl Bodies {
    /// Creates the bodies on the first device of `entry`.
    pub(super) fn new(entry: ash::Entry) -> Result<Self, RenderError> {
        let device = Arc::new(Device::new(entry, Purpose::Triangles(""), &DeviceOptions::default())?);
        let mut objects = Objects::new(&device);
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let bodies: Vec<[f32; 4]> = (0..BODIES).map(|_| rng.random()).collect();
        let bytes: &[u8] = bytemuck::cast_slice(&bodies);
        let buffer = || {
            let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
            Buffer::new(&device, bytes.len() as u64, usage, Memory::Host)
        };
        let (bodies, pulls) = (buffer()?, buffer()?);
        bodies.write(bytes)?;

        let kind = vk::DescriptorType::STORAGE_BUFFER;
        let (layout, set) = objects.descriptors(kind, 2, vk::ShaderStageFlags::COMPUTE)?;
        let infos = [&bodies, &pulls]
            .map(|buffer| [vk::DescriptorBufferInfo::default().buffer(buffer.handle()).range(vk::WHOLE_SIZE)]);
        let write = |binding: u32| {
            vk::WriteDescriptorSet::default()
                .dst_set(set)
                .dst_binding(binding)
                .descriptor_type(kind)
                .buffer_info(&infos[binding as usize])
        };
        // SAFETY: the set is unused, and the buffers are storage buffers of the same device.
        unsafe {
            device.raw().update_descriptor_sets(&[write(0), write(1)], &[]);
        };
        let code = include_bytes!("shaders/bodies.comp.spv");
        let stage = objects.stage(vk::ShaderStageFlags::COMPUTE, code)?;
        let create_info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout);
        Ok(Self {
            commands: CommandBuffers::new(&device)?,
            pipeline: objects.compute_pipeline(create_info)?,
            layout,
            set,
            pulls,
            _bodies: bodies,
            _objects: objects,
        })
    }

    /// Dispatches and waits.
    pub(super) fn run(&mut self) -> Result<(), RenderError> {
        self.commands.record(0, |raw, commands| {
            let compute = vk::PipelineBindPoint::COMPUTE;
            let to_host = vk::MemoryBarrier::default()
                .src_access_mask(vk::AccessFlags::SHADER_WRITE)
                .dst_access_mask(vk::AccessFlags::HOST_READ);
            // SAFETY: the command buffer is recording; everything is of the same device and lives until the submission
            // has ended.
            unsafe {
                raw.cmd_bind_pipeline(commands, compute, self.pipeline);
                raw.cmd_bind_descriptor_sets(commands, compute, self.layout, 0, &[self.set], &[]);
                raw.cmd_dispatch(commands, BODIES / GROUP, 1, 1);
                raw.cmd_pipeline_barrier(
                    commands,
                    vk::PipelineStageFlags::COMPUTE_SHADER,
                    vk::PipelineStageFlags::HOST,
                    vk::DependencyFlags::empty(),
                    &[to_host],
                    &[],
                    &[],
                );
            }
        })?;
        self.commands.submit_and_wait(&[0])
    }

    /// The acceleration of each body, after a run.
    pub(super) fn result(&self) -> Result<Vec<[f32; 4]>, RenderError> {
        let mut pulls = vec![[0.0; 4]; BODIES as usize];
        self.pulls.read(&mut pulls)?;
        Ok(pulls)
    }
}
