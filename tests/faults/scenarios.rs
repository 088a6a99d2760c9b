//! The scenarios that run while allocations fail.

use gaurast::vk::{
    GaussianCameraGAURAST, GaussianCameraModelGAURAST, GaussianGeometryGAURAST, GaussianOrderGAURAST,
    GaussianPrecisionGAURAST, PipelineGaussianStateCreateInfoGAURAST,
};
use gaurast_runner::{Need, Variant};
use gaurast_testkit::{GaussianOptions, GaussianPipeline, GaussianScene, Gpu, Pass, Settings, Target};
use gaurast_tests::kernels;
use gaurast_tests::scenes::{Gaussian, SceneBuffers};
use gaurast_tests::triangles::scenes;

use super::results::{DEVICE_MEMORY, HOST_MEMORY, LOST};

/// The compiler of the triangles' shaders.
pub const GLSLANG: Need = Need::Program("glslangValidator");

/// A function that uses a device: it returns the picture, or panics with the result of the call that failed.
pub type Use = Box<dyn Fn() -> Vec<u8>>;

/// The time at which a scenario's device is opened.
pub enum Opened {
    /// Once before all uses, so that all have the same device.
    Before,
    /// Each time that it is used.
    Within,
}

/// Opens a device and returns a function that may be called several times.
pub struct Scenario {
    pub name: String,
    pub device: Opened,
    /// The results, as indices of [`RESULTS`](super::results::RESULTS), in which some runs must end. Others may occur
    /// too.
    pub results: &'static [usize],
    pub open: Box<dyn Fn() -> Use>,
}

const SETTINGS: Settings = Settings { threads: Some(2), ..Settings::DEFAULT };

/// Scenes of triangles whose commands, descriptors and transfers differ.
const TRIANGLES: [&str; 14] = [
    "primitive_restart",
    "indices_of_every_type",
    "indexed_indirect_draws",
    "depth_of_24_bits_and_stencil",
    "several_attachments",
    "four_samples_with_depth",
    "linear_filter",
    "texture_formats",
    "uniform_buffer",
    "fragments_write_storage",
    "secondary_command_buffers",
    "clears_within_a_pass",
    "render_pass_object",
    "input_attachments",
];

/// All scenarios.
pub fn all() -> Vec<Scenario> {
    let opening = scenario("opening a device", || {
        Box::new(|| gaussians_on(&Gpu::embedded(&SETTINGS).expect("a device"), Gaussians::default()))
    });
    let mut all = vec![Scenario { device: Opened::Within, ..opening }];
    for gaussians in Gaussians::all() {
        all.push(scenario(gaussians.name, move || {
            let context = Gpu::embedded(&SETTINGS).expect("a device");
            Box::new(move || gaussians_on(&context, gaussians))
        }));
    }
    all.extend(TRIANGLES.map(|name| {
        scenario(name, move || {
            let gpu = Gpu::embedded(&SETTINGS).expect("a device");
            Box::new(move || triangles_on(&gpu, name))
        })
    }));
    all.push(scenario("kernels", || {
        let context = kernels::Context::gaurast().expect("a device");
        Box::new(move || kernels_on(&context))
    }));
    all
}

/// A variant for each scenario.
pub fn variants() -> Vec<Variant> {
    let variant = |scenario: Scenario| Variant {
        needs: if TRIANGLES.contains(&&*scenario.name) { vec![GLSLANG] } else { Vec::new() },
        name: scenario.name,
    };
    all().into_iter().map(variant).collect()
}

fn scenario(name: &str, open: impl Fn() -> Use + 'static) -> Scenario {
    Scenario {
        name: name.to_owned(),
        device: Opened::Before,
        results: &[HOST_MEMORY, DEVICE_MEMORY, LOST],
        open: Box::new(open),
    }
}

/// The mode of a draw of Gaussians.
#[derive(Clone, Copy)]
struct Gaussians {
    name: &'static str,
    state: PipelineGaussianStateCreateInfoGAURAST<'static>,
    model: GaussianCameraModelGAURAST,
}

impl Default for Gaussians {
    fn default() -> Self {
        Self {
            name: "Gaussians",
            state: PipelineGaussianStateCreateInfoGAURAST::default(),
            model: GaussianCameraModelGAURAST::PINHOLE,
        }
    }
}

