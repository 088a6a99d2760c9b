//! Scenes of vertex formats, uniform and storage buffers, push constants.

use ash::vk;

use gaurast_testkit::drawn::Drawn;
use gaurast_testkit::drawn::{cases, need};
use gaurast_testkit::shapes;
use gaurast_testkit::{
    Bindings, Buffer, Gpu, Output, Pass, Pipeline, PipelineOptions, Resource, Target, TargetOptions, Vertex, attribute,
    binding,
};

/// Draws with colours in a vertex format of their own, from a second binding.
fn colored(gpu: &Gpu, format: vk::Format, stride: u32, bytes: &[u8], fragment_scale: f32) -> Output {
    let prefix = match format!("{format:?}") {
        name if name.contains("UINT") => "u",
        name if name.contains("SINT") => "i",
        _ => "",
    };
    let vertex = format!(
        "layout(location = 0) in vec4 position;
         layout(location = 1) in {prefix}vec4 color;
         layout(location = 0) out vec4 v_color;
         void main() {{ gl_Position = position; v_color = {fragment_scale:?} * vec4(color); }}"
    );
    let options = PipelineOptions {
        vertex: &vertex,
        vertex_bindings: vec![binding(0, size_of::<Vertex>() as u32), binding(1, stride)],
        vertex_attributes: vec![
            attribute(0, vk::Format::R32G32B32A32_SFLOAT, 0),
            vk::VertexInputAttributeDescription { binding: 1, ..attribute(1, format, 0) },
        ],
        ..PipelineOptions::default()
    };
    let target = Target::new(gpu, &TargetOptions::of(vk::Format::R32G32B32A32_SFLOAT));
    let pipeline = Pipeline::new(gpu, &target, &options);
    let positions = Buffer::of(gpu, &shapes::soup(100, 20));
    let colors = Buffer::of(gpu, bytes);
    target.draw(gpu, &Pass::default(), |commands| {
        commands.bind(&pipeline);
        commands.vertices(&positions);
        commands.vertex_buffer(1, &colors, 0);
        commands.draw(0..60);
    })
}

/// Arbitrary bytes, in which the exponents of floats are not the greatest: no infinity and no NaN.
fn noise(count: usize) -> Vec<u8> {
    use rand::Rng;
    let mut rng = shapes::rng(101);
    (0..count).map(|_| rng.random_range(0..120)).collect()
}

pub fn vertex_formats(gpu: &Gpu) -> Drawn {
    use vk::Format as F;
    let formats = [
        (F::R8_UNORM, 1, 1.0),
        (F::R8G8_SNORM, 2, 1.0),
        (F::R8G8B8A8_UNORM, 4, 1.0),
        (F::B8G8R8A8_UNORM, 4, 1.0),
        (F::R8G8B8A8_UINT, 4, 0.01),
        (F::R8G8B8A8_SINT, 4, 0.01),
        (F::A2B10G10R10_UNORM_PACK32, 4, 1.0),
        (F::R16G16_UNORM, 4, 1.0),
        (F::R16G16B16A16_SNORM, 8, 1.0),
        (F::R16G16B16A16_UINT, 8, 1e-4),
        (F::R16G16B16A16_SFLOAT, 8, 0.01),
        (F::R32_UINT, 4, 1e-9),
        (F::R32G32_SINT, 8, 1e-9),
    ];
    let name = |(format, ..): &(F, u32, f32)| format!("{format:?}");
    Ok(cases(formats, name, |&(format, stride, scale)| {
        colored(gpu, format, stride, &noise(60 * stride as usize), scale)
    }))
}

pub fn float_vertex_formats(gpu: &Gpu) -> Drawn {
    use vk::Format as F;
    let floats: Vec<f32> = noise(240).iter().map(|&byte| f32::from(byte) / 120.0).collect();
    let formats = [(F::R32_SFLOAT, 4), (F::R32G32_SFLOAT, 8), (F::R32G32B32_SFLOAT, 12), (F::R32G32B32A32_SFLOAT, 16)];
    let name = |(format, _): &(F, u32)| format!("{format:?}");
    Ok(cases(formats, name, |&(format, stride)| colored(gpu, format, stride, bytemuck::cast_slice(&floats), 1.0)))
}

