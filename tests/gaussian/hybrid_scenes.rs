//! A head of triangles among Gaussians, and a rectangle that cuts through both: in front of, behind and inside the
//! Gaussians, compared with the oracle's composite.

use std::path::Path;

use ash::vk;
use gaurast::vk::GaussianCameraGAURAST;
use gaurast_runner::{Need, data};
use gaurast_scene::Scene;
use gaurast_scene::camera::DEFAULT_FOV;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{
    Buffer, Gpu, Output, Pass, Pipeline, PipelineOptions, Target, TargetOptions, Vertex, depth_test,
};
use gaurast_testkit::{GaussianOptions, GaussianPipeline, GaussianScene, Settings, for_people};
use gaurast_tests::compare::{Limits, assert_contract};
use gaurast_tests::hybrid::{Held, ToClip, depth_format, held};
use gaurast_tests::oracle::{DepthCodes, OracleCamera, OracleTests, render_tested, sample_tests::compare};
use gaurast_tests::scenes::SceneBuffers;
use gaurast_workloads::models::Model;
use glam::{DMat3, DVec3, Vec3};

use super::PLAYBOT;

const SIZE: [u32; 2] = [320, 240];

/// Gaussians, triangles in their world space, and a camera.
pub(super) struct Hybrid {
    pub(super) name: &'static str,
    scene: SceneBuffers,
    camera: GaussianCameraGAURAST<'static>,
    /// The head in clip coordinates, which is drawn before the Gaussians.
    head: Vec<Vertex>,
    /// The rectangle in clip coordinates, which is drawn after the Gaussians.
    pane: Vec<Vertex>,
    target: TargetOptions,
    compare: vk::CompareOp,
}

/// The parts that are drawn.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum What {
    Head,
    Pane,
    Everything,
}

/// The head's triangles, with the colours of its texture under a light. `place` maps its points to world space.
fn head(model: &Model, place: impl Fn(DVec3) -> DVec3, to_clip: &ToClip) -> Vec<Vertex> {
    let light = Vec3::new(0.4, 0.5, 0.8).normalize();
    let mut vertices = Vec::new();
    for part in &model.parts {
        let (width, height) = part.diffuse.dimensions();
        for &index in &part.indices {
            let corner = &part.corners[index as usize];
            let at = |coordinate: f32, size: u32| ((coordinate * size as f32) as u32).min(size - 1);
            let texel = part.diffuse.get_pixel(at(corner.uv[0], width), at(corner.uv[1], height));
            let lit = 0.3 + 0.7 * Vec3::from(corner.normal).dot(light).max(0.0);
            let [r, g, b, _] = texel.0.map(|c| lit * f32::from(c) / 255.0);
            let point = Vec3::from(corner.position).as_dvec3();
            vertices.push(Vertex { position: to_clip.position(place(point)), color: [r, g, b, 1.0] });
        }
    }
    vertices
}

/// Two triangles of one colour.
fn pane(corners: [DVec3; 4], to_clip: &ToClip) -> Vec<Vertex> {
    let corner = |index: usize| Vertex { position: to_clip.position(corners[index]), color: [0.9, 0.75, 0.1, 1.0] };
    [0, 1, 2, 0, 2, 3].map(corner).to_vec()
}

