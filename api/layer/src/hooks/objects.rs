//! Objects of a device: memory, buffers, layouts, shaders, passes, pipelines, descriptors.

use std::collections::BTreeMap;
use std::ffi::c_void;
use std::sync::Arc;

use ash::vk;

use crate::device::Device;
use crate::objects::{Buffer, BufferDescriptor, LayoutBinding, Memory, Pipeline, Set, Subpass};
use crate::report::Faults;
use crate::request::Request;
use crate::rules;
use gaurast_layer_interface::{find, slice};

const FAILED: vk::Result = vk::Result::ERROR_INITIALIZATION_FAILED;

/// Hooks that look at what is destroyed, and pass it on.
macro_rules! destroys {
    ($($name:ident($object:ident: $type:ty) |$state:ident| $look:expr;)*) => {$(
        pub(super) unsafe extern "system" fn $name(
            device: vk::Device,
            $object: $type,
            allocator: *const vk::AllocationCallbacks<'_>,
        ) {
            // SAFETY: see the module above.
            let Some(own) = (unsafe { Device::of(device) }) else { return };
            own.observe(|$state, _| {
                $look;
            });
            if let Some(next) = own.next.$name {
                // SAFETY: see the module above.
                unsafe { next(device, $object, allocator) };
            }
        }
    )*};
}
destroys! {
    free_memory(memory: vk::DeviceMemory) |state| state.objects.memories.remove(&memory);
    destroy_buffer(buffer: vk::Buffer) |state| state.objects.buffers.remove(&buffer);
    destroy_shader_module(module: vk::ShaderModule) |state| state.objects.modules.remove(&module);
    destroy_descriptor_set_layout(layout: vk::DescriptorSetLayout) |state| state.objects.set_layouts.remove(&layout);
    destroy_pipeline_layout(layout: vk::PipelineLayout) |state| state.objects.layouts.remove(&layout);
    destroy_render_pass(pass: vk::RenderPass) |state| state.objects.render_passes.remove(&pass);
    destroy_pipeline(pipeline: vk::Pipeline) |state| {
        state.objects.pipelines.remove(&pipeline);
        state.libraries.remove(&pipeline);
    };
    destroy_descriptor_pool(pool: vk::DescriptorPool) |state| state.objects.sets.retain(|_, set| set.pool != pool);
    destroy_command_pool(pool: vk::CommandPool) |state| state.recordings.retain(|_, recording| recording.pool != pool);
}

