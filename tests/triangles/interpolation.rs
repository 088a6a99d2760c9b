//! Values between vertices, held against exact ones: what lavapipe does not do exactly enough to be
//! the measure.

use ash::vk;
use gaurast_tests::triangles::{
    Buffer, Gpu, Pass, Pipeline, PipelineOptions, Target, TargetOptions, Vertex, fetch_sample,
    shader,
};

use crate::devices::own;

/// Corners at whole pixels of 128, so that no rounding moves them, with strong perspective.
const PIXELS: [[f64; 2]; 3] = [[4.0, 9.0], [124.0, 17.0], [33.0, 120.0]];
const W: [f64; 3] = [1.0, 4.0, 0.5];
const VALUES: [f64; 3] = [0.0, 1.0, 0.25];

/// The value at a point in pixels, in binary64, and whether the point is inside by `margin` of a
/// barycentric coordinate.
fn exact(x: f64, y: f64, margin: f64) -> (f64, bool) {
    let area = |a: [f64; 2], b: [f64; 2]| (a[0] - x) * (b[1] - y) - (a[1] - y) * (b[0] - x);
    let [a, b, c] = PIXELS;
    let areas = [area(b, c), area(c, a), area(a, b)];
    let sum: f64 = areas.iter().sum();
    let shares = areas.map(|area| area / sum);
    let over_w = |values: [f64; 3]| -> f64 {
        (0..3)
            .map(|index| shares[index] * values[index] / W[index])
            .sum()
    };
    let value = over_w(VALUES) / over_w([1.0; 3]);
    (value, shares.iter().all(|&share| share > margin))
}

fn vertices() -> Vec<Vertex> {
    let corner = |index: usize| {
        let [x, y] = PIXELS[index].map(|pixel| (pixel / 64.0 - 1.0) * W[index]);
        Vertex {
            position: [x, y, 0.5 * W[index], W[index]].map(|c| c as f32),
            color: [VALUES[index] as f32; 4],
        }
    };
    (0..3).map(corner).collect()
}

/// The greatest error of any pixel inside, for one sample at a place in the pixel.
fn greatest_error(values: &[f32], [dx, dy]: [f64; 2]) -> f64 {
    let mut greatest = 0.0f64;
    let mut inside = 0;
    for (index, &value) in (0u32..).zip(values) {
        let (x, y) = (f64::from(index % 128) + dx, f64::from(index / 128) + dy);
        if let (exact, true) = exact(x, y, 0.01) {
            greatest = greatest.max((f64::from(value) - exact).abs());
            inside += 1;
        }
    }
    assert!(inside > 3000, "only {inside} pixels are inside");
    greatest
}

fn draw(gpu: &Gpu, samples: u32, qualifier: &str) -> Vec<Vec<f32>> {
    let options = TargetOptions {
        samples,
        resolve: false,
        ..TargetOptions::of(vk::Format::R32_SFLOAT)
    };
    let target = Target::new(gpu, &options);
    let fragment = format!(
        "layout(location = 0) {qualifier} in vec4 v_color;
         layout(location = 0) out vec4 color;
         void main() {{ color = v_color; }}"
    );
    let options = PipelineOptions {
        fragment: Some(&fragment),
        ..PipelineOptions::default()
    };
    let pipeline = Pipeline::new(gpu, &target, &options);
    let buffer = Buffer::of(gpu, &vertices());
    gpu.run(|commands| {
        commands.pass(&target, &Pass::zeros(), || {
            commands.bind(&pipeline);
            commands.vertices(&buffer);
            commands.draw(0..3);
        });
    });
    let image = &target.colors[0];
    if samples == 1 {
        let bytes = image.read(vk::ImageAspectFlags::COLOR, 4);
        return vec![bytemuck::pod_collect_to_vec(&bytes)];
    }
    (0..samples)
        .map(|sample| fetch_sample(gpu, image, sample).texels())
        .collect()
}

#[test]
fn perspective_is_exact_at_pixel_centres() {
    if !shader::can_compile() {
        eprintln!("skipped: there is no glslangValidator here");
        return;
    }
    let error = greatest_error(&draw(own(), 1, "")[0], [0.5; 2]);
    assert!(error <= 2e-6, "{error:e}");
}

#[test]
fn perspective_is_exact_at_samples() {
    if !shader::can_compile() {
        eprintln!("skipped: there is no glslangValidator here");
        return;
    }
    let places = [
        [0.375, 0.125],
        [0.875, 0.375],
        [0.125, 0.625],
        [0.625, 0.875],
    ];
    for (values, place) in draw(own(), 4, "sample").iter().zip(places) {
        let error = greatest_error(values, place);
        assert!(error <= 2e-6, "{place:?}: {error:e}");
    }
}
