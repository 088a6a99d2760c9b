//! A Vulkan device that runs kernels: this driver's, or lavapipe's through the loader.

use ash::vk;
use gaurast_testkit::{Bindings, Buffer, Gpu, Kernel as Pipeline, OpenError, Recorded, Resource, Settings};

use super::kernel::Kernel;

/// A device, and the properties of its shader cores.
pub struct Context {
    /// The device.
    pub gpu: Gpu,
    /// The driver's name and version.
    pub name: String,
    /// Number of invocations of a subgroup.
    pub subgroup_size: u32,
    /// The supported subgroup operations.
    pub subgroup_operations: vk::SubgroupFeatureFlags,
    /// True if shaders can require that denormals of every float type are preserved.
    pub preserves_denormals: bool,
}

/// A Vulkan call that failed, and its result.
#[derive(Clone, Copy, Debug, thiserror::Error)]
#[error("Vulkan refused to {what}: {result}")]
pub struct Refused {
    what: &'static str,
    result: vk::Result,
}

fn refused(what: &'static str) -> impl Fn(vk::Result) -> Refused {
    move |result| Refused { what, result }
}

impl Context {
    /// Opens this driver, linked into the process.
    ///
    /// # Errors
    /// [`OpenError`] if the device cannot be opened.
    pub fn gaurast() -> Result<Self, OpenError> {
        Gpu::embedded(&Settings::default()).map(Self::of)
    }

    /// Opens lavapipe, by its driver id; `None` if there is no loader or it does not find lavapipe.
    ///
    /// # Errors
    /// [`OpenError`] if lavapipe is present but cannot be opened.
    pub fn lavapipe() -> Result<Option<Self>, OpenError> {
        match Gpu::lavapipe() {
            Ok(gpu) => Ok(Some(Self::of(gpu))),
            Err(OpenError::NoLoader(_) | OpenError::NoDevice(_)) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// The properties of a device that is open already.
    pub fn of(gpu: Gpu) -> Self {
        let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
        let mut floats = vk::PhysicalDeviceFloatControlsProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut subgroup).push_next(&mut floats);
        // SAFETY: the physical device is the instance's.
        unsafe {
            gpu.instance().get_physical_device_properties2(gpu.physical_device(), &mut properties);
        }
        Self {
            name: gpu.name().to_owned(),
            subgroup_size: subgroup.subgroup_size,
            subgroup_operations: subgroup.supported_operations,
            preserves_denormals: floats.shader_denorm_preserve_float16
                & floats.shader_denorm_preserve_float32
                & floats.shader_denorm_preserve_float64
                == vk::TRUE,
            gpu,
        }
    }

    /// Prepares a kernel: its pipeline, its buffers with their contents, and its commands.
    ///
    /// # Errors
    /// [`Refused`] if the driver refuses the pipeline.
    pub fn prepare(&self, kernel: &Kernel) -> Result<Prepared, Refused> {
        let gpu = &self.gpu;
        let buffers = kernel.buffers.iter().map(|words| Buffer::of(gpu, words));
        let buffers: Vec<_> = buffers.collect();
        let resources: Vec<_> = (0..)
            .zip(&buffers)
            .map(|(binding, buffer)| match kernel.descriptor_type(binding) {
                vk::DescriptorType::UNIFORM_BUFFER => Resource::Uniform(buffer.raw),
                _ => Resource::Storage(buffer.raw),
            })
            .collect();
        let bindings = Bindings::new(gpu, &resources);
        let (constants, words) = (&kernel.specialization, bytemuck::pod_collect_to_vec::<u8, u32>(&kernel.spirv));
        let pipeline = Pipeline::specialized(gpu, &words, &[bindings.layout], constants)
            .map_err(refused("create a compute pipeline"))?;
        let recorded = gpu.record(|commands| {
            pipeline.dispatch(commands, &[bindings.set], &kernel.push, kernel.groups);
        });
        Ok(Prepared { recorded, _pipeline: pipeline, _bindings: bindings, buffers })
    }
}

/// A kernel that is ready to run.
pub struct Prepared {
    recorded: Recorded,
    _pipeline: Pipeline,
    _bindings: Bindings,
    buffers: Vec<Buffer>,
}

impl Prepared {
    /// Runs it and waits for its completion.
    ///
    /// # Errors
    /// [`Refused`], for example if the device is lost.
    pub fn run(&self) -> Result<(), Refused> {
        self.recorded.try_submit().map_err(refused("submit"))
    }

    /// The contents of the buffer of a binding.
    pub fn read(&self, binding: usize) -> Vec<u32> {
        self.buffers[binding].values()
    }
}
