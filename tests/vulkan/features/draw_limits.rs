//! Tests that draw with limits at their values: vertices of geometry shaders, offsets of interpolation, sizes of points,
//! second sources of blending, dynamic offsets and topologies.

use ash::vk;
use gaurast_testkit::devices::own;
use gaurast_testkit::pipeline::blend;
use gaurast_testkit::shader::{GLSLANG, Stage};
use gaurast_testkit::stage_program::{NUMBERED, ONES};
use gaurast_testkit::{
    Buffer, Compute, Graphics, Pass, Pipeline, PipelineOptions, Shader, Target, TargetOptions, Vertex, fetch_sample,
    shader, shapes,
};

const FLOAT: vk::Format = vk::Format::R32_SFLOAT;

/// An invocation of a geometry shader emits 1,024 vertices with a position each, all of which are drawn.
#[gaurast_runner::test(needs = [GLSLANG])]
fn a_geometry_shader_emits_1024_vertices() {
    let gpu = own();
    let limits = gpu.limits();
    assert_eq!((limits.max_geometry_output_vertices, limits.max_geometry_total_output_components), (1024, 4096));
    let mut geometry = shader::compile(
        Stage::Geometry,
        "layout(points) in;
         layout(points, max_vertices = 256) out;
         void main() {
             for (int i = 0; i < 1100; i++) {
                 vec2 pixel = vec2(i & 31, i >> 5) + gl_in[0].gl_Position.x * vec2(40.0, 0.0) + 0.5;
                 gl_Position = vec4(pixel / 64.0 - 1.0, 0.0, 1.0);
                 gl_PointSize = 1.0;
                 EmitVertex();
             }
         }",
    );
    // The compiler accepts only Vulkan's minimum, so the operand of `OpExecutionMode ... OutputVertices` is patched.
    let declared = (geometry.windows(4).position(|words| words[0] == 4 << 16 | 16 && words[2..] == [26, 256]))
        .expect("the number of vertices");
    geometry[declared + 3] = 1024;
    let target = Target::floats(gpu, [128; 2]);
    let made = Graphics {
        shaders: vec![
            Shader::vertex(shader::compile(Stage::Vertex, NUMBERED)),
            Shader::new(vk::ShaderStageFlags::GEOMETRY, geometry),
            Shader::fragment(shader::compile(Stage::Fragment, ONES)),
        ],
        topology: vk::PrimitiveTopology::POINT_LIST,
        ..Graphics::default()
    };
    let pipeline = made.create(gpu).expect("a pipeline");
    gpu.run(|commands| {
        commands.pass(&target, &Pass::zeros(), || {
            commands.bind(&pipeline);
            commands.draw(0..2);
        });
    });
    for (place, [found, ..]) in (0u32..).zip(target.read::<[f32; 4]>()) {
        let (x, y) = (place % 128, place / 128);
        // The vertices beyond those of the declaration, which would be in further rows, are dropped.
        let expected = if y < 32 && (x < 32 || (40..72).contains(&x)) { 1.0 } else { 0.0 };
        assert_eq!(found, expected, "{x}, {y}");
    }
}

