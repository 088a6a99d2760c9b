//! Transform feedback: what is written to which byte, exactly as the specification says. Most tests run on this driver
//! and on lavapipe.

use ash::vk;
use ash::vk::PrimitiveTopology as Topology;
use gaurast_runner::Case;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::shader::Stage;
use gaurast_testkit::stage_program::{drivers, need};
use gaurast_testkit::{
    Buffer, Commands, Driver, Gpu, Opening, Pass, Pipeline, PipelineOptions, Target, TransformFeedback,
};

/// A device with transform feedback, and its commands.
struct Device {
    gpu: Gpu,
    feedback: TransformFeedback,
}

/// The value of words that are not written.
const UNWRITTEN: u32 = 0xDEAD_BEEF;

impl Device {
    /// The device of the test's variant.
    fn of(case: &Case) -> Self {
        Self::open(match case.variant() {
            "lavapipe" => Driver::Lavapipe,
            _ => Driver::Embedded,
        })
    }

    fn open(driver: Driver) -> Self {
        let opening = Opening {
            extensions: &[
                ash::ext::transform_feedback::NAME,
                ash::ext::provoking_vertex::NAME,
                ash::ext::primitives_generated_query::NAME,
            ],
            ..Opening::of(driver)
        };
        let mut provoking = vk::PhysicalDeviceProvokingVertexFeaturesEXT::default()
            .provoking_vertex_last(true)
            .transform_feedback_preserves_provoking_vertex(true);
        let mut generated = vk::PhysicalDevicePrimitivesGeneratedQueryFeaturesEXT::default()
            .primitives_generated_query(true)
            .primitives_generated_query_with_rasterizer_discard(true)
            .primitives_generated_query_with_non_zero_streams(true);
        let mut features =
            vk::PhysicalDeviceTransformFeedbackFeaturesEXT::default().transform_feedback(true).geometry_streams(true);
        provoking.p_next = std::ptr::from_mut(&mut generated).cast();
        features.p_next = std::ptr::from_mut(&mut provoking).cast();
        let gpu = Gpu::open_with(&opening, &mut features).expect("a device");
        let feedback = TransformFeedback::new(&gpu);
        Self { gpu, feedback }
    }

    /// A buffer of words that are not written.
    fn buffer(&self, words: usize) -> Buffer {
        let bytes = 4 * words as u64;
        let buffer = Buffer::with_usage(&self.gpu, bytes, TransformFeedback::usage());
        buffer.write(&vec![UNWRITTEN; words]);
        buffer
    }

    /// Binds buffers of transform feedback.
    fn bind(&self, commands: &Commands, buffers: &[&Buffer]) {
        let places: Vec<_> = buffers.iter().map(|&buffer| (buffer, 0)).collect();
        self.feedback.bind(commands, 0, &places);
    }

    /// Captures draws, from the counter on if there is one.
    fn capture(&self, commands: &Commands, counter: Option<&Buffer>, draws: impl FnOnce()) {
        let counter: Vec<_> = counter.into_iter().map(|it| (it, 0)).collect();
        self.feedback.begin(commands, &counter);
        draws();
        self.feedback.end(commands, &counter);
    }

    /// Draws on a small target with a pipeline of these options, whose draws are recorded by `draws`.
    fn draw(&self, options: &PipelineOptions<'_>, draws: impl FnOnce(&Commands)) -> Target {
        let target = Target::floats(&self.gpu, [8, 8]);
        let pipeline = Pipeline::new(&self.gpu, &target, options);
        self.gpu.run(|commands| {
            commands.pass(&target, &Pass::zeros(), || {
                commands.bind(&pipeline);
                draws(commands);
            });
        });
        target
    }

    /// The words of a buffer after draws that are captured in it.
    fn captured(&self, options: &PipelineOptions<'_>, words: usize, draws: impl FnOnce(&Commands)) -> Vec<u32> {
        let buffer = self.buffer(words);
        self.draw(options, |commands| {
            self.bind(commands, &[&buffer]);
            self.capture(commands, None, || draws(commands));
        });
        buffer.values()
    }

