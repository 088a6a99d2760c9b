//! Devices, memory, buffers, layouts, render passes and pipelines.

use std::collections::HashMap;
use std::sync::Arc;

use ash::vk;
use gaurast::vk::{
    PipelineGaussianFootprintStateCreateInfoGAURAST as Footprint, PipelineGaussianStateCreateInfoGAURAST as State,
    PipelineGaussianUnscentedStateCreateInfoGAURAST as SigmaPoints,
};
use gaurast_layer_interface::{find_mut, slice};

use crate::device::Device;
use crate::emulation::{Emulation, Objects};
use crate::hooks::site::call;
use crate::library::{self, Library};
use crate::pipeline::{self, Context, Pipeline};
use crate::projecting;
use crate::render_pass;
use crate::resolve;
use crate::unlinked::Unlinked;

pub(super) unsafe extern "system" fn destroy_device(device: vk::Device, allocator: *const vk::AllocationCallbacks<'_>) {
    // SAFETY: see the crate.
    unsafe {
        if device == vk::Device::null() {
            return;
        }
        if let Some(own) = Device::forget(device) {
            own.clear();
            let next = Arc::clone(&own.next);
            // The kernels go before the device does.
            drop(own);
            next.destroy_device(allocator.as_ref());
        }
    }
}

pub(super) unsafe extern "system" fn allocate_memory(
    device: vk::Device,
    info: *const vk::MemoryAllocateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    memory: *mut vk::DeviceMemory,
) -> vk::Result {
    // SAFETY: see the crate.
    unsafe {
        call(device, |own| {
            let allocate = own.next.fp_v1_0().allocate_memory;
            if own.emulation.is_none() {
                return allocate(device, info, allocator, memory);
            }
            // Buffers are read by their addresses.
            let mut info = *info;
            let wanted = vk::MemoryAllocateFlags::DEVICE_ADDRESS;
            let mut added = vk::MemoryAllocateFlagsInfo::default().flags(wanted);
            let there = find_mut::<vk::MemoryAllocateFlagsInfo<'_>>(info.p_next.cast_mut());
            let before = there.map(|there| {
                let flags = there.flags;
                if !flags.contains(wanted) {
                    there.flags |= wanted;
                }
                (&raw mut there.flags, flags)
            });
            if before.is_none() {
                added.p_next = info.p_next;
                info.p_next = (&raw const added).cast();
            }
            let result = allocate(device, &raw const info, allocator, memory);
            if let Some((place, flags)) = before
                && *place != flags
            {
                *place = flags;
            }
            result
        })
    }
}

pub(super) unsafe extern "system" fn create_buffer(
    device: vk::Device,
    info: *const vk::BufferCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    buffer: *mut vk::Buffer,
) -> vk::Result {
    use vk::BufferUsageFlags as Usage;
    // SAFETY: see the crate.
    unsafe {
        call(device, |own| {
            let create = own.next.fp_v1_0().create_buffer;
            let Some(emulation) = &own.emulation else {
                return create(device, info, allocator, buffer);
            };
            let mut info = *info;
            if info.usage.intersects(Usage::VERTEX_BUFFER | Usage::INDEX_BUFFER | Usage::INDIRECT_BUFFER) {
                info.usage |= Usage::SHADER_DEVICE_ADDRESS;
            }
            let result = create(device, &raw const info, allocator, buffer);
            if result == vk::Result::SUCCESS {
                emulation.objects_mut().buffers.insert(*buffer, info.size);
            }
            result
        })
    }
}

pub(super) unsafe extern "system" fn destroy_buffer(
    device: vk::Device,
    buffer: vk::Buffer,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        let _ = call(device, |own| {
            if let Some(emulation) = &own.emulation {
                emulation.objects_mut().buffers.remove(&buffer);
            }
            own.next.destroy_buffer(buffer, allocator.as_ref());
            vk::Result::SUCCESS
        });
    }
}

