//! The scenarios that run while allocations fail.

use gaurast_runner::Variant;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{Gpu, Settings};
use gaurast_tests::many_gaussians::{self, Mode};
use gaurast_workloads::kernels;

use super::results::{DEVICE_MEMORY, HOST_MEMORY, LOST};

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
        Box::new(|| gaussians_on(&Gpu::embedded(&SETTINGS).expect("a device"), Mode::default()))
    });
    let mut all = vec![Scenario { device: Opened::Within, ..opening }];
    for mode in Mode::all() {
        all.push(scenario(mode.name, move || {
            let context = Gpu::embedded(&SETTINGS).expect("a device");
            Box::new(move || gaussians_on(&context, mode))
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

fn gaussians_on(context: &Gpu, mode: Mode) -> Vec<u8> {
    many_gaussians::draw(context, &many_gaussians::scene(1500), [96, 80], mode, |_| ())
}

fn triangles_on(gpu: &Gpu, name: &str) -> Vec<u8> {
    let scene = crate::scenes::find(name).expect("a scene");
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