impl Hybrid {
    fn state(&self) -> vk::PipelineDepthStencilStateCreateInfo<'static> {
        depth_test(self.compare)
    }

    fn is_reverse(&self) -> bool {
        self.compare == vk::CompareOp::GREATER
    }

    pub(super) fn draw(&self, gpu: &Gpu, what: What) -> Output {
        let target = Target::new(gpu, &self.target);
        let options = PipelineOptions { depth_stencil: self.state(), ..PipelineOptions::default() };
        let triangles = Pipeline::new(gpu, &target, &options);
        let gaussians = GaussianPipeline::new(
            gpu,
            &GaussianOptions { depth_stencil: self.state(), ..GaussianOptions::over(self.scene.degree, &target) },
        );
        let scene = GaussianScene::new(gpu, &self.scene);
        let (head, pane) = (Buffer::of(gpu, &self.head), Buffer::of(gpu, &self.pane));
        let pass = Pass {
            color: vk::ClearColorValue { float32: [0.0; 4] },
            depth: vk::ClearDepthStencilValue { depth: if self.is_reverse() { 0.0 } else { 1.0 }, stencil: 0 },
            ..Pass::default()
        };
        target.draw(gpu, &pass, |commands| {
            if what != What::Pane {
                commands.bind(&triangles);
                commands.vertices(&head);
                commands.draw(0..self.head.len() as u32);
            }
            if what == What::Everything {
                scene.draw(commands, &gaussians, &self.camera);
            }
            if what != What::Head {
                commands.bind(&triangles);
                commands.vertices(&pane);
                commands.draw(0..self.pane.len() as u32);
            }
        })
    }

    /// Draws everything and compares each sample with the oracle's composite.
    fn judge(&self) {
        let gpu = Gpu::embedded(&Settings::default()).expect("a device");
        let held_of = |output: &Output| held(&self.target, output);
        let head = held_of(&self.draw(&gpu, What::Head));
        let pane = held_of(&self.draw(&gpu, What::Pane));
        let everything = self.draw(&gpu, What::Everything);
        let picture = &everything.pictures[0];
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/pictures");
        let saved = std::fs::create_dir_all(&folder).map_err(image::ImageError::from);
        let saved = saved.and_then(|()| for_people(picture).save(folder.join(format!("{}.png", self.name))));
        assert!(saved.is_ok(), "{saved:?}");
        for (sample, after) in held_of(&everything).iter().enumerate() {
            let name = format!("{} sample {sample}", self.name);
            self.judge_sample(&name, &head[sample], &pane[sample], after);
        }
    }

    fn judge_sample(&self, name: &str, head: &Held, pane: &Held, after: &Held) {
        let tests = OracleTests {
            negative_one_to_one: false,
            depth_coefficients: self.camera.depth_coefficients,
            depth_range: [0.0, 1.0],
            format: depth_format(&self.target),
            depth: Some((self.compare, true)),
            bounds: None,
            stencil: None,
        };
        let camera = OracleCamera::new(&self.camera, SIZE).expect("a pinhole");
        let state = (&GaussianOptions::new(0).state).into();
        let scene = self.scene.as_oracle();
        let drawn = render_tested(&scene, &camera, &state, &tests, &head.stored);
        let behind: Vec<_> = head.color.iter().map(|c| c.map(f64::from)).collect();
        let mut composite = drawn.color.over(&behind);
        // The rectangle, where it passes the depth test against the depths that the Gaussians may have stored.
        let (mut shown, mut hidden) = (0, 0);
        for (at, color) in pane.color.iter().enumerate().filter(|(_, c)| c[3] == 1.0) {
            let depth = pane.stored.depth[at];
            let known = drawn.depth[at].as_deref().unwrap_or_default();
            let passes = |stored: &DepthCodes| compare(self.compare, depth, stored.nominal);
            let color = color.map(f64::from);
            match (known.iter().any(passes), known.iter().all(passes)) {
                _ if known.is_empty() => {
                    composite.alternatives.entry(at).or_default().push(color);
                }
                (_, true) => {
                    shown += 1;
                    composite.nominal[at] = color;
                    composite.alternatives.remove(&at);
                    assert_eq!(after.stored.depth[at], depth, "{name}, pixel {at}");
                }
                (true, false) => composite.alternatives.entry(at).or_default().push(color),
                (false, false) => hidden += 1,
            }
        }
        assert_contract(name, &after.color, &composite, Limits::ENVELOPE_ONLY);
        assert!(
            shown > 500 && hidden > 500,
            "the pane goes through the scene: {shown} samples of it are shown, {hidden} hidden"
        );
        // The head is in front of some Gaussians and behind others.
        let is_head = |at: &usize| head.color[*at][3] == 1.0;
        let changed = |at: &usize| drawn.color.nominal[*at][3] > 0.0;
        let pixels = 0..head.color.len();
        let (all, through) = (pixels.clone().filter(is_head).count(), pixels.filter(is_head).filter(changed).count());
        assert!(all > 1000 && through > 100 && through < all, "{through} of {all}");
    }
}

/// Converts a point from axes with y up to those of the garden.
fn turn(point: DVec3) -> DVec3 {
    DVec3::new(point.x, -point.y, -point.z)
}

/// The needs of a head in the garden.
pub(super) const GARDEN: [Need; 2] = [GLSLANG, Need::Data(Model::AFRICAN_HEAD)];

