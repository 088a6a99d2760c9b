//! Tessellation shaders: what the stages exchange, and what patches are divided into, as far as the specification fixes
//! it. Each test runs on this driver and on lavapipe.

use std::collections::{BTreeMap, BTreeSet};

use ash::vk;
use ash::vk::PrimitiveTopology as Topology;
use gaurast_runner::Case;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::shader::Stage;
use gaurast_testkit::stage_program::{
    Drawn, ONES, Program, WORDS, drivers, multiview, need, options, with_tessellation,
};
use gaurast_testkit::{Buffer, Driver, Gpu, Image, ImageOptions, Opening, PipelineOptions, Resource, Sampler};

/// A pipeline with the two stages.
fn of<'a>(patch_vertices: u32, control: &'a str, evaluation: &'a str) -> PipelineOptions<'a> {
    PipelineOptions {
        topology: Topology::PATCH_LIST,
        patch_vertices,
        between: vec![(Stage::TessellationControl, control), (Stage::TessellationEvaluation, evaluation)],
        ..options()
    }
}

/// Levels of a patch: those of the edges, and those of the inside.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct Levels {
    outer: [f32; 4],
    inner: [f32; 4],
}

const fn levels(outer: [f32; 4], inner: [f32; 2]) -> Levels {
    Levels { outer, inner: [inner[0], inner[1], 0.0, 0.0] }
}

/// A control shader that takes the levels of each patch from binding 1.
const CONTROL: &str = "
    layout(vertices = 1) out;
    struct Levels { vec4 outer; vec4 inner; };
    layout(std430, binding = 1) readonly buffer All { Levels levels[]; };
    void main() {
        gl_out[gl_InvocationID].gl_Position = gl_in[0].gl_Position;
        for (int i = 0; i < 4; i++) gl_TessLevelOuter[i] = levels[gl_PrimitiveID].outer[i];
        for (int i = 0; i < 2; i++) gl_TessLevelInner[i] = levels[gl_PrimitiveID].inner[i];
    }";

/// The function `record`, which adds a record of N words to the buffer.
fn recorder(words: usize) -> String {
    format!(
        "{WORDS}
         void record(uint given[{words}]) {{
             uint word = 1u + {words}u * atomicAdd(words[0], 1u);
             for (int i = 0; i < {words} && word + i < words.length(); i++) words[word + i] = given[i];
         }}"
    )
}

/// An evaluation shader that records the number of the patch and the coordinates of each of its vertices.
fn evaluation(layout: &str) -> String {
    format!(
        "layout({layout}) in;
         {}
         layout(location = 0) out vec4 value;
         void main() {{
             uvec3 bits = floatBitsToUint(gl_TessCoord);
             record(uint[4](uint(gl_PrimitiveID), bits.x, bits.y, bits.z));
             gl_Position = vec4(0.0);
             gl_PointSize = 1.0;
             value = vec4(0.0);
         }}",
        recorder(4)
    )
}

/// Draws a patch for each element of `all`.
fn drawn(gpu: &Gpu, options: PipelineOptions<'_>, words: u32, all: &[Levels]) -> Drawn {
    let buffer = Buffer::of(gpu, all);
    let program = Program { resources: vec![Resource::Storage(buffer.raw)], ..Program::new(options, words) };
    let vertices = program.options.patch_vertices * all.len() as u32;
    program.draw(gpu, |commands| commands.draw(0..vertices))
}

/// Coordinates in the domain, as bits.
type Place = [u32; 3];

fn values(place: Place) -> [f32; 3] {
    place.map(f32::from_bits)
}

/// The distinct coordinates of each patch. A shader may run more than once for a vertex.
fn coordinates(gpu: &Gpu, layout: &str, all: &[Levels]) -> Vec<BTreeSet<Place>> {
    let evaluation = evaluation(layout);
    let drawn = drawn(gpu, of(1, CONTROL, &evaluation), 1 << 18, all);
    let mut patches = vec![BTreeSet::new(); all.len()];
    for [patch, u, v, w] in drawn.records() {
        patches[patch as usize].insert([u, v, w]);
    }
    patches
}

/// The greatest distance of a coordinate from its exact value: that of fixed point with 16 bits, with some rounding.
const TOLERANCE: f32 = 1e-4;

/// Checks that two sets of coordinates are the same.
fn assert_same(found: &BTreeSet<Place>, expected: &[[f32; 3]], what: &str) {
    let is_near = |a: [f32; 3], b: [f32; 3]| a.into_iter().zip(b).all(|(a, b)| (a - b).abs() <= TOLERANCE);
    for &place in expected {
        // Bits of numbers that are not negative have the numbers' order.
        let first = (place[0] - TOLERANCE).max(0.0).to_bits();
        let last = (place[0] + TOLERANCE).to_bits();
        let near =
            found.range([first, 0, 0]..=[last, u32::MAX, u32::MAX]).filter(|found| is_near(values(**found), place));
        assert_eq!(near.count(), 1, "{what}: {place:?}");
    }
    assert_eq!(found.len(), expected.len(), "{what}");
}

