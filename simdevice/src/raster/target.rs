//! Attachments: where the texels of a pass's images are.

use crate::format::{Aspect, Format, MAX_TEXEL_SIZE};
use crate::image::{Image, ImageKind, ImageView, SubresourceLayout};
use crate::limits::{MAX_FRAMEBUFFER_SIZE, MAX_SAMPLES};
use crate::packet::StoreOp;
use std::sync::Arc;

/// An attachment's view cannot be rendered to.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AttachmentError {
    /// The view's format lacks the aspect, or its texels differ in size from the image's.
    #[error("a view of format {0:?} cannot be this attachment")]
    Format(Format),
    /// The image lacks the view's subresource.
    #[error("the image lacks mip level {level}, layer {layer}")]
    Subresource {
        /// The mip level.
        level: u32,
        /// The array layer.
        layer: u32,
    },
    /// Neither 1 sample per texel nor [`MAX_SAMPLES`].
    #[error("attachments of {0} samples cannot be rendered to")]
    Samples(u32),
    /// Wider or higher than [`MAX_FRAMEBUFFER_SIZE`].
    #[error("an attachment of {0}x{1} pixels is too large")]
    Extent(u32, u32),
}

/// One aspect of an attachment: where its texels are, and what a tile begins with.
#[derive(Clone, Debug)]
pub struct Target {
    image: Arc<Image>,
    format: Format,
    /// Subresource and z of each layer.
    layers: Vec<(SubresourceLayout, u32)>,
    /// The bytes of the texel that it is cleared to, until that is done.
    pub clear: Option<[u8; MAX_TEXEL_SIZE]>,
    /// What becomes of it at the end of the pass.
    pub store: StoreOp,
}

impl Target {
    /// The first `layer_count` layers of `view`, or as many as the image has.
    ///
    /// # Errors
    /// [`AttachmentError`] if the view cannot be rendered to.
    pub fn new(
        view: &ImageView,
        aspect: Aspect,
        layer_count: u32,
        store: StoreOp,
    ) -> Result<Self, AttachmentError> {
        let (image, level) = (&view.image, view.base_mip_level);
        let format = view
            .format
            .plane(aspect)
            .ok_or(AttachmentError::Format(view.format))?;
        if ![1, MAX_SAMPLES].contains(&image.desc.samples) {
            return Err(AttachmentError::Samples(image.desc.samples));
        }
        let layer = |index: u32| {
            let layer = view.base_layer.checked_add(index)?;
            match image.desc.kind {
                ImageKind::D1 | ImageKind::D2 => {
                    Some((image.subresource(aspect, level, layer)?, 0))
                }
                // The layers of a view of a 3D image are its slices.
                ImageKind::D3 => {
                    let layout = image.subresource(aspect, level, 0)?;
                    (layer < layout.extent[2]).then_some((layout, layer))
                }
            }
        };
        let layers: Vec<_> = (0..layer_count.max(1)).map_while(layer).collect();
        let Some((layout, _)) = layers.first() else {
            return Err(AttachmentError::Subresource {
                level,
                layer: view.base_layer,
            });
        };
        if layout.format.texel_size() != format.texel_size() {
            return Err(AttachmentError::Format(view.format));
        }
        let [width, height, _] = layout.extent;
        if width.max(height) > MAX_FRAMEBUFFER_SIZE {
            return Err(AttachmentError::Extent(width, height));
        }
        Ok(Self {
            image: image.clone(),
            format,
            layers,
            clear: None,
            store,
        })
    }

    /// How its texels are read.
    pub fn format(&self) -> Format {
        self.format
    }

    /// How many layers are rendered to.
    pub fn layer_count(&self) -> u32 {
        self.layers.len() as u32
    }

    /// Its width and height in pixels.
    pub fn extent(&self) -> [u32; 2] {
        self.layers
            .iter()
            .map(|(layout, _)| [layout.extent[0], layout.extent[1]])
            .next()
            .unwrap_or_default()
    }

    /// Marks its memory as changed.
    pub fn bump_generation(&self) {
        self.image.memory.bump_generation();
    }

    /// Samples per pixel.
    pub fn samples(&self) -> u32 {
        self.image.desc.samples
    }

    /// One sample of all texels of a layer, if the attachment has that.
    pub(super) fn sample(&self, layer: u32, sample: u32) -> Option<SampleRows<'_>> {
        let (layout, z) = self.layers.get(layer as usize)?;
        Some(SampleRows {
            image: &self.image,
            layout: layout.sample(sample),
            z: *z,
        })
    }
}

/// One sample of all texels of an attachment's layer.
pub(super) struct SampleRows<'a> {
    image: &'a Image,
    layout: SubresourceLayout,
    z: u32,
}

impl SampleRows<'_> {
    /// Reads the bytes of texels from pixel (x, y) on; they stay as they are where there are none.
    #[inline]
    pub fn read(&self, [x, y]: [u32; 2], bytes: &mut [u8]) {
        // Tiles are clipped to the attachments before they are rendered.
        let _ = self.image.read_row(&self.layout, [x, y, self.z], bytes);
    }

    /// Writes the bytes of texels from pixel (x, y) on, where there are any.
    #[inline]
    pub fn write(&self, [x, y]: [u32; 2], bytes: &[u8]) {
        // As above.
        let _ = self.image.write_row(&self.layout, [x, y, self.z], bytes);
    }
}
