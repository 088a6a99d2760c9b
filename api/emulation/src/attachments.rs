//! Depth and stencil attachments, whose contents kernels read where the pass is broken.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;

use crate::next::Next;

/// An image of depths or stencils.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Image {
    pub(crate) format: vk::Format,
    pub(crate) samples: u32,
    pub(crate) layers: u32,
}

/// A view of such an image.
pub(crate) struct View {
    pub(crate) handle: vk::Image,
    pub(crate) image: Image,
    pub(crate) level: u32,
    pub(crate) layer: u32,
    pub(crate) layers: u32,
    /// Descriptors, by the aspect that they show.
    readers: Mutex<HashMap<vk::ImageAspectFlags, Arc<Reader>>>,
}

/// A descriptor of an aspect, for a kernel.
pub(crate) struct Reader {
    next: Arc<Next>,
    view: vk::ImageView,
    pool: vk::DescriptorPool,
    pub(crate) set: vk::DescriptorSet,
}

/// The attachment of the render pass instance that is broken.
pub(crate) struct DepthStencil {
    pub(crate) view: Arc<View>,
    /// The aspects that are attached.
    pub(crate) aspects: vk::ImageAspectFlags,
    /// The layouts in which aspects of the image are.
    pub(crate) layouts: Vec<(vk::ImageAspectFlags, vk::ImageLayout)>,
}

/// The aspects of a format; none of one without depths and stencils.
pub(crate) fn aspects(format: vk::Format) -> vk::ImageAspectFlags {
    use vk::Format as F;
    use vk::ImageAspectFlags as Aspects;
    match format {
        F::D16_UNORM | F::X8_D24_UNORM_PACK32 | F::D32_SFLOAT => Aspects::DEPTH,
        F::D16_UNORM_S8_UINT | F::D24_UNORM_S8_UINT | F::D32_SFLOAT_S8_UINT => Aspects::DEPTH | Aspects::STENCIL,
        F::S8_UINT => Aspects::STENCIL,
        _ => Aspects::empty(),
    }
}

/// Bits of a format's depths; 0 if they are floats.
pub(crate) fn depth_bits(format: vk::Format) -> u32 {
    use vk::Format as F;
    match format {
        F::D16_UNORM | F::D16_UNORM_S8_UINT => 16,
        F::X8_D24_UNORM_PACK32 | F::D24_UNORM_S8_UINT => 24,
        _ => 0,
    }
}

impl View {
    pub(crate) fn new(image: Image, info: &vk::ImageViewCreateInfo<'_>) -> Self {
        let range = &info.subresource_range;
        let layers = match range.layer_count {
            vk::REMAINING_ARRAY_LAYERS => image.layers.saturating_sub(range.base_array_layer),
            count => count,
        };
        Self {
            handle: info.image,
            image,
            level: range.base_mip_level,
            layer: range.base_array_layer,
            layers,
            readers: Mutex::default(),
        }
    }

    /// The descriptor of an aspect, which is made when it is first asked for.
    pub(crate) fn reader(
        &self,
        next: &Arc<Next>,
        layout: vk::DescriptorSetLayout,
        aspect: vk::ImageAspectFlags,
    ) -> Result<Arc<Reader>, vk::Result> {
        let mut readers = self.readers.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = readers.get(&aspect) {
            return Ok(Arc::clone(known));
        }
        let range = vk::ImageSubresourceRange {
            aspect_mask: aspect,
            base_mip_level: self.level,
            level_count: 1,
            base_array_layer: self.layer,
            layer_count: self.layers,
        };
        let info = vk::ImageViewCreateInfo::default()
            .image(self.handle)
            .view_type(vk::ImageViewType::TYPE_2D_ARRAY)
            .format(self.image.format)
            .subresource_range(range);
        let sizes = [vk::DescriptorPoolSize::default().ty(vk::DescriptorType::SAMPLED_IMAGE).descriptor_count(1)];
        let pool = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        // SAFETY: the image lives as long as its view, and the layout as long as the device.
        let reader = unsafe {
            let mut own = Reader {
                view: next.create_image_view(&info, None)?,
                next: Arc::clone(next),
                pool: vk::DescriptorPool::null(),
                set: vk::DescriptorSet::null(),
            };
            own.pool = next.create_descriptor_pool(&pool, None)?;
            let layouts = [layout];
            let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(own.pool).set_layouts(&layouts);
            let sets = next.allocate_descriptor_sets(&info)?;
            own.set = sets.first().copied().ok_or(vk::Result::ERROR_UNKNOWN)?;
            let images = [vk::DescriptorImageInfo::default().image_view(own.view).image_layout(READ)];
            let write = vk::WriteDescriptorSet::default()
                .dst_set(own.set)
                .descriptor_type(vk::DescriptorType::SAMPLED_IMAGE)
                .image_info(&images);
            next.update_descriptor_sets(&[write], &[]);
            Arc::new(own)
        };
        readers.insert(aspect, Arc::clone(&reader));
        Ok(reader)
    }
}

/// The layout in which kernels read samples.
pub(crate) const READ: vk::ImageLayout = vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL;

impl Drop for Reader {
    fn drop(&mut self) {
        // SAFETY: no command buffer that uses it is executed any more: the application has destroyed the view that it is of.
        unsafe {
            self.next.destroy_descriptor_pool(self.pool, None);
            self.next.destroy_image_view(self.view, None);
        }
    }
}