/// The number of segments of an edge with equal spacing.
fn segments(level: f32) -> usize {
    level.clamp(1.0, 64.0).ceil() as usize
}

/// The parts of an edge of n segments, without the last end.
fn parts(count: usize) -> impl Iterator<Item = f32> {
    (0..count).map(move |i| i as f32 / count as f32)
}

/// The vertices of a quad with equal spacing.
fn quad(Levels { outer, inner }: Levels) -> Vec<[f32; 3]> {
    let outer = outer.map(segments);
    let [n, m, ..] = inner.map(segments);
    let is_whole = outer == [1; 4] && n == 1 && m == 1;
    let mut all = Vec::new();
    all.extend(parts(outer[0]).map(|t| [0.0, 1.0 - t, 0.0]));
    all.extend(parts(outer[1]).map(|t| [t, 0.0, 0.0]));
    all.extend(parts(outer[2]).map(|t| [1.0, t, 0.0]));
    all.extend(parts(outer[3]).map(|t| [1.0 - t, 1.0, 0.0]));
    if !is_whole {
        let (n, m) = (n.max(2), m.max(2));
        for u in parts(n).skip(1) {
            all.extend(parts(m).skip(1).map(|v| [u, v, 0.0]));
        }
    }
    all
}

/// The vertices of a triangle with equal spacing: rings around its centre.
fn triangle(Levels { outer, inner }: Levels) -> Vec<[f32; 3]> {
    let outer = outer.map(segments);
    let n = segments(inner[0]);
    let is_whole = outer[..3] == [1; 3] && n == 1;
    let mut all = Vec::new();
    all.extend(parts(outer[0]).map(|t| [0.0, t, 1.0 - t]));
    all.extend(parts(outer[1]).map(|t| [1.0 - t, 0.0, t]));
    all.extend(parts(outer[2]).map(|t| [t, 1.0 - t, 0.0]));
    if is_whole {
        return all;
    }
    let n = n.max(2);
    for ring in 1..=n / 2 {
        // A corner is where lines meet that are perpendicular to two edges, each a part of n away from its end.
        let near = 2.0 * ring as f32 / (3.0 * n as f32);
        let far = 1.0 - 2.0 * near;
        if 2 * ring == n {
            all.push([1.0 / 3.0; 3]);
            continue;
        }
        for t in parts(n - 2 * ring) {
            let (a, b) = (near + t * (far - near), far + t * (near - far));
            all.extend([[near, a, b], [b, near, a], [a, b, near]]);
        }
    }
    all
}

/// The vertices of lines with equal spacing.
fn lines(Levels { outer, .. }: Levels) -> Vec<[f32; 3]> {
    let [lines, parts_of_line, ..] = outer.map(segments);
    let row = |v| (0..=parts_of_line).map(move |i| [i as f32 / parts_of_line as f32, v, 0.0]);
    parts(lines).flat_map(row).collect()
}

/// The vertices of a patch with equal spacing.
type Vertices = fn(Levels) -> Vec<[f32; 3]>;

/// The domains, with their vertices.
const DOMAINS: [(&str, Vertices); 3] = [("triangles", triangle), ("quads", quad), ("isolines", lines)];

/// Levels of all kinds: equal and different ones, ones that are rounded, and ones beyond the limits.
const KINDS: [Levels; 12] = [
    levels([1.0; 4], [1.0; 2]),
    levels([2.0; 4], [2.0; 2]),
    levels([3.0; 4], [3.0; 2]),
    levels([1.0, 2.0, 3.0, 4.0], [5.0, 6.0]),
    levels([7.5, 1.0, 2.01, 0.5], [1.0, 1.0]),
    levels([1.0, 1.0, 1.0, 1.0], [4.0, 1.0]),
    levels([1.0, 1.0, 1.0, 1.0], [7.0, 3.0]),
    levels([16.0; 4], [16.0, 8.0]),
    levels([0.1; 4], [-3.0, 0.0]),
    levels([5.0, 6.0, 7.0, 8.0], [-1.0, 9.0]),
    levels([64.0, 63.5, 100.0, 1e30], [2.0, 3.0]),
    levels([2.0, 64.0, 1.0, 3.0], [64.0, 1e9]),
];

/// The coordinates of the vertices of each domain with equal spacing.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn vertices_have_equal_spacing(case: &Case) {
    let gpu = with_tessellation(case);
    for (domain, model) in DOMAINS {
        let found = coordinates(gpu, &format!("{domain}, equal_spacing"), &KINDS);
        for (levels, found) in KINDS.into_iter().zip(&found) {
            assert_same(found, &model(levels), &format!("{domain}, {levels:?}"));
        }
    }
}

