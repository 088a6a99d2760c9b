//! The second implementation, which was written from the extension's text alone, compared with the oracle and with the
//! device.

use gaurast_conformance::{Draw, Implementation, Outcome, Second, all, cases, run};
use gaurast_runner::{Case, Need, Variant, data};
use gaurast_testkit::{Gpu, Settings};
use gaurast_tests::compare::{Limits, assert_contract};
use gaurast_tests::oracle::{OracleCamera, OracleState, Stored, render_bounded};
use gaurast_tests::scenes::{self, SceneBuffers};

use super::accuracy::{PLANT, SIZE, State, View, draw, generated_view, states, views};
use super::{PLAYBOT, SKULL};

/// The limits of the second implementation. It computes in binary64, so little more than the rounding of its picture to
/// binary32 is allowed.
const LIMITS: Limits = Limits { distance: 2e-7, ..Limits::ENVELOPE_ONLY };

/// Compares the pictures of both implementations with the oracle's.
fn judge(gpu: &Gpu, name: &str, scene: &SceneBuffers, state: State, views: &[View]) {
    let pictures = draw(gpu, scene, state, views);
    for (view, drawn) in views.iter().zip(pictures) {
        let name = format!("{name}, {}", view.name);
        let camera = OracleCamera::new(&view.camera, view.size).expect("a pinhole");
        let reference = render_bounded(&scene.as_oracle(), &camera, &OracleState::from(&state));
        let as_data = Draw { size: view.size, ..Draw::new(scene.clone()) };
        let as_data = as_data.in_state(|_| state).seen_by(view.camera);
        assert_eq!(Second.missing(&as_data), None);
        let ours = Second.draw(&as_data, &Stored::default()).expect("it draws").color;
        let accuracy = assert_contract(&format!("{name}, second"), &ours, &reference, LIMITS);
        let device = assert_contract(&name, &drawn, &reference, view.limits);
        println!(
            "{name}: the second {:.1e} from the envelope, {} pixels in another branch; the device {:.1e}, {}",
            accuracy.max_distance, accuracy.other_branch, device.max_distance, device.other_branch,
        );
    }
}

fn gpu() -> Gpu {
    Gpu::embedded(&Settings::default()).expect("a device")
}

/// Views of generated scenes: from the front; from the middle, with Gaussians at the near plane and all around; rotated
/// and off centre; and mirrored.
fn generated_views() -> Vec<View> {
    let front = generated_view(Limits::ENVELOPE_ONLY).camera;
    let view = |name: &str, camera| View { name: name.to_owned(), camera, size: SIZE, limits: Limits::ENVELOPE_ONLY };
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
            front.rotation([-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]).near_plane(3.0).far_plane(8.0),
        ),
    ]
}

#[gaurast_runner::test]
fn both_draw_generated_scenes_in_every_state_and_degree() {
    let gpu = gpu();
    for (seed, degree) in [(41, 0), (42, 1), (43, 2), (44, 3), (45, 4)] {
        let scene = scenes::cloud(seed, 2500, degree);
        for (name, state) in states() {
            let name = format!("cloud {seed} {name}");
            judge(&gpu, &name, &scene, state, &generated_views());
        }
    }
}

#[gaurast_runner::test]
fn both_draw_needles_discs_giants_and_what_lies_at_the_near_plane() {
    let gpu = gpu();
    for seed in 300..330 {
        let scene = scenes::awkward(seed, 10 + 2 * (seed % 20) as usize, (seed % 4) as u32);
        for (name, state) in states() {
            let name = format!("awkward {seed} {name}");
            judge(&gpu, &name, &scene, state, &generated_views());
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
    judge(&gpu(), "synthetic", &scene, State::default(), &[view]);
}

#[gaurast_runner::test]
fn both_draw_far_from_the_origin() {
    // Positions are binary32, whose unit in the last place is 1/16 at this distance.
    let away = 1e6_f32;
    let mut scene = scenes::cloud(46, 1500, 1);
    for position in &mut scene.positions {
        *position = position.map(|c| c + away);
    }
    let mut views = generated_views();
    for view in &mut views {
        view.camera = view.camera.eye(view.camera.eye.map(|c| c + f64::from(away) + 1.0 / 7.0));
    }
    judge(&gpu(), "far", &scene, State::default(), &views);
}

/// Compares both implementations on the trained scene of a file, from three sides.
fn both_draw(name: &'static str) {
    let scene = gaurast_scene::open(data(name)).expect("a scene");
    let mut views = views(&scene);
    views.retain(|view| view.size == [640, 480]);
    assert_eq!(views.len(), 3);
    let scene = SceneBuffers::from(&scene);
    judge(&gpu(), name, &scene, State::default(), &views);
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

fn chapters() -> Vec<Variant> {
    let supported = |chapter: &&str| {
        let mut cases = all().into_iter().filter(|case| case.chapter == *chapter);
        cases.any(|case| case.draw().is_some_and(|draw| Second.missing(&draw).is_none()))
    };
    cases::chapters().filter(supported).map(Variant::new).collect()
}

#[gaurast_runner::test(each = chapters())]
fn the_second_passes_the_conformance_cases(case: &Case) {
    let mut failures = Vec::new();
    for one in all().iter().filter(|one| one.chapter == case.variant()) {
        if let Outcome::Fail(failure) = run(one, &Second, Second.precision()) {
            failures.push(format!("{}: {}", one.path(), failure.message));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
