//! The texels of images as programs fetch them.

use ash::vk;

use crate::{Bindings, Buffer, Gpu, Image, Kernel, Resource, Sampler};

/// The shader. Constants are the width, the number of texels and the level.
const SHADER: &str = "
    layout(local_size_x = 64) in;
    layout(binding = 0) uniform sampler2D image;
    layout(binding = 1) buffer Results { vec4 results[]; };
    layout(push_constant) uniform Constants { uint width; uint count; uint level; };
    void main() {
        uint index = gl_GlobalInvocationID.x;
        if (index < count)
            results[index] = texelFetch(image, ivec2(index % width, index / width), int(level));
    }";

/// The texels of a level of a 2D image, row by row. `view` is a view of the image's colours. Compiling the shader needs
/// [`GLSLANG`](crate::shader::GLSLANG).
pub fn texels(image: &Image, view: vk::ImageView, level: u32) -> Vec<[f32; 4]> {
    let gpu: &Gpu = image.gpu();
    let [width, height, _] = image.options.level_size(level);
    let count = width * height;
    let results = Buffer::new(gpu, u64::from(count) * 16);
    let sampler = Sampler::new(gpu, &vk::SamplerCreateInfo::default().max_lod(vk::LOD_CLAMP_NONE));
    let bindings = Bindings::new(gpu, &[Resource::Texture(view, sampler.raw), Resource::Storage(results.raw)]);
    let kernel = Kernel::new(gpu, SHADER, &bindings);
    kernel.run(&[bindings.set], &[width, count, level], [count.div_ceil(64), 1, 1]);
    let mut texels = results.values();
    texels.truncate(count as usize);
    texels
}