/// Corners and edges have coordinates of exactly 0 and 1, and those of triangles add to 1.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn edges_are_exact(case: &Case) {
    let gpu = with_tessellation(case);
    for spacing in ["equal", "fractional_even", "fractional_odd"] {
        let all: Vec<_> = (0..20).map(|n| levels([n as f32 * 0.7 + 1.1; 4], [n as f32 * 0.9 + 1.2; 2])).collect();
        let places = coordinates(gpu, &format!("triangles, {spacing}_spacing"), &all);
        for place in places.iter().flatten().map(|place| values(*place)) {
            let sum: f32 = place.iter().sum();
            assert!((sum - 1.0).abs() < 1e-5, "{place:?}");
        }
        for (found, levels) in places.iter().zip(&all) {
            for edge in 0..3 {
                let on_edge = found.iter().filter(|place| place[edge] == 0);
                let count = count_of_segments(spacing, levels.outer[edge]);
                assert_eq!(on_edge.count(), count + 1, "{spacing}, {levels:?}");
            }
        }
        let places = coordinates(gpu, &format!("quads, {spacing}_spacing"), &all);
        for (found, levels) in places.iter().zip(&all) {
            for (axis, end) in [(0, 0.0f32), (1, 0.0), (0, 1.0), (1, 1.0)] {
                let on_edge = found.iter().filter(|place| place[axis] == end.to_bits());
                let count = count_of_segments(spacing, levels.outer[0]);
                assert_eq!(on_edge.count(), count + 1, "{spacing}, {levels:?}");
            }
        }
    }
}

/// The number of segments of an edge.
fn count_of_segments(spacing: &str, level: f32) -> usize {
    match spacing {
        "fractional_even" => 2 * (level.clamp(2.0, 64.0) / 2.0).ceil() as usize,
        "fractional_odd" => 2 * ((level.clamp(1.0, 63.0) - 1.0) / 2.0).ceil() as usize + 1,
        _ => segments(level),
    }
}

/// A sweep of levels: n - 2 segments are equal, and two others, at mirrored places, are shorter the further the level
/// is from n.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn fractional_segments_shrink(case: &Case) {
    let gpu = with_tessellation(case);
    let sweep: Vec<f32> = (0..160).map(|step| 0.9 + 0.061 * step as f32).collect();
    let all: Vec<_> = sweep.iter().map(|&level| levels([1.0, level, 0.0, 0.0], [0.0; 2])).collect();
    for spacing in ["equal", "fractional_even", "fractional_odd"] {
        let lines = coordinates(gpu, &format!("isolines, {spacing}_spacing"), &all);
        // The number of segments of the line before, and its ratio.
        let mut before = (0, 0.0);
        for (&level, line) in sweep.iter().zip(&lines) {
            let mut places: Vec<f32> = line.iter().map(|place| values(*place)[0]).collect();
            places.sort_by(f32::total_cmp);
            let what = format!("{spacing} {level}: {places:?}");
            let n = count_of_segments(spacing, level);
            assert_eq!(places.len(), n + 1, "{what}");
            assert_eq!((places[0], places[n]), (0.0, 1.0), "{what}");
            for (near, far) in places.iter().zip(places.iter().rev()) {
                assert!((near + far - 1.0).abs() <= TOLERANCE, "{what}");
            }
            let mut lengths: Vec<f32> = places.windows(2).map(|ends| ends[1] - ends[0]).collect();
            lengths.sort_by(f32::total_cmp);
            let (short, rest) = lengths.split_at(n.min(2));
            let [shortest, longest] = [short[0], *lengths.last().expect("a segment")];
            assert!(short[short.len() - 1] - shortest <= TOLERANCE, "{what}");
            if let (Some(first), Some(last)) = (rest.first(), rest.last()) {
                assert!(last - first <= TOLERANCE, "{what}");
            }
            let ratio = shortest / longest;
            let clamped = match spacing {
                "fractional_even" => level.max(2.0),
                _ => level.max(1.0),
            };
            if spacing == "equal" || n as f32 - clamped < 1e-3 {
                assert!(ratio > 0.999, "{what}");
            } else if before.0 == n && n > 2 {
                assert!(ratio > before.1, "{what}");
            }
            before = (n, ratio);
        }
    }
}

