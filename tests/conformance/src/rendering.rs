//! Dynamic rendering over any views, in one part or several, with one view or several.

use ash::vk;
use gaurast_testkit::{Commands, Gpu, Image, ImageOptions};

/// The format of the attachments.
pub(crate) const FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;

/// A rendering over colour attachments.
#[derive(Clone, Copy)]
pub(crate) struct Rendering<'a> {
    pub(crate) views: &'a [vk::ImageView],
    pub(crate) size: [u32; 2],
    /// The views of a multiview rendering, one bit each.
    pub(crate) view_mask: u32,
    pub(crate) flags: vk::RenderingFlags,
    /// The colour to which the attachments are cleared, if they are not loaded.
    pub(crate) clear: Option<[f32; 4]>,
}

impl<'a> Rendering<'a> {
    /// A rendering that loads the attachments' contents.
    pub(crate) fn over(views: &'a [vk::ImageView], size: [u32; 2]) -> Self {
        Self { views, size, view_mask: 0, flags: vk::RenderingFlags::empty(), clear: None }
    }

    /// Records it.
    pub(crate) fn record(&self, commands: &Commands, draws: impl FnOnce()) {
        let [width, height] = self.size;
        let attachment = |&view: &vk::ImageView| {
            let float32 = self.clear.unwrap_or_default();
            vk::RenderingAttachmentInfo::default()
                .image_view(view)
                .image_layout(vk::ImageLayout::GENERAL)
                .load_op(if self.clear.is_some() { vk::AttachmentLoadOp::CLEAR } else { vk::AttachmentLoadOp::LOAD })
                .store_op(vk::AttachmentStoreOp::STORE)
                .clear_value(vk::ClearValue { color: vk::ClearColorValue { float32 } })
        };
        let attachments: Vec<_> = self.views.iter().map(attachment).collect();
        let info = vk::RenderingInfo::default()
            .flags(self.flags)
            .render_area(vk::Rect2D::default().extent(vk::Extent2D { width, height }))
            .layer_count(1)
            .view_mask(self.view_mask)
            .color_attachments(&attachments);
        let (device, raw) = commands.raw();
        // SAFETY: the views are those of attachments of this size.
        unsafe { device.cmd_begin_rendering(raw, &info) };
        draws();
        // SAFETY: it has begun.
        unsafe { device.cmd_end_rendering(raw) };
    }
}

/// An image with layers, each of which is filled with a colour.
pub(crate) fn layers(gpu: &Gpu, size: [u32; 2], count: u32, color: [f32; 4]) -> Image {
    let options = ImageOptions {
        layers: count,
        view: vk::ImageViewType::TYPE_2D_ARRAY,
        ..ImageOptions::new(FORMAT, size, vk::ImageUsageFlags::COLOR_ATTACHMENT)
    };
    let image = Image::new(gpu, &options);
    gpu.run(|commands| {
        let (device, raw) = commands.raw();
        let range = gaurast_testkit::range(vk::ImageAspectFlags::COLOR);
        let value = vk::ClearColorValue { float32: color };
        // SAFETY: the image is in this layout.
        unsafe { device.cmd_clear_color_image(raw, image.raw, vk::ImageLayout::GENERAL, &value, &[range]) };
        commands.barrier();
    });
    image
}

/// The colours of each layer.
pub(crate) fn colors_by_layer(image: &Image) -> Vec<Vec<[f32; 4]>> {
    let [width, height, _] = image.options.size;
    image.colors().chunks((width * height) as usize).map(<[_]>::to_vec).collect()
}
