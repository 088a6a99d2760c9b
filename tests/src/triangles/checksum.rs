//! Checksums of the triangles that cover each sample, independent of the order of drawing.
//!
//! Every fragment adds four numbers of 12 bits, made from its triangle's number, to a sample's sums. A sum of up to
//! 4,096 of them is exact in a 32-bit float. Therefore equal sums on two devices mean equal sets of triangles, except
//! with a probability of 2^-48.

use ash::vk;

use gaurast_testkit::{
    Buffer, Gpu, Pass, Pipeline, PipelineOptions, Target, TargetOptions, attribute, binding, blend, fetch_sample,
};

const VERTEX: &str = "
    layout(location = 0) in vec4 position;
    layout(location = 0) flat out uint number;
    void main() { gl_Position = position; number = gl_VertexIndex / 3; }";

/// The fragment shader, with the same arithmetic as [`numbers`].
const FRAGMENT: &str = "
    layout(location = 0) flat in uint number;
    layout(location = 0) out vec4 sums;
    uint mixed(uint x) {
        x ^= x >> 16; x *= 0x7feb352du; x ^= x >> 15; x *= 0x846ca68bu; x ^= x >> 16;
        return x;
    }
    void main() {
        uint a = mixed(number + 1u), b = mixed(a + 0x9e3779b9u);
        sums = vec4(a & 0xfffu, (a >> 12) & 0xfffu, b & 0xfffu, (b >> 12) & 0xfffu);
    }";

/// The numbers that a triangle adds to each sample that it covers.
pub fn numbers(triangle: u32) -> [f32; 4] {
    let mixed = |mut x: u32| {
        x ^= x >> 16;
        x = x.wrapping_mul(0x7feb_352d);
        x ^= x >> 15;
        x = x.wrapping_mul(0x846c_a68b);
        x ^ (x >> 16)
    };
    let a = mixed(triangle.wrapping_add(1));
    let b = mixed(a.wrapping_add(0x9e37_79b9));
    [a, a >> 12, b, b >> 12].map(|bits| (bits & 0xfff) as f32)
}

/// Triangles on a device, each three positions in clip coordinates.
pub struct Checksums {
    target: Target,
    pipeline: Pipeline,
    vertices: Buffer,
    gpu: Gpu,
}

impl Checksums {
    /// Prepares them for drawing to `size` pixels of `samples` samples.
    pub fn new(gpu: &Gpu, triangles: &[[[f32; 4]; 3]], size: [u32; 2], samples: u32) -> Self {
        let options =
            TargetOptions { size, samples, resolve: false, ..TargetOptions::of(vk::Format::R32G32B32A32_SFLOAT) };
        let target = Target::new(gpu, &options);
        let add = blend(vk::BlendFactor::ONE, vk::BlendFactor::ONE, vk::BlendOp::ADD);
        let options = PipelineOptions {
            vertex: VERTEX,
            fragment: Some(FRAGMENT),
            vertex_bindings: vec![binding(0, 16)],
            vertex_attributes: vec![attribute(0, vk::Format::R32G32B32A32_SFLOAT, 0)],
            blend: vec![add],
            ..PipelineOptions::default()
        };
        let pipeline = Pipeline::new(gpu, &target, &options);
        Self { target, pipeline, vertices: Buffer::of(gpu, triangles.as_flattened()), gpu: gpu.clone() }
    }

    /// The sums of all pixels, sample by sample, after drawing `triangles`.
    pub fn draw(&self, triangles: std::ops::Range<u32>) -> Vec<Vec<[f32; 4]>> {
        self.gpu.run(|commands| {
            commands.pass(&self.target, &Pass::zeros(), || {
                commands.bind(&self.pipeline);
                commands.vertices(&self.vertices);
                commands.draw(3 * triangles.start..3 * triangles.end);
            });
        });
        let image = &self.target.colors[0];
        if self.target.options.samples == 1 {
            let bytes = image.read(vk::ImageAspectFlags::COLOR, 16);
            return vec![bytemuck::pod_collect_to_vec(&bytes)];
        }
        (0..self.target.options.samples).map(|sample| fetch_sample(&self.gpu, image, sample).texels()).collect()
    }
}

/// The first of `count` triangles that covers different samples on two devices, found by bisection, with one such
/// sample and pixel.
pub fn first_difference(ours: &Checksums, theirs: &Checksums, count: u32) -> Option<(u32, usize, usize)> {
    let differs = |range: std::ops::Range<u32>| {
        let (ours, theirs) = (ours.draw(range.clone()), theirs.draw(range));
        let samples = ours.iter().zip(&theirs).enumerate();
        samples
            .filter_map(|(sample, (ours, theirs))| {
                let pixel = ours.iter().zip(theirs).position(|(a, b)| a != b)?;
                Some((sample, pixel))
            })
            .next()
    };
    let mut range = 0..count;
    let mut place = differs(range.clone())?;
    while range.len() > 1 {
        let middle = range.start + range.len() as u32 / 2;
        if let Some(found) = differs(range.start..middle) {
            (range, place) = (range.start..middle, found);
        } else if let Some(found) = differs(middle..range.end) {
            (range, place) = (middle..range.end, found);
        } else {
            // Each half agrees, so the difference needs both halves.
            break;
        }
    }
    Some((range.start, place.0, place.1))
}