/// The triangles of each patch, as the geometry stage takes them.
fn triangles_of(gpu: &Gpu, layout: &str, origin: vk::TessellationDomainOrigin, all: &[Levels]) -> Vec<Vec<[Place; 3]>> {
    let evaluation = format!(
        "layout({layout}) in;
         layout(location = 0) out vec3 place;
         layout(location = 1) flat out uint number;
         void main() {{ place = gl_TessCoord; number = uint(gl_PrimitiveID); gl_Position = vec4(0.0); }}"
    );
    let geometry = format!(
        "layout(triangles) in;
         layout(line_strip, max_vertices = 2) out;
         layout(location = 0) in vec3 place[];
         layout(location = 1) flat in uint number[];
         {}
         void main() {{
             uvec3 bits[3];
             for (int i = 0; i < 3; i++) bits[i] = floatBitsToUint(place[i]);
             record(uint[10](number[0], bits[0].x, bits[0].y, bits[0].z, bits[1].x, bits[1].y, bits[1].z,
                 bits[2].x, bits[2].y, bits[2].z));
         }}",
        recorder(10)
    );
    let mut options = PipelineOptions { domain_origin: origin, fragment: Some(ONES), ..of(1, CONTROL, &evaluation) };
    options.between.push((Stage::Geometry, &geometry));
    let drawn = drawn(gpu, options, 1 << 19, all);
    let mut patches = vec![Vec::new(); all.len()];
    for [patch, corners @ ..] in drawn.records::<10>() {
        let corner = |i: usize| [corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]];
        patches[patch as usize].push([corner(0), corner(1), corner(2)]);
    }
    patches
}

/// Twice the signed area of a triangle in (u, v).
fn area(triangle: &[Place; 3]) -> f64 {
    let [a, b, c] = triangle.map(|place| values(place).map(f64::from));
    (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
}

/// The triangles of a patch cover its domain once: they have the requested winding, their areas add up, and each edge
/// inside belongs to two triangles and each edge of the border to one.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn triangles_fill_the_domain(case: &Case) {
    use vk::TessellationDomainOrigin as Origin;
    let gpu = with_tessellation(case);
    need("geometryShader", gpu.features().geometry_shader);
    let all = [
        levels([1.0; 4], [1.0; 2]),
        levels([3.0; 4], [3.0; 2]),
        levels([1.0, 4.0, 2.0, 5.0], [6.0, 3.0]),
        levels([9.0, 1.0, 12.0, 7.0], [2.0, 11.0]),
        levels([2.3, 5.7, 1.6, 3.4], [4.6, 7.2]),
        levels([20.0, 3.0, 31.0, 64.0], [13.0, 2.0]),
    ];
    let kinds = [
        ("equal_spacing, cw", Origin::UPPER_LEFT),
        ("equal_spacing, ccw", Origin::UPPER_LEFT),
        ("fractional_even_spacing, cw", Origin::LOWER_LEFT),
        ("fractional_odd_spacing, ccw", Origin::LOWER_LEFT),
    ];
    for (domain, whole) in [("triangles", 1.0), ("quads", 2.0)] {
        for (kind, origin) in kinds {
            let layout = format!("{domain}, {kind}");
            let patches = triangles_of(gpu, &layout, origin, &all);
            let is_positive = (origin == Origin::LOWER_LEFT) == kind.ends_with("ccw");
            let sign = if is_positive { 1.0 } else { -1.0 };
            for (levels, triangles) in all.iter().zip(&patches) {
                let what = format!("{layout} {origin:?} {levels:?}");
                let areas = triangles.iter().map(|triangle| sign * area(triangle));
                assert!(areas.clone().all(|area| area > 0.0), "{what}");
                let sum: f64 = areas.sum();
                assert!((sum - whole).abs() < 1e-5, "{what}: {sum}");
                assert_border(domain, triangles, &what);
            }
        }
    }
}

/// Checks that each edge inside belongs to two triangles, once in each direction, and each edge of the border to one.
fn assert_border(domain: &str, triangles: &[[Place; 3]], what: &str) {
    let mut edges = BTreeMap::<[Place; 2], u32>::new();
    for &[a, b, c] in triangles {
        for edge in [[a, b], [b, c], [c, a]] {
            *edges.entry(edge).or_default() += 1;
        }
    }
    let is_on = |axis: usize, bits: u32, edge: &[Place; 2]| edge.iter().all(|it| it[axis] == bits);
    let one = 1.0f32.to_bits();
    for (edge, &count) in &edges {
        assert_eq!(count, 1, "{what}: {edge:?}");
        let is_border = match domain {
            "triangles" => (0..3).any(|axis| is_on(axis, 0, edge)),
            _ => (0..2).any(|axis| is_on(axis, 0, edge) || is_on(axis, one, edge)),
        };
        let has_other = edges.contains_key(&[edge[1], edge[0]]);
        assert!(has_other != is_border, "{what}: {edge:?}");
    }
}

/// In point mode each vertex is one point.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn points_are_vertices(case: &Case) {
    let gpu = with_tessellation(case);
    for (domain, model) in DOMAINS {
        let evaluation = evaluation(&format!("{domain}, equal_spacing, point_mode"));
        let buffer = Buffer::of(gpu, &KINDS);
        let program = Program {
            resources: vec![Resource::Storage(buffer.raw)],
            ..Program::new(of(1, CONTROL, &evaluation), 1 << 18)
        };
        let counted = vk::QueryPipelineStatisticFlags::CLIPPING_INVOCATIONS;
        let points = program.statistics(gpu, counted, |commands| {
            commands.draw(0..KINDS.len() as u32);
        });
        let expected: usize = KINDS.into_iter().map(|levels| model(levels).len()).sum();
        assert_eq!(points, [expected as u64], "{domain}");
    }
}

