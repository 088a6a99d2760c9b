//! Images of depths and stencils, views and framebuffers.

use std::sync::Arc;

use ash::vk;
use gaurast_layer_interface::{find_mut, slice};

use crate::attachments::{Image, View, aspects};
use crate::hooks::site::call;

pub(super) unsafe extern "system" fn create_image(
    device: vk::Device,
    info: *const vk::ImageCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    image: *mut vk::Image,
) -> vk::Result {
    use vk::ImageUsageFlags as Usage;
    // SAFETY: see the crate.
    unsafe {
        call(device, |own| {
            let create = own.next.fp_v1_0().create_image;
            let is_attachment = |usage: Usage| usage.contains(Usage::DEPTH_STENCIL_ATTACHMENT);
            let emulation = own.emulation.as_ref().filter(|_| {
                let stencil = find_mut::<vk::ImageStencilUsageCreateInfo<'_>>((*info).p_next.cast_mut());
                let is_stencil = stencil.is_some_and(|stencil| is_attachment(stencil.stencil_usage));
                !aspects((*info).format).is_empty() && (is_attachment((*info).usage) || is_stencil)
            });
            let Some(emulation) = emulation else {
                return create(device, info, allocator, image);
            };
            // Kernels read what is stored. Memory of tiles alone cannot be read.
            let changed = |usage: Usage| {
                let read =
                    if (*info).samples == vk::SampleCountFlags::TYPE_1 { Usage::TRANSFER_SRC } else { Usage::SAMPLED };
                (usage | read) & !Usage::TRANSIENT_ATTACHMENT
            };
            let mut own_info = *info;
            own_info.usage = changed(own_info.usage);
            let stencil = find_mut::<vk::ImageStencilUsageCreateInfo<'_>>((*info).p_next.cast_mut());
            let stencil = stencil.map(|stencil| {
                let usage = stencil.stencil_usage;
                stencil.stencil_usage = changed(usage);
                (&raw mut stencil.stencil_usage, usage)
            });
            let result = create(device, &raw const own_info, allocator, image);
            if let Some((place, usage)) = stencil {
                *place = usage;
            }
            if result == vk::Result::SUCCESS {
                let known = Image {
                    format: own_info.format,
                    samples: own_info.samples.as_raw(),
                    layers: own_info.array_layers,
                };
                emulation.objects_mut().images.insert(*image, known);
            }
            result
        })
    }
}

pub(super) unsafe extern "system" fn destroy_image(
    device: vk::Device,
    image: vk::Image,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        let _ = call(device, |own| {
            if let Some(emulation) = &own.emulation {
                emulation.objects_mut().images.remove(&image);
            }
            own.next.destroy_image(image, allocator.as_ref());
            vk::Result::SUCCESS
        });
    }
}

pub(super) unsafe extern "system" fn create_image_view(
    device: vk::Device,
    info: *const vk::ImageViewCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    view: *mut vk::ImageView,
) -> vk::Result {
    // SAFETY: see the crate.
    unsafe {
        call(device, |own| {
            let result = (own.next.fp_v1_0().create_image_view)(device, info, allocator, view);
            if let (Some(emulation), vk::Result::SUCCESS) = (&own.emulation, result) {
                let mut objects = emulation.objects_mut();
                let image = objects.images.get(&(*info).image).copied();
                if let Some(image) = image {
                    objects.views.insert(*view, Arc::new(View::new(image, &*info)));
                }
            }
            result
        })
    }
}

pub(super) unsafe extern "system" fn destroy_image_view(
    device: vk::Device,
    view: vk::ImageView,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        let _ = call(device, |own| {
            if let Some(emulation) = &own.emulation {
                emulation.objects_mut().views.remove(&view);
            }
            own.next.destroy_image_view(view, allocator.as_ref());
            vk::Result::SUCCESS
        });
    }
}

pub(super) unsafe extern "system" fn create_framebuffer(
    device: vk::Device,
    info: *const vk::FramebufferCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    framebuffer: *mut vk::Framebuffer,
) -> vk::Result {
    // SAFETY: see the crate.
    unsafe {
        call(device, |own| {
            let result = (own.next.fp_v1_0().create_framebuffer)(device, info, allocator, framebuffer);
            if let (Some(emulation), vk::Result::SUCCESS) = (&own.emulation, result) {
                let is_imageless = (*info).flags.contains(vk::FramebufferCreateFlags::IMAGELESS);
                let count = if is_imageless { 0 } else { (*info).attachment_count };
                let attachments = slice((*info).p_attachments, count).to_vec();
                emulation.objects_mut().framebuffers.insert(*framebuffer, attachments);
            }
            result
        })
    }
}

pub(super) unsafe extern "system" fn destroy_framebuffer(
    device: vk::Device,
    framebuffer: vk::Framebuffer,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        let _ = call(device, |own| {
            if let Some(emulation) = &own.emulation {
                emulation.objects_mut().framebuffers.remove(&framebuffer);
            }
            own.next.destroy_framebuffer(framebuffer, allocator.as_ref());
            vk::Result::SUCCESS
        });
    }
}
