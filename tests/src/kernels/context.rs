//! A Vulkan device that runs kernels: this driver's, or lavapipe's through the loader.

use super::Kernel;
use crate::contexts::{Settings, with_settings};
use ash::vk;

/// A device with one queue.
pub struct Context {
    /// The driver's name and version.
    pub name: String,
    /// Invocations of a subgroup.
    pub subgroup_size: u32,
    /// What its subgroups can do.
    pub subgroup_operations: vk::SubgroupFeatureFlags,
    /// Whether shaders can ask for denormals of every float type to be kept.
    pub preserves_denormals: bool,
    instance: ash::Instance,
    device: ash::Device,
    queue: vk::Queue,
    commands: vk::CommandPool,
    memory_type: u32,
    /// Dropping it unloads the loader.
    _entry: ash::Entry,
}

/// Vulkan refused something.
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
    /// This driver, linked into the process.
    ///
    /// # Errors
    /// [`Refused`] if the device cannot be opened.
    pub fn gaurast() -> Result<Self, Refused> {
        let is_any = |_: vk::DriverId| true;
        let found = with_settings(&Settings::default(), || {
            Self::open(vulkan_gaurast::entry(), is_any)
        })?;
        found.ok_or_else(|| refused("list a device")(vk::Result::ERROR_UNKNOWN))
    }

    /// lavapipe, by its driver id; `None` where there is no loader or it does not know lavapipe.
    ///
    /// # Errors
    /// [`Refused`] if it is there but cannot be opened.
    pub fn lavapipe() -> Result<Option<Self>, Refused> {
        // SAFETY: the loader is the system's own.
        let Ok(entry) = (unsafe { ash::Entry::load() }) else {
            return Ok(None);
        };
        let is_lavapipe = |id| id == vk::DriverId::MESA_LLVMPIPE;
        with_settings(&Settings::default(), || Self::open(entry, is_lavapipe))
    }

    fn open(
        entry: ash::Entry,
        is_wanted: impl Fn(vk::DriverId) -> bool,
    ) -> Result<Option<Self>, Refused> {
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default().application_info(&application);
        // SAFETY: the create infos are valid, and everything is destroyed after its last use.
        unsafe {
            let instance = entry
                .create_instance(&info, None)
                .map_err(refused("create an instance"))?;
            let devices = instance
                .enumerate_physical_devices()
                .map_err(refused("list devices"))?;
            let described = devices.into_iter().map(|device| {
                let mut driver = vk::PhysicalDeviceDriverProperties::default();
                let mut properties =
                    vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
                instance.get_physical_device_properties2(device, &mut properties);
                (device, driver)
            });
            let mut wanted = described.filter(|(_, driver)| is_wanted(driver.driver_id));
            let Some((physical_device, driver)) = wanted.next() else {
                drop(wanted);
                instance.destroy_instance(None);
                return Ok(None);
            };
            drop(wanted);
            let text = |text: &std::ffi::CStr| text.to_string_lossy().into_owned();
            let name = text(driver.driver_name_as_c_str().unwrap_or_default());
            let version = text(driver.driver_info_as_c_str().unwrap_or_default());
            let wanted =
                vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
            let memory = instance.get_physical_device_memory_properties(physical_device);
            let memory_type = memory
                .memory_types_as_slice()
                .iter()
                .position(|ty| ty.property_flags.contains(wanted))
                .ok_or_else(|| refused("map memory")(vk::Result::ERROR_UNKNOWN))?;
            let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
            let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
            let mut floats = vk::PhysicalDeviceFloatControlsProperties::default();
            let mut properties = vk::PhysicalDeviceProperties2::default()
                .push_next(&mut subgroup)
                .push_next(&mut floats);
            instance.get_physical_device_properties2(physical_device, &mut properties);
            // All features that there are, so that a shader may have any capability.
            let mut core_1_1 = vk::PhysicalDeviceVulkan11Features::default();
            let mut core_1_2 = vk::PhysicalDeviceVulkan12Features::default();
            let mut features = vk::PhysicalDeviceFeatures2::default()
                .push_next(&mut core_1_1)
                .push_next(&mut core_1_2);
            instance.get_physical_device_features2(physical_device, &mut features);
            let info = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .push_next(&mut features);
            let device = instance
                .create_device(physical_device, &info, None)
                .map_err(refused("create a device"))?;
            let pool_info = vk::CommandPoolCreateInfo::default();
            let commands = device
                .create_command_pool(&pool_info, None)
                .map_err(refused("create a command pool"))?;
            Ok(Some(Self {
                name: format!("{name} {version}"),
                subgroup_size: subgroup.subgroup_size,
                subgroup_operations: subgroup.supported_operations,
                preserves_denormals: floats.shader_denorm_preserve_float16
                    & floats.shader_denorm_preserve_float32
                    & floats.shader_denorm_preserve_float64
                    == vk::TRUE,
                queue: device.get_device_queue(0, 0),
                commands,
                memory_type: memory_type as u32,
                instance,
                device,
                _entry: entry,
            }))
        }
    }

    /// Makes a kernel ready: its pipeline, its buffers with their contents, and its commands.
    ///
    /// # Errors
    /// [`Refused`] names the step that failed.
    pub fn prepare(&self, kernel: &Kernel) -> Result<Prepared<'_>, Refused> {
        let mut prepared = Prepared {
            context: self,
            buffers: Vec::new(),
            set_layout: vk::DescriptorSetLayout::null(),
            layout: vk::PipelineLayout::null(),
            pipeline: vk::Pipeline::null(),
            descriptors: vk::DescriptorPool::null(),
            commands: vk::CommandBuffer::null(),
        };
        for words in &kernel.buffers {
            let buffer = self.buffer(4 * words.len() as u64)?;
            prepared.buffers.push(buffer);
            buffer.write(&self.device, words)?;
        }
        prepared.create_pipeline(kernel)?;
        prepared.record(kernel)?;
        Ok(prepared)
    }

    fn buffer(&self, size: u64) -> Result<Buffer, Refused> {
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::UNIFORM_BUFFER;
        let info = vk::BufferCreateInfo::default().size(size).usage(usage);
        // SAFETY: the create infos are valid.
        unsafe {
            let buffer = self
                .device
                .create_buffer(&info, None)
                .map_err(refused("create a buffer"))?;
            let needed = self.device.get_buffer_memory_requirements(buffer);
            let info = vk::MemoryAllocateInfo::default()
                .allocation_size(needed.size)
                .memory_type_index(self.memory_type);
            let memory = self
                .device
                .allocate_memory(&info, None)
                .map_err(refused("allocate memory"))?;
            self.device
                .bind_buffer_memory(buffer, memory, 0)
                .map_err(refused("bind memory"))?;
            Ok(Buffer {
                buffer,
                memory,
                words: (size / 4) as usize,
            })
        }
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        // SAFETY: what was prepared borrows the context and is gone.
        unsafe {
            self.device.destroy_command_pool(self.commands, None);
            self.device.destroy_device(None);
            self.instance.destroy_instance(None);
        }
    }
}

