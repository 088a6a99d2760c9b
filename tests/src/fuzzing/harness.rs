//! A device that runs what it is given, and looks afterwards whether anything outside the bound ranges was written.

use ash::vk;
use gaurast_spirv::{DescriptorKind, Module, Options, Specialization, Stage, translate};

/// Bytes of each bound range, and of the guards before and after it.
const RANGE: u64 = 1024;
/// Bindings at most.
const MOST_BINDINGS: usize = 16;
const GUARD: u8 = 0xa5;
const PUSH_BYTES: usize = 128;

/// What became of a module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// No shader module or pipeline came of it.
    Refused,
    /// It ran to its end.
    Ran,
    /// It took too long, or went wrong, and the device was lost.
    Lost,
}

/// The descriptors that a module asks for, by set and binding.
#[derive(Clone, Debug, Default)]
pub struct Layout(Vec<(u32, u32, u32, vk::DescriptorType)>);

impl Layout {
    /// What a module asks for; `None` if it isn't one, or asks for anything but buffers.
    pub fn of(words: &[u32]) -> Option<Self> {
        let module = Module::parse(words).ok()?;
        let (specialization, options) = (Specialization::default(), Options::default());
        let shader = translate(&module, "main", Stage::Compute, &specialization, &options).ok()?;
        let mut all = Vec::new();
        for it in &shader.interface.descriptors {
            let ty = match it.kind {
                DescriptorKind::UniformBuffer => vk::DescriptorType::UNIFORM_BUFFER,
                DescriptorKind::StorageBuffer => vk::DescriptorType::STORAGE_BUFFER,
                _ => return None,
            };
            all.push((it.set, it.binding, it.count, ty));
        }
        let count: u32 = all.iter().map(|it| it.2).sum();
        let fits = count as usize <= MOST_BINDINGS && all.iter().all(|it| it.0 < 4);
        fits.then_some(Self(all))
    }
}

/// A device, and memory with guarded ranges.
pub struct Harness {
    entry: ash::Entry,
    open: Option<Open>,
}

impl Default for Harness {
    fn default() -> Self {
        Self::new()
    }
}

impl Harness {
    /// Opens this driver's device. How long a dispatch may take comes from the environment, as for any application.
    pub fn new() -> Self {
        Self {
            entry: vulkan_gaurast::entry(),
            open: None,
        }
    }

    /// Takes words through a shader module, a pipeline and a dispatch of two workgroups.
    ///
    /// # Panics
    /// If memory outside the bound ranges was written, or the device can't do something that doesn't depend on the
    /// words.
    pub fn run(&mut self, words: &[u32], layout: &Layout) -> Outcome {
        let entry = &self.entry;
        let open = self.open.get_or_insert_with(|| Open::new(entry));
        let outcome = open.run(words, layout);
        if outcome == Outcome::Lost {
            self.open = None;
        }
        outcome
    }
}

struct Open {
    instance: ash::Instance,
    device: ash::Device,
    queue: vk::Queue,
    commands: vk::CommandPool,
    buffer: vk::Buffer,
    memory: vk::DeviceMemory,
    mapped: *mut u8,
}

/// Bytes of all ranges with their guards.
const BYTES: usize = (2 * MOST_BINDINGS + 1) * RANGE as usize;

