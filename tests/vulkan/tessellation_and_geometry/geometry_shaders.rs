//! Geometry shaders: what they take and what becomes of what they emit, exactly as the specification says. Each test
//! runs on this driver and on lavapipe.

use ash::vk;
use ash::vk::PrimitiveTopology as Topology;
use gaurast_runner::Case;
use gaurast_testkit::devices::own;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::shader::Stage;
use gaurast_testkit::stage_program::{
    COVER, ONES, Program, SIDE, WORDS, drivers, multiview, need, options, with_geometry,
};
use gaurast_testkit::{Buffer, Gpu, Image, ImageOptions, PipelineOptions, Resource, Sampler, blend};

/// A pipeline with a geometry shader.
fn of(topology: Topology, geometry: &str) -> PipelineOptions<'_> {
    PipelineOptions { topology, between: vec![(Stage::Geometry, geometry)], ..options() }
}

/// A shader that turns points into triangle strips of rectangles; `main` is its body.
fn covering(layout: &str, main: &str) -> String {
    format!(
        "layout({layout}) in;
         layout(triangle_strip, max_vertices = 4) out;
         {WORDS}
         {COVER}
         void main() {{ {main} }}"
    )
}

/// Each topology, with the input of its geometry shader.
const TOPOLOGIES: [(Topology, &str); 10] = [
    (Topology::POINT_LIST, "points"),
    (Topology::LINE_LIST, "lines"),
    (Topology::LINE_STRIP, "lines"),
    (Topology::TRIANGLE_LIST, "triangles"),
    (Topology::TRIANGLE_STRIP, "triangles"),
    (Topology::TRIANGLE_FAN, "triangles"),
    (Topology::LINE_LIST_WITH_ADJACENCY, "lines_adjacency"),
    (Topology::LINE_STRIP_WITH_ADJACENCY, "lines_adjacency"),
    (Topology::TRIANGLE_LIST_WITH_ADJACENCY, "triangles_adjacency"),
    (Topology::TRIANGLE_STRIP_WITH_ADJACENCY, "triangles_adjacency"),
];

/// The places of the vertices of primitive `i` of `n`, as the specification's chapter on topologies lists them, in the
/// order of `gl_in`.
fn places(topology: Topology, i: usize, n: usize) -> Vec<usize> {
    let odd = i % 2;
    match topology {
        Topology::POINT_LIST => vec![i],
        Topology::LINE_LIST => vec![2 * i, 2 * i + 1],
        Topology::LINE_STRIP => vec![i, i + 1],
        Topology::TRIANGLE_LIST => vec![3 * i, 3 * i + 1, 3 * i + 2],
        Topology::TRIANGLE_STRIP => vec![i, i + 1 + odd, i + 2 - odd],
        Topology::TRIANGLE_FAN => vec![i + 1, i + 2, 0],
        Topology::LINE_LIST_WITH_ADJACENCY => (4 * i..4 * i + 4).collect(),
        Topology::LINE_STRIP_WITH_ADJACENCY => (i..i + 4).collect(),
        Topology::TRIANGLE_LIST_WITH_ADJACENCY => (6 * i..6 * i + 6).collect(),
        Topology::TRIANGLE_STRIP_WITH_ADJACENCY => {
            let first = 2 * i;
            let before = if i == 0 { 1 } else { first - 2 };
            let after = if i + 1 == n { first + 5 } else { first + 6 };
            match odd {
                0 => vec![first, before, first + 2, after, first + 4, first + 3],
                _ => vec![first, first + 3, first + 4, after, first + 2, before],
            }
        }
        other => unreachable!("{other:?}"),
    }
}

/// The number of primitives that `count` vertices make.
fn primitives(topology: Topology, count: usize) -> usize {
    match topology {
        Topology::POINT_LIST => count,
        Topology::LINE_LIST => count / 2,
        Topology::LINE_STRIP => count.saturating_sub(1),
        Topology::TRIANGLE_LIST => count / 3,
        Topology::TRIANGLE_STRIP | Topology::TRIANGLE_FAN => count.saturating_sub(2),
        Topology::LINE_LIST_WITH_ADJACENCY => count / 4,
        Topology::LINE_STRIP_WITH_ADJACENCY => count.saturating_sub(3),
        Topology::TRIANGLE_LIST_WITH_ADJACENCY => count / 6,
        Topology::TRIANGLE_STRIP_WITH_ADJACENCY => count.saturating_sub(4) / 2,
        other => unreachable!("{other:?}"),
    }
}

