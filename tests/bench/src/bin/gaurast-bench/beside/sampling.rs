//! Workloads of the texture unit beyond 8-bit colours, of points, and of operations across a subgroup.

use ash::vk;
use gaurast_testkit::{
    Bindings, Buffer, Gpu, Image, ImageOptions, Kernel, Pass, Pipeline, PipelineOptions, Resource, Sampler, Target,
    TargetOptions, Vertex, shapes,
};
use rand::Rng;

use super::workload::Workload;

/// Width and height of the picture.
const SIZE: [u32; 2] = [1920, 1080];

/// Width and height of images.
const SIDE: u32 = 512;

/// Prepares the workload of a name, if there is one.
pub(super) fn prepare(gpu: &Gpu, name: &str) -> Option<Workload> {
    let two = vk::ImageViewType::TYPE_2D;
    Some(match name {
        "sampled, 16-bit floats" => {
            // Halves between 0.5 and 1.
            let texels = random(4, |bits| 0x3800 | (bits & 0x3ff) as u16);
            let image = image(gpu, vk::Format::R16G16B16A16_SFLOAT, two, &texels);
            sampled(gpu.clone(), image, None, COLOR)
        }
        "sampled, one 32-bit float" => {
            let texels = random(1, |bits| bits as f32 / u32::MAX as f32);
            sampled(gpu.clone(), image(gpu, vk::Format::R32_SFLOAT, two, &texels), None, COLOR)
        }
        "sampled, depth comparison" => {
            let texels = random(1, |bits| bits as f32 / u32::MAX as f32);
            let options = ImageOptions::new(vk::Format::D32_SFLOAT, [SIDE; 2], vk::ImageUsageFlags::SAMPLED);
            let image = Image::new(gpu, &options);
            image.upload(vk::ImageAspectFlags::DEPTH, bytemuck::cast_slice(&texels));
            sampled(gpu.clone(), image, Some(vk::CompareOp::LESS), SHADOW)
        }
        "sampled, cube" => {
            let texels: Vec<u32> = (0..6).flat_map(|_| random(1, |bits| bits)).collect();
            let image = image(gpu, vk::Format::R8G8B8A8_UNORM, vk::ImageViewType::CUBE, &texels);
            sampled(gpu.clone(), image, None, CUBE)
        }
        "stored, image to image" => stored(gpu.clone()),
        "a million points" => points(gpu.clone(), 1_000_000),
        "subgroup operations" => subgroups(gpu.clone()),
        _ => return None,
    })
}

/// A fragment shader that samples colours.
const COLOR: &str = "
    layout(set = 0, binding = 0) uniform sampler2D image;
    layout(location = 0) in vec4 v_color;
    layout(location = 0) out vec4 color;
    void main() { color = texture(image, 3.0 * v_color.xy); }";

/// A fragment shader that compares with depths, as shadows do.
const SHADOW: &str = "
    layout(set = 0, binding = 0) uniform sampler2DShadow image;
    layout(location = 0) in vec4 v_color;
    layout(location = 0) out vec4 color;
    void main() { color = vec4(texture(image, vec3(3.0 * v_color.xy, 0.5))); }";

/// A fragment shader that looks in all directions.
const CUBE: &str = "
    layout(set = 0, binding = 0) uniform samplerCube image;
    layout(location = 0) in vec4 v_color;
    layout(location = 0) out vec4 color;
    void main() { color = texture(image, vec3(v_color.xy, 1.0 - v_color.x * 2.0)); }";

/// Random texels of `components` components, which `of` makes of random bits.
fn random<T>(components: u32, of: impl Fn(u32) -> T) -> Vec<T> {
    let mut rng = shapes::rng(311);
    (0..components * SIDE * SIDE).map(|_| of(rng.random())).collect()
}

fn image<T: bytemuck::NoUninit>(gpu: &Gpu, format: vk::Format, view: vk::ImageViewType, texels: &[T]) -> Image {
    let layers = if view == vk::ImageViewType::CUBE { 6 } else { 1 };
    let usage = vk::ImageUsageFlags::SAMPLED;
    let image = Image::new(gpu, &ImageOptions { view, layers, ..ImageOptions::new(format, [SIDE; 2], usage) });
    image.upload(vk::ImageAspectFlags::COLOR, bytemuck::cast_slice(texels));
    image
}

