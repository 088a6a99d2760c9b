//! Dynamic states: a pipeline with all of them gives the same pictures as pipelines with fixed values.

use super::bench::{Options, Pipeline, SIZE, State, Stream, extension, pictures};
use ash::vk;
use gaurast::vk::{
    DYNAMIC_STATE_GAUSSIAN_ALPHA_CEILING_GAURAST, DYNAMIC_STATE_GAUSSIAN_ALPHA_FLOOR_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_ANTIALIASING_GAURAST, DYNAMIC_STATE_GAUSSIAN_CONTRIBUTION_BUDGET_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_EXPONENTIAL_ERROR_GAURAST, DYNAMIC_STATE_GAUSSIAN_LOW_PASS_VARIANCE_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_ORDER_GAURAST, DYNAMIC_STATE_GAUSSIAN_SPHERICAL_HARMONICS_DEGREE_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_TRANSMITTANCE_FLOOR_GAURAST, GaussianAntialiasingGAURAST, GaussianOrderGAURAST,
    PipelineGaussianApproximationStateCreateInfoGAURAST,
};
use gaurast_testkit::Commands;
use gaurast_tests::compare::{Limits, assert_contract};
use gaurast_tests::oracle::{OracleCamera, OracleScene, OracleState, render_bounded};
use gaurast_tests::scenes;

type Approximation = PipelineGaussianApproximationStateCreateInfoGAURAST<'static>;

const ALL: [vk::DynamicState; 9] = [
    DYNAMIC_STATE_GAUSSIAN_ORDER_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_ANTIALIASING_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_LOW_PASS_VARIANCE_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_ALPHA_FLOOR_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_ALPHA_CEILING_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_TRANSMITTANCE_FLOOR_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_SPHERICAL_HARMONICS_DEGREE_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_EXPONENTIAL_ERROR_GAURAST,
    DYNAMIC_STATE_GAUSSIAN_CONTRIBUTION_BUDGET_GAURAST,
];

/// The degree of the scene, and of the pipeline with dynamic states.
const DEGREE: u32 = 3;

/// Values of all dynamic states. The degree is in the state.
type Values = (State, Approximation);

fn settings() -> [Values; 6] {
    let exact = Approximation::default();
    let of_degree = |degree| State::default().spherical_harmonics_degree(degree);
    [
        (of_degree(3), exact),
        (
            of_degree(2)
                .order(GaussianOrderGAURAST::RADIAL_DISTANCE)
                .antialiasing(GaussianAntialiasingGAURAST::OPACITY_COMPENSATED)
                .low_pass_variance(0.1)
                .alpha_floor(0.02)
                .alpha_ceiling(0.999),
            exact,
        ),
        (of_degree(1).order(GaussianOrderGAURAST::PRIMITIVE).low_pass_variance(1.5).transmittance_floor(0.05), exact),
        (
            of_degree(0)
                .order(GaussianOrderGAURAST::PER_PIXEL)
                .alpha_floor(0.001)
                .alpha_ceiling(1.0)
                .transmittance_floor(0.0),
            exact,
        ),
        (of_degree(3).alpha_ceiling(0.6), exact.exponential_error(0.01).contribution_budget(0.02)),
        (of_degree(3), exact),
    ]
}

/// Records the values.
fn set(commands: &Commands, (state, approximation): &Values) {
    let (extension, raw) = (extension(), commands.raw);
    // SAFETY: the command buffer is being recorded.
    unsafe {
        extension.cmd_set_gaussian_order(raw, state.order);
        extension.cmd_set_gaussian_antialiasing(raw, state.antialiasing);
        extension.cmd_set_gaussian_low_pass_variance(raw, state.low_pass_variance);
        extension.cmd_set_gaussian_alpha_floor(raw, state.alpha_floor);
        extension.cmd_set_gaussian_alpha_ceiling(raw, state.alpha_ceiling);
        extension.cmd_set_gaussian_transmittance_floor(raw, state.transmittance_floor);
        let degree = state.spherical_harmonics_degree;
        extension.cmd_set_gaussian_spherical_harmonics_degree(raw, degree);
        extension.cmd_set_gaussian_exponential_error(raw, approximation.exponential_error);
        extension.cmd_set_gaussian_contribution_budget(raw, approximation.contribution_budget);
    }
}

#[gaurast_runner::test]
fn every_dynamic_state_in_one_pipeline_is_static_pipelines() {
    let scene = scenes::cloud(72, 1500, DEGREE);
    let (streams, count) = (Stream::of(&scene), scene.positions.len() as u32);
    let camera = scenes::camera(SIZE[0], SIZE[1]).to_vulkan();
    let draw = |pipeline: &Pipeline, values: Option<&Values>| {
        let mut all = pictures(1, 0, |commands| {
            // Dynamic state may be set before and after the pipeline is bound.
            pipeline.bind(commands, &streams, None);
            if let Some(values) = values {
                set(commands, values);
            }
            // SAFETY: the command buffer is being recorded.
            unsafe { extension().cmd_set_gaussian_cameras(commands.raw, &[camera]) };
            commands.draw(0..count);
        });
        all.remove(0)
    };
    // The pipeline's own values of dynamic states are ignored, even if they are invalid.
    let ignored = State::default().alpha_floor(7.0).low_pass_variance(-1.0);
    let dynamic = Pipeline::new(&streams, &Options { dynamic: ALL.to_vec(), ..Options::new(ignored, DEGREE) });
    let mut drawn: Vec<Vec<[f32; 4]>> = Vec::new();
    for (number, values) in settings().iter().enumerate() {
        let (state, approximation) = values;
        let degree = state.spherical_harmonics_degree;
        let fixed =
            Pipeline::new(&streams, &Options { approximation: Some(*approximation), ..Options::new(*state, degree) });
        let picture = draw(&dynamic, Some(values));
        assert!(picture == draw(&fixed, None), "{number}");
        if approximation.exponential_error == 0.0 {
            let oracle = OracleCamera::new(&camera, SIZE).expect("a pinhole");
            let drawn_degree = OracleScene { requested_degree: degree, ..scene.as_oracle() };
            let expected = render_bounded(&drawn_degree, &oracle, &OracleState::from(state));
            assert_contract(&format!("setting {number}"), &picture, &expected, Limits::ENVELOPE_ONLY);
        }
        drawn.push(picture);
    }
    // Each setting has an effect, and the last setting equals the first.
    assert!(drawn[5] == drawn[0]);
    for number in 1..5 {
        assert!(drawn[number] != drawn[0], "{number}");
    }
}