    /// The results of queries of streams, one for each stream, around draws.
    fn queried<const N: usize>(
        &self,
        kind: vk::QueryType,
        streams: u32,
        draws: impl FnOnce(&dyn Fn(&Commands, bool)),
    ) -> Vec<[u64; N]> {
        let info = vk::QueryPoolCreateInfo::default().query_type(kind).query_count(streams);
        let device = self.gpu.device();
        // SAFETY: see the crate.
        let pool = unsafe { device.create_query_pool(&info, None).expect("a pool") };
        self.gpu.run(|commands| {
            // SAFETY: see the crate.
            unsafe { device.cmd_reset_query_pool(commands.raw().1, pool, 0, streams) };
        });
        draws(&|commands, begins| {
            for stream in 0..streams {
                match begins {
                    true => self.feedback.begin_query(commands, pool, stream, stream),
                    false => self.feedback.end_query(commands, pool, stream, stream),
                }
            }
        });
        let mut results = vec![[0; N]; streams as usize];
        let flags = vk::QueryResultFlags::WAIT | vk::QueryResultFlags::TYPE_64;
        // SAFETY: see the crate.
        unsafe {
            let got = device.get_query_pool_results(pool, 0, &mut results, flags);
            got.expect("results");
            device.destroy_query_pool(pool, None);
        }
        results
    }
}

/// A vertex shader that captures the vertex's number, and that of the instance.
const NUMBERS: &str = "
    layout(xfb_buffer = 0, xfb_stride = 8, xfb_offset = 0, location = 0) out uvec2 number;
    void main() {
        number = uvec2(gl_VertexIndex, gl_InstanceIndex);
        gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
        gl_PointSize = 1.0;
    }";

/// A pipeline without fragments.
fn discarding(vertex: &str) -> PipelineOptions<'_> {
    PipelineOptions {
        vertex,
        fragment: None,
        vertex_bindings: Vec::new(),
        vertex_attributes: Vec::new(),
        topology: Topology::POINT_LIST,
        raster: vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0).rasterizer_discard_enable(true),
        ..PipelineOptions::default()
    }
}

/// The primitives of a run of `count` vertices, as the specification's chapter on topologies lists them; adjacent vertices
/// are left out. The provoking vertex is the first, or the last.
fn primitives(topology: Topology, count: u32, last: bool) -> Vec<Vec<u32>> {
    let each = |number: u32, primitive: &dyn Fn(u32) -> Vec<u32>| (0..number).map(primitive).collect();
    match topology {
        Topology::POINT_LIST => each(count, &|i| vec![i]),
        Topology::LINE_LIST => each(count / 2, &|i| vec![2 * i, 2 * i + 1]),
        Topology::LINE_STRIP => each(count - 1, &|i| vec![i, i + 1]),
        Topology::TRIANGLE_LIST => each(count / 3, &|i| vec![3 * i, 3 * i + 1, 3 * i + 2]),
        Topology::TRIANGLE_STRIP => each(count - 2, &|i| match (i % 2, last) {
            (0, _) => vec![i, i + 1, i + 2],
            (_, false) => vec![i, i + 2, i + 1],
            (_, true) => vec![i + 1, i, i + 2],
        }),
        Topology::TRIANGLE_FAN => each(count - 2, &|i| match last {
            false => vec![i + 1, i + 2, 0],
            true => vec![0, i + 1, i + 2],
        }),
        Topology::LINE_LIST_WITH_ADJACENCY => each(count / 4, &|i| vec![4 * i + 1, 4 * i + 2]),
        Topology::LINE_STRIP_WITH_ADJACENCY => each(count - 3, &|i| vec![i + 1, i + 2]),
        Topology::TRIANGLE_LIST_WITH_ADJACENCY => each(count / 6, &|i| vec![6 * i, 6 * i + 2, 6 * i + 4]),
        Topology::TRIANGLE_STRIP_WITH_ADJACENCY => each((count - 4) / 2, &|i| match (i % 2, last) {
            (0, _) => vec![2 * i, 2 * i + 2, 2 * i + 4],
            (_, false) => vec![2 * i, 2 * i + 4, 2 * i + 2],
            (_, true) => vec![2 * i + 2, 2 * i, 2 * i + 4],
        }),
        other => unreachable!("{other:?}"),
    }
}

