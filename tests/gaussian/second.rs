//! The second implementation, which was written from the extension's text alone, against the oracle and beside the device.

use ash::vk;
use gaurast::vk::{
    GaussianAntialiasingGAURAST, GaussianCameraGAURAST, PipelineGaussianStateCreateInfoGAURAST,
};
use gaurast_runner::{Need, data};
use gaurast_second as second;
use gaurast_tests::compare::{Limits, assert_contract};
use gaurast_tests::contexts::{Context, Settings};
use gaurast_tests::oracle::sample_tests::compare;
use gaurast_tests::oracle::{
    OracleCamera, OracleDepthFormat, OracleState, OracleTests, Stored, render_bounded,
    render_tested,
};
use gaurast_tests::scenes::{self, SceneBuffers};

use super::accuracy::{PLANT, SIZE, State, View, draw, generated_view, states, views};
use super::{PLAYBOT, SKULL};

/// How far the second implementation may be from the envelope: it is of binary64, so that little but the rounding of its
/// picture to binary32 remains.
const LIMITS: Limits = Limits {
    distance: 2e-7,
    ..Limits::ENVELOPE_ONLY
};

/// A draw, as the second implementation takes it.
struct Second<'a> {
    gaussians: Vec<second::Gaussian<'a>>,
    camera: second::Camera,
    viewport: second::Viewport,
    state: second::State,
}

impl<'a> Second<'a> {
    fn new(
        scene: &'a SceneBuffers,
        camera: &GaussianCameraGAURAST,
        size: [u32; 2],
        state: &PipelineGaussianStateCreateInfoGAURAST,
    ) -> Self {
        let coefficients = (scene.degree + 1).pow(2) as usize;
        let [right, down, forward] = [0, 3, 6].map(|row| {
            let row: [f32; 3] = camera.rotation[row..row + 3].try_into().expect("a row");
            row
        });
        Self {
            gaussians: (0..scene.positions.len())
                .map(|index| second::Gaussian {
                    position: scene.positions[index],
                    scale: scene.scales[index],
                    rotation: scene.rotations[index],
                    opacity: scene.opacities[index],
                    harmonics: &scene.sh[index * coefficients..][..coefficients],
                })
                .collect(),
            camera: second::Camera {
                rotation: [right, down, forward],
                eye: camera.eye,
                focal_length: camera.focal_length,
                principal_point: camera.principal_point,
                near_plane: camera.near_plane,
                far_plane: camera.far_plane,
                depth_coefficients: camera.depth_coefficients,
            },
            viewport: second::Viewport::whole(size[0] as usize, size[1] as usize),
            state: second::State {
                spherical_harmonics_degree: scene.degree as usize,
                antialiasing: match state.antialiasing {
                    GaussianAntialiasingGAURAST::OPACITY_COMPENSATED => {
                        second::Antialiasing::OpacityCompensated
                    }
                    _ => second::Antialiasing::Dilate,
                },
                low_pass_variance: state.low_pass_variance,
                alpha_floor: state.alpha_floor,
                alpha_ceiling: state.alpha_ceiling,
                transmittance_floor: state.transmittance_floor,
            },
        }
    }

    /// The picture over nothing.
    fn picture(&self) -> Vec<[f32; 4]> {
        let [width, height] = [self.viewport.width, self.viewport.height].map(|side| side as usize);
        let mut attachments = second::Attachments {
            width,
            color: vec![[0.0; 4]; width * height],
            depth: Vec::new(),
        };
        self.draw(None, &mut attachments);
        attachments.color
    }

    fn draw(&self, test: Option<second::DepthTest>, attachments: &mut second::Attachments) {
        second::draw(
            &self.gaussians,
            &self.camera,
            &self.viewport,
            &self.state,
            test,
            attachments,
        );
    }
}

