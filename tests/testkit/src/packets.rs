//! Resources of packets: buffers, images and the attributes of Gaussians, in device memory.

use gaurast_oracle::scenes::SceneBuffers;
use simdevice::BufferRange;
use simdevice::format::Aspect;
use simdevice::image::{ImageDesc, ImageKind};
use simdevice::packet::{AttributeStream, GaussianAttributes, ModelAttributes};
use simdevice::{Allocation, Format, Image, ImageView};
use std::sync::Arc;

/// A buffer that holds `data`.
pub fn buffer<T: bytemuck::NoUninit>(data: &[T]) -> BufferRange {
    let bytes: &[u8] = bytemuck::cast_slice(data);
    let memory = Allocation::new_zeroed(bytes.len().max(4) as u64).expect("memory");
    memory.write(0, bytes).expect("it has room");
    BufferRange { size: memory.len(), memory, offset: 0 }
}

/// A 2D image of zeros, and a view of all of it.
pub fn image(format: Format, [width, height]: [u32; 2], samples: u32) -> ImageView {
    let desc =
        ImageDesc { kind: ImageKind::D2, format, extent: [width, height, 1], mip_levels: 1, array_layers: 1, samples };
    let memory = Allocation::new_zeroed(desc.memory_size().expect("a size")).expect("memory");
    ImageView {
        image: Arc::new(Image::new(desc, memory, 0).expect("an image")),
        format,
        base_mip_level: 0,
        level_count: 1,
        base_layer: 0,
        layer_count: 1,
    }
}

/// The texels of an image; `T` is a texel of the aspect.
pub fn texels<T: bytemuck::AnyBitPattern + bytemuck::NoUninit>(view: &ImageView, aspect: Aspect) -> Vec<T> {
    let [width, height, _] = view.image.desc.extent;
    let mut texels = vec![T::zeroed(); (width * height) as usize];
    let layout = view.image.subresource(aspect, 0, 0).expect("it has one");
    for (y, row) in (0..).zip(texels.chunks_exact_mut(width as usize)) {
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(row);
        view.image.read_row(&layout, [0, y, 0], bytes).expect("a row");
    }
    texels
}

/// An attribute of each vertex.
pub fn stream(buffer: &BufferRange, stride: u32, offset: u32, format: Format) -> AttributeStream {
    AttributeStream { buffer: buffer.clone(), stride, offset, format, instance_divisor: None }
}

/// The attributes of a scene of degree 0.
pub fn attributes(scene: &SceneBuffers) -> GaussianAttributes {
    let triples = |data: &[[f32; 3]]| stream(&buffer(data), 12, 0, Format::R32G32B32Sfloat);
    GaussianAttributes {
        position: triples(&scene.positions),
        scale: triples(&scene.scales),
        rotation: stream(&buffer(&scene.rotations), 16, 0, Format::R32G32B32A32Sfloat),
        opacity: stream(&buffer(&scene.opacities), 4, 0, Format::R32Sfloat),
        model: ModelAttributes::default(),
        activations: Default::default(),
        tables: None,
        spherical_harmonics: vec![triples(&scene.sh)],
    }
}