/// The vertices of each primitive of a run of vertices.
fn assembled(topology: Topology, vertices: &[u32]) -> Vec<Vec<u32>> {
    let count = primitives(topology, vertices.len());
    let primitive = |i| {
        let places = places(topology, i, count).into_iter();
        places.map(|place| vertices[place]).collect()
    };
    (0..count).map(primitive).collect()
}

/// Words of a primitive in the buffer of [`recording`].
const RECORD: usize = 8;

/// A pipeline whose geometry shader emits nothing.
fn silent(topology: Topology, geometry: &str) -> PipelineOptions<'_> {
    PipelineOptions { fragment: Some(ONES), ..of(topology, geometry) }
}

/// A shader that writes a record for each primitive: the number of invocations, and its vertices. Records begin at a
/// word that is pushed, and so is the number of records of an instance.
fn recording(input: &str) -> String {
    format!(
        "layout({input}) in;
         layout(line_strip, max_vertices = 2) out;
         layout(push_constant) uniform Push {{ uint first; uint primitives; }};
         {WORDS}
         void main() {{
             uint record = uint(gl_PrimitiveIDIn) + primitives * uint(gl_in[0].gl_Position.y);
             uint word = first + {RECORD}u * record;
             atomicAdd(words[word], 1u);
             for (int i = 0; i < gl_in.length(); i++) words[word + 1u + i] = uint(gl_in[i].gl_Position.x);
         }}"
    )
}

/// Checks the records of primitives, each of which had one invocation.
fn assert_records(words: &[u32], expected: &[Vec<u32>], what: &str) {
    for (number, vertices) in expected.iter().enumerate() {
        let record = &words[RECORD * number..][..=vertices.len()];
        assert_eq!(record[0], 1, "invocations of primitive {number} of {what}");
        assert_eq!(&record[1..], vertices, "primitive {number} of {what}");
    }
    let rest = &words[RECORD * expected.len()..];
    assert!(rest.iter().all(|word| *word == 0), "{what} has more primitives");
}

/// The vertices of each primitive of each topology, for runs of few and of many vertices and for several instances.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn primitives_have_their_vertices(case: &Case) {
    const INSTANCES: usize = 2;
    let gpu = with_geometry(case);
    let counts: Vec<usize> = (0..=14).chain([701]).collect();
    for (topology, input) in TOPOLOGIES {
        let shader = recording(input);
        let sizes: Vec<usize> = counts.iter().map(|&count| RECORD * INSTANCES * primitives(topology, count)).collect();
        let program = Program::new(silent(topology, &shader), sizes.iter().sum::<usize>() as u32);
        let drawn = program.draw(gpu, |commands| {
            let mut first = 0;
            for (&count, size) in counts.iter().zip(&sizes) {
                let each = primitives(topology, count);
                commands.push(0, &[first as u32, each as u32]);
                commands.draw_instances(0..count as u32, 0..INSTANCES as u32);
                first += size;
            }
        });
        let mut words = &drawn.words[..];
        for (&count, &size) in counts.iter().zip(&sizes) {
            let vertices: Vec<u32> = (0..count as u32).collect();
            let once = assembled(topology, &vertices);
            let expected = [&once[..]; INSTANCES].concat();
            let (these, rest) = words.split_at(size);
            assert_records(these, &expected, &format!("{count} vertices of {topology:?}"));
            words = rest;
        }
    }
}

/// Primitive restart ends a run of vertices: incomplete primitives are dropped, and numbers go on.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn restart_begins_another_run(case: &Case) {
    let gpu = with_geometry(case);
    let runs: Vec<Vec<u32>> = [5, 0, 8, 1, 3, 13, 2, 4, 6, 7, 9]
        .iter()
        .map(|&count: &u32| (0..count).map(|i| 7 * i % 31 + count).collect())
        .collect();
    let indices = runs.join(&u32::MAX);
    let short: Vec<u16> = indices.iter().map(|&index| index as u16).collect();
    let words = Buffer::of(gpu, &indices);
    let halves = Buffer::of(gpu, &short);
    for (topology, input) in TOPOLOGIES {
        if !format!("{topology:?}").contains("STRIP") && topology != Topology::TRIANGLE_FAN {
            continue;
        }
        let shader = recording(input);
        let options = PipelineOptions { restart: true, ..silent(topology, &shader) };
        let expected: Vec<_> = runs.iter().flat_map(|run| assembled(topology, run)).collect();
        let size = RECORD * (expected.len() + 4);
        let program = Program::new(options, 2 * size as u32);
        let drawn = program.draw(gpu, |commands| {
            let draw = |first: usize, buffer: &Buffer, kind| {
                commands.push(0, &[first as u32, 0]);
                commands.indices(buffer, 0, kind);
                commands.draw_indexed(0..indices.len() as u32, 0);
            };
            draw(0, &words, vk::IndexType::UINT32);
            draw(size, &halves, vk::IndexType::UINT16);
        });
        let (first, second) = drawn.words.split_at(size);
        assert_records(first, &expected, &format!("{topology:?}, 32 bits"));
        assert_records(second, &expected, &format!("{topology:?}, 16 bits"));
    }
}

