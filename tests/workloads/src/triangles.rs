//! Workloads for measurements: scenes that are prepared once and submitted many times.

use ash::vk;
use glam::Vec3;
use rand::Rng;

use crate::models::{Model, Ready};
use gaurast_testkit::drawn::Missing;
use gaurast_testkit::shader::Stage;
use gaurast_testkit::shapes;
use gaurast_testkit::{
    Bindings, Buffer, Gpu, Image, ImageOptions, Pass, Pipeline, PipelineOptions, Recorded, Resource, Sampler, Target,
    TargetOptions, Vertex, blend, depth_test,
};

/// The names of all workloads.
pub const NAMES: [&str; 11] = [
    "fill",
    "small triangles",
    "trilinear texture",
    "layers front to back",
    "layers back to front",
    "vertices",
    "blended layers",
    "four samples",
    "geometry shader",
    "tessellation",
    "african head 1080p",
];

const SIZE: [u32; 2] = [1920, 1080];

/// Commands with all objects that they use.
pub struct Workload {
    // Dropped before the objects that it uses.
    commands: Recorded,
    _target: Target,
    _things: Box<dyn std::any::Any>,
}

impl Workload {
    /// Prepares the workload named `name`.
    ///
    /// # Errors
    /// [`Missing`] if it needs a file that is missing.
    ///
    /// # Panics
    /// If the device cannot do it, or there is no such name.
    pub fn new(gpu: &Gpu, name: &str) -> Result<Self, Missing> {
        Self::smaller(gpu, name, 1)
    }

    /// Prepares it as [`Workload::new`] does, with width, height and numbers of triangles divided by `by`.
    ///
    /// # Errors
    /// As [`Workload::new`].
    ///
    /// # Panics
    /// As [`Workload::new`].
    pub fn smaller(gpu: &Gpu, name: &str, by: u32) -> Result<Self, Missing> {
        let size = SIZE.map(|side| side / by);
        let count = |triangles: usize| triangles / by as usize;
        let plain = TargetOptions { size, ..TargetOptions::default() };
        let deep = TargetOptions { size, ..TargetOptions::with_depth(vk::Format::D32_SFLOAT) };
        let tested = PipelineOptions { depth_stencil: depth_test(vk::CompareOp::LESS), ..PipelineOptions::default() };
        let (from, to) = (vk::BlendFactor::SRC_ALPHA, vk::BlendFactor::ONE_MINUS_SRC_ALPHA);
        let blended = PipelineOptions { blend: vec![blend(from, to, vk::BlendOp::ADD)], ..PipelineOptions::default() };
        let default = PipelineOptions::default();
        let workload = match name {
            "fill" => Self::of(gpu, &plain, &default, &one_big()),
            "small triangles" => Self::of(gpu, &deep, &tested, &small(count(1_000_000), size)),
            "trilinear texture" => Self::textured(gpu, &plain),
            "layers front to back" => Self::of(gpu, &deep, &tested, &layers(32, false)),
            "layers back to front" => Self::of(gpu, &deep, &tested, &layers(32, true)),
            "vertices" => Self::vertices(gpu, &plain, by),
            "blended layers" => Self::of(gpu, &plain, &blended, &layers(8, true)),
            "four samples" => {
                let target = TargetOptions { samples: 4, ..deep };
                Self::of(gpu, &target, &tested, &small(count(100_000), size))
            }
            "geometry shader" => {
                let options = PipelineOptions {
                    topology: vk::PrimitiveTopology::POINT_LIST,
                    between: vec![(Stage::Geometry, QUAD_OF_POINT)],
                    ..PipelineOptions::default()
                };
                let points = small(count(200_000), size);
                let points: Vec<_> = points.into_iter().step_by(3).collect();
                Self::of(gpu, &plain, &options, &points)
            }
            "tessellation" => {
                let options = PipelineOptions {
                    topology: vk::PrimitiveTopology::PATCH_LIST,
                    patch_vertices: 4,
                    between: vec![
                        (Stage::TessellationControl, LEVEL_OF_PATCH),
                        (Stage::TessellationEvaluation, POINT_OF_PATCH),
                    ],
                    ..tested
                };
                Self::of(gpu, &deep, &options, &patches(count(500)))
            }
            "african head 1080p" => Self::model(gpu, &deep)?,
            _ => panic!("no workload is called {name}"),
        };
        Ok(workload)
    }

    /// Submits the work and waits for its completion.
    pub fn run(&self) {
        self.commands.submit();
    }