pub(super) unsafe extern "system" fn create_descriptor_set_layout(
    device: vk::Device,
    info: *const vk::DescriptorSetLayoutCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    layout: *mut vk::DescriptorSetLayout,
) -> vk::Result {
    use vk::DescriptorType as Type;
    // SAFETY: see the crate.
    unsafe {
        call(device, |own| {
            let create = own.next.fp_v1_0().create_descriptor_set_layout;
            let Some(emulation) = &own.emulation else {
                return create(device, info, allocator, layout);
            };
            let mut info = *info;
            let mut bindings = slice(info.p_bindings, info.binding_count).to_vec();
            for binding in &mut bindings {
                let is_uniform =
                    [Type::UNIFORM_BUFFER, Type::UNIFORM_BUFFER_DYNAMIC].contains(&binding.descriptor_type);
                if is_uniform && binding.stage_flags.contains(vk::ShaderStageFlags::VERTEX) {
                    // A kernel copies cameras.
                    binding.stage_flags |= vk::ShaderStageFlags::COMPUTE;
                }
            }
            info.p_bindings = bindings.as_ptr();
            let result = create(device, &raw const info, allocator, layout);
            if result == vk::Result::SUCCESS {
                let dynamic = [Type::UNIFORM_BUFFER_DYNAMIC, Type::STORAGE_BUFFER_DYNAMIC];
                let dynamic = bindings.iter().filter(|binding| dynamic.contains(&binding.descriptor_type));
                let count = dynamic.map(|binding| binding.descriptor_count as usize).sum();
                emulation.objects_mut().set_layouts.insert(*layout, count);
            }
            result
        })
    }
}

pub(super) unsafe extern "system" fn destroy_descriptor_set_layout(
    device: vk::Device,
    layout: vk::DescriptorSetLayout,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        let _ = call(device, |own| {
            if let Some(emulation) = &own.emulation {
                emulation.objects_mut().set_layouts.remove(&layout);
            }
            own.next.destroy_descriptor_set_layout(layout, allocator.as_ref());
            vk::Result::SUCCESS
        });
    }
}

pub(super) unsafe extern "system" fn create_pipeline_layout(
    device: vk::Device,
    info: *const vk::PipelineLayoutCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    layout: *mut vk::PipelineLayout,
) -> vk::Result {
    // SAFETY: see the crate.
    unsafe {
        call(device, |own| {
            let result = (own.next.fp_v1_0().create_pipeline_layout)(device, info, allocator, layout);
            if let (Some(emulation), vk::Result::SUCCESS) = (&own.emulation, result) {
                let sets = slice((*info).p_set_layouts, (*info).set_layout_count).to_vec();
                emulation.objects_mut().layouts.insert(*layout, sets);
            }
            result
        })
    }
}

pub(super) unsafe extern "system" fn create_shader_module(
    device: vk::Device,
    info: *const vk::ShaderModuleCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    module: *mut vk::ShaderModule,
) -> vk::Result {
    // SAFETY: see the crate.
    unsafe {
        call(device, |own| {
            let result = (own.next.fp_v1_0().create_shader_module)(device, info, allocator, module);
            if let (Some(emulation), vk::Result::SUCCESS) = (&own.emulation, result) {
                let words = slice((*info).p_code, ((*info).code_size / 4) as u32);
                if resolve::has_fragment_shader(words) || projecting::has_vertex_shader(words) {
                    emulation.objects_mut().shaders.insert(*module, words.into());
                }
            }
            result
        })
    }
}

pub(super) unsafe extern "system" fn destroy_shader_module(
    device: vk::Device,
    module: vk::ShaderModule,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        let _ = call(device, |own| {
            if let Some(emulation) = &own.emulation {
                emulation.objects_mut().shaders.remove(&module);
            }
            own.next.destroy_shader_module(module, allocator.as_ref());
            vk::Result::SUCCESS
        });
    }
}

pub(super) unsafe extern "system" fn destroy_pipeline_layout(
    device: vk::Device,
    layout: vk::PipelineLayout,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        let _ = call(device, |own| {
            if let Some(emulation) = &own.emulation {
                emulation.objects_mut().layouts.remove(&layout);
            }
            own.next.destroy_pipeline_layout(layout, allocator.as_ref());
            vk::Result::SUCCESS
        });
    }
}