/// Statistics of patches: those that are discarded are counted as patches, and have no evaluation.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn statistics_count_patches(case: &Case) {
    use vk::QueryPipelineStatisticFlags as Flags;
    let gpu = with_tessellation(case);
    // A square of four vertices and two triangles, one of nine and eight, and one that is discarded.
    let all = [levels([1.0; 4], [1.0; 2]), levels([2.0; 4], [2.0; 2]), levels([2.0, 2.0, 0.0, 2.0], [2.0; 2])];
    let evaluation = evaluation("quads, equal_spacing");
    let buffer = Buffer::of(gpu, &all);
    let program = Program {
        resources: vec![Resource::Storage(buffer.raw)],
        ..Program::new(of(5, CONTROL, &evaluation), 1 << 10)
    };
    let counted = Flags::INPUT_ASSEMBLY_VERTICES
        | Flags::INPUT_ASSEMBLY_PRIMITIVES
        | Flags::CLIPPING_INVOCATIONS
        | Flags::TESSELLATION_CONTROL_SHADER_PATCHES
        | Flags::TESSELLATION_EVALUATION_SHADER_INVOCATIONS;
    let [vertices, primitives, clipped, patches, evaluations] = program.statistics(gpu, counted, |commands| {
        commands.draw_instances(0..15, 0..2);
    });
    assert_eq!([vertices, primitives, clipped], [30, 6, 20]);
    assert_eq!(patches, 6);
    // A shader may run more than once for a vertex.
    assert!((26..=60).contains(&evaluations), "{evaluations}");
}

/// A patch vanishes if a level of one of its edges is not positive, or is no number; other levels don't matter.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn levels_discard_patches(case: &Case) {
    let gpu = with_tessellation(case);
    let bad = [0.0, -0.0, -1.0, f32::NEG_INFINITY, f32::NAN];
    let mut all = vec![levels([2.0; 4], [2.0; 2])];
    for level in bad {
        for edge in 0..4 {
            let mut outer = [2.0; 4];
            outer[edge] = level;
            all.push(levels(outer, [2.0; 2]));
        }
        all.push(levels([2.0; 4], [level, 2.0]));
        all.push(levels([2.0; 4], [2.0, level]));
    }
    for (domain, edges) in [("triangles", 3), ("quads", 4), ("isolines", 2)] {
        let found = coordinates(gpu, &format!("{domain}, equal_spacing"), &all);
        for (levels, found) in all.iter().zip(&found) {
            let is_kept = levels.outer[..edges].iter().all(|&level| level > 0.0);
            assert_eq!(!found.is_empty(), is_kept, "{domain}: {levels:?}");
        }
    }
}

/// Patches of all sizes with other numbers of vertices after the control stage, which takes any of its vertices.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn patches_have_their_vertices(case: &Case) {
    const PATCHES: u32 = 40;
    let gpu = with_tessellation(case);
    for (taken, given) in [(1, 32), (3, 1), (4, 3), (16, 5), (32, 32), (32, 4), (5, 16)] {
        let control = format!(
            "layout(vertices = {given}) out;
             layout(location = 0) out int sums[];
             layout(location = 1) patch out ivec3 counts;
             void main() {{
                 int sum = 0;
                 // A different vertex in each step and invocation.
                 for (int i = 0; i <= gl_InvocationID; i++) {{
                     vec4 it = gl_in[(i * 7 + gl_InvocationID + gl_PrimitiveID) % gl_PatchVerticesIn].gl_Position;
                     sum += int(it.x) * (i + 1) + int(it.y);
                 }}
                 sums[gl_InvocationID] = sum;
                 gl_out[gl_InvocationID].gl_Position = vec4(gl_InvocationID, gl_PrimitiveID, 0.0, 1.0);
                 counts = ivec3(gl_PatchVerticesIn, gl_in[gl_PatchVerticesIn - 1].gl_Position.y, gl_PrimitiveID);
                 gl_TessLevelOuter[0] = 1.0;
                 gl_TessLevelOuter[1] = 1.0;
             }}"
        );
        let evaluation = format!(
            "layout(isolines, point_mode) in;
             layout(location = 0) in int sums[];
             layout(location = 1) patch in ivec3 counts;
             layout(location = 0) out vec4 value;
             {WORDS}
             void main() {{
                 uint first = 40u * uint(gl_PrimitiveID + {PATCHES} * counts.y);
                 words[first] = uint(counts.x);
                 words[first + 1u] = uint(gl_PatchVerticesIn);
                 words[first + 2u] = uint(counts.z - gl_PrimitiveID);
                 for (int i = 0; i < gl_PatchVerticesIn; i++) {{
                     bool is_right = gl_in[i].gl_Position == vec4(i, gl_PrimitiveID, 0.0, 1.0);
                     words[first + 3u + i] = is_right ? uint(sums[i]) : 0xffffffffu;
                 }}
                 gl_Position = vec4(0.0);
                 gl_PointSize = 1.0;
                 value = vec4(0.0);
             }}"
        );
        let program = Program::new(of(taken, &control, &evaluation), 2 * 40 * PATCHES);
        let drawn = program.draw(gpu, |commands| {
            // The last vertices make no patch.
            commands.draw_instances(0..taken * PATCHES + taken - 1, 0..2);
        });
        for (number, record) in drawn.words.chunks_exact(40).enumerate() {
            let (patch, instance) = (number as u32 % PATCHES, number as u32 / PATCHES);
            let what = format!("patch {patch} of instance {instance}, {taken} to {given}");
            assert_eq!(record[..3], [taken, given, 0], "{what}");
            for invocation in 0..given {
                let vertex = |i: u32| patch * taken + (i * 7 + invocation + patch) % taken;
                let sum: u32 = (0..=invocation).map(|i| vertex(i) * (i + 1) + instance).sum();
                let found = record[3 + invocation as usize];
                assert_eq!(found, sum, "{what}: vertex {invocation}");
            }
        }
    }
}