    fn of(gpu: &Gpu, target: &TargetOptions, options: &PipelineOptions<'_>, vertices: &[Vertex]) -> Self {
        let target = Target::new(gpu, target);
        let pipeline = Pipeline::new(gpu, &target, options);
        let buffer = Buffer::of(gpu, vertices);
        let commands = gpu.record(|commands| {
            commands.pass(&target, &Pass::default(), || {
                commands.bind(&pipeline);
                commands.vertices(&buffer);
                commands.draw(0..vertices.len() as u32);
            });
        });
        Self { commands, _target: target, _things: Box::new((pipeline, buffer)) }
    }

    /// A million vertices, shared by twice as many triangles that are too small to be visible.
    fn vertices(gpu: &Gpu, target: &TargetOptions, by: u32) -> Self {
        let side = 1000 / by;
        let target = Target::new(gpu, target);
        let pipeline = Pipeline::new(gpu, &target, &PipelineOptions::default());
        let mut vertices = Vec::new();
        for row in 0..side {
            for column in 0..side {
                let [x, y] = [column, row].map(|i| i as f32 / side as f32 * 0.2 - 0.1);
                vertices.push(Vertex { position: [x, y, 0.5, 1.0], color: [x, y, 1.0, 1.0] });
            }
        }
        let mut indices = Vec::new();
        for row in 0..side - 1 {
            for column in 0..side - 1 {
                let at = row * side + column;
                indices.extend([at, at + 1, at + side, at + side, at + 1, at + side + 1]);
            }
        }
        let buffer = Buffer::of(gpu, &vertices);
        let index_buffer = Buffer::of(gpu, &indices);
        let commands = gpu.record(|commands| {
            commands.pass(&target, &Pass::default(), || {
                commands.bind(&pipeline);
                commands.vertices(&buffer);
                commands.indices(&index_buffer, 0, vk::IndexType::UINT32);
                commands.draw_indexed(0..indices.len() as u32, 0);
            });
        });
        Self { commands, _target: target, _things: Box::new((pipeline, buffer, index_buffer)) }
    }