impl Gaussians {
    /// The modes that have lists of their own.
    fn all() -> [Self; 5] {
        let state = PipelineGaussianStateCreateInfoGAURAST::default();
        let plain = Self::default();
        [
            plain,
            Self {
                name: "Gaussians in each pixel's order",
                state: state.order(GaussianOrderGAURAST::PER_PIXEL),
                ..plain
            },
            Self { name: "discs", state: state.geometry(GaussianGeometryGAURAST::GAUSSIAN_2D), ..plain },
            Self { name: "Gaussians in binary16", state: state.precision(GaussianPrecisionGAURAST::FLOAT16), ..plain },
            Self { name: "a panorama", model: GaussianCameraModelGAURAST::EQUIRECTANGULAR, ..plain },
        ]
    }
}

/// Gaussians of many sizes and depths.
pub fn scene(count: usize) -> SceneBuffers {
    let one = |index: usize| {
        let at = |factor: usize, period: usize| (index * factor % period) as f32 / period as f32;
        Gaussian {
            position: [4.0 * at(7, 101) - 2.0, 3.0 * at(13, 97) - 1.5, 2.0 + 4.0 * at(29, 89)],
            scale: [0.02 + 0.1 * at(3, 31), 0.05, 0.03],
            rotation: [1.0, at(5, 17), at(11, 19), 0.3],
            opacity: 0.2 + 0.7 * at(17, 23),
            sh: vec![[at(3, 7), at(5, 11), at(2, 5)]],
        }
    };
    SceneBuffers::new(0, (0..count).map(one))
}

/// Draws a scene three times, so that the driver builds chunks. `drawing` is called when this begins and when it ends.
pub fn draw(context: &Gpu, buffers: &SceneBuffers, size: [u32; 2], drawing: impl Fn(bool)) -> Vec<u8> {
    draw_as(context, buffers, size, Gaussians::default(), drawing)
}

fn draw_as(context: &Gpu, buffers: &SceneBuffers, size: [u32; 2], how: Gaussians, drawing: impl Fn(bool)) -> Vec<u8> {
    let options = GaussianOptions { state: how.state, ..GaussianOptions::new(0) };
    let pipeline = GaussianPipeline::new(context, &options);
    let scene = GaussianScene::new(context, buffers);
    let target = Target::floats(context, size);
    let focal_length = match how.model {
        // The focal length in pixels per radian; the picture covers the full circle.
        GaussianCameraModelGAURAST::EQUIRECTANGULAR => size[0] as f32 / std::f32::consts::TAU,
        _ => 0.8 * size[0] as f32,
    };
    let camera = GaussianCameraGAURAST::default()
        .model(how.model)
        .focal_length([focal_length; 2])
        .principal_point(size.map(|side| 0.5 * side as f32));
    drawing(true);
    for _ in 0..3 {
        context.run(|commands| {
            commands.pass(&target, &Pass::clear([0.0; 4]), || {
                scene.bind(commands, &pipeline, &camera);
                commands.draw(0..scene.count);
            });
        });
    }
    drawing(false);
    let pixels: Vec<[f32; 4]> = target.read();
    bytemuck::cast_slice(&pixels).to_vec()
}

fn gaussians_on(context: &Gpu, how: Gaussians) -> Vec<u8> {
    draw_as(context, &scene(1500), [96, 80], how, |_| ())
}

fn triangles_on(gpu: &Gpu, name: &str) -> Vec<u8> {
    let scene = scenes::find(name).expect("a scene");
    let output = (scene.draw)(gpu).expect("the device has all of it");
    let pictures = output.pictures.iter();
    pictures.flat_map(|picture| picture.bytes.clone()).collect()
}

fn kernels_on(context: &kernels::Context) -> Vec<u8> {
    let mut made = Vec::new();
    for kernel in kernels::all(kernels::Size::Small) {
        let prepared = context.prepare(&kernel).expect("it is prepared");
        prepared.run().expect("it runs");
        for expected in &kernel.expected {
            let read = prepared.read(expected.binding);
            made.extend(bytemuck::cast_slice(&read));
        }
    }
    made
}