/// Invocations of the control stage read each other's outputs after barriers, and write values of the whole patch:
/// vectors, arrays, blocks and levels, which the evaluation stage reads.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn invocations_exchange_values(case: &Case) {
    const PATCHES: u32 = 50;
    let gpu = with_tessellation(case);
    let control = "
        layout(vertices = 6) out;
        layout(location = 0) out ivec2 steps[];
        layout(location = 1) patch out vec3 total;
        layout(location = 2) patch out float list[6];
        layout(location = 8) patch out Whole { mat2 turn; uint bits[2]; } whole;
        void main() {
            int me = gl_InvocationID, next = (gl_InvocationID + 1) % 6;
            int from = int(gl_in[0].gl_Position.x);
            steps[gl_InvocationID] = ivec2(10 * from + me, 0);
            barrier();
            steps[gl_InvocationID].y = steps[next].x * 2;
            barrier();
            int both = steps[next].y + steps[me].y;
            list[5 - me] = float(both);
            if (me == 0) {
                total = vec3(0.0);
                for (int i = 0; i < 6; i++) total += vec3(steps[i], 1);
                whole.turn = mat2(1.0, from, 3.0, 4.0);
            } else if (me == 5) {
                whole.bits[1] = 0x80000000u + uint(from);
            } else {
                if (me == 3) whole.bits[0] = 7u;
            }
            barrier();
            if (me < 4) gl_TessLevelOuter[me] = list[me] * 0.001 + 1.0;
            if (me < 2) gl_TessLevelInner[me] = total.y + float(me);
        }";
    let evaluation = format!(
        "layout(quads, equal_spacing) in;
         layout(location = 0) in ivec2 steps[];
         layout(location = 1) patch in vec3 total;
         layout(location = 2) patch in float list[6];
         layout(location = 8) patch in Whole {{ mat2 turn; uint bits[2]; }} whole;
         layout(location = 0) out vec4 value;
         {WORDS}
         void main() {{
             uint word = 24u * uint(gl_PrimitiveID);
             for (int i = 0; i < 3; i++) words[word++] = uint(total[i]);
             for (int i = 0; i < 6; i++) words[word++] = uint(list[i]);
             words[word++] = uint(whole.turn[0][1]);
             words[word++] = uint(whole.turn[1][0]);
             words[word++] = whole.bits[0];
             words[word++] = whole.bits[1];
             for (int i = 0; i < 4; i++) words[word++] = floatBitsToUint(gl_TessLevelOuter[i]);
             for (int i = 0; i < 2; i++) words[word++] = floatBitsToUint(gl_TessLevelInner[i]);
             words[word++] = uint(steps[5].x);
             gl_Position = vec4(0.0);
             value = vec4(0.0);
         }}"
    );
    let program = Program::new(of(2, control, &evaluation), 24 * PATCHES);
    let drawn = program.draw(gpu, |commands| commands.draw(0..2 * PATCHES));
    for (patch, record) in drawn.words.chunks_exact(24).enumerate() {
        let from = 2 * patch as u32;
        let first = |me: u32| 10 * from + me;
        let second = |me: u32| 2 * first((me + 1) % 6);
        let sum = |value: &dyn Fn(u32) -> u32| (0..6).map(value).sum::<u32>();
        let list = [0, 1, 2, 3, 4, 5].map(|i| {
            let me = 5 - i;
            second(me) + second((me + 1) % 6)
        });
        assert_eq!(record[..3], [sum(&first), sum(&second), 6], "patch {patch}");
        assert_eq!(record[3..9], list, "patch {patch}");
        let block = [from, 3, 7, 0x8000_0000 + from];
        assert_eq!(record[9..13], block, "patch {patch}");
        for (index, &bits) in record[13..17].iter().enumerate() {
            let (found, expected) = (f32::from_bits(bits), list[index] as f32 * 0.001 + 1.0);
            assert!((found - expected).abs() < 1e-5, "patch {patch}, outer {index}");
        }
        let inner = [0.0, 1.0].map(|more| (sum(&second) as f32 + more).to_bits());
        assert_eq!(record[17..19], inner, "patch {patch}");
        assert_eq!(record[19], first(5), "patch {patch}");
    }
}