/// Each topology becomes a list, whose order keeps the provoking vertex.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn strips_and_fans_are_captured_as_lists(case: &Case) {
    let device = Device::of(case);
    const COUNT: u32 = 13;
    for topology in (0..10).map(Topology::from_raw) {
        for last in [false, true] {
            let mut provoking = vk::PipelineRasterizationProvokingVertexStateCreateInfoEXT::default()
                .provoking_vertex_mode(match last {
                    true => vk::ProvokingVertexModeEXT::LAST_VERTEX,
                    false => vk::ProvokingVertexModeEXT::FIRST_VERTEX,
                });
            let mut options = discarding(NUMBERS);
            options.topology = topology;
            options.raster.p_next = std::ptr::from_mut(&mut provoking).cast();
            let words = device.captured(&options, 200, |commands| {
                commands.draw_instances(0..COUNT, 3..5);
            });
            let expected = (3..5).flat_map(|instance| {
                let all = primitives(topology, COUNT, last).concat();
                all.into_iter().flat_map(move |vertex| [vertex, instance])
            });
            let expected: Vec<_> = expected.collect();
            let (found, rest) = words.split_at(expected.len());
            assert_eq!(found, expected, "{topology:?}, last: {last}");
            assert!(rest.iter().all(|&word| word == UNWRITTEN), "{topology:?}");
        }
    }
}

/// Outputs of several buffers, in gaps of which nothing is written: built-ins, arrays, matrices and structures, and those
/// that only the fragment shader would read.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn outputs_lie_at_their_offsets(case: &Case) {
    let device = Device::of(case);
    let options = discarding(
        "layout(xfb_buffer = 0, xfb_stride = 40) out;
         layout(xfb_buffer = 2, xfb_stride = 32) out;
         layout(xfb_buffer = 0) out gl_PerVertex {
             layout(xfb_offset = 4) vec4 gl_Position;
             layout(xfb_offset = 36) float gl_PointSize;
         };
         layout(location = 0, xfb_buffer = 0, xfb_offset = 24) out float values[2];
         layout(location = 3, xfb_buffer = 2, xfb_offset = 0) out mat2 matrix;
         layout(location = 6) out vec4 uncaptured;
         layout(location = 7, xfb_buffer = 2) out Block {
             layout(xfb_offset = 20) ivec2 two;
             int uncaptured_member;
         } block;
         void main() {
             float first = float(100 * gl_VertexIndex);
             gl_Position = first + vec4(1.0, 2.0, 3.0, 4.0);
             gl_PointSize = first + 5.0;
             values = float[](first + 6.0, first + 7.0);
             matrix = mat2(first + 8.0, first + 9.0, first + 10.0, first + 11.0);
             uncaptured = vec4(99.0);
             block.two = ivec2(gl_VertexIndex, -1);
             block.uncaptured_member = 99;
         }",
    );
    let buffers = [20, 1, 16].map(|words| device.buffer(words));
    device.draw(&options, |commands| {
        device.bind(commands, &buffers.each_ref());
        device.capture(commands, None, || commands.draw(0..2));
    });
    let float = |number: u32, value: u32| ((100 * number + value) as f32).to_bits();
    let none = UNWRITTEN;
    let first = (0..2).flat_map(|number| {
        let at = |value| float(number, value);
        [none, at(1), at(2), at(3), at(4), none, at(6), at(7), none, at(5)]
    });
    assert_eq!(buffers[0].values::<u32>(), first.collect::<Vec<_>>());
    assert_eq!(buffers[1].values::<u32>(), [none]);
    let third = (0..2).flat_map(|number| {
        let at = |value| float(number, value);
        [at(8), at(9), at(10), at(11), none, number, u32::MAX, none]
    });
    assert_eq!(buffers[2].values::<u32>(), third.collect::<Vec<_>>());
}