/// Strips of a shader: primitive n emits strips of n % 7 and then of n % 5 vertices, each in a row of its own. The
/// second is not ended.
fn striping(output: &str, place: &str) -> String {
    format!(
        "layout(points) in;
         layout({output}, max_vertices = 10) out;
         layout(location = 0) flat out vec4 value;
         vec2 place(int i) {{ return {place}; }}
         void strip(int count, float x) {{
             for (int i = 0; i < count; i++) {{
                 vec2 at = vec2(x, 2 * gl_PrimitiveIDIn) + place(i);
                 gl_Position = vec4(at / 64.0 - 1.0, 0.0, 1.0);
                 gl_PointSize = 1.0;
                 value = vec4(i + 1);
                 EmitVertex();
             }}
         }}
         void main() {{
             strip(gl_PrimitiveIDIn % 7, 0.0);
             EndPrimitive();
             EndPrimitive();
             strip(gl_PrimitiveIDIn % 5, 64.0);
         }}"
    )
}

/// The kinds of output, the place of vertex i of a strip in pixels, and the vertices of the smallest strip.
const OUTPUTS: [(&str, &str, u32); 3] = [
    ("points", "vec2(i, 0) + 0.5", 1),
    ("line_strip", "vec2(i, 0) + 0.5", 2),
    ("triangle_strip", "vec2(i >> 1, 1.75 * float(i & 1))", 3),
];

/// A strip of n vertices has n points, n - 1 lines or n - 2 triangles, or none. Flat values are those of the first
/// vertex, and lines have no pixel at their end.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn strips_have_no_incomplete_primitives(case: &Case) {
    let gpu = with_geometry(case);
    for (output, place, least) in OUTPUTS {
        let shader = striping(output, place);
        let program = Program::new(of(Topology::POINT_LIST, &shader), 1);
        let drawn = program.draw(gpu, |commands| commands.draw(0..64));
        drawn.assert_all(|x, y| {
            let (number, column) = (y / 2, x % 64);
            let count = if x < 64 { number % 7 } else { number % 5 };
            let last = (count + 1).saturating_sub(least);
            // The pixels of triangles zigzag between two rows.
            let i = match least {
                3 => 2 * column + y % 2,
                _ if y % 2 == 1 => return 0.0,
                _ => column,
            };
            if i < last { (i + 1) as f32 } else { 0.0 }
        });
    }
}

/// Statistics of the same strips.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn statistics_count_whole_primitives(case: &Case) {
    let gpu = with_geometry(case);
    for (output, place, least) in OUTPUTS {
        let shader = striping(output, place);
        let all = 2 * primitives_of_strips(50, least);
        let expected = [100, 100, 100, all, all];
        assert_eq!(statistics(gpu, &shader), expected, "{output}");
    }
}

/// Each invocation for a primitive counts. (lavapipe 22.3.6 counts primitives.)
#[gaurast_runner::test(needs = [GLSLANG])]
fn statistics_count_every_invocation() {
    let (output, place, least) = OUTPUTS[2];
    let shader = striping(output, place).replace("(points) in", "(points, invocations = 3) in");
    let all = 2 * 3 * primitives_of_strips(50, least);
    let expected = [100, 100, 300, all, all];
    assert_eq!(statistics(own(), &shader), expected);
}

/// The number of primitives of the strips of the first `count` points.
fn primitives_of_strips(count: u64, least: u32) -> u64 {
    let complete = |count: u64| (count + 1).saturating_sub(u64::from(least));
    (0..count).map(|n| complete(n % 7) + complete(n % 5)).sum()
}

/// Vertices and primitives that are assembled, invocations of the stage, and primitives that it emits and that are
/// clipped, for two instances of 50 points.
fn statistics(gpu: &Gpu, shader: &str) -> [u64; 5] {
    use vk::QueryPipelineStatisticFlags as Flags;
    let counted = Flags::INPUT_ASSEMBLY_VERTICES
        | Flags::INPUT_ASSEMBLY_PRIMITIVES
        | Flags::GEOMETRY_SHADER_INVOCATIONS
        | Flags::GEOMETRY_SHADER_PRIMITIVES
        | Flags::CLIPPING_INVOCATIONS;
    let program = Program::new(of(Topology::POINT_LIST, shader), 1);
    program.statistics(gpu, counted, |commands| {
        commands.draw_instances(0..50, 0..2);
    })
}

