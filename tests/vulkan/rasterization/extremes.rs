//! Triangles in extreme positions, compared with exact values: horizons, corners far outside, depths one step apart,
//! thousands of layers in one plane, textures at the edges of their address modes.

use ash::vk;
use gaurast_testkit::devices::own;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::shapes;
use gaurast_testkit::{
    Bindings, Buffer, Gpu, Image, ImageOptions, Pass, Pipeline, PipelineOptions, Resource, Sampler, Target,
    TargetOptions, Vertex, blend, depth_test,
};

/// The side of the square target in pixels.
const SIZE: usize = 128;
/// The format of fragment shaders that write one number.
const FORMAT: vk::Format = vk::Format::R32_SFLOAT;

/// Draws vertices in order over zeros; returns the first component of each pixel.
fn draw(gpu: &Gpu, target: &TargetOptions, options: &PipelineOptions, vertices: &[Vertex]) -> Vec<f32> {
    let target = Target::new(gpu, target);
    let pipeline = Pipeline::new(gpu, &target, options);
    let buffer = Buffer::of(gpu, vertices);
    gpu.run(|commands| {
        commands.pass(&target, &Pass::zeros(), || {
            commands.bind(&pipeline);
            if let Some(bindings) = options.bindings {
                commands.bind_set(bindings, &[]);
            }
            commands.vertices(&buffer);
            commands.draw(0..vertices.len() as u32);
        });
    });
    bytemuck::pod_collect_to_vec(&target.colors[0].read(vk::ImageAspectFlags::COLOR, 4))
}

fn vertex(position: [f32; 4], value: f32) -> Vertex {
    Vertex { position, color: [value; 4] }
}

/// Two triangles of four corners, row by row.
fn quad([a, b, c, d]: [Vertex; 4]) -> [Vertex; 6] {
    [a, b, c, c, b, d]
}

/// A pipeline that writes the first value of a triangle at all of its pixels.
fn flat() -> PipelineOptions<'static> {
    PipelineOptions {
        vertex: "layout(location = 0) in vec4 position;
                 layout(location = 1) in vec4 color;
                 layout(location = 0) flat out float value;
                 void main() { gl_Position = position; value = color.x; }",
        fragment: Some(
            "layout(location = 0) flat in float value;
             layout(location = 0) out vec4 color;
             void main() { color = vec4(value); }",
        ),
        ..PipelineOptions::default()
    }
}

/// A pipeline that adds the values of a pixel's triangles.
fn additive() -> PipelineOptions<'static> {
    PipelineOptions { blend: vec![blend(vk::BlendFactor::ONE, vk::BlendFactor::ONE, vk::BlendOp::ADD)], ..flat() }
}

/// Draws a ground plane that begins in front of the eye's plane, on it or behind it, and extends far away. Its distance
/// is exact up to two errors: corners are rounded to a 256th of a pixel, and the distance to binary32.
#[gaurast_runner::test(needs = [GLSLANG])]
fn grounds_reach_from_the_eye_to_the_horizon() {
    let gpu = own();
    for (near, far) in [(0.5f32, 1e6f32), (1e-6, 1e6), (1e-30, 1e6), (0.0, 1e6), (-5.0, 1e6), (-1e6, 1e6)] {
        let wide = 2.0 * far;
        let corner = |x: f32, w: f32| vertex([x, 1.0, 0.5 * w, w], w);
        let ground = quad([corner(-wide, near), corner(wide, near), corner(-wide, far), corner(wide, far)]);
        let target = TargetOptions::of(FORMAT);
        let image = draw(gpu, &target, &PipelineOptions::default(), &ground);
        for (row, values) in image.chunks(SIZE).enumerate() {
            let below = (row as f64 + 0.5) / 64.0 - 1.0;
            let distance = 1.0 / below;
            if below < 0.0 || distance > 0.9 * f64::from(far) {
                let is_empty = values.iter().all(|value| *value == 0.0);
                assert!(is_empty || below > 0.0, "row {row}, {near}");
                continue;
            }
            let tolerance = distance * distance / 64.0 / 256.0 + 1e-6 * distance;
            for value in values {
                let error = (f64::from(*value) - distance).abs();
                assert!(error <= tolerance, "row {row}, {near}: {value} is not {distance}");
            }
        }
    }
}