/// Inputs are interpolated up to two pixels away, and in steps of 1/256 pixel.
#[gaurast_runner::test(needs = [GLSLANG])]
fn inputs_are_interpolated_up_to_two_pixels_away() {
    let gpu = own();
    let limits = gpu.limits();
    assert_eq!((limits.min_interpolation_offset, limits.max_interpolation_offset), (-2.0, 2.0));
    assert_eq!(limits.sub_pixel_interpolation_offset_bits, 8);
    let size = [32, 16];
    let target = Target::new(gpu, &TargetOptions { size, ..TargetOptions::of(vk::Format::R32G32B32A32_SFLOAT) });
    let pipeline = Pipeline::new(
        gpu,
        &target,
        &PipelineOptions {
            fragment: Some(
                "layout(location = 0) in vec4 v_color;
                 layout(location = 0) out vec4 color;
                 layout(push_constant) uniform Push { vec2 offset; };
                 void main() { color = interpolateAtOffset(v_color, offset); }",
            ),
            ..PipelineOptions::default()
        },
    );
    // The colour is the place in pixels, with perspective: w is 1 on the left and 2 on the right.
    let corner = |x: f32, y: f32| {
        let w = 1.0 + x;
        Vertex { position: [(2.0 * x - 1.0) * w, (2.0 * y - 1.0) * w, 0.5 * w, w], color: [32.0 * x, 16.0 * y, x, 1.0] }
    };
    let vertices = Buffer::of(gpu, &[corner(0.0, 0.0), corner(2.0, 0.0), corner(0.0, 2.0)]);
    for offset in [[-2.0f32, -2.0], [2.0, 2.0], [2.0, -2.0], [1.0 / 256.0, 0.0], [0.0, -1.0 / 256.0]] {
        gpu.run(|commands| {
            commands.pass(&target, &Pass::zeros(), || {
                commands.bind(&pipeline);
                commands.push(0, &offset);
                commands.vertices(&vertices);
                commands.draw(0..3);
            });
        });
        for (place, found) in (0u32..).zip(target.read::<[f32; 4]>()) {
            let at = [place % 32, place / 32].map(|at| f64::from(at) + 0.5);
            let [x, y] = [at[0] + f64::from(offset[0]), at[1] + f64::from(offset[1])];
            // The three corners' weights, linear in the picture, times 1/w of each.
            let (u, v) = (x / 32.0 / 2.0, y / 16.0 / 2.0);
            let weights = [1.0 - u - v, u / 3.0, v];
            let sum: f64 = weights.iter().sum();
            let expected = [64.0 * weights[1] / sum, 32.0 * weights[2] / sum];
            for axis in 0..2 {
                let error = (f64::from(found[axis]) - expected[axis]).abs();
                // A step of 1/256 pixel changes the value by more.
                assert!(error < 1e-3, "{offset:?} at {at:?}: {found:?}, not {expected:?}");
            }
        }
    }
}

/// The sample or samples that a point of a size covers of a picture of 4x4 pixels, where the point is in pixels.
fn samples_of_point(samples: u32, at: [f32; 2], size: f32) -> Vec<(u32, usize)> {
    let gpu = own();
    let options = TargetOptions { size: [4; 2], samples, resolve: false, ..TargetOptions::of(FLOAT) };
    let target = Target::new(gpu, &options);
    let pipeline = Pipeline::new(
        gpu,
        &target,
        &PipelineOptions {
            vertex: "layout(location = 0) in vec4 position;
                     layout(location = 1) in vec4 color;
                     void main() { gl_Position = position; gl_PointSize = color.x; }",
            fragment: Some(
                "layout(location = 0) out vec4 color;
                 void main() { color = vec4(gl_PointCoord.x + 1.0); }",
            ),
            topology: vk::PrimitiveTopology::POINT_LIST,
            ..PipelineOptions::default()
        },
    );
    let [x, y] = at.map(|at| at / 2.0 - 1.0);
    let vertices = Buffer::of(gpu, &[Vertex { position: [x, y, 0.5, 1.0], color: [size; 4] }]);
    gpu.run(|commands| {
        commands.pass(&target, &Pass::zeros(), || {
            commands.bind(&pipeline);
            commands.vertices(&vertices);
            commands.draw(0..1);
        });
    });
    let mut covered = Vec::new();
    for sample in 0..samples {
        let values: Vec<f32> = match samples {
            1 => target.read(),
            _ => fetch_sample(gpu, &target.colors[0], sample).texels(),
        };
        for (pixel, value) in values.into_iter().enumerate().filter(|(_, value)| *value != 0.0) {
            assert!((1.0..=2.0).contains(&value) || samples > 1, "the point coordinate {}", value - 1.0);
            covered.push((sample, pixel));
        }
    }
    covered
}

/// A point smaller than a pixel covers the samples within its square; one of size zero covers none.
#[gaurast_runner::test(needs = [GLSLANG])]
fn points_are_smaller_than_a_pixel() {
    assert_eq!(own().limits().point_size_range[0], 0.0);
    assert_eq!(samples_of_point(1, [1.5, 2.5], 1.0), [(0, 9)]);
    assert_eq!(samples_of_point(1, [1.55, 2.45], 0.25), [(0, 9)]);
    assert!(samples_of_point(1, [1.75, 2.5], 0.25).is_empty());
    assert!(samples_of_point(1, [2.0, 2.0], 0.5).is_empty());
    assert_eq!(samples_of_point(1, [1.5, 2.5], 1.0 / 128.0), [(0, 9)]);
    assert!(samples_of_point(1, [1.5, 2.5], 0.0).is_empty());
    assert!(samples_of_point(1, [1.5, 2.5], -3.0).is_empty());
    // The standard places of four samples in the pixel at (1, 1).
    for (sample, place) in (0..).zip([[0.375, 0.125], [0.875, 0.375], [0.125, 0.625], [0.625, 0.875]]) {
        let at = place.map(|at: f32| 1.0 + at);
        assert_eq!(samples_of_point(4, at, 0.125), [(sample, 5)]);
        assert!(samples_of_point(4, at, 0.0).is_empty());
    }
}