/// Holds the pictures of both implementations against the oracle's.
fn judge(context: &Context, name: &str, scene: &SceneBuffers, state: State, views: &[View]) {
    let pictures = draw(context, scene, state, views);
    for (view, drawn) in views.iter().zip(pictures) {
        let name = format!("{name}, {}", view.name);
        let camera = OracleCamera::new(&view.camera, view.size).expect("a pinhole");
        let reference = render_bounded(&scene.as_oracle(), &camera, &OracleState::from(&state));
        let ours = Second::new(scene, &view.camera, view.size, &state).picture();
        let verdict = assert_contract(&format!("{name}, second"), &ours, &reference, LIMITS);
        let device = assert_contract(&name, &drawn, &reference, view.limits);
        println!(
            "{name}: the second {:.1e} from the envelope, {} pixels in another branch; the device {:.1e}, {}",
            verdict.max_distance, verdict.other_branch, device.max_distance, device.other_branch,
        );
    }
}

fn context() -> Context {
    Context::embedded(&Settings::default())
}

/// Views of generated scenes: from in front, from the middle, where Gaussians lie at the near plane and all around, turned
/// and off centre, and mirrored.
fn generated_views() -> Vec<View> {
    let front = generated_view(Limits::ENVELOPE_ONLY).camera;
    let view = |name: &str, camera| View {
        name: name.to_owned(),
        camera,
        size: SIZE,
        limits: Limits::ENVELOPE_ONLY,
    };
    vec![
        view("in front", front),
        view("inside", front.eye([0.2, -0.1, 5.0])),
        view(
            "turned",
            front
                .rotation([0.8, 0.0, -0.6, 0.36, 0.8, 0.48, 0.48, -0.6, 0.64])
                .eye([3.0, 2.0, 1.0])
                .focal_length([120.0, 150.0])
                .principal_point([40.0, 130.0]),
        ),
        view(
            "mirrored, between two planes",
            front
                .rotation([-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
                .near_plane(3.0)
                .far_plane(8.0),
        ),
    ]
}

#[gaurast_runner::test]
fn both_draw_generated_scenes_in_every_state_and_degree() {
    let context = context();
    for (seed, degree) in [(41, 0), (42, 1), (43, 2), (44, 3), (45, 4)] {
        let scene = scenes::cloud(seed, 2500, degree);
        for (name, state) in states() {
            let name = format!("cloud {seed} {name}");
            judge(&context, &name, &scene, state, &generated_views());
        }
    }
}

#[gaurast_runner::test]
fn both_draw_needles_discs_giants_and_what_lies_at_the_near_plane() {
    let context = context();
    for seed in 300..330 {
        let scene = scenes::awkward(seed, 10 + 2 * (seed % 20) as usize, (seed % 4) as u32);
        for (name, state) in states() {
            let name = format!("awkward {seed} {name}");
            judge(&context, &name, &scene, state, &generated_views());
        }
    }
}

#[gaurast_runner::test]
fn both_draw_the_synthetic_scene() {
    let size = [480, 270];
    let view = View {
        name: "480x270".to_owned(),
        camera: scenes::synthetic_camera(size).to_vulkan(),
        size,
        limits: Limits::ENVELOPE_ONLY,
    };
    let scene = SceneBuffers::from(&scenes::synthetic(1, 60_000));
    judge(&context(), "synthetic", &scene, State::default(), &[view]);
}

#[gaurast_runner::test]
fn both_draw_far_from_the_origin() {
    // Positions are binary32: a unit in the last place is 1/16 there.
    let away = 1e6_f32;
    let mut scene = scenes::cloud(46, 1500, 1);
    for position in &mut scene.positions {
        *position = position.map(|c| c + away);
    }
    let mut views = generated_views();
    for view in &mut views {
        view.camera = view
            .camera
            .eye(view.camera.eye.map(|c| c + f64::from(away) + 1.0 / 7.0));
    }
    judge(&context(), "far", &scene, State::default(), &views);
}

/// The trained scene of a file, from three sides.
fn both_draw(name: &'static str) {
    let scene = gaurast_scene::open(data(name)).expect("a scene");
    let mut views = views(&scene);
    views.retain(|view| view.size == [640, 480]);
    assert_eq!(views.len(), 3);
    let scene = SceneBuffers::from(&scene);
    judge(&context(), name, &scene, State::default(), &views);
}

#[gaurast_runner::test(needs = [Need::Data(SKULL)])]
fn both_draw_the_skull() {
    both_draw(SKULL);
}

#[gaurast_runner::test(needs = [Need::Data(PLAYBOT)])]
fn both_draw_the_playbot() {
    both_draw(PLAYBOT);
}

#[gaurast_runner::test(needs = [Need::Data(PLANT)])]
fn both_draw_the_plant() {
    both_draw(PLANT);
}

/// Depth tests of the second implementation: the device's are held against the same oracle by `depth_stencil`.
#[gaurast_runner::test]
fn the_second_tests_and_writes_depths() {
    use second::CompareOp as Op;
    let operations = [
        (vk::CompareOp::NEVER, Op::Never),
        (vk::CompareOp::LESS, Op::Less),
        (vk::CompareOp::EQUAL, Op::Equal),
        (vk::CompareOp::LESS_OR_EQUAL, Op::LessOrEqual),
        (vk::CompareOp::GREATER, Op::Greater),
        (vk::CompareOp::NOT_EQUAL, Op::NotEqual),
        (vk::CompareOp::GREATER_OR_EQUAL, Op::GreaterOrEqual),
        (vk::CompareOp::ALWAYS, Op::Always),
    ];
    let formats = [
        (OracleDepthFormat::Unorm(16), second::DepthFormat::Unorm16),
        (OracleDepthFormat::Unorm(24), second::DepthFormat::Unorm24),
        (OracleDepthFormat::Float, second::DepthFormat::Float32),
    ];
    let mut scene = scenes::cloud(47, 1500, 1);
    for (position, scale) in scene.positions.iter_mut().zip(&mut scene.scales) {
        // Many at the same depths, some of which are stored.
        position[2] = (2.0 * position[2]).round() / 2.0;
        *scale = scale.map(|s| 4.0 * s);
    }
    let camera = scenes::camera(SIZE[0], SIZE[1])
        .to_vulkan()
        .depth_coefficients([16.0 / 15.0, -16.0 / 15.0]);
    let oracle = OracleCamera::new(&camera, SIZE).expect("a pinhole");
    let state = State::default();
    let pixels = (SIZE[0] * SIZE[1]) as usize;
    for (oracle_format, format) in formats {
        for (op, compare_op) in operations {
            let tests = OracleTests {
                depth_coefficients: camera.depth_coefficients,
                depth_range: [0.25, 0.875],
                format: oracle_format,
                depth: Some((op, true)),
                bounds: None,
                stencil: None,
            };
            // Depths of the cloud in stripes.
            let before = |at: usize| tests.code(oracle.model, 2.0 + (at / 7 % 9) as f32);
            let stored = Stored {
                depth: (0..pixels).map(before).collect(),
                stencil: Vec::new(),
            };
            let reference = render_tested(
                &scene.as_oracle(),
                &oracle,
                &OracleState::from(&state),
                &tests,
                &stored,
            );
            let mut second = Second::new(&scene, &camera, SIZE, &state);
            second.viewport.min_depth = 0.25;
            second.viewport.max_depth = 0.875;
            let behind = [0.25, 0.5, 0.75, 1.0];
            let mut attachments = second::Attachments {
                width: SIZE[0] as usize,
                color: vec![behind; pixels],
                depth: stored
                    .depth
                    .iter()
                    .map(|&code| oracle_format.depth(code))
                    .collect(),
            };
            let test = second::DepthTest {
                compare: compare_op,
                write: true,
                format,
            };
            second.draw(Some(test), &mut attachments);
            let name = format!("second, {op:?} {oracle_format:?}");
            let expected = reference.color.over(&vec![behind.map(f64::from); pixels]);
            assert_contract(&name, &attachments.color, &expected, LIMITS);
            let mut changed = 0;
            for (at, &depth) in attachments.depth.iter().enumerate() {
                let code = oracle_format.code(depth);
                let allowed = reference.depth[at].as_ref();
                assert!(
                    allowed.is_none_or(|allowed| allowed.contains(&code)),
                    "{name}: pixel {at} stores {code:#x}, not one of {allowed:x?}"
                );
                if code != stored.depth[at] {
                    changed += 1;
                    assert!(compare(op, code, stored.depth[at]), "{name}: pixel {at}");
                }
            }
            let changes = !matches!(op, vk::CompareOp::NEVER | vk::CompareOp::EQUAL);
            assert_eq!(
                changed > pixels / 20,
                changes,
                "{name}: {changed} depths written"
            );
        }
    }
}