/// Draws two halves of a square whose corners are increasingly far outside, beyond every guard band. Together they
/// cover each pixel once, on the correct side of their common edge.
#[gaurast_runner::test(needs = [GLSLANG])]
fn corners_far_outside_move_no_edge() {
    let gpu = own();
    for far in [1.0, 1.5, 63.0, 256.0, 511.9, 1e4, 3e5, 1e9, 1e12, 1e19, 1e20, 1e30, 1e38, 3.4e38f32] {
        let corner = |x: f32, y: f32, value| vertex([x, y, 0.5, 1.0], value);
        let halves = |value: [f32; 2]| {
            let upper = [[-far, -far], [far, far], [far, -far]];
            let lower = [[-far, -far], [far, far], [-far, far]];
            let mut all = upper.map(|[x, y]| corner(x, y, value[0])).to_vec();
            all.extend(lower.map(|[x, y]| corner(x, y, value[1])));
            all
        };
        let target = TargetOptions::of(FORMAT);
        let image = draw(gpu, &target, &additive(), &halves([1.0, 4.0]));
        for (index, value) in image.iter().enumerate() {
            let (x, y) = (index % SIZE, index / SIZE);
            let expected: &[f32] = match x.cmp(&y) {
                std::cmp::Ordering::Greater => &[1.0],
                std::cmp::Ordering::Less => &[4.0],
                std::cmp::Ordering::Equal => &[1.0, 4.0],
            };
            assert!(expected.contains(value), "({x}, {y}) of {far:e}: {value}");
        }
    }
}

/// Draws triangles whose sides are increasingly far outside the picture, none of them parallel to an axis. Each covers
/// the whole picture, and its varying has the exact value in the middle, where the barycentric coordinates are known.
#[gaurast_runner::test(needs = [GLSLANG])]
fn sides_far_outside_leave_no_hole() {
    let gpu = own();
    for far in [4.0, 1e3, 1e9, 1e19, 1e20, 1e30, 1e38, 3.4e38f32] {
        let corners = [[-1.0, -1.0], [1.0, -0.9], [0.1, 1.0f32]];
        let corner = |number: usize| {
            let [x, y] = corners[number].map(|coordinate| coordinate * far);
            vertex([x, y, 0.5, 1.0], [1.0, 2.0, 4.0][number])
        };
        // The barycentric coordinates of the middle, from the areas of the triangles between it and each side.
        let area = |a: usize, b: usize| {
            let [[ax, ay], [bx, by]] = [corners[a], corners[b]].map(|it| it.map(f64::from));
            ax * by - ay * bx
        };
        let [a, b, c] = [area(1, 2), area(2, 0), area(0, 1)];
        let expected = (a + 2.0 * b + 4.0 * c) / (a + b + c);
        let whole = [0, 1, 2].map(corner);
        let target = TargetOptions::of(FORMAT);
        let image = draw(gpu, &target, &PipelineOptions::default(), &whole);
        let slope = 8.0 / f64::from(far);
        for value in image {
            let error = (f64::from(value) - expected).abs();
            assert!(error <= slope + 1e-5, "{far:e}: {value} is not {expected}");
        }
    }
}