/// Each of the attachments is blended by its own second source.
#[gaurast_runner::test(needs = [GLSLANG])]
fn all_attachments_have_a_second_source() {
    let gpu = own();
    let count = gpu.limits().max_fragment_dual_src_attachments;
    assert_eq!(count, 8);
    let formats = [vk::Format::R32G32B32A32_SFLOAT, vk::Format::R16G16B16A16_SFLOAT];
    let colors = formats.into_iter().cycle().take(count as usize).collect();
    let target = Target::new(gpu, &TargetOptions { size: [16; 2], colors, ..TargetOptions::default() });
    let declare = |location: u32| {
        format!(
            "layout(location = {location}, index = 0) out vec4 first{location};
             layout(location = {location}, index = 1) out vec4 second{location};
            "
        )
    };
    let write = |location: u32| {
        format!(
            "first{location} = vec4({location} + 1);
             second{location} = vec4(0.5, 0.25, 0.125 * {location}, 0.0625);
            "
        )
    };
    let declarations: String = (0..count).map(declare).collect();
    let writes: String = (0..count).map(write).collect();
    let fragment = format!("{declarations} void main() {{ {writes} }}");
    let by_second = blend(vk::BlendFactor::SRC1_COLOR, vk::BlendFactor::ONE_MINUS_SRC1_COLOR, vk::BlendOp::ADD);
    let pipeline = Pipeline::new(
        gpu,
        &target,
        &PipelineOptions {
            fragment: Some(&fragment),
            blend: vec![by_second; count as usize],
            ..PipelineOptions::default()
        },
    );
    let vertices = Buffer::of(gpu, &shapes::whole(0.5, [1.0; 4]));
    gpu.run(|commands| {
        commands.pass(&target, &Pass::clear([0.5; 4]), || {
            commands.bind(&pipeline);
            commands.vertices(&vertices);
            commands.draw(0..6);
        });
    });
    for (location, image) in target.colors.iter().enumerate() {
        let number = location as f32;
        let expected = [0.5, 0.25, 0.125 * number, 0.0625].map(|by| (number + 1.0) * by + 0.5 * (1.0 - by));
        let bytes = image.read(vk::ImageAspectFlags::COLOR, if location % 2 == 0 { 16 } else { 8 });
        let found: [f32; 4] = match location % 2 {
            0 => bytemuck::pod_read_unaligned(&bytes[..16]),
            _ => [0, 2, 4, 6].map(|at| half::f16::from_le_bytes([bytes[at], bytes[at + 1]]).to_f32()),
        };
        assert_eq!(found, expected, "attachment {location}");
    }
}