/// Reads interleaved vertices with unused bytes, from an offset, and with a stride of zero.
pub fn vertex_offsets_and_strides(gpu: &Gpu) -> Drawn {
    let strides = [0, 20, 28];
    let name = |stride: &u32| format!("stride {stride}");
    Ok(cases(strides, name, |&stride| {
        let options = PipelineOptions {
            vertex_bindings: vec![binding(0, size_of::<Vertex>() as u32), binding(1, stride)],
            vertex_attributes: vec![
                attribute(0, vk::Format::R32G32B32A32_SFLOAT, 0),
                vk::VertexInputAttributeDescription { binding: 1, ..attribute(1, vk::Format::R32G32B32A32_SFLOAT, 4) },
            ],
            ..PipelineOptions::default()
        };
        let target = Target::new(gpu, &TargetOptions::default());
        let pipeline = Pipeline::new(gpu, &target, &options);
        let positions = Buffer::of(gpu, &shapes::soup(102, 20));
        let floats: Vec<f32> = noise(600).iter().map(|&byte| f32::from(byte) / 120.0).collect();
        let colors = Buffer::of(gpu, &floats);
        target.draw(gpu, &Pass::default(), |commands| {
            commands.bind(&pipeline);
            commands.vertices(&positions);
            commands.vertex_buffer(1, &colors, 16);
            commands.draw(0..60);
        })
    }))
}

/// Draws with positions and colours that a binding or push constants modify.
fn fed(gpu: &Gpu, declaration: &str, resource: Option<Resource>, offsets: &[&[u32]], push: &[f32]) -> Output {
    let vertex = format!(
        "{declaration}
         layout(location = 0) in vec4 position;
         layout(location = 1) in vec4 color;
         layout(location = 0) out vec4 v_color;
         void main() {{
             gl_Position = vec4(position.xy * data.move.zw + data.move.xy * position.w, position.zw);
             v_color = color;
         }}"
    );
    let fragment = format!(
        "{declaration}
         layout(location = 0) in vec4 v_color;
         layout(location = 0) out vec4 color;
         void main() {{ color = mix(v_color, data.colors[int(gl_FragCoord.x) / 8 % 3], data.share); }}"
    );
    let resources: Vec<_> = resource.into_iter().collect();
    let bindings = (!resources.is_empty()).then(|| Bindings::new(gpu, &resources));
    let options = PipelineOptions {
        vertex: &vertex,
        fragment: Some(&fragment),
        bindings: bindings.as_ref(),
        ..PipelineOptions::default()
    };
    let target = Target::new(gpu, &TargetOptions::default());
    let pipeline = Pipeline::new(gpu, &target, &options);
    let vertices = Buffer::of(gpu, &shapes::soup(103, 30));
    target.draw(gpu, &Pass::default(), |commands| {
        commands.bind(&pipeline);
        commands.vertices(&vertices);
        commands.push(0, push);
        for offsets in offsets {
            if let Some(bindings) = &bindings {
                commands.bind_set(bindings, offsets);
            }
            commands.draw(0..90);
        }
    })
}

/// The members of a uniform block: an offset, three colours, and a mixing factor.
fn block(x: f32) -> Vec<f32> {
    vec![
        x, 0.1, 0.6, 0.9, // move
        1.0, 0.0, 0.0, 1.0, // colors
        0.0, 1.0, 0.0, 0.5, //
        0.2, 0.3, 1.0, 0.0, //
        0.4, // share
    ]
}

const MEMBERS: &str = "{ vec4 move; vec4 colors[3]; float share; } data;";

pub fn uniform_buffer(gpu: &Gpu) -> Drawn {
    let buffer = Buffer::of(gpu, &[block(0.2), vec![0.0; 15]].concat());
    let declaration = format!("layout(set = 0, binding = 0) uniform Data {MEMBERS}");
    let resource = Some(Resource::Uniform(buffer.raw));
    Ok(fed(gpu, &declaration, resource, &[&[]], &[0.0; 4]))
}