/// A primitive that doesn't fit is not written, nor is one after it; the query says how many were needed. A second
/// capture continues where the counter says, and a draw takes its number of vertices from there.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn a_full_buffer_takes_whole_primitives_only(case: &Case) {
    let device = Device::of(case);
    let (buffer, counter, drawn) = (device.buffer(23), device.buffer(1), device.buffer(40));
    let options = PipelineOptions { topology: Topology::LINE_LIST, ..discarding(NUMBERS) };
    let kind = vk::QueryType::TRANSFORM_FEEDBACK_STREAM_EXT;
    let mut counts = Vec::new();
    // Of five lines of four words each, the first four fit into two captures.
    for (range, first) in [(0..6, true), (6..10, false)] {
        let [count] = device.queried::<2>(kind, 1, |query| {
            device.draw(&options, |commands| {
                device.bind(commands, &[&buffer]);
                query(commands, true);
                let counter = [(&counter, 0)];
                let begun = if first { &counter[..0] } else { &counter };
                device.feedback.begin(commands, begun);
                commands.draw(range.clone());
                device.feedback.end(commands, &counter);
                query(commands, false);
            });
        })[..] else {
            panic!("a result");
        };
        counts.push(count);
    }
    assert_eq!(counts, [[3, 3], [2, 2]]);
    let numbers = |count: u32| (0..count).flat_map(|number| [number, 0]);
    let words: Vec<u32> = buffer.values();
    assert_eq!(words[..20], numbers(10).collect::<Vec<_>>());
    assert_eq!(counter.values::<u32>(), [80]);
    // Two more lines: one word is missing for the first.
    let [count] = device.queried::<2>(kind, 1, |query| {
        device.draw(&options, |commands| {
            device.bind(commands, &[&buffer]);
            query(commands, true);
            device.capture(commands, Some(&counter), || commands.draw(10..14));
            query(commands, false);
        });
    })[..] else {
        panic!("a result");
    };
    assert_eq!(count, [0, 2]);
    assert_eq!(buffer.values::<u32>()[20..], [UNWRITTEN; 3]);
    assert_eq!(counter.values::<u32>(), [80]);
    // The vertices after the first two. (lavapipe 22.3 draws these, too.)
    let skipped = if case.variant() == "lavapipe" { 0 } else { 2 };
    device.draw(&options, |commands| {
        device.bind(commands, &[&drawn]);
        device.capture(commands, None, || {
            device.feedback.draw(commands, 2, (&counter, 0), 8 * skipped, 8);
        });
    });
    let vertices = 0..10 - skipped;
    let instances =
        (0..2).flat_map(|instance| (vertices.clone()).flat_map(move |number| [number, instance])).collect::<Vec<_>>();
    assert_eq!(drawn.values::<u32>()[..instances.len()], instances);
}

/// More primitives than are processed together are written in order, beside what is drawn of them.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn many_primitives_are_written_in_order(case: &Case) {
    let device = Device::of(case);
    const COUNT: u32 = 100_000;
    let options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) flat in uvec2 number;
             layout(location = 0) out vec4 color;
             void main() { color = vec4(number, 0.0, 1.0); }",
        ),
        raster: vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0),
        ..discarding(NUMBERS)
    };
    let buffer = device.buffer(2 * COUNT as usize);
    let target = device.draw(&options, |commands| {
        device.bind(commands, &[&buffer]);
        device.capture(commands, None, || commands.draw(0..COUNT));
    });
    let expected: Vec<u32> = (0..COUNT).flat_map(|number| [number, 0]).collect();
    assert!(buffer.values::<u32>() == expected);
    let pixels: Vec<[f32; 4]> = target.read();
    let drawn: Vec<_> = pixels.iter().filter(|pixel| pixel[3] != 0.0).collect();
    assert_eq!(drawn, [&[(COUNT - 1) as f32, 0.0, 0.0, 1.0]]);
}