/// A kernel reads each of 256 uniform and 256 storage buffers at its own dynamic offset.
#[gaurast_runner::test(needs = [GLSLANG])]
fn a_set_has_256_dynamic_offsets_of_each_kind() {
    const COUNT: u32 = 256;
    let gpu = own();
    let limits = gpu.limits();
    assert_eq!(limits.max_descriptor_set_uniform_buffers_dynamic, COUNT);
    assert_eq!(limits.max_descriptor_set_storage_buffers_dynamic, COUNT);
    let words = shader::compile(
        Stage::Compute,
        "layout(local_size_x = 256) in;
         layout(set = 0, binding = 0) uniform U { uint value; } uniforms[256];
         layout(set = 0, binding = 1) buffer S { uint value; } storages[256];
         layout(set = 1, binding = 0) buffer R { uvec2 found[]; };
         void main() {
             uint i = gl_LocalInvocationID.x;
             found[i] = uvec2(uniforms[i].value, storages[i].value);
         }",
    );
    let (uniform, storage) = (vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC, vk::DescriptorType::STORAGE_BUFFER_DYNAMIC);
    let result = vk::DescriptorType::STORAGE_BUFFER;
    let compute = Compute::new(gpu, &words, &[&[(0, uniform, COUNT), (1, storage, COUNT)], &[(0, result, 1)]]);
    let source = Buffer::of(gpu, &(0..4 * 2 * COUNT).collect::<Vec<u32>>());
    let found = Buffer::new(gpu, 8 * u64::from(COUNT));
    let device = gpu.device();
    let sets = compute.sets.allocate();
    let places = vec![vk::DescriptorBufferInfo::default().buffer(source.raw).range(16); COUNT as usize];
    let whole = [vk::DescriptorBufferInfo::default().buffer(found.raw).range(vk::WHOLE_SIZE)];
    let write = |set: usize, binding, ty, info| {
        let write = vk::WriteDescriptorSet::default().dst_set(sets[set]).dst_binding(binding).descriptor_type(ty);
        // SAFETY: see the crate.
        unsafe { device.update_descriptor_sets(&[write.buffer_info(info)], &[]) };
    };
    write(0, 0, uniform, &places);
    write(0, 1, storage, &places);
    write(1, 0, result, &whole);
    // Uniform buffers are read from the end on.
    let place = |index: u32| if index < COUNT { 2 * COUNT - 1 - index } else { index - COUNT };
    let offsets: Vec<u32> = (0..2 * COUNT).map(|index| 16 * place(index)).collect();
    gpu.run(|commands| {
        let (device, raw) = commands.raw();
        let point = vk::PipelineBindPoint::COMPUTE;
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_pipeline(raw, point, compute.kernel.raw);
            device.cmd_bind_descriptor_sets(raw, point, compute.kernel.layout, 0, &sets, &offsets);
            device.cmd_dispatch(raw, 1, 1, 1);
        }
    });
    let expected: Vec<[u32; 2]> = (0..COUNT).map(|index| [4 * place(index), 4 * place(COUNT + index)]).collect();
    assert_eq!(found.values::<[u32; 2]>(), expected);
}

/// A pipeline of triangles whose topology is dynamic draws points, with their sizes, and lines, as pipelines of these do.
#[gaurast_runner::test(needs = [GLSLANG])]
fn a_dynamic_topology_is_of_any_class() {
    use vk::PrimitiveTopology as T;
    let gpu = own();
    let mut properties = vk::PhysicalDeviceExtendedDynamicState3PropertiesEXT::default();
    let mut all = vk::PhysicalDeviceProperties2::default().push_next(&mut properties);
    // SAFETY: the physical device is the instance's.
    unsafe { gpu.instance().get_physical_device_properties2(gpu.physical_device(), &mut all) };
    assert_eq!(properties.dynamic_primitive_topology_unrestricted, vk::TRUE);
    let vertices = Buffer::of(gpu, &shapes::flat_soup(3, 20));
    let picture = |given: T, set: Option<T>| {
        let target = Target::new(gpu, &TargetOptions::default());
        let options = PipelineOptions {
            vertex: "layout(location = 0) in vec4 position;
                     layout(location = 1) in vec4 color;
                     layout(location = 0) out vec4 v_color;
                     void main() { gl_Position = position; gl_PointSize = 9.0 * color.x; v_color = color; }",
            topology: given,
            dynamic: set.iter().map(|_| vk::DynamicState::PRIMITIVE_TOPOLOGY).collect(),
            ..PipelineOptions::default()
        };
        let pipeline = Pipeline::new(gpu, &target, &options);
        let output = target.draw(gpu, &Pass::default(), |commands| {
            commands.bind(&pipeline);
            if let Some(topology) = set {
                let (device, raw) = commands.raw();
                // SAFETY: see the crate.
                unsafe { device.cmd_set_primitive_topology(raw, topology) };
            }
            commands.vertices(&vertices);
            commands.draw(0..60);
        });
        assert!(output.shows_something(), "{given:?} {set:?}");
        output
    };
    let classes = [T::POINT_LIST, T::LINE_STRIP, T::TRIANGLE_LIST];
    let expected = classes.map(|topology| picture(topology, None));
    assert!(expected[0] != expected[1] && expected[1] != expected[2]);
    for given in classes {
        for (set, expected) in classes.iter().zip(&expected) {
            assert!(picture(given, Some(*set)) == *expected, "{given:?} drawn as {set:?}");
        }
    }
}
