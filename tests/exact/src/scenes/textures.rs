//! Scenes of textures: filters, levels, address modes, dimensions, formats.

use ash::vk;
use rand::Rng;

use gaurast_testkit::drawn::Drawn;
use gaurast_testkit::drawn::{cases, need, need_format};
use gaurast_testkit::shapes;
use gaurast_testkit::{
    Bindings, Buffer, Gpu, Image, ImageOptions, Output, Pass, Pipeline, PipelineOptions, Resource, Sampler, Target,
    TargetOptions,
};

const RGBA8: vk::Format = vk::Format::R8G8B8A8_UNORM;

/// Random texels, level by level, of `size` and `layers`.
fn texels([width, height, depth]: [u32; 3], layers: u32, levels: u32) -> Vec<Vec<[u8; 4]>> {
    let mut rng = shapes::rng(110);
    (0..levels)
        .map(|level| {
            let [w, h, d] = [width, height, depth].map(|size| (size >> level).max(1));
            (0..w * h * d * layers).map(|_| rng.random()).collect()
        })
        .collect()
}

fn image(gpu: &Gpu, view: vk::ImageViewType, size: [u32; 3], layers: u32, levels: u32) -> Image {
    let options = ImageOptions { view, size, layers, ..ImageOptions::new(RGBA8, [1, 1], vk::ImageUsageFlags::empty()) };
    Image::textured(gpu, &options, &texels(size, layers, levels))
}

fn flat(gpu: &Gpu, levels: u32) -> Image {
    image(gpu, vk::ImageViewType::TYPE_2D, [32, 16, 1], 1, levels)
}

fn linear() -> vk::SamplerCreateInfo<'static> {
    vk::SamplerCreateInfo::default()
        .mag_filter(vk::Filter::LINEAR)
        .min_filter(vk::Filter::LINEAR)
        .max_lod(vk::LOD_CLAMP_NONE)
}

/// Draws the whole target with a sampler of type `kind` called `image`. `expression` computes a colour from it and from
/// `uv`, which goes from -0.5 to 1.5 and is sheared.
fn sampled(gpu: &Gpu, image: &Image, sampler: &vk::SamplerCreateInfo<'_>, kind: &str, expression: &str) -> Output {
    let sampler = Sampler::new(gpu, sampler);
    let bindings = Bindings::new(gpu, &[Resource::Texture(image.view, sampler.raw)]);
    let fragment = format!(
        "layout(set = 0, binding = 0) uniform {kind} image;
         layout(location = 0) in vec4 v_color;
         layout(location = 0) out vec4 color;
         void main() {{ vec2 uv = v_color.xy; color = {expression}; }}"
    );
    let options =
        PipelineOptions { fragment: Some(&fragment), bindings: Some(&bindings), ..PipelineOptions::default() };
    let target = Target::new(gpu, &TargetOptions::default());
    let pipeline = Pipeline::new(gpu, &target, &options);
    let mut vertices = shapes::whole(0.5, [0.0; 4]);
    for vertex in &mut vertices {
        let [x, y, ..] = vertex.position;
        vertex.color = [0.5 + x + 0.13 * y, 0.5 + y - 0.21 * x, x, y];
    }
    let vertices = Buffer::of(gpu, &vertices);
    target.draw(gpu, &Pass::default(), |commands| {
        commands.bind(&pipeline);
        commands.bind_set(&bindings, &[]);
        commands.vertices(&vertices);
        commands.draw(0..6);
    })
}

pub fn nearest_filter(gpu: &Gpu) -> Drawn {
    let sampler = vk::SamplerCreateInfo::default();
    Ok(sampled(gpu, &flat(gpu, 1), &sampler, "sampler2D", "texture(image, uv)"))
}

pub fn linear_filter(gpu: &Gpu) -> Drawn {
    Ok(sampled(gpu, &flat(gpu, 1), &linear(), "sampler2D", "texture(image, uv)"))
}

/// Samples levels that the shader chooses, so that no derivative is used.
pub fn explicit_levels(gpu: &Gpu) -> Drawn {
    let modes = [vk::SamplerMipmapMode::NEAREST, vk::SamplerMipmapMode::LINEAR];
    let image = flat(gpu, 6);
    let name = |mode: &vk::SamplerMipmapMode| format!("{mode:?}");
    Ok(cases(modes, name, |&mode| {
        let sampler = linear().mipmap_mode(mode);
        let expression = "textureLod(image, uv, 2.5 * uv.x + 1.1)";
        sampled(gpu, &image, &sampler, "sampler2D", expression)
    }))
}