/// Both stages read a uniform buffer, a texture and push constants, and add to a storage buffer.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn the_stages_use_resources(case: &Case) {
    let gpu = with_tessellation(case);
    let texels: Vec<f32> = (0..64).map(|texel| 100.0 + texel as f32).collect();
    let image = ImageOptions::new(vk::Format::R32_SFLOAT, [8, 8], vk::ImageUsageFlags::SAMPLED);
    let image = Image::textured(gpu, &image, &[texels]);
    let sampler = Sampler::new(gpu, &vk::SamplerCreateInfo::default());
    let uniform = Buffer::of(gpu, &[3u32, 50, 700, 9000]);
    let resources = format!(
        "{WORDS}
         layout(binding = 1) uniform Scales {{ uvec4 scales; }};
         layout(binding = 2) uniform sampler2D image;
         layout(push_constant) uniform Push {{ uint pushed; }};
         uint found(int n) {{
             return uint(texelFetch(image, ivec2(n % 8, n / 8 % 8), 0).r) + scales[n % 4] + pushed;
         }}"
    );
    let control = format!(
        "layout(vertices = 2) out;
         {resources}
         void main() {{
             atomicAdd(words[0], found(gl_PrimitiveID + gl_InvocationID));
             gl_TessLevelOuter[0] = 1.0;
             gl_TessLevelOuter[1] = 1.0;
         }}"
    );
    let evaluation = format!(
        "layout(isolines) in;
         {resources}
         layout(location = 0) out vec4 value;
         void main() {{
             words[1 + gl_PrimitiveID] = found(gl_PrimitiveID);
             gl_Position = vec4(0.0);
             value = vec4(0.0);
         }}"
    );
    let program = Program {
        resources: vec![Resource::Uniform(uniform.raw), Resource::Texture(image.view, sampler.raw)],
        ..Program::new(of(1, &control, &evaluation), 1 + 40)
    };
    let drawn = program.draw(gpu, |commands| {
        commands.push(0, &[20_000u32]);
        commands.draw(0..40);
    });
    let found = |n: usize| 100 + n as u32 + [3, 50, 700, 9000][n % 4] + 20_000;
    let sum = (0..40).map(|n| found(n) + found(n + 1)).sum::<u32>();
    assert_eq!(drawn.words[0], sum);
    for n in 0..40 {
        assert_eq!(drawn.words[1 + n], found(n), "patch {n}");
    }
}

/// Draws that set the number of vertices of a patch.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn sizes_of_patches_are_dynamic(case: &Case) {
    let gpu = with_dynamic_patches(case);
    let control = "
        layout(vertices = 1) out;
        void main() {
            gl_out[gl_InvocationID].gl_Position = vec4(gl_PatchVerticesIn, gl_in[gl_PatchVerticesIn - 1].gl_Position.xy, 1.0);
            gl_TessLevelOuter[0] = 1.0;
            gl_TessLevelOuter[1] = 1.0;
        }";
    let evaluation = format!(
        "layout(isolines, point_mode) in;
         layout(location = 0) out vec4 value;
         {WORDS}
         void main() {{
             vec4 it = gl_in[0].gl_Position;
             uint word = 2u * uint(gl_PrimitiveID + 12 * int(it.z));
             words[word] = uint(it.x);
             words[word + 1u] = uint(it.y);
             gl_Position = vec4(0.0);
             gl_PointSize = 1.0;
             value = vec4(0.0);
         }}"
    );
    let options =
        PipelineOptions { dynamic: vec![vk::DynamicState::PATCH_CONTROL_POINTS_EXT], ..of(7, control, &evaluation) };
    let functions = ash::ext::extended_dynamic_state2::Device::new(gpu.instance(), gpu.device());
    let sizes = [1, 2, 5, 12, 3];
    let drawn = Program::new(options, 2 * 12 * 5).draw(&gpu, |commands| {
        for (instance, size) in (0..).zip(sizes) {
            // SAFETY: see the crate.
            unsafe { functions.cmd_set_patch_control_points(commands.raw, size) };
            commands.draw_instances(0..12, instance..instance + 1);
        }
    });
    for (size, records) in sizes.into_iter().zip(drawn.words.chunks_exact(24)) {
        for (patch, record) in (0..).zip(records.chunks_exact(2)) {
            let expected = if patch < 12 / size { [size, size * (patch + 1) - 1] } else { [0; 2] };
            assert_eq!(record, expected, "patch {patch} of {size} vertices");
        }
    }
}

