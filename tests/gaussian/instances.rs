//! Gaussians that are drawn several times with different model matrices, and scenes far from the origin.

use ash::vk;
use gaurast::vk::{
    GaussianCameraGAURAST, GaussianCameraModelGAURAST, GaussianLinearizationGAURAST, GaussianOrderGAURAST,
    PipelineGaussianStateCreateInfoGAURAST,
};
use gaurast_runner::{Case, simd_levels};
use gaurast_testkit::for_levels::ForLevels;
use gaurast_testkit::{
    Buffer, GaussianOptions, GaussianPipeline, GaussianScene, Gpu, Instance, Pass, Settings, Target, bind_instances,
};
use gaurast_tests::compare::{Limits, assert_contract};
use gaurast_tests::oracle::{OracleCamera, OracleInstance, OracleScene, OracleState, Reference, render_bounded};
use gaurast_tests::scenes::{self, Gaussian, SceneBuffers};
use half::f16;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

type State = PipelineGaussianStateCreateInfoGAURAST<'static>;
type Camera = GaussianCameraGAURAST<'static>;

const SIZE: [u32; 2] = [131, 97];

const IDENTITY: [[f32; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// The way in which a scene is drawn.
#[derive(Clone, Copy)]
struct Way<'a> {
    state: State,
    camera: Camera,
    /// The placements of the Gaussians, by instance or by vertex.
    instances: Option<(&'a [OracleInstance], vk::VertexInputRate)>,
    half: bool,
}

impl Way<'_> {
    fn new(camera: Camera) -> Self {
        Self { state: State::default(), camera, instances: None, half: false }
    }
}

fn draw(gpu: &Gpu, scene: &SceneBuffers, way: &Way<'_>) -> Vec<[f32; 4]> {
    let options = GaussianOptions {
        state: way.state,
        half: way.half,
        instances: way.instances.map(|(_, rate)| rate),
        ..GaussianOptions::new(scene.degree)
    };
    let pipeline = GaussianPipeline::new(gpu, &options);
    let on_device = if way.half { GaussianScene::half(gpu, scene) } else { GaussianScene::new(gpu, scene) };
    let placed = way.instances.map(|(instances, rate)| {
        let flat = |instance: &OracleInstance| -> Instance {
            let elements = instance.matrix.as_flattened();
            std::array::from_fn(|i| *elements.get(i).unwrap_or(&instance.opacity))
        };
        let flat: Vec<Instance> = instances.iter().map(flat).collect();
        let count = match rate {
            vk::VertexInputRate::INSTANCE => instances.len() as u32,
            _ => 1,
        };
        (Buffer::of(gpu, &flat), count)
    });
    let target = Target::floats(gpu, SIZE);
    gpu.run(|commands| {
        commands.pass(&target, &Pass::clear([0.0; 4]), || {
            on_device.bind(commands, &pipeline, &way.camera);
            let mut count = 1;
            if let Some((buffer, instances)) = &placed {
                bind_instances(commands, buffer);
                count = *instances;
            }
            commands.draw_instances(0..on_device.count, 0..count);
        });
    });
    assert_eq!(gpu.messages(), []);
    target.read()
}

/// The oracle's picture of a scene that is drawn once for each of `instances`.
fn reference(scene: &SceneBuffers, instances: &[OracleInstance], state: &State, camera: &Camera) -> Reference {
    let one = scene.as_oracle();
    let (copies, count) = (instances.len(), scene.positions.len());
    let expanded: Vec<OracleInstance> =
        instances.iter().flat_map(|&instance| std::iter::repeat_n(instance, count)).collect();
    let whole = OracleScene {
        positions: &one.positions.repeat(copies),
        scales: &one.scales.repeat(copies),
        rotations: &one.rotations.repeat(copies),
        opacities: &one.opacities.repeat(copies),
        sh: &one.sh.repeat(copies),
        instances: &expanded,
        ..one
    };
    let camera = OracleCamera::new(camera, SIZE).expect("a model that the oracle has");
    render_bounded(&whole, &camera, &OracleState::from(state))
}

/// A device of the case's SIMD level.
fn device(case: &Case) -> Gpu {
    Gpu::embedded(&Settings { simd: Some(case.variant()), threads: Some(2), ..Settings::default() }).expect("a device")
}

/// Matrices that rotate, stretch, shear, mirror and translate, a singular one, one that is not finite, and opacity
/// factors.
fn any_instances(seed: u64) -> Vec<OracleInstance> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut instances: Vec<OracleInstance> = (0..7)
        .map(|_| OracleInstance {
            matrix: std::array::from_fn(|row| {
                std::array::from_fn(|column| match column {
                    3 => rng.random_range(-1.0..1.0) + [0.0, 0.0, 1.0][row],
                    _ => rng.random_range(-0.4..0.4) + if row == column { 0.6 } else { 0.0 },
                })
            }),
            opacity: rng.random_range(0.2..1.4),
        })
        .collect();
    for element in &mut instances[2].matrix[0] {
        *element = -*element;
    }
    instances[4].matrix[1] = [0.0, 0.0, 0.0, 0.5];
    instances[5].matrix[2][3] = f32::NAN;
    instances
}