/// Hooks that look at what was created, and at the device if it is named.
macro_rules! creates {
    ($($name:ident($info:ident: $info_type:ty, $object:ident: $type:ty) $(with $own:ident)?
        |$state:ident| $look:block)*) => {$(
        pub(super) unsafe extern "system" fn $name(
            device: vk::Device,
            info: *const $info_type,
            allocator: *const vk::AllocationCallbacks<'_>,
            object: *mut $type,
        ) -> vk::Result {
            // SAFETY: see the module above.
            unsafe {
                let Some(above) = Device::of(device) else { return FAILED };
                $(let $own = &above;)?
                let Some(next) = above.next.$name else { return FAILED };
                let result = next(device, info, allocator, object);
                if result == vk::Result::SUCCESS {
                    let ($info, $object) = (&*info, *object);
                    above.observe(|$state, _| $look);
                }
                result
            }
        }
    )*};
}
creates! {
    allocate_memory(info: vk::MemoryAllocateInfo<'_>, memory: vk::DeviceMemory) with own |state| {
        let known = Memory {
            size: info.allocation_size,
            is_mappable: own.facts.mappable & 1 << info.memory_type_index != 0,
            mapped: None,
        };
        state.objects.memories.insert(memory, known);
    }
    create_buffer(info: vk::BufferCreateInfo<'_>, buffer: vk::Buffer) |state| {
        let storage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::STORAGE_TEXEL_BUFFER;
        let known = Buffer {
            serial: state.objects.next_serial(),
            size: info.size,
            may_be_storage: info.usage.intersects(storage),
            memory: None,
            address: None,
            is_written: !info.flags.is_empty(),
            shadow: BTreeMap::new(),
        };
        state.objects.buffers.insert(buffer, known);
    }
    create_shader_module(info: vk::ShaderModuleCreateInfo<'_>, module: vk::ShaderModule) |state| {
        let count = u32::try_from(info.code_size / 4).unwrap_or(0);
        let words = slice(info.p_code, count).to_vec();
        state.objects.modules.insert(module, Arc::new(words));
    }
    create_descriptor_set_layout(info: vk::DescriptorSetLayoutCreateInfo<'_>, layout: vk::DescriptorSetLayout)
        |state| {
        let bindings = slice(info.p_bindings, info.binding_count).iter();
        let mut known: Vec<_> = bindings
            .map(|binding| LayoutBinding {
                binding: binding.binding,
                ty: binding.descriptor_type,
                count: binding.descriptor_count,
                stages: binding.stage_flags,
            })
            .collect();
        known.sort_by_key(|binding| binding.binding);
        state.objects.set_layouts.insert(layout, Arc::new(known));
    }
    create_pipeline_layout(info: vk::PipelineLayoutCreateInfo<'_>, layout: vk::PipelineLayout) |state| {
        let sets = slice(info.p_set_layouts, info.set_layout_count).iter();
        let known = sets.map(|set| state.objects.set_layouts.get(set).cloned()).collect();
        state.objects.layouts.insert(layout, Arc::new(known));
    }
    create_render_pass(info: vk::RenderPassCreateInfo<'_>, pass: vk::RenderPass) |state| {
        let attachments = slice(info.p_attachments, info.attachment_count);
        let attachments: Vec<_> =
            attachments.iter().map(|a| AttachmentUse { format: a.format, load: a.load_op }).collect();
        let views = find::<vk::RenderPassMultiviewCreateInfo<'_>>(info.p_next);
        let masks = views.map(|views| slice(views.p_view_masks, views.subpass_count)).unwrap_or_default();
        let subpasses = slice(info.p_subpasses, info.subpass_count).iter().enumerate();
        let known = subpasses
            .map(|(index, subpass)| {
                let colors = slice(subpass.p_color_attachments, subpass.color_attachment_count);
                let colors: Vec<_> = colors.iter().map(|reference| reference.attachment).collect();
                let depth = subpass.p_depth_stencil_attachment.as_ref();
                let depth = depth.map(|reference| reference.attachment);
                subpass_of(&attachments, &colors, depth, masks.get(index).copied().unwrap_or(0), index)
            })
            .collect();
        state.objects.render_passes.insert(pass, Arc::new(known));
    }
    create_render_pass2(info: vk::RenderPassCreateInfo2<'_>, pass: vk::RenderPass) |state| {
        let attachments = slice(info.p_attachments, info.attachment_count);
        let attachments: Vec<_> =
            attachments.iter().map(|a| AttachmentUse { format: a.format, load: a.load_op }).collect();
        let subpasses = slice(info.p_subpasses, info.subpass_count).iter().enumerate();
        let known = subpasses
            .map(|(index, subpass)| {
                let colors = slice(subpass.p_color_attachments, subpass.color_attachment_count);
                let colors: Vec<_> = colors.iter().map(|reference| reference.attachment).collect();
                let depth = subpass.p_depth_stencil_attachment.as_ref();
                let depth = depth.map(|reference| reference.attachment);
                subpass_of(&attachments, &colors, depth, subpass.view_mask, index)
            })
            .collect();
        state.objects.render_passes.insert(pass, Arc::new(known));
    }
}

/// An attachment of a render pass.
#[derive(Clone, Copy)]
struct AttachmentUse {
    format: vk::Format,
    load: vk::AttachmentLoadOp,
}

/// A subpass by its attachments' numbers.
fn subpass_of(
    attachments: &[AttachmentUse],
    colors: &[u32],
    depth: Option<u32>,
    view_mask: u32,
    index: usize,
) -> Subpass {
    let at = |number: u32| attachments.get(number as usize).copied();
    let colors = colors.iter().map(|&number| match at(number) {
        // What an earlier subpass has drawn is not followed.
        Some(used) => (used.format, index == 0 && used.load == vk::AttachmentLoadOp::LOAD),
        None => (vk::Format::UNDEFINED, false),
    });
    let is_cleared = |number: &u32| at(*number).is_some_and(|used| used.load == vk::AttachmentLoadOp::CLEAR);
    Subpass {
        view_mask,
        colors: colors.collect(),
        depth: depth.and_then(at).map(|used| used.format).unwrap_or_default(),
        cleared_depth: depth.filter(|number| index == 0 && is_cleared(number)),
    }
}

pub(super) unsafe extern "system" fn destroy_device(device: vk::Device, allocator: *const vk::AllocationCallbacks<'_>) {
    if device == vk::Device::null() {
        return;
    }
    // SAFETY: see the module above.
    unsafe {
        let Some(own) = Device::forget(device) else {
            return;
        };
        if let Some(next) = own.next.destroy_device {
            next(device, allocator);
        }
    }
}

pub(super) unsafe extern "system" fn map_memory(
    device: vk::Device,
    memory: vk::DeviceMemory,
    offset: vk::DeviceSize,
    size: vk::DeviceSize,
    flags: vk::MemoryMapFlags,
    data: *mut *mut c_void,
) -> vk::Result {
    // SAFETY: see the module above.
    unsafe {
        map(device, memory, [offset, size], data, |own| {
            Some(own.next.map_memory?(device, memory, offset, size, flags, data))
        })
    }
}

pub(super) unsafe extern "system" fn map_memory2(
    device: vk::Device,
    info: *const vk::MemoryMapInfoKHR<'_>,
    data: *mut *mut c_void,
) -> vk::Result {
    // SAFETY: see the module above.
    unsafe {
        let range = [(*info).offset, (*info).size];
        map(device, (*info).memory, range, data, |own| Some(own.next.map_memory2?(device, info, data)))
    }
}

/// Maps memory by `next`, which writes to `data` where its `range`, an offset and a size, lies.
///
/// # Safety
/// `data` is valid.
unsafe fn map(
    device: vk::Device,
    memory: vk::DeviceMemory,
    [offset, size]: [vk::DeviceSize; 2],
    data: *const *mut c_void,
    next: impl FnOnce(&Device) -> Option<vk::Result>,
) -> vk::Result {
    // SAFETY: see the module above.
    let Some(own) = (unsafe { Device::of(device) }) else {
        return FAILED;
    };
    // Locked, since the layer may map the memory for a while.
    let mut state = own.lock();
    let result = next(&own).unwrap_or(FAILED);
    if result == vk::Result::SUCCESS
        && let Some(known) = state.objects.memories.get_mut(&memory)
    {
        // SAFETY: the mapping has succeeded, so that the pointer is written.
        known.map(unsafe { *data } as usize, offset, size);
    }
    result
}

pub(super) unsafe extern "system" fn unmap_memory(device: vk::Device, memory: vk::DeviceMemory) {
    // SAFETY: see the module above.
    unsafe {
        let _done = unmap(device, memory, |own| {
            own.next.unmap_memory?(device, memory);
            Some(vk::Result::SUCCESS)
        });
    }
}

pub(super) unsafe extern "system" fn unmap_memory2(
    device: vk::Device,
    info: *const vk::MemoryUnmapInfoKHR<'_>,
) -> vk::Result {
    // SAFETY: see the module above.
    unsafe { unmap(device, (*info).memory, |own| Some(own.next.unmap_memory2?(device, info))) }
}

/// Unmaps memory by `next`.
///
/// # Safety
/// `device` is valid.
unsafe fn unmap(
    device: vk::Device,
    memory: vk::DeviceMemory,
    next: impl FnOnce(&Device) -> Option<vk::Result>,
) -> vk::Result {
    // SAFETY: see the module above.
    let Some(own) = (unsafe { Device::of(device) }) else {
        return FAILED;
    };
    // Locked, so that the layer does not read memory that is going away.
    let mut state = own.lock();
    if let Some(known) = state.objects.memories.get_mut(&memory) {
        known.mapped = None;
    }
    next(&own).unwrap_or(FAILED)
}

pub(super) unsafe extern "system" fn bind_buffer_memory(
    device: vk::Device,
    buffer: vk::Buffer,
    memory: vk::DeviceMemory,
    offset: vk::DeviceSize,
) -> vk::Result {
    // SAFETY: see the module above.
    unsafe {
        let Some(own) = Device::of(device) else {
            return FAILED;
        };
        let Some(next) = own.next.bind_buffer_memory else {
            return FAILED;
        };
        own.observe(|state, _| {
            if let Some(known) = state.objects.buffers.get_mut(&buffer) {
                known.memory = Some((memory, offset));
            }
        });
        next(device, buffer, memory, offset)
    }
}

pub(super) unsafe extern "system" fn bind_buffer_memory2(
    device: vk::Device,
    count: u32,
    infos: *const vk::BindBufferMemoryInfo<'_>,
) -> vk::Result {
    // SAFETY: see the module above.
    unsafe {
        let Some(own) = Device::of(device) else {
            return FAILED;
        };
        let Some(next) = own.next.bind_buffer_memory2 else {
            return FAILED;
        };
        own.observe(|state, _| {
            for info in slice(infos, count) {
                if let Some(known) = state.objects.buffers.get_mut(&info.buffer) {
                    known.memory = Some((info.memory, info.memory_offset));
                }
            }
        });
        next(device, count, infos)
    }
}

pub(super) unsafe extern "system" fn get_buffer_device_address(
    device: vk::Device,
    info: *const vk::BufferDeviceAddressInfo<'_>,
) -> vk::DeviceAddress {
    // SAFETY: see the module above.
    unsafe {
        let Some(own) = Device::of(device) else {
            return 0;
        };
        let Some(next) = own.next.get_buffer_device_address else {
            return 0;
        };
        let address = next(device, info);
        own.observe(|state, _| {
            if let Some(known) = state.objects.buffers.get_mut(&(*info).buffer) {
                known.address = Some(address);
                // Shaders may write it.
                known.is_written = true;
            }
        });
        address
    }
}

pub(super) unsafe extern "system" fn create_graphics_pipelines(
    device: vk::Device,
    cache: vk::PipelineCache,
    count: u32,
    infos: *const vk::GraphicsPipelineCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    pipelines: *mut vk::Pipeline,
) -> vk::Result {
    // SAFETY: see the module above.
    unsafe {
        let Some(own) = Device::of(device) else {
            return FAILED;
        };
        let Some(next) = own.next.create_graphics_pipelines else {
            return FAILED;
        };
        let mut requests = Vec::new();
        own.observe(|state, faults| {
            for info in slice(infos, count) {
                let mut request = Request::read(info, &state.objects, &state.libraries);
                let mut of_this = Faults::default();
                if !request.is_whole() {
                    rules::pipeline::check_library(&request, &own.facts, &mut of_this);
                } else if !request.is_wrong {
                    rules::pipeline::check(&request, &own.facts, &mut of_this);
                }
                request.is_wrong |= !of_this.is_empty();
                faults.0.append(&mut of_this.0);
                requests.push(request);
            }
        });
        let result = next(device, cache, count, infos, allocator, pipelines);
        own.observe(|state, _| {
            for (&pipeline, request) in slice(pipelines, count).iter().zip(requests) {
                if pipeline == vk::Pipeline::null() {
                    continue;
                }
                if request.is_library {
                    state.libraries.insert(pipeline, Arc::new(request));
                } else if request.is_whole() {
                    let serial = state.objects.next_serial();
                    let known = Arc::new(pipeline_of(request, serial));
                    state.objects.pipelines.insert(pipeline, known);
                }
            }
        });
        result
    }
}

fn pipeline_of(request: Request, serial: u64) -> Pipeline {
    let is_blended = request.blend.first().is_some_and(|blend| blend.blend_enable != 0);
    let writes = request.blend.first().is_some_and(|blend| !blend.color_write_mask.is_empty());
    let has_fragment = request.has(vk::ShaderStageFlags::FRAGMENT);
    let reads_constants = request.reads_constants();
    let (bindings, attributes) = request.vertex_input.unwrap_or_default();
    Pipeline {
        serial,
        gaussian: request.gaussian.filter(|_| request.draws_gaussians),
        approximation: request.approximation,
        decoding: request.decoding,
        has_fragment,
        dynamic: request.dynamic,
        bindings,
        attributes,
        replaces: writes && !is_blended && !request.has_logic_op,
        viewport: request.viewport,
        depth_range: request.depth_range,
        depth: request.depth,
        reads_constants,
    }
}

pub(super) unsafe extern "system" fn allocate_descriptor_sets(
    device: vk::Device,
    info: *const vk::DescriptorSetAllocateInfo<'_>,
    sets: *mut vk::DescriptorSet,
) -> vk::Result {
    // SAFETY: see the module above.
    unsafe {
        let Some(own) = Device::of(device) else {
            return FAILED;
        };
        let Some(next) = own.next.allocate_descriptor_sets else {
            return FAILED;
        };
        let result = next(device, info, sets);
        if result == vk::Result::SUCCESS {
            own.observe(|state, _| {
                let count = (*info).descriptor_set_count;
                let layouts = slice((*info).p_set_layouts, count);
                for (&set, layout) in slice(sets, count).iter().zip(layouts) {
                    let known = Set {
                        serial: state.objects.next_serial(),
                        layout: state.objects.set_layouts.get(layout).cloned(),
                        pool: (*info).descriptor_pool,
                        buffers: BTreeMap::new(),
                        is_unknown: false,
                    };
                    state.objects.sets.insert(set, known);
                }
            });
        }
        result
    }
}

pub(super) unsafe extern "system" fn free_descriptor_sets(
    device: vk::Device,
    pool: vk::DescriptorPool,
    count: u32,
    sets: *const vk::DescriptorSet,
) -> vk::Result {
    // SAFETY: see the module above.
    unsafe {
        let Some(own) = Device::of(device) else {
            return FAILED;
        };
        let Some(next) = own.next.free_descriptor_sets else {
            return FAILED;
        };
        own.observe(|state, _| {
            for set in slice(sets, count) {
                state.objects.sets.remove(set);
            }
        });
        next(device, pool, count, sets)
    }
}

pub(super) unsafe extern "system" fn reset_descriptor_pool(
    device: vk::Device,
    pool: vk::DescriptorPool,
    flags: vk::DescriptorPoolResetFlags,
) -> vk::Result {
    // SAFETY: see the module above.
    unsafe {
        let Some(own) = Device::of(device) else {
            return FAILED;
        };
        let Some(next) = own.next.reset_descriptor_pool else {
            return FAILED;
        };
        own.observe(|state, _| state.objects.sets.retain(|_, set| set.pool != pool));
        next(device, pool, flags)
    }
}

/// The types of descriptors that are buffers with an offset and a range.
fn is_buffer(ty: vk::DescriptorType) -> bool {
    use vk::DescriptorType as Type;
    [Type::UNIFORM_BUFFER, Type::UNIFORM_BUFFER_DYNAMIC, Type::STORAGE_BUFFER, Type::STORAGE_BUFFER_DYNAMIC]
        .contains(&ty)
}

/// Reports whether shaders may write through a descriptor.
pub(super) fn is_storage(ty: vk::DescriptorType) -> bool {
    use vk::DescriptorType as Type;
    [Type::STORAGE_BUFFER, Type::STORAGE_BUFFER_DYNAMIC, Type::STORAGE_TEXEL_BUFFER].contains(&ty)
}

/// The buffers that a write of descriptors names, by binding; those of arrays beyond the first are left out.
///
/// # Safety
/// The write is valid.
pub(super) unsafe fn written_buffers(write: &vk::WriteDescriptorSet<'_>) -> Vec<(u32, vk::DescriptorBufferInfo)> {
    if !is_buffer(write.descriptor_type) {
        return Vec::new();
    }
    // SAFETY: the caller's promise: a write of buffers has an array of them.
    let buffers = unsafe { slice(write.p_buffer_info, write.descriptor_count) };
    (write.dst_binding..).zip(buffers.iter().copied()).collect()
}

pub(super) unsafe extern "system" fn update_descriptor_sets(
    device: vk::Device,
    write_count: u32,
    writes: *const vk::WriteDescriptorSet<'_>,
    copy_count: u32,
    copies: *const vk::CopyDescriptorSet<'_>,
) {
    // SAFETY: see the module above.
    unsafe {
        let Some(own) = Device::of(device) else {
            return;
        };
        own.observe(|state, _| {
            for write in slice(writes, write_count) {
                let buffers = written_buffers(write);
                let serial = buffers.first().map_or(0, |(_, info)| state.objects.serial_of(info.buffer));
                for (_, info) in buffers.iter().filter(|_| is_storage(write.descriptor_type)) {
                    if let Some(known) = state.objects.buffers.get_mut(&info.buffer) {
                        known.is_written = true;
                    }
                }
                let Some(set) = state.objects.sets.get_mut(&write.dst_set) else {
                    continue;
                };
                let first = buffers.first().filter(|_| write.dst_array_element == 0);
                if let Some(&(binding, info)) = first {
                    let (buffer, offset, range) = (info.buffer, info.offset, info.range);
                    set.buffers.insert(binding, BufferDescriptor { buffer, serial, offset, range });
                }
            }
            for copy in slice(copies, copy_count) {
                if let Some(set) = state.objects.sets.get_mut(&copy.dst_set) {
                    set.is_unknown = true;
                }
            }
        });
        if let Some(next) = own.next.update_descriptor_sets {
            next(device, write_count, writes, copy_count, copies);
        }
    }
}

pub(super) unsafe extern "system" fn update_descriptor_set_with_template(
    device: vk::Device,
    set: vk::DescriptorSet,
    template: vk::DescriptorUpdateTemplate,
    data: *const c_void,
) {
    // SAFETY: see the module above.
    unsafe {
        let Some(own) = Device::of(device) else {
            return;
        };
        own.observe(|state, _| {
            if let Some(set) = state.objects.sets.get_mut(&set) {
                set.is_unknown = true;
            }
            // Which buffers shaders may write through it is not known: the layer is sure of none.
            for buffer in state.objects.buffers.values_mut() {
                buffer.is_written |= buffer.may_be_storage;
            }
        });
        if let Some(next) = own.next.update_descriptor_set_with_template {
            next(device, set, template, data);
        }
    }
}