// `unsafe` here has one reason throughout: these are Vulkan calls that follow Vulkan's valid usage, but for the words.
impl Open {
    fn new(entry: &ash::Entry) -> Self {
        // SAFETY: see above.
        unsafe {
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
            let info = vk::InstanceCreateInfo::default().application_info(&application);
            let instance = entry.create_instance(&info, None).expect("an instance");
            let physical = instance.enumerate_physical_devices().expect("devices")[0];
            let mut core_1_1 = vk::PhysicalDeviceVulkan11Features::default();
            let mut core_1_2 = vk::PhysicalDeviceVulkan12Features::default();
            let mut features = vk::PhysicalDeviceFeatures2::default()
                .push_next(&mut core_1_1)
                .push_next(&mut core_1_2);
            instance.get_physical_device_features2(physical, &mut features);
            let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
            let info = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .push_next(&mut features);
            let device = instance
                .create_device(physical, &info, None)
                .expect("a device");
            let commands = device
                .create_command_pool(&vk::CommandPoolCreateInfo::default(), None)
                .expect("a command pool");
            let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::UNIFORM_BUFFER;
            let info = vk::BufferCreateInfo::default()
                .size(BYTES as u64)
                .usage(usage);
            let buffer = device.create_buffer(&info, None).expect("a buffer");
            let needed = device.get_buffer_memory_requirements(buffer);
            let wanted =
                vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
            let types = instance.get_physical_device_memory_properties(physical);
            let memory_type = types
                .memory_types_as_slice()
                .iter()
                .position(|ty| ty.property_flags.contains(wanted))
                .expect("mappable memory");
            let info = vk::MemoryAllocateInfo::default()
                .allocation_size(needed.size)
                .memory_type_index(memory_type as u32);
            let memory = device.allocate_memory(&info, None).expect("memory");
            device
                .bind_buffer_memory(buffer, memory, 0)
                .expect("bound memory");
            let flags = vk::MemoryMapFlags::empty();
            let mapped = device
                .map_memory(memory, 0, vk::WHOLE_SIZE, flags)
                .expect("mapped memory");
            Self {
                queue: device.get_device_queue(0, 0),
                mapped: mapped.cast(),
                instance,
                device,
                commands,
                buffer,
                memory,
            }
        }
    }

    /// Guards everywhere, and small numbers within the ranges.
    fn fill(&self) {
        let mut bytes = vec![GUARD; BYTES];
        for range in bytes.chunks_mut(RANGE as usize).skip(1).step_by(2) {
            for (index, byte) in range.iter_mut().enumerate() {
                *byte = if index % 4 == 0 { index as u8 % 23 } else { 0 };
            }
        }
        // SAFETY: the mapping has as many bytes, and nothing is pending.
        unsafe { self.mapped.copy_from_nonoverlapping(bytes.as_ptr(), BYTES) };
    }

    fn check_guards(&self) {
        let mut bytes = vec![0; BYTES];
        // SAFETY: the mapping has as many bytes, and nothing is pending.
        unsafe {
            self.mapped
                .copy_to_nonoverlapping(bytes.as_mut_ptr(), BYTES);
        };
        for (index, guard) in bytes.chunks(RANGE as usize).step_by(2).enumerate() {
            let written = guard.iter().position(|byte| *byte != GUARD);
            assert_eq!(written, None, "guard {index} was written to");
        }
    }