/// The vertices of a tessellated patch are those that the evaluation shader made, in the order of the primitives.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn tessellated_vertices_are_captured(case: &Case) {
    let device = Device::of(case);
    let control = "
        layout(vertices = 1) out;
        void main() {
            gl_TessLevelOuter = float[](2.0, 3.0, 0.0, 0.0);
            gl_TessLevelInner = float[](0.0, 0.0);
        }";
    let evaluation = "
        layout(isolines, equal_spacing) in;
        layout(xfb_buffer = 0, xfb_stride = 8, xfb_offset = 0, location = 0) out vec2 place;
        void main() {
            place = vec2(gl_TessCoord.xy) + vec2(0.0, float(gl_PrimitiveID));
            gl_Position = vec4(0.0);
        }";
    let options = PipelineOptions {
        between: vec![(Stage::TessellationControl, control), (Stage::TessellationEvaluation, evaluation)],
        topology: Topology::PATCH_LIST,
        patch_vertices: 1,
        ..discarding("void main() { gl_Position = vec4(0.0); }")
    };
    let words = device.captured(&options, 60, |commands| commands.draw(0..2));
    // Of each patch two lines at y 0 and 1/2, of three pieces each.
    let mut lines: Vec<[f32; 4]> =
        words[..48].chunks_exact(4).map(|line| [0, 1, 2, 3].map(|word| f32::from_bits(line[word]))).collect();
    assert!(words[48..].iter().all(|&word| word == UNWRITTEN));
    assert!(lines[..6].iter().all(|line| line[1] < 1.0), "the first patch");
    lines.sort_by(|a, b| (a[1], a[0]).partial_cmp(&(b[1], b[0])).expect("numbers"));
    let expected = [0.0, 0.5, 1.0, 1.5].into_iter().flat_map(|y: f32| {
        let third = |number: f32| number / 3.0;
        [0.0, 1.0, 2.0].map(move |number| [third(number), y, third(number + 1.0), y])
    });
    for (found, expected) in lines.iter().zip(expected) {
        let near = |(a, b): (&f32, f32)| (a - b).abs() < 1e-4;
        assert!(found.iter().zip(expected).all(near), "{found:?}, {expected:?}");
    }
}

/// A geometry shader that emits points to three streams, of which each has its own buffer.
const STREAMS: &str = "
    layout(points) in;
    layout(points, max_vertices = 6) out;
    layout(stream = 0, location = 0, xfb_buffer = 0, xfb_stride = 4, xfb_offset = 0) out uint zero;
    layout(stream = 1, location = 1, xfb_buffer = 3, xfb_stride = 4, xfb_offset = 0) out uint one;
    layout(stream = 3, location = 2, xfb_buffer = 1, xfb_stride = 4, xfb_offset = 0) out uint three;
    void main() {
        uint number = uint(gl_in[0].gl_Position.x);
        for (uint i = 0u; i < 3u; i++) {
            gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
            gl_PointSize = 1.0;
            three = 100u * number + i;
            EmitStreamVertex(3);
            EndStreamPrimitive(3);
        }
        for (uint i = 0u; i < number; i++) {
            one = 10u * number + i;
            EmitStreamVertex(1);
            EndStreamPrimitive(1);
        }
        zero = number;
        gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
        gl_PointSize = 1.0;
        EmitStreamVertex(0);
        EndStreamPrimitive(0);
    }";

/// Streams go to their own buffers, and queries count them.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn streams_are_captured_apart(case: &Case) {
    let device = Device::of(case);
    need("geometryShader", device.gpu.features().geometry_shader);
    let options = PipelineOptions {
        between: vec![(Stage::Geometry, STREAMS)],
        ..discarding("void main() { gl_Position = vec4(float(gl_VertexIndex), 0.0, 0.0, 1.0); }")
    };
    let buffers = [0; 4].map(|_| device.buffer(16));
    let draw = |query: &dyn Fn(&Commands, bool)| {
        device.draw(&options, |commands| {
            device.bind(commands, &buffers.each_ref());
            query(commands, true);
            device.capture(commands, None, || commands.draw(0..3));
            query(commands, false);
        });
    };
    let kind = vk::QueryType::TRANSFORM_FEEDBACK_STREAM_EXT;
    let counts = device.queried::<2>(kind, 4, draw);
    let found = buffers.each_ref().map(|buffer| buffer.values::<u32>());
    let padded = |written: &[u32]| {
        let mut words = written.to_vec();
        words.resize(16, UNWRITTEN);
        words
    };
    assert_eq!(found[0], padded(&[0, 1, 2]));
    assert_eq!(found[3], padded(&[10, 20, 21]));
    assert_eq!(found[1], padded(&[0, 1, 2, 100, 101, 102, 200, 201, 202]));
    assert_eq!(found[2], padded(&[]));
    let (written, needed): (Vec<_>, Vec<_>) = counts.iter().map(|it| (it[0], it[1])).unzip();
    assert_eq!(needed, [3, 3, 0, 9]);
    assert_eq!(written, [3, 3, 0, 9]);
    let kind = vk::QueryType::PRIMITIVES_GENERATED_EXT;
    let counts = device.queried::<1>(kind, 4, draw);
    assert_eq!(counts, [[3], [3], [0], [9]]);
}