/// Primitive n emits 2n vertices, of 256 at most, in loops of different lengths, and ends early in two ways.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn counts_of_vertices_differ(case: &Case) {
    let gpu = with_geometry(case);
    let shader = "
        layout(points) in;
        layout(triangle_strip, max_vertices = 256) out;
        out gl_PerVertex { vec4 gl_Position; };
        void emit(int i) {
            gl_Position = vec4(vec2(i >> 1, gl_PrimitiveIDIn + (i & 1)) / 64.0 - 1.0, 0.0, 1.0);
            EmitVertex();
        }
        void main() {
            int count = 2 * (gl_PrimitiveIDIn + 1);
            switch (gl_PrimitiveIDIn % 3) {
            case 0:
                for (int i = 0; i < count; i++) emit(i);
                break;
            case 1:
                for (int i = 0; true; i += 2) {
                    if (i == count) return;
                    emit(i);
                    emit(i + 1);
                }
            default:
                int i = 0;
                while (i < 256) {
                    for (int j = 0; j < 7; j++) {
                        if (i >= count) break;
                        emit(i++);
                    }
                    if (i >= count) break;
                }
            }
        }";
    let one = vk::BlendFactor::ONE;
    let options = PipelineOptions {
        fragment: Some(ONES),
        blend: vec![blend(one, one, vk::BlendOp::ADD)],
        ..of(Topology::POINT_LIST, shader)
    };
    let drawn = Program::new(options, 1).draw(gpu, |commands| commands.draw(0..SIDE));
    drawn.assert_all(|x, y| if x < y { 1.0 } else { 0.0 });
}

/// Invocations that skip an emission in one round of a loop emit in the next: those of the set bits of their number.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn vertices_are_emitted_in_branches(case: &Case) {
    let gpu = with_geometry(case);
    let emitting = |body: &str| {
        format!(
            "layout(points) in;
             layout(points, max_vertices = 7) out;
             layout(location = 0) flat out vec4 value;
             void emit(int i) {{
                 gl_Position = vec4((vec2(i, gl_PrimitiveIDIn) + 0.5) / 64.0 - 1.0, 0.0, 1.0);
                 gl_PointSize = 1.0;
                 value = vec4(i + 1);
                 EmitVertex();
             }}
             void main() {{
                 for (int i = 0; i < 7; i++) {{
                     bool is_set = (gl_PrimitiveIDIn >> i & 1) != 0;
                     {body}
                 }}
             }}"
        )
    };
    for body in [
        "if (is_set) emit(i);",
        "if (!is_set) continue; emit(i);",
        "switch (int(is_set)) { case 1: emit(i); break; default: break; }",
        "do { if (!is_set) break; emit(i); } while (false);",
    ] {
        let shader = emitting(body);
        let program = Program::new(of(Topology::POINT_LIST, &shader), 1);
        let drawn = program.draw(gpu, |commands| commands.draw(0..SIDE));
        drawn.assert_all(|x, y| {
            let is_set = x < 7 && y >> x & 1 != 0;
            if is_set { (x + 1) as f32 } else { 0.0 }
        });
    }
}

#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn one_vertex_is_a_point(case: &Case) {
    let gpu = with_geometry(case);
    let shader = "
        layout(points) in;
        layout(points, max_vertices = 1) out;
        layout(location = 0) flat out vec4 value;
        void main() {
            int n = gl_PrimitiveIDIn;
            gl_Position = vec4((vec2(n % 128, n / 128) + 0.5) / 64.0 - 1.0, 0.0, 1.0);
            gl_PointSize = 1.0;
            value = vec4(n);
            if (n % 3 != 0) EmitVertex();
        }";
    let program = Program::new(of(Topology::POINT_LIST, shader), 1);
    let drawn = program.draw(gpu, |commands| commands.draw(0..3000));
    drawn.assert_all(|x, y| {
        let n = SIDE * y + x;
        if n < 3000 && !n.is_multiple_of(3) { n as f32 } else { 0.0 }
    });
}