/// Samples levels chosen by the derivatives of the coordinates, which are constant.
pub fn implicit_levels(gpu: &Gpu) -> Drawn {
    let image = image(gpu, vk::ImageViewType::TYPE_2D, [64, 64, 1], 1, 7);
    let scales = [0.3, 0.9, 2.1, 5.3, 11.0];
    let name = |scale: &f32| format!("times {scale}");
    Ok(cases(scales, name, |&scale| {
        let sampler = linear().mipmap_mode(vk::SamplerMipmapMode::NEAREST);
        let expression = format!("texture(image, {scale:?} * uv)");
        sampled(gpu, &image, &sampler, "sampler2D", &expression)
    }))
}

/// Samples waves whose levels differ little. The level of detail may differ within Vulkan's tolerance, and the picture
/// then hardly changes.
pub fn trilinear_filter(gpu: &Gpu) -> Drawn {
    let levels: Vec<Vec<[u8; 4]>> = (0..7)
        .map(|level| {
            let side = 64u16 >> level;
            let texel = |index: u16| {
                let turn = |i: u16| std::f32::consts::TAU * (f32::from(i) + 0.5) / f32::from(side);
                let (x, y) = (turn(index % side), turn(index / side));
                // The mean of a wave over a texel of a smaller level is less.
                let height = 100.0 * (1.0 - f32::from(1u16 << level) / 64.0);
                let waves = [libm::sinf(x), libm::cosf(y), libm::sinf(x + y), libm::cosf(x - y)];
                waves.map(|wave| (128.0 + height * wave).round() as u8)
            };
            (0..side * side).map(texel).collect()
        })
        .collect();
    let options = ImageOptions::new(RGBA8, [64, 64], vk::ImageUsageFlags::empty());
    let image = Image::textured(gpu, &options, &levels);
    let sampler = linear().mipmap_mode(vk::SamplerMipmapMode::LINEAR);
    let expression = "texture(image, 3.0 * uv)";
    Ok(sampled(gpu, &image, &sampler, "sampler2D", expression))
}