/// A mappable buffer of words.
#[derive(Clone, Copy)]
struct Buffer {
    buffer: vk::Buffer,
    memory: vk::DeviceMemory,
    words: usize,
}

impl Buffer {
    /// Calls `access` with the buffer's first word.
    fn mapped<R>(
        self,
        device: &ash::Device,
        access: impl FnOnce(*mut u32) -> R,
    ) -> Result<R, Refused> {
        // SAFETY: the memory is mappable and not mapped.
        unsafe {
            let flags = vk::MemoryMapFlags::empty();
            let words = device
                .map_memory(self.memory, 0, vk::WHOLE_SIZE, flags)
                .map_err(refused("map memory"))?;
            let result = access(words.cast());
            device.unmap_memory(self.memory);
            Ok(result)
        }
    }

    fn write(self, device: &ash::Device, words: &[u32]) -> Result<(), Refused> {
        let count = words.len().min(self.words);
        // SAFETY: the mapping has as many words.
        self.mapped(device, |to| unsafe {
            to.copy_from_nonoverlapping(words.as_ptr(), count);
        })
    }

    fn read(self, device: &ash::Device) -> Result<Vec<u32>, Refused> {
        let mut words = vec![0; self.words];
        // SAFETY: the mapping has as many words.
        self.mapped(device, |from| unsafe {
            from.copy_to_nonoverlapping(words.as_mut_ptr(), self.words);
        })?;
        Ok(words)
    }
}

/// A kernel that is ready to run.
pub struct Prepared<'a> {
    context: &'a Context,
    buffers: Vec<Buffer>,
    set_layout: vk::DescriptorSetLayout,
    layout: vk::PipelineLayout,
    pipeline: vk::Pipeline,
    descriptors: vk::DescriptorPool,
    commands: vk::CommandBuffer,
}