/// Each primitive has all its invocations. Primitives are in order, and within a primitive its invocations are.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn invocations_are_in_order(case: &Case) {
    let gpu = with_geometry(case);
    for count in [1, 2, 32] {
        // All invocations cover the pixels to the right of their number, in the row of their primitive and the next.
        let shader = covering(
            &format!("points, invocations = {count}"),
            "atomicAdd(words[32 * gl_PrimitiveIDIn + gl_InvocationID], 1u);
             shown = vec4(32 * gl_PrimitiveIDIn + gl_InvocationID + 1);
             cover(vec2(gl_InvocationID, gl_PrimitiveIDIn), vec2(40, 2));",
        );
        let program = Program::new(of(Topology::POINT_LIST, &shader), 32 * 100);
        let drawn = program.draw(gpu, |commands| commands.draw(0..100));
        for (number, &word) in drawn.words.iter().enumerate() {
            let expected = u32::from(number as u32 % 32 < count);
            assert_eq!(word, expected, "invocation {number} of {count}");
        }
        // A later primitive covers an earlier one, and a later invocation an earlier one.
        drawn.assert_all(|x, y| {
            let mut rows = [Some(y), y.checked_sub(1)].into_iter().flatten();
            let primitive = rows.find(|row| *row < 100 && x < count + 39);
            let last = x.min(count - 1);
            primitive.map_or(0.0, |primitive| (32 * primitive + last + 1) as f32)
        });
    }
}

/// The number that the shader gives a primitive is its number in the fragment shader.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn fragments_have_the_number_that_was_given(case: &Case) {
    let gpu = with_geometry(case);
    let shader = covering(
        "lines",
        "for (int i = 0; i < 4; i++) {
             gl_PrimitiveID = 5 * gl_PrimitiveIDIn - 3;
             int row = 2 * (gl_PrimitiveIDIn / 64) + int(gl_in[0].gl_Position.y);
             gl_Position = at(vec2(2 * (gl_PrimitiveIDIn % 64) + (i & 1), row + (i >> 1)));
             EmitVertex();
         }",
    );
    let options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) out vec4 color;
             void main() { color = vec4(gl_PrimitiveID, 1.0, 0.0, 0.0); }",
        ),
        ..of(Topology::LINE_LIST, &shader)
    };
    let drawn = Program::new(options, 1).draw(gpu, |commands| {
        commands.draw_instances(0..1400, 0..2);
    });
    for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
        let n = 64 * (y / 2) + x / 2;
        let expected = if x % 2 == 0 && n < 700 { [(5 * n) as f32 - 3.0, 1.0] } else { [0.0; 2] };
        let [number, is_drawn, ..] = drawn.texel(x, y);
        assert_eq!([number, is_drawn], expected, "texel {x}, {y}");
    }
}

/// A layer of several for each primitive, which the fragment shader knows. Others stay as they are.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn layers_are_chosen(case: &Case) {
    let gpu = with_geometry(case);
    let shader = covering(
        "points, invocations = 3",
        "int layer = 2 * gl_InvocationID + 1;
         shown = vec4(gl_PrimitiveIDIn + 1);
         gl_Layer = layer;
         for (int corner = 0; corner < 4; corner++) {
             gl_Position = at(vec2(8 * layer + 16 * (corner & 1), 16 * (gl_PrimitiveIDIn + (corner >> 1))));
             value = shown;
             gl_Layer = layer;
             EmitVertex();
         }",
    );
    let options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) flat in vec4 value;
             layout(location = 0) out vec4 color;
             void main() { color = vec4(100 * gl_Layer) + value; }",
        ),
        ..of(Topology::POINT_LIST, &shader)
    };
    let program = Program { layers: 7, ..Program::new(options, 1) };
    let drawn = program.draw(gpu, |commands| commands.draw(0..5));
    for layer in 0..7 {
        drawn.assert_layer(layer, |x, y| {
            let is_inside = (8 * layer..8 * layer + 16).contains(&x) && y < 80;
            if layer % 2 == 1 && is_inside { (100 * layer + y / 16 + 1) as f32 } else { 0.0 }
        });
    }
}

/// A viewport with its scissor for each primitive.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn viewports_are_chosen(case: &Case) {
    let gpu = with_geometry(case);
    need("multiViewport", gpu.features().multi_viewport);
    let shader = covering(
        "points, invocations = 4",
        "for (int corner = 0; corner < 4; corner++) {
             gl_ViewportIndex = 3 - gl_InvocationID;
             gl_Position = vec4(2.0 * vec2(corner & 1, corner >> 1) - 1.0, 0.0, 1.0);
             value = vec4(gl_InvocationID + 1);
             EmitVertex();
         }",
    );
    let options = PipelineOptions {
        viewports: 4,
        fragment: Some(
            "layout(location = 0) flat in vec4 value;
             layout(location = 0) out vec4 color;
             void main() { color = 10.0 * value + gl_ViewportIndex; }",
        ),
        ..of(Topology::POINT_LIST, &shader)
    };
    let drawn = Program::new(options, 1).draw(gpu, |commands| {
        let (device, raw) = commands.raw();
        let column = |index: u32| (32 * index) as f32;
        let viewports = [0, 1, 2, 3].map(|index| vk::Viewport {
            x: column(index),
            y: 8.0,
            width: 24.0,
            height: 64.0,
            min_depth: 0.0,
            max_depth: 1.0,
        });
        let scissors = [0, 1, 2, 3].map(|index: i32| vk::Rect2D {
            offset: vk::Offset2D { x: 32 * index, y: 0 },
            extent: vk::Extent2D { width: 16 + 4 * index as u32, height: 40 },
        });
        // SAFETY: see the crate.
        unsafe {
            device.cmd_set_viewport(raw, 0, &viewports);
            device.cmd_set_scissor(raw, 0, &scissors);
        }
        commands.draw(0..1);
    });
    drawn.assert_all(|x, y| {
        let viewport = x / 32;
        let width = (16 + 4 * viewport).min(24);
        if x % 32 < width && (8..40).contains(&y) { (10 * (4 - viewport) + viewport) as f32 } else { 0.0 }
    });
}