    fn run(&self, words: &[u32], layout: &Layout) -> Outcome {
        let device = &self.device;
        let info = vk::ShaderModuleCreateInfo::default().code(words);
        // SAFETY: see above.
        unsafe {
            let Ok(module) = device.create_shader_module(&info, None) else {
                return Outcome::Refused;
            };
            let set_layouts = self.set_layouts(layout);
            let ranges = [vk::PushConstantRange::default()
                .stage_flags(vk::ShaderStageFlags::COMPUTE)
                .size(PUSH_BYTES as u32)];
            let info = vk::PipelineLayoutCreateInfo::default()
                .set_layouts(&set_layouts)
                .push_constant_ranges(&ranges);
            let pipeline_layout = device
                .create_pipeline_layout(&info, None)
                .expect("a pipeline layout");
            let stage = vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::COMPUTE)
                .module(module)
                .name(c"main");
            let infos = [vk::ComputePipelineCreateInfo::default()
                .stage(stage)
                .layout(pipeline_layout)];
            let created = device.create_compute_pipelines(vk::PipelineCache::null(), &infos, None);
            device.destroy_shader_module(module, None);
            let outcome = match created {
                Ok(pipelines) => {
                    self.fill();
                    let ran = self.dispatch(pipelines[0], pipeline_layout, &set_layouts, layout);
                    self.check_guards();
                    device.destroy_pipeline(pipelines[0], None);
                    match ran {
                        Ok(()) => Outcome::Ran,
                        Err(vk::Result::ERROR_DEVICE_LOST) => Outcome::Lost,
                        Err(error) => panic!("the dispatch gave {error}"),
                    }
                }
                Err(_) => Outcome::Refused,
            };
            device.destroy_pipeline_layout(pipeline_layout, None);
            for set_layout in set_layouts {
                device.destroy_descriptor_set_layout(set_layout, None);
            }
            outcome
        }
    }

    fn set_layouts(&self, layout: &Layout) -> Vec<vk::DescriptorSetLayout> {
        let sets = layout.0.iter().map(|it| it.0 + 1).max().unwrap_or(0);
        (0..sets)
            .map(|set| {
                let bindings: Vec<_> = layout
                    .0
                    .iter()
                    .filter(|it| it.0 == set)
                    .map(|(_, binding, count, ty)| {
                        vk::DescriptorSetLayoutBinding::default()
                            .binding(*binding)
                            .descriptor_type(*ty)
                            .descriptor_count(*count)
                            .stage_flags(vk::ShaderStageFlags::COMPUTE)
                    })
                    .collect();
                let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
                // SAFETY: see above.
                unsafe { self.device.create_descriptor_set_layout(&info, None) }
                    .expect("a set layout")
            })
            .collect()
    }

    /// Sets whose descriptors are the guarded ranges, one after another.
    fn sets(
        &self,
        pool: vk::DescriptorPool,
        set_layouts: &[vk::DescriptorSetLayout],
        layout: &Layout,
    ) -> Vec<vk::DescriptorSet> {
        if set_layouts.is_empty() {
            return Vec::new();
        }
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(pool)
            .set_layouts(set_layouts);
        // SAFETY: see above.
        let sets = unsafe { self.device.allocate_descriptor_sets(&info) }.expect("sets");
        let mut offset = RANGE;
        for (set, binding, count, ty) in &layout.0 {
            for element in 0..*count {
                let range = [vk::DescriptorBufferInfo::default()
                    .buffer(self.buffer)
                    .offset(offset)
                    .range(RANGE)];
                offset += 2 * RANGE;
                let write = vk::WriteDescriptorSet::default()
                    .dst_set(sets[*set as usize])
                    .dst_binding(*binding)
                    .dst_array_element(element)
                    .descriptor_type(*ty)
                    .buffer_info(&range);
                // SAFETY: see above.
                unsafe { self.device.update_descriptor_sets(&[write], &[]) };
            }
        }
        sets
    }

    fn dispatch(
        &self,
        pipeline: vk::Pipeline,
        pipeline_layout: vk::PipelineLayout,
        set_layouts: &[vk::DescriptorSetLayout],
        layout: &Layout,
    ) -> Result<(), vk::Result> {
        let device = &self.device;
        let point = vk::PipelineBindPoint::COMPUTE;
        let sizes = [
            vk::DescriptorType::STORAGE_BUFFER,
            vk::DescriptorType::UNIFORM_BUFFER,
        ]
        .map(|ty| {
            vk::DescriptorPoolSize::default()
                .ty(ty)
                .descriptor_count(MOST_BINDINGS as u32)
        });
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(4)
            .pool_sizes(&sizes);
        // SAFETY: see above.
        unsafe {
            let pool = device
                .create_descriptor_pool(&info, None)
                .expect("a descriptor pool");
            let sets = self.sets(pool, set_layouts, layout);
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(self.commands)
                .command_buffer_count(1);
            let commands = device
                .allocate_command_buffers(&info)
                .expect("a command buffer");
            let info = vk::CommandBufferBeginInfo::default();
            device.begin_command_buffer(commands[0], &info)?;
            device.cmd_bind_pipeline(commands[0], point, pipeline);
            if !sets.is_empty() {
                device.cmd_bind_descriptor_sets(commands[0], point, pipeline_layout, 0, &sets, &[]);
            }
            let push: [u8; PUSH_BYTES] =
                std::array::from_fn(|index| if index % 4 == 0 { index as u8 % 9 } else { 0 });
            let stage = vk::ShaderStageFlags::COMPUTE;
            device.cmd_push_constants(commands[0], pipeline_layout, stage, 0, &push);
            device.cmd_dispatch(commands[0], 2, 1, 1);
            let ran = device.end_command_buffer(commands[0]).and_then(|()| {
                let submits = [vk::SubmitInfo::default().command_buffers(&commands)];
                device.queue_submit(self.queue, &submits, vk::Fence::null())?;
                device.queue_wait_idle(self.queue)
            });
            device.free_command_buffers(self.commands, &commands);
            device.destroy_descriptor_pool(pool, None);
            ran
        }
    }
}

impl Drop for Open {
    fn drop(&mut self) {
        // SAFETY: see above.
        unsafe {
            self.device.destroy_buffer(self.buffer, None);
            self.device.free_memory(self.memory, None);
            self.device.destroy_command_pool(self.commands, None);
            self.device.destroy_device(None);
            self.instance.destroy_instance(None);
        }
    }
}