impl Prepared<'_> {
    fn create_pipeline(&mut self, kernel: &Kernel) -> Result<(), Refused> {
        let device = &self.context.device;
        let bindings: Vec<_> = (0..kernel.buffers.len() as u32)
            .map(|binding| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(kernel.descriptor_type(binding))
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
            })
            .collect();
        let set_info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        let ranges = [vk::PushConstantRange::default()
            .stage_flags(vk::ShaderStageFlags::COMPUTE)
            .size(64)];
        let entries: Vec<_> = (0..)
            .zip(&kernel.specialization)
            .map(|(index, &(id, _))| {
                vk::SpecializationMapEntry::default()
                    .constant_id(id)
                    .offset(4 * index)
                    .size(4)
            })
            .collect();
        let values: Vec<u32> = kernel
            .specialization
            .iter()
            .map(|&(_, value)| value)
            .collect();
        let specialization = vk::SpecializationInfo::default()
            .map_entries(&entries)
            .data(bytemuck::cast_slice(&values));
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&kernel.spirv);
        // SAFETY: the create infos are valid.
        unsafe {
            self.set_layout = device
                .create_descriptor_set_layout(&set_info, None)
                .map_err(refused("create a descriptor set layout"))?;
            let set_layouts = [self.set_layout];
            let info = vk::PipelineLayoutCreateInfo::default()
                .set_layouts(&set_layouts)
                .push_constant_ranges(&ranges);
            self.layout = device
                .create_pipeline_layout(&info, None)
                .map_err(refused("create a pipeline layout"))?;
            let info = vk::ShaderModuleCreateInfo::default().code(&words);
            let module = device
                .create_shader_module(&info, None)
                .map_err(refused("create a shader module"))?;
            let stage = vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::COMPUTE)
                .module(module)
                .name(c"main")
                .specialization_info(&specialization);
            let infos = [vk::ComputePipelineCreateInfo::default()
                .stage(stage)
                .layout(self.layout)];
            let created = device.create_compute_pipelines(vk::PipelineCache::null(), &infos, None);
            device.destroy_shader_module(module, None);
            let pipelines =
                created.map_err(|(_, result)| refused("create a compute pipeline")(result))?;
            self.pipeline = pipelines[0];
            Ok(())
        }
    }

    fn record(&mut self, kernel: &Kernel) -> Result<(), Refused> {
        let device = &self.context.device;
        let sizes = [
            vk::DescriptorType::STORAGE_BUFFER,
            vk::DescriptorType::UNIFORM_BUFFER,
        ]
        .map(|ty| {
            vk::DescriptorPoolSize::default()
                .ty(ty)
                .descriptor_count(kernel.buffers.len() as u32)
        });
        let pool_info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(1)
            .pool_sizes(&sizes);
        let bind_point = vk::PipelineBindPoint::COMPUTE;
        let set_layouts = [self.set_layout];
        // SAFETY: the create infos are valid, and the commands follow Vulkan's valid usage.
        unsafe {
            self.descriptors = device
                .create_descriptor_pool(&pool_info, None)
                .map_err(refused("create a descriptor pool"))?;
            let info = vk::DescriptorSetAllocateInfo::default()
                .descriptor_pool(self.descriptors)
                .set_layouts(&set_layouts);
            let set = device
                .allocate_descriptor_sets(&info)
                .map_err(refused("allocate a descriptor set"))?[0];
            for (binding, buffer) in (0..).zip(&self.buffers) {
                let whole = [vk::DescriptorBufferInfo::default()
                    .buffer(buffer.buffer)
                    .range(vk::WHOLE_SIZE)];
                let write = vk::WriteDescriptorSet::default()
                    .dst_set(set)
                    .dst_binding(binding)
                    .descriptor_type(kernel.descriptor_type(binding))
                    .buffer_info(&whole);
                device.update_descriptor_sets(&[write], &[]);
            }
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(self.context.commands)
                .command_buffer_count(1);
            self.commands = device
                .allocate_command_buffers(&info)
                .map_err(refused("allocate a command buffer"))?[0];
            let info = vk::CommandBufferBeginInfo::default();
            device
                .begin_command_buffer(self.commands, &info)
                .map_err(refused("begin a command buffer"))?;
            device.cmd_bind_pipeline(self.commands, bind_point, self.pipeline);
            device.cmd_bind_descriptor_sets(self.commands, bind_point, self.layout, 0, &[set], &[]);
            let push = bytemuck::cast_slice(&kernel.push);
            if !push.is_empty() {
                let stage = vk::ShaderStageFlags::COMPUTE;
                device.cmd_push_constants(self.commands, self.layout, stage, 0, push);
            }
            let [x, y, z] = kernel.groups;
            device.cmd_dispatch(self.commands, x, y, z);
            device
                .end_command_buffer(self.commands)
                .map_err(refused("end a command buffer"))
        }
    }

    /// Runs it and waits for the end.
    ///
    /// # Errors
    /// [`Refused`], for example of a lost device.
    pub fn run(&self) -> Result<(), Refused> {
        let device = &self.context.device;
        let commands = [self.commands];
        let submits = [vk::SubmitInfo::default().command_buffers(&commands)];
        // SAFETY: the command buffer is executable and not pending.
        unsafe {
            device
                .queue_submit(self.context.queue, &submits, vk::Fence::null())
                .map_err(refused("submit"))?;
            device
                .queue_wait_idle(self.context.queue)
                .map_err(refused("wait"))
        }
    }

    /// What the buffer of a binding holds.
    ///
    /// # Errors
    /// [`Refused`] if it cannot be mapped.
    pub fn read(&self, binding: usize) -> Result<Vec<u32>, Refused> {
        self.buffers[binding].read(&self.context.device)
    }
}

impl Drop for Prepared<'_> {
    fn drop(&mut self) {
        let device = &self.context.device;
        // SAFETY: nothing is pending, since every run was waited for; null handles are allowed.
        unsafe {
            device.destroy_pipeline(self.pipeline, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_pool(self.descriptors, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
            for buffer in &self.buffers {
                device.destroy_buffer(buffer.buffer, None);
                device.free_memory(buffer.memory, None);
            }
        }
    }
}