/// A point of size s whose centre is that of a pixel covers s by s pixels, if s is odd.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn points_have_their_sizes(case: &Case) {
    let gpu = with_geometry(case);
    let features = gpu.features();
    let sizes = features.shader_tessellation_and_geometry_point_size;
    need("shaderTessellationAndGeometryPointSize", sizes);
    need("largePoints", features.large_points);
    let shader = "
        layout(points) in;
        layout(points, max_vertices = 4) out;
        layout(location = 0) flat out vec4 value;
        void main() {
            for (int i = 0; i < 4; i++) {
                gl_Position = vec4((vec2(32 * i + 16, 32 * gl_PrimitiveIDIn + 16) + 0.5) / 64.0 - 1.0, 0.0, 1.0);
                gl_PointSize = 2.0 * float(4 * gl_PrimitiveIDIn + i) - 1.0;
                value = vec4(1.0);
                if (gl_PointSize > 0.0) EmitVertex();
            }
        }";
    let program = Program::new(of(Topology::POINT_LIST, shader), 1);
    let drawn = program.draw(gpu, |commands| commands.draw(0..4));
    drawn.assert_all(|x, y| {
        let number = (4 * (y / 32) + x / 32) as i32;
        let distance = |place: u32| (place % 32).abs_diff(16) as i32;
        let is_covered = distance(x).max(distance(y)) < number;
        if is_covered { 1.0 } else { 0.0 }
    });
}

/// Clip distances cut a rectangle between two columns of pixels, and a primitive with negative cull distances vanishes.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn distances_clip_and_cull(case: &Case) {
    let gpu = with_geometry(case);
    let features = gpu.features();
    need("shaderClipDistance", features.shader_clip_distance);
    need("shaderCullDistance", features.shader_cull_distance);
    let shader = covering(
        "points",
        "for (int corner = 0; corner < 4; corner++) {
             vec2 place = vec2(100 * (corner & 1), 10 * (gl_PrimitiveIDIn + (corner >> 1)));
             gl_Position = at(place);
             gl_ClipDistance[0] = place.x - float(10 * gl_PrimitiveIDIn);
             gl_ClipDistance[1] = 80.0 - place.x;
             gl_CullDistance[0] = gl_PrimitiveIDIn % 3 == 0 ? -1.0 : 1.0;
             gl_CullDistance[1] = gl_PrimitiveIDIn == 4 && corner > 0 ? 1.0 : -0.5 + float(gl_PrimitiveIDIn == 1);
             value = vec4(gl_PrimitiveIDIn + 1);
             EmitVertex();
         }",
    );
    let shader = shader.replace(
        "layout(triangle_strip",
        "out gl_PerVertex { vec4 gl_Position; float gl_ClipDistance[2]; float gl_CullDistance[2]; };
         layout(triangle_strip",
    );
    let program = Program::new(of(Topology::POINT_LIST, &shader), 1);
    let drawn = program.draw(gpu, |commands| commands.draw(0..9));
    drawn.assert_all(|x, y| {
        let n = y / 10;
        // Primitive 4 is culled only if all vertices have a negative distance.
        let is_whole = n == 1 || n == 4;
        if is_whole && (10 * n..80).contains(&x) { (n + 1) as f32 } else { 0.0 }
    });
}