/// A device of the test's variant on which the number of vertices of a patch is dynamic.
fn with_dynamic_patches(case: &Case) -> Gpu {
    let gpu = with_tessellation(case);
    let mut found = vk::PhysicalDeviceExtendedDynamicState2FeaturesEXT::default();
    let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut found);
    // SAFETY: the physical device is the instance's.
    unsafe {
        gpu.instance().get_physical_device_features2(gpu.physical_device(), &mut all);
    }
    let has = found.extended_dynamic_state2_patch_control_points;
    need("extendedDynamicState2PatchControlPoints", has);
    let driver = match case.variant() {
        "lavapipe" => Driver::Lavapipe,
        _ => Driver::Embedded,
    };
    let opening = Opening { extensions: &[ash::ext::extended_dynamic_state2::NAME], ..Opening::of(driver) };
    let mut features = vk::PhysicalDeviceExtendedDynamicState2FeaturesEXT::default()
        .extended_dynamic_state2(true)
        .extended_dynamic_state2_patch_control_points(true);
    Gpu::open_with(&opening, &mut features).expect("a device")
}

/// Each view has its own patches, and both stages know its number.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn views_have_their_own_patches(case: &Case) {
    const MASK: u32 = 0b10_0101;
    let gpu = with_tessellation(case);
    let has = multiview(gpu).multiview_tessellation_shader;
    need("multiviewTessellationShader", has);
    let control = "
        #extension GL_EXT_multiview : require
        layout(vertices = 1) out;
        layout(location = 0) patch out int view;
        void main() {
            view = gl_ViewIndex;
            for (int i = 0; i < 4; i++) gl_TessLevelOuter[i] = 3.0;
            for (int i = 0; i < 2; i++) gl_TessLevelInner[i] = 2.0;
        }";
    // A rectangle of 16 by 8 pixels, in columns of its view.
    let evaluation = "
        #extension GL_EXT_multiview : require
        layout(quads) in;
        layout(location = 0) patch in int view;
        layout(location = 0) flat out vec4 value;
        void main() {
            vec2 place = vec2(16 * gl_ViewIndex, 8 * gl_PrimitiveID) + gl_TessCoord.xy * vec2(16, 8);
            gl_Position = vec4(place / 64.0 - 1.0, 0.0, 1.0);
            value = vec4(10 * view + gl_PrimitiveID + 1);
        }";
    let options = PipelineOptions { view_mask: MASK, ..of(1, control, evaluation) };
    let program = Program { layers: 6, ..Program::new(options, 1) };
    let drawn = program.draw(gpu, |commands| commands.draw(0..3));
    for view in (0..6).filter(|view| MASK & (1 << view) != 0) {
        drawn.assert_layer(view, |x, y| if x / 16 == view && y < 24 { (10 * view + y / 8 + 1) as f32 } else { 0.0 });
    }
}

/// Pixels of whole patches: rectangles side by side, each with its number, whatever triangles they are made of.
#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn patches_cover_their_pixels(case: &Case) {
    let gpu = with_tessellation(case);
    let control = "
        layout(vertices = 4) out;
        void main() {
            gl_out[gl_InvocationID].gl_Position = gl_in[gl_InvocationID].gl_Position;
            gl_TessLevelOuter[gl_InvocationID] = 1.0 + float((gl_PrimitiveID * 5 + gl_InvocationID) % 23) * 0.7;
            gl_TessLevelInner[gl_InvocationID & 1] = 1.0 + float(gl_PrimitiveID % 19) * 0.6;
        }";
    for spacing in ["equal", "fractional_even", "fractional_odd"] {
        let evaluation = format!(
            "layout(quads, {spacing}_spacing) in;
             layout(location = 0) flat out vec4 value;
             void main() {{
                 // Vertices are 8 pixels apart in each row.
                 int n = gl_PrimitiveID;
                 vec2 place = 8.0 * (vec2(n % 16, n / 16) + gl_TessCoord.xy);
                 gl_Position = vec4(place / 64.0 - 1.0, 0.0, 1.0);
                 value = vec4(n + 1);
             }}"
        );
        let one = vk::BlendFactor::ONE;
        let options = PipelineOptions {
            blend: vec![gaurast_testkit::blend(one, one, vk::BlendOp::ADD)],
            ..of(4, control, &evaluation)
        };
        let drawn = Program::new(options, 1).draw(gpu, |commands| commands.draw(0..4 * 200));
        drawn.assert_all(|x, y| {
            let number = 16 * (y / 8) + x / 8;
            if number < 200 { (number + 1) as f32 } else { 0.0 }
        });
    }
}