/// Of two planes whose depths are neighbours in the attachment's format, the nearer one is visible in either order.
#[gaurast_runner::test(needs = [GLSLANG])]
fn depths_a_step_apart_are_told_apart() {
    let gpu = own();
    let of_bits = |bits: u32, code: u32| (f64::from(code) / f64::from((1u32 << bits) - 1)) as f32;
    // Below one half, binary32 has enough numbers between two codes of 24 bits.
    let mut cases = Vec::new();
    for code in [0u32, 1, 77, 1 << 20, (1 << 23) - 3] {
        let depths = [of_bits(24, code), of_bits(24, code + 1)];
        cases.push((vk::Format::D24_UNORM_S8_UINT, depths));
        cases.push((vk::Format::X8_D24_UNORM_PACK32, depths));
    }
    for code in [0u32, 1, 30_000, 65_533] {
        cases.push((vk::Format::D16_UNORM, [of_bits(16, code), of_bits(16, code + 1)]));
    }
    for depth in [1e-30f32, 1e-6, 0.1, 0.5, 0.999_999_9] {
        cases.push((vk::Format::D32_SFLOAT, [depth, depth.next_up()]));
    }
    for (format, [near, far]) in cases {
        let needed = vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT;
        assert!(gpu.format_features(format).contains(needed), "{format:?}");
        let target = TargetOptions { depth: Some(format), ..TargetOptions::of(FORMAT) };
        let pipeline = PipelineOptions { depth_stencil: depth_test(vk::CompareOp::LESS), ..flat() };
        for order in [[(near, 1.0), (far, 2.0)], [(far, 2.0), (near, 1.0)]] {
            let planes = order.map(|(z, value)| shapes::whole(z, [value; 4]));
            let image = draw(gpu, &target, &pipeline, &planes.concat());
            let wrong = image.iter().filter(|value| **value != 1.0).count();
            assert_eq!(wrong, 0, "{format:?}: {near:e} and {far:e}");
        }
    }
}

/// Thousands of triangles in one slanted plane have the same depths to the bit. All of them pass, or the first, or the
/// last, depending on the comparison.
#[gaurast_runner::test(needs = [GLSLANG])]
fn layers_in_one_plane_have_one_depth() {
    let gpu = own();
    const LAYERS: usize = 5000;
    let corners = [[-0.9, -0.8, 0.1, 1.0], [3.6, -2.0, 1.9, 4.0], [-0.1, 0.45, 0.3, 0.5]];
    let layers: Vec<Vertex> =
        (1..=LAYERS).flat_map(|number| corners.map(|position| vertex(position, number as f32))).collect();
    for format in [vk::Format::D32_SFLOAT, vk::Format::D16_UNORM] {
        let target = TargetOptions { depth: Some(format), ..TargetOptions::of(FORMAT) };
        let all = (LAYERS * (LAYERS + 1) / 2) as f32;
        for (compare, blended, expected) in [
            (vk::CompareOp::LESS, false, 1.0),
            (vk::CompareOp::LESS_OR_EQUAL, false, LAYERS as f32),
            (vk::CompareOp::LESS, true, 1.0),
            (vk::CompareOp::LESS_OR_EQUAL, true, all),
        ] {
            let pipeline =
                PipelineOptions { depth_stencil: depth_test(compare), ..if blended { additive() } else { flat() } };
            let image = draw(gpu, &target, &pipeline, &layers);
            let covered: Vec<_> = image.iter().filter(|value| **value != 0.0).collect();
            assert!(covered.len() > 1500, "{} pixels", covered.len());
            assert!(
                covered.iter().all(|value| **value == expected),
                "{format:?}, {compare:?}: {:?} is not {expected}",
                covered.iter().find(|value| ***value != expected)
            );
        }
    }
}

/// The number of texels of the sampled row.
const TEXELS: i64 = 8;
/// The value beyond the edge with a border of opaque white.
const BORDER: f64 = 1.0;

/// The texel that an address mode selects for an index, as in Vulkan's tables; `None` is the border.
fn texel(mode: vk::SamplerAddressMode, index: i64) -> Option<i64> {
    use vk::SamplerAddressMode as Mode;
    let mirror = |n: i64| if n >= 0 { n } else { -1 - n };
    match mode {
        Mode::REPEAT => Some(index.rem_euclid(TEXELS)),
        Mode::MIRRORED_REPEAT => Some(TEXELS - 1 - mirror(index.rem_euclid(2 * TEXELS) - TEXELS)),
        Mode::CLAMP_TO_EDGE => Some(index.clamp(0, TEXELS - 1)),
        Mode::MIRROR_CLAMP_TO_EDGE => Some(mirror(index).clamp(0, TEXELS - 1)),
        _ => (0..TEXELS).contains(&index).then_some(index),
    }
}