/// Blocks of structures, arrays, integers and matrices reach the fragment shader, with each kind of interpolation.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn values_reach_fragments(case: &Case) {
    let gpu = with_geometry(case);
    let vertex = "
        struct Pair { vec2 place; float size; };
        layout(location = 0) out Block { Pair pairs[2]; ivec3 whole; } given;
        layout(location = 6) out uint bits;
        void main() {
            gl_Position = vec4(gl_VertexIndex, 0.0, 0.0, 1.0);
            for (int i = 0; i < 2; i++) {
                given.pairs[i].place = vec2(gl_VertexIndex + i, -gl_VertexIndex);
                given.pairs[i].size = float(10 + i);
            }
            given.whole = ivec3(-gl_VertexIndex, 1 << 30, gl_VertexIndex * 1000);
            bits = 0xffffff00u + uint(gl_VertexIndex);
        }";
    let geometry = "
        struct Pair { vec2 place; float size; };
        layout(lines) in;
        layout(triangle_strip, max_vertices = 4) out;
        layout(location = 0) in Block { Pair pairs[2]; ivec3 whole; } given[];
        layout(location = 6) in uint bits[];
        layout(location = 0) out Smooth { mat2 turn; float list[3]; } smoothed;
        layout(location = 5) noperspective out vec2 straight;
        layout(location = 6) flat out ivec4 whole;
        layout(location = 7) flat out uint bits_sum;
        void main() {
            for (int corner = 0; corner < 4; corner++) {
                int end = corner & 1;
                vec2 place = vec2(128 * end, 128 * (corner >> 1));
                // The right side is twice as far.
                float w = 1.0 + end;
                gl_Position = vec4((place / 64.0 - 1.0) * w, 0.0, w);
                smoothed.turn = mat2(place, place.yx) * given[end].pairs[1].size / 11.0;
                smoothed.list = float[3](place.x, given[end].pairs[1].place.x, given[1 - end].pairs[0].place.y);
                straight = place;
                whole = ivec4(given[0].whole + given[1].whole * ivec3(1, 0, 1), corner);
                bits_sum = bits[0] & bits[1];
                EmitVertex();
            }
        }";
    let fragment = format!(
        "layout(location = 0) in Smooth {{ mat2 turn; float list[3]; }} smoothed;
         layout(location = 5) noperspective in vec2 straight;
         layout(location = 6) flat in ivec4 whole;
         layout(location = 7) flat in uint bits_sum;
         layout(location = 0) out vec4 color;
         {WORDS}
         void main() {{
             color = vec4(smoothed.turn[0].x, smoothed.list[1], smoothed.list[2], straight.x);
             bool is_right = whole.xyz == ivec3(-1, 1 << 30, 1000) && whole.w == int(gl_FragCoord.x + gl_FragCoord.y >= 128.0)
                 && bits_sum == 0xffffff00u && smoothed.turn[0] == smoothed.turn[1].yx
                 && smoothed.list[0] == smoothed.turn[0].x;
             if (!is_right) atomicAdd(words[0], 1u);
             atomicAdd(words[1], 1u);
         }}"
    );
    let options = PipelineOptions { vertex, fragment: Some(&fragment), ..of(Topology::LINE_LIST, geometry) };
    let drawn = Program::new(options, 2).draw(gpu, |commands| commands.draw(0..2));
    assert_eq!(drawn.words, [0, SIDE * SIDE], "wrong fragments, fragments");
    for x in 0..SIDE {
        let straight = x as f32 + 0.5;
        // With w from 1 to 2, values move towards the near end.
        let t = straight / 128.0;
        let nearer = t / 2.0 / ((1.0 - t) + t / 2.0);
        let expected = [128.0 * nearer, 1.0 + nearer, nearer - 1.0, straight];
        for y in [0, 31, 32, 100] {
            let found = drawn.texel(x, y);
            for (found, expected) in found.into_iter().zip(expected) {
                let is_close = (found - expected).abs() <= 1e-5 * expected.abs().max(1.0);
                assert!(is_close, "texel {x}, {y}: {found}, not {expected}");
            }
        }
    }
}

/// Thousands of points become rectangles that are blended in the order of the points: a texel halves what it held, so
/// that its bits are those of its points.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn many_primitives_keep_their_order(case: &Case) {
    const POINTS: u32 = 4000;
    let gpu = with_geometry(case);
    let shader = covering(
        "points",
        "int n = gl_PrimitiveIDIn;
         shown = vec4(float((n * 73 >> 3) & 1), 0.0, 0.0, 0.5);
         cover(4.0 * vec2(n * 7 % 16, n * 11 % 256 / 16), vec2(4));",
    );
    let (from, to) = (vk::BlendFactor::ONE, vk::BlendFactor::SRC_ALPHA);
    let options =
        PipelineOptions { blend: vec![blend(from, to, vk::BlendOp::ADD)], ..of(Topology::POINT_LIST, &shader) };
    let drawn = Program::new(options, 1).draw(gpu, |commands| commands.draw(0..POINTS));
    let mut cells = [[0.0f32; 16]; 16];
    for n in 0..POINTS {
        let cell = &mut cells[(n * 11 % 256 / 16) as usize][(n * 7 % 16) as usize];
        *cell = *cell * 0.5 + (((n * 73) >> 3) & 1) as f32;
    }
    drawn.assert_all(|x, y| match (x / 4, y / 4) {
        (column @ ..16, row @ ..16) => cells[row as usize][column as usize],
        _ => 0.0,
    });
}

