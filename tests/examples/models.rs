//! Draws the meshes of the test data, and a floor with corners behind the eye, by the first device that the Vulkan loader finds,
//! and writes PNG files to the working directory: a program for `gaurast compare-drivers`.

use ash::vk;
use gaurast_testkit::{Buffer, Gpu, Pass, Pipeline, PipelineOptions, Target, TargetOptions, attribute, binding};
use gaurast_tests::triangles::clipped::{FRAME, FRAMES, floor};
use gaurast_tests::triangles::edges::to_clip;
use gaurast_workloads::models::{Model, Ready};
use glam::Vec3;

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// The size of a mesh's picture in pixels.
const SIZE: [u32; 2] = [800, 600];

const VERTEX: &str = "
    layout(location = 0) in vec4 position;
    layout(location = 1) in vec2 place;
    layout(location = 0) out vec2 v_place;
    void main() { gl_Position = position; v_place = place; }";

const FRAGMENT: &str = "
    layout(location = 0) in vec2 place;
    layout(location = 0) out vec4 color;
    void main() {
        vec2 cell = floor(place * 20.0);
        float bright = mod(cell.x + cell.y, 2.0);
        color = vec4(mix(vec2(0.2), place, 0.3 + 0.6 * bright), 0.8 - 0.4 * bright, 1.0);
    }";

fn target(gpu: &Gpu, size: [u32; 2]) -> Target {
    let options = TargetOptions { size, ..TargetOptions::with_depth(vk::Format::D32_SFLOAT) };
    Target::new(gpu, &options)
}

fn write(target: &Target, [width, height]: [u32; 2], name: &str) -> Outcome<()> {
    let bytes = target.read::<[u8; 4]>().concat();
    let picture = image::RgbaImage::from_raw(width, height, bytes).ok_or("a picture's size")?;
    Ok(picture.save(format!("{name}.png"))?)
}

fn draw_mesh(gpu: &Gpu, name: &str, model: &Model) -> Outcome<()> {
    let target = target(gpu, SIZE);
    let ready = Ready::new(gpu, &target, model, Vec3::new(0.4, 0.3, 1.0));
    gpu.run(|commands| {
        let pass = Pass::clear([0.2, 0.4, 0.6, 1.0]);
        commands.pass(&target, &pass, || ready.draw(commands));
    });
    write(&target, SIZE, name)
}

fn draw_floor(gpu: &Gpu, frame: u32) -> Outcome<()> {
    let target = target(gpu, [FRAME; 2]);
    let options = PipelineOptions {
        vertex: VERTEX,
        fragment: Some(FRAGMENT),
        vertex_bindings: vec![binding(0, 24)],
        vertex_attributes: vec![
            attribute(0, vk::Format::R32G32B32A32_SFLOAT, 0),
            attribute(1, vk::Format::R32G32_SFLOAT, 16),
        ],
        ..PipelineOptions::default()
    };
    let pipeline = Pipeline::new(gpu, &target, &options);
    let places = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let vertices: Vec<[f32; 6]> = (floor(frame).as_flattened().iter().zip(places))
        .map(|(&corner, [u, v])| {
            let [x, y, z, w] = to_clip(corner);
            [x, y, z, w, u, v]
        })
        .collect();
    let vertices = Buffer::of(gpu, &vertices);
    gpu.run(|commands| {
        commands.pass(&target, &Pass::clear([0.2, 0.4, 0.6, 1.0]), || {
            commands.bind(&pipeline);
            commands.vertices(&vertices);
            commands.draw(0..6);
        });
    });
    write(&target, [FRAME; 2], &format!("floor-{frame}"))
}

fn main() -> Outcome<()> {
    let gpu = Gpu::loaded().or_else(|_| Gpu::lavapipe())?;
    println!("{}", gpu.name());
    draw_mesh(&gpu, "duck", &Model::duck()?)?;
    draw_mesh(&gpu, "african-head", &Model::african_head()?)?;
    draw_mesh(&gpu, "bunny", &Model::bunny()?)?;
    (0..FRAMES).try_for_each(|frame| draw_floor(&gpu, frame))
}