fn pinhole() -> Camera {
    scenes::camera(SIZE[0], SIZE[1]).to_vulkan()
}

fn cameras() -> [(&'static str, Camera); 4] {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let middle = [0.1, -0.2, 3.5];
    let panorama = Camera::panorama(&axes, middle, SIZE.map(|side| side as f32));
    let parallel = pinhole().model(GaussianCameraModelGAURAST::ORTHOGRAPHIC).focal_length([21.0, 19.0]);
    let fisheye = pinhole().model(GaussianCameraModelGAURAST::FISHEYE).focal_length([80.0, 70.0]);
    [("pinhole", pinhole()), ("parallel", parallel), ("fisheye", fisheye), ("panorama", panorama.expect("a camera"))]
}

#[gaurast_runner::test(each = simd_levels())]
fn instances_keep_the_contract_through_every_camera(case: &Case) {
    let scene = scenes::cloud(31, 500, 2);
    let instances = any_instances(31);
    let states = [
        State::default(),
        State::default().order(GaussianOrderGAURAST::RADIAL_DISTANCE),
        State::default().linearization(GaussianLinearizationGAURAST::UNSCENTED),
    ];
    static REFERENCES: ForLevels<Reference> = ForLevels::new();
    let gpu = device(case);
    for (name, camera) in cameras() {
        for state in states {
            let name = format!("{name}, {:?}, {:?}", state.order, state.linearization);
            let expected = REFERENCES.get(&name, || reference(&scene, &instances, &state, &camera));
            assert!(expected.nominal.iter().filter(|p| p[3] > 0.1).count() > 500);
            assert!(expected.skips.degenerate_covariance > 0 || name.starts_with("panorama"));
            assert!(expected.skips.non_finite == 500);
            let way = Way { state, instances: Some((&instances, vk::VertexInputRate::INSTANCE)), ..Way::new(camera) };
            let picture = draw(&gpu, &scene, &way);
            let name = format!("{name}, {}", case.variant());
            assert_contract(&name, &picture, &expected, Limits::ENVELOPE_ONLY);
        }
    }
}

/// The scene with numbers of few bits, so that the operations below are exact.
fn exact(scene: &SceneBuffers) -> SceneBuffers {
    let round = |value: f32| (value * 1024.0).round() / 1024.0;
    SceneBuffers {
        positions: scene.positions.iter().map(|p| p.map(round)).collect(),
        rotations: scene.rotations.iter().map(|q| q.map(round)).collect(),
        ..scene.clone()
    }
}

/// Half a turn about y, with twice the size, and a translation.
const SIMILARITY: [[f32; 4]; 3] = [[-2.0, 0.0, 0.0, 0.25], [0.0, 2.0, 0.0, -0.5], [0.0, 0.0, -2.0, 16.0]];

/// The transformed Gaussians of a scene of degree 1.
fn transformed(scene: &SceneBuffers) -> SceneBuffers {
    let gaussians = (0..scene.positions.len()).map(|i| {
        let [w, x, y, z] = scene.rotations[i];
        let [px, py, pz] = scene.positions[i];
        let sh = &scene.sh[4 * i..][..4];
        Gaussian {
            position: [0.25 - 2.0 * px, 2.0 * py - 0.5, 16.0 - 2.0 * pz],
            scale: scene.scales[i].map(|s| 2.0 * s),
            rotation: [-y, z, w, -x],
            opacity: scene.opacities[i],
            // The basis functions of the first degree are -y, z and -x.
            sh: vec![sh[0], sh[1], sh[2].map(|c| -c), sh[3].map(|c| -c)],
        }
    });
    SceneBuffers::new(1, gaussians)
}

#[gaurast_runner::test(each = simd_levels())]
fn an_instance_is_a_scene_that_was_transformed_before(case: &Case) {
    let scene = exact(&scenes::cloud(32, 900, 1));
    let both = {
        let (a, b) = (scene.clone(), transformed(&scene));
        SceneBuffers {
            positions: [a.positions, b.positions].concat(),
            scales: [a.scales, b.scales].concat(),
            rotations: [a.rotations, b.rotations].concat(),
            opacities: [a.opacities, b.opacities].concat(),
            sh: [a.sh, b.sh].concat(),
            degree: 1,
        }
    };
    let camera = pinhole();
    let oracle = OracleCamera::new(&camera, SIZE).expect("a pinhole");
    let instances = [IDENTITY, SIMILARITY].map(|matrix| OracleInstance { matrix, opacity: 1.0 });
    static REFERENCES: ForLevels<Reference> = ForLevels::new();
    let gpu = device(case);
    // Both in one sorted set: as one draw, or as one instance each.
    for state in [State::default(), State::default().linearization(GaussianLinearizationGAURAST::UNSCENTED)] {
        let expected = REFERENCES.get(&format!("{:?}", state.linearization), || {
            render_bounded(&both.as_oracle(), &oracle, &OracleState::from(&state))
        });
        let way = Way { state, instances: Some((&instances, vk::VertexInputRate::INSTANCE)), ..Way::new(camera) };
        let picture = draw(&gpu, &scene, &way);
        assert_contract(case.variant(), &picture, &expected, Limits::ENVELOPE_ONLY);
    }
}

#[gaurast_runner::test]
fn every_vertex_may_have_a_matrix_of_its_own() {
    let gpu = Gpu::embedded(&Settings::default()).expect("a device");
    let scene = scenes::cloud(33, 300, 0);
    let some = any_instances(33);
    let of_vertex: Vec<OracleInstance> = (0..300).map(|vertex| some[vertex % some.len()]).collect();
    let way = Way { instances: Some((&of_vertex, vk::VertexInputRate::VERTEX)), ..Way::new(pinhole()) };
    let picture = draw(&gpu, &scene, &way);
    let camera = OracleCamera::new(&way.camera, SIZE).expect("a pinhole");
    let whole = OracleScene { instances: &of_vertex, ..scene.as_oracle() };
    let expected = render_bounded(&whole, &camera, &OracleState::from(&way.state));
    assert_contract("by vertex", &picture, &expected, Limits::ENVELOPE_ONLY);
}

#[gaurast_runner::test(each = simd_levels())]
fn half_floats_are_the_floats_that_they_are(case: &Case) {
    let scene = scenes::cloud(34, 2000, 2);
    let round = |value: f32| f16::from_f32(value).to_f32();
    let triples = |values: &[[f32; 3]]| values.iter().map(|v| v.map(round)).collect();
    let rounded = SceneBuffers {
        positions: triples(&scene.positions),
        scales: triples(&scene.scales),
        rotations: scene.rotations.iter().map(|q| q.map(round)).collect(),
        opacities: scene.opacities.iter().copied().map(round).collect(),
        sh: triples(&scene.sh),
        degree: scene.degree,
    };
    let way = Way::new(pinhole());
    let gpu = device(case);
    let half = draw(&gpu, &scene, &Way { half: true, ..way });
    let float = draw(&gpu, &rounded, &way);
    assert!(half == float);
    // A position of eleven bits has a relative error of a thousandth, which moves the picture by a fraction of a pixel.
    let exact = draw(&gpu, &scene, &way);
    let pairs = exact.as_flattened().iter().zip(half.as_flattened());
    let squares: f64 = pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum();
    let deviation = (squares / (4 * exact.len()) as f64).sqrt();
    assert!(deviation > 0.0 && deviation < 0.02, "{deviation}");
}

#[gaurast_runner::test(each = simd_levels())]
fn a_scene_that_moves_far_away_with_its_camera_looks_the_same(case: &Case) {
    const FAR: f32 = 1_048_576.0;
    let mut scene = scenes::cloud(35, 1500, 1);
    // The positions are exact in binary32 at this distance.
    let round = |value: f32| (value * 8.0).round() / 8.0;
    for position in &mut scene.positions {
        *position = position.map(round);
    }
    let camera = pinhole().eye([0.03, -0.02, 0.01]);
    static REFERENCES: ForLevels<Reference> = ForLevels::new();
    let expected = REFERENCES.get("the scene", || {
        let once = [OracleInstance::default()];
        reference(&scene, &once, &State::default(), &camera)
    });
    let far = camera.eye(camera.eye.map(|at| at + f64::from(FAR)));
    let moved = SceneBuffers {
        positions: (scene.positions.iter()).map(|position| position.map(|at| at + FAR)).collect(),
        ..scene.clone()
    };
    let mut matrix = IDENTITY;
    for row in &mut matrix {
        row[3] = FAR;
    }
    let instances = [OracleInstance { matrix, opacity: 1.0 }];
    let gpu = device(case);
    let by_matrix = Way { instances: Some((&instances, vk::VertexInputRate::INSTANCE)), ..Way::new(far) };
    for (name, picture) in
        [("by its positions", draw(&gpu, &moved, &Way::new(far))), ("by a matrix", draw(&gpu, &scene, &by_matrix))]
    {
        let name = format!("{name}, {}", case.variant());
        assert_contract(&name, &picture, &expected, Limits::ENVELOPE_ONLY);
    }
}