/// The stage reads a uniform buffer, a texture and push constants, and adds to a storage buffer.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn the_stage_uses_resources(case: &Case) {
    let gpu = with_geometry(case);
    let colors: Vec<f32> = (0..64).map(|texel| 100.0 + texel as f32).collect();
    let image = ImageOptions::new(vk::Format::R32_SFLOAT, [8, 8], vk::ImageUsageFlags::SAMPLED);
    let image = Image::textured(gpu, &image, &[colors]);
    let sampler = Sampler::new(gpu, &vk::SamplerCreateInfo::default());
    let uniform = Buffer::of(gpu, &[[3.0f32, 5.0, 7.0, 9.0], [0.5, 0.25, 0.125, 2.0]]);
    let shader = covering(
        "points",
        "int n = gl_PrimitiveIDIn;
         float texel = texelFetch(image, ivec2(n % 8, n / 8), 0).r;
         shown = vec4(texel * scales[1][n % 4] + scales[0][n % 3] + pushed.y);
         uint before = atomicAdd(words[0], uint(n));
         atomicMax(words[1], before);
         words[2 + n] = uint(texel);
         cover(vec2(n, 0), vec2(1));",
    );
    let shader = shader.replace(
        "void main",
        "layout(binding = 1) uniform Scales { vec4 scales[2]; };
         layout(binding = 2) uniform sampler2D image;
         layout(push_constant) uniform Push { vec2 pushed; };
         void main",
    );
    let program = Program {
        resources: vec![Resource::Uniform(uniform.raw), Resource::Texture(image.view, sampler.raw)],
        ..Program::new(of(Topology::POINT_LIST, &shader), 2 + 64)
    };
    let drawn = program.draw(gpu, |commands| {
        commands.push(0, &[1.0f32, 1000.0]);
        commands.draw(0..32);
        commands.push(0, &[1.0f32, 2000.0]);
        commands.draw(0..16);
    });
    let sum = (0..32).sum::<u32>() + (0..16).sum::<u32>();
    assert_eq!(drawn.words[0], sum);
    assert!((sum - 31..=sum).contains(&drawn.words[1]));
    for n in 0..64 {
        let expected = if n < 32 { 100 + n } else { 0 };
        assert_eq!(drawn.words[2 + n as usize], expected);
    }
    drawn.assert_all(|x, y| {
        if y > 0 || x >= 32 {
            return 0.0;
        }
        let scale = [0.5, 0.25, 0.125, 2.0][x as usize % 4];
        let added = [3.0, 5.0, 7.0][x as usize % 3];
        let pushed = if x < 16 { 2000.0 } else { 1000.0 };
        (100 + x) as f32 * scale + added + pushed
    });
}

/// Each view has its own invocations, which know its number.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn views_have_their_own_primitives(case: &Case) {
    const MASK: u32 = 0b1_0110;
    let gpu = with_geometry(case);
    let has = multiview(gpu).multiview_geometry_shader;
    need("multiviewGeometryShader", has);
    let shader = covering(
        "points",
        "shown = vec4(10 * gl_ViewIndex + gl_PrimitiveIDIn + 1);
         atomicAdd(words[gl_ViewIndex], 1u);
         cover(vec2(16 * gl_ViewIndex, gl_PrimitiveIDIn), vec2(16, 1));",
    );
    let shader = format!("#extension GL_EXT_multiview : require\n{shader}");
    let options = PipelineOptions { view_mask: MASK, ..of(Topology::POINT_LIST, &shader) };
    let program = Program { layers: 6, ..Program::new(options, 6) };
    let drawn = program.draw(gpu, |commands| commands.draw(0..3));
    for view in 0..6 {
        let is_drawn = MASK & (1 << view) != 0;
        let invocations = if is_drawn { 3 } else { 0 };
        assert_eq!(drawn.words[view as usize], invocations, "view {view}");
        // Layers that are not views are not cleared.
        if is_drawn {
            drawn.assert_layer(view, |x, y| {
                let is_covered = x / 16 == view && y < 3;
                if is_covered { (10 * view + y + 1) as f32 } else { 0.0 }
            });
        }
    }
}