pub(super) fn garden(name: &'static str, depth: vk::Format, samples: u32) -> Hybrid {
    let model = Model::african_head().expect("its files");
    let camera = gaurast_scene::garden::camera(None, SIZE).expect("a camera");
    let (near, far) = (0.5f32, 60.0f32);
    let camera = camera.to_vulkan().depth_coefficients([far / (far - near), -near * far / (far - near)]);
    let to_clip = ToClip { camera, size: SIZE };
    // The head is in the meadow and faces the camera.
    let place = |point: DVec3| {
        let (sin, cos) = 0.35f64.sin_cos();
        let p = 0.75 * point;
        let turned = DVec3::new(cos * p.x + sin * p.z, p.y, cos * p.z - sin * p.x);
        turn(turned + DVec3::new(1.15, 0.62, 2.2))
    };
    let pane_corners = [
        DVec3::new(-2.6, -0.2, 3.0),
        DVec3::new(1.9, -0.2, -1.4),
        DVec3::new(1.9, 0.9, -1.4),
        DVec3::new(-2.6, 0.9, 3.0),
    ];
    Hybrid {
        name,
        scene: SceneBuffers::from(&gaurast_scene::garden::scene(1, 40_000)),
        camera,
        head: head(&model, place, &to_clip),
        pane: pane(pane_corners.map(turn), &to_clip),
        target: target(depth, samples),
        compare: vk::CompareOp::LESS,
    }
}

fn target(depth: vk::Format, samples: u32) -> TargetOptions {
    TargetOptions {
        size: SIZE,
        colors: vec![vk::Format::R32G32B32A32_SFLOAT],
        depth: Some(depth),
        samples,
        resolve: true,
    }
}

#[gaurast_runner::test(needs = GARDEN)]
fn a_head_stands_in_the_garden() {
    garden("head in the garden", vk::Format::D32_SFLOAT, 1).judge();
}

#[gaurast_runner::test(needs = GARDEN)]
fn a_head_stands_in_the_garden_with_four_samples() {
    let format = vk::Format::X8_D24_UNORM_PACK32;
    garden("head in the garden with four samples", format, 4).judge();
}

/// The needs of a head inside a trained scene.
pub(super) const WITH_PLAYBOT: [Need; 3] = [GLSLANG, Need::Data(Model::AFRICAN_HEAD), Need::Data(PLAYBOT)];

/// A head inside a trained scene, with reversed depth.
pub(super) fn playbot() -> Hybrid {
    let model = Model::african_head().expect("its files");
    let scene = gaurast_scene::open(data(PLAYBOT)).expect("a scene");
    let (near, far) = (0.1f32, 200.0f32);
    let camera = gaurast_scene::frame_middle(&scene, DEFAULT_FOV, SIZE)
        .to_vulkan()
        .depth_coefficients([-near / (far - near), near * far / (far - near)]);
    let to_clip = ToClip { camera, size: SIZE };
    // The head is at the point that the camera looks at, in the camera's axes: right, down and forward.
    let rotation = DMat3::from_cols_array(&camera.rotation.map(f64::from));
    let (middle, radius) = middle(&scene, &camera);
    let from_view = |view: DVec3| middle + rotation * (radius * view);
    let place = |p: DVec3| from_view(DVec3::new(0.7 * p.x, -0.7 * p.y, -0.7 * p.z));
    let pane_corners = [
        DVec3::new(-1.2, 0.5, -1.2),
        DVec3::new(1.2, 0.5, 1.2),
        DVec3::new(1.2, 0.1, 1.2),
        DVec3::new(-1.2, 0.1, -1.2),
    ];
    Hybrid {
        name: "head in playbot",
        scene: SceneBuffers::from(&scene),
        camera,
        head: head(&model, place, &to_clip),
        pane: pane(pane_corners.map(from_view), &to_clip),
        target: target(vk::Format::D32_SFLOAT, 1),
        compare: vk::CompareOp::GREATER,
    }
}

#[gaurast_runner::test(needs = WITH_PLAYBOT)]
fn a_head_is_inside_a_trained_scene_with_reversed_depth() {
    playbot().judge();
}

/// The centre of the Gaussians along the camera's axis, and the distance within which half of them are.
fn middle(scene: &Scene, camera: &GaussianCameraGAURAST) -> (DVec3, f64) {
    let points: Vec<DVec3> = (scene.positions().iter()).map(|&position| Vec3::from(position).as_dvec3()).collect();
    let median = |mut values: Vec<f64>| {
        let half = values.len() / 2;
        *values.select_nth_unstable_by(half, f64::total_cmp).1
    };
    let forward = DVec3::from_slice(&camera.rotation[6..].iter().map(|&r| r.into()).collect::<Vec<f64>>());
    let eye = DVec3::from(camera.eye);
    let along = median(points.iter().map(|p| (*p - eye).dot(forward)).collect());
    let middle = eye + along * forward;
    (middle, median(points.iter().map(|p| p.distance(middle)).collect()))
}
