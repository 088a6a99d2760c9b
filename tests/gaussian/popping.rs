//! Popping: how much a picture changes because the order does, while the camera turns.
//!
//! A camera that only turns moves every point by the same law whatever its depth, so that Gaussians
//! should never overtake each other. What a step's new order changes is measured without any
//! warping of pictures: the next view is drawn in its own order and in that of the view before.
//!
//! `--nocapture` shows the figures.

use gaurast::vk::{
    GaussianCameraGAURAST, GaussianOrderGAURAST, PipelineGaussianStateCreateInfoGAURAST,
};
use gaurast_samples::camera::{Camera, DEFAULT_FOV};
use gaurast_samples::scene::Scene;
use gaurast_tests::contexts::{
    Buffer, Context, DeviceScene, Pass, Pipeline, PipelineOptions, Settings, Target,
};
use gaurast_tests::data::require_data;
use gaurast_tests::scenes::{self, SceneBuffers};

type Picture = Vec<[f32; 4]>;

const SIZE: [u32; 2] = [400, 300];
const STEPS: usize = 10;
/// A tenth of a degree.
const STEP: f64 = std::f64::consts::PI / 1800.0;

/// The camera after a number of steps about its own vertical axis.
fn turned(camera: &GaussianCameraGAURAST<'static>, steps: usize) -> GaussianCameraGAURAST<'static> {
    let (sin, cos) = (steps as f64 * STEP).sin_cos();
    let r = camera.rotation.map(f64::from);
    let row = |x: f64, z: f64| [0, 1, 2].map(|c| (x * r[c] + z * r[6 + c]) as f32);
    let [x, z] = [row(cos, sin), row(-sin, cos)];
    let y = [camera.rotation[3], camera.rotation[4], camera.rotation[5]];
    let mut rotation = [0.0; 9];
    rotation[..3].copy_from_slice(&x);
    rotation[3..6].copy_from_slice(&y);
    rotation[6..].copy_from_slice(&z);
    camera.rotation(rotation)
}

/// What the device sorts by, as the specification says it: in binary64, rounded.
fn keys(
    scene: &SceneBuffers,
    camera: &GaussianCameraGAURAST,
    order: GaussianOrderGAURAST,
) -> Vec<f32> {
    let r = camera.rotation.map(f64::from);
    let key = |position: &[f32; 3]| {
        let d: [f64; 3] = std::array::from_fn(|i| f64::from(position[i]) - camera.eye[i]);
        let key = match order {
            GaussianOrderGAURAST::VIEW_DEPTH => d[0] * r[6] + d[1] * r[7] + d[2] * r[8],
            _ => (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt(),
        };
        key as f32
    };
    scene.positions.iter().map(key).collect()
}

/// A scene that can be drawn in any order.
struct Bench {
    context: Context,
    scene: SceneBuffers,
    on_device: DeviceScene,
    as_named: Pipeline,
}

impl Bench {
    fn new(scene: SceneBuffers) -> Self {
        let context = Context::embedded(&Settings::default());
        Self {
            on_device: DeviceScene::new(&context, &scene),
            as_named: Self::pipeline(&context, &scene, GaussianOrderGAURAST::PRIMITIVE),
            context,
            scene,
        }
    }

    fn pipeline(context: &Context, scene: &SceneBuffers, order: GaussianOrderGAURAST) -> Pipeline {
        let options = PipelineOptions {
            state: PipelineGaussianStateCreateInfoGAURAST::default().order(order),
            ..PipelineOptions::new(scene.degree)
        };
        Pipeline::new(context, &options)
    }

    fn draw(
        &self,
        pipeline: &Pipeline,
        camera: &GaussianCameraGAURAST,
        order: Option<&[u32]>,
    ) -> Picture {
        let format = PipelineOptions::new(0).format;
        let target = Target::new(&self.context, format, SIZE);
        let indices = order.map(|order| Buffer::of(&self.context, order));
        self.context.run(|commands| {
            commands.pass(&target, &Pass::clear([0.0; 4]), || {
                commands.bind(pipeline, &self.on_device, camera);
                match &indices {
                    None => commands.draw([self.on_device.count, 1, 0, 0]),
                    Some(indices) => {
                        commands.bind_indices(indices);
                        commands.draw_indexed(self.on_device.count, 0, 0);
                    }
                }
            });
        });
        target.read()
    }

    /// The greatest change of a channel, and the share of pixels that change by a level of 8 bits, of any
    /// step's picture by its new order.
    fn popping(
        &self,
        camera: &GaussianCameraGAURAST<'static>,
        order: GaussianOrderGAURAST,
    ) -> (f32, f64) {
        let sorted = Self::pipeline(&self.context, &self.scene, order);
        let names = |camera: &GaussianCameraGAURAST| {
            let keys = keys(&self.scene, camera, order);
            let mut names: Vec<u32> = (0..self.on_device.count).collect();
            names.sort_by(|&a, &b| keys[a as usize].total_cmp(&keys[b as usize]));
            names
        };
        let (mut greatest, mut share) = (0.0f32, 0.0f64);
        let mut before = names(camera);
        for step in 1..=STEPS {
            let camera = turned(camera, step);
            let now = names(&camera);
            let own = self.draw(&self.as_named, &camera, Some(&now));
            if step == 1 {
                let by_device = self.draw(&sorted, &camera, None);
                assert!(own == by_device, "the order is not the device's");
            }
            let old = self.draw(&self.as_named, &camera, Some(&before));
            let change = |(a, b): (&[f32; 4], &[f32; 4])| {
                let channels = a.iter().zip(b).map(|(a, b)| (a - b).abs());
                channels.fold(0.0, f32::max)
            };
            let changes: Vec<f32> = own.iter().zip(&old).map(change).collect();
            greatest = changes.iter().fold(greatest, |a, &b| a.max(b));
            let visible = changes.iter().filter(|change| **change > 1.0 / 255.0);
            share = share.max(visible.count() as f64 / changes.len() as f64);
            before = now;
        }
        (greatest, share)
    }
}

fn compare(name: &str, scene: SceneBuffers, camera: GaussianCameraGAURAST<'static>) {
    let bench = Bench::new(scene);
    let orders = [
        ("view depth", GaussianOrderGAURAST::VIEW_DEPTH),
        ("radial distance", GaussianOrderGAURAST::RADIAL_DISTANCE),
    ];
    let [depth, distance] = orders.map(|(order_name, order)| {
        let (greatest, share) = bench.popping(&camera, order);
        let percent = 100.0 * share;
        println!("{name}, by {order_name}: {greatest:.4} at most, {percent:.3} % of pixels by more than 1/255");
        greatest
    });
    // Depth along the axis changes as the camera turns, distance from the eye does not.
    assert!(depth > 0.0, "nothing pops");
    assert_eq!(distance, 0.0);
}

#[test]
fn turning_pops_by_view_depth_and_not_by_distance() {
    let camera = scenes::camera(SIZE[0], SIZE[1]).to_vulkan();
    let mut cloud = scenes::cloud(70, 4000, 1);
    // Large enough to overlap, so that their order shows.
    for scale in cloud.scales.as_flattened_mut() {
        *scale *= 6.0;
    }
    compare("a cloud", cloud, camera);
}

#[test]
fn skull_pops_by_view_depth_and_not_by_distance() {
    let Some(path) = require_data("splats/skull.ply") else {
        return;
    };
    let scene = Scene::load(&path).expect("a scene");
    let camera = Camera::framing(&scene, DEFAULT_FOV, SIZE).to_vulkan();
    compare("skull", SceneBuffers::from(&scene), camera);
}