    /// Textures the whole target, with all levels of the texture in use.
    fn textured(gpu: &Gpu, target: &TargetOptions) -> Self {
        const SIDE: u32 = 1024;
        let target = Target::new(gpu, target);
        let mut rng = shapes::rng(301);
        let levels: Vec<Vec<[u8; 4]>> =
            (0..=SIDE.ilog2()).map(|level| (0..(SIDE >> level).pow(2)).map(|_| rng.random()).collect()).collect();
        let format = vk::Format::R8G8B8A8_UNORM;
        let options = ImageOptions::new(format, [SIDE; 2], vk::ImageUsageFlags::empty());
        let image = Image::textured(gpu, &options, &levels);
        let sampler = vk::SamplerCreateInfo::default()
            .mag_filter(vk::Filter::LINEAR)
            .min_filter(vk::Filter::LINEAR)
            .mipmap_mode(vk::SamplerMipmapMode::LINEAR)
            .max_lod(vk::LOD_CLAMP_NONE);
        let sampler = Sampler::new(gpu, &sampler);
        let bindings = Bindings::new(gpu, &[Resource::Texture(image.view, sampler.raw)]);
        let options = PipelineOptions {
            fragment: Some(
                "layout(set = 0, binding = 0) uniform sampler2D image;
                 layout(location = 0) in vec4 v_color;
                 layout(location = 0) out vec4 color;
                 void main() { color = texture(image, v_color.xy); }",
            ),
            bindings: Some(&bindings),
            ..PipelineOptions::default()
        };
        let pipeline = Pipeline::new(gpu, &target, &options);
        // Perspective, so that the texture is magnified on one side and minified on the other.
        let corners = [[-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [-1.0, 1.0, 8.0], [1.0, 1.0, 8.0]];
        let corners =
            corners.map(|[x, y, w]| Vertex { position: [x * w, y * w, 0.5 * w, w], color: [x * w, w, 0.0, 0.0] });
        let buffer = Buffer::of(gpu, &[0, 1, 2, 2, 1, 3].map(|index: usize| corners[index]));
        let commands = gpu.record(|commands| {
            commands.pass(&target, &Pass::default(), || {
                commands.bind(&pipeline);
                commands.bind_set(&bindings, &[]);
                commands.vertices(&buffer);
                commands.draw(0..6);
            });
        });
        Self { commands, _target: target, _things: Box::new((pipeline, buffer, bindings, image, sampler)) }
    }

    fn model(gpu: &Gpu, target: &TargetOptions) -> Result<Self, Missing> {
        let target = Target::new(gpu, target);
        let model = Model::african_head()?;
        let ready = Ready::new(gpu, &target, &model, Vec3::new(0.5, 0.1, 1.0));
        let commands = gpu.record(|commands| {
            commands.pass(&target, &Pass::default(), || ready.draw(commands));
        });
        Ok(Self { commands, _target: target, _things: Box::new(ready) })
    }
}

/// A geometry shader that makes a quad of a few pixels of each point.
const QUAD_OF_POINT: &str = "
    layout(points) in;
    layout(triangle_strip, max_vertices = 4) out;
    layout(location = 0) in vec4 color[];
    layout(location = 0) out vec4 v_color;
    void main() {
        for (int corner = 0; corner < 4; corner++) {
            vec2 offset = vec2(corner & 1, corner >> 1) * 0.004;
            gl_Position = gl_in[0].gl_Position + vec4(offset, 0.0, 0.0);
            v_color = color[0];
            EmitVertex();
        }
    }";

/// A control shader that divides patches into 32 x 32 parts.
const LEVEL_OF_PATCH: &str = "
    layout(vertices = 4) out;
    layout(location = 0) in vec4 color[];
    layout(location = 0) out vec4 c_color[];
    void main() {
        gl_out[gl_InvocationID].gl_Position = gl_in[gl_InvocationID].gl_Position;
        c_color[gl_InvocationID] = color[gl_InvocationID];
        gl_TessLevelOuter[gl_InvocationID] = 32.0;
        gl_TessLevelInner[gl_InvocationID & 1] = 32.0;
    }";

/// An evaluation shader that bends a patch.
const POINT_OF_PATCH: &str = "
    layout(quads) in;
    layout(location = 0) in vec4 c_color[];
    layout(location = 0) out vec4 v_color;
    void main() {
        vec4 low = mix(gl_in[0].gl_Position, gl_in[1].gl_Position, gl_TessCoord.x);
        vec4 high = mix(gl_in[2].gl_Position, gl_in[3].gl_Position, gl_TessCoord.x);
        gl_Position = mix(low, high, gl_TessCoord.y);
        gl_Position.xy += 0.01 * sin(10.0 * gl_TessCoord.yx);
        v_color = vec4(gl_TessCoord.xy, c_color[0].b, 1.0);
    }";

/// Square patches, each with four vertices.
fn patches(count: usize) -> Vec<Vertex> {
    let mut rng = shapes::rng(303);
    let patch = |_| {
        let [x, y] = [0; 2].map(|_| rng.random_range(-1.0..0.8f32));
        let z = rng.random_range(0.0..1.0);
        [[0.0, 0.0], [0.2, 0.0], [0.0, 0.2], [0.2, 0.2]]
            .map(|[u, v]: [f32; 2]| Vertex { position: [x + u, y + v, z, 1.0], color: [u, v, z, 1.0] })
    };
    (0..count).flat_map(patch).collect()
}

/// One triangle that covers half of the target.
fn one_big() -> Vec<Vertex> {
    [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0]]
        .map(|[x, y]| Vertex { position: [x, y, 0.5, 1.0], color: [x, y, 0.5, 1.0] })
        .to_vec()
}

/// Triangles of about four pixels.
fn small(count: usize, size: [u32; 2]) -> Vec<Vertex> {
    let mut rng = shapes::rng(302);
    let pixel = size.map(|side| 2.0 / side as f32);
    let mut vertices = Vec::with_capacity(3 * count);
    for _ in 0..count {
        let center = [0; 2].map(|_| rng.random_range(-0.99..0.99f32));
        let z = rng.random_range(0.0..1.0);
        for corner in [[-1.4, -1.4], [1.4, -1.4], [-1.4, 1.4f32]] {
            let [x, y] = [0, 1].map(|axis| center[axis] + corner[axis] * pixel[axis]);
            vertices.push(Vertex { position: [x, y, z, 1.0], color: [x, y, z, 1.0] });
        }
    }
    vertices
}

/// A rectangle that covers the whole target, `count` times.
fn layers(count: u8, back_to_front: bool) -> Vec<Vertex> {
    (0..count)
        .flat_map(|layer| {
            let t = (f32::from(layer) + 0.5) / f32::from(count);
            let z = if back_to_front { 1.0 - t } else { t };
            shapes::whole(z, [t, 1.0 - t, 0.5, 0.4])
        })
        .collect()
}
