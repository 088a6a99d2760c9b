//! Multiview: one pass draws every view through its own camera.

use super::bench::{Options, Pipeline, SIZE, State, Stream, extension, pictures};
use gaurast::vk::{
    GaussianCameraDataGAURAST, GaussianCameraGAURAST, GaussianCameraSourceGAURAST, GaussianLinearizationGAURAST,
    GaussianOrderGAURAST,
};
use gaurast_testkit::devices::own;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{Bindings, Buffer, Commands, Resource};
use gaurast_tests::compare::{Limits, assert_contract};
use gaurast_tests::oracle::{OracleCamera, OracleState, render_bounded};
use gaurast_tests::scenes::{self, SceneBuffers};

type Camera = GaussianCameraGAURAST<'static>;
type Picture = Vec<[f32; 4]>;

/// The cameras of a left and of a right eye, which also differ in their principal points.
fn eyes() -> [Camera; 2] {
    let middle = scenes::camera(SIZE[0], SIZE[1]).to_vulkan();
    [-1.0f32, 1.0].map(|side| {
        let [x, y] = middle.principal_point;
        middle.eye([0.1 * f64::from(side), 0.02, -0.3]).principal_point([x - 6.0 * side, y + side])
    })
}

fn set(commands: &Commands, cameras: &[Camera]) {
    // SAFETY: the command buffer is being recorded.
    unsafe { extension().cmd_set_gaussian_cameras(commands.raw, cameras) };
}

/// The picture of a pass without views.
fn single(streams: &[Stream], count: u32, options: &Options<'_>, camera: &Camera) -> Picture {
    let options = Options { view_mask: 0, ..options.clone() };
    let pipeline = Pipeline::new(streams, &options);
    let mut all = pictures(1, 0, |commands| {
        pipeline.bind(commands, streams, None);
        set(commands, &[*camera]);
        commands.draw(0..count);
    });
    all.remove(0)
}

/// Checks that a picture is not empty.
fn is_drawn(picture: &Picture) {
    let covered = picture.iter().filter(|pixel| pixel[3] > 0.1).count();
    assert!(covered > picture.len() / 20, "{covered}");
}

fn scene() -> SceneBuffers {
    scenes::cloud(71, 1200, 2)
}

/// A stereo pair in one pass equals two single passes bit for bit, and is within the oracle's envelope.
#[gaurast_runner::test]
fn a_stereo_pair_in_one_pass_is_two_single_passes() {
    let scene = scene();
    let (streams, count) = (Stream::of(&scene), scene.positions.len() as u32);
    let (eyes, mask) = (eyes(), 0b11);
    let states = [
        State::default(),
        State::default().order(GaussianOrderGAURAST::RADIAL_DISTANCE),
        State::default().order(GaussianOrderGAURAST::PER_PIXEL),
        State::default().linearization(GaussianLinearizationGAURAST::UNSCENTED),
    ];
    for state in states {
        let options = Options { view_mask: mask, ..Options::new(state, scene.degree) };
        let pipeline = Pipeline::new(&streams, &options);
        let pair = pictures(3, mask, |commands| {
            pipeline.bind(commands, &streams, None);
            set(commands, &eyes);
            commands.draw(0..count);
        });
        for (eye, picture) in eyes.iter().zip(&pair) {
            is_drawn(picture);
            assert!(*picture == single(&streams, count, &options, eye));
            let camera = OracleCamera::new(eye, SIZE).expect("a pinhole");
            let expected = render_bounded(&scene.as_oracle(), &camera, &OracleState::from(&state));
            let name = format!("{:?}, {:?}", state.order, state.linearization);
            assert_contract(&name, picture, &expected, Limits::ENVELOPE_ONLY);
        }
        assert!(pair[0] != pair[1]);
        assert!(pair[2].iter().all(|pixel| *pixel == [0.0; 4]), "the third layer is no view");
    }
}