/// Samples at, near and far beyond the edges of texels, in every mode, with both filters. Weights are exact in
/// sixteenths, so that nothing is rounded.
#[gaurast_runner::test(needs = [GLSLANG])]
fn textures_are_exact_at_the_edges_of_their_modes() {
    use vk::SamplerAddressMode as Mode;
    let gpu = own();
    let value = |index: i64| (index * 29 + 7) as f64 / 255.0;
    let texels: Vec<[u8; 4]> = (0..TEXELS).map(|i| [(i * 29 + 7) as u8; 4]).collect();
    let options = ImageOptions::new(vk::Format::R8G8B8A8_UNORM, [TEXELS as u32, 1], vk::ImageUsageFlags::empty());
    let image = Image::textured(gpu, &options, &[texels]);
    let modes =
        [Mode::REPEAT, Mode::MIRRORED_REPEAT, Mode::CLAMP_TO_EDGE, Mode::CLAMP_TO_BORDER, Mode::MIRROR_CLAMP_TO_EDGE];
    for mode in modes {
        for filter in [vk::Filter::NEAREST, vk::Filter::LINEAR] {
            let sampler = vk::SamplerCreateInfo::default()
                .mag_filter(filter)
                .min_filter(filter)
                .address_mode_u(mode)
                .address_mode_v(Mode::CLAMP_TO_EDGE)
                .border_color(vk::BorderColor::FLOAT_OPAQUE_WHITE);
            let sampler = Sampler::new(gpu, &sampler);
            let bindings = Bindings::new(gpu, &[Resource::Texture(image.view, sampler.raw)]);
            // The rows of the picture are increasingly far away, by whole periods; some coordinates are NaN or
            // infinite.
            let pipeline = PipelineOptions {
                fragment: Some(
                    "layout(set = 0, binding = 0) uniform sampler2D image;
                     layout(location = 0) out vec4 color;
                     const float far[8] = float[](0.0, 2.0, -2.0, 64.0, -4096.0, 1e20, -3e38, 1e30);
                     void main() {
                         int row = int(gl_FragCoord.y) / 16;
                         float u = (floor(gl_FragCoord.x) - 64.0) / 32.0 + far[row];
                         if (gl_FragCoord.y > 127.0) u = gl_FragCoord.x < 64.0 ? u * 1e38 : (u - u) / (u - u);
                         color = textureLod(image, vec2(u, 0.5), 0.0);
                     }",
                ),
                bindings: Some(&bindings),
                ..PipelineOptions::default()
            };
            let target = TargetOptions::of(FORMAT);
            let drawn = draw(gpu, &target, &pipeline, &shapes::whole(0.5, [0.0; 4]));
            for (index, &drawn) in drawn.iter().enumerate() {
                let (x, y) = (index % SIZE, index / SIZE);
                let drawn = f64::from(drawn);
                let far = [0.0, 2.0, -2.0, 64.0, -4096.0].get(y / 16);
                let Some(far) = far else {
                    // The value is that of some texel or of the border.
                    let range = value(0) - 1e-6..=BORDER + 1e-6;
                    assert!(range.contains(&drawn), "{mode:?} {filter:?} ({x}, {y}): {drawn}");
                    continue;
                };
                let place = ((x as f64 - 64.0) / 32.0 + far) * TEXELS as f64;
                let at = |index: i64| texel(mode, index).map_or(BORDER, value);
                let expected = if filter == vk::Filter::NEAREST {
                    at(place.floor() as i64)
                } else {
                    let first = (place - 0.5).floor();
                    let share = place - 0.5 - first;
                    (1.0 - share) * at(first as i64) + share * at(first as i64 + 1)
                };
                assert!((drawn - expected).abs() <= 1e-6, "{mode:?} {filter:?} ({x}, {y}): {drawn} is not {expected}");
            }
        }
    }
}