macro_rules! create_render_pass {
    ($hook:ident, $info:ident, $create:path, $functions:ident, $pass_on:ident) => {
        pub(super) unsafe extern "system" fn $hook(
            device: vk::Device,
            info: *const vk::$info<'_>,
            allocator: *const vk::AllocationCallbacks<'_>,
            render_pass: *mut vk::RenderPass,
        ) -> vk::Result {
            // SAFETY: see the crate.
            unsafe {
                call(device, |own| {
                    let Some(emulation) = &own.emulation else {
                        return (own.next.$functions().$pass_on)(device, info, allocator, render_pass);
                    };
                    match $create(&own.next, &*info, allocator.as_ref()) {
                        Ok((created, known)) => {
                            emulation.objects_mut().render_passes.insert(created, Arc::new(known));
                            *render_pass = created;
                            vk::Result::SUCCESS
                        }
                        Err(error) => error,
                    }
                })
            }
        }
    };
}
create_render_pass!(create_render_pass, RenderPassCreateInfo, render_pass::create, fp_v1_0, create_render_pass);
create_render_pass!(create_render_pass2, RenderPassCreateInfo2, render_pass::create2, fp_v1_2, create_render_pass2);

pub(super) unsafe extern "system" fn destroy_render_pass(
    device: vk::Device,
    render_pass: vk::RenderPass,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        let _ = call(device, |own| {
            if let Some(emulation) = &own.emulation {
                emulation.objects_mut().render_passes.remove(&render_pass);
            }
            own.next.destroy_render_pass(render_pass, allocator.as_ref());
            vk::Result::SUCCESS
        });
    }
}

/// The words of the shaders that a pipeline is created with.
///
/// # Safety
/// The creation info is valid.
unsafe fn shaders_of(
    objects: &Objects,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
) -> HashMap<vk::ShaderModule, Arc<[u32]>> {
    // SAFETY: the caller's promise.
    let stages = unsafe { slice(info.p_stages, info.stage_count) };
    let modules = stages.iter().map(|stage| stage.module);
    modules.filter_map(|module| Some((module, Arc::clone(objects.shaders.get(&module)?)))).collect()
}

/// Creates a pipeline: of Gaussians or not, whole or linked from libraries, or a library.
///
/// # Safety
/// The creation info is valid.
unsafe fn create_graphics_pipeline(
    own: &Device,
    emulation: &Emulation,
    cache: vk::PipelineCache,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    allocator: Option<&vk::AllocationCallbacks<'_>>,
    place: &mut vk::Pipeline,
) -> vk::Result {
    // SAFETY: the caller's promise.
    unsafe {
        let pass_on = |place: &mut vk::Pipeline| {
            let allocator = allocator.map_or(std::ptr::null(), std::ptr::from_ref);
            let mut known = *info;
            let chain = &raw mut known.p_next;
            let _unlinked = (
                Unlinked::<State<'_>>::new(chain.cast()),
                Unlinked::<Footprint<'_>>::new(chain.cast()),
                Unlinked::<SigmaPoints<'_>>::new(chain.cast()),
            );
            (own.next.fp_v1_0().create_graphics_pipelines)(
                own.next.handle(),
                cache,
                1,
                &raw const known,
                allocator,
                place,
            )
        };
        let is_library = info.flags.contains(vk::PipelineCreateFlags::LIBRARY_KHR);
        let libraries = library::linked(info);
        let created = if is_library || !libraries.is_empty() {
            let objects = emulation.objects();
            let linked: Vec<Arc<Library>> =
                libraries.iter().filter_map(|library| objects.libraries.get(library)).cloned().collect();
            drop(objects);
            let shaders = shaders_of(&emulation.objects(), info);
            let parts = Library::new(info, &linked, &shaders);
            if is_library {
                let result = if parts.is_gaussian() {
                    library::empty(&own.next, allocator).map_or_else(
                        |error| error,
                        |empty| {
                            *place = empty;
                            vk::Result::SUCCESS
                        },
                    )
                } else {
                    pass_on(place)
                };
                if result == vk::Result::SUCCESS {
                    emulation.objects_mut().libraries.insert(*place, Arc::new(parts));
                }
                return result;
            }
            parts.with_info(info.flags, info.layout, |info, state| {
                create_gaussian_pipeline(own, emulation, cache, info, state, allocator)
            })
        } else {
            let state = pipeline::gaussian_state(info);
            state.map(|state| create_gaussian_pipeline(own, emulation, cache, info, state, allocator))
        };
        match created {
            None => pass_on(place),
            Some(Ok(pipeline)) => {
                *place = pipeline.raw;
                emulation.objects_mut().pipelines.insert(pipeline.raw, Arc::new(pipeline));
                vk::Result::SUCCESS
            }
            Some(Err(error)) => error,
        }
    }
}