/// Applies the bias of the shader and the sampler, and the sampler's least and greatest level.
pub fn level_bias_and_limits(gpu: &Gpu) -> Drawn {
    let image = image(gpu, vk::ImageViewType::TYPE_2D, [64, 64, 1], 1, 7);
    let samplers =
        [("bias", linear().mip_lod_bias(1.3)), ("least", linear().min_lod(2.0)), ("greatest", linear().max_lod(1.0))];
    let name = |(name, _): &(&str, vk::SamplerCreateInfo<'_>)| (*name).to_owned();
    Ok(cases(samplers, name, |(_, sampler)| {
        let expression = "texture(image, 4.5 * uv, 0.4)";
        sampled(gpu, &image, sampler, "sampler2D", expression)
    }))
}

pub fn address_modes(gpu: &Gpu) -> Drawn {
    use vk::SamplerAddressMode as Mode;
    let modes =
        [Mode::REPEAT, Mode::MIRRORED_REPEAT, Mode::CLAMP_TO_EDGE, Mode::CLAMP_TO_BORDER, Mode::MIRROR_CLAMP_TO_EDGE];
    let filters = [vk::Filter::NEAREST, vk::Filter::LINEAR];
    let all = modes.into_iter().flat_map(|mode| filters.map(|filter| (mode, filter)));
    let image = flat(gpu, 1);
    let name = |(mode, filter): &(Mode, vk::Filter)| format!("{mode:?} {filter:?}");
    Ok(cases(all, name, |&(mode, filter)| {
        let sampler = linear().mag_filter(filter).min_filter(filter).address_mode_u(mode).address_mode_v(mode);
        let expression = "texture(image, 1.7 * uv - 0.3)";
        sampled(gpu, &image, &sampler, "sampler2D", expression)
    }))
}

pub fn border_colors(gpu: &Gpu) -> Drawn {
    let colors = [
        vk::BorderColor::FLOAT_TRANSPARENT_BLACK,
        vk::BorderColor::FLOAT_OPAQUE_BLACK,
        vk::BorderColor::FLOAT_OPAQUE_WHITE,
    ];
    let image = flat(gpu, 1);
    let name = |color: &vk::BorderColor| format!("{color:?}");
    Ok(cases(colors, name, |&color| {
        let mode = vk::SamplerAddressMode::CLAMP_TO_BORDER;
        let sampler = linear().address_mode_u(mode).address_mode_v(mode).border_color(color);
        sampled(gpu, &image, &sampler, "sampler2D", "texture(image, uv)")
    }))
}

pub fn unnormalized_coordinates(gpu: &Gpu) -> Drawn {
    let mode = vk::SamplerAddressMode::CLAMP_TO_EDGE;
    let sampler = linear().max_lod(0.0).address_mode_u(mode).address_mode_v(mode).unnormalized_coordinates(true);
    let expression = "textureLod(image, vec2(32.0, 16.0) * uv, 0.0)";
    Ok(sampled(gpu, &flat(gpu, 1), &sampler, "sampler2D", expression))
}

pub fn texel_fetch(gpu: &Gpu) -> Drawn {
    let expression = "texelFetch(image, (ivec2(gl_FragCoord.xy) / 8) & 7, 1)";
    let sampler = vk::SamplerCreateInfo::default().max_lod(9.0);
    Ok(sampled(gpu, &flat(gpu, 3), &sampler, "sampler2D", expression))
}

pub fn texture_gather(gpu: &Gpu) -> Drawn {
    let expression = "textureGather(image, uv, 1)";
    Ok(sampled(gpu, &flat(gpu, 1), &linear(), "sampler2D", expression))
}

pub fn texel_offsets(gpu: &Gpu) -> Drawn {
    let expression = "textureLodOffset(image, uv, 0.0, ivec2(3, -2))";
    Ok(sampled(gpu, &flat(gpu, 1), &linear(), "sampler2D", expression))
}

pub fn one_dimension(gpu: &Gpu) -> Drawn {
    let image = image(gpu, vk::ImageViewType::TYPE_1D, [32, 1, 1], 1, 1);
    Ok(sampled(gpu, &image, &linear(), "sampler1D", "texture(image, uv.x)"))
}

pub fn three_dimensions(gpu: &Gpu) -> Drawn {
    let image = image(gpu, vk::ImageViewType::TYPE_3D, [8, 8, 8], 1, 1);
    let expression = "texture(image, vec3(uv, 0.7 * uv.x + 0.3 * uv.y))";
    Ok(sampled(gpu, &image, &linear(), "sampler3D", expression))
}

pub fn array_layers(gpu: &Gpu) -> Drawn {
    let image = image(gpu, vk::ImageViewType::TYPE_2D_ARRAY, [16, 16, 1], 5, 1);
    // The layer is not near a rounding threshold.
    let expression = "texture(image, vec3(uv, floor(gl_FragCoord.x / 20.0) - 0.9))";
    Ok(sampled(gpu, &image, &linear(), "sampler2DArray", expression))
}

pub fn cube_faces(gpu: &Gpu) -> Drawn {
    let image = image(gpu, vk::ImageViewType::CUBE, [8, 8, 1], 6, 1);
    // Nearest filtering, since filtering across the edges of faces is partly an implementation's choice.
    let sampler = vk::SamplerCreateInfo::default();
    let expression = "textureLod(image, vec3(3.0 * uv.x - 1.3, 2.0 * uv.y - 0.9, sin(9.0 * uv.x)), 0.0)";
    Ok(sampled(gpu, &image, &sampler, "samplerCube", expression))
}

pub fn seamless_cube(gpu: &Gpu) -> Drawn {
    let image = image(gpu, vk::ImageViewType::CUBE, [8, 8, 1], 6, 1);
    let expression = "textureLod(image, vec3(uv - 0.5, 0.6), 0.0)";
    Ok(sampled(gpu, &image, &linear(), "samplerCube", expression))
}

pub fn cube_arrays(gpu: &Gpu) -> Drawn {
    need("imageCubeArray", gpu.features().image_cube_array)?;
    let image = image(gpu, vk::ImageViewType::CUBE_ARRAY, [8, 8, 1], 12, 1);
    let sampler = linear();
    let expression = "textureLod(image, vec4(uv - 0.5, 0.6, step(64.0, gl_FragCoord.x)), 0.0)";
    Ok(sampled(gpu, &image, &sampler, "samplerCubeArray", expression))
}

pub fn anisotropic_filter(gpu: &Gpu) -> Drawn {
    need("samplerAnisotropy", gpu.features().sampler_anisotropy)?;
    let image = image(gpu, vk::ImageViewType::TYPE_2D, [64, 64, 1], 1, 7);
    let sampler = linear().anisotropy_enable(true).max_anisotropy(4.0);
    let expression = "texture(image, vec2(4.0, 1.0) * uv)";
    Ok(sampled(gpu, &image, &sampler, "sampler2D", expression))
}

/// Compares depth with a reference, as shadow maps do.
pub fn depth_comparison_samplers(gpu: &Gpu) -> Drawn {
    let options = ImageOptions::new(
        vk::Format::D32_SFLOAT,
        [64, 64],
        vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
    );
    let mut rng = shapes::rng(111);
    let depths: Vec<f32> = (0..64 * 64).map(|_| rng.random_range(0.0..1.0)).collect();
    let image = Image::new(gpu, &options);
    let buffer = Buffer::of(gpu, &depths);
    let region = image.region(vk::ImageAspectFlags::DEPTH, 0);
    gpu.run(|commands| commands.upload(&buffer, &image, &[region]));
    let comparisons = [vk::CompareOp::LESS, vk::CompareOp::GREATER_OR_EQUAL];
    let name = |op: &vk::CompareOp| format!("{op:?}");
    Ok(cases(comparisons, name, |&op| {
        let sampler = vk::SamplerCreateInfo::default().compare_enable(true).compare_op(op);
        let expression = "vec4(texture(image, vec3(uv, 0.45)))";
        sampled(gpu, &image, &sampler, "sampler2DShadow", expression)
    }))
}

pub fn texture_formats(gpu: &Gpu) -> Drawn {
    use vk::Format as F;
    let formats = [
        (F::R8_UNORM, 1),
        (F::R8G8_SNORM, 2),
        (F::R8G8B8A8_SRGB, 4),
        (F::B8G8R8A8_UNORM, 4),
        (F::R5G6B5_UNORM_PACK16, 2),
        (F::A2B10G10R10_UNORM_PACK32, 4),
        (F::B10G11R11_UFLOAT_PACK32, 4),
        (F::E5B9G9R9_UFLOAT_PACK32, 4),
        (F::R16G16_UNORM, 4),
        (F::R16G16B16A16_SFLOAT, 8),
        (F::R32G32B32A32_SFLOAT, 16),
    ];
    for (format, _) in formats {
        let feature = vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR;
        need_format(gpu, format, feature)?;
    }
    let name = |(format, _): &(F, u32)| format!("{format:?}");
    Ok(cases(formats, name, |&(format, size)| {
        let mut rng = shapes::rng(112);
        let options = ImageOptions::new(format, [16, 16], vk::ImageUsageFlags::empty());
        // Small bytes, so that floats are finite.
        let bytes: Vec<u8> = match format {
            F::R32G32B32A32_SFLOAT => {
                let floats: Vec<f32> = (0..1024).map(|_| rng.random_range(-0.2..1.2)).collect();
                bytemuck::cast_slice(&floats).to_vec()
            }
            _ => (0..256 * size).map(|_| rng.random_range(0..64)).collect(),
        };
        let image = Image::textured(gpu, &options, &[bytes]);
        sampled(gpu, &image, &linear(), "sampler2D", "texture(image, uv)")
    }))
}

/// Samples integers, which are never filtered.
pub fn integer_textures(gpu: &Gpu) -> Drawn {
    let mut rng = shapes::rng(113);
    let texels: Vec<u32> = (0..256).map(|_| rng.random_range(0..256)).collect();
    let options = ImageOptions::new(vk::Format::R32_UINT, [16, 16], vk::ImageUsageFlags::empty());
    let image = Image::textured(gpu, &options, &[texels]);
    let sampler = vk::SamplerCreateInfo::default();
    let expression = "vec4(texture(image, uv)) / 255.0";
    Ok(sampled(gpu, &image, &sampler, "usampler2D", expression))
}

/// Samples in vertex shaders, at explicit levels.
pub fn textures_in_vertex_shaders(gpu: &Gpu) -> Drawn {
    let image = flat(gpu, 2);
    let sampler = Sampler::new(gpu, &linear());
    let bindings = Bindings::new(gpu, &[Resource::Texture(image.view, sampler.raw)]);
    let options = PipelineOptions {
        vertex: "
            layout(set = 0, binding = 0) uniform sampler2D image;
            layout(location = 0) in vec4 position;
            layout(location = 1) in vec4 color;
            layout(location = 0) out vec4 v_color;
            void main() { gl_Position = position; v_color = textureLod(image, color.xy, 0.4); }",
        bindings: Some(&bindings),
        ..PipelineOptions::default()
    };
    let target = Target::new(gpu, &TargetOptions::default());
    let pipeline = Pipeline::new(gpu, &target, &options);
    let vertices = Buffer::of(gpu, &shapes::soup(114, 30));
    Ok(target.draw(gpu, &Pass::default(), |commands| {
        commands.bind(&pipeline);
        commands.bind_set(&bindings, &[]);
        commands.vertices(&vertices);
        commands.draw(0..90);
    }))
}