/// Strips of two streams that take turns, of which the pipeline draws one.
#[gaurast_runner::test(needs = [GLSLANG])]
fn streams_of_triangles_take_turns() {
    let device = Device::open(Driver::Embedded);
    let geometry = "
        layout(points) in;
        layout(triangle_strip, max_vertices = 8) out;
        layout(stream = 0, location = 0, xfb_buffer = 0, xfb_stride = 4, xfb_offset = 0) out uint first;
        layout(stream = 2, location = 1, xfb_buffer = 1, xfb_stride = 4, xfb_offset = 0) out uint second;
        void main() {
            for (uint i = 0u; i < 4u; i++) {
                gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
                first = i;
                EmitStreamVertex(0);
                gl_Position = vec4(4.0 * float(i & 1u) - 1.0, 4.0 * float(i >> 1u) - 1.0, 0.0, 1.0);
                second = 10u + i;
                EmitStreamVertex(2);
            }
        }";
    let mut stream = vk::PipelineRasterizationStateStreamCreateInfoEXT::default().rasterization_stream(2);
    let mut options = PipelineOptions {
        between: vec![(Stage::Geometry, geometry)],
        fragment: Some(
            "layout(location = 1) flat in uint second;
             layout(location = 0) out vec4 color;
             void main() { color = vec4(float(second)); }",
        ),
        raster: vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0),
        ..discarding("void main() { gl_Position = vec4(0.0); }")
    };
    options.raster.p_next = std::ptr::from_mut(&mut stream).cast();
    let buffers = [0; 2].map(|_| device.buffer(7));
    let target = device.draw(&options, |commands| {
        device.bind(commands, &buffers.each_ref());
        device.capture(commands, None, || commands.draw(0..1));
    });
    assert_eq!(buffers[0].values::<u32>(), [0, 1, 2, 1, 3, 2, UNWRITTEN]);
    assert_eq!(buffers[1].values::<u32>(), [10, 11, 12, 11, 13, 12, UNWRITTEN]);
    let pixels: Vec<[f32; 4]> = target.read();
    assert_eq!(pixels[0], [10.0; 4], "the first triangle covers the target");
}

/// Wrong use of a command is refused by its rule.
#[gaurast_runner::test(needs = [GLSLANG])]
fn wrong_use_is_refused() {
    type Use = (&'static str, fn(&Device, &Commands, &Buffer));
    const CASES: [Use; 6] = [
        ("VUID-vkCmdEndTransformFeedbackEXT-None-02375", |device, commands, _| device.feedback.end(commands, &[])),
        ("VUID-vkCmdBeginTransformFeedbackEXT-None-02367", |device, commands, _| {
            device.capture(commands, None, || device.capture(commands, None, || ()));
        }),
        ("VUID-vkCmdBindTransformFeedbackBuffersEXT-None-02365", |device, commands, buffer| {
            device.capture(commands, None, || device.bind(commands, &[buffer]));
        }),
        ("VUID-vkCmdBindTransformFeedbackBuffersEXT-firstBinding-02357", |device, commands, buffer| {
            device.bind(commands, &[buffer; 5]);
        }),
        ("VUID-vkCmdBindTransformFeedbackBuffersEXT-pOffsets-02359", |device, commands, buffer| {
            device.feedback.bind(commands, 0, &[(buffer, 2)]);
        }),
        ("VUID-vkCmdDrawIndirectByteCountEXT-vertexStride-02289", |device, commands, buffer| {
            device.feedback.draw(commands, 1, (buffer, 0), 0, 0);
        }),
    ];
    let device = Device::open(Driver::Embedded);
    let buffer = device.buffer(4);
    let target = Target::floats(&device.gpu, [8, 8]);
    for (rule, misuse) in CASES {
        let recorded = device.gpu.try_record(|commands| {
            commands.pass(&target, &Pass::zeros(), || {
                misuse(&device, commands, &buffer);
            });
        });
        assert!(recorded.is_err(), "{rule}");
        let said = device.gpu.message_texts().concat();
        assert!(said.contains(rule), "{rule}: {said}");
    }
}