/// Creates a pipeline of Gaussians.
///
/// # Safety
/// The creation info is valid.
unsafe fn create_gaussian_pipeline(
    own: &Device,
    emulation: &Emulation,
    cache: vk::PipelineCache,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    state: &State<'_>,
    allocator: Option<&vk::AllocationCallbacks<'_>>,
) -> Result<Pipeline, vk::Result> {
    let objects = emulation.objects();
    let known = objects.render_passes.get(&info.render_pass);
    let view_mask = known.and_then(|known| known.view_masks.get(info.subpass as usize)).copied();
    let set_layouts = objects.layouts.get(&info.layout).cloned().unwrap_or_default();
    // SAFETY: the caller's promise.
    let shaders = unsafe { shaders_of(&objects, info) };
    drop(objects);
    let context = Context {
        next: &own.next,
        kernels: emulation.kernels()?,
        view_mask,
        set_layouts: &set_layouts,
        shaders: &shaders,
        cache,
    };
    // SAFETY: the caller's promise.
    unsafe { pipeline::create(&context, info, state, allocator) }
}

pub(super) unsafe extern "system" fn create_graphics_pipelines(
    device: vk::Device,
    cache: vk::PipelineCache,
    count: u32,
    infos: *const vk::GraphicsPipelineCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    pipelines: *mut vk::Pipeline,
) -> vk::Result {
    // SAFETY: see the crate.
    unsafe {
        call(device, |own| {
            let create = own.next.fp_v1_0().create_graphics_pipelines;
            let all = slice(infos, count);
            let is_plain = |info: &vk::GraphicsPipelineCreateInfo<'_>| {
                let is_library = info.flags.contains(vk::PipelineCreateFlags::LIBRARY_KHR);
                pipeline::gaussian_state(info).is_none() && !is_library && library::linked(info).is_empty()
            };
            let Some(emulation) = own.emulation.as_ref().filter(|_| !all.iter().all(is_plain)) else {
                return create(device, cache, count, infos, allocator, pipelines);
            };
            let mut first_error = vk::Result::SUCCESS;
            for (index, info) in all.iter().enumerate() {
                let place = pipelines.add(index);
                *place = vk::Pipeline::null();
                let result = create_graphics_pipeline(own, emulation, cache, info, allocator.as_ref(), &mut *place);
                if first_error == vk::Result::SUCCESS {
                    first_error = result;
                }
                if result != vk::Result::SUCCESS
                    && info.flags.contains(vk::PipelineCreateFlags::EARLY_RETURN_ON_FAILURE)
                {
                    std::slice::from_raw_parts_mut(pipelines, count as usize)[index..].fill(vk::Pipeline::null());
                    break;
                }
            }
            first_error
        })
    }
}

pub(super) unsafe extern "system" fn destroy_pipeline(
    device: vk::Device,
    pipeline: vk::Pipeline,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        let _ = call(device, |own| {
            if let Some(emulation) = &own.emulation {
                let mut objects = emulation.objects_mut();
                objects.pipelines.remove(&pipeline);
                objects.libraries.remove(&pipeline);
            }
            own.next.destroy_pipeline(pipeline, allocator.as_ref());
            vk::Result::SUCCESS
        });
    }
}