/// A view's number is its bit in the mask. A single camera is used for all views.
#[gaurast_runner::test]
fn a_view_sees_through_the_camera_of_its_index() {
    let scene = scene();
    let (streams, count) = (Stream::of(&scene), scene.positions.len() as u32);
    let mask = 0b101;
    let options = Options { view_mask: mask, ..Options::new(State::default(), scene.degree) };
    let pipeline = Pipeline::new(&streams, &options);
    let [left, right] = eyes();
    let drawn = |cameras: &[Camera]| {
        pictures(3, mask, |commands| {
            pipeline.bind(commands, &streams, None);
            set(commands, cameras);
            commands.draw(0..count);
        })
    };
    let [of_left, of_right] = [left, right].map(|eye| single(&streams, count, &options, &eye));
    let nobody = left.eye([1e3; 3]);
    let pair = drawn(&[left, nobody, right]);
    assert!(pair[0] == of_left && pair[2] == of_right);
    assert!(pair[1].iter().all(|pixel| *pixel == [0.0; 4]));
    let same = drawn(&[right]);
    assert!(same[0] == of_right && same[2] == of_right);
    // View 2 has no camera.
    let none = drawn(&[left, right]);
    assert!(none.concat().iter().all(|pixel| *pixel == [0.0; 4]));
}

/// A uniform buffer holds an array of cameras.
#[gaurast_runner::test]
fn a_uniform_buffer_has_a_camera_for_each_view() {
    let scene = scene();
    let (streams, count) = (Stream::of(&scene), scene.positions.len() as u32);
    let (eyes, mask) = (eyes(), 0b11);
    let data = (eyes.iter()).map(|eye| GaussianCameraDataGAURAST::from(eye).to_bytes());
    let data: Vec<[u8; 128]> = data.collect();
    let buffer = Buffer::of(own(), data.as_flattened());
    let bindings = Bindings::new(own(), &[Resource::Uniform(buffer.raw)]);
    let state = State::default().camera_source(GaussianCameraSourceGAURAST::UNIFORM_BUFFER).camera_count(2);
    let options = Options { view_mask: mask, bindings: Some(&bindings), ..Options::new(state, scene.degree) };
    let pipeline = Pipeline::new(&streams, &options);
    let pair = pictures(2, mask, |commands| {
        pipeline.bind(commands, &streams, Some(&bindings));
        commands.draw(0..count);
    });
    let by_command = Options::new(State::default(), scene.degree);
    for (eye, picture) in eyes.iter().zip(&pair) {
        is_drawn(picture);
        assert!(*picture == single(&streams, count, &by_command, eye));
    }
}

/// A resolve shader can read its view index.
#[gaurast_runner::test(needs = [GLSLANG])]
fn a_resolve_shader_runs_for_each_view() {
    let scene = scene();
    let (streams, count) = (Stream::of(&scene), scene.positions.len() as u32);
    let (eyes, mask) = (eyes(), 0b11);
    let plain = Options { view_mask: mask, ..Options::new(State::default(), scene.degree) };
    let mut options = plain.clone();
    options.state.resolve_input_locations.accumulated_color = 0;
    options.fragment = Some(
        "#extension GL_EXT_multiview : require
        layout(location = 0) in vec4 accumulated;
        layout(location = 0) out vec4 color;
        void main() { color = accumulated * (1.0 + float(gl_ViewIndex)); }",
    );
    let pipeline = Pipeline::new(&streams, &options);
    let pair = pictures(2, mask, |commands| {
        pipeline.bind(commands, &streams, None);
        set(commands, &eyes);
        commands.draw(0..count);
    });
    for (factor, (eye, picture)) in [1.0, 2.0].into_iter().zip(eyes.iter().zip(&pair)) {
        let one = single(&streams, count, &plain, eye);
        let scaled = one.iter().map(|pixel| pixel.map(|c| c * factor));
        assert!(picture.iter().copied().eq(scaled));
    }
}