pub fn dynamic_uniform_buffer(gpu: &Gpu) -> Drawn {
    let alignment = gpu.limits().min_uniform_buffer_offset_alignment.max(256);
    let mut data = block(0.3);
    data.resize(alignment as usize / 4, 0.0);
    data.extend(block(-0.3));
    data.resize(2 * alignment as usize / 4, 0.0);
    let buffer = Buffer::of(gpu, &data);
    let declaration = format!("layout(set = 0, binding = 0) uniform Data {MEMBERS}");
    let resource = Some(Resource::DynamicUniform(buffer.raw, 68));
    let offsets: [&[u32]; 2] = [&[0], &[alignment as u32]];
    Ok(fed(gpu, &declaration, resource, &offsets, &[0.0; 4]))
}

pub fn storage_buffer(gpu: &Gpu) -> Drawn {
    let buffer = Buffer::of(gpu, &block(-0.1));
    let declaration = format!("layout(set = 0, binding = 0) readonly buffer Data {MEMBERS}");
    let resource = Some(Resource::Storage(buffer.raw));
    Ok(fed(gpu, &declaration, resource, &[&[]], &[0.0; 4]))
}

pub fn push_constants(gpu: &Gpu) -> Drawn {
    let declaration = format!("layout(push_constant) uniform Data {MEMBERS}");
    Ok(fed(gpu, &declaration, None, &[&[]], &block(0.15)))
}

/// Changes parts of the push constants between draws.
pub fn push_constants_between_draws(gpu: &Gpu) -> Drawn {
    let options = PipelineOptions {
        vertex: "
            layout(push_constant) uniform Push { vec2 move; vec2 scale; vec4 color; };
            layout(location = 0) in vec4 position;
            layout(location = 0) out vec4 v_color;
            void main() { gl_Position = vec4(position.xy * scale + move, position.zw); v_color = color; }",
        ..PipelineOptions::default()
    };
    let target = Target::new(gpu, &TargetOptions::default());
    let pipeline = Pipeline::new(gpu, &target, &options);
    let vertices = Buffer::of(gpu, &shapes::rectangle([-1.0, -1.0, 1.0, 1.0], 0.5, [0.0; 4]));
    Ok(target.draw(gpu, &Pass::default(), |commands| {
        commands.bind(&pipeline);
        commands.vertices(&vertices);
        commands.push(0, &[0.0f32, 0.0, 0.07, 0.09]);
        for index in 0..30u8 {
            let t = f32::from(index) / 30.0;
            commands.push(0, &[1.6 * t - 0.8, 0.8 * libm::sinf(9.0 * t)]);
            commands.push(16, &[t, 1.0 - t, 0.5, 1.0]);
            commands.draw(0..6);
        }
    }))
}

/// Counts fragments in a storage buffer, whose contents become a picture.
pub fn fragments_write_storage(gpu: &Gpu) -> Drawn {
    let needed = gpu.features().fragment_stores_and_atomics;
    need("fragmentStoresAndAtomics", needed)?;
    let buffer = Buffer::of(gpu, &[0u32; 128 * 128]);
    let bindings = Bindings::new(gpu, &[Resource::Storage(buffer.raw)]);
    let options = PipelineOptions {
        fragment: Some(
            "layout(set = 0, binding = 0) buffer Counts { uint counts[]; };
             layout(location = 0) in vec4 v_color;
             layout(location = 0) out vec4 color;
             void main() {
                 ivec2 p = ivec2(gl_FragCoord.xy);
                 atomicAdd(counts[p.y * 128 + p.x], 1);
                 color = v_color;
             }",
        ),
        bindings: Some(&bindings),
        ..PipelineOptions::default()
    };
    let target = Target::new(gpu, &TargetOptions::default());
    let pipeline = Pipeline::new(gpu, &target, &options);
    let vertices = Buffer::of(gpu, &shapes::soup(104, 30));
    let mut output = target.draw(gpu, &Pass::default(), |commands| {
        commands.bind(&pipeline);
        commands.bind_set(&bindings, &[]);
        commands.vertices(&vertices);
        commands.draw(0..90);
    });
    output.pictures.push(gaurast_testkit::Picture {
        name: "counts".to_owned(),
        format: vk::Format::R32_UINT,
        size: [128, 128],
        bytes: buffer.read(),
    });
    Ok(output)
}