/// Fills the picture with filtered samples of an image.
fn sampled(gpu: Gpu, image: Image, compare: Option<vk::CompareOp>, fragment: &str) -> Workload {
    let target = Target::new(&gpu, &TargetOptions { size: SIZE, ..TargetOptions::default() });
    let info = vk::SamplerCreateInfo::default()
        .mag_filter(vk::Filter::LINEAR)
        .min_filter(vk::Filter::LINEAR)
        .compare_enable(compare.is_some())
        .compare_op(compare.unwrap_or_default());
    let sampler = Sampler::new(&gpu, &info);
    let bindings = Bindings::new(&gpu, &[Resource::Texture(image.view, sampler.raw)]);
    let options = PipelineOptions { fragment: Some(fragment), bindings: Some(&bindings), ..PipelineOptions::default() };
    let pipeline = Pipeline::new(&gpu, &target, &options);
    let corners = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]
        .map(|[x, y]: [f32; 2]| Vertex { position: [x, y, 0.5, 1.0], color: [x, y, 0.0, 0.0] });
    let vertices = Buffer::of(&gpu, &[0, 1, 2, 2, 1, 3].map(|index: usize| corners[index]));
    let recorded = gpu.record(|commands| {
        commands.pass(&target, &Pass::default(), || {
            commands.bind(&pipeline);
            commands.bind_set(&bindings, &[]);
            commands.vertices(&vertices);
            commands.draw(0..6);
        });
    });
    let kept = (target, sampler, bindings, pipeline, vertices, image);
    Workload::of(move || {
        let _ = &kept;
        recorded.submit();
    })
}

/// A compute shader that reads texels of one image and writes them to another.
fn stored(gpu: Gpu) -> Workload {
    let options = ImageOptions::new(vk::Format::R8G8B8A8_UNORM, [SIDE; 2], vk::ImageUsageFlags::STORAGE);
    let images = [0, 1].map(|_| Image::new(&gpu, &options));
    let bindings = Bindings::new(&gpu, &images.each_ref().map(|image| Resource::StorageImage(image.view)));
    let kernel = Kernel::new(
        &gpu,
        "layout(local_size_x = 16, local_size_y = 4) in;
         layout(set = 0, binding = 0, rgba8) uniform readonly image2D from;
         layout(set = 0, binding = 1, rgba8) uniform writeonly image2D to;
         void main() {
             ivec2 at = ivec2(gl_GlobalInvocationID.xy);
             vec4 sum = vec4(0.0);
             for (int i = 0; i < 4; i++) { sum += imageLoad(from, at ^ ivec2(i & 1, i >> 1)); }
             imageStore(to, at, 0.25 * sum);
         }",
        &bindings,
    );
    let recorded = gpu.record(|commands| {
        for _ in 0..4 {
            kernel.dispatch(commands, &[bindings.set], &[], [SIDE / 16, SIDE / 4, 1]);
            commands.barrier();
        }
    });
    Workload::of(move || {
        let _ = (&images, &bindings, &kernel);
        recorded.submit();
    })
}

/// Points of one pixel at random places.
fn points(gpu: Gpu, count: u32) -> Workload {
    let target = Target::new(&gpu, &TargetOptions { size: SIZE, ..TargetOptions::default() });
    let options = PipelineOptions {
        vertex: "
            layout(location = 0) in vec4 position;
            layout(location = 1) in vec4 color;
            layout(location = 0) out vec4 v_color;
            void main() { gl_Position = position; gl_PointSize = 1.0; v_color = color; }",
        topology: vk::PrimitiveTopology::POINT_LIST,
        ..PipelineOptions::default()
    };
    let pipeline = Pipeline::new(&gpu, &target, &options);
    let mut rng = shapes::rng(312);
    let vertices: Vec<Vertex> = (0..count)
        .map(|_| {
            let [x, y] = [0; 2].map(|_| rng.random_range(-1.0..1.0_f32));
            Vertex { position: [x, y, 0.5, 1.0], color: [x, y, 0.5, 1.0] }
        })
        .collect();
    let vertices = Buffer::of(&gpu, &vertices);
    let recorded = gpu.record(|commands| {
        commands.pass(&target, &Pass::default(), || {
            commands.bind(&pipeline);
            commands.vertices(&vertices);
            commands.draw(0..count);
        });
    });
    let kept = (target, pipeline, vertices);
    Workload::of(move || {
        let _ = &kept;
        recorded.submit();
    })
}

/// Sums, shuffles and votes across subgroups.
fn subgroups(gpu: Gpu) -> Workload {
    const GROUPS: u32 = 4096;
    let buffer = Buffer::of(&gpu, &vec![1_u32; 64 * GROUPS as usize]);
    let bindings = Bindings::new(&gpu, &[Resource::Storage(buffer.raw)]);
    let kernel = Kernel::new(
        &gpu,
        "#extension GL_KHR_shader_subgroup_arithmetic : require
         #extension GL_KHR_shader_subgroup_shuffle : require
         #extension GL_KHR_shader_subgroup_ballot : require
         layout(local_size_x = 64) in;
         layout(set = 0, binding = 0) buffer Values { uint values[]; };
         void main() {
             uint value = values[gl_GlobalInvocationID.x];
             for (uint i = 0; i < 8; i++) {
                 value += subgroupAdd(value) ^ subgroupShuffleXor(value, 1);
                 value += subgroupBallot((value & 4) != 0).x + subgroupInclusiveAdd(value);
             }
             values[gl_GlobalInvocationID.x] = value;
         }",
        &bindings,
    );
    let recorded = gpu.record(|commands| kernel.dispatch(commands, &[bindings.set], &[], [GROUPS, 1, 1]));
    Workload::of(move || {
        let _ = (&buffer, &bindings, &kernel);
        recorded.submit();
    })
}
